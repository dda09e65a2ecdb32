"""SIT117, SIT123, SIT124 and SIT126 to SIT130: the tail's bend, its step in thickness, its end and its contacts.

SIT123 checks that the bent part of the tail is long enough, has straight tracks and has no stiff parts. SIT130 checks
copper near the step at the body's end if the tail has fewer layers. The other rules check the tail's end against the
connector, and the contacts' finish.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

from sitscad.assembly.places.tail_path import TOO_SHORT, bends_of_mount, stated_bend, stated_bend_range, tail_path
from sitscad.basics.finding import Edit, Place, Severity
from sitscad.basics.record import record
from sitscad.checks.board.clearances import edge_crossings
from sitscad.checks.board.fabrication import limit_document
from sitscad.checks.fixes.moves import larger_body, reread_changes, thinner_tails
from sitscad.checks.fixes.search import Family, FamilyByAmount, Fix, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, not_checked, rule_of, violation_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Path, Segment, bounding_box
from sitscad.layout.bending import (
    Bend,
    Where,
    bend_figure,
    bend_length,
    finished_thickness,
    least_bend_radius,
    longest_straight,
    tail_thickness,
    unfit_for_bending,
)
from sitscad.layout.board import Pad, Stiffener, Trace
from sitscad.layout.lamination import lamination_text
from sitscad.layout.lanes import Ring
from sitscad.layout.tail.frame import contact_row
from sitscad.spec import presets
from sitscad.spec.circuit import Connector, FpcSpec, Plating, Stackup, Tail
from sitscad.spec.presets import finish, is_rigid, stock_stiffeners
from sitscad.spec.sensor import SensorSpec

LENGTH_GRAIN, LONGEST = 0.1e-3, 5.0
"""Rounding step (m) of tail lengths in hints, and largest length (m) of a tail that a spec may have."""

FIRST_ROOM = 1e-3
"""Smallest length (m) that is added in trials to a tail without a part for its bend."""

GRAIN = 0.05e-3
"""Rounding step (m) of the margins that hints propose."""


@record
class _StraightPart:
    """Longest part of the bend zone in which all tracks are straight and of constant width.

    The bend zone is the part of the tail without stiff items. ``start`` is the position (m) along the tail where the
    longest part begins, and ``length`` (m) is its length. The mount's own bends take some of this length; ``room`` (m)
    is the rest, which the bend in the spec can use. ``unfit`` is the first place with tracks that are not straight,
    None if there is none.
    """

    start: float
    length: float
    room: float
    unfit: Place | None


def bend_zone(design: Design) -> Iterator[Verdict]:
    """Yield findings on a tail that cannot be bent as the spec or the mount bends it.

    There are findings on stiff items in the bend zone, and on a zone too short for the bends. Others are on a bend at
    an unsuitable place, and on a bend radius below the fabricator's minimum.
    """
    zone, tail = design.layout.bend_zone, design.spec.fpc.tail
    assert tail is not None
    if tail.bend == "none":
        yield not_checked("no-bend")
        return
    if is_rigid(design.spec.fpc.stackup):
        yield not_checked("no-bend-zone")
        return
    layout, spec = design.layout, design.spec
    if zone is not None:
        # A violation for every via, contact and stiffener inside the bend zone (x from and to, m)
        stiff = [(f"a via of {v.net}", v.centre.x, v.pad / 2, Place(*v.centre, None, (v.net,))) for v in layout.vias]
        stiff += [(f"contact {pad.name}", pad.centre.x, pad.size[0] / 2, Place(*pad.centre, pad.layer, (pad.net,)))
                  for pad in layout.all_pads]
        if layout.stiffener is not None:
            x0, y0, x1, y1 = bounding_box([layout.stiffener.outline.outline])
            stiff += [("the stiffener", (x0 + x1) / 2, (x1 - x0) / 2, Place(max(x0, zone[0]), (y0 + y1) / 2))]
        for item, middle, half, place in stiff:
            inside = min(middle + half, zone[1]) - max(middle - half, zone[0])
            if inside > ROUNDING:
                yield violation_of("stiff-in-bend", "fpc.tail.bend", inside, 0.0, "m", place=place, item=item)
    room, path, bends = stated_bend_range(layout), tail_path(layout), bends_of_mount(layout)
    straight = _longest_straight(zone, room, layout.in_bend_zone, layout.traces)
    end = straight.start + straight.length
    if path is not None and path.reason == TOO_SHORT:
        yield violation_of("mount-bends-short", "fpc.tail.length", severity=Severity.WARNING)
    elif bends and bends[-1].end > end + ROUNDING:
        line = bends[-1].line
        yield violation_of(
            "mount-bends", "fpc.tail.length", bends[-1].end - end, 0.0, "m", severity=Severity.WARNING,
            place=Place(line, sum(layout.reach_at(line)) / 2), start=bends[0].start, end=bends[-1].end, straight=end,
        )
    lacking = max(bend_length(spec.fpc) - max(0.0, straight.room), FIRST_ROOM if zone is None else 0.0)
    # a longer tail does not help if leads or vias have no room
    fixes = () if layout.shortfalls else _longer_tails(spec, layout.tail_length, lacking)
    yield from _short_bend_zone_findings(spec.fpc, zone, straight, bends[-1].end if bends else None, fixes)
    bend = stated_bend(layout)
    if zone is not None and bend is not None and room is not None and tail.bend_at is not None:
        yield from _misplaced_bend_findings(zone, bend, room, layout.body[2], layout.reach_at)
    yield from _sharp_bend_findings(spec)


def _short_bend_zone_findings(
    fpc: FpcSpec, zone: tuple[float, float] | None, straight: _StraightPart, mount_end: float | None,
    fixes: tuple[Family, ...],
) -> Iterator[Violation]:
    """Yield a violation if the tail has no straight part that is long enough for its bend.

    `zone` is the bend zone (from, to; m), None if there is no bend zone. `straight` is its longest part with straight
    tracks. `mount_end` (m) is the end of the bends that the mount needs, None if it needs none. `fixes` are families of
    longer tails.
    """
    tail, needed, figure = fpc.tail, bend_length(fpc), bend_figure(fpc)
    assert tail is not None
    fits = zone is not None and straight.room >= needed - ROUNDING
    place = None if straight.unfit is None else replace(straight.unfit, x=straight.start)
    if fits:
        if place is not None:
            yield violation_of("bend-tracks", "fpc.tail.bend", straight.length, needed or None, "m",
                               severity=Severity.NOTE, place=place, start=straight.start)
        return
    field, ratio = figure or ("", 0.0)
    # an error if no part of the tail this long, straight or not, is free of stiff items
    start = max([zone[0] if zone else 0.0, mount_end or 0.0])
    has_room = zone is not None and zone[1] - start >= needed - ROUNDING
    details = (*["bend-room-radius"] * (figure is not None), *["bend-room-mount"] * (mount_end is not None),
               *["bend-room-tracks"] * (place is not None))
    yield violation_of(
        "bend-room" if needed else "bend-room-unknown", "fpc.tail.length", straight.room, needed, "m", details=details,
        severity=Severity.WARNING if has_room else Severity.ERROR, place=place,
        source=fpc.rules.source_of(field) if figure else None, bend=tail.bend, angle=tail.bend_angle,
        room=max(0.0, straight.room), ratio=ratio, house=limit_document(fpc.rules, field) if figure else "",
        start=straight.start, fixes=fixes,
    )


def tail_length(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the drawn tail is longer than ``fpc.tail.length``, because its parts need more length."""
    tail, drawn_length = design.spec.fpc.tail, design.layout.tail_length
    assert tail is not None
    if drawn_length > tail.length + ROUNDING:
        needed = LENGTH_GRAIN * math.ceil(drawn_length / LENGTH_GRAIN - 1e-6)
        fix = with_value(design.spec, "fpc.tail.length", needed, f"{needed * 1e3:.1f} mm")
        yield violation_of("tail-length", "fpc.tail.length", tail.length, drawn_length, "m", fixes=(lambda: [fix],),
                           length=f"{needed * 1e3:.1f} mm")


