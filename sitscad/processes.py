"""The same work on several specs in processes beside each other, in the order of the specs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - not Linux
        return os.cpu_count() or 1


def each_of(work: Callable[[Given], Made], given: Sequence[Given], jobs: int | None = None) -> Iterator[Made]:
    """What `work` makes of every one of some values, in their order; `jobs` processes at most (the processors if None).

    With one process, or one value, the work is done here. `work`, values and results have to be picklable; an exception
    of any of them is raised here, at its place in the order.
    """
    wanted = min(jobs or processors(), len(given))
    if wanted <= 1:
        yield from map(work, given)
        return
    from concurrent.futures import ProcessPoolExecutor  # only where there are several

    with ProcessPoolExecutor(wanted) as pool:
        running = [pool.submit(work, value) for value in given]
        try:
            yield from (each.result() for each in running)
        finally:
            for each in running:
                each.cancel()
