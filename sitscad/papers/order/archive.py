"""The archive that is sent: the files of the order under the names that the fabricator is used to, in one ZIP.

Where the boards come in a panel, the archive holds the panel's images and not the single board's, so that nobody makes
the wrong ones. Nothing is compressed and no date is kept: equal orders are equal bytes on any machine.
"""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Iterator, Mapping
from functools import cache

from sitscad.fabrication.files import FOLDER, fabrication_path
from sitscad.layout.board import Layout
from sitscad.layout.cutting.panel import Panel
from sitscad.spec.profiles.presets import DATA

_FUNCTION = re.compile(rb"TF\.FileFunction,([^*\r\n]*)")
_COPPER = re.compile(r"Copper,L(\d+),Inr")
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest date that a ZIP can hold; it stands for none."""

NOTE = "FORCED.txt"


def render(layout: Layout, panel: Panel | None, forced: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The archive by its path in the package, out of the files that were written before it.

    ``forced`` says why the order ought not to be placed; where it is not empty it is in the archive.
    """
    chosen = [path for path in sorted(files) if _is_sent(path, panel is not None)]
    names = {path: archive_name(layout, path, files[path]) for path in chosen}
    contents = {names[path]: _renamed(path, files[path], names) for path in chosen}
    if forced:
        contents[NOTE] = forced.encode("utf-8")
    return {fabrication_path(layout, "order.zip"): _zipped(contents)}


def archive_name(layout: Layout, path: str, content: bytes) -> str:
    """What a file is called in the archive: by its X2 file function where it has one, else as in the package."""
    own = path.rpartition("/")[2]
    found = _FUNCTION.search(content)
    if found is None or not path.endswith((".gbr", ".drl")):
        return own
    function = found[1].decode("ascii")
    inner = _COPPER.match(function)
    if inner:
        function = "Copper,L{inner},Inr"
    for pattern, ending in _endings(layout.spec.fpc.rules.file_naming):
        if ending and function.startswith(pattern.replace("{last}", str(layout.copper_layers))):
            stem = f"{layout.spec.name}-panel" if "/panel/" in path else layout.spec.name
            return stem + ending.replace("{below}", str(int(inner[1]) - 1) if inner else "")
    return own


@cache
def _endings(naming: str) -> tuple[tuple[str, str], ...]:
    """X2 file functions (their beginnings) and endings of one way to call files."""
    with (DATA / "archive_names.csv").open(encoding="utf-8", newline="") as stream:
        return tuple((row["function"], row["ending"]) for row in csv.DictReader(stream) if row["naming"] == naming)


def _is_sent(path: str, in_panel: bool) -> bool:
    """Whether a file goes to the fabricator: no pictures, no lists for programs, and one set of images only."""
    name = path.removeprefix(f"{FOLDER}/")
    if name.endswith((".svg", ".json")):
        return False
    if name.startswith("panel/"):
        return in_panel
    return not (in_panel and name.endswith((".gbr", ".drl", ".gbrjob")))


def _renamed(path: str, content: bytes, names: Mapping[str, str]) -> bytes:
    """What names other files (the readmes, the job file) names them as in the archive."""
    if not path.endswith((".txt", ".gbrjob")):
        return content
    for old, new in sorted(names.items(), key=lambda pair: -len(pair[0])):
        content = _called(content, old.rpartition("/")[2].encode("ascii"), new.encode("ascii"))
    return content


def _called(content: bytes, old: bytes, new: bytes) -> bytes:
    """One file's name replaced by another; where a column follows it, that stays where it was."""
    return re.sub(
        re.escape(old) + rb"(?P<gap>  +)?",
        lambda found: new + (b" " * max(2, len(found[0]) - len(new)) if found["gap"] else b""),
        content,
    )


def _zipped(contents: Mapping[str, bytes]) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_STORED) as archive:
        for entry, content in _entries(contents):
            archive.writestr(entry, content)
    return made.getvalue()


def _entries(contents: Mapping[str, bytes]) -> Iterator[tuple[zipfile.ZipInfo, bytes]]:
    for name in sorted(contents):
        entry = zipfile.ZipInfo(name, _EPOCH)
        entry.create_system, entry.external_attr = 3, 0o644 << 16
        yield entry, contents[name]
