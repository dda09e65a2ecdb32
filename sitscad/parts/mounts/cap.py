"""A cap for a robot's fingertip: it slips over the finger's end, two screws clamp it, and the board lies in its top.

What is touched is round; the tail leaves over a round lip towards the hand. The screws' holes are to be tapped.
"""

from __future__ import annotations

from typing import Any

from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.mounts.plate import recess, rounding, spacer
from sitscad.parts.prism import MM, box, one_solid
from sitscad.parts.solid import PartsError
from sitscad.scene.bodies import board_heights
from sitscad.scene.column import print_limit
from sitscad.scene.jaws import axis, shield_that_fits
from sitscad.scene.seating import cap_end, clearance, ledge
from sitscad.scene.tail_path import lip, round_edge
from sitscad.spec.mount import Finger

FRONT = 2.0e-3
"""Plastic before the finger's end (m)."""

ENGAGED = 1.5
"""Length of thread over the screw's diameter, in plastic."""

TAPPED = 0.82
"""Hole to be tapped over the thread's nominal diameter (M2: 1.6 mm, M3: 2.5 mm; ISO 2306)."""

TOUCHED = 1.5e-3
"""Radius of the edges that are touched (m)."""

LEAST_GRIP = 3e-3


def fingertip(layout: Layout, standoff: float) -> tuple[Any, ...]:
    """The cap, and the spacer over a shield. Raises `PartsError` where the tail's stiffener leaves no room to grip."""
    mount = layout.spec.mount
    assert mount is not None and mount.finger is not None
    finger, shield = mount.finger, shield_that_fits(layout.spec)
    under, room = board_heights(layout.spec)[0], clearance(mount)
    x0, y0, x1, y1 = layout.body
    end = _end(layout)
    side = max(ENGAGED * finger.screw, ledge(mount))
    half = max(finger.size[0] / 2 + room + side, (y1 - y0) / 2 + room + ledge(mount))
    top, y = under - standoff, axis(layout).y
    floor = print_limit(mount.process, "free_wall").value
    bottom = top - finger.size[1] - 2.0 * room - max(FRONT, floor)
    cap = _rounded(box(x0 - room - 2.0 * FRONT, y - half, bottom, end, y + half, 0.0))
    cap = one_solid(cap - _bore(layout, finger, top, x0 - room, end + 1e-3), "cap")
    for cut in (*recess(layout, shield), *_leaving(layout, end, standoff)):
        cap = one_solid(cap - cut, "cap")
    for screw in _screws(layout, finger, (x1 + end) / 2, top - finger.size[1] / 2, half):
        cap = one_solid(cap - screw, "cap")
    return (cap, *spacer(layout, shield))


def _end(layout: Layout) -> float:
    """Where the cap ends towards the hand (m)."""
    end = cap_end(layout)
    if end is None or end - layout.body[2] < LEAST_GRIP:
        raise PartsError("the tail's stiffener begins where the cap has to grip the finger: a longer fpc.tail.length")
    return end


def _rounded(block: Any) -> Any:
    """The block with all edges rounded but those of its open end."""
    last = block.bounding_box().max.X
    edges = [edge for edge in block.edges() if last - 1e-6 > edge.bounding_box().min.X]
    radius = min(TOUCHED * MM, 0.3 * min(block.bounding_box().size))
    return block.fillet(radius, edges)


def _bore(layout: Layout, finger: Finger, top: float, start: float, end: float) -> Any:
    """The finger's end with its clearance, its upper face at a height (m)."""
    bd, room = require("build123d"), clearance(layout.spec.mount)
    y, (width, height) = axis(layout).y, finger.size
    if finger.outline.is_round:
        radius = width / 2 + room
        lie = bd.Plane((start * MM, y * MM, (top - radius) * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
        return bd.Solid.make_cylinder(radius * MM, (end - start) * MM, lie)
    half = width / 2 + room
    return box(start, y - half, top - height - 2.0 * room, end, y + half, top)


def _leaving(layout: Layout, end: float, standoff: float) -> tuple[Any, ...]:
    """The round lip over which the tail leaves the cap, as wide as the tail's slot there."""
    low, high = layout.reach_at(end)
    if low == high or standoff <= 0.0:
        return ()
    room, under = clearance(layout.spec.mount), board_heights(layout.spec)[0]
    edge = lip(layout) or round_edge(layout.spec, end, standoff / 2, 0.0)
    return (rounding(edge, (low - room, high + room), under),)


def _screws(layout: Layout, finger: Finger, x: float, z: float, half: float) -> tuple[Any, ...]:
    """The holes of the clamping screws, one from each side at the finger's half height."""
    bd, y = require("build123d"), axis(layout).y
    found = []
    for side in (-1.0, 1.0):
        lie = bd.Plane((x * MM, y * MM, z * MM), z_dir=(0, side, 0))
        found.append(bd.Solid.make_cylinder(TAPPED * finger.screw / 2 * MM, (half + 1e-3) * MM, lie))
    return tuple(found)
