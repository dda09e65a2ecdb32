"""Ways in which a sensor is pushed in use, as they are written: a section each."""

from __future__ import annotations

from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.word import Choice
from sitscad.spec.format.section import Part, Section, key

Normal = Quantity("force", "0 N", "10 kN")
Shear = Quantity("force", "-10 kN", "10 kN")
Tension = Quantity("force", "0 N", "10 kN")
Opening = Quantity("angle", "0 deg", "15 deg")
FaceAngle = Quantity("angle", "-5 deg", "7.5 deg")
LeverAngle = Quantity("angle", "0.1 deg", "89.9 deg")
Arm = Quantity("length", "0.1 mm", "100 mm")
Reach = Quantity("length", "1 mm", "200 mm")
Beside = Pair(Quantity("length", "-100 mm", "100 mm"))
Rotation = Choice(("free", "held"))
Face = Choice(("sticks", "slides"))
NORMAL = "towards the board; requirements.normal_force if left out"


class PressDocument(Section):
    """A flat face presses straight down and keeps the target level."""

    normal: float | None = key(Normal, NORMAL, None)


class ShearDocument(Section):
    """A press with shear."""

    normal: float | None = key(Normal, NORMAL, None)
    shear_x: float = key(Shear, "along the jaw, towards the tail", "0 N")
    shear_y: float = key(Shear, "across", "0 N")
    rotation: str = key(Rotation, "free: the target tilts as it likes; held: a flat face keeps it level", "held")


class ScissorDocument(Section):
    """The face of the other jaw comes down inclined and turns the target until it lies flush."""

    opening: float = key(Opening, "between the faces, nearest at the tail, like 10 deg")
    normal: float | None = key(Normal, NORMAL, None)
    face: str = key(Face, "sticks: the target stays under it; slides: it pushes along its own normal alone", "sticks")


class EdgeDocument(Section):
    """A force beside the middle of the target, which tilts it."""

    normal: float | None = key(Normal, NORMAL, None)
    offset: tuple[float, float] = key(Beside, "[x, y] from the middle of the outermost face, like [1, 0]")


class MechanismDocument(Section):
    """A grasper's jaws, closed by a pull on its shaft (Jones thesis 3.3.1.1); see docs/mechanism.md."""

    shaft_tension: float = key(Tension, "the pull on the shaft that closes the jaws, like 20 N")
    theta0: float = key(LeverAngle, "of lever A from the shaft's axis when the face lies along it, like 21.80 deg")
    LA: float = key(Arm, "lever A, from the pivot to the link's pin, like 3.770")
    LB: float = key(Arm, "link B, from lever A's pin to the shaft's, like 3.200")
    LJ: float | None = key(Reach, "from the pivot to where the jaw presses; the tip of mount.jaw if left out", None)
    theta: float = key(FaceAngle, "of a jaw's face from the axis; the faces are open by twice that", "0 deg")


class LoadsDocument(Section):
    """Ways in which the sensor is pushed in use, for `sitscad response --case`."""

    press: PressDocument | None = key(Part(PressDocument), "a flat press", None)
    shear: ShearDocument | None = key(Part(ShearDocument), "a press with shear", None)
    scissor: ScissorDocument | None = key(Part(ScissorDocument), "the other jaw's face comes down inclined", None)
    edge: EdgeDocument | None = key(Part(EdgeDocument), "a force off centre", None)
    mechanism: MechanismDocument | None = key(Part(MechanismDocument), "a grasper's shaft is pulled", None)
