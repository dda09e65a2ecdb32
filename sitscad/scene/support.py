"""How much of the board lies on something: on the mount, on a shield, or on the metal itself. No CAD kernel.

A seat is cut back to the port and to the pad pocket, and what is left of it may carry neither board nor elastomer.
`sitscad.parts.clash` measures the same on the solids.
"""

from __future__ import annotations

from sitscad.geometry.convex import within_box
from sitscad.geometry.path import Path, enclosed_area
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.bodies import above_board, board_heights, seat_spans
from sitscad.scene.jaws import (
    axis,
    closed_span,
    fitted_jaw,
    half_width,
    jaw_range,
    made_to_measure,
    section,
    shield_that_fits,
)
from sitscad.scene.stack import ground
from sitscad.spec.mount import Jaw, Mount

Box = tuple[float, float, float, float]

BODY = "board's body"
"""What is pressed on where nothing lies on the board."""

MOST_OF_IT, HALF_OF_IT = 0.9, 0.5
"""Shares of what is pressed on that have to be carried. What is missing to the first is a strip at the edges that
hardly bends; below the second the board cannot even be glued flat.
"""


@record
class Support:
    """What is pressed on (its name; elastomer, target or the board's body), its area above the board's body, and how
    much of that has something under the board; the same of the whole body (all m2).
    """

    name: str
    pressed: float
    carried: float
    body: float
    body_carried: float

    @property
    def share(self) -> float:
        """How much of what is pressed on is carried, 0 to 1."""
        return self.carried / self.pressed if self.pressed else 1.0


def pressed_on(layout: Layout) -> tuple[str, Path]:
    """The lowest piece on the board, whose force goes through the board into what lies below, and what of it lies above
    the body: a closed path. The body itself where nothing lies on it.
    """
    for body in above_board(layout.spec):
        above = within_box(body.outline(), layout.body)
        if above is not None:
            return body.name, above
    return BODY, ground(layout)


def support(layout: Layout) -> Support | None:
    """How much of the board is carried; None where figures cannot say it: a mount or a jaw that is a STEP file.

    Grooves and other hollows that glue fills count as support. Raises `PartsError` where the shield does not fit.
    """
    mount = layout.spec.mount
    if mount is None or mount.kind == "custom":
        return None
    found = _carriers(layout, mount)
    if found is None:
        return None
    (name, path), body = pressed_on(layout), ground(layout)
    return Support(name, enclosed_area(path), _on(path, *found), enclosed_area(body), _on(body, *found))


def width_under(layout: Layout) -> float | None:
    """How wide (m) what the board lies on is at the board's lower face; None as `support`, or where it is nothing."""
    mount = layout.spec.mount
    found = None if mount is None or mount.kind == "custom" else _carriers(layout, mount)
    return None if found is None or found[0] is None else found[0][3] - found[0][1]


def _on(path: Path, carrier: Box | None, window: Box | None) -> float:
    """The area (m2) of a convex closed path over a carrier's box, less that over a window in it."""

    def within(box: Box | None) -> float:
        found = within_box(path, box) if box is not None and box[2] > box[0] and box[3] > box[1] else None
        return 0.0 if found is None else enclosed_area(found)

    if carrier is None:
        return 0.0
    if window is None:
        return within(carrier)
    (x0, y0, x1, y1), (a0, b0, a1, b1) = carrier, window
    return within(carrier) - within((max(x0, a0), max(y0, b0), min(x1, a1), min(y1, b1)))


def _carriers(layout: Layout, mount: Mount) -> tuple[Box | None, Box | None] | None:
    """The box that the board's body can lie on and a window in it, from above; None where no figures say it."""
    (x0, low, x1, high), y, under = layout.body, axis(layout).y, board_heights(layout.spec)[0]
    sheet, jaw, closed = shield_that_fits(layout.spec), fitted_jaw(layout), closed_span(layout)
    spans = seat_spans(under, mount.standoff, sheet)
    if sheet is not None and under - sheet[1] <= 1e-9:
        half = half_width(layout, sheet[0])
        return (x0, y - half, x1, y + half), None
    if spans and jaw is not None and closed is not None:
        # the seat's upper face is cut back to the port where all of the seat is in it
        middle = (closed[0] + closed[1]) / 2
        is_outside = max(abs(height - middle) for height in spans[-1]) >= made_to_measure(layout, jaw)
        half = (high - low) / 2 if is_outside else half_width(layout, spans[-1][1])
        return (x0, y - half, x1, y + half), None
    if spans or mount.kind == "bench-plate":
        return layout.body, None
    if mount.finger is not None:  # on the finger itself: a round one touches the board along a line
        half = mount.finger.size[0] / 2 if not mount.finger.outline.is_round else 0.0
        return ((x0, y - half, x1, y + half) if half else None), None
    return None if jaw is None or jaw.step is not None else _on_metal(layout, jaw)


def _on_metal(layout: Layout, jaw: Jaw) -> tuple[Box, Box | None]:
    """The face of a jaw that the board lies on without a seat, and the window through it."""
    (x0, x1), middle = jaw_range(layout, jaw), axis(layout)
    half = section(jaw).face / 2
    if jaw.pocket is not None and jaw.recess:
        half = min(half, jaw.pocket[1] / 2)
    window = None
    if jaw.fenestration is not None:
        along, across = jaw.fenestration[0] / 2, jaw.fenestration[1] / 2
        window = (sum((x0, x1)) / 2 - along, middle.y - across, sum((x0, x1)) / 2 + along, middle.y + across)
    return (x0, middle.y - half, x1, middle.y + half), window
