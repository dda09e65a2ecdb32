"""Drawing sheets: lines, areas and texts on paper, which `drawing.svg` and `drawing.pdf` write as files.

The origin is at the lower left, y upwards. Both writers take equal sheets, so that SVG and PDF show equal pictures,
true to scale when printed unscaled.

`text_strokes` draws texts as lines. `draw_figure` draws matplotlib figures: matplotlib lays out axes, ticks and
legends, and the shapes and labels of a sheet draw them. The file then contains no font, date or identifier of
matplotlib.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import repeat
from typing import Any, TypeAlias, Union

from sitscad.assembly.solids.solid import import_extra
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Line, Path, Point, closed_polygon, polyline

A4 = (297.0, 210.0)  # Landscape, millimetres

BLACK = "#000000"

# Widths of Helvetica's characters from the space (code 32) to the tilde (126), in thousandths of the font size.
_WIDTHS = (
    "278 278 355 556 556 889 667 191 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 278 278 "
    "584 584 584 556 1015 667 667 722 722 667 611 778 722 278 500 667 556 833 722 778 667 778 722 667 611 722 667 944 "
    "667 667 611 278 278 278 469 556 333 556 556 500 556 556 278 556 556 222 222 500 222 833 556 556 556 556 333 500 "
    "278 556 500 722 500 500 500 334 260 334 584"
)
_CHARACTER_WIDTHS = {chr(32 + k): int(width) for k, width in enumerate(_WIDTHS.split())}


@record
class Pen:
    """Width (mm), colour (``#rrggbb``) and dashes (mm on, mm off, ...) of a line.

    If ends or corners are not round, ends are cut off and corners are pointed.
    """

    width: float = 0.25
    colour: str = BLACK
    dashes: tuple[float, ...] = ()
    round_ends: bool = True
    round_corners: bool = True


@record
class Shape:
    """Paths (mm) that are drawn with a pen, filled, or both.

    Holes are paths of the same shape (even-odd rule). ``opacity`` applies to the filling. ``name`` becomes the id in
    SVG, ``kind`` the class for style sheets.
    """

    paths: tuple[Path, ...]
    pen: Pen | None
    fill: str | None
    name: str = ""
    opacity: float = 1.0
    kind: str = ""


@record
class Label:
    """Text in Helvetica with its place and size (mm), anchor (``start``, ``middle``, ``end``) and angle (deg).

    ``halo`` is the width (mm) of a white line round the letters, drawn below the letters.
    """

    at: Point
    text: str
    size: float
    anchor: str = "start"
    angle: float = 0.0
    colour: str = BLACK
    halo: float = 0.0
    bold: bool = False


@record
class Group:
    """Items with a common name (the id in SVG), moved by ``offset`` (mm).

    Only the part inside ``window`` (x0, y0, x1, y1 in mm, after moving) is shown. A group with ``layer`` is a layer in
    drawing programs (Inkscape), too.
    """

    name: str
    items: tuple[Item, ...]
    offset: tuple[float, float] = (0.0, 0.0)
    window: tuple[float, float, float, float] | None = None
    kind: str = ""
    layer: bool = False


Item = Union[Shape, Label, Group]  # noqa: UP007  (the alias is used before it is complete)


@dataclass
class Sheet:
    """Items in the order of drawing.

    Lengths are millimetres on paper. If ``unit`` is empty, all lengths are pixels on a screen, also in pens, shapes and
    labels. ``decimals`` is the number of decimals of coordinates in files. If ``ground`` is None, the sheet has no
    background of its own.
    """

    title: str
    size: tuple[float, float] = A4
    items: list[Item] = field(default_factory=list)
    unit: str = "mm"
    decimals: int = 4
    ground: str | None = "#ffffff"
    font: str = "Helvetica, Arial, sans-serif"
    kind: str = ""

    def draw(
        self, paths: Path | Iterable[Path], pen: Pen | None = None, fill: str | None = None, name: str = "",
        opacity: float = 1.0, kind: str = "",
    ) -> None:
        """Add paths as one shape. Paths without segments are left out, such as a `polyline` of one repeated point."""
        nonempty = tuple(path for path in ((paths,) if isinstance(paths, Path) else paths) if path.segments)
        self.items.append(Shape(nonempty, pen, fill, name, opacity, kind))

    def line(self, x0: float, y0: float, x1: float, y1: float, pen: Pen | None = None) -> None:
        """Add a straight line."""
        self.draw(Path((Line(Point(x0, y0), Point(x1, y1)),)), pen or Pen())

    def text(
        self, x: float, y: float, text: str, size: float = 3.0, anchor: str = "start", angle: float = 0.0,
        colour: str = BLACK, halo: float = 0.0, bold: bool = False,
    ) -> None:
        """Add a text. `anchor` is the point of its base line at (x, y): its start, middle or end."""
        self.items.append(Label(Point(x, y), text, size, anchor, angle, colour, halo, bold))

    @contextmanager
    def group(
        self, name: str = "", offset: tuple[float, float] = (0.0, 0.0),
        window: tuple[float, float, float, float] | None = None, kind: str = "", layer: bool = False,
    ) -> Iterator[None]:
        """Group all items that are added within the context."""
        outer, self.items = self.items, []
        try:
            yield
        finally:
            inner, self.items = self.items, outer
        self.items.append(Group(name, tuple(inner), offset, window, kind, layer))


def flat_items(items: Iterable[Item]) -> Iterator[Shape | Label]:
    """Yield all shapes and labels in their order, without groups. Offsets of groups are not applied."""
    for item in items:
        if isinstance(item, Group):
            yield from flat_items(item.items)
        else:
            yield item


def text_width(text: str, size: float) -> float:
    """Return the width of a text in Helvetica, in the unit of `size` (mm on paper).

    Characters outside ASCII count as wide as a digit.
    """
    return _width_in_thousandths(text) * size / 1000.0


@lru_cache(maxsize=1 << 14)  # `frame.draw_paragraph` breaks lines again for every size
def _width_in_thousandths(text: str) -> int:
    """Return the width of a text in thousandths of its size."""
    return sum(map(_CHARACTER_WIDTHS.get, text, repeat(556)))


ADVANCE = 6.0
HEIGHT = 6.0

# Each glyph is strokes, each stroke its corners, each corner its two digits: column 0 to 4, row 0 to 6.
_GLYPHS = {
    "0": "0040460600 0046", "1": "152620 1030", "2": "064643030040", "3": "06464000 0343", "4": "060343 4640",
    "5": "460603434000", "6": "460600404303", "7": "064620", "8": "0040460600 0343", "9": "430306464000",
    "A": "0004264440 0343", "B": "00063645443303 3342413000", "C": "46060040", "D": "00062644422000",
    "E": "46060040 0333", "F": "460600 0333", "G": "460600404323", "H": "0006 4046 0343", "I": "1030 2026 1636",
    "J": "4641301001", "K": "0006 460340", "L": "060040", "M": "0006234640", "N": "00064046", "O": "0040460600",
    "P": "0006464303", "Q": "0040460600 2240", "R": "0006464303 2340", "S": "460603434000", "T": "0646 2620",
    "U": "06004046", "V": "062046", "W": "0610243046", "X": "0046 0640", "Y": "062346 2320", "Z": "06460040",
    "-": "1333", ".": "2021", "_": "0040", "/": "0046", "=": "0242 0444", "+": "0343 2125", ":": "2122 2425",
    ",": "2110", "(": "36252130", ")": "16252110",
}


def text_strokes(text: str, at: Point, height: float) -> Iterator[Path]:
    """Yield the strokes (m) of a text. Small letters are drawn as capitals.

    `at` is the lower left corner of the text, `height` (m) the height of capitals. A space is one advance. Raises
    KeyError for a character without a glyph.
    """
    unit = height / HEIGHT
    for i, character in enumerate(text.upper()):
        if character == " ":
            continue
        left = at.x + i * ADVANCE * unit
        for stroke in _GLYPHS[character].split():
            corners = zip(stroke[::2], stroke[1::2], strict=True)
            yield polyline([Point(left + int(x) * unit, at.y + int(y) * unit) for x, y in corners])


def stroke_length(text: str, height: float) -> float:
    """Return the length (m) of a text drawn by `text_strokes`, without the gap after its last character."""
    return (len(text) * ADVANCE - 2.0) * height / HEIGHT


INCH, POINT = 25.4, 25.4 / 72.0  # Millimetres
DOTS = 72.0  # matplotlib's units in an inch: points
LETTERS = 7.5  # Size of the letters (points)
RISE, DROP = 0.72, 0.21  # Height of capitals and descent of Helvetica, over the font size

COLOURS = ("#1f5fa8", "#c4602b", "#2a7f4f", "#7a4fa3", "#8a6d00", "#5c6670")
"""Colours of curves, in their order. Colour-blind readers can distinguish them, too."""


def draw_figure(sheet: Sheet, box: tuple[float, float, float, float], draw: Callable[[Any], None]) -> None:
    """Draw a figure into a box of a sheet (left, low, width, height; mm).

    `draw` takes the matplotlib figure. Raises `MissingExtra` if matplotlib is not installed.
    """
    matplotlib = import_extra("matplotlib")
    left, low, width, height = box
    with sheet.group():
        for put in _figure_parts(matplotlib, width, height, draw):
            put(sheet, left, low)


Put: TypeAlias = Callable[[Sheet, float, float], None]
"""Function that puts a line, an area or a text of a figure on a sheet, with the figure's corner at x and y (mm)."""


@lru_cache(maxsize=4)  # a data sheet draws every figure twice: in HTML and in PDF
def _figure_parts(matplotlib: Any, width: float, height: float, draw: Callable[[Any], None]) -> tuple[Put, ...]:
    """Return functions that put the parts of a matplotlib figure on a sheet. The figure has a width and height (mm).

    matplotlib's constrained layout makes room for the labels of the axes.
    """
    from matplotlib.backend_bases import FigureCanvasBase
    from matplotlib.figure import Figure

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_plot_settings())
        figure = Figure(figsize=(width / INCH, height / INCH), dpi=DOTS, layout="constrained")
        FigureCanvasBase(figure)
        draw(figure)
        engine = figure.get_layout_engine()
        if figure.axes and engine is not None:
            engine.execute(figure)
        figure.set_layout_engine("none")
        puts: list[Put] = []
        figure.draw(_renderer(puts, (width, height)))
    return tuple(puts)


