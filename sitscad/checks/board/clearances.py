"""SIT107 to SIT110, SIT114 and SIT115: distances between copper, holes, the board's edge and coverlay openings.

The coverlay rules check the strips between openings, and the copper that openings expose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.finding import Missing, Place
from sitscad.basics.units import show
from sitscad.checks.board.fabrication import gap_asked_by, house, short_of
from sitscad.checks.fixes.moves import larger_connectors, wider
from sitscad.checks.fixes.search import setting
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design, cached_per_board
from sitscad.kernels.geometry.path import Arc, Line, Path, Point
from sitscad.kernels.geometry.primitives import Primitives, distances, from_rows, nearest_pairs, path_rows, to_points
from sitscad.layout.board import Pad, Role, Trace, Via
from sitscad.layout.copper import (
    Copper,
    Item,
    Nearness,
    copper_of,
    drill_nearness,
    name_of,
    pair_in_words,
    too_near,
)
from sitscad.layout.outline import rim_lap
from sitscad.spec.circuit import FpcSpec, LayerKind, Tail
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules

GRAIN = 1e-6
"""Step (m) of the spacings that hints name."""

WHY = "on a spiral of so wide a pitch turns lie nearer than they are spaced along the radius"

ALLOWED_SHORTFALL = 1e-6
"""Length (m) by which a drawn gap may fall short of the rule.

A spiral's gap, measured perpendicular to the track, is a little smaller than its spacing.
"""


def nearer_by(coil: CoilSpec) -> float:
    """Return the largest reduction (m) of the gap between neighbouring turns of a round coil against its spacing.

    It occurs at the inner end, where the spiral's slope against the circle (pitch over circumference) is steepest.
    """
    if not coil.outline.is_round:
        return 0.0
    inner = (coil.size[0] - coil.trace_width) / 2 - coil.pitch * max(coil.layer_turns)
    slope = coil.pitch / (2.0 * math.pi * max(inner, coil.pitch / 2))
    return coil.pitch * (1.0 - math.cos(math.atan(slope)))


def copper_to_edge(design: Design) -> Iterator[Verdict]:
    """Yield findings on the distance of copper to the board's outline.

    A connector's contacts may extend to the end that is plugged in.
    """
    asked, tail = design.spec.fpc.rules.copper_to_edge, design.spec.fpc.tail
    # A body too small for its coils is one finding (SIT135), not one for every layer of every coil
    is_told = any(short.what is Missing.BODY_ROOM for short in design.layout.shortfalls)
    for (what, layer), (gap, index, item) in _near_edge(design).items():
        x, y = copper_in(design).pieces.start[index].tolist()
        missing = f"{show(asked - gap, 'm')} are missing: "
        found = short_of(
            design.spec.fpc.rules, "copper_to_edge", gap,
            f"{what} on layer {layer} comes within {show(max(0.0, gap), 'm')} of the board's edge",
            f"{missing}a wider board, or a smaller coil, gives it room", "coil.outer_diameter",
            Place(x, y, layer, (item.net,)),
        )
        at_plug = tail is not None and isinstance(item, Trace) and item.role is Role.TAIL
        if is_told and not at_plug:
            continue
        yield found if not at_plug else replace(
            found, hint=missing + _edge_margin(design.spec.fpc.tail), key="fpc.tail.connector",
            fixes=(lambda: larger_connectors(design.spec, "edge_margin"),),
        )


def _near_edge(design: Design) -> dict[tuple[str, int], tuple[float, int, Item]]:
    """Return the copper that is too near the edge, by name and layer: smallest gap (m), piece number and item."""
    layout, copper = design.layout, copper_in(design)
    worst: dict[tuple[str, int], tuple[float, int, Item]] = {}
    for index, gap in edge_gaps(copper, edge_of(layout.outline), design.spec.fpc.rules.copper_to_edge):
        item, layer = copper.items[copper.item[index]], int(copper.layer[index])
        if isinstance(item, Pad) and layout.spec.fpc.tail is not None:
            continue
        what = name_of(item), layer
        if what not in worst or gap < worst[what][0]:
            worst[what] = gap, index, item
    return worst


def _edge_margin(tail: Tail | None) -> str:
    """Return the hint on the board's edge beside a connector's contacts."""
    assert tail is not None
    unseen = " (unverified)" if is_unverified(tail.connector.source, "edge_margin") else ""
    have = f"{tail.connector.name} has {show(tail.connector.edge_margin, 'm')}{unseen}"
    return (f"beside its contacts {have} of board from their middle: a connector with more, or a fabricator who cuts "
            "nearer to copper")


def drill_to_copper(design: Design) -> Iterator[Verdict]:
    """Yield findings on the distance of every hole's wall to copper that does not belong to it, on every layer."""
    rules = design.spec.fpc.rules
    for near in drill_nearness(copper_in(design), rules.drill_to_copper - ALLOWED_SHORTFALL):
        via, foreign = (near.one, near.other) if isinstance(near.one, Via) else (near.other, near.one)
        yield Violation(
            f"a hole of {via.net} comes within {show(max(0.0, near.gap), 'm')} of {name_of(foreign)} on layer "
            f"{near.layer}; {house(rules, 'drill_to_copper')} asks {show(rules.drill_to_copper, 'm')} from hole to "
            "copper", f"{show(rules.drill_to_copper - near.gap, 'm')} are missing", "coil.turns", near.gap,
            rules.drill_to_copper, "m", source=rules.source_of("drill_to_copper"),
            place=Place(near.x, near.y, near.layer, near.nets),
        )


