"""What is written to disk: a package's folder, one writer at a time, staged beside the target and replaced as a whole
or not at all; and one file alone, in one step, so that an interruption leaves the old one.

Handing out the example specs that come with sitscad.
"""

from __future__ import annotations

import contextlib
import ctypes
import difflib
import errno
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from sitscad.spec import templates
from sitscad.spec.format.reading import SpecError
from sitscad.spec.load import load
from sitscad.spec.sensor import SensorSpec, json_schema
from sitscad.writer import json_bytes

PACKAGE_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")
_PART = r"[\w+-](?:[\w .+-]*[\w.+-])?"
FILE_NAME = re.compile(rf"{_PART}(/{_PART})*")

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2


class PackageError(Exception):
    """A package that cannot be written or read; the text says why, and what to do about it."""


def require_package_name(name: str) -> str:
    """`name` itself if it can be a folder beside others; `PackageError` otherwise."""
    if not PACKAGE_NAME.fullmatch(name):
        raise PackageError(f"{name!r} cannot name a package: small letters, digits and . _ - only, 64 at most")
    return name


def require_inside(path: str) -> str:
    """`path` itself if it stays inside a package whatever the system; `PackageError` otherwise."""
    if not FILE_NAME.fullmatch(path):
        raise PackageError(f"{path!r} is not a file name that a package may hold")
    return path


@contextlib.contextmanager
def opened_for_building(parent: Path, name: str) -> Iterator[Path]:
    """Hold the package `parent/name` for one build and yield an empty staging folder beside it.

    Leftovers of builds that were killed are cleaned first. The staging folder is gone afterwards, whatever happens.

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
                    shutil.rmtree(leftover, ignore_errors=True)
            staged = parent / f".{name}.new-{secrets.token_hex(6)}"
            staged.mkdir()
        try:
            yield staged
        finally:
            shutil.rmtree(staged, ignore_errors=True)
    finally:
        if lock is not None:
            with contextlib.suppress(OSError):
                (parent / f".{name}.lock").unlink()
            os.close(lock)


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files below `folder` (keys are checked names) and make sure that they have reached the disk."""
    with explained(f"cannot write into {folder.parent}"):
        for name in sorted(files):
            target = folder / require_inside(name)
            target.parent.mkdir(parents=True, exist_ok=True)
            with open(target, "xb") as stream:
                stream.write(files[name])
                stream.flush()
                os.fsync(stream.fileno())


def put_in_place(staged: Path, target: Path) -> None:
    """Let the staged folder take the target's place in one step, and remove what stood there.

    Where the system cannot exchange two folders, the old one is moved aside first; a build killed between the two
    moves is put right by the next one.
    """
    with explained(f"cannot replace {target}"):
        for folder in (staged, *(path for path in staged.rglob("*") if path.is_dir())):
            _sync_folder(folder)
        if not target.exists():
            os.rename(staged, target)
        elif not _exchange(staged, target):
            aside = target.parent / f".{target.name}.old-{secrets.token_hex(6)}"
            os.rename(target, aside)
            os.rename(staged, target)
            shutil.rmtree(aside, ignore_errors=True)
        _sync_folder(target.parent)


def set_aside(target: Path, files: list[str]) -> Path | None:
    """Copy files that somebody else made or changed to ``NAME.kept-1`` (2, 3 ...) before a package is replaced."""
    if not files:
        return None
    number = 1
    while (kept := target.parent / f"{target.name}.kept-{number}").exists():
        number += 1
    partial = target.parent / f".{target.name}.new-{secrets.token_hex(6)}"
    with explained(f"cannot keep the changed files of {target}"):
        for name in files:
            copy = partial / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(target / name, copy, follow_symlinks=False)
        os.rename(partial, kept)
    return kept


def list_files(folder: Path) -> list[str]:
    """Names of all files below `folder`, sorted, relative to it, with forward slashes; links count as files."""
    found = []
    for root, folders, files in os.walk(folder):
        links = [entry for entry in folders if os.path.islink(os.path.join(root, entry))]
        found += [Path(root, entry).relative_to(folder).as_posix() for entry in (*files, *links)]
    return sorted(found)


