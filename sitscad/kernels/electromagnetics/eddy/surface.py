"""Classes of surface currents that a target's symmetry keeps independent, and the response of the metal inside."""

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
    """Material of a target at a frequency (Hz): conductivity (S/m) and relative permeability."""

    frequency: float
    conductivity: float
    permeability: float = 1.0

    @property
    def square(self) -> complex:
        """Square of the complex wave number (1/m2) at which fields decay in the metal.

        It is j omega mu sigma (Landau and Lifshitz, Electrodynamics of Continuous Media, section 59).
        """
        return 2j * math.pi * self.frequency * MU0 * self.permeability * self.conductivity


class StreamFunctions(Protocol):
    """Stream functions (A) of surface currents of one symmetry, with their energies in any metal."""

    @property
    def inductance(self) -> Array:
        """Inductance matrix (n, n; H) of the functions, positive definite."""

    @property
    def body(self) -> BodyEnergies:
        """Energies (m) of the functions as potentials on the body, in vacuum and in metal."""

    @property
    def energies(self) -> Energies:
        """Energies inside the body and outside."""


class CurrentClass(Protocol):
    """Surface currents of one symmetry. Each is the curl of a stream function (A), so it is free of divergence."""

    @property
    def functions(self) -> StreamFunctions:
        """Stream functions of the currents."""

    @property
    def in_plane(self) -> object:
        """Symmetry in the surface's plane (no unit). The image in a level mirror keeps it."""

    def drive(self, potential: Array) -> Array:
        """Return flux linkages (n, fields; Wb) of vector potentials (points, 3, fields; Wb/m) at the points."""

    def spread(self, functions: Array) -> Array:
        """Return the weights (points, 3, m; m) of potentials in the linkages of combinations (n, m) of the functions.

        A weight is also the current (A m) at a point that represents the combination at a distance.
        """


class Surface(Protocol):
    """A target's closed surface, centred on the origin with its near face at -z.

    It has `points` (m) at which fields are evaluated, and classes of currents.
    """

    @property
    def points(self) -> Array:
        """Points (points, 3; m) at which fields are evaluated."""

    @property
    def classes(self) -> Sequence[CurrentClass]:
        """Classes of currents (A), by symmetry."""

    @property
    def mirrored(self) -> tuple[Index, Index] | None:
        """Numbers (no unit) of the points mirrored across x = 0 and across y = 0, or None.

        None if some class is neither even nor odd across one of these planes. Otherwise `in_plane` of each class is the
        two parities (1 or -1) of its stream functions.
        """


def made_definite(inductance: Array, constant: int) -> Array:
    """Return the inductance matrix (n, n; H) with an energy for its constant stream function.

    A constant stream function (number `constant`) has no current and stores no energy, so the matrix would be singular.
    No field drives the function, so its energy does not matter. Derived here.
    """
    definite = inductance.copy()
    definite[constant, constant] += np.trace(inductance) / len(inductance)
    return definite


@record(eq=False)
class Energies:
    """Energies of surface functions inside and outside the body, as matrices (n, n).

    `vacuum` (H) is S, the energy inside if the body is vacuum. `inverse` is the inverse of S (1/H). `outside` is the
    part of the energy outside, 1 - S^-1 L (no unit), with the inductance matrix L.
    """

    vacuum: Array
    inverse: Array
    outside: Array


def energies(inductance: Array, body: BodyEnergies) -> Energies:
    """Return the energies (H, 1/H, no unit) of functions with inductances (n, n; H) on a body."""
    vacuum = MU0 * body.vacuum
    inverse = np.linalg.inv(vacuum)
    return Energies(vacuum, np.asarray(inverse, dtype=float), np.eye(len(vacuum)) - inverse @ inductance)


def solve_currents(currents: CurrentClass, metal: Metal, drives: Array) -> ComplexArray:
    """Solve the currents (n, m; A) that linkages `drives` (n, m; Wb) cause in a class of currents in metal.

    Notes
    -----
    Outside, the currents store L. Inside they store 1/X = S (S - T)^-1 S - S (see `body`). They are driven by their
    linkages, so (L + 1/X) times the current is the drive. The form solved is (S - (S - T) (1 - S^-1 L)) times the
    current = (S - T) S^-1 times the drive (derived here). It avoids the inverses of S - T, nearly singular in poor
    conductors, and of S - L, nearly singular in foils.
    """
    jump, energies = MU0 * currents.functions.body.jump(metal.square, metal.permeability), currents.functions.energies
    real, imaginary = jump @ energies.outside
    system = (energies.vacuum - real) - 1j * imaginary
    real, imaginary = jump @ (energies.inverse @ drives)
    return np.linalg.solve(system, real + 1j * imaginary)
