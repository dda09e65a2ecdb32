"""Features of the mount that position and hold the board, and the positions of screws.

In a grasper's jaw, these are ledges beside the board, a support under its tail, and a dovetail or pins. A bench plate
has its outline from above, and screws in the plate or in an adapter below it, clear of board and tail.
`sitscad.assembly.places.fit` uses the corners, and `sitscad.assembly.solids` builds the solids.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from sitscad.assembly.places.bodies import backing_of, film_thickness, plates_of
from sitscad.assembly.places.column import print_limit, print_process
from sitscad.assembly.places.jaws import board_middle, free_half_width, jaw_range, jaw_section, jaw_with_rims
from sitscad.assembly.places.stack import tail_heights
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, bounding_box
from sitscad.layout.board import Layout, Stiffener
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.mount import Hole, HolePattern, Jaw, Mount, Retention

TIGHT = 0.15e-3
"""Smallest gap (m), on each side, between printed parts that are joined by hand. Coarse processes need more."""

STOP = 0.5e-3  # Thickness of a ledge (m), if the process can make it
"""Thickness (m) of a ledge, if the process can make it."""

LONGEST_RELIEF, LEAST_RELIEF = 4.0e-3, 1.0e-3
"""Largest length (m), and smallest useful length (m), of the support under the tail behind the body."""

SAME = 1e-5  # Widths of the tail that differ by less (m) are the same: its arcs are taken as chords
"""Difference (m) below which two widths of the tail count as equal. Its arcs are replaced by chords."""


@record
class Relief:
    """Support (tongue) under the tail that keeps a pull on the tail away from the body. All values are in metres.

    `along` is its range along the jaw, and `across` its range across the jaw. `tail` is the range of the tail across
    the jaw. `top` is the height of the tail's lower face. `cheeks` is the start of the walls beside the tail. None if
    there is no room for them.
    """

    along: tuple[float, float]
    across: tuple[float, float]
    tail: tuple[float, float]
    top: float
    cheeks: float | None


def process_clearance(mount: Mount | None) -> float:
    """Return the smallest gap (m) on each side between two parts that the mount's process can make."""
    return print_limit(print_process(mount), "clearance").value


def clearance(mount: Mount | None) -> float:
    """Return the gap (m) on each side between a printed part and a part that is inserted by hand."""
    return max(TIGHT, process_clearance(mount))


def ledge(mount: Mount | None) -> float:
    """Return the thickness (m) of a ledge whose one side is free."""
    return max(STOP, print_limit(print_process(mount), "free_wall").value)


def stop_place(body: Box, fitted: Jaw | None, mount: Mount | None ) -> tuple[float, float] | None:
    """Return the range along the jaw (m) of the ledge before the board's end at the tip. None if there is no room."""
    inner = body[0] - clearance(mount)
    outer = inner - ledge(mount)
    return None if fitted and jaw_range(body, fitted)[0] > outer + 1e-9 else (outer, inner)


def side_ledges(layout: Layout) -> tuple[float, float] | None:
    """Return the distances (m) of the inner and outer face of the ledges beside the board from the jaw's middle.

    None if jaw or port leave no room for ledges.
    """
    mount, jaw = layout.spec.mount, layout.spec.jaw
    if mount is None or jaw is None or mount.kind != "grasper-pad":
        return None
    backing_of(layout.spec).shield_that_fits()
    spans = backing_of(layout.spec).spans
    inner = layout.body_size[1] / 2 + clearance(mount)
    outer = inner + ledge(mount)
    if not spans or outer > jaw_section(jaw_with_rims(jaw)).face / 2:
        return None
    room = min(free_half_width(layout, spans[0][0]), free_half_width(layout, 0.0))
    return (inner, outer) if outer <= room else None


