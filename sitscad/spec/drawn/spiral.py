"""Recognise the spiral that a drawn conductor winds, layer by layer, and the stubs and leads beside it.

A drawn coil is computed as the shape that it winds: all error bounds are fitted to shapes. Turns that follow no such
shape are refused with the place of the largest deviation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

from sitscad.basics.units import show
from sitscad.kernels.geometry.path import Line, Path, Point
from sitscad.spec.coil import CoilSpec, DrawnCopperCoil, DrawnHole, DrawnLayer, DrawnPiece, DrawnTerminal
from sitscad.spec.drawn.arcs import DrawnSpiral, DrawnTurns, with_arcs
from sitscad.spec.drawn.copper import CopperHeight, DrawnCoilError, DrawnPad, place_text
from sitscad.spec.drawn.follow import DrawnConductor, DrawnRun
from sitscad.spec.drawn.polygons import polygon
from sitscad.spec.drawn.round_spiral import LEAST_TURNS, round_spiral

EQUAL_TURNS = 2e-3
"""Largest difference between a number of turns and the nearest whole number to which it is rounded."""


def recognised(
    conductor: DrawnConductor, layers: Sequence[str], written: CoilSpec, heights: Sequence[CopperHeight] = ()
) -> CoilSpec:
    """Return the coil that a conductor winds, with its copper about the centre of the turns.

    `layers` are the names of the copper layers, from the top, and `heights` the copper layers of the file's stack-up.
    `written` is the coil as the spec has it. Raises DrawnCoilError if the turns are no spiral of a known shape in one
    sense, or if pitch, size or width differ between layers.
    """
    runs = [run for run, (_, turns) in zip(conductor.runs, conductor.turns(), strict=True) if abs(turns) >= LEAST_TURNS]
    if not runs:
        raise DrawnCoilError("the copper makes less than one turn about its centre: there is no coil")
    spiral = polygon(runs, conductor.width) if _is_straight(runs) else round_spiral(runs, conductor)
    for part in spiral.turns:
        _require_width(part, conductor.width)
    wound = _layers(spiral, layers)
    _require_series(wound, layers)
    counts = [layer.turns for layer in wound]
    return replace(
        written, shape=spiral.shape, size=spiral.size, turns=counts[0] if len(set(counts)) == 1 else tuple(counts),
        layers=tuple(layer.number for layer in wound), trace_width=conductor.width,
        trace_spacing=round(spiral.pitch - conductor.width, 9), start_angle=wound[0].outer_angle,
        is_mid_side=spiral.is_mid_side, clockwise=wound[0].sense < 0, corner_radius=spiral.corner_radius,
        copper=DrawnCopperCoil(tuple(wound), _series(conductor, spiral, wound, layers),
                               _terminals(conductor, spiral.centre, layers), spiral.deviation,
                               tuple((layers.index(each.name) + 1, each.z, each.thickness) for each in heights)),
    )


def _is_straight(runs: Sequence[DrawnRun]) -> bool:
    """Whether more than half of the length of the runs is straight, after `with_arcs` has replaced chords by arcs."""
    segments = [segment for run in runs for segment in with_arcs(run.path)]
    straight = math.fsum(segment.length for segment in segments if isinstance(segment, Line))
    return straight > 0.5 * math.fsum(segment.length for segment in segments)


def _layers(spiral: DrawnSpiral, layers: Sequence[str]) -> list[DrawnLayer]:
    """Return the layers of the winding in the order of the current, about the spiral's centre."""
    wound = []
    for part, count, inward, sense in zip(spiral.turns, spiral.counts, spiral.inward, spiral.senses, strict=True):
        path = part.path.shifted(-spiral.centre.x, -spiral.centre.y)
        outer_end = path.start if inward else path.end
        turns = float(round(count)) if abs(count - round(count)) < EQUAL_TURNS else round(count, 6)
        wound.append(DrawnLayer(layers.index(part.run.layer) + 1, path, math.atan2(outer_end.y, outer_end.x),
                                sense if inward else -sense, inward, turns))
    return wound


