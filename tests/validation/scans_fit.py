"""Measured sensors against the response: one geometry for all units, each with its own gap, shift, yaw and L0.

    python tests/validation/scans_fit.py FOLDER [shape of the coils: square or circle] [shape of the target]

FOLDER has s1.csv, s3.csv ...: columns x_mm, y_mm, z_mm (+z towards the coils), L0_uH to L3_uH, no tilt. The geometry is
not stated there, so the coils' size and filling, the target's size, pitch and the leads' share are fitted, too. Prints
what was found, and the rms of the residual over that of the change, all coils of a unit: for z >= -3 mm, beyond, and by
height.

Where FOLDER also has tilt_*.csv (an earlier unit of other coils, scanned level and tilted), they are fitted with the
geometry that the scans gave, and with one of their own: the level one by gap, shift, yaw, L0, scale and how its target
is mounted askew, the tilted ones by where the target's middle has gone and how it is turned, scale and yaw being those
of the level one. The turn that is found is held beside the one that was set.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from sitscad.estimates.states.placed import PoseRange
from sitscad.estimates.states.plate import make_target_plate
from sitscad.kernels.electromagnetics.eddy.target import rotation_matrices
from sitscad.kernels.electromagnetics.polynomials import chebyshev_points, evaluate_polynomials
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

MM = 1e-3
FREQUENCY = 2.4e6
TURNS = 16
GRID = (13, 13, 11)
REACH, GAPS = 14.0 * MM, (0.9 * MM, 13.0 * MM)
SIZES, FILLS, TARGETS = (13.5, 15.0, 16.5), (0.5, 0.7, 0.9), (12.0, 14.0, 16.0)
TURN = 2.5
"""Degrees at which the target is tabulated for tilts."""

PITCHES = 14.7, 13.0, 17.0
EARLIER_SIZES, EARLIER_TARGETS, EARLIER_PITCHES = (6.0, 8.0, 10.0), (12.0, 16.0, 20.0), (11.7, 8.0, 14.0)
"""Of the earlier unit, whose response falls off sooner with height and sideways."""

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
    gaps = chebyshev_points(*np.log(GAPS), GRID[2])
    return [*(chebyshev_points(0.0, REACH, count) for count in GRID[:2]), gaps]


def tabulated(coil: str, size: float, fill: float, target: str, across: float, turn: float = 0.0) -> np.ndarray:
    """Logarithms of the change of L at the grid, (x, y, gap), +x of the target turned towards the coil by degrees."""
    spec = sensor(coil, size, fill, target, across)
    band = 0.95 * FREQUENCY, 1.05 * FREQUENCY
    half = 0.5 * spec.target.size[0], 0.5 * spec.target.size[1]
    cover = PoseRange(GAPS[0], 8.0 * MM, half)
    plate = make_target_plate(spec.target, spec.coil, lay_out(spec).coils, band, None, cover)
    x, y, gap = (part.ravel() for part in np.meshgrid(*axes(), indexing="ij"))
    places = np.stack([x, y, np.exp(gap)], axis=1)
    turns = np.tile(rotation_matrices(np.radians([[0.0, turn, 0.0]])), (len(places), 1, 1))
    change = np.concatenate(
        [plate.changes(turns[k : k + 200], places[k : k + 200])[0] for k in range(0, len(x), 200)], axis=1
    )
    return np.log(-change[0, :, 0, 0].real).reshape(GRID)


class Maps:
    """Tables of 27 geometries, and the quadratic between them."""

    def __init__(
        self, coil: str, target: str, sizes: Sequence[float] = SIZES, targets: Sequence[float] = TARGETS
    ) -> None:
        self.sizes, self.targets = sizes, targets
        self.tables = np.array([tabulated(coil, size, fill, target, across)
                                for size, fill, across in product(sizes, FILLS, targets)])

    def between(self, size: float, fill: float, across: float) -> np.ndarray:
        """The table of a geometry."""
        weights = [
            _lagrange(nodes, at)
            for nodes, at in zip((self.sizes, FILLS, self.targets), (size, fill, across), strict=True)
        ]
        share = np.einsum("i,j,k->ijk", *weights).ravel()
        return np.tensordot(share, self.tables, axes=1)


def _lagrange(nodes: Sequence[float], at: float) -> np.ndarray:
    result = np.ones(len(nodes))
    for i, node in enumerate(nodes):
        for j, other in enumerate(nodes):
            if i != j:
                result[i] *= (at - other) / (node - other)
    return result


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
        height, moved = self.seen(own)
        result = []
        for corner in self.corners:
            away = np.abs(moved - 0.5 * pitch * corner) * MM
            result.append(np.exp(evaluate_polynomials(table[..., None], axes(), np.column_stack([away, height]))[:, 0]))
        return -np.stack(result, axis=1)

    def seen(self, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithm of the gap (m) and the target's middle beside that of the coils (mm) at every place."""
        gap, dx, dy, yaw = own[:UNIT]
        cos, sin = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        x, y, z = self.places.T
        return np.log((gap + 4.0 - z) * MM), np.stack([cos * x - sin * y + dx, sin * x + cos * y + dy], axis=1)

    def residual(self, change: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
        """What is left of L / L0, and the measured change of it; every coil's L0 is the best one."""
        shape = 1.0 + scale * change
        free = (self.inductance * shape).sum(axis=0) / (shape**2).sum(axis=0)
        return self.inductance / free - shape, self.inductance / free - 1.0


def fit(units: Sequence[Unit], maps: Maps, pitches: tuple[float, float, float] = PITCHES) -> np.ndarray:
    """Size, fill, target, pitch (mm: `pitches` are its first guess and limits), scale (logarithm), then every unit's
    own numbers.
    """
    sizes, targets = maps.sizes, maps.targets
    start = np.array([sizes[1], 0.7, targets[1], pitches[0], np.log(1e5), *([1.7, 0.0, 0.0, 0.0] * len(units))])
    # the scale of the first guess: the measured change over the table's
    table = maps.between(*start[:3])
    first = units[0].changes(table, pitches[0], start[5 : 5 + UNIT])
    start[4] = np.log(np.ptp(units[0].inductance) / units[0].inductance.max() / np.ptp(first))

    def left(values: np.ndarray) -> np.ndarray:
        table = maps.between(*values[:3])
        parts = []
        for k, unit in enumerate(units):
            change = unit.changes(table, values[3], values[5 + UNIT * k : 5 + UNIT * (k + 1)])
            gone, _ = unit.residual(change, float(np.exp(values[4])))
            parts.append(gone.ravel())
        return np.concatenate(parts) * 1e3

    low = [
        sizes[0] - 1.0,
        FILLS[0] - 0.2,
        targets[0] - 1.0,
        pitches[1],
        -np.inf,
        *([1.0, -1.5, -1.5, -5.0] * len(units)),
    ]
    high = [sizes[-1] + 1.0, 0.97, targets[-1] + 1.0, pitches[2], np.inf, *([3.5, 1.5, 1.5, 5.0] * len(units))]
    return least_squares(left, start, bounds=(low, high), x_scale="jac").x


class Tilted:
    """What a coil reads of a target that tilts, to the second power of its angles, of one geometry."""

    def __init__(self, geometry: tuple[str, float, float, str, float]) -> None:
        level, nearer, farther = (tabulated(*geometry, turn) for turn in (0.0, TURN, -TURN))
        self.level = level
        self.slope = (nearer - farther) / (2.0 * TURN)
        self.bend = (nearer + farther - 2.0 * level) / TURN**2

    def changes(self, unit: Unit, pitch: float, own: np.ndarray) -> np.ndarray:
        """Change of L in the tables' units at every place of a set, (places, coils); `own` are the unit's numbers, then
        by how many degrees the target's +x and +y sides are turned towards the coils.
        """
        height, moved = unit.seen(own)
        result = []
        for corner in unit.corners:
            aside = moved - 0.5 * pitch * corner
            away, sense = np.abs(aside) * MM, np.where(aside < 0.0, -1.0, 1.0)
            here = evaluate_polynomials(self.level[..., None], axes(), np.column_stack([away, height]))[:, 0]
            for k in (0, 1):  # coil and target look the same along y as along x
                at = np.column_stack([away[:, ::-1] if k else away, height])
                turn = sense[:, k] * own[UNIT + k]
                here += turn * evaluate_polynomials(self.slope[..., None], axes(), at)[:, 0]
                here += 0.5 * turn**2 * evaluate_polynomials(self.bend[..., None], axes(), at)[:, 0]
            result.append(np.exp(here))
        return -np.stack(result, axis=1)

    def fit(self, unit: Unit, pitch: float, start: np.ndarray, free: Sequence[int]) -> np.ndarray:
        """The numbers of a set, then the logarithm of the scale: the `free` ones, from a start."""
        low = np.array([1.0, -3.0, -3.0, -10.0, -8.0, -8.0, -np.inf])
        high = np.array([5.0, 3.0, 3.0, 10.0, 8.0, 8.0, np.inf])
        chosen = list(free)

        def whole(values: np.ndarray) -> np.ndarray:
            own = start.copy()
            own[chosen] = values
            return own

        def left(values: np.ndarray) -> np.ndarray:
            own = whole(values)
            return unit.residual(self.changes(unit, pitch, own[:-1]), float(np.exp(own[-1])))[0].ravel() * 1e3

        bounds = low[chosen], high[chosen]
        return whole(least_squares(left, start[chosen], bounds=bounds, x_scale="jac").x)


AWAY = np.array([0.0, 0.0, 0.0, 0.0, TURN, 0.0, 0.0])
"""From where a tilted set is begun: the sense of the hexapod's turns is not stated."""


def tell_tilts(folder: str, shapes: tuple[str, str], geometries: dict[str, np.ndarray]) -> None:
    """Fits the tilt sets of a folder by the geometry of the scans and by one of their own; prints what was found."""
    level, *others = [Unit(path) for path in sorted(Path(folder).glob("tilt_*.csv"))]
    maps = Maps(*shapes, EARLIER_SIZES, EARLIER_TARGETS)
    own = {"a geometry of its own": fit([level], maps, EARLIER_PITCHES)}
    for name, geometry in (geometries | own).items():
        size, fill, across, pitch, scale = geometry[:5]
        print(
            f"{name}: coils of {size:.2f} mm, {100 * fill:.0f} % wound, pitch {pitch:.2f} mm; target of {across:.2f} mm"
        )
        tilted = Tilted((shapes[0], size, fill, shapes[1], across))
        start = np.array([*geometry[5 : 5 + UNIT], 0.0, 0.0, scale])
        seen = np.ptp(level.inductance / level.inductance.mean(axis=0))
        start[-1] = np.log(seen / np.ptp(tilted.changes(level, pitch, start[:-1])))
        flat = tilted.fit(level, pitch, start, (0, 1, 2, 3, 6))
        tell_one(f"{level.name}, level", level, tilted, pitch, flat)
        base = tilted.fit(level, pitch, flat, range(7))
        tell_one(f"{level.name}, mounted askew", level, tilted, pitch, base)
        for unit in others:
            result = min((tilted.fit(unit, pitch, base + sense * AWAY, (0, 1, 2, 4, 5)) for sense in (1.0, -1.0)),
                        key=lambda own: missed(unit, tilted, pitch, own))
            tell_one(unit.name, unit, tilted, pitch, result)
            more = result - base
            print(f"  turned by {more[4]:+.2f} deg along x, {more[5]:+.2f} along y more than the level one; its middle "
                  f"went by {more[1]:.2f}, {more[2]:.2f} mm aside and {more[0]:.2f} mm away")
            for sense in (1.0, 0.0, -1.0):
                stored = tilted.fit(unit, pitch, base + sense * AWAY, (0, 1, 2))
                tell_one(f"{unit.name}, held {sense * TURN:+.1f} deg from the level one", unit, tilted, pitch, stored)


def missed(unit: Unit, tilted: Tilted, pitch: float, found: np.ndarray) -> float:
    """Rms of what is left of L / L0."""
    gone, _ = unit.residual(tilted.changes(unit, pitch, found[:-1]), float(np.exp(found[-1])))
    return float(np.sqrt(np.mean(gone**2)))


def tell_one(name: str, unit: Unit, tilted: Tilted, pitch: float, found: np.ndarray) -> None:
    gone, change = unit.residual(tilted.changes(unit, pitch, found[:-1]), float(np.exp(found[-1])))
    print(f"{name}: gap {found[0]:.2f} mm at z = 4, shift {found[1]:.2f}, {found[2]:.2f} mm, yaw {found[3]:.2f} deg, "
          f"turned {found[4]:+.2f} deg along x, {found[5]:+.2f} along y")
    heights = unit.places[:, 2]
    for words, some in (("all", heights > -99.0), *((f"z = {z:g}", heights == z) for z in np.unique(heights)[::-1])):
        size = np.sqrt(np.mean(change[some] ** 2))
        share = np.sqrt(np.mean(gone[some] ** 2)) / size
        print(f"  {words:<8} {100.0 * share:5.2f} % of the change ({100.0 * size:.2f} % of L)")


def main(folder: str, coil: str = "square", target: str = "circle") -> None:
    units = [Unit(path) for path in sorted(Path(folder).glob("s[0-9]*.csv"))]
    maps = Maps(coil, target)
    result = fit(units, maps)
    size, fill, across, pitch = result[:4]
    print(f"{coil} coils of {size:.2f} mm, {100 * fill:.0f} % wound, pitch {pitch:.2f} mm; {target} of {across:.2f} mm")
    table = tabulated(coil, size, fill, target, across)
    for k, unit in enumerate(units):
        own = result[5 + UNIT * k : 5 + UNIT * (k + 1)]
        gone, change = unit.residual(unit.changes(table, pitch, own), float(np.exp(result[4])))
        print(f"{unit.name}: gap {own[0]:.2f} mm, shift {own[1]:.2f}, {own[2]:.2f} mm, yaw {own[3]:.2f} deg")
        heights = unit.places[:, 2]
        for name, some in (("z >= -3", heights >= -3.0), ("beyond", heights < -3.0),
                           *((f"z = {z:g}", heights == z) for z in np.unique(heights)[::-1])):
            size = np.sqrt(np.mean(change[some] ** 2))
            share = np.sqrt(np.mean(gone[some] ** 2)) / size
            print(f"  {name:<8} {100.0 * share:5.2f} % of the change ({100.0 * size:.2f} % of L)")
    if any(Path(folder).glob("tilt_*.csv")):
        tell_tilts(folder, (coil, target), {"the geometry of the scans": result})


if __name__ == "__main__":
    main(*sys.argv[1:])
