"""`sitscad estimate`: the electrical numbers."""

from __future__ import annotations

import sys

import click

import sitscad
from sitscad.cli.asking import Example, Tolerance, row_of
from sitscad.cli.telling import coloured, print_result, say, told_errors


@click.command(cls=Example, example="sitscad estimate sensor.yaml --format json --tolerance 1e-3")
@click.argument("spec", type=click.Path())
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json")
@click.option("--tolerance", type=Tolerance(), help="Relative error of the inductance.")
@click.option(
    "--method", metavar="NAME", help="The inductance method (default: the cheapest that meets the tolerance)."
)
@click.option("--performance", is_flag=True, help="Say what the sensor feels, in newtons (2 to 4 s more).")
def estimate(spec: str, format_name: str, tolerance: float | None, method: str | None, performance: bool) -> int:
    """Print the electrical numbers of SPEC.

    Inductance, resistance and frequency of every coil, free, at rest and pressed, and the readout's settings; with
    --performance what the sensor feels, too, in newtons.

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
    show = row_of(sitscad.ESTIMATE_FORMATS, format_name, "--format")
    if method is not None:
        row_of({row.name: row for row in sitscad.METHODS}, method, "--method")
    try:
        loaded = sitscad.opened(spec, sitscad.policy_for(spec))
    except sitscad.SpecError as error:
        unread = sitscad.unreadable(spec, error)
        print_result(show(spec, None, unread, coloured(sys.stdout), None, ()))
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
    design = sitscad.Design(loaded, layout, estimates)
    felt = design.performance if performance else None
    print_result(show(spec, estimates, checked, coloured(sys.stdout), felt, design.most_signal))
    worst = max(estimates.coils, key=lambda coil: coil.inductance_error)
    if tolerance is not None and worst.inductance_error > tolerance:
        asked = f"the method {method} does not meet" if method else "no method meets"
        say(f"{asked} a tolerance of {tolerance:g} for this coil: {worst.method} states {worst.inductance_error:.2g}")
    return told_errors(checked, spec)
