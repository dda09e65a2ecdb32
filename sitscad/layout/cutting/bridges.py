"""Where a part stays joined to its panel: bridges spread along its outline, two of them at the end of its tail.

Parts stay whole: no perforation enters their outline, for a tear would start there; the cut stops at each bridge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from sitscad.geometry.path import Arc, Line, Path, Point, Segment, bounding_box
from sitscad.layout.board import Layout
from sitscad.layout.pieces import Pad
from sitscad.record import record

BRIDGE_RUN = 25e-3
"""One bridge at least for every so much of an outline (m), and three beside those at the tail's end, if there is room.
"""

FEWEST_BRIDGES = 3
"""A part on fewer bridges tilts or drops out while the panel is made: `checks` refuses such a panel."""

NARROWER, NARROWEST = 0.1e-3, 0.2e-3
"""In steps of this (m) narrower bridges are tried where wide ones find too few places, down to the spec's narrowest.
"""

FREE_OF_BRIDGES = 1.0e-3
"""How far (m) bridges keep from contacts and from the bend zone."""

BESIDE_CONTACTS = 0.25e-3
"""How far (m) a bridge at the tail's end keeps from the contacts: what it leaves on the edge is not plugged in."""

_STEP, _FINE_STEP = 0.25e-3, 0.05e-3
_ON_EDGE = 1e-9


@record
class Bridge:
    """Where the cut round a part stops: a segment of its outline, and the part of its length (m) that stays whole."""

    segment: int
    begin: float
    end: float

    def middle(self, outline: Path) -> Point:
        """The middle of the bridge, on the outline."""
        piece = outline.segments[self.segment]
        return piece.at((self.begin + self.end) / 2.0 / piece.length)


def cut_lines(outline: Path, stops: tuple[Bridge, ...]) -> tuple[Path, ...]:
    """A closed outline without its bridges: open paths, or the outline itself where there is no bridge."""
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
    """Where the cut stops before each bridge and goes on behind it, in the outline's sense."""
    pieces = ((_piece(outline.segments[stop.segment], stop.begin, stop.end)[0]) for stop in stops)
    return tuple((piece.start, piece.end) for piece in pieces)


def bridges(layout: Layout) -> tuple[Bridge, ...]:
    """Bridges along an outline: at the end of the tail on both its sides, the others as far apart as they can be.

    None at the contacts, beside what is plugged in or in the bend zone, where a nick in the edge would do harm; on
    straight edges unless those are too few. Wide bridges on a small part may find fewer places than
    `FEWEST_BRIDGES`: then only those are made that there is room for.
    """
    chosen = _at_the_end(layout)
    wanted = max(FEWEST_BRIDGES, math.ceil(layout.outline.length / BRIDGE_RUN) - len(chosen))
    places = list(_places(layout, _is_free, _STEP))
    straight = [place for place in places if isinstance(layout.outline.segments[place.segment], Line)]
    if len(straight) >= wanted:
        places = straight
    marks = [bridge.middle(layout.outline) for bridge in chosen]
    places = _apart_from(marks, places, layout)
    for _ in range(wanted):
        if not places:
            break
        ranked = ((_nearest(marks, place.middle(layout.outline)), -i, place) for i, place in enumerate(places))
        best = max(ranked, key=lambda entry: entry[:2])[2]
        chosen.append(best)
        marks.append(best.middle(layout.outline))
        places = _apart_from(marks[-1:], places, layout)
    return tuple(sorted(chosen, key=lambda b: (b.segment, b.begin)))


def narrower_bridge(layout: Layout) -> float | None:
    """The widest narrower bridge (m), in steps, of which enough find a place on a board; None if none do."""
    spec = layout.spec
    most, least = math.ceil(spec.fpc.panel.bridge / NARROWER - 1e-6) - 1, round(NARROWEST / NARROWER)
    for width in (steps * NARROWER for steps in range(most, least - 1, -1)):
        panel = replace(spec.fpc.panel, bridge=width)
        if len(bridges(replace(layout, spec=replace(spec, fpc=replace(spec.fpc, panel=panel))))) >= FEWEST_BRIDGES:
            return width
    return None


