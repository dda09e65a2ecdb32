"""Connections outside one coil: tracks on its lead ring, vias, and the cost of a path around the coil.

The lead ring is the closed path around the coil, next to its outermost turn. A branch is one connection: a leg, or two
legs joined by a via. Each leg is a track that runs from a point to the lead ring, along it, and on to its end.

The two contacts of a pair are side by side. Between them, the current therefore circulates around the coil a whole
number of times. The turns of the layers may add up to a fraction. The leads then run around the lead ring for the
missing part of a turn. This part is called the closing arc. It links the winding's flux like a part of a turn. If both
leads run around together, above each other, their effects cancel. A coil whose winding ends inside needs no closing
arc, because its lead can come out under the turns in any direction. The area between this lead and the coil's centre
also links flux, and is converted to an equivalent angle.

Branches of one coil are compared by arrays of their angle ranges on the lead ring, which is cheap. Vias and the
straight parts beyond the lead ring are compared by exact distances.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import TWO_PI, Line, Path, Point
from sitscad.layout.board import Coil, Role, Trace
from sitscad.layout.clearance import (
    Breadth,
    Obstacles,
    TrackToPlace,
    ViaToPlace,
    hole_distance,
    hole_keep_out,
    joined_hole,
    off_stretch,
)
from sitscad.layout.lanes import Bus, Ring, straightness
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import ArtworkSpec

FLATTENED = 1e-6  # Arcs become chords within this distance (m)
"""Largest distance (m) of arcs from their chords."""

Values = TypeVar("Values", float, Array)

WEIGHT = 10.0
"""Cost of a closing arc, divided by its length.

The arc changes the inductance by several per cent per quarter turn. Two leads that run around the coil together only
add resistance.
"""

RUNNING_ON = 0.9
"""Cost of a closing arc in the winding's sense, divided by the cost of an equal arc in the other sense.

Both arcs add equal resistance. The arc in the winding's sense adds inductance, and the opposite arc reduces it. If both
arcs are half a turn, the arc in the winding's sense is therefore chosen.
"""


def closing_turns(coil: CoilSpec, sweep_a: Values, sweep_b: Values) -> Values:
    """Return the turns of the closing arc of a coil's circuit, positive in the winding's sense.

    `sweep_a` and `sweep_b` (rad) are the signed angles by which the two leads run around the coil.
    """
    sense = -1.0 if coil.clockwise else 1.0
    return sense * (sweep_b - sweep_a) / TWO_PI


def closing_cost(turns: Values, radius: float) -> Array:
    """Return the cost of closing arcs as an equivalent length (m) of lead.

    `turns` are the arcs' lengths in turns, positive in the winding's sense. `radius` (m) is the lead ring's radius.
    """
    return WEIGHT * TWO_PI * radius * counted(turns)


def counted(turns: Values) -> Array:
    """Return the weighted length of closing arcs (turns): arcs in the winding's sense count `RUNNING_ON` times."""
    return np.where(np.asarray(turns) > 0.0, RUNNING_ON * np.asarray(turns), np.abs(turns))


def least_closing(coil: CoilSpec) -> float:
    """Return the closing arc of least cost for a coil's leads, in turns, positive in the winding's sense.

    Whether the arc has room is not checked.
    """
    if len(coil.layers) % 2:
        return 0.0
    beyond = math.fsum(coil.layer_turns) % 1.0
    return -beyond if beyond < RUNNING_ON * (1.0 - beyond) else 1.0 - beyond


def swept_inside(inner: Point, outer: Point, centre: Point) -> float:
    """Return the angle (rad, signed) on the lead ring that is equivalent to a straight lead from inside a coil.

    The sector with this angle has the area of the triangle of `inner`, `outer` and `centre`. Equal areas link equal
    flux, because the field inside the turns is nearly uniform.
    """
    x, y, beyond_x, beyond_y = inner.x - centre.x, inner.y - centre.y, outer.x - centre.x, outer.y - centre.y
    return (x * beyond_y - y * beyond_x) / max(math.hypot(x, y), math.hypot(beyond_x, beyond_y)) ** 2


