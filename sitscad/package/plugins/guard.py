"""What a plugin is, and its own code at work: whatever way it takes out of the program is an error of its own, and what
takes long is told by name.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

from sitscad.basics.record import record

if TYPE_CHECKING:
    from sitscad.checks.rules import Rule
    from sitscad.files.writer import Writer


class PluginError(RuntimeError):
    """A plugin cannot be used, or went wrong where it was used; the text names it."""


@record
class Plugin:
    """A plugin in force: what it is called, its rules and writers, and the hash of the file that it stands in."""

    name: str
    rules: tuple[Rule, ...]
    writers: tuple[Writer, ...]
    sha256: str


SLOW = 10.0
"""Seconds after which a plugin that is at work is told, and then each time that it has taken twice as long."""


class Interrupted(KeyboardInterrupt):
    """The user's own interruption, which a plugin that raises KeyboardInterrupt cannot be taken for."""


@contextmanager
def at_work(what: str, file: str | None = None) -> Iterator[None]:
    """The part of a plugin that is named does something here. `file` is the plugin's, whose line an error then names.

    Raises `PluginError` with that name for whatever goes wrong, also for what would end the program (SystemExit,
    KeyboardInterrupt, GeneratorExit). What ends the process itself (``os._exit``, a signal) nobody can catch.
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
        except BaseException:  # its own code once more
            text = ""
        line = _line_in(file, error)
        where = f"{what}: line {line}" if line else what
        raise PluginError(f"{where}: {type(error).__name__}{f': {text}' if text else ''}") from error
    finally:
        done.set()


def _line_in(file: str | None, error: BaseException) -> int | None:
    """Return the last line of a file that was at work when an error was raised. None if there was none."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return error.lineno
    import traceback  # only where a plugin failed

    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return lines[-1] if lines else None


def _tell(what: str, done: threading.Event) -> None:
    """Say again and again, on standard error unless a program has it otherwise, what is still at work."""
    passed, wait = 0.0, SLOW
    while not done.wait(wait):
        import logging  # only where something is slow

        passed += wait
        logging.getLogger("sitscad").warning("%s has been at work for %.3g s", what, passed)
        wait = passed


@contextmanager
def _own_interruption() -> Iterator[None]:
    """Have the user's interruption raise `Interrupted`, where Python's own handler is in force."""
    import signal  # only where a plugin is at work

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
