"""Polygons with sharp and rounded corners, as the references and the solvers want them."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np

from sitscad.estimates.windings.losses import losses_near_metal
from sitscad.estimates.windings.methods import WindingGeometry, equivalent_spirals, metal_spectrum
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.kernels.geometry.path import Arc, Point, rounded_polyline
from sitscad.spec.coil import CoilSpec

UM, MM = 1e-6, 1e-3
COPPER = 58e6
RATE = 1.7
"""The error of the triangles falls with this power of their size (`test_the_triangles_converge`)."""


def polygon(sides, turns, apothem, pitch):
    """Corners (n, 2) of a spiral on a regular polygon, side m in floor(m / sides) pitches from the outermost (m)."""
    step = 2.0 * math.pi / sides
    lines = [(apothem - pitch * (max(m, 0) // sides), step * m) for m in range(-1, round(sides * turns) + 1)]
    return np.array([np.linalg.solve([[math.cos(a), math.sin(a)], [math.cos(b), math.sin(b)]], [p, q])
                     for (p, a), (q, b) in pairwise(lines)])


def bent(corners, width, thickness, z=0.0):
    """A track with sharp corners."""
    return BentTrack(corners[:-1], corners[1:], np.zeros(len(corners) - 1), width, thickness, z)


def rounded_path(corners, radius):
    """A path with corners rounded by a radius (m)."""
    return rounded_polyline([Point(*c) for c in corners], [radius] * len(corners))


def rounded_track(corners, width, thickness, radius):
    """A track with corners rounded by a radius (widths of the centre line)."""
    path = rounded_path(corners, radius * width)
    table = [(*s.start, *s.end, s.sweep if isinstance(s, Arc) else 0.0) for s in path]
    starts, ends, turns = np.split(np.array(table), [2, 4], axis=1)
    return BentTrack(starts, ends, turns[:, 0], width, thickness, 0.0)


def changes_by_mirror(shape, track, turns, size, pitch, mirror, frequencies):
    """What an estimate takes a perfect conductor at a distance (m) to change of the inductance (H, complex) of a layer:
    of direct current, and with the crowding of the round coil of equal length at every frequency (Hz).
    """
    spec = CoilSpec(shape=shape, size=(size, size), turns=float(turns), layers=(1,), trace_width=track.width,
                    trace_spacing=pitch - track.width)
    geometry = WindingGeometry(spec, (), (), (track,))
    placed = SimpleNamespace(outer_angle=0.0, sense=1, inward=True, z=track.z, thickness=track.thickness)
    spirals = equivalent_spirals(geometry, SimpleNamespace(windings=[placed]))
    wall = Reflector(mirror, (MetalLayer(1e30),))
    reflected = reflected_inductances(metal_spectrum(geometry, mirror), frequencies, wall, None, (0.0,))[:, 0]
    crowding = losses_near_metal(spirals, COPPER, mirror, is_round=False).changes(frequencies, wall, None)
    return float(reflected[0].real), reflected + crowding
