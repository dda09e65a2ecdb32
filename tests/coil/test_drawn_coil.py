"""Coils that somebody drew: KiCad boards and footprints, followed and computed."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from drawn_boards import (
    INNER,
    NARROW,
    PITCH,
    RADIUS,
    SPIRAL,
    STACK,
    TOP,
    TURNS,
    TWO,
    board,
    pad,
    segments,
    spiral_points,
    two_layers,
    via,
)
from tolerance import approx

import sitscad
from sitscad.apps.coil.drawn import copper_heights, estimate_drawn_coil, read_drawn_coil
from sitscad.cli import cli
from sitscad.files.formats.kicad.project_files import render
from sitscad.spec.drawn.copper import DrawnCoilError


def coil_file(path, **section):
    path.write_text(sitscad.coil(**section).footprint())
    return str(path)


@pytest.mark.parametrize(
    "section",
    [
        SPIRAL, {**TWO, "shape": "octagon", "turns": 10},
        *(pytest.param(each, marks=(pytest.mark.slow, pytest.mark.more)) for each in (
            TWO, {**TWO, "layers": 4, "turns": 9, "stackup": "flex-4l"}, {**TWO, "shape": "square"},
            {**TWO, "shape": "racetrack", "outer_diameter": ["12 mm", "8 mm"]}, {**TWO, "shape": "hexagon", "turns": 6},
            {**TWO, "turns": 3, "trace_width": "300 um", "trace_spacing": "300 um"},
            {**SPIRAL, "shape": "rectangle", "outer_diameter": ["12 mm", "8 mm"], "turns": 10},
            {**SPIRAL, "shape": "square", "turns": 9},
            {**TWO, "shape": "hexagon", "layers": 4, "stackup": "flex-4l", "turns": 8},
            {**TWO, "outer_diameter": "30 mm", "turns": 30, "stackup": "rigid-2l-1.6mm", "trace_width": "200 um",
             "trace_spacing": "200 um"},
        )),
    ],
)
def test_footprint_read_back_has_inductance_and_resistance_of_its_spec(section, tmp_path):
    spiral = sitscad.coil(**section, frequency=["100 kHz", "5 MHz"])
    (tmp_path / "coil.kicad_mod").write_text(spiral.footprint())
    drawn = sitscad.drawn_coil(str(tmp_path / "coil.kicad_mod"), stackup=spiral.stackup, frequency=["100 kHz", "5 MHz"])
    assert [abs(turns) for _, turns in drawn.conductor.turns()] == approx(
        [float(spiral.coil.most_turns)] * len(spiral.coil.layers), rel=0.02, abs=0)
    for ours, theirs in zip(drawn.at, spiral.at, strict=True):  # the drawing has the stubs to the vias as well
        assert ours.inductance == approx(theirs.inductance, rel=2.5e-3, abs=0)
        assert ours.resistance == approx(theirs.resistance, rel=1.5e-2, abs=0)


@pytest.mark.parametrize(
    "corners", [36, *(pytest.param(each, marks=(pytest.mark.slow, pytest.mark.more)) for each in (72, 180))])
def test_chords_of_spiral_have_inductance_of_curve(corners, tmp_path):
    points = spiral_points(RADIUS, PITCH, TURNS, corners=corners)
    file = tmp_path / "board.kicad_pcb"
    file.write_text(board(segments(points, "F.Cu"), pad("1", *points[0]), pad("2", *points[-1])))
    spiral = sitscad.coil(**SPIRAL, frequency="5 MHz")
    drawn = sitscad.drawn_coil(str(file), net="COIL", frequency="5 MHz")
    # the mean radius of chords is smaller by (pi / corners)^2 / 6, and L goes with its power of about 1.3
    smaller = 1.0 - 1.3 * (2.0 * math.pi / corners) ** 2 / 24.0
    assert drawn.inductance == approx(spiral.inductance * smaller, rel=1.5e-3, abs=0)
    assert drawn.resistance == approx(spiral.resistance, rel=0.01, abs=0)


def test_board_with_two_layers_is_followed_through_its_via(tmp_path):
    file = tmp_path / "board.kicad_pcb"
    file.write_text(two_layers())
    drawn = sitscad.drawn_coil(str(file), net="COIL", frequency="5 MHz")
    assert drawn.conductor.ends == ("pad J1.1", "pad J1.2")
    assert len(drawn.conductor.vias) == 1
    assert [layer for layer, _ in drawn.conductor.turns()] == ["F.Cu", "B.Cu"]
    assert drawn.inductance == approx(sitscad.coil(**TWO, frequency="5 MHz").inductance, rel=3e-3, abs=0)
    assert not drawn.notes


def test_drawn_coil_has_the_capacitance_of_its_spec_with_a_named_stackup(tmp_path):
    file = tmp_path / "coil.kicad_mod"
    spiral = sitscad.coil(**TWO)
    file.write_text(spiral.footprint())
    drawn = sitscad.drawn_coil(str(file), stackup=spiral.stackup)
    assert drawn.capacitance == approx(spiral.capacitance, rel=1e-4)
    assert (drawn.capacitance_error, drawn.self_resonance_error) == (spiral.capacitance_error, 0.1)
    assert drawn.self_resonance == approx(spiral.self_resonance, rel=0.02)
    assert drawn.document()["capacitance_F"] == drawn.capacitance


def test_drawn_coil_of_unknown_shape_has_note_instead_of_capacitance(tmp_path):
    file = tmp_path / "coil.kicad_mod"
    file.write_text(sitscad.coil(**{**TWO, "shape": "racetrack", "outer_diameter": ["12 mm", "8 mm"]}).footprint())
    drawn = sitscad.drawn_coil(str(file), stackup="flex-2l-30um")
    assert (drawn.capacitance, drawn.layout) == (None, None)
    assert any("capacitance" in note for note in drawn.notes)


def test_measured_drawn_coil_has_same_verdict_as_its_spec(root, tmp_path):
    file, data = tmp_path / "coil.kicad_mod", root / "docs/examples/meter.csv"
    spiral = sitscad.coil(**TWO)
    file.write_text(spiral.footprint())
    drawn = sitscad.drawn_coil(str(file), stackup=spiral.stackup)
    ours, theirs = (sitscad.compare(each, str(data)) for each in (spiral, drawn))
    assert ours.cause.cause == theirs.cause.cause == "etched width"
    assert theirs.cause.values[0] == approx(ours.cause.values[0], rel=0.01)
    run = CliRunner().invoke(cli, ["coil", str(file), "--stackup", spiral.stackup, "--measured", str(data)],
                             standalone_mode=False)
    assert run.return_value == 0
    assert theirs.verdict in run.output


def test_layer_of_opposite_sense_is_noted_and_cancels_inductance(tmp_path):
    file = tmp_path / "board.kicad_pcb"
    file.write_text(two_layers(sense=-1))
    drawn = sitscad.drawn_coil(str(file), net="COIL", frequency="5 MHz")
    (first, item), (second, other) = drawn.conductor.turns()
    assert item * other < 0.0
    assert any(second in note or first in note for note in drawn.notes)
    same_sense = sitscad.coil(**TWO).inductance
    assert drawn.inductance < 0.1 * same_sense
    # what is left of the inductance has the absolute error of both layers
    assert drawn.at[0].inductance_error * drawn.inductance == approx(0.005 * same_sense, rel=0.05, abs=0)


@pytest.mark.slow
def test_missing_half_turn_is_noted(tmp_path):
    bottom = spiral_points(RADIUS, PITCH, TURNS, sense=-1)[:35:-1]
    jump = segments([INNER, (INNER[0] - 0.4, INNER[1])], "F.Cu") + via(INNER[0] - 0.4, INNER[1])
    jump += segments([(INNER[0] - 0.4, INNER[1]), bottom[0]], "B.Cu")
    file = tmp_path / "board.kicad_pcb"
    file.write_text(board(segments(TOP, "F.Cu"), jump, segments(bottom, "B.Cu"), pad("1", *TOP[0]),
                          pad("2", *bottom[-1], layer="B.Cu")))
    drawn = sitscad.drawn_coil(str(file), net="COIL")
    turns = [abs(count) for _, count in drawn.conductor.turns()]
    assert max(turns) - min(turns) > 0.4
    assert any("unequal" in note for note in drawn.notes)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (two_layers(cut=500), "mm away"),
        (two_layers().replace("(via ", "(text "), "via is missing"),
        (two_layers(more=segments([(TOP[100][0], TOP[100][1]), (TOP[172][0], TOP[172][1])], "F.Cu")), "branches"),
        (two_layers(more='(zone (net 1) (net_name "COIL") (layer "F.Cu") (polygon (pts (xy 0 0) (xy 1 0) (xy 1 1))))'),
         "zone"),
        (board(segments([(6.0, 0.0), *NARROW, (0.0, 0.0)], "F.Cu"), pad("1", 6.0, 0.0), pad("2", 0.0, 0.0)), "touch"),
    ],
)
def test_faulty_generated_drawing_is_refused_with_coordinates(text, place, tmp_path):
    (tmp_path / "board.kicad_pcb").write_text(text)
    with pytest.raises(DrawnCoilError, match=place) as caught:
        sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), net="COIL")
    assert " mm" in str(caught.value)


def test_third_conductor_run_returns_to_top_layer(tmp_path):
    """The coil's outer end goes back to the top through a second via, as many generators draw it."""
    bottom = spiral_points(RADIUS, PITCH, TURNS, sense=-1)[::-1]
    out = (bottom[-1][0] + 1.0, bottom[-1][1] + 1.0)
    file = tmp_path / "board.kicad_pcb"
    file.write_text(board(
        segments(TOP, "F.Cu"), segments([INNER, (INNER[0] - 0.4, INNER[1])], "F.Cu"), via(INNER[0] - 0.4, INNER[1]),
        segments([(INNER[0] - 0.4, INNER[1]), *bottom, out], "B.Cu"), via(*out),
        segments([out, (out[0] + 1.0, out[1])], "F.Cu"), pad("1", *TOP[0]), pad("2", out[0] + 1.0, out[1]),
    ))
    drawn = sitscad.drawn_coil(str(file), net="COIL", frequency="5 MHz")
    assert [layer for layer, _ in drawn.conductor.turns()] == ["F.Cu", "B.Cu", "F.Cu"]
    assert drawn.inductance == approx(sitscad.coil(**TWO, frequency="5 MHz").inductance, rel=5e-3, abs=0)


