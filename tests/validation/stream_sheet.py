"""Current of any frequency in flat tracks with corners of any angle, by a stream function on triangles.

The reference of polygons: no modes, no cuts, no filaments. The sheet current is the curl of a stream function that is 0
on the left edge of the track and 1 on the right one, linear on triangles, so it is free of sources everywhere and finds
its own way round every corner; it enters and leaves evenly, as nothing closes the circuit there (electrodes that are
equipotentials would: eddy currents through them double the loss at the ends). Resistance and inductance
are quadratic forms of it (magnetic energy by 1/distance over two triangles, mean over both thicknesses), so at direct
current the resistance falls towards the true one with every refinement. Through the thickness the current is even:
exact for direct current, and for copper thinner than the skin depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sitscad.kernels.electromagnetics.constants import MU0

NEAR, MIDDLE = 2.0, 6.0
"""Distances, in sizes of the larger triangle or in thicknesses, up to which one potential is closed or three points
stand for a triangle; beyond, one."""

LEVELS = 5

# Radon's seven points on a triangle (degree five): barycentric coordinates and weights.
_A, _B = (6.0 - math.sqrt(15.0)) / 21.0, (6.0 + math.sqrt(15.0)) / 21.0
_WA, _WB = (155.0 - math.sqrt(15.0)) / 1200.0, (155.0 + math.sqrt(15.0)) / 1200.0
SEVEN = np.array([(1 / 3, 1 / 3, 1 / 3), *((1 - 2 * a, a, a) for a in (_A, _B)), *((a, 1 - 2 * a, a) for a in (_A, _B)),
                  *((a, a, 1 - 2 * a) for a in (_A, _B))])
SEVEN_WEIGHTS = np.array([9 / 40, _WA, _WB, _WA, _WB, _WA, _WB])
THREE = np.array([(2 / 3, 1 / 6, 1 / 6), (1 / 6, 2 / 3, 1 / 6), (1 / 6, 1 / 6, 2 / 3)])


@dataclass(frozen=True)
class Sheet:
    """Nodes (n, 2) in metres, triangles (t, 3), the stream function of evenly spread current (n) and the nodes on the
    edges and at the ends, where it is given; cross-section and mid-plane (m).
    """

    nodes: np.ndarray
    triangles: np.ndarray
    even: np.ndarray
    fixed: np.ndarray
    thickness: float
    z: float


def spread(count, power=2.0):
    """Edges of `count` cells of [0, 1], narrow towards both ends: 2.0 crowds them like a parabola."""
    t = np.linspace(-1.0, 1.0, count + 1)
    return 0.5 + 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** power)


def sheet(corners, width, thickness, across, along, z=0.0, radius=0.0, pen=0):
    """The sheet of a track along straight sides (corners (n, 2), m), mitred where they meet.

    `across` cells share the width, `along` each half of a side (narrower towards corners: sizes go from the width's
    narrowest cell up). Corners are rounded with `radius` (m, of the centre line; half the width or more) where it is
    given. With `pen` the outer edge of a mitred corner is an arc in so many steps, as a round aperture draws it.
    """
    corners = np.asarray(corners, dtype=float)
    sides = np.diff(corners, axis=0)
    t = sides / np.hypot(*sides.T)[:, None]
    left = np.stack([-t[:, 1], t[:, 0]], axis=1)
    angles = np.arctan2(left[:-1, 0] * left[1:, 1] - left[:-1, 1] * left[1:, 0], np.sum(left[:-1] * left[1:], axis=1))
    v = spread(across)
    smallest = float(v[1] - v[0]) * width
    lines, last = [], len(sides) - 1
    for k, (a, b) in enumerate(pairwise(corners)):
        start = _edges(left[k], 0.0 if k == 0 or radius else float(angles[k - 1]), -1.0, pen)
        stop = _edges(left[k], 0.0 if k == last or radius else float(angles[k]), 1.0, pen)
        a = a + t[k] * (radius * math.tan(0.5 * abs(angles[k - 1])) if k > 0 else 0.0)
        b = b - t[k] * (radius * math.tan(0.5 * abs(angles[k])) if k < last else 0.0)
        u = _graded(float(np.hypot(*(b - a))), smallest, along)
        for s in u if k == 0 else u[1:]:
            centre, offset = (1.0 - s) * a + s * b, 0.5 * width * ((1.0 - s) * start + s * stop)
            lines.append((centre + offset[0], centre + offset[1]))
        if k < last and radius:
            lines += _arc(b, left[k], float(angles[k]), radius, width, 2 * along)
        elif k < last and pen:
            lines[-1:] = _fan(b, left[k], float(angles[k]), _joint(left[k], left[k + 1]), width, pen)
    return _meshed(np.array(lines), v, thickness, z)


def _edges(left, turn, end, pen):
    # Where a side's left and right edges begin (end -1) or end (+1), in half widths from the centre line: mitred at a
    # turn, with a pen on its inside alone.
    mitre = left - end * math.tan(0.5 * turn) * np.array([left[1], -left[0]])
    square = left if pen else mitre
    return np.array([mitre if turn > 0.0 else square, -(square if turn > 0.0 else mitre)])


def _turned(vector, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def _arc(start, left, angle, radius, width, steps):
    inner = math.copysign(1.0, angle)
    centre, result = start + inner * radius * left, []
    for k in range(1, steps + 1):
        normal = _turned(left, angle * k / steps)
        at = centre - inner * radius * normal
        result.append((at + 0.5 * width * normal, at - 0.5 * width * normal))
    return result


def _fan(corner, left, angle, mitre, width, steps):
    # A round pen about the centre line's corner leaves a sharp corner inside and an arc of half a width outside.
    inner = math.copysign(1.0, angle)
    pivot, result = corner + inner * 0.5 * width * mitre, []
    for k in range(steps + 1):
        outer = corner - inner * 0.5 * width * _turned(left, angle * k / steps)
        result.append((pivot, outer) if inner > 0.0 else (outer, pivot))
    return result


def _graded(length, smallest, along):
    # Fractions along a side: cells grow geometrically from both ends.
    half, low, high = 0.5 * length, 1.0 + 1e-9, 50.0
    first = min(smallest, half / along)
    for _ in range(200):
        ratio = math.sqrt(low * high)
        low, high = (ratio, high) if first * (ratio**along - 1.0) / (ratio - 1.0) < half else (low, ratio)
    steps = ratio ** np.arange(along)
    edges = np.concatenate([[0.0], np.cumsum(steps) / np.sum(steps)]) * 0.5
    return np.concatenate([edges, (1.0 - edges[:-1])[::-1]])


def _joint(one, other):
    return (one + other) / (1.0 + float(one @ other))


def _meshed(lines, v, thickness, z):
    count, rows = len(v), len(lines)
    nodes = lines[:, 0, None] + v[:, None] * (lines[:, 1] - lines[:, 0])[:, None]
    number = np.arange(rows * count).reshape(rows, count)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    # diagonals by turns, so that the mesh has no hand
    turn = ((np.arange(rows - 1)[:, None] + np.arange(count - 1)) % 2).ravel().astype(bool)
    first = np.where(turn[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(turn[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    triangles = np.concatenate([first, second])
    flat = nodes.reshape(-1, 2)
    areas = np.abs(_areas(flat, triangles))
    edges = np.unique(np.concatenate([number[:, 0], number[:, -1], number[0], number[-1]]))
    return Sheet(flat, triangles[areas > 1e-9 * areas.max()], np.tile(v, rows), edges, thickness, z)


def _areas(nodes, triangles):
    p, q, r = (nodes[triangles[:, k]] for k in range(3))
    return 0.5 * ((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))


def gradients(one):
    """Gradients (t, 3, 2) of a triangle's three linear functions, and areas (t)."""
    p = one.nodes[one.triangles]
    signed = _areas(one.nodes, one.triangles)
    opposite = np.roll(p, -2, axis=1) - np.roll(p, -1, axis=1)
    return np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1) / (2.0 * signed)[:, None, None], np.abs(signed)


