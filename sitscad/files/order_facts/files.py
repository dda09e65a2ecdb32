"""Fabrication set: names and contents of its files, its drill files, and the fingerprint of its images.

Formats and documents share this list of files. Holes are grouped by the copper layers that they go through, as in drill
files, drill maps and tables. A set of images consists of the Gerber and drill files, with the drill map, of the board
(``fpc/``) or of the panel (``fpc/panel/``). The fingerprint hashes the images in the order of their names in the
package. The archive holds the same bytes under the fabricator's names, and its readme uses these names. The readme's
shell command lists the files in the hashed order, so it prints the same fingerprint in both places.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

from sitscad.basics.record import record
from sitscad.basics.units import fixed_decimals, show
from sitscad.basics.version import __version__
from sitscad.layout.board import Layout, Stiffener
from sitscad.spec.circuit import MASK, FpcSpec, LayerKind, StackLayer, Stackup
from sitscad.spec.presets import cover_name
from sitscad.spec.yaml.source import UNNUMBERED, creation_date

FOLDER = "fpc"
CUTS = "Other,Part_Cuts"
VENDOR = "sitscad"
NO_NET = "N/C"  # Net name in X2 and IPC-D-356 of a pad without a net
_PROJECTS = uuid.uuid5(uuid.NAMESPACE_DNS, "sitscad")


@record
class FabricationFile:
    """One file of the set: its path in the package, X2 file function, title and polarity.

    `layer` is the number of the copper layer (1 at the top), or for a drill file the last copper layer that its holes
    go through. None for other files.
    """

    path: str
    function: str
    title: str
    layer: int | None = None
    polarity: str = "Positive"

    @property
    def name(self) -> str:
        """File name without its folder."""
        return self.path.rpartition("/")[2]

    @property
    def row(self) -> tuple[str, str]:
        """The file's row in a readme: its name and a description."""
        kind = "Excellon, metric" if self.path.endswith(".drl") else f"Gerber X2, {self.function}"
        return self.name, f"{self.title} ({kind})"


def layer_name(number: int, count: int) -> str:
    """Return a copper layer's short name: ``F_Cu`` (also for a single layer), ``In1_Cu`` ..., ``B_Cu``."""
    if number == 1:
        return "F_Cu"
    return "B_Cu" if number == count else f"In{number - 1}_Cu"


def fabrication_path(name: str, ending: str) -> str:
    """Return the package path of a file of the set, such as ``fpc/NAME-F_Cu.gbr``."""
    return f"{FOLDER}/{name}-{ending}"


def copper_files(count: int, name: str) -> tuple[FabricationFile, ...]:
    """Return one Gerber file for each of `count` copper layers, from the top."""
    sides = {count: "Bot", 1: "Top"}
    return tuple(
        FabricationFile(
            fabrication_path(name, f"{layer_name(number, count)}.gbr"),
            f"Copper,L{number},{sides.get(number, 'Inr')}",
            f"copper layer {number} of {count}",
            number,
        )
        for number in range(1, count + 1)
    )


def coverlay_files(stackup: Stackup, name: str) -> tuple[FabricationFile, ...]:
    """Return one file of coverlay openings for each covered face."""
    top, bottom = has_coverlay(stackup)
    cover = cover_name(stackup)
    sides = [("F", "Top", "top")] * top + [("B", "Bot", "bottom")] * bottom
    return tuple(
        FabricationFile(
            fabrication_path(name, f"{letter}_Mask.gbr"),
            f"Soldermask,{side}",
            f"openings in the {word} {cover} (what is drawn is cut away)",
            polarity="Negative",
        )
        for letter, side, word in sides
    )


def stiffener_files(name: str, stiffener: Stiffener | None) -> tuple[FabricationFile, ...]:
    """Return the file of the stiffener's outline; empty without a stiffener."""
    if stiffener is None:
        return ()
    path = fabrication_path(name, "B_Stiffener.gbr")
    return (FabricationFile(path, "Other,Stiffener_Bottom", "stiffener on the bottom face"),)


def body_files(name: str, fpc: FpcSpec) -> tuple[FabricationFile, ...]:
    """Return the file with the extent of the copper layers that end before the tail. Empty if all run down the tail."""
    first, last = fpc.tail_copper + 1, len(fpc.stackup.copper)
    if first > last:
        return ()
    names = f"L{first}" if first == last else f"L{first}_to_L{last}"
    which = names.replace("_", " ").replace("L", "")
    title = f"extent of copper {which} and of what lies between and below (the tail is without)"
    path = fabrication_path(name, "Body_Layers.gbr")
    return (FabricationFile(path, f"Other,Extent_of_{names}", title),)


def tail_coverlay_files(name: str, fpc: FpcSpec) -> tuple[FabricationFile, ...]:
    """Return the file of a thinner tail's own bottom coverlay; empty without this coverlay."""
    if not fpc.has_tail_coverlay:
        return ()
    last, lap = fpc.tail_copper, show(fpc.rules.coverlay_lap, "m")
    title = f"coverlay under copper {last} of the tail, {lap} into the body between its layers (drawn: covered)"
    path = fabrication_path(name, "Tail_Coverlay.gbr")
    return (FabricationFile(path, f"Other,Tail_Coverlay_L{last}", title),)


