"""The stages of a build. A stage makes a group of files, or keeps the old files if their inputs have not changed."""

from __future__ import annotations

import dataclasses
import json
import multiprocessing
import re
import signal
import time
from collections.abc import Mapping
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from sitscad.assembly.places.bodies import PartsError
from sitscad.assembly.places.fit import hinge_pivot
from sitscad.assembly.solids import MissingExtra
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.checks.findings import as_json, numbered_places, to_json
from sitscad.checks.policy import Baseline, Policy, baseline_findings
from sitscad.estimates.design import Design
from sitscad.estimates.states.cells import cells_for_page
from sitscad.files.documents import PAPERS
from sitscad.files.documents.drawings import fit, jaw, plan_view
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.documents.mounting import unread_files
from sitscad.files.documents.preparing import is_missing_list_right
from sitscad.files.drawing.pictures.layout_picture import PicturePoint, layout_svg
from sitscad.files.drawing.svg import svg
from sitscad.files.formats import WRITERS
from sitscad.files.report.moving import live_page, pushed_document, solids_document
from sitscad.files.report.page import render
from sitscad.files.writer import STAGES, Package, Writer, added_writers, marks
from sitscad.layout.tail.tracks import contact_rows
from sitscad.package.contents import (
    BESIDE_TAIL,
    Contents,
    board_inputs,
    incoming_tests,
    nominal_calibration,
    spec_inputs,
)
from sitscad.package.folder import FILE_NAME, PackageError
from sitscad.package.manifest import (
    CHECK_STAGE,
    EXTRA_STAGES,
    FORCED_NOTE,
    KERNELS,
    MANIFEST,
    SOLID_STAGES,
    SPEC_FOLDER,
    UNNAMED,
    Entry,
    Manifest,
    Progress,
    StageResult,
    hash_inputs,
    read_intact_files,
    sha256,
    version_of,
    with_equal_figures,
)
from sitscad.spec.sensor import SensorSpec

PERFORMANCE_FILE = "datasheet.json"
"""File of the data sheet with the sensing performance. Report and estimate repeat its values."""

PRINTED, NOTES = "mount/print.json", "mount/assembly.txt"
"""File with the list of printed parts, and file with the assembly steps, which repeats this list."""

FIT = "mount/fit.json"
"""File with dimensions measured on the solids. Findings on the fit of the parts use them."""

FIT_PICTURE, SOLIDS_PICTURE = "fit.svg", "mount/fit-solids.svg"
"""Pictures of parts that do not fit: sections with dimensions, and views of the solids."""


@record
class BuiltFiles:
    """Results of all stages, with the bytes and the manifest entry of each file.

    ``by_value`` lists the files that were taken from the old package because their numbers agree with the new numbers.
    """

    results: tuple[StageResult, ...]
    files: Mapping[str, bytes]
    entries: Mapping[str, Entry]
    contents: Contents
    by_value: tuple[str, ...] = ()


def package_contents(
    spec: SensorSpec | Design, policy: Policy, baseline: Baseline | None, chosen: frozenset[str] = frozenset(),
) -> Contents:
    """Return a spec's design with the policy and the baseline for its findings.

    If `chosen` contains stages with solids, the STEP files that the spec names are read first. A faulty STEP file
    becomes a finding.
    """
    design = spec if isinstance(spec, Design) else Design(spec)
    measured = "" if chosen.isdisjoint(SOLID_STAGES) else unread_files(design.spec.mount, design.spec.source)
    return Contents(design, policy, baseline, measured)


def new_manifest(
    contents: Contents, product: BuiltFiles, old: Manifest, built_from: str, chosen: frozenset[str]
) -> Manifest:
    """Return the manifest of a package.

    `chosen` are the stages requested now. The stages requested earlier are added if the old package was built from the
    same inputs.
    """
    before = old.built_for if old.built_from == built_from else ()
    # Inputs besides the spec: policy and baseline for its findings, and plugins
    judged_by = contents.policy.as_json() if contents.policy.changes_findings else {}
    source = contents.design.spec.source
    baseline = baseline_findings(contents.baseline, source.path, contents.spec.name)
    beside = {"baseline": baseline, "plugins": dict(marks())}
    layout = contents.layout
    pins = {net: tuple(sorted(pad.pin for pad in layout.all_pads if pad.net == net)) for net in layout.nets}
    return Manifest(
        spec={"name": contents.spec.name, "file": contents.file_name, "sha256": source.sha256},
        forced=contents.is_forced, nets=pins, files=product.entries,
        configuration={**judged_by, **{key: value for key, value in beside.items() if value}}, built_from=built_from,
        built_for=tuple(sorted({*chosen, *before})), drawn=contents.spec.coil.drawn or "",
    )


