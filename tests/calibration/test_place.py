"""Where loads stand on the target: how exactly they have to, what that costs, and how a plan shows it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.calibration import points
from sitscad.calibration.calibration import calibrate_from_points, plan_calibration
from sitscad.calibration.points import Points, place_changes
from sitscad.calibration.unknowns import draw_units, usual_value
from sitscad.files.report.calibration import plan_card, plan_instructions
from sitscad.spec import templates


def test_reading_change_of_displaced_load_equals_effect_of_its_moment(sensors):
    loads, none = np.array([[4.0, 0.0, 0.0], [2.0, 0.3, 0.0], [0.0, 0.0, 0.0]]), np.zeros(len(sensors.unknowns))
    result, place = place_changes(sensors, none, loads), usual_value("place")
    beside = np.hstack([loads, np.zeros((3, 2))])
    here = np.log(sensors.frequencies_under(none, beside))
    for column, moment in ((0, 4), (1, 3)):
        moved = beside.copy()
        moved[:, moment] = (1.0 if column == 0 else -1.0) * place * loads[:, 0]
        change = np.log(sensors.frequencies_under(none, moved)) - here
        # coils in a row along x read a turn about x only by its square, the same both ways
        assert result[:, :, column] == approx(change, rel=0.05, abs=1e-7 if column == 0 else 2e-5)
    assert np.abs(result[0]).max() > 0.0 and not result[2].any()
    assert not place_changes(replace(sensors, is_held=True), none, loads).any()


def test_plan_includes_load_position_errors_and_states_common_offset_effect(sensors, foretold, monkeypatch):
    exact = points.plan_loads(sensors, 8)
    assert np.all(exact.errors_of_offset > 0.0) and np.array_equal(exact.loads, foretold.plan.loads)
    message = re.sub(r"\\s+", " ", plan_instructions(foretold, foretold.plan).decode())
    (first,) = re.findall(r"without a remark; after all rows they add: normal ([0-9.e-]+)", " ".join(message.split()))
    assert float(first) == approx(1e-4 / usual_value("place") * foretold.plan.errors_of_offset[0], rel=0.06)
    assert "rod" in message and "guide" in message and "ball or a point" not in message
    monkeypatch.setattr(points, "usual_value", lambda name: 1e-9 if name == "place" else usual_value(name))
    surer = points.plan_loads(sensors, 8)
    assert np.all(surer.errors[-1] < exact.errors[-1]) and np.all(surer.errors_of_offset < 1e-3
                                                                  * exact.errors_of_offset)


def test_load_card_shows_load_positions_at_scale_one(foretold):
    loads = np.array([[8.0, 0.0, 0.0, 2.8e-3, 2.8e-3], [2.0, 0.0, 0.0, -2.8e-3, 0.0], [2.0, 0.0, 0.0, 0.0, 0.0]])
    card = plan_card(foretold, replace(foretold.plan, loads=loads)).decode()
    wide = float(re.search(r"width='([0-9.]+)mm'", card)[1])
    assert re.search(rf"viewBox='0 0 {wide:g} [0-9.]+'", card), "a millimetre of the drawing is one on paper"
    lines = re.findall(r"d='M([0-9.]+) ([0-9.]+)L([0-9.]+) ([0-9.]+)'", card)
    ends = [[float(value) for value in result] for result in lines]
    small = sorted({((a + c) / 2, (b + d) / 2) for a, b, c, d in ends if b == d and abs(c - a - 0.5) < 1e-6})
    # y is measured downwards: 1.4 mm up, the middle, and 0.35 mm to the right and down
    assert np.array(small) - small[1] == approx(np.array([[0.0, -1.4], [0.0, 0.0], [0.35, 0.35]]), abs=2e-3)
    assert any(abs(c - a - 20.0) < 1e-6 for a, _, c, _ in ends), "the line that a printout is measured by"


@pytest.mark.slow
@pytest.mark.more
def test_loads_displaced_by_100_um_are_within_stated_error():
    """Loads 0.1 mm aside made a normal force of 8 N read 8.17, seven stated sigmas off, without a warning."""
    design = sitscad.Design(sitscad.load_text(templates.read("fingertip_cell"), "t.yaml"))
    result = plan_calibration(design.response)
    sensors, loads = result.sensors, result.plan.rows
    errors = draw_units(sensors.unknowns, 1, 5)[0]
    put = loads.copy()
    put[:, 4] += 1e-4 * put[:, 0]
    generator = np.random.default_rng(1)
    read = Points(loads, None, sensors.noisy_frequencies(sensors.frequencies_under(errors, put, exact=True), generator),
                  loads[:, 0] == 0.0)
    made, probe = calibrate_from_points(sensors, read), sensors.range.evenly_spread_loads(40, 7)
    rest = sensors.frequencies_under(errors, np.zeros((1, 5)), exact=True)[0]
    off = made.map(sensors.frequencies_under(errors, probe, exact=True), rest) - probe[:, sensors.range.columns]
    assert np.all(np.sqrt(np.mean(off**2, axis=0)) < made.map.error)
    assert np.all(made.map.error < 0.02 * sensors.range.full_scales)
