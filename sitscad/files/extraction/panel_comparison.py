"""Comparison of a panel's files with the files of the single board and with the panel's list of places.

The objects of the single board must be at every listed place. All other objects must belong to coupons or to the frame.
Boards are compared object by object, which takes seconds for hundreds of boards. Cuts, coupon and frame are compared as
shapes.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from gerbonara.graphic_objects import Arc, Flash, Line, Region
from gerbonara.utils import MM
from numpy.typing import NDArray
from shapely import LineString, Point
from shapely.geometry.base import BaseGeometry

from sitscad.basics.record import record
from sitscad.files.extraction.artwork import (
    QUARTER_SEGMENTS,
    UNLISTED,
    area_of,
    artwork_of,
    file_functions,
    middle_line,
    objects_of,
)
from sitscad.files.extraction.differences import Difference, DifferenceKind, compare, nets_of
from sitscad.files.extraction.intent import Mark, MarkSource
from sitscad.files.extraction.limits import ExtractionError, content_of

NEAR = 1e-6
"""Largest distance (m) between two shapes that count as equal. Rounding moves the centre of an arc by nanometres."""

NM = 1e-9

MAX_SIZE = 1e4
"""Largest coordinate (mm) in a panel's list."""

Key = tuple[int, int, Any]
"""x and y of the first point of an object (nm), and its properties that do not depend on its place."""

Places = NDArray[np.int64]

_LIST_SHAPES = {
    "size": (2,), "parts": (-1, 2), "coupons": (-1, 2), "bridges": (-1, 2, 2), "coupon_bridges": (-1, 2, 2),
    "tooling_holes": (-1, 2), "tooling_hole_diameter": (), "fiducials": (-1, 2), "fiducial_diameter": (),
    "fiducial_opening": (),
}  # fmt: skip


@record(eq=False)
class PanelList:
    """Intended places on a panel (nm), from its lower left corner.

    * ``size``: width and height of the panel
    * ``parts`` and ``coupons`` (n, 2): origins of the copies of board and coupon
    * ``bridges`` and ``coupon_bridges`` (n, 2, 2): both ends of each gap in the cut, relative to the copy's origin

    Diameters are in nanometres, too.
    """

    size: Places
    parts: Places
    coupons: Places
    bridges: Places
    coupon_bridges: Places
    tooling_holes: Places
    tooling_hole_diameter: Places
    fiducials: Places
    fiducial_diameter: Places
    fiducial_opening: Places

    def inside_rails(self) -> BaseGeometry:
        """Return the area (m) of the panel inside its rails.

        Tooling holes are in the middle of the rails. Their distance from the edge is therefore half of the rails'
        width.
        """
        rail = 2.0 * self.tooling_holes[:, 0].min() if len(self.tooling_holes) else 0.0
        return shapely.box(*(NM * np.array([rail, rail, *(self.size - rail)])))

    def frame(self, fields: Sequence[str]) -> BaseGeometry:
        """Return the area (m) that a panel's file must show outside boards and coupons.

        `fields` are the fields of its file function.
        """
        if fields[0] == "Other" and fields[1].startswith("Extent_of"):
            return shapely.box(0.0, 0.0, *(NM * self.size)).difference(self.inside_rails())
        places, diameter = self.fiducials[:0], self.fiducial_diameter
        if fields[0] == "NonPlated":
            places, diameter = self.tooling_holes, self.tooling_hole_diameter
        elif fields[0] in ("Copper", "Soldermask") and {"Top", "Bot"} & set(fields):
            diameter = self.fiducial_diameter if fields[0] == "Copper" else self.fiducial_opening
            places = self.fiducials
        return shapely.union_all(shapely.buffer(shapely.points(NM * places), NM * diameter / 2.0, QUARTER_SEGMENTS))


def read_panel_list(panel: Path) -> PanelList:
    """Read the list of places in a panel's folder.

    Raises ExtractionError if there is no list, several lists, or a malformed list.
    """
    lists = sorted(panel.glob("*.json"))
    if len(lists) != 1:
        raise ExtractionError(f"the panel has {len(lists)} lists of places, where one is expected")
    try:
        document = json.loads(content_of(lists[0]))
        if document["unit"] != "mm":
            raise ValueError("its unit is not mm")
        panel_list = PanelList(**{key: _lengths(document[key], shape) for key, shape in _LIST_SHAPES.items()})
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ExtractionError(f"{lists[0].name} is no list of places: {type(error).__name__}: {error}") from error
    if not len(panel_list.parts):
        raise ExtractionError(f"{lists[0].name} names no board")
    return panel_list


