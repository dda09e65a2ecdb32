"""`sitscad estimate`, `response` and `calibrate`.

They print electrical figures, readings when the target moves or is pushed, and the map from readings to forces.
Calibration points can be taken one by one on the terminal.
"""

from __future__ import annotations

import os
import select
import sys
from dataclasses import replace
from pathlib import Path

import click

import sitscad
from sitscad.basics.units import counted
from sitscad.cli.measured import measured_options, print_comparison
from sitscad.cli.terminal import (
    DAY,
    RELATIVE_ERROR,
    Example,
    InRange,
    coloured,
    exit_code_of,
    print_message,
    print_result,
    progress_of,
    row_of,
    spec_of,
    write_output,
)


def take_points(
    design: sitscad.Design, calibration: sitscad.Calibration, source: str, table: str, creep: float | None
) -> bool:
    """Take the points of a plan and write each into a table. Return whether the table is complete.

    A point is read `creep` seconds after the load is applied. Raises click.UsageError if `source` is not a board of
    this sensor.
    """
    from sitscad.apps.hardware.leading import GuidedCalibration, PointRefused
    from sitscad.apps.hardware.source import source_of
    path = Path(table)
    try:
        origin, _ = source_of(source, design)
        origin.creep = origin.creep if creep is None else creep
        board = origin.board(design)
        wrong = board.set_up()
        if wrong:
            raise PointRefused(f"{', '.join(wrong)} did not read back: the bus, or another part")
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        path.parent.mkdir(parents=True, exist_ok=True)
        for text in GuidedCalibration(board, origin, calibration, _prompt, print_message).table(before):
            write_output(path, text.encode("utf-8"))
    except (PointRefused, OSError, KeyboardInterrupt, click.Abort) as error:
        print_message(f"{str(error) or 'stopped'}; the same command goes on after the points in {path}")
        return False
    except ValueError as error:
        raise click.UsageError(f"{source}, {path}: {error}") from error
    return True


def _prompt(prompt: str) -> str:
    """Prompt the user and return the typed line."""
    click.echo(f"{prompt}; then Enter, or the newtons that are on, or back: ", err=True, nl=False)
    # A blocking read loses a Ctrl-C just before it. On a terminal, wait with select first, then read
    is_typed = not (sys.stdin and sys.stdin.isatty() and os.name == "posix")
    while not is_typed:
        is_typed = bool(select.select([sys.stdin], [], [], 0.3)[0])
    if not (typed := sys.stdin.readline() if sys.stdin else ""):
        raise click.Abort
    return typed.strip()


@click.command(cls=Example, example="sitscad estimate sensor.yaml --format json --tolerance 1e-3")
@click.argument("spec", type=click.Path())
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
@click.option("--tolerance", type=RELATIVE_ERROR, help="Relative error of the inductance.")
@click.option(
    "--method", metavar="NAME", help="The inductance method (default: the cheapest that meets the tolerance)."
)
@click.option("--at", "at", multiple=True, metavar="FREQUENCY",
              help="Add L, R and Q of each coil alone at a frequency, like 13.56MHz; can be repeated.")
