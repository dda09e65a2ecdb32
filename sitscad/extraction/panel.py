"""The panel's files held against those of the single board and against the panel's list: every copy object by object,
the cuts up to their bridges, the frame's marks, the coupon's copper one winding between two pads.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from sitscad.extraction.artwork import ExtractionError, file_functions
from sitscad.extraction.coupon import compare_coupon, shown
from sitscad.extraction.panel_frame import (
    Box,
    cut_differences,
    frame_differences,
    inside_rails,
    mark_reach,
    shown_place,
)
from sitscad.extraction.panel_list import PanelList, Place, read_panel_list
from sitscad.extraction.plotted import COLUMNS, Plotted, drilled, plotted
from sitscad.record import record

OUTLINE, CUTS, EXTENT = "Profile,NP", "Other,Part_Cuts", "Other,Extent_of"

NEAR = 1e-6
"""So far (m) a cut's drawn line may stand over the outline's: rounding moves an arc's centre by nanometres."""


@record(eq=False)
class _Folder:
    """What the files of a folder plot, by their file functions; and the files' names."""

    objects: dict[str, Plotted]
    names: dict[str, str]

    def of(self, function: str) -> Plotted:
        """The objects of a file; none where there is no such file."""
        return self.objects.get(function, Plotted(np.zeros((0, len(COLUMNS)), np.int64)))


@record
class _Copies:
    """The panel's list, and the room (nm) that the single board and the coupon take where their origins are."""

    listed: PanelList
    board: Box
    coupon: Box


def compare_panel(board: Path, panel: Path) -> tuple[int, tuple[str, ...]]:
    """How many boards a panel holds, and every difference of its files from the single board's and its list's in words.

    A copy must show on every layer, and drill, just what the single board does, and be cut out up to its bridges;
    beside boards and coupons there are the frame's marks and what lies on the rails. Raises ExtractionError when a file
    cannot be read or one that is needed is missing.
    """
    apertures: dict[str, int] = {}
    single, whole = _read(board, apertures), _read(panel, apertures)
    for folder, path in ((single, board), (whole, panel)):
        if not len(folder.of(OUTLINE).objects):
            raise ExtractionError(f"no file in {path.name} draws an outline")
    copies = _copies(read_panel_list(panel), single, whole)
    return len(copies.listed.boards), tuple(_differences(single, whole, copies, list(apertures)))


def _read(folder: Path, apertures: dict[str, int]) -> _Folder:
    """A folder's files by what they call themselves; ExtractionError where two are the same."""
    objects: dict[str, Plotted] = {}
    names: dict[str, str] = {}
    for path, fields in sorted(file_functions(folder)):
        function = ",".join(fields)
        if function in objects:
            raise ExtractionError(f"{path.name} and {names[function]} both call themselves {function}")
        if fields[0] != "Drillmap":
            objects[function] = drilled(path) if fields[0] in ("Plated", "NonPlated") else plotted(path, apertures)
            names[function] = path.name
    return _Folder(objects, names)


def _copies(listed: PanelList, single: _Folder, whole: _Folder) -> _Copies:
    """Where the panel's boards and coupons stand, by what the list says and what is cut out."""
    board = _box([objects.boxes_of_ends() for objects in single.objects.values()])
    cuts, taken = whole.of(CUTS), np.zeros(len(whole.of(CUTS).objects), bool)
    for move in listed.boards:
        taken |= _inside(cuts, board, move)
    coupon = (0, 0, 0, 0)
    if listed.coupons:
        left = cuts.chosen(~taken)
        if not len(left.objects):
            raise ExtractionError("the panel's coupon is not cut out")
        x0, y0, x1, y1 = _box([left.boxes_of_ends()])
        (ax, ay), (bx, by) = listed.coupons[0], listed.coupons[-1]
        coupon = (x0 - ax, y0 - ay, x1 - bx, y1 - by)
    return _Copies(listed, board, coupon)


