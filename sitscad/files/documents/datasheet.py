"""The data sheet: equal tables, drawings and plots in ``datasheet.html`` and ``datasheet.pdf``.

``datasheet.json`` holds the figures for programs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from sitscad.basics.quantities import Table
from sitscad.basics.record import record
from sitscad.basics.units import DASH, count_text, show
from sitscad.calibration.calibration import Calibration, plan_calibration
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates, MeterReadings
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance.curves import Curves
from sitscad.estimates.performance.tables import (
    MapFigures,
    PerformanceReport,
    axis_table,
    compensation_tables,
    drift_table,
    error_table,
    load_text,
    sensor_rows,
    share_text,
)
from sitscad.estimates.performance_values import AXES, FORCES, Performance, lasts_after_tare
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.table import response_table
from sitscad.estimates.states.cells import NO_CELLS, CellTable
from sitscad.estimates.states.reference import reference_signal
from sitscad.estimates.tolerances.scatter import ACCEPTED_SIGMAS, production_limits
from sitscad.files.documents.datasheet_plots import NAMES, WIDE, Plot, sensor_plots
from sitscad.files.documents.drawings.plan_view import draw_plan, plan_scale, plan_sheet
from sitscad.files.drawing.frame import draw_paragraph, draw_table, new_sheet, numbered_notes, scale_text
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Sheet, draw_figure
from sitscad.files.drawing.svg import svg
from sitscad.files.drawing.web_page import aligned_html_table as html_table
from sitscad.files.drawing.web_page import html_figure, html_page, html_section, soft_paragraph
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.geometry.shapes import PLATES
from sitscad.layout.board import Layout
from sitscad.layout.tail.tracks import contact_rows
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.mount import Mount
from sitscad.spec.yaml.source import Issue

ROOM = (170.0, 96.0, 112.0, 96.0)  # Room for the drawing on the first page: left, low, width, height (mm)

TOP, LEFT = 192.0, 14.0


def render(
    layout: Layout, estimates: Estimates, response: ResponseModel, performance: Sequence[Performance],
    curves: Curves | None, forced: str, bench: Estimates, cells: CellTable = NO_CELLS,
) -> dict[str, bytes]:
    """Return the three files; empty without performance or curves.

    `bench` are the estimates at 20 degrees Celsius, at which boards are tested. `forced` is not empty if the design has
    errors. Raises `MissingExtra` without the plotting library.
    """
    if not performance or curves is None:
        return {}
    plots = sensor_plots(curves, performance, cells.name)
    try:
        calibration = plan_calibration(response)  # the target stays level, as in all figures here
    except NoResponse:
        calibration = None
    reached = None if calibration is None else MapFigures(calibration.map.end, calibration.crosstalk)
    report = PerformanceReport(performance, layout.spec, reached)
    content = Content(
        layout.spec.name, layout.spec.issue, _description(layout.spec.cell_placements, performance),
        _with_heading(axis_table(report)), sensor_summary_rows(performance, layout, estimates, cells), cells,
        [] if calibration is None else list(calibration.error_rows),
        "" if calibration is None else calibration.errors_are, _with_heading(error_table(performance)),
        [row for table in (drift_table(performance), *compensation_tables(performance))
         for row in _with_heading(table)],
        contact_rows(layout), acceptance_rows(bench.all_coils, bench.metered, bench.temperature),
        tuple(notes(performance, calibration)), plots, bool(forced),
    )
    assembly = plan_sheet(layout, content.is_forced)
    return {
        "datasheet.html": _page(content, assembly).encode("utf-8"),
        "datasheet.json": figures_for_programs(report, response, calibration, cells.document()),
        "datasheet.pdf": pdf(_sheets(content, layout, assembly)),
    }


Rows = list[tuple[str, ...]]


@record(eq=False)
class Content:
    """Texts, tables and plots of the data sheet; HTML page and PDF print equal values.

    The first row of each table holds its headings. `unit_errors` is the table of predicted calibration errors, and
    `errors_are` its note; both are empty if no calibration is predicted.
    """

    name: str
    issue: Issue
    about: str
    axes: Rows
    whole: Rows
    cells: CellTable
    unit_errors: Rows
    errors_are: str
    errors: Rows
    drifts: Rows
    contacts: Rows
    accepted: Rows
    notes: tuple[str, ...]
    plots: Sequence[Plot]
    is_forced: bool


def figures_for_programs(
    report: PerformanceReport, response: ResponseModel | None, calibration: Calibration | None = None,
    cells: Mapping[str, Any] | None = None,
) -> bytes:
    """Return the content of ``datasheet.json``.

    It has the predicted calibration errors only if `calibration` is given, and the response table only if `response`
    is. `cells` is the document of a `CellTable`.
    """
    whole: dict[str, Any] = {"performance": report.documents(),
                             "in_words": [[list(each.head), *map(list, each.rows)] for each in report.tables()]}
    if cells:
        whole["cells"] = cells
    if calibration is not None:
        calibrated = calibration.document()
        whole["unit_to_unit"] = {key: calibrated[key] for key in ("errors_are", "rotation", "unit_errors")}
        whole["unit_to_unit"]["in_words"] = calibration.error_rows
        whole["map_crosstalk"] = calibration.crosstalk
    if response is not None:
        whole["pushed"] = response_table(response).document()
    rounded = json.loads(json.dumps(whole), parse_float=_rounded_number)
    return (json.dumps(rounded, indent=1, allow_nan=False) + "\n").encode("ascii")


def _rounded_number(text: str) -> float:
    """Return the number that a text states, rounded to six digits; tiny values become 0.

    The last bits of a sum differ between machines.
    """
    value = float(text)
    return float(f"{value:.6g}") if abs(value) > 1e-12 else 0.0


def _sheets(content: Content, layout: Layout, assembly: Sheet | None) -> list[Sheet]:
    def sheet(title: str, scale: str = "") -> Sheet:
        return new_sheet(content.name, content.issue, title, scale, "the whole package", content.is_forced)

    cells, plots, between = content.cells, content.plots, content.unit_errors
    first = sheet("data sheet", f"drawing {scale_text(plan_scale(layout, ROOM))}")
    # letters small enough that all tables end above the note at the foot
    size = min(2.4, (TOP - FOOT) / (1.55 * (len(content.axes) + len(content.whole) + len(between))))
    low = draw_table(first, LEFT, TOP, _column_widths(content.axes, 58.0, 150.0), content.axes, size)
    low = draw_table(first, LEFT, low - 6.0, (58.0, 92.0), content.whole, size)
    if content.errors_are:
        low = draw_table(first, LEFT, low - 6.0, _column_widths(between, 58.0, 150.0), between, size)
        draw_paragraph(first, LEFT, low - 4.0, 150.0, 12.0, [content.errors_are], 2.2)
    draw_plan(first, layout, ROOM)
    draw_paragraph(first, 170.0, ROOM[1] - 15.0, 112.0, 42.0, [content.about], 2.6)
    each = sheet("data sheet, cells") if cells.groups else None
    if each is not None:
        under = draw_table(each, LEFT, TOP, _column_widths(cells.rows, 58.0, 268.0), cells.rows, 2.4)
        draw_paragraph(each, LEFT, under - 4.0, 200.0, 42.0, [cells.note], 2.2)
    curved = sheet("data sheet, curves")
    wide = [plotted for plotted in plots if plotted.size == WIDE]
    for plotted, low in zip(wide, (126.0, 46.0), strict=False):
        draw_figure(curved, (LEFT, low, *plotted.size), plotted.draw)
        draw_paragraph(curved, LEFT, low - 1.5, 262.0, 6.0, [plotted.caption], 2.2)
    beyond = sheet("data sheet, working range and errors")
    for plotted, left in zip(plots[len(wide):], (LEFT, 152.0), strict=False):
        draw_figure(beyond, (left, 88.0, *plotted.size), plotted.draw)
        draw_paragraph(beyond, left, 86.0, 128.0, 70.0, [plotted.caption], 2.2)
    draw_table(beyond, LEFT, 70.0, _column_widths(content.drifts, 44.0, 130.0), content.drifts, 2.2)
    last = sheet("data sheet, contacts and limits")
    accepted = content.accepted
    incoming = sheet("data sheet, incoming test") if len(accepted) > MOST_BESIDE + 1 else None
    if incoming is not None:
        draw_table(incoming, LEFT, TOP, _column_widths(accepted, 66.0, 190.0), accepted, 2.2)
    low = TOP
    for rows in (content.errors, [] if incoming is not None else accepted, content.contacts):
        low = draw_table(last, LEFT, low, _column_widths(rows, 66.0, 146.0), rows, 2.2) - 5.0 if rows else low
    draw_paragraph(last, 165.0, TOP, 118.0, 42.0, numbered_notes([*content.notes, ACCEPT]), 2.3)
    return [page for page in (first, each, assembly, curved, beyond, last, incoming) if page is not None]


FOOT = 36.0
"""Height (mm) reserved on the first sheet for the gaps between its tables and for the note below them."""

MOST_BESIDE = 4  # Most coils whose incoming test fits on the sheet of contacts and limits; more get a sheet


def _column_widths(rows: Rows, first: float, whole: float) -> list[float]:
    """Return the widths (mm) of a table's columns, which add up to `whole` (mm).

    With up to four columns, the first has the width `first` (mm) and the others are equally wide. With more columns,
    all are equally wide.
    """
    count = len(rows[0]) if rows else 1
    if count > 4:
        return [whole / count] * count
    return [first, *[(whole - first) / (count - 1)] * (count - 1)]


def _description(placements: tuple[tuple[CoilPlacement, ...], ...], points: Sequence[Performance]) -> str:
    """Describe the sensor and its measured axes in a few sentences; `placements` has the coils' places by cell."""
    cells, coils = len(placements), count_text(len(placements[0]), "coil")
    axes = " and ".join(NAMES[name] for name in points[-1].axes)
    array = f"{cells} cells, each of " if cells > 1 else ""
    return (
        f"Soft inductive tactile sensor: {array}{coils} under a metal target on a silicone pad. "
        f"{'Each cell' if cells > 1 else 'It'} tells {axes}, after a tare at rest. x runs along the board towards the "
        "tail, y across, normal towards the board. Drawing: target and elastomer over the coils."
    )


