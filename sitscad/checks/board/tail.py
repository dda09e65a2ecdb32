"""SIT123 and SIT130: the stretch of the tail that is bent (nothing stiff in it, straight tracks, length enough), and
what lies near the step at the body's end where a tail has fewer layers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from sitscad.checks.board.fabrication import ROUNDING, house, source_of, um
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, Violation, rule_of, worded
from sitscad.design import Design
from sitscad.fabrication.notes import build_text
from sitscad.finding import Edit, Place, Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.bending import (
    bend_figure,
    bend_length,
    has_tail_coverlay,
    least_bend_radius,
    longest_straight,
    step_height,
    tail_copper,
    tail_thickness,
    unfit_for_bending,
)
from sitscad.layout.lanes import Ring
from sitscad.record import record
from sitscad.remedy.moves import larger_body
from sitscad.remedy.search import Fix, Left, first_tried, setting, tried
from sitscad.scene.tail_path import TOO_SHORT, bends_of_mount, own_bend, room_for_own, tail_path
from sitscad.spec.circuit import Plating, Stackup
from sitscad.units import show

LENGTH_GRAIN, TRIALS, LONGEST = 0.1e-3, 5, 5.0
"""A longer tail is named in steps of this (m), after at most so many trials; the spec takes none longer than this (m).
"""

FIRST_ROOM = 1e-3
"""By so much (m) a tail without any room to bend is lengthened at least, trial by trial."""


@record
class _Straight:
    # The longest stretch in the bend zone in which tracks run straight at one width: where it begins and its length
    # (m), how much of that the mount and its bends leave for the spec's own (m), and the first place in the zone where
    # tracks are not straight, if any.
    start: float
    length: float
    room: float
    unfit: Place | None


def bend_zone(design: Design) -> Iterator[Verdict]:
    """Nothing stiff and nothing that starts a crack lies where the tail bends."""
    zone, tail = design.layout.bend_zone, design.spec.fpc.tail
    assert tail is not None
    if tail.bend == "none":
        yield Undecided("the tail does not bend (fpc.tail.bend: none)")
        return
    if zone is not None:
        # A complaint for every via, contact and stiffener inside the zone (x from and to, m) that is bent
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
                yield IN_BEND.found("fpc.tail.bend", inside, 0.0, "m", place=place, what=what)
    yield from _mount_bends(design)
    yield from _too_short(design)
    yield from _misplaced(design)
    yield from _too_sharp(design)


def _mount_bends(design: Design) -> Iterator[Violation]:
    """A bend by which the mount lets the tail down, and which reaches beyond what may be bent."""
    path, straight = tail_path(design.layout), _straight(design)
    if path is not None and path.reason == TOO_SHORT:
        yield NOT_LET_DOWN.found("fpc.tail.length")
        return
    made, end = bends_of_mount(design.layout), straight.start + straight.length
    if made and made[-1].end > end + ROUNDING:
        last = made[-1]
        at = Place(last.line, sum(design.layout.reach_at(last.line)) / 2)
        yield BEYOND_STRAIGHT.found("fpc.tail.length", last.end - end, 0.0, "m", place=at, start=made[0].start,
                                    last=last.end, straight=end)


def _too_short(design: Design) -> Iterator[Violation]:
    """A complaint where the tail has no straight stretch long enough for its bend."""
    straight, needed, fits = _straight(design), bend_length(design.spec), _fits(design)
    if fits and straight.unfit is None:
        return
    tail, figure = design.spec.fpc.tail, bend_figure(design.spec)
    assert tail is not None
    free, straight_only = SHORT if needed else NO_STRETCH, STRAIGHT_FOR if fits else STRAIGHT_BUT_SHORT
    case = free if straight.unfit is None else straight_only
    at = {"ratio": figure[1], "house": house(design, figure[0])} if figure and not fits else {}
    yield case.found(
        "fpc.tail.bend" if fits else "fpc.tail.length", straight.length if fits else straight.room, needed, "m",
        source=source_of(design, figure[0]) if figure and not fits else None,
        place=straight.unfit and replace(straight.unfit, x=straight.start),
        advice=None if fits else lambda left: _longer(design, left), is_grave=not _has_room(design, needed),
        have=max(0.0, straight.length if fits else straight.room),
        mount=" beyond the mount's bends" if bends_of_mount(design.layout) and not fits else "", bend=tail.bend,
        angle=f"{math.degrees(tail.bend_angle):g} deg",
        start=straight.start, radius=worded(AT_RADIUS, at) if at else "",
    )


def _has_room(design: Design, needed: float) -> bool:
    """Whether so much of the tail (m) lies between body and contacts without anything stiff, straight or not."""
    zone = design.layout.bend_zone
    if zone is None:
        return False
    start = max([zone[0], *(bend.end for bend in bends_of_mount(design.layout))])
    return zone[1] - start >= needed - ROUNDING


def tail_length(design: Design) -> Iterator[Verdict]:
    """The tail as drawn against the length that the spec asks for."""
    tail, drawn = design.spec.fpc.tail, design.layout.tail_length
    assert tail is not None
    if drawn <= tail.length + ROUNDING:
        return
    needed = LENGTH_GRAIN * math.ceil(drawn / LENGTH_GRAIN - 1e-6)
    fix = setting(design.spec, "fpc.tail.length", needed, f"{needed * 1e3:.1f} mm")
    yield DRAWN_LONGER.found(
        "fpc.tail.length", tail.length, drawn, "m", words=fix.words,
        advice=lambda left: f"{fix.words} is what is drawn{tried(fix, left)}; a shorter one wants fewer contacts",
    )


def _misplaced(design: Design) -> Iterator[Violation]:
    """A bend whose place the spec gives, and which reaches beyond what may be bent there."""
    tail, zone, bend = design.spec.fpc.tail, design.layout.bend_zone, own_bend(design.layout)
    if tail is None or tail.bend_at is None or zone is None or bend is None:
        return
    stretch = room_for_own(design.layout)
    if stretch is None:
        return
    beyond = max(stretch[0] - bend.start, bend.end - stretch[1])
    if beyond <= ROUNDING:
        return
    low, high = (x - design.layout.body[2] for x in stretch)
    half = (bend.end - bend.start) / 2
    room = f"from {show(low + half, 'm', 3)} to {show(high - half, 'm', 3)}" if high - low > 2 * half else "nowhere yet"
    what = "vias, contacts, stiffener or the body" if max(zone[0] - bend.start, bend.end - zone[1]) > ROUNDING else ""
    yield MISPLACED.found("fpc.tail.bend.at", beyond, 0.0, "m",
                          place=Place(bend.line, sum(design.layout.reach_at(bend.line)) / 2), is_grave=bool(what),
                          line=bend.line, start=bend.start, end=bend.end,
                          into=what or "tracks that are not straight, or what the mount takes", room=room)


def _too_sharp(design: Design) -> Iterator[Violation]:
    """A bend whose radius the spec gives, and which is sharper than the fabricator's."""
    tail, least, figure = design.spec.fpc.tail, least_bend_radius(design.spec), bend_figure(design.spec)
    if tail is None or tail.bend_radius is None or least is None or figure is None:
        return
    if tail.bend_radius >= least - ROUNDING:
        return
    rounder = math.ceil(least * 1e5 - 1e-6) * 1e-5  # as it is written
    spec = setting(design.spec, "fpc.tail.bend_radius", rounder, "").spec
    fix = Fix((Edit("fpc.tail.bend.radius", f"{rounder * 1e3:.6g}"),), spec)
    yield TOO_SHARP.found("fpc.tail.bend.radius", tail.bend_radius, least, "m", source=source_of(design, figure[0]),
                          bend=tail.bend, thicknesses=figure[1], house=house(design, figure[0]),
                          advice=first_tried([[fix]], TOO_SHARP.hint))


