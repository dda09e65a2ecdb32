"""Effect on a target of the mirror image of its own eddy currents.

The image is at least twice as far from the target as the mirror, so only long waves of the currents couple to it. A few
current patterns (weighted sums of stream functions) represent these waves. They are solved once, at the pose nearest to
the mirror, separately for each symmetry in the plane. The image of a level target keeps this symmetry. At any other
pose, only these patterns are coupled to the image (Woodbury's formula).
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
"""Sums of inverse distances (1/m), for currents parallel to the mirrors and for currents perpendicular to them."""


@record(eq=False)
class Folding:
    """Points of one quarter of a surface and their mirror images.

    `mirrored_points` (4, n) are the points of the quarter, mirrored across x = 0, across y = 0 and across both.
    `root_multiplicity` (n) is the square root of the number of distinct points among the four: a point in a mirror
    plane is its own image.

    Notes
    -----
    Currents with even or odd stream functions across both planes are determined by one quarter of the body. A mirror
    parallel to the surface keeps this symmetry. A sum over all pairs of points is therefore a sum over pairs in one
    quarter. Its kernel sums the inverse distances to a point and to its three mirror images, with signs.
    """

    mirrored_points: Index
    root_multiplicity: Array

    @property
    def quarter_points(self) -> Index:
        """Numbers (n; no unit) of the points in the quarter itself, without mirror images."""
        return np.asarray(self.mirrored_points[0])

    def kernels(self, points: Array, mirror: Mirror) -> Kernels:
        """Return sums of inverse distances (two arrays (4, n, n); 1/m) from the quarter's points to mirror images.

        The first array is for currents parallel to the mirror, the second for currents perpendicular to it. The first
        axis is the copy of the quarter: itself, mirrored across x = 0, across y = 0, across both. `points` (all, 3; m)
        cover the whole surface. A point in a symmetry plane is its own copy. It has a lower weight, so that it counts
        once.
        """
        weights = 0.25 * self.root_multiplicity[:, None] * self.root_multiplicity
        quarter = points[self.quarter_points]
        each = [inverse_distances(quarter, points[numbers], mirror) for numbers in self.mirrored_points]
        horizontal = np.stack([weights * inverse for inverse, _ in each])
        return horizontal, horizontal if mirror.roof is None else np.stack([weights * inverse for _, inverse in each])


def folding(surface: Surface) -> Folding | None:
    """Return the quarter of a surface and its mirror images (weights without unit). None if it has no mirror planes.

    Derived here: see `Folding`.
    """
    mirrored = surface.mirror_image_numbers
    if mirrored is None:
        return None
    across_x, across_y = mirrored
    all_four = np.stack([np.arange(len(across_x)), across_x, across_y, across_y[across_x]])
    # a point belongs to the quarter if its number is the least of its four
    numbers = all_four[:, np.min(all_four, axis=0) == all_four[0]]
    members = 1 + np.sum(np.diff(np.sort(numbers, axis=0), axis=0) != 0, axis=0)
    return Folding(numbers, np.sqrt(members))


def image_signs(parity: tuple[int, int]) -> Array:
    """Return the signs (4, 3; no unit) of the current's x, y and z components at the four mirror images of a point.

    Rows are the point itself, then its images across x = 0, across y = 0 and across both.

    Notes
    -----
    The stream function has `parity` (1 even, -1 odd) along x and y. Derived here: currents are perpendicular to the
    gradient of the stream function. Across x = 0 the x component has the parity of the stream function, and the y
    component has the opposite parity.
    """
    x, y = parity
    across_x, across_y = np.array([x, -x, -x], dtype=float), np.array([-y, y, -y], dtype=float)
    return np.stack([np.ones(3), across_x, across_y, across_x * across_y])


def sum_images_by_axis(kernels: Kernels, parity: tuple[int, int]) -> Sequence[Array]:
    """Return three matrices (n, n; 1/m) of inverse distances, for the currents' x, y and z components, in one quarter.

    They are the sums of `kernels` (from `Folding.kernels`) over the four mirror images. The signs are for a stream
    function with `parity` (1 or -1) along x and y.
    """
    (horizontal, vertical), signs = kernels, image_signs(parity).T
    if horizontal is vertical:
        return list(np.tensordot(signs, horizontal, axes=1))
    return [*np.tensordot(signs[:2], horizontal, axes=1), np.tensordot(signs[2], vertical, axes=1)]


def inverse_distances(points: Array, others_at: Array, mirror: Mirror) -> Kernels:
    """Return sums of inverse distances (n, m; 1/m) of points (n, 3; m) from the images of `others_at` (m, 3; m).

    The first sum is for currents parallel to the mirrors, the second for currents perpendicular to them.

    Notes
    -----
    Each term has its sign relative to the sign of a single image in `MIRRORED`. Between two mirrors, an image of an
    image has the sign of the current itself. A single mirror's only image counts with strength 1.
    """
    if mirror.roof is None:
        inverse = inverse_distance(points, others_at, *mirror.images[0][:2])
        return inverse, inverse
    is_real = all(strength.imag == 0.0 for _, _, strength in mirror.images)
    horizontal, vertical = np.zeros((2, len(points), len(others_at)), dtype=float if is_real else complex)
    for way, shift, strength in mirror.images:
        term = (strength.real if strength.imag == 0.0 else strength) * inverse_distance(points, others_at, way, shift)
        horizontal -= way * term
        vertical += term
    return horizontal, vertical


def inverse_distance(points: Array, image_points: Array, way: float, shift: float) -> Array:
    """Return 1 / distance (n, m; 1/m) of points (n, 3; m) from the images of `image_points` (m, 3; m).

    The image of a point at height z is at height `way` z + `shift` (m), with `way` 1 or -1.
    """
    image = image_points * np.array([1.0, 1.0, way]) + np.array([0.0, 0.0, shift])
    square = np.zeros((len(points), len(image)))
    for axis in range(3):
        offset = points[:, None, axis] - image[:, axis]
        square += offset * offset
    return np.asarray(1.0 / np.sqrt(square))


LEAST = 2e-4
"""Least coupling of a current pattern with its mirror image, divided by its own energy, at which the pattern is used.