def scattered(one, table, columns):
    """Sum of the rows (t, 3) of triangles into nodes."""
    result = np.zeros((len(one.nodes), columns))
    for k in range(3):
        np.add.at(result, one.triangles[:, k], table[:, k])
    return result


def resistance_matrix(one, conductivity):
    """R between the stream function's values at nodes (ohm)."""
    slope, area = gradients(one)
    local = np.einsum("tid,tjd->tij", slope, slope) * (area / (conductivity * one.thickness))[:, None, None]
    result = np.zeros((len(one.nodes), len(one.nodes)))
    for i in range(3):
        for j in range(3):
            np.add.at(result, (one.triangles[:, i], one.triangles[:, j]), local[:, i, j])
    return result


def inductance_matrix(one, other):
    """L between the stream function's values at the nodes of two sheets (H)."""
    first, second = gradients(one)[0], gradients(other)[0]
    total = np.zeros((len(one.nodes), len(other.nodes)))
    kernel = inverse_distances(one, other)
    for axis in range(2):
        spread_out = np.zeros((len(other.nodes), len(other.triangles)))
        for k in range(3):
            spread_out[other.triangles[:, k], np.arange(len(other.triangles))] = second[:, k, axis]
        half = spread_out @ kernel.T
        for k in range(3):
            np.add.at(total, one.triangles[:, k], first[:, k, axis, None] * half.T)
    return MU0 / (4.0 * math.pi) * total


