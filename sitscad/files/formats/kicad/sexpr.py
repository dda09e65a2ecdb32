"""KiCad's S-expressions, layer names and stack-up.

Numbers are millimetres on the nanometre grid, with y downwards. UUIDs are stable.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Sequence

from sitscad.basics.units import fixed_decimals
from sitscad.kernels.geometry.path import Line, Path, Point, Segment
from sitscad.spec.circuit import LayerKind, StackLayer, Stackup

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "kicad.sitscad")

# Arcs with a rise over their chord below this (nm) are lines: with the three points on KiCad's grid, the centre that
# KiCad computes would be noise.
_FLAT_ARC = 1.5

Grid = tuple[int, int]


def grid(point: Point) -> Grid:
    """Return a point (m) in KiCad's units: whole nanometres, y downwards."""
    return round(point.x * 1e9), -round(point.y * 1e9)


def millimetres(nanometres: int) -> str:
    """Return whole nanometres as text in millimetres without trailing zeros."""
    return fixed_decimals(nanometres / 1e6, 6)


def length(metres: float) -> str:
    """Return a length (m) as text in millimetres, rounded to nanometres."""
    return millimetres(round(metres * 1e9))


def xy(name: str, point: Grid, anchor: Grid = (0, 0)) -> str:
    """Return ``(name x y)``, relative to an anchor."""
    return f"({name} {millimetres(point[0] - anchor[0])} {millimetres(point[1] - anchor[1])})"


def quoted(text: str) -> str:
    """Return text in double quotes, with KiCad's escapes."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def identity(*names: object) -> str:
    """Return ``(uuid "...")`` from stable names. Equal names give an equal UUID in every build."""
    return f'(uuid "{uuid_of(*names)}")'


def uuid_of(*names: object) -> str:
    """Return the version 5 UUID of some names."""
    return str(uuid.uuid5(_NAMESPACE, "/".join(str(name) for name in names)))


def node(head: str, *children: str) -> str:
    """Return a node with one child per line, indented by tabs as in KiCad."""
    inner = "\n".join(children)
    body = "".join(f"\n\t{line}" for line in inner.split("\n") if line)
    return f"({head}{body}\n)"


def is_straight(segment: Segment) -> bool:
    """Return whether a segment is a line, or an arc that is straight on KiCad's grid."""
    if isinstance(segment, Line):
        return True
    middle = segment.at(0.5)
    return Line(segment.start, segment.end).distance(middle) * 1e9 < _FLAT_ARC


def curve(segment: Segment, anchor: Grid = (0, 0)) -> tuple[str, str]:
    """Return the kind of a segment (``line`` or ``arc``) and its points. An arc has three points."""
    ends = xy("start", grid(segment.start), anchor), xy("end", grid(segment.end), anchor)
    if is_straight(segment):
        return "line", " ".join(ends)
    return "arc", f"{ends[0]} {xy('mid', grid(segment.at(0.5)), anchor)} {ends[1]}"


def drawn(path: Path) -> tuple[Segment, ...]:
    """Return the segments of a path that have a length on KiCad's grid."""
    return tuple(s for s in path if grid(s.start) != grid(s.end) or not is_straight(s))


def stroked(path: Path, layer: str, width: float, names: tuple[object, ...], anchor: Grid) -> Iterable[str]:
    """Yield the lines and arcs of a path as a board's graphics (``gr_line``, ``gr_arc``) of one stroke width (m)."""
    for i, segment in enumerate(drawn(path)):
        kind, points = curve(segment, anchor)
        pen = f"(stroke (width {length(width)}) (type solid))"
        yield f"(gr_{kind} {points} {pen} (layer {quoted(layer)}) {identity(*names, i)})"


def polygon_points(path: Path, anchor: Grid = (0, 0)) -> str:
    """Return ``(pts ...)`` of a closed path, with arcs as arcs."""
    parts: list[str] = []
    for segment in drawn(path):
        kind, points = curve(segment, anchor)
        parts.append(f"(arc {points})" if kind == "arc" else xy("xy", grid(segment.start), anchor))
    return f"(pts {' '.join(parts)})"


STIFFENER_LAYER = "User.1"
BEND_LAYER = "User.2"
BODY_LAYER = "User.3"
TAIL_LAYER = "User.4"  # Coverlay of a tail with fewer copper layers

FINISHES = {
    "enig": "ENIG", "hard-gold": "Hard gold", "immersion-tin": "Immersion tin", "immersion-silver": "Immersion silver",
    "osp": "OSP",
}
"""KiCad's names for the finishes of a spec."""

BOND = "bondply"  # Material of films that bond copper to copper; with this film, KiCad's layer is a prepreg

# The colour of polyimide (red, green, blue, opacity), for KiCad's 3-D view.
_AMBER = "#9A5A0A80"

