"""Where the coils of an array stand, and how far apart they are.

Regular patterns lie symmetric about the origin and are numbered from the far end of the jaw (most negative x) to the
tail at +x, and from negative to positive y where x is equal; written centres keep the order in which they are written.
"""

from __future__ import annotations

import math

from sitscad.spec.sensor import CoilPlacement
from sitscad.spec.turns import SIDES

Point = tuple[float, float]


def line(count: int, pitch: float) -> tuple[Point, ...]:
    """Centres (m) of a row along x."""
    return tuple(((i - (count - 1) / 2) * pitch, 0.0) for i in range(count))


def triangle(pitch: float) -> tuple[Point, ...]:
    """Centres (m) of three coils at one distance, the far one alone on the axis, their centroid at the origin."""
    return (
        (-pitch / math.sqrt(3), 0.0),
        (pitch / (2 * math.sqrt(3)), -pitch / 2),
        (pitch / (2 * math.sqrt(3)), pitch / 2),
    )


def grid(columns: int, rows: int, pitch: float) -> tuple[Point, ...]:
    """Centres (m) of a grid, `columns` along x and `rows` along y."""
    return tuple((x, y) for x, _ in line(columns, pitch) for y, _ in line(rows, pitch))


def named(centres: tuple[Point, ...]) -> tuple[CoilPlacement, ...]:
    """Placements C1, C2, ... in the order given."""
    return tuple(CoilPlacement(f"C{number}", centre) for number, centre in enumerate(centres, 1))


def gap(shape: str, size: tuple[float, float], first: Point, second: Point) -> float:
    """Smallest gap (m) between the outer copper edges of two equal coils; negative where they overlap.

    Exact for circles and racetracks; for polygons the largest gap between two parallel sides,
    which is at most the true one.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    if shape == "circle":
        return math.hypot(dx, dy) - size[0]
    if shape == "racetrack":
        return math.hypot(max(0.0, abs(dx) - (size[0] - size[1])), dy) - size[1]
    if shape == "rectangle":
        return max(abs(dx) - size[0], abs(dy) - size[1])
    angles = (2 * math.pi * side / SIDES[shape] for side in range(SIDES[shape]))
    return max(dx * math.cos(angle) + dy * math.sin(angle) for angle in angles) - size[0]
