"""Meshes in parallel projection as coloured areas, and the pictures made with them.

A depth buffer finds the visible face at every point of a fine raster. Hidden faces disappear, and bodies may intersect.
Raster areas of one colour become outlines, which are shapes of an ordinary sheet.

`clash_svg` draws clashing solids, cut open: the pieces that clash in full colour, the excess in red. `assembly_svg`
draws the assembly, exploded and in section across the jaw.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.places.jaws import jaw_section
from sitscad.assembly.solids.clash import ACROSS, RED, Clash, ColouredMesh
from sitscad.assembly.solids.solid import Solid, TriangleMesh, manifold, tessellate
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.files.drawing.sheet import Group, Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.geometry.path import Path, Point, circle, closed_polygon, polyline
from sitscad.spec.materials import Encapsulation
from sitscad.spec.mount import Mount
from sitscad.spec.places import cell_specs
from sitscad.spec.sensor import SensorSpec

Indices = NDArray[np.int64]

LIGHT = np.array((0.35, -0.55, 0.76))
SHADES = 8  # Steps between the darkest and the brightest face
DARKEST = 0.55
FINE = 4  # Points of the raster on one unit of the sheet
CREASE = 0.85  # Neighbouring faces whose normals' product is below this meet at an edge that is drawn
STAIR = 1.5  # Largest distance (raster points) of a simplified outline from its raster stairs
EDGE = Pen(0.6, "#22303c")

Corner = tuple[int, int]


@record(eq=False)
class PaintedMesh:
    """Closed mesh: vertices (n, 3), triangles (m, 3) with outward normals, and colour ``#rrggbb``."""

    vertices: Array
    triangles: Indices
    colour: str


@record(eq=False)
class SpaceView:
    """Parallel projection from space to the sheet.

    `right`, `up` and `toward` (to the viewer) are unit vectors. `scale` is a length on the sheet over the length in
    space. `corner` holds the coordinates along `right` and `up` of the sheet's origin, its left upper corner.
    """

    right: Array
    up: Array
    toward: Array
    scale: float
    corner: tuple[float, float]

    def __call__(self, points: Array) -> Array:
        """Return points (n, 3) in space as points (n, 2) on the sheet; y is 0 at the upper edge, negative below."""
        flat = np.stack([points @ self.right, points @ self.up], axis=1)
        return (flat - np.array(self.corner)) * self.scale


def view_axes(azimuth: float, elevation: float) -> tuple[Array, Array, Array]:
    """Return unit vectors to the right, up and towards a viewer.

    `azimuth` (rad) counts from -y towards +x, `elevation` (rad) upwards.
    """
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    toward = np.array([np.cos(elevation) * sine, -np.cos(elevation) * cosine, np.sin(elevation)])
    right = np.array([cosine, sine, 0.0])
    return right, np.cross(toward, right), toward


def fitted_view(
    meshes: Sequence[PaintedMesh], axes: tuple[Array, Array, Array], size: tuple[float, float]
) -> SpaceView:
    """Return the view along `axes` in which all meshes fill a size on the sheet."""
    points = np.concatenate([mesh.vertices for mesh in meshes])
    across, upwards = points @ axes[0], points @ axes[1]
    scale = min(size[0] / np.ptp(across), size[1] / np.ptp(upwards))
    return SpaceView(*axes, float(scale), (float(across.min()), float(upwards.max())))


