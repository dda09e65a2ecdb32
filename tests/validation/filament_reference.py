"""Alternating current by brute force: every track cut into filaments, each with its own current. Two formulations.

`SegmentedTrack` solves the real, open, crossing spirals (or polygons) as straight pieces between nodes at which the
filaments meet; `ring_impedance` solves closed coaxial rings. Neither knows modes, cuts or Lanczos runs. Filaments may
be mitred, each as long as its own path is, or all as long as the centre line, which is what solvers of the FastHenry
kind do and what makes them read the loss of curved tracks low, however fine the pieces are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.mean_distance import log_mean_distance
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings, gauss


def cosine_cells(count):
    """Centres and widths of cells of [-1/2, 1/2] that become narrow towards both edges."""
    edges = -0.5 * np.cos(np.pi * np.arange(count + 1) / count)
    return 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)


def even_cells(count):
    """Centres and widths of equal cells of [-1/2, 1/2]."""
    return (np.arange(count) + 0.5) / count - 0.5, np.full(count, 1.0 / count)


def doubling_cells(count):
    """Cells each twice as wide as its neighbour towards the edge: FastHenry's default ratio."""
    sizes = 2.0 ** np.minimum(np.arange(count), count - 1 - np.arange(count))
    sizes /= sizes.sum()
    return np.cumsum(sizes) - 0.5 * sizes - 0.5, sizes


@dataclass(frozen=True)
class SegmentedTrack:
    """Corners (n, 2) in the direction of the current (m), cross-section and mid-plane."""

    corners: np.ndarray
    width: float
    thickness: float
    z: float


def spiral_track(layer, chords):
    """A layer as `chords` pieces a turn, nodes on the spiral."""
    theta = np.linspace(0.0, layer.span, round(layer.turns * chords) + 1)
    radius = layer.radius - layer.pitch / (2.0 * math.pi) * theta
    azimuth = layer.angle + layer.sense * theta
    corners = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=1)
    return SegmentedTrack(corners if layer.inward else corners[::-1], layer.width, layer.thickness, layer.z)


def _strand(corners, offset, mitred):
    # Starts and ends of every piece of the line `offset` to the left.
    sides = np.diff(corners, axis=0)
    tangents = sides / np.hypot(*sides.T)[:, None]
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    if not mitred:
        return corners[:-1] + offset * normals, corners[1:] + offset * normals
    before, after = np.vstack([normals[:1], normals]), np.vstack([normals, normals[-1:]])
    line = corners + offset * (before + after) / (1.0 + np.sum(before * after, axis=1))[:, None]
    return line[:-1], line[1:]


class Filaments:
    """All filaments of tracks in series: kind (cell), piece and ends of each."""

    def __init__(self, tracks, across, through, mitred=True):
        (cx, sx), (cz, sz) = across, through
        self.kinds = [(x, z, dx, dz) for x, dx in zip(cx, sx, strict=True) for z, dz in zip(cz, sz, strict=True)]
        starts, ends, heights, pieces, kinds, sections = [], [], [], [], [], []
        piece = 0
        for track in tracks:
            count = len(track.corners) - 1
            for kind, (x, z, dx, dz) in enumerate(self.kinds):
                a, b = _strand(track.corners, x * track.width, mitred)
                starts.append(a)
                ends.append(b)
                heights.append(np.full(count, track.z + z * track.thickness))
                pieces.append(piece + np.arange(count))
                kinds.append(np.full(count, kind))
                sections.append(np.tile([dx * track.width, dz * track.thickness], (count, 1)))
            piece += count
        kind_of, order = np.concatenate(kinds), np.lexsort((np.concatenate(kinds), np.concatenate(pieces)))
        self.centre_start = np.concatenate([np.tile(t.corners[:-1], (len(self.kinds), 1)) for t in tracks])[order]
        self.centre_end = np.concatenate([np.tile(t.corners[1:], (len(self.kinds), 1)) for t in tracks])[order]
        self.kind_of = kind_of[order]
        self.start, self.end = np.concatenate(starts)[order], np.concatenate(ends)[order]
        self.height, self.section = np.concatenate(heights)[order], np.concatenate(sections)[order]
        self.piece, self.count = np.concatenate(pieces)[order], piece

    def resistances(self, conductivity):
        """Resistance (ohm) of every filament."""
        return np.hypot(*(self.end - self.start).T) / (conductivity * self.section.prod(axis=1))

    def inductances(self, points=3):
        """Partial inductances (H) of all pairs of filaments."""
        return _partial_inductances(self.start, self.end, self.height, self.section, points)

    def inductances_with_legs(self, points=3):
        """The same with the way from the centre line to each filament and back, along the joints of the pieces.

        Between joints the potential is free to differ across the track: without the legs a straight piece beside a
        corner would see only a part of the flux.
        """
        count = self.start.shape[0]
        start = np.concatenate([self.start, self.centre_start, self.end])
        end = np.concatenate([self.end, self.start, self.centre_end])
        moved = np.hypot(*(end - start).T) > 1e-12
        everything = np.zeros((3 * count, 3 * count))
        section = np.tile(self.section, (3, 1))
        block = _partial_inductances(start[moved], end[moved], np.tile(self.height, 3)[moved], section[moved], points)
        everything[np.ix_(moved, moved)] = block
        return everything.reshape(3, count, 3, count).sum(axis=(0, 2))


