"""Coils as their sources define them (measured_coils.json): those that were measured, those that solvers computed."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
from windings import MM, UM, coil

from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.inductance.spirals import spiral_inductance_matrix
from tests.oracles.filament_tracks import track_mutual_inductance

CASES = json.loads((Path(__file__).parent / "measured_coils.json").read_text(encoding="utf-8"))["cases"]
MEASURED = [case for case in CASES if case["kind"] == "measured"]
SOLVED = [case for case in CASES if case["kind"] == "solver"]


def square_corners(case) -> np.ndarray:
    """The corner list that the data's `square_corners` (and, with its first side full, `square_std`) define."""
    width, pitch = case["track_width_mm"], case["track_width_mm"] + case["gap_mm"]
    half = (case["outer_diameter_mm"] - width) / 2
    points = []
    for i in range(round(4 * case["turns_per_layer"]) + 1):
        x = half - (i // 4) * pitch
        y = half - math.floor((i - 1) / 4) * pitch
        points.append((x if i % 4 >= 2 else -x, y if i % 4 in (1, 2) else -y))
    if case["geometry_definition"] == "square_std":
        points[0] = (points[0][0], -half)
    return np.array(points) * MM


def inductance(case) -> float:
    """Our winding inductance (H) of a case as its source defines the geometry."""
    width, heights = case["track_width_mm"] * MM, [z * MM for z in case["layer_z_mm"]]
    copper = [t * UM for t in case["copper_thickness_um"]]
    if case["shape"] == "circle":
        layers = coil(
            case["outer_diameter_mm"] * MM, case["turns_per_layer"], width, case["gap_mm"] * MM, heights, copper
        )
        return float(spiral_inductance_matrix(layers).sum())
    corners = square_corners(case)
    mirrored = (corners * np.array([1.0, -1.0]))[::-1]
    tracks = [PolylineTrack(corners if k % 2 == 0 else mirrored, width, copper[k], z) for k, z in enumerate(heights)]
    return sum(track_mutual_inductance(a, b) for a in tracks for b in tracks)
