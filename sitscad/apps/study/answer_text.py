"""Answer of a study as tables of values, as text and as JSON, and its Pareto front as CSV."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from sitscad.apps.study.answer import changed_keys, count_beaten_by_base, count_unjudged
from sitscad.apps.study.evaluating import NO_SCREEN
from sitscad.apps.study.evaluation import Breach
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.running import is_undrawable
from sitscad.apps.study.space import Space, code_version, value_at_key
from sitscad.apps.study.spreads import wilson_interval
from sitscad.apps.study.study import StudyAnswer
from sitscad.apps.study.sweeping import rule_titles, value_text
from sitscad.basics.messages import text_of
from sitscad.basics.quantities import Table
from sitscad.basics.record import record
from sitscad.basics.units import DASH, count_text, csv_text, number_cell, show
from sitscad.basics.version import __version__
from sitscad.checks.findings import to_json
from sitscad.files.report.numbers import table_text

Row = Mapping[str, Any]


@record(eq=False)
class AnswerTable:
    """A table: rows of values under their JSON keys, and for each column a function that returns its text for a row."""

    title: str
    rows: Sequence[Row]
    columns: Mapping[str, Callable[[Row], str]]

    def text_table(self, *, most: int | None = None, without: Sequence[str] = ()) -> Table:
        """Return the first `most` rows as texts. Columns in `without` and empty columns are left out."""
        rows = self.rows[:most]
        texts = {head: [text(row) for row in rows] for head, text in self.columns.items() if head not in without}
        used = {head: column for head, column in texts.items() if any(column)}
        more = f" (the first {len(rows)} of {len(self.rows)})" if len(rows) < len(self.rows) else ""
        cells = [[cell or DASH for cell in row] for row in zip(*used.values(), strict=True)]
        return Table(list(used), cells, self.title + more)


REFUSALS = "What refuses designs: share of all that were looked at, and share that nothing else refuses"

NEAREST, WITH = "nearest, of those refused by it alone if any", "with"
"""Column headings: distance from a limit of the nearest refused design, and keys of this design.

Text omits the latter.
"""


def refusal_table(answer: StudyAnswer) -> AnswerTable:
    """Return a table of rules and requirements: fractions of designs that each refuses, and nearest refused design."""
    titles, chosen = rule_titles(), answer.request.space.varied_values
    rows = [{"name": binding.name, "share": binding.share, "alone": binding.sole_share,
             "nearest": asdict(binding.nearest_breach),
             "at": chosen(binding.nearest_point)} for binding in answer.bindings]
    columns: dict[str, Callable[[Row], str]] = {
        "rule or requirement": lambda row: titles.get(name := str(row["name"]), name),
        "share": lambda row: f"{row['share']:.1%}",
        "alone": lambda row: f"{row['alone']:.1%}",
        NEAREST: lambda row: breach_text(row["name"], Breach(**row["nearest"])),
    }
    if any(columns[NEAREST](row) for row in rows):
        columns[WITH] = lambda row: keys_text(row["at"])
    return AnswerTable(REFUSALS, rows, columns)


BY_YIELD = "yield by "
"""Prefix of a measure in the name of a requirement that refuses a design because of its yield.

