"""Limit of numpy's linear algebra to a single thread.

The matrices are small, so threads that wait for each other cost more processor time than they save.
"""

from __future__ import annotations

import os
import threading
from contextlib import ContextDecorator
from functools import cache
from typing import Any


class OneThread(ContextDecorator):
    """Context that limits the linear algebra of numpy to one thread until the outermost active block ends.

    The limit holds for the whole process while a block lasts. Afterwards the process gets its previous setting back. If
    the environment limits OpenBLAS to one thread from the start, the block has no effect and threadpoolctl is not
    loaded.
    """

    def __init__(self) -> None:
        self._lock, self._blocks = threading.Lock(), 0
        self._limits: Any = None
        if hasattr(os, "register_at_fork"):  # a child process gets a free lock, even if other threads hold it
            os.register_at_fork(before=self._lock.acquire, after_in_parent=self._lock.release,
                                after_in_child=self._lock.release)

    def __enter__(self) -> None:
        with self._lock:
            if not self._blocks and os.environ.get("OPENBLAS_NUM_THREADS") != "1":
                self._limits = _libraries().limit(limits=1, user_api="blas")
            self._blocks += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._blocks -= 1
            if not self._blocks and self._limits is not None:
                self._limits.restore_original_limits()
                self._limits = None


@cache
def _libraries() -> Any:
    """Return the linear algebra libraries that the process has loaded, including numpy's."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


one_thread = OneThread()
"""Limit to one thread for all solvers, as a decorator or in a `with` statement."""
