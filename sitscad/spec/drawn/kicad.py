"""Read the copper of KiCad boards (``.kicad_pcb``) and footprints (``.kicad_mod``) of KiCad 6 to 10."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from sitscad.kernels.geometry.path import Arc, Line, Point, Segment, arc_through
from sitscad.spec.drawn.copper import (
    CopperHeight,
    DrawnCoilError,
    DrawnCopper,
    DrawnPad,
    DrawnTrack,
    DrawnZone,
    place_text,
)

MOST_BYTES = 100_000_000
"""Largest permitted size of a file (bytes)."""

TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|([()])|([^\s()"]+)')
EXPRESSIONS = ("kicad_pcb", "footprint", "module")
COPPER = re.compile(r"(?:F|B|In\d+)\.Cu")
COPPER_WILDCARDS = ("*.Cu", "F&B.Cu")

Node = list[Any]
"""An expression in brackets, as a list: its name, then texts and further expressions."""


def read_kicad(path: str) -> DrawnCopper:
    """Return the copper of a KiCad board or footprint.

    Raises
    ------
    DrawnCoilError
        if the file is no KiCad file, too large, or has copper that cannot be followed
    OSError
        if the file cannot be opened
    """
    with Path(path).open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise DrawnCoilError(f"{path} is larger than {MOST_BYTES // 1_000_000} MB")
    return kicad_copper(content, path)


def kicad_copper(content: bytes, path: str) -> DrawnCopper:
    """Return the copper of a KiCad board or footprint from its bytes. Raises DrawnCoilError as `read_kicad` does."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise DrawnCoilError(f"{path} is not text in UTF-8, as KiCad writes it") from None
    root = parse_kicad(text, path)
    if root[0] == "kicad_pcb":
        return _board(root)
    return _copper([root], {}, (), (), is_footprint=True)


def parse_kicad(text: str, path: str) -> Node:
    """Return the root expression of a KiCad file. Raises DrawnCoilError if it is neither a board nor a footprint."""
    stack: list[Node] = [[]]
    for token in TOKEN.finditer(text):
        quoted, bracket, plain = token.groups()
        if bracket == "(":
            stack.append([])
            if len(stack) > DEEPEST:
                raise DrawnCoilError(f"{path}: brackets are nested too deep for a KiCad file")
        elif bracket == ")":
            if len(stack) == 1:
                raise DrawnCoilError(f"{path}: a bracket closes in line {_line(text, token.start())} that none opened")
            node = stack.pop()
            stack[-1].append(node)
        elif plain is not None:
            stack[-1].append(plain)
        else:
            stack[-1].append(quoted.replace('\\"', '"').replace("\\\\", "\\"))
    if len(stack) > 1:
        raise DrawnCoilError(f"{path} ends inside of a bracket: the file is not whole")
    nodes = [node for node in stack[0] if isinstance(node, list) and node]
    if not nodes or nodes[0][0] not in EXPRESSIONS:
        raise DrawnCoilError(f"{path} is no KiCad board (.kicad_pcb) or footprint (.kicad_mod)")
    return nodes[0]


DEEPEST = 200
"""Largest nesting depth of brackets."""


def _line(text: str, place: int) -> int:
    return text.count("\n", 0, place) + 1


def _children(node: Node, *names: str) -> Iterator[Node]:
    return (each for each in node[1:] if isinstance(each, list) and each and each[0] in names)


def _child(node: Node, name: str) -> Node:
    """Return the first child expression with a name. Empty if there is none."""
    return next(_children(node, name), [])


def _numbers(node: Node) -> list[float]:
    values = []
    for each in node[1:]:
        try:
            values.append(float(each))
        except (TypeError, ValueError):
            break
    if not all(map(math.isfinite, values)):
        raise DrawnCoilError(f"({node[0]} ...) holds a number that is not finite")
    return values


def _length(node: Node, name: str, usual: float = 0.0) -> float:
    """Return the length (m) in the child expression `name`. If there is no such child, return `usual`."""
    numbers = _numbers(_child(node, name) or [name])
    return numbers[0] * 1e-3 if numbers else usual


def _point(node: Node, name: str) -> Point:
    numbers = _numbers(_child(node, name) or [name])
    if len(numbers) < 2:
        raise DrawnCoilError(f"({node[0]} ...) has no place ({name} x y)")
    return Point(numbers[0] * 1e-3, -numbers[1] * 1e-3)


def _layers(node: Node, board_layers: Iterable[str]) -> frozenset[str]:
    """Return the copper layers of an expression. Wildcards stand for all layers or for both outer layers."""
    names = [each for child in _children(node, "layer", "layers") for each in child[1:] if isinstance(each, str)]
    if any(name in COPPER_WILDCARDS for name in names):
        return frozenset(board_layers) if "*.Cu" in names else frozenset({"F.Cu", "B.Cu"})
    return frozenset(name for name in names if COPPER.fullmatch(name))


