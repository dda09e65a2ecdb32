"""Direct current at the corners of a winding: it crowds to the inside, which lowers resistance and inductance.

The model is an even current, mitred at every corner, plus a loop of current at each corner (`corner_excess`). The loop
changes the inductance in two ways. Its coupling with itself and its two arms is from a table. Its coupling with the
rest of the winding is from the winding's flux through the loop. Alternating current along the sides is added by
`bent_tracks`. Its further effect at a bend is one relaxation for each bend.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from sitscad.basics.arrays import Array, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import distances_in_plane
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.corner_excess import (
    TIGHT,
    Loops,
    bend_relaxation,
    corner_moment,
    corner_points,
    gentle_bend_inductance,
    gentle_bend_squares,
    own_inductance,
    tight_bend_squares,
)
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.resistance import bend_squares
from sitscad.kernels.electromagnetics.special_functions import gauss

LEAST_TURN = 1e-3
"""Least angle (rad) between two straight pieces at which their joint counts as a corner."""

MOST_TURN = math.radians(120.0)
"""Largest turn (rad) of an arc between straight sides that counts as a rounded corner.

Arcs that turn more are curves of their own.
"""

OPEN = 1.3
"""Radius of an arc between sides, divided by the width, above which alternating current treats it as an arc.

For smaller radii, the arc counts as a corner, or as a mixture of a corner and an arc. Between the last of `TIGHT` and
this radius, current crowds to the inner edge faster than the modes of a slender arc can describe.
"""

NEAR = 4.0
"""Largest distance between a current loop and a side, divided by the width, at which both have a finite size.

At larger distances, the loop is a dipole and the side is a filament.
"""

NEAR_SIDE_FILAMENTS = 4
"""Number of filaments across the width of a side nearer than `NEAR` to a loop."""

CHORD = math.radians(15.0)
"""Largest angle (rad) of the pieces into which an arc is divided, for its field and for its loops."""

FAR_METAL = 1.0
"""Least distance of metal, divided by the track width, at which a single point represents a loop."""

SPREAD = 0.14
"""Standard deviation, divided by the width, of the Gaussian at each of the eight points that represent a loop.

With it, two loops above each other have the mutual inductance of the conformal map, within 1 % from 0.3 to 1 width
(tests/validation/corner_flow.py).
"""

SPREAD_WHOLE = 0.34
"""Standard deviation, divided by the width, of the Gaussian at the single point that represents a loop.

