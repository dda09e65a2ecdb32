"""The panel's files held against those of the single board and against the panel's list of places: every copy object by
object, the cuts up to their bridges, the frame's marks, the coupon's copper one winding between two pads.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from sitscad.arrays import Flags
from sitscad.extraction.artwork import file_functions
from sitscad.extraction.limits import ExtractionError, content_of
from sitscad.extraction.plotted import COLUMNS, REGION, Plotted, compare_coupon, drilled, plotted, shown
from sitscad.record import record

Place = tuple[int, int]

LARGEST = 1e4
"""No panel is so large (mm)."""


@record
class PanelList:
    """Where everything on a panel is to be. Lengths in nanometres, from the panel's lower left corner. ``boards`` and
    ``coupons`` are how far the origin of each copy is moved; ``bridges`` and ``coupon_bridges`` are the two ends of
    every place where the cut round a copy stops, from that origin.
    """

    size: Place
    boards: tuple[Place, ...]
    coupons: tuple[Place, ...]
    bridges: tuple[tuple[Place, Place], ...]
    coupon_bridges: tuple[tuple[Place, Place], ...]
    tooling_holes: tuple[Place, ...]
    tooling_hole: int
    fiducials: tuple[Place, ...]
    fiducial: int
    fiducial_opening: int


def read_panel_list(panel: Path) -> PanelList:
    """The one list of a panel's folder. Raises ExtractionError where there is none, several, or it cannot be read."""
    lists = sorted(panel.glob("*.json"))
    if len(lists) != 1:
        raise ExtractionError(f"the panel has {len(lists)} lists of places, where one is expected")
    try:
        document = json.loads(content_of(lists[0]))
        if document["unit"] != "mm":
            raise ValueError("its unit is not mm")
        found = PanelList(
            size=_place(document["size"]), boards=_places(document["parts"]), coupons=_places(document["coupons"]),
            bridges=_bridges(document["bridges"]), coupon_bridges=_bridges(document["coupon_bridges"]),
            tooling_holes=_places(document["tooling_holes"]), tooling_hole=_length(document["tooling_hole_diameter"]),
            fiducials=_places(document["fiducials"]), fiducial=_length(document["fiducial_diameter"]),
            fiducial_opening=_length(document["fiducial_opening"]),
        )
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ExtractionError(f"{lists[0].name} is no list of places: {type(error).__name__}: {error}") from error
    if not found.boards:
        raise ExtractionError(f"{lists[0].name} names no board")
    return found


def _length(millimetres: Any) -> int:
    found = float(millimetres)
    if not abs(found) < LARGEST:
        raise ValueError(f"{found:g} mm is no place on a panel")
    return round(found * 1e6)


def _place(values: Sequence[Any]) -> Place:
    x, y = values
    return _length(x), _length(y)


def _places(values: Sequence[Any]) -> tuple[Place, ...]:
    return tuple(map(_place, values))


def _bridges(values: Sequence[Any]) -> tuple[tuple[Place, Place], ...]:
    return tuple((_place(begin), _place(end)) for begin, end in values)


FLASH = 0
"""Mode of an object that is flashed or drilled."""

Box = tuple[int, int, int, int]


