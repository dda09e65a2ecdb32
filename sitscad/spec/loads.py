"""Load cases, the ways in which a sensor is pushed in use, as they are written and as values. SI units."""

from __future__ import annotations

from sitscad.record import record
from sitscad.spec.kinds import Choice, Pair, Quantity
from sitscad.spec.section import Part, Section, key

Force = Quantity("force", "0 N", "10 kN")
Shear = Quantity("force", "-10 kN", "10 kN")
LeverArm = Quantity("length", "0.1 mm", "100 mm")
NORMAL = "towards the board; requirements.normal_force if left out"


class PressDocument(Section):
    """A flat face presses straight down and keeps the target level."""

    normal: float | None = key(Force, NORMAL, None)


class ShearDocument(Section):
    """A press with shear."""

    normal: float | None = key(Force, NORMAL, None)
    shear_x: float = key(Shear, "along the jaw, towards the tail", "0 N")
    shear_y: float = key(Shear, "across", "0 N")
    rotation: str = key(
        Choice(("free", "held")), "free: the target tilts as it likes; held: a flat face keeps it level", "held"
    )


class ScissorDocument(Section):
    """The face of the other jaw comes down inclined and turns the target until it lies flush."""

    opening: float = key(Quantity("angle", "0 deg", "15 deg"), "between the faces, nearest at the tail, like 10 deg")
    normal: float | None = key(Force, NORMAL, None)
    face: str = key(
        Choice(("sticks", "slides")),
        "sticks: the target stays under it; slides: it pushes along its own normal alone",
        "sticks",
    )


class EdgeDocument(Section):
    """A force beside the middle of the target, which tilts it."""

    normal: float | None = key(Force, NORMAL, None)
    offset: tuple[float, float] = key(
        Pair(Quantity("length", "-100 mm", "100 mm")), "[x, y] from the middle of the outermost face, like [1, 0]"
    )


@record
class Mechanism(Section):
    """A grasper's jaws, closed by a pull on its shaft (Jones thesis 3.3.1.1); see docs/mechanism.md.

    Newtons, radians and metres; ``reach`` is None only until the jaw says it.
    """

    shaft_tension: float = key(Force, "the pull on the shaft that closes the jaws, like 20 N")
    theta0: float = key(
        Quantity("angle", "0.1 deg", "89.9 deg"),
        "of lever A from the shaft's axis when the face lies along it, like 21.80 deg",
    )
    lever: float = key(LeverArm, "lever A, from the pivot to the link's pin, like 3.770", written="LA")
    link: float = key(LeverArm, "link B, from lever A's pin to the shaft's, like 3.200", written="LB")
    reach: float = key(
        Quantity("length", "1 mm", "200 mm"),
        "from the pivot to where the jaw presses; the tip of mount.jaw if left out",
        None,
        written="LJ",
    )
    theta: float = key(
        Quantity("angle", "-5 deg", "7.5 deg"),
        "of a jaw's face from the axis; the faces are open by twice that",
        "0 deg",
    )


class LoadsDocument(Section):
    """Ways in which the sensor is pushed in use, for `sitscad response --case`."""

    press: PressDocument | None = key(Part(PressDocument), "a flat press", None)
    shear: ShearDocument | None = key(Part(ShearDocument), "a press with shear", None)
    scissor: ScissorDocument | None = key(Part(ScissorDocument), "the other jaw's face comes down inclined", None)
    edge: EdgeDocument | None = key(Part(EdgeDocument), "a force off centre", None)
    mechanism: Mechanism | None = key(Part(Mechanism), "a grasper's shaft is pulled", None)


@record
class LoadCase:
    """A way in which the target is pushed: forces (N) towards the board and along x and y, at `offset` (m) from the
    middle of the outermost face.

    With `opening` (rad) a face, inclined by so much about y and nearest to the board at +x, lies flush on the target.
    It keeps it where it is along x and y (`is_stuck`), or slides and pushes along its own normal, `normal` being the
    part towards the board. `is_held`: a face keeps the target's turn. `mechanism` says where the normal force comes
    from, which is then None here.
    """

    name: str
    normal: float | None
    shear: tuple[float, float] = (0.0, 0.0)
    offset: tuple[float, float] = (0.0, 0.0)
    opening: float = 0.0
    is_held: bool = True
    is_stuck: bool = False
    mechanism: Mechanism | None = None