It is used for metal at `FAR_METAL` or farther.
"""

BLOCK = 40_000
"""Number of pairs of corners and sides evaluated together."""


@record(eq=False)
class Corners:
    """Loops of current at tight bends, one row for each bend.

    `middle` (n, 2; m) and `height` (n; m) locate the loops. `moment` (n; m2) is the magnetic moment divided by the
    current, positive upwards. `places` (n, 8, 2; m) and `weights` (n, 8) distribute the moments. `width` (n; m) is the
    track's width. `self_inductance` (n; H) is the inductance of each loop with itself and its two arms. `arms` (n, 2)
    are the indices of these arms among the filaments.
    """

    middle: Array
    height: Array
    moment: Array
    places: Array
    weights: Array
    width: Array
    self_inductance: Array
    arms: Index


@record(eq=False)
class MitredFilaments:
    """Straight pieces of all tracks, with arcs as chords.

    `start` and `end` are (n, 2; m). The mitres `before` and `after` (n, 2) are the shifts of both ends per metre of
    offset to the left. `height` and `width` are (n; m).
    """

    start: Array
    end: Array
    before: Array
    after: Array
    height: Array
    width: Array


def with_corners(loss: ProximityLoss, tracks: Sequence[BentTrack], conductivity: float) -> ProximityLoss:
    """Return the loss of a winding with the effect of its corners on direct and on alternating current.

    `tracks` are the real tracks. `loss` is the loss of these tracks with tight arcs replaced by sharp corners
    (`with_mitred_arcs`). The conductivity is in S/m.
    """
    # What alternating current makes less of the bends' inductance (H), and relaxation times (s), alike ones as one.
    counts: dict[tuple[float, float, float, float], int] = {}
    for track in tracks:
        for bend in _bends(track):
            if bend.is_between_sides:
                key = round(abs(bend.turn), 6), track.width, track.thickness, round(bend.radius, 6)
                counts[key] = counts.get(key, 0) + 1
    rows = [(count * lost, time) for key, count in counts.items() for lost,
            time in [bend_relaxation(*key, conductivity)]]
    lost, times = np.array(rows).reshape(-1, 2).T
    return replace(loss, direct=math.fsum(direct_resistance(track, conductivity) for track in tracks),
                   direct_change=loss.direct_change + corner_inductance(tracks),
                   rates=np.concatenate([loss.rates, times]),
                   strengths=np.concatenate([loss.strengths, lost * times]))


def direct_resistance(track: BentTrack, conductivity: float) -> float:
    """Return the resistance (ohm) of a track for direct current, with corners by `corner_excess`.

    A square is a piece as long as wide. In an arc of the angle a, the current is proportional to 1 / radius, so the arc
    has a / ln(outer / inner radius) squares (textbook). The conductivity is in S/m.
    """
    length = float(np.sum(_lengths(track)[track.turns == 0.0]))
    for bend in _bends(track):
        if bend.radius == 0.0:
            squares = bend_squares(round(abs(bend.turn), 6))
        elif bend.is_tight:
            squares = tight_bend_squares(bend.turn, bend.radius)
        elif bend.is_between_sides:
            squares = gentle_bend_squares(bend.turn, bend.radius)
        else:
            half = 0.5 / max(bend.radius, TIGHT[-1])
            squares = abs(bend.turn) * bend.radius * half / math.atanh(half)
        length += squares * track.width
    return length / (conductivity * track.width * track.thickness)


def with_mitred_arcs(track: BentTrack) -> BentTrack:
    """Return the track (m) with sharp corners instead of arcs that are tight enough to count as corners."""
    starts, ends, is_side = track.starts.copy(), track.ends.copy(), np.ones(len(track.turns), dtype=bool)
    for bend in _bends(track):
        if bend.is_tight and bend.radius:
            is_side[bend.piece] = False
            ends[bend.piece - 1] = starts[bend.piece + 1] = bend.corner
    return replace(track, starts=starts[is_side], ends=ends[is_side], turns=track.turns[is_side])


def enclosing_tracks(tracks: Sequence[BentTrack]) -> tuple[float, tuple[BentTrack, ...], tuple[BentTrack, ...]]:
    """Return two variants of tracks (m) that enclose arcs with radii between `TIGHT` and `OPEN`, and a weight.

    In the first variant, each such arc is a corner. In the second, it has the radius `OPEN`. The weight of the second
    (0 to 1) follows from the mean radius. It is 0 if the sides are too short for open arcs. The returned order is
    weight, first, second.
    """
    between = [[b for b in _bends(track) if b.is_between_sides and TIGHT[-1] <= b.radius < OPEN] for track in tracks]
    radii = [bend.radius for bends in between for bend in bends]
    if not radii:
        return 0.0, tuple(tracks), tuple(tracks)
    share = (float(np.mean(radii)) - TIGHT[-1]) / (OPEN - TIGHT[-1])
    cornered = tuple(_with_radius(t, bends, TIGHT[-1] * (1.0 - 1e-9)) for t, bends in zip(tracks, between, strict=True))
    wide = tuple(_with_radius(t, bends, OPEN) for t, bends in zip(tracks, between, strict=True))
    # straight sides must keep their directions
    forwards = all(np.all(np.sum((a.ends - a.starts) * (b.ends - b.starts), axis=1)[a.turns == 0.0] > 0.0)
                   for a, b in zip(tracks, wide, strict=True))
    return (share, cornered, wide) if forwards else (0.0, cornered, cornered)


def _with_radius(track: BentTrack, bends: Sequence[_TrackBend], radius: float) -> BentTrack:
    """Return the track (m) with some bends rounded by another `radius`, which is divided by the width.

    The tangents of a bend are r tan(turn / 2) long.
    """
    starts, ends = track.starts.copy(), track.ends.copy()
    for bend in bends:
        k, corner = bend.piece, np.array(bend.corner)
        onwards = radius * track.width * math.tan(0.5 * abs(bend.turn))
        incoming, outgoing = corner - track.starts[k - 1], track.ends[k + 1] - corner
        ends[k - 1] = starts[k] = corner - onwards * incoming / np.hypot(*incoming)
        starts[k + 1] = ends[k] = corner + onwards * outgoing / np.hypot(*outgoing)
    return replace(track, starts=starts, ends=ends)


def corner_inductance(tracks: Sequence[BentTrack]) -> float:
    """Return the inductance (H) of direct current in tracks minus the inductance of a uniform current.

    The tracks are in series. The uniform current is constant across the sides and mitred at corners.

    Notes
    -----
    For the loops of `corner_excess` it is twice their moments times the field at their places (reciprocity), plus their
    own inductance.
    """
    arcs = math.fsum(gentle_bend_inductance(bend.turn, track.width, track.thickness, bend.radius)
                     for track in tracks for bend in _bends(track)
                     if bend.is_between_sides and not bend.is_tight)
    corners = _corners(tracks)
    if not len(corners.width):
        return arcs
    parts = [_chord_arrays(track) for track in tracks]
    filaments = MitredFilaments(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    field = np.zeros(corners.width.size)
    pairs: list[tuple[Index, Index]] = []
    for part in slices(field.size, BLOCK // len(filaments.start)):
        point = corners.middle[part, None]
        far_field = normal_field(point, corners.height[part, None], filaments.start, filaments.end, filaments.height)
        near = distances_in_plane(point, filaments.start, filaments.end) < NEAR * corners.width[part, None]
        numbers = np.arange(len(filaments.start))
        near |= (numbers >= corners.arms[part, :1]) & (numbers <= corners.arms[part, 1:])
        field[part] = np.sum(np.where(near, 0.0, far_field), axis=1)
        i, j = np.nonzero(near)
        pairs.append((part.start + i, j))
    first, second = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
    for part in slices(first.size, BLOCK):
        i, j = first[part], second[part]
        np.add.at(field, i, _near_side_field(filaments, corners, i, j))
    through = 2.0 * float(np.sum(corners.moment * field))
    return arcs + float(np.sum(corners.self_inductance)) + through + _mutual_inductances(corners)


def bend_loops(track: BentTrack, nearest: float) -> Loops:
    """Return loops of direct current at the bends of a track, for metal at least `nearest` (m) away.

    Each corner is represented by eight points, or by one if the metal is far enough. In an arc the current is
    proportional to 1 / radius. This is a moment of width^2 / 12 for every radian, independent of the radius (derived
    here).
    """
    whole, width = nearest > FAR_METAL * track.width, track.width
    places, moments = [np.zeros((0, 2))], [np.zeros(0)]
    for bend in _bends(track):
        if bend.is_tight:
            middle, _, size, eight, loop_parts, _, _ = _corner(track, bend)
            places.append(middle[None] if whole else eight)
            moments.append(np.array([size]) if whole else size * loop_parts)
        elif bend.radius:
            k, count = bend.piece, max(1, math.ceil(abs(bend.turn) / CHORD))
            on = [_point_on_arc(track.starts[k], track.ends[k], bend.turn, (i + 0.5) / count) for i in range(count)]
            places.append(np.array(on))
            moments.append(np.full(count, -bend.turn * width * width / (12.0 * count)))
    return Loops(np.concatenate(places), np.concatenate(moments), (SPREAD_WHOLE if whole else SPREAD) * width)


@record
class _TrackBend:
    # A bend of a track: the number of its arc, or of the side after a sharp corner; angle (rad, positive to the left),
    # radius of the centre line over the width, where its sides would meet, whether it has sides on both ends. Angle and
    # radius to nine digits: bends that are alike in every turn are looked up once.
    piece: int
    turn: float
    radius: float
    corner: tuple[float, float]
    is_between_sides: bool

    @property
    def is_tight(self) -> bool:
        """Whether the bend counts as a corner: it lies between sides, with a radius below the last of `TIGHT`."""
        return self.is_between_sides and self.radius < TIGHT[-1]


def _lengths(track: BentTrack) -> Array:
    """Return the lengths (n; m) of the pieces of a track. For an arc, it is the length of the chord."""
    return np.asarray(np.hypot(*(track.ends - track.starts).T))


@lru_cache(maxsize=64)
def _bends(track: BentTrack) -> tuple[_TrackBend, ...]:
    """Return the bends of a track: corners and arcs, each with its turn (rad) and its radius divided by the width."""
    step = track.ends - track.starts
    heading, straight = np.arctan2(step[:, 1], step[:, 0]), track.turns == 0.0
    turn = np.remainder(np.diff(heading) + math.pi, 2.0 * math.pi) - math.pi
    bends = []
    for k in np.nonzero(straight[:-1] & straight[1:] & (np.abs(turn) > LEAST_TURN))[0]:
        bends.append(_TrackBend(int(k) + 1, round(float(turn[k]), 9), 0.0, tuple(track.ends[k].tolist()), True))
    chords = _lengths(track)
    for k in np.nonzero(~straight)[0]:
        angle = float(track.turns[k])
        radius = float(chords[k]) / (2.0 * math.sin(0.5 * abs(angle)))
        sides = 0 < k < len(straight) - 1 and bool(straight[k - 1] and straight[k + 1]) and abs(angle) < MOST_TURN
        onwards = radius * math.tan(0.5 * abs(angle)) if sides else 0.0
        corner = track.starts[k] + onwards * step[k - 1] / chords[k - 1]
        bends.append(
            _TrackBend(int(k), round(angle, 9), round(radius / track.width, 9), tuple(corner.tolist()), bool(sides))
        )
    return tuple(bends)


def _corners(tracks: Sequence[BentTrack]) -> Corners:
    """Return the current loops (m, m2, H) at all tight bends of the tracks."""
    rows, arms, first = [], [], 0
    for track in tracks:
        numbers = first + np.concatenate([[0], np.cumsum(_chords(track))])
        first = int(numbers[-1])
        for bend in _bends(track):
            if bend.is_tight:
                rows.append(_corner(track, bend))
                # straight sides are one piece each, the chords of a tight arc lie between them
                arms.append((numbers[bend.piece - 1], numbers[bend.piece + (1 if bend.radius else 0)]))
    columns = [np.array(column) for column in zip(*rows, strict=True)] if rows else [np.zeros((0, 2))] * 7
    return Corners(*[*columns, np.array(arms, dtype=np.intp).reshape(-1, 2)])


def _corner(track: BentTrack, bend: _TrackBend) -> tuple[Array, float, float, Array, Array, float, float]:
    """Return the loop of one bend: middle, height, moment (m2), places, weights, width (m) and own inductance (H).

    `middle` (2; m) and `places` (8, 2; m) are positions, `weights` (8) have no unit.
    """
    w, here, after = track.width, np.array(bend.corner), bend.piece + (1 if bend.radius else 0)
    incoming, outgoing = here - track.starts[bend.piece - 1], track.ends[after] - here
    inwards = outgoing / np.hypot(*outgoing) - incoming / np.hypot(*incoming)
    inwards = inwards / np.hypot(*inwards)
    table = corner_points(bend.turn, bend.radius)
    places = here + w * (table[:, :1] * inwards + table[:, 1:2] * np.array([-inwards[1], inwards[0]]))
    # to the left the loop runs clockwise, seen from above
    size = -math.copysign(corner_moment(bend.turn, bend.radius), bend.turn) * w * w
    own_part = own_inductance(bend.turn, w, track.thickness, bend.radius)
    return table[:, 2] @ places, track.z, size, places, table[:, 2], w, own_part


def _chords(track: BentTrack) -> Index:
    """Return the number of chords (n) of each piece: one for each `CHORD` of its turning angle."""
    return np.maximum(1, np.ceil(np.abs(track.turns) / CHORD)).astype(np.intp)


def _chord_arrays(track: BentTrack) -> tuple[Array, ...]:
    """Return a track as chords: starts and ends (n, 2; m), mitres at both (n, 2), heights and widths (n; m)."""
    nodes = [track.starts[0]]
    for start, end, turn, count in zip(track.starts, track.ends, track.turns, _chords(track), strict=True):
        nodes += [_point_on_arc(start, end, turn, k / count) for k in range(1, count)]
        nodes.append(end)
    line = np.array(nodes)
    t = np.diff(line, axis=0)
    t = t / np.hypot(t[:, 0], t[:, 1])[:, None]
    normals = np.stack([-t[:, 1], t[:, 0]], axis=1)
    inner = (normals[:-1] + normals[1:]) / (1.0 + np.sum(normals[:-1] * normals[1:], axis=1))[:, None]
    mitres = np.concatenate([normals[:1], inner, normals[-1:]])
    return line[:-1], line[1:], mitres[:-1], mitres[1:], np.full(len(t), track.z), np.full(len(t), track.width)


def _point_on_arc(start: Array, end: Array, turn: float, fraction: float) -> Array:
    """Return the point (2; m) at a fraction of the angle of an arc, which turns by `turn` (rad).

    It follows from length and direction of the chord up to the point.
    """
    span = end - start
    chord = math.sin(0.5 * turn * fraction) / math.sin(0.5 * turn)
    angle = 0.5 * turn * (fraction - 1.0)
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(start + chord * np.array([c * span[0] - s * span[1], s * span[0] + c * span[1]]))


def _near_side_field(filaments: MitredFilaments, corners: Corners, i: Index, j: Index) -> Array:
    """Return the field (n; T/A) of sides with finite width, averaged over loops.

    `i` and `j` are the numbers of the loop and the side of each pair. Biot and Savart for `NEAR_SIDE_FILAMENTS`
    filaments. A loop's own arms are infinite filaments.
    """
    total = np.zeros(i.size)
    incoming, outgoing = (np.nonzero(corners.arms[i, k] == j)[0] for k in (0, 1))
    within = (corners.arms[i, 0] < j) & (j < corners.arms[i, 1])
    nodes, weights = gauss(NEAR_SIDE_FILAMENTS)
    for x, weight in zip(nodes, weights, strict=True):
        offset = 0.5 * x * filaments.width[j][:, None]
        start = filaments.start[j] + offset * filaments.before[j]
        end = filaments.end[j] + offset * filaments.after[j]
        for place, share in zip(np.swapaxes(corners.places, 0, 1), corners.weights.T, strict=True):
            here = place[i]
            field = normal_field(here, corners.height[i], start, end, filaments.height[j])
            # an endless arm has more, beyond its far end, than the real one; the incoming one's current runs inwards
            for arms, far_ends, inner, sign in ((incoming, start, end, 1.0), (outgoing, end, start, -1.0)):
                field[arms] = sign * _half_infinite_field(here[arms], far_ends[arms], far_ends[arms] - inner[arms])
            field[within] = 0.0
            total += 0.5 * weight * share[i] * field
    return total


def normal_field(point: Array, height: Array, start: Array, end: Array, level: Array) -> Array:
    """Return the normal field (T/A) of straight filaments at points (..., 2; m) and heights (m).

    The filaments run from `start` to `end` (..., 2; m) at the height `level` (m). All arguments broadcast together.
    Biot and Savart; Jackson, Classical Electrodynamics, section 5.2. Beyond the ends of a filament no difference of
    nearly equal numbers occurs.
    """
    span = end - start
    length = np.hypot(span[..., 0], span[..., 1])
    t = span / length[..., None]
    offset = point - start
    parallel = np.sum(offset * t, axis=-1)
    lateral = t[..., 0] * offset[..., 1] - t[..., 1] * offset[..., 0]
    square = np.maximum(lateral**2 + (height - level) ** 2, 1e-12 * length**2)
    rest = length - parallel
    start_distance, end_distance = np.sqrt(parallel**2 + square), np.sqrt(rest**2 + square)
    beside = np.where((parallel >= 0.0) & (rest >= 0.0), 2.0 / square, 0.0)
    ends = np.copysign(1.0, parallel) / (start_distance * (start_distance + np.abs(parallel)))
    ends += np.copysign(1.0, rest) / (end_distance * (end_distance + np.abs(rest)))
    return np.asarray(MU0 / (4.0 * math.pi) * lateral * (beside - ends))


def _half_infinite_field(point: Array, end: Array, way: Array) -> Array:
    """Return the field (n; T/A), in its own plane, of a half-infinite filament that starts at `end` (n, 2; m).

    It runs along `way` (n, 2), as does its current (Biot and Savart).
    """
    t = way / np.hypot(way[:, 0], way[:, 1])[:, None]
    offset = point - end
    back = -np.sum(offset * t, axis=1)
    lateral = t[:, 0] * offset[:, 1] - t[:, 1] * offset[:, 0]
    distance = np.sqrt(back**2 + lateral**2)
    return np.asarray(MU0 / (4.0 * math.pi) * lateral / (distance * (distance + back)))


def _mutual_inductances(corners: Corners) -> float:
    """Return twice the sum of mutual inductances (H) of different loops, as dipoles.

    The height between dipoles (Jackson, Classical Electrodynamics, equation 5.56) is lengthened so that coaxial loops
    have the value of the conformal map (fitted, tests/validation/corner_flow.py).
    """
    total = 0.0
    for k in range(corners.width.size - 1):
        rest = slice(k + 1, None)
        distance = np.hypot(*(corners.middle[rest] - corners.middle[k]).T)
        near = distance < NEAR * corners.width[k]
        distance, rise = distance[near], np.abs(corners.height[rest][near] - corners.height[k]) / corners.width[k]
        clear = corners.width[k] * (rise + 0.53 / (1.0 + 0.75 * rise))
        product = corners.moment[k] * corners.moment[rest][near]
        total += float(np.sum(product * (2.0 * clear**2 - distance**2) / (clear**2 + distance**2) ** 2.5))
    return MU0 / (2.0 * math.pi) * total
