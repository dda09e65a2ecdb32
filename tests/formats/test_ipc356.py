"""The netlist for the bare-board test, parsed back by gerbonara."""

from __future__ import annotations

import warnings
from dataclasses import replace

import layouts
import pytest
from tolerance import approx

from sitscad.files.formats import ipc356

pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")

from gerbonara.ipc356 import Netlist, PadType, SoldermaskInfo

MM = 1e-3


def text_of(board) -> str:
    (text,) = ipc356.render(board).values()
    return text.decode("ascii")


def parsed(board) -> Netlist:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return Netlist.from_string(text_of(board), "board.d356")


def test_netlist_records_match_contacts_and_vias(board):
    records = parsed(board).test_records
    contacts = [(r.net_name, r.ref_des, r.pin) for r in records if not r.is_via]
    assert contacts == [(pad.net, "J1", str(pad.number)) for pad in board.pads]
    assert [(r.x, r.y, r.w, r.h) for r in records if not r.is_via] == [
        approx((pad.centre.x / MM, pad.centre.y / MM, 3.0, 0.3), rel=1e-6) for pad in board.pads
    ]
    vias = sorted(board.vias, key=lambda via: via.net)
    assert [r.net_name for r in records if r.is_via] == [via.net for via in vias]
    assert [(r.x, r.y, r.w, r.hole_dia) for r in records if r.is_via] == [
        approx((via.centre.x / MM, via.centre.y / MM, 0.35, 0.15), rel=1e-6) for via in vias
    ]
    assert all(r.is_plated and r.is_middle for r in records if r.is_via)
    assert {r.pad_type for r in records if r.is_via} == {PadType.THROUGH_HOLE}
    assert {r.pad_type for r in records if not r.is_via} == {PadType.SMD_PAD}


def test_each_coil_is_a_net_with_both_contacts(board):
    netlist = parsed(board)
    for net in board.nets:
        assert len([r for r in netlist.records_by_net_name(net) if r.ref_des == "J1"]) == 2


def test_netlist_access_and_mask_codes_follow_openings(board):
    for record in parsed(board).test_records:
        assert record.access_layer == (0 if record.is_via else 1)
        assert record.solder_mask == (SoldermaskInfo.BOTH if record.is_via else SoldermaskInfo.SECONDARY)


def test_contact_on_last_layer_has_bottom_access_code():
    board = layouts.two_coils()
    pads = tuple(replace(pad, layer=2) for pad in board.pads)
    board = replace(board, pads=pads, bottom_openings=board.top_openings, top_openings=())
    records = [r for r in parsed(board).test_records if not r.is_via]
    assert {(r.access_layer, r.solder_mask) for r in records} == {(2, SoldermaskInfo.PRIMARY)}


def test_netlist_fields_are_in_columns_of_the_standard():
    board = layouts.two_coils(name="n" * 64)
    lines = text_of(board).splitlines()
    assert lines[-1] == "999"
    assert "P  UNITS CUST 1" in lines
    assert max(len(line) for line in lines) <= 80
    for line in (line for line in lines if line[0] == "3"):
        marks = {38: "A", 41: "X", 49: "Y", 57: "X", 62: "Y", 67: "R", 72: "S"}
        assert {column: line[column] for column in marks} == marks
        assert line[42] in "+-" and line[50] in "+-"


def test_netlist_field_overflow_is_refused():
    board = layouts.two_coils()
    long_net = tuple(replace(via, net="a-net-of-20-characters"[:20]) for via in board.vias)
    coils = tuple(replace(coil, net="a-net-of-20-characters"[:20]) for coil in board.coils)
    with pytest.raises(ValueError, match="14 characters"):
        ipc356.render(replace(board, coils=coils, vias=long_net, pads=()))
    wide = tuple(replace(pad, size=(0.02, 1e-4)) for pad in board.pads)
    with pytest.raises(ValueError, match="digits"):
        ipc356.render(replace(board, pads=wide))