def tail_support(layout: Layout) -> Relief | None:
    """Return the support under the tail. None if there is no tail, or if jaw and stiffener leave no room."""
    mount, jaw = layout.spec.mount, layout.spec.jaw
    if mount is None or jaw is None or mount.kind != "grasper-pad" or not mount.standoff:
        return None
    start = layout.body[2]
    end = min(start + LONGEST_RELIEF, jaw_range(layout.body, jaw)[1] - 0.2e-3, _before_stiffener(layout.stiffener))
    if jaw.pocket is not None and jaw.recess:
        middle = sum(jaw_range(layout.body, jaw)) / 2
        end = min(end, middle + jaw.pocket[0] / 2 - clearance(mount))
    tail = layout.reach_at(end)
    if end - start < LEAST_RELIEF or tail[0] == tail[1]:
        return None
    wall = clearance(mount) + ledge(mount)
    low, high = layout.body[1], layout.body[3]
    across, cheeks = (max(low, tail[0]), min(high, tail[1])), None
    straight = _straight_from(layout.outline, tail, start, end) + clearance(mount)
    if tail[0] - wall >= low and tail[1] + wall <= high and end - straight >= LEAST_RELIEF:
        across, cheeks = (tail[0] - wall, tail[1] + wall), straight
    return Relief((start, end), across, tail, tail_heights(layout.spec.fpc)[0], cheeks)


def _straight_from(outline: Path, tail: tuple[float, float], start: float, end: float) -> float:
    """Return the x (m) from which the board is no wider than the tail.

    `tail` is the tail's range across the jaw (m). Only the outline between x = `start` and x = `end` (m) is examined.
    """
    points = outline.flattened(1e-5)
    beyond = [start]
    for a, b in pairwise([*points, points[0]]):
        for side, limit in ((-1.0, tail[0] - SAME), (1.0, tail[1] + SAME)):
            low, high = sorted((a, b), key=lambda point: side * point.y)
            if side * (high.y - limit) <= 0.0 or max(a.x, b.x) < start or min(a.x, b.x) > end:
                continue
            inner = low.x if side * (low.y - limit) >= 0.0 else a.x + (b.x - a.x) * (limit - a.y) / (b.y - a.y)
            beyond.append(min(max(inner, high.x), end))
    return max(beyond)


def cap_end(body: Box, mount: Mount | None, stiffener: Stiffener | None) -> float | None:
    """Return the x (m) at which a fingertip's cap ends along the tail, before the stiffener. None for other mounts."""
    if mount is None or mount.finger is None:
        return None
    return min(body[2] + mount.finger.grip, _before_stiffener(stiffener) - 0.7e-3)


def _before_stiffener(stiffener: Stiffener | None) -> float:
    """Return the x (m) at which a stiffener under the tail begins, minus a small margin.

    Infinite without a stiffener.
    """
    return math.inf if stiffener is None else bounding_box([stiffener.outline.outline])[0] - 0.3e-3


def retention(body: Box, mount: Mount | None) -> Retention | None:
    """Return the dovetail or pins that hold the mount in addition to glue, with all sizes.

    None if there is only glue.
    """
    joint = mount.retention if mount is not None else None
    if joint is None:
        return None
    x0, _, x1, _ = body
    return replace(joint, spacing=joint.spacing if joint.spacing is not None else (x1 - x0) / 2)


def joint_clearance(glue_line: float, mount: Mount | None) -> float:
    """Return the gap (m) on each side of a dovetail or pin in the jaw: the process's clearance plus the glue line."""
    return process_clearance(mount) + glue_line


def tongue_neck(joint: Retention) -> float:
    """Return the smallest width (m) of a dovetail's tongue, where it joins the mount."""
    return joint.width - 2.0 * joint.depth / math.tan(joint.angle)


def tongue_across(joint: Retention, room: float) -> tuple[float, float, float]:
    """Return the half widths (m) of a dovetail's tongue at its bottom and at the mount, and its depth (m).

    All faces are moved outwards by the gap `room` (m).
    """
    flank = room / math.sin(joint.angle)
    bottom = joint.width / 2 + room / math.tan(joint.angle) + flank
    return bottom, tongue_neck(joint) / 2 + flank, joint.depth + room


