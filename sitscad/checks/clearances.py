"""SIT107 to SIT110, SIT114 and SIT115: copper, holes and openings as drawn, and how near they come to each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from sitscad.checks.copper import (
    Copper,
    Item,
    Nearness,
    Outline,
    Position,
    copper_of,
    drill_nearness,
    too_near,
)
from sitscad.checks.fabrication import FABRICATOR, ROUNDING, gap_asked_by, house, source_of, um
from sitscad.checks.rules import Complaint, Left, Rule, Subject, Verdict
from sitscad.checks.steep_spiral import nearer_by, spacing_in_words, tried_spacing
from sitscad.finding import Place, Severity
from sitscad.geometry.primitives import Floats, Primitives, distances, from_rows, nearest_pairs, path_rows, to_points
from sitscad.layout.board import Pad, Role, Trace, Via
from sitscad.layout.teardrops import Teardrop
from sitscad.spec.presets import connector, names
from sitscad.units import show

ALLOWED_SHORTFALL = 1e-6
"""What a drawn gap may fall short of the rule (m): a spiral's gap square to the track is a little below its spacing."""


def via_clearance(subject: Subject) -> Iterator[Verdict]:
    """Every via pad to every conductor that does not join it there, turns of its own coil included."""
    found = [near for near in _near_copper(subject) if isinstance(near.one, Via) or isinstance(near.other, Via)]
    return _worst_of_each_kind(subject, found, "coil.turns")


def copper_spacing(subject: Subject) -> Iterator[Verdict]:
    """Every other pair of tracks and contacts, turn to turn of one coil included."""
    found = [
        near for near in _near_copper(subject) if not isinstance(near.one, Via) and not isinstance(near.other, Via)
    ]
    return _worst_of_each_kind(subject, found, "coil")


def copper_to_edge(subject: Subject) -> Iterator[Verdict]:
    """Every piece of copper to the board's outline; a connector's contacts may run to the end that is plugged in."""
    for (what, layer), (gap, index, item) in _near_edge(subject).items():
        point = copper_in(subject).pieces.start[index]
        yield _edge_complaint(subject, f"{what} on layer {layer}", gap, point, layer, item)


def _near_edge(subject: Subject) -> dict[tuple[str, int], tuple[float, int, Item]]:
    """What comes too near the edge, by name and layer: the worst gap (m), which piece, and what that belongs to."""
    layout, copper = subject.layout, copper_in(subject)
    worst: dict[tuple[str, int], tuple[float, int, Item]] = {}
    for index, gap in _edge_gaps(copper, _edge_of(layout.outline), subject.spec.fpc.rules.copper_to_edge):
        item, layer = copper.items[copper.item[index]], int(copper.layer[index])
        if isinstance(item, Pad) and layout.spec.fpc.tail is not None:
            continue
        what = name_of(item), layer
        if what not in worst or gap < worst[what][0]:
            worst[what] = gap, index, item
    return worst


def _is_at_plug(subject: Subject, item: Item) -> bool:
    """Whether a track leads to a contact: how near the edge that stands is the connector's."""
    tail = subject.spec.fpc.tail
    return tail is not None and isinstance(item, Trace) and item.role is Role.TAIL


def _other_connector(subject: Subject, left: Left) -> str:
    """A connector whose contacts stand far enough from the edge, found by laying the board out with it."""
    spec, tail = subject.spec, subject.spec.fpc.tail
    assert tail is not None
    unseen = " (unverified)" if "edge_margin: unverified" in tail.connector.source else ""
    have = f"{um(tail.connector.edge_margin)}{unseen}"
    margin = f"beside its contacts {tail.connector.name} has {have} of board from their middle"
    for name in sorted(names("connector"), key=lambda name: connector(name).edge_margin):
        other = connector(name)
        if other.edge_margin > tail.connector.edge_margin:
            changed = replace(spec, fpc=replace(spec.fpc, tail=replace(tail, connector=other)))
            drawn = subject.drawn(changed)
            if not drawn.layout.findings and not _near_edge(drawn) and not left(changed):
                return f"{margin}; fpc.tail.connector: {name} has enough (it was tried)"
    return f"{margin}, and no installed connector has enough: take a fabricator who cuts nearer to copper"


