"""Measured sensors against the response: one geometry for all units, each with its own gap, shift, yaw and L0.

    python tests/validation/scans_fit.py FOLDER [shape of the coils: square or circle] [shape of the target]

FOLDER has s1.csv, s3.csv ...: columns x_mm, y_mm, z_mm (+z towards the coils), L0_uH to L3_uH, no tilt. The geometry is
not stated there, so the coils' size and filling, the target's size, pitch and the leads' share are fitted, too. Prints
what was found, and the rms of the residual over that of the change, all coils of a unit: for z >= -3 mm, beyond, and by
height.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from sitscad.estimates.response.plate import solved_plate
from sitscad.estimates.response.scan import chebyshev, evaluated
from sitscad.layout import lay_out
from sitscad.physics.eddy.target import turned
from sitscad.spec.load import load_text

MM = 1e-3
FREQUENCY = 2.4e6
TURNS = 16
GRID = (13, 13, 11)
REACH, GAPS = 14.0 * MM, (0.9 * MM, 13.0 * MM)
SIZES, FILLS, TARGETS = (13.5, 15.0, 16.5), (0.5, 0.7, 0.9), (12.0, 14.0, 16.0)
UNIT = 4
"""Numbers of a unit: gap at z = 4 mm, shift along x and y (mm), yaw (degrees)."""


def sensor(coil: str, size: float, fill: float, target: str, across: float):
    """A coil alone: `fill` of its radius is wound; sizes in millimetres."""
    track = 0.5 * fill * size / TURNS / 2.0
    return load_text(
        f"sitscad: 1\nname: scanned\ncoil: {{shape: {coil}, outer_diameter: {size}, turns: {TURNS}, "
        f"trace_width: {track:.6f}, trace_spacing: {track:.6f}}}\n"
        f"target: {{shape: {target}, size: {across}, thickness: 1, material: copper}}\n"
    )


def axes() -> list[np.ndarray]:
    """Places (m) beside the coil's centre along x and y, and logarithms of the gap."""
    return [chebyshev(0.0, REACH, GRID[0]), chebyshev(0.0, REACH, GRID[1]), chebyshev(*np.log(GAPS), GRID[2])]


def tabulated(coil: str, size: float, fill: float, target: str, across: float) -> np.ndarray:
    """Roots of the change of L at the grid, over that right over the coil: (x, y, gap)."""
    spec = sensor(coil, size, fill, target, across)
    band = 0.95 * FREQUENCY, 1.05 * FREQUENCY
    plate = solved_plate(spec, lay_out(spec).coils, band, None, GAPS[0], 8.0 * MM)
    x, y, gap = (part.ravel() for part in np.meshgrid(*axes(), indexing="ij"))
    places = np.stack([x, y, np.exp(gap)], axis=1)
    turns = np.tile(turned(np.zeros((1, 3))), (len(places), 1, 1))
    change = np.concatenate(
        [plate.changes(turns[k : k + 200], places[k : k + 200])[0] for k in range(0, len(x), 200)], axis=1
    )
    return np.log(-change[0, :, 0, 0].real).reshape(GRID)


class Maps:
    """Tables of 27 geometries, and the quadratic between them."""

    def __init__(self, coil: str, target: str) -> None:
        self.tables = np.array([tabulated(coil, size, fill, target, across)
                                for size, fill, across in product(SIZES, FILLS, TARGETS)])  # fmt: skip

    def between(self, size: float, fill: float, across: float) -> np.ndarray:
        """The table of a geometry."""
        weights = [
            _lagrange(nodes, at) for nodes, at in zip((SIZES, FILLS, TARGETS), (size, fill, across), strict=True)
        ]
        share = np.einsum("i,j,k->ijk", *weights).ravel()
        return np.tensordot(share, self.tables, axes=1)


def _lagrange(nodes: Sequence[float], at: float) -> np.ndarray:
    found = np.ones(len(nodes))
    for i, node in enumerate(nodes):
        for j, other in enumerate(nodes):
            if i != j:
                found[i] *= (at - other) / (node - other)
    return found


