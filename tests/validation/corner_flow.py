"""What direct current does at a corner more than even current, from the conformal map of a bent strip.

`python tests/validation/corner_flow.py` prints the tables of `sitscad/kernels/electromagnetics/loss/corner_excess.py`.
The mesh follows the flow: its lines are stream lines and equipotentials, so the stream function of direct current is
exact at every node, and cells shrink towards the inner corner by themselves. All lengths in widths of the track,
inductances in mu0 times it.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace

import numpy as np
from stream_sheet import Sheet, gradients, inductance_matrix, resistance_matrix, sheet

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack, bent_winding_loss
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet

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
    far = 3.0 + (math.pi * ARM - 3.0) * np.linspace(0.0, 1.0, round(1.6 * cells)) ** 2
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
    item = Sheet(flat, np.concatenate([first, second]), even, edges, aspect, 0.0)
    return Flow(item, direct - even, turn)


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


def moments(one):
    """Moment of the excess, over current and width squared, and how far its middle lies inside the corner."""
    places, amounts = _pieces(one)
    return float(np.sum(amounts)), float(amounts @ (places @ one.inwards[0]) / np.sum(amounts))


def _pieces(one):
    # The excess at the middles of the triangles' sides (exact for its moments), and what each stands for.
    p, value = one.sheet.nodes[one.sheet.triangles], one.excess[one.sheet.triangles]
    area = gradients(one.sheet)[1]
    places = np.concatenate([0.5 * (p[:, i] + p[:, (i + 1) % 3]) for i in range(3)])
    return places, np.concatenate([area / 6.0 * (value[:, i] + value[:, (i + 1) % 3]) for i in range(3)])


def made(one, aspect, height=0.0):
    """What the excess has with even current and with itself, in mu0 widths, for tracks of a thickness; or with those of
    a track at a height above it.
    """
    first = replace(one.sheet, thickness=aspect)
    mutual = inductance_matrix(first, first if height == 0.0 else replace(first, z=height)) / MU0
    return float(one.excess @ mutual @ one.sheet.even), float(one.excess @ mutual @ one.excess)


def limit(value, cells=(7, 10)):
    """Of `value(cells)`, whose error falls with the square of the cells' size."""
    coarse, fine = (np.array(value(n)) for n in cells)
    return fine + (fine - coarse) / ((cells[1] / cells[0]) ** 2 - 1.0)


def gathered(one, count=4):
    """Places to one side of the bisector that stand for the excess (count, 3): to the inside, across, share."""
    places, amounts = _pieces(one)
    inside, across = one.inwards
    x = np.stack([places @ inside, np.abs(places @ across)], axis=1)
    random, best = np.random.default_rng(1), (math.inf, None)
    weights = np.maximum(amounts, 0.0)
    for _ in range(20):
        centres = x[random.choice(len(x), count, p=weights / np.sum(weights))]
        for _ in range(60):
            owner = np.argmin(np.sum((x[:, None] - centres) ** 2, axis=2), axis=1)
            share = np.bincount(owner, weights, count)
            centres = np.stack([np.bincount(owner, weights * x[:, k], count) / share for k in (0, 1)], axis=1)
        cost = float(np.sum(weights * np.sum((x - centres[owner]) ** 2, axis=1)))
        if cost < best[0]:
            best = cost, np.column_stack([centres, share / np.sum(share)])
    return best[1][np.argsort(best[1][:, 0])]


def rounded(turn, radius, cells=(5, 8), arm=5.0, aspect=0.1):
    """Of an arc of a radius between arms: squares beyond the straight sides, the loop's moment, what it makes (mu0
    widths) and how far its middle lies inside the corner; by triangles that follow the track, whose error falls with
    their size to the power 1.6.
    """
    corners = arm * np.array([(-1.0, 0.0), (0.0, 0.0), (math.cos(turn), math.sin(turn))])
    result = []
    for n in cells:
        item = sheet(corners, 1.0, aspect, n, n, radius=radius)
        resistance = resistance_matrix(item, 1.0)
        free = np.setdiff1d(np.arange(len(item.even)), item.fixed)
        excess = np.zeros(len(item.even))
        excess[free] = -np.linalg.solve(resistance[np.ix_(free, free)], (resistance @ item.even)[free])
        current, mutual = item.even + excess, inductance_matrix(item, item) / MU0
        squares = aspect * current @ resistance @ current - 2.0 * (arm - radius * math.tan(0.5 * turn))
        moment, inside = moments(Flow(item, excess, turn))
        result.append(np.array([squares, moment, excess @ mutual @ (2.0 * item.even + excess), inside]))
    return result[1] + (result[1] - result[0]) / ((cells[1] / cells[0]) ** 1.6 - 1.0)


def curved(turn, radius, arm=5.0, aspect=0.1):
    """The same as far as a current has it that goes as 1 / radius all along the arc: squares, what it makes."""
    onwards = radius * math.tan(0.5 * turn)
    start, end = np.array([-onwards, 0.0]), onwards * np.array([math.cos(turn), math.sin(turn)])
    track = BentTrack(np.array([(-arm, 0.0), start, end]), np.array([start, end, arm / onwards * end]),
                      np.array([0.0, turn, 0.0]), 1.0, aspect, 0.0)
    loss = bent_winding_loss([track], 1.0, ModeSet(6, 2, (7, 3)), 4, 4)
    return turn / math.log((radius + 0.5) / (radius - 0.5)), loss.direct_change / MU0


def write_rounded():
    """Print the tables of rounded corners: the tight ones whole, of the others what is beyond `curved`."""
    for degrees in (45.0, 60.0, 90.0):
        turn = math.radians(degrees)
        for radius in (0.55, 0.7, 0.85, 1.0, 1.4, 2.0, 3.0):
            whole, less = rounded(turn, radius), np.array(curved(turn, radius))
            print(degrees, radius, np.round(whole, 5).tolist(), np.round(whole[[0, 2]] - less, 5).tolist())


def write():
    """Print the tables of sharp corners."""
    turns = [math.radians(degrees) for degrees in (45.0, 60.0, 90.0)]
    for turn in turns:
        print(math.degrees(turn), limit(lambda n, turn=turn: moments(flow(turn, 0.1, n))))
        print(np.round(gathered(flow(turn, 0.1, 14)), 3).tolist())
    for aspect in (0.001, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 2.0, 3.0):
        row = [limit(lambda n, turn=turn, aspect=aspect: made(flow(turn, aspect, n), aspect)) for turn in turns]
        print(aspect, np.round([2.0 * arms + own for arms, own in row], 5).tolist())


if __name__ == "__main__":
    write_rounded() if sys.argv[1:] == ["rounded"] else write()