def _page(content: Content, assembly: Sheet | None) -> str:
    plots, cells = content.plots, content.cells
    warning = "Made in spite of errors: the design does not meet its own checks."
    banner = f"<p class='banner'>{warning}</p>" if content.is_forced else ""
    shown = html_figure(svg(assembly), "Target and elastomer over the coils, to scale.") if assembly is not None else ""
    wide, narrow = ([_plot_html(plotted) for plotted in plots if (plotted.size == WIDE) is is_wide]
                    for is_wide in (True, False))
    units = _table_html(content.unit_errors) + soft_paragraph(content.errors_are) if content.errors_are else ""
    parts = [
        f"<header><h1>{escape(content.name)}</h1>{soft_paragraph(content.issue.words)}{soft_paragraph(content.about)}</header>{banner}",
        html_section("What it feels", _table_html(content.axes) + _table_html(content.whole)),
        *([html_section("Cells", _table_html(cells.rows) + soft_paragraph(cells.note))] if cells.groups else []),
        html_section("Drawing", shown),
        html_section("Curves", f"{''.join(wide)}<div class='narrow'>{''.join(narrow)}</div>" if plots else ""),
        html_section("Errors", units + _table_html(content.errors) + _table_html(content.drifts)),
        html_section("Contacts", _table_html(content.contacts)),
        html_section("Production", _table_html(content.accepted) + soft_paragraph(ACCEPT)),
        html_section("Notes", "<ul>" + "".join(f"<li>{escape(note)}</li>" for note in content.notes) + "</ul>"),
    ]
    return html_page(f"{content.name}: data sheet", parts)


