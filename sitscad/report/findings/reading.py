"""Findings read back from the JSON that told them."""

from __future__ import annotations

from typing import Any

from sitscad.finding import Edit, Finding, Ignored, NotChecked, Place, Remedy, Severity
from sitscad.measured import Closing, Measure, Reached, Share, Signal
from sitscad.report.findings.checked import CheckedSpec
from sitscad.report.findings.document import BOARD, SIGNAL
from sitscad.report.fit import MEASURE, SHARE


def read_findings(content: bytes, path: str, text: str) -> CheckedSpec | None:
    """The one spec of a ``findings.json``, at a path and with a text. None for what does not hold one spec."""
    import json

    try:
        (spec,) = json.loads(content)["specs"]
        ignored = [Ignored(_finding(each["finding"]), each["reason"], each["by"]) for each in spec["ignored"]]
        not_checked = tuple(NotChecked(each["rule"], each["reason"]) for each in spec["not_checked"])
        findings = tuple(map(_finding, spec["findings"]))
        return CheckedSpec(
            path, text, findings, not_checked,
            signals=tuple(map(_signal, spec["signal"])),
            ignored=tuple(ignored),
            fit=tuple(map(_measure, spec["fit"])),
            closing=_closing(spec["closing"]),
            reached=tuple(Reached(**each) for each in spec["felt"]),
            name=spec["name"] or "",
            board=None if spec["board"] is None else tuple(spec["board"][key] for key in BOARD),
        )  # fmt: skip
    except (ValueError, KeyError, TypeError):
        return None


def _finding(entry: dict[str, Any]) -> Finding:
    """The finding that an entry of JSON says."""
    place = entry.get("place")
    told = ("rule", "name", "message", "hint", "key", "line", "column", "measured", "limit", "unit", "source")
    return Finding(
        **{name: entry[name] for name in told},
        severity=Severity(entry["severity"]),
        sigma=entry.get("sigma"),
        keeps_limit=entry.get("keeps_limit", False),
        detail=entry.get("detail", ""),
        file=entry.get("file"),
        place=None if place is None else Place(place["x_m"], place["y_m"], place["layer"], tuple(place["nets"])),
        fixes=tuple(_remedy(each) for each in entry.get("fixes", ())),
    )


def _remedy(entry: dict[str, Any]) -> Remedy:
    edits = tuple(Edit(each["key"], each["new"], each["old"], each.get("what", "value")) for each in entry["edits"])
    return Remedy(edits, tuple(entry["brings"]))


def _signal(entry: dict[str, Any]) -> Signal:
    return Signal(**{field: entry[key] for key, field in SIGNAL.items()})


def _measure(entry: dict[str, Any]) -> Measure:
    parts = tuple(Share(**{field: each[key] for key, field in SHARE.items()}) for each in entry["parts"])
    return Measure(**{field: entry[key] for key, field in MEASURE.items() if field != "margin"}, parts=parts)


def _closing(entry: dict[str, Any] | None) -> Closing | None:
    if entry is None:
        return None
    return Closing(entry["parallel_at_m"], entry["reach_m"], entry["opening_rad"], entry["pivot_offset_m"])
