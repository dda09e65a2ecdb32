"""Resistance of copper areas against shapes whose resistance is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

pytest.importorskip("gmsh", reason="gmsh is not installed: pip install 'sitscad[all]' brings it")
pytest.importorskip("scipy", reason="scipy is not installed: pip install 'sitscad[all]' brings it")
pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")

from shapely import Point, Polygon, box

from sitscad.files.extraction.artwork import PlottedHole
from sitscad.files.extraction.differences import BarePad, ExtractedNet, Piece, extract
from tests.oracles import copper_resistance as resistance
from tests.oracles.copper_resistance import COPPER_RESISTIVITY, copper_resistance

THICKNESS = 35e-6
SQUARE = COPPER_RESISTIVITY / THICKNESS
"""Resistance of a square of the sheet, ohm."""


def contact(pin: str, shape, layer: int = 1) -> BarePad:
    return BarePad(pin, None, "C1", layer, shape.centroid.x, shape.centroid.y, shape)


def net(shapes, a, b, holes=()) -> ExtractedNet:
    pieces = tuple(Piece(layer, shape) for layer, shape in enumerate(shapes, start=1))
    return ExtractedNet(pieces, tuple(holes), ("C1",), (a, b), ())


def test_resistance_of_straight_bar_is_exact():
    bar = box(-1e-3, 0, 11e-3, 0.1e-3)
    a, b = contact("J1-1", box(-1e-3, -1e-3, 0, 1e-3)), contact("J1-2", box(10e-3, -1e-3, 11e-3, 1e-3))
    assert copper_resistance(net([bar], a, b), a, b, [THICKNESS]) == approx(100 * SQUARE, rel=1e-9)


def ring_sector(inner: float, outer: float, start: float, end: float, chords: int) -> Polygon:
    angle = np.linspace(start, end, chords + 1)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Polygon(np.concatenate([outer * arc, inner * arc[::-1]]))


def test_resistance_of_ring_sector_converges_at_second_order(monkeypatch):
    """R = angle / ln(outer / inner) squares; chords and triangles are made finer together."""
    monkeypatch.setattr(resistance, "CLEANING", 1e-12)
    inner, outer, angle = 1e-3, 2e-3, 1.5 * math.pi
    exact = SQUARE * angle / math.log(outer / inner)
    errors = []
    for refinement in (1, 2, 4):
        ring = ring_sector(inner, outer, 0.0, angle, 24 * refinement)
        a = contact("J1-1", box(0.5e-3, -1e-3, 3e-3, 0.0))
        b = contact("J1-2", box(0.0, -3e-3, 1e-3, -0.5e-3))
        result = copper_resistance(net([ring], a, b), a, b, [THICKNESS], fineness=4 * refinement)
        errors.append(1.0 - result / exact)
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert all(error > 0 for error in errors)
    assert errors[-1] < 1e-3
    assert all(order > 1.6 for order in orders), (errors, orders)


def test_resistance_of_square_corner_is_0_559_squares():
    """Conformal mapping: the corner of an L of equal arms counts as 1 - 2 ln 2 / pi squares."""
    w, arm = 0.1e-3, 1e-3
    shape = Polygon([(-arm, 0), (w, 0), (w, w + arm), (0, w + arm), (0, w), (-arm, w)])
    a, b = contact("J1-1", box(-2 * arm, -w, -arm, 2 * w)), contact("J1-2", box(-w, w + arm, 2 * w, 2 * arm))
    squares = copper_resistance(net([shape], a, b), a, b, [THICKNESS], fineness=24) / SQUARE
    assert squares - 20.0 == approx(1.0 - 2.0 * math.log(2.0) / math.pi, rel=1e-2)


def test_resistance_of_two_layers_and_via_adds_in_series():
    """Each layer's bar ends in a wide land, so that the spreading round the hole is the same in both cases."""
    hole = PlottedHole(0.0, 0.0, 0.2e-3, Point(0, 0).buffer(0.1e-3), True, (1, 2))
    left, right = box(-5e-3, -0.5e-3, 0.5e-3, 0.5e-3), box(-0.5e-3, -0.5e-3, 5e-3, 0.5e-3)
    a, b = contact("J1-1", box(-5e-3, -1e-3, -4e-3, 1e-3), 1), contact("J1-2", box(4e-3, -1e-3, 5e-3, 1e-3), 2)
    board = net([left, right], a, b, [hole])
    perfect = copper_resistance(board, a, b, [THICKNESS] * 2)
    plated = copper_resistance(board, a, b, [THICKNESS] * 2, depths=[0.0, -1e-3], plating=20e-6)
    wall = math.pi * (0.2e-3 - 20e-6) * 20e-6
    assert plated - perfect == approx(COPPER_RESISTIVITY * 1e-3 / wall, rel=1e-4)
    halves = copper_resistance(board, a, b, [THICKNESS, 2 * THICKNESS])
    assert halves / perfect == approx(0.75, rel=1e-3)


def test_resistance_of_extracted_board_matches_hand_calculation(two_nets, tmp_path):
    """C1 of the board by hand: 4.55 mm of track twice, 1.7 mm once, and four via lands of well under a square each."""
    result = extract(two_nets.write(tmp_path)).net("C1")
    a, b = result.contacts
    ohms = copper_resistance(result, a, b, [THICKNESS, THICKNESS])
    tracks = (2 * 4.55 + 1.7) / 0.1
    assert tracks + 1.0 < ohms / SQUARE < tracks + 4.0


def test_resistance_between_unconnected_contacts_is_refused():
    apart = [box(0, 0, 1e-3, 1e-3), box(0, 0, 1e-3, 1e-3)]
    a, b = contact("J1-1", box(0, 0, 1e-4, 1e-3), 1), contact("J1-2", box(0, 0, 1e-4, 1e-3), 2)
    with pytest.raises(ValueError, match="no copper joins"):
        copper_resistance(net(apart, a, b), a, b, [THICKNESS] * 2)


def test_resistance_without_thickness_of_each_layer_is_refused():
    a, b = contact("J1-1", box(0, 0, 1e-4, 1e-3)), contact("J1-2", box(9e-4, 0, 1e-3, 1e-3))
    whole = net([box(0, 0, 1e-3, 1e-3), box(0, 0, 1e-3, 1e-3)], a, b)
    with pytest.raises(ValueError, match="layer 2"):
        copper_resistance(whole, a, b, [THICKNESS])
    with pytest.raises(ValueError, match="two different contacts"):
        copper_resistance(whole, a, a, [THICKNESS] * 2)
