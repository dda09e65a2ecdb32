"""What makes a finding the same finding in the next run: its rule, its key and its turn among equals, not its line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sitscad.finding import Finding


def identities(findings: Sequence[Finding]) -> list[str]:
    """For every finding a text that stays the same when lines move, or when the numbers in its message change.

    Findings of one rule at one key are told apart by their turn, in the order given.
    """
    seen: Counter[tuple[str, str | None, str | None]] = Counter()
    names = []
    for finding in findings:
        key = (finding.rule, finding.key, finding.file)
        seen[key] += 1
        names.append("\0".join((finding.rule, finding.key or "", finding.file or "", str(seen[key]))))
    return names


def turnless(identity: str) -> str:
    """An identity without its turn: all findings of one rule at one key share it."""
    return identity.rpartition("\0")[0]


def fingerprint(*parts: str) -> str:
    """Sixteen hexadecimal digits of the SHA-256 of some texts."""
    import hashlib  # loads OpenSSL, which a plain check does not need

    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:16]
