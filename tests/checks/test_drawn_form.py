"""The rules of the drawn form fire on copper spoilt by hand, at its place, and are silent on the layout as it was."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.board.drawn_form import TrackGraph, closed_loops
from sitscad.kernels.geometry.path import Arc, Path, Point, circle, polyline
from sitscad.layout import lay_out
from sitscad.layout.bending import Where, finished_thickness
from sitscad.layout.board import Role, Trace, Via
from sitscad.spec.load import load_text

UM, MM = 1e-6, 1e-3


@pytest.fixture(scope="module")
def bench():
    """A board of two coils of two layers with a tail that bends."""
    coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2, "trace_width": 0.1, "trace_spacing": 0.1}
    document = {
        "sitscad": 1,
        "name": "bench",
        "coil": coil,
        "array": {"pattern": "line", "count": 2, "pitch": 8},
        "fpc": {"tail": {"length": 30, "connector": "zif-0.5mm", "layers": 2, "bend": "static"}},
    }
    return lay_out(load_text(json.dumps(document, indent=1), "bench.yaml"))


def with_track(layout, points, width=100 * UM, layer=1, net="C1"):
    return replace(layout, traces=(*layout.traces, Trace(polyline(points), width, layer, net, Role.LEAD)))


def only(layout, path, width=100 * UM):
    """The first coil as one track along a path, and nothing else."""
    track = Trace(path, width, 1, "C1", Role.LEAD)
    coil = replace(layout.coils[0], series=(track,))
    return replace(layout, coils=(coil,), traces=(track,), vias=(), pads=())


def test_unchanged_layout_has_no_findings(judge, bench):
    assert [judge(f"SIT{number}", bench.spec, bench) for number in (101, 120, 121, 122, 125)] == [[]] * 5


def test_too_narrow_track_gives_error_at_its_start(judge, bench):
    thin = replace(bench.traces[4], width=80 * UM)
    (found,) = judge("SIT101", bench.spec, replace(bench, traces=(thin, *bench.traces[1:])))
    assert (
        found.severity is Severity.ERROR
        and found.measured == approx(80 * UM, rel=1e-6)
        and found.limit == approx(100 * UM, rel=1e-6)
    )
    assert (found.place.x, found.place.y, found.place.layer) == (*thin.path.start, 1) and found.place.nets == ("C1",)


@pytest.mark.parametrize(("apart", "is_loose"), [(0.0, False), (45 * UM, False), (55 * UM, True), (150 * UM, True)])
def test_track_end_without_copper_overlap_is_unconnected(judge, bench, apart, is_loose):
    trunk = only(bench, polyline([Point(0.0, 0.0), Point(2 * MM, 0.0)]))
    end = Point(1 * MM, apart)
    result = judge("SIT125", bench.spec, with_track(trunk, [Point(1 * MM, 1 * MM), end]))
    places = {(f.place.x, f.place.y) for f in result}
    assert {(0.0, 0.0), (2 * MM, 0.0), (1 * MM, 1 * MM)} == places - {end}
    assert (end in places) is is_loose


@pytest.mark.parametrize(("degrees", "fires"), [(30, True), (59, True), (61, False), (135, False)])
def test_acute_track_corner_gives_finding(judge, bench, degrees, fires):
    corner = Point(2 * MM, 1 * MM)
    end = Point(
        2 * MM + 0.5 * MM * math.cos(math.radians(degrees)), 1 * MM + 0.5 * MM * math.sin(math.radians(degrees))
    )
    result = judge("SIT120", bench.spec, only(bench, polyline([Point(3 * MM, 1 * MM), corner, end])))
    assert bool(result) == fires
    if fires:
        assert result[0].measured == approx(degrees, rel=1e-6) and result[0].unit == "degrees"
        assert (result[0].place.x, result[0].place.y) == approx(corner, rel=1e-6) and result[0].place.nets == ("C1",)


def test_acute_corner_of_line_and_arc_gives_one_finding(judge, bench):
    """A line that leaves an arc backwards; the same corner under a via pad is no wedge."""
    arc = Arc(Point(1 * MM, 0.0), Point(0.0, 1 * MM), Point(0.0, 0.0))
    along, back = (
        polyline([Point(0.0, 1 * MM), Point(-1 * MM, 1 * MM)]),
        polyline([Point(0.0, 1 * MM), Point(1 * MM, 0.8 * MM)]),
    )
    assert judge("SIT120", bench.spec, only(bench, Path((*arc_path(arc), *along)))) == []
    (result,) = judge("SIT120", bench.spec, only(bench, Path((*arc_path(arc), *back))))
    assert result.measured == approx(math.degrees(math.atan(0.2)), rel=1e-6)
    item, two = only(bench, arc_path(arc)), Trace(back, 100 * UM, 1, "C1", Role.LEAD)
    both = replace(item, traces=(*item.traces, two))
    assert len(judge("SIT120", bench.spec, both)) == 1
    covered = replace(both, vias=(Via(Point(0.0, 1 * MM), 0.2 * MM, 0.45 * MM, "C1"),))
    assert judge("SIT120", bench.spec, covered) == []


def arc_path(arc):
    return Path((arc,))


@pytest.mark.parametrize(("apart", "fires"), [(0.15, True), (0.19, True), (0.2, False), (0.3, False)])
def test_narrow_gap_in_hairpin_track_gives_sliver_finding(judge, bench, apart, fires):
    """Two legs that lie `apart` mm from one another, joined at their end."""
    legs = polyline([Point(0.0, 0.0), Point(0.15 * MM, 0.0), Point(0.15 * MM, apart * MM), Point(0.0, apart * MM)])
    assert judge("SIT108", bench.spec, only(bench, legs)) == []
    result = judge("SIT121", bench.spec, only(bench, legs))
    assert bool(result) == fires
    if fires:
        assert result[0].measured == approx(apart * MM - 100 * UM, rel=1e-6) and result[0].place.layer == 1


def test_sliver_limit_follows_trace_spacing_of_spec(judge, bench):
    """Turns nearer to each other than the fabricator's spacing are a finding of their own (SIT102)."""
    legs = polyline([Point(0.0, 0.0), Point(0.15 * MM, 0.0), Point(0.15 * MM, 0.15 * MM), Point(0.0, 0.15 * MM)])
    (result,) = judge("SIT121", bench.spec, only(bench, legs))
    assert result.limit == approx(100 * UM, rel=1e-6) and "coil.trace_spacing" not in result.source
    narrow = replace(bench.spec, coil=replace(bench.spec.coil, trace_spacing=80 * UM))
    (result,) = judge("SIT121", narrow, only(bench, legs))
    assert result.limit == approx(80 * UM, rel=1e-6)
    assert result.source == "coil.trace_spacing in the spec"


