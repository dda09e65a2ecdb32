"""SIT111 to SIT113, SIT118, SIT119, SIT135 and SIT136: what finds no room on the board, or inside an outline, and what
gives it some.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice

from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of
from sitscad.design import Design
from sitscad.finding import Missing, Place, Severity, Shortfall
from sitscad.fixes import moves
from sitscad.fixes.moves import fewer_turns
from sitscad.fixes.search import Fix, Left, first_that_mends, setting, tried, winding_work
from sitscad.geometry.convex import beyond
from sitscad.geometry.path import bounding_box, rectangle
from sitscad.layout.board import Layout
from sitscad.scene.bodies import film_thickness
from sitscad.scene.seating import PLATE_CORNER, plate_plan
from sitscad.scene.stack import ground
from sitscad.spec.circuit import BodySpec
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

MOST_STEPS = 16
"""Parts of a turn less that are tried to make room inside."""

GRAIN = 100e-6
"""A body is first tried so much larger (m) on every side where nobody knows what is missing."""


def no_room(what: Missing) -> Callable[[Design], Iterator[Verdict]]:
    """What the layout itself reported of one kind: it says what found no room."""

    def reported(design: Design) -> Iterator[Verdict]:
        return (_complaint(design, lack) for lack in design.layout.shortfalls if lack.what is what)

    return reported


def _complaint(design: Design, lack: Shortfall) -> Violation:
    """What a shortfall is under its rule; what is advised makes room, and is held against all other rules too."""
    # hint, key and source (empty: the rule's)
    spec, body = design.spec, design.spec.fpc.body
    is_sized = body is not None and body.size is not None
    of_rules = f"and spacing of the rules {spec.fpc.rules.name}"
    at_contacts = "a connector of wider pitch" + ("" if lack.need else ", fewer coils on one tail, or a longer tail")
    between = design.distance_key if len(spec.array.placements) > 1 else "coil.start_angle"
    said = {
        Missing.WAY_OUT: (f"take {len(spec.coil.layers) + 1} layers, or a stack-up with one more copper layer",
                          "coil.layers", ""),
        Missing.INNER_ROOM: ("take fewer turns, fewer layers or finer rules", "coil.turns", f"via pad {of_rules}"),
        Missing.LEAD_ROOM: ("change coil.start_angle or the number of turns, so that the layers end at other angles",
                            "fpc.body" if is_sized else between, f"via pad {of_rules}"),
        Missing.TAIL_LAYERS: ("give the tail two layers (fpc.tail.layers: 2), or take pattern line", "fpc.tail.layers",
                              ""),
        Missing.TAIL_ROOM: (at_contacts, "fpc.tail.connector" if spec.fpc.tail else "fpc",
                            f"{'trace' if lack.need else 'via pad'} {of_rules}"),
        Missing.BODY_ROOM: ("a larger body, smaller coils, or coils nearer to each other", "fpc.body", ""),
    }
    hint, key, source = said[lack.what]
    message = lack.message
    if lack.what is Missing.LEAD_ROOM and is_sized and body is not None:
        message = f"{message} inside the body that is asked for ({body.written})"
    plain = Violation(message, hint, key, lack.have, lack.need, lack.unit, source=source or None, place=lack.place)
    find = _ROOM.get(lack.what)
    return plain if find is None else replace(plain, advice=lambda left: find(design, plain, left))


def no_way_out(design: Design) -> Iterator[Verdict]:
    """Every coil must begin and end at a contact."""
    yield from no_room(Missing.WAY_OUT)(design)
    unled = [coil for coil in design.layout.coils if not coil.is_closed_circuit]
    if unled and not design.layout.shortfalls:
        yield Violation(
            f"coil {', '.join(coil.name for coil in unled)} does not reach both of its contacts: it cannot be driven",
            key="coil.layers", place=Place(*unled[0].centre),
        )


def _room_inside(design: Design, plain: Violation, left: Left) -> str:
    """Fewer turns, then a larger coil with as much more room inside as its vias need."""
    spec = design.spec
    steps = fewer_turns(spec, spec.coil.most_turns, MOST_STEPS)
    fewer = first_that_mends(islice((fix for fix in steps if _vias_fit(fix.spec, left)), 2), left)
    hint = plain.hint
    if fewer is not None:
        hint = f"{fewer.words} leaves room for them (it was tried); or take fewer layers or finer rules"
    if fewer is not None and not left.wants_another():
        return hint
    assert plain.measured is not None and plain.limit is not None
    first = max(plain.limit - plain.measured, 0.5 * spec.fpc.rules.via_pad)
    found = moves.least(spec, moves.larger_coils, lambda changed: _vias_fit(changed, left), first, left.wants_another)
    return hint if found is None else f"{found[1].words} makes room{tried(found[1], left)}; or {hint}"


def _vias_fit(spec: SensorSpec, left: Left) -> bool:
    return left.affords(winding_work(spec.coil)) and moves.inner_vias_fit(spec)


def _room_between(design: Design, plain: Violation, left: Left) -> str:
    """Inside a body of a given outline other ends of the layers, then a larger body; else coils farther apart, then
    other ends; what comes second only where much may be tried, or the first is in vain. Last, both together.
    """
    spec, body = design.spec, design.spec.fpc.body
    if body is not None and body.size is not None:
        turned = _other_ends(spec, left)
        if turned and not left.wants_another():
            return turned
        return "; or ".join(filter(None, (turned or _in_vain(spec, left), _room_in_body(design, plain, left))))
    near, first = moves.nearest_distance(spec.array.placements), moves.lead_room(spec)
    found = None
    if near is not None:
        found = moves.least(spec, moves.coils_apart, partial(_routes, left), first, left.wants_another)
    if found is not None:
        apart = f"{found[1].words} lets them pass{tried(found[1], left)}"
        if not left.wants_another():
            return f"{apart}, or perhaps another coil.start_angle"
        return f"{apart}; or {_other_ends(spec, left) or _in_vain(spec, left)}"
    turned = _other_ends(spec, left)
    if turned or near is None:
        return turned or _in_vain(spec, left)
    farther = moves.coils_apart(spec, moves.GROWTH * first)
    both = next((fix for fix in moves.other_start_angles(farther.spec) if _routes(left, fix.spec)), None)
    if both is None:
        return _in_vain(spec, left)
    return f"{farther.words} together with {both.words} lets them pass{tried(farther.with_also(both), left)}"


def _routes(left: Left, changed: SensorSpec) -> bool:
    """Whether all leads of a changed design find a way; contacts too near each other are a finding of their own."""
    layout = left.drawn(changed)
    return layout is not None and {lack.what for lack in layout.shortfalls} <= {Missing.TAIL_ROOM}


def _other_ends(spec: SensorSpec, left: Left) -> str:
    """The first other start angle, or part of a turn less or more, that gives the leads a way out and breaks nothing,
    else the first that gives them one; nothing to say where none does. It is the first of all where not much may be
    tried.
    """
    first = None
    for fix in moves.other_ends(spec):
        if not _routes(left, fix.spec):
            continue
        first = first or fix
        if left(fix) == ():
            first = fix
            break
        if not left.wants_another():
            break
    return "" if first is None else f"{first.words} gives them a way out{tried(first, left)}"


def _in_vain(spec: SensorSpec, left: Left) -> str:
    """The start angles and turns that were all tried and give the leads no way out; nothing to say where the search
    ended before.
    """
    if left.is_cut_short:
        return ""
    fixes: dict[str, list[str]] = {}
    for fix in moves.other_ends(spec):
        fixes.setdefault(fix.edits[0].key, []).append(fix.edits[0].new)
    listed = " and ".join(f"{key} ({', '.join(values)})" for key, values in fixes.items())
    return f"{listed}: tried in vain; fewer turns or smaller coils leave more room"


def _room_in_body(design: Design, plain: Violation, left: Left) -> str:
    """The least body, of those tried, in which everything finds its place; nothing to say where none is given."""
    spec, body = design.spec, design.spec.fpc.body
    if body is None or body.size is None:
        return ""
    missing = GRAIN
    if plain.measured is not None and plain.limit is not None:  # leads then want room beside the coils, too
        missing = plain.limit - plain.measured + moves.lead_room(spec)
    found = moves.least(spec, moves.larger_body, partial(_holds, left), missing, left.wants_another)
    if found is None:
        return ""
    return f"{found[1].words} holds all of it{tried(found[1], left)}; or smaller coils, or coils nearer to each other"


def _holds(left: Left, changed: SensorSpec) -> bool:
    """Whether everything finds its place in a changed design."""
    layout = left.drawn(changed)
    return layout is not None and not layout.shortfalls


def within_largest(design: Design) -> Iterator[Verdict]:
    """The body, wherever it is laid, lies in the largest outline; one that is drawn has its place about the coils."""
    spec, largest = design.spec, design.spec.fpc.largest
    if largest is None:
        return
    over, (x0, y0, x1, y1) = _beyond_largest(design.layout), bounding_box([ground(design.layout)])
    if over > ROUNDING:
        nearer = ", or coils nearer to each other, make" if len(spec.array.placements) > 1 else " make"
        yield Violation(
            f"the body, {show(x1 - x0, 'm')} x {show(y1 - y0, 'm')}, reaches {show(over, 'm')} beyond the largest "
            f"outline that is asked for ({largest.written})",
            f"smaller coils{nearer} a smaller body; a body of that outline (fpc.body) is refused with what has no room "
            "in it", "fpc.largest", over, 0.0, "m",
            advice=lambda left: _fitting(spec, largest, over, (x1 - x0, y1 - y0), left),
        )
    yield from _larger_plate(design.layout, largest)


def _larger_plate(layout: Layout, largest: BodySpec) -> Iterator[Violation]:
    """Yield a note if the bench plate does not lie in `fpc.largest`, which limits the board alone.

    The plate lies about the outline's middle, either way round; in a drawn outline it lies as it is.
    """
    mount = layout.spec.mount
    if mount is None or mount.kind != "bench-plate":
        return
    x0, y0, x1, y1 = plate_plan(layout, film_thickness(layout.spec.encapsulation))
    (x, y), lying, upright = layout.spec.array.middle, (x1 - x0, y1 - y0), (y1 - y0, x1 - x0)
    plates = [rectangle(x0 - x, y0 - y, x1 - x, y1 - y, PLATE_CORNER)]
    if largest.shape != "dxf":
        plates = [rectangle(-a / 2, -b / 2, a / 2, b / 2, PLATE_CORNER) for a, b in (lying, upright)]
    over = min(max(beyond(largest.edge, corner) for corner in plate.flattened(1e-6)) for plate in plates)
    if over > ROUNDING:
        yield Violation(
            f"the mount is a plate of {show(x1 - x0, 'm')} x {show(y1 - y0, 'm')} with its screws: it reaches "
            f"{show(over, 'm')} beyond the outline that is asked for ({largest.written}), which holds for the board "
            "alone",
            "write mount.kind: custom and glue the board on a part of your own, or use smaller coils", "fpc.largest",
            over, 0.0, "m", severity=Severity.NOTE,
        )


def _beyond_largest(layout: Layout) -> float:
    """Distance (m) by which the body of a layout reaches beyond `fpc.largest`; the spec must have that key."""
    largest, body = layout.spec.fpc.largest, ground(layout)
    assert largest is not None
    (x0, y0, x1, y1), (x, y) = bounding_box([body]), layout.spec.array.middle
    if largest.shape != "dxf":
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return max(beyond(largest.edge.shifted(x, y), point) for point in body.flattened(1e-6))


def _fitting(spec: SensorSpec, largest: BodySpec, over: float, have: tuple[float, float], left: Left) -> str:
    """Advice that was tried: the largest outline as the body's own with these coils, or the largest coils that fit."""
    as_asked = setting(replace(spec, fpc=replace(spec.fpc, margin=(0.0, 0.0))), "fpc.body", largest, largest.written)
    if _holds(left, as_asked.spec):
        return f"{as_asked.words} holds coils and leads{tried(as_asked, left)}"
    keeps_length = largest.size is not None and have[0] <= largest.size[0] + ROUNDING

    def smaller(of: SensorSpec, by: float) -> Fix:
        return moves.smaller_coils(of, by, keeps_length)

    found = moves.least(as_asked.spec, smaller, partial(_holds, left), max(GRAIN, over), left.wants_another)
    if found is None:
        return ""
    alone = smaller(spec, found[0])
    layout = left.drawn(alone.spec)
    is_enough = layout is not None and not layout.shortfalls and _beyond_largest(layout) <= ROUNDING
    fix = alone if is_enough else as_asked.with_also(found[1])
    return f"smaller coils fit: {fix.words}{tried(fix, left)}"


