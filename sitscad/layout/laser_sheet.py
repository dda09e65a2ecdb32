"""Sheets for laser cutting: the outlines of one part and of its kerf coupon on named layers, for all file formats.

The kerf is the width of material that the beam removes. The kerf coupon is a small square with a hole to measure the
kerf.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from enum import StrEnum

from sitscad.basics.late import late
from sitscad.basics.record import record
from sitscad.basics.units import count_text, in_mm, parse_quantity
from sitscad.data import rows
from sitscad.kernels.geometry.convex import Box, Footprint
from sitscad.kernels.geometry.path import Path, Point, box_around, circle, enclosed_area, polyline, rectangle
from sitscad.kernels.geometry.shapes import PLATES
from sitscad.layout.board import Layout
from sitscad.spec.materials import Cutting
from sitscad.spec.places import cell_specs, footprint, place_text, webs
from sitscad.spec.sensor import SensorSpec

joined_boxes = late("sitscad.kernels.geometry.areas", "joined_boxes")  # loads shapely, for sheets with webs only

MARGIN = 5e-3
"""Smallest distance (m) of contours from the sheet's edge and from each other."""
COUPON_SIZE = 10e-3
"""Side (m) of the kerf coupon."""
COUPON_HOLE = 5e-3
"""Side or diameter (m) of the hole in the kerf coupon."""
MARK_ARM = 1e-3
"""Half length (m) of the strokes of a cross mark."""
TEXT_HEIGHT = 1.2e-3
"""Height (m) of the notes on a sheet."""
_LINE_STEP = 2e-3
_LETTER_WIDTH = 0.8  # of the height, for the room that a note takes in any plain font


def laser_limit(material: str) -> float | None:
    """Return the largest thickness (m) of a material that a common laser cutter cuts. None if no limit is known."""
    limits = (row["most"] for row in rows("laser_cutting") if row["material"] == material)
    return max((parse_quantity(text, "length") for text in limits if text), default=None)


def is_laser_cut(material: str, thickness: float) -> bool:
    """Whether a common laser cutter cuts this thickness (m) of a material. True if no limit is known."""
    most = laser_limit(material)
    return most is None or thickness <= most + 1e-9


class CutLayer(StrEnum):
    """Laser operation on a contour, in the order of execution.

    Engraving comes first. Inside cuts come before outside cuts, because a loose piece may move. REF is not executed.
    """

    ENGRAVE = "ENGRAVE"
    CUT_INNER = "CUT_INNER"
    CUT_OUTER = "CUT_OUTER"
    REF = "REF"


@record
class Look:
    """Appearance of a layer in all file formats.

    `colour` is the name of the colour, `rgb` its code ``#rrggbb``, and `index` its number in AutoCAD. `work` is the
    laser's operation; empty if the laser ignores the layer.
    """

    colour: str
    rgb: str
    index: int
    work: str


LOOKS = {
    CutLayer.ENGRAVE: Look("black", "#000000", 7, "engrave"),
    CutLayer.CUT_INNER: Look("red", "#ff0000", 1, "cut inside"),
    CutLayer.CUT_OUTER: Look("magenta", "#ff00ff", 6, "cut outside"),
    CutLayer.REF: Look("grey", "#999999", 8, ""),
}
"""Appearance of each layer. Laser drivers order operations by colour.

Each operation has a colour that all drivers support. Most shops engrave black and cut red. Blue is not used, because
shops score it.
"""


@record
class Contour:
    """A closed path on a layer of a laser sheet.

    `diameter` (m) is set if the path is a full circle, because some file formats have a circle element.
    """

    layer: CutLayer
    path: Path
    diameter: float | None = None

    @property
    def centre(self) -> Point:
        """Centre of a circle. It has no meaning for other contours."""
        return Point((self.path.start.x + self.path.segments[0].end.x) / 2, self.path.start.y)

    @property
    def area(self) -> float:
        """Enclosed area (m2)."""
        return abs(enclosed_area(self.path))


