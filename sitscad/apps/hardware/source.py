"""Sources of readings: a simulated board, converters on a Linux computer's I2C bus, or lines on a serial port."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import numpy as np

from sitscad.apps.hardware.ambient import Ambient, parse_ambient, warmed_frequencies
from sitscad.apps.hardware.bench_board import Board, BusConverter, LineBoard, Port
from sitscad.apps.hardware.converter import LONGEST, SimulatedConverter
from sitscad.assembly.places.motions import motion_number
from sitscad.calibration.calibration import simulated_sensors
from sitscad.calibration.unknowns import draw_units
from sitscad.estimates.circuits.settings import BAUD_RATES, devices, serial_settings
from sitscad.estimates.design import Cells, Design
from sitscad.estimates.loads.working_range import required_range
from sitscad.estimates.performance_values import AXES, FORCES
from sitscad.estimates.requested_response import respond
from sitscad.spec.load import load

SIMULATED, BUS, SERIAL = "sim:", "/dev/i2c-", "serial:"
RAMP = 33
"""Number of loads on a ramp for which readings are computed. Readings between them are interpolated linearly."""

BEGUN = 0.02
"""Time (s) until converters are set up and the first scan has begun."""

KEYS = ("load", "seconds", "fault", "state", "seed", "unit", "cell", "temperature")
SEVERAL = ("load", "fault")
"""Names of all options of a simulated source (`KEYS`), and of the options that may be repeated (`SEVERAL`)."""

SHORTEST = 1e-3  # Shortest reading of a simulated board (s)
"""Shortest duration (s) of readings from a simulated board."""
MOST_BAUD = 100_000_000  # Bits per second, above every serial port
"""Largest accepted baud rate (bits per second). It exceeds the rate of every serial port."""
MOST_SEED = 2**32 - 1  # Largest seed or unit number: 32 bits
"""Largest accepted seed or sensor number: 32 bits."""


class Source:
    """Converters in the order of their numbers, with a clock."""

    creep, paced = 10.0, True
    """`creep` is the time (s) to wait under a load before a calibration point is read, because the pad creeps.

    `paced` is True if waiting takes real time.
    """

    def __init__(self, chips: Sequence[BusConverter], seconds: float | None = None) -> None:
        self.chips, self.seconds, self._begun = chips, seconds, time.monotonic()

    def board(self, design: Design) -> Board:
        """Return the board of a design with these converters."""
        return Board(design, self.chips)

    def now(self) -> float:
        """Return the time (s) since the start."""
        return time.monotonic() - self._begun

    def wait(self, seconds: float) -> None:
        """Wait for this time (s)."""
        time.sleep(seconds)

    def skip(self, seconds: float) -> None:
        """Wait for this time (s). Results in this time are not needed."""
        self.wait(seconds)

    def celsius(self, when: float) -> float:
        """Return the temperature (degrees Celsius) by the design's temperature sensor at a time (s). NaN if unknown."""
        return math.nan


class Simulation(Source):
    """Simulated converters of a design with a common clock.

    `errors` holds the manufacturing errors of each cell, or None for a nominal cell. A sensor without cells counts as a
    single cell. `course` is the ambient temperature. If None, it is the temperature of the requirements.
    """

    chips: Sequence[SimulatedConverter]
    creep = 0.0
    is_real_time = False

    def __init__(
        self, design: Design, chips: Sequence[SimulatedConverter], seconds: float | None = None,
        errors: Sequence[np.ndarray | None] = (None,), course: Ambient | None = None,
    ) -> None:
        super().__init__(chips, seconds)
        self.design, self.errors, self.course = design, errors, course

    def apply_load(self, load: np.ndarray, is_held: bool, cell: int = 1) -> None:
        """Apply a load (3; N) to the target of a cell (number from 1) from now on. Other cells are unloaded.

        `is_held` is True if the load keeps the target level.
        """
        loads = np.atleast_2d(load)
        read = _cell_frequencies(self.design.cells, cell, loads, self.errors, is_held)
        if self.course is not None:
            read = warmed_frequencies(self.design.cells, read, loads, np.array([self.now()]), self.course, cell)
        for chip in self.chips:
            chip.hold(read)

    def now(self) -> float:
        """Return the simulated time (s) of the most advanced converter.

        The other converters are advanced to this time.
        """
        latest = max(chip.time for chip in self.chips)
        for chip in self.chips:
            chip.advance(latest - chip.time)
        return latest * 1e-9

    def wait(self, seconds: float) -> None:
        """Advance the simulated time, in real time if `is_real_time`."""
        for chip in self.chips:
            chip.advance(round(seconds * 1e9))
        if self.is_real_time:
            time.sleep(max(0.0, self.now() - (time.monotonic() - self._begun)))

    def skip(self, seconds: float) -> None:
        """Advance the simulated time without conversions. In real time, conversions go on."""
        if self.is_real_time:
            self.wait(seconds)
            return
        for chip in self.chips:
            chip.pause(round(seconds * 1e9))

    def celsius(self, when: float) -> float:
        """Return the temperature (degrees Celsius) by the design's temperature sensor at a time (s).

        It has the steps of a digital sensor, and no errors. NaN without a temperature sensor in the design.
        """
        sensor = self.design.spec.readout.thermistor
        if sensor is None:
            return math.nan
        celsius = self.design.estimates.temperature
        if self.course is not None:
            celsius = float(self.course.board(np.array([when]))[0])
        registers = sensor.part.registers
        return celsius if registers is None else registers.scale * round(celsius / registers.scale)


