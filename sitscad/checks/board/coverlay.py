"""SIT114 and SIT115: the coverlay's openings: what is left between them and beside them, and what they lay bare."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.checks.board.clearances import copper_in, drawn_rule, edge_gaps, edge_of, name_of
from sitscad.checks.board.copper import Outline, Position
from sitscad.checks.board.fabrication import FABRICATOR, ROUNDING, house, source_of
from sitscad.checks.cases import Case
from sitscad.checks.rules import Complaint, Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Place
from sitscad.geometry.path import Line, Point
from sitscad.geometry.primitives import Floats, Primitives, distances, from_rows, nearest_pairs, path_rows, to_points
from sitscad.layout.board import Trace, Via
from sitscad.spec.stackup import LayerKind


def coverlay_web(design: Design) -> Iterator[Verdict]:
    """The strip of coverlay left between two openings, and beside one along the board's edge."""
    layout = design.layout
    for side, openings in (("top", layout.top_openings), ("bottom", layout.bottom_openings)):
        pieces = [edge_of(region.outline) for region in openings]
        for one, other in combinations(pieces, 2):
            hint = "join them to one opening, or move the contacts apart"
            yield from _narrow_web(design, f"two openings of the {side} coverlay leave", hint, one, other)
        for one in pieces:
            hint = "a wider connector, or a fabricator whose coverlay keeps a narrower web"
            what = f"an opening of the {side} coverlay leaves"
            sides, edge = _apart(one, edge_of(layout.outline))
            inside = _inside_of(sides, layout.outline, design.spec.fpc.rules.coverlay_web)
            yield from _narrow_web(design, what, hint, inside, edge, "to the board's edge")


def _apart(opening: Primitives, edge: Primitives) -> tuple[Primitives, Primitives]:
    """An opening's sides and the board's edges but those that lie on each other: there the opening reaches the edge."""
    near = np.full(len(opening), ROUNDING)
    pairs = nearest_pairs(opening.boxes, near, edge.boxes, np.zeros(len(edge)))
    sides, edges = opening.take(pairs[:, 0]), edge.take(pairs[:, 1])
    on = (to_points(edges, sides.start) < ROUNDING) & (to_points(edges, sides.end) < ROUNDING)
    return opening.take(_others(len(opening), pairs[on, 0])), edge.take(_others(len(edge), pairs[on, 1]))


def _others(count: int, taken: NDArray[np.intp]) -> NDArray[np.intp]:
    """The numbers below a count that are not taken; numpy's own set functions load its masked arrays first."""
    free = np.ones(count, dtype=bool)
    free[taken] = False
    return np.flatnonzero(free)


def _inside_of(sides: Primitives, outline: Outline, web: float) -> Primitives:
    """The parts of an opening's straight sides inside the board's outline, without the last `web` (m) before an edge
    that they cross: there the opening reaches over the edge, and no strip is left beside it. Arcs are left as they are.
    """
    corners = outline.flattened(1e-6)
    kept: list[tuple[int, float, float]] = []
    for index in range(len(sides)):
        if sides.radius[index] > 0.0:
            kept.append((index, 0.0, 1.0))
            continue
        start, end = Point(*sides.start[index].tolist()), Point(*sides.end[index].tolist())
        short = web / max(start.distance(end), ROUNDING)
        for first, last in pairwise([0.0, *sorted(crossings(start, end, corners)), 1.0]):
            a, b = first + (short if first > 0.0 else 0.0), last - (short if last < 1.0 else 0.0)
            if b > a and _inside(corners, Line(start, end).at((first + last) / 2.0)):
                kept.append((index, a, b))
    table = np.array(kept, dtype=float).reshape(-1, 3)
    return sides.take(table[:, 0].astype(np.intp)).trimmed(table[:, 1], table[:, 2])


def crossings(start: Point, end: Point, corners: Sequence[Position]) -> Iterator[float]:
    """How far along a line, as a share of it, a closed polygon's edges cross it."""
    dx, dy = end - start
    for a, b in pairwise(corners):
        (ax, ay), (bx, by) = (a.x - start.x, a.y - start.y), (b.x - a.x, b.y - a.y)
        across = dx * by - dy * bx
        if across != 0.0 and 0.0 <= (ax * dy - ay * dx) / across < 1.0:
            along = (ax * by - ay * bx) / across
            if 0.0 < along < 1.0:
                yield along


def _narrow_web(
    design: Design, what: str, hint: str, one: Primitives, other: Primitives, where: str = "between them"
) -> Iterator[Complaint]:
    """A complaint where the strip of coverlay between two groups of edges is too narrow."""
    rules = design.spec.fpc.rules
    web = _smallest(one, other, rules.coverlay_web)
    if web < rules.coverlay_web - ROUNDING:
        yield NARROW_WEB.found("fpc.tail.connector", web, rules.coverlay_web, "m", hint=hint,
                               source=source_of(design, "coverlay_web"),
                               place=Place(float(one.start[0, 0]), float(one.start[0, 1])), what=what, where=where,
                               house=house(design, "coverlay_web"))


