"""Settings of converters and firmware: drive codes, registers, serial port, and frequency bands of faultless boards.

Driver, self-test and test bench accept a coil if its frequency is inside its band.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from itertools import pairwise

from sitscad.assembly.places.state import FREE, PRESSED, REST, working_states
from sitscad.basics.record import record, replace
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate, StateEstimate
from sitscad.estimates.tolerances.scatter import CAPACITOR
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.registers import Register
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.materials import CellsSpec
from sitscad.spec.sensor import ReadoutSpec

SIGMAS_BELOW = 1.0
"""Margin of a coil's parallel resistance when the drive code is chosen, in standard deviations.

It keeps amplitudes below the largest permitted value. TI recommends the strongest drive code below this value, because
clamping is worse than noise (8.1.5; SNOA950). This advice is for one known sensor. The margin is for the scatter of
sensors still to be made.
"""


@record
class ParallelResistanceRange:
    """Parallel resistance (ohm) of a coil over its working states.

    `least` is the smallest value, `careful` the largest value plus its margin.
    """

    least: float
    careful: float


def with_drive_codes(
    coils: Sequence[CoilEstimate], readout: ReadoutEstimate, spec: ReadoutSpec
) -> tuple[tuple[CoilEstimate, ...], ReadoutEstimate]:
    """Return coils and readout settings for the final drive codes: the spec's code, or the strongest suitable code.

    A suitable code keeps each coil below the largest permitted amplitude in each working state, with a margin for its
    parallel resistance. The margin is the larger of one standard deviation and the change by the thickest copper that
    the fabricator delivers. All coils of a board share one foil and one plating, and no test of the board shows their
    thickness. All channels have one code, except in one case: this code leaves a coil below the low-noise window, and
    separate codes leave no coil below it.
    """
    if readout.drive_code is None or readout.high_current:
        return tuple(coils), readout
    converter = spec.device
    if spec.drive_code is not None:
        codes = (spec.drive_code,) * len(coils)
    else:
        by_coil = [[c.states[name] for name in working_states(c.states)] for c in coils]
        swings = [ParallelResistanceRange(min(state.parallel_resistance for state in states),
                                          max(map(_resistance_with_margin, states)))
                  for states in by_coil]
        codes = drive_codes(swings, converter)
    current, conversion = converter.drive_current(max(codes)), readout.conversion
    settings = replace(
        readout,
        drive_code=max(codes),
        drive_codes=codes if len(set(codes)) > 1 else (),
        drive_current=current,
        supply_current=(None if conversion is None
                        else converter.converter_count(len(coils)) * conversion.supply_current(current)),
    )
    louder = []
    for coil, code in zip(coils, codes, strict=True):
        ratio = converter.drive_current(code) / readout.drive_current
        states = {name: replace(
            state,
            amplitude=state.amplitude * ratio,
            coil_amplitude=None if state.coil_amplitude is None else state.coil_amplitude * ratio,
            spread=None if state.spread is None else replace(state.spread, amplitude=state.spread.amplitude * ratio),
        ) for name, state in coil.states.items()}
        louder.append(replace(coil, states=states))
    return tuple(louder), settings


def drive_codes(swings: Sequence[ParallelResistanceRange], converter: Converter) -> tuple[int, ...]:
    """Return the drive code of every channel, from its range of parallel resistance.

    Codes are equal, unless only separate codes bring the amplitudes of all coils above the lower end of the low-noise
    window. `swings` are the ranges of all channels, `converter` the device.
    """

    def reached(codes: Sequence[int]) -> bool:
        return all(converter.amplitude(swing.least, code) >= converter.limit("amplitude_optimum_min")
                   for code, swing in zip(codes, swings, strict=True))

    shared_codes = (converter.drive_code(max(swing.careful for swing in swings)),) * len(swings)
    channel_codes = tuple(converter.drive_code(swing.careful) for swing in swings)
    return channel_codes if reached(channel_codes) and not reached(shared_codes) else shared_codes


def _resistance_with_margin(state: StateEstimate) -> float:
    sigma = state.spread
    more = max(SIGMAS_BELOW * sigma.parallel_resistance, sigma.thickest_copper) if sigma is not None else 0.0
    return state.parallel_resistance + more


def bare_board_code(coils: Sequence[CoilEstimate], converter: Converter) -> int | None:
    """Return the strongest drive code that suits every coil of the bare board, without target and jaw.

    It keeps each coil below the largest permitted amplitude, with the margin of `SIGMAS_BELOW`. None if no coil has a
    finite parallel resistance in the free state.
    """
    resistances = [_resistance_with_margin(coil.states[FREE]) for coil in coils if FREE in coil.states]
    finite = [value for value in resistances if math.isfinite(value)]
    return converter.drive_code(max(finite)) if finite else None


@record
class Device:
    """One converter of the sensor, with its register values.

    `bus` is the number of its I2C bus (from 0), and `address` its 7-bit address. `coils` are the names of the coils on
    its channels, from channel 0. `registers` are in the order in which the firmware writes them.
    """

    bus: int
    address: int
    coils: tuple[str, ...]
    registers: tuple[Register, ...]


def devices(spec: ReadoutSpec, coils: tuple[CoilEstimate, ...], readout: ReadoutEstimate) -> tuple[Device, ...]:
    """Return the converters with their registers, ordered by bus and address. Coils are divided evenly among them.

    Raises ValueError if a setting is unknown or does not fit its field, or if the buses have too few addresses. Raises
    it also if sitscad has no registers of the converter's family.
    """
    converter = spec.device
    needed, most = converter.converter_count(len(coils)), spec.buses * len(converter.addresses)
    if needed > most:
        buses = "one I2C bus has" if spec.buses == 1 else f"{spec.buses} I2C buses have"
        raise ValueError(f"{needed} {converter.part} are needed, and {buses} addresses for {most}")
    conversion, code = readout.conversion, readout.drive_code
    if conversion is None or code is None:
        unknown = "conversion" if conversion is None else "drive_code"
        raise ValueError(f"{unknown} is unknown: the converter cannot be set up for this sensor")
    places, programmed = converter.coil_channels(len(coils)), []
    firsts = [k for k, at in enumerate(places) if at.number == 0]
    for first, end in pairwise([*firsts, len(coils)]):
        group = coils[first:end]
        frequencies = [state.frequency for coil in group for state in coil.states.values()]
        if not frequencies:
            raise ValueError("no sensor frequency is known: the converter cannot be set up")
        codes = readout.drive_codes[first:end] or (code,) * len(group)
        registers = conversion.registers(slice(first, end), codes, max(frequencies), readout.high_current)
        names = tuple(coil.name for coil in group)
        programmed.append(Device(places[first].bus, places[first].address, names, registers))
    return tuple(programmed)


BAUD_RATES = (115200, 500000, 1000000, 2000000)
"""Baud rates of the firmware's serial port. All are standard on Linux; all except the first divide a 16 MHz clock."""

