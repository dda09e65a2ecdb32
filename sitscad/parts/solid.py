"""A solid: one named, coloured piece of the sensor or of what carries it."""

from __future__ import annotations

from typing import Any

from sitscad.record import record
from sitscad.scene.bodies import BodyRole
from sitscad.scene.jaws import PartsError as PartsError


@record
class Solid:
    """One piece in its place in the sensor.

    ``shape`` is a build123d ``Solid`` in **millimetres**, CAD's unit (all else in sitscad is SI): x along the jaw
    towards the handle, y across it, z = 0 at the board's top face. ``colour`` is ``#rrggbb``.
    """

    name: str
    shape: Any
    material: str
    colour: str
    role: BodyRole

    @property
    def volume(self) -> float:
        """Exact volume in cubic metres."""
        return float(self.shape.volume) * 1e-9

    @property
    def rgb(self) -> tuple[float, float, float]:
        """The colour as three numbers from 0 to 1."""
        red, green, blue = (int(self.colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
        return red, green, blue

    @property
    def linear_rgb(self) -> tuple[float, float, float]:
        """The same as light is counted (IEC 61966-2-1 undone), which is what glTF and build123d take."""
        red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in self.rgb)
        return red, green, blue


def of_role(solids: tuple[Solid, ...], *roles: BodyRole) -> tuple[Solid, ...]:
    """The solids that have one of the roles, in their order."""
    return tuple(solid for solid in solids if solid.role in roles)