@click.option("--performance", is_flag=True, help="Add the sensing performance, in newtons (2 to 4 s more).")
@measured_options
@click.option("--coil", "name", metavar="NAME", help="The measured coil (--measured).  [default: the first]")
def estimate(
    spec: str, format_name: str, tolerance: float | None, method: str | None, at: tuple[str, ...], performance: bool,
    measured: str | None, meter_error: float, overlay: str | None, name: str | None,
) -> int:
    """Print the electrical figures of SPEC.

    They are inductance, resistance and frequency of every coil, and the settings of the readout. Each coil is free, at
    rest or pressed. With --performance, the sensing performance in newtons is added. With --at, L, R and Q of each coil
    alone at a frequency are added. They need neither target nor tank. With
    --measured, one coil of the bare board is compared at its contacts with a measurement.

    \b
    Words in the tables:
      Q              Quality factor: 2 pi times the number of swings in which
                     the tank's energy falls to 1/e. The minimum is 10. Below 10
                     the losses change the frequency, too.
      Rp             Parallel resistance of the tank with its losses. The minimum
                     is 1 kohm. Usual values are 1 to 10 kohm.
      frequency      By the converter's data sheet, equation 1. Losses and the
                     drive's 5 ns keep it 0.1 to 2 % below 1 / (2 pi sqrt(L C)).
      step           Smallest difference of inductance that the converter
                     resolves at this scan rate, usually 10 to 400 pH. Half the
                     rate gives about half the step. The noise is larger than
                     the quantisation noise, step / sqrt 12.
      shape factor   Loaded area of the pad over its free sides. Usual values are
                     0.5 (tall, soft) to 2 (flat, stiff). The stiffness grows
                     with 1 + 2 S^2.
      sigma          One standard deviation of manufacture: two of three boards
                     lie within it.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`) or the tolerance is not met, 2 the spec
    cannot be read.
    """  # noqa: D301 - click needs the control character itself
    from sitscad.assembly.places.motions import MotionError, frequency_of
    from sitscad.checks.opening import opened, policy_for
    from sitscad.estimates import METHODS, missed_tolerance
    from sitscad.estimates.performance.tables import PerformanceReport
    from sitscad.estimates.states.at_frequency import FrequencyError, coils_at
    from sitscad.files.report.numbers import ESTIMATE_FORMATS
    from sitscad.package.inspection import as_configured, unreadable

    show = row_of(ESTIMATE_FORMATS, format_name, "--format")
    if method is not None:
        row_of({row.name: row for row in METHODS}, method, "--method")
    try:
        loaded = opened(spec, policy_for(spec))
    except sitscad.SpecError as error:
        unread = unreadable(spec, error)
        print_result(show(spec, None, unread, coloured(sys.stdout), None, None, ()))
        return unread.exit_code
    layout = sitscad.lay_out(loaded)
    if measured is not None:
        return print_comparison(layout, measured, name, meter_error, format_name, overlay)
    if overlay or name:
        raise click.UsageError("--overlay and --coil go with --measured DATA")
    try:
        estimates = sitscad.estimate(layout, method=method, tolerance=tolerance)
    except ValueError as error:
        if method is None:
            raise
        raise click.BadParameter(str(error), param_hint="--method") from error
    try:
        coils = coils_at(layout, tuple(map(frequency_of, at)), method, tolerance)
    except (MotionError, FrequencyError) as error:
        raise click.BadParameter(str(error), param_hint="--at") from error
    result = sitscad.check(loaded, layout, estimates if method is None else None, hints="none")
    checked = as_configured(loaded, result)
    design = sitscad.Design(loaded, layout, estimates)
    report = PerformanceReport(design.performance, design.spec) if performance else None
    if performance and (reason := design.sensing.no_performance):
        print_message(f"no performance: {reason}")
    cells = design.cells.skin.table.document() if performance else None
    print_result(show(spec, estimates, checked, coloured(sys.stdout), report, cells, coils))
    missed = () if tolerance is None else missed_tolerance(estimates.coils, tolerance, method)
    for note in missed:
        print_message(note)
    return exit_code_of(checked, spec) or bool(missed)


RESPONSE_WORDS = """
\b
Axes and words:
  x, y, z        movement of the centre of the target's near face from
                 rest: x along the jaw towards the tail, y across, z away
                 from the board. A press is a negative z.
  rx, ry, rz     rotation about that point, Rx(rx) Ry(ry) Rz(rz):
                 a positive ry brings its +x side nearer to the board.
  normal         force towards the board, positive; shear_x and shear_y push
                 along +x and +y; moment_x and moment_y turn about them. All
                 act on the middle of the outermost face. The target tilts
                 freely; with rotation=held a flat face keeps it level, as in
                 data sheets and calibrations without moments.
  L, R           at the contacts, as the converter sees them, with all metal
                 around and the other coils idle.
  by target      change of the winding's inductance by the target alone.
  +-             stated error of that change, relative to the change or to
                 1 % of the free winding's inductance if that is larger.
  counts         result of the converter, as its header in firmware/ gives
                 it: in proportion to the frequency.
  Rp             parallel resistance of the tank.

\b
Sensing performance (--performance); JSON has it for each load:
  range          largest load on the axis, and what limits it first.
  resolution     one sigma of the converter's noise, in force.
  nonlinearity   distance from the best straight line, relative to the range.
  crosstalk      error per full scale of another axis, relative to the range,
                 by the polynomial that fits this design as drawn best (the
                 data sheet has the crosstalk of the map in calibration/, too).
  largest error  largest of the errors by cause, one sigma, that remain after
                 tare and calibration; also the error by shear that the
                 array does not measure. The remaining error from unit to
                 unit is in the data sheet and in plan.txt.
  condition      condition number of the map from loads to frequencies, in
                 full scales: 1 is best; far above 10, the axes can hardly
                 be separated.
"""


