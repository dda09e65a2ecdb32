"""Findings as text and JSON, on values made by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from sitscad.basics.check_results import Signal
from sitscad.basics.finding import Finding, Ignored, NotChecked, Place, Severity
from sitscad.basics.units import escape_controls
from sitscad.checks.findings import CheckedSpec, OutputOptions, as_json, as_text, excerpt

TEXT = "sitscad: 1\nname: x\ncoil:\n\tturns: 6.5\n"
ERROR = Finding("SIT201", "floor", Severity.ERROR, "too weak", "more turns", "coil.turns", 4, 2, 1.4e-7, 2e-7, "H")
NOTE = Finding("SIT305", "gap", Severity.NOTE, "mind it", place=Place(1e-3, 0.0, 2, ("C1",)))
SKIPPED = tuple(NotChecked(rule, "no mount") for rule in ("SIT301", "SIT302"))
CHECKED = CheckedSpec("a b.yaml", TEXT, (ERROR, NOTE), SKIPPED)

WEAK = Finding("SIT217", "small", Severity.WARNING, "hardly felt", "a thinner pad", "coil", 3, 1, detail="by 3 steps")
WHOLE = OutputOptions(verbose=True)

BRIEF = """\
a b.yaml:4:2 SIT201 error too weak
    4 |  turns: 6.5
      |  ^
      hint: more turns

a b.yaml:3:1 SIT217 warning hardly felt

not checked: 2 rules (no mount)
not ok: 1 error, 1 warning, 1 note (check -v shows notes and hints)
"""

EXPECTED = """\
a b.yaml SIT305 note mind it

a b.yaml:3:1 SIT217 warning hardly felt
    3 | coil:
      | ^
      detail: by 3 steps
      hint: a thinner pad

a b.yaml:4:2 SIT201 error too weak
    4 |  turns: 6.5
      |  ^
      hint: more turns

