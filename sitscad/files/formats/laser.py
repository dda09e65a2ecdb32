"""Files for laser cutters, one per sheet, as DXF and as SVG.

DXF is ASCII in the format of AutoCAD 2000 (AC1015), in millimetres, with named layers. Laser drivers read R12 and
AC1015. Only AC1015 states the unit of length: without it, a drawing of 4 mm may be read as 4 inches. Circles are
CIRCLE. All other contours are closed LWPOLYLINE with arcs as bulges (tangent of a quarter of the sweep), so that
nothing is flattened. SVG is in millimetres, with hairlines and one group per layer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from sitscad.assembly.places.stack import sheets
from sitscad.basics.units import fixed_decimals
from sitscad.files.drawing.frame import FORCED
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.geometry.path import Arc, Path, Point, circle
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import LOOKS, TEXT_HEIGHT, Contour, CutLayer, LaserSheet

_MILLIMETRES = 4

Tag = tuple[int, str | int | float]

# Handles of the structures in every file of this format. Layers and entities have higher numbers.
_BLOCK_RECORDS, _LAYERS, _STYLES, _LINETYPES, _VIEWS, _UCS, _VIEWPORTS, _APPIDS, _DIMSTYLES = range(0x1, 0xA)
_ROOT, _GROUPS = 0xA, 0xB
_MODEL, _MODEL_BLOCK, _MODEL_END, _PAPER, _PAPER_BLOCK, _PAPER_END = range(0x10, 0x16)
_BY_BLOCK, _BY_LAYER, _CONTINUOUS, _STANDARD_STYLE, _ACTIVE, _ACAD, _STANDARD_DIMSTYLE = range(0x20, 0x27)
_FIRST_LAYER, _FIRST_ENTITY = 0x30, 0x100


def render_dxf(layout: Layout, forced: str = "") -> dict[str, bytes]:
    """Return ``laser/NAME-elastomer.dxf``, and such a file of target and of shield.

    A file is left out if the spec has no such part. If ``forced`` is not empty, each sheet bears the note `FORCED`.
    Raises ValueError for a kerf that cannot be compensated.
    """
    name, cut_sheets = layout.spec.name, sheets(layout, FORCED if forced else "")
    return {f"laser/{name}-{sheet.name}.dxf": dxf_drawing(sheet).encode("ascii") for sheet in cut_sheets}


def dxf_drawing(sheet: LaserSheet) -> str:
    """Return the DXF text of one sheet."""
    entities = list(_entities(sheet))
    tags: list[Tag] = [
        *_section("HEADER", _header(sheet, _FIRST_ENTITY + len(entities))), *_section("CLASSES", ()),
        *_section("TABLES", _tables(sheet)), *_section("BLOCKS", _blocks()),
        *_section("ENTITIES", (tag for entity in entities for tag in entity)), *_section("OBJECTS", _OBJECTS),
        (0, "EOF"),
    ]
    return "".join(f"{code:3d}\r\n{_value(value)}\r\n" for code, value in tags)


def _value(value: str | int | float) -> str:
    """Return a tag's value as text, with DXF escapes for characters outside ASCII."""
    if isinstance(value, float):
        return fixed_decimals(value, 9, 1)
    if isinstance(value, int):
        return str(value)
    return "".join(c if c.isascii() else f"\\U+{ord(c):04X}" for c in value.replace("\n", " "))


def _section(name: str, content: Iterable[Tag]) -> Iterator[Tag]:
    yield from ((0, "SECTION"), (2, name))
    yield from content
    yield (0, "ENDSEC")


def _header(sheet: LaserSheet, next_handle: int) -> Iterator[Tag]:
    yield from ((9, "$ACADVER"), (1, "AC1015"), (9, "$DWGCODEPAGE"), (3, "ANSI_1252"))
    yield from ((9, "$INSUNITS"), (70, _MILLIMETRES), (9, "$MEASUREMENT"), (70, 1), (9, "$LUNITS"), (70, 2))
    for name, x, y in (("$EXTMIN", 0.0, 0.0), ("$EXTMAX", sheet.width, sheet.height)):
        yield from ((9, name), (10, x * 1e3), (20, y * 1e3), (30, 0.0))
    for name, x, y in (("$LIMMIN", 0.0, 0.0), ("$LIMMAX", sheet.width, sheet.height)):
        yield from ((9, name), (10, x * 1e3), (20, y * 1e3))
    yield from ((9, "$HANDSEED"), (5, f"{next_handle:X}"))


