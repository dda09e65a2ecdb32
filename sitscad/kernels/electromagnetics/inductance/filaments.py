"""Straight filaments: closed Neumann integrals of parallel and inclined filaments, and tracks made of filaments.

Neumann's integral is the double integral of dp.dq / distance along two conductors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.mean_distance import clearance_table
from sitscad.kernels.electromagnetics.special_functions import gauss

FAR = 12.0
"""Least distance of two parallel filaments, divided by the longer length, at which Gauss points are used.

At shorter distances, the closed form is used.
"""

TOUCHING = 1e-12
"""Least distance (m) assumed between two filaments, so that crossing filaments do not cause a division by zero."""

AT_ONCE = 60_000
"""Number of pairs of points and segments processed at once, which fit a processor's cache."""


@record(eq=False)
class PolylineTrack:
    """Track along straight sides.

    `corners` (n, 2; m) are in the direction of the current. `width`, `thickness` and the height `z` of the mid-plane
    are in metres.
    """

    corners: Array
    width: float
    thickness: float
    z: float

    @property
    def length(self) -> float:
        """Length of the centre line (m)."""
        return float(np.sum(np.hypot(*np.diff(self.corners, axis=0).T)))

    def strand(self, offset: float) -> Array:
        """Return the corners (n, 2; m) of a line parallel to the centre line, `offset` (m) to the left.

        The line is mitred at the corners and square at the ends. The mitre is the sum of both normals divided by 1 +
        their scalar product (derived here).
        """
        sides = np.diff(self.corners, axis=0)
        tangents = sides / np.hypot(sides[:, 0], sides[:, 1])[:, None]
        normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
        before, after = np.vstack([normals[:1], normals]), np.vstack([normals, normals[-1:]])
        mitre = (before + after) / (1.0 + np.sum(before * after, axis=1))[:, None]
        return self.corners + offset * mitre


def distances_in_plane(points: Array, starts: Array, ends: Array) -> Array:
    """Return the distances (points, filaments; m) of points from straight filaments in a plane.

    `points` are (points, 1, 2), `starts` and `ends` of the filaments (filaments, 2), in metres.
    """
    span = ends - starts
    offset = points - starts
    part = np.clip(np.sum(offset * span, axis=-1) / np.sum(span * span, axis=-1), 0.0, 1.0)
    return np.asarray(np.hypot(*np.moveaxis(offset - part[..., None] * span, -1, 0)))


def parallel_filaments(length: Array, start: Array, end: Array, distance_squared: Array) -> Array:
    """Return the mutual inductance (H) of parallel straight filaments. The arguments broadcast together.

    Parameters
    ----------
    length : array
        end of the first filament, which runs from 0 along an axis (m)
    start : array
        start of the second filament along this axis (m)
    end : array
        end of the second filament along this axis (m); less than `start` if the current is opposite
    distance_squared : array
        squared distance of the two axes (m2, > 0). For tracks, it is the squared geometric mean distance.

    Notes
    -----
    Neumann's integral in closed form (Grover 1946, chapter 6), or by Gauss points if its four terms would cancel.
    """
    length, start, end, square = np.broadcast_arrays(length, start, end, distance_squared)
    reach = np.maximum(np.abs(length), np.abs(end - start))
    gap = np.maximum(np.maximum(np.minimum(start, end) - length, -np.maximum(start, end)), 0.0)
    distant = square + gap * gap > (FAR * reach) ** 2
    rho = np.sqrt(square)
    result = (_second_integral(end, rho) - _second_integral(start, rho) - _second_integral(end - length, rho)
              + _second_integral(start - length, rho))
    if distant.any():
        nodes, weights = gauss(4)
        u = 0.5 * length[..., None, None] * (1.0 + nodes[:, None])
        v = 0.5 * (start + end)[..., None, None] + 0.5 * (end - start)[..., None, None] * nodes
        summed = np.sum(weights[:, None] * weights / np.sqrt((u - v) ** 2 + square[..., None, None]), axis=(-1, -2))
        result = np.where(distant, 0.25 * length * (end - start) * summed, result)
    return MU0 / (4.0 * math.pi) * result