def _misplaced_bend_findings(
    zone: tuple[float, float], bend: Bend, room: tuple[float, float], body_end: float,
    reach_at: Callable[[float], tuple[float, float]],
) -> Iterator[Violation]:
    """Yield a finding if the bend, at the place that the spec gives, does not lie in the part that may be bent.

    `zone` is the part of the tail without stiff items, and `room` the part that the mount's bends leave free. Both are
    (from, to; m) along x. `body_end` (m) is the x at which the body ends. `reach_at` returns the lowest and highest y
    (m) of the board at an x (m).
    """
    beyond = max(room[0] - bend.start, bend.end - room[1])
    if beyond > ROUNDING:
        half, (low, high) = (bend.end - bend.start) / 2, (x - body_end for x in room)
        is_stiff = max(zone[0] - bend.start, bend.end - zone[1]) > ROUNDING
        yield violation_of(
            "bend-at-stiff" if is_stiff else "bend-at-tracks", "fpc.tail.bend.at", beyond, 0.0, "m",
            hint="bend-at-room" if high - low > 2 * half else "bend-at-nowhere", line=bend.line, start=bend.start,
            end=bend.end, low=low + half, high=high - half, place=Place(bend.line, sum(reach_at(bend.line)) / 2),
            severity=Severity.ERROR if is_stiff else Severity.WARNING,
        )


