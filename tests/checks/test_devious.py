"""Specs that a careless or devious hand would write: what each is told, or why it passes.

A row is a base, the keys that are changed, and the rules that have to speak with their severity; or, in words, why
nothing new is said. Only those rules are applied, so that a row costs what they need; rows that pass are checked whole.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES, check
from sitscad.checks.rules import apply_rule
from sitscad.checks.usual_ranges import COMPUTED_VALUES, usual_ranges
from sitscad.estimates.design import Design
from sitscad.package.inspection import inspect
from sitscad.spec import presets
from sitscad.spec.load import load, rewritten_spec
from sitscad.spec.reading import SpecError

TEMPLATES = Path(__file__).parents[2] / "templates"
BASES = {
    "B": "bench_7mm", "G": "grasper_4layer", "S": "single_coil", "F": "fingertip_foil", "R": "racetrack_jaw",
    "T": "three_axis_grid", "J": "jaw_5x20",
}

FILM, COPPER, CORE = {"coverlay": "27.5 um"}, {"copper": "35 um"}, {"dielectric": "25 um"}
JAW = {"width": 5, "length": 20, "height": 1.3, "port_diameter": 6}
RUBBER = {"name": "x", "shear_modulus": "21 kPa"}


def rules(**figures):
    return {"fpc.rules": {"name": "my shop", **figures}}


def layers(*films):
    return {"fpc.stackup": list(films)}


def bend(**keys):
    return {"fpc.tail.bend": {"kind": "static", **keys}}


def jaw(**keys):
    return {"mount.jaw": {**JAW, **keys}}


def rubber(**keys):
    return {"elastomer.material": {**RUBBER, **keys}}


TOLD = [
    # The coil and where it stands.
    ("B", {"coil.trace_width": 3, "coil.turns": 0.5, "coil.outer_diameter": 40, "array.pitch": 50}, "SIT134 SIT201!"),
    ("B", {"coil.trace_spacing": 1.5, "coil.turns": 2, "array.pitch": 12}, "SIT134"),
    ("S", {"coil.outer_diameter": 500}, "SIT134"),
    ("S", {"coil.turns": 0.25, "coil.layers": 1}, "SIT201! SIT202!"),
    ("B", {"array.pitch": 30}, "SIT215!"),
    ("B", {"array.pitch": 400}, "SIT134 SIT215!"),
    # Full load is judged where no force is required.
    ("B", {"array.pitch": 30, "requirements": None}, "SIT215!"),
    ("B", {"elastomer.thickness": 0.001, "requirements": None, "fpc.stackup": "flex-2l-18um"}, "SIT134 SIT215!"),
    ("B", {"elastomer.thickness": 100, "requirements": {"shear_force": "0.5 N"}}, "SIT134 SIT215!"),
    ("B", {"array": {"centres": [[-8, -30], [-8, 30]]}, "requirements": None}, "SIT215!"),
    # The board and its tail.
    ("S", {"fpc.margin": 100}, "SIT134"),
    ("B", {"fpc.tail.length": 1}, "SIT133 SIT123!"),
    ("B", {"fpc.tail.length": 5}, "SIT133"),
    ("B", {"fpc.tail.length": 10, "fpc.tail.offset": 5}, "SIT133"),
    ("B", {"fpc.tail.length": 5, "fpc.tail.turn": "left", "fpc.tail.bend": "none"}, "SIT133"),
    ("B", {"fpc.tail.length": 500}, "SIT134"),
    ("S", {"fpc": {"tail": {"length": 800}}}, "SIT134"),
    ("B", {"fpc.tail.offset": 500}, "SIT134 SIT123!"),
    ("B", {"fpc.tail.turn": "left", "fpc.tail.turn_radius": 100, "fpc.tail.length": 250}, "SIT134"),
    ("B", {"fpc.tail.contacts": 200}, "SIT127"),
    ("B", {"fpc.tail.stiffener": "10 um"}, "SIT134 SIT117!"),
    ("B", {"fpc.tail.stiffener": 2}, "SIT134 SIT117!"),
    ("B", bend(angle="180 deg", radius=100), "SIT134 SIT123!"),
    ("B", bend(angle="180 deg", radius=30), "SIT123!"),
    ("B", bend(at=200), "SIT123!"),
    ("B", bend(at=2), "SIT123!"),
    ("B", bend(radius=0.1), "SIT123"),
    ("B", {"fpc.tail.bend": "dynamic", "fpc.copper": "electrodeposited"}, "SIT308"),
    ("B", {"fpc.tail.bend": "dynamic", "fpc.copper": "electrodeposited", "fpc.tail.layers": 1}, "SIT308"),
    ("B", {"fpc.finish": "osp"}, "SIT128"),
    ("B", {"fpc.panel": {"parts": [20, 20]}}, "SIT116"),
    # Its layers.
    ("B", layers(COPPER, CORE, COPPER), "SIT115!"),
    ("B", {**layers(COPPER, CORE, COPPER), "elastomer": None}, "SIT115! SIT313"),
    ("B", layers(COPPER, CORE, COPPER, FILM), "SIT115!"),
    ("B", layers(FILM, COPPER, CORE, COPPER), "SIT115!"),
    ("B", layers(CORE, COPPER, CORE, COPPER, CORE), "SIT115!"),
    ("B", layers({"coverlay": "1 um"}, COPPER, CORE, COPPER, {"coverlay": "1 um"}), "SIT134"),
    ("B", layers({"coverlay": "2 mm"}, COPPER, CORE, COPPER, {"coverlay": "2 mm"}), "SIT134"),
    ("B", layers(FILM, COPPER, {"dielectric": "1 um"}, COPPER, FILM), "SIT134"),
    ("B", layers(FILM, COPPER, {"dielectric": "5 mm"}, COPPER, FILM), "SIT134"),
    ("B", layers(FILM, COPPER, {"dielectric": "25 um", "permittivity": 100}, COPPER, FILM), "SIT134"),
    ("B", layers(FILM, {"copper": "1 um"}, CORE, {"copper": "1 um"}, FILM), "SIT134"),
    ("B", layers(FILM, {"copper": "1 mm"}, CORE, {"copper": "1 mm"}, FILM), "SIT134 SIT101!"),
    ("B", {**layers(FILM, {"copper": "12.5 um"}, CORE, {"copper": "12.5 um"}, FILM), "fpc.plating": "12 um"}, "SIT134"),
    ("B", {**layers(FILM, COPPER, CORE, COPPER, FILM), "fpc.plating": "1 um"}, "SIT134"),
    # A fabricator of one's own.
    ("B", {**rules(trace_width="5 um", trace_spacing="5 um", via_drill="5 um", annular_ring="5 um"),
           "coil.trace_width": "5 um", "coil.trace_spacing": "5 um"}, "SIT134"),
    ("B", rules(copper_to_edge="5 um", hole_to_hole="5 um", drill_to_copper="5 um"), "SIT134"),
    ("B", rules(coverlay_web="5 um", coverlay_opening_to_trace="5 um", registration="1 um"), "SIT134"),
    ("B", rules(outline_tolerance="1 um"), "SIT134"),
    ("B", rules(coil_trace_width="5 um", coil_trace_spacing="5 um"), "SIT134"),
    ("B", rules(registration="1 mm"), "SIT134"),
    ("B", rules(outline_tolerance="1 mm"), "SIT134 SIT126-"),
    ("B", rules(thickness_tolerance_2="1 mm", stiffened_tolerance_fr4="1 mm"), "SIT134"),
    ("B", rules(finger_lap="5 um", pad_lap="5 um", inside_radius="5 um"), "SIT134"),
    ("B", rules(copper_to_edge=10), "SIT134 SIT109!"),
    ("B", rules(via_drill=5), "SIT134 SIT112!"),
    ("B", rules(annular_ring=5), "SIT134 SIT112! SIT133"),
    ("B", rules(static_bend_2=1), "SIT134"),
    ("B", rules(static_bend_2=1000), "SIT134 SIT123!"),
    ("B", rules(part_size=[200, 300]), "SIT134"),
    ("S", {"fpc": {"rules": {"name": "my shop", "panel_size": [1, 1]}}}, "SIT134 SIT116"),
    ("S", {"fpc": {"rules": {"name": "my shop", "panel_size": [21, 300]}}}, None),
    ("B", rules(panel_size=[40, 40], part_size=[1, 1]), "SIT116"),
    # The target.
    ("B", {"target.thickness": "1 um"}, "SIT134 SIT305"),
    ("B", {"target.thickness": 100}, "SIT134"),
    ("B", {"target.size": 0.5}, "SIT134 SIT304!"),
    ("B", {"target.size": 200}, "SIT134 SIT307"),
    ("B", {"target.kerf": 2}, "SIT134"),
    ("B", {"target.offset": [30, 0]}, "SIT307!"),
    ("B", {"target.offset": [30, 0], "elastomer.offset": [30, 0]}, "SIT307! SIT215!"),
    ("B", {"target.offset": [0, 20], "elastomer.offset": [0, 20], "fpc.margin": [0, 30]}, "SIT215! SIT306"),
    ("B", {"target.offset": [0, 9], "elastomer.offset": [0, 9], "fpc.margin": [0, 10]}, "SIT215 SIT217 SIT306"),
    ("B", {"target.material": {"name": "x", "conductivity": "0 S/m"}}, "SIT305!"),
    ("B", {"target.material": {"name": "x", "conductivity": "100 MS/m"}}, "SIT134"),
    ("B", {"target.material": {"name": "x", "conductivity": "58 MS/m", "relative_permeability": 100000}}, "SIT134"),
    ("B", {"target.material": {"name": "x", "conductivity": "0.001 MS/m"}}, "SIT305! SIT215!"),
    ("B", {"target.size": 2, "target.thickness": 5}, "SIT304! SIT310"),
    ("B", {"array": {"centres": [[-40, 0], [40, 0]]}}, "SIT215! SIT306"),
    ("B", {"array": {"centres": [[-8, 0], [0, 0], [8, 0], [0, 100]]}}, "SIT133 SIT123! SIT215!"),
    # The pad.
    ("B", {"elastomer.thickness": 0.001}, "SIT134 SIT215!"),
    ("B", {"elastomer.thickness": 100}, "SIT134 SIT215! SIT310!"),
    ("B", {"elastomer.thickness": 4}, "SIT310"),
    ("B", {"elastomer.thickness": 8}, "SIT310!"),
    ("B", {"elastomer.size": 300}, "SIT134 SIT307"),
    ("B", {"elastomer.kerf": 2}, "SIT134"),
    ("B", {"elastomer.offset": [30, 0]}, "SIT307!"),
    ("B", rubber(shear_modulus="100 MPa"), "SIT134 SIT215!"),
    ("B", rubber(shear_modulus="100 Pa"), "SIT134 SIT304! SIT310!"),
    ("B", rubber(shear_modulus="100 MPa", bulk_modulus="1 MPa"), "SIT134"),
    ("B", rubber(shear_modulus="3 MPa", bulk_modulus="1 MPa"), "SIT134"),
    ("B", rubber(uncertainty=2), "SIT134 SIT304"),
    ("B", rubber(hysteresis=1, creep=1), "SIT134"),
    ("B", rubber(expansion="0.002 1/K", modulus_temperature_coefficient="0.012 1/K"), "SIT134"),
    ("B", {"encapsulation": {"thickness": 50}}, "SIT134 SIT215!"),
    ("B", {"encapsulation": {"thickness": "1 um"}}, "SIT134"),
    ("B", {"encapsulation": {"thickness": 1, "material": {"name": "x", "shear_modulus": "100 MPa"}}}, "SIT134 SIT215!"),
    ("B", {"elastomer.thickness": 0.06}, "SIT215!"),
    ("B", {"encapsulation": {"thickness": 2}}, "SIT215 SIT217"),
    ("B", {"loads": {"press": {"normal": "10 kN"}}}, "SIT134"),
    # What carries it.
    ("G", {"encapsulation": None}, "SIT311"),
    ("G", {"assembly.tolerances": {"elastomer": 0, "placement": 0}}, "SIT134"),
    ("B", {"mount.standoff": 100}, "SIT134"),
    ("B", {"shield": {"gap": 0.1, "thickness": 50}, "mount.standoff": 60}, "SIT134 SIT314!"),
    ("B", {"shield": {"gap": 0.5, "thickness": 0.1, "kerf": 2}}, "SIT134"),
    ("B", {"mount.holes": [{"at": [300, 300], "diameter": 2.4, "head": 3.8}]}, "SIT134"),
    ("G", jaw(width=400, length=400, port_diameter=500), "SIT134"),
    ("G", jaw(height=0.001), "SIT134 SIT301!"),
    ("G", jaw(hinge=100), "SIT134"),
    ("G", jaw(hinge=5, opening="180 deg"), "SIT134"),
    ("G", jaw(opposing_pad_thickness=50), "SIT134 SIT303!"),
    ("G", jaw(recess=20, pocket=[18, 4.6]), "SIT134 SIT303!"),
    ("G", jaw(recess=2.5, pocket=[18, 4.6]), "SIT303!"),
    ("F", {"mount.finger.size": [500, 500]}, "SIT134"),
    ("F", {"mount.finger.size": [1, 1]}, "SIT134 SIT318"),
    ("F", {"mount.finger.grip": 100}, "SIT134"),
    ("B", {"assembly": {"glue_line": 1}}, "SIT134 SIT217"),
    ("B", {"assembly": {"tolerances": {"placement": 5}}}, "SIT134"),
    ("G", {"assembly.shaft_bore": 500}, "SIT134"),
    ("G", {"assembly.hinge_pin": 500}, "SIT134 SIT324"),
    ("B", {"cutting": {"gap": 100}}, "SIT134"),
    ("B", {"cutting": {"sheet": [0.1, 0.1]}}, "SIT134 SIT317!"),
    # The readout.
    ("B", {"readout.cable": {"length": 5000}}, "SIT134 SIT217"),
    ("B", {"readout.cable": {"length": 100, "inductance": "1 mH"}}, "SIT134 SIT215!"),
    ("B", {"readout.cable": {"length": 100, "capacitance": "1 uF"}}, "SIT134"),
    ("B", {"readout.cable": {"length": 100, "resistance": "1 kohm"}}, "SIT134"),
    ("B", {"readout.cable": {"length": 100, "resistance": "0 ohm", "capacitance": "0 pF"}}, "SIT134"),
    ("B", {"readout.capacitance": "1 pF"}, "SIT202! SIT214"),
    ("B", {"readout.clock": "100 kHz"}, "SIT213!"),
    ("B", {"readout.scan_rate": "0.01 Hz"}, "SIT210!"),
    ("B", {"readout.scan_rate": "100 kHz"}, "SIT208! SIT215!"),
    ("B", {"readout.drive_code": 31}, "SIT204!"),
    # What it is to bear and to tell.
    ("B", {"requirements.normal_force": "10 kN"}, "SIT134 SIT304! SIT310!"),
    ("B", {"requirements.normal_force": "1 mN"}, "SIT134 SIT215!"),
    ("B", {"requirements.normal_force": "0 N"}, "SIT134"),
    ("B", {"requirements.shear_force": "10 kN"}, "SIT134 SIT312"),
    ("B", {"requirements.temperature": "-60 degC"}, "SIT134"),
    ("B", {"requirements.temperature": "200 degC"}, "SIT134"),
    ("B", {"requirements.temperature_range": [-60, 200], "requirements.temperature_error": "1 N"}, "SIT134"),
    ("B", {"requirements.normal_resolution": "10 kN"}, "SIT134"),
    ("B", {"requirements.tilt": "2 deg", "requirements.tilt_error": "10 kN"}, "SIT134"),
    ("B", {"requirements.crosstalk": 1}, "SIT134"),
    ("B", {"requirements.friction_error": 1}, "SIT134"),
    ("B", {"requirements.bandwidth": "10 kHz"}, "SIT210!"),
    ("B", {"requirements.temperature_range": [20, 21], "requirements.temperature_error": "1 uN"}, "SIT406"),
    ("B", {"requirements.friction_error": 0.0001}, "SIT405"),
    # Windows, plating, bends, turned coils, several converters.
    ("G", jaw(fenestration=[18, 4]), "SIT315!"),
    ("B", bend(kind="dynamic", radius=50), "SIT123! SIT134 SIT308"),
    ("B", bend(at=29), "SIT123!"),
    ("B", {"fpc.plated": "panel", "fpc.plating": "1 um"}, "SIT134"),
    ("G", {"fpc.plated": "pattern", "fpc.plating": "60 um"}, "SIT134 SIT303"),
    ("B", {"fpc.plated": "buttons", "fpc.plating": "40 um"}, "SIT132-"),
    ("B", {"fpc.tail.contacts": 4, "fpc.tail.layers": 1}, "SIT132-"),
    ("R", {"array": {"centres": [[-4, 0], [4, 0]], "rotations": ["90 deg", "0 deg"]}}, "SIT301!"),
    ("B", {"readout.device": "ldc1612", "array.count": 3}, "SIT211 SIT215"),
    ("T", {"readout.device": "ldc1612"}, "SIT211"),
    ("B", {"array.count": 8}, "SIT211 SIT215"),
    ("B", {"array.count": 9}, "SIT211! SIT215"),
    ("B", {"coil.layers": [1]}, "SIT203"),
    ("B", {"target.rotation": "45 deg"}, "SIT307"),
    ("B", {"target.thickness": 4.9, "elastomer.thickness": 9.9}, "SIT217 SIT310!"),
    ("B", {"cutting": {"gap": 0}}, "SIT134"),
    ("B", {"mount": {"kind": "fingertip", "standoff": 0.001}}, "SIT314!"),
    ("F", {"mount.standoff": 0.01}, "SIT314!"),
    ("J", {"mount.standoff": 0, "shield": None}, "SIT301!"),
    ("B", {"readout.capacitance": "1 uF"}, "SIT203! SIT214"),
    ("B", {"fpc.margin": [0, 0], "elastomer.size": 9}, "SIT217 SIT307"),
]
"""Rules that speak: `!` an error, `-` a note, else a warning. None: SIT116 is silent (it is as large as its panel)."""

PASSES = [
    ("S", {"coil.layers": 1}, "the way out of the middle is taken on the second layer"),
    ("S", {"fpc.margin": 10}, "a board that is wider by a centimetre is for a hole or a pad"),
    ("B", {"fpc.tail.length": 300}, "boards of 300 mm are made in one piece"),
    ("B", {"array": {"centres": [[996, 0], [988, 0]]}}, "centres count from anywhere"),
    ("B", {"target.material": "ferrite"}, "it raises the inductance, and more as it comes near"),
    ("B", {"coil.turns": [12, 1]}, "layers may have turns of their own"),
    ("B", {"fpc.panel": {"parts": [1, 1]}}, "a panel of one part is a board with a frame"),
    ("B", {"fpc.panel": "auto", "fpc.boards": 1, "fpc.tail.length": 200}, "one board, however long its tail"),
    ("B", bend(angle="1 deg"), "a tail that is hardly bent is bent as well"),
    ("B", bend(angle="180 deg", at=10), "there is room to fold it back"),
    ("B", {"mount": {"kind": "custom", "standoff": 0}}, "what is below is one's own"),
    ("B", {"mount.standoff": 0.001}, "the plate's floor is as thick as it can be made, with no metal below"),
    ("B", {"array": {"centres": [[-4, 0], [4, 0]], "rotations": ["45 deg", "10 deg"]}}, "a circle has no direction"),
    ("B", {"readout.device": "ldc1612"}, "it has as many channels as there are coils"),
    ("B", {"requirements": None}, "a board is ordered before its forces are known, and SIT215 is named as not checked"),
    ("B", {"fpc.boards": 100000}, "many boards are no fault of one"),
    ("B", {"mount": None}, "the board alone is ordered before its mount"),
    ("B", {"assembly": {"glue_line": 0}}, "a pad cast in its place has no glue line"),
    ("B", {"mount.holes": [{"at": [0, 0], "diameter": 20, "head": 20}]}, "under the board an adapter is screwed first"),
    ("B", rubber(uncertainty=0), "somebody has measured it"),
    ("B", {"coil.shape": "square", "coil.corner_radius": 3.5}, "as round as it can be it is a circle"),
    ("B", {"readout.cable": {"length": 300}}, "a cable of a foot is usual"),
    ("B", {"requirements.tilt": "15 deg", "requirements.tilt_error": "1 N"}, "asked for, and judged by SIT404"),
    ("B", layers({"coverlay": "12 um"}, COPPER, {"dielectric": "50 um"}, COPPER, {"coverlay": "50 um"}),
     "such films are sold"),
]
"""What passes, and why it may."""

REFUSED = [
    ("B", {"coil.outer_diameter": 0.5, "coil.turns": 1}, "SIT016"),
    ("B", {"coil.trace_spacing": 1.5, "coil.turns": 2}, "SIT014"),
    ("B", {"coil.shape": "square", "coil.corner_radius": 100}, "SIT009"),
    ("B", layers(FILM, COPPER, COPPER, FILM), "SIT009"),
    ("B", layers(FILM, COPPER, FILM, COPPER, FILM), "SIT009"),
    ("B", {**layers(FILM, COPPER, CORE, COPPER, FILM), "fpc.plating": "100 um"}, "SIT009"),
    ("B", rubber(bulk_modulus="1 kPa"), "SIT006"),
    ("B", {"shield": {"gap": 100, "thickness": 0.1}, "mount.standoff": 100}, "SIT009"),
    ("B", {"assembly": {"glue_tolerance": 1}}, "SIT009"),
    ("G", jaw(fenestration=[0.01, 0.01]), "SIT006"),
    ("G", jaw(fenestration=[30, 2]), "SIT009"),
    ("B", {"fpc.panel": {"parts": [100, 1]}}, "SIT006"),
    ("S", {"fpc.panel": {"parts": [2, 2], "bridge": 0.01}}, "SIT006"),
    ("B", bend(angle="359 deg"), "SIT006"),
    ("R", {"array.rotations": ["90 deg"]}, "SIT009"),
    ("F", {"mount.finger.screw": 10}, "SIT006"),
]
"""What cannot be read."""


@cache
def base(letter):
    return load(TEMPLATES / f"{BASES[letter]}.yaml")


def named(row):
    changed = ", ".join(f"{key}: {value}" for key, value in row[1].items())
    return f"{row[0]} {changed}"[:100]


@cache
def usual(letter):
    """What is said of a base: rule and severity."""
    return {(item.rule, item.severity) for item in check(base(letter), hints="none").findings}


@pytest.mark.parametrize("row", TOLD, ids=named)
def test_unusual_spec_gives_expected_rule_and_severity(row):
    letter, changes, request = row
    design = Design(rewritten_spec(base(letter), changes.items()))
    for word in request.split() if request else ():
        severity = {"!": Severity.ERROR, "-": Severity.NOTE}.get(word[6:], Severity.WARNING)
        findings = apply_rule(next(rule for rule in RULES if rule.id == word[:6]), design)[0]
        assert severity in {item.severity for item in findings}, (word, [item.message for item in findings])
        is_named = any(item.key in " ".join(changes) for item in findings)
        assert (word[:6], severity) not in usual(letter) or is_named, word
    if not request:
        assert apply_rule(next(rule for rule in RULES if rule.id == "SIT116"), design)[0] == []


@pytest.mark.parametrize("row", PASSES, ids=named)
def test_justified_unusual_spec_gives_no_error(row):
    letter, changes, reason = row
    result = check(rewritten_spec(base(letter), changes.items()), hints="none")
    new = [item for item in result.findings if (item.rule, item.severity) not in usual(letter)]
    graver = [item.message for item in new if item.severity is Severity.ERROR or item.rule == "SIT134"]
    assert result.ok and reason and not graver, graver


@pytest.mark.parametrize("row", REFUSED, ids=named)
def test_senseless_spec_gives_spec_error(row):
    letter, changes, rule = row
    with pytest.raises(SpecError) as refused:
        rewritten_spec(base(letter), changes.items())
    assert rule in {item.rule for item in refused.value.findings}


def told(design):
    return [item.message for item in apply_rule(next(rule for rule in RULES if rule.id == "SIT134"), design)[0]]


@pytest.mark.parametrize(("kind", "letter", "key"), [
    ("rules", "B", "fpc.rules"), ("stackup", "B", "fpc.stackup"), ("elastomer", "B", "elastomer.material"),
    ("conductor", "B", "target.material"), ("jaw", "G", "mount.jaw"), ("adhesive", "B", "assembly.adhesive"),
])
def test_every_preset_is_within_usual_ranges(kind, letter, key):
    for name in presets.names(kind):
        assert told(Design(base(letter).replace(key, name))) == [], name


@pytest.mark.parametrize("path", sorted(TEMPLATES.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_template_is_within_usual_ranges(path):
    assert told(Design(load(path))) == []


def test_every_usual_range_has_bounds_source_and_spec_field():
    design = Design(base("G"))
    for row in usual_ranges():
        assert row.low < row.high and len(row.source) > 8, row.key
        if row.value not in COMPUTED_VALUES:
            here = design.spec
            for part in row.value.split("."):
                assert here is None or hasattr(here, part), row.value
                here = getattr(here, part, None)


def test_unusual_fabricator_rules_give_one_finding():
    spec = base("B").replace(rules(trace_width="5 um", via_drill="5 um", annular_ring="5 um", hole_to_hole="5 um"))
    (result,) = told(Design(spec))
    assert all(word in result for word in ("trace_width", "via_drill", "annular_ring", "hole_to_hole"))


def test_value_at_usual_bound_passes_and_value_beyond_gives_finding():
    assert told(Design(base("B").replace("elastomer.kerf", 0.5e-3))) == []
    (result,) = told(Design(base("B").replace("elastomer.kerf", 0.51e-3)))
    assert result.startswith("elastomer.kerf is 510 um;")


def test_ignore_comment_from_hint_suppresses_finding(tmp_path):
    """As the hint says."""
    path = tmp_path / "wide.yaml"
    text = (TEMPLATES / "single_coil.yaml").read_text(encoding="utf-8")
    plain = f"{text}\nelastomer:\n  size: 9\n  kerf: 0.8"
    path.write_text(f"{plain}\n", encoding="utf-8")
    findings = [item for item in inspect(str(path), "none").checked.findings if item.rule == "SIT134"]
    (comment,) = {re.search(r"# sitscad: ignore SIT134 .*", item.hint).group() for item in findings}
    path.write_text(f"{plain}  {comment}\n", encoding="utf-8")
    assert not {"SIT134", "SIT020"} & {item.rule for item in inspect(str(path), "none").checked.findings}
