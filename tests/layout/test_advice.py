"""Findings about room: what they advise was tried, so that a board changed by it is routed."""

import math
import random
import re
from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.basics.finding import Edit, Missing
from sitscad.checks.board import room as room_rules
from sitscad.checks.fixes import moves as room
from sitscad.checks.fixes.search import GROWTH, Budget, FamilyByAmount, Fix, RemainingProblems, search
from sitscad.checks.judging import RULES
from sitscad.checks.rules import rule_outcomes
from sitscad.checks.trials import Trials
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Point, polyline
from sitscad.layout import _attempt, arrange, lay_out
from sitscad.layout.clearance import Breadth, Obstacles, TrackToPlace, ViaToPlace
from sitscad.layout.routing.escape import BUDGET, SearchLimit, _BranchSearch
from sitscad.spec import presets
from sitscad.spec.load import load_text


def advised(spec, hints="full"):
    """What the rules of room say of a spec, with hints that only they were tried for."""
    subject, rules = Design(spec), [rule for rule in RULES if rule.id in ("SIT112", "SIT113", "SIT118", "SIT119")]
    message = [outcome for rule in rules for outcome in rule_outcomes(rule, subject)[0]]
    return Trials(subject, rules, message, (), Budget.of(hints)).advised()


def value(finding, key):
    """The value (mm) that a finding's fixes give to a key."""
    return next(float(edit.new) for fix in finding.fixes for edit in fix.edits if edit.key == key)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize(("layers", "turns"), [(2, 11.75), (4, 11.0), (6, 10.25)])
def test_inner_via_without_room_suggests_sufficient_diameter(sensor, layers, turns):
    spec = sensor(layers=layers, turns=turns, stackup="flex-4l" if layers <= 4 else "flex-6l")
    (finding,) = advised(spec)
    more = 1e-3 * value(finding, "coil.outer_diameter") - spec.coil.size[0]
    assert finding.rule == "SIT112" and more > 0.0
    assert not [s for s in lay_out(room.larger_coils(spec, more).spec).shortfalls if s.what is Missing.INNER_ROOM]


@pytest.mark.more
@pytest.mark.slow
def test_leads_without_room_suggest_sufficient_pitch(sensor):
    spec = sensor(pitch=4.09e-3, coils=3)
    (finding,) = advised(spec)
    assert finding.rule == "SIT113" and finding.key == "array.pitch"
    more = 1e-3 * value(finding, "array.pitch") - 4.09e-3
    assert lay_out(room.coils_farther_apart(spec, more).spec).shortfalls == ()


@pytest.mark.slow
def test_explicit_centres_scaled_by_suggested_factor_have_room(sensor):
    spec = sensor(centres=[(-2.05e-3, 0.0), (2.05e-3, 0.0), (6.15e-3, 0.0)], coils=3)
    spec = replace(spec, array=replace(spec.array, pattern="explicit", pitch=None))
    (finding,) = advised(spec)
    factor = float(re.search(r"centres ([\d.]+) times", finding.hint).group(1))
    near = room.nearest_distance(spec.array.placements)
    assert finding.key == "array.centres"
    assert lay_out(room.coils_farther_apart(spec, (factor - 1.0) * near).spec).shortfalls == ()


@pytest.mark.slow
def test_close_contacts_suggest_connector_with_room(sensor):
    spec = sensor(
        coils=4, rules="osh-park-flex", width=160e-6, spacing=100e-6, turns=3.75, layers=2, stackup="flex-2l-18um"
    )
    tail = replace(spec.fpc.tail, connector=presets.connector("zif-0.3mm"))
    spec = replace(spec, fpc=replace(spec.fpc, tail=tail))
    (finding,) = advised(spec)
    name = finding.fixes[0].edits[0].new
    assert finding.rule == "SIT119" and presets.connector(name).pitch > tail.connector.pitch
    assert (
        lay_out(replace(spec, fpc=replace(spec.fpc, tail=replace(tail, connector=presets.connector(name))))).shortfalls
        == ()
    )


