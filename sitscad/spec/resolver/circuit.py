"""Conversion of the spec's section ``fpc`` (flexible circuit): stack-up, design rules, tail, panel and body."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO
from typing import Any

from sitscad.basics.units import count_text, show
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Segment, bounding_box, circle, enclosed_area, polar
from sitscad.spec import presets
from sitscad.spec.circuit import (
    MOST_PARTS,
    BendDocument,
    BodySpec,
    FpcSpec,
    LayerDocument,
    LayerKind,
    PanelSpec,
    Plating,
    StackLayer,
    Stackup,
    Tail,
)
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.section import WRITTEN_SOURCE
from sitscad.spec.mount import Mount
from sitscad.spec.profiles import Origin, resolve_rules
from sitscad.spec.reading import Remarks

_DEFAULT_STACKUP = {1: "flex-2l-30um", 2: "flex-2l-30um", 3: "flex-4l", 4: "flex-4l", 5: "flex-6l", 6: "flex-6l"}
_LARGEST_STACKUP = "flex-8l"
USUAL_PLATING = 12e-6
"""Plating (m) of the presets. Fabricators add 8 to 15 um to the foil (wellerpcba.com)."""
_TURN_RADIUS = 2e-3
ROUNDING = 1e-9


def resolve_fpc(
    document: FpcSpec, coil: CoilSpec, mount: Mount | None, remarks: Remarks, place: Origin
) -> FpcSpec:
    """Return the flexible circuit with stack-up, design rules, tail, panel and body filled in.

    `document` is the section as written. `place` is the spec: file names are relative to its folder. Errors are
    recorded in `remarks`; an example is a stack-up that lacks a copper layer of the coil.
    """
    as_written = document.values()
    stackup = _stackup(as_written["stackup"], coil, remarks)
    copper = len(stackup.copper)
    stackup = _plated_stackup(stackup, document, remarks)
    if max(coil.layers) > copper:
        message = f"the coil uses copper layer {max(coil.layers)}, stack-up {stackup.name} has {copper}"
        facts = {"measured": float(max(coil.layers)), "limit": float(copper)}
        name = next(iter(presets.stackups_with_copper_layers(max(coil.layers), presets.is_rigid(stackup))), "")
        more = f", like fpc.stackup: {name}" if name else ""
        hint = f"use fewer layers, or a stack-up with more copper{more}"
        remarks.flaw("SIT009", "coil.layers", message, hint, **facts)
    rules = resolve_rules(as_written["rules"], stackup.line_foil(coil.layers), place, remarks)
    written, panel = document.tail, _panel(as_written["panel"], remarks)
    if written is not None and presets.is_rigid(stackup) and "fpc.tail.bend" not in place.source.keys:
        remarks.default("fpc.tail.bend", "none", "a rigid board does not bend")
        written = replace(written, bend="none")
    tail = _tail(written, copper, rules, mount, remarks)
    rules = rules.for_layers(copper)
    body, largest = (
        resolve_body(getattr(document, name), f"fpc.{name}", place, remarks) for name in ("body", "largest")
    )
    if document.body is not None and any(document.margin):
        message = "a body of a given outline is as large as that says"
        remarks.flaw("SIT009", "fpc.margin", message, "leave fpc.margin out, or fpc.body")
    foil = document.copper
    if presets.is_rigid(stackup) and "fpc.copper" not in place.source.keys:
        foil = "electrodeposited"
        remarks.default("fpc.copper", foil, "the usual foil of rigid boards")
    return replace(
        document, copper=foil, stackup=stackup, rules=rules, tail=tail, panel=panel, body=body, largest=largest
    )


def _panel(written: str | PanelSpec, remarks: Remarks) -> PanelSpec:
    if isinstance(written, str):
        return PanelSpec(wish=written)
    boards = math.prod(written.parts or ())
    if boards > MOST_PARTS:
        remarks.flaw(
            "SIT006", "fpc.panel.parts", f"{boards} boards on one panel are out of range: at most {MOST_PARTS}, "
            "because every file has each copy in full", "order several panels", measured=float(boards),
            limit=float(MOST_PARTS),
        )
    return written


def _stackup(written: Stackup | list[LayerDocument] | None, coil: CoilSpec, remarks: Remarks) -> Stackup:
    if isinstance(written, list):
        # a stack-up written layer by layer; impossible layers are flaws
        stack = [_stack_layer(layer, f"fpc.stackup.{index}", remarks) for index, layer in enumerate(written)]
        kinds = [layer.kind for layer in stack]
        if not 1 <= kinds.count(LayerKind.COPPER) <= 8 or len(stack) > 40:
            message = (
                f"{kinds.count(LayerKind.COPPER)} copper layers in {len(stack)} are out of range: 1 to 8 in at most 40"
            )
            remarks.flaw("SIT006", "fpc.stackup", message, "write the layers from top to bottom")
        for index, kind in enumerate(kinds):
            if kind is LayerKind.COVERLAY and 0 < index < len(kinds) - 1:
                message = "coverlay lies inside the stack-up"
                remarks.flaw("SIT009", f"fpc.stackup.{index}", message, "inside, write dielectric")
            if kind is LayerKind.COPPER and index and kinds[index - 1] is LayerKind.COPPER:
                message = "two copper layers touch"
                remarks.flaw("SIT009", f"fpc.stackup.{index}", message, "put a dielectric between them")
        return Stackup("written out", tuple(stack), WRITTEN_SOURCE)
    if written is not None:
        return written
    name = _DEFAULT_STACKUP.get(max(coil.layers), _LARGEST_STACKUP)
    remarks.default("fpc.stackup", name, f"the default for {count_text(len(coil.layers), 'coil layer')}")
    return presets.stackup(name)


def _plated_stackup(stackup: Stackup, document: FpcSpec, remarks: Remarks) -> Stackup:
    """Return the stack-up after plating. A board with a single copper layer is not plated.

    If the tail has fewer copper layers than the body, the tail's layers are a core that is plated in a separate step.
    If the spec writes out the stack-up, the thickness of its copper includes the plating. If its outer copper is too
    thin to contain the plating, the default is to plate only the holes. If a copper layer is thinner than its plating,
    record an error in `remarks` and return the stack-up unchanged.
    """
    written = isinstance(document.values()["stackup"], list)
    count = len(stackup.copper)
    if count < 2:
        for key in ("plating", "plated"):
            if getattr(document, key) is not None:
                remarks.flaw("SIT009", f"fpc.{key}", "one copper layer has no plated holes", "leave it out")
        return stackup
    tail_layers = document.tail.layers if document.tail is not None else None
    core = tail_layers if tail_layers is not None and 1 < tail_layers < count else 0
    wall = document.plating or stackup.plating_thickness or USUAL_PLATING
    is_thin = written and min(stackup.copper[0].thickness, stackup.copper[-1].thickness) <= USUAL_PLATING
    usual = Plating.BUTTONS if is_thin and document.plating is None else stackup.plating
    method = Plating(document.plated or usual)
    built = stackup.built(method, core, wall, finished=written or not stackup.is_plating_stated)
    built = built if written else presets.with_stock_coverlays(built)
    if written and document.plating is None:
        part = "in the holes alone" if method is Plating.BUTTONS else "part of the outer copper"
        remarks.default("fpc.plating", show(wall, "m"), part)
    thin = next((layer for layer in built.copper if layer.foil <= ROUNDING), None)
    if thin is None:
        return built
    key = "fpc.plating" if document.plating is not None else "fpc.stackup"
    message = (
        f"copper {thin.number}, {show(thin.thickness, 'm')} finished, contains the plating of {show(thin.plated, 'm')}"
    )
    hint = "write foil and plating together as the copper, or fpc.plated: buttons"
    remarks.flaw("SIT009", key, message, hint, measured=thin.plated, limit=thin.thickness, unit="m")
    return stackup


def _stack_layer(layer: LayerDocument, key: str, remarks: Remarks) -> StackLayer:
    thicknesses = [(kind, getattr(layer, kind)) for kind in ("coverlay", "copper", "dielectric")]
    thicknesses = [(kind, thickness) for kind, thickness in thicknesses if thickness is not None]
    if len(thicknesses) != 1:
        message = "a layer is exactly one of coverlay, copper and dielectric"
        remarks.flaw("SIT009" if thicknesses else "SIT003", key, message, "like {copper: 18 um}")
        return StackLayer(LayerKind.DIELECTRIC, 1e-6, "polyimide", 1.0)
    kind, thickness = LayerKind(thicknesses[0][0]), thicknesses[0][1]
    if layer.adhesive is not None and (kind is not LayerKind.COVERLAY or layer.adhesive >= thickness):
        message = "adhesive is a part of a coverlay's thickness"
        remarks.flaw("SIT009", f"{key}.adhesive", message, "like {coverlay: 37.5 um, adhesive: 25 um}")
        return StackLayer(kind, thickness, "copper" if kind is LayerKind.COPPER else "polyimide", 1.0)
    if kind is LayerKind.COPPER:
        if layer.material is not None or layer.permittivity is not None:
            remarks.flaw("SIT009", key, "copper takes no material and no permittivity", "like {copper: 18 um}")
        return StackLayer(kind, thickness, "copper")
    material = layer.material or ("polyimide-coverlay" if kind is LayerKind.COVERLAY else "polyimide")
    if layer.material is None:
        remarks.default(f"{key}.material", material)
    permittivity = presets.permittivity(material) if layer.permittivity is None else layer.permittivity
    glue = layer.adhesive or 0.0
    made_of = presets.film_text(thickness - glue, glue) if glue else ""
    return StackLayer(kind, thickness, material, permittivity, made_of, adhesive=glue)


def _tail(tail: Tail | None, copper: int, rules: DesignRules, mount: Mount | None, remarks: Remarks) -> Tail | None:
    """Return the tail with all defaults filled in. None if the spec has no tail.

    `copper` is the number of copper layers in the body.
    """
    if tail is None:
        return None
    layers = tail.values()["layers"]
    if layers is None:
        layers = copper
        remarks.default("fpc.tail.layers", str(layers))
    if layers > copper:
        message = f"the tail has {layers} copper layers, the stack-up has {copper}"
        remarks.flaw("SIT009", "fpc.tail.layers", message, "", measured=float(layers), limit=float(copper))
    bend: str | BendDocument = tail.values()["bend"]
    # radius (m) of the inner edge of the tail's turn, at least the fabricator's minimum
    radius, is_turned = tail.values()["turn_radius"], tail.turn != "none" or tail.offset != 0.0
    if tail.turn != "none" and tail.offset:
        message = f"the tail turns {tail.turn} and is led aside too"
        remarks.flaw("SIT009", "fpc.tail.offset", message, "keep one of turn and offset")
    if radius is None:
        radius = max(_TURN_RADIUS, rules.inside_radius)
        if is_turned:
            remarks.default("fpc.tail.turn_radius", show(radius, "m"))
    elif is_turned and radius < rules.inside_radius * (1 - 1e-9):
        message = (
            f"an inner edge of {show(radius, 'm')} radius tears; {rules.holder('inside_radius')} asks "
            f"{show(rules.inside_radius, 'm')}"
        )
        facts = {"measured": radius, "limit": rules.inside_radius, "unit": "m"}
        remarks.flaw("SIT009", "fpc.tail.turn_radius", message, "make it larger", **facts)
    return _with_bend(replace(tail, layers=layers, turn_radius=radius), bend, mount, remarks)


def _with_bend(tail: Tail, written: str | BendDocument, mount: Mount | None, remarks: Remarks) -> Tail:
    """Return the tail with the bend that the spec states. An omitted angle is filled in.

    `written` is the word or section at the key ``bend``. If the jaw has a hinge, the tail bends at the hinge into the
    shaft, and the default angle is half of the angle between the open jaws. On a finger or a jaw without a hinge, the
    default angle is 0, because the mount itself guides the tail downwards.
    """
    if written == "none":
        return replace(tail, bend="none")
    angle, why = tail.bend_angle, "the default of a bend whose angle is not said"
    jaw = mount.jaw if mount is not None else None
    if mount is not None and mount.finger is not None:
        angle, why = 0.0, "the cap lets the tail down to the finger, and it is bent no farther"
    if jaw is not None:
        angle, why = 0.0, "the mount lets the tail down to the jaw; where it goes on is not known (mount.jaw.hinge)"
        if jaw.hinge is not None and jaw.opening:
            angle, why = jaw.opening / 2, "into the shaft when the jaws are wide open: half of their opening"
    if isinstance(written, BendDocument):
        tail = replace(
            tail, bend=written.kind, bend_at=written.at, bend_direction=written.direction, bend_radius=written.radius
        )
        if written.angle is not None:
            return replace(tail, bend_angle=written.angle)
    else:
        tail = replace(tail, bend=written)
    remarks.default("fpc.tail.bend.angle", f"{math.degrees(angle):.4g} deg {tail.bend_direction}", why)
    return replace(tail, bend_angle=angle)


MOST_BYTES, MOST_PIECES = 4 * 2**20, 2_000
"""Maximum size of a DXF file (bytes), and maximum number of its lines and arcs.

