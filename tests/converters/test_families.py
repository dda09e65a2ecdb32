"""Families of converters that nobody makes, added by their data: what is derived of the data, and what is refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from tolerance import approx

import sitscad
from sitscad.apps.hardware.bench_board import GOOD, Board
from sitscad.files.documents import firmware
from sitscad.files.formats.kicad.schematic import parts
from sitscad.kernels.converters import ldc_registers
from sitscad.kernels.converters import reference_counter as law
from sitscad.spec import presets
from tests.hardware.conftest import TEMPLATES


@pytest.fixture
def add_family(data):
    """A converter called ldc9914 that has the figures of another's family but for those given, from data alone."""

    def add(like: str, family: str, **figures: object):
        lines = (data / f"converters/{like}.csv").read_text().splitlines()
        for name, value in figures.items():
            lines = [f"{name},{value},{line.split(',')[2]},verified,invented" if line.startswith(f"{name},") else line
                     for line in lines]
        (data / f"converters/{family}.csv").write_text("\n".join(lines) + "\n")
        with (data / "converters.csv").open("a") as table:
            table.write(f"ldc9914,{family},4,0x2A 0x2B,,verified,invented\n")
        return presets.converter("ldc9914")

    return add


def test_result_width_that_overlaps_flag_bits_is_refused(add_family):
    """A header built for such a family said 0x0FFF, and its readings lost two bits without a word."""
    with pytest.raises(ValueError, match="LDC9914: results of 14 bits take the bits of ERR_WD, ERR_AE"):
        add_family("ldc131x", "fourteen", result_bits=14)


@pytest.mark.parametrize(("like", "bits", "mask"), [
    ("ldc131x", 14, 0x3FFF), ("ldc131x", 12, 0x0FFF), ("ldc131x", 10, 0x03FF), ("ldc161x", 28, 0x0FFF),
    ("ldc161x", 25, 0x01FF),
])
def test_c_header_and_bench_use_result_bits_of_family(add_family, monkeypatch, like, bits, mask):
    registers = dict(vars(ldc_registers))
    registers["DATA_FLAGS"] = {  # of 14 bits the flags are two: those of oscillation stand for each other
        name: (0x4000 if bits == 14 and bit < 0x4000 else bit, message)
        for name, (bit, message) in ldc_registers.DATA_FLAGS.items()
    }
    monkeypatch.setitem(sys.modules, "sitscad.kernels.converters.other_registers", SimpleNamespace(**registers))
    device = add_family(like, f"{like}_{bits}", result_bits=bits, register_map="other_registers")
    assert device.result_mask == mask
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    design = sitscad.Design(replace(spec, readout=replace(spec.readout, device=device)))

    header = firmware.render(design.spec, design.estimates)["firmware/ldc9914_config.h"].decode()
    words = device.result_words
    assert f"_{'DATA_' + words[0] if len(words) > 1 else 'DATA'}_MASK 0x{mask:04X}u" in header

    conversion = design.estimates.readout.conversion
    rest = [coil.states["rest"].frequency for coil in design.estimates.coils]
    offsets = conversion.offsets or (0, 0)
    results = [round(float(conversion.counts(frequency)) - offset) // conversion.counts_per_step
               for frequency, offset in zip(rest, offsets, strict=True)]
    held = {ldc_registers.STATUS: ldc_registers.UNREAD | ldc_registers.UNREAD >> 1}
    for channel, result in enumerate(results):
        parts = [result >> 16, result & 0xFFFF] if len(words) > 1 else [result]
        held |= dict(zip(device.data_addresses(channel), parts, strict=True))
    board = Board(design, [SimpleNamespace(read=held.get)])
    read = board.poll(0.0)
    assert [read[coil].status for coil in (0, 1)] == [GOOD, GOOD]
    for coil, frequency in enumerate(rest):
        assert abs(board.frequency(read[coil].counts) - frequency) <= conversion.result_step


def test_pins_and_delay_are_read_from_family_data(add_family):
    """The schematic drew TI's pins for any family."""
    pins = "VDD:power_in GND:power_in SDA:bidirectional SCL:input"
    device = add_family("ldc161x", "other_pins", pins=pins, switch_delay=1e-6)
    assert law.switch_time(device, 20e6) == approx(1.25e-6, rel=1e-9, abs=0)
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    design = sitscad.Design(replace(spec, readout=replace(spec.readout, device=device)))
    drawn = next(part for part in parts(design.layout, design.estimates.readout.capacitance) if part.reference == "U1")
    assert [(pin.number, pin.name, pin.kind) for pin in drawn.left] == [
        (1, "VDD", "power_in"), (2, "GND", "power_in"), (3, "SDA", "bidirectional"), (4, "SCL", "input")
    ]
    assert [pin.number for pin in drawn.right] == [*range(5, 14)]
