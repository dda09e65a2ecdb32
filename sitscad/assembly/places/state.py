"""The states that a sensor is looked at in (alone, assembled, pressed), and where the target has gone from rest."""

from __future__ import annotations

import math

from sitscad.basics.record import record

Vector = tuple[float, float, float]


@record
class Pose:
    """A rigid motion of the target from rest, in board axes: the displacement (m) of the centre of its near face, and
    a turn R = Rx(rx) Ry(ry) Rz(rz) (rad, right-handed) about that centre.

    Board axes: x along the jaw towards the tail, y across, z away from the board. So a positive `ry` brings the
    target's +x side nearer to the board, and a negative `z` is a press.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    rx: float = 0.0
    ry: float = 0.0
    rz: float = 0.0

    @property
    def rotation(self) -> tuple[Vector, Vector, Vector]:
        """R as rows: it takes the target's own coordinates to board axes."""
        (a, b, c), (p, q, r) = (
            (math.cos(angle) for angle in (self.rx, self.ry, self.rz)),
            (math.sin(angle) for angle in (self.rx, self.ry, self.rz)),
        )
        return (
            (b * c, -b * r, q),
            (a * r + p * q * c, a * c - p * q * r, -p * b),
            (p * r - a * q * c, p * c + a * q * r, a * b),
        )

    def moved(self, point: Vector, centre: Vector) -> Vector:
        """Where a point (m) of the target goes; `centre` is that of its near face at rest."""
        away = tuple(point[k] - centre[k] for k in range(3))
        gone = (self.x, self.y, self.z)
        x, y, z = (
            centre[k] + gone[k] + math.fsum(row[j] * away[j] for j in range(3)) for k, row in enumerate(self.rotation)
        )
        return x, y, z


REST_POSE = Pose()

FREE, REST, PRESSED = "free", "rest", "pressed"

_WORDS = {FREE: "alone in free air", REST: "at rest", PRESSED: "pressed"}
_TITLES = {FREE: "free (coil alone)", REST: "at rest (assembled)", PRESSED: "pressed (required force)"}

NAMED = tuple(_TITLES)  # The states that every sensor of these parts has, in the order in which they are shown


@record
class State:
    """One state by its name: where the target is, the force (N) that presses it there, and the temperature (degrees
    Celsius) of all metal. Without a pose there is nothing round the coil: neither target nor jaw nor neighbours.
    """

    name: str
    pose: Pose | None = None
    force: float = 0.0
    temperature: float = 20.0

    @property
    def is_free(self) -> bool:
        """Whether the coil is alone."""
        return self.pose is None


def in_words(state: str) -> str:
    """A state as a sentence names it: at rest."""
    return _WORDS.get(state, state)


def titled(state: str) -> str:
    """A state as the head of a row names it: at rest (assembled)."""
    return _TITLES.get(state, state.replace("_", " "))