def _plot_html(plotted: Plot) -> str:
    """Return a plot as an HTML figure with its caption.

    Narrow plots share a row of the page, so that the letters of all plots have one size.
    """
    sheet = Sheet(plotted.caption, plotted.size, decimals=3)
    draw_figure(sheet, (0.0, 0.0, *plotted.size), plotted.draw)
    return html_figure(svg(sheet), plotted.caption)


def _table_html(rows: Rows) -> str:
    """Return an HTML table whose first row is the heading; all columns but the first are numeric."""
    head, *lines = rows or [()]
    return html_table(head, lines, [k > 0 for k in range(len(head))])


def _with_heading(rows_and_head: Table) -> Rows:
    """Return a table as a list of rows, with the headings as first row."""
    return [tuple(rows_and_head.head), *map(tuple, rows_and_head.rows)]


def sensor_summary_rows(
    points: Sequence[Performance], layout: Layout, estimates: Estimates, cells: CellTable = NO_CELLS,
) -> Rows:
    """Return the rows on the sensor as a whole: converter, capacitor, target, elastomer and metal behind it."""
    readout, pad, target = estimates.readout, layout.spec.elastomer, layout.spec.target
    assert pad is not None and target is not None
    result = "" if readout.conversion is None else readout.conversion.result_text
    return [
        ("sensor", ""),
        *_cell_rows(cells),
        *sensor_rows([point.document() for point in points]),
        ("converter", _converter_text(readout.device, len(estimates.all_coils))),
        *([("its result", result)] if result else []),
        ("tank capacitor", show(readout.capacitance, "F", 3)),
        *_reference_coil_rows(layout, estimates),
        ("target", f"{target.material.name}, {_size_text(target)}, {show(target.thickness, 'm')}"),
        ("elastomer", f"{pad.material.name}, {_size_text(pad)}, {show(pad.thickness, 'm')}"),
        *_metal_behind_rows(layout.spec.mount),
        ("shear modulus of it", f"{show(pad.material.shear_modulus, 'Pa', 3)} +- "
                                f"{100.0 * pad.material.shear_modulus_sigma:.0f} %"),
    ]


