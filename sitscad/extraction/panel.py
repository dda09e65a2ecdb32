"""The panel's files held against those of the single board and against the panel's list of places: every copy object by
object, the cuts up to their bridges, the frame's marks, the coupon's copper one winding between two pads. Objects are
rows of whole nanometres and no areas, so that a panel of hundreds of boards is read in a moment.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from gerbonara import ExcellonFile, GerberFile
from gerbonara.utils import MM
from numpy.typing import NDArray
from shapely import Point, box
from shapely.geometry.base import BaseGeometry

from sitscad.arrays import Flags
from sitscad.extraction.artwork import QUARTER_SEGMENTS, Artwork, Flash, PlottedHole, area_of, file_functions
from sitscad.extraction.differences import Difference, DifferenceKind, compare, nets_of
from sitscad.extraction.intent import Mark, MarkSource
from sitscad.extraction.limits import ExtractionError, content_of, require_drill, require_gerber
from sitscad.record import record

_COMMAND = re.compile(
    r"(?:X(-?\d+)Y(-?\d+)(?:I(-?\d+)J(-?\d+))?D0([123])|(G0[1-3]|G3[67]|G7[45]|%LP[DC]|(?:G54)?D\d{2,}|%AD[^*]+))\*"
)
_WORDS = re.compile(r"%T[FAOD][^%]*%|G04[^*]*\*")
"""Attributes and comments, which draw nothing."""
_FRAMING = re.compile(r"%FSLAX46Y46\*%|%MOMM\*%|M02\*|[\s%]")
COLUMNS = ("aperture", "clear", "mode", "x0", "y0", "x", "y", "i", "j")
"""Of an object: its aperture (-1 in a region), whether it takes away, 0 a flash, 1 to 3 as G01 to G03, its points."""

_X = [COLUMNS.index("x0"), COLUMNS.index("x")]
_Y = [COLUMNS.index("y0"), COLUMNS.index("y")]
REGION = -1


@record(eq=False)
class Plotted:
    """Objects (n, 9), columns as in COLUMNS, in the order of plotting."""

    objects: NDArray[np.int64]

    def shifted(self, dx: int, dy: int) -> Plotted:
        """All objects, moved (nm)."""
        moved = self.objects.copy()
        moved[:, _X] += dx
        moved[:, _Y] += dy
        return Plotted(moved)

    def boxes_of_ends(self) -> NDArray[np.int64]:
        """The box (x0, y0, x1, y1) round the ends of each object's middle line (n, 4)."""
        x0, y0, x, y = self.objects[:, 3:7].T
        return np.stack([np.minimum(x0, x), np.minimum(y0, y), np.maximum(x0, x), np.maximum(y0, y)], axis=1)

    def boxes(self) -> NDArray[np.int64]:
        """The box of each object's middle line (n, 4), of an arc that of its whole circle."""
        mode, x0, y0, _, _, i, j = self.objects[:, 2:].T
        radius = np.ceil(np.hypot(i, j)).astype(np.int64)
        round_it = np.stack([x0 + i - radius, y0 + j - radius, x0 + i + radius, y0 + j + radius], axis=1)
        return np.where((mode > 1)[:, None], round_it, self.boxes_of_ends())

    def chosen(self, mask: Flags) -> Plotted:
        """The objects that a mask has."""
        return Plotted(self.objects[mask])

    def in_order(self) -> NDArray[np.int64]:
        """The objects, sorted where their order does not matter: where none takes away what others drew."""
        if self.objects[:, 1].any():
            return self.objects
        return self.objects[np.lexsort(self.objects.T[::-1])]


def plotted(path: Path, apertures: dict[str, int]) -> Plotted:
    """The objects of a Gerber file in millimetres with six decimals; ``apertures`` numbers their shapes and grows.
    Raises ExtractionError for a file with any other command.
    """
    text = require_gerber(path)
    if "%FSLAX46Y46*%" not in text or "%MOMM*%" not in text:
        raise ExtractionError(f"{path.name}: not in millimetres with six decimals")
    text = _WORDS.sub("", text)
    if other := _FRAMING.sub("", _COMMAND.sub("", text)):
        raise ExtractionError(f"{path.name}: commands that are not understood: {other[:40]!r}")
    shapes: dict[int, int] = {}
    rows: list[tuple[int, ...]] = []
    aperture, clear, mode, region, x, y = REGION, 0, 1, False, 0, 0
    for found_x, found_y, i, j, kind, command in _COMMAND.findall(text):
        if command:
            if command.startswith("%AD"):
                code = re.match(r"%ADD(\d+)(.*)", command)
                if code is None:
                    raise ExtractionError(f"{path.name}: no aperture: {command!r}")
                shapes[int(code[1])] = apertures.setdefault(code[2], len(apertures))
            elif command.startswith("%LP"):
                clear = int(command == "%LPC")
            elif command.startswith("G0"):
                mode = int(command[2])
            elif command.startswith("G3"):
                region = command == "G36"
            elif command == "G74":
                raise ExtractionError(f"{path.name}: arcs of single quadrants are not understood")
            elif command != "G75":
                number = int(command.rpartition("D")[2])
                if number not in shapes:
                    raise ExtractionError(f"{path.name}: aperture D{number} is used and not defined")
                aperture = shapes[number]
            continue
        x0, y0, x, y = x, y, int(found_x), int(found_y)
        tool = REGION if region else aperture
        if kind == "1":
            arc = (int(i or 0), int(j or 0)) if mode > 1 else (0, 0)
            rows.append((tool, clear, mode, x0, y0, x, y, *arc))
        elif kind == "3":
            rows.append((tool, clear, 0, x, y, x, y, 0, 0))
    return Plotted(np.array(rows, dtype=np.int64).reshape(-1, len(COLUMNS)))