def _second_integral(u: Array, rho: Array) -> Array:
    """Return the second integral (m) of 1 / sqrt(u^2 + rho^2) over u. Constants cancel in the sum of four terms."""
    return u * np.arcsinh(u / rho) - np.sqrt(u * u + rho * rho)


@record(eq=False)
class SegmentSet:
    """Straight track pieces of one cross-section on one layer.

    `starts` and `ends` (n, 2; m) are along the current. `width`, `thickness` and the mid-plane `z` are in metres.
    """

    starts: Array
    ends: Array
    width: float
    thickness: float
    z: float


def segment_set(tracks: Sequence[PolylineTrack]) -> SegmentSet:
    """Return all straight sides (m) of tracks with equal width, thickness and mid-plane as one set."""
    first = tracks[0]
    starts = np.concatenate([track.corners[:-1] for track in tracks])
    ends = np.concatenate([track.corners[1:] for track in tracks])
    return SegmentSet(starts, ends, first.width, first.thickness, first.z)


def grouped_segments_inductance(sets: Sequence[SegmentSet], groups: Sequence[int]) -> Array:
    """Return the symmetric matrix (groups, groups; H) of partial inductances between groups of straight track pieces.

    `groups[k]` is the group (from 0) of set k. The diagonal holds each group's partial self-inductance.

    Notes
    -----
    Partial inductance: Ruehli, IBM J. Res. Dev. 16, 1972. Each track is one filament that keeps the geometric mean
    distance.
    """
    starts, ends = np.concatenate([s.starts for s in sets]), np.concatenate([s.ends for s in sets])
    sizes = np.cumsum([0, *(len(s.starts) for s in sets)])
    owner = np.repeat(np.asarray(groups), np.diff(sizes))
    # distance of the line through each segment from the middle of each segment (n, n)
    t, _ = _directions((starts, ends))
    normal = np.stack([-t[:, 1], t[:, 0]], axis=1)
    clearance = np.abs(normal @ (0.5 * (starts + ends)).T - np.sum(normal * starts, axis=1)[:, None])
    for i, first in enumerate(sets):
        for j, second in enumerate(sets):
            height = round(abs(first.z - second.z), 12)  # equal heights share a table
            widths = (min(first.width, second.width), max(first.width, second.width))
            thicknesses = (min(first.thickness, second.thickness), max(first.thickness, second.thickness))
            block = slice(sizes[i], sizes[i + 1]), slice(sizes[j], sizes[j + 1])
            clearance[block] = height**2 + np.interp(clearance[block], *clearance_table(height, widths, thicknesses, 1))
    count = max(groups) + 1
    matrix = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1):
            a, b = np.nonzero(owner == i)[0], np.nonzero(owner == j)[0]
            if a.size and b.size:
                p, q = (starts[a], ends[a]), (starts[b], ends[b])
                matrix[i, j] = matrix[j, i] = _segments_mutual(p, q, clearance[np.ix_(a, b)])
    return matrix


Segments = tuple[Array, Array]
"""Starts and ends of straight segments (n, 2 each; m)."""


def _directions(p: Segments) -> tuple[Array, Array]:
    """Return unit vectors (n, 2; no unit) along segments, and the segments' lengths (n; m)."""
    sides = p[1] - p[0]
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    return sides / lengths[:, None], lengths


