"""What the stated errors rest on, in figures: prints a table, writes docs/accuracy.csv and puts it in accuracy.md.

    python tests/validation/accuracy.py [--only NAME]

Every row is one comparison: how many designs, the middle and the largest error, how much of its stated bound the worst
of them takes (above 1 the bound is broken) and how many times the error the middle bound is. Errors are relative. With
`--only` the other rows are kept as they are in the file.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "electromagnetics"), str(HERE)]

import designs  # noqa: E402
import published_coils  # noqa: E402
import resistance_designs  # noqa: E402
import test_coil_pairs  # noqa: E402
import test_random_designs  # noqa: E402
import test_resistance_designs  # noqa: E402

TABLE = HERE.parents[1] / "docs" / "accuracy.csv"
COLUMNS = ("comparison", "designs", "median_error", "largest_error", "worst_of_bound", "median_bound_over_error")
Pairs = Iterable[tuple[float, float]]


def winding(family: str, large: bool = False) -> Pairs:
    """Error and bound of the method that is taken where nobody asks for another: the most accurate of the shape."""
    first = "strands" if family not in ("circle",) else "spiral-neumann"
    rows = test_random_designs.compared(test_random_designs.of_family(family, "large" if large else "small"))
    return [(error, bound) for name, error, bound, _ in rows if name == first]


def pairs() -> Pairs:
    """The mutual inductance of coils side by side, over the pairs of all families."""
    rows = [row for family in designs.FAMILIES for row in test_coil_pairs.of_family(family)]
    return [(error / exact, bound / exact) for error, bound, exact in test_coil_pairs.compared(rows)]


def measured() -> Pairs:
    """Measured coils; no bound is stated against a measurement."""
    cases = published_coils.MEASURED
    result = [(published_coils.inductance(case), case["L_uH"] * 1e-6) for case in cases]
    return [(abs(ours / theirs - 1.0), float("nan")) for ours, theirs in result]


def resistance(family: str) -> Pairs:
    """Resistance at 10 MHz of random designs, those that no fit saw among them."""
    rows = [row for unseen in (False, True) for row in test_resistance_designs.compared([family], unseen=unseen)]
    return [(error, bound) for _, _, frequency, error, bound in rows if frequency > 5e6]


COMPARISONS: dict[str, Callable[[], Pairs]] = {
    **{f"winding inductance, {f}": lambda f=f: winding(f) for f in designs.FAMILIES},
    **{f"winding inductance, {f}, large": lambda f=f: winding(f, True) for f in designs.FAMILIES},
    "coils side by side": pairs,
    "measured coils": measured,
    **{f"resistance at 10 MHz, {f}": lambda f=f: resistance(f) for f in resistance_designs.FAMILIES},
}


def row(name: str, found: Pairs) -> list[str]:
    """One line of the table."""
    error, bound = np.array(list(found)).T
    stated = np.isfinite(bound)
    worst = f"{float(np.max(error[stated] / bound[stated])):.2f}" if stated.any() else ""
    slack = f"{float(np.median(bound[stated] / np.maximum(error[stated], 2e-7))):.2g}" if stated.any() else ""
    return [name, str(error.size), f"{np.median(error):.1e}", f"{error.max():.1e}", worst, slack]


def read() -> dict[str, list[str]]:
    """The lines of the file by comparison."""
    if not TABLE.exists():
        return {}
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {line[0]: line for line in list(csv.reader(file))[1:]}


HEAD = "| comparison | designs | median error | largest error | worst of bound | median of bound over error |"
BEGINS, ENDS = "<!-- accuracy.csv begins -->\n", "<!-- accuracy.csv ends -->"


def markdown() -> str:
    """The file's lines as a table."""
    lines = [HEAD, "|---|---|---|---|---|---|"]
    return "\n".join([*lines, *("| " + " | ".join(cell or "-" for cell in line) + " |" for line in read().values())])


def put_into(page: Path) -> None:
    """Puts the table where the page has room for it."""
    before, rest = page.read_text(encoding="utf-8").split(BEGINS)
    after = rest.split(ENDS)[1]
    page.write_text(f"{before}{BEGINS}{markdown()}\n{ENDS}{after}", encoding="utf-8")


def main(only: str) -> None:
    """Computes what was asked for, prints all and writes it."""
    known = read()
    lines = []
    for name, compare in COMPARISONS.items():
        line = row(name, compare()) if only in name or name not in known else known[name]
        print("  ".join(line), flush=True)
        lines.append(line)
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *lines])
    put_into(TABLE.with_suffix(".md"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="compute again only comparisons whose name has this in it")
    main(parser.parse_args().only)
