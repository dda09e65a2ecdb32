"""A bench's table of points, as it is written down: loads or poses, and what every coil read."""

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
from sitscad.calibration.points import Points, noisier
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual

READING_UNITS = {"counts": 1.0, "Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "H": 1.0, "mH": 1e-3, "uH": 1e-6, "nH": 1e-9}
"""Units that a coil's column may name after its name and an underscore."""

MOTION_UNITS = {"N": 1.0, "mN": 1e-3, "Nm": 1.0, "Nmm": 1e-3, "m": 1.0, "mm": 1e-3, "um": 1e-6, "rad": 1.0,
                "deg": math.pi / 180.0}
"""Units that a load's or a pose's column may name."""

READING_KINDS = "counts", "Hz", "H"
"""Kinds of readings: of several columns of a coil the first of these is used. Inductances come last, because they hold
a capacitor's value that the firmware was told."""

KINDS = {**dict.fromkeys(FORCE, ("N", "mN")), **dict.fromkeys(MOMENT, ("Nmm", "Nm")),
         **dict.fromkeys(POSE[:3], ("m", "mm", "um")), **dict.fromkeys(POSE[3:], ("rad", "deg"))}
"""The units of every load and pose."""

SAID = re.compile(r"\s*#+\s*rotation\s*[:=](.*)", re.IGNORECASE)
"""Such a line, and what it says."""

USUAL_ROTATION = "held"  # Of a table that does not say: a flat face keeps the target level, as in the data sheet
LARGEST = 16_000_000  # Bytes at most of a file


class BenchError(ValueError):
    """A table that cannot be read, or that no sensor of the design gives; the text begins with file:line:column."""


@record
class Column:
    """A column: where it stands (from 1), what it is of, its unit, and whether that is a coil."""

    number: int
    name: str
    unit: str
    is_coil: bool

    @property
    def factor(self) -> float:
        """What its numbers are multiplied with."""
        return (READING_UNITS if self.is_coil else MOTION_UNITS)[self.unit]

    @property
    def kind(self) -> str:
        """What a coil's column counts: one of `READING_KINDS`; empty for loads and poses."""
        if not self.is_coil:
            return ""
        return "counts" if self.unit == "counts" else "Hz" if self.unit.endswith("Hz") else "H"


@record(eq=False)
class BenchTable:
    """A table: its path, its columns, the lines (n) and the numbers (n, columns) in their own units; the line on which
    it says how the target was loaded, and what it says (`free`, `held`; empty where it says nothing).
    """

    path: str
    columns: tuple[Column, ...]
    lines: tuple[int, ...]
    values: Array
    rotation: tuple[int, str] = (0, "")

    def is_held(self, asked: str | None, usual: str = USUAL_ROTATION) -> bool:
        """Whether the target was kept level: by `asked`, else by the table's line, else by `usual`. Raises BenchError
        if `asked` contradicts the table, or if the table's word is unknown.
        """
        line, said = self.rotation
        if said and said not in ROTATIONS:
            raise BenchError(f"{self.path}:{line}:1 rotation {said!r}: {' or '.join(ROTATIONS)} is read")
        if said and asked and said != asked:
            raise BenchError(f"{self.path}:{line}:1 the table was taken with the target {ROTATIONS[said]}, and the map "
                             f"is asked for one {ROTATIONS[asked]}: `--rotation {said}`, or mend this line"
                             )
        return (asked or said or usual) == "held"

    def where(self, row: int, column: Column) -> str:
        """The place of a number."""
        return f"{self.path}:{self.lines[row]}:{column.number}"

    def named(self, name: str) -> int | None:
        """Where the column of a name stands, of several of a coil the one that is used; None where there is none."""
        found = [k for k, column in enumerate(self.columns) if column.name == name]
        kind = used_kind(self.columns)
        return next((k for k in found if self.columns[k].kind in ("", kind)), found[0] if found else None)

    def column(self, name: str) -> Column:
        """The column that `named` finds; there is one of every coil, and of what a row is told of."""
        place = self.named(name)
        assert place is not None
        return self.columns[place]

    def numbers(self, column: Column) -> Array:
        """What stands in a column (n), in its own unit."""
        return np.asarray(self.values[:, self.columns.index(column)])


def used_kind(columns: Sequence[Column]) -> str:
    """The kind of readings that is used: the first that every coil has; empty where there is none such."""
    coils = {column.name for column in columns if column.is_coil}
    return next((kind for kind in READING_KINDS if {c.name for c in columns if c.kind == kind} == coils), "")


def read_table(path: str, coils: Sequence[str]) -> BenchTable:
    """The table in a CSV file, whose header names coils (``C1_counts``) and loads or poses (``normal_N``, ``x_mm``). A
    coil may have several columns of different kinds; which is used says `used_kind`. Lines that begin with # and empty
    ones are left out. Raises BenchError for what cannot be read, OSError for a file that cannot be opened.
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
    columns = _columns(f"{path}:{line}", head, coils)
    values = [_numbers(f"{path}:{number}", cells, head, columns) for number, cells in body]
    return BenchTable(path, columns, tuple(number for number, _ in body), np.array(values).reshape(-1, len(columns)),
                 _rotation(path, whole))


def _rotation(path: str, whole: Sequence[tuple[int, list[str]]]) -> tuple[int, str]:
    """The line ``# rotation: held`` (or with ``=``) and its word; BenchError where another line says otherwise."""
    first = 0, ""
    for number, cells in whole:
        if not (told := SAID.match(cells[0])):
            continue
        said = (told[1].split() or ["?"])[0].strip(",;").lower()
        if first[1] and said != first[1]:
            raise BenchError(f"{path}:{number}:1 rotation {said!r} here, {first[1]!r} on line {first[0]}: one table is "
                             "of one of both")
        first = first if first[1] else (number, said)
    return first


def _columns(where: str, head: Sequence[str], coils: Sequence[str]) -> tuple[Column, ...]:
    """The columns of a table by its heading; BenchError for a title that is no load, pose or coil, or has no unit."""
    found = []
    for number, title in enumerate((cell.strip() for cell in head), start=1):
        name, _, unit = (title, "", "") if title in coils or title in KINDS else title.rpartition("_")
        units = tuple(READING_UNITS) if name in coils else KINDS.get(name)
        if units is None:
            parted = "; columns are parted by commas" if ";" in title or "\t" in title else ""
            raise BenchError(f"{where}:{number} column {title!r} is none of {', '.join((*LOAD, *POSE, *coils))}, "
                             f"each with its unit: normal_N, x_mm, C1_counts{parted}")
        if unit not in units:
            raise BenchError(f"{where}:{number} {name} in {unit!r}: {', '.join(f'{name}_{one}' for one in units)} are "
                             "read")
        found.append(Column(number, name, unit, name in coils))
    _require_all(where, found, coils)
    return tuple(found)


def _require_all(where: str, found: Sequence[Column], coils: Sequence[str]) -> None:
    """Raises BenchError for columns that are double or missing, or of both loads and poses."""
    names, titles = [column.name for column in found], [(column.name, column.kind) for column in found]
    end = f"{where}:{max((column.number for column in found), default=1)}"
    for column in found:
        if titles.count((column.name, column.kind)) > 1:
            raise BenchError(f"{where}:{column.number} {column.name} has two columns")
    missing = [name for name in coils if name not in names]
    if missing or (not used_kind(found) and any(column.kind == "counts" for column in found)):
        said = f"no column for {', '.join(missing)}" if missing else "coils in several kinds of units"
        raise BenchError(f"{end} {said}: one of a kind for every coil is wanted, like {coils[0]}_counts")
    kinds = {"load" if name in LOAD else "pose" for name in names if name in KINDS}
    if len(kinds) != 1:
        said = "loads and poses: one of both is wanted" if kinds else "neither loads nor poses: normal_N is wanted"
        raise BenchError(f"{end} {said}")


def _numbers(where: str, cells: Sequence[str], head: Sequence[str], columns: Sequence[Column]) -> list[float]:
    """A row's values in the order of the columns; BenchError for what is no finite number, or a row too short."""
    if len(cells) != len(head):
        raise BenchError(f"{where}:{min(len(cells), len(head)) + 1} {len(cells)} cells under {len(head)} columns")
    found = []
    for column in columns:
        text = cells[column.number - 1].strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            said = f"{text!r} is no finite number" if text else "nothing was read here"
            raise BenchError(f"{where}:{column.number} {column.name}: {said}")
        found.append(value)
    return found


def points_of(table: BenchTable, sensors: Sensors) -> Points:
    """A table's points: loads or poses in SI units, readings as frequencies. Raises BenchError where a load pulls,
    where there is no tare or there are too few points.
    """
    motion = LOAD if table.named("normal") is not None or not any(c.name in POSE for c in table.columns) else POSE
    moved = np.zeros((len(table.values), len(motion)))
    for k, name in enumerate(motion):
        place = table.named(name)
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
    frequency = np.stack([frequencies_of(table, sensors, column) for column in used], axis=1)
    found = Points(moved if motion == LOAD else None, moved if motion == POSE else None, frequency, at_rest)
    written = np.array([rounded(table, column).max() for column in used]) / math.sqrt(3.0)
    return replace(found, noisier=noisier(found, np.hypot(sensors.of_mean(int(usual("readings"))), written)))


FEWEST = 3  # Points beside the tare, at least


def _require_enough(table: BenchTable, moved: Array, at_rest: Flags, motion: tuple[str, ...]) -> None:
    """Raises BenchError without a tare, with fewer than FEWEST other points, or for loads that pull."""
    end = f"{table.path}:{table.lines[-1] if table.lines else 1}:1"
    if not at_rest.any():
        raise BenchError(
            f"{end} no point is at rest: a row with all {'loads' if motion == LOAD else 'poses'} 0 is the tare"
        )
    if len({tuple(row) for row in moved[~at_rest]}) < FEWEST:
        count = int((~at_rest).sum())
        raise BenchError(f"{end} {count} point{'s' * (count != 1)} beside the tare: {FEWEST} different ones at least, "
                         "five to ten serve well")
    if motion == LOAD and np.any(moved[:, 0] < 0.0):
        row = int(np.argmax(moved[:, 0] < 0.0))
        raise BenchError(f"{table.where(row, table.column('normal'))} normal below 0: presses are positive")


FINEST = 12  # Digits behind the point that are looked at


def rounded(table: BenchTable, column: Column) -> Array:
    """By how much (n, of the frequency) the last digit that a coil's column is written with may be off."""
    values = table.numbers(column)
    digits = next((d for d in range(FINEST) if np.array_equal(np.round(values, d), values)), FINEST)
    return np.asarray((0.5 if column.kind == "H" else 1.0) * 0.5 * 10.0**-digits / np.abs(values))


def frequencies_of(table: BenchTable, sensors: Sensors, column: Column) -> Array:
    """A coil's frequencies (Hz; n) by a column; raises BenchError for readings that it cannot have."""
    readout = sensors.model.estimates.readout
    values = table.numbers(column) * column.factor
    if np.any(values <= 0.0):
        raise BenchError(f"{table.where(int(np.argmax(values <= 0.0)), column)} {column.name}: a reading is above 0")
    if column.kind == "counts":
        least, most = sensors.conversion.ends(sensors.coils.index(column.name))
        beyond = (values <= least) | (values >= most)
        if np.any(beyond):
            raise BenchError(
                f"{table.where(int(np.argmax(beyond)), column)} {column.name}: counts of the "
                f"{sensors.conversion.device.part} as it is set lie above {least} and below {most} (its header in "
                "firmware makes counts of results)"
            )
        return sensors.conversion.frequencies(values)
    if column.kind == "H":
        assert readout.conversion_capacitance is not None
        return np.asarray(1.0 / (2.0 * math.pi * np.sqrt(values * readout.conversion_capacitance)))
    return np.asarray(values)
