"""The waves of tracks along straight sides, mitred where they meet, and of the loops at their corners.

An even current in a mitred side has its Fourier transform in closed form, as a polygon has (Lee and Mittra, IEEE
Trans. Antennas Propag. 31, 1983). What direct current does at a corner beyond that is a small loop of
known moment (`corner_excess`); currents without sources are the curl of their moments, so a loop's waves are k times
its moment, across the wave. Both are taken at directions that crowd about the sides' normals, where short waves lie. A
coil's layers are one spiral, turned and mirrored, and so are their waves: an image has those of its original.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Flags, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.clusters import plan_numbers
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.corner_excess import Loops
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum, thickness_waves, wave_numbers
from sitscad.kernels.electromagnetics.metal.figures import figures
from sitscad.kernels.electromagnetics.special_functions import gauss

SAME = 1e-9
"""How far corners (m), and directions (rad), may be from an image's to be its: rounding alone."""

SAME_MOMENT = 1e-6
"""How far what loops make of a wave may be from an image's, in parts of all their moments."""

PROBES = np.array([(0.9, 0.3), (-2.3, 3.1), (7.7, 4.1), (-13.9, 17.3), (29.3, -31.7), (61.1, 53.9)]).T
"""Waves (2, n; rad over the loops' extent) by which two sets of loops are known to be the same."""


@record(eq=False)
class TrackImage:
    """A track as the image of another, number `of`: turned by `matrix` (2, 2) about a middle that they share, mirrored
    where its determinant is negative, then moved by `offset` (m); `sense` is -1 where the current runs the other way.
    """

    of: int
    matrix: Array
    offset: Array
    sense: float

    def directions(self, angle: Array) -> tuple[Index, Flags] | None:
        """Places of directions (rows, n; rad) over half a turn: where among them those are that the other track has to
        be seen from, and which of these are opposite to one of them. None where they are not among them.
        """
        mirrored = np.linalg.det(self.matrix) < 0.0
        turn = math.atan2(self.matrix[1, 0], self.matrix[0, 0])
        wanted = turn - angle if mirrored else angle - turn
        order = np.argsort(angle[0])
        low = angle[0, order[0]] - SAME
        place = np.searchsorted(angle[0, order], (wanted[0] - low) % math.pi + low - SAME) % angle.shape[1]
        found = order[place]
        halves = np.round((wanted - angle[:, found]) / math.pi)
        if np.abs(wanted - angle[:, found] - math.pi * halves).max() > 3.0 * SAME:
            return None
        return found, np.asarray(halves[0] % 2.0 != 0.0)

    def waves(self, other: ComplexArray, wave: Array, found: Index, opposite: Flags,
              ) -> ComplexArray:
        """The track's waves (2, rows, n; m) at `wave` (2, rows, n; 1/m), of the other's: a turn or mirror of the plane
        turns them alike, a shift by d multiplies them by exp(-i k.d) (Fourier's shift theorem).
        """
        seen = other[..., found]
        np.conjugate(seen, out=seen, where=opposite)
        phase = np.tensordot(self.offset, wave, axes=1)
        return np.asarray(self.sense * np.exp(-1j * phase) * np.tensordot(self.matrix, seen, axes=1))


def images(tracks: Sequence[PolylineTrack], loops: Sequence[Loops], centre: Array) -> list[TrackImage | None]:
    """The first track before each whose image about the centre (m) it is, with its loops where there are
    any; None for those that are nobody's.
    """
    found: list[TrackImage | None] = []
    for n, track in enumerate(tracks):
        roots = (m for m in range(n) if found[m] is None and tracks[m].width == track.width)
        ways = (_image(m, tracks[m].corners - centre, track.corners - centre) for m in roots)
        ways = (w for w in ways if w is not None and (not loops or _loops_follow(w, loops[w.of], loops[n], centre)))
        found.append(next(ways, None))
    return found


def _image(of: int, source: Array, target: Array) -> TrackImage | None:
    """How corners (n, 2; m) follow from those of track `of`, walked either way, turned or mirrored; None where they do
    not.
    """
    if source.shape != target.shape:
        return None
    for sense, aim in ((1.0, target), (-1.0, target[::-1])):
        for mirror in (False, True):
            matrix, offset = _fitted(source, aim, mirror)
            if np.abs(source @ matrix.T + offset - aim).max() < SAME:
                return TrackImage(of, matrix, offset, sense)
    return None


