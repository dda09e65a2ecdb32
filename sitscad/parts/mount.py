"""What carries the sensor: a seat at the standoff in the jaw, or a plate for the bench. Always an insulator.

Standoff is the distance to the nearest metal behind the coil, so a metal seat would void it: mounts are to be printed,
milled or cut from plastic. A shield lies between two pieces, `mount` below and `mount-spacer` above it.
Clearances: 0.15 mm is the tight fit of printed parts, 0.4 mm the thinnest supported wall (resin printing).
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import rectangle
from sitscad.geometry.region import Region
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, box, face, one_solid, plate_outline, prism, raised
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import (
    MOUNT_PIECES,
    BodyRole,
    Heights,
    above_board,
    board_heights,
    film_thickness,
    seat_spans,
)
from sitscad.scene.jaws import (
    POCKET_CLEARANCE,
    axis,
    closed_span,
    fitted_jaw,
    jaw_range,
    made_to_measure,
    shield_that_fits,
)
from sitscad.scene.printing import print_limit
from sitscad.spec.sensor import Jaw

MATERIAL, COLOUR = "printed resin", "#dfe6e9"
CLEARANCE = 0.15e-3
STOP_THICKNESS = 0.5e-3
STOP_ROUNDING = 0.2e-3
HEEL_ROUNDING = 0.3e-3
GROOVE_WIDTH, GROOVE_DEPTH = 0.4e-3, 0.1e-3
BENCH_FLOOR = 2.0e-3
BENCH_BORDER = 6.0e-3
BENCH_CORNER = 2.0e-3
SCREW_HOLE = 2.4e-3  # clearance hole for M2, ISO 273 medium series
SCREW_INSET = 3.0e-3
TAIL_RELIEF = 0.5e-3


def mount(layout: Layout) -> tuple[Solid, ...]:
    """The pieces of the mount from the bottom up; none where the board lies on the metal itself."""
    wanted = layout.spec.mount
    if wanted is None:
        return ()
    build = {"grasper-pad": grasper_pad, "bench-plate": bench_plate}[wanted.kind]
    shapes = build(layout, wanted.standoff)
    named = zip(MOUNT_PIECES, shapes, strict=False)
    return tuple(Solid(name, shape, MATERIAL, COLOUR, BodyRole.MOUNT) for name, shape in named)


def grasper_pad(layout: Layout, standoff: float) -> tuple[Any, ...]:
    """The seat under the board's body: a stop for the board at the jaw's tip where the jaw is long enough, grooves for
    the glue to escape into, and a round edge for the tail to leave over.
    """
    x0, y0, x1, y1 = layout.body
    spans = seat_spans(board_heights(layout.spec)[0], standoff, shield_that_fits(layout.spec))
    slabs = [box(x0, y0, lower, x1, y1, upper) for lower, upper in spans]
    if slabs:
        slabs[-1] = _grooved(layout, _rounded_heel(slabs[-1], spans[-1]), spans[-1])
    stop = _stop(layout, *spans[0]) if spans else None
    if stop is not None:
        slabs[0] = one_solid(slabs[0] + stop, "mount")
    return tuple(_within_port(layout, slab) for slab in slabs)


def bench_plate(layout: Layout, standoff: float) -> tuple[Any, ...]:
    """A plate flush with the board's top face: a recess for the board, relief for the tail, four M2 clearance holes."""
    under, shield = board_heights(layout.spec)[0], shield_that_fits(layout.spec)
    used = under - (shield[0] if shield else under)
    floor = standoff - used if fitted_jaw(layout) else max(standoff - used, BENCH_FLOOR)
    if floor <= 0.0:
        return _spacer(layout, shield)
    bottom = under - used - floor
    plan = plate_plan(layout, film_thickness(layout.spec))
    plate = prism(rectangle(*plan, BENCH_CORNER), bottom, 0.0)
    for cut in (*_recess(layout, shield), *_tail_relief(layout, plan, floor), *_holes(layout, plan, bottom)):
        plate = one_solid(plate - cut, "mount")
    return (plate, *_spacer(layout, shield))


