"""Intended nets that finished files state: X2 net and pin attributes, and the IPC-D-356 test netlist.

Both are parsed here as text. The code is independent of the writers and of the reader of the artwork.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from sitscad.basics.record import record
from sitscad.files.extraction.limits import content_of, require_objects


class MarkSource(StrEnum):
    """Kind of file that states a mark."""

    X2 = "Gerber X2 attributes"
    IPC_D_356 = "IPC-D-356 netlist"


@record
class Mark:
    """Place at which a file states the net of its copper.

    Attributes
    ----------
    net
        Name of the net.
    layer
        Copper layer, from 1 at the top. None for the pads of a hole on every layer.
    x, y
        Place (m).
    pin
        Reference and number of the contact (``J1-1``), if stated.
    function
        Function of the contact (``C1.A``), if stated.
    is_via
        Whether the mark is the pad of a via.
    drill
        Diameter (m) of the hole, if stated.
    """

    net: str
    layer: int | None
    x: float
    y: float
    source: MarkSource
    pin: str | None = None
    function: str | None = None
    is_via: bool = False
    drill: float | None = None


_STATEMENT = re.compile(r"%([^%]*)%|([^%*]*)\*")
_OPERATION = re.compile(r"(?:G0?[123])?(?:X([+-]?\d+))?(?:Y([+-]?\d+))?(?:[IJ][+-]?\d+)*D0?([123])")
_FORMAT = re.compile(r"FSLAX\d(\d)Y\d\d")
_ESCAPE = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")
_NO_NET = ("", "N/C")
UNUSED = "N/C "
"""Prefix, before the contact's pin, of the net name of a contact without a net. Each such contact must be isolated."""


@dataclass
class _GerberState:
    """State of a Gerber reader, as far as attributes need it."""

    unit: float = 1e-3
    decimals: int = 6
    x: float = 0.0
    y: float = 0.0
    aperture: str = ""
    attributes: dict[str, list[str]] = field(default_factory=dict)
    apertures: dict[str, str] = field(default_factory=dict)


def marks_of_gerber(text: str, layer: int) -> tuple[Mark, ...]:
    """Return the marks of a copper layer: the place of each flash and of both ends of each draw with a net (``.N``).

    `layer` is the layer's number, from 1 at the top.
    """
    state = _GerberState()
    marks: list[Mark] = []
    for extended, word in _STATEMENT.findall(text):
        if extended:
            for command in extended.split("*"):
                command = command.strip()
                if match := _FORMAT.match(command):
                    state.decimals = int(match[1])
                elif command in ("MOMM", "MOIN"):
                    state.unit = 1e-3 if command == "MOMM" else 25.4e-3
                elif command.startswith("AD") and (match := re.match(r"AD(D\d+)", command)):
                    state.apertures[match[1]] = state.attributes.get("TA.AperFunction", [""])[0]
                elif command.startswith(("TA", "TO")):
                    name, *values = command.split(",")
                    state.attributes[name] = [
                        _ESCAPE.sub(lambda code: chr(int(code[1] or code[2], 16)), value) for value in values
                    ]
                elif command == "TD":
                    state.attributes.clear()
                elif command.startswith("TD"):
                    state.attributes.pop("TA" + command[2:], None)
                    state.attributes.pop("TO" + command[2:], None)
        else:
            marks += _operate(state, word.strip(), layer)
    return tuple(dict.fromkeys(marks))


def _operate(state: _GerberState, word: str, layer: int) -> Iterator[Mark]:
    """Yield the marks of one statement of the Gerber file, and update the state."""
    if word.startswith("G04"):
        return
    if re.fullmatch(r"D[1-9]\d+", word):
        state.aperture = word
        return
    match = _OPERATION.fullmatch(word)
    if not match:
        return
    before = state.x, state.y
    scale = state.unit * 10.0**-state.decimals
    state.x = int(match[1]) * scale if match[1] else state.x
    state.y = int(match[2]) * scale if match[2] else state.y
    if match[3] == "1":
        yield from _mark(state, *before, layer, is_via=False)
    if match[3] != "2":
        is_via = match[3] == "3" and state.apertures.get(state.aperture) == "ViaPad"
        yield from _mark(state, state.x, state.y, layer, is_via=is_via)


