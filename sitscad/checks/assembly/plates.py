"""SIT306: how large the target is, beside the coils."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.checks.assembly.fit import ROUNDING
from sitscad.checks.assembly.plate_places import pair
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.convex import beyond
from sitscad.geometry.path import Point
from sitscad.remedy.fix import fail
from sitscad.remedy.moves import larger_target
from sitscad.remedy.search import Left, broken_by, first_that_mends
from sitscad.spec.places import footprint
from sitscad.spec.plates import Target
from sitscad.units import show

TARGET_LENGTH_TOLERANCE = 0.2


def target_proportions(design: Design) -> Iterator[Verdict]:
    """Over two coils in a line: length as their distance, width at least a coil's; else at least as large as a coil."""
    target, array = design.spec.target, design.spec.array
    assert target is not None
    pitch = array.pitch if array.pattern == "line" and len(array.placements) == 2 else None
    coil, length = _largest_coil(design, target.rotation), _chord(target)

    def advice(left: Left) -> str:
        return _proportioned(design, pitch, coil, left)

    if pitch and abs(length / pitch - 1.0) > TARGET_LENGTH_TOLERANCE:
        yield NOT_AS_LONG.found("target.size", length, pitch, "m", advice=advice)
    ways = (("wide", 1),) if pitch else (("long", 0), ("wide", 1))
    for word, axis in ways:
        if target.size[axis] < coil[axis] - ROUNDING:
            yield TOO_SMALL.found("target.size", target.size[axis], coil[axis], "m", advice=advice, word=word)
    if any(target.offset):
        yield from _aside(design, coil)
    elif pitch is None:
        yield from _over_none(design, min(design.spec.coil.size))
    if pitch is None and len(array.placements) > 1:
        yield Undecided(
            "the target's best length is known for two coils in a line only; of this array it was checked only that "
            "the target is at least as large as one coil, not that it stands over all of them (SIT215 judges what each "
            "coil feels where a normal force is required)"
        )


def _over_none(design: Design, coil: float) -> Iterator[Verdict]:
    """That a target in the middle of several coils reaches not one of them."""
    spec, target = design.spec, design.spec.target
    assert target is not None
    outline = footprint(spec, target).outline()
    nearest = min(beyond(outline, Point(*p.centre)) for p in spec.array.placements)
    if nearest >= 0.5 * coil:
        yield BETWEEN_COILS.found("target.size", nearest, 0.5 * coil, "m")


def _aside(design: Design, coil: tuple[float, float]) -> Iterator[Verdict]:
    """What a target covers less of the coils because it is offset: of a single coil all, of several their centres."""
    spec, target = design.spec, design.spec.target
    assert target is not None
    here, middle = footprint(spec, target), footprint(spec, replace(target, offset=(0.0, 0.0)))
    if len(spec.array.placements) == 1:
        place = here.place_of(Point(*spec.array.middle))
        over = max(abs(place[k]) + 0.5 * (coil[k] - max(target.size[k], coil[k])) for k in (0, 1))
        names = [spec.array.placements[0].name] if over > ROUNDING else []
        words = f"up to {show(min(over, coil[0], coil[1]), 'm', 3)} of coil"
    else:
        outlines, slack = (here.outline(), middle.outline()), 0.5 * TARGET_LENGTH_TOLERANCE * min(coil)
        beside = {p.name: [beyond(o, Point(*p.centre)) for o in outlines] for p in spec.array.placements}
        lost = {name: now for name, (now, before) in beside.items() if now > max(before, 0.0) + slack}
        names, over, words = list(lost), max(lost.values(), default=0.0), "the middle of coil"
    if names:
        yield BESIDE_COILS.found("target.offset", over, 0.0, "m", pair=pair(target.offset), words=words,
                                 plural="s" * (len(names) > 1), join=", ".join(names))


def _proportioned(design: Design, pitch: float | None, coil: tuple[float, float], left: Left) -> str:
    """A target as long as two coils are apart and as wide as one, or as large as a coil, in words."""
    target = design.spec.target
    assert target is not None
    what = "as long as the coils are apart and as wide as one" if pitch else "as large as a coil"
    if pitch and not target.outline.is_round and abs(math.sin(target.rotation)) > 1e-9:
        return f"take a target {what} along and across the line of the coils; target.rotation: 0 deg lies so"
    length = pitch or max(target.size[0], coil[0])
    changes = list(larger_target(design.spec, length, max(target.size[1], coil[1])))
    found = first_that_mends(changes, left)
    if found is not None:
        return f"{found.words} (it was tried): {what}"
    if left.is_cut_short:
        return ""
    against = tuple(rule for rule in broken_by(changes, left) if rule != "SIT306")
    return (
        f"a target {what} has no room here: tried up to {changes[-1].words}, and {fail(against)}. The two limits "
        "contradict each other for these coils: make the coils smaller, or put up with a part of the signal"
    )


def _chord(target: Target) -> float:
    """How long (m) the target is through its middle, along the line of the coils."""
    if target.outline.is_round:
        return target.size[0]
    along, across = abs(math.cos(target.rotation)), abs(math.sin(target.rotation))
    x, y = target.size
    return x / along if across * x <= along * y else y / across


def _largest_coil(design: Design, turn: float) -> tuple[float, float]:
    """How far the coils reach along the axes (m) of a target turned so far (rad), each turned as it stands."""
    length, width = design.spec.coil.size
    turned = [placement.rotation - turn for placement in design.spec.array.placements]
    if length == width:
        return length, width
    return (max(abs(length * math.cos(a)) + abs(width * math.sin(a)) for a in turned),
            max(abs(length * math.sin(a)) + abs(width * math.cos(a)) for a in turned))


NOT_AS_LONG = Case(
    "the target is {measured:m} long, the coils' centres are {limit:m} apart",
    hint="a target as long as that distance gives the most shear signal",
)

TOO_SMALL = Case(
    "the target is {measured:m} {word}, a coil {limit:m}: part of the field passes beside it", hint="a larger target",
)

BETWEEN_COILS = Case(
    "the target lies between the coils and over none of them: the nearest one's middle stands {measured:m,3} beyond "
    "its edge", hint="a target that reaches the middles of the coils, or coils nearer together",
)

BESIDE_COILS = Case(
    "the target is offset by {pair} mm: {words}{plural} {join} lies beside it, and so does the field there",
    hint="target.offset: [0, 0] stands over the middle of the coils (move elastomer.offset with it), or make the "
    "target larger",
)


PROPORTIONS = Rule(
    "SIT306", "target-proportions", Severity.WARNING,
    "Over two coils in a line the target is as long as their distance (within 20 %) and at least as wide as a "
    "coil; over any other array it is at least as large as a coil both ways, and its best length is not judged. An "
    "offset (target.offset) leaves a single coil wholly under it, and of several their middles.",
    "Two coils: shear falls to less than a third when the target is much longer or shorter. Any coil: what does "
    "not cover it loses normal signal. For other arrays no measured best size is known.",
    "Over two coils set target.size to their distance; else make the target at least as large as a coil.",
    "thesis of Jones 6.4, 6.5 and tables 6.3, 6.4; TI SNOA957B: target at least the sensor's area", ("target",),
    target_proportions,
)

PLATE_RULES: tuple[Rule, ...] = (PROPORTIONS,)
