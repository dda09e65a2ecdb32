"""Straight bars of rectangular cross-section in high precision."""

from __future__ import annotations

import itertools

import mpmath


def bars_exactly(length, start, height, width, thickness):
    """Mutual inductance of two parallel bars by Hoer and Love's closed volume integral, in 90 digits."""
    with mpmath.workdps(90):

        def f(x, y, z):
            r, total = mpmath.sqrt(x * x + y * y + z * z), mpmath.mpf(0)
            for a, b, c in ((x, y, z), (y, z, x), (z, x, y)):
                if a or b:
                    even = a * a * b * b / 4 - a**4 / 24 - b**4 / 24
                    total += even * c * mpmath.asinh(c / mpmath.sqrt(a * a + b * b))
                if c and r:
                    total -= a * b * c**3 / 6 * mpmath.atan(a * b / (c * r))
            return total + r * (x**4 + y**4 + z**4 - 3 * (x * x * y * y + y * y * z * z + z * z * x * x)) / 60

        def edges(offset, size):
            size = mpmath.mpf(size)
            return ((offset - size, 1), (mpmath.mpf(offset), -2), (offset + size, 1))

        total = mpmath.fsum(
            p * q * r * f(x, y, z)
            for (x, p), (y, q), (z, r) in itertools.product(edges(0, width), edges(height, thickness),
                                                            edges(start, length))
        )
        return float(mpmath.mpf(1e-7) * total / mpmath.mpf(width * thickness) ** 2)
