"""Vias inside the innermost turn, where two layers of a coil meet, and the stubs that lead to them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sitscad.geometry.path import Path, Point, polar, polyline
from sitscad.layout.board import Winding
from sitscad.layout.clearance import Hole, hole_distance, hole_keep_out
from sitscad.spec.design_rules import DesignRules

RADII, ANGLES = 7, 48


@dataclass(frozen=True)
class InnerJoin:
    """A via inside the winding and the stubs that reach it: (copper layer, from the winding's inner end to the via)."""

    hole: Hole
    stubs: tuple[tuple[int, Path], ...]


@dataclass(frozen=True)
class InnerEnd:
    """The inner end of one layer: where it is, its copper layer, the unit direction from it back along the turn."""

    point: Point
    layer: int
    back: tuple[float, float]


def place_inner_vias(
    windings: tuple[Winding, ...],
    turns: float,
    centre: Point,
    width: float,
    clear_radius: float,
    rules: DesignRules,
    spacing: float,
) -> tuple[InnerJoin, ...] | None:
    """One via for every pair of inner ends (the last alone for an odd number of layers), or None if there is no room.

    Candidates stand on rings about the centre; the choice with the shortest stubs that keeps every distance wins.
    """
    joins = [tuple(inner_end(w) for w in windings[i : i + 2]) for i in range(0, len(windings), 2)]
    copper = _innermost_copper(windings, turns)
    stride = 1 if len(joins) == 1 else 5
    options = [_candidates(ends, copper, centre, width, clear_radius, rules, spacing, stride) for ends in joins]
    if len(joins) == 1:
        first = next(options[0], None)
        return (first,) if first else None
    return _choose([list(each) for each in options], (), rules, spacing, width)


def room_needed(joins: int, rules: DesignRules, spacing: float) -> float:
    """Smallest clear inner diameter (m) for a number of inner vias that all keep their distance, on one ring."""
    hole = Hole(Point(0.0, 0.0), rules.via_pad, rules.via_drill)
    keep = hole_keep_out(hole, rules, spacing)
    if joins == 1:
        return 2.0 * keep
    return 2.0 * keep + hole_distance(hole, hole, rules, spacing) / math.sin(math.pi / joins)


def inner_end(winding: Winding) -> InnerEnd:
    """Where a layer's winding ends inside, and which way the turn goes back from there."""
    path = winding.path if winding.inward else winding.path.reversed()
    end, before = path.end, path.segments[-1].at(1.0 - min(0.5, 20e-6 / path.segments[-1].length))
    length = end.distance(before)
    return InnerEnd(end, winding.layer, ((before.x - end.x) / length, (before.y - end.y) / length))


def _innermost_copper(windings: tuple[Winding, ...], turns: float) -> np.ndarray:
    """Points (n, 2) on the last turn and a bit of every layer: the copper that the centre can touch."""
    points: list[Point] = []
    for winding in windings:
        path = winding.path if winding.inward else winding.path.reversed()
        last = math.ceil(len(path.segments) * min(1.0, 1.25 / turns))
        for segment in path.segments[-last:]:
            count = max(2, math.ceil(segment.length / 60e-6))
            points.extend(segment.at(i / count) for i in range(count + 1))
    return np.array(points)


def _candidates(
    ends: tuple[InnerEnd, ...],
    turns: np.ndarray,
    centre: Point,
    width: float,
    clear_radius: float,
    rules: DesignRules,
    spacing: float,
    stride: int,
) -> Iterator[InnerJoin]:
    """The joins that keep their distance from every turn, those with the shortest stubs first.

    Of the possible places only every `stride`-th is taken, so that a search over several vias stays short.
    """
    hole = Hole(centre, rules.via_pad, rules.via_drill)
    keep = hole_keep_out(hole, rules, spacing)
    reach = clear_radius - keep
    if reach < -1e-9:
        return
    places = sorted(
        _places(centre, max(0.0, reach), ends[0].point),
        key=lambda place: round(sum(end.point.distance(place) for end in ends), 9),
    )[::stride]
    gaps = np.min(np.hypot(*(np.array(places)[:, None, :] - turns[None, :, :]).transpose(2, 0, 1)), axis=1)
    for place, gap in zip(places, gaps, strict=True):
        if gap < keep + width / 2 - 0.5e-6:
            continue
        stubs = [_stub(end, place, turns, width + spacing) for end in ends]
        if all(stubs):
            named = tuple((end.layer, stub) for end, stub in zip(ends, stubs, strict=True) if stub)
            yield InnerJoin(Hole(place, rules.via_pad, rules.via_drill), named)


def _places(centre: Point, reach: float, towards: Point) -> Iterator[Point]:
    start = math.atan2(towards.y - centre.y, towards.x - centre.x)
    yield centre
    for ring in range(RADII):
        radius = reach * (1.0 - ring / RADII)
        for i in range(ANGLES):
            yield polar(radius, start + 2.0 * math.pi * i / ANGLES, centre)


def _stub(end: InnerEnd, place: Point, turns: np.ndarray, keep: float) -> Path | None:
    """The way from a turn's end to a via: straight where that bends it gently, else off at a right angle first.

    None where it would come nearer than `keep` (m, centre line to centre line) to a turn beyond its own end.
    """
    dx, dy = place.x - end.point.x, place.y - end.point.y
    length = math.hypot(dx, dy)
    if length < 1e-9:
        return None
    if (dx * end.back[0] + dy * end.back[1]) / length <= 0.3:
        corners = [end.point, place]
    else:
        nx, ny = -end.back[1], end.back[0]
        across = dx * nx + dy * ny
        step = math.copysign(min(1.5 * keep, abs(across)), across)
        corners = [end.point, end.point.shifted(step * nx, step * ny), place]
    path = polyline(corners)
    points = np.array([p for p in _spread(path) if p.distance(end.point) > 1.7 * keep])
    if points.size:
        gaps = np.hypot(turns[:, :1] - points[:, 0], turns[:, 1:] - points[:, 1])
        if gaps.min() < keep - 0.5e-6:
            return None
    return path


def _spread(path: Path) -> list[Point]:
    """Points on a stub: eight on every straight piece."""
    return [segment.at(i / 8) for segment in path for i in range(1, 9)]


def _choose(
    candidates: list[list[InnerJoin]],
    chosen: tuple[InnerJoin, ...],
    rules: DesignRules,
    spacing: float,
    width: float,
) -> tuple[InnerJoin, ...] | None:
    if len(chosen) == len(candidates):
        return chosen
    for option in candidates[len(chosen)]:
        if all(_apart(option, other, rules, spacing, width) for other in chosen):
            found = _choose(candidates, (*chosen, option), rules, spacing, width)
            if found is not None:
                return found
    return None


def _apart(one: InnerJoin, other: InnerJoin, rules: DesignRules, spacing: float, width: float) -> bool:
    if one.hole.centre.distance(other.hole.centre) < hole_distance(one.hole, other.hole, rules, spacing) - 1e-9:
        return False
    keep = hole_keep_out(one.hole, rules, spacing) + width / 2 - 1e-9
    return all(path.distance(other.hole.centre) >= keep for _, path in one.stubs) and all(
        path.distance(one.hole.centre) >= keep for _, path in other.stubs
    )
