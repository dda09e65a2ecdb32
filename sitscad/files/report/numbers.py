"""Estimates as text for users and as JSON for programs.

A new format needs one function and one row of `ESTIMATE_FORMATS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sitscad.assembly.places.state import FREE, state_title
from sitscad.basics.quantities import (
    AT_FREQUENCY,
    BARE_TANK,
    COIL,
    COMPRESSION,
    COMPUTED_WITHIN,
    LONE_TIMES,
    METERED,
    OTHERS,
    RATES,
    SCAN_TIMES,
    STEPS,
    TANK,
    TANK_AND_DRIVE,
    Quantity,
    Table,
    by_quantity,
    by_result,
    plus_minus,
)
from sitscad.basics.units import DASH, escape_controls, quantity, show
from sitscad.basics.version import __version__
from sitscad.checks.findings import CheckedSpec, OutputOptions, finding_json, styled, to_json
from sitscad.checks.findings import as_text as as_findings
from sitscad.checks.findings.measures import OTHERS_MEANING, OTHERS_TITLE, signal_table
from sitscad.estimates.coil_estimates import CoilEstimate, CrossCheck, MeterReadings, ReadoutEstimate
from sitscad.files.drawing import web_page
from sitscad.files.drawing.web_page import html_list

if TYPE_CHECKING:
    from sitscad.estimates import Estimates
    from sitscad.estimates.coil_estimates import StateEstimate
    from sitscad.estimates.performance.tables import PerformanceReport
    from sitscad.estimates.states.at_frequency import CoilAtFrequency


def estimate_text(
    path: str, estimates: Estimates | None, checked: CheckedSpec, colour: bool = False,
    performance: PerformanceReport | None = None, cells: Mapping[str, Any] | None = None,
    at: Sequence[CoilAtFrequency] = (),
) -> str:
    """Return tables of coils, states and readout settings, then the cross-checks and notes on the estimates."""
    if estimates is None:
        why = styled(f"{escape_controls(path)} could not be read, so nothing was estimated", "red", colour)
        return f"{as_findings([checked], OutputOptions(colour))}{why}\n"
    first, *following = estimate_tables(estimates)
    by_cell = Table(*head_and_rows(cells["in_words"]), CELLS_TITLE) if cells else Table((), ())
    tables = [first, by_result(at, AT_FREQUENCY, AT_TITLE), *following, by_cell]
    last = [readout_table(estimates.all_coils, estimates.readout), *stack_tables(estimates),
            cross_check_table(estimates.cross_checks, estimates.no_cross_check)]
    blocks = [
        styled(escape_controls(path), "bold", colour),
        styled(escape_controls(estimates.incomplete), "red", colour) if estimates.incomplete else "",
        *(table_text(each, colour) for each in tables), *performance_blocks(performance, colour),
        *(table_text(each, colour) for each in last),
        *(f"note: {escape_controls(str(note))}" for note in estimates.notes if note != estimates.incomplete),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def estimate_json(
    path: str, estimates: Estimates | None, checked: CheckedSpec, colour: bool = False,
    performance: PerformanceReport | None = None, cells: Mapping[str, Any] | None = None,
    at: Sequence[CoilAtFrequency] = (),
) -> str:
    """Return the JSON document of ``estimate``.

    It has ``at_frequency``, ``performance`` and the performance of `cells` if the options ask for them. For an
    unreadable spec it has no coils, and ``findings`` give the reason.
    """
    if estimates is None:
        findings = [finding_json(finding) for finding in checked.findings]
        nothing = {"sitscad": __version__, "spec": path, "coils": [], "inductance_matrix_H": []}
        return to_json(nothing | {"findings": findings})
    optional: dict[str, Any] = {} if performance is None else {"performance": performance.documents()}
    optional |= {"cells": cells} if cells else {}
    optional |= {"at_frequency": [coil.document() for coil in at]} if at else {}
    return to_json({**estimates.as_json(path), **optional})


CELLS_TITLE = "Cell by cell: below, each figure of what the sensor feels is that of the worst cell of those solved"


Shown = Callable[
    [str, "Estimates | None", CheckedSpec, bool, "PerformanceReport | None", "Mapping[str, Any] | None",
     "Sequence[CoilAtFrequency]"], str
]

ESTIMATE_FORMATS: Mapping[str, Shown] = {"text": estimate_text, "json": estimate_json}
"""Output formats of ``estimate``. Each function takes the path as typed, the estimate (None if the spec is unreadable),
the findings and whether to use colour. Then follow the performance (None without --performance), the performance of
each cell, and the coils at the frequencies of --at."""


def estimate_tables(estimates: Estimates) -> list[Table]:
    """Return all tables of coils and states, for texts and pages, in their order."""
    coils, temperature = estimates.all_coils, estimates.temperature
    return [
        signal_table(estimates.signals, estimates.coils, estimates.readout.drive_code),
        state_table(coils, temperature),
        coil_table(coils, temperature),
        part_table(coils),
        _state_rows(coils, temperature, "What the converter resolves", STEPS, "quantum"),
        reading_table(coils, temperature, estimates.normal_force), scatter_table(coils, temperature),
        inductance_matrix_table(coils, estimates.inductance_matrix, estimates.inductance_matrix_error),
    ]


def coil_table(coils: tuple[CoilEstimate, ...], temperature: float) -> Table:
    """Return a table with one row for each quantity and one column for each coil."""
    rows = by_quantity(coils, COIL)
    changes = [coil.resistance_change for coil in coils]
    if any(changes):
        either = [" (either sign)" if c and c[1] > abs(c[0]) else "" for c in changes]
        texts = [plus_minus(*c, "ohm") + more if c else DASH for c, more in zip(changes, either, strict=True)]
        rows.append([RESISTANCE_CHANGE, *texts])
    return Table(["", *(coil.name for coil in coils)], rows, title_with_temperature("Coils", temperature))


RESISTANCE_CHANGE = "resistance at the contacts, change from rest to pressed"


PARTS_TITLE = "What the terminal inductance is made of (the coil alone, at its sensor frequency)"

PART_WORDS = {
    "winding": "winding, direct current spread evenly over its tracks",
    "bends": "direct current cuts corners (runs inside bends): change",
    "stubs": "stubs at the layers' ends",
    "leads": "leads on the body, down to their lane in the tail",
    "tail": "tail, to the contacts",
    "coupling": "coupling of stubs, leads and tail with the winding",
    "vias": "vias",
    "crowding": "current crowds at that frequency (skin, proximity)",
}
"""Names of the parts of the terminal inductance."""


def part_table(coils: tuple[CoilEstimate, ...]) -> Table:
    """Return the parts of the terminal inductance (nH, rounded to equal decimals), their sum and the frequency."""
    names = [name for name in PART_WORDS if any(name in coil.inductance_parts for coil in coils)]
    largest = max((abs(coil.winding_inductance) for coil in coils), default=0.0)
    places = max(2, 4 - math.floor(math.log10(largest * 1e9))) if largest > 0.0 else 2

    def nanohenries(value: float | None) -> str:
        return f"{value * 1e9:.{places}f} nH" if value is not None and math.isfinite(value) else DASH

    rows = [[PART_WORDS[n], *(nanohenries(c.inductance_parts.get(n)) for c in coils)] for n in names]
    frequencies = [quantity(coil.sensor_frequency, "Hz") for coil in coils]
    sums = [nanohenries(coil.terminal_inductance) for coil in coils]
    rows = [["sensor frequency", *frequencies], *rows, ["sum: terminal inductance at that frequency", *sums]]
    return Table(["", *(coil.name for coil in coils)], rows if names else [], PARTS_TITLE)


def _state_rows(
    coils: tuple[CoilEstimate, ...], temperature: float, title: str, quantities: Sequence[Quantity], needed: str,
    text: Callable[[Quantity, StateEstimate], str] = Quantity.plain,
) -> Table:
    """Return one row per coil and state, for states whose field `needed` is not None."""
    rows = [[coil.name, state_title(state.state), *(text(each, state) for each in quantities)]
            for coil in coils for state in coil.states.values() if getattr(state, needed) is not None]
    head = ("coil", "state", *(each.label for each in quantities))
    return Table(head, rows, title_with_temperature(title, temperature))


def title_with_temperature(title: str, temperature: float) -> str:
    """Return a title with the temperature of its numbers."""
    head, colon, rest = title.partition(":")
    return f"{head}, at {temperature:g} degC{colon}{rest}"


AT_TITLE = "Coil alone at a frequency, no metal near: first the winding without leads, then between the contacts"


def state_table(coils: tuple[CoilEstimate, ...], temperature: float) -> Table:
    """Return the tank at the contacts in each state."""
    title = "At the contacts, leads included: what rules and limits judge"
    return _state_rows(coils, temperature, title, (*TANK, COMPUTED_WITHIN), "state")


def reading_table(coils: tuple[CoilEstimate, ...], temperature: float, normal_force: float | None) -> Table:
    """Return the inductances in each state as read by a meter and by the firmware's formula."""
    table = _state_rows(coils, temperature, OTHERS_TITLE, OTHERS, "quantum")
    changes = ((coil.name, coil.converter_sensitivity(normal_force)) for coil in coils)
    moved = [[name, "per newton", DASH, plus_minus(*change, "H", "/N")] for name, change in changes if change]
    return table._replace(rows=[*table.rows, *moved], notes=OTHERS_MEANING)


