"""Register settings for the converter: a commented C header, and a JSON file with equal settings."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from sitscad.assembly.places.state import FREE, PRESSED, REST, State, state_text
from sitscad.basics.quantities import LONE_TIMES, RATES, SCAN_TIMES, TANK_AND_DRIVE, by_quantity, document
from sitscad.basics.units import show
from sitscad.estimates.circuits.settings import Device, devices
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates, ReadoutEstimate, StateEstimate
from sitscad.files.documents.firmware_driver import addr_pin_text, driver_files
from sitscad.files.drawing.frame import FORCED
from sitscad.files.writer import comment_text
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.registers import FirmwareText
from sitscad.spec.sensor import SensorSpec


def config_path(converter: Converter, ending: str) -> str:
    """Return the package path of the file with the register settings: C header (``h``) or JSON file (``json``)."""
    return f"firmware/{converter.name}_config.{ending}"


def render(spec: SensorSpec, estimates: Estimates, forced: str = "") -> dict[str, bytes]:
    """Return header and JSON file, with the registers in the order of writing.

    Both have a warning if `forced` is not empty. If a setting is unknown or does not fit its field, the sensor cannot
    be read out. Then the header is an ``#error`` and the JSON file has the reason under ``refused``. Even a forced
    build then has no settings that look right.
    """
    converter, conversion = spec.readout.device, estimates.readout.conversion
    try:
        converters = devices(spec.readout, estimates.all_coils, estimates.readout)
        text = None if conversion is None else conversion.firmware_text(spec.readout.clock)
        if conversion is None or text is None:
            raise ValueError(f"sitscad has no firmware for {converter.part}")
        files = {
            config_path(converter, "h"): settings_header(spec, estimates, converters, text, bool(forced)),
            config_path(converter, "json"): settings_json(spec, estimates, converters, text, bool(forced)),
            **driver_files(spec, estimates, converters, bool(forced)),
        }
    except ValueError as error:
        files = refusal_files(spec.name, spec.readout.device, str(error))
    return {path: text.encode("utf-8") for path, text in files.items()}


def refusal_files(name: str, converter: Converter, reason: str) -> dict[str, str]:
    """Return the C header and the JSON file, by path, for a sensor that cannot be read out; `reason` states why."""
    text = " ".join(reason.replace('"', "'").replace("\\", "/").split())
    value = {"name": name, "device": converter.name, "refused": reason, "converters": []}
    return {
        config_path(converter, "h"): f'#error "no {converter.part} settings for {name}: {text}"\n',
        config_path(converter, "json"): json.dumps(value, indent=2) + "\n",
    }


SETTINGS = ("capacitance_F", "conversion_capacitance_F", "scan_rate_Hz", "supply_current_A")
"""Keys of the readout at the top level of the JSON file, beside the keys of the converter's formula."""

TIMES = ("settle_time_s", "conversion_time_s", "switch_time_s", "read_back_time_s")
"""Keys of the readout under ``timing`` in the JSON file."""


def settings_json(
    spec: SensorSpec, estimates: Estimates, converters: Sequence[Device], text: FirmwareText, forced: bool = False
) -> str:
    """Return the text of the JSON file. Keys end in SI units, and registers are listed in the order of writing.

    `converters` has address, channels and registers of each converter. `text` has the converter's constants and
    formulas.
    """
    converter, readout = spec.readout.device, estimates.readout
    registers = converter.register_map
    value: dict[str, Any] = {
        **({"warning": FORCED} if forced else {}),
        "name": spec.name,
        **{name.lower().replace(" ", "_"): text for name, text in spec.issue.rows},
        "device": converter.name,
        "manufacturer_id": registers.MANUFACTURER,
        "device_id": converter.device_id,
        "clock_Hz": spec.readout.clock,
        **text.part,
        **document(readout, (each for each in TANK_AND_DRIVE if each.key in SETTINGS)),
        **document(readout.conversion, (each for each in converter.law.SETTINGS if each.key in text.keys)),
        **document(readout, (each for each in RATES if each.key in SETTINGS)),
        "timing": document(readout, (each for each in (*SCAN_TIMES, *RATES) if each.key in TIMES)),
        "coils": [_coil_document(converter, spec.requirements.normal_force, estimates, index)
                  for index in range(len(estimates.all_coils))],
        "converters": [
            {
                "i2c_bus": device.bus,
                "i2c_address": device.address,
                "addr_pin": addr_pin_text(converter, device.address),
                "channels": list(device.coils),
                "registers": [
                    {"address": each.address, "name": each.name, "value": each.value, "meaning": each.meaning}
                    for each in device.registers
                ],
            }
            for device in converters
        ],
    }
    return json.dumps(value, indent=2) + "\n"


