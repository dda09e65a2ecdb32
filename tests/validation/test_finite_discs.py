"""Discs of any thickness against finite elements about the axis, which take gigabytes and up to a minute each."""

from __future__ import annotations

import numpy as np
import pytest
from disc_of_elements import disc_change
from finite_discs import EIGHT, check_disc

from sitscad.estimates.states.plate import LOSS, TALL

METALS = [(9e-6, 5.8e7), (18e-6, 3.5e7), (70e-6, 5.8e7), (0.2e-3, 1.6e7), (0.4e-3, 5.8e7), (3e-3, 1.6e7)]
CASES = [(gap, across, *metal) for gap in (0.15e-3, 0.5e-3, 2e-3) for across in (2e-3, 5e-3, 12e-3) for metal in METALS]
"""Gap, diameter, thickness (m) and conductivity (S/m): copper, aluminium, brass."""


@pytest.mark.slow
@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", CASES, ids=str)
def test_many_disc_targets_agree_with_finite_elements(case):
    coarse, fine = (np.array(disc_change(EIGHT[0], *case[:3], case[3], cells=cells)) for cells in (0.8, 1.2))
    check_disc(*case, fine + (fine - coarse) / (1.5**2 - 1.0), 2e-3,
               LOSS + TALL * (case[2] > case[1]))
