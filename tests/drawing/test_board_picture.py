"""Pictures of the board: which way x and y run, tracks under other copper, and a key for every line."""

from __future__ import annotations

import re

import pytest

import sitscad
from sitscad.files.documents.drawings import plan_view
from sitscad.files.drawing.pictures.layout_picture import layer_colour, layout_svg
from sitscad.files.drawing.svg import svg
from sitscad.spec import templates


@pytest.fixture(scope="module")
def layout():
    return sitscad.lay_out(sitscad.load_text(templates.read("bench_7mm")))


def texts(drawing):
    return re.findall(r">([^<>]+)</text>", drawing)


@pytest.mark.parametrize("window", [False, True])
def test_board_picture_labels_axes_and_board_edge(layout, window):
    shown = texts(layout_svg(layout, window=layout.body if window else None))
    assert shown.count("x") == shown.count("y") == 1 and "edge of the board" in shown


def test_board_picture_shows_required_largest_outline(layout):
    """A board that reached beyond it was drawn without it."""
    assert "board-largest" not in layout_svg(layout)
    text = templates.read("bench_7mm").replace("fpc:", "fpc:\n  largest: {shape: rectangle, size: [18, 9]}", 1)
    asked = sitscad.lay_out(sitscad.load_text(text))
    drawn = layout_svg(asked)
    assert "id='board-largest'" in drawn and "fpc.largest" in texts(drawn)
    keys = [texts(svg(plan_view.plan_sheet(each))).count("largest outline that is asked for")
            for each in (layout, asked)]
    assert keys == [0, 1]


def test_tracks_below_other_copper_are_drawn_on_top_in_own_colour(layout):
    """Of a coil of two layers the lower one could not be seen."""
    drawn = layout_svg(layout)
    under = drawn[drawn.index("id='board-under-2'"):drawn.index("id='board-vias'")]
    assert drawn.index("id='board-copper-1'") < drawn.index("id='board-under-2'")
    assert layer_colour(2) in under and layer_colour(1) not in under
    assert all(f"id='board-under-2-net-{net}'" in under for net in layout.nets)
    assert "lower copper under upper" in texts(drawn)
    assert "board-under-" not in layout_svg(layout, layers=[1]), "nothing lies under a layer that is shown alone"


def test_plan_view_has_axes_and_legend_entry_per_outline(layout):
    shown = texts(svg(plan_view.plan_sheet(layout)))
    assert {"x", "y", "edge of the board", "outer edge of a coil", "copper of layer 1"} <= set(shown)
    assert any(text.startswith("target: ") for text in shown) and any(text.startswith("elastomer: ") for text in shown)