def _rounded_heel(slab: Any, span: Heights) -> Any:
    """The slab with its upper edge towards the hinge rounded, so that the tail bends over no sharp edge."""
    bounds = slab.bounding_box()
    edges = [
        edge
        for edge in slab.edges()
        if edge.bounding_box().min.X > bounds.max.X - 1e-6 and edge.bounding_box().min.Z > bounds.max.Z - 1e-6
    ]
    return slab.fillet(min(HEEL_ROUNDING, 0.6 * (span[1] - span[0])) * MM, edges)


def _grooved(layout: Layout, slab: Any, span: Heights) -> Any:
    """Grooves across the face that the board is glued on; none where they would leave too thin a wall."""
    mount = layout.spec.mount
    wall = print_limit(mount.process if mount is not None else "resin", "wall").value
    if span[1] - span[0] - GROOVE_DEPTH < wall - 1e-9:
        return slab
    x0, y0, x1, y1 = layout.body
    for share in (0.2, 0.4, 0.6, 0.8):
        x = x0 + share * (x1 - x0)
        groove = box(x - GROOVE_WIDTH / 2, y0 - 1e-3, span[1] - GROOVE_DEPTH, x + GROOVE_WIDTH / 2, y1 + 1e-3, span[1])
        slab = one_solid(slab - groove, "mount")
    return slab


