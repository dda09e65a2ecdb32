"""Names allowed in a package, the list of files in a folder, files written in one step, and the example specs.

An interruption while a file is written leaves the old file whole.
"""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Severity
from sitscad.basics.units import printable
from sitscad.files.writer import json_bytes
from sitscad.spec import templates
from sitscad.spec.load import load, rewritten_spec
from sitscad.spec.profiles import installed_rules
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec, json_schema

_NO_DEVICE = r"(?!(?i:con|prn|aux|nul|com\d|lpt\d)(?:[./]|$))"
"""Windows takes these names, with any ending, for devices."""

PACKAGE_NAME = re.compile(_NO_DEVICE + r"[a-z0-9][a-z0-9._-]{0,63}")
_PART = _NO_DEVICE + r"[\w+-](?:[\w .+-]*[\w+-])?"
FILE_NAME = re.compile(rf"{_PART}(/{_PART})*")


class PackageError(Exception):
    """Raised if a package cannot be written or read. The text gives the reason and what to do.

    File names in the text are escaped, so that no name can send control characters to a terminal.
    """

    @checked_arguments
    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


def require_package_name(name: str) -> str:
    """Return `name` if it can be a folder beside others. Raises PackageError otherwise."""
    if not PACKAGE_NAME.fullmatch(name):
        raise PackageError(f"{name!r} cannot name a package: small letters, digits and . _ - only, 64 at most")
    return name


def require_inside(path: str) -> str:
    """Return `path` if it stays inside a package on every system. Raises PackageError otherwise."""
    if not FILE_NAME.fullmatch(path):
        raise PackageError(f"{path!r} is not a file name that a package may hold")
    return path


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files below `folder` and flush them to the disk. The keys are checked names."""
    with explained(f"cannot write into {folder.parent}"):
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
def explained(what: str) -> Iterator[None]:
    """Raise PackageError, with a sentence on the reason, instead of OSError."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        where = f" ({error.filename})" if error.filename else ""
        raise PackageError(f"{what}: {reason}{where}; nothing was changed") from error


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file, or replace it, as a whole.

    The target of a link is replaced, not the link. Permissions are kept. A file with several names (hard links) keeps
    them: the new content is written beside it first, and then over it.

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
    """Write a file, or replace it, as a whole. Raises OSError if that fails."""
    partial = target.with_name(f".{target.name}.{secrets.token_hex(6)}")
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
"""Largest number of characters in a sensor's name."""

DEFAULT_TEMPLATE = "grasper_4layer"


def list_templates() -> dict[str, str]:
    """Return a line that describes each template, by name: the first comment line of its file."""
    descriptions = {}
    for name in templates.names():
        comments = (line.strip("# ") for line in templates.read(name).splitlines() if line.startswith("#"))
        descriptions[name] = next((comment for comment in comments if comment), "")
    return descriptions


def write_template(name: str = DEFAULT_TEMPLATE, path: str | Path | None = None, force: bool = False) -> Path:
    """Write a template as a new spec and return its path (by default ``NAME.yaml`` in the working directory).

    Hyphens and underscores in `name` are equal. If the file has another name than the template, the sensor gets the
    file's name, with characters that a sensor's name may have.

    Raises
    ------
    PackageError
        if the template is unknown, the file exists (unless `force`), or it cannot be written
    """
    template = _find(name)
    target = Path(f"{template}.yaml" if path is None else path)
    text = templates.read(template)
    if target.stem != template and (new_name := re.sub(r"[^A-Za-z0-9]+", "-", target.stem).strip("-")[:LONGEST_NAME]):
        text = re.sub(r"(?m)^name: \S+", f"name: {new_name}", text, count=1)
    return _new_file(target, text, force)


RECOMMENDED = "recommended"
"""Name of the fabricator's profile that is recommended to start with."""


def profile_lines(path: Path) -> tuple[str, ...]:
    """Return lines on a spec's fabricator profile: its name and purpose, and whether the recommended one suits.

    If the spec has another profile, the second line states whether the board can be made with the recommended profile.
    """
    spec = load(path)
    uses = [("fpc.rules is", spec.fpc.rules)]
    if spec.fpc.rules.name != RECOMMENDED:
        refused = ", ".join(refusals(rewritten_spec(spec, [("fpc.rules", RECOMMENDED)])))
        head = f"this board cannot be made ({refused}) with" if refused else "this board can be made with"
        uses.append((f"{head} fpc.rules", installed_rules(RECOMMENDED)))
    return tuple(f"{head}: {rules.name}" + (f" ({rules.purpose})" if rules.holder("purpose") == rules.name else "")
                 for head, rules in uses)


def refusals(spec: SensorSpec) -> list[str]:
    """Return the rules about the board (SIT1xx) that a spec breaks. Rules about estimates are not applied."""
    from sitscad.checks.judging import RULES
    from sitscad.checks.rules import apply_rule
    from sitscad.estimates.design import Design

    design = Design(spec)
    return [rule.id for rule in RULES if rule.id.startswith("SIT1")
            and any(finding.severity is Severity.ERROR for finding in apply_rule(rule, design, Severity.ERROR)[0])]


def write_study(
    of: Callable[[SensorSpec, str], str], name: str = DEFAULT_TEMPLATE, path: str | Path | None = None,
    force: bool = False,
) -> Path:
    """Write a study of a template and return its path (by default ``study.yaml`` in the working directory).

    `of` makes the study's text from the template's spec and its file name. The template is written beside the study if
    it is not there.

    Raises
    ------
    PackageError
        for the reasons of `write_template`, or if the template beside the study cannot be read
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
"""File name of the schema in the header of every template. Editors look for it beside the spec."""


def write_schema(folder: str | Path) -> Path | None:
    """Write the schema that templates name into a folder. None if a file of that name exists.

    Raises PackageError if it cannot be written.
    """
    target = Path(folder) / SCHEMA_FILE
    if target.is_symlink() or target.exists():
        return None
    write_file(target, json_bytes(json_schema()))
    return target


def _find(name: str) -> str:
    """Return the template that a name means. Raises PackageError, with the nearest name, if there is none."""
    names = templates.names()
    template = name.lower().removesuffix(".yaml").removesuffix(".yml").replace("-", "_")
    if template in names:
        return template
    near = difflib.get_close_matches(template, names, n=1)
    suggestion = f" Did you mean {near[0]}?" if near else ""
    raise PackageError(f"There is no template {name!r}.{suggestion} There are: {', '.join(names)}.")
