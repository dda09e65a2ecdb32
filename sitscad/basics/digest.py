"""SHA-256 hashes. The standard library's module loads OpenSSL (3 ms), which a check does not need."""

from __future__ import annotations

from typing import Any


def sha256(content: bytes = b"") -> Any:
    """Return the hash object of some bytes."""
    import hashlib

    return hashlib.sha256(content)
