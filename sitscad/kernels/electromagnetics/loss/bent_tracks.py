"""Skin and proximity effect of windings of straight sides and arcs: polygons, rectangles, racetracks.

Sides of one direction lie side by side. The same planes cut them, at equal fractions of their lengths. Eddy currents
are driven by the field of the whole real path, as straight filaments in closed form, so corners and ends are included.
An arc is divided into a few chords, each a side of its own with the curvature of the arc.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.loss.current_modes import (
    ProximityLoss,
    join_losses,
    losses,
    mode_system,
    path_drive,
)
from sitscad.kernels.electromagnetics.loss.path_field import Filaments, box_around_points, path_field
from sitscad.kernels.electromagnetics.loss.proximity import arc_field, ring_inductance_without_logarithm
from sitscad.kernels.electromagnetics.loss.track_modes import (
    Cut,
    ModeSet,
    field_nodes,
    flux_to_points,
    gauss_point_positions,
)
from sitscad.kernels.electromagnetics.special_functions import gauss

BLOCK = math.radians(30.0)
"""Largest angle (rad) of the blocks into which arcs are divided.

A block is an odd number of chords. One plane cuts it, in the middle chord.
"""

ROUND = math.radians(200.0)
"""Total angle (rad) by which consecutive arcs turn, above which their blocks begin at fixed directions.

With fixed directions, blocks of different turns lie side by side. Consecutive arcs that turn less, such as rounded
corners and half circles, are divided into equal parts. The parts of different turns then need not lie side by side.
"""

ABREAST = math.radians(5.0)
"""Largest difference of directions (rad) at which sides belong to one group. The same planes cut a group."""

DISTANT = 1.5
"""Least distance of a block of arcs from a plane, divided by the block's length, at which fewer chords are used.

A third of the block's chords then represents the block.
"""

TIGHTEST = 0.7
"""Least radius of an arc's centre line, divided by the width. Tighter arcs get the current density of this radius.

At a radius of 0.5 the inner edge is a point that would take the whole current. Tighter arcs between straight sides are
corners (`corners.with_mitred_arcs`).
"""

LEAST_CORNER_DISTANCE = 0.4
"""Least distance between a plane and the filament of a side in another direction, divided by the track width.

