"""What a cell reads of its neighbours: through their targets and through their coils, in parts of its own full signal.

Where the pads of cells stand apart, no force goes from one to the next but through the board, which is held.
"""

from __future__ import annotations

import math

import numpy as np

from sitscad.estimates.response.working_range import USUAL_STRAIN
from sitscad.estimates.states.pressing import web_stiffness
from sitscad.estimates.states.solved_target import own_changes
from sitscad.estimates.values import Estimates
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.state import REST
from sitscad.spec.places import cell_specs
from sitscad.spec.sensor import SensorSpec

AROUND = 1.5
"""Neighbours that count: as far as so many times the distance of the nearest, those across a corner among them."""


WEB_DECAY, WEB_MEAN, WEB_EDGE = 0.95, 0.25, 1.2
"""What goes through a web of width w and length g, as thick as the pads (h) of side b: with one target pressed, the
mean of the next one's way is at most 0.25 w/b exp(-0.95 g/h) of it, and the way of its edge at most 1.2 instead of
0.25. An envelope of linear finite elements, which lie 1.1 to 3 times below it, 5 times from end to end of pads 2.5
times as long as wide: pads 3 to 10 times as wide as thick, gaps of 0.7 to 4 thicknesses, any width
(tests/validation/test_webs.py)."""


@record
class CellCrosstalk:
    """Parts of a coil's own full signal: what ``target`` of one neighbouring cell changes at most when it is pressed,
    what the ``targets`` of all around one cell do, what neighbouring ``coils`` that wait grounded do, and what goes
    through ``webs`` to its own target, all at most; ``stiffer`` is by what share webs make the pads of cells stiffer,
    the least held and the most. ``pairs`` are two cells (from 1), and what the first reads of the other at most.
    """

    target: float
    targets: float
    coils: float
    webs: float = 0.0
    stiffer: tuple[float, float] = (0.0, 0.0)
    pairs: tuple[tuple[int, int, float], ...] = ()

    @property
    def total(self) -> float:
        """All of it at once."""
        return self.targets + self.coils + self.webs


def cell_crosstalk(layout: Layout, estimates: Estimates) -> CellCrosstalk | None:
    """The crosstalk of a sensor's cells, each pressed as in the state pressed, or by `USUAL_STRAIN` of its pad where
    there is none; None where no coil has a signal.

    A neighbour's target is taken as if a cell had no target of its own, which would hold most of that off: boxes of
    loops have less than half (tests/validation/two_targets.py). A coil that waits grounded beside another takes k^2 of
    its inductance, k their coupling, and so hands on k^2 of the share by which its own changes.
    """
    spec = layout.spec
    assert spec.cells is not None and spec.elastomer is not None
    middles = [np.array(cell.array.middle) for cell in cell_specs(spec)]
    apart = np.array([[other - one for other in middles] for one in middles])
    far = np.hypot(*np.moveaxis(apart, -1, 0))
    nearest = AROUND * far[far > 0.0].min()
    neighbours = [[tuple(np.round(step, 9)) for step in row[(way > 0.0) & (way < nearest)]]
                  for row, way in zip(apart, far, strict=True)]
    steps = sorted({step for row in neighbours for step in row})
    press = estimates.pressed_place
    press = -USUAL_STRAIN * spec.elastomer.thickness if press is None else press
    poses = np.zeros((2, 1 + len(steps), 6))
    poses[:, 1:, :2], poses[1, :, 2] = steps, press
    found = [state.frequency for coil in estimates.coils for state in coil.states.values() if state.state == REST]
    if not found:
        return None
    first = layout.cell(1)
    effects = own_changes(first, poses.reshape(-1, 6), max(found)).real.reshape(2, 1 + len(steps), -1)
    own, *others = np.abs(effects[1] - effects[0])
    if not own.max() > 0.0:
        return None
    parts = {step: float(other.max() / own.max()) for step, other in zip(steps, others, strict=True)}
    matrix = np.array(estimates.inductance_matrix)
    cell, diagonal = np.arange(len(matrix)) // spec.cells.coils, np.diag(matrix)
    coupled = np.where(cell[:, None] != cell, matrix**2 / np.outer(diagonal, diagonal), 0.0)  # k^2
    stiffer = min(web_stiffness(spec)) - 1.0, max(web_stiffness(spec)) - 1.0
    strips = _webs_felt(spec)
    pairs = tuple(
        (one + 1, other + 1, parts[step] + strips.get((one, other), 0.0)
         + float(coupled[np.ix_(cell == one, cell == other)].sum(axis=1).max()))
        for one, row in enumerate(apart) for other, way in enumerate(row)
        if (step := tuple(np.round(way, 9))) in neighbours[one])
    return CellCrosstalk(max(parts.values()), max(math.fsum(parts[step] for step in row) for row in neighbours),
                         float(coupled.sum(axis=1).max()), through_webs(spec), stiffer, pairs)


def through_webs(spec: SensorSpec) -> float:
    """What the webs of one cell carry to its target at most, all neighbours pressed; a group feels the target's tilt, a
    coil in its middle does not.
    """
    felt = _webs_felt(spec)
    return max((math.fsum(part for (own, _), part in felt.items() if own == one) for one, _ in felt), default=0.0)


def _webs_felt(spec: SensorSpec) -> dict[tuple[int, int], float]:
    """By two cells (numbers from 0) that a web joins, what it carries to the first one's target at most."""
    pad, found, cells = spec.elastomer, {}, cell_specs(spec)
    if pad is None or spec.cells is None or spec.cells.web is None:
        return {}
    felt = spec.cells.web / min(pad.size) * (WEB_MEAN if spec.cells.coils == 1 else WEB_EDGE)
    for own, cell in enumerate(cells):
        for side, length in enumerate(cell.elastomer.webs[1:] if cell.elastomer is not None else ()):
            way = (length + pad.size[side // 2]) * (1 if side % 2 else -1)
            there = [place + way * (axis == side // 2) for axis, place in enumerate(cell.array.middle)]
            for other, one in enumerate(cells):
                if length and math.dist(one.array.middle, there) < 1e-8:
                    found[own, other] = felt * math.exp(-WEB_DECAY * length / pad.thickness)
    return found


def weakest_cell(spec: SensorSpec, estimates: Estimates) -> int:
    """The number, from 1, of the cell that gives the least signal: alike cells differ by their coils' leads, whose
    inductance the target does not change, and by how many webs hold their pads.
    """
    signals = cell_signals(spec, estimates)
    return 1 + min(range(len(signals)), key=signals.__getitem__)


def cell_signals(spec: SensorSpec, estimates: Estimates) -> list[float]:
    """By cell, what part of its coils' inductance is beside their leads, over how much webs stiffen its pad: signals
    are in proportion to it, to first order.
    """
    assert spec.cells is not None
    parts = [1.0 - coil.lead_inductance / coil.terminal_inductance for coil in estimates.coils]
    own = [math.fsum(parts[k : k + spec.cells.coils]) for k in range(0, len(parts), spec.cells.coils)]
    return [part / stiffer for part, stiffer in zip(own, web_stiffness(spec), strict=True)]