def scatter_table(coils: tuple[CoilEstimate, ...], temperature: float) -> Table:
    """Return the scatter due to manufacture of each quantity, and the largest cause for Rp.

    The scatter is one sigma divided by the value. Rp is the parallel resistance of the tank.
    """
    def share(each: Quantity, state: StateEstimate) -> str:
        sigma, value = each.deviation(state), each.value(state)
        ratio = sigma / value if sigma is not None and value else math.nan
        return f"{100.0 * ratio:.2g} %" if math.isfinite(ratio) else DASH

    quantities = [each for each in TANK if each.sigma]
    table = _state_rows(coils, temperature, "Scatter of manufacture, one sigma", quantities, "spread", share)
    spreads = [state.spread for coil in coils for state in coil.states.values() if state.spread is not None]
    causes = [scatter.causes.get("parallel_resistance", DASH) for scatter in spreads]
    rows = [[*row, cause] for row, cause in zip(table.rows, causes, strict=True)]
    return table._replace(head=(*table.head, "Rp mostly by"), rows=rows)


def inductance_matrix_table(
    coils: tuple[CoilEstimate, ...], inductances: tuple[tuple[float, ...], ...],
    inductance_errors: tuple[tuple[float, ...], ...],
) -> Table:
    """Return the inductance matrix, one row per coil. Empty for one coil."""
    names = [coil.name for coil in coils]
    matrix = np.array(inductances)
    if len(names) < 2:
        return Table((), ())
    errors, mutual = np.array(inductance_errors), ~np.eye(len(names), dtype=bool) & (matrix != 0.0)
    largest = np.max(errors[mutual] / np.abs(matrix[mutual]), initial=0.0) if errors.size else 0.0
    rows = [[name, *(quantity(float(value), "H") for value in row)] for name, row in zip(names, matrix, strict=True)]
    note = [f"mutual ones to {largest:.1g} of their value, at most"] if largest else []
    return Table(["", *names], rows, "Inductance matrix of the windings", note)


