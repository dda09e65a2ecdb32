"""The sensor's driver: common C files, the tables that differ between sensors, and the readme."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence

from sitscad.assembly.places.state import REST
from sitscad.basics.quantities import FREQUENCY
from sitscad.basics.units import show
from sitscad.calibration.unknowns import usual_value
from sitscad.data import FOLDER
from sitscad.estimates.circuits.settings import (
    LEAP,
    SIGMAS,
    Band,
    CoilBands,
    Device,
    bare_board_code,
    board_identity,
    frequency_bands,
    serial_settings,
)
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates, MeterReadings, ReadoutEstimate
from sitscad.estimates.tolerances.scatter import ACCEPTED_SIGMAS
from sitscad.files.documents.firmware_temperature import (
    is_compensated,
    python_temperature,
    temperature_macros,
    temperature_steps,
)
from sitscad.files.drawing.frame import FORCED
from sitscad.files.formats.calibration_header import cells_header
from sitscad.files.order_facts.board_end import socket_pad
from sitscad.files.order_facts.notes import hanging
from sitscad.files.writer import comment_text, is_felt
from sitscad.kernels.converters.conversion import Conversion, ConverterPart
from sitscad.kernels.converters.converter import Channel, Converter
from sitscad.kernels.converters.ldc_registers import WATCHDOG_RECOVERY
from sitscad.kernels.converters.reference_counter import REGISTER_BITS
from sitscad.layout.board import Layout, Pad
from sitscad.layout.tail.tracks import CONTROLLER, Contact, contacts
from sitscad.spec.circuit import Tail
from sitscad.spec.materials import CellsSpec
from sitscad.spec.sensor import ReadoutSpec, SensorSpec


def addr_pin_text(converter: Converter, address: int) -> str:
    """Return the level of the converter's ADDR pin that selects an I2C address, or the line to which it is tied."""
    net = converter.address_net(address)
    return {"GND": "low", "VDD": "high"}.get(net, f"to {net}")


def driver_files(
    spec: SensorSpec, estimates: Estimates, devices: Sequence[Device], forced: bool = False
) -> dict[str, str]:
    """Return the driver's files by path; empty for a converter without a driver.

    Raises ValueError if the sensor has no frequency bands for its self-test.
    """
    conversion = estimates.readout.conversion
    if not spec.readout.device.has_driver or conversion is None:
        return {}
    coil_bands = frequency_bands(estimates.all_coils, usual_value("coil_inductance"))
    folder = FOLDER / "firmware"
    files = {
        f"firmware/{path.relative_to(folder).as_posix()}": path.read_text(encoding="ascii")
        for path in sorted(folder.rglob("*"))
        if path.is_file() and (path.stem != "thermometer" or spec.readout.thermistor is not None)
    }
    files["firmware/sensor_config.h"] = _sensor_config(spec, estimates, devices, coil_bands, conversion, forced)
    if spec.cells is not None:
        files["firmware/cells.h"] = cells_header(len(spec.cell_placements), is_compensated(spec))
    reference = None if estimates.reference is None else len(estimates.coils)
    tables = _python_config(spec.name, spec.readout.device, devices, coil_bands, conversion, reference, forced)
    tables += python_temperature(spec.readout.thermistor, is_compensated(spec))
    files["firmware/micropython/sensor_config.py"] = tables
    return files


def _counts(band: Band, conversion: Conversion) -> tuple[int, ...]:
    """Return (design value, lowest, highest) of a frequency band in counts, limited to the converter's range."""
    scale, most = 1.0 / conversion.hertz_per_count, 2**conversion.device.bits - 2
    return tuple(min(max(round(value * scale), 1), most) for value in (band.design, band.low, band.high))


def exchange_threshold(coil_bands: Sequence[CoilBands]) -> float:
    """Return the least frequency difference (Hz) at which the self-test detects that two coils are exchanged.

    It is five standard deviations of the frequency difference of two coils. The two coils with the largest `own_sigma`
    determine it for all pairs.
    """
    widest = sorted(band.own_sigma for band in coil_bands)[-2:]
    return 5.0 * math.hypot(*widest)


