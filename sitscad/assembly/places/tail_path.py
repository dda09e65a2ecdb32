"""Path of the tail in the mounted sensor: over the mount's edge, down to the jaw or the finger, and past a hinge.

Lengths are measured along the middle of the tail's thickness, which bending neither stretches nor shortens.
"""

from __future__ import annotations

import math

from sitscad.assembly.places.bodies import Backing, backing_of, film_thickness
from sitscad.assembly.places.jaws import pivot_along
from sitscad.assembly.places.seating import LEAST_RELIEF, cap_end, plate_floor, plate_plan, tail_support
from sitscad.assembly.places.stack import tail_heights
from sitscad.basics.record import record
from sitscad.layout.bending import Bend, bend_length, bend_radius, bend_stretch, tail_thickness
from sitscad.layout.board import Layout
from sitscad.spec.circuit import FpcSpec, Tail
from sitscad.spec.mount import Jaw

LEAST = 1e-6  # Drops and turns (m, rad) below this are none
"""Heights (m) and angles (rad) below this count as 0."""

EDGE_ROUNDING = 0.4e-3  # Of an edge under a tail that is not bent over it, or whose fabricator states no radius (m)
"""Radius (m) of an edge under a tail that is not bent over it, or if the fabricator states no bend radius."""
LEFT = 0.4  # Share of the plastic under the tail that is left upright below a round edge, at least
"""Smallest fraction of the plastic's height under the tail that stays vertical below a rounded edge."""


@record
class Lip:
    """A rounded edge over which the tail leaves its support.

    It extends from x = `start` to x = `end` (m). `radius` (m) is its radius, and `turn` (rad) the angle by which the
    tail bends over it.
    """

    start: float
    end: float
    radius: float
    turn: float


@record
class BentStretch:
    """A part of the tail's middle line with constant curvature.

    `length` (m) is its length, and `turn` (rad) the angle by which it bends upwards.
    """

    length: float
    turn: float = 0.0


@record
class Station:
    """A point on the middle line of the tail.

    `x` (m) is its position along the jaw, and `z` (m) its height. `angle` (rad) is the slope of the tail at this point.
    """

    x: float
    z: float
    angle: float

    def after(self, stretch: BentStretch, length: float | None = None) -> Station:
        """Return the point at the end of a part that begins here, or after `length` (m) along this part."""
        run = stretch.length if length is None else length
        if not stretch.turn:
            return Station(self.x + run * math.cos(self.angle), self.z + run * math.sin(self.angle), self.angle)
        radius = stretch.length / stretch.turn
        end = self.angle + run / radius
        dx, dz = math.sin(end) - math.sin(self.angle), math.cos(self.angle) - math.cos(end)
        return Station(self.x + radius * dx, self.z + radius * dz, end)

    def distance(self, stretch: BentStretch, x: float, z: float) -> float:
        """Return the smallest distance (m) between a point (x, z) and a part of the tail that begins here."""
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
    """Path of the tail from the end of the board's body.

    `start` is the first point of its middle line, and `stretches` are its parts from there. `radius` (m) is the inside
    radius of its bends; None if it has no bends. `reason` explains why a tail that should bend is drawn straight; empty
    otherwise.
    """

    start: Station
    stretches: tuple[BentStretch, ...]
    radius: float | None = None
    reason: str = ""

    @property
    def length(self) -> float:
        """Total length (m) of all parts."""
        return math.fsum(stretch.length for stretch in self.stretches)

    def at(self, length: float) -> Station:
        """Return the point after a length (m) along the tail."""
        here = self.start
        for stretch in self.stretches:
            if length <= stretch.length:
                return here.after(stretch, length)
            here, length = here.after(stretch), length - stretch.length
        return here

    @property
    def last_start(self) -> Station:
        """Point at which the last part begins."""
        here = self.start
        for stretch in self.stretches[:-1]:
            here = here.after(stretch)
        return here

    def distance(self, x: float, z: float) -> float:
        """Return the smallest distance (m) between a point (x, z) and the tail's middle line."""
        here, least = self.start, math.hypot(x - self.start.x, z - self.start.z)
        for stretch in self.stretches:
            least = min(least, here.distance(stretch, x, z))
            here = here.after(stretch)
        return least


