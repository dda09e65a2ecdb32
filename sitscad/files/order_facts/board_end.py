"""Contacts, board outline at the contacts, and tail width, as dimensions and as text for the documents."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.data import Row, rows
from sitscad.kernels.geometry.path import Path, Region, bounding_box
from sitscad.layout.board import Pad
from sitscad.spec.circuit import FpcSpec, Stackup, Tail
from sitscad.spec.presets import cover_name

SAME = 1e-6
"""Largest difference (m) between two widths of the outline that count as equal.

It is also the largest distance between the outline's arcs and the chords that replace them.
"""


@record
class BoardEnd:
    """Dimensions (m) of the board's end that is plugged in or soldered to.

    * ``first``: contact 1
    * ``width``: the board's width across the row of contacts
    * ``sides``: coordinates of both sides between which the width is measured
    * ``edge``: distance from the middle of contact 1 to the nearest edge of the board beside it
    * ``tip``: distance from the ends of the contacts to the board's end
    * ``end``: coordinate of the board's end along the contacts
    """

    first: Pad
    width: float
    sides: tuple[float, float]
    edge: float
    tip: float
    end: float


def board_end(outline: Path, pads: tuple[Pad, ...]) -> BoardEnd:
    """Return the dimensions of the board's end, measured in the outline as drawn."""
    row, _ = contact_row(pads)
    first = min(pads, key=lambda pad: pad.number)
    is_along_x = runs_along_x(row)
    x, y = first.centre
    at, place = (x, y) if is_along_x else (y, x)
    crossings = _crossings(outline, at, upright=is_along_x)
    below = max((c for c in crossings if c <= place), default=-math.inf)
    above = min((c for c in crossings if c >= place), default=math.inf)
    ends = _crossings(outline, place, upright=not is_along_x)
    half = first.size[0 if is_along_x else 1] / 2
    end = min((e for e in ends if abs(e - at) > half - SAME), key=lambda e: abs(e - at))
    edge = min(place - below, above - place)
    return BoardEnd(first, above - below, (below, above), edge, abs(end - at) - half, end)


def runs_along_x(row: tuple[Pad, ...]) -> bool:
    """Whether each contact runs along x, because the contacts of the row are stacked along y."""
    xs, ys = [pad.centre.x for pad in row], [pad.centre.y for pad in row]
    if max(xs) - min(xs) == max(ys) - min(ys):
        return row[0].size[0] >= row[0].size[1]
    return max(xs) - min(xs) < max(ys) - min(ys)


def tail_width(
    body_end: float, outline: Path, pads: tuple[Pad, ...], tail: Tail | None
) -> tuple[float, float, float] | None:
    """Return a place x and the tail's lower and upper y there (m), on the longest stretch of constant width.

    The place lies a tenth of the stretch's length from its end at the body. For a tail that turns, the stretch lies
    before the turn. For a tail with an offset, it is the longer of the two straight parts. None if there is no tail, no
    contact or no such stretch.
    """
    if tail is None or not pads:
        return None
    start, end = body_end, min(pad.centre.x - pad.size[0] / 2 for pad in pads)
    edges = [
        (max(min(a.x, b.x), start), min(max(a.x, b.x), end), a.y)
        for a, b in pairwise(outline.flattened(SAME))
        if abs(a.y - b.y) < SAME and min(max(a.x, b.x), end) - max(min(a.x, b.x), start) > SAME
    ]
    runs = (
        (max(first[0], other[0]), min(first[1], other[1]), *sorted((first[2], other[2])))
        for first, other in combinations(edges, 2)
    )
    beside = (run for run in runs if run[1] > run[0])
    best = max(beside, key=lambda run: (run[1] - run[0], -run[0]), default=None)
    return None if best is None else (best[0] + 0.1 * (best[1] - best[0]), best[2], best[3])


def _crossings(outline: Path, at: float, upright: bool) -> list[float]:
    """Return the sorted coordinates (m) at which the outline crosses a line parallel to an axis.

    The line is x = `at` (m) if `upright`, otherwise y = `at`.
    """
    crossings = []
    for a, b in pairwise(outline.flattened(SAME)):
        (p, q), (r, s) = ((a.x, a.y), (b.x, b.y)) if upright else ((a.y, a.x), (b.y, b.x))
        if min(p, r) <= at <= max(p, r) and p != r:
            crossings.append(q + (at - p) / (r - p) * (s - q))
    return sorted(crossings)