def frame_differences(
    rest: Plotted, function: str, name: str, listed: PanelList, apertures: Sequence[str]
) -> Iterator[str]:
    """What a file shows on the frame and should not, or should and does not. ``rest`` are the objects that belong to no
    copy. Tooling holes stand in the file of holes that are not plated, fiducials on the outer copper and in the
    openings over it; any other line or flash must lie on the rails.
    """
    kind, *fields = function.split(",")
    marks: Counter[tuple[int, int, int]] = Counter()  # size and place of all that are wanted
    if kind == "NonPlated":
        marks = Counter((listed.tooling_hole, *at) for at in listed.tooling_holes)
    elif {"Top", "Bot"} & set(fields) and kind in ("Copper", "Soldermask"):
        diameter = listed.fiducial if kind == "Copper" else listed.fiducial_opening
        marks = Counter((diameter, *at) for at in listed.fiducials)
    flashes = rest.objects[(rest.objects[:, 2] == FLASH) & (rest.objects[:, 0] != REGION)]
    there = Counter((_diameter(row[0], name, apertures), row[5], row[6]) for row in flashes.tolist())
    for (size, x, y), count in (marks - there).items():
        what = "tooling hole" if name.endswith(".drl") else "fiducial"
        yield f"{name} has no {what} of {size / 1e6:.4g} mm at {shown_place((x, y))} of the panel ({count} missing)"
    if unknown := there - marks:
        _, *at = min(unknown)
        yield f"{name} has {unknown.total()} marks that are not listed, the first at {shown_place(at)} of the panel"
    lines = rest.objects[(rest.objects[:, 2] != FLASH) | (rest.objects[:, 0] == REGION)]
    x0, y0, x1, y1 = Plotted(lines).boxes().T
    half = np.array([mark_reach(tool, name, apertures) for tool in lines[:, 0].tolist()], dtype=np.int64)
    inner = inside_rails(listed)
    wrong = (x1 + half > inner[0]) & (x0 - half < inner[2]) & (y1 + half > inner[1]) & (y0 - half < inner[3])
    wrong |= ((lines[:, 0] == REGION) & (lines[:, 2] > 0)) | (lines[:, 1] > 0)
    if wrong.any():
        place = shown_place(lines[wrong][0].tolist()[5:7])
        yield f"{name} has {wrong.sum()} objects that belong to no board, the first at {place} of the panel"


def inside_rails(listed: PanelList) -> Box:
    """What the rails enclose: the tooling holes stand in their middles."""
    rail = 2 * min(x for x, _ in listed.tooling_holes) if listed.tooling_holes else 0
    return rail, rail, listed.size[0] - rail, listed.size[1] - rail


