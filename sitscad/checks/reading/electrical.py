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
from sitscad.checks.fixes.moves import other_start_angles, whole_turns, with_capacitors, with_each_turns
from sitscad.checks.reading.readings import (
    all_readings,
    coil_state_text,
    failed_state_reasons,
    is_below_limit_in_air,
    missing_estimate_errors,
    missing_value_reasons,
    more_copper,
    more_distance_text,
    near_limit_findings,
    other_state_texts,
    overdamped_tank,
    point_to_own_windings,
    worst_beyond_limit,
    worst_reading,
)
from sitscad.checks.rules import Rule, Verdict, not_checked, rule_of, violation_of
from sitscad.data import rows
from sitscad.estimates.circuits.tank import neighbour_values, preferred_values
from sitscad.estimates.design import Design
from sitscad.layout.lanes import Ring
from sitscad.layout.routing.branches import drawn_closing, least_closing
from sitscad.spec.materials import Conductor, Shield, Target
from sitscad.spec.mount import Mount

DRAWS_IN = 1.5
"""Relative permeability of a shield from which a smaller gap to the coils increases the inductance.

Such a shield concentrates the field.
"""


def _resistance_limit_name(high_current: bool, coil_count: int) -> str:
    """Return the name of the converter's limit for the smallest parallel resistance that it can drive.

    `high_current` is True if the spec sets the high-current drive. This drive works for a single coil only.
    `coil_count` is the number of coils.
    """
    strong = high_current and coil_count == 1
    return "parallel_resistance_high_current" if strong else "parallel_resistance_driveable"


def inductance_floor(design: Design) -> Iterator[Verdict]:
    """Yield findings if the smallest inductance of all coils and states is below the converter's minimum, or near."""
    floor, limit = design.spec.readout.device.limit("inductance_min"), design.spec.readout.device.limit
    coils = design.estimates.all_coils
    yield from missing_value_reasons(coils, "inductance")
    worst = worst_reading(coils, "inductance", min)
    if worst is None:
        yield from missing_estimate_errors(coils)
        return
    if worst.value >= floor:
        yield from near_limit_findings("near-inductance", worst, floor, "H", "coil.turns")
        return
    growth = floor / max(worst.value, 0.01 * floor)  # a coarse estimate can be near or below zero
    spec, distance = design.spec, ""
    if not is_below_limit_in_air(coils, worst, "inductance", floor):
        distance = more_distance_text(spec.target, spec.shield, spec.jaw, spec.metal)
    # if the tank is neither too fast nor too lossy for the converter, the converter can measure this inductance
    state = next(coil.states[worst.state] for coil in coils if coil.name == worst.coil)
    is_slow = state.frequency <= limit("sensor_frequency_max")
    least_resistance = limit(_resistance_limit_name(design.estimates.readout.high_current, len(coils)))
    is_measurable = worst.value > 0.0 and is_slow and state.parallel_resistance >= least_resistance
    yield worst_beyond_limit(
        "inductance-unproven" if is_measurable else "inductance-low", worst, floor, "H", "coil.turns",
        hint="inductance-distance" if distance else "inductance-low",
        severity=Severity.WARNING if is_measurable else None, fixes=more_copper(design.spec, growth**0.5, growth),
        states=other_state_texts(coils, worst, "inductance", "H", 4), distance=distance,
        limit_source=design.spec.readout.device.source_of("inductance_min"),
    )


