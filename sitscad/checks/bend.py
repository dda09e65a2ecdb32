"""SIT123: the stretch of the tail that is bent: nothing stiff in it, straight tracks, and length enough."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.checks.changes import Change, tried
from sitscad.checks.fabrication import ROUNDING, house, source_of
from sitscad.checks.rules import Complaint, Left, Rule, Subject, Undecided, Verdict
from sitscad.finding import Place, Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.bending import longest_straight, unfit_for_bending
from sitscad.layout.board import Pad, Via
from sitscad.layout.stiffening import tail_thickness
from sitscad.record import record
from sitscad.units import show

LENGTH_GRAIN, TRIALS, LONGEST = 0.1e-3, 5, 5.0
"""A longer tail is named in steps of this (m), after at most so many trials; the spec takes none longer than this (m).
"""

FIRST_ROOM = 1e-3
"""By so much (m) a tail without any room to bend is lengthened at least, trial by trial."""


@record
class _Straight:
    # The longest stretch in the bend zone in which tracks run straight at one width: where it begins and its length
    # (m), and the first place in the zone where they do not, if any.
    start: float
    length: float
    unfit: Place | None


def bend_zone(subject: Subject) -> Iterator[Verdict]:
    """Nothing stiff and nothing that starts a crack lies where the tail bends."""
    zone, tail = subject.layout.bend_zone, subject.spec.fpc.tail
    assert tail is not None
    if tail.bend == "none":
        yield Undecided("the tail does not bend (fpc.tail.bend: none)")
        return
    if zone is not None:
        yield from _stiff_in_bend(subject, zone)
    yield from _too_short(subject)


def _too_short(subject: Subject) -> Iterator[Complaint]:
    straight, needed, fits = _straight(subject), _bend_length(subject), _fits(subject)
    if fits and straight.unfit is None:
        return
    have, tail = show(max(0.0, straight.length), "m", 3), subject.spec.fpc.tail
    assert tail is not None
    if straight.unfit is None:
        message = f"the tail has {have} free of vias, turns and stiffener for its {tail.bend} bend"
        message += f"; one by a right angle needs {show(needed, 'm', 3)}" if needed else ""
    else:
        message = (
            f"in the bend zone tracks turn or change their width; they run straight at one width for {have} from "
            f"x = {show(straight.start, 'm', 4)}"
        )
        message += "" if fits else f"; a bend by a right angle needs {show(needed, 'm', 3)}"
    figure = bend_figure(subject)
    if figure and not fits:
        field, ratio = figure
        message += f" at the radius of {ratio:g} thicknesses that {house(subject, field)} asks"
    yield Complaint(
        message,
        "bend the tail there and nowhere else" if fits else NO_ROOM,
        "fpc.tail.bend" if fits else "fpc.tail.length",
        straight.length,
        needed,
        "m",
        Severity.NOTE if fits else Severity.WARNING,
        source_of(subject, figure[0]) if figure and not fits else None,
        place=straight.unfit and replace(straight.unfit, x=straight.start),
        advice=None if fits else lambda left: _longer(subject, left),
    )


NO_ROOM = "lengthen the tail, or fpc.tail.bend: none"


def _longer(subject: Subject, left: Left) -> str:
    length, tail = _length_that_does(subject), subject.spec.fpc.tail
    if length is None or tail is None:
        return NO_ROOM
    words = f"fpc.tail.length: {length * 1e3:.1f} mm is long enough"
    longer = replace(subject.spec, fpc=replace(subject.spec.fpc, tail=replace(tail, length=length)))
    return f"{words} {tried(Change(words, longer), left)}, or fpc.tail.bend: none"


def _length_that_does(subject: Subject) -> float | None:
    """A length (m) of the tail with which its bend has room, found by laying the board out with it; None if none, or
    where leads or vias found no room: that search is long, and as vain with any tail.
    """
    from sitscad.layout import lay_out  # only where a bend lacks room

    if subject.layout.findings:
        return None
    spec, tail = subject.spec, subject.spec.fpc.tail
    assert tail is not None
    shorter, length = subject, subject.layout.tail_length
    for _ in range(TRIALS):
        missing = _bend_length(shorter) - max(0.0, _straight(shorter).length)
        if shorter.layout.bend_zone is None:
            missing = max(missing, FIRST_ROOM)
        length = LENGTH_GRAIN * math.ceil((length + missing) / LENGTH_GRAIN - 1e-6)
        if length > LONGEST:
            return None
        longer = replace(spec, fpc=replace(spec.fpc, tail=replace(tail, length=length)))
        shorter = Subject(longer, lay_out(longer, advised=False))
        if _fits(shorter):
            return length
    return None


def _fits(subject: Subject) -> bool:
    """Whether there is somewhere to bend, and straight tracks along all of a bend by a right angle."""
    return subject.layout.bend_zone is not None and _straight(subject).length >= _bend_length(subject) - ROUNDING


def _straight(subject: Subject) -> _Straight:
    zone = subject.layout.bend_zone
    if zone is None:
        return _Straight(0.0, 0.0, None)
    unfit = unfit_for_bending(subject.layout)
    longest = longest_straight(zone, unfit)
    first = next((Place(each.first, each.y, each.layer, (each.net,)) for each in unfit), None)
    return _Straight(longest.start, longest.length, first)


def bend_figure(subject: Subject) -> tuple[str, float] | None:
    """Which figure of the fabricator's is the tail's smallest bend radius, and that radius by its thickness."""
    tail, rules = subject.spec.fpc.tail, subject.spec.fpc.rules
    assert tail is not None
    ratios = rules.dynamic_bend_ratio if tail.bend == "dynamic" else rules.static_bend_ratio
    if not ratios:
        return None
    layers = tail.layers if tail.layers in ratios else max(ratios)
    return f"{tail.bend}_bend_{layers}", ratios[layers]


def _bend_length(subject: Subject) -> float:
    """The length (m) of a bend by a right angle with the fabricator's smallest radius; 0 where that is not stated."""
    figure = bend_figure(subject)
    return math.pi / 2 * figure[1] * tail_thickness(subject.spec) if figure else 0.0


