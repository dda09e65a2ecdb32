"""Vias inside the innermost turn, where two layers of a coil meet, and the stubs that lead to them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sitscad.geometry.path import Line, Path, Point, polar
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
    """The inner end of one layer: where it is, on which copper layer, and the unit direction from the end back along the turn."""

    point: Point
    layer: int
    back: tuple[float, float]


def place_inner_vias(
    windings: tuple[Winding, ...], centre: Point, width: float, clear_radius: float, rules: DesignRules, spacing: float
) -> tuple[InnerJoin, ...] | None:
    """One via for every pair of inner ends (the last alone for an odd number of layers), or None if there is no room.

    Candidates stand on rings about the centre; the choice with the shortest stubs that keeps every distance wins.
    """
    joins = [tuple(inner_end(w) for w in windings[i : i + 2]) for i in range(0, len(windings), 2)]
    turns = _innermost_copper(windings)
    candidates = [_candidates(ends, turns, centre, width, clear_radius, rules, spacing) for ends in joins]
    return _choose(candidates, (), rules, spacing, width)


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


def _innermost_copper(windings: tuple[Winding, ...]) -> np.ndarray:
    """Points (n, 2) on the last turn and a bit of every layer: the copper that the centre can touch."""
    points: list[Point] = []
    for winding in windings:
        path = winding.path if winding.inward else winding.path.reversed()
        for segment in path.segments[-max(6, math.ceil(len(path.segments) * 0.4)) :]:
            count = max(2, math.ceil(segment.length / 30e-6))
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
) -> list[InnerJoin]:
    """The joins that keep their distance from every turn, those with the shortest stubs first."""
    hole = Hole(centre, rules.via_pad, rules.via_drill)
    keep = hole_keep_out(hole, rules, spacing)
    reach = clear_radius - keep
    if reach < -1e-9:
        return []
    found = []
    for place in _places(centre, max(0.0, reach), ends[0].point):
        if float(np.min(np.hypot(turns[:, 0] - place.x, turns[:, 1] - place.y))) < keep + width / 2 - 0.5e-6:
            continue
        if all(_leaves_well(end, place, turns, width, spacing) for end in ends):
            stubs = tuple((end.layer, Path((Line(end.point, place),))) for end in ends)
            found.append(InnerJoin(Hole(place, rules.via_pad, rules.via_drill), stubs))
    return sorted(found, key=lambda join: round(_length(join), 9))


def _places(centre: Point, reach: float, towards: Point) -> Iterator[Point]:
    start = math.atan2(towards.y - centre.y, towards.x - centre.x)
    yield centre
    for ring in range(RADII):
        radius = reach * (1.0 - ring / RADII)
        for i in range(ANGLES):
            yield polar(radius, start + 2.0 * math.pi * i / ANGLES, centre)


def _leaves_well(end: InnerEnd, place: Point, turns: np.ndarray, width: float, spacing: float) -> bool:
    """Whether the straight stub bends by at most 120 degrees at the turn's end and then keeps away from every turn."""
    dx, dy = place.x - end.point.x, place.y - end.point.y
    length = math.hypot(dx, dy)
    if length < 1e-9 or (dx * end.back[0] + dy * end.back[1]) / length > 0.5:
        return False
    free = 1.7 * (width + spacing)
    for i in range(1, 9):
        x, y = end.point.x + dx * i / 8, end.point.y + dy * i / 8
        if math.hypot(x - end.point.x, y - end.point.y) <= free:
            continue
        if float(np.min(np.hypot(turns[:, 0] - x, turns[:, 1] - y))) < width + spacing - 0.5e-6:
            return False
    return True


def _length(join: InnerJoin) -> float:
    return sum(path.length for _, path in join.stubs)


def _choose(
    candidates: list[list[InnerJoin]],
    chosen: tuple[InnerJoin, ...],
    rules: DesignRules,
    spacing: float,
    width: float,
    tries: int = 60,
) -> tuple[InnerJoin, ...] | None:
    if len(chosen) == len(candidates):
        return chosen
    options = candidates[len(chosen)]
    if len(candidates) > 1 and len(options) > tries:
        options = options[:: max(1, len(options) // tries)]
    for option in options:
        if all(_apart(option, other, rules, spacing, width) for other in chosen):
            found = _choose(candidates, (*chosen, option), rules, spacing, width, tries)
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
