"""The commands: arguments in, exit codes out. What they do is behind the public names of `sitscad`."""

from __future__ import annotations

import functools
import gc
import os
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

import click

import sitscad
from sitscad.finding import Finding, Remedy, Severity

if TYPE_CHECKING:
    from sitscad import Baseline, BuildResult, CheckedSpec, Held, Inspection, Manner, MendedSpec, Policy, SensorSpec

ISSUES = "the project's issue tracker"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command line and leave with its exit code; no exception reaches the person who typed it."""
    # Our matrices are small: threads of the linear algebra would only wait for each other, at twice the processor time
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(200_000)  # a short command makes much and drops little: looking for cycles costs it some per cent
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    code = _run(arguments)
    gc.freeze()  # what is left goes with the process: the last look for cycles would cost some per cent more
    sys.exit(code)


def _run(arguments: Sequence[str] | None) -> int:
    try:
        code = cli.main(arguments, prog_name="sitscad", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return 2
    except (KeyboardInterrupt, click.Abort):
        _say("interrupted; finished packages were left as they were")
        return 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - the reader is gone; nothing is left to say
        return 141
    except OSError as error:
        if os.environ.get("SITSCAD_TRACEBACK"):
            raise
        _say(f"cannot read or write: {error}")
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - what is left in the stream cannot be written either
        return 2
    except Exception as error:
        return _explain_crash(error)


def _explain_crash(error: Exception) -> int:
    """One sentence for what is known to go wrong, one with how to report it for what is not."""
    if os.environ.get("SITSCAD_TRACEBACK"):
        raise error
    if isinstance(error, (sitscad.PackageError, sitscad.MissingExtra, sitscad.PolicyError, sitscad.PluginError)):
        _say(str(error))
    elif isinstance(error, sitscad.PartsError):
        _say(f"a part cannot be made: {error}")
        return 1
    else:
        _say(
            f"internal error: {type(error).__name__}: {error}\n"
            f"This is a fault of sitscad {sitscad.__version__}, not of your spec. Please report it in {ISSUES}, with "
            "the spec and the output of the same command run with SITSCAD_TRACEBACK=1 in its environment."
        )
    return 2


def _say(message: str) -> None:
    click.echo(f"sitscad: {message}", err=True)


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _colour(stream: Any) -> bool:
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _manner(stream: Any, fail_on: Severity = Severity.ERROR) -> Manner:
    """How findings are told on a stream; paths count from the repository's root where a CI server says which it is."""
    root = os.environ.get("GITHUB_WORKSPACE") or os.environ.get("CI_PROJECT_DIR") or "."
    return sitscad.Manner(_colour(stream), tuple(_rules()), fail_on, root)


SUMMARY_LIMIT = 1_000_000
"""Bytes of a job's page: GitHub takes one mebibyte a step and drops the whole page of a longer one."""


def _summary_path(format_name: str) -> str:
    """Where GitHub Actions wants the page of a job; empty where nobody does."""
    return os.environ.get("GITHUB_STEP_SUMMARY", "") if format_name == "github" else ""


def _append_job_summary(path: str, inspected: list[Inspection]) -> None:
    """Write the page of the job where one is wanted; pictures go first where it would be too long."""
    if not path:
        return
    checked = [each.checked for each in inspected]
    pictures = {each.checked.path: each.picture for each in inspected}
    for drawn in (pictures, {}):
        page = sitscad.job_summary(checked, drawn).encode("utf-8")
        if len(page) <= SUMMARY_LIMIT:
            break
    with open(path, "ab") as stream:
        stream.write(page[:SUMMARY_LIMIT])


def _print(text: str) -> None:
    """A result: to stdout, as it is."""
    click.echo(text, nl=not text.endswith("\n"), color=True)


class _Example(click.Command):
    """A command whose help ends with one example."""

    def __init__(self, name: str | None, *, example: str, **kwargs: Any) -> None:
        super().__init__(name, **{**kwargs, "epilog": f"\b\nExample:\n  {example}"})


