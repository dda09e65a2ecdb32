"""Parts shared by all commands: options, usage errors, results to stdout, messages and progress to stderr."""

from __future__ import annotations

import contextlib
import difflib
import inspect
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click

import sitscad
from sitscad.basics.units import escape_controls
from sitscad.package.folder import write_file

HELP_IS_GONE = "Python runs with -OO (PYTHONOPTIMIZE=2), which takes the help texts away."
"""Help text of every command if Python runs without docstrings."""


class Example(click.Command):
    """A command whose help ends with one example.

    Explanations in `details` stand before the exit codes, which are the last paragraph of its docstring.
    """

    def __init__(self, name: str | None, *, example: str, details: str = "", **kwargs: Any) -> None:
        text = kwargs["help"] or HELP_IS_GONE
        says, codes, last = inspect.cleandoc(text).rpartition("\n\nExit code")
        whole_text = f"{says}\n\n{details.strip()}{codes}{last}" if details else text
        super().__init__(name, **{**kwargs, "help": whole_text, "epilog": f"\b\nExample:\n  {example}"})


class Names(click.ParamType):
    """Option value of names, separated by commas."""

    name = "name,..."

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, ...]:
        """Return the names, without the blanks around them."""
        return value if isinstance(value, tuple) else tuple(part.strip() for part in value.split(",") if part.strip())


class InRange(click.FloatRange):
    """Option value of a number in a range. It refuses nan, which click accepts."""

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """Return the number."""
        number = float(super().convert(value, param, ctx))
        if number != number:
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


RELATIVE_ERROR = InRange(0, 1, min_open=True)
DAY = 86_400.0  # Longest waiting or reading time of a command (s)


def _use_plugins(_: click.Context, __: click.Parameter, files: tuple[str, ...]) -> None:
    """Activate the installed plugins, and the plugins in the named files."""
    sitscad.use_installed_plugins()
    for file in files:
        sitscad.use_plugin(file)


JOBS = click.option(
    "--jobs", type=click.IntRange(1),
    help="Processes for several specs (default: all processors); with 2, one spec's solids are built in parallel.",
)
PLUGIN = click.option(
    "--plugin", multiple=True, metavar="FILE", type=click.Path(), expose_value=False, is_eager=True,
    callback=_use_plugins, help="A Python file with your own rules or writers.",
)
BASELINE = click.option(
    "--baseline", metavar="FILE", help="Stored output of check --format json: its findings do not fail again."
)


def row_of(table: Any, name: str, option: str) -> Any:
    """Return the value of `table` for `name`. For another name, raise a usage error that lists the names.

    The error is about the option `option`.
    """
    if name not in table:
        message = f"{name!r} is not one of {', '.join(table)}.{suggestion(name, table)}"
        raise click.BadParameter(message, param_hint=option)
    return table[name]


def suggestion(name: str, names: Iterable[str]) -> str:
    """Return a sentence that proposes the known name (`names`) nearest to `name`. Empty if none is similar."""
    near = difflib.get_close_matches(name.lower(), list(names), n=1)
    return f" Did you mean {near[0]}?" if near else ""


def print_message(message: str) -> None:
    """Print a message to stderr, after the name of the program. Control characters in it are escaped."""
    click.echo("\n".join(map(escape_controls, f"sitscad: {message}".split("\n"))), err=True)


def progress_of(what: str) -> Callable[[int, int], None] | None:
    """Return a function that shows the progress of `what` on one line of a terminal. None if stderr is no terminal.

    The function takes the number that is done, and the total number.
    """
    if not sys.stderr.isatty():
        return None
    return lambda done, of: click.echo(f"\r  {done} of {of} {what}{chr(10) if done >= of else ''}", err=True, nl=False)


REPORT_INTERVAL = 10.0
"""Seconds between two lines about work that takes long, if no terminal shows it on one line."""


@contextlib.contextmanager
def report_work(what: str, is_long: bool) -> Iterator[Callable[[str], None]]:
    """Report the work `what` and its duration on stderr until the context ends, if `is_long`.

    On a terminal, one line is updated each second. Otherwise a line is printed every `REPORT_INTERVAL` seconds. Yields
    a function that takes a text about the present step.
    """
    on_terminal, done, began, steps = sys.stderr.isatty(), threading.Event(), time.monotonic(), [""]

    def tell() -> None:
        while not done.wait(1.0 if on_terminal else REPORT_INTERVAL):
            line = f"{what}: {time.monotonic() - began:.0f} s{f', {steps[0]}' if steps[0] else ''}"
            if on_terminal:
                click.echo(f"\r\033[K  {escape_controls(line)[: max(columns() - 3, 20)]}", err=True, nl=False)
            else:
                print_message(line)

    def step(line: str) -> None:
        steps[0] = line

    thread = threading.Thread(target=tell, daemon=True)
    if is_long:
        thread.start()
    try:
        yield step
    finally:
        done.set()
        if is_long:
            thread.join()
        if is_long and on_terminal:
            click.echo("\r\033[K", err=True, nl=False)


def write_output(path: str | Path, content: bytes) -> None:
    """Write a file of a command's result."""
    write_file(path, content)


def print_result(text: str) -> None:
    """Print a result to stdout, unchanged."""
    click.echo(text, nl=not text.endswith("\n"), color=True)


def coloured(stream: Any) -> bool:
    """Whether text on a stream is printed in colours."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def columns() -> int:
    """Return the width of the terminal in characters, or the number in COLUMNS if it is set. 80 if both are unknown."""
    number = os.environ.get("COLUMNS", "")
    if number.isdigit() and int(number):
        return int(number)
    with contextlib.suppress(OSError):
        return os.get_terminal_size().columns or 80
    return 80
