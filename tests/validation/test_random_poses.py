"""Random targets at random poses over boards people make: errors within what the response states."""

from __future__ import annotations

import numpy as np
import pytest
from random_poses import BOARDS, boards, changed, of_target, targets


@pytest.mark.slow
@pytest.mark.parametrize("name", BOARDS)
def test_many_random_poses(name):
    """Of other targets than those of the committed figures: changes within what is stated and the goals."""
    layout, generator = boards()[name], np.random.default_rng(3)
    for number, target in zip(range(6), targets(layout.spec, generator), strict=False):
        found = of_target(changed(layout, target, mirror=number % 2 == 1), generator)
        assert max(found["own_over_stated"].max(), found["mutual_over_stated"].max()) < 1.0, target
        assert found["own"].max() < 0.005 and found["mutual"].max() < 0.02 and found["loss"].max() < 0.05, target
