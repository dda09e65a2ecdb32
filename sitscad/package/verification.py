"""Reading a finished package back: every file against the manifest, and the copper's nets against the intended ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from sitscad.package.folder import explained
from sitscad.package.manifest import Manifest, foreign_files, intact, read_manifest
from sitscad.record import record


@record
class Verification:
    """What reading a package back found: every difference in one sentence, and what was looked at."""

    directory: Path
    differences: tuple[str, ...]
    files: int
    nets: tuple[str, ...] | None

    @property
    def ok(self) -> bool:
        """Whether the package is what it says it is."""
        return not self.differences


def verify(directory: str | Path) -> Verification:
    """Compare a package with its manifest, and the nets in its finished Gerber and drill files with the intended ones.

    ``nets`` of the result is None where the package has no Gerber files.

    Raises
    ------
    PackageError
        when the folder is not a package of sitscad, or cannot be read.
    MissingExtra
        when a package that reads Gerber files is not installed.
    """
    folder = Path(directory)
    with explained(f"cannot read {folder}"):
        manifest = read_manifest(folder)
        differences = list(_file_differences(folder, manifest))
        has_gerbers = any(name.startswith("fpc/") and name.endswith(".gbr") for name in manifest.files)
        if not has_gerbers:
            return Verification(folder, tuple(differences), len(manifest.files), None)
        differences += _net_differences(folder, manifest.nets)
        return Verification(folder, tuple(differences), len(manifest.files), tuple(sorted(manifest.nets)))


def _file_differences(folder: Path, manifest: Manifest) -> Iterator[str]:
    for name, entry in manifest.files.items():
        if not (folder / name).exists():
            yield f"{name} is missing"
        elif intact(folder, {name: entry}) is None:
            yield f"{name} is not the file that was built (its SHA-256 differs)"
    for name in foreign_files(folder, manifest):
        if name not in manifest.files:
            yield f"{name} is not in the manifest"


def _net_differences(folder: Path, intended: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    """Differences of the copper from the files' own net names, and of these from the nets that the layout had."""
    from sitscad.parts import MissingExtra

    try:
        import sitscad.extraction as extraction

        board = extraction.extract(folder)
    except ImportError as error:
        missing = (error.name or "a package").partition(".")[0]
        raise MissingExtra(f"reading Gerber files back needs {missing}: pip install 'sitscad[all]'") from error
    except extraction.ExtractionError as error:
        yield f"the Gerber files do not make up a board: {error}"
        return
    yield from (f"{difference.kind.value}: {difference.message}" for difference in extraction.compare(board))
    found: dict[str, set[str]] = {}
    for net in board.nets:
        for contact in net.contacts:
            found.setdefault(contact.net, set()).add(contact.function or contact.pin)
    for name in sorted({*intended, *found}):
        wanted, there = set(intended.get(name, ())), found.get(name, set())
        if len(wanted) < 2:
            yield f"coil {name} does not lead from one contact to another: the layout found no way out for it"
        if wanted != there:
            yield f"net {name} joins {_names(there)} where the layout joins {_names(wanted)}"


def _names(pins: set[str]) -> str:
    return ", ".join(sorted(pins)) or "nothing"