def test_arcs_of_kicad_5_equal_arcs_of_later_versions(tmp_path):
    """Footprint generators for KiCad 5 write the centre, the first point and an angle, clockwise on the screen."""
    arcs = {"five": "", "six": ""}
    radius = 4.0
    for half in range(20):
        x, side = 0.0 if half % 2 == 0 else -0.1, 1 if half % 2 == 0 else -1
        first, last = x + side * radius, x - side * radius
        arcs["five"] += f'(fp_arc (start {x} 0) (end {first} 0) (angle 180) (layer F.Cu) (width 0.1))'
        arcs["six"] += (f'(fp_arc (start {first} 0) (mid {x} {side * radius}) (end {last} 0) (layer "F.Cu") '
                        '(stroke (width 0.1) (type solid)))')
        radius -= 0.1
    drawn = []
    for name, text in arcs.items():
        pads = "".join(f'(pad {number} smd circle (at {at} 0) (size 0.1 0.1) (layers F.Cu))'
                       for number, at in ((1, 4.0), (2, last)))
        (tmp_path / f"{name}.kicad_mod").write_text(f"(module coil (layer F.Cu) {text} {pads})")
        drawn.append(sitscad.drawn_coil(str(tmp_path / f"{name}.kicad_mod"), stackup="flex-2l-30um"))
    five, six = drawn
    assert five.inductance == approx(six.inductance, rel=1e-9, abs=0)
    assert [turns for _, turns in five.conductor.turns()] == approx([-10.0], rel=0.01, abs=0)


