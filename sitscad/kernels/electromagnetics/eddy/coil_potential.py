"""Vector potential above a flat coil of any shape, tabulated from its real tracks.

Cubic splines assign the currents of every layer to a grid. The Fourier transform of the grid is continued upwards by
exp(-k z) (particle-mesh method; Hockney and Eastwood 1988). Mirrors behind and in front of the coil reflect every wave
by a factor that depends on the wave number k.

The grid spacing doubles with every doubling of the height. Between the nodes, cubic splines interpolate. Between
heights, cubics in the logarithm of the height interpolate. The Fourier transform repeats the coil periodically. The
repeated coils are far enough to be dipoles, and the field of these dipoles is subtracted.
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
"""Table of complex potentials in single precision."""
ReflectionFactor = Callable[[Array], ComplexArray]
"""Function of wave numbers (1/m) that returns the ratio of the reflected to the incident wave (no unit)."""

FINE = 0.36
"""Grid spacing divided by the lowest tabulated height."""

ROOM = 3.6
"""Side of the square grid, divided by a length: the coil's diameter, or half of it plus `reach` if this is larger.

`reach` is the radius about the coil's centre in which the potential is needed (see `coil_potentials`).
"""

LEVELS = 5
"""Number of heights tabulated per octave (doubling of the height)."""

OCTAVES = 7
"""Number of tabulated octaves, from the lowest height on."""

TRACK_FILAMENTS = 2
"""Number of filaments that represent a track, at the Gauss points of its width."""

LATTICE_REST = 9.0336217 - 4.0 - math.sqrt(2.0)
"""Sum of 1/n^3 over a square lattice with spacing 1, n the distance from the origin, without the eight neighbours.

The sum with the neighbours is 4 zeta(3/2) beta(3/2) = 9.0336 (Borwein et al. 2013).
"""

AT_ONCE = 8192
"""Number of points interpolated at once, so that intermediate arrays stay in a processor's cache."""

REPEATED = 14
"""Number of repeated images between two mirrors, counted on each side, that are included as distant dipoles."""

FAR = 0.5
"""Least height above a dipole at which its periodic repetitions are summed as waves, divided by the grid's side.

The Fourier transform repeats the coil periodically. At lower heights, only the eight nearest repetitions are dipoles. A
uniform field replaces all others, with an error of up to 5e-4 of the coil's field.
"""

FAR_BETWEEN = 0.25
"""Height divided by the side of the grid, used instead of `FAR` for a coil between two mirrors.

Many images of the coil lie near this height.
"""

WAVES = 6
"""Highest order of the waves along x and y that represent repeated dipoles.

The next order contributes exp(-2 pi x 7 x 0.25) = 2e-5 of a dipole's field.
"""

SMOOTH = 24
"""Number of points along a side of the grid from which the smooth field of the repeated coils is interpolated."""


@record
class _Dipole:
    """Small loop that represents the whole coil, or an image of the coil, at a distance.

    `moment` (m2) is the area times the number of turns, `height` (m) the height of the loop. `ends` (x + i y; m) runs
    from the first end of the tracks to the last, because the winding is not a closed loop.
    """

    moment: float
    height: float
    ends: complex


