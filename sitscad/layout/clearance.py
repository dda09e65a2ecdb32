"""Room on the board: what is already there, and whether a further track or via keeps its distance from it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sitscad.geometry.path import Path, Point
from sitscad.geometry.primitives import Primitives, distances, from_rows, nearest_pairs, path_rows
from sitscad.spec.design_rules import DesignRules

SLACK = 1e-9


@dataclass(frozen=True)
class Track:
    """A track to be placed: centre line, width (m) and copper layer."""

    path: Path
    width: float
    layer: int

    @cached_property
    def pieces(self) -> Primitives:
        """The track's segments, for exact distances."""
        return from_rows([row for row, _ in path_rows(self.path)])

    @cached_property
    def boxes(self) -> np.ndarray:
        """Bounding boxes (n, 4) of the segments' centre lines."""
        return self.pieces.boxes


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
        self._tracks: dict[int, list[Track]] = {}
        self._holes: list[Hole] = []

    def add(self, tracks: Iterable[Track], holes: Iterable[Hole] = ()) -> None:
        """Put tracks and holes on the board."""
        for track in tracks:
            self._tracks[track.layer] = [*self._tracks.get(track.layer, []), track]
        self._holes.extend(holes)

    def copy(self) -> Obstacles:
        """An independent copy, to try things on."""
        other = Obstacles(self._rules, self._spacing, self._half_width)
        other._tracks, other._holes = dict(self._tracks), list(self._holes)
        return other

    def admits(self, tracks: Iterable[Track], holes: Iterable[Hole] = ()) -> bool:
        """Whether all of these keep their distance from what is there (not from one another)."""
        return all(self._admits_track(t) for t in tracks) and all(self._admits_hole(h) for h in holes)

    def _admits_track(self, track: Track) -> bool:
        limit = self._half_width - self._rules.copper_to_edge - track.width / 2
        low, high = track.boxes[:, :2].min(axis=0), track.boxes[:, 2:].max(axis=0)
        if max(-low[1], high[1]) > limit + 2 * SLACK:
            return False
        for hole in self._holes:
            if _too_near(hole, track, hole_keep_out(hole, self._rules, self._spacing)):
                return False
        return not any(self._touches(track, other) for other in self._tracks.get(track.layer, []))

    def _touches(self, track: Track, other: Track) -> bool:
        need = self._spacing + (track.width + other.width) / 2
        reach = np.full(len(track.pieces), need)
        pairs = nearest_pairs(track.boxes, reach, other.boxes, np.zeros(len(other.pieces)))
        if not len(pairs):
            return False
        gaps = distances(track.pieces.take(pairs[:, 0]), other.pieces.take(pairs[:, 1]))
        return bool(gaps.min() < need - SLACK)

    def _admits_hole(self, hole: Hole) -> bool:
        for other in self._holes:
            if hole.centre.distance(other.centre) < hole_distance(hole, other, self._rules, self._spacing) - SLACK:
                return False
        keep = hole_keep_out(hole, self._rules, self._spacing)
        return not any(_too_near(hole, track, keep) for tracks in self._tracks.values() for track in tracks)


def _too_near(hole: Hole, track: Track, keep: float) -> bool:
    """Whether a track's copper comes nearer to a hole's centre than `keep` (m)."""
    need = keep + track.width / 2
    x, y = hole.centre
    boxes = track.boxes
    inside = (
        (boxes[:, 0] <= x + need) & (boxes[:, 2] >= x - need) & (boxes[:, 1] <= y + need) & (boxes[:, 3] >= y - need)
    )
    near = [track.path.segments[i] for i in np.flatnonzero(inside)]
    return any(segment.distance(hole.centre) < need - SLACK for segment in near)


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
