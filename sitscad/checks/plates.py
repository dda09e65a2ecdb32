"""SIT306 and SIT307: how large target and elastomer are, beside the coils and the board."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace

from sitscad.checks.changes import Change, Plate, fail, first_that_mends, larger_target, resized
from sitscad.checks.fit import FIT_RULES, ROUNDING, pad_of
from sitscad.checks.rules import Complaint, Left, Rule, Subject, Undecided, Verdict, apply_rule
from sitscad.checks.transduction import TRANSDUCTION_RULES
from sitscad.finding import Severity
from sitscad.spec.sensor import Target
from sitscad.units import show

TARGET_LENGTH_TOLERANCE = 0.2

QUICK = ("SIT301", "SIT304", "SIT306", "SIT312")
"""Rules of plates other than SIT307 that need no electrical numbers."""


def target_proportions(subject: Subject) -> Iterator[Verdict]:
    """Over two coils in a line: length as their distance, width at least a coil's; else at least as large as a coil."""
    target, array = subject.spec.target, subject.spec.array
    assert target is not None
    pitch = array.pitch if array.pattern == "line" and len(array.placements) == 2 else None
    coil = _largest_coil(subject)

    def advice(left: Left) -> str:
        return _proportioned(subject, pitch, coil, left)

    if pitch and abs(target.size[0] / pitch - 1.0) > TARGET_LENGTH_TOLERANCE:
        yield Complaint(
            f"the target is {show(target.size[0], 'm')} long, the coils' centres are {show(pitch, 'm')} apart",
            f"a target as long as that distance, {show(pitch, 'm')}, gives the most shear signal",
            "target.size",
            target.size[0],
            pitch,
            "m",
            advice=advice,
        )
    ways = (("wide", 1),) if pitch else (("long", 0), ("wide", 1))
    for word, axis in ways:
        if target.size[axis] < coil[axis] - ROUNDING:
            yield Complaint(
                f"the target is {show(target.size[axis], 'm')} {word}, a coil {show(coil[axis], 'm')}: part of the "
                "field passes beside it",
                f"make it larger by {show(coil[axis] - target.size[axis], 'm')}",
                "target.size",
                target.size[axis],
                coil[axis],
                "m",
                advice=advice,
            )
    if pitch is None and len(array.placements) > 1:
        yield Undecided(
            "the target's best length is known for two coils in a line only; of this array it was checked only that "
            "the target is at least as large as one coil, not that it stands over all of them (SIT215 judges what each "
            "coil feels where a normal force is required)"
        )


def _proportioned(subject: Subject, pitch: float | None, coil: tuple[float, float], left: Left) -> str:
    """A target as long as two coils are apart and as wide as one, or as large as a coil, in words."""
    target = subject.spec.target
    assert target is not None
    length = pitch or max(target.size[0], coil[0])
    changes = list(larger_target(subject.spec, length, max(target.size[1], coil[1])))
    found = first_that_mends(changes, left)
    what = "as long as the coils are apart and as wide as one" if pitch else "as large as a coil"
    if found is not None:
        return f"{found.words} (it was tried): {what}"
    against = tuple(sorted({rule for change in changes for rule in left(change.spec)} - {"SIT306"}))
    return (
        f"a target {what} has no room here: tried up to {changes[-1].words}, and {fail(against)}. The two limits "
        "contradict each other for these coils: make the coils smaller, or put up with a part of the signal"
    )


def _largest_coil(subject: Subject) -> tuple[float, float]:
    """How far the coils reach along x and y (m), each turned as it stands."""
    length, width = subject.spec.coil.size
    turned = [placement.rotation for placement in subject.spec.array.placements]
    if length == width:
        return length, width
    return (
        max(abs(length * math.cos(a)) + abs(width * math.sin(a)) for a in turned),
        max(abs(length * math.sin(a)) + abs(width * math.cos(a)) for a in turned),
    )


