"""What was known before: the JSON of an earlier ``check``. Its findings do not fail again; new and graver ones do."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitscad.finding import Finding, Severity
from sitscad.policy.values import PolicyError
from sitscad.record import record
from sitscad.report.findings.identity import identities

MAX_BYTES = 64 << 20


@record
class Baseline:
    """For every spec (its absolute path) the findings known of it, by what makes them the same, and their severity."""

    named: str
    known: Mapping[str, Mapping[str, Severity]]

    def of(self, path: str) -> Mapping[str, Severity]:
        """What is known of a spec."""
        return self.known.get(os.path.abspath(path), {})


def read_baseline(path: str) -> Baseline:
    """The baseline in a file that ``sitscad check --format json`` printed.

    Paths in it count from the working folder, or from the file's own. Raises `PolicyError` for any other file.
    """
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise PolicyError(f"cannot read the baseline {path}: {getattr(error, 'strerror', None) or error}") from error
    try:
        document = json.loads(content)
        known: dict[str, Mapping[str, Severity]] = {}
        for spec in document["specs"]:
            entries = _entries(spec)
            for folder in (os.path.dirname(os.path.abspath(path)), os.getcwd()):
                known[os.path.abspath(os.path.join(folder, spec["spec"]))] = entries
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        hint = "make one with: sitscad check SPEC... --format json > FILE"
        raise PolicyError(f"{path} is no baseline ({type(error).__name__}: {error}); {hint}") from error
    return Baseline(Path(path).name, known)


def _entries(spec: Mapping[str, Any]) -> dict[str, Severity]:
    """The severities of a spec's findings by their identities."""
    told = [*spec["findings"], *(entry["finding"] for entry in spec.get("ignored", []))]
    findings = [
        Finding(str(entry["rule"]), "", Severity(entry["severity"]), "", key=entry["key"], file=entry.get("file"))
        for entry in told
    ]
    return dict(zip(identities(findings), (finding.severity for finding in findings), strict=True))
