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
    Run,
    Special,
    UnitValue,
    described,
    refuse,
)
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key


class LayerKind(StrEnum):
    """What a layer of the stack-up is made for."""

    COVERLAY = "coverlay"
    COPPER = "copper"
    DIELECTRIC = "dielectric"


class Plating(StrEnum):
    """What of the copper is plated together with the holes: all of the panel before it is etched, the tracks alone
    (through a resist, on foil that is etched afterwards), or the holes and their pads alone ("buttons").
    """

    PANEL = "panel"
    PATTERN = "pattern"
    BUTTONS = "buttons"


MASK = "solder-mask"
"""The material of a coverlay that is printed and no film."""


@record
class StackLayer:
    """One layer: its thickness in metres and its material (a row of the materials data).

    ``made_of`` names the films of a layer that is laminated from several, in words; empty where that is not stated.
    ``plated`` (m) is the part of a copper layer's thickness that is plated on its foil. ``adhesive`` (m) is the part of
    a coverlay's thickness that flows between the tracks; 0 if it is not stated.
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

    ``thickness`` (m) is finished, ``plated`` (m) the part of it that is plated on the foil.
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
    """The flexible circuit's layers from top to bottom, as they are finished: `built` says how.

    `plating_thickness` (m) is the copper that one step of plating lays into holes and, as `plating` says, on foil;
    `is_plating_stated` is False where the fabricator does not say how much of his copper is plated. ``core_layers`` is
    the number of copper layers from the top that are drilled and plated before the others are laminated on, 0 if none.
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
        found: list[CopperLayer] = []
        depth = 0.0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                z = -(depth + layer.thickness / 2)
                found.append(CopperLayer(len(found) + 1, z, layer.thickness, layer.plated))
            depth += layer.thickness
        return tuple(found)

    def platings(self, number: int) -> int:
        """How often a copper layer (from 1) lies open while holes are plated: the outer ones once, those of a core
        that is plated by itself once with it, one that is both twice. A single layer has no plated holes.
        """
        count = sum(layer.kind is LayerKind.COPPER for layer in self.layers)
        ends = [(1, count)] * (count > 1) + [(1, self.core_layers)] * (self.core_layers > 1)
        return sum(number in pair for pair in ends)

    def built(
        self, plating: Plating, core_layers: int, thickness: float | None = None, finished: bool = False
    ) -> Stackup:
        """The stack-up built in one way, with a plating of so many metres (None: its own): from its foils, or where
        its copper is given as it is ``finished``, to that, from what foil is left.
        """
        wall = self.plating_thickness if thickness is None else thickness
        bare = replace(self, plating=plating, core_layers=core_layers, plating_thickness=wall)
        layers, number = [], 0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                number += 1
                plated = 0.0 if plating is Plating.BUTTONS else bare.platings(number) * wall
                whole = layer.thickness if finished else layer.foil + plated
                layer = replace(layer, thickness=whole, plated=plated)
            layers.append(layer)
        return replace(bare, layers=tuple(layers))

    @property
    def covers(self) -> tuple[tuple[str, StackLayer, CopperLayer], ...]:
        """Each coverlay with its side ("top" or "bottom") and the thickest copper that it lies on: an outer layer, or
        the last layer of a core whose tail has a coverlay of its own.
        """
        copper, found = self.copper, []
        if copper and self.layers[0].kind is LayerKind.COVERLAY:
            found.append(("top", self.layers[0], copper[0]))
        if copper and self.layers[-1].kind is LayerKind.COVERLAY:
            under = [copper[number - 1] for number in (len(copper), self.core_layers) if number]
            found.append(("bottom", self.layers[-1], max(under, key=lambda layer: layer.thickness)))
        return tuple(found)

    def line_foil(self, layers: Sequence[int]) -> float:
        """The thickest copper (m) of some layers (numbers from 1, missing ones are passed over) as fabricators list
        their widths by it: the foil. One plating of the whole panel is in those figures; what a second one adds is
        etched like thicker foil. Where it is not stated how much is plated, all of it counts.
        """
        chosen = [layer for layer in self.copper if layer.number in layers]
        if not self.is_plating_stated:
            return max((layer.thickness for layer in chosen), default=0.0)
        once = self.plating_thickness if self.plating is Plating.PANEL else math.inf
        return max((layer.foil + max(0.0, layer.plated - once) for layer in chosen), default=0.0)

    def between(self, upper: int, lower: int) -> tuple[StackLayer, ...]:
        """The layers strictly between two copper layers (numbers from 1)."""
        indices = [i for i, layer in enumerate(self.layers) if layer.kind is LayerKind.COPPER]
        return self.layers[indices[upper - 1] + 1 : indices[lower - 1]]


