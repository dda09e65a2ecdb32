"""A body that two planes mirror: what its currents return to each other, worked out on a quarter of it.

Currents whose stream function is even or odd across a plane x = 0 or y = 0 are known on one side of it from the other,
and a level mirror returns them alike. So sums over pairs of points are sums over pairs of a quarter's, with the inverse
distances to a point and its mirrored ones added up with their signs first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array, Index
from sitscad.physics.eddy.surface import Surface
from sitscad.record import record


@record(eq=False)
class Folding:
    """The points of a quarter, (4, n) by their numbers on the surface: themselves, mirrored across x = 0, across y = 0
    and across both; `share` (n) is the square root of how many points that is, for those in a plane are their own.
    """

    numbers: Index
    share: Array

    @property
    def kept(self) -> Index:
        """The quarter's own points (n), by number."""
        return np.asarray(self.numbers[0])

    def kernels(self, points: Array, floor: float) -> Array:
        """Inverse distances (1/m) of the points (all, 3; m) to images below z = `floor` (m), by which of their mirrored
        ones they are the images of: (4, n, n), points in a plane by their share.
        """
        shares = 0.25 * self.share[:, None] * self.share
        return np.stack([shares * inverse_distance(points[self.kept], points[one], floor) for one in self.numbers])


def folding(surface: Surface) -> Folding | None:
    """That of a surface; None of one without such planes, or whose currents are parted otherwise."""
    mirrored = surface.mirrored
    if mirrored is None:
        return None
    across_x, across_y = mirrored
    all_four = np.stack([np.arange(len(across_x)), across_x, across_y, across_y[across_x]])
    numbers = all_four[:, np.min(all_four, axis=0) == all_four[0]]  # each point stands with the least of its numbers
    members = 1 + np.sum(np.diff(np.sort(numbers, axis=0), axis=0) != 0, axis=0)
    return Folding(numbers, np.sqrt(members))


def signs(parity: tuple[int, int]) -> Array:
    """Of currents whose stream function has a parity along x and y: each component at a point's mirrored ones, in parts
    of that at the point, (4, 3). Currents are at right angles to how the stream function climbs: along x they are like
    it across x = 0 and unlike it across y = 0.
    """
    x, y = parity
    across_x, across_y = np.array([x, -x, -x], dtype=float), np.array([-y, y, -y], dtype=float)
    return np.stack([np.ones(3), across_x, across_y, across_x * across_y])


def by_axis(kernels: Array, parity: tuple[int, int]) -> Sequence[Array]:
    """Of the `Folding.kernels` the sums (1/m) for the x, y and z components of currents of a parity: (n, n) each."""
    return list(np.tensordot(signs(parity).T, kernels, axes=1))


def inverse_distance(points: Array, others: Array, floor: float) -> Array:
    """1 over the distance (m) of points (n, 3) from the images of others (m, 3) below z = `floor`, (n, m) in 1/m."""
    image = others * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2.0 * floor])
    square = np.zeros((len(points), len(image)))
    for axis in range(3):
        away = points[:, None, axis] - image[:, axis]
        square += away * away
    return np.asarray(1.0 / np.sqrt(square))
