"""Parts shared by commands that read specs: paths, baselines, findings on stderr, and exit codes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import Any

import click

from sitscad.basics.finding import Severity
from sitscad.basics.units import count_text, escape_controls
from sitscad.checks.findings import FINDING_FORMATS, CheckedSpec, OutputOptions
from sitscad.checks.opening import check_unreadable, find_specs, nearest_policy_of_spec, open_spec
from sitscad.checks.policy import Baseline, read_baseline
from sitscad.cli.terminal import coloured, columns, print_message
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec


def specs_of(paths: Iterable[str]) -> list[str]:
    """Return the paths of the named specs, and of all specs in the named folders."""
    def skip(path: str) -> None:
        print_message(f"{escape_controls(path)} is a study and is skipped (sitscad design {escape_controls(path)})")

    try:
        return find_specs(list(paths), skip)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def baseline_of(path: str | None) -> Baseline | None:
    """Return the findings in a baseline file. None if no file is named."""
    return None if path is None else read_baseline(path)


def warn_of_unknown_specs(baseline: Baseline | None, checked: Iterable[CheckedSpec]) -> None:
    """Print a message for each spec that has findings, but is not in the baseline."""
    for spec in checked:
        if baseline is not None and spec.findings and not baseline.holds(spec.path, spec.name):
            which = f"no spec{f' named {spec.name}' if spec.name else ''} at this path"
            print_message(f"{spec.path}: {baseline.file_name} holds {which} (its paths count from its own folder)")


def layout_of(stream: Any, named: bool = False, **options: Any) -> OutputOptions:
    """Return the options for the output of findings on a stream, with its colours and line width.

    Lines are wrapped at the terminal's width, or at the number of columns in COLUMNS. In a pipe, they are not wrapped,
    so that a search finds a finding on one line. `named` and `options` are fields of `OutputOptions`.
    """
    is_folded = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    width = columns() if is_folded else None
    return OutputOptions(coloured(stream), has_names=named, width=width, **options)


def show_findings(checked: list[CheckedSpec], named: bool = False) -> None:
    """Print findings as text to stderr, beside the command's result. Each line names its spec if `named`."""
    click.echo(FINDING_FORMATS["text"](checked, layout_of(sys.stderr, named)), err=True, nl=False, color=True)


def show_unreadable(path: str, error: SpecError) -> None:
    """Print the errors of a spec that cannot be read, as text to stderr."""
    show_findings([check_unreadable(path, error)])


def spec_of(path: str) -> SensorSpec | None:
    """Return the spec in a file, read with the configuration above it. None, after a message, if it cannot be read."""
    try:
        return open_spec(path, nearest_policy_of_spec(path))
    except SpecError as error:
        show_unreadable(path, error)
        return None


def exit_code_of(checked: CheckedSpec, path: str) -> int:
    """Return the exit code for a checked spec. Print a message if the check found errors."""
    if not checked.ok:
        print_message(f"the checks found {count_text(checked.count(Severity.ERROR), 'error')}: sitscad check {path}")
    return checked.exit_code
