"""Layers of different numbers of turns against the volume integral: the bounds, fitted to equal ones, hold for them."""

from __future__ import annotations

import designs
import pytest
import volume_integral

from sitscad.estimates.windings.methods import METHODS, winding_geometry
from sitscad.kernels.geometry.shapes import SHAPES
from sitscad.layout.board import Coil
from sitscad.layout.windings import wind_coil
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.load import load_text

COILS = [
    ("circle", 5, [2.05, 1.25]),
    ("square", 4, [3.75, 2.25]),
    ("rectangle", "[6, 4]", [2, 1.5, 2]),
    ("hexagon", 6, [2.5, 3, 7 / 6]),
    ("octagon", 5, [4.375, 3.25, 5.125]),
    ("racetrack", "[6, 4]", [3, 2, 2.5]),
]


@pytest.mark.parametrize(("shape", "size", "turns"), [
    pytest.param(*row, id=row[0], marks=() if row[0] in ("circle", "rectangle", "racetrack") else pytest.mark.slow)
    for row in COILS
])
def test_inductance_bounds_hold_for_unequal_layer_turns(shape, size, turns):
    text = (
        f"sitscad: 1\nname: unequal\ncoil: {{shape: {shape}, outer_diameter: {size}, turns: {turns}, "
        f"layers: {len(turns)}, trace_width: 0.12, trace_spacing: 0.15}}\nfpc: {{stackup: flex-4l}}\n"
    )
    spec = load_text(text).coil
    place = CoilPlacement("C1", (0.0, 0.0))
    windings = wind_coil(load_text(text).artwork, place)
    geometry = winding_geometry(spec, Coil(place, "C1", windings, (), False))
    if geometry.spirals:
        conductors = [volume_integral.spiral(layer) for layer in geometry.spirals]
    else:
        drawn = [[("arc" if len(p) == 5 else "line", *p) for p in designs.pieces_of(w.path)] for w in windings]
        conductors = [
            volume_integral.conductor(pieces, spec.trace_width, w.thickness, w.z)
            for pieces, w in zip(drawn, windings, strict=True)
        ]
    exact = volume_integral.winding(conductors, volume_integral.Points(along=12, across=9))
    for method in METHODS:
        if method.serves(SHAPES[shape]) and not method.is_cross_check and method.is_valid(geometry):
            assert abs(method.solve(geometry) / exact - 1.0) < method.error(geometry), method.name
