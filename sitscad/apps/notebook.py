"""Display in notebooks: pictures of specs, designs and layouts, and tables of estimates, responses and findings.

`sitscad.load_ipython_extension` registers these functions with IPython. They show the same values as the commands and
the report.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sitscad.checks.findings.document import sorted_by_severity
from sitscad.files.drawing.pictures.layout_picture import layout_svg
from sitscad.files.report.numbers import estimate_tables, html_table, page_tables
from sitscad.files.report.response import response_rows
from sitscad.layout import lay_out

if TYPE_CHECKING:
    from sitscad.checks.judging import CheckResult


def show_check(result: CheckResult) -> str:
    """Return the findings of a check as an HTML table, the most severe first."""
    rows = [[each.severity.value, each.rule, each.whole_message, each.hint]
            for each in sorted_by_severity(result.findings)]
    return html_table(["", "rule", "finding", "to mend it"], rows, "ok" if result.ok else "not ok") or "<p>ok</p>"


SHOWN: dict[tuple[str, str], tuple[str, Callable[[Any], str]]] = {
    ("sitscad.spec.sensor", "SensorSpec"): ("image/svg+xml", lambda spec: layout_svg(lay_out(spec))),
    ("sitscad.layout.board", "Layout"): ("image/svg+xml", layout_svg),
    ("sitscad.estimates.design", "Design"): ("image/svg+xml", lambda design: layout_svg(design.layout)),
    ("sitscad.estimates.coil_estimates", "Estimates"): (
        "text/html", lambda estimates: page_tables(estimate_tables(estimates))),
    ("sitscad.estimates.response.response_arrays", "Response"): (
        "text/html", lambda response: html_table(*response_rows(response))),
    ("sitscad.checks.judging", "CheckResult"): ("text/html", show_check),
}
"""MIME type and display function of each type that notebooks show. Keys are (module, class name)."""


def register(formatters: Any) -> None:
    """Register the display functions with IPython. `formatters` holds one formatter for each kind of output."""
    for (module, name), (kind, function) in SHOWN.items():
        formatters[kind].for_type_by_name(module, name, function)
