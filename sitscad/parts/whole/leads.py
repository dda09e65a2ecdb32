"""The copper that the assembly does not draw: leads, pads of holes and contacts, by the film that it lies in.

Leads, stubs and tail are too fine to be solids; what they take is worked out from the layout, track by track. Where a
track runs into a pad both are counted, and the plating in the holes is left out: a few per cent either way.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise

from sitscad.layout.board import Layout, Role, Trace
from sitscad.layout.thickness import tail_layers
from sitscad.spec.stackup import LayerKind, StackLayer

CHORD = 1e-5
"""Arcs of tracks count as chords within this (m)."""


def copper_in_films(layout: Layout, drawn: frozenset[str]) -> dict[str, float]:
    """Volume (m3) of copper in the films that fill copper layers, by the film's name; `drawn` are the names of the
    rings that are solids of their own. What lies beyond the body's end is the tail's.
    """
    stack = layout.spec.fpc.stackup
    body = dict(_copper("board", stack.layers))
    tail = dict(_copper("tail", tail_layers(layout)))
    names = {net: coil.name for coil in layout.coils for net in (coil.net,)}
    found: defaultdict[str, float] = defaultdict(float)
    for number, layer in enumerate(stack.copper, 1):
        for area, x in _areas(layout, number, drawn, names):
            film = body[number] if x <= layout.body[2] else tail.get(number)
            if film is not None:
                found[film] += area * layer.thickness
    return dict(found)


def _copper(part: str, layers: tuple[StackLayer, ...]) -> Iterator[tuple[int, str]]:
    """The numbers of the copper layers of a part of the board, and the names of the films that fill them."""
    number = 0
    for index, layer in enumerate(layers):
        if layer.kind is LayerKind.COPPER:
            number += 1
            yield number, f"{part}-{index + 1}-fill"


def _areas(layout: Layout, number: int, drawn: frozenset[str], names: dict[str, str]) -> Iterator[tuple[float, float]]:
    """Areas (m2) of copper on a layer that no ring has, each with its place along the board (m)."""
    for trace in layout.on_layer(number):
        ring = f"copper-{number}-{names.get(trace.net, '')}"
        if trace.role is not Role.WINDING or ring not in drawn:
            yield from _pieces(trace, layout.body[2])
    for via in layout.vias_on(number):
        yield math.pi / 4 * (via.pad**2 - via.drill**2), via.centre.x
    for pad in layout.all_pads:
        if pad.layer == number:
            yield pad.size[0] * pad.size[1], pad.centre.x


def _pieces(trace: Trace, end: float) -> Iterator[tuple[float, float]]:
    """A track's area (m2), cut at the body's end."""
    for a, b in pairwise(trace.path.flattened(CHORD)):
        cut = (end - a.x) / (b.x - a.x) if a.x != b.x else 0.0
        places = (0.0, cut, 1.0) if 0.0 < cut < 1.0 else (0.0, 1.0)
        for first, last in pairwise(places):
            yield (last - first) * a.distance(b) * trace.width, a.x + 0.5 * (first + last) * (b.x - a.x)