not checked: SIT301, SIT302 (no mount)
not ok: 1 error, 1 warning, 1 note; 2 rules not checked
"""


def test_brief_text_shows_full_errors_and_short_warnings():
    assert as_text([replace(CHECKED, findings=(ERROR, NOTE, WEAK))]) == BRIEF


def test_verbose_text_shows_detail_and_hint_of_every_finding():
    assert as_text([replace(CHECKED, findings=(ERROR, NOTE, WEAK))], WHOLE) == EXPECTED


@pytest.mark.parametrize(("fail_on", "told"), [("error", 0), ("warning", 1), ("note", 2)])
def test_findings_at_fail_level_are_shown_with_hints(fail_on, told):
    milder = CheckedSpec("a.yaml", TEXT, (replace(NOTE, hint="so"), WEAK))
    text = as_text([milder], OutputOptions(fail_on=Severity(fail_on)))
    assert text.count("hint: ") == told
    assert ("check -v shows notes" in text) == (fail_on != "note") and "SIT217 warning hardly felt\n" in text


NARROW = OutputOptions(width=40)


@pytest.mark.parametrize("output", [NARROW, replace(NARROW, verbose=True)], ids=["brief", "whole"])
def test_folded_lines_fit_width_and_preserve_words(output):
    long = replace(WEAK, message="the reading of 12 mm changes by 3 %, " * 5 + "C1", hint="a thinner pad " * 9)
    checked = CheckedSpec("a.yaml", "coil: {" + "turns: 6, " * 90 + "}", (replace(long, line=1),), SKIPPED, signals=(
        Signal("C1", 1.0, 1e-6, -1e-9, 1e-10, 10.0, 1.0, -0.01, 0.005, 90.0),))
    folded, plain = (as_text([checked], each) for each in (output, replace(output, width=None)))
    assert max(map(len, folded.splitlines())) <= 40 < max(map(len, plain.splitlines()))
    assert "3\n" not in folded and "12\n" not in folded, "a number stands apart from its unit"
    words = [[w for line in text.splitlines() if " | " not in line for w in line.split()] for text in (folded, plain)]
    assert words[0] == words[1]


@pytest.mark.parametrize("column", [1, 2, 70, 150, 400, 499, 500])
def test_excerpt_fits_width_and_caret_marks_column(column):
    line = "".join(chr(ord("a") + k % 26) for k in range(500))
    text, caret = excerpt(line, column, 60)
    assert len(text) == 60 and text[caret] == line[column - 1]
    assert excerpt("short", 3, 60) == ("short", 2)


def test_colours_do_not_change_text():
    import re

    for output in (WHOLE, OutputOptions(), OutputOptions(width=30)):
        plain, coloured = (as_text([CHECKED], replace(output, colour=on)) for on in (False, True))
        assert coloured != plain
        assert re.sub(r"\x1b\[[\d;]*m", "", coloured) == plain


def test_findings_of_several_specs_name_their_file():
    text = as_text([CHECKED, CheckedSpec("b.yaml", "", ())], WHOLE)
    assert "a b.yaml: not checked: SIT301" in text
    assert text.endswith("not ok: 1 error, 1 note in 2 specs; 2 rules not checked\n")
    text = as_text([CHECKED, CheckedSpec("b.yaml", "", (), (NotChecked("SIT309", "no shield"),))])
    assert "not checked: 3 rules (check -v says which and why)\n" in text
    assert text.endswith("not ok: 1 error, 1 note in 2 specs (check -v shows notes)\n")


def test_ignored_findings_are_listed_with_reason():
    ignored = CheckedSpec("a.yaml", "", (), ignored=(Ignored(WEAK, "their quotation", "comment"),) * 2)
    assert "ignored: SIT217 2 times (comment: their quotation)\n" in as_text([ignored])
    assert as_text([ignored], WHOLE).count("ignored: SIT217 hardly felt (comment: their quotation)\n") == 2


def test_consecutive_rules_are_shortened_to_ranges():
    rules = ("SIT101", "SIT102", "SIT103", "SIT105", "SIT107", "SIT108", "SIT099", "SIT100")
    checked = CheckedSpec("x", "", (), tuple(NotChecked(rule, "why") for rule in rules))
    assert as_text([checked], WHOLE).startswith("not checked: SIT099-SIT103, SIT105, SIT107, SIT108 (why)\n")


def test_missing_requirements_are_merged_in_one_line():
    reasons = ("no requirements.bandwidth in the spec", "no shield in the spec",
               "no requirements.tilt and requirements.tilt_error in the spec")
    checked = CheckedSpec("x", "", (), tuple(map(NotChecked, ("SIT210", "SIT309", "SIT404"), reasons)))
    assert as_text([checked], WHOLE).splitlines()[:2] == [
        "not checked: SIT210, SIT404 (no requirements in the spec for bandwidth, tilt and tilt_error)",
        "not checked: SIT309 (no shield in the spec)",
    ]


def test_exit_code_follows_worst_finding():
    spec_error = Finding("SIT004", "type", Severity.ERROR, "x")
    warning = Finding("SIT201", "floor", Severity.WARNING, "x")
    cases = ((), (warning,), (ERROR,), (ERROR, spec_error))
    assert [CheckedSpec("x", "", result).exit_code for result in cases] == [0, 0, 1, 2]


def test_json_preserves_floats_and_writes_nan_as_null():
    numbers = Finding("SIT201", "x", Severity.ERROR, "x", measured=0.1 + 0.2, limit=float("nan"))
    document = json.loads(as_json([CheckedSpec("x", "", (numbers, NOTE))]))
    first, second = document["specs"][0]["findings"]
    assert (first["measured"], first["limit"]) == (0.1 + 0.2, None)
    assert second["place"] == {"x_m": 1e-3, "y_m": 0.0, "layer": 2, "nets": ["C1"]}
    assert second["line"] is None


def test_control_characters_are_escaped_in_output():
    assert escape_controls("a\tb\x1b[2J\u202e\x07\u00b5m") == "a b\\x1b[2J\\u202e\\x07\u00b5m"
    hostile = CheckedSpec("x", "\x1b[2J", (Finding("SIT001", "x", Severity.ERROR, "\x1b]0;x\x07", line=1, column=1),))
    assert "\x1b" not in as_text([hostile])
