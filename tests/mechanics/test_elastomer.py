"""The bonded pad against its limits, its inverse, and the thesis's miniature."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.mechanics.elastomer import Face, compress, compress_part, force_for_strain, shape_factor

BULK = 1.5e9
WIDTHS, MODULI = st.floats(0.5e-3, 20e-3), st.floats(5e3, 1e6)


@pytest.mark.parametrize(
    ("modulus", "strain"),
    [(39.4e3, 0.57), (14.4e3, 0.73)],
    ids=["Ecoflex 00-30 by its data sheet", "Ecoflex 00-30 as measured"],
)
def test_thesis_pad_under_4_8_newton_is_strained_beyond_valid_range(modulus: float, strain: float) -> None:
    result = compress(Face(4e-3, 4e-3), 2e-3, modulus, BULK, 4.8)
    assert result.strain == approx(strain, abs=0.015)
    assert result.gap == approx(2e-3 * (1 - result.strain), rel=1e-6)
    assert not result.valid and "extrapolated" in result.note


def test_shape_factor_matches_textbook_values() -> None:
    assert shape_factor(Face(4e-3, 4e-3), 2e-3) == approx(0.5, rel=1e-6)
    assert shape_factor(Face(4e-3, 4e-3, 1.0), 1e-3) == approx(1.0, rel=1e-6)
    assert shape_factor(Face(8e-3, 4e-3), 1e-3) == approx(8 * 4 / (2 * 12), rel=1e-6)


def test_shape_factor_of_ellipse_is_between_its_discs() -> None:
    small, between, large = (
        shape_factor(Face(a, b, 1.0), 1e-3) for a, b in ((4e-3, 4e-3), (6e-3, 4e-3), (6e-3, 6e-3))
    )
    assert small < between < large


def test_apparent_modulus_is_limited_by_bulk_modulus() -> None:
    assert compress(Face(4.0, 4.0), 1e-3, 50e3, BULK, 0.0).apparent_modulus < BULK
    assert compress(Face(400.0, 400.0), 1e-3, 50e3, BULK, 0.0).apparent_modulus == approx(BULK, rel=1e-2)
    assert compress(Face(1e-6, 1e-6), 1e-3, 50e3, math.inf, 0.0).apparent_modulus == approx(150e3, rel=0.01)


@given(WIDTHS, WIDTHS, st.floats(0.2e-3, 5e-3), MODULI, st.floats(0.0, 0.95), st.booleans())
def test_compression_inverts_force(a: float, b: float, h: float, mu: float, strain: float, circular: bool) -> None:
    force = force_for_strain(strain, Face(a, b, circular), h, mu, BULK)
    assert compress(Face(a, b, circular), h, mu, BULK, force).strain == approx(strain, abs=1e-12)


@given(WIDTHS, st.floats(0.2e-3, 5e-3), MODULI)
def test_small_force_strain_is_linear(a: float, h: float, mu: float) -> None:
    modulus = compress(Face(a, a), h, mu, BULK, 0.0).apparent_modulus
    force = 1e-9 * modulus * a**2
    assert compress(Face(a, a), h, mu, BULK, force).strain == approx(1e-9, rel=1e-7)


@example(0.5e-3, 0.2e-3, 734035.0, 145.0)  # 159.5 N met a secant from a strain of 1
@given(WIDTHS, st.floats(0.2e-3, 5e-3), MODULI, st.floats(1e-6, 1e6))
def test_strain_rises_with_force_and_stays_below_1(a: float, h: float, mu: float, force: float) -> None:
    item, other = compress(Face(a, a), h, mu, BULK, force), compress(Face(a, a), h, mu, BULK, 1.1 * force)
    assert 0.0 < item.strain <= other.strain < 1.0
    assert item.gap > 0.0
    assert item.valid == (item.strain <= 0.3 and a <= 8.0 * h)


def test_zero_force_gives_zero_strain() -> None:
    assert compress(Face(4e-3, 4e-3), 1e-3, 50e3, BULK, 0.0).strain == 0.0


def test_slender_pad_force_matches_neo_hookean_bar() -> None:
    """S -> 0: F/A = mu (1/lambda^2 - lambda)."""
    force = force_for_strain(0.4, Face(1e-3, 1e-3), 1.0, 50e3, math.inf)
    assert force / 1e-6 == approx(50e3 * (0.6**-2 - 0.6), rel=1e-3)


@pytest.mark.parametrize(
    "wrong", [(0.0, 1e-3, 5e4, 1e9, 1.0), (4e-3, 1e-3, -1.0, 1e9, 1.0), (4e-3, 1e-3, 5e4, 1e9, -1.0)]
)
def test_impossible_pads_are_refused(wrong: tuple[float, ...]) -> None:
    with pytest.raises(ValueError):
        compress(Face(wrong[0], 4e-3), *wrong[1:])
    with pytest.raises(ValueError):
        force_for_strain(1.0, Face(4e-3, 4e-3), 1e-3, 5e4, 1e9)


SQUARE = Face(8e-3, 8e-3)


def test_target_smaller_than_pad_compresses_more_than_full_target():
    """What erred on the unsafe side: the whole pad was taken as loaded, and the strain came out too low."""
    part = compress_part(SQUARE, Face(4e-3, 4e-3), 1e-3, 60e3, BULK, 4.8)
    whole = compress_part(SQUARE, SQUARE, 1e-3, 60e3, BULK, 4.8)
    alone = compress(Face(4e-3, 4e-3), 1e-3, 60e3, BULK, 4.8)
    assert part.strain == alone.strain > 3.0 * whole.strain
    assert part.least_strain == whole.strain == whole.least_strain
    assert part.loaded_share == approx(0.25, rel=1e-6) and part.loaded_area == approx(16e-6, rel=1e-6)
    assert not part.valid and "25 % of the pad" in part.note
    assert whole.valid and whole.strain_uncertainty == 0.0
    assert part.strain_uncertainty == approx((part.strain - whole.strain) / math.sqrt(3.0), rel=1e-6)


def test_pads_too_long_or_wide_for_formula_are_marked_invalid():
    assert compress(Face(9e-3, 3e-3), 1e-3, 60e3, BULK, 1.0).valid
    assert "so wide" in compress(Face(20e-3, 20e-3), 1e-3, 60e3, BULK, 1.0).note
    long = compress(Face(12e-3, 3e-3), 1e-3, 60e3, BULK, 1.0)
    assert not long.valid and "4 times as long" in long.note


@given(WIDTHS, WIDTHS, st.floats(0.1, 1.0), st.floats(0.1, 1.0), st.booleans(), st.floats(0.2e-3, 5e-3), MODULI,
       st.floats(0.01, 50.0))
def test_smaller_target_never_compresses_less(a, b, along, across, is_round, h, mu, force):
    result = compress_part(Face(a, b, is_round), Face(along * a, across * b, is_round), h, mu, BULK, force)
    assert result.strain >= result.least_strain
    assert 0.0 < result.loaded_share <= 1.0 + 1e-12
