"""Where a coil ends on the board: the outline of its outermost copper, turned as the coil is."""

from __future__ import annotations

from sitscad.geometry.path import Path, bounding_box
from sitscad.layout.board import Coil
from sitscad.spec.coil import CoilSpec


def coil_outline(spec: CoilSpec, coil: Coil) -> Path:
    """The closed outline (m) that a coil's outer copper edges lie on, about its centre and turned as it is drawn.

    Corners are as round as the pen that draws them leaves the copper: half a track's width and the corner's own radius.
    """
    unturned = spec.outline.edge(spec.size, spec.corner_radius + spec.trace_width / 2)
    return unturned.rotated(coil.placement.rotation).shifted(*coil.centre)


def coil_extent(spec: CoilSpec, coil: Coil) -> tuple[float, float, float, float]:
    """(x0, y0, x1, y1) in metres of a coil's outer copper edges on the board.

    They are the outline's, but for a rounded corner at which a layer begins: that one is left sharp.
    """
    outline, half = bounding_box([coil_outline(spec, coil)]), spec.trace_width / 2
    if not spec.corner_radius:
        return outline
    x0, y0, x1, y1 = bounding_box([winding.path for winding in coil.windings])
    return (
        min(outline[0], x0 - half), min(outline[1], y0 - half), max(outline[2], x1 + half), max(outline[3], y1 + half)
    )  # fmt: skip
