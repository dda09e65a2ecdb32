"""The answer of a study as JSON, and as the files of its folder."""

from __future__ import annotations

import csv
import io
from typing import Any

from sitscad.report.findings import to_json
from sitscad.study.changes import code_version
from sitscad.study.evaluation import Breach
from sitscad.study.page import study_page
from sitscad.study.space import Point
from sitscad.study.spreads import Yield
from sitscad.study.study import StudyAnswer
from sitscad.units import cell
from sitscad.version import __version__


def answer_json(said: StudyAnswer) -> str:
    """The answer for programs; it depends on study, seed and version alone."""
    asked, found = said.asked, said.found
    return to_json({
        "sitscad": __version__, "code": code_version(), "study": said.name, "met": said.is_met,
        "method": found.method, "seed": asked.seed, "designs": asked.space.size, "screened": len(found.screened),
        "full": len(found.full), "goals": [goal.words for goal in asked.goals],
        "require": {one.measure: one.written for one in asked.require},
        "fallen_by_yield": said.fallen, "alike": [goal.measure for goal in said.alike],
        "bindings": [
            {"name": one.name, "share": one.share, "alone": one.alone, "nearest": _breach(one.nearest),
             "at": None if one.nearest_at is None else asked.space.chosen(one.nearest_at)}
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
        "base": said.base.as_json(),
        "kept": [
            {"design": f"designs/{number}.yaml", "changed": dict(one.changed), **one.evaluation.as_json(),
             "yield": None if one.units is None else yield_json(one.units)}
            for number, one in enumerate(said.kept, 1)
        ],
    })


def _breach(one: Breach | None) -> dict[str, Any] | None:
    return None if one is None else {"measured": one.measured, "limit": one.limit, "unit": one.unit}


def yield_json(units: Yield) -> dict[str, Any]:
    """A yield as plain values."""
    return {"share": units.share, "interval": list(units.interval), "units": units.units, "good": units.good,
            "calibrated": units.calibrated, "failed": units.failed, "broken": dict(units.broken),
            "costs": dict(units.costs), "sigmas": dict(units.sigmas)}


def front_csv(said: StudyAnswer) -> str:
    """The front: one row a design, the best by the first goal first; kept designs by their number."""
    asked, text = said.asked, io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    named = [title for name in asked.measures for title in (name, f"{name}.error")]
    writer.writerow([*(v.key for v in asked.space.variables), *named, "design"])
    numbers: dict[Point, int] = {one.point: k for k, one in enumerate(said.kept, 1)}
    for point in said.front:
        one = said.found.full[point]
        figures = [cell(value) for name in asked.measures for value in one.values.get(name, (float("nan"),) * 2)]
        writer.writerow([*asked.space.chosen(point).values(), *figures, numbers.get(point, "")])
    return text.getvalue()


def answer_files(said: StudyAnswer) -> dict[str, bytes]:
    """The files of a study's folder beside its archive, and those that the kept designs read."""
    own = said.asked.base.path.replace("\\", "/").rpartition("/")[2]
    files = {f"designs/{name}": content for name, content in said.asked.base.spec.source.files.items() if name != own}
    files |= {f"designs/{k}.yaml": text.encode("utf-8") for k, text in enumerate(said.texts, 1)}
    whole = {"front.csv": front_csv(said), "study.json": answer_json(said), "study.html": study_page(said)}
    return (files if said.kept else {}) | {name: text.encode("utf-8") for name, text in whole.items()}
