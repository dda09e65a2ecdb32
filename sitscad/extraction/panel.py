"""The panel's files held against those of the single board: every copy object by object, the frame empty but for its
rails, the coupon's copper one winding between two pads.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from sitscad.extraction.artwork import ExtractionError, file_functions
from sitscad.extraction.coupon import compare_coupon, shown
from sitscad.extraction.plotted import COLUMNS, REGION, Plotted, drilled, plotted
from sitscad.record import record

OUTLINE, CUTS = "Profile,NP", "Other,Part_Cuts"

NEAR = 1e-6
"""So far (m) a cut's drawn line may stand over the outline's: rounding moves an arc's centre by nanometres."""

Box = tuple[int, int, int, int]
Move = tuple[int, int]


@record(eq=False)
class _Folder:
    """What the files of a folder plot, by their file functions; and the files' names."""

    objects: dict[str, Plotted]
    names: dict[str, str]

    def of(self, function: str) -> Plotted:
        """The objects of a file; none where there is no such file."""
        return self.objects.get(function, Plotted(np.zeros((0, len(COLUMNS)), np.int64)))


@record
class _Places:
    """How far (nm) the single board and the coupon are moved for each copy, and what each takes there."""

    boards: tuple[Move, ...]
    coupons: tuple[Move, ...]
    board: Box
    coupon: Box
    inner: Box
    """What the rails enclose."""


def compare_panel(board: Path, panel: Path) -> tuple[int, tuple[str, ...]]:
    """How many boards a panel holds, and every difference of its files from the single board's in a sentence.

    A copy must show on every layer, and drill, just what the single board does; beside boards and coupons there may be
    something on the rails only. Raises ExtractionError when a file cannot be read or one that is needed is missing.
    """
    apertures: dict[str, int] = {}
    single, whole = _read(board, apertures), _read(panel, apertures)
    for folder, path in ((single, board), (whole, panel)):
        if not len(folder.of(OUTLINE).objects):
            raise ExtractionError(f"no file in {path.name} draws an outline")
    places = _places(panel, single, whole)
    return len(places.boards), tuple(_differences(single, whole, places, list(apertures)))


def _read(folder: Path, apertures: dict[str, int]) -> _Folder:
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


def _places(panel: Path, single: _Folder, whole: _Folder) -> _Places:
    boards, coupons = _listed(panel)
    board = _box([objects.boxes_of_ends() for objects in single.objects.values()])
    cuts, taken = whole.of(CUTS), np.zeros(len(whole.of(CUTS).objects), bool)
    for move in boards:
        taken |= _inside(cuts, board, move)
    coupon = (0, 0, 0, 0)
    if coupons:
        left = cuts.chosen(~taken)
        if not len(left.objects):
            raise ExtractionError("the panel's coupon is not cut out")
        x0, y0, x1, y1 = _box([left.boxes_of_ends()])
        (ax, ay), (bx, by) = coupons[0], coupons[-1]
        coupon = (x0 - ax, y0 - ay, x1 - bx, y1 - by)
    return _Places(boards, coupons, board, coupon, _inside_rails(whole))


def _listed(panel: Path) -> tuple[tuple[Move, ...], tuple[Move, ...]]:
    """The moves of boards and coupons out of the panel's list."""
    lists = sorted(panel.glob("*.json"))
    if len(lists) != 1:
        raise ExtractionError(f"the panel has {len(lists)} lists of places, where one is expected")
    try:
        document = json.loads(lists[0].read_text(encoding="utf-8"))
        boards, coupons = (
            tuple((round(x * 1e6), round(y * 1e6)) for x, y in document[key]) for key in ("parts", "coupons")
        )
    except (ValueError, KeyError, TypeError) as error:
        raise ExtractionError(f"{lists[0].name} is no list of places: {error}") from error
    if not boards:
        raise ExtractionError(f"{lists[0].name} names no board")
    return boards, coupons


