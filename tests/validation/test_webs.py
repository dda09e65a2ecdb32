"""Two pads joined by a web, in finite elements: what it carries from one target to the next, against the envelope that
SIT219 states; and a line of web_figures.csv anew, which the pad's law is held against.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx
from web_figures import added, moved, pair, shifted

from sitscad.estimates.states.cells import WEB_DECAY, WEB_EDGE, WEB_MEAN

pytestmark = [pytest.mark.clients("ccx"), pytest.mark.slow, pytest.mark.more]

PAIRS = [
    (10.0, 10.0, 1.5, 6.0, 2.0), (10.0, 10.0, 1.5, 6.0, 9.9), (10.0, 10.0, 2.5, 1.7, 1.0), (10.0, 10.0, 1.0, 0.7, 2.0),
    (4.0, 10.0, 1.5, 2.0, 2.0), (10.0, 4.0, 1.5, 2.0, 2.0),
]
"""Sides of the pads along and across, thickness, gap, width of the web (mm)."""


@pytest.mark.parametrize("measures", PAIRS)
def test_web_crosstalk_of_elements_is_within_stated_limit(measures, tmp_path):
    """A fifth of it from end to end of long pads, which are stiffer against tilt."""
    along, across, thickness, gap, web = measures
    model = pair(along / thickness, across / thickness, 0.0, gap / thickness, web / thickness, True)
    went = moved(tmp_path, model, shifted(2), True)[0][model.of("FAR"), 2] / 1e-4
    share = web / min(along, across) * math.exp(-WEB_DECAY * gap / thickness)
    least = 0.25 if along <= across else 0.19
    assert least < abs(went.mean()) / (WEB_MEAN * share) < 1.0
    assert least < np.abs(went).max() / (WEB_EDGE * share) < 1.0


def test_web_stiffening_of_elements_matches_table():
    result = added(20.0 / 3.0, 20.0 / 3.0, 0.0, 4.0 / 3.0, 4.0 / 3.0)
    assert result == approx([0.0296, 0.0378, 0.0124, 0.0498, 0.00315, 0.0233, 0.0476], rel=0.01)
