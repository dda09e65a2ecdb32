"""The fabricator's rules as KiCad reads them: project file (``.kicad_pro``) and custom rules (``.kicad_dru``)."""

from __future__ import annotations

import json
from typing import Any

from sitscad.formats.kicad.sexpr import length
from sitscad.layout.board import Layout

NET_CLASS = "Coil"

# Every check of KiCad's board setup with KiCad's own severity. What differs from KiCad's defaults, and why:
# KiCad ignores the five checks marked so when a project says nothing; here no check is ignored, since silence must not
# mean that a check passed.
_SEVERITIES = {
    "annular_width": "error",
    "clearance": "error",
    "connection_width": "warning",
    "copper_edge_clearance": "error",
    "copper_sliver": "warning",
    "courtyards_overlap": "error",
    "creepage": "error",
    "diff_pair_gap_out_of_range": "error",
    "diff_pair_uncoupled_length_too_long": "error",
    "drill_out_of_range": "error",
    "duplicate_footprints": "warning",
    "extra_footprint": "warning",
    "footprint": "error",
    "footprint_filters_mismatch": "warning",  # KiCad: ignore
    "footprint_symbol_mismatch": "warning",
    "footprint_type_mismatch": "warning",  # KiCad: ignore
    "hole_clearance": "error",
    "hole_to_hole": "error",  # KiCad: warning; a fabricator's limit is no advice
    "holes_co_located": "warning",
    "invalid_outline": "error",
    "isolated_copper": "warning",
    "item_on_disabled_layer": "error",
    "items_not_allowed": "error",
    "length_out_of_range": "error",
    "lib_footprint_issues": "warning",
    "lib_footprint_mismatch": "warning",
    "malformed_courtyard": "error",
    "microvia_drill_out_of_range": "error",
    "mirrored_text_on_front_layer": "warning",
    "missing_courtyard": "warning",  # KiCad: ignore
    "missing_footprint": "warning",
    "net_conflict": "warning",
    "nonmirrored_text_on_back_layer": "warning",
    "npth_inside_courtyard": "warning",  # KiCad: ignore
    "padstack": "warning",
    "pth_inside_courtyard": "warning",  # KiCad: ignore
    "shorting_items": "error",
    "silk_edge_clearance": "warning",
    "silk_over_copper": "warning",
    "silk_overlap": "warning",
    "skew_out_of_range": "error",
    "solder_mask_bridge": "error",
    "starved_thermal": "error",
    "text_height": "warning",
    "text_on_edge_cuts": "error",
    "text_thickness": "warning",
    "through_hole_pad_without_hole": "error",
    "too_many_vias": "error",
    "track_angle": "error",
    "track_dangling": "warning",
    "track_segment_length": "error",
    "track_width": "error",
    "tracks_crossing": "error",
    "unconnected_items": "error",
    "unresolved_variable": "error",
    "via_dangling": "warning",
    "zones_intersect": "error",
}


def _mm(metres: float) -> float:
    return float(length(metres))


def board_rules(layout: Layout) -> dict[str, Any]:
    """The board setup's minima.

    They differ from KiCad's defaults (hole 0.3 mm, via 0.5 mm, edge 0.5 mm, hole clearance and hole to hole 0.25 mm) in
    being the rules that the spec names: a flexible circuit is made finer than the rigid board that KiCad assumes.
    """
    rules = layout.spec.fpc.rules
    return {
        "max_error": 0.005,
        "min_clearance": _mm(rules.trace_spacing),
        "min_connection": 0.0,
        "min_copper_edge_clearance": _mm(rules.copper_to_edge),
        "min_groove_width": 0.0,
        "min_hole_clearance": _mm(rules.drill_to_copper),
        "min_hole_to_hole": _mm(rules.hole_to_hole),
        "min_microvia_diameter": _mm(rules.via_pad),
        "min_microvia_drill": _mm(rules.via_drill),
        "min_resolved_spokes": 2,
        "min_silk_clearance": 0.0,
        "min_text_height": 0.8,
        "min_text_thickness": 0.08,
        "min_through_hole_diameter": _mm(rules.via_drill),
        "min_track_width": _mm(rules.trace_width),
        "min_via_annular_width": _mm(rules.annular_ring),
        "min_via_diameter": _mm(rules.via_pad),
        "solder_mask_to_copper_clearance": 0.0,
        "use_height_for_length_calcs": True,
    }


