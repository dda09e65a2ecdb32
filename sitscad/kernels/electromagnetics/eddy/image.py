"""A target over a mirror: what the image of its own eddy currents does to them.

The image is at least twice the target's distance away, so only long waves of the currents matter: a few combinations of
them are found once, at the nearest pose, those of each symmetry in the plane by themselves, for a level target's image
keeps that; at any other pose the image couples these alone (Woodbury's formula).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Flags, Index
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.surface import CurrentClass, Surface

Kernels: TypeAlias = tuple[Array, Array]


@record(eq=False)
class Folding:
    """The points of a quarter, (4, n) by their numbers on the surface: themselves, mirrored across x = 0, across y = 0
    and across both; `share` (n) is the square root of how many points that is, for those in a plane are their own.

    Currents whose stream function is even or odd across both planes are known on a quarter of the body, and a level
    mirror returns them alike: sums over pairs of points are sums over pairs of the quarter's, with the inverse
    distances to a point and its mirrored ones added up with their signs first.
    """

    numbers: Index
    share: Array

    @property
    def kept(self) -> Index:
        """The quarter's own points (n), by number."""
        return np.asarray(self.numbers[0])

    def kernels(self, points: Array, mirror: Mirror) -> Kernels:
        """`inverse_distances` (1/m) of the points (all, 3; m), by which of their mirrored ones they are to the images
        of: each (4, n, n), points in a plane by their share.
        """
        shares = 0.25 * self.share[:, None] * self.share
        each = [inverse_distances(points[self.kept], points[one], mirror) for one in self.numbers]
        along = np.stack([shares * one for one, _ in each])
        return along, along if mirror.roof is None else np.stack([shares * one for _, one in each])


def folding(surface: Surface) -> Folding | None:
    """The folding (shares, no unit) of a surface; None of one without such planes, or whose currents are parted
    otherwise. Derived here: see `Folding`.
    """
    mirrored = surface.mirrored
    if mirrored is None:
        return None
    across_x, across_y = mirrored
    all_four = np.stack([np.arange(len(across_x)), across_x, across_y, across_y[across_x]])
    numbers = all_four[:, np.min(all_four, axis=0) == all_four[0]]  # each point stands with the least of its numbers
    members = 1 + np.sum(np.diff(np.sort(numbers, axis=0), axis=0) != 0, axis=0)
    return Folding(numbers, np.sqrt(members))


def signs(parity: tuple[int, int]) -> Array:
    """Signs (4, 3; no unit) of currents whose stream function has a parity along x and y: each component at a point's
    mirrored ones, in parts of that at the point. Derived here: currents are at right angles to how the stream function
    climbs, along x they are like it across x = 0 and unlike it across y = 0.
    """
    x, y = parity
    across_x, across_y = np.array([x, -x, -x], dtype=float), np.array([-y, y, -y], dtype=float)
    return np.stack([np.ones(3), across_x, across_y, across_x * across_y])


def by_axis(kernels: Kernels, parity: tuple[int, int]) -> Sequence[Array]:
    """Sums (1/m) of the `Folding.kernels` for the x, y and z components of currents of a parity: (n, n) each."""
    along, across = kernels
    if along is across:
        return list(np.tensordot(signs(parity).T, along, axes=1))
    return [*np.tensordot(signs(parity).T[:2], along, axes=1), np.tensordot(signs(parity).T[2], across, axes=1)]


def inverse_distances(points: Array, others: Array, mirror: Mirror) -> Kernels:
    """Sums of 1 over the distance (m) of points (n, 3) from the images of others (m, 3), (n, m) in 1/m: for currents
    along the mirrors, and for those across them, each with the sign that `MIRRORED` has for one image. Between two
    mirrors images of images have the currents' own sign. The only image of a single mirror counts in full.
    """
    if mirror.roof is None:
        found = inverse_distance(points, others, *mirror.images[0][:2])
        return found, found
    is_real = all(strength.imag == 0.0 for _, _, strength in mirror.images)
    along, across = np.zeros((2, len(points), len(others)), dtype=float if is_real else complex)
    for way, shift, strength in mirror.images:
        one = (strength.real if strength.imag == 0.0 else strength) * inverse_distance(points, others, way, shift)
        along -= way * one
        across += one
    return along, across


