"""Board file (``.kicad_pcb``) of a layout: x as in the layout, y negated, the board in the middle of the sheet.

The layout's origin is KiCad's origin for drill and place files and for its grid. Plots made from that origin match the
package's Gerber files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sitscad.assembly.places.tail_path import bends
from sitscad.files.formats.kicad.library import board_footprint, contact_openings, filled, placed_capacitors
from sitscad.files.formats.kicad.sexpr import (
    BEND_LAYER,
    BODY_LAYER,
    STIFFENER_LAYER,
    TAIL_LAYER,
    Grid,
    copper_names,
    curve,
    drawn,
    grid,
    identity,
    layer_table,
    length,
    millimetres,
    node,
    polygon_points,
    quoted,
    stackup_section,
    stroked,
    uuid_of,
    xy,
)
from sitscad.files.order_facts.files import body_files, tail_coverlay_files
from sitscad.files.order_facts.notes import bend_words
from sitscad.kernels.geometry.areas import areas_beyond
from sitscad.kernels.geometry.path import Path, Point, bounding_box, polyline, rectangle
from sitscad.layout.board import Coil, Layout, Pad, Role, Trace, Via
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.presets import is_rigid

# Board format of KiCad 9.0; later versions read it.
FORMAT = 20241229
_OUTLINE_PEN = 50e-6
_TEXT_SIZE = 1e-3
_BEYOND = 1e-3  # length (m) of a bend line beyond each edge of the tail
_MM = 1_000_000
_A4 = (297 * _MM, 210 * _MM)
_SHEET_MARGIN = 40 * _MM


def board(layout: Layout) -> str:
    """Return the whole board file."""
    nets = net_numbers(layout.all_pads, layout.nets, layout.traces, layout.vias)
    sheet = sheet_corner(layout.outline)
    stackup = layout.spec.fpc.stackup
    size = _sheet_size(layout.outline)
    # The board's title block as a node
    fpc, issue = layout.spec.fpc, layout.spec.issue
    children = [
        f"(version {FORMAT})",
        '(generator "sitscad")',
        '(generator_version "9.0")',
        node("general", f"(thickness {length(stackup.thickness)})", "(legacy_teardrops no)"),
        ('(paper "A4")' if size == _A4 else f'(paper "User" {millimetres(size[0])} {millimetres(size[1])})'),
        node(
            "title_block", f"(title {quoted(layout.spec.name)})",
            *([f"(date {quoted(issue.day)})"] if issue.day else []),
            *([f"(rev {quoted(issue.revision)})"] if issue.revision else []),
            f"(comment 1 {quoted(f'stack-up {fpc.stackup.name}, design rules {fpc.rules.name}')})",
            *([f"(comment 2 {quoted(f'part number {issue.part_number}')})"] if issue.part_number else []),
        ),
        layer_table(layout.copper_layers),
        _setup(fpc, sheet),
        *(f"(net {number} {quoted(name)})" for name, number in nets.items()),
    ]
    if layout.pads:
        children.append(board_footprint(layout, nets, sheet))
    children += placed_capacitors(layout, nets, sheet)
    children += [*_graphics(layout, sheet), *_tracks(layout.copper_layers, layout.spec.name, layout.traces, nets,
                                                     sheet)]
    children += [_via(via, i, layout, nets, sheet) for i, via in enumerate(layout.vias)]
    # Teardrops as filled polygons of their nets: KiCad's own teardrops would differ and not follow these rules
    layers = copper_names(layout.copper_layers)
    children += [
        f"(gr_poly {polygon_points(drop.outline, sheet)} (stroke (width 0) (type solid)) (fill yes) "
        f"(layer {quoted(layers[drop.layer - 1])}) (net {nets[drop.net]}) {identity(layout.spec.name, 'teardrop', i)})"
        for i, drop in enumerate(layout.teardrops)
    ]
    children += [*_groups(layout.coils, layout.spec.name, layout.traces), "(embedded_fonts no)"]
    return node("kicad_pcb", *children) + "\n"


def sheet_corner(outline: Path) -> Grid:
    """Return the sheet's upper left corner from the layout's origin (nm, y downwards; a multiple of 1 mm).

    The board is then in the middle of the sheet.
    """
    x0, y0, x1, y1 = bounding_box([outline])
    middle = grid(Point((x0 + x1) / 2, (y0 + y1) / 2))
    width, height = _sheet_size(outline)
    return _whole(middle[0] - width // 2), _whole(middle[1] - height // 2)


def _whole(nanometres: int) -> int:
    return round(nanometres / _MM) * _MM


def _sheet_size(outline: Path) -> Grid:
    """Return the sheet's width and height (nm): A4 if the board fits, otherwise the board's size with a margin."""
    x0, y0, x1, y1 = bounding_box([outline])
    needed = round((x1 - x0) * 1e9) + _SHEET_MARGIN, round((y1 - y0) * 1e9) + _SHEET_MARGIN
    if needed[0] <= _A4[0] and needed[1] <= _A4[1]:
        return _A4
    return _whole(max(needed[0], _A4[0]) + _MM), _whole(max(needed[1], _A4[1]) + _MM)


def net_numbers(
    all_pads: tuple[Pad, ...], nets: tuple[str, ...], traces: tuple[Trace, ...], vias: tuple[Via, ...]
) -> dict[str, int]:
    """Return the numbers of the nets in the file by name. 0 is KiCad's "no net"."""
    drawn_nets = (*(t.net for t in traces), *(v.net for v in vias), *(p.net for p in all_pads))
    return {name: number for number, name in enumerate(dict.fromkeys(("", *nets, *drawn_nets)))}


