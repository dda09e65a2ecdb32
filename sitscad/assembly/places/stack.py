"""All parts of a sensor in their positions from the jaw upwards, and the supported area of the board.

The support of the board is the mount, a shield, or the metal itself. No CAD kernel is used. In a narrow port or pad
pocket, the seat is narrower than the board. Parts of board or pad may then lack support.
`sitscad.assembly.solids.clash` measures the same area on the solids.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.assembly.places.bodies import (
    Body,
    BodyRole,
    Heights,
    Plates,
    backing_of,
    board_heights,
    plates_of,
    top_height,
)
from sitscad.assembly.places.column import worst_deviations
from sitscad.assembly.places.jaws import (
    board_middle,
    closed_span,
    jaw_range,
    jaw_section,
    seat_circle_radius,
    seat_half_width,
)
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box, Footprint, clip_to_box
from sitscad.kernels.geometry.path import Arc, Path, Point, Region, bounding_box, enclosed_area, rectangle
from sitscad.layout.board import Layout, Stiffener
from sitscad.layout.laser_sheet import CutPart, LaserSheet, laser_sheets
from sitscad.spec.circuit import BodySpec, FpcSpec, Stackup
from sitscad.spec.mount import Jaw
from sitscad.spec.presets import is_rigid


def stack(layout: Layout) -> tuple[Body, ...]:
    """Return all parts of the spec except the mount's printed parts, in the order of their lower faces.

    Both jaws are closed without force. Raises `PartsError` if the dimensions of shield and standoff contradict each
    other.
    """
    jaw, seat = layout.spec.jaw, backing_of(layout.spec).seat_heights
    jaws = [] if jaw is None or seat is None else [*_jaws(layout.body, jaw, seat[0], top_height(layout.spec))]
    bodies = [*jaws,
             *(body for body in (shield(layout), board(layout.outline, layout.spec.fpc.stackup),
                                 stiffener(layout.stiffener, layout.spec.fpc)) if body)]
    bodies += plates_of(layout.spec).all
    if (film := layout.spec.encapsulation) is not None:  # over and around the body and the pieces on it
        region, top = Region(layout.body_outline), top_height(layout.spec)
        bodies.append(Body(BodyRole.ENCAPSULATION, region, 0.0, top, film.material.name))
    return tuple(sorted(bodies, key=lambda body: (body.lower, body.upper)))


def board(outline: Path, stackup: Stackup) -> Body:
    """Return the board as a part, with a straight tail and without stiffener."""
    material = "FR4" if is_rigid(stackup) else "polyimide"
    return Body(BodyRole.BOARD, Region(outline), *board_heights(stackup), material)


def stiffener(plate: Stiffener | None, fpc: FpcSpec) -> Body | None:
    """Return the stiffener under the contacts as a part, on the tail's bottom face. None if there is no stiffener."""
    if plate is None:
        return None
    upper = tail_heights(fpc)[0]
    return Body(BodyRole.STIFFENER, plate.outline, upper - plate.thickness, upper, plate.material)


def tail_heights(fpc: FpcSpec) -> Heights:
    """Return the heights (m) of the tail: from the bottom of its lowest layer up to the board's top face."""
    return -math.fsum(layer.thickness for layer in fpc.tail_layers), 0.0


def shield(layout: Layout) -> Body | None:
    """Return the shield between coil and jaw as a part. None if there is no shield.

    The spec does not state its size. It is as large as the board's body, a disc under a round body, and narrower in a
    narrow port. Raises `PartsError` if it does not fit into the standoff.
    """
    sheet, levels = layout.spec.shield, backing_of(layout.spec).shield_that_fits()
    if sheet is None or levels is None:
        return None
    (x0, _, x1, _), y, half = layout.body, board_middle(layout.body).y, seat_half_width(layout, levels[0])
    is_disc = has_round_body(layout.spec.fpc.body) and half >= (x1 - x0) / 2 - 1e-9
    plan = Region(layout.body_outline if is_disc else rectangle(x0, y - half, x1, y + half))
    return Body(BodyRole.SHIELD, plan, *levels, sheet.material.name, sheet.material)


def has_round_body(body: BodySpec | None) -> bool:
    """Whether the spec states a circle as the outline of the board's body."""
    return body is not None and body.shape == "circle"


def sheets(layout: Layout, stop: str = "") -> tuple[LaserSheet, ...]:
    """Return the laser cutting sheets of pad, target and shield. `stop` is a warning for each sheet.

    Raises `PartsError` if the shield does not fit.
    """
    return laser_sheets(layout, shield_part(layout), stop)


def shield_part(layout: Layout) -> tuple[CutPart, ...]:
    """Return the shield as a part to be cut. Empty if there is no shield. Raises `PartsError` if it does not fit."""
    sheet, body = layout.spec.shield, shield(layout)
    if sheet is None or body is None:
        return ()
    x0, y0, x1, y1 = bounding_box((body.outline(),))
    is_disc = any(isinstance(piece, Arc) for piece in body.outline())
    place = Footprint(is_disc, (x1 - x0, y1 - y0), Point((x0 + x1) / 2, (y0 + y1) / 2))
    note = f"goes under the board, {backing_of(layout.spec).shield_gap_text} below its lower face"
    shape = "circle" if is_disc else "rectangle"
    return (CutPart(body.name, body.material, shape, place.size, sheet.thickness, sheet.kerf, place, note),)