MAX_LOAD = 0.9
"""Largest fraction of a serial port's capacity that readings may use."""


@record
class SerialSettings:
    """Baud rate of the firmware's serial port, and the number of scans of all coils after which it sends a line."""

    baud: int
    """Bits per second."""
    scans_per_line: int
    """Number of scans of all coils between two lines of text."""


def serial_settings(placements: tuple[CoilPlacement, ...], cells: CellsSpec | None, scan_rate: float) -> SerialSettings:
    """Return the lowest baud rate that carries a line of text for each scan (`scan_rate`, Hz).

    If no rate does, return the highest rate and the number of scans between two lines. A line of
    ``data/firmware/sensor_line.h`` has at most 26 characters, plus 12 for each coil and 11 for each force. A sensor
    without cells has three forces. A cell has at most as many forces as coils. Every hundredth line has a header of the
    same length. A character takes 10 bits.
    """
    coils = len(placements)
    forces = 3 if cells is None else coils // cells.coils * min(3, cells.coils)
    bits = 10.0 * 1.01 * (26 + 12 * coils + 11 * forces)
    needed = bits * scan_rate / MAX_LOAD
    baud = next((rate for rate in BAUD_RATES if rate >= needed), BAUD_RATES[-1])
    return SerialSettings(baud, max(math.ceil(needed / baud), 1))


