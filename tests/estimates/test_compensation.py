"""Drift that a compensation by temperature leaves: its parts by formula, and by sensors that are solved anew."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.apps.study.measures import MEASURES
from sitscad.checks.fixes.pads import temperature_sensors
from sitscad.estimates.performance.compensation import (
    CAPACITORS,
    EXPANSION,
    METAL,
    PAD_MODULUS,
    Compensation,
    TemperatureReading,
    pad_lag,
    reference_reading,
    root_sum_square,
    thermistor_reading,
)
from sitscad.estimates.performance.tables import compensation_tables
from sitscad.estimates.performance.warming import choose_compensation
from sitscad.files.documents import firmware_driver
from sitscad.package.contents import incoming_tests
from sitscad.spec import presets
from sitscad.spec.thermistor import CALIBRATED, DESIGN
from tests.validation.warmed_units import CASES, COLD, PLAIN, WARM, WarmedDesign, case, stated, unit_errors

TEMPLATES = Path(__file__).parents[2] / "templates"
NEEDS = {"requirements.temperature": "20 degC", "requirements.temperature_range": [COLD, WARM],
         "readout.capacitance": "100 pF"}


@pytest.fixture(scope="module")
def plain():
    return Design(sitscad.load(TEMPLATES / "bench_7mm.yaml").replace(NEEDS))


@pytest.fixture(scope="module")
def compensated(plain):
    return Design(plain.spec.replace("readout.thermistor.part", "tmp117"))


@pytest.mark.parametrize("name", ["ncp18xh103f03rb", "ntcle100e3103"])
def test_thermistor_error_equals_error_of_resistance_law(name):
    part = presets.thermistor(name)

    def error(celsius, resistance, b):
        kelvin = celsius + 273.15
        measured = resistance * math.exp(b * (1.0 / kelvin - 1.0 / 298.15))
        return 1.0 / (1.0 / 298.15 + math.log(measured / part.resistance) / part.b) - kelvin

    change = [error(WARM, *case) - error(COLD, *case) for case in (
        (part.resistance * (1.0 + part.resistance_tolerance), part.b),
        (part.resistance, part.b * (1.0 + part.b_tolerance)))]
    reading = thermistor_reading(part, "board", 0.5, COLD, WARM)
    assert reading.by_tolerance == approx(math.hypot(*change) / math.sqrt(3.0), rel=0.02)
    assert (reading.noise, reading.difference) == (part.noise, 0.5)


def test_digital_sensor_error_includes_both_temperatures():
    reading = thermistor_reading(presets.thermistor("tmp117"), "tail", 2.0, COLD, WARM)
    assert reading.by_tolerance == approx(0.1 * math.sqrt(2.0 / 3.0), rel=1e-9)


def test_reference_coil_noise_and_tolerance_are_divided_by_its_drift():
    reading = reference_reading(-50e-6, 3e-6, 8.66e-6, 0.5, 17.0)
    assert reading.noise == approx(0.06, rel=1e-9) and reading.by_tolerance == approx(17.0 * 8.66 / 50.0, rel=1e-9)


def test_metal_error_of_reference_coil_is_correlated_with_other_coils():
    """With a tenth more drift of all copper, the temperature reads a tenth high, and so do the other causes."""
    causes = {METAL: np.array([-2.0]), EXPANSION: np.array([-1.0]), PAD_MODULUS: np.array([-0.5])}
    reading = TemperatureReading("", 0.0, 0.0, 0.0, is_by_metal=True)
    left = Compensation(10.0, reading, 0.0).remaining_drift(causes, np.zeros(1), np.zeros(1), False)
    excess = presets.compensation_figure(METAL)
    sensed = 10.0 * (1.0 + excess)
    unit = 10.0 * (causes[METAL] * (1.0 + excess) + causes[EXPANSION] + causes[PAD_MODULUS])
    assert left[METAL] == approx(abs(unit - sensed * sum(causes.values())), rel=1e-9)


def test_metal_error_of_own_windings_adds_reading_and_effect_of_copper():
    """With a tenth more drift of the reference coil alone the reading is wrong, with the others alone the effect."""
    causes = {METAL: np.array([-2.0]), EXPANSION: np.array([-1.0]), PAD_MODULUS: np.array([-0.5])}
    reading = TemperatureReading("", 0.0, 0.0, 0.0, is_by_metal=True, has_own_windings=True)
    left = Compensation(10.0, reading, 0.0).remaining_drift(causes, np.zeros(1), np.zeros(1), False)
    excess = presets.compensation_figure(METAL)
    assert left[METAL] == approx(10.0 * excess * math.hypot(2.0, 3.5), rel=1e-9)


def test_reference_coil_drift_equals_frequency_change_between_estimates(plain):
    """Between estimates at both temperatures of the whole sensor, the reference coil's frequency drifts as stated."""
    design = Design(plain.spec.replace("array.reference", {}))
    point = design.sensing.solved.warmed[-1]
    cold, warm = (sitscad.estimate(design.layout, temperature=each).reference.states["free"].frequency
                  for each in (COLD, COLD + 10.0))
    drift = math.log(warm / cold) / 10.0
    assert design.cells.reference_drift == approx(drift, rel=1e-3) and drift < 0.0
    capacitor = 0.5 * plain.spec.readout.device.limit("capacitor_temperature") / math.sqrt(3.0)
    assert point.compensation.reading.is_by_metal
    assert point.compensation.reading.by_tolerance == approx((WARM - COLD) * capacitor / -drift, rel=1e-3)
    assert design.spec.readout.compensation.difference == presets.compensation_figure("difference at board")
    assert point.drift[0] < 0.6 * point.uncompensated_drift[0]