def _fitted(source: Array, target: Array, mirror: bool) -> tuple[Array, Array]:
    """The turn, or the mirror (2, 2; no unit), and the shift (2; m) that take points (n, 2; m) nearest to others by
    least squares: Procrustes' problem, whose angle is closed in the plane (textbook).
    """
    middles = source.mean(axis=0), target.mean(axis=0)
    x, y = (source - middles[0]).T
    u, v = (target - middles[1]).T
    if mirror:
        angle = math.atan2(float(x @ v + y @ u), float(x @ u - y @ v))
        matrix = np.array([(math.cos(angle), math.sin(angle)), (math.sin(angle), -math.cos(angle))])
    else:
        angle = math.atan2(float(x @ v - y @ u), float(x @ u + y @ v))
        matrix = np.array([(math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))])
    return matrix, middles[1] - matrix @ middles[0]


def _loops_follow(image: TrackImage, source: Loops, target: Loops, centre: Array) -> bool:
    """Whether a track's loops (m2) are the images of the other's: they make the same of the waves PROBES."""
    if source.moments.size != target.moments.size or source.spread != target.spread:
        return False
    if not source.moments.size:
        return True
    turn = image.sense * np.sign(np.linalg.det(image.matrix))
    probes = PROBES / max(float(np.ptp(target.places)), 1e-9)
    places = (source.places - centre) @ image.matrix.T + image.offset
    theirs = turn * source.moments @ np.exp(1j * (places @ probes))
    own = target.moments @ np.exp(1j * ((target.places - centre) @ probes))
    return bool(np.abs(theirs - own).max() < SAME_MOMENT * np.sum(np.abs(target.moments)))


CHORD = math.radians(20.0)
"""Angle that a chord of an arc spans at most."""

MOST_NORMALS = 12
"""Directions of long sides from which on a track counts as round: the chords of its arcs are as long as its sides."""

ROUND = 48, 1.0
"""Directions over which the waves of such a track are averaged, and how many more for each radian through which a wave
runs over what it is longer than wide."""

EVENLY = 12
"""They are a multiple of so many, so that what is turned or mirrored by 15 degrees is seen from the same ones."""

AT_ONCE = 12_000
"""Waves at nodes that are worked out at once: as many as stay near the processor."""

ROUNDING = 1e-8
"""Angle (rad) between a wave and a side's normal below which the difference of the side's ends is lost in rounding."""


def chorded(track: BentTrack, nearest: float) -> PolylineTrack:
    """A track (m) with every arc as a few chords, for metal no nearer than `nearest` (m); they enclose what the arc
    does. The corners of chords that span an angle a lie a^2 / 12 of the radius outside, so that in the mean they are on
    it (derived here).
    """
    is_arc, turns = track.turns != 0.0, track.turns[track.turns != 0.0]
    starts, spans = track.starts[is_arc], track.ends[is_arc] - track.starts[is_arc]
    left = np.stack([-spans[:, 1], spans[:, 0]], axis=1)
    centres = starts + 0.5 * spans + left * (0.5 / np.tan(0.5 * turns))[:, None]
    radii = np.hypot(*(starts - centres).T)
    chords = np.ceil(np.abs(turns) / np.minimum(CHORD, np.sqrt(0.4 * nearest / radii)) - 1e-9).astype(np.intp)
    arc = np.repeat(np.arange(chords.size), chords)
    steps = (turns / chords)[arc]
    angle = steps * (np.arange(arc.size) - (np.cumsum(chords) - chords)[arc] + 0.5)
    arms = (1.0 + steps * steps / 12.0)[:, None] * (starts - centres)[arc]
    across = np.stack([-arms[:, 1], arms[:, 0]], axis=1)
    count = np.zeros(is_arc.size, dtype=np.intp)
    count[is_arc] = chords
    nodes = np.empty((1 + is_arc.size + arc.size, 2))
    ends = np.append(0, np.cumsum(count + 1))
    is_end = np.zeros(len(nodes), dtype=bool)
    is_end[ends] = True
    nodes[ends] = np.concatenate([track.starts[:1], track.ends])
    nodes[~is_end] = centres[arc] + np.cos(angle)[:, None] * arms + np.sin(angle)[:, None] * across
    return PolylineTrack(nodes, track.width, track.thickness, track.z)