def drawn_closing(spec: CoilSpec, coil: Coil) -> float:
    """Return the closing arc (turns) of a drawn coil: the turns of its conductors outside the winding."""
    outside = min(spec.size) / 2.0 - spec.trace_width
    centre, swept = coil.centre, 0.0
    for piece in coil.series:
        if not isinstance(piece, Trace) or piece.role is Role.WINDING:
            continue
        for first, second in pairwise(Point(*place) for place in piece.path.flattened(FLATTENED)):
            nearer, farther = sorted((first.distance(centre), second.distance(centre)))
            if nearer > outside:
                angles = [math.atan2(point.y - centre.y, point.x - centre.x) for point in (first, second)]
                swept += math.remainder(angles[1] - angles[0], TWO_PI)
            elif farther > outside:
                swept += swept_inside(first, second, centre)
    return (-1.0 if spec.clockwise else 1.0) * swept / TWO_PI


VIA_PLACES = 32  # Directions round a coil in which vias may stand
"""Number of directions around a coil in which vias may be placed."""


@record
class OuterEnd:
    """An end of the winding on copper layer `layer`, at which a lead or a connection between layers begins.

    It is the outer end of a layer's spiral. If the coil has an odd number of layers, the last end is an inner via, and
    `from_inside` is True.
    """

    point: Point
    layer: int
    from_inside: bool = False


@record
class BranchGround:
    """Inputs of the search for the connections (branches) outside one coil.

    `artwork` has the design rules, and `bus` the dimensions of the leads. `breadth` is the y range in which vias may
    lie.
    """

    artwork: ArtworkSpec
    bus: Bus
    placement: CoilPlacement
    breadth: Breadth

    @cached_property
    def joined(self) -> ViaToPlace:
        """Smallest via for leads. Its pad covers the round ends of the tracks."""
        return joined_hole(self.artwork.fpc.rules, self.bus.width)

    @cached_property
    def keep_out(self) -> float:
        """Smallest permitted distance (m) from a via's centre to the edge of copper that is not joined to it."""
        return hole_keep_out(self.joined, self.artwork.fpc.rules, self.bus.spacing)

    @cached_property
    def coil(self) -> CoilSpec:
        """The coil."""
        return self.placement.own or self.artwork.coil

    @cached_property
    def ring(self) -> Ring:
        """Lead ring of the coil: the centre line of a track that closely surrounds its outermost turn."""
        return Ring(self.coil, self.placement, self.bus.ring_offset)

    @cached_property
    def radius(self) -> float:
        """Smallest radius (m) of the lead ring. An angle times this radius never exceeds the length along the ring."""
        return min(self.coil.size) / 2 + self.bus.ring_offset

    @cached_property
    def own_turns(self) -> Obstacles:
        """Outermost turns of the coil, on all of its layers."""
        obstacles = Obstacles(self.artwork.fpc.rules, self.bus.spacing)
        obstacles.add(outermost_turns(self.coil, self.placement))
        return obstacles

    def via_places(self) -> Iterator[ViaToPlace]:
        """Yield possible vias with sufficient distance from the edge.

        They lie next to the coil, or so far outside that the lead ring stays free.
        """
        rules, beyond = self.artwork.fpc.rules, self.bus.ring_offset + self.bus.width / 2 + self.keep_out
        placement = CoilPlacement("", (0.0, 0.0), self.placement.rotation)
        places = _via_places(self.coil, placement, self.bus.ring_offset, (self.keep_out, beyond))
        keep = self.joined.pad / 2 + rules.copper_to_edge - 1e-9
        for place, angle, distance in places:
            centre = place.shifted(*self.placement.centre)
            if self.breadth.holds(centre.y, centre.y, keep):
                self._stands[centre] = angle, distance
                yield ViaToPlace(centre, rules.via_pad, rules.via_drill)

    @cached_property
    def _stands(self) -> dict[Point, tuple[float, float]]:
        return {}

    def stand(self, hole: ViaToPlace) -> tuple[float, float]:
        """Return the angle (rad) at which the lead ring passes a via, and the distance (m) between ring and via."""
        return self._stands[hole.centre]


def outermost_turns(coil: CoilSpec, placement: CoilPlacement) -> Iterator[TrackToPlace]:
    """Yield a closed track along the outermost turn of a coil, for each of the coil's layers."""
    boundary = coil.outline.boundary(coil.size, -coil.trace_width / 2)
    path = boundary.rotated(placement.rotation).shifted(*placement.centre)
    for layer in coil.layers:
        yield TrackToPlace(path, coil.trace_width, layer)


