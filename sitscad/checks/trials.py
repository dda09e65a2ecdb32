"""Trials of changed designs: each is laid out, estimated and checked by all rules, within a limit of trials (`Budget`).

If a spec could not be loaded, each fix is written into its text, and the text is loaded again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from sitscad.basics.finding import Finding, NotChecked, Remedy, Severity
from sitscad.basics.messages import text_of
from sitscad.checks.fixes.mending import AppliedFix, are_former_findings_gone, is_better, worsened_rules
from sitscad.checks.fixes.moves import families_for_room
from sitscad.checks.fixes.search import DRAWN, Budget, Fix, RemainingProblems, Search, cut_short_hint, hint_text, search
from sitscad.checks.rules import Outcome, Rule, locate_finding, rule_outcomes
from sitscad.estimates.design import Design, has_same_board
from sitscad.layout.routing.escape import SearchLimit
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.rewriting import CannotWriteError, complete_edits, rewritten
from sitscad.spec.yaml.source import SpecSource


class Trials:
    """Trials of changes of one design, for the hints of all its findings.

    ``rules`` are all rules. ``results`` are the findings on the unchanged design, each with its families of changes.
    ``undecided`` are the cases in this design that rules could not decide. All findings share one ``budget``.
    """

    def __init__(
        self, design: Design, rules: Sequence[Rule], results: Iterable[Outcome], undecided: Iterable[NotChecked],
        budget: Budget,
    ) -> None:
        self._design, self._rules, self.budget = design, rules, budget
        self._undecided = {entry.rule for entry in undecided}
        self._said = tuple(results)
        self._complaints = _without_notes(entry.finding for entry in self._said)
        self._messages = {entry.finding.message for entry in self._said}
        self._tried: list[tuple[SensorSpec, _ChangedDesign | None]] = []

    def advised(
        self, least: Severity | None = Severity.NOTE, is_ignored: Callable[[Finding], bool] = lambda _: False
    ) -> list[Finding]:
        """Return every finding with its line in the spec, a hint, and the tried changes that remove it as fixes.

        No changes are tried for findings that are milder than `least` or for which `is_ignored` returns True. If
        `least` is None, none are tried. Changes are tried for errors first, then for warnings, in the order of the
        rules.
        """
        order = sorted(range(len(self._said)), key=lambda k: list(Severity).index(self._said[k].finding.severity))
        findings = dict[int, Finding]()
        for k in order:
            if self._said[k].finding.severity is not Severity.ERROR:
                self.budget.begin_warnings()
            findings[k] = self._advised(self._said[k], least, is_ignored)
        return [findings[k] for k in range(len(self._said))]

    def _advised(
        self, outcome: Outcome, least: Severity | None, is_ignored: Callable[[Finding], bool]
    ) -> Finding:
        finding, source = outcome.finding, self._design.spec.source
        plain = locate_finding(finding, source)
        if not outcome.fixes or least is None or not finding.severity.is_at_least(least) or is_ignored(plain):
            return plain
        result = self.mending(finding, outcome)
        hint = hint_text(finding.hint, result, {complaint.rule for complaint in self._complaints})
        remedies = [Remedy(fix.edits, remaining.new_warnings) for fix, remaining in result.mending]
        return locate_finding(replace(finding, hint=hint, fixes=writable_remedies(remedies, source)), source)

    def mending(self, finding: Finding, outcome: Outcome) -> Search:
        """Try changes for a finding. Return the changes that remove the finding, and the other tried changes.

        `outcome` holds the families of changes. With a small budget, no changes are tried for notes. If the budget is
        used up before the first trial, no change is tried.
        """
        is_over = self.budget.is_spent and not self._tried
        if is_over or (finding.severity is Severity.NOTE and not self.budget.is_long):
            return Search(is_cut_short=True)
        fixed = DRAWN if self._design.spec.coil.copper is not None else ()
        return search(outcome.fixes, lambda fix: self._remaining_problems(finding, fix), self.budget, fixed)

    def _remaining_problems(self, finding: Finding, fix: Fix) -> RemainingProblems | None:
        """Return the problems that remain after a change. None if the budget is too small to try it.

        The finding's own rule is broken if it still reports an error or a warning at the finding's key. If the finding
        is a note, a remaining note counts, too. The rule is also broken if it could check the whole design before the
        change, but not after it. Any rule is broken if it has more errors than before. It is also broken if it had
        errors before, and still has an error or a warning at the finding's key.
        """
        trial = self._trial_of(fix.spec)
        if trial is None:
            return None
        for rule in self._ordered_rules(finding):
            if trial.apply_rule(rule, is_estimated=False) and (fails := self._broken_rules(finding, trial, rule)):
                return RemainingProblems(fails)
        if trial.deferred_rules and not trial.is_estimated:
            if not self.budget.estimates_one(has_same_board(self._design.spec, fix.spec)):
                return None
            trial.is_estimated = True
        broken: tuple[str, ...] = ()
        for rule in self._ordered_rules(finding):
            trial.apply_rule(rule, is_estimated=True)
            broken = self._broken_rules(finding, trial, rule) or broken
            if set(broken) - {finding.rule}:
                return RemainingProblems(broken)
        if broken:
            return RemainingProblems(broken, gain=self._gain(finding, trial))
        remaining = self._side_effects(trial)
        # an error counts as mended even if present complaints get worse
        is_error = finding.severity is Severity.ERROR
        return remaining if is_error else RemainingProblems(new_warnings=tuple(sorted({*remaining.new_warnings,
                                                                                       *remaining.worse})))

    def _ordered_rules(self, finding: Finding) -> list[Rule]:
        """Return all rules, the finding's own rule first."""
        return sorted(self._rules, key=lambda rule: rule.id != finding.rule)

    def _broken_rules(self, finding: Finding, trial: _ChangedDesign, rule: Rule) -> tuple[str, ...]:
        """Return (rule's identifier,) if a changed design breaks the rule (see `_remaining_problems`), else empty."""
        findings, undecided = trial.results_by_rule[rule.id]
        graver = _without_notes(findings)
        if rule.id == finding.rule:
            remaining = findings if finding.severity is Severity.NOTE else graver
            is_unknown = bool(undecided) and rule.id not in self._undecided
            # an unchanged finding in another unit is a different finding
            if is_unknown or any(
                complaint.key == finding.key
                and (complaint.unit == finding.unit or complaint.message not in self._messages)
                for complaint in remaining
            ):
                return (rule.id,)
        now, before = _errors_in(graver), _errors_in(complaint for complaint in self._complaints
                                                     if complaint.rule == rule.id)
        is_same = bool(before) and any(complaint.key == finding.key for complaint in graver)
        return (rule.id,) if len(now) > len(before) or is_same else ()

    def _side_effects(self, trial: _ChangedDesign) -> RemainingProblems:
        after = _without_notes(complaint for findings, _ in trial.results_by_rule.values() for complaint in findings)
        before, now = (Counter(complaint.rule for complaint in each) for each in (self._complaints, after))
        brings = now - before
        worse = worsened_rules(self._complaints, after) - set(brings)
        return RemainingProblems((), tuple(sorted(brings)), tuple(sorted(worse)))

    def _gain(self, finding: Finding, trial: _ChangedDesign) -> float:
        """Return the factor by which a change moves a finding's value towards its limit.

        The result is 1 if a rule has new warnings, if another rule's value is worse, or if the factor is unknown.
        """
        remaining = self._side_effects(trial)
        findings, _ = trial.results_by_rule.get(finding.rule, ([], []))
        figures = [complaint.measured for complaint in findings if complaint.key == finding.key]
        if set(remaining.new_warnings) | (set(remaining.worse) - {finding.rule}) or len(figures) != 1 or not figures[0]:
            return 1.0
        if not finding.measured or finding.limit is None:
            return 1.0
        more = figures[0] / finding.measured
        return more if finding.limit > finding.measured else 1.0 / more

    def _trial_of(self, changed: SensorSpec) -> _ChangedDesign | None:
        """Return the trial of a changed spec, whose board is laid out. None if the budget is too small.

        If an equal spec was tried before, its trial is returned.
        """
        for spec, past_trial in self._tried:
            if spec == changed:
                return past_trial
        if self.budget.is_spent:
            return None
        design: Design | None = None
        if has_same_board(self._design.spec, changed):
            design = self._design.drawn(changed)
        elif self.budget.lays_out(len(changed.array.placements)):
            most = self.budget.board_branches
            searches = SearchLimit(most)
            design = self._design.drawn(changed, searches)
            self.budget.branches -= most - max(searches.left, 0)
            if searches.is_spent and not self.budget.is_long:
                design = None
        trial = None if design is None else _ChangedDesign(design)
        self._tried.append((changed, trial))
        return trial


