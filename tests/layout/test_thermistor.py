"""A thermistor that is soldered to the board: its place, its tracks and contacts, and the rules SIT139 and SIT338."""

from __future__ import annotations

import csv
import io
import re
from itertools import pairwise
from pathlib import Path

import pytest
from rule_examples import right_text, wrong_text
from tolerance import approx

import sitscad
from sitscad.assembly.solids.tooling import jig_frames, thermistor_pocket
from sitscad.files.documents import parts_list
from sitscad.files.formats import gerber, ipc356
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.gaps import copper_of, too_near
from sitscad.layout.tail.chips import ThermistorSpot
from sitscad.layout.tail.tracks import contacts
from sitscad.spec.reading import SpecError

TEMPLATES = Path(__file__).parents[2] / "templates"
SMALL, LARGE, DIGITAL = "ncp15xh103f03rc", "ncp18xh103f03rb", "tmp117"

BARE = """sitscad: 1
name: bare
coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
readout: {}
"""


def text_of(template, part=SMALL, place="board"):
    text = BARE if template == "bare" else (TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")
    sensor = f"{{part: {part}, at: {place}}}"
    if template == "bare":
        return text.replace("readout: {}", f"readout: {{thermistor: {sensor}}}")
    return text.replace("\nreadout:\n", f"\nreadout:\n  thermistor: {sensor}\n", 1)


def board(*case):
    return sitscad.lay_out(sitscad.load_text(text_of(*case), "board.yaml"))


CASES = [
    ("square_bench", LARGE, "board", ThermistorSpot.LEADS),  # two coils in line
    ("jaw_5x20", SMALL, "board", ThermistorSpot.LEADS),  # one coil
    ("fingertip_foil", SMALL, "board", ThermistorSpot.LEADS),
    ("bare", SMALL, "board", ThermistorSpot.LEADS),  # no tail: solder pads
    ("skin_strip_6", SMALL, "board", ThermistorSpot.LEADS),  # lanes on both sides
    ("three_axis_triangle", LARGE, "board", ThermistorSpot.CORNER),
    ("round_button_12mm", SMALL, "board", ThermistorSpot.ROOT),  # a body with a given outline
    ("grasper_4layer", LARGE, "tail", ThermistorSpot.STIFFENER),
    ("racetrack_jaw", SMALL, "tail", ThermistorSpot.STIFFENER),
]


@pytest.mark.parametrize("case", CASES, ids=[f"{template}-{spot}" for template, _, _, spot in CASES])
def test_thermistor_is_wired_to_two_contacts_with_all_clearances(case):
    *chosen, spot = case
    layout = board(*chosen)
    sensor, chip = layout.thermistor, layout.spec.soldered_thermistor.part.chip
    assert layout.shortfalls == () and sensor.nets == layout.nets[len(layout.coils) :]
    first, second = sensor.pads
    assert first.centre.distance(second.centre) == approx(chip.pitch, rel=1e-6)
    for pad, net in zip(sensor.pads, sensor.nets, strict=True):
        ways = [trace.path for trace in layout.traces if trace.net == net]
        (contact,) = (item for item in layout.pads if item.net == net)
        assert ways[0].start.distance(pad.centre) < 1e-9 and contact.holds(ways[-1].end)
        assert all(a.end.distance(b.start) < 1e-9 for a, b in pairwise(ways))
        assert sum(_inside(pad.centre, region.outline) for region in layout.top_openings) == 1
    used = [row for row in contacts(layout) if row.pin != "unused"]
    assert len(used) == 2 * len(layout.coils) + 2
    assert {row.converter_pin for row in used if row.converter == "controller"} == {"TEMP", "GND"}
    rules = layout.spec.fpc.rules
    near = [pair for pair in too_near(copper_of(layout), rules.trace_spacing, layout.spec.coil.trace_spacing)]
    assert [pair for pair in near if set(pair.nets) & set(sensor.nets)] == []
    x0, _, x1, _ = bounding_box([layout.stiffener.outline.outline]) if layout.stiffener else (1.0, 0.0, 1.0, 0.0)
    on_stiffener = all(x0 < pad.centre.x < x1 for pad in sensor.pads)
    assert on_stiffener == (spot is ThermistorSpot.STIFFENER)
    if spot in (ThermistorSpot.LEADS, ThermistorSpot.CORNER):
        assert all(pad.centre.x + chip.pad_along / 2 < layout.body[2] for pad in sensor.pads)


def _inside(point, outline):
    x0, y0, x1, y1 = bounding_box([outline])
    return x0 < point.x < x1 and y0 < point.y < y1


@pytest.mark.parametrize("part", [DIGITAL, "ntcle100e3103"])
def test_sensor_with_wires_of_its_own_leaves_board_unchanged(part):
    with_sensor, without = board("square_bench", part), sitscad.lay_out(sitscad.load(TEMPLATES / "square_bench.yaml"))
    assert with_sensor.thermistor is None and with_sensor.pads == without.pads
    assert with_sensor.traces == without.traces and with_sensor.outline == without.outline


def test_thermistor_without_room_is_reported_with_gap_and_need():
    """A board for a coil of 1.6 mm has no room for a chip beside the leads."""
    text = wrong_text("SIT139")
    spec = sitscad.load_text(text, "narrow.yaml")
    layout = sitscad.lay_out(spec)
    (lack,) = layout.shortfalls
    assert layout.thermistor is None and lack.have < lack.need
    (finding,) = (f for f in sitscad.check(spec, layout).findings if f.rule == "SIT139")
    assert (finding.key, finding.measured, finding.limit) == ("readout.thermistor.at", lack.have, lack.need)
    assert sitscad.lay_out(sitscad.load_text(right_text("SIT139"))).shortfalls == ()


def test_high_thermistor_in_jaw_is_an_error_and_lower_part_passes():
    spec = sitscad.load_text(text_of("grasper_4layer", LARGE), "jaw.yaml")
    (finding,) = (f for f in sitscad.check(spec, hints="none").findings if f.rule == "SIT338")
    assert (finding.severity, finding.key) == ("error", "readout.thermistor.part")
    assert finding.measured == approx(spec.readout.thermistor.part.height, rel=1e-9) and finding.limit < 0.8e-3
    lower = sitscad.load_text(text_of("grasper_4layer", SMALL), "jaw.yaml")
    assert lower.readout.thermistor.part.height < finding.limit


@pytest.mark.parametrize("connector", ["solder-pads", None])
def test_thermistor_on_tail_needs_a_stiffener(connector):
    text = text_of("square_bench", SMALL, "tail")
    line = "  tail: {length: 30, connector: zif-0.5mm, layers: 2}\n"
    assert line in text
    text = text.replace(line, line.replace("zif-0.5mm", connector) if connector else "")
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(text)
    assert {f.key for f in caught.value.findings} == {"readout.thermistor.at"}


def test_files_have_thermistor_with_pads_contacts_and_divider():
    layout = board("square_bench", LARGE)
    top = next(text for name, text in gerber.render(layout).items() if name.endswith("F_Cu.gbr")).decode()
    netlist = next(iter(ipc356.render(layout).values())).decode()
    for number, net in ((1, "TH1A"), (2, "TH1B")):
        assert f"%TO.P,TH1,{number},TH1.{number}*%" in top
        assert len(re.findall(rf"^327{net} ", netlist, re.MULTILINE)) == 2
    (table,) = parts_list.render_placement(layout, None).values()
    (row,) = csv.DictReader(io.StringIO(table.decode()))
    assert (row["Ref"], row["Val"], row["Package"]) == ("TH1", "Murata NCP18XH103F03RB", "chip-0603")
    assert (float(row["PosX"]), float(row["PosY"])) == approx([1e3 * c for c in layout.thermistor.centre], abs=1e-4)


def test_jig_frames_have_a_pocket_over_thermistor_on_body():
    layout = board("square_bench", LARGE)
    outline, height = thermistor_pocket(layout.thermistor, layout.spec.soldered_thermistor)
    x0, y0, x1, y1 = bounding_box([outline])
    u0, v0, u1, v1 = layout.thermistor.box
    assert x0 < u0 and y0 < v0 and u1 < x1 and v1 < y1
    assert height > layout.spec.readout.thermistor.part.height
    frames = jig_frames(layout)
    assert len(frames) == 2 and all((outline, 0.0, height) in frame.cuts for frame in frames)
    tail = board("square_bench", LARGE, "tail")
    assert thermistor_pocket(tail.thermistor, tail.spec.soldered_thermistor) is None
