"""Changes of the inductances and resistances of coils by a target of finite size at any pose.

The eddy currents per unit of flux are solved once per frequency. For each pose, the coils' vector potential gives the
flux linkages, and so the currents.

A jaw or shield behind the coils is computed as a plane that reflects fields, called a mirror. The vector potential then
includes the image of every coil in this plane. The target has an image, too. A few weighted sums of the eddy current's
stream functions, called current patterns, are coupled to it (see `image`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.eddy.coil_potential import CoilPotential
from sitscad.kernels.electromagnetics.eddy.image import ImageModes, Mirror, sum_over_classes
from sitscad.kernels.electromagnetics.eddy.surface import Metal, Surface, solve_currents

Answered: TypeAlias = tuple[ComplexArray, ComplexArray | None, ComplexArray | None]
"""Change of inductance (H); responses of the image's current patterns to coils (no unit) and to each other (1/H)."""

AT_ONCE = 100_000
"""Largest number of target points, summed over coils and poses, for one evaluation of fields. It limits memory."""

NOTHING = 1e-11
"""Least squared drive of a class of currents at which its currents are solved, divided by the largest squared drive.

The squared drive of a class is the sum of linkage^2 / inductance over its functions, an estimate of the energy.
"""


@record(eq=False)
class SolvedTarget:
    """Metal target with the eddy currents that flux causes on its surface, solved at one frequency.

    `metal` is the material and the frequency. `near_face` (m) is the height of the near face in the surface's own
    frame. `mirror` is a reflecting plane behind the board, None if there is none. `images` are the current patterns by
    which the target couples to its own mirror image. `smooth` is the surface with fewer points, enough for the
    reflected field.
    """

    surface: Surface
    near_face: float
    metal: Metal
    mirror: Mirror | None = None
    images: ImageModes | None = None
    smooth: Surface | None = None

    @cached_property
    def currents(self) -> tuple[Array, ...]:
        """Currents per flux linkage (2 functions, functions; 1/H), one matrix for each symmetry class.

        Rows are the real parts, then the imaginary parts, because the flux linkages are real. The matrices hold for all
        poses.
        """
        currents = [solve_currents(each, self.metal, np.eye(len(each.functions.inductance)))
                    for each in self.surface.classes]
        return tuple(np.concatenate([current.real, current.imag]) for current in currents)

    @cached_property
    def image_currents(self) -> tuple[Array, ...]:
        """Currents (functions, 2 patterns; no unit) per current pattern of the mirror image, one matrix per class.

        Columns are the real parts, then the imaginary parts. Empty if there is no mirror.
        """
        parts = () if self.images is None else self.images.within
        halves = (np.split(reply @ combinations, 2) for reply, combinations in zip(self.currents, parts, strict=False))
        return tuple(np.concatenate(parts, axis=1) for parts in halves)

    @cached_property
    def image_inductance(self) -> ComplexArray | None:
        """Response (patterns, patterns; 1/H) of the current patterns to each other's flux. None if no mirror."""
        if self.images is None:
            return None
        return _complex_from_parts(_sum_class_products(self.images.within, self.image_currents), 1)

    def changes(self, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array) -> ComplexArray:
        """Return the changes of the coils' inductance matrix that the target causes (poses, coils, coils; H).

        Parameters
        ----------
        turns : array
            rotation matrices (poses, 3, 3) of the target about the middle of its near face
        places : array
            middle of the near face (poses, 3) (m)
        coils : sequence of CoilPotential
            vector potential of each coil about its own axis
        centres : array
            x and y of the coils' axes (coils, 2) (m)

        Notes
        -----
        The change is complex. Multiplied by j omega, it is the change of impedance.
        """
        return changes_at([self], turns, places, coils, centres)[0]

    def _changes(
        self, linked: Sequence[Array], couplings: Sequence[Array], shape: tuple[int, int], is_single_use: bool
    ) -> ComplexArray:
        """Return the change (poses, coils, coils; H) from the coils' flux linkages, with the target's mirror image.

        `linked` (one array per class; Wb) are the coils' linkages. `couplings` (one matrix per pose; H) couple the
        target to its image. They enter by Woodbury's formula (Golub and Van Loan, Matrix Computations, section 2.1).
        `shape` is (poses, coils). With `is_single_use`, systems are solved for these poses alone, without inverse
        matrices.
        """
        solve = self._change_solved_once if is_single_use else self._change_from_matrices
        total, driven, among = solve(linked, shape)
        if driven is None or among is None:
            return total
        for pose, coupling in enumerate(couplings):
            if np.iscomplexobj(coupling):
                system = coupling @ among
            else:  # two products of real numbers cost half
                system = coupling @ among.real + 1j * (coupling @ among.imag)
            system[np.diag_indices(len(system))] += 1.0
            total[pose] += driven[:, pose].T @ np.linalg.solve(system, coupling @ driven[:, pose])
        return total

    def _change_from_matrices(self, linked: Sequence[Array], shape: tuple[int, int]) -> Answered:
        """Return the change (poses, coils, coils; H) without the target's image, and two responses of image patterns.

        The second value is the response (patterns, poses, coils; no unit) of the patterns to the coils. The third is
        the response (patterns, patterns; 1/H) to each other. Both are None if there is no mirror.

        Notes
        -----
        Uses the matrices `currents`, which serve many poses. A target's change is -drive' system^-1 drive (reciprocity,
        derived here).
        """
        total = np.zeros((*shape, shape[1]), dtype=complex)
        for drive, reply in zip(linked, self.currents, strict=True):
            linkages = drive.reshape(-1, *shape).transpose(1, 2, 0)
            real, imaginary = (reply @ drive).reshape(2, -1, *shape).transpose(0, 2, 1, 3)
            total.real -= linkages @ real
            total.imag -= linkages @ imaginary
        if self.images is None:
            return total, None, None
        # the systems are symmetric: coils drive a combination as much as the combination drives the coils
        responses = _complex_from_parts(_sum_class_products(self.image_currents, linked), 0).reshape(-1, *shape)
        return total, responses, self.image_inductance

    def _change_solved_once(self, linked: Sequence[Array], shape: tuple[int, int]) -> Answered:
        """Return the change and the pattern responses (H, no unit, 1/H), solved for these poses alone.

        The values are equal to the values from `_change_from_matrices`. For few poses, this function costs less,
        because it needs no inverse matrices.
        """
        total = np.zeros((*shape, shape[1]), dtype=complex)
        responses, among = self._solve_class_currents(linked)
        for drive, response in zip(linked, responses, strict=True):
            total -= np.einsum("npc,npd->pcd", drive.reshape(-1, *shape), response.reshape(-1, *shape), optimize=True)
        if self.images is None:
            return total, None, None
        return total, sum_over_classes(responses, self.images.within).reshape(-1, *shape), among

    def _solve_class_currents(self, linked: Sequence[Array]) -> tuple[list[ComplexArray], ComplexArray | None]:
        """Return the currents (A) of every class, and the responses (1/H) between the image patterns.

        `linked` are the flux linkages (Wb) of each class. Classes with a negligible drive (`NOTHING`) get zero
        currents. The second value is None if there is no mirror.
        """
        images = self.images
        driven_classes = list(zip(self.surface.classes, linked, strict=True))
        size = [np.sum(drive**2 / np.diag(each.functions.inductance)[:, None], axis=0)
                for each, drive in driven_classes]
        least = NOTHING * np.max(size, axis=0)
        responses: list[ComplexArray] = []
        driven: list[ComplexArray] = []
        for number, (each, drive) in enumerate(driven_classes):
            if images is None and np.all(size[number] <= least):
                responses.append(np.zeros(drive.shape, dtype=complex))
                continue
            within = np.zeros((len(drive), 0)) if images is None else images.within[number]
            coupled = np.any(within != 0.0, axis=0)
            currents = solve_currents(each, self.metal, np.concatenate([drive, within[:, coupled]], axis=1))
            responses.append(currents[:, : drive.shape[1]])
            driven.append(np.zeros(within.shape, dtype=complex))
            driven[-1][:, coupled] = currents[:, drive.shape[1] :]
        return responses, None if images is None else sum_over_classes(driven, images.within)

    def _linkages(
        self, surface: Surface, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array
    ) -> list[Array]:
        """Return the flux linkages (functions, poses, coils; Wb) of each coil with each class of currents.

        Fields are evaluated at the points of `surface`, which has the same functions as the target's surface. `turns`,
        `places` and `centres` are explained in `changes`.
        """
        local = surface.points - np.array([0.0, 0.0, self.near_face])
        points = np.einsum("pij,nj->pni", turns, local) + places[:, None]
        flat = np.empty((len(places), len(centres), len(local)), dtype=complex)
        for number, (coil, (x, y)) in enumerate(zip(coils, centres, strict=True)):
            from_coil = (points - np.array([x, y, 0.0])).reshape(-1, 3)
            flat[:, number] = coil(from_coil).reshape(len(places), -1)
        components = np.stack([flat.real, flat.imag], axis=-1)
        fields = np.einsum("pcni,pij->njpc", components, turns[:, :2], optimize=True)
        potential = fields.reshape(len(local), 3, -1)
        linkages = (current_class.flux_linkages(potential) for current_class in surface.classes)
        return [each.reshape(-1, *fields.shape[2:]) for each in linkages]


