"""A round pad pressed by a round rigid plate, in axisymmetric finite elements: linear and nearly incompressible.

Eight-node quadrilaterals with reduced (2 x 2) integration, which do not lock (Zienkiewicz, Taylor, Too 1971). The pad
is bonded to a rigid board, the plate to the pad; beside the plate and at the rim the pad is free.
"""

from __future__ import annotations

import numpy as np

GAUSS = 1.0 / np.sqrt(3.0)
CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
MIDDLES = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)], dtype=float)


def stiffness(plate: float, pad: float, thickness: float, shear: float, poisson: float, cells: int = 12) -> float:
    """Force over displacement (N/m) of a plate of radius `plate` on a pad of radius `pad` (m), shear modulus in Pa.

    `cells` elements lie under the plate and as many through the thickness; cells shrink towards the plate's edge, where
    the stress is singular, and towards the rim.
    """
    radii = plate * np.sin(0.5 * np.pi * np.arange(cells + 1) / cells)
    if pad > plate:
        beside = max(6, round(cells * min(2.0, pad / plate - 1.0)))
        radii = np.concatenate([radii, plate + (pad - plate) * np.linspace(0.0, 1.0, beside + 1)[1:] ** 1.5])
    heights = 0.5 * thickness * (1.0 - np.cos(np.pi * np.arange(cells + 1) / cells))
    points, elements = _mesh(radii, heights)
    matrix = np.zeros((2 * len(points), 2 * len(points)))
    for nodes in elements:
        places = np.repeat(2 * nodes, 2) + np.tile([0, 1], 8)
        matrix[np.ix_(places, places)] += _element(points[nodes], shear, poisson)
    r, z = points.T
    held = np.zeros(len(matrix), dtype=bool)
    prescribed = np.zeros(len(matrix))
    bottom, top, axis = z < 1e-12, (z > thickness - 1e-12) & (r < plate * (1.0 + 1e-9)), r < 1e-12
    held[2 * np.flatnonzero(bottom | top | axis)] = True
    held[2 * np.flatnonzero(bottom | top) + 1] = True
    prescribed[2 * np.flatnonzero(top) + 1] = -1.0
    free = ~held
    moved = prescribed.copy()
    moved[free] = np.linalg.solve(matrix[np.ix_(free, free)], -matrix[np.ix_(free, held)] @ prescribed[held])
    return float(moved @ matrix @ moved)


def _mesh(radii: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    numbers: dict[tuple[int, int], int] = {}
    points: list[tuple[float, float]] = []

    def fine(values: np.ndarray, k: int) -> float:
        return float(values[k // 2] if k % 2 == 0 else 0.5 * (values[k // 2] + values[k // 2 + 1]))

    def node(i: int, j: int) -> int:
        if (i, j) not in numbers:
            numbers[i, j] = len(points)
            points.append((fine(radii, i), fine(heights, j)))
        return numbers[i, j]

    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    elements = [
        np.array([node(2 * i + a, 2 * j + b) for a, b in around])
        for i in range(len(radii) - 1)
        for j in range(len(heights) - 1)
    ]
    return np.array(points), elements


def _element(corners: np.ndarray, shear: float, poisson: float) -> np.ndarray:
    first = 2.0 * shear * poisson / (1.0 - 2.0 * poisson)
    law = first * np.ones((4, 4))
    law[3, :] = law[:, 3] = 0.0
    law += np.diag([2.0 * shear, 2.0 * shear, 2.0 * shear, shear])
    law[3, 3] = shear
    result = np.zeros((16, 16))
    for x in (-GAUSS, GAUSS):
        for y in (-GAUSS, GAUSS):
            shape, slopes = _shapes(x, y)
            jacobian = slopes @ corners
            slopes = np.linalg.solve(jacobian, slopes)
            radius = float(shape @ corners[:, 0])
            strains = np.zeros((4, 16))  # radial, along the axis, round it, shear
            strains[0, 0::2], strains[1, 1::2], strains[2, 0::2] = slopes[0], slopes[1], shape / radius
            strains[3, 0::2], strains[3, 1::2] = slopes[1], slopes[0]
            result += 2.0 * np.pi * radius * np.linalg.det(jacobian) * strains.T @ law @ strains
    return result


def _shapes(x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    # Values (8,) and slopes (2, 8) of the serendipity functions.
    shape, slopes = np.zeros(8), np.zeros((2, 8))
    for k, (a, b) in enumerate(CORNERS):
        shape[k] = 0.25 * (1 + a * x) * (1 + b * y) * (a * x + b * y - 1)
        slopes[0, k] = 0.25 * a * (1 + b * y) * (2 * a * x + b * y)
        slopes[1, k] = 0.25 * b * (1 + a * x) * (2 * b * y + a * x)
    for k, (a, b) in enumerate(MIDDLES, start=4):
        if a == 0:
            shape[k] = 0.5 * (1 - x * x) * (1 + b * y)
            slopes[:, k] = -x * (1 + b * y), 0.5 * b * (1 - x * x)
        else:
            shape[k] = 0.5 * (1 + a * x) * (1 - y * y)
            slopes[:, k] = 0.5 * a * (1 - y * y), -y * (1 + a * x)
    return shape, slopes