def _reference_coil_rows(layout: Layout, estimates: Estimates) -> Rows:
    """Return the rows on the reference coil and on the target's signal in it. Empty if there is no reference coil."""
    if estimates.reference is None:
        return []
    signal, name = reference_signal(layout, estimates), estimates.reference.name
    coil, like = layout.spec.reference_coil, ""
    if coil is not layout.spec.coil:
        size = " x ".join(show(side, "m") for side in dict.fromkeys(coil.size))
        like = f", {coil.shape} of {size}, {coil.turns_in_words} turns, {count_text(len(coil.layers), 'layer')}"
    rows: Rows = [("reference coil", f"{name}{like}, without a target; the maps do not read it")]
    if signal is not None:
        rows.append((f"signal of the target on {name}", f"{share_text(signal.share)} of the signal of {signal.coil}"))
    return rows


def _converter_text(device: Converter, coils: int) -> str:
    """Name the converter, the number of converters if several are needed, and the number of channels in use."""
    number = device.converter_count(coils)
    several = f"{number} x " if number > 1 else ""
    return f"{several}{device.part}, {count_text(coils, 'channel')}{' in all' if several else ''}"


def _metal_behind_rows(mount: Mount | None) -> Rows:
    """Return the row on the metal behind the board, which all figures take into account. Empty without this metal."""
    metal = None if mount is None else mount.metal_behind
    if metal is None:
        return []
    where = f"{show(metal.thickness, 'm')} thick, {show(metal.distance, 'm')} behind the board"
    return [("metal behind it, in all figures", f"{metal.material.name}, {where}")]


def _cell_rows(cells: CellTable) -> Rows:
    """Return the rows that name the worst cells and the cell whose curves are drawn. Empty without cells."""
    groups = cells.groups
    if not groups:
        return []

    def worst(figure: Callable[[Performance], float]) -> str:
        return max(groups, key=lambda group: figure(group.performance[-1])).numbers_text

    return [
        ("figures are of the cell worst in each",
         f"of {sum(len(cell_group.numbers) for cell_group in groups)}, told cell by cell"),
        *([("least range and overload", worst(lambda cell_group: -cell_group.overload)),
           ("coarsest resolution", worst(lambda cell_group: cell_group.axes["normal"].resolution)),
           ("error by a tilt, largest", worst(lambda cell_group: max(cell_group.tilt_error["normal"].values())))]
          if len(groups) > 1 else []),
        ("curves, least signal", f"{cells.name} ({', '.join(cells.coils)})"),
        ("what a cell reads of all neighbours", DASH if groups[0].crosstalk is None else
         f"at most {share_text(max(cell_group.crosstalk or 0.0 for cell_group in groups))}"),
    ]


