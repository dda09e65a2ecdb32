"""Bending of a thin plate on a soft pad under a load on a part of the plate. SI units.

The model is Kirchhoff's plate with free edges on independent springs (Winkler), which have the stiffness of the pad. A
bonded silicone pad also spreads pressure sideways over about its thickness, so real plates bend less. Finite elements
show by how much if the bending is near a tenth of the displacement (tests/validation/test_foil_on_pad.py). Strips bend
10 % less than in the model. Squares twice as long as the loaded part bend 40 % less. Squares hardly longer than the
loaded part bend 65 % less or more. A uniform load on the whole plate causes no bending in the model. In reality the pad
is softer near its rim.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from sitscad.basics.arrays import Array

ORDER, NODES = 9, 28
"""Number of even Legendre polynomials along each side, and number of integration points along each side.

With 7 polynomials or more, `plate_deflection` changes by less than 1e-4. Plates in use have results of 0.03 to 1.
"""

POISSON = 0.3  # Of metals 0.29 to 0.34; rigidity and shape go with it by a few hundredths


def rigidity(young_modulus: float, thickness: float) -> float:
    """Return the flexural rigidity (N m) of a plate with a Young's modulus (Pa) and a thickness (m).

    Timoshenko, Woinowsky-Krieger, Theory of Plates and Shells, 1959, equation 3.
    """
    return young_modulus * thickness**3 / (12.0 * (1.0 - POISSON**2))


def plate_deflection(
    size: tuple[float, float], is_round: bool, pressed: tuple[float, float], stiffness: Array
) -> Array:
    """Return the bending of a plate on springs: displacement of its middle minus the least displacement of its edge.

    It is divided by the displacement of a rigid plate under the same force.

    Parameters
    ----------
    size, pressed : pairs of float
        side lengths (m) of the plate, and of the part in its middle that carries a uniform load
    is_round : bool
        plate and loaded part are ellipses; rectangles otherwise
    stiffness : array (n,)
        the plate's flexural rigidity (N m) divided by the stiffness of the springs per area (N/m3), in m4

    Returns
    -------
    array (n,)

    Notes
    -----
    Ritz's method (Timoshenko, Woinowsky-Krieger, Theory of Plates and Shells, 1959): the minimum of the energy of
    bending, springs and load over even polynomials, with free edges.
    """
    half = 0.5 * np.array(size)
    places, weights = _places(is_round)
    shapes, xx, yy, xy = _shapes(places, half)
    bent = xx + yy
    inside = weights[:, None] * half.prod()
    springs = shapes.T @ (inside * shapes)
    plate = bent.T @ (inside * bent) - (1.0 - POISSON) * (
        xx.T @ (inside * yy) + yy.T @ (inside * xx) - 2.0 * xy.T @ (inside * xy)
    )
    share = np.minimum(1.0, np.array(pressed) / np.array(size))
    load = weights @ _shapes(share * places, half)[0] * half.prod()
    rim = np.linspace(0.0, 0.5 * np.pi, 31)
    edge = np.stack([np.cos(rim), np.sin(rim)], axis=1)
    edge = edge if is_round else edge / abs(edge).max(axis=1, keepdims=True)
    outer, middle = (_shapes(where, half)[0] for where in (edge, np.zeros((1, 2))))
    amplitudes = np.linalg.solve(springs + stiffness[:, None, None] * plate, load[:, None])[..., 0]
    return np.asarray((amplitudes @ middle.T)[:, 0] - (amplitudes @ outer.T).min(axis=1))


def _places(is_round: bool) -> tuple[Array, Array]:
    """Return points (n, 2) and weights (n; no unit) of an integral over the square from -1 to 1, or over its circle.

    They are Gauss points along both sides of the square. In the inscribed circle they are Gauss points along the
    radius, and evenly spaced along the angle.
    """
    nodes, weights = legendre.leggauss(NODES)
    if not is_round:
        x, y = np.meshgrid(nodes, nodes, indexing="ij")
        return np.stack([x.ravel(), y.ravel()], axis=1), np.outer(weights, weights).ravel()
    radius, angle = 0.5 * (nodes + 1.0), 2.0 * np.pi * np.arange(4 * ORDER) / (4 * ORDER)
    x, y = np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    ring = 0.5 * weights * radius * 2.0 * np.pi / len(angle)
    return np.stack([x.ravel(), y.ravel()], axis=1), np.repeat(ring, len(angle))


@lru_cache(maxsize=16)
def _polynomials(places: bytes) -> tuple[list[list[Any]], ...]:
    """Return even Legendre polynomials, their first and their second derivatives at points, each by axis and order.

    `places` are the bytes of the points (n, 2; float64).
    """
    even, columns = np.eye(2 * ORDER)[::2], np.frombuffer(places).reshape(-1, 2).T
    return tuple([[legendre.legval(column, legendre.legder(series, order)) for series in even] for column in columns]
                 for order in (0, 1, 2))


def _shapes(places: Array, half: Array) -> tuple[Array, Array, Array, Array]:
    """Return products of even Legendre polynomials at points, and their second derivatives; each array is (n, terms).

    Points (n, 2) lie between -1 and 1, in units of the half sides `half` (m). The derivatives (1/m2) are along x, along
    y and mixed. Products above a total order are omitted, because they are not independent on a disc.
    """
    values, slopes, bends = _polynomials(np.ascontiguousarray(places).tobytes())
    pairs = [(i, j) for i in range(ORDER) for j in range(ORDER) if i + j < ORDER]

    def products(x_values: list[Array], y_values: list[Array]) -> Array:
        return np.stack([x_values[i] * y_values[j] for i, j in pairs], axis=1)

    return (
        products(values[0], values[1]),
        products(bends[0], values[1]) / half[0] ** 2,
        products(values[0], bends[1]) / half[1] ** 2,
        products(slopes[0], slopes[1]) / half.prod(),
    )
