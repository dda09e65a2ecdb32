"""Jaws and mounts out of STEP files: read, laid by their datum, held against the other pieces; hostile ones refused."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.assembly.solids import PartsError, solids
from sitscad.assembly.solids.proof import measure_solids, step_file_overlaps
from sitscad.assembly.solids.whole import whole
from sitscad.checks.judging import check
from sitscad.layout import lay_out
from sitscad.spec.load import load
from sitscad.spec.reading import SpecError

pytestmark = pytest.mark.cad

SENSOR = """sitscad: 1
name: filed
coil: {shape: circle, outer_diameter: 4, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 30, connector: zif-0.5mm, layers: 2}}
target: {shape: rectangle, size: [4.5, 4.1], thickness: 0.15}
elastomer: {shape: rectangle, size: [4.5, 4.1], thickness: 0.65}
"""
BOX = (24.0, 6.0, 2.0)


def written(folder, mount):
    path = folder / "sensor.yaml"
    path.write_text(SENSOR + f"mount: {mount}\n")
    return path


@pytest.fixture(scope="module")
def jaw_file(tmp_path_factory):
    """A block standing on end: its face, 24 x 6 mm, looks along -y; the middle of that is (10, -1, 30)."""
    import build123d as bd

    folder = tmp_path_factory.mktemp("jaw")
    block = bd.Solid.make_box(*BOX).moved(bd.Location((-12, -3, -2)))
    turned = block.moved(bd.Location((10, -1, 30)) * bd.Rotation(90, 0, 0))
    bd.export_step(turned, folder / "jaw.step")
    return folder / "jaw.step"


def beside(tmp_path, jaw_file, mount):
    (tmp_path / "jaw.step").write_bytes(jaw_file.read_bytes())
    return load(written(tmp_path, mount))


def jaw_of(spec):
    layout = lay_out(spec)
    return layout, next(solid for solid in solids(layout) if solid.name == "jaw")


LIES = "step: jaw.step, datum: [10, -1, 30], along: x, up: -y"


@pytest.mark.slow
def test_imported_jaw_lies_at_datum(tmp_path, jaw_file):
    spec = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}}}, standoff: 1}}")
    layout, jaw = jaw_of(spec)
    box = jaw.shape.bounding_box()
    face = -layout.spec.fpc.stackup.thickness * 1e3 - 1.0
    assert approx((face - 2.0, face), abs=1e-6) == (box.min.Z, box.max.Z)
    middle = 500.0 * (layout.body[0] + layout.body[2])
    assert approx((middle - 12.0, middle + 12.0), abs=1e-6) == (box.min.X, box.max.X)
    assert jaw.volume == approx(24e-3 * 6e-3 * 2e-3, rel=1e-6)
    assert jaw.shape.wrapped.Location().IsIdentity()
    assert all(each.is_kept for each in step_file_overlaps(layout.spec.mount, whole(layout)))


@pytest.mark.slow
def test_named_coordinate_system_is_datum(tmp_path, jaw_file):
    text = jaw_file.read_text()
    named = (
        "#90001=CARTESIAN_POINT('',(10.,-1.,30.));\n#90002=DIRECTION('',(0.,-1.,0.));\n"
        "#90003=DIRECTION('',(1.,0.,0.));\n#90004=AXIS2_PLACEMENT_3D('SEAT',#90001,#90002,#90003);\n"
    )
    head, end, tail = text.rpartition("ENDSEC;")
    (tmp_path / "named.step").write_text(head + named + end + tail)
    by_name = load(written(tmp_path, "{jaw: {step: named.step, datum: SEAT}, standoff: 1}"))
    by_figures = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}}}, standoff: 1}}")
    item, other = (jaw_of(spec)[1].shape.bounding_box() for spec in (by_name, by_figures))
    assert tuple(item.min) == approx(tuple(other.min), abs=1e-9)
    unknown = load(written(tmp_path, "{jaw: {step: named.step, datum: SAET}, standoff: 1}"))
    with pytest.raises(PartsError, match="no coordinate system named SAET; there are: SEAT"):
        solids(lay_out(unknown))


@pytest.mark.more
@pytest.mark.slow
def test_plane_rules_state_reason_if_not_checked(tmp_path, jaw_file):
    spec = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}}}, standoff: 1}}")
    result = check(spec, hints="none")
    cases = {entry.rule: entry.case for entry in result.not_checked}
    for rule in ("SIT301", "SIT302", "SIT303"):
        assert cases[rule] == "jaw-by-file"
    measured = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}, width: 6, length: 24, height: 2, port_diameter: 9}}}}")
    assert not {"SIT301", "SIT302", "SIT303"} & {entry.rule for entry in check(measured, hints="none").not_checked}
    layout = lay_out(measured)
    assert measure_solids(layout, whole(layout)).faults == ()


def test_metal_of_jaw_file_is_reflector_behind_coils(tmp_path, jaw_file):
    from sitscad.estimates.targets.assembly import metal_behind

    spec = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}, material: titanium-grade-5}}, standoff: 1}}")
    known = metal_behind(spec)
    assert known.distance == approx(spec.fpc.stackup.thickness + 1e-3, abs=4e-5)
    assert known.plates[0].conductivity == spec.mount.metal.conductivity > 0.0
    assert metal_behind(beside(tmp_path, jaw_file, "{kind: custom}")) is None


@pytest.mark.slow
def test_file_overlapping_board_is_found_once(tmp_path, jaw_file):
    sunk = lay_out(beside(tmp_path, jaw_file, "{jaw: {step: jaw.step, datum: [10, 0.9, 30], up: -y}, standoff: 1}"))
    overlaps = step_file_overlaps(sunk.spec.mount, whole(sunk))
    result = [each for each in overlaps if "board-" in f"{each.first} {each.second}"]
    assert [(each.what, each.is_kept, "jaw" in (each.first, each.second)) for each in result] == [
        ("interference", False, True)]
    assert result[0].value > 1e-9


@pytest.mark.slow
def test_custom_mount_with_and_without_file_is_built(tmp_path, jaw_file):
    own = lay_out(beside(tmp_path, jaw_file, f"{{kind: custom, {LIES}}}"))
    result = {solid.name: solid for solid in solids(own)}
    assert approx(-own.spec.fpc.stackup.thickness * 1e3, abs=1e-6) == result["mount"].shape.bounding_box().max.Z
    assert all(each.is_kept for each in step_file_overlaps(own.spec.mount, whole(own)))
    none = lay_out(beside(tmp_path, jaw_file, "{kind: custom}"))
    assert {"board", "target"} <= {solid.name for solid in solids(none)} and "mount" not in result.keys() - {"mount"}


@pytest.mark.parametrize(
    ("name", "content", "rule", "words"),
    [
        ("../jaw.step", None, "SIT017", "outside"),
        ("/etc/jaw.step", None, "SIT017", "not a path below"),
        ("none.step", None, "SIT011", "is not there"),
        ("empty.step", b"", "SIT011", "does not begin with"),
        ("binary.step", b"ISO-10303-21;\0END-ISO-10303-21;", "SIT011", "does not begin with"),
        ("cut.step", b"ISO-10303-21;\nHEADER;", "SIT011", "end with"),
        ("large.step", b"ISO-10303-21;" + b" " * (17 << 20) + b"END-ISO-10303-21;", "SIT010", "larger than 16 MiB"),
    ],
)
def test_invalid_file_is_refused_at_key_and_line(tmp_path, name, content, rule, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    inner = tmp_path / "inner" if name.startswith("..") else tmp_path
    inner.mkdir(exist_ok=True)
    (tmp_path / "jaw.step").write_text("ISO-10303-21;\nEND-ISO-10303-21;\n")
    with pytest.raises(SpecError) as caught:
        load(written(inner, f"{{jaw: {{step: {name}}}}}"))
    (findings,) = caught.value.findings
    assert (findings.rule, findings.key, findings.line) == (rule, "mount.jaw.step", 8)
    assert words in findings.message


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    "body",
    ["", "HEADER;\nENDSEC;\nDATA;\n#1=NONSENSE(#2,#1);\nENDSEC;\n", "DATA;\n" + "#1=A(((((((((" * 2000 + "\nENDSEC;\n"],
)
def test_empty_file_is_refused_by_build(tmp_path, body):
    (tmp_path / "jaw.step").write_text(f"ISO-10303-21;\n{body}END-ISO-10303-21;\n")
    spec = load(written(tmp_path, "{jaw: {step: jaw.step}}"))
    with pytest.raises(PartsError, match=r"jaw\.step"):
        solids(lay_out(spec))


@pytest.mark.slow
def test_file_with_two_solids_is_refused(tmp_path):
    import build123d as bd

    apart = bd.Compound([bd.Solid.make_box(1, 1, 1), bd.Solid.make_box(1, 1, 1).moved(bd.Location((3, 0, 0)))])
    bd.export_step(apart, tmp_path / "jaw.step")
    spec = load(written(tmp_path, "{jaw: {step: jaw.step}}"))
    with pytest.raises(PartsError, match="holds 2 solids"):
        solids(lay_out(spec))


def test_spec_without_its_file_is_refused(tmp_path, jaw_file):
    spec = beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}}}, standoff: 1}}")
    lost = replace(spec, source=replace(spec.source, files={}))
    with pytest.raises(PartsError, match="load the spec from its file again"):
        solids(lay_out(lost))


@pytest.mark.parametrize(
    ("mount", "key", "rule"),
    [
        ("{jaw: {step: jaw.step, along: x, up: -x}}", "mount.jaw.up", "SIT009"),
        ("{jaw: {step: jaw.step, width: 5}}", "mount.jaw.length", "SIT003"),
        ("{jaw: {step: jaw.step, datum: SEAT, up: y}}", "mount.jaw.up", "SIT009"),
        ("{jaw: {step: jaw.step, datum: [0, 1]}}", "mount.jaw.datum", "SIT004"),
        ("{jaw: {step: jaw.obj}}", "mount.jaw.step", "SIT006"),
        ("{jaw: {width: 5, length: 20, height: 2, datum: [0, 0, 0]}}", "mount.jaw.datum", "SIT009"),
        ("{jaw: {step: jaw.step}, retention: pins}", "mount.retention", "SIT009"),
        ("{kind: bench-plate, step: jaw.step}", "mount.step", "SIT009"),
        ("{kind: fingertip, holes: ati-nano17}", "mount.holes", "SIT009"),
        ("{jaw: toothless-5mm, retention: dovetail}", "mount.retention", "SIT009"),
        ("{kind: bench-plate, holes: []}", "mount.holes", "SIT009"),
        ("{kind: bench-plate, holes: [{at: [9, 9], diameter: 5, head: 3}]}", "mount.holes", "SIT009"),
    ],
)
def test_contradictory_keys_give_spec_error(tmp_path, jaw_file, mount, key, rule):
    (tmp_path / "jaw.step").write_bytes(jaw_file.read_bytes())
    with pytest.raises(SpecError) as caught:
        load(written(tmp_path, mount))
    assert (rule, key) in {(result.rule, result.key) for result in caught.value.findings}


@pytest.mark.slow
def test_opposing_jaw_of_file_is_mirror_image(tmp_path, jaw_file):
    """Where no figure stands beside the file there was none: pictures and assembly showed half an instrument."""
    layout, lower = jaw_of(beside(tmp_path, jaw_file, f"{{jaw: {{{LIES}}}, standoff: 1}}"))
    assert layout.spec.mount.jaw is None
    pieces = {solid.name: solid for solid in whole(layout)}
    other = pieces["opposing-jaw"]
    top = pieces["target"].shape.bounding_box().max.Z
    assert other.volume == approx(lower.volume, rel=1e-6) and other.shape.is_valid
    assert approx(top, abs=1e-6) == other.shape.bounding_box().min.Z