def _sensor_config(
    spec: SensorSpec, estimates: Estimates, devices: Sequence[Device], coil_bands: Sequence[CoilBands],
    conversion: Conversion, forced: bool,
) -> str:
    """Return ``sensor_config.h``: sizes, and initial values of the tables in ``sensor.c``."""
    readout, scale = estimates.readout, 1.0 / conversion.hertz_per_count
    places = spec.readout.device.coil_channels(len(coil_bands))
    scan = 1.0 / readout.scan_rate if readout.scan_rate else 0.0
    serial = serial_settings(spec.all_placements, spec.cells, readout.scan_rate or 0.0)
    waited = _self_test_time(len(coil_bands), readout.scan_rate)
    register = REGISTER_BITS / conversion.device.limit("serial_clock_max")
    full_scale = conversion.hertz_per_count * 2.0**conversion.count_bits
    rows = [
        f"{{{number}u, 0x{register.address:02X}u, 0x{register.value:04X}u}}, /* {register.name} */"
        for number, device in enumerate(devices)
        for register in device.registers
    ]
    return "\n".join([
        "/*",
        *([f" * {FORCED}."] if forced else []),
        f" * The sensor {_without_delimiters(spec.name)}: what its driver (sensor.c) knows of it.",
        *([f" * {spec.issue.title}."] if spec.issue.rows else []),
        f" * Counts are f_SENSOR / {full_scale:.9g} Hz * 2^{conversion.count_bits}.",
        " */",
        "#ifndef SENSOR_CONFIG_H", "#define SENSOR_CONFIG_H", "",
        f"#define SENSOR_NAME {json.dumps(_without_delimiters(spec.name), ensure_ascii=True)}",
        f"#define SENSOR_ID 0x{board_identity(spec.name, devices):08X}u /* of the name, the coils and the settings */",
        f"#define SENSOR_COILS {len(coil_bands)}",
        *_cell_macros(spec.cells, len(estimates.coils)),
        *([f"#define SENSOR_REFERENCE {len(estimates.coils)} /* the coil without a target; no map reads it */"]
          if estimates.reference is not None else []),
        *temperature_macros(spec.readout.thermistor, is_compensated(spec), readout.scan_rate * len(coil_bands)),
        f"#define SENSOR_CONVERTERS {len(devices)}",
        f"#define SENSOR_BUSES {devices[-1].bus + 1}",
        f"#define SENSOR_HZ_PER_COUNT {1.0 / scale:.9e}f",
        f"#define SENSOR_SCAN_US {round(scan * 1e6)}u /* a scan of all coils */",
        f"#define SENSOR_POLLS {math.ceil(waited / register)}u /* at 400 kHz they take longer than four scans */",
        f"#define SENSOR_BAUD {serial.baud} /* bits per second of the serial port */",
        f"#define SENSOR_LINE_EVERY {serial.scans_per_line} /* scans of all coils for each line of text */",
        f"#define SENSOR_WAKE_MS {_wake_time(conversion.device)} /* milliseconds from SD low to the first answer */",
        f"#define SENSOR_UNLIKE {round(exchange_threshold(coil_bands) * scale)}u /* designs so far apart are told "
        "apart */",
        "#define SENSOR_BUS_OF {" + ", ".join(f"{device.bus}u" for device in devices) + "} /* of a converter */",
        "#define SENSOR_ADDRESSES {" + ", ".join(f"0x{device.address:02X}u" for device in devices) + "}",
        "",
        "/* Converter (from 0), register, value: in the order of writing. */",
        *_macro("SENSOR_SETTINGS", rows),
        "",
        "/* Name, converter, channel; lowest and highest counts in any state and under any load; by what a result may",
        " * leap unconfirmed; counts of the design, lowest and highest of manufacture: bare, assembled. */",
        *_macro("SENSOR_COIL_TABLE",
                [_coil(at, band, conversion) for at, band in zip(places, coil_bands, strict=True)]),
        "",
        "/* For simulated converters: converter, channel, tank as drawn, assembled (Hz, ohm); its noise. */",
        f"#define SENSOR_CHANNELS {spec.readout.device.channels}u",
        f"#define SENSOR_CLOCK_HZ {spec.readout.clock:.9e}",
        f"#define SENSOR_NOISE_STEPS {spec.readout.device.limit('noise_steps')!r}",
        *_macro("SENSOR_TANKS", [_tank(at, coil) for at, coil in zip(places, estimates.all_coils, strict=True)]),
        "", "#endif", "",
    ])


