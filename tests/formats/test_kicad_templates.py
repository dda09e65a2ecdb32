"""The shipped templates through KiCad: nothing to complain about, and the same image as our own Gerber files."""

from __future__ import annotations

from pathlib import Path

import pytest
from kicad_oracle import needs_kicad, plots, rule_check, write
from tolerance import approx

from sitscad.formats.gerber import board as gerber
from sitscad.formats.kicad import project as kicad
from sitscad.formats.kicad.sexpr import copper_names
from sitscad.layout import lay_out
from sitscad.spec.load import load

TEMPLATES = sorted((Path(__file__).parents[2] / "templates").glob("*.yaml"))


@pytest.fixture(params=TEMPLATES, ids=[path.stem for path in TEMPLATES])
def template(request):
    """A template's layout."""
    return lay_out(load(str(request.param)))


def test_there_are_templates():
    assert len(TEMPLATES) >= 3


@needs_kicad
def test_rule_check_finds_nothing(template, tmp_path):
    assert rule_check(write(kicad.render(template), tmp_path)) == ([], [])


@needs_kicad
def test_plots_show_what_our_gerber_files_show(template, tmp_path):
    shapes = pytest.importorskip("gerber_shapes", reason="gerbonara and shapely are not installed")
    theirs = plots(write(kicad.render(template), tmp_path))
    ours = {name.rpartition("/")[2]: content for name, content in gerber.render(template).items()}
    for name in (*copper_names(template.copper_layers), "F.Mask"):
        ending = name.replace(".", "_")
        one = shapes.image(shapes.read(ours[f"{template.spec.name}-{ending}.gbr"]))
        other = shapes.image(shapes.GerberFile.open(theirs[ending]))
        assert other.area == approx(one.area, rel=1e-4), name
        assert one.symmetric_difference(other).area < 1e-3 * one.area, name