@lru_cache(maxsize=64)
def _via_places(
    coil: CoilSpec, placement: CoilPlacement, road: float, offsets: tuple[float, ...]
) -> tuple[tuple[Point, float, float], ...]:
    """Return positions around a coil: (position, angle of the lead ring in rad, distance from the lead ring in m).

    `offsets` (m) are distances of the positions from the coil's copper, and `road` (m) is the distance of the lead ring
    from this copper. The result is cached for coils that differ only in position, and for successive trial boards.
    """
    ring, places = Ring(coil, placement, road), []
    for offset in offsets:
        around = Ring(coil, placement, offset)
        for i in range(VIA_PLACES):
            place = around.at(TWO_PI * i / VIA_PLACES)
            angle = ring.facing(place)[0]
            places.append((place, angle, place.distance(ring.at(angle))))
    return tuple(places)


def fold_chord(first: Line, second: Line, apart: float) -> Line | None:
    """Return a line that cuts off the corner between a straight track and a later track that leads back.

    Both tracks then lie `apart` (m) or farther from each other. None if they are as far apart without it, or if a track
    is too short for it.

    Notes
    -----
    The line's ends are equally far from the corner on both tracks.
    """
    (ax, ay), (bx, by) = (((line.end.x - line.start.x) / line.length, (line.end.y - line.start.y) / line.length)
                          for line in (first, second))
    cosine, sine = ax * bx + ay * by, ax * by - ay * bx
    if cosine >= 0.0 or abs(sine) < 1e-9:
        return None
    if min(first.distance(second.start), second.distance(first.end)) >= apart - 1e-9:
        return None
    across = second.start - first.end
    to_corner = (across.x * by - across.y * bx) / sine
    from_corner = (across.y * ax - across.x * ay) / sine
    cut = apart / math.sqrt(2.0 + 2.0 * cosine)
    back, onward = cut - to_corner, cut - from_corner
    if back > first.length - 1e-9 or onward > second.length - 1e-9:
        return None
    return Line(first.end.shifted(-back * ax, -back * ay), second.start.shifted(onward * bx, onward * by))


def square_fold(first: Line, short: Line, second: Line) -> tuple[Line, Line, Line] | None:
    """Return three straight tracks that turn back with right angles instead of acute angles beside the track `short`.

    None if neither corner is acute, or if the track beside a corner is too short. The first and the last track become
    shorter, so that the path needs no additional area.
    """
    if straightness(first.start, first.end, short.end) < -ACUTE:
        foot = first.start.shifted(*_along(first, short.end))
        if 1e-9 < foot.distance(first.start) < first.length:
            return Line(first.start, foot), Line(foot, short.end), second
    if straightness(short.start, second.start, second.end) < -ACUTE:
        foot = second.start.shifted(*_along(second, short.start))
        if 1e-9 < foot.distance(second.end) < second.length:
            return first, Line(short.start, foot), Line(foot, second.end)
    return None


ACUTE = math.cos(math.radians(60.0)) + 1e-9
"""Cosine of the smallest permitted angle between two straight tracks. Etchant erodes sharper corners."""


def _along(line: Line, point: Point) -> tuple[float, float]:
    """Return the vector (m, m) from a line's start to the foot of the perpendicular from a point to the line."""
    x, y = line.end.x - line.start.x, line.end.y - line.start.y
    part = ((point.x - line.start.x) * x + (point.y - line.start.y) * y) / (x * x + y * y)
    return part * x, part * y


@record
class Leg:
    """A track on copper layer `layer`: from `begin` to the lead ring, along it, and on through the points `finish`.

    It meets the lead ring at `angle` (rad) and follows it by `sweep` (rad, positive counter-clockwise). `around`
    describes the coil.
    """

    around: BranchGround
    layer: int
    begin: Point
    angle: float
    sweep: float
    finish: tuple[Point, ...]

    @property
    def end_angle(self) -> float:
        """Angle (rad) at which the leg leaves the lead ring."""
        return self.angle + self.sweep

    @cached_property
    def stretches(self) -> list[tuple[Point, Point]]:
        """Start and end of each straight part after the lead ring."""
        corners = (self.around.ring.at(self.end_angle), *self.finish)
        return [(start, end) for start, end in pairwise(corners) if start.distance(end) > 1e-12]

    @cached_property
    def track(self) -> TrackToPlace:
        """Track of the leg, without narrow notches."""
        ring = self.around.ring
        first = ring.at(self.angle)
        path = Path((Line(self.begin, first),)) if self.begin.distance(first) > 1e-9 else Path(())
        if self.sweep:
            path = path + ring.along(self.angle, self.end_angle, self.sweep > 0)
        beyond = Path(tuple(Line(start, end) for start, end in self.stretches))
        return TrackToPlace(self._unfolded(path + beyond), self.around.bus.width, self.layer)

    def _unfolded(self, path: Path) -> Path:
        """Return a path without narrow notches and acute corners.

        Each short part on which the path turns back is replaced by a straight line or by two right angles. On the
        coil's own layers, such a line is only used if it stays outside the lead ring.
        """
        segments, apart = list(path), self.around.bus.pitch
        is_free = self.layer not in self.around.coil.layers
        for k in range(len(segments) - 2):
            first, short, second = segments[k : k + 3]
            if not isinstance(first, Line) or not isinstance(short, Line) or not isinstance(second, Line):
                continue
            chord = fold_chord(first, second, apart) if short.length < 2.0 * apart else None
            if chord is not None and (is_free or self.around.ring.is_outside(chord)):
                segments[k : k + 3] = Line(first.start, chord.start), chord, Line(chord.end, second.end)
            elif chord is None and (squared := square_fold(first, short, second)) is not None:
                segments[k : k + 3] = squared
        return Path(tuple(segments))

    @cached_property
    def round(self) -> float:
        """Angle (rad, signed) by which the leg runs around the coil, including a part inside the coil."""
        ring = self.around.ring
        return self.sweep + swept_inside(self.begin, ring.at(self.angle), ring.centre)

    @cached_property
    def cost(self) -> float:
        """Approximate length (m) on the lead ring and before it, for sorting."""
        return abs(self.sweep) * self.around.radius + self.begin.distance(self.around.ring.at(self.angle))


