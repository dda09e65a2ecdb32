"""States of a sensor (coil alone, assembled, pressed), and poses of the target relative to rest."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sitscad.basics.record import record

Vector = tuple[float, float, float]


@record
class Pose:
    """A rigid motion of the target from its position at rest, in board axes.

    It has the displacement (m) of the centre of the target's lower face, and a rotation R = Rx(rx) Ry(ry) Rz(rz) (rad,
    right-handed) about this centre. Board axes: x along the jaw towards the tail, y across, z away from the board. A
    positive `ry` moves the target's +x side nearer to the board. A negative `z` is a press.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    rx: float = 0.0
    ry: float = 0.0
    rz: float = 0.0

    @property
    def rotation(self) -> tuple[Vector, Vector, Vector]:
        """Rows of the matrix R, which transforms the target's own coordinates to board axes."""
        (a, b, c), (p, q, r) = (
            (math.cos(angle) for angle in (self.rx, self.ry, self.rz)),
            (math.sin(angle) for angle in (self.rx, self.ry, self.rz)),
        )
        return (
            (b * c, -b * r, q),
            (a * r + p * q * c, a * c - p * q * r, -p * b),
            (p * r - a * q * c, p * c + a * q * r, a * b),
        )

    def moved_point(self, point: Vector, centre: Vector) -> Vector:
        """Return the new position of a point (m) of the target. `centre` is the centre of its lower face at rest."""
        arm = tuple(point[k] - centre[k] for k in range(3))
        shift = (self.x, self.y, self.z)
        x, y, z = (
            centre[k] + shift[k] + math.fsum(row[j] * arm[j] for j in range(3)) for k, row in enumerate(self.rotation)
        )
        return x, y, z


REST_POSE = Pose()

FREE, REST, PRESSED = "free", "rest", "pressed"
"""Names of the computed states: coil alone, assembled sensor without load, and sensor under the required force."""

TANK, SIGNAL = "tank", "signal"


@record
class StateKind:
    """Definition of a state: its names, its load, and the rules that apply to it.

    `text` is its name in a sentence, and `title` in the head of a table row. `load` holds the fractions of the required
    normal force and of the required shear along x and y that act on the target. It is None for the coil without target,
    jaw and neighbours. `judged_by` holds `TANK` if the rules on frequency, parallel resistance and amplitude apply to
    the state. It holds `SIGNAL` if each coil must detect the change from rest to the state.
    """

    name: str
    text: str
    title: str
    load: tuple[float, float, float] | None
    judged_by: tuple[str, ...]

    @property
    def is_pressed(self) -> bool:
        """Whether a load acts on the target."""
        return self.load is not None and any(self.load)

    @property
    def is_straight(self) -> bool:
        """Whether no shear acts on the target, so that it does not move sideways."""
        return self.load is None or not any(self.load[1:])




def require_within_requirements(kinds: tuple[StateKind, ...]) -> tuple[StateKind, ...]:
    """Return the states unchanged.

    Raises ValueError if a load exceeds the required forces, for which strain, range, calibration and driver are
    checked.
    """
    for kind in kinds:
        if kind.load is not None and not (0.0 <= kind.load[0] <= 1.0 and math.hypot(*kind.load[1:]) <= 1.0):
            raise ValueError(f"state {kind.name}: its load {kind.load} exceeds the required forces, which are 1")
    return kinds


STATES = require_within_requirements((
    StateKind(FREE, "alone in free air", "free (coil alone)", None, ()),
    StateKind(REST, "at rest", "at rest (assembled)", (0.0, 0.0, 0.0), (TANK,)),
    StateKind(PRESSED, "pressed", "pressed (required force)", (1.0, 0.0, 0.0), (TANK, SIGNAL)),
))
"""States of each sensor with the necessary parts, in the order in which they are shown."""

_KINDS = {kind.name: kind for kind in STATES}

BEHIND_THE_BOARD = "behind_the_board"
"""Name of the gap between the board and the metal behind it, which is not a state."""

MOVED_SIDEWAYS = "no numbers for this state: shear moves its target sideways; `response` computes such loads"
"""Message for a state with shear. Scatter and plate ratios are known only for loads without shear."""


@record
class WorkingPoint:
    """A normal load at which a sensor's performance is stated.

    `share` is the load as a fraction of the full load. `text` describes the load in reports.
    """

    name: str
    text: str
    share: float


WORKING_POINTS = tuple(sorted((
    WorkingPoint("rest", "at rest", 0.0),
    WorkingPoint("half", "at half load", 0.5),
    WorkingPoint("full", "at full load", 1.0),
    *(WorkingPoint(kind.name, kind.text, kind.load[0])
      for kind in STATES if kind.load is not None and kind.is_straight and kind.name not in (REST, PRESSED)),
), key=lambda point: (point.share, point.name == "full")))
"""Loads at which performance is stated: rest first, full load last, loads of further states between them."""


@record
class State:
    """A named state: pose of the target, force (N) on the target, and temperature (degrees Celsius) of all metal.

    If the pose is None, the coil is alone: without target, jaw and neighbours.
    """

    name: str
    pose: Pose | None = None
    force: float = 0.0
    temperature: float = 20.0

    @property
    def is_free(self) -> bool:
        """Whether the coil is alone, without target, jaw and neighbours."""
        return self.pose is None


def working_states(names: Iterable[str]) -> list[str]:
    """Return the names of the states in which the sensor is used. If the coil is only computed alone: all names."""
    every = list(names)
    return [name for name in every if name not in _KINDS or TANK in _KINDS[name].judged_by] or every


def state_text(state: str) -> str:
    """Return the name of a state in a sentence, like ``at rest``."""
    return _KINDS[state].text if state in _KINDS else state


def state_title(state: str) -> str:
    """Return the name of a state at the head of a row, like ``at rest (assembled)``."""
    return _KINDS[state].title if state in _KINDS else state.replace("_", " ")
