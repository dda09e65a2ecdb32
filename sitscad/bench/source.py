"""Where readings come from: a simulated board, converters on a Linux computer's I2C bus, or lines on a serial port."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import numpy as np

from sitscad.bench.board import Board, BusConverter, LineBoard, Port
from sitscad.bench.converter import SimulatedConverter
from sitscad.calibration.calibration import sensors_of
from sitscad.calibration.unknowns import units
from sitscad.design import Design, respond
from sitscad.estimates.circuit.settings import BAUD_RATES, devices, serial_settings
from sitscad.estimates.performance.values import AXES
from sitscad.spec.load import load

SIMULATED, BUS, SERIAL = "sim:", "/dev/i2c-", "serial:"
LOAD = re.compile(rf"({'|'.join(AXES)}):(-?\d+\.?\d*)(?::(-?\d+\.?\d*))?")
RAMP = 33
"""Loads of a ramp that are solved; readings between are straight."""

BEGUN = 0.02
"""Seconds until converters are set up, and the first scan has begun."""


class Source:
    """Converters in the order of their numbers, and their clock."""

    creep, paced = 10.0, True
    """Seconds that a pad is given to come to rest under a load, before it is read for a calibration."""

    def __init__(self, chips: Sequence[BusConverter], seconds: float | None = None) -> None:
        self.chips, self.seconds, self._begun = chips, seconds, time.monotonic()

    def board(self, design: Design) -> Board:
        """The board of a design with these converters."""
        return Board(design, self.chips)

    def now(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self._begun

    def wait(self, seconds: float) -> None:
        """Let time go by."""
        time.sleep(seconds)


class Simulation(Source):
    """Simulated converters of a design that keep one time; `unit` (unknowns) are the errors of the sensor that they
    read, None those of none: the sensor as it is drawn.
    """

    chips: Sequence[SimulatedConverter]
    creep = 0.0
    paced = False

    def __init__(
        self, design: Design, chips: Sequence[SimulatedConverter], seconds: float | None = None,
        unit: np.ndarray | None = None,
    ) -> None:
        super().__init__(chips, seconds)
        self.design, self.unit = design, unit

    def put_on(self, load: np.ndarray, is_held: bool) -> None:
        """Load (3; N) the target from now on."""
        read = _read_by(self.design, self.unit, np.atleast_2d(load), is_held)
        for chip in self.chips:
            chip.hold(read)

    def now(self) -> float:
        """Seconds of the simulated clock: of the converter that is farthest on, to which the others catch up."""
        latest = max(chip.time for chip in self.chips)
        for chip in self.chips:
            chip.advance(latest - chip.time)
        return latest * 1e-9

    def wait(self, seconds: float) -> None:
        """Let simulated time go by, no faster than the true one where it is `paced`."""
        for chip in self.chips:
            chip.advance(round(seconds * 1e9))
        if self.paced:
            time.sleep(max(0.0, self.now() - (time.monotonic() - self._begun)))


class Wired:
    """A converter on a bus of Linux."""

    def __init__(self, bus: Any, address: int) -> None:
        self.bus, self.address = bus, address

    def read(self, register: int) -> int:
        """A register's 16 bits."""
        upper, lower = self.bus.read_i2c_block_data(self.address, register, 2)
        return int(upper) << 8 | int(lower)

    def write(self, register: int, value: int) -> None:
        """Write 16 bits."""
        self.bus.write_i2c_block_data(self.address, register, [value >> 8, value & 0xFF])


class SerialLine(Source):
    """A microcontroller on a serial port."""

    def __init__(self, port: Port) -> None:
        super().__init__(())
        self.port = port

    def board(self, design: Design) -> LineBoard:
        """The board of a design whose readings come over this line; time begins with the first of them. Raises OSError
        where none comes.
        """
        found = LineBoard(design, self.port)
        found.begin()
        self._begun = time.monotonic()
        return found