Without the weaker patterns, the inductance change by the target is off by at most 1e-5, the loss by 5e-4. Cases: boxes
and discs of 3 to 20 mm over mirrors, moved and tilted.
"""

NOISE = 1e-5
"""Least energy of a current, divided by the largest energy, that exceeds the error of the integrals.

If the inductance matrix is not positive definite, lower energies are raised to this value.
"""

AMONG = 64
"""Number of pseudo-random current patterns, for one symmetry, from which the significant patterns are computed.

The number is doubled until at most a third of the patterns is significant. The omitted patterns change an inductance
change by less than 1e-11 (templates, compared with all patterns).
"""

REPEATED_IMAGES = 6
"""Number of repeated images between two mirrors, counted on each side of the target.

Without the images beyond, the effect of a front plate is off by 1e-4 (ratio).
"""

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Golden ratio minus 1 (no unit), the step of the pseudo-random numbers in `_significant_currents`."""

MIRRORED = np.array([-1.0, -1.0, 1.0])
"""Sign of a current's x, y and z components in its image in a perfect conductor normal to z (no unit).

Components along the conductor are reversed, the component perpendicular to it is not.
"""


@record
class Roof:
    """Metal in front of a target, replaced by planes that reflect fields.

    A plane reflects like a perfect conductor, multiplied by a strength (no unit). The `planes` (height in m, complex
    strength) together represent the metal. `far` (height in m, real strength) is one plane that represents it for waves
    that are reflected several times between both mirrors.
    """

    planes: tuple[tuple[float, complex], ...]
    far: tuple[float, float]


