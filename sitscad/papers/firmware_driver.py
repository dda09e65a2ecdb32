"""The driver of a sensor: C files that are the same for all, and the tables by which sensors differ."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from sitscad.calibration.unknowns import usual
from sitscad.data import FOLDER
from sitscad.drawing.frame import FORCED
from sitscad.estimates.circuit.bands import LEAP, Band, CoilBands, bands
from sitscad.estimates.circuit.settings import Device, identity
from sitscad.estimates.values import CoilEstimate, Estimates
from sitscad.readout.conversion import Conversion
from sitscad.readout.converter import Channel, Converter
from sitscad.scene.state import REST
from sitscad.spec.sensor import SensorSpec

READ_TIME = 122.5e-6
"""Shortest time (s) that a register takes over I2C at 400 kHz, by which the self-test waits for results."""

RECOVERY = 5.2e-3
"""Time (s) that a channel takes which does not oscillate (SNOSCY9A, 6.5: sensor recovery after a watchdog timeout)."""


def addr_pin(converter: Converter, address: int) -> str:
    """Level of the ADDR pin that selects an address."""
    return ("low", "high")[converter.addresses.index(address)]


def driver_files(
    spec: SensorSpec, estimates: Estimates, devices: Sequence[Device], forced: bool = False
) -> dict[str, str]:
    """The files of the driver by their paths in the package; none for a converter of another family. Raises ValueError
    where the sensor has no band to be tested by.
    """
    conversion = estimates.readout.conversion
    if not spec.readout.device.has_driver or conversion is None:
        return {}
    found = bands(estimates, usual("coil_inductance"))
    folder = FOLDER / "firmware"
    files = {
        f"firmware/{path.relative_to(folder).as_posix()}": path.read_text(encoding="ascii")
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    files["firmware/sensor_config.h"] = _config(spec, estimates, devices, found, conversion, forced)
    files["firmware/micropython/sensor_config.py"] = _python_config(spec, devices, found, conversion, forced)
    return files


def _counts(band: Band, conversion: Conversion) -> tuple[int, ...]:
    """A band in counts: the design's, lowest and highest."""
    scale, most = 2.0**conversion.device.count_bits / conversion.full_scale, 2**conversion.device.bits - 2
    return tuple(min(max(round(value * scale), 1), most) for value in (band.design, band.low, band.high))


def unlike(found: Sequence[CoilBands]) -> float:
    """By how much (Hz) two coils' designs have to differ so that an exchange is seen in spite of manufacture."""
    widest = sorted(band.own_sigma for band in found)[-2:]
    return 5.0 * math.hypot(*widest)


