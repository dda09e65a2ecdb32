"""What is asked for: the sensor as frozen values in SI units, presets resolved, defaults filled in.

Lengths are metres, angles radians; x runs along the jaw to the handle, y across it, z up from the board's top face.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from typing import Any, cast, overload

from sitscad.geometry.shapes import SHAPES, Outline
from sitscad.record import record
from sitscad.spec.converter import Converter
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.issue import Issue
from sitscad.spec.materials import Adhesive, Conductor, ElastomerMaterial
from sitscad.spec.source import SpecSource
from sitscad.spec.stackup import CopperLayer, Stackup


@record
class CoilSpec:
    """One coil: all its copper layers in series, one conductor and one net.

    ``size`` is measured across the outer copper edges (polygons: across flats), equal in x and y except for rectangle
    and racetrack. ``layers`` are copper layer numbers from 1 at the top, in winding order; ``turns`` is one number for
    all of them, or those of each.
    """

    shape: str
    size: tuple[float, float]
    turns: float | tuple[float, ...]
    layers: tuple[int, ...]
    trace_width: float
    trace_spacing: float
    start_angle: float = 0.0
    clockwise: bool = False
    corner_radius: float = 0.0

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return SHAPES[self.shape]

    @property
    def layer_turns(self) -> tuple[float, ...]:
        """The turns of each layer, in winding order."""
        return self.turns if isinstance(self.turns, tuple) else (self.turns,) * len(self.layers)

    @property
    def has_unequal_turns(self) -> bool:
        """Whether its layers' turns are written one by one."""
        return isinstance(self.turns, tuple)

    @property
    def most_turns(self) -> float:
        """Turns of the layer that has most."""
        return max(self.layer_turns)

    @property
    def turns_in_words(self) -> str:
        """The turns for people: one number, or those of every layer."""
        return ", ".join(f"{turns:g}" for turns in (self.layer_turns if self.has_unequal_turns else (self.turns,)))

    @property
    def pitch(self) -> float:
        """Trace width plus spacing, in metres."""
        return self.trace_width + self.trace_spacing

    @property
    def outer_diameter(self) -> float:
        """The smaller outer size in metres (the diameter, for round and regular shapes)."""
        return min(self.size)


@record
class CoilPlacement:
    """Where one coil of the array stands: name, centre (m), rotation (rad, counter-clockwise)."""

    name: str
    centre: tuple[float, float]
    rotation: float = 0.0


@record
class ArraySpec:
    """The coils of the sensor, in the order of the converter's channels, from the far end of the jaw to the tail."""

    pattern: str
    placements: tuple[CoilPlacement, ...]
    pitch: float | None = None

    @property
    def middle(self) -> tuple[float, float]:
        """The mean of the coils' centres (m): target and elastomer stand over it unless they are offset."""
        x, y = (math.fsum(place.centre[axis] for place in self.placements) / len(self.placements) for axis in (0, 1))
        return x, y


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

    def contacts_for(self, needed: int) -> int:
        """The fewest contacts that it is made with and that are enough; just those where it has none so many."""
        return min((count for count in self.positions if count >= needed), default=needed)

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


@record
class Tail:
    """The strip that leads to the converter: length in metres along its middle, its connector, its copper layers and
    how it bends.

    ``turn`` is how it turns in its plane before the contacts, seen from the top and from the coils: ``none``, ``left``
    or ``right`` (by 90 degrees); ``offset`` (m, to the left) how far it is led aside instead; ``turn_radius`` (m) that
    of its inner edge. It bends about a line across it, whose distance from the body is ``bend_at`` (m; None: the middle
    of the stretch that may be bent), ``down`` (away from the face with the coils) or ``up``, by an angle (rad) at an
    inside radius (m; None: the fabricator's least). ``contacts`` is how many the connector has, None where it is the
    fewest that are enough; ``stiffener`` (m, with its adhesive) is None where the stock one is taken that fits best.
    """

    length: float
    connector: Connector
    layers: int
    bend: str
    turn: str = "none"
    offset: float = 0.0
    turn_radius: float = 2e-3
    bend_at: float | None = None
    bend_direction: str = "down"
    bend_angle: float = math.pi / 2
    bend_radius: float | None = None
    contacts: int | None = None
    stiffener: float | None = None


