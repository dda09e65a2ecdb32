"""Evaluation of a spec after each save, in stages with the quickest first. It runs in the worker process.

Results that a change does not affect are reused. Board, response and solids are reused if their inputs in the spec are
equal. Field solutions of targets and solutions of pads are reused, too.
"""

from __future__ import annotations

import gc
import json
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeAlias

from sitscad.apps.study.page import search_progress
from sitscad.apps.study.study import Study
from sitscad.assembly.places.bodies import PartsError
from sitscad.assembly.solids.solid import MissingExtra
from sitscad.basics.check_results import Measure
from sitscad.basics.finding import Severity
from sitscad.basics.quantities import TANK
from sitscad.basics.record import record
from sitscad.basics.units import quantity
from sitscad.checks.findings import CheckedSpec
from sitscad.checks.opening import check_unreadable, is_study, nearest_policy_of_spec, open_spec
from sitscad.checks.policy import PolicyError
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.design import Design
from sitscad.estimates.performance.tables import PerformanceReport
from sitscad.estimates.response.model import ResponseModel
from sitscad.files.documents.datasheet import figures_for_programs
from sitscad.files.formats.meshes import render_glb
from sitscad.kernels.solve_cache import Solutions
from sitscad.package.cached_solutions import cached_solutions
from sitscad.package.contents import Contents, nominal_calibration, spec_inputs
from sitscad.package.stages import report_page
from sitscad.spec.reading import SpecError

STAGES = ("findings", "board", "estimate", "feeling", "pushed", "solids", "sweep")
"""Stages in the order of evaluation. A study has only "findings" and "sweep"."""

DATA_SHEET, CALIBRATION, SOLIDS = "datasheet.json", "calibration/calibration.json", "mount/assembly.glb"
"""Files of a package that the interactive views of the page need."""

Document: TypeAlias = dict[str, Any]


@record
class Event:
    """Result of one stage of an evaluation.

    `data` is its content as JSON values. `page` is the web page; empty if no page is shown. `seconds` is the time since
    the evaluation began.
    """

    stage: str
    data: Document
    page: bytes = b""
    seconds: float = 0.0


@record(eq=False)
class EarlierResults:
    """Results of earlier saves, for reuse.

    `designs` holds the last readable design, `files` the files of each stage with their inputs, and `solutions` field
    solutions. `evaluated` maps keys of a study's designs to their evaluations.
    """

    designs: list[Design] = field(default_factory=list)
    evaluated: dict[str, Any] = field(default_factory=dict)
    files: dict[str, tuple[object, dict[str, bytes]]] = field(default_factory=dict)
    solutions: Solutions = field(default_factory=Solutions)


def stage_events(path: str, before: EarlierResults, serves: bool) -> Iterator[Event]:
    """Yield one event for each completed stage of the spec or study at a path.

    `before` holds results of earlier saves. If `serves` is False, stages that only the web page needs are skipped.
    """
    if is_study(path):
        yield from _study_events(path, before, serves)
        return
    began, policy = time.perf_counter(), nearest_policy_of_spec(path)
    try:
        spec = open_spec(path, policy)
    except SpecError as error:
        yield _refusal_event(path, error, time.perf_counter() - began)
        return
    design = before.designs[-1].drawn(spec) if before.designs else Design(spec)
    read = [path, *(str(Path(path).parent / name) for name in spec.source.files_to_store)]
    contents, files = Contents(design, policy, hints="none"), dict[str, bytes]()

    def event(stage: str, data: Document) -> Event:
        page = report_page(contents, files, is_built=False) if serves else b""
        return Event(stage, data, page, time.perf_counter() - began)

    with cached_solutions(spec.name, store=before.solutions):
        verdict = _verdict(contents.checked, read)
    yield Event("findings", verdict, seconds=time.perf_counter() - began)
    before.designs[:] = [design]
    if serves:
        yield event("board", {"coils": [coil.name for coil in design.layout.coils]})
    numbers = _numbers(design.estimates.all_coils, design.fit)
    yield Event("estimate", {"numbers": numbers}, seconds=time.perf_counter() - began)
    made_of = design.bare.spec, contents.checked.is_orderable
    feeling = _cached_files(before, "feeling", made_of, spec.name, lambda: _performance_figures(design.bare))
    files |= feeling
    if feeling:
        points = json.loads(feeling[DATA_SHEET])["performance"]
        yield event("feeling", {"numbers": _performance_text(points[-1])})
    if serves and feeling:
        files |= _cached_files(before, "pushed", made_of, spec.name,
                               lambda: _performance_figures(design.bare, design.bare.cells.weakest.response))
        yield event("pushed", {"bytes": len(files[DATA_SHEET])})
    if serves and spec.mount is not None:
        files |= _cached_files(before, "solids", spec_inputs("assembly", design.bare.spec), spec.name,
                               lambda: _solids(design))
        yield event("solids", {"bytes": sum(map(len, files.values()))})
    if serves and feeling:
        files |= _cached_files(before, "calibration", made_of, spec.name, lambda: {
            name: content for name, content in nominal_calibration(contents.design.bare, contents.is_forced).items()
            if name == CALIBRATION})
    contents = Contents(design, policy)  # with hints, which take as long as all rules
    yield event("findings", _verdict(contents.checked, read) | {"last": True})