def make_stages(
    contents: Contents, directory: Path, old: Manifest, chosen: frozenset[str], progress: Progress, force: bool = False,
    jobs: int = 1, figures: Mapping[str, bytes] | None = None,
) -> BuiltFiles:
    """Make the chosen stages, or keep their files from the old package if their inputs are unchanged.

    Unchanged files of other stages are kept, too. With `force`, if the check of the solids finds further errors,
    earlier files are made again, so that their warning lists all errors. With two or more `jobs`, a second process
    makes the solids. `figures` are old files with computed numbers, by name. An old file is kept if its numbers agree
    with the new numbers, and later files then use it (`sitscad.package.manifest`).
    """
    rendered: dict[str, PartFiles] = {}
    built = _make_parts(contents, directory, old, chosen, progress, jobs, figures or {}, rendered)
    if not force or built.contents.forced == contents.forced:
        return built
    measured_contents = dataclasses.replace(contents, measured=built.contents.measured)
    return _make_parts(measured_contents, directory, old, chosen, lambda *_: None, 1, figures or {}, rendered)


ORDER = (*STAGES[:-1], CHECK_STAGE, STAGES[-1])
"""Stages in the order in which they are reported. Checks and report come last, because they use all other files."""

PARTS = (
    *((stage, False) for stage in ORDER[:-2] if stage not in SOLID_STAGES),
    *((stage, False) for stage in SOLID_STAGES),
    ("assembly", True),
    (CHECK_STAGE, False),
    ("report", False),
)
"""Parts of the build in the order of making: (stage, whether it is the stage's second pass).

With two processes, the second process makes the solids while the first process makes the stages before them. The
assembly has two passes: solids, then texts with computed numbers. A change of the readout therefore keeps the solids.
"""


def _make_parts(
    contents: Contents, directory: Path, old: Manifest, chosen: frozenset[str], progress: Progress, jobs: int,
    figures: Mapping[str, bytes], rendered: dict[str, PartFiles],
) -> BuiltFiles:
    # `rendered` holds the parts of the first pass by the hash of their inputs
    new: dict[str, dict[str, bytes]] = {stage: {} for stage in ORDER}
    failures: dict[str, list[str]] = {stage: [] for stage in ORDER}
    spent, kept_parts, entries, theirs = dict.fromkeys(ORDER, 0.0), [], dict[str, Entry](), dict[str, str]()
    by_value, begun = list[str](), {CHECK_STAGE}
    second = _start_solids(contents, directory, old, chosen) if jobs > 1 else None
    try:
        for stage, numbers in PARTS:
            began = time.perf_counter()
            previous = {name: content for each in ORDER for name, content in new[each].items()}
            failed = [message for each in ORDER for message in failures[each]]
            there = _package_stages(chosen, entries, old) if (stage, numbers) == ("assembly", True) else frozenset()
            made_of = _inputs_hash(contents, stage, numbers, entries, failed)
            part_files = _unchanged_files(directory, old, stage, made_of)
            if part_files is not None and stage in chosen and NOTES in part_files:
                # None if the steps name other files as missing than those that are missing
                part_files = part_files if is_missing_list_right(part_files[NOTES].decode(), there) else None
            if part_files is None and stage in chosen and stage not in begun:
                progress(stage, "start", 0.0)
                begun.add(stage)
            if part_files is not None:
                kept_parts.append((stage, numbers))
            elif stage not in chosen:
                part_files = {}
            elif stage == CHECK_STAGE:
                part_files = _require_free_names(stage, previous, _checked_files(contents, failed, previous), theirs)
            else:
                if second is not None and (stage, numbers) in second.parts:
                    rendered[made_of] = second.next_part()
                elif made_of not in rendered:
                    rendered[made_of] = _render_part(contents, stage, numbers, new[stage], previous, there)
                part = rendered[made_of]
                part_files = _require_free_names(stage, previous, part.files, theirs)
                failures[stage] += part.failures
                theirs |= part.theirs
            as_rendered, part_files = part_files, with_equal_figures(part_files, figures)
            by_value += (name for name in part_files if part_files[name] != as_rendered[name])
            if FIT in part_files:
                contents = dataclasses.replace(contents, measured=part_files[FIT].decode("ascii"))
            new[stage] |= part_files
            entries |= {name: Entry(sha256(content), stage, made_of) for name, content in part_files.items()}
            spent[stage] += time.perf_counter() - began
            if stage not in (CHECK_STAGE, "assembly") or numbers:
                progress(stage, _outcome(stage, new[stage], kept_parts, old, chosen), spent[stage])
    finally:
        if second is not None:
            second.process.terminate()
    results = [StageResult(stage, _outcome(stage, new[stage], kept_parts, old, chosen), len(new[stage]), spent[stage])
               for stage in ORDER]
    files = {name: content for stage in ORDER for name, content in new[stage].items()}
    return BuiltFiles(tuple(results), files, {name: entries[name] for name in files}, contents, tuple(by_value))


