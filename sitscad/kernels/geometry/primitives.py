"""Exact distances between many straight and circular track pieces at once, in numpy, in metres and radians.

Arcs are not replaced by chords. The nearest points of two pieces are found in three cases. In the first, the nearest
point of one piece is its end. In the second, both nearest points lie on a line that crosses both pieces at right
angles. For two arcs, this line runs through both centres. For a line and an arc, it runs through the centre. In the
third case, the pieces cross. All cases are evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array, Flags, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Arc, Segment

TWO_PI = 2.0 * np.pi
"""Full turn (rad)."""
_ANGLE_SLACK = 1e-9
"""Angle (rad) beyond the ends of an arc at which a direction still counts as on the arc: rounding."""


@record
class Primitives:
    """Set of n lines and arcs as arrays.

    `start`, `end` and `centre` are (n, 2; m), `radius` (n; m). `angle` (n; rad) is the direction from the centre to the
    start, and `sweep` (n; rad) the signed angle to the end, positive counter-clockwise. For lines, centre, radius,
    angle and sweep are 0. A line with equal ends is a point.
    """

    start: Array
    end: Array
    centre: Array
    radius: Array
    angle: Array
    sweep: Array

    def __len__(self) -> int:
        return len(self.radius)

    def take(self, index: Index) -> Primitives:
        """Return only the pieces with the numbers `index`."""
        return Primitives(*(getattr(self, name)[index] for name in _FIELDS))

    def trimmed(self, first: Array, last: Array) -> Primitives:
        """Return each piece cut to the part between two fractions of its length, `first` and `last` (n; 0 to 1)."""

        def at(fraction: Array) -> Array:
            straight = self.start + fraction[:, None] * (self.end - self.start)
            angle = self.angle + fraction * self.sweep
            on_arc = self.centre + self.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            return np.where(self.radius[:, None] > 0.0, on_arc, straight)

        angle, sweep = self.angle + first * self.sweep, (last - first) * self.sweep
        return Primitives(at(first), at(last), self.centre, self.radius, angle, sweep)

    @property
    def tangents(self) -> tuple[Array, Array]:
        """Unit vectors (n, 2) along each piece at its start and at its end; zero for a point."""

        def at(point: Array) -> Array:
            out = point - self.centre
            turning = np.column_stack([-out[:, 1], out[:, 0]]) * np.sign(self.sweep)[:, None]
            directions = np.where((self.radius > 0.0)[:, None], turning, self.end - self.start)
            size = np.hypot(directions[:, 0], directions[:, 1])
            return directions / np.where(size > 0.0, size, 1.0)[:, None]

        return at(self.start), at(self.end)

    @cached_property
    def boxes(self) -> Array:
        """Bounding boxes (n, 4; m): x_min, y_min, x_max, y_max. They are exact for arcs."""
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        if not np.any(self.radius > 0.0):
            return np.hstack([low, high])
        for quarter, (axis, sign) in enumerate(((0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0))):
            reached = (self.radius > 0.0) & is_within_sweep(quarter * np.pi / 2.0, self.angle, self.sweep)
            extreme = self.centre[:, axis] + sign * self.radius
            side, choose = (high, np.maximum) if sign > 0 else (low, np.minimum)
            side[:, axis] = np.where(reached, choose(side[:, axis], extreme), side[:, axis])
        return np.hstack([low, high])


_FIELDS = ("start", "end", "centre", "radius", "angle", "sweep")
"""Names of the arrays of `Primitives`."""


Row = tuple[float, ...]
"""One line or arc: x0, y0, x1, y1, centre x, centre y, radius (m), start angle, signed sweep (rad)."""


def line_row(x0: float, y0: float, x1: float, y1: float) -> Row:
    """Return the row (see `Row`) of a straight segment (m), or of a point if both ends are equal."""
    return x0, y0, x1, y1, 0.0, 0.0, 0.0, 0.0, 0.0


def path_rows(path: Iterable[Segment]) -> Iterator[tuple[Row, float]]:
    """Yield the row (see `Row`) and the length (m) of each segment of a path."""
    for segment in path:
        if isinstance(segment, Arc):
            sweep, radius = segment.sweep, segment.radius
            row = (*segment.start, *segment.end, *segment.centre, radius, segment.start_angle, sweep)
            yield row, radius * abs(sweep)
        else:
            yield line_row(*segment.start, *segment.end), segment.length


def from_rows(rows: list[Row]) -> Primitives:
    """Return a set of lines and arcs from rows (see `Row`), in m and rad."""
    table = np.array(rows, dtype=float).reshape(-1, 9)
    return Primitives(table[:, 0:2], table[:, 2:4], table[:, 4:6], table[:, 6], table[:, 7], table[:, 8])


def concatenate_primitives(parts: Sequence[Primitives]) -> Primitives:
    """Return all pieces of several sets as one set, in their order."""
    if not parts:
        return from_rows([])
    return Primitives(*(np.concatenate([getattr(part, name) for part in parts]) for name in _FIELDS))


def is_within_sweep(angle: Array | float, start: Array, sweep: Array) -> Flags:
    """Whether a direction (rad) lies on arcs that begin at `start` (rad) and turn by the signed angle `sweep` (rad)."""
    travelled = np.where(sweep >= 0.0, angle - start, start - angle) % TWO_PI
    return (travelled <= np.abs(sweep) + _ANGLE_SLACK) | (travelled >= TWO_PI - _ANGLE_SLACK)


def distances(first: Primitives, second: Primitives) -> Array:
    """Return the smallest distances (n; m) between piece k of the first and piece k of the second set.

    The distance is 0 if the pieces cross.
    """
    result = np.minimum(
        np.minimum(distances_to_points(second, first.start), distances_to_points(second, first.end)),
        np.minimum(distances_to_points(first, second.start), distances_to_points(first, second.end)),
    )
    first_is_arc, second_is_arc = first.radius > 0.0, second.radius > 0.0
    for select, between in (
        (~first_is_arc & ~second_is_arc, _line_line), (~first_is_arc & second_is_arc, _line_arc),
        (first_is_arc & ~second_is_arc, lambda a, b: _line_arc(b, a)), (first_is_arc & second_is_arc, _arc_arc),
    ):
        index = np.flatnonzero(select)
        if index.size:
            result[index] = np.minimum(result[index], between(first.take(index), second.take(index)))
    return result


def distances_to_points(pieces: Primitives, points: Array) -> Array:
    """Return the distances (n; m) from piece k to point k of `points` (n, 2; m)."""
    result = np.empty(len(pieces))
    round_ = pieces.radius > 0.0
    for index, distance in ((np.flatnonzero(~round_), _lines_to_points), (np.flatnonzero(round_), _arcs_to_points)):
        if index.size == len(pieces):
            return distance(pieces, points)
        if index.size:
            result[index] = distance(pieces.take(index), points[index])
    return result


def _lines_to_points(lines: Primitives, points: Array) -> Array:
    """Return the distances (n; m) from line k to point k."""
    spans = lines.end - lines.start
    square = _dot(spans, spans)
    offset = points - lines.start
    t = np.clip(_dot(offset, spans) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.hypot(*(offset - t[:, None] * spans).T))


def _arcs_to_points(arcs: Primitives, points: Array) -> Array:
    """Return the distances (n; m) from arc k to point k."""
    out = points - arcs.centre
    on = _is_towards_arc(arcs, out)
    result = np.abs(np.hypot(out[:, 0], out[:, 1]) - arcs.radius)
    off = np.flatnonzero(~on)
    to_start, to_end = points[off] - arcs.start[off], points[off] - arcs.end[off]
    result[off] = np.minimum(np.hypot(to_start[:, 0], to_start[:, 1]), np.hypot(to_end[:, 0], to_end[:, 1]))
    return np.asarray(result)


def nearest_pairs(
    boxes: Array, reach: Array, other_boxes: Array | None = None, other_reach: Array | None = None
) -> Index:
    """Return pairs of box numbers (m, 2) whose boxes (n, 4; m) touch if each is expanded on all sides.

    Columns of a box: x_min, y_min, x_max, y_max. `reach` (n; m) is the expansion of each box. Without `other_boxes`,
    pairs (i, j) are within one set, with i < j. Otherwise i is a box of the first set and j a box of the second, which
    is expanded by `other_reach`.
    """
    same = other_boxes is None
    second = boxes if same else other_boxes
    grown = boxes + np.column_stack([-reach, -reach, reach, reach])
    margin = reach if same else other_reach
    assert second is not None and margin is not None
    other_grown = second + np.column_stack([-margin, -margin, margin, margin])
    if len(grown) * len(other_grown) <= _FEW:
        i, j = np.nonzero(_boxes_touch(grown, other_grown))
    else:
        blocks = _blocks(grown)
        others_blocks = blocks if same else _blocks(other_grown)
        around = np.array([_enclosing_box(other_grown[block]) for block in others_blocks])
        pairs = []
        for block in blocks:
            near = np.flatnonzero(_boxes_touch(_enclosing_box(grown[block])[None], around)[0])
            if near.size:
                beside = np.concatenate([others_blocks[k] for k in near])
                row, column = np.nonzero(_boxes_touch(grown[block], other_grown[beside]))
                pairs.append((block[row], beside[column]))
        i, j = (np.concatenate([pair[k] for pair in pairs]) if pairs else np.empty(0, dtype=np.intp) for k in (0, 1))
    if same:
        i, j = i[i < j], j[i < j]
    order = np.lexsort((j, i))
    return np.column_stack([i[order], j[order]])


_BLOCK, _FEW = 128, 500_000
"""Number of boxes in a block, and largest number of pairs for which all pairs are compared without blocks."""


def _boxes_touch(boxes: Array, other_boxes: Array) -> Flags:
    """Return flags (n, m) of boxes (n, 4) that touch other boxes (m, 4)."""
    low_x, low, high_x, high = boxes.T[:, :, None]
    other_left, other_low, other_right, other_high = np.ascontiguousarray(other_boxes.T)
    touches = low_x <= other_right
    touches &= high_x >= other_left
    touches &= low <= other_high
    touches &= high >= other_low
    return np.asarray(touches)


def _blocks(boxes: Array) -> list[Index]:
    """Return blocks of at most `_BLOCK` numbers of neighbouring boxes, sorted by the grid cell of each box's middle."""
    middle = 0.5 * (boxes[:, :2] + boxes[:, 2:])
    low, high = middle.min(axis=0), middle.max(axis=0)
    side = max(1, math.isqrt(len(boxes) // 32))
    field = np.minimum((side * (middle - low) / np.maximum(high - low, 1e-300)).astype(np.intp), side - 1)
    order = np.argsort(field[:, 0] * side + field[:, 1], kind="stable")
    return [order[part] for part in slices(len(order), _BLOCK)]


def _enclosing_box(boxes: Array) -> Array:
    """Return the box (4; m) that encloses all boxes (n, 4)."""
    return np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])


