"""The picture of the assembly: its solids drawn apart in parallel projection, and in section across the jaw. Drawn
apart, from the bottom up, solids are in each other's way only as the upper one hides the lower: each has a depth buffer
of its own (`rendered`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from sitscad.drawing.pictures.rendered import Coloured, camera, fitted, rendered
from sitscad.drawing.sheet import Group, Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Path, Point, circle, closed_polygon, polyline
from sitscad.parts.mesh import TriangleMesh, manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole
from sitscad.scene.jaws import section
from sitscad.spec.mount import Mount
from sitscad.spec.places import cell_placements
from sitscad.spec.sensor import SensorSpec

CHORD, TURN = 0.02, 0.5  # mm, rad: a picture's mesh
AZIMUTH, ELEVATION = math.radians(28.0), math.radians(32.0)  # the viewer stands towards +x and -y, above
INK = "#22303c"
TRANSLUCENT = 0.6  # Opacity of the film, through which the pieces below it are seen


def exploded(sheet: Sheet, solids: tuple[Solid, ...], width: float, height: float) -> tuple[float, float]:
    """Draw the solids apart along z, fitted into width and height (pixels) from y = 0 down; what it takes of both."""
    meshes = [
        (solid, Coloured(mesh.vertices, mesh.triangles, solid.colour)) for solid, mesh in _lifted(_trimmed(solids))
    ]
    every = [mesh for _, mesh in meshes]
    view = fitted(every, camera(AZIMUTH, ELEVATION), (width, height))
    for solid, mesh in meshes:
        with sheet.group(f"exploded-{solid.name}"):
            opacity = TRANSLUCENT if solid.role is BodyRole.ENCAPSULATION else 1.0
            rendered(sheet, [mesh], view, (width, height), opacity)
    wide, down = np.ptp(view(np.concatenate([mesh.vertices for mesh in every])), axis=0).tolist()
    return wide, down


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
    """The meshes moved apart along z, each clear of those before it; cells' pieces of one height together."""
    depth = max(float(m.vertices[:, 1].max() - m.vertices[:, 1].min()) for _, m in meshes)
    gap, top, found, lift, before = 0.3 * depth, None, [], 0.0, None
    for solid, mesh in meshes:
        low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
        if top is not None and before != (solid.role, round(low, 6)):
            lift = top + gap - low
        top, before = high + lift, (solid.role, round(low, 6))
        found.append((solid, TriangleMesh(mesh.name, mesh.vertices + np.array([0.0, 0.0, lift]), mesh.triangles)))
    return found


FAINT, OTHER = "#7f8c8d", "#eef1f3"
ROW, LETTERS = 21.0, 13.0  # Pixels between two labels, and the height of their letters
AREA = Pen(0.6, INK, round_corners=False, round_ends=False)
LEADER = Pen(0.6, FAINT, round_corners=False, round_ends=False)
PORT = Pen(1.2, INK, (6.0, 4.0), round_ends=False)

Polygons = list[list[tuple[float, float]]]


Place = Callable[[float, float], Point]
"""From the section's millimetres (y across the jaw, z upwards) to the sheet, in pixels downwards from y = 0."""


def _outlines(polygons: Polygons, place: Place) -> list[Path]:
    return [closed_polygon([place(*point) for point in polygon]) for polygon in polygons]