def inverse_distances(one, other):
    """Integral of 1 / distance over two triangles, mean over both thicknesses (t, t'; m3)."""
    p, q = one.nodes[one.triangles], other.nodes[other.triangles]
    areas = np.abs(_areas(one.nodes, one.triangles)), np.abs(_areas(other.nodes, other.triangles))
    size = [np.max(np.hypot(*np.moveaxis(x - np.roll(x, 1, axis=1), -1, 0)), axis=1) for x in (p, q)]
    height, squared = abs(one.z - other.z), (one.thickness**2 + other.thickness**2) / 12.0 + (one.z - other.z) ** 2
    least = 2.0 * max(one.thickness, other.thickness) if height == 0.0 else 0.0
    result = np.empty((len(p), len(q)))
    levels = _levels(one.thickness, other.thickness, height)
    for low in range(0, len(p), 200):
        rows = slice(low, min(low + 200, len(p)))
        apart = np.sqrt(_squares(p[rows].mean(axis=1), q.mean(axis=1)) + height**2)
        large = np.maximum(np.maximum(size[0][rows, None], size[1]), least)
        block = 1.0 / np.sqrt(apart**2 - height**2 + squared)
        i, j = np.nonzero(apart < MIDDLE * large)
        block[i, j] = _three(p[rows][i], q[j], squared)
        i, j = np.nonzero(apart < NEAR * large)
        block[i, j] = _closed(p[rows][i], q[j], levels) / areas[1][j]
        result[rows] = block * areas[0][rows, None] * areas[1]
    return 0.5 * (result + result.T) if one is other else result


def _squares(a, b):
    return (a[:, None, 0] - b[:, 0]) ** 2 + (a[:, None, 1] - b[:, 1]) ** 2


def _three(p, q, squared):
    a, b = np.einsum("nk,tkd->tnd", THREE, p), np.einsum("nk,tkd->tnd", THREE, q)
    total = 0.0
    for i in range(3):
        for j in range(3):
            total = total + 1.0 / np.sqrt(np.sum((a[:, i] - b[:, j]) ** 2, axis=1) + squared)
    return total / 9.0


