"""The other jaw's metal in front of round targets, against finite elements."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from front_of_elements import front_change
from tolerance import approx

sys.path.insert(0, str(Path(__file__).parents[1] / "estimates"))
from test_other_jaw import BEHIND, FREQUENCY, GAP, STEEL, by_front

from sitscad.estimates.states.other_jaw import ERROR, LEAST_ERROR


@pytest.mark.slow
@pytest.mark.needs("scipy")
@pytest.mark.parametrize(("diameter", "room"), [(4.1e-3, 0.05e-3), (4.1e-3, 0.55e-3), (2.8e-3, 0.05e-3)])
def test_front_metal_effect_on_disc_agrees_with_finite_elements(diameter, room):
    heights, result, target = by_front(diameter, room)
    radii = np.tile(1.855e-3 - 0.16e-3 * np.arange(8), len(heights))
    face = GAP + 0.15e-3 + room
    plates = (face, face + 1.3e-3, STEEL), (-BEHIND - 0.1e-3, -BEHIND, 5.8e7)
    exact, _ = front_change(radii, np.repeat(heights, 8), FREQUENCY, (GAP, diameter, 0.15e-3, 5.8e7), plates)
    assert result == approx(exact, abs=ERROR * abs(exact) + LEAST_ERROR * abs(target))