def _coil_document(device: Converter, force: float | None, estimates: Estimates, index: int) -> dict[str, Any]:
    """Return the JSON entry of the coil with an index: channel, place, and expected frequencies and inductances.

    `force` is the required normal force (N); None if the spec requires no force.
    """
    coil, channel = estimates.all_coils[index], device.coil_channels(len(estimates.all_coils))[index]
    offsets = () if estimates.readout.conversion is None else estimates.readout.conversion.offsets
    change, sigma = coil.converter_sensitivity(force) or (None, None)
    forces = {state.name: state.force for state in estimates.states}
    return {
        "name": coil.name,
        "converter": channel.converter,
        "channel": channel.number,
        "i2c_bus": channel.bus,
        "i2c_address": channel.address,
        **({"offset": offsets[index]} if offsets else {}),
        **({"is_reference": True} if coil is estimates.reference else {}),
        "centre_m": list(coil.centre),
        "expected": {
            name: {
                "force_N": forces[name],
                "frequency_Hz": state.frequency,
                "inductance_H": state.converter_inductance,
            }
            for name, state in coil.states.items()
        },
        "inductance_by": "1 / (C (2 pi f)^2), C = conversion_capacitance_F; estimate.json has it at the contacts",
        "inductance_H_per_N": change,
        "sigma_inductance_H_per_N": sigma,
    }


def settings_header(
    spec: SensorSpec, estimates: Estimates, converters: Sequence[Device], text: FirmwareText, forced: bool = False
) -> str:
    """Return the C header (C99 and C++), with one constant table of register writes per converter.

    `converters` has address, channels and registers of each converter. `text` has the converter's constants and
    formulas.
    """
    readout, converter = estimates.readout, spec.readout.device
    macro, name = converter.part, converter.name
    lines = [
        "/*",
        *([f" * {FORCED}."] if forced else []),
        f" * Register settings of the {converter.part} for the sensor {comment_text(spec.name)}.",
        *([f" * {spec.issue.title}."] if spec.issue.rows else []),
        f" * Write them in this order after power-up or reset; {converter.register_map.ORDER}.",
        f" * {text.clock} Capacitor {_value_text(readout.capacitance, 'F')}.",
        " * Each value is 16 bits, sent most significant byte first.",
        *(f" * {line}".rstrip() for line in _expected_lines(converter, estimates, text.frequency)),
        " */",
        f"#ifndef {macro}_CONFIG_H",
        f"#define {macro}_CONFIG_H",
        "",
        "#include <stdint.h>",
        "",
        f"#define {macro}_MANUFACTURER_ID 0x{converter.register_map.MANUFACTURER:04X}u",
        f"#define {macro}_DEVICE_ID 0x{converter.device_id:04X}u",
        f"#define {macro}_CONVERTERS {len(converters)}u",
        *_formula_macros(spec.readout.device.part, spec.readout.clock, readout, text),
        *_result_macros(converter, readout, text),
        "",
        "typedef struct {",
        "    uint8_t address;",
        "    uint16_t value;",
        f"}} {name}_register_t;",
    ]
    for number, device in enumerate(converters):
        lines += _register_table(converter, number, device)
    lines += _coil_table(converter, estimates.all_coils)
    if estimates.reference is not None:
        lines.append(f"#define {macro}_REFERENCE {len(estimates.coils)}u /* index of the reference coil */")
    lines += _force_macros(converter, estimates.all_coils, spec.requirements.normal_force)
    lines += _further_state_macros(converter, estimates.all_coils, estimates.states)
    return "\n".join([*lines, "", "#endif", ""])


