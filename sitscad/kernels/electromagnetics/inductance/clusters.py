"""Neumann's sum over the points of two windings: near clusters point by point, far clusters by Chebyshev interpolation.

If two clusters are far apart compared with their sizes, 1 / distance is a smooth function of the points. Then a
polynomial through a few nodes of each cluster's box replaces it, and the nodes carry the points' line elements (Fong
and Darve, J. Comput. Phys. 228, 2009). So the work grows with the number of points, not with its square.

A plan is the shape of a layer's track seen from above (its x and y). Layers with equal plans share one set of points.
The height differences between the layers of both windings enter by another polynomial.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.mean_distance import height_nodes, sufficient_node_counts
from sitscad.kernels.electromagnetics.polynomials import barycentric_weights, chebyshev_points, node_counts

Points = tuple[Array, Array]
"""Points (n, 2; m) and their line elements (n, plans, 2; m)."""

LEAF = 250
"""Largest number of points of a cluster that is not halved further."""

APART = 2.0
"""Least distance of two clusters' boxes, divided by the larger half side, at which nodes replace the points."""

ORDER = 8
"""Number of nodes along a box's longer side. With `APART`, the relative error of Neumann's sum is 1e-6."""


PLAN_TOLERANCE = 1e-10
"""Largest difference (m, rad) between the coordinates of two layers' tracks at which their plans count as equal."""


def plan_numbers(layers: Sequence[Array]) -> list[int]:
    """Return the number of each layer's plan (its track's shape in x and y), counted from 0 in order of appearance.

    `layers` has one array (any shape; m, rad) per layer, with the coordinates of its track. Often every second layer
    has the same plan.
    """
    plans: list[Array] = []
    numbers = []
    for layer in layers:
        same = [k for k, plan in enumerate(plans)
                if plan.shape == layer.shape and np.all(np.abs(plan - layer) <= PLAN_TOLERANCE)]
        numbers += same[:1] or [len(plans)]
        plans += [] if same else [layer]
    return numbers


@record(eq=False)
class Plans:
    """Points on the distinct plans (track shapes in x and y) of a winding's layers.

    `places` (n, 2; m) are the points, `elements` (n, 2; m) their line elements and `owner` (n) their plan numbers.
    `layers` has (plan number, height of the mid-plane (m), thickness (m)) for every layer.
    """

    places: Array
    elements: Array
    owner: Index
    layers: tuple[tuple[int, float, float], ...]

    @property
    def count(self) -> int:
        """Number of distinct plans (no unit)."""
        return 1 + max(plan for plan, _, _ in self.layers)


@record(eq=False)
class Cluster:
    """Group of points in a box.

    `places` (n, 2; m) are the points. `elements` (n, plans, 2; m) are their line elements in each plan, 0 in plans to
    which a point does not belong. `centre` and `half` (2; m) are the centre and the half sides of the box.
    """

    places: Array
    elements: Array
    centre: Array
    half: Array

    @cached_property
    def parts(self) -> tuple[Cluster, ...]:
        """The cluster's two halves (m). Empty if the cluster has few points or all points coincide."""
        axis = int(self.half[1] > self.half[0])
        lower = self.places[:, axis] < self.centre[axis]
        if len(self.places) <= LEAF or lower.all() or not lower.any():
            return ()
        return _cluster(self.places[lower], self.elements[lower]), _cluster(self.places[~lower], self.elements[~lower])

    @cached_property
    def relative_positions(self) -> Points:
        """Points (n, 2; m) and line elements (n, plans, 2; m) that represent the cluster at a distance.

        The points are Chebyshev nodes of the box. Each original element is distributed over them by interpolation
        weights (Fong and Darve 2009). A cluster with fewer points than nodes keeps its own points.
        """
        counts = node_counts(self.half.tolist(), max(*self.half.tolist(), 1e-300), ORDER, APART)
        if math.prod(counts) >= len(self.places):
            return self.places, self.elements
        axes = [chebyshev_points(-1.0, 1.0, count) for count in counts]
        nodes = self.centre + self.half * np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        at = (self.places - self.centre) / np.maximum(self.half, 1e-300)
        x, y = (barycentric_weights(points, at[:, k]) for k, points in enumerate(axes))
        products = (x[:, :, None] * y[:, None, :]).reshape(len(at), -1)
        weighed = products.T @ self.elements.reshape(len(at), -1)
        return nodes, weighed.reshape(-1, *self.elements.shape[1:])


def neumann_sum(first: Plans, second: Plans) -> float:
    """Return Neumann's sum (m) of dp.dq / distance over all pairs of points of two windings on all their layers.

    For windings side by side, the relative error is 1e-6. Far clusters are interpolated (Fong and Darve 2009).

    Notes
    -----
    Each pair of layers counts at two height differences with weight 1/2. Together, they have the mean and the variance
    of the height difference between points in both thicknesses.
    """
    heights = _Heights(first, second)
    first_cluster, second_cluster = (_whole_cluster(plans) for plans in (first, second))
    return math.fsum(heights.sum(*pair) for pair in _pairs(first_cluster, second_cluster))


