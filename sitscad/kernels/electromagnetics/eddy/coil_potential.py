"""The vector potential above a flat coil of any shape, tabulated once from its real tracks.

Currents of every layer are spread on a grid by cubic splines, taken to wave numbers, and carried upwards like
exp(-k z) (particles on a mesh; Hockney and Eastwood 1988). A mirror behind the coil returns every wave by its own
factor. Grids get coarser with every doubling of the height; between their nodes cubic splines serve, between heights
cubics in the height's logarithm. The grid repeats the coil; the repeated ones are dipoles by then, and taken off.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, ComplexArray, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.graded_line import interpolation
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.special_functions import gauss

Table = NDArray[np.complex64]
Returned = Callable[[Array], ComplexArray]

FINE, ROOM = 0.36, 3.6
"""Grid's spacing over the lowest height, and its side over the coil's diameter and the reach together."""

LEVELS, OCTAVES = 5, 7
"""Heights tabulated for each doubling, and how often the lowest height is doubled."""

STRANDS = 2
"""Filaments across a track, at the Gauss points of its width."""

LATTICE_REST = 9.0336217 - 4.0 - math.sqrt(2.0)
"""Sum of 1/n^3 over the square lattice without its origin and the eight neighbours (Borwein et al. 2013: the whole sum
is 4 zeta(3/2) beta(3/2) = 9.0336)."""

AT_ONCE = 8192
"""Points that are looked up at once: what is worked out for them on the way stays in a processor's cache."""

REPEATED = 14
"""Images of images between two mirrors, on each side, that stand for the field far away."""

FAR, FAR_BETWEEN, WAVES = 0.5, 0.25, 6
"""Height over a dipole, in the grid's side, from which the field of its repetitions is taken as waves; between two
mirrors, where many images are about there, already from half of that on; and how many waves along x and y, each way:
the next one is exp(-2 pi x 7 x 0.25) of a dipole, 2e-5. Nearer, the even field is off by up to 5e-4 of the coil's."""

SMOOTH = 24
"""Points along a side from which the smooth field of the repeated coils is interpolated."""


@record
class _Dipole:
    # A small loop for the whole coil: moment (m2), height of its middle (m); `ends` (x + i y; m) leads from the first
    # end of the tracks to the last, for a winding alone is open.
    moment: float
    height: float
    ends: complex


@record(eq=False)
class _Octave:
    # One octave of heights over grids of a spacing (m) on a side (m): `waves` are the potential's at the top mid-plane
    # (m; spline coefficients), and at a mirror `above` that (m) those which it returns; `dipoles` the coil's, which
    # repeat beyond the grid. `values` (levels, side, side) are potentials at the heights that were asked for, `known`
    # (single precision: 1e-7 of them is far below their error).
    lowest: float
    spacing: float
    side: float
    top: float
    waves: ComplexArray
    dipoles: tuple[_Dipole, ...]
    values: Table
    known: set[int]
    above: float = math.inf
    falling: ComplexArray | None = None

    def table(self, wanted: Sequence[int]) -> Table:
        """Potentials (Wb/m) on grids, those of the levels that are wanted worked out."""
        missing = sorted({*wanted} - self.known)
        count = len(self.waves)
        k, whole = _wave_numbers(count, self.spacing)
        for level in missing:
            height = self.lowest * 2.0 ** ((level - 1.0) / LEVELS)
            place = 0.5 * self.side * gauss(SMOOTH)[0]
            x, y = (part.ravel() for part in np.meshgrid(place, place))
            points = np.stack([x, y, np.full_like(x, self.top + height)], axis=1)
            far = FAR * self.side if self.falling is None else FAR_BETWEEN * self.side
            found = _repeated(points, place, self.dipoles, self.side, far)
            to_grid = _to_grid(count)
            repeated = np.asarray(to_grid @ found.reshape(SMOOTH, SMOOTH) @ to_grid.T)
            waves = self.waves * np.exp(-k * height)[whole]
            if self.falling is not None:  # the last levels, through which cubics go, are above the mirror
                waves += self.falling * np.exp(-k * max(self.above - height, -self.above))[whole]
            self.values[level] = np.fft.ifft2(waves) - repeated
            self.known.add(level)
        return self.values


