"""The tables of figures, each row with its source; and the one function that reads them."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent

Row = dict[str, str]


def rows(name: str) -> tuple[Row, ...]:
    """The rows of a table by its name (a path below this folder, without `.csv`); lines that begin with # are remarks.

    Raises FileNotFoundError where there is no such table.
    """
    with (FOLDER / f"{name}.csv").open(encoding="utf-8", newline="") as lines:
        return tuple(csv.DictReader(line for line in lines if not line.startswith("#")))


def json_file(name: str) -> dict[str, Any]:
    """The document of a JSON file by its name (a path below this folder, without `.json`)."""
    import json  # most commands read none

    document: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return document
