"""What the whole estimate costs by shape, against the round coil of equal turns and layers, and what it is good to.

    python tests/benchmarks/shapes.py [--quick]

prints one line a shape and size: processor time, over the round coil's; the stated error of the inductance; how far the
resistance at the sensor's frequency is from that of a tighter tolerance, and the stated error of that. Coils over a
target, in front of a shield and a jaw plate, every shape as large as its turns ask for.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from measure import peak, timed  # noqa: E402

import sitscad  # noqa: E402
from sitscad.estimates.circuits import solved_winding as solved  # noqa: E402
from sitscad.estimates.windings import losses  # noqa: E402
from sitscad.kernels.electromagnetics.loss import proximity  # noqa: E402

ROUNDED = 0.3
SHAPES = (("circle", 0.0), ("square", 0.0), ("rectangle", 0.0), ("hexagon", 0.0), ("octagon", 0.0), ("racetrack", 0.0),
          ("square", ROUNDED), ("rectangle", ROUNDED), ("hexagon", ROUNDED), ("octagon", ROUNDED))
SIZES = ((5, 2), (10, 2), (20, 2), (10, 4), (20, 4), (30, 8))
"""Turns a layer, layers."""

QUICK = ((4, 2),)
FINE = 1e-3
"""Tolerance of the estimate that tells the error of the usual one."""


@dataclass(frozen=True)
class Cost:
    """One shape at one size: time (ms) and that over the round coil's, memory (MB; 0 where not asked for), errors."""

    shape: str
    turns: int
    layers: int
    milliseconds: float
    over_round: float
    megabytes: float
    inductance_error: float
    resistance_difference: float
    resistance_error: float


def spec_of(shape: str, radius: float, turns: int, layers: int) -> sitscad.SensorSpec:
    """A coil of 0.1 mm tracks and gaps between a target and a shielded plate."""
    across = 0.4 * turns + 3.0
    size = [round(1.6 * across, 3), across] if shape in ("rectangle", "racetrack") else across
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": layers, "trace_width": 0.1,
            "trace_spacing": 0.1} | ({"corner_radius": radius} if radius else {})
    document = {
        "sitscad": 1, "name": "cost", "coil": coil, "requirements": {"normal_force": "3 N"},
        "target": {"material": "copper", "shape": "square", "size": round(0.9 * across, 3), "thickness": 0.2},
        "elastomer": {"material": "ecoflex-00-30", "thickness": 2},
        "shield": {"material": "copper", "thickness": 0.1, "gap": 0.6},
        "mount": {"kind": "bench-plate", "standoff": 1.0},
    }
    return sitscad.load_text(json.dumps(document))


def afresh(layout: sitscad.Layout) -> object:
    """The estimate of a layout, nothing of which was worked out before."""
    for module in (solved, losses, proximity):
        for known in vars(module).values():
            getattr(known, "cache_clear", lambda: None)()
    return sitscad.estimate(layout)


def costs(sizes: Sequence[tuple[int, int]] = SIZES, memory: bool = False,
          shapes: Sequence[tuple[str, float]] = SHAPES) -> Iterator[Cost]:
    """All shapes at every size, the first of them the round one."""
    for turns, layers in sizes:
        first = 0.0
        for shape, radius in shapes:
            layout = sitscad.lay_out(spec_of(shape, radius, turns, layers))
            work = partial(afresh, layout)
            spent, _ = timed(work)
            first = first or spent
            usual, fine = sitscad.estimate(layout).coils[0], sitscad.estimate(layout, tolerance=FINE).coils[0]
            yield Cost(
                f"{shape}{', rounded' if radius else ''}", turns, layers, spent, spent / first,
                peak(work) if memory else 0.0, usual.inductance_error,
                abs(usual.resistance_ac / fine.resistance_ac - 1.0), usual.resistance_error,
            )


def table(rows: Sequence[Cost]) -> list[str]:
    """A Markdown table of them."""
    lines = ["| shape | turns, layers | estimate | over round | most memory | L: stated error | R: from the fine one | "
             "R: stated error |", "|---|---|---|---|---|---|---|---|"]
    for row in rows:
        held = f"{row.megabytes:.0f} MB" if row.megabytes else ""
        lines.append(
            f"| {row.shape} | {row.turns}, {row.layers} | {row.milliseconds:.0f} ms | {row.over_round:.1f} | {held} | "
            f"{row.inductance_error:.1e} | {row.resistance_difference:.1e} | {row.resistance_error:.1e} |"
        )
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one small size")
    parser.add_argument("--memory", action="store_true", help="the most memory held at a time, too: five times as long")
    chosen = parser.parse_args(arguments)
    print("\n".join(table(list(costs(QUICK if chosen.quick else SIZES, chosen.memory)))))


if __name__ == "__main__":
    main()
