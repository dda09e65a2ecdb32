"""The flexible printed circuit as written and as values: stack-up, tail, connector, chips, panel and body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import cached_property
from typing import Any

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point, bounding_box, circle, rectangle
from sitscad.spec.design_rules import FINISHES, DesignRules, RulesChoice
from sitscad.spec.format.kinds import (
    PAIR_OF_COUNTS,
    Choice,
    Either,
    FileName,
    InRow,
    Number,
    Offset,
    Pair,
    Preset,
    RunLength,
    Special,
    UnitValue,
    describe,
    refuse,
)
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key


class LayerKind(StrEnum):
    """Purpose of a layer of the stack-up."""

    COVERLAY = "coverlay"
    COPPER = "copper"
    DIELECTRIC = "dielectric"


class Plating(StrEnum):
    """Copper that is plated together with the holes.

    ``PANEL``: all outer copper before etching. ``PATTERN``: only the tracks, through a resist, on foil that is etched
    afterwards. ``BUTTONS``: only the holes and their pads.
    """

    PANEL = "panel"
    PATTERN = "pattern"
    BUTTONS = "buttons"


MASK = "solder-mask"
"""Material name of a coverlay that is a printed solder mask instead of a film."""


@record
class StackLayer:
    """One layer: thickness (m) and material (a row of the materials data).

    * ``made_of``: text that lists the films of a laminated layer. Empty if unknown.
    * ``plated``: plated part (m) of a copper layer's thickness
    * ``adhesive``: part (m) of a coverlay's thickness that flows between the tracks. 0 if unknown.
    """

    kind: LayerKind
    thickness: float
    material: str
    relative_permittivity: float | None = None
    made_of: str = ""
    plated: float = 0.0
    adhesive: float = 0.0

    @property
    def foil(self) -> float:
        """Thickness (m) of the foil that a copper layer is made from."""
        return self.thickness - self.plated


@record
class CopperLayer:
    """A copper layer: `number` counts from 1 at the top, `z` is its mid-plane (m), negative below the board's top.

    ``thickness`` (m) is the finished thickness, ``plated`` (m) its plated part.
    """

    number: int
    z: float
    thickness: float
    plated: float = 0.0

    @property
    def foil(self) -> float:
        """Thickness (m) of the foil."""
        return self.thickness - self.plated


@record
class Stackup:
    """The layers of the flexible circuit from top to bottom, with finished thicknesses (see `built`).

    * ``plating_thickness``: copper (m) of one plating step, in holes and, depending on ``plating``, on foil
    * ``is_plating_stated``: False if the fabricator does not state how much of the copper is plated
    * ``core_layers``: number of copper layers, from the top, that form a core. It is drilled and plated before the
      other layers are laminated on. 0 without a core.
    """

    name: str
    layers: tuple[StackLayer, ...]
    source: str = ""
    plating_thickness: float = 0.0
    is_plating_stated: bool = True
    plating: Plating = Plating.PANEL
    core_layers: int = 0

    @property
    def thickness(self) -> float:
        """Finished thickness in metres, without stiffener."""
        return sum(layer.thickness for layer in self.layers)

    @cached_property
    def copper(self) -> tuple[CopperLayer, ...]:
        """The copper layers from the top, each with its height."""
        layers: list[CopperLayer] = []
        depth = 0.0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                z = -(depth + layer.thickness / 2)
                layers.append(CopperLayer(len(layers) + 1, z, layer.thickness, layer.plated))
            depth += layer.thickness
        return tuple(layers)

    def platings(self, number: int) -> int:
        """Return the number of plating steps that copper layer `number` receives. Layer 1 is at the top.

        Both outer layers are plated once together with the through holes. If a core is plated separately, both its
        outer layers are plated once together with the core's holes. Layer 1 can therefore be plated twice. A board with
        a single copper layer has no plated holes.
        """
        count = sum(layer.kind is LayerKind.COPPER for layer in self.layers)
        ends = [(1, count)] * (count > 1) + [(1, self.core_layers)] * (self.core_layers > 1)
        return sum(number in pair for pair in ends)

    def built(
        self, plating: Plating, core_layers: int, thickness: float | None = None, finished: bool = False
    ) -> Stackup:
        """Return the stack-up after plating by the method `plating`.

        The first `core_layers` copper layers are plated as a core; 0 means no core. `thickness` (m) is the copper of
        one plating step; None means `plating_thickness`. If `finished` is True, the layers' thicknesses include the
        plating and do not change. If it is False, the plating is added to each layer's foil.
        """
        wall = self.plating_thickness if thickness is None else thickness
        plated_stackup = replace(self, plating=plating, core_layers=core_layers, plating_thickness=wall)
        layers, number = [], 0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                number += 1
                plated = 0.0 if plating is Plating.BUTTONS else plated_stackup.platings(number) * wall
                whole = layer.thickness if finished else layer.foil + plated
                layer = replace(layer, thickness=whole, plated=plated)
            layers.append(layer)
        return replace(plated_stackup, layers=tuple(layers))

    @property
    def covers(self) -> tuple[tuple[str, StackLayer, CopperLayer], ...]:
        """Each coverlay as (side, coverlay, copper layer that it covers). The side is "top" or "bottom".

        The bottom coverlay can cover two copper layers: the board's last layer, and in the tail the core's last layer.
        The thicker of the two is returned.
        """
        copper, covers = self.copper, []
        if copper and self.layers[0].kind is LayerKind.COVERLAY:
            covers.append(("top", self.layers[0], copper[0]))
        if copper and self.layers[-1].kind is LayerKind.COVERLAY:
            under = [copper[number - 1] for number in (len(copper), self.core_layers) if number]
            covers.append(("bottom", self.layers[-1], max(under, key=lambda layer: layer.thickness)))
        return tuple(covers)

    def line_foil(self, layers: Sequence[int]) -> float:
        """Return the foil thickness (m) at which a fabricator's table of smallest track widths is read.

        It is the largest of the copper layers with the numbers `layers` (from 1). Numbers without a layer are ignored.
        The tables already allow for one plating of the whole panel. Any further plating makes etching as hard as on a
        thicker foil, so its thickness is added. If the amount of plating is unknown, the finished thickness is used.
        """
        chosen = [layer for layer in self.copper if layer.number in layers]
        if not self.is_plating_stated:
            return max((layer.thickness for layer in chosen), default=0.0)
        one_step = self.plating_thickness if self.plating is Plating.PANEL else math.inf
        return max((layer.foil + max(0.0, layer.plated - one_step) for layer in chosen), default=0.0)

    def between(self, upper: int, lower: int) -> tuple[StackLayer, ...]:
        """Return the layers strictly between two copper layers (numbers from 1)."""
        indices = [i for i, layer in enumerate(self.layers) if layer.kind is LayerKind.COPPER]
        return self.layers[indices[upper - 1] + 1 : indices[lower - 1]]


TurnRadius = UnitValue("length", "0.1 mm", "100 mm")


@record
class Connector:
    """The end of the tail: contacts at a pitch, with their bare length and width.

    * ``insertion_thickness`` (m): 0 for solder pads
    * ``positions``: available numbers of contacts. Empty if any number is available.
    * ``width_tolerance``: largest deviation (m) of the tail's width to either side
    """

    name: str
    kind: str
    pitch: float
    contact_width: float
    contact_length: float
    edge_margin: float
    insertion_thickness: float
    insertion_thickness_tolerance: float
    stiffener_length: float
    source: str = ""
    width_tolerance: float = 0.0
    positions: tuple[int, ...] = ()

    def width(self, contacts: int) -> float:
        """Return the width (m) of the tail's end: the distance of the outer contact centres plus both edge margins."""
        return self.pitch * (contacts - 1) + 2.0 * self.edge_margin


