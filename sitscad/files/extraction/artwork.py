"""Areas and holes that finished Gerber and Excellon files expose and drill.

The files are found by their X2 ``.FileFunction``, never by their names. They are read by gerbonara, which sitscad's
writers do not use. All shapes are shapely geometries in metres.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from gerbonara import ExcellonFile, GerberFile
from gerbonara import graphic_primitives as primitives
from gerbonara.graphic_objects import Flash as FlashedObject
from gerbonara.utils import MM
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from sitscad.basics.record import record
from sitscad.files.extraction.limits import (
    MAX_LAYERS,
    MAX_POINTS,
    ExtractionError,
    content_of,
    reading,
    require_drill,
    require_few_overlaps,
    require_gerber,
    require_near,
    require_objects,
)

SAGITTA = 5e-8
"""Largest distance (m) between an arc and its chords."""

QUARTER_SEGMENTS = 16
"""Number of chords for a quarter circle at a round end. Their error is 0.05 um at a radius of 50 um."""

_FILE_FUNCTION = re.compile(r"(?:%|^;\s*#@!\s*)TF\.FileFunction,([^*%\r\n]*)", re.MULTILINE)

_HEAD = 4096
"""Number of bytes at the beginning of a file that are searched for a zero byte, which shows that it is no text."""

UNLISTED = "Drillmap"
"""First field of the file function of drill maps, which job files do not list."""

_COVER = re.compile(r"Other,Tail_Coverlay_L(\d+)")
_EXTENT = re.compile(r"Other,Extent_of_L(\d+)(?:_to_L(\d+))?")


@record
class Flash:
    """A flashed pad: copper layer (from 1 at the top), centre and area."""

    layer: int
    x: float
    y: float
    shape: BaseGeometry


@record
class PlottedHole:
    """A drilled hole: centre, diameter and area (m, m2), and the copper layers that it goes through."""

    x: float
    y: float
    diameter: float
    shape: BaseGeometry
    is_plated: bool
    layers: tuple[int, ...]


@record
class Artwork:
    """Board as drawn by its files.

    Attributes
    ----------
    copper
        Area of each copper layer, top first.
    flashes
        Flashed pads.
    holes
        Drilled holes.
    openings
        Openings of the coverlay by side (``Top``, ``Bot``), for the sides that have a file.
    sources
        Copper files, in the order of ``copper``.
    extents
        First layer, last layer and area, for layers that do not cover the whole board.
    covers
        Layer and area of the coverlays on layers that extend beyond the layers below.
    """

    copper: tuple[BaseGeometry, ...]
    flashes: tuple[Flash, ...]
    holes: tuple[PlottedHole, ...]
    openings: dict[str, BaseGeometry]
    sources: tuple[Path, ...]
    extents: tuple[tuple[int, int, BaseGeometry], ...] = ()
    covers: tuple[tuple[int, BaseGeometry], ...] = ()


def read_artwork(directory: Path) -> Artwork:
    """Return the copper layers, drilled holes and coverlay openings of the files in a directory.

    Subdirectories are not searched. Raises ExtractionError if a file cannot be read or a copper layer is missing.
    """
    functions = dict(sorted(file_functions(directory)))
    layers: dict[int, Path] = {}
    for path, (function, *rest) in functions.items():
        if function == "Copper":
            if not re.fullmatch(r"L[1-9][0-9]*", rest[0]):
                raise ExtractionError(f"{path.name}: a copper layer called {rest[0]!r}, where L1, L2, ... is expected")
            number = int(rest[0][1:]) if len(rest[0]) <= len(f"L{MAX_LAYERS}") else MAX_LAYERS + 1
            if number > MAX_LAYERS:
                raise ExtractionError(f"{path.name} is copper layer {rest[0][:20]}, and {MAX_LAYERS} is the maximum")
            if number in layers:
                raise ExtractionError(f"{path.name} and {layers[number].name} both claim to be copper layer {number}")
            layers[number] = path
    if not layers:
        raise ExtractionError(f"no Gerber file in {directory} calls itself a copper layer")
    if missing := sorted(set(range(1, max(layers) + 1)) - set(layers)):
        raise ExtractionError(f"copper layers {missing} are missing in {directory}")
    artwork_files = {path: fields for path, fields in functions.items() if _is_artwork(fields)}
    files = [(path.name, fields, objects_of(path, fields)) for path, fields in artwork_files.items()]
    return artwork_of(files, tuple(layers[number] for number in sorted(layers)))


def artwork_of(files: Iterable[tuple[str, Sequence[str], list[Any]]], sources: tuple[Path, ...]) -> Artwork:
    """Return the artwork of one board, from the objects that its files plot.

    ``files`` are rows (name, fields of the file function, plotted objects). ``sources`` are the paths of the copper
    files, from the top. Raises ExtractionError if a file names a layer that the board does not have.
    """
    copper: dict[int, BaseGeometry] = {}
    flashes: list[Flash] = []
    holes: list[PlottedHole] = []
    openings: dict[str, BaseGeometry] = {}
    extents, covers = [], []
    for name, fields, objects in files:
        with reading(name):
            if fields[0] == "Copper":
                layer = int(fields[1][1:])
                copper[layer] = area_of(objects)
                for thing in (thing for thing in objects if isinstance(thing, FlashedObject)):
                    x, y = (1e-3 * thing.unit.convert_to(MM, value) for value in (thing.x, thing.y))
                    flashes.append(Flash(layer, x, y, _shape(thing)))
            elif fields[0] in DRILLED:
                holes += _holes(name, fields, objects, len(sources))
            elif fields[0] == "Soldermask":
                openings[fields[1]] = area_of(objects)
            elif match := _EXTENT.fullmatch(",".join(fields)):
                span = _layer(match[1], sources), _layer(match[2] or match[1], sources)
                extents.append((*span, area_of(objects)))
            elif match := _COVER.fullmatch(",".join(fields)):
                covers.append((_layer(match[1], sources), area_of(objects)))
    flashes.sort(key=lambda flash: flash.layer)
    areas = tuple(copper[layer] for layer in sorted(copper))
    return Artwork(areas, tuple(flashes), tuple(holes), openings, sources, tuple(extents), tuple(covers))


def _layer(number: str, sources: Sequence[Path]) -> int:
    """Return the layer number that a text states. Raises ExtractionError if the board has no such layer.

    `sources` are the paths of the board's copper files.
    """
    if len(number) > len(str(MAX_LAYERS)) or not 1 <= int(number) <= len(sources):
        raise ExtractionError(f"layer {number[:20]} of a board with {len(sources)} copper layers")
    return int(number)


def file_functions(directory: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield (path, fields of the X2 file function) for each Gerber and drill file in a directory.

    Raises ExtractionError if it is not a directory.
    """
    if not directory.is_dir():
        raise ExtractionError(f"{directory} is not a directory")
    for path in directory.iterdir():
        if not path.is_file():
            continue
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
        if b"\0" in head:  # not text: an archive may contain the text searched below
            continue
        content = content_of(path)
        if match := _FILE_FUNCTION.search(content.decode("utf-8", errors="replace")):
            yield path, match[1].split(",")


