"""SIT107 to SIT110: copper and holes as drawn, and how near they come to each other and to the edge."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sitscad.checks.board.copper import (
    Copper,
    Item,
    Nearness,
    Outline,
    copper_of,
    drill_nearness,
    too_near,
)
from sitscad.checks.board.fabrication import FABRICATOR, gap_asked_by, house, source_of, um
from sitscad.checks.board.steep_spiral import nearer_by, spacing_in_words, tried_spacing
from sitscad.checks.cases import Case
from sitscad.checks.rules import Complaint, Rule, Verdict
from sitscad.data import is_unverified
from sitscad.design import Design
from sitscad.finding import Edit, Place, Severity
from sitscad.geometry.primitives import Floats, Primitives, distances, from_rows, nearest_pairs, path_rows
from sitscad.layout.board import Pad, Role, Teardrop, Trace, Via
from sitscad.remedy.fix import Fix
from sitscad.remedy.search import Left
from sitscad.spec.presets import connector, names
from sitscad.units import show

ALLOWED_SHORTFALL = 1e-6
"""What a drawn gap may fall short of the rule (m): a spiral's gap square to the track is a little below its spacing."""


def via_clearance(design: Design) -> Iterator[Verdict]:
    """Every via pad to every conductor that does not join it there, turns of its own coil included."""
    found = [near for near in _near_copper(design) if isinstance(near.one, Via) or isinstance(near.other, Via)]
    return _worst_of_each_kind(design, found, "coil.turns")


def copper_spacing(design: Design) -> Iterator[Verdict]:
    """Every other pair of tracks and contacts, turn to turn of one coil included."""
    found = [near for near in _near_copper(design) if not isinstance(near.one, Via) and not isinstance(near.other, Via)]
    return _worst_of_each_kind(design, found, "coil")


def copper_to_edge(design: Design) -> Iterator[Verdict]:
    """Every piece of copper to the board's outline; a connector's contacts may run to the end that is plugged in."""
    for (what, layer), (gap, index, item) in _near_edge(design).items():
        point = copper_in(design).pieces.start[index]
        yield _edge_complaint(design, f"{what} on layer {layer}", gap, point, layer, item)


def _near_edge(design: Design) -> dict[tuple[str, int], tuple[float, int, Item]]:
    """What comes too near the edge, by name and layer: the worst gap (m), which piece, and what that belongs to."""
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


def _is_at_plug(design: Design, item: Item) -> bool:
    """Whether a track leads to a contact: how near the edge that stands is the connector's."""
    tail = design.spec.fpc.tail
    return tail is not None and isinstance(item, Trace) and item.role is Role.TAIL


def _other_connector(design: Design, left: Left) -> str:
    """A connector whose contacts stand far enough from the edge, found by laying the board out with it."""
    spec, tail = design.spec, design.spec.fpc.tail
    assert tail is not None
    unseen = " (unverified)" if is_unverified(tail.connector.source, "edge_margin") else ""
    have = f"{um(tail.connector.edge_margin)}{unseen}"
    margin = f"beside its contacts {tail.connector.name} has {have} of board from their middle"
    for name in sorted(names("connector"), key=lambda name: connector(name).edge_margin):
        other = connector(name)
        if other.edge_margin > tail.connector.edge_margin:
            changed = replace(spec, fpc=replace(spec.fpc, tail=replace(tail, connector=other)))
            fix, layout = Fix((Edit("fpc.tail.connector", name),), changed), left.drawn(changed)
            if layout is None:
                break
            if not layout.shortfalls and not _near_edge(Design(changed, layout)) and left(fix) == ():
                return f"{margin}; fpc.tail.connector: {name} has enough (it was tried)"
    if left.is_cut_short:
        return f"{margin}: a connector with more, or a fabricator who cuts nearer to copper"
    return f"{margin}, and no installed connector has enough: take a fabricator who cuts nearer to copper"


def drill_to_copper(design: Design) -> Iterator[Verdict]:
    """Every hole's wall to copper that does not belong to it, on every layer."""
    rules = design.spec.fpc.rules
    for near in drill_nearness(copper_in(design), rules.drill_to_copper - ALLOWED_SHORTFALL):
        yield HOLE_NEAR_COPPER.found(
            "coil.turns", near.gap, rules.drill_to_copper, "m", source=source_of(design, "drill_to_copper"),
            place=Place(near.x, near.y, near.layer, near.nets), net=_net(near), gap=max(0.0, near.gap),
            foreign=_foreign(near), layer=near.layer, house=house(design, "drill_to_copper"),
            missing=rules.drill_to_copper - near.gap,
        )


def edge_of(outline: Outline) -> Primitives:
    """A closed outline as pieces to measure distances from."""
    return from_rows([row for row, _ in path_rows(outline)])


# ----------------------------------------------------------------------------------------------------------- distances


def copper_in(design: Design) -> Copper:
    """The copper of the design, made once for all rules."""
    return design.once("copper", lambda: copper_of(design.layout))


def _near_copper(design: Design) -> tuple[Nearness, ...]:
    """Every pair of items that is too near, worst first."""
    rules, coil = design.spec.fpc.rules, design.spec.coil
    spacing = rules.trace_spacing - ALLOWED_SHORTFALL
    winding = min(rules.trace_spacing, coil.trace_spacing) - ALLOWED_SHORTFALL
    return design.once("near copper", lambda: tuple(too_near(copper_in(design), spacing, winding)))