@record(eq=False)
class _Octave:
    """Potentials on grids at the heights of one octave (from a height to twice this height).

    `lowest` (m) is the octave's lowest height above `top`, the height (m) of the top layer's mid-plane. The grid has a
    `spacing` and a `side` (m). `waves` is the transform of the potential at `top`, as spline coefficients.
    `reflected_waves` is the transform of the waves that a mirror at a distance `mirror_distance` (m) reflects, or None.
    `dipoles` represent the coil and its images, which repeat beyond the grid. `values` (levels, side, side; Wb/m) are
    potentials at the heights in `computed_levels`. Single precision is enough: its 1e-7 is far below the tables' error.
    """

    lowest: float
    spacing: float
    side: float
    top: float
    waves: ComplexArray
    dipoles: tuple[_Dipole, ...]
    values: Table
    computed_levels: set[int]
    mirror_distance: float = math.inf
    reflected_waves: ComplexArray | None = None

    def table(self, levels: Sequence[int]) -> Table:
        """Return potentials (levels, side, side; Wb/m) on the grids, after computing missing entries of `levels`."""
        missing = sorted({*levels} - self.computed_levels)
        count = len(self.waves)
        k, whole = _wave_numbers(count, self.spacing)
        for level in missing:
            height = self.lowest * 2.0 ** ((level - 1.0) / LEVELS)
            place = 0.5 * self.side * gauss(SMOOTH)[0]
            x, y = (part.ravel() for part in np.meshgrid(place, place))
            points = np.stack([x, y, np.full_like(x, self.top + height)], axis=1)
            wave_height = FAR * self.side if self.reflected_waves is None else FAR_BETWEEN * self.side
            field = _repeated_dipole_potential(points, place, self.dipoles, self.side, wave_height)
            to_grid = _grid_interpolation(count)
            repeated = np.asarray(to_grid @ field.reshape(SMOOTH, SMOOTH) @ to_grid.T)
            waves = self.waves * np.exp(-k * height)[whole]
            if self.reflected_waves is not None:  # the last levels serve the cubics alone, above the mirror
                waves += self.reflected_waves * np.exp(-k * max(self.mirror_distance - height,
                                                                -self.mirror_distance))[whole]
            self.values[level] = np.fft.ifft2(waves) - repeated
            self.computed_levels.add(level)
        return self.values


@record(eq=False)
class CoilPotential:
    """Vector potential of a coil with 1 A at any place above it, with the coil's centre at x = y = 0.

    The coil's images in mirrors below and above are included. `top` (m) is the height of the top track's mid-plane. The
    tables `octaves` hold from `nearest` (m) above it, in a square of width `side` (m). `dipoles` represent the coil and
    its images outside the tables.
    """

    top: float
    side: float
    nearest: float
    octaves: tuple[_Octave, ...]
    dipoles: tuple[_Dipole, ...]

    def __call__(self, points: Array) -> ComplexArray:
        """Return A_x + i A_y (n; Wb/m) at points (n, 3; m). A_z is 0.

        Outside the tables the coil is a dipole (`_dipole_potential`).
        """
        height = np.maximum(points[:, 2] - self.top, self.nearest)
        octave = np.floor(np.log2(height / self.nearest) + 1e-12).astype(np.intp)
        widest = max(octave.spacing for octave in self.octaves)
        beside = np.maximum(np.abs(points[:, 0]), np.abs(points[:, 1])) > 0.5 * self.side - 3.0 * widest
        octave[beside | (octave >= len(self.octaves))] = -1
        potential = np.empty(len(points), dtype=complex)
        for number in np.flatnonzero(np.bincount(octave + 1)) - 1:
            chosen = np.flatnonzero(octave == number)
            if number < 0:
                potential[chosen] = sum(_dipole_potential(points[chosen], dipole) for dipole in self.dipoles)
                continue
            for some in (chosen[part] for part in slices(len(chosen), AT_ONCE)):
                table = self.octaves[number]
                potential[some] = _interpolate_potential(table, points[some], height[some], 0.5 * self.side)
        return potential


@record(eq=False)
class Plane:
    """Mirror normal to z, at a height `z` (m).

    `reflection_factor` returns the ratio (no unit) of the reflected to the incident wave for wave numbers (1/m). If
    None, the ratio is -1, a perfect conductor.
    """

    z: float
    reflection_factor: ReflectionFactor | None = None

    def factor(self, k: Array) -> ComplexArray:
        """Return the ratio (no unit) of the reflected to the incident wave for each wave number `k` (1/m)."""
        return np.full(k.shape, -1.0 + 0.0j) if self.reflection_factor is None else self.reflection_factor(k)