def _require_width(turns: DrawnTurns, width: float) -> None:
    """Raise DrawnCoilError if any track of the turns has another width than `width` (m)."""
    for segment, each in zip(turns.run.path.segments[turns.first : turns.last + 1],
                             turns.run.widths[turns.first : turns.last + 1], strict=True):
        if abs(each - width) > 1e-9:
            place = place_text(segment.start, turns.run.layer)
            raise DrawnCoilError(f"the turn at {place} is {show(each, 'm')} wide, others {show(width, 'm')}: turns of "
                                 "unequal width are not computed")


def _require_series(wound: Sequence[DrawnLayer], layers: Sequence[str]) -> None:
    """Raise DrawnCoilError if the field of a layer opposes the other layers, or if a layer has two spirals."""
    circulation = [layer.sense * (1 if layer.inward else -1) for layer in wound]
    for layer, way in zip(wound, circulation, strict=True):
        if way * sum(circulation) <= 0:
            raise DrawnCoilError(f"layer {layers[layer.number - 1]} turns the other way and cancels the field of the "
                                 "others")
    if len({layer.number for layer in wound}) < len(wound):
        raise DrawnCoilError("two spirals lie on one layer: a coil has one spiral on each layer")


def _series(
    conductor: DrawnConductor, spiral: DrawnSpiral, wound: Sequence[DrawnLayer], layers: Sequence[str]
) -> tuple[DrawnPiece | DrawnHole, ...]:
    """Return tracks and holes in the order of the current, relative to the spiral's centre.

    `wound` are the layers of the winding, and `layers` the names of the copper layers from the top.
    """
    if len(conductor.vias) != len(conductor.runs) - 1:
        raise DrawnCoilError("a via joins no two tracks")
    series: list[DrawnPiece | DrawnHole] = []
    home, started = (-spiral.centre.x, -spiral.centre.y), 0
    for run, via in zip(conductor.runs, (*conductor.vias, None), strict=True):
        number, part = layers.index(run.layer) + 1, next((part for part in spiral.turns if part.run is run), None)
        first, last = (part.first, part.last) if part else (0, -1)
        series += _pieces(run, 0, first, number, LEAD if not started else STUB, home)
        if part is not None:
            series.append(DrawnPiece(number, wound[started].path, conductor.width, WINDING))
            started += 1
        role = LEAD if started in (0, len(spiral.turns)) else STUB
        series += _pieces(run, last + 1, len(run.widths), number, role, home)
        if via is not None:
            series.append(DrawnHole(via.centre.shifted(*home), via.drill or 0.5 * min(via.size), min(via.size)))
    return tuple(series)


WINDING, STUB, LEAD = "winding", "stub", "lead"
"""Purposes of drawn tracks, as in `layout.board.Role`."""


def _pieces(
    run: DrawnRun, first: int, stop: int, layer: int, role: str, home: tuple[float, float]
) -> Iterator[DrawnPiece]:
    """Yield the segments `first` to `stop` (exclusive) of a run as tracks, one for each stretch of equal width.

    `layer` is the number of the copper layer, and `role` the purpose of the tracks. All are moved by `home` (m).
    """
    rows = zip(run.path.segments[first:stop], run.widths[first:stop], strict=True)
    for width, group in groupby(rows, key=lambda row: row[1]):
        yield DrawnPiece(layer, Path(tuple(segment for segment, _ in group)).shifted(*home), width, role)


def _terminals(
    conductor: DrawnConductor, centre: Point, layers: Sequence[str]
) -> tuple[DrawnTerminal, DrawnTerminal]:
    """Return both terminals relative to the coil's `centre` (m).

    If a track ends without a pad, the terminal is a square whose sides are the track's width.
    """
    ends = ((conductor.runs[0], conductor.runs[0].path.start), (conductor.runs[-1], conductor.runs[-1].path.end))
    first, second = (
        DrawnTerminal(at.shifted(-centre.x, -centre.y), (run.widths[0],) * 2 if pad is None else _extent(pad),
                      layers.index(run.layer) + 1)
        for (run, end), pad in zip(ends, conductor.terminals, strict=True)
        for at in (end if pad is None else pad.centre,)
    )
    return first, second


def _extent(pad: DrawnPad) -> tuple[float, float]:
    """Return the sides (m) of the box about a pad."""
    (x, y), cos, sin = pad.size, abs(math.cos(pad.angle)), abs(math.sin(pad.angle))
    return x * cos + y * sin, x * sin + y * cos
