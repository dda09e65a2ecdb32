"""SIT117, SIT123, SIT124 and SIT126 to SIT130: the tail's bend, its step in thickness, its end and its contacts.

SIT123 checks that the bent part has nothing stiff, straight tracks and enough length. SIT130 checks copper near the
step at the body's end if the tail has fewer layers. The other rules check the tail's end against the connector, and the
contacts' finish.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise

from sitscad.assembly.places.tail_path import TOO_SHORT, bends_of_mount, own_bend, room_for_own, tail_path
from sitscad.basics.finding import Edit, Place, Severity
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.checks.board.clearances import crossings
from sitscad.checks.board.fabrication import house
from sitscad.checks.fixes.moves import each_read, larger_body, thinner_tails
from sitscad.checks.fixes.search import Family, Fix, Growing, setting
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, rule_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Path, bounding_box
from sitscad.layout.bending import (
    Where,
    bend_figure,
    bend_length,
    finished_thickness,
    least_bend_radius,
    longest_straight,
    tail_thickness,
    unfit_for_bending,
)
from sitscad.layout.board import Pad, Stiffener
from sitscad.layout.lamination import lamination_text
from sitscad.layout.lanes import Ring
from sitscad.layout.tail_frame import contact_row
from sitscad.spec import presets
from sitscad.spec.circuit import Connector, FpcSpec, Plating, Stackup, Tail
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.presets import finish, is_rigid, stock_stiffeners
from sitscad.spec.sensor import SensorSpec

LENGTH_GRAIN, LONGEST = 0.1e-3, 5.0
"""Step (m) of the longer tails that hints name, and the longest tail (m) of a spec."""

FIRST_ROOM = 1e-3
"""Least length (m) by which a tail without any room to bend is lengthened."""

NO_ROOM = "lengthen the tail, or fpc.tail.bend: none"

GRAIN = 0.05e-3
"""Step (m) of the margins that hints name."""


@record
class _Straight:
    """The longest part of the bend zone with straight tracks of constant width.

    ``start`` and ``length`` are in metres. ``room`` is the length (m) left for the spec's own bend beside the mount's
    bends. ``unfit`` is the first place in the zone at which tracks are not straight, if any.
    """

    start: float
    length: float
    room: float
    unfit: Place | None


def bend_zone(design: Design) -> Iterator[Verdict]:
    """Yield findings on stiff items and possible starts of cracks where the tail bends."""
    zone, tail = design.layout.bend_zone, design.spec.fpc.tail
    assert tail is not None
    if tail.bend == "none":
        yield Undecided("the tail does not bend (fpc.tail.bend: none)")
        return
    if is_rigid(design.spec.fpc.stackup):
        yield Undecided("a rigid board has no zone that bends: SIT308 refuses the bend")
        return
    if zone is not None:
        # A violation for every via, contact and stiffener inside the bend zone (x from and to, m)
        layout = design.layout
        stiff = [(f"a via of {v.net}", v.centre.x, v.pad / 2, Place(*v.centre, None, (v.net,))) for v in layout.vias]
        stiff += [(f"contact {pad.name}", pad.centre.x, pad.size[0] / 2, Place(*pad.centre, pad.layer, (pad.net,)))
                  for pad in layout.all_pads]
        if layout.stiffener is not None:
            x0, y0, x1, y1 = bounding_box([layout.stiffener.outline.outline])
            stiff += [("the stiffener", (x0 + x1) / 2, (x1 - x0) / 2, Place(max(x0, zone[0]), (y0 + y1) / 2))]
        for what, middle, half, place in stiff:
            inside = min(middle + half, zone[1]) - max(middle - half, zone[0])
            if inside > ROUNDING:
                yield Violation(
                    f"{what} reaches {show(inside, 'm', 3)} into the bend zone",
                    "lengthen the tail, so that it lies outside the bend, or do without a bend (fpc.tail.bend: none)",
                    "fpc.tail.bend", inside, 0.0, "m", place=place,
                )
    yield from _mount_bends(design)
    yield from _too_short(design)
    yield from _misplaced(design)
    yield from _too_sharp(design.spec)


def _mount_bends(design: Design) -> Iterator[Violation]:
    """Yield a finding if a bend made by the mount extends beyond the part that may be bent."""
    path, straight = tail_path(design.layout), _straight(design)
    if path is not None and path.reason == TOO_SHORT:
        yield Violation(
            "the tail is too short for the two bends by which it is let down to what carries the mount",
            "a longer fpc.tail.length, or a smaller mount.standoff", "fpc.tail.length", severity=Severity.WARNING,
        )
        return
    made, end = bends_of_mount(design.layout), straight.start + straight.length
    if made and made[-1].end > end + ROUNDING:
        last = made[-1]
        at = Place(last.line, sum(design.layout.reach_at(last.line)) / 2)
        yield Violation(
            f"the mount bends the tail from x = {show(made[0].start, 'm')} to {show(last.end, 'm')}, its tracks run "
            f"straight as far as {show(end, 'm')}: {show(last.end - end, 'm', 3)} too much",
            "a longer fpc.tail.length, a smaller mount.standoff, or a mount that ends nearer to the board",
            "fpc.tail.length", last.end - end, 0.0, "m", severity=Severity.WARNING, place=at,
        )


def _too_short(design: Design) -> Iterator[Violation]:
    """Yield a violation if the tail has no straight part long enough for its bend."""
    spec, layout, tail = design.spec, design.layout, design.spec.fpc.tail
    straight, needed, fits, figure = _straight(design), bend_length(spec.fpc), _fits(design), bend_figure(spec.fpc)
    assert tail is not None
    if straight.unfit is not None:
        rest = (
            "a part of the tail that is free of stiff pieces has tracks that turn or change their width; they run "
            f"straight at one width from x = {show(straight.start, 'm')} on, over "
            f"{show(max(0.0, straight.length if fits else straight.room), 'm', 3)}"
        )
        place = replace(straight.unfit, x=straight.start)
        if fits:
            hint = "nothing has to be changed: all bends of the drawing lie there. Bend the tail nowhere else"
            yield Violation(rest, hint, "fpc.tail.bend", straight.length, needed or None, "m", Severity.NOTE,
                            place=place)
    if fits:
        return
    angle, radius = f"{math.degrees(tail.bend_angle):g} deg", ""
    if figure is not None:
        radius = f" at the radius of {figure[1]:g} thicknesses that {house(spec.fpc.rules, figure[0])} asks"
    mount = " beyond the mount's bends" if bends_of_mount(layout) else ""
    asked = f"{show(needed, 'm', 3)}{radius}"
    if straight.unfit is not None:
        message = f"{rest}, and a bend by {angle}{mount} needs {asked}"
    else:
        free = f"{show(max(0.0, straight.room), 'm', 3)} free of vias, turns and stiffener{mount}"
        message = f"the tail has {free} for its {tail.bend} bend"
        message += f"; one by {angle} needs {asked}" if needed else radius
    # an error if no part of the tail this long, straight or not, is free of stiff items
    zone = layout.bend_zone
    start = max([zone[0] if zone else 0.0, *(bend.end for bend in bends_of_mount(layout))])
    has_room = zone is not None and zone[1] - start >= needed - ROUNDING
    yield Violation(
        message, NO_ROOM, "fpc.tail.length", straight.room, needed, "m",
        Severity.WARNING if has_room else Severity.ERROR, spec.fpc.rules.source_of(figure[0]) if figure else None,
        place if straight.unfit is not None else None, fixes=_longer(design),
    )


def tail_length(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the drawn tail is longer than the spec's."""
    tail, drawn = design.spec.fpc.tail, design.layout.tail_length
    assert tail is not None
    if drawn > tail.length + ROUNDING:
        needed = LENGTH_GRAIN * math.ceil(drawn / LENGTH_GRAIN - 1e-6)
        fix = setting(design.spec, "fpc.tail.length", needed, f"{needed * 1e3:.1f} mm")
        yield Violation(
            f"a tail of {show(tail.length, 'm', 3)} is asked for and {show(drawn, 'm', 3)} are drawn: so much its "
            "leads take to come together, to spread to the contacts, and for the stiffener under them",
            "write the length that is drawn; a shorter one wants fewer contacts", "fpc.tail.length", tail.length,
            drawn, "m", fixes=(lambda: [fix],),
        )