def _sharp_bend_findings(spec: SensorSpec) -> Iterator[Violation]:
    """Yield a warning if the bend radius in the spec is smaller than the fabricator's minimum."""
    tail, least, figure = spec.fpc.tail, least_bend_radius(spec.fpc), bend_figure(spec.fpc)
    if tail is None or tail.bend_radius is None or least is None or figure is None:
        return
    if tail.bend_radius < least - ROUNDING:
        rounder = math.ceil(least * 1e5 - 1e-6) * 1e-5  # rounded as written
        changed = with_value(spec, "fpc.tail.bend_radius", rounder, "").spec
        fix = Fix((Edit("fpc.tail.bend.radius", f"{rounder * 1e3:.6g}"),), changed)
        yield violation_of(
            "bend-radius-small", "fpc.tail.bend.radius", tail.bend_radius, least, "m", severity=Severity.WARNING,
            source=spec.fpc.rules.source_of(figure[0]), fixes=(lambda: [fix],), bend=tail.bend, ratio=figure[1],
            house=limit_document(spec.fpc.rules, figure[0]),
        )


def _longer_tails(spec: SensorSpec, tail_length: float, missing: float) -> tuple[Family, ...]:
    """Return the family of changes to a longer tail.

    `tail_length` is the present length (m), and `missing` the least length (m) that is added.
    """

    def longer(by: float) -> Fix:
        length = LENGTH_GRAIN * math.ceil((tail_length + by) / LENGTH_GRAIN - 1e-6)
        fix = with_value(spec, "fpc.tail.length", length, f"{length * 1e3:.1f} mm")
        return fix if length <= LONGEST else Fix((), spec)

    return (FamilyByAmount(longer, missing, LENGTH_GRAIN),)