def _inside_rails(whole: _Folder) -> Box:
    """What the rails enclose: the tooling holes stand in their middles."""
    x0, y0, x1, y1 = _box([whole.of(OUTLINE).boxes_of_ends()])
    holes = [objects for function, objects in whole.objects.items() if function.startswith("NonPlated")]
    if not sum(len(each.objects) for each in holes):
        raise ExtractionError("the panel has no tooling holes")
    rail = 2 * (_box([each.boxes_of_ends() for each in holes])[0] - x0)
    return x0 + rail, y0 + rail, x1 - rail, y1 - rail


def _differences(single: _Folder, whole: _Folder, places: _Places, apertures: list[str]) -> Iterator[str]:
    coupon: dict[str, Plotted] = {}
    for function in sorted({*single.objects, *whole.objects} - {OUTLINE}):
        if function not in whole.objects:
            yield f"the panel has nothing like {single.names[function]} ({function})"
            continue
        there, name = whole.of(function), whole.names[function]
        own, taken = single.of(function), np.zeros(len(there.objects), bool)
        if function == CUTS:
            own = there.chosen(_inside(there, places.board, places.boards[0])).shifted(*_back(places.boards[0]))
            yield from _off_outline(own, single.of(OUTLINE), name, apertures)
        for number, move in enumerate(places.boards, 1):
            inside = _inside(there, places.board, move)
            taken |= inside
            yield from _unequal(own, there.chosen(inside).shifted(*_back(move)), f"{name}, board {number}")
        for number, move in enumerate(places.coupons, 1):
            inside = _inside(there, places.coupon, move)
            taken |= inside
            copy = there.chosen(inside).shifted(*_back(move))
            coupon.setdefault(function, copy)
            yield from _unequal(coupon[function], copy, f"{name}, coupon {number}", "the first coupon")
        yield from _off_rails(there.chosen(~taken), places.inner, name, apertures)
    if places.coupons:
        found = compare_coupon(coupon, apertures)
        yield from (f"the panel's coupon: {difference.kind.value}: {difference.message}" for difference in found)


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


def _off_outline(cuts: Plotted, outline: Plotted, name: str, apertures: Sequence[str]) -> Iterator[str]:
    area = shown(outline, apertures).buffer(NEAR)
    if not shapely.covers(area, shown(cuts, apertures)):
        yield f"{name} does not cut along the board's outline"


def _off_rails(rest: Plotted, inner: Box, name: str, apertures: Sequence[str]) -> Iterator[str]:
    """What belongs neither to a board nor to a coupon must lie on the rails."""
    x0, y0, x1, y1 = rest.boxes().T
    width = [_half(apertures, int(tool), name) for tool in rest.objects[:, 0]]
    half = np.array(width, dtype=np.int64)
    reaches = (x1 + half > inner[0]) & (x0 - half < inner[2]) & (y1 + half > inner[1]) & (y0 - half < inner[3])
    wrong = reaches | ((rest.objects[:, 0] == REGION) & (rest.objects[:, 2] > 0)) | (rest.objects[:, 1] > 0)
    if wrong.any():
        place = _point(tuple(rest.objects[wrong][0].tolist()))
        yield f"{name} has {wrong.sum()} objects that belong to no board, the first at {place} of the panel"


def _half(apertures: Sequence[str], tool: int, name: str) -> int:
    """Half the width (nm) of an aperture or a hole, or more."""
    if name.endswith(".drl"):
        return tool // 2
    if tool == REGION:
        return 0
    return round(sum(float(size) for size in re.findall(r"[\d.]+", apertures[tool])) * 1e6)


def _point(row: tuple[int, ...]) -> str:
    x, y = row[COLUMNS.index("x")], row[COLUMNS.index("y")]
    return f"x {x / 1e6:.4g} mm, y {y / 1e6:.4g} mm"


def _back(move: Move) -> Move:
    return -move[0], -move[1]


def _inside(objects: Plotted, box: Box, move: Move) -> NDArray[np.bool_]:
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
