"""SIT117, SIT124 and SIT126 to SIT129: the tail's end against what the connector takes, and the contacts' finish."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from sitscad.checks.board.clearances import crossings
from sitscad.checks.board.fabrication import ROUNDING, house, source_of, um
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, rule_of
from sitscad.data import is_unverified
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.layout.bending import Where, finished_thickness
from sitscad.layout.board import Layout, Pad
from sitscad.layout.tail_frame import contact_row
from sitscad.spec.circuit import Connector
from sitscad.spec.presets import finish, stock_stiffeners

LONGEST_BAR = 1.5e-3
"""From a contact's tip to the board's edge (m): as far as a plating bar is taken to be drawn without a look at it."""


def insertion_thickness(design: Design) -> Iterator[Verdict]:
    """What is there at the contacts, coverlay that is left and stiffener included, against what the connector takes."""
    connector = _connector(design)
    if connector.insertion_thickness <= 0.0:
        yield Undecided("the tail ends in solder pads: no connector takes it")
        return
    have = finished_thickness(design.layout, Where.CONTACT).nominal
    wrong = abs(have - connector.insertion_thickness)
    if wrong > connector.insertion_thickness_tolerance + ROUNDING:
        plate = design.layout.stiffener
        bare = have - (plate.thickness if plate is not None else 0.0)
        is_bare_too_thick = bare > connector.insertion_thickness + connector.insertion_thickness_tolerance + ROUNDING
        case = TOO_THICK_WITHOUT if is_bare_too_thick else WRONG_THICKNESS
        yield case.found("fpc.tail.connector", have, connector.insertion_thickness, "m", source=connector.source,
                         name=connector.name, insertion_thickness_tolerance=connector.insertion_thickness_tolerance,
                         plug_mark=plug_mark(connector), wrong=wrong,
                         direction="thinner" if have > connector.insertion_thickness else "thicker")


def contact_worst_case(design: Design) -> Iterator[Verdict]:
    """The finished thickness at the contacts with the fabricator's tolerance against what the connector takes, as far
    as another stiffener would come nearer: what comes with every connector stands in the order.
    """
    tail = design.spec.fpc.tail
    assert tail is not None
    connector = tail.connector
    if connector.insertion_thickness <= 0.0:
        yield Undecided("the tail ends in solder pads: no connector takes it")
        return
    band = finished_thickness(design.layout, Where.CONTACT)
    allowed = connector.insertion_thickness_tolerance
    low, high = connector.insertion_thickness - allowed, connector.insertion_thickness + allowed
    worst = max((low - band.minimum, band.minimum), (band.maximum - high, band.maximum))
    # a stiffener out of stock comes as near as half a step to the thickness that is wanted
    totals = sorted({film + adhesive for film, adhesive in stock_stiffeners()})
    half_a_step = max(b - a for a, b in pairwise(totals)) / 2
    if worst[0] > half_a_step + ROUNDING and low - ROUNDING <= band.nominal <= high + ROUNDING:
        yield LOOSE_THICKNESS.found(
            "fpc.tail.connector", worst[1], high if worst[1] == band.maximum else low, "m", source=band.source,
            place=Place(*design.layout.pads[0].centre, 1) if design.layout.pads else None, minimum=band.minimum,
            maximum=band.maximum, name=connector.name, low=low, high=high, plug_mark=plug_mark(connector),
            insertion_thickness=connector.insertion_thickness, allowed=allowed,
        )


CLOSER_CUT = 2.0
"""By so much a better way of cutting is closer than the usual one of the same house: a steel die +-0.05 mm, a router
+-0.1 mm (wellerpcba.com/flex-pcb-capability).
"""


def stiffener_stock(design: Design) -> Iterator[Verdict]:
    """A stiffener that is not made of a film and an adhesive that are in stock."""
    tail, plate = design.spec.fpc.tail, design.layout.stiffener
    if tail is None or plate is None or plate.adhesive > 0.0:
        return
    written = tail.stiffener is not None
    totals = sorted({film + adhesive for film, adhesive in stock_stiffeners()})
    near = sorted(totals, key=lambda total: (abs(total - plate.thickness), total))[:2]
    yield NOT_IN_STOCK.found("fpc.tail.stiffener" if written else "fpc.tail.connector", plate.thickness, near[0], "m",
                             source="sitscad/data/stiffeners.csv", is_grave=not written, least=totals[0],
                             most=totals[-1], nearest=" and ".join(map(um, near)))


def plug_width(design: Design) -> Iterator[Verdict]:
    """The tolerance of the outline against that which the connector asks of the tail's width, where even a closer cut
    does not keep it: the order asks for the closer one anyway.
    """
    connector, rules = _connector(design), design.spec.fpc.rules
    if connector.width_tolerance <= 0.0:
        yield Undecided("the tail ends in solder pads: nothing guides its sides")
        return
    if rules.outline_tolerance > CLOSER_CUT * connector.width_tolerance + ROUNDING:
        width = connector.width(contact_row(design.spec, connector).count)
        mark = plug_mark(connector, "width_tolerance")
        yield LOOSE_WIDTH.found("fpc.tail.connector", rules.outline_tolerance, connector.width_tolerance, "m",
                                source=source_of(design, "outline_tolerance"),
                                place=Place(*design.layout.pads[0].centre, 1) if design.layout.pads else None,
                                width=width, house=house(design, "outline_tolerance"), name=connector.name, mark=mark)


def connector_positions(design: Design) -> Iterator[Verdict]:
    """The number of contacts against those that the connector is made with, and whether some lead nowhere."""
    connector, tail = _connector(design), design.spec.fpc.tail
    row = contact_row(design.spec, connector)
    if not connector.positions:
        return
    mark = plug_mark(connector, "positions")
    if row.count not in connector.positions:
        written = tail is not None and tail.contacts is not None
        yield (NOT_LISTED if written else NOT_MADE).found(
            "fpc.tail.contacts" if written else "fpc.tail.connector", float(row.count), float(connector.positions[-1]),
            None, source=connector.source, name=connector.name, count=row.count, fewest=connector.positions[0],
            most=connector.positions[-1], mark=mark,
        )
    elif row.count > row.used:
        spare = row.count - row.used
        yield SPARE_CONTACTS.found("fpc.tail.connector", float(row.used), float(row.count), None,
                                   source=connector.source, used=row.used, name=connector.name, count=row.count,
                                   mark=mark, spare=spare, first=row.first, last=row.first + row.used - 1)


def plug_mark(connector: Connector, *fields: str) -> str:
    """A warning in brackets where what a connector takes was not read in its drawing."""
    fields = fields or ("insertion_thickness", "insertion_thickness_tolerance")
    return " (unverified: compare with its drawing)" if is_unverified(connector.source, *fields) else ""


def _connector(design: Design) -> Connector:
    assert design.spec.fpc.tail is not None
    return design.spec.fpc.tail.connector


def contact_finish(design: Design) -> Iterator[Verdict]:
    """The finish against what is done with the contacts, and against what it takes to plate it."""
    layout, fpc = design.layout, design.spec.fpc
    chosen = finish(fpc.finish)
    is_plugged = fpc.tail is not None and fpc.tail.connector.kind != "pads"
    if not (chosen.is_for_plugs if is_plugged else chosen.is_for_solder):
        case = WEARS_OFF if is_plugged else MAKES_BRITTLE
        yield case.found("fpc.finish", source=chosen.source, finish=fpc.finish)
    if chosen.is_electrolytic and layout.pads:
        apart = max(_to_the_edge(layout, pad) for pad in layout.pads)
        is_reached = apart <= LONGEST_BAR + ROUNDING
        yield (NEEDS_BARS if is_reached else NEEDS_LONG_BARS).found(
            "fpc.finish", source=chosen.source, place=Place(*layout.pads[0].centre, 1), finish=chosen.words,
            contacts=len(layout.pads), apart=apart, longest=LONGEST_BAR,
        )


def _to_the_edge(layout: Layout, pad: Pad) -> float:
    """From a contact's end straight on to the outline (m), in the nearer direction along the contact."""
    half, way = max(pad.size) / 2, 1.0
    dx, dy = (1.0, 0.0) if pad.size[0] >= pad.size[1] else (0.0, 1.0)
    corners, found = layout.outline.flattened(1e-6), [math.inf]
    for sign in (-1.0, 1.0):
        end = pad.centre.shifted(sign * half * dx, sign * half * dy)
        found += [way * share for share in crossings(end, end.shifted(sign * way * dx, sign * way * dy), corners)]
    return min(found)


