"""Thickness of the board by region, and bending of the tail: tracks in the bend, permitted range, and defects."""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import StrEnum
from itertools import accumulate

from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Arc, Region, Segment, bounding_box, box_around
from sitscad.layout.board import Layout, Pad, Role, Stiffener, Trace
from sitscad.layout.tail.frame import TailFrame, first_via
from sitscad.spec.circuit import FpcSpec, LayerKind, StackLayer
from sitscad.spec.presets import stock_stiffeners


class Where(StrEnum):
    """A region of the board with its own stack of layers: at the coils, in the tail, or at the contacts."""

    COIL = "coil"
    TAIL = "tail"
    CONTACT = "contact"


@record
class FinishedThickness:
    """Thickness (m) of the finished board.

    `nominal` is the sum of its layers. `minimum` and `maximum` are the least and the largest delivered thickness.
    `source` names the origin of this tolerance.
    """

    minimum: float
    nominal: float
    maximum: float
    source: str


def finished_thickness(layout: Layout, where: Where) -> FinishedThickness:
    """Return the thickness of the finished board in a region: the sum of its layers and the fabricator's tolerance.

    The region at the coils has all layers. The region of the tail has the layers down to the tail's last copper layer,
    and the bottom coverlay. The region at the contacts has the layers `contact_layers` and the stiffener. The
    tolerance with a stiffener depends on its material; for unlisted materials, the largest listed tolerance is used.
    The tolerance without a stiffener depends on the number of copper layers. For larger numbers than listed, the entry
    of the largest listed number is used.
    """
    rules, plate = layout.spec.fpc.rules, layout.stiffener if where is Where.CONTACT else None
    layers = layout.spec.fpc.stackup.layers if where is Where.COIL else layout.spec.fpc.tail_layers
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


def contact_copper(layout: Layout) -> frozenset[int]:
    """Return the numbers of the copper layers that have copper at the bare part of a contact, on it or below it.

    Only layer 1 if there are no contacts.
    """
    bare_boxes = [box for pad in layout.pads if (box := _bare_box(layout.top_openings, pad)) is not None]
    if not bare_boxes:
        return frozenset({1})
    x0, y0, x1, y1 = box_around(bare_boxes)
    layers = {pad.layer for pad in layout.pads}
    for via in layout.vias:
        (x, y), half = via.centre, via.pad / 2
        if x0 - half < x < x1 + half and y0 - half < y < y1 + half:
            layers.update(range(1, layout.lowest_layer(via) + 1))
    for trace in layout.traces:
        if trace.role is Role.WINDING or trace.layer in layers:
            continue
        half = trace.width / 2
        boxes = (segment.box for segment in trace.path.segments)
        if any(a - half < x1 and c + half > x0 and b - half < y1 and d + half > y0 for a, b, c, d in boxes):
            layers.add(trace.layer)
    return frozenset(layers)


def _bare_box(top_openings: tuple[Region, ...], pad: Pad) -> Box | None:
    """Return the rectangle (m) of a contact's bare part. None if the coverlay covers the whole contact."""
    (x, y), (w, h) = pad.centre, pad.size
    for opening in top_openings:
        x0, y0, x1, y1 = bounding_box([opening.outline])
        if x0 < x < x1 and y0 < y < y1:
            return max(x0, x - w / 2), max(y0, y - h / 2), min(x1, x + w / 2), min(y1, y + h / 2)
    return None


def contact_layers(layout: Layout) -> tuple[StackLayer, ...]:
    """Return the layers of the tail at the contacts, including the contacts' own copper.

    Coverlays with an opening there and copper layers that end before the contacts are left out. Coverlay and bonding
    films have their stated thickness, because their adhesive has no gaps between tracks to fill.
    """
    layers, number, copper = [], 0, contact_copper(layout)
    for index, layer in enumerate(layout.spec.fpc.tail_layers):
        number += layer.kind is LayerKind.COPPER
        is_absent = layer.kind is LayerKind.COPPER and number not in copper
        openings = layout.bottom_openings if index else layout.top_openings
        if not is_absent and not (layer.kind is LayerKind.COVERLAY and openings):
            layers.append(layer)
    return tuple(layers)


