"""Mount of the sensor (jaw, bench, finger or the user's own part) and assembly, as written and as values. SI units."""

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
    describe,
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
        refuse("SIT004", f"{describe(value)}, where a name or [x, y, z] is wanted", "write SEAT, or [0, 0, 2.4]")
    return tuple(Coordinate.read(entry) for entry in value)


StepName = FileName("STEP", r"\.([sS][tT][eE][pP]|[sS][tT][pP])$", "jaw.step")
Datum = Special(
    _datum, {"anyOf": [Label.schema(), {"type": "array", "items": Coordinate.schema(), "minItems": 3, "maxItems": 3}]},
    Coordinate,
)


@record
class StepPart:
    """A STEP file in the spec's folder, with its position.

    * ``file``: path of the file, relative to that folder
    * ``sha256``: hash of the file's bytes. `SensorSpec.source` stores the bytes.
    * ``datum``: middle of the face that carries the sensor, as a point (m, in the file's axes), or as the name of a
      coordinate system in the file
    * ``along``: the file's axis that points towards the tail
    * ``up``: the file's axis that points away from the face
    """

    file: str
    sha256: str
    datum: str | tuple[float, float, float] = (0.0, 0.0, 0.0)
    along: str = "x"
    up: str = "z"


@record
class Jaw(Section):
    """A grasper's jaw: written out, a preset with some changed figures, or a STEP file.

    The face carries the sensor; the jaw's metal lies behind the face. Lengths are metres. The resolver replaces omitted
    values, which are None before. It also replaces the file's name in ``step`` by a `StepPart`.

    * ``based_on``, ``datum``, ``along``, ``up``: as written, None if omitted
    * ``height``: largest distance between the face and the round back of one jaw
    * ``port_diameter``: diameter of the circle that the closed pair of jaws must pass
    * ``face``: measured width of the flat face. If it is None, the back is taken as an arc with the port's diameter,
      and the width is its chord at the face. In a jaw with a pocket for a pad, the face is the pocket's floor.
    * ``pocket``: length and width of the pocket
    * ``recess``: height of the rims beside the pocket, above the pocket's floor
    * ``opposing_pocket`` and ``opposing_recess``: pocket and rims of the other jaw
    * ``hinge``: distance from the face's heel to the pivot
    * ``pivot_offset``: distance of the pivot from the middle of the closed pair, positive towards this jaw
    * ``opening`` (rad): angle between the faces of the fully open jaws
    * ``fenestration``: length and width of a window through the face
    * ``preset``: name of the preset that gives all figures which the spec omits
    * ``written``: keys of the figures that the spec states
    * ``step``: the jaw's STEP file. None if there is none.
    """

    name: str = key(Label, "what to call it", "written out")
    based_on: Jaw | None = key(
        Preset("jaw", up=True), "a preset that gives all figures that are not written here", None,
    )
    width: float = key(
        Size, "of the jaw. Unless face is written, its face is as wide, but at most the chord of a back as round as "
        "the port. Required without based_on and step", None,
    )
    length: float = key(Size, "of the face, along the jaw; required without based_on and step", None)
    height: float = key(Thickness, "of one jaw, face to back; required without based_on and step", None)
    port_diameter: float = key(Size, "of the circle that the closed pair must pass; default 5 mm", None)
    material: Conductor = key(ConductorChoice, "the jaw's metal; default stainless-304", None)
    opposing_pad_thickness: float = key(Gap, "thickness of a pad on the other jaw; default none", None)
    face: float | None = key(
        Size, "measured width of the flat; default the smaller of the jaw's width and that chord", None
    )
    recess: float = key(Gap, "height of the rims beside a pad pocket above its floor; the floor is then the face", None)
    pocket: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a pad pocket; default length and width of the face", None
    )
    opposing_recess: float = key(Gap, "as recess, for the pocket of the other jaw, which holds its own pad", None)
    opposing_pocket: tuple[float, float] | None = key(Pair(Size), "as pocket, for the other jaw", None)
    hinge: float | None = key(Gap, "from the face's heel to the pivot, along the jaw", None)
    pivot_offset: float = key(
        UnitValue("length", "-50 mm", "50 mm"),
        "of the pivot from the closed pair's middle, towards this jaw; negative: towards the other one", None,
    )
    opening: float | None = key(
        UnitValue("angle", "1 deg", "180 deg"), "between the faces, wide open, like 60 deg", None
    )
    fenestration: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a window through the middle of the face; default none", None
    )
    step: StepPart | None = key(StepName, "a STEP file of the jaw in the spec's folder, like jaw.step", None)
    datum: str | tuple[float, ...] | None = key(
        Datum,
        "in the STEP file, the middle of the face: [x, y, z], or the name of a coordinate system there, whose x runs "
        "to the hinge and whose z points away from the face; default [0, 0, 0]", None,
    )
    along: str | None = key(Axis, "the STEP file's axis that runs to the hinge; default x", None)
    up: str | None = key(Axis, "the STEP file's axis that points away from the face; default z", None)
    source: str = ""
    preset: str = ""
    written: tuple[str, ...] = ()