@record
class Nest:
    """Arrangement of copies on a sheet: `count` copies in a grid of `columns` by `rows`.

    `number` is the number of the sheet, from 1. `times` is the number of equal sheets to cut.
    """

    count: int = 1
    columns: int = 1
    rows: int = 1
    number: int = 1
    times: int = 1


@record
class LaserSheet:
    """Drawing of one part to be cut: contours, and notes on layer REF. The origin is the sheet's lower left corner.

    `size` is the nominal size [x, y] of the finished part, and `thickness` its thickness. `kerf` is the width of
    material that the beam removes. `width` and `height` are the size of the drawing. All are in metres.
    """

    part: str
    material: str
    shape: str
    size: tuple[float, float]
    thickness: float
    kerf: float
    width: float
    height: float
    contours: tuple[Contour, ...]
    notes: tuple[tuple[Point, str], ...]
    nest: Nest = Nest()

    @property
    def name(self) -> str:
        """File name without suffix: the part, with a number if there are several sheets."""
        return self.part if self.nest.number == 1 else f"{self.part}-{self.nest.number}"

    def on(self, layer: CutLayer) -> tuple[Contour, ...]:
        """Return the contours of one layer."""
        return tuple(contour for contour in self.contours if contour.layer is layer)

    @property
    def cut(self) -> Contour:
        """Path of the beam's centre for the outside cut: the part's outline enlarged by half a kerf."""
        return self.on(CutLayer.CUT_OUTER)[0]


@record
class CutPart:
    """A part that is cut from a sheet.

    `part` is its name, `size` its nominal size [x, y] (m), and `place` its position above or below the coils. `words`
    is a note on the position, and `count` the number in each sensor. `thickness` and `kerf` are in m. If the part
    consists of several joined rectangles, these are `boxes`, and `size` is the overall size.
    """

    part: str
    material: str
    shape: str
    size: tuple[float, float]
    thickness: float
    kerf: float
    place: Footprint
    words: str = ""
    count: int = 1
    boxes: tuple[Box, ...] = ()

    def contours(self, layer: CutLayer, grown: float, centre: Point) -> Iterator[Contour]:
        """Yield the part's outline, centred at `centre` and enlarged by `grown` (m) on each side, and its holes."""
        if not self.boxes:
            yield plate(layer, self.shape, (self.size[0] + 2 * grown, self.size[1] + 2 * grown), centre)
            return
        dx, dy = centre.x - self.place.centre.x, centre.y - self.place.centre.y
        boxes = ((b[0] - grown, b[1] - grown, b[2] + grown, b[3] + grown) for b in self.boxes)
        paths = (path.mapped(lambda p: p.shifted(dx, dy)) for path in joined_boxes(boxes))
        for path in sorted(paths, key=enclosed_area):  # holes are cut before the piece comes loose
            is_hole = layer is CutLayer.CUT_OUTER and enclosed_area(path) < 0.0
            yield Contour(CutLayer.CUT_INNER if is_hole else layer, path)


def joined_part(spec: SensorSpec) -> CutPart | None:
    """Return all pads as a single piece whose pads are joined by webs, narrow strips. None if there are no webs."""
    pad, strips = spec.elastomer, webs(spec)
    if pad is None or spec.web is None or not strips:
        return None
    pads = [footprint(cell, pad) for cell in cell_specs(spec)]
    boxes = tuple(piece.box for piece in (*pads, *strips))
    x0, y0, x1, y1 = box_around(boxes)
    place = Footprint(False, (x1 - x0, y1 - y0), Point((x0 + x1) / 2, (y0 + y1) / 2))
    x, y = (in_mm(side) for side in pad.size)
    note = f"{len(pads)} pads of {x} x {y} mm, joined by webs {in_mm(spec.web)} mm wide"
    return CutPart("elastomer", pad.material.name, "rectangle", place.size, pad.thickness, pad.kerf, place, note, 1,
                   boxes)


