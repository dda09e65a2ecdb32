"""`sitscad calibrate`: the map from readings to forces. Its points can be taken one by one on the terminal."""

from __future__ import annotations

import os
import select
import sys
from dataclasses import replace
from pathlib import Path

import click

from sitscad.apps.hardware.leading import GuidedCalibration, PointRefused
from sitscad.apps.hardware.source import open_source
from sitscad.calibration import Calibration
from sitscad.calibration import calibrate as calibrate_design
from sitscad.calibration.bench_data import BenchError
from sitscad.checks.judging import check
from sitscad.cli.estimating import cell_of
from sitscad.cli.specs import exit_code_of, spec_of
from sitscad.cli.terminal import DAY, Example, InRange, print_message, print_result, write_output
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import NoResponse
from sitscad.files.report.calibration import calibration_text
from sitscad.package.contents import write_calibration
from sitscad.package.inspection import as_configured


def take_points(
    design: Design, calibration: Calibration, source: str, table: str, creep: float | None
) -> bool:
    """Measure the points of a plan, and write each into a table. Return whether the table is complete.

    `source` is the board as in `sitscad read`, and `table` the path of the table. A point is read `creep` seconds after
    the load is applied. Raises click.UsageError if `source` is not a board of this sensor.
    """
    path = Path(table)
    try:
        origin, _ = open_source(source, design)
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
    click.echo(f"{prompt}: ", err=True, nl=False)
    # A blocking read loses a Ctrl-C just before it. On a terminal, wait with select first, then read
    is_typed = not (sys.stdin and sys.stdin.isatty() and os.name == "posix")
    while not is_typed:
        is_typed = bool(select.select([sys.stdin], [], [], 0.3)[0])
    if not (typed := sys.stdin.readline() if sys.stdin else ""):
        raise click.Abort
    return typed.strip()


CALIBRATION_FILES = """
\b
Files:
  calibration.h     the map in C99: no heap, sitscad_forces() and its tare.
  example.c         a program that calls it: counts in, newtons out.
  temperature.h     compensation of drift (with readout.compensation).
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
    With readout.compensation, a column temperature_degC gives the temperature of each row. Rows at a second temperature
    (see plan.txt) give the coefficients of drift for temperature.h, which is not extrapolated beyond them.

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
    whole = Design(loaded)
    design = cell_of(whole, cell)
    cell = None if loaded.cells is None else cell
    folder = output or f"{loaded.name}-calibration{f'-cell-{cell}' if cell else ''}"
    try:
        if source is not None:
            data = f"{folder}/measured.csv"
            planned = replace(calibrate_design(design, rotation=rotation, points=points), cell=cell)
            if not take_points(whole, planned, source, data, creep):
                return 2
        calibration = replace(calibrate_design(design, data, rotation=rotation, points=points), cell=cell)
    except BenchError as error:
        print_message(str(error))
        return 2
    except NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    for path in write_calibration(calibration, folder):
        print_message(f"wrote {path}")
    print_result(calibration_text(calibration))
    return exit_code_of(as_configured(loaded, check(loaded, whole.layout, whole.estimates, "none")), spec)
