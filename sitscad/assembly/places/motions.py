"""Poses, loads and scans of a target, read from texts or from tables of numbers. Also frequencies."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.basics.units import UnitError, parse_quantity


class TableError(ValueError):
    """Raised for a file without a readable table. The text gives the reason, without the file's name."""


def table_text(path: str, most: int) -> str:
    """Return the text of a file with at most `most` bytes.

    Raises TableError for a larger file or text that is not UTF-8, and OSError if the file cannot be opened.
    """
    with Path(path).open("rb") as file:  # a device has no size and no end
        content = file.read(most + 1)
    if len(content) > most:
        raise TableError(f"is larger than {most // 1_000_000} MB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TableError("is not text in UTF-8") from error


Names = tuple[str, ...]

POSE: Names = ("x", "y", "z", "rx", "ry", "rz")
FORCE: Names = ("normal", "shear_x", "shear_y")
MOMENT: Names = ("moment_x", "moment_y")
LOAD: Names = (*FORCE, *MOMENT)

ROTATIONS = {"held": "kept level", "free": "free to tilt"}
"""Rotation settings of a loaded target, with texts for messages: kept level by a flat face, or free to tilt."""

USUAL_ROTATION = "free"  # Of a load that does not say. Data sheets, calibrations and load cases are of a level target
"""Rotation of the target for loads that do not state it. Data sheets and calibrations use a level target instead."""

BARE = {**dict.fromkeys(POSE[:3], 1e-3), **dict.fromkeys(POSE[3:], math.pi / 180.0), **dict.fromkeys(FORCE, 1.0),
        **dict.fromkeys(MOMENT, 1e-3)}
"""Units of numbers that are written without a unit, as SI values by quantity: mm, degree, N and N mm."""

IN_HEADERS = {
    "m": ("length", 1.0),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "rad": ("angle", 1.0),
    "deg": ("angle", math.pi / 180.0),
    "N": ("force", 1.0),
    "mN": ("force", 1e-3),
    "Nm": ("moment", 1.0),
    "Nmm": ("moment", 1e-3),
}
"""Units that may follow an underscore in a column name of a CSV file: (dimension, SI value)."""

READINGS = ("counts", "Hz", "kHz", "MHz", "H", "mH", "uH", "nH")
"""Endings of column names with measured readings, as in the plan of `calibrate` (``C1_counts``).

Such columns are skipped.
"""

MOST = 2_000_000  # Points at most in one scan
"""Largest number of points in one scan."""

MOST_FORCE = 1e4
TOO_MUCH = f"forces up to {MOST_FORCE / 1e3:g} kN can be asked for, as in a spec"
"""Message for forces above the largest accepted force."""

LARGEST = 64_000_000  # Bytes at most of a CSV file
"""Largest accepted size (bytes) of a CSV file."""


class MotionError(ValueError):
    """Raised for a pose, load or scan that cannot be read. The text gives the input and the accepted forms."""


@record(eq=False)
class Motions:
    """The requested poses and loads.

    `poses` (n, 6) has displacements (m) and rotations (rad). `loads` (k, 3) has forces (N), or (k, 5) forces and
    moments (N m). `held` (k) is True for loads that keep the target level. `cases` are names of load cases in the spec.
    `skipped_rows` has a text on the skipped reading columns of each file.
    """

    poses: Array
    loads: Array
    held: Flags
    cases: Names = ()
    skipped_rows: Names = ()

    def __len__(self) -> int:
        return len(self.poses) + len(self.loads) + len(self.cases)


def is_held(rotation: str) -> bool:
    """Whether a target with this rotation setting is kept level. Raises MotionError if it is not in `ROTATIONS`."""
    if rotation not in ROTATIONS:
        raise MotionError(f"rotation={rotation!r}: it is {' or '.join(ROTATIONS)}")
    return rotation == "held"


def dimension(name: str) -> str:
    """Return the dimension of the pose or load component `name`: length, angle, force or moment."""
    return "moment" if name in MOMENT else "force" if name in FORCE else "length" if name in POSE[:3] else "angle"


def frequency_of(text: str) -> float:
    """Return a frequency (Hz) from text like ``5MHz``. Raises MotionError outside 10 kHz to 100 MHz."""
    try:
        value = parse_quantity(text, "frequency")
    except UnitError as error:
        raise MotionError(f"frequency {text}: {error}" + (f"; {error.hint}" if error.hint else "")) from error
    if not LOWEST <= value <= HIGHEST:
        raise MotionError(f"frequency {text}: 10 kHz to 100 MHz are modelled")
    return value


LOWEST, HIGHEST = 1e4, 1e8  # Frequencies (Hz) between which the models of losses are meant
"""Lowest and highest frequency (Hz) for which the loss models are valid."""


def read_motions(
    poses: Iterable[str] = (), pose_files: Iterable[str] = (), loads: Iterable[str] = (),
    load_files: Iterable[str] = (), scans: Iterable[str] = (), cases: Iterable[str] = (),
) -> Motions:
    """Return the poses and loads in texts and files, poses first, scans and load cases last.

    Without any input, the result is the pose at rest. Raises MotionError for input that cannot be read, and OSError for
    a file that cannot be opened.
    """
    pose_rows, load_rows = [np.zeros((0, len(POSE)))], [np.zeros((0, len(LOAD)))]
    level_flags, readings, named = [np.zeros(0, dtype=bool)], list[str](), tuple(cases)
    for texts, names, rows in ((poses, POSE, pose_rows), (loads, LOAD, load_rows)):
        for text in texts:
            values, rotation = _parse_values(text, names, motion_number)
            rows.append(np.array([[values.get(name, 0.0) for name in names]]))
            if names == LOAD:
                level_flags.append(np.array([rotation]))
        for file in pose_files if names == POSE else load_files:
            points, turns, passed = _read_table_file(file, names)
            rows.append(points)
            readings += passed
            if names == LOAD:
                level_flags.append(turns)
    for text in scans:
        points, names, rotation = _scan_points(text)
        (pose_rows if names == POSE else load_rows).append(points)
        if names == LOAD:
            level_flags.append(np.full(len(points), rotation))
    if len(pose_rows) == 1 and len(load_rows) == 1 and not named:
        pose_rows = [np.zeros((1, len(POSE)))]
    forces = np.concatenate(load_rows)
    if np.any(forces[:, 0] < 0.0):
        raise MotionError(f"normal={forces[:, 0].min():g}: it presses towards the board, 0 or more; no pad is pulled")
    turned, level = np.any(forces[:, len(FORCE) :], axis=1), np.concatenate(level_flags)
    if np.any(turned & level):
        raise MotionError("a moment with rotation=held: a face that keeps the target level takes any moment")
    loads_found = forces if turned.any() else forces[:, : len(FORCE)]
    return Motions(np.concatenate(pose_rows), loads_found, level, named, tuple(readings))


def _parse_values(text: str, names: Names, read: Callable[[str, str], float]) -> tuple[dict[str, float], bool]:
    """Return the values of "name=value, ..." by name, and whether a loaded target is kept level.

    `read` converts a name and a value's text to a number. `names` are the permitted names.
    """
    values: dict[str, float] = {}
    rotation = USUAL_ROTATION
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if name == "rotation" and names == LOAD:
            rotation = "held" if is_held(value) else "free"
            continue
        if not equals or name not in names:
            raise MotionError(f"{part!r}: NAME=NUMBER is wanted, NAME one of {', '.join(names)}")
        if name in values:
            raise MotionError(f"{name} is given twice in {text!r}")
        values[name] = read(name, value)
    return values, rotation == "held"


def motion_number(name: str, text: str) -> float:
    """Return a value in SI units from text with or without a unit. Raises MotionError if it is not a number."""
    try:
        value = float(text) * BARE[name]
    except ValueError:
        try:
            value = parse_quantity(text, dimension(name))
        except UnitError as error:
            raise MotionError(f"{name}={text}: {error}" + (f"; {error.hint}" if error.hint else "")) from error
    if not math.isfinite(value):
        raise MotionError(f"{name}={text}: a finite number is wanted")
    if name in LOAD and abs(value) > MOST_FORCE:
        raise MotionError(f"{name}={text}: {TOO_MUCH}")
    return value


def _scan_points(text: str) -> tuple[Array, Names, bool]:
    """Return the points of a scan (n, names), the names of the columns, and whether the target is kept level."""
    first = text.split(",")[0].partition("=")[0].strip()
    names = LOAD if first in LOAD or first == "rotation" else POSE
    ranges: dict[str, Array] = {}

    def read(name: str, value: str) -> float:
        ranges[name] = _parse_range(name, value)
        return 0.0

    _, rotation = _parse_values(text, names, read)
    if not ranges:
        raise MotionError(f"{text!r} scans nothing: x=-2:2:41 is wanted")
    total = math.prod(len(values) for values in ranges.values())
    if total > MOST:
        raise MotionError(f"{text!r} has {total} points; {MOST} are the most")
    rows = np.zeros((total, len(names)))
    values = np.array(list(product(*(each.tolist() for each in ranges.values()))))
    rows[:, [names.index(name) for name in ranges]] = values
    return rows, names, rotation


def _parse_range(name: str, text: str) -> Array:
    """Return the values of FIRST:LAST:COUNT in equal steps, or a single value."""
    parts = text.split(":")
    if len(parts) == 1:
        return np.array([motion_number(name, text)])
    if len(parts) != 3 or not parts[2].strip().isdecimal():
        raise MotionError(f"{name}={text}: FIRST:LAST:COUNT is wanted, like -2:2:41")
    count = parts[2].strip().lstrip("0")
    if len(count) > len(str(MOST)) or not 0 < int(count or "0") <= MOST:
        raise MotionError(f"{name}={text}: a COUNT from 1 to {MOST} is wanted, like -2:2:41")
    return np.linspace(motion_number(name, parts[0]), motion_number(name, parts[1]), int(count))


def _read_table_file(name: str, names: Names) -> tuple[Array, Flags, Names]:
    """Return a CSV file's values (rows, names), whether each row's target is kept level, and the skipped columns.

    Raises MotionError with the number of the row.
    """
    try:
        text = table_text(name, LARGEST)
    except TableError as error:
        raise MotionError(f"{name} {error}") from error
    rows_text = (line for line in io.StringIO(text, newline=None) if line.strip() and not line.lstrip().startswith("#"))
    try:
        table = iter(list(csv.reader(rows_text)))
    except csv.Error as error:
        raise MotionError(f"{name} is no table that can be read: {error}") from error
    head = [cell.strip() for cell in next(table, [])]
    columns: dict[int, tuple[str, float | None]] = {}  # by column its name, and its factor where the header has a unit
    for k, title in enumerate(head):
        stem, _, unit = title.rpartition("_")
        if title in names or (title == "rotation" and names == LOAD):
            columns[k] = title, None
        elif stem in names and IN_HEADERS.get(unit, ("", 0.0))[0] == dimension(stem):
            columns[k] = stem, IN_HEADERS[unit][1]
        elif not stem or stem in names or unit not in READINGS:
            raise MotionError(f"{name}: column {title!r} is none of {', '.join(names)} (with _m, _rad, _N for SI)")
    if not columns or len({stem for stem, _ in columns.values()}) < len(columns):
        raise MotionError(f"{name}: the first line names the columns, each once: {', '.join(names)}")
    rows, level_flags = [], []
    for number, cells in enumerate(table, start=2):
        if len(cells) != len(head):
            raise MotionError(f"{name}, row {number}: {len(cells)} cells under {len(head)} columns")
        row, rotation = _file_row(f"{name}, row {number}", cells, columns, names)
        rows.append(row)
        level_flags.append(rotation)
    readings = ", ".join(title for k, title in enumerate(head) if k not in columns)
    passed = (f"{name}: columns of readings are passed over: {readings}",) if readings else ()
    return np.array(rows, dtype=float).reshape(-1, len(names)), np.array(level_flags, dtype=bool), passed


def _file_row(
    where: str, cells: Sequence[str], columns: Mapping[int, tuple[str, float | None]], names: Names
) -> tuple[list[float], bool]:
    """Return the values of one row of a file, and whether the target is kept level.

    `where` is the position of the row for error messages, and `cells` are its texts. `columns` maps column numbers to
    (name, factor to SI; None if each number has its own unit). Columns that a row leaves empty are 0.
    """
    values, is_level = dict.fromkeys(names, 0.0), is_held(USUAL_ROTATION)
    for k, (name, factor) in columns.items():
        text = cells[k].strip()
        try:
            if name == "rotation":
                is_level = is_held(text or USUAL_ROTATION)
            elif text:
                values[name] = motion_number(name, text) if factor is None else factor * float(text)
        except (MotionError, ValueError) as error:
            raise MotionError(f"{where}: {error}") from error
        if not math.isfinite(values.get(name, 0.0)):
            raise MotionError(f"{where}: {name}={text}: a finite number is wanted")
        if name in LOAD and abs(values[name]) > MOST_FORCE:
            raise MotionError(f"{where}: {name}={text}: {TOO_MUCH}")
    return [values[name] for name in names], is_level