class _Group(click.Group):
    command_class = _Example

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Commands in the order in which they are used."""
        return list(self.commands)


class _Names(click.ParamType):
    """Comma-separated names."""

    name = "name,..."

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, ...]:
        """The names without blanks."""
        return value if isinstance(value, tuple) else tuple(part.strip() for part in value.split(",") if part.strip())


SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


@click.group(
    cls=_Group,
    context_settings=SETTINGS,
    epilog="\b\nExample:\n  sitscad new grasper_4layer && sitscad build grasper_4layer.yaml",
)
@click.version_option(sitscad.__version__, prog_name="sitscad", message="%(prog)s %(version)s")
def cli() -> None:
    """From one YAML spec to inductive tactile sensors for a 5 mm jaw that can be ordered."""


@cli.command(example="sitscad new grasper_4layer -o sensor.yaml")
@click.argument("template", required=False)
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="The file to write (default: TEMPLATE.yaml).")
@click.option("--list", "list_them", is_flag=True, help="List the templates and write nothing.")
@click.option("--force", is_flag=True, help="Write over an existing file.")
def new(template: str | None, output: str | None, list_them: bool, force: bool) -> int:
    """Write a commented spec to start from.

    TEMPLATE is grasper_4layer unless another is named; --list names them all.
    """
    if list_them:
        described = sitscad.list_templates()
        width = max(map(len, described), default=0)
        _print("\n".join(f"{name:<{width}}  {text}" for name, text in described.items()))
        return 0
    named = {} if template is None else {"name": template}
    path = sitscad.write_template(path=output, force=force, **named)
    _print(str(path))
    if (schema := sitscad.write_schema(path.parent)) is not None:
        _say(f"wrote {schema}, from which editors complete and validate specs")
    _say(f"wrote {path}; next: sitscad check {path}")
    return 0


FORMS = "text, json, sarif, junit or github."


JOBS = click.option("--jobs", type=click.IntRange(1), help="Processes for several specs (default: the processors).")


def _use_plugins(_: click.Context, __: click.Parameter, files: tuple[str, ...]) -> None:
    """Put installed plugins in force, and those of the files that are named."""
    sitscad.use_installed_plugins()
    for file in files:
        sitscad.use_plugin(file)


PLUGIN = click.option(
    "--plugin", multiple=True, metavar="FILE", type=click.Path(), expose_value=False, is_eager=True,
    callback=_use_plugins, help="A Python file with rules or writers of your own.",
)  # fmt: skip
BASELINE = click.option("--baseline", help="A file of check --format json: what it holds does not fail again.")


@cli.command(example="sitscad check sensor.yaml --format json")
@click.argument("specs", nargs=-1, required=True, type=click.Path())
@click.option("--format", "format_name", default="text", show_default=True, help=FORMS)
@click.option("--select", type=_Names(), default=(), help="Only these rules: SIT201, SIT2, or names.")
@click.option("--ignore", type=_Names(), default=(), help="Not these rules.")
@click.option("--strict", is_flag=True, help="As --fail-on warning.")
@click.option("--fail-on", default="error", show_default=True, help="What fails: note, warning or error, and graver.")
@BASELINE
@JOBS
@PLUGIN
@click.option("--hints", default="decisive", show_default=True, help="What is tried for hints: none, decisive or full.")
@click.option("--fix", is_flag=True, help="Write what mends a finding into the spec.")
@click.option("--diff", is_flag=True, help="Print what --fix would change, and change nothing.")
@click.option("--unsafe-fixes", is_flag=True, help="With these: turns, sizes, layers and materials, too.")
def check(
    specs: tuple[str, ...],
    format_name: str,
    select: tuple[str, ...],
    ignore: tuple[str, ...],
    strict: bool,
    fail_on: str,
    baseline: str | None,
    jobs: int | None,
    hints: str,
    fix: bool,
    diff: bool,
    unsafe_fixes: bool,
) -> int:
    """Check SPECS against every rule that applies.

    SPECS are files, folders (every spec in them and below) and - for standard input. The nearest sitscad.toml, or
    [tool.sitscad] in pyproject.toml, above each spec chooses rules and severities; a comment
    "# sitscad: ignore SIT103 reason" silences a rule on its line.
    Writes no files without --fix, which writes every fix into the spec that was tried, mends its finding and brings no
    error or warning; comments and order stay. Of standard input (-) it prints the mended text.
    The verdict does not depend on --hints: decisive tries changes for as long as the check itself takes, for errors
    first; full tries all that may mend a finding, which can take minutes; none tries nothing.
    Exit code: 0 no errors, 1 errors found (with --fail-on: or milder findings), 2 a spec cannot be read; with --fix of
    what it leaves, and with --diff at least 1 where it would change something.
    """
    show = _row(sitscad.FINDING_FORMATS, format_name, "--format")
    _require_purpose(fix, diff, unsafe_fixes, format_name, specs)
    for pattern in (*select, *ignore):
        _require_rule(pattern)
    _row(dict.fromkeys(sitscad.HINTS), hints, "--hints")
    weight = _row({severity.value: severity for severity in Severity}, "warning" if strict else fail_on, "--fail-on")
    held, paths = sitscad.Held(select, ignore, _baseline(baseline)), _specs(specs)
    draws = bool(_summary_path(format_name))
    mended = _mended(paths, hints, held, unsafe_fixes) if fix or diff else []
    work = functools.partial(sitscad.inspect, hints=hints, held=held, draws=draws)
    inspected = [each.inspection for each in mended] or list(sitscad.each_of(work, paths, jobs))
    checked = [each.checked for each in inspected]
    for each in () if diff else mended:
        _write(each)
    if diff or (fix and "-" in specs):
        click.echo("".join(each.diff if diff else each.after for each in mended), nl=False)
        _show_findings(checked)
    else:
        _print(show(checked, _manner(sys.stdout, weight)))
    _append_job_summary(_summary_path(format_name), inspected)
    code = max(*(spec.exit_code for spec in checked), int(diff and any(each.diff for each in mended)))
    if code == 0 and any(spec.fails(weight) for spec in checked):
        option = "--strict" if strict else f"--fail-on {fail_on}"
        milder = [severity for severity in (Severity.WARNING, Severity.NOTE) if severity.weighs(weight)]
        counts = ((severity.value, sum(spec.count(severity) for spec in checked)) for severity in milder)
        words = " and ".join(_counted(count, name) for name, count in counts if count)
        _say(f"{option}: {words} and no error; {weight.value}s fail (--ignore leaves rules out)")
        return 1
    return code


def _require_purpose(fix: bool, diff: bool, unsafe: bool, form: str, specs: tuple[str, ...]) -> None:
    """A usage error for options of fixes that make no sense together."""
    if unsafe and not (fix or diff):
        raise click.UsageError("--unsafe-fixes says what --fix and --diff may change: name one of them.")
    if form != "text" and (diff or (fix and "-" in specs)):
        what = "--diff prints a patch" if diff else "--fix prints the mended text of standard input"
        raise click.UsageError(f"{what}, and has no other form: leave --format out.")
    if fix and "-" in specs and len(specs) > 1:
        raise click.UsageError("--fix takes standard input (-) alone.")


def _mended(specs: Iterable[str], hints: str, held: Held, unsafe: bool) -> list[MendedSpec]:
    """The specs with all fixes of the chosen rules that may be made."""

    def may(_: Finding, remedy: Remedy) -> bool:
        return unsafe or remedy.is_safe

    return [sitscad.mend(path, may, hints, held) for path in specs]


def _write(mended: MendedSpec) -> None:
    """Write a mended spec over its file, and say what was mended."""
    if mended.after == mended.before:
        return
    if mended.path != "-":
        sitscad.write_file(mended.path, mended.after.encode("utf-8"))
    for line in mended.words.splitlines():
        _say(f"{mended.path}: {line}")


def _specs(paths: Iterable[str]) -> list[str]:
    """The specs that are named, those of folders among them."""
    try:
        return sitscad.specs_in(list(paths))
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def _baseline(path: str | None) -> Baseline | None:
    return None if path is None else sitscad.read_baseline(path)


@cli.command(example="sitscad estimate sensor.yaml --format json --tolerance 1e-3")
@click.argument("spec", type=click.Path())
@click.option("--format", "format_name", default="text", show_default=True, help="text or json.")
@click.option("--tolerance", type=click.FloatRange(0, 1, min_open=True), help="Relative error of the inductance.")
@click.option("--method", help="The inductance method (default: the cheapest that meets the tolerance).")
def estimate(spec: str, format_name: str, tolerance: float | None, method: str | None) -> int:
    """Print the electrical numbers of SPEC.

    Inductance, resistance and frequency of every coil, free, at rest and pressed, and the readout's settings.

    \b
    Words in the tables:
      Q              quality factor: 2 pi times the swings of the tank until its
                     energy has fallen to 1/e. 10 and more are asked; below
                     that the frequency follows the losses too.
      Rp             parallel resistance, what the tank's losses are to the drive:
                     1 kohm and more are asked, usual are 1 to 10.
      frequency      by the converter's data sheet, equation 1: losses and the
                     drive's 5 ns keep it 0.1 to 2 % below 1 / (2 pi sqrt(L C)).
      step           smallest difference of inductance that the converter can
                     tell at this scan rate, usually 10 to 400 pH; at half the
                     rate about half. Quantisation noise, step / sqrt 12, is the
                     least that noise can be; real noise is larger.
      shape factor   loaded area of the pad over its free sides, usually from 0.5
                     (tall, soft) to 2 (flat: it cannot bulge, and is stiff);
                     the stiffness grows with 1 + 2 S^2.
      sigma          one standard deviation of manufacture: two boards of three lie
                     within it.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec cannot be read.
    """  # noqa: D301 - click asks for the control character itself
    show = _row(sitscad.ESTIMATE_FORMATS, format_name, "--format")
    if tolerance is not None and tolerance != tolerance:  # nan lies in no range, and click lets it through
        raise click.BadParameter("a number above 0 is wanted", param_hint="--tolerance")
    if method is not None:
        _row({row.name: row for row in sitscad.METHODS}, method, "--method")
    try:
        loaded = sitscad.opened(spec, sitscad.policy_for(spec))
    except sitscad.SpecError as error:
        unread = sitscad.unreadable(spec, error)
        _print(show(spec, None, unread, _colour(sys.stdout)))
        return unread.exit_code
    layout = sitscad.lay_out(loaded)
    try:
        estimates = sitscad.estimate(layout, method=method, tolerance=tolerance)
    except ValueError as error:
        if method is None:
            raise
        raise click.BadParameter(str(error), param_hint="--method") from error
    result = sitscad.check(loaded, layout, estimates if method is None else None)
    checked = sitscad.as_configured(loaded, result)
    _print(show(spec, estimates, checked, _colour(sys.stdout)))
    worst = max(estimates.coils, key=lambda coil: coil.inductance_error)
    if tolerance is not None and worst.inductance_error > tolerance:
        asked = f"the method {method} does not meet" if method else "no method meets"
        _say(f"{asked} a tolerance of {tolerance:g} for this coil: {worst.method} states {worst.inductance_error:.2g}")
    if not checked.ok:
        _say(f"the checks found {_counted(checked.count(Severity.ERROR), 'error')}: sitscad check {spec}")
    return checked.exit_code


@cli.command(example="sitscad response sensor.yaml --pose z=-0.2,ry=1 --load normal=4.8,shear_x=1")
@click.argument("spec", type=click.Path())
@click.option("--pose", "poses", multiple=True, metavar="x=0.5,...", help="A pose: x, y, z (mm), rx, ry, rz (degrees).")
@click.option("--poses", "pose_files", multiple=True, metavar="FILE", help="Poses of a CSV file; x_m or rx_rad for SI.")
@click.option("--load", "loads", multiple=True, metavar="normal=4.8,...", help="A load: normal, shear_x, shear_y (N).")
@click.option("--loads", "load_files", multiple=True, metavar="FILE", help="Loads of a CSV file.")
@click.option("--scan", "scans", multiple=True, metavar="x=-2:2:41,...", help="FIRST:LAST:COUNT of any of these names.")
@click.option("--frequency", help="Where L and R are taken, like 5MHz (default: each coil's own tank frequency).")
@click.option("--tolerance", type=click.FloatRange(0, 1, min_open=True), help="What a map of many poses may be off by.")
@click.option("--jacobian", is_flag=True, help="Add the derivatives of the frequencies by pose and load.")
@click.option("--performance", is_flag=True, help="Say what the sensor feels, in newtons (JSON always does).")
@click.option("--format", "format_name", default="text", show_default=True, help="text, json or csv.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="A file instead: .npz, .csv or .json.")
def response(
    spec: str,
    poses: tuple[str, ...],
    pose_files: tuple[str, ...],
    loads: tuple[str, ...],
    load_files: tuple[str, ...],
    scans: tuple[str, ...],
    frequency: str | None,
    tolerance: float | None,
    jacobian: bool,
    performance: bool,
    format_name: str,
    output: str | None,
) -> int:
    """Print what the coils of SPEC read when the target moves or is pushed.

    Any number of poses, loads, files and scans; at rest where none is given. Points come in this order: poses, files
    of poses, scans over poses, loads, files of loads, scans over loads. A scan is the product of its ranges, the last
    one fastest.

    \b
    Axes and words:
      x, y, z        how far the centre of the target's near face has gone from
                     rest: x along the jaw towards the tail, y across, z away
                     from the board. A press is a negative z.
      rx, ry, rz     how it is turned about that point, Rx(rx) Ry(ry) Rz(rz):
                     a positive ry brings its +x side nearer to the board.
      normal         force towards the board, positive; shear_x and shear_y push
                     along +x and +y. rotation=held keeps the target parallel.
      L, R           what the converter sees at the contacts, with everything
                     around and the other coils idle.
      by target      what the target alone changes of the winding's inductance.
      +-             stated error of that, relative to the larger of it and 1 %
                     of the free winding's inductance.
      counts         the converter's 28-bit result.
      Rp             parallel resistance of the tank.

    \b
    What the sensor feels (--performance), at rest, half and full load:
      range          how far the axis goes, and what ends it first.
      noise          one sigma of the converter's noise, in force.
      nonlinear      distance from the best straight line, of the range.
      crosstalk      error per full scale of another axis, of the range, by the
                     straight map at that load; a curved one leaves less.
      error          the largest one-sigma error, and what it is mostly by.
      condition      of the map from loads to frequencies, in full scales: 1 is
                     best, far above 10 one axis is hardly told from another.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec cannot be read, or has nothing
    that could respond.
    """  # noqa: D301 - click asks for the control character itself
    show = _row(sitscad.RESPONSE_FORMATS, format_name, "--format")
    ending = os.path.splitext(output or "")[1].lower()
    if output:
        _row(dict.fromkeys(sitscad.RESPONSE_FILES), ending, "-o")
    try:
        motions = sitscad.read_motions(poses, pose_files, loads, load_files, scans)
        at = sitscad.frequency_of(frequency) if frequency else None
    except sitscad.MotionError as error:
        raise click.UsageError(str(error)) from error
    try:
        loaded = sitscad.opened(spec, sitscad.policy_for(spec))
    except sitscad.SpecError as error:
        _show_findings([sitscad.unreadable(spec, error)])
        return 2
    design = sitscad.Design(loaded)
    progress = _points if sys.stderr.isatty() and len(motions) > MANY else None
    try:
        found = sitscad.respond_to(design, motions, at, tolerance, progress, jacobian)
    except sitscad.NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    wanted = ending == ".json" if output else format_name == "json" or performance
    felt = design.performance if wanted else ()
    if output:
        sitscad.write_file(output, sitscad.response_file(spec, found, ending, felt))
        _say(f"wrote {output}: {_counted(len(found), 'point')}")
    else:
        _print(show(spec, found, _colour(sys.stdout), felt))
    result = sitscad.check(loaded, design.layout, design.estimates)
    checked = sitscad.as_configured(loaded, result)
    if not checked.ok:
        _say(f"the checks found {_counted(checked.count(Severity.ERROR), 'error')}: sitscad check {spec}")
    return checked.exit_code


MANY = 200
"""Points from which on progress is shown."""


def _points(done: int, of: int) -> None:
    """How far a response is, on one line of a terminal."""
    click.echo(f"\r  {done} of {of} poses solved" + ("\n" if done >= of else ""), err=True, nl=False)


@cli.command(example="sitscad build sensor.yaml --only gerber,kicad -o outputs")
@click.argument("specs", nargs=-1, required=True, type=click.Path())
@click.option("-o", "--output", default="outputs", show_default=True, type=click.Path(), help="Where packages go.")
@click.option("--only", type=_Names(), help="Only these parts: gerber, kicad, laser, mount, mesh, firmware, report.")
@click.option("--force", is_flag=True, help="Build in spite of errors, and mark the package as such.")
@click.option("--check", is_flag=True, help="Write nothing; fail where packages are stale, and name their files.")
@BASELINE
@JOBS
@PLUGIN
def build(
    specs: tuple[str, ...],
    output: str,
    only: tuple[str, ...] | None,
    force: bool,
    check: bool,
    baseline: str | None,
    jobs: int | None,
) -> int:
    """Check SPECS, then write their packages.

    A package is the folder NAME under the output folder; NAME stands in the spec. SPECS are files, folders (every spec
    in them and below) and - for standard input. Configuration and comments count as for `check`.
    An error in the checks stops a build before anything is made. Exit code: 0 written, 1 errors found, 2 a spec cannot
    be read or a package cannot be written.
    """
    loaded, code = [], 0
    for path in _specs(specs):
        try:
            policy = sitscad.policy_for(path)
            loaded.append((sitscad.opened(path, policy), policy))
        except sitscad.SpecError as error:
            _show_findings([sitscad.unreadable(path, error)])
            code = 2
    sitscad.require_distinct_names([spec for spec, _ in loaded])
    alone = len(loaded) == 1 and sys.stderr.isatty()
    asked: dict[str, Any] = {"out": output, "only": only, "baseline": _baseline(baseline)}
    if check:
        work = functools.partial(_compare_one, **asked)
    else:
        work = functools.partial(_build_one, **asked, force=force, progress=_progress if alone else None)
    for result in sitscad.each_of(work, loaded, jobs):
        code = max(code, _told(result))
    return code


def _build_one(asked: tuple[SensorSpec, Policy], **how: Any) -> BuildResult:
    spec, policy = asked
    return sitscad.build(spec, **how, policy=policy)


def _compare_one(asked: tuple[SensorSpec, Policy], **how: Any) -> BuildResult:
    spec, policy = asked
    return sitscad.stale(spec, **how, policy=policy)


@cli.command(example="sitscad explain SIT201")
@click.argument("rule")
@PLUGIN
def explain(rule: str) -> int:
    """Say what RULE checks, why, and how to mend it.

    RULE is an identifier (SIT103), its number (103) or the rule's name (coil-trace).
    """
    found = _require_rule(rule)
    if found is None:
        raise click.UsageError(f"{rule!r} stands for several rules; `sitscad rules` lists them.")
    parts = (found.summary, f"Why: {found.why}", f"To mend it: {found.mend}", f"Source: {found.source}")
    _print("\n\n".join((f"{found.id} {found.name} ({found.severities})", *parts)))
    return 0


@cli.command(example="sitscad rules")
@click.option("--format", "format_name", default="text", show_default=True, help="text, json or markdown.")
@PLUGIN
def rules(format_name: str) -> int:
    """List every rule with the severities that it can have; json and markdown have all its texts."""
    _print(_row(sitscad.RULE_FORMATS, format_name, "--format")(tuple(_rules())))
    return 0


@cli.command(example="sitscad schema > sitscad.schema.json")
@click.option("--of", "document", default="spec", show_default=True, help="spec, or check: what --format json prints.")
def schema(document: str) -> int:
    """Print the JSON Schema of the spec, for editors, or of what `check` prints for programs."""
    import json

    _print(json.dumps(_row(sitscad.SCHEMAS, document, "--of")(), indent=1))
    return 0


@cli.command(example="sitscad verify outputs/grasper-4layer")
@click.argument("directory", type=click.Path())
def verify(directory: str) -> int:
    """Read a finished package back.

    Its files are held against the manifest, its copper's nets against the intended ones, every board of its panel
    against the single board.
    Exit code: 0 equal, 1 something differs, 2 not a package, or unreadable.
    """
    found = sitscad.verify(directory)
    for difference in found.differences:
        _print(difference)
    _print(f"{'ok' if found.ok else 'differs'}: {', '.join(found.looked_at)}")
    return 0 if found.ok else 1


def _told(result: BuildResult) -> int:
    """Say what became of a build; its exit code."""
    if result.checked.findings or result.checked.ignored:
        _show_findings([result.checked])
    if result.stale:
        for words in result.stale:
            _print(f"{result.directory}: {words}")
        _say(f"{result.directory} is stale: sitscad build {result.checked.path} makes it anew")
        return max(1, result.checked.exit_code)
    if not result.written and not result.checked.ok:
        path = result.checked.path
        _say(f"{path}: not built, because of the errors above; --force builds in spite of them")
        return result.checked.exit_code
    if result.kept_aside:
        _say(f"files that were changed by hand, or not sitscad's, are now in {result.kept_aside}")
    if result.forced:
        _say(f"{result.directory} was built in spite of errors and is marked as forced")
    _print(_built(result))
    return 0 if result.written else result.checked.exit_code


def _built(result: BuildResult) -> str:
    """One line: where the package is and what was done for it."""
    files = sum(stage.files for stage in result.stages) + 1
    done = {outcome: [s.name for s in result.stages if s.outcome == outcome] for outcome in ("made", "kept", "dropped")}
    words = "; ".join(f"{outcome} {', '.join(names)}" for outcome, names in done.items() if names)
    return f"{result.directory}: {files} files ({'unchanged' if result.is_unchanged else words})"


def _progress(stage: str, outcome: str, seconds: float) -> None:
    """A line a stage on a terminal, overwritten when the stage is done."""
    colour = _colour(sys.stderr)
    if outcome == "start":
        click.echo(f"  {stage} ...", err=True, nl=False)
    else:
        text = click.style(f"{outcome:<8}", fg="green" if outcome == "made" else None, dim=outcome != "made")
        click.echo(f"\r  {stage:<9} {text if colour else f'{outcome:<8}'} {seconds:6.2f} s", err=True, color=colour)


def _show_findings(checked: list[CheckedSpec]) -> None:
    """Findings as text to stderr, where they are a message and not the result."""
    text = sitscad.FINDING_FORMATS["text"](checked, _manner(sys.stderr))
    click.echo(text, err=True, nl=False, color=True)


def _require_rule(pattern: str) -> Any:
    """The one rule that a pattern stands for, None for several; a usage error for none."""
    known = _rules()
    found = [rule for rule in known if sitscad.stands_for(pattern, rule.id, rule.name)]
    if not found:
        meant = _meant(pattern, (r.name for r in known))
        raise click.UsageError(f"There is no rule {pattern!r}.{meant} `sitscad rules` lists them all.")
    return found[0] if len(found) == 1 else None


def _row(table: Any, name: str, option: str) -> Any:
    """A row of a table of formats or methods; a usage error that lists them for any other name."""
    if name not in table:
        raise click.BadParameter(f"{name!r} is not one of {', '.join(table)}.{_meant(name, table)}", param_hint=option)
    return table[name]


def _meant(name: str, known: Iterable[str]) -> str:
    import difflib

    near = difflib.get_close_matches(name.lower(), list(known), n=1)
    return f" Did you mean {near[0]}?" if near else ""


def _rules() -> list[Any]:
    return list(sitscad.all_rules())


__all__ = ["cli", "main"]
