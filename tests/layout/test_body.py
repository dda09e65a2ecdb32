"""The body: the mean of the coils' centres is its middle, a margin widens it, a short jaw limits only the first."""

from __future__ import annotations

import pytest
from shapely.geometry import LineString, Point, Polygon

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
    assert not layout.findings
    assert middle(layout) == pytest.approx(layout.spec.array.middle, abs=1e-9)
    assert holds_its_copper(layout)


@pytest.mark.parametrize("name", ["single", "triangle", "off the axis"])
@pytest.mark.parametrize("connector", ["zif-0.5mm", "solder-pads"])
def test_a_margin_is_added_on_every_side(name, connector):
    plain, wide = (lay_out(board(ARRAYS[name], more, connector=connector)) for more in ("", ", margin: [0.7, 0.4]"))
    assert wide.body_size == pytest.approx([plain.body_size[0] + 1.4 * MM, plain.body_size[1] + 0.8 * MM], abs=1e-9)
    assert middle(wide) == pytest.approx(wide.spec.array.middle, abs=1e-9)
    assert wide.tail_length == pytest.approx(plain.tail_length)
    assert holds_its_copper(wide)


def test_one_length_is_the_margin_both_ways():
    assert board(fpc=", margin: 0.5").fpc.margin == (0.5 * MM, 0.5 * MM)


def test_a_short_jaw_keeps_the_body_from_growing_about_the_coils_but_not_its_margin():
    jaw = "mount: {{jaw: {{width: 9, length: {length}, height: 2}}}}"
    free, short = (lay_out(board(extra=extra)) for extra in ("", jaw.format(length=6.5)))
    assert short.body_size[0] < free.body_size[0] and short.body[2] == free.body[2]
    between = lay_out(board(extra=jaw.format(length=free.body_size[0] / MM - 0.2)))
    assert between.body_size[0] == pytest.approx(free.body_size[0] - 0.2 * MM)
    wide = lay_out(board(fpc=", margin: 0.5", extra=jaw.format(length=6.5)))
    assert wide.body_size[0] == pytest.approx(short.body_size[0] + 1.0 * MM)


@pytest.mark.parametrize("margin", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("array", ["single", "line", "triangle"])
def test_a_wider_body_before_a_wide_tail_holds_its_copper(margin, array):
    """Small coils and many contacts: without the margin the tail is wider than the body, with it the narrower one."""
    arrays = ARRAYS | {"triangle": "array: {pattern: triangle, pitch: 4}", "line": "array: {count: 4, pitch: 3.6}"}
    layout = lay_out(board(arrays[array], f", margin: {margin}", coil="outer_diameter: 2.6, turns: 2"))
    assert not layout.findings and holds_its_copper(layout)
