"""The answer of a study as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sitscad.study.answer import Kept
from sitscad.study.evaluation import Breach, Evaluation
from sitscad.study.measures import MEASURES
from sitscad.study.spreads import Yield, wilson
from sitscad.study.study import StudyAnswer
from sitscad.study.sweep_files import rule_titles, shown
from sitscad.units import show

BY_YIELD = "yield by "
"""Begins the name of what would cost too many units."""

MOST_BINDING = 6
"""Rules and requirements that the text lists; JSON has all."""


def answer_text(said: StudyAnswer, folder: str = "") -> str:
    """The answer for people: whether it can be met, what binds, the designs, how it goes on."""
    parts = [verdict_lines(said), _binding(said), _designs(said), trust_lines(said), onward(said, folder)]
    return "\n\n".join("\n".join(lines) for part in parts if (lines := list(part))) + "\n"


def verdict_lines(said: StudyAnswer) -> Iterator[str]:
    """Whether it can be met, and how many designs were looked at."""
    asked, found = said.asked, said.found
    count = f"{len(found.screened)} of {asked.space.size} designs were looked at by {found.method}, "
    count += f"{len(found.full)} in full"
    good = len(said.front)
    if said.is_met:
        yield f"It can be met: {count}; {good} {'is' if good == 1 else 'are'} not beaten by another."
    elif good:
        limit = next(one.written for one in asked.require if one.measure == "yield")
        yield f"No design has the yield that is asked ({limit}): {count}; {good} keep everything else."
    else:
        yield f"No design was found that keeps everything: {count}."
    if asked.space.size > len(found.screened) and not said.is_met:
        yield "That is a search and no proof: what was not looked at may do."
    for goal in said.alike:
        yield f"{goal.measure} is the same of all designs: nothing that is varied decides it."


def breach_words(name: str, breach: Breach | None) -> str:
    """How far the nearest design lies beyond a limit."""
    if breach is None or breach.measured is None or breach.limit is None:
        return ""
    measure = name.removeprefix(BY_YIELD)
    if measure in MEASURES:
        at = " (with its scatter)" if measure != name else ""
        return f"{shown(measure, breach.measured, 6)}{at} where {shown(measure, breach.limit, 6)} is asked"
    return f"{show(breach.measured, breach.unit, 6)} where {show(breach.limit, breach.unit, 6)} is asked"


def _binding(said: StudyAnswer) -> Iterator[str]:
    titles = rule_titles()
    listed = [one for one in said.bindings if one.alone > 0.0 or not said.is_met][:MOST_BINDING]
    if listed:
        yield "What refuses designs, the share of all that were looked at, and the share that nothing else refuses:"
    for one in listed:
        nearest = breach_words(one.name, one.nearest)
        words = f"  nearest: {nearest}" if nearest else ""
        yield f"  {titles.get(one.name, one.name):<32} {one.share:>6.1%} {one.alone:>6.1%}{words}"
    if len(said.bindings) > len(listed):
        yield f"  and {len(said.bindings) - len(listed)} more (study.json)"
    if said.relaxation is not None:
        least = said.relaxation
        yield "The smallest relaxation that was tried and admits a design:"
        for name in least.names:
            words = breach_words(name, least.breaches[name])
            yield f"  let go of {titles.get(name, name)}{f': {words}' if words else ''}"
        yield f"  with {keys_words(said.asked.space.chosen(least.point))}"


def keys_words(values: Mapping[str, Any]) -> str:
    """Keys and values in a line."""
    return ", ".join(f"{key}: {value}" for key, value in values.items()) or "the base as it is"


def _designs(said: StudyAnswer) -> Iterator[str]:
    goals = [goal.measure for goal in said.asked.goals]
    if said.kept:
        yield f"Designs, the best {'by' if len(goals) == 1 else 'of'} {', '.join(g.words for g in said.asked.goals)}:"
        yield f"  base  {_figures(said, said.base)}{_refusal(said.base)}"
    for number, one in enumerate(said.kept, 1):
        yield f"  {number}     {_figures(said, one.evaluation)}"
        yield f"        {keys_words(one.changed)}"
        if one.units is not None:
            yield f"        {yield_words(one.units)}"
            yield from (f"        {words}" for words in sigma_words(one))
    if said.fallen:
        yield f"  dropped, for their units have too small a yield: {said.fallen}"


def _refusal(one: Evaluation) -> str:
    return f"; refused by {', '.join(one.refused)}" if one.refused else ""


def _figures(said: StudyAnswer, one: Evaluation) -> str:
    names = said.asked.measures
    own = (name for name in names if name in one.values and not name.startswith("sigma."))
    return ", ".join(f"{name} {shown(name, one.values[name][0])}" for name in own)


def yield_words(units: Yield) -> str:
    """A yield with its interval, what breaks, and which spread costs it."""
    low, high = units.interval
    words = f"yield {units.share:.1%} ({low:.1%} to {high:.1%} at 95 %, {units.units} units)"
    if units.broken:
        words += f", lost by {', '.join(f'{name} {share:.1%}' for name, share in units.broken.items())}"
    if units.calibrated > units.good:
        low, high = wilson(units.calibrated, units.units)
        words += f"; once calibrated {units.calibrated / units.units:.1%} ({low:.1%} to {high:.1%})"
    if units.failed:
        words += f"; {units.failed} could not be computed"
    if units.costs:
        words += f"; decided by {', '.join(f'{name} {index:.0%}' for name, index in list(units.costs.items())[:3])}"
    return words


def sigma_words(one: Kept) -> Iterator[str]:
    """One sigma by the estimates, to first order, beside that of the units that were drawn."""
    assert one.units is not None
    for name, drawn in one.units.sigmas.items():
        linear = one.evaluation.values.get(f"sigma.{name}")
        if linear is not None:
            yield f"sigma of {name}: {shown(name, linear[0], 2)} to first order, {shown(name, drawn, 2)} drawn"


def trust_lines(said: StudyAnswer) -> Iterator[str]:
    """How well both levels agree."""
    one = said.agreement
    if one.designs:
        ranks = ", ".join(f"{name} {rank:.4g}" for name, rank in one.rank_correlation.items() if rank is not None)
        yield (f"Screen against full on {one.designs} designs: {one.verdicts_differ} verdicts differ, {one.undecided} "
               "were left to the full level"
               + (f"; rank correlation {ranks}." if ranks else "."))


def onward(said: StudyAnswer, folder: str) -> Iterator[str]:
    """What to do next, in a line."""
    if said.kept and folder:
        yield f"Next: sitscad build {folder}/designs/1.yaml"
    elif not said.kept:
        yield "Next: widen a range, relax what binds, or search longer (search.evaluations)."
