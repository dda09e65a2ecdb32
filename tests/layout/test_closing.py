"""Leads run round their coil no farther than its turns ask: the inductance at the contacts follows the winding's."""

import math
import re
from functools import cache
from itertools import pairwise

import pytest
from tolerance import approx

from sitscad.estimates.windings import leads
from sitscad.estimates.windings.leads import estimate_leads
from sitscad.estimates.windings.methods import choose_method, winding_geometry
from sitscad.layout import lay_out
from sitscad.layout.routing.branches import closing_cost, closing_turns, drawn_closing, least_closing
from sitscad.spec.load import load_text

FAR = 0.1
"""Turns beyond what cannot be spared that the corners of polygons, and an inner via in the way, may cost."""

BOARDS = {
    "one circle": ("shape: circle, outer_diameter: 8, layers: 2", "", (8.1, 8.3, 8.45)),
    "two circles": ("shape: circle, outer_diameter: 8, layers: 2", "pattern: line, count: 2, pitch: 9",
                    (8.05, 8.15, 8.2, 8.3, 8.4, 8.65)),
    "three circles": ("shape: circle, outer_diameter: 6, layers: 2", "pattern: line, count: 3, pitch: 7.2",
                      (8.1, 8.2, 8.3, 8.4)),
    "four circles of four layers": ("shape: circle, outer_diameter: 6, layers: 4",
                                    "pattern: line, count: 4, pitch: 7.2", (7.55, 7.65, 7.7)),
    "triangle": ("shape: circle, outer_diameter: 6, layers: 2", "pattern: triangle, pitch: 8", (8.1, 8.4)),
    "grid": ("shape: circle, outer_diameter: 6, layers: 2", "pattern: grid, count: [2, 2], pitch: 7.2", (8.15, 8.35)),
    "squares": ("shape: square, outer_diameter: 7, layers: 2", "pattern: line, count: 2, pitch: 8", (8, 8.25, 8.5)),
    "octagons": ("shape: octagon, outer_diameter: 7, layers: 2", "pattern: line, count: 2, pitch: 8", (8.125, 8.375)),
    "hexagon": ("shape: hexagon, outer_diameter: 7, layers: 4", "", (6, 6.16666667, 6.5)),
    "racetracks": ("shape: racetrack, outer_diameter: [9, 6], layers: 2", "pattern: line, count: 2, pitch: 10.5",
                   (6, 6.5)),
    "clockwise": ("shape: circle, outer_diameter: 8, layers: 2, sense: clockwise", "pattern: line, count: 2, pitch: 9",
                  (8.15, 8.35)),
    "one layer": ("shape: circle, outer_diameter: 8, layers: 1, start_angle: 100 deg",
                  "pattern: line, count: 2, pitch: 9", (8, 8.25, 8.6)),
    "three layers": ("shape: square, outer_diameter: 7, layers: 3, start_angle: 180 deg",
                     "pattern: grid, count: [2, 2], pitch: 8.5", (6, 6.25)),
}

CASES = [(name, turns) for name, (_, _, sweep) in BOARDS.items() for turns in sweep]


@cache
def laid_out(coil, array):
    stackup = "" if re.search("layers: [34]", coil) else "stackup: flex-2l-18um, "
    fpc = f"fpc: {{{stackup}tail: {{length: 30, connector: zif-0.5mm}}}}"
    tracks = "trace_width: 100 um, trace_spacing: 100 um"
    rows = f"array: {{{array}}}\n" if array else ""
    return lay_out(load_text(f"sitscad: 1\nname: led\ncoil: {{{coil}, {tracks}}}\n{rows}{fpc}", "led.yaml"))


def board(name, turns):
    coil, array, _ = BOARDS[name]
    return laid_out(f"{coil}, turns: {turns}", array)


def shares_of(layout):
    """What stubs and leads add to the inductance of each coil, as a share of its winding's."""
    spec = layout.spec
    geometry = winding_geometry(spec.coil, layout.coils[0])
    winding = choose_method(geometry, None, 1e-3).solve(geometry)
    parts = [estimate_leads(coil, spec.fpc.stackup, 5.8e7).parts for coil in layout.coils]
    return [(part["coupling"] + part["leads"] + part["stubs"]) / winding for part in parts]


