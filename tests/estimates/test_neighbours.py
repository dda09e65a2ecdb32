"""Mutual inductance between coils against the dipole limit and against symmetry."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates.windings.methods import WindingGeometry
from sitscad.estimates.windings.neighbours import inductance_matrix
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.inductance.track_strands import track
from sitscad.kernels.geometry.path import Point
from sitscad.spec.coil import CoilPlacement

UM = 1e-6


def spiral_geometry():
    sweep = 2 * math.pi * 6.0
    layers = (
        SpiralLayer(1.7e-3, 200 * UM, 6.0, 0.0, 1, True, 0.0, 100 * UM, 35 * UM),
        SpiralLayer(1.7e-3, 200 * UM, 6.0, 2 * sweep, -1, False, -60 * UM, 100 * UM, 35 * UM),
    )
    theta = np.linspace(0.0, sweep, 200_001)
    radius = 1.7e-3 - 200 * UM / (2 * math.pi) * theta
    # the mean of what a track's strands enclose: w^2 / 24 a radian more than its middle
    area = 2 * (np.trapezoid(0.5 * radius**2, theta) + (100 * UM) ** 2 / 24 * sweep)
    spec = SimpleNamespace(shape="circle", turns=6.0, trace_width=100 * UM, layers=(1, 2))
    return WindingGeometry(spec, layers), float(area)


def square_geometry():
    side = 3e-3
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * side / 2
    drawn = track([(tuple(a), tuple(b)) for a, b in pairwise(corners)], 100 * UM, 35 * UM, 0.0)
    spec = SimpleNamespace(shape="square", turns=1.0, trace_width=100 * UM, layers=(1,))
    # three corners are mitred: strands x off the middle enclose 3 x^2 more
    return WindingGeometry(spec, (), (drawn,)), side**2 + 3 * (100 * UM) ** 2 / 12


def placed(x, y=0.0):
    return SimpleNamespace(centre=Point(x, y), placement=CoilPlacement("", (x, y)))


@pytest.mark.parametrize("made", [spiral_geometry, square_geometry])
def test_mutual_inductance_of_far_coils_equals_dipole_limit(made):
    geometry, area = made()
    excess = []
    for distance in (0.04, 0.08, 0.3):
        matrix, _ = inductance_matrix(1e-6, 1e-4, [(placed(0.0), geometry), (placed(distance), geometry)])
        excess.append(matrix[0, 1] / (-MU0 * area**2 / (4 * math.pi * distance**3)) - 1.0)
    assert excess[0] == approx(4.0 * excess[1], rel=0.03) and excess[0] < 0.01
    assert abs(excess[2]) < 1e-4


def test_inductance_matrix_is_symmetric_positive_and_translation_invariant():
    geometry, _ = spiral_geometry()
    coils = [(placed(x), geometry) for x in (-4.5e-3, 0.0, 4.5e-3)]
    matrix, errors = inductance_matrix(0.4e-6, 1e-4, coils)
    assert np.array_equal(matrix, matrix.T)
    assert matrix[0, 1] == matrix[1, 2]
    assert abs(matrix[0, 2]) < abs(matrix[0, 1])
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert np.diag(errors) == approx(0.4e-10, rel=1e-9) and np.array_equal(errors, errors.T)
    assert 0.0 < errors[0, 2] < errors[0, 1] < 1e-3 * abs(matrix[0, 1])
