"""A grasper's levers: virtual work, statics, and the numbers that the thesis prints."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.estimates.requested_response import link_angle, tip_force

THETA0, LA, LB = math.radians(21.80), 3.770e-3, 3.200e-3


def pin_distance(lever_angle: float, lever: float, link: float) -> float:
    """Distance (m) from the pivot to the pin that the shaft pulls; lengths in metres, angle in radians."""
    return lever * math.cos(lever_angle) + link * math.cos(link_angle(lever_angle, lever, link))


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(0.05, 1.4), st.floats(1e-3, 6e-3), st.floats(1.05, 4.0), st.floats(5e-3, 40e-3))
def test_shaft_work_equals_work_of_both_jaws(angle, lever, longer, reach):
    link, small = longer * lever * math.sin(angle), 1e-6
    travel = pin_distance(angle - small, lever, link) - pin_distance(angle + small, lever, link)
    work = 2.0 * tip_force(20.0, angle, lever, link, reach) * reach * 2.0 * small
    assert work == approx(20.0 * travel, rel=1e-5)


@given(st.floats(0.05, 1.4), st.floats(1.05, 4.0))
def test_tip_moment_balances_link_force(angle, longer):
    link = longer * LA * math.sin(angle)
    beta = link_angle(angle, LA, link)
    in_link = 20.0 / (2.0 * math.cos(beta))
    pin, way = (LA * math.cos(angle), LA * math.sin(angle)), (math.cos(beta), -math.sin(beta))
    moment = abs(pin[0] * way[1] - pin[1] * way[0]) * in_link
    assert tip_force(20.0, angle, LA, link, 28e-3) * 28e-3 == approx(moment, rel=1e-9)


def test_tip_force_corrects_printed_factors_of_thesis():
    """3.2 is 0.333 with a sine where 3.1 prints a cosine; both multiply by a cosine that belongs below the line."""
    beta = link_angle(THETA0, LA, LB)
    assert 0.5 * math.cos(THETA0 + beta) * math.cos(beta) == approx(0.302, abs=5e-4)
    assert 0.5 * math.sin(THETA0 + beta) * math.cos(beta) == approx(0.333, abs=5e-4)
    assert tip_force(1.0, THETA0, LA, LB, LA) == approx(0.412, abs=5e-4)


def test_impossible_levers_give_value_error():
    with pytest.raises(ValueError, match="reach the axis"):
        tip_force(1.0, 1.5, LA, LB, 28e-3)
    with pytest.raises(ValueError, match="positive distance"):
        tip_force(1.0, THETA0, LA, LB, 0.0)
