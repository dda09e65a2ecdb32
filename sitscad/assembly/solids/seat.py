"""The seat: an insert in a grasper's jaw that carries the board at the standoff.

It has ledges that position the board, glue grooves, a support under the tail, and a dovetail or pins if the spec has
them. Ledges are at the tip and, if jaw and port are wide enough, on both sides. They end at the board's top face. The
pad may therefore bulge over them, and the opposing jaw does not touch them. A jig positions pad and target during
gluing.
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.assembly.places.bodies import BodyRole, Heights, backing_of, top_height
from sitscad.assembly.places.column import print_limit, print_process, worst_deviations
from sitscad.assembly.places.jaws import (
    POCKET_CLEARANCE,
    board_middle,
    closed_span,
    jaw_range,
    seat_circle_radius,
)
from sitscad.assembly.places.seating import (
    Relief,
    clearance,
    joint_clearance,
    ledge,
    pin_places,
    retention,
    side_ledges,
    stop_place,
    tail_support,
    tongue_across,
    tongue_neck,
)
from sitscad.assembly.places.tail_path import Lip, lip
from sitscad.assembly.solids.plates import rounded_edge
from sitscad.assembly.solids.solid import (
    MM,
    PartsError,
    Solid,
    box,
    extrude_along_jaw,
    import_extra,
    manifold,
    one_solid,
    prism,
    rounded_at_tip,
    tessellate,
    top_edges,
)
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Point, circle, closed_polygon, rounded_polygon
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, Mount, Retention

LEDGE_ROUNDING = 0.2e-3
HEEL_ROUNDING = 0.3e-3
TIP_ROUNDING = 0.4e-3  # Of the seat's upright edges at the tip (m): tissue slides over them
"""Radius (m) of the seat's vertical edges at the tip, which slide over tissue."""
CORNER_ROUNDING = 0.3e-3  # Of the outer upright edges of the ledges beside the board (m)
"""Radius (m) of the outer vertical edges of the ledges beside the board."""
CHEEK_BACK = 0.2e-3  # Between the cheeks' end and the tongue's (m)
"""Distance (m) between the end of the walls beside the tail and the end of the support under the tail."""
FACETS = 256  # Sides of the prism within the port's cylinder, 0.2 um inside it, for seats that it cannot cut
"""Number of sides of a prism that replaces the port's cylinder, with an error of 0.2 um, if cutting by it fails."""
MESH_ERROR = 5e-3  # Share of a volume by which a mesh may differ from its solid: a wrong cut is off by more
"""Largest relative difference between the volumes of a mesh and its solid. A failed cut gives larger differences."""

GROOVE_DEPTH = 0.1e-3
"""Depth (m) of the glue grooves."""
GROOVES = (0.2, 0.4, 0.6, 0.8)
"""Positions of the glue grooves, as fractions of the body's length."""


def grasper_pad(layout: Layout) -> tuple[Any, ...]:
    """Return the seat's printed parts from the bottom up. Empty if the board lies directly on metal."""
    backing_of(layout.spec).shield_that_fits()
    spans = backing_of(layout.spec).spans
    if not spans:
        return ()
    tongue, (x0, y0, x1, y1) = tail_support(layout), layout.body
    tip = 0.0 if stop_place(layout.body, layout.spec.jaw, layout.spec.mount) else min(TIP_ROUNDING, (y1 - y0) / 4)
    slabs = [prism(rounded_at_tip(x0, y0, x1, y1, tip), *span) for span in spans]
    slabs[-1] = _with_grooves(layout.body, layout.spec.mount, slabs[-1], spans[-1])
    if tongue is not None:
        slabs[-1] = _with_relief(layout.spec.mount, lip(layout), slabs[-1], spans[-1], tongue)
    else:  # its upper edge towards the hinge is rounded, so that the tail bends over no sharp edge
        radius = min(HEEL_ROUNDING, 0.6 * (spans[-1][1] - spans[-1][0]))
        slabs[-1] = slabs[-1].fillet(radius * MM, _top_edges_at_heel(slabs[-1]))
    ledges = side_ledges(layout)
    sides = () if ledges is None else _side_ledges(layout.body, ledges, *spans[0])
    for placing in (*_tip_ledge(layout.body, layout.spec.mount, *spans[0]), *sides):
        slabs[0] = one_solid(slabs[0] + placing, "mount")
    jaw, closed = layout.spec.jaw, closed_span(backing_of(layout.spec), top_height(layout.spec))
    if jaw is not None and closed is not None:
        slabs = [_within_port(layout.body, jaw, closed, seat_circle_radius(jaw, worst_deviations(layout)), slab)
                 for slab in slabs]
    slabs[0] = with_retention(layout.body, layout.spec.mount, slabs[0], spans[0][0])
    return tuple(slabs)