def _segments_mutual(p: Segments, q: Segments, clearance: Array) -> float:
    """Return the sum of the mutual inductances (H) of all segments of p with all segments of q, in closed form.

    `clearance` (n, m; m2) of each pair is the squared height between them, plus the term that keeps the geometric mean
    distance.
    """
    t, lengths = _directions(p)
    other, _ = _directions(q)
    parallel = np.abs(t[:, :1] * other[:, 1] - t[:, 1:] * other[:, 0]) < 1e-9
    i, j = np.nonzero(parallel)
    axis, to_start, to_end = t[i], q[0][j] - p[0][i], q[1][j] - p[0][i]
    start, end = np.sum(axis * to_start, axis=1), np.sum(axis * to_end, axis=1)
    lateral = axis[:, 0] * to_start[:, 1] - axis[:, 1] * to_start[:, 0]
    square = np.maximum(lateral**2 + clearance[i, j], TOUCHING**2)
    total = float(np.sum(parallel_filaments(lengths[i], start, end, square)))
    cosine = t @ other.T
    i, j = np.nonzero(~parallel & (np.abs(cosine) > 1e-9))
    if i.size:
        total += float(np.sum(cosine[i, j] * _inclined_sides(p, q, other[j], lengths[i], i, j, clearance[i, j])))
    return total


def _inclined_sides(
    p: Segments, q: Segments, axis: Array, lengths: Array, i: Index, j: Index, clearance: Array
) -> Array:
    """Return the mutual inductance (n; H) of inclined sides, divided by the cosine of the angle between them.

    `i` and `j` are the numbers of the sides in p and q. `axis` (n, 2) and `lengths` (n; m) are the directions in q and
    the lengths in p. `clearance` (n; m2) is the squared height. Method: Campbell's form (`inclined_integral`).
    """
    direction = (p[1][i] - p[0][i]) / lengths[:, None]
    sine, cosine = direction[:, 0] * axis[:, 1] - direction[:, 1] * axis[:, 0], np.sum(direction * axis, axis=1)
    offset = q[0][j] - p[0][i]
    # distances along both axes from the point where the two lines cross
    u0 = -(offset[:, 0] * axis[:, 1] - offset[:, 1] * axis[:, 0]) / sine
    v0 = -(offset[:, 0] * direction[:, 1] - offset[:, 1] * direction[:, 0]) / sine
    v1 = v0 + np.sum((q[1][j] - q[0][j]) * axis, axis=1)
    square = np.clip(clearance, TOUCHING**2, None)
    return MU0 / (4.0 * math.pi) * inclined_integral(u0, u0 + lengths, v0, v1, cosine, np.abs(sine), square)


def inclined_integral(
    u0: Array, u1: Array, v0: Array, v1: Array, cosine: Array, sine: Array, square: Array | float
) -> Array:
    """Return the integral of 1/distance (m) over two straight filaments in parallel planes.

    Parameters
    ----------
    u0, u1 : array
        start and end of the first filament (m), from the point at which the axes cross in plan
    v0, v1 : array
        start and end of the second filament (m), from this point
    cosine, sine : array
        cosine and sine of the angle between both axes; the sine is positive
    square : array or float
        squared distance of the planes (m2, > 0)

    Notes
    -----
    Closed form (Campbell 1915; Grover 1946, chapter 7, equation 51), or Gauss points if it cancels.
    """
    height = np.sqrt(square)
    result = np.zeros(np.broadcast(u0, v0, square).shape)
    # 1 - |cosine| without cancellation: the lines of nearly parallel filaments cross far away
    way, bent = np.sign(cosine), sine * sine / (1.0 + np.abs(cosine))
    for u, v, sign in ((u1, v1, 1.0), (u0, v1, -1.0), (u1, v0, -1.0), (u0, v0, 1.0)):
        beyond = u - way * v
        distance = np.sqrt(beyond * beyond + 2.0 * way * u * v * bent + square)
        term = u * np.arcsinh((way * u * bent - way * beyond) / np.sqrt((u * sine) ** 2 + square))
        term += v * np.arcsinh((beyond + way * v * bent) / np.sqrt((v * sine) ** 2 + square))
        term -= height / sine * np.arctan((square * cosine + u * v * sine**2) / (height * distance * sine))
        result += sign * term
    middle = np.hypot(0.5 * (u0 + u1) - 0.5 * (v0 + v1) * cosine, 0.5 * (v0 + v1) * sine)
    apart = middle > 12.0 * np.maximum(np.abs(u1 - u0), np.abs(v1 - v0))
    if apart.any():
        apart = np.broadcast_to(apart, result.shape)
        u0, u1, v0, v1, cosine, square = (
            np.broadcast_to(x, apart.shape)[apart] for x in (u0, u1, v0, v1, cosine, square))
        nodes, weights = gauss(4)
        u = (0.5 * (u0 + u1))[:, None, None] + (0.5 * (u1 - u0))[:, None, None] * nodes[:, None]
        v = (0.5 * (v0 + v1))[:, None, None] + (0.5 * (v1 - v0))[:, None, None] * nodes
        distance = np.sqrt(u * u + v * v - 2.0 * u * v * cosine[:, None, None] + square[:, None, None])
        result[apart] = 0.25 * (u1 - u0) * (v1 - v0) * np.sum(weights[:, None] * weights / distance, axis=(1, 2))
    return result


