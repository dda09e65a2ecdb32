"""The yardstick for windows: a perfectly conducting slab with a rectangular hole right through it, under round coils.

All of its surface carries current, walls of the hole included: the curl of a stream function, bilinear on rectangles
that crowd at the edges, and one current more that runs round the hole. Their strengths are those of least energy
(Galerkin), so what the slab takes from the coil's inductance grows towards the truth with every refinement. Energies
are those of even currents by 1/distance over pairs of rectangles. It shares nothing with the package's openings, which
solve for the field in the mouths of the hole in an endless slab.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sparse
from scipy.special import ellipe, ellipkm1

MU0 = 4e-7 * np.pi
POINTS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


def lines(stops, most, edge):
    """Places from the first of the stops to the last, intervals `most` wide at most and `edge` at every stop (m)."""
    result = [stops[:1]]
    for a, b in pairwise(stops):
        count = 2 * int(np.ceil(0.5 * max(np.pi / 2 * (b - a) / most, np.pi / 2 * np.sqrt((b - a) / edge))))
        count = max(count, 4)
        result.append(0.5 * (a + b) - 0.5 * (b - a) * np.cos(np.pi * np.arange(1, count + 1) / count))
    return np.concatenate(result)


class Mesh:
    """Rectangles on the slab's surface, lower face at z = 0: middles, half sides, numbers of their nodes."""

    def __init__(self, size, thickness, opening, most, edge, is_open):
        x, y = (
            lines(np.array([-0.5 * s, -0.5 * o, 0.5 * o, 0.5 * s]), most, edge)
            for s, o in zip(size, opening, strict=True)
        )
        z = lines(np.array([0.0, thickness]), most, edge)
        self.numbers, self.parts, self.walls = {}, [], []
        hole = [np.flatnonzero(np.abs(item) <= 0.5 * o + 1e-9) for item, o in zip((x, y), opening, strict=True)]
        for height, sign in ((z[-1], 1), (z[0], -1)):
            for i in range(len(x) - 1):
                for j in range(len(y) - 1):
                    if not (is_open and i in hole[0][:-1] and j in hole[1][:-1]):
                        self._add((x[i], x[i + 1]), (y[j], y[j + 1]), (height, height), 2, sign)
        spans = [(np.arange(len(x)), np.arange(len(y)), 1)] + [(hole[0], hole[1], -1)] * is_open
        for along_x, along_y, sign in spans:
            for end, out in ((0, -sign), (-1, sign)):
                for k in range(len(z) - 1):
                    up = z[k], z[k + 1]
                    for j in along_y[:-1]:
                        self._add((x[along_x[end]],) * 2, (y[j], y[j + 1]), up, 0, out, sign < 0)
                    for i in along_x[:-1]:
                        self._add((x[i], x[i + 1]), (y[along_y[end]],) * 2, up, 1, out, sign < 0)
        rows = [np.array(part, dtype=float) for part in zip(*self.parts, strict=True)]
        self.middles, self.halves, self.axis, self.nodes, self.slopes = rows
        self.axis, self.nodes = self.axis.astype(int), self.nodes.astype(int)
        self.thickness = thickness

    def _add(self, x, y, z, normal, sign, is_wall=False):
        ends = np.array([x, y, z])
        middle, half = ends.mean(axis=1), 0.5 * (ends[:, 1] - ends[:, 0])
        u, v = [axis for axis in range(3) if axis != normal]
        nodes, slopes = [], []
        out = np.zeros(3)
        out[normal] = sign
        for su in (0, 1):
            for sv in (0, 1):
                corner = ends[:, 0].copy()
                corner[u], corner[v] = ends[u, su], ends[v, sv]
                key = tuple(np.round(corner * 1e9).astype(int))
                nodes.append(self.numbers.setdefault(key, len(self.numbers)))
                slope = np.zeros(3)
                slope[u], slope[v] = (su - 0.5) / (2 * half[u]), (sv - 0.5) / (2 * half[v])
                slopes.append(np.cross(out, slope))
        if is_wall:
            self.walls.append((len(self.parts), np.cross(out, [0.0, 0.0, 1.0])))
        self.parts.append((middle, half, normal, nodes, slopes))

    def currents(self):
        """Sheet current (A/m) along x, y and z on every rectangle by the strength of every function."""
        count, rows = len(self.middles), np.repeat(np.arange(len(self.middles)), 4)
        result = []
        for c in range(3):
            flow = sparse.csr_matrix(
                (self.slopes[:, :, c].ravel(), (rows, self.nodes.ravel())), shape=(count, len(self.numbers))
            ).toarray()[:, 1:]  # the function's level is free
            if self.walls:
                once = np.zeros((count, 1))
                for row, way in self.walls:
                    once[row] = way[c] / self.thickness
                flow = np.hstack((flow, once))
            result.append(flow)
        return result

    def points(self):
        """Two by two Gauss points of every rectangle: (4, n, 3)."""
        result = []
        for s in POINTS:
            for t in POINTS:
                step = np.zeros_like(self.middles)
                for axis in range(3):
                    of = self.axis == axis
                    u, v = [other for other in range(3) if other != axis]
                    step[of, u], step[of, v] = s * self.halves[of, u], t * self.halves[of, v]
                result.append(self.middles + step)
        return np.array(result)

    def areas(self):
        """Areas (m2)."""
        sides = np.where(np.arange(3) == self.axis[:, None], 1.0, 2.0 * self.halves)
        return sides.prod(axis=1)