class Unit:
    """A scanned unit: places (mm), inductances, and in which corner each coil is."""

    def __init__(self, path: Path) -> None:
        rows = np.genfromtxt(path, delimiter=",", names=True)
        self.name = path.stem
        self.places = np.stack([rows["x_mm"], rows["y_mm"], rows["z_mm"]], axis=1)
        self.inductance = np.stack([rows[f"L{k}_uH"] for k in range(4)], axis=1)
        low = self.inductance.max(axis=0) - self.inductance
        self.corners = np.sign(low.T @ self.places[:, :2])

    def changes(self, table: np.ndarray, pitch: float, own: np.ndarray) -> np.ndarray:
        """Change of L in the table's units at every place, (places, coils)."""
        gap, dx, dy, yaw = own
        cos, sin = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        x, y, z = self.places.T
        moved = np.stack([cos * x - sin * y + dx, sin * x + cos * y + dy], axis=1)
        height = np.log((gap + 4.0 - z) * MM)
        found = []
        for corner in self.corners:
            away = np.abs(moved - 0.5 * pitch * corner) * MM
            found.append(np.exp(evaluated(table[..., None], axes(), np.column_stack([away, height]))[:, 0]))
        return -np.stack(found, axis=1)

    def residual(self, change: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """What is left of L / L0, and the measured change of it; every coil's L0 is the best one."""
        shape = 1.0 + scale * change
        free = (self.inductance * shape).sum(axis=0) / (shape**2).sum(axis=0)
        return self.inductance / free - shape, self.inductance / free - 1.0


def fit(units: Sequence[Unit], maps: Maps) -> np.ndarray:
    """Size, fill, target, pitch, scale (logarithm), then every unit's own numbers."""
    start = np.array([15.0, 0.7, 14.0, 14.7, np.log(1e5), *([1.7, 0.0, 0.0, 0.0] * len(units))])
    # the scale of the first guess: the measured change over the table's
    table = maps.between(*start[:3])
    first = units[0].changes(table, 14.7, start[5 : 5 + UNIT])
    start[4] = np.log(np.ptp(units[0].inductance) / units[0].inductance.max() / np.ptp(first))

    def left(values: np.ndarray) -> np.ndarray:
        table = maps.between(*values[:3])
        parts = []
        for k, unit in enumerate(units):
            change = unit.changes(table, values[3], values[5 + UNIT * k : 5 + UNIT * (k + 1)])
            gone, _ = unit.residual(change, float(np.exp(values[4])))
            parts.append(gone.ravel())
        return np.concatenate(parts) * 1e3

    low = [SIZES[0] - 1.0, FILLS[0] - 0.2, TARGETS[0] - 1.0, 13.0, -np.inf, *([1.0, -1.0, -1.0, -5.0] * len(units))]
    high = [SIZES[-1] + 1.0, 0.97, TARGETS[-1] + 1.0, 17.0, np.inf, *([3.5, 1.0, 1.0, 5.0] * len(units))]
    return least_squares(left, start, bounds=(low, high), x_scale="jac").x


def main(folder: str, coil: str = "square", target: str = "circle") -> None:
    units = [Unit(path) for path in sorted(Path(folder).glob("s[0-9]*.csv"))]
    maps = Maps(coil, target)
    found = fit(units, maps)
    size, fill, across, pitch = found[:4]
    print(f"{coil} coils of {size:.2f} mm, {100 * fill:.0f} % wound, pitch {pitch:.2f} mm; {target} of {across:.2f} mm")
    table = tabulated(coil, size, fill, target, across)
    for k, unit in enumerate(units):
        own = found[5 + UNIT * k : 5 + UNIT * (k + 1)]
        gone, change = unit.residual(unit.changes(table, pitch, own), float(np.exp(found[4])))
        print(f"{unit.name}: gap {own[0]:.2f} mm, shift {own[1]:.2f}, {own[2]:.2f} mm, yaw {own[3]:.2f} deg")
        heights = unit.places[:, 2]
        for name, some in (("z >= -3", heights >= -3.0), ("beyond", heights < -3.0),
                           *((f"z = {z:g}", heights == z) for z in np.unique(heights)[::-1])):  # fmt: skip
            size = np.sqrt(np.mean(change[some] ** 2))
            share = np.sqrt(np.mean(gone[some] ** 2)) / size
            print(f"  {name:<8} {100.0 * share:5.2f} % of the change ({100.0 * size:.2f} % of L)")


if __name__ == "__main__":
    main(*sys.argv[1:])
