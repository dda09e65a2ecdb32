"""The sensor's stack in section: how high and how wide every piece is. Plain numbers in metres."""

from __future__ import annotations

import math

from sitscad.geometry.convex import within_box
from sitscad.geometry.path import Path
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.slabs import Slab, elastomer, target
from sitscad.spec.sensor import Jaw

# Rounding of the film's outer edges as a share of its thickness: below 1, so that the film is nowhere too thin.
FILM_ROUNDING = 0.8

MOUNT_PIECES = ("mount", "mount-spacer")
"""The printed pieces from the bottom up: drawing, bill of materials and files name them alike."""


class PartsError(ValueError):
    """A part that the spec asks for cannot exist; the text says why and what to change."""


@record
class Stack:
    """The pieces from the jaw upwards: slabs in their places, and heights of faces (m) as pairs (lower, upper), z = 0
    at the board's top face; None where there is no such part.

    ``seat`` reaches from the jaw's metal face to the board's bottom face; ``axis`` (x, y) is the middle of the board's
    body, over which the jaw is centred.
    """

    board: tuple[float, float]
    elastomer: Slab | None
    target: Slab | None
    shield: tuple[float, float] | None
    seat: tuple[float, float] | None
    film: float
    top: float
    axis: tuple[float, float]


def stack(layout: Layout) -> Stack:
    """The heights of a layout's stack; raises `PartsError` where shield and standoff contradict each other."""
    spec = layout.spec
    board = (-spec.fpc.stackup.thickness, 0.0)
    pad, plate = elastomer(spec), target(spec)
    film = spec.encapsulation.thickness if spec.encapsulation else 0.0
    shield = _shield(layout)
    seat = (board[0] - spec.mount.standoff, board[0]) if spec.mount else None
    x0, y0, x1, y1 = layout.body
    return Stack(
        board=board,
        elastomer=pad,
        target=plate,
        shield=shield,
        seat=seat,
        film=film,
        top=(plate.upper if plate else pad.upper if pad else board[1]) + film,
        axis=((x0 + x1) / 2, (y0 + y1) / 2),
    )


def seat_spans(board_bottom: float, standoff: float, shield: tuple[float, float] | None) -> list[tuple[float, float]]:
    """The heights (m) that the seat on a jaw fills, from the metal to the shield and from there to the board's bottom.

    Its pieces are printed, and bear the names of `MOUNT_PIECES` in that order.
    """
    metal = board_bottom - standoff
    spans = [(metal, board_bottom)] if shield is None else [(metal, shield[0]), (shield[1], board_bottom)]
    return [(lower, upper) for lower, upper in spans if upper - lower > 1e-9]


def fitted_jaw(layout: Layout) -> Jaw | None:
    """The jaw of the spec's mount, if it has one."""
    return layout.spec.mount.jaw if layout.spec.mount else None


def closed_span(layout: Layout) -> tuple[float, float] | None:
    """The heights (m) of the backs of the jaw and of the opposing jaw, closed without force; None without a jaw.

    The hinge keeps both jaws level, so the closed pair's axis lies half way between these heights.
    """
    jaw, levels = fitted_jaw(layout), stack(layout)
    if jaw is None or levels.seat is None:
        return None
    return levels.seat[0] - jaw.height, levels.top + jaw.opposing_pad_thickness + jaw.height


def half_width(layout: Layout, z: float) -> float:
    """Half the width (m) of what lies below the board at height z: the body's, or what the closed pair's port leaves.

    Seat and shield are made to measure, so they are narrowed where a body's width would stand out of the port's circle.
    """
    half, jaw, span = layout.body_size[1] / 2, fitted_jaw(layout), closed_span(layout)
    if jaw is None or span is None:
        return half
    radius, aside = jaw.port_diameter / 2, z - (span[0] + span[1]) / 2
    return min(half, math.sqrt(radius**2 - aside**2)) if abs(aside) < radius else half


def ground(layout: Layout) -> Path:
    """What plates can lie on: the board's body with its rounded corners, without taper and tail; counter-clockwise."""
    found = within_box(layout.outline, layout.body)
    assert found is not None
    return found


def shield_size(layout: Layout) -> tuple[float, float] | None:
    """Sides (m) along and across the jaw of the sheet between coil and jaw; None without one. The spec gives it none:
    it is made as large as the board's body, and narrower where the port asks for it.
    """
    levels = stack(layout).shield
    return None if levels is None else (layout.body_size[0], 2.0 * half_width(layout, levels[0]))


def _shield(layout: Layout) -> tuple[float, float] | None:
    sheet, mount = layout.spec.shield, layout.spec.mount
    if sheet is None:
        return None
    if mount and mount.jaw and sheet.gap + sheet.thickness > mount.standoff + 1e-9:
        gap, thickness = sheet.gap * 1e3, sheet.thickness * 1e3
        raise PartsError(
            f"the shield ({gap:g} mm gap, {thickness:g} mm thick) does not fit into the {mount.standoff * 1e3:g} mm "
            f"standoff: give mount.standoff at least {gap + thickness:g} mm"
        )
    upper = -layout.spec.fpc.stackup.thickness - sheet.gap
    return upper - sheet.thickness, upper
