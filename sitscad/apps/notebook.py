"""Values in notebooks: pictures of specs, designs and layouts, tables of estimates, responses and findings.

`sitscad.load_ipython_extension` gives these functions to IPython. Each shows the values of the commands and the report.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sitscad.checks.findings.document import by_severity
from sitscad.files.drawing.pictures.layout_picture import picture
from sitscad.files.report.numbers import estimate_tables, html_table, page_tables
from sitscad.files.report.response import response_rows
from sitscad.layout import lay_out

if TYPE_CHECKING:
    from sitscad.checks.judging import CheckResult
    from sitscad.estimates import Estimates
    from sitscad.estimates.design import Design
    from sitscad.estimates.response.response_arrays import Response
    from sitscad.layout.board import Layout
    from sitscad.spec.sensor import SensorSpec


def show_spec(spec: SensorSpec) -> str:
    """Return the board of the spec as SVG text."""
    return picture(lay_out(spec))


def show_layout(layout: Layout) -> str:
    """Return the board as SVG text."""
    return picture(layout)


def show_design(design: Design) -> str:
    """Return the board of the design as SVG text."""
    return picture(design.layout)


def show_estimates(estimates: Estimates) -> str:
    """Return the tables of `sitscad estimate` as HTML."""
    return page_tables(estimate_tables(estimates))


def show_response(response: Response) -> str:
    """Return the table of `sitscad response` as HTML."""
    return html_table(*response_rows(response))


def show_check(result: CheckResult) -> str:
    """Return the findings as an HTML table, most severe first."""
    rows = [[each.severity.value, each.rule, each.whole_message, each.hint] for each in by_severity(result.findings)]
    return html_table(["", "rule", "finding", "to mend it"], rows, "ok" if result.ok else "not ok") or "<p>ok</p>"


SHOWN: dict[tuple[str, str], tuple[str, Callable[[Any], str]]] = {
    ("sitscad.spec.sensor", "SensorSpec"): ("image/svg+xml", show_spec),
    ("sitscad.layout.board", "Layout"): ("image/svg+xml", show_layout),
    ("sitscad.estimates.design", "Design"): ("image/svg+xml", show_design),
    ("sitscad.estimates.coil_estimates", "Estimates"): ("text/html", show_estimates),
    ("sitscad.estimates.response.response_arrays", "Response"): ("text/html", show_response),
    ("sitscad.checks.judging", "CheckResult"): ("text/html", show_check),
}
"""MIME type and display function of each type that notebooks show. Keys are (module, class name)."""


def register(formatters: Any) -> None:
    """Give the functions to IPython's formatters. `formatters` holds one formatter for each kind of output."""
    for (module, name), (kind, function) in SHOWN.items():
        formatters[kind].for_type_by_name(module, name, function)