@record(eq=False)
class CoilPotential:
    """Potential of a coil with 1 A at any place above it, its centre at x = y = 0, with its images in mirrors below and
    above; `nearest` is the least height (m) over the top track's mid-plane at which it holds.
    """

    top: float
    side: float
    nearest: float
    octaves: tuple[_Octave, ...]
    dipoles: tuple[_Dipole, ...]

    def __call__(self, points: Array) -> ComplexArray:
        """A_x + i A_y (n; Wb/m) at points (n, 3) in metres; A_z is 0. Far away the coil is a dipole
        (`_dipole_potential`).
        """
        height = np.maximum(points[:, 2] - self.top, self.nearest)
        octave = np.floor(np.log2(height / self.nearest) + 1e-12).astype(np.intp)
        widest = max(octave.spacing for octave in self.octaves)
        beside = np.maximum(np.abs(points[:, 0]), np.abs(points[:, 1])) > 0.5 * self.side - 3.0 * widest
        octave[beside | (octave >= len(self.octaves))] = -1
        found = np.empty(len(points), dtype=complex)
        for number in np.flatnonzero(np.bincount(octave + 1)) - 1:
            chosen = np.flatnonzero(octave == number)
            if number < 0:
                found[chosen] = sum(_dipole_potential(points[chosen], dipole) for dipole in self.dipoles)
                continue
            for some in (chosen[part] for part in slices(len(chosen), AT_ONCE)):
                found[some] = _looked_up(self.octaves[number], points[some], height[some], 0.5 * self.side)
        return found


@record(eq=False)
class Plane:
    """A mirror at a height `z` (m): the factor (no unit) by which waves of wave numbers (1/m) come back. It is -1, as
    of a perfect conductor, where `returned` is None.
    """

    z: float
    returned: Returned | None = None

    def factor(self, k: Array) -> ComplexArray:
        """The factor of each wave number (1/m)."""
        return np.full(k.shape, -1.0 + 0.0j) if self.returned is None else self.returned(k)


def coil_potentials(
    tracks: Sequence[PolylineTrack], nearest: float, reach: float, floor: Plane | None = None,
    roof: Plane | None = None, is_lossy: bool = False,
) -> tuple[CoilPotential, ...]:
    """The potential (Wb/m) of tracks in series, layers one above the other, currents along their corners. It holds from
    `nearest` (m) over the top mid-plane and is finest within `reach` (m) of the centre. A wave of sheet current makes
    mu0 / 2 k of it, which falls with height like exp(-k z) (Laplace's equation, textbook). A mirror below (`floor`)
    returns waves by its factor, and so does one above (`roof`), below which the potential holds; between both they go
    to and fro. Of lossy mirrors that is the real part, and a second potential is what they return out of phase.
    """
    top = max(track.z for track in tracks)
    extent = 2.0 * max(float(np.abs(track.corners).max()) for track in tracks)
    side = ROOM * max(extent, 0.5 * extent + reach)
    count = 2 * math.ceil(0.5 * side / (FINE * nearest))
    spacing = side / count
    quarter, whole = _wave_numbers(count, spacing)
    parts = 1 + is_lossy
    factor = None if floor is None else floor.factor(quarter)
    with np.errstate(divide="ignore"):
        each_wave = np.where(quarter > 0.0, 0.5 * MU0 / quarter, 0.0)
    again, falls = _between(quarter, top, floor, roof)
    rising = np.zeros((parts, count, count), dtype=complex)
    falling = np.zeros((parts * (roof is not None), count, count), dtype=complex)
    for track in tracks:
        layer = _spread_spectrum(track.corners.tobytes(), track.width, count, spacing)
        through = each_wave * (1.0 + (quarter * track.thickness) ** 2 / 24.0)
        up = np.exp(-quarter * (top - track.z))
        back = np.zeros_like(quarter) if floor is None else np.exp(-quarter * (top + track.z - 2.0 * floor.z))
        if roof is None:
            rising[0] += layer * (through * (up if factor is None else up + factor.real * back))[whole]
            if is_lossy and factor is not None:
                rising[1] += layer * (through * factor.imag * back)[whole]
            continue
        both = through * (up if factor is None else up + factor * back) * again
        for part, of in enumerate((np.real, np.imag)[:parts]):
            rising[part] += layer * of(both)[whole]
            falling[part] += layer * of(both * falls)[whole]
    found: list[CoilPotential] = []
    for part, of in enumerate((np.real, np.imag)[:parts]):
        dipoles = _dipoles(tracks, _images(float(quarter[0, 1]), floor, roof), of)
        octaves = tuple(
            _octave(rising[part], falling[part] if roof is not None else None, side, nearest * 2.0**n, top,
                    math.inf if roof is None else roof.z - top, dipoles, n) for n in range(OCTAVES))
        found.append(CoilPotential(top, side, nearest, octaves, dipoles))
    return tuple(found)


