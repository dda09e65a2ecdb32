"""What commands say: results to stdout, messages and progress to stderr."""

from __future__ import annotations

import os
import shutil
import sys
from typing import TYPE_CHECKING, Any

import click

import sitscad
from sitscad.finding import Severity

if TYPE_CHECKING:
    from sitscad import CheckedSpec, Manner, SensorSpec


def say(message: str) -> None:
    """A message: to stderr, under the name of the program."""
    click.echo(f"sitscad: {message}", err=True)


def counted(count: int, what: str) -> str:
    """A number of things, in the plural where there is not one."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def coloured(stream: Any) -> bool:
    """Whether what goes to a stream is to have colours."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def manner(stream: Any, fail_on: Severity = Severity.ERROR, verbose: bool = False) -> Manner:
    """How findings are told on a stream; paths count from the repository's root where a CI server says which it is."""
    root = os.environ.get("GITHUB_WORKSPACE") or os.environ.get("CI_PROJECT_DIR") or "."
    rules = tuple(sitscad.all_rules())
    return sitscad.Manner(coloured(stream), rules, fail_on, root, verbose=verbose, width=width_of(stream))


def width_of(stream: Any) -> int | None:
    """Columns at which text is folded: the terminal's, or those that COLUMNS names; None in a pipe, where a finding
    stays one line for whatever searches it.
    """
    if stream.isatty() or os.environ.get("COLUMNS", "").isdigit():
        return shutil.get_terminal_size().columns
    return None


def print_result(text: str) -> None:
    """A result: to stdout, as it is."""
    click.echo(text, nl=not text.endswith("\n"), color=True)


def progress(stage: str, outcome: str, seconds: float) -> None:
    """A line a stage on a terminal, overwritten when the stage is done."""
    colour = coloured(sys.stderr)
    if outcome == "start":
        click.echo(f"  {stage} ...", err=True, nl=False)
    else:
        text = click.style(f"{outcome:<8}", fg="green" if outcome == "made" else None, dim=outcome != "made")
        click.echo(f"\r  {stage:<9} {text if colour else f'{outcome:<8}'} {seconds:6.2f} s", err=True, color=colour)


def show_findings(checked: list[CheckedSpec], named: bool = False) -> None:
    """Findings as text to stderr, where they are a message and not the result; `named` as of `sitscad.Manner`."""
    manner = sitscad.Manner(coloured(sys.stderr), named=named, width=width_of(sys.stderr))  # no rules' texts
    text = sitscad.FINDING_FORMATS["text"](checked, manner)
    click.echo(text, err=True, nl=False, color=True)


def opened_or_told(path: str) -> SensorSpec | None:
    """The spec of a file, under the configuration above it; None where it cannot be read, and then that is said."""
    try:
        return sitscad.opened(path, sitscad.policy_for(path))
    except sitscad.SpecError as error:
        show_findings([sitscad.unreadable(path, error)])
        return None


def told_errors(checked: CheckedSpec, path: str) -> int:
    """Say that the checks found errors where they did; the exit code."""
    if not checked.ok:
        say(f"the checks found {counted(checked.count(Severity.ERROR), 'error')}: sitscad check {path}")
    return checked.exit_code