@pytest.mark.parametrize(("dx", "dy"), [(0.07, 0.0), (0.06, 0.05), (0.0, -0.08)])
def test_track_ends_with_touching_copper_are_joined(dx, dy, tmp_path):
    """A lead drawn by hand rarely ends on the last point of a generated spiral."""
    x, y = TOP[0]
    (tmp_path / "exact.kicad_pcb").write_text(two_layers())
    lead = segments([(x + dx, y + dy), (x + 2.0, y + dy)], "F.Cu") + pad("3", x + 2.0, y + dy)
    text = two_layers(more=lead).replace('"1" smd rect', '"1" np_thru_hole rect')
    (tmp_path / "lead.kicad_pcb").write_text(text)
    exact = sitscad.drawn_coil(str(tmp_path / "exact.kicad_pcb"), net="COIL")
    joined = sitscad.drawn_coil(str(tmp_path / "lead.kicad_pcb"), net="COIL")
    assert joined.conductor.length - exact.conductor.length == approx(2e-3, rel=0.06, abs=0)
    assert joined.inductance == approx(exact.inductance, rel=2e-3, abs=0)


def test_turns_of_a_wedge_are_counted_about_its_innermost_turn(tmp_path):
    """The middle of the copper of a wedge lies outside of its inner turns, which are near its round side."""
    corners = np.array([(-4.0, 4.0), (0.0, -2.0), (4.0, 4.0)])
    points = np.array([(0.0, 3.0) + (1.0 - k / 36.0) * (corners[k % 3] - (0.0, 3.0)) for k in range(33)])
    (tmp_path / "wedge.kicad_pcb").write_text(board(segments(points, "F.Cu", width=0.05), pad("1", *points[0]),
                                                    pad("2", *points[-1])))
    ((_, turns),) = sitscad.drawn_coil(str(tmp_path / "wedge.kicad_pcb"), net="COIL").conductor.turns()
    assert abs(turns) == approx(32 / 3, rel=0.05, abs=0)