def _lengths(values: Any, shape: tuple[int, ...]) -> Places:
    """Convert lengths (mm) from JSON to whole nanometres.

    Raises ValueError for an array of another shape, and for a length of `MAX_SIZE` or more.
    """
    lengths = np.array(values, dtype=float)
    if not (np.abs(lengths) < MAX_SIZE).all():
        raise ValueError("a coordinate is no place on a panel")
    if lengths.size and (lengths.ndim != len(shape) or lengths.shape[1:] != shape[1:]):
        raise ValueError(f"{lengths.shape} numbers, where {shape} are expected")
    return np.rint(1e6 * lengths.reshape(shape)).astype(np.int64)


class Plotted:
    """Graphic objects of a file. `take` removes the objects of one copy of the board or the coupon."""

    def __init__(self, name: str, fields: list[str], objects: list[Any]) -> None:
        self.name, self.fields, self.objects = name, fields, objects
        self.keys = [key_of(thing) for thing in objects]
        self.by_key: dict[Key, list[int]] = defaultdict(list)
        for number, key in enumerate(self.keys):
            self.by_key[key].append(number)

    def left(self) -> list[int]:
        """Return the numbers of the remaining objects, which `take` did not remove."""
        return sorted(number for numbers in self.by_key.values() for number in numbers)

    def take(self, keys: Sequence[Key], move: Places) -> str:
        """Remove the objects of a copy shifted by `move` (nm). Return its difference from the single board as text.

        `keys` are the keys of the single board's objects. Empty if no object is missing and the order of plotting is
        equal.
        """
        dx, dy = move.tolist()
        matched, missing = [], []
        for x, y, form in keys:
            numbers = self.by_key.get((x + dx, y + dy, form))
            if numbers:
                matched.append(numbers.pop(0))
            else:
                missing.append((x, y))
        if missing:
            first = _place(Point(NM * np.array(min(missing))), np.zeros(2))
            return f"{len(missing)} objects missing (the first at {first} of the board)"
        is_ordered = all(self.objects[number].polarity_dark for number in matched) or matched == sorted(matched)
        return "" if is_ordered else "objects in another order"

    def copy_in(self, room: BaseGeometry, move: Places) -> list[Key]:
        """Return the keys of the remaining objects whose first point lies in the bounding box of `room` (m).

        The box is first shifted by `move` (nm). The keys are shifted back.
        """
        x0, y0, x1, y1 = np.array(room.bounds) + NM * np.tile(move, 2)
        dx, dy = move.tolist()
        keys = (self.keys[number] for number in self.left())
        return [
            (x - dx, y - dy, form) for x, y, form in keys
            if x0 - NEAR < NM * x < x1 + NEAR and y0 - NEAR < NM * y < y1 + NEAR
        ]

    def objects_at(self, keys: Sequence[Key], move: Places) -> list[Any]:
        """Return the objects of the copy shifted by `move` (nm) that have one of the keys, in the order of plotting."""
        dx, dy = move.tolist()
        expected = {(x + dx, y + dy, form) for x, y, form in keys}
        return [thing for thing, key in zip(self.objects, self.keys, strict=True) if key in expected]


def key_of(thing: Any) -> Key:
    """Return the first point (nm) of a plotted object, and its kind, aperture, polarity and other points from there."""
    match thing:
        case Flash():
            kind, points = thing.aperture, [(thing.x, thing.y)]
        case Line():
            kind, points = thing.aperture, [(thing.x1, thing.y1), (thing.x2, thing.y2)]
        case Arc():
            kind = (thing.aperture, thing.clockwise)
            points = [(thing.x1, thing.y1), (thing.x2, thing.y2), thing.center]
        case Region():
            kind = tuple(arc and arc[0] for arc in thing.arc_centers)
            points = [*thing.outline, *(arc[1] for arc in thing.arc_centers if arc)]
        case _:
            raise ExtractionError(f"a graphic of a kind that is not understood: {type(thing).__name__}")
    scale = 1e6 * thing.unit.convert_to(MM, 1.0)
    (x0, y0), *rest = [(round(scale * x), round(scale * y)) for x, y in points]
    return x0, y0, (type(thing), kind, thing.polarity_dark, tuple((x - x0, y - y0) for x, y in rest))


