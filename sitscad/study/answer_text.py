"""The answer of a study as text, as JSON, and its front as CSV."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator
from dataclasses import asdict

from sitscad.report.findings import to_json
from sitscad.report.measures import Table
from sitscad.report.numbers import table_text
from sitscad.study.answer import beaten_by_base, changed, unjudged
from sitscad.study.answer_tables import (
    WITH,
    base_value,
    breach_words,
    design_table,
    front_table,
    keys_words,
    low_yield_lines,
    refusal_table,
    sigma_table,
    yield_table,
)
from sitscad.study.evaluating import NO_SCREEN
from sitscad.study.running import is_unmade
from sitscad.study.space import Space, code_version
from sitscad.study.study import StudyAnswer
from sitscad.study.sweeping import rule_titles
from sitscad.units import cell, counted, csv_text
from sitscad.version import __version__

MOST_BINDING = 6
"""Rules and requirements that the text lists; JSON has all."""

UNMADE = "Designs that SIT0 rules refuse cannot be drawn, and nothing else was asked of them."


def answer_text(said: StudyAnswer, folder: str = "") -> str:
    """The answer for people: whether it can be met, what binds, the designs, their yields, how it goes on."""
    return f"{found_text(said)}\n{yields_text(said, folder)}"


def found_text(said: StudyAnswer) -> str:
    """The part of the answer that is known before yields are worked out."""
    refusals = refusal_table(said).shown(most=MOST_BINDING, without=(WITH,))
    fallen = [f"dropped, for their units have too small a yield: {said.fallen}"] if said.fallen else []
    return _joined(verdict_lines(said), refusals, refusal_lines(said), design_table(said).shown(), fallen,
                   trust_lines(said))


def yields_text(said: StudyAnswer, folder: str, before: StudyAnswer | None = None) -> str:
    """The rest of it; the designs once more where others are kept than `before` yields were known."""
    designs = design_table(said)
    others = before is not None and [one.point for one in before.kept] != [one.point for one in said.kept]
    again = (verdict_lines(said), designs.shown()) if others else ()
    return _joined(*again, yield_table(designs).shown(), sigma_table(designs).shown(), low_yield_lines(said),
                   onward(said, folder))


def _joined(*parts: Table | Iterable[str]) -> str:
    """Return tables and lines as blocks with an empty line between them."""
    blocks = (table_text(part) if isinstance(part, Table) else "\n".join(part) for part in parts)
    return "\n\n".join(block for block in blocks if block) + "\n"


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


def _least_yield(said: StudyAnswer) -> str:
    return next(one.written for one in said.asked.require if one.measure == "yield")


def refusal_lines(said: StudyAnswer) -> Iterator[str]:
    """Yield what refusals mean, and the smallest relaxation that was tried and admits a design."""
    if is_unmade(one.name for one in said.bindings):
        yield UNMADE
    if (least := said.relaxation) is not None:
        titles = rule_titles()
        words = [f"let go of {titles.get(name, name)} {breach_words(name, least.breaches[name])}".rstrip()
                 for name in least.names]
        yield f"The smallest relaxation that was tried and admits a design: {'; '.join(words)}"
        yield f"with {keys_words(said.asked.space.chosen(least.point))}"


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
    """What to do next."""
    if not said.kept:
        yield "Next: widen a range, relax what binds, or search longer (search.evaluations)."
    elif folder:
        design = shlex.quote(f"{folder}/designs/1.yaml")
        yield f"Next: sitscad build {design}"
        if range_of_one := sweep_range(said.asked.space):
            yield f"One key alone: sitscad sweep {design} {shlex.quote(range_of_one)}"


MOST_SWEPT = 7
"""Values of a key that the command for a sweep has."""


def sweep_range(space: Space) -> str:
    """Return the range of a sweep over the first key that no other key follows. Empty if there is none."""
    bound = {*space.same.values(), *space.brought}
    for one in space.variables:
        last = len(one.values) - 1
        values = [str(one.values[k]) for k in sorted({k * last // (MOST_SWEPT - 1) for k in range(MOST_SWEPT)})]
        if one.key not in bound and not any("," in value for value in values):
            return f"{one.key}={','.join(values)}"
    return ""


def answer_json(said: StudyAnswer) -> str:
    """The answer for programs; it depends on study, seed and version alone."""
    asked, found, least = said.asked, said.found, said.relaxation
    _, *kept = design_table(said).rows or [{}]
    return to_json({
        "sitscad": __version__, "code": code_version(), "study": said.name,
        "met": None if said.lacks_yield else said.is_met,
        "method": found.method, "seed": asked.seed, "designs": asked.space.size, "screened": len(found.screened),
        "full": len(found.full), "unjudged": unjudged(asked, found), "goals": [goal.words for goal in asked.goals],
        "require": {one.measure: one.written for one in asked.require},
        "fallen_by_yield": said.fallen, "alike": [goal.measure for goal in said.alike],
        "bindings": refusal_table(said).rows,
        "relaxation": None if least is None else {
            "lets_go": {name: asdict(least.breaches[name]) for name in least.names},
            "at": asked.space.chosen(least.point),
        },
        "agreement": asdict(said.agreement),
        "base": said.base.as_json(), "base_differs": changed(asked, asked.base_point), "kept": kept,
    })


def front_csv(said: StudyAnswer) -> str:
    """The front: one row a design, the best by the first goal first; kept designs by their number."""
    asked, nothing = said.asked, (float("nan"),) * 2
    named = [title for name in asked.measures for title in (name, f"{name}.error")]
    rows: list[list[object]] = [[*(v.key for v in asked.space.variables), *named, "design"]]
    for row in front_table(said).rows:
        figures = [cell(value) for name in asked.measures for value in row["values"].get(name, nothing)]
        rows.append([*row["at"].values(), *figures, row["design"]])
    return csv_text(rows)