@record
class Branch:
    """A connection outside the winding: one leg, or two legs with the via `hole` between them.

    `returns` is True if the second leg is drawn from its end to the via, and thus against the current.
    """

    legs: tuple[Leg, ...]
    hole: ViaToPlace | None = None
    returns: bool = False

    @cached_property
    def pieces(self) -> tuple[TrackToPlace | ViaToPlace, ...]:
        """Tracks and via in the order of the current."""
        if self.hole is None:
            return self.tracks
        first, second = self.tracks
        return (first, self.hole, replace(second, path=second.path.reversed()) if self.returns else second)

    @property
    def tracks(self) -> tuple[TrackToPlace, ...]:
        """Tracks in the direction in which they are drawn."""
        return tuple(leg.track for leg in self.legs)

    @property
    def holes(self) -> tuple[ViaToPlace, ...]:
        """The via of the connection. Empty if there is only one leg."""
        return (self.hole,) if self.hole else ()

    @cached_property
    def cost(self) -> float:
        """Cost as a length (m): the legs' lengths, and a millimetre for a via."""
        return sum([leg.cost for leg in self.legs]) + (1e-3 if self.hole else 0.0)

    @cached_property
    def round(self) -> float:
        """Angle (rad, signed) by which the connection runs around the coil, from the start of its first leg."""
        first, *second = (leg.round for leg in self.legs)
        return first + sum(-sweep if self.returns else sweep for sweep in second)


ROWS_AT_ONCE = 16
"""Number of branches, the cheapest first, that are compared at once with all branches of another connection."""


