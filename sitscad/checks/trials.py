"""Whether a change of the spec mends a finding: the changed design is laid out, estimated and checked before it is
named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

from sitscad.checks.rules import Outcome, Rule, Subject, located, outcomes
from sitscad.finding import Finding, NotChecked, Severity
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
        self._errors = _errors(said)
        self._known: list[tuple[SensorSpec, frozenset[_Place], Counter[str]]] = []

    def advised(self, outcome: Outcome) -> Finding:
        """The finding with the hint that its rule gives, once it can tell which changes mend it."""
        finding, advice = outcome.finding, outcome.advice
        if advice is None:
            return finding
        hint = advice(lambda changed: self._left(finding, changed))
        return located(replace(finding, hint=hint, line=None, column=None), self._subject.spec)

    def _left(self, finding: Finding, changed: SensorSpec) -> tuple[str, ...]:
        """What a changed design breaks: the rule itself if it still complains of the same key or cannot be applied any
        more, others of which the same key is still an error, and every rule with more errors.
        """
        known = next((entry for entry in self._known if entry[0] == changed), None)
        if known is None:
            known = changed, *self._tried(changed)
            self._known.append(known)
        _, complaining, new = known
        unknown = set() if finding.rule in self._undecided else {(finding.rule, None)}
        is_left = {(finding.rule, finding.key), *unknown} & complaining
        same_key = {rule for rule, key in complaining if key == finding.key and self._errors[rule]}
        return tuple(sorted({*new, *same_key, *({finding.rule} if is_left else ())}))

    def _tried(self, changed: SensorSpec) -> tuple[frozenset[_Place], Counter[str]]:
        """Which rules complain of which keys of a changed design (of None: cannot judge it), and those with new errors;
        looking no further than the first rule of those, for estimates take long.
        """
        subject = self._subject.drawn(changed)
        complaining: set[_Place] = set()
        errors: Counter[str] = Counter()
        for rule in self._rules:
            said, undecided = outcomes(rule, subject)
            complaining |= {(one.rule, one.key) for one in map(_finding, said) if one.severity is not Severity.NOTE}
            complaining |= {(one.rule, None) for one in undecided}
            errors += _errors(said)
            if errors - self._errors:
                break
        return frozenset(complaining), errors - self._errors


def _errors(said: Iterable[Outcome]) -> Counter[str]:
    return Counter(one.finding.rule for one in said if one.finding.severity is Severity.ERROR)


def _finding(outcome: Outcome) -> Finding:
    return outcome.finding
