"""A jaw's STEP file against the written jaw, and files that cannot be read: findings of a build, each with its key."""

from __future__ import annotations

import json
import math
import os
import re

import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.places.jaws import jaw_section
from sitscad.assembly.solids.step_parts import measured_jaw, read_files
from sitscad.assembly.solids.whole import whole
from sitscad.checks.assembly.fit import findings_on_solids, rules_in_fit_file
from sitscad.files.documents import mounting
from sitscad.layout import lay_out
from sitscad.spec.load import load
from sitscad.spec.reading import SpecError
from tests.solids.test_imported import SENSOR

pytestmark = pytest.mark.cad

SIZE = (24, 6, 2)
FIGURES = "width: 6, face: 6, length: 24, height: 2, port_diameter: 9"


def block(*size):
    """A jaw as a block, the middle of its face in the origin."""
    import build123d as bd

    long, wide, high = size or SIZE
    return bd.Solid.make_box(long, wide, high).moved(bd.Location((-long / 2, -wide / 2, -high)))


def grasper():
    """A jaw as instruments have them: chamfers, teeth across, rivet holes, a tapered round tip, a shank behind."""
    import build123d as bd

    jaw = block()
    jaw = jaw.chamfer(0.25, None, [edge for edge in jaw.edges() if abs(edge.center().Z) < 1e-6])
    for x in range(-11, 12):
        corners = [(x - 0.4, -4, 0.01), (x + 0.4, -4, 0.01), (x, -4, -0.35)]
        tooth = bd.Face(bd.Wire.make_polygon([bd.Vector(*corner) for corner in corners]))
        (jaw,) = (jaw - bd.Solid.extrude(tooth, bd.Vector(0, 8, 0))).solids()
    for x in (-3, 4):
        (jaw,) = (jaw - bd.Solid.make_cylinder(0.6, 5, bd.Plane((x, 0, -3)))).solids()
    outline = [(-12, -1), (-8, -3), (13, -3), (13, 3), (-8, 3), (-12, 1)]
    plan = bd.Face(bd.Wire.make_polygon([bd.Vector(*corner, -5) for corner in outline]))
    (jaw,) = (jaw & bd.Solid.extrude(plan, bd.Vector(0, 0, 9))).solids()
    shank = bd.Solid.make_box(15, 3, 2).moved(bd.Location((11.9, -1.5, -2.8)))
    (jaw,) = (jaw + shank).solids()
    return jaw


def layout_of(folder, shape, jaw, more=""):
    import build123d as bd

    bd.export_step(shape, folder / "jaw.step")
    (folder / "sensor.yaml").write_text(f"{SENSOR}mount:\n  jaw: {{step: jaw.step, {jaw}}}\n{more}")
    return lay_out(load(folder / "sensor.yaml"))


def faults(layout):
    """Rule, key and line of every finding of a jaw's file."""
    measured = [mounting._value_document(each) for each in measured_jaw(layout)]
    findings = [each for each in findings_on_solids({"measured": measured}, layout.spec.readout.device,
                                               layout.spec.source) if each.severity.value != "note"]
    assert rules_in_fit_file({"measured": measured}) == {"SIT332"}
    assert {finding.severity.value for finding in findings} <= {"error"} and all(each.line == 9 for each in findings)
    return {finding.key: finding for finding in findings}


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("figures", [FIGURES, "material: titanium-grade-5"])
def test_jaw_file_with_teeth_holes_taper_and_shank_passes(tmp_path, figures):
    assert faults(layout_of(tmp_path, grasper(), figures)) == {}


@pytest.mark.slow
def test_opened_jaws_with_shanks_have_no_interference(tmp_path):
    layout = layout_of(tmp_path, grasper(), f"{FIGURES}, hinge: 4, opening: 40 deg")
    document = json.loads(mounting.render_fit(layout, whole(layout))["mount/fit.json"])
    assert {each["what"] for each in document["measured"] if not each["kept"]} <= {"jaw back with room"}
    assert {"SIT320", "SIT321", "SIT322", "SIT332", "SIT333"} <= rules_in_fit_file(document)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """One file of the block, which the kernel's process reads once."""
    import build123d as bd

    place = tmp_path_factory.mktemp("block") / "jaw.step"
    bd.export_step(block(), place)
    return place.read_bytes()


