"""The tables of figures, each row with its source; the one function that reads them, and how a source is cited."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
PACKAGE = FOLDER.parent
"""The folder of the tables, and that of all of sitscad."""

Row = dict[str, str]


class DataError(ValueError):
    """A table of figures that does not hold what it has to: which, and what of it, in words."""


def rows(name: str) -> tuple[Row, ...]:
    """The rows of a table by its name (a path below this folder, without `.csv`); lines that begin with # are remarks.

    Raises FileNotFoundError where there is no such table.
    """
    with (FOLDER / f"{name}.csv").open(encoding="utf-8", newline="") as lines:
        return tuple(csv.DictReader(line for line in lines if not line.startswith("#")))


UNVERIFIED = "unverified: "
"""How the source of a figure begins that nobody has seen in the place that it names."""


def cited(row: Mapping[str, str]) -> str:
    """A row's source as texts carry it on: marked where its status is not `verified`."""
    return row["source"] if row["status"] == "verified" else UNVERIFIED + row["source"]


def cited_by_field(table: Mapping[str, Mapping[str, str]]) -> str:
    """The sources of rows by the figures' names, in one text."""
    return "; ".join(f"{field}: {cited(row)}" for field, row in table.items())


def is_unverified(source: str, *fields: str) -> bool:
    """Whether a figure's source was not seen; of a text of several, any of them, or of those for some `fields`."""
    if fields:
        return any(f"{field}: {UNVERIFIED}" in source for field in fields)
    return source.startswith(UNVERIFIED) or f": {UNVERIFIED}" in source


def json_file(name: str) -> dict[str, Any]:
    """The document of a JSON file by its name (a path below this folder, without `.json`)."""
    import json  # most commands read none

    document: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return document
