"""`sitscad estimate` and `response`: electrical figures, and readings when the target moves or is pushed."""

from __future__ import annotations

import os
import sys

import click

from sitscad.assembly.places.motions import MotionError, frequency_of, read_motions
from sitscad.basics.units import count_text
from sitscad.checks.judging import check
from sitscad.checks.opening import check_unreadable, nearest_policy_of_spec, open_spec
from sitscad.cli.measured import measured_options, print_comparison
from sitscad.cli.specs import exit_code_of, spec_of
from sitscad.cli.terminal import (
    RELATIVE_ERROR,
    Example,
    coloured,
    print_message,
    print_result,
    progress_of,
    row_of,
    write_output,
)
from sitscad.estimates import METHODS, missed_tolerance
from sitscad.estimates import estimate as estimate_layout
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance.tables import PerformanceReport
from sitscad.estimates.requested_response import respond_to
from sitscad.estimates.states.at_frequency import FrequencyError, coils_at
from sitscad.files.report.numbers import ESTIMATE_FORMATS
from sitscad.files.report.response import RESPONSE_FILES, RESPONSE_FORMATS, response_file
from sitscad.layout import lay_out
from sitscad.package.inspection import as_configured
from sitscad.spec.reading import SpecError


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
    show = row_of(ESTIMATE_FORMATS, format_name, "--format")
    if method is not None:
        row_of({row.name: row for row in METHODS}, method, "--method")
    try:
        loaded = open_spec(spec, nearest_policy_of_spec(spec))
    except SpecError as error:
        unread = check_unreadable(spec, error)
        print_result(show(spec, None, unread, coloured(sys.stdout), None, None, ()))
        return unread.exit_code
    layout = lay_out(loaded)
    if measured is not None:
        return print_comparison(layout, measured, name, meter_error, format_name, overlay)
    if overlay or name:
        raise click.UsageError("--overlay and --coil go with --measured DATA")
    try:
        estimates = estimate_layout(layout, method=method, tolerance=tolerance)
    except ValueError as error:
        if method is None:
            raise
        raise click.BadParameter(str(error), param_hint="--method") from error
    try:
        coils = coils_at(layout, tuple(map(frequency_of, at)), method, tolerance)
    except (MotionError, FrequencyError) as error:
        raise click.BadParameter(str(error), param_hint="--at") from error
    result = check(loaded, layout, estimates if method is None else None, hints="none")
    checked = as_configured(loaded, result)
    design = Design(loaded, layout, estimates)
    report = PerformanceReport(design.performance, design.spec) if performance else None
    if performance and (reason := design.sensing.reason_without_performance):
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
    show = row_of(RESPONSE_FORMATS, format_name, "--format")
    ending = os.path.splitext(output or "")[1].lower()
    if output:
        row_of(dict.fromkeys(RESPONSE_FILES), ending, "-o")
    try:
        motions = read_motions(**moved)
        at = frequency_of(frequency) if frequency else None
    except MotionError as error:
        raise click.UsageError(str(error)) from error
    for message in motions.skipped_rows:
        print_message(message)
    loaded = spec_of(spec)
    if loaded is None:
        return 2
    whole = Design(loaded)
    design = cell_of(whole, cell)
    progress = progress_of("poses solved") if len(motions) > MANY else None
    try:
        readings = respond_to(design.response, motions, at, tolerance, progress, jacobian)
    except NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    report = PerformanceReport(design.performance, design.spec) if performance else None
    if performance and (reason := design.sensing.reason_without_performance):
        print_message(f"no performance: {reason}")
    if output:
        write_output(output, response_file(spec, readings, ending, report))
        print_message(f"wrote {output}: {count_text(len(readings), 'point')}")
    else:
        print_result(show(spec, readings, coloured(sys.stdout), report))
    result = check(loaded, whole.layout, whole.estimates, hints="none")
    return exit_code_of(as_configured(loaded, result), spec)


def cell_of(whole: Design, number: int | None) -> Design:
    """Return the design of the cell with this number, or the whole design if `number` is None.

    Raises click.BadParameter for a number without a cell.
    """
    try:
        return whole if number is None else whole.cells.by_number(number)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--cell") from error


MANY = 200
"""Number of points above which progress is shown."""