class _NeedsEstimates(Exception):
    """Raised if a rule needs estimates of a design that is laid out but not estimated."""


class _UnestimatedDesign(Design):
    """Design with a layout but without estimates. It raises `_NeedsEstimates` if a rule needs them."""

    @property
    def estimates(self):  # type: ignore[no-untyped-def]
        raise _NeedsEstimates


class _ChangedDesign:
    """Changed design in a trial. It holds the findings, and the reasons "not checked", of each rule applied so far."""

    def __init__(self, design: Design) -> None:
        self._design, self.is_estimated = design, False
        self._unestimated = _UnestimatedDesign(design.spec, design.layout, of_board=design.of_board)
        self.deferred_rules = set[str]()
        self.results_by_rule = dict[str, tuple[list[Finding], list[NotChecked]]]()

    def apply_rule(self, rule: Rule, is_estimated: bool) -> bool:
        """Apply a rule unless it was applied before. Return whether its results are available.

        With `is_estimated`, the rule is applied to the estimated design. Otherwise it is applied to the layout alone,
        and the result is False if the rule needs estimates.
        """
        if rule.id in self.results_by_rule:
            return True
        if not is_estimated and rule.id in self.deferred_rules:
            return False
        try:
            results, undecided = rule_outcomes(rule, self._design if is_estimated else self._unestimated, least=None)
        except _NeedsEstimates:
            self.deferred_rules.add(rule.id)
            return False
        self.results_by_rule[rule.id] = [outcome.finding for outcome in results], undecided
        return True


