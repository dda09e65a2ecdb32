"""Outline of the board's body as a closed path about the mean of the coils' centres, from its size or from a DXF file.

A DXF file must contain a single closed convex outline of lines and arcs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO
from typing import Any

from sitscad.basics.units import show
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Segment, bounding_box, circle, enclosed_area, polar
from sitscad.spec.circuit import BodySpec
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks

MOST_BYTES, MOST_PIECES = 4 * 2**20, 2_000
"""Maximum size of a DXF file (bytes) and maximum number of lines and arcs.

An outline usually has some kilobytes, and every output file draws all of its pieces.
"""

UNITS = {0: 1e-3, 1: 25.4e-3, 4: 1e-3, 5: 1e-2, 6: 1.0, 13: 1e-6}
"""Metres per unit, by $INSUNITS of the DXF reference: none (taken as millimetres), inches, mm, cm, m, um."""

JOINED = 1e-6
"""Largest distance (m) between two ends that count as the same point."""

SPLINE = 4
"""Flag bit of a polyline whose vertices belong to a spline (DXF reference, group 70)."""

LEAST, LARGEST = 1e-3, 0.5
"""Smallest and largest length and width (m) of a body."""

OUTLINE_REQUIREMENT = (
    "one closed outline of LINE, ARC, CIRCLE, LWPOLYLINE and POLYLINE entities, convex, and nothing else in the "
    "model space"
)


class UnfitError(Exception):
    """A DXF file cannot be used as the outline of a body. The message states the reason for users."""


def body_from_file(part: BodySpec, name: str, place: Origin, remarks: Remarks) -> BodySpec | None:
    """Return the body with the outline in its DXF file. None if the file is invalid.

    The reason is then recorded in `remarks`. `name` is the dotted key of the body's section, and `place` the spec,
    which names the file. The file's bytes are added to `remarks.files`.
    """
    key = f"{name}.file"
    if part.file is None:
        remarks.flaw("SIT003", key, "a body of shape dxf has no file", "write a file beside the spec, like body.dxf")
        return None
    file = place.content(part.file, key, remarks, "DXF", "body.dxf", MOST_BYTES, "export the body's outline alone")
    if file is None:
        return None
    content, names = file
    try:
        edge = outline(content)
    except UnfitError as error:
        remarks.flaw("SIT011", key, f"{part.file}: {error}", OUTLINE_REQUIREMENT)
        return None
    remarks.files |= dict.fromkeys(names, content)
    return replace(part, file=min(names), edge=edge)


def outline(content: bytes) -> Path:
    """Return the closed outline (m) in a DXF file, counter-clockwise. Raises `UnfitError`."""
    import ezdxf  # loaded only for specs with a DXF file
    from ezdxf.lldxf.validator import dxf_info

    try:
        # UTF-8 from R2007 (AC1021) on, the code page in the file's header before R2007
        info = dxf_info(StringIO(content.decode("latin-1")))
        encoding = "utf-8" if info.version >= "AC1021" else info.encoding
        drawing = ezdxf.read(StringIO(content.decode(encoding)))
        # ezdxf takes the unit of a file without $INSUNITS as metres
        scale = UNITS.get(int(drawing.header["$INSUNITS"]) if b"$INSUNITS" in content else 0)
        if scale is None:
            raise UnfitError(f"its unit ($INSUNITS {drawing.header['$INSUNITS']}) is none of mm, cm, m, um and inches")
        pieces = [(label, piece) for entity in drawing.modelspace() for label, piece in _pieces(entity, scale)
                  if not piece.length <= JOINED]
        ends = [value for _, piece in pieces for value in piece.box]
        heights = [(scale * float(z), str(entity)) for entity in drawing.modelspace() for z in _heights(entity)]
    except (ezdxf.DXFError, OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError,
            StopIteration) as error:
        raise UnfitError(f"no DXF that can be read ({type(error).__name__}: {str(error)[:80]})") from None
    if not 1 <= len(pieces) <= MOST_PIECES:
        raise UnfitError(f"{len(pieces)} lines and arcs, where 1 to {MOST_PIECES} can be")
    if not all(math.isfinite(value) and abs(value) < 10.0 for value in ends):
        raise UnfitError("it has coordinates that are no lengths")
    (low, lower), (high, upper) = min(heights), max(heights)
    if high - low > JOINED:
        raise UnfitError(f"{lower} lies at z = {show(low, 'm')} and {upper} at {show(high, 'm')}: flatten the drawing")
    _refuse_repeated(pieces)
    return _convex(_chained(pieces))


Piece = tuple[str, Segment]
"""A line or arc (m), with a description of the DXF entity that contains it."""


def _pieces(entity: Any, scale: float) -> Iterator[Piece]:
    """Yield the lines and arcs of an entity.

    Raises `UnfitError` for all other entities, so that nothing is ignored silently.
    """
    kind, dxf = entity.dxftype(), entity.dxf
    label = f"{kind} {dxf.handle} on layer {dxf.layer}"
    if kind not in ("LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE"):
        raise UnfitError(f"{label} is no line and no arc")
    if abs(dxf.get("extrusion", (0.0, 0.0, 1.0))[2] - 1.0) > 1e-9:
        raise UnfitError(f"{label} does not lie in the plane seen from above (its extrusion is not +z)")
    if kind == "POLYLINE" and not entity.is_2d_polyline:
        raise UnfitError(f"{label} is a mesh or a polyline in space")
    if kind == "POLYLINE" and dxf.flags & SPLINE:
        raise UnfitError(f"{label} is a spline: no lines and arcs join its vertices")

    def point(x: float, y: float) -> Point:
        return Point(scale * float(x), scale * float(y))

    if kind == "LINE":
        yield label, Line(point(dxf.start[0], dxf.start[1]), point(dxf.end[0], dxf.end[1]))
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        corners = [(point(x, y), float(bulge)) for x, y, bulge in _corners(entity)]
        if len(corners) > MOST_PIECES:
            raise UnfitError(f"{label} has {len(corners)} vertices, where {MOST_PIECES} can be")
        is_closed = entity.closed if kind == "LWPOLYLINE" else entity.is_closed
        onward = corners[1:] + (corners[:1] if is_closed else [])
        for (start, bulge), (end, _) in zip(corners, onward, strict=False):
            if start.distance(end) > JOINED:
                yield label, _bulged(start, end, bulge) if bulge else Line(start, end)
    else:
        centre, radius = point(dxf.center[0], dxf.center[1]), scale * dxf.radius
        if kind == "CIRCLE" or abs(math.remainder(dxf.end_angle - dxf.start_angle, 360.0)) < 1e-9:
            yield from ((label, half) for half in circle(centre, radius))
        else:
            first, last = (polar(radius, math.radians(angle), centre) for angle in (dxf.start_angle, dxf.end_angle))
            yield label, Arc(first, last, centre)


def _heights(entity: Any) -> list[float]:
    """Return the z of the points of an entity, in the drawing's unit: one value if all have the same z."""
    dxf = entity.dxf
    if entity.dxftype() == "LINE":
        return [dxf.start[2], dxf.end[2]]
    if entity.dxftype() == "POLYLINE":
        return [dxf.get("elevation", (0.0, 0.0, 0.0))[2]]
    return [dxf.get("elevation", 0.0) if entity.dxftype() == "LWPOLYLINE" else dxf.center[2]]


