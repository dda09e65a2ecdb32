"""The yardstick for finite plates: a perfectly conducting box whose six faces are covered with current loops.

Every rectangular panel carries a loop of current round its border (a surface of constant stream function); the loops'
strengths cancel the coil's normal field at all panel centres. Panels shrink towards the edges, where current crowds. It
shares nothing with the package's spectral sheet: fields are Biot and Savart's of straight pieces, the coil's are
Maxwell's rings by the arithmetic-geometric mean.
"""

from __future__ import annotations

import numpy as np

MU0 = 4e-7 * np.pi


def ring_field(radius, height, points, current=1.0):
    """Flux density (T, shape (n, 3)) at points (n, 3) of rings about the z axis, each with its current (A); summed."""
    rho = np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-12)[:, None]
    z = points[:, 2][:, None] - height
    far, near = (radius + rho) ** 2 + z**2, (radius - rho) ** 2 + z**2
    k, e = _elliptic(np.sqrt(near / far))
    axial = MU0 / (2 * np.pi * np.sqrt(far)) * (k + (radius**2 - rho**2 - z**2) / near * e)
    radial = MU0 * z / (2 * np.pi * rho * np.sqrt(far)) * (-k + (radius**2 + rho**2 + z**2) / near * e)
    radial, axial = (radial * current).sum(axis=1), (axial * current).sum(axis=1)
    return np.stack([radial * points[:, 0] / rho[:, 0], radial * points[:, 1] / rho[:, 0], axial], axis=1)


def _elliptic(complement):
    # K and E of the modulus with that complementary one.
    a, b = np.ones_like(complement), complement
    total, weight = (1.0 - complement**2) / 2.0, 1.0
    for _ in range(9):
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        total = total + weight * c**2
        weight *= 2.0
    k = np.pi / (2.0 * a)
    return k, k * (1.0 - total)


def box_panels(size, thickness, across, through):
    """Corners (n, 4, 3) of all panels of a box whose lower face is z = 0, each counter-clockwise seen from outside."""
    x, y = (0.5 * s * _graded(across) for s in size)
    z = 0.5 * thickness * (1.0 + _graded(through))
    faces = []
    for u, v, place in (
        (x, y, lambda a, b: (a, b, thickness + 0 * a)), (y, x, lambda a, b: (b, a, 0 * a)),
        (y, z, lambda a, b: (x[-1] + 0 * a, a, b)), (z, y, lambda a, b: (x[0] + 0 * a, b, a)),
        (z, x, lambda a, b: (b, y[-1] + 0 * a, a)), (x, z, lambda a, b: (a, y[0] + 0 * a, b)),
    ):
        a, b = np.meshgrid(u, v, indexing="ij")
        p = np.stack(place(a, b), axis=-1)
        corners = np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]], axis=2)
        faces.append(corners.reshape(-1, 4, 3))
    return np.concatenate(faces)


def _graded(count):
    return -np.cos(np.pi * np.arange(count + 1) / count)


