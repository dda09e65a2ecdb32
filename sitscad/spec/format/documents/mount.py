"""What carries the sensor, as it is written in a spec: jaw, finger, holes of a bench, and how the mount is held."""

from __future__ import annotations

import re
from typing import Any

from sitscad.spec.format.documents.materials import ConductorChoice, ConductorDocument, Label
from sitscad.spec.format.kinds.kind import Special
from sitscad.spec.format.kinds.preset import Preset
from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.refusal import described, refuse
from sitscad.spec.format.kinds.word import Choice, Text
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key

PROCESSES = ("resin", "powder", "filament", "machined")
KINDS = ("grasper-pad", "bench-plate", "fingertip", "custom")
RETENTIONS = ("glue", "dovetail", "pins")
AXES = ("x", "-x", "y", "-y", "z", "-z")

Size = Quantity("length", "0.1 mm", "500 mm")
Thickness = Quantity("length", "1 um", "100 mm")
Gap = Quantity("length", "0 mm", "100 mm")
Aside = Quantity("length", "-50 mm", "50 mm")
Opening = Quantity("angle", "1 deg", "180 deg")
Flank = Quantity("angle", "45 deg", "75 deg")
Joint = Quantity("length", "0.1 mm", "20 mm")
Place = Pair(Quantity("length", "-500 mm", "500 mm"))
Coordinate = Quantity("length", "-1000 mm", "1000 mm")


def _step_name(value: Any) -> str:
    name = Text(200).read(value)
    if not re.search(r"\.(step|stp)$", name, re.IGNORECASE):
        refuse("SIT006", f"{described(value)} is no name of a STEP file", "a file beside the spec, like jaw.step")
    return str(name)


def _datum(value: Any) -> str | tuple[float, ...]:
    """The name of a coordinate system, or three coordinates (m)."""
    if isinstance(value, str):
        return str(Label.read(value))
    if not isinstance(value, list) or len(value) != 3:
        refuse("SIT004", f"{described(value)}, where a name or [x, y, z] is wanted", "write SEAT, or [0, 0, 2.4]")
    return tuple(Coordinate.read(entry) for entry in value)


StepName = Special(
    _step_name, {"type": "string", "maxLength": 200, "pattern": r"\.([sS][tT][eE][pP]|[sS][tT][pP])$",
                 "examples": ["jaw.step"]},
)  # fmt: skip
Datum = Special(
    _datum,
    {"anyOf": [Label.schema(), {"type": "array", "items": Coordinate.schema(), "minItems": 3, "maxItems": 3}]},
)


class JawDocument(Section):
    """A grasper's jaw written out, or a preset of which single figures are your own, or a STEP file of it."""

    name: str = key(Label, "what to call it", "written out")
    based_on: str | None = key(Preset("jaw"), "a preset whose figures hold where none is written here", None)
    width: float | None = key(
        Size,
        "of the jaw; its face is the chord of a back as round as the port unless face is written. "
        "Must be there unless based_on or step is",
        None,
    )
    length: float | None = key(Size, "of that face, along the jaw; must be there unless based_on or step is", None)
    height: float | None = key(Thickness, "of one jaw, face to back; must be there unless based_on or step is", None)
    port_diameter: float | None = key(Size, "of the circle that the closed pair must pass: 5 mm if left out", None)
    material: str | ConductorDocument | None = key(ConductorChoice, "the jaw's metal: stainless-304 if left out", None)
    opposing_pad_thickness: float | None = key(Gap, "pad on the other jaw: none if left out", None)
    face: float | None = key(
        Size, "true width of the flat, measured; if left out, the chord of a back that is as round as the port", None
    )
    recess: float | None = key(
        Gap, "how far rims beside a pad pocket stand above its floor; the floor is the face then", None
    )
    pocket: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a pad pocket; as long and wide as the face if left out", None
    )
    opposing_recess: float | None = key(Gap, "as recess, of the other jaw, in which its own pad lies", None)
    opposing_pocket: tuple[float, float] | None = key(Pair(Size), "as pocket, of the other jaw", None)
    hinge: float | None = key(Gap, "from the face's heel to the pivot, along the jaw", None)
    pivot_offset: float | None = key(
        Aside, "of the pivot from the closed pair's middle, towards this jaw; negative: towards the other one", None
    )
    opening: float | None = key(Opening, "between the faces, wide open, like 60 deg", None)
    fenestration: tuple[float, float] | None = key(
        Pair(Size), "[length, width] of a window through the middle of the face; none if left out", None
    )
    step: str | None = key(StepName, "a STEP file of the jaw in the spec's folder, like jaw.step", None)
    datum: str | tuple[float, ...] | None = key(
        Datum,
        "in the STEP file, the middle of the face: [x, y, z], or the name of a coordinate system there, whose x runs "
        "to the hinge and whose z stands on the face; [0, 0, 0] if left out",
        None,
    )
    along: str | None = key(Choice(AXES), "the STEP file's axis that runs to the hinge: x if left out", None)
    up: str | None = key(Choice(AXES), "the STEP file's axis that stands on the face: z if left out", None)


