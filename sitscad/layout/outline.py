"""Outline of the board: the body with the coils, a taper, and the tail. Also the openings of the coverlay."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache

from sitscad.basics.finding import Missing, Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.convex import signed_distance
from sitscad.kernels.geometry.path import (
    Arc,
    Line,
    Path,
    Point,
    Region,
    Segment,
    bounding_box,
    rectangle,
    rounded_polygon,
    segment_part,
)
from sitscad.layout.board import Pad
from sitscad.layout.clearance import SLACK, Breadth, TrackToPlace, ViaToPlace
from sitscad.layout.lanes import Ring
from sitscad.layout.tail.frame import CORNER_RADIUS, TailFrame
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ArtworkSpec

_NEAR = 1e-9

CHORD = 1e-6  # How far (m) chords of an outline lie from its arcs where points are held against it
"""Largest distance (m) between an outline's arcs and the chords that replace them in comparisons with points."""


@record
class Root:
    """Concave rounded corner between one edge of the tail and the body.

    `centre` is the centre of its arc. The arc touches the body's edge at `on_body`, on segment number `piece` of this
    edge, and the tail's edge at `on_tail`.
    """

    centre: Point
    on_body: Point
    piece: int
    on_tail: Point


@lru_cache(maxsize=64)
def root(edge: Path, side: int, half_width: float, radius: float) -> Root | None:
    """Return the rounded concave corner between the body's edge `edge` and one edge of a tail along y = 0.

    `side` is +1 for the tail's upper edge and -1 for its lower edge. `half_width` (m) is half the tail's width, and
    `radius` (m) the corner's radius. None if the tail's edge does not meet the body.
    """
    height = side * (half_width + radius)
    touching = [(x, k, foot) for k, segment in enumerate(edge) for x, foot in _contacts(segment, height, radius)]
    if not touching:
        return None
    x, piece, foot = max(touching, key=lambda each: (round(each[0], 12), -each[1]))
    return Root(Point(x, height), foot, piece, Point(x, side * half_width))


def _contacts(segment: Segment, height: float, radius: float) -> Iterator[tuple[float, Point]]:
    """Yield (x of the centre, point of contact) for each circle that touches a segment, in metres.

    The circles have the given radius (m), and their centres lie at y = `height` (m).
    """
    start = segment.start
    for x in _abscissae(start, height, radius):
        yield x, start
    if isinstance(segment, Arc):
        centre = segment.centre
        for reach in (segment.radius + radius, abs(segment.radius - radius)):
            for x in _abscissae(centre, height, reach):
                distance = math.hypot(x - centre.x, height - centre.y)
                if distance > 0.0:
                    share = segment.radius / distance
                    foot = Point(centre.x + share * (x - centre.x), centre.y + share * (height - centre.y))
                    if segment.distance(foot) < _NEAR and abs(foot.distance(Point(x, height)) - radius) < _NEAR:
                        yield x, foot
        return
    nx, ny = ((segment.end.y - start.y) / segment.length, (start.x - segment.end.x) / segment.length)
    for reach in (radius, -radius) if abs(nx) > _NEAR else ():
        x = start.x + (reach - (height - start.y) * ny) / nx
        foot = Point(x - reach * nx, height - reach * ny)
        if segment.distance(foot) < _NEAR:
            yield x, foot


def _abscissae(centre: Point, height: float, reach: float) -> tuple[float, ...]:
    square = reach * reach - (height - centre.y) ** 2
    return () if square < 0.0 else (centre.x + math.sqrt(square), centre.x - math.sqrt(square))


def roots(edge: Path, tail: TailFrame) -> tuple[Root, Root] | None:
    """Return the lower and the upper concave corner between tail and body. None if the tail is wider than the body."""
    lower, upper = (root(edge, side, tail.half_width, tail.inner_radius) for side in (-1, 1))
    return None if lower is None or upper is None else (lower, upper)