@record
class Mirror:
    """Plane behind a target that reflects fields, and the metal in front of the target.

    The plane is at the height `floor` (m), -inf if there is none. It reflects like a perfect conductor, multiplied by
    `strength` (no unit). `roof` is the metal in front, None if there is none.
    """

    floor: float
    strength: float = 1.0
    roof: Roof | None = None

    @property
    def scale(self) -> float:
        """Factor (no unit) on the coupling to the image in a single mirror; 1 with two mirrors.

        With two mirrors, `images` contain the strength of each image.
        """
        return self.strength if self.roof is None else 1.0

    @cached_property
    def images(self) -> tuple[tuple[float, float, complex], ...]:
        """Images as (way, shift in m, strength without unit): a current at height z has an image at way z + shift.

        The way is 1 or -1. Between two mirrors, every image has an image in the other mirror (textbook). The series
        ends after `REPEATED_IMAGES` images on each side.
        """
        floor: list[tuple[float, float, complex]] = [(-1.0, 2.0 * self.floor, self.strength)]
        if self.roof is None:
            return tuple(floor)
        images = [(-1.0, 2.0 * z, strength) for z, strength in self.roof.planes]
        if math.isinf(self.floor):
            return tuple(images)
        (z, strength), images = self.roof.far, floor + images
        apart, returned = 2.0 * (z - self.floor), self.strength * strength
        for n in range(1, REPEATED_IMAGES + 1):
            images += [(1.0, n * apart, returned**n), (1.0, -n * apart, returned**n)]
            images.append((-1.0, 2.0 * self.floor - n * apart, self.strength * returned**n))
            images.append((-1.0, 2.0 * z + n * apart, strength * returned**n))
        return tuple(images)

    @property
    def in_phase_part(self) -> Mirror:
        """Mirror with real strengths (no unit): only the part of the reflection in phase with the current."""
        if self.roof is None:
            return self
        planes = tuple((z, complex(strength.real)) for z, strength in self.roof.planes)
        return replace(self, roof=replace(self.roof, planes=planes))


@record(eq=False)
class ImageModes:
    """Current patterns by which a target couples to its own mirror image.

    `within` (functions, k; one array per class) are the flux linkages of the class's stream functions with the k
    patterns. `points` (points, 3; m) are relative to the middle of the near face. `currents` (points, 3, k; A m) are
    the patterns at these points. `folding` is the quarter of a symmetric target, None if the target has no symmetry.
    `parities` lists the symmetries along x and y, each with its number of patterns, in their order.
    """

    within: tuple[Array, ...]
    points: Array
    currents: Array
    folding: Folding | None
    parities: tuple[tuple[tuple[int, int], int], ...] = ()

    def coupling(self, turn: Array, place: Array, mirror: Mirror) -> Array:
        """Return the mutual inductances (k, k; H) of the current patterns with the images of all patterns.

        Parameters
        ----------
        turn : array
            rotation matrix (3, 3) of the target about the middle of its near face
        place : array
            middle of the near face (x, y, z; m)
        mirror : Mirror
            planes that reflect the currents

        Notes
        -----
        Method of images (Jackson, Classical Electrodynamics, problem 5.17, for a permeable half-space; images in a
        perfect conductor have the opposite sign).
        """
        fold = self.folding
        if fold is None or turn[2, 2] != 1.0:
            points = self.points @ turn.T + place
            currents = np.tensordot(turn, self.currents, axes=(1, 1))
            horizontal, vertical = inverse_distances(points, points, mirror)
            return _coupling([horizontal, horizontal, vertical], currents) * mirror.scale
        # a level target's symmetries stay independent, and a turn about z changes nothing
        kernels = fold.kernels(self.points + place, mirror)
        matrix, start = np.zeros((self.currents.shape[2],) * 2, dtype=kernels[1].dtype), 0
        for parity, count in self.parities:
            block = slice(start, start + count)
            currents = self.currents[fold.quarter_points, :, block] * fold.root_multiplicity[:, None, None]
            matrix[block, block] = _coupling(sum_images_by_axis(kernels, parity), np.moveaxis(currents, 1, 0))
            start += count
        return matrix * mirror.scale


