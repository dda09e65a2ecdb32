"""Solids, meshes and pictures are the same bytes in another process, hash seed, time zone and order of work."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import handmade
import pytest

from sitscad.files.drawing.pictures.rendered import assembly_svg
from sitscad.files.formats import meshes, step, volume_mesh

pytestmark = pytest.mark.cad
ROOT = Path(__file__).parents[2]


def picture(solids, spec):
    return {"mount/assembly.svg": assembly_svg(solids, spec).encode()}


WRITERS = (step.render, meshes.render_stl, meshes.render_3mf, volume_mesh.render, picture,
           step.render_whole, meshes.render_whole_3mf, meshes.render_glb)

SCRIPT = """
import hashlib, json, sys
sys.path[:0] = [{samples!r}, {root!r}]
import handmade
from sitscad.files.formats import meshes, step
from sitscad.files.formats import volume_mesh
from sitscad.files.drawing.pictures.rendered import assembly_svg
found = {{}}
def picture(solids, spec):
    return {{"mount/assembly.svg": assembly_svg(solids, spec).encode()}}
for render in (meshes.render_glb, picture, volume_mesh.render, meshes.render_whole_3mf,
               meshes.render_3mf, meshes.render_stl, step.render_whole, step.render):
    files = render(handmade.solids("jaw"), handmade.layout("jaw").spec)
    found.update({{name: hashlib.sha256(data).hexdigest() for name, data in files.items()}})
print(json.dumps(found))
"""


@pytest.mark.slow
def test_mesh_bytes_are_equal_in_another_process():
    ours = {}
    for render in WRITERS:
        files = render(handmade.solids("jaw"), handmade.layout("jaw").spec)
        ours |= {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    surroundings = {**os.environ, "PYTHONHASHSEED": "271828", "TZ": "Asia/Kathmandu", "LC_ALL": "C"}
    script = SCRIPT.format(samples=str(ROOT / "tests" / "samples"), root=str(ROOT))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=surroundings)
    assert json.loads(done.stdout.splitlines()[-1]) == ours
    assert len(ours) == 16


TEMPLATE = """
import hashlib, json, sys
kept = [bytearray(17 * n) for n in range(int(sys.argv[2]))]
from sitscad.estimates.design import Design
from sitscad.files.formats import meshes, step
from sitscad.spec.load import load
design = Design(load(sys.argv[1]))
spec, pieces, aids, whole = design.spec, design.solids.alone, design.solids.aids, design.solids.whole
files = {}
for render in (step.render, meshes.render_3mf, meshes.render_stl):
    files |= render(pieces, spec, aids)
for render in (step.render_whole, meshes.render_whole_3mf, meshes.render_glb):
    files |= render(whole, spec)
files |= {s.name: repr([tuple(v) for v in s.shape.vertices()]).encode() for s in (*pieces, *aids, *whole)}
print(json.dumps({name: hashlib.sha256(data).hexdigest() for name, data in files.items()}))
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=pytest.mark.more) for n in ("jaw_5x20", "three_axis_grid", "three_axis_triangle")
])
def test_template_meshes_do_not_depend_on_memory_addresses(name):
    result = []
    for seed, stored in (("1", "0"), ("271828", "3001"), ("31", "777")):
        surroundings = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", TEMPLATE, str(ROOT / "templates" / f"{name}.yaml"), stored]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=surroundings)
        result.append(json.loads(done.stdout.splitlines()[-1]))
    assert len(result[0]) > 50
    for other in result[1:]:
        assert {file for file in result[0] if other.get(file) != result[0][file]} == set()
        assert len(other) == len(result[0])