def _table(name: str, handle: int, rows: list[list[Tag]]) -> Iterator[Tag]:
    yield from ((0, "TABLE"), (2, name), (5, f"{handle:X}"), (330, "0"), (100, "AcDbSymbolTable"), (70, len(rows)))
    if name == "DIMSTYLE":
        yield (100, "AcDbDimStyleTable")
    for row in rows:
        yield from row
    yield (0, "ENDTAB")


def _record(table: str, handle: int, owner: int, subclass: str, *content: Tag) -> list[Tag]:
    code = 105 if table == "DIMSTYLE" else 5
    head: list[Tag] = [(0, table), (code, f"{handle:X}"), (330, f"{owner:X}"), (100, "AcDbSymbolTableRecord")]
    return [*head, (100, f"AcDb{subclass}TableRecord"), *content]


def _tables(sheet: LaserSheet) -> Iterator[Tag]:
    # Initial view of a program that opens the file
    width, height = sheet.width * 1e3, sheet.height * 1e3
    shape: tuple[Tag, ...] = (
        (2, "*Active"), (70, 0), (10, 0.0), (20, 0.0), (11, 1.0), (21, 1.0), (12, width / 2), (22, height / 2),
        (13, 0.0), (23, 0.0), (14, 10.0), (24, 10.0), (15, 10.0), (25, 10.0), (16, 0.0), (26, 0.0), (36, 1.0),
        (17, 0.0), (27, 0.0), (37, 0.0), (40, max(height, width) * 1.1), (41, 1.0), (42, 50.0), (43, 0.0), (44, 0.0),
        (50, 0.0), (51, 0.0), (71, 0), (72, 1000), (73, 1), (74, 3), (75, 0), (76, 0), (77, 0), (78, 0),
    )
    yield from _table("VPORT", _VIEWPORTS, [_record("VPORT", _ACTIVE, _VIEWPORTS, "Viewport", *shape)])
    linetypes = (("ByBlock", _BY_BLOCK, ""), ("ByLayer", _BY_LAYER, ""), ("Continuous", _CONTINUOUS, "Solid line"))
    rows = [
        _record("LTYPE", handle, _LINETYPES, "Linetype", (2, name), (70, 0), (3, text), (72, 65), (73, 0), (40, 0.0))
        for name, handle, text in linetypes
    ]
    yield from _table("LTYPE", _LINETYPES, rows)
    layers = [("0", 7), *((str(layer), LOOKS[layer].index) for layer in CutLayer)]
    rows = [  # line weight 0 is the hairline that drivers cut as a vector
        _record("LAYER", _FIRST_LAYER + i, _LAYERS, "Layer", (2, name), (70, 0), (62, colour), (6, "Continuous"),
                (370, 0))
        for i, (name, colour) in enumerate(layers)
    ]
    yield from _table("LAYER", _LAYERS, rows)
    font: tuple[Tag, ...] = ((40, 0.0), (41, 1.0), (50, 0.0), (71, 0), (42, TEXT_HEIGHT * 1e3), (3, "txt"), (4, ""))
    style = _record("STYLE", _STANDARD_STYLE, _STYLES, "TextStyle", (2, "Standard"), (70, 0), *font)
    yield from _table("STYLE", _STYLES, [style])
    yield from _table("VIEW", _VIEWS, [])
    yield from _table("UCS", _UCS, [])
    yield from _table("APPID", _APPIDS, [_record("APPID", _ACAD, _APPIDS, "RegApp", (2, "ACAD"), (70, 0))])
    dimstyle = _record("DIMSTYLE", _STANDARD_DIMSTYLE, _DIMSTYLES, "DimStyle", (2, "Standard"), (70, 0))
    yield from _table("DIMSTYLE", _DIMSTYLES, [dimstyle])
    spaces = (("*Model_Space", _MODEL), ("*Paper_Space", _PAPER))
    rows = [_record("BLOCK_RECORD", handle, _BLOCK_RECORDS, "Block", (2, name)) for name, handle in spaces]
    yield from _table("BLOCK_RECORD", _BLOCK_RECORDS, rows)


def _blocks() -> Iterator[Tag]:
    for name, owner, block, end in (
        ("*Model_Space", _MODEL, _MODEL_BLOCK, _MODEL_END), ("*Paper_Space", _PAPER, _PAPER_BLOCK, _PAPER_END),
    ):
        yield from ((0, "BLOCK"), (5, f"{block:X}"), (330, f"{owner:X}"), (100, "AcDbEntity"), (8, "0"))
        yield from ((100, "AcDbBlockBegin"), (2, name), (70, 0), (10, 0.0), (20, 0.0), (30, 0.0), (3, name), (1, ""))
        yield from ((0, "ENDBLK"), (5, f"{end:X}"), (330, f"{owner:X}"), (100, "AcDbEntity"), (8, "0"))
        yield (100, "AcDbBlockEnd")


