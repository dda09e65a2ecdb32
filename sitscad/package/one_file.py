"""Writing one file in one step, so that an interruption leaves the old one."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from sitscad.package.folder import PackageError


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file, or replace it, as a whole; what a link leads to is replaced, not the link; permissions are kept.
    A file of several names (hard links) keeps them all: it is written over once its new content lies beside it.

    Raises PackageError where that cannot be done, or may not.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise PackageError(f"cannot write {path}: it may only be read")
    try:
        replace_file(target, content)
    except OSError as error:
        raise PackageError(f"cannot write {path}: {error.strerror or error}") from error


def replace_file(target: Path, content: bytes) -> None:
    """The same, raising OSError."""
    partial = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        partial.write_bytes(content)
        if target.exists() and target.stat().st_nlink > 1:
            _written_over(target, content)
            return
        if target.exists():
            shutil.copymode(target, partial)
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)


def _written_over(target: Path, content: bytes) -> None:
    """Put content into a file as it stands, and make sure that it has reached the disk."""
    with open(target, "r+b") as stream:
        stream.write(content)
        stream.truncate()
        os.fsync(stream.fileno())
