"""Plots on a sheet: matplotlib lays axes, ticks and legends out, the sheet's shapes and letters draw them.

So a plot is vector art of the same vocabulary as every drawing, in SVG and PDF alike, with no font, date or identifier
of the plotting library in it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sitscad.drawing.sheet import Pen, Sheet, text_width
from sitscad.geometry.path import Point, closed_polygon, polyline
from sitscad.parts.extras import require

INCH, POINT = 25.4, 25.4 / 72.0
"""Millimetres."""

DOTS = 72.0
"""Units in an inch that matplotlib works in: its points."""

LETTERS = 7.5
"""Size of the letters (points)."""

RISE, DROP = 0.72, 0.21
"""Height of capitals and depth of letters below the line, of a size of Helvetica."""

COLOURS = ("#1f5fa8", "#c4602b", "#2a7f4f", "#7a4fa3", "#8a6d00", "#5c6670")
"""The colours of curves, in their order: told apart by those who do not see all colours, too."""


def plot(sheet: Sheet, box: tuple[float, float, float, float], draw: Callable[[Any], None]) -> None:
    """Draw a figure into a box of a sheet (left, low, width, height; mm); `draw` takes the matplotlib figure.

    Raises `MissingExtra` where matplotlib is not installed.
    """
    matplotlib = require("matplotlib")
    from matplotlib.backend_bases import FigureCanvasBase
    from matplotlib.figure import Figure

    left, low, width, height = box
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_manner())
        figure = Figure(figsize=(width / INCH, height / INCH), dpi=DOTS, layout="constrained")
        FigureCanvasBase(figure)
        draw(figure)
        with sheet.group():
            figure.draw(_renderer(sheet, (left, low), (width, height)))


def _manner() -> dict[str, Any]:
    """The settings with which matplotlib draws: thin lines, small letters, our colours."""
    from matplotlib.rcsetup import cycler

    return {
        "font.size": LETTERS, "axes.unicode_minus": False, "axes.linewidth": 0.5, "axes.grid": True,
        "grid.linewidth": 0.25, "grid.color": "#d9dee3", "lines.linewidth": 1.1, "xtick.major.width": 0.5,
        "ytick.major.width": 0.5, "legend.frameon": False, "axes.titlesize": LETTERS + 1.0,
        "axes.prop_cycle": cycler(color=COLOURS), "axes.formatter.useoffset": False, "path.simplify": False,
        "axes.titleweight": "bold",
    }


def _renderer(sheet: Sheet, corner: tuple[float, float], size: tuple[float, float]) -> Any:
    """What matplotlib draws with: paths become shapes of the sheet, texts its labels."""
    from matplotlib.backend_bases import RendererBase

    class SheetRenderer(RendererBase):
        """Draws on a sheet."""

        def get_canvas_width_height(self) -> tuple[float, float]:
            """Of the box (points)."""
            return size[0] / POINT, size[1] / POINT

        def points_to_pixels(self, points: Any) -> Any:
            """The same: it works in points."""
            return points

        def flipy(self) -> bool:
            """The sheet's y goes up."""
            return False

        def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
            """Of a text in Helvetica (points)."""
            letters = prop.get_size_in_points()
            return text_width(s, letters), (RISE + DROP) * letters, DROP * letters

        def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
            """A line or an area."""
            _draw(sheet, corner, gc, transform.transform_path(path), rgbFace)

        def draw_text(
            self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, ismath: Any = False, mtext: Any = None
        ) -> None:
            """A text from its left end on."""
            bold, letters = prop.get_weight() in ("bold", 700), prop.get_size_in_points() * POINT
            at = corner[0] + x * POINT, corner[1] + y * POINT
            sheet.text(*at, s, letters, angle=angle, colour=_colour(gc.get_rgb()), bold=bold)

    return SheetRenderer()


def _draw(sheet: Sheet, corner: tuple[float, float], gc: Any, path: Any, face: Any) -> None:
    """One path of matplotlib's (points) as shapes of the sheet, cut off where its axes end."""
    clip, filled = gc.get_clip_rectangle(), face is not None and (len(face) < 4 or face[3] > 0.0)
    if clip is not None and len(path.vertices):
        path = path.clip_to_bbox(clip, inside=True) if filled else _cut(path, clip)
    pieces = [
        [Point(corner[0] + float(x) * POINT, corner[1] + float(y) * POINT) for x, y in piece]
        for piece in path.to_polygons(closed_only=False)
        if len(piece) > 1
    ]
    alpha = gc.get_alpha() if gc.get_alpha() is not None else 1.0
    if filled:
        opacity = face[3] if len(face) == 4 else alpha
        areas = [closed_polygon(_open(piece)) for piece in pieces if len(_open(piece)) > 2]
        if areas:
            sheet.draw(areas, None, _colour(face), opacity=float(opacity))
    width = gc.get_linewidth()
    if width > 0.0 and gc.get_rgb()[3] > 0.0 and pieces:
        dashes = gc.get_dashes()[1]
        pen = Pen(width * POINT, _colour(gc.get_rgb()), tuple(float(d) * POINT for d in dashes) if dashes else ())
        sheet.draw([polyline(piece) for piece in pieces], pen)


def _open(piece: list[Point]) -> list[Point]:
    """A ring without its first point again at the end."""
    return piece[:-1] if len(piece) > 2 and piece[0].distance(piece[-1]) < 1e-9 else piece


def _cut(path: Any, clip: Any) -> Any:
    """The part of a line inside a box: points beyond are left out, ends lie within a point's distance of the edge."""
    from matplotlib.path import Path

    x0, y0, x1, y1 = clip.extents
    vertices = path.interpolated(1).vertices
    inside = (vertices[:, 0] >= x0 - 0.5) & (vertices[:, 0] <= x1 + 0.5)
    inside &= (vertices[:, 1] >= y0 - 0.5) & (vertices[:, 1] <= y1 + 0.5)
    if inside.all():
        return path
    codes, kept, before = [], [], False
    for vertex, within in zip(vertices, inside, strict=True):
        if within:
            kept.append(vertex)
            codes.append(Path.LINETO if before else Path.MOVETO)
        before = bool(within)
    return Path(kept, codes) if kept else Path([(x0, y0)])


def _colour(rgb: Any) -> str:
    return "#" + "".join(f"{round(255.0 * float(part)):02x}" for part in rgb[:3])
