"""Cross-sections of parallel tracks, and the Legendre modes of the current density: orders, points and projections.

A mode is a product of Legendre polynomials P_a across the width and P_b through the thickness.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.special_functions import gauss, legendre, legendre_integrals

FIELD_POINTS = 3
"""Largest number of points across a track at which the field of distant currents is evaluated.

This field is smooth except beside a bend. There, three points leave an error of L of up to 0.0018 mu0 widths for each
bend (tests/validation/test_corner_current.py).
"""

SMOOTH_POINTS = 4, 2
"""Largest numbers of points, across and through a track, for the flux of rings minus the flux of straight tracks."""


@record
class ModeSet:
    """Legendre modes of the current density in a track, and numbers of Gauss points.

    `across` and `through` are the highest orders across the width and through the thickness. `points` are the numbers
    of Gauss points across and through, at which tracks interact. A mode (a, b) is used if a / across + b / through is
    at most 1. With `full`, all modes are used.
    """

    across: int = 4
    through: int = 1
    points: tuple[int, int] = (4, 2)
    full: bool = False

    @property
    def orders(self) -> tuple[tuple[int, int], ...]:
        """Orders (across, through) of all modes that are used. The first is (0, 0), which carries the net current."""
        pairs = [(a, b) for b in range(self.through + 1) for a in range(self.across + 1)]
        if self.full:
            return tuple(pairs)
        return tuple((a, b) for a, b in pairs if a / self.across + b / max(self.through, 1) <= 1.0 + 1e-9)


def suited_modes(width: float, thickness: float, gap: float, depth: float, fine: bool) -> ModeSet:
    """Return modes for a resistance within 1 % if `fine`, else 3 %, of tracks (m) at a skin depth `depth` (m).

    Notes
    -----
    Legendre polynomials resolve a boundary layer of width / order^2 (Gottlieb and Orszag, Numerical Analysis of
    Spectral Methods, 1977). So the orders follow the square roots of width / depth and thickness / depth, by factors
    found here. The number of points follows the orders, because a Gauss rule takes higher orders for lower ones. It
    also follows the width divided by `gap` (m), the least distance of tracks.
    """
    across = math.ceil((2.2 if fine else 1.8) * math.sqrt(width / depth))
    through = math.ceil((2.2 if fine else 1.5) * math.sqrt(thickness / depth))
    across, through = min(max(across, 6 if fine else 5), 24), min(max(through, 2), 12)
    near, deep = math.ceil((3.0 if fine else 2.0) + width / gap), math.ceil(1.0 + thickness / gap)
    return ModeSet(across, through, (min(max(across, near), 32), max(through + 1, min(deep, 16))))


def rough_modes(width: float, thickness: float, gap: float, depth: float) -> ModeSet:
    """Return the fewest modes for screening: the added resistance at alternating current is right within about 10 %.

    Lengths are in metres: `width` and `thickness` of a track, `gap` the least distance of tracks, `depth` the skin
    depth.
    """
    across = min(max(2, math.ceil(1.1 * math.sqrt(width / depth))), 8)
    through = min(max(1, math.ceil(0.9 * math.sqrt(thickness / depth))), 4)
    return ModeSet(across, through, (min(max(across + 1, math.ceil(1.0 + width / gap)), 8), through + 1))


@record(eq=False)
class Cut:
    """Cross-sections of tracks in a plane that crosses them at right angles: arrays (tracks).

    In metres: `across` and `height` of the centres in the plane, `width`, `thickness`, and `length` of the centre line
    that the cross-section represents. `curvature` (1/m) belongs to the centre line. It is positive if `across` grows
    away from the centre of curvature.
    """

    across: Array
    height: Array
    width: Array
    thickness: Array
    length: Array
    curvature: Array

    @property
    def unit(self) -> float:
        """Unit of length (m) in logarithms of distances.

        It is the mean radius of curvature, or the width of the widest track if all are straight.
        """
        bend = float(np.mean(np.abs(self.curvature)))
        return 1.0 / bend if bend > 0.0 else float(np.max(self.width))


def gauss_point_positions(cut: Cut, modes: ModeSet) -> tuple[Array, Array]:
    """Return the positions across and in height (two arrays (tracks, points); m) of all Gauss points in a plane."""
    x, z = local_points(modes)
    return cut.across[:, None] + 0.5 * cut.width[:, None] * x, cut.height[:, None] + 0.5 * cut.thickness[:, None] * z


def field_nodes(modes: ModeSet) -> Array:
    """Return the points across a track (half widths) at which `flux_to_points` needs the field of distant currents."""
    return gauss(min(FIELD_POINTS, modes.points[0]))[0]


def flux_to_points(field: Array, cut: Cut, modes: ModeSet) -> Array:
    """Return the flux (tracks, points; Wb/m/A) between a track's centre line and its Gauss points.

    `field` (tracks, nodes; T/A) is the normal field at the nodes of `field_nodes`. The flux is the integral of the
    polynomial through these values.
    """
    return np.asarray(0.5 * cut.width[:, None] * (field @ _integrals(modes)), dtype=np.float64)


@lru_cache(maxsize=16)
def _integrals(modes: ModeSet) -> Array:
    """Return the matrix (nodes, points) that integrates the polynomial through values at the nodes.

    The integral runs from the track's centre to each point, in half widths.
    """
    nodes = field_nodes(modes)
    coefficients = np.linalg.inv(legendre(nodes.size - 1, nodes))
    return np.asarray(coefficients.T @ legendre_integrals(nodes.size - 1, local_points(modes)[0]).T)


def few_point_modes(modes: ModeSet) -> ModeSet:
    """Return the mode set with at most `SMOOTH_POINTS` Gauss points, enough for a smooth function on a cross-section.

    `few_point_interpolation` interpolates from these points to all points.
    """
    return replace(modes, points=(min(SMOOTH_POINTS[0], modes.points[0]), min(SMOOTH_POINTS[1], modes.points[1])))


@lru_cache(maxsize=16)
def few_point_interpolation(modes: ModeSet) -> Array:
    """Return the matrix (few points, points; no unit) that interpolates from points of `few_point_modes` to all points.

    It evaluates the polynomial through the values at the few points.
    """
    few = few_point_modes(modes)
    across, through = (
        np.linalg.solve(legendre(few.points[k] - 1, gauss(few.points[k])[0]).T,
                        legendre(few.points[k] - 1, gauss(modes.points[k])[0]).T) for k in (0, 1)
    )
    return np.kron(across, through)


def mode_conductances(cut: Cut, conductivity: float, modes: ModeSet) -> Array:
    """Return the square root of each mode's conductance per metre of track (tracks, modes; sqrt(S m)).

    The conductance is sigma w t (2 a + 1) (2 b + 1), because the mean square of P_a is 1 / (2 a + 1) (Abramowitz and
    Stegun 22.2.10).
    """
    area = np.sqrt(conductivity * cut.width * cut.thickness)
    return np.asarray(area[:, None] * np.array([math.sqrt((2 * a + 1) * (2 * b + 1)) for a, b in modes.orders]))


@lru_cache(maxsize=16)
def local_points(modes: ModeSet) -> tuple[Array, Array]:
    """Return the Gauss points of a cross-section: across (points; half widths) and through (points; half thicknesses).

    The index through the thickness runs fastest.
    """
    nx, nz = modes.points
    return np.repeat(gauss(nx)[0], nz), np.tile(gauss(nz)[0], nx)


@lru_cache(maxsize=16)
def split_projection(modes: ModeSet) -> tuple[Array, Array]:
    """Return weights (orders, points; no unit) that project values on Legendre polynomials, across and through.

    The first matrix is for values across the track's width, the second for values through its thickness.
    """
    (gx, wx), (gz, wz) = gauss(modes.points[0]), gauss(modes.points[1])
    return (legendre(modes.across, gx) * 0.5 * wx[:, None]).T, (legendre(modes.through, gz) * 0.5 * wz[:, None]).T


@lru_cache(maxsize=16)
def projection(modes: ModeSet) -> Array:
    """Return weights (modes, points; no unit) that project values at a cross-section's points on the modes.

    They are the weights of Gauss-Legendre quadrature, multiplied by the modes.
    """
    across, through = split_projection(modes)
    return np.array([np.outer(across[a], through[b]).ravel() for a, b in modes.orders])
