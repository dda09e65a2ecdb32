"""Random targets at random poses over boards people make: errors within what the response states."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_poses import compared, poses, targets

import sitscad
from sitscad import Design

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grasper_4layer", "bench_7mm", "three_axis_triangle", "square_bench"])
def test_many_random_poses(name):
    spec, generator = sitscad.load(ROOT / "templates" / f"{name}.yaml"), np.random.default_rng(3)
    layout = sitscad.lay_out(spec)
    for _, target in zip(range(12), targets(spec, generator), strict=False):
        changed = replace(spec, target=target)
        design = Design(changed, replace(layout, spec=changed))
        some = poses(changed, float(design.response.rest[2]), 12, generator)
        assert compared(design, some)[0] < 1.0, target
