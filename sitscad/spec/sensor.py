"""The sensor: declaration of the spec's keys, and the read-only values in SI units with presets and defaults filled in.

Lengths are metres, angles radians. Axis x runs along the jaw to the handle, y across the jaw, and z upwards from the
board's top face. Defaults in the declarations have the form of a spec: a bare number is a length in millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, cast, overload

from sitscad.basics.record import record, replace, with_frozen_mappings
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.geometry.convex import Box, Footprint
from sitscad.kernels.geometry.path import Path, Point, bounding_box
from sitscad.spec.circuit import Chip, CopperLayer, FpcSpec
from sitscad.spec.coil import ArrayDocument, ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.format.kinds import (
    Choice,
    Either,
    Number,
    Pair,
    Preset,
    Rate,
    RunLength,
    Size,
    Special,
    Text,
    UnitValue,
    describe,
    refuse,
)
from sitscad.spec.format.section import NameOr, Part, Section, SpecValue, key, schema_of
from sitscad.spec.load_cases import Force, LoadCase, LoadsDocument
from sitscad.spec.materials import CellsSpec, Conductor, Cutting, ElastomerPad, Encapsulation, Shield, Target
from sitscad.spec.mount import Assembly, Jaw, Mount
from sitscad.spec.thermistor import CompensationSpec, Thermistor
from sitscad.spec.yaml.source import Issue, SpecSource


@record
class Cable(Section):
    """The wires between tail and converter. Electrical figures are per conductor pair, for the whole length.

    Omitted values are None until the resolver computes them from the length.
    """

    length: float = key(RunLength, "of the cable", 300)
    inductance: float = key(
        UnitValue("inductance", "0 nH", "1 mH"),
        "of one pair, whole length, like 180 nH; default 600 nH a metre: measure yours", None,
    )
    capacitance: float = key(
        UnitValue("capacitance", "0 pF", "1 uF"),
        "of one pair, whole length, like 30 pF; default 100 pF a metre: measure yours", None,
    )
    resistance: float = key(
        UnitValue("resistance", "0 ohm", "1 kohm"),
        "of one pair, both conductors, like 0.3 ohm; default 1 ohm a metre: measure yours", None,
    )


@record
class ReadoutSpec(Section):
    """The converter that reads the coils.

    ``capacitance`` and ``drive_code`` are None if sitscad chooses them. ``chip`` is the land pattern of the tank
    capacitors. It is None unless the capacitors are on the tail's stiffener. ``capacitor_at`` is None until the
    resolver sets it.
    """

    device: Converter = key(Preset("converter", up=True), "the converter", "ldc1614")
    capacitance: float | None = key(
        Either("auto", UnitValue("capacitance", "1 pF", "1 uF")),
        "of the tank, like 330 pF; auto: sitscad chooses it and gives the reasons", "auto",
    )
    capacitor_at: str = key(
        Choice(("coil", "converter")), "where the tank capacitors are soldered; default converter, or coil with "
        "capacitors_on_board", None
    )
    chip: Chip | None = key(
        Preset("chip", up=True), "chip size of the capacitors on the tail's stiffener; none if left out", None,
        written="capacitors_on_board",
    )
    cable: Cable | None = key(
        Part(Cable), "cable between tail and converter; if left out, the tail plugs into the converter's board", None,
    )
    clock: float = key(UnitValue("frequency", "100 kHz", "1 GHz"), "reference clock", "40 MHz")
    scan_rate: float = key(Rate, "complete scans of all coils per second", "100 Hz")
    drive_code: int | None = key(
        Either("auto", Number(0, 31, whole=True)),
        "of all channels; auto: the strongest with an amplitude one standard deviation below the maximum", "auto",
    )
    buses: int = key(Number(1, 2, whole=True), "I2C buses of the controller, each for two converters", 1)
    thermistor: Thermistor | None = key(Part(Thermistor), "temperature sensor, which takes off the drift", None)
    compensation: CompensationSpec | None = key(Part(CompensationSpec), "of the drift, by the temperature", None)


VERSION = 1
Temperature = UnitValue("temperature", "-60 degC", "200 degC")
Resolution = UnitValue("force", "1 uN", "10 kN")
Moment = UnitValue("moment", "0.001 mN mm", "1000 N m")
LONGEST_NAME = 64
"""Largest number of characters in a sensor's name."""


