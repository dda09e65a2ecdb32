"""Discs under the middle of eight rings: the surface solution, to be held against finite elements about the axis."""

from __future__ import annotations

import math

import numpy as np
from tolerance import approx

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.disc import disc
from sitscad.kernels.electromagnetics.eddy.surface import Metal
from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget, rotation_matrices
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings

FREQUENCY = 5e6
EIGHT = ((8e-3 - 0.15e-3) / 2 - 0.3e-3 * (np.arange(8) + 0.5), np.zeros(8))


class Rings:
    """The potential of coaxial rings, by the flux through circles; with a mirror's image."""

    def __init__(self, radii, heights, floor=-math.inf):
        self.rings = [(radii, heights, 1.0)]
        if math.isfinite(floor):
            self.rings.append((radii, 2.0 * floor - heights, -1.0))

    def __call__(self, points):
        rho = np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-9)
        total = np.zeros(len(points))
        for radii, heights, sign in self.rings:
            square = (rho[:, None] - radii) ** 2 + (points[:, 2, None] - heights) ** 2
            total += sign * coaxial_rings(rho[:, None], radii, square).sum(axis=1) / (2.0 * math.pi * rho)
        return 1j * total * (points[:, 0] + 1j * points[:, 1]) / rho


def of_disc(gap, diameter, thickness, conductivity, permeability=1.0):
    """The surface's change of inductance (H, complex)."""
    depth = 1.0 / math.sqrt(math.pi * FREQUENCY * MU0 * conductivity * permeability)
    surface = disc(diameter, thickness, min(depth / 3.0, thickness / 4.0, 0.02 * diameter), 0.4e-3, (40, 4), 0)
    target = SolvedTarget(surface, -0.5 * thickness, Metal(FREQUENCY, conductivity, permeability))
    flat, below = rotation_matrices(np.zeros((1, 3))), np.array([[0.0, 0.0, gap]])
    return target.changes(flat, below, [Rings(*EIGHT)], np.zeros((1, 2)))[0, 0, 0]


def check_disc(gap, diameter, thickness, conductivity, reference, rel, rel_loss):
    ours = of_disc(gap, diameter, thickness, conductivity)
    assert ours.real == approx(reference[0], rel=rel)
    assert -2.0 * math.pi * FREQUENCY * ours.imag == approx(reference[1], rel=rel_loss)
