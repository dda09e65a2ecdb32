"""The spec as it is written, section by section: pydantic models whose fields are the format's keys.

Values come out in SI units; names of presets stay names (`resolve` looks them up). Defaults are written as a person would
write them. This module and `kinds` are the only ones that know pydantic.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from sitscad.spec.kinds import Choice, Either, Layers, Number, Pair, Preset, Quantity, Special, Text, described, refuse

VERSION = 1
SHAPES = ("circle", "square", "rectangle", "hexagon", "octagon", "racetrack")
NAME = "<name>"
WRITTEN = "<written out>"


class Section(BaseModel):
    """A section of the spec: unknown keys are refused, defaults are read like written values."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True, defer_build=True)


def _form(value: Any) -> str | None:
    return NAME if isinstance(value, str) else WRITTEN if isinstance(value, (dict, list, Section)) else None


def _name_or(written: str) -> Discriminator:
    return Discriminator(_form, "SIT004", f"neither a preset's name nor {written}")


def _version(value: Any) -> int:
    if isinstance(value, bool) or value != VERSION or not isinstance(value, int):
        refuse("SIT008", f"{described(value)} is no version of the format that is known here", f"write sitscad: {VERSION}")
    return VERSION


def _count(value: Any) -> tuple[int, ...]:
    entries = value if isinstance(value, list) else [value]
    if len(entries) not in (1, 2):
        refuse("SIT004", f"{described(value)}, where a number or [nx, ny] is wanted", "write 2, or [2, 2] for a grid")
    return tuple(int(Number(1, 64, whole=True).read(entry)) for entry in entries)


_COUNT_SCHEMA = {"type": "integer", "minimum": 1, "maximum": 64}

Version = Annotated[int, Special(_version, {"const": VERSION})]
Name = Annotated[str, Text(64, "[a-z0-9][a-z0-9._-]*", "small letters, digits, '.', '_' and '-', a letter or digit first")]
Label = Annotated[str, Text(64)]
Trace = Annotated[float, Quantity("length", "1 um", "20 mm")]
Corner = Annotated[float, Quantity("length", "0 mm", "100 mm")]
CoilSize = Annotated[tuple[float, float], Pair(Quantity("length", "0.1 mm", "500 mm"), single=True)]
PlateSize = Annotated[tuple[float, float], Pair(Quantity("length", "0.1 mm", "500 mm"), single=True)]
Size = Annotated[float, Quantity("length", "0.1 mm", "500 mm")]
Pitch = Annotated[float, Quantity("length", "0.1 mm", "1000 mm")]
Centre = Annotated[tuple[float, float], Pair(Quantity("length", "-1000 mm", "1000 mm"))]
Thickness = Annotated[float, Quantity("length", "1 um", "100 mm")]
Gap = Annotated[float, Quantity("length", "0 mm", "100 mm")]
Run = Annotated[float, Quantity("length", "1 mm", "5000 mm")]
Feature = Annotated[float, Quantity("length", "5 um", "10 mm")]
Angle = Annotated[float, Quantity("angle", "-360 deg", "360 deg")]
Capacitance = Annotated[float, Quantity("capacitance", "0 pF", "1 uF")]
TankCapacitance = Annotated[float | None, Either("auto", Quantity("capacitance", "1 pF", "1 uF"))]
Inductance = Annotated[float, Quantity("inductance", "0 nH", "1 mH")]
Resistance = Annotated[float, Quantity("resistance", "0 ohm", "1 kohm")]
Clock = Annotated[float, Quantity("frequency", "100 kHz", "1 GHz")]
Rate = Annotated[float, Quantity("frequency", "0.01 Hz", "1 MHz")]
Force = Annotated[float, Quantity("force", "0 N", "10 kN")]
ShearModulus = Annotated[float, Quantity("pressure", "100 Pa", "100 MPa")]
BulkModulus = Annotated[float, Quantity("pressure", "1 MPa", "100 GPa")]
Conductivity = Annotated[float, Quantity("conductivity", "0 S/m", "100 MS/m")]
TemperatureCoefficient = Annotated[float, Quantity("temperature coefficient", "-0.1 1/K", "0.1 1/K")]
Count = Annotated[
    tuple[int, ...],
    Special(_count, {"anyOf": [_COUNT_SCHEMA, {"type": "array", "items": _COUNT_SCHEMA, "minItems": 2, "maxItems": 2}]}),
]