@pytest.mark.slow
def test_dead_end_is_omitted_and_noted(tmp_path):
    file = tmp_path / "board.kicad_pcb"
    file.write_text(two_layers(more=segments([TOP[0], (TOP[0][0] + 3.0, TOP[0][1])], "F.Cu")))
    plain = tmp_path / "plain.kicad_pcb"
    plain.write_text(two_layers())
    with_end, without = (sitscad.drawn_coil(str(path), net="COIL") for path in (file, plain))
    assert with_end.inductance == approx(without.inductance, rel=1e-9, abs=0)
    assert any("3 mm" in note for note in with_end.notes)


def test_pads_select_terminals_across_nets(tmp_path):
    text = two_layers().replace('"1" smd rect (at 0 0) (size 0.1 0.1) (layers "F.Cu") (net 1 "COIL")',
                                '"1" smd rect (at 0 0) (size 0.1 0.1) (layers "F.Cu") (net 2 "GND")')
    (tmp_path / "board.kicad_pcb").write_text(text)
    drawn = sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), start="J1.1", end="J1.2")
    assert len(drawn.conductor.vias) == 1
    with pytest.raises(DrawnCoilError, match="J9"):
        sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), start="J1.1", end="J9.2")


@pytest.mark.parametrize(
    "content",
    [b"", b"hello", b"(kicad_pcb", b"(kicad_pcb))", b"\xff\xfe(kicad_pcb)", b"(kicad_sch (version 1))",
     b"(kicad_pcb (layers (0 \"F.Cu\" signal)) (segment (start 0 nan) (end 1 1) (width 0.1) (layer \"F.Cu\") (net 1)))",
     b"(" * 100_000, two_layers().encode()[:3000]],
)
def test_unsuitable_files_are_refused_with_file_name(content, tmp_path):
    file = tmp_path / "some.kicad_pcb"
    file.write_bytes(content)
    run = CliRunner().invoke(cli, ["coil", str(file), "--net", "COIL", "--svg", str(tmp_path / "a.svg")],
                             standalone_mode=False)
    assert run.return_value == 2
    assert str(file) in run.stderr
    assert not (tmp_path / "a.svg").exists()