class WiredConverter:
    """A converter on an I2C bus of a Linux computer."""

    def __init__(self, bus: Any, address: int) -> None:
        self.bus, self.address = bus, address

    def read(self, register: int) -> int:
        """Return the 16 bits of a register."""
        upper, lower = self.bus.read_i2c_block_data(self.address, register, 2)
        return int(upper) << 8 | int(lower)

    def write(self, register: int, value: int) -> None:
        """Write 16 bits to a register."""
        self.bus.write_i2c_block_data(self.address, register, [value >> 8, value & 0xFF])


class SerialLine(Source):
    """A microcontroller on a serial port, which sends readings as lines."""

    def __init__(self, port: Port) -> None:
        super().__init__(())
        self.port = port

    def board(self, design: Design) -> LineBoard:
        """Return the board of a design whose readings arrive on this port.

        The clock starts at the first reading. Raises OSError if no reading arrives.
        """
        board = LineBoard(design, self.port)
        board.wait_for_first_reading()
        self._begun = time.monotonic()
        return board


def read_design(path: str) -> Design:
    """Return the design of a spec file, or of the package in a folder.

    Raises SpecError or OSError if the spec cannot be read, and ValueError if the folder does not contain exactly one
    spec.
    """
    place = Path(path)
    if place.is_dir():
        specs = sorted((place / "spec").glob("*.yaml"))
        if len(specs) != 1:
            raise ValueError(f"{path} is no package: there is no one spec in its folder spec/")
        place = specs[0]
    return Design(load(place))


def open_source(text: str, design: Design | None, tares: int = 0) -> tuple[Source, Design]:
    """Return the source that a text describes, and the design for its readings.

    On a simulated board, the loads begin after `tares` scans without load. Raises ValueError for other texts, and for
    options that do not belong to the source.
    """
    if text.startswith(SIMULATED):
        path, _, query = text.removeprefix(SIMULATED).partition("?")
        if not path:
            raise ValueError("sim: names no spec: sim:sensor.yaml, or sim: and the folder of a package")
        simulated = read_design(path)
        if design is not None and simulated.spec == design.spec:
            simulated = design  # share its cached results
        return _simulated_board(simulated, query, tares), design or simulated
    if design is None:
        raise ValueError("--design says which design the board is of")
    if text.startswith((BUS, SERIAL)) and not design.spec.readout.device.has_driver:
        raise ValueError(f"{text} cannot be read: sitscad has no driver for {design.spec.readout.device.part} (for "
                         "LDC1612 and LDC1614 it has one); firmware/ of its package has the settings")
    if text.startswith(BUS):
        try:
            import smbus2
        except ImportError as error:
            raise ValueError(f"{text} needs smbus2: pip install 'sitscad[bench]' brings it") from error
        places = devices(design.spec.readout, design.estimates.all_coils, design.estimates.readout)
        paths = text.split(",")
        if len(paths) != places[-1].bus + 1:
            raise ValueError(f"{text}: the converters are on {places[-1].bus + 1} buses (two: /dev/i2c-1,/dev/i2c-3)")
        buses = [smbus2.SMBus(path) for path in paths]
        return Source([WiredConverter(buses[each.bus], each.address) for each in places]), design
    if text.startswith(SERIAL):
        estimates = design.estimates
        baud = serial_settings(design.spec.all_placements, design.spec.cells, estimates.readout.scan_rate).baud
        return SerialLine(_serial_port(text, baud)), design
    raise ValueError(
        f"{text!r} is no source: sim:SPEC?load=normal:0:5&seconds=2&fault=open:C2, /dev/i2c-N (of two buses with a "
        "comma between), "
        f"or serial:PORT?baud={BAUD_RATES[0]}"
    )


