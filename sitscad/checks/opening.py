"""Specs as paths lead to them: files, folders and standard input, each under the nearest configuration above it; and
several of them at work in processes beside each other.

No rule is loaded for that unless a configuration names one: a package that has not changed needs none.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from sitscad.checks.findings import RuleTexts
from sitscad.checks.policy import Policy, nearest_policy
from sitscad.spec.load import load, load_text, read_text
from sitscad.spec.reading import decoded
from sitscad.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

Given = TypeVar("Given")
Made = TypeVar("Made")

STDIN = "-"
SHOWN = 1 << 18
"""Bytes of an unreadable spec that are read to show its lines: as many as a spec may have."""


def policy_for(path: str) -> Policy:
    """The policy of the nearest configuration above a spec; above the working folder for standard input."""
    return nearest_policy(Path(path).parent, _rules())


def _rules() -> Iterator[RuleTexts]:
    """Every rule in force, loaded when the first one is asked for."""
    from sitscad.checks.judging import all_rules

    yield from all_rules()


def opened(path: str, policy: Policy | None = None) -> SensorSpec:
    """The spec at a path, or of standard input; raises `SpecError` with every finding where it is none."""
    profiles = None if policy is None else policy.profiles
    if path == STDIN:
        return load_text(decoded(read_text(path).encode("utf-8")), path, profiles)
    return load(path, profiles)


STUDY = "sitscad_study:"
"""How the line begins by which a file says that it is a study."""


def is_study(path: str) -> bool:
    """Whether a file says that it is a study and no spec."""
    return _begins(path, STUDY)


def specs_in(paths: Sequence[str], passed_by: Callable[[str], None] | None = None) -> list[str]:
    """Paths as they are, folders as the specs in them and below, in order of their names.

    Of the YAML files in a folder those are specs that have a key ``sitscad`` at the left; packages and hidden folders
    are left out, and studies are, which `passed_by` is told. Raises ValueError for a folder without any, and for a path
    of a study.
    """
    found: list[str] = []
    for path in paths:
        if path == STDIN or not os.path.isdir(path):
            if path != STDIN and is_study(path):
                raise ValueError(f"{path} is a study and no spec: `sitscad design {path}`")
            found.append(path)
            continue
        named = _yaml_files(path)
        if passed_by is not None:
            for name in (name for name in named if is_study(name)):
                passed_by(name)
        below = [name for name in named if _begins(name, "sitscad:")]
        if not below:
            raise ValueError(f"{path}: there is no spec in this folder (a YAML file with `sitscad: 1` in it)")
        found += below
    return list(dict.fromkeys(found))


def _begins(path: str, word: str) -> bool:
    return any(line.startswith(word) for line in beginning(path).splitlines())


def _yaml_files(folder: str) -> list[str]:
    """The YAML files in a folder and below, but for hidden folders and packages."""
    found = []
    for root, folders, files in os.walk(folder):
        kept = (
            n for n in folders if not n.startswith(".") and not os.path.isfile(os.path.join(root, n, "manifest.json"))
        )
        folders[:] = sorted(kept)
        found += [os.path.join(root, name) for name in sorted(files) if name.lower().endswith((".yaml", ".yml"))]
    return found


def beginning(path: str) -> str:
    """What a spec may hold at most, to show a line of it; nothing of what is no plain file (a pipe would never end)."""
    try:
        if not Path(path).is_file():
            return ""
        with Path(path).open("rb") as stream:
            return stream.read(SHOWN).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return ""


def each_of(work: Callable[[Given], Made], given: Sequence[Given], jobs: int | None = None) -> Iterator[Made]:
    """What `work` makes of every one of some values, in their order; `jobs` processes at most (the processors if None).

    With one process, or one value, the work is done here. `work`, values and results have to be picklable; an exception
    of any of them is raised here, at its place in the order.
    """
    wanted = min(jobs or processors(), len(given))
    if wanted <= 1:
        yield from map(work, given)
        return
    with processes(wanted) as pool:
        running = [pool.submit(work, value) for value in given]
        try:
            yield from (each.result() for each in running)
        finally:
            for each in running:
                each.cancel()


def processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - not Linux
        return os.cpu_count() or 1


def processes(count: int, undisturbed: bool = False) -> ProcessPoolExecutor:
    """Processes for work side by side, which end when this one does, even where it is killed. `undisturbed` ones leave
    Ctrl-C to this one.
    """
    from concurrent.futures import ProcessPoolExecutor  # only where there are several

    return ProcessPoolExecutor(count, initializer=_ready, initargs=(undisturbed,))


def _ready(undisturbed: bool) -> None:
    if undisturbed:
        import signal  # only in a process of several

        signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Who waits for work from a process that was killed waits forever."""
    from multiprocessing import connection, parent_process

    if (parent := parent_process()) is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
