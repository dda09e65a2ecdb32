"""Run time of the flex board's steps on the four-coil template, and how each grows with turns and with coils.

    python tests/benchmarks/flex_board.py [folder]

writes `flex_board.csv` and `flex_board.svg` to the folder (default: here, next to this file's name in the system's
temporary folder). Times are processor times, the best of a few warm runs in one thread; `noise` is the middle run over
the best one. Growth is the slope of time over turns or coils on logarithmic axes, over the upper half of their range:
1 is proportional, 2 the square.
"""

from __future__ import annotations

import csv
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import sitscad
from sitscad.writers import excellon, gerber, kicad

ROOT = Path(__file__).parents[2]
RUNS = 3
STEPS = ("lay out", "estimate", "check", "Gerber and drill", "KiCad", "verify the files")
TURNS = (4, 8, 16, 32, 64, 128)
COILS = ((1, 1), (2, 1), (2, 2), (3, 2), (3, 3), (4, 3))


def with_turns(turns: int) -> sitscad.SensorSpec:
    """One coil of two layers, as large as its turns ask for."""
    coil = {"shape": "circle", "outer_diameter": 2.5 + 0.42 * turns, "turns": turns, "layers": 2, "trace_width": 0.1,
            "trace_spacing": 0.1}  # fmt: skip
    return sitscad.load_text(json.dumps({"sitscad": 1, "name": f"turns-{turns}", "coil": coil}))


def with_coils(columns: int, rows: int) -> sitscad.SensorSpec:
    """A grid of the template's coils with more room between them."""
    coil = {"shape": "circle", "outer_diameter": 5, "turns": 8, "layers": 2, "trace_width": 0.1, "trace_spacing": 0.1}
    array = {"pattern": "grid", "count": [columns, rows], "pitch": 9} if columns * rows > 1 else {"pattern": "single"}
    document = {"sitscad": 1, "name": f"coils-{columns * rows}", "coil": coil, "array": array}
    return sitscad.load_text(json.dumps(document))


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Best time (s) of some runs, and the middle one over it."""
    times = []
    for _ in range(RUNS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times), statistics.median(times) / max(min(times), 1e-9)


def steps(spec: sitscad.SensorSpec) -> Iterator[tuple[str, float, float]]:
    """(step, seconds, noise) of everything that a board needs."""
    layout = sitscad.lay_out(spec)
    if layout.findings:
        raise SystemExit(f"{spec.name} is not routed: {layout.findings[0].message}")
    estimates = sitscad.estimate(layout)
    with tempfile.TemporaryDirectory() as folder:
        built = sitscad.build(spec, folder, only=("gerber",), force=True).directory
        works = (
            lambda: sitscad.lay_out(spec),
            lambda: sitscad.estimate(layout),
            lambda: sitscad.check(spec, layout, estimates),
            lambda: (gerber.render(layout), excellon.render(layout)),
            lambda: kicad.render(layout),
            lambda: sitscad.verify(built),
        )
        for name, work in zip(STEPS, works, strict=True):
            yield name, *timed(work)


def measured(specs: dict[float, sitscad.SensorSpec]) -> list[dict[str, object]]:
    """A row for every spec and step."""
    return [
        {"x": x, "step": name, "seconds": seconds, "noise": noise}
        for x, spec in specs.items()
        for name, seconds, noise in steps(spec)
    ]


def growth(rows: list[dict[str, object]], step: str) -> float:
    """The slope of log time over log x, of the upper half of the range."""
    points = [(float(r["x"]), float(r["seconds"])) for r in rows if r["step"] == step]
    x, y = np.log(np.array(points[len(points) // 2 :]).T)
    return float(np.polyfit(x, y, 1)[0])


def print_table(title: str, rows: list[dict[str, object]]) -> None:
    """One line a step: times over x, and the growth."""
    values = list(dict.fromkeys(row["x"] for row in rows))
    print(f"\n{title}, ms\n{'':18s}" + "".join(f"{x:>9g}" for x in values) + "   growth")
    for step in STEPS:
        times = [1e3 * float(r["seconds"]) for r in rows if r["step"] == step]
        slope = f"{growth(rows, step):9.1f}" if len(values) > 1 else ""
        print(f"{step:18s}" + "".join(f"{t:9.1f}" for t in times) + slope)


def plot(folder: Path, by_turns: list[dict[str, object]], by_coils: list[dict[str, object]]) -> None:
    """Time over turns and over coils."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True, layout="constrained")
    for axis, rows, name in zip(axes, (by_turns, by_coils), ("turns a layer", "coils"), strict=True):
        for step in STEPS:
            points = [(r["x"], r["seconds"]) for r in rows if r["step"] == step]
            axis.loglog(*zip(*points, strict=True), marker="o", markersize=3, label=step)
        axis.set_xlabel(name)
        axis.grid(True, which="major", alpha=0.3)
    axes[0].set_ylabel("processor time, s")
    axes[0].legend(fontsize=8)
    figure.savefig(folder / "flex_board.svg")


def main() -> None:
    """Measure, print, write."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.gettempdir()) / "sitscad-benchmarks"
    folder.mkdir(parents=True, exist_ok=True)
    template = measured({4: sitscad.load(ROOT / "templates" / "three_axis_grid.yaml")})
    by_turns = measured({turns: with_turns(turns) for turns in TURNS})
    by_coils = measured({nx * ny: with_coils(nx, ny) for nx, ny in COILS})
    print_table("four-coil template (three_axis_grid)", template)
    print_table("one coil of two layers, by turns a layer", by_turns)
    print_table("coils of eight turns on two layers, by coils", by_coils)
    noise = statistics.median(float(row["noise"]) for row in by_turns + by_coils)
    print(f"\nnoise (middle run over best): median {noise:.2f}")
    with (folder / "flex_board.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, ("series", "x", "step", "seconds", "noise"))
        writer.writeheader()
        for series, rows in (("template", template), ("turns", by_turns), ("coils", by_coils)):
            writer.writerows({"series": series, **row} for row in rows)
    plot(folder, by_turns, by_coils)
    print(f"written to {folder}")


if __name__ == "__main__":
    main()
