"""All benchmarks with one command: cost against error of every method, memory, growth, and the machine's noise.

    python tests/benchmarks/run.py [-o DIR] [--quick]

writes into DIR (the working directory by default): `benchmarks.md` (tables), `methods.csv` (every method on every
design), `growth.csv`, and `pareto.svg` and `.png` (time against error, and time against turns). Times are those of the
processor, one thread, warm, the best of a few runs. It never fails on time: it says how noisy the machine is.
"""

from __future__ import annotations

import argparse
import csv
import os
import statistics
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
YARDSTICKS = ("", "electromagnetics", "validation")
sys.path[:0] = [str(HERE), *(str(HERE.parent / name) for name in YARDSTICKS), str(HERE.parents[1])]

import alternating_current  # noqa: E402
import flex_board  # noqa: E402
import inductance  # noqa: E402
from measure import Growth, Measured, noise  # noqa: E402

MARKERS = {inductance.WINDING: "o", inductance.MUTUAL: "s", alternating_current.RESISTANCE: "^",
           alternating_current.INDUCTANCE: "v"}

LEAST_ERROR = 1e-8
"""Errors are drawn no lower than this: the references are no better."""


def summary(rows: Sequence[Measured]) -> list[str]:
    """A Markdown table: one line for every quantity and method."""
    lines = ["| quantity | method | designs | error: median | largest | bound over error: median | time: median | "
             "largest | memory: median | largest |", "|---|---|---|---|---|---|---|---|---|---|"]
    for (quantity, method), group in grouped(rows).items():
        errors, times, memory = ([getattr(row, name) for row in group] for name in
                                 ("error", "milliseconds", "megabytes"))
        ratio = statistics.median(row.bound / max(row.error, LEAST_ERROR) for row in group)
        lines.append(
            f"| {quantity} | {method} | {len(group)} | {statistics.median(errors):.1e} | {max(errors):.1e} | "
            f"{ratio:.1f} | {statistics.median(times):.3g} ms | {max(times):.3g} ms | "
            f"{statistics.median(memory):.2g} MB | {max(memory):.2g} MB |"
        )
    return lines


def grouped(rows: Sequence[Measured]) -> dict[tuple[str, str], list[Measured]]:
    """Rows by quantity and method, in their order."""
    result: dict[tuple[str, str], list[Measured]] = {}
    for row in rows:
        result.setdefault((row.quantity, row.method), []).append(row)
    return result


def growth_table(rows: Sequence[Growth]) -> list[str]:
    """A Markdown table: times over the numbers, exponent and name of the growth."""
    lines = ["| work | over | time | exponent | nearest | most memory |", "|---|---|---|---|---|---|"]
    for row in rows:
        times = ", ".join(f"{n:g}: {t:.3g} ms" for n, t in zip(row.numbers, row.milliseconds, strict=True))
        lines.append(f"| {row.what} | {row.over} | {times} | {row.exponent:.1f} | {row.name} | "
                     f"{max(row.megabytes):.2g} MB |")
    return lines


def plot(rows: Sequence[Measured], growths: Sequence[Growth], path: Path) -> None:
    """Time against error of every method on every design, medians named; and time against turns."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "sitscad"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(16, 10), layout="constrained")
    _draw_methods(axes[0], rows)
    _draw_growth(axes[1], [row for row in growths if row.over == "turns"])
    for axis in axes:
        axis.grid(True, which="major", alpha=0.3)
        axis.legend(fontsize=8, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.08))
    figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
    figure.savefig(path.with_suffix(".png"), dpi=100)
    plt.close(figure)


def _draw_methods(axis, rows: Sequence[Measured]) -> None:
    medians = []
    for index, ((quantity, method), group) in enumerate(grouped(rows).items()):
        times = [row.milliseconds for row in group]
        errors = [max(row.error, LEAST_ERROR) for row in group]
        where = statistics.median(times), statistics.median(errors)
        colour, marker = f"C{index % 10}", MARKERS[quantity]
        axis.loglog(times, errors, marker, color=colour, alpha=0.3, markersize=3, markeredgewidth=0.0)
        axis.loglog(*where, marker, color=colour, markeredgecolor="black", markersize=10, label=f"{quantity}: {method}")
        if quantity == inductance.WINDING:
            medians.append(where)
    front = [item for item in sorted(medians) if all(other[1] >= item[1] for other in medians if other[0] < item[0])]
    axis.loglog(*zip(*front, strict=True), "--", color="black", linewidth=1, label="front of a coil's inductance")
    axis.set(
        xlabel="processor time, ms", ylabel="relative error", title="every method: designs (small), medians (large)"
    )


def _draw_growth(axis, rows: Sequence[Growth]) -> None:
    for index, row in enumerate(rows):
        axis.loglog(row.numbers, row.milliseconds, marker=".", color=f"C{index % 10}",
                    linestyle=("-", "--", ":")[index // 10 % 3], label=f"{row.what}: {row.name}")
    axis.set(xlabel="turns of each of two layers", ylabel="processor time, ms", title="growth with turns")


def write(folder: Path, rows: Sequence[Measured], growths: Sequence[Growth],
          board: list[tuple[str, float, float]]) -> None:
    """Tables and plot into the folder."""
    middle, worst = noise()
    spread = statistics.median(row.spread for row in rows)
    text = [
        "# Benchmarks", "", f"Noise: the same work repeated takes {middle:.2f} times its best in the middle run and "
        f"{worst:.2f} times in the worst; the methods' own middle runs take {spread:.2f} times their best.", "",
        "## Cost and error of every method", "", *summary(rows), "",
        "Errors of a coil's inductance and of mutual inductances are those against the volume integral; errors at "
        "frequency against the finest setting of the same solver.", "",
        "## Growth", "", *growth_table(growths), "", "## The four-coil template", "", "| step | time | noise |",
        "|---|---|---|", *(f"| {name} | {ms:.3g} ms | {noisy:.2f} |" for name, ms, noisy in board), "",
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "benchmarks.md").write_text("\n".join(text), encoding="utf-8")
    print("\n".join(text))
    for name, table in (("methods.csv", [asdict(row) for row in rows]), ("growth.csv", list(_lines(growths)))):
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(table)
    plot(rows, growths, folder / "pareto")


def _lines(growths: Sequence[Growth]):
    for row in growths:
        for number, ms, memory in zip(row.numbers, row.milliseconds, row.megabytes, strict=True):
            yield {"work": row.what, "over": row.over, "number": number, "milliseconds": ms, "megabytes": memory,
                   "exponent": row.exponent, "nearest": row.name}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure everything, print it, write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("."))
    parser.add_argument("--quick", action="store_true", help="fewer designs and smaller numbers: under a minute")
    chosen = parser.parse_args(arguments)
    if chosen.quick:
        rows = [*inductance.measured(1), *alternating_current.measured(1)]
        growths = [*inductance.grown((6.0, 12.0, 24.0), (1, 2)), *alternating_current.grown((6, 12), (1, 2)),
                   *flex_board.grown((4, 8), ((1, 1), (2, 1)), (1, 2))]
    else:
        rows = [*inductance.measured(6), *alternating_current.measured()]
        growths = [*inductance.grown(), *alternating_current.grown(), *flex_board.grown()]
    write(chosen.output, rows, growths, flex_board.template())


if __name__ == "__main__":
    main()
