"""`sitscad build`: write packages. NumPy and the rules are loaded only if files have to be made."""

from __future__ import annotations

import functools
import shlex
import sys
from typing import Any

import click

from sitscad.basics.finding import Severity
from sitscad.checks.opening import map_in_processes, nearest_policy_of_spec, open_spec
from sitscad.checks.policy import Policy
from sitscad.cli.specs import baseline_of, show_findings, show_unreadable, specs_of, warn_of_unknown_specs
from sitscad.cli.terminal import BASELINE, JOBS, PLUGIN, Example, Names, coloured, print_message, print_result
from sitscad.package.building import build as build_package
from sitscad.package.building import require_distinct_names, stale
from sitscad.package.manifest import BuildResult
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec


@click.command(cls=Example, example="sitscad build sensor.yaml --only gerber,kicad -o outputs")
@click.argument("specs", nargs=-1, required=True, type=click.Path())
@click.option("-o", "--output", default="outputs", show_default=True, type=click.Path(), help="Folder of the packages.")
@click.option(
    "--only", type=Names(),
    help="Only these parts: gerber, kicad, laser, mount, mesh, assembly, firmware, datasheet, calibration, report.",
)
@click.option("--force", is_flag=True, help="Build in spite of errors, and mark the package.")
@click.option("--strict", is_flag=True, help="Do not build with warnings either, as in `check --strict`.")
@click.option("--check", is_flag=True,
              help="Write nothing; fail if a package differs from the result without --check.")
@BASELINE
@JOBS
@PLUGIN
def build(
    specs: tuple[str, ...], output: str, only: tuple[str, ...] | None, force: bool, strict: bool, check: bool,
    baseline: str | None, jobs: int | None,
) -> int:
    """Check SPECS, then write their packages.

    A package is the folder NAME under the output folder; the spec contains NAME. SPECS are files, folders (with every
    spec in them and below) and - for standard input. Configuration and comments count as for `check`.
    An error in the checks, with --strict also a warning, stops a build before any file is made. Exit code: 0 written, 1
    stopped, 2 a spec cannot be read or a package cannot be written.
    """
    if force and strict:
        raise click.UsageError("--force builds in spite of errors, --strict not even with warnings: one of both.")
    loaded, code = [], 0
    for path in specs_of(specs):
        try:
            policy = nearest_policy_of_spec(path)
            loaded.append((open_spec(path, policy), policy))
        except SpecError as error:
            show_unreadable(path, error)
            code = 2
    require_distinct_names([spec for spec, _ in loaded])
    alone = len(loaded) == 1 and sys.stderr.isatty()
    options: dict[str, Any] = {"out": output, "only": only, "baseline": baseline_of(baseline)}
    # Several specs have a process each. The solids of a single spec have one on request, at a third more CPU time
    options["jobs"] = jobs or 1 if len(loaded) == 1 else 1
    if not check:
        options |= {"force": force, "strict": strict, "progress": _progress if alone else _print_stage}
    named = {"-o": output if output != "outputs" else "", "--only": ",".join(only or ()), "--baseline": baseline or ""}
    again = "".join(f" {name} {shlex.quote(value)}" for name, value in named.items() if value)
    fails = Severity.WARNING if strict else Severity.ERROR
    for result in map_in_processes(functools.partial(_build_one, check, **options), loaded, jobs):
        warn_of_unknown_specs(options["baseline"], [result.checked])
        code = max(code, _print_build(result, only or (), again, len(loaded) > 1, fails))
    return code


def _build_one(compares: bool, request: tuple[SensorSpec, Policy], **how: Any) -> BuildResult:
    """Build one package. If `compares`, compare an existing package with the result of a build instead.

    `request` is the spec with its policy, and `how` are the options of the build.
    """
    spec, policy = request
    if compares:
        return stale(spec, **how, policy=policy)
    if how["progress"] is _print_stage:
        how["progress"] = functools.partial(_print_stage, spec.name)
    return build_package(spec, **how, policy=policy)


LONG_STAGES = ("check", "mount", "mesh", "assembly", "datasheet", "calibration", "report")
"""Stages that take seconds."""


def _print_stage(name: str, stage: str, outcome: str, _: float) -> None:
    """Print a line when a long stage starts. It is used in pipes, and for builds of several packages.

    `name` is the spec's name. `outcome` is ``start`` at the beginning of a stage.
    """
    if outcome == "start" and stage in LONG_STAGES:
        print_message(f"{name}: {stage} ...")


def _progress(stage: str, outcome: str, seconds: float) -> None:
    """Print one line per stage on a terminal. It is overwritten when the stage is done."""
    colour = coloured(sys.stderr)
    if outcome == "start":
        click.echo(f"  {stage} ...", err=True, nl=False)
    else:
        text = click.style(f"{outcome:<8}", fg="green" if outcome == "made" else None, dim=outcome != "made")
        click.echo(f"\r  {stage:<9} {text if colour else f'{outcome:<8}'} {seconds:6.2f} s", err=True, color=colour)


def _print_build(result: BuildResult, only: tuple[str, ...], again: str, named: bool, fails: Severity) -> int:
    """Print the result of a build, and return its exit code.

    `only` are the names of the stages that were built, empty for all stages. `again` are the options that repeat the
    build. With `named`, every line names the spec, for builds of several specs. `fails` is the severity that stops the
    build.
    """
    if result.checked.findings or result.checked.ignored:
        show_findings([result.checked], named)
    if result.stale:
        is_there = not all(text.endswith(" is missing") for text in result.stale)
        for text in result.stale if is_there else [f"there is no package, {len(result.stale)} files are missing"]:
            print_result(f"{result.directory}: {text}")
        print_message(f"{result.directory} is stale: sitscad build {result.checked.path}{again} makes it anew")
        return max(1, result.checked.exit_code)
    is_stopped = not result.written and not result.stages  # a comparison is not a stopped build
    if result.checked.fails(fails) and (is_stopped or fails is Severity.WARNING):
        otherwise = "warnings above; it is without --strict" if result.checked.ok else (
            "errors above; --force builds in spite of them")
        print_message(f"{result.checked.path}: not built, because of the {otherwise}")
        return max(1, result.checked.exit_code)
    if result.kept_aside:
        print_message(f"files that were changed by hand, or not sitscad's, are now in {result.kept_aside}")
    if result.forced:
        print_message(f"{result.directory} was built in spite of errors and is marked as forced")
    for stage, why in result.missing(only).items():
        print_message(f"{result.directory} has no {stage}: {why}")
    files = sum(stage.files for stage in result.stages) + 1
    done = {outcome: [s.name for s in result.stages if s.outcome == outcome] for outcome in ("made", "kept", "dropped")}
    text = "; ".join(f"{outcome} {', '.join(names)}" for outcome, names in done.items() if names)
    is_new = result.written and not result.is_unchanged
    print_result(f"{result.directory}: {files} files ({text if is_new else 'unchanged'})")
    return result.checked.exit_code if is_stopped else 0
