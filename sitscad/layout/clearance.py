"""Room on the board: what is already there, and whether a further track or via keeps its distance from it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from sitscad.geometry.path import Path, Point, bounding_box
from sitscad.spec.design_rules import DesignRules

SAMPLE_STEP = 60e-6
"""Tracks are compared at points this far apart (m); the design-rule check afterwards is exact."""

SLACK = 1e-9


@dataclass(frozen=True)
class Track:
    """A track to be placed: centre line, width (m) and copper layer."""

    path: Path
    width: float
    layer: int


@dataclass(frozen=True)
class Hole:
    """A via to be placed: centre, pad and drill diameters (m); its pad is on every layer."""

    centre: Point
    pad: float
    drill: float


class Obstacles:
    """What is already on the board; `admits` asks whether tracks and holes keep the rules' distances from all of it."""

    def __init__(self, rules: DesignRules, spacing: float, half_width: float = math.inf) -> None:
        self._rules = rules
        self._spacing = spacing
        self._half_width = half_width
        self._tracks: list[tuple[Track, list[Point], tuple[float, float, float, float]]] = []
        self._holes: list[Hole] = []

    def add(self, tracks: Iterable[Track], holes: Iterable[Hole] = ()) -> None:
        """Put tracks and holes on the board."""
        for track in tracks:
            self._tracks.append((track, sampled(track.path), bounding_box([track.path])))
        self._holes.extend(holes)

    def copy(self) -> Obstacles:
        """An independent copy, to try things on."""
        other = Obstacles(self._rules, self._spacing, self._half_width)
        other._tracks, other._holes = list(self._tracks), list(self._holes)
        return other

    def admits(self, tracks: Iterable[Track], holes: Iterable[Hole] = ()) -> bool:
        """Whether all of these keep their distance from what is there (not from one another)."""
        return all(self._admits_track(t) for t in tracks) and all(self._admits_hole(h) for h in holes)

    def _admits_track(self, track: Track) -> bool:
        points = sampled(track.path)
        box = bounding_box([track.path])
        limit = self._half_width - self._rules.copper_to_edge - track.width / 2
        if max(-box[1], box[3]) > limit + 2e-9:
            return False
        for hole in self._holes:
            need = hole_keep_out(hole, self._rules, self._spacing) + track.width / 2
            if _near(box, (*hole.centre, *hole.centre), need) and track.path.distance(hole.centre) < need - SLACK:
                return False
        for other, other_points, other_box in self._tracks:
            need = self._spacing + (track.width + other.width) / 2
            if other.layer != track.layer or not _near(box, other_box, need):
                continue
            if closest(points, track.path, other_points, other.path) < need - SLACK:
                return False
        return True

    def _admits_hole(self, hole: Hole) -> bool:
        keep = hole_keep_out(hole, self._rules, self._spacing)
        for other in self._holes:
            if hole.centre.distance(other.centre) < hole_distance(hole, other, self._rules, self._spacing) - SLACK:
                return False
        for track, _, box in self._tracks:
            need = keep + track.width / 2
            if _near(box, (*hole.centre, *hole.centre), need) and track.path.distance(hole.centre) < need - SLACK:
                return False
        return True


def hole_keep_out(hole: Hole, rules: DesignRules, spacing: float) -> float:
    """Distance (m) from a hole's centre to the edge of any copper that is not joined to it."""
    return max(hole.pad / 2 + spacing, hole.drill / 2 + rules.drill_to_copper)


def hole_distance(one: Hole, other: Hole, rules: DesignRules, spacing: float) -> float:
    """Smallest distance (m) between the centres of two holes."""
    return max(
        (one.pad + other.pad) / 2 + spacing,
        (one.drill + other.drill) / 2 + rules.hole_to_hole,
        hole_keep_out(one, rules, spacing) + other.pad / 2,
    )


def sampled(path: Path) -> list[Point]:
    """Points along a path, at most `SAMPLE_STEP` apart, both ends included."""
    points = [path.start]
    for segment in path:
        count = max(1, math.ceil(segment.length / SAMPLE_STEP))
        points.extend(segment.at(i / count) for i in range(1, count + 1))
    return points


def closest(points: list[Point], path: Path, other_points: list[Point], other: Path) -> float:
    """Smallest distance (m) between two sampled paths, from the fewer points to the other path's segments."""
    if len(points) <= len(other_points):
        return min(other.distance(point) for point in points)
    return min(path.distance(point) for point in other_points)


def _near(a: tuple[float, ...], b: tuple[float, ...], margin: float) -> bool:
    return a[0] <= b[2] + margin and b[0] <= a[2] + margin and a[1] <= b[3] + margin and b[1] <= a[3] + margin
