"""Positions of elastomer and target in plan view, relative to the mean of their coils' centres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from sitscad.basics.record import memo
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point, bounding_box
from sitscad.spec.materials import CellsSpec, ElastomerPad, Target
from sitscad.spec.sensor import SensorSpec


def cell_specs(spec: SensorSpec) -> tuple[SensorSpec, ...]:
    """Return each cell as a separate sensor. Its coils keep their positions. The sensor itself if it has no cells."""
    cells = spec.cells
    return (spec,) if cells is None else memo(spec, "_cells", lambda: _cell_specs(spec, cells))


def _cell_specs(spec: SensorSpec, cells: CellsSpec) -> tuple[SensorSpec, ...]:
    is_line, pad = spec.array.pattern == "line" and cells.coils > 1, spec.elastomer
    pattern, pitch = "single" if cells.coils == 1 else "explicit", None
    if is_line:
        pattern, pitch = "line", spec.array.pitch
    array = replace(spec.array, pattern=pattern, pitch=pitch, reference=None)
    parts = [replace(spec, cells=None, array=replace(array, placements=placements))
             for placements in spec.cell_placements]
    if pad is None or cells.web is None:
        return tuple(parts)
    places = [footprint(cell, pad) for cell in parts]
    strips = _strips(places, cells.web)
    return tuple(replace(cell, elastomer=_with_webs(pad, place.centre, strips))
                 for cell, place in zip(parts, places, strict=True))


def map_columns(spec: SensorSpec, coils: Sequence[str]) -> tuple[list[int], str]:
    """Return the indices of the coils that a map reads, and the prefix of the names of its force axes.

    The indices count the sensor's coils from 0. `coils` are the coil names that the map states. The prefix is empty if
    the map reads all coils. If it reads the coils of one cell, the prefix lists their names. Raises ValueError for any
    other set of coils.
    """
    names = [placement.name for placement in spec.array.placements]
    if list(coils) == names:
        return list(range(len(names))), ""
    if list(coils) not in [[coil.name for coil in cell] for cell in spec.cell_placements]:
        whose = "those of a cell" if spec.cells else f"this one's {', '.join(names)}"
        raise ValueError(f"the map is of another sensor: its coils {', '.join(coils)} are not {whose}")
    return [names.index(name) for name in coils], f"{'+'.join(coils)}."


def _with_webs(pad: ElastomerPad, here: Point, strips: tuple[Footprint, ...]) -> ElastomerPad:
    """Return a cell's pad, centred at `here` (m), with the webs that join it to neighbouring pads.

    The pad's ``webs`` are one width (m), then the length (m) at each side: -x, +x, -y, +y. The length is 0 at a side
    without a web. `strips` are the webs of all cells.
    """
    lengths, width = [0.0] * 4, 0.0
    for strip in strips:
        offsets = strip.centre.x - here.x, strip.centre.y - here.y
        for axis, (way, across) in enumerate((offsets, offsets[::-1])):
            if abs(across) < 1e-9 and abs(way) < 0.51 * (pad.size[axis] + strip.size[axis]):
                lengths[2 * axis + (way > 0.0)], width = strip.size[axis], strip.size[1 - axis]
    return replace(pad, webs=(width, *lengths) if width else ())


def webs(spec: SensorSpec) -> tuple[Footprint, ...]:
    """Return the strips that join pads of neighbouring cells in rows and columns.

    Empty if the spec has no webs, or if the pads touch each other.
    """
    pad = spec.elastomer
    if spec.web is None or pad is None:
        return ()
    return _strips([footprint(cell, pad) for cell in cell_specs(spec)], spec.web)


def _strips(pads: Sequence[Footprint], width: float) -> tuple[Footprint, ...]:
    """Return strips of this `width` (m) that join the edges of neighbouring pads in each row and column."""
    centres, strips = sorted(pad.centre for pad in pads), []
    for axis in (0, 1):
        rows: dict[int, list[Point]] = {}
        for centre in centres:
            rows.setdefault(round(centre[1 - axis] * 1e9), []).append(centre)
        for first, second in (pair for row in rows.values() for pair in pairwise(row)):
            length = second[axis] - first[axis] - pads[0].size[axis]
            size = (length, width) if axis == 0 else (width, length)
            if length > 1e-9:
                strips.append(Footprint(False, size, Point((first.x + second.x) / 2, (first.y + second.y) / 2)))
    return tuple(strips)


def with_cells_stacked(spec: SensorSpec) -> SensorSpec:
    """Return the sensor with the coils of every cell moved to the positions of the first cell's coils.

    All coils then lie under one target. Its effect on each coil is correct, but the coupling between coils of different
    cells is not. Return the sensor itself if it has no cells.
    """
    if spec.cells is None:
        return spec
    first = spec.cell_placements[0]
    stacked = tuple(replace(first[k % len(first)], name=p.name) for k, p in enumerate(spec.array.placements))
    return replace(spec, cells=None, array=replace(spec.array, pattern="explicit", placements=stacked, pitch=None))


def footprint(spec: SensorSpec, plate: Target | ElastomerPad) -> Footprint:
    """Return shape, size (m), centre (m) and rotation (rad) of the target or pad in plan view, at rest.

    If the sensor has cells, it is the plate of the first cell.
    """
    (x, y), (dx, dy) = cell_specs(spec)[0].array.middle, plate.offset
    is_round = plate.outline.is_disc
    rotation = plate.rotation if isinstance(plate, Target) and not is_round else 0.0
    return Footprint(is_round, plate.size, Point(x + dx, y + dy), rotation)


def coil_positions_on_plate(spec: SensorSpec, plate: Target | ElastomerPad) -> dict[str, tuple[float, float]]:
    """Return the position (m) of each coil's centre relative to a plate's centre, by coil name.

    Coordinates are along the plate's own axes.
    """
    here = footprint(spec, plate)
    return {placement.name: here.local_coordinates(Point(*placement.centre)) for placement in spec.array.placements}


def span_over_coils(spec: SensorSpec, plate: Target | ElastomerPad) -> tuple[float, float]:
    """Return twice the largest distance (m) of a coil's centre from a plate's centre, along x and y of the plate.

    These are the sides of a plate whose edges lie above the centres of the outermost coils.
    """
    places = coil_positions_on_plate(spec, plate).values()
    x, y = (2.0 * max(abs(place[axis]) for place in places) for axis in (0, 1))
    return x, y


def overlap_centres(spec: SensorSpec) -> tuple[Point, ...]:
    """Return the centre (m) of the overlap of each coil's bounding box with the bounding box of the target at rest.

    The boxes are parallel to the board's x and y and enclose the rotated parts. The results are relative to the mean of
    the coils' centres. For a coil beside the target, the result is the nearest point of the target's box.
    """
    assert spec.target is not None
    outline, (mx, my), covered = spec.coil.outline, spec.array.middle, footprint(spec, spec.target).box
    middles = []
    for placement in spec.array.placements:
        (x, y), turned = placement.centre, outline.boundary(spec.coil.size, 0.0).rotated(placement.rotation)
        _, _, half_x, half_y = bounding_box([turned])  # half extents: outlines are symmetric under half a turn
        x, y = _overlap_centre(x, half_x, covered[0], covered[2]), _overlap_centre(y, half_y, covered[1], covered[3])
        middles.append(Point(x - mx, y - my))
    return tuple(middles)


def _overlap_centre(centre: float, half: float, start: float, end: float) -> float:
    """Return the centre (m) of the overlap of two intervals: centre plus and minus `half`, and `start` to `end`."""
    low, high = (min(max(centre + way * half, start), end) for way in (-1, 1))
    return 0.5 * (low + high)


def place_text(plate: Target | ElastomerPad) -> str:
    """Return a plate's offset and rotation as text for assembly. Empty if both are 0.

    The offset is the position of the plate's centre relative to the mean of the coils' centres. Rotation of a disc is
    left out.
    """
    parts = []
    if any(plate.offset):
        x, y = (f"{length * 1e3:.6g}" for length in plate.offset)
        parts.append(f"centre [{x}, {y}] mm from the coils' mean")
    if isinstance(plate, Target) and plate.rotation and not plate.outline.is_disc:
        parts.append(f"turned by {math.degrees(plate.rotation):.6g} deg")
    return ", ".join(parts)
