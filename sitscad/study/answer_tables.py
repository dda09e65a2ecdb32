"""Tables of a study's answer. Each is made once, as rows of plain values: JSON and CSV have the rows as they are, text
and page show columns of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from sitscad.record import record
from sitscad.report.measures import Table
from sitscad.study.evaluation import Breach
from sitscad.study.measures import MEASURES
from sitscad.study.space import at_key
from sitscad.study.spreads import wilson
from sitscad.study.study import StudyAnswer
from sitscad.study.sweeping import rule_titles, shown
from sitscad.units import NONE, show

Row = Mapping[str, Any]


@record(eq=False)
class AnswerTable:
    """Rows of plain values under the keys of JSON, and the columns that people read: the text of a row by heading."""

    title: str
    rows: Sequence[Row]
    columns: Mapping[str, Callable[[Row], str]]

    def shown(self, *, most: int | None = None, without: Sequence[str] = ()) -> Table:
        """Return the first `most` rows as texts, without some columns and without those that are empty."""
        rows = self.rows[:most]
        texts = {head: [text(row) for row in rows] for head, text in self.columns.items() if head not in without}
        used = {head: column for head, column in texts.items() if any(column)}
        more = f" (the first {len(rows)} of {len(self.rows)})" if len(rows) < len(self.rows) else ""
        cells = [[cell or NONE for cell in row] for row in zip(*used.values(), strict=True)]
        return Table(list(used), cells, self.title + more)


REFUSALS = "What refuses designs: share of all that were looked at, and share that nothing else refuses"

NEAREST, WITH = "nearest, of those refused by it alone if any", "with"
"""Headings of the design that comes nearest to a limit: its figure, and its keys, which a text leaves out."""


def refusal_table(answer: StudyAnswer) -> AnswerTable:
    """Return rules and requirements with the shares of designs that they refuse, and the nearest design."""
    titles, chosen = rule_titles(), answer.asked.space.chosen
    rows = [{"name": one.name, "share": one.share, "alone": one.alone, "nearest": asdict(one.nearest),
             "at": chosen(one.nearest_at)} for one in answer.bindings]
    columns: dict[str, Callable[[Row], str]] = {
        "rule or requirement": lambda row: titles.get(name := str(row["name"]), name),
        "share": lambda row: f"{row['share']:.1%}",
        "alone": lambda row: f"{row['alone']:.1%}",
        NEAREST: lambda row: breach_words(row["name"], Breach(**row["nearest"])),
    }
    if any(columns[NEAREST](row) for row in rows):
        columns[WITH] = lambda row: keys_words(row["at"])
    return AnswerTable(REFUSALS, rows, columns)


BY_YIELD = "yield by "
"""Begins the name of what would cost too many units."""


def breach_words(name: str, breach: Breach) -> str:
    """Return how far a design is from a limit. Empty if it is not known, or if figure and limit read alike."""
    if breach.measured is None or breach.limit is None:
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


def keys_words(values: Mapping[str, Any]) -> str:
    """Return keys and values in a line."""
    return ", ".join(f"{key}: {value}" for key, value in values.items()) or "the base as it is"


def base_value(before: Mapping[str, Any], key: str) -> str:
    """Return a key of the base as it is written there. A dash if it is not there."""
    return NONE if (value := at_key(before, key)) is None else str(value)


def measure_columns(names: Sequence[str]) -> dict[str, Callable[[Row], str]]:
    """Return a column for each measure except sigmas. It shows the figure that a row has under ``values``."""
    def column(name: str) -> Callable[[Row], str]:
        return lambda row: shown(name, row["values"][name][0]) if name in row["values"] else NONE

    return {name: column(name) for name in names if not name.startswith("sigma.")}


def design_table(answer: StudyAnswer) -> AnswerTable:
    """Return the base and the designs that are kept: figures, yield, what refuses the base, and what differs."""
    before = answer.asked.base.values(())
    keys = dict.fromkeys(key for one in answer.kept for key in one.changed)
    rows: list[Row] = [{"design": "base", "changed": {key: base_value(before, key) for key in keys}, "accepted": [],
                        **answer.base.as_json(), "yield": None}]
    for number, one in enumerate(answer.kept, 1):
        units = None if one.units is None else {"share": one.units.share, **asdict(one.units)}
        rows.append({"design": f"designs/{number}.yaml", "changed": dict(one.changed), "accepted": one.accepted,
                     **one.evaluation.as_json(), "yield": units})
    columns = {
        "design": _number, **measure_columns(answer.asked.measures),
        "yield": lambda row: f"{row['yield']['share']:.1%}" if row["yield"] else "",
        "refused by": lambda row: ", ".join(row["refused"]) if row["design"] == "base" else "",
        "warnings that the study accepts": lambda row: ", ".join(row["accepted"]),
        "keys": lambda row: keys_words(row["changed"]),
    }
    goals = ", ".join(goal.words for goal in answer.asked.goals)
    return AnswerTable(f"Designs, the best {'by' if len(answer.asked.goals) == 1 else 'of'} {goals}",
                       rows if answer.kept else [], columns)


def _number(row: Row) -> str:
    """Return the number of a design that is kept, else its name."""
    return re.sub(r"designs/(\d+)\.yaml", r"\1", row["design"])


def yield_table(designs: AnswerTable) -> AnswerTable:
    """Return the yields of designs: interval, what loses units, the yield once calibrated, and what decides it."""
    rows = [{"design": row["design"], **row["yield"]} for row in designs.rows if row["yield"] is not None]

    def calibrated(row: Row) -> str:
        if row["calibrated"] <= row["good"]:
            return ""
        return f"{row['calibrated'] / row['units']:.1%} ({_interval(wilson(row['calibrated'], row['units']))})"

    return AnswerTable("Yields, the share of units as they are made that keep all", rows, {
        "design": _number,
        "yield": lambda row: f"{row['share']:.1%}",
        "at 95 %": lambda row: _interval(row["interval"]),
        "units": lambda row: str(row["units"]),
        "once calibrated": calibrated,
        "not computed": lambda row: str(row["failed"] or ""),
        "lost by": lambda row: ", ".join(f"{name} {share:.1%}" for name, share in row["broken"].items()),
        "decided by (Sobol' indices)": lambda row: ", ".join(f"{name} {index:.0%}" for name, index in
                                                             row["costs"].items()),
    })


def _interval(ends: Sequence[float]) -> str:
    low, high = ends
    return f"{low:.1%} to {high:.1%}"


def sigma_table(designs: AnswerTable) -> AnswerTable:
    """Return one sigma of measures by the estimates, to first order, beside that of the units that were drawn."""
    rows = [{"design": row["design"], "measure": name, "first_order": row["values"][f"sigma.{name}"][0], "drawn": drawn}
            for row in designs.rows if row["yield"] is not None
            for name, drawn in row["yield"]["sigmas"].items() if f"sigma.{name}" in row["values"]]
    return AnswerTable("One sigma from unit to unit", rows, {
        "design": _number,
        "measure": lambda row: row["measure"],
        "to first order": lambda row: shown(row["measure"], row["first_order"], 2),
        "of the units drawn": lambda row: shown(row["measure"], row["drawn"], 2),
    })


def front_table(answer: StudyAnswer) -> AnswerTable:
    """Return every design that no other beats, the best by the first goal first. Kept designs have their number."""
    numbers = {one.point: number for number, one in enumerate(answer.kept, 1)}
    rows = [{"at": answer.asked.space.chosen(point), "values": answer.found.of(point).as_json()["values"],
             "design": numbers.get(point, "")} for point in answer.front]

    def column(key: str) -> Callable[[Row], str]:
        return lambda row: str(row["at"][key])

    keys = {variable.key: column(variable.key) for variable in answer.asked.space.variables}
    return AnswerTable("", rows, {"kept": lambda row: str(row["design"]), **keys,
                                  **measure_columns(answer.asked.measures)})


LOW_YIELD = 0.9
"""Share of good units below which the answer cautions if the study asks for no yield."""


def low_yield_lines(answer: StudyAnswer) -> Iterator[str]:
    """Yield a caution if the study asks for no yield and keeps designs that lose many units."""
    low = [f"design {number} ({one.units.share:.1%})" for number, one in enumerate(answer.kept, 1)
           if one.units is not None and one.units.share < LOW_YIELD]
    if low and answer.asked.least_yield is None:
        yield (f"Caution: fewer than {LOW_YIELD:.0%} of the units keep all of {', '.join(low)}, and the study asks for "
               'no yield: with require: {yield: ">= 90 %"} such designs are dropped.')