def coverlay_opening(design: Design) -> Iterator[Verdict]:
    """Copper that must stay covered: that there is a coverlay, and every opening's edge in it."""
    layout, films = design.layout, design.spec.fpc.stackup.layers
    for side, film, openings in (("top", films[0], layout.top_openings), ("bottom", films[-1], layout.bottom_openings)):
        if film.kind is LayerKind.COPPER:
            lies = _lies_on(design, side)
            yield NO_COVERLAY.found("fpc.stackup", side=side, finish=design.spec.fpc.finish, lies=lies)
        elif film.kind is not LayerKind.COVERLAY and openings:
            yield NOTHING_TO_OPEN.found("fpc.stackup", side=side, film=film.kind)
    for number, openings in ((1, layout.top_openings), (layout.copper_layers, layout.bottom_openings)):
        for region in openings:
            for item, gap, point in _bared(design, number, region.outline):
                yield _opening_complaint(design, item, gap,
                                         Place(float(point[0]), float(point[1]), number, (item.net,)))


def _lies_on(design: Design, side: str) -> str:
    """What of the sensor lies on bare copper without anything between."""
    target = design.spec.target
    if side == "bottom" or target is None or design.spec.elastomer is not None:
        return ""
    return f", and the target of {target.material.name} lies on them, a short from turn to turn"


def _smallest(one: Primitives, other: Primitives, within: float) -> float:
    """Smallest distance (m) between two sets of pieces, looking no further than `within`; infinite beyond."""
    pairs = nearest_pairs(one.boxes, np.full(len(one), within), other.boxes, np.zeros(len(other)))
    if not len(pairs):
        return float("inf")
    return float(np.min(distances(one.take(pairs[:, 0]), other.take(pairs[:, 1]))))


def _bared(design: Design, number: int, opening: Outline) -> Iterator[tuple[Trace | Via, float, Floats]]:
    """Tracks and vias of a layer in or too near an opening in which they do not end: item, worst gap (m), where."""
    copper, asked = copper_in(design), design.spec.fpc.rules.coverlay_opening_to_trace
    edge, corners = from_rows([row for row, _ in path_rows(opening)]), opening.flattened(1e-6)
    worst: dict[int, tuple[float, int]] = {}
    for index, gap in edge_gaps(copper, edge, asked):
        if copper.layer[index] == number:
            key = int(copper.item[index])
            worst[key] = min(worst.get(key, (gap, index)), (gap, index))
    for key, item in enumerate(copper.items):
        if isinstance(item, Via) and _inside(corners, item.centre):
            worst[key] = (-item.pad / 2.0, int(np.flatnonzero(copper.item == key)[0]))
    for key, (gap, index) in sorted(worst.items()):
        item = copper.items[key]
        if isinstance(item, Via) or (isinstance(item, Trace) and not _ends_inside(item, corners)):
            yield item, gap, copper.pieces.start[index]


def _ends_inside(trace: Trace, corners: Sequence[Position]) -> bool:
    return _inside(corners, trace.path.start) or _inside(corners, trace.path.end)


def _inside(corners: Sequence[Position], point: Position) -> bool:
    """Whether a point lies inside a closed polygon (even-odd rule)."""
    inside = False
    for a, b in pairwise(corners):
        if (a.y > point.y) != (b.y > point.y) and point.x < a.x + (point.y - a.y) * (b.x - a.x) / (b.y - a.y):
            inside = not inside
    return inside


def _opening_complaint(design: Design, item: Trace | Via, gap: float, place: Place) -> Complaint:
    """The complaint for an opening of the coverlay that is too near to a track or via beside it."""
    rules = design.spec.fpc.rules
    return OPENING_NEAR_TRACK.found("fpc.tail", gap, rules.coverlay_opening_to_trace, "m",
                                    source=source_of(design, "coverlay_opening_to_trace"), place=place,
                                    what=name_of(item), layer=place.layer, gap=max(0.0, gap),
                                    house=house(design, "coverlay_opening_to_trace"))


NARROW_WEB = Case("{what} a web of {measured:m} {where}; {house} asks {limit:m}",)

NO_COVERLAY = Case(
    "the {side} of the board has no coverlay: all its tracks lie bare, are finished with {finish} as the contacts are, "
    "which no estimate counts{lies}",
    hint="begin and end fpc.stackup with a coverlay: 27.5 um are 12.5 um polyimide and 15 um adhesive",
)

NOTHING_TO_OPEN = Case(
    "the contacts are bared in the {side} coverlay, and the stack-up has a {film} there: no openings are made in it",
    hint="write that layer of fpc.stackup as a coverlay",
)

OPENING_NEAR_TRACK = Case(
    "{what} on layer {layer} comes within {gap:m} of an opening of the coverlay; {house} asks {limit:m}",
    hint="bare copper beside the contact: lengthen the tail or move the track",
)


COVERLAY_RULES: tuple[Rule, ...] = (
    drawn_rule(114, "coverlay-web", (
        "Between two openings, and between one and the board's edge, the coverlay keeps the fabricator's web.",
        "A narrower strip of coverlay tears, or comes off.",
        "Join the openings, move the contacts apart, or give them more board beside them.",
    ), FABRICATOR, coverlay_web),
    drawn_rule(115, "coverlay-opening", (
        "Copper that must stay covered lies under a coverlay on both faces of the board, and keeps its distance from "
        "every opening in it.",
        "The coverlay is laid by hand within some tenths of a millimetre: a track near an opening ends up bare. Bare "
        "turns are plated with nickel and gold, which changes them, and whatever conducts and touches them shorts "
        "them.", "Move the track, or lengthen the tail; give the stack-up a coverlay above and below.",
    ), FABRICATOR, coverlay_opening),
)