def readout_table(coils: tuple[CoilEstimate, ...], readout: ReadoutEstimate) -> Table:
    """Return the settings of the converter, with the reason for the capacitor."""
    r = readout
    least = show(r.device.limit("amplitude_optimum_min"), "V")
    codes = ", ".join(f"{coil.name} {code}" for coil, code in zip(coils, r.drive_codes, strict=False))
    rows = [
        *by_quantity([r], TANK_AND_DRIVE),
        *by_quantity([r.conversion], r.device.law.SETTINGS),
        *by_quantity([r], (*RATES, *(LONE_TIMES if len(coils) == 1 else SCAN_TIMES))),
        ["clock f_CLK", quantity(r.clock, "Hz")],
        ["fastest clock of I2C", r.device.serial_clock_text],
    ]
    if r.drive_codes:
        rows.append(["a code for every channel", f"{codes}: one for all leaves a coil below {least}"])
    if r.conversion is not None and r.conversion.result_text:
        rows.append(["result", f"{r.conversion.result_text}, offsets {', '.join(map(str, r.conversion.offsets))}"])
    return Table(("setting", "value"), rows, f"Readout ({r.device.part})")


def stack_tables(estimates: Estimates) -> list[Table]:
    """Return the table of gaps by state, and the elastomer's compression under the required force."""
    sigmas = estimates.gap_sigmas
    gaps = [[state_title(name), plus_minus(gap, sigmas.get(name), "m", digits=4)] for name,
            gap in estimates.gaps.items()]
    pressed = by_quantity([estimates], COMPRESSION)
    if estimates.compression_scatter is not None and pressed:
        pressed.append(["one sigma of the strain mostly by", estimates.compression_scatter.cause])
    if pressed:
        pressed.append(["against finite elements", LAW_HELD])
    return [Table(["gap", ""], gaps, "Gaps, +- one sigma"),
            Table(["", ""], pressed, "Elastomer under the required force, +- one sigma")]


