"""The ZIP archive for the fabricator: the order's files, under the names of the fabricator's convention.

If the boards are ordered in a panel, the archive holds the panel's images instead of the single board's. Files are
stored uncompressed and without dates, so that equal orders give equal bytes on any machine.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Mapping
from functools import cache, partial

from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.files.order_facts.files import FOLDER, fabrication_path
from sitscad.files.writer import stored_zip
from sitscad.layout.board import Layout
from sitscad.layout.panel import Panel
from sitscad.spec.format.kinds import names

_FUNCTION = re.compile(rb"TF\.FileFunction,([^*\r\n]*)")
_COPPER = re.compile(r"Copper,L(\d+),Inr")

NOTE = "FORCED.txt"


def render(layout: Layout, panel: Panel | None, forced: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the archive, built from the package's earlier files, by its path in the package.

    `forced` states why the order should not be placed. If it is not empty, the archive contains this text.
    """
    named = Naming(layout.spec.name, layout.spec.fpc.rules.file_naming, layout.copper_layers)
    contents = _members(files, named, panel is not None, forced)
    return {fabrication_path(layout.spec.name, "order.zip"): stored_zip(contents)}


@record
class Naming:
    """Inputs of the archive's file names: design name, naming convention and number of copper layers.

    `way` is the naming convention: a value of the column ``naming`` in the data table ``archive_names``.
    """

    name: str
    way: str
    layers: int


def differences(content: bytes, files: Mapping[str, bytes], name: str, forced: str, every: bool) -> Iterator[str]:
    """Yield the differences between an archive and the package's files as texts.

    The archive may use the file names of any known naming convention.

    Parameters
    ----------
    content : bytes
        The archive.
    files : mapping
        Files of the package by path.
    name : str
        Name of the design.
    forced : str
        The note that the archive must contain; empty if none.
    every : bool
        Whether the archive must hold all files that are sent. False if plugins added files to the package. Then only
        layers, drills, netlist, job file and readme are required.
    """
    functions = [_FUNCTION.search(files[path]) for path in files if path.endswith(".gbr") and "/panel/" not in path]
    layers = sum(match is not None and match[1].startswith(b"Copper,") for match in functions)
    in_panel = any(path.startswith(f"{FOLDER}/panel/") for path in files)
    namings = [Naming(name, way, layers) for way in names("file naming")]
    if any(stored_zip(_members(files, naming, in_panel, forced)) == content for naming in namings):
        return
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
                raise ValueError("a file in it is compressed")
            if sum(entry.file_size for entry in entries) > len(content):
                raise ValueError("the stated sizes of its files exceed the size of the archive")
            contents = {entry.filename: archive.read(entry) for entry in entries}
        if len(contents) != len(entries):
            raise ValueError("two files in it have one name")
    except (ValueError, RuntimeError, EOFError, OSError, zipfile.BadZipFile) as error:
        yield f"cannot be read as it is written here: {error}"
        return
    naming = max(namings,
                 key=lambda convention: len(_members(files, convention, in_panel, forced).keys() & contents.keys()))
    expected = _members(files, naming, in_panel, forced)
    unequal = [each for each in sorted(contents) if contents[each] != expected.get(each)]
    wrong = [f"{each} is not as the file beside it" for each in unequal]
    needed = expected if every else _members(_required_files(files), naming, in_panel, forced)
    missing = [f"{each} is missing" for each in sorted(needed.keys() - contents.keys())]
    yield from wrong + missing or (["is packed otherwise than it is written here"] if every else [])


def _required_files(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files that every order contains: job files, files named in job files, netlists and readmes."""
    jobs = b"".join(content for path, content in files.items() if path.endswith(".gbrjob"))
    return {
        path: content for path, content in files.items()
        if f'"{path.rpartition("/")[2]}"'.encode() in jobs or path.endswith((".gbrjob", ".d356", "readme.txt"))
    }


def _members(files: Mapping[str, bytes], named: Naming, in_panel: bool, forced: str) -> dict[str, bytes]:
    """Return the archive's contents by file name, sorted by name.

    `in_panel` is True if the boards are ordered in a panel. `forced` is the note on errors; empty if there are none.
    """
    chosen = [path for path in sorted(files) if _is_sent(path, in_panel)]
    called = {path: archive_name(named, path, files[path]) for path in chosen}
    contents = {called[path]: _with_archive_names(path, files[path], called) for path in chosen}
    return dict(sorted((contents | ({NOTE: forced.encode("utf-8")} if forced else {})).items()))


def archive_name(named: Naming, path: str, content: bytes) -> str:
    """Return a file's name in the archive.

    The X2 file function of a Gerber or drill file selects the name. Other names are unchanged.
    """
    file_name = path.rpartition("/")[2]
    match = _FUNCTION.search(content)
    if match is None or not path.endswith((".gbr", ".drl")):
        return file_name
    function = match[1].decode("ascii", errors="replace")
    inner = _COPPER.match(function)
    if inner:
        function = "Copper,L{inner},Inr"
    for pattern, ending in _naming_rows(named.way):
        if ending and function.startswith(pattern.replace("{last}", str(named.layers))):
            stem = f"{named.name}-panel" if "/panel/" in path else named.name
            return stem + ending.replace("{below}", str(int(inner[1]) - 1) if inner else "")
    return file_name


@cache
def _naming_rows(naming: str) -> tuple[tuple[str, str], ...]:
    """Return (beginning of an X2 file function, file ending) for each row of a naming convention."""
    return tuple((row["function"], row["ending"]) for row in rows("archive_names") if row["naming"] == naming)


def _is_sent(path: str, in_panel: bool) -> bool:
    """Whether a file goes to the fabricator.

    SVG and JSON files do not. If `in_panel`, the panel's images go, otherwise the images of the single board.
    """
    name = path.removeprefix(f"{FOLDER}/")
    if name.endswith((".svg", ".json")):
        return False
    if name.startswith("panel/"):
        return in_panel
    return not (in_panel and name.endswith((".gbr", ".drl", ".gbrjob")))


def _with_archive_names(path: str, content: bytes, called: Mapping[str, str]) -> bytes:
    """Return a file whose text names other files by their names in the archive.

    Only the texts of readmes and job files change. `called` maps paths in the package to names in the archive.
    """
    if not path.endswith((".txt", ".gbrjob")):
        return content
    for old, new in sorted(called.items(), key=lambda pair: -len(pair[0])):
        name = re.escape(old.rpartition("/")[2].encode("ascii")) + rb"(?P<gap>  +)?"
        content = re.sub(name, partial(_padded_name, new.encode("ascii")), content)
    return content


def _padded_name(new: bytes, match: re.Match[bytes]) -> bytes:
    """Return the name `new`, which replaces the matched name in a text.

    If two or more spaces follow the matched name, a column of a table follows. The spaces are then adjusted so that
    this column keeps its place.
    """
    return new + (b" " * max(2, len(match[0]) - len(new)) if match["gap"] else b"")
