"""Where points and model disagree: targets that turn otherwise, unknowns far off, rows that others contradict."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tolerance import approx

from sitscad.calibration import calibrate
from sitscad.calibration.bench_data import BenchError, read_table
from sitscad.calibration.calibration import calibrate_from_points, simulated_sensors
from sitscad.calibration.misfit import CAUSES, ODD, cause_text, fit_opposite_rotation, unusual_unknowns
from sitscad.calibration.model_fit import fit_model
from sitscad.calibration.points import Points, chi_square_chance
from sitscad.calibration.unknowns import WIDEST, draw_units
from sitscad.package.contents import calibration_files
from tests.oracles.bench import simulated


@pytest.fixture(scope="module")
def level(design):
    return simulated_sensors(design.response, True)


@pytest.mark.more
@pytest.mark.slow
def test_readings_with_wrong_target_rotation_are_reported(sensors, level, foretold, hidden, bench):
    """Found with a simulated unit: the wrong way of loading left 1.7 times the stated error, without a word."""
    held = simulated(level, hidden, foretold.plan.loads, np.random.default_rng(3))
    wrong = fit_opposite_rotation(sensors, lambda: level, held, fit_model(sensors, held))
    assert wrong.sensors.rotation == "held"
    assert "kept level, not free to tilt" in wrong.note and "--rotation held" in wrong.note
    assert fit_opposite_rotation(sensors, lambda: level, bench, fit_model(sensors, bench)).note == ""
    wrong = fit_opposite_rotation(level, lambda: sensors, bench, fit_model(level, bench))
    assert "free to tilt, not kept level" in wrong.note and "--rotation free" in wrong.note


@pytest.mark.more
@pytest.mark.slow
def test_map_with_wrong_target_rotation_states_its_error(design, sensors, hidden, table):
    """Of a free target calibrated as a level one 7 % of full scale were stated, where 8 % were true."""
    path = Path(table())
    path.write_text(path.read_text().replace("# rotation: free", "# rotation: held"))
    made = calibrate(design, str(path))
    assert any("--rotation free" in note for note in made.notes)
    loads = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(25, 700)])
    read = sensors.frequencies_under(hidden, loads, exact=True)
    true = np.sqrt(np.mean((made.map(read[1:], read[0]) - loads[1:, sensors.range.columns]) ** 2, axis=0))
    assert np.all(made.map.error > true) and made.map.error[0] < 2.5 * true[0]


@pytest.mark.slow
def test_loads_without_shear_give_no_rotation_note(sensors, level, bench, hidden):
    loads = np.zeros((4, 3))
    loads[1:, 0] = [2.0, 4.0, 6.0]
    points = Points(loads, None, sensors.frequencies_under(hidden, loads), np.arange(4) == 0)
    assert fit_opposite_rotation(sensors, lambda: level, points, fit_model(sensors, points)) is None


def test_rotation_comment_that_contradicts_option_is_refused(design, foretold, tmp_path, sensors):
    text = calibration_files(foretold)["plan.csv"].decode()
    assert text.startswith("# rotation: free\n")
    path = tmp_path / "plan.csv"
    for line, words in (("# Rotation: held,,,", r"plan.csv:1:1 the table was taken with the target kept level, .*free"),
                        ("# rotation: loose", r"plan.csv:1:1 rotation 'loose': held or free")):
        rows = [row + "7,8" for row in text.splitlines()[2:]]
        path.write_text("\n".join([line, text.splitlines()[1], *(row.replace(",7,8", "7,8") for row in rows)]))
        with pytest.raises(BenchError, match=words):
            calibrate(design, str(path), rotation="free")
    path.write_text(path.read_text().replace("# rotation: loose", "# rotational remark"))
    assert read_table(str(path), sensors.coils).is_held(None)


@pytest.mark.slow
@pytest.mark.parametrize("gap", [4.2, pytest.param(-4.2, marks=[pytest.mark.slow, pytest.mark.more])])
def test_pad_of_unusual_thickness_is_fitted_and_reported(sensors, foretold, hidden, gap):
    """A fifth thicker: the chart ended where usual sensors do, and half of full scale was stated."""
    own = 0.7 * hidden
    own[0] = gap * sensors.unknowns[0].sigma
    result = calibrate_from_points(sensors, simulated(sensors, own, foretold.plan.loads, np.random.default_rng(1)))
    assert result.sensors.around is not None and result.fit.moved[0] == approx(gap, abs=1.0)
    tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(20, 600)])
    read = sensors.frequencies_under(own, tried, exact=True)
    off = np.sqrt(np.mean((result.map(read[1:], read[0]) - tried[1:, sensors.range.columns]) ** 2, axis=0))
    assert np.all(off < result.map.error) and np.all(result.map.error < 0.03 * result.map.full_scale)
    assert any(note.startswith("unusual: gap is") and "elastomer.thickness" in note for note in result.notes)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["softening", "shear_curve"])
def test_pad_with_unusual_shear_law_is_fitted_within_stated_error(sensors, foretold, hidden, name):
    """Shear that goes further under the normal force, or stiffens more, was not looked for: 12 points left up to 1.5 %
    of full scale, and stated 3.5 %.
    """
    place = [item.name for item in sensors.unknowns].index(name)
    own = 0.7 * hidden
    own[place] = 2.0 * sensors.unknowns[place].sigma
    result = calibrate_from_points(sensors, simulated(sensors, own, foretold.plan.loads, np.random.default_rng(1)))
    assert result.fit.moved[place] == approx(2.0, abs=1.0) and result.fit.sigma[place] < 0.75
    tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(20, 600)])
    read = sensors.frequencies_under(own, tried, exact=True)
    off = np.sqrt(np.mean((result.map(read[1:], read[0]) - tried[1:, sensors.range.columns]) ** 2, axis=0))
    assert np.all(off < result.map.error) and np.all(off < 0.006 * result.map.full_scale)
    assert np.all(result.map.error < 0.02 * result.map.full_scale)


@pytest.mark.more
@pytest.mark.slow
def test_shear_loads_of_half_the_size_are_refused(design, table):
    """It was taken with a note, what compression softens having taken up some of it: a quarter of full scale off."""

    def doubled(head, rows):
        place = head.index("shear_x_N")
        return head, [[*row[:place], str(2.0 * float(row[place])), *row[place + 1 :]] for row in rows]

    with pytest.raises(BenchError, match=r"no sensor of this design reads so: shear_modulus would be"):
        calibrate(design, table(doubled))


@pytest.mark.more
@pytest.mark.slow
def test_map_error_includes_surrogate_error(sensors, foretold, hidden):
    """A pad half as stiff goes far beyond the chart of usual ones: 6.3 % off where 2.5 % were stated. The chart ended
    there, and now it goes on straight.
    """
    own = 0.7 * hidden
    own[[item.name for item in sensors.unknowns].index("modulus")] = -np.log(2.0)
    result = calibrate_from_points(sensors, simulated(sensors, own, foretold.plan.loads, np.random.default_rng(77)))
    tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(25, 700)])
    read = sensors.frequencies_under(own, tried, exact=True)
    off = np.sqrt(np.mean((result.map(read[1:], read[0]) - tried[1:, sensors.range.columns]) ** 2, axis=0))
    assert np.all(off < result.map.error) and np.all(result.map.error < 0.03 * result.map.full_scale)


@pytest.mark.slow
def test_usual_sensor_yields_no_note(sensors, calibrated):
    assert not list(unusual_unknowns(sensors, calibrated.fit))
    assert calibrated.fit.disagreement[1:].max() < ODD


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize(
    "more", [20_000, *(pytest.param(off, marks=[pytest.mark.slow, pytest.mark.more]) for off in (60_000, -60_000))]
)
def test_row_with_one_wrong_reading_is_reported_by_chi_square(design, table, more):
    """One coil off in one row by 5 % of what it changes: the excess was told, and not the row. Of a third of that the
    slip itself had spread over the other rows, beside which it did not stand out.
    """

    def slipped(head, rows):
        place = head.index("C2_counts")
        rows[2][place] = str(int(rows[2][place]) + more)
        return head, rows

    (note,) = (note for note in calibrate(design, table(slipped)).notes if "Read that row again" in note)
    assert "bench.csv:4:1 " in note and "the others foretell" in note


def _with_tares(table, sensors, bench, noise=0.0, slip=0):
    """The bench's table with tares in the middle and at the end, the readings `noise` (counts) noisier and the tare in
    the middle `slip` off on the second coil.
    """
    generator, tare = np.random.default_rng(6), np.rint(sensors.conversion.counts(bench.frequency[0]))

    def changed(head, rows):
        rest = ["0", "0", *map(str, tare)]
        rows = [rows[0], *rows[1:5], list(rest), *rows[5:], list(rest)]
        rows[5][3] = str(float(rest[3]) + slip)
        return head, [[*row[:2], *(str(round(float(c) + noise * generator.normal())) for c in row[2:])] for row in rows]

    return table(changed)


@pytest.mark.more
@pytest.mark.slow
def test_noise_is_estimated_from_rows_without_load(design, table, sensors, bench):
    """3,000 counts on every reading, 16 times the converter's, passed without a word."""
    quiet, loud = (calibrate(design, _with_tares(table, sensors, bench, noise)) for noise in (0.0, 3000.0))
    assert not any("rows without load" in note for note in quiet.notes) and quiet.points.noise_ratio == 1.0
    (note,) = (note for note in loud.notes if "rows without load scatter" in note)
    assert 5.0 < float(note.split("scatter by ")[1].split()[0]) < 32.0
    assert np.all(loud.map.error > quiet.map.error) and np.all(loud.fit.sigma > 0.999 * quiet.fit.sigma)


