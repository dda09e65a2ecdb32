"""All solids of a sensor in their places, and the mount that carries it: a seat in the jaw, a plate for the bench, a
cap on a finger, or a part of the user's own.

A mount is always an insulator: standoff is the distance to the nearest metal behind the coil, so a metal seat would
void it. A shield lies between two pieces, `mount` below and `mount-spacer` above it.
"""

from __future__ import annotations

from typing import Any

from sitscad.geometry.path import Point
from sitscad.layout.board import Layout
from sitscad.parts.imported import imported
from sitscad.parts.pieces import board_body, elastomer, encapsulation, jaw, shield, stiffener, target
from sitscad.parts.plates import adapter, bench_plate, fingertip
from sitscad.parts.seat import grasper_pad
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import MOUNT_PIECES, BodyRole, board_heights
from sitscad.scene.jaws import axis
from sitscad.spec.mount import Mount


def assemble(layout: Layout) -> tuple[Solid, ...]:
    """The solids that the spec contains, from the jaw upwards."""
    below = [solid for solid in (jaw(layout), *mount(layout), shield(layout), stiffener(layout)) if solid]
    below.sort(key=lambda solid: round(solid.shape.bounding_box().min.Z, 6))
    above = (board_body(layout), elastomer(layout), target(layout), encapsulation(layout))
    return (*below, *(solid for solid in above if solid))


COLOUR = "#dfe6e9"
ADAPTER = "mount-adapter"
MATERIALS = {
    "resin": "printed resin", "powder": "printed powder", "filament": "printed filament", "machined": "milled plastic",
}
BUILDERS = {"grasper-pad": grasper_pad, "bench-plate": bench_plate, "fingertip": fingertip}


def mount(layout: Layout) -> tuple[Solid, ...]:
    """The pieces of the mount from the bottom up; none where the board lies on the metal itself."""
    wanted = layout.spec.mount
    if wanted is None:
        return ()
    named: list[tuple[str, Any]] = list(zip(MOUNT_PIECES, _shapes(layout, wanted), strict=False))
    if wanted.kind == "bench-plate" and (below := adapter(layout, wanted.standoff)) is not None:
        named.insert(0, (ADAPTER, below))
    material = MATERIALS[wanted.process]
    return tuple(Solid(name, shape, material, COLOUR, BodyRole.MOUNT) for name, shape in named)


def _shapes(layout: Layout, wanted: Mount) -> tuple[Any, ...]:
    if wanted.kind != "custom":
        return BUILDERS[wanted.kind](layout, wanted.standoff)
    if wanted.step is None:
        return ()
    middle = axis(layout)
    return (imported(layout, wanted.step, Point(middle.x, middle.y), board_heights(layout.spec)[0]),)
