"""Quantities to SI and back: round trips, exactness, and what is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.basics.units import UNITS, UnitError, csv_text, parse_quantity, show

SHOWN_AS = {
    "length": "m",
    "inductance": "H",
    "capacitance": "F",
    "resistance": "ohm",
    "frequency": "Hz",
    "force": "N",
    "pressure": "Pa",
    "conductivity": "S/m",
}
EVERY_UNIT = [(dimension, unit) for dimension, units in UNITS.items() for unit in units]


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("100 um", "length", 1e-4),
        ("0.1 mm", "length", 1e-4),
        (0.1, "length", 1e-4),
        ("0.1", "length", 1e-4),
        ("4 mil", "length", 101.6e-6),
        ("4mil", "length", 101.6e-6),
        ("27.5 µm", "length", 27.5e-6),
        ("27.5 μm", "length", 27.5e-6),
        ("1 in", "length", 0.0254),
        ("1.2 cm", "length", 0.012),
        (7, "length", 0.007),
        ("-2", "length", -0.002),
        (".5 mm", "length", 5e-4),
        ("1e-1 mm", "length", 1e-4),
        ("330 pF", "capacitance", 330e-12),
        ("40 MHz", "frequency", 40e6),
        ("500 Hz", "frequency", 500.0),
        ("4.8 N", "force", 4.8),
        ("300 kPa", "pressure", 300e3),
        ("180 nH", "inductance", 180e-9),
        ("0.3 ohm", "resistance", 0.3),
        ("0.3 Ω", "resistance", 0.3),
        ("58 MS/m", "conductivity", 58e6),
        ("90 deg", "angle", math.pi / 2),
        ("90°", "angle", math.pi / 2),
        (0, "angle", 0.0),
        ("3930 ppm/K", "temperature coefficient", 3.93e-3),
    ],
)
def test_parsed_quantity_is_nearest_double_of_text(text, dimension, value):
    assert parse_quantity(text, dimension) == value


@pytest.mark.parametrize(
    ("text", "dimension", "reason", "hint"),
    [
        ("330", "capacitance", "unit", "330 pF"),
        (330, "capacitance", "unit", "330 pF"),
        (45, "angle", "unit", "90 deg"),
        ("5 Hz", "capacitance", "unit", "pF"),
        ("5 pf", "capacitance", "unit", "did you mean 5 pF"),
        ("5 mhz", "frequency", "unit", "MHz"),
        ("4 .8 N", "force", "unit", "allowed"),
        ("1,5 mm", "length", "number", "1.5 mm"),
        ("abc", "length", "number", "100 um"),
        ("", "length", "number", "100 um"),
        ("0x10 mm", "length", "unit", "allowed"),
        ("1" * 100, "length", "number", ""),
        ("1e400 mm", "length", "range", "too large"),
        (float("nan"), "length", "range", ""),
        (float("inf"), "length", "range", ""),
        (10**400, "length", "range", ""),
        (True, "length", "type", ""),
        (None, "length", "type", ""),
        ([1], "length", "type", ""),
    ],
)
def test_invalid_quantity_raises_unit_error_with_reason_and_hint(text, dimension, reason, hint):
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, dimension)
    assert caught.value.reason == reason
    assert hint in caught.value.hint
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(("dimension", "unit"), EVERY_UNIT)
@settings(max_examples=20, deadline=None)
@given(st.floats(-1e6, 1e6, allow_nan=False, allow_subnormal=False))
def test_every_unit_scales_by_its_factor(dimension, unit, number):
    assert parse_quantity(f"{number!r} {unit}", dimension) == approx(number * float(UNITS[dimension][unit]), rel=1e-12)


@given(st.sampled_from(sorted(SHOWN_AS)), st.floats(1e-12, 1e9), st.integers(3, 12))
def test_shown_quantity_parses_to_equal_value(dimension, value, digits):
    shown = show(value, SHOWN_AS[dimension], digits)
    assert parse_quantity(shown, dimension) == approx(value, rel=0.6 * 10.0 ** (1 - digits))


@given(st.floats(1e-9, 1e3))
def test_bare_numbers_are_millimetres(value):
    assert parse_quantity(value, "length") == parse_quantity(f"{value!r} mm", "length")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.523424e-6, "H", "2.523 uH"),
        (1e-4, "m", "100 um"),
        (0.3, "m", "300 mm"),
        (9.99999e6, "Hz", "10 MHz"),
        (0.999999e-6, "H", "1 uH"),
        (450.0, "ohm", "450 ohm"),
        (0.0, "m", "0 mm"),
        (-4e-9, "H", "-4 nH"),
        (0.25, "", "0.25"),
        (float("nan"), "H", "nan H"),
    ],
)
def test_quantity_is_shown_with_four_digits_and_usual_prefix(value, unit, text):
    assert show(value, unit) == text


@given(st.text(max_size=80), st.sampled_from(sorted(UNITS)))
def test_random_text_gives_finite_quantity_or_unit_error(text, dimension):
    try:
        assert math.isfinite(parse_quantity(text, dimension))
    except UnitError as error:
        assert str(error)


@pytest.mark.parametrize(
    ("written", "meant"), [("40 MHZ", "did you mean 40 MHz? "), ("40 mhz", "did you mean 40 mHz or 40 MHz? ")]
)
def test_capital_m_is_never_read_as_milli(written, meant):
    with pytest.raises(UnitError) as caught:
        parse_quantity(written, "frequency")
    assert caught.value.hint.startswith(meant + "allowed:")


@pytest.mark.parametrize(
    ("written", "celsius"),
    [("98.6 degF", "37 degC"), ("212 F", "100 degC"), ("-40 \N{DEGREE SIGN}F", "-40 degC"), ("310 K", "36.85 degC"),
     ("309.456 K", "36.306 degC"), ("98 degF", "36.6666666667 degC")],
)
def test_temperature_in_fahrenheit_or_kelvin_suggests_celsius_value(written, celsius):
    """Not the same number with another unit: 98 degrees Celsius is no body's temperature."""
    with pytest.raises(UnitError) as caught:
        parse_quantity(written, "temperature")
    assert caught.value.meant == celsius and caught.value.is_sure
    assert parse_quantity(celsius, "temperature") == approx(float(celsius.split()[0]), rel=1e-6)


