"""SHA-256 hashes. The standard library's hash module loads OpenSSL (3 ms), so it is imported at the first hash only."""

from __future__ import annotations

from typing import Any


def sha256(content: bytes = b"") -> Any:
    """Return a SHA-256 hash object, fed with `content`."""
    import hashlib

    return hashlib.sha256(content)
