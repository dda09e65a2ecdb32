"""What a target's surface is to those who drive it: classes of currents that its symmetry keeps apart; how far fields
enter a metal's faces and edges; and what a magnetic body adds, the field that runs through it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sitscad.arrays import Array, ComplexArray, Index
from sitscad.physics.constants import MU0
from sitscad.record import record

EDGE, EDGE_FROM = 1.4, 1.65
"""Rise of the impedance at an edge, and the thickness in skin depths at which half of it is there."""

EDGE_OF_MAGNETS = 0.95
"""Rise of the impedance at an edge for a metal of high permeability."""

WALL, MOST_WALL = 1.55, 1e3
"""Thickness in skin depths at which a wall has twice a thick plate's impedance; the most that it has."""


@record
class Skin:
    """A metal at one frequency: what sheets on its faces see.

    `even` and `odd` (m, complex: impedance over j omega mu0) are of currents alike and opposite on both faces, `edge`
    is the rise at an edge, which dies away with `decay` (1/m), `wall` the factor on side walls. `inner` is the part of
    the field between the faces that is none of the skin's, 1 of a metal that is not magnetic (`through_magnet`).

    A face's two sides of a plate act together: currents that run alike on both see coth, opposite ones tanh of half the
    thickness in skin depths; the field between the two sheets that stand for them is taken off. At an edge the field
    enters from two sides: near it the impedance is larger (`EDGE`), and the wall of a plate thinner than the skin depth
    carries nothing of its own (`WALL`). Both laws were fitted to discs of finite elements (tests/validation): with them
    the change of inductance is right to 0.4 %, the resistance to 2 %, from foils of a third of a skin depth on. Of
    magnetic metals the rise at edges is smaller (`EDGE_OF_MAGNETS`), and their change right to 1.5 % of its size.
    """

    even: complex
    odd: complex
    edge: float
    decay: complex
    wall: float
    permeability: float = 1.0
    inner: float = 1.0

    def face(self, parity: int) -> complex:
        """Depth (m) for a stream function of that parity across the plate: an odd one's currents run alike."""
        return self.odd if parity == 1 else self.even


def skin(frequency: float, conductivity: float, thickness: float, permeability: float = 1.0) -> Skin:
    """The skin of a plate (thickness in m, conductivity in S/m, relative permeability) at a frequency (Hz), by the
    equation of diffusion across a slab whose faces carry the same current or opposite ones (Landau and Lifshitz,
    Electrodynamics of Continuous Media, section 59, has the half-space): coth and tanh of half the thickness in skin
    depths.
    """
    decay = cmath.sqrt(2j * math.pi * frequency * MU0 * permeability * conductivity)
    half = 0.5 * thickness * decay
    tanh = cmath.tanh(half) if abs(half) < 20.0 else 1.0
    inner = 1.0 if permeability == 1.0 else 1.0 / (1.0 + abs(half) ** 2)
    # coth(x) - 1/x cancels for foils
    opposite = decay * (1.0 / tanh - 1.0 / half) if abs(half) > 0.03 else decay * half / 3.0
    opposite = opposite + decay * (1.0 - inner) / half
    depths = thickness * abs(decay) / math.sqrt(2.0)
    most = EDGE_OF_MAGNETS + (EDGE - EDGE_OF_MAGNETS) / permeability
    edge = most * depths**4 / (depths**4 + EDGE_FROM**4)
    wall = min(1.0 + (WALL / depths) ** 3, MOST_WALL)
    return Skin(1.0 / (decay * tanh), 1.0 / opposite, edge, decay, wall, permeability, inner)


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
    def vacuum(self) -> Array:
        """Energies of the functions as potentials of vacuum within the body (`of_vacuum`), times mu0 (H)."""

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
        """The numbers (no unit) of the points mirrored across x = 0 and across y = 0, where every class is even or odd
        across both: its `in_plane` is then the two parities (1 or -1) of its stream functions. None where they are not.
        """


