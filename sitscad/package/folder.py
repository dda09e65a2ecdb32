"""File names allowed in a package, the list of files in a folder, and writing of files in one step.

If writing is interrupted, the old file remains complete.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.errors import ExpectedError
from sitscad.basics.units import escape_controls

_NO_DEVICE = r"(?!(?i:con|prn|aux|nul|com\d|lpt\d)(?:[./]|$))"
"""Pattern that excludes names which Windows reserves for devices, with any ending."""

PACKAGE_NAME = re.compile(_NO_DEVICE + r"[a-z0-9][a-z0-9._-]{0,63}")
_PART = _NO_DEVICE + r"[\w+-](?:[\w .+-]*[\w+-])?"
FILE_NAME = re.compile(rf"{_PART}(/{_PART})*")


class PackageError(ExpectedError):
    """Raised if a package cannot be written or read. The text gives the reason and what to do.

    File names in the text are escaped, so that no name can send control characters to a terminal.
    """

    @checked_arguments
    def __init__(self, message: str) -> None:
        super().__init__(escape_controls(message))


def require_package_name(name: str) -> str:
    """Return `name` if it may be the name of a package's folder. Raises PackageError otherwise."""
    if not PACKAGE_NAME.fullmatch(name):
        raise PackageError(f"{name!r} cannot name a package: small letters, digits and . _ - only, 64 at most")
    return name


def require_inside(path: str) -> str:
    """Return `path` if it is a path inside a package on every operating system. Raises PackageError otherwise."""
    if not FILE_NAME.fullmatch(path):
        raise PackageError(f"{path!r} is not a file name that a package may hold")
    return path


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files below `folder` and flush them to the disk. The keys of `files` are paths relative to the folder."""
    with raising_package_errors(f"cannot write into {folder.parent}"):
        for name in sorted(files):
            target = folder / require_inside(name)
            target.parent.mkdir(parents=True, exist_ok=True)
            with open(target, "xb") as stream:
                stream.write(files[name])
                stream.flush()
                os.fsync(stream.fileno())


def list_files(folder: Path) -> list[str]:
    """Return the names of all files below `folder`, sorted, relative to it, with forward slashes.

    Links, and folders that cannot be read, count as files.
    """
    names: list[str] = []

    def add(path: str) -> None:
        names.append(Path(path).relative_to(folder).as_posix())

    for root, folders, files in os.walk(folder, onerror=lambda error: add(error.filename)):
        for entry in (*files, *(name for name in folders if os.path.islink(os.path.join(root, name)))):
            add(os.path.join(root, entry))
    return sorted(names)


@contextlib.contextmanager
def raising_package_errors(what: str) -> Iterator[None]:
    """Convert an OSError inside this context to a PackageError, whose text begins with `what` and gives the reason."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        where = f" ({error.filename})" if error.filename else ""
        raise PackageError(f"{what}: {reason}{where}; nothing was changed") from error


def write_file(path: str | Path, content: bytes) -> None:
    """Write or replace a file completely, or leave it unchanged.

    If `path` is a link, the file to which it points is replaced. Permissions stay. A file with several names (hard
    links) keeps them: the new content is first written to a temporary file and then into the file itself.

    Raises
    ------
    PackageError
        if the file cannot or may not be written
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise PackageError(f"cannot write {path}: it may only be read")
    try:
        replace_file(target, content)
    except OSError as error:
        raise PackageError(f"cannot write {path}: {error.strerror or error}") from error


def replace_file(target: Path, content: bytes) -> None:
    """Write or replace a file completely, or leave it unchanged and raise OSError."""
    partial = target.with_name(f".{target.name}.{os.urandom(6).hex()}")
    try:
        partial.write_bytes(content)
        if target.exists() and target.stat().st_nlink > 1:
            with open(target, "r+b") as stream:
                stream.write(content)
                stream.truncate()
                os.fsync(stream.fileno())
            return
        if target.exists():
            partial.chmod(stat.S_IMODE(target.stat().st_mode))
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)
