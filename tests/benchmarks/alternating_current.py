"""Run time, memory and error of the alternating-current solvers, as a table and a plot.

    python tests/benchmarks/alternating_current.py [folder]

writes `alternating_current.csv` and `alternating_current.svg` to the folder (default: here, next to this file's name
in the system's temporary folder). The error is against the same solver's finest setting, which tests/validation holds
against filaments (rings within 0.6 %); the time is processor time, the best of several warm runs in one thread; `noise`
is the middle run over the best one.
"""

from __future__ import annotations

import csv
import math
import os
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "physics"))

import numpy as np
from windings import MM, UM, bench, coil, four_layers, miniature

from sitscad.physics import proximity
from sitscad.physics.bent_tracks import BentTrack, bent_winding_loss
from sitscad.physics.current_modes import ModeSet, ProximityLoss
from sitscad.physics.filaments import PolylineTrack, track_mutual_inductance
from sitscad.physics.spirals import spiral_inductance_matrix

COPPER = 58e6
FREQUENCIES = (1e4, 1e5, 1e6, 3e6, 10e6)

ROUND = {
    "7 mm 2 x 12": bench(),
    "4 mm 4 x 7.75": four_layers(),
    "3.5 mm 2 x 6.5": miniature(),
    "5 mm 4 x 12": coil(5 * MM, 12, 75 * UM, 75 * UM, [-62 * k * UM for k in range(4)], [12 * UM] * 4),
    "6 mm 8 x 10": coil(6 * MM, 10, 100 * UM, 100 * UM, [-60 * k * UM for k in range(8)], [18 * UM] * 8),
    "40 mm 2 x 9, 0.9 mm": coil(40 * MM, 9, 900 * UM, 150 * UM, (0.0, -570 * UM), (30 * UM, 30 * UM)),
    "6 mm 2 x 1.5": coil(6 * MM, 1.5, 200 * UM, 100 * UM, (0.0, -60 * UM), (35 * UM, 35 * UM)),
}