def design_of(path: str) -> Design:
    """The design of a spec, or of the package in a folder. Raises SpecError, OSError, and ValueError where the folder
    has no spec.
    """
    place = Path(path)
    if place.is_dir():
        found = sorted((place / "spec").glob("*.yaml"))
        if len(found) != 1:
            raise ValueError(f"{path} is no package: there is no one spec in its folder spec/")
        place = found[0]
    return Design(load(place))


def source_of(text: str, design: Design | None, tares: int = 0) -> tuple[Source, Design]:
    """The source that a text names, and the design that it is read by; the loads of a simulated board begin after so
    many scans without load. Raises ValueError for others and for what goes with none of them.
    """
    if text.startswith(SIMULATED):
        path, _, query = text.removeprefix(SIMULATED).partition("?")
        if not path:
            raise ValueError("sim: names no spec: sim:sensor.yaml, or sim: and the folder of a package")
        own = design_of(path)
        if design is not None and own.spec == design.spec:
            own = design  # what is worked out of it is worked out once
        return _simulated(own, query, tares), design or own
    if design is None:
        raise ValueError("--design says which design the board is of")
    if text.startswith((BUS, SERIAL)) and not design.converter.has_driver:
        raise ValueError(f"{text} cannot be read: sitscad has no driver for {design.converter.part} (for LDC1612 and "
                         "LDC1614 it has one); firmware/ of its package has the settings")
    if text.startswith(BUS):
        try:
            import smbus2
        except ImportError as error:
            raise ValueError(f"{text} needs smbus2: pip install 'sitscad[bench]' brings it") from error
        wanted, paths = devices(design.spec.readout, design.estimates), text.split(",")
        if len(paths) != wanted[-1].bus + 1:
            raise ValueError(f"{text}: the converters are on {wanted[-1].bus + 1} buses (two: /dev/i2c-1,/dev/i2c-3)")
        buses = [smbus2.SMBus(path) for path in paths]
        return Source([Wired(buses[one.bus], one.address) for one in wanted]), design
    if text.startswith(SERIAL):
        estimates = design.estimates
        baud = serial_settings(len(estimates.coils), estimates.readout.scan_rate).baud
        return SerialLine(_port(text, baud)), design
    raise ValueError(
        f"{text!r} is no source: sim:SPEC?load=normal:0:5&seconds=2&fault=open:C2, /dev/i2c-N (of two buses with a "
        "comma between), "
        f"or serial:PORT?baud={BAUD_RATES[0]}"
    )


def _port(text: str, baud: int) -> Port:
    """The serial port that a source names, at `baud` unless it says another. Raises ValueError without pyserial and
    OSError if the port does not open.
    """
    try:
        import serial
    except ImportError as error:
        raise ValueError(f"{text} needs pyserial: pip install 'sitscad[bench]' brings it") from error
    path, _, query = text.removeprefix(SERIAL).partition("?")
    given = dict(parse_qsl(query, keep_blank_values=True))
    if set(given) - {"baud"} or not given.get("baud", "1").isdigit():
        raise ValueError(f"serial:PORT takes ?baud={baud} and nothing else, not {query!r}")
    port: Port = serial.Serial(path, int(given.get("baud", baud)), timeout=0.05)
    return port