def tail_path(layout: Layout, turned: float = 0.0) -> TailPath | None:
    """Return the path of the tail. None for a board without a tail.

    `turned` (rad) is the opening angle of the jaw relative to the shaft. The tail leaves the body horizontally, on the
    support of the seat or on the cap. It goes down to the face of jaw or finger by two bends with the spec's radius, or
    the fabricator's minimum. It follows this face, and bends into the shaft below the pivot.
    """
    tail = layout.spec.fpc.tail
    if tail is None or layout.tail_length <= 0.0:
        return None
    low, high = tail_heights(layout.spec.fpc)
    start = Station(layout.body[2], (low + high) / 2, 0.0)
    straight = TailPath(start, (BentStretch(layout.tail_length),))
    drop, stretch = _descent(backing_of(layout.spec), low), bend_stretch(layout)
    pivot = pivot_along(layout.body, layout.spec.jaw)
    if drop is None:
        return straight
    places = () if stretch is None else (stretch[0] + 1e-6, sum(stretch) / 2, stretch[1] - 1e-6)
    reason = _straight_reason(layout.spec.fpc, tail, [layout.reach_at(x) for x in places])
    radius = bend_radius(layout.spec.fpc)
    if reason or radius is None or stretch is None:
        return TailPath(start, straight.stretches, None, reason)
    middle = radius + (high - low) / 2
    down = _descending_bends(drop, middle)
    # the end of what carries the body and lies under the tail
    edge, tongue = lip(layout), tail_support(layout)
    support_end = tongue.along[1] if tongue is not None else cap_end(layout.body, layout.spec.mount,
                                                              layout.stiffener) or layout.body[2]
    free = max(stretch[0], layout.body[2], support_end if edge is None else edge.start)
    parts = [BentStretch(free - layout.body[2]), *down] if down else []
    if pivot is not None and turned > LEAST:
        # Straight to the hinge and the bend into the shaft's direction, its middle under the pivot
        here = TailPath(start, (*parts, BentStretch(0.0))).last_start
        tangent = middle * math.tan(turned / 2)
        before = max(0.0, pivot - here.x - tangent)
        parts += [BentStretch(before), BentStretch(middle * turned, -turned)]
    rest = layout.tail_length - math.fsum(part.length for part in parts)
    if rest <= 0.0:
        return TailPath(start, straight.stretches, None, TOO_SHORT)
    return TailPath(start, (*parts, BentStretch(rest)), radius)


TOO_SHORT = "the tail is too short to be led down to what carries the mount"


def _descent(backing: Backing, lower: float) -> float | None:
    """Return the height (m) by which the tail descends to the face of jaw or finger. None if there is neither.

    `lower` (m) is the height of the tail's lower face.
    """
    mount, face = backing.mount, backing.carrier_face
    if mount is None or face is None or (mount.jaw is None and mount.finger is None):
        return None
    rims = mount.jaw.recess if mount.jaw is not None and mount.jaw.pocket is not None else 0.0
    return max(0.0, lower - face - rims)


def lip(layout: Layout) -> Lip | None:
    """Return the round edge at which the tail leaves its support. None if there is no edge, no radius or no room."""
    mount, radius = layout.spec.mount, bend_radius(layout.spec.fpc)
    drop = _descent(backing_of(layout.spec), tail_heights(layout.spec.fpc)[0])
    if mount is None or not drop or radius is None:
        return None
    bends = _descending_bends(drop, radius + tail_thickness(layout.spec.fpc) / 2)
    turn = bends[0].length / (radius + tail_thickness(layout.spec.fpc) / 2) if bends else 0.0
    if (end := cap_end(layout.body, layout.spec.mount, layout.stiffener)) is not None:
        return round_edge(layout.spec.fpc, end, (1.0 - LEFT) * mount.standoff, turn)
    tongue = tail_support(layout)
    if tongue is None:
        return None
    foot = backing_of(layout.spec).spans[-1][0]
    edge = round_edge(layout.spec.fpc, tongue.along[1], (1.0 - LEFT) * (tongue.top - foot), turn)
    return edge if edge.start - tongue.along[0] >= LEAST_RELIEF else None


def round_edge(fpc: FpcSpec, end: float, depth: float, turn: float) -> Lip:
    """Return the edge that ends at x = `end` (m), rounded with the tail's bend radius through the angle `turn` (rad).

    The rounding is at most `depth` (m) deep. If no bend radius is known, its radius is at most `EDGE_ROUNDING`.
    """
    radius = bend_radius(fpc)
    if radius is None:
        radius, turn = min(EDGE_ROUNDING, depth), math.pi / 2
    turn = min(turn, math.acos(max(-1.0, 1.0 - depth / radius)))
    return Lip(end - radius * math.sin(turn), end, radius, turn)


def free_tail_start(layout: Layout) -> float:
    """Return the x (m) from which the tail may bend away from the coils: a bench plate's edge, or the body's end."""
    mount, end = layout.spec.mount, layout.body[2]
    if mount is None or mount.kind != "bench-plate":
        return end
    plate = plate_plan(layout, film_thickness(layout.spec.encapsulation))
    return max(end, plate[2] - (bend_radius(layout.spec.fpc) or 0.0))


def bending_rod_start(layout: Layout) -> float:
    """Return the x (m) from which the tail may be bent down about a rod that does not touch a bench plate.

    The rod touches the tail's lower face. The plate's lower edge must be outside the rod. Minus infinity for other
    mounts.
    """
    mount, radius = layout.spec.mount, bend_radius(layout.spec.fpc)
    if mount is None or mount.kind != "bench-plate" or radius is None:
        return -math.inf
    rod, deep = radius + ROD, tail_heights(layout.spec.fpc)[0] - plate_floor(layout)[1]
    level = rod - min(deep, rod)  # height of that edge over the rod's middle
    return plate_plan(layout, film_thickness(layout.spec.encapsulation))[2] + math.sqrt(rod**2 - level**2)