def _between(k: Array, top: float, floor: Plane | None, roof: Plane | None) -> tuple[ComplexArray, ComplexArray]:
    """How many times (no unit) waves of wave numbers (1/m) rise at the top mid-plane's height (m) for once without a
    roof, the geometric series of what goes to and fro; and what part of them falls from the roof, there.
    """
    if roof is None:
        return np.ones(k.shape, dtype=complex), np.zeros(k.shape, dtype=complex)
    falls = roof.factor(k) * np.exp(-k * (roof.z - top))
    if floor is None:
        return np.ones(k.shape, dtype=complex), falls
    away = np.exp(-k * (roof.z - top + 2.0 * (top - floor.z)))
    left = 1.0 - floor.factor(k) * falls * away
    return np.asarray(1.0 / np.where(k > 0.0, left, 1.0)), falls


def _octave(
    rising: ComplexArray, falling: ComplexArray | None, side: float, lowest: float, top: float, above: float,
    dipoles: tuple[_Dipole, ...], number: int
) -> _Octave:
    """A coil's potential (Wb/m) on grids over one octave of heights, without the dipoles that repeat beyond the grid;
    the spline's own values at the nodes, (2 + cos) / 3 of a wave, are divided out.
    """
    whole = rising.shape[0]
    count = min(max(2 * math.ceil(0.5 * whole / 2**number), 64), whole)
    kept = np.r_[0 : count // 2, whole - count // 2 : whole]  # the longest waves, as a spectrum of fewer points
    spacing = side / count
    along = (2.0 + np.cos(2.0 * math.pi * np.fft.fftfreq(count))) / 3.0
    along[1::2] *= -1.0  # which moves the coil to the middle of the grid

    def coarse(waves: ComplexArray) -> ComplexArray:
        """Fewer waves, as a spline's coefficients."""
        return np.asarray(waves[np.ix_(kept, kept)] / (along[:, None] * along) * (count / whole) ** 2)

    values = np.empty((LEVELS + 3, count, count), dtype=np.complex64)
    returned = None if falling is None else coarse(falling)
    return _Octave(lowest, spacing, side, top, coarse(rising), dipoles, values, set(), above, returned)


def _wave_numbers(count: int, spacing: float) -> tuple[Array, tuple[Index, Index]]:
    """Wave numbers (1/m) of a grid of a spacing (m): those of a quarter of a Fourier transform's waves, and which of
    them each of all (count, count) has.
    """
    number = np.minimum(np.arange(count), count - np.arange(count))
    k = 2.0 * math.pi / (count * spacing) * np.arange(count // 2 + 1)
    rows, columns = np.ix_(number, number)
    return np.hypot(k[:, None], k), (rows, columns)


@lru_cache(maxsize=2)
def _spread_spectrum(corners: bytes, width: float, count: int, spacing: float) -> ComplexArray:
    """Spectrum (count, count) of a layer's sheet current (A/m, x + i y) on the grid, rows along y; of its track's
    `corners` (n, 2; m). What the splines smear is divided out: their transform is sinc^4 (Hockney and Eastwood 1988).
    Every other layer repeats.
    """
    track = PolylineTrack(np.frombuffer(corners).reshape(-1, 2), width, 0.0, 0.0)
    nodes, weights = gauss(STRANDS)
    sheet = np.zeros(count * count, dtype=complex)
    for node, weight in zip(nodes, weights, strict=True):
        places, moments = _pieces(track.strand(0.5 * track.width * float(node)), spacing)
        (columns, along_x), (rows, along_y) = (_spline(places[:, axis] / spacing + 0.5 * count) for axis in (0, 1))
        share = 0.5 * weight / spacing**2 * moments[:, None, None] * along_y[:, :, None] * along_x[:, None, :]
        at = (rows[:, :, None] % count) * count + columns[:, None, :] % count
        sheet += np.bincount(at.ravel(), share.real.ravel(), count * count)
        sheet += 1j * np.bincount(at.ravel(), share.imag.ravel(), count * count)
    wide = np.sinc(np.fft.fftfreq(count)) ** 4
    centred = np.fft.fft2(np.fft.ifftshift(sheet.reshape(count, count)))
    return np.asarray(centred / (wide[:, None] * wide))


def _pieces(corners: Array, spacing: float) -> tuple[Array, ComplexArray]:
    """Gauss points (m) of pieces no longer than the spacing (m), and length (x + i y, m) of each."""
    sides = np.diff(corners, axis=0)
    counts = np.ceil(np.hypot(*sides.T) / spacing).astype(np.intp)
    owner = np.repeat(np.arange(len(sides)), counts)
    first = np.cumsum(counts) - counts
    part = np.arange(owner.size) - first[owner]
    places, moments = [], []
    for node, weight in zip(*gauss(2), strict=True):
        fraction = (part + 0.5 * (1.0 + node)) / counts[owner]
        places.append(corners[owner] + fraction[:, None] * sides[owner])
        moments.append(0.5 * weight / counts[owner] * (sides[owner] @ np.array([1.0, 1j])))
    return np.concatenate(places), np.concatenate(moments)


def _spline(x: Array) -> tuple[Index, Array]:
    """The four nodes (n, 4) about every place (n; spacings) and the weights (n, 4; no unit) of the cubic B-spline there
    (de Boor, A Practical Guide to Splines, 1978).
    """
    first = np.floor(x).astype(np.intp)
    t = x - first
    u = 1.0 - t
    t2, u2 = t * t, u * u  # powers of arrays beyond the second cost a hundred products
    weights = np.stack([u2 * u, 4.0 + t2 * (3.0 * t - 6.0), 4.0 + u2 * (3.0 * u - 6.0), t2 * t], axis=1) / 6.0
    return first[:, None] + np.arange(-1, 3), weights


def _looked_up(octave: _Octave, points: Array, height: Array, half: float) -> ComplexArray:
    """The potential (n; Wb/m) at points (n, 2; m) and heights (n; m), by cubic splines on the grids and Lagrange's
    polynomial over the logarithm of the height (Abramowitz and Stegun 25.2.13).
    """
    count = len(octave.waves)
    (columns, along_x), (rows, along_y) = (_spline((points[:, axis] + half) / octave.spacing) for axis in (0, 1))
    level = np.log2(height / octave.lowest) * LEVELS + 1.0
    lowest = np.clip(np.floor(level).astype(np.intp) - 1, 0, LEVELS - 1)
    t = level - lowest
    # Lagrange's weights of values at 0, 1, 2, 3.
    a, b, c, d = t, t - 1.0, t - 2.0, t - 3.0
    up = np.stack([-b * c * d / 6.0, 0.5 * a * c * d, -0.5 * a * b * d, a * b * c / 6.0], axis=1)
    starts = np.flatnonzero(np.bincount(lowest)).tolist()
    flat = octave.table([first + k for first in starts for k in range(4)]).reshape(-1)
    # four neighbours along x are taken out as one record: numpy gathers records in half the time of rows of four
    runs = np.ndarray((len(flat) - 3,), dtype=f"V{4 * flat.itemsize}", buffer=flat, strides=(flat.itemsize,))
    base = (lowest * count + rows[:, 0]) * count + columns[:, 0]
    found, part = np.zeros((8, len(points))), np.empty((8, len(points)))
    for k in range(4):
        for row in range(4):
            run = runs[base + (k * count + row) * count].view(flat.real.dtype).reshape(-1, 8)
            found += np.multiply(run.T, up[:, k] * along_y[:, row], out=part)
    real, imaginary = np.einsum("xcn,nx->cn", found.reshape(4, 2, -1), along_x)
    return np.asarray(real + 1j * imaginary)


def _images(k: float, floor: Plane | None, roof: Plane | None) -> tuple[tuple[float, float, complex], ...]:
    """What waves of a wave number (1/m) see of a coil: itself and its images by `way`, shift (m) and strength (no
    unit; images of horizontal currents), what is at z being seen at way z + shift.
    """
    at, found = np.array([k]), [(1.0, 0.0, 1.0 + 0.0j)]
    ends = [None if plane is None else complex(plane.factor(at)[0]) for plane in (floor, roof)]
    for plane, end in zip((floor, roof), ends, strict=True):
        if plane is not None and end is not None:
            found.append((-1.0, 2.0 * plane.z, end))
    (low, high) = ends
    if floor is None or roof is None or low is None or high is None:
        return tuple(found)
    apart = 2.0 * (roof.z - floor.z)
    for n in range(1, REPEATED + 1):
        both = (low * high) ** n
        found += [(1.0, n * apart, both), (1.0, -n * apart, both),
                  (-1.0, 2.0 * floor.z - n * apart, low * both), (-1.0, 2.0 * roof.z + n * apart, high * both)]
    return tuple(found)


def _dipoles(
    tracks: Sequence[PolylineTrack], images: Sequence[tuple[float, float, complex]], of: Callable[[Any], Any]
) -> tuple[_Dipole, ...]:
    """The coil and its images as dipoles (areas in m2 by Gauss's shoelace formula, ends in m), those parts of their
    strengths: real or imaginary.
    """
    areas, ends = [], []
    for track in tracks:
        x, y = track.corners.T
        areas.append(0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))
        ends.append(complex(x[-1] - x[0], y[-1] - y[0]))
    total, height = math.fsum(areas), sum(track.z for track in tracks) / len(tracks)
    return tuple(_Dipole(float(of(strength)) * total, way * height + shift, float(of(strength)) * sum(ends))
                 for way, shift, strength in images if of(strength))


def _dipole_potential(points: Array, dipole: _Dipole) -> ComplexArray:
    """A_x + i A_y (n; Wb/m) of a loop's moment, mu0 / (4 pi) m x r / r^3 (Jackson, Classical Electrodynamics, equation
    5.55), and of its open ends as one short piece of current, at points (n, 3; m).
    """
    square = points[:, 0] ** 2 + points[:, 1] ** 2 + (points[:, 2] - dipole.height) ** 2
    around = dipole.moment * 1j * (points[:, 0] + 1j * points[:, 1]) / (square * np.sqrt(square))
    return np.asarray(MU0 / (4.0 * math.pi) * (around + dipole.ends / np.sqrt(square)))


def _repeated(
    points: Array, place: Array, dipoles: Sequence[_Dipole], side: float, height: float
) -> ComplexArray:
    """A_x + i A_y (n; Wb/m) that a grid with a side (m) makes of loops beside the loops' own, at points (n, 3; m) of
    one height over a square of `place` (m) along x and y: that of all others, repeated in steps of the side. Near to
    the plane of a loop these are eight dipoles, and the even field of all the rest; from a `height` (m) on all of them
    together are a few waves (Fourier's series of 1 / r), so that the grid makes next to nothing of the loop's own.
    Derived here.
    """
    found = np.zeros(len(points), dtype=complex)
    far = []
    for dipole in dipoles:
        if abs(float(points[0, 2]) - dipole.height) >= height:
            far.append(dipole)
            continue
        around = side * np.array([[i, j, 0.0] for i, j in product((-1, 0, 1), repeat=2) if i or j])
        neighbours = (points - around[:, None]).reshape(-1, 3)
        found += _dipole_potential(neighbours, dipole).reshape(-1, len(points)).sum(axis=0)
        # an even field B along z has the potential B x r / 2, that is i B (x + i y) / 2
        even = -MU0 * dipole.moment / (4.0 * math.pi) * LATTICE_REST / side**3
        found += 0.5j * even * (points[:, 0] + 1j * points[:, 1])
    if not far:
        return found
    along = 2.0 * math.pi / side * np.arange(-WAVES, WAVES + 1)
    k = np.hypot(along[:, None], along)
    k[WAVES, WAVES] = math.inf  # no even part: a potential that is everywhere the same drives nothing
    every = np.zeros(k.shape, dtype=complex)
    for dipole in far:
        decay = np.exp(-k * abs(float(points[0, 2]) - dipole.height)) / k
        every += decay * (dipole.moment * (along + 1j * along[:, None]) + dipole.ends)
        found -= _dipole_potential(points, dipole)
    waves = np.exp(1j * place[:, None] * along)
    return np.asarray(found + (0.5 * MU0 / side**2) * (waves @ every @ waves.T).ravel())


@lru_cache(maxsize=OCTAVES)
def _to_grid(count: int) -> Array:
    """What takes a smooth field at Gauss points of a side to its grid's nodes: (count, SMOOTH), no unit."""
    return interpolation(SMOOTH, 2.0 * np.arange(count) / count - 1.0)