def frequency_ceiling(design: Design) -> Iterator[Verdict]:
    """Yield findings if a coil's sensor frequency in any state is outside the converter's range, or near its top."""
    limit = design.spec.readout.device.limit
    low, high = limit("sensor_frequency_min"), limit("sensor_frequency_max")
    coils = design.estimates.all_coils
    yield from missing_value_reasons(coils, "frequency")
    worst, lowest = (worst_reading(coils, "frequency", choose) for choose in (max, min))
    if worst is not None and worst.value > high:
        now = design.estimates.readout.capacitance
        whole = next(coil.capacitance for coil in coils if coil.name == worst.coil)
        # f = 1 / (2 pi sqrt(L C)), so the total capacitance grows with the square of the frequency ratio
        capacitance = now + whole * ((worst.value / (0.95 * high)) ** 2 - 1.0)
        fitting = [value for value in preferred_values(design.spec.readout.device) if value >= capacitance]
        yield worst_beyond_limit(
            "frequency-high", worst, high, "Hz", "readout.capacitance",
            states=other_state_texts(coils, worst, "frequency", "Hz", 4),
            fixes=(partial(with_capacitors, design.spec, fitting[:2]),), capacitance=now,
        )
    else:
        yield from near_limit_findings("near-frequency", worst, high, "Hz", "readout.capacitance")
    if lowest is not None and lowest.value < low:
        yield violation_of("frequency-low", "readout.capacitance", lowest.value, low, "Hz",
                           where=coil_state_text(lowest))


def parallel_resistance(design: Design) -> Iterator[Verdict]:
    """Yield findings on the smallest parallel resistance over all coils and states.

    Below the resistance that the converter can drive, it is an error. Below the range specified in the data sheet, it
    is a warning. Further findings are on a value near the limit, and on a tank that does not oscillate.
    """
    spec, coils = design.spec, design.estimates.all_coils
    yield from missing_value_reasons(coils, "parallel_resistance")
    yield from overdamped_tank(design)
    worst = worst_reading(coils, "parallel_resistance", min)
    if worst is None:
        return
    floor_name = _resistance_limit_name(design.estimates.readout.high_current, len(coils))
    device, name = spec.readout.device, "parallel_resistance_min"
    specified = device.limit(name)
    if worst.value >= specified:
        for note in near_limit_findings("near-resistance", worst, specified, "ohm", "coil.layers"):
            distance = ""
            if worst.state != FREE:
                distance = more_distance_text(spec.target, spec.shield, spec.jaw, spec.metal)
            yield replace(note, hint_case="near-resistance-distance" if distance else "",
                          values={**note.values, "distance": distance})
        return
    case, severity = "resistance-specified", Severity.WARNING
    if worst.value < device.limit(floor_name):
        name, severity = floor_name, Severity.ERROR
        case = "resistance-high-current" if floor_name.endswith("high_current") else "resistance-drive"
    minimum, growth = device.limit(name), (specified / worst.value) ** (1.0 / 3.0)
    is_short = worst.state != FREE and is_below_limit_in_air(coils, worst, "parallel_resistance", minimum)
    changes = [] if is_short else _hints_for_more_distance(spec.mount, spec.shield, spec.metal, spec.target,
                                                           worst.state == FREE)
    yield worst_beyond_limit(
        case, worst, minimum, "ohm", "coil.layers", hint="resistance-ways" if changes else "resistance-short",
        details=() if changes else ("misses-in-air",), severity=severity, source=device.limits[name].source,
        fixes=more_copper(spec, growth, growth**3), ways=changes,
        states=other_state_texts(coils, worst, "parallel_resistance", "ohm"),
    )