def _plot_settings() -> dict[str, Any]:
    """Return the settings of matplotlib: thin lines, small letters, and the colours in `COLOURS`."""
    from matplotlib.rcsetup import cycler

    return {
        "font.size": LETTERS, "axes.unicode_minus": False, "axes.linewidth": 0.5, "axes.grid": True,
        "grid.linewidth": 0.25, "grid.color": "#d9dee3", "lines.linewidth": 1.1, "xtick.major.width": 0.5,
        "ytick.major.width": 0.5, "legend.frameon": False, "axes.titlesize": LETTERS + 1.0,
        "axes.prop_cycle": cycler(color=COLOURS), "axes.formatter.useoffset": False, "path.simplify": False,
        "axes.titleweight": "bold", "axes.titley": 1.0,  # fixed: not searched above the ticks
    }


def _renderer(puts: list[Put], size: tuple[float, float]) -> Any:
    """Return a matplotlib renderer that appends to `puts` a function for each path and text."""
    from matplotlib.backend_bases import RendererBase

    class SheetRenderer(RendererBase):
        """Renderer whose paths become shapes of a sheet, and whose texts become labels."""

        def get_canvas_width_height(self) -> tuple[float, float]:
            """Return width and height of the box (points)."""
            return size[0] / POINT, size[1] / POINT

        def points_to_pixels(self, points: Any) -> Any:
            """Return points unchanged, because the renderer's unit is the point."""
            return points

        def flipy(self) -> bool:
            """Return False: the sheet's y goes up."""
            return False

        def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
            """Return width, height and descent of a text in Helvetica (points)."""
            letters = prop.get_size_in_points()
            return text_width(s, letters), (RISE + DROP) * letters, DROP * letters

        def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
            """Add a line or an area."""
            puts.append(_path_drawer(gc, transform.transform_path(path), rgbFace))

        def draw_text(
            self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, ismath: Any = False, mtext: Any = None
        ) -> None:
            """Add a text whose left end is at (x, y)."""
            bold, letters = prop.get_weight() in ("bold", 700), prop.get_size_in_points() * POINT
            right, up, colour = x * POINT, y * POINT, _colour(gc.get_rgb())
            puts.append(lambda sheet, left, low: sheet.text(
                left + right, low + up, s, letters, angle=angle, colour=colour, bold=bold))

    return SheetRenderer()


