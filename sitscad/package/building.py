"""Build of a package, and comparison of an existing package with its spec.

If nothing has changed, only this module is loaded. The code that checks and draws is in `stages`, and is loaded when
files must be made.

The folder is replaced as a whole or not at all, by one build at a time. A build writes into a staging folder (a
temporary folder beside the package) and exchanges the two. It then deletes from the old package only the files that
match its manifest. All other files are moved and never copied. Pipes, unreadable files and files that appeared during
the build are therefore not lost.
"""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import errno
import json
import os
import re
import secrets
import shutil
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Severity
from sitscad.basics.late import late
from sitscad.basics.record import record
from sitscad.basics.units import count_text, escape_controls
from sitscad.checks.findings.document import CheckedSpec, read_findings
from sitscad.checks.policy import Baseline, Policy, baseline_findings
from sitscad.files.writer import STAGES, is_felt, marks
from sitscad.package.folder import (
    PackageError,
    list_files,
    raising_package_errors,
    require_package_name,
    write_files,
)
from sitscad.package.manifest import (
    CHECK_STAGE,
    KERNELS,
    MANIFEST,
    SOLID_STAGES,
    BuildResult,
    Manifest,
    Progress,
    StageResult,
    figure_files,
    foreign_files,
    hash_inputs,
    is_left_by_kicad,
    read_intact_files,
    read_manifest,
    sha256,
    skipped_data_sheet,
    version_of,
)
from sitscad.spec.sensor import SensorSpec, without_text

if TYPE_CHECKING:
    from sitscad.estimates.design import Design
    from sitscad.package.contents import Contents


# a build of an unchanged package loads none of these, nor NumPy
package_contents = late("sitscad.package.stages", "package_contents")
make_stages = late("sitscad.package.stages", "make_stages")
new_manifest = late("sitscad.package.stages", "new_manifest")
cached_solutions = late("sitscad.package.cached_solutions", "cached_solutions")

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2


@contextlib.contextmanager
def locked_staging_folder(parent: Path, name: str) -> Iterator[Path]:
    """Lock the package `parent/name` for one build, and yield an empty staging folder beside it.

    Folders that interrupted builds left are removed first. The staging folder is always removed afterwards.

    Raises
    ------
    PackageError
        if another build has locked the package, or the folder cannot be written
    """
    with raising_package_errors(f"cannot build in {parent}"):
        parent.mkdir(parents=True, exist_ok=True)
        lock = _lock(parent, name)
    try:
        with raising_package_errors(f"cannot build in {parent}"):
            # Repair leftovers of a killed build. The lock is held, so no other process uses these folders
            target = parent / name
            ours = _leftover_pattern(name)
            for leftover in sorted(path for path in parent.iterdir() if ours.fullmatch(path.name)):
                if leftover.name.startswith(f".{name}.old-") and not target.exists():
                    os.rename(leftover, target)
                else:
                    _remove_leftover(leftover, target)
            staged = parent / f".{name}.new-{secrets.token_hex(6)}"
            staged.mkdir()
        try:
            yield staged
        finally:
            with contextlib.suppress(OSError):
                _remove_leftover(staged, target)
    finally:
        if lock is not None:
            with contextlib.suppress(OSError):
                (parent / f".{name}.lock").unlink()
            os.close(lock)


def write_package(staged: Path, files: Mapping[str, bytes], manifest: Manifest) -> None:
    """Write the files of a package, and its manifest last. A folder with a manifest is therefore always complete."""
    write_files(staged, files)
    write_files(staged, {_PARTIAL_MANIFEST: manifest.as_bytes()})
    with raising_package_errors(f"cannot write into {staged.parent}"):
        os.rename(staged / _PARTIAL_MANIFEST, staged / MANIFEST)


_PARTIAL_MANIFEST = f"{MANIFEST}.new"