def drill_to_copper(subject: Subject) -> Iterator[Verdict]:
    """Every hole's wall to copper that does not belong to it, on every layer."""
    rules = subject.spec.fpc.rules
    for near in drill_nearness(copper_in(subject), rules.drill_to_copper - ALLOWED_SHORTFALL):
        yield Complaint(
            f"a hole of {_net(near)} comes within {um(max(0.0, near.gap))} of {_foreign(near)} on layer {near.layer}; "
            f"{house(subject, 'drill_to_copper')} asks {um(rules.drill_to_copper)} from hole to copper",
            f"{um(rules.drill_to_copper - near.gap)} are missing",
            "coil.turns",
            near.gap,
            rules.drill_to_copper,
            "m",
            source=source_of(subject, "drill_to_copper"),
            place=Place(near.x, near.y, near.layer, near.nets),
        )


def coverlay_web(subject: Subject) -> Iterator[Verdict]:
    """The strip of coverlay left between two openings, and beside one along the board's edge."""
    layout = subject.layout
    for side, openings in (("top", layout.top_openings), ("bottom", layout.bottom_openings)):
        pieces = [_edge_of(region.outline) for region in openings]
        for one, other in combinations(pieces, 2):
            hint = "join them to one opening, or move the contacts apart"
            yield from _narrow_web(subject, f"two openings of the {side} coverlay leave", hint, one, other)
        for one in pieces:
            hint = "a wider connector, or a fabricator whose coverlay keeps a narrower web"
            what = f"an opening of the {side} coverlay leaves"
            sides, edge = _apart(one, _edge_of(layout.outline))
            yield from _narrow_web(subject, what, hint, sides, edge, "to the board's edge")


def _edge_of(outline: Outline) -> Primitives:
    return from_rows([row for row, _ in path_rows(outline)])


def _apart(opening: Primitives, edge: Primitives) -> tuple[Primitives, Primitives]:
    """An opening's sides and the board's edges but those that lie on each other: there the opening reaches the edge."""
    near = np.full(len(opening), ROUNDING)
    pairs = nearest_pairs(opening.boxes, near, edge.boxes, np.zeros(len(edge)))
    sides, edges = opening.take(pairs[:, 0]), edge.take(pairs[:, 1])
    on = (to_points(edges, sides.start) < ROUNDING) & (to_points(edges, sides.end) < ROUNDING)
    free = np.setdiff1d(np.arange(len(opening)), pairs[on, 0]), np.setdiff1d(np.arange(len(edge)), pairs[on, 1])
    return opening.take(free[0]), edge.take(free[1])


def _narrow_web(
    subject: Subject, what: str, hint: str, one: Primitives, other: Primitives, where: str = "between them"
) -> Iterator[Complaint]:
    rules = subject.spec.fpc.rules
    web = _smallest(one, other, rules.coverlay_web)
    if web < rules.coverlay_web - ROUNDING:
        yield Complaint(
            f"{what} a web of {um(web)} {where}; {house(subject, 'coverlay_web')} asks {um(rules.coverlay_web)}",
            hint,
            "fpc.tail.connector",
            web,
            rules.coverlay_web,
            "m",
            source=source_of(subject, "coverlay_web"),
            place=Place(float(one.start[0, 0]), float(one.start[0, 1])),
        )


def coverlay_opening(subject: Subject) -> Iterator[Verdict]:
    """Copper that must stay covered, to the edge of every opening of the coverlay over it."""
    layout = subject.layout
    for number, openings in ((1, layout.top_openings), (layout.copper_layers, layout.bottom_openings)):
        for region in openings:
            for item, gap, point in _bared(subject, number, region.outline):
                yield _opening_complaint(
                    subject, item, gap, Place(float(point[0]), float(point[1]), number, (item.net,))
                )


# ----------------------------------------------------------------------------------------------------------- distances


def copper_in(subject: Subject) -> Copper:
    """The copper of the design, made once for all rules."""
    return subject.once("copper", lambda: copper_of(subject.layout))


def _near_copper(subject: Subject) -> tuple[Nearness, ...]:
    """Every pair of items that is too near, worst first."""
    rules, coil = subject.spec.fpc.rules, subject.spec.coil
    spacing = rules.trace_spacing - ALLOWED_SHORTFALL
    winding = min(rules.trace_spacing, coil.trace_spacing) - ALLOWED_SHORTFALL
    return subject.once("near copper", lambda: tuple(too_near(copper_in(subject), spacing, winding)))


