"""Every bend of a board's tail, in one list: those that its mount makes, and the spec's own.

Checks, drawings, order notes, steps of the assembly and the KiCad board take it from here; the solids follow the way of
the tail (`sitscad.scene.tail_path`) that it is read from. Places count along the flat tail, on its middle line.
"""

from __future__ import annotations

import math

from sitscad.layout.board import Layout
from sitscad.layout.tail.bending import Bend, bend_length, bend_radius, bend_stretch
from sitscad.scene.grasper.jaws import fitted_jaw, jaw_range
from sitscad.scene.tail_path import free_from, lip, tail_path

SAME = 1e-9


def bends(layout: Layout) -> tuple[Bend, ...]:
    """The bends from the body on; none where the tail has none, or nothing straight to bend."""
    own = own_bend(layout)
    return (*bends_of_mount(layout), *(() if own is None else (own,)))


def bends_of_mount(layout: Layout) -> tuple[Bend, ...]:
    """The bends that let the tail down to the jaw or the finger; none where it stays level."""
    path = tail_path(layout)
    if path is None or path.radius is None:
        return ()
    whose = "finger" if fitted_jaw(layout) is None else "jaw"
    over = "off the body's level" if lip(layout) is None else "over the mount's round edge"
    found, here = [], layout.body[2]
    for stretch in path.stretches:
        end = here + stretch.length
        if stretch.turn:
            way, why = ("down", over) if stretch.turn < 0.0 else ("up", f"level again at the {whose}'s face")
            found.append(Bend((here + end) / 2, here, end, abs(stretch.turn), way, path.radius, False, why))
        here = end
    return tuple(found)


def own_bend(layout: Layout) -> Bend | None:
    """The bend that the spec asks for, beyond those of the mount; None without one, or with no straight tracks."""
    tail, room = layout.spec.fpc.tail, room_for_own(layout)
    if tail is None or room is None or not tail.bend_angle:
        return None
    half, low, high = bend_length(layout.spec) / 2, *room
    line, pivot = (low + high) / 2, pivot_line(layout)
    if tail.bend_at is not None:
        line = layout.body[2] + tail.bend_at
    elif pivot is not None and low + half <= pivot <= high - half:
        line = pivot
    radius, is_dynamic = bend_radius(layout.spec), tail.bend == "dynamic"
    return Bend(line, line - half, line + half, tail.bend_angle, tail.bend_direction, radius, is_dynamic)


def room_for_own(layout: Layout) -> tuple[float, float] | None:
    """Between which x (m) the spec's own bend has room: straight tracks beyond the mount and its bends; None where no
    tracks are straight.
    """
    tail, stretch = layout.spec.fpc.tail, bend_stretch(layout)
    if tail is None or stretch is None:
        return None
    taken = [bend.end for bend in bends_of_mount(layout)]
    if tail.bend_direction == "down":
        taken.append(free_from(layout))
    return max([stretch[0], *taken]), stretch[1]


def pivot_line(layout: Layout) -> float | None:
    """The x (m) of the flat tail that comes to lie under the pivot of the jaw's hinge, the jaw centred under the
    board's body; None without a hinge.
    """
    jaw, path = fitted_jaw(layout), tail_path(layout)
    if jaw is None or jaw.hinge is None:
        return None
    pivot = jaw_range(layout, jaw)[1] + jaw.hinge
    if path is None:
        return pivot
    bent = path.stretches[:-1]
    here = path.start
    for stretch in bent:
        here = here.after(stretch)
    return pivot + math.fsum(stretch.length for stretch in bent) - (here.x - path.start.x)