The design itself meets the limit, but too many manufactured sensors would break it.
"""


def breach_text(name: str, breach: Breach) -> str:
    """Return the value of a design and the limit as text, for the rule or requirement `name`.

    Empty if either is unknown, or if the texts are equal.
    """
    if breach.measured is None or breach.limit is None:
        return ""
    measure = name.removeprefix(BY_YIELD)
    if measure in MEASURES:
        at = " (with its scatter)" if measure != name else ""
        measured, limit = (value_text(measure, value, 6) for value in (breach.measured, breach.limit))
    else:
        at, measured, limit = "", show(breach.measured, breach.unit, 6), show(breach.limit, breach.unit, 6)
    if breach.sigma is not None:
        return f"{measured} keeps {limit} by {breach.sigma:.2g} sigma of manufacture where one is asked"
    return f"{measured}{at} where {limit} is asked" if measured != limit else ""


def keys_text(values: Mapping[str, Any]) -> str:
    """Return keys and values as text on one line."""
    return ", ".join(f"{key}: {value}" for key, value in values.items()) or "the base as it is"


def base_value(before: Mapping[str, Any], key: str) -> str:
    """Return a key's value from the base spec's values (`before`), as written there. A dash if the key is missing."""
    return DASH if (value := value_at_key(before, key)) is None else str(value)


def measure_columns(names: Sequence[str]) -> dict[str, Callable[[Row], str]]:
    """Return a text function for each measure by its name. Measures ``sigma.*`` are left out.

    Each function returns the text of the measure's value in a row's ``values``, or a dash.
    """
    def column(name: str) -> Callable[[Row], str]:
        return lambda row: value_text(name, row["values"][name][0]) if name in row["values"] else DASH

    return {name: column(name) for name in names if not name.startswith("sigma.")}


def design_table(answer: StudyAnswer) -> AnswerTable:
    """Return a table of base and kept designs: measures, yield, rules that refuse the base, and changed keys."""
    before = answer.request.base.changed_values(())
    keys = dict.fromkeys(key for design in answer.kept for key in design.changed)
    rows: list[Row] = [{"design": "base", "changed": {key: base_value(before, key) for key in keys}, "accepted": [],
                        **answer.base.as_json(), "yield": None}]
    for number, design in enumerate(answer.kept, 1):
        units = None if design.units is None else {"share": design.units.share, **asdict(design.units)}
        rows.append({"design": f"designs/{number}.yaml", "changed": dict(design.changed),
                     "accepted": design.accepted_warnings, **design.evaluation.as_json(), "yield": units})
    columns = {
        "design": _number, **measure_columns(answer.request.measures),
        "yield": lambda row: f"{row['yield']['share']:.1%}" if row["yield"] else "",
        "refused by": lambda row: ", ".join(row["refused"]) if row["design"] == "base" else "",
        "warnings that the study accepts": lambda row: ", ".join(row["accepted"]),
        "keys": lambda row: keys_text(row["changed"]),
    }
    goals = ", ".join(goal.written for goal in answer.request.goals)
    return AnswerTable(f"Designs, the best {'by' if len(answer.request.goals) == 1 else 'of'} {goals}",
                       rows if answer.kept else [], columns)


def _number(row: Row) -> str:
    """Return the number of a kept design as text, or "base"."""
    return re.sub(r"designs/(\d+)\.yaml", r"\1", row["design"])


def yield_table(designs: AnswerTable) -> AnswerTable:
    """Return a table of the yields of designs.

    Its columns are the yield, its 95 % interval, the number of simulated sensors, the yield after calibration, and the
    number of failed computations. Further columns are the fraction of sensors that each rule refuses, and the Sobol'
    indices (fractions of the variance) of the manufacturing errors that determine the yield.
    """
    rows = [{"design": row["design"], **row["yield"]} for row in designs.rows if row["yield"] is not None]

    def calibrated(row: Row) -> str:
        if row["calibrated"] <= row["good"]:
            return ""
        interval = _interval_text(wilson_interval(row["calibrated"], row["units"]))
        return f"{row['calibrated'] / row['units']:.1%} ({interval})"

    return AnswerTable("Yields, the share of units as they are made that keep all", rows, {
        "design": _number,
        "yield": lambda row: f"{row['share']:.1%}",
        "at 95 %": lambda row: _interval_text(row["interval"]),
        "units": lambda row: str(row["units"]),
        "once calibrated": calibrated,
        "not computed": lambda row: str(row["failed"] or ""),
        "lost by": lambda row: ", ".join(f"{name} {share:.1%}" for name, share in row["broken"].items()),
        "decided by (Sobol' indices)": lambda row: ", ".join(f"{name} {index:.0%}" for name, index in
                                                             row["costs"].items()),
    })


def _interval_text(ends: Sequence[float]) -> str:
    low, high = ends
    return f"{low:.1%} to {high:.1%}"


def sigma_table(designs: AnswerTable) -> AnswerTable:
    """Return a table of standard deviations of measures between manufactured sensors.

    One column has the linearised estimate, the other the standard deviation over the simulated sensors.
    """
    rows = [{"design": row["design"], "measure": name, "first_order": row["values"][f"sigma.{name}"][0], "drawn": sigma}
            for row in designs.rows if row["yield"] is not None
            for name, sigma in row["yield"]["sigmas"].items() if f"sigma.{name}" in row["values"]]
    return AnswerTable("One sigma from unit to unit", rows, {
        "design": _number,
        "measure": lambda row: row["measure"],
        "to first order": lambda row: value_text(row["measure"], row["first_order"], 2),
        "of the units drawn": lambda row: value_text(row["measure"], row["drawn"], 2),
    })


def front_table(answer: StudyAnswer) -> AnswerTable:
    """Return a table of the Pareto front, the best by the first goal first. Kept designs have their number."""
    numbers = {design.point: number for number, design in enumerate(answer.kept, 1)}
    rows = [{"at": answer.request.space.varied_values(point),
             "values": answer.results.evaluation(point).as_json()["values"], "design": numbers.get(point, "")}
            for point in answer.front]

    def column(key: str) -> Callable[[Row], str]:
        return lambda row: str(row["at"][key])

    keys = {variable.key: column(variable.key) for variable in answer.request.space.variables}
    return AnswerTable("", rows, {"kept": lambda row: str(row["design"]), **keys,
                                  **measure_columns(answer.request.measures)})


LOW_YIELD = 0.9
"""Yield (fraction of good sensors) below which the answer has a caution, if the study requires no yield."""


def low_yield_lines(answer: StudyAnswer) -> Iterator[str]:
    """Yield a caution if the study requires no yield and keeps designs with a yield below `LOW_YIELD`."""
    low = [f"design {number} ({design.units.share:.1%})" for number, design in enumerate(answer.kept, 1)
           if design.units is not None and design.units.share < LOW_YIELD]
    if low and answer.request.least_yield is None:
        yield (f"Caution: fewer than {LOW_YIELD:.0%} of the units keep all of {', '.join(low)}, and the study asks for "
               'no yield: with require: {yield: ">= 90 %"} such designs are dropped.')


MOST_BINDING = 6
"""Largest number of rules and requirements in the text. JSON has all of them."""

UNMADE = "Designs that SIT0 rules refuse cannot be drawn, and nothing else was asked of them."


def answer_text(answer: StudyAnswer, folder: str = "") -> str:
    """Return the answer as text: verdict, limits that refuse designs, kept designs, yields, and next steps."""
    return f"{search_text(answer)}\n{yields_text(answer, folder)}"


def search_text(answer: StudyAnswer) -> str:
    """Return the part of the answer's text that is known before yields are computed."""
    refusals = refusal_table(answer).text_table(most=MOST_BINDING, without=(WITH,))
    count = answer.dropped_count
    fallen = [f"dropped, for their units have too small a yield: {count}"] if count else []
    return _paragraphs(verdict_lines(answer), refusals, refusal_lines(answer), design_table(answer).text_table(),
                       fallen, trust_lines(answer))


