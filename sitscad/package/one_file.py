"""Writing one file in one step, so that an interruption leaves the old one."""

from __future__ import annotations

import os
from pathlib import Path

from sitscad.package.folder import PackageError


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file, or replace it, as a whole; raises PackageError where that cannot be done."""
    target = Path(path)
    try:
        replace_file(target, content)
    except OSError as error:
        raise PackageError(f"cannot write {target}: {error.strerror or error}") from error


def replace_file(target: Path, content: bytes) -> None:
    """The same, raising OSError."""
    partial = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        partial.write_bytes(content)
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)