An outline usually has some kilobytes. Many output files contain all its lines and arcs.
"""

UNITS = {0: 1e-3, 1: 25.4e-3, 4: 1e-3, 5: 1e-2, 6: 1.0, 13: 1e-6}
"""Metres per unit, by $INSUNITS of the DXF reference: none (taken as millimetres), inches, mm, cm, m, um."""

JOINED = 1e-6
"""Largest distance (m) between two ends that count as the same point."""

SPLINE = 4
"""Flag bit of a polyline whose vertices belong to a spline (DXF reference, group 70)."""

LEAST, LARGEST = 1e-3, 0.5
"""Smallest and largest side (m) of a body's bounding box."""

OUTLINE_REQUIREMENT = (
    "one closed outline of LINE, ARC, CIRCLE, LWPOLYLINE and POLYLINE entities, convex, and nothing else in the "
    "model space"
)


class OutlineFileError(Exception):
    """A DXF file cannot be used as the outline of a body. The message states the reason."""


def body_from_file(part: BodySpec, name: str, place: Origin, remarks: Remarks) -> BodySpec | None:
    """Return the body with the outline in its DXF file. None if the file is invalid.

    The reason is then recorded in `remarks`. `name` is the dotted key of the body's section, and `place` the spec,
    which names the file. The file's bytes are added to `remarks.files`.
    """
    key = f"{name}.file"
    if part.file is None:
        remarks.flaw("SIT003", key, "a body of shape dxf has no file", "write a file beside the spec, like body.dxf")
        return None
    smaller = "export the body's outline alone"
    file = place.read_named_file(part.file, key, remarks, "DXF", "body.dxf", MOST_BYTES, smaller)
    if file is None:
        return None
    content, names = file
    try:
        edge = outline_from_dxf(content)
    except OutlineFileError as error:
        remarks.flaw("SIT011", key, f"{part.file}: {error}", OUTLINE_REQUIREMENT)
        return None
    remarks.files |= dict.fromkeys(names, content)
    return replace(part, file=min(names), edge=edge)