def contact_row(pads: tuple[Pad, ...]) -> tuple[tuple[Pad, ...], float | None]:
    """Return the contacts in their order along the row, and their pitch (m).

    The pitch is None if the contacts do not form one straight row with equal steps.
    """
    xs, ys = [pad.centre.x for pad in pads], [pad.centre.y for pad in pads]
    across = max(xs) - min(xs) > max(ys) - min(ys)
    row = tuple(sorted(pads, key=lambda pad: pad.centre.x if across else pad.centre.y))
    steps = [(b.centre.x - a.centre.x, b.centre.y - a.centre.y) for a, b in pairwise(row)]
    pitches = {round((dx if across else dy) * 1e9) for dx, dy in steps}
    beside = {round((dy if across else dx) * 1e9) for dx, dy in steps}
    return row, pitches.pop() * 1e-9 if len(pitches) == 1 and beside == {0} else None


def contact_text(pads: tuple[Pad, ...], stackup: Stackup, top_openings: tuple[Region, ...]) -> str:
    """Describe the contacts: number, width, length, pitch, bare area, and contacts that no coil uses.

    Empty if there are no contacts.
    """
    if not pads:
        return ""
    _, pitch = contact_row(pads)
    width, length = contact_size(pads[0])
    apart = f", pitch {show(pitch, 'm')}" if pitch is not None else ""
    size = f"{len(pads)} contacts {show(width, 'm')} wide and {show(length, 'm')} long{apart}"
    bare_area = bare_size(pads, top_openings)
    if bare_area is None:
        return f"{size}{unused_text(pads)}"
    is_held_all_round = bare_area[0] < width - 1e-9
    cover = cover_name(stackup)
    under = f"the {cover} covers their rims" if is_held_all_round else f"the rest goes on under the {cover}"
    wide = f"{show(bare_area[0], 'm')} x " if is_held_all_round else ""
    return f"{size}, bare over {wide}{show(bare_area[1], 'm')} ({under}){unused_text(pads)}"


def bare_size(pads: tuple[Pad, ...], top_openings: tuple[Region, ...]) -> tuple[float, float] | None:
    """Return width and length (m) of the part of a contact that the coverlay leaves bare; None if it is all bare."""
    pad = pads[0]
    (x, y), (w, h) = pad.centre, pad.size
    for opening in top_openings:
        x0, y0, x1, y1 = bounding_box([opening.outline])
        if x0 <= x <= x1 and y0 <= y <= y1:
            extent = min(x + w / 2, x1) - max(x - w / 2, x0)
            across = min(y + h / 2, y1) - max(y - h / 2, y0)
            width, length = sorted((extent, across))
            return (width, length) if w * h - width * length > 1e-12 else None
    return None


def unused_text(pads: tuple[Pad, ...]) -> str:
    """Name the contacts that no coil uses; empty if there are none."""
    numbers = [pad.number for pad in pads if pad.is_unused]
    if not numbers:
        return ""
    text = f"contacts {', '.join(map(str, numbers))} lead" if len(numbers) > 1 else f"contact {numbers[0]} leads"
    return f"; {text} nowhere: copper all the same, which the connector holds the tail by"


def plug_text(pads: tuple[Pad, ...], fpc: FpcSpec) -> str:
    """Describe the width of the tail at the connector, with its tolerance.

    Empty if the connector has no width tolerance or the board has no contacts.
    """
    tail = fpc.tail
    if tail is None or not tail.connector.width_tolerance or not pads:
        return ""
    connector = tail.connector
    width, band = show(connector.width(len(pads)), "m"), show(end_tolerance(fpc), "m")
    edge = show(connector.edge_margin, "m")
    return f"tail {width} +/- {band} wide there, middle of the first and last contact {edge} from its edges"


def end_tolerance(fpc: FpcSpec) -> float:
    """Return the tolerance (m) of the board's width at the contacts.

    It is the connector's tolerance if the connector has one, otherwise the tolerance of the outline in the design
    rules.
    """
    tail = fpc.tail
    tolerance = tail.connector.width_tolerance if tail is not None else 0.0
    return tolerance or fpc.rules.outline_tolerance


def contact_size(pad: Pad) -> tuple[float, float]:
    """Return width and length (m) of a contact: the shorter and the longer side."""
    width, length = sorted(pad.size)
    return width, length


def footprint_row(symbol: str, pins: int) -> Row | None:
    """Return the row of the table ``footprints`` for a part. None if the table has no such part.

    `symbol` is the name of the part's symbol. `pins` is its number of pins, on which the row for a socket depends.
    """
    footprints = (row for row in rows("footprints") if row["symbol"] == symbol)
    return next((row for row in footprints if not row["most"] or pins <= int(row["most"])), None)


def socket_pad(pads: tuple[Pad, ...], tail: Tail | None, contact: int) -> int:
    """Return the number of the socket pad, on the converter's board, that touches a contact.

    A socket with bottom contacts takes the tail face down, so the last contact touches pad 1.
    """
    count = len(pads)
    row = footprint_row(tail.connector.name, count) if tail is not None else None
    return count + 1 - contact if row is not None and row["order"] == "reversed" else contact