Sides in other directions lie beyond a corner. The distance represents the width of their tracks. With it, the squared
field beyond a corner, summed over a side, is right for distances from half a width.
"""


@record(eq=False)
class BentTrack:
    """One layer's track as pieces along the current, either straight or arcs.

    `starts` and `ends` (n, 2; m) are the ends of the pieces. `turns` (n; rad) is the angle by which each piece turns: 0
    for straight pieces, positive to the left. `width`, `thickness` and the height `z` of the mid-plane are in metres.
    """

    starts: Array
    ends: Array
    turns: Array
    width: float
    thickness: float
    z: float

    @property
    def length(self) -> float:
        """Length of the centre line (m).

        For an arc, it is the chord times half the angle divided by this angle's sine.
        """
        half = np.maximum(0.5 * np.abs(self.turns), 1e-9)
        return float(np.sum(np.hypot(*(self.ends - self.starts).T) * half / np.sin(half)))


@record(eq=False)
class _Sides:
    # Straight sides of all tracks: `key` numbers the groups that lie abreast (-1: seen, never cut); `heading` are
    # their directions (rad, from the first one's); `block` numbers the blocks of arcs, and sides. `chords` are the same
    # with a third of the chords; `middle` (blocks, 2) and `reach` (blocks; m) say where blocks lie and how long they
    # are.
    start: Array
    end: Array
    section: Array
    length: Array
    curvature: Array
    key: Index
    heading: list[float]
    block: Index
    chords: _Chords
    middle: Array
    reach: Array


@record(eq=False)
class _Chords:
    # Straight filaments: ends (n, 2), heights and widths (n; m), and the numbers of their blocks.
    start: Array
    end: Array
    height: Array
    width: Array
    block: Index


def bent_winding_loss(tracks: Sequence[BentTrack], conductivity: float, modes: ModeSet, cuts: int, steps: int,
                      repetitions: int = 1) -> ProximityLoss:
    """Return the resistance and inductance (ohm, H) by frequency of tracks in series, with skin and proximity effect.

    Parameters
    ----------
    tracks : sequence of BentTrack
        layers of the winding
    conductivity : float
        S/m
    modes : ModeSet
        current modes of each cross-section
    cuts : int
        number of planes that cut each straight side, an even number
    steps : int
        largest number of steps of the Lanczos recursion
    repetitions : int
            number of congruent parts of the winding; only one part is computed, and the result is scaled. With 2, only
        sides with a heading below 180 degrees are computed, relative to the first side. With 4, only one half of each
        of these sides is computed, in turn the half at the start and the half at the end.

    Notes
    -----
    Partial elements of modes (Ruehli 1974; `current_modes`).
    """
    sides = _sides(tracks)
    parts = []
    for key in range(int(sides.key.max()) + 1):
        index = np.nonzero(sides.key == key)[0]
        if repetitions == 1 or sides.heading[key] < math.pi - 1e-3:
            half = key % 2 if repetitions == 4 else None
            parts += _group_losses(sides, index, cuts, conductivity, modes, steps, half)
    loss = join_losses(parts)
    if repetitions == 1:
        return loss
    area = sides.section[:, 1] * sides.section[:, 2]
    whole = float(np.sum((sides.length / area)[sides.key >= 0])) / conductivity
    return loss.scaled(whole)


def _group_losses(sides: _Sides, index: Index, cuts: int, conductivity: float, modes: ModeSet,
                  steps: int, end: int | None) -> list[ProximityLoss]:
    """Return the losses (ohm, H) of a group of sides that the same planes cut.

    `index` are the numbers of the sides, `cuts` is the number of planes, `steps` the largest number of Lanczos steps.
    With an `end` of 0 or 1, planes cut only the half of each side at its start or at its end.
    """
    if sides.curvature[index[0]]:
        return losses([mode_system(*_driven_cut(sides, index, 0.5, 1.0, modes), conductivity, modes)], steps)
    spans = sides.end[index] - sides.start[index]
    corner = LEAST_CORNER_DISTANCE * float(np.mean(sides.section[index, 1]) / np.mean(np.hypot(spans[:, 0],
                                                                                               spans[:, 1])))
    straight = mode_system(_cross_sections(sides, index, 0.5, 1.0), None, conductivity, modes)
    fractions, weights = _points_near_ends(cuts // 2, corner)
    if end is not None:
        chosen = (fractions > 0.5) == bool(end)
        fractions, weights = fractions[chosen], 2.0 * weights[chosen]
    systems = []
    for fraction, weight in zip(fractions.tolist(), weights.tolist(), strict=True):
        cut, flux = _driven_cut(sides, index, fraction, weight, modes)
        systems.append(straight.with_longer_tracks(weight, path_drive(cut, flux, conductivity, modes)))
    return losses(systems, steps)


def _points_near_ends(count: int, scale: float) -> tuple[Array, Array]:
    """Return points (2 count) and weights (2 count; no unit) of the mean over [0, 1], denser towards both ends.

    `count` points lie on either half. The distance from an end is scale sinh(u) for Gauss points u.
    """
    nodes, weights = gauss(count)
    top = math.asinh(0.5 / scale)
    u = 0.5 * top * (1.0 + nodes)
    x, w = scale * np.sinh(u), 0.5 * top * weights * scale * np.cosh(u)
    return np.concatenate([x, 1.0 - x]), 0.5 * np.concatenate([w, w]) / np.sum(w)


def _sides(tracks: Sequence[BentTrack]) -> _Sides:
    """Return the pieces of all tracks as sides with lengths (m), curvatures (1/m) and group numbers.

    Sides of a group have nearly equal directions, so the same planes cut them.
    """
    groups: list[tuple[float, int]] = []
    shapes: dict[bytes, tuple[Array, ...]] = {}
    layers, number = [], 0
    for track in tracks:
        shape = track.starts.tobytes() + track.ends.tobytes() + track.turns.tobytes()
        if shape not in shapes:  # every other layer repeats
            shapes[shape] = _numbered_pieces(track, groups)
        pieces, key, block, chords, chord_block = shapes[shape]
        section = np.array([track.z, track.width, track.thickness])
        layers.append((pieces, np.tile(section, (len(pieces), 1)), key, number + block,
                       chords, np.tile(section, (len(chords), 1)), number + chord_block))
        number += int(block[-1]) + 1
    table, sections, keys, of, less, less_sections, less_of = (
        np.concatenate(column) for column in zip(*layers, strict=True))
    headings = [(heading - groups[0][0] + 1e-3) % (2.0 * math.pi) for heading, _ in groups]
    first, last = np.searchsorted(of, np.arange(number)), np.searchsorted(of, np.arange(number), side="right") - 1
    ends = table[first, :2], table[last, 2:4]
    return _Sides(table[:, :2], table[:, 2:4], sections, table[:, 4], table[:, 5], keys, headings, of,
                  _Chords(less[:, :2], less[:, 2:4], less_sections[:, 0], less_sections[:, 1], less_of),
                  0.5 * (ends[0] + ends[1]), np.hypot(*(ends[1] - ends[0]).T))


def _numbered_pieces(track: BentTrack, groups: list[tuple[float, int]]) -> tuple[Array, ...]:
    """Return a layer's straight pieces and chords, with the numbers of their groups and blocks.

    Three arrays describe the pieces: (n, 6) with ends (m), length of the block (m) and curvature (1/m); the group of
    each piece, -1 if no plane cuts it; and its block from 0. Two arrays describe a third of the chords: (m, 4) with
    ends (m), and the block of each chord. New groups are appended to `groups` (see `_group_number`).
    """
    rows, keys, block, few, few_block = [], [], [], [], []
    most = 1.0 / (TIGHTEST * track.width)
    for number, (nodes, length, turn, heading) in enumerate(_blocks(track)):
        corners, parts = nodes.tolist(), len(nodes) - 1
        curvature = max(-most, min(turn / length, most))
        rows += [(*start, *end, length, curvature) for start, end in pairwise(corners)]
        group = _group_number(groups, heading, 1 if turn else 0)
        keys += [group if k == parts // 2 else -1 for k in range(parts)]
        block += [number] * parts
        chords = -(-parts // 3)
        some = [corners[round(parts * k / chords)] for k in range(chords + 1)]
        few += [(*start, *end) for start, end in pairwise(some)]
        few_block += [number] * chords
    return np.array(rows), np.array(keys), np.array(block), np.array(few), np.array(few_block)


Block = tuple[Array, float, float, float]
"""Nodes (n, 2; m), length (m), turning angle (rad) and direction (rad) of a straight side or a block of arcs."""


def _blocks(track: BentTrack) -> Iterator[Block]:
    """Yield the straight sides of a track, and its consecutive arcs divided into blocks.

    Each has nodes (n, 2; m), length (m), turning angle (rad) and direction (rad). Blocks end at fixed directions, so
    that the blocks of all turns lie side by side.
    """
    first = 0
    while first < len(track.turns):
        last = first + 1
        if track.turns[first]:
            while last < len(track.turns) and track.turns[last] * track.turns[first] > 0.0:
                last += 1
            yield from _arc_run_blocks(track.starts[first:last], track.ends[first:last], track.turns[first:last],
                                       track.width)
        else:
            span = track.ends[first] - track.starts[first]
            nodes = np.array([track.starts[first], track.ends[first]])
            yield nodes, float(np.hypot(*span)), 0.0, math.atan2(span[1], span[0])
        first = last


def _arc_run_blocks(starts: Array, ends: Array, turns: Array, width: float) -> Iterator[Block]:
    """Yield the blocks into which consecutive arcs are divided: nodes (n, 2; m), length (m), angle and direction (rad).

    The result for a single arc is cached, because it is equal in every turn of a polygon.
    """
    if len(turns) > 1:
        yield from _consecutive_arc_blocks(starts, ends, turns, width)
        return
    x, y = ((ends[0] - starts[0]) / width).tolist()
    for nodes, *rest in _single_arc_blocks(round(x, 9), round(y, 9), round(float(turns[0]), 9), width):
        yield starts[0] + nodes, *rest


@lru_cache(maxsize=64)
def _single_arc_blocks(x: float, y: float, turn: float, width: float) -> tuple[Block, ...]:
    """Return the blocks (m) of a single arc from the origin to the point (`x`, `y`), in units of the track width.

    `turn` (rad) is the angle by which the arc turns.
    """
    return tuple(_consecutive_arc_blocks(np.zeros((1, 2)), width * np.array([[x, y]]), np.array([turn]), width))


def _consecutive_arc_blocks(starts: Array, ends: Array, turns: Array, width: float) -> Iterator[Block]:
    """Yield the blocks into which consecutive arcs are divided.

    `starts`, `ends` (n, 2; m) and `turns` (n; rad) describe the arcs, `width` (m) is the track's. Each block has nodes
    (n, 2; m), length (m), turning angle (rad) and direction (rad). The direction is at the middle of the block. For
    arcs that turn by `ROUND` or more, it is at the middle of the whole step of `BLOCK` that contains the block.
    """
    sign = math.copysign(1.0, turns[0])
    spans = ends - starts
    radii = np.hypot(spans[:, 0], spans[:, 1]) / (2.0 * np.sin(0.5 * np.abs(turns)))
    begin = sign * (math.atan2(spans[0, 1], spans[0, 0]) - 0.5 * turns[0])
    reached = begin + np.concatenate([[0.0], np.cumsum(np.abs(turns))])
    end, whole = float(reached[-1]), float(reached[-1]) - begin
    if whole < ROUND:
        cuts = np.linspace(begin, end, math.ceil(whole / BLOCK - 1e-3) + 1)
    else:
        inner = np.arange(math.ceil(begin / BLOCK + 1e-3), math.floor(end / BLOCK - 1e-3) + 1)
        cuts = np.array([begin, *(BLOCK * inner), end])
    for low, high in pairwise(cuts.tolist()):
        overlap = np.minimum(reached[1:], high) - np.maximum(reached[:-1], low)
        length = float(np.sum(radii * np.maximum(overlap, 0.0)))
        # Chords about as long as the track is wide, an odd number so that one is in the middle.
        parts = min(max(3, math.ceil(length / width)), 9) // 2 * 2 + 1
        at = np.linspace(low, high, parts + 1)
        arc = np.clip(np.searchsorted(reached, at, side="right") - 1, 0, len(turns) - 1)
        nodes = _points_on_arcs(starts[arc], ends[arc], turns[arc], (at - reached[arc]) / np.abs(turns[arc]))
        middle = 0.5 * (low + high)
        heading = middle if whole < ROUND else (math.floor(middle / BLOCK) + 0.5) * BLOCK
        yield nodes, length, sign * (high - low), sign * heading


def _points_on_arcs(start: Array, end: Array, turn: Array, fraction: Array) -> Array:
    """Return points (n, 2; m) at fractions (n) of the angle of arcs.

    `start` and `end` (n, 2; m) are the ends of the arcs, `turn` (n; rad) their angles. The start is rotated about the
    arc's centre (derived here).
    """
    span = end - start
    normals = np.stack([-span[:, 1], span[:, 0]], axis=1)
    centre = 0.5 * (start + end) + normals * (0.5 / np.tan(0.5 * turn))[:, None]
    arm, angle = start - centre, turn * fraction
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = np.stack([arm[:, 0] * cosine - arm[:, 1] * sine, arm[:, 0] * sine + arm[:, 1] * cosine], axis=1)
    return np.asarray(centre + turned)


def _group_number(groups: list[tuple[float, int]], heading: float, part: int) -> int:
    """Return the number of the group to which a direction `heading` (rad) belongs.

    `groups` lists the direction and the kind (`part`: 0 straight side, 1 arc) of each group. If no group of this kind
    is within `ABREAST` of the direction, a new group is appended.
    """
    for number, (other, kind) in enumerate(groups):
        if kind == part and abs(math.remainder(heading - other, 2.0 * math.pi)) < ABREAST:
            return number
    groups.append((heading, part))
    return len(groups) - 1


def _cross_sections(sides: _Sides, index: Index, fraction: float, weight: float) -> Cut:
    """Return the cross-sections of some sides (m) where a plane cuts them at a fraction of their lengths.

    `index` are the numbers of the sides. Each cross-section represents `weight` times the length of its side.
    """
    place, tangent = _points_and_direction(sides, index, fraction)
    z, width, thickness = sides.section[index].T
    normal = np.array([tangent[1], -tangent[0]])
    return Cut(place @ normal, z, width, thickness, sides.length[index] * weight, sides.curvature[index])


def _points_and_direction(sides: _Sides, index: Index, fraction: float) -> tuple[Array, Array]:
    """Return the points (n, 2; m) at a fraction of some sides' lengths, and the unit vector (2) of the first side.

    `index` are the numbers of the sides.
    """
    span = sides.end[index] - sides.start[index]
    return sides.start[index] + fraction * span, span[0] / np.hypot(*span[0])


def _driven_cut(sides: _Sides, index: Index, fraction: float, weight: float, modes: ModeSet) -> tuple[Cut, Array]:
    """Return cross-sections of parallel sides with a plane, and the flux (tracks, points; Wb/m/A) that drives them.

    The plane is normal to the sides, at a `fraction` of the first side's length. The flux is the difference between the
    flux of the whole coil path and the flux of straight infinite tracks. For arcs, the flux of their curvature is
    added. `index` lists the numbers of the sides. Each cross-section represents `weight` times the length of its side.
    The field is Biot and Savart's for straight filaments.
    """
    place, tangent = _points_and_direction(sides, index, fraction)
    cut = _cross_sections(sides, index, fraction, weight)
    offset, normal = 0.5 * cut.width[:, None] * field_nodes(modes), np.array([tangent[1], -tangent[0]])
    tangential = place @ tangent
    # The normal field of the whole path per ampere (n, points), times the path's length there over that of the centre
    # line, without what the cut's tracks make as straight ones (Biot and Savart for straight filaments). The field, not
    # the potential along the track: near corners that would miss half of the flux.
    point = tangential[:, None, None] * tangent + (cut.across[:, None] + offset)[..., None] * normal
    chords, own_chords = _source_chords(sides, index, tangential[:, None] * tangent + cut.across[:, None] * normal)
    filaments = _straight_filaments(chords, own_chords, bool(cut.curvature.any()), tangent, 1e-6 * cut.unit)
    root = np.sqrt(cut.length)
    total = path_field(filaments, point, cut.height, root[None, :] / root[:, None], sides.block[index])
    flux = flux_to_points(-MU0 / (4.0 * math.pi) * total * (1.0 + cut.curvature[:, None] * offset), cut, modes)
    if cut.curvature.any():
        flux += _bend_flux(cut, 0.5 * np.abs(cut.curvature) * sides.length[index], modes)
    return cut, flux


def _bend_flux(cut: Cut, half: Array, modes: ModeSet) -> Array:
    """Return the flux (n, points; Wb/m/A) of arcs as parts of rings, minus the flux of straight tracks in their place.

    `half` (n; rad) is the angle of the arc on either side of the plane. Derived here from `arc_field` and
    `ring_inductance_without_logarithm`.
    """
    # mode_system weighs what straight tracks make with sqrt(1 + curvature x), the flux with 1 + curvature x; and a
    # track's own arc, +-half (n,) radians about the cut, is a part of a ring.
    bend = cut.curvature[:, None]
    offset = gauss_point_positions(cut, modes)[0] - cut.across[:, None]
    flux = -bend * flux_to_points(_straight_potential(cut, 0.5 * cut.width[:, None] * field_nodes(modes)), cut, modes)
    factor = 1.0 + bend * offset
    flux += (factor - np.sqrt(factor)) * _straight_potential(cut, offset)
    radius = 1.0 / np.abs(cut.curvature)
    place = radius[:, None] * factor
    nodes, share = gauss(modes.points[0] + 1)
    source = radius[:, None] + 0.5 * cut.width[:, None] * nodes
    squared = np.maximum((place[..., None] - source[:, None, :]) ** 2, (1e-6 * cut.width[:, None, None]) ** 2)
    ring = ring_inductance_without_logarithm(place[..., None], source[:, None, :], squared, cut.unit) @ (0.5 * share)
    flux += ring / (2.0 * math.pi * radius[:, None])
    t, weight = gauss(24)
    near = radius[:, None] + 0.5 * cut.width[:, None] * np.sign(bend) * field_nodes(modes)
    field = np.empty_like(near)
    for i, (r, beta) in enumerate(zip(radius, half, strict=True)):
        angle = beta + (math.pi - beta) * (0.5 * (1.0 + t)) ** 2
        weights = 2.0 * (math.pi - beta) * 0.5 * (1.0 + t) * weight
        field[i] = arc_field(near[i], np.full(t.size, r), angle, weights, np.zeros(near.shape[1]))
    return np.asarray(flux - flux_to_points(np.sign(bend) * field * near / radius[:, None], cut, modes))


def _source_chords(sides: _Sides, index: Index, place: Array) -> tuple[_Chords, Index]:
    """Return the chords whose field acts on points (n, 2; m), and the indices of the chords that the plane cuts.

    `place` are the points, `index` the numbers of the sides that the plane cuts. Blocks of arcs at a distance
    (`DISTANT`) are represented by a third of their chords.
    """
    near = box_around_points(place).distance(sides.middle, sides.middle) < DISTANT * sides.reach
    near[sides.block[index]] = True
    many, few = near[sides.block], ~near[sides.chords.block]
    rest = sides.chords
    return _Chords(*(np.concatenate([table[many], other[few]]) for table, other in (
        (sides.start, rest.start), (sides.end, rest.end), (sides.section[:, 0], rest.height),
        (sides.section[:, 1], rest.width), (sides.block, rest.block),
    ))), np.cumsum(many)[index] - 1


def _straight_filaments(chords: _Chords, own_chords: Index, is_curved: bool, tangent: Array, least: float) -> Filaments:
    """Return chords as straight filaments, with the squared least distance (m2) that a point is assumed to have.

    The least distance is `least` (m). For chords in other directions than the sides' `tangent`, it is
    `LEAST_CORNER_DISTANCE` widths. `own_chords` are the indices of the chords that the plane cuts. `is_curved` is true
    if these chords are parts of arcs.
    """
    axis = chords.end - chords.start
    # Sides round the corner have the width of a track: as filaments they would be too near.
    turned = np.abs(axis @ tangent) < 0.94 * np.hypot(axis[:, 0], axis[:, 1])
    clear = np.maximum(turned * LEAST_CORNER_DISTANCE * chords.width, least) ** 2
    clear[own_chords] = least**2
    # An arc of the cut is a part of a ring near it, not chords: see `_bend_flux`.
    block = chords.block if is_curved else np.full(len(axis), -1)
    return Filaments(chords.start, chords.end, chords.height, clear, own_chords, block)


def _straight_potential(cut: Cut, offset: Array) -> Array:
    """Return the potential (n, points; Wb/m/A) of the other tracks in a plane as infinite straight filaments.

    It is the sum of -mu0 / (2 pi) ln(distance / unit) sqrt(length / own length) over the other tracks (Jackson,
    Classical Electrodynamics, chapter 5). The points are at `offset` (n, points; m) from each centre.
    """
    across = cut.across[:, None, None] + offset[..., None] - cut.across
    square = across**2 + (cut.height[:, None] - cut.height)[:, None, :] ** 2
    square = np.maximum(square / cut.unit**2, 1e-20)
    tracks = np.arange(cut.across.size)
    square[tracks, :, tracks] = 1.0
    ratio = np.sqrt(cut.length[None, :] / cut.length[:, None])
    return np.asarray(-MU0 / (4.0 * math.pi) * np.sum(ratio[:, None, :] * np.log(square), axis=2))
