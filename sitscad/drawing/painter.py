"""Pictures of the assembly as small, repeatable SVG: exploded in parallel projection, and cut across the jaw.

Shaded by the painter's method from coarse meshes. Solids lie on top of one another, so they are drawn from the bottom
up; within a solid, faces towards the viewer are drawn inner before outer, low before high, far before near.
"""

from __future__ import annotations

import math
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from sitscad.parts.mesh import TriangleMesh, manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import BodyRole
from sitscad.scene.jaws import section
from sitscad.spec.sensor import SensorSpec

CHORD, TURN = 0.02, 0.5  # mm, rad: a picture's mesh
AZIMUTH, ELEVATION = math.radians(28.0), math.radians(32.0)  # the viewer stands towards +x and -y, above
LIGHT = (0.25, -0.45, 0.86)
CREASE = math.cos(math.radians(25.0))  # faces that meet at more than this angle have a drawn edge
INK, FAINT = "#22303c", "#7f8c8d"
STYLE = 'font-family="Helvetica, Arial, sans-serif" font-size="13"'
ROW = 21.0  # pixels between two labels

Box = tuple[float, float, float, float]


@record
class Drawing:
    """SVG elements with the box (x0, y0, x1, y1 in pixels, y down) that they fill."""

    elements: tuple[str, ...]
    box: Box


def assembly_svg(solids: tuple[Solid, ...], spec: SensorSpec) -> str:
    """The exploded assembly on the left, the section across the jaw (to scale, with the port's circle) on the right."""
    left = exploded(solids, 470.0, 470.0)
    right = cross_section(solids, spec, 260.0)
    gap, margin = 40.0, 14.0
    height = max(left.box[3] - left.box[1], right.box[3] - right.box[1])
    width = left.box[2] - left.box[0] + gap + right.box[2] - right.box[0]
    parts, x = [], margin
    for drawing in (left, right):
        x0, y0, x1, y1 = drawing.box
        down = margin + (height - (y1 - y0)) / 2 - y0
        parts.append(f'<g transform="translate({x - x0:.1f} {down:.1f})">\n' + "\n".join(drawing.elements) + "\n</g>")
        x += x1 - x0 + gap
    total = (width + 2 * margin, height + 2 * margin)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total[0]:.0f} {total[1]:.0f}" width="{total[0]:.0f}" '
        f'height="{total[1]:.0f}" role="img" {STYLE}>\n'
        f"<title>{escape(spec.name)}: assembly, exploded and in section</title>\n" + "\n".join(parts) + "\n</svg>\n"
    )


# ------------------------------------------------------------------------------------------------ exploded


