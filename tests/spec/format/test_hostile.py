"""Input that means harm or comes by accident: a finding, quickly, in little memory."""

from __future__ import annotations

import time
import tracemalloc

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sitscad.spec.load import load, load_text
from sitscad.spec.reading import RULE_NAMES, SpecError

MINIMAL = (
    "sitscad: 1\nname: a\ncoil: {shape: circle, outer_diameter: 7, turns: 5, trace_width: 0.1, trace_spacing: 0.1}\n"
)

TEXTS = {
    "empty": ("", "SIT001", 1, 1),
    "only blanks": ("\n \n\n", "SIT001", 1, 1),
    "only a comment": ("# nothing\n", "SIT001", 1, 1),
    "only a document mark": ("---\n", "SIT001", 1, 1),
    "a word": ("sensor\n", "SIT001", 1, 1),
    "a list": ("- sitscad: 1\n", "SIT001", 1, 1),
    "a number": ("7\n", "SIT001", 1, 1),
    "tab as indent": ("coil:\n\tshape: circle\n", "SIT001", 2, 1),
    "open bracket": ("name: a\ncoil: [1, 2\nfpc: 1\n", "SIT001", 2, 7),
    "open quote": ('name: "a\n', "SIT001", 1, 7),
    "two colons": ("name: a: b\n", "SIT001", 1, 8),
    "bad indent": ("coil:\n  shape: circle\n turns: 5\n", "SIT001", 3, 2),
    "bad escape": ('name: "\\q"\n', "SIT001", 1, 8),
    "escape beyond unicode": ('name: "\\UFFFFFFFF"\n', "SIT001", 1, 10),
    "control character": ("sitscad: 1\nname: a\x07\n", "SIT001", 2, 8),
    "nul": ("sitscad: 1\nname: \x00\n", "SIT001", 2, 7),
    "lone surrogate": ("name: \ud800\n", "SIT001", 1, 7),
    "unknown yaml version": ("%YAML 3.0\n---\nname: a\n", "SIT001", 1, 1),
    "two documents": (MINIMAL + "---\n" + MINIMAL, "SIT013", 4, 1),
    "anchor": ("name: &a b\n", "SIT013", 1, 7),
    "alias": ("name: *a\n", "SIT013", 1, 7),
    "billion laughs": ("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "SIT013", 1, 4),
    "python object": ('name: !!python/object/apply:os.system ["true"]\n', "SIT013", 1, 7),
    "binary tag": ("name: !!binary aGk=\n", "SIT013", 1, 7),
    "list as key": ("[a, b]: 1\n", "SIT013", 1, 1),
    "section as key": ("{a: 1}: 1\n", "SIT013", 1, 1),
    "number as key": ("coil:\n  7: 1\n", "SIT013", 2, 3),
    "truth as key": ("true: 1\n", "SIT013", 1, 1),
    "null as key": ("~: 1\n", "SIT013", 1, 1),
    "surrogate in a key": ('"\\ud800": 1\n', "SIT001", 1, 4),
    "long key": ("k" * 500 + ": 1\n", "SIT013", 1, 1),
    "deep flow lists": ("a: " + "[" * 100_000, "SIT010", 1, 15),
    "deep flow sections": ("a: " + "{a: " * 50_000, "SIT010", 1, 48),
    "deep block sections": ("".join(" " * i + "a:\n" for i in range(500)), "SIT010", 13, 13),
    "deep block lists": ("- " * 100_000, "SIT010", 1, 25),
    "many keys": ("".join(f"k{i}: 1\n" for i in range(20_000)), "SIT010", 2000, 8),
    "many entries": ("a: [" + "1," * 100_000 + "]", "SIT010", 1, 7999),
    "too long": ("# " + "x" * 300_000, "SIT010", 1, 1),
    "endless number": ("sitscad: " + "9" * 200_000, "SIT008", 1, 10),
    "hexadecimal monster": ("sitscad: 0x" + "f" * 200_000, "SIT008", 1, 10),
    "merge key": ("sitscad: 1\n<<: {name: a}\n", "SIT002", 2, 1),
}


@pytest.mark.parametrize("name", TEXTS)
def test_hostile_text_is_refused_with_line_and_column_within_5_seconds(name):
    text, rule, line, column = TEXTS[name]
    started = time.process_time()
    with pytest.raises(SpecError) as caught:
        load_text(text, "spec.yaml")
    finding = next(f for f in caught.value.findings if f.rule == rule)
    assert (finding.line, finding.column) == (line, column)
    assert len(finding.message) < 300 and finding.message.isprintable()
    assert time.process_time() - started < 5, "bounded work, whatever the text"


@pytest.mark.slow
def test_nested_lists_of_250000_levels_take_under_50_megabytes():
    load_text(MINIMAL)
    tracemalloc.start()
    with pytest.raises(SpecError):
        load_text("a: " + "[" * 250_000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6


FILES = {
    "latin-1": (MINIMAL.replace("name: a", "name: a # µ").encode("latin-1"), "SIT011", 2, 11),
    "utf-16": (MINIMAL.encode("utf-16"), "SIT011", 1, 1),
    "utf-32": (MINIMAL.encode("utf-32"), "SIT011", 1, 1),
    "junk": (bytes(range(256)), "SIT011", 2, 118),
    "png": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "SIT011", 1, 1),
    "zip": (b"PK\x03\x04\x14\0\0\0\x08\0", "SIT001", 1, 3),
    "large": (b"# " + b"x" * 300_000, "SIT010", 1, 1),
    "empty": (b"", "SIT001", 1, 1),
}


@pytest.mark.parametrize("name", FILES)
def test_file_that_is_not_a_spec_is_refused_with_line_and_column(name, tmp_path):
    content, rule, line, column = FILES[name]
    path = tmp_path / "spec.yaml"
    path.write_bytes(content)
    with pytest.raises(SpecError) as caught:
        load(path)
    (finding,) = caught.value.findings
    assert (finding.rule, finding.line, finding.column) == (rule, line, column)


def test_missing_file_and_directory_are_refused_as_unreadable(tmp_path):
    for path in (tmp_path / "none.yaml", tmp_path, tmp_path / "none" / "spec.yaml", "nul\0byte.yaml"):
        with pytest.raises(SpecError) as caught:
            load(path)
        assert [f.rule for f in caught.value.findings] == ["SIT011"]


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + MINIMAL.encode(),
        MINIMAL.replace("\n", "\r\n").encode(),
        MINIMAL.replace("\n", "\r").encode(),
        b"%YAML 1.2\n---\n" + MINIMAL.encode() + b"...\n",
        MINIMAL.rstrip("\n").encode(),
    ],
    ids=["byte order mark", "windows lines", "old mac lines", "yaml directive", "no last newline"],
)
def test_spec_with_other_encoding_or_line_ends_gives_equal_coil(content, tmp_path):
    path = tmp_path / "spec.yaml"
    path.write_bytes(content)
    assert load(path).coil == load_text(MINIMAL).coil


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(st.text(max_size=200) | st.binary(max_size=200).map(lambda raw: raw.decode("latin-1")))
@example("a: !<tag:x> 1")
@example("? a\n: b")
@example("- ? a")
@example("'")
def test_random_text_raises_only_spec_errors_with_placed_findings(text):
    with pytest.raises(SpecError) as caught:
        load_text(text)
    assert all(f.rule in RULE_NAMES and f.line >= 1 and f.column >= 1 for f in caught.value.findings)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, len(MINIMAL)), st.integers(0, 30), st.text(max_size=8))
def test_spec_with_replaced_characters_is_loaded_or_raises_spec_error(start, length, inserted):
    try:
        load_text(MINIMAL[:start] + inserted + MINIMAL[start + length :])
    except SpecError as error:
        assert error.findings