def _misplaced(design: Design) -> Iterator[Violation]:
    """Yield a finding if a bend at a given place extends beyond the part that may be bent."""
    tail, zone, bend = design.spec.fpc.tail, design.layout.bend_zone, own_bend(design.layout)
    stretch = room_for_own(design.layout)
    if tail is None or tail.bend_at is None or zone is None or bend is None or stretch is None:
        return
    beyond = max(stretch[0] - bend.start, bend.end - stretch[1])
    if beyond > ROUNDING:
        half, (low, high) = (bend.end - bend.start) / 2, (x - design.layout.body[2] for x in stretch)
        room = f"from {show(low + half, 'm', 3)} to {show(high - half, 'm', 3)}"
        is_stiff = max(zone[0] - bend.start, bend.end - zone[1]) > ROUNDING
        into = "vias, contacts, stiffener or the body" if is_stiff else ""
        yield Violation(
            f"the bend about x = {show(bend.line, 'm')} takes the tail from x = {show(bend.start, 'm')} to "
            f"{show(bend.end, 'm')} and reaches {show(beyond, 'm', 3)} into "
            f"{into or 'tracks that are not straight, or what the mount takes'}",
            f"fpc.tail.bend.at has room {room if high - low > 2 * half else 'nowhere yet'}; or leave it out",
            "fpc.tail.bend.at", beyond, 0.0, "m", severity=Severity.ERROR if is_stiff else Severity.WARNING,
            place=Place(bend.line, sum(design.layout.reach_at(bend.line)) / 2),
        )