def _setup(fpc: FpcSpec, sheet: Grid) -> str:
    return node(
        "setup",
        stackup_section(fpc.stackup, fpc.finish),
        # Openings are drawn exactly as ordered: KiCad adds no margin and no openings of its own.
        "(pad_to_mask_clearance 0)",
        "(allow_soldermask_bridges_in_footprints no)",
        "(tenting front back)",
        xy("aux_axis_origin", (0, 0), sheet),
        xy("grid_origin", (0, 0), sheet),
        node("pcbplotparams", "(useauxorigin yes)"),
    )


def _graphics(layout: Layout, sheet: Grid) -> Iterator[str]:
    name = layout.spec.name
    yield from stroked(layout.outline, "Edge.Cuts", _OUTLINE_PEN, (name, "outline"), sheet)
    # Coverlay openings that are not over contacts
    for layer, openings, number in (
        ("F.Mask", layout.top_openings, 1), ("B.Mask", layout.bottom_openings, layout.copper_layers),
    ):
        visible = contact_openings(openings, [pad for pad in layout.all_pads if pad.layer == number])
        for i, region in enumerate(o for o in openings if o not in visible):
            yield filled("gr", region, layer, sheet, (name, layer, "free", i))
    if layout.stiffener is not None:
        outline = layout.stiffener.outline
        for i, path in enumerate((outline.outline, *outline.holes)):
            yield from stroked(path, STIFFENER_LAYER, 0.1e-3, (name, "stiffener", i), sheet)
    if body_files(layout.spec.name, layout.spec.fpc):
        yield from stroked(rectangle(*layout.body), BODY_LAYER, 0.1e-3, (name, "body layers"), sheet)
    if tail_coverlay_files(layout.spec.name, layout.spec.fpc):
        for i, covered in enumerate(areas_beyond(layout.outline, layout.lap_start)):
            yield from stroked(covered, TAIL_LAYER, 0.1e-3, (name, "tail coverlay", i), sheet)
    for i, bend in enumerate(bends(layout)):
        y0, y1 = layout.reach_at(bend.line)
        line = polyline([Point(bend.line, y0 - _BEYOND), Point(bend.line, y1 + _BEYOND)])
        yield from stroked(line, BEND_LAYER, 0.1e-3, (name, "bend line", i), sheet)
        if bend.end > bend.start:
            zone = rectangle(bend.start, y0, bend.end, y1)
            yield from stroked(zone, BEND_LAYER, 0.05e-3, (name, "bend", i), sheet)
    yield from _notes(layout, sheet)


