"""Findings as JSON for a program, and read back from it: the document of ``check`` (docs/commands.md,
data/check.schema.json).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sitscad.finding import Edit, Finding, Ignored, NotChecked, Place, Remedy, Severity
from sitscad.measured import Closing, Measure, RequirementResult, Share, Signal
from sitscad.report.findings.checked import CheckedSpec
from sitscad.version import __version__

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
                "ignored": [
                    {"reason": ignored.reason, "by": ignored.by, "finding": finding_json(ignored.finding)}
                    for ignored in spec.ignored
                ],
                "not_checked": [{"rule": skipped.rule, "reason": skipped.reason} for skipped in spec.not_checked],
                "felt": [{name: getattr(reached, name) for name in FELT} for reached in spec.reached],
                "signal": [{key: getattr(signal, field) for key, field in SIGNAL.items()} for signal in spec.signals],
                "fit": _fit_json(spec),
                "closing": _closing_json(spec),
                "board": None if spec.board is None else dict(zip(BOARD, spec.board, strict=True)),
            }
            for spec in checked
        ],
    }


def _fit_json(spec: CheckedSpec) -> list[dict[str, Any]]:
    if not spec.fit:
        return []
    from sitscad.report.measures import fit_json

    return [fit_json(measure) for measure in spec.fit]


def _closing_json(spec: CheckedSpec) -> dict[str, Any] | None:
    if spec.closing is None:
        return None
    from sitscad.report.measures import closing_json

    return closing_json(spec.closing)


def to_json(document: object) -> str:
    """JSON text with every number that is not finite as null, and pure ASCII for every terminal and locale."""
    import json  # text needs none of it, and most checks are read by people

    return json.dumps(_finite(document), indent=1, allow_nan=False) + "\n"


FELT = ("requirement", "rule", "measured", "limit", "unit", "axis", "at")
"""What JSON says of what is felt beside what is asked."""

SIGNAL = {
    "coil": "coil", "force_N": "force", "rest_inductance_H": "rest", "inductance_H_per_N": "per_newton",
    "sigma_inductance_H_per_N": "sigma", "frequency_Hz_per_N": "frequency_per_newton",
    "sigma_frequency_Hz_per_N": "frequency_sigma", "share": "share", "frequency_share": "frequency_share",
    "steps": "steps",
}
"""What JSON says of a signal, and the fields of `Signal` that it stands for."""


def finding_json(finding: Finding) -> dict[str, Any]:
    """One finding as plain values for JSON."""
    entry: dict[str, Any] = {
        "rule": finding.rule, "name": finding.name, "severity": finding.severity.value, "message": finding.message,
        "hint": finding.hint, "key": finding.key, "line": finding.line, "column": finding.column,
        "measured": finding.measured, "limit": finding.limit, "unit": finding.unit, "source": finding.source,
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


def read_findings(content: bytes, path: str, text: str) -> CheckedSpec | None:
    """The one spec of a ``findings.json``, at a path and with a text. None for what does not hold one spec."""
    import json

    try:
        (spec,) = json.loads(content)["specs"]
        ignored = [Ignored(_finding(each["finding"]), each["reason"], each["by"]) for each in spec["ignored"]]
        not_checked = tuple(NotChecked(each["rule"], each["reason"]) for each in spec["not_checked"])
        findings = tuple(map(_finding, spec["findings"]))
        return CheckedSpec(
            path, text, findings, not_checked, signals=tuple(map(_signal, spec["signal"])), ignored=tuple(ignored),
            fit=tuple(map(_measure, spec["fit"])), closing=_closing(spec["closing"]),
            reached=tuple(RequirementResult(**each) for each in spec["felt"]), name=spec["name"] or "",
            board=None if spec["board"] is None else tuple(spec["board"][key] for key in BOARD),
        )
    except (ValueError, KeyError, TypeError):
        return None


def _finding(entry: dict[str, Any]) -> Finding:
    place = entry.get("place")
    told = ("rule", "name", "message", "hint", "key", "line", "column", "measured", "limit", "unit", "source")
    return Finding(
        **{name: entry[name] for name in told}, severity=Severity(entry["severity"]), sigma=entry.get("sigma"),
        keeps_limit=entry.get("keeps_limit", False), detail=entry.get("detail", ""), file=entry.get("file"),
        place=None if place is None else Place(place["x_m"], place["y_m"], place["layer"], tuple(place["nets"])),
        fixes=tuple(_remedy(each) for each in entry.get("fixes", ())),
    )


def _remedy(entry: dict[str, Any]) -> Remedy:
    edits = tuple(Edit(each["key"], each["new"], each["old"], each.get("what", "value")) for each in entry["edits"])
    return Remedy(edits, tuple(entry["brings"]))


def _signal(entry: dict[str, Any]) -> Signal:
    return Signal(**{field: entry[key] for key, field in SIGNAL.items()})


def _measure(entry: dict[str, Any]) -> Measure:
    from sitscad.report.measures import MEASURE, SHARE

    parts = tuple(Share(**{field: each[key] for key, field in SHARE.items()}) for each in entry["parts"])
    return Measure(**{field: entry[key] for key, field in MEASURE.items() if field != "margin"}, parts=parts)


def _closing(entry: dict[str, Any] | None) -> Closing | None:
    if entry is None:
        return None
    return Closing(entry["parallel_at_m"], entry["reach_m"], entry["opening_rad"], entry["pivot_offset_m"])
