"""From a file to the frozen `SensorSpec`: the one way in. Everything that is wrong is reported at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sitscad.spec.format.kinds import is_profile_file
from sitscad.spec.format.reading import (
    ROOM_RULES,
    SpecError,
    decoded,
    finding_from_flaw,
    finding_from_text,
    in_order,
    read_file,
    read_section,
    section_of_data,
)
from sitscad.spec.resolver.sensor import resolve
from sitscad.spec.sensor import SensorSpec, SpecDocument
from sitscad.spec.yaml.source import MAX_BYTES, SpecSource, TextError

__all__ = ["SpecError", "load", "load_text"]

NO_FILE = "<text>"
"""What a text is called that came from no file: it has no folder, and so no profile files beside it."""


def load(path: str | os.PathLike[str], profiles: str | os.PathLike[str] | None = None) -> SensorSpec:
    """The sensor that a YAML file describes; raises `SpecError` with every finding where it describes none.

    A fabricator's profile that is named as a file is looked for in the spec's folder, then in the folder `profiles`.
    """
    try:
        content = read_file(Path(path))
        text = decoded(content)
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    spec = load_text(text, path, profiles)
    files = {Path(path).name: content, **spec.source.files}
    return spec.known(replace(spec.source, files=files))


def read_text(path: str) -> str:
    """The text of a spec as it stands in its file, with its own line ends; of ``-`` what comes from standard input.

    Raises `SpecError` where it is no text, or cannot be read.
    """
    try:
        content = sys.stdin.buffer.read(MAX_BYTES + 1) if path == "-" else read_file(Path(path))
        decoded(content)
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return content.decode("utf-8")


def load_text(
    text: str, path: str | os.PathLike[str] = NO_FILE, profiles: str | os.PathLike[str] | None = None
) -> SensorSpec:
    """The sensor that a YAML text describes; `path` is what findings and reports call the text, and in its folder the
    fabricator's profiles are that the text names as files; what is not there is looked for in the folder `profiles`.
    """
    name = os.fspath(path)
    document, source = read_section(text.removeprefix("\ufeff"), name, SpecDocument, "sitscad: 1")
    return _resolved(document, source, profiles)


def load_values(
    data: Mapping[str, Any], source: SpecSource, profiles: str | os.PathLike[str] | None = None
) -> SensorSpec:
    """The sensor that plain values describe, in the place of those that a text holds: for programs that try many. Its
    source is that text, by which findings are placed and comments count, and not what is described.
    """
    return _resolved(section_of_data(data, source, SpecDocument), source, profiles)


def _resolved(document: SpecDocument, source: SpecSource, profiles: str | os.PathLike[str] | None) -> SensorSpec:
    beside = None if source.path == NO_FILE else Path(source.path).parent
    folder = _folder_of(document.fpc.rules, beside, profiles)
    spec, remarks = resolve(document, source, folder)
    if remarks.flaws or remarks.findings:
        findings = [finding_from_flaw(flaw, source) for flaw in remarks.flaws]
        lacks_room = not remarks.findings and all(flaw.rule in ROOM_RULES for flaw in remarks.flaws)
        found = (*in_order(findings), *remarks.findings)
        raise SpecError(found, remarks.texts, spec if lacks_room else None, source)
    return spec.known(replace(spec.source, defaults=tuple(remarks.defaults), files=remarks.files))


def _folder_of(rules: object, beside: Path | None, profiles: str | os.PathLike[str] | None) -> Path | None:
    """The folder in which a spec's profile file is: that of profiles only where it is there and not beside the spec."""
    if profiles is None or not isinstance(rules, str) or not is_profile_file(rules):
        return beside
    try:
        is_beside = beside is not None and (beside / rules).exists()
        return Path(profiles) if not is_beside and (Path(profiles) / rules).is_file() else beside
    except (OSError, ValueError):
        return beside
