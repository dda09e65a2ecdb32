"""A study: read from its file, run, and answered."""

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
from sitscad.apps.study.answer import Agreement, Binding, Kept, Relaxation
from sitscad.apps.study.document import VERSION, Asked, Goal, StudyDocument, asked_for
from sitscad.apps.study.evaluating import Executor, Workers, judged
from sitscad.apps.study.evaluation import ARCHIVE, Archive, Evaluation
from sitscad.apps.study.running import IN_VAIN, Found, Progress, StudyRun
from sitscad.apps.study.space import Base, Point
from sitscad.apps.study.spreads import DRAWS, Yield, yield_of
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.checks.judging import all_rules
from sitscad.checks.judging import judged as checked
from sitscad.checks.policy import stands_for
from sitscad.estimates.design import Design
from sitscad.layout import arrange
from sitscad.layout.board import Layout
from sitscad.package.inspection import as_configured
from sitscad.spec.format.section import schema_of
from sitscad.spec.load import plain, read_text, yaml_text
from sitscad.spec.reading import (
    Flaw,
    Remarks,
    SpecError,
    decoded,
    finding_from_flaw,
    finding_from_text,
    in_order,
    read_section,
)
from sitscad.spec.sensor import LONGEST_NAME
from sitscad.spec.yaml.source import TextError


@record(eq=False)
class StudyAnswer:
    """What a study found, in the order in which it is told.

    ``base`` is the base itself, judged in full; ``found`` everything that was evaluated; ``bindings`` and
    ``relaxation`` what stands in the way; ``agreement`` how well both levels agree; ``alike`` goals that nothing that
    varies decides; ``front`` the points that none beats, without those that are ``fallen`` by their yields; ``kept``
    the designs that are kept, ``texts`` their specs.
    """

    name: str
    asked: Asked
    base: Evaluation
    found: Found
    bindings: tuple[Binding, ...]
    relaxation: Relaxation | None
    agreement: Agreement
    alike: tuple[Goal, ...]
    front: tuple[Point, ...]
    kept: tuple[Kept, ...]
    texts: tuple[str, ...]
    fallen: int = 0

    def __repr__(self) -> str:
        """A line with the numbers of designs that were looked at and kept."""
        return f"<StudyAnswer of {self.name}: {len(self.found.screened)} designs, {len(self.kept)} kept>"

    @cached_property
    def layouts(self) -> tuple[Layout, ...]:
        """The boards of the designs that are kept."""
        return tuple(arrange(self.asked.base.design(self.asked.space.changes(one.point))) for one in self.kept)

    @property
    def is_met(self) -> bool:
        """Whether a design keeps everything that is asked."""
        return bool(self.kept)

    @property
    def lacks_yield(self) -> bool:
        """Whether a yield is asked that was not worked out."""
        return self.asked.least_yield is not None and any(one.units is None for one in self.kept)


@record(eq=False)
class Study:
    """A study as its file says it; `load` reads a file, `from_mapping` takes its keys from a program."""

    name: str
    asked: Asked

    def __repr__(self) -> str:
        """A line with the number of designs that the study has."""
        return f"<Study {self.name}: {self.asked.space.size} designs>"

    @classmethod
    @checked_arguments
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """The study of a file; raises `SpecError` with every finding where it is none."""
        name = os.fspath(path)
        text = read_text(name)
        return _read(decoded(text.encode("utf-8")), name)

    @classmethod
    @checked_arguments
    def from_mapping(cls, sections: Mapping[str, Any], folder: str | os.PathLike[str] = ".") -> Study:
        """The study that keys and values say as its file would; its base is looked for from `folder`."""
        try:
            text = yaml_text({"sitscad_study": VERSION, **plain(dict(sections))})
        except TextError as error:
            raise SpecError((finding_from_text(error),)) from None
        return _read(text, os.path.join(os.fspath(folder), "study.yaml"))

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
        interrupted: Callable[[Found], None] | None = None,
    ) -> StudyAnswer:
        """Evaluate designs and answer: by `executor`, whatever has `submit`, else by `jobs` processes (all processors
        if None). With a `folder` what was evaluated is kept in its archive, and taken from there where it still fits,
        unless `again`. `draws` are the units of every kept design: a power of two, 0 for no yield. `before_yields` is
        told the answer before they are worked out, which takes minutes; `interrupted`, where Ctrl-C ends the search,
        the designs of the generations before.

        The answer depends on study, seed and version alone.
        """
        asked = self.asked
        path = None if folder is None else Path(folder) / ARCHIVE
        with Archive(path, again) as archive, Workers(asked.base, jobs, executor) as workers:
            run = StudyRun(asked, workers, archive, progress)
            try:
                run.search()
            except KeyboardInterrupt:
                if interrupted is not None and run.found.screened:
                    interrupted(run.found)
                raise
            said = _keeping(self._found(run.found), answer.kept_points(asked, run.found), {})
            if not said.kept or not draws:
                return said
            if before_yields is not None:
                before_yields(said)
            return _with_yields(said, run, draws)

    def _found(self, found: Found) -> StudyAnswer:
        """The answer before designs are kept."""
        asked = self.asked
        decided_by_nothing = tuple(
            goal for goal in asked.goals if len(found.screened) > 1 and
            len({one.values[goal.measure][0] for one in found.screened.values() if goal.measure in one.values}) == 1)
        return StudyAnswer(
            self.name, asked, judged(asked.base.spec, asked.measures), found, tuple(answer.bindings(asked, found)),
            answer.relaxation(asked, found), answer.agreement(asked.goals, found),
            decided_by_nothing, tuple(answer.front(asked, found)), (), (),
        )