def _partial_inductances(start_of, end_of, heights, section, points):
    # Gauss points on one filament in the closed potential of the other; close ones keep the mean distance of their
    # rectangles.
    side = end_of - start_of
    length = np.hypot(*side.T)
    unit = side / length[:, None]
    nodes, weights = gauss(points)
    clear = _Clearance(section)
    total = np.zeros((length.size, length.size))
    for x, w in zip(nodes, weights, strict=True):
        point = start_of + 0.5 * (1.0 + x) * side
        for low in range(0, length.size, 400):
            rows = slice(low, min(low + 400, length.size))
            away = start_of[None] - point[rows, None]
            start = away[..., 0] * unit[:, 0] + away[..., 1] * unit[:, 1]
            lateral = away[..., 0] * unit[:, 1] - away[..., 1] * unit[:, 0]
            square = clear(lateral, heights[rows, None] - heights, rows)
            rho = np.sqrt(square)
            total[rows] += w * (np.arcsinh((start + length) / rho) - np.arcsinh(start / rho)) * length[rows, None]
    total *= 0.5 * MU0 / (4.0 * math.pi) * (unit @ unit.T)
    return 0.5 * (total + total.T)


class _Clearance:
    """Squared distance that keeps the mean logarithm of two rectangles, from tables by pairs of sections."""

    def __init__(self, section):
        self.sizes, self.kind = np.unique(np.round(section, 12), axis=0, return_inverse=True)
        self.kind = self.kind.ravel()
        self.tables = {}

    def __call__(self, lateral, height, rows):
        square = lateral**2 + height**2
        for a in np.unique(self.kind[rows]):
            for b in range(len(self.sizes)):
                reach = 3.0 * max(*self.sizes[a], *self.sizes[b])
                mask = (self.kind[rows] == a)[:, None] & (self.kind == b)[None, :] & (square < reach**2)
                if not mask.any():
                    continue
                distances = np.abs(lateral[mask])
                levels = np.abs(height[mask])
                result = np.empty_like(distances)
                for level in np.unique(np.round(levels, 10)):
                    here = np.abs(levels - level) < 1e-9
                    result[here] = np.interp(distances[here], *self._table(a, b, float(level), reach))
                square[mask] = np.maximum(square[mask] + result, 1e-16)
        return square

    def _table(self, a, b, level, reach):
        key = (a, b, level)
        if key not in self.tables:
            (wa, ta), (wb, tb) = self.sizes[a], self.sizes[b]
            at = np.linspace(0.0, reach, 200)
            mean = np.exp(2.0 * log_mean_distance(at, level, (wa, wb), (ta, tb)))
            self.tables[key] = (at, mean - at**2 - level**2)
        return self.tables[key]


def impedance(filaments, conductivity, frequencies, points=3, legs=False):
    """Impedance (ohm) at every frequency (Hz) of the pieces in series, the filaments of each joined at its ends."""
    resistance = filaments.resistances(conductivity)
    inductance = filaments.inductances_with_legs(points) if legs else filaments.inductances(points)
    return series_impedance(resistance, inductance, filaments.piece, filaments.count, frequencies)


def series_impedance(resistance, inductance, group, groups, frequencies):
    """Impedance of groups in series, the members of each in parallel.

    At direct current every group divides its current by conductance; what flows besides has no sum in any group.
    """
    share = 1.0 / resistance
    share /= np.bincount(group, share, groups)[group]
    # Null space of the sums: per group, each member but the last against the last.
    last = np.zeros(group.size, dtype=bool)
    last[np.array([np.nonzero(group == g)[0][-1] for g in range(groups)])] = True
    free = np.nonzero(~last)[0]
    partner = np.nonzero(last)[0][group[free]]

    def differences(matrix):
        half = matrix[free] - matrix[partner]
        return half[:, free] - half[:, partner]

    r = np.diag(resistance[free]) + (group[free][:, None] == group[free]) * resistance[partner][:, None]
    m = differences(inductance)
    flux = inductance @ share
    drive = flux[free] - flux[partner]
    direct, base = float(np.sum(resistance * share**2)), share @ flux
    result = []
    for frequency in frequencies:
        omega = 2.0 * math.pi * frequency
        current = np.linalg.solve(r + 1j * omega * m, -1j * omega * drive)
        result.append(direct + 1j * omega * base + 1j * omega * (drive @ current))
    return np.array(result)


def ring_impedance(radius, height, width, thickness, conductivity, frequencies, across, through, equal_lengths=False):
    """Impedance of coaxial rings in series, each cut into filaments; arrays (n,) in metres.

    `equal_lengths` takes every filament as long as the ring's centre line, as unmitred pieces are.
    """
    (cx, sx), (cz, sz) = cosine_cells(across), cosine_cells(through)
    x, z = np.repeat(cx, through), np.tile(cz, across)
    dx, dz = np.repeat(sx, through), np.tile(sz, across)
    r = (radius[:, None] + width * x).ravel()
    h = (height[:, None] + thickness * z).ravel()
    group = np.repeat(np.arange(radius.size), x.size)
    squared = (r[:, None] - r) ** 2 + (h[:, None] - h) ** 2
    own = _mean_squares(x * width, z * thickness, dx * width, dz * thickness)
    for g in range(radius.size):
        rows = slice(g * x.size, (g + 1) * x.size)
        squared[rows, rows] = own
    inductance = coaxial_rings(r[:, None], r, squared)
    resistance = 2.0 * math.pi * r / (conductivity * np.tile(dx * dz, radius.size) * width * thickness)
    if equal_lengths:
        shrink = np.repeat(radius, x.size) / r
        inductance *= shrink[:, None] * shrink
        resistance *= shrink
    return series_impedance(resistance, inductance, group, radius.size, frequencies)


def _mean_squares(x, z, dx, dz):
    result = np.empty((x.size, x.size))
    for i in range(x.size):
        for j in range(i + 1):
            mean = log_mean_distance(abs(x[i] - x[j]), abs(z[i] - z[j]), (dx[i], dx[j]), (dz[i], dz[j]))
            result[i, j] = result[j, i] = np.exp(2.0 * float(mean))
    return result
