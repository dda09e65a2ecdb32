"""Mounts outside a jaw: a bench plate, and a cap for a robot's fingertip.

The bench plate is flush with the board's top face. It has a recess for the board, a slot for its tail, and holes. If a
load cell's holes are under the board, they are in a second part, `mount-adapter`. This part is screwed onto the load
cell first, with sunk heads. Four screws with nuts hold the plate on the adapter. All screws can therefore be reached,
and no steel is near the coils.

The cap fits over the finger's end, and two screws clamp it. The board lies in its top. Edges that are touched are
rounded. The tail leaves over a round edge towards the hand. The screw holes must be tapped.
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.assembly.places.bodies import BodyRole, Heights, backing_of, board_heights, film_thickness
from sitscad.assembly.places.column import print_limit
from sitscad.assembly.places.jaws import board_middle
from sitscad.assembly.places.seating import (
    CORNER_SCREW,
    FLOOR,
    FRONT,
    PLATE_CORNER,
    adapter_depth,
    adapter_holes,
    cap_end,
    cap_size,
    clearance,
    corner_holes,
    plate_floor,
    plate_holes,
    plate_plan,
)
from sitscad.assembly.places.stack import has_round_body
from sitscad.assembly.places.tail_path import Lip, lip, round_edge
from sitscad.assembly.solids.solid import (
    MM,
    PartsError,
    Solid,
    box,
    extrude_face,
    face,
    import_extra,
    one_solid,
    prism,
    subtract,
)
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Point, Region, circle, rectangle
from sitscad.layout.board import Layout
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.mount import Finger, Hole, Mount
from sitscad.spec.presets import metal_colour

EDGE = 0.5e-3  # Rounding of the plate's upper edge (m)
"""Radius (m) of the bench plate's upper edge."""

TAIL_RELIEF = 0.5e-3
"""Largest depth (m) of the slot under the tail, below the recess for the board."""
LEFT = 0.3  # Share of the plastic under the tail that the round lip leaves at the plate's end
"""Smallest fraction of the plastic's height under the tail that the round edge leaves at the plate's end."""


def bench_plate(layout: Layout) -> tuple[Any, ...]:
    """Return the bench plate, and the spacer over a shield if there is one."""
    shield = backing_of(layout.spec).shield_that_fits()
    floor, bottom = plate_floor(layout)
    plan = plate_plan(layout, film_thickness(layout.spec.encapsulation))
    # The plate with its upper edge rounded all round
    plate = prism(rectangle(*plan, PLATE_CORNER), bottom, 0.0)
    edges = [edge for edge in plate.edges() if edge.bounding_box().min.Z > -1e-6]
    plate = plate.fillet(EDGE * MM, edges)
    mount, fpc = layout.spec.mount, layout.spec.fpc
    tail_cuts = _tail_relief(fpc, grown_outline(layout.outline, mount), layout.body[2] + clearance(mount), plan, floor)
    plate = subtract(plate, (*recess(layout, shield), *tail_cuts), "mount")
    for hole in plate_holes(layout):
        shaft = circle(Point(*hole.at), hole.diameter / 2)
        plate = one_solid(plate - prism(Region(shaft), bottom - 1e-3, 1e-3), "mount")
    disc = layout.body_outline if has_round_body(layout.spec.fpc.body) else None
    return (plate, *spacer(layout.body, disc, shield, board_heights(layout.spec.fpc.stackup)[0]))


def adapter(layout: Layout) -> Any | None:
    """Return the adapter between load cell and bench plate. None if the plate's own holes suffice."""
    holes = adapter_holes(layout)
    if not holes:
        return None
    plan = plate_plan(layout, film_thickness(layout.spec.encapsulation))
    _, top = plate_floor(layout)
    bottom = top - adapter_depth(adapter_holes(layout))
    head = adapter_depth(adapter_holes(layout)) - FLOOR
    body = prism(rectangle(*plan, PLATE_CORNER), bottom, top)
    for hole in holes:
        body = one_solid(body - prism(circle(Point(*hole.at), hole.diameter / 2), bottom - 1e-3, top + 1e-3), "adapter")
        sink = circle(Point(*hole.at), hole.head / 2 + clearance(layout.spec.mount))
        body = one_solid(body - prism(sink, top - head, top + 1e-3), "adapter")
    for corner in corner_holes(plan):
        body = one_solid(body - _nut_and_shaft(corner, bottom, top), "adapter")
    return body


def _nut_and_shaft(hole: Hole, bottom: float, top: float) -> Any:
    """Return the cutout of a screw and its nut in an adapter between two heights (m).

    The nut is inserted from below.
    """
    bd = import_extra("build123d")
    shaft = prism(circle(Point(*hole.at), hole.diameter / 2), bottom - 1e-3, top + 1e-3)
    (x, y), radius, turns = hole.at, CORNER_SCREW.nut_across / math.sqrt(3.0), [math.pi / 3 * i for i in range(6)]
    corners = [bd.Vector((x + radius * math.cos(t)) * MM, (y + radius * math.sin(t)) * MM) for t in turns]
    outline = bd.Face(bd.Wire.make_polygon(corners, close=True))
    return shaft + extrude_face(outline, bottom - 1e-3, bottom + CORNER_SCREW.nut_height)