def _stiff_in_bend(subject: Subject, zone: tuple[float, float]) -> Iterator[Complaint]:
    layout = subject.layout
    for via in layout.vias:
        if _overlap(via.centre.x, via.pad / 2, zone) > ROUNDING:
            yield _in_bend(f"a via of {via.net}", _overlap(via.centre.x, via.pad / 2, zone), _place_of(via))
    for pad in layout.all_pads:
        if _overlap(pad.centre.x, pad.size[0] / 2, zone) > ROUNDING:
            yield _in_bend(f"contact {pad.pin}", _overlap(pad.centre.x, pad.size[0] / 2, zone), _place_of(pad))
    if layout.stiffener is not None:
        x0, y0, x1, y1 = bounding_box([layout.stiffener.outline.outline])
        inside = _overlap((x0 + x1) / 2, (x1 - x0) / 2, zone)
        if inside > ROUNDING:
            yield _in_bend("the stiffener", inside, Place(max(x0, zone[0]), (y0 + y1) / 2))


def _in_bend(what: str, inside: float, place: Place) -> Complaint:
    return Complaint(
        f"{what} reaches {show(inside, 'm', 3)} into the bend zone",
        "lengthen the tail, so that it lies outside the bend, or do without a bend (fpc.tail.bend: none)",
        "fpc.tail.bend",
        inside,
        0.0,
        "m",
        place=place,
    )


def _overlap(middle: float, half: float, zone: tuple[float, float]) -> float:
    return min(middle + half, zone[1]) - max(middle - half, zone[0])


def _place_of(item: Via | Pad) -> Place:
    return Place(*item.centre, item.layer if isinstance(item, Pad) else None, (item.net,))


BEND_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT123", "bend-zone", Severity.ERROR,
        "Where the tail bends there are no vias, no contacts, no stiffener, and tracks run straight at one width.",
        "Plated holes and stiffener edges crack the copper beside them at the first bend; a corner or step gathers the "
        "strain. Tracks that turn or change their width there are a note that says where to bend instead.",
        "Lengthen the tail, so that everything lies outside the bend.",
        "IPC-2223, 5.2.4 (unverified: quoted from memory)", ("tail",), bend_zone,
    ),
)  # fmt: skip
