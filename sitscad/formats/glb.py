"""``mount/assembly.glb``: the whole assembly for browsers and viewers (glTF 2.0, binary), named, coloured, in metres.

glTF counts in metres with y upwards and the front towards +z: the jaw's length is x, what is up of the board is y.
Every triangle has corners of its own, so that edges are seen as edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.parts.extras import require
from sitscad.parts.mesh import TriangleMesh, seen
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole
from sitscad.spec.sensor import SensorSpec

SEE_THROUGH = {BodyRole.ENCAPSULATION: 0.35, BodyRole.OPPOSING_JAW: 0.5, BodyRole.OPPOSING_PAD: 0.5}
"""How much is seen of pieces that would hide the rest."""


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """The file; raises `MissingExtra` without trimesh."""
    trimesh = require("trimesh")
    scene = trimesh.Scene(base_frame=spec.name)
    for solid, triangles in zip(solids, seen(solids), strict=True):
        mesh = _mesh(triangles, solid)
        scene.add_geometry(mesh, node_name=solid.name, geom_name=solid.name)
    return {"mount/assembly.glb": bytes(scene.export(file_type="glb", include_normals=False))}


def _mesh(mesh: TriangleMesh, solid: Solid) -> object:
    """A mesh with its colour, turned so that y is up."""
    trimesh = require("trimesh")
    corners: NDArray[np.float64] = mesh.vertices[mesh.triangles.reshape(-1)] * 1e-3
    turned = np.column_stack([corners[:, 0], corners[:, 2], -corners[:, 1]])
    faces = np.arange(len(turned)).reshape(-1, 3)
    alpha = SEE_THROUGH.get(solid.role, 1.0)
    material = trimesh.visual.material.PBRMaterial(
        name=solid.material,
        baseColorFactor=[*(round(255 * value) for value in solid.linear_rgb), round(255 * alpha)],
        metallicFactor=0.0,
        roughnessFactor=0.7,
        alphaMode="OPAQUE" if alpha == 1.0 else "BLEND",
        doubleSided=alpha < 1.0,
    )
    visual = trimesh.visual.TextureVisuals(material=material)
    return trimesh.Trimesh(turned, faces, visual=visual, process=False)