def square(turns: int, diameter: float, width: float, pitch: float, heights: list[float]) -> list[BentTrack]:
    """Square layers, mirrored in turn."""
    half = 0.5 * (diameter - width)
    points = [(-half, -half)]
    for m in range(4 * turns):
        a, b = half - pitch * (m // 4), half - pitch * ((m + 1) // 4)
        points.append([(a, -a), (a, a), (-a, a), (-a, -b)][m % 4])
    corners, tracks = np.array(points), []
    for k, z in enumerate(heights):
        path = corners if k % 2 == 0 else (corners * np.array([1.0, -1.0]))[::-1]
        tracks.append(BentTrack(path[:-1], path[1:], np.zeros(len(path) - 1), width, 18 * UM, z))
    return tracks


BENT = {
    "square 4 mm 4 x 8": square(8, 4 * MM, 80 * UM, 160 * UM, [0.0, -49 * UM, -127 * UM, -176 * UM]),
    "square 3 mm 1 x 5": square(5, 3 * MM, 100 * UM, 200 * UM, [0.0]),
}


def solvers() -> Iterator[tuple[str, float, dict[str, Callable[[], ProximityLoss]], Callable[[], ProximityLoss]]]:
    """Design, its direct inductance (H), its settings, and the finest one."""
    for name, layers in ROUND.items():
        across = 24 if layers[0].width > 500 * UM else 9
        points = 30 if layers[0].width > 500 * UM else 10
        finest = proximity.Resolution(ModeSet(across, 3, (points, 3)), 13, 40)
        settings = {
            "3 %": lambda layers=layers: proximity.winding_loss(layers, COPPER, 0.03),
            "1 %": lambda layers=layers: proximity.winding_loss(layers, COPPER, 0.01),
        }
        whole = float(spiral_inductance_matrix(layers).sum())
        yield name, whole, settings, lambda a=layers, b=finest: proximity.winding_loss(a, COPPER, resolution=b)
    for name, tracks in BENT.items():
        settings = {
            "3 %": lambda tracks=tracks: bent_winding_loss(tracks, COPPER, ModeSet(4, 1, (4, 2)), 4, 16, half=True),
            "1 %": lambda tracks=tracks: bent_winding_loss(tracks, COPPER, ModeSet(6, 2, (6, 3)), 8, 27),
        }
        lines = [PolylineTrack(np.vstack([t.starts, t.ends[-1:]]), t.width, t.thickness, t.z) for t in tracks]
        whole = sum(track_mutual_inductance(a, b) for a in lines for b in lines)
        yield (name, whole, settings,
               lambda tracks=tracks: bent_winding_loss(tracks, COPPER, ModeSet(9, 3, (10, 3)), 12, 40))  # fmt: skip


def timed(solve: Callable[[], ProximityLoss], runs: int) -> tuple[ProximityLoss, float, float]:
    """Result, best time (s) and the middle one over the best."""
    spent = []
    for _ in range(runs):
        begin = time.process_time()
        found = solve()
        spent.append(time.process_time() - begin)
    return found, min(spent), sorted(spent)[len(spent) // 2] / min(spent)


def peak(solve: Callable[[], ProximityLoss]) -> int:
    """Most bytes that a run holds at a time."""
    tracemalloc.start()
    solve()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def errors(loss: ProximityLoss, exact: ProximityLoss, inductance: float) -> tuple[float, float]:
    """Largest relative errors of R and of L over the frequencies."""
    of_r = max(abs(loss.resistance_ratio(f) / exact.resistance_ratio(f) - 1.0) for f in FREQUENCIES)
    of_l = max(abs(loss.inductance_change(f) - exact.inductance_change(f)) for f in FREQUENCIES)
    return of_r, of_l / inductance


def measure(runs: int = 7) -> list[dict[str, str | float]]:
    """A row for every design and setting."""
    rows: list[dict[str, str | float]] = []
    for design, inductance, settings, finest in solvers():
        exact, longest, _ = timed(finest, 1)
        for setting, solve in settings.items():
            solve()
            loss, best, spread = timed(solve, runs)
            of_r, of_l = errors(loss, exact, inductance)
            rows.append({
                "design": design, "setting": setting, "time_ms": 1e3 * best, "spread": spread,
                "memory_MB": peak(solve) / 1e6, "error_R": of_r, "error_L": of_l, "finest_s": longest,
                "R_10MHz_over_R_dc": exact.resistance_ratio(10e6),
            })  # fmt: skip
    return rows


def growth() -> list[tuple[int, float]]:
    """Turns of two layers and the time of the default (s)."""
    found = []
    for turns in (5, 10, 20, 40, 80):
        layers = coil((2 + 0.4 * turns) * MM, turns, 100 * UM, 80 * UM, (0.0, -60 * UM), (18 * UM, 18 * UM))
        found.append((turns, timed(lambda layers=layers: proximity.winding_loss(layers, COPPER), 3)[1]))
    return found


def plot(rows: list[dict[str, str | float]], path: Path) -> None:
    """Time against error, one point for every design and setting."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True)
    for axis, key, bounds in zip(axes, ("error_R", "error_L"), ((0.03, 0.01), (0.003, 0.001)), strict=True):
        for setting, marker in (("3 %", "o"), ("1 %", "s")):
            chosen = [row for row in rows if row["setting"] == setting]
            times, values = [row["time_ms"] for row in chosen], [row[key] for row in chosen]
            axis.loglog(times, values, marker, label=f"tolerance {setting}")
        for bound in bounds:
            axis.axhline(bound, linewidth=0.8, color="grey")
        axis.set_xlabel("processor time (ms)")
        axis.set_ylabel(f"error of {key[-1]}, 10 kHz to 10 MHz")
        axis.grid(True, which="both", alpha=0.2)
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    """Measure, print, write."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.gettempdir())
    folder.mkdir(parents=True, exist_ok=True)
    rows = measure()
    print(f"{'design':22}{'setting':>8}{'time':>9}{'noise':>7}{'memory':>9}{'R':>8}{'L':>9}   R(10 MHz)/R(0)")
    for row in rows:
        print(f"{row['design']:22}{row['setting']:>8}{row['time_ms']:7.1f}ms{row['spread']:7.2f}"
              f"{row['memory_MB']:7.1f}MB{100 * row['error_R']:7.2f}%{100 * row['error_L']:8.3f}%"
              f"{row['R_10MHz_over_R_dc']:10.3f}")  # fmt: skip
    times = growth()
    print("turns of two layers, default:", ", ".join(f"{turns}: {1e3 * spent:.0f} ms" for turns, spent in times))
    exponent = math.log(times[-1][1] / times[-3][1]) / math.log(times[-1][0] / times[-3][0])
    print(f"growth with turns from {times[-3][0]} on: N^{exponent:.1f}")
    with (folder / "alternating_current.csv").open("w", encoding="utf-8", newline="") as out:
        writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    plot(rows, folder / "alternating_current.svg")
    print("written:", folder / "alternating_current.csv", folder / "alternating_current.svg")


if __name__ == "__main__":
    main()
