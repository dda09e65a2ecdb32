"""All pieces of a sensor in their places, from the jaw upwards."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.geometry.convex import Footprint, within_box
from sitscad.geometry.path import Path, Point, Region, bounding_box, rectangle
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import CutPart, LaserSheet, laser_sheets
from sitscad.layout.thickness import tail_layers
from sitscad.scene.bodies import Body, BodyRole, Heights, above_board, board_heights, seat_heights, top_height
from sitscad.scene.jaws import axis, fitted_jaw, half_width, jaw_range, section, shield_that_fits
from sitscad.units import in_mm


def stack(layout: Layout) -> tuple[Body, ...]:
    """What the spec contains but for the mount's printed pieces, by height of the lower face; both jaws are closed
    without force. Raises `PartsError` where shield and standoff contradict each other.
    """
    found = [*_jaws(layout), *(body for body in (shield(layout), board(layout), stiffener(layout)) if body)]
    found += above_board(layout.spec)
    if (film := encapsulation(layout)) is not None:
        found.append(film)
    return tuple(sorted(found, key=lambda body: (body.lower, body.upper)))


def board(layout: Layout) -> Body:
    """The flexible circuit with its tail held straight, without stiffener."""
    return Body(BodyRole.BOARD, Region(layout.outline), *board_heights(layout.spec), "polyimide")


def stiffener(layout: Layout) -> Body | None:
    """The plate under the contacts, bonded to the tail's bottom face."""
    plate = layout.stiffener
    if plate is None:
        return None
    upper = tail_heights(layout)[0]
    return Body(BodyRole.STIFFENER, plate.outline, upper - plate.thickness, upper, plate.material)


def tail_heights(layout: Layout) -> Heights:
    """The tail: from the bottom of the layers that run down it up to the board's top face."""
    return -math.fsum(layer.thickness for layer in tail_layers(layout)), 0.0


def shield(layout: Layout) -> Body | None:
    """The sheet between coil and jaw. The spec gives it no size: it is made as large as the board's body, and narrower
    where the port asks for it. Raises `PartsError` where it does not fit into the standoff.
    """
    sheet, levels = layout.spec.shield, shield_that_fits(layout.spec)
    if sheet is None or levels is None:
        return None
    (x0, _, x1, _), y, half = layout.body, axis(layout).y, half_width(layout, levels[0])
    plan = Region(rectangle(x0, y - half, x1, y + half))
    return Body(BodyRole.SHIELD, plan, *levels, sheet.material.name, sheet.material)


def sheets(layout: Layout, stop: str = "") -> tuple[LaserSheet, ...]:
    """The laser's sheets of elastomer, target and shield, of those that the spec has; as
    `sitscad.layout.laser_sheet.laser_sheets` otherwise. Raises `PartsError` where the shield does not fit.
    """
    return laser_sheets(layout, shield_part(layout), stop)


def shield_part(layout: Layout) -> tuple[CutPart, ...]:
    """The shield as a part to be cut; nothing without one. Raises `PartsError` where it does not fit."""
    sheet, body = layout.spec.shield, shield(layout)
    if sheet is None or body is None:
        return ()
    x0, y0, x1, y1 = bounding_box((body.outline(),))
    place = Footprint(False, (x1 - x0, y1 - y0), Point((x0 + x1) / 2, (y0 + y1) / 2))
    words = f"goes under the board, {in_mm(sheet.gap)} mm below its lower face"
    return (CutPart(body.name, body.material, "rectangle", place.size, sheet.thickness, sheet.kerf, place, words),)


def encapsulation(layout: Layout) -> Body | None:
    """The film over the board's body and what stands on it; it goes round them, so it is thinner than it is high."""
    film = layout.spec.encapsulation
    if film is None:
        return None
    return Body(BodyRole.ENCAPSULATION, Region(ground(layout)), 0.0, top_height(layout.spec), film.material.name)


def ground(layout: Layout) -> Path:
    """What plates can lie on: the board's body with its rounded corners, without taper and tail; counter-clockwise."""
    found = within_box(layout.outline, layout.body)
    assert found is not None
    return found


def _jaws(layout: Layout) -> Iterator[Body]:
    """The jaws as bodies, and the other one's pad."""
    jaw, seat = fitted_jaw(layout), seat_heights(layout.spec)
    if jaw is None or seat is None:
        return
    (x0, x1), y, half = jaw_range(layout, jaw), axis(layout).y, section(jaw).face / 2
    face = Region(rectangle(x0, y - half, x1, y + half))
    name, top = jaw.material.name, top_height(layout.spec)
    pad = top + jaw.opposing_pad_thickness
    yield Body(BodyRole.JAW, face, seat[0] - jaw.height, seat[0], name, jaw.material)
    if jaw.opposing_pad_thickness > 0.0:
        yield Body(BodyRole.OPPOSING_PAD, face, top, pad, "pad")
    yield Body(BodyRole.OPPOSING_JAW, face, pad, pad + jaw.height, name, jaw.material)
