"""Verification of a finished package.

Files are compared with the manifest, and the connections of the copper with the intended nets. Layers and holes are
compared with job file and netlist, the order archive with the files beside it, and every board of the panel with the
single board.

The package can also be compared with a new build of its spec in memory. For this build, the spec and profiles are taken
from ``spec/``, and only stages, policy, baseline and plugins from the manifest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sitscad.assembly.solids import MissingExtra
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.late import late
from sitscad.basics.record import record
from sitscad.basics.units import count_text, escape_controls
from sitscad.basics.version import __version__
from sitscad.checks.policy import Policy, baseline_from_manifest, policy_from_manifest
from sitscad.files.writer import STAGES, marks
from sitscad.package import stages
from sitscad.package.building import BuildRequest
from sitscad.package.folder import FILE_NAME, PackageError, list_files, raising_package_errors
from sitscad.package.manifest import (
    CHECK_STAGE,
    MANIFEST,
    SPEC_FOLDER,
    UNNAMED,
    Manifest,
    figure_files,
    foreign_files,
    is_left_by_kicad,
    read_intact_files,
    read_manifest,
    sha256,
)
from sitscad.spec.load import load
from sitscad.spec.reading import SpecError, decode_text, read_file
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import TextError, read_yaml

# gerbonara reads the files; a package of an installation without it has none or cannot be verified
archive_differences = late("sitscad.package.production_files", "archive_differences")
layer_differences = late("sitscad.package.production_files", "layer_differences")
net_differences = late("sitscad.package.production_files", "net_differences")
panel_differences = late("sitscad.package.production_files", "panel_differences")

if TYPE_CHECKING:
    from sitscad.package.stages import BuiltFiles


@record
class Verification:
    """Result of verifying a package.

    Attributes
    ----------
    differences : tuple of str
        one sentence for each difference
    files : int
        number of files that the manifest names
    missing, changed, foreign : int
        number of these files that are missing or differ from the build, and number of other files
    nets : tuple of str or None
        nets of the layout; None if the package has no Gerber files
    panel_boards : int or None
        number of boards compared with the single board; None if there is no panel
    wrong_nets, wrong_boards : int
        number of differences in nets and in boards
    forced : bool
        whether the package was built in spite of errors
    rebuilt : int or None
        number of differences from a new build of the spec; None if it was not built again
    by_value : int
        number of files that differ from the new build only in last digits of figures (`sitscad.package.manifest`)
    wrong_layers : int
        number of contradictions between layers and job file
    wrong_archive : int or None
        number of differences between the order archive and the files beside it; None if there is no archive
    by_kicad : tuple of str
        files that KiCad left beside its project; they do not count as differences
    drawn : str
        file in which the user drew the board; empty for a board of sitscad's
    """

    directory: Path
    differences: tuple[str, ...]
    files: int
    nets: tuple[str, ...] | None
    missing: int = 0
    wrong_nets: int = 0
    panel_boards: int | None = None
    wrong_boards: int = 0
    changed: int = 0
    foreign: int = 0
    forced: bool = False
    rebuilt: int | None = None
    by_value: int = 0
    wrong_layers: int = 0
    wrong_archive: int | None = None
    by_kicad: tuple[str, ...] = ()
    drawn: str = ""

    @property
    def ok(self) -> bool:
        """Whether the package has no differences."""
        return not self.differences

    @property
    def looked_at(self) -> tuple[str, ...]:
        """Short texts, each on one comparison and its result."""
        return tuple(map(escape_controls, self._comparison_texts()))

    def _comparison_texts(self) -> Iterator[str]:
        """Yield a short text on each comparison and its result."""
        wrong = ((self.missing, "missing"), (self.changed, "changed"), (self.foreign, "not in the manifest"))
        counts = ", ".join(f"{count} {word}" for count, word in wrong if count)
        yield f"{self.files} files against the manifest{f' ({counts})' if counts else ''}"
        if self.by_kicad:
            yield f"ignored: {count_text(len(self.by_kicad), 'file')} that KiCad left ({', '.join(self.by_kicad)})"
        if self.nets is None:
            yield f"no Gerber files{f': the board is drawn by the user in {self.drawn}' if self.drawn else ''}"
        elif self.wrong_nets:
            yield f"the copper of the Gerber files is not that of nets {', '.join(self.nets)}"
        else:
            yield f"nets {', '.join(self.nets)} read back from the Gerber files"
        if self.wrong_layers:
            yield "the job file does not say what the layers are"
        if self.wrong_archive:
            yield "the order archive is not made of the files beside it"
        elif self.wrong_archive is not None:
            yield "the order archive made of the files beside it"
        if self.wrong_boards:
            yield "the panel is not made of the single board"
        elif self.panel_boards is not None:
            yield f"{self.panel_boards} boards on the panel equal to the single board"
        if self.forced:
            yield "built in spite of errors and not for order"
        if self.rebuilt:
            yield "not what its spec makes"
        elif self.rebuilt is not None:
            but = f", except for last digits of figures in {count_text(self.by_value, 'file')}" if self.by_value else ""
            yield f"byte by byte what its spec makes{but}"


MAX_FILES = 10_000
"""Largest number of files accepted in a package's folder."""

