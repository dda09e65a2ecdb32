"""The symbols by which drill maps and drawings tell the tools of holes apart."""

from __future__ import annotations

import math
from collections.abc import Callable

from sitscad.geometry.path import Path, Point, circle, closed_polygon, polyline

Symbol = Callable[[Point, float], tuple[Path, ...]]


def _polygon(sides: int, turn: float) -> Symbol:
    def symbol(at: Point, radius: float) -> tuple[Path, ...]:
        angles = [turn + 2.0 * math.pi * i / sides for i in range(sides)]
        return (closed_polygon([Point(at.x + radius * math.cos(a), at.y + radius * math.sin(a)) for a in angles]),)

    return symbol


def _cross(turn: float) -> Symbol:
    def symbol(at: Point, radius: float) -> tuple[Path, ...]:
        arms = [(radius * math.cos(turn + q), radius * math.sin(turn + q)) for q in (0.0, math.pi / 2)]
        return tuple(polyline([Point(at.x - x, at.y - y), Point(at.x + x, at.y + y)]) for x, y in arms)

    return symbol


def _ring(at: Point, radius: float) -> tuple[Path, ...]:
    return (circle(at, radius), *_cross(0.0)(at, radius))


SYMBOLS: tuple[Symbol, ...] = (
    _cross(0.0),
    _cross(math.pi / 4),
    _polygon(4, 0.0),
    _polygon(4, math.pi / 4),
    _polygon(3, math.pi / 2),
    _ring,
)
"""One symbol a tool, in the order of the tools; used again from the first where there are more tools."""