def _at_the_end(layout: Layout) -> list[Bridge]:
    """Two bridges near the contacts, one on either side of the tail: without them a long tail would hang free.

    On the stiffener where there is one, since before it the tail may bend.
    """
    if not layout.pads:
        return []
    centres = [pad.centre for pad in layout.pads]
    middle = Point(*(math.fsum(values) / len(centres) for values in zip(*centres, strict=True)))
    places = list(_places(layout, _is_at_end, _FINE_STEP)) or list(_places(layout, _is_free, _STEP))
    found: list[Bridge] = []
    while places and len(found) < 2:
        found.append(min(places, key=lambda place: round(place.middle(layout.outline).distance(middle), 6)))
        places = _apart_from([found[-1].middle(layout.outline)], places, layout)
    return found


def _nearest(marks: list[Point], at: Point) -> float:
    return round(min((at.distance(mark) for mark in marks), default=0.0), 6)


def _apart_from(marks: list[Point], places: list[Bridge], layout: Layout) -> list[Bridge]:
    """The places that leave two bridges' width between them and all marks."""
    least = 2.0 * layout.spec.fpc.panel.bridge
    return [place for place in places if all(place.middle(layout.outline).distance(mark) > least for mark in marks)]


Box = tuple[float, float, float, float]


def _places(layout: Layout, is_fit: Callable[[Layout, Box | None, Path], bool], step: float) -> Iterator[Bridge]:
    """Every bridge that could be made where the edge is fit for it, at steps (m) along each segment."""
    width = layout.spec.fpc.panel.bridge
    plate = None if layout.stiffener is None else bounding_box([layout.stiffener.outline.outline])
    for index, segment in enumerate(layout.outline):
        room = segment.length - 2.0 * width
        for i in range(int(room / step + 1e-9) + 1 if room >= 0 else 0):
            begin = width / 2.0 + i * step
            if is_fit(layout, plate, Path(tuple(_piece(segment, begin, begin + width)))):
                yield Bridge(index, begin, begin + width)


def _is_free(layout: Layout, plate: Box | None, edge: Path) -> bool:
    """Whether a piece of the edge lies on the film, off contacts, stiffener and bend zone."""
    at, keep = _middle(edge), FREE_OF_BRIDGES
    if layout.bend_zone is not None and layout.bend_zone[0] - keep < at.x < layout.bend_zone[1] + keep:
        return False
    boxes = [_pad_box(pad) for pad in layout.all_pads]
    if plate is not None:
        boxes.append(plate)
    return not any(_is_near(box, at, keep) for box in boxes)


def _is_at_end(layout: Layout, plate: Box | None, edge: Path) -> bool:
    """Whether a piece of the edge and a little on both sides of it is stiffened, or at least does not bend, and lies
    off the contacts.
    """
    at = _middle(edge)
    ends = [Point(1.5 * p.x - 0.5 * at.x, 1.5 * p.y - 0.5 * at.y) for p in (edge.start, edge.end)]
    if plate is not None:
        x0, y0, x1, y1 = plate
        if not all(x0 - _ON_EDGE <= p.x <= x1 + _ON_EDGE and y0 - _ON_EDGE <= p.y <= y1 + _ON_EDGE for p in ends):
            return False
    elif layout.bend_zone is not None and any(layout.bend_zone[0] < p.x < layout.bend_zone[1] for p in ends):
        return False
    keep = edge.length / 2.0 + BESIDE_CONTACTS
    return not any(_is_near(_pad_box(pad), at, keep) for pad in layout.all_pads)


def _middle(edge: Path) -> Point:
    return edge.segments[0].at(0.5)


def _pad_box(pad: Pad) -> Box:
    (w, h), (x, y) = pad.size, pad.centre
    return x - w / 2, y - h / 2, x + w / 2, y + h / 2


def _is_near(box: Box, at: Point, keep: float) -> bool:
    x0, y0, x1, y1 = box
    return x0 - keep < at.x < x1 + keep and y0 - keep < at.y < y1 + keep


def _piece(segment: Segment, begin: float, end: float) -> list[Segment]:
    """A segment from one length (m) along it to another; nothing where these are the same."""
    if end - begin < 1e-9:
        return []
    a, b = (segment.at(min(1.0, max(0.0, length / segment.length))) for length in (begin, end))
    return [Arc(a, b, segment.centre, segment.ccw)] if isinstance(segment, Arc) else [Line(a, b)]
