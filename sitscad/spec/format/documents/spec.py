"""The spec as it is written, section by section: the format's keys, what each may hold, and its default.

Values come out in SI units; names of presets stay names (`resolve` looks them up). Defaults are written as a person
would write them: a bare number is millimetres.
"""

from __future__ import annotations

from typing import Any

from sitscad.geometry.shapes import PLATES, SHAPES
from sitscad.spec.format.documents.fabricator import FINISHES, RulesChoice, RulesDocument
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
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key

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
    return tuple(int(Number(1, 64, whole=True).read(entry)) for entry in entries)


def _columns_and_rows(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) != 2:
        refuse("SIT004", f"{described(value)}, where [columns, rows] is wanted", "write [2, 5], or auto")
    return tuple(int(Number(1, 64, whole=True).read(entry)) for entry in value)


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


_COUNT_SCHEMA = {"type": "integer", "minimum": 1, "maximum": 64}

_PAIR_OF_COUNTS = {"type": "array", "items": _COUNT_SCHEMA, "minItems": 2, "maxItems": 2}

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
Margin = Pair(Quantity("length", "0 mm", "100 mm"), single=True)
Gap = Quantity("length", "0 mm", "100 mm")
Tolerance = Quantity("length", "0 mm", "5 mm")
Run = Quantity("length", "1 mm", "5000 mm")
Offset = Quantity("length", "-500 mm", "500 mm")
PlateOffset = Pair(Offset)
TurnRadius = Quantity("length", "0.1 mm", "100 mm")
Angle = Quantity("angle", "-360 deg", "360 deg")
BendAngle = Quantity("angle", "1 deg", "180 deg")
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
PanelGap = Quantity("length", "0.5 mm", "20 mm")
Rail = Quantity("length", "3 mm", "30 mm")
Bridge = Quantity("length", "0.2 mm", "3 mm")
Count = Special(_count, {"anyOf": [_COUNT_SCHEMA, _PAIR_OF_COUNTS]})
BoardCount = Number(1, 100_000, whole=True)
PartCount = Either("auto", Special(_columns_and_rows, _PAIR_OF_COUNTS))


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


class BendDocument(Section):
    """How the tail is bent: about a line across it."""

    kind: str = key(Choice(("static", "dynamic")), "static: bent once at assembly; dynamic: bends in use", "static")
    at: float | None = key(
        Run, "from the sensor's body to the bend's middle line; if left out, the pivot of the jaw's hinge where the "
        "bend has room there, else the middle of the stretch that may be bent", None,
    )  # fmt: skip
    direction: str = key(Choice(("down", "up")), "down: away from the face with the coils; up: towards it", "down")
    angle: float | None = key(
        BendAngle, "out of the plane; if left out, half of the jaw's opening where it has a hinge, else 90 deg", None
    )
    radius: float | None = key(TurnRadius, "inside; the fabricator's least if left out", None)


BendChoice = NameOr(Choice(("none", "static", "dynamic")), Part(BendDocument))


class TailDocument(Section):
    """The strip that leads to the converter."""

    length: float = key(Run, "from the sensor's body to the end", 30)
    connector: str = key(Preset("connector"), "what the tail ends in", "zif-0.5mm")
    contacts: int | None = key(
        Number(2, 200, whole=True), "of the connector that is bought: the fewest that are enough if left out", None
    )
    stiffener: float | None = key(
        Quantity("length", "10 um", "2 mm"),
        "thickness with its adhesive, under contacts that are plugged in: the best of the stock ones if left out",
        None,
    )
    layers: int | None = key(
        Number(1, 8, whole=True), "copper layers that run down it; 2 if left out, or the board's one", None
    )
    bend: str | BendDocument = key(
        BendChoice, "static: bent once at assembly; dynamic: bends in use; none; or a section with line and angle",
        "static",
    )  # fmt: skip
    turn: str = key(
        Choice(("none", "left", "right")), "by 90 degrees in its plane before the contacts, seen from the coils", "none"
    )
    offset: float = key(Offset, "or led aside by so much before the contacts, to the left; negative: right", 0)
    turn_radius: float | None = key(TurnRadius, "of the turn's inner edge: 2 mm, or the fabricator's least", None)


class LayerDocument(Section):
    """One layer of a stack-up: exactly one of coverlay, copper and dielectric, with its thickness."""

    coverlay: float | None = key(Quantity("length", "1 um", "2 mm"), "thickness", None)
    copper: float | None = key(Quantity("length", "1 um", "1 mm"), "finished thickness", None)
    dielectric: float | None = key(Quantity("length", "1 um", "5 mm"), "thickness", None)
    material: str | None = key(
        Preset("dielectric"), "of a dielectric or coverlay; polyimide and polyimide-coverlay if left out", None
    )
    permittivity: float | None = key(Number(1, 100), "relative, if not the material's", None)


StackupChoice = NameOr(Preset("stackup"), ListOf(Part(LayerDocument)))


class PanelDocument(Section):
    """A panel, whatever the part's size."""

    parts: tuple[int, int] | None = key(
        PartCount, "[columns, rows] of at most 500 boards, or auto: as many as fit the fabricator's panel", "auto"
    )
    gap: float = key(PanelGap, "between parts", 2)
    rail: float = key(Rail, "width of the frame", 5)
    bridge: float = key(Bridge, "width of what holds a part in its place", 0.5)


PanelChoice = NameOr(Choice(("auto", "none")), Part(PanelDocument))


class FpcDocument(Section):
    """The flexible printed circuit."""

    stackup: str | list[LayerDocument] | None = key(
        StackupChoice,
        "a preset, or the layers from top to bottom; flex-2l-18um, flex-4l, flex-6l or flex-8l, after the coil's "
        "layers, if left out",
        None,
    )
    plating: float | None = key(
        Quantity("length", "1 um", "100 um"),
        "in the holes of a stackup that is written out, part of its outer copper (and off the foil): 12 um if left out",
        None,
    )
    rules: str | RulesDocument = key(
        RulesChoice, "a fabricator's design rules: a preset, a profile file, or written out", "generic-flex"
    )
    tail: TailDocument | None = key(Part(TailDocument), "none: solder pads at the outline", None)
    panel: str | PanelDocument = key(
        PanelChoice, "auto: when the part is too small to be made singly; none; or a section", "auto"
    )
    boards: int | None = key(
        BoardCount, "how many are wanted: the papers of the order then say how many panels that takes", None
    )
    margin: tuple[float, float] = key(
        Margin,
        "by how much the body is larger on each side than coils and leads need it; along and across: [x, y]. The body "
        "also grows until the mean of the coils' centres is its middle, as far as a jaw is long and wide",
        0,
    )
    teardrops: str = key(
        Choice(("auto", "none")), "auto: tracks widen towards vias and contacts wherever the rules leave room", "auto"
    )
    finish: str = key(Choice(FINISHES), "of the bare contacts", "enig")
    copper: str = key(Choice(("rolled-annealed", "electrodeposited")), "kind of the foil", "rolled-annealed")


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
    gap: float = key(Gap, "between two cuts", 1.5)


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