@record
class Chip:
    """The land pattern of a two-terminal chip: size of its pads along and across it, and distance of their centres (m).

    ``model`` is the path of its solid in KiCad's library of 3-D models.
    """

    name: str
    pad_along: float
    pad_across: float
    pitch: float
    source: str = ""
    model: str = ""


class BendDocument(Section):
    """The bend of the tail about a line across it."""

    kind: str = key(Choice(("static", "dynamic")), "static: bent once at assembly; dynamic: bends in use", "static")
    at: float | None = key(
        RunLength,
        "from the sensor's body to the bend's middle line; default: the pivot of the jaw's hinge if the bend has "
        "room there, else the middle of the section that may be bent", None,
    )
    direction: str = key(Choice(("down", "up")), "down: away from the face with the coils; up: towards it", "down")
    angle: float | None = key(
        UnitValue("angle", "1 deg", "180 deg"),
        "out of the plane; default: half of the opening of a jaw with a hinge, 0 on a finger's cap, else 90 deg",
        None,
    )
    radius: float | None = key(TurnRadius, "inside radius; default the fabricator's minimum", None)


@record
class Tail(Section):
    """The strip that leads to the converter.

    * ``length``: length (m) along its middle line
    * ``turn_radius`` (m) and ``layers``: None only until the resolver computes them
    * ``bend``: kind of the bend, as a word. The resolver splits a written section into the next four fields.
    * ``bend_at``: distance (m) of the bend's line from the body. None for the pivot of the jaw's hinge, or the middle
      of the section that may be bent.
    * ``bend_direction``: ``down`` (away from the face with the coils) or ``up``
    * ``bend_angle`` (rad): angle of the bend. At half of the opening angle of the jaws, the tail runs into the shaft.
    * ``bend_radius``: inside radius (m). None for the fabricator's minimum.
    * ``contacts``: number of contacts of the connector. None for the smallest sufficient number.
    * ``stiffener``: thickness (m) with its adhesive. None for the best stock stiffener.
    """

    length: float = key(RunLength, "from the sensor's body to the end", 30)
    connector: Connector = key(Preset("connector", up=True), "connector at the end of the tail", "zif-0.5mm")
    contacts: int | None = key(
        Number(2, 200, whole=True), "number of contacts of your connector; default the smallest number that is "
        "enough", None
    )
    stiffener: float | None = key(
        UnitValue("length", "10 um", "2 mm"),
        "thickness with its adhesive, under contacts that are plugged in; default the best stock stiffener", None,
    )
    layers: int = key(
        Number(1, 8, whole=True),
        "copper layers in the tail; default all layers of the body. Fewer layers allow a tighter bend but need a "
        "special build (SIT132)", None,
    )
    bend: str = key(
        NameOr(Choice(("none", "static", "dynamic")), Part(BendDocument)),
        "static: bent once at assembly; dynamic: bends in use; none; or a section with position and angle", "static",
    )
    turn: str = key(
        Choice(("none", "left", "right")), "by 90 degrees in its plane before the contacts, seen from the coils", "none"
    )
    offset: float = key(Offset, "sideways shift before the contacts, to the left; negative: right; excludes turn", 0)
    turn_radius: float = key(
        TurnRadius, "of the turn's inner edge; default 2 mm, or the fabricator's minimum if larger", None,
    )
    bend_at: float | None = None
    bend_direction: str = "down"
    bend_angle: float = math.pi / 2
    bend_radius: float | None = None