# KiCad's own numbers and long names of the layers that are not copper.
_TECHNICAL = (
    (9, "F.Adhes", "F.Adhesive"), (11, "B.Adhes", "B.Adhesive"), (13, "F.Paste", ""), (15, "B.Paste", ""),
    (5, "F.SilkS", "F.Silkscreen"), (7, "B.SilkS", "B.Silkscreen"), (1, "F.Mask", ""), (3, "B.Mask", ""),
    (17, "Dwgs.User", "User.Drawings"), (19, "Cmts.User", "User.Comments"), (21, "Eco1.User", "User.Eco1"),
    (23, "Eco2.User", "User.Eco2"), (25, "Edge.Cuts", ""), (27, "Margin", ""), (31, "F.CrtYd", "F.Courtyard"),
    (29, "B.CrtYd", "B.Courtyard"), (35, "F.Fab", ""), (33, "B.Fab", ""), (39, STIFFENER_LAYER, "Stiffener"),
    (41, BEND_LAYER, "Bend"), (43, BODY_LAYER, "Body.Layers"), (45, TAIL_LAYER, "Tail.Coverlay"),
)


def copper_names(count: int) -> tuple[str, ...]:
    """Return KiCad's names of `count` copper layers, from the top."""
    if count == 1:
        return ("F.Cu",)
    return ("F.Cu", *(f"In{i}.Cu" for i in range(1, count - 1)), "B.Cu")


def layer_table(count: int) -> str:
    """Return the ``layers`` section, copper from the top.

    KiCad numbers copper layers in this order and drops inner layers after B.Cu.
    """
    # A copper layer that KiCad requires and the board lacks; it is empty and named so
    unused = "B.Cu" if count == 1 else f"In{count - 1}.Cu" if count % 2 else None
    names = copper_names(count + 1 if unused else count)
    numbers = {"F.Cu": 0, "B.Cu": 2} | {name: 2 + 2 * i for i, name in enumerate(names) if name not in ("F.Cu", "B.Cu")}
    rows = [
        f"({numbers[name]} {quoted(name)} signal{' ' + quoted(name + '.unused') if name == unused else ''})"
        for name in names
    ]
    for number, name, alias in _TECHNICAL:
        rows.append(f"({number} {quoted(name)} user{' ' + quoted(alias) if alias else ''})")
    return node("layers", *rows)


def stackup_section(stackup: Stackup, finish: str) -> str:
    """Return the ``stackup`` section.

    Coverlays are mask layers. Dielectrics between copper layers have sublayers. A copper layer that KiCad requires and
    the board lacks (see `layer_table`) has the thickness 0. `finish` is the name in the spec.
    """
    layers = stackup.layers
    coppers = [i for i, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    names = copper_names(len(coppers))
    below = layers[coppers[-1] + 1 :]
    rows = [*_plain("F.SilkS", "Top Silk Screen"), *_plain("F.Paste", "Top Solder Paste")]
    rows += _mask("F.Mask", "Top Solder Mask", layers[: coppers[0]])
    for order, (name, index) in enumerate(zip(names, coppers, strict=True)):
        if name == "B.Cu" and len(coppers) % 2:
            rows += [_copper(f"In{len(coppers) - 1}.Cu", 0.0), _dielectric(len(coppers), ())]
        rows.append(_copper(name, layers[index].thickness))
        if order + 1 < len(coppers):
            rows.append(_dielectric(order + 1, layers[index + 1 : coppers[order + 1]]))
    if len(coppers) == 1:
        rows += [_dielectric(1, [layer for layer in below if layer.kind is LayerKind.DIELECTRIC]), _copper("B.Cu", 0.0)]
        below = tuple(layer for layer in below if layer.kind is not LayerKind.DIELECTRIC)
    rows += _mask("B.Mask", "Bottom Solder Mask", below)
    rows += [*_plain("B.Paste", "Bottom Solder Paste"), *_plain("B.SilkS", "Bottom Silk Screen")]
    return node("stackup", *rows, f"(copper_finish {quoted(FINISHES[finish])})", "(dielectric_constraints no)")


def _plain(name: str, kind: str) -> list[str]:
    return [node(f"layer {quoted(name)}", f"(type {quoted(kind)})")]


def _copper(name: str, thickness: float) -> str:
    return node(f"layer {quoted(name)}", '(type "copper")', f"(thickness {length(thickness)})")


def _mask(name: str, kind: str, layers: Sequence[StackLayer]) -> list[str]:
    """Return a single mask layer for all layers outside the outermost copper. Its thickness is 0 if there are none."""
    thickness = sum(layer.thickness for layer in layers)
    children = [f"(type {quoted(kind)})", f"(color {quoted(_AMBER)})", f"(thickness {length(thickness)})"]
    if layers:
        children.append(f"(material {quoted(' + '.join(layer.material for layer in layers))})")
        permittivity = layers[0].relative_permittivity
        if permittivity is not None:
            children.append(f"(epsilon_r {permittivity:.6g})")
    return [node(f"layer {quoted(name)}", *children)]


def _dielectric(number: int, layers: Sequence[StackLayer]) -> str:
    """Return a single node for all layers between two copper layers."""
    kind = "prepreg" if any(layer.material == BOND for layer in layers) else "core"
    children = [f"(type {quoted(kind)})", f"(color {quoted(_AMBER)})"]
    if not layers:
        children.append("(thickness 0)")
    for i, layer in enumerate(layers):
        if i:
            children.append("addsublayer")
        children += [f"(thickness {length(layer.thickness)})", f"(material {quoted(layer.material)})"]
        if layer.relative_permittivity is not None:
            children.append(f"(epsilon_r {layer.relative_permittivity:.6g})")
    return node(f'layer "dielectric {number}"', *children)
