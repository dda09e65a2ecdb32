"""A target far larger than its coils is solved in part: what is left out is within what is stated for it."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import sitscad
from sitscad.estimates.states.placed import PoseRange, TargetPoses, target_centre_at_rest
from sitscad.estimates.states.plate import make_target_plate
from sitscad.spec import templates

FREQUENCY = 5e6


def _changes(spec, coils, cover, placed):
    plate = make_target_plate(spec.target, spec.coil, coils, (FREQUENCY,), None, cover)
    return np.einsum("pcc->pc", plate.changes(placed.turns, placed.places)[0][0])[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("material", "thickness", "across", "height"),
    [
        ("copper", 50e-6, 7.0, 0.2),
        pytest.param("copper", 50e-6, 9.0, 0.7, marks=pytest.mark.slow),
        pytest.param("ferrite", 500e-6, 11.0, 0.3, marks=pytest.mark.slow),
        pytest.param("stainless-17-4ph", 200e-6, 9.0, 0.2, marks=[pytest.mark.slow, pytest.mark.more]),
    ],
)
def test_error_of_partial_wide_target_is_within_stated_error(material, thickness, across, height):
    spec = sitscad.load_text(templates.read("bench_7mm"), "bench.yaml").replace("target.material", material)
    size = max(spec.coil.size)
    spec = replace(spec, target=replace(spec.target, thickness=thickness, size=(across * size, across * size)))
    coils, rest = sitscad.lay_out(spec).coils, target_centre_at_rest(spec)
    poses = np.zeros((1, 6))
    poses[0, 2] = height * size - rest[2]
    placed = TargetPoses.from_rest(spec.target, rest, poses)
    cover = placed.pose_range(spec.target, spec.coil, coils, spec.array.middle)
    assert 0.0 < cover.error < 0.01 and max(cover.half) < 0.8 * max(placed.half)
    part = _changes(spec, coils, cover, placed)
    whole = _changes(spec, coils, replace(cover, half=placed.half), placed)
    least = max(abs(whole[0].real), 0.01 * 2.5e-6)
    assert abs(part[0].real - whole[0].real) < cover.error * least


def test_target_not_much_wider_than_coils_is_solved_completely():
    spec = sitscad.load_text(templates.read("bench_7mm"), "bench.yaml")
    placed = TargetPoses.from_rest(spec.target, target_centre_at_rest(spec), np.zeros((1, 6)))
    cover = placed.pose_range(spec.target, spec.coil, sitscad.lay_out(spec).coils, spec.array.middle)
    assert cover.half == placed.half and cover.error == 0.0 and cover.part(spec.target) is spec.target


def test_similar_poses_share_few_solutions():
    spec = sitscad.load_text(templates.read("bench_7mm"), "bench.yaml")
    spec = replace(spec, target=replace(spec.target, size=(0.08, 0.08)))
    coils, rest = sitscad.lay_out(spec).coils, target_centre_at_rest(spec)
    covers: set[PoseRange] = set()
    for down in np.linspace(0.0, 0.4e-3, 40):
        covers.add(
            TargetPoses.from_rest(
                spec.target, rest, np.array([[1e-4 * math.sin(down), 0.0, -down, 0.0, 0.0, 0.0]])
            ).pose_range(spec.target, spec.coil, coils, spec.array.middle)
        )
    assert len(covers) <= 4


@pytest.mark.more
@pytest.mark.slow
def test_check_of_200_mm_target_needs_less_than_two_gigabytes(tmp_path):
    # It took 23 GB to see what a degree of tilt does to it: the fuzzer's find
    text = templates.read("robotic_jaw_12mm").replace("size: [9, 8.4]", "size: 200", 1)
    assert "size: 200" in text
    (tmp_path / "wide.yaml").write_text(text)
    result = subprocess.run(
        [sys.executable, "-c", LIMITED, "check", "--hints", "none", str(tmp_path / "wide.yaml")],
        capture_output=True, text=True, timeout=600,
    )
    assert "SIT402" in result.stdout and result.returncode == 1, result.stdout + result.stderr


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (2 * 1024**3,) * 2)
from sitscad.__main__ import main
main()
"""