def _top_edges_at_heel(shape: Any) -> list[Any]:
    """Return the uppermost edges of a shape at its end towards the hinge."""
    end = shape.bounding_box().max.X
    at_end = [edge for edge in shape.edges() if end - 1e-6 < edge.bounding_box().min.X]
    top = max(edge.bounding_box().max.Z for edge in at_end)
    return [edge for edge in at_end if top - 1e-6 < edge.bounding_box().min.Z]


def _with_relief(mount: Mount | None, edge: Lip | None, slab: Any, span: Heights, tongue: Relief) -> Any:
    """Return the slab with a rounded support under the tail, and walls beside the tail if there is room for them.

    `edge` is the support's edge over which the tail is bent. None if the tail is not bent there.
    """
    (start, end), (low, high) = tongue.along, tongue.across
    lap = 0.2e-3
    bar = box(start, low, span[0], end, high, tongue.top)
    if edge is None:
        radius = min(0.6 * (tongue.top - span[0]), tongue.along[1] - tongue.along[0] - 0.2e-3)
        bar = bar.fillet(radius * MM, _top_edges_at_heel(bar))
    else:
        bar = one_solid(bar - rounded_edge(edge, tongue.across, tongue.top), "mount")
    slab = one_solid(slab + bar + box(start - lap, low, span[0], start + lap, high, span[1]), "mount")
    if tongue.cheeks is None:
        return slab
    room, wall = clearance(mount), ledge(mount)
    for inner, side in ((tongue.tail[0] - room, -1.0), (tongue.tail[1] + room, 1.0)):
        y = sorted((inner, inner + side * wall))
        cheek = box(tongue.cheeks, y[0], span[0], end - CHEEK_BACK, y[1], 0.0)
        slab = one_solid(slab + cheek.fillet(LEDGE_ROUNDING * MM, top_edges(cheek)), "mount")
    return slab


def groove_places(body: Box, mount: Mount | None, span: Heights ) -> tuple[tuple[float, ...], float]:
    """Return the positions x (m) of the grooves across the board's glue face, and their width (m).

    No positions if the grooves would leave too thin a wall. `span` is the height range (m) of the slab.
    """
    process = print_process(mount)
    wall, width = print_limit(process, "wall").value, print_limit(process, "groove").value
    x0, _, x1, _ = body
    if span[1] - span[0] - GROOVE_DEPTH < wall - 1e-9 or (x1 - x0) * (GROOVES[1] - GROOVES[0]) < 2.0 * width:
        return (), width
    return tuple(x0 + share * (x1 - x0) for share in GROOVES), width


def _with_grooves(body: Box, mount: Mount | None, slab: Any, span: Heights) -> Any:
    """Return the slab with its glue grooves."""
    (places, width), (_, y0, _, y1) = groove_places(body, mount, span), body
    for x in places:
        groove = box(x - width / 2, y0 - 1e-3, span[1] - GROOVE_DEPTH, x + width / 2, y1 + 1e-3, span[1])
        slab = one_solid(slab - groove, "mount")
    return slab


