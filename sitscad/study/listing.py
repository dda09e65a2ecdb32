"""The measures as a list for people, and as JSON for programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sitscad.report.findings import to_json
from sitscad.study.measures import MEASURES
from sitscad.study.sweep_files import aligned
from sitscad.version import __version__


def measures_text() -> str:
    """One line a measure: name, unit, levels, meaning, what it needs."""
    rows = [
        [row.name, row.unit or "-", ", ".join(row.levels), row.meaning + (f" (needs {row.needs})" if row.needs else "")]
        for row in MEASURES.values()
    ]
    return aligned([["measure", "unit", "levels", "meaning"], *rows])


def measures_json() -> str:
    """All that is known of every measure."""
    rows = [
        {"name": row.name, "unit": row.unit, "meaning": row.meaning, "levels": list(row.levels), "needs": row.needs}
        for row in MEASURES.values()
    ]
    return to_json({"sitscad": __version__, "measures": rows})


MEASURE_FORMATS: Mapping[str, Callable[[], str]] = {"text": measures_text, "json": measures_json}
"""How `measures` prints."""