def changes_at(
    targets: Sequence[SolvedTarget], turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array,
    is_single_use: bool = False, returned: Sequence[CoilPotential] = (),
) -> ComplexArray:
    """Return a target's changes of the coils' inductance matrix (targets, poses, coils, coils; H) by frequency.

    The coils' flux linkages are computed once for all frequencies.

    Parameters
    ----------
    targets : sequence of SolvedTarget
        the same target, solved at each frequency
    turns : array
        rotation matrices (poses, 3, 3) of the target about the middle of its near face
    places : array
        middle of the near face (poses, 3) (m)
    coils : sequence of CoilPotential
        vector potential of each coil about its own axis
    centres : array
        x and y of the coils' axes (coils, 2) (m)
    is_single_use : bool, optional
        whether to solve for these poses alone. For few poses this saves two thirds of the work, and memory.
    returned : sequence of CoilPotential, optional
        potentials that mirrors reflect, for the same centres. In the result, they follow the coils.

    Notes
    -----
    Reflected potentials come from as far as the mirror, so they vary smoothly. The target's surface with few points is
    enough for them.
    """
    first = targets[0]
    count = len(coils) + len(returned)
    changes = np.zeros((len(targets), len(places), count, count), dtype=complex)
    for some in slices(len(places), AT_ONCE // (len(first.surface.points) * len(centres))):
        posed = turns[some], places[some]
        linked = first._linkages(first.surface, *posed, coils, centres)
        if returned:
            more = first._linkages(first.smooth or first.surface, *posed, returned, centres)
            linked = [np.concatenate(tables, axis=2) for tables in zip(linked, more, strict=True)]
        couplings = []
        if first.images is not None and first.mirror is not None:
            couplings = [first.images.coupling(turn, place, first.mirror) for turn, place in zip(*posed, strict=True)]
        flat = [table.reshape(len(table), -1) for table in linked]
        for number, target in enumerate(targets):
            changes[number, some] = target._changes(flat, couplings, (len(places[some]), count), is_single_use)
    return changes


def rotation_matrices(angles: Array) -> Array:
    """Return rotation matrices Rx Ry Rz (n, 3, 3; no unit) for angles (n, 3; rad) about x, y and z (textbook).

    A matrix turns a point given in the target's frame into the sensor's frame.
    """
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles).T, np.sin(angles).T
    ones, zeros = np.ones_like(cx), np.zeros_like(cx)
    about_x = _stack_matrices((ones, zeros, zeros), (zeros, cx, -sx), (zeros, sx, cx))
    about_y = _stack_matrices((cy, zeros, sy), (zeros, ones, zeros), (-sy, zeros, cy))
    about_z = _stack_matrices((cz, -sz, zeros), (sz, cz, zeros), (zeros, zeros, ones))
    return np.asarray(about_x @ about_y @ about_z)


def _sum_class_products(left_tables: Sequence[Array], right_tables: Sequence[Array]) -> Array:
    """Return the sum of a' b over the symmetry classes, in the product of their units; a' is the transpose of a.

    Each class has one matrix a in `left_tables`, and one matrix b in `right_tables`.
    """
    return np.asarray(sum(a.T @ b for a, b in zip(left_tables, right_tables, strict=True)))


def _complex_from_parts(parts: Array, axis: int) -> ComplexArray:
    """Return complex numbers from real parts followed by imaginary parts along an axis, in the unit of `parts`."""
    real, imaginary = np.split(parts, 2, axis=axis)
    return np.asarray(real + 1j * imaginary)


def _stack_matrices(*rows: tuple[Array, Array, Array]) -> Array:
    """Return matrices (n, 3, 3) from three rows of three elements; each element is an array (n)."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
