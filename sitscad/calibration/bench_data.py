"""Table of measured points from a test bench: applied loads or poses, and the readings of each coil."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.assembly.places.motions import FORCE, LOAD, MOMENT, POSE, ROTATIONS, TableError, table_text
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.basics.units import count_text
from sitscad.calibration.points import Points, noise_ratio
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual_value

READING_UNITS = {"counts": 1.0, "Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "H": 1.0, "mH": 1e-3, "uH": 1e-6, "nH": 1e-9}
"""Units of a coil's column, with their factors to Hz, H or counts.

The unit follows the coil's name and an underscore.
"""

MOTION_UNITS = {"N": 1.0, "mN": 1e-3, "Nm": 1.0, "Nmm": 1e-3, "m": 1.0, "mm": 1e-3, "um": 1e-6, "rad": 1.0,
                "deg": math.pi / 180.0, "degC": 1.0}
"""Units of a column with loads, poses or temperatures, with their factors to SI units, or to degrees Celsius."""

TEMPERATURE = "temperature"
"""Name of the column of temperatures, as the firmware reads them."""

READING_KINDS = "counts", "Hz", "H"
"""Kinds of readings, in the order in which they are used if a coil has several columns.

Inductances come last, because they depend on the capacitor value that the firmware assumes.
"""

KINDS = {**dict.fromkeys(FORCE, ("N", "mN")), **dict.fromkeys(MOMENT, ("Nmm", "Nm")),
         **dict.fromkeys(POSE[:3], ("m", "mm", "um")), **dict.fromkeys(POSE[3:], ("rad", "deg")),
         TEMPERATURE: ("degC",)}
"""Permitted units of each load, each pose component and the temperature, by its name."""

ROTATION_LINE = re.compile(r"\s*#+\s*rotation\s*[:=](.*)", re.IGNORECASE)
"""Pattern of a line that states whether the target could tilt. Its group is the text after the colon."""

USUAL_ROTATION = "held"  # Of a table without the line: a flat face keeps the target level, as in the data sheet
"""Rotation of the target in a table without a rotation line: kept level by a flat face."""
LARGEST = 16_000_000  # Largest size (bytes) of a file
"""Largest accepted size (bytes) of a table file."""


class BenchError(ValueError):
    """Raised for a table that cannot be read, or that no sensor of the design gives.

    The text begins with file:line:column.
    """


@record
class Column:
    """A column of a table of measurements, with its number from 1.

    `name` is a coil, or a component of the load or pose. `unit` is the unit of the values. `is_coil` is True for a
    coil's column.
    """

    number: int
    name: str
    unit: str
    is_coil: bool

    @property
    def factor(self) -> float:
        """Factor from the column's unit to SI. 1 for counts."""
        return (READING_UNITS if self.is_coil else MOTION_UNITS)[self.unit]

    @property
    def kind(self) -> str:
        """Kind of a coil's readings, from `READING_KINDS`. Empty for loads and poses."""
        if not self.is_coil:
            return ""
        return "counts" if self.unit == "counts" else "Hz" if self.unit.endswith("Hz") else "H"