def draw_meshes(
    sheet: Sheet, meshes: Sequence[PaintedMesh], view: SpaceView, size: tuple[float, float], opacity: float = 1.0
) -> None:
    """Draw meshes on a sheet from (0, 0) right and down within `size`.

    With `opacity` below 1, earlier items show through.
    """
    flats = [view(mesh.vertices) * (FINE, -FINE) for mesh in meshes]
    # `seen` (high, wide) is the triangle that each raster point shows, counted through all meshes; -1 if none. The
    # raster ends where the meshes end: most pictures are far from square
    ends = np.concatenate(flats).max(axis=0, initial=0.0)
    wide, high = (int(np.ceil(min(side * FINE, end + 1.0))) for side, end in zip(size, ends, strict=True))
    depth = np.full((high, wide), -np.inf)
    visible = np.full((high, wide), -1, dtype=np.int64)
    first = 0
    for mesh, flat in zip(meshes, flats, strict=True):
        deep = mesh.vertices @ view.toward
        for index in np.flatnonzero(_normals(mesh) @ view.toward > 1e-9):
            corners = mesh.triangles[index]
            _fill_triangle(depth, visible, flat[corners], deep[corners], first + int(index))
        first += len(mesh.triangles)
    # The part of the raster that shows anything, and its left upper corner
    rows, columns = (np.flatnonzero((visible >= 0).any(axis=axis)) for axis in (1, 0))
    corner = (int(columns[0]), int(rows[0])) if rows.size else (0, 0)
    if rows.size:
        visible = visible[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    shown = np.flatnonzero(np.bincount(visible[visible >= 0]))
    shades = np.concatenate([_face_colours(mesh.colour, _normals(mesh)) for mesh in meshes])
    colours = np.pad(np.where(visible >= 0, shades[visible], -1), 1, constant_values=-1)
    corners = _junction_corners(colours)
    for colour in np.unique(shades[shown]):
        outlines = [_simplified_border(loop, corners) for loop in _border_loops(colours == colour)]
        fill = f"#{colour:06x}"
        pen = Pen(0.4, fill) if opacity == 1.0 else None
        areas = [closed_polygon([_point(each, corner) for each in loop]) for loop in outlines if len(loop) > 2]
        sheet.draw(areas, pen, fill, opacity=opacity)
    smooth = _surface_numbers(meshes)
    surfaces = np.pad(np.where(visible >= 0, smooth[visible], -1), 1, constant_values=-1)
    # Every line between two surfaces once, simplified (a dict keeps the order)
    corners = _junction_corners(surfaces)
    loops: dict[tuple[Corner, ...], None] = {}
    for label in np.unique(smooth[shown]):
        for loop in _border_loops(surfaces == label):
            for piece in _border_pieces(loop, corners):
                loops[_simplified_piece(piece)] = None
    edges = list(loops)
    if edges:
        sheet.draw([polyline([_point(each, corner) for each in edge]) for edge in edges], EDGE)


def _fill_triangle(depth: Array, visible: Indices, flat: Array, deep: Array, index: int) -> None:
    """Write one triangle into the buffers where it is nearest.

    `flat` are its 3 corners in raster points, `deep` are their depths.
    """
    low = np.maximum(np.floor(flat.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(flat.max(axis=0)).astype(int) + 1, depth.shape[::-1])
    if (high <= low).any():
        return
    (ax, ay), (bx, by), (cx, cy) = flat
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if abs(area) < 1e-12:
        return
    x, y = np.arange(low[0], high[0]) + 0.5, (np.arange(low[1], high[1]) + 0.5)[:, None]
    v = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    inside = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1.0 + 1e-9)
    z = deep[0] + v * (deep[1] - deep[0]) + w * (deep[2] - deep[0])
    box = slice(low[1], high[1]), slice(low[0], high[0])
    nearer = inside & (z > depth[box] + 1e-9)
    depth[box][nearer] = z[nearer]
    visible[box][nearer] = index


def _normals(mesh: PaintedMesh) -> Array:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30))


def _face_colours(colour: str, normals: Array) -> Indices:
    """Return the colour (0xrrggbb) of each face: `colour`, darker the further the face is turned from the light."""
    bright = np.round(np.clip(normals @ LIGHT, 0.0, 1.0) * SHADES) / SHADES
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return np.asarray(
        np.round(parts * (DARKEST + (1.0 - DARKEST) * bright)[:, None]).astype(np.int64) @ np.array((65536, 256, 1))
    )