def half_chord(height: float, radius: float) -> float:
    """Return half the width (m) of a flat face that lies `height` (m) above the lowest point of an arc.

    The arc is the jaw's back with this `radius` (m). If `height` is the radius or more, the result is the radius.
    """
    return math.sqrt(max(0.0, height * (2.0 * radius - height))) if height < radius else radius


LEVEL = {"opposing_pad_thickness": 0.0, "recess": 0.0, "opposing_recess": 0.0, "pivot_offset": 0.0}
"""Default sizes (m) of a jaw: no rims, no pad on the other jaw, and the pivot in the middle."""


@record
class Retention(Section):
    """The joint that holds the mount in the jaw besides glue. The jaw is cut and drawn for it."""

    kind: str = key(
        Choice(RETENTIONS[1:]),
        "dovetail: a tongue that slides in from the tip; pins: pegs in two holes through the jaw",
    )
    width: float = key(Joint, "of a dovetail's tongue at its bottom, the widest place", 1.6)
    depth: float = key(Joint, "of a dovetail's tongue, or length of pins, below the mount", 0.4)
    angle: float = key(UnitValue("angle", "45 deg", "75 deg"), "between a dovetail's flanks and the face", "60 deg")
    diameter: float = key(Joint, "of pins", 1)
    spacing: float | None = key(Joint, "of pins along the jaw; default half of the board's body", None)


@record
class Hole(Section):
    """One hole through a bench plate."""

    at: tuple[float, float] = key(
        Pair(UnitValue("length", "-500 mm", "500 mm")), "[x, y] from the middle of the board's body"
    )
    diameter: float = key(Joint, "clearance for the screw: 2.4 for M2, 6.6 for M6", 2.4)
    head: float = key(Joint, "diameter of the screw's head", 3.8)


@record
class HolePattern:
    """The screw holes of a bench plate.

    ``grid`` (m) is the pitch of a bench that has a grid of holes; the plate can use any four holes of the grid. None if
    the plate has only the holes in ``holes``.
    """

    name: str
    holes: tuple[Hole, ...] = ()
    grid: float | None = None
    thread: str = ""
    source: str = ""


@record
class Finger(Section):
    """The end of a robot's finger. A cap that carries the sensor slips over it.

    ``screw`` is the nominal diameter (m) of the cap's two clamping screws. ``material`` is the finger's metal. None for
    a finger of plastic.
    """

    shape: str = key(Choice(("rectangle", "circle")), "of the cross section", "rectangle")
    size: tuple[float, float] = key(
        Pair(Size, single=True), "of the cross section: [width, height], the height away from the sensor; or a "
        "diameter", [16, 10]
    )
    grip: float = key(UnitValue("length", "3 mm", "100 mm"), "length of the finger inside the cap, behind the board", 8)
    screw: float = key(UnitValue("length", "1.6 mm", "6 mm"), "of the two screws that clamp it: 2 for M2", 2)
    material: Conductor | None = key(
        ConductorChoice, "its metal, at the distance mount.standoff from the coils; default not metal", None
    )

    @property
    def outline(self) -> Outline:
        """Outline of its shape."""
        return PLATES[self.shape]


@record
class MetalBehind(Section):
    """Metal behind the board, like a tube or a battery, modelled as an infinite plate of its thickness with air behind.

    It is not part of the package.
    """

    material: Conductor = key(ConductorChoice, "its metal")
    distance: float = key(
        Gap, "from the board's bottom face to the nearest point of the metal (the crown of a round tube), with mount "
        "and shield between them: at least mount.standoff. As there, the glue lines are added",
    )
    thickness: float = key(Thickness, "of the metal, away from the board; wall thickness of a tube")


