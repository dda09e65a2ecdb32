"""The reader of plain YAML says of a text what the whole reader says, value by value and place by place, or nothing."""

from __future__ import annotations

import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitscad.spec import templates
from sitscad.spec.yaml.events import read_events
from sitscad.spec.yaml.reader import NotPlain, PlainReader, read_yaml

PIECES = (
    "a", "b:", "c: ", "d: 1", "e: 1.5 mm", "- ", "-", "- 1", "- f: 2", "  ", "    ", "\n", "\n  ", "\n    ", "\n- ",
    "[", "]", "{", "}", ", ", ",", ": ", ":", "#", " # words", "'", '"', "'x y'", '"z: 1"', "[1, 2]", "{g: 3, h: i}",
    "null", "~", "true", "1e3", "0x1f", ".inf", "-.5", "+1", "|", ">", "&x", "*x", "!t", "?", "? ", "%", "@", "---",
    "...", "\t", "\r", "µ", "\u2028", "\u0085", "a-b_c", "i - j", "k#l", "m, n", "o(p)", "x*y", "\\", "<<: 1", "=",
)


def same(text):
    """Whether the plain reader read a text, and then as the whole one does."""
    try:
        plain = PlainReader(text).read()
    except NotPlain:
        return False
    whole = read_events(text)
    assert repr(plain.data) == repr(whole.data)
    assert list(plain.keys.items()) == list(whole.keys.items())
    assert plain.values == whole.values
    assert not whole.flaws
    return True


@pytest.mark.parametrize("name", templates.names())
def test_every_template_is_plain(name):
    assert same(templates.read(name))


@given(st.lists(st.sampled_from(PIECES), max_size=14).map("".join))
@settings(max_examples=600, deadline=None)
def test_texts_out_of_pieces_are_read_alike(text):
    same(text)
    same("a: 1\nb:\n  " + text)
    same("a: [1, " + text + "]\n")


@pytest.mark.slow
@given(st.data())
@settings(max_examples=300, deadline=None)
def test_templates_with_changes_are_read_alike(data):
    text = templates.read(data.draw(st.sampled_from(templates.names())))
    for _ in range(data.draw(st.integers(1, 3))):
        at, length = data.draw(st.integers(0, len(text))), data.draw(st.integers(0, 3))
        text = text[:at] + data.draw(st.sampled_from(("", *PIECES))) + text[at + length :]
    same(text)


@pytest.mark.parametrize(
    "text",
    ["", "a:", "a: 1\na: 2", "a:\n  b: 1\n c: 2", "- - 1", "a: 'it''s'", 'a: "\\n"', "a: &x 1", "? a", "a: |\n  b"],
)
def test_what_is_not_surely_plain_is_left_to_the_whole_reader(text):
    with pytest.raises(NotPlain):
        PlainReader(text).read()


def test_lists_beside_their_key_and_sections_beside_their_dash():
    text = "a:\n- 1\n- b: 2\n  c:\n    - {d: e f, g: [3]}\nh: 'i: j'  # k\n"
    assert same(text)
    assert read_yaml(text).data == {"a": [1, {"b": 2, "c": [{"d": "e f", "g": [3]}]}], "h": "i: j"}


def test_a_plain_spec_is_loaded_without_the_whole_reader():
    code = "import sys; from sitscad import load; load(sys.argv[1]); print('ruamel.yaml' in sys.modules)"
    spec = str(templates.directory() / "single_coil.yaml")
    done = subprocess.run([sys.executable, "-c", code, spec], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