def _mark(state: _GerberState, x: float, y: float, layer: int, *, is_via: bool) -> Iterator[Mark]:
    """Yield the mark of the current net at a place. Yields nothing if there is no current net."""
    net = state.attributes.get("TO.N", [""])[0]
    reference, number, function = ([*state.attributes.get("TO.P", []), "", "", ""])[:3]
    pin = f"{reference}-{number}" if reference else None
    net = f"{UNUSED}{pin}" if net == "N/C" and pin else net
    if net not in _NO_NET:
        yield Mark(net, layer, x, y, MarkSource.X2, pin, function or None, is_via)


IPC_UNITS = {"CUST 0": 2.54e-6, "CUST 1": 1e-6, "CUST 2": 2.54e-6}
"""Unit of a coordinate (m): 0.0001 inch or 0.001 mm (IPC-D-356A, parameter record UNITS)."""

_IPC_RECORD = re.compile(
    r"3([12])7(?P<net>.{14}) {3}(?P<reference>.{6})(?P<dash>[- ])(?P<pin>.{4})(?P<middle>[M ])"
    r"(?:D(?P<drill>\d{4})(?P<plated>[PU ])| {6})A(?P<access>\d\d)X(?P<x>[+-]\d{6})Y(?P<y>[+-]\d{6})"
)
_IPC_ALIAS = re.compile(r"P {2}(NNAME\d+) +(\S+)")


BINARY = (b"PK\x03\x04", b"%PDF")
"""First bytes of files that are not text: archives and PDFs."""


def is_ipc_d_356(text: str) -> bool:
    """Return whether a text looks like an IPC-D-356 netlist: a line begins like a test record, or states units.

    The number of the record alone is not enough, because numbers in other files may begin with its digits.
    """
    return bool(re.search(r"^(?:3[12]7\S.{13} {3}|P  UNITS )", text, re.MULTILINE))


def marks_of_ipc_d_356(text: str) -> tuple[Mark, ...]:
    """Return the marks of an IPC-D-356A netlist, one per test record (317 for holes, 327 for surface pads).

    Raises ValueError with the line's number for a test record outside the fixed columns.
    """
    unit = 2.54e-6
    aliases: dict[str, str] = {}
    marks = []
    for number, line in enumerate(text.splitlines(), start=1):
        if match := _IPC_ALIAS.match(line):
            aliases[match[1]] = match[2]
        elif line.startswith("P  UNITS"):
            name = line[8:].strip()
            if name not in IPC_UNITS:
                raise ValueError(f"line {number}: units {name!r}, where one of {', '.join(IPC_UNITS)} is expected")
            unit = IPC_UNITS[name]
        elif line.startswith(("317", "327")):
            record = _IPC_RECORD.match(line)
            if not record:
                raise ValueError(f"line {number}: a test record out of its columns: {line!r}")
            net, reference, pin = (record[part].strip() for part in ("net", "reference", "pin"))
            is_via = reference == "VIA"
            pad = f"{reference}-{pin}" if reference and not is_via else None
            marks.append(Mark(
                net=f"{UNUSED}{pad}" if net == "N/C" and pad else aliases.get(net, net),
                layer=None if record["access"] == "00" else int(record["access"]), x=int(record["x"]) * unit,
                y=int(record["y"]) * unit, source=MarkSource.IPC_D_356, pin=pad, is_via=is_via,
                drill=int(record["drill"]) * unit if record["drill"] else None,
            ))
    return tuple(mark for mark in marks if mark.net not in _NO_NET)


def read_marks(directory: Path, copper_files: tuple[Path, ...]) -> tuple[Mark, ...]:
    """Return all marks of a board's files: attributes of the copper files, then netlists found in the directory."""
    marks = [
        mark
        for layer, path in enumerate(copper_files, start=1)
        for mark in marks_of_gerber(content_of(path).decode("utf-8"), layer)
    ]
    for path in sorted(directory.iterdir()):
        if path.is_file() and path not in copper_files:
            with path.open("rb") as stream:
                is_binary = stream.read(4).startswith(BINARY)
            if is_binary:  # an archive for the order, or a PDF, may contain the netlist's bytes
                continue
            text = content_of(path).decode("utf-8", errors="replace")
            if is_ipc_d_356(text):
                marks += marks_of_ipc_d_356(text)
    require_objects(len(marks))
    return tuple(marks)
