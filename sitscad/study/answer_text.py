"""The answer of a study as text, as JSON, and its front as a table."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from sitscad.report.findings import to_json
from sitscad.study.answer import Kept, beaten_by_base, changed, unjudged
from sitscad.study.evaluating import NO_SCREEN
from sitscad.study.evaluation import Breach, Evaluation
from sitscad.study.measures import MEASURES
from sitscad.study.running import is_unmade
from sitscad.study.space import Point, at_key, code_version
from sitscad.study.spreads import Yield, wilson
from sitscad.study.study import StudyAnswer
from sitscad.study.sweeping import rule_titles, shown
from sitscad.units import cell, counted, csv_text, show
from sitscad.version import __version__

BY_YIELD = "yield by "
"""Begins the name of what would cost too many units."""

MOST_BINDING = 6
"""Rules and requirements that the text lists; JSON has all."""


UNMADE = "Designs that SIT0 rules refuse cannot be drawn, and nothing else was asked of them."


def answer_text(said: StudyAnswer, folder: str = "") -> str:
    """The answer for people: whether it can be met, what binds, the designs, their yields, how it goes on."""
    return f"{found_text(said)}\n{yields_text(said, folder)}"


def found_text(said: StudyAnswer) -> str:
    """The part of the answer that is known before yields are worked out."""
    return _joined(verdict_lines(said), _binding(said), _designs(said), trust_lines(said))


def yields_text(said: StudyAnswer, folder: str, before: StudyAnswer | None = None) -> str:
    """The rest of it; the designs once more where others are kept than `before` yields were known."""
    others = before is not None and [one.point for one in before.kept] != [one.point for one in said.kept]
    again = (verdict_lines(said), _designs(said)) if others else ()
    return _joined(*again, _yields(said), onward(said, folder))


def _joined(*parts: Iterable[str]) -> str:
    return "\n\n".join("\n".join(lines) for part in parts if (lines := list(part))) + "\n"


def verdict_lines(said: StudyAnswer) -> Iterator[str]:
    """Whether it can be met, and how many designs were looked at."""
    asked, found = said.asked, said.found
    count = f"{len(found.screened)} of {asked.space.size} designs were looked at by {found.method}, "
    count += f"{len(found.full)} in full"
    good = len(said.front)
    if said.is_met:
        but = f" but for the yield that is asked ({_least_yield(said)}), which is not known" if said.lacks_yield else ""
        yield f"It can be met{but}: {count}; {good} {'is' if good == 1 else 'are'} not beaten by another."
        if beaten := beaten_by_base(asked, said.base, said.kept):
            of = "every design that is kept" if beaten == len(said.kept) else f"{beaten} of the {len(said.kept)} kept"
            yield f"The base itself beats {of}: stay with it, or search longer (search.evaluations)."
    elif said.fallen:
        yield (f"No design was found that has the yield that is asked ({_least_yield(said)}): {count}; units "
               f"were drawn of the best {said.fallen}, and {good} more keep everything else and are not beaten.")
    else:
        yield f"No design was found that keeps everything: {count}."
        if left := unjudged(asked, found):
            yield (f"Of {counted(left, 'more design')} the screen refuses nothing, but they were not judged in full: "
                   "vary less, or search longer (search.evaluations).")
    for number, key in enumerate(asked.space.variables):
        at = {one.point[number] for one in said.kept}
        if key.is_ordered and len(key.values) > 2 and len(at) == 1 and at <= {0, len(key.values) - 1}:
            end, = at
            yield (f"{key.key}: {key.values[end]} in every design that is kept, the {'last' if end else 'first'} value "
                   "of its range: a wider one may hold better designs.")
    if off := changed(asked, asked.base_point):
        before = asked.base.values(())
        values = ", ".join(f"{key}: {value} in place of {base_value(before, key)}" for key, value in off.items())
        yield f"The base is none of the designs; the one nearest to it, looked at first, has {values}."
    if asked.space.size > len(found.screened) and not said.is_met:
        yield "That is a search and no proof: what was not looked at may do."
    for goal in said.alike:
        yield f"{goal.measure} is the same of all designs: nothing that is varied decides it."


def base_value(before: Mapping[str, Any], key: str) -> str:
    """A key of the base as it is written there; a dash where it is not."""
    return "-" if (value := at_key(before, key)) is None else str(value)


def _least_yield(said: StudyAnswer) -> str:
    return next(one.written for one in said.asked.require if one.measure == "yield")


def breach_words(name: str, breach: Breach | None) -> str:
    """How far the nearest design lies beyond a limit, or by how little it keeps it; nothing where both read the same,
    for then they say nothing.
    """
    if breach is None or breach.measured is None or breach.limit is None:
        return ""
    measure = name.removeprefix(BY_YIELD)
    if measure in MEASURES:
        at = " (with its scatter)" if measure != name else ""
        found, limit = (shown(measure, value, 6) for value in (breach.measured, breach.limit))
    else:
        at, found, limit = "", show(breach.measured, breach.unit, 6), show(breach.limit, breach.unit, 6)
    if breach.sigma is not None:
        return f"{found} keeps {limit} by {breach.sigma:.2g} sigma of manufacture where one is asked"
    return f"{found}{at} where {limit} is asked" if found != limit else ""


def _binding(said: StudyAnswer) -> Iterator[str]:
    titles = rule_titles()
    listed = [one for one in said.bindings if one.alone > 0.0 or not said.is_met][:MOST_BINDING]
    if listed:
        yield "What refuses designs, the share of all that were looked at, and the share that nothing else refuses:"
    for one in listed:
        nearest = breach_words(one.name, one.nearest)
        words = f"  nearest{'' if one.alone else ', beside others'}: {nearest}" if nearest else ""
        yield f"  {titles.get(one.name, one.name):<32} {one.share:>6.1%} {one.alone:>6.1%}{words}"
    if is_unmade(one.name for one in listed):
        yield f"  {UNMADE}"
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
        refusal = f"; refused by {', '.join(said.base.refused)}" if said.base.refused else ""
        yield f"  base  {_figures(said, said.base)}{refusal}"
    for number, one in enumerate(said.kept, 1):
        yield f"  {number}     {_figures(said, one.evaluation)}"
        yield f"        {keys_words(one.changed)}"
        yield from (f"        {words}" for words in accepted_words(one))
    if said.fallen:
        yield f"  dropped, for their units have too small a yield: {said.fallen}"


def _yields(said: StudyAnswer) -> Iterator[str]:
    if any(one.units is not None for one in said.kept):
        yield "Yields, the share of units as they are made that keep all:"
    for number, one in enumerate(said.kept, 1):
        if one.units is not None:
            yield f"  {number}     {yield_words(one.units)}"
            yield from (f"        {words}" for words in sigma_words(one))
    yield from low_yield_lines(said)


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


def accepted_words(one: Kept) -> Iterator[str]:
    """The warnings of a design that the study accepts, for `check --strict` refuses them; nothing where it has none."""
    if one.accepted:
        yield f"warnings that the study accepts: {', '.join(one.accepted)}"


LOW_YIELD = 0.9
"""Share of good units below which the answer cautions where the study asks for none."""


def low_yield_lines(said: StudyAnswer) -> Iterator[str]:
    """A caution where the study asks for no yield and designs are kept that lose many units; nothing else."""
    low = [f"design {number} ({one.units.share:.1%})" for number, one in enumerate(said.kept, 1)
           if one.units is not None and one.units.share < LOW_YIELD]
    if low and said.asked.least_yield is None:
        yield (f"Caution: fewer than {LOW_YIELD:.0%} of the units keep all of {', '.join(low)}, and the study asks for "
               'no yield: with require: {yield: ">= 90 %"} such designs are dropped.')


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
    if unscreened := said.found.unscreened:
        yield f"{unscreened} of {counted(len(said.found.screened), 'design')} took the full level at once: {NO_SCREEN}."
    if one.designs:
        ranks = ", ".join(f"{name} {rank:.4g}" for name, rank in one.rank_correlation.items() if rank is not None)
        told = (f"{one.verdicts_differ} verdicts differ, {one.undecided} were left to the full level"
                if one.undecided < one.designs else "the screen could refuse none of them")
        yield (f"Screen against full on {one.designs} designs whose leads are drawn: {told}"
               + (f"; rank correlation {ranks}." if ranks else "."))


def onward(said: StudyAnswer, folder: str) -> Iterator[str]:
    """What to do next, in a line."""
    if said.kept and folder:
        yield f"Next: sitscad build {shlex.quote(f'{folder}/designs/1.yaml')}"
    elif not said.kept:
        yield "Next: widen a range, relax what binds, or search longer (search.evaluations)."


def answer_json(said: StudyAnswer) -> str:
    """The answer for programs; it depends on study, seed and version alone."""
    asked, found = said.asked, said.found
    return to_json({
        "sitscad": __version__, "code": code_version(), "study": said.name,
        "met": None if said.lacks_yield else said.is_met,
        "method": found.method, "seed": asked.seed, "designs": asked.space.size, "screened": len(found.screened),
        "full": len(found.full), "unjudged": unjudged(asked, found), "goals": [goal.words for goal in asked.goals],
        "require": {one.measure: one.written for one in asked.require},
        "fallen_by_yield": said.fallen, "alike": [goal.measure for goal in said.alike],
        "bindings": [
            {"name": one.name, "share": one.share, "alone": one.alone, "nearest": _breach(one.nearest),
             "at": asked.space.chosen(one.nearest_at)}
            for one in said.bindings
        ],
        "relaxation": None if said.relaxation is None else {
            "lets_go": {name: _breach(said.relaxation.breaches[name]) for name in said.relaxation.names},
            "at": asked.space.chosen(said.relaxation.point),
        },
        "agreement": {
            "designs": said.agreement.designs, "undecided": said.agreement.undecided,
            "verdicts_differ": said.agreement.verdicts_differ,
            "rank_correlation": dict(said.agreement.rank_correlation),
        },
        "base": said.base.as_json(), "base_differs": changed(asked, asked.base_point),
        "kept": [
            {"design": f"designs/{number}.yaml", "changed": dict(one.changed), "accepted": one.accepted,
             **one.evaluation.as_json(), "yield": None if one.units is None else yield_json(one.units)}
            for number, one in enumerate(said.kept, 1)
        ],
    })


def _breach(one: Breach | None) -> dict[str, Any] | None:
    return None if one is None else {"measured": one.measured, "limit": one.limit, "unit": one.unit, "sigma": one.sigma}


def yield_json(units: Yield) -> dict[str, Any]:
    """A yield as plain values."""
    return {"share": units.share, "interval": list(units.interval), "units": units.units, "good": units.good,
            "calibrated": units.calibrated, "failed": units.failed, "broken": dict(units.broken),
            "costs": dict(units.costs), "sigmas": dict(units.sigmas)}


def front_csv(said: StudyAnswer) -> str:
    """The front: one row a design, the best by the first goal first; kept designs by their number."""
    asked = said.asked
    named = [title for name in asked.measures for title in (name, f"{name}.error")]
    rows: list[list[object]] = [[*(v.key for v in asked.space.variables), *named, "design"]]
    numbers: dict[Point, int] = {one.point: k for k, one in enumerate(said.kept, 1)}
    for point in said.front:
        one = said.found.full[point]
        figures = [cell(value) for name in asked.measures for value in one.values.get(name, (float("nan"),) * 2)]
        rows.append([*asked.space.chosen(point).values(), *figures, numbers.get(point, "")])
    return csv_text(rows)
