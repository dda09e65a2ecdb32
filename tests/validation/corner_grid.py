"""Alternating current in a track with right-angled corners, by a grid of cells: no modes, no cuts, no filaments.

The track is cut into rectangular cells, narrow towards its edges and towards corners; current flows between the
centres of neighbouring cells along x and along y, so it finds its own way round every corner (partial elements of a
sheet, Ruehli 1974). It is even through the thickness: the copper must be thinner than the skin depth. Resistances and
partial inductances of rectangles are closed; Kirchhoff's laws do the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from filament_reference import cosine_cells

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.mean_distance import gauss

NEAR = 6.0
"""Distance, in sizes of the larger of two pieces or in thicknesses, up to which both thicknesses are integrated."""


@dataclass(frozen=True)
class Grid:
    """Cells (n, 4): x and y from, to (m); neighbours (k, 2) along x and along y; the cells at either end."""

    cells: np.ndarray
    along_x: np.ndarray
    along_y: np.ndarray
    first: np.ndarray
    last: np.ndarray


def _spread(count):
    # Edges of cells of [0, 1], narrow towards both ends.
    centres, sizes = cosine_cells(count)
    return np.concatenate([centres - 0.5 * sizes, [0.5]]) + 0.5


def grid(corners, width, across, along):
    """The cells of a track along axis-parallel sides (corners (n, 2), m): so many across it and along every side."""
    edges = (_spread(across) - 0.5) * width
    blocks = []
    for k, (a, b) in enumerate(pairwise(np.asarray(corners))):
        way = np.sign(b - a)
        start = a if k == 0 else a + 0.5 * width * way
        stop = b if k == len(corners) - 2 else b - 0.5 * width * way
        lengthwise = _spread(along)
        if abs(way[0]) > 0.5:
            blocks.append((np.sort(start[0] + (stop[0] - start[0]) * lengthwise), a[1] + edges))
        else:
            blocks.append((a[0] + edges, np.sort(start[1] + (stop[1] - start[1]) * lengthwise)))
        if k < len(corners) - 2:
            blocks.append((b[0] + edges, b[1] + edges))
    return _joined(blocks, corners)


def _joined(blocks, corners):
    cells, owner = [], []
    for number, (x, y) in enumerate(blocks):
        for x0, x1 in pairwise(x):
            for y0, y1 in pairwise(y):
                cells.append((x0, x1, y0, y1))
                owner.append(number)
    cells, owner = np.array(cells), np.array(owner)
    near = np.abs(owner[:, None] - owner) <= 1
    step = 1e-6 * float(np.min(np.diff(cells[:, :2])))

    def touching(low, high, other_low, other_high):
        result = near & (np.abs(cells[:, None, high] - cells[:, low]) < step)
        result &= np.abs(cells[:, None, other_low] - cells[:, other_low]) < step
        return np.argwhere(result & (np.abs(cells[:, None, other_high] - cells[:, other_high]) < step))

    ends = []
    for end, block, beyond in ((corners[0], 0, corners[1]), (corners[-1], len(blocks) - 1, corners[-2])):
        axis = 0 if abs(beyond[0] - end[0]) > abs(beyond[1] - end[1]) else 1
        distance = np.min(np.abs(cells[:, 2 * axis : 2 * axis + 2] - end[axis]), axis=1)
        ends.append(np.nonzero((owner == block) & (distance < step))[0])
    return Grid(cells, touching(0, 1, 2, 3), touching(2, 3, 0, 1), *ends)


def impedance(corners, width, thickness, conductivity, frequencies, across, along, mirror=None):
    """Impedance (ohm) of the track between its ends at every frequency (Hz).

    `mirror` is the distance (m) of a perfect conductor from the track's mid-plane, None without one.
    """
    net = grid(corners, width, across, along)
    centre = 0.5 * np.stack([net.cells[:, 0] + net.cells[:, 1], net.cells[:, 2] + net.cells[:, 3]], axis=1)
    count = len(net.cells)
    parts = []
    for axis, pairs in ((0, net.along_x), (1, net.along_y)):
        pieces = [_piece(axis, centre[i], centre[j], net.cells[i]) for i, j in pairs]
        nodes = [tuple(pair) for pair in pairs]
        # half a cell leads from each terminal to the first cells, and from the last ones
        for cells, corner, beyond, terminal in ((net.first, corners[0], corners[1], count),
                                                (net.last, corners[-1], corners[-2], count + 1)):
            if abs(beyond[axis] - corner[axis]) > abs(beyond[1 - axis] - corner[1 - axis]):
                for cell in cells:
                    edge = centre[cell].copy()
                    edge[axis] = corner[axis]
                    low = edge[axis] < centre[cell, axis]
                    pieces.append(_piece(axis, *((edge, centre[cell]) if low else (centre[cell], edge)),
                                         net.cells[cell]))
                    nodes.append((terminal, cell) if low else (cell, terminal))
        parts.append((np.array(pieces), np.array(nodes)))
    matrices = [(_resistances(p, axis, thickness, conductivity), _inductances(p, axis, thickness, mirror))
                for axis, (p, _) in enumerate(parts)]
    return np.array([_solved(parts, matrices, 2.0 * math.pi * f, count) for f in frequencies])


def _piece(axis, start, stop, cell):
    # Rectangle (x from, to, y from, to) from one centre to the next, as wide as the cell.
    return (start[0], stop[0], cell[2], cell[3]) if axis == 0 else (cell[0], cell[1], start[1], stop[1])


def _resistances(pieces, axis, thickness, conductivity):
    x, y = pieces[:, 1] - pieces[:, 0], pieces[:, 3] - pieces[:, 2]
    length, wide = (x, y) if axis == 0 else (y, x)
    return length / (conductivity * wide * thickness)


def _solved(parts, matrices, omega, count):
    # Voltages of all cells at a unit current from the first terminal to the last, which is at zero.
    admittance = np.zeros((count + 2, count + 2), dtype=complex)
    for (_, nodes), (resistance, inductance) in zip(parts, matrices, strict=True):
        incidence = np.zeros((len(nodes), count + 2))
        rows = np.arange(len(nodes))
        incidence[rows, nodes[:, 0]], incidence[rows, nodes[:, 1]] = 1.0, -1.0
        branches = np.linalg.solve(np.diag(resistance) + 1j * omega * inductance, incidence)
        for sign, column in ((1.0, 0), (-1.0, 1)):
            np.add.at(admittance, nodes[:, column], sign * branches)
    drive = np.zeros(count + 1)
    drive[count] = 1.0
    return np.linalg.solve(admittance[:-1, :-1], drive)[count]


def _inductances(pieces, axis, thickness, mirror):
    count = len(pieces)
    total = np.empty((count, count))
    x, y = (pieces[:, 1] - pieces[:, 0]), (pieces[:, 3] - pieces[:, 2])
    wide = y if axis == 0 else x
    middle = np.stack([0.5 * (pieces[:, 0] + pieces[:, 1]), 0.5 * (pieces[:, 2] + pieces[:, 3])], axis=1)
    size = np.maximum(np.maximum(x, y), thickness)
    heights = _heights(thickness)
    for low in range(0, count, 200):
        rows = np.arange(low, min(low + 200, count))
        apart = np.hypot(*(middle[rows, None] - middle).T).T
        near = apart < NEAR * np.maximum(size[rows, None], size)
        i, j = np.nonzero(near)
        block = _rectangles(pieces[rows][:, None], pieces[None], thickness / math.sqrt(6.0))
        block[i, j] = sum(w * _rectangles(pieces[rows[i]], pieces[j], h) for h, w in heights)
        if mirror is not None:
            block -= _rectangles(pieces[rows][:, None], pieces[None], 2.0 * mirror)
        total[rows] = block / (wide[rows, None] * wide)
    return 0.5 * MU0 / (4.0 * math.pi) * (total + total.T)


def _heights(thickness, count=6):
    # Distances of two heights in one thickness and their weights: crowded at zero.
    nodes, weights = gauss(count)
    u = 0.5 * (1.0 + nodes)
    return [(thickness * v**2, w * v * 2.0 * (1.0 - v**2)) for v, w in zip(u, weights, strict=True)]


def _rectangles(one, other, height):
    """Integral of 1 / distance over two rectangles in planes `height` apart: closed fourth integrals at 16 corners."""
    total = 0.0
    for i, p in ((0, -1.0), (1, 1.0)):
        for j, q in ((0, -1.0), (1, 1.0)):
            x = other[..., j] - one[..., i]
            for k, r in ((2, -1.0), (3, 1.0)):
                for m, s in ((2, -1.0), (3, 1.0)):
                    total = total + p * q * r * s * _fourth(x, other[..., m] - one[..., k], height)
    return total


def _fourth(x, y, h):
    distance = np.sqrt(x * x + y * y + h * h)
    result = 0.5 * (x * x - h * h) * y * np.arcsinh(y / np.sqrt(x * x + h * h))
    result += 0.5 * (y * y - h * h) * x * np.arcsinh(x / np.sqrt(y * y + h * h))
    result -= (x * x - 2.0 * h * h + y * y) * distance / 6.0
    return result - x * y * h * np.arctan(x * y / (h * distance))
