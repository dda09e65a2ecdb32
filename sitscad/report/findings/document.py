"""Findings as JSON for a program: the document of ``check`` (docs/commands.md, data/check.schema.json)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sitscad.finding import Finding, Ignored, Remedy
from sitscad.report.findings.checked import CheckedSpec
from sitscad.version import __version__

if TYPE_CHECKING:
    from sitscad.measured import Reached, Signal


BOARD = ("body_length_m", "body_width_m", "length_m", "width_m")
"""The keys of a board's size."""


def as_json(checked: Sequence[CheckedSpec]) -> str:
    """The JSON document of ``check`` (docs/commands.md): one entry a spec, absent numbers null."""
    return to_json(json_document(checked))


def json_document(checked: Sequence[CheckedSpec]) -> dict[str, Any]:
    """The findings as plain values for JSON."""
    return {
        "sitscad": __version__,
        "ok": all(spec.ok for spec in checked),
        "specs": [
            {
                "spec": spec.path,
                "name": spec.name or None,
                "ok": spec.ok,
                "findings": [finding_json(finding) for finding in spec.findings],
                "ignored": [_ignored_json(ignored) for ignored in spec.ignored],
                "not_checked": [{"rule": skipped.rule, "reason": skipped.reason} for skipped in spec.not_checked],
                "felt": [felt_json(reached) for reached in spec.reached],
                "signal": [signal_json(signal) for signal in spec.signals],
                "fit": _fit_json(spec),
                "closing": _closing_json(spec),
                "board": None if spec.board is None else dict(zip(BOARD, spec.board, strict=True)),
            }
            for spec in checked
        ],
    }


def _ignored_json(ignored: Ignored) -> dict[str, Any]:
    return {"reason": ignored.reason, "by": ignored.by, "finding": finding_json(ignored.finding)}


def _fit_json(spec: CheckedSpec) -> list[dict[str, Any]]:
    if not spec.fit:
        return []
    from sitscad.report.fit import fit_json  # only where something was measured

    return [fit_json(measure) for measure in spec.fit]


def _closing_json(spec: CheckedSpec) -> dict[str, Any] | None:
    if spec.closing is None:
        return None
    from sitscad.report.fit import closing_json  # only where there is a jaw

    return closing_json(spec.closing)


def to_json(document: object) -> str:
    """JSON text with every number that is not finite as null, and pure ASCII for every terminal and locale."""
    import json  # text needs none of it, and most checks are read by people

    return json.dumps(_finite(document), indent=1, allow_nan=False) + "\n"


FELT = ("requirement", "rule", "measured", "limit", "unit", "axis", "at")
"""What JSON says of what is felt beside what is asked."""

SIGNAL = {
    "coil": "coil",
    "force_N": "force",
    "rest_inductance_H": "rest",
    "inductance_H_per_N": "per_newton",
    "sigma_inductance_H_per_N": "sigma",
    "frequency_Hz_per_N": "frequency_per_newton",
    "sigma_frequency_Hz_per_N": "frequency_sigma",
    "share": "share",
    "frequency_share": "frequency_share",
    "steps": "steps",
}
"""What JSON says of a signal, and the fields of `Signal` that it stands for."""


def felt_json(reached: Reached) -> dict[str, Any]:
    """What is felt beside what is asked, as plain values for JSON."""
    return {name: getattr(reached, name) for name in FELT}


def signal_json(signal: Signal) -> dict[str, Any]:
    """What one coil's reading does from rest to the required force, as plain values for JSON."""
    return {key: getattr(signal, field) for key, field in SIGNAL.items()}


def finding_json(finding: Finding) -> dict[str, Any]:
    """One finding as plain values for JSON."""
    entry: dict[str, Any] = {
        "rule": finding.rule,
        "name": finding.name,
        "severity": finding.severity.value,
        "message": finding.message,
        "hint": finding.hint,
        "key": finding.key,
        "line": finding.line,
        "column": finding.column,
        "measured": finding.measured,
        "limit": finding.limit,
        "unit": finding.unit,
        "source": finding.source,
    }
    if finding.detail:
        entry["detail"] = finding.detail
    if finding.sigma is not None:
        entry["sigma"] = finding.sigma
    if finding.keeps_limit:
        entry["keeps_limit"] = True
    if finding.file is not None:
        entry["file"] = finding.file
    if finding.place is not None:
        place = finding.place
        entry["place"] = {"x_m": place.x, "y_m": place.y, "layer": place.layer, "nets": list(place.nets)}
    entry["fixes"] = [remedy_json(remedy) for remedy in finding.fixes]
    return entry


def remedy_json(remedy: Remedy) -> dict[str, Any]:
    """What mends a finding, as plain values for JSON."""
    edits = [{"key": edit.key, "old": edit.old, "new": edit.new, "what": edit.what} for edit in remedy.edits]
    return {"edits": edits, "safe": remedy.is_safe, "brings": list(remedy.brings)}


def _finite(value: object) -> object:
    """The same with None for numbers that JSON has not."""
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