def tail_thickness(fpc: FpcSpec) -> float:
    """Return the thickness (m) of the tail: the stack-up down to its last copper layer, and the bottom coverlay."""
    stack = fpc.stackup
    layers = min(fpc.tail.layers, len(stack.copper)) if fpc.tail else len(stack.copper)
    last = stack.copper[layers - 1]
    bottom = stack.layers[-1]
    below = bottom.thickness if bottom.kind is not LayerKind.COPPER else 0.0
    return -(last.z - last.thickness / 2) + below


def stiffener(layout: Layout, tail: TailFrame) -> Stiffener | None:
    """Return the stiffener that makes the tail at the contacts as thick as the connector requires.

    None if there is no tail, the connector has no insertion thickness (solder pads), or no stiffener is needed.

    If the spec states the thickness, the stiffener has this thickness. Its adhesive is taken from a stock film of equal
    thickness, or is 0. Otherwise the stock film nearest to the needed thickness is used, or no stiffener if 0 is
    nearer. If the error of this film exceeds the connector's tolerance, the exact needed thickness is returned, with an
    adhesive of 0.
    """
    fpc, connector = layout.spec.fpc, tail.connector
    if fpc.tail is None or connector.insertion_thickness <= 0.0:
        return None
    written, stock = fpc.tail.stiffener, stock_stiffeners()
    needed = connector.insertion_thickness - math.fsum(layer.thickness for layer in contact_layers(layout))
    film, adhesive = min(((0.0, 0.0), *stock), key=lambda pair: (round(abs(sum(pair) - needed), 9), pair[1]))
    thickness = film + adhesive
    if written is not None:
        thickness = written
        adhesive = next((glue for film, glue in stock if abs(film + glue - written) < 1e-9), 0.0)
    elif abs(thickness - needed) > connector.insertion_thickness_tolerance and needed > 0.0:
        thickness, adhesive = needed, 0.0
    if thickness <= 0.0:
        return None
    start = max(tail.start, min(tail.stiff_start, first_via(fpc.rules, tail)))
    return Stiffener(Region(tail.strip(start)), thickness, "polyimide", adhesive)


STRAIGHT = math.radians(10.0)  # Tracks may cross the bend zone at this angle (rad) to the tail's length
"""Largest angle (rad) between the tail's length and a track in the bend zone."""

_ROUNDING = 1e-9
_SAME_PLACE = 1e-8


@record
class Unfit:
    """A range of the bend zone that must not be bent, because a track is oblique or changes its width there.

    `first` to `last` is the range of x (m). `y` (m), `layer` and `net` belong to the track.
    """

    first: float
    last: float
    y: float
    layer: int
    net: str


@record
class Stretch:
    """Range of x (m) from `start` to `end`. Empty if its length is 0 or negative."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """Length (m)."""
        return self.end - self.start


def bend_stretch(layout: Layout) -> tuple[float, float] | None:
    """Return the longest range of x (m) in which the tail may be bent. None if it has no bend or no straight part."""
    if layout.bend_zone is None:
        return None
    longest = longest_straight(layout.bend_zone, unfit_for_bending(layout.bend_zone, layout.in_bend_zone,
                                                                   layout.traces))
    return (longest.start, longest.end) if longest.length > _ROUNDING else None


@record
class Bend:
    """Bend of the board by `angle` (rad) about the line x = `line` (m) across the tail.

    `direction` is ``down`` (away from the coils) or ``up``. The bent part extends from `start` to `end` (m). Both equal
    `line` if no radius is known. `radius` (m) is the inside radius. `is_dynamic` is True if the board is bent
    repeatedly in use. `why` is the reason for a bend that the mount causes; empty for a bend in the spec.
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
        """Text of the angle. If the mount causes the bend, the angle is rounded to whole degrees."""
        degrees = math.degrees(self.angle)
        return f"about {degrees:.0f} deg" if self.why else f"{degrees:.4g} deg"


