"""Specs whose coil is drawn in a KiCad file: figures, the rest of the package, and refusals with their place."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import pytest
from click.testing import CliRunner
from drawn_boards import TWO, board, pad, segments, two_layers
from tolerance import approx

import sitscad
from sitscad.cli import cli
from sitscad.files.formats.kicad.project_files import render
from sitscad.layout.board import Role

PLATES = """target: {size: 8, thickness: 0.2, material: copper}
elastomer: {size: 8, thickness: 2, material: ecoflex-00-30}
requirements: {normal_force: 2 N}
"""
WRITTEN = "shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 100 um, trace_spacing: 100 um"


def text(coil, more=PLATES):
    return f"sitscad: 1\nname: drawn\ncoil: {{{coil}}}\n{more}"


def loaded(folder, coil, more=PLATES):
    (folder / "sensor.yaml").write_text(text(coil, more))
    return sitscad.load(folder / "sensor.yaml")


@pytest.fixture(scope="module")
def drawing(tmp_path_factory):
    """A folder with the coil of `WRITTEN` as a footprint and as a whole board, and the spec that drew them."""
    folder = tmp_path_factory.mktemp("drawing")
    spec = loaded(folder, WRITTEN)
    files = render(sitscad.lay_out(spec))
    (folder / "coil.kicad_mod").write_bytes(next(files[name] for name in files if name.endswith("coil-C1.kicad_mod")))
    (folder / "board.kicad_pcb").write_bytes(next(files[name] for name in files if name.endswith(".kicad_pcb")))
    return folder, spec


def test_spec_with_drawn_board_has_estimates_of_original_spec(drawing):
    folder, spec = drawing
    drawn = loaded(folder, "drawn: board.kicad_pcb, net: C1")
    ours, theirs = (sitscad.estimate(sitscad.lay_out(each)).coils[0] for each in (spec, drawn))
    assert theirs.winding_inductance == approx(ours.winding_inductance, rel=1e-6)
    assert theirs.resistance_dc == approx(ours.resistance_dc, rel=1e-6)
    assert theirs.self_capacitance == approx(ours.self_capacitance, rel=1e-6)
    assert ours.states.keys() == theirs.states.keys()
    for name, state in ours.states.items():
        read = theirs.states[name]
        assert (read.inductance, read.resistance, read.frequency) == approx(
            (state.inductance, state.resistance, state.frequency), rel=1e-3)
        if state.target_change is not None:
            assert read.target_change == approx(state.target_change, rel=1e-3)


def test_response_of_drawn_coil_equals_response_of_its_spec(drawing):
    folder, spec = drawing
    drawn = loaded(folder, "drawn: board.kicad_pcb, net: C1")
    poses = [[0.0] * 6, [0.0, 0.0, -0.4e-3, 0.0, 0.0, 0.0], [0.3e-3, 0.0, -0.2e-3, 0.0, 0.01, 0.0]]
    ours, theirs = (sitscad.respond(each, poses=poses) for each in (spec, drawn))
    for name in ("inductance", "resistance", "frequency", "target_change"):
        assert getattr(theirs, name) == approx(getattr(ours, name), rel=1e-3)


def test_footprint_has_the_winding_of_its_spec_and_no_leads(drawing):
    folder, spec = drawing
    footprint = loaded(folder, "drawn: coil.kicad_mod")
    for key in ("shape", "turns", "layers", "trace_width"):
        assert getattr(footprint.coil, key) == getattr(spec.coil, key)
    assert footprint.coil.size == approx(spec.coil.size, rel=1e-6)
    layout = sitscad.lay_out(footprint)
    assert {trace.role for trace in layout.traces} == {Role.WINDING, Role.STUB}
    ours, theirs = (sitscad.estimate(each).coils[0] for each in (sitscad.lay_out(spec), layout))
    assert theirs.winding_inductance == approx(ours.winding_inductance, rel=1e-5)
    assert theirs.resistance_dc == approx(ours.resistance_dc, rel=1e-5)
    assert theirs.inductance_error >= ours.inductance_error


@pytest.mark.parametrize(("coil", "stackup"), [
    ("shape: square, outer_diameter: 10, turns: 11, layers: 2, corner_radius: 0.5", "flex-2l-30um"),
    ("shape: rectangle, outer_diameter: [14, 8], turns: 7.5, layers: 2", "flex-2l-30um"),
    *(pytest.param(*each, marks=(pytest.mark.slow, pytest.mark.more)) for each in (
        ("shape: square, outer_diameter: 10, turns: 8.25, layers: 1", "flex-2l-30um"),
        ("shape: square, outer_diameter: 10, turns: 9.5, layers: 2, start: mid-side", "flex-2l-30um"),
        ("shape: hexagon, outer_diameter: 10, turns: 9, layers: 2", "flex-2l-30um"),
        ("shape: octagon, outer_diameter: 10, turns: 9.5, layers: 2, sense: clockwise", "flex-2l-30um"),
        ("shape: circle, outer_diameter: 10, turns: 6.5, layers: 4", "flex-4l"))),
])
def test_every_shape_is_recognised_in_written_board(coil, stackup, tmp_path):
    fpc = f"fpc: {{stackup: {stackup}}}\n"
    spec = loaded(tmp_path, f"{coil}, trace_width: 160 um, trace_spacing: 160 um", fpc)
    files = render(sitscad.lay_out(spec))
    (tmp_path / "board.kicad_pcb").write_bytes(next(files[name] for name in files if name.endswith(".kicad_pcb")))
    drawn = loaded(tmp_path, "drawn: board.kicad_pcb, net: C1", fpc)
    for key in ("shape", "turns", "layers", "is_mid_side", "clockwise"):
        assert getattr(drawn.coil, key) == getattr(spec.coil, key)
    assert (*drawn.coil.size, drawn.coil.pitch) == approx((*spec.coil.size, spec.coil.pitch), rel=1e-5)
    ours, theirs = (sitscad.estimate(sitscad.lay_out(each)).coils[0] for each in (spec, drawn))
    assert theirs.winding_inductance == approx(ours.winding_inductance, rel=1e-5)
    assert theirs.resistance_dc == approx(ours.resistance_dc, rel=1e-5)
    assert theirs.states["free"].inductance == approx(ours.states["free"].inductance, rel=1e-3)


def square_points(size, pitch, turns):
    """Corners (mm, y downwards) of a square spiral of another kind: each side lies a quarter of a pitch further in."""
    offsets = [size / 2 - pitch * k / 4 for k in range(4 * turns + 1)]
    corners = [[(-b, a), (-a, -b), (b, -a), (a, b)][k % 4] for k, (a, b) in enumerate(pairwise(offsets))]
    return [(x, -y) for x, y in corners]


def test_square_of_other_generator_is_computed_by_its_drawn_path(tmp_path):
    points = square_points(9.8, 0.32, 8)
    (tmp_path / "board.kicad_pcb").write_text(
        board(segments(points, "F.Cu", width=0.16), pad("1", *points[0]), pad("2", *points[-1])))
    spec = loaded(tmp_path, "drawn: board.kicad_pcb, net: COIL", "")
    assert (spec.coil.shape, spec.coil.pitch) == ("square", approx(0.32e-3, rel=1e-6))
    estimate = sitscad.estimate(sitscad.lay_out(spec)).coils[0]
    alone = sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), net="COIL", frequency="100 kHz")
    assert estimate.winding_inductance == approx(alone.low_frequency_inductance, rel=5e-3)
    assert estimate.resistance_dc == approx(alone.direct_current_resistance, rel=1e-3)


@pytest.mark.parametrize("turned", ["tilted", "wider"])
def test_drawn_turns_of_no_known_shape_are_refused(turned, tmp_path):
    points = square_points(9.8, 0.32, 8)
    parts = segments(points, "F.Cu", width=0.16)
    if turned == "tilted":
        parts = segments([(0.9 * x - 0.4 * y, 0.4 * x + 0.9 * y) for x, y in points], "F.Cu", width=0.16)
    else:
        parts = segments(points[:9], "F.Cu", width=0.16) + segments(points[8:11], "F.Cu", width=0.2)
        parts += segments(points[10:], "F.Cu", width=0.16)
    (tmp_path / "board.kicad_pcb").write_text(board(parts))
    with pytest.raises(sitscad.SpecError) as caught:
        loaded(tmp_path, "drawn: board.kicad_pcb, net: COIL", "")
    (finding,) = caught.value.findings
    assert (finding.rule, finding.key) == ("SIT011", "coil.drawn")


def test_coils_of_an_array_are_copies_of_the_drawing(drawing):
    folder, _ = drawing
    more = "array: {pattern: explicit, centres: [[-6, 1], [6, 0]], rotations: [90 deg, 0 deg]}\n"
    first, second = sitscad.lay_out(loaded(folder, "drawn: coil.kicad_mod", more)).coils
    for item, other in zip(first.series, second.series, strict=True):
        at, there = (piece.path.start if hasattr(piece, "path") else piece.centre for piece in (item, other))
        assert (at.x + 6e-3, at.y - 1e-3) == approx((-there.y, there.x - 6e-3), abs=1e-9)
    estimates = sitscad.estimate(sitscad.lay_out(loaded(folder, "drawn: coil.kicad_mod", more)))
    assert estimates.coils[0].winding_inductance == approx(estimates.coils[1].winding_inductance, rel=1e-9)


def test_artwork_rules_are_not_checked_for_drawn_board(drawing):
    folder, _ = drawing
    result = sitscad.check(loaded(folder, "drawn: coil.kicad_mod"))
    reasons = {entry.rule: entry.reason for entry in result.not_checked}
    assert "drawn" in reasons["SIT101"]
    assert reasons["SIT101"] == reasons["SIT125"]
    assert {"SIT135", "SIT201", "SIT307"}.isdisjoint(reasons)
    assert all(not edit.key.startswith("coil.") for finding in result.findings for fix in finding.fixes
               for edit in fix.edits)
    small = loaded(folder, "drawn: coil.kicad_mod", "fpc: {body: {shape: rectangle, size: 6}}\n")
    (finding,) = [finding for finding in sitscad.check(small).findings if finding.rule == "SIT135"]
    assert finding.measured < 0.0 < finding.limit


def test_package_of_drawn_board_contains_no_board_files(drawing, tmp_path):
    folder, _ = drawing
    loaded(folder, "drawn: board.kicad_pcb, net: C1")
    stages = "gerber,kicad,laser,firmware,report"
    arguments = ["build", str(folder / "sensor.yaml"), "-o", str(tmp_path), "--only", stages]
    assert CliRunner().invoke(cli, arguments, standalone_mode=False).return_value == 0
    package = tmp_path / "drawn"
    assert not (package / "fpc").exists()
    assert not (package / "kicad").exists()
    texts = [path.read_text() for kind in ("txt", "csv", "html") for path in package.rglob(f"*.{kind}")]
    assert len(texts) > 3
    assert not any("fpc/" in text for text in texts)
    assert (package / "firmware" / "sensor_config.h").exists()
    assert (package / "spec" / "board.kicad_pcb").read_bytes() == (folder / "board.kicad_pcb").read_bytes()
    assert json.loads((package / "manifest.json").read_text())["board_drawn_by_user"] == "board.kicad_pcb"
    assert "drawn by the user in board.kicad_pcb" in (package / "bom.csv").read_text()
    verified = sitscad.verify(package, rebuild=True)
    assert verified.ok
    assert any("board.kicad_pcb" in line for line in verified.looked_at)


@pytest.mark.parametrize(
    ("coil", "rule", "key"),
    [
        ("drawn: missing.kicad_mod", "SIT011", "coil.drawn"),
        ("drawn: ../coil.kicad_mod", "SIT017", "coil.drawn"),
        ("drawn: coil.step", "SIT006", "coil.drawn"),
        ("drawn: text.kicad_mod", "SIT011", "coil.drawn"),
        ("drawn: board.kicad_pcb", "SIT011", "coil.drawn"),
        ("drawn: board.kicad_pcb, net: OTHER", "SIT011", "coil.drawn"),
        ("drawn: board.kicad_pcb, from: J1.1, to: J7.2", "SIT011", "coil.drawn"),
        ("drawn: reversed.kicad_pcb, net: COIL", "SIT011", "coil.drawn"),
        ("drawn: racetrack.kicad_mod", "SIT011", "coil.drawn"),
        ("drawn: coil.kicad_mod, turns: 5", "SIT009", "coil.turns"),
        (f"{WRITTEN}, net: C1", "SIT009", "coil.net"),
    ],
)
def test_unusable_drawing_is_reported_with_rule_key_and_line(coil, rule, key, drawing):
    folder, _ = drawing
    (folder / "text.kicad_mod").write_text("hello")
    (folder / "reversed.kicad_pcb").write_text(two_layers(sense=-1))
    (folder / "racetrack.kicad_mod").write_text(sitscad.coil(
        **{**TWO, "shape": "racetrack", "outer_diameter": ["12 mm", "8 mm"]}).footprint())
    with pytest.raises(sitscad.SpecError) as caught:
        loaded(folder, coil)
    (finding,) = caught.value.findings
    assert (finding.rule, finding.key, finding.line) == (rule, key, 3)
    run = CliRunner().invoke(cli, ["check", str(folder / "sensor.yaml")], standalone_mode=False)
    assert run.return_value == 2


@pytest.mark.parametrize("key", ["tail: {length: 30, connector: zif-0.5mm}", "panel: none", "teardrops: none"])
def test_artwork_keys_are_refused_with_drawn_coil(key, drawing):
    folder, _ = drawing
    with pytest.raises(sitscad.SpecError) as caught:
        loaded(folder, "drawn: coil.kicad_mod", f"fpc: {{{key}}}\n")
    (finding,) = caught.value.findings
    assert (finding.rule, finding.key) == ("SIT009", f"fpc.{key.partition(':')[0]}")


def test_chords_of_other_generator_are_recognised_as_spiral(tmp_path):
    (tmp_path / "board.kicad_pcb").write_text(two_layers())
    spec = loaded(tmp_path, "drawn: board.kicad_pcb, net: COIL")
    assert spec.coil.turns == 14.0
    assert spec.coil.size == approx((8e-3, 8e-3), rel=1e-3)
    assert spec.coil.pitch == approx(0.2e-3, rel=1e-3)
    assert spec.coil.copper.deviation < 0.1 * spec.coil.trace_width
    ours = sitscad.estimate(sitscad.lay_out(loaded(tmp_path, WRITTEN, ""))).coils[0]
    theirs = sitscad.estimate(sitscad.lay_out(loaded(tmp_path, "drawn: board.kicad_pcb, net: COIL", ""))).coils[0]
    smaller = 1.0 - 1.3 * (2.0 * math.pi / 72) ** 2 / 24.0  # the mean radius of chords
    assert theirs.winding_inductance == approx(ours.winding_inductance * smaller, rel=1e-3)


@pytest.mark.parametrize(("written", "key"), [
    ("[{copper: 30 um}, {dielectric: 100 um}, {copper: 30 um}]", "fpc.stackup"),
    ("[{copper: 60 um}, {dielectric: 25 um}, {copper: 60 um}]", "fpc.stackup"),
    ("[{copper: 30 um}, {dielectric: 25 um}, {copper: 30 um}]", None),
    ("[{copper: 18 um}, {dielectric: 40 um}, {copper: 18 um}, {dielectric: 40 um}, {copper: 18 um}]", "coil.drawn"),
])
def test_stackup_of_spec_must_match_stackup_of_board(written, key, tmp_path):
    (tmp_path / "board.kicad_pcb").write_text(two_layers())
    try:
        loaded(tmp_path, "drawn: board.kicad_pcb, net: COIL", f"fpc: {{stackup: {written}}}\n")
    except sitscad.SpecError as error:
        assert {finding.key for finding in error.findings} == {key}
    else:
        assert key is None


def test_changed_keys_keep_the_drawn_coil(drawing):
    folder, _ = drawing
    spec = loaded(folder, "drawn: coil.kicad_mod")
    thicker = spec.replace("elastomer.thickness", "3 mm")
    assert thicker.coil == spec.coil
    assert thicker.elastomer.thickness == approx(3e-3, rel=1e-12)
    with pytest.raises(sitscad.SpecError):
        spec.replace("coil.turns", 10)
    table = sitscad.sweep(spec, {"elastomer.thickness": ["1 mm", "3 mm"], "coil.turns": [10]}, ["inductance"])
    assert table.verdict == ("fails", "fails")


def test_schema_accepts_drawn_key_instead_of_shape_and_size():
    form = sitscad.json_schema()["$defs"]["CoilDocument"]
    assert {"required": ["drawn"]} in form["oneOf"]
    assert form["required"] == []