def exploded(solids: tuple[Solid, ...], width: float, height: float) -> Drawing:
    """The solids drawn apart along z, as large as fits into width and height (pixels)."""
    meshes = _lifted(_trimmed(solids))
    toward, right, up = _camera()
    corners = np.concatenate([mesh.vertices for _, mesh in meshes])
    flat = np.stack([corners @ right, -(corners @ up)], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = min(width / (high[0] - low[0]), height / (high[1] - low[1]))
    elements: list[str] = []
    for solid, mesh in meshes:
        points = (np.stack([mesh.vertices @ right, -(mesh.vertices @ up)], axis=1) - low) * scale
        faces = _faces(mesh, toward)
        opacity = ' fill-opacity="0.6"' if _is_film(solid) else ""
        elements.append(f'<g id="exploded-{solid.name}"{opacity} stroke-linejoin="round">')
        elements.extend(_painted(face, points, solid) for face in faces)
        elements.append("</g>")
    box = (0.0, 0.0, *((high - low) * scale).tolist())
    return Drawing(tuple(elements), box)


def _camera() -> tuple[Any, Any, Any]:
    """Unit vectors towards the viewer, to the right and up in the picture."""
    toward = np.array(
        [math.cos(ELEVATION) * math.sin(AZIMUTH), -math.cos(ELEVATION) * math.cos(AZIMUTH), math.sin(ELEVATION)]
    )
    right = np.array([math.cos(AZIMUTH), math.sin(AZIMUTH), 0.0])
    return toward, right, np.cross(toward, right)


def _trimmed(solids: tuple[Solid, ...]) -> list[tuple[Solid, TriangleMesh]]:
    """The meshes, cut off a little beyond the sensor so that a long tail does not make it small."""
    meshes = [(solid, tessellate(solid, CHORD, TURN)) for solid in solids]
    body = [m.vertices[:, 0] for s, m in meshes if s.role not in (BodyRole.BOARD, BodyRole.STIFFENER)]
    if not body:
        return meshes
    x0, x1 = min(float(x.min()) for x in body), max(float(x.max()) for x in body)
    found = []
    for solid, mesh in meshes:
        part = manifold(mesh).trim_by_plane((-1.0, 0.0, 0.0), -(x1 + 0.3 * (x1 - x0)))
        if not part.is_empty():
            cut = part.to_mesh64()
            points = np.asarray(cut.vert_properties)[:, :3]
            found.append((solid, TriangleMesh(solid.name, points, np.asarray(cut.tri_verts).astype(int))))
    return found


def _lifted(meshes: list[tuple[Solid, TriangleMesh]]) -> list[tuple[Solid, TriangleMesh]]:
    """The meshes moved apart along z: each stands clear of all that was drawn before it."""
    depth = max(float(m.vertices[:, 1].max() - m.vertices[:, 1].min()) for _, m in meshes)
    gap, top, found = 0.3 * depth, None, []
    for solid, mesh in meshes:
        low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
        lift = 0.0 if top is None else top + gap - low
        top = high + lift
        found.append((solid, TriangleMesh(mesh.name, mesh.vertices + np.array([0.0, 0.0, lift]), mesh.triangles)))
    return found


@record
class _Face:
    """Triangles of one plane: the loops round them and the creases among their edges, as vertex indices."""

    loops: tuple[tuple[int, ...], ...]
    creases: tuple[tuple[int, int], ...]
    brightness: float


def _faces(mesh: TriangleMesh, toward: Any) -> list[_Face]:
    """The faces that look towards the viewer, in drawing order."""
    normals = _normals(mesh)
    triangles = mesh.triangles.tolist()
    beside = _neighbours(triangles)
    planes: dict[tuple[float, ...], list[int]] = {}
    offsets = np.einsum("ij,ij->i", normals, mesh.vertices[mesh.triangles[:, 0]])
    keys = np.round(np.column_stack([normals, offsets]), 3) + 0.0
    for index, key in enumerate(map(tuple, keys.tolist())):
        if normals[index] @ toward > 1e-6:
            planes.setdefault(key, []).append(index)
    ordered = sorted(planes.items(), key=lambda item: (*_depth(mesh, item[1], toward, normals[item[1][0]]), item[0]))
    return [_face(members, triangles, beside, normals) for _, members in ordered]


def _normals(mesh: TriangleMesh) -> Any:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)


def _neighbours(triangles: list[list[int]]) -> dict[tuple[int, int], int]:
    """Which triangle has each directed edge; the triangle beyond an edge has it the other way round."""
    return {(t[i], t[(i + 1) % 3]): index for index, t in enumerate(triangles) for i in range(3)}


def _depth(mesh: TriangleMesh, members: list[int], toward: Any, normal: Any) -> tuple[bool, float, float]:
    """Faces on the convex hull last: nothing of the same solid hides them; before them the low, then the far ones."""
    points = mesh.vertices[mesh.triangles[members].reshape(-1)]
    on_hull = bool((mesh.vertices @ normal).max() <= (points @ normal).max() + 1e-3)
    return on_hull, round(float(points[:, 2].max()), 4), round(float((points @ toward).mean()), 4)


