"""`sitscad check`: findings, fixes, pictures, and the summary page of a CI job. `explain` and `rules`: rule texts."""

from __future__ import annotations

import functools
import os
import sys

import click

from sitscad.basics.finding import Severity
from sitscad.basics.units import count_text
from sitscad.checks.findings import FINDING_FORMATS, CheckedSpec, job_summary
from sitscad.checks.findings.text import RULE_FORMATS
from sitscad.checks.judging import HINTS, Rule, all_rules
from sitscad.checks.judging import explain as explain_rule
from sitscad.checks.opening import map_in_processes
from sitscad.checks.policy import matches_rule
from sitscad.cli.specs import baseline_of, layout_of, show_findings, specs_of, warn_of_unknown_specs
from sitscad.cli.terminal import (
    BASELINE,
    JOBS,
    PLUGIN,
    Example,
    Names,
    print_message,
    print_result,
    report_work,
    row_of,
    suggestion,
    write_output,
)
from sitscad.package.inspection import CheckOptions, Inspection, MendedSpec, inspect, mend

CHECK_WORDS = """
\b
--fix      writes fixes that were tried, that remove their finding and bring
           no error or warning. Comments and order stay. For - it prints the
           mended text.
--hints    decisive tries a few changes, errors first. full tries all, which
           can take minutes, and prints the hints of warnings, too; it is
           the default of --unsafe-fixes. none tries no changes. The verdict
           is the same.
--picture  draws the closed jaws in section, with excess in red beside its
           limit; without a jaw, the parts on the board from above.
"""


@click.command(cls=Example, details=CHECK_WORDS, example="sitscad check sensor.yaml --format json")
@click.argument("specs", nargs=-1, required=True, type=click.Path())
@click.option(
    "--format", "format_name", default="text", show_default=True, metavar="text|json|sarif|junit|github",
    help="For people, programs, code hosts, CI servers, GitHub Actions.",
)
@click.option("--select", type=Names(), default=(), help="Only these rules: SIT201, SIT2, or names.")
@click.option("--ignore", type=Names(), default=(), help="Not these rules.")
@click.option("--strict", is_flag=True, help="Same as --fail-on warning.")
@click.option(
    "--fail-on", default="error", show_default=True, metavar="note|warning|error", help="Lowest severity that fails."
)
@click.option("-v", "--verbose", is_flag=True, help="Also print notes, all hints, and reasons for rules not checked.")
@BASELINE
@JOBS
@PLUGIN
@click.option(
    "--hints", metavar="none|decisive|full", help="Fixes to try for hints.  [default: decisive; full for unsafe fixes]"
)
@click.option(
    "--picture", type=click.Path(), metavar="PATH",
    help="Draw the fit and its faults: FILE.svg; for several specs a folder.",
)
@click.option("--fix", is_flag=True, help="Write fixes of findings into the spec.")
@click.option("--diff", is_flag=True, help="Print the changes of --fix as a patch, and write nothing.")
@click.option("--unsafe-fixes", is_flag=True,
              help="Let --fix and --diff change turns, sizes, layers, materials and scan rate, too.")
