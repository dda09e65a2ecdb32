"""Binary STL files of mount, jaw, jig and mould for printing: millimetres, in the positive octant, on z = 0."""

from __future__ import annotations

from sitscad.parts.extras import require
from sitscad.parts.mesh import NotManifold, TriangleMesh, made
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.spec.sensor import SensorSpec


def render(solids: tuple[Solid, ...], spec: SensorSpec, aids: tuple[Solid, ...] = ()) -> dict[str, bytes]:
    """``mount/NAME-<solid>.stl`` of every piece of mount and jaw, and of jig and mould; nothing without a mount."""
    pieces = (*of_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {f"mount/{spec.name}-{mesh.name}.stl": stl(mesh.on_bed()) for mesh in made(pieces)}


def stl(mesh: TriangleMesh) -> bytes:
    """A closed mesh as binary STL; raises `NotManifold` where trimesh finds it open or inside out."""
    trimesh = require("trimesh")
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    if not (body.is_watertight and body.is_winding_consistent and body.volume > 0.0):
        raise NotManifold(f"the mesh of {mesh.name} is not watertight")
    return bytes(body.export(file_type="stl"))
