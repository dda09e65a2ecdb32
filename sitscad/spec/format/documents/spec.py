"""The spec as it is written, section by section: the format's keys, what each may hold, and its default.

Values come out in SI units; names of presets stay names (`resolve` looks them up). Defaults are written as a person
would write them: a bare number is millimetres.
"""

from __future__ import annotations

from typing import Any

from sitscad.geometry.shapes import PLATES, SHAPES
from sitscad.spec.format.documents.circuit import PAIR_OF_COUNTS, FpcDocument, InRow, Offset, Run
from sitscad.spec.format.documents.loads import LoadsDocument
from sitscad.spec.format.documents.materials import (
    ConductorChoice,
    ConductorDocument,
    ElastomerChoice,
    ElastomerDocument,
)
from sitscad.spec.format.documents.mount import MountDocument
from sitscad.spec.format.kinds.kind import Either, Special
from sitscad.spec.format.kinds.number import Layers, Number, NumberOrList
from sitscad.spec.format.kinds.preset import Preset
from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.refusal import described, refuse
from sitscad.spec.format.kinds.word import Choice, Text
from sitscad.spec.format.section import ListOf, Part, Section, key

VERSION = 1


def _version(value: Any) -> int:
    if isinstance(value, bool) or value != VERSION or not isinstance(value, int):
        refuse(
            "SIT008", f"{described(value)} is no version of the format that is known here", f"write sitscad: {VERSION}"
        )
    return VERSION


def _count(value: Any) -> tuple[int, ...]:
    entries = value if isinstance(value, list) else [value]
    if len(entries) not in (1, 2):
        refuse("SIT004", f"{described(value)}, where a number or [nx, ny] is wanted", "write 2, or [2, 2] for a grid")
    return tuple(int(InRow.read(entry)) for entry in entries)


def _temperature_range(value: Any) -> tuple[float, float]:
    """The lowest and the highest temperature (degC), bare numbers or texts with their unit."""
    if not isinstance(value, list) or len(value) != 2:
        refuse(
            "SIT004", f"{described(value)}, where [lowest, highest] is wanted", "write degrees Celsius, like [15, 45]"
        )
    low, high = (
        Temperature.read(entry if isinstance(entry, (str, bool)) or entry is None else f"{entry} degC")
        for entry in value
    )
    if low > high:
        refuse("SIT006", f"{described(value)} begins above its end", "write the lower temperature first")
    return low, high


Version = Special(_version, {"const": VERSION})
Name = Text(64, "[a-z0-9][a-z0-9._-]*", "small letters, digits, '.', '_' and '-', a letter or digit first")
_ISSUE = "([A-Za-z0-9]([A-Za-z0-9 ._/+#:()-]*[A-Za-z0-9+#)])?)?"
_ISSUE_WORDS = "letters, digits, spaces and . _ / + # : ( ) -, a letter or digit first"
Revision = Text(16, _ISSUE, _ISSUE_WORDS)
PartNumber = Text(32, _ISSUE, _ISSUE_WORDS)
IssueDate = Text(20, _ISSUE, _ISSUE_WORDS)
Trace = Quantity("length", "1 um", "20 mm")
Corner = Quantity("length", "0 mm", "100 mm")
CoilSize = Pair(Quantity("length", "0.1 mm", "500 mm"), single=True)
PlateSize = Pair(Quantity("length", "0.1 mm", "500 mm"), single=True)
Size = Quantity("length", "0.1 mm", "500 mm")
Pitch = Quantity("length", "0.1 mm", "1000 mm")
Centre = Pair(Quantity("length", "-1000 mm", "1000 mm"))
Thickness = Quantity("length", "1 um", "100 mm")
Kerf = Quantity("length", "0 mm", "2 mm")
Gap = Quantity("length", "0 mm", "100 mm")
Tolerance = Quantity("length", "0 mm", "5 mm")
PlateOffset = Pair(Offset)
Angle = Quantity("angle", "-360 deg", "360 deg")
Capacitance = Quantity("capacitance", "0 pF", "1 uF")
DriveCode = Either("auto", Number(0, 31, whole=True))
TankCapacitance = Either("auto", Quantity("capacitance", "1 pF", "1 uF"))
Inductance = Quantity("inductance", "0 nH", "1 mH")
Resistance = Quantity("resistance", "0 ohm", "1 kohm")
Clock = Quantity("frequency", "100 kHz", "1 GHz")
Rate = Quantity("frequency", "0.01 Hz", "1 MHz")
Force = Quantity("force", "0 N", "10 kN")
Resolution = Quantity("force", "1 uN", "10 kN")
TiltOfContact = Quantity("angle", "0 deg", "15 deg")
Temperature = Quantity("temperature", "-60 degC", "200 degC")
TemperatureRange = Special(
    _temperature_range,
    {"type": "array", "items": {"anyOf": [{"type": "number"}, Temperature.schema()]}, "minItems": 2, "maxItems": 2},
)
Count = Special(_count, {"anyOf": [InRow.schema(), PAIR_OF_COUNTS]})


