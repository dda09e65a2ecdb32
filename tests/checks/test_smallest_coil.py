"""SIT222 and its table: the smallest coil that senses with the coil tracks of a fabricator's profile."""

from __future__ import annotations

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.basics.units import parse_quantity
from sitscad.data import rows
from sitscad.layout.windings import wind_all
from sitscad.spec.load import load_text

ROWS = rows("smallest_coils")
STACKUPS = {"2": "flex-2l-18um", "4": "flex-4l"}
TRACKS = "trace_width: 6 mil, trace_spacing: 6.4 mil"


def spec_of(row, diameter, turns):
    return load_text(f"""
    {{sitscad: 1, name: a, coil: {{shape: {row["shape"]}, outer_diameter: {diameter} m, turns: {turns},
     layers: {row["layers"]}, {TRACKS}}}, fpc: {{stackup: {STACKUPS[row["layers"]]}, rules: {row["profile"]}}}}}
    """)


def most_turns(row, diameter):
    """The coil with the most turns, by quarters, whose inner vias have room."""
    for quarters in range(int(diameter / 0.3e-3) * 2, 3, -1):
        try:
            spec = spec_of(row, diameter, quarters / 4)
        except sitscad.SpecError:
            continue
        if not wind_all(spec.artwork)[0].shortfalls:
            return spec
    raise AssertionError("no turns have room")


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=[f"{row['profile']} {row['layers']}" for row in ROWS])
def test_only_coil_of_stated_smallest_size_reaches_required_resistance(row):
    floor = parse_quantity(row["parallel_resistance"], "resistance")
    size = parse_quantity(row["outer_diameter"], "length")
    reached = [sitscad.estimate(sitscad.lay_out(most_turns(row, round(size + more, 7)))).coils[0].states["free"]
               for more in (0.0, -0.1e-3)]
    assert reached[1].parallel_resistance < floor <= reached[0].parallel_resistance


@pytest.mark.parametrize(("diameter", "rules", "is_noted"), [
    (3e-3, "recommended", True), (4.1e-3, "recommended", True), (4.2e-3, "recommended", False),
    (3e-3, "generic-fine", False),
])
def test_coil_smaller_than_profile_minimum_gives_one_note(diameter, rules, is_noted):
    """No message said that a coil of 3 mm cannot be made to the recommended profile."""
    row = {"profile": rules, "shape": "circle", "layers": "4"}
    findings = findings_of("SIT222", spec_of(row, diameter, 1.5))
    assert len(findings) == is_noted
    for each in findings:
        assert (each.severity, each.key) == (Severity.NOTE, "coil.outer_diameter")
        assert (each.measured, each.limit) == (approx(diameter, rel=1e-9), approx(4.2e-3, rel=1e-9))
