"""A target over a mirror: what the image of its own eddy currents does to them.

The image is at least twice the target's distance away, so only long waves of the currents matter: a few combinations of
them are found once, at the nearest pose, those of each symmetry in the plane by themselves, for a level target's image
keeps that; at any other pose the image couples these alone (Woodbury's formula).
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

LEAST = 2e-4
"""Coupling with the image, in parts of a current's own energy, below which a combination is left out. What that leaves
out is 1e-5 of a change and 5e-4 of the loss that comes with it, at most: boxes and discs of 3 to 20 mm over mirrors,
moved and tilted."""

NOISE = 1e-5
"""Least energy of a current, in parts of the largest, that counts as more than the error of the integrals."""

MOST = 120
"""Combinations of one symmetry among which they are looked for, at most."""

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
        currents = np.tensordot(turn, self.currents, axes=(1, 1))
        return _coupling(_inverse_distance(points, mirror.floor), currents) * mirror.strength


def image_modes(surface: Surface, coarse: Surface, near_face: float, closest: float, mirror: Mirror) -> ImageModes:
    """The combinations that matter no nearer to the mirror than with the near face at z = `closest` (m).

    `coarse` is the same surface with as few points as resolve a field from there; `near_face` (m) is that face's height
    in it.
    """
    points = coarse.points - np.array([0.0, 0.0, near_face])
    inverse = _inverse_distance(points + np.array([0.0, 0.0, closest]), mirror.floor)
    groups: dict[object, list[int]] = {}
    for number, one in enumerate(surface.classes):
        groups.setdefault(one.in_plane, []).append(number)
    found = [_modes([surface.classes[k] for k in group], [coarse.classes[k] for k in group], inverse)
             for group in groups.values()]  # fmt: skip
    ends = np.cumsum([currents.shape[2] for _, currents in found])
    within = [np.zeros((len(one.inductance), int(ends[-1]))) for one in surface.classes]
    for group, (parts, currents), end in zip(groups.values(), found, ends, strict=True):
        for number, part in zip(group, parts, strict=True):
            within[number][:, end - currents.shape[2] : end] = part
    return ImageModes(tuple(within), points, np.concatenate([currents for _, currents in found], axis=2))


def _modes(
    classes: Sequence[CurrentClass], coarse: Sequence[CurrentClass], inverse: Array
) -> tuple[list[Array], Array]:
    """The combinations of classes of one symmetry: within each class, and their currents (A m), (points, 3, k)."""
    factors = [_factor(one.inductance) for one in classes]
    seen = np.concatenate([_by_energy(one, factor) for one, factor in zip(coarse, factors, strict=True)])
    basis = _range(seen, inverse)
    coupled, turned = np.linalg.eigh(_coupling(inverse, np.einsum("npc,nk->cpk", seen, basis, optimize=True)))
    basis = basis @ turned[:, np.abs(coupled) > LEAST]
    within, start = [], 0
    for factor in factors:
        within.append(factor @ basis[start : start + len(factor)])
        start += len(factor)
    return within, np.einsum("npc,nk->pck", seen, basis, optimize=True)


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


def _range(seen: Array, inverse: Array) -> Array:
    """An orthonormal basis of what currents (n, points, 3; A m) have returned to them, without what is too little: of
    many by some hundred random combinations (Halko, Martinsson and Tropp, SIAM Review 53, 2011), as its values die away
    exponentially.
    """

    def returned(currents: Array) -> Array:
        by_axis = np.einsum("npc,pq,c->nqc", currents, inverse, MU0 / (4.0 * math.pi) * MIRRORED, optimize=True)
        return by_axis.reshape(len(currents), -1)

    if len(seen) <= MOST:
        found = returned(seen)
    else:
        flat = seen.reshape(len(seen), -1)
        some = np.random.default_rng(0).standard_normal((MOST, *seen.shape[1:]))
        own = np.linalg.qr(flat @ returned(some).T)[0]
        kept = returned((own.T @ flat).reshape(MOST, *seen.shape[1:]))
        size, left = np.linalg.eigh(kept @ kept.T)
        found = own @ (left * np.sqrt(np.maximum(size, 0.0)))
    if found.shape[0] < found.shape[1]:
        size, basis = np.linalg.eigh(found @ found.T)
        return basis[:, _is_kept(size)]
    size, right = np.linalg.eigh(found.T @ found)
    return np.asarray(np.linalg.qr(found @ right[:, _is_kept(size)])[0])


def _is_kept(size: Array) -> NDArray[np.bool_]:
    # Squared values (H2 m-2) of what matters.
    return size > max(float(size[-1]) * 1e-9, (0.01 * LEAST) ** 2)


def _by_energy(one: CurrentClass, factor: Array) -> Array:
    # Currents at the points (n, points, 3) of functions that store one unit of energy each and share none.
    unit = np.asarray(np.linalg.inv(factor).T, dtype=float)
    return np.moveaxis(one.spread(unit), 2, 0)


def _inverse_distance(points: Array, floor: float) -> Array:
    image = points * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2.0 * floor])
    away = points[:, None] - image
    return np.asarray(1.0 / np.sqrt(np.einsum("pqc,pqc->pq", away, away)))


def _coupling(inverse: Array, currents: Array) -> Array:
    # of all three axes at once: (axes and points, combinations), of which a symmetry may keep none
    flat = currents.shape[0] * currents.shape[1], currents.shape[2]
    signed = (currents * MIRRORED[:, None, None]).reshape(flat)
    returned = (inverse @ currents).reshape(flat)
    return np.asarray(MU0 / (4.0 * math.pi) * (signed.T @ returned))


def combined(blocks: Sequence[ComplexArray], within: Sequence[Array]) -> ComplexArray:
    """Sum over the classes of within' block, (k, any), in the unit of the blocks."""
    found = np.zeros((within[0].shape[1], blocks[0].shape[1]), dtype=complex)
    for w, block in zip(within, blocks, strict=True):
        own, used = np.nonzero(w.any(axis=0))[0], np.nonzero(block.any(axis=0))[0]  # those of one symmetry
        found[np.ix_(own, used)] += w[:, own].T @ block[:, used]
    return found