def _longest_straight(
    zone: tuple[float, float] | None, room: tuple[float, float] | None,
    in_bend_zone: tuple[tuple[Trace, Segment], ...], traces: tuple[Trace, ...],
) -> _StraightPart:
    """Return the longest part of the bend zone with straight tracks. All lengths are 0 if there is no bend zone.

    `zone` is the bend zone, and `room` the part that the mount's bends leave free. Both are (from, to; m) along x.
    `in_bend_zone` are the pieces of tracks in the bend zone, and `traces` all tracks.
    """
    if zone is None:
        return _StraightPart(0.0, 0.0, 0.0, None)
    unfit = unfit_for_bending(zone, in_bend_zone, traces)
    longest = longest_straight(zone, unfit)
    first = next((Place(each.first, each.y, each.layer, (each.net,)) for each in unfit), None)
    return _StraightPart(longest.start, longest.length, longest.length if room is None else room[1] - room[0], first)


def special_build(design: Design) -> Iterator[Verdict]:
    """Yield a finding on a board that must be agreed with the fabricator, and describe the usual board for comparison.

    Such a board has a tail with fewer layers than the body, or plating only on holes and their pads.
    """
    layout, spec = design.layout, design.spec
    last, count, tail = layout.spec.fpc.tail_copper, layout.copper_layers, spec.fpc.tail
    stackup = spec.fpc.stackup.built(spec.fpc.stackup.plating, 0)
    if tail is None or last == count:
        if layout.vias and stackup.plating is Plating.BUTTONS:
            yield violation_of("buttons", "fpc.plated", copper=_copper_text(stackup),
                               panel=_copper_text(stackup.built(Plating.PANEL, 0)))
        return
    plain = replace(spec.fpc, stackup=stackup, tail=replace(tail, layers=count))
    radius, plain_radius = least_bend_radius(spec.fpc), least_bend_radius(plain)
    yield violation_of(
        "tail-layers", "fpc.tail.layers", float(last), float(count),
        details=("tail-layers-plain", *["tail-layers-bends"] * bool(radius and plain_radius)), layers=last,
        copper=_copper_text(spec.fpc.stackup), plain=_copper_text(stackup), thickness=tail_thickness(spec.fpc),
        plain_thickness=tail_thickness(plain), radius=radius, plain_radius=plain_radius,
        steps=lamination_text(layout),
    )


def _copper_text(stackup: Stackup) -> str:
    """Return the thickness of each copper layer with its plating, from the top, as text such as "30/18/18/30 um"."""
    return "/".join(f"{layer.thickness * 1e6:.4g}" for layer in stackup.copper) + " um"


def layer_step(design: Design) -> Iterator[Verdict]:
    """Yield findings on holes and turns too near to the step at the body's end.

    The step is the place at which the lower copper layers end, if the tail has fewer layers than the body. The limits
    are the fabricator's distance from hole to step, and the length by which the tail's coverlay overlaps the body.
    """
    layout, rules, end = design.layout, design.spec.fpc.rules, design.layout.body[2]
    if layout.spec.fpc.tail_copper == layout.copper_layers:
        return
    through = [via for via in layout.vias if via.lowest is None]
    near = max(through, key=lambda via: via.centre.x + via.drill / 2.0, default=None)
    gap = math.inf if near is None else end - near.centre.x - near.drill / 2.0
    minimum = rules.coverlay_lap + rules.coverlay_registration
    field, apart = "hole_to_step", rules.hole_to_step
    if layout.spec.fpc.has_tail_coverlay and minimum > apart:
        field, apart = "coverlay_lap", minimum
    if near is not None and gap < apart - ROUNDING:
        yield _near_step_violation("hole-to-step", design.spec, gap, apart, rules.source_of(field),
                                   Place(*near.centre, nets=(near.net,)), net=near.net,
                                   house=limit_document(rules, field), copper=layout.spec.fpc.tail_copper + 1)
    reach = {p.name: Ring(design.spec.coil, p, 0.0).half_size[0] for p in design.spec.all_placements}
    coil = max(layout.coils, key=lambda coil: coil.centre.x + reach[coil.name])
    gap = end - coil.centre.x - reach[coil.name]
    if layout.spec.fpc.has_tail_coverlay and gap < minimum - ROUNDING:
        yield _near_step_violation(
            "turns-to-step", design.spec, gap, minimum, rules.source_of("coverlay_lap"),
            Place(*coil.centre, nets=(coil.net,)), coil=coil.name, house=limit_document(rules, "coverlay_lap"),
            lap=rules.coverlay_lap, registration=rules.coverlay_registration,
        )


