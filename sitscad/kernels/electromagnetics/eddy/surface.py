"""What a target's surface is to those who drive it: classes of currents that its symmetry keeps apart, and how they are
answered by the metal within.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.body import BodyEnergies


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


class StreamFunctions(Protocol):
    """Stream functions (A) of surface currents of one symmetry, with what they store in any metal."""

    @property
    def inductance(self) -> Array:
        """Inductances (H) of the functions with each other, (n, n), definite."""

    @property
    def body(self) -> BodyEnergies:
        """Energies (m) of the functions as potentials on the body, in vacuum and in metal."""

    @property
    def energies(self) -> Energies:
        """Energies within the body and outside."""


class CurrentClass(Protocol):
    """Surface currents of one symmetry: each is the curl of a stream function (A), so that none has an end."""

    @property
    def functions(self) -> StreamFunctions:
        """The stream functions of the currents."""

    @property
    def in_plane(self) -> object:
        """What symmetry it has in the surface's plane, no unit: the image in a level mirror keeps that."""

    def drive(self, potential: Array) -> Array:
        """Flux linkages (n, fields) in Wb of vector potentials (points, 3, fields) in Wb/m at the surface's points."""

    def spread(self, functions: Array) -> Array:
        """What linkages of combinations (n, m) of the functions make of every potential, (points, 3, m) in m. It
        is also the current (A m) at every point that stands for a combination seen from afar.
        """


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


@record(eq=False)
class Energies:
    """Energies of functions (n, n): S within a body of vacuum (H), its inverse (1/H), and the part of them that is
    outside, 1 - S^-1 L (no unit).
    """

    vacuum: Array
    inverse: Array
    outside: Array


def energies(inductance: Array, body: BodyEnergies) -> Energies:
    """What functions store (H, 1/H, no unit) by their inductances (n, n; H)."""
    vacuum = MU0 * body.vacuum
    inverse = np.linalg.inv(vacuum)
    return Energies(vacuum, np.asarray(inverse, dtype=float), np.eye(len(vacuum)) - inverse @ inductance)


def answer(one: CurrentClass, metal: Metal, drives: Array) -> ComplexArray:
    """What drives (n, m; Wb) of a class are answered with in metal (A).

    Outside its currents store L, within 1/X = S (S - T)^-1 S - S (see `body`), and are driven by their linkages: so
    L + 1/X times the answer is the drive, or (S - (S - T) (1 - S^-1 L)) times it is (S - T) S^-1 times the drive
    (derived here). Nothing is inverted that may be next to nothing: S - T of poor conductors, S - L of foils.
    """
    jump, known = MU0 * one.functions.body.jump(metal.square, metal.permeability), one.functions.energies
    real, imaginary = jump @ known.outside
    system = (known.vacuum - real) - 1j * imaginary
    real, imaginary = jump @ (known.inverse @ drives)
    return np.linalg.solve(system, real + 1j * imaginary)
