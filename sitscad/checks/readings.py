"""The numbers of the estimates that the electrical rules judge: one a coil and state, and the words for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sitscad.checks.rules import Subject, Undecided, Verdict
from sitscad.readout import ldc1614
from sitscad.units import show

STATE_WORDS = {"free": "alone in free air", "rest": "at rest", "pressed": "pressed"}


@dataclass(frozen=True)
class Reading:
    """One number of one coil in one state."""

    coil: str
    state: str
    value: float


def readings_of(subject: Subject, attribute: str, working: bool = False) -> list[Reading]:
    """Every finite value of a state estimate's attribute; `working`: of the assembled sensor where there is one."""
    assembled = is_assembled(subject)
    return [
        Reading(coil.name, name, float(value))
        for coil in subject.estimates.coils
        for name, state in coil.states.items()
        if not (working and assembled and name == "free")
        and (value := getattr(state, attribute)) is not None
        and math.isfinite(value)
    ]


def is_assembled(subject: Subject) -> bool:
    """Whether any state but the coil's own exists."""
    return any(name != "free" for coil in subject.estimates.coils for name in coil.states)


def undecided(subject: Subject, attribute: str) -> Iterator[Verdict]:
    """A reason for every state without the number: silence must not look like a pass."""
    for coil in subject.estimates.coils:
        for name, state in coil.states.items():
            value = getattr(state, attribute)
            if value is None or not math.isfinite(value):
                words = attribute.replace("_", " ")
                yield Undecided(f"no {words} was estimated for coil {coil.name} {STATE_WORDS.get(name, name)}")


def worst_of(subject: Subject, attribute: str, choose: Callable[..., Reading], working: bool = False) -> Reading | None:
    """The reading that `choose` (min or max) picks by value; None where there is none."""
    found = readings_of(subject, attribute, working)
    return choose(found, key=lambda reading: reading.value) if found else None


def where(reading: Reading) -> str:
    """Coil and state in words."""
    return f"coil {reading.coil} {STATE_WORDS.get(reading.state, reading.state)}"


def other_states(subject: Subject, worst: Reading, attribute: str, unit: str) -> str:
    """The same coil's other states, in brackets."""
    others = [r for r in readings_of(subject, attribute) if r.coil == worst.coil and r.state != worst.state]
    words = [
        f"{STATE_WORDS.get(r.state, r.state)} {show(r.value, unit, 3) if unit else f'{r.value:.3g}'}" for r in others
    ]
    return f" ({', '.join(words)})" if words else ""


def source_of_limit(name: str) -> str:
    """Where one of the converter's limits comes from."""
    return ldc1614.limits()[name].source