def _path_drawer(gc: Any, path: Any, face: Any) -> Put:
    """Return a function that draws one of matplotlib's paths (points) on a sheet, clipped to its axes."""
    clip, filled = gc.get_clip_rectangle(), face is not None and (len(face) < 4 or face[3] > 0.0)
    if clip is not None and len(path.vertices):
        path = path.clip_to_bbox(clip, inside=True) if filled else _clipped_path(path, clip)
    lines = [[(float(x) * POINT, float(y) * POINT) for x, y in piece]
            for piece in path.to_polygons(closed_only=False) if len(piece) > 1]
    alpha = gc.get_alpha() if gc.get_alpha() is not None else 1.0
    colour, opacity = (_colour(face), float(face[3] if len(face) == 4 else alpha)) if filled else ("", 0.0)
    width, pen = gc.get_linewidth(), None
    if width > 0.0 and gc.get_rgb()[3] > 0.0 and lines:
        dashes = gc.get_dashes()[1]
        pen = Pen(width * POINT, _colour(gc.get_rgb()), tuple(float(d) * POINT for d in dashes) if dashes else ())

    def put(sheet: Sheet, left: float, low: float) -> None:
        pieces = [[Point(left + x, low + y) for x, y in way] for way in lines]
        areas = [closed_polygon(_open_ring(piece)) for piece in pieces if filled and len(_open_ring(piece)) > 2]
        if areas:
            sheet.draw(areas, None, colour, opacity=opacity)
        if pen is not None:
            sheet.draw([polyline(piece) for piece in pieces], pen)

    return put


def _open_ring(piece: list[Point]) -> list[Point]:
    """Return a ring without the repetition of its first point at the end."""
    return piece[:-1] if len(piece) > 2 and piece[0].distance(piece[-1]) < 1e-9 else piece


def _clipped_path(path: Any, clip: Any) -> Any:
    """Return the part of a line inside the x and y ranges of a box, widened by half a point.

    The line is cut at its vertices: vertices outside are left out.
    """
    from matplotlib.path import Path

    x0, y0, x1, y1 = clip.extents
    vertices = path.interpolated(1).vertices
    inside = (vertices[:, 0] >= x0 - 0.5) & (vertices[:, 0] <= x1 + 0.5)
    inside &= (vertices[:, 1] >= y0 - 0.5) & (vertices[:, 1] <= y1 + 0.5)
    if inside.all():
        return path
    codes, remaining, before = [], [], False
    for vertex, within in zip(vertices, inside, strict=True):
        if within:
            remaining.append(vertex)
            codes.append(Path.LINETO if before else Path.MOVETO)
        before = bool(within)
    return Path(remaining, codes) if remaining else Path([(x0, y0)])


def _colour(rgb: Any) -> str:
    return "#" + "".join(f"{round(255.0 * float(part)):02x}" for part in rgb[:3])