def _too_sharp(spec: SensorSpec) -> Iterator[Violation]:
    """Yield a finding if a given bend radius is smaller than the fabricator's."""
    tail, least, figure = spec.fpc.tail, least_bend_radius(spec.fpc), bend_figure(spec.fpc)
    if tail is None or tail.bend_radius is None or least is None or figure is None:
        return
    if tail.bend_radius < least - ROUNDING:
        rounder = math.ceil(least * 1e5 - 1e-6) * 1e-5  # rounded as written
        changed = setting(spec, "fpc.tail.bend_radius", rounder, "").spec
        fix = Fix((Edit("fpc.tail.bend.radius", f"{rounder * 1e3:.6g}"),), changed)
        hint = "a larger fpc.tail.bend.radius, or leave it out"
        yield Violation(
            f"a {tail.bend} bend of {show(tail.bend_radius, 'm', 3)} inside radius is sharper than the {figure[1]:g} "
            f"thicknesses that {house(spec.fpc.rules, figure[0])} asks: {show(least, 'm', 3)}", hint,
            "fpc.tail.bend.radius", tail.bend_radius, least, "m", severity=Severity.WARNING,
            source=spec.fpc.rules.source_of(figure[0]),
            fixes=(lambda: [fix],),
        )


def _longer(design: Design) -> tuple[Family, ...]:
    # Longer tails. None if leads or vias have no room: a longer tail does not help then.
    missing = bend_length(design.spec.fpc) - max(0.0, _straight(design).room)
    if design.layout.bend_zone is None:
        missing = max(missing, FIRST_ROOM)

    def longer(by: float) -> Fix:
        length = LENGTH_GRAIN * math.ceil((design.layout.tail_length + by) / LENGTH_GRAIN - 1e-6)
        fix = setting(design.spec, "fpc.tail.length", length, f"{length * 1e3:.1f} mm")
        return fix if length <= LONGEST else Fix((), design.spec)

    return () if design.layout.shortfalls else (Growing(longer, missing, LENGTH_GRAIN),)


def _fits(design: Design) -> bool:
    """Whether there is a bend zone, with straight tracks along the whole bend."""
    return design.layout.bend_zone is not None and _straight(design).room >= bend_length(design.spec.fpc) - ROUNDING


def _straight(design: Design) -> _Straight:
    """Return the longest straight part that may be bent, and the first item that is unfit for bending."""
    zone = design.layout.bend_zone
    if zone is None:
        return _Straight(0.0, 0.0, 0.0, None)
    unfit = unfit_for_bending(design.layout.bend_zone, design.layout.in_bend_zone, design.layout.traces)
    longest = longest_straight(zone, unfit)
    first = next((Place(each.first, each.y, each.layer, (each.net,)) for each in unfit), None)
    room = room_for_own(design.layout)
    return _Straight(longest.start, longest.length, longest.length if room is None else room[1] - room[0], first)


