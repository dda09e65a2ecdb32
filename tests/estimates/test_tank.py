"""The tank's parts: the smooth curve of the terminal values, and the capacitor that is chosen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates import estimate
from sitscad.estimates.circuits.tank import POINTS, preferred_values
from sitscad.estimates.states.near import interpolate_over_band as through_logarithms
from sitscad.estimates.states.steps import solve_windings, tune_circuits
from sitscad.estimates.windings.losses import SCREENING
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.proximity import winding_loss
from sitscad.layout import lay_out, sketch
from sitscad.spec import presets
from sitscad.spec.load import load, load_text

LDC1614 = presets.converter("ldc1614")

ROOT = Path(__file__).parents[2]


def test_interpolated_curve_reproduces_inductance_and_resistance():
    """Inductance and resistance of a winding before a metal wall, as smooth as they come, to 5e-4 of their values."""
    layers = [SpiralLayer(1.96e-3, 0.16e-3, 7.75, 0.0, 1, True, -49e-6 * k, 80e-6, 18e-6) for k in range(2)]
    loss = winding_loss(layers, 58e6, 1)

    def exact(frequency):
        wall = -3e-7 * (1.0 - 1e-2 * np.sqrt(1e6 / frequency))
        return 2.5e-6 + loss.inductance_changes(frequency) + wall, loss.direct * loss.resistance_ratios(frequency)

    curve = through_logarithms((1e6, 11e6), lambda frequencies: np.stack(exact(frequencies), axis=1), POINTS)
    frequencies = np.array([1e6, 1.7e6, 3.3e6, 6.1e6, 8.8e6, 11e6])
    inductance, resistance = exact(frequencies)
    assert curve(frequencies)[:, 0] == approx(inductance, rel=1e-5)
    assert curve(frequencies)[:, 1] == approx(resistance, rel=5e-4)


@pytest.mark.parametrize("capacitance", ["47 pF", "3300 pF"])
def test_slow_and_fast_tanks_use_values_at_their_frequency(capacitance):
    """Far below and above 1 to 11 MHz too, inductance and resistance are those at the frequency that is stated."""
    for outer, turns in ((4, 2), (14, 30)):
        result = estimate(lay_out(load_text(
            f"sitscad: 1\nname: t\ncoil: {{shape: circle, outer_diameter: {outer}, turns: {turns}, layers: 2, "
            f"trace_width: 100 um, trace_spacing: 100 um}}\nreadout: {{device: ldc1614, capacitance: {capacitance}}}\n",
            "t.yaml",
        )))
        coil = result.coils[0]
        free = coil.states["free"]
        assert free.resistance == approx(coil.resistance_ac, rel=0.4)
        assert free.resistance > coil.resistance_ac * (1.0 - 1e-3)
        plain = 1.0 / (2.0 * math.pi * math.sqrt(free.inductance * coil.capacitance))
        # the drive's 5 ns matter most where the tank is fast and poor
        assert 0.7 * plain < free.frequency < plain


def test_chosen_capacitor_reason_states_effect_of_tolerance():
    text = "sitscad: 1\nname: t\ncoil: {shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, "
    readout = estimate(lay_out(load_text(text + "trace_spacing: 100 um}\n", "t.yaml"))).readout
    assert any(readout.capacitance == approx(value, rel=1e-6) for value in preferred_values(LDC1614))
    assert readout.capacitor_tolerance == 0.05
    assert "+-2.5 % of frequency" in readout.capacitance_reason


@pytest.mark.parametrize(("clock", "divider"), [("30 MHz", 2), ("40 MHz", 1)])
def test_input_divider_leaves_two_sigma_frequency_margin(clock, divider):
    """7.44 MHz of 7.5 MHz that a 30 MHz clock allows undivided: two sigma of manufacture are 0.2 MHz."""
    text = (ROOT / "templates/grasper_4layer.yaml").read_text(encoding="utf-8")
    result = estimate(lay_out(load_text(text.replace("clock: 40 MHz", f"clock: {clock}"), "t.yaml")))
    states = [state for coil in result.coils for state in coil.states.values()]
    ceiling = 0.25 * result.readout.conversion.reference_frequency
    assert all(state.frequency < ceiling for state in states)
    assert any(state.frequency + 2.0 * state.spread.frequency > ceiling for state in states) == (divider == 2)
    assert result.readout.conversion.input_divider == divider


@pytest.mark.parametrize(("diameter", "turns", "strong"), [(4.5, 4, False), (5, 4, True), (6, 5, True), (7, 8, False)])
def test_high_current_drive_is_used_only_without_overdrive(diameter, turns, strong):
    """R_P of 239, 281, 385 and 518 ohm: below 250 TI allows none, above 404 even 3.5 mA pass 1.8 V."""
    size = f"outer_diameter: {diameter}, turns: {turns}, trace_width: 0.16, trace_spacing: 0.16"
    coil = f"{{shape: circle, layers: 2, {size}}}"
    rest = "fpc: {stackup: flex-2l-18um}\nreadout: {capacitance: 1 nF}"
    spec = load_text(f"sitscad: 1\nname: weak\ncoil: {coil}\n{rest}", "weak.yaml")
    result = estimate(lay_out(spec))
    assert result.readout.high_current is strong
    swing = 4.0 * result.coils[0].states["free"].parallel_resistance * 3.5e-3 / math.pi
    assert swing < 1.8 or not strong


def test_screen_crowding_near_metal_agrees_with_exact_value():
    tuned = tune_circuits(solve_windings(sketch(load(ROOT / "templates" / "grasper_4layer.yaml")), tolerance=SCREENING))
    for circuit in tuned.circuits:
        for state in circuit.reflections:
            at = tuned.tank.oscillation(circuit, state).frequency * np.array([0.98, 1.0, 1.02])
            result, exact = circuit.crowding(state, at), circuit.crowding_changes(state, at)
            own = circuit.resistance * (circuit.loss.resistance_ratios(at) - 1.0)
            assert result[1] == approx(own + exact[1], rel=2e-3)
            assert result[1][2] - result[1][0] == approx((own + exact[1])[2] - (own + exact[1])[0], rel=0.03)


def test_no_curve_is_computed_beyond_converter_band():
    tuned = tune_circuits(solve_windings(sketch(load(ROOT / "templates" / "three_axis_triangle.yaml")),
                                       tolerance=SCREENING))
    assert {band for circuit in tuned.circuits for _, _, band in circuit.curves} == {0}
    assert max(tuned.tank.oscillation(c, state).frequency for c in tuned.circuits for state in c.reflections) < 10e6