def replace_package(staged: Path, target: Path) -> Path | None:
    """Replace the package `target` by the staged package in one step, and remove the old package.

    Return the folder that now holds the files of the old package that no build wrote (``NAME.kept-1``, 2, 3 ...). None
    if there are no such files. Files that KiCad wrote beside its project stay in the package.

    If the system cannot exchange two folders, the old folder is renamed first. If a build is interrupted between the
    two renames, the next build completes the exchange.
    """
    with raising_package_errors(f"cannot replace {target}"):
        for folder in (staged, *(path for path in staged.rglob("*") if path.is_dir())):
            _sync_folder(folder)
        old = staged
        if not target.exists():
            os.rename(staged, target)
        elif not _exchange(staged, target):
            old = target.parent / f".{target.name}.old-{secrets.token_hex(6)}"
            os.rename(target, old)
            os.rename(staged, target)
        _sync_folder(target.parent)
    if not old.exists():
        return None
    try:
        _move_kicad_files(old, target)
        return _remove_old_package(old, target)
    except OSError as error:
        raise PackageError(
            f"{target} is built, but the old package in {old}, which has files of yours, could not be moved: "
            f"{error.strerror or error}"
        ) from error


def _move_kicad_files(old: Path, target: Path) -> None:
    """Move the files that KiCad wrote into the old package to the new package, if it has the same KiCad project."""
    files = read_manifest(target).files
    for name in list_files(old):
        if is_left_by_kicad(name, files) and not os.path.lexists(target / name):
            (target / name).parent.mkdir(exist_ok=True)
            os.rename(old / name, target / name)


def _remove_leftover(leftover: Path, target: Path) -> None:
    """Remove the folder that an interrupted build left.

    A folder without a manifest is incomplete, and contains only files of that build. It is deleted as a whole.
    """
    if (leftover / MANIFEST).is_file():
        _remove_old_package(leftover, target)
    else:
        shutil.rmtree(leftover, ignore_errors=True)


def _remove_old_package(old: Path, target: Path) -> Path | None:
    """Delete an old package, except for files that no build wrote or that were changed after the build.

    Return the folder beside `target` that holds these files. None if there are none.
    """
    try:
        files = read_manifest(old).files
    except PackageError:
        files = {}
    for name, entry in files.items():
        if read_intact_files(old, {name: entry}) is not None:
            with contextlib.suppress(OSError):
                os.unlink(old / name)
    for folder, _, _ in os.walk(old, topdown=False):
        with contextlib.suppress(OSError):  # the folder holds files that stay
            os.rmdir(folder)
    if not old.exists():
        return None
    if files and os.listdir(old) == [MANIFEST]:
        os.unlink(old / MANIFEST)
        os.rmdir(old)
        return None
    number = 1
    while os.path.lexists(rest := target.parent / f"{target.name}.kept-{number}"):
        number += 1
    os.rename(old, rest)
    if files:  # else the manifest is not sitscad's
        os.unlink(rest / MANIFEST)
    return rest


def _lock(parent: Path, name: str) -> int | None:
    """Return the descriptor of a lock file that is released when its process ends.

    None if the system has no file locks. Without locks, two builds still use different staging folders, and the build
    that ends last replaces the other's package.
    """
    try:
        import fcntl
    except ImportError:  # pragma: no cover - not a POSIX system
        return None
    path = parent / f".{name}.lock"
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(descriptor)
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                return None  # a file system without locks
            message = f"another build of {name} is writing to {parent}; wait for it, or give another -o folder"
            raise PackageError(message) from None
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), os.stat(path)):
                return descriptor
        os.close(descriptor)  # its owner removed the lock file between our opening and locking


def has_leftovers(parent: Path, name: str) -> bool:
    """Whether a lock file or a staging folder lies beside a package, from an interrupted or a running build."""
    if not parent.is_dir():
        return False
    ours = _leftover_pattern(name)
    return any(entry.name == f".{name}.lock" or ours.fullmatch(entry.name) for entry in parent.iterdir())


def _leftover_pattern(name: str) -> re.Pattern[str]:
    return re.compile(re.escape(f".{name}.") + "(new|old)-[0-9a-f]{12}")


