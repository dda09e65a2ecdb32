"""Macros of the firmware header beyond the settings: where results are read, and what forces do to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sitscad.estimates.values import CoilEstimate, ReadoutEstimate
from sitscad.readout.converter import Converter
from sitscad.scene.state import PRESSED, REST


def addr_pin(converter: Converter, address: int) -> str:
    """Level of the ADDR pin that selects an address."""
    return ("low", "high")[converter.addresses.index(address)]


def result_macros(converter: Converter, readout: ReadoutEstimate) -> list[str]:
    """Addresses, mask and flags of the results."""
    registers, macro, words = converter.register_map, converter.part, converter.result_words
    upper = f"DATA_{words[0]}" if len(words) > 1 else "DATA"
    largest, digits = 2**converter.bits - 1, -(-converter.bits // 4)
    ends = f"{converter.bits} bits, 0x{0:0{digits}X} being"
    over = f"0x{largest:0{digits}X} over-range ({converter.source_of('cite_results')})"
    if len(words) > 1:
        first, second = words
        lines = [
            f"/* Results: read {first} before {second}; "
            f"DATA = ({first} & {macro}_{upper}_MASK) << 16 | {second}, {ends}",
            f" * under-range and {over}. The flags in {first} rise only where",
        ]
    else:
        lines = [
            f"/* Results: DATA = register & {macro}_{upper}_MASK, {ends} under-range and",
            f" * {over}. The flags above them rise only where",
        ]
    lines += [
        " * ERROR_CONFIG lets them (bits 15 to 11: under-range, over-range, watchdog, amplitude high and low; "
        f"{converter.source_of('cite_errors')});",
        " * the value below lets all. */",
    ]
    for channel in range(converter.channels):
        for word, address in zip(words, converter.data_addresses(channel), strict=True):
            ending = f"_{word}" if len(words) > 1 else ""
            lines.append(f"#define {macro}_DATA{channel}{ending} 0x{address:02X}u")
    return [
        "",
        *lines,
        f"#define {macro}_{upper}_MASK 0x{registers.DATA_MASK:04X}u",
        *(
            f"#define {macro}_{name} 0x{mask:04X}u /* {meaning} */"
            for name, (mask, meaning) in registers.DATA_FLAGS.items()
        ),
        f"#define {macro}_STATUS 0x{registers.STATUS:02X}u",
        f"#define {macro}_MANUFACTURER_ID_ADDRESS 0x{registers.MANUFACTURER_ID:02X}u",
        f"#define {macro}_DEVICE_ID_ADDRESS 0x{registers.DEVICE_ID:02X}u",
        *_counts(converter, readout),
    ]


def _counts(converter: Converter, readout: ReadoutEstimate) -> list[str]:
    """What makes counts of results that show a part of a conversion; nothing where they show all."""
    conversion = readout.conversion
    if not converter.has_gains or conversion is None:
        return []
    macro, name = converter.part, converter.name
    offsets = ", ".join(f"{offset}u" for offset in readout.offsets)
    return [
        "",
        f"/* A conversion has {converter.count_bits} bits, a result {converter.bits} of them: OUTPUT_GAIN and OFFSETx "
        "of the settings below say which.",
        f" * COUNTS makes a conversion of a coil's DATA (coil: its place in {name}_coils), which calibration.h takes:",
        " * counts of one coil are to each other as its frequencies. */",
        f"#define {macro}_DATA_SHIFT {conversion.shift}u",
        f"#define {macro}_COUNTS(coil, data) \\",
        f"    (((uint32_t)((data) & {macro}_DATA_MASK) << {macro}_DATA_SHIFT) + {name}_offsets[coil])",
        f"static const uint16_t {name}_offsets[] = {{{offsets}}};",
    ]


def result_document(converter: Converter, readout: ReadoutEstimate) -> dict[str, Any]:
    """For the JSON what makes counts of results, with the coils' offsets; nothing where results are counts."""
    conversion = readout.conversion if converter.has_gains else None
    if conversion is None:
        return {}
    return {
        "result_bits": converter.bits, "count_bits": converter.count_bits, "output_gain": readout.output_gain,
        "result_shift": conversion.shift,
    }


def force_macros(converter: Converter, coils: Sequence[CoilEstimate], force: float | None) -> list[str]:
    """Expected inductance by the formula at rest and pressed, and its change per newton with one sigma."""
    found = [(index, *row) for index, coil in enumerate(coils) for row in _expected(coil, force)]
    if not found:
        return []
    macro = converter.part
    return [
        "",
        f"/* Expected inductance by the formula (H), by the coil's place in {converter.name}_coils: "
        "at rest without force,",
        f" * pressed by {macro}_FORCE_PRESSED_N on the middle of the target, and the change per newton between the two",
        " * (H/N), a secant and no curve, with one sigma of manufacture. Estimates: calibrate every sensor. */",
        *([f"#define {macro}_FORCE_PRESSED_N {force:.9e}"] if force else []),
        *(f"#define {macro}_COIL{index}_{name} {value:.9e}" for index, name, value in found),
    ]


def _expected(coil: CoilEstimate, force: float | None) -> list[tuple[str, float]]:
    names = {REST: "L_REST_H", PRESSED: "L_PRESSED_H"}
    found = [
        (names[state], at.converter_inductance)
        for state, at in coil.states.items()
        if state in names and at.converter_inductance is not None
    ]
    change, sigma = coil.converter_sensitivity(force) or (None, None)
    more = (("L_PER_NEWTON_H", change), ("L_PER_NEWTON_SIGMA_H", sigma))
    return found + [(name, value) for name, value in more if value is not None]
