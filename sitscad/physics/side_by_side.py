"""Mutual inductance of windings that lie side by side: strands sampled as finely as the other winding's distance asks.

Every side, arc or spiral turn is halved until it is no longer than it is far from the other winding, and gets a few
Gauss points a part. Straight sides that nearly touch are left to `tracks`, where a pair of filaments is closed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.filaments import sampled_mutual_inductance
from sitscad.physics.legendre import gauss
from sitscad.physics.spirals import SpiralLayer
from sitscad.physics.track_strands import Track
from sitscad.physics.tracks import tracks_mutual_inductance
from sitscad.record import record

Array = NDArray[np.float64]
Index = NDArray[np.intp]

POINTS = 8
"""Gauss points a part at most."""

SHORT = (0.03, 0.15, 0.4, 0.65, 0.9, 1.2)
"""Lengths of a part over its distance from the other winding up to which 2, 3, 4 ... points are right to 1e-7."""

SLIGHT = (0.1, 0.3, 0.7, 1.2, 1.8, 2.5)
"""Angles (rad) of a curved part up to which 2, 3, 4 ... points are."""

LONG = 1.5
"""Largest length of a part over its distance from the other winding: eight points are right to 1e-7 of its pair."""

BEND = 3.2
"""Largest angle (rad) of a curved part."""

TOUCHING = 0.06
"""Distance, in the longest side, below which pairs of straight sides are closed: sampling them would cost more."""

WIDE = 0.003
"""Track width over the winding's radius from which two strands a track are taken: one misses its square."""

NEAR = 0.2
"""Track width over the least distance of the windings' centre lines from which three strands are taken."""

STACKED = 5e-3
"""Spread of the heights through both coppers times the height of the stack, over the least squared distance, from which
one copper is taken at two heights. Below it the spread's square is added to all squared distances."""

DISTANCES = 1 << 16
"""Distances of points and pieces that are worked on at once: a few megabytes."""

HALVINGS = 14
"""A part is halved so often at most: windings that cross are not what this is for."""


