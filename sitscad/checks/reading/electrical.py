"""SIT201 to SIT203, SIT205, SIT206, SIT214, SIT216, SIT220, SIT222: electrical values of the coils against limits.

The values of every state are checked against the limits of the converter. SIT216 checks the inductance of leads that
run round their coil.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import islice

from sitscad.assembly.places.state import FREE
from sitscad.basics.finding import Severity
from sitscad.basics.units import parse_quantity, show
from sitscad.checks.fixes.moves import capacitor, other_start_angles, whole_turns
from sitscad.checks.reading.readings import (
    Reading,
    failed_states,
    in_sigmas,
    is_short_alone,
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
from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, joined, rule_of, violated
from sitscad.data import rows
from sitscad.estimates.circuits.tank import neighbour_values, preferred_values
from sitscad.estimates.design import Design
from sitscad.layout.lanes import Ring
from sitscad.layout.routing.branches import drawn_closing, least_closing

INDUCTANCE_GROWS = "inductance grows with the square of turns and layers"

DRAWS_IN = 1.5
"""Relative permeability from which a shield concentrates the field: at a smaller distance it adds inductance."""


def _resistance_floor(design: Design) -> str:
    """Return the name of the limit for the smallest parallel resistance that this sensor's drive sustains."""
    strong = design.estimates.readout.high_current and len(design.estimates.coils) == 1
    return "parallel_resistance_high_current" if strong else "parallel_resistance_driveable"


def inductance_floor(design: Design) -> Iterator[Verdict]:
    """Yield findings on the smallest inductance over all coils and states."""
    floor, limit = design.spec.readout.device.limit("inductance_min"), design.spec.readout.device.limit
    yield from undecided(design, "inductance")
    worst = worst_of(design, "inductance", min)
    if worst is None:
        yield from nothing_estimated(design)
        return
    if worst.value >= floor:
        yield from near_limit(worst, floor, "H", "inductance",
                              "a few more turns make it safe, where the coil has room for them", "coil.turns")
        return
    growth = floor / max(worst.value, 0.01 * floor)  # a coarse estimate can be near or below zero
    away = "" if is_short_alone(design, worst, "inductance", floor) else more_distance(design.spec)
    found = Violation(
        f"the inductance of {where(worst)} is {show(worst.value, 'H')}; below {show(floor, 'H')} the converter cannot "
        f"measure it", f"{INDUCTANCE_GROWS}: more of them, or a larger coil{f', or {away}' if away else ''}",
        "coil.turns", worst.value, floor, "H", sigma=sigmas_between(worst, floor),
        fixes=more_copper(design.spec, growth**0.5, growth),
        detail=_beside(design, worst, "inductance", floor, "H", 4),
    )
    # if the tank is neither too fast nor too lossy for the converter, the converter can measure this inductance
    state = next(coil.states[worst.state] for coil in design.estimates.coils if coil.name == worst.coil)
    is_slow = state.frequency <= limit("sensor_frequency_max")
    if worst.value > 0.0 and is_slow and state.parallel_resistance >= limit(_resistance_floor(design)):
        found = replace(
            found, message=f"the inductance of {where(worst)} is {show(worst.value, 'H')}; below {show(floor, 'H')} "
            "the converter was found wanting", severity=Severity.WARNING,
            detail=joined(f"the figure is of {design.spec.readout.device.source_of('inductance_min')}; here "
                          "frequency and parallel resistance keep their limits, and leads and contacts are a good "
                          "part of so small an inductance", found.detail),
        )
    yield found


def _beside(design: Design, worst: Reading, attribute: str, limit: float, unit: str, digits: int = 3) -> str:
    """Return text with the coil's other states and the reading's distance from its limit in sigma."""
    return joined(other_states(design, worst, attribute, unit, digits), in_sigmas(worst, limit, unit))


