"""What an evaluation says of one design: its figures with what each can be off by, and which rules refuse it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cache
from sys import intern
from typing import Any

from sitscad.record import record

OK, FAILS, UNKNOWN = "ok", "fails", "unknown"
"""Verdicts: no rule refuses the design; one does; some could not be decided, and none refuses it."""

FULL, SCREEN = "full", "screen"
"""Levels: what `check` does, without hints; and the quick one, which states the error of each figure."""


BROKEN = 0.05
"""What any breach weighs, however near to its limit: two rules are more than one."""


@record
class Breach:
    """How far a design lies beyond what a rule asks: figure and limit (SI, in `unit`), None where the rule has none."""

    measured: float | None = None
    limit: float | None = None
    unit: str = ""

    @property
    def size(self) -> float:
        """What a search takes it for: `BROKEN`, and the distance from the limit over the larger of both; 1 where the
        rule has no figures.
        """
        if self.measured is None or self.limit is None:
            return 1.0
        return BROKEN + abs(self.measured - self.limit) / max(abs(self.limit), abs(self.measured), 1e-300)


@record
class Evaluation:
    """One design, evaluated.

    ``values`` are figures by the measure's name, each with what it may be off by (SI); ``absent`` says why a measure
    that was asked for is not among them. ``refused`` are the rules that find an error, each with its largest breach,
    ``warned`` those that warn and find no error; ``unknown`` are rules whose needs the design meets and that could not
    be decided.
    """

    values: Mapping[str, tuple[float, float]]
    absent: Mapping[str, str] = field(default_factory=dict)
    refused: Mapping[str, Breach] = field(default_factory=dict)
    warned: Mapping[str, Breach] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    level: str = FULL

    @property
    def verdict(self) -> str:
        """`OK`, `FAILS` or `UNKNOWN`. In full the design passes where `check` passes it, whatever was not checked."""
        return FAILS if self.refused else UNKNOWN if self.unknown and self.level != FULL else OK

    @property
    def refused_by(self) -> tuple[str, ...]:
        """The rules that find an error."""
        return tuple(self.refused)

    @property
    def warned_by(self) -> tuple[str, ...]:
        """The rules that warn."""
        return tuple(self.warned)

    def as_json(self) -> dict[str, Any]:
        """Plain values, as `of_json` reads them back."""
        return {
            "level": self.level, "verdict": self.verdict,
            "values": {name: list(pair) for name, pair in self.values.items()}, "absent": dict(self.absent),
            "refused": {rule: [one.measured, one.limit, one.unit] for rule, one in self.refused.items()},
            "warned": {rule: [one.measured, one.limit, one.unit] for rule, one in self.warned.items()},
            "unknown": list(self.unknown),
        }


def of_json(said: Mapping[str, Any]) -> Evaluation:
    """The evaluation that `Evaluation.as_json` said; raises KeyError, TypeError or ValueError for anything else. What
    many designs have alike is held once.
    """
    values = {intern(name): (float(value), float(error)) for name, (value, error) in said["values"].items()}
    absent = {intern(name): intern(why) for name, why in said["absent"].items()}
    refused, warned = ({intern(rule): Breach(*one) for rule, one in said[part].items()}
                       for part in ("refused", "warned"))
    unknown = _alike(tuple(map(intern, said["unknown"])))
    return Evaluation(values, absent or NONE, refused or NONE, warned or NONE, unknown, intern(said["level"]))


NONE: Mapping[str, Any] = {}
"""Stands for all that are empty."""


@cache
def _alike(rules: tuple[str, ...]) -> tuple[str, ...]:
    return rules