ACCEPT = (
    "Bare coils: the limits are three sigma of manufacture. Reject a coil with a reading outside, even if it "
    "oscillates. One of converter and LCR meter is enough. An LCR meter at the tank's frequency reads another "
    "inductance: the report has it."
)
"""Instruction for the acceptance test of bare coils."""

TARES = (
    "The one tare is taken at rest before the temperature changes: its drift counts from there. A tare before each "
    "grasp is taken after that change: what is left of it counts from the temperature at which the unit was calibrated."
)

TARED_AFTER_A_GRASP = (
    "A tare right after a grasp takes what the pad has not yet recovered (hysteresis, creep) as zero, and the next "
    "forces are off by that. How long the pad needs is not known (no source, not measured): tare when the reading at "
    "rest no longer changes."
)


def acceptance_rows(coils: tuple[CoilEstimate, ...], metered: tuple[MeterReadings, ...], temperature: float) -> Rows:
    """Return the accepted readings of each bare coil on each instrument, at a temperature (degrees Celsius).

    The first row has the headings. Limits are three standard deviations of manufacture on both sides of the design's
    value. Inductance and resistance are listed only if `metered` has the readings of an LCR meter.
    """
    limits = production_limits(coils)
    if not limits:
        return []
    meter = f"LCR {show(metered[0].frequency, 'Hz')}" if metered else ""
    columns = (f"L, {meter}", f"R, {meter}", "R, ohmmeter") if meter else ()
    rows: Rows = [(f"bare coil, {temperature:g} degC", "f, converter", *columns)]
    for coil, ends in limits.items():
        frequency = _range_text(ends["frequency_min_Hz"], ends["frequency_max_Hz"], "Hz")
        read = next((each for each in metered if each.coil == coil), None)
        values = () if read is None else (
            _accepted_range_text(read.inductance, read.inductance_sigma, "H"),
            _accepted_range_text(read.resistance, read.resistance_sigma, "ohm"),
            _accepted_range_text(read.direct, read.direct_sigma, "ohm"),
        )
        rows.append((coil, frequency, *values, *([DASH] * (len(columns) - len(values)))))
    return rows


def _accepted_range_text(value: float, sigma: float, unit: str) -> str:
    """Return the accepted range as text: `ACCEPTED_SIGMAS` standard deviations to either side, at least 0."""
    return _range_text(max(0.0, value - ACCEPTED_SIGMAS * sigma), value + ACCEPTED_SIGMAS * sigma, unit)


def _range_text(low: float, high: float, unit: str) -> str:
    """Return a range as text, with both ends in the unit of the higher end."""
    last = show(high, unit, 4)
    scale = 10.0 ** round(math.log10(float(last.partition(" ")[0]) / high))
    return f"{float(f'{low * scale:.4g}'):.7g} to {last}"


def notes(points: Sequence[Performance], calibration: Calibration | None = None) -> Iterator[str]:
    """Yield the notes on the use of the figures."""
    full = points[-1]
    yield "Computed, not measured. Every figure is of this design; a unit is as good as its own calibration makes it."
    counted_causes = [cause for cause in full.axes["normal"].errors if lasts_after_tare(cause)]
    yield (f"Errors together: root of the squares, taken as independent, of {'; '.join(counted_causes)}. Not counted: "
           "what differs from unit to unit, and loads on axes that are not measured: these have rows of their own.")
    yield TARES
    yield TARED_AFTER_A_GRASP
    if full.ambiguous is not None:
        first, other = (", ".join(load_text(part, name) for name, part in zip(AXES, load, strict=False))
                      for load in full.ambiguous)
        moments = ", moment about x, about y" * (len(full.ambiguous[0]) > len(FORCES))
        yield (f"Two loads (normal, shear along x, along y{moments}) give equal readings: {first}; and {other}. "
               "No map can distinguish them.")
    remarks = [*full.notes, *(calibration.sensors.range.notes if calibration is not None else ()),
            *(f"the map in calibration/ is {note}" for note in (calibration.notes if calibration is not None else ())
              if note.startswith("made for"))]
    yield from (note[0].upper() + note[1:] for note in dict.fromkeys(remarks))


def _size_text(plate: Target | ElastomerPad) -> str:
    return f"{PLATES[plate.shape].size_text(plate.size)} mm"
