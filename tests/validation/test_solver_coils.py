"""Coils that solvers computed."""

from __future__ import annotations

import pytest
from published_coils import SOLVED, inductance
from tolerance import approx


@pytest.mark.parametrize("case", SOLVED, ids=lambda case: case["id"])
def test_inductance_exceeds_polygon_solver_value_by_0_2_percent(case):
    assert inductance(case) / (case["L_uH_uniform_current"] * 1e-6) - 1.0 == approx(0.002, abs=0.003)
