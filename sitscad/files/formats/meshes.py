"""Meshes of the solids for printing and for viewers, as repeatable bytes: STL, 3MF and glTF.

STL is binary (millimetres, in the positive octant, on z = 0). 3MF follows the core specification 1.3, with a coloured
object for each solid. It is written here because the writers of trimesh and OpenCASCADE add random identifiers.
``mount/assembly.glb`` is glTF 2.0, in metres with y upwards and the front towards +z: the board's x is x, the board's z
is y. Every triangle has its own corners, so that viewers show sharp edges.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import numpy as np

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids.solid import (
    NotManifold,
    Solid,
    TriangleMesh,
    display_meshes,
    import_extra,
    printed_meshes,
    select_by_role,
)
from sitscad.basics.arrays import Array
from sitscad.files.writer import stored_zip
from sitscad.spec.sensor import SensorSpec

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
    """Return ``mount/NAME-<solid>.3mf`` of each part of mount, jaw, jig and mould. Empty if there are none."""
    pieces = (*select_by_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {
        f"mount/{spec.name}-{piece.name}.3mf": package([(piece, mesh.on_bed())], f"{spec.name}-{piece.name}")
        for piece, mesh in zip(pieces, printed_meshes(pieces), strict=True)
    }


def render_whole_3mf(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """Return ``mount/assembly.3mf``: all solids of the assembly in place, with names and colours, for viewers."""
    meshes = list(zip(solids, display_meshes(solids), strict=True))
    low = np.min([mesh.vertices.min(axis=0) for _, mesh in meshes], axis=0)
    shifted = [(s, TriangleMesh(m.name, m.vertices - low, m.triangles)) for s, m in meshes]
    return {"mount/assembly.3mf": package(shifted, f"{spec.name} assembly")}


def package(meshes: list[tuple[Solid, TriangleMesh]], title: str) -> bytes:
    """Return a 3MF file: a ZIP archive of content types, relations and model."""
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
    """Return ``mount/NAME-<solid>.stl`` of each part of mount, jaw, jig and mould. Empty if there are none."""
    pieces = (*select_by_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {f"mount/{spec.name}-{mesh.name}.stl": stl(mesh.on_bed()) for mesh in printed_meshes(pieces)}


def stl(mesh: TriangleMesh) -> bytes:
    """Return a closed mesh as binary STL. Raises `NotManifold` if trimesh finds the mesh open or inside out."""
    trimesh = import_extra("trimesh")
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    if not (body.is_watertight and body.is_winding_consistent and body.volume > 0.0):
        raise NotManifold(f"the mesh of {mesh.name} is not watertight")
    return bytes(body.export(file_type="stl"))


SEE_THROUGH = {
    BodyRole.ENCAPSULATION: 0.35, BodyRole.OPPOSING_JAW: 0.5, BodyRole.OPPOSING_PAD: 0.5, BodyRole.FINGER: 0.5,
    BodyRole.METAL_BEHIND: 0.5,
}
"""Opacity of solids that would hide others."""


def render_glb(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """Return ``mount/assembly.glb``. Raises `MissingExtra` if trimesh is not installed."""
    trimesh = import_extra("trimesh")
    scene = trimesh.Scene(base_frame=f"{spec.name}-assembly")
    for solid, triangles in zip(solids, display_meshes(solids), strict=True):
        # The mesh with its colour, rotated so that y is up
        corners: Array = triangles.vertices[triangles.triangles.reshape(-1)] * 1e-3
        turned = np.column_stack([corners[:, 0], corners[:, 2], -corners[:, 1]])
        faces = np.arange(len(turned)).reshape(-1, 3)
        alpha = SEE_THROUGH.get(solid.role, 1.0)
        material = trimesh.visual.material.PBRMaterial(
            name=solid.material,
            baseColorFactor=[*(round(255 * value) for value in solid.linear_rgb), round(255 * alpha)],
            metallicFactor=0.0, roughnessFactor=0.7, alphaMode="OPAQUE" if alpha == 1.0 else "BLEND",
            doubleSided=alpha < 1.0,
        )
        visual = trimesh.visual.TextureVisuals(material=material)
        mesh = trimesh.Trimesh(turned, faces, visual=visual, process=False)
        scene.add_geometry(mesh, node_name=solid.name, geom_name=solid.name)
    return {"mount/assembly.glb": bytes(scene.export(file_type="glb", include_normals=False))}