def _package_stages(chosen: frozenset[str], entries: Mapping[str, Entry], old: Manifest) -> frozenset[str]:
    """Return the stages that the package will have: the chosen stages, and the stages of the files in `entries`.

    An old report is kept, even if it was not requested, if all other files stay the same.
    """
    before = {name: entry for name, entry in old.files.items()
              if entry.stage not in ("assembly", CHECK_STAGE, STAGES[-1])}
    is_kept = bool(old.stage_entries(STAGES[-1])) and all(entries.get(name) == entry for name, entry in before.items())
    return chosen | {entry.stage for entry in entries.values()} | ({STAGES[-1]} if is_kept else set())


def _inputs_hash(
    contents: Contents, stage: str, numbers: bool, entries: dict[str, Entry], failures: list[str]
) -> str:
    """Return the hash of all inputs of a stage's files, or with `numbers` of its files with computed numbers.

    `entries` are the files made so far, and `failures` the messages about files that could not be written. If plugins
    are active, the hash includes the whole spec, because plugins may read any key.
    """
    read = (marks(), contents.spec, contents.design.spec.source.text) if marks() else ()
    printed = (entries.get(PRINTED),) if (stage, numbers) == ("assembly", True) else ()
    return hash_inputs(stage, *_stage_inputs(contents, stage, numbers, entries, failures), *printed, *read)


def _unchanged_files(directory: Path, old: Manifest, stage: str, made_of: str) -> dict[str, bytes] | None:
    """Return the files of a stage from the old package.

    None if they have other inputs than `made_of`, or are damaged.
    """
    before = {name: entry for name, entry in old.stage_entries(stage).items() if entry.made_from == made_of}
    return read_intact_files(directory, before) if before else None


def _outcome(
    stage: str, new: dict[str, bytes], kept_parts: list[tuple[str, bool]], old: Manifest, chosen: frozenset[str]
) -> str:
    if new and all(part in kept_parts for part in PARTS if part[0] == stage):
        return "kept"
    if stage in chosen:
        return "made" if new else "none"
    return "dropped" if old.stage_entries(stage) else "none"


@record
class PartFiles:
    """Files of one part of the build, as bytes by file name.

    ``failures`` are messages about files that could not be written. ``theirs`` maps the name of each file from a
    plugin, in lower case, to the plugin's name.
    """

    files: dict[str, bytes]
    failures: list[str]
    theirs: dict[str, str]


@record(eq=False)
class SolidsProcess:
    """Second process that makes the parts `parts` of the build, and the connection on which it sends them.

    It sends the files of each part, or the exception that stopped it.
    """

    parts: tuple[tuple[str, bool], ...]
    process: BaseProcess
    sent: Connection

    def next_part(self) -> PartFiles:
        """Return the files of the next part.

        Raises the exception of the process, or BrokenProcessPool if the process ended without an exception.
        """
        try:
            part = self.sent.recv()
        except EOFError as error:
            raise BrokenProcessPool("the process that makes the solids has ended") from error
        if isinstance(part, BaseException):
            raise part
        assert isinstance(part, PartFiles)
        return part


def _start_solids(contents: Contents, directory: Path, old: Manifest, chosen: frozenset[str]) -> SolidsProcess | None:
    """Start a second process that makes the chosen solids. None if there are none, or if no other stage takes long.

    The process is a new one and not a copy of this process. A copy would contain locks of threads that do not run in
    it, and could wait for them forever. The new process loads no plugins. If plugins are active, this process therefore
    makes the solids.
    """
    solids = [(stage, False) for stage in SOLID_STAGES if stage in chosen]
    hashes = {part: _inputs_hash(contents, *part, {}, []) for part in solids}
    parts = tuple(part for part in solids if _unchanged_files(directory, old, part[0], hashes[part]) is None)
    if not parts or "datasheet" not in chosen or marks():
        return None
    context = multiprocessing.get_context("spawn")
    received, sent = context.Pipe(duplex=False)
    arguments = contents.design.spec, contents.policy, contents.baseline, contents.measured, contents.forced, parts
    process = context.Process(target=_render_solids, args=(sent, *arguments), daemon=True)
    process.start()
    sent.close()
    return SolidsProcess(parts, process, received)


