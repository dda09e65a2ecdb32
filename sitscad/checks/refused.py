"""Hints and fixes for specs that were refused: each is written into the text, which is read again; where coils or turns
lack room (SIT014, SIT016), what is named was laid out.

Loading knows in closed form how far apart coils must be and how many turns fit, not what their leads and vias need
besides: whoever followed that was refused again, by SIT112 or SIT113.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from sitscad.checks.rules import Rule, apply_rule
from sitscad.checks.trials import NOT_FURTHER, Trials, as_written
from sitscad.design import Design
from sitscad.finding import Edit, Finding, Missing, Remedy, Severity
from sitscad.fixes import moves
from sitscad.fixes.mending import Applied, is_better, is_further
from sitscad.fixes.moves import fewer_turns
from sitscad.fixes.search import Budget, Fix, Left, estimate_work, fail, winding_work
from sitscad.spec.format.reading import SpecError
from sitscad.spec.load import load_text
from sitscad.spec.resolver.coils import least_scale
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.rewriting import CannotWriteError, completed, rewritten
from sitscad.spec.yaml.source import SpecSource


def tried(error: SpecError, findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings of a spec that could not be loaded, with those of their fixes with which they are gone and nothing else
    is wrong; those about other files have none.
    """
    source = error.source
    if source is None:
        return tuple(replace(finding, fixes=()) for finding in findings)
    return tuple(
        replace(finding, fixes=tuple(_mending(finding, error, source)) if finding.file is None else ())
        for finding in findings
    )


def _mending(finding: Finding, error: SpecError, source: SpecSource) -> Iterable[Remedy]:
    """Of a finding's fixes those with which the text can be read, or is read further than before."""
    for remedy in finding.fixes:
        try:
            edits = completed(source.text, remedy.edits)
            load_text(rewritten(source.text, edits), source.path)
        except CannotWriteError:
            continue
        except SpecError as left:
            if is_further(error.findings, left.findings) or is_better(
                Applied(finding, remedy), error.findings, left.findings
            ):
                yield replace(remedy, edits=edits)
            continue
        yield replace(remedy, edits=edits)


MOST_COILS = 4
"""Each trial of a larger array would take many seconds: they keep the hint in closed form."""

MOST_STEPS, MOST_ROUTED = 24, 4
"""Parts of a turn less that are tried to make room inside, and how many of those that do are led out."""

OTHERWISE = {"SIT014": "or smaller coils", "SIT016": "or a finer trace and spacing, more layers, or a larger coil"}
"""What else gives room, by the rule that asks for it."""


def mended(error: SpecError, rules: tuple[Rule, ...], hints: str) -> tuple[Finding, ...]:
    """The findings of a refused spec. Those about room name what gives it, leads and vias included, where trying finds
    that, and which of all `rules` the mended design then breaks; as far as the budget of these hints goes.
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
        coil = self._spec.coil
        most = coil.outline.most_turns(coil.size, coil.trace_width, coil.pitch)
        fitting: list[Fix] = []
        for fix in fewer_turns(self._spec, most, MOST_STEPS):
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
