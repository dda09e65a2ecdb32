"""A wave over a lattice: how far every free node is from where it began, and the shortest way back (Dijkstra)."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.record import record

Flags = NDArray[np.bool_]
Node = tuple[int, int]

_STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))


@record(eq=False)
class Wave:
    """Distances over the lattice (in steps; infinite where it did not come), and from each node the one before it.

    Both are kept row by row, with a border of nodes that are not free.
    """

    stride: int
    reached: Sequence[float]
    before: Sequence[int]

    def distance(self, node: Node) -> float:
        """How far a node is from where the wave began."""
        return self.reached[self._place(node)]

    def back(self, node: Node) -> Iterator[Node]:
        """The nodes from one to where the wave began."""
        place = self._place(node)
        while place >= 0:
            yield place // self.stride - 1, place % self.stride - 1
            place = self.before[place]

    def _place(self, node: Node) -> int:
        return (node[0] + 1) * self.stride + node[1] + 1


def spread(free: Flags, sources: Sequence[Node], between: Flags | None = None) -> Wave:
    """The wave from some nodes over those that are free, eight neighbours each.

    `between` (2 n - 1, 2 m - 1) tells of the same lattice at half its step which places a step may lead over: without
    it all may.
    """
    stride = free.shape[1] + 2
    size = (free.shape[0] + 2) * stride
    ways, onward = _ways(free, between), _onward(stride)
    reached, before = [math.inf] * size, [-1] * size
    queue = [(0.0, (i + 1) * stride + j + 1) for i, j in sources if free[i, j]]
    for _, place in queue:
        reached[place] = 0.0
    while queue:
        so_far, place = heapq.heappop(queue)
        if so_far > reached[place]:
            continue
        for offset, length in onward[ways[place]]:
            beyond, further = place + offset, so_far + length
            if further < reached[beyond] - 1e-12:
                reached[beyond], before[beyond] = further, place
                heapq.heappush(queue, (further, beyond))
    return Wave(stride, reached, before)


def _ways(free: Flags, between: Flags | None) -> Sequence[int]:
    """Of each node, with the border, which of the eight steps may be taken: one bit each."""
    n, m = free.shape
    found = np.zeros((n + 2, m + 2), dtype=np.intp)
    bordered = np.zeros((n + 2, m + 2), dtype=bool)
    bordered[1:-1, 1:-1] = free
    halves = np.ones((2 * n + 1, 2 * m + 1), dtype=bool)
    if between is not None:
        halves[1:-1, 1:-1] = between
    for bit, (dx, dy) in enumerate(_STEPS):
        beyond = bordered[1 + dx : n + 1 + dx, 1 + dy : m + 1 + dy]
        halfway = halves[1 + dx : 2 * n + dx + 1 : 2, 1 + dy : 2 * m + dy + 1 : 2]
        found[1:-1, 1:-1] |= (free & beyond & halfway).astype(np.intp) << bit
    return list(found.ravel().tolist())


@lru_cache(maxsize=16)
def _onward(stride: int) -> tuple[tuple[tuple[int, float], ...], ...]:
    """For every set of steps their offsets in rows of a length, and their lengths."""
    steps = [(dx * stride + dy, math.hypot(dx, dy)) for dx, dy in _STEPS]
    return tuple(tuple(step for bit, step in enumerate(steps) if bits >> bit & 1) for bits in range(1 << len(steps)))
