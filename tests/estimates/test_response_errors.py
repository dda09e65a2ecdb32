"""What is stated of a target's change holds: random poses over a board against finer surfaces."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad import Design

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "validation"))


def test_finer_surfaces_change_less_than_is_stated():
    spec = sitscad.load(ROOT / "templates" / "bench_7mm.yaml")
    model = Design(spec).response
    some = np.array([[1e-3, -2e-3, -0.8e-3, 0.1, -0.05, 0.2], [0.0, 4e-3, -1.5e-3, 0.0, 0.0, 0.0]])
    usual, fine = model.respond(some), replace(model, finer=1.4, solved={}).respond(some)
    size = np.maximum(np.abs(fine.target_change), 0.01 * model.wound.winding.inductance)
    assert np.all(np.abs(usual.target_change - fine.target_change) < usual.target_change_error * size)
    assert usual.target_resistance == pytest.approx(fine.target_resistance, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "size", "thickness"), [("rectangle", (4.5, 2.5), 0.2), ("circle", (5.0, 5.0), 0.035)]
)
def test_a_few_random_poses(shape, size, thickness):
    from random_poses import compared, poses

    spec = sitscad.load(ROOT / "templates" / "grasper_4layer.yaml")
    target = replace(spec.target, shape=shape, size=(size[0] * 1e-3, size[1] * 1e-3), thickness=thickness * 1e-3)
    changed = replace(spec, target=target)
    design = Design(changed, replace(sitscad.lay_out(spec), spec=changed))
    some = poses(changed, float(design.response.rest[2]), 6, np.random.default_rng(5))
    over, error, lost, left = compared(design, some)
    assert over < 1.0
    assert left < 0.5 * max(error, 1e-3)
    assert lost < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grasper_4layer", "bench_7mm", "three_axis_triangle", "square_bench"])
def test_many_random_poses(name):
    from random_poses import compared, poses, targets

    spec, generator = sitscad.load(ROOT / "templates" / f"{name}.yaml"), np.random.default_rng(3)
    layout = sitscad.lay_out(spec)
    for _, target in zip(range(12), targets(spec, generator), strict=False):
        changed = replace(spec, target=target)
        design = Design(changed, replace(layout, spec=changed))
        some = poses(changed, float(design.response.rest[2]), 12, generator)
        assert compared(design, some)[0] < 1.0, target