def _surface_numbers(meshes: Sequence[PaintedMesh]) -> Indices:
    """Return a number per triangle, equal for all triangles of one smooth surface.

    Neighbours in a mesh share a surface unless they meet at a `CREASE`.
    """
    surfaces: list[int] = []
    for mesh in meshes:
        normals, triangles, first = _normals(mesh), mesh.triangles.tolist(), len(surfaces)
        beside = {(t[i], t[(i + 1) % 3]): index for index, t in enumerate(triangles) for i in range(3)}
        surface_of = [-1] * len(triangles)
        for start in range(len(triangles)):
            waiting = [start] if surface_of[start] < 0 else []
            while waiting:
                index = waiting.pop()
                surface_of[index] = first + start
                corners = triangles[index]
                around = (beside.get((corners[(i + 1) % 3], corners[i])) for i in range(3))
                free = (k for k in around if k is not None and surface_of[k] < 0)
                waiting += [k for k in free if normals[index] @ normals[k] >= CREASE]
        surfaces += surface_of
    return np.array(surfaces, dtype=np.int64)


def _junction_corners(labels: Indices) -> set[Corner]:
    """Return the corners (x, y) of raster points at which three or four border lines between areas meet.

    `labels` is the number of the area of each raster point, padded by one point on each side.
    """
    a, b, c, d = labels[:-1, :-1], labels[:-1, 1:], labels[1:, 1:], labels[1:, :-1]
    borders = (a != b).astype(np.uint8) + (b != c) + (c != d) + (d != a)
    return {(int(x), int(y)) for y, x in zip(*np.nonzero(borders > 2), strict=True)}


def _border_loops(area: Flags) -> list[list[Corner]]:
    # Directed sides of raster points that bound the area: from each corner to the next corners. Corners are numbered
    # row by row, which is faster than pairs of coordinates
    rows, columns = (np.flatnonzero(area.any(axis=axis)) for axis in (1, 0))
    top, left = int(rows[0]) - 1, int(columns[0]) - 1
    area = area[top : rows[-1] + 2, left : columns[-1] + 2]
    wide = area.shape[1] + 1
    row, column = np.nonzero(area[1:, :] != area[:-1, :])
    level, forth = (row + 1) * wide + column, area[row + 1, column]
    row, column = np.nonzero(area[:, 1:] != area[:, :-1])
    upright, back = row * wide + column + 1, area[row, column + 1]
    starts = np.concatenate([level + ~forth, upright + wide * back])
    ends = np.concatenate([level + forth, upright + wide * ~back])
    following: dict[int, list[int]] = {}
    for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
        following.setdefault(a, []).append(b)
    loops = []
    while following:
        start = here = next(iter(following))
        loop = []
        while here in following:
            loop.append(here)
            next_corners = following[here]
            there = next_corners.pop()
            if not next_corners:
                del following[here]
            here = there
            if here == start:
                break
        y, x = np.divmod(loop, wide)
        loops.append(list(zip((x + left - 1).tolist(), (y + top - 1).tolist(), strict=True)))
    return loops


def _simplified_border(loop: list[Corner], corners: set[Corner]) -> list[Corner]:
    """Return a closed border with its stairs replaced by slanted lines.

    The `corners` where areas meet stay in place. Both areas beside a border get equal lines.
    """
    outline: list[Corner] = []
    for piece in _border_pieces(loop, corners):
        line = _simplified_piece(piece)
        outline += (line if line[0] == piece[0] and line[-1] == piece[-1] else line[::-1])[:-1]
    return outline


def _border_pieces(loop: list[Corner], corners: set[Corner]) -> list[list[Corner]]:
    """Return the pieces of a closed loop, cut at the corners where areas meet.

    With fewer than two such corners, the loop is cut at one corner and at the corner farthest from it.
    """
    cuts = [i for i, corner in enumerate(loop) if corner in corners]
    if len(cuts) < 2:
        here = cuts[0] if cuts else loop.index(min(loop))
        x, y = loop[here]
        farthest = max(range(len(loop)), key=lambda i: ((loop[i][0] - x) ** 2 + (loop[i][1] - y) ** 2, loop[i]))
        cuts = sorted({here, farthest})
    turned = loop[cuts[0] :] + loop[: cuts[0] + 1]
    ends = [cut - cuts[0] for cut in cuts] + [len(loop)]
    return [turned[a : b + 1] for a, b in pairwise(ends)]


