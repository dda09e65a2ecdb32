"""Load cases of a sensor in use: as written in a spec, and as forces on the target."""

from __future__ import annotations

from sitscad.basics.record import record
from sitscad.spec.format.kinds import Choice, Pair, UnitValue
from sitscad.spec.format.section import Part, Section, key

Force = UnitValue("force", "0 N", "10 kN")
Shear = UnitValue("force", "-10 kN", "10 kN")
LeverArm = UnitValue("length", "0.1 mm", "100 mm")
NORMAL = "towards the board; default requirements.normal_force"


class PressDocument(Section):
    """A flat face presses straight down and keeps the target level."""

    normal: float | None = key(Force, NORMAL, None)


class ShearDocument(Section):
    """A press with shear."""

    normal: float | None = key(Force, NORMAL, None)
    shear_x: float = key(Shear, "along the jaw, towards the tail", "0 N")
    shear_y: float = key(Shear, "across", "0 N")
    rotation: str = key(
        Choice(("free", "held")), "free: the target can tilt; held: a flat face keeps it level", "held"
    )


class ScissorDocument(Section):
    """The face of the other jaw closes at an angle and turns the target until it is flush."""

    opening: float = key(UnitValue("angle", "0 deg", "15 deg"), "between the faces, nearest at the tail, like 10 deg")
    normal: float | None = key(Force, NORMAL, None)
    face: str = key(
        Choice(("sticks", "slides")),
        "sticks: the face holds the target in x and y; slides: it pushes only along its own normal", "sticks",
    )


class EdgeDocument(Section):
    """A force beside the middle of the target, which tilts it."""

    normal: float | None = key(Force, NORMAL, None)
    offset: tuple[float, float] = key(
        Pair(UnitValue("length", "-100 mm", "100 mm")), "[x, y] from the middle of the outermost face, like [1, 0]"
    )


@record
class Mechanism(Section):
    """A grasper's jaws, closed by a pull on its shaft (Jones thesis 3.3.1.1); see docs/mechanism.md.

    Newtons, radians and metres. ``reach`` is None only until the resolver takes it from the jaw.
    """

    shaft_tension: float = key(Force, "the pull on the shaft that closes the jaws, like 20 N")
    theta0: float = key(
        UnitValue("angle", "0.1 deg", "89.9 deg"),
        "of lever A from the shaft's axis when the face lies along it, like 21.80 deg",
    )
    lever: float = key(LeverArm, "lever A, from the pivot to the link's pin, like 3.770", written="LA")
    link: float = key(LeverArm, "link B, from lever A's pin to the shaft's, like 3.200", written="LB")
    reach: float = key(
        UnitValue("length", "1 mm", "200 mm"),
        "from the pivot to the point where the jaw presses; default the tip of mount.jaw", None, written="LJ",
    )
    theta: float = key(
        UnitValue("angle", "-5 deg", "7.5 deg"), "between a jaw's face and the axis; the angle between the faces is "
        "twice this",
        "0 deg",
    )


class LoadsDocument(Section):
    """Load cases of the sensor in use, for `sitscad response --case`."""

    press: PressDocument | None = key(Part(PressDocument), "a flat press", None)
    shear: ShearDocument | None = key(Part(ShearDocument), "a press with shear", None)
    scissor: ScissorDocument | None = key(Part(ScissorDocument), "the other jaw's face closes at an angle", None)
    edge: EdgeDocument | None = key(Part(EdgeDocument), "a force off centre", None)
    mechanism: Mechanism | None = key(Part(Mechanism), "a pull on a grasper's shaft", None)


@record
class LoadCase:
    """A load on the target: forces (N) towards the board and along x and y.

    * ``offset``: point (m) at which the force acts, from the middle of the sensor's outermost face
    * ``opening``: tilt (rad) about y of the pressing face, on which the target lies flush. The tilted face is nearest
      to the board at +x.
    * ``is_held``: True if the pressing face keeps the target level
    * ``is_stuck``: True if friction at the pressing face prevents motion in x and y. If False, the face slides and
      pushes along its own normal, and ``normal`` is the component towards the board.
    * ``mechanism``: the jaws' levers, from which the normal force is computed. ``normal`` is then None.
    """

    name: str
    normal: float | None
    shear: tuple[float, float] = (0.0, 0.0)
    offset: tuple[float, float] = (0.0, 0.0)
    opening: float = 0.0
    is_held: bool = True
    is_stuck: bool = False
    mechanism: Mechanism | None = None
