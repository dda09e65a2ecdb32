"""Every fabrication rule fires on a design that breaks it and is silent on one that does not."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import pytest
from one_rule import findings_of
from tolerance import approx

from sitscad.basics.finding import Missing, Severity, Shortfall
from sitscad.checks.judging import check
from sitscad.files.documents import order_notes
from sitscad.kernels.geometry.path import Line, Path, Point, Region, bounding_box, rectangle
from sitscad.layout import lay_out
from sitscad.layout.board import Pad, Role, Stiffener, Trace, Via
from sitscad.layout.panel import bridges, plan
from sitscad.spec.load import load_text


@pytest.fixture(scope="module")
def good():
    import json

    document = {
        "sitscad": 1,
        "name": "bench",
        "coil": {
            "shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2, "trace_width": "100 um",
            "trace_spacing": "100 um",
        },
        "array": {"pattern": "line", "count": 2, "pitch": 8},
        "fpc": {
            "stackup": "flex-2l-35um", "rules": "generic-flex",
            "tail": {"length": 30, "connector": "zif-0.5mm", "layers": 2},
        },
    }
    spec = load_text(json.dumps(document, indent=1), "bench.yaml")
    return spec, lay_out(spec)


def ruled(spec, **figures):
    return replace(spec, fpc=replace(spec.fpc, rules=replace(spec.fpc.rules, **figures)))


def with_rules(layout, **figures):
    return replace(layout, spec=ruled(layout.spec, **figures))


def test_trace_width_and_spacing_below_minimum_give_error(judge, design):
    (width,) = judge("SIT101", design(coil__trace_width="75 um"))
    assert (width.severity, width.limit) == (Severity.ERROR, 76e-6)
    assert width.measured == approx(75e-6, rel=1e-6) and width.key == "coil.trace_width"
    assert width.source and "3 mil" in width.source
    (spacing,) = judge("SIT102", design(coil__trace_spacing="60 um"))
    assert spacing.limit == 76e-6 and spacing.key == "coil.trace_spacing"
    assert not re.search(r"\d", width.hint + spacing.hint)
    assert (
        judge("SIT101", design(coil__trace_width="76 um")) == judge("SIT102", design(coil__trace_spacing="3 mil")) == []
    )


def test_coil_track_minimum_gives_warning_or_binding_error(judge, verdicts, design):
    result = judge("SIT103", design())
    assert [(f.severity, f.key) for f in result] == [
        (Severity.WARNING, "coil.trace_width"),
        (Severity.WARNING, "coil.trace_spacing"),
    ]
    # the core of the tail is plated first, and copper 1 again: 42 um of panel plating are etched like 35 um of foil
    assert all(f.limit == approx(203.2e-6, rel=1e-6) for f in result)
    buttons = judge("SIT103", design(fpc__plated="buttons"))
    assert all(f.limit == approx(152.4e-6, rel=1e-6) for f in buttons) and len(buttons) == 2
    binding = ruled(design(), coil_rule_binding=True)
    assert [f.severity for f in judge("SIT103", binding)] == [Severity.ERROR] * 2
    wide = ruled(design(), coil_trace_width=80e-6, coil_trace_spacing=80e-6)
    assert judge("SIT103", wide) == []
    silent = verdicts("SIT103", ruled(design(), coil_trace_width=None, coil_trace_spacing=None))
    assert silent[0] == [] and silent[1][0].case == "no-coil-minimum"


def test_small_drill_thin_ring_or_close_holes_give_finding(judge, good):
    spec, layout = good
    assert [judge(rule, spec, layout) for rule in ("SIT104", "SIT105", "SIT106")] == [[], [], []]
    via = layout.vias[0]
    thin = replace(layout, vias=(replace(via, drill=0.19e-3),))
    assert judge("SIT104", spec, thin)[0].measured == 0.19e-3
    wide = replace(layout, vias=(replace(via, drill=0.22e-3),))
    (ring,) = judge("SIT105", spec, wide)
    assert ring.measured == approx((via.pad - 0.22e-3) / 2, rel=1e-6) and ring.limit == spec.fpc.rules.annular_ring
    near = replace(via, centre=Point(via.centre.x + via.drill + 0.2e-3, via.centre.y))
    (wall,) = judge("SIT106", spec, replace(layout, vias=(via, near)))
    assert wall.measured == approx(0.2e-3, rel=1e-6) and wall.limit == 0.25e-3


def test_valid_board_has_no_copper_distance_finding(judge, good):
    spec, layout = good
    for rule in ("SIT107", "SIT108", "SIT110", "SIT111", "SIT112", "SIT113", "SIT114", "SIT115", "SIT116"):
        assert judge(rule, spec, layout) == [], rule


def test_turn_gap_of_spiral_is_measured_perpendicular_to_track(judge, good):
    """The gap square to the track of an Archimedean spiral is (w + s) cos(psi) - w, a little less than s."""
    spec, layout = good
    assert judge("SIT108", spec, layout) == []
    strict = replace(spec, coil=replace(spec.coil, trace_spacing=102.5e-6))
    result = judge("SIT108", *(lambda s: (s, replace(layout, spec=s)))(ruled(strict, trace_spacing=102.5e-6)))
    turns = min(result, key=lambda f: f.measured)
    assert turns.place.nets == ("C1",) and "gap-places" in turns.cases and "4" in turns.detail  # two coils, two layers
    innermost = 3.45e-3 - 12 * 0.2e-3
    slope = 0.2e-3 / 6.283185307
    shortfall = 0.2e-3 * (1 - 1 / (1 + (slope / innermost) ** 2) ** 0.5)
    assert 100e-6 - 2 * shortfall - 0.1e-6 < turns.measured <= 100e-6


def test_overlap_with_turn_of_same_net_gives_finding(judge, good):
    spec, layout = good
    coil = layout.coils[0]
    winding = next(t for t in layout.traces if t.role is Role.WINDING and t.net == coil.net)
    middle = winding.path.segments[len(winding.path.segments) // 2].at(0.5)
    bridge = Trace(
        Path((Line(middle, Point(middle.x + 0.15e-3, middle.y)),)), 100e-6, winding.layer, coil.net, Role.LEAD
    )
    result = judge("SIT108", spec, replace(layout, traces=(*layout.traces, bridge)))
    assert result and result[0].place.layer == winding.layer
    assert min(f.measured for f in result) < 0.0


def test_close_tracks_of_two_nets_give_spacing_finding(judge, good):
    spec, layout = good
    item, other = layout.coils
    away = Trace(Path((Line(Point(0.02, 0.001), Point(0.021, 0.001)),)), 100e-6, 1, item.net, Role.LEAD)
    beside = replace(away, path=away.path.shifted(0.0, 0.18e-3), net=other.net)
    (result,) = judge("SIT108", spec, replace(layout, traces=(away, beside), vias=(), pads=()))
    assert result.measured == approx(80e-6, rel=1e-6) and result.limit == 100e-6
    assert "20 um" in result.hint
    fair = replace(beside, path=away.path.shifted(0.0, 0.2e-3))
    assert judge("SIT108", spec, replace(layout, traces=(away, fair), vias=(), pads=())) == []
    below = replace(beside, layer=2)
    assert judge("SIT108", spec, replace(layout, traces=(away, below), vias=(), pads=())) == []


def test_tight_hairpin_gives_finding_and_right_angle_does_not(judge, good):
    spec, layout = good
    net = layout.coils[0].net

    def on_board(*corners):
        path = Path(tuple(Line(a, b) for a, b in pairwise(corners)))
        return replace(layout, traces=(Trace(path, 100e-6, 1, net, Role.LEAD),), vias=(), pads=(), coils=())

    legs = [Point(0, 0), Point(1e-3, 0), Point(1e-3, 0.15e-3), Point(0, 0.15e-3)]
    (result,) = judge("SIT108", spec, on_board(*legs))
    assert result.measured == approx(50e-6, rel=1e-6)
    assert judge("SIT108", spec, on_board(Point(0, 0), Point(1e-3, 0), Point(1e-3, 1e-3))) == []
    assert judge("SIT108", spec, on_board(Point(0, 0), Point(1e-3, 0), Point(1e-3, 0.2e-3), Point(0, 0.2e-3))) == []


def test_via_on_turn_of_same_coil_gives_finding(judge, good):
    spec, layout = good
    via = layout.vias[0]
    winding = next(t for t in layout.traces if t.role is Role.WINDING and t.net == via.net)
    onto = winding.path.segments[len(winding.path.segments) // 2].at(0.5)
    moved = replace(layout, vias=(*layout.vias, replace(via, centre=onto)))
    (result,) = judge("SIT107", spec, moved)
    assert result.measured < 0.0 and "gap-places" in result.cases
    assert {f.place.layer for f in judge("SIT110", spec, moved)} == {1, 2}


def test_via_clearance_is_measured_from_pad_edge(judge, good):
    spec, layout = good
    via = Via(Point(0, 0), 0.2e-3, 0.45e-3, layout.coils[0].net)
    other = layout.coils[1].net
    line = Trace(Path((Line(Point(-1e-3, 0.36e-3), Point(1e-3, 0.36e-3)),)), 100e-6, 2, other, Role.LEAD)
    (result,) = judge("SIT107", spec, replace(layout, traces=(line,), vias=(via,), pads=()))
    assert result.measured == approx(0.36e-3 - 0.225e-3 - 0.05e-3, rel=1e-6)
    assert judge("SIT110", spec, replace(layout, traces=(line,), vias=(via,), pads=()))[0].measured == approx(
        0.21e-3, rel=1e-6
    )
    clear = replace(line, path=line.path.shifted(0, 0.02e-3))
    assert judge("SIT107", spec, replace(layout, traces=(clear,), vias=(via,), pads=())) == []
    assert judge("SIT110", spec, replace(layout, traces=(clear,), vias=(via,), pads=())) == []


def test_track_inside_contact_of_other_net_gives_finding(judge, good):
    spec, layout = good
    pad = Pad(Point(0, 0), (3e-3, 0.3e-3), 1, layout.coils[0].net, "C1.A", 1)
    inside = Trace(Path((Line(Point(-0.5e-3, 0), Point(0.5e-3, 0)),)), 50e-6, 1, layout.coils[1].net, Role.LEAD)
    (result,) = judge("SIT108", spec, replace(layout, traces=(inside,), vias=(), pads=(pad,)))
    assert result.measured < 0.0 and "C1.A" in result.message


def test_copper_near_board_edge_gives_finding(judge, good):
    spec, layout = good
    x0, _, x1, y1 = layout.body
    near = Trace(
        Path((Line(Point(x0 + 1e-3, y1 - 0.2e-3), Point(x1 - 1e-3, y1 - 0.2e-3)),)), 100e-6, 1, "C1", Role.LEAD
    )
    board = replace(layout, outline=rectangle(*layout.body), traces=(near,), vias=(), pads=())
    (result,) = judge("SIT109", spec, board)
    assert result.measured == approx(0.15e-3, rel=1e-6) and result.limit == 0.2e-3
    inner = replace(near, path=near.path.shifted(0.0, -0.05e-3))
    assert judge("SIT109", spec, replace(board, traces=(inner,))) == []
    crossing = replace(near, path=Path((Line(Point(x0 - 1e-3, 0), Point(x1, 0)),)))
    assert judge("SIT109", spec, replace(board, traces=(crossing,)))[0].measured < 0.0


def test_open_coil_circuit_gives_error(judge, good):
    spec, layout = good
    open_coil = replace(layout.coils[1], is_closed_circuit=False)
    (result,) = judge("SIT111", spec, replace(layout, coils=(layout.coils[0], open_coil)))
    assert "C2" in result.message and result.severity is Severity.ERROR


def test_single_layer_coil_without_exit_gives_one_finding(judge, design):
    spec = design(
        coil__layers=1, fpc={"stackup": [{"copper": "35 um"}, {"dielectric": "25 um", "material": "polyimide"}]}
    )
    layout = lay_out(spec)
    result = [f for rule in ("SIT111", "SIT112", "SIT113") for f in judge(rule, spec, layout)]
    assert [f.message for f in result] == [lack.message for lack in layout.shortfalls] and result[0].line is not None


def test_missing_inner_room_gives_error_with_needed_length(judge, design):
    spec = design(coil__turns=11.75)
    (result,) = judge("SIT112", spec)
    assert result.severity is Severity.ERROR and result.measured < result.limit
    assert spec.source.line(result.line).strip().startswith('"turns"')
    assert judge("SIT112", design()) == []


@pytest.mark.parametrize(("turns", "layers", "most"), [(13.0, 2, 0.4e-3), (6.0, 4, 0.4e-3)])
def test_coil_enlarged_by_missing_inner_room_has_room(turns, layers, most):
    """The limit was the measured value, so that nobody knew how much larger a coil had to be."""
    outer, stackup = {2: (6, "flex-2l-18um"), 4: (4, "flex-4l")}[layers]
    spec = load_text(f"""
    {{sitscad: 1, name: a, fpc: {{stackup: {stackup}, rules: recommended}}, coil: {{shape: circle,
     outer_diameter: {outer}, turns: {turns}, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}}}
    """)
    (findings,) = findings_of("SIT112", spec)
    missing = findings.limit - findings.measured
    assert 0.0 < missing < most
    larger = replace(spec, coil=replace(spec.coil, size=tuple(size + 1.05 * missing for size in spec.coil.size)))
    assert not any(lack.what is Missing.INNER_ROOM for lack in lay_out(larger).shortfalls)


def test_array_without_lead_room_gives_present_and_needed_gap():
    """The finding said that trials alone can tell."""
    spec = load_text("""
    {sitscad: 1, name: a, fpc: {stackup: flex-4l, rules: generic-fine}, array: {pattern: grid, count: [2, 2],
     pitch: 4.12}, coil: {shape: circle, outer_diameter: 4, turns: 5, layers: 4, trace_width: 0.1, trace_spacing: 0.1}}
    """)
    (findings,) = findings_of("SIT113", spec)
    rules = spec.fpc.rules
    assert findings.measured == approx(0.12e-3, rel=1e-9) and findings.unit == "m"
    assert findings.limit > rules.via_pad + 2.0 * rules.trace_spacing + spec.coil.trace_width
    assert {"lead-room", "lead-room-coils", "lead-room-gap"} & set(findings.cases)


@pytest.mark.parametrize("added", [0.12, 0.2])
def test_single_coil_without_lead_room_gives_needed_body_room(added):
    """Only arrays had a length. A body with the needed room, and a twentieth of a millimetre more, has room."""
    text = """
    {{sitscad: 1, name: a, fpc: {{stackup: flex-4l, rules: generic-fine, tail: {{length: 20, connector: solder-pads}},
     body: {{shape: rectangle, size: [{side}, {side}]}}}}, coil: {{shape: circle, outer_diameter: 5, turns: 2,
     layers: 4, start_angle: 180 deg, trace_width: {width}, trace_spacing: {width}}}}}
    """
    spec = load_text(text.format(side=5.5 + added, width=added))
    (findings,) = findings_of("SIT113", spec)
    assert findings.cases[0] == "lead-room-body" and findings.key == "fpc.body" and findings.unit == "m"
    assert findings.measured == approx((0.25 + added / 2) * 1e-3, rel=1e-6)
    larger = load_text(text.format(side=5.0 + 2.0 * (1e3 * findings.limit + 0.05), width=added))
    assert not any(lack.what is Missing.LEAD_ROOM for lack in lay_out(larger).shortfalls)


def test_layout_shortfall_gives_finding_with_its_message(judge, good):
    spec, layout = good
    text = Shortfall(Missing.TAIL_LAYERS, have=1.0, need=2.0, facts=(("pattern", "grid"),))
    (result,) = judge("SIT118", spec, replace(layout, shortfalls=(text,)))
    assert (result.message, result.measured) == (text.message, 1.0) and result.line is not None


@pytest.mark.parametrize("connector", ["zif-0.5mm", "zif-0.3mm", "solder-pads"])
@pytest.mark.parametrize("web", ["0.15 mm", "0.2 mm", "0.3 mm"])
def test_coverlay_beside_contacts_of_one_coil_has_no_finding(judge, design, connector, web):
    """A plug is open over its whole width and leaves no strip there; beside a solder pad's opening stays the web."""
    changes = {"fpc__rules": {"based_on": "generic-fine", "coverlay_web": web}, "fpc__tail__connector": connector}
    spec = design(array=None, **changes)
    layout, rules = lay_out(spec), spec.fpc.rules
    result = judge("SIT114", spec, layout)
    highest = max(bounding_box([region.outline])[3] for region in layout.top_openings)
    _, edge = layout.reach_at(layout.pads[0].centre.x)
    assert result == []
    if connector == "solder-pads":
        assert edge - highest >= rules.coverlay_web - 1e-9
    else:
        assert highest > edge + rules.coverlay_registration


@pytest.mark.parametrize("connector", ["zif-0.5mm", "zif-0.3mm", "solder-pads"])
@pytest.mark.parametrize(("edge", "count"), [("0.2 mm", 1), ("0.6 mm", 2), ("1 mm", 2)])
def test_tracks_too_near_plug_edge_get_connector_with_room(advised, design, connector, edge, count):
    """A smaller coil mends nothing there. Pads that wires are soldered to have no width of their own and always fit."""

    def board(name):
        rules = {"based_on": "generic-fine", "copper_to_edge": edge}
        array = {"pattern": "line", "count": count, "pitch": 6.5}
        spec = design(fpc__rules=rules, fpc__tail__connector=name, array=array)
        return advised("SIT109", spec, lay_out(spec))

    result = board(connector)
    assert connector != "solder-pads" or result == []
    for finding in result:
        assert finding.key == "fpc.tail.connector" and finding.cases[1].startswith("edge-contacts")
        ((edit,),) = (fix.edits for fix in finding.fixes)
        named = edit.new.strip('"')
        assert named != connector and board(named) == []


def test_narrow_coverlay_web_or_bare_track_gives_finding(judge, good):
    spec, layout = good
    left, right = (Region(rectangle(x, 0.0, x + 1e-3, 1e-3)) for x in (0.0, 1.15e-3))
    web = replace(layout, top_openings=(left, right))
    (result,) = judge("SIT114", spec, web)
    assert result.measured == approx(0.15e-3, rel=1e-6) and result.limit == 0.2e-3
    assert judge("SIT114", spec, replace(layout, top_openings=(left,), bottom_openings=(right,))) == []
    edge = bounding_box([layout.outline])
    beside = Region(rectangle(edge[0] + 0.12e-3, 0.0, edge[0] + 1e-3, 1e-3))
    (result,) = judge("SIT114", spec, replace(layout, bottom_openings=(beside,)))
    assert result.measured == approx(0.12e-3, rel=1e-6) and "bottom" in result.message
    reaching = Region(rectangle(edge[2] - 1e-3, -0.5e-3, edge[2], 0.5e-3))
    assert judge("SIT114", spec, replace(layout, top_openings=(reaching,))) == []
    track = Trace(Path((Line(Point(-1e-3, 1.2e-3), Point(3e-3, 1.2e-3)),)), 100e-6, 1, "C1", Role.TAIL)
    bare = replace(layout, top_openings=(left,), traces=(track,), vias=())
    (result,) = judge("SIT115", spec, bare)
    assert result.measured == approx(0.15e-3, rel=1e-6)
    assert judge("SIT115", spec, replace(bare, traces=(replace(track, layer=2),))) == []
    into = replace(track, path=Path((Line(Point(-1e-3, 0.5e-3), Point(0.5e-3, 0.5e-3)),)))
    assert judge("SIT115", spec, replace(bare, traces=(into,))) == []


def test_small_part_gives_note_or_warning(judge, good):
    spec, layout = good
    small = replace(layout, outline=rectangle(0, 0, 9e-3, 6e-3))
    (result,) = judge("SIT116", spec, small)
    assert (result.measured, result.limit) == (9e-3, 10e-3)
    assert result.severity is Severity.NOTE and result.key == "fpc.rules"
    assert f"fpc/{spec.name}-order.zip" in result.hint
    alone = replace(spec, fpc=replace(spec.fpc, panel=replace(spec.fpc.panel, wish="none")))
    (result,) = judge("SIT116", alone, replace(small, spec=alone))
    assert result.severity is Severity.NOTE and "part-size" in result.cases
    alone = replace(alone, fpc=replace(alone.fpc, rules=replace(alone.fpc.rules, one_process=True)))
    assert judge("SIT116", alone, replace(small, spec=alone))[0].severity is Severity.WARNING
    assert judge("SIT116", spec, replace(layout, outline=rectangle(0, 0, 5e-3, 10e-3))) == []


@pytest.mark.parametrize(("parts", "told"), [("auto", False), ([1, 2], False), ([3, 4], True)])
def test_panel_larger_than_fabricator_limit_gives_finding(judge, design, parts, told):
    spec = design(fpc__panel={"parts": parts})
    result = [f for f in judge("SIT116", spec, lay_out(spec)) if f.key == "fpc.panel"]
    assert bool(result) == told
    assert all(f.measured > f.limit for f in result)


@pytest.mark.parametrize("most", [(0.1, 0.05), (0.05, 0.1)])
@pytest.mark.parametrize(
    ("x", "y", "over"), [(80, 40, 0), (40, 80, 0), (40, 120, 0.12), (60, 60, 0.06), (120, 40, 0.12)]
)
def test_panel_is_compared_longer_side_to_longer_side(judge, design, most, x, y, over):
    """A house's 100 x 50 mm take 40 x 80 mm, too: longer side to longer side. Rails and gaps are 7 mm of each."""
    spec = design(fpc__panel={"parts": [1, 1], "rail": 3, "gap": 0.5})
    spec = replace(spec, fpc=replace(spec.fpc, rules=replace(spec.fpc.rules, panel_size=most)))
    layout = replace(lay_out(spec), outline=rectangle(0, 0, (x - 7) * 1e-3, (y - 7) * 1e-3))
    result = [f for f in judge("SIT116", spec, layout) if f.key == "fpc.panel"]
    assert [f.measured for f in result] == approx([over] if over else [], rel=1e-6)


STRIP = """sitscad: 1
name: strip
coil: {{shape: racetrack, outer_diameter: [14, 3.8], turns: 4.5, layers: 2, trace_width: 155 um, trace_spacing: 155 um}}
fpc:
  stackup: flex-2l-30um
  rules: {rules}
  tail: {{length: {length}, connector: zif-0.5mm, contacts: 4}}
  panel: {panel}
"""


def test_oversized_panel_of_one_board_has_no_hint_of_fewer_parts(judge):
    """A panel of a single board was to have fewer parts, and its largest sides were told the other way round."""
    for panel, is_advised in (("auto", False), ("{parts: [1, 3]}", True)):
        spec = load_text(STRIP.format(rules="generic-flex", length=250, panel=panel), "strip.yaml")
        (result,) = (item for item in judge("SIT116", spec, lay_out(spec)) if item.key == "fpc.panel")
        assert ("fpc.panel.parts" in result.hint) is is_advised
        assert "584.2 mm x 228.6 mm" in result.hint


@pytest.mark.parametrize("length", [100, 250, 400])
@pytest.mark.parametrize("panel", ["auto", "none"])
def test_long_narrow_board_gives_note_and_order_text(judge, length, panel):
    spec = load_text(STRIP.format(rules="generic-flex", length=length, panel=panel), "strip.yaml")
    layout = lay_out(spec)
    result = judge("SIT116", spec, layout)
    assert result and all(item.severity is Severity.NOTE for item in result)
    text = " ".join(order_notes.order_readme(layout, plan(layout)).split())
    assert ("larger than usual: confirm" if panel == "auto" else "in a panel of your own") in text


def test_board_longer_than_largest_panel_gives_warning(judge):
    spec = load_text(STRIP.format(rules="generic-flex", length=400, panel="none"), "strip.yaml")
    layout = replace(lay_out(spec), outline=rectangle(0, 0, 0.6, 6e-3))
    (result,) = judge("SIT116", spec, layout)
    assert result.severity is Severity.WARNING and (result.measured, result.limit) == (0.6, 0.5842)


SMALL_PART = """sitscad: 1
name: small
coil: {{shape: circle, outer_diameter: 4, turns: 5, layers: 1, trace_width: 76 um, trace_spacing: 76 um}}
array: {{pattern: line, count: 1, pitch: 6}}
fpc:
  rules: {{based_on: generic-flex, inside_radius: 0.3, copper_to_edge: 0.15}}
  tail: {{length: 40, connector: zif-0.3mm, bend: dynamic, turn: right}}
  panel: {{bridge: {bridge}, gap: 0.5}}
"""


@pytest.mark.parametrize("bridge", [3, 2.5])
def test_too_wide_panel_bridges_get_largest_width_that_fits(judge, bridge):
    """On this board bridges of 2.5 mm find no place at all; the width named places three, the next wider does not."""

    def found(width):
        spec = load_text(SMALL_PART.format(bridge=width), "small.yaml")
        layout = lay_out(spec)
        return [f for f in judge("SIT116", spec, layout) if f.severity is Severity.ERROR], len(bridges(layout))

    ((error,), count) = found(bridge)
    assert error.key == "fpc.panel.bridge" and (error.measured, error.limit) == (count, 3) and count < 3
    (named,) = re.findall(r"fpc\.panel\.bridge: ([\d.]+);", error.hint)
    assert found(named) == ([], 3)
    assert found(f"{float(named) + 0.1:.1f}")[1] < 3


def test_board_without_room_for_bridges_gives_error_without_fix(judge):
    spec = load_text(SMALL_PART.format(bridge=0.4), "small.yaml")
    tiny = replace(lay_out(spec), outline=rectangle(0, 0, 0.3e-3, 0.3e-3), pads=(), stiffener=None, bend_zone=None)
    (error,) = [f for f in judge("SIT116", spec, tiny) if f.severity is Severity.ERROR]
    assert error.measured == 0 and not error.fixes and "bridges-none" in error.cases


def test_contact_thickness_outside_plug_range_gives_finding(judge, verdicts, good, design):
    spec, layout = good
    lower = (spec.fpc.stackup.layers[0], *(each for each in spec.fpc.stackup.layers[2:] if each.kind == "copper"))
    board = spec.fpc.stackup.thickness - sum(each.thickness for each in lower)  # bare contacts, no other copper there
    assert judge("SIT117", spec, layout) == []
    outline = Region(rectangle(0, 0, 5e-3, 5e-3))

    def stiffened(thickness):
        return replace(layout, stiffener=Stiffener(outline, thickness, "polyimide"))

    assert judge("SIT117", spec, stiffened(0.3e-3 - board)) == []
    (found,) = judge("SIT117", spec, stiffened(0.36e-3 - board))
    assert found.measured == approx(0.36e-3, rel=1e-6) and "insertion-thinner" in found.cases and "60 um" in found.hint
    pads = replace(spec.fpc.tail.connector, insertion_thickness=0.0)
    soldered = replace(spec, fpc=replace(spec.fpc, tail=replace(spec.fpc.tail, connector=pads)))
    assert "plug-unverified" not in found.cases  # Hirose FH12 states both figures
    fine = design(fpc__tail__connector="zif-0.3mm")
    plate = replace(lay_out(fine).stiffener, thickness=0.4e-3)
    (found,) = judge("SIT117", fine, replace(lay_out(fine), stiffener=plate))
    assert found.limit == approx(0.2e-3, rel=1e-6) and "plug-unverified" in found.cases
    assert verdicts("SIT117", soldered, layout)[1][0].case == "solder-pads"


def test_via_in_coverlay_opening_gives_finding(judge, good):
    spec, layout = good
    via = Via(Point(0.5e-3, 0.5e-3), 0.2e-3, 0.45e-3, "C1")
    bare = replace(layout, top_openings=(Region(rectangle(-1e-3, -1e-3, 2e-3, 2e-3)),), traces=(), vias=(via,))
    (result,) = judge("SIT115", spec, bare)
    assert result.measured < 0.0 and "opening-to-track" in result.cases and "C1" in result.message
    assert judge("SIT115", spec, replace(bare, vias=(replace(via, centre=Point(3e-3, 0.5e-3)),))) == []


@pytest.mark.parametrize(("turns", "has_room"), [(10, True), (14, False)])
def test_coil_slightly_below_track_minimum_gets_wider_tracks_if_room(turns, has_room):
    size = f"outer_diameter: 9, turns: {turns}, layers: 2, trace_width: 150 um, trace_spacing: 150 um"
    spec = load_text(f"sitscad: 1\nname: a\ncoil: {{shape: circle, {size}}}\n", "a.yaml")
    findings = [finding for finding in check(spec).findings if finding.rule == "SIT103"]
    wide = [("coil.trace_width", "152.4 um"), ("coil.trace_spacing", "152.4 um")]
    fixes = [[(edit.key, edit.new.strip('"')) for fix in finding.fixes if not fix.new_warnings for edit in fix.edits]
             for finding in findings]
    assert len(fixes) == 2 and all((each == wide) is has_room for each in fixes)


def test_coil_track_waiver_from_hint_clears_finding():
    """A new user asked the fabricator, and did not find where to write the answer."""
    text = "sitscad: 1\nname: a\ncoil: {shape: circle, outer_diameter: 9, turns: 12, layers: 2, %s}\n%s"
    lines = "trace_width: 120 um, trace_spacing: 160 um"
    (findings,) = (f for f in check(load_text(text % (lines, ""), "a.yaml")).findings if f.rule == "SIT103")
    (rules,) = re.findall(r"fpc\.rules: ({based_on: [^}]*})", findings.hint)
    assert "coil_trace_spacing" not in rules
    stated = load_text(text % (lines, f"fpc: {{rules: {rules}}}\n"), "a.yaml")
    assert not [f for f in check(stated).findings if f.rule == "SIT103"]


def test_waiver_for_rules_named_like_preset_preserves_custom_values():
    """The rules to be written in their place were based on the preset, without the user's own figures."""
    lines = "outer_diameter: 9, turns: 12, layers: 2, trace_width: 120 um, trace_spacing: 160 um"
    own = "{name: generic-flex, based_on: generic-flex, copper_to_edge: 0.4 mm}"
    for rules, is_based in (("generic-flex", True), (own, False)):
        text = f"sitscad: 1\nname: a\ncoil: {{shape: circle, {lines}}}\nfpc: {{rules: {rules}}}\n"
        findings = findings_of("SIT103", load_text(text, "a.yaml"))
        assert findings and all(("based_on" in f.hint, "coil_trace_width: 120 um" in f.hint) == (is_based, True)
                             for f in findings)


@pytest.mark.slow
def test_ineffective_wider_tracks_hint_names_failing_rule():
    text = """sitscad: 1
name: a
coil: {shape: circle, outer_diameter: 4, turns: 5.5, layers: 4, trace_width: 0.1, trace_spacing: 0.1}
fpc: {rules: generic-fine}
"""
    findings = [f for f in check(load_text(text, "a.yaml"), hints="full").findings if f.rule == "SIT103"]
    assert findings and all("SIT203" in f.hint and not f.fixes for f in findings)


def test_coil_track_minimum_depends_on_copper_thickness(judge, good):
    result = judge("SIT103", good[0])
    assert [f.limit for f in result] == approx([203.2e-6] * 2, rel=1e-6)
    assert all("35 um" in f.detail and "35 um" in f.source for f in result)
    assert all("based_on" in f.hint and "loop-unbound" in f.cases for f in result)


THICK = """sitscad: 1
name: thick
coil: {{shape: circle, outer_diameter: 12, turns: 8, layers: 2, trace_width: 140 um, trace_spacing: 140 um}}
fpc:
  rules: {{based_on: generic-flex, {written}}}
  stackup:
    - {{coverlay: 27.5 um}}
    - {{copper: 82 um}}
    - {{dielectric: 25 um, material: polyimide}}
    - {{copper: 82 um}}
    - {{coverlay: 27.5 um}}
"""


@pytest.mark.parametrize(("written", "unknown"), [("trace_width", "SIT102"), ("trace_spacing", "SIT101")])
def test_unstated_width_or_spacing_for_thick_copper_gives_finding(judge, written, unknown):
    """What is not written comes from lines for thinner copper: that is told, and not taken as if it held."""
    spec = load_text(THICK.format(written=f"{written}: 120 um"), "thick.yaml")
    known = {"SIT101", "SIT102"} - {unknown}
    assert [judge(rule, spec) for rule in known] == [[]]
    (result,) = judge(unknown, spec)
    assert (result.measured, result.limit) == approx((70e-6, 35e-6), rel=1e-6)


def test_one_custom_coil_minimum_does_not_make_others_binding(judge):
    spec = load_text(THICK.format(written="coil_trace_spacing: 250 um"), "thick.yaml")
    result = {f.key: f for f in judge("SIT103", spec)}
    assert result["coil.trace_spacing"].severity is Severity.ERROR
    assert result["coil.trace_width"].severity is Severity.WARNING
    assert "loop-unbound-base" in result["coil.trace_width"].cases
    both = load_text(THICK.format(written="coil_trace_spacing: 250 um, coil_rule_binding: true"), "thick.yaml")
    assert {f.severity for f in judge("SIT103", both)} == {Severity.ERROR}