TOLD = [
    ("lies right", FIGURES, set()),
    ("along", f"{FIGURES}, datum: [5, 0, 0]", {"mount.jaw.length"}),
    ("beyond the tip", f"{FIGURES}, datum: [-5, 0, 0]", {"mount.jaw.length"}),
    ("aside", f"{FIGURES}, datum: [0, 1, 0]", {"mount.jaw.datum"}),
    ("deep", f"{FIGURES}, datum: [0, 0, 0.1]", {"mount.jaw.datum"}),
    ("thin", FIGURES.replace("height: 2", "height: 2.2"), {"mount.jaw.height"}),
    ("wide", FIGURES.replace(": 6", ": 5.7"), {"mount.jaw.width"}),
    ("short", FIGURES.replace("24", "26"), {"mount.jaw.length"}),
    ("turned", f"{FIGURES}, along: y", {"mount.jaw.width", "mount.jaw.length", "mount.jaw.step"}),
    ("no rims", f"{FIGURES}, pocket: [20, 5], recess: 0.3", {"mount.jaw.recess"}),
]


@pytest.mark.parametrize(("figures", "keys"), [row[1:] for row in TOLD], ids=[row[0] for row in TOLD])
def test_file_contradicting_written_jaw_is_error(tmp_path, file, figures, keys):
    (tmp_path / "jaw.step").write_bytes(file)
    (tmp_path / "sensor.yaml").write_text(f"{SENSOR}mount:\n  jaw: {{step: jaw.step, {figures}}}\n")
    assert set(faults(lay_out(load(tmp_path / "sensor.yaml")))) == keys


def round_bar(face, radius):
    """A jaw as the block, with the back of a cylinder of some radius (mm) and its lowest point 2 mm below the face."""
    import build123d as bd

    bar = bd.Solid.make_cylinder(radius, 30, bd.Plane((-15, 0, radius - 2), z_dir=(1, 0, 0)))
    (jaw,) = (block(24, face, 2) & bar).solids()
    return jaw


BACKS = [
    ("round as the port", lambda: round_bar(6, 4.5), 9, None),
    ("square in a wide port", block, 10, "note"),
    ("square in a port with room nominally", block, 8.8, "warning"),
    ("square in a narrow port", block, 7.5, "warning"),
]


@pytest.mark.parametrize(("shape", "port", "severity"), [row[1:] for row in BACKS], ids=[row[0] for row in BACKS])
def test_file_back_is_compared_with_assumed_back(tmp_path, shape, port, severity):
    """The square edge reaches hypot(3, half the pair's height) mm from the closed pair's axis."""
    layout = layout_of(tmp_path, shape(), FIGURES.replace(": 9", f": {port}"))
    measured = [mounting._value_document(each) for each in measured_jaw(layout)]
    findings = [each for each in findings_on_solids({"measured": measured}, layout.spec.readout.device,
                                               layout.spec.source) if each.key == "mount.jaw.step"]
    assert [(each.rule, each.severity.value) for each in findings] == ([("SIT332", severity)] if severity else [])
    for each in findings:
        pair = closed_section(layout)
        assert each.measured == approx(math.hypot(3e-3, pair.height / 2), rel=1e-6)
        assert each.limit < pair.radius + 1e-9 < each.measured
        assert (each.measured + pair.worst_radius - pair.radius > pair.port_radius) == (severity == "warning")


def test_file_face_wider_than_chord_yields_finding(tmp_path):
    layout = layout_of(tmp_path, block(), FIGURES.replace("face: 6, ", "").replace(": 9", ": 6"))
    findings = {each.key: each for each in findings_on_solids(
        {"measured": [mounting._value_document(each) for each in measured_jaw(layout)]}, layout.spec.readout.device,
        layout.spec.source)}
    face = findings["mount.jaw.face"]
    assert (face.rule, face.severity.value) == ("SIT332", "warning")
    assert (face.measured, face.limit) == (approx(6e-3, rel=1e-6), approx(jaw_section(layout.spec.jaw).face, rel=1e-6))