def special_build(design: Design) -> Iterator[Verdict]:
    """Yield a finding on a special build: a tail of fewer layers than the body, or button plating.

    Its hint describes the plain build for comparison.
    """
    layout, spec = design.layout, design.spec
    last, count, tail = layout.spec.fpc.tail_copper, layout.copper_layers, spec.fpc.tail
    stackup = spec.fpc.stackup.built(spec.fpc.stackup.plating, 0)
    if tail is None or last == count:
        if layout.vias and stackup.plating is Plating.BUTTONS:
            panel = _copper(stackup.built(Plating.PANEL, 0))
            yield Violation(
                f"holes and their pads alone are plated (buttons), so that the tracks stay {_copper(stackup)} of "
                "foil: a build to ask for",
                f"a house plates the whole panel without being asked, which finishes the copper at {panel} "
                "(fpc.plated: panel; the preset flex-2l-30um is such a board): have the buttons confirmed with the "
                "quotation", "fpc.plated",
            )
        return
    plain = replace(spec, fpc=replace(spec.fpc, stackup=stackup, tail=replace(tail, layers=count)))
    radii = [least_bend_radius(each.fpc) for each in (spec, plain)]
    bent = f" and bends to {show(radii[1], 'm')} instead of {show(radii[0], 'm')}" if radii[0] and radii[1] else ""
    yield Violation(
        f"a tail of {last} copper layer{'s' * (last > 1)} on a body of {count} is a special build; finished copper "
        f"{_copper(spec.fpc.stackup)}",
        "a house makes the plain build without being asked (leave fpc.tail.layers out: one lamination, through holes "
        f"only, finished copper {_copper(stackup)}); its tail is {show(tail_thickness(plain.fpc), 'm')} thick instead "
        f"of {show(tail_thickness(spec.fpc), 'm')}{bent}. For this one, have the steps confirmed with the quotation",
        "fpc.tail.layers", float(last), float(count), detail=lamination_text(layout),
    )


def _copper(stackup: Stackup) -> str:
    """Return finished copper thicknesses from the top, like 30/18/18/30 um."""
    return "/".join(f"{layer.thickness * 1e6:.4g}" for layer in stackup.copper) + " um"


def step(design: Design) -> Iterator[Verdict]:
    """Yield findings on holes and turns near the step at which the lower layers end.

    The tail's own coverlay may overlap there.
    """
    layout, rules, end = design.layout, design.spec.fpc.rules, design.layout.body[2]
    if layout.spec.fpc.tail_copper == layout.copper_layers:
        return
    through = [via for via in layout.vias if via.lowest is None]
    near = max(through, key=lambda via: via.centre.x + via.drill / 2.0, default=None)
    gap = math.inf if near is None else end - near.centre.x - near.drill / 2.0
    asked = rules.coverlay_lap + rules.coverlay_registration
    field, apart = "hole_to_step", rules.hole_to_step
    if layout.spec.fpc.has_tail_coverlay and asked > apart:
        field, apart = "coverlay_lap", asked
    if near is not None and gap < apart - ROUNDING:
        message = (
            f"a hole of {near.net} stands {show(gap, 'm')} from the body's end, where copper "
            f"{layout.spec.fpc.tail_copper + 1} and what is below it end; {house(rules, field)} asks {show(apart, 'm')}"
        )
        place = Place(*near.centre, nets=(near.net,))
        yield _too_near(design, message, gap, apart, rules.source_of(field), place)
    reach = {p.name: Ring(design.spec.coil, p, 0.0).half_size[0] for p in design.spec.array.placements}
    coil = max(layout.coils, key=lambda coil: coil.centre.x + reach[coil.name])
    gap = end - coil.centre.x - reach[coil.name]
    if layout.spec.fpc.has_tail_coverlay and gap < asked - ROUNDING:
        message = (
            f"the turns of {coil.name} begin {show(gap, 'm')} from the body's end, into which the tail's own coverlay "
            f"laps {show(rules.coverlay_lap, 'm')}, laid within {show(rules.coverlay_registration, 'm')}: layers lie "
            "farther apart there"
        )
        place = Place(*coil.centre, nets=(coil.net,))
        yield _too_near(design, message, gap, asked, rules.source_of("coverlay_lap"), place)


def _too_near(design: Design, message: str, gap: float, asked: float, source: str, place: Place) -> Violation:
    """Return the violation for an item too near to the step in thickness, with a longer body as remedy."""
    margin = design.spec.fpc.margin
    longer = GRAIN * math.ceil((margin[0] + (asked - gap)) / GRAIN - 1e-6)
    fix = setting(design.spec, "fpc.margin", (longer, margin[1]), f"[{longer * 1e3:g}, {margin[1] * 1e3:g}]")
    if design.spec.fpc.body is not None:
        fix = larger_body(design.spec, longer)
    hint = (f"{show(asked - gap, 'm')} are missing: a longer body ({design.spec.fpc.body_key}), or as many layers in "
            f"the tail (the step is {show(design.layout.spec.fpc.tail_step, 'm')} high)")
    return Violation(message, hint, "fpc.tail.layers", gap, asked, "m", source=source, place=place,
                     fixes=(lambda: [fix],))


