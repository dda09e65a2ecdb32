"""SIT117, SIT124 and SIT126 to SIT129: the tail's end against what the connector takes, and the contacts' finish."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

from sitscad.checks.board.clearances import crossings
from sitscad.checks.board.fabrication import house, source_of
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, rule_of
from sitscad.data import is_unverified
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.fixes.moves import each_read, thinner_tails
from sitscad.fixes.search import Family
from sitscad.geometry.path import Path
from sitscad.layout.bending import Where, finished_thickness
from sitscad.layout.board import Pad
from sitscad.layout.tail_frame import contact_row
from sitscad.spec import presets
from sitscad.spec.circuit import Connector, FpcSpec
from sitscad.spec.presets import finish, stock_stiffeners
from sitscad.units import show

LONGEST_BAR = 1.5e-3
"""The distance (m) from a contact's tip to the board's edge up to which a plating bar is taken to be drawn unasked."""

CLOSER_CUT = 2.0
"""The usual tolerance of cutting over the closer one of the same house: a router cuts within +-0.1 mm, a steel die
within +-0.05 mm (wellerpcba.com/flex-pcb-capability).
"""

PADS = Undecided("the tail ends in solder pads: no connector takes it")


def insertion_thickness(design: Design) -> Iterator[Verdict]:
    """What is there at the contacts, coverlay that is left and stiffener included, against what the connector takes."""
    connector = _connector(design.spec.fpc)
    wanted, allowed = connector.insertion_thickness, connector.insertion_thickness_tolerance
    if wanted <= 0.0:
        yield PADS
        return
    have, plate = finished_thickness(design.layout, Where.CONTACT).nominal, design.layout.stiffener
    wrong = abs(have - wanted)
    if wrong > allowed + ROUNDING:
        spec, bare = design.spec, have - (plate.thickness if plate is not None else 0.0)
        names = [name for name in presets.names("connector") if name != connector.name]
        others, fixes = partial(each_read, spec, "fpc.tail.connector", names), tuple[Family, ...]()
        if bare <= wanted + allowed + ROUNDING:
            hint = (f"choose a stiffener {show(wrong, 'm')} {'thinner' if have > wanted else 'thicker'} "
                    "(fpc.tail.stiffener), or another fpc.tail.connector")
            plate_of = [f"{1e3 * (wanted - bare):.6g}"] if wanted > bare else []
            fixes = partial(each_read, spec, "fpc.tail.stiffener", plate_of), others
        elif presets.is_rigid(spec.fpc.stackup):
            hint = "fpc.tail.connector: solder-pads, for wires or a soldered connector: FR4 is too thick for plugs"
        else:
            hint = ("it is too thick without any stiffener: fewer copper layers down the tail (fpc.tail.layers), a "
                    "thinner fpc.stackup, or another fpc.tail.connector")
            fixes = partial(thinner_tails, spec), others
        yield Violation(
            f"the tail's end, with its stiffener, is {show(have, 'm')} thick; {connector.name} takes "
            f"{show(wanted, 'm')} +- {show(allowed, 'm')}{plug_mark(connector)}", hint, "fpc.tail.connector", have,
            wanted, "m", source=connector.source, fixes=fixes,
        )


def contact_worst_case(design: Design) -> Iterator[Verdict]:
    """The finished thickness at the contacts with the fabricator's tolerance against what the connector takes, as far
    as another stiffener would come nearer: what comes with every connector stands in the order.
    """
    connector, pads = _connector(design.spec.fpc), design.layout.pads
    wanted, allowed = connector.insertion_thickness, connector.insertion_thickness_tolerance
    if wanted <= 0.0:
        yield PADS
        return
    band, low, high = finished_thickness(design.layout, Where.CONTACT), wanted - allowed, wanted + allowed
    worst = max((low - band.minimum, band.minimum), (band.maximum - high, band.maximum))
    # a stiffener out of stock comes as near as half a step to the thickness that is wanted
    half_a_step = max(b - a for a, b in pairwise(_in_stock())) / 2
    if worst[0] > half_a_step + ROUNDING and low - ROUNDING <= band.nominal <= high + ROUNDING:
        yield Violation(
            f"the contacts come out {show(band.minimum, 'm')} to {show(band.maximum, 'm')} thick with the fabricator's "
            f"tolerance; {connector.name} takes {show(low, 'm')} to {show(high, 'm')}{plug_mark(connector)}",
            f"write the connector's band on the order ({show(wanted, 'm')} +- {show(allowed, 'm')}) and have it "
            "confirmed, or measure the parts before they are plugged in", "fpc.tail.connector", worst[1],
            high if worst[1] == band.maximum else low, "m", source=band.source,
            place=Place(*pads[0].centre, 1) if pads else None,
        )


def _in_stock() -> list[float]:
    """Thicknesses (m) of stiffeners that are made of a film and an adhesive in stock, the thinnest first."""
    return sorted({film + adhesive for film, adhesive in stock_stiffeners()})


def stiffener_stock(design: Design) -> Iterator[Verdict]:
    """A stiffener that is not made of a film and an adhesive that are in stock."""
    tail, plate, totals = design.spec.fpc.tail, design.layout.stiffener, _in_stock()
    if tail is None or plate is None or plate.adhesive > 0.0:
        return
    near = sorted(totals, key=lambda total: (abs(total - plate.thickness), total))[:2]
    key, severity = "fpc.tail.connector", Severity.WARNING
    if tail.stiffener is not None:
        key, severity = "fpc.tail.stiffener", Severity.NOTE
    yield Violation(
        f"the stiffener is {show(plate.thickness, 'm')} thick with its adhesive; none of the films and adhesives that "
        f"are commonly in stock makes it ({show(totals[0], 'm')} to {show(totals[-1], 'm')}, near it "
        f"{' and '.join(show(total, 'm') for total in near)})",
        "ask the fabricator which thickness is in stock, and write it as fpc.tail.stiffener", key, plate.thickness,
        near[0], "m", severity, "sitscad/data/stiffeners.csv",
    )


def plug_width(design: Design) -> Iterator[Verdict]:
    """The tolerance of the outline against that which the connector asks of the tail's width, where even a closer cut
    does not keep it: the order asks for the closer one anyway.
    """
    connector, rules = _connector(design.spec.fpc), design.spec.fpc.rules
    if connector.width_tolerance <= 0.0:
        yield Undecided("the tail ends in solder pads: nothing guides its sides")
        return
    if rules.outline_tolerance > CLOSER_CUT * connector.width_tolerance + ROUNDING:
        width = connector.width(contact_row(design.spec, connector).count)
        mark = plug_mark(connector, "width_tolerance")
        yield Violation(
            f"the tail's end is {show(width, 'm')} wide, +- {show(rules.outline_tolerance, 'm')} by "
            f"{house(rules, 'outline_tolerance')}; {connector.name} guides it by its sides and takes +- "
            f"{show(connector.width_tolerance, 'm')}{mark}",
            f"order and drawing ask for +- {show(connector.width_tolerance, 'm')} there: have it confirmed (cut by "
            "laser, or by a punch of its own), or measure the parts before they are plugged in", "fpc.tail.connector",
            rules.outline_tolerance, connector.width_tolerance, "m", source=source_of(rules, "outline_tolerance"),
            place=Place(*design.layout.pads[0].centre, 1) if design.layout.pads else None,
        )


def connector_positions(design: Design) -> Iterator[Verdict]:
    """The number of contacts against those that the connector is made with, and whether some lead nowhere."""
    connector, tail = _connector(design.spec.fpc), design.spec.fpc.tail
    row, made, mark = contact_row(design.spec, connector), connector.positions, plug_mark(connector, "positions")
    if made and row.count not in made:
        written = tail is not None and tail.contacts is not None
        yield Violation(
            f"{connector.name} is not known to be made with {row.count} contacts (its list has {made[0]} to "
            f"{made[-1]}){mark}",
            "compare with the drawing of what you buy" if written else "another connector, or fewer coils",
            "fpc.tail.contacts" if written else "fpc.tail.connector", float(row.count), float(made[-1]),
            severity=Severity.NOTE if written else None, source=connector.source,
        )
    elif made and row.count > row.used:
        yield Violation(
            f"the coils need {row.used} contacts and {connector.name} has {row.count}{mark}: {row.count - row.used} "
            f"lead nowhere, the coils have {row.first} to {row.first + row.used - 1}",
            "wire the converter's board to those; a connector with another number is written as fpc.tail.contacts",
            "fpc.tail.connector", float(row.used), float(row.count), severity=Severity.NOTE, source=connector.source,
        )


def plug_mark(connector: Connector, *fields: str) -> str:
    """A warning in brackets where what a connector takes was not read in its drawing."""
    fields = fields or ("insertion_thickness", "insertion_thickness_tolerance")
    return " (unverified: compare with its drawing)" if is_unverified(connector.source, *fields) else ""


def _connector(fpc: FpcSpec) -> Connector:
    assert fpc.tail is not None
    return fpc.tail.connector


def contact_finish(design: Design) -> Iterator[Verdict]:
    """The finish against what is done with the contacts, and against what it takes to plate it."""
    layout, fpc = design.layout, design.spec.fpc
    chosen = finish(fpc.finish)
    is_plugged = fpc.tail is not None and fpc.tail.connector.kind != "pads"
    if not (chosen.is_for_plugs if is_plugged else chosen.is_for_solder):
        why = "plugged in: it wears off" if is_plugged else "soldered to: so much gold makes the joints brittle"
        yield Violation(f"{fpc.finish} is not for contacts that are {why}", "finish: enig serves both", "fpc.finish",
                        severity=Severity.WARNING, source=chosen.source)
    if chosen.is_electrolytic and layout.pads:
        apart = max(_to_the_edge(layout.outline, pad) for pad in layout.pads)
        is_long = apart > LONGEST_BAR + ROUNDING
        bars = (
            "order and drawing ask the fabricator to add bars there and to cut them off with the outline: have it "
            "confirmed; finish: enig needs none and serves a socket that is mated seldom"
        )
        long = f"bars of more than {show(LONGEST_BAR, 'm')} leave copper at the cut: finish: enig needs none"
        yield Violation(
            f"{chosen.words} is plated by a current, for which all {len(layout.pads)} contacts have to be joined to "
            f"the panel: plating bars are not drawn; the contacts end {show(apart, 'm')} before the board's edge",
            long if is_long else bars, "fpc.finish", severity=Severity.ERROR if is_long else Severity.WARNING,
            source=chosen.source, place=Place(*layout.pads[0].centre, 1),
        )


def _to_the_edge(outline: Path, pad: Pad) -> float:
    """The distance (m) from a contact's end straight on to the outline, in the nearer direction along the contact."""
    half, corners, found = max(pad.size) / 2, outline.flattened(1e-6), [math.inf]
    dx, dy = (1.0, 0.0) if pad.size[0] >= pad.size[1] else (0.0, 1.0)
    for sign in (-1.0, 1.0):  # as far as a metre
        end = pad.centre.shifted(sign * half * dx, sign * half * dy)
        found += crossings(end, end.shifted(sign * dx, sign * dy), corners)
    return min(found)


RULES: tuple[Rule, ...] = (
    rule_of("SIT117", insertion_thickness, "tail"),
    rule_of("SIT124", contact_worst_case, "tail"),
    rule_of("SIT126", plug_width, "tail"),
    rule_of("SIT127", connector_positions, "tail"),
    rule_of("SIT129", stiffener_stock, "tail"),
    rule_of("SIT128", contact_finish),
)
