"""Layout of a board whose coil the user drew: the file's copper at each coil's position, and the body's outline."""

from __future__ import annotations

from sitscad.kernels.geometry.path import Line, Path, Point, bounding_box, rectangle
from sitscad.layout.board import Coil, Layout, Pad, Role, Trace, Via, Winding
from sitscad.layout.outline import lack
from sitscad.spec.circuit import PLAIN_CORNER, Stackup
from sitscad.spec.coil import CoilPlacement, DrawnCopperCoil, DrawnHole, DrawnPiece
from sitscad.spec.sensor import SensorSpec


def drawn_layout(spec: SensorSpec, copper: DrawnCopperCoil) -> Layout:
    """Return the layout of coils that the user drew, with the copper of the file about each coil's centre.

    The body is the outline in the spec, or else a rectangle about the copper with the fabricator's edge distance. The
    layout has no tail, because the drawing contains the tracks beyond the turns.
    """
    coils = tuple(_coil(spec.fpc.stackup, copper, placement) for placement in spec.array.placements)
    pieces = [piece for coil in coils for piece in coil.series]
    traces = tuple(piece for piece in pieces if isinstance(piece, Trace))
    vias = tuple(piece for piece in pieces if isinstance(piece, Via))
    pads = tuple(pad for number, placement in enumerate(spec.array.placements)
                 for pad in _pads(copper, placement, 2 * number))
    missing = lack(spec.artwork, None)
    x, y = (spec.fpc.rules.copper_to_edge + margin for margin in spec.fpc.margin)
    outline = spec.body_outline or _outline_about(traces, vias, pads, (x, y))
    return Layout(
        spec=spec, coils=coils, traces=traces, vias=vias, pads=pads, outline=outline, body=bounding_box([outline]),
        top_openings=(), bottom_openings=(), stiffener=None, bend_zone=None,
        shortfalls=() if missing is None else (missing,),
    )


def _coil(stackup: Stackup, copper: DrawnCopperCoil, placement: CoilPlacement) -> Coil:
    layers = {layer.number: layer for layer in stackup.copper}
    windings = tuple(
        Winding(each.number, layers[each.number].z, layers[each.number].thickness,
                each.outer_angle + placement.rotation, each.sense, each.inward, _placed(each.path, placement))
        for each in copper.layers
    )
    series = tuple(_conductor(piece, placement) for piece in copper.series)
    return Coil(placement, placement.name, windings, series, True)


def _conductor(piece: DrawnPiece | DrawnHole, placement: CoilPlacement) -> Trace | Via:
    if isinstance(piece, DrawnHole):
        return Via(_place(piece.centre, placement), piece.drill, piece.pad, placement.name)
    return Trace(_placed(piece.path, placement), piece.width, piece.layer, placement.name, Role(piece.role))


def _pads(copper: DrawnCopperCoil, placement: CoilPlacement, before: int) -> tuple[Pad, ...]:
    """Return the two contacts of a coil, with the numbers `before` + 1 and `before` + 2."""
    return tuple(
        Pad(_place(end.centre, placement), end.size, end.layer, placement.name, f"{placement.name}.{pin}", number)
        for number, (end, pin) in enumerate(zip(copper.terminals, "AB", strict=True), before + 1)
    )


def _placed(path: Path, placement: CoilPlacement) -> Path:
    turned = path.rotated(placement.rotation) if placement.rotation else path
    return turned.shifted(*placement.centre)


def _place(point: Point, placement: CoilPlacement) -> Point:
    home = Point(0.0, 0.0)
    return _placed(Path((Line(home, point),)), placement).end


def _outline_about(
    traces: tuple[Trace, ...], vias: tuple[Via, ...], pads: tuple[Pad, ...], room: tuple[float, float]
) -> Path:
    """Return a rectangle about all copper. `room` is the margin (m) along x and along y on each side."""
    boxes = [(*bounding_box([trace.path]), trace.width / 2, trace.width / 2) for trace in traces]
    boxes += [(*via.centre, *via.centre, via.pad / 2, via.pad / 2) for via in vias]
    boxes += [(*pad.centre, *pad.centre, pad.size[0] / 2, pad.size[1] / 2) for pad in pads]
    x, y = room
    return rectangle(
        min(box[0] - box[4] for box in boxes) - x, min(box[1] - box[5] for box in boxes) - y,
        max(box[2] + box[4] for box in boxes) + x, max(box[3] + box[5] for box in boxes) + y, PLAIN_CORNER,
    )
