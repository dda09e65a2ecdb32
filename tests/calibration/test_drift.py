"""Calibration at two temperatures: planned rows, fitted coefficients of drift, and tables that are refused."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.basics.record import replace as replaced
from sitscad.calibration import calibrate, map_of
from sitscad.calibration.bench_data import BenchError, read_table, table_points
from sitscad.calibration.drift_fit import DriftModel, fit_drift
from sitscad.calibration.drift_table import drift_notes, fit_table_drift, measured_reference, rows_at_base
from sitscad.calibration.points import Points
from sitscad.calibration.temperature_plan import temperature_plan
from sitscad.data import json_file
from sitscad.estimates.performance.compensation import EXPANSION, METAL, PAD_MODULUS, root_sum_square
from sitscad.package.contents import calibration_files
from sitscad.spec.presets import compensation_figure
from sitscad.spec.thermistor import CALIBRATED, DESIGN
from tests.calibration.test_c_compensation import run
from tests.oracles.warmed import warmed_counts

TEMPLATES = Path(__file__).parents[2] / "templates"
COLD, WARM = 20.0, 37.0
OWN = {"metal": 1.1, "expansion": 1.15, "modulus": 1.25}


@pytest.fixture(scope="module")
def design():
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return Design(spec.replace({
        "requirements.temperature": f"{COLD} degC", "requirements.temperature_range": [COLD, WARM],
        "readout.capacitance": "100 pF", "readout.thermistor.part": "tmp117",
        "readout.compensation.coefficients": "calibrated"}))


@pytest.fixture(scope="module")
def planned(design):
    return calibrate(design)


@pytest.fixture(scope="module")
def rows(design, planned):
    """Loads, temperatures and counts of a unit whose drifts are its own, and whose pad repeats to 0.3 %."""
    loads, celsius = planned.temperatures.rows(planned.plan)
    generator = np.random.default_rng(47)
    put = loads * (1.0 + 0.003 * generator.normal(size=len(loads)))[:, None]
    counts = np.vstack([warmed_counts(design, put[celsius == each], each, **OWN)[0] for each in (COLD, WARM)])
    return loads, celsius, counts


@pytest.fixture
def table(tmp_path, planned, rows):
    """Write the rows as a table, with other temperatures or without some columns, and return its path."""

    def written(celsius=None, change=lambda lines: lines):
        loads, planned_celsius, counts = rows
        head = calibration_files(planned)["plan.csv"].decode().splitlines()[:2]
        lines = [",".join([*(f"{force:.6g}" for force in load[planned.sensors.range.columns]), str(degrees),
                           *map(str, count)]) for load, degrees, count in zip(
            loads, planned_celsius if celsius is None else celsius, counts, strict=True)]
        path = tmp_path / "bench.csv"
        path.write_text("\n".join(change([*head, *lines])) + "\n")
        return str(path)

    return written


@pytest.fixture(scope="module")
def calibrated(design, planned, rows, tmp_path_factory):
    loads, celsius, counts = rows
    path = tmp_path_factory.mktemp("bench") / "bench.csv"
    head = calibration_files(planned)["plan.csv"].decode().splitlines()[:2]
    lines = [",".join([*(f"{force:.6g}" for force in load[planned.sensors.range.columns]), str(degrees),
                       *map(str, count)]) for load, degrees, count in zip(loads, celsius, counts, strict=True)]
    path.write_text("\n".join([*head, *lines]) + "\n")
    return calibrate(design, path)


def refitted(design, calibrated, path):
    """Fit the drift of a table again, with the map of its unit."""
    whole = read_table(path, calibrated.sensors.coils)
    points = replace(table_points(whole, calibrated.sensors), noise_ratio=calibrated.points.noise_ratio)
    plain = replace(calibrated, drift=None, remarks=(), map=replaced(
        calibrated.map, drifts=design.sensing.solved.drift_coefficients))
    return fit_table_drift(design.sensing.solved, plain, whole, points, "")


def needs(sensing, **requirements):
    """The analysis with other requirements, and with its values that do not depend on them."""
    bench = sensing.bench
    settings = replace(bench.spec.readout.compensation, coefficients=DESIGN)
    spec = replace(bench.spec, requirements=replace(bench.spec.requirements, **requirements),
                   readout=replace(bench.spec.readout, compensation=settings))
    other = replace(sensing, bench=replace(bench, spec=spec))
    for name in ("warmed", "is_pad_stable", "lasting_errors", "drift_coefficients"):
        vars(other)[name] = getattr(sensing, name)
    return other


def test_plan_asks_for_second_temperature_if_requirement_needs_it(design):
    sensing = design.sensing.solved
    full = sensing.warmed[-1]
    by_design, measured = (root_sum_square(full.drift_left[source])[0] for source in (DESIGN, CALIBRATED))
    between = math.sqrt(by_design * measured)
    assert temperature_plan(sensing, "").reason.endswith("calibrated")
    assert "temperature_error" in temperature_plan(needs(sensing, temperature_error=between), "").reason
    for limit in (None, 0.9 * measured, 1.1 * by_design):
        assert temperature_plan(needs(sensing, temperature_error=limit), "") is None
    others = [error[0] for cause, error in sensing.lasting_errors.items() if "drift" not in cause]
    tared = [math.hypot(*others, root_sum_square(full.tared_drift_left[source])[0]) for source in (DESIGN, CALIBRATED)]
    plan = temperature_plan(needs(sensing, normal_error=0.5 * sum(tared)), "")
    assert "normal_error" in plan.reason and plan.soak >= 60.0
    assert temperature_plan(needs(sensing, normal_error=1.01 * tared[0]), "") is None


def test_plan_table_has_each_further_load_at_both_temperatures(design, planned):
    loads, celsius = planned.temperatures.rows(planned.plan)
    cold, warm = (loads[celsius == each] for each in (COLD, WARM))
    full = planned.sensors.range.normal_load(planned.sensors.range.normal)
    assert all(np.any(np.all(part == full, axis=1)) for part in (cold, warm))
    assert not cold[0].any() and not cold[-1].any() and len(warm) == 3 and not warm[[0, -1]].any()
    lines = calibration_files(planned)["plan.csv"].decode().splitlines()
    assert lines[1].split(",")[-3:] == ["temperature_degC", "C1_counts", "C2_counts"]
    assert [float(line.split(",")[-3]) for line in lines[2:]] == celsius.tolist()
    wide = temperature_plan(needs(design.sensing.solved, temperature_range=(10.0, 37.0), temperature_error=None), "")
    assert wide is None
    assert json.loads(calibration_files(planned)["calibration.json"])["plan"]["further_temperatures_degC"] == [WARM]


def test_fitted_coefficients_leave_a_tenth_of_the_drift(design, calibrated):
    """Loads between those of the table, of a unit that is solved anew."""
    full = calibrated.sensors.range.normal
    loads = np.array([[share * full, 0.0, 0.0] for share in (0.0, 0.5, 1.0)])
    warm, tare = warmed_counts(design, loads, WARM, **OWN)
    cold = warmed_counts(design, loads, COLD)[0]
    truth = calibrated.map(cold, tare)[:, 0]
    without = calibrated.map(warm, tare)[:, 0] - truth
    left = calibrated.map.compensated(warm, tare, WARM - COLD)[:, 0] - truth
    by_design = replaced(calibrated.map, drifts=design.sensing.solved.drift_coefficients)
    unmeasured = by_design.compensated(warm, tare, WARM - COLD)[:, 0] - truth
    assert np.abs(left).max() < 0.1 * np.abs(without[-1]) and abs(left[-1]) < 0.5 * abs(unmeasured[-1])
    drift = calibrated.drift
    assert drift.excess == 1.0 and drift.chi_square < 3.0 * drift.free
    for name, own in zip((METAL, EXPANSION, PAD_MODULUS), OWN.values(), strict=True):
        value, sigma, before = drift.moved[name]
        assert abs(value - own) < 2.0 * sigma and sigma < before == compensation_figure(name)


def test_error_of_simulated_units_agrees_with_predicted_drift(design, planned, calibrated):
    """Units with drifts, repeatability and noise of their own: errors of the fit against its statement and the rule."""
    sensing, sensors, count = design.sensing.solved, calibrated.sensors, 20
    model = DriftModel(sensing, sensors, calibrated.fit.errors)
    loads, celsius = planned.temperatures.rows(planned.plan)
    chosen = ~np.any(loads[:, 1:], axis=1)
    loads, celsius = loads[chosen], celsius[chosen]
    causes, (full,) = model.by_cause(loads), model.by_cause(loads[loads[:, 0] == loads[:, 0].max()][:1])
    cold = sensors.frequencies_under(model.errors, loads)
    base = celsius == COLD
    generator = np.random.default_rng(4)
    force = -full[:, 2] / sensing.drift_coefficients.stiffening / sensors.range.normal  # ln f per newton
    inverse = force / (force @ force)
    errors, squares = [], []
    for _ in range(count):
        own = np.array([1.0, 1.0, 1.0, *[0.0] * len(sensors.coils)]) + model.sigmas * generator.normal(
            size=len(model.sigmas))
        repeated = compensation_figure("repeatability") * loads[:, :1] * generator.normal(size=(len(loads), 1))
        drift = (celsius - COLD)[:, None] * (causes @ own) + repeated * force
        read = sensors.noisy_frequencies(cold * np.exp(drift), generator)
        points = planned_points(loads, read)
        sensed = celsius + sensing.warmed[-1].compensation.reading.noise * generator.normal(size=len(celsius))
        fit = fit_drift(model, calibrated.map, points, sensed, base, tuple(range(len(loads))), None)
        values = np.array([value for value, _, _ in fit.moved.values()])
        errors.append((WARM - COLD) * inverse @ (full @ (values - own)))
        squares.append(fit.chi_square / fit.free)
    scatter = float(np.sqrt(np.mean(np.square(errors))))
    assert (WARM - COLD) * fit.full_sigma[0] == approx(scatter, rel=0.35) and 0.6 < np.mean(squares) < 1.4
    predicted = root_sum_square(sensing.warmed[-1].drift_left[CALIBRATED])[0]
    assert fit.error(WARM - COLD)[0] == approx(predicted, rel=0.25)


def planned_points(loads, frequency):
    return Points(loads, None, frequency, ~np.any(loads, axis=1))


@pytest.mark.clients("gcc")
def test_header_has_measured_coefficients_and_their_range(tmp_path, design, calibrated):
    full = calibrated.sensors.range.normal
    counts, tare = warmed_counts(design, np.array([[full, 0.0, 0.0]]), WARM, **OWN)
    files = calibration_files(calibrated)
    changes = (WARM - COLD, COLD - WARM, 1.1 * (WARM - COLD), "nan")
    result, forces, _ = run(tmp_path, files, "kelvin", [(kelvin, *counts[0]) for kelvin in changes], tare)
    assert list(result[2:]) == [3, 3] and set(result[:2]) <= {0, 2}
    for kelvin, force in zip(changes[:2], forces, strict=False):
        assert calibrated.map.compensated(counts, tare, kelvin)[0] == approx(force, rel=1e-3, abs=1e-5)
    with pytest.raises(ValueError, match="not beyond"):
        calibrated.map.compensated(counts, tare, 1.1 * (WARM - COLD))
    text = files["temperature.h"].decode()
    loads = int(np.sum(~calibrated.points.at_rest))
    assert loads < len(calibrated.points) and f"Calibrated by {loads} points," in text
    assert f"SITSCAD_COLDEST {COLD:.6e}f" in text and f"SITSCAD_HOTTEST {WARM:.6e}f" in text


def test_document_keeps_coefficients_and_follows_its_schema(calibrated):
    import jsonschema

    document = json.loads(calibration_files(calibrated)["calibration.json"])
    schema = json_file("calibration.schema")
    jsonschema.validate(document, schema)
    assert set(document) <= set(schema["properties"]) and set(document["map"]) == set(
        schema["properties"]["map"]["properties"])
    assert set(document["drift"]) == set(schema["properties"]["drift"]["properties"]) - {"left_Nm"}
    assert document["drift"]["left_N"]["normal"] == approx(calibrated.drift.error(WARM - COLD)[0], rel=1e-9)
    again, first = map_of(document).drifts, calibrated.map.drifts
    assert again.calibrated == first.calibrated == (COLD, WARM) and again.largest_change == first.largest_change
    assert again.loaded == approx(first.loaded, rel=1e-9) and again.stiffening == approx(first.stiffening, rel=1e-9)


def test_table_at_one_temperature_keeps_coefficients_of_design(design, calibrated, table, rows):
    single = refitted(design, calibrated, table(np.full(len(rows[1]), COLD)))
    assert single.drift is None and single.map.drifts is design.sensing.solved.drift_coefficients
    assert any("one temperature" in note for note in single.notes)


def test_near_temperatures_state_a_larger_error_and_a_smaller_range(design, calibrated, rows, table):
    """Two kelvins apart, the rows tell nearly nothing: the statement returns to that of the design."""
    loads, celsius, counts = rows
    cold = counts[celsius == COLD]
    near = np.vstack([cold, warmed_counts(design, loads[celsius == WARM], COLD + 2.0, **OWN)[0]])
    points = planned_points(loads, design.estimates.readout.conversion.frequencies(near))
    model = DriftModel(design.sensing.solved, calibrated.sensors, calibrated.fit.errors)
    lines = tuple(range(len(loads)))
    fit = fit_drift(model, calibrated.map, points, np.where(celsius == COLD, COLD, COLD + 2.0), celsius == COLD,
                    lines, None)
    assert fit.coefficients.largest_change == approx(2.1, rel=1e-9)
    assert fit.full_sigma[0] > 1.5 * calibrated.drift.full_sigma[0]
    assert any("2.1 K" in note for note in drift_notes(read_table(table(), calibrated.sensors.coils), fit, WARM - COLD))


@pytest.mark.parametrize(("change", "place"), [
    (lambda lines: [*lines[:-1], lines[-1].replace(",37.0,", ",,")], 3),
    (lambda lines: [line.replace(",37.0,", ",98.6,") for line in lines], 3),
    (lambda lines: [line.replace(",37.0,", ",98.6,").replace(",20.0,", ",68.0,") for line in lines], 3),
])
def test_wrong_temperature_is_refused_with_its_place(design, calibrated, table, change, place):
    with pytest.raises(BenchError) as caught:
        refitted(design, calibrated, table(change=change))
    assert caught.value.args[0].split()[0].split(":")[-1] == str(place)


def test_wrong_warm_row_is_named(design, calibrated, table, rows):
    """The load of a warm row was not applied."""
    number = 2 + len(rows[0]) - 2

    def change(lines):
        kept = lines[number].split(",")[:3]
        return [*lines[:number], ",".join([*kept, *lines[number + 1].split(",")[3:]]), *lines[number + 1:]]

    with pytest.raises(BenchError) as caught:
        refitted(design, calibrated, table(change=change))
    assert f":{number + 1}:" in caught.value.args[0]


def test_temperatures_without_compensation_are_refused(design, calibrated, table):
    sensing = replace(design.sensing.solved)
    vars(sensing)["drift_coefficients"] = None
    whole = read_table(table(), calibrated.sensors.coils)
    with pytest.raises(BenchError, match=r"readout\.compensation"):
        fit_table_drift(sensing, calibrated, whole, table_points(whole, calibrated.sensors), "")


def test_reference_coil_column_is_read_and_required(tmp_path, design, calibrated):
    """Two rows at rest, whose reference coil loses 50 ppm a kelvin."""
    path, rate = tmp_path / "bench.csv", -50e-6
    counts = [round(5e7 * math.exp(rate * kelvin)) for kelvin in (0.0, 0.0, 17.0)]
    lines = [f"{load},{celsius},7000000,7000000,{count}" for load, celsius, count in zip(
        (0, 1, 0), (COLD, COLD, WARM), counts, strict=True)]
    path.write_text("\n".join(["normal_N,temperature_degC,C1_counts,C2_counts,C3_counts", *lines]) + "\n")
    whole = read_table(str(path), ("C1", "C2"), "C3")
    points = planned_points(np.array([[0.0], [1.0], [0.0]]), np.ones((3, 2)))
    drifts = replace(calibrated.map.drifts, reference=-45e-6)
    measured = measured_reference(whole, points, rows_at_base(whole), drifts, "C3")
    assert measured == approx(rate, rel=1e-3)
    base = whole.part(rows_at_base(whole), "C3")
    assert [column.name for column in base.columns[2:]] == ["C1", "C2"] and base.values.shape == (2, 4)
    with pytest.raises(BenchError, match="5"):
        measured_reference(whole, points, rows_at_base(whole), replace(drifts, reference=45e-6), "C3")
    path.write_text("\n".join(line.rpartition(",")[0] for line in path.read_text().splitlines()) + "\n")
    whole = read_table(str(path), ("C1", "C2"), "C3")
    with pytest.raises(BenchError, match="C3_counts"):
        measured_reference(whole, points, rows_at_base(whole), drifts, "C3")