def test_net_of_too_many_tracks_is_refused(tmp_path):
    points = [(0.001 * k, 0.0) for k in range(20_002)]
    (tmp_path / "board.kicad_pcb").write_text(board(segments(points, "F.Cu")))
    with pytest.raises(DrawnCoilError, match="20000"):
        sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), net="COIL")


def test_board_without_net_name_or_layer_heights_is_refused(tmp_path):
    file = tmp_path / "board.kicad_pcb"
    file.write_text(two_layers().replace(STACK, ""))
    with pytest.raises(DrawnCoilError, match="COIL"):
        sitscad.drawn_coil(str(file))
    with pytest.raises(DrawnCoilError, match="other"):
        sitscad.drawn_coil(str(file), net="other")
    with pytest.raises(DrawnCoilError, match="stack-up"):
        sitscad.drawn_coil(str(file), net="COIL")
    named = sitscad.drawn_coil(str(file), net="COIL", stackup="flex-2l-30um")
    assert [layer.name for layer in named.heights] == ["F.Cu", "B.Cu"]


def test_heights_of_a_board_are_read_from_its_stack(tmp_path):
    file = tmp_path / "board.kicad_pcb"
    file.write_text(two_layers())
    copper, conductor = read_drawn_coil(str(file), "COIL")
    front, back = copper_heights(copper)
    assert front.z - back.z == approx(55e-6, rel=1e-9, abs=0)
    assert (front.thickness, back.thickness) == approx((30e-6, 30e-6), rel=1e-9, abs=0)
    thick = estimate_drawn_coil(conductor, [front, back], (1e6,))
    assert thick.direct_current_resistance == approx(
        conductor.length / (5.8e7 * 100e-6 * 30e-6), rel=5e-3, abs=0)


def test_coil_command_prints_writes_and_draws_drawn_coil(tmp_path):
    file, svg = tmp_path / "board.kicad_pcb", tmp_path / "coil.svg"
    file.write_text(two_layers())
    arguments = ["coil", str(file), "--net", "COIL", "--at", "5MHz", "--svg", str(svg), "--format", "json"]
    run = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert run.return_value == 0
    document = json.loads(run.stdout)
    assert [row["layer"] for row in document["runs"]] == ["F.Cu", "B.Cu"]
    inductance = sitscad.drawn_coil(str(file), net="COIL", frequency=5e6).inductance
    assert document["at_frequency"][0]["inductance_H"] == inductance
    assert svg.read_text().count("<path") > 100
    text = CliRunner().invoke(cli, ["coil", str(file), "--net", "COIL"], standalone_mode=False)
    assert "from pad J1.1 to pad J1.2" in text.output
    refused = CliRunner().invoke(cli, ["coil", str(file), "--turns", "3"])
    assert refused.exit_code != 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_coil", "grasper_4layer", "racetrack_jaw", "three_axis_pad", "skin_strip_6"])
def test_written_template_boards_read_back_with_estimated_inductance_and_resistance(name, root, tmp_path):
    """Leads, tail and vias are followed as well, so the sum of all parts of the terminal inductance is compared."""
    layout = sitscad.lay_out(sitscad.load(root / "templates" / f"{name}.yaml"))
    coil = sitscad.estimate(layout).coils[0]
    files = render(layout)
    (board_file,) = (path for path in files if path.endswith(".kicad_pcb"))
    (tmp_path / "board.kicad_pcb").write_bytes(files[board_file])
    drawn = sitscad.drawn_coil(str(tmp_path / "board.kicad_pcb"), net="C1")
    parts = math.fsum(value for part, value in coil.inductance_parts.items() if part != "crowding")
    assert drawn.low_frequency_inductance == approx(parts, rel=2.5e-3, abs=0)
    assert drawn.direct_current_resistance == approx(coil.terminal_resistance_dc, rel=0.015, abs=0)