def _board(root: Node) -> DrawnCopper:
    layers = [row[1] for row in _child(root, "layers")[1:]
              if isinstance(row, list) and len(row) > 1 and COPPER.fullmatch(str(row[1]))]
    layers.sort(key=_order)
    nets = {row[1]: row[2] if len(row) > 2 else "" for row in _children(root, "net") if len(row) > 1}
    return _copper([*_children(root, "footprint", "module"), root], nets, layers, _heights(root, layers))


def _order(layer: str) -> int:
    return 0 if layer == "F.Cu" else 1000 if layer == "B.Cu" else int(layer[2:-3])


def _heights(root: Node, layers: list[str]) -> list[CopperHeight]:
    """Return the copper heights of a board's stack-up, from the middle of the board. Empty if the file has none."""
    rows, depth = [], 0.0
    for row in _children(_child(_child(root, "setup"), "stackup"), "layer"):
        name, kind = str(row[1]) if len(row) > 1 else "", str((_child(row, "type") or ["", ""])[1])
        thickness = math.fsum(_numbers(each)[0] * 1e-3 for each in _children(row, "thickness") if _numbers(each))
        if kind in ("copper", "core", "prepreg") or COPPER.fullmatch(name):
            if COPPER.fullmatch(name):
                rows.append((name, depth + thickness / 2, thickness))
            depth += thickness
    if {name for name, _, _ in rows} != set(layers):
        return []
    return [CopperHeight(name, depth / 2 - down, thickness) for name, down, thickness in rows]


def _copper(parts: Iterable[Node], nets: dict[str, str], layers: Iterable[str], heights: Iterable[CopperHeight],
            is_footprint: bool = False) -> DrawnCopper:
    """Return the copper of `parts`: footprints, and the board itself.

    `nets` has the names of nets by number. `layers` are the copper layers from the top; if it is empty, the parts
    themselves name them.
    """
    board_layers = tuple(layers) or _named_layers(parts := list(parts))
    tracks: list[DrawnTrack] = []
    pads: list[DrawnPad] = []
    zones: list[DrawnZone] = []
    for part in parts:
        at = _numbers(_child(part, "at") or ["at"]) if part[0] != "kicad_pcb" and not is_footprint else []
        home, turn = (Point(at[0] * 1e-3, -at[1] * 1e-3), math.radians(at[2]) if len(at) > 2 else 0.0) if len(
            at) > 1 else (Point(0.0, 0.0), 0.0)
        move = partial(_moved, home=home, turn=turn)
        lines = _children(part, "segment", "arc", *GRAPHICS)
        tracks += [track for node in lines for track in _tracks(node, nets, move)]
        pads += [_via(node, nets, board_layers) for node in _children(part, "via")]
        name = _reference(part)
        for node in _children(part, "pad"):
            pads += _pad(node, nets, board_layers, name, home, turn)
            tracks += _primitives(node, nets, board_layers, home, turn)
        for node in _children(part, "zone"):
            zones += _zone(node, nets, board_layers, move)
    return DrawnCopper(tracks, pads, zones, board_layers, tuple(heights), is_footprint)


GRAPHICS = ("fp_line", "fp_arc", "gr_line", "gr_arc")


def _named_layers(parts: list[Node]) -> tuple[str, ...]:
    names = {name for part in parts for node in part[1:] if isinstance(node, list)
             for child in _children(node, "layer", "layers") for name in child[1:]
             if isinstance(name, str) and COPPER.fullmatch(name)}
    return tuple(sorted(names | {"F.Cu", "B.Cu"}, key=_order))


def _moved(point: Point, home: Point, turn: float) -> Point:
    cos, sin = math.cos(turn), math.sin(turn)
    return Point(home.x + cos * point.x - sin * point.y, home.y + sin * point.x + cos * point.y)


def _net(node: Node, nets: dict[str, str]) -> str:
    """Return the name of an expression's net. `nets` has the names by the numbers that KiCad 6 to 9 write.

    KiCad 10 writes the name itself. Empty if the expression has no net.
    """
    child = _child(node, "net")
    if len(child) < 2:
        return ""
    return str(child[2] if len(child) > 2 else nets.get(child[1], child[1]))


def _tracks(node: Node, nets: dict[str, str], move: Any) -> Iterator[DrawnTrack]:
    layers = _layers(node, ())
    if not layers:
        return
    width = _length(node, "width") or _length(_child(node, "stroke") or ["stroke"], "width")
    line = _centre_line(node, move)
    if line is None:
        return
    if width <= 0.0:
        raise DrawnCoilError(f"a track at {place_text(line.start)} has no width")
    yield from (DrawnTrack(line, width, layer, _net(node, nets)) for layer in sorted(layers))


