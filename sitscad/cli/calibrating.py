"""`sitscad calibrate`: the points worth taking, and the map from readings to forces that they make."""

from __future__ import annotations

import click

import sitscad
from sitscad.cli.asking import Example
from sitscad.cli.telling import opened_or_told, print_result, say, told_errors


@click.command(cls=Example, example="sitscad calibrate sensor.yaml && sitscad calibrate sensor.yaml measured.csv")
@click.argument("spec", type=click.Path())
@click.argument("data", required=False, type=click.Path())
@click.option("-o", "--output", type=click.Path(file_okay=False), help="Where files go (default: NAME-calibration).")
@click.option("--points", type=click.IntRange(3, 40), default=8, show_default=True, help="Loads that are planned.")
@click.option(
    "--rotation",
    metavar="held|free",
    help="A flat face keeps the loaded target level, or it tilts as it likes.  [default: what DATA says, else held]",
)
def calibrate(spec: str, data: str | None, output: str | None, points: int, rotation: str | None) -> int:
    """Plan a calibration, or fit the points of DATA.

    Without DATA it writes plan.csv, the loads that tell most, and plan.txt, how to take them; and the map from counts
    to newtons of the sensor as it is drawn, with the error that it has on sensors as they are made.

    DATA is that table filled in, or another: a CSV file whose header names loads (normal_N, shear_x_N, shear_y_N) or
    poses from rest (x_mm, y_mm, z_mm, rx_deg, ry_deg, rz_deg), and every coil with its unit (C1_counts, C1_Hz, C1_uH).
    A row without load is the tare; every row goes with the tare before it. Three points beside it at least, five to
    ten serve well.

    The model's few unknowns are fitted first (gap, offsets, tilts, modulus, coils, capacitors), held by the scatter of
    manufacture; then what that leaves, where the points say that it serves. Tables that no sensor of this spec would
    give are refused, with file:line:column.

    \b
    Files:
      calibration.h     the map in C99: no heap, sitscad_forces() and its tare.
      example.c         a program that calls it: counts in, newtons out.
      calibration.json  the same for programs; sitscad.map_of reads it.
      calibration.html  errors, unknowns, every point and what is left of it.
      plan.csv, .txt    the points to take (without DATA).

    Exit code: 0 no errors, 1 the checks found errors (see `sitscad check`), 2 the spec or the data cannot be read, or
    there is nothing to calibrate.
    """  # noqa: D301 - click asks for the control character itself
    if rotation not in (None, "held", "free"):
        raise click.BadParameter(f"{rotation!r} is not one of held, free", param_hint="--rotation")
    loaded = opened_or_told(spec)
    if loaded is None:
        return 2
    design = sitscad.Design(loaded)
    try:
        found = sitscad.calibrate(design, data, rotation=rotation, points=points)
    except sitscad.BenchError as error:
        say(str(error))
        return 2
    except sitscad.NoResponse as error:
        raise click.UsageError(f"{spec}: {error}") from error
    for path in sitscad.write_calibration(found, output or f"{loaded.name}-calibration"):
        say(f"wrote {path}")
    print_result(sitscad.calibration_text(found))
    return told_errors(sitscad.as_configured(loaded, sitscad.check(loaded, design.layout, design.estimates)), spec)