def test_temperature_sensor_with_smallest_error_is_chosen(plain):
    both = Design(plain.spec.replace({"array.reference": {}, "readout.thermistor.part": "tmp117"}))
    assert not both.sensing.solved.warmed[-1].compensation.reading.is_by_metal


@pytest.mark.parametrize("metal", [0.0, 0.2e-3, 1e-3])
def test_pad_lag_equals_solution_of_heat_equation(metal):
    """Finite volumes of pad and target over a board that warms steadily, until the lag stays."""
    thickness, density, rate, count = 1.5e-3, 1070.0, 0.1, 60
    conductivity, heat = (presets.compensation_figure(name) for name in ("silicone conductivity", "silicone heat"))
    cell = thickness / count
    capacity = np.full(count, density * heat * cell)
    capacity[-1] += presets.compensation_figure("metal heat") * metal
    conductance = np.full(count, conductivity / cell)
    conductance[0] *= 2.0  # from the board to the middle of the first cell
    flow = np.diag(conductance) + np.diag(np.append(conductance[1:], 0.0))
    flow -= np.diag(conductance[1:], 1) + np.diag(conductance[1:], -1)
    lag = np.linalg.solve(flow, rate * capacity)
    assert pad_lag(thickness, density, metal, rate) == approx(lag.mean(), rel=0.02)
    bare, thick = (pad_lag(times * thickness, density, 0.0, rate) for times in (1.0, 2.0))
    assert thick == approx(4.0 * bare, rel=1e-9)


def test_pad_lags_by_the_temperature_change_at_most(compensated):
    fast, slow = (compensated.spec.replace("readout.compensation.rate", f"{rate} K/min") for rate in (1000, 1.7))
    lags = [choose_compensation(spec.readout, spec.requirements, spec.elastomer, spec.target, None, 0.0).lag
            for spec in (fast, slow)]
    assert lags[0] == approx(WARM - COLD, rel=1e-9) and 0.0 < lags[1] < 1.0


def test_reversed_temperature_range_is_refused_with_both_temperatures(plain):
    with pytest.raises(sitscad.SpecError, match=f"{WARM:g} degC.* {COLD:g} degC"):
        plain.spec.replace("requirements.temperature_range", [WARM, COLD])


def test_firmware_readme_takes_both_headers_of_a_calibration(compensated):
    """Without the temperature.h of the unit, the driver uses the coefficients of the design."""
    files = firmware_driver.render_readme(compensated.layout, compensated.estimates, incoming_tests(compensated).board)
    text = " ".join(files["firmware/readme.txt"].decode().split())
    step = text[text.index("Put the resulting"):]
    assert "temperature.h" in step[:step.index("build again")]