def _keeping(said: StudyAnswer, points: Sequence[Point], yields: Mapping[Point, Yield]) -> StudyAnswer:
    """An answer with the designs that are kept, and what goes with them."""
    asked, full = said.asked, said.found.full
    kept = tuple(Kept(point, answer.changed(asked, point), full[point], yields.get(point)) for point in points)
    return replace(said, kept=kept, texts=tuple(_text(asked, one, k) for k, one in enumerate(kept, 1)))


def _with_yields(said: StudyAnswer, run: StudyRun, draws: int) -> StudyAnswer:
    """An answer with the yields of its designs; where one has too small a yield, the next one is looked at, until as
    many fell as there are to be kept.
    """
    asked, fallen = said.asked, set[Point]()
    yields: dict[Point, Yield] = {}
    limits = [each for each in asked.require if each.measure == "yield"]
    points = [one.point for one in said.kept]
    while True:
        units = run.units([point for point in points if point not in yields], draws)
        broken = partial(answer.limits_broken, asked.require)
        yields |= {point: yield_of(judged, broken) for point, judged in units.items()}
        low = {point for point in points if not all(each.holds(yields[point].share) for each in limits)}
        is_last = not low or len(fallen) >= asked.keep
        fallen |= low
        if is_last:
            break
        points = answer.kept_points(asked, run.found, fallen)
    if not fallen:
        return replace(said, kept=tuple(replace(one, units=yields[one.point]) for one in said.kept))
    kept = [point for point in points if point not in low]
    left = tuple(answer.front(asked, run.found, fallen))
    return _keeping(replace(said, fallen=len(fallen), front=left), kept, yields)


def _text(asked: Asked, one: Kept, number: int) -> str:
    """The whole spec of a kept design under a name of its own, with the base's comments, those that silence nothing
    taken out, and a line before them that says what is another one.
    """
    base = asked.base
    name = f"{base.spec.name[: LONGEST_NAME - 3]}-{number}"
    text = base.written((*one.changed.items(), ("name", name)))
    spec = Base(text, base.path, base.profiles).spec
    said = as_configured(spec, checked(Design(spec), "none"))
    in_vain = [found.line for found in said.findings
               if found.rule == IN_VAIN and found.line and found.severity is Severity.WARNING]
    own = json.dumps(base.path.replace("\\", "/").rpartition("/")[2])
    changed = ", ".join(f"{key}: {json.dumps(value)}" for key, value in one.changed.items()) or "nothing"
    head = f"# Design {number} of a study of {own}, with other values of {changed}. Comments below are the base's.\n"
    mark = text[: text.startswith("\ufeff")]  # of byte order, which stays first
    rows = text.removeprefix(mark).split("\n")
    for line in in_vain:
        rows[line - 1] = _IGNORE.sub("", rows[line - 1])
    return mark + head + "\n".join(rows)


_IGNORE = re.compile(r"[ \t]*#[ \t]*sitscad:[ \t]*ignore[^\n]*")


def _read(text: str, path: str) -> Study:
    document, source = read_section(text, path, StudyDocument, f"sitscad_study: {VERSION}")
    said = Remarks()
    base = os.path.join(os.path.dirname(path), document.base)
    try:
        found = asked_for(document, Base.opened(base), said)
    except SpecError as error:
        first = error.findings[0]
        where = f" (line {first.line})" if first.line else ""
        message = f"{base} cannot be read{where}: {first.message}"
        flaw = Flaw("SIT011", "base", message, f"`sitscad check {base}` says all of it")
        raise SpecError((finding_from_flaw(flaw, source),), source=source) from error
    unknown = [rule for rule in document.accept
               if rule != "all" and not any(stands_for(rule, one.id, one.name) for one in all_rules())]
    for rule in unknown:
        said.flaw("SIT007", "accept", f"there is no rule {rule!r}", "`sitscad rules` lists them all")
    if said.flaws:
        raise SpecError(in_order([finding_from_flaw(flaw, source) for flaw in said.flaws]), source=source)
    stem = os.path.splitext(os.path.basename(path))[0]
    return Study(stem, found)


def study_schema() -> dict[str, Any]:
    """The JSON Schema of a study's file."""
    return schema_of(StudyDocument, "sitscad study")
