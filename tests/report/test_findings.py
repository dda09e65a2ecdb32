"""Findings as text and JSON, on values made by hand."""

from __future__ import annotations

import json

from sitscad.finding import Finding, NotChecked, Place, Severity
from sitscad.report.findings import CheckedSpec, as_json, as_text, printable

TEXT = "sitscad: 1\nname: x\ncoil:\n\tturns: 6.5\n"
ERROR = Finding("SIT201", "floor", Severity.ERROR, "too weak", "more turns", "coil.turns", 4, 2, 1.4e-7, 2e-7, "H")
NOTE = Finding("SIT305", "gap", Severity.NOTE, "mind it", place=Place(1e-3, 0.0, 2, ("C1",)))
SKIPPED = tuple(NotChecked(rule, "no mount") for rule in ("SIT301", "SIT302"))
CHECKED = CheckedSpec("a b.yaml", TEXT, (ERROR, NOTE), SKIPPED)

EXPECTED = """\
a b.yaml SIT305 note mind it
a b.yaml:4:2 SIT201 error too weak
    4 |  turns: 6.5
      |  ^
      hint: more turns
not checked: SIT301, SIT302 (no mount)
not ok: 1 error, 1 note; 2 rules not checked
"""


def test_text_is_one_line_a_finding_with_its_source_and_hint():
    assert as_text([CHECKED]) == EXPECTED


def test_colours_are_added_around_the_same_text():
    import re

    coloured = as_text([CHECKED], True)
    assert coloured != EXPECTED
    assert re.sub(r"\x1b\[[\d;]*m", "", coloured) == EXPECTED


def test_several_specs_are_told_apart():
    text = as_text([CHECKED, CheckedSpec("b.yaml", "", ())])
    assert "a b.yaml: not checked: SIT301" in text
    assert text.endswith("not ok: 1 error, 1 note in 2 specs; 2 rules not checked\n")


def test_runs_of_rules_are_drawn_together():
    rules = ("SIT101", "SIT102", "SIT103", "SIT105", "SIT107", "SIT108", "SIT099", "SIT100")
    checked = CheckedSpec("x", "", (), tuple(NotChecked(rule, "why") for rule in rules))
    assert as_text([checked]).startswith("not checked: SIT099-SIT103, SIT105, SIT107, SIT108 (why)\n")


def test_requirements_that_are_not_stated_make_one_line():
    reasons = ("no requirements.bandwidth in the spec", "no shield in the spec",
               "no requirements.tilt or requirements.tilt_error in the spec")  # fmt: skip
    checked = CheckedSpec("x", "", (), tuple(map(NotChecked, ("SIT210", "SIT309", "SIT404"), reasons)))
    assert as_text([checked]).splitlines()[:2] == [
        "not checked: SIT210, SIT404 (no requirements in the spec for bandwidth, tilt or tilt_error)",
        "not checked: SIT309 (no shield in the spec)",
    ]


def test_exit_codes_follow_the_worst_finding():
    spec_error = Finding("SIT004", "type", Severity.ERROR, "x")
    warning = Finding("SIT201", "floor", Severity.WARNING, "x")
    cases = ((), (warning,), (ERROR,), (ERROR, spec_error))
    assert [CheckedSpec("x", "", found).exit_code for found in cases] == [0, 0, 1, 2]


def test_json_numbers_round_trip_and_what_is_not_finite_is_null():
    numbers = Finding("SIT201", "x", Severity.ERROR, "x", measured=0.1 + 0.2, limit=float("nan"))
    document = json.loads(as_json([CheckedSpec("x", "", (numbers, NOTE))]))
    first, second = document["specs"][0]["findings"]
    assert (first["measured"], first["limit"]) == (0.1 + 0.2, None)
    assert second["place"] == {"x_m": 1e-3, "y_m": 0.0, "layer": 2, "nets": ["C1"]}
    assert second["line"] is None


def test_nothing_that_steers_a_terminal_is_printed():
    assert printable("a\tb\x1b[2J\u202e\x07\u00b5m") == "a b\\x1b[2J\\u202e\\x07\u00b5m"
    hostile = CheckedSpec("x", "\x1b[2J", (Finding("SIT001", "x", Severity.ERROR, "\x1b]0;x\x07", line=1, column=1),))
    assert "\x1b" not in as_text([hostile])