class CoilDocument(Section):
    """One coil: all its layers are one conductor."""

    shape: str = key(Choice(tuple(SHAPES)), "outline of the turns")
    outer_diameter: tuple[float, float] = key(
        CoilSize, "across the outer copper edges (polygons: across flats); rectangle and racetrack: [x, y]"
    )
    turns: tuple[float, ...] = key(
        NumberOrList(Number(0.25, 200)), "per layer; a list gives each its own, in the order of layers: [8, 7]"
    )
    layers: tuple[int, ...] = key(Layers(), "copper layers in series: a count from the top, or a list like [1, 2]", 1)
    trace_width: float = key(Trace, "width of the trace")
    trace_spacing: float = key(Trace, "gap between neighbouring turns")
    start_angle: float = key(
        Angle, "where layer 1 begins at the outside, from +x, counter-clockwise, like 90 deg", "0 deg"
    )
    sense: str = key(
        Choice(("counter-clockwise", "clockwise")), "how layer 1 winds inward, seen from the top", "counter-clockwise"
    )
    corner_radius: float = key(Corner, "of polygons; 0: mitred corners", 0)


class ArrayDocument(Section):
    """The coils of the sensor, x along the jaw; C1 is the far one, the tail leaves at +x."""

    pattern: str | None = key(
        Choice(("single", "line", "triangle", "grid", "explicit")),
        "how the coils stand; if left out, after the other keys: explicit with centres, grid with a count of [nx, ny], "
        "line with a count or a pitch, else single",
        None,
    )
    count: tuple[int, ...] | None = key(
        Count,
        "line: a number; grid: [nx, ny], numbered up each column, the far column first; 2 or [2, 2] if left out",
        None,
    )
    pitch: float | None = key(
        Pitch, "distance of neighbouring centres; 0.5 mm more than the coils need if left out", None
    )
    centres: list[tuple[float, float]] | None = key(
        ListOf(Centre),
        "explicit: [x, y] of every coil, in the order of the converter's channels; the tail leaves at their mean's y",
        None,
    )
    rotations: list[float] | None = key(
        ListOf(Angle),
        "explicit: every coil's, counter-clockwise, in the same order, like [0 deg, 90 deg]; 0 if left out",
        None,
    )


class TargetDocument(Section):
    """The conducting plate over the coils."""

    shape: str | None = key(
        Choice(tuple(PLATES)), "outline; square, or rectangle for a size of [x, y], if left out", None
    )
    size: tuple[float, float] | None = key(
        PlateSize,
        "side or diameter; rectangle: [x, y]; as wide as the coils are far apart, and one coil at least, if left out",
        None,
    )
    thickness: float = key(Thickness, "of the plate", 0.2)
    material: str | ConductorDocument = key(ConductorChoice, "a conductor, or written out", "copper")
    kerf: float = key(Kerf, "width of the cut; 0: drawn as it is", 0)
    offset: tuple[float, float] = key(
        PlateOffset, "[x, y] of its centre from the mean of the coils' centres, like [0.5, 0]", [0, 0]
    )
    rotation: float = key(Angle, "about its own centre, counter-clockwise, like 45 deg", "0 deg")