def metal_below(body: Box, mount: Mount | None, glue_line: float) -> float | None:
    """Return the smallest thickness (m) of metal below a dovetail's groove in the jaw. None if there is no dovetail.

    `glue_line` (m) is the thickness of the glue between dovetail and groove.
    """
    joint, jaw = retention(body, mount), mount.jaw if mount is not None else None
    if joint is None or jaw is None or joint.kind != "dovetail":
        return None
    bar = jaw_section(jaw)
    half, _, depth = tongue_across(joint, joint_clearance(glue_line, mount))
    if half >= bar.face / 2:
        return 0.0
    sagitta = bar.radius - math.sqrt(max(0.0, bar.radius**2 - half**2))
    return jaw.height - sagitta - depth


def pin_places(body: Box, mount: Mount | None) -> tuple[tuple[float, float], ...]:
    """Return the positions (x, y; m) of two pins in the jaw's middle. Empty if there are no pins."""
    joint = retention(body, mount)
    if joint is None or joint.kind != "pins" or joint.spacing is None:
        return ()
    middle = board_middle(body)
    return tuple((middle.x + side * joint.spacing / 2, middle.y) for side in (-1.0, 1.0))


BORDER = 6.0e-3  # Plastic round the board and what overhangs it, for the screws (m)
"""Width (m) of plastic around the board and the parts beyond its edge, for the screws."""

PLATE_CORNER = 2.0e-3  # Radius of a bench plate's corners (m)
"""Radius (m) of a bench plate's corners."""

INSET = 3.0e-3
"""Distance (m) of corner screws from the plate's edges."""
BESIDE_HEAD = 1.0e-3  # Between a screw's head and the board or what overhangs it (m)
"""Smallest distance (m) between a screw's head and the board or the parts beyond its edge."""
ROUND_HOLE = 2.0e-3  # Plastic round a screw's head, out to the plate's edge (m)
"""Width (m) of plastic between a screw's head and the plate's edge."""


@record
class Screw:
    """A screw with its nut. All sizes are in metres.

    `hole` and `head` are the diameters of hole and head. `nut_across` is the width across flats of the nut's pocket,
    and `nut_height` the pocket's height.
    """

    hole: float
    head: float
    nut_across: float
    nut_height: float


CORNER_SCREW = Screw(2.4e-3, 3.8e-3, 4.2e-3, 1.8e-3)
"""M2 screw: hole by ISO 273 (medium), head by ISO 4762.

The nut's pocket is 0.2 mm larger than a nut by ISO 4032 (4 mm across flats, 1.6 mm high).
"""


def plate_plan(layout: Layout, film: float) -> Box:
    """Return the rectangle (m) of a bench plate from above.

    It includes the board, the tail beside it, the parts with their encapsulation (`film`, m), and the screws, each with
    a border.
    """
    x0, y0, x1, y1 = layout.body
    near = [point.y for point in layout.outline.flattened(1e-5) if point.x < x1 + BORDER]
    y0, y1 = min(y0, *near), max(y1, *near)
    for body in plates_of(layout.spec).all:
        x_low, low, x_high, high = body.footprint.box
        x0, y0, x1, y1 = min(x0, x_low - film), min(y0, low - film), max(x1, x_high + film), max(y1, high + film)
    mount = layout.spec.mount
    ends, pattern = [(x0, y0, BORDER), (x1, y1, BORDER)], _pattern(mount)
    if pattern is not None:
        # from the middle of a nut in an adapter's corner to the head of a screw beside it
        nut = 0.0 if not adapter_holes(layout) else (
            CORNER_SCREW.nut_across / math.sqrt(3.0) + print_limit(print_process(mount), "wall").value
            + clearance(mount))
        for hole in _placed_holes(pattern, board_boxes(layout)):
            # the nuts in the corners of an adapter lie beside its holes, in both directions
            beyond = INSET + (hole.head / 2 + nut) / math.sqrt(2.0) if nut else hole.head / 2 + ROUND_HOLE
            ends.append((*hole.at, beyond))
    x0, y0 = min(x - room for x, _, room in ends), min(y - room for _, y, room in ends)
    return x0, y0, max(x + room for x, _, room in ends), max(y + room for _, y, room in ends)


