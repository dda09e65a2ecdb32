"""Glue between two faces: its area, its flow before it sets, and the weight on a soft pad while it sets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sitscad.assembly.places.bodies import plates_of
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import NoResponse, soft_pad
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point, enclosed_area
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.materials import Adhesive
from sitscad.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from sitscad.kernels.mechanics.pad import BondedPad

STANDARD_GRAVITY = 9.80665  # m/s2 (CGPM 1901)

PIECE_STRAIN = 0.02
"""Compressive strain of a soft pad under the weight while a piece is glued to it. The pad recovers afterwards."""

LEAST_MASS = 5e-3
"""Least mass (kg) of a press with its weight. A printed press without a weight has about 2 g."""

HARD_PRESSURE = 5e3
"""Pressure (Pa) on a glued piece that has no soft pad below it. From memory: enough for thin liquids."""

MOST_PRESSURE = 50e3
"""Largest pressure (Pa) of a weight on a board: 5 kg on 10 cm2. An assumption."""

SPREADING = 1e4
"""Time to spread glue by hand, divided by the area (s/m2): 1 s for each cm2. From memory, not verified."""

PIECE_HANDLING, HARD_HANDLING = 2.0, 10.0
"""Time (s) from the contact of the glued faces until the weight is on them: for pieces, and for hard parts.

A piece (elastomer or target) is placed in the well of a tool, with the press ready in the other hand. Hard parts are
shield, mount and board. They are first pushed against films, gauges or a block. Assumptions, not verified.
"""

FLAT_SHARE = 0.8
"""Largest fraction of a glue's working time that may pass until the board's glue lies flat.

The weight on the board is chosen for this time. An assumption.
"""


@record
class Press:
    """Dead weight on a piece while its glue sets: its mass (kg, press included), and the pad's compression (m)."""

    mass: float
    travel: float

    @property
    def force(self) -> float:
        """Weight (N)."""
        return self.mass * STANDARD_GRAVITY


def piece_press(spec: SensorSpec, part: str) -> Press:
    """Return the weight on a piece of elastomer or on a target (`part`) while its glue sets."""
    pad = unsealed_pad(spec if part == "target" else replace(spec, target=None))
    press = _press(pad, plates_of(spec).of(part)[0].footprint.area, PIECE_STRAIN)
    return Press(_rounded(press.mass * _plates_in_one(spec, part)), press.travel)


def _plates_in_one(spec: SensorSpec, part: str) -> int:
    """Return the number of pads that one piece of elastomer contains; 1 for targets."""
    return len(plates_of(spec).of(part)) // len(plates_of(spec).glued(part))


def unsealed_pad(spec: SensorSpec) -> BondedPad | None:
    """Return the pad under a target, without the film, which is applied later.

    For a piece of elastomer the spec has no target, and the result is the whole pad. None if no pad carries the target.
    """
    try:
        return soft_pad(replace(spec, encapsulation=None))
    except NoResponse:
        return None


def _press(pad: BondedPad | None, area: float, strain: float) -> Press:
    """Return the weight that compresses a pad by `strain`. Without a pad, it follows from a pressure on `area` (m2)."""
    if pad is None:
        return Press(max(LEAST_MASS, _rounded(HARD_PRESSURE * area / STANDARD_GRAVITY)), 0.0)
    force = float(pad.pressure(np.array([strain]))[0])
    mass = max(LEAST_MASS, _rounded(force / STANDARD_GRAVITY))
    return Press(mass, pad.thickness * float(pad.strain(np.array([mass * STANDARD_GRAVITY]))[0]))


def pad_compression(pad: BondedPad | None, force: float) -> float | None:
    """Return the compression (m) of a pad (`unsealed_pad`) by a force (N). None if there is no pad."""
    return None if pad is None else pad.thickness * float(pad.strain(np.array([force]))[0])


def pad_force(pad: BondedPad | None, travel: float) -> float | None:
    """Return the force (N) that compresses a pad from `unsealed_pad` by `travel` (m). None if there is no pad."""
    return None if pad is None else float(pad.pressure(np.array([travel / pad.thickness]))[0])


def _rounded(mass: float) -> float:
    return float(f"{mass:.1e}")


def glued_footprint(spec: SensorSpec, part: str) -> Footprint:
    """Return the outline, seen from above, of the plate `part` under which glue must lie flat.

    The plate is the elastomer, the target, or the box around all pads in one piece.
    """
    return plates_of(spec).glued(part)[0].footprint


def has_too_fast_glue(spec: SensorSpec, part: str) -> bool:
    """Return whether glue may set before a piece lies flat. `part` names the piece.

    The assumed weight on the piece is lower than the real weight. If the result is False, glue is certain not to set
    too early.
    """
    glue, plan, pad = spec.assembly.adhesive, glued_footprint(spec, part), spec.elastomer
    if glue is None or glue.open_time is None:
        return False
    modulus = 3.0 * pad.material.shear_modulus if pad is not None else HARD_PRESSURE / PIECE_STRAIN
    force = max(LEAST_MASS * STANDARD_GRAVITY, 0.5 * PIECE_STRAIN * modulus * plan.area)
    return spreading_time(glue, plan, force, spec.assembly.glue_line, PIECE_HANDLING) > glue.open_time