def _notes(layout: Layout, sheet: Grid) -> Iterator[str]:
    """Yield notes below the board on F.Fab, as on the fabricator's drawing, and the meanings of User layers."""
    spec = layout.spec
    condition = "" if is_rigid(spec.fpc.stackup) else " without stiffener"
    x, y, _, _ = bounding_box([layout.outline])
    lines = [
        ("F.Fab", spec.name),
        (
            "F.Fab",
            f"{layout.copper_layers} copper layers, {spec.fpc.stackup.name}, "
            f"{length(spec.fpc.stackup.thickness)} mm{condition}",
        ),
        ("F.Fab", f"design rules {spec.fpc.rules.name}"),
    ]
    if layout.stiffener is not None:
        plate = layout.stiffener
        lines.append((STIFFENER_LAYER, f"stiffener on the bottom: {plate.material}, {length(plate.thickness)} mm"))
    body = body_files(layout.spec.name, layout.spec.fpc)
    lines += [(BODY_LAYER, file.title) for file in body]
    lines += [(TAIL_LAYER, file.title) for file in tail_coverlay_files(layout.spec.name, layout.spec.fpc)]
    for bend in bends(layout):
        kind = "dynamic" if bend.is_dynamic else "static"
        radius = "" if bend.radius is None else f", inside radius at least {length(bend.radius)} mm"
        lines.append((BEND_LAYER, f"bend line, {kind}: {bend_words(bend)}{radius}"))
    for i, (layer, text) in enumerate(lines):
        at = Point(x, y - (2.0 + 1.6 * i) * _TEXT_SIZE)
        names = (spec.name, "note", i)
        size = length(_TEXT_SIZE)
        font = f"(effects (font (size {size} {size}) (thickness 0.15)) (justify left))"
        place = f"{xy('at', grid(at), sheet)[:-1]} 0)"
        yield f"(gr_text {quoted(text)} {place} (layer {quoted(layer)}) {identity(*names)} {font})"


def _tracks(
    copper_layers: int, name: str, traces: tuple[Trace, ...], nets: Mapping[str, int], sheet: Grid
) -> Iterator[str]:
    layers = copper_names(copper_layers)
    for i, trace in enumerate(traces):
        rest = f"(width {length(trace.width)}) (layer {quoted(layers[trace.layer - 1])}) (net {nets[trace.net]})"
        for j, segment in enumerate(drawn(trace.path)):
            kind, points = curve(segment, sheet)
            head = "segment" if kind == "line" else "arc"
            yield f"({head} {points} {rest} {identity(*_track_names(name, i, j))})"


def _track_names(name: str, trace: int, segment: int) -> tuple[object, ...]:
    return name, "track", trace, segment


def _via(via: Via, index: int, layout: Layout, nets: Mapping[str, int], sheet: Grid) -> str:
    """Return a hole from top to bottom, or a blind via, which ends on the last layer of a thinner tail."""
    lowest = layout.lowest_layer(via)
    kind = "" if lowest == layout.copper_layers else "blind "
    last = "B.Cu" if not kind else copper_names(layout.copper_layers)[lowest - 1]
    return (
        f"(via {kind}{xy('at', grid(via.centre), sheet)} (size {length(via.pad)}) (drill {length(via.drill)}) "
        f'(layers "F.Cu" {quoted(last)}) (net {nets[via.net]}) {identity(layout.spec.name, "via", index)})'
    )


def _groups(coils: tuple[Coil, ...], name: str, traces: tuple[Trace, ...]) -> Iterator[str]:
    """Yield a group for each coil, with the tracks of its windings.

    A group can be selected as a whole, and rules can distinguish windings from leads.
    """
    for coil in coils:
        members = [
            quoted(uuid_of(*_track_names(name, i, j)))
            for i, trace in enumerate(traces)
            if trace.role is Role.WINDING and trace.net == coil.net
            for j, _ in enumerate(drawn(trace.path))
        ]
        if members:
            head = f"group {quoted(f'{coil.name} winding')}"
            yield node(head, identity(name, "group", coil.name), f"(members {' '.join(sorted(members))})")