class ConductorDocument(Section):
    """A metal, or a magnetic sheet, written out."""

    name: Label = Field("written out", description="what to call it")
    conductivity: Conductivity = Field(description="at 20 C, like 58 MS/m")
    relative_permeability: Annotated[float, Number(1, 100000)] = Field(1, description="1 for non-magnetic metals")
    temperature_coefficient: TemperatureCoefficient = Field("0 1/K", description="of the resistivity, like 3930 ppm/K")


class ElastomerDocument(Section):
    """A silicone, written out."""

    name: Label = Field("written out", description="what to call it")
    shear_modulus: ShearModulus = Field(description="at small strain, like 24 kPa; a third of Young's modulus")
    uncertainty: Annotated[float, Number(0, 2)] = Field(0.3, description="relative, one sigma")
    bulk_modulus: BulkModulus = Field("1.5 GPa", description="stiffness against change of volume")
    hardness: Label = Field("", description="Shore hardness, for the bill of materials")


ConductorChoice = Annotated[
    Annotated[str, Preset("conductor"), Tag(NAME)] | Annotated[ConductorDocument, Tag(WRITTEN)],
    _name_or("a section with its conductivity"),
]
ElastomerChoice = Annotated[
    Annotated[str, Preset("elastomer"), Tag(NAME)] | Annotated[ElastomerDocument, Tag(WRITTEN)],
    _name_or("a section with its shear modulus"),
]


class CoilDocument(Section):
    """One coil: all its layers are one conductor."""

    shape: Annotated[str, Choice(SHAPES)] = Field(description="outline of the turns")
    outer_diameter: CoilSize = Field(
        description="across the outer copper edges (polygons: across flats); rectangle and racetrack: [x, y]"
    )
    turns: Annotated[float, Number(0.25, 200)] = Field(description="per layer")
    layers: Annotated[tuple[int, ...], Layers()] = Field(
        1, description="copper layers in series: a count from the top, or a list like [1, 2]"
    )
    trace_width: Trace = Field(description="width of the trace")
    trace_spacing: Trace = Field(description="gap between neighbouring turns")
    start_angle: Angle = Field(
        "0 deg", description="where layer 1 begins at the outside, from +x, counter-clockwise, like 90 deg"
    )
    sense: Annotated[str, Choice(("counter-clockwise", "clockwise"))] = Field(
        "counter-clockwise", description="how layer 1 winds inward, seen from the top"
    )
    corner_radius: Corner = Field(0, description="of polygons; 0: mitred corners")


class ArrayDocument(Section):
    """The coils of the sensor, x along the jaw; C1 is the far one, the tail leaves at +x."""

    pattern: Annotated[str, Choice(("single", "line", "triangle", "grid", "explicit"))] | None = Field(
        None, description="how the coils stand"
    )
    count: Count | None = Field(None, description="line: a number; grid: [nx, ny]")
    pitch: Pitch | None = Field(None, description="distance of neighbouring centres")
    centres: list[Centre] | None = Field(
        None, description="explicit: [x, y] of every coil, in the order of the converter's channels"
    )


class TailDocument(Section):
    """The strip that leads to the converter."""

    length: Run = Field(description="from the sensor's body to the end")
    connector: Annotated[str, Preset("connector")] = Field("zif-0.5mm", description="what the tail ends in")
    layers: Annotated[int, Number(1, 8, whole=True)] | None = Field(None, description="copper layers that run down it")
    bend: Annotated[str, Choice(("none", "static", "dynamic"))] = Field(
        "static", description="static: bent once at assembly; dynamic: bends in use"
    )