FLOOR = 2.0e-3
"""Smallest thickness (m) of plastic that carries a load."""


def plate_floor(layout: Layout) -> tuple[float, float]:
    """Return the thickness of a bench plate below board or shield, and the height of its lower face (m).

    The thickness is at least half of the screw diameter, because thinner plastic would bend. Raises `PartsError` if the
    shield does not fit.
    """
    mount, backing = layout.spec.mount, backing_of(layout.spec)
    under, shield = backing.bottom, backing.shield_that_fits()
    assert mount is not None
    holes = mount.holes.holes if mount.holes is not None else ()
    least = max(FLOOR, *(0.5 * hole.diameter for hole in holes)) if holes and not adapter_holes(layout) else FLOOR
    used = under - (shield[0] if shield else under)
    floor = max(mount.standoff - used, least)
    return floor, under - used - floor


def adapter_depth(holes: tuple[Hole, ...]) -> float:
    """Return the thickness (m) of an adapter with these holes under a bench plate. Its screw heads are sunk.

    0 if there are no holes, because then there is no adapter.
    """
    return max(hole.diameter for hole in holes) + FLOOR if holes else 0.0


ENGAGED = 1.5  # Length of thread over the screw's diameter, in plastic
"""Length of thread in plastic, in screw diameters."""


def cap_size(body: Box, mount: Mount | None) -> tuple[float, float]:
    """Return the outer width of a fingertip's cap, and the thickness of its side with the screws (m)."""
    (_, y0, _, y1) = body
    assert mount is not None and mount.finger is not None
    room, finger = clearance(mount), mount.finger
    side = max(ENGAGED * finger.screw, ledge(mount))
    half = max(finger.size[0] / 2 + room + side, (y1 - y0) / 2 + room + ledge(mount))
    return 2.0 * half, half - finger.size[0] / 2 - room


FRONT = 2.0e-3
"""Thickness (m) of plastic beyond the finger's end."""


def mount_size(layout: Layout) -> tuple[float, float] | None:
    """Return length along the board and width (m) of a bench plate or of a fingertip's cap. None for other mounts."""
    mount, end = layout.spec.mount, cap_end(layout.body, layout.spec.mount, layout.stiffener)
    if end is not None:
        return end - layout.body[0] + clearance(mount) + 2.0 * FRONT, cap_size(layout.body, layout.spec.mount)[0]
    if mount is None or mount.kind != "bench-plate":
        return None
    x0, y0, x1, y1 = plate_plan(layout, film_thickness(layout.spec.encapsulation))
    return x1 - x0, y1 - y0


def adapter_holes(layout: Layout) -> tuple[Hole, ...]:
    """Return the holes of an adapter: a hole pattern that lies under board or tail. Empty if no adapter is needed."""
    pattern = _pattern(layout.spec.mount)
    return () if pattern is None or usable_pattern_holes(layout) else _placed_holes(pattern, board_boxes(layout))


def corner_holes(plan: Box) -> tuple[Hole, ...]:
    """Return four holes in the corners of a bench plate, clear of board and tail."""
    x0, y0, x1, y1 = plan[0] + INSET, plan[1] + INSET, plan[2] - INSET, plan[3] - INSET
    centres = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    return tuple(Hole(centre, CORNER_SCREW.hole, CORNER_SCREW.head) for centre in centres)


def _pattern(mount: Mount | None) -> HolePattern | None:
    """Return the hole pattern of a bench plate. None if its screws are in its own corners."""
    pattern = mount.holes if mount is not None else None
    return None if pattern is None or (pattern.grid is None and pattern.name == "corners-m2") else pattern


def usable_pattern_holes(layout: Layout) -> tuple[Hole, ...]:
    """Return the holes of a plate's pattern if all are clear of board, tail and the parts on the board.

    Otherwise empty. Four holes are then in the plate's corners.
    """
    pattern = _pattern(layout.spec.mount)
    if pattern is None:
        return ()
    boxes = board_boxes(layout)
    holes = _placed_holes(pattern, boxes)
    return holes if all(distance_beside_board(boxes, hole) >= hole.head / 2 + BESIDE_HEAD - 1e-9
                        for hole in holes) else ()


