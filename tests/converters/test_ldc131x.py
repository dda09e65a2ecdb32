"""LDC1312 and LDC1314 against their data sheet's examples, and what a result of twelve bits shows of a conversion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.converters import reference_counter as law
from sitscad.kernels.converters.ldc_registers import registers
from sitscad.kernels.converters.registers import ChannelSettings
from sitscad.spec import presets
from tests.converters.conftest import counter

LDC1314 = presets.converter("ldc1314")
GAINS = range(4)


def test_ldc131x_parameters_match_data_sheet() -> None:
    assert (LDC1314.bits, law.gains(LDC1314), law.count_bits(LDC1314)) == (12, (0, 2, 3, 4), 16)
    assert LDC1314.device_id == 0x3054
    assert [LDC1314.data_addresses(channel) for channel in range(4)] == [(0x00,), (0x02,), (0x04,), (0x06,)]
    assert presets.converter("ldc1312").channels == 2
    with pytest.raises(ValueError, match="must lie"):
        presets.converter("ldc1312").data_addresses(2)
    assert 1.0 / LDC1314.read_back_time_optimistic(1) == approx(13.3e3, rel=1e-3)


EXAMPLE = ChannelSettings(rcount=1238, settle_count=10, input_divider=1, reference_divider=2, drive_code=18)

RECOMMENDED = {
    0x08: 0x04D6, 0x09: 0x04D6, 0x10: 0x000A, 0x11: 0x000A, 0x14: 0x1002, 0x15: 0x1002, 0x19: 0x0000, 0x1B: 0x820C,
    0x1E: 0x9000, 0x1F: 0x9000, 0x1A: 0x1601,
}
"""SNOSCZ0A 8.2.5, multi-channel operation: it leaves offset and gain as they are after reset, at 0."""


def test_ldc131x_recommended_registers_match_data_sheet() -> None:
    written = {r.address: r.value for r in registers((EXAMPLE, EXAMPLE), 2.4e6, output_gain=0)}
    own = RECOMMENDED | {0x19: 0xF801}  # the maker's leaves all errors off
    assert {address: written.pop(address) for address in RECOMMENDED} == own
    assert written == {0x0C: 0, 0x0D: 0, 0x1C: 0}


def test_gain_and_offset_registers_are_written_before_wake_up() -> None:
    """OUTPUT_GAIN in bits 10:9 of RESET_DEV (7.6.26), OFFSETx 0x0C to 0x0F; by hand."""
    settings = tuple(ChannelSettings(1238, 10, 1, 2, 18, offset) for offset in (0, 1, 0x1543, 0xFFFF))
    written = registers(settings, 2.4e6, output_gain=3)
    values = {r.name: (r.address, r.value) for r in written}
    assert [values[f"OFFSET{n}"] for n in range(4)] == [(0x0C, 0), (0x0D, 1), (0x0E, 0x1543), (0x0F, 0xFFFF)]
    assert values["RESET_DEV"] == (0x1C, 0x0600) and written[-1].name == "CONFIG"
    gains = [registers(settings, 2.4e6, output_gain=code)[-6].value for code in GAINS]
    assert gains == [0, 0x200, 0x400, 0x600]
    for wrong in (ChannelSettings(1238, 10, 1, 2, 18, -1), ChannelSettings(1238, 10, 1, 2, 18, 1 << 16)):
        with pytest.raises(ValueError, match="OFFSET"):
            registers((wrong,), 2.4e6)
    with pytest.raises(ValueError, match="OUTPUT_GAIN"):
        registers(settings, 2.4e6, output_gain=4)
    assert "RESET_DEV" not in {r.name for r in registers(settings, 2.4e6)}


@pytest.mark.parametrize(("code", "reported"), [(0, 0x07A), (3, 0x7A3)])
def test_result_is_shifted_part_of_conversion_in_data_sheet_example(code: int, reported: int) -> None:
    """SNOSCZ0A 8.1.3.2: of the conversion 0x07A3 results are 0x07A without gain and 0x7A3 with the highest."""
    conversion = counter(LDC1314, gain=code, offsets=(0,))
    frequency = 40e6 * (reported << conversion.omitted_low_bits) / 2.0**16
    assert conversion.read(np.array([[frequency]]))[0, 0] == reported << conversion.omitted_low_bits
    assert (reported << conversion.omitted_low_bits) >> conversion.omitted_low_bits == reported
    assert 0x07A3 >> conversion.omitted_low_bits == reported


def by_the_data_sheet(data: int, code: int, offset: int, divider: int, reference: float) -> float:
    """Sensor frequency (Hz; SNOSCZ0A 8.1.3.1)."""
    return divider * reference * (data / 2.0 ** (12 + (0, 2, 3, 4)[code]) + offset / 2.0**16)


@given(st.integers(1, 0xFFE), st.sampled_from(GAINS), st.integers(0, 0x3FFF), st.integers(1, 15), st.floats(2e6, 40e6))
def test_result_converts_to_counts_and_frequency_and_back(
    data: int, code: int, offset: int, divider: int, reference: float
) -> None:
    conversion = counter(LDC1314, 9471, divider, code, (offset,), reference)
    counts = (data << conversion.omitted_low_bits) + offset
    frequency = by_the_data_sheet(data, code, offset, divider, reference)
    assert float(conversion.frequencies(np.array(counts))) == approx(frequency, rel=1e-12)
    assert conversion.read(np.array([[frequency]]))[0, 0] == counts
    least, most = conversion.ends(0)
    assert least < counts < most and most - least == 0xFFF << conversion.omitted_low_bits
    assert conversion.result_step == approx(
        by_the_data_sheet(data + 1, code, offset, divider, reference) - frequency, rel=1e-6
    )


@given(st.lists(st.tuples(st.floats(1e5, 9.9e6), st.floats(0.0, 0.3)), min_size=1, max_size=4), st.floats(8e6, 40e6))
def test_chosen_offset_and_gain_keep_results_inside_range(bands: list[tuple[float, float]], reference: float) -> None:
    """Whatever the frequencies are, each has its result, a quarter of the range from its ends where there is gain."""
    ends = [(low, low * (1.0 + wide)) for low, wide in bands]
    divider = max(law.input_divider(LDC1314, high, reference) for _, high in ends)
    gain, offsets = law.choose_gain(LDC1314, divider * reference, ends)
    conversion = counter(LDC1314, 9471, divider, gain, offsets, reference)
    margin = 0.24 * 2**12 if law.gains(LDC1314)[gain] else 0.0
    for coil, (low, high) in enumerate(ends):
        least, most = conversion.ends(coil)
        below, above = (conversion.counts(np.array(f)) for f in (low, high))
        assert above <= most - margin * 2**conversion.omitted_low_bits and below > least
        assert offsets[coil] == 0 or below >= least + margin * 2**conversion.omitted_low_bits
        assert 0 <= offsets[coil] <= 0xFFFF and offsets[coil] % 2**conversion.omitted_low_bits == 0


@pytest.mark.parametrize(
    ("width", "bits"), [(0.0, 4), (0.031, 4), (0.032, 3), (0.062, 3), (0.063, 2), (0.12, 2), (0.13, 0)]
)
def test_finest_gain_that_fits_the_frequency_range_is_chosen(width: float, bits: int) -> None:
    """Half of 6.25, 12.5 and 25 % of full scale: the output ranges of SNOSCZ0A 8.1.3.2."""
    gain, _ = law.choose_gain(LDC1314, 40e6, [(5e6, 5e6), (5e6, 5e6 + width * 40e6)])
    assert law.gains(LDC1314)[gain] == bits


def test_converter_without_gain_stage_gets_gain_zero() -> None:
    assert law.choose_gain(presets.converter("ldc1614"), 40e6, [(5e6, 6e6)]) == (0, ())


def test_resolution_is_coarser_of_result_step_and_count_step() -> None:
    """At 2.8 uH and 5 MHz a step was told as 25 pH, which is the counting's; without gain it is 11 nH."""
    settings = (9471, 0), (9471, 3), (50, 3)
    plain, gained, short = (counter(LDC1314, rcount, gain=gain) for rcount, gain in settings)
    assert 2.0 * 2.8e-6 * plain.resolution(5e6) / 5e6 == approx(10.94e-9, rel=1e-3)
    assert plain.resolution(5e6) == 40e6 / 2**12 and gained.resolution(5e6) == 40e6 / 2**16
    assert short.resolution(5e6) == 5e6 / (16 * 50)