def _study_events(path: str, before: EarlierResults, serves: bool) -> Iterator[Event]:
    """Yield the events of a study: its findings, and the progress of its evaluation. A page is made if `serves`."""
    began = time.perf_counter()
    try:
        study = Study.load(path)
    except SpecError as error:
        yield _refusal_event(path, error, time.perf_counter() - began)
        return
    counts = {severity.value: 0 for severity in Severity}
    data = {"counts": counts, "findings": [], "read": [path, study.request.base.path]}
    yield Event("findings", data, seconds=time.perf_counter() - began)
    for numbers, page in search_progress(study, before.evaluated, serves):
        yield Event("sweep", {"numbers": numbers}, page, time.perf_counter() - began)


def _refusal_event(path: str, error: SpecError, seconds: float) -> Event:
    """Return the event for a file that cannot be read: findings on its faults. `seconds` is the time that it took."""
    verdict = _verdict(check_unreadable(path, error, "decisive"), [path]) | {"unreadable": True}
    return Event("findings", verdict, seconds=seconds)


def _cached_files(before: EarlierResults, name: str, made_of: object, package: str, make: Any) -> dict[str, bytes]:
    """Return the files of the stage `name`, reused from an earlier save if its inputs `made_of` are equal.

    Otherwise `make` makes them. `package` is the package's name, under which field solutions are cached.
    """
    if name not in before.files or before.files[name][0] != made_of:
        with cached_solutions(package, store=before.solutions):
            before.files[name] = made_of, make()
    return before.files[name][1]


def _performance_figures(design: Design, pushed: ResponseModel | None = None) -> dict[str, bytes]:
    """Return the data sheet's file with computed values. `pushed` adds the table for pushing the sensor on the page."""
    report = PerformanceReport(design.performance, design.spec)
    if not report.points:
        return {}
    return {DATA_SHEET: figures_for_programs(report, pushed, cells=design.cells.skin.table.document())}


def _solids(design: Design) -> dict[str, bytes]:
    try:
        return render_glb(design.bare.solids.whole, design.bare.spec)
    except (MissingExtra, PartsError):
        return {}


def _verdict(checked: CheckedSpec, read: list[str]) -> Document:
    """Return the numbers of errors, warnings and notes, the findings, and the paths of the files that were read."""
    findings = [
        {"rule": each.rule, "severity": each.severity.value, "line": each.line, "column": each.column,
         "key": each.key, "message": each.message, "hint": each.hint or ""}
        for each in checked.findings
    ]
    counts = {severity.value: checked.count(severity) for severity in Severity}
    return {"counts": counts, "findings": findings, "read": read}


def _numbers(coils: Sequence[CoilEstimate], fit: Sequence[Measure]) -> Document:
    """Return numbers with units by label: values of each coil and state, and the margins of the fit."""
    figures: Document = {}
    for coil in coils:
        for name, state in coil.states.items():
            figures |= {f"{each.label} of {coil.name} {name}": each.plain(state) for each in TANK}
    return figures | {f"{each.name}, to spare": quantity(each.margin, "m") for each in fit}


def _performance_text(point: Document) -> Document:
    """Return the resolution and the range of each axis at full load, as texts with units."""
    return {
        f"{what} of {name.replace('_', ' along ')}": quantity(axis[key], "N")
        for name, axis in point["axes"].items()
        for what, key in (("resolution", "resolution_N"), ("range", "range_N"))
    }


def serve_requests(revisions: Connection, events: Connection, path: str, serves: bool) -> None:
    """Run the worker process: evaluate after each request, and send its events, then None.

    An unexpected error is sent as an event of the stage ``failed``.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this process

    before = EarlierResults()
    while True:
        try:
            revision = revisions.recv()
        except EOFError:
            sys.exit(0)
        try:
            for event in stage_events(path, before, serves):
                events.send((revision, event))
        except (PolicyError, OSError) as error:
            events.send((revision, Event("failed", {"message": str(error)})))
        except Exception as error:
            before.designs.clear()
            events.send((revision, Event("failed", {"message": f"internal error: {type(error).__name__}: {error}"})))
        events.send((revision, None))
        gc.collect()  # designs have reference cycles, and Python does not count their arrays