@record(eq=False)
class Pieces:
    """Pieces of one kind of all layers of a winding. Metres and radians.

    Straight (n, 8): start, end, and the mitres by which they move per metre to the left. Curved (n, 7): centre x, y,
    radius and azimuth at the start, direction (+1 counter-clockwise), angle, fall of the radius per radian. `heights`
    (n) are mid-planes, `thicknesses` (n) the copper's.
    """

    rows: Array
    heights: Array
    thicknesses: Array
    width: float

    @property
    def is_curved(self) -> bool:
        """Whether the rows are of the curved kind."""
        return self.rows.shape[1] == 7

    @property
    def lengths(self) -> Array:
        """Length (m) of every piece, that of a spiral turn by its start."""
        if self.is_curved:
            return np.asarray(self.rows[:, 2] * self.rows[:, 5])
        return np.hypot(self.rows[:, 2] - self.rows[:, 0], self.rows[:, 3] - self.rows[:, 1])

    def moved(self, dx: float, dy: float) -> Pieces:
        """The pieces moved by (dx, dy) metres."""
        step = [dx, dy, 0.0, 0.0, 0.0, 0.0, 0.0] if self.is_curved else [dx, dy, dx, dy, 0.0, 0.0, 0.0, 0.0]
        return replace(self, rows=self.rows + np.array(step))

    def points(self, index: Index, s: Array, left: float) -> tuple[Array, Array]:
        """Points and derivatives (k, m, 2) at fractions s (k, m) of pieces (k), `left` metres off the centre line."""
        rows = self.rows[index][:, None, :]
        if not self.is_curved:
            start, end = rows[..., :2] + left * rows[..., 4:6], rows[..., 2:4] + left * rows[..., 6:]
            return start + s[..., None] * (end - start), np.broadcast_to(end - start, (*s.shape, 2))
        centre, (radius, azimuth, direction, angle, fall) = rows[..., :2], np.moveaxis(rows[..., 2:], 2, 0)
        turned = angle * s
        r, a = radius - fall * turned, azimuth + direction * turned
        outward = np.stack([np.cos(a), np.sin(a)], axis=-1)
        forward = direction[..., None] * np.stack([-outward[..., 1], outward[..., 0]], axis=-1)
        step = r[..., None] * forward - fall[..., None] * outward
        speed = np.hypot(r, fall)
        normal = np.stack([-step[..., 1], step[..., 0]], axis=-1) / speed[..., None]
        # a parallel curve is shorter on the inner side, by its curvature
        shorter = 1.0 - left * direction * (r * r + 2.0 * fall * fall) / speed**3
        return centre + r[..., None] * outward + left * normal, step * (shorter * angle)[..., None]

    def distance(self, where: Array) -> Array:
        """Least distance (m) in the plane of points (k, 2) from the centre lines."""
        if not len(self.rows):
            return np.full(len(where), np.inf)
        from_one = self._from_curves if self.is_curved else self._from_sides
        step = max(1, DISTANCES // len(self.rows))
        parts = (where[begin : begin + step, None, :] for begin in range(0, max(1, len(where)), step))
        return np.concatenate([from_one(part).min(axis=1) for part in parts])

    def _from_sides(self, p: Array) -> Array:
        start, step = self.rows[:, :2], self.rows[:, 2:4] - self.rows[:, :2]
        s = np.clip(np.sum((p - start) * step, axis=-1) / np.sum(step * step, axis=-1), 0.0, 1.0)
        away = p - start - s[..., None] * step
        return np.hypot(away[..., 0], away[..., 1])

    def _from_curves(self, p: Array) -> Array:
        x, y, radius, azimuth, direction, angle, fall = self.rows.T
        dx, dy = p[..., 0] - x, p[..., 1] - y
        turned = direction * (np.arctan2(dy, dx) - azimuth) % (2.0 * math.pi)
        beside = np.abs(np.hypot(dx, dy) - (radius - fall * turned))
        ends = [
            np.hypot(dx - r * np.cos(a), dy - r * np.sin(a))
            for r, a in ((radius, azimuth), (radius - fall * angle, azimuth + direction * angle))
        ]
        return np.where(turned <= angle, beside, np.minimum(*ends))


def track_pieces(tracks: Sequence[Track]) -> tuple[Pieces, Pieces]:
    """The straight and the curved pieces of a winding's layers; the tracks have one width."""
    sides = [np.concatenate([t.starts, t.ends, t.before, t.after], axis=1) for t in tracks]
    arcs = [np.concatenate([t.arcs, np.zeros((len(t.arcs), 1))], axis=1) for t in tracks]
    return _joined(sides, tracks), _joined(arcs, tracks)


def spiral_pieces(layers: Sequence[SpiralLayer]) -> Pieces:
    """The half turns of round layers, walked along the current; the layers have one width."""
    return _joined([_half_turns(layer) for layer in layers], layers)


def _half_turns(layer: SpiralLayer) -> Array:
    count, slope = max(1, math.ceil(2.0 * layer.turns)), layer.pitch / (2.0 * math.pi)
    step = layer.span / count
    theta = step * np.arange(count)
    if not layer.inward:
        theta = layer.span - theta
    walk = 1.0 if layer.inward else -1.0
    one = np.ones(count)
    return np.stack([0.0 * one, 0.0 * one, layer.radius - slope * theta, layer.angle + layer.sense * theta,
                     walk * layer.sense * one, step * one, walk * slope * one], axis=1)  # fmt: skip


def _joined(rows: Sequence[Array], layers: Sequence[Track | SpiralLayer]) -> Pieces:
    heights = np.concatenate([np.full(len(r), layer.z) for r, layer in zip(rows, layers, strict=True)])
    thicknesses = np.concatenate([np.full(len(r), layer.thickness) for r, layer in zip(rows, layers, strict=True)])
    return Pieces(np.concatenate(rows), heights, thicknesses, layers[0].width)


@record
class SideBySide:
    """Mutual inductance (H) of two windings, and their tracks' width over the least distance of their centre lines."""

    inductance: float
    nearness: float


def spirals_side_by_side(
    first: Sequence[SpiralLayer], second: Sequence[SpiralLayer], displacement: tuple[float, float]
) -> SideBySide:
    """Two round windings in one plane, the second one's centre `displacement` (m) from the first one's."""
    mutual, least = _sampled(spiral_pieces(first), spiral_pieces(second).moved(*displacement))
    return SideBySide(mutual, first[0].width / least)


def tracks_side_by_side(
    first: Sequence[Track], second: Sequence[Track], displacement: tuple[float, float]
) -> SideBySide:
    """Two windings of sides and arcs in one plane, the second one moved by `displacement` (m)."""
    sides, arcs = track_pieces(first)
    other_sides, other_arcs = (pieces.moved(*displacement) for pieces in track_pieces(second))
    found = [_sampled(arcs, other_arcs), _sampled(arcs, other_sides), _sampled(sides, other_arcs)]
    least = _least_between_sides(sides, other_sides)
    if len(sides.rows) and len(other_sides.rows) and least < TOUCHING * _longest(sides, other_sides):
        found.append((_closed(first, second, displacement), least))
    else:
        found.append(_sampled(sides, other_sides))
    mutual = math.fsum(value for value, _ in found)
    return SideBySide(mutual, first[0].width / min(least, *(distance for _, distance in found)))


def _closed(first: Sequence[Track], second: Sequence[Track], displacement: tuple[float, float]) -> float:
    one, other = ([replace(t, arcs=t.arcs[:0]) for t in tracks] for tracks in (first, second))
    return math.fsum(tracks_mutual_inductance(p, q.shifted(*displacement), (2, 2)) for p in one for q in other)


def _longest(one: Pieces, other: Pieces) -> float:
    return max(float(one.lengths.max()), float(other.lengths.max()))


def _least_between_sides(one: Pieces, other: Pieces) -> float:
    # Of two sides that do not cross, one has an end that is nearest.
    if not len(one.rows) or not len(other.rows):
        return math.inf
    ends, other_ends = (np.concatenate([p.rows[:, :2], p.rows[:, 2:4]]) for p in (one, other))
    return min(float(other.distance(ends).min()), float(one.distance(other_ends).min()))


def _sampled(one: Pieces, other: Pieces) -> tuple[float, float]:
    """Mutual inductance (H) of two sets of pieces, and their least distance (m)."""
    if not len(one.rows) or not len(other.rows):
        return 0.0, math.inf
    halved, other_halved = _halved(one, other), _halved(other, one)
    aside = math.sqrt(float(np.mean(one.thicknesses**2) + np.mean(other.thicknesses**2)) / 12.0)
    stack = float(np.ptp(np.concatenate([one.heights, other.heights])))
    curve, _ = halved.samples(math.inf, 0.0)
    other_curve, clearances = other_halved.samples(stack, aside)
    return sampled_mutual_inductance(curve, other_curve, clearances), halved.least


@record(eq=False)
class _Halved:
    """Pieces halved into parts: piece, low end and length (as fractions of it) of every part, its distance (m) from the
    other winding, and how many points and strands it needs; `least` (m) is the least distance that was met.
    """

    pieces: Pieces
    index: Index
    low: Array
    step: Array
    away: Array
    least: float

    @cached_property
    def counts(self) -> Index:
        """Points of every part: fewer the farther it is for its length, and the less it bends."""
        ratio = self.pieces.lengths[self.index] * self.step / np.maximum(self.away, 1e-300)
        found = np.searchsorted(SHORT, ratio) + 2
        if self.pieces.is_curved:
            found = np.maximum(found, np.searchsorted(SLIGHT, self.pieces.rows[self.index, 5] * self.step) + 2)
        return np.minimum(found, POINTS)

    @cached_property
    def strands(self) -> Index:
        """Strands of every part: as many as its width asks for."""
        pieces = self.pieces
        size = float(pieces.rows[:, 2].max()) if pieces.is_curved else 0.5 * float(pieces.lengths.max())
        return np.where(pieces.width > NEAR * self.away, 3, 2 if pieces.width > WIDE * size else 1)

    def samples(self, stack: float, aside: float) -> tuple[tuple[Array, Array], Array]:
        """Points (n, 3) and elements (n, 2), and what squared distances from each point are lengthened by (m2): parts
        so near that it matters in a stack so high (m) are taken at two heights, `aside` (m) of their middle.
        """
        high = aside * stack >= STACKED * (self.away**2 + stack**2) if aside else np.zeros(len(self.away), dtype=bool)
        kinds = np.stack([self.counts, self.strands, high], axis=1)
        found = []
        for count, strands, is_high in sorted(set(map(tuple, kinds.tolist()))):  # unique rows would load masked arrays
            chosen = np.all(kinds == (count, strands, is_high), axis=1)
            for left, share in _offsets(self.pieces.width, strands):
                where, element = self._points(chosen, count, left, (-aside, aside) if is_high else (0.0,))
                found.append((where, share * element, np.full(len(where), 0.0 if is_high else aside**2)))
        where, elements, clearances = (np.concatenate(column) for column in zip(*found, strict=True))
        return (where, elements), clearances

    def _points(
        self, chosen: NDArray[np.bool_], count: int, left: float, lifts: tuple[float, ...]
    ) -> tuple[Array, Array]:
        # Points (n, 3) and elements (n, 2), shared out to the heights above and below the mid-planes.
        index, low, step = self.index[chosen], self.low[chosen], self.step[chosen]
        nodes, weights = gauss(count)
        where, slope = self.pieces.points(index, low[:, None] + step[:, None] * 0.5 * (1.0 + nodes), left)
        element = slope * (0.5 / len(lifts) * step[:, None] * weights)[..., None]
        height = np.repeat(self.pieces.heights[index], count)[:, None]
        points = [np.concatenate([where.reshape(-1, 2), height + lift], axis=1) for lift in lifts]
        return np.concatenate(points), np.tile(element.reshape(-1, 2), (len(lifts), 1))


def _offsets(width: float, count: int) -> tuple[tuple[float, float], ...]:
    """Distances (m) of strands to the left of the centre line, and their shares."""
    nodes, weights = gauss(count)
    return tuple((0.5 * width * float(x), 0.5 * float(w)) for x, w in zip(nodes, weights, strict=True))


def _halved(own: Pieces, other: Pieces) -> _Halved:
    """Pieces halved until no part is longer than it is far from another winding."""
    index = np.arange(len(own.rows))
    low, step = np.zeros(len(index)), np.ones(len(index))
    lengths = own.lengths
    kept: list[tuple[Index, Array, Array, Array]] = []
    least = math.inf
    for halving in range(HALVINGS):
        middle, _ = own.points(index, (low + 0.5 * step)[:, None], 0.0)
        away = other.distance(middle[:, 0])
        least = min(least, float(away.min()))
        long = lengths[index] * step > LONG * np.maximum(away, 0.25 * own.width)
        if own.is_curved:
            long |= own.rows[index, 5] * step > BEND
        if halving == HALVINGS - 1:
            long[:] = False
        kept.append((index[~long], low[~long], step[~long], away[~long]))
        index, half = np.repeat(index[long], 2), np.repeat(0.5 * step[long], 2)
        low = np.repeat(low[long], 2) + np.tile([0.0, 1.0], int(long.sum())) * half
        step = half
        if not index.size:
            break
    pieces, ends, shares, distances = zip(*kept, strict=True)
    return _Halved(own, np.concatenate(pieces), np.concatenate(ends), np.concatenate(shares),
                   np.concatenate(distances), least)  # fmt: skip
