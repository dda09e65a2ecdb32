"""Specs of extreme proportions are refused with findings or get numbers; nothing ends in an exception."""

import pytest
from extreme_specs import extreme_spec, judged

COIL = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2, "trace_width": 0.1, "trace_spacing": 0.1}


@pytest.mark.few(2)
@pytest.mark.parametrize(
    "parts",
    [
        {"target": {"material": "ferrite", "size": 1, "thickness": 40}},
        {"target": {"material": "ferrite", "size": 0.1, "thickness": 100}, "elastomer": {"thickness": 0.001}},
        {"target": {"size": 500, "thickness": 100}, "elastomer": {"thickness": 100, "size": 500}},
        {
            "target": {"size": 0.1, "thickness": 0.001},
            "shield": {"material": "ferrite", "thickness": 100, "gap": 0.001},
        },
    ],
)
def test_extreme_parts_have_finite_estimates(parts):
    """The first ended in an array of negative size: its magnetic edge lay within itself."""
    assert judged({"sitscad": 1, "name": "extreme", "coil": COIL, **parts})


@pytest.mark.few(2)
@pytest.mark.parametrize("seed", range(5))
def test_random_extreme_specs_have_finite_estimates_or_findings(seed):
    assert judged(extreme_spec(seed, ["circle"]))
