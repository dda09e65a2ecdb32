"""The parser of libyaml reads a text as PyYAML's parser in Python does, values and places, or refuses it."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from sitscad.spec import templates
from sitscad.spec.yaml import source as reader
from sitscad.spec.yaml.source import TextError

PIECES = (
    "a", "b:", "c: ", "d: 1", "e: 1.5 mm", "- ", "-", "- 1", "- f: 2", "  ", "    ", "\n", "\n  ", "\n    ", "\n- ",
    "[", "]", "{", "}", ", ", ",", ": ", ":", "#", " # words", "'", '"', "'x y'", '"z: 1"', "[1, 2]", "{g: 3, h: i}",
    "null", "~", "true", "1e3", "0x1f", ".inf", "-.5", "+1", "|", ">", "&x", "*x", "!t", "%", "@", "---",
    "...", "\t", "\r", "µ", "\u2028", "\u0085", "a-b_c", "i - j", "k#l", "m, n", "o(p)", "x*y", "\\", "<<: 1", "=",
)


def read_by(parser, text):
    """What a parser reads of a text: values, their places, flaws. None where it refuses the text."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader, "PARSER", parser)
        try:
            result = reader.read_yaml(text)
        except TextError:
            return None
    values = {key: result.values[key] for key in result.ends}  # parsers place what is empty each in its own way
    return repr(result.data), list(result.keys.items()), values, result.ends, [str(flaw) for flaw in result.flaws]


def same(text):
    """Whether libyaml's parser reads a text; asserts that the other one then says the same, if it reads it as well."""
    assert reader.PARSER is yaml.CSafeLoader
    first, second = read_by(yaml.CSafeLoader, text), read_by(yaml.SafeLoader, text)
    assert first == second or first is None or second is None
    return first is not None


@pytest.mark.parametrize("name", templates.names())
def test_both_parsers_read_each_template_equally(name):
    assert same(templates.read(name))


@given(st.lists(st.sampled_from(PIECES), max_size=14).map("".join))
@settings(max_examples=300, deadline=None)
def test_both_parsers_read_random_yaml_equally(text):
    same(text)
    same("a: 1\nb:\n  " + text)
    same("a: [1, " + text + "]\n")


def test_both_parsers_read_unindented_lists_equally():
    text = "a:\n- 1\n- b: 2\n  c:\n    - {d: e f, g: [3]}\nh: 'i: j'  # k\n"
    assert same(text)
    assert reader.read_yaml(text).data == {"a": [1, {"b": 2, "c": [{"d": "e f", "g": [3]}]}], "h": "i: j"}