def _version(value: Any) -> int:
    if isinstance(value, bool) or value != VERSION or not isinstance(value, int):
        message = f"{describe(value)} is no version of the format that is known here"
        refuse("SIT008", message, f"write sitscad: {VERSION}")
    return VERSION


def _temperature_range(value: Any) -> tuple[float, float]:
    """Return the lowest and highest temperature (degC). The entries of `value` are bare numbers or texts with units."""
    if not isinstance(value, list) or len(value) != 2:
        message = f"{describe(value)}, where [lowest, highest] is wanted"
        refuse("SIT004", message, "write degrees Celsius, like [15, 45]")
    low, high = (
        Temperature.read(entry if isinstance(entry, (str, bool)) or entry is None else f"{entry} degC")
        for entry in value
    )
    if low > high:
        message = f"the first temperature, {low:g} degC, is above the second, {high:g} degC"
        refuse("SIT006", message, "write the lower temperature first")
    return low, high


TemperatureRange = Special(
    _temperature_range,
    {"type": "array", "items": {"anyOf": [{"type": "number"}, Temperature.schema()]}, "minItems": 2, "maxItems": 2},
    Temperature,
)


@record
class TiltErrors(Section):
    """Largest allowed error due to a tilt of the contact, axis by axis."""

    normal: float | None = key(Resolution, "of the normal force, like 100 mN", None)
    shear_x: float | None = key(Resolution, "of shear along x", None)
    shear_y: float | None = key(Resolution, "of shear along y", None)
    moment_x: float | None = key(
        Moment, "of the moment about x, without the moment of the tilt itself, like 0.5 N mm", None,
    )
    moment_y: float | None = key(Moment, "of the moment about y, without the moment of the tilt itself", None)

    def written(self) -> dict[str, float]:
        """Return the error limits that the spec states (N, and N m for moments), by axis."""
        return {name: value for name, value in self.values().items() if value is not None}