def _cell_macros(cells: CellsSpec | None, coils: int) -> list[str]:
    """Return macros for the numbers of cells and of their coils; a sensor without cells counts as one cell."""
    each = coils if cells is None else cells.coils
    return [
        *(["#define SENSOR_HAS_CELLS /* a map for each, which cells.h includes */"] if cells is not None else []),
        f"#define SENSOR_CELLS {coils // each}",
        f"#define SENSOR_CELL_COILS {each} /* of a cell */",
    ]


def _coil(place: Channel, frequencies: CoilBands, conversion: Conversion) -> str:
    _, low, high = _counts(frequencies.working, conversion)
    leap = math.ceil(LEAP * conversion.noise(frequencies.assembled.design) * (1.0 / conversion.hertz_per_count))
    states = ", ".join(
        "{" + ", ".join(f"{value}u" for value in _counts(band, conversion)) + "}"
        for band in (frequencies.bare, frequencies.assembled)
    )
    where = f"{place.converter}u, {place.number}u"
    return f'{{"{_without_delimiters(frequencies.coil)}", {where}, {low}u, {high}u, {leap}u, {{{states}}}}},'


def _tank(place: Channel, coil: CoilEstimate) -> str:
    """Return a coil's C initialiser: converter, channel, frequency (Hz) and parallel resistance (ohm).

    The values belong to the state at rest, or to the first state if there is no estimate at rest.
    """
    state = coil.states.get(REST) or next(iter(coil.states.values()))
    return f"{{{place.converter}, {place.number}, {state.frequency:.9e}, {state.parallel_resistance:.9e}}},"


def _python_config(
    name: str, converter: Converter, devices: Sequence[Device], coil_bands: Sequence[CoilBands], conversion: Conversion,
    reference: int | None, forced: bool,
) -> str:
    """Return ``sensor_config.py``: the tables for MicroPython. `reference` is the index of the reference coil."""
    lines = [f'"""The sensor {_without_delimiters(name)}: what sensor.py knows of it."""', ""]
    lines += [f"# {FORCED}."] if forced else []
    lines += ["# of every converter", "BUSES = (" + "".join(f"{device.bus}, " for device in devices).rstrip() + ")"]
    lines += ["ADDRESSES = (" + "".join(f"0x{device.address:02X}, " for device in devices).rstrip() + ")", ""]
    lines += ["# converter (from 0), register, value; in the order of writing", "SETTINGS = ("]
    lines += [
        f"    ({number}, 0x{register.address:02X}, 0x{register.value:04X}),  # {register.name}"
        for number, device in enumerate(devices)
        for register in device.registers
    ]
    lines += [
        ")",
        "",
        "# name, converter, channel, lowest and highest counts in any state and under any load",
        "COILS = (",
    ]
    for place, band in zip(converter.coil_channels(len(coil_bands)), coil_bands, strict=True):
        _, low, high = _counts(band.working, conversion)
        lines.append(f'    ("{_without_delimiters(band.coil)}", {place.converter}, {place.number}, {low}, {high}),')
    lines += [")", *([f"REFERENCE = {reference}  # the coil without a target"] if reference is not None else [])]
    lines += [f"HZ_PER_COUNT = {conversion.hertz_per_count!r}"]
    return "\n".join([*lines, f"WAKE_MS = {_wake_time(conversion.device)}  # from SD low to the first answer", ""])


def _self_test_time(coils: int, scan_rate: float) -> float:
    """Return the longest time (s) of a self-test at 400 kHz: four scans, and two restarts of each coil."""
    return (4.0 / scan_rate if scan_rate else 0.0) + 2 * coils * WATCHDOG_RECOVERY + 2e-3


