"""The estimate from spec text to JSON: states, readout, cross-checks, and that every identity holds."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.checks.judging import check
from sitscad.estimates import METHODS, estimate
from sitscad.estimates.circuits.tank import preferred_values
from sitscad.estimates.targets.assembly import SolvedReflection, assemble
from sitscad.estimates.targets.finite_target import equivalent_rings
from sitscad.kernels.geometry.shapes import SHAPES
from sitscad.layout import lay_out
from sitscad.spec import presets
from sitscad.spec.load import load_text

LDC1614 = presets.converter("ldc1614")

BARE = """
sitscad: 1
name: bare
coil: {shape: SHAPE, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
"""

MOUNTED = """
sitscad: 1
name: mounted
coil: {shape: circle, outer_diameter: 4.0, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 30, connector: zif-0.5mm, bend: static}}
target: {shape: square, size: 4, thickness: 0.2, material: copper}
elastomer: {material: dragon-skin-10, shape: square, size: 4, thickness: 1, kerf: 0.15}
shield: {material: copper, thickness: 0.1, gap: 0.6}
readout: {device: ldc1614, capacitance: CAP, clock: 40 MHz, scan_rate: 500 Hz}
requirements: {normal_force: 4.8 N}
"""


def of(text, **how):
    return estimate(lay_out(load_text(text, "test.yaml")), **how)


@pytest.fixture(scope="module")
def mounted():
    return of(MOUNTED.replace("CAP", "220 pF"))


def test_recommended_jaw_coil_has_expected_values_in_all_states(mounted):
    assert list(mounted.coils[0].states) == ["free", "rest", "pressed"]
    for coil in mounted.coils:
        free, rest, pressed = coil.states.values()
        assert coil.winding_inductance == approx(2.5e-6, rel=0.01)
        assert free.frequency == approx(6.65e6, rel=0.02)
        assert free.parallel_resistance == approx(2.2e3, rel=0.08)
        # 1.3 kohm while the currents in the tracks did not see their images (validation/test_near_metal.py)
        assert rest.parallel_resistance == approx(1.5e3, rel=0.05)
        assert 1.4e3 <= pressed.parallel_resistance <= rest.parallel_resistance
        assert 1.1 <= pressed.amplitude <= rest.amplitude <= 1.8
        assert pressed.frequency <= 9.5e6
    assert mounted.readout.drive_code == 26
    assert mounted.readout.scan_rate >= 500.0


def test_inductance_falls_from_free_to_rest_to_pressed(mounted):
    for coil in mounted.coils:
        states = list(coil.states.values())
        assert states[0].inductance > states[1].inductance > states[2].inductance
        assert states[0].resistance < states[1].resistance < states[2].resistance
    lines = 60e-6  # of glue, below the pad and above it
    assert mounted.gaps["rest"] == 1e-3 + lines
    assert mounted.gaps["pressed"] == mounted.compression.gap + lines < mounted.gaps["rest"]


def test_estimated_values_satisfy_tank_identities(mounted):
    for coil in mounted.coils:
        free = coil.states["free"]
        omega = 2 * math.pi * free.frequency
        # SNOSCY9A equation 1, with its 5 ns
        root, q = math.sqrt(free.inductance * coil.capacitance), free.quality_factor
        expected = math.sqrt(1.0 - 1.0 / q**2 - 5e-9 / (q * root)) / (2.0 * math.pi * root)
        assert free.frequency == approx(expected, rel=1e-3)
        assert free.parallel_resistance == approx((omega * free.inductance) ** 2 / free.resistance, rel=5e-3)
        assert free.quality_factor == approx(omega * free.inductance / free.resistance, rel=0.02)
        assert coil.terminal_inductance == free.inductance
        assert coil.resistance_ac > coil.resistance_dc
        assert coil.terminal_resistance_dc > coil.resistance_dc
        assert 1e-9 < coil.lead_inductance < 40e-9
        assert coil.capacitance == approx(220e-12 + 4e-12 + coil.self_capacitance, rel=1e-6)
        assert coil.lead_inductance == approx(math.fsum(coil.lead_parts.values()), rel=1e-6)
        assert coil.self_capacitance > coil.winding_capacitance > 0.0
        assert coil.apparent_inductance > coil.terminal_inductance
    matrix = np.array(mounted.inductance_matrix)
    assert np.array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert matrix[0, 0] == mounted.coils[0].winding_inductance
    assert -0.05 < matrix[0, 1] / matrix[0, 0] < 0.0


@pytest.mark.slow
def test_small_target_changes_inductance_less_than_large_one(mounted):
    small, wide = "size: 4, thickness: 0.2", "size: 30, thickness: 0.2"
    large = of(MOUNTED.replace("CAP", "220 pF").replace(small, wide))
    behind = of(MOUNTED.replace("CAP", "220 pF").replace(small, "size: 0.5, thickness: 0.2"))
    for coil, whole, least in zip(mounted.coils, large.coils, behind.coils, strict=True):
        bare = least.states["rest"].inductance
        share = (coil.states["rest"].inductance - bare) / (whole.states["rest"].inductance - bare)
        assert 0.15 < share < 0.35


def test_middle_coil_under_target_has_lower_inductance_than_outer_coils():
    text = MOUNTED.replace("CAP", "220 pF").replace("count: 2", "count: 3").replace("zif-0.5mm", "zif-0.3mm")
    outer, middle, other = (coil.states["rest"].inductance for coil in of(text).coils)
    assert outer == approx(other, rel=0.01)
    assert middle < 0.97 * outer


@pytest.mark.parametrize("shape", SHAPES)
def test_equivalent_rings_enclose_area_of_turns(shape):
    size = "outer_diameter: [9, 5]" if shape in ("rectangle", "racetrack") else "outer_diameter: 7"
    text = BARE.replace("SHAPE", shape).replace("outer_diameter: 7", size).replace("12", "8")
    spec = load_text(text, "test.yaml")
    layout = lay_out(spec)
    rings = equivalent_rings(spec.coil, tuple(w.z for w in layout.coils[0].windings))
    corners = np.array(layout.coils[0].windings[0].path.flattened(1e-6)) - np.array(layout.coils[0].centre)
    x, y = corners.T
    swept = abs(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    assert np.sum(math.pi * rings.radii**2 * rings.turns) / 2 == approx(swept, rel=0.03)


def test_sensitivity_is_secant_from_rest_to_pressed(mounted):
    for coil, document in zip(mounted.coils, mounted.as_json("x")["coils"], strict=True):
        rest, pressed = coil.states["rest"], coil.states["pressed"]
        assert document["inductance_H_per_N"] * 4.8 == approx(pressed.inductance - rest.inductance, rel=1e-6)
        assert document["frequency_Hz_per_N"] * 4.8 == approx(pressed.frequency - rest.frequency, rel=1e-6)
        assert document["inductance_H_per_N"] < 0.0 < document["frequency_Hz_per_N"]
        read = pressed.converter_inductance - rest.converter_inductance
        assert document["converter_inductance_H_per_N"] * 4.8 == approx(read, rel=1e-6)
        # the formula's C lacks the coil's own capacitance, so it reads more than the contacts have
        assert document["converter_inductance_H_per_N"] < document["inductance_H_per_N"]
    assert of(BARE.replace("SHAPE", "circle")).as_json("x")["coils"][0]["inductance_H_per_N"] is None


def test_bare_coil_has_only_free_state():
    bare = of(BARE.replace("SHAPE", "circle"))
    assert list(bare.coils[0].states) == ["free"]
    assert bare.compression is None
    assert bare.gaps == {}


@pytest.mark.parametrize("shape", ["circle", "square"])
def test_every_method_agrees_with_best_method_within_error_bound(shape):
    layout = lay_out(load_text(BARE.replace("SHAPE", shape), "test.yaml"))
    best = estimate(layout, tolerance=1e-9).coils[0]
    for method in METHODS:
        if method.serves(SHAPES[shape]) and not (
            method.is_cross_check and shape == "circle" and "sheet" not in method.name
        ):
            coil = estimate(layout, method=method.name).coils[0]
            assert coil.method == method.name
            bound = coil.inductance_error + best.inductance_error
            assert coil.winding_inductance == approx(best.winding_inductance, rel=bound)


def test_bench_coil_inductance_equals_reference_value():
    # 35 um copper, 60 um between the mid-planes
    coil = of(BARE.replace("SHAPE", "circle") + "fpc: {stackup: flex-2l-35um}\n").coils[0]
    assert coil.winding_inductance == approx(2.523424e-6, rel=coil.inductance_error)
    assert coil.inductance_error <= 1e-4


def test_tolerance_selects_cheapest_sufficient_method():
    layout = lay_out(load_text(BARE.replace("SHAPE", "circle"), "test.yaml"))
    assert estimate(layout, tolerance=2e-2).coils[0].method == "mean-rings"
    assert estimate(layout, tolerance=1e-4).coils[0].method == "spiral-neumann"


def test_unknown_method_error_lists_suitable_methods():
    layout = lay_out(load_text(BARE.replace("SHAPE", "circle"), "test.yaml"))
    with pytest.raises(ValueError, match="spiral-neumann"):
        estimate(layout, method="zhao")
    with pytest.raises(ValueError, match="circle"):
        estimate(layout, method="strands")


def test_cross_check_outside_valid_range_is_marked_invalid(mounted):
    check = mounted.cross_checks[0]
    assert check.method == "current-sheet"
    assert not check.is_valid
    assert check.deviation == approx(check.inductance / mounted.coils[0].winding_inductance - 1.0, rel=1e-6)


def test_automatic_capacitor_meets_limits_and_gives_reason():
    result = of(MOUNTED.replace("CAP", "auto"))
    readout = result.readout
    assert any(readout.capacitance == approx(value, rel=1e-6) for value in preferred_values(LDC1614))
    states = [state for coil in result.coils for name, state in coil.states.items() if name != "free"]
    assert max(state.frequency for state in states) <= 9.5e6
    assert max(state.amplitude for state in states) <= 1.8
    assert min(state.parallel_resistance for state in states) >= 1000.0
    assert "E12" in readout.capacitance_reason


def test_drive_code_follows_largest_working_resistance(mounted):
    rest = [coil.states["rest"] for coil in mounted.coils]
    careful = max(state.parallel_resistance + state.spread.parallel_resistance for state in rest)
    assert mounted.readout.drive_code == LDC1614.drive_code(careful)


def test_layout_without_lead_room_is_estimated_with_note():
    # no way into the centre: 4 layers without room for two inner vias
    layout = lay_out(load_text(MOUNTED.replace("CAP", "220 pF").replace("turns: 7.75", "turns: 11.5"), "test.yaml"))
    assert layout.shortfalls
    result = estimate(layout)
    assert result.coils[0].winding_inductance > 0.0
    assert any("no room" in note for note in result.notes)


@pytest.mark.parametrize("turns", [0.5, 1, 11.9])
def test_fewest_and_most_turns_give_finite_json_estimate(turns):
    coil = f"{{shape: circle, outer_diameter: 4, turns: {turns}, layers: 2, trace_width: 80 um, trace_spacing: 80 um}}"
    result = of(f"sitscad: 1\nname: few\ncoil: {coil}\n")
    assert 0.0 < result.coils[0].inductance_error < 0.01
    json.dumps(result.as_json("few.yaml"), allow_nan=False)


def test_cable_lowers_frequency_less_with_capacitor_at_coil():
    cable = "cable: {length: 300, inductance: 180 nH, capacitance: 30 pF, resistance: 0.3 ohm}, "
    text = BARE.replace("SHAPE", "circle") + "readout: {device: ldc1614, capacitance: 330 pF, capacitor_at: WHERE}\n"
    plain = of(text.replace("WHERE", "converter")).coils[0]
    at_converter = of(text.replace("capacitor_at: WHERE", cable + "capacitor_at: converter")).coils[0]
    at_coil = of(text.replace("capacitor_at: WHERE", cable + "capacitor_at: coil")).coils[0]
    assert at_converter.terminal_inductance == approx(plain.terminal_inductance, rel=1e-2)
    assert at_converter.sensor_frequency < at_coil.sensor_frequency < plain.sensor_frequency
    assert at_coil.capacitance == approx(plain.capacitance + 30e-12, rel=1e-6)
    assert at_converter.states["free"].coil_amplitude < 0.95 * at_converter.states["free"].amplitude
    assert at_coil.states["free"].coil_amplitude == approx(at_coil.states["free"].amplitude, rel=0.02)


def test_estimate_json_has_required_keys_and_error_bounds(mounted):
    document = json.loads(json.dumps(mounted.as_json("jaw.yaml"), allow_nan=False))
    assert document["spec"] == "jaw.yaml"
    coil = document["coils"][0]
    required = {
        "name", "centre_m", "winding_inductance_H", "terminal_inductance_H", "inductance_error", "method",
        "resistance_error", "bend_inductance_H",
        "resistance_dc_ohm", "resistance_ac_ohm", "capacitance_F", "sensor_frequency_Hz", "parallel_resistance_ohm",
        "quality_factor", "self_resonance_Hz", "trace_length_m", "states",
    }
    assert required <= coil.keys()
    for state in coil["states"].values():
        assert {"inductance_H", "resistance_ohm", "frequency_Hz", "parallel_resistance_ohm"} <= state.keys()
        assert 0.0 < state["resistance_error"] < 0.08
    assert 0.0 < coil["resistance_error"] < coil["states"]["rest"]["resistance_error"]
    assert len(document["inductance_matrix_H"]) == len(document["coils"]) == 2
    (own, mutual), _ = document["inductance_matrix_error_H"]
    assert 0.0 < mutual < 1e-3 * abs(document["inductance_matrix_H"][0][1])
    assert own == document["coils"][0]["inductance_error"] * document["inductance_matrix_H"][0][0]


def test_reflector_layers_have_positions_of_shield_and_jaw():
    text = MOUNTED.replace("CAP", "220 pF") + "mount: {kind: grasper-pad, jaw: generic-5mm, standoff: 1.0}\n"
    spec = load_text(text, "test.yaml")
    plates = assemble(spec).states[1].below.plates
    assert [round(plate.thickness, 9) for plate in plates[:2]] == [1e-4, 3.6e-4]  # glue above and below the seat
    assert plates[1].conductivity == 0.0
    assert plates[2].thickness == spec.jaw.height
    line = next(line for line in text.splitlines() if line.startswith("shield"))
    alone = assemble(load_text(text.replace(line + "\n", ""), "test.yaml")).states[1].below
    assert len(alone.plates) == 1
    assert alone.distance == approx(spec.fpc.stackup.thickness + 1e-3 + 60e-6, rel=1e-6)


TINY = """
sitscad: 1
name: tiny
coil: {shape: square, outer_diameter: 3.5, turns: 0.5, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
target: {shape: square, size: 4, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 4, thickness: 0.5, kerf: 0.15}
requirements: {normal_force: 50 N}
"""


def test_failed_pressed_state_is_absent_with_reason(monkeypatch):
    """A half-space that takes away more than there is: no negative inductance, no frequency, no verdict from it."""
    whole = of(TINY).coils[0]
    assert all(state.inductance > 0.0 for state in whole.states.values())
    plain = SolvedReflection._exact

    def overdone(self, frequency):
        return plain(self, frequency) * (10.0 if self._around.name == "pressed" else 1.0)

    monkeypatch.setattr(SolvedReflection, "_exact", overdone)
    results = of(TINY)
    coil = results.coils[0]
    assert list(coil.states) == ["free", "rest"]
    assert "half-space model fails" in coil.failed_states["pressed"]
    assert any("half-space model fails" in note for note in results.notes)
    document = json.loads(json.dumps(results.as_json("tiny.yaml"), allow_nan=False))
    assert list(document["coils"][0]["states"]) == ["free", "rest"]
    assert "pressed" in document["coils"][0]["failed_states"]
    result = check(load_text(TINY, "tiny.yaml"), None, results)
    silent = {skipped.rule for skipped in result.not_checked if skipped.case == "state-failed"}
    assert {"SIT201", "SIT202", "SIT203", "SIT204", "SIT205", "SIT206"} <= silent


def test_channel_times_add_up_to_dwell_time(mounted):
    readout = mounted.readout
    parts = readout.settle_time + readout.conversion_time + readout.switch_time
    assert parts == approx(readout.dwell_time, rel=1e-6)
    assert readout.scan_rate == approx(0.5 / parts, rel=1e-6)
    assert readout.readable_rate == approx(1.0 / LDC1614.read_back_time(2), rel=1e-6)
    assert readout.supply_current == approx(2.1e-3 + readout.drive_current, rel=1e-3)


def test_quantum_and_noise_follow_frequency_step(mounted):
    for coil in mounted.coils:
        for state in coil.states.values():
            step = state.frequency / (16.0 * mounted.readout.conversion.rcount)
            lower = state.inductance * (state.frequency / (state.frequency + step)) ** 2
            assert state.inductance - lower == approx(state.quantum, rel=1e-3)
            assert state.noise == approx(state.quantum / math.sqrt(12.0), rel=1e-6)
