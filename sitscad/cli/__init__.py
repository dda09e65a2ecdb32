"""The command line: it reads arguments and returns exit codes. Other folders do the work of the commands."""

from __future__ import annotations

import ctypes
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
from sitscad.basics.errors import ExpectedError
from sitscad.cli.terminal import print_message
from sitscad.data import DataError

ISSUES = "the project's issue tracker"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command line and exit with its code. No exception reaches the user."""
    # The matrices are small: threads in the linear algebra would wait for each other, at twice the processor time
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    keep_freed_memory()
    gc.set_threshold(200_000)  # a short command frees little: garbage collection costs some per cent
    prepare_streams()
    code = run(arguments)
    gc.freeze()  # the process ends: a last garbage collection would cost some per cent
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

    Without this, the next file that is opened would get the number of the closed stream. Text that a library prints to
    the stream would then be written into this file.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_RDWR)  # the lowest free number: that of the closed stream
            os.set_inheritable(descriptor, True)
            setattr(sys, name, os.fdopen(descriptor, "r" if name == "stdin" else "w"))
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if type(sys.stderr) is io.TextIOWrapper:  # not a stream that a program, such as a test, has set
        encoding = sys.stderr.encoding
        sys.stderr = Messages(sys.stderr.detach(), encoding, "backslashreplace", line_buffering=True)


KEPT_BYTES, MAPPED = 256 << 20, 32 << 20
"""Bytes of freed memory that the process keeps, and array size (bytes) above which memory is mapped separately.

The second is the largest value that the C library accepts (mallopt(3)).
"""

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers by which malloc.h names the two settings of `keep_freed_memory`."""


def keep_freed_memory() -> bool:
    """Set the C library to keep freed memory for this process's next arrays. Return whether this succeeded.

    Otherwise the system allocates and clears every array of some hundred kilobytes, which takes a tenth to a fifth of a
    check's time. The settings work with GNU's library on Linux. On other systems, nothing is changed.
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all([mallopt(_MMAP_THRESHOLD, MAPPED), mallopt(_TRIM_THRESHOLD, KEPT_BYTES)])


def run(arguments: Sequence[str] | None) -> int:
    """Return the exit code of one command line. Print a message for every error."""
    try:
        code = cli.main(arguments, prog_name="sitscad", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return 2
    except (KeyboardInterrupt, click.Abort):
        print_message("interrupted; what was finished is kept")
        return 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - the rest of the stream cannot be written either
        return 141
    except OSError as error:
        if os.environ.get("SITSCAD_TRACEBACK"):
            raise
        print_message(f"cannot read or write: {error}")
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - the rest of the stream cannot be written either
        return 2
    except Exception as error:
        return report_error(error)


def report_error(error: Exception) -> int:
    """Print a sentence for an expected error, or a request to report an unexpected error. Return the exit code."""
    if os.environ.get("SITSCAD_TRACEBACK"):
        raise error
    if isinstance(error, (DataError, ExpectedError)):
        print_message(str(error))
    elif isinstance(error, UnicodeEncodeError):
        what = ascii(error.object[error.start : error.end])
        print_message(
            f"{what} in a file's name cannot be written as text ({error.encoding}): rename it, or set PYTHONUTF8=1")
    elif type(error).__name__ == "BrokenProcessPool":  # from concurrent.futures, which few commands load
        print_message(
            "a process ended without a word (too little memory, or ended by a plugin or somebody): --jobs 1 shows more")
    elif isinstance(error, sitscad.PartsError):
        print_message(f"a part cannot be made: {error}")
        return 1
    else:
        print_message(
            f"internal error: {type(error).__name__}: {error}\n"
            f"This is a fault of sitscad {sitscad.__version__}, not of your spec. Please report it in {ISSUES}, with "
            "the spec and the output of the same command run with SITSCAD_TRACEBACK=1 in its environment."
        )
    return 2


SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


COMMANDS = {
    "new": ("starting", "Write a commented spec to start from."),
    "check": ("checking", "Check SPECS against every rule that applies."),
    "watch": ("reading", "Report what every save of SPEC changes, until Ctrl-C."),
    "coil": ("lone_coil", "Print inductance, resistance and quality factor of one planar coil."),
    "estimate": ("estimating", "Print the electrical figures of SPEC."),
    "response": ("estimating", "Print the coil readings at poses and under loads."),
    "calibrate": ("calibrating", "Plan a calibration, or fit the points of DATA."),
    "read": ("reading", "Set up a board's converters and print a line for each scan, or a diagnosis."),
    "sweep": ("designing", "Print figures of every design of a product of ranges."),
    "design": ("designing", "Find the designs that meet STUDY best."),
    "build": ("building", "Check SPECS, then write their packages."),
    "explain": ("checking", "Explain RULES: their condition, reason, remedy and source."),
    "rules": ("checking", "List every rule with its severities."),
    "measures": ("designing", "List the figures of a design for sweeps and studies."),
    "schema": ("starting", "Print the JSON Schema of the spec."),
    "verify": ("verifying", "Read a finished package back and compare its parts."),
}
"""Module and first sentence of each command, in the usual order of use.

A command line imports the module of its own command only. `sitscad --help` imports none: they take 0.24 s together.
"""


class Commands(click.Group):
    """The commands of `COMMANDS`. Until a command is run, only its first sentence is known."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands, in the usual order of use."""
        return list(COMMANDS)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Import and return the command that the arguments begin with."""
        name, command, rest = super().resolve_command(ctx, args)
        if name is not None:
            command = getattr(import_module(f"sitscad.cli.{COMMANDS[name][0]}"), name)
        return name, command, rest


@click.group(
    cls=Commands, context_settings=SETTINGS,
    commands={name: click.Command(name, help=text) for name, (_, text) in COMMANDS.items()},
    epilog="\b\nExample:\n  sitscad new grasper_4layer && sitscad build grasper_4layer.yaml",
)
@click.version_option(sitscad.__version__, prog_name="sitscad", message="%(prog)s %(version)s")
def cli() -> None:
    """Generate all files of an inductive tactile sensor from one YAML spec, for a jaw, a fingertip or a test bench."""


__all__ = ["cli", "main", "run"]