def _wake_time(device: ConverterPart) -> int:
    """Return the time (ms, rounded up) from a low SD pin to the converter's first answer."""
    return math.ceil(1e3 * device.limit("wake_time"))


def _macro(name: str, rows: Sequence[str]) -> list[str]:
    return [f"#define {name} \\", "    { \\", *(f"        {row} \\" for row in rows), "    }"]


def _without_delimiters(text: str) -> str:
    """Return a text without characters that end a comment or a string of C."""
    return " ".join(comment_text(text).replace('"', "'").encode("ascii", "replace").decode().split())


WIDTH = 110
PINS = (
    ("VDD, GND", "supply 2.7 to 3.6 V (data sheet 6.3), 100 nF and 1 uF beside the pins; the die pad to GND, too"),
    ("SCL, SDA", "the I2C bus, at most 400 kHz, each with one pull-up resistor (2.2 to 4.7 kohm are usual)"),
    ("SD", "low: the converter works; high: it is shut down and loses all settings. Connect it to an output of the "
           "controller, with 10 kohm to VDD, so that the converter stays off until the program drives it low; to GND "
           "if no output is free. Never leave it open"),
    ("INTB", "falls when a scan is ready; push-pull, no pull-up. To an input, or open where the bus is polled"),
)
"""Pins of a converter and their wiring (SNOSCY9A, 5 and 6.3; values of resistors are usual)."""


README = "firmware/readme.txt"


def _no_driver_text(device: Converter) -> Iterator[str]:
    """Yield the sentences of the readme for a converter without a driver."""
    yield (f"There is no driver for {device.part} in this folder: sitscad has one for LDC1612 and LDC1614 alone. Nor "
           f"do `sitscad read` and the simulated converter know {device.part}.")
    if not device.has_circuit:
        yield f"There is no wiring, either: sitscad draws no circuit for the pins of {device.part}."
    if not device.has_registers:
        yield (f"sitscad knows no registers of {device.part}: {device.name}_config.h and {device.name}_config.json say "
               "so. What sets up the converter, reads it and looks after faults is yours to write and to test.")
        return
    yield (f"{device.name}_config.h and {device.name}_config.json have every register to write, in order, where "
           "results stand, and what makes frequency and inductance of them. What sets up the converter, reads it and "
           "looks after faults is yours to write and to test.")


def render_readme(layout: Layout, estimates: Estimates, bench: Estimates, forced: str = "") -> dict[str, bytes]:
    """Return ``firmware/readme.txt``: the wiring, and ten steps from a board on the bench to newtons.

    For a converter without a driver, the readme states this. Empty if the converter cannot be set up or the sensor has
    no frequency bands.
    """
    spec, readout = layout.spec, estimates.readout
    if readout.conversion is None:
        return {}
    if not spec.readout.device.has_driver:
        parts = [f"{FORCED}."] if forced else []
        for text in _no_driver_text(spec.readout.device):
            parts += hanging("", text, WIDTH)
        return {README: ("\n".join(parts) + "\n").encode("ascii", "replace")}
    try:
        coil_bands = frequency_bands(estimates.all_coils, usual_value("coil_inductance"))
    except ValueError:
        return {}
    calibration = "; a calibration.h beside it takes precedence over ../calibration/'s"
    if spec.cells is not None:
        calibration = "; cells.h has the maps of all cells: cell-N/ beside it goes before ../calibration/cell-N/"
    files = (*FILES, THERMOMETER_FILE) if spec.readout.thermistor is not None else FILES
    steps, longest = [], show(_self_test_time(len(estimates.all_coils), readout.scan_rate), "s", 2)
    code = bare_board_code(bench.all_coils, bench.readout.device)
    first_steps = _readme_steps(
        spec.cells, spec.name, spec.readout.device, is_felt(spec), estimates.readout, code, coil_bands)
    compensation = temperature_steps(spec.readout.thermistor) if is_compensated(spec) else ()
    for number, step in enumerate((*first_steps, *compensation), 1):
        text, *commands = step.split("\n")
        steps += [*hanging(f"{number:>2}. ", text, WIDTH), *(f"      {command}" for command in commands)]
    parts = [
        *([f"{FORCED}."] if forced else []),
        f"The sensor {spec.name}: from the board on the bench to newtons",
        *([f"{spec.issue.title}."] if spec.issue.rows else []),
        "", "WIRING", "", *_wiring_lines(layout.pads, layout.spec.fpc.tail, layout.spec.readout, contacts(layout),
                                         estimates.all_coils, estimates.readout.capacitance),
        "", "WHAT EACH COIL READS", "", *_reading_lines(spec.readout.device, coil_bands, estimates.temperature,
                                                        bench.metered, estimates.reference),
        "", "THE FIRST TEN STEPS", "", *steps,
        "", "IN A PROGRAM OF YOUR OWN", "",
        *(line for name, text in PROGRAM for line in hanging(
            f"  {name:<12}", text.format(wake=_wake_time(spec.readout.device), longest=longest), WIDTH)),
        "", "FILES", "", *(f"  {name:<22}{purpose.format(calibration=calibration)}" for name, purpose in files),
    ]
    return {README: ("\n".join(parts) + "\n").encode("ascii", "replace")}