def inverse_distance(points: Array, others: Array, way: float, shift: float) -> Array:
    """1 over the distance (m) of points (n, 3) from others (m, 3) whose z is taken `way` (1 or -1) times and then
    shifted (m), (n, m) in 1/m.
    """
    image = others * np.array([1.0, 1.0, way]) + np.array([0.0, 0.0, shift])
    square = np.zeros((len(points), len(image)))
    for axis in range(3):
        away = points[:, None, axis] - image[:, axis]
        square += away * away
    return np.asarray(1.0 / np.sqrt(square))


LEAST = 2e-4
"""Coupling with the image, in parts of a current's own energy, below which a combination is left out. What that leaves
out is 1e-5 of a change and 5e-4 of the loss that comes with it, at most: boxes and discs of 3 to 20 mm over mirrors,
moved and tilted."""

NOISE = 1e-5
"""Least energy of a current, in parts of the largest, that counts as more than the error of the integrals."""

AMONG = 64
"""Combinations of one symmetry among which they are looked for; twice as many where more than a third of them count,
and so on: what that leaves out is below 1e-11 of a change (templates, against all combinations)."""

FURTHER = 6
"""Images of images between two mirrors, on each side: the next ones leave out 1e-4 of what a front plate changes."""

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)

MIRRORED = np.array([-1.0, -1.0, 1.0])
"""Currents along a perfect conductor are mirrored the other way round, those across it alike."""


@record
class Roof:
    """What is in front of a target: planes at z (m) that return fields as a perfect conductor does, each times a
    strength (no unit, complex), which together are like one metal; and one plane with a real strength, like it for what
    has gone to and fro between both mirrors.
    """

    planes: tuple[tuple[float, complex], ...]
    far: tuple[float, float]


@record
class Mirror:
    """A plane at z = `floor` (m; -inf: none) that returns fields as a perfect conductor does, times `strength`, and
    what is in front of the target.
    """

    floor: float
    strength: float = 1.0
    roof: Roof | None = None

    @property
    def scale(self) -> float:
        """Factor (no unit) of a single mirror's image; 1 of two mirrors, whose `images` have their own strengths."""
        return self.strength if self.roof is None else 1.0

    @cached_property
    def images(self) -> tuple[tuple[float, float, complex], ...]:
        """The images by `way`, shift (m) and strength (no unit): what is at z has one at way z + shift. Between two
        mirrors every image has one in the other mirror (textbook); those `FURTHER` on are left out.
        """
        floor: list[tuple[float, float, complex]] = [(-1.0, 2.0 * self.floor, self.strength)]
        if self.roof is None:
            return tuple(floor)
        found = [(-1.0, 2.0 * z, strength) for z, strength in self.roof.planes]
        if math.isinf(self.floor):
            return tuple(found)
        (z, strength), found = self.roof.far, floor + found
        apart, both = 2.0 * (z - self.floor), self.strength * strength
        for n in range(1, FURTHER + 1):
            found += [(1.0, n * apart, both**n), (1.0, -n * apart, both**n)]
            found.append((-1.0, 2.0 * self.floor - n * apart, self.strength * both**n))
            found.append((-1.0, 2.0 * z + n * apart, strength * both**n))
        return tuple(found)

    @property
    def in_phase(self) -> Mirror:
        """The mirror without what it returns out of phase."""
        if self.roof is None:
            return self
        planes = tuple((z, complex(strength.real)) for z, strength in self.roof.planes)
        return replace(self, roof=replace(self.roof, planes=planes))