@pytest.mark.more
@pytest.mark.slow
def test_wrong_tare_is_reported_and_large_error_is_refused(design, table, sensors, bench):
    (note,) = (n for n in calibrate(design, _with_tares(table, sensors, bench, slip=20_000)).notes if "scatter" in n)
    assert "bench.csv:7:1 rows without load" in note
    with pytest.raises(BenchError, match=r"bench.csv:7:1 rows without load scatter by .* find the noise first"):
        calibrate(design, _with_tares(table, sensors, bench, slip=200_000))


@pytest.mark.more
@pytest.mark.slow
def test_table_with_fewer_than_three_tares_notes_missing_noise_estimate(design, table, foretold):
    assert any(note.startswith("fewer than three rows without load") for note in calibrate(design, table()).notes)
    rows = calibration_files(foretold)["plan.csv"].decode().splitlines()[2:]
    tares = [k for k, row in enumerate(rows) if row.startswith("0,0,")]
    assert tares == [0, 5, len(rows) - 1] and len(rows) == 3 + len(foretold.plan.loads)


@pytest.fixture(scope="module")
def calibrated(sensors, bench, foretold):
    return calibrate_from_points(sensors, bench)


def test_every_fitted_unknown_has_cause_text(sensors):
    assert {cause_text(item.name) for item in sensors.unknowns if item.is_fitted} == set(CAUSES.values())
    assert WIDEST < 3.0


