"""A thin plate on a soft pad: how far it bends where less than all of it is pressed.

Kirchhoff's plate with free edges on springs side by side (Winkler), which stand for the pad with its stiffness under
the whole plate. A bonded pad of silicone also passes pressure on sideways, within about its own thickness, so that
plates bend less than is found: near a tenth of the way strips by a tenth, squares twice as long as what presses by two
fifths, and a square hardly longer than that by two thirds and more (finite elements,
tests/validation/test_foil_on_pad.py). What is pressed evenly all over is not told: there the pad's rim gives way
first. SI units.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from sitscad.basics.arrays import Array

ORDER, NODES = 9, 28
"""Even polynomials along each side, and places of integration along each: the bending of the plates that are asked
about (a few hundredths to one) stands still within 1e-4 from 7 on."""

POISSON = 0.3  # Of metals 0.29 to 0.34; rigidity and shape go with it by a few hundredths


def rigidity(young_modulus: float, thickness: float) -> float:
    """The flexural rigidity (N m) of a plate: Young's modulus in Pa, thickness in m (Timoshenko, Woinowsky-Krieger,
    Theory of Plates and Shells, 1959, equation 3).
    """
    return young_modulus * thickness**3 / (12.0 * (1.0 - POISSON**2))


def bending(size: tuple[float, float], is_round: bool, pressed: tuple[float, float], stiffness: Array) -> Array:
    """How much more the middle of plates goes down than their outermost place, over what a rigid one does: (n,), no
    unit.

    `size` and `pressed` are the sides (m) of the plates and of the part of their middle that is pressed evenly,
    ellipses where `is_round`; `stiffness` (n,) is the rigidity over the springs' stiffness per area (m4). By Ritz's
    method (Timoshenko, Woinowsky-Krieger, Theory of Plates and Shells, 1959): the least of the energy of bending,
    springs and load over even polynomials, the edges free.
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
    found = np.linalg.solve(springs + stiffness[:, None, None] * plate, load[:, None])[..., 0]
    return np.asarray((found @ middle.T)[:, 0] - (found @ outer.T).min(axis=1))


def _places(is_round: bool) -> tuple[Array, Array]:
    """Places (n, 2) and weights (n,), no unit, of an integral over the square from -1 to 1, or the circle within it:
    Gauss points along sides and radius, even ones along the angle.
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
    """Even Legendre polynomials, their slopes and second slopes (no unit) by axis at places (n, 2; float64)."""
    even, columns = np.eye(2 * ORDER)[::2], np.frombuffer(places).reshape(-1, 2).T
    return tuple([[legendre.legval(column, legendre.legder(one, order)) for one in even] for column in columns]
                 for order in (0, 1, 2))


def _shapes(places: Array, half: Array) -> tuple[Array, Array, Array, Array]:
    """Products of even Legendre polynomials at places (n, 2) of the unit square, (n, terms), and their second slopes
    along x, along y and across (1/m2); terms of a total order no circle can tell apart are left out.
    """
    values, slopes, bends = _polynomials(np.ascontiguousarray(places).tobytes())
    pairs = [(i, j) for i in range(ORDER) for j in range(ORDER) if i + j < ORDER]

    def products(along: list[Array], across: list[Array]) -> Array:
        return np.stack([along[i] * across[j] for i, j in pairs], axis=1)

    return (
        products(values[0], values[1]),
        products(bends[0], values[1]) / half[0] ** 2,
        products(values[0], bends[1]) / half[1] ** 2,
        products(slopes[0], slopes[1]) / half.prod(),
    )
