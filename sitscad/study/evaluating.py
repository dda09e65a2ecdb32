"""Designs evaluated side by side: in chunks of about a second's work, by processes or whatever else has `submit`, and
always given back in the order in which they were asked for.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from functools import lru_cache
from itertools import islice
from typing import Any, Protocol, TypeVar

from sitscad.opening import processes, processors
from sitscad.parts import MissingExtra
from sitscad.record import record
from sitscad.spec.format.reading import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.study.changes import Base, Changes
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


Made = TypeVar("Made")
Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""Work, and what it is given."""


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
        self._jobs = jobs or processors()
        self._pool: Any = executor
        self._speed: dict[str, float] = {}

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if self._given is None and self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def evaluations(self, designs: Sequence[Changes], measures: Sequence[str], level: str) -> Iterator[Evaluation]:
        """Those of all designs, in their order."""
        left = deque(designs)

        def chunks() -> Iterator[Task]:
            while left:
                size = min(self._size(level), -(-len(left) // self._jobs))
                chunk = Chunk(tuple(left.popleft() for _ in range(size)), tuple(measures), level)
                yield evaluate_chunk, (self._base.text, self._base.path, self._base.profiles, chunk)

        for found, seconds in self._in_order(chunks()):
            self._speed[level] = len(found) / max(seconds, 1e-3)
            yield from found

    def each(self, work: Callable[..., Made], given: Sequence[tuple[Any, ...]]) -> Iterator[Made]:
        """What `work` makes of each of some arguments, in their order."""
        yield from self._in_order((work, arguments) for arguments in given)

    def _size(self, level: str) -> int:
        if self._is_here:
            return 1
        return max(1, min(MOST_IN_CHUNK, round(SECONDS * self._speed.get(level, 1.0))))

    @property
    def _is_here(self) -> bool:
        return self._given is None and self._jobs == 1

    def _in_order(self, tasks: Iterator[Task]) -> Iterator[Any]:
        """What tasks make, in their order; each is taken when it is begun, two for every worker at a time."""
        if self._is_here:
            yield from (work(*arguments) for work, arguments in tasks)
            return
        running = deque[tuple[Task, Any]]()
        while True:
            for task in islice(tasks, 2 * self._jobs - len(running)):
                running.append((task, self._submit(task)))
            if not running:
                return
            yield self._first(running)

    def _submit(self, task: Task) -> Any:
        if self._pool is None:
            self._pool = processes(self._jobs, undisturbed=True)
        return self._pool.submit(task[0], *task[1])

    def _first(self, running: deque[tuple[Task, Any]]) -> Any:
        """What the first of the tasks that are on their way makes; all are begun again where a process died."""
        for _ in range(DEATHS):
            try:
                found = running[0][1].result()
                running.popleft()
                return found
            except BrokenExecutor:
                if self._given is not None:
                    raise
                self._pool = None
                tasks = [task for task, _ in running]
                running.clear()
                running.extend((task, self._submit(task)) for task in tasks)
        raise BrokenExecutor("processes ended without a word, again and again: too little memory, or ended by somebody")


def cluster(address: str) -> tuple[Executor, int]:
    """A client of the Dask scheduler at an address, and how many designs its workers evaluate at once.

    Raises MissingExtra without Dask, OSError where nothing answers. Work of a worker that dies goes to others.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingExtra(f"--scheduler needs dask ({error}): pip install 'sitscad[cluster]'") from error
    client = Client(address, timeout=SECONDS_TO_ANSWER)
    return client, max(1, sum(client.nthreads().values()))


SECONDS_TO_ANSWER = 10
"""How long a scheduler may take to answer."""