def spacer(body: Box, disc: Path | None, shield: Heights | None, under: float) -> tuple[Any, ...]:
    """Return the slab between shield and board. Empty if they touch, or if there is no shield.

    The board's lower face is at height `under` (m). `disc` is the outline of a round body; None for other bodies.
    """
    if shield is None or under - shield[1] < 1e-9:
        return ()
    if disc is not None:
        return (prism(disc, shield[1], under),)
    x0, y0, x1, y1 = body
    return (box(x0, y0, shield[1], x1, y1, under),)


def recess(layout: Layout, shield: Heights | None) -> tuple[Any, ...]:
    """Return the cutouts of a plate: for the board with its gap, and below it for the shield and its spacer."""
    under, room = board_heights(layout.spec.fpc.stackup)[0], clearance(layout.spec.mount)
    cuts = [extrude_face(grown_outline(layout.outline, layout.spec.mount), under, 1e-3)]
    if shield is not None:
        x0, y0, x1, y1 = layout.body
        plan = face(Region(rectangle(x0 - room, y0 - room, x1 + room, y1 + room)))
        if has_round_body(layout.spec.fpc.body):  # the same wall as the board's own recess
            plan = (grown_outline(layout.outline, layout.spec.mount) & plan).faces()[0]
        cuts.append(extrude_face(plan, shield[0], 1e-3))
    if layout.stiffener is not None:
        x0, y0, x1, y1 = _bounding_box(face(layout.stiffener.outline))
        deep = under - layout.stiffener.thickness - room
        cuts.append(box(x0 - room, y0 - room, deep, x1 + room, y1 + room, 1e-3))
    return tuple(cuts)


def _tail_relief(fpc: FpcSpec, recess: Any, start: float, plan: Box, floor: float) -> tuple[Any, ...]:
    """Return a deeper slot under the tail from the body to the plate's edge.

    The edge is rounded with the tail's bend radius.

    The slot is as wide as the board's `recess` (a face) beyond x = `start` (m). `plan` is the plate from above, and
    `floor` (m) the thickness of plastic under the board.
    """
    depth = min(TAIL_RELIEF, floor / 2)
    beyond = recess & face(Region(rectangle(start, plan[1] - 1e-3, plan[2] + 1e-3, plan[3] + 1e-3)))
    if not beyond:
        return ()
    x0, y0, x1, y1 = _bounding_box(beyond)
    if x1 < plan[2] - 1e-9:
        return ()
    deep = board_heights(fpc.stackup)[0] - depth
    edge = round_edge(fpc, plan[2], (1.0 - LEFT) * (floor - depth), math.pi / 2)
    return (box(x0, y0, deep, plan[2] + 1e-3, y1, 1e-3), rounded_edge(edge, (y0, y1), deep))


def rounded_edge(edge: Lip, across: tuple[float, float], height: float) -> Any:
    """Return the solid to subtract for a rounded upper edge of a face at a height (m). `across` is its y range (m)."""
    bd = import_extra("build123d")
    deep = edge.radius * (1.0 - math.cos(edge.turn))
    corner = box(edge.start, across[0], height - deep, edge.end + 1e-3, across[1], height + deep)
    lie = bd.Plane((edge.start * MM, across[0] * MM, (height - edge.radius) * MM), z_dir=(0, 1, 0))
    return corner - bd.Solid.make_cylinder(edge.radius * MM, (across[1] - across[0]) * MM, lie)


def over_body(outline: Path, body: Box, written: Path | None, lower: float, upper: float) -> Any:
    """Return a solid that covers only the board's body, between two heights (m).

    `outline` is the whole board's outline, `body` the box of its body, and `written` the body's outline in the spec
    (None without).
    """
    if written is not None:
        return prism(written, lower, upper)
    x0, y0, x1, y1 = body
    return prism(outline, lower, upper) & box(x0, y0, lower, x1, y1, upper)


def grown_outline(outline: Path, mount: Mount | None) -> Any:
    """Return the board's outline enlarged by the mount's gap on each side, as a face."""
    bd = import_extra("build123d")
    room = clearance(mount)
    return bd.offset(face(Region(outline)), room * MM, kind=bd.Kind.ARC).faces()[0]


def _bounding_box(shape: Any) -> Box:
    bounds = shape.bounding_box()
    return bounds.min.X / MM, bounds.min.Y / MM, bounds.max.X / MM, bounds.max.Y / MM


TAPPED = 0.82  # Hole to be tapped over the thread's nominal diameter (M2: 1.6 mm, M3: 2.5 mm; ISO 2306)
"""Diameter of a hole before tapping, divided by the thread's nominal diameter (M2: 1.6 mm, M3: 2.5 mm; ISO 2306)."""
TOUCHED = 1.5e-3  # Radius of the edges that are touched (m)
"""Radius (m) of edges that are touched."""

LEAST_GRIP = 3e-3
"""Smallest length (m) of the cap on the finger."""


