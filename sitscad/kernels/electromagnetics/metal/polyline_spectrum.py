"""Waves of tracks along straight sides with mitred corners, and of the current loops at their corners.

A uniform current in a mitred side has a Fourier transform in closed form, like a polygon (Lee and Mittra, IEEE Trans.
Antennas Propag. 31, 1983). The difference of direct current from a uniform current at a corner is a small loop of known
magnetic moment (`corner_excess`). Currents without sources are the curl of their moments, so a loop's waves are k times
its moment, across the wave.

Both are evaluated at directions that crowd about the sides' normals, where short waves are strongest. The layers of a
coil are one spiral, rotated and mirrored. So the waves of an image are derived from the waves of its original.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Flags, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.clusters import plan_numbers
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.corner_excess import Loops
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum, thickness_waves, wave_numbers
from sitscad.kernels.electromagnetics.special_functions import gauss

SAME = 1e-9
"""Largest difference of corners (m) and directions (rad) between a track and its image: rounding errors."""

SAME_MOMENT = 1e-6
"""Largest relative difference at which two sets of current loops count as images of each other.

The difference of their Fourier transforms at `PROBES` is divided by the sum of the loops' moments.
"""

PROBES = np.array([(0.9, 0.3), (-2.3, 3.1), (7.7, 4.1), (-13.9, 17.3), (29.3, -31.7), (61.1, 53.9)]).T
"""Wave vectors (2, n) at which the Fourier transforms of two sets of loops are compared.

The unit is rad divided by the extent of the loops.
"""


@record(eq=False)
class TrackImage:
    """Description of a track as the image of another track, whose number is `of`.

    `matrix` (2, 2) rotates the other track about a common centre, and mirrors it if the determinant is negative. The
    result is then shifted by `offset` (2; m). `sense` is -1 if the current runs in the opposite direction, else 1.
    """

    of: int
    matrix: Array
    offset: Array
    sense: float

    def directions(self, angle: Array) -> tuple[Index, Flags] | None:
        """Return an index (n) of directions of the other track's waves, one for each direction of this track's waves.

        The image rotates or mirrors the other track's wave at the indexed direction into this track's wave. The second
        result flags waves for which the opposite of the indexed direction is needed. `angle` (rows, n; rad) are
        directions over half a turn. None if a needed direction is not in `angle`.
        """
        mirrored = np.linalg.det(self.matrix) < 0.0
        turn = math.atan2(self.matrix[1, 0], self.matrix[0, 0])
        needed = turn - angle if mirrored else angle - turn
        order = np.argsort(angle[0])
        low = angle[0, order[0]] - SAME
        place = np.searchsorted(angle[0, order], (needed[0] - low) % math.pi + low - SAME) % angle.shape[1]
        places = order[place]
        halves = np.round((needed - angle[:, places]) / math.pi)
        if np.abs(needed - angle[:, places] - math.pi * halves).max() > 3.0 * SAME:
            return None
        return places, np.asarray(halves[0] % 2.0 != 0.0)

    def waves(self, other: ComplexArray, wave: Array, places: Index, opposite: Flags,
              ) -> ComplexArray:
        """Return the track's waves (2, rows, n; m) at wave vectors (2, rows, n; 1/m), from the other track's waves.

        `places` and `opposite` are the results of `directions`.

        Notes
        -----
        A rotation or mirror of the plane transforms waves in the same way. A shift by d multiplies them by exp(-i k.d)
        (Fourier shift theorem).
        """
        needed = other[..., places]
        np.conjugate(needed, out=needed, where=opposite)
        phase = np.tensordot(self.offset, wave, axes=1)
        return np.asarray(self.sense * np.exp(-1j * phase) * np.tensordot(self.matrix, needed, axes=1))


def track_images(tracks: Sequence[PolylineTrack], loops: Sequence[Loops], centre: Array) -> list[TrackImage | None]:
    """Return for each track its description as an image of an earlier track about a centre (m), or None.

    The first suitable track is chosen. The current loops, if given, must be images as well.
    """
    track_images: list[TrackImage | None] = []
    for n, track in enumerate(tracks):
        roots = (m for m in range(n) if track_images[m] is None and tracks[m].width == track.width)
        candidates = (_image(m, tracks[m].corners - centre, track.corners - centre) for m in roots)
        candidates = (image for image in candidates if image is not None and (
            not loops or _are_loops_images(image, loops[image.of], loops[n], centre)))
        track_images.append(next(candidates, None))
    return track_images


def _image(of: int, source: Array, target: Array) -> TrackImage | None:
    """Return the image of track number `of` that has the corners `target` (n, 2; m). None if there is no such image.

    `source` (n, 2; m) are the corners of that track. Both directions along the track, and rotations and mirrors, are
    tried.
    """
    if source.shape != target.shape:
        return None
    for sense, aim in ((1.0, target), (-1.0, target[::-1])):
        for mirror in (False, True):
            matrix, offset = _fit_rigid_motion(source, aim, mirror)
            if np.abs(source @ matrix.T + offset - aim).max() < SAME:
                return TrackImage(of, matrix, offset, sense)
    return None


def _fit_rigid_motion(source: Array, target: Array, mirror: bool) -> tuple[Array, Array]:
    """Return the rotation or mirror (2, 2; no unit) and the shift (2; m) that best map `source` to `target` (n, 2; m).

    Method: least squares, Procrustes' problem, whose angle has a closed form in the plane (textbook).
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


