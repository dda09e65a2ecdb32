"""Texts of KiCad boards with drawn coils, as generators of others write them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

SPIRAL = {"outer_diameter": "8 mm", "turns": 14, "trace_width": "100 um", "trace_spacing": "100 um"}
TWO = {**SPIRAL, "layers": 2}
STACK = """(setup (stackup (layer "F.SilkS" (type "Top Silk Screen"))
(layer "F.Mask" (type "Top Solder Mask") (thickness 0.01))
(layer "F.Cu" (type "copper") (thickness 0.03)) (layer "dielectric 1" (type "core") (thickness 0.025) (material "PI"))
(layer "B.Cu" (type "copper") (thickness 0.03)) (layer "B.Mask" (type "Bottom Solder Mask") (thickness 0.01))))"""


def spiral_points(radius, pitch, turns, sense=1, start=0.0, corners=72):
    """Points (mm) of an Archimedean spiral from the outside inwards, with y downwards as KiCad has it."""
    angle = np.linspace(0.0, 2.0 * math.pi * turns, round(corners * turns) + 1)
    r = radius - pitch * angle / (2.0 * math.pi)
    return np.column_stack([r * np.cos(start + sense * angle), -r * np.sin(start + sense * angle)])


def segments(points, layer, net="(net 1)", width=0.1):
    return "".join(
        f'(segment (start {a[0]:.6f} {a[1]:.6f}) (end {b[0]:.6f} {b[1]:.6f}) (width {width}) (layer "{layer}") {net})\n'
        for a, b in pairwise(points)
    )


def pad(name, x, y, layer="F.Cu", reference="J1", net='(net 1 "COIL")'):
    return (f'(footprint "x" (layer "{layer}") (at {x} {y}) (property "Reference" "{reference}")'
            f'(pad "{name}" smd rect (at 0 0) (size 0.1 0.1) (layers "{layer}") {net}))\n')


def via(x, y, net="(net 1)"):
    return f'(via (at {x} {y}) (size 0.4) (drill 0.2) (layers "F.Cu" "B.Cu") {net})\n'


def board(*parts, stack=STACK):
    return (f'(kicad_pcb (version 20240108) (generator "x") (layers (0 "F.Cu" signal) (31 "B.Cu" signal))\n{stack}\n'
            f'(net 0 "") (net 1 "COIL") (net 2 "GND")\n{"".join(parts)})')


RADIUS, PITCH, TURNS = 3.95, 0.2, 14.0
TOP = spiral_points(RADIUS, PITCH, TURNS)
INNER = TOP[-1]


NARROW = spiral_points(RADIUS, 0.09, TURNS)
"""Turns that overlap: tracks of 0.1 mm on a pitch of 0.09 mm."""


def two_layers(sense=1, cut=None, more=""):
    """A board of two spirals in series: inwards on the top, through a via, outwards on the bottom."""
    bottom = spiral_points(RADIUS, PITCH, TURNS, sense=-sense)[::-1]
    top = TOP if cut is None else np.delete(TOP, cut, axis=0)
    parts = segments(top, "F.Cu") if cut is None else segments(TOP[:cut], "F.Cu") + segments(TOP[cut + 1 :], "F.Cu")
    return board(parts, via(INNER[0] - 0.4, INNER[1]), segments([INNER, (INNER[0] - 0.4, INNER[1])], "F.Cu"),
                 segments([(INNER[0] - 0.4, INNER[1]), bottom[0]], "B.Cu"), segments(bottom, "B.Cu"),
                 pad("1", *TOP[0]), pad("2", *bottom[-1], layer="B.Cu"), more)
