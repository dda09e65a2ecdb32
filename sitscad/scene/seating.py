"""What places and holds the board on a grasper's pad: ledges beside it, a tongue under its tail, dovetail or pins.

Worked out once for both tiers of the fit: `sitscad.scene.fit` takes the corners, `sitscad.parts.seat` builds.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.bodies import board_heights, seat_spans
from sitscad.scene.column import print_limit
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range, rim, room_across, section, shield_that_fits
from sitscad.scene.stack import tail_heights
from sitscad.spec.mount import Mount, Retention

TIGHT = 0.15e-3
"""Between printed parts that go into each other by hand, on each side (m); coarser processes leave more."""

STOP = 0.5e-3
"""Thickness of a ledge (m) where the process makes it so thin."""

LONGEST_RELIEF, LEAST_RELIEF = 4.0e-3, 1.0e-3
"""How far the tongue under the tail may reach behind the body, and the least that is worth the plastic (m)."""


SAME = 1e-5
"""Widths of the tail that differ by less (m) are the same: its arcs are taken as chords."""


@record
class Relief:
    """The tongue under the tail that takes a pull off the body: from where to where along the jaw, its sides, the
    tail's (all m), the height of the tail's lower face, and where cheeks beside the tail begin (None: no room for any).
    """

    along: tuple[float, float]
    across: tuple[float, float]
    tail: tuple[float, float]
    top: float
    cheeks: float | None


def clearance(mount: Mount | None) -> float:
    """Between a printed piece and what goes into it, on each side (m)."""
    return max(TIGHT, print_limit(_process(mount), "clearance").value)


def ledge(mount: Mount | None) -> float:
    """The thickness (m) of a ledge that stands free on one side."""
    return max(STOP, print_limit(_process(mount), "free_wall").value)


def _process(mount: Mount | None) -> str:
    return mount.process if mount is not None else "resin"


def stop_place(layout: Layout) -> tuple[float, float] | None:
    """Where the ledge before the board's end at the tip begins and ends along the jaw (m); None without room for it."""
    mount, fitted = layout.spec.mount, fitted_jaw(layout)
    inner = layout.body[0] - clearance(mount)
    outer = inner - ledge(mount)
    return None if fitted and jaw_range(layout, fitted)[0] > outer + 1e-9 else (outer, inner)


def side_ledges(layout: Layout) -> tuple[float, float] | None:
    """Inner and outer half width (m) of the ledges beside the board; None where jaw or port leave no room for them."""
    mount, jaw = layout.spec.mount, fitted_jaw(layout)
    if mount is None or jaw is None or mount.kind != "grasper-pad":
        return None
    spans = seat_spans(board_heights(layout.spec)[0], mount.standoff, shield_that_fits(layout.spec))
    inner = layout.body_size[1] / 2 + clearance(mount)
    outer = inner + ledge(mount)
    if not spans or outer > section(rim(jaw)).face / 2:
        return None
    room = min(room_across(layout, spans[0][0]), room_across(layout, 0.0))
    return (inner, outer) if outer <= room else None


def relief(layout: Layout) -> Relief | None:
    """The tongue under the tail; None without a tail, or where jaw and stiffener leave it no room."""
    mount, jaw = layout.spec.mount, fitted_jaw(layout)
    if mount is None or jaw is None or mount.kind != "grasper-pad" or not mount.standoff:
        return None
    start = layout.body[2]
    end = min(start + LONGEST_RELIEF, jaw_range(layout, jaw)[1] - 0.2e-3, _before_stiffener(layout))
    if jaw.pocket is not None and jaw.recess:
        middle = sum(jaw_range(layout, jaw)) / 2
        end = min(end, middle + jaw.pocket[0] / 2 - clearance(mount))
    tail = _tail_across(layout, end)
    if end - start < LEAST_RELIEF or tail is None:
        return None
    wall = clearance(mount) + ledge(mount)
    low, high = layout.body[1], layout.body[3]
    across, cheeks = (max(low, tail[0]), min(high, tail[1])), None
    straight = _straight_from(layout, tail, start, end) + clearance(mount)
    if tail[0] - wall >= low and tail[1] + wall <= high and end - straight >= LEAST_RELIEF:
        across, cheeks = (tail[0] - wall, tail[1] + wall), straight
    return Relief((start, end), across, tail, tail_heights(layout)[0], cheeks)


