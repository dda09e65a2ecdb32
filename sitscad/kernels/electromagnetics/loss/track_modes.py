"""Cross-sections of parallel tracks and the Legendre modes of the current in them: orders, points, projections."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.special_functions import gauss, legendre, legendre_integrals

FIELD_POINTS = 3
"""Points across a track at which the field of distant currents is taken at most: it is smooth. Beside a bend it is less
so: three leave up to 0.0018 mu0 widths of L a bend (tests/validation/test_corner_current.py)."""

SMOOTH_POINTS = 4, 2
"""Points across and through a track at which what rings have beyond straight tracks is taken at most."""


@record
class ModeSet:
    """Highest orders across the width and through the thickness, and the Gauss points at which tracks see each other. A
    mode (a, b) is kept when a / across + b / through is at most 1, or every one when `full`.
    """

    across: int = 4
    through: int = 1
    points: tuple[int, int] = (4, 2)
    full: bool = False

    @property
    def orders(self) -> tuple[tuple[int, int], ...]:
        """Orders (across, through) of every mode, no unit; the first is (0, 0), the one that carries the current."""
        pairs = [(a, b) for b in range(self.through + 1) for a in range(self.across + 1)]
        if self.full:
            return tuple(pairs)
        return tuple((a, b) for a, b in pairs if a / self.across + b / max(self.through, 1) <= 1.0 + 1e-9)


def suited_modes(width: float, thickness: float, gap: float, depth: float, fine: bool) -> ModeSet:
    """Modes for tracks (m) at a skin depth (m): R within 1 % when `fine`, else 3 %. Legendre polynomials resolve a
    boundary layer of width / order^2 (Gottlieb and Orszag, Numerical Analysis of Spectral Methods, 1977): the orders
    follow the square root of width over depth, and of thickness over depth, by factors found here. The points follow
    them (a Gauss rule takes orders above its number of points for lower ones) and the width over `gap` (m), the least
    distance of tracks.
    """
    across = math.ceil((2.2 if fine else 1.8) * math.sqrt(width / depth))
    through = math.ceil((2.2 if fine else 1.5) * math.sqrt(thickness / depth))
    across, through = min(max(across, 6 if fine else 5), 24), min(max(through, 2), 12)
    near, deep = math.ceil((3.0 if fine else 2.0) + width / gap), math.ceil(1.0 + thickness / gap)
    return ModeSet(across, through, (min(max(across, near), 32), max(through + 1, min(deep, 16))))


def rough_modes(width: float, thickness: float, gap: float, depth: float) -> ModeSet:
    """The fewest modes for tracks (m) at a skin depth (m), as `suited_modes`: what they add to R within about a
    tenth.
    """
    across = min(max(2, math.ceil(1.1 * math.sqrt(width / depth))), 8)
    through = min(max(1, math.ceil(0.9 * math.sqrt(thickness / depth))), 4)
    return ModeSet(across, through, (min(max(across + 1, math.ceil(1.0 + width / gap)), 8), through + 1))


@record(eq=False)
class Cut:
    """Tracks where a plane crosses them at right angles, all arrays (n,) in metres. `across` and `height` are the
    centres in the plane, `length` is how much of each track's centre line the cut stands for, `curvature` (1/m) is that
    of the centre line, positive when `across` grows away from the centre.
    """

    across: Array
    height: Array
    width: Array
    thickness: Array
    length: Array
    curvature: Array

    @property
    def unit(self) -> float:
        """Length (m) in whose terms logarithms are taken: the mean radius of curvature, or the widest track."""
        bend = float(np.mean(np.abs(self.curvature)))
        return 1.0 / bend if bend > 0.0 else float(np.max(self.width))


def points_of(cut: Cut, modes: ModeSet) -> tuple[Array, Array]:
    """Places in the plane (n, points) at which the drive is wanted: across and height (m)."""
    x, z = local_points(modes)
    return cut.across[:, None] + 0.5 * cut.width[:, None] * x, cut.height[:, None] + 0.5 * cut.thickness[:, None] * z


def field_nodes(modes: ModeSet) -> Array:
    """Places across a track, in half widths (no unit), at which `integrated` wants the normal field of distant
    currents.
    """
    return gauss(min(FIELD_POINTS, modes.points[0]))[0]


def integrated(field: Array, cut: Cut, modes: ModeSet) -> Array:
    """Flux (n, points; Wb/m/A) between a track's centre line and its points, from the field (n, nodes; T/A): the
    integral of the polynomial through the nodes.
    """
    return np.asarray(0.5 * cut.width[:, None] * (field @ _integrals(modes)), dtype=np.float64)


@lru_cache(maxsize=16)
def _integrals(modes: ModeSet) -> Array:
    """What takes values at the nodes (nodes, points; in half widths) to the integral, from the middle to the points, of
    the polynomial through them.
    """
    nodes = field_nodes(modes)
    coefficients = np.linalg.inv(legendre(nodes.size - 1, nodes))
    return np.asarray(coefficients.T @ legendre_integrals(nodes.size - 1, local_points(modes)[0]).T)


def few_points(modes: ModeSet) -> ModeSet:
    """The set with no more points (numbers, no unit) than what is smooth over a cross-section needs: see
    `from_few_points`.
    """
    return replace(modes, points=(min(SMOOTH_POINTS[0], modes.points[0]), min(SMOOTH_POINTS[1], modes.points[1])))


@lru_cache(maxsize=16)
def from_few_points(modes: ModeSet) -> Array:
    """What takes values at the points of `few_points` to those of their polynomials at all points of a track: (few,
    points), no unit.
    """
    few = few_points(modes)
    across, through = (
        np.linalg.solve(legendre(few.points[k] - 1, gauss(few.points[k])[0]).T,
                        legendre(few.points[k] - 1, gauss(modes.points[k])[0]).T) for k in (0, 1)
    )
    return np.kron(across, through)


def mode_conductances(cut: Cut, conductivity: float, modes: ModeSet) -> Array:
    """Square roots (n, modes; sqrt(S m)) of what each mode of a metre of track conducts: sigma w t (2 a + 1) (2 b + 1),
    for the mean square of P_a is 1 / (2 a + 1) (Abramowitz and Stegun 22.2.10).
    """
    area = np.sqrt(conductivity * cut.width * cut.thickness)
    return np.asarray(area[:, None] * np.array([math.sqrt((2 * a + 1) * (2 * b + 1)) for a, b in modes.orders]))


@lru_cache(maxsize=16)
def local_points(modes: ModeSet) -> tuple[Array, Array]:
    """Gauss points of a cross-section in half widths and thicknesses (no unit), those through it running fastest."""
    nx, nz = modes.points
    return np.repeat(gauss(nx)[0], nz), np.tile(gauss(nz)[0], nx)


@lru_cache(maxsize=16)
def split_projection(modes: ModeSet) -> tuple[Array, Array]:
    """Weights (no unit) that project values at the points across (orders, points) and through a track on Legendre
    polynomials.
    """
    (gx, wx), (gz, wz) = gauss(modes.points[0]), gauss(modes.points[1])
    return (legendre(modes.across, gx) * 0.5 * wx[:, None]).T, (legendre(modes.through, gz) * 0.5 * wz[:, None]).T


@lru_cache(maxsize=16)
def projection(modes: ModeSet) -> Array:
    """Modes times the weights of the mean over a cross-section (modes, points), no unit: Gauss-Legendre quadrature."""
    across, through = split_projection(modes)
    return np.array([np.outer(across[a], through[b]).ravel() for a, b in modes.orders])