def frequency_ceiling(design: Design) -> Iterator[Verdict]:
    """Yield findings on the highest and lowest sensor frequency over all coils and states."""
    limit = design.spec.readout.device.limit
    low, high = limit("sensor_frequency_min"), limit("sensor_frequency_max")
    yield from undecided(design, "frequency")
    worst, lowest = (worst_of(design, "frequency", choose) for choose in (max, min))
    if worst is not None and worst.value > high:
        now = design.estimates.readout.capacitance
        whole = next(coil.capacitance for coil in design.estimates.coils if coil.name == worst.coil)
        # f = 1 / (2 pi sqrt(L C)), so the total capacitance grows with the square of the frequency ratio
        wanted = now + whole * ((worst.value / (0.95 * high)) ** 2 - 1.0)
        fitting = [value for value in preferred_values(design.spec.readout.device) if value >= wanted]
        yield Violation(
            f"the tank of {where(worst)} runs at {show(worst.value, 'Hz')}; the converter stops at {show(high, 'Hz')}",
            f"a larger capacitor than {show(now, 'F', 3)}, more turns or layers, or a larger coil",
            "readout.capacitance", worst.value, high, "Hz",
            sigma=sigmas_between(worst, high), fixes=(partial(capacitor, design.spec, fitting[:2]),),
            detail=_beside(design, worst, "frequency", high, "Hz", 4),
        )
    else:
        hint = "the next larger capacitor of the series, or one of a closer tolerance"
        yield from near_limit(worst, high, "Hz", "frequency", hint, "readout.capacitance")
    if lowest is not None and lowest.value < low:
        yield Violation(
            f"the tank of {where(lowest)} runs at {show(lowest.value, 'Hz')}; the converter begins at "
            f"{show(low, 'Hz')}", "a smaller capacitor", "readout.capacitance", lowest.value, low, "Hz",
        )


def parallel_resistance(design: Design) -> Iterator[Verdict]:
    """Yield findings on the smallest R_P over all coils and states.

    The limits are the smallest resistance that the driver sustains and the data sheet's specified range.
    """
    yield from undecided(design, "parallel_resistance")
    yield from overdamped_tank(design)
    worst = worst_of(design, "parallel_resistance", min)
    if worst is None:
        return
    floor_name, name = _resistance_floor(design), "parallel_resistance_min"
    device = design.spec.readout.device
    specified = device.limit(name)
    if worst.value >= specified:
        away = more_distance(design.spec) if worst.state != FREE else ""
        way = f"a little {away} makes it safe, or more turns" if away else "a few more turns make it safe,"
        yield from near_limit(worst, specified, "ohm", "parallel resistance",
                              f"measure the first boards; {way} where the coil has room for them", "coil.layers")
        return
    severity, needs = Severity.WARNING, f"the data sheet specifies from {show(specified, 'ohm')} up"
    if worst.value < device.limit(floor_name):
        name, severity, strong = floor_name, Severity.ERROR, "high-current " * floor_name.endswith("high_current")
        needs = f"the strongest {strong}drive needs {show(device.limit(name), 'ohm')}"
    asked, growth = device.limit(name), (specified / worst.value) ** (1.0 / 3.0)
    grows = "R_P = (omega L)^2 / R grows with about the cube of turns and layers"
    away = _distance_advice(design, worst, "parallel_resistance", asked)
    yield Violation(
        f"the parallel resistance of {where(worst)} is {show(worst.value, 'ohm', 3)}; {needs}",
        f"{grows}: more of them, a larger coil or a finer pitch; {away}", "coil.layers", worst.value, asked, "ohm",
        severity, device.limits[name].source, sigma=sigmas_between(worst, asked),
        fixes=more_copper(design.spec, growth, growth**3),
        detail=_beside(design, worst, "parallel_resistance", asked, "ohm"),
    )


def quality_factor(design: Design) -> Iterator[Verdict]:
    """Yield findings on the smallest Q over all coils and states."""
    yield from undecided(design, "quality_factor")
    floor, worst = design.spec.readout.device.limit("quality_factor_min"), worst_of(design, "quality_factor", min)
    if worst is not None and worst.value < floor:
        yield Violation(
            f"the quality factor of {where(worst)} is {worst.value:.3g}; below {floor:g} the frequency follows losses, "
            "too", "a smaller capacitor (higher frequency), wider or thicker tracks, or more turns; "
            f"{_distance_advice(design, worst, 'quality_factor', floor)}", "coil.trace_width", worst.value, floor,
            detail=joined(other_states(design, worst, "quality_factor", ""),
                          "the limit is a rule of thumb, unverified"),
        )


