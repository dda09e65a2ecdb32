"""What is printed of axes that no reading tells, and of errors far beyond full scale."""

from __future__ import annotations

import math

import pytest

from sitscad.estimates.performance.tables import load_text, sensor_rows
from sitscad.estimates.performance_values import full_scale_text, largest_lasting_error
from sitscad.files.report.page import _performance_html


def test_unmeasurable_axis_has_no_values():
    """Its document has none (None): the page ended in a TypeError, and its largest error was nothing."""
    assert load_text(math.inf, "normal") == "no reading tells it" and load_text(3e-3, "normal") == "3 mN"
    untold = dict.fromkeys(("noise", "creep", "capacitors, without a tare"))
    assert largest_lasting_error(untold)[0] == math.inf
    assert largest_lasting_error({"noise": 3e-3, "creep": 0.05, "capacitors, without a tare": 9.0}) == (0.05, "creep")


@pytest.mark.parametrize(
    ("error", "words"),
    [(0.01, "0.01 N (0.5 %)"), (0.5, "0.5 N (25 %)"), (20.1, "more than 10 times full scale"),
     (math.inf, "more than 10 times full scale")],
)
def test_error_text_gives_percent_of_full_scale(error, words):
    """A unit without a tare read 2.5e+07 N off, to ten digits of a per cent."""
    assert full_scale_text(error, 2.0) == words


def test_performance_section_contains_unit_to_unit_table():
    """Shares were of another full scale than the map's, and rounded again: 76 % beside the data sheet's 75 %."""
    message = [["error over all loads, of", "normal, of 2 N"], ["any unit, read without a tare", "1.5 N (75 %)"]]
    page = _performance_html({"unit_to_unit": {"errors_are": "One sigma.", "in_words": message}})
    assert all(cell in page for row in message for cell in row)
    assert "unit" not in _performance_html({"performance": ()})


@pytest.mark.parametrize("free", [None, 88.5])
def test_overload_of_free_target_is_listed_beside_level_target(free):
    """155 N stood alone where a target that is free to tilt is lost at 88."""
    full = {
        "at": "full", "axes": {"normal": {"limited_by": "strain"}}, "condition_number": 2.0,
        "friction_error": None, "tilt_rad": math.radians(1.0), "tilt_error_N": {}, "bandwidth_Hz": 50.0,
        "tilt_stiffness_Nm_per_rad": {"rx": 0.5, "ry": None}, "tilt_stiffness_error": {"rx": 0.05, "ry": None},
        "bandwidth_by": "half the scan rate", "resonance_Hz": {}, "overload_N": 155.0, "free_overload_N": free,
        "invertible": True,
    }
    rows = [row for row in sensor_rows([full]) if row[0].startswith("overload")]
    if free is None:
        assert [value for _, value in rows] == ["155 N"]
    else:
        assert [value for _, value in rows] == ["155 N", "88.5 N"]
        assert "kept level" in rows[0][0] and "free to tilt" in rows[1][0]
