"""What is stated of a target's change holds: random poses over a board against finer surfaces."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "validation"))


def test_finer_surface_mesh_changes_response_within_stated_error():
    spec = sitscad.load(ROOT / "templates" / "bench_7mm.yaml")
    model = Design(spec).response
    some = np.array([[1e-3, -2e-3, -0.8e-3, 0.1, -0.05, 0.2], [0.0, 4e-3, -1.5e-3, 0.0, 0.0, 0.0]])
    usual, fine = model.respond(some), replace(model, finer=1.4, solved={}).respond(some)
    size = np.maximum(np.abs(fine.target_change), 0.01 * model.windings.winding.inductance)
    assert np.all(np.abs(usual.target_change - fine.target_change) < usual.target_change_error * size)
    assert usual.target_resistance == approx(fine.target_resistance, rel=0.01)


JAW = "mount: {kind: grasper-pad, jaw: generic-5mm, standoff: 0.7}\n"
MAGNETIC_JAW = (
    "mount: {kind: grasper-pad, jaw: {width: 5, length: 20, height: 2, port_diameter: 9, material: stainless-17-4ph}, "
    "standoff: 0.3}\n"
)
BEHIND = [
    JAW,
    MAGNETIC_JAW,
    JAW + "shield: {material: copper, thickness: 0.1, gap: 0.3}\n",
    JAW + "shield: {material: ferrite, thickness: 0.1, gap: 0.3}\n",
]


def over_a_jaw(behind, size):
    return Design(
        sitscad.load_text(
            "sitscad: 1\nname: jaw\ncoil: {shape: circle, outer_diameter: 5, turns: 8, layers: 2, trace_width: 100 um, "
            f"trace_spacing: 100 um}}\ntarget: {{shape: square, size: {size}, thickness: 0.2, material: copper}}\n"
            f"elastomer: {{shape: square, size: 6, thickness: 1}}\n{behind}"
        )
    )


def test_air_gap_between_shield_and_jaw_gives_finite_response():
    result = over_a_jaw(BEHIND[2], 5).response.respond(np.zeros((1, 6)))
    assert np.all(np.isfinite(result.inductance))
    assert result.target_change[0, 0, 0] < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("behind", [pytest.param(each, marks=() if each is BEHIND[1] else pytest.mark.more)
                                    for each in BEHIND])
def test_large_target_over_jaw_equals_infinite_sheet_within_error(behind):
    design, at = over_a_jaw(behind, 15), 5e6
    result = design.response.respond(np.array([[0.0] * 6, [0.0, 0.0, -0.7e-3, 0.0, 0.0, 0.0]]), at)
    wound, jaw = design.response.windings, design.response.behind
    metal = wound.spec.target.material.conductivity
    rest = float(design.response.rest[2])
    for k, height in enumerate((rest, rest - 0.7e-3)):
        with_it, without = (
            reflected_inductances(wound.winding.spectrum, np.array([at]), above, jaw, (0.0,))[0, 0].real
            for above in (Reflector(height, (MetalLayer(metal, 1.0, 0.2e-3),)), None)
        )
        error = abs(result.target_change[k, 0, 0] / (with_it - without) - 1.0)
        assert error < result.target_change_error[k, 0, 0]


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "size", "thickness"), [("rectangle", (4.5, 2.5), 0.2), ("circle", (5.0, 5.0), 0.035)]
)
def test_random_poses_agree_with_finer_solution_within_stated_error(shape, size, thickness):
    from random_poses import compared, poses

    spec = sitscad.load(ROOT / "templates" / "grasper_4layer.yaml")
    target = replace(spec.target, shape=shape, size=(size[0] * 1e-3, size[1] * 1e-3), thickness=thickness * 1e-3)
    changed = replace(spec, target=target)
    design = Design(changed, replace(sitscad.lay_out(spec), spec=changed))
    some = poses(changed, float(design.response.rest[2]), 6, np.random.default_rng(5))
    result = compared(design, some)
    assert max(result["own_over_stated"].max(), result["mutual_over_stated"].max()) < 1.0
    assert result["finer_levels"].max() < 0.5 * max(result["own"].max(), 1e-3)
    assert result["loss"].max() < 0.02