def test_noise_combines_counting_noise_and_rounding() -> None:
    coarse, fine = counter(LDC1314, gain=3), counter(LDC1314, 50, gain=3)
    counted = 1.2 * 5e6 / (32 * 9471)
    assert coarse.noise(5e6) == approx(math.hypot(counted, 40e6 / 2**16 / math.sqrt(12.0)), rel=1e-9)
    assert fine.noise(5e6) == approx(1.2 * 5e6 / (32 * 50), rel=1e-9)


def test_frequency_outside_result_range_reads_nan() -> None:
    conversion = counter(LDC1314, gain=3, offsets=(6000, 0))
    read = conversion.read(np.array([[6000, 4095], [6001, 4094], [10094, 1], [10095, 0]]) * 40e6 / 2**16)
    assert np.array_equal(np.isnan(read), [[True, True], [False, False], [False, False], [True, True]])


def test_ldc131x_findings_cite_only_its_data_sheet() -> None:
    """The rules' texts name both; a finding names the one of its converter."""
    from sitscad.checks.judging import RULES

    texts = [rule.source for rule in RULES if "SNOSC" in rule.source]
    assert len(texts) > 5 and all("SNOSCY9A" in text and "SNOSCZ0A" in text for text in texts)
    for text in texts:
        if "coupled oscillators" not in text:
            own = LDC1314.text_with_own_sources(text)
            assert "SNOSCY9A" not in own and "SNOSCZ0A" in own