def cut_parts(spec: SensorSpec) -> tuple[CutPart, ...]:
    """Return the pad and the target as parts to cut, if the spec has them."""
    joined = joined_part(spec)
    if joined is not None:
        return (joined, *(part for part in cut_parts(replace(spec, elastomer=None)) if part.part == "target"))
    return tuple(
        CutPart(
            name, plate.material.name, plate.shape, plate.size, plate.thickness, plate.kerf, footprint(spec, plate),
            place_text(plate), len(spec.cell_placements),
        )
        for name, plate in (("elastomer", spec.elastomer), ("target", spec.target))
        if plate is not None
    )


def laser_sheets(layout: Layout, more: tuple[CutPart, ...] = (), stop: str = "") -> tuple[LaserSheet, ...]:
    """Return the sheets of pad and target, if the spec has them, and of the parts in `more`.

    `sitscad.assembly.places.stack.sheets` adds the shield. `stop` is a warning that becomes the first note of each
    sheet.

    Raises
    ------
    ValueError
        if a kerf is negative, or as wide as the coupon's hole
    """
    spec = layout.spec
    issue = (spec.issue.words,) if spec.issue.rows else ()
    sheets = []
    for part in (*cut_parts(spec), *more):
        titles = (stop, f"{spec.name} {part.part}", *issue)
        covered = spec.array.placements if part.boxes else spec.cell_placements[0]
        coils = [Point(*placement.centre) for placement in covered]
        for nest in nests(part.size, part.kerf, spec.cutting, part.count * (spec.fpc.boards or 1)):
            sheets.append(_sheet(part, nest, spec.cutting.gap, titles, coils))
    return tuple(sheets)


def nests(size: tuple[float, float], kerf: float, cutting: Cutting, boards: int) -> tuple[Nest, ...]:
    """Return the arrangement of `boards` copies of a plate [x, y] (m) on full sheets, and a last sheet with the rest.

    Rows are filled from the left. The arrangement is as square as the sheet permits. Each sheet also has room for the
    kerf coupon beside the plates.

    Raises
    ------
    ValueError
        if not a single plate fits
    """
    if boards == 1:
        return (Nest(),)
    room = (cutting.sheet[0] - 3 * MARGIN - COUPON_SIZE - 2 * kerf, cutting.sheet[1] - 2 * MARGIN)
    most = [math.floor((room[k] + cutting.gap + 1e-9) / (size[k] + kerf + cutting.gap)) for k in (0, 1)]
    if min(most) < 1:
        raise ValueError(
            f"a plate of {in_mm(size[0])} x {in_mm(size[1])} mm and the coupon do not fit on a sheet of "
            f"{in_mm(cutting.sheet[0])} x {in_mm(cutting.sheet[1])} mm: give cutting.sheet the size of yours"
        )
    full, rest = divmod(boards, most[0] * most[1])
    sheets = [Nest(most[0] * most[1], most[0], most[1], 1, full)] if full else []
    if rest:
        columns = min(most[0], max(math.ceil(math.sqrt(rest)), math.ceil(rest / most[1])))
        sheets.append(Nest(rest, columns, math.ceil(rest / columns), len(sheets) + 1))
    return tuple(sheets)


def sheet_needed(size: tuple[float, float], kerf: float) -> tuple[float, float]:
    """Return the sheet size (m) for one plate [x, y] (m) and the kerf coupon beside it, with kerfs and margins."""
    return (size[0] + kerf + 3 * MARGIN + COUPON_SIZE + 2 * kerf, max(size[1] + kerf, COUPON_SIZE + kerf) + 2 * MARGIN)


def plate(layer: CutLayer, shape: str, size: tuple[float, float], centre: Point) -> Contour:
    """Return the outline of a circle, square or rectangle with this size [x, y] (m) about a centre, on a layer."""
    if PLATES[shape].is_disc:
        return Contour(layer, circle(centre, size[0] / 2), size[0])
    x, y = size[0] / 2, size[1] / 2
    return Contour(layer, rectangle(centre.x - x, centre.y - y, centre.x + x, centre.y + y))