MAX_FILE = 500_000_000
"""Largest accepted size (bytes) of one file in a package. Meshes are the largest files."""


@checked_arguments
def verify(directory: str | Path, rebuild: bool = False) -> Verification:
    """Compare a package with its manifest, and its finished production files with each other.

    Parameters
    ----------
    directory : str or Path
        folder of the package
    rebuild : bool
        whether the package is also built again in memory from its own ``spec/`` and compared

    Returns
    -------
    Verification
        the differences, and a text on each comparison

    Raises
    ------
    PackageError
        if the folder is not a package of sitscad, cannot be read, or cannot be built again
    MissingExtra
        if a package that reads Gerber files is not installed, or a package that `rebuild` needs

    Notes
    -----
    The nets in Gerber and drill files are compared with the intended nets. Layers and holes are compared with job file
    and netlist, the order archive with the files beside it, and every board of the panel with the single board.

    A person who changes a file can also change its hash in the manifest. `rebuild` finds such changes. It compares byte
    by byte, and computed figures by value (`sitscad.package.manifest`). This proves that the files belong to the spec,
    but not that the spec is yours.
    """
    folder = Path(directory)
    with raising_package_errors(f"cannot read {folder}"):
        manifest = read_manifest(folder)
        _require_small(folder)
        missing = [name for name in manifest.files if not (folder / name).exists()]
        there = {name: entry for name, entry in manifest.files.items() if name not in missing}
        changed = [name for name, entry in there.items() if read_intact_files(folder, {name: entry}) is None]
        foreign = [name for name in foreign_files(folder, manifest) if name not in manifest.files]
        files = (
            *(f"{name} is missing" for name in missing),
            *(f"{name} is not the file that was built (its SHA-256 differs)" for name in changed),
            *(f"{name} is not in the manifest" for name in foreign),
            *_spec_differences(folder, manifest),
        )
        counts = {"missing": len(missing), "changed": len(changed), "foreign": len(foreign)}
        built, document = rebuilt(folder, manifest) if rebuild else (None, manifest)
        again = () if built is None else tuple(rebuilt_differences(folder, manifest, built, document))
        by_kicad = tuple(name for name in list_files(folder) if is_left_by_kicad(name, manifest.files))
        read = Verification(
            folder, files, len(manifest.files), None, forced=manifest.forced, by_kicad=by_kicad,
            drawn=manifest.drawn, **counts)
        if any(name.startswith("fpc/") and name.endswith(".gbr") for name in manifest.files):
            try:
                read = _add_board_comparisons(read, folder, manifest)
            except ImportError as error:
                package = (error.name or "a package").partition(".")[0]
                raise MissingExtra(f"reading Gerber files back needs {package}: pip install 'sitscad[all]'") from error
    read = replace(read, differences=tuple(map(escape_controls, (*read.differences, *again))))
    return read if built is None else replace(read, rebuilt=len(again), by_value=len(built.by_value))


def _require_small(folder: Path) -> None:
    """Raise PackageError if the folder has too many files or a too large file for a package.

    File contents are not read.
    """
    names = list_files(folder)
    if len(names) > MAX_FILES:
        raise PackageError(f"{folder} has {len(names)} files, maximum {MAX_FILES} in a package")
    for name in names:
        path = folder / name
        if path.is_file() and (size := path.stat().st_size) > MAX_FILE:
            limit = f"maximum {MAX_FILE // 1_000_000} MB for a file of a package"
            raise PackageError(f"{path} has {size // 1_000_000} MB, {limit}")


def _add_board_comparisons(read: Verification, folder: Path, manifest: Manifest) -> Verification:
    """Return the result with the comparisons of the fabricator's files added.

    `read` is the result so far.
    """
    nets = tuple(dict.fromkeys(net_differences(folder, manifest.nets)))
    layers, sent = tuple(layer_differences(folder, manifest)), archive_differences(folder, manifest)
    boards, panel = panel_differences(folder, manifest)
    return replace(
        read, differences=(*read.differences, *nets, *layers, *(sent or ()), *panel),
        nets=tuple(sorted(manifest.nets)), wrong_nets=len(nets), wrong_layers=len(layers),
        wrong_archive=None if sent is None else len(sent), panel_boards=boards, wrong_boards=len(panel),
    )


def spec_path(folder: Path, manifest: Manifest) -> Path:
    """Return the path of the spec inside a package."""
    file_name = manifest.spec["file"]
    return folder / SPEC_FOLDER / (file_name if FILE_NAME.fullmatch(file_name) else UNNAMED)