def _wiring_lines(
    pads: tuple[Pad, ...], tail: Tail | None, readout: ReadoutSpec, connections: tuple[Contact, ...],
    coils: tuple[CoilEstimate, ...], capacitance: float,
) -> Iterator[str]:
    """Yield the lines on the pins of each converter, the capacitors and the coils' contacts."""
    device = readout.device
    number = device.converter_count(len(coils))
    yield f"{number} {device.part} ({device.package})."
    for name, text in PINS:
        yield from hanging(f"  {name:<10}", text + ".", WIDTH)
    places = [at for at in device.coil_channels(len(coils)) if at.number == 0]
    for at in places:
        level = f"to {device.address_net(at.address)}"
        bus = f", converter {at.converter + 1} on bus {at.bus + 1}" if places[-1].bus else ""
        yield f"  {'ADDR':<10}{level}: address 0x{at.address:02X}{bus}. Never leave it open"
    if places[-1].bus:
        text = ("A bus has two addresses: the controller needs two buses, each with its own SCL, SDA and pull-ups; "
                f"examples take them as /dev/i2c-{BUSES[0]},/dev/i2c-{BUSES[1]} (Linux), Wire and Wire1 (Arduino).")
        yield from hanging(" " * 12, text, WIDTH)
    clock = f"{show(readout.clock, 'Hz')} from a crystal oscillator, 40 to 60 % duty, with the supply's level"
    text = f"{clock}; one for all converters. Not the internal one: it may be of 35 to 55 MHz."
    yield from hanging(f"  {'CLKIN':<10}", text, WIDTH)
    capacitor = f"{show(capacitance, 'F')}, C0G"
    place = "across the two lines, beside the converter"
    if readout.chip is not None or readout.capacitor_at == "coil":
        place = "on the tail, soldered there" if readout.chip is not None else "at the coil"
    yield from hanging(f"  {'capacitor':<10}", f"{capacitor}, one a coil, {place}.", WIDTH)
    is_reversed = socket_pad(pads, tail, 1) > 1
    board_end = "contacts of the tail" if tail is not None else "pads of the board"
    yield f"  {board_end}" + (", and pads of J1 in wiring/:" if is_reversed else ":")
    for contact in connections:
        where = f"{contact.converter_pin} of converter {contact.converter}" if contact.net != "-" else "nothing"
        if contact.converter == CONTROLLER:
            where = f"{contact.converter_pin} of the controller"
        pad = f"pad {socket_pad(pads, tail, contact.number):<3} " if is_reversed else ""
        yield f"    {contact.number:>3}  {pad}{contact.pin:<8} {where}"
    if is_reversed:
        text = (
            "J1 has its contacts at the bottom, so the tail lies in it with its contacts down: its pads are numbered "
            "in the opposite direction. In a socket with contacts on top, or with a tail that is turned over on its "
            "way, both are numbered in the same direction. Plug a tail into a loose socket and check this before you "
            "order a board."
        )
        yield from hanging("", text, WIDTH)
    text = (
        "With TI's evaluation board LDC1614EVM: take its own coils off, wire each pair of "
        "contacts to its INxA and INxB where the coil was, take its capacitors off or choose them as above, and set "
        "the board's 40 MHz oscillator as the clock: its user's guide says how (not verified here)."
    )
    yield from hanging("", text, WIDTH)