def outline_from_dxf(content: bytes) -> Path:
    """Return the closed outline (m) in a DXF file, counter-clockwise. Raises `OutlineFileError`."""
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
            unit = f"$INSUNITS {drawing.header['$INSUNITS']}"
            raise OutlineFileError(f"its unit ({unit}) is none of mm, cm, m, um and inches")
        pieces = [(label, piece) for entity in drawing.modelspace() for label, piece in _pieces(entity, scale)
                  if not piece.length <= JOINED]
        ends = [value for _, piece in pieces for value in piece.box]
        heights = [(scale * float(z), str(entity)) for entity in drawing.modelspace() for z in _heights(entity)]
    except (ezdxf.DXFError, OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError,
            StopIteration) as error:
        raise OutlineFileError(f"no DXF that can be read ({type(error).__name__}: {str(error)[:80]})") from None
    if not 1 <= len(pieces) <= MOST_PIECES:
        raise OutlineFileError(f"{len(pieces)} lines and arcs, where 1 to {MOST_PIECES} can be")
    if not all(math.isfinite(value) and abs(value) < 10.0 for value in ends):
        raise OutlineFileError("it has coordinates that are no lengths")
    (low, lower), (high, upper) = min(heights), max(heights)
    if high - low > JOINED:
        places = f"{lower} lies at z = {show(low, 'm')} and {upper} at {show(high, 'm')}"
        raise OutlineFileError(f"{places}: flatten the drawing")
    _refuse_repeated(pieces)
    return _convex_outline(_chain_pieces(pieces))