def _simplified_piece(piece: list[Corner]) -> tuple[Corner, ...]:
    """Return the points of a simplified piece of border. They do not depend on the direction of the piece.

    Omitted points lie within `STAIR` of the result.
    """
    line = min(piece, piece[::-1])
    corners, waiting = {0, len(line) - 1}, [(0, len(line) - 1)]
    points = np.array(line, dtype=float)
    while waiting:
        a, b = waiting.pop()
        if b - a < 2:
            continue
        chord = points[b] - points[a]
        offsets = points[a + 1 : b] - points[a]
        long = float(np.hypot(*chord))
        off = np.abs(offsets @ (-chord[1], chord[0])) / long if long else np.hypot(offsets[:, 0], offsets[:, 1])
        worst = int(off.argmax())
        if off[worst] > STAIR:
            corners.add(a + 1 + worst)
            waiting += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return tuple(line[i] for i in sorted(corners))


def _point(each: Corner, corner: Corner) -> Point:
    return Point((each[0] + corner[0]) / FINE, -(each[1] + corner[1]) / FINE)


SIZE = 420.0, 330.0  # Size of one picture (pixels)
MARGIN, TITLE, LETTERS, SWATCH = 14.0, 44.0, 13.0, 17.0
HEAD, LINE = 17.0, 17.0  # Height of the title's letters, and between the lines above a picture
LEAST_AXIS = 40.0  # Least length of a picture's axes (pixels)
PALE = 0.62  # Blend of the colours of pieces that do not clash towards white
CAMERAS = {True: (math.radians(62.0), math.radians(24.0)), False: (math.radians(18.0), math.radians(22.0))}
"""Azimuth and elevation of the viewer (rad), for a cut across the jaw (True) and along it (False)."""
NAMES = 190.0  # Pixels beside a picture for the names of its colours
PORT = Pen(2.0, "#22303c", (7.0, 4.0), round_ends=False)


def clash_svg(name: str, clashes: Sequence[Clash]) -> str:
    """Return pictures of clashes below each other, as SVG text with a title.

    Each picture has its text, its figure, the names of the colours, and axes with their length in millimetres.
    """
    title = f"{name}: what does not fit, the solids cut open"
    sheet = Sheet(title, unit="", decimals=1)
    with sheet.group("title"):
        sheet.text(0.0, -HEAD, title, HEAD, bold=True)
    heights = [HEAD + MARGIN]
    for clash in clashes:
        with sheet.group("clash"):
            # One picture with its text, downwards from y = 0
            sheet.text(0.0, -LETTERS, clash.title, LETTERS, bold=True)
            if clash.excess_text:
                sheet.text(0.0, -LETTERS - LINE, clash.excess_text, LETTERS, colour=RED)
            meshes = [PaintedMesh(each.vertices, each.triangles, _shown_colour(each)) for each in clash.bodies]
            view = fitted_view(meshes, view_axes(*CAMERAS[clash.normal == ACROSS]), SIZE)
            with sheet.group("", (0.0, -TITLE)):
                draw_meshes(sheet, meshes, view, SIZE)
                if clash.port is not None:
                    # The port's circle in the cutting plane
                    x, middle, z, radius = clash.port
                    angles = np.linspace(0.0, 2.0 * math.pi, 97)
                    places = np.stack(
                        [np.full(97, x), middle + radius * np.cos(angles), z + radius * np.sin(angles)], axis=1
                    )
                    sheet.draw(polyline([Point(*place) for place in view(places).tolist()]), PORT)
            lowest = min(float(view(mesh.vertices)[:, 1].min()) for mesh in meshes)
            _draw_axes(sheet, view, (SIZE[0] + 60.0, min(min(-TITLE + lowest, -TITLE) + 50.0, -TITLE - 190.0)))
            rows = [each for each in clash.bodies if each.clashes]
            for i, each in enumerate(rows):
                y = -TITLE - SWATCH * (i + 1)
                sheet.draw(
                    polyline([Point(SIZE[0] + 20.0, y + 4.0), Point(SIZE[0] + 34.0, y + 4.0)]), Pen(9.0, each.colour)
                )
                sheet.text(SIZE[0] + 42.0, y, each.name, LETTERS)
            heights.append(max(TITLE - lowest, TITLE + SWATCH * len(rows), TITLE + 260.0) + MARGIN)
    wide, high = 2 * MARGIN + SIZE[0] + NAMES, MARGIN + sum(heights)
    sheet.size = (wide, high)
    downs = accumulate(heights[:-1], initial=MARGIN)
    groups = [item for item in sheet.items if isinstance(item, Group)]
    sheet.items = [replace(group, offset=(MARGIN, high - down)) for group, down in zip(groups, downs, strict=True)]
    return svg(sheet)


