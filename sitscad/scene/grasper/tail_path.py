"""How the tail runs once the sensor lies in its jaw: from the body down to the jaw's face, along it, past the hinge.

Lengths count along the middle of the tail's thickness, which a bend neither stretches nor shortens.
"""

from __future__ import annotations

import math

from sitscad.layout.board import Layout
from sitscad.layout.tail.bending import bend_radius, bend_stretch
from sitscad.record import record
from sitscad.scene.gaps import metal_face
from sitscad.scene.grasper.jaws import fitted_jaw, jaw_range
from sitscad.scene.grasper.seating import relief
from sitscad.scene.stack import tail_heights

LEAST = 1e-6
"""Drops and turns (m, rad) below this are none."""


@record
class Stretch:
    """A part of the tail's middle line: its length (m), and the angle (rad) that it turns upwards by over that."""

    length: float
    turn: float = 0.0


@record
class Station:
    """A place on the tail's middle line: along the jaw and upwards (m), and its direction above the jaw's (rad)."""

    x: float
    z: float
    angle: float

    def after(self, stretch: Stretch, length: float | None = None) -> Station:
        """The place at the end of a stretch that begins here, or after so much (m) of it."""
        run = stretch.length if length is None else length
        if not stretch.turn:
            return Station(self.x + run * math.cos(self.angle), self.z + run * math.sin(self.angle), self.angle)
        radius = stretch.length / stretch.turn
        end = self.angle + run / radius
        dx, dz = math.sin(end) - math.sin(self.angle), math.cos(self.angle) - math.cos(end)
        return Station(self.x + radius * dx, self.z + radius * dz, end)

    def distance(self, stretch: Stretch, x: float, z: float) -> float:
        """The least distance (m) of a point from a stretch that begins here."""
        ahead, across = x - self.x, z - self.z
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        ahead, across = ahead * cosine + across * sine, across * cosine - ahead * sine
        if not stretch.turn:
            return math.hypot(ahead - min(max(ahead, 0.0), stretch.length), across)
        radius = stretch.length / stretch.turn
        side = math.copysign(1.0, radius)
        turned = math.atan2(ahead, side * (radius - across))  # where on the circle the point lies, from here on
        if 0.0 <= turned <= abs(stretch.turn):
            return abs(math.hypot(ahead, radius - across) - abs(radius))
        end = self.after(stretch)
        return min(math.hypot(ahead, across), math.hypot(x - end.x, z - end.z))


@record
class TailPath:
    """The tail's way: where its middle line begins, at the end of the board's body, and its stretches from there.

    ``radius`` is the inside radius (m) of its bends, None where it has none; ``reason`` says why it is drawn straight
    where it ought not to be.
    """

    start: Station
    stretches: tuple[Stretch, ...]
    radius: float | None = None
    reason: str = ""

    @property
    def length(self) -> float:
        """All of it (m)."""
        return math.fsum(stretch.length for stretch in self.stretches)

    def at(self, length: float) -> Station:
        """The place after so much (m) of the tail."""
        here = self.start
        for stretch in self.stretches:
            if length <= stretch.length:
                return here.after(stretch, length)
            here, length = here.after(stretch), length - stretch.length
        return here

    def distance(self, x: float, z: float) -> float:
        """The least distance (m) of a point from the tail's middle line."""
        here, found = self.start, math.hypot(x - self.start.x, z - self.start.z)
        for stretch in self.stretches:
            found = min(found, here.distance(stretch, x, z))
            here = here.after(stretch)
        return found


def tail_path(layout: Layout, turned: float = 0.0) -> TailPath | None:
    """The way of the tail; None for a board without one. `turned` (rad) is the angle that the jaw stands open by
    against the shaft.

    It leaves the body level, over the seat's tongue where that has one, and goes down to the jaw's face by two bends of
    the radius that is asked for, or of the least that the fabricator allows; it follows that face, and turns into the
    shaft under the pivot.
    """
    tail = layout.spec.fpc.tail
    if tail is None or layout.tail_length <= 0.0:
        return None
    low, high = tail_heights(layout)
    start = Station(layout.body[2], (low + high) / 2, 0.0)
    straight = TailPath(start, (Stretch(layout.tail_length),))
    jaw, metal, stretch = fitted_jaw(layout), metal_face(layout.spec), bend_stretch(layout)
    if jaw is None or metal is None:
        return straight
    reason = _why_straight(layout)
    radius = bend_radius(layout.spec)
    if reason or radius is None or stretch is None:
        return TailPath(start, straight.stretches, None, reason)
    middle = radius + (high - low) / 2
    face = metal + (jaw.recess if jaw.pocket is not None else 0.0)
    down = _let_down(max(0.0, low - face), middle)
    tongue = relief(layout)
    free = stretch[0] if tongue is None else max(stretch[0], tongue.along[1])
    before = max(0.0, free - layout.body[2])
    parts = [Stretch(before), *down] if down else []
    if jaw.hinge is not None and turned > LEAST:
        parts += _into_shaft(_end(start, parts), jaw_range(layout, jaw)[1] + jaw.hinge, middle, turned)
    rest = layout.tail_length - math.fsum(part.length for part in parts)
    if rest <= 0.0:
        return TailPath(start, straight.stretches, None, "the tail is too short to be led down to the jaw's face")
    return TailPath(start, (*parts, Stretch(rest)), radius)


def _why_straight(layout: Layout) -> str:
    """Why a tail is drawn straight; empty where it is bent."""
    tail, stretch = layout.spec.fpc.tail, bend_stretch(layout)
    assert tail is not None
    if tail.bend == "none":
        return "fpc.tail.bend is none"
    if tail.turn != "none" or tail.offset:
        return "it turns aside in its plane before the contacts"
    if bend_radius(layout.spec) is None:
        return f"{layout.spec.fpc.rules.name} states no bend radius"
    if stretch is None:
        return "no stretch of it has straight tracks"
    widths = [layout.reach_at(x) for x in (stretch[0] + 1e-6, sum(stretch) / 2, stretch[1] - 1e-6)]
    if max(abs(a - b) for width in widths for a, b in zip(width, widths[0], strict=True)) > LEAST:
        return "its width changes where it may be bent"
    return ""


def _let_down(drop: float, radius: float) -> list[Stretch]:
    """Two bends of a radius (m) of the middle line, one down and one level again, over a drop (m)."""
    if drop < LEAST:
        return []
    turn = math.acos(max(0.0, 1.0 - drop / (2.0 * radius)))
    fall = drop - 2.0 * radius * (1.0 - math.cos(turn))
    steep = [Stretch(fall)] if fall > LEAST else []
    return [Stretch(radius * turn, -turn), *steep, Stretch(radius * turn, turn)]


def _into_shaft(here: Station, pivot: float, radius: float, turned: float) -> list[Stretch]:
    """Straight to the hinge and the bend into the shaft's direction, its middle under the pivot."""
    tangent = radius * math.tan(turned / 2)
    before = max(0.0, pivot - here.x - tangent)
    return [Stretch(before), Stretch(radius * turned, -turned)]


def _end(start: Station, parts: list[Stretch]) -> Station:
    for part in parts:
        start = start.after(part)
    return start
