"""The ways of one connection as arrays, and which of them another connection's way leaves room for.

Branches of one coil are held against each other by the angles that they claim on the ring road, which is cheap, and by
their vias' and last stretches' true distances.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.geometry.path import TWO_PI
from sitscad.layout.clearance import hole_distance
from sitscad.layout.routing.branches import Branch, Surroundings
from sitscad.record import record

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEGS = 2
"""A branch has at most so many legs, with a via between them."""


NO_LEG = -1, 0.0, 0.0
NO_VIA = math.nan, math.nan, math.nan, math.nan


@record(eq=False)
class BranchTable:
    """Branches of one connection, the cheapest first; rows of all arrays are branches.

    ``cost`` (n) is each branch's (m), ``round`` (n) how far it goes round the coil (rad).
    Legs (n, 2): copper layer (-1: no such leg), where its interval on the ring begins and how long it is (rad). Vias
    (n): centre (m; nan: none), angle (rad) and distance from the ring road (m). `ways` are the straight stretches
    beyond the ring: starts and steps (w, 2) and the branch that each belongs to.
    """

    around: Surroundings
    branches: tuple[Branch, ...]
    cost: Array
    round: Array
    layer: NDArray[np.intp]
    low: Array
    sweep: Array
    centre: Array
    angle: Array
    beside: Array
    starts: Array
    steps: Array
    owner: NDArray[np.intp]

    @cached_property
    def everything(self) -> int:
        """The set of all branches, one bit each."""
        return (1 << len(self.branches)) - 1

    def beside_branch(self, other: BranchTable, row: int) -> int:
        """The set of branches of this table that keep their distance from one branch of another."""
        around = self.around
        reach = (around.bus.pitch - 1e-9) / around.radius
        near = np.zeros(len(self.branches), dtype=bool)
        for i in range(LEGS):
            for j in range(LEGS):
                same = (self.layer[:, i] == other.layer[row, j]) & (self.layer[:, i] >= 0)
                gap = _interval_gap(self.low[:, i], self.sweep[:, i], other.low[row, j], other.sweep[row, j])
                near |= same & (gap < reach)
        need = around.keep_out + around.bus.width / 2 - 1e-9
        if not math.isnan(other.angle[row]):
            near |= self._meet(other.centre[row], other.angle[row], other.beside[row], need)
            apart = hole_distance(around.joined, around.joined, around.spec.fpc.rules, around.bus.spacing) - 1e-9
            near |= np.hypot(*(self.centre - other.centre[row]).T) < apart
        near |= self._met_by(other, row, need)
        return _as_set(~near)

    def _meet(self, centre: Array, angle: float, beside: float, need: float) -> Flags:
        """The branches of which a leg comes too near a via."""
        near = np.zeros(len(self.branches), dtype=bool)
        if beside < need:
            gap = _interval_gap(self.low, self.sweep, angle, 0.0) * self.around.radius
            near |= np.any((gap < need) & (self.layer >= 0), axis=1)
        distance = _to_stretches(self.starts, self.steps, centre[None])[:, 0]
        near[self.owner[distance < need]] = True
        return near

    def _met_by(self, other: BranchTable, row: int, need: float) -> Flags:
        """The branches whose via comes too near a leg of one branch of another table."""
        near = np.zeros(len(self.branches), dtype=bool)
        for j in range(LEGS):
            if other.layer[row, j] >= 0:
                gap = _interval_gap(self.angle, 0.0, other.low[row, j], other.sweep[row, j]) * self.around.radius
                near |= (self.beside < need) & (gap < need)
        own = other.owner == row
        distance = _to_stretches(other.starts[own], other.steps[own], self.centre)
        return np.asarray(near | np.any(distance < need, axis=0))


def branch_table(around: Surroundings, branches: Sequence[Branch]) -> BranchTable:
    """The arrays of some branches."""
    legs, vias, stretches, owner = [], [], [], []
    for k, branch in enumerate(branches):
        rows = [(leg.layer, leg.angle + min(leg.sweep, 0.0), abs(leg.sweep)) for leg in branch.legs]
        legs.append((*rows, NO_LEG)[:LEGS])
        vias.append(NO_VIA if branch.hole is None else (*branch.hole.centre, *around.stand(branch.hole)))
        for leg in branch.legs:
            for start, end in leg.stretches:
                stretches.append((*start, *end))
                owner.append(k)
    leg_of, via_of = np.array(legs, dtype=float).reshape(-1, LEGS, 3), np.array(vias, dtype=float).reshape(-1, 4)
    table = np.array(stretches, dtype=float).reshape(-1, 4)
    cost, round_coil = (np.array([getattr(branch, name) for branch in branches]) for name in ("cost", "round"))
    return BranchTable(around, tuple(branches), cost, round_coil,
                       leg_of[..., 0].astype(np.intp), leg_of[..., 1], leg_of[..., 2],
                       via_of[:, :2], via_of[:, 2], via_of[:, 3], table[:, :2], table[:, 2:] - table[:, :2],
                       np.array(owner, dtype=np.intp))  # fmt: skip


def _interval_gap(low: Any, sweep: Any, other_low: Any, other_sweep: Any) -> Array:
    """Angles (rad) between intervals on a circle; 0 where they overlap."""
    ahead = (other_low - low) % TWO_PI - sweep
    behind = (low - other_low) % TWO_PI - other_sweep
    return np.asarray(np.maximum(0.0, np.minimum(ahead, behind)))


def _to_stretches(starts: Array, steps: Array, points: Array) -> Array:
    """Distances (m) of points (p, 2) from straight stretches: (stretches, p); nan for points that are nan."""
    away = points[None] - starts[:, None]
    square = np.maximum(np.sum(steps * steps, axis=1), 1e-30)[:, None]
    share = np.clip(np.sum(away * steps[:, None], axis=2) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*np.moveaxis(away - share[..., None] * steps[:, None], 2, 0)))


def _as_set(flags: Flags) -> int:
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")