def compare_panel(board: Path, panel: Path) -> tuple[int, tuple[str, ...]]:
    """Return the number of boards on a panel, and its differences from the single board and the list, as texts.

    `board` and `panel` are the folders of the files. Raises ExtractionError if a file cannot be read or a needed file
    is missing.
    """
    single, whole = _read(board), _read(panel)
    outlines = [folder.pop(OUTLINE, None) for folder in (single, whole)]
    for outline, path in zip(outlines, (board, panel), strict=True):
        if outline is None or not outline.objects:
            raise ExtractionError(f"no file in {path.name} draws an outline")
    listed = read_panel_list(panel)
    edge, border = (outline.objects for outline in outlines if outline)
    return len(listed.parts), tuple(_differences(single, whole, listed, area_of(edge), middle_line(border)))


OUTLINE, CUTS = "Profile,NP", "Other,Part_Cuts"


def _read(folder: Path) -> dict[str, Plotted]:
    """Read a folder's files by their functions. Raises ExtractionError if two files have the same function."""
    plots: dict[str, Plotted] = {}
    for path, fields in sorted(file_functions(folder)):
        function = ",".join(fields)
        if function in plots:
            raise ExtractionError(f"{path.name} and {plots[function].name} both call themselves {function}")
        if fields[0] != UNLISTED:
            plots[function] = Plotted(path.name, fields, objects_of(path, fields))
    return plots


def _differences(
    single: dict[str, Plotted], whole: dict[str, Plotted], listed: PanelList, edge: BaseGeometry, border: BaseGeometry
) -> Iterator[str]:
    """Yield the differences between the panel and copies of the board in a frame, as texts.

    ``single`` and ``whole`` are the files of board and panel by function, and ``listed`` the panel's list of places.
    ``edge`` is the area of the line that draws the board's outline, ``border`` the panel's outline.
    """
    expected = shapely.box(0.0, 0.0, *(NM * listed.size)).exterior
    if not shapely.line_merge(border).is_ring or shapely.hausdorff_distance(border, expected) > NEAR:
        width, height = 1e-6 * listed.size
        yield f"the panel's outline is not the rectangle of its list, {width:.4g} x {height:.4g} mm"
    boards = {function: file.keys for function, file in single.items()}
    for function in sorted({*boards} - {*whole}):
        yield f"the panel has nothing like {single[function].name} ({function})"
    if CUTS not in whole:
        yield "the panel has no file of cuts"
        return
    boards[CUTS] = whole[CUTS].copy_in(edge, listed.parts[0])
    cuts = whole[CUTS].objects_at(boards[CUTS], listed.parts[0])
    yield from cut_differences(cuts, listed.bridges, listed.parts[0], f"{whole[CUTS].name}, board 1", edge)
    for function, file in sorted(whole.items()):
        for number, move in enumerate(listed.parts, 1):
            if fault := file.take(boards.get(function, ()), move):
                yield f"{file.name}, board {number} is not as the single board: {fault}"
    if len(listed.coupons):
        yield from _coupons(whole, listed)
    for _, file in sorted(whole.items()):
        yield from frame_differences(file, listed)


def _coupons(whole: dict[str, Plotted], listed: PanelList) -> Iterator[str]:
    """Remove the objects of all coupons. Yield flaws of the first coupon, and differences of the others from it."""
    leftover = whole[CUTS].left()
    if not leftover:
        raise ExtractionError("the panel's coupon is not cut out")
    x0, y0, x1, y1 = middle_line(whole[CUTS].objects[number] for number in leftover).bounds
    (ax, ay), (bx, by) = NM * listed.coupons[0], NM * listed.coupons[-1]
    room = shapely.box(x0 - ax, y0 - ay, x1 - bx, y1 - by)
    first = listed.coupons[0]
    coupon = {function: file.copy_in(room, first) for function, file in whole.items()}
    objects = {function: whole[function].objects_at(keys, first) for function, keys in coupon.items()}
    yield from cut_differences(objects[CUTS], listed.coupon_bridges, first, f"{whole[CUTS].name}, coupon 1")
    files = [(whole[function].name, whole[function].fields, objects_drawn) for function,
             objects_drawn in objects.items()]
    for difference in compare_coupon(files):
        yield f"the panel's coupon: {difference.kind.value}: {difference.message}"
    for function, file in sorted(whole.items()):
        for number, move in enumerate(listed.coupons, 1):
            if fault := file.take(coupon[function], move):
                yield f"{file.name}, coupon {number} is not as the first coupon: {fault}"


