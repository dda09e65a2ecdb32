"""Whether a change of the spec mends a finding: the changed design is laid out, estimated and checked before it is
named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

from sitscad.checks.rules import Outcome, Rule, Subject, located, outcomes
from sitscad.finding import Finding, NotChecked, Severity
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

_Place = tuple[str, str | None]
"""A rule and the key that it complains of."""


class Trials:
    """Tries changes of a design. ``rules`` are all rules, ``said`` what they say of the design as it stands, and
    ``undecided`` those that could not be applied to it, or not wholly.
    """

    def __init__(
        self, subject: Subject, rules: Sequence[Rule], said: Iterable[Outcome], undecided: Iterable[NotChecked] = ()
    ) -> None:
        self._subject, self._rules = subject, rules
        self._undecided = {one.rule for one in undecided}
        said = tuple(said)
        self._errors = _errors(said)
        self._complaints = Counter(one.rule for one in _complaints(said))
        self._known: list[tuple[SensorSpec, _Tried]] = []

    def advised(self, outcome: Outcome) -> Finding:
        """The finding with the hint that its rule gives, once it can tell which changes mend it."""
        finding, advice = outcome.finding, outcome.advice
        if advice is None:
            return finding
        hint = advice(_Left(self, finding))
        return located(replace(finding, hint=hint, line=None, column=None), self._subject.spec)

    def broken(self, finding: Finding, changed: SensorSpec) -> tuple[str, ...]:
        """What a changed design breaks: the rule itself if it still complains of the same key or cannot be applied any
        more, others of which the same key is still an error, and every rule with more errors.
        """
        tried = self._tried(changed)
        unknown = set() if finding.rule in self._undecided else {(finding.rule, None)}
        is_left = {(finding.rule, finding.key), *unknown} & tried.complaining
        same_key = {rule for rule, key in tried.complaining if key == finding.key and self._errors[rule]}
        return tuple(sorted({*tried.errors, *same_key, *({finding.rule} if is_left else ())}))

    def warned(self, changed: SensorSpec) -> tuple[str, ...]:
        """The rules that complain more often of a changed design than of the design as it stands."""
        return tuple(sorted(self._tried(changed).complaints))

    def _tried(self, changed: SensorSpec) -> _Tried:
        """What is said of a changed design, found once; looking no further than the first rule with new errors, for
        estimates take long.
        """
        known = next((tried for spec, tried in self._known if spec == changed), None)
        if known is None:
            known = self._try(changed)
            self._known.append((changed, known))
        return known

    def _try(self, changed: SensorSpec) -> _Tried:
        subject = self._subject.drawn(changed)
        complaining: set[_Place] = set()
        errors: Counter[str] = Counter()
        complaints: Counter[str] = Counter()
        for rule in self._rules:
            said, undecided = outcomes(rule, subject)
            complaining |= {(one.rule, one.key) for one in _complaints(said)}
            complaining |= {(one.rule, None) for one in undecided}
            complaints += Counter(one.rule for one in _complaints(said))
            errors += _errors(said)
            if errors - self._errors:
                break
        return _Tried(frozenset(complaining), errors - self._errors, complaints - self._complaints)


@record
class _Tried:
    """Which rules complain of which keys of a changed design (of None: cannot judge it), and how many more errors and
    complaints (errors and warnings) each rule has than of the design as it stands.
    """

    complaining: frozenset[_Place]
    errors: Counter[str]
    complaints: Counter[str]


@record
class _Left:
    """What changes leave of one finding to complain of."""

    trials: Trials
    finding: Finding

    def __call__(self, changed: SensorSpec, /) -> tuple[str, ...]:
        return self.trials.broken(self.finding, changed)

    def warned(self, changed: SensorSpec) -> tuple[str, ...]:
        return self.trials.warned(changed)


def _errors(said: Iterable[Outcome]) -> Counter[str]:
    return Counter(one.rule for one in _complaints(said) if one.severity is Severity.ERROR)


def _complaints(said: Iterable[Outcome]) -> list[Finding]:
    """What is said that is no mere note."""
    return [one.finding for one in said if one.finding.severity is not Severity.NOTE]
