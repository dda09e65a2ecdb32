"""The shipped templates through KiCad: nothing to complain about, and the same image as our own Gerber files."""

from __future__ import annotations

import pytest
from kicad_oracle import needs_kicad, plots, rule_check, write
from tolerance import approx

from sitscad.files.formats import gerber
from sitscad.files.formats.kicad import project_files as kicad
from sitscad.files.formats.kicad.sexpr import copper_names
from sitscad.layout import lay_out
from sitscad.spec.load import load


@pytest.fixture
def layout(template):
    """A template's layout."""
    return lay_out(load(str(template)))


@pytest.mark.slow
@needs_kicad
def test_rule_check_of_template_finds_no_violation(layout, tmp_path):
    assert rule_check(write(kicad.render(layout), tmp_path)) == ([], [])


@pytest.mark.few(2)
@pytest.mark.slow
@needs_kicad
def test_kicad_plots_of_template_match_gerber_files(layout, tmp_path):
    shapes = pytest.importorskip("gerber_shapes", reason="gerbonara and shapely are not installed")
    theirs = plots(write(kicad.render(layout), tmp_path))
    ours = {name.rpartition("/")[2]: content for name, content in gerber.render(layout).items()}
    for name in (*copper_names(layout.copper_layers), "F.Mask"):
        ending = name.replace(".", "_")
        item = shapes.image(shapes.read(ours[f"{layout.spec.name}-{ending}.gbr"]))
        other = shapes.image(shapes.GerberFile.open(theirs[ending]))
        assert other.area == approx(item.area, rel=1e-4), name
        assert item.symmetric_difference(other).area < 1e-3 * item.area, name