def _centre_line(node: Node, move: Any) -> Segment | None:
    """Return the centre line of a segment or an arc. None if it has no length.

    An arc of KiCad 6 and later has three points. An arc of KiCad 5 has its centre under ``start``, its first point
    under ``end``, and an angle (degrees, clockwise positive).
    """
    start, end = _point(node, "start"), _point(node, "end")
    if not node[0].endswith("arc"):
        segment: Segment = Line(move(start), move(end))
    elif _child(node, "mid"):
        segment = arc_through(move(start), move(_point(node, "mid")), move(end), 1e-18)
    else:
        angles = _numbers(_child(node, "angle"))
        if not angles:
            raise DrawnCoilError(f"an arc at {place_text(move(start))} has neither a point in its middle nor an angle")
        middle, last = (_moved(end - start, start, -math.radians(part * angles[0])) for part in (0.5, 1.0))
        segment = arc_through(move(end), move(middle), move(last), 1e-18)
    return segment if isinstance(segment, Arc) or segment.length > 1e-9 else None


def _via(node: Node, nets: dict[str, str], board_layers: tuple[str, ...]) -> DrawnPad:
    named, size = [name for name in board_layers if name in _layers(node, board_layers)], _length(node, "size")
    layers = board_layers[board_layers.index(named[0]) : board_layers.index(named[-1]) + 1] if named else board_layers
    return DrawnPad(_point(node, "at"), (size, size), frozenset(layers), _net(node, nets), radius=size / 2,
                    is_plated=True, drill=_length(node, "drill"))


def _reference(part: Node) -> str:
    for row in _children(part, "property", "fp_text"):
        if len(row) > 2 and str(row[1]).lower() == "reference":
            return str(row[2])
    return ""


def _pad(node: Node, nets: dict[str, str], board_layers: tuple[str, ...], reference: str, home: Point,
         turn: float) -> Iterator[DrawnPad]:
    """Yield the pad of an expression. Empty if the pad has no copper."""
    layers, at = _layers(node, board_layers), _numbers(_child(node, "at") or ["at"])
    size = [value * 1e-3 for value in _numbers(_child(node, "size") or ["size"])]
    if not layers or len(at) < 2 or len(size) < 2 or node[2] == "np_thru_hole":
        return
    form, number = node[3], str(node[1])
    ratio = (_numbers(_child(node, "roundrect_rratio") or [""]) or [0.25])[0] if form == "roundrect" else 0.0
    radius = min(size) * (0.5 if form in ("circle", "oval") else ratio)
    centre = _moved(Point(at[0] * 1e-3, -at[1] * 1e-3), home, turn)
    name = f"{reference}.{number}" if reference and not reference.startswith("REF*") else number
    yield DrawnPad(centre, (size[0], size[1]), layers, _net(node, nets), name, radius,
                   math.radians(at[2]) if len(at) > 2 else 0.0, node[2] == "thru_hole", _length(node, "drill"))


def _primitives(node: Node, nets: dict[str, str], board_layers: tuple[str, ...], home: Point,
                turn: float) -> Iterator[DrawnTrack]:
    """Yield the lines and arcs of a custom pad."""
    at = _numbers(_child(node, "at") or ["at"])
    if len(at) < 2:
        return
    centre = _moved(Point(at[0] * 1e-3, -at[1] * 1e-3), home, turn)
    move = partial(_moved, home=centre, turn=math.radians(at[2]) if len(at) > 2 else 0.0)
    forms = [(_layers(node, board_layers), _child(node, "primitives"))]
    forms += [(frozenset({str(row[1])}), _child(row, "primitives"))
              for row in _children(_child(node, "padstack"), "layer")]
    for layers, form in forms:
        for each in _children(form or ["primitives"], "gr_line", "gr_arc"):
            line, width = _centre_line(each, move), _length(each, "width")
            if line is not None and width > 0.0:
                yield from (DrawnTrack(line, width, layer, _net(node, nets)) for layer in sorted(layers)
                            if COPPER.fullmatch(layer))


def _zone(node: Node, nets: dict[str, str], board_layers: tuple[str, ...], move: Any) -> Iterator[DrawnZone]:
    """Yield a zone that is filled with copper. Empty for rule areas."""
    layers, points = _layers(node, board_layers), _child(_child(node, "polygon"), "pts")
    if _child(node, "keepout") or not layers or not points:
        return
    name = _child(node, "net_name")
    corner = next(_children(points, "xy"), ["xy", "0", "0"])
    x, y = [*_numbers(corner), 0.0, 0.0][:2]
    yield DrawnZone(name[1] if len(name) > 1 else _net(node, nets), layers, move(Point(x * 1e-3, -y * 1e-3)))