def _jaws(body: Box, jaw: Jaw, lower: float, top: float) -> Iterator[Body]:
    """Yield both jaws as parts, and the pad of the opposing jaw.

    The face of the jaw is at height `lower` (m). The opposing jaw touches the sensor at height `top` (m).
    """
    (x0, x1), y, half = jaw_range(body, jaw), board_middle(body).y, jaw_section(jaw).face / 2
    face = Region(rectangle(x0, y - half, x1, y + half))
    name, pad = jaw.material.name, top + jaw.opposing_pad_thickness
    yield Body(BodyRole.JAW, face, lower - jaw.height, lower, name, jaw.material)
    if jaw.opposing_pad_thickness > 0.0:
        yield Body(BodyRole.OPPOSING_PAD, face, top, pad, "pad")
    yield Body(BodyRole.OPPOSING_JAW, face, pad, pad + jaw.height, name, jaw.material)


BODY = "board's body"  # What is pressed on where nothing lies on the board

LEAST_PRESSED_SHARE = 0.9
"""Smallest sufficient supported area under the pressed part, divided by the part's area.

The unsupported rest is then a narrow strip at the edges, which hardly bends.
"""

LEAST_GLUABLE_SHARE = 0.5
"""Smallest supported fraction of the area with which the board can be glued flat."""


@record
class Support:
    """Supported areas of the part that is pressed (pad, target or the board's body).

    `name` is the part, `pressed` (m2) its area above the board's body, and `carried` (m2) the supported part of this
    area. `body` and `body_carried` (m2) are the area of the whole body and its supported part.
    """

    name: str
    pressed: float
    carried: float
    body: float
    body_carried: float

    @property
    def share(self) -> float:
        """Supported fraction of the pressed part's area, 0 to 1."""
        return self.carried / self.pressed if self.pressed else 1.0


def pressed_piece(plates: Plates, box: Box, body_outline: Path) -> tuple[str, Path]:
    """Return the name of the lowest part on the board, and its closed outline above the body with the box `box`.

    A force on this part goes through the board into the support. If no part is on the board: name and outline of the
    body.
    """
    for plate in plates.all:
        above = clip_to_box(plate.outline(), box)
        if above is not None:
            return plate.name, above
    return BODY, body_outline


def support(layout: Layout) -> Support | None:
    """Return the supported areas of the board.

    None for a mount or jaw from a STEP file, whose dimensions are not known. Grooves and other hollows filled with glue
    count as supported. Raises `PartsError` if the shield does not fit.
    """
    carriers = _support_and_window(layout)
    if carriers is None:
        return None
    body = layout.body_outline
    name, path = pressed_piece(plates_of(layout.spec), layout.body, body)
    return Support(name, enclosed_area(path), _supported_area(path, *carriers), enclosed_area(body),
                   _supported_area(body, *carriers))


def support_width(layout: Layout) -> float | None:
    """Return the width (m) of the support at the board's lower face.

    None if its dimensions are not known, or if there is no support.
    """
    carriers = _support_and_window(layout)
    return None if carriers is None or carriers[0] is None else carriers[0][3] - carriers[0][1]


def _supported_area(path: Path, carrier: Box | None, window: Box | None) -> float:
    """Return the area (m2) of a convex closed path above the rectangle `carrier`, but not above its `window`."""

    def within(box: Box | None) -> float:
        overlap = clip_to_box(path, box) if box is not None and box[2] > box[0] and box[3] > box[1] else None
        return 0.0 if overlap is None else enclosed_area(overlap)

    if carrier is None:
        return 0.0
    if window is None:
        return within(carrier)
    (x0, y0, x1, y1), (a0, b0, a1, b1) = carrier, window
    return within(carrier) - within((max(x0, a0), max(y0, b0), min(x1, a1), min(y1, b1)))


def _support_and_window(layout: Layout) -> tuple[Box | None, Box | None] | None:
    """Return the rectangle of the support from above, and the rectangle of a window in it.

    None if the dimensions of the support are not known.
    """
    mount = layout.spec.mount
    if mount is None or mount.kind == "custom":
        return None
    (x0, low, x1, high), y, backing = layout.body, board_middle(layout.body).y, backing_of(layout.spec)
    sheet, jaw, closed = backing.shield_that_fits(), mount.jaw, closed_span(backing, top_height(layout.spec))
    spans = backing.spans
    if sheet is not None and backing.bottom - sheet[1] <= 1e-9:
        half = seat_half_width(layout, sheet[0])
        return (x0, y - half, x1, y + half), None
    if spans and jaw is not None and closed is not None:
        # the seat's upper face is cut back to the port where all of the seat is in it
        middle = (closed[0] + closed[1]) / 2
        radius = seat_circle_radius(jaw, worst_deviations(layout))
        is_outside = max(abs(height - middle) for height in spans[-1]) >= radius
        half = (high - low) / 2 if is_outside else seat_half_width(layout, spans[-1][1])
        return (x0, y - half, x1, y + half), None
    if spans or mount.kind == "bench-plate":
        return layout.body, None
    if mount.finger is not None:  # on the finger itself: a round one touches the board along a line
        half = mount.finger.size[0] / 2 if not mount.finger.outline.is_disc else 0.0
        return ((x0, y - half, x1, y + half) if half else None), None
    return None if jaw is None or jaw.step is not None else _jaw_face_and_window(layout.body, jaw)


def _jaw_face_and_window(body: Box, jaw: Jaw) -> tuple[Box, Box | None]:
    """Return the rectangles of a jaw's face that supports the board without a seat, and of the window through it."""
    (x0, x1), middle = jaw_range(body, jaw), board_middle(body)
    half = jaw_section(jaw).face / 2
    if jaw.pocket is not None and jaw.recess:
        half = min(half, jaw.pocket[1] / 2)
    window = None
    if jaw.fenestration is not None:
        x, dx, dy = (x0 + x1) / 2, jaw.fenestration[0] / 2, jaw.fenestration[1] / 2
        window = (x - dx, middle.y - dy, x + dx, middle.y + dy)
    return (x0, middle.y - half, x1, middle.y + half), window
