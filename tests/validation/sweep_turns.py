"""How smooth a board's estimate is over its coils' turns: the largest steps of inductance and loss in a fine sweep.

    python tests/validation/sweep_turns.py [--steps 500] [--first 2] [--last 26] [--shape circle] [-o steps.csv]

lays out and estimates a board of two coils of 12 mm for so many numbers of turns, and prints the largest relative
change from one step to the next of: the winding's inductance, the inductance at the contacts, the parallel resistance
at rest; each beyond what a straight line through the neighbours says, and where. What is left of the contacts' steps is
the lead's way round the coil, which goes by whole turns.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[2])]

import sitscad  # noqa: E402

QUANTITIES = ("winding inductance", "inductance at the contacts", "parallel resistance at rest")


def spec_of(turns: float, shape: str) -> sitscad.SensorSpec:
    """Two coils in a line under a copper target, on a tail of 30 mm."""
    return sitscad.load_text(json.dumps({
        "sitscad": 1, "name": "sweep", "array": {"pattern": "line", "count": 2, "pitch": 12.5},
        "coil": {"shape": shape, "outer_diameter": 12, "turns": turns, "layers": 2, "trace_width": "100 um",
                 "trace_spacing": "100 um"},
        "fpc": {"tail": {"length": 30, "connector": "zif-0.5mm"}},
        "target": {"shape": "rectangle", "size": [24, 12], "thickness": 0.2, "material": "copper"},
        "elastomer": {"material": "ecoflex-00-30", "shape": "rectangle", "size": [24, 12], "thickness": 2},
        "requirements": {"normal_force": "3 N"}, "readout": {"capacitance": "100 pF"},
    }))


def estimated(turns: float, shape: str) -> tuple[float, ...] | None:
    """The quantities (H, H, ohm) of the second coil; None for a board that cannot be laid out."""
    try:
        coil = sitscad.estimate(sitscad.lay_out(spec_of(turns, shape))).coils[1]
    except sitscad.SpecError:
        return None
    rest = coil.states["rest"]
    return coil.winding_inductance, coil.terminal_inductance, rest.parallel_resistance


def jumps(values: np.ndarray) -> np.ndarray:
    """Relative change of every step beyond the mean of those before and after it (n - 3; n values)."""
    steps = np.diff(np.log(values))
    return steps[1:-1] - 0.5 * (steps[:-2] + steps[2:])


def main() -> None:
    """Sweep, and print the largest steps."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--first", type=float, default=2.0)
    parser.add_argument("--last", type=float, default=26.0)
    parser.add_argument("--shape", default="circle")
    parser.add_argument("-o", "--output", type=Path, help="a CSV file with every step")
    chosen = parser.parse_args()
    rows = []
    for turns in np.round(np.linspace(chosen.first, chosen.last, chosen.steps), 6):
        result = estimated(float(turns), chosen.shape)
        if result is not None:
            rows.append((float(turns), *result))
    table = np.array(rows)
    print(f"{len(table)} of {chosen.steps} boards of two coils, {chosen.first:g} to {chosen.last:g} turns")
    for k, name in enumerate(QUANTITIES, start=1):
        size = np.abs(jumps(table[:, k]))
        worst = int(np.argmax(size))
        print(f"{name}: largest jump {100 * size[worst]:.2f} % at {table[worst + 1, 0]:.3f} turns; "
              f"{np.count_nonzero(size > 0.01)} over 1 %, {np.count_nonzero(size > 0.02)} over 2 %, "
              f"median {100 * np.median(size):.3f} %")
    if chosen.output:
        with chosen.output.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["turns", *QUANTITIES])
            writer.writerows(rows)


if __name__ == "__main__":
    main()
