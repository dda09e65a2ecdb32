"""Hints of SIT014 and SIT016, for specs that were refused because coils or turns lack room: what is named was tried.

Loading knows in closed form how far apart coils must be and how many turns fit, not what their leads and vias need
besides: whoever followed that was refused again, by SIT112 or SIT113.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.checks.changes import Change, fail, fewer_turns
from sitscad.checks.rules import Rule, Subject, apply_rule
from sitscad.finding import Finding, Severity
from sitscad.layout import lay_out, remedies
from sitscad.layout.advice import lead_room
from sitscad.spec.array import least_scale
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.turns import most_turns

MOST_COILS = 4
"""Each trial of a larger array would take many seconds: they keep the hint in closed form."""

MOST_STEPS, MOST_ROUTED = 24, 4
"""Parts of a turn less that are tried to make room inside, and how many of those that do are led out."""

OTHERWISE = {"SIT014": "or smaller coils", "SIT016": "or a finer trace and spacing, more layers, or a larger coil"}
"""What else gives room, by the rule that asks for it."""


def mended(error: SpecError, rules: tuple[Rule, ...]) -> tuple[Finding, ...]:
    """The findings of a refused spec. Those about room name what gives it, leads and vias included, where trying finds
    that, and which of all `rules` the mended design then breaks.
    """
    spec = error.cramped
    if spec is None or len(spec.array.placements) > MOST_COILS or spec.coil.unequal_turns:
        return error.findings
    change = _roomy(spec, {finding.rule for finding in error.findings})
    if change is None:
        return error.findings
    wrong = _broken(change.spec, rules)
    tried = f"(it was tried; {fail(wrong)} then, for other reasons)" if wrong else "(it was tried)"
    hint = f"{change.words} gives room, to leads and vias as well {tried}; "
    return tuple(replace(finding, hint=hint + OTHERWISE[finding.rule]) for finding in error.findings)


def _roomy(spec: SensorSpec, refused: set[str]) -> Change | None:
    """Fewer turns, coils farther apart, or both, with which everything finds its place; None where none is found."""
    for fewer in _fewer(spec) if "SIT016" in refused else (Change("", spec),):
        if "SIT014" not in refused and _is_led_out(fewer.spec):
            return fewer
        apart = _apart(fewer.spec)
        if apart is not None:
            return Change(" with ".join(words for words in (fewer.words, apart.words) if words), apart.spec)
    return None


def _fewer(spec: SensorSpec) -> list[Change]:
    """The most turns that leave room for the vias inside, and some parts of a turn less."""
    coil = spec.coil
    most = most_turns(coil.shape, coil.size, coil.trace_width, coil.pitch)
    fitting = [change for change in fewer_turns(spec, most, MOST_STEPS) if remedies.inner_vias_fit(change.spec)]
    return fitting[:MOST_ROUTED]


def _apart(spec: SensorSpec) -> Change | None:
    """The least distance of the coils that leaves room for the leads and vias between them."""
    near = remedies.nearest_distance(spec)
    scale = None if near is None else least_scale(spec.array, spec.coil)
    if near is None or scale is None:
        return None
    by = max(0.0, near * (scale - 1.0))
    beside = _written_apart(spec, near, by)
    if _is_led_out(beside.spec):
        return beside
    more = remedies.least(beside.spec, remedies.wider_array, _is_led_out, lead_room(beside.spec))
    return None if more is None else _written_apart(spec, near, by + more)


def _written_apart(spec: SensorSpec, near: float, by: float) -> Change:
    """Coils farther apart by so much (m), rounded up as it is written."""
    if spec.array.pitch is None:
        scale = math.ceil((1.0 + by / near) * 1e4 - 1e-6) / 1e4
        words = f"array.centres {scale:.4f} times as far from each other"
        return Change(words, remedies.wider_array(spec, near * (scale - 1.0)))
    pitch = math.ceil((spec.array.pitch + by) * 1e6 - 1e-5) * 1e-6
    # pitch and nearest distance grow alike: coils of a triangle and a grid stand one pitch apart
    return Change(f"array.pitch: {pitch * 1e3:.6g}", remedies.wider_array(spec, pitch - spec.array.pitch))


def _is_led_out(spec: SensorSpec) -> bool:
    """Whether leads and vias find their places; contacts too near each other (SIT119) are another matter."""
    return not any(finding.rule in ("SIT112", "SIT113") for finding in lay_out(spec, advised=False).findings)


def _broken(spec: SensorSpec, rules: tuple[Rule, ...]) -> tuple[str, ...]:
    subject = Subject(spec, lay_out(spec, advised=False))
    return tuple(
        rule.id for rule in rules if any(finding.severity is Severity.ERROR for finding in apply_rule(rule, subject)[0])
    )
