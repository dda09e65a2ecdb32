"""Curves of a drawn coil: arcs that replace the short chords of a layout generator, and the spiral of the turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Line, Path, Point, Segment, arc_through
from sitscad.spec.drawn.follow import GENTLE, DrawnRun


def with_arcs(path: Path) -> Path:
    """Return a path with arcs in place of successive chords that approximate a curve.

    Generators write a curve as chords between points on it. The mean radius of a chord is less than the radius of its
    end points, by a third of the chord's sagitta. The points are therefore moved inwards by a third of the sagitta.
    Each arc passes through three of the moved points.
    """
    segments = merge_straight_segments(path)
    replaced: list[Segment] = []
    k = 0
    while k < len(segments):
        last = k
        while last + 1 < len(segments) and _is_curve(segments[last], segments[last + 1], segments[max(k, last - 1)]):
            last += 1
        if last - k < 2:
            replaced.append(segments[k])
            k += 1
            continue
        replaced += _arcs_from_chords(segments[k : last + 1])
        k = last + 1
    return Path(tuple(replaced))


def merge_straight_segments(path: Path) -> list[Segment]:
    """Return the segments of a path. Successive straight segments that turn by less than `STRAIGHT` are merged."""
    merged: list[Segment] = []
    for segment in path:
        before = merged[-1] if merged else None
        if isinstance(segment, Line) and isinstance(before, Line) and abs(_turn(before, segment)) < STRAIGHT:
            merged[-1] = Line(before.start, segment.end)
        else:
            merged.append(segment)
    return merged


STRAIGHT = 1e-4
"""Angle (rad) between two straight segments below which they count as a single line."""


def _turn(chord: Segment, following: Segment) -> float:
    """Return the angle (rad) from one chord to the next, positive to the left."""
    (ax, ay), (bx, by) = chord.end - chord.start, following.end - following.start
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)


def _is_curve(chord: Segment, following: Segment, before: Segment) -> bool:
    """Whether the chords `chord` and `following` approximate a curve. `before` is the chord before them.

    Their lengths must differ by less than a factor of 2. The angle between them must be small. It must have the sign of
    the angle before, and differ from it by less than a factor of 2.
    """
    if not (isinstance(chord, Line) and isinstance(following, Line) and isinstance(before, Line)):
        return False
    turn = _turn(chord, following)
    if not STRAIGHT < abs(turn) <= GENTLE or not 0.5 < chord.length / following.length < 2.0:
        return False
    earlier = _turn(before, chord) if before is not chord else turn
    return earlier * turn > 0.0 and 0.5 < earlier / turn < 2.0


def _arcs_from_chords(chords: Sequence[Segment]) -> list[Segment]:
    """Return arcs in place of chords that all turn in one sense. The arcs enclose the area that the chords enclose.

    If the number of chords is odd, one piece stays a straight line.
    """
    points = [chords[0].start, *(chord.end for chord in chords)]
    moved = [points[0]]
    for before, point, after in zip(points, points[1:], points[2:], strict=False):
        (ax, ay), (bx, by) = point - before, after - point
        length, turn = 0.5 * (math.hypot(ax, ay) + math.hypot(bx, by)), math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        inwards = length * math.tan(turn / 4.0) / 2.0 / 3.0  # a third of the sagitta
        span = math.hypot(ax + bx, ay + by)
        moved.append(point.shifted(-(ay + by) / span * inwards, (ax + bx) / span * inwards))
    moved.append(points[-1])
    arcs: list[Segment] = []
    turns = [abs(_turn(chord, following)) for chord, following in pairwise(chords)]
    # Arcs shorter than the track's width are less accurate
    chords_per_arc = 2 * max(1, round(ARC / (2.0 * max(turns))))
    first = 0
    while first < len(moved) - 1:
        last = len(moved) - 1 if len(moved) - 1 - first < 2 * chords_per_arc else first + chords_per_arc
        if (last - first) % 2:
            arcs.append(Line(moved[first], moved[first + 1]))
            first += 1
        if last > first:
            start, end = moved[first], moved[last]
            arcs.append(arc_through(start, moved[(first + last) // 2], end, 1e-9 * start.distance(end) ** 2))
        first = last
    return arcs


ARC = math.radians(24.0)
"""Approximate angle (rad) of an arc that replaces several chords.

An arc of this angle deviates from a spiral of usual pitch by less than 0.1 um.
"""


DEVIATION = 0.1
"""Largest permitted distance between drawn turns and the fitted spiral, divided by the track width."""


@record(eq=False)
class DrawnTurns:
    """The turns in a run: the run, and the indices of its first and last segment that belong to the spiral."""

    run: DrawnRun
    first: int
    last: int

    @property
    def path(self) -> Path:
        """Path of the turns, with arcs in place of chords."""
        return with_arcs(Path(self.run.path.segments[self.first : self.last + 1]))


@record(eq=False)
class DrawnSpiral:
    """The regular spiral that a drawn conductor follows: shape, size (m), pitch (m) and centre (m).

    Four fields have one entry for each layer: the drawn turns, their number, whether the current flows inwards, and the
    sense of winding along the current (+1 counter-clockwise). `deviation` (m) is the largest distance between the drawn
    turns and this spiral.
    """

    shape: str
    size: tuple[float, float]
    pitch: float
    centre: Point
    turns: tuple[DrawnTurns, ...]
    counts: tuple[float, ...]
    inward: tuple[bool, ...]
    senses: tuple[int, ...]
    is_mid_side: bool = False
    corner_radius: float = 0.0
    deviation: float = 0.0
