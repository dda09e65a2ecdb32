"""Writes random_designs.csv: the volume integral of every random design, so that bounds are judged without it.

    python tests/validation/write_references.py [--designs 500] [--large 24] [--minutes 60]

It begins where the file ends, and may be stopped at any time. Every tenth design is integrated again with finer points,
and of the large ones those with few turns; the difference over the result is the column `error`. Rows hold the
dimensions too: a test holds them against the design that its number gives today.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "electromagnetics"), str(HERE)]

import designs  # noqa: E402

FILE = HERE / "random_designs.csv"
COLUMNS = ("family", "series", "number", "size_x_mm", "size_y_mm", "turns", "layers", "width_um", "pitch_um",
           "copper_um", "layer_distance_um", "corner_radius_um", "inductance_H", "error")
BLOCK = 20
AGAIN = 15.0
"""Turns times the kinds of pairs of layers up to which a large design is integrated again."""


def dimensions(coil: designs.Design) -> dict[str, str]:
    """The dimensions of a coil as the file writes them."""
    spec, layers = coil.spec, coil.conductors
    apart = layers[0].z - layers[1].z if len(layers) > 1 else 0.0
    values = (1e3 * spec.size[0], 1e3 * spec.size[1], spec.turns, len(layers), 1e6 * spec.trace_width,
              1e6 * spec.pitch, 1e6 * layers[0].thickness, 1e6 * apart, 1e6 * spec.corner_radius)
    return dict(zip(COLUMNS[3:12], (f"{v:.7g}" for v in values), strict=True))


def row(family: str, series: str, number: int) -> dict[str, str]:
    """One line of the file."""
    coil = designs.design(family, number, series == "large")
    value = designs.exact(coil)
    error = ""
    kinds = 2 * len(coil.conductors) - 1
    if number % 10 == 0 if series == "small" else coil.spec.turns * kinds < AGAIN:
        error = f"{designs.exact(coil, designs.resolution(coil, finer=True)) / value - 1.0:.1e}"
    named = {"family": family, "series": series, "number": str(number)}
    return {**named, **dimensions(coil), "inductance_H": f"{value:.10e}", "error": error}


def read() -> list[dict[str, str]]:
    """The lines of the file, none where there is no file."""
    if not FILE.exists():
        return []
    with FILE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(rows: list[dict[str, str]]) -> None:
    """All lines in their order: the file is the same however often the work was broken off."""
    rows.sort(key=lambda r: (r["series"] != "small", designs.FAMILIES.index(r["family"]), int(r["number"])))
    with FILE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    """Integrate what is missing, the polygons first: they cost the least."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=500)
    parser.add_argument("--large", type=int, default=24)
    parser.add_argument("--minutes", type=float, default=1e9)
    arguments = parser.parse_args()
    until = time.monotonic() + 60.0 * arguments.minutes
    rows = read()
    done = {(r["family"], r["series"], int(r["number"])) for r in rows}
    straight = designs.POLYGONS
    curved = [f for f in designs.FAMILIES if f not in straight]
    wanted = [(f, "small", n) for n in range(arguments.designs) for f in straight]
    wanted += [(f, "small", n) for n in range(arguments.designs) for f in curved]
    wanted += [(f, "large", n) for n in range(arguments.large) for f in designs.FAMILIES]
    wanted = [w for w in wanted if w not in done]
    for k, which in enumerate(wanted):
        if time.monotonic() > until:
            break
        rows.append(row(*which))
        if k % BLOCK == BLOCK - 1 or k == len(wanted) - 1:
            write(rows)
            print(len(rows), "rows", flush=True)
    write(rows)


if __name__ == "__main__":
    main()