def _room_at_contacts(design: Design, plain: Violation, left: Left) -> str:
    """The connector of the next wider pitch with which the tracks keep their distance."""
    for fix in moves.larger_connectors(design.spec, "pitch"):
        if _holds(left, fix.spec) and fix.spec.fpc.tail is not None:
            pitch = fix.spec.fpc.tail.connector.pitch
            return (
                f"{fix.words} gives them room{tried(fix, left)}: {(pitch - (plain.measured or 0.0)) * 1e6:.0f} um more "
                "from contact to contact; or fewer coils on one tail"
            )
    return ""


_ROOM: dict[Missing, Callable[[Design, Violation, Left], str]] = {
    Missing.INNER_ROOM: _room_inside, Missing.LEAD_ROOM: _room_between, Missing.TAIL_ROOM: _room_at_contacts,
    Missing.BODY_ROOM: _room_in_body,
}
"""What gives room, by what lacks it."""


RULES: tuple[Rule, ...] = (
    rule_of("SIT111", no_way_out),
    rule_of("SIT112", no_room(Missing.INNER_ROOM)),
    rule_of("SIT113", no_room(Missing.LEAD_ROOM)),
    rule_of("SIT118", no_room(Missing.TAIL_LAYERS)),
    rule_of("SIT119", no_room(Missing.TAIL_ROOM)),
    rule_of("SIT135", no_room(Missing.BODY_ROOM)),
    rule_of("SIT136", within_largest),
)
