"""The manifest of a package: each file with its hash, its stage and the hash of its inputs. Results of build stages.

Files with computed numbers are compared by value, because the last digits depend on the processor. The text between the
numbers must be equal, and the numbers must agree within tolerances (`has_equal_numbers`). All other files are compared
byte by byte.
"""

from __future__ import annotations

import dataclasses
import enum
import errno
import hashlib
import json
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import field
from fnmatch import fnmatchcase
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from sitscad.basics.record import record
from sitscad.basics.version import __version__
from sitscad.checks.findings import CheckedSpec
from sitscad.data import PACKAGE
from sitscad.files.writer import is_felt, json_bytes
from sitscad.package.folder import PackageError, list_files, require_inside
from sitscad.spec.sensor import SensorSpec

MANIFEST = "manifest.json"

Part = TypeVar("Part")


@record
class Entry:
    """Manifest entry of one file: `sha256` is the file's SHA-256, and `stage` the name of its stage.

    `made_from` is the hash of all inputs from which the file was made.
    """

    sha256: str
    stage: str
    made_from: str


@record
class Manifest:
    """The contents of ``manifest.json``.

    ``version`` is sitscad's version. ``spec`` holds name, file name and SHA-256 of the spec. ``drawn`` is the file in
    which the user drew the board; empty if sitscad laid it out. ``forced`` is True if the package was built in spite of
    errors. ``nets`` maps each net of the layout to its pins. ``configuration`` holds the project's policy, the baseline
    and the plugins, if there are any. ``built_from`` is the hash of all inputs of the package, and ``built_for`` lists
    the requested stages.
    """

    version: str = __version__
    spec: Mapping[str, str] = field(default_factory=dict)
    forced: bool = False
    nets: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    files: Mapping[str, Entry] = field(default_factory=dict)
    configuration: Mapping[str, object] = field(default_factory=dict)
    built_from: str = ""
    built_for: tuple[str, ...] = ()
    drawn: str = ""

    def as_bytes(self) -> bytes:
        """Return the text of ``manifest.json``, with files in order of their names."""
        files = {name: dataclasses.asdict(self.files[name]) for name in sorted(self.files)}
        nets = {net: list(self.nets[net]) for net in sorted(self.nets)}
        document = {
            "sitscad": self.version,
            "spec": dict(self.spec),
            "forced": self.forced,
            **({"board_drawn_by_user": self.drawn} if self.drawn else {}),
            "nets": nets,
            **({"configuration": dict(self.configuration)} if self.configuration else {}),
            "built": {"from": self.built_from, "for": list(self.built_for)},
            "files": files,
        }
        return json_bytes(document)

    def stage_entries(self, stage: str) -> dict[str, Entry]:
        """Return the files of one stage."""
        return {name: entry for name, entry in self.files.items() if entry.stage == stage}


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a package.

    Raises
    ------
    PackageError
        if there is no manifest, it is not one of sitscad's, or it names a file outside the package
    """
    try:
        return _read(json.loads(_manifest_bytes(folder / MANIFEST), object_pairs_hook=_mapping))
    except OSError as error:
        inside = ", ".join(str(path.parent) for path in sorted(folder.glob(f"*/{MANIFEST}"))[:8])
        hint = f"; it holds {inside}: name one of these" if inside else ""
        raise PackageError(
            f"{folder} is not a package of sitscad: {MANIFEST}: {error.strerror or error}{hint}"
        ) from error
    except RecursionError as error:
        raise PackageError(f"{folder / MANIFEST} is not a manifest of sitscad: it is nested too deeply") from error
    except ValueError as error:
        raise PackageError(f"{folder / MANIFEST} is not a manifest of sitscad: {error}") from error


MAX_MANIFEST = 16_000_000
"""Largest size (bytes) of a manifest."""


def _manifest_bytes(path: Path) -> bytes:
    """Return the bytes of a manifest file.

    Raises OSError if it is not a regular file (reading a pipe would block), and ValueError if it is too large.
    """
    if not path.is_file():
        raise OSError(errno.ENOENT, os.strerror(errno.ENOENT) if not os.path.lexists(path) else "it is no file")
    if path.stat().st_size > MAX_MANIFEST:
        raise ValueError(f"it has more than {MAX_MANIFEST // 1_000_000} MB")
    return path.read_bytes()


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON mapping from (key, value) pairs. Raises ValueError if a key occurs twice.

    Programs differ in the value that they use for a repeated key.
    """
    document = dict(pairs)
    if len(document) != len(pairs):
        raise ValueError("a key occurs twice")
    return document