MOST_PARTS = 500
"""Boards on one panel: every copy is drawn out in full (about 50 kB of Gerber each), and nobody cuts more by hand."""


@record
class PanelSpec:
    """How parts are delivered: ``wish`` is ``auto`` (in a panel if too small to be made singly), ``none``, ``always``.

    ``parts`` are columns and rows (None: as many as fit the fabricator's panel); ``gap`` is between parts, ``rail`` the
    frame's width, ``bridge`` the width of what holds a part, all in metres.
    """

    wish: str = "auto"
    parts: tuple[int, int] | None = None
    gap: float = 2e-3
    rail: float = 5e-3
    bridge: float = 0.5e-3


@record
class FpcSpec:
    """The flexible printed circuit: stack-up, the fabricator's rules, the tail (none: solder pads at the outline).

    ``panel`` says how parts are delivered, ``finish`` what is on the bare contacts (a row of the finishes' data),
    ``copper`` is ``rolled-annealed`` or ``electrodeposited``, ``teardrops`` is ``auto`` or ``none``; ``boards`` is how
    many are wanted, None where the order says so; ``margin`` (m, along and across) is what the body is larger by on
    each side than coils and leads need it.
    """

    stackup: Stackup
    rules: DesignRules
    tail: Tail | None
    panel: PanelSpec = PanelSpec()
    finish: str = "enig"
    copper: str = "rolled-annealed"
    teardrops: str = "none"
    boards: int | None = None
    margin: tuple[float, float] = (0.0, 0.0)


@record
class Target:
    """The conducting plate over the coils: size [x, y], thickness and kerf (0: drawn as it is) in metres.

    ``offset`` (m, along and across) is from the mean of the coils' centres, ``rotation`` (rad, counter-clockwise) how
    it is turned about its own centre at rest.
    """

    shape: str
    size: tuple[float, float]
    thickness: float
    material: Conductor
    kerf: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0


@record
class ElastomerPad:
    """The soft pad between board and target: size [x, y], thickness, laser kerf and offset from the mean of the coils'
    centres in metres.
    """

    material: ElastomerMaterial
    shape: str
    size: tuple[float, float]
    thickness: float
    kerf: float
    offset: tuple[float, float] = (0.0, 0.0)


@record
class Encapsulation:
    """The film that seals the sensor against tissue: thickness in metres."""

    material: ElastomerMaterial
    thickness: float


@record
class Jaw:
    """One jaw of a grasper: the face that carries the sensor and the metal behind it.

    ``height`` is that of one jaw, face to back; ``port_diameter`` is the circle that the closed pair must pass.
    ``face`` (m) is the flat's true width where it is measured, None where it is the chord of a back as round as the
    port. In a jaw with a pad pocket the face is the pocket's floor, ``pocket`` its length and width, and the rims
    beside it stand ``recess`` above it. ``hinge`` is from the face's heel to the pivot, ``opening`` (rad) the angle
    between the faces when wide open; ``fenestration`` is the length and width of a window through the face.
    """

    name: str
    width: float
    length: float
    height: float
    port_diameter: float
    material: Conductor
    opposing_pad_thickness: float = 0.0
    source: str = ""
    face: float | None = None
    recess: float = 0.0
    pocket: tuple[float, float] | None = None
    hinge: float | None = None
    opening: float | None = None
    fenestration: tuple[float, float] | None = None


@record
class Mount:
    """What carries the sensor: ``standoff`` is from the metal's face to the board's bottom face (m), ``process`` how
    its pieces are made (resin, powder, filament, machined).
    """

    kind: str
    jaw: Jaw | None
    standoff: float
    process: str = "resin"


@record
class Assembly:
    """How the pieces are put together: what they are glued with, the thickness of each glue line (m) and its
    tolerance (m), and tolerances (m) of parts by name that go before those of their process.
    """

    adhesive: Adhesive | None = None
    glue_line: float = 0.0
    glue_tolerance: float = 0.0
    tolerances: tuple[tuple[str, float], ...] = ()

    def tolerance(self, part: str) -> float | None:
        """The tolerance (m) that the spec gives a part; None where it leaves it to the part's process."""
        return dict(self.tolerances).get(part)


@record
class Shield:
    """A sheet between coil and jaw: ``gap`` is from the board's bottom face to the sheet (m)."""

    material: Conductor
    thickness: float
    gap: float