JawChoice = NameOr(Preset("jaw"), Part(JawDocument))


class RetentionDocument(Section):
    """What holds the mount in the jaw besides glue: the jaw is cut for it, and drawn so."""

    kind: str = key(
        Choice(RETENTIONS[1:]),
        "dovetail: a tongue that slides in from the tip; pins: pegs in two holes through the jaw",
    )
    width: float = key(Joint, "of a dovetail's tongue where it is widest, at its bottom", 1.6)
    depth: float = key(Joint, "of a dovetail's tongue, or how long pins are, below the mount", 0.4)
    angle: float = key(Flank, "between a dovetail's flanks and the face", "60 deg")
    diameter: float = key(Joint, "of pins", 1)
    spacing: float | None = key(Joint, "of pins along the jaw: half of the board's body if left out", None)


RetentionChoice = NameOr(Choice(RETENTIONS), Part(RetentionDocument))


class HoleDocument(Section):
    """One hole through a bench plate."""

    at: tuple[float, float] = key(Place, "[x, y] from the middle of the board's body")
    diameter: float = key(Joint, "clearance for the screw: 2.4 for M2, 6.6 for M6", 2.4)
    head: float = key(Joint, "of the screw's head, which needs the room", 3.8)


HolesChoice = NameOr(Preset("hole pattern"), ListOf(Part(HoleDocument)))


class FingerDocument(Section):
    """The end of a robot's finger, over which a cap slips that carries the sensor."""

    shape: str = key(Choice(("rectangle", "circle")), "across", "rectangle")
    size: tuple[float, float] = key(
        Pair(Size, single=True), "across: [width, height], the height away from the sensor; or a diameter", [16, 10]
    )
    grip: float = key(Quantity("length", "3 mm", "100 mm"), "how far the cap reaches over it, behind the board", 8)
    screw: float = key(Quantity("length", "1.6 mm", "6 mm"), "of the two screws that clamp it: 2 for M2", 2)
    material: str | ConductorDocument | None = key(
        ConductorChoice, "its metal, which the coils see at mount.standoff; not of metal if left out", None
    )


class MountDocument(Section):
    """What carries the sensor."""

    kind: str = key(
        Choice(KINDS),
        "a pad on a grasper's jaw, a plate on the bench, a cap on a robot's finger, or a part of your own (or none: "
        "the pieces are put together all the same)",
        "grasper-pad",
    )
    jaw: str | JawDocument | None = key(
        JawChoice, "a jaw preset (with its metal), or written out; generic-5mm if left out", None
    )
    standoff: float | None = key(
        Gap,
        "height of the board over the metal: from the jaw's upper face to the board's bottom face, a shield between "
        "them included; it is filled with printed plastic. On a bench plate, the plastic below the board; on a finger, "
        "from its face. 1 mm, or more for a shield, if left out",
        None,
    )
    process: str = key(Choice(PROCESSES), "how its pieces are made: sets least walls and tolerances", "resin")
    retention: str | RetentionDocument | None = key(
        RetentionChoice, "what holds a grasper's pad, and its sizes: glue alone if left out", None
    )
    holes: str | list[HoleDocument] | None = key(
        HolesChoice, "of a bench plate: a breadboard's, a load cell's, or written out; corners-m2 if left out", None
    )
    finger: FingerDocument | None = key(
        Part(FingerDocument), "what a fingertip's cap slips over; a usual finger if left out: measure yours", None
    )
    step: str | None = key(StepName, "of a custom mount: a STEP file in the spec's folder; none if left out", None)
    datum: str | tuple[float, ...] | None = key(
        Datum,
        "in the STEP file, the middle of the face that the board's body lies on: [x, y, z], or the name of a "
        "coordinate system there; [0, 0, 0] if left out",
        None,
    )
    along: str | None = key(Choice(AXES), "the STEP file's axis that runs to the tail: x if left out", None)
    up: str | None = key(Choice(AXES), "the STEP file's axis that stands on that face: z if left out", None)
