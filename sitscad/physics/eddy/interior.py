"""What a magnetic body adds to its surface currents: the field that runs through it.

A stream function on a surface is a jump of the magnetic potential. The body answers a potential phi on its surface
with the field T phi that goes in, vacuum in its place with S phi (the energy of the harmonic potential within). The
jump that stands for the body, seen from outside, is X T phi with

    X = 1/T - 1/S,  1/T = (inner/S + 1/P) / mu_r,

P the skin's depth times the surface's gradients, as for metals that are not magnetic. `inner` goes from 1 to 0 as the
skin gets thinner than the body: a ferrite leads the field through its volume, a steel along its surface. Where waves
are long against the thickness this is the answer of an endless plate at any frequency, and of a ferrite it is exact for
any shape. For mu_r = 1 and a thin body 1/X is P itself. (Calderon's relations in Galerkin's form: Steinbach, Numerical
Approximation Methods for Elliptic Boundary Value Problems, 2008, chapter 6.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array, ComplexArray, Index
from sitscad.physics.eddy.skin import Skin

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
    """Energies (m) of products of functions: over the axes, the stiffness along one times the others' masses."""
    found = np.zeros((rows[0].size, columns[0].size))
    for turn in range(len(lines)):
        part = np.ones_like(found)
        for axis, grams in enumerate(lines):
            part *= grams[1 if axis == turn else 0][np.ix_(rows[axis], columns[axis])]
        found += part
    return found


def through_magnet(depths: ComplexArray, vacuum: Array, skin: Skin) -> ComplexArray:
    """1/X (H) of P (`CurrentClass.depths`) and S (`of_vacuum`), both times mu0 (H)."""
    mu = skin.permeability
    middle = vacuum / mu - (1.0 - skin.inner / mu) * depths
    energy = float(np.trace(vacuum))
    if abs(float(vacuum.sum())) < CONSTANT * energy:
        # a potential that is the same everywhere is no field: any answer to it will do
        middle = middle + energy / len(vacuum) ** 2
    return np.asarray(vacuum @ np.linalg.solve(middle, depths))
