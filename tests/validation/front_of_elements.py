"""A round plate between endless plates, over coaxial rings, by the finite elements of `disc_of_elements`.

One grid serves with the first plate's metal and without, so that what that plate changes is no difference of two grids.
Its losses are not to be used: plates end where the grid does.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from disc_of_elements import FAR, MU0, _flux, _growing, _lines, _matrices
from scipy.sparse.linalg import splu


def front_change(radii, heights, frequency, disc, plates, cells=0.7):
    """Change of inductance (H) by the first of `plates`: with the disc, and without it.

    `disc` is gap, diameter, thickness (m) and conductivity (S/m); plates are lower and upper face (m), conductivity.
    """
    omega, (gap, diameter, thickness, sigma) = 2.0 * math.pi * frequency, disc
    size = max(gap, 0.5 * diameter, max(radii))

    def skin(conductivity):
        return 1.0 / math.sqrt(math.pi * frequency * MU0 * conductivity)

    r, _ = _lines(0.5 * diameter, gap, thickness, min(skin(sigma), thickness, 0.05 * diameter), size, radii, cells)
    faces = [(gap, skin(sigma)), (gap + thickness, skin(sigma))]
    faces += [(face, skin(metal)) for low, high, metal in plates for face in (low, high)]
    z = _heights(sorted(faces), min(0.06 * diameter, 0.2 * gap) / cells, size, cells)
    middle_r, middle_z = 0.5 * (r[1:] + r[:-1]), 0.5 * (z[1:] + z[:-1])
    squares, shape = r**2, (middle_r.size, middle_z.size)
    vacuum = _matrices(squares, np.diff(z), r.size, z.size, np.ones(shape))[0](np.ones(shape))
    source = sum(_flux(radius, r, z - height) for radius, height in zip(radii, heights, strict=True)).ravel()
    free = np.arange(r.size * z.size).reshape(r.size, z.size)[1:-1, 1:-1].ravel()

    def inductance(parts, with_disc):
        metal = np.zeros(shape)
        if with_disc:
            metal[np.ix_(middle_r < 0.5 * diameter, (middle_z > gap) & (middle_z < gap + thickness))] = sigma
        for low, high, conductivity in parts:
            metal[:, (middle_z > low) & (middle_z < high)] = conductivity
        acts = 1j * omega * MU0 * _matrices(squares, np.diff(z), r.size, z.size, metal)[1]
        answer = np.zeros(source.size, dtype=complex)
        answer[free] = -splu((vacuum + acts)[free][:, free].tocsc()).solve((acts @ source)[free])
        return float((-2.0 * math.pi / MU0 * (source @ (acts @ (source + answer)))).real)

    return tuple(inductance(plates, item) - inductance(plates[1:], item) for item in (True, False))


def _heights(faces, widest, size, cells):
    # Lines that crowd on both sides of every face, which come with their skin depths.
    ratio, parts = 1.0 + 0.35 / cells, []
    for (low, fine), (high, other) in pairwise(faces):
        half = 0.5 * (high - low)
        up, down = (_growing(min(item / (6.0 * cells), half), ratio, widest, half) for item in (fine, other))
        parts.append(np.concatenate([low + up, (high - down[::-1])[1:]])[:-1])
    (first, fine), (last, other) = faces[0], faces[-1]
    below, above = (_growing(item / (6.0 * cells), ratio, widest, 3.0 * size) for item in (fine, other))
    z = np.concatenate([first - below[:0:-1], *parts, [last], last + above[1:]])
    far = _growing(widest, ratio, math.inf, FAR * size)[1:]
    return np.concatenate([z[0] - far[::-1], z, z[-1] + far])