def _slice(solid: Solid, spec: SensorSpec) -> Polygons:
    """The solid's polygons (y, z; mm) in the plane across the jaw through the middle, or through a cell there."""
    cells = cell_placements(spec)
    centres = [placement.centre[0] for placement in cells[len(cells) // 2]]
    middle = 1e3 * math.fsum(centres) / len(centres) + 1e-4
    turned = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    cut = manifold(tessellate(solid, CHORD, TURN / 4)).transform(turned).slice(middle)
    # triangles leave points on straight edges, which move with a longer tail
    cut = cut.simplify(1e-6)
    return [[tuple(point) for point in np.asarray(polygon).tolist()] for polygon in cut.to_polygons()]


def _port(cuts: list[tuple[Solid, Polygons]], mount: Mount | None, top: float) -> tuple[float, float, Polygons] | None:
    """The closed pair's axis height and port radius (mm), and the opposing jaw's polygons; None without a jaw."""
    jaw = mount.jaw if mount else None
    if jaw is None:
        return None
    lower = next((polygons for solid, polygons in cuts if solid.role is BodyRole.JAW), None)
    if not lower:  # a jaw out of a STEP file that ends before the section
        return None
    bottom = min(point[1] for polygon in lower for point in polygon)
    axis = (bottom + top + (jaw.opposing_pad_thickness + jaw.height) * 1e3) / 2
    mirrored = [[(y, 2 * axis - z) for y, z in reversed(polygon)] for polygon in lower]
    if jaw.opposing_pad_thickness > 0.0:
        half, pad = section(jaw).face * 500, jaw.opposing_pad_thickness * 1e3
        mirrored.append([(-half, top), (half, top), (half, top + pad), (-half, top + pad)])
    return axis, jaw.port_diameter * 500, mirrored


def _labels(
    sheet: Sheet, cuts: Sequence[tuple[Solid, Polygons]], spec: SensorSpec, place: Place, x: float, height: float
) -> tuple[float, float, float, float]:
    """Names with thicknesses beside the section, from the top down, each with a line to its layer; the box of all.

    Pieces of a jig have their whole height, pins and pegs included: the cut shows none of these.
    """
    rows: list[tuple[Point | None, float, str]] = []
    for solid, polygons in cuts:
        levels = [point[1] for polygon in polygons for point in polygon]
        low, high = min(levels), max(levels)
        # A layer's thickness in millimetres: its height, except for the film, which goes round the pad
        is_film = solid.role is BodyRole.ENCAPSULATION
        thick = spec.encapsulation.thickness * 1e3 if is_film and spec.encapsulation else high - low
        level = high - thick / 2 if is_film else (low + high) / 2
        # The largest y at which a horizontal line at a height crosses the polygons
        ends = []
        for ring in polygons:
            for (ya, za), (yb, zb) in zip(ring, [*ring[1:], ring[0]], strict=True):
                if (za <= level) != (zb <= level):
                    ends.append(ya + (yb - ya) * (level - za) / (zb - za))
        at, word = place(max(ends), level), ""
        if solid.role is BodyRole.JIG:
            thick, word = float(solid.shape.bounding_box().size.Z), " high"
        rows.append((at, -at.y, f"{solid.name}: {solid.material}, {thick:.3g} mm{word}"))
    if spec.mount and spec.mount.jaw:
        rows.append((None, math.inf, f"dashed: {spec.mount.jaw.port_diameter * 1e3:g} mm port, jaws closed"))
    rows.sort(key=lambda row: (row[1], row[2]))
    first = height / 2 - ROW * (len(rows) - 1) / 2
    for index, (at_, _, text) in enumerate(rows):
        down = first + ROW * index
        if at_ is not None:
            sheet.draw(polyline([at_, Point(x - 22.0, at_.y), Point(x - 4.0, -down)]), LEADER)
        sheet.text(x, -down - 4.5, text, LETTERS, colour=INK)
    above, below = first - ROW / 2, first + ROW * (len(rows) - 0.5)
    return 0.0, min(0.0, above), x + 7.2 * max(len(row[2]) for row in rows), max(height, below)


GAP, MARGIN = 40.0, 14.0  # Pixels between the two drawings, and round them


def assembly_svg(solids: tuple[Solid, ...], spec: SensorSpec, what: str = "assembly") -> str:
    """The exploded assembly on the left, the section across the jaw (to scale, with the port's circle) on the right."""
    sheet = Sheet(f"{spec.name}: {what}, exploded and in section", unit="", decimals=1, ground=None)
    with sheet.group("exploded"):
        wide, tall = exploded(sheet, solids, 470.0, 470.0)
    with sheet.group("section"):
        # Draw the cut through the middle of the array, seen along the jaw, `width` pixels wide, downwards from y = 0;
        # the box that it fills with its labels (x0, y0, x1, y1 in pixels, y down)
        cuts = [(solid, _slice(solid, spec)) for solid in solids]
        cuts = [(solid, polygons) for solid, polygons in cuts if polygons]
        everything = [point for _, polygons in cuts for polygon in polygons for point in polygon]
        y0, y1 = min(p[0] for p in everything), max(p[0] for p in everything)
        z0, z1 = min(p[1] for p in everything), max(p[1] for p in everything)
        port = _port(cuts, spec.mount, z1)
        if port is not None:
            axis, radius, other = port
            y0, y1, z0 = min(y0, -radius), max(y1, radius), min(z0, axis - radius)
            z1 = max(axis + radius, *(point[1] for polygon in other for point in polygon))
        scale, corner = 260.0 / (y1 - y0), (y0, z1)

        def place(y: float, z: float) -> Point:
            return Point((y - corner[0]) * scale, (z - corner[1]) * scale)

        if port is not None:
            sheet.draw(_outlines(other, place), AREA, OTHER, "section-opposing-jaw")
        for solid, polygons in cuts:
            sheet.draw(_outlines(polygons, place), AREA, solid.colour, f"section-{solid.name}")
        if port is not None:
            sheet.draw(circle(place(0.0, axis), radius * scale), PORT, name="section-port")
        section = _labels(sheet, cuts, spec, place, 260.0 + 34.0, (z1 - z0) * scale)
    boxes = ((0.0, 0.0, wide, tall), section)
    height = max(y1 - y0 for _, y0, _, y1 in boxes)
    sheet.size = (round(sum(x1 - x0 for x0, _, x1, _ in boxes) + GAP + 2 * MARGIN), round(height + 2 * MARGIN))
    placed, x = [], MARGIN
    for group, (x0, y0, x1, y1) in zip(sheet.items, boxes, strict=True):
        assert isinstance(group, Group)
        down = MARGIN + (height - (y1 - y0)) / 2 - y0
        placed.append(Group(group.name, group.items, (x - x0, sheet.size[1] - down)))
        x += x1 - x0 + GAP
    sheet.items = list(placed)
    return svg(sheet)
