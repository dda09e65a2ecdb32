"""SIT111 to SIT113, SIT118, SIT119, SIT135, SIT136 and SIT139: lack of room on a board or in an outline, and fixes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise
from typing import Any

from sitscad.assembly.places.bodies import film_thickness
from sitscad.assembly.places.seating import PLATE_CORNER, plate_plan
from sitscad.basics.finding import Missing, Place, Severity, Shortfall
from sitscad.checks.fixes import moves, references
from sitscad.checks.fixes.moves import SMALL_PARTS
from sitscad.checks.fixes.search import GROWTH, CostlyFamily, Family, FamilyByAmount, Fix, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.convex import Box, signed_distance
from sitscad.kernels.geometry.path import bounding_box, rectangle
from sitscad.layout import arrange
from sitscad.layout.board import Layout
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.layout.outline import edge_room
from sitscad.layout.windings import no_inner_room
from sitscad.spec.circuit import BodySpec
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.resolver.coils import reference_coil_key
from sitscad.spec.sensor import ArtworkSpec, SensorSpec

GRAIN = 100e-6
"""Smallest length (m) by which trials change coils or body, if the missing length is unknown."""


def missing_room_rule(what: Missing) -> Callable[[Design], Iterator[Verdict]]:
    """Return the function of a rule that yields a violation for each place without room of the kind `what`."""

    def reported(design: Design) -> Iterator[Verdict]:
        return (_room_violation(design.spec, lack) for lack in design.layout.shortfalls if lack.what is what)

    return reported


def _with_needed_size(artwork: ArtworkSpec, lack: Shortfall) -> Shortfall:
    """Return `lack` (missing room), with the needed size (m) added if trials can find it.

    Trials are made only for vias inside a coil. The coil is enlarged by each length of `GROWTHS`, until all inner vias
    and their stubs have room.
    """
    if lack.what is not Missing.INNER_ROOM or lack.need is not None or lack.have is None:
        return lack
    placement = artwork.array.placements[-1 if "own" in dict(lack.facts) else 0]
    coil = placement.own or artwork.coil
    alone = replace(artwork, array=replace(artwork.array, placements=(replace(placement, own=None),)))
    for growth in GROWTHS:
        size = (coil.size[0] + growth, coil.size[1] + growth)
        if moves.inner_vias_fit(replace(alone, coil=replace(coil, size=size))):
            return no_inner_room(int(str(dict(lack.facts)["count"])), lack.have, lack.have + growth)
    return lack


GROWTHS = (50e-6, 100e-6, 200e-6, 400e-6)
"""Increases (m) of a coil's outer size that are tried, in this order, to find the room for its inner vias."""


def lead_gap(
    placements: tuple[CoilPlacement, ...], coil: CoilSpec, rules: DesignRules
) -> tuple[float, float] | None:
    """Return (present gap, needed gap) in metres between the two nearest coils. None for a single coil.

    The needed gap has room for one more via or lead.
    """
    length, width = coil.size
    if len(placements) == 1:
        return None
    a, b = min(combinations(placements, 2), key=lambda pair: math.dist(pair[0].centre, pair[1].centre))
    gap = math.dist(a.centre, b.centre) - length
    if coil.outline.is_long:
        dx, dy = b.centre[0] - a.centre[0], b.centre[1] - a.centre[1]
        cosine, sine = math.cos(a.rotation), math.sin(a.rotation)
        gap = max(abs(cosine * dx + sine * dy) - length, abs(cosine * dy - sine * dx) - width)
    width = coil.trace_width
    keep = hole_keep_out(joined_hole(rules, width), rules, rules.trace_spacing)
    return gap, max(2.0 * keep, gap) + width + rules.trace_spacing


def body_gap(artwork: ArtworkSpec) -> tuple[float, float] | None:
    """Return (present room, needed room) in metres between the coils and the body's edge.

    The needed room is sufficient for one more lead or via. None if the spec gives no outline of the body.
    """
    edge = artwork.body_outline
    if edge is None:
        return None
    rules, pitch = artwork.fpc.rules, artwork.coil.trace_width + artwork.fpc.rules.trace_spacing
    gap, hole = min(edge_room(artwork, edge).values()), joined_hole(rules, artwork.coil.trace_width)
    via = hole_keep_out(hole, rules, rules.trace_spacing) + 0.5 * hole.pad + rules.copper_to_edge
    lead = rules.copper_to_edge + pitch
    return gap, min(room for room in (lead, via, max(gap, via) + pitch) if room > gap + ROUNDING)