def _within_port(layout: Layout, slab: Any) -> Any:
    """The slab without the edges that could stand out of the port's circle, tolerances at their worst, jaws closed."""
    fitted, span = fitted_jaw(layout), closed_span(layout)
    if fitted is None or span is None:
        return slab
    slab = _within_pocket(layout, fitted, slab, span[0] + fitted.height)
    bd, radius = require("build123d"), made_to_measure(layout, fitted) * MM
    bounds, middle, level = slab.bounding_box(), axis(layout).y * MM, (span[0] + span[1]) / 2 * MM
    heights = (bounds.min.Z - level, bounds.max.Z - level)
    reach = max(math.hypot(bounds.max.Y - middle, height) for height in heights)
    if reach <= radius or max(map(abs, heights)) >= radius:
        return slab
    along = bd.Plane((bounds.min.X - 1, middle, level), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
    return one_solid(slab & bd.Solid.make_cylinder(radius, bounds.size.X + 2, along), "mount")


def _within_pocket(layout: Layout, fitted: Jaw, slab: Any, floor: float) -> Any:
    """What of the slab lies below the rims is as narrow and short as their pocket; above them it may lie on them."""
    bounds, rims = slab.bounding_box(), floor + fitted.recess
    if fitted.pocket is None or rims - 1e-9 < bounds.min.Z / MM:
        return slab
    (x0, x1), y = jaw_range(layout, fitted), axis(layout).y
    middle = (x0 + x1) / 2
    along, across = (size / 2 - POCKET_CLEARANCE for size in fitted.pocket)
    above = box(x0 - 1e-3, y - fitted.width, rims, x1 + 1e-3, y + fitted.width, bounds.max.Z / MM + 1e-3)
    within = box(middle - along, y - across, floor - 1e-3, middle + along, y + across, rims)
    return one_solid(slab & (within + above), "mount")


def _stop(layout: Layout, bottom: float, foot: float) -> Any | None:
    """The rounded ledge before the board's end at the tip, on a slab from `bottom` to `foot`; None without room."""
    x0, y0, _, y1 = layout.body
    outer, fitted = x0 - CLEARANCE - STOP_THICKNESS, fitted_jaw(layout)
    if fitted and jaw_range(layout, fitted)[0] > outer + 1e-9:
        return None
    ledge = box(outer, y0, bottom, outer + STOP_THICKNESS, y1, 0.0)
    centres = [(edge, tuple(edge.center())) for edge in ledge.edges()]
    rim = [edge for edge, (x, _, z) in centres if x < outer * MM + 1e-6 and z > -1e-6]
    rounded = ledge.fillet(STOP_ROUNDING * MM, rim)
    return one_solid(rounded + box(outer + STOP_THICKNESS / 2, y0, bottom, x0, y1, foot), "mount")


def _spacer(layout: Layout, shield: Heights | None) -> tuple[Any, ...]:
    """The slab that keeps the shield at its gap below the board of a bench plate."""
    under = board_heights(layout.spec)[0]
    if shield is None or under - shield[1] < 1e-9:
        return ()
    x0, y0, x1, y1 = layout.body
    return (box(x0, y0, shield[1], x1, y1, under),)


def plate_plan(layout: Layout, film: float) -> tuple[float, float, float, float]:
    """The plate's rectangle: the body, whatever overhangs it and the tail beside the screws, and a border for these."""
    x0, y0, x1, y1 = layout.body
    near = [point.y for point in layout.outline.flattened(1e-5) if point.x < x1 + BENCH_BORDER]
    y0, y1 = min(y0, *near), max(y1, *near)
    for body in above_board(layout.spec):
        left, low, right, high = body.footprint.box
        x0, y0, x1, y1 = min(x0, left - film), min(y0, low - film), max(x1, right + film), max(y1, high + film)
    return x0 - BENCH_BORDER, y0 - BENCH_BORDER, x1 + BENCH_BORDER, y1 + BENCH_BORDER


def _recess(layout: Layout, shield: Heights | None) -> tuple[Any, ...]:
    """What the board with its clearance takes out of the plate, and below it the shield and its spacer."""
    under = board_heights(layout.spec)[0]
    cuts = [raised(grown(layout), under, 1e-3)]
    if shield is not None:
        x0, y0, x1, y1 = layout.body
        pocket = rectangle(x0 - CLEARANCE, y0 - CLEARANCE, x1 + CLEARANCE, y1 + CLEARANCE)
        cuts.append(prism(pocket, shield[0], 1e-3))
    if layout.stiffener is not None:
        x0, y0, x1, y1 = _box_of(face(layout.stiffener.outline))
        deep = under - layout.stiffener.thickness - CLEARANCE
        cuts.append(box(x0 - CLEARANCE, y0 - CLEARANCE, deep, x1 + CLEARANCE, y1 + CLEARANCE, 1e-3))
    return tuple(cuts)


def _tail_relief(layout: Layout, plan: tuple[float, ...], floor: float) -> tuple[Any, ...]:
    """A deeper slot under the tail from the body to the plate's edge, so that the tail may bend down freely."""
    start = layout.body[2] + CLEARANCE
    depth = min(TAIL_RELIEF, floor / 2)
    beyond = grown(layout) & _slab_face(start, plan)
    if not beyond:
        return ()
    x0, y0, x1, y1 = _box_of(beyond)
    if x1 < plan[2] - 1e-9:
        return ()
    return (box(x0, y0, board_heights(layout.spec)[0] - depth, plan[2] + 1e-3, y1, 1e-3),)


def _holes(layout: Layout, plan: tuple[float, ...], bottom: float) -> tuple[Any, ...]:
    """Four screw holes in the corners; the border keeps them clear of board and tail."""
    x0, y0, x1, y1 = (plan[0] + SCREW_INSET, plan[1] + SCREW_INSET, plan[2] - SCREW_INSET, plan[3] - SCREW_INSET)
    centres = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    size = (SCREW_HOLE, SCREW_HOLE)
    return tuple(prism(Region(plate_outline("circle", size, c)), bottom - 1e-3, 1e-3) for c in centres)


def _slab_face(start: float, plan: tuple[float, ...]) -> Any:
    """Everything in plan beyond x = `start` and within the plate's length."""
    return face(Region(rectangle(start, plan[1] - 1e-3, plan[2] + 1e-3, plan[3] + 1e-3)))


def grown(layout: Layout) -> Any:
    """The board's outline grown by the clearance, as a face."""
    bd = require("build123d")
    return bd.offset(face(Region(layout.outline)), CLEARANCE * MM, kind=bd.Kind.ARC).faces()[0]


def _box_of(shape: Any) -> tuple[float, float, float, float]:
    """Bounding box in plan of a build123d shape, in metres."""
    bounds = shape.bounding_box()
    return bounds.min.X / MM, bounds.min.Y / MM, bounds.max.X / MM, bounds.max.Y / MM