def _read(document: Any) -> Manifest:
    """Return the manifest from a JSON document. Raises ValueError with the reason if the document is not a manifest."""
    if not isinstance(document, dict):
        raise ValueError("it is no mapping")
    built = _typed_value(document, "built", dict, {})
    files = _typed_value(document, "files", dict)
    if len({name.lower() for name in files}) != len(files):
        raise ValueError("two file names differ only in upper and lower case")
    return Manifest(
        _typed_value(document, "sitscad", str),
        _texts("spec", _typed_value(document, "spec", dict), {"name", "file", "sha256"}),
        _typed_value(document, "forced", bool, False),
        {net: _names(f"nets of {net}", pins) for net, pins in _typed_value(document, "nets", dict, {}).items()},
        {
            require_inside(name): Entry(**_texts(name, entry, {"sha256", "stage", "made_from"}))
            for name, entry in files.items()
        },
        _typed_value(document, "configuration", dict, {}),
        _typed_value(built, "from", str, ""),
        _names("for", built.get("for", [])),
        _typed_value(document, "board_drawn_by_user", str, ""),
    )


def _typed_value(document: dict[str, Any], key: str, kind: type[Part], default: Part | None = None) -> Part:
    """Return the value of a key. Raises ValueError if the key is missing or the value has another type than `kind`."""
    value = document.get(key, default)
    if not isinstance(value, kind):
        raise ValueError(f"{key!r} is {'of another kind' if key in document else 'missing'}")
    return value


def _names(key: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise ValueError(f"{key!r} is no list of names")
    return tuple(value)


def _texts(key: str, value: Any, within: set[str]) -> dict[str, str]:
    """Return a mapping of texts with exactly the keys `within`. Raises ValueError for other values."""
    if not isinstance(value, dict) or set(value) != within or not all(isinstance(text, str) for text in value.values()):
        raise ValueError(f"{key!r} has not just the texts {', '.join(sorted(within))}")
    return value


def sha256(content: bytes) -> str:
    """Return the SHA-256 of a file's content as hexadecimal text."""
    return hashlib.sha256(content).hexdigest()


def read_intact_files(folder: Path, entries: Mapping[str, Entry]) -> dict[str, bytes] | None:
    """Return the bytes of the files `entries`.

    None if a file is missing, a link, unreadable, or differs from its hash.
    """
    contents = {}
    for name, entry in entries.items():
        path = folder / name
        try:
            if path.is_symlink() or not path.is_file():
                return None
            contents[name] = path.read_bytes()
        except OSError:
            return None
        if sha256(contents[name]) != entry.sha256:
            return None
    return contents


def foreign_files(folder: Path, manifest: Manifest) -> list[str]:
    """Return the names of files that sitscad did not write, or that were changed after the build.

    Files that KiCad writes beside a project of the package are left out.
    """
    names = []
    for name in list_files(folder):
        entry = manifest.files.get(name)
        if name == MANIFEST or is_left_by_kicad(name, manifest.files):
            continue
        if entry is None or read_intact_files(folder, {name: entry}) is None:
            names.append(name)
    return names


def is_left_by_kicad(name: str, files: Collection[str]) -> bool:
    """Whether KiCad writes a file with this name beside one of the package's projects.

    Such files are window settings, locks, a footprint cache and backups.
    """
    if name in files:
        return False
    projects = (file.removesuffix(".kicad_pro") for file in files if file.endswith(".kicad_pro"))
    for folder, _, project in (path.rpartition("/") for path in projects):
        stem = re.escape(project)
        lock, backup = rf"~{stem}\.kicad_(pro|pcb|sch)\.lck", rf"{stem}-backups/{stem}-[0-9_-]+\.zip"
        pattern = re.compile(rf"{re.escape(folder)}/({stem}\.kicad_prl|fp-info-cache|{lock}|{backup})")
        if pattern.fullmatch(name):
            return True
    return False


def hash_inputs(*ingredients: object) -> str:
    """Return the hash of the inputs of a stage: values, sitscad's code, and the variable SOURCE_DATE_EPOCH."""
    setting = (__version__, code_hash(), os.environ.get("SOURCE_DATE_EPOCH", ""))
    text = json.dumps([_plain(value) for value in (*setting, *ingredients)], separators=(",", ":"))
    return sha256(text.encode("ascii"))


def _plain(value: object) -> object:
    """Return a value as nested lists with a unique JSON text.

    Floats are exact, and mappings are in the order of their keys.
    """
    if dataclasses.is_dataclass(value):
        fields = [_plain(getattr(value, f.name)) for f in dataclasses.fields(value)]
        return [type(value).__name__, *fields]
    if isinstance(value, Mapping):
        named = {repr(key): _plain(entry) for key, entry in value.items()}
        return [[name, named[name]] for name in sorted(named)]
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, bytes):  # A file that the spec names, like a STEP file. A list differs from every text
        return [sha256(value)]
    if value is None or isinstance(value, (str, int, float)):
        return value
    raise TypeError(f"a {type(value).__name__} has no place in a hash")


