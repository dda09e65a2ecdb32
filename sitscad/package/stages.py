"""What `build` does: check, make every stage that is wanted and not there already, replace the package as a whole."""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sitscad.finding import Severity
from sitscad.formats import WRITERS
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
    without_text,
)
from sitscad.papers import PAPERS
from sitscad.parts import MissingExtra
from sitscad.record import record
from sitscad.report.findings import CheckedSpec, as_json, checked_spec, numbered_places, to_json
from sitscad.spec.sensor import SensorSpec
from sitscad.writer import Writer

if TYPE_CHECKING:
    from sitscad.checks import CheckResult
    from sitscad.estimates import Estimates
    from sitscad.layout.board import Layout
    from sitscad.layout.panel import Panel

STAGES = ("gerber", "kicad", "laser", "mount", "mesh", "firmware", "report")
"""What `--only` takes, in the order of making; the report comes last, because it lists the other files."""

CHECK_STAGE = "check"
"""The stage of what every build writes: its checks always run."""

SOLID_STAGES = ("mount", "mesh")
"""The stages that need the packages of the extra."""

KERNELS = ("build123d", "cadquery", "cadquery-ocp", "gmsh", "manifold3d", "trimesh")
"""Packages whose version can change the bytes of solids and meshes."""

FORCED_NOTE = "FORCED.txt"

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
        return self.written and not self.checked.ok


