"""How the jaws close about their hinge: on which tissue the faces are parallel, and how they tilt on thicker."""

from __future__ import annotations

import math

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.fit import closed_section
from sitscad.scene.grasper.jaws import axis, fitted_jaw, jaw_range


@record
class Closing:
    """A pair of jaws that turn by equal angles about one pivot, as grasped tissue sees them.

    ``parallel_at`` is the grasped thickness (m) at which the faces are parallel, negative where the sensor is too thick
    for that; ``reach`` is from the pivot to the sensor's middle (m), None where the jaw's hinge is not known;
    ``opening`` the angle (rad) between the faces, wide open; ``offset`` how far the pivot lies beside the middle.
    """

    parallel_at: float
    reach: float | None
    opening: float | None
    offset: float = 0.0

    def tilt(self, thickness: float) -> float | None:
        """The angle (rad) between the faces on tissue of a thickness (m) at the sensor's middle: positive where the
        jaws stand open towards the tip, so that it touches at the heel first. None without a hinge.

        Each face goes round the pivot by half the angle, half of `parallel_at` beside it: the gap is 2 reach
        sin(tilt/2) + parallel_at cos(tilt/2), a single sine whose amplitude is the hypotenuse of both factors. A pivot
        beside the middle changes nothing of it, because both faces turn about the same point.
        """
        if self.reach is None:
            return None
        amplitude, lag = math.hypot(2.0 * self.reach, self.parallel_at), math.atan2(self.parallel_at, 2.0 * self.reach)
        sine = thickness / amplitude
        return 2.0 * (math.asin(sine) - lag) if abs(sine) <= 1.0 else None

    def slide(self, thickness: float) -> float | None:
        """How far (m) the faces have still to slide along each other, from this thickness of tissue until they are
        parallel: twice the pivot's offset times the sine of half the angle between them. Positive where this jaw's face
        moves towards the tip while closing.
        """
        tilt = self.tilt(thickness)
        return None if tilt is None else 2.0 * self.offset * math.sin(tilt / 2.0)

    @property
    def most(self) -> float | None:
        """The thickest tissue (m) that goes between the faces at the sensor's middle, wide open; None if not known."""
        if self.reach is None or self.opening is None:
            return None
        half = self.opening / 2.0
        return self.parallel_at * math.cos(half) + 2.0 * self.reach * math.sin(half)


def closing(layout: Layout) -> Closing | None:
    """How the sensor's jaws close; None without a jaw. Raises `PartsError` where the shield does not fit.

    Backs that lie on the port's circle are parallel when the pair is as high as the port: what the closed pair with the
    sensor leaves of that is the tissue's.
    """
    jaw, pair = fitted_jaw(layout), closed_section(layout)
    if jaw is None or pair is None:
        return None
    heel = jaw_range(layout, jaw)[1]
    reach = None if jaw.hinge is None else heel + jaw.hinge - axis(layout).x
    return Closing(jaw.port_diameter - pair.height, reach, jaw.opening, jaw.pivot_offset)
