"""A wave over a lattice: how far every free node is from where it began, and the shortest way back (Dijkstra)."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence

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


def spread(free: Flags, sources: Sequence[Node]) -> Wave:
    """The wave from some nodes over those that are free, eight neighbours each."""
    stride = free.shape[1] + 2
    bordered = np.zeros((free.shape[0] + 2, stride), dtype=bool)
    bordered[1:-1, 1:-1] = free
    open_, reached, before = bordered.ravel().tolist(), [math.inf] * bordered.size, [-1] * bordered.size
    steps = [(dx * stride + dy, math.hypot(dx, dy)) for dx, dy in _STEPS]
    queue = [(0.0, (i + 1) * stride + j + 1) for i, j in sources if free[i, j]]
    for _, place in queue:
        reached[place] = 0.0
    while queue:
        so_far, place = heapq.heappop(queue)
        if so_far > reached[place]:
            continue
        for offset, length in steps:
            beyond, further = place + offset, so_far + length
            if open_[beyond] and further < reached[beyond] - 1e-12:
                reached[beyond], before[beyond] = further, place
                heapq.heappush(queue, (further, beyond))
    return Wave(stride, reached, before)
