"""Measured impedance of a coil from a file: Touchstone, or a table from an LCR meter or an impedance analyser."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sitscad.assembly.solids import MissingExtra
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.basics.units import UNITS


class MeasurementError(ValueError):
    """Raised for a file that does not contain the impedance of a coil. The text gives the file and the line."""


@record(eq=False)
class Measurement:
    """Impedance of one coil, measured at several frequencies.

    Attributes
    ----------
    path : str
        path of the file
    frequencies : (n,) array
        Hz, ascending
    impedances : (n,) complex array
        ohm
    """

    path: str
    frequencies: Array
    impedances: ComplexArray

    @property
    def inductances(self) -> Array:
        """Series inductances (n; H), as an LCR meter shows them. Negative above the self-resonance."""
        return self.impedances.imag / (2.0 * np.pi * self.frequencies)

    @property
    def resistances(self) -> Array:
        """Series resistances (n; ohm)."""
        return self.impedances.real


MAX_SIZE = 8_000_000
"""Largest accepted size (bytes) of a file. A sweep of 100,000 points is smaller."""

TOUCHSTONE = re.compile(r"\.[sz]\d+p$", re.IGNORECASE)
"""Pattern of the endings of Touchstone files."""


def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """Read the impedance of a coil from a file.

    Parameters
    ----------
    path
        A Touchstone file of one port (``.s1p``), or a table (CSV). The head of a table names the frequency and one of
        R and X, L and R, L and Q, Z and phase, each with its unit: ``f (kHz),Ls (uH),Rs (ohm)``. Quantities without a
        unit are in Hz, H, ohm and degrees. Lines before the head are skipped.

    Returns
    -------
    Measurement
        Frequencies (Hz) and impedances (ohm), in ascending order of frequency.

    Raises
    ------
    MeasurementError
        if the file cannot be read, or has no such quantities; the text names the line
    MissingExtra
        for a Touchstone file if scikit-rf is not installed
    """
    name = os.fspath(path)
    try:
        with open(name, "rb") as file:
            content = file.read(MAX_SIZE + 1)
    except OSError as error:
        raise MeasurementError(f"{name}: {error.strerror or error}") from None
    if len(content) > MAX_SIZE:
        raise MeasurementError(f"{name} is larger than {MAX_SIZE // 1_000_000} MB: no sweep of one coil")
    is_touchstone = TOUCHSTONE.search(name) is not None
    frequencies, impedances = (
        _read_touchstone(name, content) if is_touchstone else _read_table(name, _decoded_text(content))
    )
    if not len(frequencies):
        raise MeasurementError(f"{name} has no points")
    order = np.argsort(frequencies, kind="stable")
    frequencies, impedances = frequencies[order], impedances[order]
    if not (np.isfinite(frequencies).all() and np.isfinite(impedances).all()):
        raise MeasurementError(f"{name} has values that are not finite")
    positive = frequencies > 0.0  # network analysers may begin at 0 Hz
    if not positive.any():
        raise MeasurementError(f"{name} has no frequency above 0 Hz")
    if (np.diff(frequencies[positive]) <= 0.0).any():
        twice = frequencies[positive][:-1][np.diff(frequencies[positive]) <= 0.0][0]
        raise MeasurementError(f"{name} has two points at {twice:g} Hz: one sweep of one coil is wanted")
    return Measurement(name, frequencies[positive], impedances[positive])


def _decoded_text(content: bytes) -> str:
    """Return the text of a table file. Encodings are UTF-8, UTF-16 with a byte order mark, or Latin-1 (micro sign)."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _read_touchstone(name: str, content: bytes) -> tuple[Array, ComplexArray]:
    """Return the frequencies (n; Hz) and impedances (n; ohm) in a Touchstone file with one port."""
    if not re.search(r"1p$", name, re.IGNORECASE):
        raise MeasurementError(f"{name} has several ports: a coil has one (.s1p)")
    try:
        import skrf
    except ImportError:
        raise MissingExtra("Touchstone files need scikit-rf: pip install 'sitscad[bench]'") from None
    stream = io.StringIO(_decoded_text(content))
    stream.name = name  # scikit-rf takes the number of ports from the ending
    try:
        network = skrf.Network(stream)
        return np.asarray(network.f, dtype=float), np.asarray(network.z[:, 0, 0], dtype=complex)
    except Exception as error:  # scikit-rf raises whatever its parser meets
        raise MeasurementError(f"{name} cannot be read as Touchstone: {error}") from None


_ALIASES: Mapping[str, Sequence[str]] = {
    "f": ("f", "freq", "frequency"),
    "L": ("l", "ls", "inductance"),
    "R": ("r", "rs", "re", "resistance", "esr", "rez", "realz"),
    "X": ("x", "xs", "im", "reactance", "imz", "imagz"),
    "Q": ("q", "quality", "qualityfactor"),
    "Z": ("z", "absz", "magz", "impedance", "magnitude"),
    "phase": ("theta", "phase", "phi", "thetaz", "angle"),
}
"""Accepted column names for each quantity, in small letters and without other characters."""

_PARALLEL = {"lp", "rp", "cp", "cs", "gp", "bp", "d"}
"""Column names of other equivalent circuits, which cannot be used. The error message names them."""