def test_corner_beyond_port_states_place_and_excess(tmp_path):
    layout = layout_of(tmp_path, block(), FIGURES.replace(": 9", ": 7.5"))
    document = json.loads(mounting.render_fit(layout, whole(layout))["mount/fit.json"])
    (findings,) = [each for each in findings_on_solids(document, layout.spec.readout.device,
                                                  layout.spec.source) if each.rule == "SIT321"]
    (port,) = [each for each in document["measured"] if each["what"] == "port"]
    assert "SIT303" not in findings.message + findings.hint
    figures = [float(number) for number in re.findall(r"-?\d+\.?\d*", findings.whole_message)]
    for figure in (*(1e3 * along for along in port["where_m"]), 1e6 * (findings.measured - findings.limit)):
        assert any(each == approx(figure, rel=5e-3, abs=6e-3) for each in figures), figure


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("unit", [10.0, 25.4])
def test_file_in_wrong_unit_has_no_metal_under_coils(tmp_path, unit):
    result = faults(layout_of(tmp_path, block().scale(1 / unit), FIGURES))
    assert set(result) == {"mount.jaw.step"} and f"{24 / unit:.4g} x" in result["mount.jaw.step"].detail


@pytest.mark.slow
def test_contradiction_states_measured_and_written_value(tmp_path):
    result = faults(layout_of(tmp_path, block(24, 6.3, 1.8), FIGURES))
    values = {key.rpartition(".")[2]: (each.measured, each.limit) for key, each in result.items()}
    assert values == {"width": (approx(6.3e-3, rel=1e-6), 6e-3), "height": (approx(1.8e-3, rel=1e-6), 2e-3)}


@pytest.mark.slow
def test_tilted_jaw_is_found_by_face(tmp_path):
    import build123d as bd

    result = faults(layout_of(tmp_path, block().rotate(bd.Axis.Y, 1), FIGURES))
    assert result["mount.jaw.datum"].measured == approx(4.25e-3 * 0.01746, rel=1e-3)


@pytest.mark.more
@pytest.mark.slow
def test_reversed_jaw_is_found_by_face_width(tmp_path):
    import build123d as bd

    bar = bd.Solid.make_cylinder(4.5, 30, bd.Plane((-15, 0, 2.5), z_dir=(1, 0, 0)))
    (jaw,) = (block() & bar).solids()
    assert faults(layout_of(tmp_path, jaw, FIGURES)) == {}
    assert set(faults(layout_of(tmp_path, jaw, f"{FIGURES}, datum: [0, 0, -2], up: -z"))) == {"mount.jaw.up"}


@pytest.mark.more
@pytest.mark.slow
def test_window_in_file_must_equal_written_window(tmp_path):
    import build123d as bd

    (jaw,) = (block() - bd.Solid.make_box(4, 3, 9).moved(bd.Location((-2, -1.5, -4)))).solids()
    assert faults(layout_of(tmp_path, jaw, f"{FIGURES}, fenestration: [4, 3]")) == {}
    result = faults(layout_of(tmp_path, jaw, FIGURES))["mount.jaw.step"]
    assert result.measured == approx(result.limit - 12e-6, rel=1e-6)
    assert set(faults(layout_of(tmp_path, block(), f"{FIGURES}, fenestration: [4, 3]"))) == {"mount.jaw.fenestration"}


def unread(name):
    """Shapes that are no part: their files are whole."""
    import build123d as bd

    two = bd.Compound([block(), block().moved(bd.Location((0, 0, 9)))])
    return {"two solids": two, "sheet": block().faces()[0], "wire": block().faces()[0].outer_wire(),
            "far too large": block().scale(100)}[name]


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["two solids", "sheet", "wire", "far too large"])
def test_file_without_single_solid_is_finding_at_key(tmp_path, name):
    layout = layout_of(tmp_path, unread(name), FIGURES)
    document = json.loads(mounting.unread_files(layout.spec.mount, layout.spec.source))
    (found,) = findings_on_solids(document, layout.spec.readout.device, layout.spec.source)
    assert (found.rule, found.key, found.line, found.severity.value) == ("SIT333", "mount.jaw.step", 9, "error")
    assert "jaw.step" in found.message and found.hint


@pytest.mark.slow
def test_unknown_coordinate_system_is_finding_at_datum(tmp_path):
    layout = layout_of(tmp_path, block(), f"{FIGURES}, datum: SEAT")
    (result,) = read_files(layout.spec.mount, layout.spec.source)
    assert (result.is_kept, result.key) == (False, "mount.jaw.datum")


