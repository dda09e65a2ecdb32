"""Run time against error of every method for a coil's inductance, and how time grows: a table and a plot.

    python tests/benchmarks/inductance.py [-o DIR] [--designs N]

writes inductance.csv and inductance.svg (the Pareto front) into DIR (default: the working directory) and prints the
table. The errors are against the volume integral of tests/validation. It never fails on time: it says how noisy the
machine is.
"""

from __future__ import annotations

import argparse
import csv
import math
import resource
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS / "physics"), str(TESTS / "validation")]

import designs  # noqa: E402

from sitscad.estimates.windings import METHODS, WindingGeometry  # noqa: E402
from sitscad.spec.sensor import CoilSpec  # noqa: E402

COLOURS = {
    "circle": "#0b6",
    "square": "#06c",
    "rectangle": "#609",
    "hexagon": "#c60",
    "octagon": "#c06",
    "racetrack": "#333",
}


def seconds(call) -> float:
    """Best of three runs in process time: what the work costs, not what the neighbours leave of the machine."""
    call()
    best = math.inf
    for _ in range(3):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best


def noise() -> float:
    """Relative spread of one fixed piece of work."""
    x = np.linspace(0.1, 1.0, 200_000)
    spent = []
    for _ in range(9):
        start = time.perf_counter()
        np.sum(np.arcsinh(x) / np.sqrt(x))
        spent.append(time.perf_counter() - start)
    return float(np.std(spent) / np.median(spent))


def geometry(design: designs.Design) -> WindingGeometry:
    return WindingGeometry(design.spec, design.spirals, (), design.drawn)


def methods(shape: str):
    return [m for m in METHODS if shape in m.shapes and not m.is_cross_check]


def accuracy(count: int) -> list[dict[str, object]]:
    """Every method on `count` random designs a shape: median and largest error, bound over error, time."""
    rows: list[dict[str, object]] = []
    for shape in designs.SHAPES:
        coils = [designs.design(shape, k) for k in range(count)]
        exact = [designs.exact(coil) for coil in coils]
        for method in methods(shape):
            valid = [k for k, coil in enumerate(coils) if method.is_valid(geometry(coil))]
            if not valid:
                continue
            errors = [abs(method.solve(geometry(coils[k])) / exact[k] - 1.0) for k in valid]
            bounds = [method.error(geometry(coils[k])) for k in valid]
            spent = [seconds(partial(method.solve, geometry(coils[k]))) for k in valid]
            rows.append({"shape": shape, "method": method.name, "designs": len(valid),
                         "median_error": float(np.median(errors)), "largest_error": max(errors),
                         "median_bound_over_error": float(np.median(np.divide(bounds, errors))),
                         "exceeded": sum(e > b for e, b in zip(errors, bounds, strict=True)),
                         "median_ms": 1e3 * float(np.median(spent))})  # fmt: skip
    return rows


def growth() -> list[str]:
    """How the time of the finest method grows with turns and with layers: exponents of power laws."""
    lines = []
    for shape in designs.SHAPES:
        method = methods(shape)[0]

        def one(turns: float, layers: int, shape: str = shape):
            spec = CoilSpec(shape=shape, size=(30e-3, 20e-3) if shape in ("rectangle", "racetrack") else (20e-3, 20e-3),
                            turns=turns, layers=tuple(range(1, layers + 1)), trace_width=40e-6,
                            trace_spacing=40e-6)  # fmt: skip
            return geometry(designs.built(spec, tuple(-60e-6 * k for k in range(layers)), 18e-6))

        turns = [seconds(partial(method.solve, one(n, 1))) for n in (12.0, 24.0, 48.0, 96.0)]
        layers = [seconds(partial(method.solve, one(12.0, n))) for n in (1, 2, 4, 8)]
        power = np.polyfit(np.log([24, 48, 96]), np.log(turns[1:]), 1)[0]
        power_layers = np.polyfit(np.log([1, 2, 4, 8]), np.log(layers), 1)[0]
        lines.append(f"{shape}, {method.name}: turns^{power:.2f} (96 turns {1e3 * turns[-1]:.0f} ms), "
                     f"layers^{power_layers:.2f} (8 layers of 12 turns {1e3 * layers[-1]:.0f} ms)")  # fmt: skip
    return lines


def plot(rows: list[dict[str, object]]) -> str:
    """Error over time, both logarithmic, as SVG."""

    def x(ms: float) -> float:
        return 60 + 140 * (math.log10(ms) + 1.5)

    def y(error: float) -> float:
        return 20 + 62 * -math.log10(max(error, 1e-7))

    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="720" height="500" font-family="sans-serif" '
             'font-size="11">',
             '<rect width="720" height="500" fill="#fff"/>']  # fmt: skip
    for k in range(-1, 4):
        parts.append(f'<text x="{x(10.0**k):.0f}" y="490">{10.0**k:g} ms</text>')
    for k in range(1, 8):
        parts.append(f'<text x="5" y="{y(10.0**-k):.0f}">1e-{k}</text>')
        parts.append(f'<line x1="50" x2="710" y1="{y(10.0**-k):.0f}" y2="{y(10.0**-k):.0f}" stroke="#ddd"/>')
    for row in rows:
        px, py, top = x(row["median_ms"]), y(row["median_error"]), y(row["largest_error"])
        colour = COLOURS[row["shape"]]
        parts.append(f'<line x1="{px:.1f}" x2="{px:.1f}" y1="{py:.1f}" y2="{top:.1f}" stroke="{colour}"/>')
        parts.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4" fill="{colour}"/>')
        parts.append(f'<text x="{px + 6:.1f}" y="{py + 4:.1f}">{row["shape"]} {row["method"]}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("."))
    parser.add_argument("--designs", type=int, default=12)
    arguments = parser.parse_args()
    rows = accuracy(arguments.designs)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with (arguments.output / "inductance.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (arguments.output / "inductance.svg").write_text(plot(rows), encoding="utf-8")
    print(f"{'shape':10} {'method':16} {'designs':>7} {'median':>8} {'largest':>8} {'bound/error':>11} {'ms':>7}")
    for r in rows:
        print(f"{r['shape']:10} {r['method']:16} {r['designs']:7} {r['median_error']:8.1e} {r['largest_error']:8.1e} "
              f"{r['median_bound_over_error']:11.1f} {r['median_ms']:7.1f}")  # fmt: skip
    print("\n".join(growth()))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MB; the same work repeated spreads by {100 * noise():.0f} %")


if __name__ == "__main__":
    main()