_OBJECTS: tuple[Tag, ...] = (
    (0, "DICTIONARY"), (5, f"{_ROOT:X}"), (330, "0"), (100, "AcDbDictionary"), (281, 1),
    (3, "ACAD_GROUP"), (350, f"{_GROUPS:X}"),
    (0, "DICTIONARY"), (5, f"{_GROUPS:X}"), (330, f"{_ROOT:X}"), (100, "AcDbDictionary"), (281, 1),
)
"""Root dictionary and its groups. AutoCAD refuses a file of this format without them."""


def _entities(sheet: LaserSheet) -> Iterator[list[Tag]]:
    handle = _FIRST_ENTITY
    for layer in CutLayer:
        for contour in sheet.on(layer):
            yield _contour(contour, handle)
            handle += 1
    for place, text in sheet.notes:
        head = _entity("TEXT", handle, CutLayer.REF, "AcDbText")
        yield [*head, *_at(place), (30, 0.0), (40, TEXT_HEIGHT * 1e3), (1, text), (100, "AcDbText")]
        handle += 1


def _entity(kind: str, handle: int, layer: CutLayer, subclass: str) -> list[Tag]:
    head: list[Tag] = [(0, kind), (5, f"{handle:X}"), (330, f"{_MODEL:X}"), (100, "AcDbEntity"), (8, str(layer))]
    return [*head, (100, subclass)]


def _contour(contour: Contour, handle: int) -> list[Tag]:
    if contour.diameter is not None:
        head = _entity("CIRCLE", handle, contour.layer, "AcDbCircle")
        return [*head, *_at(contour.centre), (30, 0.0), (40, contour.diameter * 5e2)]
    head = _entity("LWPOLYLINE", handle, contour.layer, "AcDbPolyline")
    vertices = list(bulged_vertices(contour.path))
    closed = contour.path.is_closed
    content = [tag for point, bulge in vertices for tag in (*_at(point), *([(42, bulge)] if bulge else []))]
    return [*head, (90, len(vertices)), (70, int(closed)), (43, 0.0), *content]


def bulged_vertices(path: Path) -> Iterator[tuple[Point, float]]:
    """Yield the corners of a path, each with the bulge of the segment that begins there."""
    for segment in path:
        yield segment.start, math.tan(segment.sweep / 4) if isinstance(segment, Arc) else 0.0
    if not path.is_closed:
        yield path.end, 0.0


def _at(point: Point) -> tuple[Tag, Tag]:
    return (10, point.x * 1e3), (20, point.y * 1e3)


MM = 1e3
HAIRLINE = 0.01
"""Line width (mm), below 0.001 inch. Laser drivers cut such lines as vectors and do not raster them as areas."""


def render_svg(layout: Layout, forced: str = "") -> dict[str, bytes]:
    """Return ``laser/NAME-elastomer.svg``, and such a file of target and of shield.

    A file is left out if the spec has no such part. If ``forced`` is not empty, each sheet bears the note `FORCED`.
    Raises ValueError for a kerf that cannot be compensated.
    """
    name, cut_sheets = layout.spec.name, sheets(layout, FORCED if forced else "")
    return {f"laser/{name}-{sheet.name}.svg": svg_drawing(sheet, name).encode("utf-8") for sheet in cut_sheets}


def svg_drawing(cut: LaserSheet, name: str) -> str:
    """Return the SVG text of one sheet, with y downwards and coordinates rounded to nanometres."""
    size = cut.width * MM, cut.height * MM
    sheet = Sheet(f"{name} {cut.part}", size, decimals=6, ground=None, font="sans-serif")
    for layer in CutLayer:
        pen = Pen(HAIRLINE, LOOKS[layer].rgb)
        with sheet.group(layer, layer=True):
            for contour in cut.on(layer):
                circular = contour.diameter is not None  # a circle is written as a circle
                path = circle(contour.centre, (contour.diameter or 0.0) / 2) if circular else contour.path
                sheet.draw(path.mapped(lambda point: Point(point.x * MM, point.y * MM)), pen)
            if layer is CutLayer.REF:
                for place, text in cut.notes:
                    sheet.text(place.x * MM, place.y * MM, text, TEXT_HEIGHT * MM, colour=LOOKS[layer].rgb)
    return svg(sheet)