def _line_line(first: Primitives, second: Primitives) -> Array:
    """Return 0 if line k of the first set crosses line k of the second, otherwise infinity (n; m)."""
    r, s, q = first.end - first.start, second.end - second.start, second.start - first.start
    cross = _cross(r, s)
    # Rounding leaves a tiny angle between collinear lines, whose crossing point would be arbitrary.
    parallel = np.abs(cross) <= 1e-9 * np.sqrt(_dot(r, r) * _dot(s, s))
    safe = np.where(parallel, 1.0, cross)
    t, u = _cross(q, s) / safe, _cross(q, r) / safe
    hit = ~parallel & (t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0)
    return np.where(hit, 0.0, np.inf)


def _line_arc(line: Primitives, arc: Primitives) -> Array:
    """Return the distances (n; m) of line k from arc k along the perpendicular from the arc's centre to the line.

    The distance is 0 if line and arc cross. It is infinite if the perpendicular misses the line or the arc.
    """
    span = line.end - line.start
    length = np.hypot(span[:, 0], span[:, 1])
    unit = span / np.where(length > 0.0, length, 1.0)[:, None]
    foot_at = _dot(arc.centre - line.start, unit)
    foot = line.start + foot_at[:, None] * unit
    out = foot - arc.centre
    height = np.hypot(out[:, 0], out[:, 1])
    direct = (foot_at >= 0.0) & (foot_at <= length) & _is_towards_arc(arc, out)
    result = np.where(direct, np.abs(height - arc.radius), np.inf)
    half = np.sqrt(np.maximum(0.0, arc.radius**2 - height**2))
    for sign in (-1.0, 1.0):
        at = foot_at + sign * half
        point = line.start + at[:, None] * unit
        hit = (height <= arc.radius) & (at >= 0.0) & (at <= length) & _is_towards_arc(arc, point - arc.centre)
        result = np.where(hit, 0.0, result)
    return result


