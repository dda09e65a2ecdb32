"""Writers: table rows for formats and documents, with module, build stage and arguments; and common functions."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Mapping
from importlib import import_module

from sitscad.basics.record import record
from sitscad.spec.sensor import SensorSpec

STAGES = ("gerber", "kicad", "laser", "mount", "mesh", "assembly", "firmware", "datasheet", "calibration", "report")
"""Stages of `--only`, in the order of making. The report is last, because it lists the other files."""

BOARD_STAGES = ("gerber", "kicad")
"""Stages whose files describe sitscad's own board."""

TAKES = (
    "layout",
    "solids",
    "whole",
    "aids",
    "spec",
    "estimates",
    "panel",
    "coupon_estimates",
    "bench_estimates",
    "response",
    "performance",
    "forced",
    "files",
)
"""Names of the arguments that a writer may take."""

NUMBERS = frozenset({"estimates", "coupon_estimates", "bench_estimates", "response", "performance"})
"""Arguments that contain estimates."""


@record
class Writer:
    """Format or document of a package.

    Attributes
    ----------
    name
        Name in messages.
    module
        Module below ``sitscad``, imported when it renders. A function other than ``render`` follows after a colon.
        For a plugin's active writer, this is the plugin's name.
    stage
        Stage of `build`.
    takes
        Names of the arguments of its function, in order (see Notes).
    applies
        Function that returns whether a spec has anything to write.
    function
        Function of a plugin's writer. It returns files by their paths inside the package. None for sitscad's writers.

    Notes
    -----
    The arguments are ``layout``, ``solids``, ``whole`` (the assembly film by film), ``aids`` (jig and mould), ``spec``,
    ``estimates``, ``panel`` (None if no panel is wanted), ``coupon_estimates``, ``bench_estimates`` (the estimates at
    20 degrees Celsius, at which boards are tested), ``response`` (the response model), ``performance`` (sensing
    performance; empty if there is none), ``forced`` (reasons not to order from the package, usually empty) and
    ``files`` (earlier files of this stage). The assembly notes alone also take ``package`` (`Package`).
    """

    name: str
    module: str
    stage: str
    takes: tuple[str, ...] = ("layout",)
    applies: Callable[[SensorSpec], bool] = lambda spec: True
    function: Callable[..., dict[str, bytes]] | None = None

    @property
    def is_of_board(self) -> bool:
        """Whether it describes sitscad's own board. A board that the user drew has no such files."""
        return self.stage in BOARD_STAGES and self.function is None

    @property
    def maker(self) -> str:
        """Name in messages. For a plugin's writer, the plugin is named, too."""
        return self.name if self.function is None else f"{self.module}: writer {self.name}"

    @property
    def reads_numbers(self) -> bool:
        """Whether it takes estimates. The files of other writers do not change with the readout."""
        return not NUMBERS.isdisjoint(self.takes)

    def render(self, *values: object) -> dict[str, bytes]:
        """Return the finished files by their paths inside the package."""
        if self.function is not None:
            return self.function(*values)
        module, _, name = self.module.partition(":")
        files: dict[str, bytes] = getattr(import_module(f"sitscad.{module}"), name or "render")(*values)
        return files


@record
class Package:
    """Existing files of a package, and the stages that it has or will have."""

    files: Mapping[str, bytes]
    stages: frozenset[str]


def stored_zip(members: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive of files in their order, with equal bytes on every machine.

    Files are stored without compression, because the output of deflate differs between versions of zlib. Dates are the
    earliest that a ZIP archive can store.
    """
    archive_file = io.BytesIO()
    with zipfile.ZipFile(archive_file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            archive.writestr(entry, content)
    return archive_file.getvalue()


def json_bytes(document: object) -> bytes:
    """Return a document as a JSON file: pure ASCII, one value per line, indented by one space per level."""
    return (json.dumps(document, indent=1) + "\n").encode("ascii")


def comment_text(text: str) -> str:
    """Return a text on one line that neither ends nor begins a comment of C."""
    return text.replace("*/", "* /").replace("/*", "/ *").replace("\n", " ").replace("\\", "/")


def is_cut(spec: SensorSpec) -> bool:
    """Return whether a sheet of elastomer, metal or ferrite is cut for the sensor."""
    return any(part is not None for part in (spec.elastomer, spec.target, spec.shield))


def is_mounted(spec: SensorSpec) -> bool:
    """Return whether the sensor has a mount."""
    return spec.mount is not None


def is_felt(spec: SensorSpec) -> bool:
    """Return whether the sensor has a target on an elastomer, so that forces change the coils' readings."""
    return spec.target is not None and spec.elastomer is not None


_added: tuple[Writer, ...] = ()
_marks: tuple[tuple[str, str], ...] = ()


def add_writers(writers: tuple[Writer, ...], mark: tuple[str, str]) -> None:
    """Activate a plugin's writers for this process.

    `mark` is the plugin's name, and a hash that changes with the plugin.
    """
    global _added, _marks
    _added, _marks = (*_added, *writers), (*_marks, mark)


def added_writers() -> tuple[Writer, ...]:
    """Return the writers of plugins, in the order of activation."""
    return _added


def marks() -> tuple[tuple[str, str], ...]:
    """Return names and hashes of the active plugins, on which their files depend."""
    return _marks