def _expected_lines(device: Converter, estimates: Estimates, frequency: str) -> list[str]:
    """Describe timing, the expected readings of each coil in each state, and the formula of `frequency`."""
    part = device.part
    pins, delay = show(device.limit("pin_capacitance"), "F"), show(device.limit("drive_delay"), "s")
    expected = f"Expected at {estimates.temperature:g} degC (estimates; compare with what the first board gives):"
    lines = [*_timing_lines(estimates.all_coils, estimates.readout, device), "", expected]
    for coil in estimates.all_coils:
        for name, state in coil.states.items():
            lines.append(
                f"  {comment_text(coil.name)} {comment_text(name)}: {_value_text(state.frequency, 'Hz', 7)}, "
                f"L {_value_text(state.converter_inductance, 'H', 6)} by the formula below, "
                f"R_P {_value_text(state.parallel_resistance, 'ohm', 3)}, {_value_text(state.amplitude, 'V', 3)} peak, "
                f"{_step_text(estimates.readout, state)}"
            )
    if estimates.reference is not None:
        lines.append(f"{comment_text(estimates.reference.name)} is the reference coil: no target covers it.")
    if any(name != FREE for coil in estimates.all_coils for name in coil.states):
        lines.append("Free is the board before assembly; the drive current is chosen for the other states.")
    if loaded := _pressed_forces(estimates.all_coils, estimates.states):
        loads = ", ".join(f"{state} is with {show(force, 'N')}" for state, force in loaded.items())
        lines.append(f"Free and rest are without force, {loads} on the middle of the target.")
    lines += [f"{comment_text(state)}: {comment_text(why)}" for state, why in estimates.failed_states.items()]
    return [
        *lines,
        "",
        f"f_SENSOR = {frequency};",
        f"L = 1 / (C (2 pi f_SENSOR)^2) ({device.source_of('cite_inductance')}), where C = {part}_CAPACITANCE_F: "
        f"the tank capacitor, {pins} of the",
        f"converter's pins ({device.source_of('cite_pins')}) and the cable. "
        "The capacitance of coil and tail is not in C: L contains what",
        f"it does. The losses and the {delay} of the drive make L read high by 1/Q^2 + {delay} * 2 pi f_SENSOR / Q; "
        "a cable",
        "between coil and capacitor adds its own. `sitscad estimate` prints the same L beside the one at the contacts.",
    ]


def _timing_lines(coils: tuple[CoilEstimate, ...], readout: ReadoutEstimate, device: Converter) -> list[str]:
    """Describe the times of a scan and the supply current."""
    times = LONE_TIMES if len(coils) == 1 else SCAN_TIMES
    scans = [each for each in RATES if each.key in SCANS]
    rows = by_quantity([readout], (*times, *scans))
    clock = [["fastest clock of I2C", device.serial_clock_text]]
    return [f"{label.removeprefix('- ')}: {text}" for label, text in (*rows, *clock)]


SCANS = ("scan_rate_Hz", "read_back_time_s", "supply_current_A")
"""Keys of the readout in the header, beside the times."""


def _step_text(readout: ReadoutEstimate, state: StateEstimate) -> str:
    """Describe the inductance (H) of one step of the converter's result, and the frequency's standard deviation.

    The converter's formula gives the inductance. If settings or inductance are unknown, the text for it is "unknown".
    """
    conversion, inductance = readout.conversion, state.converter_inductance
    step, size = "one count of the reference", "unknown"
    if conversion is not None:
        step = "one step of the result" if conversion.rounding(state.frequency) else step
        size = size if inductance is None else show(conversion.inductance_step(inductance, state.frequency), "H", 2)
    if state.spread is None or not state.frequency:
        return f"{step} {size}"
    return f"{step} {size}; one sigma of f {100.0 * state.spread.frequency / state.frequency:.2g} %"


def _formula_macros(part: str, clock_frequency: float, readout: ReadoutEstimate, text: FirmwareText) -> list[str]:
    """Return macros for the constants of the frequency and inductance formulas (Hz, F); unknown ones are left out."""
    clock, capacitance = ("F_CLK_HZ", clock_frequency), ("CAPACITANCE_F", readout.conversion_capacitance)
    values = (clock, *text.constants, capacitance)
    return [
        f"#define {part}_{name} " + (f"{value}u" if isinstance(value, int) else f"{value:.9e}")
        for name, value in values
        if value is not None
    ]


