"""Execution of plugin code with control over its errors and its time.

Every exception from a plugin's code becomes a PluginError, and a slow plugin is reported on standard error.
"""

from __future__ import annotations

import logging
import signal
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from sitscad.package.plugins.plugin import PluginError

SLOW = 10.0
"""Time (s) after which a plugin that still runs is reported. The time doubles for each further report."""


class Interrupted(KeyboardInterrupt):
    """An interruption by the user, as distinct from a KeyboardInterrupt that a plugin raises."""


@contextmanager
def at_work(what: str, file: str | None = None) -> Iterator[None]:
    """Run a part of a plugin in this context. `what` is its description for messages.

    `file` is the plugin's file, for line numbers in errors.

    Raises PluginError with `what` for any error, also for exceptions that end the program (SystemExit,
    KeyboardInterrupt, GeneratorExit). An end of the process itself (``os._exit``, a signal) cannot be caught.
    """
    done = threading.Event()
    threading.Thread(target=_tell, args=(what, done), daemon=True).start()
    try:
        with _own_interruption():
            yield
    except (Interrupted, PluginError):
        raise
    except BaseException as error:
        try:
            text = str(error)
        except BaseException:  # the text comes from the plugin's code, too
            text = ""
        line = _line_in(file, error)
        where = f"{what}: line {line}" if line else what
        raise PluginError(f"{where}: {type(error).__name__}{f': {text}' if text else ''}") from error
    finally:
        done.set()


def _line_in(file: str | None, error: BaseException) -> int | None:
    """Return the last line of `file` that ran before an error was raised. None if no line of the file ran."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return error.lineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return lines[-1] if lines else None


def _tell(what: str, done: threading.Event) -> None:
    """Log warnings that a plugin is still running, until `done` is set.

    The first warning comes after `SLOW` seconds. The time before each further warning is the total time so far. By
    default, the log is written to standard error.
    """
    passed, wait = 0.0, SLOW
    while not done.wait(wait):
        passed += wait
        logging.getLogger("sitscad").warning("%s has been at work for %.3g s", what, passed)
        wait = passed


@contextmanager
def _own_interruption() -> Iterator[None]:
    """Raise `Interrupted` instead of KeyboardInterrupt if the user interrupts.

    Only if Python's own handler is active.
    """
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise Interrupted

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