@record
class Mount(Section):
    """The part that carries the sensor.

    Names of presets and files are texts until the resolver replaces them by values.

    * ``standoff``: distance (m) from the metal's face to the board's bottom face
    * ``process``: manufacturing process of the mount
    * ``step``: STEP file of a mount that the user designed, or of a jaw whose sizes the spec does not state
    * ``backing``: metal of a finger or of a jaw in a STEP file
    """

    kind: str = key(
        Choice(KINDS),
        "a pad on a grasper's jaw, a plate on the bench, a cap on a robot's finger, or a part of your own, which may "
        "also be omitted", "grasper-pad",
    )
    jaw: Jaw | None = key(
        NameOr(Preset("jaw", up=True), Part(Jaw)),
        "a jaw preset (with its metal), or written out; default generic-5mm", None,
    )
    standoff: float = key(
        Gap,
        "height of the board over the metal: from the jaw's upper face to the board's bottom face, including a shield "
        "between them. It is filled with printed plastic. On a bench plate: the plastic below the board. On a finger: "
        "from its face. Default 1 mm, or more for a shield", None,
    )
    process: str = key(
        Choice(PROCESSES), "manufacturing process of its pieces, which sets minimum walls and tolerances", "resin",
    )
    retention: Retention | None = key(
        NameOr(Choice(RETENTIONS), Part(Retention)),
        "joint that holds a grasper's pad, and its sizes; default only glue", None,
    )
    holes: HolePattern | None = key(
        NameOr(Preset("hole pattern", up=True), ListOf(Part(Hole))),
        "of a bench plate: for a breadboard, a load cell, or written out; default corners-m2", None,
    )
    finger: Finger | None = key(
        Part(Finger), "the finger below a fingertip's cap; default a finger of usual size: measure yours", None
    )
    metal_behind: MetalBehind | None = key(
        Part(MetalBehind), "metal behind the board that is neither a jaw nor the finger itself, like a plate under the "
        "bench, a bone in the finger, a battery; default none", None,
    )
    step: StepPart | None = key(StepName, "of a custom mount: a STEP file in the spec's folder; default none", None)
    datum: str | tuple[float, ...] | None = key(
        Datum, "in the STEP file, the middle of the face that carries the board's body: [x, y, z], or the name of a "
        "coordinate system there; default [0, 0, 0]", None,
    )
    along: str | None = key(Axis, "the STEP file's axis that runs to the tail; default x", None)
    up: str | None = key(Axis, "the STEP file's axis that points away from that face; default z", None)
    backing: Conductor | None = None

    @property
    def metal(self) -> Conductor | None:
        """The metal behind the coils. None if there is no metal."""
        if self.metal_behind is not None:
            return self.metal_behind.material
        return self.jaw.material if self.jaw is not None else self.backing

    @property
    def metal_thickness(self) -> float | None:
        """Thickness (m) of the metal behind the coils. None if there is no metal, or if only a STEP file gives it."""
        if self.metal_behind is not None:
            return self.metal_behind.thickness
        if self.jaw is not None:
            return self.jaw.height
        return self.finger.size[1] if self.finger is not None and self.backing is not None else None

    @property
    def is_jaw_unmeasured(self) -> bool:
        """Whether only a STEP file describes the jaw. Rules then cannot use the jaw's sizes."""
        return self.kind == "grasper-pad" and self.jaw is None


class TolerancesDocument(Section):
    """Tolerance (half the band) of each delivered part. Write measured values; others come from the part's process."""

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
    placement: float | None = key(Tolerance, "position of each glued piece, along and across", None)

    def written(self) -> tuple[tuple[str, float], ...]:
        """Return the tolerances (m) that the spec writes, as (part, tolerance)."""
        return tuple((name, value) for name, value in self.values().items() if value is not None)


@record
class HeightOffsets:
    """Errors of height (m) in one manufactured unit, for target, shield and metal.

    Each is the distance from the board in this unit, minus the nominal distance.
    """

    target: float = 0.0
    shield: float = 0.0
    metal: float = 0.0


@record
class Assembly(Section):
    """Assembly of the pieces. The thickness of glue and the tolerances are included in the check against the port.

    Lengths are metres. Values of the adhesive can be None until the resolver fills them in. ``shaft_bore`` and
    ``hinge_pin`` are None if the usual sizes for the port apply.

    * ``tolerances``: pairs (part, tolerance) that replace the tolerance of the part's manufacturing process
    * ``offsets``: errors of height in a simulated unit. Zero in the nominal design.
    """

    adhesive: Adhesive | None = key(
        Preset("adhesive", up=True), "adhesive between the pieces; default cyanoacrylate", None
    )
    glue_line: float = key(
        UnitValue("length", "0 mm", "1 mm"), "thickness of each glue line; default the adhesive's", None
    )
    glue_tolerance: float = key(Tolerance, "of each glue line; default the adhesive's", None)
    shaft_bore: float | None = key(
        Size, "inner diameter of the tube behind the jaws; default the usual size for the port", None
    )
    hinge_pin: float | None = key(
        Size, "diameter of the pivot pin of the jaws; default the usual size for the port", None
    )
    tolerances: tuple[tuple[str, float], ...] = key(
        Part(TolerancesDocument, TolerancesDocument.written),
        "half the band of a part's size, in place of the tolerance of its process", {},
    )
    offsets: HeightOffsets = HeightOffsets()

    def tolerance(self, part: str) -> float | None:
        """Return the tolerance (m) that the spec states for a part. None if the spec does not state one."""
        return dict(self.tolerances).get(part)