LONGEST_BAR = 1.5e-3
"""Largest distance (m) from a contact's tip to the board's edge at which a fabricator is assumed to add plating bars
unasked.
"""

CLOSER_CUT = 2.0
"""Ratio of the usual cutting tolerance to the closer tolerance of the same fabricator.

A router cuts within +-0.1 mm, a steel die within +-0.05 mm (wellerpcba.com/flex-pcb-capability).
"""

PADS = Undecided("the tail ends in solder pads: no connector takes it")


def insertion_thickness(design: Design) -> Iterator[Verdict]:
    """Yield findings on the thickness at the contacts, with remaining coverlay and stiffener, against the connector."""
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
            fixes = (partial(each_read, spec, "fpc.tail.connector", ["solder-pads"]),)
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
    """Yield a finding if the fabricator's tolerance takes the thickness at the contacts out of the connector's range.

    Only deviations that another stiffener would reduce are reported. Smaller deviations occur with every connector and
    are stated in the order.
    """
    connector, pads = _connector(design.spec.fpc), design.layout.pads
    wanted, allowed = connector.insertion_thickness, connector.insertion_thickness_tolerance
    if wanted <= 0.0:
        yield PADS
        return
    band, low, high = finished_thickness(design.layout, Where.CONTACT), wanted - allowed, wanted + allowed
    worst = max((low - band.minimum, band.minimum), (band.maximum - high, band.maximum))
    # a stiffener from stock comes within half a step of the required thickness
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
    """Return thicknesses (m) of stiffeners made of a film and an adhesive in stock, the thinnest first."""
    return sorted({film + adhesive for film, adhesive in stock_stiffeners()})


def stiffener_stock(plate: Stiffener | None, tail: Tail | None) -> Iterator[Verdict]:
    """Yield a finding on a stiffener that is not made of a film and an adhesive in stock."""
    totals = _in_stock()
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


def plug_width(pads: tuple[Pad, ...], placements: tuple[CoilPlacement, ...], fpc: FpcSpec) -> Iterator[Verdict]:
    """Yield a finding if the outline's tolerance exceeds the connector's tolerance for the tail's width.

    Only tolerances that even a closer cut does not keep are reported, because the order requests the closer cut anyway.
    """
    connector, rules = _connector(fpc), fpc.rules
    if connector.width_tolerance <= 0.0:
        yield Undecided("the tail ends in solder pads: nothing guides its sides")
        return
    if rules.outline_tolerance > CLOSER_CUT * connector.width_tolerance + ROUNDING:
        width = connector.width(contact_row(placements, fpc.tail, connector).count)
        mark = plug_mark(connector, "width_tolerance")
        yield Violation(
            f"the tail's end is {show(width, 'm')} wide, +- {show(rules.outline_tolerance, 'm')} by "
            f"{house(rules, 'outline_tolerance')}; {connector.name} guides it by its sides and takes +- "
            f"{show(connector.width_tolerance, 'm')}{mark}",
            f"order and drawing ask for +- {show(connector.width_tolerance, 'm')} there: have it confirmed (cut by "
            "laser, or by a punch of its own), or measure the parts before they are plugged in", "fpc.tail.connector",
            rules.outline_tolerance, connector.width_tolerance, "m", source=rules.source_of("outline_tolerance"),
            place=Place(*pads[0].centre, 1) if pads else None,
        )


