"""`sitscad measures`, `sweep` and `design`: figures of many designs, and the best designs."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import sys
import time
from collections import defaultdict
from dataclasses import replace

import click

from sitscad.apps.study.answer_text import answer_json, answer_text, search_text, yields_text
from sitscad.apps.study.evaluating import dask_cluster
from sitscad.apps.study.page import answer_files, progress_page
from sitscad.apps.study.running import Progress as StudyProgress
from sitscad.apps.study.running import StudyResults, StudyState
from sitscad.apps.study.space import RangeError
from sitscad.apps.study.spreads import DRAWS
from sitscad.apps.study.study import Study, StudyAnswer
from sitscad.apps.study.sweeping import (
    MEASURE_FORMATS,
    SWEEP_FILES,
    SWEEP_FORMATS,
    parse_range,
    sweep_as_written,
    value_text,
)
from sitscad.basics.units import count_text
from sitscad.checks.opening import check_unreadable
from sitscad.cli.specs import show_findings, show_unreadable, spec_of
from sitscad.cli.terminal import Example, print_message, print_result, progress_of, row_of, write_output
from sitscad.spec.reading import SpecError


@click.command(cls=Example, example="sitscad measures")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
def measures(format_name: str) -> int:
    """List the figures of a design for sweeps and studies."""
    print_result(row_of(MEASURE_FORMATS, format_name, "--format")())
    return 0


@click.command(cls=Example, example="sitscad sweep sensor.yaml coil.turns=6:12:13 --measure rp -o turns.svg")
@click.argument("spec", type=click.Path())
@click.argument("ranges", nargs=-1, required=True, metavar="KEY=FIRST:LAST:COUNT...")
@click.option("--measure", "names", multiple=True, metavar="NAME", help="One of `sitscad measures` (default: all).")
@click.option("--level", default="screen", show_default=True, metavar="screen|full",
              help="Quick estimates, or everything that `check` computes.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Write a file: .csv, .npz, .json or .svg.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|csv|json")
@click.option("--jobs", type=click.IntRange(1), help="Processes (default: the processors).")
def sweep(
    spec: str, ranges: tuple[str, ...], names: tuple[str, ...], level: str, output: str | None, format_name: str,
    jobs: int | None,
) -> int:
    """Print figures of every design of a product of ranges.

    A range is KEY=FIRST:LAST:COUNT or KEY=VALUE,VALUE, with keys and values as in SPEC: coil.layers=2,4 or
    coil.trace_width=70um:110um:9. The last range changes fastest.

    \b
    Columns:
      the keys       as in a spec.
      NAME           The figure with +- its error. Files have SI units, with
                     the error under NAME.error.
      verdict        ok, fails, or unknown if the screen cannot decide.
      refused_by     The rules that find an error.
      warned_by      The rules that warn and find no error.

    A picture (.svg) shows a curve with its band of error for one key, and a field with the edges of the refused designs
    for two keys. Exit code: 0, or 2 if the spec or a range cannot be read.
    """  # noqa: D301 - click needs the control character itself
    show, write = row_of(SWEEP_FORMATS, format_name, "--format"), None
    if output:
        write = row_of(SWEEP_FILES, os.path.splitext(output)[1].lower(), "-o")
    loaded = spec_of(spec)
    if loaded is None:
        return 2
    try:
        values = dict(map(parse_range, ranges))
        if len(values) < len(ranges):
            raise click.UsageError("a key is swept once")
        progress = progress_of("designs")
        table = sweep_as_written(loaded.source, values, names or None, level=level, jobs=jobs, progress=progress)
        content = write(table) if write is not None else b""
    except RangeError as error:
        raise click.UsageError(f"{error}{f' ({error.hint})' if error.hint else ''}") from error
    except SpecError as error:
        show_unreadable(spec, error)
        return 2
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if output:
        write_output(output, content)
        print_message(f"wrote {output}: {count_text(len(table), 'design')}")
    else:
        print_result(show(table))
    return 0


STUDY_FILES = """
\b
Files:
  designs/1.yaml, ...  the kept designs, as whole specs for `build`.
  front.csv            every design that no other design beats.
  study.html           the whole answer as a page, with an interactive front.
  study.json           the whole answer, for programs.
  archive.jsonl        every evaluated design: the same command continues
                       from there, and ends with the same files.
