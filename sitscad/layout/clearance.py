"""Clearances between copper: whether a new track or via keeps its distance from all copper already on the board."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array, Flags, Index
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point
from sitscad.kernels.geometry.primitives import (
    Primitives,
    concatenate_primitives,
    distances,
    distances_to_points,
    from_rows,
    nearest_pairs,
    path_rows,
)
from sitscad.spec.design_rules import DesignRules

SLACK = 1e-9
"""Rounding error (m) by which a distance may be smaller than the required clearance."""

ALONG = 1.0 / math.sin(math.pi / 8.0)
"""Largest distance along one conductor at which two of its pieces need no clearance, divided by their clearance.

The clearance is here the needed distance between their centre lines. Pieces within this limit are joined by a bend.
Two tracks that meet at 45 degrees or more are then never compared.
"""


@record
class Breadth:
    """Range of y (m) of a board, or of the area for its leads: `low` at the lower edge, `high` at the upper edge.

    y is measured across the tail, from the tail's axis.
    """

    low: float
    high: float

    @property
    def half(self) -> float:
        """Half of the width (m) between the edges."""
        return (self.high - self.low) / 2

    @property
    def farthest(self) -> float:
        """Distance (m) from the axis to the farther edge."""
        return max(-self.low, self.high)

    def holds(self, low: float, high: float, keep: float) -> bool:
        """Whether a piece from y = `low` to y = `high` keeps the distance `keep` from both edges (all in m)."""
        return low >= self.low + keep and high <= self.high - keep


ENDLESS = Breadth(-math.inf, math.inf)  # Ground without edges


@record
class TrackToPlace:
    """A track to be placed: centre line `path`, `width` (m), and copper layer `layer` from 1 at the top."""

    path: Path
    width: float
    layer: int

    @cached_property
    def pieces(self) -> Primitives:
        """Segments of the track, for exact distances."""
        return from_rows([row for row, _ in path_rows(self.path)])

    @cached_property
    def boxes(self) -> Array:
        """Bounding boxes (n, 4) of the segments' centre lines."""
        return self.pieces.boxes

    @cached_property
    def copper(self) -> CopperBoxes:
        """The track as a table of segments, cached because a track is compared with many obstacles."""
        return CopperBoxes.of([self])


@record
class ViaToPlace:
    """A via to be placed. It has a pad on each layer.

    `pad` and `drill` are the diameters (m) of its pads and its hole.
    """

    centre: Point
    pad: float
    drill: float


@record
class CopperBoxes:
    """Segments of several tracks as arrays.

    `pieces` are the lines and arcs, `boxes` (n, 4; m) the bounding boxes of their centre lines, and `half_width` (n; m)
    half their widths.
    """

    pieces: Primitives
    boxes: Array
    half_width: Array

    @classmethod
    def of(cls, tracks: Sequence[TrackToPlace]) -> CopperBoxes:
        """Return the table of several tracks."""
        widths = np.repeat([track.width / 2 for track in tracks], [len(track.boxes) for track in tracks])
        boxes = np.concatenate([np.empty((0, 4)), *(track.boxes for track in tracks)])
        return cls(concatenate_primitives([track.pieces for track in tracks]), boxes, widths)