def test_perfect_temperature_reading_leaves_only_coefficient_errors():
    """A perfect reading leaves only the coefficients, and a cold sensor leaves nothing."""
    causes = {METAL: np.array([-2.0]), EXPANSION: np.array([-1.0]), PAD_MODULUS: np.array([-0.5])}
    perfect = TemperatureReading("", 0.0, 0.0, 0.0)
    left = Compensation(10.0, perfect, 0.0).remaining_drift(causes, np.zeros(1), np.zeros(1), False)
    assert root_sum_square(left) == approx(10.0 * math.hypot(2.0 * 0.1, 0.15, 0.5 * 0.3), rel=1e-9)
    none = np.zeros(1)
    assert not root_sum_square(Compensation(0.0, perfect, 0.0).remaining_drift(causes, none, none, False)).any()
    beside = Compensation(10.0, replace(perfect, difference=0.5), 0.1).remaining_drift(causes, none, none, True)
    assert root_sum_square(beside) == approx(math.hypot(0.5 * 3.5, 0.1 * 1.5), rel=1e-9)


def test_sensor_without_thermistor_has_no_compensation(plain):
    point = plain.sensing.solved.warmed[-1]
    assert point.compensation is None and point.drift_left == {}
    assert np.array_equal(point.drift, point.uncompensated_drift)
    assert "compensation" not in plain.performance[-1].document() and not compensation_tables(plain.performance)


@pytest.mark.slow
@pytest.mark.parametrize("template", ["bench_7mm", "grasper_4layer"])
def test_drift_without_compensation_is_that_of_a_sensor_solved_at_two_temperatures(template):
    """With pad, metal and target of both temperatures, the readings change by the sum of all causes."""
    design = Design(sitscad.load(TEMPLATES / f"{template}.yaml").replace(NEEDS))
    warmed, bench = WarmedDesign(design), design.sensing.solved.bench
    rest, full = design.sensing.solved.warmed[0], design.sensing.solved.warmed[-1]
    change = warmed.readings(WARM, WARM - COLD, 1.0, 1.0, warmed.loads) - bench.readings(bench.poses(warmed.loads))
    for point, after_one_tare in zip((rest, full), change[:2], strict=True):
        by_capacitors = (WARM - COLD) * point.by_kelvin[CAPACITORS][0]
        assert point.uncompensated_drift[0] == approx(
            math.hypot((point.inverse @ after_one_tare)[0], by_capacitors), rel=0.03)
    assert full.uncompensated_tared_drift[0] == approx(abs(full.inverse @ (change[1] - change[0]))[0], rel=0.25)
    # under shear, by the slope of the map there
    causes = [error[1] for cause, error in full.by_kelvin.items() if cause != CAPACITORS]
    assert (WARM - COLD) * sum(causes) == approx(
        (full.axis_drifts[0][1] @ change[2]), abs=0.1 * (WARM - COLD) * max(map(abs, causes)))


def test_uncompensated_drift_equals_drift_of_sensor_without_thermistor(plain, compensated):
    for before, after in zip(plain.performance, compensated.performance, strict=True):
        for axis, performance in after.axes.items():
            uncompensated = [error for cause, error in performance.errors.items() if "without comp" in cause]
            drifts = [error for cause, error in before.axes[axis].errors.items() if "drift" in cause]
            assert len(drifts) == 2 and uncompensated == approx(drifts, rel=1e-9)


def test_study_measures_include_drift_with_and_without_compensation(compensated):
    point = compensated.sensing.solved.warmed[-1]
    for axis, left, plain in zip(point.bench.range.axes, point.drift, point.uncompensated_drift, strict=True):
        for name, value in (("error.temperature", left), ("error.uncompensated", plain)):
            assert MEASURES[f"{name}.{axis}"].read(compensated)[0] == approx(value, rel=1e-9)


