"""The LDC1614 against the worked examples of its data sheet and of TI's notes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.converters import reference_counter as law
from sitscad.spec import presets
from tests.converters.conftest import counter

LDC1614 = presets.converter("ldc1614")

WINDOWS = (
    (60000, 90000), (51800, 77600), (44600, 66900), (38400, 57600), (33700, 49700), (29500, 42800), (23600,
    36900), (20500, 31800), (18100, 27400), (16100, 23600), (13100, 20400), (11500, 17600), (9920, 15100),
    (8570, 13000), (7420, 11200), (6460, 9690), (5580, 8350), (4830, 7200), (4450, 6210), (3860, 5350), (3170,
    4610), (2760, 3970), (2220, 3420), (1930, 2950), (1710, 2540), (1480, 2190), (1240, 1890), (1070, 1630),
    (930, 1400), (800, 1210), (700, 1050), (600, 900),
)
"""R_P (ohm) from and to which each code is meant for (SNOSCY9A table 42; the table in SNOSCZ0A 8.1.5 is alike)."""


@pytest.mark.parametrize("name", ["ldc1614", "ldc1314"])
def test_every_converter_limit_has_source_and_unit(name: str) -> None:
    for figure, limit in presets.converter(name).limits.items():
        assert limit.source and limit.unit, figure
        assert math.isfinite(limit.value) and limit.value >= (0.0 if figure == "output_gains" else 1e-15), figure


@pytest.mark.parametrize("name", ["ldc1614", "ldc1314"])
def test_drive_table_has_32_codes_with_data_sheet_ends(name: str) -> None:
    currents = presets.converter(name).drive_currents
    assert len(currents) == len(WINDOWS) == 32 and list(currents) == sorted(currents)
    assert (currents[0], currents[31]) == (16e-6, 1563e-6)
    assert presets.converter(name).limit("parallel_resistance_driveable") == WINDOWS[31][0] == 600.0


def test_drive_table_windows_match_amplitude_formula() -> None:
    """Smallest R_P of each row gives 1.2 V within 7 % (currents are rounded) by V_P = 4 R_P I / pi."""
    for code, (least, most) in enumerate(WINDOWS):
        assert LDC1614.amplitude(least, code) == approx(1.2, rel=0.07)
        assert 1.6 < LDC1614.amplitude(most, code) < 1.9


@pytest.mark.parametrize(
    ("resistance", "code"),
    [
        (6600.0, 18),  # data sheet 8.2.4
        (5700.0, 19),  # data sheet 6.4, note 6: the reference sensor is driven with 0x9800
        (200e3, 0),
        (300.0, 31),
    ],
)
def test_drive_code_of_parallel_resistance_matches_table(resistance: float, code: int) -> None:
    assert LDC1614.drive_code(resistance) == code


def test_amplitude_matches_data_sheet_example() -> None:
    assert LDC1614.amplitude(6600.0, 18) == approx(1.78, abs=0.005)


@given(st.floats(620.0, 88e3))
def test_drive_code_is_highest_with_amplitude_below_1_8_volt(resistance: float) -> None:
    code = LDC1614.drive_code(resistance)
    assert LDC1614.amplitude(resistance, code) < 1.8
    assert code == 31 or LDC1614.amplitude(resistance, code + 1) >= 1.8
    assert LDC1614.amplitude(resistance, code) > 1.15


def test_high_current_drive_exceeds_code_31_with_stated_range() -> None:
    low, high = LDC1614.high_current_range
    assert LDC1614.drive_current(31, high_current=True) == high > low > LDC1614.drive_current(31)


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
def test_reference_divider_has_expected_value(clock: float, channels: int, external: bool, divider: int) -> None:
    assert law.reference_divider(LDC1614, clock, channels, external) == divider


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
def test_input_divider_is_smallest_sufficient(frequency: float, reference: float, divider: int) -> None:
    assert law.input_divider(LDC1614, frequency, reference) == divider
    assert frequency < counter(LDC1614, divider=divider, reference=reference).highest_frequency
    if divider > 1:
        assert frequency >= counter(LDC1614, divider=divider - 1, reference=reference).highest_frequency


def test_input_divider_is_out_of_range_for_too_slow_clock() -> None:
    divider = law.input_divider(LDC1614, 9e6, 2e6)
    assert divider > 15
    slow = counter(LDC1614, divider=divider, reference=2e6)
    assert slow.highest_frequency == 15 * 0.25 * 2e6 < 9e6
    assert slow.slowest_clock(9e6) == 9e6 / 15 / 0.25


def test_settle_count_matches_data_sheet_example() -> None:
    assert approx(5.2, abs=0.01) == 10.0 * 20e6 / (16.0 * 2.4e6)
    assert law.settle_count(LDC1614, 10.0, 20e6, 2.4e6) == 6
    assert counter(LDC1614, settle_count=10, reference=20e6).settle_time == approx(8e-6, rel=1e-6)
    assert law.settle_count(LDC1614, 0.5, 20e6, 9e6) == 4
    assert law.settle_periods(0) == law.settle_periods(1) == 32.0


def test_conversion_time_matches_data_sheet_example() -> None:
    example = counter(LDC1614, 1238, reference=20e6)
    assert example.conversion_time == approx(991e-6, rel=1e-3)
    assert example.switch_time == approx(0.942e-6, rel=1e-6)


@pytest.mark.parametrize(
    ("rcount", "rate"), [(500, 1225.0), (1024, 604.0), (2000, 311.0), (4000, 156.0), (8000, 78.0), (32768, 19.07)]
)
def test_scan_rate_of_four_channels_matches_data_sheet(rcount: int, rate: float) -> None:
    assert 1.0 / law.scan_time(LDC1614, rcount, 8, 40e6, 4) == approx(rate, rel=2e-3)


@given(st.floats(10.0, 2000.0), st.integers(4, 400), st.integers(1, 4))
def test_reference_count_is_largest_that_reaches_scan_rate(rate: float, count: int, channels: int) -> None:
    f_ref = 40e6 if channels > 1 else 20e6
    rcount = law.reference_count(LDC1614, rate, count, f_ref, channels)
    assert 9 <= rcount <= 0xFFFF
    if rcount > 9:
        assert 1.0 / law.scan_time(LDC1614, rcount, count, f_ref, channels) >= rate * (1.0 - 1e-9)
    if rcount < 0xFFFF:
        assert 1.0 / law.scan_time(LDC1614, rcount + 1, count, f_ref, channels) < rate


def test_read_back_times_have_expected_bounds() -> None:
    assert 1.0 / LDC1614.read_back_time(1) == approx(4.08e3, rel=1e-3)
    assert LDC1614.read_back_time_optimistic(4) == approx(0.688e-3, rel=1e-6)
    assert LDC1614.read_back_time(4) > LDC1614.read_back_time_optimistic(4)


@pytest.mark.parametrize(
    ("data", "frequency", "inductance"), [(16_644_000, 2.480e6, 4.118e-6), (18_840_000, 2.807e6, 3.214e-6)]
)
def test_frequency_and_inductance_match_ti_spring_example(data: int, frequency: float, inductance: float) -> None:
    """SSZTCH7: 1 nF at 40 MHz."""
    result = float(counter(LDC1614).frequencies(np.array(data)))
    assert result == approx(frequency, rel=2e-4)
    assert LDC1614.inductance(result, 1e-9) == approx(inductance, rel=2e-4)


def test_inductance_matches_data_sheet_example() -> None:
    assert LDC1614.inductance(2.4e6, 100e-12) == approx(43.9e-6, rel=3e-3)


def test_input_divider_scales_frequency_of_result() -> None:
    data = np.array(1 << 24)
    assert counter(LDC1614, divider=2).frequencies(data) == 2.0 * counter(LDC1614).frequencies(data) == 5e6


def test_noise_model_matches_published_values() -> None:
    """By quantisation alone 35 Hz at 4 MHz and RCOUNT 0x800, against 32 Hz by the 8e-7 of f_REF that Duet3D's firmware
    quotes; 3.3 ppm as measured at RCOUNT 9471.
    """
    assert counter(LDC1614, 0x800).resolution(4e6) / math.sqrt(12.0) == approx(8e-7 * 40e6, rel=0.15)
    assert counter(LDC1614, 3049).resolution(3.15e6) == approx(64.5, rel=2e-3)
    assert counter(LDC1614).noise(5e6) == approx(3.96e-6 * 5e6, rel=1e-3) and counter(LDC1614).rounding(5e6) == 0.0


def test_supply_current_adds_drive_current_by_duty_cycle():
    alone = counter(LDC1614, 0xFFFF, settle_count=0x100, reference=35e6, channels=1)
    assert alone.supply_current(1.5e-3) == approx(3.6e-3, rel=1e-6)
    scan = counter(LDC1614, 9, settle_count=4)
    scanned, driven = scan.supply_current(1.5e-3), scan.settle_time + scan.conversion_time
    assert scanned == approx(2.1e-3 + 1.5e-3 * driven / scan.dwell_time, rel=1e-6)
    assert 2.1e-3 < scanned < 3.6e-3


def test_coils_are_distributed_evenly_over_converters():
    """Table 43 allows 35 MHz to one channel: a fifth coil alone held all to 20 MHz; of six, four had the least time."""
    shares = presets.converter("ldc1614").coils_per_converter
    assert [shares(coils) for coils in (1, 4, 5, 6, 8, 9, 10, 13)] == [
        (1,), (4,), (3, 2), (3, 3), (4, 4), (3, 3, 3), (4, 3, 3), (4, 3, 3, 3),
    ]
    assert [law.reference_divider(LDC1614, 40e6, shares(coils)[-1]) for coils in (1, 5, 9)] == [2, 1, 1]
    assert presets.converter("ldc1612").coils_per_converter(3) == (2, 1)


def test_coils_fill_converters_in_order_then_second_bus():
    two = presets.converter("ldc1612")
    assert two.most_coils == 4
    channels = two.coil_channels(5)
    assert [at.converter_text for at in channels] == ["1 (0x2A)"] * 2 + ["2 (0x2B)"] * 2 + ["3 (bus 2, 0x2A)"]
    assert channels[3].pin("B") == "IN1B"


@pytest.mark.parametrize("name", presets.names("converter"))
def test_each_converter_has_unique_data_addresses_for_its_channels(name):
    device = presets.converter(name)
    addresses = [device.data_addresses(channel) for channel in range(device.channels)]
    assert len(set(addresses)) == device.channels
    written = counter(device, 1238).registers(slice(0, device.channels), (18,) * device.channels, 2.4e6, False)
    assert written[-1].name == "CONFIG"