def _straight_from(layout: Layout, tail: tuple[float, float], start: float, end: float) -> float:
    """From where on (m) the tail is no wider than it is at the end: the last place at which an edge of the board, its
    taper too, stands beyond those sides.
    """
    points = layout.outline.flattened(1e-5)
    beyond = [start]
    for a, b in pairwise([*points, points[0]]):
        for side, limit in ((-1.0, tail[0] - SAME), (1.0, tail[1] + SAME)):
            low, high = sorted((a, b), key=lambda point: side * point.y)
            if side * (high.y - limit) <= 0.0 or max(a.x, b.x) < start or min(a.x, b.x) > end:
                continue
            inner = low.x if side * (low.y - limit) >= 0.0 else a.x + (b.x - a.x) * (limit - a.y) / (b.y - a.y)
            beyond.append(min(max(inner, high.x), end))
    return max(beyond)


def cap_end(layout: Layout) -> float | None:
    """Where a fingertip's cap ends along the tail (m): before the tail's stiffener; None for any other mount."""
    mount = layout.spec.mount
    if mount is None or mount.finger is None:
        return None
    return min(layout.body[2] + mount.finger.grip, _before_stiffener(layout) - 0.7e-3)


def _before_stiffener(layout: Layout) -> float:
    """Where a stiffener under the tail begins, less a little (m); endless without one."""
    plate = layout.stiffener
    if plate is None:
        return math.inf
    return min(p.x for s in plate.outline.outline for p in (s.start, s.end)) - 0.3e-3


def _tail_across(layout: Layout, end: float) -> tuple[float, float] | None:
    """The tail's sides (m) at a place along the jaw, beyond the body; None where there is no tail."""
    points = layout.outline.flattened(1e-5)
    if max(point.x for point in points) < end:
        return None
    loop = [*points, points[0]]
    crossings = [
        a.y + (b.y - a.y) * (end - a.x) / (b.x - a.x)
        for a, b in pairwise(loop)
        if (a.x - end) * (b.x - end) <= 0.0 and a.x != b.x
    ]
    return (min(crossings), max(crossings)) if crossings else None


def retention(layout: Layout) -> Retention | None:
    """What holds the mount besides glue, its sizes settled; None for glue alone."""
    mount = layout.spec.mount
    found = mount.retention if mount is not None else None
    if found is None:
        return None
    x0, _, x1, _ = layout.body
    return replace(found, spacing=found.spacing if found.spacing is not None else (x1 - x0) / 2)


def joint_clearance(layout: Layout) -> float:
    """Between tongue or pin and the jaw that is cut for it, on each side (m): the process's, and the glue line that
    lifts the mount.
    """
    mount = layout.spec.mount
    return print_limit(_process(mount), "clearance").value + layout.spec.assembly.glue_line


def neck(found: Retention) -> float:
    """The width (m) of a dovetail's tongue where it is narrowest, at the mount."""
    return found.width - 2.0 * found.depth / math.tan(found.angle)


def tongue_across(found: Retention, room: float) -> tuple[float, float, float]:
    """Half widths (m) of a dovetail at its bottom and at the mount's lower face, and its depth; larger on every face by
    a clearance (m).
    """
    flank = room / math.sin(found.angle)
    bottom = found.width / 2 + room / math.tan(found.angle) + flank
    return bottom, neck(found) / 2 + flank, found.depth + room


def metal_below(layout: Layout) -> float | None:
    """The least metal (m) that a dovetail's groove leaves of the jaw; None without one."""
    found, jaw = retention(layout), fitted_jaw(layout)
    if found is None or jaw is None or found.kind != "dovetail":
        return None
    bar = section(jaw)
    half, _, depth = tongue_across(found, joint_clearance(layout))
    if half >= bar.face / 2:
        return 0.0
    sagitta = bar.radius - math.sqrt(max(0.0, bar.radius**2 - half**2))
    return jaw.height - sagitta - depth


def pin_places(layout: Layout) -> tuple[tuple[float, float], ...]:
    """Where pins stand (m): two in the jaw's middle; none without them."""
    found = retention(layout)
    if found is None or found.kind != "pins" or found.spacing is None:
        return ()
    middle = axis(layout)
    return tuple((middle.x + side * found.spacing / 2, middle.y) for side in (-1.0, 1.0))