def _corners(entity: Any) -> list[tuple[float, float, float]]:
    """Return (x, y, bulge) of each vertex of a polyline, in the drawing's unit.

    The bulge describes the arc to the next vertex: the tangent of a quarter of its angle, 0 for a straight line.
    """
    if entity.dxftype() == "LWPOLYLINE":
        return list(entity.get_points("xyb"))
    vertices = ((vertex, vertex.dxf.location) for vertex in entity.vertices)
    return [(at.x, at.y, vertex.dxf.get("bulge", 0.0)) for vertex, at in vertices]


def _refuse_repeated(pieces: list[Piece]) -> None:
    """Raise `UnfitError` if two pieces coincide."""
    labels: dict[tuple[tuple[int, ...], ...], str] = {}
    for label, piece in pieces:
        middle = piece.at(0.5) if isinstance(piece, Arc) else _middle(piece.start, piece.end)
        start, end, half = (tuple(round(value / (2.0 * JOINED)) for value in (at.x, at.y))
                            for at in (piece.start, piece.end, middle))
        where = (*sorted((start, end)), half)
        if where in labels:
            raise UnfitError(f"{label} is drawn twice: {labels[where]} lies there, too")
        labels[where] = label


def _middle(start: Point, end: Point) -> Point:
    return Point((start.x + end.x) / 2, (start.y + end.y) / 2)


def _bulged(start: Point, end: Point, bulge: float) -> Arc:
    """Return the arc from one vertex of a polyline to the next.

    `bulge` is the tangent of a quarter of the arc's angle, positive for a counter-clockwise arc.
    """
    # distance from the chord's middle to the centre, positive to the left, over the chord's length
    offset = (1.0 - bulge * bulge) / (4.0 * bulge)
    dx, dy = end.x - start.x, end.y - start.y
    centre = Point((start.x + end.x) / 2 - offset * dy, (start.y + end.y) / 2 + offset * dx)
    return Arc(start, end, centre, ccw=bulge > 0.0)


def _place(point: Point) -> str:
    return f"[{point.x * 1e3:.4g}, {point.y * 1e3:.4g}] mm"