def profile_file(name: str) -> FabricationFile:
    """Return the file of the board's outline."""
    return FabricationFile(fabrication_path(name, "Edge_Cuts.gbr"), "Profile,NP", "outline of the board")


def gerber_files(name: str, fpc: FpcSpec, stiffener: Stiffener | None) -> tuple[FabricationFile, ...]:
    """Return all Gerber files of the set, from the top of the board downwards, the outline last."""
    return (
        *copper_files(len(fpc.stackup.copper), name), *coverlay_files(fpc.stackup, name),
        *stiffener_files(name, stiffener), *body_files(name, fpc), *tail_coverlay_files(name, fpc), profile_file(name),
    )


def drill_files(copper_layers: int, spans: tuple[int, ...], name: str) -> tuple[FabricationFile, ...]:
    """Return one drill file for each kind of plated hole: through the board, and through a thinner tail.

    `spans` lists the last copper layer of each kind, counted from the top. Names follow KiCad's.
    """
    files = []
    for lowest in spans:
        ending, kind, title = "PTH.drl", "PTH", "plated holes through all copper layers"
        if lowest != copper_layers:
            ending, kind = f"front-in{lowest - 1}.drl", "Blind"
            title = f"plated holes in the tail, through copper 1 to {lowest}"
        path = fabrication_path(name, ending)
        files.append(FabricationFile(path, f"Plated,1,{lowest},{kind}", title, lowest))
    return tuple(files)


def drill_title(issue: str, name: str, title: str) -> str:
    """Return the first comment of a drill file: design name `name`, issue, and kind of holes (`title`).

    `issue` is the text with part number, revision and date, or empty.
    """
    return f"{name}{f' ({issue})' if issue else ''}: {title}"


def has_coverlay(stackup: Stackup) -> tuple[bool, bool]:
    """Whether the top face and the bottom face have a coverlay."""
    return stackup.layers[0].kind is LayerKind.COVERLAY, stackup.layers[-1].kind is LayerKind.COVERLAY


def panel_path(name: str, ending: str) -> str:
    """Return the package path of a file of the panel's set, such as ``fpc/panel/NAME-panel-F_Cu.gbr``."""
    return f"{FOLDER}/panel/{name}-panel{ending}"


def cut_file(name: str) -> FabricationFile:
    """Return the file of the cuts round the parts of a panel."""
    title = "cuts round the parts, open at the bridges (the middle of the line is the cut)"
    return FabricationFile(panel_path(name, "-Part_Cuts.gbr"), CUTS, title)


def tooling_file(copper_layers: int, name: str) -> FabricationFile:
    """Return the drill file of a panel's tooling holes."""
    function = f"NonPlated,1,{copper_layers},NPTH"
    return FabricationFile(panel_path(name, "-NPTH.drl"), function, "tooling holes, not plated")


def panel_files(
    name: str, fpc: FpcSpec, stiffener: Stiffener | None, spans: tuple[int, ...]
) -> tuple[FabricationFile, ...]:
    """Return the panel's Gerber and drill files: one for each of the board's files, then the tooling and cut files.

    `spans` are the lowest copper layers of the kinds of plated holes: one drill file for each.
    """
    layers = len(fpc.stackup.copper)
    board = (*gerber_files(name, fpc, stiffener), *drill_files(layers, spans, name))
    stem = fabrication_path(name, "").removesuffix("-")
    copies = (replace(file, path=panel_path(name, file.path.removeprefix(stem))) for file in board)
    frame = {profile_file(name).function: "outline of the panel"}
    named = (replace(file, title=frame.get(file.function, file.title)) for file in copies)
    return (*named, tooling_file(layers, name), cut_file(name))


def panel_attributes(revision: str, name: str) -> tuple[tuple[str, ...], ...]:
    """Return the X2 file attributes of the panel's set: an array with its own coordinate system."""
    panel_values = {".SameCoordinates": f"{name}-panel", ".Part": "Array"}
    attributes = project_attributes(revision, name)
    return tuple((name, panel_values[name]) if name in panel_values else (name, *values) for name,
                 *values in attributes)


def project_attributes(revision: str, name: str) -> tuple[tuple[str, ...], ...]:
    """Return the X2 file attributes that all files of a set share, each as a name and its values.

    All files use one coordinate system (``.SameCoordinates``). The project identifier depends on the design's name
    alone. The creation date is written only if SOURCE_DATE_EPOCH is set, so that equal specs give equal bytes.
    """
    created = creation_date()
    return (
        (".GenerationSoftware", VENDOR, VENDOR, __version__),
        *(((".CreationDate", created),) if created else ()),
        (".ProjectId", name, project_guid(name), revision or UNNUMBERED),
        (".SameCoordinates", name),
        (".Part", "Single"),
    )


