"""The example notebook runs from top to bottom, and each value at the end of a cell has a picture or a table."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

import sitscad

NOTEBOOK = Path(__file__).parents[2] / "docs/examples/notebook.ipynb"


class Formatter(dict):
    """A formatter of IPython, as far as types are given to it by name."""

    def for_type_by_name(self, module, name, function):
        self[module, name] = function


@pytest.fixture(scope="module")
def formatters():
    kinds = {"image/svg+xml": Formatter(), "text/html": Formatter()}
    sitscad.load_ipython_extension(SimpleNamespace(display_formatter=SimpleNamespace(formatters=kinds)))
    return kinds


@pytest.fixture(scope="module")
def values():
    """The names of the notebook after its last cell, without lines for IPython."""
    names = {}
    for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]:
        lines = "".join(cell["source"]).split("\n")
        if cell["cell_type"] == "code":
            exec("\n".join(line for line in lines if not line.startswith("%")), names)
    return names


def function_of(formatter, value):
    return formatter.get((type(value).__module__, type(value).__qualname__))


@pytest.mark.parametrize("name", ["spec", "design"])
def test_notebook_shows_boards_as_svg(name, formatters, values):
    drawn = ElementTree.fromstring(function_of(formatters["image/svg+xml"], values[name])(values[name]))
    assert drawn.tag == "{http://www.w3.org/2000/svg}svg" and len(list(drawn.iter())) > 20


def test_notebook_shows_layout_and_spec_equally(formatters, values):
    spec, layout = values["spec"], values["design"].layout
    shown = formatters["image/svg+xml"]
    assert function_of(shown, layout)(layout) == function_of(shown, spec)(spec)


def test_notebook_shows_coil_as_its_picture(values):
    assert values["coil"]._repr_svg_() == values["coil"].picture()
    ElementTree.fromstring(values["coil"].picture())


class Cells(HTMLParser):
    """The text of a table's cells; a tag that is not closed fails."""

    def __init__(self, text):
        super().__init__()
        self.open, self.cells = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.cells.append(data)


@pytest.mark.parametrize("name", ["estimates", "response", "result"])
def test_notebook_shows_estimates_and_findings_as_tables(name, formatters, values):
    value = values[name]
    cells = Cells(function_of(formatters["text/html"], value)(value)).cells
    named = [finding.rule for finding in value.findings] if name == "result" else ["C1"]
    assert named and set(named) <= set(cells)


def test_notebook_formatters_exist_for_public_types_only(formatters):
    public = {(each.__module__, each.__qualname__) for each in (
        sitscad.SensorSpec, sitscad.Layout, sitscad.Design, sitscad.Estimates, sitscad.Response, sitscad.CheckResult)}
    assert {key for formatter in formatters.values() for key in formatter} == public
