"""A target of finite size over coils, at any pose: what it changes of their inductances and resistances.

Its currents are solved once a frequency; a pose is a projection of the coils' vector potential on them. With a mirror
behind the coils the image of every coil is in its potential, and the image of the currents couples a few of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.eddy.coil_potential import CoilPotential
from sitscad.kernels.electromagnetics.eddy.image import ImageModes, Mirror, combined
from sitscad.kernels.electromagnetics.eddy.surface import Metal, Surface, answer

Answered: TypeAlias = tuple[ComplexArray, ComplexArray | None, ComplexArray | None]

AT_ONCE = 100_000
"""Points at which fields are worked out together."""

NOTHING = 1e-11
"""Part of the most that any class of currents answers, about, below which a class is left out."""


@record(eq=False)
class SolvedTarget:
    """A target of metal at a frequency, and the height (m) of its near face in the surface's own frame. With a
    mirror, the combinations that its image couples, and the surface with as few points as resolve what it returns.
    """

    surface: Surface
    near_face: float
    metal: Metal
    mirror: Mirror | None = None
    images: ImageModes | None = None
    smooth: Surface | None = None

    @cached_property
    def answers(self) -> tuple[Array, ...]:
        """What classes answer drives with (1/H), the imaginary parts below the real ones, (2 functions, functions): for
        many poses. What drives them is real.
        """
        found = [answer(one, self.metal, np.eye(len(one.functions.inductance))) for one in self.surface.classes]
        return tuple(np.concatenate([one.real, one.imag]) for one in found)

    @cached_property
    def image_answers(self) -> tuple[Array, ...]:
        """What the image's combinations drive (no unit) in every class, (functions, twice their number): real parts
        first, then imaginary ones.
        """
        parts = () if self.images is None else self.images.within
        both = (np.split(reply @ one, 2) for reply, one in zip(self.answers, parts, strict=False))
        return tuple(np.concatenate(parts, axis=1) for parts in both)

    @cached_property
    def among_images(self) -> ComplexArray | None:
        """What one of the image's combinations drives of another (1/H)."""
        return None if self.images is None else _complex(_summed(self.images.within, self.image_answers), 1)

    def changes(self, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array) -> ComplexArray:
        """Change of the coils' inductance matrix (poses, coils, coils; H, complex; times j omega the impedance). The
        target is turned by `turns` (poses, 3, 3) about the middle of its near face, which is at `places` (poses, 3) in
        metres; `coils` are the coils' potentials about their own axes, which are at `centres` (coils, 2; m).
        """
        return changes_at([self], turns, places, coils, centres)[0]

    def _changes(
        self, linked: Sequence[Array], couplings: Sequence[Array], shape: tuple[int, int], once: bool
    ) -> ComplexArray:
        """The change (poses, coils, coils; H) from what the coils drive (Wb) of every class, and what the image couples
        in every pose: Woodbury's formula (Golub and Van Loan, Matrix Computations, section 2.1); `once` without the
        systems' inverses.
        """
        total, driven, among = self._answered_once(linked, shape) if once else self._answered(linked, shape)
        if driven is None or among is None:
            return total
        for pose, coupling in enumerate(couplings):
            if np.iscomplexobj(coupling):
                both = coupling @ among
            else:  # two products of real numbers cost half
                both = coupling @ among.real + 1j * (coupling @ among.imag)
            both[np.diag_indices(len(both))] += 1.0
            total[pose] += driven[:, pose].T @ np.linalg.solve(both, coupling @ driven[:, pose])
        return total

    def _answered(self, linked: Sequence[Array], shape: tuple[int, int]) -> Answered:
        """The change (poses, coils, coils; H) without the image; what the coils drive (combinations, poses, coils; no
        unit) of the image's combinations, and those of each other (1/H): by `answers`. A target's change is -drive'
        system^-1 drive (reciprocity, derived here).
        """
        total = np.zeros((*shape, shape[1]), dtype=complex)
        for drive, reply in zip(linked, self.answers, strict=True):
            ways = drive.reshape(-1, *shape).transpose(1, 2, 0)
            real, imaginary = (reply @ drive).reshape(2, -1, *shape).transpose(0, 2, 1, 3)
            total.real -= ways @ real
            total.imag -= ways @ imaginary
        if self.images is None:
            return total, None, None
        # the systems are symmetric: what the coils drive of a combination is what that drives of them
        return total, _complex(_summed(self.image_answers, linked), 0).reshape(-1, *shape), self.among_images

    def _answered_once(self, linked: Sequence[Array], shape: tuple[int, int]) -> Answered:
        """`_answered` (H, no unit, 1/H) by systems that are solved for these poses alone."""
        total = np.zeros((*shape, shape[1]), dtype=complex)
        responses, among = self._driven_once(linked)
        for drive, response in zip(linked, responses, strict=True):
            total -= np.einsum("npc,npd->pcd", drive.reshape(-1, *shape), response.reshape(-1, *shape), optimize=True)
        if self.images is None:
            return total, None, None
        return total, combined(responses, self.images.within).reshape(-1, *shape), among

    def _driven_once(self, linked: Sequence[Array]) -> tuple[list[ComplexArray], ComplexArray | None]:
        """What is driven (A) in every class, and among the image's combinations (1/H)."""
        images = self.images
        driven_classes = list(zip(self.surface.classes, linked, strict=True))
        size = [np.sum(drive**2 / np.diag(one.functions.inductance)[:, None], axis=0) for one, drive in driven_classes]
        least = NOTHING * np.max(size, axis=0)
        responses: list[ComplexArray] = []
        driven: list[ComplexArray] = []
        for number, (one, drive) in enumerate(driven_classes):
            if images is None and np.all(size[number] <= least):
                responses.append(np.zeros(drive.shape, dtype=complex))
                continue
            within = np.zeros((len(drive), 0)) if images is None else images.within[number]
            own = np.any(within != 0.0, axis=0)
            found = answer(one, self.metal, np.concatenate([drive, within[:, own]], axis=1))
            responses.append(found[:, : drive.shape[1]])
            driven.append(np.zeros(within.shape, dtype=complex))
            driven[-1][:, own] = found[:, drive.shape[1] :]
        return responses, None if images is None else combined(driven, images.within)

    def _linked(
        self, surface: Surface, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array
    ) -> list[Array]:
        """What every coil drives (Wb) in every pose, by class: (functions, poses, coils); fields are taken at the
        points of a `surface` of the same functions.
        """
        local = surface.points - np.array([0.0, 0.0, self.near_face])
        points = np.einsum("pij,nj->pni", turns, local) + places[:, None]
        flat = np.empty((len(places), len(centres), len(local)), dtype=complex)
        for number, (coil, (x, y)) in enumerate(zip(coils, centres, strict=True)):
            from_coil = (points - np.array([x, y, 0.0])).reshape(-1, 3)
            flat[:, number] = coil(from_coil).reshape(len(places), -1)
        both = np.stack([flat.real, flat.imag], axis=-1)
        found = np.einsum("pcni,pij->njpc", both, turns[:, :2], optimize=True)
        potential = found.reshape(len(local), 3, -1)
        return [one.drive(potential).reshape(-1, *found.shape[2:]) for one in surface.classes]


