"""The panel: a frame with several copies of a part that is too small to be handled alone.

Bridges are short uncut pieces of outline that hold the copies in the frame. The panel is ordered as a whole. The frame
has three tooling holes and three fiducials, so that it cannot be loaded in a wrong orientation. It also has coupons. A
coupon is the sensor's first coil alone with solder pads. Its inductance can be measured before any part is cut out. All
parts have the same orientation, so that all tails lie along the same grain of the film. Bridges are not perforated,
because holes in a part's outline would start a tear. Lengths are in metres. The origin is the panel's lower left
corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Line, Path, Point, Segment, bounding_box, segment_part
from sitscad.layout import arrange
from sitscad.layout.board import Layout, Pad
from sitscad.spec.circuit import MOST_PARTS, FpcSpec, PanelSpec
from sitscad.spec.coil import ArraySpec, CoilPlacement
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import SensorSpec

BRIDGE_RUN = 25e-3
"""Largest length (m) of outline for each bridge. Longer outlines have more bridges.

At least three bridges are added to the bridges at the tail's end, if there is room.
"""

FEWEST_BRIDGES = 3
"""Smallest number of bridges for each part.

With fewer bridges, a part tilts or drops out in production, and a rule refuses the panel.
"""

NARROWER, NARROWEST = 0.1e-3, 0.2e-3
"""Step (m) by which the bridge width is reduced if too few bridges fit, and smallest bridge width (m)."""

FREE_OF_BRIDGES = 1.0e-3  # Distance (m) of bridges from contacts and from the bend zone
"""Smallest distance (m) of bridges from contacts, stiffener and bend zone."""

BESIDE_CONTACTS = 0.25e-3
"""Smallest distance (m) between a contact and a bridge at the tail's end.