def _room_violation(spec: SensorSpec, shortfall: Shortfall) -> Violation:
    """Return the violation for a shortfall of room, with changes that may make room."""
    lack, of_rules = _with_needed_size(spec.artwork, shortfall), f"and spacing of the rules {spec.fpc.rules.name}"
    if lack.what is Missing.LEAD_ROOM:
        return _lead_room_violation(spec, lack)
    # key and source (None: the rule's)
    texts: dict[Missing, tuple[str, str | None]] = {
        Missing.WAY_OUT: ("coil.layers", None),
        Missing.INNER_ROOM: ("coil.turns", f"via pad {of_rules}"),
        Missing.TAIL_LAYERS: ("fpc.tail.layers", None),
        Missing.TAIL_ROOM: ("fpc.tail.connector" if spec.fpc.tail else "fpc",
                            f"{'via pad' if lack.need is None else 'trace'} {of_rules}"),
        Missing.BODY_ROOM: ("fpc.body", None),
        Missing.THERMISTOR_ROOM: ("readout.thermistor.at", of_rules.removeprefix("and ")),
    }
    key, source = texts[lack.what]
    facts: dict[str, Any] = dict(lack.facts)
    if "own" in facts:
        key = reference_coil_key(key)
    return violation_of(lack.case, key, lack.have, lack.need, lack.unit, source=source, place=lack.place,
                        fixes=_changes_for_room(spec, shortfall), **facts)


def _lead_room_violation(spec: SensorSpec, lack: Shortfall) -> Violation:
    """Return the violation for leads without room: between the coils, or between the coils and the body's edge."""
    between, beside = lead_gap(spec.array.placements, spec.coil, spec.fpc.rules), body_gap(spec.artwork)
    is_in_body = beside is not None and (between is None or beside[0] * between[1] < between[0] * beside[1])
    gap, is_single = beside if is_in_body else between, between is None
    case = "lead-room" if gap is None else "lead-room-body" if is_in_body else "lead-room-gap"
    key = "fpc.body" if is_in_body else "coil.start_angle" if is_single else spec.array.distance_key
    have, need = gap or (None, None)
    return violation_of(
        case, key, have, need, "m" if gap else None, hint="lead-room" if is_single else "lead-room-coils",
        source=f"via pad and spacing of the rules {spec.fpc.rules.name}", place=lack.place,
        fixes=_changes_for_room(spec, lack), coils=dict(lack.facts)["coils"],
        body=spec.fpc.body.written if spec.fpc.body else "",
    )


def unrouted_leads(design: Design) -> Iterator[Verdict]:
    """Yield findings on coils whose leads the router could not draw, or that are not connected to two contacts."""
    yield from missing_room_rule(Missing.WAY_OUT)(design)
    unled = [coil for coil in design.layout.coils if not coil.is_closed_circuit]
    if unled and not design.layout.shortfalls:
        yield violation_of("no-way-out", "coil.layers", place=Place(*unled[0].centre),
                           coils=[coil.name for coil in unled])


