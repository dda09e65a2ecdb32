"""Mutual inductance of windings that lie side by side.

Every side, arc or spiral half turn is halved until each part is short compared with its distance from the other
winding. Each part then gets a few Gauss points. So parts near the other winding are sampled more densely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.clusters import Plans, neumann_sum, plan_numbers
from sitscad.kernels.electromagnetics.inductance.filaments import distances_in_plane
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.inductance.track_strands import Track
from sitscad.kernels.electromagnetics.special_functions import gauss

LONG = 1.5
"""Largest length of a part, divided by its distance from the other winding. Longer parts are halved.

With eight points on such a part, the relative error of the mutual inductance is 1e-7.
"""

BEND = 3.2
"""Largest angle (rad) of a curved part; parts with larger angles are halved."""

POINTS = 8
"""Largest number of Gauss points on a part."""

SHORT = (0.03, 0.15, 0.4, 0.65, 0.9, 1.2)
"""Largest lengths of a part, divided by its distance from the other winding, for 2, 3, 4, 5, 6 and 7 Gauss points.

The relative error is 1e-7.
"""

SLIGHT = (0.1, 0.3, 0.7, 1.2, 1.8, 2.5)
"""Largest angles (rad) of a curved part for 2, 3, 4, 5, 6 and 7 Gauss points. The relative error is 1e-7."""

WIDE = 0.003
"""Track width divided by the winding's radius, above which two strands (filaments) represent a track.

A single strand neglects the term in the square of the width.
"""

NEAR = 0.2
"""Track width divided by a part's distance from the other winding above which three strands represent the track."""

HEADINGS = 128
"""Number of directions in which the extent of a winding's outline is computed, besides the normals of its sides."""

SAMPLED = math.radians(6.0)
"""Angle (rad) between the points of a curve from which a winding's outline is computed."""

DISTANCES = 1 << 16
"""Number of distances between points and pieces computed together: a few megabytes."""

HALVINGS = 14
"""Largest number of times that a piece is halved. It suffices for windings that do not cross."""


