"""Each quantity of a result is declared once, and every rendering is made of that."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import pytest

from sitscad.basics import quantities
from sitscad.basics.check_results import Measure, Share, Signal
from sitscad.basics.quantities import DASH, Quantity, by_quantity, by_result, document
from sitscad.estimates.coil_estimates import CoilEstimate, MeterReadings, ReadoutEstimate, StateEstimate
from sitscad.estimates.response.response_arrays import Response
from sitscad.estimates.states.at_frequency import CoilAtFrequency
from sitscad.kernels.converters import reference_counter
from sitscad.kernels.converters.reference_counter import ReferenceCounter

RESULTS = [
    (quantities.COIL, CoilEstimate), (quantities.STATE, StateEstimate), (quantities.BARE_TANK, StateEstimate),
    (quantities.TANK_AND_DRIVE, ReadoutEstimate), (quantities.RATES, ReadoutEstimate),
    (reference_counter.SETTINGS, ReferenceCounter), (quantities.SCAN_TIMES, ReadoutEstimate),
    (quantities.LONE_TIMES, ReadoutEstimate), (quantities.METERED, MeterReadings),
    (quantities.AT_FREQUENCY, CoilAtFrequency), (quantities.RESPONSE, Response),
    (quantities.SIGNAL, Signal), (quantities.FIT, Measure),
    (quantities.FIT_PART, Share),
]


@pytest.mark.parametrize(("table", "result"), RESULTS)
def test_each_quantity_refers_to_field_of_its_result_type(table, result):
    known = {field.name for field in fields(result)} | set(dir(result))
    assert {path.partition(".")[0] for each in table for path in (each.field, each.sigma) if path} <= known
    assert len({each.key for each in table}) == len(table)


SIGNAL = Signal("C1", 2.0, 1.5e-6, -4.96e-9, 0.69e-9, 9.1e3, None, -0.0147, 0.007, math.inf)


def test_quantity_has_equal_value_in_json_text_and_table():
    change = next(each for each in quantities.SIGNAL if each.key == "inductance_H_per_N")
    assert change.unit == "H/N" and change.number(SIGNAL) == SIGNAL.per_newton
    assert change.text(SIGNAL) == "-4.96 +- 0.69 nH/N" and change.plain(SIGNAL) == "-4.96 nH/N"
    assert [change.label, change.text(SIGNAL)] in by_quantity([SIGNAL], quantities.SIGNAL)
    assert by_result([SIGNAL], [change]).rows == [[change.text(SIGNAL)]]
    assert document(SIGNAL, [change]) == {"inductance_H_per_N": SIGNAL.per_newton}


def test_absent_value_is_null_in_json_and_dash_in_table():
    steps = next(each for each in quantities.SIGNAL if each.key == "steps")
    unknown = replace(SIGNAL, steps=None)
    assert steps.number(SIGNAL) is None and steps.text(SIGNAL) == DASH == steps.text(unknown)
    assert by_quantity([unknown], [steps]) == [] and by_quantity([None, SIGNAL], [steps]) == [[steps.label, DASH, DASH]]


def test_ratio_is_shown_in_percent_and_area_in_square_millimetres():
    assert Quantity("share", "", 3, is_share=True).text(SIGNAL) == "-1.47 %"
    assert Quantity("area_m2", path="rest").text(SIGNAL) == "1.5 mm2"