def _face(members: list[int], triangles: list, beside: dict, normals: Any) -> _Face:
    inside = set(members)
    rim: dict[int, list[int]] = {}
    creases: list[tuple[int, int]] = []
    for index in members:
        corners = triangles[index]
        for i in range(3):
            a, b = corners[i], corners[(i + 1) % 3]
            other = beside.get((b, a))
            if other in inside:
                continue
            rim.setdefault(a, []).append(b)
            if other is None or normals[index] @ normals[other] < CREASE:
                creases.append((a, b))
    light = np.array(LIGHT)
    brightness = 0.62 + 0.38 * max(0.0, float(normals[members[0]] @ light))
    return _Face(tuple(_loops(rim)), tuple(creases), brightness)


def _loops(rim: dict[int, list[int]]) -> list[tuple[int, ...]]:
    """Directed edges chained into closed loops."""
    found = []
    while rim:
        start = here = next(iter(rim))
        loop = []
        while here in rim:
            loop.append(here)
            following = rim[here].pop()
            if not rim[here]:
                del rim[here]
            here = following
            if here == start:
                break
        found.append(tuple(loop))
    return found


def _painted(face: _Face, points: Any, solid: Solid) -> str:
    """One face: its area, outlined in its own colour so that no seam shows, then its creases in ink."""
    red, green, blue = (round(255 * value * face.brightness) for value in solid.rgb)
    colour = f"#{red:02x}{green:02x}{blue:02x}"
    area = "".join("M" + "L".join(_xy(points[i]) for i in loop) + "Z" for loop in face.loops)
    text = f'<path d="{area}" fill="{colour}" stroke="{colour}" stroke-width="0.3" fill-rule="evenodd"/>'
    if face.creases:
        lines = "".join(f"M{_xy(points[a])}L{_xy(points[b])}" for a, b in face.creases)
        text += f'<path d="{lines}" fill="none" stroke="{INK}" stroke-width="0.7"/>'
    return text


def _xy(point: Any) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


# ------------------------------------------------------------------------------------------------ section


def cross_section(solids: tuple[Solid, ...], spec: SensorSpec, width: float) -> Drawing:
    """The cut through the middle of the array, seen along the jaw, `width` pixels wide, every layer named.

    With a jaw the opposing jaw is drawn closed on the sensor, and the port's circle about the pair's axis.
    """
    cuts = [(solid, _slice(solid, spec)) for solid in solids]
    cuts = [(solid, polygons) for solid, polygons in cuts if polygons]
    everything = [point for _, polygons in cuts for polygon in polygons for point in polygon]
    y0, y1 = min(p[0] for p in everything), max(p[0] for p in everything)
    z0, z1 = min(p[1] for p in everything), max(p[1] for p in everything)
    port = _port(cuts, spec, z1)
    if port is not None:
        axis, radius, other = port
        y0, y1, z0 = min(y0, -radius), max(y1, radius), min(z0, axis - radius)
        z1 = max(axis + radius, *(point[1] for polygon in other for point in polygon))
    scale = width / (y1 - y0)

    def place(point: Any) -> tuple[float, float]:
        return (point[0] - y0) * scale, (z1 - point[1]) * scale

    elements = [_area(polygons, place, solid.colour, f"section-{solid.name}") for solid, polygons in cuts]
    if port is not None:
        elements.insert(0, _area(other, place, "#eef1f3", "section-opposing-jaw"))
        centre = place((0.0, axis))
        elements.append(
            f'<circle cx="{centre[0]:.1f}" cy="{centre[1]:.1f}" r="{radius * scale:.1f}" fill="none" stroke="{INK}" '
            'stroke-dasharray="6 4" stroke-width="1.2"/>'
        )
    names, box = _labels(cuts, spec, place, width + 34.0, (z1 - z0) * scale)
    return Drawing((*elements, *names), (0.0, *box[1:]))


def _slice(solid: Solid, spec: SensorSpec) -> list[list[tuple[float, float]]]:
    """The solid's polygons (y, z in mm) in the plane through the middle of the array, across the jaw."""
    centres = [placement.centre[0] for placement in spec.array.placements]
    middle = 1e3 * math.fsum(centres) / len(centres) + 1e-4
    turned = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    cut = manifold(tessellate(solid, CHORD, TURN / 4)).transform(turned).slice(middle)
    return [[tuple(point) for point in np.asarray(polygon).tolist()] for polygon in cut.to_polygons()]