def board(edge: Path, tail: TailFrame) -> Path:
    """Return the closed outline, counter-clockwise, of a body with the given edge and its tail.

    If the tail is wider than the body, the result is the body's edge alone.
    """
    sides = roots(edge, tail)
    if sides is None:
        return edge
    lower, upper = sides
    strip = tail.strip(max(tail.start, lower.on_tail.x, upper.on_tail.x)).segments[:-1]
    way = [
        *_between(edge, upper, lower),
        Arc(lower.on_body, lower.on_tail, lower.centre, ccw=False),
        Line(lower.on_tail, strip[0].start),
        *strip,
        Line(strip[-1].end, upper.on_tail),
        Arc(upper.on_tail, upper.on_body, upper.centre, ccw=False),
    ]
    return Path(tuple(part for part in way if part.start.distance(part.end) > 1e-10))


def _between(edge: Path, first: Root, last: Root) -> list[Segment]:
    count = len(edge.segments)
    before, after = edge.segments[first.piece], edge.segments[last.piece]
    if first.piece == last.piece and _along(before, first.on_body) <= _along(before, last.on_body):
        return [segment_part(before, first.on_body, last.on_body)]
    passed = range(1, (last.piece - first.piece) % count or count)
    return [
        segment_part(before, first.on_body, before.end),
        *(edge.segments[(first.piece + step) % count] for step in passed),
        segment_part(after, after.start, last.on_body),
    ]


def _along(segment: Segment, point: Point) -> float:
    """Return the distance along a segment from its start to a point on it: m for a line, rad for an arc."""
    if isinstance(segment, Line):
        return segment.start.distance(point)
    angle = math.atan2(point.y - segment.centre.y, point.x - segment.centre.x) - segment.start_angle
    return (angle if segment.ccw else -angle) % (2.0 * math.pi)


def walls(artwork: ArtworkSpec, tail: TailFrame) -> tuple[TrackToPlace, ...]:
    """Return the body's edge as tracks on all layers, which leads must avoid. Empty if the spec states no outline.

    The width of these tracks is twice the copper-to-edge distance minus twice the track spacing. A lead that keeps the
    track spacing to them thus keeps the fabricator's distance from the edge. The width can be negative.
    """
    edge = artwork.body_outline
    if edge is None:
        return ()
    rules = artwork.fpc.rules
    width, outline = 2.0 * (rules.copper_to_edge - rules.trace_spacing), board(edge, tail)
    return tuple(TrackToPlace(outline, width, copper.number) for copper in artwork.fpc.stackup.copper)


def lack(artwork: ArtworkSpec, tail: TailFrame | None) -> Shortfall | None:
    """Return the largest shortfall of room that is known before leads are laid out. None if there is none.

    It applies to a body whose outline is in the spec. The tail's width is compared with the body's width, and each
    coil's distance from the edge with the fabricator's minimum. `tail` is None for a board that the user drew.
    """
    edge, clearance = artwork.body_outline, artwork.fpc.rules.copper_to_edge
    if edge is None:
        return None
    (_, low, _, high), room = bounding_box([edge]), edge_room(artwork, edge)
    name = min(room, key=lambda name: room[name])
    wider = 0.0 if tail is None else max(tail.half_width - high, tail.half_width + low)
    if clearance - room[name] > max(wider, SLACK):
        return _lacking(artwork.fpc, room[name], clearance, ("coil", name))
    return _lacking(artwork.fpc, -wider, 0.0) if wider > SLACK else None


def edge_room(artwork: ArtworkSpec, edge: Path) -> dict[str, float]:
    """Return the smallest distance (m) from each coil's turns to the edge of the body, by the coil's name.

    Negative if the turns cross the edge.
    """
    room = dict[str, float]()
    for placement in artwork.array.placements:
        turns = Ring(artwork.coil, placement, 0.0).boundary.rotated(placement.rotation).shifted(*placement.centre)
        room[placement.name] = -max(signed_distance(edge, point) for point in turns.flattened(CHORD))
    return room


def _lacking(fpc: FpcSpec, have: float, need: float, *facts: tuple[str, object]) -> Shortfall:
    facts = (*facts, ("body", fpc.body.written if fpc.body else ""), ("missing", need - have))
    return Shortfall(Missing.BODY_ROOM, have, need, "m", facts=facts)


@record
class BodyExtent:
    """Size of the body, which is the part of the board in the jaw.

    It extends from `start` to `end` along x and from `low` to `high` across (m), with y = 0 at the tail's axis. `edge`
    is the body's outline from the spec; None if the spec gives none.
    """

    start: float
    end: float
    low: float
    high: float
    edge: Path | None = None

    def half_width(self, side: int) -> float:
        """Return the distance (m) from the tail's axis to the body's edge on one side: +1 above, -1 below."""
        return self.high if side > 0 else -self.low

    @property
    def corner_room(self) -> float:
        """Largest radius (m) of the corners away from the tail: a fifth of the shorter side."""
        return 0.2 * min(self.high - self.low, self.end - self.start)


