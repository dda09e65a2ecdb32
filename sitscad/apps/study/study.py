"""A study: reading its file, running its search, and returning its answer."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from sitscad.apps.study import answer
from sitscad.apps.study.answer import Agreement, Binding, KeptDesign, Relaxation
from sitscad.apps.study.document import VERSION, Goal, StudyDocument, StudyRequest, study_request
from sitscad.apps.study.evaluating import Executor, Workers, evaluate_design
from sitscad.apps.study.evaluation import ARCHIVE, Archive, Evaluation
from sitscad.apps.study.running import USELESS_COMMENT_RULE, Progress, StudyResults, StudyRun
from sitscad.apps.study.space import Base, Point
from sitscad.apps.study.spreads import DRAWS, Yield, compute_yield
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.checks.judging import all_rules
from sitscad.checks.judging import apply_rules as checked
from sitscad.checks.policy import matches_rule
from sitscad.estimates.design import Design
from sitscad.layout import arrange
from sitscad.layout.board import Layout
from sitscad.package.inspection import as_configured
from sitscad.spec.load import plain_data, read_text, yaml_text
from sitscad.spec.reading import (
    Flaw,
    Remarks,
    SpecError,
    decode_text,
    finding_from_flaw,
    finding_from_text,
    in_order,
    read_section,
)
from sitscad.spec.sensor import LONGEST_NAME
from sitscad.spec.yaml.source import TextError


@record(eq=False)
class StudyAnswer:
    """The results of a study, in the order of the report.

    ``base`` is the evaluation of the base at the full level, and ``results`` are all evaluations. ``bindings`` and
    ``relaxation`` describe the limits that refuse designs, and ``agreement`` compares both levels. ``constant_goals``
    are goals with equal values in all designs. ``front`` are the points that no other design beats. ``dropped_count``
    is the number of designs whose yield is too small. The front does not contain them. ``kept`` are the kept designs,
    and ``spec_texts`` the texts of their specs.
    """

    name: str
    request: StudyRequest
    base: Evaluation
    results: StudyResults
    bindings: tuple[Binding, ...]
    relaxation: Relaxation | None
    agreement: Agreement
    constant_goals: tuple[Goal, ...]
    front: tuple[Point, ...]
    kept: tuple[KeptDesign, ...]
    spec_texts: tuple[str, ...]
    dropped_count: int = 0

    def __repr__(self) -> str:
        """Return a line with the numbers of evaluated and kept designs."""
        return f"<StudyAnswer of {self.name}: {len(self.results.screened)} designs, {len(self.kept)} kept>"

    @cached_property
    def layouts(self) -> tuple[Layout, ...]:
        """Layouts of the kept designs."""
        return tuple(arrange(self.request.base.changed_spec(self.request.space.changes(design.point)))
                     for design in self.kept)

    @property
    def is_met(self) -> bool:
        """Whether at least one design meets the study."""
        return bool(self.kept)

    @property
    def lacks_yield(self) -> bool:
        """Whether a yield is required but was not computed."""
        return self.request.least_yield is not None and any(each.units is None for each in self.kept)


@record(eq=False)
class Study:
    """A study. `load` reads its file, and `from_mapping` takes its keys from a program."""

    name: str
    request: StudyRequest

    def __repr__(self) -> str:
        """Return a line with the number of the study's designs."""
        return f"<Study {self.name}: {self.request.space.size} designs>"

    @classmethod
    @checked_arguments
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """Return the study in a file. Raises `SpecError`, with every finding, if the file is not valid."""
        name = os.fspath(path)
        text = read_text(name)
        return _parse_study(decode_text(text.encode("utf-8")), name)

    @classmethod
    @checked_arguments
    def from_mapping(cls, sections: Mapping[str, Any], folder: str | os.PathLike[str] = ".") -> Study:
        """Return the study with these keys and values, as in a file. The base's path starts at `folder`."""
        try:
            text = yaml_text({"sitscad_study": VERSION, **plain_data(dict(sections))})
        except TextError as error:
            raise SpecError((finding_from_text(error),)) from None
        return _parse_study(text, os.path.join(os.fspath(folder), "study.yaml"))

    @checked_arguments
    def run(
        self,
        executor: Executor | None = None,
        *,
        folder: str | os.PathLike[str] | None = None,
        jobs: int | None = 1,
        again: bool = False,
        progress: Progress | None = None,
        draws: int = DRAWS,
        before_yields: Callable[[StudyAnswer], None] | None = None,
        interrupted: Callable[[StudyResults], None] | None = None,
    ) -> StudyAnswer:
        """Evaluate designs and return the answer. It depends on study, seed and version only.

        Parameters
        ----------
        executor
            An object with a `submit`, used in place of processes.
        folder
            Folder of the archive of evaluations. Evaluations that still apply are reused.
        jobs
            Number of processes. All processors if None.
        again
            Whether to discard the archive first.
        progress
            A function that is called with the state of the study.
        draws
            Number of units of each kept design: a power of two, or 0 for no yields.
        before_yields
            A function that is called with the answer before yields are computed, which takes minutes.
        interrupted
            A function that is called with the evaluations so far if Ctrl-C ends the search.

        Returns
        -------
        StudyAnswer
            The verdict, the kept designs and their yields.
        """
        request = self.request
        path = None if folder is None else Path(folder) / ARCHIVE
        with Archive(path, again) as archive, Workers(request.base, jobs, executor) as workers:
            run = StudyRun(request, workers, archive, progress)
            try:
                run.search()
            except KeyboardInterrupt:
                if interrupted is not None and run.found.screened:
                    interrupted(run.found)
                raise
            points = answer.kept_points(request, run.found)
            result = _with_kept_designs(self._answer_without_designs(run.found), points, {})
            if not result.kept or not draws:
                return result
            if before_yields is not None:
                before_yields(result)
            return _with_yields(result, run, draws)

    def _answer_without_designs(self, results: StudyResults) -> StudyAnswer:
        """Return the answer without kept designs."""
        request = self.request
        all_values = [evaluation.values for evaluation in results.screened.values()]
        undecided_goals = tuple(
            goal for goal in request.goals if len(all_values) > 1 and
            len({values[goal.measure][0] for values in all_values if goal.measure in values}) == 1)
        return StudyAnswer(
            self.name, request, evaluate_design(request.base.spec, request.measures), results,
            tuple(answer.binding_limits(request, results)), answer.smallest_relaxation(request, results),
            answer.level_agreement(request.goals, results), undecided_goals,
            tuple(answer.pareto_front(request, results)), (), (),
        )