def _render_solids(
    sent: Connection, spec: SensorSpec, policy: Policy, baseline: Baseline | None, measured: str, forced: str,
    parts: tuple[tuple[str, bool], ...],
) -> None:
    """Make the `parts` of the build in the second process, and send the files of each part.

    `measured` is the text of ``mount/fit.json``, if it exists. `forced` is the text of the warning not to order, from
    the first process; empty without errors. With it, the checks need not run again.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this process
    contents = Contents(Design(spec), policy, baseline, measured)
    contents.__dict__["forced"] = forced
    for stage, numbers in parts:
        try:
            sent.send(_render_part(contents, stage, numbers, {}, {}))
        except Exception as error:
            sent.send(error)
            return


def _stage_inputs(
    contents: Contents, stage: str, numbers: bool, entries: dict[str, Entry], failures: list[str]
) -> tuple[object, ...]:
    """Return the inputs of a stage's files, or with `numbers` of its files with computed numbers.

    The code of sitscad is not included.

    `entries` are the files made so far, and `failures` the messages about files that could not be written.
    """
    source = contents.design.spec.source
    baseline = baseline_findings(contents.baseline, source.path, contents.spec.name)
    judged_by = (json.dumps(contents.policy.as_json()), baseline)
    text = (contents.spec, source.text, contents.file_name, judged_by, contents.measured)
    if stage == CHECK_STAGE:
        read = {name: sha256(content) for name, content in source.files_to_store.items()}
        sensing_sum = entries[PERFORMANCE_FILE].sha256 if PERFORMANCE_FILE in entries else None
        return (*text, read, failures, any(name.startswith("fpc/") for name in entries), sensing_sum)
    if stage == "report":
        return (*text, {name: entry.sha256 for name, entry in entries.items()})
    kernels = {package: version_of(package) for package in KERNELS} if stage in SOLID_STAGES else {}
    if stage == "mesh":
        return *board_inputs(stage, contents.layout), kernels
    if stage == "kicad":
        return spec_inputs(stage, contents.spec)
    forced = contents.is_forced  # papers carry the mark of a forced package
    if stage in BESIDE_TAIL:
        return *board_inputs(stage, contents.layout), kernels, forced
    if stage in SOLID_STAGES:
        return *spec_inputs(stage, contents.spec, numbers), kernels, forced, numbers
    if stage == "datasheet":
        return *spec_inputs(stage, contents.spec), forced, version_of("matplotlib")
    if stage == "gerber":
        return contents.spec, contents.forced
    return *spec_inputs(stage, contents.spec), forced


def _render_part(
    contents: Contents, stage: str, numbers: bool, beside: dict[str, bytes], before: dict[str, bytes],
    there: frozenset[str] = frozenset(),
) -> PartFiles:
    """Return the files of one part of the build.

    `beside` are files of the stage that exist already, and `before` are the files of all stages. `there` are the stages
    that the package will have.
    """
    parted = (stage, True) in PARTS
    writers = [writer for writer in (*WRITERS, *PAPERS, *added_writers())
               if writer.stage == stage and (not parted or writer.reads_numbers == numbers)]
    failures, theirs = list[str](), dict[str, str]()
    try:
        new = _written_files(contents, writers, beside, Package(before, there), failures, theirs)
    except MissingExtra as error:
        rest = ",".join(name for name in STAGES if name not in EXTRA_STAGES)
        raise MissingExtra(f"{error}; or make all other parts with --only {rest}", name=error.name) from error
    if stage == "calibration":
        new |= _require_free_names(stage, new, nominal_calibration(contents.design.bare, contents.is_forced), theirs)
    if stage == "report":
        files = before | new
        failing = fit_picture_file(contents, SOLIDS_PICTURE if SOLIDS_PICTURE in files else "")
        pages = {"report.html": report_page(contents, files | failing), **_live_page_file(contents, files), **failing}
        new |= _require_free_names(stage, new, pages, theirs)
    return PartFiles(new, failures, theirs)


def _written_files(
    contents: Contents, writers: list[Writer], beside: dict[str, bytes], package: Package, failures: list[str],
    theirs: dict[str, str],
) -> dict[str, bytes]:
    """Return the files of some writers, by name.

    `beside` are files of the stage that exist already. A file that cannot be written stops a build. With `force`, the
    build continues, and a message is added to `failures`. `theirs` receives the names of files of plugins.
    """
    new: dict[str, bytes] = {}
    for writer in writers:
        is_left_out = writer.is_of_board and contents.spec.coil.copper is not None
        if is_left_out or not writer.applies(contents.spec):
            continue
        try:
            inputs = {"files": beside | new, "package": package}
            values = (inputs[name] if name in inputs else contents.value(name) for name in writer.takes)
            files = writer.render(*values)
        except ValueError as error:
            if not contents.is_forced:
                raise PackageError(f"{writer.name} cannot be written: {error}; nothing was changed") from error
            failures.append(f"{writer.name}: {error}")
            continue
        new |= _require_free_names(writer.maker, new, files, theirs)
        theirs |= {name.lower(): writer.maker for name in files if writer.function is not None}
    return new


def _require_free_names(
    maker: str, before: dict[str, bytes], new: dict[str, bytes], theirs: Mapping[str, str]
) -> dict[str, bytes]:
    """Return the new files if their names are allowed and differ from existing names, ignoring case.

    `maker` makes the new files, and `before` are existing files. If a plugin has used a name of sitscad's files, the
    error reports the plugin. Raises PackageError.
    """
    names = {name.lower() for name in (*before, MANIFEST)}
    for name in new:
        if not FILE_NAME.fullmatch(name):
            raise PackageError(f"{maker} would write {name!r}, which is not a file name that a package may hold")
        if name.lower() in names:
            first = theirs.get(name.lower())
            whose = "which is there already" if first is None else f"which is a file of sitscad's ({maker})"
            raise PackageError(f"{first or maker} would write {name}, {whose}; nothing was changed")
    return new


def _checked_files(contents: Contents, failures: list[str], earlier: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return findings and estimates as JSON files, the spec's files, and the warning file of a package with errors.

    `failures` are messages about files that could not be written, and `earlier` are the package's other files. If there
    are Gerber files, a copy of the warning lies beside them.
    """
    checked = dataclasses.replace(contents.checked, path=contents.file_name)
    sensing = {name: value for name, value in _sensing_data(earlier).items() if name in ("performance", "cells")}
    files = {
        "findings.json": as_json([checked]).encode("ascii"),
        "estimate.json": to_json(contents.estimates.as_json(contents.file_name) | sensing).encode("ascii"),
    }
    files |= _spec_files(contents)
    if not checked.is_orderable:
        note = contents.forced_note(failures).encode("utf-8")
        beside_gerbers = any(name.startswith("fpc/") for name in earlier)
        files |= {FORCED_NOTE: note} | ({f"fpc/{FORCED_NOTE}": note} if beside_gerbers else {})
    return files