@record(eq=False)
class ImageModes:
    """The combinations: `within` by class (functions, k), in units of flux linkage, and the `currents` (A m) of each at
    `points` (m, from the middle of the near face): (points, 3, k). Where the target can be folded, `parities` says how
    many of them, one after the other, have which symmetry.
    """

    within: tuple[Array, ...]
    points: Array
    currents: Array
    folding: Folding | None
    parities: tuple[tuple[tuple[int, int], int], ...] = ()

    def coupling(self, turn: Array, place: Array, mirror: Mirror) -> Array:
        """Inductances (k, k; H) of the combinations with their images, turned by (3, 3) about the near face's middle at
        `place` (3; m): the method of images (Jackson, Classical Electrodynamics, problem 5.17, for a permeable
        half-space; a perfect conductor's have the other sign).
        """
        fold = self.folding
        if fold is None or turn[2, 2] != 1.0:
            points = self.points @ turn.T + place
            currents = np.tensordot(turn, self.currents, axes=(1, 1))
            along, across = inverse_distances(points, points, mirror)
            return _coupling([along, along, across], currents) * mirror.scale
        # a level target's symmetries stay apart: turned about z it is what it was
        kernels = fold.kernels(self.points + place, mirror)
        found, start = np.zeros((self.currents.shape[2],) * 2, dtype=kernels[1].dtype), 0
        for parity, count in self.parities:
            own = slice(start, start + count)
            currents = self.currents[fold.kept, :, own] * fold.share[:, None, None]
            found[own, own] = _coupling(by_axis(kernels, parity), np.moveaxis(currents, 1, 0))
            start += count
        return found * mirror.scale


def image_modes(surface: Surface, coarse: Surface, near_face: float, closest: float, mirror: Mirror) -> ImageModes:
    """The combinations that matter no nearer to the floor than with the near face at z = `closest` (m). `coarse` is
    the same surface with as few points as resolve a field from there; `near_face` (m) is that face's height in it.
    """
    points = coarse.points - np.array([0.0, 0.0, near_face])
    high, fold = points + np.array([0.0, 0.0, closest]), folding(coarse)
    seen_in = mirror.in_phase
    kernels = inverse_distances(high, high, seen_in) if fold is None else fold.kernels(high, seen_in)
    groups: dict[Any, list[int]] = {}
    for number, one in enumerate(surface.classes):
        groups.setdefault(one.in_plane, []).append(number)
    found = []
    for parity, group in groups.items():
        classes, seen = [surface.classes[k] for k in group], [coarse.classes[k] for k in group]
        if fold is None:
            found.append(_modes(classes, seen, [kernels[0], *kernels]))
        else:
            within, quarter = _modes(classes, seen, by_axis(kernels, parity), fold)
            found.append((within, _unfolded(quarter, fold, parity)))
    ends = np.cumsum([currents.shape[2] for _, currents in found])
    within = [np.zeros((len(one.functions.inductance), int(ends[-1]))) for one in surface.classes]
    for group, (parts, currents), end in zip(groups.values(), found, ends, strict=True):
        for number, part in zip(group, parts, strict=True):
            within[number][:, end - currents.shape[2] : end] = part
    all_of_them = np.concatenate([currents for _, currents in found], axis=2)
    counts = tuple((parity, currents.shape[2]) for parity, (_, currents) in zip(groups, found, strict=True))
    return ImageModes(tuple(within), points, all_of_them, fold, counts if fold is not None else ())


def _unfolded(currents: Array, fold: Folding, parity: tuple[int, int]) -> Array:
    """Currents (A m) at all points, (points, 3, k), of those that have their share (see `Folding`) on a quarter."""
    found = np.empty((int(fold.numbers.max()) + 1, *currents.shape[1:]))
    own = currents / fold.share[:, None, None]
    for numbers, sign in zip(fold.numbers[::-1], signs(parity)[::-1], strict=True):  # themselves at last
        found[numbers] = own * sign[:, None]
    return found


def _modes(
    classes: Sequence[CurrentClass], coarse: Sequence[CurrentClass], inverse: Sequence[Array],
    fold: Folding | None = None
) -> tuple[list[Array], Array]:
    """The combinations of classes of one symmetry: within each class, and their currents (A m), (points, 3, k); of a
    quarter's points and with their share where that is folded. `inverse` distances (1/m) are by the axis of a current.
    They are the eigenvectors of the coupling (`_coupling`) over a current's own energy.
    """
    factors = [_factor(one.functions.inductance) for one in classes]
    seen = np.concatenate([_by_energy(one, factor, fold) for one, factor in zip(coarse, factors, strict=True)])
    basis = _range(seen, inverse)
    coupled, turned = np.linalg.eigh(_coupling(inverse, np.einsum("npc,nk->cpk", seen, basis, optimize=True)))
    basis = basis @ turned[:, np.abs(coupled) > LEAST]
    within, start = [], 0
    for factor in factors:
        within.append(factor @ basis[start : start + len(factor)])
        start += len(factor)
    return within, np.einsum("npc,nk->pck", seen, basis, optimize=True)


