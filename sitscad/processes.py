"""The same work on several specs in processes beside each other, in the order of the specs."""

from __future__ import annotations

import os
import sys
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


KEPT, MAPPED = 256 << 20, 32 << 20
"""Bytes that are freed and kept for what comes next, and from which on an array is the system's by itself: the most
that the library takes (mallopt(3))."""

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of its settings, as in malloc.h."""


def keep_freed_memory() -> bool:
    """Have the C library keep freed memory for this process's next arrays; whether it does.

    Else every array of some hundred kilobytes is taken from the system anew and cleared by it, which is a tenth to a
    fifth of a check's time. Only GNU's library is asked: of others nothing is known.
    """
    if not sys.platform.startswith("linux"):
        return False
    import ctypes  # numpy loads it anyway

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all([mallopt(_MMAP_THRESHOLD, MAPPED), mallopt(_TRIM_THRESHOLD, KEPT)])


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