@pytest.mark.more
@pytest.mark.slow
def test_forced_package_lists_files_missing_for_unreadable_step_file(tmp_path):
    layout = layout_of(tmp_path, unread("two solids"), FIGURES)
    stopped = sitscad.build(layout.spec, tmp_path / "out", only=["laser", "mount"])
    assert not stopped.written and [each.rule for each in errors_of(stopped)] == ["SIT333"]
    forced = sitscad.build(layout.spec, tmp_path / "out", only=["laser", "mount"], force=True)
    package = tmp_path / "out" / "filed"
    assert forced.written and forced.forced and list((package / "laser").glob("*.dxf"))
    note = (package / "FORCED.txt").read_text()
    assert "SIT333" in note and "assembly step: jaw.step holds 2 solids" in note
    assert sitscad.verify(package, rebuild=True).ok


@pytest.mark.more
@pytest.mark.slow
def test_mount_overlapping_shield_can_be_forced(tmp_path):
    import build123d as bd

    bd.export_step(block(20, 9, 3), tmp_path / "own.step")
    own = "mount: {kind: custom, step: own.step}\nshield: {thickness: 0.1, gap: 0.3}\n"
    (tmp_path / "sensor.yaml").write_text(SENSOR + own)
    spec = load(tmp_path / "sensor.yaml")
    stopped = sitscad.build(spec, tmp_path / "out", only=["mount"])
    (error,) = errors_of(stopped)
    assert (error.rule, error.key, stopped.written) == ("SIT320", "mount", False)
    assert error.measured > 1e-9
    assert sitscad.build(spec, tmp_path / "out", only=["mount"], force=True).written
    assert (tmp_path / "out" / "filed" / "mount" / "filed-mount.step").is_file()
    assert sitscad.verify(tmp_path / "out" / "filed", rebuild=True).ok


def errors_of(result):
    return [each for each in result.checked.findings if each.severity.value == "error"]


def spec_with(folder, name):
    (folder / "sensor.yaml").write_text(f"{SENSOR}mount:\n  jaw:\n    step: {name}\n")
    return folder / "sensor.yaml"


@pytest.mark.parametrize("kind", ["folder", "link to nowhere", "not allowed", "pipe"])
def test_missing_file_path_is_found_at_key(tmp_path, kind):
    path = tmp_path / "jaw.step"
    if kind == "folder":
        path.mkdir()
    elif kind == "link to nowhere":
        path.symlink_to("none.step")
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.write_text("ISO-10303-21;\nEND-ISO-10303-21;\n")
        path.chmod(0)
        if os.access(path, os.R_OK):
            pytest.skip("who runs this may read everything")
    with pytest.raises(SpecError) as caught:
        load(spec_with(tmp_path, "jaw.step"))
    (findings,) = caught.value.findings
    assert (findings.key, findings.line) == ("mount.jaw.step", 10) and findings.hint


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("datum", ["datum: [50.8, 0, 0]", "datum: SEAT"])
def test_file_in_inches_is_read_to_scale(tmp_path, datum):
    """The block's middle is 2 inches from the origin; a datum's figures are millimetres, a named one is the file's."""
    import build123d as bd

    bd.export_step(block().scale(1 / 25.4).moved(bd.Location((2, 0, 0))), tmp_path / "jaw.step")
    text = (tmp_path / "jaw.step").read_text()
    millimetre = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
    assert millimetre in text
    inch = "( CONVERSION_BASED_UNIT('INCH',#90005) LENGTH_UNIT() NAMED_UNIT(#90006) )"
    added = (
        f"#90005=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#90007);\n#90007={millimetre};\n"
        "#90006=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n#90001=CARTESIAN_POINT('',(2.,0.,0.));\n"
        "#90002=DIRECTION('',(0.,0.,1.));\n#90003=DIRECTION('',(1.,0.,0.));\n"
        "#90004=AXIS2_PLACEMENT_3D('SEAT',#90001,#90002,#90003);\n"
    )
    head, end, tail = text.replace(millimetre, inch).rpartition("ENDSEC;")
    (tmp_path / "jaw.step").write_text(head + added + end + tail)
    (tmp_path / "sensor.yaml").write_text(f"{SENSOR}mount:\n  jaw: {{step: jaw.step, {FIGURES}, {datum}}}\n")
    assert faults(lay_out(load(tmp_path / "sensor.yaml"))) == {}
