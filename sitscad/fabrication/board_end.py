"""The board's end with its contacts, and the width of the tail: what a connector takes, as figures for the papers."""

from __future__ import annotations

import math
from itertools import pairwise

from sitscad.fabrication.notes import contact_row
from sitscad.geometry.path import Point
from sitscad.layout.board import Layout
from sitscad.layout.pieces import Pad
from sitscad.record import record

SAME = 1e-6
"""Widths (m) that differ by less are one: the outline's arcs are chords within this."""


@record
class BoardEnd:
    """What is plugged in, or soldered to: lengths in metres.

    ``width`` is the board's across the row of contacts, between ``sides`` (their coordinates across the row); ``edge``
    from the middle of contact 1 to the board's edge beside it; ``tip`` from the contacts' ends to the board's end, at
    the coordinate ``end`` along the contacts.
    """

    first: Pad
    width: float
    sides: tuple[float, float]
    edge: float
    tip: float
    end: float


def board_end(layout: Layout) -> BoardEnd:
    """The figures of the board's end, read from the outline as it is drawn."""
    row, _ = contact_row(layout)
    first = min(layout.pads, key=lambda pad: pad.number)
    along = runs_along_x(row)
    x, y = first.centre
    at, place = (x, y) if along else (y, x)
    sides = _beside(_crossings(layout, at, upright=along), place)
    ends = _crossings(layout, place, upright=not along)
    half = first.size[0 if along else 1] / 2
    end = min((e for e in ends if abs(e - at) > half - SAME), key=lambda e: abs(e - at))
    edge = min(abs(side - place) for side in sides)
    return BoardEnd(first, sides[1] - sides[0], sides, edge, abs(end - at) - half, end)


def runs_along_x(row: tuple[Pad, ...]) -> bool:
    """Whether the contacts of a row stand above each other, so that each runs along x."""
    xs, ys = [pad.centre.x for pad in row], [pad.centre.y for pad in row]
    if max(xs) - min(xs) == max(ys) - min(ys):
        return row[0].size[0] >= row[0].size[1]
    return max(xs) - min(xs) < max(ys) - min(ys)


def tail_width(layout: Layout) -> tuple[float, float, float] | None:
    """Where along x the tail runs at one width for longest, and its lower and upper edge there (m); None without one.

    Near the body's end of that run, a tenth along it: of a tail that turns, before its turn; of one that is led aside,
    in the longer part.
    """
    if layout.spec.fpc.tail is None or not layout.pads:
        return None
    start, end = layout.body[2], min(pad.centre.x - pad.size[0] / 2 for pad in layout.pads)
    edges = [
        (a, b)
        for a, b in pairwise(layout.outline.flattened(SAME))
        if abs(a.y - b.y) < SAME and min(max(a.x, b.x), end) - max(min(a.x, b.x), start) > SAME
    ]
    runs = [_overlap(one, other, start, end) for i, one in enumerate(edges) for other in edges[i + 1 :]]
    best = max((run for run in runs if run[1] > run[0]), key=lambda run: (run[1] - run[0], -run[0]), default=None)
    return None if best is None else (best[0] + 0.1 * (best[1] - best[0]), best[2], best[3])


def _overlap(
    one: tuple[Point, Point], other: tuple[Point, Point], start: float, end: float
) -> tuple[float, float, float, float]:
    """From which x to which two level edges run beside each other, and their two y, the lower one first."""
    (a, b), (c, d) = one, other
    begin = max(min(a.x, b.x), min(c.x, d.x), start)
    low, high = sorted((a.y, c.y))
    return begin, min(max(a.x, b.x), max(c.x, d.x), end), low, high


def _crossings(layout: Layout, at: float, upright: bool) -> list[float]:
    """Where the outline crosses a line x = `at` (upright: their y) or y = `at` (their x)."""
    found = []
    for a, b in pairwise(layout.outline.flattened(SAME)):
        (p, q), (r, s) = ((a.x, a.y), (b.x, b.y)) if upright else ((a.y, a.x), (b.y, b.x))
        if min(p, r) <= at <= max(p, r) and p != r:
            found.append(q + (at - p) / (r - p) * (s - q))
    return sorted(found)


def _beside(crossings: list[float], place: float) -> tuple[float, float]:
    """The nearest crossings below and above a place."""
    below = max((c for c in crossings if c <= place), default=-math.inf)
    return below, min((c for c in crossings if c >= place), default=math.inf)
