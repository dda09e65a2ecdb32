"""Random coils of every shape for the error of their resistance at frequency, alike in every run, and the yardstick.

Outer size 2 to 40 mm (rectangle and racetrack: 1.05 to 3 times as long), track 50 um to 1 mm, spacing 50 um to four
tracks, 0.5 to 30 turns (circles: two in three in quarters, others what the shape allows), 1 to 4 layers with equal or
unlike dielectrics of 12 to 200 um, copper 9 to 70 um and at most as thick as the track is wide. "rounded" are the four
polygons in turn with a corner radius.

`python tests/validation/resistance_designs.py` writes `resistance_designs.csv`: the rise of the resistance at
FREQUENCIES of every design by a solution with more of everything (azimuths or cuts, modes, points, Lanczos steps). The
numbers of `estimates/circuits/solved_winding.py` and `proximity.crossing_error` were fitted to the designs below
UNSEEN, those from there on were looked at afterwards (one of them, an octagon, made its number larger).
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from sitscad.estimates.windings.losses import bent_track_loss
from sitscad.estimates.windings.methods import bent_track, winding_geometry
from sitscad.kernels.electromagnetics.loss import proximity
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss, join_losses
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from sitscad.kernels.geometry.shapes import CHORD_TOLERANCE
from sitscad.layout.board import Coil
from sitscad.layout.windings import _wind
from sitscad.spec.circuit import CopperLayer
from sitscad.spec.coil import CoilPlacement, CoilSpec

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))  # as a program; pytest knows the folder
from half_plane import azimuth_loss

REFERENCES = Path(__file__).with_name("resistance_designs.csv")
FAMILIES = {"circle": 60, "square": 16, "rectangle": 12, "hexagon": 12, "octagon": 12, "racetrack": 12, "rounded": 16}
"""Families and how many of each were fitted to."""

UNSEEN, MORE = 100, {"circle": 16}
"""The first design that no fit saw, and how many there are of a family (others 5)."""

POLYGONS = ("square", "rectangle", "hexagon", "octagon")
PARTS = {"square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8, "racetrack": 2}
FREQUENCIES = (1e6, 3e6, 10e6)
COPPER = conductivity_at(20.0)


def design(family: str, number: int) -> tuple[CoilSpec, Coil]:
    """Design `number` of a family: its spec, and its windings as they are drawn."""
    random = np.random.default_rng([1013, list(FAMILIES).index(family), number])

    def logarithmic(low, high):
        return float(low * (high / low) ** random.random())

    shape = POLYGONS[number % len(POLYGONS)] if family == "rounded" else family
    turns = size = width = spacing = 1.0
    while (turns + 1.0) * (width + spacing) > 0.45 * size:
        turns, quarters = logarithmic(0.5, 30.0), random.integers(3) < 2
        parts = PARTS.get(shape, 4 if quarters else 0)
        turns = max(1 if shape in PARTS else 2, round(turns * parts)) / parts if parts else turns
        size, width = logarithmic(2e-3, 40e-3), logarithmic(50e-6, 1e-3)
        spacing = logarithmic(50e-6, max(60e-6, min(1e-3, 4.0 * width)))
    layers, copper = int(random.integers(1, 5)), min(logarithmic(9e-6, 70e-6), width)
    between = [logarithmic(12e-6, 200e-6)] * 3 if random.random() < 0.5 else [logarithmic(12e-6, 200e-6) for _ in "123"]
    heights = -np.concatenate([[0.0], np.cumsum(np.array(between) + copper)])[:layers]
    long = size * (random.uniform(1.05, 3.0) if shape in ("rectangle", "racetrack") else 1.0)
    radius = logarithmic(0.5 * width, max(0.6 * width, min(size / 8.0, 12.0 * width))) if family == "rounded" else 0.0
    spec = CoilSpec(shape=shape, size=(long, size), turns=turns, layers=tuple(range(1, layers + 1)), trace_width=width,
                    trace_spacing=spacing, start_angle=0.0, clockwise=False, corner_radius=radius)
    stack = tuple(CopperLayer(number=k + 1, z=float(z), thickness=copper) for k, z in enumerate(heights))
    return spec, Coil(CoilPlacement("C1", (0.0, 0.0)), "C1", _wind(spec, stack, 0.0, CHORD_TOLERANCE), (), False)


def finer(spec: CoilSpec, coil: Coil) -> ProximityLoss:
    """The yardstick: the same model with more of everything."""
    heights, thickness = [w.z for w in coil.windings], coil.windings[0].thickness
    gap = proximity.least_gap(spec.trace_spacing, spec.trace_width, heights)
    fine = proximity.resolution_for(spec.trace_width, thickness, gap, 0.01, COPPER)
    across, through = fine.modes.points
    modes = ModeSet(fine.modes.across + 1, fine.modes.through + 1, (across + 2, through + 1))
    spirals = winding_geometry(spec, coil).spirals
    if not spirals:
        tracks = [bent_track(w, spec.trace_width) for w in coil.windings]
        return bent_track_loss(tracks, COPPER, modes, 10, fine.steps + 10)
    parts = [
        azimuth_loss(spirals, *sector, COPPER, proximity.LossResolution(modes, 37, fine.steps + 10))
        for sector in proximity.sectors(spirals, 37)
    ]
    return join_losses(parts)


def references() -> dict[tuple[str, int], tuple[float, ...]]:
    """R / R(direct) at FREQUENCIES by the yardstick, of every family and number in the file."""
    with REFERENCES.open(encoding="utf-8", newline="") as rows:
        return {
            (row["family"], int(row["number"])): tuple(float(row[f"{f / 1e6:g}_MHz"]) for f in FREQUENCIES)
            for row in csv.DictReader(rows)
        }


def write() -> None:
    """References of all designs, those that are known kept."""
    known = references() if REFERENCES.exists() else {}
    with REFERENCES.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["family", "number", "turns", "layers", *(f"{f / 1e6:g}_MHz" for f in FREQUENCIES)])
        for family, count in FAMILIES.items():
            for number in (*range(count), *range(UNSEEN, UNSEEN + MORE.get(family, 5))):
                spec, coil = design(family, number)
                if (family, number) not in known:
                    loss = finer(spec, coil)
                    known[family, number] = tuple(loss.resistance_ratio(f) for f in FREQUENCIES)
                values = [f"{value:.7f}" for value in known[family, number]]
                rows.writerow([family, number, f"{spec.turns:.4g}", len(coil.windings), *values])
                file.flush()


if __name__ == "__main__":
    sys.exit(write())
