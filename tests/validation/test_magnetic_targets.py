"""Magnetic targets: the surface solution against boxes of poles (ferrite) and discs of finite elements (steels)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from box_of_loops import _mutual
from box_of_poles import pole_share
from disc_of_elements import disc_change
from finite_discs import EIGHT, FREQUENCY, Rings, of_disc
from tolerance import approx

from sitscad.kernels.electromagnetics.eddy.box import box
from sitscad.kernels.electromagnetics.eddy.surface import Metal
from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget, rotation_matrices

pytestmark = pytest.mark.needs("scipy")


# sides, thickness, offset and gap of a plate in coil diameters
BOXES = [((1.0, 1.0), 0.1, 0.0, 0.15), ((1.0, 1.0), 0.1, 0.5, 0.4), ((1.5, 1.5), 0.2, 0.5, 0.15),
         ((1.0, 2.0), 0.2, 0.0, 0.15), ((0.25, 0.25), 0.03, 0.0, 0.15), ((0.5, 0.5), 2.5, 0.3, 0.15)]


@pytest.mark.slow
@pytest.mark.parametrize("case", BOXES, ids=str)
def test_ferrite_box_agrees_with_pole_model(case):
    """Within 0.4 % of converged poles, 1.5 % of a rod's, whose poles are not converged further."""
    (radii, heights), (sides, thickness, offset, gap) = EIGHT, case
    across = 2.0 * radii.max()
    sides, thickness, offset, gap = (across * np.asarray(value) for value in (sides, thickness, offset, gap))
    coarse, better = (pole_share(sides, thickness, offset, radii, heights, gap, *n) for n in ((16, 4), (24, 6)))
    steps = min(float(thickness) / 4.0, 0.02 * float(min(sides))), 0.06 * float(max(sides))
    surface = box((*map(float, sides), float(thickness)), *steps, (30, 30, 8))
    target = SolvedTarget(surface, -0.5 * float(thickness), Metal(FREQUENCY, 1e-3, 1e5))
    place, centre = np.array([[0.0, 0.0, float(gap)]]), np.array([[float(offset), 0.0]])
    result = target.changes(rotation_matrices(np.zeros((1, 3))), place, [Rings(radii, heights)], centre)[0, 0, 0].real
    share = result / _mutual(radii, heights, 2.0 * gap - heights, 1.0)
    assert share == approx(3.0 * better - 2.0 * coarse, rel=4e-3 if thickness < 2.0 * min(sides) else 0.015)


DISCS = [(0.15e-3, 3e-3, 0.1e-3), (0.5e-3, 4e-3, 0.2e-3), (0.5e-3, 5e-3, 0.03e-3), (1e-3, 8e-3, 0.5e-3)]
METALS = [(1.3e6, 2.0), (1.3e6, 20.0), (1.3e6, 95.0), (6e6, 400.0), (0.01, 5.0), (0.01, 150.0)]


@pytest.mark.slow
@pytest.mark.parametrize("metal", METALS, ids=str)
@pytest.mark.parametrize("disc", DISCS, ids=str)
def test_many_magnetic_discs_agree_with_finite_elements(disc, metal):
    """Within 1.2 % of the size of the complex change, by two meshes of elements."""
    coarse, fine = (np.array(disc_change(EIGHT[0], *disc, *metal, cells=cells)) for cells in (0.8, 1.2))
    inductance, resistance = fine + (fine - coarse) / (1.5**2 - 1.0)
    omega = 2.0 * math.pi * FREQUENCY
    apart = of_disc(*disc, *metal) - complex(inductance, -resistance / omega)
    assert max(abs(apart.real), abs(apart.imag)) < 0.012 * abs(complex(inductance, resistance / omega))
