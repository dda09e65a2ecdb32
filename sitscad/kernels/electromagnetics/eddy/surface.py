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
        """Square of the complex wave number (1/m2) at which fields decay in the metal: j omega mu sigma.

        Source: Landau and Lifshitz, Electrodynamics of Continuous Media, section 59.
        """
        return 2j * math.pi * self.frequency * MU0 * self.permeability * self.conductivity


class StreamFunctions(Protocol):
    """Stream functions (A) of surface currents with equal symmetry, and their energies inside and outside any metal."""

    @property
    def inductance(self) -> Array:
        """Inductance matrix (n, n; H) of the stream functions' currents, positive definite."""

    @property
    def body(self) -> BodyEnergies:
        """Energies (m) inside the target, in vacuum and in metal, of the functions as potentials on its surface."""

    @property
    def energies(self) -> Energies:
        """Energy matrices (H, 1/H, no unit) of the stream functions inside and outside the target."""


class CurrentClass(Protocol):
    """Surface currents of one symmetry. Each is the curl of a stream function (A), so it is free of divergence."""

    @property
    def functions(self) -> StreamFunctions:
        """Stream functions of the currents."""

    @property
    def symmetry_in_plane(self) -> object:
        """Symmetry in the plane of the near face (no unit).

        The target's image in a mirror parallel to this face has this symmetry, too.
        """

    def flux_linkages(self, potential: Array) -> Array:
        """Return the flux linkages (n, fields; Wb) of the n stream functions for vector potentials at the points.

        `potential` (points, 3, fields; Wb/m) holds x, y and z components. There is one field per coil and pose.
        """

    def potential_weights(self, functions: Array) -> Array:
        """Return the weights (points, 3, m; m) of potentials at the points in the flux linkages of m current patterns.

        `functions` (n, m) are the patterns as weights of the n stream functions. A weight is also the current moment (A
        m) at a point that represents the pattern at a distance.
        """


class Surface(Protocol):
    """Closed surface of a target, centred on the origin, with the near face (towards the coils) at negative z.

    It has `points` (m) at which fields are evaluated, and `classes` of currents, separated by symmetry.
    """

    @property
    def points(self) -> Array:
        """Positions (points, 3; m) on the surface at which the coils' fields are evaluated."""

    @property
    def classes(self) -> Sequence[CurrentClass]:
        """Classes of surface currents (A). Currents of different classes do not couple: their symmetries differ."""

    @property
    def mirror_image_numbers(self) -> tuple[Index, Index] | None:
        """For each point, the number (no unit) of its mirror image across x = 0 and across y = 0, or None.

        None if currents of some class are neither even nor odd across one of these planes. Otherwise
        `symmetry_in_plane` of each class is the two parities (1 or -1) of its stream functions.
        """


def definite_inductance(inductance: Array, constant: int) -> Array:
    """Return the inductance matrix (n, n; H) with an energy added for the constant stream function.

    A constant stream function (row `constant`) has no current and stores no energy, so the matrix would be singular. No
    field drives this function, so its energy has no effect on the result. Derived here.
    """
    definite = inductance.copy()
    definite[constant, constant] += np.trace(inductance) / len(inductance)
    return definite


@record(eq=False)
class Energies:
    """Energies of surface functions inside and outside the body, as matrices (n, n).

    `vacuum` (H) is S, the energy inside if the body is vacuum. `inverse` (1/H) is the inverse of S. `outside` is 1 -
    S^-1 L (no unit), with the inductance matrix L.
    """

    vacuum: Array
    inverse: Array
    outside: Array


def energies(inductance: Array, body: BodyEnergies) -> Energies:
    """Return the energy matrices (H, 1/H, no unit) of stream functions with inductances (n, n; H) on a body."""
    vacuum = MU0 * body.vacuum
    inverse = np.linalg.inv(vacuum)
    return Energies(vacuum, np.asarray(inverse, dtype=float), np.eye(len(vacuum)) - inverse @ inductance)


def solve_currents(currents: CurrentClass, metal: Metal, drives: Array) -> ComplexArray:
    """Return the eddy currents (n, m; A) of one symmetry class for flux linkages `drives` (n, m; Wb) in metal.

    Notes
    -----
    S is the energy matrix of the functions if the body is vacuum, T if it is metal (both from `body`). L is the
    inductance matrix of the surface currents I. Energy stored outside gives L, energy inside gives 1/X = S (S - T)^-1 S
    - S. The currents therefore follow from

        (L + 1/X) I = drives.

    The form solved is (derived here)

        (S - (S - T) (1 - S^-1 L)) I = (S - T) S^-1 drives.

    It avoids the inverse of S - T, nearly singular in poor conductors, and of S - L, nearly singular in foils.
    """
    functions = currents.functions
    jump = MU0 * functions.body.energy_difference(metal.square, metal.permeability)
    energies = functions.energies
    real, imaginary = jump @ energies.outside
    system = (energies.vacuum - real) - 1j * imaginary
    real, imaginary = jump @ (energies.inverse @ drives)
    return np.linalg.solve(system, real + 1j * imaginary)
