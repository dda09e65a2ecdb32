"""The coil, and the positions of all coils."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import fields
from functools import cached_property
from typing import Any, ClassVar

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point
from sitscad.kernels.geometry.shapes import SHAPES, Outline
from sitscad.spec.format.kinds import (
    PAIR_OF_COUNTS,
    Angle,
    Choice,
    FileName,
    InRow,
    Layers,
    Number,
    NumberOrList,
    Pair,
    Size,
    Special,
    Text,
    UnitValue,
    describe,
    refuse,
)
from sitscad.spec.format.section import ListOf, Part, Section, SpecValue, key

Trace = UnitValue("length", "1 um", "20 mm")
LayerTurns = Number(0.25, 200)
TURNS, INNER = "coil.turns", "coil.inner_diameter"
"""Keys of a coil's turns and inner diameter. A spec may write one in place of the other."""


def written_key(key: str | None, written: Container[str]) -> str | None:
    """Return the key of the spec that a finding about `key` should name.

    It is ``coil.inner_diameter`` if the spec states the inner diameter and omits `key`. Otherwise it is `key`.
    `written` are the keys that the spec has.
    """
    stood_for = {f"coil.{name}" for name in CoilSpec.stands_in[1]}
    return INNER if key in stood_for and key not in written and INNER in written else key


@record
class Sense(Choice):
    """Winding sense of a layer. Read as True for clockwise."""

    allowed: tuple[str, ...] = ("counter-clockwise", "clockwise")

    def read(self, value: Any) -> Any:
        """Return True for clockwise, False for counter-clockwise."""
        return super().read(value) == "clockwise"


@record
class Start(Choice):
    """Start and end of a four-sided spiral: corner or mid-side, read as True for mid-side."""

    allowed: tuple[str, ...] = ("corner", "mid-side")

    def read(self, value: Any) -> Any:
        """Return True for mid-side, False for corner."""
        return super().read(value) == "mid-side"


@record
class DrawnLayer:
    """The winding of a drawn coil on one copper layer. `number` is the layer's number, from 1 at the top.

    `path` follows the current, and its origin is the coil's centre. `outer_angle` (rad), `sense` and `inward` are as in
    `layout.board.Winding`.
    """

    number: int
    path: Path
    outer_angle: float
    sense: int
    inward: bool
    turns: float


@record
class DrawnPiece:
    """A track of a drawn coil: copper layer, path (origin at the coil's centre), width (m), and purpose.

    The purpose `role` is "winding", "stub" or "lead".
    """

    layer: int
    path: Path
    width: float
    role: str


@record
class DrawnHole:
    """A plated hole of a drawn coil: centre (m, from the coil's centre), drill diameter and pad diameter (m)."""

    centre: Point
    drill: float
    pad: float


@record
class DrawnTerminal:
    """The pad at one end of a drawn coil: centre (m, from the coil's centre), sides (m) and copper layer."""

    centre: Point
    size: tuple[float, float]
    layer: int


@record
class DrawnCopperCoil:
    """The copper of a coil that the user drew. The origin is the centre of its turns.

    * ``series``: tracks and holes from terminal to terminal, in the order of the current
    * ``deviation``: largest distance (m) between the drawn turns and the regular spiral that replaces them in estimates
    * ``heights``: (number, height of the mid-plane in m, thickness in m) of the board's copper layers. Empty if the
      file has no stack-up.
    """

    layers: tuple[DrawnLayer, ...]
    series: tuple[DrawnPiece | DrawnHole, ...]
    terminals: tuple[DrawnTerminal, DrawnTerminal]
    deviation: float
    heights: tuple[tuple[int, float, float], ...] = ()


Terminal = Text(64, r"\S+", "write the pad's name, like J1.1")
Net = Text(120, r"[^\n\r\t]+", "write the net's name, like COIL")


