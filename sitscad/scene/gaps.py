"""How far metal is from the board as it is glued together: what the coils see.

Heights in `sitscad.scene.bodies` are those of the pieces alone; every glue line between the board and a piece of metal
takes that farther away.
"""

from __future__ import annotations

from sitscad.scene.bodies import Heights, board_heights, seat_heights, seat_spans, shield_heights, target
from sitscad.spec.sensor import SensorSpec


def target_lines(spec: SensorSpec) -> float:
    """Thickness (m) of the glue between the board's top face and the target's near face; 0 without a target."""
    return spec.assembly.glue_line * lines_below_target(spec)


def lines_below_target(spec: SensorSpec) -> int:
    """How many glue lines there are in that: under the elastomer and under the target."""
    return 0 if spec.target is None else 1 + (spec.elastomer is not None)


def target_gap(spec: SensorSpec) -> float | None:
    """From the board's top face to the target's near face at rest (m), glue counted; None without a target."""
    plate = target(spec)
    return None if plate is None else plate.lower + target_lines(spec)


def shield_span(spec: SensorSpec) -> Heights | None:
    """The sheet's faces (m), glue between it and the board counted; None without one."""
    sheet = shield_heights(spec)
    if sheet is None:
        return None
    spaced = board_heights(spec)[0] - sheet[1] > 1e-9
    down = spec.assembly.glue_line * (spec.mount is not None) * (1 + spaced)
    return sheet[0] - down, sheet[1] - down


def metal_face(spec: SensorSpec) -> float | None:
    """The height (m) of the face below the mount, every glue line above it counted; None without a mount. A mount is
    glued into a jaw; a plate is screwed down and a cap clamped.
    """
    seat, sheet = seat_heights(spec), shield_heights(spec)
    if seat is None or spec.mount is None:
        return None
    pieces = len(seat_spans(board_heights(spec)[0], spec.mount.standoff, sheet)) + (sheet is not None)
    return seat[0] - spec.assembly.glue_line * (pieces + (spec.mount.jaw is not None))


def room_behind(spec: SensorSpec) -> float:
    """The room (m) from the board's bottom face to the shield, or to what carries the mount; endless without either."""
    sheet, metal = shield_span(spec), metal_face(spec)
    bottom = board_heights(spec)[0]
    if sheet is not None:
        return bottom - sheet[1]
    return float("inf") if metal is None else bottom - metal
