"""The names of the installed profiles, and where they are."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

DATA = Path(__file__).parents[2] / "data"

FOLDERS = {
    "stackup": "stackups", "rules": "fabricators", "connector": "connectors", "jaw": "jaws",
    "hole pattern": "hole_patterns",
}  # fmt: skip
TABLES = {
    "conductor": "conductors", "dielectric": "dielectrics", "elastomer": "elastomers", "chip": "chips",
    "converter": "converters", "adhesive": "adhesives",
}  # fmt: skip


@cache
def names(kind: str) -> tuple[str, ...]:
    """The presets of a kind, sorted: stackup, rules, connector, jaw, hole pattern, material kinds, chip, converter and
    file naming.
    """
    if kind == "file naming":
        return tuple(sorted({row["naming"] for row in read_table(DATA / "archive_names.csv")}))
    if kind in FOLDERS:
        ending = ".yaml" if kind == "rules" else ".csv"
        return tuple(sorted(path.stem for path in (DATA / FOLDERS[kind]).glob(f"*{ending}")))
    return tuple(sorted(row["name"] for row in read_table(DATA / f"{TABLES[kind]}.csv")))


def read_table(path: Path) -> tuple[dict[str, str], ...]:
    """The rows of a table, each by its columns' names."""
    with path.open(encoding="utf-8", newline="") as stream:
        return tuple(csv.DictReader(stream))
