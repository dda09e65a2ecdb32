"""One coil without a spec: `sitscad.coil` and the command `sitscad coil`."""

from __future__ import annotations

import json
import re

import pytest
from click.testing import CliRunner
from tolerance import approx

import sitscad
from sitscad.cli import cli
from sitscad.estimates.states.at_frequency import FrequencyError, coils_at

SPIRAL = {"outer_diameter": "8 mm", "turns": 14, "trace_width": "100 um", "trace_spacing": "100 um"}
OPTIONS = ["coil", "--outer-diameter", "8", "--turns", "14", "--trace-width", "100um", "--trace-spacing", "100um"]


@pytest.mark.parametrize(
    "section",
    [
        {}, {"layers": 2}, {"layers": 4, "turns": 9}, {"layers": 3, "turns": [8, 7, 6.5]}, {"shape": "square"},
        {"shape": "racetrack", "outer_diameter": ["12 mm", "8 mm"]}, {"shape": "octagon", "layers": 2, "turns": 10},
    ],
)
def test_coil_function_equals_estimates_of_spec(section):
    section = {"shape": "circle"} | SPIRAL | section
    spec = sitscad.SensorSpec.from_mapping(name="same", coil=section)
    (expected,) = coils_at(sitscad.lay_out(spec), (5e6,))
    result = sitscad.coil(**section, frequency="5 MHz")
    assert result.inductance == approx(expected.winding_inductance, rel=1e-12, abs=0)
    assert result.resistance == approx(expected.winding_resistance, rel=1e-12, abs=0)
    assert result.quality_factor == approx(expected.winding_quality_factor, rel=1e-12, abs=0)
    assert result.parallel_resistance == approx(result.resistance * (1 + result.quality_factor**2), rel=1e-12, abs=0)


def test_coil_arguments_without_unit_are_in_si_units():
    words = sitscad.coil(**SPIRAL, frequency="2 MHz")
    numbers = sitscad.coil(outer_diameter=8e-3, turns=14, trace_width=1e-4, trace_spacing=1e-4, frequency=2e6)
    assert numbers.inductance == words.inductance
    with pytest.raises(sitscad.SpecError, match="8 mm"):
        sitscad.coil(**SPIRAL | {"outer_diameter": 8})


def test_inner_diameter_replaces_turns():
    by_turns = sitscad.coil(**SPIRAL)
    section = {key: value for key, value in SPIRAL.items() if key != "turns"}
    by_inner = sitscad.coil(**section, inner_diameter=by_turns.coil.inner_diameter)
    assert by_inner.coil.most_turns == approx(14.0, rel=1e-9, abs=0)


def test_warm_copper_has_the_resistance_of_warm_copper():
    cold, warm = (sitscad.coil(**SPIRAL, temperature=degrees) for degrees in (20.0, 120.0))
    assert warm.direct_current_resistance / cold.direct_current_resistance == approx(1.393, rel=2e-3, abs=0)


def test_self_resonance_of_a_long_track_is_not_stated():
    item, two = (sitscad.coil(**SPIRAL, layers=layers) for layers in (1, 2))
    assert (item.self_resonance, item.self_resonance_error) == (None, None)
    at = sitscad.coil(**SPIRAL, layers=2, frequency=0.97 * two.self_resonance).at[0]
    assert at.apparent_inductance > 10.0 * at.inductance


@pytest.mark.parametrize("frequency", ["1 kHz", "5 GHz", -1.0, float("nan"), "40 MHz", "8 mm"])
def test_frequencies_without_an_inductance_are_refused(frequency):
    with pytest.raises(FrequencyError):
        sitscad.coil(**SPIRAL, layers=2, frequency=frequency)


def test_json_output_has_values_for_every_frequency():
    run = CliRunner().invoke(cli, [*OPTIONS, "--at", "1MHz", "--at", "5MHz", "--format", "json"], standalone_mode=False)
    document = json.loads(run.output)
    first, second = document["at_frequency"]
    assert (first["frequency_Hz"], second["frequency_Hz"]) == (1e6, 5e6)
    assert second["inductance_H"] == sitscad.coil(**SPIRAL, frequency=5e6).inductance
    assert 0.0 < second["inductance_error"] < 0.01
    assert 0.0 < second["resistance_error"] < 0.02
    assert [each["method"] for each in document["formulas"]] == ["current-sheet"]


def test_published_formula_is_printed_beside_computed_inductance():
    result = sitscad.coil(**SPIRAL)
    assert result.formulas[0].inductance == approx(result.inductance, rel=0.05, abs=0)
    run = CliRunner().invoke(cli, OPTIONS, standalone_mode=False)
    assert re.search(r"current-sheet +1 uH +\+1\.3 % +yes", run.output)
    long = sitscad.coil(**SPIRAL | {"outer_diameter": ["12 mm", "8 mm"]}, shape="racetrack")
    assert not long.formulas and long.no_formula


@pytest.mark.parametrize(
    ("changed", "option"),
    [
        (["--turns", "34"], "--turns"), (["--turns", "many"], "--turns"),
        (["--outer-diameter", "8um"], "--outer-diameter"),
        (["--shape", "star"], "--shape"), (["--stackup", "mine"], "--stackup"), (["--layers", "9"], "--layers"),
        (["--trace-width", "0"], "--trace-width"), (["--inner-diameter", "9"], "--inner-diameter"),
    ],
)
def test_impossible_dimension_names_its_option(changed, option, tmp_path):
    arguments = [*OPTIONS, *changed, "--svg", str(tmp_path / "coil.svg")]
    if changed[0] == "--inner-diameter":
        arguments = [each for each in arguments if each not in ("--turns", "14")]
    run = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert run.return_value == 2
    assert option in run.stderr
    assert not list(tmp_path.iterdir())


def test_coil_command_writes_picture_and_footprint(tmp_path):
    svg, footprint = tmp_path / "coil.svg", tmp_path / "coil.kicad_mod"
    run = CliRunner().invoke(
        cli, [*OPTIONS, "--layers", "2", "--svg", str(svg), "--kicad-mod", str(footprint)], standalone_mode=False)
    assert run.return_value == 0
    spiral = sitscad.coil(**SPIRAL, layers=2)
    assert svg.read_text() == spiral.picture()
    assert footprint.read_text() == spiral.footprint()
    assert footprint.read_text().count("(fp_arc") > 50
