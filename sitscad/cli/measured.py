"""The option `--measured` of `sitscad coil` and `sitscad estimate`: comparison of a measured coil with its estimate."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import click

from sitscad.apps.coil.comparison import compare
from sitscad.apps.coil.drawn import DrawnCoil
from sitscad.apps.coil.measurement import MeasurementError
from sitscad.apps.coil.spiral import Spiral
from sitscad.apps.coil.text import COMPARISON_FORMATS, comparison_picture
from sitscad.assembly.solids import MissingExtra
from sitscad.cli.terminal import InRange, coloured, print_message, print_result, row_of, write_output
from sitscad.layout.board import Layout


def measured_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the comparison with a measurement to a command."""
    for option in (
        click.option("--overlay", type=click.Path(dir_okay=False),
                     help="Write a picture of measured and computed L and R to this file (--measured)."),
        click.option("--meter-error", type=InRange(0.01, 20), default=0.3, show_default=True, metavar="PERCENT",
                     help="Error of the meter (--measured)."),
        click.option("--measured", type=click.Path(dir_okay=False), metavar="DATA",
                     help="Compare with a measured impedance: Touchstone (.s1p), or CSV of frequency with R and X, L "
                          "and R, L and Q, or Z and phase."),
    ):
        command = option(command)
    return command


def print_comparison(
    coil: Spiral | DrawnCoil | Layout, data: str, name: str | None, meter_error: float, format_name: str,
    overlay: str | None,
) -> int:
    """Print the comparison of a coil with the measurement in the file `data`. Return the exit code.

    `name` selects a coil of a layout. `meter_error` is the meter's relative error, and `overlay` the path of a picture
    to write.
    """
    show = row_of(COMPARISON_FORMATS, format_name, "--format")
    try:
        comparison = compare(coil, data, name, 0.01 * meter_error)
        picture = comparison_picture(comparison) if overlay else ""
    except (MeasurementError, MissingExtra) as error:
        print_message(str(error))
        return 2
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--coil") from error
    print_result(show(comparison, coloured(sys.stdout)))
    if overlay:
        write_output(overlay, picture.encode("utf-8"))
        print_message(f"wrote {overlay}")
    return 0
