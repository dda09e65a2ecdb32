"""Glue between two faces: how much there is, whether it lies flat before it sets, and what may weigh on a soft pad
meanwhile.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sitscad.assembly.places.bodies import elastomer, glued_pieces, plates
from sitscad.assembly.places.stack import ground
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import NoResponse, soft_pad
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point, enclosed_area
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.materials import Adhesive
from sitscad.spec.sensor import SensorSpec

STANDARD_GRAVITY = 9.80665  # m/s2 (CGPM 1901)

PIECE_STRAIN = 0.02
"""Compression of the pad, in parts of its thickness, while a piece is glued to it. It comes back when the weight goes.
"""

LEAST_MASS = 5e-3
"""Least mass (kg) of a press with what is on it: a printed press alone weighs about 2 g."""

HARD_PRESSURE = 5e3
"""Pressure (Pa) on a piece without a soft pad below it. From memory: thin liquids need no more."""

MOST_PRESSURE = 50e3
"""Largest pressure (Pa) of a weight on a board: 5 kg on 10 cm2. An assumption."""

SPREADING = 1e4
"""Time (s/m2) in which glue is spread by hand: 1 s for each cm2. From memory, not verified."""

PIECE_HANDLING, HARD_HANDLING = 2.0, 10.0
"""Time (s) from where the faces meet until the weight is on: of a piece in a well, its press ready in the other hand,
and of shield, mount and board, which are pushed against films, gauges or a block first. Assumptions, not verified.
"""

FLAT_SHARE = 0.8
"""Share of the time in which glue flows that it may take to lie flat under a weight chosen for it. An assumption."""


@record
class Press:
    """A dead weight on a piece: its mass (kg, the press with it), and how far it presses the pad (m)."""

    mass: float
    travel: float

    @property
    def force(self) -> float:
        """The weight (N)."""
        return self.mass * STANDARD_GRAVITY


def piece_press(spec: SensorSpec, part: str) -> Press:
    """Weight on a piece of elastomer, or on a target, while the glue sets."""
    alone = spec if part == "target" else replace(spec, target=None)
    one = _press(alone, plates(spec, part)[0].footprint.area, PIECE_STRAIN)
    return Press(_rounded(one.mass * _plates_in_one(spec, part)), one.travel)


def _plates_in_one(spec: SensorSpec, part: str) -> int:
    """The number of pads in a piece of elastomer; 1 for targets."""
    return len(plates(spec, part)) // len(glued_pieces(spec, part))


def _press(spec: SensorSpec, area: float, strain: float) -> Press:
    try:
        pad = soft_pad(replace(spec, encapsulation=None))  # the film comes later
    except NoResponse:
        return Press(max(LEAST_MASS, _rounded(HARD_PRESSURE * area / STANDARD_GRAVITY)), 0.0)
    force = float(pad.pressure(np.array([strain]))[0])
    mass = max(LEAST_MASS, _rounded(force / STANDARD_GRAVITY))
    return Press(mass, pad.thickness * float(pad.strain(np.array([mass * STANDARD_GRAVITY]))[0]))


def pressed_by(spec: SensorSpec, force: float) -> float | None:
    """How far (m) a force (N) on one whole target, or pad, presses the pad; None if no pad carries it."""
    try:
        pad = soft_pad(replace(spec, encapsulation=None))
        return pad.thickness * float(pad.strain(np.array([force]))[0])
    except NoResponse:
        return None


def force_for(spec: SensorSpec, travel: float) -> float | None:
    """The force (N) on one whole target, or pad, that presses the pad by so much (m); None if no pad carries it."""
    try:
        pad = soft_pad(replace(spec, encapsulation=None))
    except NoResponse:
        return None
    return float(pad.pressure(np.array([travel / pad.thickness]))[0])


def _rounded(mass: float) -> float:
    return float(f"{mass:.1e}")


def glued_plan(spec: SensorSpec, part: str) -> Footprint:
    """The plate under which glue has to lie flat: elastomer, target, or the box of all pads in one piece."""
    return glued_pieces(spec, part)[0].footprint


def may_set_first(spec: SensorSpec, part: str) -> bool:
    """Whether glue may set before a piece lies flat; False is certain, by less than the pad's real stiffness."""
    glue, plan, pad = spec.assembly.adhesive, glued_plan(spec, part), spec.elastomer
    if glue is None or glue.open_time is None:
        return False
    modulus = 3.0 * pad.material.shear_modulus if pad is not None else HARD_PRESSURE / PIECE_STRAIN
    force = max(LEAST_MASS * STANDARD_GRAVITY, 0.5 * PIECE_STRAIN * modulus * plan.area)
    return lying_time(glue, plan, force, spec.assembly.glue_line, PIECE_HANDLING) > glue.open_time