@record(eq=False)
class Pieces:
    """Pieces of one kind (straight or curved) of all distinct plans of a winding's layers, in metres and radians.

    `rows` has one row per piece. Columns of straight pieces (n, 8): start x, y, end x, y, then the mitre at the start
    and at the end (x, y each). A mitre is the shift of the end per metre of offset to the left. Columns of curved
    pieces (n, 7): centre x, y, radius and azimuth at the start, direction (+1 counter-clockwise), angle, and fall of
    the radius per radian. `owner` (n) are plan numbers. `width` is the track width.
    """

    rows: Array
    owner: Index
    width: float

    @property
    def is_curved(self) -> bool:
        """Whether the pieces are curved. Otherwise they are straight."""
        return self.rows.shape[1] == 7

    @property
    def lengths(self) -> Array:
        """Length (n; m) of every piece. A spiral piece counts with its radius at the start."""
        if self.is_curved:
            return np.asarray(self.rows[:, 2] * self.rows[:, 5])
        return np.hypot(self.rows[:, 2] - self.rows[:, 0], self.rows[:, 3] - self.rows[:, 1])

    @property
    def angles(self) -> Array:
        """Angle (n; rad) by which every piece turns; 0 for straight pieces."""
        return self.rows[:, 5] if self.is_curved else np.zeros(len(self.rows))

    @property
    def normals(self) -> Array:
        """Directions (n; rad) normal to the straight pieces. Empty for curved pieces."""
        if self.is_curved:
            return np.zeros(0)
        return np.asarray(np.arctan2(self.rows[:, 2] - self.rows[:, 0], self.rows[:, 1] - self.rows[:, 3]))

    def largest_coordinates(self, headings: Array) -> Array:
        """Return the largest coordinate (n; m) of the centre lines along each heading (unit vectors (2, n)).

        The coordinate counts from the origin.
        """
        most = math.ceil(float(self.angles.max()) / SAMPLED)
        parts = np.tile(np.linspace(0.0, 1.0, most + 2), (len(self.rows), 1))
        points, _ = self.points(np.arange(len(self.rows)), parts, 0.0)
        return np.asarray(np.max(points.reshape(-1, 2) @ headings, axis=0))

    def shifted(self, dx: float, dy: float) -> Pieces:
        """Return the pieces shifted by `dx` and `dy` (m)."""
        step = [dx, dy, 0.0, 0.0, 0.0, 0.0, 0.0] if self.is_curved else [dx, dy, dx, dy, 0.0, 0.0, 0.0, 0.0]
        return replace(self, rows=self.rows + np.array(step))

    def points(self, index: Index, s: Array, offset: float) -> tuple[Array, Array]:
        """Return points (k, m, 2; m) on pieces, and their derivatives with respect to the fraction (k, m, 2; m).

        `index` (k) are the numbers of the pieces. The points are at fractions `s` (k, m) of the pieces' length,
        `offset` (m) to the left of the centre line.

        Notes
        -----
        A parallel curve is shorter on the inner side, by the curvature (r^2 + 2 f^2) / (r^2 + f^2)^(3/2) of a spiral
        that falls by f per radian (textbook).
        """
        rows = self.rows[index][:, None, :]
        if not self.is_curved:
            start, end = rows[..., :2] + offset * rows[..., 4:6], rows[..., 2:4] + offset * rows[..., 6:]
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
        shorter = 1.0 - offset * direction * (r * r + 2.0 * fall * fall) / speed**3
        return centre + r[..., None] * outward + offset * normal, step * (shorter * angle)[..., None]

    def distance(self, where: Array) -> Array:
        """Return the least distance (k; m) in the plane of each point (k, 2; m) from the centre lines."""
        if not len(self.rows):
            return np.full(len(where), np.inf)
        least = np.empty(len(where))
        for part in slices(len(where), DISTANCES // len(self.rows)):
            points = where[part, None, :]
            if self.is_curved:
                distances = self._distances_from_curves(points)
            else:
                distances = distances_in_plane(points, self.rows[:, :2], self.rows[:, 2:4])
            least[part] = distances.min(axis=1)
        return least

    def _distances_from_curves(self, p: Array) -> Array:
        """Return the distances (points, pieces; m) from points to spiral pieces.

        Beside a piece it is the radial distance, elsewhere the distance to the nearer end. The slope of the spiral is
        assumed to be small.
        """
        x, y, radius, azimuth, direction, angle, fall = self.rows.T
        dx, dy = p[..., 0] - x, p[..., 1] - y
        turned = direction * (np.arctan2(dy, dx) - azimuth) % (2.0 * math.pi)
        beside = np.abs(np.hypot(dx, dy) - (radius - fall * turned))
        ends = [
            np.hypot(dx - r * np.cos(a), dy - r * np.sin(a))
            for r, a in ((radius, azimuth), (radius - fall * angle, azimuth + direction * angle))
        ]
        return np.where(turned <= angle, beside, np.minimum(*ends))


Layers = tuple[tuple[int, float, float], ...]
"""Rows (plan number, height of the mid-plane (m), thickness (m)), one for each layer."""


def track_pieces(tracks: Sequence[Track]) -> tuple[Pieces, Pieces, Layers]:
    """Return the straight and the curved pieces of a winding's distinct plans (shapes in x and y), and its layers.

    All tracks are assumed to have the width of the first.
    """
    sides = [np.concatenate([t.starts, t.ends, t.before, t.after], axis=1) for t in tracks]
    arcs = [np.concatenate([t.arcs, np.zeros((len(t.arcs), 1))], axis=1) for t in tracks]
    plans = plan_numbers([np.concatenate([a.ravel(), b.ravel()]) for a, b in zip(sides, arcs, strict=True)])
    straight, curved = (_pieces_of_plans(rows, plans, tracks[0].width) for rows in (sides, arcs))
    return straight, curved, _layers(plans, tracks)


def spiral_pieces(layers: Sequence[SpiralLayer]) -> tuple[Pieces, Layers]:
    """Return the half turns (m) of the distinct plans (shapes in x and y) of spiral layers, and the layers.

    The half turns are in the direction of the current. All layers are assumed to have the width of the first.
    """
    rows = [_half_turns(layer) for layer in layers]
    plans = plan_numbers([row.ravel() for row in rows])
    return _pieces_of_plans(rows, plans, layers[0].width), _layers(plans, layers)


def _pieces_of_plans(rows: Sequence[Array], plans: Sequence[int], width: float) -> Pieces:
    """Return the pieces (m) of the first layer with each plan, plan after plan."""
    first = [plans.index(plan) for plan in range(max(plans) + 1)]
    owner = np.repeat(np.arange(len(first)), [len(rows[k]) for k in first])
    return Pieces(np.concatenate([rows[k] for k in first]), owner, width)


def _layers(plans: Sequence[int], layers: Sequence[Track | SpiralLayer]) -> Layers:
    """Return rows (plan number, height of the mid-plane (m), thickness (m)), one for each layer."""
    return tuple((plan, layer.z, layer.thickness) for plan, layer in zip(plans, layers, strict=True))


def _half_turns(layer: SpiralLayer) -> Array:
    """Return a spiral layer as rows (n, 7) of half turns, along the current.

    Columns: centre x, y, radius (m), azimuth (rad), direction (+1 counter-clockwise), angle (rad), fall of the radius
    (m/rad).
    """
    count, slope = max(1, math.ceil(2.0 * layer.turns)), layer.pitch / (2.0 * math.pi)
    step = layer.span / count
    theta = step * np.arange(count)
    if not layer.inward:
        theta = layer.span - theta
    walk = 1.0 if layer.inward else -1.0
    ones = np.ones(count)
    return np.stack([0.0 * ones, 0.0 * ones, layer.radius - slope * theta, layer.angle + layer.sense * theta,
                     walk * layer.sense * ones, step * ones, walk * slope * ones], axis=1)


@record
class SideBySide:
    """Mutual `inductance` (H) of two windings, and their `nearness`.

    The nearness is the track width divided by the least distance of the two windings' centre lines.
    """

    inductance: float
    nearness: float


def spirals_side_by_side(
    first: Sequence[SpiralLayer], second: Sequence[SpiralLayer], displacement: tuple[float, float]
) -> SideBySide:
    """Return the mutual inductance of two round windings in one plane.

    The second winding's centre is `displacement` (x, y; m) away from the first winding's centre.
    """
    (pieces, layers), (other_pieces, other_layers) = spiral_pieces(first), spiral_pieces(second)
    return _side_by_side([pieces], layers, [other_pieces.shifted(*displacement)], other_layers)


def tracks_side_by_side(
    first: Sequence[Track], second: Sequence[Track], displacement: tuple[float, float]
) -> SideBySide:
    """Return the mutual inductance of two windings of straight sides and arcs in one plane.

    The second winding is shifted by `displacement` (x, y; m).
    """
    (*kinds, layers), (*other_kinds, other_layers) = track_pieces(first), track_pieces(second)
    moved = [pieces.shifted(*displacement) for pieces in other_kinds if len(pieces.rows)]
    return _side_by_side([pieces for pieces in kinds if len(pieces.rows)], layers, moved, other_layers)


def _side_by_side(
    first: Sequence[Pieces], layers: Layers, second: Sequence[Pieces], other_layers: Layers
) -> SideBySide:
    """Return the mutual inductance (H) of two windings that do not overlap.

    `first` and `second` are the pieces of both windings, `layers` and `other_layers` their layers. The result is mu0 /
    (4 pi) times Neumann's sum over the points of all parts.
    """
    outline, other_outline = _outline(first), _outline(second)
    parts = [_parts(pieces, other_outline) for pieces in first]
    other_parts = [_parts(pieces, outline) for pieces in second]
    least = min(part.least for part in (*parts, *other_parts))
    total = neumann_sum(_sample_parts(parts, layers), _sample_parts(other_parts, other_layers))
    return SideBySide(MU0 / (4.0 * math.pi) * total, first[0].width / least)


@record(eq=False)
class _WindingOutline:
    """Convex outline of a winding, as its largest coordinate `reach` (n; m) along unit vectors `headings` (2, n)."""

    pieces: Sequence[Pieces]
    headings: Array
    reach: Array

    def distance(self, where: Array) -> Array:
        """Return the distance (k; m) of points (k, 2; m) from the outline.

        Points inside the outline get the distance from the nearest centre line.
        """
        distance = np.max(where @ self.headings - self.reach, axis=1)
        inside = distance <= 0.0
        if inside.any():
            distance[inside] = np.min([pieces.distance(where[inside]) for pieces in self.pieces], axis=0)
        return np.asarray(distance)


def _outline(winding: Sequence[Pieces]) -> _WindingOutline:
    """Return a winding's convex outline (m), from `HEADINGS` directions all round and the normals of its sides."""
    angle = 2.0 * math.pi / HEADINGS * np.arange(HEADINGS)
    across = np.array(sorted({round(normal, 6) for pieces in winding for normal in pieces.normals.tolist()}))
    angle = np.concatenate([angle, across, across + math.pi])
    headings = np.stack([np.cos(angle), np.sin(angle)])
    reach = np.max([pieces.largest_coordinates(headings) for pieces in winding], axis=0)
    return _WindingOutline(winding, headings, reach)


@record(eq=False)
class _Parts:
    """Parts of pieces after halving.

    For each part (arrays (n)): piece number `index`, start `low` and length `step` as fractions of the piece, number of
    points `counts`, number of strands `strands`. `least` (m) is the least distance of any part's middle from the other
    winding.
    """

    pieces: Pieces
    index: Index
    low: Array
    step: Array
    counts: Index
    strands: Index
    least: float


def _parts(pieces: Pieces, other: _WindingOutline) -> _Parts:
    """Return pieces (m) halved until each part is short and straight enough for its distance from the other winding."""
    index = np.arange(len(pieces.rows))
    low, step = np.zeros(len(index)), np.ones(len(index))
    batches, least = [], math.inf
    for halving in range(HALVINGS):
        middle, _ = pieces.points(index, (low + 0.5 * step)[:, None], 0.0)
        distance = other.distance(middle[:, 0])
        least = min(least, float(distance.min()))
        ratio = pieces.lengths[index] * step / np.maximum(distance, 0.25 * pieces.width)
        angle = pieces.angles[index] * step
        long = (ratio > LONG) | (angle > BEND)
        if halving == HALVINGS - 1:
            long[:] = False
        counted = index, low, step, _point_counts(ratio, angle), _strand_counts(pieces, distance)
        batches.append([table[~long] for table in counted])
        index, half = np.repeat(index[long], 2), np.repeat(0.5 * step[long], 2)
        low = np.repeat(low[long], 2) + np.tile([0.0, 1.0], int(long.sum())) * half
        step = half
        if not index.size:
            break
    index, low, step, counts, strands = (np.concatenate(tables) for tables in zip(*batches, strict=True))
    return _Parts(pieces, index, low, step, counts, strands, least)


def _point_counts(ratio: Array, angle: Array) -> Index:
    """Return the numbers of Gauss points (n; no unit) on parts.

    `ratio` (n) is the length of each part divided by its distance from the other winding, `angle` (n; rad) its angle.
    """
    counts = np.maximum(np.searchsorted(SHORT, ratio), np.where(angle > 0.0, np.searchsorted(SLIGHT, angle), 0)) + 2
    return np.minimum(counts, POINTS)


def _strand_counts(pieces: Pieces, distances: Array) -> Index:
    """Return the number of strands (n; no unit) for each part, from the track width and the part's distance.

    `distances` (n; m) are the distances of the parts from the other winding.
    """
    size = float(pieces.rows[:, 2].max()) if pieces.is_curved else 0.5 * float(pieces.lengths.max())
    return np.where(pieces.width > NEAR * distances, 3, 2 if pieces.width > WIDE * size else 1)


def _sample_parts(parts: Sequence[_Parts], layers: Layers) -> Plans:
    """Return all parts as points (m), line elements (m) and plan numbers, with the layers of their winding."""
    samples = [
        _sample_points(part, count, strands)
        for part in parts
        for count, strands in sorted(set(zip(part.counts.tolist(), part.strands.tolist(), strict=True)))
    ]
    places, elements, owners = (np.concatenate(tables) for tables in zip(*samples, strict=True))
    return Plans(places, elements, owners, layers)


def _sample_points(parts: _Parts, count: int, strands: int) -> tuple[Array, Array, Index]:
    """Return points (n, 2; m), line elements (n, 2; m) and plan numbers (n) on some parts.

    These are the parts with `count` quadrature points and `strands` strands.
    """
    chosen = (parts.counts == count) & (parts.strands == strands)
    index, low, step = parts.index[chosen], parts.low[chosen, None], parts.step[chosen, None]
    (nodes, weights), (across, strand_weights) = gauss(count), gauss(strands)
    samples = []
    for x, strand_weight in zip(across.tolist(), strand_weights.tolist(), strict=True):
        where, slope = parts.pieces.points(index, low + step * 0.5 * (1.0 + nodes), 0.5 * parts.pieces.width * x)
        element = slope * (0.25 * strand_weight * step * weights)[..., None]
        samples.append((where.reshape(-1, 2), element.reshape(-1, 2)))
    owner = np.tile(np.repeat(parts.pieces.owner[index], count), strands)
    return np.concatenate([where for where, _ in samples]), np.concatenate([element for _, element in samples]), owner