def _are_loops_images(image: TrackImage, source: Loops, target: Loops, centre: Array) -> bool:
    """Whether a track's current loops (m2) are the images of another track's loops, by their transforms at `PROBES`."""
    if source.moments.size != target.moments.size or source.spread != target.spread:
        return False
    if not source.moments.size:
        return True
    turn = image.sense * np.sign(np.linalg.det(image.matrix))
    probes = PROBES / max(float(np.ptp(target.places)), 1e-9)
    places = (source.places - centre) @ image.matrix.T + image.offset
    theirs = turn * source.moments @ np.exp(1j * (places @ probes))
    target_waves = target.moments @ np.exp(1j * ((target.places - centre) @ probes))
    return bool(np.abs(theirs - target_waves).max() < SAME_MOMENT * np.sum(np.abs(target.moments)))


CHORD = math.radians(20.0)
"""Largest angle (rad) of an arc that one chord replaces."""

MOST_NORMALS = 12
"""Largest number of directions of long sides for which a track counts as a polygon. With more it counts as round.

In a round track, the chords of arcs are as long as the sides.
"""

ROUND = 48, 1.0
"""Number of directions over which a round track's waves are averaged: a constant, plus a number per radian of phase.

The phase is the wave number times the difference of the track's length and width.
"""

EVENLY = 12
"""The number of directions of a round track is a multiple of this number.

Copies rotated or mirrored by 15 degrees then need no other directions.
"""

AT_ONCE = 12_000
"""Number of pairs of waves and nodes processed together, which stay in a processor's cache."""

ROUNDING = 1e-8
"""Angle (rad) between a wave and a side's normal below which the wave counts as normal to the side.

For such waves the difference between the waves of the side's ends is lost in rounding.
"""


