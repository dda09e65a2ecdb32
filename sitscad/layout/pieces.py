"""The pieces of copper that a board is drawn with: tracks, holes, contacts, teardrops, each with its net."""

from __future__ import annotations

from enum import StrEnum

from sitscad.geometry.path import Path, Point
from sitscad.record import record


class Role(StrEnum):
    """What a piece of copper is for."""

    WINDING = "winding"
    STUB = "stub"
    LEAD = "lead"
    TAIL = "tail"


@record
class Trace:
    """A track of constant width along a path, on copper layer `layer` (from 1 at the top)."""

    path: Path
    width: float
    layer: int
    net: str
    role: Role


@record
class Via:
    """A plated hole with the same round pad on every copper layer that it goes through.

    ``lowest`` is the last of them, from the top (a hole in a tail of fewer layers); None where it goes through all.
    """

    centre: Point
    drill: float
    pad: float
    net: str
    lowest: int | None = None


@record
class Pad:
    """A rectangular contact: centre and size [x, y] in metres, its net and its pin (``C1.A``, ``C1.B``).

    ``reference`` is the part that it belongs to: the contacts of the tail, or a capacitor. Net and pin are empty where
    the connector has more contacts than the coils.
    """

    centre: Point
    size: tuple[float, float]
    layer: int
    net: str
    pin: str
    number: int
    reference: str = "J1"

    @property
    def is_unused(self) -> bool:
        """Whether it is a contact that no coil has: copper without a net."""
        return not self.net

    @property
    def name(self) -> str:
        """What people call it: its pin, or its number where it is unused."""
        return self.pin or f"{self.number} (unused)"

    def holds(self, point: Point) -> bool:
        """Whether a point lies on it."""
        (x, y), (w, h) = self.centre, self.size
        return abs(point.x - x) <= w / 2 and abs(point.y - y) <= h / 2


@record
class Teardrop:
    """A filled outline on a copper layer, at one end (``origin``) of one of the layout's tracks (its index)."""

    outline: Path
    layer: int
    net: str
    track: int
    at_start: bool
    origin: Point
