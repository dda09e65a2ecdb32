"""Boards spoilt on purpose, one fault each at a known place: the own check names a rule that fits, at that place.

Every fault is made with three seeds, on boards of two and of four layers. A fault tells the rules that may name it; a
finding counts when its place lies within a tolerance (mostly 0.4 mm) of where the fault was made, and when the board
before had no such finding.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest

from sitscad.basics.finding import Finding, Severity
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Path, Point, Region, circle, polyline, rectangle
from sitscad.layout import lay_out
from sitscad.layout.board import Layout, Role, Trace, Via
from sitscad.spec.load import load_text

UM, MM = 1e-6, 1e-3
DRAWN = {f"SIT{number}" for number in (101, *range(104, 111), 114, 115, *range(120, 124), 125)}
"""The rules that look at what is drawn."""


@dataclass(frozen=True)
class Fault:
    """A spoilt layout, where it was spoilt, the rules that may say so, and how near (m) the finding's place must be."""

    layout: Layout
    places: tuple[Point, ...]
    rules: frozenset[str]
    within: float = 0.4 * MM


def board(layers: int) -> Layout:
    coil = {
        "shape": "circle",
        "outer_diameter": 6,
        "turns": 7,
        "layers": layers,
        "trace_width": 0.1,
        "trace_spacing": 0.1,
    }
    document = {
        "sitscad": 1,
        "name": "spoilt",
        "coil": coil,
        "array": {"pattern": "line", "count": 2, "pitch": 8},
        "fpc": {"tail": {"length": 20, "connector": "zif-0.5mm", "layers": 2, "bend": "static"}},
    }
    return lay_out(load_text(json.dumps(document, indent=1), "spoilt.yaml"))


@pytest.fixture(scope="module")
def boards():
    result = {layers: board(layers) for layers in (2, 4)}
    assert all(not layout.shortfalls for layout in result.values())
    return result


def findings(layout: Layout) -> list[Finding]:
    subject = Design(layout.spec, layout)
    rules = [rule for rule in RULES if rule.id in DRAWN]
    return [f for rule in rules for f in apply_rule(rule, subject)[0] if f.severity is not Severity.NOTE]


# ------------------------------------------------------------------------------------------------------- the faults


def _swap(items, old, *new):
    return tuple(piece for item in items for piece in (new if item is old else (item,)))


def _turned(rng: random.Random, reach: float) -> tuple[float, float]:
    angle = rng.uniform(0, 2 * math.pi)
    return reach * math.cos(angle), reach * math.sin(angle)


def shifted_via(layout, rng):
    via = rng.choice(layout.vias)
    moved = replace(via, centre=via.centre.shifted(*_turned(rng, rng.uniform(30, 300) * UM)))
    spoilt = replace(layout, vias=_swap(layout.vias, via, moved))
    return Fault(spoilt, (via.centre, moved.centre), frozenset({"SIT107", "SIT110", "SIT125"}))


def missing_via(layout, rng):
    via = rng.choice(layout.vias)
    return Fault(replace(layout, vias=_swap(layout.vias, via)), (via.centre,), frozenset({"SIT125"}), 1 * UM)


def missing_track(layout, rng):
    track = rng.choice(layout.traces)
    spoilt = replace(layout, traces=_swap(layout.traces, track))
    places = (track.path.start, track.path.end, *(p.centre for p in layout.pads if p.net == track.net))
    return Fault(spoilt, places, frozenset({"SIT125"}), 10 * UM)


def broken_track(layout, rng):
    """A piece of a winding is not drawn."""
    track = rng.choice([t for t in layout.traces if t.role is Role.WINDING])
    at = rng.randrange(10, len(track.path.segments) - 10)
    parts = [replace(track, path=Path(s)) for s in (track.path.segments[:at], track.path.segments[at + 1 :])]
    gone = track.path.segments[at]
    return Fault(
        replace(layout, traces=_swap(layout.traces, track, *parts)),
        (gone.start, gone.end),
        frozenset({"SIT125"}),
        1 * UM,
    )


def thinned_gap(layout, rng):
    """A turn bulges towards its neighbour by 10 to 90 um of the 100 um between them."""
    track = rng.choice([t for t in layout.traces if t.role is Role.WINDING])
    segments = list(track.path.segments)
    at, bulge = rng.randrange(30, len(segments) - 30), rng.uniform(10, 90) * UM
    arc = segments[at]
    middle = arc.at(0.5)
    away = (arc.radius + bulge) / arc.radius
    out = Point(arc.centre.x + away * (middle.x - arc.centre.x), arc.centre.y + away * (middle.y - arc.centre.y))
    segments[at : at + 1] = polyline([arc.start, out, arc.end]).segments
    spoilt = replace(track, path=Path(tuple(segments)))
    series = {id(track): spoilt}
    coils = tuple(
        replace(c, series=tuple(series.get(id(s), spoilt if s == track else s) for s in c.series)) for c in layout.coils
    )
    return Fault(
        replace(layout, coils=coils, traces=_swap(layout.traces, track, spoilt)), (out,), frozenset({"SIT108"})
    )