def _result_macros(converter: Converter, readout: ReadoutEstimate, text: FirmwareText) -> list[str]:
    """Return macros for the results' addresses, mask and flags."""
    registers, macro, word_names = converter.register_map, converter.part, converter.result_words
    upper = f"DATA_{word_names[0]}" if len(word_names) > 1 else "DATA"
    how = f"DATA = register & {macro}_{upper}_MASK"
    if len(word_names) > 1:
        first, second = word_names
        how = f"read {first} before {second}; DATA = ({first} & {macro}_{upper}_MASK) << 16 | {second}"
    cited = converter.source_of("cite_results"), converter.source_of("cite_errors")
    description = registers.results_text(converter.bits, word_names, *cited)
    lines = f"/* Results: {how}, {converter.bits} bits, {description} */".replace("\n", "\n * ").splitlines()
    for channel in range(converter.channels):
        for word, address in zip(word_names, converter.data_addresses(channel), strict=True):
            ending = f"_{word}" if len(word_names) > 1 else ""
            lines.append(f"#define {macro}_DATA{channel}{ending} 0x{address:02X}u")
    return [
        "",
        *lines,
        f"#define {macro}_{upper}_MASK 0x{converter.result_mask:04X}u",
        *(
            f"#define {macro}_{name} 0x{mask:04X}u /* {meaning} */"
            for name, (mask, meaning) in registers.DATA_FLAGS.items()
        ),
        f"#define {macro}_STATUS 0x{registers.STATUS:02X}u",
        f"#define {macro}_MANUFACTURER_ID_ADDRESS 0x{registers.MANUFACTURER_ID:02X}u",
        f"#define {macro}_DEVICE_ID_ADDRESS 0x{registers.DEVICE_ID:02X}u",
        *_count_macros(converter, readout, text.part_by),
    ]


def _count_macros(converter: Converter, readout: ReadoutEstimate, part_by: str) -> list[str]:
    """Return macros that convert a converter's results to counts of a whole conversion.

    They are needed for results that have only a part of a conversion's bits. Empty if results have all bits. `part_by`
    names the settings that select this part.
    """
    conversion = readout.conversion
    if conversion is None or not conversion.is_partial:
        return []
    macro, name = converter.part, converter.name
    offsets = ", ".join(f"{offset}u" for offset in conversion.offsets)
    return [
        "",
        f"/* A conversion has {conversion.count_bits} bits, a result {converter.bits} of them: {part_by} "
        "of the settings below say which.",
        f" * COUNTS makes a conversion of a coil's DATA (coil: its place in {name}_coils), which calibration.h takes:",
        " * counts of one coil are to each other as its frequencies. */",
        f"#define {macro}_DATA_SHIFT {conversion.counts_per_step.bit_length() - 1}u",
        f"#define {macro}_COUNTS(coil, data) \\",
        f"    (((uint32_t)((data) & {macro}_DATA_MASK) << {macro}_DATA_SHIFT) + {name}_offsets[coil])",
        f"static const uint16_t {name}_offsets[] = {{{offsets}}};",
    ]


def _pressed_forces(coils: tuple[CoilEstimate, ...], states: tuple[State, ...]) -> dict[str, float]:
    """Return the forces (N) of the pressed states that have estimates, by the state's name."""
    named = {name for coil in coils for name in coil.states}
    return {state.name: state.force for state in states if state.force and state.name in named}


def _further_state_macros(
    converter: Converter, coils: tuple[CoilEstimate, ...], states: tuple[State, ...]
) -> list[str]:
    """Return macros with force and expected inductance of each pressed state.

    The state under the required force is left out, because `_force_macros` has it.
    """
    lines = []
    for name, force in _pressed_forces(coils, states).items():
        if name == PRESSED:
            continue
        lines += ["", f"/* Expected inductance by the formula (H) {comment_text(state_text(name))}, by this force (N) "
                  f"on "
                      "the middle of the target. */", f"#define {converter.part}_FORCE_{name.upper()}_N {force:.9e}"]
        values = {k: coil.states[name].converter_inductance for k, coil in enumerate(coils) if name in coil.states}
        lines += [f"#define {converter.part}_COIL{k}_L_{name.upper()}_H {value:.9e}"
                  for k, value in values.items() if value is not None]
    return lines