@record(eq=False)
class BenchTable:
    """A table of measured points.

    ``lines`` (n) are the file's line numbers of the rows, and ``values`` (n, columns) the numbers in the units of the
    columns. ``rotation`` is (line number, word) of the line that states the target's rotation. The word is `free` or
    `held`, or empty without this line.
    """

    path: str
    columns: tuple[Column, ...]
    lines: tuple[int, ...]
    values: Array
    rotation: tuple[int, str] = (0, "")

    def is_held(self, rotation: str | None, usual: str = USUAL_ROTATION) -> bool:
        """Whether the target was kept level: decided by `rotation`, else by the table's line, else by `usual`.

        Raises BenchError if `rotation` contradicts the table, or if the table's word is unknown.
        """
        line, word = self.rotation
        if word and word not in ROTATIONS:
            raise BenchError(f"{self.path}:{line}:1 rotation {word!r}: {' or '.join(ROTATIONS)} is read")
        if word and rotation and word != rotation:
            raise BenchError(f"{self.path}:{line}:1 the table was taken with the target {ROTATIONS[word]}, and the map "
                             f"is asked for one {ROTATIONS[rotation]}: `--rotation {word}`, or mend this line")
        return (rotation or word or usual) == "held"

    def position(self, row: int, column: Column) -> str:
        """Return the position of a number in the file, as path:line:column."""
        return f"{self.path}:{self.lines[row]}:{column.number}"

    def column_index(self, name: str) -> int | None:
        """Return the index of the column of a coil, load or pose component. None if the table has no such column.

        If a coil has several columns, it is the column of the kind `used_kind`.
        """
        places = [k for k, column in enumerate(self.columns) if column.name == name]
        kind = used_kind(self.columns)
        return next((k for k in places if self.columns[k].kind in ("", kind)), places[0] if places else None)

    def column(self, name: str) -> Column:
        """Return the used column of a coil, load or pose component. The table must have this column."""
        place = self.column_index(name)
        assert place is not None
        return self.columns[place]

    def part(self, chosen: Flags, unused: str) -> BenchTable:
        """Return a table with some of the rows, chosen by flags (n), and without the columns of the coil `unused`."""
        lines = tuple(line for line, is_chosen in zip(self.lines, chosen, strict=True) if is_chosen)
        used = [k for k, column in enumerate(self.columns) if column.name != unused]
        return replace(self, lines=lines, values=self.values[chosen][:, used],
                       columns=tuple(self.columns[k] for k in used))

    def numbers(self, column: Column) -> Array:
        """Return the values of a column (n) in its own unit."""
        return np.asarray(self.values[:, self.columns.index(column)])


def used_kind(columns: Sequence[Column]) -> str:
    """Return the first of `READING_KINDS` for which each coil has a column. Empty if there is no such kind."""
    coils = {column.name for column in columns if column.is_coil}
    return next((kind for kind in READING_KINDS if {c.name for c in columns if c.kind == kind} == coils), "")


def read_table(path: str, coils: Sequence[str], unused: str = "") -> BenchTable:
    """Return the table in a CSV file.

    Its header names coils (``C1_counts``) and loads or poses (``normal_N``, ``x_mm``). A coil may have several columns
    of different kinds, and `used_kind` selects the used kind. Empty lines, and lines that begin with #, are skipped.
    The table may have columns of the coil `unused` (a reference coil). They are read if the table has temperatures.

    Raises
    ------
    BenchError
        if the table cannot be read
    OSError
        if the file cannot be opened
    """
    try:
        text = table_text(path, LARGEST)
        whole = [(number, cells) for number, cells in enumerate(csv.reader(io.StringIO(text, newline=None)), start=1)
                 if any(cell.strip() for cell in cells)]
    except (TableError, csv.Error) as error:
        raise BenchError(f"{path}:1:1 is no table that can be read: {error}") from error
    rows = [(number, cells) for number, cells in whole if not cells[0].lstrip().startswith("#")]
    if not rows:
        raise BenchError(f"{path}:1:1 is empty: a header like normal_N,shear_x_N,C1_counts,C2_counts is wanted")
    (line, head), body = rows[0], rows[1:]
    columns = _columns(f"{path}:{line}", head, coils, unused)
    values = [_numbers(f"{path}:{number}", cells, head, columns) for number, cells in body]
    return BenchTable(path, columns, tuple(number for number, _ in body), np.array(values).reshape(-1, len(columns)),
                 _rotation(path, whole))


def _rotation(path: str, whole: Sequence[tuple[int, list[str]]]) -> tuple[int, str]:
    """Return (line number, word) of the line ``# rotation: held`` (or with ``=``). Word empty if there is no such line.

    Raises BenchError if two lines contradict each other.
    """
    first = 0, ""
    for number, cells in whole:
        if not (match := ROTATION_LINE.match(cells[0])):
            continue
        word = (match[1].split() or ["?"])[0].strip(",;").lower()
        if first[1] and word != first[1]:
            raise BenchError(f"{path}:{number}:1 rotation {word!r} here, {first[1]!r} on line {first[0]}: one table is "
                             "of one of both")
        first = first if first[1] else (number, word)
    return first


