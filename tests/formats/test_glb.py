"""The assembly for viewers: read back by trimesh, in metres, named, and as large as the solids."""

from __future__ import annotations

import json
from dataclasses import replace
from io import BytesIO

import handmade
import numpy as np
import pytest
from tolerance import approx

from sitscad.files.formats import meshes

pytestmark = pytest.mark.cad


def test_glb_contains_every_solid_in_metres_with_y_up():
    import trimesh

    solids = handmade.solids("jaw")
    (data,) = meshes.render_glb(solids, handmade.layout("jaw").spec).values()
    scene = trimesh.load(BytesIO(data), file_type="glb")
    assert set(scene.geometry) == {solid.name for solid in solids}
    for solid in solids:
        bounds, mesh = solid.shape.bounding_box(), scene.geometry[solid.name]
        low, high = mesh.bounds
        assert low * 1e3 == approx((bounds.min.X, bounds.min.Z, -bounds.max.Y), abs=0.021), solid.name
        assert high * 1e3 == approx((bounds.max.X, bounds.max.Z, -bounds.min.Y), abs=0.021), solid.name
        merged = trimesh.Trimesh(mesh.vertices, mesh.faces)
        merged.merge_vertices()
        assert merged.volume == approx(solid.volume, rel=0.02), solid.name


def test_glb_of_sensor_named_like_a_part_contains_every_part():
    import trimesh

    solids, spec = handmade.solids("jaw"), handmade.layout("jaw").spec
    (data,) = meshes.render_glb(solids, replace(spec, name="jaw")).values()
    scene = trimesh.load(BytesIO(data), file_type="glb")
    names = {solid.name for solid in solids}
    assert {scene.graph[node][1] for node in scene.graph.nodes_geometry} == names
    assert not [child for child in names if scene.graph.transforms.parents.get(child) in names]


def test_glb_file_is_gltf_2_and_repeatable():
    solids, spec = handmade.solids("jaw"), handmade.layout("jaw").spec
    (data,) = meshes.render_glb(solids, spec).values()
    assert data[:4] == b"glTF" and int.from_bytes(data[4:8], "little") == 2
    assert int.from_bytes(data[8:12], "little") == len(data)
    length = int.from_bytes(data[12:16], "little")
    message = json.loads(data[20 : 20 + length])
    assert message["asset"]["version"] == "2.0"
    colours = {m["name"]: m["pbrMetallicRoughness"]["baseColorFactor"] for m in message["materials"]}
    assert colours["pdms"][3] < 1.0 == colours["copper"][3]
    assert meshes.render_glb(solids, spec)["mount/assembly.glb"] == data


def test_assembly_3mf_has_parts_in_place_in_millimetres():
    import trimesh

    solids = handmade.solids("jaw")
    (data,) = meshes.render_whole_3mf(solids, handmade.layout("jaw").spec).values()
    scene = trimesh.load(BytesIO(data), file_type="3mf")
    assert scene.units == "millimeter" and len(scene.geometry) == len(solids)
    low = np.min([tuple(s.shape.bounding_box().min) for s in solids], axis=0)
    high = np.max([tuple(s.shape.bounding_box().max) for s in solids], axis=0)
    assert scene.bounds[0] == approx((0.0, 0.0, 0.0), abs=0.021)
    assert scene.bounds[1] == approx(high - low, abs=0.045)
