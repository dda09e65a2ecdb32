"""Fixes of a spec that could not be loaded: each is written into the text, which is read again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from sitscad.finding import Finding, Remedy
from sitscad.remedy.mending import Applied, is_better, is_further
from sitscad.spec.load import load_text
from sitscad.spec.rewriting import CannotWriteError, completed, rewritten
from sitscad.spec.rules import SpecError
from sitscad.spec.source import SpecSource


def tried(error: SpecError, findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings of a spec that could not be loaded, with those of their fixes with which they are gone and nothing else
    is wrong; those about other files have none.
    """
    source = error.source
    if source is None:
        return tuple(replace(finding, fixes=()) for finding in findings)
    return tuple(
        replace(finding, fixes=tuple(_mending(finding, error, source)) if finding.file is None else ())
        for finding in findings
    )


def _mending(finding: Finding, error: SpecError, source: SpecSource) -> Iterable[Remedy]:
    """Of a finding's fixes those with which the text can be read, or is read further than before."""
    for remedy in finding.fixes:
        try:
            edits = completed(source.text, remedy.edits)
            load_text(rewritten(source.text, edits), source.path)
        except CannotWriteError:
            continue
        except SpecError as left:
            if is_further(error.findings, left.findings) or is_better(
                Applied(finding, remedy), error.findings, left.findings
            ):
                yield replace(remedy, edits=edits)
            continue
        yield replace(remedy, edits=edits)
