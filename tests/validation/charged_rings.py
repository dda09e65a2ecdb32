"""Charge on flat round turns, a floating round target above them and a grounded plane below: method of moments.

Every turn is cut into rings of charge, crowded to its edges; everything lies in one dielectric without end. The
potential of a ring is that of a uniformly charged circle (complete elliptic integral), its own that of a flat strip as
wide; the plane is the image of everything. The target is a disc whose charge adds up to nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ellipkm1

EPSILON0 = 8.8541878128e-12


def capacitance(
    radii: np.ndarray, heights: np.ndarray, voltages: np.ndarray, width: float, permittivity: float,
    target: tuple[float, float] | None = None, plane: float | None = None, cells: int = 4, target_cells: int = 40,
) -> float:
    """Twice the electric energy (F) of turns at these radii, heights (m) and voltages.

    `target` is the radius and height (m) of a floating disc, `plane` the height (m) of a grounded one.
    """
    edges = -0.5 * width * np.cos(np.pi * np.arange(cells + 1) / cells)
    r = (radii[:, None] + 0.5 * (edges[1:] + edges[:-1])).ravel()
    z, v, size = (np.repeat(values, cells) for values in (heights, voltages, np.ones(radii.size)))
    size = np.tile(np.diff(edges), radii.size)
    turns = r.size
    if target is not None:
        rim = target[0] * np.sin(0.5 * np.pi * np.arange(target_cells + 1) / target_cells)
        r = np.concatenate([r, 0.5 * (rim[1:] + rim[:-1])])
        z = np.concatenate([z, np.full(target_cells, target[1])])
        size = np.concatenate([size, np.diff(rim)])
    influence = _potential(r, z, z, size)
    if plane is not None:
        influence -= _potential(r, z, 2.0 * plane - z, None)
    influence /= EPSILON0 * permittivity
    count = r.size
    matrix = np.zeros((count + 1, count + 1))
    matrix[:count, :count] = influence
    matrix[turns:count, count] = -1.0
    matrix[count, turns:count] = 1.0
    if target is None:
        matrix[count, count] = 1.0
    charges = np.linalg.solve(matrix, np.concatenate([v, np.zeros(count - turns + 1)]))
    return float(charges[:turns] @ v)


def _potential(r: np.ndarray, z: np.ndarray, sources: np.ndarray, size: np.ndarray | None) -> np.ndarray:
    # Potential of unit charges on circles, times the permittivity; own ones at a strip's mean distance from itself.
    across = (z[:, None] - sources) ** 2
    far = (r[:, None] + r) ** 2 + across
    near = (r[:, None] - r) ** 2 + across
    if size is not None:
        np.fill_diagonal(near, (size * np.exp(-1.5)) ** 2)
    return np.asarray(ellipkm1(near / far) / (2.0 * np.pi**2 * np.sqrt(far)))