@contextlib.contextmanager
def explained(what: str) -> Iterator[None]:
    """Turn the system's refusal into one sentence."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        where = f" ({error.filename})" if error.filename else ""
        raise PackageError(f"{what}: {reason}{where}; nothing was changed") from error


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
    """Whether a killed build, or one that is at work, has left something beside a package."""
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
    """Write a file, or replace it, as a whole; raises OSError."""
    partial = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        partial.write_bytes(content)
        if target.exists() and target.stat().st_nlink > 1:
            with open(target, "r+b") as stream:
                stream.write(content)
                stream.truncate()
                os.fsync(stream.fileno())
            return
        if target.exists():
            shutil.copymode(target, partial)
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)


LONGEST_NAME = 64
"""Characters of a sensor's name at most."""

DEFAULT_TEMPLATE = "grasper_4layer"


def list_templates() -> dict[str, str]:
    """Every template's name with its one-line description: the first comment line of the file."""
    found = {}
    for name in templates.names():
        comments = (line.strip("# ") for line in templates.read(name).splitlines() if line.startswith("#"))
        found[name] = next((comment for comment in comments if comment), "")
    return found


def write_template(name: str = DEFAULT_TEMPLATE, path: str | Path | None = None, force: bool = False) -> Path:
    """Write a template as a new spec and return its path (``NAME.yaml`` in the working directory by default).

    Hyphens and underscores in `name` count as equal. A file of another name gives the sensor its own, as far as file
    names may hold it.

    Raises
    ------
    PackageError
        for an unknown template, an existing file (unless `force`), or a file that cannot be written.
    """
    found = _find(name)
    target = Path(f"{found}.yaml" if path is None else path)
    text = templates.read(found)
    if target.stem != found and (own := re.sub(r"[^A-Za-z0-9]+", "-", target.stem).strip("-")[:LONGEST_NAME]):
        text = re.sub(r"(?m)^name: \S+", f"name: {own}", text, count=1)
    return _new_file(target, text, force)


def write_study(
    of: Callable[[SensorSpec, str], str], name: str = DEFAULT_TEMPLATE, path: str | Path | None = None,
    force: bool = False,
) -> Path:
    """Write the study that `of` makes of a template and of where that stands (``study.yaml`` in the working directory
    by default), beside it the template where that is not there, and return its path. Raises PackageError as
    `write_template`, and where what is there cannot be read.
    """
    target = Path("study.yaml" if path is None else path)
    base = target.parent / f"{_find(name)}.yaml"
    if not base.exists():
        write_template(name, base)
    try:
        return _new_file(target, of(load(base), base.name), force)
    except SpecError as error:
        raise PackageError(f"{base} cannot be read: `sitscad check {base}` says why") from error


def _new_file(target: Path, text: str, force: bool) -> Path:
    try:
        if force:
            replace_file(target, text.encode("utf-8"))
        else:
            with open(target, "x", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
    except FileExistsError:
        raise PackageError(f"{target} exists and was not touched; --force writes over it, -o names another") from None
    except OSError as error:
        raise PackageError(f"cannot write {target}: {error.strerror or error}") from error
    return target


SCHEMA_FILE = "sitscad.schema.json"
"""What the header of every template calls the schema, for editors: it is looked for beside the spec."""


def write_schema(folder: str | Path) -> Path | None:
    """Write the schema that templates name into a folder; None where such a file is there already.

    Raises `PackageError` where it cannot be written.
    """
    target = Path(folder) / SCHEMA_FILE
    if target.is_symlink() or target.exists():
        return None
    write_file(target, json_bytes(json_schema()))
    return target


def _find(name: str) -> str:
    """The template that is meant, or a `PackageError` with the nearest name."""
    names = templates.names()
    wanted = name.lower().removesuffix(".yaml").removesuffix(".yml").replace("-", "_")
    if wanted in names:
        return wanted
    near = difflib.get_close_matches(wanted, names, n=1)
    meant = f" Did you mean {near[0]}?" if near else ""
    raise PackageError(f"There is no template {name!r}.{meant} There are: {', '.join(names)}.")