def _exchange(path: Path, other: Path) -> bool:
    """Exchange two folders in one step of the file system (Linux renameat2). Return whether it succeeded."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    return rename(_AT_FDCWD, os.fsencode(path), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0


def _sync_folder(folder: Path) -> None:
    """Flush the list of a folder's entries to the disk, if the system supports it."""
    with contextlib.suppress(OSError):  # not every system opens folders
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


FINDINGS = "findings.json"


@record
class BuildRequest:
    """Parameters of a build.

    `directory` is the package's folder, and `wanted` are the stages to make. With `force`, errors in the findings do
    not stop the build. With `strict`, warnings stop it, too. `policy` holds the project's rules and severities, and
    `baseline` the findings that are already known.
    """

    spec: SensorSpec
    directory: Path
    wanted: frozenset[str]
    force: bool
    policy: Policy
    baseline: Baseline | None
    strict: bool = False

    def is_stopped_by(self, checked: CheckedSpec) -> bool:
        """Whether findings stop the build: errors, or with `strict` also warnings, unless it is forced."""
        return not self.force and checked.fails(Severity.WARNING if self.strict else Severity.ERROR)

    def inputs_hash(self, old: Manifest) -> str:
        """Return the hash of all inputs of the package. Packages with equal hashes have equal bytes."""
        source = self.spec.source
        files = {name: sha256(content) for name, content in source.files_to_store.items()}
        has_solids = not (self.wanted | _stages_of(old)).isdisjoint(SOLID_STAGES)
        versions = {package: version_of(package) for package in KERNELS if has_solids}
        baseline = baseline_findings(self.baseline, source.path, self.spec.name)
        inputs = (source.text, Path(source.path).name, files, json.dumps(self.policy.as_json()), baseline)
        return hash_inputs(without_text(self.spec), *inputs, versions, *marks())


@checked_arguments
def build(
    spec: SensorSpec | Design, out: str | Path = "outputs", only: Iterable[str] | None = None, force: bool = False,
    progress: Progress | None = None, policy: Policy | None = None, baseline: Baseline | None = None, jobs: int = 1,
    strict: bool = False,
) -> BuildResult:
    """Check a spec and write its package into ``out/NAME``, as a whole or not at all.

    Parameters
    ----------
    spec : SensorSpec or Design
        spec to build
    out : str or Path
        folder of packages
    only : iterable of str, optional
        stages to make (see STAGES); by default all, but the data sheet only if matplotlib is installed
    force : bool
        whether to build in spite of errors, and mark the package
    progress : callable, optional
        called with the stage, the event and the seconds
    policy : Policy, optional
        rules and severities of a project
    baseline : Baseline, optional
        findings known before
    jobs : int
        with two or more, a second process makes the solids
    strict : bool
        whether warnings stop the build, too

    Returns
    -------
    BuildResult
        results of the stages; ``left_out`` names missing stages with the reason

    Raises
    ------
    PackageError
        if the folder cannot be written, is being written, or holds something else
    MissingExtra
        if a stage needs a package that is not installed; the text names the stages that do not need it

    Notes
    -----
    Parts of an existing package that still agree with the spec stay, and stale parts are removed. Parts with unchanged
    inputs are not made again. If spec, profiles, policy, data and code are unchanged, nothing is done, and the findings
    are read from the package.

    `policy`, `baseline` and the comments in the spec apply to the findings. If they silence errors of the electrical
    rules, these errors do not stop the build, but mark the package as `force` does.

    A script that sets `jobs` to two or more has to guard its main part (``if __name__ == "__main__"``), as for
    `multiprocessing`.
    """
    request, design = _build_request(spec, out, only, force, policy, baseline)
    left_out = {} if only is not None else skipped_data_sheet(request.spec)
    request = dataclasses.replace(request, wanted=request.wanted - set(left_out), strict=strict)
    result = _build(request, design or request.spec, progress or (lambda *_: None), jobs)
    if not left_out or not result.written:
        return result
    return dataclasses.replace(result, left_out={**result.left_out, **left_out})


