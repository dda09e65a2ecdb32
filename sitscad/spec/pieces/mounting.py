"""What carries the sensor: a grasper's jaw, a bench, a robot's finger, or a part of the user's own; in SI units."""

from __future__ import annotations

from sitscad.geometry.shapes import PLATES, Outline
from sitscad.record import record
from sitscad.spec.materials import Conductor


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
class Jaw:
    """One jaw of a grasper: the face that carries the sensor and the metal behind it.

    ``height`` is that of one jaw, face to back; ``port_diameter`` is the circle that the closed pair must pass.
    ``face`` (m) is the flat's true width where it is measured, None where it is the chord of a back as round as the
    port. In a jaw with a pad pocket the face is the pocket's floor, ``pocket`` its length and width, and the rims
    beside it stand ``recess`` above it; ``opposing_pocket`` and ``opposing_recess`` are those of the other jaw.
    ``hinge`` is from the face's heel to the pivot, ``pivot_offset`` how far that lies beside the closed pair's middle,
    towards this jaw; ``opening`` (rad) is the angle between the faces when wide open; ``fenestration`` is the length
    and width of a window through the face. ``preset`` names where figures come from that the spec does not write,
    ``written`` are those that it does; ``step`` is its solid where a STEP file has it.
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
    opposing_recess: float = 0.0
    opposing_pocket: tuple[float, float] | None = None
    pivot_offset: float = 0.0
    preset: str = ""
    written: tuple[str, ...] = ()
    step: StepPart | None = None


@record
class Retention:
    """What holds a mount in its jaw besides glue: a dovetail's tongue (``width`` at its bottom, ``depth``, ``angle``
    between flank and face) or two pins (``diameter``, ``depth`` below the mount, ``spacing`` along the jaw).
    """

    kind: str
    width: float = 1.6e-3
    depth: float = 0.4e-3
    angle: float = 1.0471975511965976
    diameter: float = 1e-3
    spacing: float | None = None


@record
class Hole:
    """A screw's hole: its place from the pattern's middle, its diameter and that of the screw's head (m)."""

    at: tuple[float, float]
    diameter: float
    head: float


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
class Finger:
    """The end of a robot's finger: ``size`` across and away from the sensor, ``grip`` how far a cap reaches over it,
    ``screw`` the nominal diameter of its two clamping screws (m); its metal, None where it is of plastic.
    """

    shape: str
    size: tuple[float, float]
    grip: float
    screw: float
    material: Conductor | None = None

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class Mount:
    """What carries the sensor: ``standoff`` is from the metal's face to the board's bottom face (m), ``process`` how
    its pieces are made (resin, powder, filament, machined).

    ``step`` is a mount of the user's own, or the jaw where only a STEP file says how large that is; ``backing`` is the
    metal behind the coils where that is not a jaw's.
    """

    kind: str
    jaw: Jaw | None
    standoff: float
    process: str = "resin"
    retention: Retention | None = None
    holes: HolePattern | None = None
    finger: Finger | None = None
    step: StepPart | None = None
    backing: Conductor | None = None

    @property
    def metal(self) -> Conductor | None:
        """The metal that the coils see at the standoff; None where there is none."""
        return self.jaw.material if self.jaw is not None else self.backing

    @property
    def is_jaw_unmeasured(self) -> bool:
        """Whether its jaw is known by a STEP file alone, without a figure that rules could go by."""
        return self.kind == "grasper-pad" and self.jaw is None