def crossed_lead(layout, rng):
    """A track of the other coil across a coil's track in the tail."""
    track = rng.choice([t for t in layout.traces if t.role is Role.TAIL and t.path.length > 3 * MM])
    line = max(track.path.segments, key=lambda s: s.length)
    at, net = line.at(rng.uniform(0.2, 0.8)), next(n for n in layout.nets if n != track.net)
    across = Trace(polyline([at.shifted(0, -0.3 * MM), at.shifted(0, 0.3 * MM)]), 100 * UM, track.layer, net, Role.LEAD)
    return Fault(replace(layout, traces=(*layout.traces, across)), (at,), frozenset({"SIT108"}))


def moved_pad(layout, rng):
    pad = rng.choice(layout.pads)
    moved = replace(pad, centre=pad.centre.shifted(0.0, rng.choice((-1, 1)) * rng.uniform(0.32, 0.45) * MM))
    spoilt = replace(layout, pads=_swap(layout.pads, pad, moved))
    return Fault(spoilt, (pad.centre, moved.centre), frozenset({"SIT108", "SIT125"}), 3 * MM)


def shrunk_ring(layout, rng):
    via = rng.choice(layout.vias)
    thin = replace(via, pad=via.pad - rng.uniform(5, 150) * UM)
    return Fault(replace(layout, vias=_swap(layout.vias, via, thin)), (via.centre,), frozenset({"SIT105"}), 1 * UM)


def small_drill(layout, rng):
    via = rng.choice(layout.vias)
    small = replace(via, drill=via.drill - rng.uniform(5, 80) * UM)
    return Fault(replace(layout, vias=_swap(layout.vias, via, small)), (via.centre,), frozenset({"SIT104"}), 1 * UM)


def hole_beside_a_turn(layout, rng):
    """A hole of the other coil close to a turn."""
    track = rng.choice([t for t in layout.traces if t.role is Role.WINDING])
    at, net = rng.choice(track.path.segments).at(0.5), next(n for n in layout.nets if n != track.net)
    rules = layout.spec.fpc.rules
    hole = Via(at.shifted(*_turned(rng, 0.15 * MM)), rules.via_drill, rules.via_pad, net)
    return Fault(replace(layout, vias=(*layout.vias, hole)), (hole.centre,), frozenset({"SIT107", "SIT110"}))


def two_holes(layout, rng):
    via = rng.choice(layout.vias)
    reach = via.drill + rng.uniform(0.2, 0.95) * layout.spec.fpc.rules.hole_to_hole
    other = replace(via, centre=via.centre.shifted(*_turned(rng, reach)))
    return Fault(replace(layout, vias=(*layout.vias, other)), (via.centre,), frozenset({"SIT106"}))


def copper_over_the_edge(layout, rng):
    """A track to a place between 150 um inside the edge and 150 um outside it."""
    x0, y0, x1, y1 = layout.body
    at = Point(rng.uniform(x0 + 1 * MM, x1 - 1 * MM), (y0, y1)[side := rng.randrange(2)] + rng.uniform(-150, 150) * UM)
    track = Trace(polyline([at, at.shifted(0, (0.2 * MM, -0.2 * MM)[side])]), 100 * UM, 1, "C1", Role.LEAD)
    return Fault(replace(layout, traces=(*layout.traces, track)), (at,), frozenset({"SIT109"}))


def thin_track(layout, rng):
    track = rng.choice(layout.traces)
    thin = replace(track, width=rng.uniform(50, 99) * UM)
    return Fault(
        replace(layout, traces=_swap(layout.traces, track, thin)), (track.path.start,), frozenset({"SIT101"}), 1 * UM
    )


def wrong_layer(layout, rng):
    track = rng.choice([t for t in layout.traces if t.role is Role.STUB])
    moved = replace(track, layer=track.layer % layout.copper_layers + 1)
    places = (track.path.start, track.path.end)
    spoilt = replace(layout, traces=_swap(layout.traces, track, moved))
    return Fault(spoilt, places, frozenset({"SIT125", "SIT108"}), 10 * UM)


def hole_in_the_bend(layout, rng):
    start, end = layout.bend_zone
    at = Point(rng.uniform(start + 1 * MM, end - 1 * MM), 0.0)
    return Fault(
        replace(layout, vias=(*layout.vias, Via(at, 0.2 * MM, 0.45 * MM, "C1"))), (at,), frozenset({"SIT123"}), 1 * UM
    )


