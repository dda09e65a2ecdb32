"""Meshes of the solids for printing and for viewers, as repeatable bytes: binary STL (millimetres, in the positive
octant, on z = 0), 3MF (3MF core specification 1.3, one coloured object each), and ``mount/assembly.glb`` (glTF 2.0).

All are written here: trimesh's and OpenCASCADE's writers put random identifiers into 3MF, and to load the former takes
longer than to write the rest. glTF counts in metres with y upwards and the front towards +z: the jaw's length is x,
what is up of the board is y. Every triangle has corners of its own, so that edges are seen as edges.
"""

from __future__ import annotations

import json
import struct
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from sitscad.arrays import Array
from sitscad.parts.mesh import TriangleMesh, made, manifold, seen
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.spec.sensor import SensorSpec
from sitscad.writer import stored_zip

_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CONTENT_TYPES = (
    f'{_XML}<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">\n'
    ' <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>\n'
    ' <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>\n'
    "</Types>\n"
)
_RELATIONS = (
    f'{_XML}<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">\n'
    ' <Relationship Id="rel0" Target="/3D/3dmodel.model"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>\n'
    "</Relationships>\n"
)


def render_3mf(solids: tuple[Solid, ...], spec: SensorSpec, aids: tuple[Solid, ...] = ()) -> dict[str, bytes]:
    """``mount/NAME-<solid>.3mf`` of every piece of mount and jaw, and of jig and mould; nothing without a mount."""
    pieces = (*of_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {
        f"mount/{spec.name}-{piece.name}.3mf": package([(piece, mesh.on_bed())], f"{spec.name}-{piece.name}")
        for piece, mesh in zip(pieces, made(pieces), strict=True)
    }


def render_whole_3mf(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mount/assembly.3mf``: every piece of the assembly in place, named and coloured, for viewers."""
    meshes = list(zip(solids, seen(solids), strict=True))
    low = np.min([mesh.vertices.min(axis=0) for _, mesh in meshes], axis=0)
    placed = [(s, TriangleMesh(m.name, m.vertices - low, m.triangles)) for s, m in meshes]
    return {"mount/assembly.3mf": package(placed, f"{spec.name} assembly")}


def package(meshes: list[tuple[Solid, TriangleMesh]], title: str) -> bytes:
    """The zip archive that a 3MF file is: content types, relations, model."""
    bases = "".join(f'<base name={quoteattr(solid.material)} displaycolor="{solid.colour.upper()}FF"/>'
                    for solid, _ in meshes)
    objects = "".join(_object(index, solid, mesh) for index, (solid, mesh) in enumerate(meshes))
    items = "".join(f'<item objectid="{index + 2}"/>' for index in range(len(meshes)))
    model = (
        f'{_XML}<model unit="millimeter" xml:lang="en-US"'
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Title">{title}</metadata>\n<metadata name="Application">sitscad</metadata>\n<resources>\n'
        f'<basematerials id="1">{bases}</basematerials>\n'
        f"{objects}</resources>\n<build>{items}</build>\n</model>\n"
    )
    members = {"[Content_Types].xml": _CONTENT_TYPES, "_rels/.rels": _RELATIONS, "3D/3dmodel.model": model}
    return stored_zip({name: text.encode("utf-8") for name, text in members.items()})


def _object(index: int, solid: Solid, mesh: TriangleMesh) -> str:
    vertices = "\n".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>' for x, y, z in mesh.vertices.tolist())
    triangles = "\n".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.triangles.tolist())
    return (
        f'<object id="{index + 2}" name={quoteattr(solid.name)} type="model" pid="1" pindex="{index}">\n<mesh>\n'
        f"<vertices>\n{vertices}\n</vertices>\n<triangles>\n{triangles}\n</triangles>\n</mesh>\n</object>\n"
    )


def render_stl(solids: tuple[Solid, ...], spec: SensorSpec, aids: tuple[Solid, ...] = ()) -> dict[str, bytes]:
    """``mount/NAME-<solid>.stl`` of every piece of mount and jaw, and of jig and mould; nothing without a mount."""
    pieces = (*of_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {f"mount/{spec.name}-{mesh.name}.stl": stl(mesh.on_bed()) for mesh in made(pieces)}


_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


def stl(mesh: TriangleMesh) -> bytes:
    """A closed mesh as binary STL; raises `NotManifold` where it is open or inside out."""
    manifold(mesh)
    corners = mesh.vertices[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    facets = np.zeros(len(corners), _FACET)
    facets["normal"] = across / np.sqrt(np.einsum("ni,ni->n", across, across))[:, None]
    facets["corners"] = corners
    return bytes(80) + struct.pack("<I", len(facets)) + facets.tobytes()


SEE_THROUGH = {BodyRole.ENCAPSULATION: 0.35, BodyRole.OPPOSING_JAW: 0.5, BodyRole.OPPOSING_PAD: 0.5}
"""How much is seen of pieces that would hide the rest."""


def render_glb(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """The file: of every solid a node, its mesh of loose triangles, and its material."""
    places, materials, start = [], [], 0
    accessors, views = list[dict[str, Any]](), list[dict[str, int]]()
    for number, (solid, mesh) in enumerate(zip(solids, seen(solids), strict=True)):
        corners: Array = mesh.vertices[mesh.triangles.reshape(-1)] * 1e-3
        turned = np.column_stack([corners[:, 0], corners[:, 2], -corners[:, 1]]).astype("<f4")
        low, high = turned.min(axis=0).tolist(), turned.max(axis=0).tolist()
        places.append(turned.tobytes())
        views.append({"buffer": 0, "byteOffset": start, "byteLength": turned.nbytes})
        accessors.append({"bufferView": number, "componentType": _FLOAT, "count": len(turned), "type": "VEC3",
                          "min": low, "max": high})
        start += turned.nbytes
        alpha = SEE_THROUGH.get(solid.role, 1.0)
        colour = [round(255 * value) / 255 for value in (*solid.linear_rgb, alpha)]
        materials.append({
            "name": solid.material, "alphaMode": "OPAQUE" if alpha == 1.0 else "BLEND", "doubleSided": alpha < 1.0,
            "pbrMetallicRoughness": {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.7},
        })
    numbers = range(len(solids))
    document = {
        "asset": {"version": "2.0", "generator": "sitscad"},
        "scene": 0, "scenes": [{"name": spec.name, "nodes": [*numbers]}],
        "nodes": [{"name": solid.name, "mesh": number} for number, solid in enumerate(solids)],
        "meshes": [{"name": solid.name, "primitives": [{"attributes": {"POSITION": number}, "material": number}]}
                   for number, solid in enumerate(solids)],
        "materials": materials, "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": start}],
    }
    text = json.dumps(document, separators=(",", ":")).encode("ascii")
    chunks = ((b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", b"".join(places)))
    parts = [part for kind, content in chunks for part in (struct.pack("<I", len(content)), kind, content)]
    size = 12 + sum(map(len, parts))
    return {"mount/assembly.glb": b"".join([b"glTF", struct.pack("<II", 2, size), *parts])}


_FLOAT = 5126
"""Numbers of four bytes, in glTF's accessors."""
