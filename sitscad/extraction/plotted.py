"""What Gerber and drill files plot, object by object on the files' grid: to hold one file's objects against another's.

Nothing is made into areas here, so that a panel of hundreds of boards is read in a moment. Lengths in nanometres.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from gerbonara import ExcellonFile, GerberFile
from gerbonara.utils import MM
from numpy.typing import NDArray
from shapely import Point, box
from shapely.geometry.base import BaseGeometry

from sitscad.arrays import Flags
from sitscad.extraction.artwork import QUARTER_SEGMENTS, Artwork, Flash, PlottedHole, area_of
from sitscad.extraction.differences import Difference, DifferenceKind, compare
from sitscad.extraction.intent import Mark, MarkSource
from sitscad.extraction.limits import ExtractionError, require_drill, require_gerber
from sitscad.extraction.nets import nets_of
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