class LayerDocument(Section):
    """One layer of a stack-up: exactly one of coverlay, copper and dielectric, with its thickness."""

    coverlay: float | None = key(UnitValue("length", "1 um", "2 mm"), "thickness", None)
    copper: float | None = key(UnitValue("length", "1 um", "1 mm"), "finished thickness, foil and plating", None)
    dielectric: float | None = key(UnitValue("length", "1 um", "5 mm"), "thickness", None)
    material: str | None = key(
        Preset("dielectric"), "of a dielectric (default polyimide) or coverlay (default polyimide-coverlay)", None
    )
    permittivity: float | None = key(Number(1, 100), "relative, if not the material's", None)
    adhesive: float | None = key(
        UnitValue("length", "1 um", "2 mm"), "part of a coverlay's thickness that is adhesive (SIT138)", None
    )


MOST_PARTS = 500
"""Maximum number of boards on a panel. Each copy adds about 50 kB of Gerber."""


def _columns_and_rows(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) != 2:
        refuse("SIT004", f"{describe(value)}, where [columns, rows] is wanted", "write [2, 5], or auto")
    return tuple(int(InRow.read(entry)) for entry in value)


@record
class PanelSpec(Section):
    """A panel of several boards.

    Lengths are metres.

    * ``wish``: ``auto`` (a panel only if the board is too small to be made singly), ``none`` or ``always``. A written
      panel is ``always``.
    * ``parts``: columns and rows. If None, the fabricator's panel is filled with boards.
    """

    wish: str = "auto"
    parts: tuple[int, int] | None = key(
        Either("auto", Special(_columns_and_rows, PAIR_OF_COUNTS)),
        "[columns, rows] of at most 500 boards, or auto: as many as fit on the fabricator's panel", "auto",
    )
    gap: float = key(UnitValue("length", "0.5 mm", "20 mm"), "between parts", 2)
    rail: float = key(UnitValue("length", "3 mm", "30 mm"), "width of the frame", 5)
    bridge: float = key(UnitValue("length", "0.2 mm", "3 mm"), "width of the bridges that hold a board", 0.5)


