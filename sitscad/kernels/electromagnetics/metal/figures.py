"""Points that repeat along a winding, and the sum of a wave over all of them.

Every bend of a turn has the chords of the bend before it, and the next turn has it again, a pitch farther in: such
figures are worked out once, and the places of one figure, which lie in rows of equal steps, are summed in closed form.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Index
from sitscad.basics.record import record

LEAST_ROW = 4
"""Places from which on a row is summed in closed form, which costs as much as three of them."""


@record(eq=False)
class Rows:
    """Places in rows of equal steps: their middles and steps (n, 2; m) and how many places each has (n)."""

    middles: Array
    steps: Array
    counts: Array

    def sums(self, wave: Array) -> ComplexArray:
        """Sum of exp(-i k.r) over each row's places (n, directions), no unit; `wave` (2, directions) in 1/m. Over a row
        about its middle it is sin(count x / 2) / sin(x / 2), x being the phase from place to place (Dirichlet's kernel,
        textbook).
        """
        found = turned(self.middles @ wave)
        longer = self.counts > 1.0
        # Sum (no unit) of exp(-i n x) over a row of `count` places about its middle, sin(count x / 2) / sin(x / 2),
        # of quarters of the phase x from place to place: by tangents, which cost a tenth of sines.
        quarter = 0.25 * (self.steps[longer] @ wave)
        quarter = np.where(quarter == 0.0, 1e-20, quarter)
        whole, one = np.tan(self.counts[longer, None] * quarter), np.tan(quarter)
        found[longer] *= whole * (1.0 + one * one) / (one * (1.0 + whole * whole))
        return found


@record(eq=False)
class Figures:
    """Points as figures that repeat: those between two steps that occur only once, each figure with every place where
    it stands. `kinds` are the numbers of one figure's points, all figures one after another, from `first` on; `inner`
    (m) where they lie from its first point; `places` (m) are the first points, figure by figure, from `begins` on.
    """

    kinds: Index
    inner: Array
    first: Index
    places: Array
    begins: Index
    same: float

    @cached_property
    def sizes(self) -> Index:
        """How many points each figure has, no unit."""
        return np.diff(np.append(self.first, len(self.kinds)))

    @cached_property
    def _rows(self) -> tuple[Rows, Index]:
        """The places as rows (m), figure by figure, and the number of each figure's first row."""
        rows: list[tuple[Array, Array, int]] = []
        begins = []
        for low, high in pairwise([*self.begins.tolist(), len(self.places)]):
            begins.append(len(rows))
            rows += _in_rows(self.places[low:high], self.same)
        middles, steps, counts = zip(*rows, strict=True)
        return Rows(np.array(middles), np.array(steps), np.array(counts, dtype=float)), np.array(begins)

    def sums(self, wave: Array, factors: Array) -> ComplexArray:
        """Sum of factors (..., kinds, directions) times exp(-i k.r) over all points, (..., directions) in the factors'
        unit; `wave` (2, directions) in 1/m.
        """
        if len(self.places) == len(self.begins):  # none repeats: all points one by one
            phases = turned((self.inner + np.repeat(self.places, self.sizes, axis=0)) @ wave)
            return np.asarray(np.einsum("...kd,kd->...d", factors, phases))
        figure = factors  # of one point each
        if len(self.first) < len(self.kinds):
            figure = np.add.reduceat(factors * turned(self.inner @ wave), self.first, axis=-2)
        rows, begins = self._rows
        places = rows.sums(wave)
        if len(begins) < len(places):
            places = np.add.reduceat(places, begins, axis=0)
        return np.asarray(np.einsum("...kd,kd->...d", figure, places))


def figures(points: Array, labels: Array, same: float) -> Figures:
    """The figures of points (n, 2; m), equal within `same` (m), whose labels (n, any) are equal too."""
    _, kind = np.unique(np.round(labels, 9) + 0.0, axis=0, return_inverse=True)
    step = np.round(np.diff(points, axis=0) / same) + 0.0
    _, way, times = np.unique(step, axis=0, return_inverse=True, return_counts=True)
    ends = [0, *(np.nonzero(times[way] < 2)[0] + 1).tolist(), len(points)]
    found: dict[tuple[bytes, bytes], list[int]] = {}
    for low, high in pairwise(ends):
        found.setdefault((kind[low:high].tobytes(), way[low : high - 1].tobytes()), []).append(low)
    sizes = [len(kinds) // kind.itemsize for kinds, _ in found]
    one = [np.arange(runs[0], runs[0] + size) for runs, size in zip(found.values(), sizes, strict=True)]
    kinds, anchors = np.concatenate(one), np.repeat([runs[0] for runs in found.values()], sizes)
    begins = np.cumsum([0, *(len(runs) for runs in found.values())])
    return Figures(kinds, points[kinds] - points[anchors], np.cumsum([0, *sizes])[:-1],
                   points[[run for runs in found.values() for run in runs]], begins[:-1], same)


def _in_rows(places: Array, same: float) -> list[tuple[Array, Array, int]]:
    """Rows of places (n, 2; m) that follow one another: middle, step and number; places off a row are rows of one."""
    rows: list[tuple[Array, Array, int]] = []
    first = 0
    while first < len(places):
        ahead = places[first:]
        even = ahead[0] + np.arange(len(ahead))[:, None] * (ahead[1] - ahead[0] if len(ahead) > 1 else 0.0)
        off = np.nonzero(np.abs(ahead - even).max(axis=1) > same)[0]
        count = int(off[0]) if off.size else len(ahead)
        if count < LEAST_ROW:
            rows.append((ahead[0], np.zeros(2), 1))
            first += 1
            continue
        last = ahead[count - 1]
        rows.append((0.5 * (ahead[0] + last), (last - ahead[0]) / (count - 1), count))
        first += count
    return rows


def turned(phase: Array) -> ComplexArray:
    """exp(-i phase), no unit, for phases in radians: 2 / (1 + t^2) - 1 and 2 t / (1 + t^2) with t the tangent of half
    the phase (textbook), which costs a tenth of sine and cosine.
    """
    tangent = np.tan(0.5 * phase)
    both = 2.0 / (1.0 + tangent * tangent)
    found = np.empty(phase.shape, dtype=np.complex128)
    np.subtract(both, 1.0, out=found.real)
    np.multiply(-tangent, both, out=found.imag)
    return found
