"""Parts shared by all commands: options, errors of usage, results to stdout, messages and progress to stderr.

The work of a command is in other modules, which its function imports when it runs. The help of all commands, and a
command that needs few modules, therefore start at once. The same holds for large modules of the standard library.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import sitscad
from sitscad.basics.finding import Severity
from sitscad.basics.units import counted, printable

if TYPE_CHECKING:
    from sitscad import SensorSpec
    from sitscad.checks.findings import CheckedSpec, OutputOptions
    from sitscad.checks.policy import Baseline


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
    """Comma-separated names."""

    name = "name,..."

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, ...]:
        """Return the names without blanks."""
        return value if isinstance(value, tuple) else tuple(part.strip() for part in value.split(",") if part.strip())


class InRange(click.FloatRange):
    """A number in a range. It refuses nan, which click accepts."""

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


def specs_of(paths: Iterable[str]) -> list[str]:
    """Return the paths of the named specs, and of all specs in named folders."""
    from sitscad.checks.opening import specs_in

    def skip(path: str) -> None:
        print_message(f"{printable(path)} is a study and is skipped (sitscad design {printable(path)})")

    try:
        return specs_in(list(paths), skip)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def baseline_of(path: str | None) -> Baseline | None:
    """Return the findings in a baseline file. None if no file is named."""
    from sitscad.checks.policy import read_baseline

    return None if path is None else read_baseline(path)


def warn_of_unknown_specs(baseline: Baseline | None, checked: Iterable[CheckedSpec]) -> None:
    """Print a message on each spec with findings that the baseline does not list."""
    for spec in checked:
        if baseline is not None and spec.findings and not baseline.holds(spec.path, spec.name):
            which = f"no spec{f' named {spec.name}' if spec.name else ''} at this path"
            print_message(f"{spec.path}: {baseline.named} holds {which} (its paths count from its own folder)")


def rules_for(pattern: str) -> list[Any]:
    """Return the rules that match a pattern. Raises a usage error if there are none."""
    from sitscad.checks.judging import all_rules
    from sitscad.checks.policy import stands_for

    rules = all_rules()
    matching = [rule for rule in rules if stands_for(pattern, rule.id, rule.name)]
    if not matching:
        suggestion = _suggestion(pattern, (r.name for r in rules))
        raise click.UsageError(f"There is no rule {pattern!r}.{suggestion} `sitscad rules` lists them all.")
    return matching


def row_of(table: Any, name: str, option: str) -> Any:
    """Return a row of a table of formats or methods. Raises a usage error that lists the names for any other name."""
    if name not in table:
        message = f"{name!r} is not one of {', '.join(table)}.{_suggestion(name, table)}"
        raise click.BadParameter(message, param_hint=option)
    return table[name]


def _suggestion(name: str, names: Iterable[str]) -> str:
    """Return a sentence that names the known name nearest to `name`. Empty if none is similar."""
    import difflib  # loaded for misspelled words only

    near = difflib.get_close_matches(name.lower(), list(names), n=1)
    return f" Did you mean {near[0]}?" if near else ""


def print_message(message: str) -> None:
    """Print a message to stderr, after the name of the program. Control characters in it are escaped."""
    click.echo("\n".join(map(printable, f"sitscad: {message}".split("\n"))), err=True)


def progress_of(what: str) -> Callable[[int, int], None] | None:
    """Return a function that shows progress on one line of a terminal. None if stderr is no terminal."""
    if not sys.stderr.isatty():
        return None
    return lambda done, of: click.echo(f"\r  {done} of {of} {what}{chr(10) if done >= of else ''}", err=True, nl=False)


TOLD_EVERY = 10.0
"""Seconds between two lines about work that takes long, if no terminal shows it on one line."""


@contextlib.contextmanager
def report_work(what: str, is_long: bool) -> Iterator[Callable[[str], None]]:
    """Report the work and its duration on stderr while the context is active, if `is_long`.

    On a terminal, one line is updated each second. Otherwise a line is printed every `TOLD_EVERY` seconds. Yields the
    function that takes a text on the present step.
    """
    on_terminal, done, began, steps = sys.stderr.isatty(), threading.Event(), time.monotonic(), [""]

    def tell() -> None:
        while not done.wait(1.0 if on_terminal else TOLD_EVERY):
            line = f"{what}: {time.monotonic() - began:.0f} s{f', {steps[0]}' if steps[0] else ''}"
            if on_terminal:
                click.echo(f"\r\033[K  {printable(line)[: max(_columns() - 3, 20)]}", err=True, nl=False)
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
    from sitscad.package.folder import write_file

    write_file(path, content)


def print_result(text: str) -> None:
    """Print a result to stdout, unchanged."""
    click.echo(text, nl=not text.endswith("\n"), color=True)


def coloured(stream: Any) -> bool:
    """Whether output to a stream has colours."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _columns() -> int:
    """Return the number of columns of the terminal."""
    import shutil  # loads archive modules

    return shutil.get_terminal_size().columns


def layout_of(stream: Any, named: bool = False, **options: Any) -> OutputOptions:
    """Return the layout of findings on a stream: colours and line width.

    Lines are wrapped at the terminal's width, or at the number of columns in COLUMNS. In a pipe they are not wrapped,
    so that a search finds a finding on one line.
    """
    from sitscad.checks.findings import OutputOptions

    is_folded = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    width = _columns() if is_folded else None
    return OutputOptions(coloured(stream), named=named, width=width, **options)


def show_findings(checked: list[CheckedSpec], named: bool = False) -> None:
    """Print findings as text to stderr, as messages besides a result. Each line names its spec if `named`."""
    from sitscad.checks.findings import FINDING_FORMATS

    click.echo(FINDING_FORMATS["text"](checked, layout_of(sys.stderr, named)), err=True, nl=False, color=True)


def show_unreadable(path: str, error: sitscad.SpecError) -> None:
    """Print the errors of a spec that cannot be read, as text to stderr."""
    from sitscad.package.inspection import unreadable

    show_findings([unreadable(path, error)])


def spec_of(path: str) -> SensorSpec | None:
    """Return the spec of a file, under the configuration above it. None, with a message, if it cannot be read."""
    from sitscad.checks.opening import opened, policy_for

    try:
        return opened(path, policy_for(path))
    except sitscad.SpecError as error:
        show_unreadable(path, error)
        return None


def exit_code_of(checked: CheckedSpec, path: str) -> int:
    """Return the exit code of a check. Print a message if the check found errors."""
    if not checked.ok:
        print_message(f"the checks found {counted(checked.count(Severity.ERROR), 'error')}: sitscad check {path}")
    return checked.exit_code