def project_guid(name: str) -> str:
    """Return an RFC 4122 identifier (version 5) that depends only on the design's name."""
    return str(uuid.uuid5(_PROJECTS, name))


def drill_map_file(path: str) -> FabricationFile:
    """Return the entry of a drill map in the set."""
    return FabricationFile(path, "Drillmap", "drill map")


def stack_names(copper_layers: int, layers: tuple[StackLayer, ...]) -> list[str]:
    """Return the name of each layer of the stack-up. A copper layer has the short name in its file's name.

    `layers` are the layers from the top, and `copper_layers` their number of copper layers.
    """
    names, copper = [], 0
    for layer in layers:
        if layer.kind is LayerKind.COPPER:
            copper += 1
            names.append(f"copper {copper} ({layer_name(copper, copper_layers)})")
        else:
            name = layer.material if layer.material == MASK else "coverlay"
            names.append(name if layer.kind is LayerKind.COVERLAY else "dielectric")
    return names


UNIT = 1e-9
"""Unit (m) of integer coordinates and diameters of holes."""


class DrilledHole(NamedTuple):
    """Hole on the grid of 1 nm: coordinates and finished diameter (nm)."""

    x: int
    y: int
    diameter: int


@record
class Tool:
    """Holes of one finished diameter (nm) and one kind. `words` describes the kind in tables and drill maps."""

    diameter: int
    holes: tuple[DrilledHole, ...]
    words: str


def drilled_to(layout: Layout, lowest: int | None, dx: int = 0, dy: int = 0) -> list[DrilledHole]:
    """Return the holes from copper layer 1 to layer `lowest`, moved by (dx, dy) nanometres."""
    return [
        DrilledHole(on_grid(via.centre.x) + dx, on_grid(via.centre.y) + dy, on_grid(via.drill))
        for via in layout.vias
        if layout.lowest_layer(via) == lowest
    ]


def tools(holes: Sequence[DrilledHole], kind: str) -> list[Tool]:
    """Return one tool per finished diameter of holes of one kind, smallest first."""
    return [Tool(diameter, tuple(drilled), kind) for diameter, drilled in tools_of(holes)]


def plated_words(spans: tuple[int, ...], lowest: int) -> str:
    """Describe the plated holes down to copper layer `lowest`, for a table.

    The text names the layers only if `spans` has several kinds of holes.
    """
    return "plated" if len(spans) < 2 else f"plated, copper 1 to {lowest}"


def plated_tools(layout: Layout) -> list[Tool]:
    """Return all tools for the plated holes of a layout, one group for each entry of `layout.spans`."""
    return [tool for lowest in layout.spans for tool in tools(drilled_to(layout, lowest),
                                                              plated_words(layout.spans, lowest))]


def tools_of(holes: Iterable[DrilledHole]) -> list[tuple[int, list[DrilledHole]]]:
    """Return (diameter in nm, holes) for each finished diameter, the smallest first.

    Holes of one diameter keep their order.
    """
    ordered = sorted(holes, key=lambda hole: hole.diameter)
    return [(diameter, list(group)) for diameter, group in groupby(ordered, key=lambda hole: hole.diameter)]


def on_grid(length: float) -> int:
    """Round a length (m) to whole nanometres."""
    return round(length / UNIT)


def millimetres(nanometres: int, least: int = 1) -> str:
    """Return a length (nm) as text in millimetres with up to six decimals, at least `least`."""
    return fixed_decimals(nanometres / 1e6, 6, least)


SHOWN = 16
"""Number of fingerprint digits printed on drawings."""


def board_images(files: Mapping[str, bytes], folder: str = FOLDER) -> list[str]:
    """Return the sorted paths of the Gerber and drill files directly in a folder of the package.

    The fingerprint hashes them in this order. The default folder contains the files of the single board.
    """
    inside = [path for path in files if path.rpartition("/")[0] == folder]
    return sorted(path for path in inside if path.endswith((".gbr", ".drl")))


def panel_images(name: str, files: Mapping[str, bytes]) -> list[str]:
    """Return the sorted paths of the panel's Gerber and drill files. Empty if the package has no panel.

    The fingerprint hashes them in this order.
    """
    return board_images(files, panel_path(name, "").rpartition("/")[0])


def fingerprint(files: Mapping[str, bytes], images: list[str]) -> str:
    """Return the SHA-256 (hexadecimal) of the contents of the images, one after another.

    `images` are the paths of Gerber and drill files in hashed order.
    """
    digest = hashlib.sha256()
    for path in images:
        digest.update(files[path])
    return digest.hexdigest()


def shell_line(images: list[str]) -> str:
    """Return the shell command that prints the fingerprint of images. It is run in their folder."""
    return f"cat {' '.join(path.rpartition('/')[2] for path in images)} | sha256sum"


def on_drawing(whose: str, files: Mapping[str, bytes], images: list[str]) -> str:
    """Return the first `SHOWN` digits of the fingerprint of images, as text for a title block.

    `whose` is the word for the set of images: board or panel.
    """
    return f"{whose} SHA-256 {fingerprint(files, images)[:SHOWN]} ... (how: see the readme)"
