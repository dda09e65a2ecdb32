"""Shortest paths of leads through an array whose coils are not in one line, with all clearances.

The two leads of a pair run above each other on two layers, so the search treats them as one track. It runs from its
coil's lead ring (the closed path around the coil) to its place in the tail. A shortest-path search from the tail over a
lattice (Dijkstra) finds the paths to all points of the lead ring at once. Each path is then straightened between its
obstacles. Clearances are checked at points along the path, not on the lattice.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import chain, pairwise, product

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Point
from sitscad.layout.clearance import Breadth, TrackToPlace, ViaToPlace, hole_keep_out, off_stretch
from sitscad.layout.lanes import BENT_BACK, Bus, Exit, Ring, straightness
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import ArtworkSpec

Node = tuple[int, int]

_STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))


@record(eq=False)
class Wave:
    """Result of a shortest-path search over a lattice: the distance and the predecessor of each node, row by row.

    The lattice has a border of one node. `stride` is the number of nodes in a row. `reached` are distances in steps of
    the lattice, infinite for nodes that the search did not reach. `before` is the index of the predecessor, or -1.
    """

    stride: int
    reached: Sequence[float]
    before: Sequence[int]

    def distance(self, node: Node) -> float:
        """Return the distance (lattice steps) of a node from the nearest source."""
        return self.reached[self._place(node)]

    def back(self, node: Node) -> Iterator[Node]:
        """Yield the nodes of the shortest path from a node back to its source."""
        place = self._place(node)
        while place >= 0:
            yield place // self.stride - 1, place % self.stride - 1
            place = self.before[place]

    def _place(self, node: Node) -> int:
        return (node[0] + 1) * self.stride + node[1] + 1


def spread(
    free: Flags, sources: Sequence[Node], between: Flags | None = None, goals: Iterable[Node] | None = None
) -> Wave:
    """Return the shortest paths from source nodes over the free nodes. Each node has eight neighbours.

    `between` (2 n - 1, 2 m - 1) is a lattice of half the step; it marks the free points that a step may cross. If it is
    None, all steps are free. The search ends when it has reached all nodes in `goals`. If they are None, it covers all
    nodes.
    """
    stride = free.shape[1] + 2
    size = (free.shape[0] + 2) * stride
    step_sets, onward = _ways(free, between), _onward(stride)
    reached, before = [math.inf] * size, [-1] * size
    queue = [(0.0, (i + 1) * stride + j + 1) for i, j in sources if free[i, j]]
    targets = None if goals is None else {(i + 1) * stride + j + 1 for i, j in goals if free[i, j]}
    for _, place in queue:
        reached[place] = 0.0
    while queue:
        length, place = heapq.heappop(queue)
        if length > reached[place]:
            continue
        if targets is not None:
            targets.discard(place)
            if not targets:
                break
        for offset, stride_length in onward[step_sets[place]]:
            beyond, further = place + offset, length + stride_length
            if further < reached[beyond] - 1e-12:
                reached[beyond], before[beyond] = further, place
                heapq.heappush(queue, (further, beyond))
    return Wave(stride, reached, before)


def _ways(free: Flags, between: Flags | None) -> Sequence[int]:
    """Return the permitted steps from each node, including the border, as an integer: bit k is step k of the eight."""
    n, m = free.shape
    step_bits = np.zeros((n + 2, m + 2), dtype=np.intp)
    bordered = np.zeros((n + 2, m + 2), dtype=bool)
    bordered[1:-1, 1:-1] = free
    halves = np.ones((2 * n + 1, 2 * m + 1), dtype=bool)
    if between is not None:
        halves[1:-1, 1:-1] = between
    for bit, (dx, dy) in enumerate(_STEPS):
        beyond = bordered[1 + dx : n + 1 + dx, 1 + dy : m + 1 + dy]
        halfway = halves[1 + dx : 2 * n + dx + 1 : 2, 1 + dy : 2 * m + dy + 1 : 2]
        step_bits[1:-1, 1:-1] |= (free & beyond & halfway).astype(np.intp) << bit
    return list(step_bits.ravel().tolist())


@lru_cache(maxsize=16)
def _onward(stride: int) -> tuple[tuple[tuple[int, float], ...], ...]:
    """Return, for each set of permitted steps, (index offset, length) of each step. `stride` is the nodes in a row.

    The result is indexed by the integer whose bit k is step k. Lengths are in steps of the lattice.
    """
    steps = [(dx * stride + dy, math.hypot(dx, dy)) for dx, dy in _STEPS]
    return tuple(tuple(step for bit, step in enumerate(steps) if bits >> bit & 1) for bits in range(1 << len(steps)))


EXITS = 24
"""Number of equally spaced directions in which a path may leave the lead ring."""
MARGIN = 2e-6  # Margin (m) on the rules' clearance, for places between the sampled points of a path
"""Margin (m) added to the required clearance, for places between the sampled points of a path."""

CHORD = 2e-6
"""Largest distance (m) of arcs from their chords."""
STRIDE = 0.71  # Half a diagonal step of the lattice, in steps
"""Half of a diagonal step of the lattice, in steps."""


@record
class Ground:
    """Free area for paths: the body up to x = `front` (m), then the taper up to x = `tail_start` (m).

    `breadth` is the range of y of the body, and `tail_half_width` (m) half the tail's width.
    """

    front: float
    tail_start: float
    breadth: Breadth
    tail_half_width: float

    def limits(self, x: Array) -> tuple[Array, Array]:
        """Return the y (m) of the lower and upper edge of the board at each x.

        Beyond the front, the edges run linearly from the body's width to the tail's width.
        """
        progress = np.clip((x - self.front) / max(self.tail_start - self.front, 1e-9), 0.0, 1.0)
        low, high = self.breadth.low, self.breadth.high
        return low + progress * (-self.tail_half_width - low), high + progress * (self.tail_half_width - high)


@record(eq=False)
class Lattice:
    """Lattice points over the whole array, with their distances from each coil.

    The points lie between x = `start` and x = `end` (m), in the range of y `breadth`. All trial boards use the same
    lattice.
    """

    artwork: ArtworkSpec
    bus: Bus
    start: float
    end: float
    breadth: Breadth

    @cached_property
    def step(self) -> float:
        """Lattice step (m): at least half the pitch of leads, and coarse enough for at most about 20,000 nodes."""
        area = (self.end - self.start) * 2 * self.breadth.half
        return max(self.bus.pitch / 2, math.sqrt(area / 20_000))

    @cached_property
    def xs(self) -> Array:
        """Positions x (m) of the lattice columns."""
        return self.start + self.step * np.arange(math.ceil((self.end - self.start) / self.step) + 1.0)

    @cached_property
    def ys(self) -> Array:
        """Positions y (m) of the lattice rows."""
        below, above = (math.floor(reach / self.step) for reach in (-self.breadth.low, self.breadth.high))
        return self.step * np.arange(-below, above + 1.0)

    @property
    def halves(self) -> tuple[int, int]:
        """Numbers of columns and rows of the lattice with half the step."""
        return 2 * len(self.xs) - 1, 2 * len(self.ys) - 1

    @cached_property
    def points(self) -> Array:
        """Points (n, 2; m) of the lattice with half the step, column by column."""
        columns, rows = (
            first + self.step / 2 * np.arange(count)
            for first, count in zip((self.xs[0], self.ys[0]), self.halves, strict=True)
        )
        return np.column_stack([grid.ravel() for grid in np.meshgrid(columns, rows, indexing="ij")])

    @cached_property
    def outside(self) -> dict[CoilPlacement, Array]:
        """Distances (m) of all points in `points` from each coil's outer copper edge. Negative inside the coil."""
        return {placement: self.from_coil(placement, self.points) for placement in self.artwork.array.placements}

    def from_coil(self, placement: CoilPlacement, points: Array) -> Array:
        """Return the distances (m) of points (n, 2; m) from a coil's outer copper edge. Negative inside the coil.

        A result may be smaller than the true distance, but never larger.
        """
        offsets = points - np.array(placement.centre)
        coil, key = placement.own or self.artwork.coil, (placement.own, placement.rotation)
        if coil.outline.is_round:
            return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]) - coil.size[0] / 2)
        # outward normals (2, n) of a coil's sides, and the sides' distances (m) from its centre
        if key not in self._known_sides:
            boundary = Ring(coil, placement, 0.0).boundary.rotated(placement.rotation)
            ends = np.array([[*side.start, *side.end] for side in boundary])
            sides = ends[:, 2:] - ends[:, :2]
            normals = np.stack([sides[:, 1], -sides[:, 0]]) / np.hypot(sides[:, 0], sides[:, 1])
            self._known_sides[key] = normals, np.sum(normals.T * ends[:, :2], axis=1)
        normals, distances = self._known_sides[key]
        return np.asarray((offsets @ normals - distances).max(axis=1))

    @cached_property
    def inside(self) -> dict[Ground, Flags]:
        """For each board, flags of the points in `points` that keep a track's distance from the board's edge."""
        return {}

    @cached_property
    def _known_sides(self) -> dict[tuple[CoilSpec | None, float], tuple[Array, Array]]:
        return {}

    def around(self, low: Array, high: Array) -> tuple[slice, slice]:
        """Return the lattice columns and rows in the rectangle from corner `low` to corner `high` (m)."""
        i, j = np.searchsorted(self.xs, [low[0], high[0]]), np.searchsorted(self.ys, [low[1], high[1]])
        return slice(int(i[0]), int(i[1])), slice(int(j[0]), int(j[1]))