def check(
    specs: tuple[str, ...], format_name: str, select: tuple[str, ...], ignore: tuple[str, ...], strict: bool,
    fail_on: str, verbose: bool, baseline: str | None, jobs: int | None, hints: str | None, picture: str | None,
    fix: bool, diff: bool, unsafe_fixes: bool,
) -> int:
    """Check SPECS against every rule that applies.

    SPECS are files, folders (with every spec in them and below) and - for standard input. Nothing is written without
    --fix or --picture.

    The nearest sitscad.toml, or [tool.sitscad] in pyproject.toml, above each spec sets rules and severities. A
    comment "# sitscad: ignore SIT103 reason" silences a rule on its line.

    Exit code: 0 no errors, 1 errors (with --fail-on milder findings, too), 2 a spec cannot be read or wrong usage.
    With --fix, the exit code is for the findings that remain; with --diff, it is at least 1 if there is a change.
    """
    show = row_of(FINDING_FORMATS, format_name, "--format")
    _require_purpose(fix, diff, unsafe_fixes, format_name, specs)
    for pattern in (*select, *ignore):
        rules_for(pattern)
    tells_hints = hints == "full"
    hints = row_of({name: name for name in HINTS}, hints or ("full" if unsafe_fixes else "decisive"), "--hints")
    weight = row_of({severity.value: severity for severity in Severity}, "warning" if strict else fail_on, "--fail-on")
    options, paths = CheckOptions(select, ignore, baseline_of(baseline)), specs_of(specs)
    drawings = _drawings(picture, paths, fix or diff)
    # Path of the job's page in GitHub Actions. Empty elsewhere
    page = os.environ.get("GITHUB_STEP_SUMMARY", "") if format_name == "github" else ""
    mended = []
    if fix or diff:
        for path in paths:
            with report_work(path, hints == "full") as step:
                mended.append(mend(path, lambda _, fix: unsafe_fixes or fix.is_safe, hints, options, progress=step))
    is_brief = format_name == "text" and not verbose and weight is not Severity.NOTE  # notes have no hints then
    shown = Severity.WARNING if is_brief else Severity.NOTE
    work = functools.partial(
        inspect, hints=hints, options=options, draws=bool(page), draws_fit=bool(drawings), least=shown)
    with report_work("looking for hints", hints == "full" and not mended):
        inspected = [each.inspection for each in mended] or list(map_in_processes(work, paths, jobs))
    checked = [each.checked for each in inspected]
    for each in mended:
        _write_mended(each, writes=not diff, unmended=unsafe_fixes)
    if diff or (fix and "-" in specs):
        click.echo("".join(each.diff if diff else each.after for each in mended), nl=False)
        show_findings(checked)
    else:
        # Paths start at the repository's root if a CI server sets it
        root = os.environ.get("GITHUB_WORKSPACE") or os.environ.get("CI_PROJECT_DIR") or "."
        choices = {"rules": tuple(all_rules()), "fail_on": weight, "root": root, "verbose": verbose,
                 "hints": tells_hints}
        print_result(show(checked, layout_of(sys.stdout, **choices)))
    warn_of_unknown_specs(options.baseline, checked)
    if page:
        _append_job_summary(page, inspected)
    for path, inspection in zip(drawings, inspected, strict=False):
        _draw(path, inspection)
    code = max(*(spec.exit_code for spec in checked), int(diff and any(each.diff for each in mended)))
    return code or _print_milder(checked, weight, "--strict" if strict else f"--fail-on {fail_on}")


def _drawings(picture: str | None, specs: list[str], mends: bool) -> list[str]:
    """Return the path of each spec's drawing, empty if no picture is requested.

    It is the named file `picture`, or a file in the named folder with the spec's name. `mends` is True with --fix or
    --diff, which exclude a picture.
    """
    if picture is None:
        return []
    if mends:
        raise click.UsageError("--picture draws what is found: leave --fix and --diff out.")
    if picture.endswith(".svg"):
        if len(specs) > 1:
            raise click.UsageError(f"--picture {picture} is one file for {len(specs)} specs: name a folder.")
        return [picture]
    if os.path.splitext(picture)[1]:
        raise click.UsageError(f"--picture {picture}: a file ends in .svg, a folder has no ending.")
    stems = ["spec" if path == "-" else os.path.splitext(os.path.basename(path))[0] for path in specs]
    twice = next((stem for stem in stems if stems.count(stem) > 1), None)
    if twice is not None:
        raise click.UsageError(f"--picture {picture}: two specs would be drawn into {twice}.svg; name them one by one.")
    return [os.path.join(picture, f"{stem}.svg") for stem in stems]


def _draw(path: str, inspected: Inspection) -> None:
    """Write the drawing of a spec, or print that there is nothing to draw."""
    if not inspected.drawing:
        print_message(f"{inspected.checked.path}: nothing to draw, {path} was not written")
        return
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    write_output(path, inspected.drawing.encode("utf-8"))
    print_message(f"{inspected.checked.path}: drawn in {path}")