def polyline_spectrum(tracks: Sequence[PolylineTrack], nearest: float, loops: Sequence[Loops] = ()) -> CurrentSpectrum:
    """The spectrum (m2, see `CurrentSpectrum`) of tracks along straight sides, each layer where it lies, for reflectors
    no nearer than `nearest` (m) to any mid-plane; `loops` are what each track's current has at its bends beyond an even
    one (none when empty). The mean over directions of the products of `_Mitred.waves`, over 4 pi^2.
    """
    everything = np.concatenate([track.corners for track in tracks])
    centre = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    k, weights = wave_numbers(float(np.hypot(*(everything - centre).T).max()), nearest)
    owner = plan_numbers([np.append(track.corners, track.width) for track in tracks])
    distinct = [tracks[owner.index(n)] for n in range(max(owner) + 1)]
    directions = _Directions.of([track.corners for track in distinct])
    used = [loops[owner.index(n)] for n in range(len(distinct))] if loops else []
    shapes = [_Mitred(track, centre, used[n] if used else None) for n, track in enumerate(distinct)]
    follows = images(distinct, used, centre)
    sides = np.concatenate([shape.after for shape in shapes])
    tangents = np.unique(np.round(sides[sides.any(axis=1)], 9), axis=0)
    power = np.empty((k.size, len(tracks), len(tracks)))
    nodes = max(len(shape.after) for shape in shapes)
    first = 0
    while first < k.size:
        some = slice(first, first + max(1, AT_ONCE // (nodes * directions.count(float(k[first])))))
        first = some.stop
        angle, share = directions.about(k[some])
        waves = _all_waves(shapes, follows, k[some], angle, tangents)
        mean = np.einsum("idkn,jdkn,kn->kij", waves, waves.conj(), share, optimize=True).real / (4.0 * math.pi**2)
        power[some] = mean[:, owner][:, :, owner]
    through = np.array([thickness_waves(k, track.thickness) for track in tracks]).T
    power *= through[:, :, None] * through[:, None, :]
    return CurrentSpectrum(k, weights, np.array([track.z for track in tracks]), power)


def _all_waves(shapes: Sequence[_Mitred], follows: Sequence[TrackImage | None], numbers: Array, angle: Array,
               tangents: Array) -> ComplexArray:
    """The waves (shapes, 2, k, directions; m) at wave numbers (k; 1/m) and directions (k, n; rad), of images those of
    what they are images of.
    """
    unit = np.stack([np.cos(angle), np.sin(angle)])
    number = np.repeat(numbers, angle.shape[1])
    flat = _beside(unit.reshape(2, -1), tangents)
    found = np.empty((len(shapes), *unit.shape), dtype=np.complex128)
    for n, (shape, image) in enumerate(zip(shapes, follows, strict=True)):
        seen = None if image is None else image.directions(angle)
        if image is None or seen is None:
            found[n] = shape.waves(number, flat).reshape(unit.shape)
        else:
            found[n] = image.waves(found[image.of], numbers[:, None] * unit, *seen)
    return found


@record
class _Directions:
    """Over which directions waves are averaged: `normals` (rad, below pi) are those across the long sides, the longest
    of which is `length` (m) long; none for a track that is round but for `length` more along it than across.
    """

    normals: tuple[float, ...]
    length: float

    @classmethod
    def of(cls, shapes: Sequence[Array]) -> _Directions:
        """The directions of tracks with such corners (n, 2) in metres."""
        sides = np.concatenate([np.diff(corners, axis=0) for corners in shapes])
        length = np.hypot(sides[:, 0], sides[:, 1])
        normal = (np.arctan2(sides[:, 1], sides[:, 0]) + 0.5 * math.pi) % math.pi
        known: list[float] = []
        for one in normal[length > 0.3 * length.max()]:
            if all(abs(math.remainder(one - other, math.pi)) > 0.02 for other in known):
                known.append(float(one))
        if len(known) > MOST_NORMALS:
            angle = np.arange(0.0, math.pi, math.radians(5.0))
            across = np.ptp(np.concatenate(shapes) @ np.stack([np.cos(angle), np.sin(angle)]), axis=0)
            return cls((), float(np.ptp(across)))
        return cls(tuple(sorted(known)), float(length.max()))

    def count(self, number: float) -> int:
        """How many directions waves of a wave number (1/m) and somewhat shorter ones are averaged over."""
        phase = number * self.length
        if not self.normals:
            return EVENLY * math.ceil((ROUND[0] + ROUND[1] * phase) / EVENLY)
        return 2 * len(self.normals) * (6 + math.ceil(2.6 * math.log1p(phase)))

    def about(self, numbers: Array) -> tuple[Array, Array]:
        """Directions (rad) over half a turn and their weights (sum 1) for each wave number (n; 1/m): graded about every
        normal like the lobe of a side that the longest wave runs along.
        """
        count = self.count(float(numbers[-1]))
        if not self.normals:
            even = math.pi / count * (0.5 + np.arange(count))
            return np.tile(even, (numbers.size, 1)), np.full((numbers.size, count), 1.0 / count)
        scale = np.minimum(1.0, 2.0 / np.maximum(numbers * self.length, 1e-9))[:, None]
        nodes, share = gauss(count // (2 * len(self.normals)))
        found, weights = [], []
        for low, high in pairwise([*self.normals, self.normals[0] + math.pi]):
            top = np.arcsinh(0.5 * (high - low) / scale)
            u = 0.5 * top * (1.0 + nodes)
            away, weight = scale * np.sinh(u), 0.5 * top * share * scale * np.cosh(u) / math.pi
            found += [low + away, high - away]
            weights += [weight, weight]
        return np.concatenate(found, axis=1), np.concatenate(weights, axis=1)


def _beside(unit: Array, tangents: Array) -> Array:
    """Directions (2, n; no unit), those across a side to within rounding turned a little off: there the nodes' waves
    cancel.
    """
    across = np.any(np.abs(tangents @ unit) < ROUNDING, axis=0)
    return np.asarray(unit + 10.0 * ROUNDING * across * np.stack([-unit[1], unit[0]]))


class _Mitred:
    """A track about a centre, with its loops. Side j adds t_j / (i k.t_j) times what its start has more than its end of
    exp(-i k.r), each averaged over the width along its mitre. So every node has the difference of two such factors and
    one wave.
    """

    def __init__(self, track: PolylineTrack, centre: Array, loops: Loops | None) -> None:
        corners, same = track.corners - centre, 1e-6 * track.width
        steps = np.diff(corners, axis=0)
        tangents = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
        none = np.zeros((1, 2))
        after, before = np.concatenate([tangents, none]), np.concatenate([none, tangents])
        self.nodes = figures(corners, np.concatenate([before, after], axis=1), same)
        self.after, self.before = after[self.nodes.kinds], before[self.nodes.kinds]
        self.mitres = (track.strand(0.5 * track.width) - track.corners)[self.nodes.kinds]
        self.spread, self.moments = 0.0, np.zeros(0)
        if loops is not None and loops.moments.size:
            size = float(np.abs(loops.moments).max())
            self.loops = figures(loops.places - centre, loops.moments[:, None] / size, same)
            self.moments, self.spread = loops.moments[self.loops.kinds], loops.spread

    def waves(self, numbers: Array, unit: Array) -> ComplexArray:
        """Fourier transform (2, n; m) of the current at wave numbers (n; 1/m) and directions (2, n): x and y. Of sides
        as Lee and Mittra (1983) have it for polygons, of loops the curl of their moments, i k times the moment across
        the wave.
        """
        wave = numbers * unit
        factors = _share(self.after, wave) - _share(self.before, wave)
        x = self.mitres @ wave
        # sin(x) / x by the tangent of half of x, which costs a tenth of the sine.
        half = np.where(x == 0.0, 1e-20, 0.5 * x)
        tangent = np.tan(half)
        found = -1j * self.nodes.sums(wave, factors * np.asarray(tangent / (half * (1.0 + tangent * tangent))))
        if not self.moments.size:
            return np.asarray(found)
        amount = self.loops.sums(wave, self.moments[:, None])
        size = numbers * np.exp(-0.5 * (numbers * self.spread) ** 2)
        return np.asarray(found + 1j * size * amount * np.stack([unit[1], -unit[0]]))


def _share(tangents: Array, wave: Array) -> Array:
    """T / (k.t) (2, n, directions; m) of sides along unit vectors t (n, 2); nothing where a track has no side."""
    along = tangents @ wave
    along[~tangents.any(axis=1)] = np.inf
    return np.asarray(tangents.T[:, :, None] / along)