def glued_area(spec: SensorSpec, part: str) -> float:
    """Return the area (m2) of the glue under a piece of elastomer, or between a target and its pad.

    `part` is "elastomer" or "target".
    """
    plan, pad = plates_of(spec).of(part)[0].footprint, plates_of(spec).elastomer
    if part == "elastomer" or pad is None:
        return plan.area * _plates_in_one(spec, part)
    shared = plan.intersection(pad.footprint)
    return min(plan.area, pad.footprint.area) if shared is None else enclosed_area(shared)


def board_plan(layout: Layout) -> tuple[Footprint, float]:
    """Return the smallest box around the board's body (a disc if the body is round), and the area of the body (m2)."""
    x0, y0, x1, y1 = layout.body
    body = layout.spec.fpc.body
    centre = Point((x0 + x1) / 2, (y0 + y1) / 2)
    plan = Footprint(body is not None and body.shape == "circle", (x1 - x0, y1 - y0), centre)
    return plan, enclosed_area(layout.body_outline)


def spreading_time(adhesive: Adhesive, plan: Footprint, force: float, line: float, handling: float) -> float:
    """Return the time (s) to spread glue, place a plate and press it by a force (N) to a glue line (m).

    It is 0 for a tape. `handling` (s) is the time from the contact of the faces until the weight is on them.

    Notes
    -----
    Lubrication theory of a Newtonian liquid between parallel plates, from a thick film: 3 mu J / (2 F h^2). The
    integral of its pressure is a quarter of the plate's torsion constant J, which solves the same equation of Poisson.

    References
    ----------
    Stefan, Sitzungsber. Akad. Wiss. Wien 69, 713 (1874), for the disc; Young and Budynas, Roark's Formulas for Stress
    and Strain, 7th edition, table 10.1, for the torsion constant of a rectangle.
    """
    if adhesive.viscosity is None or line <= 0.0:
        return 0.0
    return SPREADING * plan.area + handling + _impulse(adhesive, plan, line) / force


def _impulse(adhesive: Adhesive, plan: Footprint, line: float) -> float:
    """Return the impulse (force times time; N s) that presses glue under a plate to a glue line (m)."""
    assert adhesive.viscosity is not None
    long, short = max(plan.size), min(plan.size)
    torsion = math.pi * (long / 2) ** 4 / 2
    if not plan.is_round:
        torsion = long * short**3 / 3.0 * (1.0 - 0.63 * short / long * (1.0 - (short / long) ** 4 / 12.0))
    return 3.0 * adhesive.viscosity * torsion / (2.0 * line**2)


def open_adhesives(plan: Footprint, force: float, on_silicone: bool) -> tuple[Adhesive, ...]:
    """Return the adhesives that spread to their own glue lines under a plate before they set. Tapes are left out.

    The plate has the outline `plan` and is pressed by a `force` (N). If `on_silicone`, only adhesives that bond to
    silicone are returned.
    """
    adhesives = (presets.adhesive(name) for name in presets.names("adhesive"))
    return tuple(
        each for each in adhesives if each.viscosity is not None and (each.bonds_silicone or not on_silicone)
        and spreading_time(each, plan, force, each.line, PIECE_HANDLING) <= (each.open_time or math.inf)
    )


def board_force(layout: Layout, glue: Adhesive | None) -> float:
    """Return the force (N) on the board under which its glue lies flat at the spec's glue line before the glue sets.

    Infinite if no force is large enough.
    """
    (plan, area), line = board_plan(layout), layout.spec.assembly.glue_line
    least = HARD_PRESSURE * area
    if glue is None or glue.viscosity is None or glue.open_time is None or line <= 0.0:
        return least
    remaining = FLAT_SHARE * glue.open_time - SPREADING * plan.area - HARD_HANDLING
    return max(least, _impulse(glue, plan, line) / remaining) if remaining > 0.0 else math.inf


def board_press(layout: Layout) -> float:
    """Return the mass (kg) of the weight on the board, with its press, while the board is glued to its mount."""
    force = board_force(layout, hard_adhesive(layout))
    area = board_plan(layout)[1]
    return max(LEAST_MASS, _rounded(min(force, MOST_PRESSURE * area) / STANDARD_GRAVITY))


def hard_adhesive(layout: Layout) -> Adhesive | None:
    """Return the adhesive of all hard faces, from the sensor's carrier up to the board.

    It is the spec's adhesive if the board can be placed and pressed before it sets. Otherwise it is the first suitable
    adhesive of the table. If no adhesive is suitable, it is the adhesive that needs the least force.
    """
    glue, most = layout.spec.assembly.adhesive, MOST_PRESSURE * board_plan(layout)[1]
    if glue is None or board_force(layout, glue) <= most:
        return glue
    adhesives = (presets.adhesive(name) for name in presets.names("adhesive"))
    hard = [each for each in adhesives if each.viscosity is not None and not each.bonds_silicone]
    return next((each for each in hard if board_force(layout, each) <= most),
                min((glue, *hard), key=lambda each: board_force(layout, each)))