def bend_figure(fpc: FpcSpec) -> tuple[str, float] | None:
    """Return the fabricator's rule for the tail's bend: (name, smallest inside radius divided by tail thickness).

    None if there is no such rule or no bend.
    """
    tail, rules = fpc.tail, fpc.rules
    if tail is None or tail.bend == "none":
        return None
    ratios = rules.dynamic_bend_ratio if tail.bend == "dynamic" else rules.static_bend_ratio
    if not ratios:
        return None
    layers = tail.layers if tail.layers in ratios else max(ratios)
    return f"{tail.bend}_bend_{layers}", ratios[layers]


def least_bend_radius(fpc: FpcSpec) -> float | None:
    """Return the smallest inside bend radius (m) of the tail by the fabricator's rule. None if there is no rule."""
    figure = bend_figure(fpc)
    return None if figure is None else figure[1] * tail_thickness(fpc)


def bend_radius(fpc: FpcSpec) -> float | None:
    """Return the inside bend radius (m): the spec's value, or else the fabricator's minimum.

    None if there is neither.
    """
    tail = fpc.tail
    radius = tail.bend_radius if tail is not None else None
    return least_bend_radius(fpc) if radius is None else radius


def bend_length(fpc: FpcSpec) -> float:
    """Return the length (m) of tail in the bend, along the middle of its thickness. 0 if no radius is known."""
    tail, radius = fpc.tail, bend_radius(fpc)
    return 0.0 if tail is None or radius is None else tail.bend_angle * (radius + tail_thickness(fpc) / 2)


def longest_straight(zone: tuple[float, float], unfit: list[Unfit]) -> Stretch:
    """Return the longest range of a zone (x from and to, m) without the ranges `unfit`."""
    unfit = sorted(unfit, key=lambda each: (each.first, each.last))
    starts = accumulate([zone[0], *(each.last for each in unfit)], max)
    ends = [*(each.first for each in unfit), zone[1]]
    pairs = zip(starts, ends, strict=True)
    return max((Stretch(start, end) for start, end in pairs), key=lambda each: (each.length, each.start))


def unfit_for_bending(
    zone: tuple[float, float] | None, in_bend_zone: tuple[tuple[Trace, Segment], ...], traces: tuple[Trace, ...]
) -> list[Unfit]:
    """Return the ranges of the bend zone that must not be bent, in order of x.

    `zone` is the bend zone (x from and to, m). `in_bend_zone` lists each track segment that extends into the zone, with
    its track.
    """
    if zone is None:
        return []
    places = [*_askew(in_bend_zone, zone), *_steps(traces, zone)]
    return sorted(places, key=lambda each: (each.first, each.last))


def _askew(in_bend_zone: tuple[tuple[Trace, Segment], ...], zone: tuple[float, float]) -> Iterator[Unfit]:
    """Yield the ranges in which a track is not parallel to the tail. `zone` is the bend zone (x from and to, m)."""
    for trace, segment in in_bend_zone:
        x0, y0, x1, _ = segment.box
        if x0 < zone[1] - _ROUNDING and x1 > zone[0] + _ROUNDING and _angle(segment) > STRAIGHT:
            yield Unfit(max(zone[0], x0), min(zone[1], x1), y0, trace.layer, trace.net)


def _steps(traces: tuple[Trace, ...], zone: tuple[float, float]) -> Iterator[Unfit]:
    """Yield the places at which a track's width changes. `zone` is the bend zone (x from and to, m)."""
    widths: dict[tuple[int, int, int], float] = {}
    for trace in traces:
        for end in (trace.path.start, trace.path.end):
            key = trace.layer, round(end.x / _SAME_PLACE), round(end.y / _SAME_PLACE)
            if zone[0] < end.x < zone[1] and abs(widths.setdefault(key, trace.width) - trace.width) > _ROUNDING:
                yield Unfit(end.x, end.x, end.y, trace.layer, trace.net)


def _angle(segment: Segment) -> float:
    """Return the larger of the two angles (rad, 0 to pi/2) between the ends of a segment and the tail's direction."""
    (ax, ay), (bx, by) = segment.start, segment.end
    if isinstance(segment, Arc):
        centre = segment.centre
        directions = [(centre.y - p.y, p.x - centre.x) for p in (segment.start, segment.end)]
    else:
        directions = [(bx - ax, by - ay)]
    return max(math.atan2(abs(dy), abs(dx)) for dx, dy in directions)