def _chained(pieces: list[Piece]) -> list[Piece]:
    """Return the pieces in the order of the outline, each beginning at the end of the preceding piece.

    Pieces are reversed if needed. Raises `UnfitError` if the outline is open, or if pieces are left over.
    """
    remaining, chain = pieces[1:], pieces[:1]
    while remaining:
        here = chain[-1][1].end
        gap, index, turned = min(
            (here.distance(end), index, turned)
            for index, (_, piece) in enumerate(remaining)
            for turned, end in ((False, piece.start), (True, piece.end))
        )
        if gap > JOINED:
            break
        label, piece = remaining.pop(index)
        piece = piece.reversed() if turned else piece
        # ends that differ only by rounding become equal
        chain.append((label, replace(piece, start=here)))
    end, begin = chain[-1][1].end, chain[0][1].start
    if end.distance(begin) > JOINED:
        raise UnfitError(f"the outline is open: {chain[-1][0]} ends at {_place(end)}, where nothing goes on")
    if remaining:
        raise UnfitError(f"{remaining[0][0]} does not belong to the outline, which is closed without it")
    chain[-1] = chain[-1][0], replace(chain[-1][1], end=begin)
    return chain


def _convex(pieces: list[Piece]) -> Path:
    """Return the pieces, which form a closed chain, as a counter-clockwise outline.

    Raises `UnfitError` if the outline is not convex, crosses itself or has a wrong size.
    """
    path = Path(tuple(piece for _, piece in pieces))
    if enclosed_area(path) < 0.0:
        pieces, path = [(label, piece.reversed()) for label, piece in reversed(pieces)], path.reversed()
    # A closed outline is convex if all corners and arcs turn to the same side and the total turn is 360 degrees. An
    # outline that crosses itself turns by more.
    around = 0.0
    for (label, piece), (_, before) in zip(pieces, [pieces[-1], *pieces[:-1]], strict=True):
        turn = math.remainder(_heading(piece, 0.0) - _heading(before, 1.0), 2.0 * math.pi)
        bent = piece.sweep if isinstance(piece, Arc) else 0.0
        if turn < -1e-4 or bent < 0.0:
            raise UnfitError(f"{label} is bent inwards at {_place(piece.start)}")
        around += turn + bent
    x0, y0, x1, y1 = bounding_box([path])
    if abs(around - 2.0 * math.pi) > 1e-2:
        raise UnfitError("the outline crosses itself")
    if min(x1 - x0, y1 - y0) < LEAST or max(x1 - x0, y1 - y0) > LARGEST:
        raise UnfitError(f"the outline is {show(x1 - x0, 'm')} x {show(y1 - y0, 'm')}, where 1 to 500 mm can be")
    return path


def _heading(piece: Segment, fraction: float) -> float:
    """Return the direction (rad) of a piece at its start (`fraction` 0) or end (`fraction` 1)."""
    if isinstance(piece, Arc):
        quarter = math.pi / 2 if piece.ccw else -math.pi / 2
        return piece.start_angle + fraction * piece.sweep + quarter
    return math.atan2(piece.end.y - piece.start.y, piece.end.x - piece.start.x)


USUAL_CORNER = 1e-3
"""Default corner radius (m) of a rounded body."""


def resolve_body(part: BodySpec | None, name: str, place: Origin, remarks: Remarks) -> BodySpec | None:
    """Return the body with its outline. None if the spec has no body, or if no outline follows from its keys.

    `name` is the dotted key of the body's section. Keys that do not match the body's shape are recorded as errors in
    `remarks`. `place` is the spec, which names the DXF file.
    """
    if part is None:
        return None
    is_drawn, is_rounded = part.shape == "dxf", part.shape == "rounded"
    for key, belongs in (("size", not is_drawn), ("corner_radius", is_rounded), ("file", is_drawn)):
        if getattr(part, key) is not None and not belongs:
            remarks.flaw("SIT009", f"{name}.{key}", f"a body of shape {part.shape} has no {key}", "leave it out")
    if is_drawn:
        return body_from_file(part, name, place, remarks)
    size = part.size
    if size is None:
        hint = "write the diameter, like 12" if part.shape == "circle" else "write [x, y], like [12, 8]"
        remarks.flaw("SIT003", f"{name}.size", f"a body of shape {part.shape} has no size", hint)
        return None
    if part.shape == "circle" and size[0] != size[1]:
        remarks.flaw("SIT009", f"{name}.size", "a circle has one size, not [x, y]", "write its diameter")
    if is_rounded and part.corner_radius is None:
        part = replace(part, corner_radius=USUAL_CORNER)
        remarks.default(f"{name}.corner_radius", "1 mm")
    radius, most = part.corner_radius or 0.0, min(size) / 2
    if radius > most:
        message = f"corners of {show(radius, 'm')} take more than the body's sides"
        remarks.flaw("SIT009", f"{name}.corner_radius", message, f"at most {show(most, 'm')}")
    return part.sized(size)
