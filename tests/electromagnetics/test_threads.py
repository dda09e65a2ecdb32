"""Solvers limit linear algebra to one thread, and leave the process as it was."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from sitscad.kernels.electromagnetics.threads import OneThread, _libraries

ROOT = Path(__file__).parents[2]

SOLVE = """
import time
import sitscad

sitscad.Design(sitscad.load("templates/bench_7mm.yaml")).estimates
began = time.process_time()
design = sitscad.Design(sitscad.load("templates/grasper_4layer.yaml"))
design.layout
sitscad.respond(design, [[0.0, 0.0, -1e-4, 0.0, 0.0, 0.0]])
print(time.process_time() - began)
"""


def seconds(threads: str) -> float:
    """Processor time (s) of all threads of a process that solves a template."""
    around = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": threads}
    command = [sys.executable, "-c", SOLVE]
    done = subprocess.run(command, env=around, cwd=ROOT, capture_output=True, text=True, check=True, timeout=300)
    return float(done.stdout)


@pytest.mark.slow
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="two threads need two processors")
def test_solve_with_two_threads_is_not_slower_than_with_one():
    """It cost 4 to 10 times as much on a busy machine."""
    assert min(seconds("2") for _ in range(2)) < 1.3 * max(seconds("1") for _ in range(2))


class Library:
    """A library of linear algebra with two threads, as threadpoolctl shows it."""

    allowed = 2

    def limit(self, limits, user_api):
        assert user_api == "blas" and self.allowed == 2
        self.allowed = limits
        return self

    def restore_original_limits(self):
        assert self.allowed == 1
        self.allowed = 2


@pytest.fixture
def library(monkeypatch):
    result = Library()
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setattr("sitscad.kernels.electromagnetics.threads._libraries", lambda: result)
    return result


def test_thread_limit_ends_with_outermost_block_or_error(library):
    limited = OneThread()
    with limited:
        with limited:
            assert library.allowed == 1
        assert library.allowed == 1
    assert library.allowed == 2
    with pytest.raises(ZeroDivisionError), limited:
        _ = 1 / 0
    assert library.allowed == 2


def test_thread_limit_lasts_until_last_thread_exits(library):
    limited, entered, leave = OneThread(), threading.Event(), threading.Event()

    def other() -> None:
        with limited:
            entered.set()
            leave.wait(10)

    thread = threading.Thread(target=other)
    with limited:
        thread.start()
        assert entered.wait(10)
    assert library.allowed == 1
    leave.set()
    thread.join(10)
    assert library.allowed == 2


@pytest.mark.skipif(not hasattr(os, "register_at_fork"), reason="processes are forked on POSIX alone")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_process_forked_during_block_start_does_not_deadlock(library, monkeypatch):
    """The child got a lock that nobody would release, and its first solution waited for ever."""
    limited, held, inside = OneThread(), threading.Event(), []

    def looked_for() -> Library:
        held.set()
        time.sleep(0.3)
        return library

    def other() -> None:
        with limited:
            inside.append(library.allowed)

    monkeypatch.setattr("sitscad.kernels.electromagnetics.threads._libraries", looked_for)
    thread = threading.Thread(target=other)
    thread.start()
    assert held.wait(10)
    child = multiprocessing.get_context("fork").Process(target=limited.__enter__)
    child.start()
    child.join(10)
    is_stuck = child.exitcode is None
    child.kill()
    thread.join(10)
    assert not is_stuck and inside == [1] and library.allowed == 2


def test_limited_library_is_blas_of_numpy():
    assert [row["user_api"] for row in _libraries().info() if "numpy" in row["filepath"]] == ["blas"]


def test_thread_limit_in_environment_skips_library_search(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    looked_for = "sitscad.kernels.electromagnetics.threads._libraries"
    monkeypatch.setattr(looked_for, lambda: pytest.fail("libraries were looked for"))
    limited = OneThread()
    with limited:
        assert limited._limits is None