PLAIN_CORNER = 0.5e-3
"""Corner radius (m) of a body with the shape ``rectangle``. Parts that touch tissue must have no sharp corners."""


@record
class BodySpec(Section):
    """The outline of the board's body, without its tail. Its middle is the mean of the coils' centres.

    Lengths are metres. ``edge`` is the closed outline, counter-clockwise; its origin is the mean of the coils' centres.
    Until the resolver computes them, ``size`` can be None and ``edge`` is empty.
    """

    shape: str = key(
        Choice(("circle", "rectangle", "rounded", "dxf")),
        "rectangle has corners of 0.5 mm, rounded has corners of corner_radius, dxf is the outline in file",
    )
    size: tuple[float, float] | None = key(
        Pair(UnitValue("length", "1 mm", "500 mm"), single=True),
        "diameter of a circle, side of a square, or [x, y] along and across; required except for dxf", None,
    )
    corner_radius: float | None = key(
        UnitValue("length", "0.1 mm", "250 mm"), "of shape rounded; default 1 mm", None
    )
    file: str | None = key(
        FileName("DXF", r"\.[dD][xX][fF]$", "body.dxf"), "of shape dxf: a file in the spec's folder with one "
        "closed outline of lines and arcs. Its origin is the mean of the coils' centres, its x axis runs to the "
        "tail", None,
    )
    edge: Path = Path(())

    def sized(self, size: tuple[float, float]) -> BodySpec:
        """Return the body with another size (m), and with the outline of this size.

        A body drawn in a file is returned unchanged.
        """
        if self.shape == "dxf":
            return self
        (x, y), radius = size, PLAIN_CORNER if self.corner_radius is None else self.corner_radius
        round_one = circle(Point(0.0, 0.0), x / 2)
        straight = rectangle(-x / 2, -y / 2, x / 2, y / 2, radius)
        return replace(self, size=size, edge=round_one if self.shape == "circle" else straight)

    @property
    def extent(self) -> tuple[float, float]:
        """Length along x and width along y (m) of the outline's bounding box."""
        x0, y0, x1, y1 = bounding_box([self.edge])
        return x1 - x0, y1 - y0

    @property
    def written(self) -> str:
        """The body as text of a spec, with lengths in millimetres."""
        if self.shape == "dxf":
            return f"{{shape: dxf, file: {self.file}}}"
        x, y = (f"{side * 1e3:.9g}" for side in self.size or self.extent)
        corners = "" if self.corner_radius is None else f", corner_radius: {self.corner_radius * 1e3:.9g}"
        return f"{{shape: {self.shape}, size: {x if x == y else f'[{x}, {y}]'}{corners}}}"


