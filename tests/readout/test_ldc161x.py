"""The LDC1614 against the worked examples of its data sheet and of TI's notes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.readout import FAMILIES, ldc161x
from sitscad.readout.family import ChannelSettings
from sitscad.spec import presets


def test_every_limit_has_a_source_and_a_unit() -> None:
    for name, limit in ldc161x.limits().items():
        assert limit.source and limit.unit, name
        assert math.isfinite(limit.value) and limit.value > 0.0, name


def test_the_drive_table_has_all_codes_and_ends_where_the_data_sheet_ends() -> None:
    rows = ldc161x.drive_currents()
    assert [row.code for row in rows] == list(range(32))
    assert (rows[0].current, rows[31].current) == (16e-6, 1563e-6)
    assert (rows[31].parallel_resistance_min, rows[18].parallel_resistance_max) == (600.0, 6210.0)
    assert ldc161x.limit("parallel_resistance_driveable") == rows[31].parallel_resistance_min


def test_the_windows_of_the_drive_table_are_those_of_the_amplitude_formula() -> None:
    """Smallest R_P of each row gives 1.2 V within 7 % (currents are rounded) by V_P = 4 R_P I / pi."""
    for row in ldc161x.drive_currents():
        assert ldc161x.amplitude(row.parallel_resistance_min, row.code) == approx(1.2, rel=0.07)
        assert 1.6 < ldc161x.amplitude(row.parallel_resistance_max, row.code) < 1.9


@pytest.mark.parametrize(
    ("resistance", "code"),
    [
        (6600.0, 18),  # data sheet 8.2.4
        (5700.0, 19),  # data sheet 6.4, note 6: the reference sensor is driven with 0x9800
        (200e3, 0),
        (300.0, 31),
    ],
)
def test_drive_code(resistance: float, code: int) -> None:
    assert ldc161x.drive_code(resistance) == code


def test_amplitude_of_the_data_sheet_example() -> None:
    assert ldc161x.amplitude(6600.0, 18) == approx(1.78, abs=0.005)


@given(st.floats(620.0, 88e3))
def test_the_code_is_the_highest_that_stays_below_the_clamp(resistance: float) -> None:
    code = ldc161x.drive_code(resistance)
    assert ldc161x.amplitude(resistance, code) < 1.8
    assert code == 31 or ldc161x.amplitude(resistance, code + 1) >= 1.8
    assert ldc161x.amplitude(resistance, code) > 1.15


def test_the_high_current_drive_is_stronger_and_its_range_is_admitted() -> None:
    low, high = ldc161x.high_current_range()
    assert ldc161x.drive_current(31, high_current=True) == high > low > ldc161x.drive_current(31)


@pytest.mark.parametrize(
    ("clock", "channels", "external", "divider"),
    [
        (40e6, 2, True, 1),
        (40e6, 1, True, 2),
        (35e6, 1, True, 1),
        (43.4e6, 4, False, 1),
        (43.4e6, 4, True, 2),
        (2e6, 4, True, 1),
    ],
)
def test_reference_divider(clock: float, channels: int, external: bool, divider: int) -> None:
    assert ldc161x.reference_divider(clock, channels, external) == divider


@pytest.mark.parametrize(
    ("frequency", "reference", "divider"),
    [
        (2.4e6, 40e6, 1),
        (8.7499e6, 40e6, 1),
        (8.75e6, 40e6, 2),
        (9.99e6, 40e6, 2),
        (5e6, 20e6, 2),
        (4.99e6, 20e6, 1),
        (10e6, 20e6, 3),
    ],
)
def test_input_divider(frequency: float, reference: float, divider: int) -> None:
    assert ldc161x.input_divider(frequency, reference) == divider
    assert ldc161x.is_input_in_range(frequency, divider, reference)
    assert divider == 1 or not ldc161x.is_input_in_range(frequency, divider - 1, reference)


def test_no_divider_helps_a_clock_that_is_far_too_slow() -> None:
    divider = ldc161x.input_divider(9e6, 2e6)
    assert divider > 15
    assert not ldc161x.is_input_in_range(9e6, divider, 2e6)
    assert [ldc161x.is_input_in_range(1e6, divider, 40e6) for divider in (0, 1, 15, 16)] == [False, True, True, False]


def test_settle_count_of_the_data_sheet_example() -> None:
    assert approx(5.2, abs=0.01) == 10.0 * 20e6 / (16.0 * 2.4e6)
    assert ldc161x.settle_count(10.0, 20e6, 2.4e6) == 6
    assert ldc161x.settle_time(10, 20e6) == approx(8e-6, rel=1e-6)
    assert ldc161x.settle_count(0.5, 20e6, 9e6) == 4
    assert ldc161x.settle_time(0, 20e6) == ldc161x.settle_time(1, 20e6) == 32 / 20e6


def test_conversion_time_of_the_data_sheet_example() -> None:
    assert ldc161x.conversion_time(1238, 20e6) == approx(991e-6, rel=1e-3)
    assert ldc161x.switch_time(20e6) == approx(0.942e-6, rel=1e-6)


@pytest.mark.parametrize(
    ("rcount", "rate"), [(500, 1225.0), (1024, 604.0), (2000, 311.0), (4000, 156.0), (8000, 78.0), (32768, 19.07)]
)
def test_scan_rate_of_four_channels(rcount: int, rate: float) -> None:
    assert 1.0 / ldc161x.scan_time(rcount, 8, 40e6, 4) == approx(rate, rel=2e-3)


@given(st.floats(10.0, 2000.0), st.integers(4, 400), st.integers(1, 4))
def test_the_reference_count_is_the_largest_that_reaches_the_rate(rate: float, count: int, channels: int) -> None:
    f_ref = 40e6 if channels > 1 else 20e6
    rcount = ldc161x.reference_count(rate, count, f_ref, channels)
    assert 9 <= rcount <= 0xFFFF
    if rcount > 9:
        assert 1.0 / ldc161x.scan_time(rcount, count, f_ref, channels) >= rate * (1.0 - 1e-9)
    if rcount < 0xFFFF:
        assert 1.0 / ldc161x.scan_time(rcount + 1, count, f_ref, channels) < rate


def test_read_back_bounds() -> None:
    assert 1.0 / ldc161x.read_back_time(1) == approx(4.08e3, rel=1e-3)
    assert ldc161x.read_back_time_optimistic(4) == approx(0.688e-3, rel=1e-6)
    assert ldc161x.read_back_time(4) > ldc161x.read_back_time_optimistic(4)


@pytest.mark.parametrize(
    ("data", "frequency", "inductance"), [(16_644_000, 2.480e6, 4.118e-6), (18_840_000, 2.807e6, 3.214e-6)]
)
def test_result_of_ti_spring_example(data: int, frequency: float, inductance: float) -> None:
    """SSZTCH7: 1 nF at 40 MHz."""
    found = ldc161x.sensor_frequency(data, 40e6)
    assert found == approx(frequency, rel=2e-4)
    assert ldc161x.inductance(found, 1e-9) == approx(inductance, rel=2e-4)


def test_inductance_of_the_data_sheet_example() -> None:
    assert ldc161x.inductance(2.4e6, 100e-12) == approx(43.9e-6, rel=3e-3)


def test_offset_and_divider_scale_the_result() -> None:
    plain = ldc161x.sensor_frequency(1 << 24, 40e6)
    assert ldc161x.sensor_frequency(1 << 24, 40e6, divider=2) == 2.0 * plain
    assert ldc161x.sensor_frequency(1 << 24, 40e6, offset=1 << 12) == approx(plain + 40e6 / 16, rel=1e-6)


def test_noise_model_agrees_with_the_anchors() -> None:
    assert ldc161x.frequency_noise(4e6, 0x800) == approx(8e-7 * 40e6, rel=0.15)
    assert ldc161x.frequency_quantum(3.15e6, 3049) == approx(64.5, rel=2e-3)
    assert ldc161x.inductance_noise(2.5e-6, 4e6, 4000) == approx(0.0226e-9, rel=0.01)


def test_supply_current_is_the_converter_and_the_drive_while_it_flows():
    assert ldc161x.supply_current(1.5e-3, 0xFFFF, 0x100, 35e6, 1) == approx(3.6e-3, rel=1e-6)
    scanned = ldc161x.supply_current(1.5e-3, 9, 4, 40e6, 4)
    driven = ldc161x.settle_time(4, 40e6) + ldc161x.conversion_time(9, 40e6)
    assert scanned == approx(2.1e-3 + 1.5e-3 * driven / ldc161x.dwell_time(9, 4, 40e6), rel=1e-6)
    assert 2.1e-3 < scanned < 3.6e-3


def test_a_coil_alone_on_the_second_converter_holds_the_reference_to_single_channel_mode():
    """Table 43 allows 35 MHz to one channel: the fifth coil's converter ran at the 40 MHz that four may have."""
    four = presets.converter("ldc1614")
    assert [four.idlest(coils) for coils in range(1, 9)] == [1, 2, 3, 4, 1, 2, 3, 4]
    assert ldc161x.reference_divider(40e6, four.idlest(5)) == 2
    assert ldc161x.reference_divider(40e6, four.idlest(6)) == 1


def test_converters_are_filled_one_after_the_other():
    two = presets.converter("ldc1612")
    assert (two.needed(3), two.busiest(3), two.idlest(3), two.most_coils) == (2, 2, 1, 4)
    assert [two.channel_of(order).converter_in_words for order in (1, 2, 4)] == [
        "1 (0x2A)", "2 (0x2B)", "3 (no address left)",
    ]  # fmt: skip
    assert two.channel_of(3).pin("B") == "IN1B"


@pytest.mark.parametrize("name", presets.names("converter"))
def test_every_converter_has_a_family_with_addresses_for_its_channels(name):
    device = presets.converter(name)
    family = FAMILIES[device.family]
    assert len({family.data_addresses(channel) for channel in range(device.channels)}) == device.channels
    settings = (ChannelSettings(1238, 6, 1, 2, 18),) * device.channels
    assert family.registers(settings, 2.4e6)[-1].name == "CONFIG"
