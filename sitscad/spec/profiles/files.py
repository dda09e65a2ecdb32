"""Profile files of users: in the spec's folder and below, never elsewhere."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TypeVar

from sitscad.finding import Finding
from sitscad.spec.format.diagnosis import finding_from_text
from sitscad.spec.format.kinds.preset import is_profile_file
from sitscad.spec.format.reading import decoded, read_file, read_section
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.format.section import Section
from sitscad.spec.format.yaml.text import TextError
from sitscad.spec.profiles.origin import Origin
from sitscad.spec.rules import SpecError

Form = TypeVar("Form", bound=Section)

MOST_FILES = 8
"""Profile files, each based on the next."""


def opened(
    name: str, form: type[Form], begins: str, place: Origin, key: str, remarks: Remarks
) -> tuple[Form, Origin] | None:
    """The profile in a file that is named at a key, or None with its faults noted; `begins` is how such a file may
    begin.
    """
    path = located(name, place, key, remarks)
    if path is None:
        return None
    shown = os.path.normpath(os.path.join(os.path.dirname(place.source.path), name))
    text = ""
    try:
        content = read_file(path, shown)
        text = decoded(content).removeprefix("\ufeff")
        document, source = read_section(text, shown, form, begins)
    except TextError as error:
        _note(remarks, shown, text, (finding_from_text(error),))
    except SpecError as error:
        _note(remarks, shown, text, error.findings)
    else:
        remarks.files |= dict.fromkeys(names_of(name, path, place), content)
        return document, Origin(source, "", path.parent, place.root, (*place.chain, path))
    return None


def names_of(name: str, path: Path, place: Origin) -> set[str]:
    """A file's path from the spec's folder: as it is written, and where a link leads, if that is elsewhere."""
    assert place.folder is not None and place.root is not None
    written = Path(os.path.normpath(place.folder.resolve() / name))
    below = [each for each in (written, path) if each.is_relative_to(place.root)]
    return {each.relative_to(place.root).as_posix() for each in below}


def _note(remarks: Remarks, path: str, text: str, findings: tuple[Finding, ...]) -> None:
    remarks.texts[path] = text
    remarks.findings += [replace(finding, file=path) for finding in findings]


def located(
    name: str, place: Origin, key: str, remarks: Remarks, what: str = "profile", like: str = "ourshop.yaml"
) -> Path | None:
    """Where a file is that a spec names, links resolved; None with the reason noted where it must not or cannot be
    read. `what` is its kind in words, `like` an example of its name.
    """
    hint = f"put the {what} beside the spec and write its name alone, like {like}"
    if place.folder is None or place.root is None:
        message = f"{name} is a {what} file, and this spec is a text without a folder"
        place.complain(remarks, "SIT017", key, message, "load the spec from its file")
        return None
    if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or "\\" in name:
        place.complain(remarks, "SIT017", key, f"{name} is not a path below the spec's folder", hint)
        return None
    try:
        path = (place.folder / name).resolve()
        is_there = path.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        place.complain(remarks, "SIT011", key, f"cannot read {name}: {error}", "is the path right?")
        return None
    if not path.is_relative_to(place.root):
        place.complain(remarks, "SIT017", key, f"{name} lies outside the spec's folder", hint)
    elif not is_there:
        state = "is not a file" if path.exists() else "is not there"
        place.complain(remarks, "SIT011", key, f"the {what} file {name} {state}", _beside(place.folder, like))
    elif path in place.chain:
        message = f"the profiles lead back to where they began: {place.circle(path)}"
        place.complain(remarks, "SIT018", key, message, "base one of them on an installed profile, like generic-flex")
    elif len(place.chain) >= MOST_FILES:
        message = f"more than {MOST_FILES} profile files are based on each other"
        place.complain(remarks, "SIT010", key, message, "base one of them on an installed profile, like generic-flex")
    else:
        return path
    return None


def _beside(folder: Path, like: str) -> str:
    """A hint with the files of a folder that are of the kind of an example."""
    is_profile = is_profile_file(like)
    kind, endings = ("YAML", (".yaml", ".yml")) if is_profile else ("STEP", (".step", ".stp"))
    there = sorted(path.name for path in folder.iterdir() if path.name.lower().endswith(endings))[:6]
    return f"there are: {', '.join(there)}" if there else f"there is no {kind} file in that folder"
