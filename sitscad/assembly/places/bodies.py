"""The pieces of the sensor in their places: role, plan from above, and heights.

Heights follow from the spec alone and are computed only here. z = 0 is the board's top face. Heights are those of the
pieces without glue. Each glue line between the board and a piece of metal moves this piece farther from the coils
(`target_gap`, `shield_span`, `carrier_face`, `metal_face`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum

from sitscad.basics.record import memo, record
from sitscad.basics.units import in_mm
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Path, Region
from sitscad.layout.laser_sheet import joined_part
from sitscad.spec.circuit import Stackup
from sitscad.spec.materials import Conductor, Encapsulation, Shield
from sitscad.spec.mount import Mount
from sitscad.spec.places import cell_specs, footprint, webs
from sitscad.spec.sensor import SensorSpec

Heights = tuple[float, float]


class BodyRole(StrEnum):
    """Role of a piece in the sensor."""

    JAW = "jaw"
    MOUNT = "mount"
    SHIELD = "shield"
    STIFFENER = "stiffener"
    BOARD = "board"
    ELASTOMER = "elastomer"
    TARGET = "target"
    ENCAPSULATION = "encapsulation"
    OPPOSING_JAW = "opposing-jaw"
    OPPOSING_PAD = "opposing-pad"
    COPPER = "copper"
    GLUE = "glue"
    FINGER = "finger"
    METAL_BEHIND = "metal-behind"
    JIG = "jig"
    MOULD = "mould"


@record
class Body:
    """A piece in its place: its plan from above, the heights (m) of its lower and upper face, and its material.

    `metal` is set if the material conducts or is magnetic. `cell` is the number of the piece's cell, from 1, or 0
    without cells. `web` is the number of a strip that joins the pads of two cells. The plan of a jaw is its face. Its
    heights are those of the face and of the lowest point of its back.
    """

    role: BodyRole
    plan: Footprint | Region
    lower: float
    upper: float
    material: str
    metal: Conductor | None = None
    cell: int = 0
    web: int = 0

    @property
    def name(self) -> str:
        """Name in documents and files."""
        if self.web:
            return f"{self.role.value}-web-{self.web}"
        return f"{self.role.value}-{self.cell}" if self.cell else self.role.value

    @property
    def heights(self) -> Heights:
        """Heights (m) of the lower and the upper face."""
        return self.lower, self.upper

    @property
    def thickness(self) -> float:
        """Distance (m) between the faces."""
        return self.upper - self.lower

    @property
    def footprint(self) -> Footprint:
        """Plan of a disc or a rectangle. Raises TypeError for any other shape."""
        if not isinstance(self.plan, Footprint):
            raise TypeError(f"the {self.name} is neither a disc nor a rectangle")
        return self.plan

    def outline(self, margin: float = 0.0) -> Path:
        """Return the closed outline from above.

        The outline of a disc or a rectangle is grown by `margin` (m) with round corners.
        """
        if isinstance(self.plan, Region) and not margin:
            return self.plan.outline
        return self.footprint.outline(margin)

    @property
    def region(self) -> Region:
        """Covered area from above, with its holes."""
        return self.plan if isinstance(self.plan, Region) else Region(self.plan.outline())


def elastomer(spec: SensorSpec) -> Body | None:
    """Return the soft pad on the board's top face, at its nominal size. The first of all `elastomers`."""
    pad = spec.elastomer
    if pad is None:
        return None
    return memo(spec, "_elastomer", lambda: Body(
        BodyRole.ELASTOMER, footprint(spec, pad), 0.0, pad.thickness, pad.material.name))


def target(spec: SensorSpec) -> Body | None:
    """Return the conducting plate on the elastomer at rest, or on the board's top face. The first of all `targets`."""
    plate = spec.target
    if plate is None:
        return None
    under = spec.elastomer.thickness if spec.elastomer is not None else 0.0
    upper, metal = under + plate.thickness, plate.material
    return memo(spec, "_target", lambda: Body(BodyRole.TARGET, footprint(spec, plate), under, upper, metal.name, metal))


def above_board(spec: SensorSpec) -> tuple[Body, ...]:
    """Return all elastomers, the webs between them, and all targets, in this order."""
    return (*elastomers(spec), *joints(spec), *targets(spec))


def joints(spec: SensorSpec) -> tuple[Body, ...]:
    """Return the webs that join all pads to one piece."""
    pad = elastomer(spec)
    return () if pad is None else tuple(replace(pad, plan=one, web=k) for k, one in enumerate(webs(spec), 1))


def joined(spec: SensorSpec) -> Body | None:
    """Return the box round the pads that webs join. None if there are no webs."""
    pad, piece = elastomer(spec), joined_part(spec)
    return None if pad is None or piece is None else replace(pad, plan=piece.place)


def elastomers(spec: SensorSpec) -> tuple[Body, ...]:
    """Return all soft pads. Empty if there is no elastomer."""
    return _each(spec, elastomer)


def targets(spec: SensorSpec) -> tuple[Body, ...]:
    """Return all conducting plates. Empty if there is no target."""
    return _each(spec, target)


def _each(spec: SensorSpec, one: Callable[[SensorSpec], Body | None]) -> tuple[Body, ...]:
    found = [body for cell in cell_specs(spec) if (body := one(cell)) is not None]
    return tuple(found) if len(found) < 2 else tuple(replace(body, cell=k) for k, body in enumerate(found, 1))


def plates(spec: SensorSpec, part: str) -> tuple[Body, ...]:
    """Return all pads if `part` is ``elastomer``, otherwise all targets."""
    return elastomers(spec) if part == "elastomer" else targets(spec)