@dataclass
class Maze:
    """Obstacles on one trial board, and the search for paths between them."""

    lattice: Lattice
    bus: Bus
    ground: Ground
    holes: list[ViaToPlace] = field(default_factory=list)
    _chords: Array = field(default_factory=lambda: np.empty((0, 5)))

    def __post_init__(self) -> None:
        """Mark all nodes as free."""
        self.artwork, self.step = self.lattice.artwork, self.lattice.step
        self._free = np.ones((len(self.lattice.xs), len(self.lattice.ys)), dtype=bool)

    def add(self, tracks: Iterable[TrackToPlace], holes: Iterable[ViaToPlace]) -> None:
        """Add tracks and holes as obstacles."""
        for hole in holes:
            self.holes.append(hole)
            centre = np.array(hole.centre)
            self._take(centre, centre, self._keep_out(hole))
        for track in tracks:
            if track.layer not in self.bus.layers:
                continue
            need = self.bus.spacing + (self.bus.width + track.width) / 2 + MARGIN + CHORD
            chords = list(pairwise(track.path.flattened(CHORD)))
            self._chords = np.vstack([self._chords, *(np.array([[*a, *b, need]]) for a, b in chords)])
            for a, b in chords:
                # a way over the lattice must not step across a thin track
                self._take(np.array(a), np.array(b), max(need, STRIDE * self.step))

    def _take(self, a: Array, b: Array, need: float) -> None:
        """Mark the nodes that are closer than `need` (m) to the straight line from a to b as occupied."""
        columns, rows = self.lattice.around(np.minimum(a, b) - need, np.maximum(a, b) + need)
        x, y = self.lattice.xs[columns, None], self.lattice.ys[None, rows]
        self._free[columns, rows] &= off_stretch(x - a[0], y - a[1], *(b - a)) >= need

    def _keep_out(self, hole: ViaToPlace) -> float:
        return hole_keep_out(hole, self.artwork.fpc.rules, self.bus.spacing) + self.bus.width / 2 + MARGIN

    def exits(self, placement: CoilPlacement, entry: Point) -> Iterator[tuple[Exit, Exit]]:
        """Yield paths of a coil's two leads from its lead ring to the point `entry` at the tail, the shortest first.

        Both leads have the same path, on two layers.
        """
        # nodes, and halfway between, where a long step would cut a coil's corner
        if self.ground not in self.lattice.inside:
            self.lattice.inside[self.ground] = self._inside(self.lattice.points)
        clear = self.lattice.inside[self.ground].copy()
        for other, outside in self.lattice.outside.items():
            clear &= outside >= self._room(other, placement)
        clear = clear.reshape(self.lattice.halves)
        starts = [(angle, lead, self._nodes_near(lead)) for angle, lead in self._starts(placement)]
        sources = [node for node in self._nodes_near(entry) if self._is_seen(entry, node)]
        goals = chain.from_iterable(nodes for _, _, nodes in starts)
        wave = spread(clear[::2, ::2] & self._free, sources, clear, goals)
        reached = []
        for angle, lead, nodes in starts:
            near = sorted((node for node in nodes if math.isfinite(wave.distance(node))), key=wave.distance)
            node = next((node for node in near if self._is_seen(lead, node)), None)
            if node is not None:
                reached.append((round(wave.distance(node), 6), angle, lead, node))
        ring = Ring(self.artwork.coil, placement, self.bus.ring_offset)
        for _, angle, lead, node in sorted(reached):
            corners = [lead, *(self._point(n) for n in wave.back(node)), entry]
            way = tuple(self._taut(corners, placement))
            if straightness(ring.at(angle), *way[:2]) >= -BENT_BACK:
                yield Exit(angle, way, self.bus.layers[0]), Exit(angle, way, self.bus.layers[1])

    def _room(self, placement: CoilPlacement, led_coil: CoilPlacement | None) -> float:
        """Return the smallest permitted distance (m) of a pair's centre line from the copper of the coil `placement`.

        `led_coil` is the coil to which the pair belongs.
        """
        beside = self.bus.pitch if placement == led_coil else self.bus.base
        return self.bus.ring_offset + beside + MARGIN / 2 - 1e-9

    def _starts(self, placement: CoilPlacement) -> Iterator[tuple[float, Point]]:
        """Yield (angle, point) for each free direction in which a path can leave a coil's lead ring.

        The path leaves the ring at this angle (rad). The point is the first point outside the ring at which the path
        may change its direction.
        """
        ring = Ring(self.artwork.coil, placement, self.bus.ring_offset)
        outside = Ring(self.artwork.coil, placement, self.bus.ring_offset + self.bus.pitch + MARGIN)
        for k in range(EXITS):
            angle = 2 * math.pi * k / EXITS
            start = ring.at(angle)
            for facing in dict.fromkeys(outside.facing(start)):  # at a corner square to either side
                lead = outside.at(facing)
                if self._clear(_between(start, lead, self.step / 4), None, but=placement).all():
                    yield angle, lead

    def _nodes_near(self, point: Point) -> list[Node]:
        """Return the lattice nodes near a point."""
        reach = 1.6 * self.step
        near_x = np.flatnonzero(np.abs(self.lattice.xs - point.x) <= reach).tolist()
        near_y = np.flatnonzero(np.abs(self.lattice.ys - point.y) <= reach).tolist()
        return list(product(near_x, near_y))

    def _is_seen(self, point: Point, node: Node) -> bool:
        """Whether the straight line from a point to a node keeps its distance from all tracks."""
        return bool(self._off_tracks(_between(point, self._point(node), self.step / 4)).all())

    def _point(self, node: Node) -> Point:
        return Point(float(self.lattice.xs[node[0]]), float(self.lattice.ys[node[1]]))

    def _taut(self, corners: list[Point], placement: CoilPlacement) -> list[Point]:
        """Return a path without unneeded corners.

        Each point is followed by the farthest point that a straight line can reach with sufficient clearance.
        """
        way, here = [corners[0]], 0
        while here < len(corners) - 1:
            low, high = here + 1, len(corners) - 1
            while low < high:
                middle = (low + high + 1) // 2
                if self._clear(_between(corners[here], corners[middle], self.step / 4), placement).all():
                    low = middle
                else:
                    high = middle - 1
            way.append(corners[low])
            here = low
        return way

    def _clear(self, points: Array, led_coil: CoilPlacement | None, but: CoilPlacement | None = None) -> Flags:
        """Return, for each point (n, 2; m), whether a lead of the coil `led_coil` may pass through it.

        The coil `but` is not treated as an obstacle.
        """
        clear = self._inside(points)
        for placement in self.artwork.array.placements:
            if placement != but:
                clear &= self.lattice.from_coil(placement, points) >= self._room(placement, led_coil)
        for hole in self.holes:
            distances = np.hypot(points[:, 0] - hole.centre.x, points[:, 1] - hole.centre.y)
            clear &= distances >= self._keep_out(hole)
        return clear & self._off_tracks(points)

    def _inside(self, points: Array) -> Flags:
        """Return, for each point (n, 2; m), whether it is on the board with a track's distance from the edge."""
        edge = self.artwork.fpc.rules.copper_to_edge + self.bus.width / 2
        x, y = points[:, 0], points[:, 1]
        low, high = self.ground.limits(x)
        inset = math.sqrt(2.0) * edge - 1e-9
        on_taper = (y >= low + inset) & (y <= high - inset)
        body, inset = self.ground.breadth, edge - 1e-9
        beside = (y >= body.low + inset) & (y <= body.high - inset) & (x < self.ground.front)
        return (on_taper | beside) & (x <= self.ground.tail_start + 1e-9)

    def _off_tracks(self, points: Array) -> Flags:
        """Return, for each point (n, 2; m), whether it keeps its distance from all tracks on the pair's layers.

        Arcs are replaced by chords with an error of `CHORD`.
        """
        if not len(self._chords):
            return np.ones(len(points), dtype=bool)
        ax, ay, bx, by, need = self._chords.T
        (least_x, low), (most_x, high) = points.min(axis=0), points.max(axis=0)
        near = (np.minimum(ax, bx) - need <= most_x) & (np.maximum(ax, bx) + need >= least_x)
        near &= (np.minimum(ay, by) - need <= high) & (np.maximum(ay, by) + need >= low)
        x, y = points[:, :1] - ax[near], points[:, 1:] - ay[near]
        distances = off_stretch(x, y, (bx - ax)[near], (by - ay)[near])
        return np.asarray((distances >= need[near]).all(axis=1))


def _between(start: Point, end: Point, step: float) -> Array:
    """Return points (n, 2; m) on the line between two points, at most `step` (m) apart."""
    count = max(2, math.ceil(start.distance(end) / step) + 1)
    t = np.linspace(0.0, 1.0, count)[:, None]
    return np.array([start]) + t * (np.array([end]) - np.array([start]))