TurnRadius = UnitValue("length", "0.1 mm", "100 mm")


@record
class Connector:
    """How the tail ends: contacts at a pitch, their bare length and their width, the insertion thickness (0: solder
    pads).

    ``positions`` are the numbers of contacts that it is made with (none: any); ``width_tolerance`` (m) is what it
    takes, plus and minus, of the tail's width.
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
        """Width (m) of the tail's end for a number of contacts: outer contact centres plus a margin on each side."""
        return self.pitch * (contacts - 1) + 2.0 * self.edge_margin


@record
class Chip:
    """The land pattern of a two-terminal chip: its pads' size along and across it, distance of their centres (m).

    ``model`` is the path of its solid among KiCad's 3-D models.
    """

    name: str
    pad_along: float
    pad_across: float
    pitch: float
    source: str = ""
    model: str = ""


class BendDocument(Section):
    """How the tail is bent: about a line across it."""

    kind: str = key(Choice(("static", "dynamic")), "static: bent once at assembly; dynamic: bends in use", "static")
    at: float | None = key(
        Run, "from the sensor's body to the bend's middle line; if left out, the pivot of the jaw's hinge where the "
        "bend has room there, else the middle of the stretch that may be bent", None,
    )
    direction: str = key(Choice(("down", "up")), "down: away from the face with the coils; up: towards it", "down")
    angle: float | None = key(
        UnitValue("angle", "1 deg", "180 deg"),
        "out of the plane; if left out, half of the opening of a jaw with a hinge, 0 on a finger's cap, else 90 deg",
        None,
    )
    radius: float | None = key(TurnRadius, "inside; the fabricator's least if left out", None)


@record
class Tail(Section):
    """The strip that leads to the converter.

    ``length`` is metres along its middle, ``offset`` m, ``turn_radius`` m and None only until it is worked out, as are
    ``layers``. ``bend`` is a word, and a section only until it is taken apart: it bends about a line across it, whose
    distance from the body is ``bend_at`` (m; None: the pivot of the jaw's hinge, or the middle of the stretch that may
    be bent), ``down`` (away from the face with the coils) or ``up``, by an angle (rad; half of the jaw's opening leads
    it into the shaft) at an inside radius (m; None: the fabricator's least). ``contacts`` is how many the connector
    has, None where it is the fewest that are enough; ``stiffener`` (m, with its adhesive) is None where the stock one
    is taken that fits best.
    """

    length: float = key(Run, "from the sensor's body to the end", 30)
    connector: Connector = key(Preset("connector", up=True), "what the tail ends in", "zif-0.5mm")
    contacts: int | None = key(
        Number(2, 200, whole=True), "of the connector that is bought: the fewest that are enough if left out", None
    )
    stiffener: float | None = key(
        UnitValue("length", "10 um", "2 mm"),
        "thickness with its adhesive, under contacts that are plugged in: the best of the stock ones if left out", None,
    )
    layers: int = key(
        Number(1, 8, whole=True),
        "copper layers that run down it; all of the body's if left out. Fewer bend more tightly and are a build of "
        "their own (SIT132)", None,
    )
    bend: str = key(
        NameOr(Choice(("none", "static", "dynamic")), Part(BendDocument)),
        "static: bent once at assembly; dynamic: bends in use; none; or a section with line and angle", "static",
    )
    turn: str = key(
        Choice(("none", "left", "right")), "by 90 degrees in its plane before the contacts, seen from the coils", "none"
    )
    offset: float = key(Offset, "or led aside by so much before the contacts, to the left; negative: right", 0)
    turn_radius: float = key(TurnRadius, "of the turn's inner edge: 2 mm, or the fabricator's least", None)
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
        Preset("dielectric"), "of a dielectric or coverlay; polyimide and polyimide-coverlay if left out", None
    )
    permittivity: float | None = key(Number(1, 100), "relative, if not the material's", None)
    adhesive: float | None = key(
        UnitValue("length", "1 um", "2 mm"), "part of a coverlay's thickness that is adhesive (SIT138)", None
    )


