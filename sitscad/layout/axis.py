"""The tail's axis: where the tail leaves the body, at the height of the mean of the coils' centres.

So a board does not depend on where its coils' places are counted from. Everything is laid out with the axis at y = 0,
and the board is then moved to its place.
"""

from __future__ import annotations

from dataclasses import replace

from sitscad.geometry.path import Path
from sitscad.geometry.region import Region
from sitscad.layout.board import Coil, Layout
from sitscad.layout.pieces import Pad, Trace, Via
from sitscad.spec.sensor import SensorSpec

SAME = 1e-9
"""A mean that is nearer to y = 0 (m) is there: what is left of a sum of rounded figures."""


def axis_height(spec: SensorSpec) -> float:
    """The height y (m) at which the tail leaves the body."""
    height = spec.array.middle[1]
    return height if abs(height) > SAME else 0.0


def about_axis(spec: SensorSpec) -> SensorSpec:
    """The spec with its coils counted from the tail's axis."""
    height = axis_height(spec)
    if not height:
        return spec
    placements = tuple(replace(p, centre=(p.centre[0], p.centre[1] - height)) for p in spec.array.placements)
    return replace(spec, array=replace(spec.array, placements=placements))


def placed(layout: Layout, spec: SensorSpec) -> Layout:
    """A layout of `about_axis(spec)`, moved to where the spec has its coils."""
    height = axis_height(spec)
    return _moved(layout, spec, height) if height else layout


def _moved(layout: Layout, spec: SensorSpec, height: float) -> Layout:
    """The whole layout so much (m) higher in y, with the spec whose coils stand there."""

    def path(one: Path) -> Path:
        return one.shifted(0.0, height)

    def piece(item: Trace | Via) -> Trace | Via:
        if isinstance(item, Trace):
            return replace(item, path=path(item.path))
        return replace(item, centre=item.centre.shifted(0.0, height))

    def pad(one: Pad) -> Pad:
        return replace(one, centre=one.centre.shifted(0.0, height))

    def region(one: Region) -> Region:
        return Region(path(one.outline), tuple(map(path, one.holes)))

    def coil(one: Coil) -> Coil:
        placement = next(p for p in spec.array.placements if p.name == one.name)
        windings = tuple(replace(winding, path=path(winding.path)) for winding in one.windings)
        return replace(one, placement=placement, windings=windings, series=tuple(map(piece, one.series)))

    coils, plate, (x0, y0, x1, y1) = tuple(map(coil, layout.coils)), layout.stiffener, layout.body
    pieces = [item for one in coils for item in one.series]
    return replace(
        layout,
        spec=spec,
        coils=coils,
        traces=tuple(item for item in pieces if isinstance(item, Trace)),
        vias=tuple(item for item in pieces if isinstance(item, Via)),
        pads=tuple(map(pad, layout.pads)),
        capacitors=tuple(replace(c, pads=(pad(c.pads[0]), pad(c.pads[1]))) for c in layout.capacitors),
        outline=path(layout.outline),
        body=(x0, y0 + height, x1, y1 + height),
        top_openings=tuple(map(region, layout.top_openings)),
        bottom_openings=tuple(map(region, layout.bottom_openings)),
        stiffener=replace(plate, outline=region(plate.outline)) if plate else None,
    )