def _config(
    spec: SensorSpec, estimates: Estimates, devices: Sequence[Device], found: Sequence[CoilBands],
    conversion: Conversion, forced: bool,
) -> str:
    """``sensor_config.h``: sizes, and initialisers of the tables of ``sensor.c``."""
    readout, scale = estimates.readout, 2.0**conversion.device.count_bits / conversion.full_scale
    places = spec.readout.device.places(len(found))
    scan = 1.0 / readout.scan_rate if readout.scan_rate else 0.0
    waited = 4.0 * scan + 2 * len(found) * RECOVERY + 2e-3
    rows = [
        f"{{{number}u, 0x{register.address:02X}u, 0x{register.value:04X}u}}, /* {register.name} */"
        for number, device in enumerate(devices)
        for register in device.registers
    ]
    lines = [
        "/*",
        *([f" * {FORCED}."] if forced else []),
        f" * The sensor {_plain(spec.name)}: what its driver (sensor.c) knows of it.",
        *([f" * {spec.issue.words[0].upper()}{spec.issue.words[1:]}."] if spec.issue.rows else []),
        f" * Counts are f_SENSOR / {conversion.full_scale:.9g} Hz * 2^{conversion.device.count_bits}.",
        " */",
        "#ifndef SENSOR_CONFIG_H",
        "#define SENSOR_CONFIG_H",
        "",
        f"#define SENSOR_NAME {json.dumps(_plain(spec.name), ensure_ascii=True)}",
        f"#define SENSOR_ID 0x{identity(spec.name, devices):08X}u /* of the name, the coils and the settings */",
        f"#define SENSOR_COILS {len(found)}",
        f"#define SENSOR_CONVERTERS {len(devices)}",
        f"#define SENSOR_BUSES {devices[-1].bus + 1}",
        f"#define SENSOR_HZ_PER_COUNT {1.0 / scale:.9e}f",
        f"#define SENSOR_SCAN_US {round(scan * 1e6)}u /* a scan of all coils */",
        f"#define SENSOR_POLLS {math.ceil(waited / READ_TIME)}u /* at 400 kHz they take longer than four scans */",
        f"#define SENSOR_UNLIKE {round(unlike(found) * scale)}u /* designs so far apart are told apart */",
        "#define SENSOR_BUS_OF {" + ", ".join(f"{device.bus}u" for device in devices) + "} /* of a converter */",
        "#define SENSOR_ADDRESSES {" + ", ".join(f"0x{device.address:02X}u" for device in devices) + "}",
        "",
        "/* Converter (from 0), register, value: in the order of writing. */",
        *_macro("SENSOR_SETTINGS", rows),
        "",
        "/* Name, converter, channel; lowest and highest counts in any state and under any load; by what a result may",
        " * leap unconfirmed; counts of the design, lowest and highest of manufacture: bare, assembled. */",
        *_macro("SENSOR_COIL_TABLE", [_coil(at, one, conversion) for at, one in zip(places, found, strict=True)]),
        "",
        "/* For simulated converters: converter, channel, tank as drawn, assembled (Hz, ohm); its noise. */",
        f"#define SENSOR_CHANNELS {spec.readout.device.channels}u",
        f"#define SENSOR_CLOCK_HZ {spec.readout.clock:.9e}",
        f"#define SENSOR_NOISE_STEPS {spec.readout.device.limit('noise_steps')!r}",
        *_macro("SENSOR_TANKS", [_tank(at, coil) for at, coil in zip(places, estimates.coils, strict=True)]),
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _coil(place: Channel, found: CoilBands, conversion: Conversion) -> str:
    _, low, high = _counts(found.working, conversion)
    scale = 2.0**conversion.device.count_bits / conversion.full_scale
    leap = math.ceil(LEAP * conversion.noise(found.assembled.design) * scale)
    states = ", ".join(
        "{" + ", ".join(f"{value}u" for value in _counts(band, conversion)) + "}"
        for band in (found.bare, found.assembled)
    )
    where = f"{place.converter}u, {place.number}u"
    return f'{{"{_plain(found.coil)}", {where}, {low}u, {high}u, {leap}u, {{{states}}}}},'


def _tank(place: Channel, coil: CoilEstimate) -> str:
    """Where a coil is read, frequency and R_P as drawn: assembled where it has that state."""
    state = coil.states.get(REST) or next(iter(coil.states.values()))
    return f"{{{place.converter}, {place.number}, {state.frequency:.9e}, {state.parallel_resistance:.9e}}},"


def _python_config(
    spec: SensorSpec, devices: Sequence[Device], found: Sequence[CoilBands], conversion: Conversion, forced: bool
) -> str:
    """``sensor_config.py``: the tables as MicroPython reads them."""
    lines = [f'"""The sensor {_plain(spec.name)}: what sensor.py knows of it."""', ""]
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
    for place, one in zip(spec.readout.device.places(len(found)), found, strict=True):
        _, low, high = _counts(one.working, conversion)
        lines.append(f'    ("{_plain(one.coil)}", {place.converter}, {place.number}, {low}, {high}),')
    return "\n".join([*lines, ")", f"HZ_PER_COUNT = {conversion.full_scale / 2.0**conversion.device.count_bits!r}", ""])


def _macro(name: str, rows: Sequence[str]) -> list[str]:
    return [f"#define {name} \\", "    { \\", *(f"        {row} \\" for row in rows), "    }"]


def _plain(text: str) -> str:
    """Text that neither ends a comment of C nor leaves a string."""
    kept = text.replace("*/", "* /").replace("/*", "/ *").replace("\\", "/").replace('"', "'")
    return " ".join(kept.encode("ascii", "replace").decode().split())