def yields_text(answer: StudyAnswer, folder: str, before: StudyAnswer | None = None) -> str:
    """Return the part of the answer's text that is known after yields are computed.

    If the kept designs differ from those in `before` (the answer without yields), they are listed again.
    """
    designs = design_table(answer)
    is_other = before is not None and [each.point for each in before.kept] != [each.point for each in answer.kept]
    again = (verdict_lines(answer), designs.text_table()) if is_other else ()
    return _paragraphs(*again, yield_table(designs).text_table(), sigma_table(designs).text_table(),
                       low_yield_lines(answer), next_step_lines(answer, folder))


def _paragraphs(*parts: Table | Iterable[str]) -> str:
    """Return tables and lines as blocks with an empty line between them."""
    blocks = (table_text(part) if isinstance(part, Table) else "\n".join(part) for part in parts)
    return "\n\n".join(block for block in blocks if block) + "\n"


def verdict_lines(answer: StudyAnswer) -> Iterator[str]:
    """Yield lines with the verdict and the numbers of evaluated designs."""
    request, results, good = answer.request, answer.results, len(answer.front)
    tried = _message("study-tried", evaluated=len(results.screened), size=request.space.size, method=results.method,
                  full=len(results.full))
    if answer.is_met and answer.lacks_yield:
        yield _message("study-met-yield-unknown", required=_required_yield_text(answer), tried=tried, good=good)
    elif answer.is_met:
        yield _message("study-met", tried=tried, good=good)
    elif answer.dropped_count:
        yield _message("study-no-yield", required=_required_yield_text(answer), tried=tried, drawn=answer.dropped_count,
                       good=good)
    else:
        yield _message("study-unmet", tried=tried)
        if more := count_unjudged(request, results):
            yield _message("study-unjudged", more=more)
    if answer.is_met and (beaten := count_beaten_by_base(request, answer.base, answer.kept)):
        case = "study-base-best" if beaten == len(answer.kept) else "study-base-better"
        yield _message(case, beaten=beaten, kept=len(answer.kept))
    for number, key in enumerate(request.space.variables):
        at = {design.point[number] for design in answer.kept}
        if key.is_ordered and len(key.values) > 2 and len(at) == 1 and at <= {0, len(key.values) - 1}:
            end, = at
            yield _message("study-last-value" if end else "study-first-value", key=key.key, value=str(key.values[end]))
    if off := changed_keys(request, request.base_point):
        before = request.base.changed_values(())
        values = [f"{key}: {value} in place of {base_value(before, key)}" for key, value in off.items()]
        yield _message("study-base-apart", values=values)
    if request.space.size > len(results.screened) and not answer.is_met:
        yield _message("study-no-proof")
    for goal in answer.constant_goals:
        yield _message("study-constant-goal", measure=goal.measure)


