"""What `build` does: check, make every stage that is wanted and not there already, replace the package as a whole."""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from sitscad.design import Design
from sitscad.formats import WRITERS
from sitscad.package.contents import FORCED_NOTE, Contents
from sitscad.package.folder import (
    FILE_NAME,
    PackageError,
    explained,
    opened_for_building,
    put_in_place,
    require_inside,
    require_package_name,
    set_aside,
    write_files,
)
from sitscad.package.manifest import (
    MANIFEST,
    Entry,
    Manifest,
    foreign_files,
    intact,
    made_from,
    read_manifest,
    sha256,
)
from sitscad.papers import PAPERS
from sitscad.parts import MissingExtra
from sitscad.policy import Baseline, Policy
from sitscad.record import record
from sitscad.report.findings import CheckedSpec, as_json, numbered_places, to_json
from sitscad.review import Review
from sitscad.spec.sensor import SensorSpec
from sitscad.writer import Writer

STAGES = ("gerber", "kicad", "laser", "mount", "mesh", "firmware", "report")
"""What `--only` takes, in the order of making; the report comes last, because it lists the other files."""

CHECK_STAGE = "check"
"""The stage of what every build writes: its checks always run."""

SOLID_STAGES = ("mount", "mesh")
"""The stages that need the packages of the extra."""

KERNELS = ("build123d", "cadquery", "cadquery-ocp", "gmsh", "manifold3d", "trimesh")
"""Packages whose version can change the bytes of solids and meshes."""

SPEC_FOLDER = "spec"
"""Where a package keeps the files that it was made from."""

Progress = Callable[[str, str, float], None]
"""Called with a stage, what happens (``start``; ``made``, ``kept``, ``dropped``, ``none``, ``stopped``), seconds."""


@record
class StageResult:
    """What became of a stage: ``made``, ``kept`` from the package before, ``dropped``, ``none`` (nothing to make)."""

    name: str
    outcome: str
    files: int
    seconds: float


@record
class BuildResult:
    """The outcome of a build. Without ``written`` the errors in ``checked`` stopped it and nothing was touched."""

    directory: Path
    checked: CheckedSpec
    written: bool
    stages: tuple[StageResult, ...] = ()
    kept_aside: Path | None = None

    @property
    def forced(self) -> bool:
        """Whether the package was written in spite of errors."""
        return self.written and not self.checked.is_orderable


def build(
    spec: SensorSpec | Design,
    out: str | Path = "outputs",
    only: Iterable[str] | None = None,
    force: bool = False,
    progress: Progress | None = None,
    policy: Policy | None = None,
    baseline: Baseline | None = None,
) -> BuildResult:
    """Check a spec and write its package into ``out/NAME``, as a whole or not at all.

    `only` names stages (see STAGES); the parts of an existing package that are still true to the spec stay, stale ones
    go. `force` builds in spite of errors and marks the package. A part that would come out the same is not made again.
    `policy` and `baseline` are held against the findings, and so are the comments in the spec; errors of the electrical
    rules that they silence stop nothing, but mark the package as `force` does.

    Raises
    ------
    PackageError
        when the folder cannot be written, is being written, or holds something else.
    MissingExtra
        when a stage needs a package that is not installed; the text says which stages do without.
    """
    name = require_package_name((spec.spec if isinstance(spec, Design) else spec).name)
    wanted = _require_stages(only)
    report = progress or (lambda *_: None)
    design = spec if isinstance(spec, Design) else Design(spec)
    contents = Contents(design, Review(design), policy or Policy(), baseline)
    directory = Path(out) / name
    report(CHECK_STAGE, "start", 0.0)
    began = time.perf_counter()
    report(CHECK_STAGE, "made" if contents.checked.ok or force else "stopped", time.perf_counter() - began)
    if not contents.checked.ok and not force:
        return BuildResult(directory, contents.checked, written=False)
    with opened_for_building(directory.parent, name) as staged:
        old = _require_ours(directory)
        stages, files, entries = _make_all(contents, directory, old, wanted, report)
        manifest = Manifest(
            spec=contents.origin,
            forced=not contents.checked.is_orderable,
            nets=contents.nets,
            files=entries,
            configuration=contents.policy.as_json() if contents.policy.says_anything else {},
        )
        if manifest == old and not foreign_files(directory, old):
            return BuildResult(directory, contents.checked, True, stages)
        write_files(staged, files)
        write_files(staged, {MANIFEST: manifest.as_bytes()})
        kept_aside = set_aside(directory, foreign_files(directory, old) if directory.exists() else [])
        put_in_place(staged, directory)
    return BuildResult(directory, contents.checked, True, stages, kept_aside)


