"""Random pairs of alike coils side by side, the same for every run, and their mutual inductance by the volume integral.

The coil is the random design of that number (`designs`). The other one stands in the same plane: beside or behind it,
or in any direction, then far enough for any rotation; the copper keeps a distance of one track spacing to twice the
coil's larger size. Half of them are rotated: half a turn, or, in any direction, by any angle.

    python tests/validation/coil_pairs.py [--pairs 60]

writes coil_pairs.csv, from where it ends.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "electromagnetics"), str(HERE)]

import designs  # noqa: E402
import volume_integral  # noqa: E402

FILE = HERE / "coil_pairs.csv"
COLUMNS = ("family", "number", "centre_x_mm", "centre_y_mm", "rotation_rad", "mutual_inductance_H", "error")


@dataclass(frozen=True)
class CoilPair:
    """Two coils: the first about the origin, the second of the same design about `centre` (m), rotated (rad)."""

    first: designs.Design
    second: designs.Design
    centre: tuple[float, float]
    rotation: float


def pair(family: str, number: int) -> CoilPair:
    """Pair `number` of a family."""
    coil = designs.design(family, number)
    random = np.random.default_rng([41, designs.FAMILIES.index(family), number])
    spec, where = coil.spec, number % 3
    gap = float(spec.trace_spacing * (2.0 * max(spec.size) / spec.trace_spacing) ** random.random())
    turned = bool(random.integers(2))
    if where == 2:
        rotation = float(random.uniform(0.0, 2.0 * math.pi)) if turned else 0.0
        across = math.hypot(*spec.size) if spec.shape not in ("circle", "racetrack") else max(spec.size)
        apart, direction = across / _cosine(spec.shape) + gap, float(random.uniform(0.0, 2.0 * math.pi))
    else:
        rotation, apart, direction = math.pi if turned else 0.0, spec.size[where] + gap, 0.5 * math.pi * where
        apart /= _cosine(spec.shape)
    centre = (apart * math.cos(direction), apart * math.sin(direction))
    return CoilPair(coil, rotated(coil, rotation), centre, rotation)


def _cosine(shape: str) -> float:
    # Corners of the polygons that have a size between sides stand further out.
    return {"hexagon": math.cos(math.pi / 6.0), "octagon": math.cos(math.pi / 8.0)}.get(shape, 1.0)


def rotated(coil: designs.Design, angle: float) -> designs.Design:
    """A design turned about its centre."""
    spirals = tuple(replace(layer, angle=layer.angle + angle) for layer in coil.spirals)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    drawn = tuple(replace(t, **_turned(t, turn), arcs=_turned_arcs(t.arcs, turn, angle, 3)) for t in coil.drawn)
    conductors = tuple(
        replace(c, **_turned(c, turn), polar=_turned_arcs(c.polar, turn, angle, 4)) for c in coil.conductors
    )
    return replace(coil, spirals=spirals, drawn=drawn, conductors=conductors)


def _turned(track, turn):
    return {name: getattr(track, name) @ turn for name in ("starts", "ends", "before", "after")}


def _turned_arcs(arcs, turn, angle, azimuth):
    arcs = arcs.copy()
    arcs[:, :2] = arcs[:, :2] @ turn
    arcs[:, azimuth] += angle
    return arcs


def shifted(conductor: volume_integral.Conductor, centre: tuple[float, float]) -> volume_integral.Conductor:
    """A conductor moved by `centre` (m)."""
    polar = conductor.polar.copy()
    polar[:, :2] += centre
    return replace(conductor, starts=conductor.starts + centre, ends=conductor.ends + centre, polar=polar)


def exact(two: CoilPair, points: volume_integral.Points | None = None) -> float:
    """The mutual inductance (H) by the volume integral."""
    n = points or designs.resolution(two.first)
    return math.fsum(
        volume_integral.mutual(a, shifted(b, two.centre), n)
        for a in two.first.conductors
        for b in two.second.conductors
    )


def resolution(two: CoilPair, finer: bool = False) -> volume_integral.Points:
    """The points that the yardstick takes: coils far apart cancel, so more along the tracks than for one coil."""
    own = designs.resolution(two.first)
    if finer:
        return replace(own, far=12, along=own.along + 10, inner=17, filaments=4, beside=6)
    return replace(own, far=9, along=own.along + 4, inner=13)


def row(family: str, number: int) -> dict[str, str]:
    """One line of the file; every fifth pair is integrated again with finer points."""
    two = pair(family, number)
    value, error = exact(two, resolution(two)), ""
    if number % 5 == 0:
        error = f"{exact(two, resolution(two, finer=True)) / value - 1.0:.1e}"
    result = (
        family,
        str(number),
        *(f"{1e3 * x:.7g}" for x in two.centre),
        f"{two.rotation:.7g}",
        f"{value:.10e}",
        error,
    )
    return dict(zip(COLUMNS, result, strict=True))


def read() -> list[dict[str, str]]:
    """The lines of the file, none where there is no file."""
    if not FILE.exists():
        return []
    with FILE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def main() -> None:
    """Integrate the pairs that the file has not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=60)
    arguments = parser.parse_args()
    rows = read()
    done = {(r["family"], int(r["number"])) for r in rows}
    for number in range(arguments.pairs):
        rows += [row(family, number) for family in designs.FAMILIES if (family, number) not in done]
        rows.sort(key=lambda r: (designs.FAMILIES.index(r["family"]), int(r["number"])))
        with FILE.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
