"""The intended nets as the files' text states them."""

from __future__ import annotations

import pytest
from tolerance import approx

from sitscad.files.extraction.intent import (
    Mark,
    MarkSource,
    is_ipc_d_356,
    marks_of_gerber,
    marks_of_ipc_d_356,
    read_marks,
)
from tests.extraction.conftest import HEADER, NETLIST, pad, record, track, via

HEAD = HEADER.format(function="Copper,L1,Top", polarity="Positive")


def places(marks):
    return [(mark.net, round(mark.x * 1e6), round(mark.y * 1e6)) for mark in marks]


def test_gerber_draws_and_flashes_have_net_marks():
    marks = marks_of_gerber(HEAD + track("C1", (0, 0), (1, 0), (1, 2)) + via("C2", 3, 4) + "M02*\n", layer=1)
    assert places(marks) == [("C1", 0, 0), ("C1", 1000, 0), ("C1", 1000, 2000), ("C2", 3000, 4000)]
    assert [mark.is_via for mark in marks] == [False, False, False, True]


def test_gerber_pad_mark_has_pin_and_function():
    (mark,) = marks_of_gerber(HEAD + pad("C1", "J1-2", 1, -1, "C1.B") + "M02*\n", layer=2)
    assert mark == Mark("C1", 2, approx(1e-3, rel=1e-6), approx(-1e-3, rel=1e-6), MarkSource.X2, "J1-2", "C1.B")


def test_deleted_gerber_attributes_do_not_apply_to_later_objects():
    text = HEAD + "%TO.N,C1*%\n%TO.P,J1,1*%\nD11*\nX0Y0D03*\n%TD.P*%\nX0Y1D03*\n%TD.N*%\nX0Y2D03*\nM02*\n"
    assert [mark.pin for mark in marks_of_gerber(text, 1)] == ["J1-1", None]


def test_objects_without_net_give_no_marks():
    assert marks_of_gerber(HEAD + track("N/C", (0, 0), (1, 0)) + track("", (0, 0), (1, 0)), 1) == ()


def test_gerber_modal_coordinates_inches_escapes_and_comments_are_parsed():
    text = (
        "G04 %TO.N,comment*\n%FSLAX24Y24*%\n%MOIN*%\n%ADD10C,0.01*%\n%TO.N,a\\u002Cb*%\nD10*\n"
        "X10000Y20000D02*\nX20000D01*\n"
    ).replace("%TO.N,comment*", "TO.N comment*")
    assert places(marks_of_gerber(text, 1)) == [("a,b", 25400, 50800), ("a,b", 50800, 50800)]


def test_gerber_arcs_give_marks_at_both_ends():
    text = HEAD + "%TO.N,C1*%\nD10*\nX1000000Y0D02*\nG03X0Y1000000I-1000000J0D01*\n"
    assert places(marks_of_gerber(text, 1)) == [("C1", 1000, 0), ("C1", 0, 1000)]


def test_netlist_records_are_parsed_by_columns():
    marks = marks_of_ipc_d_356(NETLIST)
    assert [(m.net, m.layer, m.pin, m.is_via) for m in marks] == [
        ("C1", 1, "J1-1", False),
        ("C1", 1, "J1-2", False),
        ("C1", None, None, True),
        ("C1", None, None, True),
        ("C2", 1, "J1-3", False),
        ("C2", 1, "J1-4", False),
    ]
    assert (marks[2].x, marks[2].y) == approx((5e-3, 0.0), rel=1e-6, abs=1e-12)


def test_netlist_units_and_name_aliases_are_applied():
    text = "P  UNITS CUST 0\nP  NNAME1  a-name-that-is-longer-than-the-column\n" + record(
        "327", "NNAME1", "J1-1", "02", 1, 1
    )
    (mark,) = marks_of_ipc_d_356(text)
    assert mark.net == "a-name-that-is-longer-than-the-column"
    assert (mark.layer, mark.x) == (2, approx(1000 * 2.54e-6, rel=1e-6))


def test_netlist_lines_with_shifted_columns_are_refused():
    with pytest.raises(ValueError, match="line 2"):
        marks_of_ipc_d_356("P  UNITS CUST 1\n327C1 J1-1 A01 X0 Y0\n")
    with pytest.raises(ValueError, match="CUST 7"):
        marks_of_ipc_d_356("P  UNITS CUST 7\n")


def test_netlist_is_distinguished_from_gerber_and_pdf_text():
    assert is_ipc_d_356(NETLIST)
    assert not is_ipc_d_356(HEAD)
    # the end of a PDF whose table of contents happens to begin at that byte: a package with one could not be verified
    assert not is_ipc_d_356("trailer\n<< /Size 12 >>\nstartxref\n32746\n%%EOF\n")


def test_text_starting_like_a_record_is_not_taken_for_netlist():
    """One package of some thousand has such a readme: its own `verify` could not read it."""
    assert not is_ipc_d_356("Fingerprint\n31746ba2e529cf6a34b6cb3542f9dc9c788091b0f53c80468b6245fa14899fe0\n")


def test_archives_are_not_read_as_netlists(tmp_path):
    """An order's archive holds the netlist and a PDF, whose count of bytes began like a test record: verify stopped."""
    (tmp_path / "board.ipc").write_text(NETLIST, encoding="utf-8")
    alone = read_marks(tmp_path, ())
    (tmp_path / "order.zip").write_text("PK\x03\x04" + NETLIST + "startxref\n32746\n%%EOF\n", encoding="utf-8")
    (tmp_path / "drawing.pdf").write_text("%PDF-1.4\n" + NETLIST + "startxref\n32746\n%%EOF\n", encoding="utf-8")
    assert read_marks(tmp_path, ()) == alone != ()
