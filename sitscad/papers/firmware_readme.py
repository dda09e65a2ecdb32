"""``firmware/readme.txt``: what is wired to what, and the first ten steps from a board on the bench to newtons."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from sitscad.calibration.unknowns import usual
from sitscad.drawing.frame import FORCED
from sitscad.estimates.circuit.bands import CoilBands, bands
from sitscad.estimates.values import Estimates
from sitscad.fabrication.board_end import socket_pad
from sitscad.layout.board import Layout
from sitscad.layout.tail_tracks import contacts
from sitscad.papers.firmware_driver import addr_pin, unlike
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show
from sitscad.writer import is_felt

WIDTH = 110
PINS = (
    ("VDD, GND", "supply 2.7 to 3.6 V (data sheet 6.3), 100 nF and 1 uF beside the pins; the die pad to GND, too"),
    ("SCL, SDA", "the I2C bus, at most 400 kHz, each with one pull-up resistor (2.2 to 4.7 kohm are usual)"),
    ("SD", "low: works; high: shut down, all settings lost. To an output of the controller, with 10 kohm to VDD, so "
           "that the converter stays off until the controller has started; to GND where no output is free. Never open"),
    ("INTB", "falls when a scan is ready; push-pull, no pull-up. To an input, or open where the bus is polled"),
)
"""Pins of a converter, and what is wired to them (SNOSCY9A, 5 and 6.3; values of resistors are usual)."""


def render(layout: Layout, estimates: Estimates, bench: Estimates, forced: str = "") -> dict[str, bytes]:
    """The text; none for a converter of another family, or where it cannot be set up."""
    spec, readout = layout.spec, estimates.readout
    if not spec.readout.device.has_driver or readout.conversion is None:
        return {}
    try:
        found = bands(estimates, usual("coil_inductance"))
    except ValueError:
        return {}
    parts = [
        *([f"{FORCED}."] if forced else []),
        f"The sensor {spec.name}: from the board on the bench to newtons",
        *([f"{spec.issue.words[0].upper()}{spec.issue.words[1:]}."] if spec.issue.rows else []),
        "", "WIRING", "", *_wiring(layout, estimates),
        "", "WHAT EACH COIL READS", "", *_coils(found, bench),
        "", "THE FIRST TEN STEPS", "", *_numbered(_steps(spec, estimates, found)),
        "", "FILES", "", *_files(),
    ]
    return {"firmware/readme.txt": ("\n".join(parts) + "\n").encode("ascii", "replace")}


def _wrapped(text: str, first: str = "", rest: str = "") -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=first, subsequent_indent=rest)


def _wiring(layout: Layout, estimates: Estimates) -> Iterator[str]:
    """Pins of every converter, the capacitors, the coils' contacts."""
    spec, device = layout.spec, layout.spec.readout.device
    number = device.needed(len(estimates.coils))
    yield f"{number} {device.part} ({device.package})."
    for name, said in PINS:
        yield from _wrapped(said + ".", f"  {name:<10}", " " * 12)
    places = [at for at in device.places(len(estimates.coils)) if at.number == 0]
    for at in places:
        level = {"low": "to GND", "high": "to VDD"}[addr_pin(device, at.address)]
        bus = f", converter {at.converter + 1} on bus {at.bus + 1}" if places[-1].bus else ""
        yield f"  {'ADDR':<10}{level}: address 0x{at.address:02X}{bus}. Never open"
    if places[-1].bus:
        said = ("A bus has two addresses: the controller needs two buses, each with its own SCL, SDA and pull-ups; "
                "examples take them as /dev/i2c-1,/dev/i2c-3 (Linux), Wire and Wire1 (Arduino).")
        yield from _wrapped(said, " " * 12, " " * 12)
    clock = f"{show(spec.readout.clock, 'Hz')} from a crystal oscillator, 40 to 60 % duty, with the supply's level"
    yield from _wrapped(
        f"{clock}; one for all converters. Not the internal one: it may be of 35 to 55 MHz.",
        f"  {'CLKIN':<10}",
        " " * 12,
    )
    capacitor = f"{show(estimates.readout.capacitance, 'F')}, C0G"
    place = "across the two lines, beside the converter"
    if spec.readout.chip is not None or spec.readout.capacitor_at == "coil":
        place = "on the tail, soldered there" if spec.readout.chip is not None else "at the coil"
    yield from _wrapped(f"{capacitor}, one a coil, {place}.", f"  {'capacitor':<10}", " " * 12)
    is_reversed = socket_pad(layout, 1) > 1
    yield "  contacts of the tail" + (", and pads of J1 in wiring/:" if is_reversed else ":")
    for one in contacts(layout):
        where = f"{one.converter_pin} of converter {one.converter}" if one.net != "-" else "nothing"
        pad = f"pad {socket_pad(layout, one.number):<3} " if is_reversed else ""
        yield f"    {one.number:>3}  {pad}{one.pin:<8} {where}"
    if is_reversed:
        yield from _wrapped(
            "J1 has its contacts below, and the tail lies in it with its contacts down: they count the other way "
            "round. In a socket with contacts on top, or with a tail that is turned over on its way, they count alike. "
            "Plug a tail into a loose socket and look, before a board is ordered."
        )
    yield from _wrapped(
        "With TI's evaluation board LDC1614EVM: take its own coils off, wire each pair of "
        "contacts to its INxA and INxB where the coil was, take its capacitors off or choose them as above, and set "
        "the board's 40 MHz oscillator as the clock: its user's guide says how (not verified here)."
    )


