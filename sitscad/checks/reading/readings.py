"""Estimated values by coil and state, which the electrical rules check, and the texts and hints for these values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from sitscad.assembly.places.state import FREE, state_text, working_states
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import (
    longer_coils,
    more_layers,
    more_turns,
    with_capacitors,
    with_each_turns,
)
from sitscad.checks.fixes.references import more_own_turns
from sitscad.checks.fixes.search import Family
from sitscad.checks.rules import Undecided, Verdict, Violation, not_checked, violation_of
from sitscad.estimates.circuits.tank import preferred_values
from sitscad.estimates.design import Design
from sitscad.spec.materials import Conductor, Shield, Target
from sitscad.spec.mount import Jaw
from sitscad.spec.resolver.coils import reference_coil_key
from sitscad.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from sitscad.estimates import CoilEstimate, StateEstimate


@record
class Reading:
    """Value of one quantity of a coil in one state, in SI units.

    `sigma` is the standard deviation of the value by manufacturing tolerances, or None if it is unknown. `cause` is the
    tolerance that contributes most.
    """

    coil: str
    state: str
    value: float
    sigma: float | None = None
    cause: str = ""


def all_readings(coils: Sequence[CoilEstimate], attribute: str, working: bool = False) -> list[Reading]:
    """Return the values of a quantity for all coils and states, without values that are missing or not finite.

    `attribute` is the quantity's name in the state estimates. With `working`, only states of the assembled sensor are
    returned, if there are any.
    """
    # states in which the model failed also count as states of an assembled sensor
    names = [name for coil in coils for name in (*coil.states, *coil.failed_states)]
    counted = working_states(dict.fromkeys(names)) if working else names
    return [
        Reading(coil.name, name, float(value), *_sigma_and_cause(state, attribute))
        for coil in coils
        for name, state in coil.states.items()
        if name in counted
        and (value := getattr(state, attribute)) is not None
        and math.isfinite(value)
    ]


def _sigma_and_cause(state: StateEstimate, attribute: str) -> tuple[float | None, str]:
    scatter = state.spread
    sigma = getattr(scatter, attribute, None)
    if scatter is None or sigma is None or not math.isfinite(sigma) or sigma <= 0.0:
        return None, ""
    return sigma, scatter.causes.get("parallel_resistance" if attribute == "amplitude" else attribute, "")


def sigmas_between(reading: Reading, limit: float) -> float | None:
    """Return the absolute difference between a reading and a limit, in standard deviations of the reading.

    None if the standard deviation is unknown.
    """
    return abs(reading.value - limit) / reading.sigma if reading.sigma else None


def worst_beyond_limit(
    case: str, reading: Reading, limit: float, unit: str, key: str, *, hint: str | Callable[[], str] = "",
    details: tuple[str, ...] = (), severity: Severity | None = None, source: str | None = None,
    fixes: tuple[Family, ...] = (), keeps_limit: bool = False, states: Sequence[str] = (), **values: Any,
) -> Violation:
    """Return the violation for a reading and its limit, with their difference in standard deviations as a detail.

    The detail is left out if the standard deviation is unknown, or if the difference is more than `MAX_STATED_SIGMAS`.
    `case` is the key of the texts in ``data/messages.csv``, and `key` the key of the spec to which the finding points.
    `states` are texts with the values in other states. The other arguments are as in `violation_of`.
    """
    count = sigmas_between(reading, limit)
    is_counted = count is not None and count <= MAX_STATED_SIGMAS
    side = "sigma-below" if reading.value < limit else "sigma-above"
    return violation_of(
        case, key, reading.value, limit, unit or None, hint=hint, severity=severity, source=source, sigma=count,
        details=(*details, *["other-states"] * bool(states), *[side] * is_counted,
                 *["sigma-cause"] * (is_counted and bool(reading.cause))),
        fixes=fixes, keeps_limit=keeps_limit, where=coil_state_text(reading), states=states,
        sigmas=f"{count or 0.0:.1f}",
        bound=show(limit, unit), scatter=show(reading.sigma or 0.0, unit, 2), cause=reading.cause, **values,
    )


MAX_STATED_SIGMAS = 10.0
"""Largest difference between value and limit, in standard deviations of the value, that messages state."""

NEAR = 2.0
"""Difference between a value and its limit, in standard deviations, below which there is a note.

It applies to values that meet the limit.
"""

AT_RISK = 1.0
"""Difference between a value and its limit, in standard deviations, below which there is a warning.