def _force_macros(converter: Converter, coils: Sequence[CoilEstimate], force: float | None) -> list[str]:
    """Return macros for each coil's expected inductance at rest and pressed, and its change per newton with one sigma.

    `force` is the required normal force (N); None if the spec requires no force.
    """
    macros = []
    for index, coil in enumerate(coils):
        rest, pressed = (coil.states[name].converter_inductance if name in coil.states else None
                         for name in (REST, PRESSED))
        change, sigma = coil.converter_sensitivity(force) or (None, None)
        values = {"L_REST_H": rest, "L_PRESSED_H": pressed, "L_PER_NEWTON_H": change, "L_PER_NEWTON_SIGMA_H": sigma}
        macros += [(index, name, value) for name, value in values.items() if value is not None]
    if not macros:
        return []
    macro = converter.part
    return [
        "",
        f"/* Expected inductance by the formula (H), by the coil's place in {converter.name}_coils: "
        "at rest without force,",
        f" * pressed by {macro}_FORCE_PRESSED_N on the middle of the target, and the change per newton between the two",
        " * (H/N), a secant and no curve, with one sigma of manufacture. Estimates: calibrate every sensor. */",
        *([f"#define {macro}_FORCE_PRESSED_N {force:.9e}"] if force else []),
        *(f"#define {macro}_COIL{index}_{name} {value:.9e}" for index, name, value in macros),
    ]


def _coil_table(converter: Converter, coils: Sequence[CoilEstimate]) -> list[str]:
    """Return the table of each coil's converter, channel and place, for programs that reconstruct forces."""
    lines = [
        "",
        "/* Every coil: name, converter, channel and I2C bus (from 0), address, place of its centre on the board (m):",
        " * x along the jaw towards the tail, y across it, seen from the top. */",
        f"#define {converter.part}_COILS {len(coils)}u",
        "typedef struct {",
        "    const char *name;",
        "    uint8_t converter;",
        "    uint8_t channel;",
        "    uint8_t i2c_bus;",
        "    uint8_t i2c_address;",
        "    float x_m;",
        "    float y_m;",
        f"}} {converter.name}_coil_t;",
        f"static const {converter.name}_coil_t {converter.name}_coils[] = {{",
    ]
    for place, coil in zip(converter.coil_channels(len(coils)), coils, strict=True):
        x, y = (f"{value + 0.0:.9e}f" for value in coil.centre)
        where = f"{place.converter}u, {place.number}u, {place.bus}u, 0x{place.address:02X}u"
        lines.append(f'    {{"{coil.name}", {where}, {x}, {y}}},')
    return [*lines, "};"]


def _register_table(converter: Converter, number: int, device: Device) -> list[str]:
    """Return the lines of the C header on one converter: address, channels and registers. `number` counts from 0."""
    pin, macro, name = addr_pin_text(converter, device.address), f"{converter.part}_{number}", converter.name
    channels = ", ".join(f"channel {i} is {comment_text(name)}" for i, name in enumerate(device.coils))
    lines = [
        "",
        f"/* Converter {number}, its pin ADDR {pin} ({converter.source_of('cite_address')}): {channels}. */",
        f"#define {macro}_I2C_BUS {device.bus}u",
        f"#define {macro}_I2C_ADDRESS 0x{device.address:02X}u",
        f"#define {macro}_CHANNELS {len(device.coils)}u",
        f"static const {name}_register_t {name}_{number}_config[] = {{",
    ]
    for register in device.registers:
        lines.append(
            f"    {{0x{register.address:02X}u, 0x{register.value:04X}u}}, "
            f"/* {register.name}: {comment_text(register.meaning)} */"
        )
    return [*lines, "};"]


def _value_text(value: float | None, unit: str, digits: int = 4) -> str:
    return show(value, unit, digits) if value is not None else "unknown"