def _arc_arc(first: Primitives, second: Primitives) -> Array:
    """Return the distances (n; m) of arc k of both sets, measured on the line through their centres.

    The distance is 0 if the arcs cross. It is infinite if the line misses one of the arcs.
    """
    axis = second.centre - first.centre
    apart = np.hypot(axis[:, 0], axis[:, 1])
    unit = np.where(apart[:, None] > 1e-15, axis / np.where(apart > 1e-15, apart, 1.0)[:, None], [1.0, 0.0])
    result = np.full(len(apart), np.inf)
    signs = (-1.0, 1.0)
    faces, other_faces = ([_is_towards_arc(arc, sign * unit) for sign in signs] for arc in (first, second))
    for s1, on in zip(signs, faces, strict=True):
        for s2, other_on in zip(signs, other_faces, strict=True):
            gap = np.abs(apart + s2 * second.radius - s1 * first.radius)
            result = np.where(on & other_on, np.minimum(result, gap), result)
    meets = (apart > 1e-15) & (apart <= first.radius + second.radius) & (apart >= np.abs(first.radius - second.radius))
    index = np.flatnonzero(meets)
    result[index[_arcs_cross(first.take(index), second.take(index), apart[index], unit[index])]] = 0.0
    return result


def _arcs_cross(first: Primitives, second: Primitives, apart: Array, unit: Array) -> Flags:
    """Return flags (n): whether arc k of the first set crosses arc k of the second.

    The full circles must cross. `apart` (n; m) is the distance of the centres, and `unit` (n, 2) the unit vector from
    the first to the second.
    """
    at = (apart**2 + first.radius**2 - second.radius**2) / (2.0 * apart)
    half = np.sqrt(np.maximum(0.0, first.radius**2 - at**2))
    normal = np.column_stack([-unit[:, 1], unit[:, 0]])
    crossed = np.zeros(len(apart), dtype=bool)
    for sign in (-1.0, 1.0):
        offset = at[:, None] * unit + (sign * half)[:, None] * normal
        crossed |= _is_towards_arc(first, offset) & _is_towards_arc(second, offset - (second.centre - first.centre))
    return crossed


def _is_towards_arc(arc: Primitives, direction: Array) -> Flags:
    """Return flags (n): whether a direction (n, 2) from the centre of arc k points to the arc."""
    return is_within_sweep(np.arctan2(direction[:, 1], direction[:, 0]), arc.angle, arc.sweep)


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar products (n) of vectors (n, 2), in the product of their units."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products (n) of vectors (n, 2), in the product of their units."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