def _sensing_data(files: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the sensing performance from the data sheet among `files`. Empty if there is no data sheet."""
    performance: dict[str, Any] = json.loads(files[PERFORMANCE_FILE]) if PERFORMANCE_FILE in files else {}
    return performance


def _spec_files(contents: Contents) -> dict[str, bytes]:
    """Return the input files of the package, unchanged.

    The spec keeps its name, or becomes ``spec.yaml`` if its name is not allowed in a package. Profiles lie at the paths
    that the spec gives, so that the folder can be built again.
    """
    files, file_name = contents.design.spec.source.files_to_store, contents.file_name
    names = {}
    for name in files:
        # Characters that a package may not hold are written as _
        parts = (re.sub(r"^[.\s]|[^\w .+-]|\s$", "_", part) or "_" for part in name.split("/"))
        names[name] = name if FILE_NAME.fullmatch(name) else "/".join(parts)
    if not FILE_NAME.fullmatch(file_name):
        names[file_name] = UNNAMED
    return {f"{SPEC_FOLDER}/{names[name]}": content for name, content in sorted(files.items())}


def _live_page_file(contents: Contents, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return ``live.html``, which shows forces from a connected sensor. Empty if the package has no firmware driver."""
    if "firmware/sensor_line.h" not in files:
        return {}
    # Documents of all maps in the package: one, or one per cell
    names = [name for name in files if re.fullmatch(r"calibration/(cell-\d+/)?calibration\.json", name)]
    maps = [json.loads(files[name]) for name in sorted(names, key=lambda name: (len(name), name))]
    return {"live.html": live_page(contents.spec, contents.estimates, maps, forced=contents.is_forced)}


def report_page(contents: Contents, files: Mapping[str, bytes], is_built: bool = True) -> bytes:
    """Return the report on a design, with data and pictures from the files of its package.

    `is_built` is False for a design in watch mode, whose package is not written.
    """
    design, sensing = contents.design, _sensing_data(files)
    pictures = _report_pictures(contents, files)
    sizes = {name: len(content) for name, content in files.items()}
    page = render(
        contents.checked, design.spec, contents.estimates, pictures, sizes, contact_rows(contents.layout), sensing,
        incoming_tests(design).board, _view_data(contents, files, sensing), is_built,
    )
    return page.encode("utf-8")


def _view_data(contents: Contents, files: Mapping[str, bytes], sensing: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the data of the report's interactive views. Views whose files are missing in the package are left out."""
    views = {}
    if "mount/assembly.glb" in files:
        views["solids"] = solids_document(files["mount/assembly.glb"], contents.layout.spec.jaw,
                                          hinge_pivot(contents.layout))
    design, has_cells = contents.design.bare, contents.spec.cells is not None
    text = files.get(f"calibration/{f'cell-{design.cells.weakest_number}/' if has_cells else ''}calibration.json")
    calibration = None if text is None else json.loads(text)
    weakest = design.cells.weakest
    conversion = weakest.estimates.readout.conversion
    if (pushed := pushed_document(weakest.layout, conversion, sensing, calibration)) is not None:
        views["pushed"] = pushed
        if has_cells:
            cells = cells_for_page(design.spec, design.estimates, design.cells.skin.crosstalk)
            views["pushed"] = pushed | {"cells": cells}
    return views


def fit_picture_file(contents: Contents, bodies: str) -> dict[str, bytes]:
    """Return ``fit.svg``, a drawing of the parts that do not fit. Empty if all parts fit.

    `bodies` is the name of a picture of the solids to which the drawing refers.
    """
    faults = [f for f in contents.checked.findings if f.severity.is_at_least(Severity.WARNING)]
    sheet = fit.fit_sheet(contents.layout, faults, contents.is_forced, bodies)
    return {} if sheet is None else {FIT_PICTURE: svg(sheet).encode("utf-8")}


def _report_pictures(contents: Contents, files: Mapping[str, bytes]) -> dict[str, str]:
    """Return the drawings for the report by caption. Drawings of solids are included if the package has them."""
    layout = contents.layout
    marks = [
        PicturePoint(finding.place.x, finding.place.y, str(number), finding.severity.value)
        for number, finding in numbered_places(contents.checked.findings)
        if finding.place is not None
    ]
    has_jaw = contents.spec.mount is not None and contents.spec.mount.jaw is not None
    body = "The part that lies on the jaw" if has_jaw else "The part with the coils"
    layers = stackup_drawing.stackup_sheet(layout, "see the package", contents.is_forced)
    wrong = {
        "What does not fit: too much in red, limits in black.": FIT_PICTURE,
        f"What does not fit, cut open ({SOLIDS_PICTURE}).": SOLIDS_PICTURE,
    }
    pictures = {caption: files[name].decode("utf-8") for caption, name in wrong.items() if name in files} | {
        f"{body}, seen from the top, to scale; lower copper shows as narrow lines.": layout_svg(
            layout, None, layout.body, marks, "body"
        ),
        "The whole board, to scale.": layout_svg(layout, None, None, marks),
        "The board's layers; heights to scale, lengths not.": svg(layers),
    }
    if (jaws := _jaw_drawing(contents)) is not None:
        pictures["The closed pair in its port, with dimensions, and the jaws closed and open."] = jaws
    if (over := plan_view.plan_sheet(layout, contents.is_forced)) is not None:
        pictures["Elastomer and target over the coils, seen from the top, to scale."] = svg(over)
    solids = (name for name in sorted(files) if name == "mount/assembly.svg")  # the jaw drawing is shown above
    return pictures | {f"The sensor in its mount ({name}).": files[name].decode("utf-8") for name in solids}


def _jaw_drawing(contents: Contents) -> str | None:
    """Return the drawing of the jaws as SVG.

    None if there is no jaw, or if the dimensions of parts contradict each other.
    """
    try:
        sheet = jaw.jaw_sheet(contents.layout, contents.is_forced)
    except PartsError:
        return None
    return None if sheet is None else svg(sheet)
