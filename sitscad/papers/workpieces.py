"""Workpieces that are made before a sensor is put together, and files that the steps name and a package lacks."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

from sitscad.fabrication.notes import hanging
from sitscad.spec.sensor import SensorSpec
from sitscad.writer import Package

MADE = {
    "resin": "printed in resin", "powder": "printed in powder", "filament": "printed in filament",
    "machined": "milled in plastic",
}
"""How a piece is made, by `mount.process`."""

USES = (
    ("mount-adapter", "stays: between the mount and the part below"),
    ("mount-spacer", "stays: between shield and board"),
    ("mount", "stays: carries the board"),
    ("jig-base", "holds the board while pieces are glued on it"),
    ("jig-.*-press", "presses the {0} while its glue sets"),
    ("jig-.*", "guides the {0} and its press"),
    ("mould-skin", "casts the skin"),
    ("mould-.*", "casts the elastomer; not needed for a cut one"),
)
"""Purpose of each piece, by its name's beginning; the first that fits."""

STAGE_OF = {"fpc/": "gerber", "laser/": "laser", "firmware/": "firmware", "bom.csv": "report"}
"""Part of a build (`--only`) that writes the files which the steps name."""

SAID = {"gerber": "fpc/", "laser": "laser/", "firmware": "firmware/", "report": "bom.csv"}
"""Files of each such part, in words."""


def to_make(spec: SensorSpec, package: Package, width: int) -> Iterator[str]:
    """Yield the lines that list every piece to be printed or milled; none if the package has no ``print.json``."""
    content = package.files.get("mount/print.json")
    if content is None:
        return
    is_own = spec.mount is not None and spec.mount.kind == "custom"
    pieces = [each for each in json.loads(content)["pieces"] if not (is_own and each["piece"] == "mount")]
    if not pieces:
        return
    process = spec.mount.process if spec.mount is not None else ""
    yield from hanging(
        "", f"The board is ordered by fpc/{_cut(spec)}. These pieces are "
        f"{MADE.get(process, process)}, one of each, by yourself or a service, from mount/{spec.name}-PIECE.stl (or "
        ".3mf, .step); mount/print.json has their least walls and holes. Sizes in mm:", width)
    for each in pieces:
        size = " x ".join(f"{1e3 * side:.1f}" for side in each["size_m"])
        yield f"  {each['piece']:<20} {size:<19} {_use(each['piece'])}"
    if is_own:
        part = spec.mount.step.file if spec.mount is not None and spec.mount.step is not None else "your own part"
        yield f"  {'mount':<20} {'':<19} is your own: {part}"
    if f"mount/{spec.name}-jaw.stl" in package.files:
        yield f"  {'jaw':<20} {'':<19} is not made: the instrument's own, as the spec has it"


def _cut(spec: SensorSpec) -> str:
    """The parts that are cut from sheets, in words that follow the board's; empty without any."""
    parts = [part for part in ("elastomer", "target", "shield") if getattr(spec, part) is not None]
    return f", {' and '.join(parts)} cut by laser/" if parts else ""


def _use(name: str) -> str:
    """Purpose of a piece, by its name."""
    words = next((words for pattern, words in USES if re.fullmatch(pattern, name)), "")
    return words.format(name.split("-")[1] if "-" in name else "")


def _lacking(said: str, stages: frozenset[str]) -> list[str]:
    """Stages that would write files which the steps name, and that are not among those of the package."""
    return [stage for name, stage in STAGE_OF.items() if name in said and stage not in stages]


def is_current(said: str, stages: frozenset[str]) -> bool:
    """Whether the steps, as they were written, say of exactly those files that they are lacking which are."""
    steps, _, lacking = said.partition(LACKING)
    return re.findall(r"--only\s+([a-z]+)", lacking) == _lacking(steps, stages)


LACKING = "Named above and not in this package"


def not_here(said: str, package: Package, width: int) -> list[str]:
    """Lines that name the files of which the steps speak and that this package lacks, with the command for each."""
    stages = _lacking(said, package.stages) if package.stages else []  # none if text alone is wanted
    if not stages:
        return []
    words = ", ".join(f"{SAID[stage]} (--only {stage})" for stage in stages)
    return hanging(
        "", f"{LACKING}, which was built in part: {words}. The command for each is sitscad "
        "build SPEC with what is in brackets; SPEC is the file in spec/.", width)