def require_distinct_names(specs: Sequence[SensorSpec]) -> None:
    """Raise `PackageError` when two specs would be built into the same folder."""
    seen: dict[str, str] = {}
    for spec in specs:
        if spec.name in seen:
            raise PackageError(f"{seen[spec.name]} and {spec.source.path} both have the name {spec.name!r}; rename one")
        seen[spec.name] = spec.source.path


Made = tuple[tuple[StageResult, ...], dict[str, bytes], dict[str, Entry]]


def _make_all(contents: Contents, directory: Path, old: Manifest, wanted: frozenset[str], progress: Progress) -> Made:
    """The stages' outcomes, every file's bytes, and every file's manifest entry."""
    results: list[StageResult] = []
    files: dict[str, bytes] = {}
    entries: dict[str, Entry] = {}
    failures: list[str] = []
    for stage in (*STAGES[:-1], CHECK_STAGE, STAGES[-1]):
        began = time.perf_counter()
        if stage != CHECK_STAGE:
            progress(stage, "start", 0.0)
        ingredients = made_from(stage, *_ingredients(contents, stage, entries, failures))
        kept = _still_true(directory, old, stage, ingredients)
        if kept is not None:
            outcome, new = "kept", kept
        elif stage in wanted:
            new = _distinct(stage, files, _render(contents, stage, files, failures))
            outcome = "made" if new else "none"
        else:
            outcome, new = ("dropped" if old.of_stage(stage) else "none"), {}
        files |= new
        entries |= {name: Entry(sha256(content), stage, ingredients) for name, content in new.items()}
        seconds = time.perf_counter() - began
        if stage != CHECK_STAGE:
            progress(stage, outcome, seconds)
        results.append(StageResult(stage, outcome, len(new), seconds))
    return tuple(results), files, entries


def _ingredients(contents: Contents, stage: str, entries: dict[str, Entry], failures: list[str]) -> tuple[object, ...]:
    """Everything that the files of a stage depend on, besides sitscad itself."""
    judged_by = (contents.policy.as_json(), contents.baseline_entries)
    text = (contents.spec, contents.design.spec.source.text, contents.file_name, judged_by)
    if stage == CHECK_STAGE:
        read = {name: sha256(content) for name, content in contents.design.spec.source.files.items()}
        return (*text, read, failures, any(name.startswith("fpc/") for name in entries))
    if stage == "report":
        return (*text, {name: entry.sha256 for name, entry in entries.items()})
    if stage in SOLID_STAGES:
        return contents.spec, {package: _version_of(package) for package in KERNELS}
    if stage == "gerber":
        return contents.spec, contents.forced
    return (contents.spec,)


