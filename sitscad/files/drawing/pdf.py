"""Sheets as an uncompressed PDF 1.4 file (ISO 32000) with vector drawings and Helvetica.

Helvetica is among the fourteen fonts that every reader has, so that no font is embedded. The file contains no dates and
no identifiers: equal sheets give equal bytes on every machine.
"""

from __future__ import annotations

import contextlib
import math
import unicodedata
from collections.abc import Iterable, Iterator, Sequence

from sitscad.basics.units import fixed_decimals
from sitscad.files.drawing.sheet import Group, Item, Label, Shape, Sheet, flat_items, text_width
from sitscad.kernels.geometry.path import Arc, Path, Point, polar

POINTS = 72.0 / 25.4  # PDF's units in a millimetre
BOLD = 0.035  # Width of the line that makes letters bold, as a share of their size


def pdf(sheets: Sequence[Sheet]) -> bytes:
    """Return a PDF document with one page per sheet."""
    first = 4
    pages = " ".join(f"{first + 2 * i} 0 R" for i in range(len(sheets)))
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        f"<< /Type /Pages /Kids [{pages}] /Count {len(sheets)} >>".encode("ascii"),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
    ]
    for i, sheet in enumerate(sheets):
        width, height = (fixed_decimals(side * POINTS) for side in sheet.size)
        # Graphics states of the page for opacities below 1, as resources
        opacities = sorted({item.opacity for item in flat_items(sheet.items) if isinstance(item, Shape)} - {1.0})
        rows = " ".join(f"/{_opacity_name(opacity)} << /ca {fixed_decimals(opacity)} >>" for opacity in opacities)
        box, states = f"/MediaBox [0 0 {width} {height}]", (f" /ExtGState << {rows} >>" if rows else "")
        resources = f"/Resources << /Font << /F1 3 0 R >>{states} >>"
        # The page's drawing, scaled to millimetres
        commands = [f"{POINTS:.6f} 0 0 {POINTS:.6f} 0 0 cm 1 J 1 j".encode("ascii")]
        commands += _item_commands(sheet.items)
        content = b"\n".join(commands) + b"\n"
        objects += [
            f"<< /Type /Page /Parent 2 0 R {box} {resources} /Contents {(first + 2 * i + 1)} 0 R >>".encode("ascii"),
            (b"<< /Length %d >>\nstream\n%b\nendstream" % (len(content), content)),
        ]
    # Objects numbered from 1, the table of their offsets in bytes, and the trailer
    entries = [*objects, b"<< /Title (%b) /Producer (sitscad) >>" % _escaped_text(sheets[0].title)]
    content, places = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n", []
    for i, entry in enumerate(entries, 1):
        places.append(len(content))
        content += b"%d 0 obj\n%b\nendobj\n" % (i, entry)
    start, count = len(content), len(entries) + 1
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    trailer = b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\nstartxref\n%d\n" % (count, len(entries), start)
    return content + b"xref\n0 %d\n0000000000 65535 f \n" % count + table + trailer + b"%%EOF\n"


def _item_commands(items: Iterable[Item]) -> Iterator[bytes]:
    for item in items:
        if isinstance(item, Group):
            group = item
            is_placed = group.window is not None or group.offset != (0.0, 0.0)
            if is_placed:
                yield b"q"
            if group.window is not None:
                x0, y0, x1, y1 = group.window
                yield f"{' '.join(fixed_decimals(v) for v in (x0, y0, x1 - x0, y1 - y0))} re W n".encode("ascii")
            if group.offset != (0.0, 0.0):
                yield f"1 0 0 1 {' '.join(fixed_decimals(v) for v in group.offset)} cm".encode("ascii")
            yield from _item_commands(group.items)
            if is_placed:
                yield b"Q"
        else:
            yield from _label_commands(item) if isinstance(item, Label) else _shape_commands(item)


