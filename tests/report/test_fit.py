"""What text, JSON and page say of a sensor that fits its jaw, and of one that does not."""

from __future__ import annotations

import json

import handmade
import pytest
from tolerance import approx

from sitscad.assembly.places.fit import fit
from sitscad.basics.check_results import Measure, Share
from sitscad.checks.findings import CheckedSpec, OutputOptions, as_json, as_text
from sitscad.checks.findings.measures import fit_lines, fit_tables

MEASURED = fit(handmade.jaw_sensor())


def measure(nominal, likely, worst, limit=5e-3):
    return Measure("closed pair", nominal, likely, worst, limit, "jaw", (Share("jaw", 1.3e-3, 5e-5, "a source"),))


def test_negative_overhang_text_says_below_zero():
    words = "of 5 mm (below zero: back from the face's edge), 5.44 mm to spare"
    assert fit_lines([measure(-0.618e-3, -0.504e-3, -0.443e-3)])[0].endswith(words)
    assert "below zero" not in fit_lines([measure(0.1e-3, 0.2e-3, 0.3e-3)])[0]


@pytest.mark.parametrize(("sizes", "words"), [
    ((4.6e-3, 4.7e-3, 4.95e-3), "at worst 4.95 of 5 mm, 50 um to spare"),
    ((4.6e-3, 4.7e-3, 5.1e-3), "at worst 5.1 of 5 mm, 100 um short"),
    ((4.9e-3, 5.2e-3, 5.4e-3), "at worst 5.4 of 5 mm, 400 um short (200 um by root-sum-square)"),
])
def test_fit_line_gives_remaining_or_missing_length(sizes, words):
    assert all(fit_lines([measure(*sizes)], whole)[0].endswith(words) for whole in (False, True))


def test_passing_sensor_prints_fit_margin():
    checked = CheckedSpec("a.yaml", "", (), fit=(measure(4.6e-3, 4.7e-3, 4.95e-3),))
    assert "fit: closed pair at worst 4.95 of 5 mm, 50 um to spare\n" in as_text([checked])
    whole = as_text([checked], OutputOptions(verbose=True))
    assert "fit: closed pair 4.6, by root-sum-square 4.7, at worst 4.95 of 5 mm, 50 um to spare\n" in whole
    assert "fit:" not in as_text([CheckedSpec("a.yaml", "", ())])


def test_json_fit_contains_values_sources_and_margin():
    checked = CheckedSpec("a.yaml", "", (), fit=MEASURED)
    result = json.loads(as_json([checked]))["specs"][0]["fit"]
    assert [entry["name"] for entry in result] == [entry.name for entry in MEASURED]
    assert result[0]["nominal_m"] == approx(MEASURED[0].nominal, rel=1e-6) and result[0]["parts"][0]["source"]
    assert result[0]["margin_m"] == approx(result[0]["limit_m"] - result[0]["worst_m"], rel=1e-6)
    assert json.loads(as_json([CheckedSpec("a.yaml", "", ())]))["specs"][0]["fit"] == []


def test_fit_tables_have_row_per_measure_and_part():
    fit, parts = fit_tables(MEASURED)
    assert [len(row) for row in fit.rows] == [len(fit.head)] * len(MEASURED)
    assert len(parts.rows) == len(MEASURED[0].parts) and {len(row) for row in parts.rows} == {len(parts.head)}
    assert [table.rows for table in fit_tables(())] == [[], []]