WRONG_THICKNESS = Case(
    "the tail's end, with its stiffener, is {measured:m} thick; {name} takes {limit:m} +- "
    "{insertion_thickness_tolerance:m}{plug_mark}",
    hint="choose a stiffener {wrong:m} {direction} (fpc.tail.stiffener), or another connector",
)

TOO_THICK_WITHOUT = Case(
    WRONG_THICKNESS.message,
    hint="it is too thick without any stiffener: fewer copper layers down the tail (fpc.tail.layers), a thinner "
    "stack-up, or another connector",
)

LOOSE_THICKNESS = Case(
    "the contacts come out {minimum:m} to {maximum:m} thick with the fabricator's tolerance; {name} takes {low:m} to "
    "{high:m}{plug_mark}",
    hint="write the connector's band on the order ({insertion_thickness:m} +- {allowed:m}) and have it confirmed, or "
    "measure the parts before they are plugged in",
)

NOT_IN_STOCK = Case(
    "the stiffener is {measured:m} thick with its adhesive; none of the films and adhesives that are commonly in stock "
    "makes it ({least:m} to {most:m}, near it {nearest})",
    hint="ask the fabricator which thickness is in stock, and write it as fpc.tail.stiffener", severity=Severity.NOTE,
    grave=Severity.WARNING,
)

