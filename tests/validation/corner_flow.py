"""What direct current does at a corner more than even current, from the conformal map of a bent strip.

`python tests/validation/corner_flow.py` writes the tables of `sitscad/physics/corners.py`. The mesh follows the flow: its
lines are stream lines and equipotentials, so the stream function of direct current is exact at every node, and cells
shrink towards the inner corner by themselves. All lengths in widths of the track, inductances in mu0 times it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from stream_sheet import Sheet, inductance_matrix

from sitscad.physics.constants import MU0

ARM = 9.0
"""Length of the arms, in widths; what lies beyond is added as a filament."""


@dataclass(frozen=True)
class Flow:
    """A corner at the origin that turns left out of +x: its sheet and what direct current has more there (n)."""

    sheet: Sheet
    excess: np.ndarray
    turn: float

    @property
    def inwards(self):
        """Unit vectors along the bisector, to the inside, and across it."""
        u = np.array([-math.sin(0.5 * self.turn), math.cos(0.5 * self.turn)])
        return u, np.array([u[1], -u[0]])


def flow(turn, aspect, cells):
    """A strip of unit width that turns by `turn` (rad), thickness `aspect`, so many cells across it."""
    a = turn / math.pi
    eta = math.pi * (0.5 - 0.5 * np.cos(math.pi * np.arange(cells + 1) / cells))
    near = np.arange(0.0, 3.0, 2.2 / cells)
    far = 3.0 + (math.pi * ARM - 3.0) * np.linspace(0.0, 1.0, round(1.6 * cells))[0:] ** 2
    xi = np.concatenate([near[near < 2.9], far])
    half = np.array([_column(x, eta, a) for x in xi])
    inwards = -(half - half[0, 0])  # inner corner at the origin for now, the way in along +x
    outwards = np.exp(1j * (math.pi + turn)) * np.conj(inwards)  # mirrored at the bisector
    nodes = np.concatenate([inwards[:0:-1], outwards])
    middle = 0.5 * (nodes[len(xi) - 1, 0] + nodes[len(xi) - 1, -1])
    nodes = nodes - middle
    flat = np.stack([nodes.real.ravel(), nodes.imag.ravel()], axis=1)
    direct = np.tile(eta / math.pi, len(nodes))
    even = _even(flat, turn)
    rows, count = nodes.shape
    number = np.arange(rows * count).reshape(rows, count)
    p, q, r, s = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    turns = ((np.arange(rows - 1)[:, None] + np.arange(count - 1)) % 2).ravel().astype(bool)[:, None]
    first = np.where(turns, np.stack([p, q, r], axis=1), np.stack([p, q, s], axis=1))
    second = np.where(turns, np.stack([p, r, s], axis=1), np.stack([q, r, s], axis=1))
    edges = np.concatenate([number[:, 0], number[:, -1]])
    one = Sheet(flat, np.concatenate([first, second]), even, edges, aspect, 0.0)
    return Flow(one, direct - even, turn)


def _column(xi, eta, a):
    # z(xi + i eta) for dz/du = tanh(u/2)^a / pi * width: from the middle of the strip down and up.
    start = _integral(0.5j * math.pi, xi + 0.5j * math.pi, a)
    return np.array([start + _integral(xi + 0.5j * math.pi, xi + 1j * e, a) for e in eta])


def _integral(low, high, a):
    # Points crowd towards the far end, where a corner may be.
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t = 0.5 * (1.0 + nodes)
    panels = max(1, math.ceil(abs(high - low) / 2.0))
    total = 0.0
    for k in range(panels):
        start, step = low + (high - low) * k / panels, (high - low) / panels
        u = start + step * (1.0 - (1.0 - t) ** 6)
        total = total + np.sum(0.5 * weights * 6.0 * (1.0 - t) ** 5 * step * np.tanh(0.5 * u) ** a)
    return total / math.pi


def _even(points, turn):
    # Offsets from the left edge: of the arm on whose side of the bisector a point lies.
    u = np.array([-math.sin(0.5 * turn), math.cos(0.5 * turn)])
    left_of = points @ np.array([-u[1], u[0]])  # towards the way in when positive
    way_in = points[:, 1]
    way_out = points @ np.array([-math.sin(turn), math.cos(turn)])
    return np.clip(0.5 - np.where(left_of > 0.0, way_in, way_out), 0.0, 1.0)
