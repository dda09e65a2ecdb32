"""Nets, loops and differences out of boards written by hand, whole ones and broken ones."""

from __future__ import annotations

import math

import pytest
from tolerance import approx

pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")
pytest.importorskip("shapely", reason="shapely is not installed: pip install 'sitscad[all]' brings it")

from sitscad.files.extraction.artwork import ExtractionError
from sitscad.files.extraction.differences import DifferenceKind, compare, extract
from tests.extraction.conftest import Board, count, pad, record, track, via


def kinds(board: Board, folder) -> list[DifferenceKind]:
    return [difference.kind for difference in compare(extract(board.write(folder)))]


def test_correct_board_has_expected_nets_and_no_difference(two_nets, tmp_path):
    board = extract(two_nets.write(tmp_path))
    assert compare(board) == ()
    assert [net.names for net in board.nets] == [("C1",), ("C2",)]
    assert [contact.pin for contact in board.net("C1").contacts] == ["J1-1", "J1-2"]
    assert [contact.function for contact in board.net("C1").contacts] == ["C1.A", "C1.B"]
    assert len(board.net("C1").holes) == 2
    assert all(not net.loops for net in board.nets)


def test_extracted_copper_area_matches_drawn_area(two_nets, tmp_path):
    """C2 on the top layer: two pads 0.6 x 0.4 mm and 4.4 mm of a 0.1 mm track between them."""
    top = float(extract(two_nets.write(tmp_path)).artwork.copper[0].area)
    two_tracks_and_their_via_pads = 2 * (0.24 + (4.7 - 0.15) * 0.1 + math.pi * 0.15**2 + chord_area(0.15, 0.05))
    assert top * 1e6 == approx(2 * 0.24 + 4.4 * 0.1 + two_tracks_and_their_via_pads, rel=2e-4)


def chord_area(radius: float, half_width: float) -> float:
    """What a track of half that width adds between the chord x = radius and the circle it runs into."""
    half_angle = math.asin(half_width / radius)
    segment = radius**2 * (half_angle - math.sin(half_angle) * math.cos(half_angle))
    return 2 * half_width * radius * (1 - math.cos(half_angle)) - segment


def test_extraction_reads_fpc_folder_of_package(two_nets, tmp_path):
    (tmp_path / "fpc").mkdir()
    two_nets.write(tmp_path / "fpc")
    assert len(extract(tmp_path).nets) == 2


def test_track_between_two_nets_is_reported_as_short(two_nets, tmp_path):
    two_nets.layers[0] += track("C1", (1, 2), (1, 3))
    assert kinds(two_nets, tmp_path) == [DifferenceKind.SHORT]


def test_hole_through_track_of_other_net_is_reported_as_short(two_nets, tmp_path):
    two_nets.layers[1] += via("C2", 2, 3) + track("C2", (2, 3), (2, 1), (5, 1))
    two_nets.layers[0] += via("C2", 2, 3)
    two_nets.holes.append((2, 3))
    assert kinds(two_nets, tmp_path) == [DifferenceKind.SHORT]


def test_gap_in_track_is_reported_as_open(two_nets, tmp_path):
    two_nets.layers[0] = two_nets.layers[0].replace(track("C2", (0, 3), (5, 3)), track("C2", (0, 3), (4.5, 3)))
    assert kinds(two_nets, tmp_path) == [DifferenceKind.OPEN]


def test_gap_cut_by_clear_polarity_is_reported_as_open(two_nets, tmp_path):
    two_nets.layers[0] += "%LPC*%\nD13*\nX2000000Y3000000D03*\n"
    assert kinds(two_nets, tmp_path) == [DifferenceKind.OPEN]


def test_bypassed_winding_is_reported_as_dead_end(two_nets, tmp_path):
    """A track that hangs on one hole only carries no current: the net is whole, and yet half a coil is missing."""
    two_nets.layers[0] += track("C1", (5, 0), (5, 2))
    two_nets.layers[1] = via("C1", 5, 0) + via("C1", 5, 2) + track("C1", (5, 0), (5, 1))
    (result,) = compare(extract(two_nets.write(tmp_path)))
    assert (result.kind, result.nets, result.layer) == (DifferenceKind.DEAD_END, ("C1",), 2)
    assert result.x == approx(5e-3, abs=6e-5) and 0.1e-3 < result.y < 1.1e-3