@record
class CoilSpec(Section):
    """One coil: all its layers are one conductor.

    * ``size``: (x, y) in m across the outer copper edges, across flats for polygons. Both are equal except for
      rectangle and racetrack.
    * ``layers``: numbers of the copper layers from 1 at the top, in winding order
    * ``turns``: one number for all layers, or one number for each
    * ``written_inner``: inner diameter in place of an omitted value. The value is ``turns``, ``trace_width`` or
      ``trace_spacing``. The resolver computes it and sets ``written_inner`` to None.
    * ``drawn``: file with the coil. The resolver takes all other values from the file, and ``copper`` is its copper.
    """

    stands_in: ClassVar[tuple[str, tuple[str, ...]]] = ("inner_diameter", ("turns", "trace_width", "trace_spacing"))
    alone: ClassVar[tuple[str, ...]] = ("drawn", "net", "from", "to")

    shape: str = key(Choice(tuple(SHAPES)), "outline of the turns")
    size: tuple[float, float] = key(
        Pair(Size, single=True),
        "across the outer copper edges (polygons: across flats); rectangle and racetrack: [x, y]",
        written="outer_diameter",
    )
    turns: float | tuple[float, ...] = key(
        NumberOrList(LayerTurns), "per layer; a list gives each its own, in the order of layers: [8, 7]", None
    )
    written_inner: tuple[float, float] | None = key(
        Pair(Size, single=True),
        "across the inner copper edges, in place of turns, trace_width or trace_spacing; rectangle and racetrack: the "
        "shorter side, or [x, y]", None, written="inner_diameter",
    )
    layers: tuple[int, ...] = key(Layers(), "copper layers in series: a count from the top, or a list like [1, 2]", 1)
    trace_width: float = key(Trace, "width of the trace", None)
    trace_spacing: float = key(Trace, "gap between neighbouring turns", None)
    start_angle: float = key(
        Angle, "angle of the outer end of layer 1 from +x, counter-clockwise, like 90 deg", "0 deg"
    )
    is_mid_side: bool = key(
        Start(), "of square and rectangle: a layer begins and ends at corners or in the middle of sides",
        "corner", written="start",
    )
    clockwise: bool = key(
        Sense(), "inward winding sense of layer 1, seen from the top", "counter-clockwise", written="sense",
    )
    corner_radius: float = key(UnitValue("length", "0 mm", "100 mm"), "of polygons; 0: mitred corners", 0)
    drawn: str | None = key(
        FileName("KiCad", r"\.kicad_(mod|pcb)$", "coil.kicad_mod"),
        "a KiCad footprint or board in the spec's folder with the finished coil; replaces all keys above", None,
    )
    net: str | None = key(Net, "of a drawn board: the coil's net, like COIL", None)
    start_pad: str | None = key(
        Terminal, "of a drawn coil: the pad at its start, like J1.1; default the net's two pads, of a footprint pads 1 "
        "and 2", None, written="from",
    )
    end_pad: str | None = key(Terminal, "of a drawn coil: the pad at its end", None, written="to")
    copper: DrawnCopperCoil | None = None

    @property
    def outline(self) -> Outline:
        """Outline of its shape."""
        return SHAPES[self.shape]

    @property
    def layer_turns(self) -> tuple[float, ...]:
        """Number of turns of each layer, in winding order."""
        return self.turns if isinstance(self.turns, tuple) else (self.turns,) * len(self.layers)

    @property
    def has_unequal_turns(self) -> bool:
        """Whether the number of turns is written for each layer."""
        return isinstance(self.turns, tuple)

    @property
    def most_turns(self) -> float:
        """Largest number of turns of a layer."""
        return max(self.layer_turns)

    @property
    def inset(self) -> float:
        """Distance (m) from the outer copper edge to the inner one, on the layer with most turns."""
        return self.outline.inset(self.trace_width, self.pitch, self.most_turns)

    @property
    def inner_size(self) -> tuple[float, float]:
        """Size (m) across the inner copper edges, as `size` is across the outer ones."""
        return self.size[0] - 2.0 * self.inset, self.size[1] - 2.0 * self.inset

    @property
    def inner_diameter(self) -> float:
        """The smaller side of `inner_size` (m)."""
        return min(self.inner_size)

    @property
    def turns_that_fit(self) -> float:
        """Largest number of turns of a layer that fits into the outline."""
        return self.outline.most_turns(self.size, self.trace_width, self.pitch)

    @property
    def turns_in_words(self) -> str:
        """Number of turns as text. If the layers have different numbers, the text lists all of them."""
        return ", ".join(f"{turns:g}" for turns in (self.layer_turns if self.has_unequal_turns else (self.turns,)))

    @property
    def pitch(self) -> float:
        """Trace width plus spacing, in metres."""
        return self.trace_width + self.trace_spacing

    @property
    def outer_diameter(self) -> float:
        """Outer size (m) across the copper edges. Rectangles and racetracks have none: read ``size``."""
        if self.size[0] != self.size[1]:
            raise AttributeError("outer_diameter")  # `Section.__getattr__` then says what to read
        return self.size[0]


