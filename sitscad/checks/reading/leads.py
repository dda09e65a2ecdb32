"""SIT216: what it costs that leads run round their coil."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

from sitscad.checks.cases import Case, worded
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.estimates.values import CoilEstimate
from sitscad.finding import Severity
from sitscad.layout.board import Coil
from sitscad.layout.branches import drawn_closing, least_closing
from sitscad.layout.lanes import Ring
from sitscad.record import record
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import other_ends, whole_turns
from sitscad.remedy.search import Left, first_that_mends
from sitscad.scene.state import FREE

NAMED, WARNED = 0.015, 0.03
"""Shares of the winding's inductance from which what leads link of its flux is named; and warned of, where a lead runs
back: what runs on adds inductance for its resistance.
"""

TOGETHER = 0.1
"""Leads that run round their coil by no more than this (turns) run together, as good as."""

TRIED = 3
"""So many changes are drawn to find one without a closing arc."""


@record
class _Arc:
    """How far one coil's leads run round it (turns, positive as the winding runs), and what that does: inductance (H)
    and its share of the winding's, the share of Rp.
    """

    name: str
    turns: float
    inductance: float
    share: float
    parallel: float


def leads_round(design: Design) -> Iterator[Verdict]:
    """The coil whose leads link most of its winding's flux, and turns or a start angle without that."""
    layout = design.layout
    if not all(coil.is_closed_circuit for coil in layout.coils):
        yield Undecided("leads are missing in the layout")
        return
    arcs = [_arc(design, *both) for both in zip(layout.coils, design.estimates.coils, strict=True)]
    worst = max(arcs, key=lambda arc: round(abs(arc.share), 6))
    if abs(worst.share) < NAMED or abs(worst.turns) < TOGETHER:
        return
    beyond = abs(worst.turns) - abs(least_closing(design.spec.coil))
    is_warned = -worst.share >= WARNED
    yield (RUNS_ON if worst.turns > 0.0 else RUNS_BACK).found(
        "coil.turns", abs(worst.share), WARNED if is_warned else NAMED,
        advice=lambda left: _other_way(design, beyond > TOGETHER, left, is_warned), is_grave=is_warned, name=worst.name,
        turns=abs(worst.turns), cramped=worded(CRAMPED, {"beyond": beyond}) if beyond > TOGETHER else "",
        inductance=abs(worst.inductance),
        parallel="" if math.isnan(worst.parallel) else worded(MOVES, {"parallel": worst.parallel}),
    )


def _arc(design: Design, coil: Coil, estimate: CoilEstimate) -> _Arc:
    """What a coil's leads close round it: turns, inductance linked, and what that does to R_P."""
    spec = design.spec
    turns = drawn_closing(spec.coil, coil)
    linked = estimate.lead_parts.get("coupling", 0.0)
    ring = Ring(spec.coil, coil.placement, spec.fpc.rules.trace_spacing + spec.coil.trace_width / 2.0)
    resistance = estimate.resistance_ac * abs(turns) * ring.boundary.length / estimate.trace_length
    free, parallel = estimate.states.get(FREE), math.nan
    if free is not None:
        # Rp = L / (R C), with the arc over without it
        parallel = free.inductance / (free.inductance - linked) * (1.0 - resistance / free.resistance) - 1.0
    return _Arc(coil.name, turns, linked, linked / estimate.winding_inductance, parallel)


def _other_way(design: Design, is_cramped: bool, left: Left, is_warned: bool) -> str:
    """The nearest turns (for leads that lack room, the first start angle) with which leads run together, drawn; and
    checked, too, where the design is warned of them.
    """
    start = (
        (change for change in other_ends(design.spec) if any(edit.key == "coil.start_angle" for edit in change.edits))
        if is_cramped
        else ()
    )
    changes = [*islice(start, TRIED), *whole_turns(design.spec)]
    fit = (change for change in changes if _runs_together(left, change, is_cramped))
    found = first_that_mends(islice(fit, TRIED), left) if is_warned else next(fit, None)
    if found is not None:
        left.mends(found)
        return f"{found.words} lets them run together (it was {'tried' if is_warned else 'drawn'})"
    return "" if left.is_cut_short else _vain(changes)


def _vain(changes: list[Fix]) -> str:
    names = ", ".join(change.words for change in changes)
    tried = f" (tried in vain: {names})" if names else ""
    return f"turns whose sum over the layers is whole let the leads run together, where there is room for them{tried}"


def _runs_together(left: Left, change: Fix, is_cramped: bool) -> bool:
    """Whether with a change both leads of every coil run side by side, as far as its layers let them."""
    drawn = left.drawn(change.spec)
    if drawn is None:
        return False
    spare = abs(least_closing(change.spec.coil)) if is_cramped else 0.0
    return not drawn.shortfalls and all(
        abs(drawn_closing(change.spec.coil, coil)) <= spare + TOGETHER for coil in drawn.coils
    )


CRAMPED = " ({beyond:.2f} of them for want of room beside the coils)"
MOVES = " and moves Rp by about {parallel:%+.1f} %"
TOGETHER_HINT = "turns whose sum over the layers is whole let the leads run together"

RUNS_ON = Case(
    "a lead of {name} runs {turns:.2f} turns on round the coil by itself{cramped}: that adds {inductance:H,3}, "
    "{measured:%.1f} % of the winding's inductance,{parallel}", TOGETHER_HINT, Severity.NOTE, grave=Severity.WARNING,
)

RUNS_BACK = Case(
    "a lead of {name} runs {turns:.2f} turns back round the coil by itself{cramped}: that takes away {inductance:H,3}, "
    "{measured:%.1f} % of the winding's inductance,{parallel}", TOGETHER_HINT, Severity.NOTE, grave=Severity.WARNING,
)


LEAD_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT216", "leads-round-coil", Severity.WARNING,
        f"What a lead that runs round its coil by itself links of the winding's flux is less than {100.0 * NAMED:.1f} "
        f"% of the winding's inductance; a warning from {100.0 * WARNED:.0f} % up where it runs back and takes them "
        "away.",
        "From contact to contact the current goes round the coil a whole number of times. What the turns of all layers "
        "together lack of that, or have beyond it, a lead makes up outside the winding: it adds inductance or takes it "
        "away, and it has resistance. So the inductance at the contacts leaves the winding's, and a fraction of a turn "
        "more can give less.",
        "Take turns whose sum over the layers is whole (halves for two layers, quarters for four); then both leads run "
        "to the tail above each other. Where room beside the coils was lacking, another start angle or a larger pitch.",
        "Neumann's integral of the leads as drawn with the winding; the limits are this project's own",
        apply=leads_round,
    ),
)
