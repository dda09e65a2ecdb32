"""Edits of a spec's text change what they name and nothing else: comments, order, quotes, units and line ends stay."""

from __future__ import annotations

import difflib
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitscad.basics.finding import Edit
from sitscad.spec import templates
from sitscad.spec.yaml.rewriting import CannotWriteError, complete_edits, rewritten
from sitscad.spec.yaml.source import read_yaml

TEXT = """\
# a spec in every style
sitscad: 1
coil:   # the coil
    turns: 6.5   # per layer
    trace_width: 100 um
    trace_spacing: "0.1 mm"  # quoted
    outer_diameter: [ 8 ,5 mm]
# about the array
array: {pattern: line, pitch: 4}
mount: {}
centres:
- [1, 2]
-  - 3
   - 4"""

CASES = {
    "a value": (Edit("coil.turns", "7"), ["    turns: 7   # per layer"]),
    "in its unit": (Edit("coil.trace_width", "0.12 mm"), ["    trace_width: 120 um"]),
    "in its quotes": (Edit("coil.trace_spacing", "120 um"), ['    trace_spacing: "0.12 mm"  # quoted']),
    "no finer than it can be told": (Edit("coil.trace_width", "0.1254 mil"), ["    trace_width: 3.18516 um"]),
    "one of a list": (Edit("coil.outer_diameter", "[8, 4.6]"), ["    outer_diameter: [ 8 ,4.6 mm]"]),
    "a list for a list": (Edit("coil.outer_diameter", "4.5"), ["    outer_diameter: 4.5"]),
    "a bare number": (Edit("array.pitch", "4.2 mm"), ["array: {pattern: line, pitch: 4.2}"]),
    "a number for a word": (Edit("array.pattern", "3"), ["array: {pattern: 3, pitch: 4}"]),
    "a new key": (Edit("coil.start_angle", "15 deg"), ["    start_angle: 15 deg"]),
    "a new key in brackets": (Edit("array.count", "3"), ["array: {pattern: line, pitch: 4, count: 3}"]),
    "a new key in empty brackets": (Edit("mount.standoff", "1"), ["mount: {standoff: 1}"]),
    "a section below brackets": (Edit("mount.jaw.width", "5"), ["mount: {jaw: {width: 5}}"]),
    "a new section": (Edit("fpc.tail.length", "30"), ["fpc:", "    tail:", "        length: 30"]),
    "in a list of lines": (Edit("centres", "[[1, 2], [3, 5]]"), ["   - 5"]),
    "a name": (Edit("coil.turns", "windings", what="name"), ["    windings: 6.5   # per layer"]),
}


def changed_lines(before, after):
    """What stands in the lines that are new."""
    lines = (text.rstrip("\r\n") for text in (*before.splitlines(True), "\0"))
    return [
        line[2:].rstrip("\r\n")
        for line in difflib.ndiff(list(lines), [text.rstrip("\r\n") for text in (*after.splitlines(True), "\0")])
        if line.startswith("+ ")
    ]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["line feeds", "windows", "carriage returns"])
@pytest.mark.parametrize("name", CASES)
def test_edit_changes_only_expected_lines_and_keeps_line_ends(name, end):
    edit, lines = CASES[name]
    text = "\ufeff" + TEXT.replace("\n", end)
    after = rewritten(text, [edit])
    assert changed_lines(text, after) == lines
    assert after.startswith("\ufeff") and not after.endswith(end)
    assert re.sub(re.escape(end), "", after).count("\n") == re.sub(re.escape(end), "", after).count("\r") == 0


REFUSED = {
    "below a name": Edit("array.pattern.kind", "x"),
    "a section by a value": Edit("coil", "3"),
    "a list by a longer one": Edit("centres", "[[1, 2], [3, 4], [5, 6]]"),
    "a name that is not there": Edit("coil.windings", "turns", what="name"),
    "a value that would open a bracket": Edit("array.pitch", "4, count: 3"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_edit_without_place_in_text_raises_cannot_write_error(name):
    with pytest.raises(CannotWriteError):
        rewritten(TEXT, [REFUSED[name]])


def test_edit_of_text_without_mapping_raises_cannot_write_error():
    for text in ("", "- 1\n", "a: [", "a: 1\n--- \nb: 2\n"):
        with pytest.raises(CannotWriteError):
            rewritten(text, [Edit("a", "1")])


def test_completed_edits_contain_written_quotes_units_and_old_values():
    (quoted,) = complete_edits(TEXT, [Edit("coil.trace_spacing", "120 um")])
    assert quoted == Edit("coil.trace_spacing", '"0.12 mm"', '"0.1 mm"')
    assert rewritten(TEXT, [quoted]) == rewritten(TEXT, [Edit("coil.trace_spacing", "120 um")])
    edits = [Edit("coil.trace_width", "0.12 mm"), Edit("coil.start_angle", "15 deg"), Edit("array.pitch", "4")]
    assert complete_edits(TEXT, edits) == (
        Edit("coil.trace_width", "120 um", "100 um"),
        Edit("coil.start_angle", "15 deg", None),
    )


def flat(data, key=""):
    """Every single value of a document, by its dotted key."""
    if isinstance(data, dict):
        return {k: v for name, inner in data.items() for k, v in flat(inner, f"{key}.{name}".strip(".")).items()}
    if isinstance(data, list):
        return {k: v for n, inner in enumerate(data) for k, v in flat(inner, f"{key}.{n}").items()}
    return {key: data}


TEMPLATES = {name: templates.read(name) for name in templates.names()}


@pytest.mark.slow
@given(st.data())
def test_replacing_any_template_value_changes_only_that_value(data):
    text = TEMPLATES[data.draw(st.sampled_from(sorted(TEMPLATES)))]
    before = flat(read_yaml(text).data)
    key = data.draw(st.sampled_from(sorted(before)))
    new = data.draw(st.sampled_from(["7", "0.123 mm", "330 pF", "none", "[1, 2]", "15 deg"]))
    after = rewritten(text, [Edit(key, new)])
    changed = {k for k, v in flat(read_yaml(after).data).items() if before.get(k) != v}
    assert all(f"{k}.".startswith(f"{key}.") for k in changed)
    item, other = text.splitlines(), after.splitlines()
    assert len(item) == len(other) and sum(a != b for a, b in zip(item, other, strict=True)) <= 1
    (edit,) = complete_edits(text, [Edit(key, new)]) or (Edit(key, new),)
    assert rewritten(after, [edit]) == after


@given(st.data())
def test_adding_any_key_to_template_changes_only_that_key(data):
    text = TEMPLATES[data.draw(st.sampled_from(sorted(TEMPLATES)))]
    sections = ["", *(k for k, v in read_yaml(text).data.items() if isinstance(v, dict)), "absent", "absent.too"]
    key = f"{data.draw(st.sampled_from(sections))}.quite_new".strip(".")
    after = rewritten(text, [Edit(key, "3 mm")])
    assert flat(read_yaml(after).data) == {**flat(read_yaml(text).data), key: "3 mm"}
    gone = set(text.splitlines()) - set(after.splitlines())
    assert all("{" in line for line in gone) and len(gone) <= 1