_DIMENSIONS = {
    "f": "frequency", "L": "inductance", "R": "resistance", "X": "resistance", "Z": "resistance", "phase": "angle",
}
"""Dimension of each quantity. Q has none."""

_COMBINATIONS: Mapping[tuple[str, str], Callable[[Array, Array, Array], ComplexArray]] = {
    ("R", "X"): lambda omega, r, x: r + 1j * x,
    ("L", "R"): lambda omega, inductance, r: r + 1j * omega * inductance,
    ("L", "Q"): lambda omega, inductance, q: omega * inductance * (1.0 / q + 1j),
    ("Z", "phase"): lambda omega, z, phase: z * np.exp(1j * phase),
}
"""Functions of angular frequency (rad/s) and two quantities that return the impedance (ohm), by their names.

The first pair whose columns a table has is used.
"""


def _read_table(name: str, text: str) -> tuple[Array, ComplexArray]:
    """Return the frequencies (n; Hz) and impedances (n; ohm) in a table."""
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        delimiter = next((each for each in (";", "\t", ",") if each in line), ",")
        heads = next(csv.reader([line], delimiter=delimiter), [])
        columns = _columns(heads)
        if "f" in columns and len(heads) > 1:
            head_line = number
            break
    else:
        raise MeasurementError(
            f"{name} has no line that names the frequency and its columns, like \"f (Hz),Ls (H),Rs (ohm)\"")
    pair = next((each for each in _COMBINATIONS if set(each) <= set(columns)), None)
    if pair is None:
        raise MeasurementError(f"{name}:{head_line}: {_missing_columns_reason(heads)}")
    quantities = ("f", *pair)
    values: dict[str, list[float]] = {quantity: [] for quantity in quantities}
    for place, row in enumerate(csv.reader(lines[head_line:], delimiter=delimiter), head_line + 1):
        if not any(cell.strip() for cell in row) or row[0].lstrip()[:1] in ("#", "!", "%"):
            continue
        for quantity in quantities:
            column, factor = columns[quantity]
            values[quantity].append(factor * _cell_number(name, place, row, column, delimiter))
    f, first, second = (np.array(values[quantity], dtype=float) for quantity in quantities)
    if pair == ("L", "Q") and (second <= 0.0).any():
        raise MeasurementError(f"{name} has a quality factor of {second[second <= 0.0][0]:g}: it must be above 0")
    return f, np.asarray(_COMBINATIONS[pair](2.0 * np.pi * f, first, second), dtype=complex)


_HEAD = re.compile(r"^[#!%\s]*(?P<name>[^()\[\]]*?)\s*(?:[(\[](?P<unit>[^()\[\]]*)[)\]])?\s*$")
"""Pattern of a column's head: name, and unit in brackets."""


def _columns(heads: Sequence[str]) -> dict[str, tuple[int, float]]:
    """Return (column number, factor to the SI unit) by quantity, from the columns' heads.

    Columns with unknown names are left out.
    """
    columns: dict[str, tuple[int, float]] = {}
    for number, head in enumerate(heads):
        match = _HEAD.match(head)
        if match is None:
            continue
        name, unit = match["name"], match["unit"]
        if unit is None and "_" in name:  # L_uH
            name, _, unit = name.rpartition("_")
        plain = re.sub(r"[^a-z]", "", name.lower())
        for quantity, aliases in _ALIASES.items():
            factor = _si_factor(quantity, unit)
            if plain in aliases and factor is not None and quantity not in columns:
                columns[quantity] = number, factor
    return columns


def _si_factor(quantity: str, unit: str | None) -> float | None:
    """Return the factor from a unit to the quantity's SI unit. None if the unit does not belong to the quantity.

    A phase without a unit is in degrees. Capital and small letters are equivalent unless two units differ only by them
    (mHz, MHz).
    """
    units = {name: float(factor) for name, factor in UNITS.get(_DIMENSIONS.get(quantity, ""), {"": 1}).items()}
    written = (unit or "").strip()
    if not written:
        return units["deg"] if quantity == "phase" else 1.0
    similar = [factor for name, factor in units.items() if name.lower() == written.lower()]
    return units.get(written, similar[0] if len(similar) == 1 else None)


def _missing_columns_reason(heads: Sequence[str]) -> str:
    """Return the reason why the columns with these heads do not determine an impedance."""
    for head in heads:
        if re.sub(r"[^a-z]", "", re.split(r"[(\[_]", head)[0].lower()) in _PARALLEL:
            return (f"{head.strip()!r} is a value of another equivalent circuit: export series values, Ls and Rs, or R "
                    "and X")
    return "beside the frequency it has none of R and X, L and R, L and Q, Z and phase, in units of these"


def _cell_number(name: str, line: int, row: Sequence[str], column: int, delimiter: str) -> float:
    """Return the number in a table cell. Raises MeasurementError if the cell contains no number."""
    cell = row[column].strip() if column < len(row) else ""
    try:
        return float(cell.replace(",", ".") if delimiter != "," else cell)
    except ValueError:
        raise MeasurementError(f"{name}:{line}: {cell!r} in column {column + 1} is no number") from None