@pytest.mark.parametrize("name, turns", CASES)
def test_leads_close_windings_with_smallest_possible_arc(name, turns):
    layout = board(name, turns)
    assert layout.shortfalls == ()
    least = least_closing(layout.spec.coil)
    for coil in layout.coils:
        assert abs(drawn_closing(layout.spec.coil, coil)) < abs(least) + FAR


@pytest.mark.parametrize("name, turns", [case for case in CASES if case[0] != "hexagon"])
def test_inductance_share_of_leads_is_bounded_by_closing_arc(name, turns):
    """A closing arc links the winding's flux like the outermost turn: at most 1.8 of the middle turn's share."""
    layout = board(name, turns)
    coil = layout.spec.coil
    bound = 0.015 + 1.8 * (abs(least_closing(coil)) + 0.05) / math.fsum(coil.layer_turns)
    assert max(map(abs, shares_of(layout))) < bound


@pytest.mark.parametrize("array", ["", "pattern: line, count: 2, pitch: 11.5"])
@pytest.mark.parametrize("layers, turns", [(1, 10), (2, 10), (2, 10.25), (3, 8), (4, 6.25)])
def test_start_angle_of_square_changes_lead_inductance_below_2_percent(layers, turns, array):
    """Once a lead ran half a turn on or back as the start angle had it: 8.8 % of the inductance at the contacts."""
    coil = f"shape: square, outer_diameter: 10, turns: {turns}, layers: {layers}, start_angle: {{}} deg"
    shares = [share for angle in (0, 90, 180, 270) for share in shares_of(laid_out(coil.format(angle), array))]
    assert max(shares) - min(shares) < 0.02


@pytest.mark.parametrize("layers, turns, least", [(2, 8.0, 0.0), (2, 8.1, -0.2), (2, 8.4, 0.2), (2, 8.25, 0.5),
                                                  (4, 7.75, 0.0), (3, 8.3, 0.0), (1, 8.6, 0.0)])
def test_least_closing_arc_completes_whole_turns(layers, turns, least):
    from .conftest import sensor

    coil = sensor(turns=turns, layers=layers).coil
    assert least_closing(coil) == approx(least, abs=1e-9)


def test_forward_closing_arc_costs_less_than_backward_arc():
    from .conftest import sensor

    for clockwise in (False, True):
        coil, half = sensor(clockwise=clockwise).coil, -math.pi if clockwise else math.pi
        assert closing_turns(coil, 0.0, half) == closing_turns(coil, -half, 0.0) == approx(0.5, rel=1e-6)
        assert closing_cost(0.5, 4e-3) < closing_cost(-0.5, 4e-3) < closing_cost(0.6, 4e-3)


@pytest.mark.slow
def test_inductance_share_of_leads_jumps_only_at_whole_turns():
    """Swept in fine steps, what leads add jumps once a whole turn of all layers, where they change from running back to
    running on; it jumped by as much wherever a coil's end passed the tail, and for coils side by side elsewhere.
    """
    sweep = [8.0 + k / 40 for k in range(21)]
    shares = [shares_of(laid_out(f"{BOARDS['two circles'][0]}, turns: {turns}", BOARDS["two circles"][1]))
              for turns in sweep]
    steps = [max(abs(b - a) for a, b in zip(item, other, strict=True)) for item, other in pairwise(shares)]
    assert sorted(steps)[-2] < 0.01
    assert max(abs(share) for row in shares for share in row) < 0.055


@pytest.mark.parametrize("case", [("one layer", 8.6), ("two circles", 8.3), ("squares", 8.25), ("racetracks", 6)])
def test_winding_sampling_is_fine_enough_for_leads(case, monkeypatch):
    """Chords 50 um off the outermost turn, with a lead 100 um beside it, were 6e-4 of the winding wrong."""
    layout = board(*case)
    result = shares_of(layout)
    monkeypatch.setattr(leads, "SAMPLED", 0.5e-6)
    monkeypatch.setattr(leads, "LONGEST", 0.05e-3)
    assert result == approx(shares_of(layout), abs=1e-4)