The bridge's remnant must not be plugged in.
"""

_STEP, _FINE_STEP = 0.25e-3, 0.05e-3
_ON_EDGE = 1e-9


@record
class Bridge:
    """An uncut piece of a part's outline.

    `segment` is the index of the outline's segment. `begin` and `end` (m) are the distances along this segment.
    """

    segment: int
    begin: float
    end: float

    def middle(self, outline: Path) -> Point:
        """Return the middle of the bridge on the given outline."""
        piece = outline.segments[self.segment]
        return piece.at((self.begin + self.end) / 2.0 / piece.length)


_Place = tuple[Bridge, Point]
"""A possible bridge, and its midpoint."""


def cut_lines(outline: Path, stops: tuple[Bridge, ...]) -> tuple[Path, ...]:
    """Return the cuts along a closed outline: open paths that stop at the bridges.

    The outline itself without bridges.
    """
    runs: list[list[Segment]] = [[]]
    for index, segment in enumerate(outline):
        at = 0.0
        for bridge in sorted((b for b in stops if b.segment == index), key=lambda b: b.begin):
            runs[-1] += _piece(segment, at, bridge.begin)
            runs.append([])
            at = bridge.end
        runs[-1] += _piece(segment, at, segment.length)
    if len(runs) > 1:
        runs[0] = runs.pop() + runs[0]
    return tuple(Path(tuple(run)) for run in runs if run)


def bridge_ends(outline: Path, stops: tuple[Bridge, ...]) -> tuple[tuple[Point, Point], ...]:
    """Return the two ends of each bridge, in the direction of the outline."""
    pieces = ((_piece(outline.segments[stop.segment], stop.begin, stop.end)[0]) for stop in stops)
    return tuple((piece.start, piece.end) for piece in pieces)


def bridges(layout: Layout, width: float | None = None) -> tuple[Bridge, ...]:
    """Return the bridges along a board's outline. `width` (m) is their length; None for the spec's value.

    One bridge is at the end of the tail on each side. The others are as far apart as possible. No bridge is at the
    contacts, beside the plugged part or in the bend zone, where its remnant would do harm. Bridges are on straight
    edges unless these have too few places. If fewer bridges than `FEWEST_BRIDGES` fit, only these are returned.
    """
    width = layout.spec.fpc.panel.bridge if width is None else width
    edge, least = layout.outline, 2.0 * width
    plate = None if layout.stiffener is None else bounding_box([layout.stiffener.outline.outline])
    free = list(_places(edge, width, partial(_is_free, plate, layout.bend_zone, layout.all_pads), _STEP))

    def apart_from(marks: list[_Place], places: list[_Place]) -> list[_Place]:
        return [(bridge, at) for bridge, at in places if all(at.distance(mark) > least for _, mark in marks)]

    chosen: list[_Place] = []
    if layout.pads:  # on the stiffener where there is one: without these two a long tail would hang free
        centres = [pad.centre for pad in layout.pads]
        middle = Point(*(math.fsum(values) / len(centres) for values in zip(*centres, strict=True)))
        is_at_end = partial(_is_at_end, plate, layout.bend_zone, layout.all_pads)
        places = list(_places(edge, width, is_at_end, _FINE_STEP)) or free
        while places and len(chosen) < 2:
            chosen.append(min(places, key=lambda place: round(place[1].distance(middle), 6)))
            places = apart_from(chosen[-1:], places)
    missing = max(FEWEST_BRIDGES, math.ceil(edge.length / BRIDGE_RUN) - len(chosen))
    straight = [place for place in free if isinstance(edge.segments[place[0].segment], Line)]
    places = apart_from(chosen, straight if len(straight) >= missing else free)
    while places and missing > 0:
        missing -= 1
        distances = [min((at.distance(mark) for _, mark in chosen), default=0.0) for _, at in places]
        chosen.append(places[max(range(len(places)), key=lambda i: (round(distances[i], 6), -i))])
        places = apart_from(chosen[-1:], places)
    return tuple(sorted((bridge for bridge, _ in chosen), key=lambda b: (b.segment, b.begin)))


def narrower_bridge(layout: Layout) -> float | None:
    """Return the largest bridge width (m) below the spec's for which `FEWEST_BRIDGES` bridges fit.

    None if there is none. Widths are multiples of `NARROWER`.
    """
    most, least = math.ceil(layout.spec.fpc.panel.bridge / NARROWER - 1e-6) - 1, round(NARROWEST / NARROWER)
    widths = (steps * NARROWER for steps in range(most, least - 1, -1))
    return next((width for width in widths if len(bridges(layout, width)) >= FEWEST_BRIDGES), None)


def _places(outline: Path, width: float, is_fit: Callable[[Segment], bool], step: float) -> Iterator[_Place]:
    """Yield possible bridges of `width` (m), at intervals of `step` (m) along each segment of the outline.

    `is_fit` returns whether a bridge may lie on a piece of a segment.
    """
    for index, segment in enumerate(outline):
        length = segment.length
        room = length - 2.0 * width
        for i in range(int(room / step + 1e-9) + 1 if room >= 0 else 0):
            begin = width / 2.0 + i * step
            end = begin + width
            if is_fit(segment_part(segment, segment.at(begin / length), segment.at(end / length))):
                yield Bridge(index, begin, end), segment.at((begin + end) / 2.0 / length)


def _is_free(plate: Box | None, bend_zone: tuple[float, float] | None, pads: tuple[Pad, ...], edge: Segment) -> bool:
    """Whether a piece of the edge is far enough from contacts, stiffener and bend zone for a bridge."""
    at, keep = edge.at(0.5), FREE_OF_BRIDGES
    if bend_zone is not None and bend_zone[0] - keep < at.x < bend_zone[1] + keep:
        return False
    return not (plate and _is_near(plate, at, keep)) and _is_off_contacts(pads, at, keep)


def _is_off_contacts(pads: tuple[Pad, ...], at: Point, keep: float) -> bool:
    halves = ((pad.centre, pad.size[0] / 2, pad.size[1] / 2) for pad in pads)
    return not any(_is_near((x - w, y - h, x + w, y + h), at, keep) for (x, y), w, h in halves)


def _is_near(box: Box, at: Point, keep: float) -> bool:
    x0, y0, x1, y1 = box
    return x0 - keep < at.x < x1 + keep and y0 - keep < at.y < y1 + keep


def _is_at_end(plate: Box | None, bend_zone: tuple[float, float] | None, pads: tuple[Pad, ...], edge: Segment) -> bool:
    """Whether a piece of the edge at the tail's end may have a bridge: it is stiffened, or outside the bend zone.

    It must also keep its distance from the contacts.
    """
    at = edge.at(0.5)
    ends = [Point(1.5 * p.x - 0.5 * at.x, 1.5 * p.y - 0.5 * at.y) for p in (edge.start, edge.end)]
    if plate is not None:
        x0, y0, x1, y1 = plate
        if not all(x0 - _ON_EDGE <= p.x <= x1 + _ON_EDGE and y0 - _ON_EDGE <= p.y <= y1 + _ON_EDGE for p in ends):
            return False
    elif bend_zone is not None and any(bend_zone[0] < p.x < bend_zone[1] for p in ends):
        return False
    return _is_off_contacts(pads, at, edge.length / 2.0 + BESIDE_CONTACTS)


def _piece(segment: Segment, begin: float, end: float) -> list[Segment]:
    """Return the part of a segment between two distances (m) from its start. Empty if the distances are equal."""
    if end - begin < 1e-9:
        return []
    a, b = (segment.at(min(1.0, max(0.0, length / segment.length))) for length in (begin, end))
    return [segment_part(segment, a, b)]


TOOLING_HOLE = 1.5e-3
"""Diameter (m) of the tooling holes."""
FIDUCIAL = 1.0e-3
"""Diameter (m) of the copper dot of a fiducial."""
FIDUCIAL_OPENING = 2.0e-3
"""Diameter (m) of the coverlay opening around a fiducial."""
FIDUCIAL_STEP = 5.0e-3  # Distance (m) of a fiducial from its tooling hole
"""Distance (m) between a fiducial and its tooling hole."""


@record
class Panel:
    """Copies of a board in a frame, in `columns` and `rows`.

    `layout` is the board, `size` the panel's outer size [x, y] (m), and `rail` the width (m) of the frame. `parts` and
    `coupons` are the positions of each copy's origin. `bridges` and `coupon_bridges` are the uncut pieces of one
    outline. `coupon` is the layout of the coupon. None if there is no coupon; `no_coupon` then gives the reason.
    `tooling_holes` and `fiducials` are centres of holes and marks in the frame.
    """

    layout: Layout
    size: tuple[float, float]
    columns: int
    rows: int
    parts: tuple[Point, ...]
    bridges: tuple[Bridge, ...]
    coupon: Layout | None
    coupons: tuple[Point, ...]
    coupon_bridges: tuple[Bridge, ...]
    no_coupon: str
    tooling_holes: tuple[Point, ...]
    fiducials: tuple[Point, ...]
    rail: float

    @property
    def cuts(self) -> tuple[Path, ...]:
        """Cuts along the outlines of all parts and coupons: open paths that stop at the bridges."""
        paths = [piece.shifted(*at) for at in self.parts for piece in cut_lines(self.layout.outline, self.bridges)]
        if self.coupon is not None:
            pieces = cut_lines(self.coupon.outline, self.coupon_bridges)
            paths += [piece.shifted(*at) for at in self.coupons for piece in pieces]
        return tuple(paths)


def is_too_small(size: tuple[float, float], rules: DesignRules) -> bool:
    """Whether a board of this size (m) is smaller than the smallest part that the fabricator handles singly."""
    return any(side < least - 1e-9 for side, least in zip(sorted(size), sorted(rules.part_size), strict=True))


def is_wanted(size: tuple[float, float], fpc: FpcSpec) -> bool:
    """Whether the spec requests a panel, or leaves the choice open and the board is too small to be handled singly."""
    return fpc.panel.wish == "always" or (fpc.panel.wish == "auto" and is_too_small(size, fpc.rules))


def least_size(size: tuple[float, float], wish: PanelSpec) -> tuple[float, float]:
    """Return the sides (m) of the smallest panel for the number of boards in the spec, or for one board.

    The panel has no coupons.
    """
    (length, width) = size
    columns, rows = wish.parts or (1, 1)
    frame = 2 * (wish.rail + wish.gap) - wish.gap
    return columns * (length + wish.gap) + frame, rows * (width + wish.gap) + frame


def plan(layout: Layout) -> Panel | None:
    """Return the panel of a board. None if no panel is wanted.

    Copies fill the fabricator's usual panel unless the spec states their number, which is 1 to `MOST_PARTS`. One coupon
    is at each end of the lowest row, to show a drift across the panel, or a single coupon if there is no room for two.
    Tooling holes are in three corners of the frame, each with a fiducial beside it.
    """
    if not is_wanted(layout.size, layout.spec.fpc):
        return None
    wish, usual = layout.spec.fpc.panel, layout.spec.fpc.rules.panel_size
    gap, rail, frame = wish.gap, wish.rail, wish.rail + wish.gap
    coupon, no_coupon = _coupon(layout.spec)
    x0, y0, x1, y1 = bounding_box([layout.outline])
    box = bounding_box([coupon.outline]) if coupon else (0.0, 0.0, 0.0, 0.0)
    coupon_width, strip = box[2] - box[0], box[3] - box[1] + gap if coupon else 0.0
    step = x1 - x0 + gap, y1 - y0 + gap
    fill = [math.floor((usual[k] - frame - rail - (0.0, strip)[k] + 1e-9) / step[k]) for k in (0, 1)]
    filled = min(max(1, fill[0]), MOST_PARTS)
    columns, rows = wish.parts or (filled, min(max(1, fill[1]), MOST_PARTS // filled))
    inner = max(columns * step[0] - gap, coupon_width)
    size = inner + 2 * frame, rows * step[1] - gap + strip + 2 * frame

    def on_grid(x: float, y: float) -> Point:  # of whole micrometres, which the files' grid of nanometres holds exactly
        return Point(round(x, 6), round(y, 6))

    coupon_starts = [frame, frame + inner - coupon_width] if inner >= 2 * coupon_width + gap else [frame]
    edge, right, high = rail / 2.0, size[0] - rail / 2.0, size[1] - rail / 2.0
    return Panel(
        layout=layout,
        size=size,
        columns=columns,
        rows=rows,
        parts=tuple(
            on_grid(frame + i * step[0] - x0, frame + strip + j * step[1] - y0)
            for j in range(rows)
            for i in range(columns)
        ),
        bridges=bridges(layout),
        coupon=coupon,
        coupons=tuple(on_grid(corner - box[0], frame - box[1]) for corner in coupon_starts) if coupon else (),
        coupon_bridges=bridges(coupon) if coupon else (),
        no_coupon=no_coupon,
        tooling_holes=(Point(edge, edge), Point(right, edge), Point(edge, high)),
        fiducials=(
            Point(edge + FIDUCIAL_STEP, edge),
            Point(right - FIDUCIAL_STEP, edge),
            Point(edge + FIDUCIAL_STEP, high),
        ),
        rail=rail,
    )


def _coupon(spec: SensorSpec) -> tuple[Layout | None, str]:
    """Return the layout of the coupon, and an empty text; or None, and the reason why there is no coupon.

    The coupon is the first coil alone on a piece of the same stack-up with solder pads.
    """
    if spec.fpc.tail is None and len(spec.all_placements) == 1:
        return None, "the part is a single coil with solder pads: every part is its own coupon"
    coupon = arrange(coupon_spec(spec))
    if coupon.shortfalls or not all(coil.is_closed_circuit for coil in coupon.coils):
        reasons = "; ".join(lack.message for lack in coupon.shortfalls) or "the coil does not reach its pads"
        return None, f"a single coil with solder pads finds no room: {reasons}"
    if len(bridges(coupon)) < FEWEST_BRIDGES:
        return None, f"bridges of {show(spec.fpc.panel.bridge, 'm')} find fewer than three places on it"
    return coupon, ""


def coupon_spec(spec: SensorSpec) -> SensorSpec:
    """Return the sensor's spec reduced to its first coil in free air, with solder pads in place of the tail."""
    alone = CoilPlacement("C1", (0.0, 0.0), spec.array.placements[0].rotation)
    return replace(
        spec, array=ArraySpec("single", (alone,)), fpc=replace(spec.fpc, tail=None, body=None, largest=None),
        readout=replace(spec.readout, chip=None), target=None, elastomer=None, encapsulation=None, mount=None,
        shield=None,
    )