def made_definite(inductance: Array) -> Array:
    """The matrix (n, n; H) of a class with an even stream function throughout: a constant one is no current and stores
    nothing, so it is given some, which nothing drives. Derived here.
    """
    count = len(inductance)
    return np.asarray(inductance + np.trace(inductance) / count**2)


Grams = tuple[Array, Array]

CONSTANT = 1e-6
"""Part of the functions' energies below which their sum has none: then it is a constant."""


def of_vacuum(lines: Sequence[Grams], members: Sequence[Index]) -> Array:
    """Energies (m) of harmonic potentials within a body: twice the integral of the squared gradient over two, (n, n).
    `lines` are mass and stiffness of the functions along each axis, the last of each not 0 on the surface; a function
    of the surface is the product of those that `members` number, an array (n) an axis. Inner functions are eliminated
    by the eigenvectors of every axis (Lynch, Rice and Thomas, Numerische Mathematik 6, 1964).
    """
    inner = [np.arange(len(mass) - 1) for mass, _ in lines]
    sizes = [one.size for one in inner]
    surface = _energies(lines, members, members)
    if min(sizes) == 0:
        return surface
    grid = [one.ravel() for one in np.meshgrid(*inner, indexing="ij")]
    seen = _energies(lines, grid, members).reshape(*sizes, -1)
    values = np.zeros(sizes)
    for axis, (mass, stiffness) in enumerate(lines):
        root = np.linalg.inv(np.linalg.cholesky(mass[:-1, :-1]))
        size, vectors = np.linalg.eigh(root @ stiffness[:-1, :-1] @ root.T)
        seen = np.moveaxis(np.tensordot(vectors.T @ root, seen, axes=(1, axis)), 0, axis)
        values += size.reshape([-1 if k == axis else 1 for k in range(len(lines))])
    flat = (seen / np.sqrt(values)[..., None]).reshape(-1, surface.shape[0])
    return np.asarray(surface - flat.T @ flat)


def _energies(lines: Sequence[Grams], rows: Sequence[Index], columns: Sequence[Index]) -> Array:
    """Energies (rows, columns; m) of products of functions: over the axes, the stiffness along one times the others'
    masses, as the squared gradient of a product falls apart.
    """
    found = np.zeros((rows[0].size, columns[0].size))
    for turn in range(len(lines)):
        part = np.ones_like(found)
        for axis, grams in enumerate(lines):
            part *= grams[1 if axis == turn else 0][np.ix_(rows[axis], columns[axis])]
        found += part
    return found


def through_magnet(depths: ComplexArray, vacuum: Array, skin: Skin) -> ComplexArray:
    """1/X (H) of P (`CurrentClass.depths`) and S (`of_vacuum`), both times mu0 (H).

    A stream function on a surface is a jump of the magnetic potential. The body answers a potential phi on its surface
    with the field T phi that goes in, vacuum in its place with S phi (the energy of the harmonic potential within). The
    jump that stands for the body, seen from outside, is X T phi with X = 1/T - 1/S, 1/T = (inner/S + 1/P) / mu_r, P the
    skin's depth times the surface's gradients, as for metals that are not magnetic. `inner` goes from 1 to 0 as the
    skin gets thinner than the body: a ferrite leads the field through its volume, a steel along its surface. Where
    waves are long against the thickness this is the answer of an endless plate at any frequency, and of a ferrite it is
    exact for any shape. For mu_r = 1 and a thin body 1/X is P itself. (Calderon's relations in Galerkin's form:
    Steinbach, Numerical Approximation Methods for Elliptic Boundary Value Problems, 2008, chapter 6.)
    """
    mu = skin.permeability
    middle = vacuum / mu - (1.0 - skin.inner / mu) * depths
    energy = float(np.trace(vacuum))
    if abs(float(vacuum.sum())) < CONSTANT * energy:
        # a potential that is the same everywhere is no field: any answer to it will do
        middle = middle + energy / len(vacuum) ** 2
    return np.asarray(vacuum @ np.linalg.solve(middle, depths))