class OwnCoil(CoilSpec):
    """Windings of the reference coil that differ from the windings of the other coils."""

    alone: ClassVar[tuple[str, ...]] = ()

# a reference coil cannot be drawn by the user
OwnCoil.keys = {name: declared for name, declared in CoilSpec.keys.items() if name not in CoilSpec.alone}
OwnCoil.attributes = {name: CoilSpec.attributes[name] for name in OwnCoil.keys}


def _coil_of(written: OwnCoil) -> CoilSpec:
    return CoilSpec(**{each.name: getattr(written, each.name) for each in fields(CoilSpec)})


@record
class CoilPlacement:
    """Position of one coil: name, centre (m), rotation (rad, counter-clockwise).

    ``own`` is the coil if it differs from the array's other coils, as a reference coil may. Otherwise it is None.
    """

    name: str
    centre: tuple[float, float]
    rotation: float = 0.0
    own: CoilSpec | None = None


@record
class Reference(Section):
    """A further coil that no target covers, with the channel after all other coils."""

    offset: tuple[float, float] | None = key(
        Pair(UnitValue("length", "-1000 mm", "1000 mm")),
        "[x, y] of its centre from the mean of the other coils' centres; default: towards the tail, 0.5 mm from "
        "the next coil and half a coil from target and elastomer", None,
    )
    coil: CoilSpec | None = key(
        Part(OwnCoil, _coil_of), "its windings; default the windings of the other coils", None,
    )


@record
class ArraySpec(SpecValue):
    """The coils of the sensor, in the order of the converter's channels, from the far end of the jaw to the tail.

    `placements` leaves out the reference coil. `SensorSpec.all_placements` has it as the last placement.
    """

    read_instead: ClassVar[dict[str, str]] = {
        "count": "len(spec.array.placements)",
        "centres": "spec.array.placements[0].centre",
        "rotations": "spec.array.placements[0].rotation",
    }

    pattern: str
    placements: tuple[CoilPlacement, ...]
    pitch: float | None = None
    reference: Reference | None = None

    @cached_property
    def middle(self) -> tuple[float, float]:
        """Mean of the coils' centres (m). Target and elastomer are centred there unless they have an offset."""
        x, y = (math.fsum(place.centre[axis] for place in self.placements) / len(self.placements) for axis in (0, 1))
        return x, y

    @property
    def is_in_line(self) -> bool:
        """Whether all coils lie on the x axis, without rotation. Their leads can then run in lanes along this axis."""
        return all(abs(placement.centre[1]) < 1e-9 and not placement.rotation for placement in self.placements)

    @property
    def distance_key(self) -> str:
        """Key of the spec that sets the distance between coils. For a single coil, the key of its size."""
        keys = {"single": "coil.outer_diameter", "explicit": "array.centres"}
        return keys.get(self.pattern, "array.pitch")


def _count(value: Any) -> tuple[int, ...]:
    entries = value if isinstance(value, list) else [value]
    if len(entries) not in (1, 2):
        refuse("SIT004", f"{describe(value)}, where a number or [nx, ny] is wanted", "write 2, or [2, 2] for a grid")
    return tuple(int(InRow.read(entry)) for entry in entries)


class ArrayDocument(Section):
    """The coils of the sensor, x along the jaw; C1 is the far one, the tail leaves at +x."""

    pattern: str | None = key(
        Choice(("single", "line", "triangle", "grid", "explicit")),
        "arrangement of the coils; default by the other keys: explicit with centres, grid with a count of [nx, ny], "
        "line with a count or a pitch, else single", None,
    )
    count: tuple[int, ...] | None = key(
        Special(_count, {"anyOf": [InRow.schema(), PAIR_OF_COUNTS]}),
        "line: a number; grid: [nx, ny], numbered up each column, the far column first; default 2 or [2, 2]", None,
    )
    pitch: float | None = key(
        UnitValue("length", "0.1 mm", "1000 mm"),
        "distance of neighbouring centres; default for a gap of 0.5 mm between coils", None,
    )
    centres: list[tuple[float, float]] | None = key(
        ListOf(Pair(UnitValue("length", "-1000 mm", "1000 mm"))),
        "explicit: [x, y] of every coil, in the order of the converter's channels; the tail leaves at their mean's y",
        None,
    )
    rotations: list[float] | None = key(
        ListOf(Angle),
        "explicit: rotation of each coil, counter-clockwise, in the same order, like [0 deg, 90 deg]; default 0", None,
    )
    reference: Reference | None = key(
        Part(Reference), "a coil that no target covers, read in the same scan, like reference: {}", None)