def _edge_gaps(copper: Copper, edge: Primitives, asked: float) -> Iterator[tuple[int, float]]:
    reach = copper.half + asked
    pairs = nearest_pairs(copper.pieces.boxes, reach, edge.boxes, np.zeros(len(edge)))
    i, j = pairs[:, 0], pairs[:, 1]
    gap = distances(copper.pieces.take(i), edge.take(j)) - copper.half[i]
    for k in np.flatnonzero(gap < asked - ALLOWED_SHORTFALL):
        yield int(i[k]), float(gap[k])


def _smallest(one: Primitives, other: Primitives, within: float) -> float:
    """Smallest distance (m) between two sets of pieces, looking no further than `within`; infinite beyond."""
    pairs = nearest_pairs(one.boxes, np.full(len(one), within), other.boxes, np.zeros(len(other)))
    if not len(pairs):
        return float("inf")
    return float(np.min(distances(one.take(pairs[:, 0]), other.take(pairs[:, 1]))))


def _bared(subject: Subject, number: int, opening: Outline) -> Iterator[tuple[Trace | Via, float, Floats]]:
    """Tracks and vias of a layer in or too near an opening in which they do not end: item, worst gap (m), where."""
    copper, asked = copper_in(subject), subject.spec.fpc.rules.coverlay_opening_to_trace
    edge, corners = from_rows([row for row, _ in path_rows(opening)]), opening.flattened(1e-6)
    worst: dict[int, tuple[float, int]] = {}
    for index, gap in _edge_gaps(copper, edge, asked):
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


# -------------------------------------------------------------------------------------------------------------- words


def _edge_complaint(subject: Subject, what: str, gap: float, point: Floats, layer: int, item: Item) -> Complaint:
    rules, missing = subject.spec.fpc.rules, um(subject.spec.fpc.rules.copper_to_edge - gap)
    at_plug = _is_at_plug(subject, item)
    wider = "a wider board, or a smaller coil, gives it room"
    return Complaint(
        f"{what} comes within {um(max(0.0, gap))} of the board's edge; {house(subject, 'copper_to_edge')} asks "
        f"{um(rules.copper_to_edge)}",
        f"{missing} are missing: {'a connector with more board beside its contacts' if at_plug else wider}",
        "fpc.tail.connector" if at_plug else "coil.outer_diameter",
        gap,
        rules.copper_to_edge,
        "m",
        source=source_of(subject, "copper_to_edge"),
        place=Place(float(point[0]), float(point[1]), layer, (item.net,)),
        advice=(lambda left: f"{missing} are missing: {_connector_with_edge(subject, left)}") if at_plug else None,
    )


def _connector_with_edge(subject: Subject, left: Left) -> str:
    return subject.once("connector with more edge", lambda: _other_connector(subject, left))


def _opening_complaint(subject: Subject, item: Trace | Via, gap: float, place: Place) -> Complaint:
    rules = subject.spec.fpc.rules
    return Complaint(
        f"{name_of(item)} on layer {place.layer} comes within {um(max(0.0, gap))} of an opening of the coverlay; "
        f"{house(subject, 'coverlay_opening_to_trace')} asks {um(rules.coverlay_opening_to_trace)}",
        "bare copper beside the contact: lengthen the tail or move the track",
        "fpc.tail",
        gap,
        rules.coverlay_opening_to_trace,
        "m",
        source=source_of(subject, "coverlay_opening_to_trace"),
        place=place,
    )


def _worst_of_each_kind(subject: Subject, found: Sequence[Nearness], key: str) -> Iterator[Complaint]:
    """One complaint for all places of one kind (turn to turn, lead to turn of another net ...), the worst of them."""
    kinds: dict[tuple[object, ...], list[Nearness]] = {}
    for near in found:
        words = sorted((_kind(near.one), _kind(near.other)))
        kinds.setdefault((*words, near.one.net == near.other.net, near.one is near.other), []).append(near)
    for places in kinds.values():
        yield _spacing_complaint(subject, places[0], len(places), key)


