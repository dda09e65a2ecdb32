"""The mesh for field programs: regions with their volumes that share faces, in air, every face named once."""

from __future__ import annotations

import json
import math
import re
from functools import cache

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.spec import templates

pytestmark = pytest.mark.cad

SPEC = sitscad.load_text(templates.read("bench_7mm")).replace({"array": {"pattern": "single"}, "coil.turns": 12})


@cache
def made() -> dict[str, bytes]:
    return sitscad.field_mesh(sitscad.lay_out(SPEC), size=0.7e-3, air=7e-3)


@cache
def read() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points, and by physical name its triangles or tetrahedra as numbers of points."""
    lines = made()["msh"].decode("ascii").splitlines()

    def block(name):
        start = lines.index(f"${name}")
        return [line.split() for line in lines[start + 2 : start + 2 + int(lines[start + 1])]]

    names = {(int(row[0]), int(row[1])): row[2].strip('"') for row in block("PhysicalNames")}
    numbers = {row[0]: k for k, row in enumerate(block("Nodes"))}
    points = np.array([[float(value) for value in row[1:]] for row in block("Nodes")])
    groups: dict[str, list] = {name: [] for name in names.values()}
    for row in block("Elements"):
        dimension = {"2": 2, "4": 3}[row[1]]
        groups[names[dimension, int(row[3])]].append([numbers[node] for node in row[3 + int(row[2]) :]])
    return points, {name: np.array(rows) for name, rows in groups.items()}


def volumes(points, rows):
    a, b, c, d = np.moveaxis(points[rows], 1, 0)
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


@pytest.mark.more
@pytest.mark.slow
def test_mesh_regions_have_expected_volumes_and_fill_the_box():
    points, groups = read()
    layers = SPEC.fpc.stackup.copper
    height = layers[0].z + layers[0].thickness / 2 - layers[1].z + layers[1].thickness / 2
    outer = 3.5e-3 - 0.1e-3  # half a pitch inwards: tracks of a spiral go in by one over a turn
    inner = outer - (12 * 0.2e-3 - 0.1e-3)
    gap = SPEC.elastomer.thickness + 2 * SPEC.assembly.glue_line
    expected = {
        "coil_C1": math.pi * (outer**2 - inner**2) * height,
        "target": math.prod(SPEC.target.size) * SPEC.target.thickness,
        "elastomer": math.prod(SPEC.elastomer.size) * gap,
    }
    message = json.loads(made()["json"])["regions"]
    for name, volume in expected.items():
        assert message[name]["volume_m3"] == approx(volume, rel=1e-6), name
        assert volumes(points, groups[name]).sum() == approx(volume, rel=0.02), name
    every = np.concatenate([volumes(points, groups[name]) for name in (*expected, "air")])
    assert every.min() > 0.0 and every.sum() == approx(np.prod(np.ptp(points, axis=0)), rel=1e-9)


@pytest.mark.slow
def test_mesh_regions_share_faces_and_each_face_has_one_name():
    """Every face of a tetrahedron has two tetrahedra, or is of the air's end; those between two regions are named."""
    _, groups = read()
    regions = [name for name in groups if groups[name].shape[1] == 4]
    tets = np.concatenate([groups[name] for name in regions])
    owner = np.repeat(np.arange(len(regions)), [len(groups[name]) for name in regions])
    sides = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]], axis=2).reshape(-1, 3)
    faces, inverse, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()
    assert set(count) == {1, 2}
    low, high = np.full(len(faces), len(regions)), np.full(len(faces), -1)
    np.minimum.at(low, inverse, np.repeat(owner, 4))
    np.maximum.at(high, inverse, np.repeat(owner, 4))
    where = {tuple(face): k for k, face in enumerate(faces.tolist())}
    named = {}
    for name in set(groups) - set(regions):
        for row in np.sort(groups[name], axis=1).tolist():
            named[where[tuple(row)]] = name
    assert len(named) == sum(len(groups[name]) for name in set(groups) - set(regions))
    for k in np.flatnonzero((count == 1) | (low != high)):
        here = {regions[low[k]], regions[high[k]]}
        assert named[k] == "outer" if count[k] == 1 else set(named[k].rsplit("_", 1)) == here, (named[k], here)


def test_coarse_mesh_report_states_element_quality_and_counts():
    document = json.loads(made()["json"])
    assert document["all"]["least_quality"] > 0.05 and document["all"]["share_below_0.1"] < 0.05
    assert document["all"]["tetrahedra"] == sum(region["tetrahedra"] for region in document["regions"].values())
    assert document["size_at_edges_m"] == 0.7e-3 and document["air_m"] == 7e-3


def test_mesh_elements_are_small_at_target_and_large_in_air():
    points, groups = read()
    target, air = np.cbrt(volumes(points, groups["target"])), np.cbrt(volumes(points, groups["air"]))
    assert np.median(target) < 0.7e-3 < 1.4e-3 < air.max()


def test_msh_and_inp_files_have_equal_regions():
    text = made()["inp"].decode("ascii")
    assert set(re.findall(r"\*ELSET,ELSET=(\w+)", text)) == set(read()[1]) and "/tmp" not in text[:200]


@pytest.mark.slow
def test_copper_layers_shield_and_jaw_are_separate_mesh_regions():
    spec = sitscad.load_text(templates.read("grasper_4layer")).replace({"array": {"pattern": "single"}})
    result = json.loads(sitscad.field_mesh(sitscad.lay_out(spec), size=1e-3, copper="layers")["json"])["regions"]
    assert set(result) == {*(f"coil_C1_{n}" for n in (1, 2, 3, 4)), "target", "shield", "jaw", "elastomer", "air"}


@pytest.mark.parametrize("wrong", [{"size": 0.0}, {"air": -1e-3}, {"copper": "rings"}])
def test_invalid_mesh_options_raise_value_error(wrong):
    with pytest.raises(ValueError):
        sitscad.field_mesh(sitscad.lay_out(SPEC), **wrong)


def test_pad_mesh_without_elastomer_or_positive_size_is_refused():
    layout = sitscad.lay_out(sitscad.load_text(templates.read("single_coil")))
    with pytest.raises(sitscad.PartsError, match="elastomer"):
        sitscad.pad_mesh(layout)
    with pytest.raises(ValueError):
        sitscad.pad_mesh(sitscad.lay_out(SPEC), size=-1e-3)


@pytest.mark.slow
def test_metal_behind_board_and_metal_finger_are_mesh_regions():
    """A finger of metal was missing among them: what a field program solved was another sensor."""
    sheet = {"kind": "custom", "metal_behind": {"material": "brass", "distance": "2 mm", "thickness": "0.8 mm"}}
    finger = {"kind": "fingertip", "finger": {"size": ["12 mm", "5 mm"], "material": "brass"}}
    for name, mount, height in (("metal_behind", sheet, 0.8e-3), ("finger", finger, 5e-3)):
        layout = sitscad.lay_out(SPEC.replace({"mount": mount}))
        regions = json.loads(sitscad.field_mesh(layout, size=1.5e-3, air=5e-3)["json"])["regions"]
        x0, y0, x1, y1 = layout.body
        area = (x1 - x0 + 7e-3) * (y1 - y0 + 7e-3)  # half a coil beyond the body
        if name == "finger":
            area = regions[name]["volume_m3"] / height
            assert area / 12e-3 > x1 - x0
        assert regions[name]["volume_m3"] == approx(area * height, rel=1e-6)