@record
class Requirements(Section):
    """Loads that the sensor must bear and measure, with the required accuracy.

    SI units: newtons, newton metres, metres, hertz and radians. Temperatures are in degrees Celsius. Resolutions are
    one standard deviation of the noise. Errors without a unit are fractions of full scale.
    """

    normal_force: float | None = key(Force, "that the sensor must bear, like 4.8 N", None)
    shear_force: float | None = key(Force, "that the sensor must bear, like 1 N", None)
    moment_x: float | None = key(
        Moment, "about x, that the sensor must bear and measure, like 5 N mm. The target is free to tilt; the moment "
        "is about the middle of its outermost face. The array then measures it in place of shear along y", None,
    )
    moment_y: float | None = key(Moment, "as moment_x, but about y and in place of shear along x", None)
    contact: tuple[float, float] | None = key(
        Pair(Size, single=True),
        "of the body that presses the target's middle: a diameter, or [x, y], like 8; default: all of the target under "
        "a jaw's face, else a fingertip of 10 mm", None,
    )
    bandwidth: float | None = key(Rate, "of the force signal, like 100 Hz", None)
    temperature: float = key(Temperature, "of the sensor in use: copper and metal are computed there, pads at "
                             "20 degC", "20 degC")
    normal_resolution: float | None = key(
        Resolution, "standard deviation of noise at the scan rate, at every working point, like 20 mN", None
    )
    shear_resolution: float | None = key(Resolution, "as normal_resolution, for each shear axis", None)
    moment_resolution: float | None = key(Moment, "as normal_resolution, for each moment, like 0.1 N mm", None)
    normal_error: float | None = key(
        Resolution, "standard deviation of all errors together at full load, like 0.5 N. The unit is calibrated and "
        "tared before each grasp, as in the data sheet. If left out, normal_resolution is the limit", None
    )
    shear_error: float | None = key(Resolution, "as normal_error, for each shear axis", None)
    moment_error: float | None = key(Moment, "as normal_error, for each moment, like 1 N mm", None)
    crosstalk: float | None = key(
        Number(0, 10), "error of an axis by the full scale of another axis, as a fraction of its own full scale, with "
        "the best polynomial in the readings", None
    )
    tilt: float | None = key(
        UnitValue("angle", "0 deg", "15 deg"),
        "largest tilt of the contact, like 2 deg. If left out, errors together have a tilt of 1 deg", None,
    )
    tilt_error: float | TiltErrors | None = key(
        NameOr(Resolution, Part(TiltErrors)),
        "largest error by this tilt on the required axes of force, like 100 mN; or axis by axis", None,
    )
    friction_error: float | None = key(
        Number(0, 10), "of the ratio of shear to normal force at full load: 0.05 shows slip on tissue", None
    )
    temperature_range: tuple[float, float] | None = key(
        TemperatureRange, "lowest and highest temperature of use after a tare, degrees Celsius, like [15, 45]", None
    )
    temperature_error: float | None = key(
        Resolution, "largest drift on any axis of force within temperature_range, like 0.5 N", None
    )

    @property
    def moments(self) -> tuple[float, float]:
        """Required moments (N m) about x and y, 0 if not required."""
        return self.moment_x or 0.0, self.moment_y or 0.0

    @property
    def is_shear_accuracy_required(self) -> bool:
        """Whether the spec requires a resolution or error of shear, or an error due to friction."""
        return any(each is not None for each in (self.shear_resolution, self.shear_error, self.friction_error))

    def tilt_limits(self) -> dict[str, float]:
        """Return the largest allowed error due to tilt (N, and N m for moments), by axis. Empty if not required.

        If the spec states a single value, it is the limit for each axis of force.
        """
        if isinstance(self.tilt_error, TiltErrors):
            return self.tilt_error.written()
        if self.tilt_error is None:
            return {}
        is_shear = self.shear_force is not None or self.is_shear_accuracy_required
        is_normal = any(each is not None for each in (self.normal_force, self.normal_resolution, self.normal_error))
        names = ["normal"] * (is_normal or not is_shear) + ["shear_x", "shear_y"] * is_shear
        return dict.fromkeys(names, self.tilt_error)


@record
class ArtworkSpec:
    """The parts of a sensor that determine its board's artwork.

    `chip` is the land pattern of tank capacitors on the tail, and `thermistor` the soldered temperature sensor. Each is
    None if the board does not carry the part.
    """

    coil: CoilSpec
    array: ArraySpec
    fpc: FpcSpec
    jaw: Jaw | None
    chip: Chip | None
    thermistor: Thermistor | None

    @property
    def wires(self) -> int:
        """Number of contacts that coils and thermistor use."""
        return 2 * len(self.array.placements) + 2 * (self.thermistor is not None)

    @property
    def coil_copper(self) -> tuple[CopperLayer, ...]:
        """Copper layers of the coil, in winding order, with their heights."""
        copper = self.fpc.stackup.copper
        return tuple(copper[number - 1] for number in self.coil.layers)

    @property
    def body_outline(self) -> Path | None:
        """Outline (closed, counter-clockwise) that the spec states for the board's body. None if there is none."""
        return None if self.fpc.body is None else self.fpc.body.edge.shifted(*self.array.middle)

    @property
    def body_box(self) -> Box | None:
        """Box (m) of the body's outline in the spec. None if coils and leads determine the size."""
        outline = self.body_outline
        return None if outline is None else bounding_box([outline])