class Obstacles:
    """Tracks and holes already on the board, with the design rules.

    `admits` checks whether new tracks and holes keep the required clearances to all of them.
    """

    def __init__(self, rules: DesignRules, spacing: float, breadth: Breadth = ENDLESS) -> None:
        self._rules = rules
        self._spacing = spacing
        self._breadth = breadth
        self._tracks: dict[int, list[TrackToPlace]] = {}
        self._holes: list[ViaToPlace] = []
        self._copper: dict[int, CopperBoxes] = {}
        self._kept: tuple[Array, Array] | None = None

    def add(self, tracks: Iterable[TrackToPlace], holes: Iterable[ViaToPlace] = ()) -> None:
        """Put tracks and holes on the board."""
        for track in tracks:
            self._tracks[track.layer] = [*self._tracks.get(track.layer, []), track]
            self._copper.pop(track.layer, None)
        self._holes, self._kept = [*self._holes, *holes], None

    def copy(self) -> Obstacles:
        """Return an independent copy for trials."""
        other = Obstacles(self._rules, self._spacing, self._breadth)
        other._tracks, other._holes, other._copper = dict(self._tracks), self._holes, dict(self._copper)
        return other

    def admits(self, tracks: Iterable[TrackToPlace], holes: Iterable[ViaToPlace] = ()) -> bool:
        """Whether all new tracks and holes keep their clearances to the copper on the board.

        Clearances among the new pieces are not checked.
        """
        return all(self._admits_track(t) for t in tracks) and all(bool(self.admitted([h])) for h in holes)

    def admits_each(self, tracks: Sequence[TrackToPlace]) -> Flags:
        """Return, for each of several tracks on one layer, whether it keeps its clearances as in `admits`."""
        segments = CopperBoxes.of(tracks)
        of = np.repeat(np.arange(len(tracks)), [len(track.boxes) for track in tracks])
        keep = self._rules.copper_to_edge + segments.half_width - 2 * SLACK
        low, high = self._breadth.low + keep, self._breadth.high - keep
        free = np.ones(len(tracks), dtype=bool)
        free[of[(segments.boxes[:, 1] < low) | (segments.boxes[:, 3] > high)]] = False
        if self._holes:
            free[of[_meetings(segments, *self._kept_by_holes())[:, 0]]] = False
        if tracks[0].layer in self._tracks:
            free[of[self._touching(segments, self._on(tracks[0].layer))]] = False
        return free

    def admitted(self, holes: Sequence[ViaToPlace]) -> list[ViaToPlace]:
        """Return the holes that keep their clearances to the copper on the board. Each hole is checked by itself."""
        if not holes:
            return []
        centres = np.array([hole.centre for hole in holes])
        keep = np.array([hole_keep_out(hole, self._rules, self._spacing) for hole in holes])
        free = np.ones(len(holes), dtype=bool)
        for k, hole in enumerate(holes):
            free[k] = all(
                hole.centre.distance(other.centre) >= hole_distance(hole, other, self._rules, self._spacing) - SLACK
                for other in self._holes
            )
        for layer in self._tracks:
            free[_meetings(self._on(layer), centres, keep)[:, 1]] = False
        return [hole for hole, stays in zip(holes, free.tolist(), strict=True) if stays]

    def _on(self, layer: int) -> CopperBoxes:
        if layer not in self._copper:
            self._copper[layer] = CopperBoxes.of(self._tracks[layer])
        return self._copper[layer]

    def _admits_track(self, track: TrackToPlace) -> bool:
        """Whether a track keeps its clearances to the board's edge, to holes and to tracks."""
        from_edge = self._rules.copper_to_edge + track.width / 2 - 2 * SLACK
        if not self._breadth.holds(track.boxes[:, 1].min(), track.boxes[:, 3].max(), from_edge):
            return False
        segments = track.copper
        if self._holes and _meetings(segments, *self._kept_by_holes()).size:
            return False
        return track.layer not in self._tracks or not bool(self._touching(segments, self._on(track.layer)).size)

    def _kept_by_holes(self) -> tuple[Array, Array]:
        """Return the centres of the holes (n, 2; m), and the least distance (n; m) of copper edges from each centre."""
        if self._kept is None:
            keep = [hole_keep_out(hole, self._rules, self._spacing) for hole in self._holes]
            self._kept = np.array([hole.centre for hole in self._holes]), np.array(keep)
        return self._kept

    def _touching(self, track: CopperBoxes, other: CopperBoxes) -> Index:
        """Return the indices of pieces in `track` whose gap to a piece in `other` is below the required spacing."""
        reach = track.half_width + self._spacing
        pairs = nearest_pairs(track.boxes, reach, other.boxes, other.half_width)
        if not len(pairs):
            return pairs[:, 0]
        gaps = distances(track.pieces.take(pairs[:, 0]), other.pieces.take(pairs[:, 1]))
        return pairs[gaps < reach[pairs[:, 0]] + other.half_width[pairs[:, 1]] - SLACK, 0]


def _meetings(copper: CopperBoxes, centres: Array, keep: Array) -> Index:
    """Return index pairs (m, 2) of copper pieces and centres whose distance is less than the centre's `keep` (m).

    The distance is measured to the edge of the copper.
    """
    pairs = nearest_pairs(copper.boxes, copper.half_width, np.hstack([centres, centres]), keep)
    piece, hole = pairs[:, 0], pairs[:, 1]
    gaps = distances_to_points(copper.pieces.take(piece), centres[hole])
    return pairs[gaps < keep[hole] + copper.half_width[piece] - SLACK]


def off_stretch(x: Array, y: Array, dx: Array, dy: Array) -> Array:
    """Return the distances (m) of points from straight segments. Arrays are broadcast.

    (x, y) is the position of a point relative to the start of the segment, and (dx, dy) the vector from this start to
    the segment's end (all in m). The distance of a nan point is nan.
    """
    share = (x * dx + y * dy) / np.maximum(dx * dx + dy * dy, 1e-30)
    np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
    return np.asarray(np.hypot(x - share * dx, y - share * dy))


def via_room(rules: DesignRules, spacing: float, width: float) -> float:
    """Return the width (m) of the area that the smallest via for tracks of `width` (m) needs beside foreign copper.

    It extends from the far edge of the via's pad to the edge of copper that is not joined to the via.
    """
    hole = joined_hole(rules, width)
    return hole_keep_out(hole, rules, spacing) + hole.pad / 2


def joined_hole(rules: DesignRules, width: float) -> ViaToPlace:
    """Return the smallest via for tracks of `width` (m), at the origin.

    Its pad covers the round ends of these tracks.
    """
    return ViaToPlace(Point(0.0, 0.0), max(rules.via_pad, width), rules.via_drill)


def hole_keep_out(hole: ViaToPlace, rules: DesignRules, spacing: float) -> float:
    """Return the smallest permitted distance (m) from a hole's centre to copper that is not joined to the hole."""
    return max(hole.pad / 2 + spacing, hole.drill / 2 + rules.drill_to_copper)


def hole_distance(first: ViaToPlace, second: ViaToPlace, rules: DesignRules, spacing: float) -> float:
    """Return the smallest permitted distance (m) between the centres of two holes."""
    return max(
        (first.pad + second.pad) / 2 + spacing,
        (first.drill + second.drill) / 2 + rules.hole_to_hole,
        hole_keep_out(first, rules, spacing) + second.pad / 2,
    )