def edge_of(outline: Path) -> Primitives:
    """Return a closed outline as pieces for the measurement of distances."""
    return from_rows([row for row, _ in path_rows(outline)])


def copper_in(design: Design) -> Copper:
    """Return the copper of the design, computed once for all rules."""
    return cached_per_board(design, "copper", lambda: copper_of(design.layout))


def edge_gaps(copper: Copper, edge: Primitives, asked: float) -> Iterator[tuple[int, float]]:
    """Yield the pieces of copper nearer to an edge than `asked` (m): their indices and gaps (m)."""
    reach = copper.half + asked
    pairs = nearest_pairs(copper.pieces.boxes, reach, edge.boxes, np.zeros(len(edge)))
    i, j = pairs[:, 0], pairs[:, 1]
    gap = distances(copper.pieces.take(i), edge.take(j)) - copper.half[i]
    for k in np.flatnonzero(gap < asked - ALLOWED_SHORTFALL):
        yield int(i[k]), float(gap[k])


def _worst_of_each_kind(design: Design, of_vias: bool, key: str) -> Iterator[Violation]:
    """Yield one violation for all places of one kind, at the worst place.

    Kinds are, for example, turn to turn, or lead to turn of another net.
    """
    kinds: dict[tuple[object, ...], list[Nearness]] = {}
    spacing = design.spec.fpc.rules.trace_spacing
    winding = min(spacing, design.spec.coil.trace_spacing)
    for near in cached_per_board(design, "near copper", lambda: tuple(
            too_near(copper_in(design), spacing - ALLOWED_SHORTFALL, winding - ALLOWED_SHORTFALL))):
        if (isinstance(near.one, Via) or isinstance(near.other, Via)) is of_vias:
            words = sorted((_kind(near.one), _kind(near.other)))
            kinds.setdefault((*words, near.one.net == near.other.net, near.one is near.other), []).append(near)
    for places in kinds.values():
        yield _spacing_complaint(design, places[0], len(places), key)


def _spacing_complaint(design: Design, near: Nearness, places: int, key: str) -> Violation:
    """Return the violation for two pieces that are too near, with the number of such places."""
    spec = design.spec
    asked = near.asked + ALLOWED_SHORTFALL
    how = "overlap" if near.gap <= 0.0 else f"are {show(near.gap, 'm')} apart"
    more = f" (and in {places - 1} more)" if places > 1 else ""
    who, source = gap_asked_by(spec.fpc.rules, asked)
    missing = f"{show(asked - near.gap, 'm')} are missing: "
    found = Violation(
        f"{pair_in_words(near)} {how} on layer {near.layer}{more}; {who} asks {show(asked, 'm')}",
        f"{missing}fewer turns, a narrower pitch or a larger coil give the room", key, near.gap, asked, "m",
        source=source, place=Place(near.x, near.y, near.layer, near.nets),
    )
    # a turn near another turn of its coil, or near the conductor that continues it
    kinds, of_turns = {_kind(near.one), _kind(near.other)}, {Role.WINDING, Role.STUB, Role.LEAD}
    if near.one.net != near.other.net or not Role.WINDING in kinds <= of_turns:
        return found
    if (radius := _common_radius(design.layout.spec.coil, design.layout.traces)) is not None:
        fix = setting(spec, "coil.corner_radius", radius, f"{radius * 1e3:.6g}")
        hint = f"{missing}corners at the inner end have no room for a larger radius than {fix.words}"
        return replace(found, key="coil.corner_radius", hint=hint, fixes=(lambda: [fix],))
    if asked - near.gap > nearer_by(spec.coil):
        return found
    spacing = GRAIN * math.ceil((spec.coil.trace_spacing + (asked - near.gap)) / GRAIN - 1e-6)
    # with fewer turns if the wider pitch needs their room
    return replace(found, key="coil.trace_spacing", hint=f"{missing}a larger coil.trace_spacing: {WHY}",
                   fixes=(lambda: wider(spec, 0.0, spacing),))