LAW_HELD = "one sigma of 2.5 % where the law was held against them, 5 % beyond"


def incoming_tables(coils: tuple[CoilEstimate, ...], metered: tuple[MeterReadings, ...]) -> list[Table]:
    """Return the expected readings of the bare board: of an LCR meter, and at the frequency of each tank."""
    free = [(coil.name, coil.states[FREE]) for coil in coils if FREE in coil.states]
    rows = [[name, *(each.text(state) for each in BARE_TANK)] for name, state in free]
    return [
        by_result(metered, METERED, "The bare board when it comes, at 20 degC, far from metal: between a coil's "
                  "contacts, +- one sigma"),
        Table(["coil", *(each.label for each in BARE_TANK)], rows if metered else [],
              "The same at the frequency of its tank"),
    ]


CROSS_TITLE = "Cross-checks: closed formulas beside the estimate"


def cross_check_table(cross_checks: tuple[CrossCheck, ...], no_cross_check: str | None) -> Table:
    """Return the results of closed formulas beside the estimate, each with its range of validity."""
    head = ("coil", "formula", "inductance", "against ours", "in its range", "range")
    rows = [
        [check.coil, check.method, quantity(check.inductance, "H"),
         f"{100.0 * check.deviation:+.1f} %" if math.isfinite(check.deviation) else DASH,
         "yes" if check.is_valid else "no", check.validity]
        for check in cross_checks
    ]
    if no_cross_check:
        rows = [[DASH, "none", DASH, DASH, DASH, no_cross_check]]
    return Table(head, rows, CROSS_TITLE)


def head_and_rows(lines: Sequence[Sequence[str]]) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    """Return the first line as the head of a table, and the other lines as its rows. Both are empty without lines."""
    return (lines[0], lines[1:]) if lines else ((), ())


def aligned_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Format lines of aligned columns, numbers to the right and text to the left; empty without rows."""
    body = [[escape_controls(str(cell)) for cell in row] for row in rows]
    if not body:
        return []
    cells = [list(head), *body] if head else body
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    aligned = [">" if is_number else "<" for is_number in number_column_flags(body)]
    pairs = list(zip(aligned, widths, strict=True))
    lines = ([f"{cell:{side}{width}}" for cell, (side, width) in zip(row, pairs, strict=True)] for row in cells)
    return ["  ".join(line).rstrip() for line in lines]


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return the table for a page. Empty without rows."""
    lines = [[str(cell) for cell in row] for row in rows]
    return web_page.aligned_html_table(head, lines, number_column_flags(lines), caption)


def page_tables(tables: Iterable[Table]) -> str:
    """Return tables for a page, each with its notes below."""
    return "".join(html_table(each.head, each.rows, each.title) + html_list(each.notes) for each in tables if each.rows)


def number_column_flags(rows: Sequence[Sequence[str]]) -> list[bool]:
    """Return for each column whether all its cells begin with a digit or a sign."""
    return [all(cell[:1] in _NUMERIC for cell in column) for column in zip(*rows, strict=True)]


_NUMERIC = frozenset("0123456789+-")


def table_text(content: Table, colour: bool = False) -> str:
    """Return a table under its title, with its notes below. Empty if it has no rows."""
    head = content.head if any(content.head) else ()
    lines = [*aligned_table(head, content.rows), *content.notes] if content.rows else []
    title = [styled(content.title, "bold", colour)] if content.title else []
    return "\n".join([*title, *(f"  {line}" for line in lines)]) if lines else ""


def performance_blocks(report: PerformanceReport | None, colour: bool) -> list[str]:
    """Return the sensing performance as blocks of text: tables, then notes. Empty without a target."""
    if report is None or not report.points:
        return []
    first, *following = report.tables()
    first = first._replace(title=PERFORMANCE_TITLE)
    return [*(table_text(each, colour) for each in (first, *following)),
            "\n".join(f"note: {note}" for note in report.points[-1].notes)]


PERFORMANCE_TITLE = "What the sensor feels, after a tare at rest; errors are one sigma"


Document = Mapping[str, Any]