NET, PADS = "coupon", 2


def compare_coupon(files: list[tuple[str, list[str], list[Any]]]) -> tuple[Difference, ...]:
    """Return the faults of a coupon. `files` are rows (name, fields of the file function, objects).

    As in the board's own files, rectangular flashes are solder pads and round flashes are pads of vias.
    """
    copper = sorted(int(fields[1][1:]) for _, fields, _ in files if fields[0] == "Copper")
    art = artwork_of(files, tuple(Path(f"L{layer}") for layer in copper))
    marks: list[Mark] = []
    for flash in art.flashes:
        is_pad = shapely.equals(flash.shape, flash.shape.envelope)
        pin = f"J1-{len(marks)}" if is_pad else None
        marks.append(Mark(NET, flash.layer, flash.x, flash.y, MarkSource.X2, pin=pin, is_via=not is_pad))
    faults = compare(nets_of(art, tuple(marks)))
    pads = sum(mark.pin is not None for mark in marks)
    if pads == PADS:
        return faults
    return Difference(DifferenceKind.NO_COPPER, f"{pads} solder pads, where a coil has {PADS}"), *faults


def cut_differences(
    cuts: list[Any], bridges: Places, move: Places, where: str, edge: BaseGeometry | None = None
) -> Iterator[str]:
    """Yield the faults of the cut around a copy shifted by `move` (nm), as texts.

    `bridges` (n, 2, 2; nm) are both ends of each gap in the cut, and `where` begins each text. Cut and bridges must
    close an outline. The cut must not enter a bridge. It must stay in the area ``edge`` of the board's drawn outline.
    """
    if not cuts:
        yield f"{where} is not cut out"
        return
    lines = middle_line(cuts)
    spans = [shapely.snap(LineString(NM * (ends + move)), lines, NEAR) for ends in bridges]
    for span in spans:
        if span.difference(lines.buffer(NEAR)).length < span.length - 3.0 * NEAR:
            yield f"{where}: the cut goes into the bridge at {_place(span, move)} of the board"
    outline = shapely.line_merge(shapely.union_all([lines, *spans]))
    if not outline.is_ring:
        ends = outline if outline.boundary.is_empty else outline.boundary
        yield f"{where}: cut and bridges do not close an outline, first at {_place(ends, move)} of the board"
    if edge is not None:
        moved = shapely.transform(edge, lambda points: points + NM * move)
        if not shapely.covers(moved.buffer(NEAR), area_of(cuts)):
            yield f"{where}: the cut leaves the board's outline"


def frame_differences(file: Plotted, listed: PanelList) -> Iterator[str]:
    """Yield the differences between a file's objects outside the copies and the listed marks of the frame.

    On copper layers, the sensor's name is written on the rails. All other objects must be listed marks.
    """
    leftover = file.left()
    rest = [file.objects[number] for number in leftover]
    has_doubles = len({file.keys[number] for number in leftover}) < len(leftover)
    if has_doubles or not all(thing.polarity_dark for thing in rest):
        yield f"{file.name} has doubled or clear objects that belong to no board"
        return
    written = [thing for thing in rest if file.fields[0] == "Copper" and isinstance(thing, Line | Arc)]
    shown = area_of([thing for thing in rest if file.fields[0] != "Copper" or not isinstance(thing, Line | Arc)])
    expected = listed.frame(file.fields)
    for area, what in (
        (expected.difference(shown.buffer(NEAR)), "lacks a mark of the list"),
        (shown.difference(expected.buffer(NEAR)), "shows what the list does not have"),
        (area_of(written).intersection(listed.inside_rails()), "has objects that belong to no board"),
    ):
        if not area.is_empty:
            first = shapely.get_parts(area)[0].centroid
            yield f"{file.name} {what}, first at {_place(first, np.zeros(2))} of the panel"


def _place(shape: BaseGeometry, move: NDArray[Any]) -> str:
    """Return the first point of a shape (m) as text, shifted back by `move` (nm)."""
    x, y = 1e3 * shapely.get_coordinates(shape)[0] - 1e-6 * move
    return f"x {x:.4g} mm, y {y:.4g} mm"