def image_modes(surface: Surface, coarse: Surface, near_face: float, closest: float, mirror: Mirror) -> ImageModes:
    """Return the current patterns (A m) by which a target couples to its mirror image, and their flux linkages.

    They are complete for every pose with the near face at z = `closest` (m) or farther from the mirror.

    Parameters
    ----------
    surface : Surface
        target's surface
    coarse : Surface
        the same surface with fewer points, enough for fields from the distance of the image
    near_face : float
        height of the near face in the frame of `coarse` (m)
    closest : float
        height of the near face at the pose nearest to the mirror (m)
    mirror : Mirror
        planes that reflect the currents
    """
    points = coarse.points - np.array([0.0, 0.0, near_face])
    high, fold = points + np.array([0.0, 0.0, closest]), folding(coarse)
    seen_in = mirror.in_phase_part
    kernels = inverse_distances(high, high, seen_in) if fold is None else fold.kernels(high, seen_in)
    groups: dict[Any, list[int]] = {}
    for number, current_class in enumerate(surface.classes):
        groups.setdefault(current_class.symmetry_in_plane, []).append(number)
    solutions = []
    for parity, group in groups.items():
        classes, coarse_classes = [surface.classes[k] for k in group], [coarse.classes[k] for k in group]
        if fold is None:
            solutions.append(_modes(classes, coarse_classes, [kernels[0], *kernels]))
        else:
            within, quarter = _modes(classes, coarse_classes, sum_images_by_axis(kernels, parity), fold)
            solutions.append((within, _unfold_currents(quarter, fold, parity)))
    ends = np.cumsum([currents.shape[2] for _, currents in solutions])
    within = [np.zeros((len(current_class.functions.inductance), int(ends[-1]))) for current_class in surface.classes]
    for group, (parts, currents), end in zip(groups.values(), solutions, ends, strict=True):
        for number, part in zip(group, parts, strict=True):
            within[number][:, end - currents.shape[2] : end] = part
    all_of_them = np.concatenate([currents for _, currents in solutions], axis=2)
    counts = tuple((parity, currents.shape[2]) for parity, (_, currents) in zip(groups, solutions, strict=True))
    return ImageModes(tuple(within), points, all_of_them, fold, counts if fold is not None else ())


def _unfold_currents(currents: Array, fold: Folding, parity: tuple[int, int]) -> Array:
    """Return the current patterns (points, 3, k; A m) on the whole surface from the patterns on one quarter.

    `currents` of the quarter are weighted by `Folding.root_multiplicity`. `parity` is the symmetry along x and y.
    """
    unfolded = np.empty((int(fold.mirrored_points.max()) + 1, *currents.shape[1:]))
    unweighted = currents / fold.root_multiplicity[:, None, None]
    for numbers, sign in zip(fold.mirrored_points[::-1], image_signs(parity)[::-1],
                             strict=True):  # the quarter itself comes last
        unfolded[numbers] = unweighted * sign[:, None]
    return unfolded


def _modes(
    classes: Sequence[CurrentClass], coarse: Sequence[CurrentClass], inverse: Sequence[Array],
    fold: Folding | None = None
) -> tuple[list[Array], Array]:
    """Return the current patterns of one symmetry: flux linkages by class, and currents (points, 3, k; A m).

    They are the eigenvectors of the coupling to the image, relative to a current's own energy. `classes` belong to the
    fine surface, `coarse` are these classes on the surface with fewer points. `inverse` are inverse distances (1/m) for
    currents along x, y and z. With a `fold`, points cover a quarter, and currents are weighted by
    `Folding.root_multiplicity`.
    """
    factors = [_matrix_factor(currents.functions.inductance) for currents in classes]
    densities = np.concatenate([
        _unit_energy_currents(each, factor, fold) for each, factor in zip(coarse, factors, strict=True)])
    basis = _significant_currents(densities, inverse)
    coupled, turned = np.linalg.eigh(_coupling(inverse, np.einsum("npc,nk->cpk", densities, basis, optimize=True)))
    basis = basis @ turned[:, np.abs(coupled) > LEAST]
    within, start = [], 0
    for factor in factors:
        within.append(factor @ basis[start : start + len(factor)])
        start += len(factor)
    return within, np.einsum("npc,nk->pck", densities, basis, optimize=True)


def _matrix_factor(inductance: Array) -> Array:
    """Return a matrix F with F F' equal to an inductance matrix (n, n; in the square root of its unit).

    F is Cholesky's factor if the matrix is positive definite.

    Notes
    -----
    In a foil, currents that run in opposite directions on the two faces nearly cancel. Their energy is below the error
    of the integrals and may be computed as negative. Then every energy is raised to at least this error (`NOISE`). With
    too large an energy, these currents couple even less with the image.
    """
    try:
        return np.asarray(np.linalg.cholesky(inductance), dtype=float)
    except np.linalg.LinAlgError:
        energies, turned = np.linalg.eigh(0.5 * (inductance + inductance.T))
        least = max(NOISE * float(energies[-1]), -2.0 * float(energies[0]))
        return np.asarray(turned * np.sqrt(np.maximum(energies, least)))


