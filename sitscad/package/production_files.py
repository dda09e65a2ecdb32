"""Comparison of the production files of a package with each other.

These are Gerber and drill files, the job file, the order archive and the panel's files.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from sitscad.files.documents.archive import differences
from sitscad.files.extraction.differences import compare, compare_job, extract
from sitscad.files.extraction.intent import UNUSED
from sitscad.files.extraction.limits import ExtractionError, reading
from sitscad.files.extraction.panel_comparison import compare_panel
from sitscad.package.manifest import FORCED_NOTE, NOT_WRITTEN, Manifest


def layer_differences(folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield the differences between layer and drill files and the job file, for the board and for a panel."""
    try:
        with reading("the job file cannot be compared"):
            yield from compare_job(folder / "fpc")
            if _has_panel(manifest):
                yield from compare_job(folder / "fpc" / "panel")
    except ExtractionError as error:
        yield str(error)


def _has_panel(manifest: Manifest) -> bool:
    return any(name.startswith("fpc/panel/") for name in manifest.files)


def archive_differences(folder: Path, manifest: Manifest) -> tuple[str, ...] | None:
    """Return the differences between the order archive (zip) and the files beside it. None if there is no archive.

    An archive with the name of another sensor counts as a difference.
    """
    archives = sorted(name for name in manifest.files if _ARCHIVE.fullmatch(name) and (folder / name).is_file())
    archive = f"fpc/{manifest.spec['name']}-order.zip"
    text = f"is an order archive, but not of the sensor {manifest.spec['name']}"
    other_archives = tuple(f"{name} {text}" for name in archives if name != archive)
    if archive not in archives:
        return other_archives or None
    note = folder / "fpc" / FORCED_NOTE
    forced = note.read_text("utf-8", "replace").partition(NOT_WRITTEN)[0] if note.is_file() else ""
    ours = (name for name in manifest.files if name.startswith("fpc/") and name != archive)
    files = {name: (folder / name).read_bytes() for name in ours if (folder / name).is_file()}
    has_plugins = bool(manifest.configuration.get("plugins"))
    try:
        with reading("cannot be compared"):
            content = (folder / archive).read_bytes()
            texts = tuple(differences(content, files, manifest.spec["name"], forced, not has_plugins))
    except ExtractionError as error:
        texts = (str(error),)
    return (*other_archives, *(f"{archive}: {difference}" for difference in texts))


_ARCHIVE = re.compile(r"fpc/.*-order\.zip", re.IGNORECASE)


def net_differences(folder: Path, intended: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    """Yield differences between the connections of the copper, the net names in the files, and the `intended` nets."""
    try:
        with reading("they cannot be read"):
            board = extract(folder)
            findings = compare(board)
    except ExtractionError as error:
        yield f"the Gerber files do not make up a board: {error}"
        return
    yield from (f"{difference.kind.value}: {difference.message}" for difference in findings)
    joined: dict[str, set[str]] = {}
    for net in board.nets:
        for contact in (each for each in net.contacts if not each.net.startswith(UNUSED)):
            joined.setdefault(contact.net, set()).add(contact.function or contact.pin)
    for name in sorted({*intended, *joined}):
        intended_pads, there = set(intended.get(name, ())), joined.get(name, set())
        if len(intended_pads) < 2:
            yield f"coil {name} does not lead from one contact to another: the layout found no way out for it"
        if intended_pads != there:
            yield f"net {name} joins {_names(there)} where the layout joins {_names(intended_pads)}"


def panel_differences(folder: Path, manifest: Manifest) -> tuple[int | None, tuple[str, ...]]:
    """Return the number of boards on the panel that were compared, and their differences from the single board.

    The number is None if there is no panel.
    """
    if not _has_panel(manifest):
        return None, ()
    try:
        with reading("they cannot be read"):
            boards, differences = compare_panel(folder / "fpc", folder / "fpc" / "panel")
    except ExtractionError as error:
        return 0, (f"the panel's files do not make up a panel: {error}",)
    return boards, tuple(dict.fromkeys(differences))


def _names(pins: set[str]) -> str:
    return ", ".join(sorted(pins)) or "nothing"