@record
class FpcSpec(Section):
    """The flexible printed circuit.

    The resolver replaces stack-up, rules and panel, which are first as written in the spec. A board without a tail has
    solder pads at its outline.

    * ``plating`` (m) and ``plated``: as written, None if omitted. ``stackup`` has the values in use.
    * ``panel``: delivery of the boards
    * ``finish``: finish of the bare contacts
    * ``copper``: kind of foil
    * ``boards``: number of boards wanted. None if only the order states it.
    * ``margin`` (m, along and across): space on each side beyond coils and leads
    * ``body``: None if coils, leads and margin set the outline
    * ``largest``: outline that must contain the body
    """

    stackup: Stackup = key(
        NameOr(Preset("stackup", up=True), ListOf(Part(LayerDocument))),
        "a preset (30um is its finished copper), or the layers from top to bottom; default flex-2l-30um, flex-4l, "
        "flex-6l or flex-8l, by the coil's layers", None,
    )
    plating: float | None = key(
        UnitValue("length", "1 um", "100 um"),
        "thickness of one plating step in the holes. It is added to the foils of a preset, but is a part of copper "
        "that is written out. Default: the preset's, or 12 um", None,
    )
    plated: str | None = key(
        Choice(tuple(Plating)),
        "copper that is plated with the holes. panel: all outer copper before etching; pattern: the tracks, on foil "
        "that is etched afterwards; buttons: only holes and their pads, so that tracks stay foil. Default: the "
        "preset's, or panel for written layers", None,
    )
    rules: DesignRules = key(
        RulesChoice, "a fabricator's design rules: a preset, a profile file, or written out", "generic-flex"
    )
    tail: Tail | None = key(Part(Tail), "strip to the converter; if left out, a short strip with solder pads", None)
    panel: PanelSpec = key(
        NameOr(Choice(("auto", "none")), Part(PanelSpec, lambda panel: replace(panel, wish="always"))),
        "auto: a panel if the board is too small to be made singly; none; or a section", "auto",
    )
    boards: int | None = key(
        Number(1, 100_000, whole=True),
        "number of boards wanted; the order documents then state the number of panels", None,
    )
    margin: tuple[float, float] = key(
        Pair(UnitValue("length", "0 mm", "100 mm"), single=True),
        "space on each side of the body beyond coils and leads; along and across: [x, y]. The body also grows until "
        "the mean of the coils' centres is its middle, within the length and width of a jaw", 0,
    )
    body: BodySpec | None = key(
        Part(BodySpec),
        "outline of the body; default a rectangle by the size of coils, leads, margin and jaw", None,
    )
    largest: BodySpec | None = key(
        Part(BodySpec),
        "outline that must contain the board's body (the mount may be larger): a requirement (SIT136)", None,
    )
    teardrops: str = key(
        Choice(("auto", "none")), "auto: tracks widen towards vias and contacts if the rules leave room", "auto"
    )
    finish: str = key(Choice(FINISHES), "of the bare contacts", "enig")
    copper: str = key(Choice(("rolled-annealed", "electrodeposited")), "kind of the foil", "rolled-annealed")

    @property
    def body_key(self) -> str:
        """Dotted key in the spec whose value makes the body larger."""
        return "fpc.margin" if self.body is None else "fpc.body"

    @property
    def tail_copper(self) -> int:
        """Number of copper layers, counted from the top, that run down the tail. All layers if there is no tail."""
        count = len(self.stackup.copper)
        return count if self.tail is None else min(self.tail.layers, count)

    @property
    def tail_layers(self) -> tuple[StackLayer, ...]:
        """Layer stack of the tail: the layers down to its last copper layer, and the bottom coverlay."""
        layers = self.stackup.layers
        copper = [i for i, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
        return layers[: copper[self.tail_copper - 1] + 1] + layers[copper[-1] + 1 :]

    @property
    def tail_step(self) -> float:
        """Thickness (m) of the body minus thickness of the tail. 0 if all layers run down the tail."""
        return self.stackup.thickness - sum(layer.thickness for layer in self.tail_layers)

    @property
    def has_tail_coverlay(self) -> bool:
        """Whether the tail has its own bottom coverlay: the body's coverlay cannot cross a step to fewer layers."""
        return self.tail_copper < len(self.stackup.copper) and self.stackup.layers[-1].kind is LayerKind.COVERLAY
