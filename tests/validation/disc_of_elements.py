"""A round plate of any conductivity and permeability under coaxial rings, by finite elements about the axis.

Independent of `disc_of_rings`: a differential equation on a grid of space instead of mutual inductances of pieces of
metal. The unknown is the flux through circles over 2 pi, of the eddy and magnetisation currents alone; in the square of
the radius its equation has no singularity on the axis: 4 s d2/ds2 + d2/dz2. What the rings alone send through every
circle is Maxwell's formula. Elements are bilinear, crowded at the metal's faces, and reach thirty radii out.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu
from scipy.special import ellipe, ellipkm1

MU0 = 4e-7 * math.pi
FAR = 30.0


def disc_change(
    radii, gap, diameter, thickness, conductivity, permeability=1.0, frequency=5e6, cells=1.0, is_hole=False,
    heights=0.0,
):
    """Change of inductance (H) and resistance (ohm) of rings at `heights` (m) by a disc, its near face at `gap` (m).

    Twice the `cells` are everywhere half as wide. With `is_hole` metal is where the disc is not: an endless plate with
    a round hole.
    """
    omega = 2.0 * math.pi * frequency
    skin = 1.0 / math.sqrt(math.pi * frequency * MU0 * permeability * conductivity)
    size = max(gap, 0.5 * diameter, max(radii))
    r, z = _lines(0.5 * diameter, gap, thickness, min(skin, thickness, 0.05 * diameter), size, radii, cells)
    inside_r = 0.5 * (r[1:] + r[:-1]) < 0.5 * diameter
    inside_z = (0.5 * (z[1:] + z[:-1]) > gap) & (0.5 * (z[1:] + z[:-1]) < gap + thickness)
    metal = (inside_r != is_hole)[:, None] & inside_z
    stiff, mass = _matrices(r**2, np.diff(z), r.size, z.size, metal)
    vacuum, magnetic, conducting = stiff(np.ones_like(metal, dtype=float)), stiff(metal.astype(float)), mass
    acts = 1j * omega * conductivity * MU0 * conducting + (1.0 / permeability - 1.0) * magnetic
    places = zip(radii, np.broadcast_to(heights, len(radii)), strict=True)
    source = sum(_flux(radius, r, z - height) for radius, height in places).ravel()
    number = np.arange(r.size * z.size).reshape(r.size, z.size)
    free = number[1:-1, 1:-1].ravel()
    drive = (acts @ source)[free]
    answer = np.zeros(source.size, dtype=complex)
    answer[free] = -splu((vacuum + acts)[free][:, free].tocsc()).solve(drive)
    # reciprocity: the energy of the rings' field with all currents in the metal
    change = -2.0 * math.pi / MU0 * (source @ (acts @ (source + answer)))
    return float(change.real), float(-omega * change.imag)


def _flux(radius, r, z):
    # Flux over 2 pi of a ring with 1 A, its plane at z = 0.
    r, z = np.meshgrid(np.maximum(r, 1e-12), z, indexing="ij")
    complement = ((r - radius) ** 2 + z**2) / ((r + radius) ** 2 + z**2)
    complement = np.maximum(complement, 1e-12)
    k = np.sqrt(1.0 - complement)
    with np.errstate(all="ignore"):
        result = MU0 * np.sqrt(radius * r) * ((2.0 / k - k) * ellipkm1(complement) - 2.0 / k * ellipe(1.0 - complement))
    return np.where(r > 1e-9 * radius, result, 0.0) / (2.0 * math.pi)


def _lines(radius, gap, thickness, skin, size, radii, cells):
    # Radii and heights of the grid's lines: from a face on they grow by a ratio on both sides.
    first, ratio = skin / (6.0 * cells), 1.0 + 0.35 / cells
    widest = min(0.12 * radius, 0.2 * gap) / cells
    inwards = radius - _growing(first, ratio, widest, radius)[::-1]
    outwards = radius + _growing(first, ratio, widest, 3.0 * size)
    further = outwards[-1] + _growing(widest, ratio, math.inf, FAR * size)
    half = _growing(first, ratio, widest, 0.5 * thickness)
    through = gap + np.concatenate([half, thickness - half[-2::-1]])
    above = _growing(first, ratio, widest, 3.0 * size)
    z = np.concatenate([gap - above[:0:-1], through, gap + thickness + above[1:]])
    z = np.concatenate([z[0] - _growing(widest, ratio, math.inf, FAR * size)[:0:-1], z,
                        z[-1] + _growing(widest, ratio, math.inf, FAR * size)[1:]])
    return np.concatenate([inwards, outwards[1:], further[1:]]), z


def _growing(first, ratio, widest, length):
    # 0 to `length`: steps that grow to the widest, stretched so that they end there.
    steps = []
    while sum(steps) < length:
        steps.append(min(first * ratio ** len(steps), widest))
    return np.concatenate([[0.0], np.cumsum(steps)]) * (length / sum(steps))


def _matrices(s, dz, rows, columns, metal):
    # Of elements in the square of the radius: 2 |d/ds|^2 + |d/dz|^2 / 2 s, and 1 / 2 s, times the height.
    ds = np.diff(s)
    nodes, weights = (0.5 * (1.0 + x) if k == 0 else 0.5 * x for k, x in enumerate(np.polynomial.legendre.leggauss(4)))
    shape = np.array([1.0 - nodes, nodes])
    inverse = 1.0 / (2.0 * (s[:-1, None] + ds[:, None] * nodes))
    radial = np.einsum("q,iq,jq,eq,e->eij", weights, shape, shape, inverse, ds)
    slope = 2.0 * np.array([[1.0, -1.0], [-1.0, 1.0]]) / ds[:, None, None]
    across, upwards = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0, np.array([[1.0, -1.0], [-1.0, 1.0]])
    number = np.arange(rows * columns).reshape(rows, columns)
    corner = [number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]]
    places = [(a, b) for a in range(4) for b in range(4)]
    i = np.concatenate([corner[a].ravel() for a, _ in places])
    j = np.concatenate([corner[b].ravel() for _, b in places])

    def assembled(element):
        values = np.concatenate([element(a // 2, b // 2, a % 2, b % 2).ravel() for a, b in places])
        return sparse.csr_matrix((values, (i, j)), shape=(rows * columns,) * 2)

    def stiff(weight):
        return assembled(lambda p, q, u, v: weight * (slope[:, p, q, None] * dz * across[u, v]
                                                      + radial[:, p, q, None] * upwards[u, v] / dz))

    return stiff, assembled(lambda p, q, u, v: metal * radial[:, p, q, None] * dz * across[u, v])
