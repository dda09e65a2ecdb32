"""What a target's surface is to those who drive it: classes of currents that its symmetry keeps apart, and how they are
answered by the metal within.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sitscad.arrays import Array, ComplexArray, Index
from sitscad.physics.constants import MU0
from sitscad.physics.eddy.body import Body
from sitscad.record import record


@record
class Metal:
    """What a target is made of, at a frequency (Hz): conductivity (S/m) and relative permeability."""

    frequency: float
    conductivity: float
    permeability: float = 1.0

    @property
    def square(self) -> complex:
        """Square of the complex wave number (1/m2) at which fields die away within it: j omega mu sigma (Landau and
        Lifshitz, Electrodynamics of Continuous Media, section 59).
        """
        return 2j * math.pi * self.frequency * MU0 * self.permeability * self.conductivity


class CurrentClass(Protocol):
    """Surface currents of one symmetry: every one the curl of a stream function (A), so that none has an end.
    `inductance` (n, n) in H is that of the functions with each other.
    """

    @property
    def inductance(self) -> Array:
        """Inductances (H) of the functions, (n, n), definite."""

    @property
    def in_plane(self) -> object:
        """What symmetry it has in the surface's plane, no unit: the image in a level mirror keeps that."""

    def drive(self, potential: Array) -> Array:
        """Flux linkages (n, fields) in Wb of vector potentials (points, 3, fields) in Wb/m at the surface's points."""

    def spread(self, functions: Array) -> Array:
        """What linkages of combinations (n, m) of the functions make of every potential, (points, 3, m) in m. It
        is also the current (A m) at every point that stands for a combination seen from afar.
        """

    @property
    def body(self) -> Body:
        """Energies (m) of the functions as potentials on the body, in vacuum and in metal."""

    @property
    def outside(self) -> Outside:
        """What they store outside of it."""


class Surface(Protocol):
    """A target's closed surface about its middle, near face at -z: points (m) that fields are taken at, and classes."""

    @property
    def points(self) -> Array:
        """Where fields are wanted: (points, 3) in m."""

    @property
    def classes(self) -> Sequence[CurrentClass]:
        """The currents (A), by symmetry."""

    @property
    def mirrored(self) -> tuple[Index, Index] | None:
        """The numbers (no unit) of the points mirrored across x = 0 and across y = 0, where every class is even or odd
        across both: its `in_plane` is then the two parities (1 or -1) of its stream functions. None where they are not.
        """


def made_definite(inductance: Array, constant: int) -> Array:
    """The matrix (n, n; H) of a class with an even stream function throughout: a constant one, whose number is given,
    is no current and stores nothing, so it is given some, which nothing drives. Derived here.
    """
    found = inductance.copy()
    found[constant, constant] += np.trace(inductance) / len(inductance)
    return found


LEAST = 1e-6
"""Least part of the energy within that counts as without (`Outside`): the integrals are good for no less."""


@record(eq=False)
class Outside:
    """What a class of functions (n) stores outside of the body, S - L, as the product of a matrix with its transpose:
    its inverse `into` (n, n; H^-1/2), and S^-1 times it, `through` (n, n; H^-1/2).
    """

    into: Array
    through: Array


def outside(inductance: Array, vacuum: Array) -> Outside:
    """The `Outside` of inductances L and energies S times mu0 (n, n; H). Of opposite currents on a foil's faces nearly
    all is within.
    """
    try:
        root = np.linalg.cholesky(vacuum - inductance)
        return Outside(np.linalg.inv(root), np.linalg.solve(vacuum, root))
    except np.linalg.LinAlgError:
        own = np.linalg.inv(np.linalg.cholesky(vacuum))
        parts, vectors = np.linalg.eigh(own @ (vacuum - inductance) @ own.T)
        size = np.sqrt(np.maximum(parts, LEAST))
        return Outside((vectors / size).T @ own, own.T @ (vectors * size))


def answer(one: CurrentClass, metal: Metal) -> ComplexArray:
    """1 - G (n, n; no unit) of a class: what drives (n, m; Wb) are answered with in metal is u' ((1 - G)^-1 - 1) u
    (Wb2/H) of u = `Outside.into` times them.

    Outside its currents store L, within 1/X = S (S - T)^-1 S - S (see `body`), and are driven by their linkages: the
    inverse of L + 1/X is Q'^-1 ((1 - G)^-1 - 1) Q^-1 with Q Q' = S - L and G = Q' S^-1 (S - T) S^-1 Q (Woodbury's
    formula; derived here). L is between a fifth and four fifths of S but for foils, so that nothing cancels.
    """
    jump = one.body.jump(metal.square, metal.permeability)
    through = one.outside.through
    found = np.empty(jump.shape, dtype=complex)
    found.real = np.eye(len(jump)) - MU0 * (through.T @ (jump.real @ through))
    found.imag = -MU0 * (through.T @ (jump.imag @ through))
    return found