MOST_PARTS = 500
"""Boards on one panel: every copy is drawn out in full (about 50 kB of Gerber each), and nobody cuts more by hand."""


def _columns_and_rows(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) != 2:
        refuse("SIT004", f"{described(value)}, where [columns, rows] is wanted", "write [2, 5], or auto")
    return tuple(int(InRow.read(entry)) for entry in value)


@record
class PanelSpec(Section):
    """A panel, whatever the part's size.

    ``parts`` are columns and rows (None: as many as fit the fabricator's panel), lengths are metres. ``wish`` is
    ``auto`` (in a panel if too small to be made singly), ``none``, or ``always``, which is what a written panel is.
    """

    wish: str = "auto"
    parts: tuple[int, int] | None = key(
        Either("auto", Special(_columns_and_rows, PAIR_OF_COUNTS)),
        "[columns, rows] of at most 500 boards, or auto: as many as fit the fabricator's panel", "auto",
    )
    gap: float = key(UnitValue("length", "0.5 mm", "20 mm"), "between parts", 2)
    rail: float = key(UnitValue("length", "3 mm", "30 mm"), "width of the frame", 5)
    bridge: float = key(UnitValue("length", "0.2 mm", "3 mm"), "width of what holds a part in its place", 0.5)


PLAIN_CORNER = 0.5e-3
"""Radius (m) of a rectangle's corners: as of every board's outline, for what touches tissue has no sharp edge."""


@record
class BodySpec(Section):
    """The outline of the board's body, without its tail: its middle is the mean of the coils' centres.

    Lengths are metres; ``size`` is None only until it is worked out, as is ``edge``: the closed outline, walked
    counter-clockwise, about that mean.
    """

    shape: str = key(
        Choice(("circle", "rectangle", "rounded", "dxf")),
        "rectangle: corners of 0.5 mm; rounded: of corner_radius; dxf: as drawn in file",
    )
    size: tuple[float, float] | None = key(
        Pair(UnitValue("length", "1 mm", "500 mm"), single=True),
        "diameter of a circle, or side; [x, y] along and across, of a rectangle; must be there but for a dxf", None,
    )
    corner_radius: float | None = key(
        UnitValue("length", "0.1 mm", "250 mm"), "of shape rounded: 1 mm if left out", None
    )
    file: str | None = key(
        FileName("DXF", r"\.[dD][xX][fF]$", "body.dxf"), "of shape dxf: one closed outline of lines and arcs, in the "
        "spec's folder. Its origin comes to the mean of the coils' centres, its x runs to the tail", None,
    )
    edge: Path = Path(())

    def sized(self, size: tuple[float, float]) -> BodySpec:
        """The body of another size (m), with its outline; one that is drawn stays as it is."""
        if self.shape == "dxf":
            return self
        (x, y), radius = size, PLAIN_CORNER if self.corner_radius is None else self.corner_radius
        round_one = circle(Point(0.0, 0.0), x / 2)
        straight = rectangle(-x / 2, -y / 2, x / 2, y / 2, radius)
        return replace(self, size=size, edge=round_one if self.shape == "circle" else straight)

    @property
    def extent(self) -> tuple[float, float]:
        """Its length and width (m)."""
        x0, y0, x1, y1 = bounding_box([self.edge])
        return x1 - x0, y1 - y0

    @property
    def written(self) -> str:
        """The body as it stands in a spec, lengths in millimetres."""
        if self.shape == "dxf":
            return f"{{shape: dxf, file: {self.file}}}"
        x, y = (f"{side * 1e3:.9g}" for side in self.size or self.extent)
        corners = "" if self.corner_radius is None else f", corner_radius: {self.corner_radius * 1e3:.9g}"
        return f"{{shape: {self.shape}, size: {x if x == y else f'[{x}, {y}]'}{corners}}}"


