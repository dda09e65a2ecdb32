"""Numbers as files write them."""

from __future__ import annotations

import math
from decimal import ROUND_HALF_EVEN, Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitscad.basics.units import fixed_decimals, in_mm


@given(st.floats(-1e6, 1e6), st.integers(0, 9), st.integers(0, 9))
def test_fixed_decimals_rounds_to_nearest_without_exponent(value, most, least):
    least = min(least, most)
    text = fixed_decimals(value, most, least)
    assert Decimal(text) == Decimal(value).quantize(Decimal(1).scaleb(-most), ROUND_HALF_EVEN)
    decimals = text.partition(".")[2]
    assert least <= len(decimals) <= most
    assert len(decimals) == least or not decimals.endswith("0")
    assert "e" not in text and not text.endswith(".")


@pytest.mark.parametrize("value", [-0.0, -1e-9, -4.9e-5])
def test_negative_zero_is_written_as_zero(value):
    assert fixed_decimals(value) == "0" and fixed_decimals(value, 4, 1) == "0.0"


def test_lengths_are_written_in_millimetres():
    assert in_mm(1.25e-3) == "1.25" and in_mm(1e-3, 3, 2) == "1.00" and in_mm(100e-6) == "0.1"
    assert in_mm(-math.ulp(0.0)) == "0"