NO_ROOM = "lengthen the tail, or fpc.tail.bend: none"


def _longer(design: Design, left: Left) -> str:
    """The length of tail with which the bend has room, as it was tried; else what else would do."""
    fix = _long_enough(design, left)
    return NO_ROOM if fix is None else f"{fix.words} is long enough{tried(fix, left)}, or fpc.tail.bend: none"


def _long_enough(design: Design, left: Left) -> Fix | None:
    """A length of the tail with which its bend has room, found by laying the board out with it; None if none, or
    where leads or vias found no room: that search is long, and as vain with any tail.
    """
    if design.layout.shortfalls:
        return None
    shorter, length = design, design.layout.tail_length
    for _ in range(TRIALS):
        missing = bend_length(shorter.spec) - max(0.0, _straight(shorter).room)
        if shorter.layout.bend_zone is None:
            missing = max(missing, FIRST_ROOM)
        length = LENGTH_GRAIN * math.ceil((length + missing) / LENGTH_GRAIN - 1e-6)
        if length > LONGEST:
            return None
        longer = setting(design.spec, "fpc.tail.length", length, f"{length * 1e3:.1f} mm")
        layout = left.drawn(longer.spec)
        if layout is None:
            return None
        shorter = Design(longer.spec, layout)
        if _fits(shorter):
            return longer
    return None


