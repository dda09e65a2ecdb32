"""``datasheet.html`` and ``datasheet.pdf``: the same tables, drawings and plots for a screen and for paper; and
``datasheet.json``, the figures for programs.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from typing import Any

from sitscad.calibration.calibrate import Calibration, foretell
from sitscad.drawing.frame import fitting_paragraph, new_sheet, scale_text, table
from sitscad.drawing.pdf import pdf
from sitscad.drawing.plotted import plot
from sitscad.drawing.sheet import Sheet
from sitscad.drawing.svg import svg
from sitscad.drawing.web_page import figure, page, part
from sitscad.drawing.web_page import table as html_table
from sitscad.estimates.performance.curves import curves
from sitscad.estimates.performance.values import Performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import NoResponse
from sitscad.estimates.values import Estimates
from sitscad.layout.board import Layout
from sitscad.papers.datasheet.figures import Figure, figures
from sitscad.papers.datasheet.rows import (
    Rows,
    drift,
    errors,
    from_unit_to_unit,
    incoming,
    notes,
    pinning,
    production,
    sensor,
    summary,
)
from sitscad.papers.drawings.plan_view import drawing, plan, plan_scale

ROOM = (170.0, 96.0, 112.0, 96.0)
"""Of the drawing on the first page: left, low, width, height (mm)."""

TOP, LEFT = 192.0, 14.0


def render(
    layout: Layout, estimates: Estimates, response: ResponseModel, performance: Sequence[Performance], forced: str,
    bench: Estimates,
) -> dict[str, bytes]:  # fmt: skip
    """All three files; none for a sensor that cannot be felt with. ``bench`` is what boards are tested by (at 20
    degrees Celsius). Raises `MissingExtra` without the plotting library.
    """
    if not performance:
        return {}
    plots, found = figures(curves(response), performance), _calibration(response)
    return {
        "datasheet.html": _page(layout, estimates, performance, found, plots, bool(forced), bench).encode("utf-8"),
        "datasheet.json": _figures([point.document() for point in performance], found),
        "datasheet.pdf": pdf(_sheets(layout, estimates, performance, found, plots, bool(forced), bench)),
    }


def _calibration(response: ResponseModel) -> Calibration | None:
    """What a calibration of the design is foretold to do, its target kept level as all here; None without one."""
    try:
        return foretell(response)
    except NoResponse:
        return None


def _figures(documents: Sequence[object], found: Calibration | None) -> bytes:
    whole: dict[str, Any] = {"performance": documents}
    if found is not None:
        known = found.document()
        whole["unit_to_unit"] = {key: known[key] for key in ("errors_are", "rotation", "unit_errors")}
        whole["unit_to_unit"]["in_words"] = found.error_rows
    rounded = json.loads(json.dumps(whole), parse_float=_plain)
    return (json.dumps(rounded, indent=1, allow_nan=False) + "\n").encode("ascii")


def _plain(text: str) -> float:
    """A figure to six digits, and what rounding leaves of a zero as that: the last bits of a sum differ between
    machines, and with the number of threads.
    """
    value = float(text)
    return float(f"{value:.6g}") if abs(value) > 1e-12 else 0.0


def _sheets(
    layout: Layout, estimates: Estimates, felt: Sequence[Performance], found: Calibration | None,
    plots: Sequence[Figure], forced: bool, bench: Estimates,
) -> list[Sheet]:  # fmt: skip
    """The pages on paper."""
    between = from_unit_to_unit(found)
    first = _new(layout, "data sheet", forced, f"drawing {scale_text(plan_scale(layout, ROOM))}")
    low = table(first, LEFT, TOP, _widths(summary(felt, layout), 58.0, 150.0), summary(felt, layout), 2.4)
    low = table(first, LEFT, low - 6.0, (58.0, 92.0), sensor(felt, layout, estimates), 2.4)
    if found is not None:
        low = table(first, LEFT, low - 6.0, _widths(between, 58.0, 150.0), between, 2.4)
        fitting_paragraph(first, LEFT, low - 4.0, 150.0, 12.0, [found.errors_are], 2.2)
    plan(first, layout, ROOM)
    fitting_paragraph(first, 170.0, 90.0, 112.0, 42.0, [_about(layout, felt)], 2.6)
    assembly = drawing(layout, forced)
    curved = _new(layout, "data sheet, curves", forced)
    for plotted, low in zip(plots[:2], (126.0, 46.0), strict=True):
        plot(curved, (LEFT, low, *plotted.size), plotted.draw)
        curved.text(LEFT, low - 3.5, plotted.caption, 2.2)
    beyond = _new(layout, "data sheet, working range and errors", forced)
    for plotted, left in zip(plots[2:], (LEFT, 152.0), strict=False):
        plot(beyond, (left, 88.0, *plotted.size), plotted.draw)
        fitting_paragraph(beyond, left, 86.0, 128.0, 70.0, [plotted.caption], 2.2)
    table(beyond, LEFT, 70.0, _widths(drift(felt), 44.0, 130.0), drift(felt), 2.2)
    last = _new(layout, "data sheet, contacts and limits", forced)
    own = _new(layout, "data sheet, incoming test", forced) if len(bench.metered) > MOST_BESIDE else None
    if own is not None:
        table(own, LEFT, TOP, _widths(incoming(bench), 66.0, 140.0), incoming(bench), 2.2)
    low = TOP
    for rows in (errors(felt), production(felt), [] if own is not None else incoming(bench), pinning(layout)):
        low = table(last, LEFT, low, _widths(rows, 66.0, 140.0), rows, 2.2) - 5.0 if rows else low
    fitting_paragraph(
        last, 165.0, TOP, 118.0, 42.0, [f"{k}. {note}" for k, note in enumerate(notes(felt, found), 1)], 2.3
    )
    return [sheet for sheet in (first, assembly, curved, beyond, last, own) if sheet is not None]


MOST_BESIDE = 4
"""Coils whose incoming test stands on the sheet of contacts and limits; of more it has one of its own."""


def _new(layout: Layout, what: str, forced: bool, scale: str = "") -> Sheet:
    return new_sheet(layout.spec, what, scale, "the whole package", forced)


def _widths(rows: Rows, first: float, whole: float) -> list[float]:
    """Widths of columns (mm): the first, and equal ones for the rest; of many columns equal ones for all."""
    count = len(rows[0]) if rows else 1
    if count > 4:
        return [whole / count] * count
    return [first, *[(whole - first) / (count - 1)] * (count - 1)]


def _about(layout: Layout, felt: Sequence[Performance]) -> str:
    """What the sensor is and tells, in two sentences."""
    full, coils = felt[-1], f"{len(layout.coils)} coil{'s' if len(layout.coils) > 1 else ''}"
    axes = " and ".join(name.replace("_", " along ") for name in full.axes)
    return (
        f"Soft inductive tactile sensor: {coils} under a metal target on a silicone pad. "
        f"It tells {axes}, after a tare at rest. x runs along the board towards the tail, y across, normal towards the "
        "board. Drawing: target and elastomer over the coils."
    )


def _page(
    layout: Layout, estimates: Estimates, felt: Sequence[Performance], found: Calibration | None,
    plots: Sequence[Figure], forced: bool, bench: Estimates,
) -> str:  # fmt: skip
    """The page for a screen, self-contained."""
    spec = layout.spec
    banner = "<p class='banner'>Made in spite of errors: the design does not meet its own checks.</p>" if forced else ""
    assembly = drawing(layout, forced)
    shown = figure(svg(assembly), "Target and elastomer over the coils, to scale.") if assembly is not None else ""
    parts = [
        f"<header><h1>{escape(spec.name)}</h1><p class='soft'>{escape(_about(layout, felt))}</p></header>{banner}",
        part("What it feels", _table(summary(felt, layout)) + _table(sensor(felt, layout, estimates))),
        part("Drawing", shown),
        part("Curves", "".join(map(_plotted, plots))),
        part("Errors", _unit_part(found) + _table(errors(felt)) + _table(drift(felt))),
        part("Contacts", _table(pinning(layout))),
        part("Production", _table(production(felt)) + _table(incoming(bench))
              + "<p class='soft'>Three sigma of manufacture: a coil outside is "
              "faulty even if it oscillates. L is that at the contacts at the tank's frequency; an LCR meter reads "
              "more there, by the coil's own capacitance: the report has both. The meter's figures are at 20 degC, +- "
              "one sigma of manufacture.</p>"),
        part("Notes", "<ul>" + "".join(f"<li>{escape(note)}</li>" for note in notes(felt, found)) + "</ul>"),
    ]  # fmt: skip
    return page(f"{spec.name}: data sheet", parts)


def _unit_part(found: Calibration | None) -> str:
    return "" if found is None else f"{_table(from_unit_to_unit(found))}<p class='soft'>{escape(found.errors_are)}</p>"


def _plotted(plotted: Figure) -> str:
    """One plot and its caption as HTML."""
    sheet = Sheet(plotted.caption, plotted.size, decimals=3)
    plot(sheet, (0.0, 0.0, *plotted.size), plotted.draw)
    return figure(svg(sheet), plotted.caption)


def _table(rows: Rows) -> str:
    """A table with its first row as the heading, and numbers in all columns but the first."""
    head, *lines = rows or [()]
    return html_table(head, lines, [k > 0 for k in range(len(head))])
