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

ROWS_AT_ONCE = 16
"""Branches that another connection's are held against at once: the next cheapest ones are asked for next."""

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
        """The set of branches of this table that keep their distance from one branch of another; kept with that."""
        sets = other._sets_of(self)
        if row not in sets:
            first = row - row % ROWS_AT_ONCE
            rows = range(first, min(first + ROWS_AT_ONCE, len(other.branches)))
            sets.update(zip(rows, self.beside_branches(other, rows), strict=True))
        return sets[row]

    def _sets_of(self, other: BranchTable) -> dict[int, int]:
        """What is known of the branches of another table beside the rows of this one."""
        # by identity, so the other table is kept, too
        return self._known.setdefault(id(other), (other, {}))[1]

    @cached_property
    def _known(self) -> dict[int, tuple[BranchTable, dict[int, int]]]:
        return {}

    def beside_branches(self, other: BranchTable, rows: range) -> list[int]:
        """The sets of branches of this table that keep their distance from each of some branches of another."""
        around = self.around
        some = slice(rows.start, rows.stop)
        layer, low, sweep = (table[some][:, None, None, :] for table in (other.layer, other.low, other.sweep))
        same = (self.layer[:, :, None] == layer) & (layer >= 0)
        gap = _interval_gap(self.low[:, :, None], self.sweep[:, :, None], low, sweep)
        near = np.any(same & (gap < (around.bus.pitch - 1e-9) / around.radius), axis=(2, 3))
        need = around.keep_out + around.bus.width / 2 - 1e-9
        if other.has_vias:
            self._meet(other, some, need, near)
            apart = hole_distance(around.joined, around.joined, around.spec.fpc.rules, around.bus.spacing) - 1e-9
            away = self.centre - other.centre[some, None]
            near |= np.hypot(away[..., 0], away[..., 1]) < apart
        if self.has_vias:
            self._met_by(other, some, need, near)
        return _as_sets(~near)

    @cached_property
    def has_vias(self) -> bool:
        """Whether any branch has a via."""
        return not bool(np.isnan(self.angle).all())

    def _meet(self, other: BranchTable, some: slice, need: float, near: Flags) -> None:
        """Marks (rows, n) the branches of which a leg comes too near the via of another's rows."""
        angle, beside = other.angle[some, None, None], other.beside[some, None]
        gap = _interval_gap(self.low, self.sweep, angle, 0.0) * self.around.radius
        near |= (beside < need) & np.any((gap < need) & (self.layer >= 0), axis=2)
        stretch, row = np.nonzero(_to_stretches(self.starts, self.steps, other.centre[some]) < need)
        near[row, self.owner[stretch]] = True

    def _met_by(self, other: BranchTable, some: slice, need: float, near: Flags) -> None:
        """Marks (rows, n) the branches whose via comes too near a leg of another's rows."""
        low, sweep, layer = (table[some, None] for table in (other.low, other.sweep, other.layer))
        gap = _interval_gap(self.angle[:, None], 0.0, low, sweep) * self.around.radius
        near |= (self.beside < need) & np.any((gap < need) & (layer >= 0), axis=2)
        own = slice(*np.searchsorted(other.owner, (some.start, some.stop)))
        stretch, branch = np.nonzero(_to_stretches(other.starts[own], other.steps[own], self.centre) < need)
        near[other.owner[own][stretch] - some.start, branch] = True


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
    ahead = (other_low - low) % TWO_PI
    behind = np.where(ahead > 0.0, TWO_PI - ahead, 0.0) - other_sweep
    return np.asarray(np.maximum(0.0, np.minimum(ahead - sweep, behind)))


def _to_stretches(starts: Array, steps: Array, points: Array) -> Array:
    """Distances (m) of points (p, 2) from straight stretches: (stretches, p); nan for points that are nan."""
    (x, y), (dx, dy) = (points[:, k] - starts[:, k, None] for k in (0, 1)), steps.T[:, :, None]
    share = (x * dx + y * dy) / np.maximum(dx * dx + dy * dy, 1e-30)
    np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
    return np.asarray(np.hypot(x - share * dx, y - share * dy))


def _as_sets(flags: Flags) -> list[int]:
    return [int.from_bytes(row.tobytes(), "little") for row in np.packbits(flags, axis=1, bitorder="little")]