def _common_radius(coil: CoilSpec, traces: tuple[Trace, ...]) -> float | None:
    """Return the largest radius (m) with room at all corners of the coils, in hundredths of a millimetre.

    None if all corners have the specified radius, or if the layers begin at corners, because there the radii differ
    intentionally.
    """
    if not coil.is_mid_side:
        return None
    radii = [side.radius for trace in traces if trace.role is Role.WINDING
             for side in trace.path if isinstance(side, Arc)]
    least = min(radii, default=math.inf)
    return math.floor(least * 1e5) * 1e-5 if least < coil.corner_radius - ROUNDING else None


def _kind(item: Item) -> str:
    return item.role.value if isinstance(item, Trace) else type(item).__name__.lower()


def coverlay_web(design: Design) -> Iterator[Verdict]:
    """Yield findings on strips of coverlay between two openings, and between an opening and the board's edge."""
    layout, rules = design.layout, design.spec.fpc.rules
    for side, openings in (("top", layout.top_openings), ("bottom", layout.bottom_openings)):
        pieces = [edge_of(region.outline) for region in openings]
        for one, other in combinations(pieces, 2):
            yield from _narrow_web(rules, one, other, f"two openings of the {side} coverlay leave a web of",
                                   "between them", "join them to one opening, or move the contacts apart")
        for one in pieces:
            # an opening's sides and the board's edges, except sides on an edge: there the opening reaches the edge
            edge = edge_of(layout.outline)
            pairs = nearest_pairs(one.boxes, np.full(len(one), ROUNDING), edge.boxes, np.zeros(len(edge)))
            near, edges = one.take(pairs[:, 0]), edge.take(pairs[:, 1])
            on = (to_points(edges, near.start) < ROUNDING) & (to_points(edges, near.end) < ROUNDING)
            sides, edge = one.take(_others(len(one), pairs[on, 0])), edge.take(_others(len(edge), pairs[on, 1]))
            inside = _inside_of(sides, layout.outline, rules.coverlay_web)
            yield from _narrow_web(rules, inside, edge, f"an opening of the {side} coverlay leaves a web of",
                                   "to the board's edge",
                                   "a wider connector, or a fabricator whose coverlay keeps a narrower web")


def _others(count: int, taken: Index) -> Index:
    """Return the numbers below a count that are not taken.

    numpy's set functions would import its masked arrays first.
    """
    free = np.ones(count, dtype=bool)
    free[taken] = False
    return np.flatnonzero(free)


def crossings(start: Point, end: Point, corners: Sequence[Point]) -> Iterator[float]:
    """Yield the fractions of a line's length at which the edges of a closed polygon cross it."""
    # Line and edge, start + t d and a + u b, meet at parameters given by cross products:
    # t = (a x b) / (d x b) and u = (a x d) / (d x b), with `a` counted from the line's start.
    dx, dy = end - start
    for a, b in pairwise(corners):
        (ax, ay), (bx, by) = (a.x - start.x, a.y - start.y), (b.x - a.x, b.y - a.y)
        across = dx * by - dy * bx
        if across != 0.0 and 0.0 <= (ax * dy - ay * dx) / across < 1.0:
            along = (ax * by - ay * bx) / across
            if 0.0 < along < 1.0:
                yield along


def _narrow_web(
    rules: DesignRules, one: Primitives, other: Primitives, what: str, where: str, hint: str
) -> Iterator[Violation]:
    """Yield a violation if the strip of coverlay between two groups of edges is too narrow."""
    asked = rules.coverlay_web
    # the smallest distance, searched only up to the limit
    pairs = nearest_pairs(one.boxes, np.full(len(one), asked), other.boxes, np.zeros(len(other)))
    web = float(np.min(distances(one.take(pairs[:, 0]), other.take(pairs[:, 1])), initial=np.inf))
    if web < asked - ROUNDING:
        yield short_of(rules, "coverlay_web", web, f"{what} {show(web, 'm')} {where}", hint, "fpc.tail.connector",
                       Place(float(one.start[0, 0]), float(one.start[0, 1])))


