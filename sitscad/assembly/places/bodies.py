"""Parts of the sensor in their positions: role, outline from above (plan), and heights.

Heights follow from the spec alone and are computed only here. z = 0 is the board's top face. Heights do not include
glue. Each glue line (layer of glue) between the board and a metal part moves this part farther from the coils
(`target_gap`, `Backing`).
"""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum

from sitscad.basics.record import memo, record
from sitscad.basics.units import in_mm
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Path, Region
from sitscad.layout.laser_sheet import joined_part
from sitscad.spec.circuit import Stackup
from sitscad.spec.materials import Conductor, Encapsulation, Shield
from sitscad.spec.mount import Assembly, Mount
from sitscad.spec.places import cell_specs, footprint, webs
from sitscad.spec.sensor import SensorSpec

Heights = tuple[float, float]


class PartsError(ValueError):
    """An error for a part in the spec that cannot exist. The text gives the reason and the change that helps."""


class BodyRole(StrEnum):
    """Role of a part in the sensor."""

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
    """A part in its position: outline from above, heights (m) of its lower and upper face, and material.

    `metal` is set if the material conducts or is magnetic. `cell` is the number of the part's cell from 1, and 0 if the
    spec has no cells. `web` is the number of a strip that joins the pads of two cells, else 0. For a jaw, `plan` is its
    face, and the heights extend from the face to the farthest point of its back.
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
        """Name in documents and file names."""
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

        With a `margin` (m), it is the disc or rectangle of the part's footprint, enlarged by the margin on each side,
        with round corners. This also holds for parts of another shape.
        """
        if isinstance(self.plan, Region) and not margin:
            return self.plan.outline
        return self.footprint.outline(margin)

    @property
    def region(self) -> Region:
        """Area that the part covers from above, with its holes."""
        return self.plan if isinstance(self.plan, Region) else Region(self.plan.outline())


@record
class Plates:
    """Parts on the board at their nominal sizes.

    `elastomers` are the soft pads on the board's top face, and `webs` the strips that join them. `targets` are the
    conducting plates on the pads or on the board. `joined` is the bounding box of all pads that are joined by webs.
    None if there are no webs.
    """

    elastomers: tuple[Body, ...]
    webs: tuple[Body, ...]
    targets: tuple[Body, ...]
    joined: Body | None

    @property
    def all(self) -> tuple[Body, ...]:
        """Elastomers, webs and targets, in this order."""
        return (*self.elastomers, *self.webs, *self.targets)

    @property
    def elastomer(self) -> Body | None:
        """First pad, without a cell number. None if there are no pads."""
        return replace(self.elastomers[0], cell=0) if self.elastomers else None

    @property
    def target(self) -> Body | None:
        """First target, without a cell number. None if there is no target."""
        return replace(self.targets[0], cell=0) if self.targets else None

    @property
    def upper(self) -> float:
        """Height (m) of the uppermost face, without encapsulation. 0 if no part is on the board."""
        return self.all[-1].upper if self.all else 0.0

    @property
    def lines_below_target(self) -> int:
        """Number of glue lines between board and target: under the pad and under the target.

        0 if there is no target.
        """
        return bool(self.targets) * (1 + bool(self.elastomers))

    def of(self, part: str) -> tuple[Body, ...]:
        """Return all pads if `part` is ``elastomer``, otherwise all targets."""
        return self.elastomers if part == "elastomer" else self.targets

    def glued(self, part: str) -> tuple[Body, ...]:
        """Return the pads or targets that are glued as separate parts.

        Pads joined by webs are one part, their common box.
        """
        return self.of(part) if self.joined is None or part != "elastomer" else (self.joined,)


def plates_of(spec: SensorSpec) -> Plates:
    """Return the parts on the board. The result is cached in the spec."""

    def place_plates() -> Plates:
        pads, targets = [], []
        for cell in cell_specs(spec):
            under = 0.0
            if (pad := cell.elastomer) is not None:
                under = pad.thickness
                pads.append(Body(BodyRole.ELASTOMER, footprint(cell, pad), 0.0, under, pad.material.name))
            if (plate := cell.target) is not None:
                metal, upper = plate.material, under + plate.thickness
                targets.append(Body(BodyRole.TARGET, footprint(cell, plate), under, upper, metal.name, metal))
        piece = joined_part(spec)
        strips = tuple(replace(pads[0], plan=plan, web=k) for k, plan in enumerate(webs(spec), 1))
        joined = None if piece is None else replace(pads[0], plan=piece.place)
        return Plates(_with_cell_numbers(pads), strips, _with_cell_numbers(targets), joined)

    return memo(spec, "_plates", place_plates)


def _with_cell_numbers(bodies: list[Body]) -> tuple[Body, ...]:
    """Return the parts with cell numbers from 1. A single part keeps cell 0."""
    return tuple(bodies) if len(bodies) < 2 else tuple(replace(body, cell=k) for k, body in enumerate(bodies, 1))


def board_heights(stackup: Stackup) -> Heights:
    """Return the heights (m) of the board's lower and upper face, without stiffener."""
    return -stackup.thickness, 0.0