def far_end(
    placements: tuple[CoilPlacement, ...], coil: CoilSpec, copper_to_edge: float, tracks: Iterable[TrackToPlace],
    holes: Iterable[ViaToPlace]
) -> float:
    """Return the x (m) of the body's end away from the tail.

    It lies at the edge distance of copper beyond all coils, tracks and holes.
    """
    least = min(p.centre[0] - Ring(coil, p, 0.0).half_size[0] for p in placements)
    for hole in holes:
        least = min(least, hole.centre.x - hole.pad / 2)
    for track in tracks:
        for segment in track.path:
            if least_x(segment) - track.width / 2 < least:
                least = min(least, segment.box[0] - track.width / 2)
    return least - copper_to_edge


def least_x(segment: Segment) -> float:
    """Return a lower limit of x (m) on a segment. It is cheaper to compute than the exact minimum."""
    return min(segment.start.x, segment.end.x) - segment.length


def ends(artwork: ArtworkSpec, first: float, last: float) -> tuple[float, float]:
    """Return the x range (m) of the body if coils and leads extend from `first` to `last` (m).

    The margin of the spec is added at both ends. Then one end is moved outwards until the mean of the coils' centres is
    in the middle. This stops when the body is as long as the jaw. If the spec states an outline, it determines both
    ends instead.
    """
    if (box := artwork.body_box) is not None:
        return box[0], box[2]
    margin, jaw = artwork.fpc.margin[0], artwork.jaw
    # a longer body may come out too long
    room = jaw.length - 2.0 * artwork.fpc.rules.outline_tolerance if jaw else math.inf
    return _centred_range(artwork.array.middle[0], first - margin, last + margin, room)


def body_breadth(artwork: ArtworkSpec, needed: Breadth) -> Breadth:
    """Return the y range of the body if coils and leads extend over the range `needed`.

    Margin and centring are as in `ends`.
    """
    if (box := artwork.body_box) is not None:
        return Breadth(box[1], box[3])
    margin, jaw = artwork.fpc.margin[1], artwork.jaw
    low, high = needed.low - margin, needed.high + margin
    return Breadth(*_centred_range(artwork.array.middle[1], low, high, jaw.width if jaw else math.inf))


def _centred_range(middle: float, low: float, high: float, room: float) -> tuple[float, float]:
    """Return the range `low` to `high`, extended on one side until its midpoint is `middle` or its length is `room`."""
    lacks = (middle - low) - (high - middle)
    more = min(abs(lacks), max(0.0, room - (high - low)))
    return (low, high + more) if lacks > 0.0 else (low - more, high)


def body_of(artwork: ArtworkSpec, first: float, needed: Breadth, tail: TailFrame) -> BodyExtent:
    """Return the size of the body if coils and leads begin at x = `first` (m) and need the y range `needed`.

    If the tail is wider than this range, the body is made as wide as the tail in any of these cases:

    * The side is too short for both the concave corner at the tail and the body's far corner.
    * The body extends beyond the x at which leads move outwards into the tail.
    * Only one side of the body is narrower than the tail.
    """
    across = body_breadth(artwork, needed)
    low, high = across.low, across.high
    if (edge := artwork.body_outline) is not None:
        return BodyExtent(*ends(artwork, first, tail.body_end), low, high, edge)
    start = ends(artwork, first, tail.body_end - tail.ahead - tail.zone)[0]
    body = BodyExtent(start, tail.body_end, low, high)
    is_ahead = tail.ahead > tail.waiting and not tail.taper.narrows
    is_astride = max(-low, high) > tail.half_width > min(-low, high)
    for side in (-1, 1):
        taper = replace(tail.taper, near=body.half_width(side))
        corner = taper.end - taper.length - taper.reach_before  # where the rounding of the first one begins
        is_short = not taper.narrows and corner < body.start + body.corner_room
        if is_ahead or is_astride or is_short:
            high = max(body.high, tail.half_width) if side > 0 else body.high
            body = replace(body, high=high, low=body.low if side > 0 else min(body.low, -tail.half_width))
    return body