def pull(mesh, points):
    """Integral of 1/distance over every rectangle, at points (n, 3): (n, rectangles)."""
    result = np.empty((len(points), len(mesh.middles)))
    for axis in range(3):
        of = np.flatnonzero(mesh.axis == axis)
        u, v = [other for other in range(3) if other != axis]
        away = points[:, None] - mesh.middles[of]
        total = 0.0
        for su in (-1, 1):
            for sv in (-1, 1):
                a, b = away[..., u] + su * mesh.halves[of, u], away[..., v] + sv * mesh.halves[of, v]
                c = away[..., axis]
                r = np.sqrt(a * a + b * b + c * c) + 1e-15
                part = a * np.arcsinh(b / np.sqrt(a * a + c * c + 1e-30))
                part += b * np.arcsinh(a / np.sqrt(b * b + c * c + 1e-30))
                part -= np.abs(c) * np.arctan2(a * b, np.abs(c) * r)
                total = total + su * sv * part
        result[:, of] = total
    return result


def potential(points, radii, heights, turns):
    """Vector potential (Wb/m) along x and y at points (n, 3) of rings about the z axis with 1 A a turn."""
    rho = np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-12)[:, None]
    z = points[:, 2][:, None] - heights
    far = (radii + rho) ** 2 + z**2
    rest = ((radii - rho) ** 2 + z**2) / far
    k, e = ellipkm1(rest), ellipe(1.0 - rest)
    round_axis = MU0 / (2 * np.pi) * np.sqrt(far) / rho * ((0.5 + 0.5 * rest) * k - e)
    total = (round_axis * turns).sum(axis=1) / rho[:, 0]
    return np.stack((-points[:, 1] * total, points[:, 0] * total))


def slab_change(size, thickness, opening, offset, radii, heights, gap, most, edge, roof=None, is_open=True):
    """Change of inductance (H) of rings (all 1 turn, z = 0 and above) by the slab, its face `gap` below z = 0.

    `offset` (2,; m) is the coil's place from the hole's middle, `roof` (m) the height of a perfect mirror over the
    coil, there before and after. `most` and `edge` (m) are the rectangles' sides at most and at edges; without
    `is_open` the slab is whole.
    """
    mesh = Mesh(size, thickness, opening, most, edge, is_open)
    flows, points = mesh.currents(), mesh.points()
    turns, up = np.ones(len(radii)), gap + np.asarray(heights)
    ways = [1.0, 1.0, 1.0]
    near = sum(pull(mesh, item) for item in points) / 4.0
    far = 0.0
    if roof is not None:
        level = 2.0 * (gap + roof)
        flipped = [np.array([0.0, 0.0, level]) + item * [1.0, 1.0, -1.0] for item in points]
        far = sum(pull(mesh, item) for item in flipped) / 4.0
        radii, turns = np.tile(radii, 2), np.concatenate((turns, -turns))
        up, ways = np.concatenate((up, level - up)), [-1.0, -1.0, 1.0]
    area = mesh.areas()[:, None]
    # the slab hangs upside down: its face at z = 0 is the one that looks at the coil, so that depth counts upwards
    energy = sum(
        flow.T @ (area * ((near + way * far) @ flow)) for flow, way in zip(flows, ways, strict=True)
    ) * (MU0 / (4 * np.pi))
    seen = [potential(item * [1.0, 1.0, -1.0] - [*offset, 0.0], radii, up, turns) for item in points]
    along = sum(seen) / 4.0
    drive = flows[0].T @ (area[:, 0] * along[0]) + flows[1].T @ (area[:, 0] * along[1])
    return -float(drive @ np.linalg.solve(0.5 * (energy + energy.T), drive))