def _version_of(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version  # slow to import, and only solids ask

    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _still_true(directory: Path, old: Manifest, stage: str, ingredients: str) -> dict[str, bytes] | None:
    """The files of a stage as the package before has them, if they are whole and were made from the same; else None."""
    entries = old.of_stage(stage)
    if not entries or any(entry.made_from != ingredients for entry in entries.values()):
        return None
    return intact(directory, entries)


def _render(contents: Contents, stage: str, files: dict[str, bytes], failures: list[str]) -> dict[str, bytes]:
    if stage == CHECK_STAGE:
        return _checked_files(contents, failures, beside_gerbers=any(name.startswith("fpc/") for name in files))
    try:
        new = _written(contents, [writer for writer in (*WRITERS, *PAPERS) if writer.stage == stage], failures)
    except MissingExtra as error:
        rest = ",".join(name for name in STAGES if name not in SOLID_STAGES)
        raise MissingExtra(f"{error}; or make all other parts with --only {rest}", name=error.name) from error
    if stage == "report":
        new |= _report(contents, files | new)
    return new


def _written(contents: Contents, writers: list[Writer], failures: list[str]) -> dict[str, bytes]:
    """The files of some writers. What cannot be written stops a build; a forced one goes on and says so in its note."""
    new: dict[str, bytes] = {}
    for writer in writers:
        if not writer.applies(contents.spec):
            continue
        try:
            made = writer.render(*(new if name == "files" else contents.value(name) for name in writer.takes))
        except ValueError as error:
            if contents.checked.is_orderable:
                raise PackageError(f"{writer.name} cannot be written: {error}; nothing was changed") from error
            failures.append(f"{writer.name}: {error}")
            continue
        new |= _distinct(writer.name, new, made)
    return new


def _distinct(maker: str, before: dict[str, bytes], new: dict[str, bytes]) -> dict[str, bytes]:
    """The new files, once their names are known to be safe and none to be taken, whatever the case of letters."""
    taken = {name.lower() for name in (*before, MANIFEST)}
    for name in new:
        if require_inside(name).lower() in taken:
            raise PackageError(f"{maker} would write {name}, which is there already")
    return new


def _checked_files(contents: Contents, failures: list[str], beside_gerbers: bool) -> dict[str, bytes]:
    """Findings and estimate as JSON, and the note of a forced package, also beside what goes to a fabricator."""
    checked = dataclasses.replace(contents.checked, path=contents.file_name)
    files = {
        "findings.json": as_json([checked]).encode("ascii"),
        "estimate.json": to_json(contents.estimates.as_json(contents.file_name)).encode("ascii"),
    }
    files |= _spec_files(contents)
    if not checked.is_orderable:
        note = contents.forced_note(failures).encode("utf-8")
        files |= {FORCED_NOTE: note} | ({f"fpc/{FORCED_NOTE}": note} if beside_gerbers else {})
    return files


def _spec_files(contents: Contents) -> dict[str, bytes]:
    """What the package was made from, byte by byte: the spec under its own name (``spec.yaml`` where it has none that a
    package may hold), and the profiles that it names where it looks for them, so that the folder builds the same again.
    """
    source, own = contents.design.spec.source, contents.file_name
    files = source.files if own in source.files else {own: source.text.encode("utf-8")}
    names = {name: _kept_name(name) for name in files} | ({} if FILE_NAME.fullmatch(own) else {own: "spec.yaml"})
    return {f"{SPEC_FOLDER}/{names[name]}": content for name, content in sorted(files.items())}


def _kept_name(name: str) -> str:
    """A file's name as a package may hold it: letters that it may not hold are written as ``_``."""
    if FILE_NAME.fullmatch(name):
        return name
    return "/".join(re.sub(r"^[.\s]|[^\w .+-]|\s$", "_", part) or "_" for part in name.split("/"))


def _report(contents: Contents, files: dict[str, bytes]) -> dict[str, bytes]:
    """The page for a person; its pictures are handed in, because a report must not depend on writers."""
    from sitscad.layout.tail.contacts import contacts
    from sitscad.report.page import render

    sizes = {name: len(content) for name, content in files.items()}
    wiring = contacts(contents.layout)
    page = render(contents.checked, contents.design.spec, contents.estimates, _pictures(contents, files), sizes, wiring)
    return {"report.html": page.encode("utf-8")}


def _pictures(contents: Contents, files: dict[str, bytes]) -> dict[str, str]:
    """Drawings for the report by their captions; those of the solids only where the package has them."""
    from sitscad.drawing.board_picture import Mark, picture
    from sitscad.drawing.svg import svg
    from sitscad.papers.drawings import assembly as assembly_drawing
    from sitscad.papers.drawings import stackup as stackup_drawing

    layout = contents.layout
    marks = [
        Mark(finding.place.x, finding.place.y, str(number), finding.severity.value)
        for number, finding in numbered_places(contents.checked.findings)
        if finding.place is not None
    ]
    has_jaw = contents.spec.mount is not None and contents.spec.mount.jaw is not None
    body = "The part that lies on the jaw" if has_jaw else "The part with the coils"
    layers = stackup_drawing.drawing(layout, "see the package", not contents.checked.is_orderable)
    drawn = {
        f"{body}, seen from the top, to scale; upper layers hide lower ones.": picture(
            layout, None, layout.body, marks, "body"
        ),
        "The whole board, to scale.": picture(layout, None, None, marks),
        "The board's layers; heights to scale, lengths not.": svg(layers),
    }
    if (over := assembly_drawing.drawing(layout, not contents.checked.is_orderable)) is not None:
        drawn["Elastomer and target over the coils, seen from the top, to scale."] = svg(over)
    solids = (name for name in sorted(files) if name.startswith("mount/") and name.endswith(".svg"))
    return drawn | {f"The sensor in its mount ({name}).": files[name].decode("utf-8") for name in solids}


def _require_stages(only: Iterable[str] | None) -> frozenset[str]:
    wanted = frozenset(STAGES if only is None else only)
    unknown = sorted(wanted - set(STAGES))
    if unknown or not wanted:
        raise PackageError(f"{', '.join(unknown) or 'nothing'} is not a stage; there are: {', '.join(STAGES)}")
    return wanted | {CHECK_STAGE}


def _require_ours(directory: Path) -> Manifest:
    """The manifest of what stands in the target's place: empty where nothing does, or where a manifest is damaged.

    A folder without a manifest was not made by sitscad and is never replaced.
    """
    with explained(f"cannot look at {directory}"):
        if directory.is_symlink() or (directory.exists() and not directory.is_dir()):
            raise PackageError(f"{directory} is not a folder; it was not touched")
        if not directory.exists() or not any(directory.iterdir()):
            return Manifest()
        if not (directory / MANIFEST).is_file():
            raise PackageError(f"{directory} has no {MANIFEST}, so sitscad did not make it; it was not touched")
    try:
        return read_manifest(directory)
    except PackageError:
        return Manifest()