class ElastomerPadDocument(Section):
    """The soft pad between board and target."""

    material: str | ElastomerDocument = key(ElastomerChoice, "a silicone, or written out", "dragon-skin-10")
    shape: str | None = key(
        Choice(tuple(PLATES)), "outline; square, or rectangle for a size of [x, y], if left out", None
    )
    size: tuple[float, float] | None = key(
        PlateSize, "side or diameter; rectangle: [x, y]; as large as it must be to carry the target if left out", None
    )
    thickness: float = key(Thickness, "unloaded", 1)
    kerf: float = key(Kerf, "width of the laser's cut", 0.15)
    offset: tuple[float, float] = key(
        PlateOffset, "[x, y] of its centre from the mean of the coils' centres, like [0.5, 0]", [0, 0]
    )


class EncapsulationDocument(Section):
    """The film that seals the sensor against tissue."""

    material: str | ElastomerDocument = key(ElastomerChoice, "a silicone, or written out", "pdms")
    thickness: float = key(Thickness, "of the film", 0.1)


class ShieldDocument(Section):
    """A sheet between coil and jaw."""

    material: str | ConductorDocument = key(
        ConductorChoice, "copper, ferrite or another conductor, or written out", "copper"
    )
    thickness: float = key(Thickness, "of the sheet", 0.1)
    gap: float = key(Gap, "from the board's bottom face down to the sheet; inside mount.standoff", 0.6)
    kerf: float = key(Kerf, "width of the cut; 0: drawn as it is", 0)


class TolerancesDocument(Section):
    """Half the band of what is delivered, part by part: written where yours are measured, else the process's."""

    board: float | None = key(Tolerance, "thickness of the board's body; fpc.rules if left out", None)
    outline: float | None = key(Tolerance, "length and width of the board; fpc.rules if left out", None)
    elastomer: float | None = key(Tolerance, "thickness of the pad", None)
    elastomer_size: float | None = key(Tolerance, "length and width of the pad", None)
    target: float | None = key(Tolerance, "thickness of the target", None)
    target_size: float | None = key(Tolerance, "length and width of the target", None)
    encapsulation: float | None = key(Tolerance, "thickness of the film", None)
    shield: float | None = key(Tolerance, "thickness of the shield", None)
    mount: float | None = key(Tolerance, "thickness of each piece of the mount", None)
    jaw: float | None = key(Tolerance, "height and width of each jaw", None)
    opposing_pad: float | None = key(Tolerance, "thickness of the other jaw's pad", None)
    placement: float | None = key(Tolerance, "where each piece is glued, along and across", None)


class AssemblyDocument(Section):
    """How the pieces are put together: what their glue and their tolerances add is checked against the port."""

    adhesive: str | None = key(Preset("adhesive"), "what the pieces are glued with: cyanoacrylate if left out", None)
    glue_line: float | None = key(
        Quantity("length", "0 mm", "1 mm"), "thickness of each glue line; the adhesive's if left out", None
    )
    glue_tolerance: float | None = key(Tolerance, "of each glue line; the adhesive's if left out", None)
    shaft_bore: float | None = key(
        Size, "inside the tube behind the jaws; what is usual for the port if left out", None
    )
    hinge_pin: float | None = key(
        Size, "diameter of the pin that the jaws turn about; what is usual for the port if left out", None
    )
    tolerances: TolerancesDocument = key(
        Part(TolerancesDocument), "half the band of a part's size, where it is not its process's", {}
    )


class CuttingDocument(Section):
    """The sheets that elastomer and target are cut from, and how copies lie on them (`fpc.boards` says how many)."""

    sheet: tuple[float, float] = key(
        Pair(Size), "[x, y] of the sheet, all of it; unverified: measure yours", [100, 100]
    )
    gap: float = key(Gap, "between the cuts of two copies, more than the kerf", 1.5)


class CableDocument(Section):
    """The wires between tail and converter, per conductor pair and for the whole length."""

    length: float = key(Run, "of the cable", 300)
    inductance: float | None = key(
        Inductance, "of one pair, whole length, like 180 nH; 600 nH a metre if left out: measure yours", None
    )
    capacitance: float | None = key(
        Capacitance, "of one pair, whole length, like 30 pF; 100 pF a metre if left out: measure yours", None
    )
    resistance: float | None = key(
        Resistance, "of one pair, there and back, like 0.3 ohm; 1 ohm a metre if left out: measure yours", None
    )


