"""The board film by film: coverlay, copper, dielectric, each at its height, in the body and along the tail.

Copper is drawn as a ring for every coil on every layer, from its outermost to its innermost track; between and beside
the rings is what fills the gaps, the coverlay's or the bonding sheet's adhesive. Leads and contacts are too fine to be
drawn; `sitscad.parts.whole.mass` weighs their copper with the film that it lies in.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sitscad.geometry.path import Path, Region, bounding_box, rectangle
from sitscad.layout.board import Coil, Layout
from sitscad.layout.thickness import tail_layers
from sitscad.parts.extras import require
from sitscad.parts.prism import face, prism, raised
from sitscad.parts.solid import Solid
from sitscad.parts.whole.tail import plan
from sitscad.scene.bodies import BodyRole, Heights
from sitscad.scene.tail_path import TailPath
from sitscad.spec.stackup import LayerKind, StackLayer

COLOURS = {"coverlay": "#c8821e", "copper": "#d98a4b", "dielectric": "#b0741c", "fill": "#d9b26a"}
FILL = "adhesive"
LEAST_OPENING = 50e-6
"""Openings inside a coil narrower than this (m) are filled in."""


def films(layout: Layout, path: TailPath | None) -> tuple[Solid, ...]:
    """The board's films from the top down, those of its body and, along `path`, those of its tail."""
    found: list[Solid] = []
    upper, number = 0.0, 0
    body = _body_face(layout)
    for index, layer in enumerate(layout.spec.fpc.stackup.layers):
        number += layer.kind is LayerKind.COPPER
        heights = upper - layer.thickness, upper
        found += _of_body(layout, body, layer, index, number, heights)
        upper = heights[0]
    if path is None:
        return tuple(found)
    upper = 0.0
    flat = plan(layout, path, Region(layout.outline))
    for index, layer in enumerate(tail_layers(layout)):
        shape = flat.laid(upper - layer.thickness, upper)
        kind = "fill" if layer.kind is LayerKind.COPPER else layer.kind.value
        found.append(Solid(f"tail-{index + 1}-{kind}", shape, _material(layer), COLOURS[kind], BodyRole.BOARD))
        upper -= layer.thickness
    return tuple(found)


def ring(layout: Layout, coil: Coil, number: int) -> Region:
    """The ring that a coil's tracks cover on one of its layers, seen from above."""
    spec = layout.spec.coil
    order = [winding.layer for winding in coil.windings].index(number)
    depth = spec.layer_turns[order] * (spec.trace_width + spec.trace_spacing) - spec.trace_spacing
    outer = _turned(spec.outline.edge(spec.size, spec.corner_radius + spec.trace_width / 2), coil)
    if min(spec.size) / 2 - depth < LEAST_OPENING:
        return Region(outer)
    return Region(outer, (_turned(spec.outline.boundary(spec.size, -depth), coil),))


def _turned(path: Path, coil: Coil) -> Path:
    return path.rotated(coil.placement.rotation).shifted(*coil.centre)


def _of_body(
    layout: Layout, body: Any, layer: StackLayer, index: int, number: int, heights: Heights
) -> Iterator[Solid]:
    """One film of the body; of a copper layer the rings of its coils and what fills the rest."""
    kind = layer.kind.value
    if layer.kind is not LayerKind.COPPER:
        name, shape = f"board-{index + 1}-{kind}", raised(body, *heights)
        yield Solid(name, shape, _material(layer), COLOURS[kind], BodyRole.BOARD)
        return
    coils = [c for c in layout.coils if any(w.layer == number for w in c.windings)]
    rings = [(coil, ring(layout, coil, number)) for coil in coils]
    rings = [(coil, plate) for coil, plate in rings if _inside(plate.outline, layout.body)]
    holes = tuple(plate.outline for _, plate in rings)
    name = f"board-{index + 1}-fill"
    yield Solid(name, raised(_with_holes(body, holes), *heights), FILL, COLOURS["fill"], BodyRole.BOARD)
    for coil, plate in rings:
        yield Solid(
            f"copper-{number}-{coil.name}", prism(plate, *heights), "copper", COLOURS["copper"], BodyRole.COPPER
        )
        if plate.holes:
            middle = prism(plate.holes[0], *heights)
            yield Solid(f"{name}-{coil.name}", middle, FILL, COLOURS["fill"], BodyRole.BOARD)


def _body_face(layout: Layout) -> Any:
    """The board's outline up to the body's end, as a face in the plane z = 0."""
    x0, y0, x1, y1 = layout.body
    return (face(Region(layout.outline)) & face(Region(rectangle(x0, y0, x1, y1)))).faces()[0]


def _with_holes(body: Any, holes: tuple[Path, ...]) -> Any:
    """That face with holes in it."""
    bd = require("build123d")
    return bd.Face(body.outer_wire(), [face(Region(hole)).outer_wire() for hole in holes]) if holes else body


def _inside(outline: Path, body: tuple[float, float, float, float]) -> bool:
    x0, y0, x1, y1 = bounding_box((outline,))
    return x0 > body[0] and y0 > body[1] and x1 < body[2] and y1 < body[3]


def _material(layer: StackLayer) -> str:
    return FILL if layer.kind is LayerKind.COPPER else layer.material