@click.command(cls=Example, details=RESPONSE_WORDS,
               example="sitscad response sensor.yaml --pose z=-0.2,ry=1 --load normal=4.8,shear_x=1")
@click.argument("spec", type=click.Path())
@click.option("--pose", "poses", multiple=True, metavar="x=0.5,...", help="A pose: x, y, z (mm), rx, ry, rz (degrees).")
@click.option("--poses", "pose_files", multiple=True, metavar="FILE", help="Poses of a CSV file; x_m or rx_rad for SI.")
@click.option("--load", "loads", multiple=True, metavar="normal=4.8,...",
              help="A load: normal, shear_x, shear_y (N), moment_x, moment_y (N mm).")
@click.option("--loads", "load_files", multiple=True, metavar="FILE", help="Loads of a CSV file.")
@click.option("--scan", "scans", multiple=True, metavar="x=-2:2:41,...", help="FIRST:LAST:COUNT of any of these names.")
@click.option("--case", "cases", multiple=True, metavar="NAME", help="A load case of the spec's loads, or all of them.")
@click.option(
    "--frequency", metavar="FREQUENCY",
    help="Frequency of L and R, like 5MHz (default: each coil's own tank frequency).",
)
@click.option("--tolerance", type=RELATIVE_ERROR,
              help="Largest relative error of a map of many poses; points with a larger stated error have a note.")
@click.option("--jacobian", is_flag=True, help="Add the derivatives of the frequencies by pose and load.")
@click.option("--performance", is_flag=True, help="Add the sensing performance, in newtons (2 to 4 s more).")
@click.option("--cell", type=click.IntRange(1), help="Number of the cell, for a sensor with cells.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json|csv")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="A file instead: .npz, .csv or .json.")
def response(
    spec: str, frequency: str | None, tolerance: float | None, jacobian: bool, performance: bool,
    cell: int | None, format_name: str, output: str | None, **moved: tuple[str, ...],
) -> int:
    """Print the coil readings at poses and under loads.

    Poses, loads, files and scans can be repeated. Without any, the sensor is at rest. Points come in this order: poses,
    files of poses, scans over poses, loads, files of loads, scans over loads, load cases (--case scissor, --case all).
    A scan is the product of its ranges; the last range changes fastest.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec cannot be read, or has no target
    to respond to.
    """
    from sitscad.assembly.places.motions import MotionError, frequency_of, read_motions
    from sitscad.estimates.design import respond_to
    from sitscad.estimates.performance.tables import PerformanceReport
    from sitscad.files.report.response import RESPONSE_FILES, RESPONSE_FORMATS, response_file
    from sitscad.package.inspection import as_configured

    show = row_of(RESPONSE_FORMATS, format_name, "--format")
    ending = os.path.splitext(output or "")[1].lower()
    if output:
        row_of(dict.fromkeys(RESPONSE_FILES), ending, "-o")
    try:
        motions = read_motions(**moved)
        at = frequency_of(frequency) if frequency else None
    except MotionError as error:
        raise click.UsageError(str(error)) from error
    for message in motions.passed_over:
        print_message(message)
    loaded = spec_of(spec)
    if loaded is None:
        return 2
    whole = sitscad.Design(loaded)
    design = _of_cell(whole, cell)
    progress = progress_of("poses solved") if len(motions) > MANY else None
    try:
        readings = respond_to(design, motions, at, tolerance, progress, jacobian)
    except sitscad.NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    report = PerformanceReport(design.performance, design.spec) if performance else None
    if performance and (reason := design.sensing.no_performance):
        print_message(f"no performance: {reason}")
    if output:
        write_output(output, response_file(spec, readings, ending, report))
        print_message(f"wrote {output}: {counted(len(readings), 'point')}")
    else:
        print_result(show(spec, readings, coloured(sys.stdout), report))
    result = sitscad.check(loaded, whole.layout, whole.estimates, hints="none")
    return exit_code_of(as_configured(loaded, result), spec)


def _of_cell(whole: sitscad.Design, number: int | None) -> sitscad.Design:
    """Return the design of a cell, or the whole design if no number is given.

    Raises click.BadParameter for other numbers.
    """
    try:
        return whole if number is None else whole.cells.by_number(number)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--cell") from error


MANY = 200
"""Number of points above which progress is shown."""