BESIDE_COIL = 0.5e-3  # Gap (m) between the reference coil and the next coil, unless the spec gives its offset


@record
class SensorSpec(SpecValue):
    """The whole design. Parts that are None are not in the sensor, and are neither made nor checked."""

    read_instead: ClassVar[dict[str, str]] = {
        "revision": "spec.issue.revision",
        "part_number": "spec.issue.part_number",
        "date": "spec.issue.date",
    }

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
    assembly: Assembly = Assembly(None, 0.0, 0.0)
    cutting: Cutting = Cutting()
    loads: tuple[LoadCase, ...] = ()
    cells: CellsSpec | None = None

    def __repr__(self) -> str:
        """Return a single line. All fields would be tens of thousands of characters."""
        return f"<SensorSpec {self.name}: {len(self.array.placements)} x {self.coil.shape}>"

    @property
    def artwork(self) -> ArtworkSpec:
        """The parts that determine the board's artwork."""
        array = replace(self.array, placements=self.all_placements, reference=None)
        return ArtworkSpec(self.coil, array, self.fpc, self.jaw, self.readout.chip, self.soldered_thermistor)

    @property
    def soldered_thermistor(self) -> Thermistor | None:
        """Temperature sensor with pads on the flexible board. None if there is none, or if the user drew the board."""
        sensor = self.readout.thermistor
        return sensor if sensor is not None and sensor.is_soldered and self.coil.copper is None else None

    @property
    def coil_copper(self) -> tuple[CopperLayer, ...]:
        """Copper layers of the coil, in winding order, with their heights."""
        return self.artwork.coil_copper

    @property
    def jaw(self) -> Jaw | None:
        """The jaw of the mount. None if there is no jaw."""
        return None if self.mount is None else self.mount.jaw

    @property
    def body_outline(self) -> Path | None:
        """Outline (closed, counter-clockwise) that the spec states for the board's body. None if there is none."""
        return self.artwork.body_outline

    @property
    def cell_placements(self) -> tuple[tuple[CoilPlacement, ...], ...]:
        """Placements of the coils, cell by cell. If there are no cells, all coils form one group."""
        placements = self.array.placements
        count = len(placements) if self.cells is None else self.cells.coils
        return tuple(placements[k : k + count] for k in range(0, len(placements), count))

    @cached_property
    def reference_placement(self) -> CoilPlacement | None:
        """Placement of the reference coil. None if there is no reference coil."""
        if self.array.reference is None:
            return None
        (x, y), offset = self.array.middle, self.array.reference.offset
        place = (self._beyond_plates, y) if offset is None else (x + offset[0], y + offset[1])
        return CoilPlacement(f"C{len(self.array.placements) + 1}", place, own=self.array.reference.coil)

    @property
    def reference_coil(self) -> CoilSpec:
        """Windings of the reference coil: its own, or the windings of the other coils."""
        return (self.array.reference and self.array.reference.coil) or self.coil

    @property
    def _beyond_plates(self) -> float:
        """Default x (m) of the reference coil: beyond coils, target and elastomer, towards the tail.

        It is rounded up to 10 um. The reference coil's edge is 0.5 mm from the next coil, and half a coil from the
        plates.
        """
        own, ends = self.reference_coil, list[float]()
        boundary, reference = (coil.outline.boundary(coil.size, 0.0) for coil in (self.coil, own))
        for place in self.array.placements:
            ends.append(place.centre[0] + bounding_box([boundary.rotated(place.rotation)])[2] + BESIDE_COIL)
        for cell in self.cell_placements:
            middle = math.fsum(place.centre[0] for place in cell) / len(cell)
            for plate in (self.target, self.elastomer):
                if plate is None:
                    continue
                rotation, (x, y) = plate.rotation if isinstance(plate, Target) else 0.0, plate.offset
                box = Footprint(plate.outline.is_disc, plate.size, Point(middle + x, y), rotation).box
                ends.append(box[2] + 0.5 * min(own.size))
        return math.ceil((max(ends) - bounding_box([reference])[0]) * 1e5 - 1e-6) * 1e-5

    @property
    def all_placements(self) -> tuple[CoilPlacement, ...]:
        """Placements of all coils on the board: the array's, then the reference coil's."""
        reference = self.reference_placement
        return self.array.placements if reference is None else (*self.array.placements, reference)

    @property
    def web(self) -> float | None:
        """Width (m) of the webs that join the pads of neighbouring cells. None if there are no webs."""
        return None if self.cells is None else self.cells.web

    @property
    def metal(self) -> Conductor | None:
        """The metal behind the coils. None if there is no metal."""
        return None if self.mount is None else self.mount.metal

    @classmethod
    def from_mapping(cls, sections: Mapping[str, Any] | None = None, /, **named: Any) -> SensorSpec:
        """Return the sensor that mappings of keys to values describe, with keys and values as in YAML.

        Parameters
        ----------
        sections
            The sections of a spec by name.
        **named
            Sections by keyword. They take precedence over `sections`.

        Returns
        -------
        SensorSpec
            The spec read from the same text in YAML. Omitted keys take their defaults. ``sitscad`` (the version of
            the format) may be omitted as well.

        Raises
        ------
        SpecError
            With a finding for each invalid value, which names its key.

        Notes
        -----
        Bare numbers for lengths are millimetres. Other quantities are texts with units. Numbers of numpy are accepted.

        Examples
        --------
        >>> from sitscad import SensorSpec
        >>> coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2,
        ...         "trace_width": "100 um", "trace_spacing": "100 um"}
        >>> SensorSpec.from_mapping(name="bench", coil=coil).coil.outer_diameter
        0.007
        """
        load = import_module("sitscad.spec.load")  # imported here because it imports this module
        return cast(SensorSpec, load.from_mapping({} if sections is None else sections, named))

    @overload
    def replace(self, key: str, value: Any, /) -> SensorSpec: ...

    @overload
    def replace(self, changes: Mapping[str, Any], /) -> SensorSpec: ...

    def replace(self, key: str | Mapping[str, Any], value: Any = None, /) -> SensorSpec:
        """Return the sensor with another value at a dotted key, or with other values at several keys.

        Parameters
        ----------
        key
            A key as in YAML (``coil.turns``), or a mapping of keys to values. Entries of lists count from 0
            (``array.centres.1``).
        value
            A number in SI units, as attributes give it (metres, radians, newtons), or a text with its unit
            (``"9 mm"``). A section may be a mapping. A preset may be its name, or the record that an attribute gives.
            None takes the key out.

        Returns
        -------
        SensorSpec
            The spec read from the changed text. Comments stay if values are changed and not whole sections.

        Raises
        ------
        SpecError
            If there is no such key, or the value is not right. Also if values were changed past the text before
            (`dataclasses.replace`), because the change would undo them.

        Examples
        --------
        >>> from sitscad import SensorSpec
        >>> coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2,
        ...         "trace_width": "100 um", "trace_spacing": "100 um"}
        >>> spec = SensorSpec.from_mapping(name="bench", coil=coil)
        >>> spec.replace("coil.outer_diameter", 1.2 * spec.coil.outer_diameter).coil.outer_diameter
        0.0084
        >>> spec.replace({"coil.outer_diameter": "9 mm", "coil.turns": 8}).coil.turns
        8.0
        """
        changes = tuple(key.items()) if isinstance(key, Mapping) else ((key, value),)
        return cast(SensorSpec, import_module("sitscad.spec.load").replaced(self, changes))

    @property
    def is_known(self) -> bool:
        """Whether the spec is unchanged since it was read and resolved, and is therefore valid."""
        return "_known" in self.__dict__

    def known(self, source: SpecSource) -> SensorSpec:
        """Return the spec marked as valid, with its source. Only code that resolves specs may call this."""
        rules = with_frozen_mappings(self.fpc.rules)
        fpc = self.fpc if rules is self.fpc.rules else replace(self.fpc, rules=rules)
        marked = replace(self, source=with_frozen_mappings(source), fpc=fpc)
        marked.__dict__["_known"] = True  # not a field, so that copies by `dataclasses.replace` are checked again
        return marked