def self_resonance(design: Design) -> Iterator[Verdict]:
    """Yield findings on the sensor frequency as a fraction of the coil's self-resonant frequency."""
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
    limits = design.spec.readout.device.limits
    limit, severity = limits["self_resonance_fraction"], Severity.ERROR
    if share <= limit.value:
        limit, severity = limits["self_resonance_fraction_strict"], Severity.WARNING
    if share > limit.value:
        yield Violation(
            f"the tank of {where(worst)} runs at {show(worst.value, 'Hz')}, {100.0 * share:.0f} % of the coil's own "
            f"resonance at {show(resonance, 'Hz')}; at most {100.0 * limit.value:.0f} % is asked",
            "a larger capacitor lowers the frequency; fewer layers or a thicker dielectric raise the resonance",
            "readout.capacitance", share, limit.value, None, severity, limit.source,
        )


def tank_capacitor(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the capacitor is outside the range of TI's reference designs."""
    value = design.estimates.readout.capacitance
    low, high = design.spec.readout.device.limit("capacitor_min"), design.spec.readout.device.limit("capacitor_max")
    if not math.isfinite(value):
        yield Undecided("no capacitor was chosen: no state of the coils could be estimated")
        return
    if not low <= value <= high:
        yield Violation(
            f"the tank capacitor is {show(value, 'F', 3)}; TI's reference coils work with {show(low, 'F')} to "
            f"{show(high, 'F')}",
            "below it, pins and cable decide the frequency; above it, C0G parts are large and their own loss counts",
            "readout.capacitance", value, low if value < low else high, "F",
        )


def capacitor_sold(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the spec's tank capacitance is not available as a single part.

    Its hint names the nearest values.
    """
    value = design.spec.readout.capacitance
    if value is None or (beside := neighbour_values(value))[0] == beside[1]:
        return
    nearest = min(beside, key=lambda each: abs(math.log(each / value)))
    names = " or ".join(show(each, "F", 3) for each in beside)
    hint = f"readout.capacitance: {names}; or auto"
    nearest_first = sorted(beside, key=lambda each: abs(math.log(each / value)))
    yield Violation(
        f"a capacitor of {show(value, 'F', 5)} is not sold as one part; the nearest values of series E24 are {names}",
        hint, "readout.capacitance", value, nearest, "F",
        fixes=(partial(capacitor, design.spec, nearest_first),),
    )


def _distance_advice(design: Design, worst: Reading, attribute: str, limit: float) -> str:
    """Return advice for more distance from metal.

    If the coil misses the limit in free air, the text states that distance does not mend it.
    """
    spec = design.spec
    if worst.state != FREE and is_short_alone(design, worst, attribute, limit):
        return "more distance from metal does not mend it: the coil misses the limit in free air, too"
    has_metal = spec.metal is not None
    is_apart = spec.mount is not None and spec.mount.metal_behind is not None
    key = "mount.metal_behind.distance" if is_apart else "mount.standoff"
    ways = [f"a larger {key} (board higher over the metal)"] if has_metal else []
    if spec.shield is None and has_metal:
        ways.append("a copper shield")
    elif spec.shield is not None and spec.shield.material.relative_permeability < DRAWS_IN:
        ways.append("a larger shield.gap")
    if spec.target is not None:
        ways.append("a thicker elastomer")
    if not ways or worst.state == FREE:
        return "a higher sensor frequency (smaller capacitor) raises it too"
    return f"{', '.join(ways[:-1])}{' or ' * (len(ways) > 1)}{ways[-1]} takes less of it away"


NAMED, WARNED = 0.015, 0.03
"""Fractions of the winding's inductance: the flux that leads link is reported from the first on.

If a lead runs against the winding, the second gives a warning. Leads that run with the winding add inductance for their
resistance.
"""

TOGETHER = 0.1
"""Angle (turns) round the coil up to which leads count as running together."""

TRIED = 3
"""Number of changed designs that are laid out to find a design without a closing arc."""

WHOLE_TURNS = "turns whose sum over the layers is whole let the leads run together"


def leads_round(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the coil whose leads link the largest fraction of its winding's flux.

    The hint names turns or a start angle that avoid this.
    """
    spec, layout = design.spec, design.layout
    if not all(coil.is_closed_circuit for coil in layout.coils):
        yield Undecided("leads are missing in the layout")
        return
    # angle (turns, positive in the winding's sense) of leads round their coil, and the fraction of inductance by it
    arcs = [(estimate.lead_parts.get("coupling", 0.0) / estimate.winding_inductance, drawn_closing(spec.coil, coil),
             coil, estimate) for coil, estimate in zip(layout.coils, design.estimates.coils, strict=True)]
    share, turns, coil, estimate = max(arcs, key=lambda arc: round(abs(arc[0]), 6))
    if abs(share) < NAMED or abs(turns) < TOGETHER:
        return
    linked, free, moves = estimate.lead_parts.get("coupling", 0.0), estimate.states.get(FREE), ""
    if free is not None:
        # Rp = L / (R C): ratio with the arc to without it
        ring = Ring(spec.coil, coil.placement, spec.fpc.rules.trace_spacing + spec.coil.trace_width / 2.0)
        resistance = estimate.resistance_ac * abs(turns) * ring.boundary.length / estimate.trace_length
        parallel = free.inductance / (free.inductance - linked) * (1.0 - resistance / free.resistance) - 1.0
        moves = f" and moves Rp by about {100.0 * parallel:+.1f} %"
    beyond, is_warned = abs(turns) - abs(least_closing(spec.coil)), -share >= WARNED
    no_room = f" ({beyond:.2f} of them for want of room beside the coils)" if beyond > TOGETHER else ""
    way, does = ("on", "adds") if turns > 0.0 else ("back", "takes away")
    yield Violation(
        f"a lead of {coil.name} runs {abs(turns):.2f} turns {way} round the coil by itself{no_room}: that {does} "
        f"{show(abs(linked), 'H', 3)}, {100.0 * abs(share):.1f} % of the winding's inductance,{moves}", WHOLE_TURNS,
        "coil.turns", abs(share), WARNED if is_warned else NAMED,
        severity=Severity.WARNING if is_warned else Severity.NOTE,
        # if leads lack room, other start angles come first
        fixes=(lambda: islice(other_start_angles(spec), TRIED if beyond > TOGETHER else 0), lambda: whole_turns(spec)),
    )


def smallest_coil(design: Design) -> Iterator[Verdict]:
    """Yield a note on a round coil smaller than the smallest that senses with the tracks of its profile.

    The smallest coil is computed in free air, for the least parallel resistance that the converter drives.
    """
    spec = design.spec
    floor = spec.readout.device.limit(_resistance_floor(design))
    sizes = {int(row["layers"]): parse_quantity(row["outer_diameter"], "length") for row in rows("smallest_coils")
             if row["profile"] == spec.fpc.rules.name and row["shape"] == spec.coil.shape
             and parse_quantity(row["parallel_resistance"], "resistance") == floor}
    if sizes and spec.coil.size[0] < min(sizes.values()):
        yield violated(
            "smallest-coil", "coil.outer_diameter", spec.coil.size[0], min(sizes.values()), "m",
            profile=spec.fpc.rules.name, floor=floor,
            sizes=[f"{show(size, 'm')} ({layers} layers)" for layers, size in sizes.items()],
        )


RULES: tuple[Rule, ...] = (
    rule_of("SIT201", inductance_floor),
    rule_of("SIT202", frequency_ceiling),
    rule_of("SIT203", parallel_resistance),
    rule_of("SIT205", quality_factor),
    rule_of("SIT206", self_resonance),
    rule_of("SIT214", tank_capacitor),
    rule_of("SIT220", capacitor_sold),
    rule_of("SIT216", leads_round, named=100.0 * NAMED, warned=100.0 * WARNED),
    rule_of("SIT222", smallest_coil),
)