def _with_kept_designs(result: StudyAnswer, points: Sequence[Point], yields: Mapping[Point, Yield]) -> StudyAnswer:
    """Return the answer with the designs at `points` as kept designs, their yields and the texts of their specs."""
    request, full = result.request, result.results.full
    designs = tuple(KeptDesign(point, answer.changed_keys(request, point), full[point], yields.get(point))
                    for point in points)
    return replace(result, kept=designs, spec_texts=tuple(_kept_design_text(request, design, k) for k,
                                                          design in enumerate(designs, 1)))


def _with_yields(result: StudyAnswer, run: StudyRun, draws: int) -> StudyAnswer:
    """Return the answer with the yields of its kept designs.

    The yield comes from `draws` simulated sensors. A design with too small a yield is dropped and another is tried.
    This ends when the number of dropped designs reaches the number to keep.
    """
    request, fallen = result.request, set[Point]()
    yields: dict[Point, Yield] = {}
    limits = [each for each in request.require if each.measure == "yield"]
    points = [design.point for design in result.kept]
    while True:
        units = run.simulated_units([point for point in points if point not in yields], draws)
        broken = partial(answer.broken_requirements, request.require)
        yields |= {point: compute_yield(judged, broken) for point, judged in units.items()}
        low = {point for point in points if not all(each.holds(yields[point].share) for each in limits)}
        is_last = not low or len(fallen) >= request.keep
        fallen |= low
        if is_last:
            break
        points = answer.kept_points(request, run.found, fallen)
    if not fallen:
        return replace(result, kept=tuple(replace(design, units=yields[design.point]) for design in result.kept))
    passing = [point for point in points if point not in low]
    rest = tuple(answer.pareto_front(request, run.found, fallen))
    return _with_kept_designs(replace(result, dropped_count=len(fallen), front=rest), passing, yields)


def _kept_design_text(request: StudyRequest, design: KeptDesign, number: int) -> str:
    """Return the text of the spec of kept design number `number`, with its own name.

    It has the base's comments, except comments that suppress no finding. The first line lists the changed keys.
    """
    base = request.base
    name = f"{base.spec.name[: LONGEST_NAME - 3]}-{number}"
    text = base.spec_text((*design.changed.items(), ("name", name)))
    spec = Base(text, base.path, base.profiles).spec
    result = as_configured(spec, checked(Design(spec), "none"))
    in_vain = [each.line for each in result.findings
               if each.rule == USELESS_COMMENT_RULE and each.line and each.severity is Severity.WARNING]
    stem = json.dumps(base.path.replace("\\", "/").rpartition("/")[2])
    changed = ", ".join(f"{key}: {json.dumps(value)}" for key, value in design.changed.items()) or "nothing"
    head = f"# Design {number} of a study of {stem}, with other values of {changed}. Comments below are the base's.\n"
    mark = text[: text.startswith("\ufeff")]  # byte order mark, which stays first
    rows = text.removeprefix(mark).split("\n")
    for line in in_vain:
        rows[line - 1] = _IGNORE.sub("", rows[line - 1])
    return mark + head + "\n".join(rows)


_IGNORE = re.compile(r"[ \t]*#[ \t]*sitscad:[ \t]*ignore[^\n]*")


def _parse_study(text: str, path: str) -> Study:
    document, source = read_section(text, path, StudyDocument, f"sitscad_study: {VERSION}")
    remarks = Remarks()
    base = os.path.join(os.path.dirname(path), document.base)
    try:
        request = study_request(document, Base.from_file(base), remarks)
    except SpecError as error:
        first = error.findings[0]
        where = f" (line {first.line})" if first.line else ""
        message = f"{base} cannot be read{where}: {first.message}"
        flaw = Flaw("SIT011", "base", message, f"`sitscad check {base}` says all of it")
        raise SpecError((finding_from_flaw(flaw, source),), source=source) from error
    unknown = [rule for rule in document.accept
               if rule != "all" and not any(matches_rule(rule, each.id, each.name) for each in all_rules())]
    for rule in unknown:
        remarks.flaw("SIT007", "accept", f"there is no rule {rule!r}", "`sitscad rules` lists them all")
    if remarks.flaws:
        raise SpecError(in_order([finding_from_flaw(flaw, source) for flaw in remarks.flaws]), source=source)
    stem = os.path.splitext(os.path.basename(path))[0]
    return Study(stem, request)
