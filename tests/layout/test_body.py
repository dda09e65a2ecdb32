"""The body: the mean of the coils' centres is its middle, a margin widens it, a short jaw limits only the first."""

from __future__ import annotations

import pytest
from shapely.geometry import LineString, Point, Polygon
from tolerance import approx

from sitscad.layout import lay_out
from sitscad.spec.load import load_text

MM = 1e-3

ARRAYS = {
    "single": "",
    "line": "array: {pattern: line, count: 3, pitch: 7}",
    "triangle": "array: {pattern: triangle, pitch: 7.5}",
    "grid": "array: {pattern: grid, count: [2, 2], pitch: 7.5}",
    "off the axis": "array: {pattern: explicit, centres: [[-6, 2.5], [2, 3.5], [4, -6]]}",
    "one off the axis": "array: {pattern: explicit, centres: [[3, 1.2]]}",
}


def board(array="", fpc="", extra="", coil="outer_diameter: 6, turns: 8", connector="zif-0.5mm"):
    return load_text(
        f"sitscad: 1\nname: body\ncoil: {{shape: circle, {coil}, layers: 2, trace_width: 100 um, "
        f"trace_spacing: 100 um}}\n{array}\nfpc: {{tail: {{length: 20, connector: {connector}}}{fpc}}}\n{extra}\n"
    )


def middle(layout):
    x0, y0, x1, y1 = layout.body
    return (x0 + x1) / 2, (y0 + y1) / 2


def holds_its_copper(layout):
    """Whether all copper keeps the fabricator's distance from the outline, found with shapely."""
    edge, inside = layout.spec.fpc.rules.copper_to_edge, Polygon(layout.outline.flattened(1e-7))
    assert inside.is_valid
    reach = [(LineString(t.path.flattened(1e-6)), t.width / 2) for t in layout.traces]
    reach += [(Point(via.centre), via.pad / 2) for via in layout.vias]
    return all(inside.buffer(1e-6 - edge - half).contains(line) for line, half in reach)


@pytest.mark.parametrize("name", ARRAYS)
def test_the_mean_of_the_coils_centres_is_the_middle_of_the_body(name):
    layout = lay_out(board(ARRAYS[name]))
    assert not layout.shortfalls
    assert middle(layout) == approx(layout.spec.array.middle, abs=1e-9)
    assert holds_its_copper(layout)


@pytest.mark.parametrize("name", ["single", "triangle", "off the axis"])
@pytest.mark.parametrize("connector", ["zif-0.5mm", "solder-pads"])
def test_a_margin_is_added_on_every_side(name, connector):
    plain, wide = (lay_out(board(ARRAYS[name], more, connector=connector)) for more in ("", ", margin: [0.7, 0.4]"))
    assert wide.body_size == approx([plain.body_size[0] + 1.4 * MM, plain.body_size[1] + 0.8 * MM], abs=1e-9)
    assert middle(wide) == approx(wide.spec.array.middle, abs=1e-9)
    assert wide.tail_length == approx(plain.tail_length, rel=1e-6)
    assert holds_its_copper(wide)


def test_one_length_is_the_margin_both_ways():
    assert board(fpc=", margin: 0.5").fpc.margin == (0.5 * MM, 0.5 * MM)


def test_a_short_jaw_keeps_the_body_from_growing_about_the_coils_but_not_its_margin():
    jaw = "mount: {{jaw: {{width: 9, length: {length}, height: 2}}}}"
    free, short = (lay_out(board(extra=extra)) for extra in ("", jaw.format(length=6.5)))
    assert short.body_size[0] < free.body_size[0] and short.body[2] == free.body[2]
    between = lay_out(board(extra=jaw.format(length=free.body_size[0] / MM)))  # less two tolerances
    assert between.body_size[0] == approx(free.body_size[0] - 0.2 * MM, rel=1e-6)
    wide = lay_out(board(fpc=", margin: 0.5", extra=jaw.format(length=6.5)))
    assert wide.body_size[0] == approx(short.body_size[0] + 1.0 * MM, rel=1e-6)