@record
class Cable:
    """The wires between tail and converter, per conductor pair and for the whole length."""

    length: float
    inductance: float
    capacitance: float
    resistance: float


@record
class ReadoutSpec:
    """The converter; ``capacitance`` in farads (None: chosen), ``scan_rate`` is complete scans of all coils per s.

    ``drive_code`` (0 to 31) is None where it is chosen; ``chip`` is the land pattern of the tank capacitors on the
    tail's stiffener, None where they are elsewhere.
    """

    device: Converter
    capacitance: float | None
    capacitor_at: str
    cable: Cable | None
    clock: float
    scan_rate: float
    chip: Chip | None = None
    drive_code: int | None = None


@record
class Requirements:
    """What the sensor must bear and follow: forces in newtons, bandwidth in hertz, temperature in degrees Celsius."""

    normal_force: float | None = None
    shear_force: float | None = None
    bandwidth: float | None = None
    temperature: float = 20.0


@record
class SensorSpec:
    """The whole design; parts that are None are not in the sensor, are not made and not checked."""

    name: str
    coil: CoilSpec
    array: ArraySpec
    fpc: FpcSpec
    target: Target | None
    elastomer: ElastomerPad | None
    encapsulation: Encapsulation | None
    mount: Mount | None
    shield: Shield | None
    readout: ReadoutSpec
    requirements: Requirements
    source: SpecSource
    issue: Issue = Issue()
    assembly: Assembly = Assembly()

    @property
    def coil_copper(self) -> tuple[CopperLayer, ...]:
        """The copper layers that the coil is wound on, in winding order, with their heights."""
        copper = self.fpc.stackup.copper
        return tuple(copper[number - 1] for number in self.coil.layers)

    @classmethod
    def from_mapping(cls, sections: Mapping[str, Any] | None = None, /, **named: Any) -> SensorSpec:
        """The sensor that sections say in dictionaries, or as keywords: keys and values as in YAML.

        Bare numbers for lengths are millimetres, other quantities are texts with their unit; what is left out takes its
        default, ``sitscad`` (the version of the format) too. Numbers of numpy serve as well. The spec's text is the
        same in YAML.

        Raises
        ------
        SpecError
            with a finding for each value that is not right, as of a file; it names the key.

        >>> from sitscad import SensorSpec
        >>> coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2,
        ...         "trace_width": "100 um", "trace_spacing": "100 um"}
        >>> SensorSpec.from_mapping(name="bench", coil=coil).coil.outer_diameter
        0.007
        """
        return cast(SensorSpec, _changing().from_mapping({**(sections or {}), **named}))

    @overload
    def replace(self, key: str, value: Any, /) -> SensorSpec: ...

    @overload
    def replace(self, changes: Mapping[str, Any], /) -> SensorSpec: ...

    def replace(self, key: str | Mapping[str, Any], value: Any = None, /) -> SensorSpec:
        """The sensor with another value at a dotted key, or with several at once: keys and values as in YAML.

        ``spec.replace("coil.turns", 7.5)``, ``spec.replace({"coil.turns": 8, "coil.outer_diameter": "9 mm"})``; entries
        of lists are counted from 0 (``array.centres.1``), sections may be given whole, and None takes a key out. The
        change is made in the spec's text, whose comments stay as long as values are changed and not whole sections.

        Raises
        ------
        SpecError
            where there is no such key or the value is not right, as of a file; and where values were changed past the
            text before (`dataclasses.replace`), which would undo them.
        """
        changes = key if isinstance(key, Mapping) else {key: value}
        return cast(SensorSpec, _changing().replaced(self, changes))

    @property
    def is_known(self) -> bool:
        """Whether it is just as it was read and resolved, and so is known to be right."""
        return "_known" in self.__dict__

    def known(self, source: SpecSource) -> SensorSpec:
        """The same, read from a source, and known to be right: for what resolves specs alone."""
        found = replace(self, source=source)
        found.__dict__["_known"] = True  # no field: what `dataclasses.replace` makes of it has to be looked at anew
        return found


def _changing() -> Any:
    """What makes and changes specs: it reads them, and so knows this module already."""
    return import_module("sitscad.spec.changing")


def without_text(spec: SensorSpec) -> SensorSpec:
    """The spec's values alone: comments and file name gone, so that what is drawn cannot depend on them."""
    return replace(spec, source=SpecSource("", "", defaults=spec.source.defaults))