def changes_at(
    targets: Sequence[SolvedTarget], turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array,
    once: bool = False, returned: Sequence[CoilPotential] = (),
) -> ComplexArray:
    """`SolvedTarget.changes` (H) of one target that was solved at several frequencies: (targets, poses, coils, coils).
    What the coils drive in it is worked out once for all of them. Where poses are few and no others follow, `once`
    spares the inverses of its systems: two thirds of the work, and their memory. After the coils come those whose
    field is `returned` alone, in the same places: from as far as the mirror it is as smooth as the image's own.
    """
    first = targets[0]
    count = len(coils) + len(returned)
    found = np.zeros((len(targets), len(places), count, count), dtype=complex)
    for some in slices(len(places), AT_ONCE // (len(first.surface.points) * len(centres))):
        posed = turns[some], places[some]
        linked = first._linked(first.surface, *posed, coils, centres)
        if returned:
            more = first._linked(first.smooth or first.surface, *posed, returned, centres)
            linked = [np.concatenate(both, axis=2) for both in zip(linked, more, strict=True)]
        couplings = []
        if first.images is not None and first.mirror is not None:
            couplings = [first.images.coupling(turn, place, first.mirror) for turn, place in zip(*posed, strict=True)]
        flat = [one.reshape(len(one), -1) for one in linked]
        for number, target in enumerate(targets):
            found[number, some] = target._changes(flat, couplings, (len(places[some]), count), once)
    return found


def turned(angles: Array) -> Array:
    """Rotations (n, 3, 3; no unit) about x, y and z by angles (n, 3) in rad: Rx Ry Rz (textbook), as applied to a point
    of the target.
    """
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles).T, np.sin(angles).T
    one, none = np.ones_like(cx), np.zeros_like(cx)
    about_x = _stacked((one, none, none), (none, cx, -sx), (none, sx, cx))
    about_y = _stacked((cy, none, sy), (none, one, none), (-sy, none, cy))
    about_z = _stacked((cz, -sz, none), (sz, cz, none), (none, none, one))
    return np.asarray(about_x @ about_y @ about_z)


def _summed(one: Sequence[Array], other: Sequence[Array]) -> Array:
    """Sum over the classes of the product of both, the first one turned over; in the product of their units."""
    return np.asarray(sum(a.T @ b for a, b in zip(one, other, strict=True)))


def _complex(parts: Array, axis: int) -> ComplexArray:
    """Real parts and, behind them along an axis, imaginary ones as complex numbers; in their unit."""
    real, imaginary = np.split(parts, 2, axis=axis)
    return np.asarray(real + 1j * imaginary)


def _stacked(*rows: tuple[Array, Array, Array]) -> Array:
    """Matrices (n, 3, 3) of rows of elements (n,) each."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
