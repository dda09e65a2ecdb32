"""The waves of tracks along straight sides, mitred where they meet, and of the loops at their corners.

An even current in a mitred side has its Fourier transform in closed form. What direct current does at a corner beyond
that is a small loop of known moment (`corner_excess`); currents without sources are the curl of their moments, so a
loop's waves are k times its moment, across the wave. Both are taken at directions that crowd about the sides' normals,
where short waves lie.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.bent_tracks import BentTrack
from sitscad.physics.current_spectrum import CurrentSpectrum, thickness_waves, wave_numbers
from sitscad.physics.filaments import PolylineTrack
from sitscad.physics.legendre import gauss
from sitscad.record import record

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

CHORD = math.radians(20.0)
"""Angle that a chord of an arc spans at most."""


@record(eq=False)
class Loops:
    """Small loops of current in the plane of a track: places (n, 2) in metres, moments (n; m2 per ampere of the track,
    positive upwards), and over how much each is spread (m, a Gaussian's standard deviation).
    """

    places: Array
    moments: Array
    spread: float


def chorded(track: BentTrack, nearest: float) -> PolylineTrack:
    """A track with every arc as a few chords, for metal no nearer than `nearest` (m); they enclose what the arc does.

    The corners of chords that span an angle a lie a^2 / 12 of the radius outside, so that in the mean they are on it.
    """
    nodes = [track.starts[0]]
    for start, end, turn in zip(track.starts, track.ends, track.turns, strict=True):
        if turn:
            span = end - start
            left = np.array([-span[1], span[0]])
            centre = 0.5 * (start + end) + left * 0.5 / math.tan(0.5 * turn)
            radius = float(np.hypot(*(start - centre)))
            count = math.ceil(abs(turn) / min(CHORD, math.sqrt(0.4 * nearest / radius)) - 1e-9)
            step = turn / count
            angle = step * (np.arange(count) + 0.5)
            arm = (1.0 + step * step / 12.0) * (start - centre)
            nodes += list(centre + np.cos(angle)[:, None] * arm + np.sin(angle)[:, None] * [-arm[1], arm[0]])
        nodes.append(end)
    return PolylineTrack(np.array(nodes), track.width, track.thickness, track.z)


def polyline_spectrum(tracks: Sequence[PolylineTrack], nearest: float, loops: Sequence[Loops] = ()) -> CurrentSpectrum:
    """The spectrum of tracks along straight sides, each layer where it lies, for reflectors no nearer than `nearest`
    (m) to any mid-plane; `loops` are what each track's current has at its bends beyond an even one (none when empty).
    """
    everything = np.concatenate([track.corners for track in tracks])
    centre = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    k, weights = wave_numbers(float(np.hypot(*(everything - centre).T).max()), nearest)
    distinct, owner = _distinct(tracks)
    normals, length = _long_sides([track.corners for track in distinct])
    shapes = [_Mitred(track, centre, loops[owner.index(n)] if loops else None) for n, track in enumerate(distinct)]
    power = np.empty((k.size, len(tracks), len(tracks)))
    for n, number in enumerate(k):
        angle, share = _directions(normals, float(number) * length)
        waves = np.array([shape.waves(float(number), angle) for shape in shapes])
        mean = np.einsum("idn,jdn,n->ij", waves, waves.conj(), share).real / (4.0 * math.pi**2)
        power[n] = mean[np.ix_(owner, owner)]
    through = np.array([thickness_waves(k, track.thickness) for track in tracks]).T
    power *= through[:, :, None] * through[:, None, :]
    return CurrentSpectrum(k, weights, np.array([track.z for track in tracks]), power)


def _distinct(tracks: Sequence[PolylineTrack]) -> tuple[list[PolylineTrack], list[int]]:
    # Paths that differ, and which of them each one is: every other layer repeats.
    shapes: list[PolylineTrack] = []
    owner = []
    for track in tracks:
        same = [i for i, shape in enumerate(shapes) if _alike(shape, track)]
        if not same:
            shapes.append(track)
        owner.append(same[0] if same else len(shapes) - 1)
    return shapes, owner


def _alike(one: PolylineTrack, other: PolylineTrack) -> bool:
    return (one.width == other.width and one.corners.shape == other.corners.shape
            and np.allclose(one.corners, other.corners, atol=1e-9, rtol=0.0))  # fmt: skip


def _long_sides(shapes: Sequence[Array]) -> tuple[list[float], float]:
    # Directions (rad, below pi) across the long sides, and the longest one's length (m).
    sides = np.concatenate([np.diff(corners, axis=0) for corners in shapes])
    length = np.hypot(sides[:, 0], sides[:, 1])
    normal = (np.arctan2(sides[:, 1], sides[:, 0]) + 0.5 * math.pi) % math.pi
    known: list[float] = []
    for one in normal[length > 0.3 * length.max()]:
        if all(abs(math.remainder(one - other, math.pi)) > 0.02 for other in known):
            known.append(float(one))
    return sorted(known)[:12], float(length.max())


def _directions(normals: Sequence[float], phase: float) -> tuple[Array, Array]:
    # Directions over half a turn and their weights (sum 1), graded about every normal like the lobe of a side through
    # which a wave runs `phase` radians.
    scale = min(1.0, 2.0 / max(phase, 1e-9))
    nodes, share = gauss(6 + math.ceil(2.6 * math.log1p(phase)))
    found, weights = [], []
    for low, high in pairwise([*normals, normals[0] + math.pi]):
        half = 0.5 * (high - low)
        top = math.asinh(half / scale)
        u = 0.5 * top * (1.0 + nodes)
        away, weight = scale * np.sinh(u), 0.5 * top * share * scale * np.cosh(u) / math.pi
        found += [low + away, high - away]
        weights += [weight, weight]
    return np.concatenate(found), np.concatenate(weights)


class _Mitred:
    """A track about a centre, with its loops: half of each corner's mitre (n + 1, 2), from the centre line to the left
    edge, and by how much it leads on along the sides (n) from their starts to their ends.
    """

    def __init__(self, track: PolylineTrack, centre: Array, loops: Loops | None) -> None:
        self.sides = np.diff(track.corners, axis=0)
        self.middles = 0.5 * (track.corners[1:] + track.corners[:-1]) - centre
        self.mitres = track.strand(0.5 * track.width) - track.corners
        length = np.hypot(self.sides[:, 0], self.sides[:, 1])
        self.longer = np.sum(np.diff(self.mitres, axis=0) * self.sides, axis=1) / length**2
        self.loops, self.centre = loops, centre

    def waves(self, number: float, angle: Array) -> ComplexArray:
        """Fourier transform of the current at a wave number (1/m) and directions: x and y (2, directions)."""
        unit = np.stack([np.cos(angle), np.sin(angle)])
        along = 0.5 * number * (self.sides @ unit)
        across = number * (self.mitres @ unit)
        ends = np.sinc(across / math.pi)
        # both ends' waves over the width: their mean, and their difference over the phase from end to end
        mean = np.sinc(along / math.pi) * 0.5 * (ends[1:] + ends[:-1])
        skewed = np.cos(along) * self.longer[:, None] * _slope(across, ends)
        found = self.sides.T @ ((mean + 1j * skewed) * np.exp(-1j * number * (self.middles @ unit)))
        return np.asarray(found if self.loops is None else found + self._loop_waves(number, unit))

    def _loop_waves(self, number: float, unit: Array) -> ComplexArray:
        assert self.loops is not None
        amount = self.loops.moments @ np.exp(-1j * number * ((self.loops.places - self.centre) @ unit))
        size = number * math.exp(-0.5 * (number * self.loops.spread) ** 2)
        return np.asarray(1j * size * amount * np.stack([unit[1], -unit[0]]))


def _slope(across: Array, ends: Array) -> Array:
    # Divided differences of sin(u) / u from row to row of `across` (n + 1, ...), whose values are `ends`.
    step, rise = np.diff(across, axis=0), np.diff(ends, axis=0)
    near = np.nonzero(np.abs(step) < 0.05)
    step[near] = 1.0
    found = rise / step
    middle = 0.5 * (across[1:][near] + across[:-1][near])
    safe = np.where(np.abs(middle) > 1e-3, middle, 1.0)
    found[near] = np.where(safe == middle, (np.cos(safe) - np.sin(safe) / safe) / safe, -middle / 3.0)
    return np.asarray(found)