def _differences(single: _Folder, whole: _Folder, copies: _Copies, apertures: list[str]) -> Iterator[str]:
    """What differs between the panel and so many copies of the single board, in words."""
    listed, coupon = copies.listed, dict[str, Plotted]()
    yield from _size_difference(whole.of(OUTLINE), listed)
    for function in sorted({*single.objects, *whole.objects} - {OUTLINE}):
        if function not in whole.objects:
            yield f"the panel has nothing like {single.names[function]} ({function})"
            continue
        there, name = whole.of(function), whole.names[function]
        own, taken = single.of(function), np.zeros(len(there.objects), bool)
        if function == CUTS:
            own = there.chosen(_inside(there, copies.board, listed.boards[0])).shifted(*_back(listed.boards[0]))
            yield from _off_outline(own, single.of(OUTLINE), name, apertures)
            yield from cut_differences(own, listed.bridges, f"{name}, board 1")
            yield from _cut_bridges(own, listed.bridges, f"{name}, board 1", apertures)
        for number, move in enumerate(listed.boards, 1):
            inside = _inside(there, copies.board, move)
            taken |= inside
            yield from _unequal(own, there.chosen(inside).shifted(*_back(move)), f"{name}, board {number}")
        for number, move in enumerate(listed.coupons, 1):
            inside = _inside(there, copies.coupon, move)
            taken |= inside
            copy = there.chosen(inside).shifted(*_back(move))
            coupon.setdefault(function, copy)
            yield from _unequal(coupon[function], copy, f"{name}, coupon {number}", "the first coupon")
        if function == CUTS and listed.coupons:
            yield from cut_differences(coupon[function], listed.coupon_bridges, f"{name}, coupon 1")
            yield from _cut_bridges(coupon[function], listed.coupon_bridges, f"{name}, coupon 1", apertures)
        rest = there.chosen(~taken)
        if function.startswith(EXTENT):
            yield from _off_rails(rest, name, listed, apertures)
        else:
            yield from frame_differences(rest, function, name, listed, apertures)
    if listed.coupons:
        found = compare_coupon(coupon, apertures)
        yield from (f"the panel's coupon: {difference.kind.value}: {difference.message}" for difference in found)


def _size_difference(outline: Plotted, listed: PanelList) -> Iterator[str]:
    drawn = _box([outline.boxes_of_ends()])
    if drawn != (0, 0, *listed.size):
        wanted, there = (f"{x1 / 1e6:.4g} x {y1 / 1e6:.4g} mm" for x1, y1 in (listed.size, drawn[2:]))
        yield f"the panel's outline is {there}, its list says {wanted}"


def _unequal(own: Plotted, copy: Plotted, where: str, other: str = "the single board") -> Iterator[str]:
    """What a copy has too much or too little."""
    if np.array_equal(own.in_order(), copy.in_order()):
        return
    wanted, there = ({tuple(row) for row in each.objects.tolist()} for each in (own, copy))
    words = [
        f"{len(some)} objects {what} (the first at {_point(min(some))} of the board)"
        for some, what in ((wanted - there, "missing"), (there - wanted, "too many"))
        if some
    ]
    yield f"{where} is not as {other}: {', '.join(words) or 'objects doubled or in another order'}"


def _off_rails(rest: Plotted, name: str, listed: PanelList, apertures: Sequence[str]) -> Iterator[str]:
    """Whether the layers that tails are without are just on the rails, beside boards and coupons."""
    inner = shapely.box(*(each * 1e-9 for each in inside_rails(listed)))
    rails = shapely.box(0.0, 0.0, *(each * 1e-9 for each in listed.size)) - inner
    drawn = shown(rest, apertures) if len(rest.objects) else shapely.Polygon()
    if drawn.symmetric_difference(rails).area > rails.length * NEAR:
        yield f"{name} does not show just the rails beside boards and coupons"


def _off_outline(cuts: Plotted, outline: Plotted, name: str, apertures: Sequence[str]) -> Iterator[str]:
    area = shown(outline, apertures).buffer(NEAR)
    if not shapely.covers(area, shown(cuts, apertures)):
        yield f"{name} does not cut along the board's outline"


def _cut_bridges(
    cuts: Plotted, bridges: Sequence[tuple[Place, Place]], where: str, apertures: Sequence[str]
) -> Iterator[str]:
    """Bridges into which the cut reaches farther than with its round ends: drawn there and back, it ends nowhere."""
    area = shown(cuts, apertures)
    ends = max((mark_reach(tool, "", apertures) for tool in cuts.objects[:, 0].tolist()), default=0)
    for begin, end in bridges:
        across = shapely.LineString([(x * 1e-9, y * 1e-9) for x, y in (begin, end)])
        if across.difference(area).length < across.length - ends * 1e-9 - 2.0 * NEAR:
            yield f"{where}: the cut goes into the bridge at {shown_place(begin)} of the board"


def _point(row: tuple[int, ...]) -> str:
    return shown_place((row[COLUMNS.index("x")], row[COLUMNS.index("y")]))


def _back(move: Place) -> Place:
    return -move[0], -move[1]


def _inside(objects: Plotted, box: Box, move: Place) -> NDArray[np.bool_]:
    """Which objects begin and end in a box that was moved."""
    ends = objects.boxes_of_ends()
    (dx, dy), (x0, y0, x1, y1) = move, box
    low = (ends[:, 0] >= x0 + dx) & (ends[:, 1] >= y0 + dy)
    return low & (ends[:, 2] <= x1 + dx) & (ends[:, 3] <= y1 + dy)


def _box(boxes: Sequence[NDArray[np.int64]]) -> Box:
    """The box round many."""
    corners = np.concatenate([each for each in boxes if len(each)])
    x0, y0 = corners[:, :2].min(axis=0).tolist()
    x1, y1 = corners[:, 2:].max(axis=0).tolist()
    return x0, y0, x1, y1
