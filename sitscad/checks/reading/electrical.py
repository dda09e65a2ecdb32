"""SIT201 to SIT203, SIT205, SIT206, SIT214 and SIT216: what the converter sees in every state against what it can
drive, and what it costs that leads run round their coil.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

from sitscad.checks.reading.readings import (
    Reading,
    failed_states,
    in_sigmas,
    larger_capacitor,
    more_copper,
    more_distance,
    near_limit,
    nothing_estimated,
    other_states,
    overdamped_tank,
    readings_of,
    sigmas_between,
    undecided,
    where,
    worst_of,
)
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, rule_of, worded
from sitscad.design import Design
from sitscad.estimates.circuit.tank import preferred_values
from sitscad.estimates.values import CoilEstimate
from sitscad.finding import Severity
from sitscad.layout.board import Coil
from sitscad.layout.branches import drawn_closing, least_closing
from sitscad.layout.lanes import Ring
from sitscad.record import record
from sitscad.remedy.moves import capacitor, other_ends, whole_turns
from sitscad.remedy.search import Fix, Left, first_that_mends
from sitscad.scene.state import FREE


def inductance_floor(design: Design) -> Iterator[Verdict]:
    """The smallest inductance over all coils and states."""
    floor = design.converter.limit("inductance_min")
    yield from undecided(design, "inductance")
    worst = worst_of(design, "inductance", min)
    if worst is None:
        yield from nothing_estimated(design)
        return
    if worst.value >= floor:
        yield from near_limit(worst, floor, "H", "inductance",
                              "a few more turns make it safe, where the coil has room for them", "coil.turns")
        return
    growth = floor / max(worst.value, 0.01 * floor)  # a coarse state can come out near or below zero
    # whether the tank in a reading's state is too fast or too lossy for the converter: what a small inductance
    # means where it matters, and what is estimated itself
    state = next(coil.states[worst.state] for coil in design.estimates.coils if coil.name == worst.coil)
    slow = state.frequency <= design.converter.limit("sensor_frequency_max")
    driven = state.parallel_resistance >= design.converter.limit(_resistance_floor(design))
    refused, away = (not (worst.value > 0.0 and slow and driven)), more_distance(design) if worst.state != FREE else ""
    grows = "inductance grows with the square of turns and layers: {}"
    grows += f"; {away} takes less of it away" if away else ""
    yield (TOO_SMALL if refused else SMALL_BUT_DRIVEN).found(
        "coil.turns", worst.value, floor, "H", sigma=sigmas_between(worst, floor),
        advice=lambda left: more_copper(design.spec, growth**0.5, left, grows), or_away=f", or {away}" if away else "",
        where=where(worst), other_states=other_states(design, worst, "inductance", "H", 4),
        in_sigmas=in_sigmas(worst, floor, "H"),
    )


def _resistance_floor(design: Design) -> str:
    """The name of the least parallel resistance that the drive of this sensor sustains."""
    strong = design.estimates.readout.high_current and len(design.estimates.coils) == 1
    return "parallel_resistance_high_current" if strong else "parallel_resistance_driveable"


def frequency_ceiling(design: Design) -> Iterator[Verdict]:
    """Highest and lowest sensor frequency over all coils and states."""
    low, high = design.converter.limit("sensor_frequency_min"), design.converter.limit("sensor_frequency_max")
    yield from undecided(design, "frequency")
    worst = worst_of(design, "frequency", max)
    if worst is not None and worst.value > high:
        now = design.estimates.readout.capacitance
        whole = next(coil.capacitance for coil in design.estimates.coils if coil.name == worst.coil)
        wanted = now + whole * ((worst.value / (0.95 * high)) ** 2 - 1.0)
        fitting = [value for value in preferred_values(design.converter) if value >= wanted]
        larger = list(capacitor(design.spec, fitting[:3]))
        yield TOO_FAST.found("readout.capacitance", worst.value, high, "Hz", sigma=sigmas_between(worst, high),
                             advice=lambda left: larger_capacitor(larger, now, left), where=where(worst),
                             other_states=other_states(design, worst, "frequency", "Hz", 4),
                             in_sigmas=in_sigmas(worst, high, "Hz"))
    else:
        hint = "the next larger capacitor of the series, or one of a closer tolerance"
        yield from near_limit(worst, high, "Hz", "frequency", hint, "readout.capacitance")
    lowest = worst_of(design, "frequency", min)
    if lowest is not None and lowest.value < low:
        yield TOO_SLOW.found("readout.capacitance", lowest.value, low, "Hz", where=where(lowest))


def parallel_resistance(design: Design) -> Iterator[Verdict]:
    """The smallest R_P over all coils and states: what the driver can sustain, and what the data sheet specifies."""
    yield from undecided(design, "parallel_resistance")
    yield from overdamped_tank(design)
    worst = worst_of(design, "parallel_resistance", min)
    if worst is None:
        return
    floor_name = _resistance_floor(design)
    strong = floor_name == "parallel_resistance_high_current"
    floor, specified = design.converter.limit(floor_name), design.converter.limit("parallel_resistance_min")
    if worst.value >= specified:
        away = more_distance(design) if worst.state != FREE else ""
        hint = "measure the first boards; " + (
            f"a little {away} makes it safe, or more turns where the coil has room for them"
            if away
            else "a few more turns make it safe, where the coil has room for them"
        )
        yield from near_limit(worst, specified, "ohm", "parallel resistance", hint, "coil.layers")
        return
    is_error = worst.value < floor
    asked = floor if is_error else specified
    growth = (specified / worst.value) ** (1.0 / 3.0)
    case = LOSSY if not is_error else TOO_LOSSY_FOR_ONE if strong else TOO_LOSSY
    grows, away = "R_P = (omega L)^2 / R grows with about the cube of turns and layers", _distance_advice(design, worst)
    yield case.found(
        "coil.layers", worst.value, asked, "ohm",
        source=design.converter.limits[floor_name if is_error else "parallel_resistance_min"].source,
        sigma=sigmas_between(worst, asked),
        advice=lambda left: more_copper(design.spec, growth, left, f"{grows}: {{}}; {away}"), where=where(worst),
        other_states=other_states(design, worst, "parallel_resistance", "ohm"),
        in_sigmas=in_sigmas(worst, asked, "ohm"), distance_advice=away,
    )


def quality_factor(design: Design) -> Iterator[Verdict]:
    """The smallest Q over all coils and states."""
    yield from undecided(design, "quality_factor")
    floor = design.converter.limit("quality_factor_min")
    worst = worst_of(design, "quality_factor", min)
    if worst is not None and worst.value < floor:
        yield LOW_QUALITY.found("coil.trace_width", worst.value, floor, None, where=where(worst),
                                other_states=other_states(design, worst, "quality_factor", ""),
                                distance_advice=_distance_advice(design, worst))


def self_resonance(design: Design) -> Iterator[Verdict]:
    """The sensor frequency as a share of the coil's own resonance."""
    shares = [
        (r.value / coil.self_resonance, r, coil.self_resonance)
        for coil in design.estimates.coils
        for r in readings_of(design, "frequency")
        if r.coil == coil.name and coil.self_resonance and math.isfinite(coil.self_resonance)
    ]
    yield from failed_states(design, "share of the self-resonance")
    if not shares:
        yield Undecided("no self-resonance was estimated")
        return
    share, worst, resonance = max(shares, key=lambda entry: entry[0])
    limit = design.converter.limit
    binding, strict = limit("self_resonance_fraction"), limit("self_resonance_fraction_strict")
    if share <= strict:
        return
    is_error = share > binding
    passed = "self_resonance_fraction" if is_error else "self_resonance_fraction_strict"
    yield NEAR_RESONANCE.found("readout.capacitance", share, limit(passed), None, is_grave=is_error,
                               source=design.converter.limits[passed].source, where=where(worst), value=worst.value,
                               resonance=resonance)