def _reading_lines(
    converter: Converter, coil_bands: tuple[CoilBands, ...], temperature: float, metered: tuple[MeterReadings, ...],
    reference: CoilEstimate | None = None,
) -> Iterator[str]:
    """Yield each coil's frequencies at `temperature` (degrees Celsius) with their bands of manufacture.

    The expected readings of an LCR meter on the bare board follow if `metered` has them.
    """
    text = (
        f"Frequency at the converter at {temperature:g} degC, with the limits of the self-test ({SIGMAS:g} sigma of "
        "manufacture, so that it reports no sound board). Reject a bare board with a coil more than "
        f"{ACCEPTED_SIGMAS:g} sigma off: the data sheet has these limits."
    )
    yield from hanging("", text, WIDTH)
    if reference is not None:
        text = f"{reference.name} is the reference coil: no target covers it, and no map reads it."
        yield from hanging("", text, WIDTH)
    for coil_band in coil_bands:
        for name, band in (("bare board", coil_band.bare), ("assembled", coil_band.assembled)):
            ends = f"{FREQUENCY.shown(band.low)} to {FREQUENCY.shown(band.high)}"
            yield f"  {coil_band.coil:<6}{name:<12}{FREQUENCY.shown(band.design):<12} {ends}"
    yield from hanging("", _frequency_warning(converter, coil_bands), WIDTH)
    if metered:
        meter = f"An LCR meter at {show(metered[0].frequency, 'Hz')}"
        within = f"within {ACCEPTED_SIGMAS:g} sigma of manufacture (reject others)"
        yield from hanging(
            "", f"{meter} between the contacts of the bare board, far from metal, at 20 degC, {within}:", WIDTH)
        for read in metered:
            inductance, direct = ACCEPTED_SIGMAS * read.inductance_sigma, ACCEPTED_SIGMAS * read.direct_sigma
            yield (
                f"  {read.coil:<6}L {show(read.inductance, 'H', 4)} +- {show(inductance, 'H', 2)}, "
                f"direct current {show(read.direct, 'ohm', 3)} +- {show(direct, 'ohm', 2)}"
            )


def _frequency_warning(device: Converter, coil_bands: tuple[CoilBands, ...]) -> str:
    """Return a warning if boards within their frequency bands can exceed the converter's largest sensor frequency.

    Empty if no band exceeds it.
    """
    most = device.limit("sensor_frequency_max")
    each = [(coil_band.coil, name, band) for coil_band in coil_bands
            for name, band in (("the bare board", coil_band.bare), ("assembled and at rest", coil_band.assembled))]
    fractions = {(coil, name): band.fraction_above(most) for coil, name, band in each if band.high > most}
    if not fractions:
        return ""
    (coil, name), share = max(fractions.items(), key=lambda coil_bands: coil_bands[1])
    return (
        f"Above {show(most, 'Hz')} a tank is too fast for the {device.part}: boards at the upper end of a band are "
        f"sound, and the converter's results of them are not. Of coil {coil}, {name}, these are "
        f"{show(100.0 * share, '%', 2)} of what manufacture makes; a larger capacitor makes them fewer (SIT202)."
    )


def bare_drive_text(
    converter: Converter, readout: ReadoutEstimate, bare_code: int | None, folder: str = "firmware/"
) -> str:
    """Describe the drive code for a bare board; empty if no code is chosen.

    `bare_code` is this code, and `folder` the path of the firmware's files in the text.
    """
    device, code = converter, bare_code
    if code is None or readout.high_current or readout.drive_code is None:
        return ""
    used = ", ".join(map(str, readout.drive_codes or (readout.drive_code,)))  # per channel if they differ
    if used == str(code):
        return f" With {device.part} use drive code {code} for the bare board as for the assembled sensor."
    codes = f" With {device.part} use drive code {code} for the bare board; the assembled sensor has {used}."
    if not device.has_driver:
        return codes
    return (
        f"{codes} Write 0x{code << 11:04X} (the code times 2048) in the lines DRIVE_CURRENT of "
        f"{folder}sensor_config.h, or of {folder}micropython/sensor_config.py, for this test, and put back what was "
        "there: in a copy of the package, not in the package itself."
    )