def _build(request: BuildRequest, spec: SensorSpec | Design, report: Progress, jobs: int) -> BuildResult:
    directory = request.directory
    before = _require_own_package(directory)
    key = request.inputs_hash(before)
    if (same := _result_if_unchanged(request, before, key)) is not None:
        return BuildResult(directory, same.checked, written=False) if request.is_stopped_by(same.checked) else same
    with cached_solutions(directory.name):
        contents = package_contents(spec, request.policy, request.baseline, request.wanted)
        return _rebuild(request, contents, report, jobs, key)


def _rebuild(request: BuildRequest, contents: Contents, report: Progress, jobs: int, key: str) -> BuildResult:
    directory = request.directory
    report(CHECK_STAGE, "start", 0.0)
    began = time.perf_counter()
    stops = request.is_stopped_by(contents.checked)
    report(CHECK_STAGE, "stopped" if stops else "made", time.perf_counter() - began)
    if stops:
        return BuildResult(directory, contents.checked, written=False)
    with locked_staging_folder(directory.parent, directory.name) as staged:
        old = _require_own_package(directory)
        built = make_stages(contents, directory, old, request.wanted, report, request.force, jobs)
        contents = built.contents
        if request.is_stopped_by(contents.checked):  # findings on the solids
            return BuildResult(directory, contents.checked, written=False)
        manifest = new_manifest(contents, built, old, key, request.wanted)
        is_whole = read_intact_files(directory, old.files) is not None and not foreign_files(directory, old)
        if manifest == old and is_whole:
            return BuildResult(directory, contents.checked, True, built.results)
        write_package(staged, built.files, manifest)
        kept_aside = replace_package(staged, directory)
    # Stages without a file because the target's response cannot be solved
    none = [stage.name for stage in built.results
            if stage.outcome == "none" and stage.name in request.wanted & {"datasheet", "calibration"}]
    reason = contents.design.sensing.reason_without_performance if none and is_felt(contents.spec) else ""
    return BuildResult(directory, contents.checked, True, built.results, kept_aside,
                       left_out=dict.fromkeys(none, reason) if reason else {})


def stale(
    spec: SensorSpec | Design, out: str | Path = "outputs", only: Iterable[str] | None = None,
    policy: Policy | None = None, baseline: Baseline | None = None, jobs: int = 1,
) -> BuildResult:
    """Compare the package in ``out/NAME`` with the files that a build with the same `only` would make.

    Nothing is written. The result's ``stale`` has a text on each file that a build would change, add or remove. It also
    has texts on files that are missing or were changed by hand. If the package was built with another `only`, texts on
    the stages left out then come first. Files with computed numbers are compared by value (`sitscad.package.manifest`).
    Errors in the checks are in ``checked``. A package that was built in spite of errors is compared with a build with
    `force`. Raises the errors of `build`.
    """
    request, design = _build_request(spec, out, only, True, policy, baseline)
    old = _require_own_package(request.directory)
    if only is None:
        request = dataclasses.replace(request, wanted=request.wanted - set(skipped_data_sheet(request.spec)))
    if (same := _result_if_unchanged(request, old, request.inputs_hash(old))) is not None:
        return same
    contents = package_contents(design or request.spec, request.policy, request.baseline, request.wanted)
    with cached_solutions(request.directory.name, writes=False):
        built = make_stages(contents, request.directory, old, request.wanted, lambda *_: None, request.force, jobs,
                               figure_files(request.directory, old))
    # Stages left out of the package, with their numbers of files. Empty if there is no package
    asked_for = {*old.built_for, *_stages_of(old)} if old.files else set(STAGES)
    count = Counter(entry.stage for entry in built.entries.values() if entry.stage not in (*asked_for, CHECK_STAGE))
    lacking = {stage: count[stage] for stage in STAGES if stage in count}
    files = {name: content for name, content in built.files.items() if built.entries[name].stage not in lacking}
    differing = _difference_texts(request.directory, old, files)
    if lacking:
        names = ", ".join(f"{stage} ({count_text(files, 'file')})" for stage, files in lacking.items())
        built_for = ",".join(stage for stage in STAGES if stage in old.built_for)
        note = f"it was built without {names}: with --only {built_for} it is compared as it was built"
        differing = [note, *differing]
    return BuildResult(request.directory, built.contents.checked, False, built.results, stale=tuple(differing))