def _coils(found: tuple[CoilBands, ...], bench: Estimates) -> Iterator[str]:
    """Every coil's frequencies with the bands of manufacture, and what a meter reads of the bare board."""
    yield "Frequency at the converter, with the band that sound boards keep (5 sigma of manufacture):"
    for one in found:
        for name, band in (("bare board", one.bare), ("assembled", one.assembled)):
            ends = f"{show(band.low, 'Hz', 4)} to {show(band.high, 'Hz', 4)}"
            yield f"  {one.coil:<6}{name:<12}{show(band.design, 'Hz', 5):<12} {ends}"
    if bench.metered:
        meter = f"An LCR meter at {show(bench.metered[0].frequency, 'Hz')}"
        yield f"{meter} between the contacts of the bare board, far from metal, at 20 degC:"
        for read in bench.metered:
            inductance, direct = 5.0 * read.inductance_sigma, 5.0 * read.direct_sigma
            yield (
                f"  {read.coil:<6}L {show(read.inductance, 'H', 4)} +- {show(inductance, 'H', 2)} (5 sigma), "
                f"direct current {show(read.direct, 'ohm', 3)} +- {show(direct, 'ohm', 2)}"
            )


def _steps(spec: SensorSpec, estimates: Estimates, found: tuple[CoilBands, ...]) -> Iterator[str]:
    rate = f"{estimates.readout.scan_rate:.0f} readings a second"
    yield "Look at the board, then measure every coil with an ohmmeter and, if there is one, an LCR meter: table above."
    yield "Wire it as above, without power. SD last: it decides whether the converter answers at all."
    second = "; so on the second bus" * spec.readout.device.places(len(found))[-1].bus
    yield (
        "Switch on with a limit of 50 mA, and look for the address: `i2cdetect -y 1` shows 2a (and 2b for a second)"
        f"{second}."
    )
    yield (
        "Copy the package and work in the copy's folder firmware/ from here on: `sitscad verify` would call what is "
        "built in the package foreign to it. There build the example, or open it as an Arduino sketch (firmware.ino), "
        "or build zephyr/. The last line is for trying it without a board:\n"
        f"cp -r .. ../../{spec.name}-bench && cd ../../{spec.name}-bench/firmware\n"
        "cc -std=c99 -O2 -o sensor example_linux.c sensor.c ldc161x.c -lm\n"
        "cc -std=c99 -O2 -DSIMULATED -o sensor example_linux.c sensor.c ldc161x.c simulated/simulated.c -lm"
    )
    yield (
        f"Run it (`./sensor /dev/i2c-1{second and ',/dev/i2c-2'}`). sensor_begin resets the converter, "
        "writes every register, reads all back and wakes it; its errors say where to look: the bus, the identity, a "
        "register. The sketch's lines are shown by ../live.html (Chromium) and by the first of these, the second is "
        "the same without a board:\n"
        "sitscad read serial:PORT --design ..\nsitscad read sim:.."
    )
    yield (
        "Read the self-test. A coil that does not oscillate is open or shorted from end to end: the ohmmeter tells "
        "which. Inductance low: a layer is missing or turns are shorted. Amplitude outside of 1.2 to 1.8 V is a "
        "warning while the board is bare, and a fault of drive or losses when it is assembled."
    )
    if len(found) > 1:
        gap = max(a.assembled.design for a in found) - min(a.assembled.design for a in found)
        if gap >= unlike(found):
            yield "The self-test tells exchanged coils where designs differ enough; press over each to be sure."
        else:
            yield (
                f"Press over {found[0].coil} alone with something soft, then over the others: the coil that is pressed "
                "has to move most. These coils are too much alike for the self-test to see that two are exchanged."
            )
    else:
        yield f"Press on {found[0].coil}: its frequency has to rise, and to come back."
    yield (
        "Assemble the sensor and run the self-test again: it has to say that it read an assembled one. This tests "
        f"noise and rate, too ({rate}):\nsitscad read serial:PORT --design .. --diagnose"
    )
    if spec.cells is not None:
        yield "Calibrate each cell (calibration/readme.txt): forces come by the cells' maps, not by sensor_forces."
        yield "Take the tare without load, 16 readings in a row, again when the temperature has changed; read newtons."
    elif is_felt(spec):
        yield (
            "Calibrate it: the command says what to put on and reads it; ../calibration/plan.txt is the same by hand. "
            "Put the calibration.h that results into this folder, and build again.\n"
            "sitscad calibrate ../spec/*.yaml --from serial:PORT"
        )
        yield "Take the tare without load, 16 readings in a row, again when the temperature has changed; read newtons."
    else:
        yield "This spec has no target on an elastomer, so there is no map to newtons: sensor_forces says so."
        yield "Read frequencies; the header of the register table says what inductance they are."