def tank_capacitor(design: Design) -> Iterator[Verdict]:
    """The capacitor within the range of TI's reference designs."""
    value = design.estimates.readout.capacitance
    low, high = design.converter.limit("capacitor_min"), design.converter.limit("capacitor_max")
    if not math.isfinite(value):
        yield Undecided("no capacitor was chosen: no state of the coils could be estimated")
        return
    if not low <= value <= high:
        yield ODD_CAPACITOR.found("readout.capacitance", value, low if value < low else high, "F", low=low, high=high)


# -------------------------------------------------------------------------------------------------------------- advice


def _distance_advice(design: Design, worst: Reading) -> str:
    """How less of the inductance is taken away by metal, in words."""
    if worst.state == FREE:
        return "a higher sensor frequency (smaller capacitor) raises it too"
    spec = design.spec
    has_metal = spec.mount is not None and spec.mount.metal is not None
    ways = ["a larger mount.standoff (board higher over the metal)"] if has_metal else []
    if spec.shield is None and has_metal:
        ways.append("a copper shield")
    elif spec.shield is not None and spec.shield.material.relative_permeability < DRAWS_IN:
        ways.append("a larger shield.gap")
    if spec.target is not None:
        ways.append("a thicker elastomer")
    if not ways:
        return "a higher sensor frequency (smaller capacitor) raises it too"
    return f"{', '.join(ways[:-1])}{' or ' * (len(ways) > 1)}{ways[-1]} takes less of it away"