def _near_step_violation(
    case: str, spec: SensorSpec, gap: float, minimum: float, source: str, place: Place, **values: Any
) -> Violation:
    """Return the violation for a hole or coil at a distance `gap` (m), below `minimum`, from the step in thickness.

    The step is at the body's end. The proposed change is a longer body. `case` is the key of the texts in
    ``data/messages.csv``.
    """
    margin = spec.fpc.margin
    longer = GRAIN * math.ceil((margin[0] + (minimum - gap)) / GRAIN - 1e-6)
    fix = with_value(spec, "fpc.margin", (longer, margin[1]), f"[{longer * 1e3:g}, {margin[1] * 1e3:g}]")
    if spec.fpc.body is not None:
        fix = larger_body(spec, longer)
    return violation_of(case, "fpc.tail.layers", gap, minimum, "m", hint="near-step", details=("near-step",),
                        source=source,
                        place=place, fixes=(lambda: [fix],), missing=minimum - gap, body_key=spec.fpc.body_key,
                        height=spec.fpc.tail_step, **values)


LONGEST_BAR = 1.5e-3
"""Largest distance (m) between a contact's end and the board's edge for which plating bars are assumed.

A plating bar connects a contact to the edge for electrolytic plating. Fabricators add such bars without a request.
"""

CLOSER_CUT = 2.0
"""Ratio of the usual tolerance of the outline to the tolerance of a more accurate cut, which can be requested.

A router cuts within +-0.1 mm, a steel die within +-0.05 mm (wellerpcba.com/flex-pcb-capability).
"""


def insertion_thickness(design: Design) -> Iterator[Verdict]:
    """Yield findings on the thickness at the contacts, with remaining coverlay and stiffener.

    The connector's range of insertion thickness is the limit.
    """
    connector = _connector(design.spec.fpc)
    required, allowed = connector.insertion_thickness, connector.insertion_thickness_tolerance
    if required <= 0.0:
        yield not_checked("solder-pads")
        return
    have, plate = finished_thickness(design.layout, Where.CONTACT).nominal, design.layout.stiffener
    wrong = abs(have - required)
    if wrong > allowed + ROUNDING:
        spec, unstiffened = design.spec, have - (plate.thickness if plate is not None else 0.0)
        names = [name for name in presets.names("connector") if name != connector.name]
        connectors, fixes = partial(reread_changes, spec, "fpc.tail.connector", names), tuple[Family, ...]()
        if unstiffened <= required + allowed + ROUNDING:
            hint = "insertion-thinner" if have > required else "insertion-thicker"
            plate_of = [f"{1e3 * (required - unstiffened):.6g}"] if required > unstiffened else []
            fixes = partial(reread_changes, spec, "fpc.tail.stiffener", plate_of), connectors
        elif presets.is_rigid(spec.fpc.stackup):
            hint, fixes = "insertion-rigid", (partial(reread_changes, spec, "fpc.tail.connector", ["solder-pads"]),)
        else:
            hint, fixes = "insertion-bare", (partial(thinner_tails, spec), connectors)
        yield violation_of("insertion", "fpc.tail.connector", have, required, "m", hint=hint,
                           details=_unverified_connector_case(connector), source=connector.source, fixes=fixes,
                           connector=connector.name, tolerance=allowed, wrong=wrong)