DRILLED = ("Plated", "NonPlated")
"""First fields of the file functions of drill files."""


def _is_artwork(fields: Sequence[str]) -> bool:
    """Return whether a file belongs to `Artwork`. Outlines, drawings and drills of other programs do not."""
    function = ",".join(fields)
    is_layer = fields[0] in ("Copper", "Soldermask", *DRILLED)
    return is_layer or bool(_EXTENT.fullmatch(function) or _COVER.fullmatch(function))


def objects_of(path: Path, fields: Sequence[str]) -> list[Any]:
    """Return the graphic objects of a Gerber or drill file, as objects of gerbonara.

    `fields` are the fields of its file function. Raises ExtractionError if the file is unsafe or cannot be parsed.
    """
    with reading(path.name):
        if fields[0] in DRILLED:
            require_drill(path)
            return list(_read(path, ExcellonFile.open).objects)
        require_gerber(path)
        return list(_read(path, GerberFile.open).objects)


def _read(path: Path, opener: Any) -> Any:
    """Return a file as parsed by `opener` of gerbonara.

    Raises ExtractionError for errors, and for warnings, because a warning shows a doubtful command.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*header statement found after end of header")  # as KiCad writes
        try:
            return opener(path)
        except (SyntaxError, Warning, ValueError, KeyError, IndexError, TypeError) as error:
            raise ExtractionError(f"{path.name}: {error}") from error


def _holes(name: str, fields: Sequence[str], objects: list[Any], layer_count: int) -> Iterator[PlottedHole]:
    """Yield the holes of a drill file, with the layers that they go through."""
    try:
        first, last = int(fields[1]), int(fields[2])
    except (IndexError, ValueError) as error:
        raise ExtractionError(f"{name}: no layer span in its file function {','.join(fields)!r}") from error
    if not 1 <= first <= last <= layer_count:
        raise ExtractionError(f"{name} drills layers {first} to {last} of a board with {layer_count}")
    require_objects(len(objects))
    for thing in objects:
        shape = _shape(thing)
        centre = shape.centroid
        diameter = 1e-3 * thing.tool.unit.convert_to(MM, thing.tool.diameter)
        yield PlottedHole(centre.x, centre.y, diameter, shape, fields[0] == "Plated", tuple(range(first, last + 1)))


def area_of(objects: list[Any]) -> BaseGeometry:
    """Return the dark area of objects drawn in order. Clear objects remove what lies below them."""
    area: BaseGeometry = Polygon()
    require_objects(len(objects))
    points = 0
    for dark, group in groupby(objects, key=lambda thing: bool(thing.polarity_dark)):
        parts = []
        for thing in group:
            parts.append(_shape(thing))
            points += shapely.get_num_coordinates(parts[-1])
            if points > MAX_POINTS:
                raise ExtractionError(f"its objects have more than {MAX_POINTS} corners, the maximum")
        require_few_overlaps(parts)
        shapes = shapely.union_all(parts)
        area = area.union(shapes) if dark else area.difference(shapes)
    return area


def _shape(thing: Any) -> BaseGeometry:
    """Return the area (m) of one object, regardless of its polarity. A hole in its aperture is not part of the area."""
    primitives = list(thing.to_primitives(unit=MM))
    dark = bool(getattr(thing, "polarity_dark", True))
    parts = [_primitive(p) for p in primitives if bool(p.polarity_dark) == dark]
    solid = parts[0] if len(parts) == 1 else shapely.union_all(parts)
    pierced = [_primitive(p) for p in primitives if bool(p.polarity_dark) != dark]
    return solid.difference(shapely.union_all(pierced)) if pierced else solid


def _primitive(p: Any) -> BaseGeometry:
    """Return the shape (m) of a graphic primitive."""
    match p:
        case primitives.Circle():
            return Point(1e-3 * p.x, 1e-3 * p.y).buffer(1e-3 * p.r, quad_segs=QUARTER_SEGMENTS)
        case primitives.Line() | primitives.Arc():
            return _stroke(_middle_points(p), p.width)
        case primitives.Rectangle():
            corners = np.array([(-p.w, -p.h), (p.w, -p.h), (p.w, p.h), (-p.w, p.h)]) * 0.5e-3
            cos, sin = math.cos(p.rotation), math.sin(p.rotation)
            return Polygon(corners @ np.array([(cos, sin), (-sin, cos)]) + 1e-3 * np.array((p.x, p.y)))
        case primitives.ArcPoly():
            # A filled contour of lines and arcs
            points: list[np.ndarray] = []
            for start, end, (clockwise, centre) in p.segments:
                if clockwise is None:
                    points.append(1e-3 * np.array([start]))
                else:
                    ends = 1e-3 * np.array([start, end, centre])
                    points.append(_arc_points(*ends, clockwise=clockwise)[:-1])
            polygon = Polygon(np.concatenate(points))
            if polygon.is_valid:
                return polygon
            return shapely.make_valid(polygon, method="structure", keep_collapsed=False)
    raise ExtractionError(f"a graphic of a kind that is not understood: {type(p).__name__}")


def middle_line(objects: Iterable[Any]) -> BaseGeometry:
    """Return the centre lines (m) of all lines and arcs among plotted objects."""
    objects = list(objects)
    require_objects(len(objects))
    shapes = (p for thing in objects for p in thing.to_primitives(unit=MM))
    return shapely.union_all([
        LineString(_middle_points(p)) for p in shapes if isinstance(p, primitives.Line | primitives.Arc)
    ])


def _middle_points(p: Any) -> np.ndarray:
    """Return the points (n, 2; m) along the centre line of a drawn line or arc."""
    start, end = 1e-3 * np.array([(p.x1, p.y1), (p.x2, p.y2)])
    if isinstance(p, primitives.Line):
        return np.array([start, end])
    return _arc_points(start, end, 1e-3 * np.array([p.cx, p.cy]), clockwise=p.clockwise)


def _stroke(points: np.ndarray, width_mm: float) -> BaseGeometry:
    require_near(points[[0, -1]].ravel())
    radius = 0.5e-3 * width_mm
    if np.ptp(points, axis=0).max() == 0.0:
        return Point(points[0]).buffer(radius, quad_segs=QUARTER_SEGMENTS)
    return LineString(points).buffer(radius, quad_segs=QUARTER_SEGMENTS)


def _arc_points(start: np.ndarray, end: np.ndarray, centre: np.ndarray, *, clockwise: bool) -> np.ndarray:
    """Return points (n, 2; m) on an arc. Their chords deviate from the arc by at most `SAGITTA`.

    If start and end are equal, the arc is a full circle, as in the Gerber format.
    """
    require_near((*start, *end, *centre))
    from_centre, to_centre = start - centre, end - centre
    radii = np.hypot(*from_centre), np.hypot(*to_centre)
    angle = math.atan2(from_centre[1], from_centre[0])
    sweep = (math.atan2(to_centre[1], to_centre[0]) - angle) % (2.0 * math.pi)
    if np.array_equal(start, end):
        sweep = 2.0 * math.pi
    elif clockwise:
        sweep -= 2.0 * math.pi
    step = 2.0 * math.acos(max(0.0, 1.0 - SAGITTA / max(*radii, SAGITTA)))
    fraction = np.linspace(0.0, 1.0, max(2, math.ceil(abs(sweep) / step)) + 1)
    radius = radii[0] + fraction * (radii[1] - radii[0])
    angles = angle + fraction * sweep
    points = centre + radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points[0], points[-1] = start, end
    return points
