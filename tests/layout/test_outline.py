"""The outline: every inner corner has the fabricator's radius, whatever lies on both sides of it."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path

import pytest
from tolerance import approx

from sitscad.checks.board.clearances import copper_to_edge
from sitscad.checks.judging import check
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Arc, Line, bounding_box, enclosed_area
from sitscad.layout import lay_out
from sitscad.layout.tail.taper import Taper
from sitscad.spec.load import load, load_text

MM, UM = 1e-3, 1e-6


def headings(segment):
    """Directions (rad) at the beginning and at the end of a segment."""
    if isinstance(segment, Line):
        angle = math.atan2(segment.end.y - segment.start.y, segment.end.x - segment.start.x)
        return angle, angle
    ahead = math.pi / 2 if segment.ccw else -math.pi / 2
    return tuple(
        math.atan2(p.y - segment.centre.y, p.x - segment.centre.x) + ahead for p in (segment.start, segment.end)
    )


def inner_corners(outline):
    """Radii (m) of all inner corners of an outline: of its clockwise arcs, and 0 for each bend to the right."""
    assert enclosed_area(outline) > 0.0
    segments = list(outline)
    radii = [s.radius for s in segments if isinstance(s, Arc) and not s.ccw]
    for item, other in pairwise([*segments, segments[0]]):
        turn = (headings(other)[0] - headings(item)[1] + math.pi) % (2 * math.pi) - math.pi
        radii += [0.0] if turn < -1e-6 else []
    return radii


def crossings(outline):
    """How often an outline crosses itself."""
    points = outline.flattened(1e-6)
    sides = list(pairwise(points))

    def side(a, b, p):
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)

    return sum(
        side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0
        for i, (a, b) in enumerate(sides)
        for c, d in sides[i + 2 :]
    )


def board(coil="outer_diameter: 7, turns: 8", array="", radius="1 mm", tail="length: 30", extra=""):
    tail = f", tail: {{{tail}}}" if tail else ""
    return load_text(
        f"sitscad: 1\nname: corners\ncoil: {{shape: circle, {coil}, layers: 2, trace_width: 100 um, "
        f"trace_spacing: 100 um}}\n{array}\nfpc: {{stackup: flex-2l-18um, rules: {{inside_radius: {radius}}}{tail}}}\n"
        f"{extra}\n",
        "corners.yaml",
    )


def row(count, pitch):
    return f"array: {{pattern: line, count: {count}, pitch: {pitch}}}"


WITH_CHIPS = "readout: {capacitors_on_board: chip-0603}"

BOARDS = {
    "narrower tail": dict(array=row(2, 8)),
    "narrower tail, fine radius": dict(array=row(2, 8), radius="0.2 mm"),
    "narrower tail, large radius": dict(array=row(2, 8), radius="6 mm"),
    "wider tail": dict(coil="outer_diameter: 2.6, turns: 2", array=row(4, 3.6)),
    "wider tail, large radius": dict(coil="outer_diameter: 2.6, turns: 2", array=row(4, 3.6), radius="9 mm"),
    "body too short for the corner": dict(
        coil="outer_diameter: 1.6, turns: 1",
        radius="10 mm",
        extra="readout: {capacitors_on_board: chip-0603}\nmount: {jaw: {width: 9, length: 1, height: 2}}",
    ),
    "a little wider": dict(coil="outer_diameter: 3.9, turns: 4", array=row(4, 4.9)),
    "nearly as wide": dict(coil="outer_diameter: 4.1, turns: 4", array=row(4, 5.1)),
    "turned": dict(array=row(2, 8), tail="length: 1, turn: left"),
    "turned, large radius": dict(array=row(2, 8), tail="length: 1, turn: right", radius="7 mm"),
    "aside": dict(array=row(2, 8), tail="length: 1, offset: 4"),
    "no tail": dict(tail=""),
    "no tail, large radius": dict(tail="", radius="8 mm"),
    "a triangle, turned": dict(
        array="array: {pattern: triangle, pitch: 8.5}", tail="length: 1, turn: left", radius="5 mm"
    ),
    "a shoulder for capacitors": dict(array=row(2, 8), extra=WITH_CHIPS),
    "a shoulder, turned": dict(array=row(2, 8), extra=WITH_CHIPS, tail="length: 1, turn: left", radius="4 mm"),
    "a shoulder of fine contacts": dict(array=row(2, 8), tail="length: 3, connector: zif-0.3mm", radius="2 mm"),
}


@pytest.mark.parametrize("changes", BOARDS.values(), ids=BOARDS)
def test_inner_corners_have_fabricator_radius(changes):
    spec = board(**changes)
    layout = lay_out(spec)
    assert not layout.shortfalls
    least = max(0.5 * MM, spec.fpc.rules.inside_radius)
    radii = inner_corners(layout.outline)
    assert all(radius >= least - 1e-9 for radius in radii), [round(r / MM, 4) for r in radii]
    assert crossings(layout.outline) == 0
    geometric = {"SIT107", "SIT108", "SIT109", "SIT110", "SIT115"}
    assert [f for f in check(spec, layout, hints="none").findings if f.rule in geometric] == []


def test_template_inner_corners_have_minimum_radius(template):
    layout = lay_out(load(template))
    assert len(inner_corners(layout.outline)) == 2
    assert min(inner_corners(layout.outline)) >= layout.spec.fpc.rules.inside_radius - 1e-9


def test_body_without_corner_room_is_as_wide_as_tail():
    """The board then says so: its body's width, which has to fit the jaw, is the one that is cut.

    Two inner corners are left, at the plug.
    """
    layout = lay_out(board(**BOARDS["body too short for the corner"]))
    x0, y0, _, y1 = layout.body
    low, high = layout.reach_at(x0 + 1.0 * MM)
    assert len(inner_corners(layout.outline)) == 2 and approx((y0, y1), rel=1e-6) == (low, high)
    narrow = lay_out(board(**BOARDS["body too short for the corner"] | {"radius": "0.1 mm"}))
    assert narrow.body[3] < y1 and len(inner_corners(narrow.outline)) == 4


@pytest.mark.parametrize("near, far", [(4.0, 1.25), (1.25, 4.0), (2.0, 1.9), (1.9, 2.0), (2.0, 1.999), (2.0, 2.0)])
@pytest.mark.parametrize("inner", [0.5, 1.0, 10.0])
def test_taper_has_room_for_both_roundings(near, far, inner):
    """Two arcs and the straight between them fit between the corners; the board is nowhere smaller than asked."""
    step = abs(near - far) * MM
    taper = Taper(5 * MM, 5 * MM + step, near * MM, far * MM, inner * MM, 0.25 * MM)
    corners = taper.corners()
    if step == 0.0:
        assert corners == [] and taper.reach_before == taper.reach_beyond == taper.length == 0.0
        return
    (first, _), (second, _) = corners
    assert first.distance(second) >= taper.reach_before + taper.reach_beyond - 1e-12
    assert sorted(radius for _, radius in corners) == approx([0.25 * MM, inner * MM], rel=1e-6)
    outer = first if near > far else second
    assert outer.x == approx(5 * MM if near > far else 5 * MM + step, rel=1e-6)
    assert taper.length >= step - 1e-12 and taper.angle <= math.pi / 4 + 1e-12


def test_corner_radius_follows_profile():
    """The same board from two fabricators differs in its inner corners, and nowhere in its copper."""
    item, other = (lay_out(board(array=row(2, 8), radius=radius)) for radius in ("1 mm", "2 mm"))
    assert [min(inner_corners(each.outline)) for each in (item, other)] == approx([1 * MM, 2 * MM], rel=1e-6)
    assert item.traces == other.traces and item.body == other.body


def test_board_without_tail_has_contact_strip_of_documented_length():
    """A reader took "none" for a board that ends with its body."""
    root = Path(__file__).parents[2]
    page = (root / "docs/spec.md").read_text(encoding="utf-8")
    message = page.partition("Without `fpc.tail` a strip")[2].partition("\n\n")[0]
    text = [float(length) * 1e-3 for length in re.findall(r"(\d+\.\d) mm", message)]
    spec = load(root / "templates/single_coil.yaml")
    shortest = spec.replace("fpc", {"tail": {"connector": "solder-pads", "length": "1 mm"}})
    for each, length in zip((spec, shortest), text, strict=True):
        layout = lay_out(each)
        strip = bounding_box((layout.outline,))[2] - layout.body[2]
        assert strip == approx(layout.tail_length, rel=1e-9) == approx(length, rel=5e-3)
        assert len(layout.pads) == 2 and min(pad.centre.x for pad in layout.pads) > layout.body[2]


@pytest.mark.parametrize("angle", [0, 90, 180])
def test_contacts_wider_than_body_do_not_widen_body(angle):
    """A body of 3.0 mm was 6.5 mm wide with the coils begun at their other end: it had grown by 0.1 mm at the tail."""
    layout = lay_out(load_text(STRIP.format(angle=angle), "strip.yaml"))
    assert layout.shortfalls == () and layout.body_size[1] < 3.1e-3 < 6e-3 < layout.size[1]
    assert not list(copper_to_edge(Design(layout.spec, layout)))


STRIP = """\
sitscad: 1
name: strip
coil: {{shape: racetrack, outer_diameter: [16, 1.99], turns: 3.5, layers: 4, trace_width: 76 um, trace_spacing: 76 um,
       start_angle: {angle} deg}}
array: {{pattern: line, count: 3, pitch: 18}}
fpc: {{stackup: flex-4l, rules: generic-fine, tail: {{length: 40, connector: solder-pads, bend: none}}}}
"""