def coverlay_opening(design: Design) -> Iterator[Verdict]:
    """Yield findings on a missing coverlay, and on openings too near to tracks and vias."""
    spec, layout, films = design.spec, design.layout, design.spec.fpc.stackup.layers
    for side, film, openings in (("top", films[0], layout.top_openings), ("bottom", films[-1], layout.bottom_openings)):
        if film.kind is LayerKind.COPPER:
            lies = ""
            if side == "top" and spec.target is not None and spec.elastomer is None:
                lies = f", and the target of {spec.target.material.name} lies on them, a short from turn to turn"
            yield Violation(
                f"the {side} of the board has no coverlay: all its tracks lie bare, are finished with "
                f"{spec.fpc.finish} as the contacts are, which no estimate counts{lies}",
                "begin and end fpc.stackup with a coverlay: 27.5 um are 12.5 um polyimide and 15 um adhesive",
                "fpc.stackup",
            )
        elif film.kind is not LayerKind.COVERLAY and openings:
            yield Violation(
                f"the contacts are bared in the {side} coverlay, and the stack-up has a {film.kind} there: no openings "
                "are made in it", "write that layer of fpc.stackup as a coverlay", "fpc.stackup",
            )
    for number, openings in ((1, layout.top_openings), (layout.copper_layers, layout.bottom_openings)):
        for region in openings:
            for item, gap, point in _bared(design, number, region.outline):
                yield short_of(
                    spec.fpc.rules, "coverlay_opening_to_trace", gap, f"{name_of(item)} on layer {number} comes within "
                    f"{show(max(0.0, gap), 'm')} of an opening of the coverlay",
                    "bare copper beside the contact: lengthen the tail or move the track", "fpc.tail",
                    Place(float(point[0]), float(point[1]), number, (item.net,)),
                )
    yield from _narrow_rims(design.layout.pads, design.spec.fpc)


def _narrow_rims(pads: tuple[Pad, ...], fpc: FpcSpec) -> Iterator[Violation]:
    """Yield a finding if solder pads are too small for the coverlay to cover their rims as far as the rules require."""
    rules, tail = fpc.rules, fpc.tail
    is_soldered = tail is None or tail.connector.kind == "pads"
    for pad in pads[:1] if is_soldered else ():  # all pads have the same size
        lap = rim_lap(rules, pad)
        if lap < rules.pad_lap - ROUNDING:
            what = f"the coverlay covers {show(lap, 'm')} of each solder pad's rim, so that half of the pad stays bare"
            hint = "use a plug-in connector, or ask the fabricator for a narrower lap"
            yield short_of(rules, "pad_lap", lap, what, hint, "fpc.tail.connector", Place(*pad.centre, 1, (pad.net,)))


def _bared(design: Design, number: int, opening: Path) -> Iterator[tuple[Trace | Via, float, Array]]:
    """Yield tracks and vias of a layer inside or too near an opening in which they do not end.

    Each has the item, the smallest gap (m) and its place.
    """
    copper, asked = copper_in(design), design.spec.fpc.rules.coverlay_opening_to_trace
    edge, corners = edge_of(opening), opening.flattened(1e-6)
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
        ends = (item.path.start, item.path.end) if isinstance(item, Trace) else ()
        if isinstance(item, Via) or (isinstance(item, Trace) and not any(_inside(corners, end) for end in ends)):
            yield item, gap, copper.pieces.start[index]


def _inside_of(sides: Primitives, outline: Path, web: float) -> Primitives:
    """Return the parts of an opening's straight sides inside the board's outline.

    The last `web` (m) before an edge that a side crosses is left out, because there the opening extends over the edge
    and leaves no strip. Arcs are returned unchanged.
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


def _inside(corners: Sequence[Point], point: Point) -> bool:
    """Whether a point lies inside a closed polygon (even-odd rule)."""
    inside = False
    for a, b in pairwise(corners):
        if (a.y > point.y) != (b.y > point.y) and point.x < a.x + (point.y - a.y) * (b.x - a.x) / (b.y - a.y):
            inside = not inside
    return inside


RULES: tuple[Rule, ...] = (
    # via pads to conductors that do not join them; then all other pairs, with turns of one coil
    rule_of("SIT107", lambda design: _worst_of_each_kind(design, True, "coil.turns")),
    rule_of("SIT108", lambda design: _worst_of_each_kind(design, False, "coil")),
    rule_of("SIT109", copper_to_edge),
    rule_of("SIT110", drill_to_copper),
    rule_of("SIT114", coverlay_web),
    rule_of("SIT115", coverlay_opening),
)
