"""The register values against the data sheet's two recommended configurations (tables 47 and 48)."""

from __future__ import annotations

import pytest

from sitscad.kernels.converters.ldc_registers import deglitch, mux_config, registers
from sitscad.kernels.converters.registers import ChannelSettings as Channel
from sitscad.spec import presets

LDC1614 = presets.converter("ldc1614")

EXAMPLE = Channel(rcount=1238, settle_count=10, input_divider=1, reference_divider=2, drive_code=18)

OWN = {0x19: 0xF801}
"""Where we differ from those tables: they leave all errors off. OFFSETs are written, too, at their default."""

TABLE_47 = {0x08: 0x04D6, 0x10: 0x000A, 0x14: 0x1002, 0x19: 0x0000, 0x1B: 0x020C, 0x1E: 0x9000, 0x1A: 0x1601}
TABLE_48 = {
    0x08: 0x04D6, 0x09: 0x04D6, 0x10: 0x000A, 0x11: 0x000A, 0x14: 0x1002, 0x15: 0x1002, 0x19: 0x0000, 0x1B: 0x820C,
    0x1E: 0x9000, 0x1F: 0x9000, 0x1A: 0x1601,
}


@pytest.mark.parametrize(("channels", "table"), [((EXAMPLE,), TABLE_47), ((EXAMPLE, EXAMPLE), TABLE_48)])
def test_ldc161x_recommended_registers_match_data_sheet(channels: tuple[Channel, ...], table: dict[int, int]) -> None:
    written = registers(channels, 2.4e6)
    offsets = [(r.address, r.value) for r in written if r.name.startswith("OFFSET")]
    assert offsets == [(0x0C + n, 0) for n in range(len(channels))]
    rest = [(r.address, r.value) for r in written if not r.name.startswith("OFFSET")]
    assert rest == list((table | OWN).items())
    assert written[-1].name == "CONFIG"


def test_four_channels_write_each_numbered_register_once() -> None:
    written = registers((EXAMPLE,) * 4, 9.4e6)
    assert len({r.address for r in written}) == len(written) == 5 * 4 + 3
    assert next(r.value for r in written if r.name == "MUX_CONFIG") == 0xC20D
    assert [r.name for r in written if r.name.startswith("DRIVE")] == [f"DRIVE_CURRENT{n}" for n in range(4)]
    assert all(0 <= r.value <= 0xFFFF and r.meaning for r in written)


@pytest.mark.parametrize(
    ("frequency", "bits"), [(0.9e6, 0b001), (2.4e6, 0b100), (2.8e6, 0b100), (9.9e6, 0b101), (10e6, 0b111)]
)
def test_deglitch_bandwidth_is_smallest_above_sensor_frequency(frequency: float, bits: int) -> None:
    assert deglitch(frequency) == bits


def test_register_fields_have_expected_bits() -> None:
    assert [LDC1614.data_addresses(channel) for channel in range(4)] == [(0, 1), (2, 3), (4, 5), (6, 7)]
    assert mux_config(3, 5e6) == 0xA20D
    values = {r.name: r.value for r in registers((Channel(1238, 10, 2, 1, 19),), 5e6, False, True)}
    assert (values["CLOCK_DIVIDERS0"], values["DRIVE_CURRENT0"], values["CONFIG"]) == (0x2001, 0x9800, 0x1441)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: registers((Channel(1238, 10, 16, 1, 18),), 2.4e6),
        lambda: registers((Channel(1238, 10, 1, 0, 18),), 2.4e6),
        lambda: registers((Channel(1238, 10, 1, 2, 32),), 2.4e6),
        lambda: LDC1614.data_addresses(4),
        lambda: registers((EXAMPLE,) * 5, 2.4e6),
        lambda: registers((EXAMPLE, EXAMPLE), 2.4e6, high_current=True),
        lambda: registers((Channel(8, 10, 1, 2, 18),), 2.4e6),
        lambda: registers((Channel(1238, 3, 1, 2, 18),), 2.4e6),
        lambda: registers((Channel(1238, 0x10000, 1, 2, 18),), 2.4e6),
        lambda: registers((Channel(0x10000, 10, 1, 2, 18),), 2.4e6),
        lambda: registers((), 2.4e6),
    ],
)
def test_register_values_out_of_range_are_refused(wrong) -> None:
    with pytest.raises(ValueError, match=r"must lie|channel"):
        wrong()
