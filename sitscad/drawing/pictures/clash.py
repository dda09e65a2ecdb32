"""Pictures of what clashes: the pieces cut open there, those that clash in full colour, what is too much in red."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np

from sitscad.drawing.pictures.rendered import Coloured, View, camera, fitted, rendered
from sitscad.drawing.sheet import Group, Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Point, polyline
from sitscad.parts.proof.clash import ACROSS, RED, Clash, Shown

SIZE = 420.0, 330.0
"""Of one picture (pixels)."""
MARGIN, TITLE, LETTERS, SWATCH = 14.0, 44.0, 13.0, 17.0
HEAD, LINE = 17.0, 17.0
"""Height of the title's letters, and between the lines above a picture."""
LEAST_AXIS = 40.0
"""Pixels that the axes of a picture are long, at least."""
PALE = 0.62
"""How far the colours of pieces that do not clash are drawn towards white."""
CAMERAS = {True: (math.radians(62.0), math.radians(24.0)), False: (math.radians(18.0), math.radians(22.0))}
"""Angles of the viewer, of a cut across the jaw and of one along it."""
NAMES = 190.0
"""Pixels beside a picture for the names of its colours."""
PORT = Pen(2.0, "#22303c", (7.0, 4.0), round_ends=False)


def clash_svg(name: str, clashes: Sequence[Clash]) -> str:
    """The pictures of some clashes below each other under a title, each with its words, its figure, the names of the
    colours, and how long a millimetre is along each axis.
    """
    title = f"{name}: what does not fit, the solids cut open"
    sheet = Sheet(title, unit="", decimals=1)
    with sheet.group("title"):
        sheet.text(0.0, -HEAD, title, HEAD, bold=True)
    heights = [HEAD + MARGIN]
    for clash in clashes:
        with sheet.group("clash"):
            heights.append(_picture(sheet, clash) + MARGIN)
    wide, high = 2 * MARGIN + SIZE[0] + NAMES, MARGIN + sum(heights)
    sheet.size = (wide, high)
    downs = accumulate(heights[:-1], initial=MARGIN)
    groups = [item for item in sheet.items if isinstance(item, Group)]
    sheet.items = [replace(group, offset=(MARGIN, high - down)) for group, down in zip(groups, downs, strict=True)]
    return svg(sheet)


def _picture(sheet: Sheet, clash: Clash) -> float:
    """One picture with its words, downwards from y = 0; its height."""
    sheet.text(0.0, -LETTERS, clash.words, LETTERS, bold=True)
    if clash.figure:
        sheet.text(0.0, -LETTERS - LINE, clash.figure, LETTERS, colour=RED)
    meshes = [Coloured(each.vertices, each.triangles, _colour(each)) for each in clash.bodies]
    view = fitted(meshes, camera(*CAMERAS[clash.normal == ACROSS]), SIZE)
    with sheet.group("", (0.0, -TITLE)):
        rendered(sheet, meshes, view, SIZE)
        if clash.port is not None:
            _port(sheet, clash.port, view)
    below = min(-TITLE + float(np.concatenate([view(mesh.vertices) for mesh in meshes])[:, 1].min()), -TITLE)
    _axes(sheet, view, (SIZE[0] + 60.0, min(below + 50.0, -TITLE - 190.0)))
    rows = [each for each in clash.bodies if each.clashes]
    for i, each in enumerate(rows):
        y = -TITLE - SWATCH * (i + 1)
        sheet.draw(polyline([Point(SIZE[0] + 20.0, y + 4.0), Point(SIZE[0] + 34.0, y + 4.0)]), Pen(9.0, each.colour))
        sheet.text(SIZE[0] + 42.0, y, each.name, LETTERS)
    drawn = np.concatenate([view(mesh.vertices) for mesh in meshes])
    return max(TITLE - float(drawn[:, 1].min()), TITLE + SWATCH * len(rows), TITLE + 260.0)


def _axes(sheet: Sheet, view: View, place: tuple[float, float]) -> None:
    """The axes as they are seen, each as long as the millimetres that are written beside them."""
    length = next((size for size in (0.2, 0.5, 1.0, 2.0, 5.0) if size * view.scale > LEAST_AXIS), 10.0)
    start = Point(*place)
    flat = view(np.vstack([np.zeros(3), length * np.eye(3)]))
    for name, (x, y) in zip("xyz", (flat[1:] - flat[0]).tolist(), strict=True):
        far = start.shifted(x, y)
        sheet.draw(polyline([start, far]), Pen(1.6, "#22303c"))
        out = 1.0 + 9.0 / max(9.0, math.hypot(x, y))
        sheet.text(start.x + out * x, start.y + out * y - 4.0, name, LETTERS, "middle")
    low = start.y + min(0.0, *(y - 10.0 for y in (flat[1:] - flat[0])[:, 1].tolist()))
    sheet.text(start.x, low - 22.0, f"{length:g} mm along each axis", LETTERS, "middle")


def _colour(shown: Shown) -> str:
    """A piece's own colour where it clashes, else a pale one."""
    if shown.clashes:
        return shown.colour
    parts = (int(shown.colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(value + (255 - value) * PALE):02x}" for value in parts)


def _port(sheet: Sheet, port: tuple[float, float, float, float], view: View) -> None:
    """The port's circle where the pair is cut."""
    x, y, z, radius = port
    turns = np.linspace(0.0, 2.0 * math.pi, 97)
    places = np.stack([np.full(97, x), y + radius * np.cos(turns), z + radius * np.sin(turns)], axis=1)
    sheet.draw(polyline([Point(*place) for place in view(places).tolist()]), PORT)