def _changes_for_room(spec: SensorSpec, lack: Shortfall) -> tuple[Family, ...]:
    """Return the families of changes that may make room for the item that `lack` describes."""
    missing, body = lack.missing, spec.fpc.body
    wider = FamilyByAmount(partial(moves.larger_body, spec),
                           GRAIN if missing is None else missing + moves.lead_room(spec.array.placements, spec.coil,
                                                                                   spec.fpc.rules))
    if "own" in dict(lack.facts):
        return (partial(references.fewer_own_turns, spec),)
    has_reference = lack.what is Missing.LEAD_ROOM and spec.array.reference is not None
    of_reference = [partial(each, spec) for each in (references.farther_references, references.smaller_references)
                    if has_reference]
    match lack.what:
        case Missing.INNER_ROOM:
            more = max(missing or 0.0, 0.5 * spec.fpc.rules.via_pad)
            return (CostlyFamily(partial(moves.turns_with_room_for_vias, spec, spec.coil.most_turns, FEWER)),
                    FamilyByAmount(partial(moves.larger_coils, spec), more,
                                   fits=lambda changed: moves.inner_vias_fit(changed.artwork), is_costly=True))
        case Missing.LEAD_ROOM if body is not None and body.size is not None:
            # changes inside the specified outline come first, and cheap trials first: trials that end in a board
            inside = [FamilyByAmount(partial(move, spec), GRAIN)
                      for move in (moves.coils_farther_apart, moves.smaller_coils)]
            return (*of_reference, *inside[len(spec.array.placements) == 1 :], partial(moves.moved_layer_ends, spec),
                    wider)
        case Missing.LEAD_ROOM if len(spec.array.placements) > 1:
            first = moves.lead_room(spec.array.placements, spec.coil, spec.fpc.rules)
            return (*of_reference, FamilyByAmount(partial(moves.coils_farther_apart, spec), first),
                    partial(moves.moved_layer_ends, spec), partial(_separated_turned_coils, spec, GROWTH * first))
        case Missing.LEAD_ROOM:
            return *of_reference, partial(moves.moved_layer_ends, spec)
        case Missing.TAIL_ROOM:
            return (partial(moves.larger_connectors, spec, "pitch"),)
        case Missing.TAIL_LAYERS:
            return (partial(moves.reread_change, spec, "fpc.tail.layers", 2),)
        case Missing.BODY_ROOM:
            return (wider,)
        case Missing.THERMISTOR_ROOM:
            return (partial(moves.reread_changes, spec, "readout.thermistor.part", SMALL_PARTS),
                    partial(moves.reread_change, spec, "readout.thermistor.at", "tail"))
    return ()


FEWER = 2
"""Number of designs with fewer turns that are tried to make room inside the coil."""


def _separated_turned_coils(spec: SensorSpec, by: float) -> Iterator[Fix]:
    """Yield changes to coils farther apart by the length `by` (m), each with another start angle of the winding."""
    farther = moves.coils_farther_apart(spec, by)
    yield from map(farther.with_also, moves.other_start_angles(farther.spec))


def within_largest(design: Design) -> Iterator[Verdict]:
    """Yield findings on a body, tail or bench plate that is larger than the largest permitted outline ``fpc.largest``.

    The body may have any place in this outline, unless the outline is drawn. The place of a drawn outline relative to
    the coils is fixed. Findings on tail and bench plate are notes, because the outline limits the body alone.
    """
    spec, largest = design.spec, design.spec.fpc.largest
    if largest is None:
        return
    edge, body = design.layout.largest_outline, design.layout.body_outline
    assert edge is not None
    over, (x0, y0, x1, y1) = max(signed_distance(edge, point) for point in body.flattened(1e-6)), bounding_box([body])
    if over > ROUNDING:
        # the outline may be written as the body's own if everything has room in it
        yield violation_of(
            "largest-body", "fpc.largest", over, 0.0, "m", size=(x1 - x0, y1 - y0), largest=largest.written,
            hint=lambda: "" if arrange(_with_largest_body(spec, largest).spec).shortfalls else "largest-as-body",
            fixes=_changes_within_largest(spec, largest, over, (x1 - x0, y1 - y0)),
        )
    yield from _wide_tail_note(design.layout, largest)
    if spec.mount is not None and spec.mount.kind == "bench-plate":
        plate = plate_plan(design.layout, film_thickness(spec.encapsulation))
        yield from _large_plate_note(plate, spec.array.middle, largest)