def test_full_hint_search_finds_nearly_smallest_sufficient_amount():
    request = []

    def trial(fix):
        request.append(fix.spec)
        return RemainingProblems() if fix.spec >= 0.73e-3 else RemainingProblems(("SIT113",))

    family = FamilyByAmount(lambda amount: Fix((Edit("array.pitch", f"{amount}"),), amount), 0.2e-3)
    (result, _), = search([family], trial, Budget.of("full")).mending
    assert result.spec == min(amount for amount in request if amount >= 0.73e-3)
    assert result.spec - max(amount for amount in request if amount < 0.73e-3) < 0.03e-3
    (first, _), = search([family], trial, Budget.of("decisive")).mending
    assert first.spec == approx(0.2e-3 * GROWTH**3, rel=0.02)
    assert search([family], lambda _: RemainingProblems(("SIT113",)), Budget.of("full")).mending == ()


@pytest.mark.more
@pytest.mark.slow
def test_grid_slightly_too_dense_suggests_smallest_sufficient_pitch(sensor):
    """Four coils in a grid that are led out 0.1 mm farther apart: what was tried first is six times that."""
    text = (
        "sitscad: 1\nname: grid\narray: {pattern: grid, count: [2, 2], pitch: 7.3}\nfpc: {tail: {length: 30}}\n"
        "coil: {shape: circle, outer_diameter: 7, turns: 9, layers: 2, trace_width: 0.1524, trace_spacing: 0.1524}"
    )
    (finding,) = advised(load_text(text))
    assert finding.rule == "SIT113" and value(finding, "array.pitch") < 7.3 + 0.12


GRID_IN_A_BODY = """
sitscad: 1
name: tip
coil: {shape: circle, outer_diameter: 5.5, turns: 5, layers: 4, trace_width: 153 um, trace_spacing: 153 um}
array: {pattern: grid, count: [2, 2]}
fpc: {body: {shape: rounded, size: 14, corner_radius: 2}, tail: {length: 50, connector: zif-0.5mm}}
"""


@pytest.mark.more
@pytest.mark.slow
def test_given_body_suggests_start_angle_before_larger_body():
    """Another start angle lets the leads out; the search named a larger body alone, which the largest outline bars."""
    (finding,) = advised(load_text(GRID_IN_A_BODY, "tip.yaml"))
    assert [fix.edits[0].key for fix in finding.fixes] == ["coil.start_angle", "fpc.body.size"]
    turned = f"start_angle: {finding.fixes[0].edits[0].new}"
    assert lay_out(load_text(GRID_IN_A_BODY.replace("layers: 4", f"layers: 4, {turned}"), "tip.yaml")).shortfalls == ()


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["inner room", "between coils", "in a body"])
def test_hint_search_does_not_change_finding_message_or_place(kind, sensor):
    """Line and message of a lack of room were others with hints: annotations moved, baselines did not match."""
    spec = {
        "inner room": lambda: sensor(layers=2, turns=11.75),
        "between coils": lambda: sensor(pitch=4.09e-3, coils=3),
        "in a body": lambda: load_text(GRID_IN_A_BODY, "tip.yaml"),
    }[kind]()
    result, plain = ([replace(each, hint="", fixes=()) for each in advised(spec, how)] for how in ("decisive", "none"))
    assert result == plain and plain


def test_polygon_start_angles_are_corner_angles(sensor):
    tried = [fix.spec.coil.start_angle for fix in room.other_start_angles(sensor(shape="hexagon"))]
    assert tried == approx([k * math.pi / 3 for k in range(1, 6)], rel=1e-6)


@pytest.mark.slow
def test_leads_of_coil_with_stub_at_corner_are_routed(sensor):
    """Six layers whose ends stand at 45, -45 and -135 degrees: at the corner a stub is in the pair's way."""
    spec = sensor(diameter=9.62e-3, turns=5.875, layers=6, width=120e-6, spacing=100e-6, coils=4, pitch=11.1e-3,
                  stackup="flex-6l", rules="generic-flex", tail=False, start_angle=math.pi / 4)
    assert lay_out(spec).shortfalls == ()


def test_exhausted_search_limit_reports_missing_lead_room(sensor):
    result = _attempt(sensor().artwork, SearchLimit(0))
    assert result.routing is None and [lack.what for lack in result.shortfalls] == [Missing.LEAD_ROOM]


def test_layout_with_shortfall_is_attempted_once_without_hints(sensor, monkeypatch):
    """The verdict does not wait for hints: what a finding says of the board as it stands costs one attempt."""
    tried = []
    monkeypatch.setattr("sitscad.layout._attempt", lambda *given: tried.append(given) or _attempt(*given))
    assert lay_out(sensor(pitch=4.09e-3, coils=3)).shortfalls and len(tried) == 1


