"""Where the coils of an array stand, and how far apart they are.

Regular patterns lie symmetric about the origin and are numbered from the far end of the jaw (most negative x) to the
tail at +x, and from negative to positive y where x is equal; written centres keep the order in which they are written.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from sitscad.geometry.shapes import SHAPES
from sitscad.spec.sensor import ArraySpec, CoilPlacement

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


def scaled(array: ArraySpec, factor: float) -> ArraySpec:
    """The array with all centres so many times as far from the origin, and from each other."""
    placements = (replace(p, centre=(p.centre[0] * factor, p.centre[1] * factor)) for p in array.placements)
    return replace(array, placements=tuple(placements), pitch=None if array.pitch is None else array.pitch * factor)


def named(centres: tuple[Point, ...], rotations: tuple[float, ...] | None = None) -> tuple[CoilPlacement, ...]:
    """Placements C1, C2, ... in the order given, turned by `rotations` (rad)."""
    turned = zip(centres, rotations or (0.0,) * len(centres), strict=True)
    return tuple(CoilPlacement(f"C{number}", *place) for number, place in enumerate(turned, 1))


def gap(shape: str, size: tuple[float, float], first: CoilPlacement, second: CoilPlacement) -> float:
    """Smallest gap (m) between the outer copper edges of two equal coils; negative where they overlap.

    Exact for circles and racetracks that do not overlap; for polygons the largest gap between two parallel lines
    along a side of either, which is at most the true one.
    """
    # Every outline is a convex core of points with a radius round it; two convex cores are as far apart as they are in
    # the best direction, which is square to a side of one of them or, between two corners, along the line through both.
    core, radius = SHAPES[shape].core(size)
    one, other = (_placed(core, place) for place in (first, second))
    directions = [math.pi / 2 + math.atan2(b[1] - a[1], b[0] - a[0]) for core in (one, other) for a, b in _sides(core)]
    directions += [math.atan2(b[1] - a[1], b[0] - a[0]) for a in one for b in other]
    return max(_apart(one, other, angle + turn) for angle in directions for turn in (0.0, math.pi)) - 2.0 * radius


def _placed(points: Sequence[Point], place: CoilPlacement) -> list[Point]:
    cosine, sine = math.cos(place.rotation), math.sin(place.rotation)
    return [(place.centre[0] + u * cosine - v * sine, place.centre[1] + u * sine + v * cosine) for u, v in points]


def _sides(core: list[Point]) -> list[tuple[Point, Point]]:
    return list(zip(core, core[1:] + core[:1], strict=True)) if len(core) > 1 else []


def _apart(one: list[Point], other: list[Point], angle: float) -> float:
    cosine, sine = math.cos(angle), math.sin(angle)
    farthest = max(x * cosine + y * sine for x, y in one)
    return min(x * cosine + y * sine for x, y in other) - farthest
