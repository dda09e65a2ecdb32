"""Coaxial circular filaments: Maxwell's mutual inductance without cancellation, from touching to far apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sitscad.arrays import Array
from sitscad.physics.constants import MU0


def coaxial_rings(radius: ArrayLike, other: ArrayLike, distance_squared: ArrayLike) -> Array:
    """Mutual inductance (H) of coaxial circular filaments (radii in m, arrays that broadcast together).

    `distance_squared` (m2) is the squared shortest distance of the two circles, (r1 - r2)^2 + z^2, given by the caller
    so that touching circles lose no digits. Maxwell's integral (art. 701) in Landen's form, with K - E of the reduced
    modulus summed by the arithmetic-geometric mean (Abramowitz and Stegun 17.6): relative error about 1e-14 from
    relative distances of 1e-9 to 1e6.
    """
    r1, r2 = np.asarray(radius, dtype=float), np.asarray(other, dtype=float)
    near = np.sqrt(np.asarray(distance_squared, dtype=float))
    product = 4.0 * r1 * r2
    far = np.sqrt(near * near + product)
    # Landen: k1 = (far - near) / (far + near), written without the difference.
    k1 = product / (far + near) ** 2
    complement = 2.0 * np.sqrt(near * far) / (far + near)
    # K - E = K * sum of 2^(n-1) c_n^2, c_0 = k, from the arithmetic-geometric mean of 1 and k'
    a, b = np.ones_like(complement), complement
    square = k1 * k1
    total = 0.5 * square
    weight = 1.0
    for _ in range(9):
        mean = 0.5 * (a + b)
        # c_{n+1}^2 = (c_n^2 / (4 a_{n+1}))^2 avoids the difference a - b
        square = square / mean
        square *= 0.25
        square *= square
        total += weight * square
        b = np.sqrt(a * b)
        a = mean
        weight *= 2.0
        if np.max(square, initial=0.0) * weight < 1e-17 * np.min(total, initial=1.0):
            break
    return MU0 * np.sqrt(r1 * r2) * 2.0 / np.sqrt(k1) * (0.5 * np.pi / a * total)