EVERY_SLIP = sorted({
    (dimension, written)
    for dimension, units in UNITS.items() for unit in units if unit.isascii()
    for written in {unit.swapcase(), unit.upper(), unit.lower(), unit[0].swapcase() + unit[1:]} - set(units)
})
PREFIXES = {"Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "m": -3, "u": -6, "n": -9, "p": -12,
            "f": -15, "a": -18}


@pytest.mark.parametrize(("dimension", "written"), EVERY_SLIP)
def test_wrong_letter_case_is_sure_fix_only_without_prefix_ambiguity(dimension, written):
    """MN is a meganewton to whoever reads it: mN is 1e9 less."""
    with pytest.raises(UnitError) as caught:
        parse_quantity(f"4 {written}", dimension)
    error = caught.value
    if error.meant and error.is_sure and written[0] in PREFIXES:
        assert error.meant.split()[1][0] == written[0], "the letter that scales is as it was written"


@pytest.mark.parametrize(("written", "meant"), [("4000 MN", "4000 mN"), ("330 PF", "330 pF"), ("3 NH", "3 nH")])
def test_different_unit_prefix_is_suggested_without_sure_fix(written, meant):
    dimension = {"N": "force", "F": "capacitance", "H": "inductance"}[written[-1]]
    with pytest.raises(UnitError) as caught:
        parse_quantity(written, dimension)
    assert caught.value.meant == meant
    assert caught.value.is_sure == (written[-2] == "N"), "N is no prefix"


def test_suggested_value_out_of_range_is_removed():
    with pytest.raises(UnitError) as caught:
        parse_quantity("330 MF", "capacitance")
    assert caught.value.candidates == ("330 mF",)
    within = caught.value.in_range("capacitance", 1e-12, 1e-6)
    assert within.candidates == () and within.meant == "" and "330" not in within.hint


@pytest.mark.parametrize("dimension", sorted(set(UNITS) - {"length"}))
def test_missing_unit_message_names_dimension_with_article(dimension):
    with pytest.raises(UnitError) as caught:
        parse_quantity("7", dimension)
    article = "an" if dimension[0] in "aeio" else "a"
    assert f"7 has no unit, and {article} {dimension} needs one" == str(caught.value)


def test_csv_text_quotes_fields_with_commas():
    assert csv_text([("part", "note"), (2, 'thin, "wide"')]) == 'part,note\n2,"thin, ""wide"""\n'