@cache
def code_hash() -> str:
    """Return the hash of sitscad's own modules and data files.

    Files made by another version of sitscad are therefore never reused.
    """
    root = PACKAGE
    digest = hashlib.sha256()
    for path in sorted(p for p in root.rglob("*") if p.suffix in {".py", ".csv", ".yaml", ".json"} and p.is_file()):
        name = path.relative_to(root).as_posix()
        if not name.startswith("templates/"):
            digest.update(name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


SPEC_FOLDER, UNNAMED = "spec", "spec.yaml"
"""Folder of a package's input files, and name of the spec if its own name is not allowed in a package."""

CHECK_STAGE = "check"
"""Stage of the files that every build writes: findings, estimates and spec. Its checks always run."""

SOLID_STAGES = ("mount", "mesh", "assembly")
"""Stages that need CAD packages. These are optional dependencies of sitscad."""

EXTRA_STAGES = (*SOLID_STAGES, "datasheet")
"""Stages that need optional dependencies: CAD packages, or matplotlib."""

NOTHING_FOR = {
    "laser": "the spec has neither an elastomer nor a target to cut",
    "mount": "the spec has no mount",
    "mesh": "the spec has no elastomer",
    "assembly": "the spec has no mount",
    "datasheet": "it takes a target that conducts, a pad for it to rest on, and a tank that oscillates",
}
"""Reasons why a stage makes no files for a spec, by the stage's name."""

KERNELS = ("build123d", "cadquery", "cadquery-ocp", "gmsh", "manifold3d", "trimesh")
"""Installed packages whose version can change the bytes of solids and meshes. Versions are inputs of these stages."""

FORCED_NOTE = "FORCED.txt"
"""Name of the warning file in a package that was built in spite of errors.

The fabricator's files contain a copy.
"""

NOT_WRITTEN = "\nLeft out, because it cannot be written:"
"""Line in `FORCED_NOTE` before the list of files that could not be written."""

Progress = Callable[[str, str, float], None]
"""Function that is called with a stage, an event, and the time (s) that the stage took so far.

The first event of a stage is ``start``, if the stage must be made. The second event is its outcome: ``made``, ``kept``
(files of the old package are unchanged), ``dropped``, ``none``, or ``stopped`` (by errors).
"""


@record
class StageResult:
    """Outcome of the stage `name` of a build.

    `outcome` is ``made``, ``kept`` (files of the old package), ``dropped``, or ``none`` (the spec needs no files).
    `files` is the number of the stage's files, and `seconds` the time that it took.
    """

    name: str
    outcome: str
    files: int
    seconds: float


@record
class BuildResult:
    """The outcome of a build. If ``written`` is False, the errors in ``checked`` stopped it and nothing was changed.

    ``left_out`` gives the reason for each missing stage that was not requested by name, such as a package that is not
    installed. ``is_unchanged`` is True if there was nothing to do. ``kept_aside`` is the folder with the user's own
    files from the old package. ``stale`` is the result of a comparison: a text on each file that a build would change.
    """

    directory: Path
    checked: CheckedSpec
    written: bool
    stages: tuple[StageResult, ...] = ()
    kept_aside: Path | None = None
    is_unchanged: bool = False
    stale: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return a line with the folder, and whether it was written."""
        return f"<BuildResult {'written' if self.written else 'not written'}: {self.directory}>"

    @property
    def forced(self) -> bool:
        """Whether the package was written in spite of errors."""
        return self.written and not self.checked.is_orderable

    def missing(self, only: Collection[str] = ()) -> dict[str, str]:
        """Return the stages that the package does not have, each with the reason.

        They are the stages that were left out, and stages in `only` for which the spec has nothing.
        """
        none = (stage.name for stage in self.stages if stage.outcome == "none" and stage.name in only)
        return {name: NOTHING_FOR.get(name, "the spec has nothing for it") for name in none} | dict(self.left_out)


def skipped_data_sheet(spec: SensorSpec) -> dict[str, str]:
    """Return the data sheet's stage with the reason, if it is left out because matplotlib is not installed.

    Empty otherwise. The data sheet is the only document that needs an optional package. Stages of solids are different:
    a build stops if their packages are missing.
    """
    if not is_felt(spec) or find_spec("matplotlib") is not None:
        return {}
    return {"datasheet": "it needs matplotlib, which is not installed: pip install 'sitscad[all]'"}


def version_of(package: str) -> str:
    """Return the version of an installed package. Empty if it is not installed."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import, and needed for solids only

    try:
        return version(package)
    except PackageNotFoundError:
        return ""


FIGURES = (
    "estimate.json", "findings.json", "FORCED.txt", "fpc/FORCED.txt", "report.html", "live.html", "datasheet.*",
    "calibration/*", "firmware/*", "mount/*.json", "mount/assembly.txt", "mesh/*.json",
)
"""Patterns of names of files with computed numbers. They are compared by value instead of byte by byte."""

EXACT = ("firmware/wiring/*",)
"""Patterns of files that match `FIGURES` but have no computed numbers. They are compared byte by byte."""

TOLERANCE = 1e-4
"""Largest difference of two numbers that count as equal, divided by the larger number.

It is far below the stated errors, and far above rounding differences of sums.
"""

LIST_TOLERANCE = 1e-5
"""Largest difference of two numbers in a list that count as equal, divided by the largest number of the list."""

WHOLE_TOLERANCE = 1e-6
"""Largest difference of two whole numbers that count as equal, divided by the larger number.

Register values, codes and counts below a million must therefore be exactly equal.
"""

LAST_DIGIT = 0.01
"""Upper limit of the tolerance of one unit in the last digit, divided by the number."""

_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d++(?:\.\d++)?+(?:[eE][-+]?\d++)?+(?!\.\d)")
_BETWEEN = re.compile(rb"f?[\s,\[\]{}]*")  # Text between the numbers of a list
_PLACES = re.compile(rb"/Length \d+|\nxref\n.*", re.DOTALL)  # Lengths and offsets of a PDF's parts


def has_figures(name: str) -> bool:
    """Whether a file of a package contains computed numbers and is therefore compared by value."""
    return any(fnmatchcase(name, each) for each in FIGURES) and not any(fnmatchcase(name, each) for each in EXACT)


def figure_files(folder: Path, manifest: Manifest) -> dict[str, bytes]:
    """Return the content of each file with computed numbers, by its name.

    Files that were changed by hand are left out.
    """
    named = {name: entry for name, entry in manifest.files.items() if has_figures(name)}
    contents = ((name, read_intact_files(folder, {name: entry})) for name, entry in named.items())
    return {name: files[name] for name, files in contents if files is not None}


def with_equal_figures(files: Mapping[str, bytes], old: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the new files by name. A file is replaced by its old version if all numbers agree within tolerance."""
    return {name: old[name] if name in old and has_equal_numbers(old[name], content) else content
            for name, content in files.items()}


def has_equal_numbers(first: bytes, second: bytes) -> bool:
    """Whether two files have equal text, and numbers that are equal within tolerances.

    Whole numbers may differ by `WHOLE_TOLERANCE` times the number. Other numbers may differ by the largest of three
    amounts. These are `TOLERANCE` times the number, `LIST_TOLERANCE` times the largest number of its list, and a unit
    in the last digit. The unit counts as at most `LAST_DIGIT` times the number.
    """
    if first == second:
        return True
    if first.startswith(b"%PDF"):
        first, second = (_PLACES.sub(b"", content) for content in (first, second))
    texts, other_texts = (_NUMBER.split(content) for content in (first, second))
    if first == second or texts != other_texts:
        return False
    pairs = list(zip(_NUMBER.findall(first), _NUMBER.findall(second), strict=True))
    return all(_is_near(a, b, scale) for (a, b), scale in zip(pairs, _list_scales(texts, pairs), strict=True) if a != b)


def _is_near(first: bytes, second: bytes, scale: float) -> bool:
    a, b = float(first), float(second)
    size, apart = max(abs(a), abs(b)), abs(a - b)
    if first.lstrip(b"+-").isdigit() and second.lstrip(b"+-").isdigit():
        return apart <= WHOLE_TOLERANCE * size
    unit = 1.001 * min(_last_digit_unit(first), _last_digit_unit(second))  # tolerance for rounding of decimal digits
    return apart <= max(TOLERANCE * size, LIST_TOLERANCE * scale, min(unit, LAST_DIGIT * size))


def _last_digit_unit(number: bytes) -> float:
    """Return the value of one unit in the last digit of a decimal number, for example 0.01 for 2.50."""
    digits, _, power = number.lower().partition(b"e")
    return float(10.0 ** (int(power or 0) - len(digits.partition(b".")[2])))


def _list_scales(texts: list[bytes], pairs: list[tuple[bytes, bytes]]) -> Iterator[float]:
    """Yield, for each number of a file, the largest absolute value in its list.

    `texts` are the texts between the numbers, and `pairs` the (old, new) numbers. Numbers belong to one list if only
    commas, brackets and spaces separate them.
    """
    first = 0
    for k in range(1, len(pairs) + 1):
        if k == len(pairs) or not _BETWEEN.fullmatch(texts[k]):
            yield from [max((abs(float(a)) for a, _ in pairs[first:k]), default=0.0)] * (k - first)
            first = k