def contact_worst_case(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the thickness at the contacts, with tolerance, can be outside the connector's range.

    There is a finding only if another stiffener would reduce the deviation. This is so if the deviation exceeds half a
    step between stock thicknesses. Smaller deviations occur with every connector and are stated in the order.
    """
    connector, pads = _connector(design.spec.fpc), design.layout.pads
    required, allowed = connector.insertion_thickness, connector.insertion_thickness_tolerance
    if required <= 0.0:
        yield not_checked("solder-pads")
        return
    band, low, high = finished_thickness(design.layout, Where.CONTACT), required - allowed, required + allowed
    worst = max((low - band.minimum, band.minimum), (band.maximum - high, band.maximum))
    # a stiffener from stock comes within half a step of the required thickness
    half_a_step = max(b - a for a, b in pairwise(_stock_thicknesses())) / 2
    if worst[0] > half_a_step + ROUNDING and low - ROUNDING <= band.nominal <= high + ROUNDING:
        yield violation_of(
            "contact-thickness", "fpc.tail.connector", worst[1], high if worst[1] == band.maximum else low, "m",
            details=_unverified_connector_case(connector), source=band.source,
            place=Place(*pads[0].centre, 1) if pads else None, minimum=band.minimum, maximum=band.maximum,
            low=low, high=high, wanted=required, tolerance=allowed,
            connector=connector.name,
        )


def _stock_thicknesses() -> list[float]:
    """Return the total thicknesses (m) of film and adhesive that are in stock for stiffeners, in ascending order."""
    return sorted({film + adhesive for film, adhesive in stock_stiffeners()})


def stiffener_stock(plate: Stiffener | None, tail: Tail | None) -> Iterator[Verdict]:
    """Yield a finding on a stiffener whose thickness differs from every film in stock with its adhesive."""
    totals = _stock_thicknesses()
    if tail is None or plate is None or plate.adhesive > 0.0:
        return
    near = sorted(totals, key=lambda total: (abs(total - plate.thickness), total))[:2]
    key, severity = "fpc.tail.connector", Severity.WARNING
    if tail.stiffener is not None:
        key, severity = "fpc.tail.stiffener", Severity.NOTE
    yield violation_of("stiffener-stock", key, plate.thickness, near[0], "m", severity=severity,
                       source="sitscad/data/stiffeners.csv", near=near, thinnest=totals[0], thickest=totals[-1])


def plug_width(pads: tuple[Pad, ...], wires: int, fpc: FpcSpec) -> Iterator[Verdict]:
    """Yield a finding if the outline's tolerance exceeds the connector's tolerance for the tail's width.

    There is a finding only if even the tolerance of the closer cut (`CLOSER_CUT`) exceeds it, because the order
    requests this cut anyway.
    """
    connector, rules = _connector(fpc), fpc.rules
    if connector.width_tolerance <= 0.0:
        yield not_checked("solder-pads")
        return
    if rules.outline_tolerance > CLOSER_CUT * connector.width_tolerance + ROUNDING:
        width = connector.width(contact_row(wires, fpc.tail, connector).count)
        yield violation_of(
            "plug-width", "fpc.tail.connector", rules.outline_tolerance, connector.width_tolerance, "m",
            details=_unverified_connector_case(connector, "width_tolerance"),
            source=rules.source_of("outline_tolerance"), place=Place(*pads[0].centre, 1) if pads else None, width=width,
            house=limit_document(rules, "outline_tolerance"), connector=connector.name,
        )


def connector_positions(wires: int, fpc: FpcSpec) -> Iterator[Verdict]:
    """Yield a finding if no connector of this type has the tail's number of contacts, or a note on unused contacts."""
    connector, tail = _connector(fpc), fpc.tail
    row, counts = contact_row(wires, fpc.tail, connector), connector.positions
    unverified = _unverified_connector_case(connector, "positions")
    if counts and row.count not in counts:
        is_written = tail is not None and tail.contacts is not None
        connectors = [name for name in presets.names("connector") if row.count in presets.connector(name).positions]
        hint = "positions-written" if is_written else "positions-coils"
        if connectors:
            hint = "positions-others-written" if is_written else "positions-others-coils"
        yield violation_of(
            "positions", "fpc.tail.contacts" if is_written else "fpc.tail.connector", float(row.count),
            float(counts[-1]), hint=hint, details=unverified, severity=Severity.WARNING if is_written else None,
            source=connector.source, connector=connector.name, fewest=counts[0], others=connectors,
        )
    elif counts and row.count > row.used:
        yield violation_of(
            "contacts-unused", "fpc.tail.connector", float(row.used), float(row.count), details=unverified,
            severity=Severity.NOTE, source=connector.source, connector=connector.name, first=row.first,
            last=row.first + row.used - 1,
        )


def _unverified_connector_case(connector: Connector, *fields: str) -> tuple[str, ...]:
    """Return the message case of the remark that values of a connector were not read from its drawing.

    `fields` are the names of the values. Empty if all were read from the drawing.
    """
    fields = fields or ("insertion_thickness", "insertion_thickness_tolerance")
    return ("plug-unverified",) if is_unverified(connector.source, *fields) else ()


def _connector(fpc: FpcSpec) -> Connector:
    assert fpc.tail is not None
    return fpc.tail.connector


def contact_finish(design: Design) -> Iterator[Verdict]:
    """Yield findings on a finish unsuitable for the contacts' use, and on the plating bars that it needs."""
    layout, fpc = design.layout, design.spec.fpc
    chosen = finish(fpc.finish)
    is_plugged = fpc.tail is not None and fpc.tail.connector.kind != "pads"
    as_enig = partial(reread_changes, design.spec, "fpc.finish", ["enig"])
    if not (chosen.is_for_plugs if is_plugged else chosen.is_for_solder):
        yield violation_of("finish-plugs" if is_plugged else "finish-solder", "fpc.finish", severity=Severity.WARNING,
                           source=chosen.source, fixes=(as_enig,), finish=fpc.finish)
    if chosen.is_electrolytic and layout.pads:
        apart = max(_distance_to_edge(layout.outline, pad) for pad in layout.pads)
        is_long = apart > LONGEST_BAR + ROUNDING
        yield violation_of(
            "plating-bars", "fpc.finish", hint="plating-bars-long" if is_long else "",
            severity=Severity.ERROR if is_long else Severity.WARNING, source=chosen.source,
            place=Place(*layout.pads[0].centre, 1), fixes=(as_enig,), finish=chosen.words, count=len(layout.pads),
            distance=apart, longest=LONGEST_BAR,
        )


def _distance_to_edge(outline: Path, pad: Pad) -> float:
    """Return the distance (m) from a contact's end to the outline.

    It is measured in the direction of the contact's longer side, towards the nearer edge.
    """
    half, corners, distances = max(pad.size) / 2, outline.flattened(1e-6), [math.inf]
    dx, dy = (1.0, 0.0) if pad.size[0] >= pad.size[1] else (0.0, 1.0)
    for sign in (-1.0, 1.0):  # up to one metre
        end = pad.centre.shifted(sign * half * dx, sign * half * dy)
        distances += edge_crossings(end, end.shifted(sign * dx, sign * dy), corners)
    return min(distances)


RULES: tuple[Rule, ...] = (
    rule_of("SIT123", bend_zone, "tail"), rule_of("SIT133", tail_length, "tail"), rule_of("SIT130", layer_step, "tail"),
    rule_of("SIT132", special_build),
    rule_of("SIT117", insertion_thickness, "tail"),
    rule_of("SIT124", contact_worst_case, "tail"),
    rule_of("SIT126", lambda design: plug_width(design.layout.pads, design.spec.artwork.wires, design.spec.fpc),
            "tail"),
    rule_of("SIT127", lambda design: connector_positions(design.spec.artwork.wires, design.spec.fpc), "tail"),
    rule_of("SIT129", lambda design: stiffener_stock(design.layout.stiffener, design.spec.fpc.tail), "tail"),
    rule_of("SIT128", contact_finish),
)
