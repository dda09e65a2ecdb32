"""SIT123: what lies in the bend zone, and tails too short for their bend with the length that makes room."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.basics.finding import Missing, Severity
from sitscad.basics.units import show
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.documents.drawings import board_drawing
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.drawing.frame import mm
from sitscad.files.drawing.sheet import Label
from sitscad.kernels.geometry.path import Line, Path, Point, Region, rectangle
from sitscad.layout import lay_out
from sitscad.layout.bending import bend_length, bend_stretch
from sitscad.layout.board import Pad, Role, Trace, Via
from sitscad.spec import templates
from sitscad.spec.load import load_text

UM, MM = 1e-6, 1e-3

TAIL = "length: 30, layers: 2, bend: static"


def spec(tail=TAIL, coil="turns: 12, layers: 2", rest="array: {pattern: line, count: 2, pitch: 8}"):
    return load_text(
        "sitscad: 1\nname: bent\n"
        f"coil: {{shape: circle, outer_diameter: 7, {coil}, trace_width: 100 um, trace_spacing: 100 um}}\n"
        f"fpc: {{stackup: flex-2l-35um, tail: {{{tail}}}}}\n{rest}\n",
        "bent.yaml",
    )


@pytest.fixture(scope="module")
def bench():
    """A board of two coils of two layers with a tail that bends."""
    return lay_out(spec())


def test_tail_with_zero_bend_angle_gives_note_without_limit(advised, bench):
    """The report showed "limit 0 mm" of a tail that only its mount bends."""
    fpc = replace(bench.spec.fpc, tail=replace(bench.spec.fpc.tail, bend_angle=0.0))
    straight = replace(bench.spec, fpc=fpc)
    (note,) = advised("SIT123", straight, replace(bench, spec=straight))
    assert note.severity is Severity.NOTE and note.measured > 0.0 and note.limit is None


def test_via_pad_or_stiffener_in_bend_zone_gives_error(advised, bench):
    (note,) = advised("SIT123", bench.spec, bench)
    start, end = bench.bend_zone
    assert note.severity is Severity.NOTE and start < note.place.x < end
    assert note.measured == approx(end - note.place.x, rel=1e-6) and note.measured > note.limit > 0
    middle = Point((start + end) / 2, 0.0)
    via = replace(bench, vias=(*bench.vias, Via(middle, 0.2 * MM, 0.45 * MM, "C1")))
    result = [f for f in advised("SIT123", bench.spec, via) if f.severity is Severity.ERROR]
    assert [(f.key, f.place.x, f.place.nets) for f in result] == [("fpc.tail.bend", middle.x, ("C1",))]
    pad = replace(bench, pads=(*bench.pads, Pad(middle, (1 * MM, 0.3 * MM), 1, "C2", "C2.A", 9)))
    assert any(f.place.nets == ("C2",) and f.place.layer == 1 for f in advised("SIT123", bench.spec, pad))
    edge = replace(pad, pads=(*bench.pads, replace(pad.pads[-1], centre=Point(end + 0.4 * MM, 0.0))))
    (result,) = [f for f in advised("SIT123", bench.spec, edge) if f.place.nets == ("C2",)]
    assert result.measured == approx(0.1 * MM, rel=1e-6)
    outline = Region(rectangle(end - 0.5 * MM, -1e-3, end + 4e-3, 1e-3))
    plate = replace(bench, stiffener=replace(bench.stiffener, outline=outline))
    (stiff,) = [f for f in advised("SIT123", bench.spec, plate) if f.severity is Severity.ERROR]
    assert "stiff-in-bend" in stiff.cases and "stiffener" in stiff.message
    assert stiff.measured == approx(0.5 * MM, rel=1e-6)


def test_bend_zone_shorter_than_bend_gives_error_with_longer_tail(advised, bench):
    start, _ = bench.bend_zone
    (result,) = advised("SIT123", bench.spec, replace(bench, bend_zone=(start, start + 1.2 * MM)))
    assert result.severity is Severity.ERROR and [edit.key for edit in result.fixes[0].edits] == ["fpc.tail.length"]


def test_bend_zone_with_too_short_straight_stretch_gives_warning(advised, bench):
    needed, (start, _) = bend_length(bench.spec.fpc), bench.bend_zone
    (result,) = advised("SIT123", bench.spec, replace(bench, bend_zone=(start, start + 1.01 * needed)))
    assert result.severity is Severity.WARNING and result.measured < result.limit == needed


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_bend_position_passes_only_within_range_in_hint(advised, kind):
    def misplaced(at):
        here = spec(f"length: 40, layers: 2, bend: {{kind: {kind}, at: {at:.2f}}}")
        result = [f for f in advised("SIT123", here, lay_out(here)) if f.key == "fpc.tail.bend.at"]
        return result[0] if result and result[0].severity is not Severity.NOTE else None

    low, high = map(float, re.search(r"between ([\d.]+) mm and ([\d.]+) mm", misplaced(200.0).hint).groups())
    assert misplaced(low + 0.05) is misplaced(high - 0.05) is None
    assert misplaced(low - 0.3) and misplaced(high + 0.3)


def short(advised, changed):
    """The finding of a tail too short for its bend, if any."""
    result = [f for f in advised("SIT123", changed, lay_out(changed)) if f.severity is not Severity.NOTE]
    assert len(result) <= 1 and all(f.measured < f.limit for f in result)
    return result[0] if result else None


SHORT_TAILS = {
    "no room at all": ("length: 1, bend: dynamic, layers: 2", "turns: 8, layers: 2", ""),
    "some room": ("length: 8, bend: dynamic, layers: 2", "turns: 8, layers: 2", ""),
    "almost enough": ("length: 17, bend: dynamic, layers: 2", "turns: 8, layers: 2", ""),
    "turned": ("length: 1, bend: dynamic, layers: 2, turn: left", "turns: 8, layers: 2", ""),
    "turned widely": ("length: 12, bend: dynamic, layers: 2, turn: right, turn_radius: 6", "turns: 8, layers: 2", ""),
    "aside": ("length: 25, bend: dynamic, layers: 2, offset: 5", "turns: 8, layers: 2", ""),
    "one layer": ("length: 10, bend: dynamic, layers: 1", "turns: 8, layers: 2", ""),
    "pads": ("length: 3, bend: static, layers: 2, connector: solder-pads", "turns: 8, layers: 2", ""),
    "tracks that come together": ("length: 14, bend: dynamic, layers: 2, connector: zif-0.3mm", "turns: 8, layers: 2",
                                  "array: {pattern: line, count: 3, pitch: 8.6}"),
    "capacitors": ("length: 12, bend: static, layers: 2", "turns: 8, layers: 2",
                   "array: {pattern: line, count: 2, pitch: 8}\nreadout: {capacitors_on_board: chip-0402}"),
}


@pytest.mark.parametrize(("tail", "coil", "rest"), SHORT_TAILS.values(), ids=SHORT_TAILS)
def test_too_short_tail_gets_shortest_length_that_fits_bend(advised, judge, tail, coil, rest):
    """Told with the length; laid out again with it the finding is gone, and half a millimetre less brings it back."""
    result = short(advised, spec(tail, coil, rest))
    ((edit,),) = (fix.edits for fix in result.fixes)
    named = edit.new

    def of_length(length):
        return spec(re.sub(r"length: \d+", f"length: {length}", tail, count=1), coil, rest)

    assert short(judge, of_length(named)) is None
    assert short(judge, of_length(float(named) - 0.5)) is not None


def test_tail_long_enough_for_bend_gives_no_finding(advised):
    assert short(advised, spec("length: 19, bend: dynamic, layers: 2", "turns: 8, layers: 2", "")) is None


def test_bend_longer_than_any_tail_gives_error_without_fix(advised, bench):
    """A fabricator who asks a thousand times the thickness, of a tail that is thick: there is no such tail."""
    rules = replace(bench.spec.fpc.rules, static_bend_ratio={2: 30_000.0})
    far = replace(bench.spec, fpc=replace(bench.spec.fpc, rules=rules))
    (result,) = advised("SIT123", far, bench)
    assert result.severity is Severity.ERROR and not result.fixes


def test_no_bend_room_without_stated_radius_gives_error(advised):
    here = spec("length: 1, bend: dynamic, layers: 2", "turns: 8, layers: 2", "")
    silent = replace(here, fpc=replace(here.fpc, rules=replace(here.fpc.rules, dynamic_bend_ratio={})))
    (result,) = advised("SIT123", silent, lay_out(silent))
    assert result.severity is Severity.ERROR and result.measured == result.limit == 0.0 and result.fixes
    assert "bend-room-unknown" in result.cases


GRID = "array: {pattern: grid, count: [2, 2], pitch: 8}"


@pytest.mark.parametrize("rest", [GRID, "array: {pattern: line, count: 2, pitch: 8}"])
def test_order_notes_and_drawings_give_bend_zone_of_check(advised, rest):
    """Notes, both drawings and the KiCad board name the stretch of straight tracks, not all that is free of vias."""
    here = spec("length: 30, bend: static", "turns: 8, layers: 2", rest)
    layout = lay_out(here)
    (note,) = advised("SIT123", here, layout)
    start, end = bend_stretch(layout)
    assert note.severity is Severity.NOTE and show(start, "m", 4) in note.message
    assert start == note.place.x > layout.bend_zone[0] and end - start == approx(note.measured, rel=1e-6)
    text = f"between x = {show(start, 'm')} and x = {show(end, 'm')}"
    board, stackup = board_drawing.board_sheet(layout, ""), stackup_drawing.stackup_sheet(layout, "")
    for words in (fabrication_notes.order_readme(layout), words_of(board), words_of(stackup)):
        assert text in " ".join(words.split())
        assert show(layout.bend_zone[0], "m") not in words
    assert mm(start) in words_of(board) and mm(layout.bend_zone[0]) not in words_of(board)


def words_of(sheet):
    return " ".join(item.text for item in sheet.items if isinstance(item, Label))


def test_tail_without_straight_stretch_has_do_not_bend_note(bench):
    """One track askew along all of a short bend zone: the papers say so in place of a stretch of no length."""
    x = bench.bend_zone[0] + 5 * MM
    askew = Trace(Path((Line(Point(x - 1 * MM, 0.0), Point(x + 2 * MM, 1 * MM)),)), 0.1 * MM, 1, "C1", Role.TAIL)
    crooked = replace(bench, bend_zone=(x, x + 1 * MM), traces=(*bench.traces, askew))
    assert bend_stretch(replace(crooked, traces=bench.traces)) == crooked.bend_zone
    assert bend_stretch(crooked) is None
    assert "do not bend it" in fabrication_notes.order_readme(crooked)
    assert "bend zone" not in words_of(board_drawing.board_sheet(crooked, ""))


def test_longer_tail_is_not_tried_if_leads_lack_room(advised, monkeypatch):
    """The search for leads that fails is long, and no length of the tail changes it: it is not repeated."""

    crowded = spec("length: 6, layers: 2, bend: static", rest="array: {pattern: line, count: 3, pitch: 7.1}")
    layout = lay_out(crowded)
    assert {lack.what for lack in layout.shortfalls} == {Missing.LEAD_ROOM}
    tried = []
    monkeypatch.setattr("sitscad.estimates.design.arrange", lambda *given, **named: tried.append(given) or layout)
    (findings,) = [finding for finding in advised("SIT123", crowded, layout) if finding.key == "fpc.tail.length"]
    assert not findings.fixes and tried == []


@pytest.mark.slow
def test_tail_offset_without_bend_room_gives_error_with_sufficient_length(advised):
    """The tail's way aside, its capacitors and its stiffener leave less than the bend of a tail this thick takes."""
    text = templates.read("three_axis_grid").replace("    bend: static", "    bend: static\n    offset: -5")
    text = re.sub(r"^  capacitor_at: .*\n", "  capacitors_on_board: chip-0402\n", text, flags=re.MULTILINE)
    aside = load_text(text, "aside.yaml")
    layout = lay_out(aside)
    (result,) = [each for each in advised("SIT123", aside, layout) if each.severity is Severity.ERROR]
    begin, end = layout.bend_zone
    assert result.key == "fpc.tail.length" and end - begin < bend_length(aside.fpc) == approx(result.limit, abs=0)
    (edit,) = result.fixes[0].edits
    longer = aside.replace(edit.key, float(edit.new) * MM)
    assert all(each.severity is not Severity.ERROR for each in advised("SIT123", longer, lay_out(longer)))