@record
class FpcSpec(Section):
    """The flexible printed circuit.

    Stack-up, rules and panel are names, words and sections as they are written only until they are worked out.
    ``plating`` (m) and ``plated`` are as written, None if left out; ``stackup`` has them worked out. Without a tail
    there are solder pads at the outline.
    ``panel`` says how parts are delivered, ``finish`` what is on the bare contacts (a row of the finishes' data),
    ``copper`` is ``rolled-annealed`` or ``electrodeposited``, ``teardrops`` is ``auto`` or ``none``; ``boards`` is how
    many are wanted, None where the order says so; ``margin`` (m, along and across) is what the body is larger by on
    each side than coils and leads need it; ``body`` is None where they alone make its outline; ``largest`` is one that
    it has to lie in.
    """

    stackup: Stackup = key(
        NameOr(Preset("stackup", up=True), ListOf(Part(LayerDocument))),
        "a preset (30um is its finished copper), or the layers from top to bottom; flex-2l-30um, flex-4l, flex-6l or "
        "flex-8l, after the coil's layers, if left out", None,
    )
    plating: float | None = key(
        UnitValue("length", "1 um", "100 um"),
        "in the holes, one step of it: a preset's foils get thicker by it, of copper that is written out it is a part; "
        "the preset's own, or 12 um, if left out", None,
    )
    plated: str | None = key(
        Choice(tuple(Plating)),
        "what is plated with the holes. panel: all outer copper before it is etched; pattern: the tracks, on foil that "
        "is etched afterwards; buttons: holes and their pads alone, so that tracks stay foil. If left out as the "
        "preset has it, of written layers panel", None,
    )
    rules: DesignRules = key(
        RulesChoice, "a fabricator's design rules: a preset, a profile file, or written out", "generic-flex"
    )
    tail: Tail | None = key(Part(Tail), "none: a short strip with solder pads", None)
    panel: PanelSpec = key(
        NameOr(Choice(("auto", "none")), Part(PanelSpec, lambda panel: replace(panel, wish="always"))),
        "auto: when the part is too small to be made singly; none; or a section", "auto",
    )
    boards: int | None = key(
        Number(1, 100_000, whole=True),
        "how many are wanted: the papers of the order then say how many panels that takes", None,
    )
    margin: tuple[float, float] = key(
        Pair(UnitValue("length", "0 mm", "100 mm"), single=True),
        "by how much the body is larger on each side than coils and leads need it; along and across: [x, y]. The body "
        "also grows until the mean of the coils' centres is its middle, as far as a jaw is long and wide", 0,
    )
    body: BodySpec | None = key(
        Part(BodySpec),
        "outline of the body; a rectangle as large as coils, leads, margin and jaw make it if left out", None,
    )
    largest: BodySpec | None = key(
        Part(BodySpec),
        "outline in which the board's body (its mount may be larger) has to lie: a requirement (SIT136)", None,
    )
    teardrops: str = key(
        Choice(("auto", "none")), "auto: tracks widen towards vias and contacts wherever the rules leave room", "auto"
    )
    finish: str = key(Choice(FINISHES), "of the bare contacts", "enig")
    copper: str = key(Choice(("rolled-annealed", "electrodeposited")), "kind of the foil", "rolled-annealed")

    @property
    def body_key(self) -> str:
        """The key that makes the body larger."""
        return "fpc.margin" if self.body is None else "fpc.body"
