"""What carries the sensor, as it is written and as values: a grasper's jaw, a bench, a robot's finger, or a part of the
user's own; and how all is put together. SI units.
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.basics.record import record
from sitscad.kernels.geometry.shapes import PLATES, Outline
from sitscad.spec.format.kinds import (
    Choice,
    FileName,
    Gap,
    Label,
    Pair,
    Preset,
    Size,
    Special,
    Thickness,
    UnitValue,
    described,
    refuse,
)
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key
from sitscad.spec.materials import Adhesive, Conductor, ConductorChoice

PROCESSES = ("resin", "powder", "filament", "machined")
KINDS = ("grasper-pad", "bench-plate", "fingertip", "custom")
RETENTIONS = ("glue", "dovetail", "pins")

Joint = UnitValue("length", "0.1 mm", "20 mm")
Tolerance = UnitValue("length", "0 mm", "5 mm")
Coordinate = UnitValue("length", "-1000 mm", "1000 mm")
Axis = Choice(("x", "-x", "y", "-y", "z", "-z"))


def _datum(value: Any) -> str | tuple[float, ...]:
    if isinstance(value, str):
        return str(Label.read(value))
    if not isinstance(value, list) or len(value) != 3:
        refuse("SIT004", f"{described(value)}, where a name or [x, y, z] is wanted", "write SEAT, or [0, 0, 2.4]")
    return tuple(Coordinate.read(entry) for entry in value)


StepName = FileName("STEP", r"\.([sS][tT][eE][pP]|[sS][tT][pP])$", "jaw.step")
Datum = Special(
    _datum, {"anyOf": [Label.schema(), {"type": "array", "items": Coordinate.schema(), "minItems": 3, "maxItems": 3}]},
    Coordinate,
)


@record
class StepPart:
    """A STEP file in the spec's folder: its path there, the hash of its bytes (which stand in the spec's source), and
    how it lies: ``datum`` is the point (m, in the file's axes) that comes to the middle of the face, or the name of a
    coordinate system in the file; ``along`` and ``up`` are the file's axes that run to the tail and stand on the face.
    """

    file: str
    sha256: str
    datum: str | tuple[float, float, float] = (0.0, 0.0, 0.0)
    along: str = "x"
    up: str = "z"


@record
class Jaw(Section):
    """A grasper's jaw written out, or a preset of which single figures are your own, or a STEP file of it.

    The face carries the sensor, the metal is behind it. What is left out is None only until it is worked out, as is the
    name of the file in ``step``. ``datum``, ``along``, ``up`` and ``based_on`` are as written, None if left out.
    ``height`` is that of one jaw, face to back; ``port_diameter`` is the circle that the closed pair must pass.
    ``face`` (m) is the flat's true width where it is measured, None where it is the chord of a back as round as the
    port. In a jaw with a pad pocket the face is the pocket's floor, ``pocket`` its length and width, and the rims
    beside it stand ``recess`` above it; ``opposing_pocket`` and ``opposing_recess`` are those of the other jaw.
    ``hinge`` is from the face's heel to the pivot, ``pivot_offset`` how far that lies beside the closed pair's middle,
    towards this jaw; ``opening`` (rad) is the angle between the faces when wide open; ``fenestration`` is the length
    and width of a window through the face. ``preset`` names where figures come from that the spec does not write,
    ``written`` are those that it does; ``step`` is its solid where a STEP file has it.
    """

    name: str = key(Label, "what to call it", "written out")
    based_on: Jaw | None = key(Preset("jaw", up=True), "a preset whose figures hold where none is written here", None)
    width: float = key(
        Size, "of the jaw. Unless face is written, its face is as wide, but at most the chord of a back as round as "
        "the port. Must be there unless based_on or step is", None,
    )
    length: float = key(Size, "of that face, along the jaw; must be there unless based_on or step is", None)
    height: float = key(Thickness, "of one jaw, face to back; must be there unless based_on or step is", None)
    port_diameter: float = key(Size, "of the circle that the closed pair must pass: 5 mm if left out", None)
    material: Conductor = key(ConductorChoice, "the jaw's metal: stainless-304 if left out", None)
    opposing_pad_thickness: float = key(Gap, "pad on the other jaw: none if left out", None)
    face: float | None = key(
        Size, "true width of the flat, measured; if left out, the lesser of the jaw's width and that chord", None
    )
    recess: float = key(Gap, "how far rims beside a pad pocket stand above its floor; the floor is the face then", None)
    pocket: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a pad pocket; as long and wide as the face if left out", None
    )
    opposing_recess: float = key(Gap, "as recess, of the other jaw, in which its own pad lies", None)
    opposing_pocket: tuple[float, float] | None = key(Pair(Size), "as pocket, of the other jaw", None)
    hinge: float | None = key(Gap, "from the face's heel to the pivot, along the jaw", None)
    pivot_offset: float = key(
        UnitValue("length", "-50 mm", "50 mm"),
        "of the pivot from the closed pair's middle, towards this jaw; negative: towards the other one", None,
    )
    opening: float | None = key(
        UnitValue("angle", "1 deg", "180 deg"), "between the faces, wide open, like 60 deg", None
    )
    fenestration: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a window through the middle of the face; none if left out", None
    )
    step: StepPart | None = key(StepName, "a STEP file of the jaw in the spec's folder, like jaw.step", None)
    datum: str | tuple[float, ...] | None = key(
        Datum,
        "in the STEP file, the middle of the face: [x, y, z], or the name of a coordinate system there, whose x runs "
        "to the hinge and whose z stands on the face; [0, 0, 0] if left out", None,
    )
    along: str | None = key(Axis, "the STEP file's axis that runs to the hinge: x if left out", None)
    up: str | None = key(Axis, "the STEP file's axis that stands on the face: z if left out", None)
    source: str = ""
    preset: str = ""
    written: tuple[str, ...] = ()


def half_chord(height: float, radius: float) -> float:
    """Half the width (m) of a flat face over an arc of a radius (m) whose lowest point is so far (m) below it."""
    return math.sqrt(max(0.0, height * (2.0 * radius - height))) if height < radius else radius


LEVEL = {"opposing_pad_thickness": 0.0, "recess": 0.0, "opposing_recess": 0.0, "pivot_offset": 0.0}
"""Figures (m) of a jaw of which nothing else is said: no rims, no pad on the other one, the pivot in the middle."""


@record
class Retention(Section):
    """What holds the mount in the jaw besides glue: the jaw is cut for it, and drawn so."""

    kind: str = key(
        Choice(RETENTIONS[1:]),
        "dovetail: a tongue that slides in from the tip; pins: pegs in two holes through the jaw",
    )
    width: float = key(Joint, "of a dovetail's tongue where it is widest, at its bottom", 1.6)
    depth: float = key(Joint, "of a dovetail's tongue, or how long pins are, below the mount", 0.4)
    angle: float = key(UnitValue("angle", "45 deg", "75 deg"), "between a dovetail's flanks and the face", "60 deg")
    diameter: float = key(Joint, "of pins", 1)
    spacing: float | None = key(Joint, "of pins along the jaw: half of the board's body if left out", None)


@record
class Hole(Section):
    """One hole through a bench plate."""

    at: tuple[float, float] = key(
        Pair(UnitValue("length", "-500 mm", "500 mm")), "[x, y] from the middle of the board's body"
    )
    diameter: float = key(Joint, "clearance for the screw: 2.4 for M2, 6.6 for M6", 2.4)
    head: float = key(Joint, "of the screw's head, which needs the room", 3.8)


@record
class HolePattern:
    """The holes by which a bench plate is screwed down. ``grid`` (m) is the distance of the holes of a bench of which
    any four may be taken, None where ``holes`` are just those.
    """

    name: str
    holes: tuple[Hole, ...] = ()
    grid: float | None = None
    thread: str = ""
    source: str = ""


@record
class Finger(Section):
    """The end of a robot's finger, over which a cap slips that carries the sensor.

    ``screw`` is the nominal diameter of its two clamping screws (m); its metal is None where it is of plastic.
    """

    shape: str = key(Choice(("rectangle", "circle")), "across", "rectangle")
    size: tuple[float, float] = key(
        Pair(Size, single=True), "across: [width, height], the height away from the sensor; or a diameter", [16, 10]
    )
    grip: float = key(UnitValue("length", "3 mm", "100 mm"), "how far the cap reaches over it, behind the board", 8)
    screw: float = key(UnitValue("length", "1.6 mm", "6 mm"), "of the two screws that clamp it: 2 for M2", 2)
    material: Conductor | None = key(
        ConductorChoice, "its metal, which the coils see at mount.standoff; not of metal if left out", None
    )

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class MetalBehind(Section):
    """Metal behind the board that is no part of the package: a tube, a finger's bone, a battery.

    It counts as an endlessly wide sheet of its thickness with air behind it.
    """

    material: Conductor = key(ConductorChoice, "its metal")
    distance: float = key(
        Gap, "from the board's bottom face to the metal, with mount and shield between them: not less than "
        "mount.standoff; the glue lines come on top, as there. To the nearest point of it: of a round tube, to its "
        "crown",
    )
    thickness: float = key(Thickness, "of the metal, away from the board; of a tube, of its wall")


@record
class Mount(Section):
    """What carries the sensor.

    ``standoff`` is from the metal's face to the board's bottom face (m), ``process`` how its pieces are made. Words and
    lists are what is written, until that is worked out. ``step`` is a mount of the user's own, or the jaw where only a
    STEP file says how large that is; ``backing`` is the metal of a finger, or of a jaw that only a STEP file describes.
    """

    kind: str = key(
        Choice(KINDS),
        "a pad on a grasper's jaw, a plate on the bench, a cap on a robot's finger, or a part of your own (or none: "
        "the pieces are put together all the same)", "grasper-pad",
    )
    jaw: Jaw | None = key(
        NameOr(Preset("jaw", up=True), Part(Jaw)),
        "a jaw preset (with its metal), or written out; generic-5mm if left out", None,
    )
    standoff: float = key(
        Gap,
        "height of the board over the metal: from the jaw's upper face to the board's bottom face, a shield between "
        "them included; it is filled with printed plastic. On a bench plate, the plastic below the board; on a finger, "
        "from its face. 1 mm, or more for a shield, if left out", None,
    )
    process: str = key(Choice(PROCESSES), "how its pieces are made: sets least walls and tolerances", "resin")
    retention: Retention | None = key(
        NameOr(Choice(RETENTIONS), Part(Retention)),
        "what holds a grasper's pad, and its sizes: glue alone if left out", None,
    )
    holes: HolePattern | None = key(
        NameOr(Preset("hole pattern", up=True), ListOf(Part(Hole))),
        "of a bench plate: a breadboard's, a load cell's, or written out; corners-m2 if left out", None,
    )
    finger: Finger | None = key(
        Part(Finger), "what a fingertip's cap slips over; a usual finger if left out: measure yours", None
    )
    metal_behind: MetalBehind | None = key(
        Part(MetalBehind), "metal behind the board that is neither a jaw nor the finger itself, like a plate under the "
        "bench, a bone in the finger, a battery; none if left out", None,
    )
    step: StepPart | None = key(StepName, "of a custom mount: a STEP file in the spec's folder; none if left out", None)
    datum: str | tuple[float, ...] | None = key(
        Datum, "in the STEP file, the middle of the face that the board's body lies on: [x, y, z], or the name of a "
        "coordinate system there; [0, 0, 0] if left out", None,
    )
    along: str | None = key(Axis, "the STEP file's axis that runs to the tail: x if left out", None)
    up: str | None = key(Axis, "the STEP file's axis that stands on that face: z if left out", None)
    backing: Conductor | None = None

    @property
    def metal(self) -> Conductor | None:
        """The metal behind the coils. None if there is no metal."""
        if self.metal_behind is not None:
            return self.metal_behind.material
        return self.jaw.material if self.jaw is not None else self.backing

    @property
    def metal_thickness(self) -> float | None:
        """How thick that metal is (m), away from the sensor; None where only a STEP file says so, or without metal."""
        if self.metal_behind is not None:
            return self.metal_behind.thickness
        if self.jaw is not None:
            return self.jaw.height
        return self.finger.size[1] if self.finger is not None and self.backing is not None else None

    @property
    def is_jaw_unmeasured(self) -> bool:
        """Whether its jaw is known by a STEP file alone, without a figure that rules could go by."""
        return self.kind == "grasper-pad" and self.jaw is None


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
    metal_behind: float | None = key(Tolerance, "thickness of mount.metal_behind", None)
    metal_distance: float | None = key(Tolerance, "mount.metal_behind.distance", None)
    opposing_pad: float | None = key(Tolerance, "thickness of the other jaw's pad", None)
    placement: float | None = key(Tolerance, "where each piece is glued, along and across", None)

    def written(self) -> tuple[tuple[str, float], ...]:
        """The tolerances (m) that are written, by part."""
        return tuple((name, value) for name, value in self.values().items() if value is not None)


@record
class HeightOffsets:
    """Lengths (m) by which target, shield and metal behind it lie farther from the board in one unit than drawn."""

    target: float = 0.0
    shield: float = 0.0
    metal: float = 0.0


@record
class Assembly(Section):
    """How the pieces are put together: what their glue and their tolerances add is checked against the port.

    Lengths are metres. What the adhesive says is None only until it is worked out, bore and pin where they are what is
    usual for the port; ``tolerances`` are those of parts by name that go before those of their process. ``offsets`` are
    none but in simulated units.
    """

    adhesive: Adhesive | None = key(
        Preset("adhesive", up=True), "what the pieces are glued with: cyanoacrylate if left out", None
    )
    glue_line: float = key(
        UnitValue("length", "0 mm", "1 mm"), "thickness of each glue line; the adhesive's if left out", None
    )
    glue_tolerance: float = key(Tolerance, "of each glue line; the adhesive's if left out", None)
    shaft_bore: float | None = key(
        Size, "inside the tube behind the jaws; what is usual for the port if left out", None
    )
    hinge_pin: float | None = key(
        Size, "diameter of the pin that the jaws turn about; what is usual for the port if left out", None
    )
    tolerances: tuple[tuple[str, float], ...] = key(
        Part(TolerancesDocument, TolerancesDocument.written),
        "half the band of a part's size, where it is not its process's", {},
    )
    offsets: HeightOffsets = HeightOffsets()

    def tolerance(self, part: str) -> float | None:
        """The tolerance (m) that the spec gives a part; None where it leaves it to the part's process."""
        return dict(self.tolerances).get(part)