def with_chords(track: BentTrack, nearest: float) -> PolylineTrack:
    """Return a track (m) with a few chords instead of every arc, for metal at least `nearest` (m) away.

    The chords enclose the area of the arc. The corners of chords that span an angle a are outside the arc by a^2 / 12
    of the radius, so that on average the chords lie on the arc (derived here).
    """
    is_arc, turns = track.turns != 0.0, track.turns[track.turns != 0.0]
    starts, spans = track.starts[is_arc], track.ends[is_arc] - track.starts[is_arc]
    normals = np.stack([-spans[:, 1], spans[:, 0]], axis=1)
    centres = starts + 0.5 * spans + normals * (0.5 / np.tan(0.5 * turns))[:, None]
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
    """Return the current spectrum (m2) of tracks along straight sides, each layer at its height.

    Parameters
    ----------
    tracks : sequence of PolylineTrack
        layers of the coil
    nearest : float
        least distance of a reflector from any mid-plane (m)
    loops : sequence of Loops, optional
        difference of each track's current from a uniform current at its bends; empty to neglect it

    Notes
    -----
    It is the mean over directions of the products of `_Mitred.waves`, divided by 4 pi^2.
    """
    everything = np.concatenate([track.corners for track in tracks])
    centre = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    k, weights = wave_numbers(float(np.hypot(*(everything - centre).T).max()), nearest)
    owner = plan_numbers([np.append(track.corners, track.width) for track in tracks])
    distinct = [tracks[owner.index(n)] for n in range(max(owner) + 1)]
    directions = _Directions.from_corners([track.corners for track in distinct])
    used = [loops[owner.index(n)] for n in range(len(distinct))] if loops else []
    shapes = [_Mitred(track, centre, used[n] if used else None) for n, track in enumerate(distinct)]
    follows = track_images(distinct, used, centre)
    sides = np.concatenate([shape.after for shape in shapes])
    tangents = np.unique(np.round(sides[sides.any(axis=1)], 9), axis=0)
    power = np.empty((k.size, len(tracks), len(tracks)))
    nodes = max(len(shape.after) for shape in shapes)
    first = 0
    while first < k.size:
        some = slice(first, first + max(1, AT_ONCE // (nodes * directions.count(float(k[first])))))
        first = some.stop
        angle, share = directions.integration_directions(k[some])
        waves = _all_waves(shapes, follows, k[some], angle, tangents)
        mean = np.einsum("idkn,jdkn,kn->kij", waves, waves.conj(), share, optimize=True).real / (4.0 * math.pi**2)
        power[some] = mean[:, owner][:, :, owner]
    through = np.array([thickness_waves(k, track.thickness) for track in tracks]).T
    power *= through[:, :, None] * through[:, None, :]
    return CurrentSpectrum(k, weights, np.array([track.z for track in tracks]), power)


def _all_waves(shapes: Sequence[_Mitred], follows: Sequence[TrackImage | None], numbers: Array, angle: Array,
               tangents: Array) -> ComplexArray:
    """Return current spectra (tracks, 2, k, directions; m) at wave numbers (k; 1/m) and directions (k, n; rad).

    `follows` has the image description of each track, or None. The spectrum of an image track is derived from its
    original. `tangents` (sides, 2) are the directions of all sides.
    """
    unit = np.stack([np.cos(angle), np.sin(angle)])
    number = np.repeat(numbers, angle.shape[1])
    flat = _rotate_off_normals(unit.reshape(2, -1), tangents)
    spectra = np.empty((len(shapes), *unit.shape), dtype=np.complex128)
    for n, (shape, image) in enumerate(zip(shapes, follows, strict=True)):
        directions = None if image is None else image.directions(angle)
        if image is None or directions is None:
            spectra[n] = shape.waves(number, flat).reshape(unit.shape)
        else:
            spectra[n] = image.waves(spectra[image.of], numbers[:, None] * unit, *directions)
    return spectra


@record
class _Directions:
    """Directions over which waves are averaged.

    `normals` (rad, below pi) are the normals of the long sides, and `length` (m) is the longest side. For a round
    track, `normals` is empty and `length` is its length minus its width.
    """

    normals: tuple[float, ...]
    length: float

    @classmethod
    def from_corners(cls, shapes: Sequence[Array]) -> _Directions:
        """Return the directions for tracks with the given corners (one array (n, 2; m) per track)."""
        sides = np.concatenate([np.diff(corners, axis=0) for corners in shapes])
        length = np.hypot(sides[:, 0], sides[:, 1])
        normal = (np.arctan2(sides[:, 1], sides[:, 0]) + 0.5 * math.pi) % math.pi
        normals: list[float] = []
        for candidate in normal[length > 0.3 * length.max()]:
            if all(abs(math.remainder(candidate - other, math.pi)) > 0.02 for other in normals):
                normals.append(float(candidate))
        if len(normals) > MOST_NORMALS:
            angle = np.arange(0.0, math.pi, math.radians(5.0))
            across = np.ptp(np.concatenate(shapes) @ np.stack([np.cos(angle), np.sin(angle)]), axis=0)
            return cls((), float(np.ptp(across)))
        return cls(tuple(sorted(normals)), float(length.max()))

    def count(self, number: float) -> int:
        """Return the number of directions needed for waves with the wave number `number` (1/m)."""
        phase = number * self.length
        if not self.normals:
            return EVENLY * math.ceil((ROUND[0] + ROUND[1] * phase) / EVENLY)
        return 2 * len(self.normals) * (6 + math.ceil(2.6 * math.log1p(phase)))

    def integration_directions(self, numbers: Array) -> tuple[Array, Array]:
        """Return directions (wave numbers, n; rad) and weights (sum 1) of the mean for each wave number (1/m).

        The directions cover half a turn. They are denser near the normals of the sides, where the spectrum of a side
        has a narrow lobe.
        """
        count = self.count(float(numbers[-1]))
        if not self.normals:
            even = math.pi / count * (0.5 + np.arange(count))
            return np.tile(even, (numbers.size, 1)), np.full((numbers.size, count), 1.0 / count)
        scale = np.minimum(1.0, 2.0 / np.maximum(numbers * self.length, 1e-9))[:, None]
        nodes, share = gauss(count // (2 * len(self.normals)))
        angles, weights = [], []
        for low, high in pairwise([*self.normals, self.normals[0] + math.pi]):
            top = np.arcsinh(0.5 * (high - low) / scale)
            u = 0.5 * top * (1.0 + nodes)
            offset, weight = scale * np.sinh(u), 0.5 * top * share * scale * np.cosh(u) / math.pi
            angles += [low + offset, high - offset]
            weights += [weight, weight]
        return np.concatenate(angles, axis=1), np.concatenate(weights, axis=1)


def _rotate_off_normals(unit: Array, tangents: Array) -> Array:
    """Return unit vectors (2, n; no unit) in which each direction that is normal to a side is rotated slightly.

    `tangents` (sides, 2) are the sides' directions. In a direction normal to a side, the waves of the side's two ends
    cancel. `ROUNDING` is the tolerance.
    """
    across = np.any(np.abs(tangents @ unit) < ROUNDING, axis=0)
    return np.asarray(unit + 10.0 * ROUNDING * across * np.stack([-unit[1], unit[0]]))


class _Mitred:
    """Track along straight sides about a centre, with its current loops.

    Notes
    -----
    Side j adds t_j / (i k.t_j) times the difference of exp(-i k.r) between its start and its end. Each is averaged over
    the width along its mitre. So every node has the difference of two factors and one wave.
    """

    def __init__(self, track: PolylineTrack, centre: Array, loops: Loops | None) -> None:
        corners, same = track.corners - centre, 1e-6 * track.width
        steps = np.diff(corners, axis=0)
        tangents = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
        none = np.zeros((1, 2))
        after, before = np.concatenate([tangents, none]), np.concatenate([none, tangents])
        self.nodes = repeating_patterns(corners, np.concatenate([before, after], axis=1), same)
        self.after, self.before = after[self.nodes.kinds], before[self.nodes.kinds]
        self.mitres = (track.strand(0.5 * track.width) - track.corners)[self.nodes.kinds]
        self.spread, self.moments = 0.0, np.zeros(0)
        if loops is not None and loops.moments.size:
            size = float(np.abs(loops.moments).max())
            self.loops = repeating_patterns(loops.places - centre, loops.moments[:, None] / size, same)
            self.moments, self.spread = loops.moments[self.loops.kinds], loops.spread

    def waves(self, numbers: Array, unit: Array) -> ComplexArray:
        """Return the Fourier transform (2, n; m; x and y) of the current.

        `numbers` (n; 1/m) are the wave numbers, `unit` (2, n) the directions. Sides follow Lee and Mittra (1983) for
        polygons. Loops are the curl of their moments, i k times the moment across the wave.
        """
        wave = numbers * unit
        factors = _side_transform(self.after, wave) - _side_transform(self.before, wave)
        x = self.mitres @ wave
        # sin(x) / x by the tangent of x / 2, which costs a tenth of the sine
        half = np.where(x == 0.0, 1e-20, 0.5 * x)
        tangent = np.tan(half)
        transform = -1j * self.nodes.sums(wave, factors * np.asarray(tangent / (half * (1.0 + tangent * tangent))))
        if not self.moments.size:
            return np.asarray(transform)
        amount = self.loops.sums(wave, self.moments[:, None])
        size = numbers * np.exp(-0.5 * (numbers * self.spread) ** 2)
        return np.asarray(transform + 1j * size * amount * np.stack([unit[1], -unit[0]]))


def _side_transform(tangents: Array, wave: Array) -> Array:
    """Return t / (k.t) (2, n, directions; m) for sides along unit vectors t (n, 2). It is 0 for a missing side (t = 0).

    `wave` (2, directions; 1/m) are the wave vectors k.
    """
    components = tangents @ wave
    components[~tangents.any(axis=1)] = np.inf
    return np.asarray(tangents.T[:, :, None] / components)


LEAST_ROW = 4
"""Least number of places of a row for which a closed form is used. It costs as much as three single places."""


@record(eq=False)
class Rows:
    """Places in rows of equal steps.

    `middles` (n, 2; m) are the middles of the rows, `steps` (n, 2; m) their steps from place to place, `counts` (n) the
    numbers of places.
    """

    middles: Array
    steps: Array
    counts: Array

    def sums(self, wave: Array) -> ComplexArray:
        """Return the sum of exp(-i k.r) over the places r of each row (n, directions; no unit).

        `wave` (2, directions; 1/m) are the wave vectors k. About the middle of a row the sum is sin(count x / 2) /
        sin(x / 2), with the phase x between places (Dirichlet kernel, textbook).
        """
        waves = phase_factors(self.middles @ wave)
        longer = self.counts > 1.0
        # sin(count x / 2) / sin(x / 2) from quarters of the phase x between places, by tangents, which cost a tenth
        # of sines
        quarter = 0.25 * (self.steps[longer] @ wave)
        quarter = np.where(quarter == 0.0, 1e-20, quarter)
        several, single = np.tan(self.counts[longer, None] * quarter), np.tan(quarter)
        waves[longer] *= several * (1.0 + single * single) / (single * (1.0 + several * several))
        return waves


@record(eq=False)
class Patterns:
    """Points grouped into patterns that repeat.

    The sequence of points is divided at steps that occur only once. A pattern is the part between two such steps.
    `kinds` (point numbers) and `inner` (m; position relative to the pattern's first point) list the points of one copy
    of each pattern, pattern after pattern. `first` are the indices in these arrays at which patterns begin. `places`
    (m) are the first points of all copies, pattern after pattern. `begins` are the indices in `places` at which
    patterns begin. Places that differ by less than `tolerance` (m) count as equal.
    """

    kinds: Index
    inner: Array
    first: Index
    places: Array
    begins: Index
    tolerance: float

    @cached_property
    def sizes(self) -> Index:
        """Number of points in each pattern (no unit)."""
        return np.diff(np.append(self.first, len(self.kinds)))

    @cached_property
    def _rows(self) -> tuple[Rows, Index]:
        """Places of all copies as rows (m), pattern by pattern, and the number of each pattern's first row."""
        rows: list[tuple[Array, Array, int]] = []
        begins = []
        for low, high in pairwise([*self.begins.tolist(), len(self.places)]):
            begins.append(len(rows))
            rows += _rows_of_places(self.places[low:high], self.tolerance)
        middles, steps, counts = zip(*rows, strict=True)
        return Rows(np.array(middles), np.array(steps), np.array(counts, dtype=float)), np.array(begins)

    def sums(self, wave: Array, factors: Array) -> ComplexArray:
        """Return the sum of factors (..., kinds, directions) times exp(-i k.r) over all points r.

        The result (..., directions) has the factors' unit. `wave` (2, directions; 1/m) are the wave vectors k.
        """
        if len(self.places) == len(self.begins):  # no pattern repeats: sum over all points
            phases = phase_factors((self.inner + np.repeat(self.places, self.sizes, axis=0)) @ wave)
            return np.asarray(np.einsum("...kd,kd->...d", factors, phases))
        figure = factors  # patterns of a single point each
        if len(self.first) < len(self.kinds):
            figure = np.add.reduceat(factors * phase_factors(self.inner @ wave), self.first, axis=-2)
        rows, begins = self._rows
        places = rows.sums(wave)
        if len(begins) < len(places):
            places = np.add.reduceat(places, begins, axis=0)
        return np.asarray(np.einsum("...kd,kd->...d", figure, places))


def repeating_patterns(points: Array, labels: Array, same: float) -> Patterns:
    """Return the patterns that repeat in a sequence of points (n, 2; m).

    Copies of a pattern have equal steps within `same` (m) and equal labels (n, any).
    """
    _, kind = np.unique(np.round(labels, 9) + 0.0, axis=0, return_inverse=True)
    step = np.round(np.diff(points, axis=0) / same) + 0.0
    _, way, times = np.unique(step, axis=0, return_inverse=True, return_counts=True)
    ends = [0, *(np.nonzero(times[way] < 2)[0] + 1).tolist(), len(points)]
    patterns: dict[tuple[bytes, bytes], list[int]] = {}
    for low, high in pairwise(ends):
        patterns.setdefault((kind[low:high].tobytes(), way[low : high - 1].tobytes()), []).append(low)
    sizes = [len(kinds) // kind.itemsize for kinds, _ in patterns]
    numbers = [np.arange(runs[0], runs[0] + size) for runs, size in zip(patterns.values(), sizes, strict=True)]
    kinds, anchors = np.concatenate(numbers), np.repeat([runs[0] for runs in patterns.values()], sizes)
    begins = np.cumsum([0, *(len(runs) for runs in patterns.values())])
    return Patterns(kinds, points[kinds] - points[anchors], np.cumsum([0, *sizes])[:-1],
                    points[[run for runs in patterns.values() for run in runs]], begins[:-1], same)


def _rows_of_places(places: Array, same: float) -> list[tuple[Array, Array, int]]:
    """Return rows of consecutive places with equal steps, as (middle (2; m), step (2; m), number of places).

    `places` (n, 2; m) may differ from a row by `same` (m). A place that continues no row is a row of its own.
    """
    rows: list[tuple[Array, Array, int]] = []
    first = 0
    while first < len(places):
        ahead = places[first:]
        even = ahead[0] + np.arange(len(ahead))[:, None] * (ahead[1] - ahead[0] if len(ahead) > 1 else 0.0)
        off = np.nonzero(np.abs(ahead - even).max(axis=1) > same)[0]
        count = int(off[0]) if off.size else len(ahead)
        if count < LEAST_ROW:
            rows.append((ahead[0], np.zeros(2), 1))
            first += 1
            continue
        last = ahead[count - 1]
        rows.append((0.5 * (ahead[0] + last), (last - ahead[0]) / (count - 1), count))
        first += count
    return rows


def phase_factors(phase: Array) -> ComplexArray:
    """Return exp(-i phase) (no unit) for phases in radians.

    It is 2 / (1 + t^2) - 1 and 2 t / (1 + t^2) with t the tangent of half the phase (textbook), at a tenth of the cost
    of sine and cosine.
    """
    tangent = np.tan(0.5 * phase)
    double = 2.0 / (1.0 + tangent * tangent)
    wave = np.empty(phase.shape, dtype=np.complex128)
    np.subtract(double, 1.0, out=wave.real)
    np.multiply(-tangent, double, out=wave.imag)
    return wave