def ring_round_a_coil(layout, rng):
    coil = rng.choice(layout.coils)
    ring = Trace(circle(coil.centre, rng.uniform(3.2, 3.5) * MM), 100 * UM, rng.randrange(2) + 1, coil.net, Role.LEAD)
    return Fault(replace(layout, traces=(*layout.traces, ring)), (ring.path.start,), frozenset({"SIT122"}), 1 * UM)


def bridged_turns(layout, rng):
    """A short track from one turn to the next: still one net, no electrical test sees it."""
    track = rng.choice([t for t in layout.traces if t.role is Role.WINDING])
    item = rng.choice(track.path.segments[30:-30]).at(0.5)
    centre = next(c.centre for c in layout.coils if c.net == track.net)
    out = 1 + layout.spec.coil.pitch / item.distance(centre)
    other = Point(centre.x + out * (item.x - centre.x), centre.y + out * (item.y - centre.y))
    bridge = Trace(polyline([item, other]), 100 * UM, track.layer, track.net, Role.LEAD)
    return Fault(replace(layout, traces=(*layout.traces, bridge)), (item, other), frozenset({"SIT122", "SIT108"}))


def second_opening(layout, rng):
    """A second opening of the coverlay near the first, over the tail's tracks."""
    x0 = min(p.x for p in layout.top_openings[0].outline.flattened(1e-6)) - rng.uniform(20, 150) * UM
    near = Region(rectangle(x0 - 0.5 * MM, -0.6 * MM, x0, 0.6 * MM))
    places = (*near.outline.flattened(1e-6), Point(x0, 0.0), layout.top_openings[0].outline.start)
    return Fault(
        replace(layout, top_openings=(*layout.top_openings, near)), places, frozenset({"SIT114", "SIT115"}), 1 * MM
    )


FAULTS: tuple[Callable[[Layout, random.Random], Fault], ...] = (
    shifted_via, missing_via, missing_track, broken_track, thinned_gap, crossed_lead, moved_pad, shrunk_ring,
    small_drill, hole_beside_a_turn, two_holes, copper_over_the_edge, thin_track, wrong_layer, hole_in_the_bend,
    ring_round_a_coil, bridged_turns, second_opening,
)


@pytest.mark.parametrize("layers", [2, 4])
def test_layouts_without_faults_have_no_findings(boards, layers):
    assert findings(boards[layers]) == []


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("spoil", FAULTS, ids=lambda fault: fault.__name__)
def test_layout_fault_gives_finding_at_its_position(boards, spoil, seed):
    fault = spoil(boards[(2, 4)[seed % 2]], random.Random(f"{spoil.__name__} {seed}"))
    result = [f for f in findings(fault.layout) if f.rule in fault.rules and f.place is not None]
    near = [
        f for f in result if min(Point(f.place.x, f.place.y).distance(place) for place in fault.places) <= fault.within
    ]
    assert near, [(f.rule, f.place, f.message) for f in findings(fault.layout)]
    assert all(f.hint and f.key and f.message for f in near)
    assert any(f.place.nets for f in near) or spoil is second_opening


# ------------------------------------------------------------------------------------- the same faults in the files

SEEN_IN_FILES = {
    missing_via: {"open"},
    missing_track: {"open"},
    broken_track: {"open"},
    wrong_layer: {"open", "dead-end"},
    crossed_lead: {"short"},
    ring_round_a_coil: {"loop"},
    bridged_turns: {"loop"},
}
"""What reading the written Gerber and drill files back must call a fault, without any knowledge of the layout."""


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("spoil", SEEN_IN_FILES, ids=lambda fault: fault.__name__)
def test_layout_fault_gives_difference_in_extracted_files(boards, spoil, seed, tmp_path):
    """The files are the spoilt layout's, the netlist is what was meant: `verify` reads both."""
    pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")
    pytest.importorskip("shapely", reason="shapely is not installed: pip install 'sitscad[all]' brings it")
    from sitscad.files.extraction.differences import compare, extract
    from sitscad.files.formats import gerber, ipc356

    good = boards[(2, 4)[seed % 2]]
    fault = spoil(good, random.Random(f"{spoil.__name__} {seed}"))
    drawn, meant = gerber.render(fault.layout) | gerber.render_drills(fault.layout), ipc356.render(good)
    for name, content in (drawn | meant).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    result = compare(extract(tmp_path))
    named = [difference for difference in result if difference.kind.value in SEEN_IN_FILES[spoil]]
    assert named, result
    if spoil in (ring_round_a_coil, bridged_turns):  # the loop's place is a point inside it, beside or inside the coil
        assert any(Point(d.x, d.y).distance(c.centre) < 4 * MM for d in named for c in good.coils if d.x is not None)
