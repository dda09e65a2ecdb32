"""Responses as text for users, as JSON and CSV for programs, and as arrays for numpy."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.quantities import RESPONSE
from sitscad.basics.units import DASH, csv_text, escape_controls, number_cell, show
from sitscad.basics.version import __version__
from sitscad.checks.findings import styled, to_json
from sitscad.estimates.response.response_arrays import POSE_NAMES
from sitscad.files.report.numbers import aligned_table, performance_blocks

if TYPE_CHECKING:
    from sitscad.estimates.performance.tables import PerformanceReport
    from sitscad.estimates.response.response_arrays import Response

SHOWN = 60  # Largest number of points in the text


def response_text(
    path: str, response: Response, colour: bool = False, performance: PerformanceReport | None = None
) -> str:
    """Return a table with one row per coil and point, the gap at rest, and the notes."""
    lines = aligned_table(*response_rows(response))
    if len(response) > SHOWN:
        lines.append(f"... and {len(response) - SHOWN} more: -o FILE writes them all (.npz, .csv or .json)")
    gap = f"gap at rest: {show(response.gap, 'm', 4)} from the board's top face to the target's near face"
    glue = f", {show(response.glue, 'm', 3)} of it glue" if response.glue else ""
    blocks = [styled(escape_controls(path), "bold", colour), "\n".join(lines),
              "\n".join([gap + glue, *_distinct_notes(response)])]
    blocks += performance_blocks(performance, colour)
    return "\n\n".join(block for block in blocks if block) + "\n"


def response_rows(response: Response) -> tuple[list[str], list[list[str]]]:
    """Return the head and the rows of the table, for the first `SHOWN` points."""
    cases = ["case"] if any(response.cases) else []
    head = [*cases, "x, y, z (mm)", "rx, ry, rz (deg)", "force (N)", "coil", *(each.label for each in COLUMNS)]
    return head, [row for k in range(min(len(response), SHOWN)) for row in _point_rows(response, k)]


COLUMNS = [each for each in RESPONSE if each.label]
"""Quantities of a coil that are columns of the text table."""


def _point_rows(response: Response, k: int) -> Iterator[list[str]]:
    """Yield the rows of point `k`, one per coil; only the first row has case, pose and force."""
    x, y, z, rx, ry, rz = response.poses[k]
    place = ", ".join(_number_text(1e3 * value) for value in (x, y, z))
    rotation = ", ".join(_number_text(math.degrees(value)) for value in (rx, ry, rz))
    force = DASH
    if response.force is not None and np.all(np.isfinite(response.force[k])):
        force = ", ".join(_number_text(value) for value in response.force[k])
    point = [*([response.cases[k]] if any(response.cases) else []), place, rotation, force]
    for c, name in enumerate(response.coils):
        yield [*(point if c == 0 else [""] * len(point)), name,
               *(each.shown(_coil_value(each.value(response)[k], c)) for each in COLUMNS)]


def _coil_value(values: Array, coil: int) -> float:
    """Return the value of a coil. If the values are a matrix of coils, return its element on the diagonal."""
    return float(values[coil] if values.ndim == 1 else values[coil, coil])


def _number_text(value: float) -> str:
    """Return a number as text with four digits. Values below 5e-10, which solvers leave, become 0."""
    return f"{round(float(value), 9) + 0.0:.4g}"


def _distinct_notes(response: Response) -> Iterator[str]:
    """Yield the notes of all points, each note once."""
    numbers: dict[str, int] = {}
    for remarks in response.notes:
        for note in remarks:
            numbers[note] = numbers.get(note, 0) + 1
    for note, count in list(numbers.items())[:8]:
        yield f"note: {note}" + (f" ({count} points)" if count > 1 else "")
    if len(numbers) > 8:
        yield f"note: and {len(numbers) - 8} more kinds of notes: --format json has them by point"


def response_json(
    path: str, response: Response, colour: bool = False, performance: PerformanceReport | None = None
) -> str:
    """Return the JSON document of the contract, with ``performance`` if requested."""
    points = [response.point_document(k) for k in range(len(response))]
    gap = {"gap_at_rest_m": response.gap, "glue_in_gap_m": response.glue}
    document = {"sitscad": __version__, "spec": path, "coils": list(response.coils), **gap, "points": points}
    optional = {} if performance is None else {"performance": performance.documents()}
    return to_json(document | optional)


def response_csv(
    path: str, response: Response, colour: bool = False, performance: PerformanceReport | None = None
) -> str:
    """Return one row per point, with columns named like ``inductance_H.C1``."""
    coils = response.coils
    columns: dict[str, Array] = {}
    for name, value in response.arrays().items():
        if name == "pose":
            columns |= {column: value[:, k] for k, column in enumerate(POSE_NAMES)}
        elif value.ndim == 1:
            columns[name] = value
        elif name in ("force_N", "moment_Nm"):
            columns |= {f"{name}.{axis}": value[:, k] for k, axis in enumerate(AXES)}
        elif value.ndim == 2:
            columns |= {f"{name}.{coil}": value[:, k] for k, coil in enumerate(coils)}
        else:
            columns |= {f"{name}.{a}.{b}": value[:, i, j] for i, a in enumerate(coils) for j, b in enumerate(coils)}
    named = any(response.cases)
    rows = [[*(["case"] if named else []), *columns, "notes"]]
    for k in range(len(response)):
        case = [response.cases[k]] if named else []
        rows.append([*case, *(number_cell(values[k]) for values in columns.values()), "; ".join(response.notes[k])])
    return csv_text(rows)


AXES = ("x", "y", "z")

Shown = Callable[["str", "Response", bool, "PerformanceReport | None"], str]

RESPONSE_FORMATS: Mapping[str, Shown] = {"text": response_text, "json": response_json, "csv": response_csv}
"""Output formats of ``response``.

Each function takes the path as typed, the response, whether to use colour, and the performance (not used by csv).
"""

RESPONSE_FILES = (".npz", ".csv", ".json")  # Endings of output files


def response_file(path: str, response: Response, ending: str, performance: PerformanceReport | None = None) -> bytes:
    """Return the content of a file with one of these endings; `path` is the spec's."""
    if ending == ".npz":
        # Arrays with the contract's names, points first, and the coils' names; equal bytes in every run
        stream = io.BytesIO()
        np.savez(stream, coils=np.array(response.coils), **response.arrays())  # type: ignore[arg-type]
        return stream.getvalue()
    return RESPONSE_FORMATS[ending.removeprefix(".")](path, response, False, performance).encode("utf-8")