def _numbered(steps: Iterator[str]) -> Iterator[str]:
    for number, step in enumerate(steps, 1):
        text, *commands = step.split("\n")
        yield from _wrapped(text, f"{number:>2}. ", "    ")
        yield from (f"      {command}" for command in commands)


def _files() -> Iterator[str]:
    for name, said in (
        ("sensor.h, sensor.c", "this sensor: begin, poll, self-test, tare, forces. All that has to be compiled, with"),
        ("ldc161x.h, ldc161x.c", "the converter's registers on any I2C bus (two functions of yours)"),
        ("sensor_config.h", "tables of this sensor; calibration.h beside it goes before ../calibration/calibration.h"),
        ("sensor_line.h", "readings as lines on a serial port, that `sitscad read serial:PORT` reads"),
        ("example_linux.c", "Linux, /dev/i2c-N"),
        ("firmware.ino", "Arduino"),
        (
            "wiring/",
            "this wiring as a KiCad schematic with its symbols (wiring.kicad_sch), and as a picture (wiring.svg)",
        ),
        ("zephyr/", "Zephyr: name your bus in app.overlay"),
        ("micropython/", "MicroPython: both files onto the board; counts and states, no forces"),
        ("ros2/", "a ROS 2 node, as an example: WrenchStamped from the lines of the sketch"),
        ("simulated/", "a simulated converter, to try all of it without a board"),
        ("ldc161*_config.*", "the registers as a C header and as JSON, for drivers of your own"),
    ):
        yield f"  {name:<22}{said}"
