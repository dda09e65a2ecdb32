"""Results for a coil, and its comparison with a measurement, as text, JSON and picture.

Each output format is one function and one entry in a mapping.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sitscad.apps.coil.comparison import Comparison
from sitscad.apps.coil.drawn import DrawnCoil
from sitscad.apps.coil.spiral import Spiral, lumped_frequency
from sitscad.basics.quantities import (
    DRAWN_COIL,
    DRAWN_COIL_AT_FREQUENCY,
    LONE_COIL,
    LONE_COIL_AT_FREQUENCY,
    Table,
    by_quantity,
    by_result,
)
from sitscad.basics.units import count_text, escape_controls, quantity, show
from sitscad.checks.findings import styled, to_json
from sitscad.files.drawing.sheet import Sheet, draw_figure
from sitscad.files.drawing.svg import svg
from sitscad.files.report.numbers import table_text


def as_text(spiral: Spiral, colour: bool = False) -> str:
    """Return dimensions, electrical values with errors, and results of published formulas as text."""
    coil = spiral.coil
    outer, inner = (" x ".join(show(each, "m") for each in sorted(set(size), reverse=True))
                    for size in (coil.size, coil.inner_size))
    layers = f"{len(coil.layers)} layer{'s in series' if len(coil.layers) > 1 else ''}"
    lines = (
        f"{coil.shape}, {coil.turns_in_words} turns, {layers}, {outer} outside, {inner} inside",
        f"tracks {show(coil.trace_width, 'm')}, gaps {show(coil.trace_spacing, 'm')}, stack-up {spiral.stackup}, "
        f"{spiral.temperature:g} C; without leads, no metal near",
    )
    notes = ["Q and Rp are those of the coil with a lossless capacitor; an LCR meter also sees the coil's capacitance"]
    rows = by_quantity([spiral], LONE_COIL)
    if spiral.self_resonance is None:
        limit = show(lumped_frequency(spiral.layout.coils[0]), "Hz", 2)
        rows = [row for row in rows if not row[0].startswith("self-resonance")]
        rows.append(["self-resonance", f"above {limit}, where the track is a tenth of a wavelength"])
    tables = (
        by_result(spiral.at, LONE_COIL_AT_FREQUENCY)._replace(notes=notes),
        Table(("", ""), rows, "At every frequency"),
        formula_table(spiral),
    )
    return _join_sections("\n".join((styled(lines[0], "bold", colour), lines[1])), "", tables, colour)


def formula_table(spiral: Spiral) -> Table:
    """Return results of published formulas for the inductance, with the current spread evenly over the track."""
    title = "Closed formulas (Mohan 1999), to compare with"
    if spiral.no_formula:
        return Table((), [[spiral.no_formula]], title)
    rows = [[each.method, quantity(each.inductance, "H"), f"{100.0 * each.deviation:+.1f} %",
             "yes" if each.is_valid else "no", each.validity] for each in spiral.formulas]
    return Table(("formula", "inductance", "against ours", "in its range", "range"), rows, title)


def drawn_as_text(coil: DrawnCoil, colour: bool = False) -> str:
    """Return the conductor that was found in the drawing, remarks on it, and its electrical values as text."""
    conductor = coil.conductor
    vias = count_text(len(conductor.vias), "via")
    runs = [[layer, f"{turns:+.2f}"] for layer, turns in conductor.turns()]
    first = f"from {conductor.ends[0]} to {conductor.ends[1]}: {vias}, tracks {show(conductor.width, 'm')}, "
    first += f"stack-up {coil.stackup or 'of the board'}"
    remarks = "\n".join(styled(f"note: {escape_controls(note)}", "yellow", colour) for note in coil.notes)
    tables = (
        Table(("layer", "turns"), runs, notes=["counter-clockwise positive, seen from the top, along the current"]),
        by_result(coil.at, DRAWN_COIL_AT_FREQUENCY)._replace(notes=[
            "L and R are those without the coil's own capacitance" if coil.capacitance is not None else
            "the coil's own capacitance is not computed (--stackup): the figures hold far below its self-resonance"]),
        Table(("", ""), by_quantity([coil], DRAWN_COIL), f"At {coil.temperature:g} C"),
    )
    return _join_sections(styled(escape_controls(first), "bold", colour), remarks, tables, colour)


def _join_sections(title: str, remarks: str, tables: Sequence[Table], colour: bool) -> str:
    """Return a title, remarks (if there are any) and tables, with empty lines between them."""
    blocks = [title, *([remarks] if remarks else []), *(table_text(table, colour) for table in tables)]
    return "\n\n".join(blocks) + "\n"


def as_json(coil: Spiral | DrawnCoil, colour: bool = False) -> str:
    """Return the JSON document of ``sitscad coil``."""
    return to_json(coil.document())


DRAWN_COIL_FORMATS: Mapping[str, Callable[[DrawnCoil, bool], str]] = {"text": drawn_as_text, "json": as_json}
"""Output formats of ``sitscad coil FILE``: functions of the coil and of the use of colour, by name."""

COIL_FORMATS: Mapping[str, Callable[[Spiral, bool], str]] = {"text": as_text, "json": as_json}
"""Output formats of ``sitscad coil``: functions of the coil and of the use of colour, by name."""


ROWS = 8
"""Largest number of frequencies, and of causes, in the tables of the text."""


def comparison_as_text(comparison: Comparison, colour: bool = False) -> str:
    """Return the result of a comparison, measured and computed values, fitted values, and all tried causes as text."""
    count = len(comparison.measurement.frequencies)
    lines = [
        styled(escape_controls(comparison.verdict), "bold", colour),
        escape_controls(f"coil {comparison.coil}, {comparison.measurement.path}: {count_text(count, 'point')}, meter "
                        f"within "
                        f"{100.0 * comparison.meter_error:.2g} %"),
    ]
    if comparison.left_out:
        lines.append(f"{count_text(comparison.left_out, 'point')} near to or above the self-resonance left out")
    tables = (_points_table(comparison), _fit_table(comparison), _causes_table(comparison))
    return "\n\n".join(["\n".join(lines), *(table_text(each, colour) for each in tables)]) + "\n"


def _points_table(comparison: Comparison) -> Table:
    """Return a table of measured and computed series values at a few frequencies."""
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


def _fit_table(comparison: Comparison) -> Table:
    """Return a table of the fitted values of the measured coil, each with its standard deviation."""
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


def _causes_table(comparison: Comparison) -> Table:
    """Return a table of the tried causes with their chi-squares, the best cause first."""
    marks = {id(comparison.cause): "most likely", **{id(each): "not excluded" for each in comparison.alternatives}}
    if comparison.is_as_drawn:
        marks[id(comparison.drawn)] = "agrees"
    rows = [[each.text, f"{each.chi_square:.0f}", marks.get(id(each), "")]
            for each in (comparison.drawn, *comparison.explanations[:ROWS])]
    count = 2 * len(comparison.frequencies)
    return Table(("cause", "chi-square", ""), rows, "Causes that were tried, the best first",
                 [f"chi-square is about {count} or less if only errors of meter, model and manufacture are left"])


COMPARISON_FORMATS: Mapping[str, Callable[[Comparison, bool], str]] = {
    "text": comparison_as_text, "json": lambda comparison, colour: to_json(comparison.document())}
"""Output formats of ``--measured``: functions of the comparison and of the use of colour, by name."""

SIZE = (180.0, 75.0)
"""Width and height (mm) of the picture."""


def comparison_picture(comparison: Comparison) -> str:
    """Return a picture (SVG) of measured and computed inductance and resistance over frequency.

    Raises `MissingExtra` if matplotlib is not installed.
    """
    sheet = Sheet("measured and computed coil", SIZE, decimals=3)
    draw_figure(sheet, (0.0, 0.0, *SIZE), lambda figure: _draw_comparison(comparison, figure))
    return svg(sheet)


def _draw_comparison(comparison: Comparison, figure: Any) -> None:
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
