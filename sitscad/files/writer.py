"""One row of the tables of formats and of papers: what renders files, at which stage of `build`, out of what."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from importlib import import_module

from sitscad.basics.record import record
from sitscad.spec.sensor import SensorSpec

STAGES = ("gerber", "kicad", "laser", "mount", "mesh", "assembly", "firmware", "datasheet", "calibration", "report")
"""What `--only` takes, in the order of making; the report comes last, because it lists the other files."""

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
"""What a writer may ask for."""

NUMBERS = frozenset({"estimates", "coupon_estimates", "bench_estimates", "response", "performance"})
"""What of that is estimated."""


@record
class Writer:
    """One format or paper: its name for people, the module that renders it, the stage of `build` it belongs to.

    ``module`` counts from ``sitscad``, with its function after a colon where that is not ``render``; it is imported
    when it renders, not before; a plugin's writer has a ``function`` instead, that gives files by their paths inside
    the package, and in force its plugin's name there.
    ``takes`` names the arguments of its ``render`` in their order, out of ``layout``, ``solids``,
    ``whole`` (the assembly film by film), ``aids`` (jig and mould), ``spec``, ``estimates``, ``panel`` (None where none
    is wanted), ``coupon_estimates``, ``bench_estimates`` (the estimates at 20 degrees Celsius, at which boards are
    tested), ``response`` (the model that is asked), ``performance`` (what the sensor feels; empty where nothing),
    ``forced`` (why the package ought not to be ordered from, mostly empty), ``files`` (those that the same stage made
    before) and, of the assembly notes alone, ``package`` (`Package`); ``applies`` says whether a spec has anything to
    write.
    """

    name: str
    module: str
    stage: str
    takes: tuple[str, ...] = ("layout",)
    applies: Callable[[SensorSpec], bool] = lambda spec: True
    function: Callable[..., dict[str, bytes]] | None = None

    @property
    def maker(self) -> str:
        """What messages call it: a plugin's with the plugin."""
        return self.name if self.function is None else f"{self.module}: writer {self.name}"

    @property
    def reads_numbers(self) -> bool:
        """Whether it takes what is estimated: the others' files stay as they are when the readout changes."""
        return not NUMBERS.isdisjoint(self.takes)

    def render(self, *values: object) -> dict[str, bytes]:
        """The finished files by their paths inside the package."""
        if self.function is not None:
            return self.function(*values)
        module, _, name = self.module.partition(":")
        made: dict[str, bytes] = getattr(import_module(f"sitscad.{module}"), name or "render")(*values)
        return made


@record
class Package:
    """The files of a package that are there already, and the stages that it has or is to have."""

    files: Mapping[str, bytes]
    stages: frozenset[str]


def stored_zip(members: Mapping[str, bytes]) -> bytes:
    """A ZIP archive, equal bytes on every machine, of some files, in their order: nothing is compressed, because
    what deflate makes differs between versions of zlib, and the date is the earliest that a ZIP can hold.
    """
    import zipfile  # a check writes none

    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            archive.writestr(entry, content)
    return made.getvalue()


def json_bytes(document: object) -> bytes:
    """A document as a file of JSON: pure ASCII, a line a value, moved in by one for each level."""
    import json  # a check writes none

    return (json.dumps(document, indent=1) + "\n").encode("ascii")


def comment_text(text: str) -> str:
    """A text on one line that neither ends a comment of C nor begins one in it."""
    return text.replace("*/", "* /").replace("/*", "/ *").replace("\n", " ").replace("\\", "/")


def is_cut(spec: SensorSpec) -> bool:
    """Whether a sheet of elastomer, metal or ferrite is cut for the sensor."""
    return any(part is not None for part in (spec.elastomer, spec.target, spec.shield))


def is_mounted(spec: SensorSpec) -> bool:
    """Whether the sensor has a mount."""
    return spec.mount is not None


def is_felt(spec: SensorSpec) -> bool:
    """Whether forces move something that the coils see."""
    return spec.target is not None and spec.elastomer is not None


_added: tuple[Writer, ...] = ()
_marks: tuple[tuple[str, str], ...] = ()


def add_writers(writers: tuple[Writer, ...], mark: tuple[str, str]) -> None:
    """Put a plugin's writers in force for this process; `mark` is its name and what changes when it does."""
    global _added, _marks
    _added, _marks = (*_added, *writers), (*_marks, mark)


def added_writers() -> tuple[Writer, ...]:
    """The writers of plugins, in the order in which they were added."""
    return _added


def marks() -> tuple[tuple[str, str], ...]:
    """The plugins in force, by name and hash: what is made with them depends on them."""
    return _marks
