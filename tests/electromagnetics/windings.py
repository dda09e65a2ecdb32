"""Spiral layers for the tests, joined as the spec defines it: the angle runs on from layer to layer."""

from __future__ import annotations

import math

import numpy as np

from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer

MM, UM = 1e-3, 1e-6


def coil(diameter, turns, width, spacing, heights, thicknesses, angle=0.0, sense=1) -> list[SpiralLayer]:
    """A circular coil: all lengths in metres, layers in winding order."""
    sweep = sense * 2.0 * math.pi * turns
    layers = []
    for index, (z, t) in enumerate(zip(heights, thicknesses, strict=True)):
        inward = index % 2 == 0
        if not inward:
            angle += 2.0 * sweep
        layers.append(
            SpiralLayer(
                (diameter - width) / 2, width + spacing, turns, angle, sense if inward else -sense, inward, z, width, t
            )
        )
    return layers


def bench(scale=1.0, **placed) -> list[SpiralLayer]:
    """The thesis's 7 mm coil: 2 x 12 turns, 100/100/35 um, mid-planes 60 um apart."""
    u = UM * scale
    return coil(7000 * u, 12, 100 * u, 100 * u, (0.0, -60 * u), (35 * u, 35 * u), **placed)


def four_layers() -> list[SpiralLayer]:
    """The recommended jaw coil: 4.0 mm, 4 x 7.75 turns, 80/80 um."""
    return coil(
        4 * MM, 7.75, 80 * UM, 80 * UM, (0.0, -49 * UM, -127 * UM, -176 * UM), (30 * UM, 18 * UM, 18 * UM, 30 * UM)
    )


def miniature() -> list[SpiralLayer]:
    """The thesis's 3.5 mm coil: 2 x 6.5 turns, 100/100/35 um."""
    return coil(3.5 * MM, 6.5, 100 * UM, 100 * UM, (0.0, -60 * UM), (35 * UM, 35 * UM))


def square(turns, half, pitch):
    """Corners (n, 2) of a square spiral wound inwards from half a side (m)."""
    points = [(-half, -half)]
    for m in range(4 * turns):
        a, b = half - pitch * (m // 4), half - pitch * ((m + 1) // 4)
        points.append([(a, -a), (a, a), (-a, a), (-a, -b)][m % 4])
    return np.array(points)