class LayerDocument(Section):
    """One layer of a stack-up: exactly one of coverlay, copper and dielectric, with its thickness."""

    coverlay: Annotated[float, Quantity("length", "1 um", "2 mm")] | None = Field(None, description="thickness")
    copper: Annotated[float, Quantity("length", "1 um", "1 mm")] | None = Field(None, description="finished thickness")
    dielectric: Annotated[float, Quantity("length", "1 um", "5 mm")] | None = Field(None, description="thickness")
    material: Annotated[str, Preset("dielectric")] | None = Field(None, description="of a dielectric or coverlay")
    permittivity: Annotated[float, Number(1, 100)] | None = Field(None, description="relative, if not the material's")


class RulesDocument(Section):
    """A fabricator's design rules written out; what is left out comes from `based_on`."""

    name: Label = Field("written out", description="what to call them")
    based_on: Annotated[str, Preset("rules")] = Field("generic-flex", description="where the rest comes from")
    source: Label = Field("the spec", description="where the figures come from")
    trace_width: Feature | None = Field(None, description="smallest")
    trace_spacing: Feature | None = Field(None, description="smallest")
    via_drill: Feature | None = Field(None, description="smallest finished hole")
    annular_ring: Feature | None = Field(None, description="smallest copper ring around a hole")
    coil_trace_width: Feature | None = Field(None, description="smallest width of coil (loop) lines")
    coil_trace_spacing: Feature | None = Field(None, description="smallest gap of coil (loop) lines")
    hole_to_hole: Feature | None = Field(None, description="smallest web between holes")
    drill_to_copper: Feature | None = Field(None, description="hole's edge to foreign copper")
    copper_to_edge: Feature | None = Field(None, description="copper to the outline")
    coverlay_web: Feature | None = Field(None, description="smallest coverlay between openings")
    coverlay_opening_to_trace: Feature | None = Field(None, description="opening's edge to a trace that stays covered")


StackupChoice = Annotated[
    Annotated[str, Preset("stackup"), Tag(NAME)] | Annotated[list[LayerDocument], Tag(WRITTEN)],
    _name_or("a list of layers from top to bottom"),
]
RulesChoice = Annotated[
    Annotated[str, Preset("rules"), Tag(NAME)] | Annotated[RulesDocument, Tag(WRITTEN)],
    _name_or("a section with the rules"),
]


class FpcDocument(Section):
    """The flexible printed circuit."""

    stackup: StackupChoice | None = Field(None, description="a preset, or the layers from top to bottom")
    rules: RulesChoice = Field("generic-flex", description="a fabricator's design rules: a preset, or written out")
    tail: TailDocument | None = Field(None, description="none: solder pads at the outline")


class TargetDocument(Section):
    """The conducting plate over the coils."""

    shape: Annotated[str, Choice(("square", "circle", "rectangle"))] | None = Field(None, description="outline")
    size: PlateSize | None = Field(None, description="side or diameter; rectangle: [x, y]")
    thickness: Thickness = Field(0.2, description="of the plate")
    material: ConductorChoice = Field("copper", description="a conductor, or written out")


class ElastomerPadDocument(Section):
    """The soft pad between board and target."""

    material: ElastomerChoice = Field("dragon-skin-10", description="a silicone, or written out")
    shape: Annotated[str, Choice(("square", "circle", "rectangle"))] | None = Field(None, description="outline")
    size: PlateSize | None = Field(None, description="side or diameter; rectangle: [x, y]")
    thickness: Thickness = Field(1, description="unloaded")
    kerf: Annotated[float, Quantity("length", "0 mm", "2 mm")] = Field(0.15, description="width of the laser's cut")


class EncapsulationDocument(Section):
    """The film that seals the sensor against tissue."""

    material: ElastomerChoice = Field("pdms", description="a silicone, or written out")
    thickness: Thickness = Field(0.1, description="of the film")