Piece = tuple[str, Segment]
"""A line or arc (m), with a description of the DXF entity that contains it."""


def _pieces(entity: Any, scale: float) -> Iterator[Piece]:
    """Yield the lines and arcs of an entity.

    Raises `OutlineFileError` for all other entities, so that nothing is ignored silently.
    """
    kind, dxf = entity.dxftype(), entity.dxf
    label = f"{kind} {dxf.handle} on layer {dxf.layer}"
    if kind not in ("LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE"):
        raise OutlineFileError(f"{label} is no line and no arc")
    if abs(dxf.get("extrusion", (0.0, 0.0, 1.0))[2] - 1.0) > 1e-9:
        raise OutlineFileError(f"{label} does not lie in the plane seen from above (its extrusion is not +z)")
    if kind == "POLYLINE" and not entity.is_2d_polyline:
        raise OutlineFileError(f"{label} is a mesh or a polyline in space")
    if kind == "POLYLINE" and dxf.flags & SPLINE:
        raise OutlineFileError(f"{label} is a spline: no lines and arcs join its vertices")

    def point(x: float, y: float) -> Point:
        return Point(scale * float(x), scale * float(y))

    if kind == "LINE":
        yield label, Line(point(dxf.start[0], dxf.start[1]), point(dxf.end[0], dxf.end[1]))
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        corners = [(point(x, y), float(bulge)) for x, y, bulge in _corners(entity)]
        if len(corners) > MOST_PIECES:
            raise OutlineFileError(f"{label} has {len(corners)} vertices, where {MOST_PIECES} can be")
        is_closed = entity.closed if kind == "LWPOLYLINE" else entity.is_closed
        onward = corners[1:] + (corners[:1] if is_closed else [])
        for (start, bulge), (end, _) in zip(corners, onward, strict=False):
            if start.distance(end) > JOINED:
                yield label, _arc_with_bulge(start, end, bulge) if bulge else Line(start, end)
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
    """Raise `OutlineFileError` if two pieces coincide."""
    labels: dict[tuple[tuple[int, ...], ...], str] = {}
    for label, piece in pieces:
        middle = piece.at(0.5) if isinstance(piece, Arc) else _middle(piece.start, piece.end)
        start, end, half = (tuple(round(value / (2.0 * JOINED)) for value in (at.x, at.y))
                            for at in (piece.start, piece.end, middle))
        where = (*sorted((start, end)), half)
        if where in labels:
            raise OutlineFileError(f"{label} is drawn twice: {labels[where]} lies there, too")
        labels[where] = label