CALIBRATION_FILES = """
\b
Files:
  calibration.h     the map in C99: no heap, sitscad_forces() and its tare.
  example.c         a program that calls it: counts in, newtons out.
  calibration.json  the same for programs; sitscad.map_of reads it.
  calibration.html  errors, unknowns, and every point with its residual.
  plan.csv, .txt    the points to take (without DATA).
  measured.csv      the points that were taken (--from).
"""


@click.command(cls=Example, details=CALIBRATION_FILES,
               example="sitscad calibrate sensor.yaml && sitscad calibrate sensor.yaml measured.csv")
@click.argument("spec", required=False, metavar="SPEC", type=click.Path())
@click.argument("data", required=False, type=click.Path())
@click.option("-o", "--output", type=click.Path(file_okay=False),
              help="Folder of the files (default: NAME-calibration).")
@click.option("--points", type=click.IntRange(3, 40), default=8, show_default=True, help="Number of planned loads.")
@click.option(
    "--rotation", metavar="held|free",
    help="A flat face keeps the loaded target level, or it tilts freely.  [default: from DATA, else held]",
)
@click.option("--from", "source", metavar="SOURCE", help="Take the points on this source now (SOURCE of `read`).")
@click.option("--creep", type=InRange(0, DAY), metavar="SECONDS",
              help="Rest of the pad under a load before a reading (--from).  [default: 10; sim: 0]")
@click.option("--cell", type=click.IntRange(1), help="Number of the cell, for a sensor with cells.")
def calibrate(
    spec: str | None, data: str | None, output: str | None, points: int, rotation: str | None, source: str | None,
    creep: float | None, cell: int | None,
) -> int:
    """Plan a calibration, or fit the points of DATA.

    Without DATA, it writes plan.csv with the most informative loads, and plan.txt with instructions. It also writes the
    map from counts to newtons for the sensor as drawn, with the error of that map on manufactured sensors.

    DATA is that table filled in, or another CSV file. Its header names loads (normal_N, shear_x_N, shear_y_N) or
    poses from rest (x_mm, y_mm, z_mm, rx_deg, ry_deg, rz_deg), and every coil with its unit (C1_counts, C1_Hz, C1_uH).
    A row without load is a tare, and applies to the rows after it. At least three other points are needed; five to ten
    are better.

    With --from, the command leads through the plan point by point. It prints the load to apply, waits until the
    readings are stable, and adds each point to measured.csv at once. After Ctrl-C, the same command continues there. A
    point is repeated if its readings are faulty, unstable, or far from the readings expected under the load. "back"
    repeats the point before. Type the newtons if the real load differs from the plan. At the end the sensor is fitted.
    sim:SPEC?unit=1 is loaded by the plan itself, for a trial without a board.

    The fit first determines the model's few unknowns (gap, offsets, tilts, modulus, coils, capacitors), limited by the
    scatter of manufacture. Then it corrects the remaining error, if the points show that this helps. Tables that no
    sensor of this spec could give are refused, with file:line:column.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec or the data cannot be read, a
    point could not be taken, or there is nothing to calibrate.
    """
    from sitscad.files.report.calibration import calibration_text
    from sitscad.package.inspection import as_configured

    if spec is None:
        like = f", as in `sitscad calibrate sensor.yaml --from {source}`" if source else ""
        raise click.UsageError(f"SPEC, the sensor that is calibrated, is missing{like}.")
    if data is not None and source is not None:
        raise click.UsageError("DATA was taken before, --from takes points now: one of both")
    if rotation not in (None, "held", "free"):
        raise click.BadParameter(f"{rotation!r} is not one of held, free", param_hint="--rotation")
    loaded = spec_of(spec)
    if loaded is None:
        return 2
    whole = sitscad.Design(loaded)
    design = _of_cell(whole, cell)
    cell = None if loaded.cells is None else cell
    folder = output or f"{loaded.name}-calibration{f'-cell-{cell}' if cell else ''}"
    try:
        if source is not None:
            data = f"{folder}/measured.csv"
            planned = replace(sitscad.calibrate(design, rotation=rotation, points=points), cell=cell)
            if not take_points(whole, planned, source, data, creep):
                return 2
        calibration = replace(sitscad.calibrate(design, data, rotation=rotation, points=points), cell=cell)
    except sitscad.BenchError as error:
        print_message(str(error))
        return 2
    except sitscad.NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    for path in sitscad.write_calibration(calibration, folder):
        print_message(f"wrote {path}")
    print_result(calibration_text(calibration))
    return exit_code_of(as_configured(loaded, sitscad.check(loaded, whole.layout, whole.estimates, "none")), spec)
