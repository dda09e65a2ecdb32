"""What commands share: their options, what they refuse, results to stdout, messages and progress to stderr.

What a command does is in other rooms, which it imports when it runs: none loads what another one needs.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

import click

import sitscad
from sitscad.basics.finding import Severity
from sitscad.basics.units import counted

if TYPE_CHECKING:
    from sitscad import SensorSpec
    from sitscad.checks.findings import CheckedSpec, OutputOptions
    from sitscad.checks.policy import Baseline


HELP_IS_GONE = "Python runs with -OO (PYTHONOPTIMIZE=2), which takes the help texts away."
"""Help text of every command if Python runs without docstrings."""


class Example(click.Command):
    """A command whose help ends with one example; what its `words` mean stands before its exit codes, the last
    paragraph of its docstring.
    """

    def __init__(self, name: str | None, *, example: str, words: str = "", **kwargs: Any) -> None:
        text = kwargs["help"] or HELP_IS_GONE
        says, codes, last = inspect.cleandoc(text).rpartition("\n\nExit code")
        said = f"{says}\n\n{words.strip()}{codes}{last}" if words else text
        super().__init__(name, **{**kwargs, "help": said, "epilog": f"\b\nExample:\n  {example}"})


class Names(click.ParamType):
    """Comma-separated names."""

    name = "name,..."

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, ...]:
        """The names without blanks."""
        return value if isinstance(value, tuple) else tuple(part.strip() for part in value.split(",") if part.strip())


class InRange(click.FloatRange):
    """A number in a range; nan, which lies in no range and which click lets through, is none."""

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """The number."""
        found = float(super().convert(value, param, ctx))
        if found != found:
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return found


RELATIVE_ERROR = InRange(0, 1, min_open=True)
DAY = 86_400.0  # Seconds at most that a command waits or reads for


def _use_plugins(_: click.Context, __: click.Parameter, files: tuple[str, ...]) -> None:
    """Put installed plugins in force, and those of the files that are named."""
    sitscad.use_installed_plugins()
    for file in files:
        sitscad.use_plugin(file)


JOBS = click.option(
    "--jobs", type=click.IntRange(1),
    help="Processes for several specs (default: the processors); 2 build one spec's solids beside all else.",
)
PLUGIN = click.option(
    "--plugin", multiple=True, metavar="FILE", type=click.Path(), expose_value=False, is_eager=True,
    callback=_use_plugins, help="A Python file with rules or writers of your own.",
)
BASELINE = click.option(
    "--baseline", metavar="FILE", help="What check --format json printed: what it holds does not fail again."
)


def specs_of(paths: Iterable[str]) -> list[str]:
    """The specs that are named, those of folders among them."""
    from sitscad.checks.findings.text import printable
    from sitscad.checks.opening import specs_in

    def skip(path: str) -> None:
        say(f"{printable(path)} is a study and is skipped (sitscad design {printable(path)})")

    try:
        return specs_in(list(paths), skip)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def baseline_of(path: str | None) -> Baseline | None:
    """The findings that a file holds; None where no file is named."""
    from sitscad.checks.policy import read_baseline

    return None if path is None else read_baseline(path)


def warn_of_unknown_specs(baseline: Baseline | None, checked: Iterable[CheckedSpec]) -> None:
    """Say which specs a baseline knows nothing of, where they have findings: none of these was known before."""
    for spec in checked:
        if baseline is not None and spec.findings and not baseline.holds(spec.path, spec.name):
            which = f"no spec{f' named {spec.name}' if spec.name else ''} at this path"
            say(f"{spec.path}: {baseline.named} holds {which} (its paths count from its own folder)")


def rules_for(pattern: str) -> list[Any]:
    """The rules that a pattern stands for; a usage error where it is none."""
    from sitscad.checks.judging import all_rules
    from sitscad.checks.policy import stands_for

    known = all_rules()
    found = [rule for rule in known if stands_for(pattern, rule.id, rule.name)]
    if not found:
        meant = _meant(pattern, (r.name for r in known))
        raise click.UsageError(f"There is no rule {pattern!r}.{meant} `sitscad rules` lists them all.")
    return found


def row_of(table: Any, name: str, option: str) -> Any:
    """A row of a table of formats or methods; a usage error that lists them for any other name."""
    if name not in table:
        raise click.BadParameter(f"{name!r} is not one of {', '.join(table)}.{_meant(name, table)}", param_hint=option)
    return table[name]


def _meant(name: str, known: Iterable[str]) -> str:
    """A sentence that names the known one nearest to a name; empty where none is near."""
    import difflib

    near = difflib.get_close_matches(name.lower(), list(known), n=1)
    return f" Did you mean {near[0]}?" if near else ""


def say(message: str) -> None:
    """Print a message to stderr, under the name of the program; control characters in it are escaped."""
    from sitscad.checks.findings.text import printable

    click.echo("\n".join(map(printable, f"sitscad: {message}".split("\n"))), err=True)


def progress_of(what: str) -> Callable[[int, int], None] | None:
    """What shows on one line of a terminal how many of some things are done; None where there is no terminal."""
    if not sys.stderr.isatty():
        return None
    return lambda done, of: click.echo(f"\r  {done} of {of} {what}{chr(10) if done >= of else ''}", err=True, nl=False)


TOLD_EVERY = 10.0
"""Seconds between two lines about work that takes long, if no terminal shows it on one line."""


@contextlib.contextmanager
def work_told(what: str, is_long: bool) -> Iterator[Callable[[str], None]]:
    """Say on stderr what is at work and for how long: each second on one line of a terminal, else in a line from time
    to time. Yields the function that takes the present step, in words. Of work that is not long nothing is said.
    """
    import threading
    import time

    from sitscad.checks.findings.text import printable

    on_terminal, done, began, steps = sys.stderr.isatty(), threading.Event(), time.monotonic(), [""]

    def tell() -> None:
        while not done.wait(1.0 if on_terminal else TOLD_EVERY):
            words = f"{what}: {time.monotonic() - began:.0f} s{f', {steps[0]}' if steps[0] else ''}"
            if on_terminal:
                import shutil

                width = max(shutil.get_terminal_size().columns - 3, 20)
                click.echo(f"\r\033[K  {printable(words)[:width]}", err=True, nl=False)
            else:
                say(words)

    def step(words: str) -> None:
        steps[0] = words

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


def print_result(text: str) -> None:
    """A result: to stdout, as it is."""
    click.echo(text, nl=not text.endswith("\n"), color=True)


def coloured(stream: Any) -> bool:
    """Whether what goes to a stream is to have colours."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def layout_of(stream: Any, named: bool = False, **asked: Any) -> OutputOptions:
    """How findings are laid out on a stream: with colours or not, and folded at the terminal's width or the columns
    that COLUMNS names; not folded in a pipe, where a finding stays one line for whatever searches it.
    """
    from sitscad.checks.findings import OutputOptions

    is_folded, width = stream.isatty() or os.environ.get("COLUMNS", "").isdigit(), None
    if is_folded:
        import shutil  # loads archives of all kinds

        width = shutil.get_terminal_size().columns
    return OutputOptions(coloured(stream), named=named, width=width, **asked)


def show_findings(checked: list[CheckedSpec], named: bool = False) -> None:
    """Findings as text to stderr, where they are a message and not the result; each line names its spec if `named`."""
    from sitscad.checks.findings import FINDING_FORMATS

    click.echo(FINDING_FORMATS["text"](checked, layout_of(sys.stderr, named)), err=True, nl=False, color=True)


def show_unreadable(path: str, error: sitscad.SpecError) -> None:
    """What is wrong with a spec that cannot be read, as text to stderr."""
    from sitscad.package.inspection import unreadable

    show_findings([unreadable(path, error)])


def spec_of(path: str) -> SensorSpec | None:
    """The spec of a file, under the configuration above it; None where it cannot be read, and then that is said."""
    from sitscad.checks.opening import opened, policy_for

    try:
        return opened(path, policy_for(path))
    except sitscad.SpecError as error:
        show_unreadable(path, error)
        return None


def exit_code_of(checked: CheckedSpec, path: str) -> int:
    """Say that the checks found errors where they did; the exit code."""
    if not checked.ok:
        say(f"the checks found {counted(checked.count(Severity.ERROR), 'error')}: sitscad check {path}")
    return checked.exit_code