DRAWS_IN = 1.5
"""Relative permeability from which on a shield draws the field in: nearer, it adds inductance."""


MORE_INDUCTANCE = "inductance grows with the square of turns and layers: more of them, or a larger coil{or_away}"

TOO_SMALL = Case(
    "the inductance of {where} is {measured:H}; below {limit:H} the converter cannot measure it",
    detail="{other_states}; {in_sigmas}", hint=MORE_INDUCTANCE,
)

SMALL_BUT_DRIVEN = Case(
    "the inductance of {where} is {measured:H}; below {limit:H} the converter was found wanting",
    detail="that is a figure for 0.25 kohm at 10 MHz; here frequency and parallel resistance keep their limits, and "
    "leads and contacts are a good part of so small an inductance; {other_states}; {in_sigmas}", hint=MORE_INDUCTANCE,
    severity=Severity.WARNING,
)

TOO_FAST = Case(
    "the tank of {where} runs at {measured:Hz}; the converter stops at {limit:Hz}",
    detail="{other_states}; {in_sigmas}", hint="a larger capacitor, or more inductance",
)

TOO_SLOW = Case(
    "the tank of {where} runs at {measured:Hz}; the converter begins at {limit:Hz}", hint="a smaller capacitor",
)

MORE_RESISTANCE = (
    "R_P = (omega L)^2 / R grows with about the cube of turns and layers: more of them, a larger coil or a finer "
    "pitch; {distance_advice}"
)

TOO_LOSSY = Case(
    "the parallel resistance of {where} is {measured:ohm,3}; the strongest drive needs {limit:ohm}",
    detail="{other_states}; {in_sigmas}", hint=MORE_RESISTANCE,
)

TOO_LOSSY_FOR_ONE = Case(
    "the parallel resistance of {where} is {measured:ohm,3}; the strongest high-current drive needs {limit:ohm}",
    detail="{other_states}; {in_sigmas}", hint=MORE_RESISTANCE,
)

LOSSY = Case(
    "the parallel resistance of {where} is {measured:ohm,3}; the data sheet specifies from {limit:ohm} up",
    detail="{other_states}; {in_sigmas}", hint=MORE_RESISTANCE, severity=Severity.WARNING,
)

LOW_QUALITY = Case(
    "the quality factor of {where} is {measured:.3g}; below {limit:g} the frequency follows losses, too",
    detail="{other_states}; the limit is a rule of thumb, unverified",
    hint=("a smaller capacitor (higher frequency), wider or thicker tracks, or more turns; {distance_advice}"),
)

NEAR_RESONANCE = Case(
    "the tank of {where} runs at {value:Hz}, {measured:%.0f} % of the coil's own resonance at {resonance:Hz}; at most "
    "{limit:%.0f} % is asked",
    hint=("a larger capacitor lowers the frequency; fewer layers or a thicker dielectric raise the resonance"),
    severity=Severity.WARNING, grave=Severity.ERROR,
)

ODD_CAPACITOR = Case(
    "the tank capacitor is {measured:F,3}; TI's reference coils work with {low:F} to {high:F}",
    hint=("below it, pins and cable decide the frequency; above it, C0G parts are large and their own loss counts"),
)

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


RULES: tuple[Rule, ...] = (
    rule_of("SIT201", inductance_floor),
    rule_of("SIT202", frequency_ceiling),
    rule_of("SIT203", parallel_resistance),
    rule_of("SIT205", quality_factor),
    rule_of("SIT206", self_resonance),
    rule_of("SIT214", tank_capacitor),
    rule_of("SIT216", leads_round, named=100.0 * NAMED, warned=100.0 * WARNED),
)