def plate_holes(layout: Layout) -> tuple[Hole, ...]:
    """Return the screw holes of a bench plate."""
    return usable_pattern_holes(layout) or corner_holes(plate_plan(layout, film_thickness(layout.spec.encapsulation)))


def screw_spacing(holes: tuple[Hole, ...]) -> tuple[float, float] | None:
    """Return the spacing (m) of a plate's four screws, along and across. None if they do not form a rectangle."""
    xs, ys = (sorted({round(hole.at[axis], 9) for hole in holes}) for axis in (0, 1))
    return (xs[1] - xs[0], ys[1] - ys[0]) if len(holes) == 4 and len(xs) == len(ys) == 2 else None


FAR = 2.0
"""Distance, in coil diameters, at which metal changes a coil's inductance by less than 0.2 %.

It is computed for a circular loop whose image is at twice the distance: mu0 pi a^4 / (2 z^3) divided by mu0 a (ln(8 a /
w) - 2). Here a is the loop's radius, w the wire's radius, z = 8 a and a / w = 10.
"""


def metal_free_distance(coil: CoilSpec) -> float:
    """Return the distance (m) beyond which metal that the estimates neglect hardly changes a coil.

    It is `FAR` diameters of the circle with the area of the coil's outline. The effect of distant metal is proportional
    to the square of this area.
    """
    return FAR * math.sqrt(4.0 / math.pi * coil.outline.area * coil.size[0] * coil.size[1])


def is_near_metal(coil: CoilSpec, placements: tuple[CoilPlacement, ...], holes: tuple[Hole, ...]) -> bool:
    """Whether a plate's screw head is nearer to a coil's centre than `metal_free_distance`."""
    reach = metal_free_distance(coil)
    return any(math.dist(hole.at, place.centre) - hole.head / 2 < reach for hole in holes for place in placements)


def distance_beside_board(boxes: Sequence[Box], hole: Hole) -> float:
    """Return the distance (m) from above between a hole's centre and the nearest box of board, tail and parts.

    0 if the centre is inside a box.
    """
    x, y = hole.at
    return min(math.hypot(max(b[0] - x, 0.0, x - b[2]), max(b[1] - y, 0.0, y - b[3]))
               for b in boxes if b[2] > b[0])


def _placed_holes(pattern: HolePattern, boxes: Sequence[Box]) -> tuple[Hole, ...]:
    """Return a pattern's holes, centred on the board's body, which is the first of `boxes`.

    For a grid, these are the four nearest holes of the grid that are clear of all boxes.
    """
    body = boxes[0]
    middle = board_middle(body)
    if pattern.grid is None:
        return tuple(Hole((middle.x + h.at[0], middle.y + h.at[1]), h.diameter, h.head) for h in pattern.holes)
    # how far apart the four are that a plate takes of a bench: the nearest that are clear of the board
    kind, grid = pattern.holes[0], pattern.grid
    half = max(max(box[3] for box in boxes) - middle.y, middle.y - min(box[1] for box in boxes))
    width = grid * math.ceil(2.0 * (half + kind.head / 2 + BESIDE_HEAD) / grid - 1e-9)
    length = grid * max(1, math.ceil((body[2] - body[0]) / grid - 1e-9))
    return tuple(
        Hole((middle.x + i * length / 2, middle.y + j * width / 2), kind.diameter, kind.head)
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    )


def board_boxes(layout: Layout) -> list[Box]:
    """Return the boxes (m) from above of the body, of the next 30 mm of the tail, and of the parts on the board."""
    near = [p for p in layout.outline.flattened(1e-5) if p.x < layout.body[2] + 30e-3]
    tail = layout.body[2], min(p.y for p in near), max(p.x for p in near), max(p.y for p in near)
    return [layout.body, tail, *(plate.footprint.box for plate in plates_of(layout.spec).all)]
