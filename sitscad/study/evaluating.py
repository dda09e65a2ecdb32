"""Designs evaluated side by side: in chunks of about a second's work, by processes or whatever else has `submit`, and
always given back in the order in which they were asked for.
"""

from __future__ import annotations

import os
import signal
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from functools import lru_cache
from typing import Any, Protocol

from sitscad.record import record
from sitscad.spec.format.reading import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.study.base import Base, Changes
from sitscad.study.evaluation import FULL, Breach, Evaluation
from sitscad.study.full import judged, unreadable
from sitscad.study.screen import screened

SECONDS = 1.0
"""Work that a chunk is to hold."""

MOST_IN_CHUNK = 500
DEATHS = 3
"""How often a chunk is done again whose worker died, before that is an error."""

NOT_COMPUTED = "not-computed"
"""Stands among the rules for a design that made a computation fail."""


class Executor(Protocol):
    """Whatever does work elsewhere: `concurrent.futures`, or a client of Dask."""

    def submit(self, work: Any, /, *given: Any) -> Any:
        """Something whose `result` gives what the work makes."""


@record
class Chunk:
    """Designs that go to one worker together, and what is asked of them."""

    designs: tuple[Changes, ...]
    measures: tuple[str, ...]
    level: str


@lru_cache(maxsize=4)
def _base(text: str, path: str, profiles: str | None) -> Base:
    return Base(text, path, profiles)


def evaluate_chunk(text: str, path: str, profiles: str | None, chunk: Chunk) -> tuple[list[Evaluation], float]:
    """The evaluations of a chunk in its order, and the seconds that they took."""
    started, base = time.perf_counter(), _base(text, path, profiles)
    found: list[Evaluation | None] = []
    specs: list[SensorSpec] = []
    for changes in chunk.designs:
        try:
            specs.append(base.design(changes))
            found.append(None)
        except SpecError as error:
            found.append(unreadable(error, chunk.measures, chunk.level))
    made = iter(_evaluated(specs, chunk))
    return [next(made) if one is None else one for one in found], time.perf_counter() - started


def _evaluated(specs: Sequence[SensorSpec], chunk: Chunk) -> list[Evaluation]:
    """The evaluations of specs; a computation that fails refuses its design alone."""
    try:
        if chunk.level != FULL:
            return screened(specs, chunk.measures)
        return [judged(spec, chunk.measures) for spec in specs]
    except Exception as error:
        if len(specs) > 1:
            return [one for spec in specs for one in _evaluated([spec], chunk)]
        why = f"a computation failed: {type(error).__name__}: {error}"
        return [Evaluation({}, dict.fromkeys(chunk.measures, why), {NOT_COMPUTED: Breach()}, level=chunk.level)]


class Workers:
    """Evaluates designs of a base: here where `jobs` is 1, else by processes, or by an executor that is given."""

    def __init__(self, base: Base, jobs: int | None = None, executor: Executor | None = None) -> None:
        self._base, self._given = base, executor
        self._jobs = jobs or _processors()
        self._pool: Any = executor
        self._speed: dict[str, float] = {}

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if self._given is None and self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def evaluations(self, designs: Sequence[Changes], measures: Sequence[str], level: str) -> Iterator[Evaluation]:
        """Those of all designs, in their order."""
        if self._given is None and (self._jobs == 1 or len(designs) == 1):
            for changes in designs:
                yield from self._here(Chunk((changes,), tuple(measures), level))[0]
            return
        left, running = deque(designs), deque[tuple[Chunk, Any]]()
        while left or running:
            while left and len(running) < 2 * self._jobs:
                size = min(self._size(level), -(-len(left) // self._jobs))
                chunk = Chunk(tuple(left.popleft() for _ in range(min(size, len(left)))), tuple(measures), level)
                running.append((chunk, self._submit(chunk)))
            found, seconds = self._first(running)
            self._speed[level] = len(found) / max(seconds, 1e-3)
            yield from found

    def _size(self, level: str) -> int:
        return max(1, min(MOST_IN_CHUNK, round(SECONDS * self._speed.get(level, 1.0))))

    def _here(self, chunk: Chunk) -> tuple[list[Evaluation], float]:
        return evaluate_chunk(self._base.text, self._base.path, self._base.profiles, chunk)

    def _submit(self, chunk: Chunk) -> Any:
        if self._pool is None:
            from concurrent.futures import ProcessPoolExecutor  # only where there are several

            self._pool = ProcessPoolExecutor(self._jobs, initializer=_undisturbed)
        return self._pool.submit(evaluate_chunk, self._base.text, self._base.path, self._base.profiles, chunk)

    def _first(self, running: deque[tuple[Chunk, Any]]) -> tuple[list[Evaluation], float]:
        """What the first of the chunks that are on their way makes; all are sent again where a process died."""
        for _ in range(DEATHS):
            try:
                found: tuple[list[Evaluation], float] = running[0][1].result()
                running.popleft()
                return found
            except BrokenExecutor:
                if self._given is not None:
                    raise
                self._pool = None
                chunks = [chunk for chunk, _ in running]
                running.clear()
                running.extend((chunk, self._submit(chunk)) for chunk in chunks)
        raise BrokenExecutor("processes ended without a word, again and again: too little memory, or ended by somebody")


def _processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - not Linux
        return os.cpu_count() or 1


def _undisturbed() -> None:
    """Leave Ctrl-C to the process that a person started, which then ends this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