class ReadoutDocument(Section):
    """The converter that reads the coils."""

    device: str = key(Preset("converter"), "the converter", "ldc1614")
    capacitance: float | None = key(TankCapacitance, "of the tank, like 330 pF; auto: chosen, with reasons", "auto")
    capacitor_at: str | None = key(
        Choice(("coil", "converter")), "where it is soldered: converter, unless capacitors_on_board", None
    )
    capacitors_on_board: str | None = key(
        Preset("chip"), "places for the capacitors on the tail's stiffener, and of what size", None
    )
    cable: CableDocument | None = key(Part(CableDocument), "none: the tail plugs into the converter's board", None)
    clock: float = key(Clock, "reference clock", "40 MHz")
    scan_rate: float = key(Rate, "complete scans of all coils per second", "100 Hz")
    drive_code: int | None = key(DriveCode, "of all channels; auto: the strongest one sigma below 1.8 V", "auto")


class RequirementsDocument(Section):
    """What the sensor must bear and follow."""

    normal_force: float | None = key(Force, "to be borne, like 4.8 N", None)
    shear_force: float | None = key(Force, "to be borne, like 1 N", None)
    bandwidth: float | None = key(Rate, "of the force signal, like 100 Hz", None)
    temperature: float = key(Temperature, "of the sensor in use: copper and metal are computed there", "20 degC")
    normal_resolution: float | None = key(
        Resolution, "one sigma of noise at the scan rate, at every working point, like 20 mN", None
    )
    shear_resolution: float | None = key(Resolution, "the same of every shear axis", None)
    crosstalk: float | None = key(
        Number(0, 10), "error of an axis per full scale of another, over its own full scale, after calibration", None
    )
    tilt: float | None = key(TiltOfContact, "that the contact may have, like 2 deg", None)
    tilt_error: float | None = key(Resolution, "what that may cost on any axis, like 100 mN", None)
    friction_error: float | None = key(
        Number(0, 10), "of shear over normal at full load: 0.05 shows slip on tissue", None
    )
    temperature_range: tuple[float, float] | None = key(
        TemperatureRange, "between which the sensor is used after a tare, degrees Celsius, like [15, 45]", None
    )
    temperature_error: float | None = key(Resolution, "what it may drift by on any axis within that, like 0.5 N", None)


class SpecDocument(Section):
    """A sensor: one spec a file."""

    sitscad: int = key(Version, "version of this format")
    name: str = key(Name, "names the outputs")
    revision: str = key(Revision, "of the design, like B or 1.2 in quotes: printed on every paper", "")
    part_number: str = key(PartNumber, "your number for the sensor: printed on every paper", "")
    date: str = key(
        IssueDate, "of the revision, like 2026-11-22: printed on every paper; SOURCE_DATE_EPOCH if left out", ""
    )
    coil: CoilDocument = key(Part(CoilDocument), "one coil")
    array: ArrayDocument = key(Part(ArrayDocument), "the coils of the sensor", {})
    fpc: FpcDocument = key(Part(FpcDocument), "the flexible printed circuit", {})
    target: TargetDocument | None = key(Part(TargetDocument), "the conducting plate over the coils", None)
    elastomer: ElastomerPadDocument | None = key(
        Part(ElastomerPadDocument), "the soft pad between board and target", None
    )
    encapsulation: EncapsulationDocument | None = key(
        Part(EncapsulationDocument), "the film that seals the sensor", None
    )
    mount: MountDocument | None = key(Part(MountDocument), "what carries the sensor", None)
    shield: ShieldDocument | None = key(Part(ShieldDocument), "a sheet between coil and jaw", None)
    assembly: AssemblyDocument = key(Part(AssemblyDocument), "how the pieces are put together", {})
    cutting: CuttingDocument = key(Part(CuttingDocument), "the sheets that elastomer and target are cut from", {})
    readout: ReadoutDocument = key(Part(ReadoutDocument), "the converter that reads the coils", {})
    requirements: RequirementsDocument = key(Part(RequirementsDocument), "what the sensor must bear and follow", {})
    loads: LoadsDocument = key(Part(LoadsDocument), "ways in which the sensor is pushed in use", {})