def _message(case: str, **values: object) -> str:
    return text_of(case, "message", values)


def _required_yield_text(answer: StudyAnswer) -> str:
    return next(each.written for each in answer.request.require if each.measure == "yield")


def refusal_lines(answer: StudyAnswer) -> Iterator[str]:
    """Yield lines that explain refusals and state the smallest relaxation with which a design would pass."""
    if is_undrawable(each.name for each in answer.bindings):
        yield UNMADE
    if (least := answer.relaxation) is not None:
        titles = rule_titles()
        texts = [f"let go of {titles.get(name, name)} {breach_text(name, least.breaches[name])}".rstrip()
                 for name in least.names]
        yield f"The smallest relaxation that was tried and admits a design: {'; '.join(texts)}"
        yield f"with {keys_text(answer.request.space.varied_values(least.point))}"


def trust_lines(answer: StudyAnswer) -> Iterator[str]:
    """Yield lines on the agreement of screen and full level."""
    agreement = answer.agreement
    if unscreened := answer.results.unscreened:
        designs = count_text(len(answer.results.screened), "design")
        yield f"{unscreened} of {designs} took the full level at once: {NO_SCREEN}."
    if agreement.designs:
        ranks = ", ".join(f"{name} {rank:.4g}" for name, rank in agreement.rank_correlation.items() if rank is not None)
        text = (f"{agreement.verdicts_differ} verdicts differ, {agreement.undecided} were left to the full level"
                if agreement.undecided < agreement.designs else "the screen could refuse none of them")
        yield (f"Screen against full on {agreement.designs} designs whose leads are drawn: {text}"
               + (f"; rank correlation {ranks}." if ranks else "."))


def next_step_lines(answer: StudyAnswer, folder: str) -> Iterator[str]:
    """Yield lines with the next commands."""
    if not answer.kept:
        yield "Next: widen a range, relax what binds, or search longer (search.evaluations)."
    elif folder:
        design = shlex.quote(f"{folder}/designs/1.yaml")
        yield f"Next: sitscad build {design}"
        if range_of_one := sweep_range(answer.request.space):
            yield f"One key alone: sitscad sweep {design} {shlex.quote(range_of_one)}"


MOST_SWEPT = 7
"""Number of values in the suggested command for a sweep."""


def sweep_range(space: Space) -> str:
    """Return the text of a range over the first varied key that determines no other key. Empty if there is none."""
    bound = {*space.linked.values(), *space.implied}
    for variable in space.variables:
        last = len(variable.values) - 1
        values = [str(variable.values[k]) for k in sorted({k * last // (MOST_SWEPT - 1) for k in range(MOST_SWEPT)})]
        if variable.key not in bound and not any("," in value for value in values):
            return f"{variable.key}={','.join(values)}"
    return ""


def answer_json(answer: StudyAnswer) -> str:
    """Return the answer as JSON. It depends only on the study, its seed and sitscad's version."""
    request, results, least = answer.request, answer.results, answer.relaxation
    _, *designs = design_table(answer).rows or [{}]
    return to_json({
        "sitscad": __version__, "code": code_version(), "study": answer.name,
        "met": None if answer.lacks_yield else answer.is_met,
        "method": results.method, "seed": request.seed, "designs": request.space.size,
        "screened": len(results.screened), "full": len(results.full), "unjudged": count_unjudged(request, results),
        "goals": [goal.written for goal in request.goals],
        "require": {requirement.measure: requirement.written for requirement in request.require},
        "fallen_by_yield": answer.dropped_count, "alike": [goal.measure for goal in answer.constant_goals],
        "bindings": refusal_table(answer).rows,
        "relaxation": None if least is None else {
            "lets_go": {name: asdict(least.breaches[name]) for name in least.names},
            "at": request.space.varied_values(least.point),
        },
        "agreement": asdict(answer.agreement),
        "base": answer.base.as_json(), "base_differs": changed_keys(request, request.base_point), "kept": designs,
    })


def front_csv(answer: StudyAnswer) -> str:
    """Return the Pareto front as CSV with one row per design, the best by the first goal first.

    Kept designs have their number.
    """
    request, nothing = answer.request, (float("nan"),) * 2
    named = [title for name in request.measures for title in (name, f"{name}.error")]
    rows: list[list[object]] = [[*(v.key for v in request.space.variables), *named, "design"]]
    for row in front_table(answer).rows:
        figures = [number_cell(value) for name in request.measures for value in row["values"].get(name, nothing)]
        rows.append([*row["at"].values(), *figures, row["design"]])
    return csv_text(rows)
