"""Boards whose square or rectangular spirals begin in the middle of a side."""

from __future__ import annotations

import pytest

from sitscad import SensorSpec, check
from sitscad.basics.finding import Severity
from sitscad.spec.reading import SpecError

COIL = {"shape": "square", "outer_diameter": 7, "turns": 8, "layers": 2, "trace_width": "160 um",
        "trace_spacing": "160 um", "start": "mid-side"}


def spec(**keys):
    return SensorSpec.from_mapping(name="coil", coil={**COIL, **keys})


@pytest.mark.parametrize("keys", [
    {}, {"turns": 8.25}, {"turns": 7.5, "layers": 4}, {"corner_radius": 0.6, "sense": "clockwise"},
    {"shape": "rectangle", "outer_diameter": [10, 7], "start_angle": "90 deg"}, {"turns": [8, 7.75]},
])
def test_mid_side_coil_is_routed_without_errors(keys):
    findings = check(spec(**keys), hints="none").findings
    assert [f.rule for f in findings if f.severity is not Severity.NOTE] == []


@pytest.mark.parametrize(("keys", "expected"), [
    ({"shape": "octagon"}, ("SIT009", "coil.start")),
    ({"shape": "circle"}, ("SIT009", "coil.start")),
    ({"turns": 8.1}, ("SIT015", "coil.turns")),
    ({"start": "middle"}, ("SIT007", "coil.start")),
])
def test_mid_side_start_of_other_shapes_is_refused(keys, expected):
    with pytest.raises(SpecError) as refused:
        spec(**keys)
    assert [(result.rule, result.key) for result in refused.value.findings] == [expected]