def test_missing_hole_is_reported_with_position_and_open_net(two_nets, tmp_path):
    del two_nets.holes[1]
    differences = compare(extract(two_nets.write(tmp_path)))
    assert [d.kind for d in differences] == [DifferenceKind.OPEN, DifferenceKind.NO_HOLE]
    assert (differences[1].x, differences[1].y) == approx((5e-3, 2e-3), rel=1e-6)


@pytest.mark.parametrize(("x", "complaint"), [(4.9, "breaks out of its pad"), (7.0, "has no pad")])
def test_hole_off_its_pad_is_reported_on_every_layer(two_nets, tmp_path, x, complaint):
    two_nets.holes.append((x, 0.0))
    two_nets.layers[0] = two_nets.layers[0].replace(
        track("C1", (0, 0), (5, 0)), track("C1", (0, 0.0), (4.0, 0), (5, 0))
    )
    differences = [d for d in compare(extract(two_nets.write(tmp_path))) if d.kind is DifferenceKind.HOLE_OFF_PAD]
    assert [d.layer for d in differences] == [1, 2]
    assert all(complaint in d.message for d in differences)


def test_unplated_holes_are_reported_as_open_and_off_pad(two_nets, tmp_path):
    two_nets.plating = "NonPlated"
    assert set(kinds(two_nets, tmp_path)) == {DifferenceKind.OPEN, DifferenceKind.HOLE_OFF_PAD, DifferenceKind.NO_HOLE}


def test_touching_turns_are_reported_as_loop(two_nets, tmp_path):
    """A hairpin whose legs, 0.3 mm apart, touch at the open end: one net, no short, but current runs past the turn."""
    two_nets.layers[0] += track("C2", (5, 3), (8, 3), (8, 3.3), (6, 3.3), (6, 3.05))
    (loop,) = extract(two_nets.write(tmp_path)).net("C2").loops
    assert loop.layer == 1
    assert loop.area == approx(1.9e-3 * 0.2e-3, rel=1e-3)
    assert kinds(two_nets, tmp_path) == [DifferenceKind.LOOP]


def test_turns_closer_than_growth_are_reported_as_loop(two_nets, tmp_path):
    two_nets.layers[0] += track("C2", (5, 3), (8, 3), (8, 3.3), (6, 3.3), (6, 3.12))
    two_nets.write(tmp_path)
    assert extract(tmp_path).net("C2").loops == ()
    assert extract(tmp_path, growth=9e-6).net("C2").loops == ()
    assert len(extract(tmp_path, growth=11e-6).net("C2").loops) == 1


def test_second_path_through_layers_is_reported_as_loop(two_nets, tmp_path):
    two_nets.layers[0] += track("C1", (5, 0), (5, 2))
    (loop,) = extract(two_nets.write(tmp_path)).net("C1").loops
    assert (loop.layer, loop.x) == (None, approx(5e-3, rel=1e-6))


def test_three_stitching_holes_between_tracks_give_two_loops(tmp_path):
    rail = track("C1", (0, 0), (4, 0)) + "".join(via("C1", x, 0) for x in (1, 2, 3))
    board = extract(Board([rail, rail], [(1, 0), (2, 0), (3, 0)]).write(tmp_path))
    assert len(board.net("C1").loops) == 2


def test_copper_without_net_is_reported(two_nets, tmp_path):
    two_nets.layers[1] += "D10*\nX0Y8000000D02*\nX1000000Y8000000D01*\n"
    assert kinds(two_nets, tmp_path) == [DifferenceKind.NO_NET]


def test_contact_under_coverlay_is_reported(two_nets, tmp_path):
    two_nets.openings["Top"] = "".join(f"D13*\nX{count(x)}Y{count(y)}D03*\n" for x, y in ((0, 0), (0, 2), (0, 3)))
    (difference,) = compare(extract(two_nets.write(tmp_path)))
    assert (difference.kind, difference.nets) == (DifferenceKind.COVERED, ("C2",))


def test_contact_mostly_under_coverlay_is_reported(two_nets, tmp_path):
    """An opening that only touched a contact was taken for one that opens it."""
    whole = ((0, 0), (0, 2), (0, 3))
    two_nets.openings["Top"] = "".join(f"D13*\nX{count(x)}Y{count(y)}D03*\n" for x, y in (*whole, (5.4, 3)))
    (difference,) = compare(extract(two_nets.write(tmp_path)))
    assert difference.kind is DifferenceKind.COVERED and "% of it under the coverlay" in difference.message
    two_nets.openings["Top"] = "".join(f"D13*\nX{count(x)}Y{count(y)}D03*\n" for x, y in (*whole, (5.1, 3)))
    assert kinds(two_nets, tmp_path) == []