def _i2c_address_text(converter: Converter, coils: int) -> str:
    """Describe the addresses that the command `i2cdetect` shows on each bus.

    `BUSES` has the bus numbers under Linux.
    """
    buses: dict[int, list[int]] = {}
    for at in converter.coil_channels(coils):
        buses.setdefault(at.bus, []).append(at.address)
    shown = {bus: " and ".join(f"{address:x}" for address in dict.fromkeys(each)) for bus, each in buses.items()}
    return ", ".join(f"`i2cdetect -y {BUSES[bus]}` shows {addresses}" for bus, addresses in shown.items())


BUSES = (1, 3)
"""Numbers under Linux (``i2cdetect -y N``) of the first and the second I2C bus in the examples."""


def _readme_steps(
    cells: CellsSpec | None, name: str, converter: Converter, has_map: bool, readout: ReadoutEstimate,
    bare_code: int | None, coil_bands: tuple[CoilBands, ...],
) -> Iterator[str]:
    rate = f"{readout.scan_rate:.0f} readings a second"
    yield "Look at the board, then measure every coil with an ohmmeter and, if there is one, an LCR meter: table above."
    yield "Wire it as above, without power, and SD to GND for the first look: nothing answers while SD is high."
    second = converter.coil_channels(len(coil_bands))[-1].bus
    yield (
        "Switch on with a limit of 50 mA, and look for the addresses: "
        f"{_i2c_address_text(converter, len(coil_bands))}. "
        "Then switch off, wire SD to its output, and tell the program which one that is (below)."
    )
    yield (
        "Copy the package and work in the copy's folder firmware/ from here on: `sitscad verify` would call what is "
        "built in the package foreign to it. There build the example, or open it as an Arduino sketch (firmware.ino). "
        "The last line is for trying it without a board:\n"
        f"cp -r .. ../../{name}-bench && cd ../../{name}-bench/firmware\n"
        "cc -std=c99 -O2 -o sensor example_linux.c sensor.c ldc161x.c -lm\n"
        "cc -std=c99 -O2 -DSIMULATED -o sensor example_linux.c sensor.c ldc161x.c simulated/simulated.c -lm"
    )
    yield (
        f"Run it (`./sensor {','.join(f'/dev/i2c-{number}' for number in BUSES[:second + 1])}`). sensor_begin resets "
        "the converter, writes every register, reads all back and wakes it; its errors say where to look: the bus, the "
        "identity, a "
        "register. ../live.html (Chromium) and the first of these commands show the sketch's lines. The second "
        "command does the same without a board:\n"
        "sitscad read serial:PORT --design ..\nsitscad read sim:.."
    )
    yield (
        "Read the self-test. A coil that does not oscillate is open or shorted from end to end: the ohmmeter tells "
        "which. Inductance low: a layer is missing or turns are shorted. Amplitude outside of 1.2 to 1.8 V is a "
        "warning while the board is bare, and a fault of drive or losses when it is assembled."
        f"{bare_drive_text(converter, readout, bare_code, '')}"
    )
    if len(coil_bands) > 1:
        gap = max(a.assembled.design for a in coil_bands) - min(a.assembled.design for a in coil_bands)
        if gap >= exchange_threshold(coil_bands):
            yield f"The self-test tells exchanged coils where designs differ enough; to be sure, {COIN} near each."
        else:
            yield (
                f"{COIN.capitalize()} near {coil_bands[0].coil} alone, then near the others: the frequency of the coil "
                "below it has to rise most. These coils are too much alike for the self-test to see that two are "
                "exchanged."
            )
    else:
        yield f"{COIN.capitalize()} near {coil_bands[0].coil}: its frequency has to rise, and to come back."
    yield (
        "Assemble the sensor and run the self-test again: it has to say that it read an assembled one. This tests "
        f"noise and rate, too ({rate}):\nsitscad read serial:PORT --design .. --diagnose"
    )
    yield from _calibration_steps(cells, has_map)