LOOSE_WIDTH = Case(
    "the tail's end is {width:m} wide, +- {measured:m} by {house}; {name} guides it by its sides and takes +- "
    "{limit:m}{mark}",
    hint="order and drawing ask for +- {limit:m} there: have it confirmed (cut by laser, or by a punch of its own), or "
    "measure the parts before they are plugged in",
)

_NOT_MADE = "{name} is not known to be made with {count} contacts (its list has {fewest} to {most}){mark}"

NOT_MADE = Case(_NOT_MADE, "another connector, or fewer coils")

NOT_LISTED = Case(_NOT_MADE, "compare with the drawing of what you buy", Severity.NOTE)

WEARS_OFF = Case(
    "{finish} is not for contacts that are plugged in: it wears off", "finish: enig serves both", Severity.WARNING
)

MAKES_BRITTLE = Case(
    "{finish} is not for contacts that are soldered to: so much gold makes the joints brittle",
    "finish: enig serves both", Severity.WARNING,
)

_BARS = (
    "{finish} is plated by a current, for which all {contacts} contacts have to be joined to the panel: plating bars "
    "are not drawn; the contacts end {apart:m} before the board's edge"
)

NEEDS_BARS = Case(
    _BARS,
    "order and drawing ask the fabricator to add bars there and to cut them off with the outline: have it confirmed; "
    "finish: enig needs none and serves a socket that is mated seldom", Severity.WARNING,
)

NEEDS_LONG_BARS = Case(
    _BARS, "bars of more than {longest:m} leave copper at the cut: finish: enig needs none", Severity.ERROR
)

SPARE_CONTACTS = Case(
    "the coils need {used} contacts and {name} has {count}{mark}: {spare} lead nowhere, the coils"
    " have {first} to {last}",
    hint=("wire the converter's board to those; a connector with another number is written as fpc.tail.contacts"),
    severity=Severity.NOTE,
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT117", insertion_thickness, "tail"),
    rule_of("SIT124", contact_worst_case, "tail"),
    rule_of("SIT126", plug_width, "tail"),
    rule_of("SIT127", connector_positions, "tail"),
    rule_of("SIT129", stiffener_stock, "tail"),
    rule_of("SIT128", contact_finish),
)
