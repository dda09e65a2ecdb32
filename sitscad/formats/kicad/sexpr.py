"""KiCad's S-expressions: nodes, numbers in millimetres on the nanometre grid, y pointing down, and stable UUIDs."""

from __future__ import annotations

import uuid
from collections.abc import Iterable

from sitscad.geometry.path import Line, Path, Point, Segment
from sitscad.units import decimal

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "kicad.sitscad")

# Below this rise over its chord (in nm) an arc cannot be told from a straight line once its three points stand on
# KiCad's grid, and the centre that KiCad computes from them would be noise.
_FLAT_ARC = 1.5

Grid = tuple[int, int]


def grid(point: Point) -> Grid:
    """A point in metres as KiCad stores it: whole nanometres, y pointing down."""
    return round(point.x * 1e9), -round(point.y * 1e9)


def millimetres(nanometres: int) -> str:
    """Whole nanometres as KiCad writes them: millimetres without trailing zeros."""
    return decimal(nanometres / 1e6, 6)


def length(metres: float) -> str:
    """A length in metres, written in millimetres on the nanometre grid."""
    return millimetres(round(metres * 1e9))


def xy(name: str, point: Grid, anchor: Grid = (0, 0)) -> str:
    """``(name x y)``, relative to an anchor."""
    return f"({name} {millimetres(point[0] - anchor[0])} {millimetres(point[1] - anchor[1])})"


def quoted(text: str) -> str:
    """Text in double quotes, with KiCad's escapes."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def identity(*names: object) -> str:
    """``(uuid "...")`` from stable names: the same piece has the same identity in every build."""
    return f'(uuid "{uuid_of(*names)}")'


def uuid_of(*names: object) -> str:
    """The version 5 UUID of some names."""
    return str(uuid.uuid5(_NAMESPACE, "/".join(str(name) for name in names)))


def node(head: str, *children: str) -> str:
    """A node with one child a line, indented by tabs as KiCad does."""
    inner = "\n".join(children)
    body = "".join(f"\n\t{line}" for line in inner.split("\n") if line)
    return f"({head}{body}\n)"


def is_straight(segment: Segment) -> bool:
    """Whether a segment is a line, or an arc that is none on KiCad's grid."""
    if isinstance(segment, Line):
        return True
    middle = segment.at(0.5)
    return Line(segment.start, segment.end).distance(middle) * 1e9 < _FLAT_ARC


def curve(segment: Segment, anchor: Grid = (0, 0)) -> tuple[str, str]:
    """The kind of a segment (``line`` or ``arc``) and its points; three points need no handedness."""
    ends = xy("start", grid(segment.start), anchor), xy("end", grid(segment.end), anchor)
    if is_straight(segment):
        return "line", " ".join(ends)
    return "arc", f"{ends[0]} {xy('mid', grid(segment.at(0.5)), anchor)} {ends[1]}"


def drawn(path: Path) -> tuple[Segment, ...]:
    """The segments of a path that have a length on KiCad's grid."""
    return tuple(s for s in path if grid(s.start) != grid(s.end) or not is_straight(s))


def stroked(
    prefix: str, path: Path, layer: str, width: float, names: tuple[object, ...], anchor: Grid = (0, 0)
) -> Iterable[str]:
    """The lines and arcs of a path as graphics (``gr_line``, ``fp_arc`` ...) of one stroke width (m)."""
    for i, segment in enumerate(drawn(path)):
        kind, points = curve(segment, anchor)
        pen = f"(stroke (width {length(width)}) (type solid))"
        yield f"({prefix}_{kind} {points} {pen} (layer {quoted(layer)}) {identity(*names, i)})"


def polygon_points(path: Path, anchor: Grid = (0, 0)) -> str:
    """``(pts ...)`` of a closed path, arcs kept."""
    parts: list[str] = []
    for segment in drawn(path):
        kind, points = curve(segment, anchor)
        parts.append(f"(arc {points})" if kind == "arc" else xy("xy", grid(segment.start), anchor))
    return f"(pts {' '.join(parts)})"
