"""`sitscad response`: what the coils read when the target moves or is pushed."""

from __future__ import annotations

import os
import sys

import click

import sitscad
from sitscad.cli.asking import Example, Tolerance, row_of
from sitscad.cli.telling import coloured, counted, opened_or_told, print_result, say, told_errors


@click.command(cls=Example, example="sitscad response sensor.yaml --pose z=-0.2,ry=1 --load normal=4.8,shear_x=1")
@click.argument("spec", type=click.Path())
@click.option("--pose", "poses", multiple=True, metavar="x=0.5,...", help="A pose: x, y, z (mm), rx, ry, rz (degrees).")
@click.option("--poses", "pose_files", multiple=True, metavar="FILE", help="Poses of a CSV file; x_m or rx_rad for SI.")
@click.option("--load", "loads", multiple=True, metavar="normal=4.8,...", help="A load: normal, shear_x, shear_y (N).")
@click.option("--loads", "load_files", multiple=True, metavar="FILE", help="Loads of a CSV file.")
@click.option("--scan", "scans", multiple=True, metavar="x=-2:2:41,...", help="FIRST:LAST:COUNT of any of these names.")
@click.option("--case", "cases", multiple=True, metavar="NAME", help="A load case of the spec's loads, or all of them.")
@click.option(
    "--method", default="law", show_default=True, metavar="law|finite-elements",
    help="How loads become poses; finite elements are slow.",
)  # fmt: skip
@click.option(
    "--frequency",
    metavar="FREQUENCY",
    help="Where L and R are taken, like 5MHz (default: each coil's own tank frequency).",
)
@click.option("--tolerance", type=Tolerance(), help="What a map of many poses may be off by.")
@click.option("--jacobian", is_flag=True, help="Add the derivatives of the frequencies by pose and load.")
@click.option("--performance", is_flag=True, help="Say what the sensor feels, in newtons (2 to 4 s more).")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json|csv")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="A file instead: .npz, .csv or .json.")
def response(
    spec: str,
    poses: tuple[str, ...],
    pose_files: tuple[str, ...],
    loads: tuple[str, ...],
    load_files: tuple[str, ...],
    scans: tuple[str, ...],
    cases: tuple[str, ...],
    method: str,
    frequency: str | None,
    tolerance: float | None,
    jacobian: bool,
    performance: bool,
    format_name: str,
    output: str | None,
) -> int:
    """Print what the coils read at poses and under loads.

    Any number of poses, loads, files and scans; at rest where none is given. Points come in this order: poses, files
    of poses, scans over poses, loads, files of loads, scans over loads, load cases (--case scissor, --case all). A scan
    is the product of its ranges, the last one fastest.

    \b
    Axes and words:
      x, y, z        how far the centre of the target's near face has gone from
                     rest: x along the jaw towards the tail, y across, z away
                     from the board. A press is a negative z.
      rx, ry, rz     how it is turned about that point, Rx(rx) Ry(ry) Rz(rz):
                     a positive ry brings its +x side nearer to the board.
      normal         force towards the board, positive; shear_x and shear_y push
                     along +x and +y. The target tilts as it likes; with
                     rotation=held a flat face keeps it level, as in data sheets
                     and calibrations.
      L, R           what the converter sees at the contacts, with everything
                     around and the other coils idle.
      by target      what the target alone changes of the winding's inductance.
      +-             stated error of that, relative to the larger of it and 1 %
                     of the free winding's inductance.
      counts         of the converter, as its header in firmware/ makes them of
                     results: in proportion to the frequency.
      Rp             parallel resistance of the tank.

    \b
    What the sensor feels (--performance), at rest, half and full load:
      range          how far the axis goes, and what ends it first.
      noise          one sigma of the converter's noise, in force.
      nonlinear      distance from the best straight line, of the range.
      crosstalk      error per full scale of another axis, of the range, after
                     the curved map (the data sheet has both).
      error          the largest of the errors by cause, one sigma, that neither
                     tare nor calibration takes away: also what shear does that
                     the array does not measure. What a calibration leaves from
                     unit to unit stands in the data sheet and in plan.txt.
      condition      of the map from loads to frequencies, in full scales: 1 is
                     best, far above 10 one axis is hardly told from another.

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec cannot be read, or has nothing
    that could respond.
    """  # noqa: D301 - click asks for the control character itself
    show = row_of(sitscad.RESPONSE_FORMATS, format_name, "--format")
    row_of(dict.fromkeys(sitscad.LOAD_METHODS), method, "--method")
    ending = os.path.splitext(output or "")[1].lower()
    if output:
        row_of(dict.fromkeys(sitscad.RESPONSE_FILES), ending, "-o")
    try:
        motions = sitscad.read_motions(poses, pose_files, loads, load_files, scans, cases)
        at = sitscad.frequency_of(frequency) if frequency else None
    except sitscad.MotionError as error:
        raise click.UsageError(str(error)) from error
    for words in motions.passed_over:
        say(words)
    loaded = opened_or_told(spec)
    if loaded is None:
        return 2
    design = sitscad.Design(loaded)
    progress = _points if sys.stderr.isatty() and len(motions) > MANY else None
    try:
        found = sitscad.respond_to(design, motions, at, tolerance, progress, jacobian, method != "law")
    except sitscad.NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    felt = design.performance if performance else None
    if output:
        sitscad.write_file(output, sitscad.response_file(spec, found, ending, felt))
        say(f"wrote {output}: {counted(len(found), 'point')}")
    else:
        print_result(show(spec, found, coloured(sys.stdout), felt))
    result = sitscad.check(loaded, design.layout, design.estimates)
    return told_errors(sitscad.as_configured(loaded, result), spec)


MANY = 200
"""Points from which on progress is shown."""


def _points(done: int, of: int) -> None:
    """How far a response is, on one line of a terminal."""
    click.echo(f"\r  {done} of {of} poses solved" + ("\n" if done >= of else ""), err=True, nl=False)