@record(eq=False)
class BranchTable:
    """Possible branches of one connection as arrays with one row per branch, the cheapest first.

    `cost` (n; m) is the cost, and `round` (n; rad) the angle around the coil. Arrays (n, 2) describe the two legs:
    `layer` is the copper layer, -1 without a second leg. `low` and `sweep` (rad) are start and length of the range on
    the lead ring. Arrays (n) describe the via: `centre` (n, 2; m) is its position, nan without a via. `angle` (rad) is
    the angle of the lead ring beside the via, and `beside` (m) the distance between them. `starts` and `steps` (w, 2;
    m) are start and vector of each straight part after the lead ring, and `owner` (w) is its branch.
    """

    around: BranchGround
    branches: tuple[Branch, ...]
    cost: Array
    round: Array
    layer: Index
    low: Array
    sweep: Array
    centre: Array
    angle: Array
    beside: Array
    starts: Array
    steps: Array
    owner: Index

    def beside_branch(self, other: BranchTable, row: int) -> int:
        """Return the set of branches in this table that keep their clearance to branch `row` of another table.

        The result is an integer whose bit k is branch k. It is cached.
        """
        sets = other._known.setdefault(id(self), (self, {}))[1]  # by identity, so this table is kept, too
        if row not in sets:
            first = row - row % ROWS_AT_ONCE
            rows = range(first, min(first + ROWS_AT_ONCE, len(other.branches)))
            sets.update(zip(rows, self.beside_branches(other, rows), strict=True))
        return sets[row]

    @cached_property
    def _known(self) -> dict[int, tuple[BranchTable, dict[int, int]]]:
        return {}

    def beside_branches(self, other: BranchTable, rows: range) -> list[int]:
        """Return, for each branch in `rows` of another table, the branches of this table with sufficient clearance."""
        around, some = self.around, slice(rows.start, rows.stop)
        layer, low, sweep = (table[some][:, None, None, :] for table in (other.layer, other.low, other.sweep))
        same = (self.layer[:, :, None] == layer) & (layer >= 0)
        gap = _interval_gap(self.low[:, :, None], self.sweep[:, :, None], low, sweep)
        near = np.any(same & (gap < (around.bus.pitch - 1e-9) / around.radius), axis=(2, 3))
        need = around.keep_out + around.bus.width / 2 - 1e-9
        if other.has_vias:  # they may meet the legs of this table, beyond the ring too, and its vias
            angle, beside = other.angle[some, None, None], other.beside[some, None]
            gap = _interval_gap(self.low, self.sweep, angle, 0.0) * around.radius
            near |= (beside < need) & np.any((gap < need) & (self.layer >= 0), axis=2)
            stretch, row = np.nonzero(_to_stretches(self.starts, self.steps, other.centre[some]) < need)
            near[row, self.owner[stretch]] = True
            apart = hole_distance(around.joined, around.joined, around.artwork.fpc.rules, around.bus.spacing) - 1e-9
            offsets = self.centre - other.centre[some, None]
            near |= np.hypot(offsets[..., 0], offsets[..., 1]) < apart
        if self.has_vias:  # and these the legs of the others
            low, sweep, layer = (table[some, None] for table in (other.low, other.sweep, other.layer))
            gap = _interval_gap(self.angle[:, None], 0.0, low, sweep) * around.radius
            near |= (self.beside < need) & np.any((gap < need) & (layer >= 0), axis=2)
            stretches = slice(*np.searchsorted(other.owner, (some.start, some.stop)))
            distances = _to_stretches(other.starts[stretches], other.steps[stretches], self.centre)
            stretch, branch = np.nonzero(distances < need)
            near[other.owner[stretches][stretch] - some.start, branch] = True
        return [int.from_bytes(row.tobytes(), "little") for row in np.packbits(~near, axis=1, bitorder="little")]

    @cached_property
    def has_vias(self) -> bool:
        """Whether at least one branch has a via."""
        return not bool(np.isnan(self.angle).all())


def branch_table(around: BranchGround, branches: Sequence[Branch]) -> BranchTable:
    """Return a table of several branches, in the given order."""
    legs, vias, stretches, owner = [], [], [], []
    for k, branch in enumerate(branches):
        rows = [(leg.layer, leg.angle + min(leg.sweep, 0.0), abs(leg.sweep)) for leg in branch.legs]
        legs.append((*rows, (-1, 0.0, 0.0))[:2])
        vias.append((math.nan,) * 4 if branch.hole is None else (*branch.hole.centre, *around.stand(branch.hole)))
        for leg in branch.legs:
            for start, end in leg.stretches:
                stretches.append((*start, *end))
                owner.append(k)
    leg_of, via_of = np.array(legs, dtype=float).reshape(-1, 2, 3), np.array(vias, dtype=float).reshape(-1, 4)
    table = np.array(stretches, dtype=float).reshape(-1, 4)
    return BranchTable(
        around=around, branches=tuple(branches), cost=np.array([branch.cost for branch in branches]),
        round=np.array([branch.round for branch in branches]), layer=leg_of[..., 0].astype(np.intp),
        low=leg_of[..., 1], sweep=leg_of[..., 2], centre=via_of[:, :2], angle=via_of[:, 2], beside=via_of[:, 3],
        starts=table[:, :2], steps=table[:, 2:] - table[:, :2], owner=np.array(owner, dtype=np.intp),
    )


def _interval_gap(low: Any, sweep: Any, other_low: Any, other_sweep: Any) -> Array:
    """Return the gaps (rad) between ranges on a circle, each given by start and length (rad).

    0 if the ranges overlap.
    """
    ahead = (other_low - low) % TWO_PI
    behind = np.where(ahead > 0.0, TWO_PI - ahead, 0.0) - other_sweep
    return np.asarray(np.maximum(0.0, np.minimum(ahead - sweep, behind)))


def _to_stretches(starts: Array, steps: Array, points: Array) -> Array:
    """Return the distances (m) of points (p, 2; m) from straight parts: (parts, p). nan for nan points."""
    x, y = (points[:, k] - starts[:, k, None] for k in (0, 1))
    return off_stretch(x, y, *steps.T[:, :, None])