def _serial_port(text: str, baud: int) -> Port:
    """Return the serial port that a text describes, with the baud rate from its ``?baud=``, or else `baud`.

    Raises ValueError if pyserial is not installed, and OSError if the port cannot be opened.
    """
    try:
        import serial
    except ImportError as error:
        raise ValueError(f"{text} needs pyserial: pip install 'sitscad[bench]' brings it") from error
    path, _, query = text.removeprefix(SERIAL).partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    rate = options.get("baud", str(baud))
    if set(options) - {"baud"} or not (rate.isdecimal() and 0 < int(rate) <= MOST_BAUD):
        raise ValueError(f"serial:PORT takes ?baud={baud}, a whole number up to {MOST_BAUD}, and nothing else, not "
                         f"{query!r}")
    port: Port = serial.Serial(path, int(rate), timeout=0.05)
    return port


def _simulated_board(design: Design, query: str, tares: int) -> Simulation:
    """Return a simulated board with the options in `query`.

    `load` is AXIS:FIRST:LAST (N), with commas between several axes. It changes linearly over `seconds`, after `tares`
    scans without load. `fault` may be repeated. `unit` is the number of a sensor with random manufacturing errors;
    without it, the sensor is nominal. `cell` is the cell under the load. `temperature` is as for `ambient`. `state` and
    `seed` are as for `SimulatedConverter`.
    """
    pairs = parse_qsl(query, keep_blank_values=True)
    options = dict(pairs)
    for key in options:
        if key not in KEYS:
            raise ValueError(f"sim: {key} is none of {', '.join(KEYS)}")
        if key not in SEVERAL and sum(name == key for name, _ in pairs) > 1:
            raise ValueError(f"sim: {key} is given twice")
    for other in ("unit", "load", "cell", "temperature"):
        if "state" in options and other in options:
            raise ValueError(f"sim: with {other} a sensor is assembled: {other} and state do not go together")
    numbers = {key: _number_in_range(f"{key}={options.get(key, usual)}", least, most, is_whole)
               for key, usual, least, most, is_whole in (
                   ("seconds", 1.0, SHORTEST, LONGEST, False), ("seed", 1, 0, MOST_SEED, True),
                   ("unit", 0, 0, MOST_SEED, True), ("cell", 1, 1, len(design.cells), True))}
    seconds = numbers["seconds"]
    course = parse_ambient(options["temperature"], seconds) if "temperature" in options else None
    if course is not None and "seconds" not in options:
        seconds = min(max(float(course.times[-1]), SHORTEST), LONGEST)
    rate = design.estimates.readout.scan_rate
    before = BEGUN + (tares + 1) / rate if tares and rate else 0.0
    times = np.linspace(before, before + seconds, RAMP)
    loads = np.column_stack([times, _load_ramps(value for name, value in pairs if name == "load")])
    if "load" not in options or not required_range(design.cells.by_number(1).spec).has_moments:
        if np.any(loads[:, 1 + len(FORCES) :]):
            raise ValueError("sim: load of a moment: the target is taken as kept level; requirements.moment_x and "
                             "moment_y ask for one that is free to tilt")
        loads = loads[:, : 1 + len(FORCES)]
    if before:
        none = np.zeros((2, loads.shape[1]))
        none[1, 0] = before - 1e-6
        loads = np.vstack([none, loads])
    if course is not None:
        course = Ambient(course.times + before, course.celsius)
        times = np.unique(np.clip(np.concatenate([loads[:, 0], course.times]), 0.0, before + seconds))
        loads = np.column_stack([times, *(np.interp(times, loads[:, 0], column) for column in loads[:, 1:].T)])
    number = design.spec.readout.device.converter_count(len(design.estimates.all_coils))
    faults = [value for name, value in pairs if name == "fault"]
    if "load" in options and "cell" not in options and len(design.cells) > 1:
        raise ValueError(f"sim: a load is on one of the {len(design.cells)} cells: say on which, like cell=1")
    errors: list[np.ndarray | None] = [None] * len(design.cells)
    if "unit" in options:  # each cell of a unit has its own errors
        errors = [draw_units(simulated_sensors(cell.response).unknowns, len(design.cells), int(numbers["unit"]))[k]
                  for k, cell in enumerate(design.cells)]
    read = None
    if "cell" in options or "unit" in options or course is not None:
        read = _cell_frequencies(design.cells, int(numbers["cell"]), loads[:, 1:], errors)
    if course is not None and read is not None:
        read = warmed_frequencies(design.cells, read, loads[:, 1:], loads[:, 0], course, int(numbers["cell"]))
    chips = [
        SimulatedConverter(
            design, loads=loads if "load" in options or read is not None else None, faults=faults,
            frequencies=read,
            state=options.get("state", "rest"), number=k, seed=int(numbers["seed"]) + k,
        )
        for k in range(number)
    ]
    return Simulation(design, chips, before + seconds, errors, course)


