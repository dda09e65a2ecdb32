"""The coil's own capacitance: shapes, stacks and parts of turns against one another."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx
from wound_boards import of

from sitscad.estimates.windings.leads import gap_between_layers
from sitscad.estimates.windings.own_capacitance import dielectric_slabs, self_capacitance, turn_lengths
from sitscad.kernels.electromagnetics import capacitance
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

BENCH = "{shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}"


@pytest.mark.parametrize("shape", ["square", "hexagon", "octagon"])
def test_polygon_self_capacitance_scales_with_area(shape):
    own, _, _ = of(BENCH.replace("circle", shape), "flex-2l-35um")
    round_one, _, _ = of(BENCH, "flex-2l-35um")
    area = {"square": 4.0 / math.pi, "hexagon": 6 * math.tan(math.pi / 6) / math.pi,
            "octagon": 8 * math.tan(math.pi / 8) / math.pi}[shape]
    assert own == approx(round_one * area, rel=0.05)


def test_turn_lengths_add_up_to_track_length():
    layout = lay_out(load_text(f"sitscad: 1\nname: c\ncoil: {BENCH}\n", "c.yaml"))
    turns = layout.spec.coil.turns
    lengths = turn_lengths(layout.coils[0], layout.spec.coil, turns * (np.arange(12) + 0.5) / 12)
    assert lengths.mean() * turns == approx(layout.coils[0].windings[0].path.length, rel=1e-6)
    assert lengths[0] == approx(2 * math.pi * (3.45e-3 - 0.1e-3), rel=1e-3)


def test_four_layers_have_less_self_capacitance_than_two():
    # each gap sees half of the voltage at most, and gaps work in series
    two, _, _ = of("{shape: circle, outer_diameter: 4, turns: 7.75, layers: [1, 2], trace_width: 80 um, "
                   "trace_spacing: 80 um}", "flex-4l")
    four, _, _ = of("{shape: circle, outer_diameter: 4, turns: 7.75, layers: 4, trace_width: 80 um, "
                    "trace_spacing: 80 um}", "flex-4l")
    assert four < two


@pytest.mark.parametrize(("stackup", "width"), [("flex-2l-35um", 200), ("flex-2l-35um", 100), ("flex-4l", 80)])
def test_stacked_strip_capacitance_agrees_with_layered_sum(stackup, width, monkeypatch):
    """Thick copper under coverlay and air, by the layered sum with pairs far apart, against thin strips all in one."""
    monkeypatch.setattr(capacitance, "OFFSETS", ((0.0, 1.0),))
    monkeypatch.setattr(capacitance, "CELLS", 6)
    monkeypatch.setattr(capacitance, "HARMONICS", 1000)
    text = f"sitscad: 1\nname: c\ncoil: {BENCH}\nfpc: {{stackup: {stackup}}}\n"
    stack = load_text(text, "c.yaml").fpc.stackup
    width *= 1e-6
    whole = -capacitance.strip_layers(dielectric_slabs(stack, [1, 2]), width, 12 * width, 0.05)[0, 1] * 12 * width
    assert capacitance.stacked_strips(width, *gap_between_layers(stack, 1, 2)) == approx(whole, rel=0.06)


@pytest.mark.parametrize(
    ("one", "other"),
    [("7.75", "7.750001"), ("8", "8.000001"), ("19", "19.00001"), ("[9.5, 9.5]", "[9.5, 9.50001]")],
)
def test_tiny_change_of_turns_hardly_changes_self_capacitance(one, other):
    """From eight turns on every further turn began with one place more along the layer: 2e-3 at once."""
    coil = "{shape: circle, outer_diameter: 11, turns: 7.75, layers: 2, trace_width: 100 um, trace_spacing: 100 um}"
    result = []
    for turns in (one, other):
        text = f"sitscad: 1\nname: c\ncoil: {coil.replace('7.75', turns)}\n"
        layout = lay_out(load_text(text, "c.yaml"))
        result.append(self_capacitance(layout.coils[0], layout.spec.coil, layout.spec.fpc.stackup))
    assert result[0] == approx(result[1], rel=1e-5, abs=0.0) and result[0] != result[1]
