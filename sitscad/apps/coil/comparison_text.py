"""The comparison of a measured coil with the computed one, as text, as JSON and as a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sitscad.apps.coil.comparison import Comparison
from sitscad.basics.quantities import Table
from sitscad.basics.units import count_text, escape_controls, quantity, show
from sitscad.checks.findings import styled, to_json
from sitscad.files.drawing.sheet import Sheet, plot
from sitscad.files.drawing.svg import svg
from sitscad.files.report.numbers import table_text

ROWS = 8
"""Largest number of frequencies in the table of the text."""


def comparison_as_text(comparison: Comparison, colour: bool = False) -> str:
    """Return the verdict, measured and computed figures, fitted values, and the causes that were tried."""
    count = len(comparison.measurement.frequencies)
    lines = [
        styled(escape_controls(comparison.verdict), "bold", colour),
        escape_controls(f"coil {comparison.coil}, {comparison.measurement.path}: {count_text(count, 'point')}, meter "
                        f"within "
                        f"{100.0 * comparison.meter_error:.2g} %"),
    ]
    if comparison.left_out:
        lines.append(f"{count_text(comparison.left_out, 'point')} near to or above the self-resonance left out")
    tables = (_points(comparison), _fit(comparison), _causes(comparison))
    return "\n\n".join(["\n".join(lines), *(table_text(each, colour) for each in tables)]) + "\n"


def _points(comparison: Comparison) -> Table:
    """Return measured and computed series values at a few frequencies."""
    numbers = np.unique(np.linspace(0, len(comparison.frequencies) - 1, ROWS).round().astype(int)).tolist()
    rows = []
    for k in numbers:
        frequency, read, computed = (
            comparison.frequencies[k].item(), comparison.measured[k].item(), comparison.drawn.impedances[k].item())
        omega = 2.0 * math.pi * frequency
        rows.append([
            show(frequency, "Hz"), show(read.imag / omega, "H"), show(computed.imag / omega, "H"),
            _deviation_text(read.imag, computed.imag), show(read.real, "ohm"), show(computed.real, "ohm"),
            _deviation_text(read.real, computed.real)])
    head = ("frequency", "L measured", "computed", "", "R measured", "computed", "")
    return Table(head, rows, "In series, as a meter shows them")


def _deviation_text(measured: float, computed: float) -> str:
    return f"{100.0 * (measured / computed - 1.0):+.1f} %"


def _fit(comparison: Comparison) -> Table:
    """Return the fitted values of the measured coil, each with its standard deviation."""
    fit = comparison.fit
    rows = [
        ["inductance", quantity(fit.inductance, "H"), show(fit.inductance_sigma, "H", 2)],
        ["resistance", quantity(fit.resistance, "ohm"), show(fit.resistance_sigma, "ohm", 2)],
    ]
    if fit.capacitance is not None and fit.capacitance_sigma is not None:
        rows.append(["capacitance", quantity(fit.capacitance, "F", 3), show(fit.capacitance_sigma, "F", 2)])
    notes = [] if fit.capacitance is not None else ["the points do not show the capacitance: measure nearer to the "
                                                    "self-resonance"]
    return Table(("fitted", "", "sigma"), rows, f"The measured coil at {show(fit.frequency, 'Hz', 3)}", notes)


def _causes(comparison: Comparison) -> Table:
    """Return the causes, the best first, with their misfit."""
    marks = {id(comparison.cause): "most likely", **{id(each): "not excluded" for each in comparison.alternatives}}
    if comparison.is_as_drawn:
        marks[id(comparison.drawn)] = "agrees"
    rows = [[each.text, f"{each.chi_square:.0f}", marks.get(id(each), "")]
            for each in (comparison.drawn, *comparison.explanations[:ROWS])]
    count = 2 * len(comparison.frequencies)
    return Table(("cause", "chi-square", ""), rows, "Causes that were tried, the best first",
                 [f"chi-square is about {count} or less if only errors of meter, model and manufacture are left"])


def comparison_as_json(comparison: Comparison, colour: bool = False) -> str:
    """Return the JSON document of a comparison."""
    return to_json(comparison.document())


COMPARISON_FORMATS: Mapping[str, Callable[[Comparison, bool], str]] = {
    "text": comparison_as_text, "json": comparison_as_json}
"""Output formats of ``--measured``."""

SIZE = (180.0, 75.0)
"""Size (mm) of the picture."""


def comparison_picture(comparison: Comparison) -> str:
    """Return a picture (SVG) of measured and computed inductance and resistance over the frequency.

    Raises `MissingExtra` if matplotlib is not installed.
    """
    sheet = Sheet("measured and computed coil", SIZE, decimals=3)
    plot(sheet, (0.0, 0.0, *SIZE), lambda figure: _draw(comparison, figure))
    return svg(sheet)


def _draw(comparison: Comparison, figure: Any) -> None:
    omega = 2.0 * math.pi * comparison.frequencies
    curves = [("as drawn", comparison.drawn.impedances, "-")]
    best = comparison.cause
    if best is not None:
        curves.append((best.cause, best.impedances, "--"))
    for axes, label, values in zip(
        figure.subplots(1, 2), ("inductance (uH)", "resistance (ohm)"),
        (lambda z: 1e6 * z.imag / omega, lambda z: z.real), strict=True,
    ):
        megahertz = 1e-6 * comparison.frequencies
        axes.plot(megahertz, values(comparison.measured), "o", markersize=2.5, color="#5c6670", label="measured")
        for name, impedances, dashes in curves:
            axes.plot(megahertz, values(impedances), dashes, label=name)
        axes.set(xlabel="frequency (MHz)", ylabel=label, xscale="log")
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(lambda value, _: "")
        axes.legend()