@pytest.mark.parametrize(("square", "free", "chance"), [
    (3.8415, 1, 0.05), (5.9915, 2, 0.05), (7.8147, 3, 0.05), (18.467, 4, 0.001), (29.588, 10, 0.001), (0.0, 3, 1.0),
])
def test_chi_square_probability_matches_published_table(square, free, chance):
    """Abramowitz and Stegun, table 26.8."""
    assert float(chi_square_chance(np.array(square), free)) == approx(chance, rel=2e-4)


@pytest.mark.more
@pytest.mark.slow
def test_stated_error_of_five_point_calibration_holds_within_factor_4(sensors, foretold):
    """It was what points foretell of each other, their own loads' errors in it: up to ten times the true one."""
    tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(20, 600)])
    ratios = []
    for number, own in enumerate(draw_units(sensors.unknowns, 5, 4100)):
        points = simulated(sensors, own, foretold.plan.loads[:5], np.random.default_rng((4100, number)))
        result, read = calibrate_from_points(sensors, points), sensors.frequencies_under(own, tried, exact=True)
        off = result.map(read[1:], read[0]) - tried[1:, sensors.range.columns]
        ratios.append(result.map.error / np.sqrt(np.mean(off**2, axis=0)))
    assert np.all(np.array(ratios) > 0.9) and 1.0 < np.median(ratios) < 4.0


@pytest.mark.slow
def test_hysteresis_increases_stated_map_error(sensors, foretold, hidden, calibrated):
    points = simulated(sensors, hidden, foretold.plan.loads, np.random.default_rng(8), 0.0971)
    worn = calibrate_from_points(sensors, points)
    assert worn.fit.excess > 3.0 and worn.fit.scatter == approx(0.0971 / np.sqrt(12.0), rel=0.6)
    assert np.all(worn.map.error > 1.6 * calibrated.map.error)


def test_unusual_unknowns_are_reported_by_distance_with_cause():
    """The farthest first, relative ones without a unit, and none at the bound itself."""
    units_of = {"gap": "m", "modulus": "1", "capacitor.C1": "1"}
    known = [SimpleNamespace(name=name, unit=unit) for name, unit in units_of.items()]
    fit = SimpleNamespace(moved=np.array([-3.2, 4.0, 3.0]), errors=np.array([-72e-6, 0.25, 0.01]))
    first, second = unusual_unknowns(SimpleNamespace(unknowns=known), fit)
    assert first.startswith(f"unusual: modulus is +4.0 sigma of manufacture off (0.25 relative): "
                            f"{cause_text('modulus')}?")
    assert second.startswith(f"unusual: gap is -3.2 sigma of manufacture off (-7.2e-05 m): {cause_text('gap')}?")
