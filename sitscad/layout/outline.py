"""The board's outline: the body under the coils, a taper, and the tail."""

from __future__ import annotations

from dataclasses import dataclass

from sitscad.geometry.path import Path, Point, rounded
from sitscad.layout.tail import TailFrame

BODY_CORNER_RADIUS = 0.5e-3
FILLET_RADIUS = 0.5e-3
"""Corners are rounded: what touches tissue has no sharp edge, and inner corners of a flex tear (m)."""


@dataclass(frozen=True)
class Body:
    """The part of the board on the jaw: from `start` to `end` along x, `half_width` to both sides of the axis (m)."""

    start: float
    end: float
    half_width: float


def outline(body: Body, tail: TailFrame) -> Path:
    """The closed outline, counter-clockwise from the body's far lower corner."""
    wide, narrow = body.half_width, tail.half_width
    lower = [
        (Point(body.start, -wide), BODY_CORNER_RADIUS),
        (Point(tail.body_end, -wide), FILLET_RADIUS),
        (Point(tail.start, -narrow), FILLET_RADIUS),
        (Point(tail.end, -narrow), 0.0),
    ]
    if abs(wide - narrow) < 1e-9:
        lower = [lower[0], lower[3]]
    upper = [(point._replace(y=-point.y), radius) for point, radius in reversed(lower)]
    corners = [point for point, _ in lower + upper]
    radii = [_fitting(corners, i, radius) for i, (_, radius) in enumerate(lower + upper)]
    return rounded(corners, radii)


def _fitting(corners: list[Point], index: int, radius: float) -> float:
    """The radius, at most a fifth of the shorter of the two sides that meet in the corner (and none where that is nothing)."""
    here, count = corners[index], len(corners)
    return min(radius, 0.2 * min(here.distance(corners[index - 1]), here.distance(corners[(index + 1) % count])))
