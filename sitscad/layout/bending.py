"""How thick the board is where, and how its tail bends: the copper that runs down it, the stretch that may be bent,
and what is unfit for it there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import StrEnum
from itertools import accumulate

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Arc, Region, Segment, bounding_box, box_around
from sitscad.layout.board import Layout, Pad, Role, Stiffener, Trace
from sitscad.layout.tail_frame import TailFrame, first_via
from sitscad.spec.circuit import FpcSpec, LayerKind, StackLayer
from sitscad.spec.presets import stock_stiffeners


class Where(StrEnum):
    """A place on the board with a build-up of its own."""

    COIL = "coil"
    TAIL = "tail"
    CONTACT = "contact"


@record
class FinishedThickness:
    """A thickness in metres: the sum of the layers, and the least and the most that the fabricator delivers. ``source``
    says where the band comes from.
    """

    minimum: float
    nominal: float
    maximum: float
    source: str


def finished_thickness(layout: Layout, where: Where) -> FinishedThickness:
    """The worst case of the stack at a place: the layers' sum, and the fabricator's tolerance of finished thickness.

    At the coils all layers count, in the tail those down to its last copper layer and the bottom coverlay. At the
    contacts `contact_layers` and the stiffener count. A fabricator answers for the whole, not for each
    film: the tolerance is the one of `fpc.rules` by copper layers (the largest listed stands for more), or by the
    stiffener's material where there is one (of one that is not listed, the largest).
    """
    rules, plate = layout.spec.fpc.rules, layout.stiffener if where is Where.CONTACT else None
    layers = layout.spec.fpc.stackup.layers if where is Where.COIL else tail_layers(layout)
    if where is Where.CONTACT:
        layers = contact_layers(layout)
    nominal = sum(layer.thickness for layer in layers)
    if plate is not None:
        field, tolerances = f"stiffened_tolerance_{plate.material}", rules.stiffened_tolerance
        nominal, tolerance = nominal + plate.thickness, tolerances.get(plate.material, max(tolerances.values()))
    else:
        copper = sum(layer.kind is LayerKind.COPPER for layer in layers)
        by_layers = rules.thickness_tolerance
        listed = max((count for count in by_layers if count <= copper), default=min(by_layers))
        field, tolerance = f"thickness_tolerance_{listed}", by_layers[listed]
    return FinishedThickness(max(0.0, nominal - tolerance), nominal, nominal + tolerance, rules.source_of(field))


def tail_copper(layout: Layout) -> int:
    """How many copper layers, from the top, run down the tail; all of them where there is no tail."""
    tail = layout.spec.fpc.tail
    return min(tail.layers, layout.copper_layers) if tail is not None else layout.copper_layers


def has_tail_coverlay(layout: Layout) -> bool:
    """Whether the tail has a bottom coverlay of its own: the body's cannot run over a step to fewer layers."""
    last = layout.spec.fpc.stackup.layers[-1]
    return tail_copper(layout) < layout.copper_layers and last.kind is LayerKind.COVERLAY


def lap_start(layout: Layout) -> float:
    """Where along x (m) the tail's own bottom coverlay begins, inside the body."""
    return layout.body[2] - layout.spec.fpc.rules.coverlay_lap


def step_height(layout: Layout) -> float:
    """How much thicker (m) the body is than the tail where lower layers end."""
    return layout.spec.fpc.stackup.thickness - sum(layer.thickness for layer in tail_layers(layout))