def test_rounded_right_angle_gives_no_sliver_finding(judge, bench):
    bend = Arc(Point(0.0, 0.0), Point(0.12 * MM, 0.12 * MM), Point(0.0, 0.12 * MM))
    legs = Path((*polyline([Point(-1 * MM, 0.0), bend.start]), bend, *polyline([bend.end, Point(0.12 * MM, 1 * MM)])))
    assert judge("SIT121", bench.spec, only(bench, legs)) == []


def test_closed_ring_around_coil_gives_shorted_turn_finding(judge, bench):
    centre = bench.coils[0].centre
    ring = Trace(circle(centre, 3.7 * MM), 100 * UM, 2, "GUARD", Role.LEAD)
    (found,) = judge("SIT122", bench.spec, replace(bench, traces=(*bench.traces, ring)))
    assert "C1" in found.message and found.place.nets == ("GUARD",)
    assert found.place.layer == 2 and Point(found.place.x, found.place.y).distance(centre) == approx(3.7 * MM, rel=1e-6)
    open_ring = replace(ring, path=Path(circle(centre, 3.7 * MM).segments[:1]))
    assert judge("SIT122", bench.spec, replace(bench, traces=(*bench.traces, open_ring))) == []


def test_bridge_between_turns_gives_shorted_turn_finding(judge, bench):
    """A track from the middle of one turn to the middle of the next closes a turn round the coil, once round."""
    turn, centre = next(t for t in bench.traces if t.role is Role.WINDING), bench.coils[0].centre
    far = [p for p in turn.path.flattened(1e-7) if abs(p.y - centre.y) < 0.1 * MM and p.x < centre.x - 2 * MM]
    item, two = min(far, key=lambda p: p.x), max(far, key=lambda p: p.x)
    spoilt = with_track(bench, [item, two], net=turn.net)
    (loop,) = closed_loops(TrackGraph(spoilt))
    assert abs(loop.turns_round(centre)) == approx(round(abs(loop.turns_round(centre))), rel=1e-6) and loop.area > 20e-6
    (result,) = judge("SIT122", bench.spec, spoilt)
    assert "shorted-turn" in result.cases and "C1" in result.message


def test_loop_through_two_vias_gives_finding_with_area(judge, bench):
    a, b = Point(14 * MM, 0.0), Point(15 * MM, 0.0)
    vias = tuple(Via(p, 0.2 * MM, 0.45 * MM, "C2") for p in (a, b))
    top = with_track(replace(bench, vias=(*bench.vias, *vias)), [a, b], net="C2")
    assert judge("SIT122", bench.spec, top) == []
    both = with_track(top, [a, Point(14.5 * MM, 1 * MM), b], layer=2, net="C2")
    (result,) = judge("SIT122", bench.spec, both)
    assert "0.5 mm2" in result.message and result.place.nets == ("C2",)


def test_wide_stiffener_tolerance_gives_note_of_contact_thickness_range(judge, bench):
    fpc = bench.spec.fpc
    nominal = finished_thickness(bench, Where.CONTACT).nominal
    wide = replace(fpc.rules, stiffened_tolerance={bench.stiffener.material: 70 * UM})
    layout = replace(bench, spec=replace(bench.spec, fpc=replace(fpc, rules=wide)))
    (result,) = judge("SIT124", layout.spec, layout)
    assert result.severity is Severity.NOTE and result.key == "fpc.tail.connector"
    assert f"{show(nominal - 70 * UM, 'm')} to {show(nominal + 70 * UM, 'm')}" in result.message
    assert judge("SIT124", layout.spec, replace(layout, stiffener=replace(bench.stiffener, thickness=1 * MM))) == []
    loose = replace(fpc.rules, stiffened_tolerance={bench.stiffener.material: 1 * MM})
    layout = replace(bench, spec=replace(bench.spec, fpc=replace(fpc, rules=loose)))
    (result,) = judge("SIT124", layout.spec, layout)
    assert f"0 mm to {show(nominal + 1 * MM, 'm')}" in result.message and "-" not in result.message.split("thick")[0]
