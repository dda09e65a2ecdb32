"""The finite elements of a bonded pad against what is known without them, and against themselves."""

from __future__ import annotations

import numpy as np
import pytest
from pad_of_elements import stiffness
from tolerance import approx

pytest.importorskip("ngsolve", reason="pip install --group references")

from pad_elements import BOARD, FREE, MIDDLE, PLATE, GluedPlate, HalfPad, fanned

pytestmark = pytest.mark.slow
SQUARE = GluedPlate(4e-3, 4e-3, 2e-3)


@pytest.mark.parametrize("solid", [SQUARE, GluedPlate(9e-3, 3e-3, 1e-3), GluedPlate(4e-3, 4e-3, 2e-3, rim=1e-3),
                                   GluedPlate(4e-3, 4e-3, 2e-3, skin=0.1e-3)])
def test_pad_mesh_fills_half_solid_with_closed_faces(solid):
    mesh = fanned(solid, 2, 1)
    corners = mesh.points[mesh.elements]
    parts = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
    edges = [[corners[:, k] - corners[:, a] for k in (b, c, d)] for a, b, c, d in parts]
    volumes = np.array([np.einsum("ij,ij->i", np.cross(p, q), r) / 6.0 for p, q, r in edges])
    beyond = 2.0 * (solid.rim + solid.skin)
    whole = (solid.width_x + beyond) * (solid.width_y + beyond) * solid.thickness
    assert volumes.min() > 0.0
    assert volumes.sum() == approx(0.5 * whole, rel=1e-9)
    flat = np.concatenate([mesh.faces[name] for name in (BOARD, PLATE, MIDDLE, FREE)])
    ways = [np.cross(mesh.points[q[2]] - mesh.points[q[0]], mesh.points[q[3]] - mesh.points[q[1]]) for q in flat]
    assert np.abs(np.sum(ways, axis=0)).max() < 1e-9 * np.abs(ways).sum()


def test_disc_stiffness_at_rest_agrees_with_axisymmetric_elements():
    disc = HalfPad(GluedPlate(4e-3, 4e-3, 2e-3, is_round=True), 2, 50e3).move((0.0, 0.0, 0.0))
    shear, poisson = 50e3, 0.49995
    assert disc.stiffness[1, 1] == approx(stiffness(2e-3, 2e-3, 2e-3, shear, poisson, 16), rel=0.01)


def test_pad_stiffness_is_symmetric_between_board_and_plate():
    """Turned by half of its tilt, the frame between board and plate sees shear and tilt apart: M = -h/2 F."""
    rest = HalfPad(SQUARE, 2, 50e3).move((0.0, 0.0, 0.0))
    assert rest.stiffness[2, 0] == approx(-1e-3 * rest.stiffness[0, 0], rel=1e-6)


def test_pad_stiffness_equals_derivative_of_force():
    pad, small = HalfPad(SQUARE, 2, 50e3, order=3), 1e-4
    here = pad.move((0.3e-3, -0.3e-3, 0.02))
    moves = np.diag([2e-3 * small, 2e-3 * small, small])
    for k, move in enumerate(moves):
        there = pad.move(tuple(np.array(here.pose) + move))
        changed = np.subtract(
            (there.force_x, there.force_z, there.moment_y), (here.force_x, here.force_z, here.moment_y)
        )
        assert changed / move[k] == approx(here.stiffness[:, k], rel=2e-3, abs=2e-3 * abs(here.stiffness[k, k]))


def test_pad_element_forces_have_converged():
    """Twice the degrees of freedom change compression at rest by under 0.2 %, and under a quarter of the thickness."""
    coarse, fine = HalfPad(SQUARE, 2, 1.0), HalfPad(SQUARE, 2, 1.0, mesh=fanned(SQUARE, 2, 2))
    for pose in ((0.0, 0.0, 0.0), (0.0, -0.5e-3, 0.0)):
        item, other = coarse.move(pose), fine.move(pose)
        assert item.stiffness[1, 1] == approx(other.stiffness[1, 1], rel=0.01)
        assert item.stiffness[0, 0] == approx(other.stiffness[0, 0], rel=0.05)
        assert item.force_z == approx(other.force_z, rel=0.004, abs=1e-12)


def test_film_of_pad_material_acts_as_wider_pad():
    film = HalfPad(GluedPlate(3.6e-3, 3.6e-3, 2e-3, skin=0.2e-3), 2, 1.0, skin=1.0).move((0.0, 0.0, 0.0))
    wide = HalfPad(SQUARE, 2, 1.0).move((0.0, 0.0, 0.0))
    assert film.stiffness[1, 1] == approx(wide.stiffness[1, 1], rel=0.02)
    assert film.stiffness[0, 0] == approx(wide.stiffness[0, 0], rel=0.02)