def quality_factor(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the smallest quality factor over all coils and states is below the converter's minimum."""
    coils = design.estimates.all_coils
    yield from missing_value_reasons(coils, "quality_factor")
    floor, worst = design.spec.readout.device.limit("quality_factor_min"), worst_reading(coils, "quality_factor", min)
    if worst is not None and worst.value < floor:
        spec, is_free = design.spec, worst.state == FREE
        is_short = not is_free and is_below_limit_in_air(coils, worst, "quality_factor", floor)
        changes = [] if is_short else _hints_for_more_distance(spec.mount, spec.shield, spec.metal, spec.target,
                                                               is_free)
        states = other_state_texts(coils, worst, "quality_factor", "")
        yield violation_of(
            "quality-low", "coil.trace_width", worst.value, floor, hint="quality-ways" if changes else "",
            details=("quality-rule", *["misses-in-air"] * (not changes), *["other-states"] * bool(states)),
            where=coil_state_text(worst), ways=changes, states=states,
        )


def self_resonance(design: Design) -> Iterator[Verdict]:
    """Yield findings on the sensor frequency as a fraction of the coil's self-resonant frequency."""
    coils = design.estimates.all_coils
    readings = all_readings(coils, "frequency")
    ratios = [
        (r.value / coil.self_resonance, r, coil.self_resonance)
        for coil in coils
        for r in readings
        if r.coil == coil.name and coil.self_resonance and math.isfinite(coil.self_resonance)
    ]
    yield from failed_state_reasons(coils, "share of the self-resonance")
    if not ratios:
        yield not_checked("no-estimate", quantity="self-resonance")
        return
    share, worst, resonance = max(ratios, key=lambda entry: entry[0])
    limits = design.spec.readout.device.limits
    limit, severity = limits["self_resonance_fraction"], Severity.ERROR
    if share <= limit.value:
        limit, severity = limits["self_resonance_fraction_strict"], Severity.WARNING
    if share > limit.value:
        yield violation_of(
            "self-resonance", "readout.capacitance", share, limit.value, severity=severity, source=limit.source,
            where=coil_state_text(worst), frequency=worst.value, resonance=resonance,
        )


def tank_capacitor(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the capacitor is outside the range of TI's reference designs."""
    value = design.estimates.readout.capacitance
    low, high = design.spec.readout.device.limit("capacitor_min"), design.spec.readout.device.limit("capacitor_max")
    if not math.isfinite(value):
        yield not_checked("no-capacitor")
        return
    if not low <= value <= high:
        yield violation_of("tank-capacitor", "readout.capacitance", value, low if value < low else high, "F", low=low,
                           high=high)


def capacitor_sold(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the spec's tank capacitance is not available as a single part.

    The finding's hint names the nearest available values.
    """
    value = design.spec.readout.capacitance
    if value is None or (beside := neighbour_values(value))[0] == beside[1]:
        return
    nearest = min(beside, key=lambda each: abs(math.log(each / value)))
    nearest_first = sorted(beside, key=lambda each: abs(math.log(each / value)))
    yield violation_of("capacitor-sold", "readout.capacitance", value, nearest, "F",
                       values=[show(each, "F", 3) for each in beside],
                       fixes=(partial(with_capacitors, design.spec, nearest_first),))


def _hints_for_more_distance(
    mount: Mount | None, shield: Shield | None, metal: Conductor | None, target: Target | None, is_free: bool
) -> list[str]:
    """Return advice for more distance between the coils and metal, one text for each way.

    If the worst state is the coil in free air (`is_free`), or the sensor has no metal, the only advice is a higher
    frequency.
    """
    has_metal = metal is not None
    is_apart = mount is not None and mount.metal_behind is not None
    changes = [f"a larger {'mount.metal_behind.distance' if is_apart else 'mount.standoff'}"] if has_metal else []
    if shield is None and has_metal:
        changes.append("a copper shield")
    elif shield is not None and shield.material.relative_permeability < DRAWS_IN:
        changes.append("a larger shield.gap")
    if target is not None:
        changes.append("a thicker elastomer")
    return changes if changes and not is_free else ["a higher sensor frequency (smaller capacitor)"]


NOTED_LEAD_FLUX, WARNED = 0.015, 0.03
"""Limits for the inductance that the leads' arc around a coil adds or removes, divided by the winding's inductance.

From the first limit, there is a note. From the second, there is a warning if the arc runs against the winding and
removes inductance. An arc in the winding's sense adds inductance, and also resistance.
"""

LEAST_LEAD_ARC = 0.1
"""Angle (turns) of the leads' arc around the coil, below which there is no finding."""

MAX_TRIED_ANGLES = 3
"""Largest number of changed start angles that are laid out to find a design whose leads do not run round the coil."""

def leads_through_flux(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the coil whose leads, running around it, change its inductance most.

    The change is compared with `NOTED_LEAD_FLUX` and `WARNED`. The hint names turns or start angles at which the leads
    do not run around the coil.
    """
    spec, layout = design.spec, design.layout
    if not all(coil.is_closed_circuit for coil in layout.coils):
        yield not_checked("no-leads")
        return
    # angle (turns, positive in the winding's sense) of leads round their coil, and the fraction of inductance by it
    arcs = [(estimate.lead_parts.get("coupling", 0.0) / estimate.winding_inductance,
             drawn_closing(coil.placement.own or spec.coil, coil), coil, estimate)
            for coil, estimate in zip(layout.coils, design.estimates.all_coils, strict=True)]
    share, turns, coil, estimate = max(arcs, key=lambda arc: round(abs(arc[0]), 6))
    if abs(share) < NOTED_LEAD_FLUX or abs(turns) < LEAST_LEAD_ARC:
        return
    linked, free, moves = estimate.lead_parts.get("coupling", 0.0), estimate.states.get(FREE), 0.0
    if free is not None:
        # Rp = L / (R C): ratio with the arc to without it
        ring = Ring(spec.coil, coil.placement, spec.fpc.rules.trace_spacing + spec.coil.trace_width / 2.0)
        resistance = estimate.resistance_ac * abs(turns) * ring.boundary.length / estimate.trace_length
        moves = free.inductance / (free.inductance - linked) * (1.0 - resistance / free.resistance) - 1.0
    beyond, is_warned = abs(turns) - abs(least_closing(coil.placement.own or spec.coil)), -share >= WARNED
    yield violation_of(
        "lead-on" if turns > 0.0 else "lead-back", "coil.turns", abs(share), WARNED if is_warned else NOTED_LEAD_FLUX,
        hint="lead-on", severity=Severity.WARNING if is_warned else Severity.NOTE,
        details=(*["lead-resistance"] * (free is not None), *["lead-room-missing"] * (beyond > LEAST_LEAD_ARC)),
        # if leads lack room, other start angles come first
        fixes=(lambda: islice(other_start_angles(spec), MAX_TRIED_ANGLES if beyond > LEAST_LEAD_ARC else 0),
               lambda: with_each_turns(spec, whole_turns(spec.coil))),
        coil=coil.name, turns=abs(turns), linked=abs(linked), moves=moves, missing=beyond,
    )


def smallest_coil(design: Design) -> Iterator[Verdict]:
    """Yield a note on a coil smaller than the smallest coil that works with the fabricator's finest tracks.

    The smallest coil just reaches, in free air, the least parallel resistance that the converter drives. It is listed
    in ``data/smallest_coils.csv`` for each profile and shape.
    """
    spec = design.spec
    estimates = design.estimates
    floor = spec.readout.device.limit(_resistance_limit_name(estimates.readout.high_current, len(estimates.all_coils)))
    sizes = {int(row["layers"]): parse_quantity(row["outer_diameter"], "length") for row in rows("smallest_coils")
             if row["profile"] == spec.fpc.rules.name and row["shape"] == spec.coil.shape
             and parse_quantity(row["parallel_resistance"], "resistance") == floor}
    if sizes and spec.coil.size[0] < min(sizes.values()):
        yield violation_of(
            "smallest-coil", "coil.outer_diameter", spec.coil.size[0], min(sizes.values()), "m",
            profile=spec.fpc.rules.name, floor=floor,
            sizes=[f"{show(size, 'm')} ({layers} layers)" for layers, size in sizes.items()],
        )


RULES: tuple[Rule, ...] = (
    rule_of("SIT201", point_to_own_windings(inductance_floor)),
    rule_of("SIT202", frequency_ceiling),
    rule_of("SIT203", point_to_own_windings(parallel_resistance)),
    rule_of("SIT205", point_to_own_windings(quality_factor)),
    rule_of("SIT206", self_resonance),
    rule_of("SIT214", tank_capacitor),
    rule_of("SIT220", capacitor_sold),
    rule_of("SIT216", point_to_own_windings(leads_through_flux), named=100.0 * NOTED_LEAD_FLUX, warned=100.0 * WARNED),
    rule_of("SIT222", smallest_coil),
)
