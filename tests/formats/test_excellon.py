"""The drill file, parsed back by gerbonara and compared with the layout and with the Gerber pads."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import layouts
from gerber_shapes import function_of, read
from gerbonara import ExcellonFile
from tolerance import approx

from sitscad.files.formats import gerber
from sitscad.kernels.geometry.path import Point
from sitscad.layout.board import Via

MM = 1e-3


def drill(board) -> bytes:
    return gerber.render_drills(board)["fpc/two-coils-PTH.drl"]


def parsed(text: bytes) -> ExcellonFile:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return ExcellonFile.from_string(text.decode("ascii"), filename="PTH.drl")


def test_drill_holes_match_vias_of_layout(board):
    holes = [(hole.x, hole.y, hole.tool.diameter, hole.plated) for hole in parsed(drill(board)).drills()]
    assert holes == [
        approx((via.centre.x / MM, via.centre.y / MM, via.drill / MM, True), abs=1e-6) for via in board.vias
    ]


def test_drill_holes_are_centred_in_gerber_via_pads(board):
    copper = read(gerber.render(board)["fpc/two-coils-B_Cu.gbr"])
    pads = {(pad.x, pad.y) for pad in copper.objects if function_of(pad) == ("ViaPad",)}
    assert {(hole.x, hole.y) for hole in parsed(drill(board)).drills()} == pads


def test_drill_tools_are_unique_and_sorted_by_diameter():
    board = layouts.two_coils()
    vias = tuple(
        Via(Point(-1.2345678e-3 * i, 1e-3), d, 0.5e-3, "C1") for i, d in enumerate((0.3e-3, 0.2e-3, 0.30000000001e-3))
    )
    text = drill(replace(board, vias=vias))
    assert re.findall(rb"^T\d+C.*$", text, re.M) == [b"T1C0.200", b"T2C0.300"]
    assert [hole.x for hole in parsed(text).drills()] == approx([-1.234568, 0.0, -2.469136], abs=1e-9)


def test_drill_header_states_file_function_and_format(board):
    text = drill(board).decode("ascii")
    assert f"; #@! TF.FileFunction,Plated,1,{board.copper_layers},PTH\n" in text
    assert text.startswith("M48\n") and text.endswith("M30\n")
    assert "\nMETRIC\n" in text
    assert all("." in number for number in re.findall(r"[XYC](-?[0-9.]+)$", text, re.M)), "a number without its point"
    assert "-0.0\n" not in text and "X-0.0Y" not in text


def test_layout_without_vias_has_no_drill_file():
    assert gerber.render_drills(replace(layouts.two_coils(), vias=())) == {}
