"""Limits that nobody publishes and that sitscad therefore sets itself, each with its reason (`data/own_limits.csv`)."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

from sitscad.record import record

DATA = Path(__file__).resolve().parents[1] / "data"


@record
class OwnLimit:
    """One limit: its value in SI units (relative ones as shares), and the reason for it."""

    value: float
    source: str


@cache
def own_limits() -> dict[str, OwnLimit]:
    """Every limit by its name."""
    with (DATA / "own_limits.csv").open(encoding="utf-8", newline="") as rows:
        return {row["name"]: OwnLimit(float(row["value"]), row["source"]) for row in csv.DictReader(rows)}