It applies to values that meet the limit. At one standard deviation, about one board in six is beyond the limit.
"""


def more_distance_text(target: Target | None, shield: Shield | None, jaw: Jaw | None, metal: Conductor | None) -> str:
    """Return advice for more distance between the coils and the target or the metal behind the coils.

    Empty if the sensor has no target and no metal behind the coils.
    """
    behind = "shield" if shield else "jaw" if jaw else "metal behind" if metal else ""
    names = [name for name in ("target" if target else "", behind) if name]
    return f"more distance from the {' and the '.join(names)}" if names else ""


def is_below_limit_in_air(coils: Sequence[CoilEstimate], worst: Reading, attribute: str, limit: float) -> bool:
    """Whether the coil of the reading `worst` is below the minimum `limit` in free air, too.

    If it is, more distance from metal does not help. `attribute` is the name of the quantity in the state estimates.
    """
    return any(
        each.coil == worst.coil and each.state == FREE and each.value < limit for each in all_readings(coils, attribute)
    )


def near_limit_findings(case: str, reading: Reading | None, limit: float, unit: str, key: str) -> Iterator[Violation]:
    """Yield a note if a reading meets its limit, but is less than two standard deviations from it.

    Below one standard deviation, it is a warning.
    """
    count = None if reading is None else sigmas_between(reading, limit)
    if reading is not None and count is not None and count < NEAR:
        yield worst_beyond_limit(case, reading, limit, unit, key, keeps_limit=True, within=1 if count < AT_RISK else 2,
                                 severity=Severity.WARNING if count < AT_RISK else Severity.NOTE)


def missing_value_reasons(coils: Sequence[CoilEstimate], attribute: str) -> Iterator[Verdict]:
    """Yield a reason "not checked" for each state without a value of the quantity `attribute`.

    Without these reasons, the rule would count as passed. `attribute` is the name of the quantity in the state
    estimates.
    """
    name_text = attribute.replace("_", " ")
    yield from failed_state_reasons(coils, name_text)
    for coil in coils:
        for name, state in coil.states.items():
            value = getattr(state, attribute)
            if value is None or not math.isfinite(value):
                yield not_checked("no-coil-estimate", quantity=name_text, coil=coil.name, state=state_text(name))


def failed_state_reasons(coils: Sequence[CoilEstimate], value_name: str) -> Iterator[Undecided]:
    """Yield a reason "not checked" for each state that has no estimate because the model fails.

    `value_name` is the name of the missing value in the reason.
    """
    for state, reason in {state: why for coil in coils for state, why in coil.failed_states.items()}.items():
        yield not_checked("state-failed", quantity=value_name, state=state_text(state), reason=reason)


def missing_estimate_errors(coils: Sequence[CoilEstimate]) -> Iterator[Verdict]:
    """Yield an error for each coil without an estimated state.

    For coils whose tank does not oscillate, rule SIT203 has the finding.
    """
    for coil in coils:
        reasons = [reason for state, reason in coil.failed_states.items() if state not in coil.overdamped]
        if reasons and not coil.overdamped:
            yield violation_of("nothing-estimated", "coil", severity=Severity.ERROR, coil=coil.name, reason=reasons[0])
            return


def overdamped_tank(design: Design) -> Iterator[Verdict]:
    """Yield a finding if a tank does not oscillate, on the state with the lowest quality factor."""
    coils = design.estimates.all_coils
    tanks = [(value, coil.name, state) for coil in coils for state, value in coil.overdamped.items()]
    if not tanks:
        return
    value, name, state = min(tanks)
    now = design.estimates.readout.capacitance
    # Q is proportional to sqrt(L/C): capacitors that raise Q to 10 or more, far from overdamped
    device = design.spec.readout.device
    below = [each for each in reversed(preferred_values(device)) if each <= now * (value / 10.0) ** 2]
    yield violation_of(
        "overdamped", "readout.capacitance", value, 1.0, severity=Severity.ERROR,
        fixes=(partial(with_capacitors, design.spec, below[:2]),), where=coil_state_text(Reading(name, state, value)),
        capacitance=now,
    )


def worst_reading(
    coils: Sequence[CoilEstimate], attribute: str, choose: Callable[..., Reading], working: bool = False
) -> Reading | None:
    """Return the smallest or largest reading of a quantity (`choose`: min or max). None if there are no readings.

    `attribute` is the quantity's name in the state estimates. With `working`, only states of the assembled sensor are
    compared.
    """
    readings = all_readings(coils, attribute, working)
    return choose(readings, key=lambda reading: reading.value) if readings else None


def coil_state_text(reading: Reading) -> str:
    """Return a reading's coil and state as text."""
    return f"coil {reading.coil} {state_text(reading.state)}"


def other_state_texts(
    coils: Sequence[CoilEstimate], worst: Reading, attribute: str, unit: str, digits: int = 3
) -> list[str]:
    """Return texts with the values of the coil of `worst` in its other states, with `digits` significant digits."""
    readings = [r for r in all_readings(coils, attribute) if r.coil == worst.coil and r.state != worst.state]
    return [f"{state_text(r.state)} {show(r.value, unit, digits)}" for r in readings]


def point_to_own_windings(apply: Callable[[Design], Iterable[Verdict]]) -> Callable[[Design], Iterator[Verdict]]:
    """Return the function of a rule whose findings on a reference coil point to the keys of the coil's own windings.

    `apply` yields findings that point to keys of the section ``coil``. If the reference coil has its own windings, the
    changes to try are changes of these windings.
    """

    def applied(design: Design) -> Iterator[Verdict]:
        spec = design.spec
        own, name = spec.reference_coil, spec.all_placements[-1].name
        for verdict in apply(design):
            if own is not spec.coil and isinstance(verdict, Violation) and (verdict.key or "").startswith("coil."):
                where = str(verdict.values.get("where", f"coil {verdict.values.get('coil')}"))
                if f"{where} ".startswith(f"coil {name} "):
                    fixes = (partial(more_own_turns, spec),)
                    verdict = replace(verdict, key=reference_coil_key(verdict.key or ""), fixes=fixes)
            yield verdict

    return applied


def more_copper(spec: SensorSpec, factor: float, length: float) -> tuple[Family, ...]:
    """Return families of changes that add copper: more turns, more layers, and longer coils.

    In each family, the numbers of turns or of layers are multiplied by at least `factor`. The length of a long coil is
    multiplied by at least `length`, a factor, too.
    """
    return (lambda: with_each_turns(spec, more_turns(spec.coil, factor)), partial(more_layers, spec, factor),
            partial(longer_coils, spec, length))