def _build_request(
    spec: SensorSpec | Design, out: str | Path, only: Iterable[str] | None, force: bool, policy: Policy | None,
    baseline: Baseline | None,
) -> tuple[BuildRequest, Design | None]:
    base, design = (spec, None) if isinstance(spec, SensorSpec) else (spec.spec, spec)
    directory = Path(out) / require_package_name(base.name)
    stages = frozenset(STAGES if only is None else only)
    unknown = sorted(stages - set(STAGES))
    if unknown or not stages:
        raise PackageError(f"{', '.join(unknown) or 'nothing'} is not a stage; there are: {', '.join(STAGES)}")
    implied = {"assembly"} if "mount" in stages else set()
    return BuildRequest(base, directory, stages | implied | {CHECK_STAGE}, force, policy or Policy(), baseline), design


def _result_if_unchanged(request: BuildRequest, old: Manifest, key: str) -> BuildResult | None:
    """Return the build result without a build, if the package is complete and its inputs have the hash `key`.

    None if inputs or files have changed, or if a requested stage is missing. Also None for packages that were built in
    spite of errors or with silenced errors, because they are checked again.
    """
    directory = request.directory
    try:
        if has_leftovers(directory.parent, directory.name):
            return None  # leftovers of a killed build: the next build removes them
        is_same = old.built_from == key and not old.forced and request.wanted <= set(old.built_for)
        contents = read_intact_files(directory, old.files) if is_same else None
        if contents is None or FINDINGS not in contents or foreign_files(directory, old):
            return None
    except (PackageError, OSError):
        return None
    source = request.spec.source
    checked = read_findings(contents[FINDINGS], source.path, source.text)
    if checked is None:
        return None
    counts = {stage: len(old.stage_entries(stage)) for stage in (*STAGES[:-1], CHECK_STAGE, STAGES[-1])}
    results = (StageResult(stage, "kept" if count else "none", count, 0.0) for stage, count in counts.items())
    return BuildResult(directory, checked, True, tuple(results), is_unchanged=True)


def _stages_of(old: Manifest) -> frozenset[str]:
    return frozenset(entry.stage for entry in old.files.values())


def _difference_texts(directory: Path, old: Manifest, files: Mapping[str, bytes]) -> list[str]:
    """Return a text on each file of the package that differs from a new build (`files`)."""
    texts = []
    for name, content in sorted(files.items()):
        path = directory / name
        if path.is_symlink() or not path.is_file():
            texts.append(f"{name} is missing")
        elif path.read_bytes() != content:
            is_ours = read_intact_files(directory, {name: old.files[name]} if name in old.files else {})
            texts.append(f"{name} is stale" if is_ours else f"{name} was changed by hand")
    texts += [f"{name} would not be made any more" for name in sorted(old.files) if name not in files]
    foreign = foreign_files(directory, old) if directory.is_dir() else []
    texts += [f"{name} is not sitscad's" for name in foreign if name not in old.files and name not in files]
    if not (directory / MANIFEST).is_file():
        texts.append(f"{MANIFEST} is missing")
    return list(map(escape_controls, texts))


def require_distinct_names(specs: Sequence[SensorSpec]) -> None:
    """Raise PackageError if two specs would be built into the same folder."""
    paths: dict[str, str] = {}
    for spec in specs:
        if spec.name in paths:
            pair = f"{paths[spec.name]} and {spec.source.path}"
            raise PackageError(f"{pair} both have the name {spec.name!r}; rename one")
        paths[spec.name] = spec.source.path


def _require_own_package(directory: Path) -> Manifest:
    """Return the manifest of the package to be replaced. Empty if there is no package, or if its manifest is damaged.

    Raises PackageError for a folder without a manifest. Sitscad did not make it and never replaces it.
    """
    with raising_package_errors(f"cannot look at {directory}"):
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
