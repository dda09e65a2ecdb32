"""Ways through an array whose coils do not stand in one line: the shortest for each pair that keeps all distances.

A pair runs stacked on two layers, so it is one track to be led from its coil's ring road to its place in the tail. A
wave from there over a lattice (Dijkstra) finds the shortest way to every exit of the ring at once; each way is then
pulled taut between what it passes. The clearance is judged at points along the way, not on the lattice.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.geometry.path import Point
from sitscad.layout.clearance import Hole, Track, hole_keep_out
from sitscad.layout.lanes import Bus, Exit
from sitscad.layout.ring import Ring
from sitscad.record import record
from sitscad.spec.sensor import CoilPlacement, SensorSpec

Floats = NDArray[np.float64]

EXITS = 24
MARGIN = 2e-6
"""Kept beyond the rules (m), for what the points along a way do not see."""

CHORD = 2e-6
_STEPS = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)]


@record
class Ground:
    """The board between the coils: its far end, its front, where the tail begins, and its half widths there (m)."""

    start: float
    front: float
    tail_start: float
    half_width: float
    tail_half_width: float

    def limit(self, x: Floats) -> Floats:
        """Half width (m) of the board at each x: the body's, then tapering to the tail's."""
        along = np.clip((x - self.front) / max(self.tail_start - self.front, 1e-9), 0.0, 1.0)
        return self.half_width + along * (self.tail_half_width - self.half_width)


@dataclass
class Maze:
    """What stands on the board, and the search through it."""

    spec: SensorSpec
    bus: Bus
    ground: Ground
    tracks: list[Track] = field(default_factory=list)
    holes: list[Hole] = field(default_factory=list)
    _known: int = 0
    _pieces: list[tuple[Floats, Floats, float]] = field(default_factory=list)

    @property
    def step(self) -> float:
        """The lattice's step (m): fine enough for a track between two others, coarse enough for some 20 000 nodes."""
        area = (self.ground.tail_start - self.ground.start) * 2 * self.ground.half_width
        return max(self.bus.pitch / 2, math.sqrt(area / 20_000))

    def exits(self, placement: CoilPlacement, entry: Point) -> Iterator[tuple[Exit, Exit]]:
        """The ways from a coil's ring to its entry of the tail, shortest first: both conductors take the same."""
        xs, ys = self._lattice()
        free = self._clear(np.column_stack([g.ravel() for g in np.meshgrid(xs, ys, indexing="ij")]), placement)
        wave = _wave(free.reshape(len(xs), len(ys)), self._nodes_near(entry, xs, ys))
        reached = []
        for angle, lead in self._starts(placement):
            node = min(self._nodes_near(lead, xs, ys), key=lambda n: wave.distance[n], default=None)
            if node is not None and math.isfinite(wave.distance[node]):
                reached.append((round(float(wave.distance[node]), 6), angle, lead, node))
        for _, angle, lead, node in sorted(reached):
            corners = [lead, *(Point(float(xs[i]), float(ys[j])) for i, j in wave.back(node)), entry]
            way = tuple(self._taut(corners, placement))
            yield Exit(angle, way, self.bus.layers[0]), Exit(angle, way, self.bus.layers[1])

    def _lattice(self) -> tuple[Floats, Floats]:
        ground, step = self.ground, self.step
        rows = math.floor(ground.half_width / step)
        columns = math.ceil((ground.tail_start - ground.start) / step)
        return ground.start + step * np.arange(columns + 1.0), step * np.arange(-rows, rows + 1.0)

    def _starts(self, placement: CoilPlacement) -> Iterator[tuple[float, Point]]:
        """Exits round the ring: the angle, and the point outside from which the way is free to turn."""
        ring = Ring(self.spec.coil, placement, self.bus.ring_offset)
        outside = Ring(self.spec.coil, placement, self.bus.ring_offset + self._own_room + MARGIN)
        for k in range(EXITS):
            angle = 2 * math.pi * k / EXITS
            start, lead = ring.at(angle), outside.at(angle)
            if self._clear(_between(start, lead, self.step / 4), None, but=placement).all():
                yield angle, lead

    @property
    def _own_room(self) -> float:
        return self.bus.pitch

    def _nodes_near(self, point: Point, xs: Floats, ys: Floats) -> list[tuple[int, int]]:
        reach = 1.6 * self.step
        near_x = np.flatnonzero(np.abs(xs - point.x) <= reach)
        near_y = np.flatnonzero(np.abs(ys - point.y) <= reach)
        return [(int(i), int(j)) for i in near_x for j in near_y]

    def _taut(self, corners: list[Point], placement: CoilPlacement) -> list[Point]:
        """The way with every corner left out that can be: from each point straight to the farthest that is in sight."""
        way, here = [corners[0]], 0
        while here < len(corners) - 1:
            low, high = here + 1, len(corners) - 1
            while low < high:
                middle = (low + high + 1) // 2
                if self._in_sight(corners[here], corners[middle], placement):
                    low = middle
                else:
                    high = middle - 1
            way.append(corners[low])
            here = low
        return way

    def _in_sight(self, one: Point, other: Point, placement: CoilPlacement) -> bool:
        return bool(self._clear(_between(one, other, self.step / 4), placement).all())

    def _clear(self, points: Floats, own: CoilPlacement | None, but: CoilPlacement | None = None) -> NDArray[np.bool_]:
        """Whether a track's centre line may pass through each point (n, 2), for the pair of the coil `own`."""
        rules = self.spec.fpc.rules
        edge = rules.copper_to_edge + self.bus.width / 2
        clear = np.abs(points[:, 1]) <= self.ground.limit(points[:, 0]) - math.sqrt(2.0) * edge + 1e-9
        clear |= (np.abs(points[:, 1]) <= self.ground.half_width - edge + 1e-9) & (points[:, 0] < self.ground.front)
        for placement in self.spec.array.placements:
            if placement == but:
                continue
            room = self.bus.ring_offset + (self._own_room if placement == own else self.bus.base) + MARGIN / 2
            clear &= _outside(self.spec, placement, points) >= room - 1e-9
        clear &= self._off_tracks(points)
        for hole in self.holes:
            need = hole_keep_out(hole, rules, self.bus.spacing) + self.bus.width / 2 + MARGIN
            clear &= np.hypot(points[:, 0] - hole.centre.x, points[:, 1] - hole.centre.y) >= need
        return clear

    def _off_tracks(self, points: Floats) -> NDArray[np.bool_]:
        """Whether points keep the spacing from all tracks on the pair's layers, arcs taken as chords within `CHORD`."""
        clear = np.ones(len(points), dtype=bool)
        for a, b, need in self._chords():
            low, high = np.minimum(a, b) - need, np.maximum(a, b) + need
            near = np.flatnonzero(clear & np.all((points >= low) & (points <= high), axis=1))
            if not near.size:
                continue
            offset = points[near] - a
            along = b - a
            t = np.clip(offset @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
            clear[near] = np.hypot(*(offset - t[:, None] * along).T) >= need
        return clear

    def _chords(self) -> list[tuple[Floats, Floats, float]]:
        """The chords of all tracks on the pair's layers with the distance to keep, made anew when tracks were added."""
        if self._known != len(self.tracks):
            self._known = len(self.tracks)
            self._pieces = [
                (np.array(a), np.array(b), self.bus.spacing + (self.bus.width + track.width) / 2 + MARGIN + CHORD)
                for track in self.tracks
                if track.layer in self.bus.layers
                for a, b in pairwise(track.path.flattened(CHORD))
            ]
        return self._pieces


@record
class _Wave:
    """Distances (m, in steps) over the lattice from the tail's entry, and from each node the next one towards it."""

    distance: Floats
    towards: dict[tuple[int, int], tuple[int, int]]

    def back(self, node: tuple[int, int]) -> Iterator[tuple[int, int]]:
        """The nodes from one to the entry."""
        while True:
            yield node
            if node not in self.towards:
                return
            node = self.towards[node]


def _wave(free: NDArray[np.bool_], sources: list[tuple[int, int]]) -> _Wave:
    """Dijkstra's algorithm over the free nodes of a lattice with eight neighbours each."""
    distance = np.full(free.shape, np.inf)
    towards: dict[tuple[int, int], tuple[int, int]] = {}
    queue = [(0.0, node) for node in sources if free[node]]
    for _, node in queue:
        distance[node] = 0.0
    rows, columns = free.shape
    steps = [(dx, dy, math.hypot(dx, dy)) for dx, dy in _STEPS]
    while queue:
        so_far, (i, j) = heapq.heappop(queue)
        if so_far > distance[i, j]:
            continue
        for dx, dy, length in steps:
            x, y = i + dx, j + dy
            if 0 <= x < rows and 0 <= y < columns and free[x, y] and so_far + length < distance[x, y] - 1e-12:
                distance[x, y] = so_far + length
                towards[x, y] = (i, j)
                heapq.heappush(queue, (so_far + length, (x, y)))
    return _Wave(distance, towards)


def _between(one: Point, other: Point, step: float) -> Floats:
    count = max(2, math.ceil(one.distance(other) / step) + 1)
    t = np.linspace(0.0, 1.0, count)[:, None]
    return np.array([one]) + t * (np.array([other]) - np.array([one]))


def _outside(spec: SensorSpec, placement: CoilPlacement, points: Floats) -> Floats:
    """Distance (m) of points from a coil's outer copper edge, negative inside; never more than the true one."""
    x, y = points[:, 0] - placement.centre[0], points[:, 1] - placement.centre[1]
    if spec.coil.shape == "circle":
        return np.hypot(x, y) - spec.coil.size[0] / 2
    cos, sin = math.cos(placement.rotation), math.sin(placement.rotation)
    x, y = cos * x + sin * y, cos * y - sin * x
    result = np.full(len(x), -np.inf)
    for side in Ring(spec.coil, placement, 0.0).boundary:
        length = side.length
        nx, ny = (side.end.y - side.start.y) / length, (side.start.x - side.end.x) / length
        result = np.maximum(result, (x - side.start.x) * nx + (y - side.start.y) * ny)
    return result
