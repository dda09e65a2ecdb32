"""SIT112, SIT113, SIT118 and SIT119: what found no room on the board, and what gives it some."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice

from sitscad.checks.changes import Change, fewer_turns, first_that_mends, tried
from sitscad.checks.clearances import drawn_rule
from sitscad.checks.fabrication import FABRICATOR
from sitscad.checks.rules import Complaint, Left, Rule, Subject, Verdict
from sitscad.finding import Finding
from sitscad.layout.advice import remedy
from sitscad.layout.remedies import inner_vias_fit

MOST_STEPS = 16
"""Parts of a turn less that are tried to make room inside."""


def no_room(rule: str) -> Callable[[Subject], Iterator[Verdict]]:
    """What the layout itself reported under one rule: it says what found no room, and how much is missing."""

    def reported(subject: Subject) -> Iterator[Verdict]:
        return (_advised(subject, finding) for finding in subject.layout.findings if finding.rule == rule)

    return reported


def _advised(subject: Subject, finding: Finding) -> Complaint:
    """The layout's finding; what it advises made room, and is held against all other rules too."""
    return Complaint(
        finding.message,
        finding.hint,
        finding.key,
        finding.measured,
        finding.limit,
        finding.unit,
        finding.severity,
        finding.source,
        finding.place,
        advice=lambda left: _hint_for_room(subject, finding, left),
    )


def _hint_for_room(subject: Subject, finding: Finding, left: Left) -> str:
    changed, spec = remedy(subject.spec, finding), subject.spec
    hint = finding.hint
    if changed is not None:
        hint = hint.replace("(it was tried)", tried(Change("", changed), left))
    if finding.rule != "SIT112":
        return hint
    fewer = (change for change in fewer_turns(spec, spec.coil.turns, MOST_STEPS) if inner_vias_fit(change.spec))
    found = first_that_mends(islice(fewer, 2), left)
    if found is None:
        return hint
    return (
        f"{found.words} leaves room for them (it was tried); or {hint.replace('take fewer turns, fewer', 'take fewer')}"
    )


ROOM_RULES: tuple[Rule, ...] = (
    drawn_rule(112, "inner-via-room", (
        "The innermost turn leaves room for the vias that join the layers inside it.",
        "One inner via needs about a pad and two spacings, two need about two pads and three spacings.",
        "Wind fewer turns, make the pitch narrower or the coil larger, or use fewer layers.",
    ), "geometry; " + FABRICATOR, no_room("SIT112")),
    drawn_rule(113, "lead-room", (
        "Every lead, stub and outer via found its place between and beside the coils.",
        "What found no room is missing in the layout; the finding says how much is missing.",
        "Follow the finding: it names the missing length, mostly in array.pitch.",
    ), "geometry; " + FABRICATOR, no_room("SIT113")),
    drawn_rule(118, "array-not-routed", (
        "Coils that do not stand in one line have two copper layers in the tail for their pairs.",
        "Without them the coils are laid out and estimated, but not led to contacts: such a board is no use.",
        "Give the tail two layers, or take pattern single or line.",
    ), "README, Limits", no_room("SIT118")),
    drawn_rule(119, "tail-room", (
        "On their way to the contacts the tracks of different coils keep the fabricator's spacing.",
        "Many coils on a narrow connector or a short tail leave no room for their tracks and vias.",
        "Take a connector of wider pitch, fewer coils, or a longer tail.",
    ), "geometry; " + FABRICATOR, no_room("SIT119")),
)  # fmt: skip