def glued_area(spec: SensorSpec, part: str) -> float:
    """The area (m2) of the glue under a piece of elastomer, or under a target."""
    own, pad = plates(spec, part)[0].footprint, elastomer(spec)
    if part == "elastomer" or pad is None:
        return own.area * _plates_in_one(spec, part)
    shared = own.common(pad.footprint)
    return min(own.area, pad.footprint.area) if shared is None else enclosed_area(shared)


def board_plan(layout: Layout) -> tuple[Footprint, float]:
    """The box round the board's body, or the disc that it is, and its area (m2)."""
    x0, y0, x1, y1 = layout.body
    body = layout.spec.fpc.body
    centre = Point((x0 + x1) / 2, (y0 + y1) / 2)
    plan = Footprint(body is not None and body.shape == "circle", (x1 - x0, y1 - y0), centre)
    return plan, enclosed_area(ground(layout))


def lying_time(adhesive: Adhesive, plan: Footprint, force: float, line: float, handling: float) -> float:
    """Time (s) in which glue is spread, a plate handled and pressed by a force (N) to a line (m); 0 for a tape.

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
    """Force times time (N s) that presses glue under a plate to a line (m)."""
    assert adhesive.viscosity is not None
    long, short = max(plan.size), min(plan.size)
    torsion = math.pi * (long / 2) ** 4 / 2
    if not plan.is_round:
        torsion = long * short**3 / 3.0 * (1.0 - 0.63 * short / long * (1.0 - (short / long) ** 4 / 12.0))
    return 3.0 * adhesive.viscosity * torsion / (2.0 * line**2)


def open_adhesives(plan: Footprint, force: float, on_silicone: bool) -> tuple[Adhesive, ...]:
    """Adhesives by name that lie flat in time at their own lines, and hold on silicone if asked; no tapes."""
    found = (presets.adhesive(name) for name in presets.names("adhesive"))
    return tuple(
        each for each in found if each.viscosity is not None and (each.bonds_silicone or not on_silicone)
        and lying_time(each, plan, force, each.line, PIECE_HANDLING) <= (each.open_time or math.inf)
    )


def board_force(layout: Layout, glue: Adhesive | None) -> float:
    """Force (N) that presses the board on its mount until a glue lies flat at the spec's line; infinite if none does
    before the glue sets.
    """
    (plan, area), line = board_plan(layout), layout.spec.assembly.glue_line
    least = HARD_PRESSURE * area
    if glue is None or glue.viscosity is None or glue.open_time is None or line <= 0.0:
        return least
    left = FLAT_SHARE * glue.open_time - SPREADING * plan.area - HARD_HANDLING
    return max(least, _impulse(glue, plan, line) / left) if left > 0.0 else math.inf


def board_press(layout: Layout) -> float:
    """Mass (kg) of the weight on the board, its press with it, while the board is glued to its mount."""
    force = board_force(layout, hard_adhesive(layout))
    area = board_plan(layout)[1]
    return max(LEAST_MASS, _rounded(min(force, MOST_PRESSURE * area) / STANDARD_GRAVITY))


def hard_adhesive(layout: Layout) -> Adhesive | None:
    """The adhesive of all hard faces, from what carries the sensor up to the board: the spec's, or the first of the
    table that the board can be laid and pressed with before it sets; else the one that wants the least force.
    """
    glue, most = layout.spec.assembly.adhesive, MOST_PRESSURE * board_plan(layout)[1]
    if glue is None or board_force(layout, glue) <= most:
        return glue
    others = (presets.adhesive(name) for name in presets.names("adhesive"))
    hard = [each for each in others if each.viscosity is not None and not each.bonds_silicone]
    return next((each for each in hard if board_force(layout, each) <= most),
                min((glue, *hard), key=lambda each: board_force(layout, each)))
