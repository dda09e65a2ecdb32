"""The drive code: strong, yet one sigma below 1.8 V; one for all coils where that does; the user's where one is set."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.estimates.circuits.settings import ParallelResistanceRange, drive_codes
from sitscad.spec import presets
from sitscad.spec.circuit import LayerKind

LDC1614 = presets.converter("ldc1614")

UNLIKE = """
sitscad: 1
name: six
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 0.155, trace_spacing: 0.155}
array: {pattern: grid, count: [3, 2], pitch: 11}
fpc: {tail: {length: 40}}
target: {size: 16, thickness: 0.1}
elastomer: {size: 18, thickness: 1, material: ecoflex-00-30}
mount: {kind: bench-plate}
readout: {capacitance: 120 pF, scan_rate: 600 Hz, drive_code: CODE}
requirements: {normal_force: 50 N}
"""
"""The coils in the middle lie under the target, the others beside it: R_P differs by half."""


def estimated(code: str) -> sitscad.Estimates:
    return sitscad.estimate(sitscad.lay_out(sitscad.load_text(UNLIKE.replace("CODE", code), "six.yaml")))


@pytest.fixture(scope="module")
def unlike():
    return estimated("auto")


def test_drive_code_is_highest_one_sigma_below_amplitude_limit(unlike):
    for number, coil in enumerate(unlike.coils):
        working = [state for name, state in coil.states.items() if name != "free"]
        careful = max(state.amplitude + state.spread.amplitude for state in working)
        code = unlike.readout.code_of(number)
        assert careful < 1.8
        assert careful * LDC1614.drive_current(code + 1) / LDC1614.drive_current(code) >= 1.8


def test_unequal_coils_get_drive_code_for_each_channel(unlike):
    codes = unlike.readout.drive_codes
    assert len(codes) == 6 and len(set(codes)) > 1 and unlike.readout.drive_code == max(codes)
    working = [state for coil in unlike.coils for name, state in coil.states.items() if name != "free"]
    assert min(state.amplitude for state in working) >= 1.2
    lowest = min(state.parallel_resistance for state in working)
    assert LDC1614.amplitude(lowest, min(codes)) < 1.2
    assert unlike.as_json("six.yaml")["readout"]["drive_codes"] == list(codes)


def test_amplitudes_and_supply_current_follow_drive_code(unlike):
    for number, coil in enumerate(unlike.coils):
        for state in coil.states.values():
            code = unlike.readout.code_of(number)
            assert state.amplitude == approx(LDC1614.amplitude(state.parallel_resistance, code), rel=1e-6)
            relative = state.spread.parallel_resistance / state.parallel_resistance
            assert state.spread.amplitude == approx(relative * state.amplitude, rel=1e-6)
    readout = unlike.readout
    supply = readout.conversion.supply_current(readout.drive_current)
    assert readout.supply_current == approx(2 * supply, rel=1e-6)


@pytest.mark.slow
def test_drive_code_of_spec_is_used_and_checked():
    spec = sitscad.load_text(UNLIKE.replace("CODE", "24"), "six.yaml")
    result = sitscad.estimate(sitscad.lay_out(spec))
    assert result.readout.drive_code == 24 and result.readout.drive_codes == ()
    rest = result.coils[0].states["rest"]
    assert rest.amplitude == approx(4.0 / math.pi * 551e-6 * rest.parallel_resistance, rel=1e-6)
    text = findings_of("SIT204", spec, estimates=result)
    (error,) = [f for f in text if f.severity.value == "error"]
    assert error.limit == 1.8 and "code-apart" in error.cases
    assert error.key == "readout.drive_code" and error.line


@pytest.mark.parametrize("code", ["-1", "32", "3.5", "strong"])
def test_invalid_drive_code_gives_spec_error(code):
    with pytest.raises(sitscad.SpecError):
        sitscad.load_text(UNLIKE.replace("CODE", code), "six.yaml")


def test_single_drive_code_is_used_if_separate_codes_do_not_help():
    wide = ParallelResistanceRange(1000.0, 3100.0)
    assert len(set(drive_codes([wide, ParallelResistanceRange(2000.0, 2200.0)], LDC1614))) == 1
    near = ParallelResistanceRange(2000.0, 2200.0)
    assert drive_codes([near, near], LDC1614) == (LDC1614.drive_code(2200.0),) * 2


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("template", ["robotic_jaw_12mm", "fingertip_foil", "grasper_4layer", "square_bench"])
def test_copper_tolerances_leave_amplitude_within_limits(root, template):
    """Half-ounce foil plated by 12 um made 2.1 V of the 1.7 V of robotic_jaw_12mm, whose copper was taken as 18 um.

    The thickest foil (+10 %) with the thickest plating (15.5 um) and the thinnest with the thinnest, solved again.
    """
    text = (root / "templates" / f"{template}.yaml").read_text(encoding="utf-8")
    spec = sitscad.load_text(text, f"{template}.yaml")
    code = sitscad.estimate(sitscad.lay_out(spec)).readout.drive_code
    for foil, plating in ((1.1, 15.5e-6), (0.9, 8.5e-6)):
        layers = tuple(
            replace(layer, thickness=layer.foil * foil + plating * (layer.plated > 0.0))
            if layer.kind is LayerKind.COPPER
            else layer
            for layer in spec.fpc.stackup.layers
        )
        made = replace(spec, fpc=replace(spec.fpc, stackup=replace(spec.fpc.stackup, layers=layers)))
        for coil in sitscad.estimate(sitscad.lay_out(made)).coils:
            for name, state in coil.states.items():
                swing = LDC1614.amplitude(state.parallel_resistance, code)
                assert name == "free" or 1.2 <= swing <= 1.8, (name, foil)