def _draw_axes(sheet: Sheet, view: SpaceView, place: tuple[float, float]) -> None:
    """Draw the projected axes with their names, and their common length (mm) as text."""
    length = next((size for size in (0.2, 0.5, 1.0, 2.0, 5.0) if size * view.scale > LEAST_AXIS), 10.0)
    start = Point(*place)
    flat = view(np.vstack([np.zeros(3), length * np.eye(3)]))
    for name, (x, y) in zip("xyz", (flat[1:] - flat[0]).tolist(), strict=True):
        end = start.shifted(x, y)
        sheet.draw(polyline([start, end]), Pen(1.6, "#22303c"))
        out = 1.0 + 9.0 / max(9.0, math.hypot(x, y))
        sheet.text(start.x + out * x, start.y + out * y - 4.0, name, LETTERS, "middle")
    low = start.y + min(0.0, *(y - 10.0 for y in (flat[1:] - flat[0])[:, 1].tolist()))
    sheet.text(start.x, low - 22.0, f"{length:g} mm along each axis", LETTERS, "middle")


def _shown_colour(shown: ColouredMesh) -> str:
    if shown.clashes:
        return shown.colour
    parts = (int(shown.colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(value + (255 - value) * PALE):02x}" for value in parts)


CHORD, TURN = 0.02, 0.5  # mm, rad: a picture's mesh
AZIMUTH, ELEVATION = math.radians(28.0), math.radians(32.0)  # the viewer stands towards +x and -y, above
INK = "#22303c"
TRANSLUCENT = 0.6  # Opacity of the film: the pieces below show through


def draw_exploded(sheet: Sheet, solids: tuple[Solid, ...], width: float, height: float) -> tuple[float, float]:
    """Draw the solids moved apart along z, fitted into width and height (pixels), downwards from y = 0.

    Returns the used width and height (pixels).
    """
    meshes = [
        (solid, PaintedMesh(mesh.vertices, mesh.triangles, solid.colour))
        for solid, mesh in _lifted_meshes(_trimmed_meshes(solids))
    ]
    every = [mesh for _, mesh in meshes]
    view = fitted_view(every, view_axes(AZIMUTH, ELEVATION), (width, height))
    for solid, mesh in meshes:
        with sheet.group(f"exploded-{solid.name}"):
            opacity = TRANSLUCENT if solid.role is BodyRole.ENCAPSULATION else 1.0
            draw_meshes(sheet, [mesh], view, (width, height), opacity)
    wide, down = np.ptp(view(np.concatenate([mesh.vertices for mesh in every])), axis=0).tolist()
    return wide, down


def _trimmed_meshes(solids: tuple[Solid, ...]) -> list[tuple[Solid, TriangleMesh]]:
    """Return the solids with their meshes, cut a little beyond the sensor.

    A long tail would otherwise shrink the picture.
    """
    meshes = [(solid, tessellate(solid, CHORD, TURN)) for solid in solids]
    body = [m.vertices[:, 0] for s, m in meshes if s.role not in (BodyRole.BOARD, BodyRole.STIFFENER)]
    if not body:
        return meshes
    x0, x1 = min(float(x.min()) for x in body), max(float(x.max()) for x in body)
    lines = []
    for solid, mesh in meshes:
        part = manifold(mesh).trim_by_plane((-1.0, 0.0, 0.0), -(x1 + 0.3 * (x1 - x0)))
        if not part.is_empty():
            cut = part.to_mesh64()
            points = np.asarray(cut.vert_properties)[:, :3]
            lines.append((solid, TriangleMesh(solid.name, points, np.asarray(cut.tri_verts).astype(int))))
    return lines


def _lifted_meshes(meshes: list[tuple[Solid, TriangleMesh]]) -> list[tuple[Solid, TriangleMesh]]:
    """Return the meshes moved apart along z, each clear of the mesh before it.

    Consecutive meshes of equal role and base height (parts of cells) are moved together.
    """
    depth = max(float(m.vertices[:, 1].max() - m.vertices[:, 1].min()) for _, m in meshes)
    gap, top, lifts, lift, before = 0.3 * depth, None, [], 0.0, None
    for solid, mesh in meshes:
        low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
        if top is not None and before != (solid.role, round(low, 6)):
            lift = top + gap - low
        top, before = high + lift, (solid.role, round(low, 6))
        lifts.append((solid, TriangleMesh(mesh.name, mesh.vertices + np.array([0.0, 0.0, lift]), mesh.triangles)))
    return lifts


FAINT, OTHER = "#7f8c8d", "#eef1f3"
ROW = 21.0  # Pixels between two labels
AREA = Pen(0.6, INK, round_corners=False, round_ends=False)
LEADER = Pen(0.6, FAINT, round_corners=False, round_ends=False)
SECTION_PORT = Pen(1.2, INK, (6.0, 4.0), round_ends=False)

Polygons = list[list[tuple[float, float]]]


Place = Callable[[float, float], Point]
"""Map from the section's millimetres (y across the jaw, z upwards) to the sheet, in pixels downwards from y = 0."""


def _outlines(polygons: Polygons, place: Place) -> list[Path]:
    return [closed_polygon([place(*point) for point in polygon]) for polygon in polygons]


def _section_polygons(solid: Solid, spec: SensorSpec) -> Polygons:
    """Return the solid's polygons (y, z; mm) in the plane across the jaw.

    The plane passes 0.1 um beyond the middle of the array, or of the middle cell.
    """
    cells = cell_specs(spec)
    middle = 1e3 * cells[len(cells) // 2].array.middle[0] + 1e-4
    turned = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    cut = manifold(tessellate(solid, CHORD, TURN / 4)).transform(turned).slice(middle)
    # Triangles leave points on straight edges, which would differ with the length of the tail
    cut = cut.simplify(1e-6)
    return [[tuple(point) for point in np.asarray(polygon).tolist()] for polygon in cut.to_polygons()]


def _port_and_jaw(
    cuts: list[tuple[Solid, Polygons]], mount: Mount | None, top: float
) -> tuple[float, float, Polygons] | None:
    """Return the height of the closed pair's axis, the port's radius, and the opposing jaw's polygons (y, z) in mm.

    Returns None if there is no jaw in the section.
    """
    jaw = mount.jaw if mount else None
    if jaw is None:
        return None
    lower = next((polygons for solid, polygons in cuts if solid.role is BodyRole.JAW), None)
    if not lower:  # a jaw from a STEP file may end before the section
        return None
    bottom = min(point[1] for polygon in lower for point in polygon)
    axis = (bottom + top + (jaw.opposing_pad_thickness + jaw.height) * 1e3) / 2
    mirrored = [[(y, 2 * axis - z) for y, z in reversed(polygon)] for polygon in lower]
    if jaw.opposing_pad_thickness > 0.0:
        half, pad = jaw_section(jaw).face * 500, jaw.opposing_pad_thickness * 1e3
        mirrored.append([(-half, top), (half, top), (half, top + pad), (-half, top + pad)])
    return axis, jaw.port_diameter * 500, mirrored


def _draw_labels(
    sheet: Sheet, cuts: Sequence[tuple[Solid, Polygons]], film: Encapsulation | None, mount: Mount | None, place: Place,
    x: float, height: float,
) -> tuple[float, float, float, float]:
    """Draw names with thicknesses beside the section, from the top down, each with a line to its layer.

    Returns the box of section and labels (x0, y0, x1, y1 in pixels, y down). For a piece of a jig, the label states its
    total height, with pins and pegs, which the section does not show.
    """
    rows: list[tuple[Point | None, float, str]] = []
    for solid, polygons in cuts:
        levels = [point[1] for polygon in polygons for point in polygon]
        low, high = min(levels), max(levels)
        # A layer's thickness (mm) is its height, except for the film, which also covers the sides of the pad
        is_film = solid.role is BodyRole.ENCAPSULATION
        thick = film.thickness * 1e3 if is_film and film else high - low
        level = high - thick / 2 if is_film else (low + high) / 2
        # The leader starts at the largest y at which the horizontal line at `level` crosses the polygons
        ends = []
        for ring in polygons:
            for (ya, za), (yb, zb) in zip(ring, [*ring[1:], ring[0]], strict=True):
                if (za <= level) != (zb <= level):
                    ends.append(ya + (yb - ya) * (level - za) / (zb - za))
        at, word = place(max(ends), level), ""
        if solid.role is BodyRole.JIG:
            thick, word = float(solid.shape.bounding_box().size.Z), " high"
        rows.append((at, -at.y, f"{solid.name}: {solid.material}, {thick:.3g} mm{word}"))
    if mount and mount.jaw:
        rows.append((None, math.inf, f"dashed: {mount.jaw.port_diameter * 1e3:g} mm port, jaws closed"))
    rows.sort(key=lambda row: (row[1], row[2]))
    first = height / 2 - ROW * (len(rows) - 1) / 2
    for index, (at_, _, text) in enumerate(rows):
        down = first + ROW * index
        if at_ is not None:
            sheet.draw(polyline([at_, Point(x - 22.0, at_.y), Point(x - 4.0, -down)]), LEADER)
        sheet.text(x, -down - 4.5, text, LETTERS, colour=INK)
    above, below = first - ROW / 2, first + ROW * (len(rows) - 0.5)
    return 0.0, min(0.0, above), x + 7.2 * max(len(row[2]) for row in rows), max(height, below)


GAP = 40.0  # Pixels between the two drawings


def assembly_svg(
    solids: tuple[Solid, ...], spec: SensorSpec, what: str = "assembly", captions: Sequence[str] = ()
) -> str:
    """Return the assembly as SVG text: exploded on the left, in section across the jaw on the right.

    The section is to scale, with the port's circle. `captions` are lines of text below the section.
    """
    sheet = Sheet(f"{spec.name}: {what}, exploded and in section", unit="", decimals=1, ground=None)
    with sheet.group("exploded"):
        wide, tall = draw_exploded(sheet, solids, 470.0, 470.0)
    with sheet.group("section"):
        # The cut through the middle of the array, seen along the jaw, 260 pixels wide, downwards from y = 0. `section`
        # is the box of cut and labels (x0, y0, x1, y1 in pixels, y down)
        cuts = [(solid, _section_polygons(solid, spec)) for solid in solids]
        cuts = [(solid, polygons) for solid, polygons in cuts if polygons]
        everything = [point for _, polygons in cuts for polygon in polygons for point in polygon]
        y0, y1 = min(p[0] for p in everything), max(p[0] for p in everything)
        z0, z1 = min(p[1] for p in everything), max(p[1] for p in everything)
        port = _port_and_jaw(cuts, spec.mount, z1)
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
            sheet.draw(circle(place(0.0, axis), radius * scale), SECTION_PORT, name="section-port")
        section = _draw_labels(sheet, cuts, spec.encapsulation, spec.mount, place, 260.0 + 34.0, (z1 - z0) * scale)
        for line in captions:
            x0, top, x1, low = section
            section = x0, top, max(x1, x0 + 7.2 * len(line)), low + ROW
            sheet.text(x0, -section[3], line, LETTERS, colour=INK)
    boxes = ((0.0, 0.0, wide, tall), section)
    height = max(y1 - y0 for _, y0, _, y1 in boxes)
    sheet.size = (round(sum(x1 - x0 for x0, _, x1, _ in boxes) + GAP + 2 * MARGIN), round(height + 2 * MARGIN))
    pictures, x = [], MARGIN
    for group, (x0, y0, x1, y1) in zip(sheet.items, boxes, strict=True):
        assert isinstance(group, Group)
        down = MARGIN + (height - (y1 - y0)) / 2 - y0
        pictures.append(Group(group.name, group.items, (x - x0, sheet.size[1] - down)))
        x += x1 - x0 + GAP
    sheet.items = list(pictures)
    return svg(sheet)