def cut_differences(
    cuts: Plotted, bridges: Sequence[tuple[Place, Place]], where: str, apertures: Sequence[str]
) -> Iterator[str]:
    """Whether the cut round one copy, moved to its origin, stops at the bridges and nowhere else, and reaches into them
    no farther than with its round ends: a line drawn there and back ends nowhere.
    """
    if not len(cuts.objects):
        yield f"{where} is not cut out"
        return
    ends = Counter[Place]()
    for _, _, _, x0, y0, x, y, _, _ in cuts.objects.tolist():
        ends.update({(x0, y0), (x, y)} if (x0, y0) != (x, y) else ())
    opened = {at for at, count in ends.items() if count % 2}
    for begin, end in bridges:
        if not {begin, end} <= opened:
            middle = ((begin[0] + end[0]) // 2, (begin[1] + end[1]) // 2)
            yield f"{where}: the cut does not stop at both ends of the bridge at {shown_place(middle)} of the board"
    if others := opened - {at for bridge in bridges for at in bridge}:
        yield f"{where}: the cut stops where no bridge is, first at {shown_place(min(others))} of the board"
    area = shown(cuts, apertures)
    reach = max((mark_reach(tool, "", apertures) for tool in cuts.objects[:, 0].tolist()), default=0)
    for begin, end in bridges:
        across = shapely.LineString([(x * 1e-9, y * 1e-9) for x, y in (begin, end)])
        if across.difference(area).length < across.length - reach * 1e-9 - 2.0 * NEAR:
            yield f"{where}: the cut goes into the bridge at {shown_place(begin)} of the board"


def _diameter(tool: int, name: str, apertures: Sequence[str]) -> int:
    """The diameter (nm) of a hole or of a round aperture; 0 for any other shape."""
    if name.endswith(".drl"):
        return tool
    found = re.fullmatch(r"C,([\d.]+)", apertures[tool])
    return round(float(found[1]) * 1e6) if found else 0


def mark_reach(tool: int, name: str, apertures: Sequence[str]) -> int:
    """Half the width (nm) of an aperture or a hole, or more."""
    if name.endswith(".drl"):
        return tool // 2
    if tool == REGION:
        return 0
    return round(sum(float(size) for size in re.findall(r"[\d.]+", apertures[tool])) * 1e6)


def shown_place(at: Sequence[int]) -> str:
    """A place (nm) in words."""
    return f"x {at[0] / 1e6:.4g} mm, y {at[1] / 1e6:.4g} mm"


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
    listed = read_panel_list(panel)
    room = _box([objects.boxes_of_ends() for objects in single.objects.values()])
    cuts, taken = whole.of(CUTS), np.zeros(len(whole.of(CUTS).objects), bool)
    for move in listed.boards:
        taken |= _copy(cuts, room, move)[0]
    coupon = (0, 0, 0, 0)
    if listed.coupons:
        left = cuts.chosen(~taken)
        if not len(left.objects):
            raise ExtractionError("the panel's coupon is not cut out")
        x0, y0, x1, y1 = _box([left.boxes_of_ends()])
        (ax, ay), (bx, by) = listed.coupons[0], listed.coupons[-1]
        coupon = (x0 - ax, y0 - ay, x1 - bx, y1 - by)
    copies = _Copies(listed, room, coupon)
    return len(listed.boards), tuple(_differences(single, whole, copies, list(apertures)))


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


def _differences(single: _Folder, whole: _Folder, copies: _Copies, apertures: list[str]) -> Iterator[str]:
    """What differs between the panel and so many copies of the single board, in words."""
    listed, coupon = copies.listed, dict[str, Plotted]()
    drawn = _box([whole.of(OUTLINE).boxes_of_ends()])
    if drawn != (0, 0, *listed.size):
        wanted, found = (f"{x1 / 1e6:.4g} x {y1 / 1e6:.4g} mm" for x1, y1 in (listed.size, drawn[2:]))
        yield f"the panel's outline is {found}, its list says {wanted}"
    for function in sorted({*single.objects, *whole.objects} - {OUTLINE}):
        if function not in whole.objects:
            yield f"the panel has nothing like {single.names[function]} ({function})"
            continue
        there, name = whole.of(function), whole.names[function]
        own, taken = single.of(function), np.zeros(len(there.objects), bool)
        if function == CUTS:
            _, own = _copy(there, copies.board, listed.boards[0])
            if not shapely.covers(shown(single.of(OUTLINE), apertures).buffer(NEAR), shown(own, apertures)):
                yield f"{name} does not cut along the board's outline"
            yield from cut_differences(own, listed.bridges, f"{name}, board 1", apertures)
        for number, move in enumerate(listed.boards, 1):
            inside, copy = _copy(there, copies.board, move)
            taken |= inside
            yield from _unequal(own, copy, f"{name}, board {number}")
        for number, move in enumerate(listed.coupons, 1):
            inside, copy = _copy(there, copies.coupon, move)
            taken |= inside
            coupon.setdefault(function, copy)
            yield from _unequal(coupon[function], copy, f"{name}, coupon {number}", "the first coupon")
        if function == CUTS and listed.coupons:
            yield from cut_differences(coupon[function], listed.coupon_bridges, f"{name}, coupon 1", apertures)
        rest = there.chosen(~taken)
        if function.startswith(EXTENT):
            yield from _off_rails(rest, name, listed, apertures)
        else:
            yield from frame_differences(rest, function, name, listed, apertures)
    if listed.coupons:
        wrong = compare_coupon(coupon, apertures)
        yield from (f"the panel's coupon: {difference.kind.value}: {difference.message}" for difference in wrong)


def _unequal(own: Plotted, copy: Plotted, where: str, other: str = "the single board") -> Iterator[str]:
    """What a copy has too much or too little."""
    if np.array_equal(own.in_order(), copy.in_order()):
        return
    wanted, there = ({tuple(row) for row in each.objects.tolist()} for each in (own, copy))
    words = [
        f"{len(some)} objects {what} (the first at {shown_place(min(some)[5:7])} of the board)"
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


def _copy(objects: Plotted, box: Box, move: Place) -> tuple[Flags, Plotted]:
    """Which objects begin and end in a box that was moved, and these objects moved back with it."""
    ends = objects.boxes_of_ends()
    (dx, dy), (x0, y0, x1, y1) = move, box
    low = (ends[:, 0] >= x0 + dx) & (ends[:, 1] >= y0 + dy)
    inside = low & (ends[:, 2] <= x1 + dx) & (ends[:, 3] <= y1 + dy)
    return inside, objects.chosen(inside).shifted(-dx, -dy)


def _box(boxes: Sequence[NDArray[np.int64]]) -> Box:
    corners = np.concatenate([each for each in boxes if len(each)])
    x0, y0 = corners[:, :2].min(axis=0).tolist()
    x1, y1 = corners[:, 2:].max(axis=0).tolist()
    return x0, y0, x1, y1