def _load_ramps(texts: Iterable[str]) -> np.ndarray:
    """Return loads (`RAMP`, 5) that change linearly from the first to the last value of each axis.

    The columns are normal, shear_x and shear_y (N), moment_x and moment_y (N m). Each text is AXIS:VALUE or
    AXIS:FIRST:LAST, with commas between axes. Forces are in N, moments in N mm. Raises ValueError for another text, and
    for an axis that occurs twice.
    """
    loads, axes_set = np.zeros((RAMP, len(AXES))), set()
    for part in (part for text in texts for part in text.split(",")):
        axis, *ends = part.split(":")
        if axis not in AXES or len(ends) not in (1, 2):
            raise ValueError(
                f"load is AXIS:NEWTONS or AXIS:FIRST:LAST with {', '.join(AXES)} (moments in N mm), of several "
                f"axes with a comma between (load=normal:5,shear_x:2), not {part!r}"
            )
        if axis in axes_set:
            raise ValueError(f"load says twice what {axis} is")
        axes_set.add(axis)
        first, last = motion_number(axis, ends[0]), motion_number(axis, ends[-1])
        if axis == "normal" and min(first, last) < 0.0:
            raise ValueError(f"load={part}: a normal force presses towards the board, 0 or more")
        loads[:, AXES.index(axis)] = np.linspace(first, last, RAMP)
    return loads


def _number_in_range(option: str, least: float, most: float, is_whole: bool) -> float:
    """Return the number in the option text KEY=NUMBER. Raises ValueError if it is not between `least` and `most`."""
    try:
        value = (int if is_whole else float)(option.partition("=")[2])
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        kind = "whole number" if is_whole else "number"
        raise ValueError(f"sim: {option}: a {kind} from {least:g} to {most:.10g} is wanted")
    return value


def _cell_frequencies(
    cells: Cells, number: int, loads: np.ndarray, errors: Sequence[np.ndarray | None], is_held: bool = True
) -> np.ndarray:
    """Return the frequencies (n, coils; Hz) of all coils under loads (n, 3 or 5) on cell number `number` (from 1).

    The columns of the loads are the normal force, shear along x and y (N), and two moments (N m) if given. The other
    cells are not loaded, and crosstalk between cells is neglected. `errors` are the manufacturing errors of each cell,
    or None for a nominal cell.
    """
    nothing = np.zeros((1, loads.shape[1]))
    is_held = is_held and loads.shape[1] == len(FORCES)  # with moments, the target is free to tilt
    parts = []
    for k, (cell, unit) in enumerate(zip(cells, errors, strict=True), 1):
        on_this = loads if k == number else nothing
        part = (respond(cell, loads=on_this, rotation="held" if is_held else "free").frequency if unit is None
                else simulated_sensors(cell.response, is_held).frequencies_under(unit, on_this, exact=True))
        parts.append(np.broadcast_to(part, (len(loads), part.shape[1])))
    return np.concatenate(parts, axis=1)
