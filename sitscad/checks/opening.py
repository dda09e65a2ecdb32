"""Specs from paths, folders and standard input, each with its configuration, and parallel processes for several specs.

Rules are loaded only if a configuration names rules, or a spec cannot be read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from sitscad.basics.finding import NotChecked
from sitscad.basics.late import late
from sitscad.checks.findings import CheckedSpec, RuleTexts
from sitscad.checks.policy import Policy, nearest_policy
from sitscad.spec.load import load, load_text, read_text
from sitscad.spec.reading import SpecError, decode_text
from sitscad.spec.sensor import SensorSpec

Given = TypeVar("Given")
Made = TypeVar("Made")

# a build of an unchanged package loads neither the rules nor NumPy; few checks need several processes (5 ms)
all_rules, mended = late("sitscad.checks.judging", "all_rules"), late("sitscad.checks.judging", "mended")
process_pool = late("sitscad.checks.pool", "process_pool")

STDIN = "-"
SHOWN = 1 << 18
"""Largest number of bytes read of a spec with errors, to print its lines. It is also the largest size of a spec."""


def nearest_policy_of_spec(path: str) -> Policy:
    """Return the policy of the nearest configuration above a spec, or above the working folder for standard input."""
    return nearest_policy(Path(path).parent, _active_rules())


def _active_rules() -> Iterator[RuleTexts]:
    """Yield every active rule."""
    yield from all_rules()


def open_spec(path: str, policy: Policy | None = None) -> SensorSpec:
    """Return the spec at a path or from standard input.

    Raises `SpecError` with all findings if the text is not a valid spec. `policy` gives the folder of fabricators'
    profiles.
    """
    profiles = None if policy is None else policy.profiles
    if path == STDIN:
        return load_text(decode_text(read_text(path).encode("utf-8")), path, profiles)
    return load(path, profiles)


def check_unreadable(path: str, error: SpecError, hints: str = "decisive", text: str | None = None) -> CheckedSpec:
    """Return the findings of a spec that could not be loaded. Rules without a finding are listed as not checked.

    `error` is the error of loading. `hints` is the name of the budget of trials for hints, as in `check`. `text` is the
    spec's text; if None, it is read from the file.
    """
    reported = {finding.rule for finding in error.findings}
    skipped = (rule.id for rule in _active_rules() if rule.id not in reported)
    not_checked = tuple(NotChecked(rule, "the spec could not be read") for rule in skipped)
    source_text = error.source.text if error.source is not None else ""
    shown = text if text is not None else source_text if path == STDIN else file_beginning(path)
    return CheckedSpec(path, shown, mended(error, hints), not_checked, error.texts)


STUDY = "sitscad_study:"
"""Text at the start of a line by which a file is recognised as a study."""


def is_study(path: str) -> bool:
    """Whether a file is marked as a study and is therefore no spec."""
    return _begins(path, STUDY)


def find_specs(paths: Sequence[str], passed_by: Callable[[str], None] | None = None) -> list[str]:
    """Return paths of specs. Each folder in `paths` is replaced by the specs in it and below it, sorted by name.

    YAML files in a folder are specs if they have a top-level key ``sitscad``. Hidden folders and folders of packages
    are left out. Studies in folders are left out as well, and `passed_by` is called with the path of each. Raises
    ValueError for a folder without specs, and for the path of a study.
    """
    specs: list[str] = []
    for path in paths:
        if path == STDIN or not os.path.isdir(path):
            if path != STDIN and is_study(path):
                raise ValueError(f"{path} is a study and no spec: `sitscad design {path}`")
            specs.append(path)
            continue
        named = _yaml_files(path)
        if passed_by is not None:
            for name in (name for name in named if is_study(name)):
                passed_by(name)
        below = [name for name in named if _begins(name, "sitscad:")]
        if not below:
            raise ValueError(f"{path}: there is no spec in this folder (a YAML file with `sitscad: 1` in it)")
        specs += below
    return list(dict.fromkeys(specs))


def _begins(path: str, word: str) -> bool:
    return any(line.startswith(word) for line in file_beginning(path).splitlines())


def _yaml_files(folder: str) -> list[str]:
    """Return the paths of YAML files in a folder and below it, without hidden folders and folders of packages."""
    specs = []
    for root, folders, files in os.walk(folder):
        visible = (
            n for n in folders if not n.startswith(".") and not os.path.isfile(os.path.join(root, n, "manifest.json"))
        )
        folders[:] = sorted(visible)
        specs += [os.path.join(root, name) for name in sorted(files) if name.lower().endswith((".yaml", ".yml"))]
    return specs


def file_beginning(path: str) -> str:
    """Return the start of a file, up to the largest size of a spec.

    Empty unless the path is a plain file, because a pipe may never end.
    """
    try:
        if not Path(path).is_file():
            return ""
        with Path(path).open("rb") as stream:
            return stream.read(SHOWN).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return ""


def map_in_processes(work: Callable[[Given], Made], values: Sequence[Given], jobs: int | None = None) -> Iterator[Made]:
    """Yield `work(value)` for every value in order, computed by at most `jobs` processes (all processors if None).

    With a single process or value, the work is done in this process. `work`, values and results must be picklable. An
    exception in a process is raised here, at its place in the order.
    """
    count = min(jobs or usable_processors(), len(values))
    if count <= 1:
        yield from map(work, values)
        return
    with process_pool(count) as pool:
        running = [pool.submit(work, value) for value in values]
        try:
            yield from (each.result() for each in running)
        finally:
            for each in running:
                each.cancel()


def usable_processors() -> int:
    """Return the number of processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - not Linux
        return os.cpu_count() or 1