def build(
    spec: SensorSpec,
    out: str | Path = "outputs",
    only: Iterable[str] | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> BuildResult:
    """Check a spec and write its package into ``out/NAME``, as a whole or not at all.

    `only` names stages (see STAGES); the parts of an existing package that are still true to the spec stay, stale ones
    go. `force` builds in spite of errors and marks the package. A part that would come out the same is not made again.

    Raises
    ------
    PackageError
        when the folder cannot be written, is being written, or holds something else.
    MissingExtra
        when a stage needs a package that is not installed; the text says which stages do without.
    """
    name = require_package_name(spec.name)
    wanted = _require_stages(only)
    report = progress or (lambda *_: None)
    design = Design(spec)
    directory = Path(out) / name
    report(CHECK_STAGE, "start", 0.0)
    began = time.perf_counter()
    report(CHECK_STAGE, "made" if design.checked.ok or force else "stopped", time.perf_counter() - began)
    if not design.checked.ok and not force:
        return BuildResult(directory, design.checked, written=False)
    with opened_for_building(directory.parent, name) as staged:
        old = _require_ours(directory)
        stages, files, entries = _make_all(design, directory, old, wanted, report)
        manifest = Manifest(spec=design.origin, forced=not design.checked.ok, nets=design.nets, files=entries)
        if manifest == old and not foreign_files(directory, old):
            return BuildResult(directory, design.checked, True, stages)
        write_files(staged, files)
        write_files(staged, {MANIFEST: manifest.as_bytes()})
        kept_aside = set_aside(directory, foreign_files(directory, old) if directory.exists() else [])
        put_in_place(staged, directory)
    return BuildResult(directory, design.checked, True, stages, kept_aside)


def require_distinct_names(specs: Sequence[SensorSpec]) -> None:
    """Raise `PackageError` when two specs would be built into the same folder."""
    seen: dict[str, str] = {}
    for spec in specs:
        if spec.name in seen:
            raise PackageError(f"{seen[spec.name]} and {spec.source.path} both have the name {spec.name!r}; rename one")
        seen[spec.name] = spec.source.path


@record
class Design:
    """A spec and what follows from it, each thing computed when it is first asked for.

    What the writers see is the spec without its text, so that what is drawn depends on the values alone; only findings
    and report know the file that they came from.
    """

    spec: SensorSpec

    @cached_property
    def bare(self) -> SensorSpec:
        """The spec's values without its text."""
        return without_text(self.spec)

    @cached_property
    def layout(self) -> Layout:
        """The layout of the bare spec."""
        from sitscad.layout import lay_out

        return lay_out(self.bare)

    @cached_property
    def estimates(self) -> Estimates:
        """The electrical estimate."""
        from sitscad.estimates import estimate

        return estimate(self.layout)

    @cached_property
    def panel(self) -> Panel | None:
        """The panel in which the boards are ordered; None where they are ordered singly."""
        from sitscad.layout.panel import plan

        return plan(self.layout)

    @cached_property
    def coupon_estimates(self) -> Estimates | None:
        """The electrical estimate of the panel's coupon, which lies in free air; None where there is no coupon."""
        from sitscad.estimates import estimate

        if self.panel is None or self.panel.coupon is None:
            return None
        return estimate(self.panel.coupon, temperature=20.0)  # it is measured on the bench

    @cached_property
    def forced(self) -> str:
        """Why the package ought not to be ordered from; empty where all checks pass."""
        return "" if self.checked.ok else _forced_note(self, [])

    @cached_property
    def nets(self) -> dict[str, tuple[str, ...]]:
        """The pins that every net of the layout joins."""
        pads = self.layout.all_pads
        return {net: tuple(sorted(pad.pin for pad in pads if pad.net == net)) for net in self.layout.nets}

    @cached_property
    def solids(self) -> tuple[Any, ...]:
        """The solids; importing a CAD kernel."""
        from sitscad.parts import solids

        return solids(self.layout)

    @cached_property
    def result(self) -> CheckResult:
        """The outcome of the checks."""
        from sitscad.checks import check

        return check(self.spec, dataclasses.replace(self.layout, spec=self.spec), self.estimates)

    @cached_property
    def checked(self) -> CheckedSpec:
        """The findings, each with its place in the spec's text."""
        return checked_spec(self.spec, self.result.findings, self.result.not_checked, self.result.signals)

    @cached_property
    def file_name(self) -> str:
        """The spec's file name without its folder."""
        return Path(self.spec.source.path).name

    @cached_property
    def origin(self) -> dict[str, str]:
        """What the manifest says of the spec."""
        return {"name": self.spec.name, "file": self.file_name, "sha256": self.spec.source.sha256}

    def value(self, name: str) -> object:
        """One of the arguments that a writer may take."""
        return self.bare if name == "spec" else getattr(self, name)


Made = tuple[tuple[StageResult, ...], dict[str, bytes], dict[str, Entry]]


def _make_all(design: Design, directory: Path, old: Manifest, wanted: frozenset[str], progress: Progress) -> Made:
    """The stages' outcomes, every file's bytes, and every file's manifest entry."""
    results: list[StageResult] = []
    files: dict[str, bytes] = {}
    entries: dict[str, Entry] = {}
    failures: list[str] = []
    for stage in (*STAGES[:-1], CHECK_STAGE, STAGES[-1]):
        began = time.perf_counter()
        if stage != CHECK_STAGE:
            progress(stage, "start", 0.0)
        ingredients = made_from(stage, *_ingredients(design, stage, entries, failures))
        kept = _still_true(directory, old, stage, ingredients)
        if kept is not None:
            outcome, new = "kept", kept
        elif stage in wanted:
            new = _distinct(stage, files, _render(design, stage, files, failures))
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


def _ingredients(design: Design, stage: str, entries: dict[str, Entry], failures: list[str]) -> tuple[object, ...]:
    """Everything that the files of a stage depend on, besides sitscad itself."""
    text = (design.bare, design.spec.source.text, design.file_name)
    if stage == CHECK_STAGE:
        read = {name: sha256(content) for name, content in design.spec.source.files.items()}
        return (*text, read, failures, any(name.startswith("fpc/") for name in entries))
    if stage == "report":
        return (*text, {name: entry.sha256 for name, entry in entries.items()})
    if stage in SOLID_STAGES:
        return design.bare, {package: _version_of(package) for package in KERNELS}
    if stage == "gerber":
        return design.bare, design.forced
    return (design.bare,)


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


def _render(design: Design, stage: str, files: dict[str, bytes], failures: list[str]) -> dict[str, bytes]:
    if stage == CHECK_STAGE:
        return _checked_files(design, failures, beside_gerbers=any(name.startswith("fpc/") for name in files))
    try:
        new = _written(design, [writer for writer in (*WRITERS, *PAPERS) if writer.stage == stage], failures)
    except MissingExtra as error:
        rest = ",".join(name for name in STAGES if name not in SOLID_STAGES)
        raise MissingExtra(f"{error}; or make all other parts with --only {rest}", name=error.name) from error
    if stage == "report":
        new |= _report(design, files | new)
    return new


def _written(design: Design, writers: list[Writer], failures: list[str]) -> dict[str, bytes]:
    """The files of some writers. What cannot be written stops a build; a forced one goes on and says so in its note."""
    new: dict[str, bytes] = {}
    for writer in writers:
        if not writer.applies(design.bare):
            continue
        try:
            made = writer.render(*(new if name == "files" else design.value(name) for name in writer.takes))
        except ValueError as error:
            if design.checked.ok:
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


def _checked_files(design: Design, failures: list[str], beside_gerbers: bool) -> dict[str, bytes]:
    """Findings and estimate as JSON, and the note of a forced package, also beside what goes to a fabricator."""
    checked = dataclasses.replace(design.checked, path=design.file_name)
    files = {
        "findings.json": as_json([checked]).encode("ascii"),
        "estimate.json": to_json(design.estimates.as_json(design.file_name)).encode("ascii"),
    }
    files |= _spec_files(design)
    if not checked.ok:
        note = _forced_note(design, failures).encode("utf-8")
        files |= {FORCED_NOTE: note} | ({f"fpc/{FORCED_NOTE}": note} if beside_gerbers else {})
    return files


def _spec_files(design: Design) -> dict[str, bytes]:
    """What the package was made from, byte by byte: the spec under its own name (``spec.yaml`` where it has none that a
    package may hold), and the profiles that it names where it looks for them, so that the folder builds the same again.
    """
    source, own = design.spec.source, design.file_name
    files = source.files if own in source.files else {own: source.text.encode("utf-8")}
    names = {name: _kept_name(name) for name in files} | ({} if FILE_NAME.fullmatch(own) else {own: "spec.yaml"})
    return {f"{SPEC_FOLDER}/{names[name]}": content for name, content in sorted(files.items())}


def _kept_name(name: str) -> str:
    """A file's name as a package may hold it: letters that it may not hold are written as ``_``."""
    if FILE_NAME.fullmatch(name):
        return name
    return "/".join(re.sub(r"^[.\s]|[^\w .+-]|\s$", "_", part) or "_" for part in name.split("/"))


def _forced_note(design: Design, failures: list[str]) -> str:
    errors = [finding for finding in design.result.findings if finding.severity == Severity.ERROR]
    count = f"{len(errors)} error{'' if len(errors) == 1 else 's'}"
    lines = [
        f"The package {design.spec.name} was built with --force in spite of {count}.",
        "It is known not to meet its own checks. Do not order from it unless you know why:",
        "",
    ]
    lines += [f"- {finding.rule} {finding.name}: {finding.message}" for finding in errors]
    if failures:
        lines += ["", "Left out, because it cannot be written:", "", *(f"- {failure}" for failure in failures)]
    return "\n".join([*lines, ""])


def _report(design: Design, files: dict[str, bytes]) -> dict[str, bytes]:
    """The page for a person; its pictures are handed in, because a report must not depend on writers."""
    from sitscad.layout.contacts import contacts
    from sitscad.report.page import render

    sizes = {name: len(content) for name, content in files.items()}
    wiring = contacts(design.layout)
    page = render(design.checked, design.spec, design.estimates, _pictures(design, files), sizes, wiring)
    return {"report.html": page.encode("utf-8")}


def _pictures(design: Design, files: dict[str, bytes]) -> dict[str, str]:
    """Drawings for the report by their captions; those of the solids only where the package has them."""
    from sitscad.drawing.board_picture import Mark, picture
    from sitscad.papers.drawings import assembly as assembly_drawing
    from sitscad.papers.drawings import stackup as stackup_drawing

    layout = design.layout
    marks = [
        Mark(finding.place.x, finding.place.y, str(number), finding.severity.value)
        for number, finding in numbered_places(design.checked.findings)
        if finding.place is not None
    ]
    has_jaw = design.spec.mount is not None and design.spec.mount.jaw is not None
    body = "The part that lies on the jaw" if has_jaw else "The part with the coils"
    layers = stackup_drawing.drawing(layout, "see the package", not design.checked.ok)
    drawn = {
        f"{body}, seen from the top, to scale; upper layers hide lower ones.": picture(
            layout, None, layout.body, marks
        ),
        "The whole board, to scale.": picture(layout, None, None, marks),
        "The board's layers; heights to scale, lengths not.": layers.svg(),
    }
    if (over := assembly_drawing.drawing(layout, not design.checked.ok)) is not None:
        drawn["Elastomer and target over the coils, seen from the top, to scale."] = over.svg()
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