@record
class Backing:
    """Heights of the parts behind the board: mount, shield and metal. All are in metres.

    They follow from the stack-up, the mount, the shield and the glue lines.
    """

    stackup: Stackup
    mount: Mount | None
    shield: Shield | None
    assembly: Assembly

    @property
    def bottom(self) -> float:
        """Height of the board's bottom face."""
        return -self.stackup.thickness

    @property
    def shield_heights(self) -> Heights | None:
        """Heights of the shield's faces without glue. None if there is no shield.

        The heights are not compared with the metal of the jaw.
        """
        if self.shield is None:
            return None
        upper = self.bottom - self.shield.gap
        return upper - self.shield.thickness, upper

    def shield_that_fits(self) -> Heights | None:
        """Return `shield_heights`. Raises `PartsError` if the shield does not fit above the metal of the jaw."""
        sheet, mount = self.shield, self.mount
        if sheet is not None and mount and mount.jaw and sheet.gap + sheet.thickness > mount.standoff + 1e-9:
            gap, thickness = sheet.gap * 1e3, sheet.thickness * 1e3
            raise PartsError(
                f"the shield ({gap:g} mm gap, {thickness:g} mm thick) does not fit into the {mount.standoff * 1e3:g} "
                f"mm standoff: give mount.standoff at least {gap + thickness:g} mm"
            )
        return self.shield_heights

    @property
    def seat_heights(self) -> Heights | None:
        """Heights of the standoff: from the face below the mount to the board's bottom face.

        None if there is no mount.
        """
        return None if self.mount is None else (self.bottom - self.mount.standoff, self.bottom)

    @property
    def spans(self) -> list[Heights]:
        """Height ranges (m) of the mount's printed parts, from the bottom up. Empty if there is no mount.

        With a shield, one part is below the shield, and one is between shield and board. Without a shield, there is one
        part. `MOUNT_PIECES` has their names in this order.
        """
        seat, shield = self.seat_heights, self.shield_heights
        if seat is None:
            return []
        spans = [seat] if shield is None else [(seat[0], shield[0]), (shield[1], seat[1])]
        return [(lower, upper) for lower, upper in spans if upper - lower > 1e-9]

    @property
    def glue_lines_above_shield(self) -> int:
        """Number of glue lines between board and shield. 0 if there is no mount."""
        sheet = self.shield_heights
        if sheet is None or self.mount is None:
            return 0
        return 1 + (self.bottom - sheet[1] > 1e-9)

    @property
    def glue_lines_below_board(self) -> int:
        """Number of glue lines between the board and the face below the mount. 0 if there is no mount."""
        if self.mount is None:
            return 0
        return len(self.spans) + (self.shield is not None) + (self.mount.jaw is not None)

    @property
    def shield_span(self) -> Heights | None:
        """Heights (m) of the shield's faces in the glued sensor. None if there is no shield.

        They are lowered by the glue lines between board and shield, and by the shield's tolerance offset.
        """
        sheet = self.shield_heights
        if sheet is None:
            return None
        down = self.assembly.glue_line * self.glue_lines_above_shield + self.assembly.offsets.shield
        return sheet[0] - down, sheet[1] - down

    @property
    def shield_gap_text(self) -> str:
        """Distance between board and shield as text, nominal and with glue lines. Empty if there is no shield."""
        if self.shield is None:
            return ""
        glue = self.assembly.glue_line * self.glue_lines_above_shield
        glued = f" ({in_mm(self.shield.gap + glue)} mm with the glue lines)" if glue else ""
        return f"{in_mm(self.shield.gap)} mm{glued}"

    @property
    def carrier_face(self) -> float | None:
        """Height (m) of the face below the mount in the glued sensor. None if there is no mount.

        It is lowered by the glue lines between board and mount, and by the metal's tolerance offset.
        """
        seat = self.seat_heights
        if seat is None:
            return None
        return seat[0] - self.assembly.glue_line * self.glue_lines_below_board - self.assembly.offsets.metal

    @property
    def metal_face(self) -> float | None:
        """Height (m) of the metal behind the board in the glued sensor. None if there is no mount.

        If the spec has no `mount.metal_behind`, it is the height of the face below the mount.
        """
        face, mount = self.carrier_face, self.mount
        if face is None or mount is None or mount.metal_behind is None:
            return face
        return face + mount.standoff - mount.metal_behind.distance

    @property
    def room(self) -> float:
        """Distance (m) from the board's bottom face to the shield, or else to `metal_face`.

        Infinite if there is neither.
        """
        sheet, metal = self.shield_span, self.metal_face
        if sheet is not None:
            return self.bottom - sheet[1]
        return float("inf") if metal is None else self.bottom - metal


def backing_of(spec: SensorSpec) -> Backing:
    """Return the parts behind the board: mount, shield and metal."""
    return Backing(spec.fpc.stackup, spec.mount, spec.shield, spec.assembly)


MOUNT_PIECES = ("mount", "mount-spacer")
"""Names of the mount's printed parts from the bottom up, for drawings, the bill of materials and files."""


def top_height(spec: SensorSpec) -> float:
    """Return the height (m) of the sensor's uppermost face, including the encapsulation film."""
    return plates_of(spec).upper + film_thickness(spec.encapsulation)


def film_thickness(encapsulation: Encapsulation | None) -> float:
    """Return the thickness (m) of the encapsulation, above and beside the parts. 0 if there is none."""
    return encapsulation.thickness if encapsulation is not None else 0.0


def target_lines(spec: SensorSpec) -> float:
    """Return the total thickness (m) of glue between the board's top face and the target's lower face.

    It includes the target's tolerance offset. 0 if there is no target.
    """
    return spec.assembly.glue_line * plates_of(spec).lines_below_target + spec.assembly.offsets.target


def target_gap(spec: SensorSpec) -> float | None:
    """Return the distance (m) from the board's top face to the target's lower face at rest, including glue.

    None if there is no target.
    """
    plate = plates_of(spec).target
    return None if plate is None else plate.lower + target_lines(spec)