def without_text(spec: SensorSpec) -> SensorSpec:
    """Return the spec's values and the bytes of its STEP files, but without comments and file name.

    Drawings depend on the former alone.
    """
    files = spec.source.files.items()
    solids = {name: content for name, content in files if name.lower().endswith((".step", ".stp"))}
    return replace(spec, source=SpecSource("", "", defaults=spec.source.defaults, files=solids))


_PRINTED = "([A-Za-z0-9]([A-Za-z0-9 ._/+#:()-]*[A-Za-z0-9+#)])?)?"
_PRINTED_WORDS = "letters, digits, spaces and . _ / + # : ( ) -, a letter or digit first"


class SpecDocument(Section):
    """A sensor. Each file contains one spec."""

    is_whole: ClassVar[bool] = True

    sitscad: int = key(Special(_version, {"const": VERSION}), "version of this format")
    name: str = key(
        Text(
            LONGEST_NAME, r"(?!(con|prn|aux|nul|com\d|lpt\d)(\.|$))[a-z0-9]([a-z0-9._-]*[a-z0-9_-])?",
            "small letters, digits, '.', '_' and '-'; a letter or digit first, no '.' last, and no name that Windows "
            "reserves (con, nul, aux, lpt1, ...)",
        ),
        "names the outputs",
    )
    revision: str = key(
        Text(16, _PRINTED, _PRINTED_WORDS), "of the design, like B or 1.2 in quotes: printed on every document", ""
    )
    part_number: str = key(
        Text(32, _PRINTED, _PRINTED_WORDS), "your number for the sensor: printed on every document", "",
    )
    date: str = key(
        Text(20, _PRINTED, _PRINTED_WORDS),
        "of the revision, like 2026-11-22: printed on every document; default SOURCE_DATE_EPOCH", "",
    )
    coil: CoilSpec = key(Part(CoilSpec), "one coil")
    array: ArrayDocument = key(Part(ArrayDocument), "the coils of the sensor", {})
    fpc: FpcSpec = key(Part(FpcSpec), "the flexible printed circuit", {})
    cells: CellsSpec | None = key(Part(CellsSpec), "each coil or group of coils with a target and pad of its own", None)
    target: Target | None = key(Part(Target), "the conducting plate over the coils", None)
    elastomer: ElastomerPad | None = key(Part(ElastomerPad), "the soft pad between board and target", None)
    encapsulation: Encapsulation | None = key(Part(Encapsulation), "the film that seals the sensor", None)
    mount: Mount | None = key(Part(Mount), "the part that carries the sensor", None)
    shield: Shield | None = key(Part(Shield), "a sheet between coil and jaw", None)
    assembly: Assembly = key(Part(Assembly), "how the pieces are put together", {})
    cutting: Cutting = key(Part(Cutting), "the sheets that elastomer and target are cut from", {})
    readout: ReadoutSpec = key(Part(ReadoutSpec), "the converter that reads the coils", {})
    requirements: Requirements = key(Part(Requirements), "loads and accuracy that the sensor must reach", {})
    loads: LoadsDocument = key(Part(LoadsDocument), "load cases in use", {})


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the spec, made from its declarations, for editors.

    Returns
    -------
    dict
        The schema (draft 2020-12), as ``sitscad schema`` prints it.

    Examples
    --------
    >>> import sitscad
    >>> sitscad.json_schema()["required"]
    ['sitscad', 'name', 'coil']
    """
    return schema_of(SpecDocument, "sitscad spec", "urn:sitscad:spec:1", "*.sensor.yaml")
