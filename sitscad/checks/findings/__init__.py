"""Output of the findings of `check` in every format. A new format is one function and one row of `FINDING_FORMATS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from sitscad.basics.late import late
from sitscad.checks.findings.document import (
    CheckedSpec,
    as_json,
    checked_spec,
    excerpt,
    finding_json,
    json_document,
    numbered_places,
    sorted_by_place,
    sorted_by_severity,
    to_json,
)
from sitscad.checks.findings.text import OutputOptions, RuleTexts, as_text, styled, summary

__all__ = [
    "FINDING_FORMATS",
    "CheckedSpec",
    "OutputOptions",
    "RuleTexts",
    "as_json",
    "as_text",
    "checked_spec",
    "escape_controls",
    "excerpt",
    "finding_json",
    "job_summary",
    "json_document",
    "numbered_places",
    "sorted_by_place",
    "sorted_by_severity",
    "styled",
    "summary",
    "to_json",
]

Format = Callable[[Sequence[CheckedSpec], OutputOptions], str]

FINDING_FORMATS: Mapping[str, Format] = {
    "text": as_text,
    "json": lambda checked, output: as_json(checked),
    **{name: late("sitscad.checks.findings.ci", name) for name in ("sarif", "junit", "github")},
}
"""Output formats of ``check``: each takes the checked specs and the output options."""

job_summary = late("sitscad.checks.findings.ci", "job_summary")
