"""What was known before: the JSON of an earlier ``check``. Its findings do not fail again; new and graver ones do."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sitscad.finding import Finding, Severity
from sitscad.policy.configuration import PolicyError
from sitscad.record import record
from sitscad.report.findings.checked import identities, turnless

MAX_BYTES = 64 << 20

LARGEST = 1e15
"""No figure of a finding is so large in SI units: what is larger in a baseline was not measured."""

SAME = 1e-6
"""By so much of its limit a figure may come out worse from one machine to the next."""


@record
class Known:
    """A finding that was known before: how much it weighed, and its figures (SI; None where it had none)."""

    severity: Severity
    measured: float | None = None
    limit: float | None = None
    keeps_limit: bool = False

    def covers(self, now: Finding) -> bool:
        """Whether a finding is no graver than this one was: in what it weighs, and in its figure, which lies on the
        wrong side of its limit as before, and by no more; or as well on the right side.
        """
        if not self.severity.weighs(now.severity):
            return False
        if now.measured is None or now.limit is None:
            return True
        if self.measured is None or self.limit is None or self.keeps_limit != now.keeps_limit:
            return False
        before, after = self.measured - self.limit, now.measured - now.limit
        if before * after < 0.0:
            return False
        worse = abs(after) - abs(before)
        return (-worse if now.keeps_limit else worse) <= SAME * abs(now.limit)


@record
class Baseline:
    """For every spec (its absolute path, and its name) the findings known of it, by what makes them the same."""

    named: str
    known: Mapping[tuple[str, str], Mapping[str, Known]]

    def of(self, path: str, name: str) -> Mapping[str, Known]:
        """What is known of a spec."""
        return self.known.get((_place(path), name), {})

    def holds(self, path: str, name: str) -> bool:
        """Whether a spec was checked for it."""
        return (_place(path), name) in self.known

    def covered(self, path: str, name: str, findings: Sequence[Finding]) -> list[bool]:
        """Of the findings of a spec, which were known and are no graver: each by its own entry, or by another one of
        its rule and key that no finding has, because one that stood before it was mended.
        """
        free, found = dict(self.of(path, name)), [False] * len(findings)
        names = identities(findings)
        for is_own in (True, False):
            for turn, finding in enumerate(findings):
                alike = (
                    key for key in free if turnless(key) == turnless(names[turn]) and (key == names[turn] or not is_own)
                )
                entry = None if found[turn] else next((key for key in alike if free[key].covers(finding)), None)
                if entry is not None:
                    found[turn] = free.pop(entry) is not None
        return found

    def as_json(self, path: str, name: str) -> dict[str, Any]:
        """What is known of a spec as plain values, for a manifest; empty where nothing is."""
        known = self.of(path, name)
        rows = {key: [k.severity.value, k.measured, k.limit, k.keeps_limit] for key, k in sorted(known.items())}
        return {"named": self.named, "known": rows} if rows else {}


def read_baseline(path: str) -> Baseline:
    """The baseline in a file that ``sitscad check --format json`` printed.

    Paths in it count from the file's own folder. Raises `PolicyError` for any other file.
    """
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise PolicyError(f"cannot read the baseline {path}: {getattr(error, 'strerror', None) or error}") from error
    try:
        folder = os.path.dirname(os.path.abspath(path))
        known = {(_place(s["spec"], folder), str(s["name"] or "")): _entries(s) for s in json.loads(content)["specs"]}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        hint = "make one with: sitscad check SPEC... --format json > FILE"
        raise PolicyError(f"{path} is no baseline ({type(error).__name__}: {error}); {hint}") from error
    return Baseline(Path(path).name, known)


def kept_baseline(path: str, name: str, document: Mapping[str, Any]) -> Baseline:
    """The baseline that a manifest keeps of the spec at a path (`Baseline.as_json`). Raises ValueError, TypeError or
    KeyError for what is none.
    """
    rows = {
        str(key): Known(Severity(word), _figure(measured), _figure(limit), keeps_limit is True)
        for key, (word, measured, limit, keeps_limit) in document["known"].items()
    }
    return Baseline(str(document["named"]), {(_place(path), name): rows})


def _place(path: str, folder: str = "") -> str:
    """What a spec is known by: its absolute path, from the working folder or another; standard input (``-``) has
    none.
    """
    return path if path == "-" else os.path.abspath(os.path.join(folder, path))


def _figure(value: Any) -> float | None:
    """A figure of a baseline, None for what cannot have been measured, as true, NaN and 1e99."""
    return float(value) if type(value) in (int, float) and abs(value) < LARGEST else None


def _entries(spec: Mapping[str, Any]) -> dict[str, Known]:
    told = [*spec["findings"], *(entry["finding"] for entry in spec["ignored"])]
    findings = [
        Finding(str(entry["rule"]), "", Severity(entry["severity"]), "", key=entry["key"], file=entry.get("file"))
        for entry in told
    ]
    known = (
        Known(
            Severity(entry["severity"]),
            _figure(entry["measured"]),
            _figure(entry["limit"]),
            entry.get("keeps_limit") is True,
        )
        for entry in told
    )
    return dict(zip(identities(findings), known, strict=True))