def _within_port(body: Box, fitted: Jaw, closed: Heights, room: float, slab: Any ) -> Any:
    """Return the slab without the edges outside the port's circle, with worst-case tolerances and closed jaws.

    `closed` are the heights (m) of both backs, and `room` (m) is the radius of the circle for the slab.
    """
    slab = _within_pocket(body, fitted, slab, closed[0] + fitted.height)
    bd, radius = import_extra("build123d"), room * MM
    bounds, middle, level = slab.bounding_box(), board_middle(body).y * MM, (closed[0] + closed[1]) / 2 * MM
    heights = (bounds.min.Z - level, bounds.max.Z - level)
    half_size = max(bounds.max.Y - middle, middle - bounds.min.Y)
    reach = max(math.hypot(half_size, height) for height in heights)
    if reach <= radius or max(map(abs, heights)) >= radius:
        return slab
    plane = bd.Plane((bounds.min.X - 1, middle, level), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
    port = bd.Solid.make_cylinder(radius, bounds.size.X + 2, plane)
    about = bd.Solid.make_box(*(side + 1 for side in bounds.size), bd.Plane(bounds.min - bd.Vector(0.5, 0.5, 0.5)))
    turns = [2.0 * math.pi * (k + 0.37) / FACETS for k in range(FACETS)]
    corners = [bd.Vector(bounds.min.X - 1, middle + radius * math.cos(t), level + radius * math.sin(t)) for t in turns]
    prism = bd.Solid.extrude(bd.Face(bd.Wire.make_polygon(corners)), bd.Vector(bounds.size.X + 2, 0, 0))
    # what a seat and the port's cylinder share, `about` being a box round the seat. The kernel sometimes finds
    # nothing, or too much, where a round ledge meets the cylinder; so several ways are tried until one agrees
    # with the meshes
    solids = [Solid("mount", shape, "", "", BodyRole.MOUNT) for shape in (slab, port)]
    slab_mesh, port_mesh = (manifold(tessellate(solid)) for solid in solids)
    expected = float((slab_mesh ^ port_mesh).volume())
    cuts = (lambda: slab & port, lambda: slab & (port & about), lambda: slab - (about - port), lambda: slab & prism)
    for cut in cuts:
        shape = cut()
        parts = shape.solids() if shape is not None else []
        if len(parts) == 1 and abs(parts[0].volume - expected) < MESH_ERROR * expected:
            return parts[0]
    raise PartsError("the mount cannot be cut back to the port: another mount.standoff, or a lower stack")


def _within_pocket(body: Box, fitted: Jaw, slab: Any, floor: float) -> Any:
    """Return the slab, cut to the width and length of the pad pocket below the pocket's rims.

    Above the rims, the slab keeps its size. `floor` (m) is the height of the pocket's floor.
    """
    if fitted.pocket is None:
        return slab
    bounds, rims = slab.bounding_box(), floor + fitted.recess
    if rims - 1e-9 < bounds.min.Z / MM:
        return slab
    (x0, x1), y = jaw_range(body, fitted), board_middle(body).y
    middle = (x0 + x1) / 2
    half_length, half_width = (size / 2 - POCKET_CLEARANCE for size in fitted.pocket)
    above = box(x0 - 1e-3, y - fitted.width, rims, x1 + 1e-3, y + fitted.width, bounds.max.Z / MM + 1e-3)
    within = box(middle - half_length, y - half_width, floor - 1e-3, middle + half_length, y + half_width, rims)
    return one_solid(slab & (within + above), "mount")


def _tip_ledge(body: Box, mount: Mount | None, bottom: float, foot: float ) -> tuple[Any, ...]:
    """Return the rounded ledge before the board's end at the tip, from height `bottom` (m), with its foot.

    Empty if no room.
    """
    place = stop_place(body, mount.jaw if mount is not None else None, mount)
    if place is None:
        return ()
    (outer, inner), (x0, y0, _, y1) = place, body
    tip = min(TIP_ROUNDING, (inner - outer) * 0.8)
    wall = prism(rounded_at_tip(outer, y0, inner, y1, tip), bottom, 0.0)
    front = [edge for edge in wall.edges() if edge.bounding_box().min.Z > -1e-6 and inner * MM - 1e-3 > edge.center().X]
    joined = box((outer + inner) / 2, y0, bottom, x0, y1, foot)
    return joined, wall.fillet(LEDGE_ROUNDING * MM, front)


def _side_ledges(body: Box, half_widths: tuple[float, float], bottom: float, foot: float ) -> tuple[Any, ...]:
    """Return the ledges on both sides of the board, with the feet that join them to the slab.

    `half_widths` (m) are the distances of their inner and outer faces from the middle. `bottom` and `foot` (m) are
    heights.
    """
    (x0, _, x1, _), y, (inner, outer) = body, board_middle(body).y, half_widths
    ledges = []
    for side in (-1.0, 1.0):
        radius = min(CORNER_ROUNDING, (outer - inner) / 2)
        corners = [Point(x, y + side * half) for x, half in ((x0, inner), (x1, inner), (x1, outer), (x0, outer))]
        plan = rounded_polygon(corners if side > 0.0 else corners[::-1], [0.0, 0.0, radius, radius][:: int(side)])
        wall = prism(plan, bottom, 0.0)
        reach = sorted((y + side * (inner - 1e-3), y + side * (outer - radius)))
        ledges += [box(x0, reach[0], bottom, x1, reach[1], foot), wall.fillet(LEDGE_ROUNDING * MM, top_edges(wall))]
    return tuple(ledges)


CHAMFER = 0.1e-3  # Of the pins' ends (m), which find their holes by it
"""Size (m) of the chamfer at the pins' ends, which guides them into their holes."""

OVERCUT = 1.0e-3


def with_retention(body: Box, mount: Mount | None, seat: Any, metal: float) -> Any:
    """Return the seat's lowest part with its dovetail or pins. `metal` (m) is the height of the metal below it."""
    joint = retention(body, mount)
    if joint is None:
        return seat
    if joint.kind == "pins":
        for x, y in pin_places(body, mount):
            # A peg below the mount, its end chamfered
            peg = prism(circle(Point(x, y), joint.diameter / 2), metal - joint.depth, metal + 0.1e-3)
            low = peg.bounding_box().min.Z
            rim = [edge for edge in peg.edges() if low + 1e-6 > edge.bounding_box().max.Z]
            seat = one_solid(seat + peg.chamfer(min(CHAMFER, joint.depth / 3) * MM, None, rim), "mount")
        return seat
    x0, x1 = seat.bounding_box().min.X / MM, body[2]
    return one_solid(seat + extrude_along_jaw(_tongue(joint, 0.0), x0, x1, board_middle(body).y, metal), "mount")


def cut_for_retention(body: Box, mount: Mount, glue_line: float, jaw: Any, metal: float ) -> Any:
    """Return the jaw with the groove or holes for the mount's dovetail or pins. `metal` (m) is the height of its face.

    Groove and holes are larger by a gap on each side. The groove is open at the tip. The holes are drilled through, so
    that glue can flow out.
    """
    joint = retention(body, mount)
    room, fitted = joint_clearance(glue_line, mount), mount.jaw
    if joint is None or fitted is None:
        return jaw
    if joint.kind == "pins":
        for x, y in pin_places(body, mount):
            hole = circle(Point(x, y), joint.diameter / 2 + room)
            jaw = one_solid(jaw - prism(hole, metal - 2.0 * fitted.height, metal + OVERCUT), "jaw")
        return jaw
    tip = jaw_range(body, fitted)[0] - OVERCUT
    groove = extrude_along_jaw(_tongue(joint, room), tip, body[2] + room, board_middle(body).y, metal)
    return one_solid(jaw - groove, "jaw")


def _tongue(joint: Retention, room: float) -> Path:
    """Return the dovetail's cross-section (m) about y = 0, enlarged by a gap `room` (m) on each side.

    Raises `PartsError` if its flanks cross.
    """
    if tongue_neck(joint) <= 0.0:
        raise PartsError("the dovetail's flanks cross below the mount (mount.retention): it has no tongue")
    bottom, top, depth = tongue_across(joint, room)
    above = 0.1e-3  # into the mount, or out of the jaw: no face of it lies in that of another
    narrow = top - above / math.tan(joint.angle)
    corners = [Point(-bottom, -depth), Point(bottom, -depth), Point(narrow, above), Point(-narrow, above)]
    return closed_polygon(corners)
