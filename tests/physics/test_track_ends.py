"""Ends of tracks in pads and teardrops against triangles over the same copper."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from tolerance import approx

from sitscad.physics.loss.resistance import contact_squares, pad_squares, step_squares, teardrop_squares

QUARTER = 32
WIDTH = 1e-3


def triangles_squares(pad: float, drill: float, reach: float = 0.0, fineness: float = 12.0) -> float:
    """Squares beyond the centre line's of a track that ends in a pad, by triangles of two sizes, extrapolated."""
    from shapely import LineString, Point, box, union_all

    end = (max(pad / 2, reach) + 3.0) * WIDTH
    middle = Point(0, 0)
    disc = middle.buffer(pad / 2 * WIDTH, quad_segs=QUARTER)
    parts = [disc, box(0, -WIDTH / 2, end, WIDTH / 2), middle.buffer(WIDTH / 2, quad_segs=QUARTER)]
    if reach:
        far = Point(reach * WIDTH, 0).buffer(WIDTH / 2, quad_segs=QUARTER)
        parts.append(union_all([disc, far]).convex_hull)
    area = union_all(parts).difference(middle.buffer(drill / 2 * WIDTH, quad_segs=QUARTER))
    assert not LineString([(end, 0), (end - WIDTH, 0)]).disjoint(area)

    return solved(area, lambda at: np.hypot(*at.T) < drill / 2 * WIDTH * 1.00001, end, fineness) - end / WIDTH


def solved(area, held_at, end: float, fineness: float) -> float:
    """Squares between where `held_at` says so and x = `end`."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    from tests.oracles.copper_resistance import triangulate

    def squares(size: float) -> float:
        mesh = triangulate(area, size)
        rows, columns = np.repeat(mesh.triangles, 3, axis=1).ravel(), np.tile(mesh.triangles, (1, 3)).ravel()
        matrix = sparse.csr_matrix((mesh.stiffness().ravel(), (rows, columns)))
        held = held_at(mesh.points)
        free = ~(held | (mesh.points[:, 0] > end * (1 - 1e-9)))
        potential = held.astype(float)
        potential[free] = spsolve(matrix[free][:, free].tocsc(), -(matrix[free] @ potential))
        return 1.0 / float(potential @ (matrix @ potential))

    coarse, fine = (squares(WIDTH / fineness / by) for by in (1, 2))
    return fine + (fine - coarse) / 3.0


@pytest.mark.needs("gmsh", "scipy", "shapely")
@pytest.mark.parametrize(
    ("pad", "drill", "bound"),
    [(1.0, 0.5, 0.05), (1.2, 0.6, 0.02), (1.5, 0.75, 0.02), (2.0, 1.4, 0.02), (3.0, 0.9, 0.02), (6.0, 4.2, 0.02)],
)
def test_a_pad_s_squares_are_those_of_triangles(pad, drill, bound):
    assert pad_squares(pad, drill) == approx(triangles_squares(pad, drill), abs=bound)


@pytest.mark.needs("gmsh", "scipy", "shapely")
@pytest.mark.parametrize("reach", [0.75, 0.9, 1.2, 1.5])
@pytest.mark.parametrize(("pad", "drill"), [(1.5, 0.8), (3.75, 1.67)])
def test_a_teardrop_s_squares_are_those_of_triangles(pad, drill, reach):
    found = teardrop_squares(pad, drill, reach * pad)
    assert found == approx(triangles_squares(pad, drill, reach * pad), abs=0.08)


@pytest.mark.needs("gmsh", "scipy", "shapely")
@pytest.mark.parametrize(
    ("wide", "fineness"),
    [
        (1.25, 12.0),
        (2.0, 10.0),  # here a corner of the round end and one of the track are 5e-19 m apart
        (3.0, 10.0),
        pytest.param(5.0, 8.0, marks=pytest.mark.slow),
        pytest.param(12.0, 4.0, marks=pytest.mark.slow),
    ],
)
def test_a_narrow_track_in_a_wide_one_s_round_end_has_the_squares_of_triangles(wide, fineness):
    from shapely import Point, box, union_all

    begin, end = -2.0 * wide * WIDTH, (wide / 2 + 2.5) * WIDTH
    broad, narrow = box(begin, -wide / 2 * WIDTH, 0, wide / 2 * WIDTH), box(0, -WIDTH / 2, end, WIDTH / 2)
    area = union_all([broad, narrow, Point(0, 0).buffer(wide / 2 * WIDTH, quad_segs=48)])
    found = solved(area, lambda at: at[:, 0] < begin * (1 - 1e-9), end, fineness) - (end - begin / wide) / WIDTH
    assert step_squares(wide) == approx(found, abs=0.035)


def test_tracks_of_one_width_have_no_step_and_wider_ones_spare_more():
    assert step_squares(1.0) == 0.0 and -0.01 < step_squares(1.0 + 1e-3) < 0.0
    steps = [step_squares(wide) for wide in (1.01, 1.25, 2.0, 5.0, 20.0)]
    assert steps == sorted(steps, reverse=True)


def test_a_longer_teardrop_and_a_larger_pad_conduct_better_and_no_teardrop_is_a_pad():
    rising = [teardrop_squares(3.0, 1.2, reach) for reach in (2.0, 2.5, 3.5, 4.5)]
    assert rising == sorted(rising, reverse=True) and rising[0] < pad_squares(3.0, 1.2)
    pads = [pad_squares(pad, 0.8) for pad in (1.0, 1.5, 2.0, 4.0)]
    assert pads == sorted(pads, reverse=True)
    assert teardrop_squares(3.0, 1.2, 1.4) == pad_squares(3.0, 1.2)
    assert pad_squares(0.9, 0.5) == pad_squares(1.0, 0.5), "a pad narrower than the track is the track's own end"


def test_a_contact_is_a_wide_track_with_a_trapezoid_before_it():
    assert contact_squares(6.0, 1.0) == 0.0
    assert contact_squares(6.0, 3.0) == approx(-4.0, rel=1e-6)
    by_steps = np.mean(1.0 / (1.0 + 2.0 * (np.arange(1000) + 0.5) / 1000))
    assert contact_squares(0.0, 3.0, 2.0) == approx(2.0 * (by_steps - 1.0), rel=1e-6)
    assert contact_squares(0.0, 1.0 + 1e-7, 2.0) == approx(0.0, abs=1e-6)


def test_the_series_has_converged(monkeypatch):
    import sitscad.physics.loss.resistance as ends

    cases = [(1.0, 0.5), (3.0, 1.2), (20.0, 8.0)]
    usual = [ends.pad_squares(*case) for case in cases]
    monkeypatch.setattr(ends, "TERMS", 40_000)
    full = [partial(ends.pad_squares.__wrapped__, *case)() for case in cases]
    assert usual == approx(full, abs=1e-3)
    assert all(math.isfinite(value) for value in full)
