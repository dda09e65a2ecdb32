"""How the jaws close about their hinge: on which tissue the faces are parallel, and how they tilt on thicker."""

from __future__ import annotations

import math

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.fit import closed_section
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range


@record
class Closing:
    """A pair of jaws that turn by equal angles about pivots on their axis, as grasped tissue sees them.

    ``parallel_at`` is the grasped thickness (m) at which the faces are parallel, negative where the sensor is too thick
    for that; ``reach`` is from the pivot to the sensor's middle (m), None where the jaw's hinge is not known;
    ``opening`` the angle (rad) between the faces, wide open.
    """

    parallel_at: float
    reach: float | None
    opening: float | None

    def tilt(self, thickness: float) -> float | None:
        """The angle (rad) between the faces on tissue of a thickness (m) at the sensor's middle: positive where the
        jaws stand open towards the tip, so that it touches at the heel first. None without a hinge.

        Each face goes round its pivot by half the angle, so its middle moves by the chord 2 reach sin(tilt/4) nearly
        straight up: reach sin(tilt/2) across the axis.
        """
        if self.reach is None:
            return None
        sine = (thickness - self.parallel_at) / (2.0 * self.reach)
        return 2.0 * math.asin(sine) if abs(sine) <= 1.0 else None

    @property
    def most(self) -> float | None:
        """The thickest tissue (m) that goes between the faces at the sensor's middle, wide open; None if not known."""
        if self.reach is None or self.opening is None:
            return None
        return self.parallel_at + 2.0 * self.reach * math.sin(self.opening / 2.0)


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
    return Closing(jaw.port_diameter - pair.height, reach, jaw.opening)