class JawDocument(Section):
    """A grasper's jaw written out."""

    name: Label = Field("written out", description="what to call it")
    width: Size = Field(description="of the face that carries the sensor")
    length: Size = Field(description="of that face, along the jaw")
    height: Thickness = Field(description="of one jaw, face to back")
    port_diameter: Size = Field(5, description="of the circle that the closed pair must pass")
    material: ConductorChoice = Field("stainless-304", description="the jaw's metal")
    opposing_pad_thickness: Gap = Field(0, description="pad on the other jaw")


JawChoice = Annotated[
    Annotated[str, Preset("jaw"), Tag(NAME)] | Annotated[JawDocument, Tag(WRITTEN)],
    _name_or("a section with the jaw's width, length and height"),
]


class MountDocument(Section):
    """What carries the sensor."""

    kind: Annotated[str, Choice(("grasper-pad", "bench-plate"))] = Field(
        "grasper-pad", description="a pad on a grasper's jaw, or a plate on the bench"
    )
    jaw: JawChoice | None = Field(None, description="a jaw preset (with its metal), or written out")
    standoff: Gap | None = Field(None, description="from the metal's face to the board's bottom")


class ShieldDocument(Section):
    """A sheet between coil and jaw."""

    material: ConductorChoice = Field("copper", description="copper or ferrite, or written out")
    thickness: Thickness = Field(0.1, description="of the sheet")
    gap: Gap = Field(0.6, description="from the board's bottom to the sheet")


class CableDocument(Section):
    """The wires between tail and converter, per conductor pair and for the whole length."""

    length: Run = Field(300, description="of the cable")
    inductance: Inductance | None = Field(None, description="of one pair, whole length, like 180 nH")
    capacitance: Capacitance | None = Field(None, description="of one pair, whole length, like 30 pF")
    resistance: Resistance | None = Field(None, description="of one pair, there and back, like 0.3 ohm")


class ReadoutDocument(Section):
    """The converter that reads the coils."""

    device: Annotated[str, Choice(("ldc1614",))] = Field("ldc1614", description="the converter")
    capacitance: TankCapacitance = Field("auto", description="of the tank, like 330 pF; auto: chosen, with reasons")
    capacitor_at: Annotated[str, Choice(("coil", "converter"))] = Field("converter", description="where it is soldered")
    cable: CableDocument | None = Field(None, description="none: the tail plugs into the converter's board")
    clock: Clock = Field("40 MHz", description="reference clock")
    scan_rate: Rate = Field("100 Hz", description="complete scans of all coils per second")


class RequirementsDocument(Section):
    """What the sensor must bear and follow."""

    normal_force: Force | None = Field(None, description="to be borne, like 4.8 N")
    shear_force: Force | None = Field(None, description="to be borne, like 1 N")
    bandwidth: Rate | None = Field(None, description="of the force signal, like 100 Hz")


class SpecDocument(Section):
    """A sensor: one spec a file."""

    sitscad: Version = Field(description="version of this format")
    name: Name = Field(description="names the outputs")
    coil: CoilDocument = Field(description="one coil")
    array: ArrayDocument = Field(default_factory=ArrayDocument, description="the coils of the sensor")
    fpc: FpcDocument = Field(default_factory=FpcDocument, description="the flexible printed circuit")
    target: TargetDocument | None = Field(None, description="the conducting plate over the coils")
    elastomer: ElastomerPadDocument | None = Field(None, description="the soft pad between board and target")
    encapsulation: EncapsulationDocument | None = Field(None, description="the film that seals the sensor")
    mount: MountDocument | None = Field(None, description="what carries the sensor")
    shield: ShieldDocument | None = Field(None, description="a sheet between coil and jaw")
    readout: ReadoutDocument = Field(default_factory=ReadoutDocument, description="the converter that reads the coils")
    requirements: RequirementsDocument = Field(
        default_factory=RequirementsDocument, description="what the sensor must bear and follow"
    )