def _columns(where: str, head: Sequence[str], coils: Sequence[str], unused: str) -> tuple[Column, ...]:
    """Return the columns of a table from its header.

    Raises BenchError for an unknown title, or a title without a unit.
    """
    columns, titles = [], [cell.strip() for cell in head]
    if unused and any(title.startswith(TEMPERATURE) for title in titles) and any(
            title.rpartition("_")[0] == unused for title in titles):
        coils, unused = (*coils, unused), ""
    for number, title in enumerate(titles, start=1):
        name, _, unit = (title, "", "") if title in coils or title in KINDS else title.rpartition("_")
        if unused and name == unused and unit in READING_UNITS:
            continue
        units = tuple(READING_UNITS) if name in coils else KINDS.get(name)
        if units is None:
            parted = "; columns are parted by commas" if ";" in title or "\t" in title else ""
            raise BenchError(f"{where}:{number} column {title!r} is none of {', '.join((*KINDS, *coils))}, "
                             f"each with its unit: normal_N, x_mm, C1_counts{parted}")
        if unit not in units:
            raise BenchError(f"{where}:{number} {name} in {unit!r}: {', '.join(f'{name}_{end}' for end in units)} are "
                             "read")
        columns.append(Column(number, name, unit, name in coils))
    _require_all(where, columns, coils)
    return tuple(columns)


def _require_all(where: str, columns: Sequence[Column], coils: Sequence[str]) -> None:
    """Raise BenchError for double or missing columns, or if the table has both loads and poses, or neither."""
    names, titles = [column.name for column in columns], [(column.name, column.kind) for column in columns]
    end = f"{where}:{max((column.number for column in columns), default=1)}"
    for column in columns:
        if titles.count((column.name, column.kind)) > 1:
            raise BenchError(f"{where}:{column.number} {column.name} has two columns")
    missing = [name for name in coils if name not in names]
    if missing or (not used_kind(columns) and any(column.kind == "counts" for column in columns)):
        fault = f"no column for {', '.join(missing)}" if missing else "coils in several kinds of units"
        raise BenchError(f"{end} {fault}: one of a kind for every coil is wanted, like {coils[0]}_counts")
    kinds = {"load" if name in LOAD else "pose" for name in names if name in (*LOAD, *POSE)}
    if TEMPERATURE in names and "load" not in kinds:
        raise BenchError(f"{end} temperatures without loads: the drift is fitted to rows with loads, like normal_N")
    if len(kinds) != 1:
        fault = "loads and poses: one of both is wanted" if kinds else "neither loads nor poses: normal_N is wanted"
        raise BenchError(f"{end} {fault}")


def _numbers(where: str, cells: Sequence[str], head: Sequence[str], columns: Sequence[Column]) -> list[float]:
    """Return the values of a row in the order of the columns.

    Raises BenchError for rows that are too short or too long, and for cells without a finite number.
    """
    if len(cells) != len(head):
        raise BenchError(f"{where}:{min(len(cells), len(head)) + 1} {len(cells)} cells under {len(head)} columns")
    numbers = []
    for column in columns:
        text = cells[column.number - 1].strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            fault = f"{text!r} is no finite number" if text else "nothing was read here"
            raise BenchError(f"{where}:{column.number} {column.name}: {fault}")
        numbers.append(value)
    return numbers