class _Heights:
    """Squared height differences (m2) between the layers of two windings, and fewer values that replace them."""

    def __init__(self, first: Plans, second: Plans) -> None:
        counts: dict[tuple[int, int, float], float] = {}
        for a, z, thickness in first.layers:
            for b, other, other_thickness in second.layers:
                deviation = math.sqrt((thickness**2 + other_thickness**2) / 12.0)
                for height in (abs(z - other) - deviation, abs(z - other) + deviation):
                    key = a, b, round(height * height, 18)
                    counts[key] = counts.get(key, 0.0) + 0.5
        self.squares = np.array(sorted({square for _, _, square in counts}))
        self.times = np.zeros((self.squares.size, first.count, second.count))
        for (a, b, square), times in counts.items():
            self.times[np.searchsorted(self.squares, square), a, b] += times
        self.known: dict[int, tuple[Array, Array]] = {}

    def nodes(self, apart: float) -> tuple[Array, Array]:
        """Return squared height differences (k; m2) between the layers of two windings, and multiplicities (no unit).

        The multiplicities (k, plans, plans) say how many pairs of layers with a plan of the first and a plan of the
        second winding have each height difference. If few interpolation nodes are enough, they replace the real
        differences. This depends on the least distance `apart` (m) in the plane between the points.
        """
        count = int(sufficient_node_counts(self.squares, np.array([apart]))[0])
        if count < self.squares.size:
            if count not in self.known:
                squares, weights = height_nodes(self.squares, count)
                self.known[count] = squares, np.tensordot(weights.T, self.times, 1)
            return self.known[count]
        return self.squares, self.times

    def sum(self, first: Points, second: Points, apart: float) -> float:
        """Return the sum (m) of dp.dq / distance over all pairs of points of two sets and all pairs of layers.

        Each set has points (n, 2; m) with line elements (n, plans, 2; m). The sets are at least `apart` (m) from each
        other.
        """
        middle = 0.5 * (first[0].mean(axis=0) + second[0].mean(axis=0))
        p, q, elements, other_elements = first[0] - middle, second[0] - middle, first[1], second[1]
        elements, other_elements = elements.reshape(len(p), -1), other_elements.reshape(len(q), -1)
        # squared distances as a single matrix product: (-2 p, p^2, 1) with (q, 1, q^2)
        rows = np.column_stack([-2.0 * p, np.sum(p * p, axis=1), np.ones(len(p))])
        square = rows @ np.vstack([q.T, np.ones(len(q)), np.sum(q * q, axis=1)])
        inverse, total = np.empty_like(square), 0.0
        for height, times in zip(*self.nodes(apart), strict=True):
            np.sqrt(np.add(square, height, out=inverse), out=inverse)
            np.divide(1.0, inverse, out=inverse)
            mutual = (elements.T @ (inverse @ other_elements)).reshape(*times.shape[:1], 2, times.shape[1], 2)
            total += float(np.sum((mutual[:, 0, :, 0] + mutual[:, 1, :, 1]) * times))
        return total


def _whole_cluster(plans: Plans) -> Cluster:
    """Return all points of a winding's plans (m) as one cluster.

    The line element of a point is at the index of its plan; the elements at other plans are 0.
    """
    elements = np.zeros((len(plans.places), plans.count, 2))
    elements[np.arange(len(plans.places)), plans.owner] = plans.elements
    return _cluster(plans.places, elements)


def _cluster(places: Array, elements: Array) -> Cluster:
    """Return points (n, 2; m) and line elements (n, plans, 2; m) as a cluster with its bounding box."""
    low, high = places.min(axis=0), places.max(axis=0)
    return Cluster(places, elements, 0.5 * (low + high), 0.5 * (high - low))


def _pairs(first: Cluster, second: Cluster) -> list[tuple[Points, Points, float]]:
    """Return pairs of point sets that together cover two clusters, and the least distance (m) of each pair.

    The distance is between the bounding boxes. For distant clusters, the sets are the nodes.
    """
    gaps = np.maximum(np.abs(first.centre - second.centre) - first.half - second.half, 0.0)
    size, other_size, gap = float(first.half.max()), float(second.half.max()), math.hypot(*gaps.tolist())
    if gap >= APART * max(size, other_size, 1e-300):
        return [(first.relative_positions, second.relative_positions, gap)]
    if not (first.parts or second.parts):
        return [((first.places, first.elements), (second.places, second.elements), gap)]
    if first.parts and (size >= other_size or not second.parts):
        return [pair for part in first.parts for pair in _pairs(part, second)]
    return [pair for part in second.parts for pair in _pairs(first, part)]