def test_opening_over_copper_without_contact_is_reported(two_nets, tmp_path):
    whole = ((0, 0), (0, 2), (0, 3), (5, 3))
    two_nets.openings["Top"] = "".join(f"D13*\nX{count(x)}Y{count(y)}D03*\n" for x, y in (*whole, (2.5, 3)))
    (difference,) = compare(extract(two_nets.write(tmp_path)))
    assert (difference.kind, difference.x) == (DifferenceKind.EXPOSED, approx(2.5e-3, abs=0.3e-3))


def test_netlist_with_different_net_names_is_reported(two_nets, tmp_path):
    two_nets.netlist = two_nets.netlist.replace("327C2  ", "327C9  ")
    assert kinds(two_nets, tmp_path) == [DifferenceKind.SHORT, DifferenceKind.NETLISTS, DifferenceKind.NETLISTS]


def test_netlist_record_without_copper_is_reported(two_nets, tmp_path):
    two_nets.netlist += record("327", "C1", "J1-9", "01", 9, 9)
    (difference,) = compare(extract(two_nets.write(tmp_path)))
    assert (difference.kind, difference.layer) == (DifferenceKind.NO_COPPER, 1)


def test_board_without_named_nets_is_reported_as_without_intent(tmp_path):
    bare = "D10*\nX0Y0D02*\nX1000000Y0D01*\n"
    assert DifferenceKind.NO_INTENT in kinds(Board([bare]), tmp_path)


def test_through_hole_joins_four_layers(tmp_path):
    layers = [via("C1", 0, 0)] * 4
    layers[3] = layers[3] + track("C1", (0, 0), (1, 0)) + pad("C1", "J1-1", 1, 0)
    board = extract(Board(layers, [(0, 0)]).write(tmp_path))
    assert compare(board) == ()
    assert [contact.layer for contact in board.net("C1").contacts] == [4]


def test_annulus_and_disc_have_expected_areas(tmp_path):
    """A full circle drawn with a 0.1 mm pen, and a half disc as a region with an arc."""
    ring = "%TO.N,C1*%\nD10*\nG03*\nX2000000Y0D02*\nX2000000Y0I-2000000J0D01*\n%TD*%\n"
    disc = "%TO.N,C2*%\nG36*\nX6000000Y-1000000D02*\nG03*\nX6000000Y1000000I0J1000000D01*\n"
    disc += "G01*\nX6000000Y-1000000D01*\nG37*\n"
    board = extract(Board([ring + disc]).write(tmp_path))
    areas = {net.names: net.pieces[0].shape.area * 1e6 for net in board.nets}
    assert areas["C1",] == approx(2 * math.pi * 2.0 * 0.1, rel=1e-5)
    assert areas["C2",] == approx(math.pi / 2, rel=1e-4)
    assert len(board.net("C1").loops) == 1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Copper,L2,Bot", "Copper,L1,Top", "both claim to be copper layer 1"),
        ("Copper,L2,Bot", "Copper,L3,Bot", "missing"),
        ("Copper,L2,Bot", "Copper,Bottom", "L1, L2"),
        ("D01*", "D01X*", "Unknown statement"),
        ("M02*\n", "", "EOF"),
    ],
)
def test_inconsistent_gerber_files_are_refused(two_nets, tmp_path, old, new, says):
    two_nets.write(tmp_path)
    path = tmp_path / "copper-L2.gbr"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ExtractionError, match=says):
        extract(tmp_path)


def test_drill_file_with_wrong_layer_span_is_refused(two_nets, tmp_path):
    two_nets.write(tmp_path)
    path = tmp_path / "holes.drl"
    path.write_text(path.read_text().replace("1,2,PTH", "1,4,PTH"))
    with pytest.raises(ExtractionError, match="layers 1 to 4 of a board with 2"):
        extract(tmp_path)


def test_missing_directory_or_directory_without_gerber_files_is_refused(tmp_path):
    with pytest.raises(ExtractionError, match="no Gerber file"):
        extract(tmp_path)
    with pytest.raises(ExtractionError, match="not a directory"):
        extract(tmp_path / "nowhere")