def board_identity(sensor: str, programmed: Sequence[Device]) -> int:
    """Return a 32-bit number that identifies the board in its serial lines.

    Boards with equal sensor names, coils and register values have equal numbers. `programmed` are the converters with
    their registers.
    """
    rows = [(device.coils, [(int(row.address), int(row.value)) for row in device.registers]) for device in programmed]
    return zlib.crc32(repr((sensor, rows)).encode())


SIGMAS = 5.0  # Half width of a band, in standard deviations of manufacture: one sound coil in two million lies outside

LEAP = 8.0
"""Largest difference between two readings of a faultless coil at rest, in standard deviations of one reading.

Fewer than one in 1e7 pairs of readings differ by more.
"""

STATUS = ("good", "stale", "under range", "over range", "watchdog", "out of band", "amplitude")
"""Status texts of a coil's reading; the index is the driver's status number. The last status is only a warning."""


@record
class Band:
    """Frequency (Hz) of the design, and the lowest and highest frequency (Hz) of faultless manufactured coils."""

    design: float
    low: float
    high: float

    def fraction_above(self, limit: float) -> float:
        """Return the fraction of manufactured coils with a frequency above `limit` (Hz), for a normal distribution."""
        return 0.5 * math.erfc((limit - self.design) * SIGMAS / ((self.high - self.design) * math.sqrt(2.0)))


@record
class CoilBands:
    """Frequency bands of one coil: on the bare board, in the assembled sensor at rest, and in all states and loads.

    `working` covers loads up to 1.5 times the required force. `own_sigma` (Hz) is the standard deviation of the part of
    the frequency scatter that is independent for each coil of a board.
    """

    coil: str
    """Name of the coil."""
    bare: Band
    """Band without target and jaw."""
    assembled: Band
    """Band of the assembled sensor at rest."""
    working: Band
    own_sigma: float


def frequency_bands(coils: tuple[CoilEstimate, ...], own_inductance: float) -> tuple[CoilBands, ...]:
    """Return the frequency bands of every coil, `SIGMAS` standard deviations wide to either side.

    `own_inductance` is the relative standard deviation between the inductances of coils on one board. Raises ValueError
    if a coil has no states, or if the scatter of a frequency is unknown.
    """
    coil_bands = []
    for coil in coils:
        states = coil.states
        if not states:
            raise ValueError(f"no state of {coil.name} is known: there is no frequency to test it by")
        each = {name: _band(coil.name, state) for name, state in states.items()}
        first, last = next(iter(states)), list(states)[-1]
        free_band, assembled = each.get(FREE, each[first]), each.get(REST, each[last])
        rest, pressed = states.get(REST), states.get(PRESSED)
        beyond = 0.5 * (pressed.frequency - rest.frequency) if rest is not None and pressed is not None else 0.0
        low, high = min(band.low for band in each.values()), max(band.high for band in each.values())
        working = Band(assembled.design, low + min(beyond, 0.0), high + max(beyond, 0.0))
        state_sigma = states.get(REST, states[last]).spread
        capacitor = state_sigma.shifts.get(CAPACITOR, (0.0, 0.0))[1] if state_sigma is not None else 0.0
        frequency_sigma = math.hypot(capacitor, 0.5 * own_inductance * assembled.design)
        coil_bands.append(CoilBands(coil.name, free_band, assembled, working, frequency_sigma))
    return tuple(coil_bands)


def _band(coil: str, state: StateEstimate) -> Band:
    if state.spread is None:
        raise ValueError(f"the scatter of {coil} is not known: there is no band to test it by")
    width = SIGMAS * state.spread.frequency
    return Band(state.frequency, state.frequency - width, state.frequency + width)