def _spec_differences(folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield the differences of the spec in the package from the hash and the name in the manifest."""
    path = spec_path(folder, manifest)
    try:
        text = decode_text(read_file(path))
        if sha256(text.encode("utf-8")) != manifest.spec["sha256"]:
            yield (
                f"{path.relative_to(folder).as_posix()} is not the spec that the manifest names (its SHA-256 differs)"
            )
            return
        data = read_yaml(text).data
    except TextError as error:
        yield f"the package's spec is none: {error}"
        return
    name = data.get("name") if isinstance(data, dict) else None
    if str(name) != manifest.spec["name"]:
        yield f"{MANIFEST} names the sensor {manifest.spec['name']}, but the spec names it {name}"


def rebuilt(folder: Path, manifest: Manifest) -> tuple[BuiltFiles, Manifest]:
    """Build the files of a package again in memory from its spec. Return the files and their manifest.

    A file with computed numbers is taken from the package if its numbers agree with the new numbers.

    Raises
    ------
    PackageError
        if the package cannot be built again: another version, other plugins, or an invalid spec
    MissingExtra
        if a stage needs a package that is not installed
    """
    request = _original_request(folder, manifest)
    contents = stages.package_contents(request.spec, request.policy, request.baseline, request.wanted)
    built = stages.make_stages(contents, folder, Manifest(), request.wanted, lambda *_: None, force=True,
                           figures=figure_files(folder, manifest))
    # The hash includes CAD kernels if the package before had solids, so two hashes are possible
    keys = [replace(request, wanted=chosen).inputs_hash(Manifest()) for chosen in (request.wanted, frozenset(STAGES))]
    key = manifest.built_from if manifest.built_from in keys else keys[0]
    document = stages.new_manifest(built.contents, built, manifest, key, request.wanted)
    return built, replace(document, built_for=manifest.built_for)


def rebuilt_differences(folder: Path, manifest: Manifest, rebuilt: BuiltFiles, document: Manifest) -> Iterator[str]:
    """Yield a text on each difference between a package and a new build of its spec."""
    stale = {entry.stage for name, entry in manifest.files.items() if rebuilt.entries.get(name, entry) != entry}
    recorded = {(entry.stage, entry.made_from) for entry in manifest.files.values()}
    is_so = {(entry.stage, entry.made_from) for entry in rebuilt.entries.values()}
    other = stale & {stage for stage, _ in recorded ^ is_so}
    for name, content in sorted(rebuilt.files.items()):
        path = folder / name
        if path.is_symlink() or not path.is_file():
            yield f"{name} is missing: {SPEC_FOLDER}/ makes it"
        elif path.read_bytes() != content:
            yield f"{name} is not what {SPEC_FOLDER}/ makes"
    there = set(list_files(folder)) & set(manifest.files)
    yield from (f"{name} is not made by {SPEC_FOLDER}/" for name in sorted(there - set(rebuilt.files)))
    if (folder / MANIFEST).read_bytes() != document.as_bytes():
        yield f"{MANIFEST} is not the one of such a build" + (
            f": {', '.join(sorted(other))} of another spec, code, CAD kernel or SOURCE_DATE_EPOCH" if other else ""
        )


def _original_request(folder: Path, manifest: Manifest) -> BuildRequest:
    """Return the build request with which a package was made. Raises PackageError if it cannot be built again."""
    if manifest.version != __version__:
        raise PackageError(
            f"{folder} was built with sitscad {manifest.version}, and this is {__version__}: only that version builds "
            "it again"
        )
    configuration: Mapping[str, Any] = manifest.configuration
    if configuration.get("plugins", {}) != dict(marks()):
        raise PackageError(
            f"{folder} was built with the plugins {configuration.get('plugins') or 'none'}, and those in force are "
            f"{dict(marks()) or 'none'}: name the files that it was built with as --plugin"
        )
    stages = {*manifest.built_for, *(entry.stage for entry in manifest.files.values())}
    if unknown := sorted(stages - {*STAGES, CHECK_STAGE}):
        raise PackageError(f"{folder} was built for {', '.join(unknown)}: no stage of sitscad's")
    spec = _packaged_spec(folder, manifest)
    try:
        policy = policy_from_manifest(configuration) if "select" in configuration else Policy()
        baseline_json = configuration.get("baseline")
        baseline = None if baseline_json is None else baseline_from_manifest(spec.source.path, spec.name, baseline_json)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PackageError(f"{folder / MANIFEST}: its configuration cannot be read ({error})") from error
    return BuildRequest(spec, folder, frozenset(stages), True, policy, baseline)


def _packaged_spec(folder: Path, manifest: Manifest) -> SensorSpec:
    """Return the spec in a package with its original file name, which reports show."""
    path, file_name = spec_path(folder, manifest), manifest.spec["file"]
    try:
        spec = load(path)
    except SpecError as error:
        (first, *_) = error.findings
        raise PackageError(f"{path} builds nothing: {first.rule} {first.message}") from error
    files = {file_name if name == path.name else name: content for name, content in spec.source.files.items()}
    return spec.known(replace(spec.source, path=file_name, files=files, folder=str(path.parent)))