def test_documents_list_each_part_of_remaining_drift(compensated):
    full, point = compensated.performance[-1], compensated.sensing.solved.warmed[-1]
    (table,) = compensation_tables(compensated.performance)
    parts = [part for source in full.drift_left.values() for part in source]
    assert len(table.rows) == len(parts) + 2
    document = full.document()["compensation"]
    assert set(document["left"]) == {"design", "calibrated"} and document["warming_K"] == WARM - COLD
    combined = math.hypot(*(row["normal"] for row in full.drift_left["design"].values()))
    assert combined == approx(point.drift[0], rel=1e-9) and combined < 0.2 * point.uncompensated_drift[0]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count"), [
    ("bench_7mm", 50), *(pytest.param(name, 200, marks=pytest.mark.more) for name in CASES)])
def test_error_of_simulated_units_agrees_with_predicted_drift(name, count):
    """Units with coefficients, capacitors and temperatures of their own are warmed, solved anew and compensated."""
    warmed = WarmedDesign(case(name))
    results, statement = unit_errors(warmed, count), stated(warmed)
    for kind, rel in ((PLAIN, 0.2), (DESIGN, 0.2), (CALIBRATED, 0.2)):
        rms = np.sqrt(np.mean(np.square(results[kind]), axis=0))
        assert rms[:2, 0] == approx(statement[kind][:, 0], rel=rel), kind
        # no coefficient is measured under shear, which raises the error of the normal force
        assert rms[2, 0] < 1.8 * statement[kind][1, 0] and rms[2, 1] < 1.4 * statement[kind][1, 1], kind


def test_drift_fixes_add_temperature_sensor_and_then_calibrated_coefficients(plain, compensated):
    """Each change is written into the text and read again, and each leaves less drift."""
    design, calibrated, reference = temperature_sensors(plain.spec)
    assert reference.spec.array.reference is not None and plain.spec.readout.device.channels > len(
        plain.spec.array.placements)
    assert [edit.key for edit in design.edits] == ["readout.thermistor.part"]
    assert [edit.key for edit in calibrated.edits] == ["readout.thermistor.part", "readout.compensation.coefficients"]
    drifts = [Design(spec).sensing.solved.warmed[-1].drift[0] for spec in (plain.spec, design.spec, calibrated.spec)]
    assert drifts == sorted(drifts, reverse=True) and drifts[2] < 0.6 * drifts[1]
    assert [edit.key for fix in temperature_sensors(compensated.spec) for edit in fix.edits] == [
        "readout.compensation.coefficients"]
    assert not list(temperature_sensors(calibrated.spec))


def test_temperature_error_rule_uses_compensated_drift(plain, compensated):
    """A limit between both drifts is kept with the sensor only."""
    with_sensor, without = (each.sensing.solved.warmed[-1].drift[0] for each in (compensated, plain))
    limit = {"requirements.temperature_error": math.sqrt(with_sensor * without)}
    broken = [finding.measured for finding in sitscad.check(plain.spec.replace(limit), hints="none").findings
              if finding.rule == "SIT406"]
    assert broken == approx([without], rel=1e-6)
    result = sitscad.check(compensated.spec.replace(limit), hints="none")
    assert not [finding for finding in result.findings if finding.rule == "SIT406"]
    (reached,) = (each for each in result.reached if each.requirement == "temperature_error")
    assert reached.measured == approx(with_sensor, rel=1e-6)


@pytest.mark.parametrize("at", ["board", "tail", "controller"])
def test_temperature_difference_defaults_to_value_of_sensor_place(plain, at):
    spec = plain.spec.replace("readout.thermistor", {"part": "tmp117", "at": at})
    assert spec.readout.compensation.difference == presets.compensation_figure(f"difference at {at}")
    written = spec.replace("readout.compensation.difference", "0.1 K")
    assert written.readout.compensation.difference == approx(0.1, rel=1e-9)


@pytest.mark.parametrize(("changes", "key"), [
    ({"readout.compensation": {"difference": "1 K"}}, "readout.compensation"),
    ({"readout.thermistor": {"part": "tmp117", "at": "tail"}, "fpc.tail": None}, "readout.thermistor.at"),
])
def test_contradictory_compensation_gives_spec_error(plain, changes, key):
    with pytest.raises(sitscad.SpecError) as caught:
        plain.spec.replace(changes)
    assert (caught.value.findings[0].rule, caught.value.findings[0].key) == ("SIT009", key)