@pytest.mark.parametrize("margin", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("array", ["single", "line", "triangle"])
def test_a_wider_body_before_a_wide_tail_holds_its_copper(margin, array):
    """Small coils and many contacts: without the margin the tail is wider than the body, with it the narrower one."""
    arrays = ARRAYS | {"triangle": "array: {pattern: triangle, pitch: 4}", "line": "array: {count: 4, pitch: 3.6}"}
    layout = lay_out(board(arrays[array], f", margin: {margin}", coil="outer_diameter: 2.6, turns: 2"))
    assert not layout.shortfalls and holds_its_copper(layout)


OFF_AXIS = {
    "one": [[3, 5]],
    "a row": [[-7, 4], [0, 4], [7, 4]],
    "one above the other": [[0, 4], [0, 11]],
    "an L": [[0, 0], [7.5, 0], [15, 0], [0, 7.5]],
}


def explicit(centres, **more):
    return board(f"array: {{pattern: explicit, centres: {centres}}}", **more)


@pytest.mark.parametrize("tail", ["", ", turn: left", ", offset: -9"])
@pytest.mark.parametrize("name", OFF_AXIS)
def test_where_the_places_are_counted_from_changes_nothing_else(name, tail):
    """The same coils counted from elsewhere: the same board, moved."""
    centres, (dx, dy) = OFF_AXIS[name], (5.0, -8.3)
    moved = [[x + dx, y + dy] for x, y in centres]
    here, there = (lay_out(explicit(places, connector="zif-0.5mm" + tail)) for places in (centres, moved))
    assert not here.shortfalls and not there.shortfalls
    assert there.body_size == approx(here.body_size, abs=1e-9)
    for one, other in (
        (here.outline.flattened(1e-6), there.outline.flattened(1e-6)),
        ([pad.centre for pad in here.pads], [pad.centre for pad in there.pads]),
        ([via.centre for via in here.vias], [via.centre for via in there.vias]),
        ([hole.outline.start for hole in here.top_openings], [hole.outline.start for hole in there.top_openings]),
        ([here.stiffener.outline.outline.start], [there.stiffener.outline.outline.start]),
        ([piece.path.end for piece in here.traces], [piece.path.end for piece in there.traces]),
        ([coil.windings[0].path.start for coil in here.coils], [coil.windings[0].path.start for coil in there.coils]),
    ):
        assert [[x + dx * MM, y + dy * MM] for x, y in one] == [approx(list(at), abs=1e-9) for at in other]
    assert there.coils[0].placement == there.spec.array.placements[0]


@pytest.mark.parametrize("name", OFF_AXIS)
def test_the_body_is_no_wider_than_coils_about_their_mean_need(name):
    centres = OFF_AXIS[name]
    layout = lay_out(explicit(centres))
    mean = sum(y for _, y in centres) / len(centres)
    coils = 2 * (max(abs(y - mean) for _, y in centres) + 3) * MM
    assert 0.4 * MM - 1e-9 <= layout.body_size[1] - coils < 2.5 * MM  # its edges; leads and vias beside the coils
    assert holds_its_copper(layout)


def test_a_jaw_too_narrow_for_a_body_about_the_mean_leaves_it_what_coils_and_leads_need():
    jaw = "mount: {{kind: grasper-pad, standoff: 1, jaw: {{width: {width}, length: 40, height: 8}}}}"
    free, fitted, tight = (lay_out(explicit(OFF_AXIS["an L"], extra=jaw.format(width=width))) for width in (30, 16, 10))
    assert middle(free) == approx(free.spec.array.middle, abs=1e-9)
    assert fitted.body_size[1] == approx(16 * MM, rel=1e-6) and free.body_size[1] > 18 * MM
    assert tight.body_size[1] < 15.2 * MM  # coils 13.5, edges 0.4, leads
    assert tight.body[3] == fitted.body[3] == free.body[3]
    for layout in (free, fitted, tight):
        assert not layout.shortfalls and holds_its_copper(layout)
