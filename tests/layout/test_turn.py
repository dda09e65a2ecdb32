"""A tail that turns in its plane: arcs about one centre, distances kept, ends to the side, files that say the same."""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

import sitscad
from sitscad.estimates import estimate
from sitscad.kernels.geometry.path import Arc, Line, Point, bounding_box, enclosed_area, polyline
from sitscad.layout.board import Role
from sitscad.layout.tail.frame import course, turn_length
from sitscad.spec.circuit import Tail
from sitscad.spec.presets import connector
from sitscad.spec.reading import SpecError

TEMPLATES = Path(__file__).parents[2] / "templates"
WAYS = ["turn: left", "turn: right", "offset: 3", "offset: -12"]
HALF = 1.25e-3


def text_of(way, template="grasper_4layer", name="turned"):
    text = (TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")
    text = text.replace(f"name: {template.replace('_', '-')}", f"name: {name}")
    assert "    bend: static" in text
    return text.replace("    bend: static", f"    bend: static\n    {way}", 1)


def board(way, template="grasper_4layer"):
    return sitscad.lay_out(sitscad.load_text(text_of(way, template), str(TEMPLATES / "x.yaml")))


def tail(**kwargs):
    return Tail(30e-3, connector("zif-0.5mm"), **{"layers": 2, "bend": "static", "turn_radius": 2e-3, **kwargs})


@pytest.mark.parametrize("side", [1, -1])
def test_tail_quarter_turn_has_given_inner_radius(side):
    turned = tail(turn="left" if side > 0 else "right", turn_radius=2e-3)
    way = course(turned, HALF, 10e-3)
    assert turn_length(turned, HALF) == approx(0.5 * math.pi * (2e-3 + HALF), rel=1e-6)
    end = 10e-3 + turn_length(turned, HALF)
    inner, outer = (way.path(polyline([Point(10e-3, y), Point(end, y)])).segments for y in (side * HALF, -side * HALF))
    assert [type(s) for s in (*inner, *outer)] == [Arc, Arc]
    assert inner[0].radius == approx(2e-3, rel=1e-6) and outer[0].radius == approx(2e-3 + 2 * HALF, rel=1e-6)
    assert inner[0].centre.distance(outer[0].centre) < 1e-12
    assert way.place(Point(end + 5e-3, 0.0)) == approx((10e-3 + 2e-3 + HALF, side * (2e-3 + HALF + 5e-3)), rel=1e-6)
    assert way.is_across


@pytest.mark.parametrize("offset", [0.3e-3, -3e-3, 6.5e-3, -20e-3])
def test_offset_tail_ends_parallel_at_given_offset(offset):
    aside = tail(offset=offset)
    way = course(aside, HALF, 10e-3)
    end = 10e-3 + turn_length(aside, HALF)
    here, there = way.place(Point(end, 0.0)), way.place(Point(end + 1e-3, 0.0))
    assert here.y == approx(offset, abs=1e-12) and there == approx((here.x + 1e-3, here.y), rel=1e-6)
    assert not way.is_across
    radii = [s.radius for s in way.path(polyline([Point(0, HALF), Point(20e-3 + end, HALF)])) if isinstance(s, Arc)]
    assert sorted(radii) == approx([2e-3, 2e-3 + 2 * HALF], rel=1e-6)


@settings(max_examples=50, deadline=None)
@given(st.floats(-30e-3, 30e-3), st.floats(0.5e-3, 5e-3), st.floats(-1.2e-3, 1.2e-3), st.floats(-1.2e-3, 1.2e-3))
def test_bent_tail_path_is_smooth_and_preserves_track_distances(offset, radius, one, other):
    way = course(tail(offset=offset, turn_radius=radius), HALF, 5e-3)
    if way is None:
        assert offset == 0.0
        return
    paths = [way.path(polyline([Point(0.0, y), Point(90e-3, y)])) for y in (one, other)]
    for path in paths:
        for before, after in zip(path.segments, path.segments[1:], strict=False):
            assert before.end.distance(after.start) < 1e-12
            headings = [_heading(before, 1.0), _heading(after, 0.0)]
            assert abs(math.remainder(headings[0] - headings[1], 2 * math.pi)) < 1e-6
    for segment in paths[0]:
        for fraction in (0.0, 0.3, 1.0):
            assert paths[1].distance(segment.at(fraction)) == approx(abs(one - other), abs=1e-10)


def _heading(segment, fraction):
    if isinstance(segment, Line):
        return math.atan2(segment.end.y - segment.start.y, segment.end.x - segment.start.x)
    at = segment.at(fraction)
    radial = math.atan2(at.y - segment.centre.y, at.x - segment.centre.x)
    return radial + (math.pi / 2 if segment.ccw else -math.pi / 2)


@pytest.mark.parametrize("way", WAYS)
def test_board_with_tail_turn_preserves_areas_and_mean_track_lengths(way):
    layout = board(way)
    spec = layout.spec
    straight = sitscad.lay_out(
        replace(spec, fpc=replace(spec.fpc, tail=replace(spec.fpc.tail, turn="none", offset=0.0)))
    )
    assert layout.shortfalls == straight.shortfalls == ()
    assert layout.outline.is_closed
    assert enclosed_area(layout.outline) == approx(enclosed_area(straight.outline), rel=1e-9)
    for kind in ("traces", "vias", "pads"):
        assert len(getattr(layout, kind)) == len(getattr(straight, kind))
    # on the middle line an arc is as long as what was bent; aside the turns to both sides make up for each other
    mean, flat = (sum(t.path.length for t in each.traces) for each in (layout, straight))
    assert mean == approx(flat, rel=1e-9)
    assert layout.coils[0].windings == straight.coils[0].windings
    assert (layout.body, layout.bend_zone[0]) == (straight.body, straight.bend_zone[0])
    assert layout.bend_zone[1] < straight.bend_zone[1]


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_turned_tail_passes_checks_with_contacts_at_side(way):
    layout = board(way)
    result = sitscad.check(layout.spec, layout, hints="none")
    assert [f for f in result.findings if f.severity == "error"] == []
    rows = {round(pad.centre.y, 9) for pad in layout.pads}, {round(pad.centre.x, 9) for pad in layout.pads}
    assert len(rows[1 if "turn" in way else 0]) == len(layout.pads) and len(rows[0 if "turn" in way else 1]) == 1
    x0, y0, x1, y1 = bounding_box([layout.outline])
    side = 1 if way in ("turn: left", "offset: 3") else -1
    assert (y1 if side > 0 else -y0) > (-y0 if side > 0 else y1) + 1.5e-3
    arcs = [s for t in layout.traces if t.role is Role.TAIL for s in t.path if isinstance(s, Arc)]
    assert len(arcs) == (4 if "turn" in way else 8)
    assert len(layout.teardrops) == len(board("turn_radius: 2").teardrops)
    for pad in layout.pads:
        (w, h), (x, y) = pad.size, pad.centre
        assert x0 < x - w / 2 and x + w / 2 < x1 and y0 < y - h / 2 and y + h / 2 < y1


@pytest.mark.slow
def test_turned_lead_pair_has_resistance_and_inductance_of_straight_pair():
    """The way back is below the way there, round the turn as before it: alike in resistance and capacitance.

    Of all pairs together: the inner one is shorter by what the outer one is longer, 2.5 % of this board's.
    """
    turned, straight = (estimate(board(way)).coils for way in ("turn: left", "turn_radius: 2"))
    assert turned[0].terminal_resistance_dc == approx(straight[0].terminal_resistance_dc, rel=3e-3)
    assert turned[0].lead_inductance == approx(straight[0].lead_inductance, rel=0.02)
    both, bare = (math.fsum(coil.self_capacitance for coil in coils) for coils in (turned, straight))
    assert both == approx(bare, rel=1e-3)
    assert turned[0].self_capacitance < 0.98 * straight[0].self_capacitance


@pytest.mark.parametrize(
    ("way", "rule", "key"),
    [
        ("turn: left\n    offset: 3", "SIT009", "fpc.tail.offset"),
        ("turn: left\n    turn_radius: 0.5", "SIT009", "fpc.tail.turn_radius"),
        ("turn: back", "SIT007", "fpc.tail.turn"),
        ("offset: .nan", "SIT006", "fpc.tail.offset"),
        ("offset: 3 ohm", "SIT005", "fpc.tail.offset"),
    ],
)
def test_unusable_tail_turn_is_refused_at_its_key(way, rule, key):
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(text_of(way))
    assert [(f.rule, f.key) for f in caught.value.findings] == [(rule, key)]


def test_turn_radius_defaults_to_larger_fabricator_radius():
    spec = sitscad.load_text(text_of("turn: left").replace("rules: generic-fine", "rules: {inside_radius: 3}"))
    assert spec.fpc.tail.turn_radius == approx(3e-3, rel=1e-6)
    assert "fpc.tail.turn_radius: 3 mm, the default" in spec.source.defaults


@pytest.mark.slow
def test_short_turned_tail_is_lengthened():
    layout = sitscad.lay_out(sitscad.load_text(text_of("turn: left").replace("length: 30", "length: 5")))
    assert layout.shortfalls == ()
    assert [f for f in sitscad.check(layout.spec, layout).findings if f.severity == "error"] == []


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize(
    ("way", "template"),
    [
        ("turn: left", "grasper_4layer"),
        *(pytest.param(way, "grasper_4layer", marks=[pytest.mark.slow, pytest.mark.more]) for way in WAYS[1:]),
        (WAYS[0], "three_axis_grid"),
        *(pytest.param(way, "three_axis_grid", marks=[pytest.mark.slow, pytest.mark.more]) for way in WAYS[1:]),
    ],
)
def test_turned_board_passes_kicad_and_reads_back(way, template, tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    sitscad.build(sitscad.load_text(text_of(way, template)), tmp_path, only=("gerber", "kicad"), force=True)
    folder = tmp_path / "turned"
    assert sitscad.verify(folder).ok
    assert "radius of 2 mm" in " ".join((folder / "fpc" / "readme.txt").read_text(encoding="utf-8").split())
    assert "before its contacts" in (folder / "fpc" / "turned-drawing.svg").read_text(encoding="utf-8")
    report = tmp_path / "drc.json"
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run(
        [*command, "-o", str(report), str(next(folder.glob("kicad/*.kicad_pcb")))], capture_output=True, check=False
    )
    assert done.returncode == 0, json.loads(report.read_text())
