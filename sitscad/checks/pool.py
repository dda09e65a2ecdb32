"""Pools of processes that end with the process that started them."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import connection, parent_process


def process_pool(count: int, undisturbed: bool = False) -> ProcessPoolExecutor:
    """Return a pool of `count` processes that end with this process, even if this process is killed.

    If `undisturbed`, the processes of the pool ignore Ctrl-C, and only this process receives it.
    """
    return ProcessPoolExecutor(count, initializer=_prepare_process, initargs=(undisturbed,))


def _prepare_process(undisturbed: bool) -> None:
    if undisturbed:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Wait until the parent process ends, then end this process, which would otherwise wait for work forever."""
    if (parent := parent_process()) is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
