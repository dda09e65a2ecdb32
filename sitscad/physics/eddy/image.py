"""A target over a mirror: what the image of its own eddy currents does to them.

The image is at least twice the target's distance away, so only long waves of the currents matter: a few combinations of
them are found once, at the nearest pose; at any other pose the image couples these alone (Woodbury's formula).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0
from sitscad.physics.eddy.surface import CurrentClass, Surface
from sitscad.record import record

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST = 5e-5
"""Coupling with the image, in parts of a current's own energy, below which a combination is left out."""

NOISE = 1e-5
"""Least energy of a current, in parts of the largest, that counts as more than the error of the integrals."""

MOST = 360
"""Combinations among which they are looked for, at most."""

MIRRORED = np.array([-1.0, -1.0, 1.0])
"""Currents along a perfect conductor are mirrored the other way round, those across it alike."""


@record
class Mirror:
    """A plane at z = `floor` (m) that returns fields as a perfect conductor does, times `strength`."""

    floor: float
    strength: float = 1.0


@record(eq=False)
class ImageModes:
    """The combinations: `within` by class (functions, k), in units of flux linkage, and the `currents` (A m) of each at
    `points` (m, from the middle of the near face): (points, 3, k).
    """

    within: tuple[Array, ...]
    points: Array
    currents: Array

    def coupling(self, turn: Array, place: Array, mirror: Mirror) -> Array:
        """Inductances (k, k) with their images: turned by (3, 3) about the near face's middle at `place` (3; m)."""
        points = self.points @ turn.T + place
        currents = np.einsum("ij,pjk->ipk", turn, self.currents, optimize=True)
        return _coupling(_inverse_distance(points, mirror.floor), currents) * mirror.strength


def image_modes(surface: Surface, coarse: Surface, near_face: float, closest: float, mirror: Mirror) -> ImageModes:
    """The combinations that matter no nearer to the mirror than with the near face at z = `closest` (m).

    `coarse` is the same surface with as few points as resolve a field from there; `near_face` (m) is that face's height
    in it.
    """
    points = coarse.points - np.array([0.0, 0.0, near_face])
    factors = [_factor(one.inductance) for one in surface.classes]
    seen = np.concatenate([_by_energy(one, factor) for one, factor in zip(coarse.classes, factors, strict=True)])
    inverse = _inverse_distance(points + np.array([0.0, 0.0, closest]), mirror.floor)
    signs = MU0 / (4.0 * math.pi) * MIRRORED
    returned = np.einsum("npc,pq,c->nqc", seen, inverse, signs, optimize=True).reshape(len(seen), -1)
    basis = _range(returned)
    coupled, turned = np.linalg.eigh(_coupling(inverse, np.einsum("npc,nk->cpk", seen, basis, optimize=True)))
    basis = basis @ turned[:, np.abs(coupled) > LEAST]
    within, start = [], 0
    for factor in factors:
        within.append(factor @ basis[start : start + len(factor)])
        start += len(factor)
    return ImageModes(tuple(within), points, np.einsum("npc,nk->pck", seen, basis, optimize=True))


def _factor(inductance: Array) -> Array:
    """A matrix whose product with its own transpose is an inductance matrix (n, n; in its unit).

    The faces of a foil all but cancel: currents that run against each other on both have an energy below what the
    integrals over the surface are good for, which may come out negative. They are given what those are good for: with
    more energy than they have they couple with the image even less.
    """
    try:
        return np.asarray(np.linalg.cholesky(inductance), dtype=float)
    except np.linalg.LinAlgError:
        energies, turned = np.linalg.eigh(0.5 * (inductance + inductance.T))
        least = max(NOISE * float(energies[-1]), -2.0 * float(energies[0]))
        return np.asarray(turned * np.sqrt(np.maximum(energies, least)))


def _range(returned: Array) -> Array:
    """An orthonormal basis of what a matrix (n, m) makes, without what is too little: of a large one by some hundred
    random combinations (Halko, Martinsson and Tropp, SIAM Review 53, 2011), as its values die away exponentially.
    """
    if returned.shape[1] > MOST:
        own = np.linalg.qr(returned @ np.random.default_rng(0).standard_normal((returned.shape[1], MOST)))[0]
        seen = own.T @ returned
        size, left = np.linalg.eigh(seen @ seen.T)
        returned = own @ (left * np.sqrt(np.maximum(size, 0.0)))
    size, right = np.linalg.eigh(returned.T @ returned)
    kept = size > max(float(size[-1]) * 1e-9, (0.01 * LEAST) ** 2)
    return np.asarray(np.linalg.qr(returned @ right[:, kept])[0])


def _by_energy(one: CurrentClass, factor: Array) -> Array:
    # Currents at the points (n, points, 3) of functions that store one unit of energy each and share none.
    unit = np.asarray(np.linalg.inv(factor).T, dtype=float)
    return np.moveaxis(one.spread(unit), 2, 0)


def _inverse_distance(points: Array, floor: float) -> Array:
    image = points * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2.0 * floor])
    away = points[:, None] - image
    return np.asarray(1.0 / np.sqrt(np.einsum("pqc,pqc->pq", away, away)))


def _coupling(inverse: Array, currents: Array) -> Array:
    found = sum(sign * (one.T @ (inverse @ one)) for sign, one in zip(MIRRORED, currents, strict=True))
    return np.asarray(MU0 / (4.0 * math.pi) * found)


def combined(blocks: Sequence[ComplexArray], within: Sequence[Array]) -> ComplexArray:
    """Sum over the classes of within' block, (k, any), in the unit of the blocks."""
    return np.asarray(sum(w.T @ block for w, block in zip(within, blocks, strict=True)))