def _sheet(part: CutPart, nest: Nest, gap: float, titles: tuple[str, ...], coils: list[Point]) -> LaserSheet:
    """Return the sheet of one part: contours enlarged by half a kerf, the kerf coupon beside them, and the notes above.

    Copies are `gap` (m) apart. `titles` are the first notes. `coils` are the centres of the coils under the part.
    """
    shape, size, kerf = part.shape, part.size, part.kerf
    if not 0.0 <= kerf < COUPON_HOLE:
        raise ValueError(
            f"a kerf of {kerf * 1e3:g} mm cannot be compensated: it must be from 0 to {COUPON_HOLE * 1e3:g} mm"
        )
    floor = MARGIN + kerf / 2
    centre = Point(floor + size[0] / 2, floor + size[1] / 2)
    step = tuple(length + kerf + gap for length in size)
    centres = [centre.shifted(*_place(index, nest.columns, step)) for index in range(nest.count)]
    right = centre.x + (nest.columns - 1) * step[0]
    coupon = Point(right + size[0] / 2 + kerf + MARGIN + COUPON_SIZE / 2, floor + COUPON_SIZE / 2)
    texts = (*filter(None, titles), *_texts(part), *_counted(nest))
    top = floor + max(size[1] + (nest.rows - 1) * step[1], COUPON_SIZE) + kerf / 2
    notes = tuple((Point(MARGIN, top + _LINE_STEP * (len(texts) - i)), text) for i, text in enumerate(texts))
    height = top + _LINE_STEP * (len(texts) + 1) + MARGIN
    width = (
        max(coupon.x + COUPON_SIZE / 2 + kerf / 2, MARGIN + max(map(len, texts)) * _LETTER_WIDTH * TEXT_HEIGHT) + MARGIN
    )
    contours = (
        *_label(coupon, kerf),
        plate(CutLayer.CUT_INNER, "square", (COUPON_HOLE - kerf,) * 2, coupon),
        *(contour for each in centres for contour in part.contours(CutLayer.CUT_OUTER, kerf / 2, each)),
        plate(CutLayer.CUT_OUTER, "square", (COUPON_SIZE + kerf,) * 2, coupon),
        *(part.contours(CutLayer.REF, 0.0, centre) if kerf else ()),  # without a kerf it would lie on the cut
        *_marks(part, coils, centre, width, height),
    )
    return LaserSheet(part.part, part.material, shape, size, part.thickness, kerf, width, height, contours, notes, nest)


def _place(index: int, columns: int, step: tuple[float, ...]) -> tuple[float, float]:
    """Return the position (m) of copy number `index` (from 0) relative to the first copy.

    Successive rows run in opposite directions, so that the laser beam travels less.
    """
    row, column = divmod(index, columns)
    return step[0] * (column if row % 2 == 0 else columns - 1 - column), step[1] * row


def _counted(nest: Nest) -> Iterator[str]:
    """Yield notes on the number of copies and the number of sheets to cut. Empty for a single copy."""
    if nest.count > 1:
        yield f"{nest.count} pieces in {count_text(nest.rows, 'row')}"
    if nest.times > 1:
        yield f"cut this sheet {nest.times} times"


def _texts(part: CutPart) -> tuple[str, ...]:
    kerf, sizes = part.kerf, PLATES[part.shape].size_text(part.size)
    half = in_mm(kerf / 2)
    compensation = (
        (
            f"kerf {in_mm(kerf)} mm: {half} mm added outside, holes less {half} mm",
            f"coupon: {in_mm(COUPON_SIZE)} mm wide, hole {in_mm(COUPON_HOLE)} mm if right",
            f"else kerf = {in_mm(kerf)} + {in_mm(COUPON_SIZE)} - measured width",
        )
        if kerf
        else (
            "kerf not compensated: drawn at nominal size",
            f"coupon: drawn {in_mm(COUPON_SIZE)} mm wide, hole {in_mm(COUPON_HOLE)} mm",
            f"{part.part}.kerf = {in_mm(COUPON_SIZE)} - measured width",
        )
    )
    return (
        f"{'over all' if part.boxes else part.shape} {sizes} mm, {in_mm(part.thickness)} mm thick",
        part.material,
        *([part.words] if part.words else []),
        *compensation,
        *_order(kerf > 0.0),
        f"{LOOKS[CutLayer.REF].colour} (layer REF) is not cut",
    )