def box_change(size, thickness, offset, radii, heights, gap, across=24, through=8, floor=None):
    """Change of inductance (H) of rings (all 1 turn) by the box; its lower face is `gap` over z = 0.

    `offset` is the coil's along x from the box's middle; the mirror symmetry in y halves the unknowns. `floor` (m,
    below 0) is a perfect mirror behind the coil, there before and after.
    """
    corners = box_panels(size, thickness, across, through)
    if across % 2:
        raise ValueError("an even number of panels, for the mirror plane")
    middles = corners.mean(axis=1)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = 0.5 * np.linalg.norm(normals, axis=1)
    normals = normals / (2.0 * area[:, None])
    stored = np.flatnonzero(middles[:, 1] > 0)
    matrix = np.empty((stored.size, stored.size))
    mirror = np.array([1.0, -1.0, 1.0])
    here, outward = middles[stored], normals[stored]
    own = corners[stored]
    # A loop's mirror image in y runs the other way round seen from outside: reversed, it is outward again.
    matrix = _loops(own, here, outward) + _loops((own * mirror)[:, ::-1], here, outward)
    current = np.ones_like(radii)
    if floor is not None:
        # Images run the other way round; their loops are not those of a closed surface seen from outside, but currents.
        level = 2.0 * (floor - gap)
        image = own * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, level])
        matrix += _loops(image[:, ::-1], here, outward) + _loops(image * mirror, here, outward)
        radii, heights = np.tile(radii, 2), np.concatenate((heights, 2.0 * floor - heights))
        current = np.concatenate((current, -current))
    # One constant is free on a closed surface: fix the mean.
    matrix += np.abs(matrix).max() * area[stored] / area.sum()
    shift = np.array([offset, 0.0, -gap])
    field = (ring_field(radii, heights, here - shift, current) * outward).sum(axis=1)
    strength = np.linalg.solve(matrix, -field)
    nodes = np.array([-1.0, 1.0]) / np.sqrt(3.0)
    flux = np.zeros(stored.size)
    for s in nodes:
        for t in nodes:
            u, v = 0.5 * (1 + s), 0.5 * (1 + t)
            point = (own[:, 0] * (1 - u) * (1 - v) + own[:, 1] * u * (1 - v) + own[:, 2] * u * v
                     + own[:, 3] * (1 - u) * v)
            flux += 0.25 * (ring_field(radii, heights, point - shift, current) * outward).sum(axis=1)
    return 2.0 * float(np.sum(strength * flux * area[stored]))


def _loops(loops, points, normals, rows=128):
    # Normal flux density (T) at points by the border of every loop with 1 A: straight pieces, Biot and Savart.
    blocks = [_block(loops, points[i : i + rows], normals[i : i + rows]) for i in range(0, len(points), rows)]
    return MU0 / (4 * np.pi) * np.concatenate(blocks)


def _block(loops, points, normals):
    away = points[:, None, None] - loops
    distance = np.sqrt(np.einsum("ijsk,ijsk->ijs", away, away))
    result = np.zeros(distance.shape[:2])
    for side in range(4):
        a, b = away[:, :, side], away[:, :, side - 3]
        na, nb = distance[:, :, side], distance[:, :, side - 3]
        # n . (a x b) with b = a - l
        cross = np.einsum("jik,jik->ji", np.cross(b - a, normals[:, None]), a)
        product = na * nb
        result += cross / (product * (product + np.einsum("ijk,ijk->ij", a, b))) * (na + nb)
    return result


def converged_change(*arguments, floor=None, across=24, through=8):
    """`box_change` for panels endlessly small: its error falls like the panels' size, so two sizes give the limit."""
    coarse = box_change(*arguments, across // 2, through // 2, floor)
    return 2.0 * box_change(*arguments, across, through, floor) - coarse


def endless_change(radii, heights, gap, floor=None):
    """Change of inductance (H) by an endless perfect conductor: the image rings, by their flux through the coil.

    With a mirror behind the coil the images repeat; their sum is what the plate adds to the mirror's own image.
    """
    if floor is None:
        return _mutual(radii, heights, 2.0 * gap - heights, -1.0)
    room = gap - floor
    total = _mutual(radii, heights, 2.0 * gap - heights, -1.0)
    for n in range(1, 200):
        total += 2.0 * _mutual(radii, heights, heights + 2.0 * n * room, 1.0)
        total += _mutual(radii, heights, 2.0 * gap - heights + 2.0 * n * room, -1.0)
        total += _mutual(radii, heights, 2.0 * floor - heights - 2.0 * n * room, -1.0)
    return total


def _mutual(radii, heights, images, sign):
    # Sum (H) over all pairs of a ring and an image ring.
    total = 0.0
    for radius, height in zip(radii, heights, strict=True):
        far = (radius + radii) ** 2 + (height - images) ** 2
        k2 = 4 * radius * radii / far
        k, e = _elliptic(np.sqrt(1.0 - k2))
        total += sign * float(np.sum(MU0 * np.sqrt(radius * radii / k2) * ((2.0 - k2) * k - 2.0 * e)))
    return total