def fingertip(layout: Layout) -> tuple[Any, ...]:
    """Return the cap, and the spacer over a shield if there is one.

    Raises `PartsError` if the tail's stiffener leaves too little length for the cap.
    """
    mount = layout.spec.mount
    assert mount is not None and mount.finger is not None
    finger, shield = mount.finger, backing_of(layout.spec).shield_that_fits()
    under, room = board_heights(layout.spec.fpc.stackup)[0], clearance(mount)
    x0, _, x1, _ = layout.body
    # Where the cap ends towards the hand (m)
    end = cap_end(layout.body, layout.spec.mount, layout.stiffener)
    if end is None or end - layout.body[2] < LEAST_GRIP:
        raise PartsError("the tail's stiffener begins where the cap has to grip the finger: a longer fpc.tail.length")
    half = cap_size(layout.body, layout.spec.mount)[0] / 2
    top, y = under - mount.standoff, board_middle(layout.body).y
    floor = print_limit(mount.process, "free_wall").value
    bottom = top - finger.size[1] - 2.0 * room - max(FRONT, floor)
    # The block with all edges rounded but those of its open end
    block = box(x0 - room - 2.0 * FRONT, y - half, bottom, end, y + half, 0.0)
    last = block.bounding_box().max.X
    edges = [edge for edge in block.edges() if last - 1e-6 > edge.bounding_box().min.X]
    radius = min(TOUCHED * MM, 0.3 * min(block.bounding_box().size))
    cap = block.fillet(radius, edges)
    cap = one_solid(cap - _finger(layout.body, finger, top, x0 - room, end + 1e-3, clearance(mount)), "cap")
    cuts, (low, high) = [*recess(layout, shield)], layout.reach_at(end)
    if low != high and mount.standoff > 0.0:  # the round lip over which the tail leaves, as wide as the tail's slot
        edge = lip(layout) or round_edge(layout.spec.fpc, end, mount.standoff / 2, 0.0)
        cuts.append(rounded_edge(edge, (low - room, high + room), under))
    cap = subtract(cap, cuts, "cap")
    # The holes of the clamping screws, one from each side at the finger's half height
    x = (x1 + end) / 2
    z = top - finger.size[1] / 2
    bd = import_extra("build123d")
    for side in (-1.0, 1.0):
        lie = bd.Plane((x * MM, y * MM, z * MM), z_dir=(0, side, 0))
        screw = bd.Solid.make_cylinder(TAPPED * finger.screw / 2 * MM, (half + 1e-3) * MM, lie)
        cap = one_solid(cap - screw, "cap")
    disc = layout.body_outline if has_round_body(layout.spec.fpc.body) else None
    return (cap, *spacer(layout.body, disc, shield, under))


CUT_OFF = 4e-3  # How far beyond the cap (m) the finger is drawn
"""Length (m) of the finger that is drawn beyond the cap."""


def metal_below(layout: Layout) -> tuple[Solid, ...]:
    """Return a metal finger or `mount.metal_behind`, as far as they are drawn. Empty if there is neither.

    They are not manufactured, weighed or printed. A finger is drawn up to `CUT_OFF` beyond its cap. Metal behind the
    board is drawn up to half a coil's size beyond the board's body, or fills the finger around it.
    """
    mount, end = layout.spec.mount, cap_end(layout.body, layout.spec.mount, layout.stiffener)
    if mount is None:
        return ()
    finger, under = None, board_heights(layout.spec.fpc.stackup)[0]
    if mount.finger is not None and end is not None:
        finger = _finger(layout.body, mount.finger, under - mount.standoff, layout.body[0], end + CUT_OFF, 0.0)
    behind = mount.metal_behind
    if behind is not None:
        (x0, y0, x1, y1), beyond, top = layout.body, max(layout.spec.coil.size) / 2, under - behind.distance
        sheet = box(x0 - beyond, y0 - beyond, top - behind.thickness, x1 + beyond, y1 + beyond, top)
        if finger is not None and mount.finger and behind.distance < mount.standoff + mount.finger.size[1]:
            sheet = one_solid(sheet & finger, "metal behind")
        return (_drawn_metal(sheet, behind.material.name, BodyRole.METAL_BEHIND),)
    if finger is None or mount.finger is None or mount.finger.material is None:
        return ()
    return (_drawn_metal(finger, mount.finger.material.name, BodyRole.FINGER),)


def _drawn_metal(shape: Any, metal: str, role: BodyRole) -> Solid:
    return Solid(role, shape, metal, metal_colour(metal), role)


def _finger(body: Box, finger: Finger, top: float, start: float, end: float, room: float ) -> Any:
    """Return the finger between two x (m), enlarged by `room` (m) on each side.

    `top` (m) is its upper face's height.
    """
    bd, y, (width, height) = import_extra("build123d"), board_middle(body).y, finger.size
    if finger.outline.is_disc:
        radius = width / 2 + room
        lie = bd.Plane((start * MM, y * MM, (top - radius) * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
        return bd.Solid.make_cylinder(radius * MM, (end - start) * MM, lie)
    half = width / 2 + room
    return box(start, y - half, top - height - 2.0 * room, end, y + half, top)
