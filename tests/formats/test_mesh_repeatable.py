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

from sitscad.formats import meshes, step, volume_mesh
from sitscad.papers import mount_records as assembly_picture

pytestmark = pytest.mark.cad
ROOT = Path(__file__).parents[2]
WRITERS = (step.render, meshes.render_stl, meshes.render_3mf, volume_mesh.render, assembly_picture.render_picture,
           step.render_whole, meshes.render_whole_3mf, meshes.render_glb)  # fmt: skip

SCRIPT = """
import hashlib, json, sys
sys.path[:0] = [{samples!r}, {root!r}]
import handmade
from sitscad.formats import meshes, step
from sitscad.formats import volume_mesh
from sitscad.papers import mount_records as assembly_picture
found = {{}}
for sensor in ("bench", "jaw"):
    for render in (meshes.render_glb, assembly_picture.render_picture, volume_mesh.render, meshes.render_whole_3mf,
                   meshes.render_3mf, meshes.render_stl, step.render_whole, step.render):
        files = render(handmade.solids(sensor), handmade.layout(sensor).spec)
        found.update({{sensor + " " + name: hashlib.sha256(data).hexdigest() for name, data in files.items()}})
print(json.dumps(found))
"""


@pytest.mark.slow
def test_another_process_writes_the_same_bytes():
    ours = {}
    for sensor in ("jaw", "bench"):
        for render in WRITERS:
            files = render(handmade.solids(sensor), handmade.layout(sensor).spec)
            ours.update({f"{sensor} {name}": hashlib.sha256(data).hexdigest() for name, data in files.items()})
    surroundings = {**os.environ, "PYTHONHASHSEED": "271828", "TZ": "Asia/Kathmandu", "LC_ALL": "C"}
    script = SCRIPT.format(samples=str(ROOT / "tests" / "samples"), root=str(ROOT))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=surroundings)
    assert json.loads(done.stdout.splitlines()[-1]) == ours
    assert len(ours) == 16 + 10
