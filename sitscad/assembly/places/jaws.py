"""The jaws of an instrument: cross-section, position, and the room inside the port. No CAD kernel is used."""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.assembly.places.bodies import Backing, Heights, backing_of, top_height
from sitscad.assembly.places.column import worst_deviations
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Arc, Line, Path, Point
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, half_chord

FILM_ROUNDING = 0.8
"""Radius of the encapsulation's rounded outer edges, divided by its thickness.

With a ratio below 1, the film has its full thickness everywhere.
"""


@record
class JawSection:
    """Cross-section of a jaw whose face is at height 0.

    `face` (m) is the width of the face, `height` (m) the distance from the face to the back, and `radius` (m) the
    radius of the back. `side` (m) is the length of the straight sides between face and back.
    """

    face: float
    height: float
    radius: float
    side: float

    @property
    def outline(self) -> Path:
        """Closed cross-section, counter-clockwise. The path's x is across the jaw, and its y is the height."""
        half, centre = self.face / 2, Point(0.0, self.radius - self.height)
        back = Arc(Point(-half, -self.side), Point(half, -self.side), centre)
        if self.side <= 0.0:
            return Path((back, Line(back.end, back.start)))
        upper, lower = Point(half, 0.0), Point(-half, 0.0)
        return Path((back, Line(back.end, upper), Line(upper, lower), Line(lower, back.start)))


def jaw_section(jaw: Jaw) -> JawSection:
    """Return the assumed cross-section of a jaw: a bar of the jaw's width, with a back that has the port's radius.

    The lowest point of the back is ``height`` below the face. A flat jaw has no straight sides. Its face is then
    narrower than the jaw's width: a chord of the back's arc. If the spec states a wider face, the back has a larger
    radius.
    """
    half, radius, height = (jaw.face or jaw.width) / 2, jaw.port_diameter / 2, jaw.height
    if jaw.face is not None and height < half:  # a flatter back, if the face is wider than the port's chord
        radius = max(radius, (height**2 + half**2) / (2 * height))
    chord = half_chord(height, radius)
    if chord <= half:
        return JawSection(2 * chord, height, radius, max(0.0, height - radius))
    sagitta = radius - math.sqrt(radius**2 - half**2)
    return JawSection(2 * half, height, radius, height - sagitta)


def board_middle(body: Box) -> Point:
    """Return the middle of the board's body. The jaw is centred below this point."""
    x0, y0, x1, y1 = body
    return Point((x0 + x1) / 2, (y0 + y1) / 2)


def jaw_range(body: Box, fitted: Jaw) -> tuple[float, float]:
    """Return the x range (m) of the jaw, whose length is centred below the board's body."""
    middle = board_middle(body).x
    return middle - fitted.length / 2, middle + fitted.length / 2


def pivot_along(body: Box, jaw: Jaw | None) -> float | None:
    """Return x (m) of the hinge's pivot along the jaw. None if the spec states no hinge."""
    return None if jaw is None or jaw.hinge is None else jaw_range(body, jaw)[1] + jaw.hinge


def closed_span(backing: Backing, top: float) -> Heights | None:
    """Return the heights (m) of the backs of the jaw and of the opposing jaw, closed without force.

    `top` (m) is the height of the sensor's uppermost face. None if there is no jaw. The jaws are parallel, so the axis
    of the closed jaws is halfway between these heights.
    """
    mount, seat = backing.mount, backing.seat_heights
    if mount is None or mount.jaw is None or seat is None:
        return None
    return seat[0] - mount.jaw.height, top + mount.jaw.opposing_pad_thickness + mount.jaw.height


def seat_half_width(layout: Layout, z: float) -> float:
    """Return half the width (m) of seat and shield at height z: the board's, or less if the port is narrow.

    In a narrow port, both are narrower than the board, so that they stay inside the port's circle with worst-case glue
    and tolerances.
    """
    return min(layout.body_size[1] / 2, free_half_width(layout, z))


def free_half_width(layout: Layout, z: float) -> float:
    """Return half the width (m) available inside port and pad pocket at height z, in the worst case.

    Infinite if there is no jaw, or if the height is above the pocket's rims.
    """
    jaw, span = layout.spec.jaw, closed_span(backing_of(layout.spec), top_height(layout.spec))
    if jaw is None or span is None:
        return math.inf
    half = math.inf
    if jaw.pocket is not None and z - (span[0] + jaw.height) <= jaw.recess - 1e-9:
        half = jaw.pocket[1] / 2 - POCKET_CLEARANCE
    radius, height = seat_circle_radius(jaw, worst_deviations(layout)), z - (span[0] + span[1]) / 2
    return min(half, math.sqrt(radius**2 - height**2)) if abs(height) < radius else half


def seat_circle_radius(jaw: Jaw, shifts: tuple[float, float]) -> float:
    """Return the radius (m) of the circle for seat and shield: the port's radius minus the worst shifts (m).

    Shifts by glue and tolerances come from `sitscad.assembly.places.column.worst_deviations`.
    """
    return jaw.port_diameter / 2 - math.hypot(*shifts)


POCKET_CLEARANCE = 0.1e-3  # Between a pad pocket's walls and what is glued into it, on each side (m)
"""Gap (m) on each side between the walls of a pad pocket and parts glued into it."""


def jaw_with_rims(jaw: Jaw) -> Jaw:
    """Return the jaw with its height increased up to the rims of its pad pocket. Without a pocket: the jaw itself."""
    return replace(jaw, height=jaw.height + jaw.recess) if jaw.pocket is not None and jaw.recess else jaw
