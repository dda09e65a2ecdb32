"""Temperature in the firmware: tables for the sensor and the compensation, and the steps of the readme."""

from __future__ import annotations

import json
from collections.abc import Iterator

from sitscad.files.writer import is_felt
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.thermistor import Thermistor, ThermistorPart

CELSIUS_PERIOD = 0.1
"""Time (s) between two readings of the temperature by the firmware."""


def is_compensated(spec: SensorSpec) -> bool:
    """Return whether the firmware compensates the drift of the forces by a measured temperature."""
    return spec.readout.compensation is not None and is_felt(spec)


def temperature_macros(sensor: Thermistor | None, compensated: bool, results_per_second: float) -> list[str]:
    """Return macros of ``sensor_config.h`` for the temperature sensor.

    If `compensated`, there are also macros for the compensation of drift. `results_per_second` is the number of
    conversion results of all coils in a second.
    """
    lines = []
    if compensated:
        lines = ["#define SENSOR_COMPENSATED /* forces are compensated by the temperature change since the tare */"]
    if sensor is None:
        return lines
    every = min(max(round(CELSIUS_PERIOD * results_per_second), 1), 65535)
    return [*lines, f"#define SENSOR_THERMOMETER {json.dumps(sensor.part.product)}",
            f"#define SENSOR_CELSIUS_EVERY {every}u /* results from one reading of the temperature to the next */",
            *_part_macros(sensor.part)]


def _part_macros(part: ThermistorPart) -> list[str]:
    """Return macros for the registers of a digital sensor, or for the figures of a thermistor."""
    if (at := part.registers) is not None:
        return [f"#define SENSOR_DIGITAL_ADDRESS 0x{at.address:02X}u",
                f"#define SENSOR_DIGITAL_TEMPERATURE 0x{at.temperature:02X}u",
                f"#define SENSOR_DIGITAL_STEP {at.scale:.9e}f /* K */",
                f"#define SENSOR_DIGITAL_IDENTITY 0x{at.identity:02X}u",
                f"#define SENSOR_DIGITAL_IDENTITY_VALUE 0x{at.identity_value:03X}u"]
    return [f"#define SENSOR_NTC_OHM {part.resistance:.6e}f /* at 25 degC */",
            f"#define SENSOR_NTC_B {part.b:.6e}f /* K */",
            f"#define SENSOR_NTC_SERIES_OHM {part.resistance:.6e}f /* of the divider; put yours here */"]


def python_temperature(sensor: Thermistor | None, compensated: bool) -> str:
    """Return the lines of ``sensor_config.py`` for the temperature sensor and the compensation of drift."""
    text = "COMPENSATED = True  # forces are compensated\n" if compensated else ""
    if sensor is None:
        return text
    at, ohm = sensor.part.registers, sensor.part.resistance
    if at is None:
        return f"{text}NTC = ({ohm!r}, {sensor.part.b!r}, {ohm!r})  # ohm at 25 degC, B (K), ohm of the divider\n"
    values = f"0x{at.address:02X}, 0x{at.temperature:02X}, {at.scale!r}, 0x{at.identity:02X}, 0x{at.identity_value:03X}"
    return f"{text}DIGITAL = ({values})  # address, register, step (K), register and value of the identity\n"


COMPENSATION = (
    "sensor_forces takes off the drift by the temperature change since the tare, with temperature.h of ../calibration "
    "(a temperature.h beside sensor.h takes precedence). Without a valid temperature it returns SENSOR_NO_TEMPERATURE, "
    "and the forces are not compensated: no or a faulty temperature sensor, a fault of the reference coil (also in a "
    "reading of the tare), or a change beyond SITSCAD_WARMEST. In the lines, warming_K is then empty."
)
"""Readme step for a sensor whose forces are compensated by its temperature."""


def temperature_steps(sensor: Thermistor | None) -> Iterator[str]:
    """Yield the steps of the readme for the compensation and for the temperature sensor."""
    yield COMPENSATION
    if sensor is None:
        return
    if (at := sensor.part.registers) is not None:
        yield (f"Wire the {sensor.part.product} to the first I2C bus, its address pins to GND (address "
               f"0x{at.address:02X}). The examples call sensor_set_thermometer with thermometer_celsius.")
    else:
        yield (f"Wire the {sensor.part.product} from an analog input to GND, and a resistor of SENSOR_NTC_SERIES_OHM "
               "from the input to the reference voltage. In the sketch the input is SENSOR_NTC_PIN; other programs "
               "pass a function to sensor_set_thermometer that calls thermometer_ntc.")