def _middle(start: Point, end: Point) -> Point:
    return Point((start.x + end.x) / 2, (start.y + end.y) / 2)


def _arc_with_bulge(start: Point, end: Point, bulge: float) -> Arc:
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


def _chain_pieces(pieces: list[Piece]) -> list[Piece]:
    """Return the pieces in the order of the outline, each beginning at the end of the preceding piece.

    Pieces are reversed if needed. Raises `OutlineFileError` if the outline is open, or if pieces are left over.
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
        raise OutlineFileError(f"the outline is open: {chain[-1][0]} ends at {_place(end)}, where nothing goes on")
    if remaining:
        raise OutlineFileError(f"{remaining[0][0]} does not belong to the outline, which is closed without it")
    chain[-1] = chain[-1][0], replace(chain[-1][1], end=begin)
    return chain


def _convex_outline(pieces: list[Piece]) -> Path:
    """Return the outline that a closed chain of pieces forms, counter-clockwise.

    Raises `OutlineFileError` if the outline is not convex, crosses itself or is too small or too large.
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
            raise OutlineFileError(f"{label} is bent inwards at {_place(piece.start)}")
        around += turn + bent
    x0, y0, x1, y1 = bounding_box([path])
    if abs(around - 2.0 * math.pi) > 1e-2:
        raise OutlineFileError("the outline crosses itself")
    if min(x1 - x0, y1 - y0) < LEAST or max(x1 - x0, y1 - y0) > LARGEST:
        raise OutlineFileError(f"the outline is {show(x1 - x0, 'm')} x {show(y1 - y0, 'm')}, where 1 to 500 mm can be")
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
