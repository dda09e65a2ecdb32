"""A target of finite size over coils, at any pose: what it changes of their inductances and resistances.

Its currents are solved once a frequency; a pose is a projection of the coils' vector potential on them. With a mirror
behind the coils the image of every coil is in its potential, and the image of the currents couples a few of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.eddy.coil_potential import CoilPotential
from sitscad.physics.eddy.image import ImageModes, Mirror, combined
from sitscad.physics.eddy.interior import through_magnet
from sitscad.physics.eddy.skin import Skin
from sitscad.physics.eddy.surface import CurrentClass, Surface
from sitscad.record import record

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AT_ONCE = 100_000
"""Points at which fields are worked out together."""


@record(eq=False)
class SolvedTarget:
    """A target at one frequency: inverses of its classes' systems (1/H), and the height (m) of its near face in the
    surface's own frame. With a mirror, the combinations that its image couples, and what one drives of another.
    """

    surface: Surface
    near_face: float
    answers: tuple[ComplexArray, ...]
    mirror: Mirror | None = None
    images: ImageModes | None = None
    among_images: ComplexArray | None = None

    def changes(self, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array) -> ComplexArray:
        """Change of the coils' inductance matrix (H, complex; times j omega the impedance): (poses, coils, coils).

        The target is turned by `turns` (poses, 3, 3) about the middle of its near face, which is at `places` (poses, 3)
        in metres; `coils` are the coils' potentials about their own axes, which are at `centres` (coils, 2).
        """
        return changes_at([self], turns, places, coils, centres)[0]

    def _changes(self, linked: Sequence[Array], couplings: Sequence[Array], shape: tuple[int, int]) -> ComplexArray:
        """The change (H) from what the coils drive (Wb) of every class, and what the image couples in every pose."""
        total = np.zeros((*shape, shape[1]), dtype=complex)
        responses = []
        for drive, answer in zip(linked, self.answers, strict=True):
            response = answer @ drive
            total -= np.einsum("npc,npd->pcd", drive.reshape(-1, *shape), response.reshape(-1, *shape), optimize=True)
            responses.append(response)
        if self.images is None or self.among_images is None:
            return total
        driven = combined(responses, self.images.within).reshape(-1, *shape)
        for pose, coupling in enumerate(couplings):
            both = np.eye(len(coupling)) + coupling @ self.among_images
            total[pose] += driven[:, pose].T @ np.linalg.solve(both, coupling @ driven[:, pose])
        return total

    def _potential(self, turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array) -> Array:
        """Of every coil in every pose, in the target's own directions: (points, 3, poses * coils)."""
        local = self.surface.points - np.array([0.0, 0.0, self.near_face])
        points = np.einsum("pij,nj->pni", turns, local) + places[:, None]
        flat = np.empty((len(places), len(centres), len(local)), dtype=complex)
        for number, (coil, (x, y)) in enumerate(zip(coils, centres, strict=True)):
            from_coil = (points - np.array([x, y, 0.0])).reshape(-1, 3)
            flat[:, number] = coil(from_coil).reshape(len(places), -1)
        both = np.stack([flat.real, flat.imag], axis=-1)
        found = np.einsum("pcni,pij->njpc", both, turns[:, :2], optimize=True)
        return np.asarray(found.reshape(len(local), 3, -1))


def changes_at(
    targets: Sequence[SolvedTarget], turns: Array, places: Array, coils: Sequence[CoilPotential], centres: Array
) -> ComplexArray:
    """`SolvedTarget.changes` (H) of one target that was solved at several frequencies: (targets, poses, coils, coils).

    What the coils drive in it is worked out once for all of them.
    """
    first = targets[0]
    at_once = max(1, AT_ONCE // (len(first.surface.points) * len(centres)))
    found = np.zeros((len(targets), len(places), len(centres), len(centres)), dtype=complex)
    for k in range(0, len(places), at_once):
        some = slice(k, k + at_once)
        potential = first._potential(turns[some], places[some], coils, centres)
        linked = [one.drive(potential) for one in first.surface.classes]
        couplings = []
        if first.images is not None and first.mirror is not None:
            posed = zip(turns[some], places[some], strict=True)
            couplings = [first.images.coupling(turn, place, first.mirror) for turn, place in posed]
        for number, target in enumerate(targets):
            found[number, some] = target._changes(linked, couplings, (len(places[some]), len(centres)))
    return found


def solve(
    surface: Surface, near_face: float, skin: Skin, mirror: Mirror | None = None, images: ImageModes | None = None
) -> SolvedTarget:
    """The target's currents at the frequency of a skin."""
    answers = tuple(np.linalg.inv(one.inductance + _material(one, skin)).astype(complex) for one in surface.classes)
    if mirror is None or images is None:
        return SolvedTarget(surface, near_face, answers)
    driven = [(answer @ one).astype(complex) for answer, one in zip(answers, images.within, strict=True)]
    among = combined(driven, images.within)
    return SolvedTarget(surface, near_face, answers, mirror, images, among)


def _material(one: CurrentClass, skin: Skin) -> ComplexArray:
    """What the body's material adds to the inductances of a class (H)."""
    depths = one.depths(skin)
    return depths if skin.permeability == 1.0 else through_magnet(depths, one.vacuum, skin)


def turned(angles: Array) -> Array:
    """Rotations (n, 3, 3) about x, y and z by angles (n, 3) in rad: Rx Ry Rz, as applied to a point of the target."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles).T, np.sin(angles).T
    one, none = np.ones_like(cx), np.zeros_like(cx)
    about_x = _stacked((one, none, none), (none, cx, -sx), (none, sx, cx))
    about_y = _stacked((cy, none, sy), (none, one, none), (-sy, none, cy))
    about_z = _stacked((cz, -sz, none), (sz, cz, none), (none, none, one))
    return np.asarray(about_x @ about_y @ about_z)


def _stacked(*rows: tuple[Array, Array, Array]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
