"""How the jaws close about their hinge: on which tissue the faces are parallel, and how they tilt on thicker."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.measured import Closing
from sitscad.scene.fit import closed_section
from sitscad.scene.grasper.jaws import axis, fitted_jaw, jaw_range


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