def _calibration_steps(cells: CellsSpec | None, has_map: bool) -> Iterator[str]:
    """Yield the steps from readings to newtons, or the reason why the sensor has no map to newtons."""
    if cells is None and not has_map:
        yield "This spec has no target on an elastomer, so there is no map to newtons: sensor_forces says so."
        yield "Read frequencies; the header of the register table says what inductance they are."
        return
    if cells is not None:
        yield (
            "Calibrate each cell N, from 1: the command says what to put on and reads it; ../calibration/readme.txt "
            "says how it is done by hand. cells.h takes each cell-N/calibration.h of this folder: build again.\n"
            "sitscad calibrate ../spec/*.yaml --cell N --from serial:PORT -o cell-N"
        )
    else:
        yield (
            "Calibrate it: the command says what to put on and reads it; ../calibration/plan.txt is the same by hand. "
            "Put the resulting calibration.h into this folder, with temperature.h if there is one, and build again.\n"
            "sitscad calibrate ../spec/*.yaml --from serial:PORT"
        )
    yield ("Take the tare without load (16 readings in a row), and again when the temperature has changed. Then read "
           "newtons.")


COIN = "bring a flat piece of copper or aluminium (a coin)"
"""Action that changes the readings of a bare board's coils; pressing does not, because the target is missing."""


PROGRAM = (
    ("SD", "Drive it low and wait {wake} ms before sensor_begin. The pin is SENSOR_SD_PIN in firmware.ino (4; -1 if SD "
           "is wired to GND), sd=/dev/gpiochipN:LINE of the Linux example, sd=Pin(...) in MicroPython."),
    ("threads", "The driver has no lock. Call all functions of one `sensor` from one thread, and copy readings to "
                "others. Other devices may share the bus if your bus functions lock it for each transfer."),
    ("interrupts", "Call no function of the driver in an interrupt handler. INTB falls when a scan is ready: let its "
                   "handler set a flag, and call sensor_poll when the flag is set or a scan's time has passed."),
    ("hung bus", "A controller that is reset within a transfer may leave SDA low. Your bus functions need a time limit "
                 "and return other than 0 when it ends. Then give nine pulses on SCL and a stop condition, set SD high "
                 "for 1 ms (that this alone frees the bus is not verified), and start again."),
    ("watchdog", "sensor_begin and sensor_self_test together return within about {longest} at 400 kHz, all others "
                 "within one scan: give the controller's watchdog more."),
)
"""Duties of a program that uses the driver: subject and text."""


FILES = (
    ("sensor.h, sensor.c", "this sensor: begin, poll, self-test, tare, forces of each cell. Compile it and ldc161x.c"),
    ("ldc161x.h, ldc161x.c", "the converter's registers on any I2C bus (two functions of yours)"),
    ("sensor_config.h", "tables of this sensor{calibration}"),
    ("sensor_line.h", "readings as lines on a serial port, that `sitscad read serial:PORT` reads"),
    ("example_linux.c", "Linux, /dev/i2c-N"),
    ("firmware.ino", "Arduino"),
    ("wiring/", "this wiring as a KiCad schematic with its symbols (wiring.kicad_sch), and as a picture (wiring.svg)"),
    ("micropython/", "MicroPython: all files onto the board, with the headers of calibration/ for forces"),
    ("ros2/", "a ROS 2 node, as an example: WrenchStamped from the lines of the sketch, of cells a topic each"),
    ("simulated/", "a simulated converter, to try all of it without a board"),
    ("ldc161*_config.*", "the registers as a C header and as JSON, for drivers of your own"),
)
"""Files of the folder, and their purposes."""

THERMOMETER_FILE = ("thermometer.h", "the temperature sensor of the design; micropython/thermometer.py is its twin")
"""File of a sensor with a temperature sensor."""