def tail_layers(layout: Layout) -> tuple[StackLayer, ...]:
    """The stack-up of the tail: down to its last copper layer, and the bottom coverlay."""
    layers = layout.spec.fpc.stackup.layers
    copper = [i for i, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    kept = copper[tail_copper(layout) - 1] + 1
    below = layers[copper[-1] + 1 :]
    return layers[:kept] + below


def is_opened(
    bottom_openings: tuple[Region, ...], top_openings: tuple[Region, ...], index: int, layer: StackLayer
) -> bool:
    """Whether a layer of the tail, counted from the top, is a coverlay with openings over the contacts."""
    openings = top_openings if index == 0 else bottom_openings
    return layer.kind is LayerKind.COVERLAY and bool(openings)


def contact_copper(layout: Layout) -> frozenset[int]:
    """Numbers of the copper layers that have copper where the contacts are bare; the first alone without contacts."""
    bare = [box for pad in layout.pads if (box := _bare_box(layout.top_openings, pad)) is not None]
    if not bare:
        return frozenset({1})
    x0, y0, x1, y1 = box_around(bare)
    found = {pad.layer for pad in layout.pads}
    for via in layout.vias:
        (x, y), half = via.centre, via.pad / 2
        if x0 - half < x < x1 + half and y0 - half < y < y1 + half:
            found.update(range(1, layout.lowest_layer(via) + 1))
    for trace in layout.traces:
        if trace.role is Role.WINDING or trace.layer in found:
            continue
        half = trace.width / 2
        boxes = (segment.box for segment in trace.path.segments)
        if any(a - half < x1 and c + half > x0 and b - half < y1 and d + half > y0 for a, b, c, d in boxes):
            found.add(trace.layer)
    return frozenset(found)


def _bare_box(top_openings: tuple[Region, ...], pad: Pad) -> tuple[float, float, float, float] | None:
    """The box (m) of a contact's bare part; None where the coverlay covers all of it."""
    (x, y), (w, h) = pad.centre, pad.size
    for opening in top_openings:
        x0, y0, x1, y1 = bounding_box([opening.outline])
        if x0 < x < x1 and y0 < y < y1:
            return max(x0, x - w / 2), max(y0, y - h / 2), min(x1, x + w / 2), min(y1, y + h / 2)
    return None


def contact_layers(layout: Layout) -> tuple[StackLayer, ...]:
    """The tail's layers that are under the contacts, the contacts' own copper included.

    Opened coverlays and copper layers that end before the contacts are left out. Coverlay and bond films count with
    their stated thickness: where there is no copper their adhesive has nothing to fill, and no more of it is laid.
    """
    found, number, copper = [], 0, contact_copper(layout)
    for index, layer in enumerate(tail_layers(layout)):
        number += layer.kind is LayerKind.COPPER
        is_absent = layer.kind is LayerKind.COPPER and number not in copper
        if not is_absent and not is_opened(layout.bottom_openings, layout.top_openings, index, layer):
            found.append(layer)
    return tuple(found)


def tail_thickness(fpc: FpcSpec) -> float:
    """Thickness (m) of the tail: the stack-up down to its last copper layer, and the bottom coverlay."""
    stack = fpc.stackup
    layers = min(fpc.tail.layers, len(stack.copper)) if fpc.tail else len(stack.copper)
    last = stack.copper[layers - 1]
    bottom = stack.layers[-1]
    below = bottom.thickness if bottom.kind is not LayerKind.COPPER else 0.0
    return -(last.z - last.thickness / 2) + below


def stiffener(layout: Layout, tail: TailFrame) -> Stiffener | None:
    """The plate that brings a layout's contacts to the connector's insertion thickness; None for solder pads.

    It is as thick as the spec says, with the adhesive of a stock film of this thickness. If the spec says nothing, it
    is the stock one, or none, that comes nearest to what is wanted; else what is wanted, with an adhesive of 0.
    """
    fpc, connector = layout.spec.fpc, tail.connector
    if fpc.tail is None or connector.insertion_thickness <= 0.0:
        return None
    written, stock = fpc.tail.stiffener, stock_stiffeners()
    wanted = connector.insertion_thickness - math.fsum(layer.thickness for layer in contact_layers(layout))
    film, adhesive = min(((0.0, 0.0), *stock), key=lambda pair: (round(abs(sum(pair) - wanted), 9), pair[1]))
    thickness = film + adhesive
    if written is not None:
        thickness = written
        adhesive = next((glue for film, glue in stock if abs(film + glue - written) < 1e-9), 0.0)
    elif abs(thickness - wanted) > connector.insertion_thickness_tolerance and wanted > 0.0:
        thickness, adhesive = wanted, 0.0
    if thickness <= 0.0:
        return None
    start = max(tail.start, min(tail.end - connector.stiffener_length, first_via(fpc.rules, tail)))
    return Stiffener(Region(tail.strip(start)), thickness, "polyimide", adhesive)


STRAIGHT = math.radians(10.0)  # Tracks may cross the bend zone at this angle (rad) to the tail's length

_ROUNDING = 1e-9
_SAME_PLACE = 1e-8


@record
class Unfit:
    """A stretch of x (m) in the bend zone where one track runs askew or changes its width, and a place (m) on it."""

    first: float
    last: float
    y: float
    layer: int
    net: str


@record
class Stretch:
    """A stretch from one x to another (m); its length is not above zero where there is none."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """How long it is (m)."""
        return self.end - self.start


def bend_stretch(layout: Layout) -> tuple[float, float] | None:
    """The range of x (m) in which the tail may be bent; None where it has no bend, or nothing straight to bend."""
    if layout.bend_zone is None:
        return None
    longest = longest_straight(layout.bend_zone, unfit_for_bending(layout.bend_zone, layout.in_bend_zone,
                                                                   layout.traces))
    return (longest.start, longest.end) if longest.length > _ROUNDING else None


@record
class Bend:
    """A bend about the line x = `line` (m) across the tail by an angle (rad), ``down`` (away from the coils) or ``up``.
    It takes the board from `start` to `end` (m), only its line where no radius is known; `radius` (m) is inside. `why`
    says what makes it where that is the mount.
    """

    line: float
    start: float
    end: float
    angle: float
    direction: str
    radius: float | None
    is_dynamic: bool
    why: str = ""

    @property
    def angle_text(self) -> str:
        """The angle; one that the mount sets in whole degrees, nearer than a hand bends."""
        degrees = math.degrees(self.angle)
        return f"about {degrees:.0f} deg" if self.why else f"{degrees:.4g} deg"


def bend_figure(fpc: FpcSpec) -> tuple[str, float] | None:
    """Which figure of the fabricator's is the tail's smallest bend radius, and that radius by its thickness."""
    tail, rules = fpc.tail, fpc.rules
    if tail is None or tail.bend == "none":
        return None
    ratios = rules.dynamic_bend_ratio if tail.bend == "dynamic" else rules.static_bend_ratio
    if not ratios:
        return None
    layers = tail.layers if tail.layers in ratios else max(ratios)
    return f"{tail.bend}_bend_{layers}", ratios[layers]


def least_bend_radius(fpc: FpcSpec) -> float | None:
    """Smallest inside radius (m) that the tail may be bent to by the fabricator's rules; None where they state none."""
    figure = bend_figure(fpc)
    return None if figure is None else figure[1] * tail_thickness(fpc)


def bend_radius(fpc: FpcSpec) -> float | None:
    """The inside radius (m) of the bend: the spec's, or the fabricator's least; None where neither is stated."""
    tail = fpc.tail
    stated = tail.bend_radius if tail is not None else None
    return least_bend_radius(fpc) if stated is None else stated


def bend_length(fpc: FpcSpec) -> float:
    """The length (m) of tail that its bend takes, along the middle of its thickness; 0 where no radius is known."""
    tail, radius = fpc.tail, bend_radius(fpc)
    return 0.0 if tail is None or radius is None else tail.bend_angle * (radius + tail_thickness(fpc) / 2)


def longest_straight(zone: tuple[float, float], unfit: list[Unfit]) -> Stretch:
    """The longest stretch of a zone (m) that is free of all that is unfit."""
    unfit = sorted(unfit, key=lambda each: (each.first, each.last))
    starts = accumulate([zone[0], *(each.last for each in unfit)], max)
    ends = [*(each.first for each in unfit), zone[1]]
    pairs = zip(starts, ends, strict=True)
    return max((Stretch(start, end) for start, end in pairs), key=lambda each: (each.length, each.start))


def unfit_for_bending(
    zone: tuple[float, float] | None, in_bend_zone: tuple[tuple[Trace, Segment], ...], traces: tuple[Trace, ...]
) -> list[Unfit]:
    """What is unfit for bending in the bend zone, from the body on."""
    if zone is None:
        return []
    found = [*_askew(in_bend_zone, zone), *_steps(traces, zone)]
    return sorted(found, key=lambda each: (each.first, each.last))


def _askew(in_bend_zone: tuple[tuple[Trace, Segment], ...], zone: tuple[float, float]) -> Iterator[Unfit]:
    """Places inside the zone (x from and to, m) where a track does not run straight along the tail."""
    for trace, segment in in_bend_zone:
        x0, y0, x1, _ = segment.box
        if x0 < zone[1] - _ROUNDING and x1 > zone[0] + _ROUNDING and _angle(segment) > STRAIGHT:
            yield Unfit(max(zone[0], x0), min(zone[1], x1), y0, trace.layer, trace.net)


def _steps(traces: tuple[Trace, ...], zone: tuple[float, float]) -> Iterator[Unfit]:
    """Places inside the zone (x from and to, m) where a track's width changes."""
    widths: dict[tuple[int, int, int], float] = {}
    for trace in traces:
        for end in (trace.path.start, trace.path.end):
            key = trace.layer, round(end.x / _SAME_PLACE), round(end.y / _SAME_PLACE)
            if zone[0] < end.x < zone[1] and abs(widths.setdefault(key, trace.width) - trace.width) > _ROUNDING:
                yield Unfit(end.x, end.x, end.y, trace.layer, trace.net)


def _angle(segment: Segment) -> float:
    """The largest angle (rad, at most a right one) at its ends between a segment and the tail's length."""
    (ax, ay), (bx, by) = segment.start, segment.end
    if isinstance(segment, Arc):
        centre = segment.centre
        directions = [(centre.y - p.y, p.x - centre.x) for p in (segment.start, segment.end)]
    else:
        directions = [(bx - ax, by - ay)]
    return max(math.atan2(abs(dy), abs(dx)) for dx, dy in directions)
