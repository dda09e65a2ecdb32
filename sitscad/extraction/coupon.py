"""The panel's coupon: one coil, which must be one winding from one solder pad to the other, closed nowhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from gerbonara import GerberFile
from shapely import Point, box
from shapely.geometry.base import BaseGeometry

from sitscad.extraction.artwork import QUARTER_SEGMENTS, Artwork, Flash, Hole, area_of
from sitscad.extraction.differences import Difference, Kind, compare
from sitscad.extraction.intent import Mark, Source
from sitscad.extraction.nets import nets_of
from sitscad.extraction.plotted import Plotted, gerber_text

NET, PADS = "coupon", 2


def compare_coupon(objects: Mapping[str, Plotted], apertures: Sequence[str]) -> tuple[Difference, ...]:
    """What is wrong with a coupon, of which ``objects`` are the plotted ones by their file function.

    Pads for solder are rectangles, those of vias round: that is how the board's own files have them, too.
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
            marks.append(Mark(NET, layer, *at, Source.X2, pin=pin, is_via=not is_pad))
            flashes.append(Flash(layer, *at, _flashed(apertures[aperture], at)))
    openings = {f.split(",")[1]: shown(objects[f], apertures) for f in objects if f.startswith("Soldermask")}
    copper = tuple(shown(objects[function], apertures) for function in layers)
    art = Artwork(copper, tuple(flashes), tuple(_holes(objects, len(layers))), openings, ())
    found = compare(nets_of(art, tuple(marks)))
    pads = sum(mark.pin is not None for mark in marks)
    if pads == PADS:
        return found
    message = f"{pads} solder pads, where a coil has {PADS}"
    return (Difference(Kind.NO_COPPER, message), *found)


def shown(objects: Plotted, apertures: Sequence[str]) -> BaseGeometry:
    """The area that objects make dark (m)."""
    return area_of(list(GerberFile.from_string(gerber_text(objects, apertures)).objects))


def _flashed(aperture: str, at: tuple[float, float]) -> BaseGeometry:
    """The shape (m) of a flashed aperture at a place."""
    kind, _, sizes = aperture.partition(",")
    x, y = at
    if kind == "R":
        w, h = (float(size) * 1e-3 for size in sizes.split("X"))
        return box(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    return Point(x, y).buffer(float(sizes.split("X")[0]) * 0.5e-3, quad_segs=QUARTER_SEGMENTS)


def _holes(objects: Mapping[str, Plotted], layers: int) -> Iterator[Hole]:
    """The coupon's holes out of its drill files."""
    for function in objects:
        if not function.startswith(("Plated", "NonPlated")):
            continue
        plating, first, last, *_ = function.split(",")
        for diameter, _, _, _, _, x, y, _, _ in objects[function].objects.tolist():
            at = Point(x * 1e-9, y * 1e-9)
            shape = at.buffer(diameter * 0.5e-9, quad_segs=QUARTER_SEGMENTS)
            through = tuple(range(int(first), min(int(last), layers) + 1))
            yield Hole(x * 1e-9, y * 1e-9, diameter * 1e-9, shape, plating == "Plated", through)
