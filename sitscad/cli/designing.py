"""`sitscad measures`, `sweep` and `design`: figures of many designs, and the best of them."""

from __future__ import annotations

import os
import re
import sys
import time
from typing import TYPE_CHECKING

import click

import sitscad
from sitscad.cli.terminal import Example, print_result, progress_of, row_of, say, show_findings, spec_of
from sitscad.units import counted

if TYPE_CHECKING:
    from sitscad.study.running import Progress as StudyProgress
    from sitscad.study.running import StudyState


@click.command(cls=Example, example="sitscad measures")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
def measures(format_name: str) -> int:
    """List what a sweep or a study can ask of a design."""
    from sitscad.study.sweeping import MEASURE_FORMATS

    print_result(row_of(MEASURE_FORMATS, format_name, "--format")())
    return 0


@click.command(cls=Example, example="sitscad sweep sensor.yaml coil.turns=6:12:13 --measure rp -o turns.svg")
@click.argument("spec", type=click.Path())
@click.argument("ranges", nargs=-1, required=True, metavar="KEY=FIRST:LAST:COUNT...")
@click.option("--measure", "names", multiple=True, metavar="NAME", help="One of `sitscad measures` (default: all).")
@click.option("--level", default="screen", show_default=True, metavar="screen|full", help="Quick, or as `check` does.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="A file instead: .csv, .npz, .json or .svg.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|csv|json")
@click.option("--jobs", type=click.IntRange(1), help="Processes (default: the processors).")
def sweep(
    spec: str, ranges: tuple[str, ...], names: tuple[str, ...], level: str, output: str | None, format_name: str,
    jobs: int | None,
) -> int:
    """Print figures of every design of a product of ranges.

    A range is KEY=FIRST:LAST:COUNT or KEY=VALUE,VALUE, with keys and values as in SPEC: coil.layers=2,4 or
    coil.trace_width=70um:110um:9. The last one is fastest.

    \b
    Columns:
      the keys       as a spec has them.
      NAME           the figure, in SI units in files.
      NAME.error     what it may be off by (in files).
      verdict        ok, fails, or unknown where the screen cannot tell.
      refused_by     the rules that find an error.

    A picture (.svg) of one key is a curve with its band of error, of two a field with the edges of what each rule
    refuses. Exit code: 0, or 2 where the spec or a range cannot be read.
    """  # noqa: D301 - click asks for the control character itself
    from sitscad.package import write_file
    from sitscad.study.space import RangeError
    from sitscad.study.sweeping import SWEEP_FILES, SWEEP_FORMATS, range_of

    show, write = row_of(SWEEP_FORMATS, format_name, "--format"), None
    if output:
        write = row_of(SWEEP_FILES, os.path.splitext(output)[1].lower(), "-o")
    loaded = spec_of(spec)
    if loaded is None:
        return 2
    try:
        asked = dict(map(range_of, ranges))
        if len(asked) < len(ranges):
            raise click.UsageError("a key is swept once")
        progress = progress_of("designs")
        table = sitscad.sweep(loaded, asked, names or None, level=level, jobs=jobs, progress=progress)
        content = write(table) if write is not None else b""
    except RangeError as error:
        raise click.UsageError(f"{error}{f' ({error.hint})' if error.hint else ''}") from error
    except sitscad.SpecError as error:
        from sitscad.inspection import unreadable

        show_findings([unreadable(spec, error)])
        return 2
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if output:
        write_file(output, content)
        say(f"wrote {output}: {counted(len(table), 'design')}")
    else:
        print_result(show(table))
    return 0


@click.command(cls=Example, example="sitscad design study.yaml --jobs 2")
@click.argument("study", type=click.Path())
@click.option("-o", "--output", type=click.Path(file_okay=False), help="Where files go (default: outputs/NAME-study).")
@click.option("--jobs", type=click.IntRange(1), help="Processes (default: the processors).")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler, whose workers evaluate instead: tcp://...")
@click.option("--again", is_flag=True, help="Evaluate everything anew, whatever the archive has.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
def design(
    study: str, output: str | None, jobs: int | None, scheduler: str | None, again: bool, format_name: str
) -> int:
    """Find the designs that meet STUDY best.

    STUDY is a file beside a spec that says what of it varies, what is to be small or large, and what is required
    (`sitscad new --study` writes one, docs/studies.md explains it). Every rule of `check` holds.

    \b
    Files:
      designs/1.yaml, ...  the designs that are kept, whole specs for `build`.
      front.csv            every design that no other one beats.
      study.html           the whole answer as a page, with the front to look at.
      study.json           the whole answer, for programs.
      archive.jsonl        every design that was looked at: the same command
                           goes on from there, and ends with the same files.

    Exit code: 0 a design keeps everything, 1 none was found, 2 the study cannot be read.
    """  # noqa: D301 - click asks for the control character itself
    from sitscad.inspection import unreadable
    from sitscad.package import write_file
    from sitscad.study.answer_text import answer_json, answer_text
    from sitscad.study.page import answer_files

    row_of({"text": "", "json": ""}, format_name, "--format")
    try:
        asked = sitscad.Study.load(study)
    except sitscad.SpecError as error:
        show_findings([unreadable(study, error, "none")])
        return 2
    folder = output or os.path.join("outputs", f"{asked.name}-study")
    executor = None
    if scheduler is not None:
        from sitscad.study.evaluating import cluster

        executor, jobs = cluster(scheduler)
    answer = asked.run(executor, folder=folder, jobs=jobs, again=again, progress=_study_progress())
    if answer.found.reused:
        say(f"used again from the archive: {counted(answer.found.reused, 'evaluation')}")
    os.makedirs(os.path.join(folder, "designs"), exist_ok=True)
    files = answer_files(answer)
    for name in files:
        write_file(os.path.join(folder, name), files[name])
    for name in os.listdir(os.path.join(folder, "designs")):
        if re.fullmatch(r"[1-9]\.yaml", name) and f"designs/{name}" not in files:
            os.unlink(os.path.join(folder, "designs", name))  # that an earlier answer kept and this one does not
    say(f"wrote {folder}")
    print_result(answer_json(answer) if format_name == "json" else answer_text(answer, folder))
    return 0 if answer.is_met else 1


def _study_progress() -> StudyProgress | None:
    """What shows on a terminal how far a study is: designs a second, those that keep all, the best, time left."""
    if not sys.stderr.isatty():
        return None
    from sitscad.study.sweeping import shown

    started: dict[str, float] = {}

    def show(state: StudyState) -> None:
        first = started.setdefault(f"{state.stage}{state.of if state.done == 1 else ''}", time.monotonic())
        rate = state.done / max(time.monotonic() - first, 1e-3)
        best = ", ".join(f"{name} {shown(name, value)}" for name, value in state.best.items())
        left = (state.of - state.done) / max(rate, 1e-9)
        words = f"{state.stage}: {state.done} of {state.of}, {rate:.3g} a second, {state.feasible} keep all"
        click.echo(f"\r\033[K  {words}{f', best {best}' if best else ''}, {left:.0f} s left", err=True, nl=False)

    return show
