"""The yardstick for cells: two perfectly conducting boxes side by side, a coil under the first, by `box_of_loops`."""

from __future__ import annotations

import numpy as np

from tests.validation.box_of_loops import _loops, box_panels, ring_field

MIRROR = np.array([1.0, -1.0, 1.0])


def change(boxes, size, thickness, radii, heights, across=12, through=4):
    """Change of inductance (H) of rings about the z axis (1 turn each) by boxes with their middles at (x, 0) and their
    lower faces at z: `boxes` are pairs (x, z) in metres. Mirror symmetry in y halves the unknowns.
    """
    panels = [box_panels(size, thickness, across, through) + np.array([x, 0.0, z]) for x, z in boxes]
    corners = np.concatenate(panels)
    owner = np.repeat(np.arange(len(boxes)), [len(item) for item in panels])
    stored = corners.mean(axis=1)[:, 1] > 0.0
    corners, owner = corners[stored], owner[stored]
    middles, normals = corners.mean(axis=1), np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = 0.5 * np.linalg.norm(normals, axis=1)
    normals = normals / (2.0 * area[:, None])
    matrix = _loops(corners, middles, normals) + _loops((corners * MIRROR)[:, ::-1], middles, normals)
    # one constant is free on each closed surface: fix its mean
    matrix += np.abs(matrix).max() * np.where(owner[:, None] == owner, area, 0.0) / area.sum()
    field = (ring_field(radii, heights, middles) * normals).sum(axis=1)
    return 2.0 * float(np.sum(np.linalg.solve(matrix, -field) * field * area))