def _fits(design: Design) -> bool:
    """Whether there is somewhere to bend, and straight tracks along all of its bend."""
    return design.layout.bend_zone is not None and _straight(design).room >= bend_length(design.spec) - ROUNDING


def _straight(design: Design) -> _Straight:
    """The longest straight stretch that may be bent, and the first thing that is unfit for it."""
    zone = design.layout.bend_zone
    if zone is None:
        return _Straight(0.0, 0.0, 0.0, None)
    unfit = unfit_for_bending(design.layout)
    longest = longest_straight(zone, unfit)
    first = next((Place(each.first, each.y, each.layer, (each.net,)) for each in unfit), None)
    room = room_for_own(design.layout)
    return _Straight(longest.start, longest.length, longest.length if room is None else room[1] - room[0], first)


AT_RADIUS = " at the radius of {ratio:g} thicknesses that {house} asks"

DRAWN_LONGER = Case(
    "a tail of {measured:m,3} is asked for and {limit:m,3} are drawn: so much its leads take to come together, to "
    "spread to the contacts, and for the stiffener under them",
    "{words} is what is drawn; a shorter one wants fewer contacts",
)

NO_STRETCH = Case(
    "the tail has {have:m,3} free of vias, turns and stiffener{mount} for its {bend} bend{radius}", NO_ROOM,
    Severity.WARNING, Severity.ERROR,
)

SHORT = Case(
    "the tail has {have:m,3} free of vias, turns and stiffener{mount} for its {bend} bend; one by {angle} needs "
    "{limit:m,3}{radius}", NO_ROOM, Severity.WARNING, Severity.ERROR,
)

STRAIGHT_FOR = Case(
    "tracks turn or change their width in a part of the bend zone; in the rest, {have:m,3} from x = {start:m,4} on, "
    "they run straight at one width", "all bends of the drawing lie there: bend the tail nowhere else", Severity.NOTE,
)

STRAIGHT_BUT_SHORT = Case(
    "tracks turn or change their width in a part of the bend zone; in the rest, {have:m,3} from x = {start:m,4} on, "
    "they run straight at one width, and a bend by {angle}{mount} needs {limit:m,3}{radius}", NO_ROOM, Severity.WARNING,
    Severity.ERROR,
)

MISPLACED = Case(
    "the bend about x = {line:m,4} takes the tail from x = {start:m,4} to {end:m,4} and reaches {measured:m,3} into "
    "{into}", hint="fpc.tail.bend.at has room {room}; or leave it out", severity=Severity.WARNING, grave=Severity.ERROR,
)

TOO_SHARP = Case(
    "a {bend} bend of {measured:m,3} inside radius is sharper than the {thicknesses:g} thicknesses that {house} asks: "
    "{limit:m,3}", hint="a larger fpc.tail.bend.radius, or leave it out", severity=Severity.WARNING,
)

NOT_LET_DOWN = Case(
    "the tail is too short for the two bends by which it is let down to what carries the mount",
    "a longer fpc.tail.length, or a smaller mount.standoff", Severity.WARNING,
)

BEYOND_STRAIGHT = Case(
    "the mount bends the tail from x = {start:m,4} to {last:m,4}, its tracks run straight as far as {straight:m,4}: "
    "{measured:m,3} too much",
    "a longer fpc.tail.length, a smaller mount.standoff, or a mount that ends nearer to the board", Severity.WARNING,
)

IN_BEND = Case(
    "{what} reaches {measured:m,3} into the bend zone",
    hint=("lengthen the tail, so that it lies outside the bend, or do without a bend (fpc.tail.bend: none)"),
)

GRAIN = 0.05e-3
"""Margins are named in steps of this (m)."""


def special_build(design: Design) -> Iterator[Verdict]:
    """What is special about a tail of fewer layers than the body, or about buttons; what the plain build would cost."""
    layout, spec = design.layout, design.spec
    last, count, tail = tail_copper(layout), layout.copper_layers, spec.fpc.tail
    stackup = spec.fpc.stackup.built(spec.fpc.stackup.plating, 0)
    if tail is None or last == count:
        if layout.vias and stackup.plating is Plating.BUTTONS:
            panel = _copper(stackup.built(Plating.PANEL, 0))
            yield BUTTONS.found("fpc.plated", copper=_copper(stackup), panel=panel)
        return
    plain = replace(spec, fpc=replace(spec.fpc, stackup=stackup, tail=replace(tail, layers=count)))
    radii = [least_bend_radius(each) for each in (spec, plain)]
    bent = f" and bends to {um(radii[1])} instead of {um(radii[0])}" if radii[0] and radii[1] else ""
    yield SPECIAL.found("fpc.tail.layers", float(last), float(count), last=last, s="s" * (last > 1), count=count,
                        build=build_text(layout), copper=_copper(spec.fpc.stackup), plain_copper=_copper(stackup),
                        plain=tail_thickness(plain), thin=tail_thickness(spec), bent=bent)