def test_exit_blocked_by_other_coil_costs_few_search_trials():
    """All ways of a coil to each of its exits were tried, though none of them passed the track of the other coil."""
    searches = SearchLimit()
    text = (
        "sitscad: 1\nname: narrow\narray: {pattern: line, count: 2, pitch: 4.47}\n"
        "coil: {shape: square, outer_diameter: 3.97, turns: 4.75, layers: 4, trace_width: 120 um,"
        " trace_spacing: 76 um, start_angle: 45 deg}\n"
        "fpc: {rules: huayue, tail: {length: 30, connector: zif-0.3mm, layers: 1}}"
    )
    assert _attempt(load_text(text).artwork, searches).routing is None
    assert searches.left > BUDGET - 100


CLOSED = """
sitscad: 1
name: closed
coil: {shape: hexagon, outer_diameter: 3.0, turns: 3.6666666666666665, layers: 8,
       trace_width: 100 um, trace_spacing: 76 um, corner_radius: 0.5}
array: {pattern: line, count: 3, pitch: 5.0}
fpc: {rules: shipco, tail: {length: 60, connector: zif-0.5mm, layers: 2, bend: none}}
"""


@pytest.mark.slow
def test_skipping_blocked_ring_pieces_saves_trials_with_equal_escapes(monkeypatch):
    """Leads were tried round the whole coil though the track of another one lay across their road."""
    spec = load_text(CLOSED, "closed.yaml")
    proved, tried = SearchLimit(), SearchLimit()
    result = _attempt(spec.artwork, proved)
    monkeypatch.setattr(_BranchSearch, "_runs_into", lambda *_: False)
    other = _attempt(spec.artwork, tried)
    assert result.routing is not None and result.routing.escapes == other.routing.escapes
    assert BUDGET - proved.left < 0.75 * (BUDGET - tried.left)


def test_admission_of_many_tracks_equals_single_admissions(sensor):
    rules, pick = sensor().fpc.rules, random.Random(7)

    def track(layer=1):
        x, y = pick.uniform(0, 5e-3), pick.uniform(0, 5e-3)
        points = [Point(x + pick.uniform(0, 1e-3), y + pick.uniform(0, 1e-3)) for _ in range(pick.randint(2, 4))]
        return TrackToPlace(polyline(points), 0.1e-3, layer)

    board = Obstacles(rules, 0.1e-3, Breadth(0.2e-3, 4.9e-3))
    board.add([track() for _ in range(2)], [ViaToPlace(Point(1e-3, 4e-3), 0.4e-3, 0.2e-3)])
    request = [track() for _ in range(200)]
    result = board.admits_each(request).tolist()
    assert result == [board.admits([item]) for item in request]
    assert 10 < sum(result) < 190
    assert board.admits_each([track(layer=2)]).size == 1


CROWDED = """
sitscad: 1
name: tip
coil: {shape: circle, outer_diameter: 3.6, turns: 7.5, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: grid, count: [2, 2], pitch: 4.0}
fpc: {stackup: flex-4l, rules: generic-fine, body: {shape: circle, size: 10}, tail: {length: 40}}
"""


def test_unroutable_coil_in_given_body_is_named_and_pitch_suggested_first():
    """The hint named a body larger than the user's own; the coils 0.1 mm farther apart were enough and not tried."""
    design = Design(load_text(CROWDED))
    (lack,) = design.layout.shortfalls
    assert lack.what is Missing.LEAD_ROOM and set(dict(lack.facts)["coils"]) <= {"C1", "C2", "C3", "C4"}
    assert dict(lack.facts)["coils"][0] in lack.message
    families = room_rules._changes_for_room(design.spec, lack)
    first, last = next(iter(families[0]())), next(iter(families[-1]()))
    assert [edit.key for edit in first.edits] == ["array.pitch"] and last.edits[0].key == "fpc.body"
    assert not lay_out(first.spec).shortfalls


def test_insufficient_outline_is_not_suggested_as_body():
    """The hint proposed an edit and said in the same sentence that it fails."""
    small = CROWDED.replace("body: {shape: circle, size: 10}", "largest: {shape: circle, size: 9.4}")
    spec = load_text(small)
    assert arrange(room_rules._with_largest_body(spec, spec.fpc.largest).spec).shortfalls
    roomy = load_text(CROWDED.replace("body: {shape: circle, size: 10}", "largest: {shape: circle, size: 16}"))
    assert not arrange(room_rules._with_largest_body(roomy, roomy.fpc.largest).spec).shortfalls
