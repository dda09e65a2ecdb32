"""A layout as a unit of it is made: tracks, copper and layers of that unit, on the board as drawn."""

from __future__ import annotations

from sitscad.geometry.path import Point
from sitscad.layout.board import Coil, Layout, Via
from sitscad.record import replace
from sitscad.spec.sensor import SensorSpec


def as_made(layout: Layout, spec: SensorSpec) -> Layout:
    """The layout with the spec of one unit: windings and leads as wide as its `coil.trace_width` makes them, windings
    as large as its coils, copper at its heights and as thick as in its stack-up. Nothing is routed anew.
    """
    drawn, coil = layout.spec.coil, spec.coil
    wider = coil.trace_width / drawn.trace_width
    # by centre lines: wider tracks make a coil larger, but do not move them
    larger = (coil.size[0] - coil.trace_width) / (drawn.size[0] - drawn.trace_width)

    # a coil's tracks are the board's own, not others that look alike
    traces = tuple(replace(trace, width=wider * trace.width) for trace in layout.traces)
    etched = {id(own): trace for own, trace in zip(layout.traces, traces, strict=True)}

    copper = {layer.number: layer for layer in spec.fpc.stackup.copper}

    def made(one: Coil) -> Coil:
        centre = one.centre

        def moved(point: Point) -> Point:
            return Point(centre.x + larger * (point.x - centre.x), centre.y + larger * (point.y - centre.y))

        windings = tuple(
            replace(w, z=copper[w.layer].z, thickness=copper[w.layer].thickness,
                    path=w.path if abs(larger - 1.0) < 1e-9 else w.path.mapped(moved))
            for w in one.windings
        )
        pairs = tuple(replace(pair, width=wider * pair.width) for pair in one.undrawn)
        series = tuple(piece if isinstance(piece, Via) else etched.get(id(piece)) or
                       replace(piece, width=wider * piece.width) for piece in one.series)
        return replace(one, windings=windings, series=series, undrawn=pairs)

    return replace(layout, spec=spec, coils=tuple(map(made, layout.coils)), traces=traces)
