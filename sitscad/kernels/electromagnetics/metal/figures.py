"""Point patterns that repeat along a winding, and the sum of a wave over all points.

Every bend of a turn repeats the chords of the bend before it, and the next turn repeats the turn one pitch further
inside. The wave is summed once over each pattern. The places of a pattern lie in rows of equal steps and are summed in
closed form.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Index
from sitscad.basics.record import record

LEAST_ROW = 4
"""Least number of places of a row for which a closed form is used. It costs as much as three single places."""


@record(eq=False)
class Rows:
    """Places in rows of equal steps.

    `middles` (n, 2; m) are the middles of the rows, `steps` (n, 2; m) their steps from place to place, `counts` (n) the
    numbers of places.
    """

    middles: Array
    steps: Array
    counts: Array

    def sums(self, wave: Array) -> ComplexArray:
        """Return the sum of exp(-i k.r) over the places r of each row (n, directions; no unit).

        `wave` (2, directions; 1/m) are the wave vectors k. About the middle of a row the sum is sin(count x / 2) /
        sin(x / 2), with the phase x between places (Dirichlet kernel, textbook).
        """
        waves = phase_factors(self.middles @ wave)
        longer = self.counts > 1.0
        # sin(count x / 2) / sin(x / 2) from quarters of the phase x between places, by tangents, which cost a tenth
        # of sines
        quarter = 0.25 * (self.steps[longer] @ wave)
        quarter = np.where(quarter == 0.0, 1e-20, quarter)
        several, single = np.tan(self.counts[longer, None] * quarter), np.tan(quarter)
        waves[longer] *= several * (1.0 + single * single) / (single * (1.0 + several * several))
        return waves


@record(eq=False)
class Patterns:
    """Points grouped into patterns that repeat.

    A pattern is the points between two steps that occur only once. `kinds` (point numbers) and `inner` (m; position
    relative to the pattern's first point) list the points of one copy of each pattern, pattern after pattern. `first`
    are the indices in these arrays at which patterns begin. `places` (m) are the first points of all copies, pattern
    after pattern. `begins` are the indices in `places` at which patterns begin. Places that differ by less than
    `tolerance` (m) count as equal.
    """

    kinds: Index
    inner: Array
    first: Index
    places: Array
    begins: Index
    tolerance: float

    @cached_property
    def sizes(self) -> Index:
        """Number of points in each pattern (no unit)."""
        return np.diff(np.append(self.first, len(self.kinds)))

    @cached_property
    def _rows(self) -> tuple[Rows, Index]:
        """Places of all copies as rows (m), pattern by pattern, and the number of each pattern's first row."""
        rows: list[tuple[Array, Array, int]] = []
        begins = []
        for low, high in pairwise([*self.begins.tolist(), len(self.places)]):
            begins.append(len(rows))
            rows += _rows_of_places(self.places[low:high], self.tolerance)
        middles, steps, counts = zip(*rows, strict=True)
        return Rows(np.array(middles), np.array(steps), np.array(counts, dtype=float)), np.array(begins)

    def sums(self, wave: Array, factors: Array) -> ComplexArray:
        """Return the sum of factors (..., kinds, directions) times exp(-i k.r) over all points r.

        The result (..., directions) has the factors' unit. `wave` (2, directions; 1/m) are the wave vectors k.
        """
        if len(self.places) == len(self.begins):  # no pattern repeats: sum over all points
            phases = phase_factors((self.inner + np.repeat(self.places, self.sizes, axis=0)) @ wave)
            return np.asarray(np.einsum("...kd,kd->...d", factors, phases))
        figure = factors  # patterns of a single point each
        if len(self.first) < len(self.kinds):
            figure = np.add.reduceat(factors * phase_factors(self.inner @ wave), self.first, axis=-2)
        rows, begins = self._rows
        places = rows.sums(wave)
        if len(begins) < len(places):
            places = np.add.reduceat(places, begins, axis=0)
        return np.asarray(np.einsum("...kd,kd->...d", figure, places))


def repeating_patterns(points: Array, labels: Array, same: float) -> Patterns:
    """Return the patterns that repeat in a sequence of points (n, 2; m).

    Copies of a pattern have equal steps within `same` (m) and equal labels (n, any).
    """
    _, kind = np.unique(np.round(labels, 9) + 0.0, axis=0, return_inverse=True)
    step = np.round(np.diff(points, axis=0) / same) + 0.0
    _, way, times = np.unique(step, axis=0, return_inverse=True, return_counts=True)
    ends = [0, *(np.nonzero(times[way] < 2)[0] + 1).tolist(), len(points)]
    patterns: dict[tuple[bytes, bytes], list[int]] = {}
    for low, high in pairwise(ends):
        patterns.setdefault((kind[low:high].tobytes(), way[low : high - 1].tobytes()), []).append(low)
    sizes = [len(kinds) // kind.itemsize for kinds, _ in patterns]
    numbers = [np.arange(runs[0], runs[0] + size) for runs, size in zip(patterns.values(), sizes, strict=True)]
    kinds, anchors = np.concatenate(numbers), np.repeat([runs[0] for runs in patterns.values()], sizes)
    begins = np.cumsum([0, *(len(runs) for runs in patterns.values())])
    return Patterns(kinds, points[kinds] - points[anchors], np.cumsum([0, *sizes])[:-1],
                    points[[run for runs in patterns.values() for run in runs]], begins[:-1], same)


def _rows_of_places(places: Array, same: float) -> list[tuple[Array, Array, int]]:
    """Return rows of consecutive places with equal steps, as (middle (2; m), step (2; m), number of places).

    `places` (n, 2; m) may differ from a row by `same` (m). A place that continues no row is a row of its own.
    """
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


def phase_factors(phase: Array) -> ComplexArray:
    """Return exp(-i phase) (no unit) for phases in radians.

    It is 2 / (1 + t^2) - 1 and 2 t / (1 + t^2) with t the tangent of half the phase (textbook), at a tenth of the cost
    of sine and cosine.
    """
    tangent = np.tan(0.5 * phase)
    double = 2.0 / (1.0 + tangent * tangent)
    wave = np.empty(phase.shape, dtype=np.complex128)
    np.subtract(double, 1.0, out=wave.real)
    np.multiply(-tangent, double, out=wave.imag)
    return wave
