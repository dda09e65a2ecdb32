"""The hinge behind the jaws: how near the tail comes to its pin, closed and wide open."""

from __future__ import annotations

import math

from sitscad.layout.board import Layout
from sitscad.layout.tail.stiffening import tail_thickness
from sitscad.record import record
from sitscad.scene.fit import closed_section
from sitscad.scene.grasper.jaws import fitted_jaw, jaw_range
from sitscad.scene.grasper.shaft import shaft
from sitscad.scene.tail_path import tail_path


@record
class PinGap:
    """How far the tail's nearest face runs from the pivot and the radius of the pin there (m), when, at which angle
    (rad) of the jaw, and where the pin's figure comes from.
    """

    when: str
    away: float
    pin: float
    angle: float
    source: str

    @property
    def is_free(self) -> bool:
        """Whether the tail passes the pin."""
        return self.away >= self.pin


def pin_gaps(layout: Layout) -> tuple[PinGap, ...]:
    """The tail at the pin, closed and wide open; nothing without a hinge, or a tail that is led along the jaw.

    Raises `PartsError` where the shield does not fit into the standoff.
    """
    jaw, behind, pair = fitted_jaw(layout), shaft(layout.spec), closed_section(layout)
    closed = tail_path(layout)
    if jaw is None or behind is None or pair is None or jaw.hinge is None or closed is None or closed.radius is None:
        return ()
    pivot = jaw_range(layout, jaw)[1] + jaw.hinge, pair.axis - jaw.pivot_offset
    half = (jaw.opening or 0.0) / 2
    ways = [("closed", 0.0, closed), (f"open by {math.degrees(2 * half):.3g} deg", half, tail_path(layout, half))]
    thick = tail_thickness(layout.spec)
    return tuple(
        PinGap(when, (way or closed).distance(*pivot) - thick / 2, behind.pin / 2, angle, behind.source)
        for when, angle, way in ways
    )
