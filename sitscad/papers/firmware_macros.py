"""Macros of the firmware header beyond the settings: where results are read, and what forces do to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sitscad.estimates.values import CoilEstimate
from sitscad.readout import FAMILIES
from sitscad.scene.state import PRESSED, REST
from sitscad.spec.readout import Converter


def addr_pin(converter: Converter, address: int) -> str:
    """Level of the ADDR pin that selects an address (SNOSCY9A, 8.5.1)."""
    return ("low", "high")[converter.addresses.index(address)]


def result_macros(converter: Converter) -> list[str]:
    """Addresses, mask and flags of the results."""
    family, macro = FAMILIES[converter.family], converter.part
    identity = family.identity()
    lines = [
        "",
        f"/* Results: read MSB before LSB; DATA = (MSB & {macro}_DATA_MSB_MASK) << 16 | LSB, 28 bits, 0x0000000 being",
        " * under-range and 0xFFFFFFF over-range (SNOSCY9A 7.6.2 to 7.6.9). The flags in MSB rise only where",
        " * ERROR_CONFIG lets them (bits 15 to 11: under-range, over-range, watchdog, amplitude high and low; 7.6.27);",
        " * the value below leaves them off. */",
    ]
    for channel in range(converter.channels):
        for word, address in zip(("MSB", "LSB"), family.data_addresses(channel), strict=True):
            lines.append(f"#define {macro}_DATA{channel}_{word} 0x{address:02X}u")
    lines += [
        f"#define {macro}_DATA_MSB_MASK 0x{family.data_mask():04X}u",
        *(
            f"#define {macro}_{name} 0x{mask:04X}u /* {meaning} */"
            for name, (mask, meaning) in family.data_flags().items()
        ),
        f"#define {macro}_STATUS 0x{identity.status_address:02X}u",
        f"#define {macro}_MANUFACTURER_ID_ADDRESS 0x{identity.manufacturer_address:02X}u",
        f"#define {macro}_DEVICE_ID_ADDRESS 0x{identity.device_address:02X}u",
    ]
    return lines


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
    """What the firmware is to expect of a coil: names and values."""
    names = {REST: "L_REST_H", PRESSED: "L_PRESSED_H"}
    found = [
        (names[state], at.converter_inductance)
        for state, at in coil.states.items()
        if state in names and at.converter_inductance is not None
    ]
    change, sigma = coil.converter_sensitivity(force) or (None, None)
    more = (("L_PER_NEWTON_H", change), ("L_PER_NEWTON_SIGMA_H", sigma))
    return found + [(name, value) for name, value in more if value is not None]


def force_document(coil: CoilEstimate, force: float | None) -> dict[str, Any]:
    """The change per newton and its sigma (H/N) for the JSON."""
    change, sigma = coil.converter_sensitivity(force) or (None, None)
    return {"inductance_H_per_N": change, "sigma_inductance_H_per_N": sigma}