def coil_potentials(
    tracks: Sequence[PolylineTrack], nearest: float, reach: float, floor: Plane | None = None,
    roof: Plane | None = None, is_lossy: bool = False,
) -> tuple[CoilPotential, ...]:
    """Tabulate the vector potential (Wb/m) above tracks in series, in layers above each other.

    The current runs along the corners of each track.

    Parameters
    ----------
    tracks : sequence of PolylineTrack
        layers of the coil
    nearest : float
        least height above the top layer's mid-plane for which the table holds (m)
    reach : float
        radius about the centre in which the table is finest (m)
    floor : Plane or None, optional
        mirror below the coil, if any
    roof : Plane or None, optional
        mirror above the coil, if any. The table holds below it.
    is_lossy : bool, optional
        whether to return a second potential, the part reflected out of phase

    Returns
    -------
    tuple of CoilPotential
            potential in phase with the current (real parts of the reflection factors). If `is_lossy`, also the
        potential that the mirrors reflect out of phase (imaginary parts)

    Notes
    -----
    A wave of sheet current has the potential mu0 / 2 k times itself, which falls with height like exp(-k z) (Laplace's
    equation, textbook). Between two mirrors, waves are reflected repeatedly.
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
    again, falls = _roof_factors(quarter, top, floor, roof)
    rising = np.zeros((parts, count, count), dtype=complex)
    falling = np.zeros((parts * (roof is not None), count, count), dtype=complex)
    for track in tracks:
        layer = _source_spectrum(track.corners.tobytes(), track.width, count, spacing)
        through = each_wave * (1.0 + (quarter * track.thickness) ** 2 / 24.0)
        up = np.exp(-quarter * (top - track.z))
        back = np.zeros_like(quarter) if floor is None else np.exp(-quarter * (top + track.z - 2.0 * floor.z))
        if roof is None:
            rising[0] += layer * (through * (up if factor is None else up + factor.real * back))[whole]
            if is_lossy and factor is not None:
                rising[1] += layer * (through * factor.imag * back)[whole]
            continue
        risen = through * (up if factor is None else up + factor * back) * again
        for part, of in enumerate((np.real, np.imag)[:parts]):
            rising[part] += layer * of(risen)[whole]
            falling[part] += layer * of(risen * falls)[whole]
    potentials: list[CoilPotential] = []
    for part, of in enumerate((np.real, np.imag)[:parts]):
        dipoles = _dipoles(tracks, _images(float(quarter[0, 1]), floor, roof), of)
        octaves = tuple(
            _octave(rising[part], falling[part] if roof is not None else None, side, nearest * 2.0**n, top,
                    math.inf if roof is None else roof.z - top, dipoles, n) for n in range(OCTAVES))
        potentials.append(CoilPotential(top, side, nearest, octaves, dipoles))
    return tuple(potentials)


def _roof_factors(k: Array, top: float, floor: Plane | None, roof: Plane | None) -> tuple[ComplexArray, ComplexArray]:
    """Return two factors (no unit) by which a mirror above the coil changes waves at the height `top` (m).

    The first is the amplification of rising waves, the second the ratio of falling to rising waves. `k` are wave
    numbers (1/m), `top` is the top layer's mid-plane. With a floor, repeated reflections form a geometric series.
    """
    if roof is None:
        return np.ones(k.shape, dtype=complex), np.zeros(k.shape, dtype=complex)
    falls = roof.factor(k) * np.exp(-k * (roof.z - top))
    if floor is None:
        return np.ones(k.shape, dtype=complex), falls
    decay = np.exp(-k * (roof.z - top + 2.0 * (top - floor.z)))
    remainder = 1.0 - floor.factor(k) * falls * decay
    return np.asarray(1.0 / np.where(k > 0.0, remainder, 1.0)), falls


def _octave(
    rising: ComplexArray, falling: ComplexArray | None, side: float, lowest: float, top: float, above: float,
    dipoles: tuple[_Dipole, ...], number: int
) -> _Octave:
    """Return a coil's potential (Wb/m) on grids over one octave of heights.

    `rising` and `falling` are the transforms at the height `top` (m). `lowest` (m) is the octave's lowest height above
    it and `number` its number from 0. `above` (m) is the distance of the upper mirror. Dipoles that repeat beyond the
    grid are removed. The waves are divided by the spline's own values at the nodes, (2 + cos) / 3 of a wave.
    """
    whole = rising.shape[0]
    count = min(max(2 * math.ceil(0.5 * whole / 2**number), 64), whole)
    indices = np.r_[0 : count // 2, whole - count // 2 : whole]  # the longest waves, as a spectrum of fewer points
    spacing = side / count
    node_values = (2.0 + np.cos(2.0 * math.pi * np.fft.fftfreq(count))) / 3.0
    node_values[1::2] *= -1.0  # which moves the coil to the middle of the grid

    def coarse(waves: ComplexArray) -> ComplexArray:
        """Return the longest waves as the coefficients of a spline on the coarser grid."""
        return np.asarray(waves[np.ix_(indices, indices)] / (node_values[:, None] * node_values) * (count / whole) ** 2)

    values = np.empty((LEVELS + 3, count, count), dtype=np.complex64)
    returned = None if falling is None else coarse(falling)
    return _Octave(lowest, spacing, side, top, coarse(rising), dipoles, values, set(), above, returned)


def _wave_numbers(count: int, spacing: float) -> tuple[Array, tuple[Index, Index]]:
    """Return wave numbers (1/m) of one quadrant of a square Fourier grid, and indices that expand it to the whole grid.

    The indices are one array of rows and one of columns. They give the whole grid (count, count), because the other
    quadrants follow by symmetry. `spacing` (m) is the distance of neighbouring nodes.
    """
    number = np.minimum(np.arange(count), count - np.arange(count))
    k = 2.0 * math.pi / (count * spacing) * np.arange(count // 2 + 1)
    rows, columns = np.ix_(number, number)
    return np.hypot(k[:, None], k), (rows, columns)


@lru_cache(maxsize=2)
def _source_spectrum(corners: bytes, width: float, count: int, spacing: float) -> ComplexArray:
    """Return the spectrum (count, count) of a layer's sheet current (A/m, x + i y) on the grid, with rows along y.

    `corners` are the bytes of the track's corners (n, 2; m), so that equal layers share one cached result. The track
    has a `width` (m), the grid a `spacing` (m). The spectrum is divided by the splines' transform, sinc^4 (Hockney and
    Eastwood 1988).
    """
    track = PolylineTrack(np.frombuffer(corners).reshape(-1, 2), width, 0.0, 0.0)
    nodes, weights = gauss(TRACK_FILAMENTS)
    sheet = np.zeros(count * count, dtype=complex)
    for node, weight in zip(nodes, weights, strict=True):
        places, moments = _points_on_polyline(track.strand(0.5 * track.width * float(node)), spacing)
        (columns, along_x), (rows, along_y) = (
            _spline_weights(places[:, axis] / spacing + 0.5 * count) for axis in (0, 1))
        share = 0.5 * weight / spacing**2 * moments[:, None, None] * along_y[:, :, None] * along_x[:, None, :]
        at = (rows[:, :, None] % count) * count + columns[:, None, :] % count
        sheet += np.bincount(at.ravel(), share.real.ravel(), count * count)
        sheet += 1j * np.bincount(at.ravel(), share.imag.ravel(), count * count)
    wide = np.sinc(np.fft.fftfreq(count)) ** 4
    centred = np.fft.fft2(np.fft.ifftshift(sheet.reshape(count, count)))
    return np.asarray(centred / (wide[:, None] * wide))


def _points_on_polyline(corners: Array, spacing: float) -> tuple[Array, ComplexArray]:
    """Return Gauss points (n, 2; m) on a polyline, and the length vector (n; x + i y, m) that each represents.

    The sides between `corners` (m) are divided into pieces no longer than `spacing` (m).
    """
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


def _spline_weights(x: Array) -> tuple[Index, Array]:
    """Return the four grid nodes (n, 4) nearest to every place and their cubic B-spline weights (n, 4; no unit).

    `x` (n) are the places divided by the grid spacing. Source: de Boor, A Practical Guide to Splines, 1978.
    """
    first = np.floor(x).astype(np.intp)
    t = x - first
    u = 1.0 - t
    t2, u2 = t * t, u * u  # powers of arrays beyond the second cost a hundred products
    weights = np.stack([u2 * u, 4.0 + t2 * (3.0 * t - 6.0), 4.0 + u2 * (3.0 * u - 6.0), t2 * t], axis=1) / 6.0
    return first[:, None] + np.arange(-1, 3), weights


def _interpolate_potential(octave: _Octave, points: Array, height: Array, half: float) -> ComplexArray:
    """Return the potential (n; Wb/m) at points (n, 2 or 3; m; x and y are used) and heights above the coil (n; m).

    `half` (m) is half the side of the grid. On each grid, cubic splines interpolate. Between the heights of the grids,
    Lagrange's polynomial in the logarithm of the height interpolates (Abramowitz and Stegun 25.2.13).
    """
    count = len(octave.waves)
    (columns, along_x), (rows, along_y) = (
        _spline_weights((points[:, axis] + half) / octave.spacing) for axis in (0, 1))
    level = np.log2(height / octave.lowest) * LEVELS + 1.0
    lowest = np.clip(np.floor(level).astype(np.intp) - 1, 0, LEVELS - 1)
    t = level - lowest
    # Lagrange's weights for values at 0, 1, 2, 3
    a, b, c, d = t, t - 1.0, t - 2.0, t - 3.0
    up = np.stack([-b * c * d / 6.0, 0.5 * a * c * d, -0.5 * a * b * d, a * b * c / 6.0], axis=1)
    starts = np.flatnonzero(np.bincount(lowest)).tolist()
    flat = octave.table([first + k for first in starts for k in range(4)]).reshape(-1)
    # four neighbours along x are gathered as a single record: numpy needs half the time of rows of four
    runs = np.ndarray((len(flat) - 3,), dtype=f"V{4 * flat.itemsize}", buffer=flat, strides=(flat.itemsize,))
    base = (lowest * count + rows[:, 0]) * count + columns[:, 0]
    values, part = np.zeros((8, len(points))), np.empty((8, len(points)))
    for k in range(4):
        for row in range(4):
            run = runs[base + (k * count + row) * count].view(flat.real.dtype).reshape(-1, 8)
            values += np.multiply(run.T, up[:, k] * along_y[:, row], out=part)
    real, imaginary = np.einsum("xcn,nx->cn", values.reshape(4, 2, -1), along_x)
    return np.asarray(real + 1j * imaginary)


def _images(k: float, floor: Plane | None, roof: Plane | None) -> tuple[tuple[float, float, complex], ...]:
    """Return a coil and its images as (way, shift in m, strength without unit), with the coil first.

    `floor` and `roof` are the mirrors below and above, or None. A current at height z has its image at the height
    ``way * z + shift``, where `way` is 1 or -1. The strength is the image's horizontal current divided by the
    coil's. It follows from the mirrors' reflection factors at the wave number `k` (1/m).
    """
    at, images = np.array([k]), [(1.0, 0.0, 1.0 + 0.0j)]
    ends = [None if plane is None else complex(plane.factor(at)[0]) for plane in (floor, roof)]
    for plane, end in zip((floor, roof), ends, strict=True):
        if plane is not None and end is not None:
            images.append((-1.0, 2.0 * plane.z, end))
    (low, high) = ends
    if floor is None or roof is None or low is None or high is None:
        return tuple(images)
    apart = 2.0 * (roof.z - floor.z)
    for n in range(1, REPEATED + 1):
        returned = (low * high) ** n
        images += [(1.0, n * apart, returned), (1.0, -n * apart, returned),
                  (-1.0, 2.0 * floor.z - n * apart, low * returned), (-1.0, 2.0 * roof.z + n * apart, high * returned)]
    return tuple(images)


def _dipoles(
    tracks: Sequence[PolylineTrack], images: Sequence[tuple[float, float, complex]], of: Callable[[Any], Any]
) -> tuple[_Dipole, ...]:
    """Return the point dipoles (m2, m) that represent the coil and each of its images at a distance.

    `images` are the results of `_images`. `of` takes the real or the imaginary part of a strength. Images whose part is
    zero are omitted. The moment (m2) is the area by Gauss's shoelace formula, multiplied by the strength.
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
    """Return A_x + i A_y (n; Wb/m) of a dipole at points (n, 3; m).

    The loop has mu0 / (4 pi) m x r / r^3 (Jackson, Classical Electrodynamics, equation 5.55). The gap between the
    winding's open ends counts as one short piece of current.
    """
    square = points[:, 0] ** 2 + points[:, 1] ** 2 + (points[:, 2] - dipole.height) ** 2
    around = dipole.moment * 1j * (points[:, 0] + 1j * points[:, 1]) / (square * np.sqrt(square))
    return np.asarray(MU0 / (4.0 * math.pi) * (around + dipole.ends / np.sqrt(square)))