def _wide_tail_note(layout: Layout, largest: BodySpec) -> Iterator[Violation]:
    """Yield a note if the tail or its contacts are wider than `fpc.largest`, which limits the body alone.

    Empty for a tail that leaves the body at an angle, and for a drawn outline, because these have no comparable width.
    """
    tail, size = layout.spec.fpc.tail, largest.size
    if tail is None or tail.turn != "none" or size is None:
        return
    places = sorted({point.x for point in layout.outline.flattened(1e-5) if point.x > layout.body[2] + ROUNDING})
    widths = [high - low for low, high in map(layout.reach_at, (0.5 * (a + b) for a, b in pairwise(places)))]
    widest, end, limit = max(widths, default=0.0), widths[-1:], size[1]
    if widest <= limit + ROUNDING:
        return
    has_end = end[0] > limit + ROUNDING
    plugs = moves.narrower_plugs(layout.spec, end[0]) if has_end else []
    width = end[0] if has_end else widest
    yield violation_of(
        "wide-end" if has_end else "wide-tail", "fpc.tail.connector" if has_end else "fpc.tail", width, limit, "m",
        hint="wide-end-plugs" if plugs else "", severity=Severity.NOTE, largest=largest.written,
        connector=tail.connector.name, contacts=len(layout.pads), plug=plugs[0][1].words if plugs else "",
        plug_width=plugs[0][0] if plugs else 0.0, fixes=(lambda: [fix for _, fix in plugs],) if plugs else (),
    )


def _large_plate_note(plate: Box, middle: tuple[float, float], largest: BodySpec) -> Iterator[Violation]:
    """Yield a note if the bench plate does not lie in `fpc.largest`, which limits the board alone.

    `plate` is the plate's box (m), and `middle` the mean of the coils' centres (m). The plate's centre is placed on the
    outline's centre, in both orientations. If the outline is drawn, the plate is compared at its own place.
    """
    x0, y0, x1, y1 = plate
    (x, y), lying, upright = middle, (x1 - x0, y1 - y0), (y1 - y0, x1 - x0)
    plates = [rectangle(x0 - x, y0 - y, x1 - x, y1 - y, PLATE_CORNER)]
    if largest.shape != "dxf":
        plates = [rectangle(-a / 2, -b / 2, a / 2, b / 2, PLATE_CORNER) for a, b in (lying, upright)]
    over = min(max(signed_distance(largest.edge, corner) for corner in outline.flattened(1e-6)) for outline in plates)
    if over > ROUNDING:
        yield violation_of("largest-plate", "fpc.largest", over, 0.0, "m", severity=Severity.NOTE,
                           size=(x1 - x0, y1 - y0), largest=largest.written)


def _with_largest_body(spec: SensorSpec, largest: BodySpec) -> Fix:
    """Return the change that sets the body's outline to the largest allowed outline (``fpc.largest``)."""
    return with_value(replace(spec, fpc=replace(spec.fpc, margin=(0.0, 0.0))), "fpc.body", largest, largest.written)


def _changes_within_largest(
    spec: SensorSpec, largest: BodySpec, over: float, have: tuple[float, float]
) -> tuple[Family, ...]:
    """Return families of changes after which the body lies in the largest outline ``fpc.largest``.

    The first makes this outline the body's outline, the second makes the coils smaller, and the third does both. `over`
    is the length (m) by which the body extends beyond the outline, and `have` the present size (x, y; m) of the body.
    """
    as_asked = _with_largest_body(spec, largest)
    keeps_length = largest.size is not None and have[0] <= largest.size[0] + ROUNDING

    smaller = partial(moves.smaller_coils, keeps_length=keeps_length)
    by = max(GRAIN, over)

    def both(less: float) -> Fix:
        also = smaller(as_asked.spec, less)
        return as_asked.with_also(also) if also.edits else also

    only_smaller = FamilyByAmount(partial(smaller, spec), by, is_costly=True)
    return lambda: [as_asked], only_smaller, FamilyByAmount(both, by, is_costly=True)


RULES: tuple[Rule, ...] = (
    rule_of("SIT111", unrouted_leads),
    rule_of("SIT112", missing_room_rule(Missing.INNER_ROOM)),
    rule_of("SIT113", missing_room_rule(Missing.LEAD_ROOM)),
    rule_of("SIT118", missing_room_rule(Missing.TAIL_LAYERS)),
    rule_of("SIT119", missing_room_rule(Missing.TAIL_ROOM)),
    rule_of("SIT135", missing_room_rule(Missing.BODY_ROOM)),
    rule_of("SIT136", within_largest),
    rule_of("SIT139", missing_room_rule(Missing.THERMISTOR_ROOM), "soldered thermistor"),
)
