"""Limits that nobody publishes and that sitscad therefore sets itself, each with its reason (`data/own_limits.csv`)."""

from __future__ import annotations

from functools import cache

from sitscad.data import rows
from sitscad.record import record


@record
class OwnLimit:
    """One limit: its value in SI units (relative ones as shares), and the reason for it."""

    value: float
    source: str


@cache
def own_limits() -> dict[str, OwnLimit]:
    """Every limit by its name."""
    return {row["name"]: OwnLimit(float(row["value"]), row["source"]) for row in rows("own_limits")}