def _repeated_dipole_potential(
    points: Array, place: Array, dipoles: Sequence[_Dipole], side: float, height: float
) -> ComplexArray:
    """Return A_x + i A_y (n; Wb/m) of the periodic repetitions of dipoles, without the dipoles themselves.

    Parameters
    ----------
    points : array
        points of one height on a square grid (n, 3; m)
    place : array
        coordinates of the grid along x and along y (m)
    dipoles : sequence of _Dipole
        dipoles of the coil and its images
    side : float
        period of the repetitions along x and y (m)
    height : float
        distance from a dipole's plane at which the sum of waves replaces the sum over neighbours (m)

    Notes
    -----
    Near the plane of a dipole, the repetitions are eight neighbouring dipoles and the uniform field of all others.
    Farther away, all repetitions together are a few waves (Fourier series of 1 / r). There the grid hardly adds to the
    dipole's own field. Derived here.
    """
    potential = np.zeros(len(points), dtype=complex)
    distant = []
    for dipole in dipoles:
        if abs(float(points[0, 2]) - dipole.height) >= height:
            distant.append(dipole)
            continue
        around = side * np.array([[i, j, 0.0] for i, j in product((-1, 0, 1), repeat=2) if i or j])
        neighbours = (points - around[:, None]).reshape(-1, 3)
        potential += _dipole_potential(neighbours, dipole).reshape(-1, len(points)).sum(axis=0)
        # a uniform field B along z has the potential B x r / 2, or i B (x + i y) / 2 as a complex number
        even = -MU0 * dipole.moment / (4.0 * math.pi) * LATTICE_REST / side**3
        potential += 0.5j * even * (points[:, 0] + 1j * points[:, 1])
    if not distant:
        return potential
    components = 2.0 * math.pi / side * np.arange(-WAVES, WAVES + 1)
    k = np.hypot(components[:, None], components)
    k[WAVES, WAVES] = math.inf  # no constant term: a uniform potential drives no current
    every = np.zeros(k.shape, dtype=complex)
    for dipole in distant:
        decay = np.exp(-k * abs(float(points[0, 2]) - dipole.height)) / k
        every += decay * (dipole.moment * (components + 1j * components[:, None]) + dipole.ends)
        potential -= _dipole_potential(points, dipole)
    waves = np.exp(1j * place[:, None] * components)
    return np.asarray(potential + (0.5 * MU0 / side**2) * (waves @ every @ waves.T).ravel())


@lru_cache(maxsize=OCTAVES)
def _grid_interpolation(count: int) -> Array:
    """Return the matrix (count, SMOOTH; no unit) that interpolates a smooth field to the nodes of a grid's side.

    The field is given at `SMOOTH` Gauss points of the side.
    """
    return interpolation(SMOOTH, 2.0 * np.arange(count) / count - 1.0)