def writable_remedies(remedies: Iterable[Remedy], source: SpecSource) -> tuple[Remedy, ...]:
    """Return the remedies (fixes of a finding) whose edits can be written into the spec's text.

    Their edits are completed from this text, for example by the old value. Remedies with new warnings are only returned
    if all remedies have new warnings.
    """
    remedies, written = list(remedies), []
    for remedy in [remedy for remedy in remedies if not remedy.new_warnings] or remedies:
        try:
            edits = complete_edits(source.text, remedy.edits) if source.text else remedy.edits
        except CannotWriteError:
            continue
        if edits:
            written.append(replace(remedy, edits=edits))
    return tuple(written)


def _without_notes(findings: Iterable[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity is not Severity.NOTE]


def _errors_in(findings: Iterable[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity is Severity.ERROR]


def findings_with_tested_fixes(error: SpecError, rules: tuple[Rule, ...], hints: str) -> tuple[Finding, ...]:
    """Return the findings of a spec that could not be loaded, each with its tested fixes.

    Each fix is written into the text, and the text is loaded again. A fix remains if the text can then be loaded, or if
    its remaining findings show an improvement. Findings about other files have no fixes. `hints` is the name of the
    budget.
    """
    findings, source = _findings_with_room_fixes(error, rules, hints), error.source
    return tuple(
        replace(finding, fixes=tuple(_fixes_for_reading(finding, error, source)) if source and finding.file is None
                else ())
        for finding in findings
    )


def _fixes_for_reading(finding: Finding, error: SpecError, source: SpecSource) -> Iterator[Remedy]:
    """Yield the fixes of a finding after which the text can be loaded, or has better findings than before.

    The findings are better if `are_former_findings_gone` or `is_better` returns True.
    """
    for remedy in finding.fixes:
        try:
            edits = complete_edits(source.text, remedy.edits)
            load_text(rewritten(source.text, edits), source.path)
        except CannotWriteError:
            continue
        except SpecError as left:
            applied = AppliedFix(finding, remedy)
            before, after = error.findings, left.findings
            if not (are_former_findings_gone(before, after) or is_better(applied, before, after)):
                continue
        yield replace(remedy, edits=edits)


ROOM = ("SIT112", "SIT113")
"""Rules that check the room for vias and leads."""


def _findings_with_room_fixes(error: SpecError, rules: tuple[Rule, ...], hints: str) -> tuple[Finding, ...]:
    """Return the findings of a spec that could not be loaded, with tried fixes if coils or turns lack room.

    These are the findings of SIT014 (coils) and SIT016 (turns). When a spec is loaded, room is computed by closed
    formulas for coils and turns alone. Here each change is laid out, so that vias and leads have room as well. `hints`
    is the name of the budget.
    """
    spec, first = error.lacking_room, error.findings[0]
    refused = {finding.rule for finding in error.findings}
    families = () if spec is None else families_for_room(spec, "SIT016" in refused, "SIT014" in refused)
    if spec is None or not families:
        return error.findings
    trials = Trials(Design(spec), [rule for rule in rules if rule.id in ROOM], (), (), Budget.of(hints))
    result = trials.mending(first, Outcome(first, families))
    further = cut_short_hint if result.is_cut_short else str
    if not result.mending:
        return tuple(replace(finding, hint=further(finding.hint)) for finding in error.findings)
    fix, _ = result.mending[0]
    fixes = writable_remedies([Remedy(fix.edits)], spec.source)
    cases = {"SIT014": "room-for-coils", "SIT016": "room-for-turns"}
    advice = {rule: further(text_of(case, "hint", {"change": fix.words})) for rule, case in cases.items()}
    return tuple(replace(finding, fixes=fixes, hint=advice[finding.rule]) for finding in error.findings)