def glued_pieces(spec: SensorSpec, part: str) -> tuple[Body, ...]:
    """Return the pads or targets that are glued separately. Pads joined by webs are one piece, their common box."""
    whole = joined(spec) if part == "elastomer" else None
    return plates(spec, part) if whole is None else (whole,)


def board_heights(stackup: Stackup) -> Heights:
    """Return the heights of the board without stiffener."""
    return -stackup.thickness, 0.0


def shield_heights(stackup: Stackup, shield: Shield | None) -> Heights | None:
    """Return the heights of the shield behind the board.

    None if there is no shield. Its fit above the jaw's metal is not checked.
    """
    if shield is None:
        return None
    upper = board_heights(stackup)[0] - shield.gap
    return upper - shield.thickness, upper


def seat_heights(stackup: Stackup, mount: Mount | None) -> Heights | None:
    """Return the heights of the standoff: from the face under the mount to the board's bottom face.

    None if there is no mount.
    """
    lower = board_heights(stackup)[0]
    return None if mount is None else (lower - mount.standoff, lower)


def seat_spans(spec: SensorSpec) -> list[Heights]:
    """Return the heights (m) that the seat on a jaw fills: from metal to shield, and from shield to the board's bottom.

    Empty if there is no mount. Its pieces are printed. Their names are those of `MOUNT_PIECES` in this order.
    """
    seat, shield = seat_heights(spec.fpc.stackup, spec.mount), shield_heights(spec.fpc.stackup, spec.shield)
    if seat is None:
        return []
    spans = [seat] if shield is None else [(seat[0], shield[0]), (shield[1], seat[1])]
    return [(lower, upper) for lower, upper in spans if upper - lower > 1e-9]


MOUNT_PIECES = ("mount", "mount-spacer")
"""Printed pieces from the bottom up. Drawing, bill of materials and files use these names."""


def top_height(spec: SensorSpec) -> float:
    """Return the height of the sensor's uppermost face, with its film."""
    above = above_board(spec)
    return (above[-1].upper if above else 0.0) + film_thickness(spec.encapsulation)


def film_thickness(encapsulation: Encapsulation | None) -> float:
    """Return the thickness (m) of the encapsulation, which also surrounds the pieces. 0 without encapsulation."""
    return encapsulation.thickness if encapsulation is not None else 0.0


def target_lines(spec: SensorSpec) -> float:
    """Return the thickness (m) of the glue between the board's top face and the target's near face.

    0 without a target.
    """
    return spec.assembly.glue_line * lines_below_target(spec) + spec.assembly.offsets.target


def lines_below_target(spec: SensorSpec) -> int:
    """Return the number of glue lines below the target: under the elastomer and under the target."""
    return 0 if spec.target is None else 1 + (spec.elastomer is not None)


def target_gap(spec: SensorSpec) -> float | None:
    """Return the gap (m) from the board's top face to the target's near face at rest, with glue.

    None if there is no target.
    """
    plate = target(spec)
    return None if plate is None else plate.lower + target_lines(spec)


def shield_span(spec: SensorSpec) -> Heights | None:
    """Return heights (m) of the shield's faces, with the glue between shield and board. None if there is no shield."""
    sheet = shield_heights(spec.fpc.stackup, spec.shield)
    if sheet is None:
        return None
    down = spec.assembly.glue_line * lines_over_shield(spec.fpc.stackup, spec.mount,
                                                       spec.shield) + spec.assembly.offsets.shield
    return sheet[0] - down, sheet[1] - down


def lines_over_shield(stackup: Stackup, mount: Mount | None, shield: Shield | None) -> int:
    """Return the number of glue lines between board and shield. 0 without a mount."""
    sheet = shield_heights(stackup, shield)
    if sheet is None or mount is None:
        return 0
    return 1 + (board_heights(stackup)[0] - sheet[1] > 1e-9)


def shield_gap_text(spec: SensorSpec) -> str:
    """Return the distance from board to shield as text, as drawn and with glue lines. Empty if there is no shield."""
    if spec.shield is None:
        return ""
    glue = spec.assembly.glue_line * lines_over_shield(spec.fpc.stackup, spec.mount, spec.shield)
    glued = f" ({in_mm(spec.shield.gap + glue)} mm with the glue lines)" if glue else ""
    return f"{in_mm(spec.shield.gap)} mm{glued}"


def lines_over_carrier(spec: SensorSpec) -> int:
    """Return the number of glue lines between the board and the face below the mount. 0 without a mount."""
    if spec.mount is None:
        return 0
    return len(seat_spans(spec)) + (spec.shield is not None) + (spec.mount.jaw is not None)


def carrier_face(spec: SensorSpec) -> float | None:
    """Return the height (m) of the face below the mount, with glue lines (those in a jaw included).

    None if there is no mount.
    """
    seat = seat_heights(spec.fpc.stackup, spec.mount)
    if seat is None:
        return None
    return seat[0] - spec.assembly.glue_line * lines_over_carrier(spec) - spec.assembly.offsets.metal


def metal_face(spec: SensorSpec) -> float | None:
    """Return the height (m) of the metal's face behind the board, with glue lines. None if there is no mount.

    For a mount without metal, it is the height of the face below the mount.
    """
    face, mount = carrier_face(spec), spec.mount
    if face is None or mount is None or mount.metal_behind is None:
        return face
    return face + mount.standoff - mount.metal_behind.distance


def room_behind(spec: SensorSpec) -> float:
    """Return the distance (m) from the board's bottom face to the shield, or to `metal_face`.

    Infinite without either.
    """
    sheet, metal = shield_span(spec), metal_face(spec)
    bottom = board_heights(spec.fpc.stackup)[0]
    if sheet is not None:
        return bottom - sheet[1]
    return float("inf") if metal is None else bottom - metal