def connector_positions(placements: tuple[CoilPlacement, ...], fpc: FpcSpec) -> Iterator[Verdict]:
    """Yield findings on a number of contacts that the connector is not made with, and on unused contacts."""
    connector, tail = _connector(fpc), fpc.tail
    row, made, mark = contact_row(placements, fpc.tail, connector), connector.positions, plug_mark(connector,
                                                                                                   "positions")
    if made and row.count not in made:
        written = tail is not None and tail.contacts is not None
        others = [name for name in presets.names("connector") if row.count in presets.connector(name).positions]
        other = f"fpc.tail.connector: {' or '.join(others)}, made with {row.count}, or " if others else ""
        yield Violation(
            f"{connector.name} is not known to be made with {row.count} contacts (its list has {made[0]} to "
            f"{made[-1]}){mark}",
            f"{other}compare with the drawing of what you buy" if written else f"{other}fewer coils",
            "fpc.tail.contacts" if written else "fpc.tail.connector", float(row.count), float(made[-1]),
            severity=Severity.WARNING if written else None, source=connector.source,
        )
    elif made and row.count > row.used:
        yield Violation(
            f"the coils need {row.used} contacts and {connector.name} has {row.count}{mark}: {row.count - row.used} "
            f"lead nowhere, the coils have {row.first} to {row.first + row.used - 1}",
            "wire the converter's board to those; a connector with another number is written as fpc.tail.contacts",
            "fpc.tail.connector", float(row.used), float(row.count), severity=Severity.NOTE, source=connector.source,
        )


def plug_mark(connector: Connector, *fields: str) -> str:
    """Return a warning in brackets if a connector's values were not read from its drawing. Otherwise empty."""
    fields = fields or ("insertion_thickness", "insertion_thickness_tolerance")
    return " (unverified: compare with its drawing)" if is_unverified(connector.source, *fields) else ""


def _connector(fpc: FpcSpec) -> Connector:
    assert fpc.tail is not None
    return fpc.tail.connector


def contact_finish(design: Design) -> Iterator[Verdict]:
    """Yield findings on a finish unsuitable for the contacts' use, and on the plating bars that it needs."""
    layout, fpc = design.layout, design.spec.fpc
    chosen = finish(fpc.finish)
    is_plugged = fpc.tail is not None and fpc.tail.connector.kind != "pads"
    as_enig = partial(each_read, design.spec, "fpc.finish", ["enig"])
    if not (chosen.is_for_plugs if is_plugged else chosen.is_for_solder):
        why = "plugged in: it wears off" if is_plugged else "soldered to: so much gold makes the joints brittle"
        yield Violation(f"{fpc.finish} is not for contacts that are {why}", "fpc.finish: enig serves both",
                        "fpc.finish", severity=Severity.WARNING, source=chosen.source, fixes=(as_enig,))
    if chosen.is_electrolytic and layout.pads:
        apart = max(_to_the_edge(layout.outline, pad) for pad in layout.pads)
        is_long = apart > LONGEST_BAR + ROUNDING
        bars = (
            "order and drawing ask the fabricator to add bars there and to cut them off with the outline: have it "
            "confirmed; fpc.finish: enig needs none and serves a socket that is mated seldom"
        )
        long = f"bars of more than {show(LONGEST_BAR, 'm')} leave copper at the cut; fpc.finish: enig needs none"
        yield Violation(
            f"{chosen.words} is plated by a current, for which all {len(layout.pads)} contacts have to be joined to "
            f"the panel: plating bars are not drawn; the contacts end {show(apart, 'm')} before the board's edge",
            long if is_long else bars, "fpc.finish", severity=Severity.ERROR if is_long else Severity.WARNING,
            source=chosen.source, place=Place(*layout.pads[0].centre, 1), fixes=(as_enig,),
        )


def _to_the_edge(outline: Path, pad: Pad) -> float:
    """Return the distance (m) from a contact's end to the outline, in the nearer direction along the contact."""
    half, corners, found = max(pad.size) / 2, outline.flattened(1e-6), [math.inf]
    dx, dy = (1.0, 0.0) if pad.size[0] >= pad.size[1] else (0.0, 1.0)
    for sign in (-1.0, 1.0):  # up to one metre
        end = pad.centre.shifted(sign * half * dx, sign * half * dy)
        found += crossings(end, end.shifted(sign * dx, sign * dy), corners)
    return min(found)


RULES: tuple[Rule, ...] = (
    rule_of("SIT123", bend_zone, "tail"), rule_of("SIT133", tail_length, "tail"), rule_of("SIT130", step, "tail"),
    rule_of("SIT132", special_build),
    rule_of("SIT117", insertion_thickness, "tail"),
    rule_of("SIT124", contact_worst_case, "tail"),
    rule_of("SIT126", lambda design: plug_width(design.layout.pads, design.spec.array.placements, design.spec.fpc),
            "tail"),
    rule_of("SIT127", lambda design: connector_positions(design.spec.array.placements, design.spec.fpc), "tail"),
    rule_of("SIT129", lambda design: stiffener_stock(design.layout.stiffener, design.spec.fpc.tail), "tail"),
    rule_of("SIT128", contact_finish),
)
