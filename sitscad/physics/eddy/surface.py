"""What a target's surface is to those who drive it: classes of currents that its symmetry keeps apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sitscad.arrays import Array, ComplexArray, Index
from sitscad.physics.eddy.skin import Skin


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
        """Of combinations (n, m) of the functions: what their linkages make of every potential, (points, 3, m) in m.

        It is also the current (A m) at every point that stands for a combination seen from afar.
        """

    @property
    def vacuum(self) -> Array:
        """Energies of the functions as potentials of vacuum within the body (`interior.of_vacuum`), times mu0 (H)."""

    def depths(self, skin: Skin) -> ComplexArray:
        """Their impedance over j omega (H), (n, n): mu0 times the skin's complex depths, of products of currents."""


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
        """The numbers of the points mirrored across x = 0 and across y = 0, where every class is even or odd across
        both: its `in_plane` is then the two parities (1 or -1) of its stream functions. None where they are not.
        """


def made_definite(inductance: Array) -> Array:
    """The matrix (H) of a class with an even stream function throughout: a constant one is no current and stores
    nothing, so it is given some, which nothing drives.
    """
    count = len(inductance)
    return np.asarray(inductance + np.trace(inductance) / count**2)