def _copper(stackup: Stackup) -> str:
    """Finished copper from the top, like 30/18/18/30 um."""
    return "/".join(f"{layer.thickness * 1e6:.4g}" for layer in stackup.copper) + " um"


def step(design: Design) -> Iterator[Verdict]:
    """Holes and turns beside the place where the lower layers end and the tail's own coverlay laps in between."""
    layout, rules = design.layout, design.spec.fpc.rules
    if tail_copper(layout) == layout.copper_layers:
        return
    end = layout.body[2]
    through = [via for via in layout.vias if via.lowest is None]
    near = max(through, key=lambda via: via.centre.x + via.drill / 2.0, default=None)
    gap = math.inf if near is None else end - near.centre.x - near.drill / 2.0
    if near is not None and gap < rules.hole_to_step - ROUNDING:
        values = {"net": near.net, "ending": tail_copper(layout) + 1, "house": house(design, "hole_to_step")}
        place = Place(*near.centre, nets=(near.net,))
        yield _too_near(design, HOLE_NEAR_STEP, gap, rules.hole_to_step, "hole_to_step", place, values)
    asked = rules.coverlay_lap + rules.registration
    reach = {p.name: Ring(design.spec.coil, p, 0.0).half_size[0] for p in design.spec.array.placements}
    coil = max(layout.coils, key=lambda coil: coil.centre.x + reach[coil.name])
    gap = end - coil.centre.x - reach[coil.name]
    if has_tail_coverlay(layout) and gap < asked - ROUNDING:
        values = {"coil": coil.name, "lap": rules.coverlay_lap, "registration": rules.registration}
        place = Place(*coil.centre, nets=(coil.net,))
        yield _too_near(design, TURNS_NEAR_STEP, gap, asked, "coverlay_lap", place, values)


def _too_near(
    design: Design, case: Case, gap: float, asked: float, field: str, place: Place, values: dict[str, Any]
) -> Violation:
    """The complaint for something too near to the step in thickness, and a longer body as the way out."""
    missing, margin = asked - gap, design.spec.fpc.margin
    longer = GRAIN * math.ceil((margin[0] + missing) / GRAIN - 1e-6)
    other = f"or as many layers in the tail (the step is {um(step_height(design.layout))} high)"

    written = f"[{longer * 1e3:g}, {margin[1] * 1e3:g}]"
    fix = setting(design.spec, "fpc.margin", (longer, margin[1]), written)
    if design.spec.fpc.body is not None:
        fix = larger_body(design.spec, longer)

    def advice(left: Left) -> str:
        return f"{um(missing)} are missing: {fix.words} makes the body longer{tried(fix, left)}, {other}"

    return case.found("fpc.tail.layers", gap, asked, "m", source=source_of(design, field), place=place, advice=advice,
                      missing=missing, longer=fix.words, other=other, **values)


LONGER_BODY = "{missing:m} are missing: {longer} makes the body longer, {other}"

HOLE_NEAR_STEP = Case(
    "a hole of {net} stands {measured:m} from the body's end, where copper {ending} and what is below it end; {house} "
    "asks {limit:m}", LONGER_BODY,
)

TURNS_NEAR_STEP = Case(
    "the turns of {coil} begin {measured:m} from the body's end, into which the tail's own coverlay laps {lap:m}, laid "
    "within {registration:m}: layers lie farther apart there", LONGER_BODY,
)


SPECIAL = Case(
    "a tail of {last} copper layer{s} on a body of {count} is a special build; finished copper {copper}",
    "a house makes the plain build without being asked (leave fpc.tail.layers out: one lamination, through holes only, "
    "finished copper {plain_copper}); its tail is {plain:m} thick instead of {thin:m}{bent}. For this one, have the "
    "steps confirmed with the quotation", detail="{build}",
)


BUTTONS = Case(
    "holes and their pads alone are plated (buttons), so that the tracks stay {copper} of foil: a build to ask for",
    "a house plates the whole panel without being asked, which finishes the copper at {panel} (fpc.plated: panel; the "
    "preset flex-2l-30um is such a board): have the buttons confirmed with the quotation",
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT123", bend_zone, "tail"),
    rule_of("SIT133", tail_length, "tail"),
    rule_of("SIT130", step, "tail"),
    rule_of("SIT132", special_build),
)