def via_inductance(length: float, diameter: float) -> float:
    """Return the partial self-inductance (H) of a plated hole's barrel. `length` and `diameter` are in metres.

    Notes
    -----
    The barrel is a tube with its current on the surface. Its mean distance is its radius (Grover 1946): mu0/(2 pi) h
    (asinh(h/r) + r/h - sqrt(1 + (r/h)^2)).
    """
    ratio = 0.5 * diameter / length
    return MU0 / (2.0 * math.pi) * length * (math.asinh(1.0 / ratio) + ratio - math.sqrt(1.0 + ratio * ratio))


def curve_segments_mutual(curve: tuple[Array, Array], segments: SegmentSet, clearance: float) -> float:
    """Return the mutual inductance (H) of a sampled curve with all straight segments of a set (Neumann's integral).

    Parameters
    ----------
    curve : tuple[array, array]
        points (n, 3; m) and line elements (n, 2; m), multiplied by quadrature weights
    segments : SegmentSet
        straight segments, whose potential at each point has a closed form
    clearance : float
            least distance (m) assumed between points and segments. It represents the geometric mean distance of tracks
        that touch.
    """
    points, elements = curve
    parts = slices(len(points), AT_ONCE // max(1, len(segments.starts)))
    total = math.fsum(_weighed_potential(points[part], elements[part], segments, clearance) for part in parts)
    return MU0 / (4.0 * math.pi) * total


def _weighed_potential(points: Array, elements: Array, segments: SegmentSet, clearance: float) -> float:
    """Return the sum (m) of line elements times the vector potential of every segment, without the factor mu0 / (4 pi).

    The elements (n, 2; m) are at points (n, 3; m). `clearance` (m) is the least distance that is assumed. The integral
    of 1 / distance along a segment is asinh(a / rho) + asinh(b / rho) (Grover 1946, chapter 6). Here a and b are the
    distances to its ends along the segment, and rho is the distance from its line.
    """
    sides = segments.ends - segments.starts
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    axis = (sides / lengths[:, None]).T
    normal = np.stack([axis[1], -axis[0]])
    parallel = points[:, :2] @ axis - np.sum(segments.starts.T * axis, axis=0)
    lateral = points[:, :2] @ normal - np.sum(segments.starts.T * normal, axis=0)
    square = lateral**2 + ((points[:, 2] - segments.z) ** 2)[:, None] + max(clearance, TOUCHING) ** 2
    # asinh(a / rho) + asinh(b / rho) as a single logarithm, without cancellation on the segment's axis
    rest = lengths - parallel
    start_sum = np.sqrt(parallel**2 + square) + np.abs(parallel)
    end_sum = np.sqrt(rest**2 + square) + np.abs(rest)
    ahead = np.where(rest < 0.0, start_sum / end_sum, start_sum * end_sum / square)
    ratio = np.where(parallel < 0.0, end_sum / start_sum, ahead)
    return float(np.sum((elements @ axis) * np.log(ratio)))
