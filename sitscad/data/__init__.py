"""Tables of figures, each row with its source, and functions that read and cite them."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
PACKAGE = FOLDER.parent
"""Folder of the tables (`FOLDER`), and folder of the package sitscad."""

Row = dict[str, str]


class DataError(ValueError):
    """Error in a table of figures. The text names the table and the flaw."""


def rows(name: str) -> tuple[Row, ...]:
    """Return the rows of a table by its name (a path below this folder, without `.csv`).

    Lines that begin with # are comments. Raises FileNotFoundError if there is no such table.
    """
    with (FOLDER / f"{name}.csv").open(encoding="utf-8", newline="") as lines:
        return tuple(csv.DictReader(line for line in lines if not line.startswith("#")))


UNVERIFIED = "unverified: "
"""Prefix of a source that nobody has seen in the place that it names."""


def cited(row: Mapping[str, str]) -> str:
    """Return a row's source for texts. It is marked unless the row's status is `verified`."""
    return row["source"] if row["status"] == "verified" else UNVERIFIED + row["source"]


def cited_by_field(table: Mapping[str, Mapping[str, str]]) -> str:
    """Return the sources of rows, with the names of their figures, as a single text."""
    return "; ".join(f"{field}: {cited(row)}" for field, row in table.items())


def is_unverified(source: str, *fields: str) -> bool:
    """Return whether a source was not read by the project: it begins with "unverified: ".

    In a text of several sources, any such source counts. With `fields`, only the sources of these fields count.
    """
    if fields:
        return any(f"{field}: {UNVERIFIED}" in source for field in fields)
    return source.startswith(UNVERIFIED) or f": {UNVERIFIED}" in source


def json_file(name: str) -> dict[str, Any]:
    """Return the content of a JSON file by its name (a path below this folder, without `.json`)."""
    document: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return document