"""


@click.command(cls=Example, details=STUDY_FILES, example="sitscad design study.yaml --jobs 2")
@click.argument("study", type=click.Path())
@click.option("-o", "--output", type=click.Path(file_okay=False),
              help="Folder of the files (default: outputs/NAME-study).")
@click.option("--jobs", type=click.IntRange(1), help="Processes (default: the processors).")
@click.option("--scheduler", metavar="ADDRESS", help="Evaluate on the workers of this Dask scheduler: tcp://...")
@click.option("--again", is_flag=True, help="Evaluate everything anew; ignore the archive.")
@click.option("--no-yield", is_flag=True, help="Omit the yields of kept designs, which take most of the time.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
def design(
    study: str, output: str | None, jobs: int | None, scheduler: str | None, again: bool, no_yield: bool,
    format_name: str,
) -> int:
    """Find the designs that meet STUDY best.

    STUDY is a file beside a spec. It names the keys that vary, the figures to minimize or maximize, and the limits
    (`sitscad new --study` writes one, docs/studies.md explains it). Every rule of `check` applies. The answer is
    printed after the search, and the yields of its designs when they are computed.

    Exit code: 0 a design meets everything, 1 none was found, 2 the study cannot be read.
    """
    row_of({"text": "", "json": ""}, format_name, "--format")
    try:
        loaded = Study.load(study)
    except SpecError as error:
        inspection = check_unreadable(study, error, "none")  # no command applies fixes to a study
        findings = tuple(replace(finding, fixes=()) for finding in inspection.findings)
        show_findings([replace(inspection, findings=findings)])
        return 2
    folder = output or os.path.join("outputs", loaded.name if loaded.name.endswith("study") else f"{loaded.name}-study")
    executor = None
    reported: list[StudyAnswer] = []
    if scheduler is not None:
        try:
            executor, jobs = dask_cluster(scheduler)
        except ValueError as error:
            raise click.BadParameter(str(error), param_hint="--scheduler") from error

    def before_yields(answer: StudyAnswer) -> None:
        _write(answer, folder)
        reported.append(answer)
        if format_name == "text":
            print_result(search_text(answer))
        print_message(f"wrote {folder}; now the yield of {count_text(len(answer.kept), 'design')}, {DRAWS} units each "
                      "(--no-yield leaves it out)")

    try:
        answer = loaded.run(executor, folder=folder, jobs=jobs, again=again, progress=_study_progress(),
                           draws=0 if no_yield else DRAWS, before_yields=before_yields,
                           interrupted=lambda unfinished: _write_so_far(loaded, unfinished, folder))
    except KeyboardInterrupt:
        options = {"-o": output, "--scheduler": scheduler, "--jobs": jobs if scheduler is None else None,
                   "--format": format_name if format_name != "text" else None}
        arguments = [str(word) for option, value in options.items() if value is not None for word in (option, value)]
        command = shlex.join(["sitscad", "design", study, *arguments, *(["--no-yield"] if no_yield else [])])
        print_message(f"interrupted; {folder} keeps what was worked out, and this goes on from there: {command}")
        return 130
    _write(answer, folder)
    if answer.results.damaged:
        print_message(f"archive.jsonl: {count_text(answer.results.damaged, 'line')} changed or torn; "
                      "these designs were judged again")
    if answer.results.reused:
        print_message(f"used again from the archive: {count_text(answer.results.reused, 'evaluation')}")
    print_message(f"wrote {folder}")
    if format_name == "json":
        print_result(answer_json(answer))
    else:
        print_result(f"\n{yields_text(answer, folder, reported[0])}" if reported else answer_text(answer, folder))
    return 0 if answer.is_met else 1


def _write(answer: StudyAnswer, folder: str) -> None:
    """Write the files of a study's answer into a folder, and remove files of an earlier answer."""
    os.makedirs(os.path.join(folder, "designs"), exist_ok=True)
    files = answer_files(answer)
    for name in files:
        write_output(os.path.join(folder, name), files[name])
    with contextlib.suppress(FileNotFoundError):
        os.unlink(os.path.join(folder, SO_FAR))
    for name in os.listdir(os.path.join(folder, "designs")):
        if re.fullmatch(r"[1-9]\.yaml", name) and f"designs/{name}" not in files:
            os.unlink(os.path.join(folder, "designs", name))  # kept by an earlier answer only


def _write_so_far(loaded: Study, unfinished: StudyResults, folder: str) -> None:
    """Write the page of an interrupted search."""
    path, of = os.path.join(folder, SO_FAR), min(unfinished.request.evaluations, unfinished.request.space.size)
    write_output(path, progress_page(loaded, unfinished, of).encode("utf-8"))
    print_message(f"wrote {path}: {count_text(len(unfinished.screened), 'design')} that were looked at")


SO_FAR = "so-far.html"
"""File name of the page of an interrupted search. A complete search removes this file."""

STUDY_REPORT_INTERVAL = 30.0
"""Seconds between two lines on the progress of a study, if no terminal shows it on one line."""


def _study_progress() -> StudyProgress:
    """Return a function that shows the progress of a study.

    It prints the rate, the number of designs that keep all limits, the best values, and the time left.
    """
    on_terminal, spent, finished = sys.stderr.isatty(), defaultdict[str, float](float), defaultdict[str, int](int)
    last = last_report = time.monotonic()

    def show(state: StudyState) -> None:
        nonlocal last, last_report
        now = time.monotonic()
        if state.made < finished[state.stage]:
            spent[state.stage] = 0.0  # units of replacement designs are counted anew
        spent[state.stage] += now - last  # stages alternate
        last, finished[state.stage] = now, state.made
        if not on_terminal and now - last_report < STUDY_REPORT_INTERVAL:
            return
        last_report, rate = now, state.made / max(spent[state.stage], 1e-3)
        best = "".join(f", best {name} {value_text(name, value)}" for name, value in state.best.items())
        remaining = (state.of - state.done) / rate
        left_in_words = f"{remaining:.0f} s" if remaining < 100.0 else f"{remaining / 60.0:.0f} min"
        of = f" of {state.of}, {left_in_words} left" if state.of > state.done else ""
        text = f"{state.stage}: {state.done}{of}, {rate:.3g} a second, {state.feasible} keep all{best}"
        if on_terminal:
            click.echo(f"\r\033[K  {text}", err=True, nl=False)
        else:
            print_message(text)

    return show