def _order(is_engraved: bool) -> Iterator[str]:
    """Yield the lines of the legend: the order of the laser's operations, each with its colour and layer."""
    steps = [layer for layer in CutLayer if LOOKS[layer].work and (is_engraved or layer is not CutLayer.ENGRAVE)]
    for i, layer in enumerate(steps, 1):
        yield f"{i}. {LOOKS[layer].colour}: {LOOKS[layer].work} (layer {layer})"


def _marks(part: CutPart, coils: list[Point], centre: Point, width: float, height: float) -> Iterator[Contour]:
    """Yield cross marks on REF: at the part's centre, at the coils under it, and in two corners to align the sheet."""
    marks = (centre.shifted(*part.place.local_coordinates(coil)) for coil in coils)
    under = [mark for mark in marks if 0.0 < mark.x < width and 0.0 < mark.y < height]
    inset = MARGIN / 2
    places = dict.fromkeys(under, MARK_ARM / 2)
    places |= dict.fromkeys((centre, Point(inset, inset), Point(width - inset, height - inset)), MARK_ARM)
    for place, arm in places.items():
        for dx, dy in ((arm, 0.0), (0.0, arm)):
            yield Contour(CutLayer.REF, polyline([place.shifted(-dx, -dy), place.shifted(dx, dy)]))


# Strokes of the digits on a grid 1 wide and 2 high, as polylines; drivers of lasers seldom know fonts.
_DIGITS: dict[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "0": (((0, 0), (1, 0), (1, 2), (0, 2), (0, 0)),),
    "1": (((1, 0), (1, 2)),),
    "2": (((0, 2), (1, 2), (1, 1), (0, 1), (0, 0), (1, 0)),),
    "3": (((0, 2), (1, 2), (1, 0), (0, 0)), ((0, 1), (1, 1))),
    "4": (((0, 2), (0, 1), (1, 1)), ((1, 2), (1, 0))),
    "5": (((1, 2), (0, 2), (0, 1), (1, 1), (1, 0), (0, 0)),),
    "6": (((1, 2), (0, 2), (0, 0), (1, 0), (1, 1), (0, 1)),),
    "7": (((0, 2), (1, 2), (1, 0)),),
    "8": (((0, 1), (0, 0), (1, 0), (1, 2), (0, 2), (0, 1), (1, 1)),),
    "9": (((1, 1), (0, 1), (0, 2), (1, 2), (1, 0), (0, 0)),),
    ".": (((0.4, 0), (0.6, 0)),),
}
_DIGIT_WIDTH, _DIGIT_STEP = 0.6e-3, 1.0e-3


def _label(coupon: Point, kerf: float) -> Iterator[Contour]:
    """Yield the digits of the kerf in millimetres as strokes, engraved between the coupon's hole and its lower edge.

    Empty without a kerf.
    """
    text = in_mm(kerf) if kerf else ""
    band = (COUPON_SIZE - COUPON_HOLE) / 2
    start = coupon.x - (_DIGIT_STEP * (len(text) - 1) + _DIGIT_WIDTH) / 2
    lower = coupon.y - COUPON_SIZE / 2 + (band - 2 * _DIGIT_WIDTH) / 2
    for i, letter in enumerate(text):
        for stroke in _DIGITS[letter]:
            at = [Point(start + i * _DIGIT_STEP + x * _DIGIT_WIDTH, lower + y * _DIGIT_WIDTH) for x, y in stroke]
            yield Contour(CutLayer.ENGRAVE, polyline(at))
