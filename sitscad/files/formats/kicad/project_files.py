"""KiCad 9 project of the flexible circuit: board, libraries of footprints and symbols, and design rules.

The rules of the fabricator are in the project file (``.kicad_pro``) and in the custom rules (``.kicad_dru``).
"""

from __future__ import annotations

import json
from typing import Any

from sitscad.files.formats.kicad.coil import coil_footprints
from sitscad.files.formats.kicad.library import library_footprints, library_table, symbol_library
from sitscad.files.formats.kicad.pcb import board as board_text
from sitscad.files.formats.kicad.sexpr import (
    BEND_LAYER,
    BODY_LAYER,
    STIFFENER_LAYER,
    TAIL_LAYER,
    copper_names,
    length,
    uuid_of,
)
from sitscad.layout.board import Layout, Via
from sitscad.spec.design_rules import DesignRules


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
    in_coils = rules.coil_trace_width if rules.binds("coil_trace_width") else None
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
