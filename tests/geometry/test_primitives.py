"""Exact distances between lines and arcs, against brute force on dense samples."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.geometry.path import Arc, Line, Path, Point, polar
from sitscad.kernels.geometry.primitives import Primitives, distances, from_rows, line_row, nearest_pairs, path_rows

COORDINATES = st.integers(-20, 20).map(lambda n: n / 10)
POINTS = st.builds(Point, COORDINATES, COORDINATES)
ANGLES = st.integers(0, 62).map(lambda n: n / 10)


@st.composite
def lines(draw) -> Line:
    return Line(draw(POINTS), draw(POINTS))


@st.composite
def arcs(draw) -> Arc:
    centre, radius = draw(POINTS), draw(st.integers(1, 20)) / 10
    start, sweep = draw(ANGLES), draw(st.integers(1, 62)) / 10
    ccw = draw(st.booleans())
    end = start + sweep if ccw else start - sweep
    return Arc(polar(radius, start, centre), polar(radius, end, centre), centre, ccw)


def primitives(*segments: Line | Arc) -> Primitives:
    return from_rows([row for row, _ in path_rows(Path(segments))])


def sampled(segment: Line | Arc, count: int = 400) -> np.ndarray:
    return np.array([segment.at(k / count) for k in range(count + 1)])


def brute_force(one: Line | Arc, other: Line | Arc) -> tuple[float, float]:
    """Sampled distance and the most by which it can exceed the true one."""
    a, b = sampled(one), sampled(other)
    step = (one.length + other.length) / 400
    return float(np.min(np.hypot(*(a[:, None, :] - b[None, :, :]).transpose(2, 0, 1)))), step


@pytest.mark.slow
@settings(max_examples=250, deadline=None)
@given(st.one_of(lines(), arcs()), st.one_of(lines(), arcs()))
def test_primitive_distance_matches_dense_samples(one: Line | Arc, other: Line | Arc) -> None:
    result = float(distances(primitives(one), primitives(other))[0])
    expected, slack = brute_force(one, other)
    assert expected - slack - 1e-9 <= result <= expected + 1e-9
    assert result == approx(float(distances(primitives(other), primitives(one))[0]), abs=1e-9)


def test_primitive_distances_match_known_values() -> None:
    inner = Arc(Point(1, 0), Point(-1, 0), Point(0, 0))
    outer = Arc(Point(1.3, 0), Point(-1.3, 0), Point(0, 0))
    aside = Arc(polar(1, 2.0, Point(3, 0)), polar(1, 4.0, Point(3, 0)), Point(3, 0))
    tangent = Line(Point(-1, 1.5), Point(1, 1.5))
    cases = [
        (inner, outer, 0.3),
        (inner, aside, 1.0),
        (inner, tangent, 0.5),
        (inner, Line(Point(0, 0.5), Point(0, 2)), 0.0),
    ]
    for item, other, distance in cases:
        assert distances(primitives(item), primitives(other))[0] == approx(distance, abs=1e-12)


@given(arcs())
def test_primitive_boxes_are_tight(arc: Arc) -> None:
    x0, y0, x1, y1 = primitives(arc).boxes[0]
    points = sampled(arc)
    sagitta = arc.length**2 / (8 * arc.radius * 400**2) + 1e-12
    assert points[:, 0].min() == approx(x0, abs=sagitta) and points[:, 0].max() == approx(x1, abs=sagitta)
    assert points[:, 1].min() == approx(y0, abs=sagitta) and points[:, 1].max() == approx(y1, abs=sagitta)


@given(arcs(), st.floats(0, 1), st.floats(0, 1))
def test_trimmed_primitive_stays_on_arc(arc: Arc, a: float, b: float) -> None:
    first, last = min(a, b), max(a, b)
    part = primitives(arc).trimmed(np.array([first]), np.array([last]))
    assert part.start[0] == approx(
        np.array(polar(arc.radius, arc.start_angle + first * arc.sweep, arc.centre)), abs=1e-9
    )
    assert part.sweep[0] == approx((last - first) * arc.sweep, rel=1e-6)


def test_nearest_pairs_finds_all_near_pairs() -> None:
    rng = np.random.default_rng(7)
    points = rng.uniform(0, 1, (600, 2))
    rows = [(*p, *(p + rng.uniform(-0.02, 0.02, 2)), 0.0, 0.0, 0.0, 0.0, 0.0) for p in points]
    pieces = from_rows(rows)
    result = {(int(i), int(j)) for i, j in nearest_pairs(pieces.boxes, np.full(600, 0.005))}
    i, j = np.triu_indices(600, 1)
    near = np.flatnonzero(distances(pieces.take(i), pieces.take(j)) < 0.01)
    assert len(near) > 50
    assert {(int(i[k]), int(j[k])) for k in near} <= result
    assert all(a < b for a, b in result)


def test_empty_set_has_no_pairs() -> None:
    empty = from_rows([])
    assert len(empty) == 0
    assert nearest_pairs(empty.boxes, np.empty(0)).shape == (0, 2)
    assert math.isfinite(float(len(distances(empty, empty))))


def test_collinear_lines_do_not_cross_by_rounding():
    """Two pieces of one straight track, 45 degrees, a gap between them: seen to read 0 from a trace of an angle."""
    along = [
        (0.0007418, 0.0007418, 0.0019, 0.0019),
        (0.0021260000000000003, 0.002126, 0.0023040, 0.0023040000000000003),
    ]
    pieces = from_rows([line_row(*ends) for ends in along])
    (gap,) = distances(pieces.take(np.array([0])), pieces.take(np.array([1])))
    assert gap == approx(math.hypot(0.000226, 0.000226), rel=1e-9)