def _levels(t1, t2, height):
    # Distances of two heights, one in each thickness, and their weights: crowded at zero for one layer.
    x, w = np.polynomial.legendre.leggauss(LEVELS)
    if height == 0.0:
        u = 0.5 * (1.0 + x)
        return [(t1 * v**2, c * v * 2.0 * (1.0 - v**2)) for v, c in zip(u, w, strict=True)]
    x, w = np.polynomial.legendre.leggauss(2)
    return [(abs(height + 0.5 * t1 * a + 0.5 * t2 * b), 0.25 * c * d)
            for a, c in zip(x, w, strict=True) for b, d in zip(x, w, strict=True)]


def _closed(p, q, levels):
    # Mean over the first triangle of the second's potential.
    total = np.zeros(len(p))
    for low in range(0, len(p), 4000):
        part = slice(low, low + 4000)
        points = np.einsum("nk,tkd->tnd", SEVEN, p[part])
        for height, weight in levels:
            total[part] += weight * (_potential(points, q[part], height) @ SEVEN_WEIGHTS)
    return total


def _potential(points, q, height):
    # Integral of 1/R over triangles (t, 3, 2) at points (t, n, 2) of a plane `height` above (Wilton and others 1984).
    sign = np.sign(_areas(q.reshape(-1, 2), np.arange(3 * len(q)).reshape(-1, 3)))
    total = 0.0
    for k in range(3):
        start, stop = q[:, k], q[:, (k + 1) % 3]
        edge = stop - start
        length = np.hypot(*edge.T)
        t = edge / length[:, None]
        away = start[:, None] - points
        low = away[..., 0] * t[:, None, 0] + away[..., 1] * t[:, None, 1]
        high = low + length[:, None]
        out = (away[..., 0] * t[:, None, 1] - away[..., 1] * t[:, None, 0]) * sign[:, None]
        square = out**2 + height**2 + 1e-18 * length[:, None] ** 2
        near, far = np.sqrt(low**2 + square), np.sqrt(high**2 + square)
        root = np.sqrt(square)
        total = total + out * (np.arcsinh(high / root) - np.arcsinh(low / root))
        if height:
            total = total - height * (np.arctan2(out * high, square + height * far)
                                      - np.arctan2(out * low, square + height * near))
    return total


@dataclass(frozen=True)
class Solved:
    """Impedances (ohm) at frequencies, and inductance (H) of evenly spread and of direct current."""

    impedances: np.ndarray
    even: float
    direct: float
    resistance: float


def solved(sheets, conductivity, frequencies, mirror=None):
    """Sheets in series (one layer after the other, all in the same sense of the current), any frequencies (Hz).

    `mirror` is the distance (m) of a perfect conductor above z = 0, None without one.
    """
    sizes = np.cumsum([0, *(len(s.nodes) for s in sheets)])
    l = np.empty((sizes[-1], sizes[-1]))
    r = np.zeros_like(l)
    for i, item in enumerate(sheets):
        rows = slice(sizes[i], sizes[i + 1])
        r[rows, rows] = resistance_matrix(item, conductivity)
        for j, other in enumerate(sheets[: i + 1]):
            columns = slice(sizes[j], sizes[j + 1])
            block = inductance_matrix(item, other)
            if mirror is not None:
                image = Sheet(other.nodes, other.triangles, other.even, other.fixed, other.thickness,
                              2.0 * mirror - other.z)
                block = block - inductance_matrix(item, image)
            l[rows, columns] = block
            l[columns, rows] = block.T
    even = np.concatenate([s.even for s in sheets])
    free = np.ones(len(even), dtype=bool)
    for k, s in enumerate(sheets):
        free[sizes[k] + s.fixed] = False
    direct = even.copy()
    direct[free] -= np.linalg.solve(r[np.ix_(free, free)], (r @ even)[free])
    result = []
    for f in frequencies:
        z = r + 2j * math.pi * f * l
        drive = z @ direct
        result.append(direct @ drive - drive[free] @ np.linalg.solve(z[np.ix_(free, free)], drive[free]))
    return Solved(np.array(result), float(even @ l @ even), float(direct @ l @ direct), float(direct @ r @ direct))
