"""Recognise spirals of straight sides: squares, rectangles, hexagons and octagons, with sharp or rounded corners.

In an inward spiral, each side lies one pitch further inside than the parallel side one turn before. Leads and stubs do
not have this offset, and are thus recognised.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby, pairwise

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.geometry.path import TWO_PI, Arc, Line, Point
from sitscad.spec.drawn.arcs import DEVIATION, STRAIGHT, DrawnSpiral, DrawnTurns
from sitscad.spec.drawn.copper import DrawnCoilError, place_text
from sitscad.spec.drawn.follow import DrawnRun

SHAPES = {4: "square", 6: "hexagon", 8: "octagon"}
"""Shapes of coils whose estimates have known error bounds, by their number of sides."""

REGULAR = math.radians(0.5)
"""Largest angular deviation (rad) of a drawn polygon from a regular one.

It limits the difference of each corner's angle from the regular angle, and the tilt of the side at +x from the y axis.
"""

LEAST_TURNS = 2
"""Smallest number of turns of a layer. With fewer turns, no side has a parallel side one turn before it."""


@record(eq=False)
class _Side:
    """A straight side of a run: indices of its first and last segment, its ends, and its heading (rad)."""

    first: int
    last: int
    start: Point
    end: Point
    heading: float

    @property
    def length(self) -> float:
        """Length (m)."""
        return self.start.distance(self.end)

    def along(self, point: Point) -> float:
        """Return the coordinate (m) of a point along the heading."""
        return point.x * math.cos(self.heading) + point.y * math.sin(self.heading)


@record(eq=False)
class _LayerFit:
    """The sides of one run that form a spiral, in the order of the current.

    `normals` are the directions (rad) in which the sides face outwards. `sense` is +1 if the current turns
    counter-clockwise, else -1. `pitch` (m) is the distance between successive turns. `is_mid_side` is True if the
    spiral starts and ends in the middle of sides.
    """

    turns: DrawnTurns
    sides: tuple[_Side, ...]
    normals: Array
    sense: int
    inward: bool
    pitch: float
    is_mid_side: bool


def polygon_spiral(runs: Sequence[DrawnRun], width: float) -> DrawnSpiral:
    """Return the spiral of straight sides that the runs form. Raises DrawnCoilError if they form none.

    `width` (m) is the track width.
    """
    count = _side_count(runs[0])
    layers = [_fit_layer(run, count, width) for run in runs]
    pitch = float(np.mean([layer.pitch for layer in layers]))
    rows, values = [], []
    for layer in layers:
        number = np.arange(len(layer.sides))
        turn = (number if layer.inward else number[::-1]) // count
        is_even = np.round(layer.normals / (TWO_PI / count)).astype(int) % 2 == 0
        along_x = is_even if count == 4 else np.ones_like(is_even)
        places = np.array([side.start for side in layer.sides])
        cos, sin = np.cos(layer.normals), np.sin(layer.normals)
        rows.append(np.column_stack([cos, sin, 0.5 * along_x, 0.5 * ~along_x]))
        values.append(places[:, 0] * cos + places[:, 1] * sin + width / 2 + pitch * turn)
    table, offsets = np.vstack(rows), np.concatenate(values)
    x, y, size_x, size_y = np.linalg.lstsq(table, offsets, rcond=None)[0].tolist()
    is_long = count == 4 and abs(size_x - size_y) > pitch + DEVIATION * width
    if count == 4 and not is_long:
        size_x = size_y = 0.5 * (size_x + size_y)
    size = (round(size_x, 9), round(size_y if is_long else size_x, 9))
    away = np.abs(table @ np.array([x, y, size_x, size_y]) - offsets)
    if away.max() > pitch + DEVIATION * width:
        side = [side for layer in layers for side in layer.sides][int(away.argmax())]
        raise DrawnCoilError(f"the side at {place_text(side.start)} lies {show(float(away.max()), 'm', 2)} from the "
                             f"{SHAPES[count]} of the others: sides and layers of unequal size are not computed")
    if is_long and size_y > size_x:
        raise DrawnCoilError("the coil is longer along y than along x: turn the drawing by 90 degrees")
    centre = Point(x, y)
    turns = [layer.turns for layer in layers]
    radii = [each.radius for each in layers[0].turns.path if isinstance(each, Arc)]
    is_mid_side = all(layer.is_mid_side for layer in layers)
    return DrawnSpiral(
        "rectangle" if is_long else SHAPES[count], size, pitch, centre, tuple(turns),
        tuple((len(layer.sides) - layer.is_mid_side) / count for layer in layers),
        tuple(layer.inward for layer in layers), tuple(layer.sense for layer in layers),
        is_mid_side=is_mid_side, corner_radius=round(max(radii, default=0.0), 9), deviation=float(away.max()),
    )


def _sides(run: DrawnRun) -> list[_Side]:
    """Return the straight sides of a run. Segments in line with each other are one side."""
    headings = [math.atan2(each.end.y - each.start.y, each.end.x - each.start.x) if isinstance(each, Line) else None
                for each in run.path]
    sides: list[_Side] = []
    for k, (segment, heading) in enumerate(zip(run.path, headings, strict=True)):
        if heading is None:
            continue
        before = sides[-1] if sides else None
        if before is not None and before.last == k - 1 and abs(_turn(before.heading, heading)) < STRAIGHT:
            sides[-1] = _Side(before.first, k, before.start, segment.end, before.heading)
        else:
            sides.append(_Side(k, k, segment.start, segment.end, heading))
    return sides


def _turn(heading: float, following: float) -> float:
    return math.remainder(following - heading, TWO_PI)


def _side_count(run: DrawnRun) -> int:
    """Return the number of sides in a turn, from the median angle between successive sides.

    Raises DrawnCoilError if no shape in `SHAPES` has this number.
    """
    turns = [abs(_turn(a.heading, b.heading)) for a, b in pairwise(_sides(run))]
    count = round(TWO_PI / max(float(np.median(turns)), 1e-3)) if turns else 0
    if count not in SHAPES:
        raise DrawnCoilError(f"the straight sides on {run.layer} wind none of the shapes with known errors: "
                             f"{', '.join(SHAPES.values())}, rectangle, circle")
    return count


def _fit_layer(run: DrawnRun, count: int, width: float) -> _LayerFit:
    """Return the longest part of a run in which the sides move by one pitch, inwards or outwards, from turn to turn.

    `count` is the number of sides in a turn, and `width` (m) the track's width.
    """
    sides = _sides(run)
    turns = np.array([_turn(a.heading, b.heading) for a, b in pairwise(sides)])
    sense = int(np.sign(np.median(turns))) if turns.size else 1
    normals = np.array([side.heading for side in sides]) - sense * math.pi / 2
    offsets = np.array([side.start.x * math.cos(a) + side.start.y * math.sin(a)
                        for side, a in zip(sides, normals.tolist(), strict=True)])
    steps = offsets[count:] - offsets[:-count]
    if len(steps) < (LEAST_TURNS - 1) * count:
        raise DrawnCoilError(f"the straight sides on {run.layer} make fewer than {LEAST_TURNS} turns: fewer are not "
                             "recognised")
    step = float(np.median(steps))
    is_regular = np.abs(turns - sense * TWO_PI / count) < REGULAR
    is_good = [abs(each - step) <= DEVIATION * width and bool(is_regular[k : k + count].all())
               for k, each in enumerate(steps.tolist())]
    stretches = [[k for k, _ in group] for good, group in groupby(enumerate(is_good), lambda pair: pair[1]) if good]
    longest = max(stretches, key=len, default=[])
    first, last = (longest[0], longest[-1] + count) if longest else (0, 0)
    if last - first + 1 < len(sides) - 2 * count or last - first + 1 < LEAST_TURNS * count:
        odd = sides[min(last + 1, len(sides) - 1)]
        raise DrawnCoilError(f"the side at {place_text(odd.start, run.layer)} does not lie one pitch from the side a "
                             "turn before: only spirals of equal pitch are computed")
    tilt = math.remainder(float(normals[first]), TWO_PI / count)
    if abs(tilt) > REGULAR:
        raise DrawnCoilError(f"no side faces +x: turn the drawing by {math.degrees(-tilt):.3g} degrees")
    part = _SideRun(run, tuple(sides[first : last + 1]), count, step, 2.0 * abs(step) + 0.5 * width)
    is_mid_side, kept = part.spiral_sides()
    wound = _SideRun(run, part.sides[kept], count, step, part.reach)
    drawn_turns, outwards = DrawnTurns(run, *wound.ends), normals[first : last + 1][kept]
    return _LayerFit(drawn_turns, wound.sides, outwards, sense, step < 0.0, abs(step), is_mid_side)


@record(eq=False)
class _SideRun:
    """Successive sides of a run, with `count` sides in a turn.

    `step` (m) is the change of a side's distance from the coil's centre after one turn; it is negative inwards.
    `reach` (m) is the largest distance, along a side, between corners of successive turns.
    """

    run: DrawnRun
    sides: tuple[_Side, ...]
    count: int
    step: float
    reach: float

    @property
    def ends(self) -> tuple[int, int]:
        """Indices of the first and the last segment that belong to the spiral.

        Leads and stubs that continue a side straight on are left out. A segment of the side at an end counts as a lead
        or stub if it lies beyond the corner of the side one turn further on.
        """
        segments, head, tail = self.run.path.segments, self.sides[0], self.sides[-1]
        first, last = head.first, tail.last
        start = head.along(self.sides[self.count].start) + self.reach
        end = tail.along(self.sides[-1 - self.count].end) - self.reach
        while first < head.last and head.along(segments[first].end) <= start:
            first += 1
        while last > tail.first and tail.along(segments[last].start) >= end:
            last -= 1
        return first, last

    def spiral_sides(self) -> tuple[bool, slice]:
        """Return whether both ends lie in the middle of sides, and the slice of the sides that belong to the spiral.

        The expected length of the first or last side follows from the side one turn further on. If the side's length is
        neither the expected length nor half of it, the side is a lead or a stub and not part of the spiral.
        """
        segments, (first, last), (head, tail) = self.run.path.segments, self.ends, (self.sides[0], self.sides[-1])
        growth = 2.0 * math.tan(math.pi / self.count) * self.step
        rows = ((segments[first].start.distance(head.end), self.sides[self.count].length - growth),
                (tail.start.distance(segments[last].end), self.sides[-1 - self.count].length + growth))
        are_whole = [abs(length - expected) <= self.reach for length, expected in rows]
        are_half = [abs(length - 0.5 * expected) <= self.reach for length, expected in rows]
        is_mid_side = self.count == 4 and all(are_half) and not all(are_whole)
        return is_mid_side, slice(0, None) if is_mid_side else slice(
            int(not are_whole[0]), len(self.sides) - int(not are_whole[1]))