def _print_milder(checked: list[CheckedSpec], weight: Severity, option: str) -> int:
    """Print the numbers of warnings and notes that fail the command because of an option.

    `option` is ``--strict`` or ``--fail-on``, and `weight` the mildest severity that fails. Return 1 if there are any,
    else 0.
    """
    if not any(spec.fails(weight) for spec in checked):
        return 0
    milder = [severity for severity in (Severity.WARNING, Severity.NOTE) if severity.is_at_least(weight)]
    counts = ((severity.value, sum(spec.count(severity) for spec in checked)) for severity in milder)
    text = " and ".join(count_text(count, name) for name, count in counts if count)
    print_message(f"{option}: {text} and no error; {weight.value}s fail (--ignore leaves rules out)")
    return 1


def _require_purpose(fix: bool, diff: bool, unsafe: bool, form: str, specs: tuple[str, ...]) -> None:
    """Raise a usage error if the options of ``--fix`` and ``--diff`` contradict other options."""
    if unsafe and not (fix or diff):
        raise click.UsageError("--unsafe-fixes says what --fix and --diff may change: name one of them.")
    if form != "text" and (diff or (fix and "-" in specs)):
        what = "--diff prints a patch" if diff else "--fix prints the mended text of standard input"
        raise click.UsageError(f"{what}, and has no other form: leave --format out.")
    if fix and "-" in specs and len(specs) > 1:
        raise click.UsageError("--fix takes standard input (-) alone.")


def _write_mended(mended: MendedSpec, writes: bool, unmended: bool) -> None:
    """Write a mended spec if it was changed and `writes` is True. Print the applied fixes and the undone fixes.

    With `unmended`, also print the rules of findings without a fix.
    """
    lines = mended.undone_fixes_text.splitlines()
    if writes and mended.after != mended.before:
        if mended.path != "-":
            write_output(mended.path, mended.after.encode("utf-8"))
        lines = mended.fixes_text.splitlines() + lines
    for line in (*lines, mended.unfixed_rules_text if unmended else ""):
        if line:
            print_message(f"{mended.path}: {line}")


SUMMARY_LIMIT = 1_000_000
"""Largest size (bytes) of a job's summary page.

GitHub takes one mebibyte per step and drops a longer page as a whole.
"""


def _append_job_summary(path: str, inspected: list[Inspection]) -> None:
    """Append the summary page of a job to the file `path`, without pictures if the page would be too long."""
    checked = [each.checked for each in inspected]
    pictures = {each.checked.path: each.picture for each in inspected}
    for shown_pictures in (pictures, {}):
        page = job_summary(checked, shown_pictures).encode("utf-8")
        if len(page) <= SUMMARY_LIMIT:
            break
    with open(path, "ab") as stream:
        stream.write(page[:SUMMARY_LIMIT])


def rules_for(pattern: str) -> list[Rule]:
    """Return the rules that match a pattern. Raises a usage error if there are none."""
    rules = all_rules()
    matching = [rule for rule in rules if matches_rule(pattern, rule.id, rule.name)]
    if not matching:
        near = suggestion(pattern, (rule.name for rule in rules))
        raise click.UsageError(f"There is no rule {pattern!r}.{near} `sitscad rules` lists them all.")
    return matching


@click.command(cls=Example, example="sitscad explain SIT201 coil-trace")
@click.argument("rules", nargs=-1, required=True)
@PLUGIN
def explain(rules: tuple[str, ...]) -> int:
    """Explain RULES: their condition, reason, remedy and source.

    A rule is an identifier (SIT103), its number (103) or its name (coil-trace). The beginning of identifiers (SIT2)
    means all rules with this beginning.
    """
    identifiers = dict.fromkeys(rule.id for pattern in rules for rule in rules_for(pattern))
    print_result("\n\n\n".join(map(explain_rule, identifiers)))
    return 0


@click.command(cls=Example, example="sitscad rules")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json|markdown")
@PLUGIN
def rules(format_name: str) -> int:
    """List every rule with its severities.

    json and markdown have the complete texts.
    """
    print_result(row_of(RULE_FORMATS, format_name, "--format")(tuple(all_rules())))
    return 0
