"""The panel: copies of a part that is too small to be handled alone, held by bridges in a frame that is ordered whole.

The frame carries tooling holes and fiducials, three of each, so that it cannot be loaded the wrong way round, and
coupons: the sensor's first coil alone with solder pads, to measure its inductance before any part is cut out.
All parts lie the same way, so that every tail runs along the same grain of the film. Lengths in metres, the panel's
lower left corner is the origin.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.geometry.path import Path, Point, bounding_box
from sitscad.layout.board import Layout
from sitscad.layout.cutting.bridges import FEWEST_BRIDGES, Bridge, bridges, cut_lines
from sitscad.record import record
from sitscad.spec.circuit import MOST_PARTS
from sitscad.spec.coil import ArraySpec, CoilPlacement
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

TOOLING_HOLE = 1.5e-3
FIDUCIAL = 1.0e-3
FIDUCIAL_OPENING = 2.0e-3
FIDUCIAL_STEP = 5.0e-3
"""Distance (m) of a fiducial from its tooling hole."""


@record
class Panel:
    """Copies of a board in a frame. ``parts`` and ``coupons`` are how far each copy's own origin is moved.

    ``coupon`` is None where there is none; ``no_coupon`` then says why.
    """

    layout: Layout
    size: tuple[float, float]
    columns: int
    rows: int
    parts: tuple[Point, ...]
    bridges: tuple[Bridge, ...]
    coupon: Layout | None
    coupons: tuple[Point, ...]
    coupon_bridges: tuple[Bridge, ...]
    no_coupon: str
    tooling_holes: tuple[Point, ...]
    fiducials: tuple[Point, ...]
    rail: float

    @property
    def cuts(self) -> tuple[Path, ...]:
        """The cuts round all parts and coupons: open paths that stop at the bridges."""
        found = [piece.shifted(*at) for at in self.parts for piece in cut_lines(self.layout.outline, self.bridges)]
        if self.coupon is not None:
            pieces = cut_lines(self.coupon.outline, self.coupon_bridges)
            found += [piece.shifted(*at) for at in self.coupons for piece in pieces]
        return tuple(found)


def is_too_small(layout: Layout) -> bool:
    """Whether the board is smaller than the smallest part that the fabricator handles singly."""
    x0, y0, x1, y1 = bounding_box([layout.outline])
    have, need = sorted((x1 - x0, y1 - y0)), sorted(layout.spec.fpc.rules.part_size)
    return any(size < smallest - 1e-9 for size, smallest in zip(have, need, strict=True))


def is_wanted(layout: Layout) -> bool:
    """Whether the spec asks for a panel, or leaves it to the size of the part and the part is too small."""
    wish = layout.spec.fpc.panel.wish
    return wish == "always" or (wish == "auto" and is_too_small(layout))


def least_size(layout: Layout) -> tuple[float, float]:
    """The least sides (m) of a panel with the parts that the spec asks for, or with one; without a coupon."""
    wish, cell = layout.spec.fpc.panel, _sides(bounding_box([layout.outline]))
    columns, rows = wish.parts or (1, 1)
    frame = 2 * (wish.rail + wish.gap) - wish.gap
    return columns * (cell[0] + wish.gap) + frame, rows * (cell[1] + wish.gap) + frame


def plan(layout: Layout) -> Panel | None:
    """The panel of a board; None where none is wanted."""
    if not is_wanted(layout):
        return None
    wish = layout.spec.fpc.panel
    coupon, no_coupon = _coupon(layout)
    box, coupon_box = bounding_box([layout.outline]), bounding_box([coupon.outline]) if coupon else None
    cell, coupon_cell = _sides(box), _sides(coupon_box) if coupon_box else (0.0, 0.0)
    columns, rows = wish.parts or _count(layout, cell, coupon_cell)
    gap, frame = wish.gap, wish.rail + wish.gap
    inner = max(columns * (cell[0] + gap) - gap, coupon_cell[0])
    strip = coupon_cell[1] + gap if coupon else 0.0
    size = inner + 2 * frame, rows * (cell[1] + gap) - gap + strip + 2 * frame
    parts = tuple(
        _on_grid(frame + i * (cell[0] + gap) - box[0], frame + strip + j * (cell[1] + gap) - box[1])
        for j in range(rows)
        for i in range(columns)
    )
    return Panel(
        layout, size, columns, rows, parts, bridges(layout), coupon,
        _coupon_places(coupon_box, inner, frame, gap), bridges(coupon) if coupon else (), no_coupon,
        *_marks(size, wish.rail), wish.rail,
    )  # fmt: skip


def _coupon(layout: Layout) -> tuple[Layout | None, str]:
    """The first coil alone on a piece of the same stack-up with solder pads; or None and the reason."""
    from sitscad.layout.arrangement import (
        arrange,  # a panel is drawn seldom, and the package imports its parts from here
    )

    spec = layout.spec
    if spec.fpc.tail is None and len(spec.array.placements) == 1:
        return None, "the part is a single coil with solder pads: every part is its own coupon"
    coupon = arrange(coupon_spec(spec))
    if coupon.shortfalls or not all(coil.is_closed_circuit for coil in coupon.coils):
        reasons = "; ".join(lack.message for lack in coupon.shortfalls) or "the coil does not reach its pads"
        return None, f"a single coil with solder pads finds no room: {reasons}"
    if len(bridges(coupon)) < FEWEST_BRIDGES:
        return None, f"bridges of {show(spec.fpc.panel.bridge, 'm')} find fewer than three places on it"
    return coupon, ""


def coupon_spec(spec: SensorSpec) -> SensorSpec:
    """The sensor reduced to its first coil in free air, with solder pads in place of the tail."""
    first = replace(spec.array.placements[0], centre=(0.0, 0.0))
    alone = ArraySpec("single", (CoilPlacement("C1", first.centre, first.rotation),))
    readout = replace(spec.readout, chip=None)
    nothing = {"target": None, "elastomer": None, "encapsulation": None, "mount": None, "shield": None}
    return replace(spec, array=alone, fpc=replace(spec.fpc, tail=None), readout=readout, **nothing)  # type: ignore[arg-type]


def _coupon_places(
    box: tuple[float, float, float, float] | None, inner: float, frame: float, gap: float
) -> tuple[Point, ...]:
    """A coupon at either end of the lowest row, to see a drift across the panel; one where there is no room for two."""
    if box is None:
        return ()
    width = box[2] - box[0]
    lefts = [frame, frame + inner - width] if inner >= 2 * width + gap else [frame]
    return tuple(_on_grid(left - box[0], frame - box[1]) for left in lefts)


def _count(layout: Layout, cell: tuple[float, float], coupon: tuple[float, float]) -> tuple[int, int]:
    """Columns and rows that fill the fabricator's usual panel: one of each at least, `MOST_PARTS` boards at most."""
    wish, room = layout.spec.fpc.panel, layout.spec.fpc.rules.panel_size
    frame = 2 * wish.rail + wish.gap
    strip = coupon[1] + wish.gap if coupon[1] else 0.0
    columns = math.floor((room[0] - frame + 1e-9) / (cell[0] + wish.gap))
    rows = math.floor((room[1] - frame - strip + 1e-9) / (cell[1] + wish.gap))
    columns = min(max(1, columns), MOST_PARTS)
    return columns, min(max(1, rows), MOST_PARTS // columns)


def _marks(size: tuple[float, float], rail: float) -> tuple[tuple[Point, ...], tuple[Point, ...]]:
    """Tooling holes in three corners of the frame and a fiducial beside each."""
    edge, step = rail / 2.0, FIDUCIAL_STEP
    left, right, low, high = edge, size[0] - edge, edge, size[1] - edge
    holes = (Point(left, low), Point(right, low), Point(left, high))
    return holes, (Point(left + step, low), Point(right - step, low), Point(left + step, high))


def _sides(box: tuple[float, float, float, float]) -> tuple[float, float]:
    return box[2] - box[0], box[3] - box[1]


def _on_grid(x: float, y: float) -> Point:
    """A move by whole micrometres, which the files' grid of nanometres holds exactly."""
    return Point(round(x, 6), round(y, 6))
