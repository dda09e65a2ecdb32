"""The commands: arguments in, exit codes out. What they do is in the other rooms."""

from __future__ import annotations

import gc
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import NoReturn

import click

import sitscad
from sitscad.cli.terminal import say

ISSUES = "the project's issue tracker"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command line and leave with its exit code; no exception reaches the person who typed it."""
    # Our matrices are small: threads of the linear algebra would only wait for each other, at twice the processor time
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    keep_freed_memory()
    gc.set_threshold(200_000)  # a short command makes much and drops little: looking for cycles costs it some per cent
    prepare_streams()
    code = run(arguments)
    gc.freeze()  # what is left goes with the process: the last look for cycles would cost some per cent more
    sys.exit(code)


class Messages(io.TextIOWrapper):
    """Standard error that discards a message if it cannot be written, so that the command continues."""

    def write(self, text: str, /) -> int:
        """Write the text, or discard it. Raises BrokenPipeError, which ends the command."""
        with _ignore_write_errors():
            super().write(text)
        return len(text)

    def flush(self) -> None:
        """Write the buffered text, or discard it."""
        with _ignore_write_errors():
            super().flush()


@contextmanager
def _ignore_write_errors() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise


def prepare_streams() -> None:
    """Open closed standard streams on the null device, and make all streams accept any character.

    Otherwise the next file that is opened gets the number of the closed stream, and text that a library prints there
    goes into that file.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_RDWR)  # the lowest free number: that of the closed stream
            os.set_inheritable(descriptor, True)
            setattr(sys, name, os.fdopen(descriptor, "r" if name == "stdin" else "w"))
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if type(sys.stderr) is io.TextIOWrapper:  # not a stream that a program, such as a test, put in its place
        encoding = sys.stderr.encoding
        sys.stderr = Messages(sys.stderr.detach(), encoding, "backslashreplace", line_buffering=True)


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


def run(arguments: Sequence[str] | None) -> int:
    """The exit code of one command line; whatever goes wrong is told in words."""
    try:
        code = cli.main(arguments, prog_name="sitscad", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return 2
    except (KeyboardInterrupt, click.Abort):
        say("interrupted; what was finished is kept")
        return 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - what is left in the stream cannot be written either
        return 141
    except OSError as error:
        if os.environ.get("SITSCAD_TRACEBACK"):
            raise
        say(f"cannot read or write: {error}")
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - what is left in the stream cannot be written either
        return 2
    except Exception as error:
        return crash(error)


def crash(error: Exception) -> int:
    """One sentence for what is known to go wrong, one with how to report it for what is not."""
    if os.environ.get("SITSCAD_TRACEBACK"):
        raise error
    from sitscad.checks.policy import PolicyError
    from sitscad.data import DataError

    if isinstance(error, (DataError, sitscad.PackageError, sitscad.MissingExtra, PolicyError, sitscad.PluginError)):
        say(str(error))
    elif isinstance(error, UnicodeEncodeError):
        what = ascii(error.object[error.start : error.end])
        say(f"{what} in a file's name cannot be written as text ({error.encoding}): rename it, or set PYTHONUTF8=1")
    elif type(error).__name__ == "BrokenProcessPool":  # of concurrent.futures, which few commands load
        say("a process ended without a word (too little memory, or ended by a plugin or somebody): --jobs 1 shows more")
    elif isinstance(error, sitscad.PartsError):
        say(f"a part cannot be made: {error}")
        return 1
    else:
        say(
            f"internal error: {type(error).__name__}: {error}\n"
            f"This is a fault of sitscad {sitscad.__version__}, not of your spec. Please report it in {ISSUES}, with "
            "the spec and the output of the same command run with SITSCAD_TRACEBACK=1 in its environment."
        )
    return 2


SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


MODULES = {
    "new": "explaining", "check": "checking", "watch": "reading", "coil": "lone_coil", "estimate": "estimating",
    "response": "estimating", "calibrate": "estimating", "read": "reading", "sweep": "designing", "design": "designing",
    "build": "building", "explain": "explaining", "rules": "explaining", "measures": "designing",
    "schema": "explaining", "verify": "building",
}
"""Modules of the commands, in the order in which they are used."""


class Commands(click.Group):
    """The commands of `MODULES`. A command line imports its own command only."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands, in the order in which they are used."""
        return list(MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command; None if there is none of this name."""
        for name in (cmd_name,) if cmd_name in MODULES else MODULES:  # click names one that is like a misspelled name
            self.add_command(getattr(import_module(f"sitscad.cli.{MODULES[name]}"), name))
        return super().get_command(ctx, cmd_name)


@click.group(
    cls=Commands, context_settings=SETTINGS,
    epilog="\b\nExample:\n  sitscad new grasper_4layer && sitscad build grasper_4layer.yaml",
)
@click.version_option(sitscad.__version__, prog_name="sitscad", message="%(prog)s %(version)s")
def cli() -> None:
    """From one YAML spec to inductive tactile sensors that can be ordered: for a jaw, a fingertip or the bench."""


__all__ = ["cli", "main", "run"]