def outline(body: BodyExtent, tail: TailFrame, copper: list[tuple[Point, float]], edge: float) -> Path:
    """Return the closed outline, counter-clockwise from the body's lower corner away from the tail.

    `copper` lists points on the copper, each with half the width (m) of the copper there. The radii of the body's
    corners are limited, so that all copper keeps the distance `edge` (m) from the outline. An outline that the spec
    states is not changed.
    """
    if body.edge is not None:
        return board(body.edge, tail)
    lower, upper = (
        [
            (Point(body.start, side * body.half_width(side)), _far_corner_radius(body, side, copper, edge)),
            *(
                (Point(point.x, -side * point.y), radius)
                for point, radius in (
                    *replace(tail.taper, near=body.half_width(side)).corners(),
                    *tail.plug_taper.corners(),
                    (Point(tail.end, -tail.plug_half_width), 0.0),
                )
            ),
        ]
        for side in (-1, 1)
    )
    corners = lower + upper[::-1]
    return rounded_polygon([point for point, _ in corners], [radius for _, radius in corners])


def _far_corner_radius(body: BodyExtent, side: int, copper: list[tuple[Point, float]], edge: float) -> float:
    """Return the largest permitted radius (m) of a body corner at the end away from the tail.

    All copper keeps at least the distance `edge` (m) from the rounded corner. The radius is at least `edge` and at most
    `CORNER_RADIUS`, and never exceeds `BodyExtent.corner_room`. `side` is +1 for the upper and -1 for the lower corner.
    """

    def keeps(radius: float, point: Point, need: float) -> bool:
        x, y = body.start + radius, body.half_width(side) - radius
        if point.x >= x or side * point.y <= y:  # not beside the corner's arc
            return True
        return Point(point.x, side * point.y).distance(Point(x, y)) <= radius - need + 1e-9

    radius = CORNER_RADIUS
    while radius > edge and not all(keeps(radius, point, half + edge) for point, half in copper):
        radius -= 0.05e-3
    return min(max(radius, edge), body.corner_room)


def openings(
    rules: DesignRules, tail: TailFrame, contacts: tuple[Pad, ...], chip_pads: Iterable[Pad],
    thermistor_pads: Iterable[Pad] = (),
) -> tuple[Region, ...]:
    """Return the coverlay's openings: one for all plug contacts or one for each solder contact, and for chips' pads.

    The opening for plug contacts covers the whole width of the plugged part and extends past its end, because a strip
    of coverlay would make the plug thicker. It is long enough that misregistered coverlay still leaves the full contact
    length bare. It extends past the edges by the sum of outline and coverlay tolerance. The coverlay covers the rims of
    solder contacts and leaves at least half of their area bare. Openings over the pads of capacitors and thermistor
    are larger than the pads by `chip_opening`.
    """
    over_thermistor = 0.0 if tail.thermistor is None else tail.thermistor.opening
    over_chips = (*(_grown(pad, tail.chip_opening) for pad in chip_pads),
                  *(_grown(pad, over_thermistor) for pad in thermistor_pads))
    if tail.connector.kind == "pads":
        return (*(_grown(pad, -rim_lap(rules, pad)) for pad in contacts), *over_chips)
    past = rules.outline_tolerance + rules.coverlay_registration
    half = tail.plug_half_width + past
    begin = tail.end - tail.end_gap - tail.connector.contact_length - rules.coverlay_registration
    return (Region(rectangle(begin, -half, tail.end + past, half)), *over_chips)


def rim_lap(rules: DesignRules, pad: Pad) -> float:
    """Return the width (m) of the rim of a solder contact that the coverlay covers.

    It is the lap in the design rules, or less if more than half of the contact's area would be covered.
    """
    # The lap that bares just half of w x h solves (w - 2 lap) (h - 2 lap) = w h / 2; whole micrometres stay above half
    w, h = pad.size
    return min(rules.pad_lap, math.floor((w + h - math.hypot(w, h)) / 4 * 1e6) * 1e-6)


def _grown(pad: Pad, by: float) -> Region:
    (w, h), (x, y) = (side / 2 + by for side in pad.size), pad.centre
    return Region(rectangle(x - w, y - h, x + w, y + h))
