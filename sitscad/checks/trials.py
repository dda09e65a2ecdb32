"""Whether a change of the spec mends a finding: the changed design is laid out, estimated and checked before it is
named, as far as the budget goes. What needs no estimate is judged first. Changes of a spec that was refused are written
into its text, which is read again.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

from sitscad.checks.rules import Outcome, Rule, apply_rule, located, outcomes
from sitscad.design import Design
from sitscad.finding import Edit, Finding, Missing, NotChecked, Remedy, Severity
from sitscad.fixes import moves
from sitscad.fixes.mending import Applied, is_better, is_further, worsened
from sitscad.fixes.search import (
    LOOKS,
    TRIALS_OF_ONE_CHANGE,
    Budget,
    Fix,
    Left,
    estimate_work,
    fail,
    layout_work,
    trial_work,
    warn,
    winding_work,
)
from sitscad.layout.board import Layout
from sitscad.layout.routing.escape import SearchLimit
from sitscad.spec.format.reading import SpecError
from sitscad.spec.load import load_text
from sitscad.spec.resolver.coils import least_scale
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.rewriting import CannotWriteError, completed, rewritten
from sitscad.spec.yaml.source import SpecSource

NOT_FURTHER = "not searched further: sitscad check --hints full"
"""Said where the budget ended a search."""

Found = TypeVar("Found")

_Place = tuple[str, str | None]
"""A rule and the key that it complains of."""


class Trials:
    """Tries changes of a design. ``rules`` are all rules, ``said`` what they say of the design as it stands, and
    ``undecided`` those that could not be applied to it, or not wholly; all findings share one ``budget``.
    """

    def __init__(self, design: Design, rules: Sequence[Rule], said: Iterable[Outcome], undecided: Iterable[NotChecked],
                 budget: Budget) -> None:
        self._design, self._rules, self.budget = design, rules, budget
        self._undecided = {one.rule for one in undecided}
        self._said = tuple(said)
        self._errors = _errors(self._said)
        self.complaining = {one.rule for one in _complaints(self._said)}
        self._known: list[tuple[SensorSpec, _TriedDesign | None]] = []
        self._looks = Budget(LOOKS)
        self._drawn: list[tuple[SensorSpec, Design | None]] = []

    def advised(self, least: Severity | None = Severity.NOTE) -> list[Finding]:
        """Every finding of a `least` weight with the hint that its rule gives, once it can tell which changes mend it
        (nothing is tried for milder ones); the budget goes to errors first, and among them in the order of the rules;
        of a large design little is for warnings beside errors.
        """
        first = sorted(range(len(self._said)), key=lambda k: list(Severity).index(self._said[k].finding.severity))
        found, is_refused, source = {}, bool(self._errors), self._design.spec.source
        for k in first:
            if is_refused and self._said[k].finding.severity is not Severity.ERROR:
                self.budget, is_refused = self.budget.after_errors(self._design.spec), False
            is_wanted = least is not None and self._said[k].finding.severity.weighs(least)
            found[k] = self._advised(self._said[k]) if is_wanted else located(self._said[k].finding, source)
        return [found[k] for k in range(len(self._said))]

    def left(self, finding: Finding | None = None) -> _LeftOfFinding:
        """What tells of changed designs whether they mend a finding; without one, only how they are laid out."""
        return _LeftOfFinding(self, finding)

    def _advised(self, outcome: Outcome) -> Finding:
        """One finding with the hint and the fixes that were found for it, and its place in the text."""
        finding, advice, source = outcome.finding, outcome.advice, self._design.spec.source
        if advice is None:
            return located(finding, source)
        left = self.left(finding)
        advised = advice(left) if self.budget.left > 0.0 else ""
        if advised:
            finding = replace(finding, hint=advised)
        if left.is_cut_short or self.budget.left <= 0.0:
            finding = replace(finding, hint=f"{finding.hint} ({NOT_FURTHER})")
        return located(replace(finding, fixes=as_written(left.mending, source)), source)

    def broken(self, finding: Finding, changed: SensorSpec) -> tuple[str, ...] | None:
        """What a changed design breaks: the rule itself if it still complains of the same key (of a note: if it still
        says one) or cannot be applied any more, others of which the same key is still an error, and every rule with
        more errors. None where it was not tried.
        """
        tried = self._tried(changed)
        return None if tried is None else self._breaks(finding, tried)

    def stands(self, finding: Finding, changed: SensorSpec) -> bool:
        """Whether a changed design could be laid out and breaks nothing by the rules that need no estimate."""
        design = self.drawn(changed)
        if design is None:
            design = self._draw(changed, self._looks)
            self._drawn.insert(0, (changed, design))
        return design is not None and not self._breaks(finding, self._looked(design)[0])

    def _breaks(self, finding: Finding, tried: _TriedDesign) -> tuple[str, ...]:
        unknown = set() if finding.rule in self._undecided else {(finding.rule, None)}
        left = tried.complaining | (tried.noting if finding.severity is Severity.NOTE else set())
        is_left = {(finding.rule, finding.key), *unknown} & left
        same_key = {rule for rule, key in tried.complaining if key == finding.key and self._errors[rule]}
        return tuple(sorted({*tried.errors, *same_key, *({finding.rule} if is_left else ())}))

    def warned(self, changed: SensorSpec, of_worse: bool = True) -> tuple[str, ...]:
        """The rules that complain more often of a changed design than of the design as it stands, or more."""
        tried = self._tried(changed)
        return () if tried is None else tried.warned(of_worse)

    def share(self, changed: SensorSpec) -> float | None:
        """The largest share of its reading by which a coil of a changed design changes over the required force, of
        cells in the one that reads least; None where it was not tried, or feels nothing.
        """
        from sitscad.estimates.signal import signals, strongest_signal  # loads nothing that the rules have not loaded

        is_own = changed == self._design.spec
        design = self._design if is_own else self.drawn(changed) if self._tried(changed) is not None else None
        found = () if design is None else signals(design.estimates)
        return abs(strongest_signal(found, changed).share) if found else None

    def drawn(self, changed: SensorSpec) -> Design | None:
        """A changed design, laid out once; None where the budget does not reach so far."""
        for spec, design in self._drawn:
            if spec == changed:
                return design
        design = self._draw(changed, self.budget)
        self._drawn.append((changed, design))
        return design

    def _draw(self, changed: SensorSpec, budget: Budget) -> Design | None:
        """A changed design as far as a budget goes in drawing it; None where it ends before."""
        if self._design.has_board_of(changed):
            return self._design.drawn(changed)
        if not budget.spend(layout_work(changed)):
            return None
        each = trial_work(changed.coil)
        most = int(min(budget.left / each, TRIALS_OF_ONE_CHANGE))
        searches = SearchLimit(most)
        design = self._design.drawn(changed, searches)
        budget.spend(min(budget.left, each * (most - searches.left)))
        return None if searches.is_spent and most < TRIALS_OF_ONE_CHANGE else design

    def _tried(self, changed: SensorSpec) -> _TriedDesign | None:
        """What is said of a changed design, found once; None where the budget does not reach so far."""
        for spec, tried in self._known:
            if spec == changed:
                return tried
        design, tried = self.drawn(changed), None
        if design is not None:
            # no further than the first rule with new errors; rules that ask for estimates come last
            tried, undecided_rules = self._looked(design)
            spec, same = design.spec, self._design.has_board_of(design.spec)
            if undecided_rules and not self.budget.spend(estimate_work(spec, same, self._design.estimates.is_solved)):
                tried, undecided_rules = None, []
            for rule in undecided_rules:
                if tried is None or tried.has_new_errors(*outcomes(rule, design, least=None)):
                    break
        self._known.append((changed, tried))
        return tried

    def _looked(self, design: Design) -> tuple[_TriedDesign, list[Rule]]:
        # What is said of a changed design without estimates, and the rules that ask for them: none where that is enough
        # to refuse it.
        tried = _TriedDesign(self._errors, _complaints(self._said))
        unestimated = _Unestimated(design.spec, design.layout, of_board=design.of_board)
        undecided_rules = []
        for rule in self._rules:
            try:
                said = outcomes(rule, unestimated, least=None)
            except _NeedsEstimates:
                undecided_rules.append(rule)
                continue
            if tried.has_new_errors(*said):
                return tried, []
        return tried, undecided_rules


class _NeedsEstimates(Exception):
    """A rule has asked for estimates that are not there yet."""


class _Unestimated(Design):
    """A drawn design whose estimates nobody may ask for yet."""

    @property
    def estimates(self):  # type: ignore[no-untyped-def]
        raise _NeedsEstimates


class _TriedDesign:
    """What rules say of a changed design, against what they say of the design as it stands: ``complaining`` are those
    that complain, with the key (of None: cannot judge it), ``noting`` those that say anything at all, ``errors`` how
    many more errors each has.
    """

    def __init__(self, errors: Counter[str], complaints: Sequence[Finding]) -> None:
        self._errors_before, self._complaints_before = errors, complaints
        self._errors, self._complaints = Counter[str](), list[Finding]()
        self.complaining, self.noting = set[_Place](), set[_Place]()

    def has_new_errors(self, said: Sequence[Outcome], undecided: Sequence[NotChecked]) -> bool:
        """Count what one rule says; whether there are more errors now than before."""
        self.complaining |= {(one.rule, one.key) for one in _complaints(said)}
        self.complaining |= {(one.rule, None) for one in undecided}
        self.noting |= {(one.finding.rule, one.finding.key) for one in said}
        self._complaints += _complaints(said)
        self._errors += _errors(said)
        return bool(self.errors)

    @property
    def errors(self) -> Counter[str]:
        return self._errors - self._errors_before

    def warned(self, of_worse: bool) -> tuple[str, ...]:
        """The rules with more complaints (errors and warnings), and those whose warnings are `worsened`."""
        now, then = (Counter(one.rule for one in found) for found in (self._complaints, self._complaints_before))
        worse = worsened(self._complaints_before, self._complaints) if of_worse else ()
        return tuple(sorted({*(now - then), *worse}))


class _LeftOfFinding:
    """What changes leave of one finding to complain of."""

    def __init__(self, trials: Trials, finding: Finding | None) -> None:
        self._trials, self._finding = trials, finding
        self.is_cut_short = False
        self.mending: list[Remedy] = []

    def __call__(self, fix: Fix, /) -> tuple[str, ...] | None:
        assert self._finding is not None
        broken = self._noted(self._trials.broken(self._finding, fix.spec))
        if broken == ():
            # an error is mended though a warning that stands already gets worse by it
            is_error = self._finding.severity is Severity.ERROR
            self._keep(Remedy(fix.edits, self._trials.warned(fix.spec, of_worse=not is_error)))
        return broken

    def mends(self, fix: Fix) -> None:
        self._keep(Remedy(fix.edits))

    def _keep(self, remedy: Remedy) -> None:
        if remedy.edits not in (known.edits for known in self.mending):
            self.mending.append(remedy)

    def warned(self, changed: SensorSpec) -> str:
        return warn(self._trials.warned(changed), self._trials.complaining)

    def stands(self, fix: Fix) -> bool:
        assert self._finding is not None
        return self._trials.stands(self._finding, fix.spec)

    def share(self, changed: SensorSpec) -> float | None:
        return self._noted(self._trials.share(changed))

    def drawn(self, changed: SensorSpec) -> Layout | None:
        design = self._noted(self._trials.drawn(changed))
        return None if design is None else design.layout

    def affords(self, units: float) -> bool:
        return self._noted(self._trials.budget.spend(units) or None) is not None

    def wants_another(self) -> bool:
        return self._noted(self._trials.budget.is_long or None) is not None

    def _noted(self, found: Found | None) -> Found | None:
        self.is_cut_short = self.is_cut_short or found is None
        return found


def as_written(found: Iterable[Remedy], source: SpecSource) -> tuple[Remedy, ...]:
    """Remedies with what their edits replace in the spec's text: those that bring no warning, or all where each brings
    some; not those that the text has no place for.
    """
    found, written = list(found), []
    for remedy in [remedy for remedy in found if not remedy.brings] or found:
        try:
            edits = completed(source.text, remedy.edits) if source.text else remedy.edits
        except CannotWriteError:
            continue
        if edits:
            written.append(replace(remedy, edits=edits))
    return tuple(written)


def _errors(said: Iterable[Outcome]) -> Counter[str]:
    return Counter(one.rule for one in _complaints(said) if one.severity is Severity.ERROR)


def _complaints(said: Iterable[Outcome]) -> list[Finding]:
    return [one.finding for one in said if one.finding.severity is not Severity.NOTE]


# ---------------------------------------------------------------------------------------------- specs that were refused


def of_refused(error: SpecError, rules: tuple[Rule, ...], hints: str) -> tuple[Finding, ...]:
    """The findings of a spec that could not be loaded, with those of their fixes with which they are gone and nothing
    else is wrong: each is written into the text, which is read again. Findings about other files have none.
    """
    findings, source = _with_room(error, rules, hints), error.source
    return tuple(
        replace(finding, fixes=tuple(_mending(finding, error, source)) if source and finding.file is None else ())
        for finding in findings
    )


def _mending(finding: Finding, error: SpecError, source: SpecSource) -> Iterator[Remedy]:
    """The fixes of a finding with which the text can be read, or is read further than before."""
    for remedy in finding.fixes:
        try:
            edits = completed(source.text, remedy.edits)
            load_text(rewritten(source.text, edits), source.path)
        except CannotWriteError:
            continue
        except SpecError as left:
            applied = Applied(finding, remedy)
            if not (is_further(error.findings, left.findings) or is_better(applied, error.findings, left.findings)):
                continue
        yield replace(remedy, edits=edits)


MOST_COILS = 4
"""Each trial of a larger array would take many seconds: they keep the hint in closed form."""

MOST_STEPS, MOST_ROUTED = 24, 4
"""Parts of a turn less that are tried to make room inside, and how many of those that do are led out."""

OTHERWISE = {"SIT014": "or smaller coils", "SIT016": "or a finer trace and spacing, more layers, or a larger coil"}
"""What else gives room, by the rule that asks for it."""


def _with_room(error: SpecError, rules: tuple[Rule, ...], hints: str) -> tuple[Finding, ...]:
    """The findings of a refused spec. Where coils or turns lack room (SIT014, SIT016), hints and fixes name what gives
    it and was laid out: loading knows in closed form how far apart coils must be and how many turns fit, not what their
    leads and vias need besides. All `rules` say what else the mended design breaks, as far as the budget of these hints
    goes.
    """
    spec = error.lacking_room
    if spec is None or len(spec.array.placements) > MOST_COILS or spec.coil.has_unequal_turns:
        return error.findings
    search = _EasierSearch(spec, rules, Budget.of(hints, spec, is_checked=False))
    fix = search.roomy({finding.rule for finding in error.findings})
    further = f" ({NOT_FURTHER})" if search.left.is_cut_short else ""
    if fix is None:
        return tuple(replace(finding, hint=finding.hint + further) for finding in error.findings)
    hint = f"{fix.words} gives room, to leads and vias as well {search.judged(fix.spec)}; "
    fixes = as_written([Remedy(fix.edits)], spec.source)
    return tuple(replace(f, hint=hint + OTHERWISE[f.rule] + further, fixes=fixes) for f in error.findings)


class _EasierSearch:
    """Looks for fewer turns or coils farther apart with which everything finds its place."""

    def __init__(self, spec: SensorSpec, rules: tuple[Rule, ...], budget: Budget) -> None:
        self._spec, self._rules = spec, rules
        self.left: Left = Trials(Design(spec), rules, (), (), budget).left()

    def roomy(self, refused: set[str]) -> Fix | None:
        """Fewer turns, coils farther apart, or both; None where none is found."""
        for fewer in self._fewer() if "SIT016" in refused else [Fix((), self._spec)]:
            if "SIT014" not in refused and self._is_led_out(fewer.spec):
                return fewer
            apart = self._apart(fewer.spec)
            if apart is not None:
                return fewer.with_also(apart)
        return None

    def _fewer(self) -> list[Fix]:
        """The most turns that leave room for the vias inside, and some parts of a turn less."""
        fitting: list[Fix] = []
        for fix in moves.fewer_turns(self._spec, self._spec.coil.turns_that_fit, MOST_STEPS):
            if len(fitting) == MOST_ROUTED or not self.left.affords(winding_work(fix.spec.coil)):
                break
            if moves.inner_vias_fit(fix.spec):
                fitting.append(fix)
        return fitting

    def _apart(self, spec: SensorSpec) -> Fix | None:
        """The least distance of the coils that leaves room for the leads and vias between them."""
        near = moves.nearest_distance(spec.array.placements)
        scale = None if near is None else least_scale(spec.array, spec.coil)
        if near is None or scale is None:
            return None
        by = max(0.0, near * (scale - 1.0))
        beside = _written_apart(spec, near, by)
        if self._is_led_out(beside.spec):
            return beside
        found = moves.least(beside.spec, moves.coils_apart, self._is_led_out, moves.lead_room(beside.spec))
        return None if found is None else _written_apart(spec, near, by + found[0])

    def _is_led_out(self, spec: SensorSpec) -> bool:
        """Whether leads and vias find their places; contacts too near each other (SIT119) are another matter."""
        layout = self.left.drawn(spec)
        return layout is not None and not any(
            lack.what in (Missing.INNER_ROOM, Missing.LEAD_ROOM) for lack in layout.shortfalls
        )

    def judged(self, spec: SensorSpec) -> str:
        """What else of the mended design fails, in brackets; that it was laid out, where an estimate is too much."""
        layout = self.left.drawn(spec)
        if layout is None or not self.left.affords(estimate_work(spec)):
            return "(it was laid out)"
        design = Design(spec, layout)
        wrong = tuple(
            rule.id
            for rule in self._rules
            if any(finding.severity is Severity.ERROR for finding in apply_rule(rule, design, least=None)[0])
        )
        return f"(it was tried; {fail(wrong)} then, for other reasons)" if wrong else "(it was tried)"


def _written_apart(spec: SensorSpec, near: float, by: float) -> Fix:
    """Coils farther apart by so much (m), rounded up as it is written."""
    if spec.array.pitch is None:
        scale = math.ceil((1.0 + by / near) * 1e4 - 1e-6) / 1e4
        return moves.coils_apart(spec, near * (scale - 1.0))
    pitch = math.ceil((spec.array.pitch + by) * 1e6 - 1e-5) * 1e-6
    # pitch and nearest distance grow alike: coils of a triangle and a grid stand one pitch apart
    return Fix((Edit("array.pitch", f"{pitch * 1e3:.6g}"),), moves.coils_apart(spec, pitch - spec.array.pitch).spec)