def table_points(table: BenchTable, sensors: Sensors) -> Points:
    """Return the points of a table: loads or poses in SI units, and readings as frequencies.

    Raises BenchError for a negative normal force, without a row at rest, or with too few points.
    """
    motion = LOAD if table.column_index("normal") is not None or not any(c.name in POSE
                                                                          for c in table.columns) else POSE
    moved = np.zeros((len(table.values), len(motion)))
    for k, name in enumerate(motion):
        place = table.column_index(name)
        if place is not None:
            moved[:, k] = table.values[:, place] * table.columns[place].factor
            if name in MOMENT and sensors.range.width < len(LOAD):
                raise BenchError(f"{table.path}:1:{table.columns[place].number} {name}: the spec asks for no moment "
                                 f"(requirements.{name}), so its target is taken as kept level or as told by shear")
    if motion == LOAD:
        moved = moved[:, : sensors.range.width]
    at_rest = np.all(moved == 0.0, axis=1)
    _require_enough(table, moved, at_rest, motion)
    used = [table.column(name) for name in sensors.coils]
    frequency = np.stack([column_frequencies(table, sensors, column) for column in used], axis=1)
    points = Points(moved if motion == LOAD else None, moved if motion == POSE else None, frequency, at_rest)
    written = np.array([rounding_error(table, column).max() for column in used]) / math.sqrt(3.0)
    return replace(points, noise_ratio=noise_ratio(points, np.hypot(sensors.mean_noise(int(usual_value("readings"))),
                                                                written)))


FEWEST = 3  # Least number of points besides the tare
"""Least number of different loads or poses in a table, in addition to the rows at rest."""


def _require_enough(table: BenchTable, moved: Array, at_rest: Flags, motion: tuple[str, ...]) -> None:
    """Raise BenchError without a row at rest, with fewer than `FEWEST` other points, or for a negative normal force.

    `moved` are the loads or poses, and `motion` the names of their columns.
    """
    end = f"{table.path}:{table.lines[-1] if table.lines else 1}:1"
    if not at_rest.any():
        raise BenchError(
            f"{end} no point is at rest: a row of zeros is the tare"
        )
    if len({tuple(row) for row in moved[~at_rest]}) < FEWEST:
        points = count_text(int((~at_rest).sum()), "point")
        raise BenchError(f"{end} {points} beside the tare: {FEWEST} different points at least, five to ten serve well")
    if motion == LOAD and np.any(moved[:, 0] < 0.0):
        row = int(np.argmax(moved[:, 0] < 0.0))
        raise BenchError(f"{table.position(row, table.column('normal'))} normal below 0: presses are positive")


FINEST = 12  # Largest number of decimals that is recognised
"""Largest number of decimals that is recognised in a column of readings."""


def rounding_error(table: BenchTable, column: Column) -> Array:
    """Return the rounding error of a coil's column, as a relative error of the frequency (n).

    It is half a unit of the last decimal.
    """
    values = table.numbers(column)
    digits = next((d for d in range(FINEST) if np.array_equal(np.round(values, d), values)), FINEST)
    return np.asarray((0.5 if column.kind == "H" else 1.0) * 0.5 * 10.0**-digits / np.abs(values))


def column_frequencies(table: BenchTable, sensors: Sensors, column: Column) -> Array:
    """Return the frequencies (Hz; n) of a coil from a column.

    Raises BenchError for readings outside the converter's range.
    """
    readout = sensors.model.estimates.readout
    values = table.numbers(column) * column.factor
    if np.any(values <= 0.0):
        raise BenchError(f"{table.position(int(np.argmax(values <= 0.0)), column)} {column.name}: a reading is above 0")
    if column.kind == "counts":
        least, most = sensors.conversion.ends(sensors.coils.index(column.name))
        beyond = (values <= least) | (values >= most)
        if np.any(beyond):
            raise BenchError(
                f"{table.position(int(np.argmax(beyond)), column)} {column.name}: counts of the "
                f"{sensors.conversion.device.part} as it is set lie above {least} and below {most} (its header in "
                "firmware makes counts of results)"
            )
        return sensors.conversion.frequencies(values)
    if column.kind == "H":
        assert readout.conversion_capacitance is not None
        return np.asarray(1.0 / (2.0 * math.pi * np.sqrt(values * readout.conversion_capacitance)))
    return np.asarray(values)