def _factor(inductance: Array) -> Array:
    """A matrix whose product with its own transpose is an inductance matrix (n, n; in its unit's root): Cholesky's. The
    faces of a foil all but cancel: currents that run against each other on both have an energy below what the integrals
    over the surface are good for, which may come out negative. They are given what those are good for: with more energy
    than they have they couple with the image even less.
    """
    try:
        return np.asarray(np.linalg.cholesky(inductance), dtype=float)
    except np.linalg.LinAlgError:
        energies, turned = np.linalg.eigh(0.5 * (inductance + inductance.T))
        least = max(NOISE * float(energies[-1]), -2.0 * float(energies[0]))
        return np.asarray(turned * np.sqrt(np.maximum(energies, least)))


def _range(seen: Array, inverse: Sequence[Array]) -> Array:
    """An orthonormal basis of what currents (n, points, 3; A m) have returned to them, without what is too little: of
    many by some random combinations (Halko, Martinsson and Tropp, SIAM Review 53, 2011), as its values die away
    exponentially.
    """

    def returned(currents: Array) -> Array:
        parts = [sign * (currents[..., axis] @ inverse[axis]) for axis, sign in enumerate(MIRRORED)]
        return MU0 / (4.0 * math.pi) * np.stack(parts, axis=2).reshape(len(currents), -1)

    count, found = AMONG, seen
    while count < len(seen):
        flat = seen.reshape(len(seen), -1)
        own = np.linalg.qr(flat @ returned(_mixed(count, *seen.shape[1:])).T)[0]
        kept = returned((own.T @ flat).reshape(-1, *seen.shape[1:]))
        size, left = np.linalg.eigh(kept @ kept.T)
        if np.count_nonzero(_is_kept(size)) <= count // 3:
            return np.asarray(own @ left[:, _is_kept(size)])
        count *= 2
    found = returned(seen)
    size, basis = np.linalg.eigh(found @ found.T)
    return basis[:, _is_kept(size)]


def _mixed(*shape: int) -> Array:
    """Numbers between -1/2 and 1/2 in no order, the same ones always (Weyl's fractional parts; no unit)."""
    k = np.arange(1.0, math.prod(shape) + 1.0)
    return np.asarray((GOLDEN * k * k % 1.0 - 0.5).reshape(shape))


def _is_kept(size: Array) -> Flags:
    """Which combinations, by squared values (n; H2/m2), are more than too little."""
    return size > max(float(size[-1]) * 1e-9, (0.01 * LEAST) ** 2)  # of squared values (H2 m-2)


def _by_energy(one: CurrentClass, factor: Array, fold: Folding | None) -> Array:
    """Currents at the points (n, points, 3; A m) of functions that store one unit of energy each and share none."""
    unit = np.asarray(np.linalg.inv(factor).T, dtype=float)
    spread = one.spread(unit)
    if fold is not None:
        spread = spread[fold.kept] * fold.share[:, None, None]
    return np.moveaxis(spread, 2, 0)


def _coupling(inverse: Sequence[Array], currents: Array) -> Array:
    """Inductances (k, k; H) of currents (3, points, k; A m) with their images at inverse distances (1/m) by axis:
    Neumann's formula; a symmetry may keep none.
    """
    found = sum(sign * (one.T @ (near @ one)) for near, one, sign in zip(inverse, currents, MIRRORED, strict=True))
    return np.asarray(MU0 / (4.0 * math.pi) * found)


def combined(blocks: Sequence[ComplexArray], within: Sequence[Array]) -> ComplexArray:
    """Sum over the classes of within' block, (k, any), in the unit of the blocks."""
    found = np.zeros((within[0].shape[1], blocks[0].shape[1]), dtype=complex)
    for w, block in zip(within, blocks, strict=True):
        own, used = np.nonzero(w.any(axis=0))[0], np.nonzero(block.any(axis=0))[0]  # those of one symmetry
        found[np.ix_(own, used)] += w[:, own].T @ block[:, used]
    return found