def _port(cuts: list, spec: SensorSpec, top: float) -> tuple[float, float, list] | None:
    """The closed pair's axis height and port radius (mm), and the opposing jaw's polygons; None without a jaw."""
    jaw = spec.mount.jaw if spec.mount else None
    if jaw is None:
        return None
    lower = next(polygons for solid, polygons in cuts if solid.role is BodyRole.JAW)
    bottom = min(point[1] for polygon in lower for point in polygon)
    axis = (bottom + top + (jaw.opposing_pad_thickness + jaw.height) * 1e3) / 2
    mirrored = [[(y, 2 * axis - z) for y, z in reversed(polygon)] for polygon in lower]
    if jaw.opposing_pad_thickness > 0.0:
        half, pad = section(jaw).face * 500, jaw.opposing_pad_thickness * 1e3
        mirrored.append([(-half, top), (half, top), (half, top + pad), (-half, top + pad)])
    return axis, jaw.port_diameter * 500, mirrored


def _area(polygons: list, place: Any, colour: str, name: str) -> str:
    path = "".join("M" + "L".join(_xy(place(point)) for point in polygon) + "Z" for polygon in polygons)
    return f'<path id="{name}" d="{path}" fill="{colour}" fill-rule="evenodd" stroke="{INK}" stroke-width="0.6"/>'


def _labels(cuts: list, spec: SensorSpec, place: Any, x: float, height: float) -> tuple[list[str], Box]:
    """Names with thicknesses beside the section, from the top down, each with a line to its layer; and their box."""
    rows = []
    for solid, polygons in cuts:
        levels = [point[1] for polygon in polygons for point in polygon]
        low, high = min(levels), max(levels)
        thick = _thickness(solid, high - low, spec)
        level = high - thick / 2 if _is_film(solid) else (low + high) / 2
        name = f"{solid.name}: {solid.material}, {thick:.3g} mm"
        rows.append((*place((_right_end(polygons, level), level)), name))
    if spec.mount and spec.mount.jaw:
        rows.append((None, math.inf, f"dashed: {spec.mount.jaw.port_diameter * 1e3:g} mm port, jaws closed"))
    rows.sort(key=lambda row: (row[1], row[2]))
    first = height / 2 - ROW * (len(rows) - 1) / 2
    elements = []
    for index, (px, py, text) in enumerate(rows):
        ty = first + ROW * index
        if px is not None:
            way = f"M{px:.1f} {py:.1f}L{x - 22:.1f} {py:.1f}L{x - 4:.1f} {ty:.1f}"
            elements.append(f'<path d="{way}" fill="none" stroke="{FAINT}" stroke-width="0.6"/>')
        elements.append(f'<text x="{x:.1f}" y="{ty + 4.5:.1f}" fill="{INK}">{escape(text)}</text>')
    above, below = first - ROW / 2, first + ROW * (len(rows) - 0.5)
    return elements, (x, min(0.0, above), x + 7.2 * max(len(row[2]) for row in rows), max(height, below))


def _right_end(polygons: list, level: float) -> float:
    """The largest y at which a horizontal line at a height crosses the polygons."""
    ends = []
    for polygon in polygons:
        for (ya, za), (yb, zb) in zip(polygon, [*polygon[1:], polygon[0]], strict=True):
            if (za <= level) != (zb <= level):
                ends.append(ya + (yb - ya) * (level - za) / (zb - za))
    return max(ends)


def _is_film(solid: Solid) -> bool:
    return solid.role is BodyRole.ENCAPSULATION


def _thickness(solid: Solid, height: float, spec: SensorSpec) -> float:
    """A layer's thickness in millimetres: its height, except for the film, which goes round the pad."""
    if _is_film(solid) and spec.encapsulation:
        return spec.encapsulation.thickness * 1e3
    return height