ROD = 0.05e-3
"""Largest difference (m) between the radius of the bending rod and the bend radius. Rods come in steps of 0.1 mm."""


def _straight_reason(fpc: FpcSpec, tail: Tail, widths: list[tuple[float, float]]) -> str:
    """Return the reason why a tail is drawn straight. Empty if it is bent.

    `widths` are the ranges of y (m) of the tail along the part that may be bent.
    """
    if tail.bend == "none":
        return "fpc.tail.bend is none"
    if tail.turn != "none" or tail.offset:
        return "it turns aside in its plane before the contacts"
    if bend_radius(fpc) is None:
        return f"{fpc.rules.name} states no bend radius"
    if not widths:
        return "no stretch of it has straight tracks"
    if max(abs(a - b) for width in widths for a, b in zip(width, widths[0], strict=True)) > LEAST:
        return "its width changes where it may be bent"
    return ""


def _descending_bends(drop: float, radius: float) -> list[BentStretch]:
    """Return two bends, one down and one back to horizontal, that together lower the tail by `drop` (m).

    `radius` (m) is the bend radius of the middle line. If the bends alone are too low, a straight part lies between
    them.
    """
    if drop < LEAST:
        return []
    turn = math.acos(max(0.0, 1.0 - drop / (2.0 * radius)))
    fall = drop - 2.0 * radius * (1.0 - math.cos(turn))
    steep = [BentStretch(fall)] if fall > LEAST else []
    return [BentStretch(radius * turn, -turn), *steep, BentStretch(radius * turn, turn)]


SAME = 1e-9


def bends(layout: Layout) -> tuple[Bend, ...]:
    """Return all bends of the tail, from the body on. Empty if it has no bend or no straight part."""
    spec_bend = stated_bend(layout)
    return (*bends_of_mount(layout), *(() if spec_bend is None else (spec_bend,)))


def bends_of_mount(layout: Layout) -> tuple[Bend, ...]:
    """Return the bends that lower the tail to the jaw or the finger. Empty if the tail stays horizontal."""
    path = tail_path(layout)
    if path is None or path.radius is None:
        return ()
    whose = "finger" if layout.spec.jaw is None else "jaw"
    over = "off the body's level" if lip(layout) is None else "over the mount's round edge"
    mount_bends, here = [], layout.body[2]
    for stretch in path.stretches:
        end = here + stretch.length
        if stretch.turn:
            way, why = ("down", over) if stretch.turn < 0.0 else ("up", f"level again at the {whose}'s face")
            mount_bends.append(Bend((here + end) / 2, here, end, abs(stretch.turn), way, path.radius, False, why))
        here = end
    return tuple(mount_bends)


def bends_at_every_grasp(tail: Tail | None, jaw: Jaw | None) -> bool:
    """Whether the bend that the spec states is at the hinge of a jaw, so that it moves at every grasp."""
    return (tail is not None and tail.bend != "none" and bool(tail.bend_angle)
            and jaw is not None and jaw.hinge is not None)


def stated_bend(layout: Layout) -> Bend | None:
    """Return the bend that the spec states, beyond the mount's bends. None if there is none, or no straight tracks."""
    tail, room = layout.spec.fpc.tail, stated_bend_range(layout)
    if tail is None or room is None or not tail.bend_angle:
        return None
    half, low, high = bend_length(layout.spec.fpc) / 2, *room
    line, pivot = (low + high) / 2, pivot_line(layout)
    if tail.bend_at is not None:
        line = layout.body[2] + tail.bend_at
    elif pivot is not None and low + half <= pivot <= high - half:
        line = pivot
    elif tail.bend_direction == "down":
        line = max(line, min(bending_rod_start(layout) + half, high - half))
    radius, is_dynamic = bend_radius(layout.spec.fpc), tail.bend == "dynamic"
    return Bend(line, line - half, line + half, tail.bend_angle, tail.bend_direction, radius, is_dynamic)


def stated_bend_range(layout: Layout) -> tuple[float, float] | None:
    """Return the range of x (m) with straight tracks for the spec's bend, beyond the mount and its bends.

    None if there is no room.
    """
    tail, stretch = layout.spec.fpc.tail, bend_stretch(layout)
    if tail is None or stretch is None:
        return None
    ends = [bend.end for bend in bends_of_mount(layout)]
    if tail.bend_direction == "down":
        ends.append(free_tail_start(layout))
    return max([stretch[0], *ends]), stretch[1]


def pivot_line(layout: Layout) -> float | None:
    """Return x (m) on the flat tail of the point that is below the hinge's pivot when mounted.

    None if there is no hinge.
    """
    pivot, path = pivot_along(layout.body, layout.spec.jaw), tail_path(layout)
    if pivot is None or path is None:
        return pivot
    return pivot + math.fsum(stretch.length for stretch in path.stretches[:-1]) - (path.last_start.x - path.start.x)
