"""Coils alone at a frequency that the user names: one truth with the estimate, and errors that hold."""

from __future__ import annotations

import math

import pytest
from tolerance import approx

import sitscad
from sitscad.estimates.states.at_frequency import FrequencyError, coils_at
from sitscad.spec.load import load_text

SHAPES = {
    "circle": "shape: circle, outer_diameter: 12, turns: 9.5, layers: 2",
    "square": "shape: square, outer_diameter: 10, turns: 7, layers: 1",
    "octagon": "shape: octagon, outer_diameter: 8, turns: 6, layers: 2",
    "racetrack": "shape: racetrack, outer_diameter: [14, 7], turns: 5.5, layers: 2",
}
FREQUENCIES = (1e5, 1e6, 5e6, 13.56e6)


def layout_of(coil, more=""):
    text = f"sitscad: 1\nname: alone\ncoil: {{{coil}, trace_width: 150 um, trace_spacing: 150 um}}\n{more}"
    return sitscad.lay_out(load_text(text))


@pytest.mark.parametrize("shape", SHAPES)
def test_coil_at_tank_frequency_equals_estimate(shape):
    layout = layout_of(SHAPES[shape])
    (coil,) = sitscad.estimate(layout).coils
    (result,) = coils_at(layout, (coil.sensor_frequency,))
    assert result.winding_resistance == approx(coil.resistance_ac, rel=1e-9, abs=0)
    assert result.winding_resistance_error == approx(coil.resistance_error, rel=1e-9, abs=0)
    free = coil.states["free"]
    assert result.inductance == approx(free.inductance, rel=1e-4, abs=0)  # which is interpolated
    assert result.resistance == approx(free.resistance, rel=1e-3, abs=0)
    assert result.apparent_inductance == approx(free.apparent_inductance, rel=2e-4, abs=0)
    assert result.quality_factor == approx(
        2.0 * math.pi * result.frequency * result.inductance / result.resistance, rel=1e-12, abs=0)
    assert result.self_resonance == approx(coil.self_resonance, rel=1e-12, abs=0)


@pytest.mark.parametrize("shape", SHAPES)
def test_stated_errors_bound_deviation_from_finer_solution(shape):
    layout = layout_of(SHAPES[shape])
    usual, finer = (coils_at(layout, FREQUENCIES, tolerance=tolerance) for tolerance in (None, 1e-3))
    for item, best in zip(usual, finer, strict=True):
        assert abs(item.winding_inductance / best.winding_inductance - 1.0) <= (
            item.winding_inductance_error + best.winding_inductance_error)
        assert abs(item.winding_resistance / best.winding_resistance - 1.0) <= (
            item.winding_resistance_error + best.winding_resistance_error)
        assert item.winding_inductance_error < 4e-3 and item.winding_resistance_error < 0.05


@pytest.mark.parametrize("shape", SHAPES)
def test_inductance_falls_and_resistance_rises_with_frequency(shape):
    layout = layout_of(SHAPES[shape])
    (coil,) = sitscad.estimate(layout).coils
    result = coils_at(layout, FREQUENCIES)
    inductances = [coil.winding_inductance, *(each.winding_inductance for each in result)]
    resistances = [coil.resistance_dc, *(each.winding_resistance for each in result)]
    assert inductances == sorted(inductances, reverse=True)
    assert resistances == sorted(resistances)
    assert resistances[1] == approx(resistances[0], rel=1e-3, abs=0)


def test_target_does_not_change_values_of_coil_alone():
    more = "target: {shape: square, size: 12, thickness: 0.2, material: copper}\nelastomer: {size: 12, thickness: 1}\n"
    (alone,), (under,) = (coils_at(layout_of(SHAPES["circle"], text), (5e6,)) for text in ("", more))
    assert under.winding_inductance == approx(alone.winding_inductance, rel=1e-9, abs=0)
    assert under.winding_resistance == approx(alone.winding_resistance, rel=1e-9, abs=0)


def test_frequency_above_self_resonance_gives_frequency_error():
    layout = layout_of("shape: circle, outer_diameter: 30, turns: 35, layers: 2")
    (coil,) = sitscad.estimate(layout).coils
    below, beyond = 0.9 * coil.self_resonance, 1.001 * coil.self_resonance
    (result,) = coils_at(layout, (below,))
    assert result.apparent_inductance > 3.0 * result.inductance  # near resonance, where a meter reads far too much
    with pytest.raises(FrequencyError, match="resonates with its own capacitance"):
        coils_at(layout, (beyond,))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("level", ["screen", "full"])
def test_error_of_swept_inductance_includes_current_crowding_error(shape, level):
    layout = layout_of(SHAPES[shape])
    table = sitscad.sweep(layout.spec, {"fpc.margin": [0.0]}, ["inductance", "frequency"], level=level)
    (frequency,) = table.values["frequency"]
    (result,) = coils_at(layout, (frequency,))
    bound = result.winding_inductance_error * result.winding_inductance
    assert table.errors["inductance"][0] >= 0.99 * bound
    assert table.errors["frequency"][0] >= 0.99 * 0.5 * bound / result.inductance * frequency