def _net_class(layout: Layout, name: str, track_width: float, clearance: float, priority: int) -> dict[str, Any]:
    """The project's one class of nets."""
    rules = layout.spec.fpc.rules
    via_pad = max((via.pad for via in layout.vias), default=rules.via_pad)
    via_drill = max((via.drill for via in layout.vias), default=rules.via_drill)
    return {
        "bus_width": 12,
        "clearance": _mm(clearance),
        "diff_pair_gap": _mm(clearance),
        "diff_pair_via_gap": _mm(clearance),
        "diff_pair_width": _mm(track_width),
        "line_style": 0,
        "microvia_diameter": _mm(rules.via_pad),
        "microvia_drill": _mm(rules.via_drill),
        "name": name,
        "pcb_color": "rgba(0, 0, 0, 0.000)",
        "priority": priority,
        "schematic_color": "rgba(0, 0, 0, 0.000)",
        "track_width": _mm(track_width),
        "via_diameter": _mm(via_pad),
        "via_drill": _mm(via_drill),
        "wire_width": 6,
    }


def project(layout: Layout) -> str:
    """The project file: board setup, severities and net classes. No exclusion, nothing ignored."""
    spec = layout.spec
    rules = spec.fpc.rules
    classes = [
        _net_class(layout, "Default", rules.trace_width, rules.trace_spacing, 2147483647),
        _net_class(layout, NET_CLASS, spec.coil.trace_width, rules.trace_spacing, 0),
    ]
    value = {
        "board": {
            "design_settings": {
                "defaults": {"board_outline_line_width": 0.05, "zones": {"min_clearance": _mm(rules.trace_spacing)}},
                "diff_pair_dimensions": [],
                "drc_exclusions": [],
                "meta": {"version": 2},
                "rule_severities": _SEVERITIES,
                "rules": board_rules(layout),
                "track_widths": [0.0, _mm(spec.coil.trace_width)],
                "via_dimensions": [],
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
            "classes": classes,
            "meta": {"version": 4},
            "net_colors": None,
            "netclass_assignments": None,
            "netclass_patterns": [{"netclass": NET_CLASS, "pattern": net} for net in layout.nets],
        },
        "pcbnew": {"page_layout_descr_file": ""},
        "sheets": [],
        "text_variables": {},
    }
    return json.dumps(value, indent=2, sort_keys=True) + "\n"


def custom_rules(layout: Layout) -> str:
    """The rules file: every figure of the spec's design rules with its source, as KiCad's constraints.

    KiCad does not measure between pieces of one net, so the gap from turn to turn is not among them: sitscad's own
    checks and its reading back of the Gerber files do that.
    """
    rules = layout.spec.fpc.rules
    lines = [
        "(version 1)",
        f"# Design rules {rules.name}" + (f", seen {rules.checked_on}" if rules.checked_on else ""),
        *([f"# Source: {_one_line(rules.source)}"] if rules.source else []),
        "# The gap between the turns of one coil is not checked by KiCad (one net); sitscad checks it.",
    ]
    for title, constraint, limit, field in (
        ("trace width", "track_width", rules.trace_width, "trace_width"),
        ("trace spacing", "clearance", rules.trace_spacing, "trace_spacing"),
        ("drill", "hole_size", rules.via_drill, "via_drill"),
        ("via pad", "via_diameter", rules.via_pad, "annular_ring"),
        ("annular ring", "annular_width", rules.annular_ring, "annular_ring"),
        ("hole to hole", "hole_to_hole", rules.hole_to_hole, "hole_to_hole"),
        ("drill to copper", "hole_clearance", rules.drill_to_copper, "drill_to_copper"),
        ("copper to edge", "edge_clearance", rules.copper_to_edge, "copper_to_edge"),
    ):
        lines += _rule(title, constraint, limit, rules.sources.get(field, ""))
    if rules.binds("coil_trace_width") and rules.coil_trace_width is not None:
        source, condition = rules.sources.get("coil_trace_width", ""), "A.memberOfGroup('* winding')"
        lines += _rule("trace width in coils", "track_width", rules.coil_trace_width, source, condition)
    return "\n".join(lines) + "\n"


def _rule(title: str, constraint: str, limit: float, source: str, condition: str = "") -> list[str]:
    lines = ["", *([f"# {_one_line(source)}"] if source else []), f'(rule "{title}"']
    if condition:
        lines.append(f'\t(condition "{condition}")')
    return [*lines, f"\t(constraint {constraint} (min {length(limit)}mm)))"]


def _one_line(text: str) -> str:
    return " ".join(text.split())