def _spacing_complaint(subject: Subject, near: Nearness, places: int, key: str) -> Complaint:
    asked = near.asked + ALLOWED_SHORTFALL
    how = "overlap" if near.gap <= 0.0 else f"are {show(near.gap, 'm')} apart"
    names = name_of(near.one), name_of(near.other)
    what = f"two parts of {names[0]}" if near.one is near.other else f"{names[0]} and {names[1]}"
    more = f" (and in {places - 1} more)" if places > 1 else ""
    who, source = gap_asked_by(subject, asked)
    missing, spec = asked - near.gap, subject.spec
    is_steep = _is_of_the_turns(near) and missing <= nearer_by(spec)
    room = "fewer turns, a narrower pitch or a larger coil give the room"
    return Complaint(
        f"{what} {how} on layer {near.layer}{more}; {who} asks {um(asked)}",
        f"{um(missing)} are missing: {spacing_in_words(spec, missing) if is_steep else room}",
        "coil.trace_spacing" if is_steep else key,
        near.gap,
        asked,
        "m",
        source=source,
        place=Place(near.x, near.y, near.layer, near.nets),
        advice=(lambda left: f"{um(missing)} are missing: {tried_spacing(spec, missing, left)}") if is_steep else None,
    )


def _is_of_the_turns(near: Nearness) -> bool:
    """Whether a turn comes near another one of its coil, or what goes on where that ends."""
    kinds = {_kind(near.one), _kind(near.other)}
    return near.one.net == near.other.net and Role.WINDING in kinds <= {Role.WINDING, Role.STUB, Role.LEAD}


def _kind(item: Item) -> str:
    return item.role.value if isinstance(item, Trace) else type(item).__name__.lower()


def name_of(item: Item) -> str:
    """A piece of copper in words."""
    if isinstance(item, Via):
        return f"a via of {item.net}"
    if isinstance(item, Pad):
        return f"contact {item.pin}"
    if isinstance(item, Teardrop):
        return f"a teardrop of {item.net}"
    return f"the {item.role.value} of {item.net}"


def _foreign(near: Nearness) -> str:
    return name_of(near.other if isinstance(near.one, Via) else near.one)


def _net(near: Nearness) -> str:
    via = near.one if isinstance(near.one, Via) else near.other
    return via.net


def drawn_rule(
    number: int, name: str, texts: Iterable[str], source: str, apply: Callable[[Subject], Iterable[Verdict]]
) -> Rule:
    """A rule about what is drawn, always an error: its number, name, the texts (summary, why, how to mend), source."""
    summary, why, mend = texts
    return Rule(f"SIT{number}", name, Severity.ERROR, summary, why, mend, source, (), apply)


CLEARANCE_RULES: tuple[Rule, ...] = (
    drawn_rule(107, "via-clearance", (
        "Every via pad keeps the fabricator's spacing from copper that does not join it there.",
        "A through via has its pad on every layer: one that stands on a turn shorts it to the other layers, inside one "
        "net, where neither netlist nor electrical test can see it.",
        "Make room inside the innermost turn: fewer turns, a narrower pitch, a larger coil, or a finer fabricator.",
    ), FABRICATOR, via_clearance),
    drawn_rule(108, "copper-spacing", (
        "All tracks and contacts as drawn keep the fabricator's spacing, turn to turn of one coil included.",
        "KiCad's own checker does not look at gaps within one net, and a coil is one net.",
        "Widen the spacing, wind fewer turns, or give the leads more room (a larger pitch of the coils).",
    ), FABRICATOR, copper_spacing),
    drawn_rule(109, "copper-to-edge", (
        "Copper stays the fabricator's distance inside the board's outline.",
        "Copper nearer to the cut is laid bare by it, and in the jaw no bare copper may touch tissue.",
        "Widen the board or make the coil smaller.",
    ), FABRICATOR, copper_to_edge),
    drawn_rule(110, "drill-to-copper", (
        "Holes keep the fabricator's distance from copper that is not theirs, on every layer.",
        "The drill wanders and the layers are not in register: a hole that grazes a track is plated to it.",
        "Give the via more room.",
    ), FABRICATOR, drill_to_copper),
    drawn_rule(114, "coverlay-web", (
        "Between two openings, and between one and the board's edge, the coverlay keeps the fabricator's web.",
        "A narrower strip of coverlay tears, or comes off.",
        "Join the openings, move the contacts apart, or give them more board beside them.",
    ), FABRICATOR, coverlay_web),
    drawn_rule(115, "coverlay-opening", (
        "Copper that must stay covered keeps its distance from every opening of the coverlay.",
        "The coverlay is laid by hand within some tenths of a millimetre: a track near an opening ends up bare.",
        "Move the track, or lengthen the tail.",
    ), FABRICATOR, coverlay_opening),
)  # fmt: skip