def elastomer_cover(subject: Subject) -> Iterator[Verdict]:
    """The pad carries the whole target and lies wholly on the board."""
    spec, pad, body = subject.spec, pad_of(subject), subject.layout.body_size
    for axis, word in enumerate(("x", "y")):
        over = (spec.target.size[axis] if spec.target is not None else 0.0) - pad.size[axis]
        if over > ROUNDING:
            yield Complaint(
                f"the target overhangs the elastomer by {show(over, 'm')} along {word}",
                f"an unsupported edge bends and tilts the target: {_on_the_board(subject)}",
                "elastomer.size",
                pad.size[axis],
                pad.size[axis] + over,
                "m",
            )
    for axis, word in enumerate(("x", "y")):
        over = pad.size[axis] - body[axis]
        if over > ROUNDING:
            yield Complaint(
                f"the elastomer is {show(over, 'm')} larger than the board's body along {word}",
                f"what hangs over is neither bonded nor supported: {_on_the_board(subject)}",
                "elastomer.size",
                pad.size[axis],
                body[axis],
                "m",
            )


def _on_the_board(subject: Subject) -> str:
    """Sizes with which the target lies on the elastomer and that on the board's body, and what else then complains."""
    return subject.once("plates on the board", lambda: _cut_in_words(subject))


def _cut_in_words(subject: Subject) -> str:
    before = _other_complaints(subject)
    ways = [(tuple(sorted(_other_complaints(subject.drawn(c.spec)) - before)), c) for c in _cut_to_board(subject)]
    broken, change = next((way for way in ways if not way[0]), ways[-1])
    words = f"{change.words} fits on the board's body"
    if not broken:
        return words
    softer = "; take a stiffer elastomer with it" if {"SIT304", "SIT312"} & set(broken) else ""
    return f"{words}, but the smaller plates break {', '.join(broken)}, and none larger lies on it{softer}"


def _cut_to_board(subject: Subject) -> Iterator[Change]:
    """The target no larger than the body, and the pad no larger either but as large as the target."""
    spec, pad = subject.spec, pad_of(subject)
    x, y = (math.floor(side * 1e6 + 1e-3) * 1e-6 for side in subject.layout.body_size)  # as it is written
    targets: Iterable[tuple[str, Target | None]] = [("", None)]
    if spec.target is not None:
        targets = _made("target", spec.target, (min(spec.target.size[0], x), min(spec.target.size[1], y)))
    for on_top, target in targets:
        least = target.size if target is not None else (0.0, 0.0)
        size = (min(max(pad.size[0], least[0]), x), min(max(pad.size[1], least[1]), y))
        for below, larger in _made("elastomer", pad, size):
            if larger.size[0] >= least[0] and larger.size[1] >= least[1]:
                words = " with ".join(part for part in (below, on_top) if part)
                yield Change(words, replace(spec, target=target, elastomer=larger))


def _made(key: str, plate: Plate, size: tuple[float, float]) -> Iterator[tuple[str, Plate]]:
    """A plate within such sides (m), and how that is written: of its own shape, then as a rectangle."""
    if plate.size == size:
        yield "", plate
        return
    if plate.shape != "rectangle" and size[0] != size[1]:
        yield from resized(key, plate, (min(size),) * 2)
    *_, widest = resized(key, plate, size)
    yield widest


def _other_complaints(subject: Subject) -> Counter[str]:
    """How often those rules of plates complain that need no electrical numbers, and so cost nothing to ask."""
    asked = (rule for rule in (*FIT_RULES, *TRANSDUCTION_RULES, *PLATE_RULES) if rule.id in QUICK)
    said = (finding for rule in asked for finding in apply_rule(rule, subject)[0])
    return Counter(finding.rule for finding in said if finding.severity is not Severity.NOTE)


PLATE_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT307", "elastomer-cover", Severity.WARNING,
        "The elastomer carries the whole target and lies wholly on the board's body.",
        "An unsupported edge bends, and a tilted target reads as shear.",
        "Make the elastomer at least as large as the target and no larger than the body.",
        "thesis of Jones 6.5: target rotation is the main error", ("elastomer",), elastomer_cover,
    ),
    Rule(
        "SIT306", "target-proportions", Severity.WARNING,
        "Over two coils in a line the target is as long as their distance (within 20 %) and at least as wide as a "
        "coil; over any other array it is at least as large as a coil both ways, and its best length is not judged.",
        "Two coils: shear falls to less than a third when the target is much longer or shorter. Any coil: what does "
        "not cover it loses normal signal. For other arrays no measured best size is known.",
        "Over two coils set target.size to their distance; else make the target at least as large as a coil.",
        "thesis of Jones 6.4, 6.5 and tables 6.3, 6.4; TI SNOA957B: target at least the sensor's area", ("target",),
        target_proportions,
    ),
)  # fmt: skip
