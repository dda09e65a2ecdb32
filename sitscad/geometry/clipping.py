"""The parts of paths inside a box, for details that show a part of the board."""

from __future__ import annotations

from itertools import pairwise

from sitscad.geometry.path import Path, Point, bounding_box, closed_polygon, polyline

Box = tuple[float, float, float, float]


def parts_inside(path: Path, box: Box) -> list[Path]:
    """The parts of a path in a box (m), cut where it leaves the box; the path itself where all of it is inside."""
    x0, y0, x1, y1 = bounding_box([path])
    if x0 >= box[0] and y0 >= box[1] and x1 <= box[2] and y1 <= box[3]:
        return [path]
    points = path.flattened(2e-6)
    runs: list[list[tuple[float, float]]] = [[]]
    for a, b in pairwise(points):
        kept = _clipped(a, b, box)
        if kept is None:
            runs.append([])
            continue
        start, end = kept
        if not runs[-1] or runs[-1][-1] != start:
            runs.append([start])
        runs[-1].append(end)
    return [polyline(run) for run in runs if len(run) > 1]  # type: ignore[arg-type]


def area_inside(path: Path, box: Box) -> Path | None:
    """The part of a convex-cornered area in a box (m), given by its outline (Sutherland and Hodgman 1974); None where
    there is none. Arcs that are cut count as chords within 2 um.
    """
    x0, y0, x1, y1 = bounding_box([path])
    if x0 >= box[0] and y0 >= box[1] and x1 <= box[2] and y1 <= box[3]:
        return path
    points: list[tuple[float, float]] = [(p.x, p.y) for p in path.flattened(2e-6)]
    for axis in (0, 1):
        for bound, sign in ((box[axis], 1.0), (box[axis + 2], -1.0)):
            points = _cut(points, axis, bound, sign)
    return closed_polygon([Point(*p) for p in points]) if len(points) > 2 else None


def beyond(path: Path, x: float) -> Path:
    """The part of a closed path's area beyond a place along x (m), arcs as chords within 2 um."""
    points: list[tuple[float, float]] = [(p.x, p.y) for p in path.flattened(2e-6)[:-1]]
    return closed_polygon([Point(*p) for p in _cut(points, 0, x, 1.0)])


def _cut(points: list[tuple[float, float]], axis: int, bound: float, sign: float) -> list[tuple[float, float]]:
    """A polygon's part on one side of a line across an axis."""
    found: list[tuple[float, float]] = []
    for a, b in zip(points[-1:] + points[:-1], points, strict=True):
        here, there = sign * (a[axis] - bound), sign * (b[axis] - bound)
        if (here < 0.0) != (there < 0.0):
            share = here / (here - there)
            found.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
        if there >= 0.0:
            found.append(b)
    return found


def _clipped(
    a: tuple[float, float], b: tuple[float, float], box: Box
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """The part of a straight piece inside a box (Liang and Barsky 1984); None where none is."""
    low, high = 0.0, 1.0
    for axis in (0, 1):
        step = b[axis] - a[axis]
        for bound, sign in ((box[axis], -1.0), (box[axis + 2], 1.0)):
            room, pace = sign * (bound - a[axis]), sign * step
            if abs(pace) < 1e-15:
                if room < 0.0:
                    return None
            elif pace > 0.0:
                high = min(high, room / pace)
            else:
                low = max(low, room / pace)
    if low >= high:
        return None
    at = [(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])) for t in (low, high)]
    return (a if low == 0.0 else at[0]), (b if high == 1.0 else at[1])