def edge_gaps(copper: Copper, edge: Primitives, asked: float) -> Iterator[tuple[int, float]]:
    """Pieces of copper nearer to an edge than is asked (m): their indices and gaps (m)."""
    reach = copper.half + asked
    pairs = nearest_pairs(copper.pieces.boxes, reach, edge.boxes, np.zeros(len(edge)))
    i, j = pairs[:, 0], pairs[:, 1]
    gap = distances(copper.pieces.take(i), edge.take(j)) - copper.half[i]
    for k in np.flatnonzero(gap < asked - ALLOWED_SHORTFALL):
        yield int(i[k]), float(gap[k])


# -------------------------------------------------------------------------------------------------------------- words


def _edge_complaint(design: Design, what: str, gap: float, point: Floats, layer: int, item: Item) -> Complaint:
    """The complaint for copper of an item that lies a gap (m) from the board's edge."""
    rules, missing = design.spec.fpc.rules, um(design.spec.fpc.rules.copper_to_edge - gap)
    at_plug = _is_at_plug(design, item)
    wider = "a wider board, or a smaller coil, gives it room"
    return NEAR_EDGE.found(
        "fpc.tail.connector" if at_plug else "coil.outer_diameter", gap, rules.copper_to_edge, "m",
        source=source_of(design, "copper_to_edge"), place=Place(float(point[0]), float(point[1]), layer, (item.net,)),
        advice=(lambda left: f"{missing} are missing: {_connector_with_edge(design, left)}") if at_plug else None,
        what=what, gap=max(0.0, gap), house=house(design, "copper_to_edge"), missing=missing,
        remedy="a connector with more board beside its contacts" if at_plug else wider,
    )


def _connector_with_edge(design: Design, left: Left) -> str:
    return design.once("connector with more edge", lambda: _other_connector(design, left))


def _worst_of_each_kind(design: Design, found: Sequence[Nearness], key: str) -> Iterator[Complaint]:
    """One complaint for all places of one kind (turn to turn, lead to turn of another net ...), the worst of them."""
    kinds: dict[tuple[object, ...], list[Nearness]] = {}
    for near in found:
        words = sorted((_kind(near.one), _kind(near.other)))
        kinds.setdefault((*words, near.one.net == near.other.net, near.one is near.other), []).append(near)
    for places in kinds.values():
        yield _spacing_complaint(design, places[0], len(places), key)


def _spacing_complaint(design: Design, near: Nearness, places: int, key: str) -> Complaint:
    """The complaint for two pieces that are too near, and how many such places there are."""
    asked = near.asked + ALLOWED_SHORTFALL
    how = "overlap" if near.gap <= 0.0 else f"are {show(near.gap, 'm')} apart"
    names = name_of(near.one), name_of(near.other)
    what = f"two parts of {names[0]}" if near.one is near.other else f"{names[0]} and {names[1]}"
    more = f" (and in {places - 1} more)" if places > 1 else ""
    who, source = gap_asked_by(design, asked)
    missing, spec = asked - near.gap, design.spec
    is_steep = _is_of_the_turns(near) and missing <= nearer_by(spec)
    room = "fewer turns, a narrower pitch or a larger coil give the room"
    return TOO_NEAR.found(
        "coil.trace_spacing" if is_steep else key, near.gap, asked, "m", source=source,
        place=Place(near.x, near.y, near.layer, near.nets),
        advice=(lambda left: f"{um(missing)} are missing: {tried_spacing(spec, missing, left)}") if is_steep else None,
        what=what, how=how, layer=near.layer, more=more, who=who, missing=missing,
        remedy=spacing_in_words(spec, missing) if is_steep else room,
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
        return f"contact {item.name}"
    if isinstance(item, Teardrop):
        return f"a teardrop of {item.net}"
    return f"the {item.role.value} of {item.net}"


def _foreign(near: Nearness) -> str:
    return name_of(near.other if isinstance(near.one, Via) else near.one)


def _net(near: Nearness) -> str:
    via = near.one if isinstance(near.one, Via) else near.other
    return via.net


def drawn_rule(
    number: int, name: str, texts: Iterable[str], source: str, apply: Callable[[Design], Iterable[Verdict]]
) -> Rule:
    """A rule about what is drawn, always an error: its number, name, the texts (summary, why, how to mend), source."""
    summary, why, mend = texts
    return Rule(f"SIT{number}", name, Severity.ERROR, summary, why, mend, source, (), apply)


HOLE_NEAR_COPPER = Case(
    "a hole of {net} comes within {gap:m} of {foreign} on layer {layer}; {house} asks {limit:m} from hole to copper",
    hint="{missing:m} are missing",
)

NEAR_EDGE = Case(
    "{what} comes within {gap:m} of the board's edge; {house} asks {limit:m}", hint="{missing} are missing: {remedy}",
)

TOO_NEAR = Case("{what} {how} on layer {layer}{more}; {who} asks {limit:m}", hint="{missing:m} are missing: {remedy}")


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
)