def _significant_currents(densities: Array, inverse: Sequence[Array]) -> Array:
    """Return an orthonormal basis (n, k; no unit) of the currents whose reflected potential is significant.

    `densities` (n, points, 3; A m) are the n currents. `inverse` are inverse distances (1/m) for currents along x, y
    and z.

    Notes
    -----
    For many currents, some pseudo-random combinations are enough (Halko, Martinsson and Tropp, SIAM Review 53, 2011),
    because the singular values decay exponentially.
    """

    def returned(currents: Array) -> Array:
        parts = [sign * (currents[..., axis] @ inverse[axis]) for axis, sign in enumerate(MIRRORED)]
        return MU0 / (4.0 * math.pi) * np.stack(parts, axis=2).reshape(len(currents), -1)

    count, response = AMONG, densities
    while count < len(densities):
        flat = densities.reshape(len(densities), -1)
        k = np.arange(1.0, count * flat.shape[1] + 1.0)
        numbers = (GOLDEN * k * k % 1.0 - 0.5).reshape(count, *densities.shape[1:])  # Weyl's fractional parts
        subspace = np.linalg.qr(flat @ returned(numbers).T)[0]
        projected = returned((subspace.T @ flat).reshape(-1, *densities.shape[1:]))
        size, vectors = np.linalg.eigh(projected @ projected.T)
        if np.count_nonzero(_is_significant(size)) <= count // 3:
            return np.asarray(subspace @ vectors[:, _is_significant(size)])
        count *= 2
    response = returned(densities)
    size, basis = np.linalg.eigh(response @ response.T)
    return basis[:, _is_significant(size)]


def _is_significant(size: Array) -> Flags:
    """Whether each current pattern is significant, by its squared singular value (n, rising; H2/m2).

    Significant values are above 1e-9 of the largest value, and above the square of 0.01 `LEAST`.
    """
    return size > max(float(size[-1]) * 1e-9, (0.01 * LEAST) ** 2)  # squared singular values (H2/m2)


def _unit_energy_currents(currents: CurrentClass, factor: Array, fold: Folding | None) -> Array:
    """Return currents at the points (n, points, 3; A m), each with unit energy and orthogonal in energy.

    `factor` is the factor of the class's inductance matrix (see `_matrix_factor`). With a `fold`, points cover a
    quarter, and currents are weighted by `Folding.root_multiplicity`.
    """
    unit = np.asarray(np.linalg.inv(factor).T, dtype=float)
    densities = currents.potential_weights(unit)
    if fold is not None:
        densities = densities[fold.quarter_points] * fold.root_multiplicity[:, None, None]
    return np.moveaxis(densities, 2, 0)


def _coupling(inverse: Sequence[Array], currents: Array) -> Array:
    """Return mutual inductances (k, k; H) of k currents (3, points, k; A m) with their images (Neumann's formula).

    `inverse` are inverse distances (1/m) for the x, y and z components. k may be 0.
    """
    total = sum(sign * (component.T @ (near @ component))
                for near, component, sign in zip(inverse, currents, MIRRORED, strict=True))
    return np.asarray(MU0 / (4.0 * math.pi) * total)


def sum_over_classes(blocks: Sequence[ComplexArray], within: Sequence[Array]) -> ComplexArray:
    """Return the sum of W' B (k, any) over the symmetry classes, in the unit of the blocks; W' is the transpose of W.

    Each class has one matrix B in `blocks` (functions, any), and one matrix W in `within` (functions, k).
    """
    total = np.zeros((within[0].shape[1], blocks[0].shape[1]), dtype=complex)
    for w, block in zip(within, blocks, strict=True):
        rows, used = np.nonzero(w.any(axis=0))[0], np.nonzero(block.any(axis=0))[0]  # of one symmetry
        total[np.ix_(rows, used)] += w[:, rows].T @ block[:, used]
    return total