def gerber_text(shown: Plotted, apertures: Sequence[str]) -> str:
    """The objects as a Gerber file; each flash or line by itself, lines of a region one after the other."""
    lines = ["%FSLAX46Y46*%", "%MOMM*%", "G75*"]
    lines += [f"%ADD{code}{shape}*%" for code, shape in enumerate(apertures, 10)]
    in_region, before = False, None
    for tool, clear, mode, x0, y0, x, y, i, j in shown.objects.tolist():
        if (tool == REGION) != in_region:
            in_region = not in_region
            lines.append("G36*" if in_region else "G37*")
        if not in_region:
            lines.append(f"D{10 + tool}*")
        if mode == 0:
            lines += [f"%LP{'DC'[clear]}*%", f"X{x}Y{y}D03*"]
        else:
            if (x0, y0) != before or not in_region:
                lines += [f"%LP{'DC'[clear]}*%"] * (not in_region) + [f"X{x0}Y{y0}D02*"]
            lines.append(f"G0{mode}*\nX{x}Y{y}{f'I{i}J{j}' if mode > 1 else ''}D01*")
        before = x, y
    return "\n".join([*lines, *(["G37*"] if in_region else []), "M02*", ""])


def drilled(path: Path) -> Plotted:
    """The holes of an Excellon file as flashes, their diameters (nm) in the place of the aperture."""
    require_drill(path)
    try:
        holes = ExcellonFile.open(path).objects
        rows = []
        for hole in holes:
            x, y = (round(hole.unit.convert_to(MM, value) * 1e6) for value in (hole.x, hole.y))
            diameter = round(hole.tool.unit.convert_to(MM, hole.tool.diameter) * 1e6)
            rows.append((diameter, 0, 0, x, y, x, y, 0, 0))
    except (SyntaxError, ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        raise ExtractionError(f"{path.name}: {error}") from error
    return Plotted(np.array(rows, dtype=np.int64).reshape(-1, len(COLUMNS)))


NET, PADS = "coupon", 2


def compare_coupon(objects: Mapping[str, Plotted], apertures: Sequence[str]) -> tuple[Difference, ...]:
    """What is wrong with a coupon, of which ``objects`` are the plotted ones by their file function. Pads for solder
    are rectangles, those of vias round: that is how the board's own files have them, too.
    """
    layers = sorted((f for f in objects if f.startswith("Copper")), key=lambda f: int(f.split(",")[1][1:]))
    flashes: list[Flash] = []
    marks: list[Mark] = []
    for layer, function in enumerate(layers, 1):
        for aperture, _, mode, _, _, x, y, _, _ in objects[function].objects.tolist():
            if mode:
                continue
            at, is_pad = (x * 1e-9, y * 1e-9), apertures[aperture].startswith("R")
            pin = f"J1-{len(marks)}" if is_pad else None
            marks.append(Mark(NET, layer, *at, MarkSource.X2, pin=pin, is_via=not is_pad))
            flashes.append(Flash(layer, *at, _flashed(apertures[aperture], at)))
    openings = {f.split(",")[1]: shown(objects[f], apertures) for f in objects if f.startswith("Soldermask")}
    copper = tuple(shown(objects[function], apertures) for function in layers)
    art = Artwork(copper, tuple(flashes), tuple(_holes(objects, len(layers))), openings, ())
    found = compare(nets_of(art, tuple(marks)))
    pads = sum(mark.pin is not None for mark in marks)
    if pads == PADS:
        return found
    message = f"{pads} solder pads, where a coil has {PADS}"
    return (Difference(DifferenceKind.NO_COPPER, message), *found)


def shown(objects: Plotted, apertures: Sequence[str]) -> BaseGeometry:
    """The area that objects make dark (m)."""
    return area_of(list(GerberFile.from_string(gerber_text(objects, apertures)).objects))


def _flashed(aperture: str, at: tuple[float, float]) -> BaseGeometry:
    kind, _, sizes = aperture.partition(",")
    x, y = at
    if kind == "R":
        w, h = (float(size) * 1e-3 for size in sizes.split("X"))
        return box(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    return Point(x, y).buffer(float(sizes.split("X")[0]) * 0.5e-3, quad_segs=QUARTER_SEGMENTS)


def _holes(objects: Mapping[str, Plotted], layers: int) -> Iterator[PlottedHole]:
    """The coupon's holes out of its drill files."""
    for function in objects:
        if not function.startswith(("Plated", "NonPlated")):
            continue
        plating, first, last, *_ = function.split(",")
        for diameter, _, _, _, _, x, y, _, _ in objects[function].objects.tolist():
            at = Point(x * 1e-9, y * 1e-9)
            shape = at.buffer(diameter * 0.5e-9, quad_segs=QUARTER_SEGMENTS)
            through = tuple(range(int(first), min(int(last), layers) + 1))
            yield PlottedHole(x * 1e-9, y * 1e-9, diameter * 1e-9, shape, plating == "Plated", through)


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
