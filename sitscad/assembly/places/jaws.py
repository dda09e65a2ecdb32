"""The jaws: their section, where they stand, and the room that the port leaves between them. No CAD kernel."""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.assembly.places.bodies import Heights, seat_heights, shield_heights, top_height
from sitscad.assembly.places.column import slack
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Arc, Line, Path, Point
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, half_chord
from sitscad.spec.sensor import SensorSpec

FILM_ROUNDING = 0.8
"""Rounding of the film's outer edges as a share of its thickness: below 1, so that the film is nowhere too thin."""


class PartsError(ValueError):
    """A part that the spec asks for cannot exist; the text says why and what to change."""


@record
class JawSection:
    """A jaw across its axis, face up at height 0: width of its face, height, radius of its back (m). ``side`` is how
    far straight sides reach down from the face before the round back begins.
    """

    face: float
    height: float
    radius: float
    side: float

    @property
    def outline(self) -> Path:
        """The closed section, counter-clockwise, y as the path's x and z as its y."""
        half, centre = self.face / 2, Point(0.0, self.radius - self.height)
        back = Arc(Point(-half, -self.side), Point(half, -self.side), centre)
        if self.side <= 0.0:
            return Path((back, Line(back.end, back.start)))
        right, left = Point(half, 0.0), Point(-half, 0.0)
        return Path((back, Line(back.end, right), Line(right, left), Line(left, back.start)))


def section(jaw: Jaw) -> JawSection:
    """The section of a jaw that passes its port on its own: a bar of its width, rounded behind to the port's radius.

    The back is an arc of that radius, its lowest point ``height`` below the face. A flat jaw (one milled down to
    carry a sensor) has no straight sides left, and its face is the chord there, narrower than the jaw's width. A face
    that is measured wider than that chord has a flatter back.
    """
    half, radius, height = (jaw.face or jaw.width) / 2, jaw.port_diameter / 2, jaw.height
    if jaw.face is not None and height < half:  # a flatter back, if the face is wider than the port's chord
        radius = max(radius, (height**2 + half**2) / (2 * height))
    chord = half_chord(height, radius)
    if chord <= half:
        return JawSection(2 * chord, height, radius, max(0.0, height - radius))
    sagitta = radius - math.sqrt(radius**2 - half**2)
    return JawSection(2 * half, height, radius, height - sagitta)


def axis(body: tuple[float, float, float, float]) -> Point:
    """The middle of the board's body, over which the jaw is centred."""
    x0, y0, x1, y1 = body
    return Point((x0 + x1) / 2, (y0 + y1) / 2)


def jaw_range(body: tuple[float, float, float, float], fitted: Jaw) -> tuple[float, float]:
    """Where the jaw begins (its tip) and ends along x (m): its length, centred under the board's body."""
    middle = axis(body).x
    return middle - fitted.length / 2, middle + fitted.length / 2


def pivot_along(body: tuple[float, float, float, float], jaw: Jaw | None) -> float | None:
    """Where the pivot of the jaws' hinge is along the jaw (x, m); None where the hinge is not known."""
    return None if jaw is None or jaw.hinge is None else jaw_range(body, jaw)[1] + jaw.hinge


def closed_span(spec: SensorSpec) -> Heights | None:
    """The heights (m) of the backs of the jaw and of the opposing jaw, closed without force; None without a jaw. The
    hinge keeps both jaws level, so the closed pair's axis lies half way between these heights.
    """
    jaw, seat = spec.jaw, seat_heights(spec.fpc.stackup, spec.mount)
    if jaw is None or seat is None:
        return None
    return seat[0] - jaw.height, top_height(spec) + jaw.opposing_pad_thickness + jaw.height


def half_width(layout: Layout, z: float) -> float:
    """Half the width (m) of what lies below the board at height z: the body's, or what the closed pair's port leaves.
    Seat and shield are made to measure, so they are narrowed where a body's width would stand out of the port's circle,
    with glue and tolerances at their worst.
    """
    return min(layout.body_size[1] / 2, room_across(layout, z))


def room_across(layout: Layout, z: float) -> float:
    """Half the width (m) that port and pad pocket leave at height z, at worst; endless without, or above the rims."""
    jaw, span = layout.spec.jaw, closed_span(layout.spec)
    if jaw is None or span is None:
        return math.inf
    half = math.inf
    if jaw.pocket is not None and z - (span[0] + jaw.height) <= jaw.recess - 1e-9:
        half = jaw.pocket[1] / 2 - POCKET_CLEARANCE
    radius, aside = made_to_measure(layout, jaw), z - (span[0] + span[1]) / 2
    return min(half, math.sqrt(radius**2 - aside**2)) if abs(aside) < radius else half


def made_to_measure(layout: Layout, jaw: Jaw) -> float:
    """The radius (m) within which seat and shield are kept: the port's, less what glue and tolerances may move them."""
    return jaw.port_diameter / 2 - math.hypot(*slack(layout))


POCKET_CLEARANCE = 0.1e-3  # Between a pad pocket's walls and what is glued into it, on each side (m)


def rim(jaw: Jaw) -> Jaw:
    """The jaw up to the rims of its pad pocket: itself without one."""
    return replace(jaw, height=jaw.height + jaw.recess) if jaw.pocket is not None and jaw.recess else jaw


def shield_that_fits(spec: SensorSpec) -> Heights | None:
    """The heights (m) of the shield; raises `PartsError` where it does not fit above the metal of the jaw."""
    sheet, mount = spec.shield, spec.mount
    if sheet is not None and mount and mount.jaw and sheet.gap + sheet.thickness > mount.standoff + 1e-9:
        gap, thickness = sheet.gap * 1e3, sheet.thickness * 1e3
        raise PartsError(
            f"the shield ({gap:g} mm gap, {thickness:g} mm thick) does not fit into the {mount.standoff * 1e3:g} mm "
            f"standoff: give mount.standoff at least {gap + thickness:g} mm"
        )
    return shield_heights(spec.fpc.stackup, spec.shield)
