"""Exchange of a package's folder: as a whole or not at all, by one build at a time, without loss of a user's files.

A build writes into a staging folder beside the package, exchanges the two, and removes of the old package only the
files that match its manifest. It moves all other files and never copies them. This also keeps pipes, unreadable files
and files that appeared during the build.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import re
import secrets
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from sitscad.package.folder import PackageError, explained, list_files, write_files
from sitscad.package.manifest import MANIFEST, Manifest, intact, is_left_by_kicad, read_manifest

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2


@contextlib.contextmanager
def opened_for_building(parent: Path, name: str) -> Iterator[Path]:
    """Hold the package `parent/name` for one build and yield an empty staging folder beside it.

    Leftovers of killed builds are removed first. The staging folder is gone afterwards, whatever happens.

    Raises
    ------
    PackageError
        when another build holds the package, or the folder cannot be written.
    """
    with explained(f"cannot build in {parent}"):
        parent.mkdir(parents=True, exist_ok=True)
        lock = _lock(parent, name)
    try:
        with explained(f"cannot build in {parent}"):
            # put right what a killed build left behind; the lock is held, so nobody else uses these folders
            target = parent / name
            ours = _leftovers_of(name)
            for leftover in sorted(path for path in parent.iterdir() if ours.fullmatch(path.name)):
                if leftover.name.startswith(f".{name}.old-") and not target.exists():
                    os.rename(leftover, target)
                else:
                    _clear(leftover, target)
            staged = parent / f".{name}.new-{secrets.token_hex(6)}"
            staged.mkdir()
        try:
            yield staged
        finally:
            with contextlib.suppress(OSError):
                _clear(staged, target)
    finally:
        if lock is not None:
            with contextlib.suppress(OSError):
                (parent / f".{name}.lock").unlink()
            os.close(lock)


def write_package(staged: Path, files: Mapping[str, bytes], manifest: Manifest) -> None:
    """Write the files of a package, and its manifest last, so that a folder with a manifest is a whole package."""
    write_files(staged, files)
    write_files(staged, {_PARTIAL_MANIFEST: manifest.as_bytes()})
    with explained(f"cannot write into {staged.parent}"):
        os.rename(staged / _PARTIAL_MANIFEST, staged / MANIFEST)


_PARTIAL_MANIFEST = f"{MANIFEST}.new"


def put_in_place(staged: Path, target: Path) -> Path | None:
    """Exchange the staged package for the target in one step, and remove the old package.

    Return the folder that now holds the old package's files that no build wrote (``NAME.kept-1``, 2, 3 ...). None if
    there are no such files. Files that KiCad left beside its project stay there.

    If the system cannot exchange two folders, the old one is renamed first. If a build is killed between the two
    renames, the next build completes the exchange.
    """
    with explained(f"cannot replace {target}"):
        for folder in (staged, *(path for path in staged.rglob("*") if path.is_dir())):
            _sync_folder(folder)
        old = staged
        if not target.exists():
            os.rename(staged, target)
        elif not _exchange(staged, target):
            old = target.parent / f".{target.name}.old-{secrets.token_hex(6)}"
            os.rename(target, old)
            os.rename(staged, target)
        _sync_folder(target.parent)
    if not old.exists():
        return None
    try:
        _carry_over(old, target)
        return _remove(old, target)
    except OSError as error:
        raise PackageError(
            f"{target} is built, but the old package in {old}, which has files of yours, could not be moved: "
            f"{error.strerror or error}"
        ) from error


def _carry_over(old: Path, target: Path) -> None:
    """Move the files that KiCad left in the old package into the new one, if that has the same project."""
    files = read_manifest(target).files
    for name in list_files(old):
        if is_left_by_kicad(name, files) and not os.path.lexists(target / name):
            (target / name).parent.mkdir(exist_ok=True)
            os.rename(old / name, target / name)


def _clear(leftover: Path, target: Path) -> None:
    """Remove what a build left behind. A folder without a manifest is unfinished: only that build wrote into it."""
    if (leftover / MANIFEST).is_file():
        _remove(leftover, target)
    else:
        shutil.rmtree(leftover, ignore_errors=True)


def _remove(old: Path, target: Path) -> Path | None:
    """Delete an old package, except for files that no build wrote or that were changed since.

    Return the folder beside `target` that holds these files. None if there are none.
    """
    try:
        files = read_manifest(old).files
    except PackageError:
        files = {}
    for name, entry in files.items():
        if intact(old, {name: entry}) is not None:
            with contextlib.suppress(OSError):
                os.unlink(old / name)
    for folder, _, _ in os.walk(old, topdown=False):
        with contextlib.suppress(OSError):  # it has files that stay
            os.rmdir(folder)
    if not old.exists():
        return None
    if files and os.listdir(old) == [MANIFEST]:
        os.unlink(old / MANIFEST)
        os.rmdir(old)
        return None
    number = 1
    while os.path.lexists(kept := target.parent / f"{target.name}.kept-{number}"):
        number += 1
    os.rename(old, kept)
    if files:  # else it is no manifest of sitscad's
        os.unlink(kept / MANIFEST)
    return kept


def _lock(parent: Path, name: str) -> int | None:
    """Descriptor of an advisory lock that dies with its process; None where the system has none.

    Without locks the staging names still keep two builds apart, and the one that ends last wins.
    """
    try:
        import fcntl
    except ImportError:  # pragma: no cover - not a POSIX system
        return None
    path = parent / f".{name}.lock"
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(descriptor)
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                return None  # a file system without locks
            message = f"another build of {name} is writing to {parent}; wait for it, or give another -o folder"
            raise PackageError(message) from None
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), os.stat(path)):
                return descriptor
        os.close(descriptor)  # its owner removed it between our opening and locking it


def has_leftovers(parent: Path, name: str) -> bool:
    """Whether a lock or a staging folder, of a killed or a running build, lies beside a package."""
    if not parent.is_dir():
        return False
    ours = _leftovers_of(name)
    return any(entry.name == f".{name}.lock" or ours.fullmatch(entry.name) for entry in parent.iterdir())


def _leftovers_of(name: str) -> re.Pattern[str]:
    return re.compile(re.escape(f".{name}.") + "(new|old)-[0-9a-f]{12}")


def _exchange(one: Path, other: Path) -> bool:
    """Swap two folders in one step of the file system (Linux renameat2); False where that cannot be done."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    return rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0


def _sync_folder(folder: Path) -> None:
    """Have the system write a folder's entries to the disk, where it can."""
    with contextlib.suppress(OSError):  # not every system opens folders
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
