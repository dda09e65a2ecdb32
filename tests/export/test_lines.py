"""Coils as lines and currents: what they run along, how far chords stray, that a circuit is one polyline."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sitscad
from sitscad.files.export import centre_lines, current_paths
from sitscad.kernels.geometry.path import Point
from sitscad.spec import templates

LAYOUTS = {name: sitscad.lay_out(sitscad.load_text(templates.read(name))) for name in templates.names()}
BENCH = LAYOUTS["bench_7mm"]


@pytest.mark.parametrize("name", LAYOUTS)
def test_current_path_is_one_polyline_between_contacts(name):
    layout = LAYOUTS[name]
    heights = {layer.z for layer in layout.spec.fpc.stackup.copper}
    for coil, path in zip(layout.coils, current_paths(layout), strict=True):
        ends = [pad for pad in layout.pads if pad.net == coil.net]
        for point, pin in ((path.points[0], "A"), (path.points[-1], "B")):
            (pad,) = (pad for pad in ends if pad.pin == f"{coil.name}.{pin}")
            assert pad.holds(Point(*point[:2]))
        assert set(path.points[:, 2]) <= heights
        steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
        drawn = sum(piece.path.length for piece in coil.series if isinstance(piece, sitscad.layout.Trace))
        assert steps.min() > 0.0 and steps.sum() >= drawn * (1 - 2e-3)


@pytest.mark.parametrize("name", ["bench_7mm", "square_bench", "racetrack_jaw"])
def test_centre_lines_match_windings_of_each_layer(name):
    layout = LAYOUTS[name]
    lines = centre_lines(layout)
    assert [(line.coil, line.layer) for line in lines] == [(c.name, w.layer) for c in layout.coils for w in c.windings]
    for line in lines:
        joints = [(a.end, b.start) for a, b in zip(line.segments, line.segments[1:], strict=False)]
        assert all(end.distance(start) < 1e-12 for end, start in joints)
        points = line.points()
        assert points.shape[1] == 3 and points.dtype == np.float64 and np.all(points[:, 2] == line.z)
        middles = 0.5 * (points[1:] + points[:-1])
        assert max(line.path.distance(Point(*point[:2])) for point in middles[::7]) <= 1.001e-6


@given(tolerance=st.floats(1e-8, 1e-4))
def test_chords_shorten_centre_line_within_tolerance(tolerance):
    line = centre_lines(BENCH)[0]
    points = line.points(tolerance)
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    innermost = 0.5e-3
    assert line.length * (1 - 3.0 * tolerance / innermost) <= length <= line.length * (1 + 1e-12)


def test_currents_of_all_layers_circulate_in_equal_sense():
    for path in current_paths(BENCH, leads=False, current=2.0):
        assert path.current == 2.0 and path.layer is not None
        x, y = (path.points[:, :2] - np.array(BENCH.coils[int(path.coil[1]) - 1].centre)).T
        assert np.sum(x[:-1] * np.diff(y) - y[:-1] * np.diff(x)) > 0.0


def test_current_paths_refuse_open_circuit_and_invalid_tolerance():
    spec = sitscad.load_text(templates.read("grasper_3p5mm")).replace("array.pitch", 3.6e-3)
    crowded = sitscad.lay_out(spec)
    assert crowded.shortfalls
    with pytest.raises(ValueError, match="open"):
        current_paths(crowded)
    assert len(current_paths(crowded, leads=False)) == 4
    for tolerance in (0.0, -1e-6, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="tolerance"):
            current_paths(BENCH, tolerance=tolerance)
        with pytest.raises(ValueError, match="tolerance"):
            centre_lines(BENCH)[0].points(tolerance)