def _label_commands(label: Label) -> Iterator[bytes]:
    """Yield the PDF commands that write a text. Its halo is written first."""
    width = text_width(label.text, label.size)
    back = {"start": 0.0, "middle": width / 2.0, "end": width}[label.anchor]
    cosine, sine = math.cos(math.radians(label.angle)), math.sin(math.radians(label.angle))
    x, y = label.at.x - back * cosine, label.at.y - back * sine
    turn = " ".join(fixed_decimals(v) for v in (cosine, sine, -sine, cosine, x, y))
    place = f"/F1 {fixed_decimals(label.size)} Tf {turn} Tm ".encode("ascii")
    operators = place + b"(" + _escaped_text(label.text) + b") Tj ET"
    if label.halo:
        yield f"BT 1 Tr 1 1 1 RG {fixed_decimals(label.halo)} w [] 0 d ".encode("ascii") + operators + b" 0 Tr"
    if label.bold:  # No bold font is available: the outline of the letters makes them heavier
        pen = f"{_colour_numbers(label.colour)} RG {fixed_decimals(BOLD * label.size)} w [] 0 d"
        yield f"BT 2 Tr {pen} {_colour_numbers(label.colour)} rg ".encode("ascii") + operators + b" 0 Tr"
    else:
        yield f"BT {_colour_numbers(label.colour)} rg ".encode("ascii") + operators


def _escaped_text(text: str) -> bytes:
    """Return text in the font's encoding. Other characters lose their accents, or become a code point (``U+03A9``)."""
    encoded = b"".join(_encoded_character(letter) for letter in text)
    return encoded.replace(b"\\", b"\\\\").replace(b"(", b"\\(").replace(b")", b"\\)")


def _encoded_character(letter: str) -> bytes:
    for text in (letter, unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()):
        with contextlib.suppress(UnicodeEncodeError):
            if text:
                return text.encode("cp1252")
    return f"U+{ord(letter):04X}".encode("ascii")


def _shape_commands(shape: Shape) -> Iterator[bytes]:
    if shape.opacity != 1.0:
        yield f"q /{_opacity_name(shape.opacity)} gs".encode("ascii")
    if shape.fill:
        yield f"{_colour_numbers(shape.fill)} rg".encode("ascii")
    if shape.pen:
        pen, dashes = shape.pen, " ".join(fixed_decimals(dash) for dash in shape.pen.dashes)
        # The page's content begins with round ends and corners
        ends = "" if pen.round_ends and pen.round_corners else f" {int(pen.round_ends)} J {int(pen.round_corners)} j"
        yield f"{_colour_numbers(pen.colour)} RG {fixed_decimals(pen.width)} w [{dashes}] 0 d{ends}".encode("ascii")
    for path in shape.paths:
        yield from (command.encode("ascii") for command in _path_commands(path))
    yield {(True, True): b"B*", (True, False): b"f*", (False, True): b"S", (False, False): b"n"}[
        bool(shape.fill), bool(shape.pen)
    ]
    if shape.pen and not (shape.pen.round_ends and shape.pen.round_corners):
        yield b"1 J 1 j"
    if shape.opacity != 1.0:
        yield b"Q"


def _opacity_name(opacity: float) -> str:
    return f"A{round(opacity * 100)}"


def _path_commands(path: Path) -> Iterator[str]:
    yield f"{_xy(path.start)} m"
    for segment in path:
        if isinstance(segment, Arc) and abs(segment.sweep) > 1e-9:
            # Cubic curves of a quarter turn at most: within 0.03 % of the radius
            count = math.ceil(abs(segment.sweep) / (math.pi / 2) - 1e-9)
            step = segment.sweep / count
            reach = segment.radius * 4.0 / 3.0 * math.tan(step / 4.0)
            for i in range(count):
                start, other = segment.start_angle + i * step, segment.start_angle + (i + 1) * step
                a, b = (polar(segment.radius, angle, segment.centre) for angle in (start, other))
                control = Point(a.x - reach * math.sin(start), a.y + reach * math.cos(start))
                control2 = Point(b.x + reach * math.sin(other), b.y - reach * math.cos(other))
                yield f"{_xy(control)} {_xy(control2)} {_xy(b)} c"
        else:
            yield f"{_xy(segment.end)} l"
    if path.is_closed:
        yield "h"


def _xy(point: Point) -> str:
    return f"{fixed_decimals(point.x)} {fixed_decimals(point.y)}"


def _colour_numbers(text: str) -> str:
    return " ".join(fixed_decimals(int(text[i : i + 2], 16) / 255.0) for i in (1, 3, 5))
