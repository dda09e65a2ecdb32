"""KiCad 9 project of the flexible circuit: board, libraries of footprints and symbols, and design rules.

The rules of the fabricator are in the project file (``.kicad_pro``) and in the custom rules (``.kicad_dru``).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from sitscad.assembly.places.tail_path import bends
from sitscad.files.formats.kicad.coil import coil_footprints
from sitscad.files.formats.kicad.library import (
    board_footprint,
    contact_openings,
    filled,
    library_footprints,
    library_table,
    placed_chips,
    symbol_library,
)
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
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.presets import is_rigid


def render(layout: Layout) -> dict[str, bytes]:
    """Return the files of ``kicad/`` by their paths in the package.

    The files are project, board, custom rules, jobs, footprints and symbols. The board lies in the middle of the sheet
    (mm, y negated, because KiCad's y points down). KiCad's origin for drill files is the layout's origin, so that plots
    made from that origin match the package's Gerber files. Raises ValueError for a contact on an inner layer and for an
    opening with a hole, which KiCad cannot represent.
    """
    name = layout.spec.name
    files = {
        f"kicad/{name}.kicad_pro": project(layout), f"kicad/{name}.kicad_pcb": board_text(layout),
        f"kicad/{name}.kicad_dru": custom_rules(layout.spec.fpc.rules),
        f"kicad/{name}.kicad_jobset": job_set(name, layout.copper_layers),
    }
    library = library_footprints(layout) | coil_footprints(layout)
    files |= {f"kicad/{name}.pretty/{footprint}.kicad_mod": text for footprint, text in library.items()}
    if library:
        descriptions = f"The contacts and coils of {name}", f"The sensor {name} and its coils"
        files["kicad/fp-lib-table"] = library_table("fp", name, f"{name}.pretty", descriptions[0])
        files[f"kicad/{name}.kicad_sym"] = symbol_library(layout)
        files["kicad/sym-lib-table"] = library_table("sym", name, f"{name}.kicad_sym", descriptions[1])
    return {path: text.encode("utf-8") for path, text in files.items()}


NET_CLASS = "Coil"

# Every check of KiCad's board setup with KiCad's own severity, except hole_to_hole: KiCad's warning becomes an error,
# because it is a fabricator's limit. No check is ignored, so that no message means that a check passed. Without an
# entry, KiCad ignores footprint_filters_mismatch, footprint_type_mismatch, missing_courtyard, npth_inside_courtyard
# and pth_inside_courtyard.
_ERRORS = """
    annular_width clearance copper_edge_clearance courtyards_overlap creepage diff_pair_gap_out_of_range
    diff_pair_uncoupled_length_too_long drill_out_of_range footprint hole_clearance hole_to_hole invalid_outline
    item_on_disabled_layer items_not_allowed length_out_of_range malformed_courtyard microvia_drill_out_of_range
    shorting_items skew_out_of_range solder_mask_bridge starved_thermal text_on_edge_cuts
    through_hole_pad_without_hole too_many_vias track_angle track_segment_length track_width tracks_crossing
    unconnected_items unresolved_variable zones_intersect
"""
_WARNINGS = """
    connection_width copper_sliver duplicate_footprints extra_footprint footprint_filters_mismatch
    footprint_symbol_mismatch footprint_type_mismatch holes_co_located isolated_copper lib_footprint_issues
    lib_footprint_mismatch mirrored_text_on_front_layer missing_courtyard missing_footprint net_conflict
    nonmirrored_text_on_back_layer npth_inside_courtyard padstack pth_inside_courtyard silk_edge_clearance
    silk_over_copper silk_overlap text_height text_thickness track_dangling via_dangling
"""
_SEVERITIES = dict.fromkeys(_ERRORS.split(), "error") | dict.fromkeys(_WARNINGS.split(), "warning")


def _mm(metres: float) -> float:
    return float(length(metres))


def board_rules(rules: DesignRules) -> dict[str, Any]:
    """Return the minima of the board setup, from the design rules that the spec names.

    They differ from KiCad's defaults (hole 0.3 mm, via 0.5 mm, edge 0.5 mm, hole clearance and hole to hole 0.25 mm),
    which are meant for rigid boards. A flexible circuit is made finer.
    """
    return {
        "max_error": 0.005, "min_clearance": _mm(rules.trace_spacing), "min_connection": 0.0,
        "min_copper_edge_clearance": _mm(rules.copper_to_edge), "min_groove_width": 0.0,
        "min_hole_clearance": _mm(rules.drill_to_copper), "min_hole_to_hole": _mm(rules.hole_to_hole),
        "min_microvia_diameter": _mm(rules.via_pad), "min_microvia_drill": _mm(rules.via_drill),
        "min_resolved_spokes": 2, "min_silk_clearance": 0.0, "min_text_height": 0.8, "min_text_thickness": 0.08,
        "min_through_hole_diameter": _mm(rules.via_drill), "min_track_width": _mm(rules.trace_width),
        "min_via_annular_width": _mm(rules.annular_ring), "min_via_diameter": _mm(rules.via_pad),
        "solder_mask_to_copper_clearance": 0.0, "use_height_for_length_calcs": True,
    }


def _net_class(
    rules: DesignRules, vias: tuple[Via, ...], name: str, track_width: float, priority: int
) -> dict[str, Any]:
    clearance = _mm(rules.trace_spacing)
    via_pad = max((via.pad for via in vias), default=rules.via_pad)
    via_drill = max((via.drill for via in vias), default=rules.via_drill)
    return {
        "bus_width": 12, "clearance": clearance, "diff_pair_gap": clearance, "diff_pair_via_gap": clearance,
        "diff_pair_width": _mm(track_width), "line_style": 0,
        "microvia_diameter": _mm(rules.via_pad), "microvia_drill": _mm(rules.via_drill), "name": name,
        "pcb_color": "rgba(0, 0, 0, 0.000)", "priority": priority, "schematic_color": "rgba(0, 0, 0, 0.000)",
        "track_width": _mm(track_width), "via_diameter": _mm(via_pad), "via_drill": _mm(via_drill), "wire_width": 6,
    }


def project(layout: Layout) -> str:
    """Return the project file: board setup, severities and net classes. No check is excluded or ignored."""
    spec = layout.spec
    rules = spec.fpc.rules
    classes = [
        _net_class(layout.spec.fpc.rules, layout.vias, "Default", rules.trace_width, 2147483647),
        _net_class(layout.spec.fpc.rules, layout.vias, NET_CLASS, spec.coil.trace_width, 0),
    ]
    value = {
        "board": {
            "design_settings": {
                "defaults": {"board_outline_line_width": 0.05, "zones": {"min_clearance": _mm(rules.trace_spacing)}},
                "diff_pair_dimensions": [], "drc_exclusions": [], "meta": {"version": 2},
                "rule_severities": _SEVERITIES, "rules": board_rules(rules),
                "track_widths": [0.0, _mm(spec.coil.trace_width)], "via_dimensions": [],
                "zones_allow_external_fillets": False,
            },
            "layer_pairs": [],
            "layer_presets": [],
            "viewports": [],
        },
        "boards": [],
        "cvpcb": {"equivalence_files": []},
        "libraries": {"pinned_footprint_libs": [spec.name], "pinned_symbol_libs": []},
        "meta": {"filename": f"{spec.name}.kicad_pro", "version": 3},
        "net_settings": {
            "classes": classes, "meta": {"version": 4}, "net_colors": None, "netclass_assignments": None,
            "netclass_patterns": [{"netclass": NET_CLASS, "pattern": net} for net in layout.nets],
        },
        "pcbnew": {"page_layout_descr_file": ""},
        "sheets": [],
        "text_variables": {},
    }
    return json.dumps(value, indent=2, sort_keys=True) + "\n"


def job_set(name: str, copper_layers: int) -> str:
    """Return KiCad's jobs that plot Gerber and drill files into ``gerbers/``, from the layout's origin.

    KiCad 9 runs them from its project window, or by ``kicad-cli jobset run -f NAME.kicad_jobset NAME.kicad_pro``.
    """
    copper = copper_names(copper_layers)
    layers = [*copper, "F.Mask", "B.Mask", "Edge.Cuts", STIFFENER_LAYER, BEND_LAYER, BODY_LAYER, TAIL_LAYER]
    gerbers = {
        "create_gerber_job_file": True, "include_netlist_attributes": True, "layers": layers, "output_dir": "",
        "plot_drawing_sheet": False, "precision": 6, "use_drill_origin": True, "use_protel_file_extension": False,
        "use_x2_format": True,
    }
    drills = {
        "drill_origin": "plot", "excellon.combine_pth_npth": False, "format": "excellon", "output_dir": "",
        "units": "mm",
    }
    value = {
        "jobs": [
            {"description": "Gerber files", "id": uuid_of(name, "gerbers"), "settings": gerbers,
             "type": "pcb_export_gerbers"},
            {"description": "Drill files", "id": uuid_of(name, "drills"), "settings": drills,
             "type": "pcb_export_drill"},
        ],
        "meta": {"version": 1},
        "outputs": [
            {"description": "Gerber and drill files", "id": uuid_of(name, "jobs"), "only": [],
             "settings": {"output_path": "${KIPRJMOD}/gerbers"}, "type": "folder"},
        ],
    }
    return json.dumps(value, indent=2, sort_keys=True) + "\n"


def custom_rules(rules: DesignRules) -> str:
    """Return the rules file: the spec's design rules as KiCad's constraints, each with its source.

    KiCad does not measure between pieces of one net. The gap between turns is therefore not a constraint: sitscad's own
    checks cover it, and so does the extraction from the Gerber files.
    """
    lines = [
        "(version 1)", f"# Design rules {rules.name}" + (f", seen {rules.checked_on}" if rules.checked_on else ""),
        *([f"# Source: {' '.join(rules.source.split())}"] if rules.source else []),
        "# The gap between the turns of one coil is not checked by KiCad (one net); sitscad checks it.",
    ]
    in_coils = rules.coil_trace_width if rules.is_binding("coil_trace_width") else None
    for title, constraint, limit, field in (
        ("trace width", "track_width", rules.trace_width, "trace_width"),
        ("trace spacing", "clearance", rules.trace_spacing, "trace_spacing"),
        ("drill", "hole_size", rules.via_drill, "via_drill"),
        ("via pad", "via_diameter", rules.via_pad, "annular_ring"),
        ("annular ring", "annular_width", rules.annular_ring, "annular_ring"),
        ("hole to hole", "hole_to_hole", rules.hole_to_hole, "hole_to_hole"),
        ("drill to copper", "hole_clearance", rules.drill_to_copper, "drill_to_copper"),
        ("copper to edge", "edge_clearance", rules.copper_to_edge, "copper_to_edge"),
        *([] if in_coils is None else [("trace width in coils", "track_width", in_coils, "coil_trace_width")]),
    ):
        source = " ".join(rules.sources.get(field, "").split())
        lines += ["", *([f"# {source}"] if source else []), f'(rule "{title}"']
        lines += ["\t(condition \"A.memberOfGroup('* winding')\")"] if field == "coil_trace_width" else []
        lines += [f"\t(constraint {constraint} (min {length(limit)}mm)))"]
    return "\n".join(lines) + "\n"


# Board format of KiCad 9.0; later versions read it.
FORMAT = 20241229
_OUTLINE_PEN = 50e-6
_TEXT_SIZE = 1e-3
_BEYOND = 1e-3  # length (m) of a bend line beyond each edge of the tail
_MM = 1_000_000
_A4 = (297 * _MM, 210 * _MM)
_SHEET_MARGIN = 40 * _MM


def board_text(layout: Layout) -> str:
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
    children += placed_chips(layout, nets, sheet)
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