def _simulated(design: Design, query: str, tares: int) -> Simulation:
    """A simulated board: `load` is AXIS:FIRST:LAST (N), of several axes with commas between, over `seconds` after so
    many scans without load; `fault` may come several times; `unit` is the number of a sensor as it is made, left out
    the one as drawn; `cell` is that of its cells which a load is on; `state` and `seed` as for `SimulatedConverter`.
    """
    pairs = parse_qsl(query, keep_blank_values=True)
    given = dict(pairs)
    unknown = set(given) - {"load", "seconds", "fault", "state", "seed", "unit", "cell"}
    if unknown:
        raise ValueError(f"sim: {min(unknown)} is none of load, seconds, fault, state, seed, unit, cell")
    if "state" in given and "unit" in given:
        raise ValueError("sim: a unit is assembled: unit and state do not go together")
    seconds = float(given.get("seconds", 1.0))
    rate = design.estimates.readout.scan_rate
    before = BEGUN + (tares + 1) / rate if tares and rate else 0.0
    times = np.linspace(before, before + seconds, RAMP)
    loads = np.column_stack([times, _ramps(value for name, value in pairs if name == "load")])
    if before:
        loads = np.vstack([[0.0] * 4, [before - 1e-6, 0.0, 0.0, 0.0], loads])
    number = design.converter.needed(len(design.estimates.coils))
    faults = [value for name, value in pairs if name == "fault"]
    if "load" in given and "cell" not in given and design.cells > 1:
        raise ValueError(f"sim: a load is on one of the {design.cells} cells: say on which, like cell=1")
    seed, unit, read = int(given["unit"]) if "unit" in given else None, None, None
    if "cell" in given or (seed is not None and design.cells > 1):
        read = _on_cell(design, int(given.get("cell", 1)), loads[:, 1:], seed)
    elif seed is not None:
        unit = units(sensors_of(design.response).known, 1, seed)[0]
        read = _read_by(design, unit, loads[:, 1:])
    chips = [
        SimulatedConverter(
            design, loads=loads if "load" in given or read is not None else None, faults=faults,
            frequencies=read,
            state=given.get("state", "rest"), number=k, seed=int(given.get("seed", 1)) + k,
        )
        for k in range(number)
    ]
    return Simulation(design, chips, before + seconds, unit)


def _ramps(texts: Iterable[str]) -> np.ndarray:
    """Loads (`RAMP`, 3; N) of texts of AXIS:NEWTONS or AXIS:FIRST:LAST, several of them in one with commas between.
    Raises ValueError for what is none, and for an axis that comes twice.
    """
    loads, known = np.zeros((RAMP, len(AXES))), set()
    for one in (one for text in texts for one in text.split(",")):
        found = LOAD.fullmatch(one)
        if found is None:
            raise ValueError(
                f"load is AXIS:NEWTONS or AXIS:FIRST:LAST with {', '.join(AXES)}, of several axes with a comma between "
                f"(load=normal:5,shear_x:2), not {one!r}"
            )
        axis, first, last = found.groups()
        if axis in known:
            raise ValueError(f"load says twice what {axis} is")
        known.add(axis)
        loads[:, AXES.index(axis)] = np.linspace(float(first), float(last or first), RAMP)
    return loads


def _on_cell(design: Design, number: int, loads: np.ndarray, seed: int | None = None) -> np.ndarray:
    """Frequencies (Hz; n, coils) under loads (n, 3; N) on one cell, nothing on the others, whose crosstalk is left out:
    of the sensor as drawn, or of a unit, each of whose cells has errors of its own. Raises ValueError for a number that
    the sensor has not.
    """
    design.cell(number)
    nothing, cells = np.zeros((1, 3)), [design.cell(k) for k in range(1, design.cells + 1)]
    errors = [None if seed is None else units(sensors_of(cell.response).known, len(cells), seed)[k]
              for k, cell in enumerate(cells)]
    each = [_read_by(cell, errors[k], loads if k == number - 1 else nothing) for k, cell in enumerate(cells)]
    return np.concatenate([np.broadcast_to(one, (len(loads), one.shape[1])) for one in each], axis=1)


def _read_by(design: Design, unit: np.ndarray | None, loads: np.ndarray, is_held: bool = True) -> np.ndarray:
    """Frequencies (Hz; n, coils) under loads (n, 3; N): of a unit with its errors, or of the sensor as drawn."""
    if unit is None:
        return np.asarray(respond(design, loads=loads, rotation="held" if is_held else "free").frequency)
    return np.asarray(sensors_of(design.response, is_held).under(unit, loads, exact=True))
