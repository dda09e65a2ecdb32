"""SIT306 and SIT328: the target's size relative to the coils, and the gaps between the plates of cells.

The module also computes sizes and places of plates for the fixes of SIT307. After such a fix, the target lies
completely on its elastomer, and the elastomer lies completely on the board's body.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from sitscad.assembly.places.bodies import (
    Body,
    Plates,
    film_thickness,
    plates_of,
)
from sitscad.assembly.places.column import print_limit
from sitscad.basics.finding import Edit, Severity
from sitscad.basics.record import record
from sitscad.basics.units import parse_quantity
from sitscad.checks.assembly.fit import GRAIN
from sitscad.checks.fixes.moves import reread_changes
from sitscad.checks.fixes.pads import Plate, centred_plates, larger_target, pad_sides_under_plate, resized_plates
from sitscad.checks.fixes.search import Family, Fix, with_value
from sitscad.checks.rules import ROUNDING, Verdict, constant_limits, not_checked, rule_of, violation_of
from sitscad.data import rows
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.estimates.loads.pressing import pressed_pad, rests_on_pad
from sitscad.estimates.loads.working_range import full_normal_force
from sitscad.estimates.performance.screen import target_effects
from sitscad.kernels.geometry.convex import Box, Footprint, signed_distance
from sitscad.kernels.geometry.path import Path, Point, rectangle
from sitscad.kernels.geometry.shapes import LONG_PLATE, PLATES
from sitscad.layout.board import Layout
from sitscad.layout.tail.frame import CORNER_RADIUS
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.coil import ArraySpec, CoilPlacement
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.places import footprint
from sitscad.spec.sensor import SensorSpec

MOST_MARGIN, MOST_SIDE = 0.1, 0.5
"""Largest ``fpc.margin`` (m), and largest side of a plate (m), that a spec may have."""


def lowest_plates(plates: Plates) -> tuple[Body, ...]:
    """Return the plates that lie directly on the board: the elastomers, or the targets if there are none."""
    return plates.elastomers or plates.targets


def grow_box(box: tuple[float, ...], by: float) -> tuple[float, float, float, float]:
    """Return a box (x_min, y_min, x_max, y_max; m) enlarged by the length `by` (m) on every side."""
    return box[0] - by, box[1] - by, box[2] + by, box[3] + by


def plates_lie_on_body(plates: Plates, film: float, body: Path) -> bool:
    """Whether the target lies completely on its pad, and all lowest plates with their film lie on the board's body.

    `film` is the thickness (m) of the film around the lowest plates, and `body` the outline of the body.
    """
    pad, plate = plates.elastomer, plates.target
    if pad is not None and plate is not None and plate.footprint.overhang_beyond(pad.outline()) > ROUNDING:
        return False
    return all(low.footprint.overhang_beyond(body) + film <= ROUNDING for low in lowest_plates(plates))


def larger_pad(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to an elastomer large enough to carry the whole target. Empty if it carries the target already."""
    pad, plate = plates_of(spec).elastomer, plates_of(spec).target
    if spec.elastomer is None or pad is None or plate is None:
        return
    if plate.footprint.overhang_beyond(pad.outline()) <= ROUNDING:
        return
    for edits, larger in resized_plates("elastomer", spec.elastomer,
                                        pad_sides_under_plate(pad.footprint, plate.footprint)):
        if max(larger.size) <= MOST_SIDE:
            yield Fix(edits, replace(spec, elastomer=larger))


def pad_under_target(spec: SensorSpec) -> Iterator[Fix]:
    """Yield the change that gives the elastomer the target's offset, then the change of both offsets to 0.

    The offset of a part is the distance of its centre from the mean of the coils' centres. A change that would alter
    nothing is left out.
    """
    pad, plate = spec.elastomer, spec.target
    if pad is not None and plate is not None and pad.offset != plate.offset:
        yield with_value(spec, "elastomer.offset", plate.offset, pair_text(plate.offset))
    moved = [name for name, part in (("elastomer", pad), ("target", plate)) if part is not None and any(part.offset)]
    if moved:
        back: dict[str, Any] = {name: replace(getattr(spec, name), offset=(0.0, 0.0)) for name in moved}
        yield Fix(tuple(Edit(f"{name}.offset", "[0, 0]") for name in moved), replace(spec, **back))


def more_margin(
    here: Sequence[Footprint], film: float, fpc: FpcSpec, trace_width: float, body: Box
) -> tuple[float, float]:
    """Return the smallest ``fpc.margin`` (x, y; m) at which the lowest plates and their film lie on the body.

    `here` are the footprints of these plates, `film` is the film's thickness (m), and `trace_width` (m) the width of
    the coils' tracks. `body` is the box of the present body. The larger body has rounded corners.
    """
    boxes = [grow_box(plate.box, film) for plate in here]
    more = [max(0.0, *(max(body[k] - box[k], box[k + 2] - body[k + 2]) for box in boxes)) for k in (0, 1)]
    radius = max(CORNER_RADIUS, fpc.rules.copper_to_edge + trace_width / 2)

    def has_room(beside: float) -> bool:
        dx, dy = more[0] + beside, more[1] + beside
        larger = rectangle(body[0] - dx, body[1] - dy, body[2] + dx, body[3] + dy, radius)
        return max(plate.overhang_beyond(larger) for plate in here) + film <= 0.0

    beside = _least_amount(has_room, radius)
    x, y = (round(math.ceil((now + side + beside) / GRAIN - 1e-4) * GRAIN, 9) if side + beside > 0.0 else now
            for now, side in zip(fpc.margin, more, strict=True))
    return x, y


def cut_to_board(spec: SensorSpec, body: Path) -> Iterator[Fix]:
    """Yield changes to a smaller target and elastomer that lie on the body. Their centres do not move.

    Sides are rounded down to multiples of 0.1 mm, then of 0.05 mm, then of `GRAIN`.
    """
    for grain in (100e-6, 50e-6, GRAIN):
        if spec.elastomer is not None:
            yield from _plates_cut_to_board(spec, spec.elastomer, body, grain)
        elif spec.target is not None:
            here, film = footprint(spec, spec.target), film_thickness(spec.encapsulation)
            for edits, plate in _fitting_plates("target", here, spec.target, body, film, grain):
                yield Fix(edits, replace(spec, target=plate))


def _plates_cut_to_board(spec: SensorSpec, now: ElastomerPad, body: Path, grain: float) -> Iterator[Fix]:
    for pad in (*(c.spec.elastomer for c in larger_pad(spec) if c.spec.elastomer), now):
        film = film_thickness(spec.encapsulation)
        for below, smaller in _fitting_plates("elastomer", footprint(spec, pad), pad, body, film, grain):
            if smaller == now:
                below = ()
            elif smaller == pad:
                below = _plate_edits("elastomer", now, smaller)
            if spec.target is None:
                yield Fix(below, replace(spec, elastomer=smaller))
                continue
            outline = footprint(spec, smaller).outline()
            here = footprint(spec, spec.target)
            for on_top, plate in _fitting_plates("target", here, spec.target, outline, 0.0, grain):
                if below or on_top:
                    yield Fix((*below, *on_top), replace(spec, target=plate, elastomer=smaller))


def _fitting_plates(
    key: str, here: Footprint, plate: Plate, on: Path, around: float, grain: float
) -> Iterator[tuple[tuple[Edit, ...], Plate]]:
    """Yield (edits, smaller plate) for versions of a plate that lie completely on the outline `on`.

    `key` is the plate's section in the spec, `here` its present footprint, and `around` (m) the thickness of the film
    around it. Reduced sides are multiples of `grain` (m). The first version has the plate's shape, the second is a
    rectangle. A plate that lies on the outline already is returned unchanged, without edits.
    """
    if here.overhang_beyond(on) + around <= ROUNDING:
        yield (), plate
        return
    for shape in dict.fromkeys((plate.shape, LONG_PLATE)):
        cut = PLATES[shape]
        kind = replace(here, is_round=cut.is_disc)
        size = _largest_sides(kind, on, around, not (cut.is_disc or cut.is_long), grain)
        if size is not None:
            smaller = replace(plate, shape=shape, size=size)
            yield _plate_edits(key, plate, smaller), smaller


def _largest_sides(
    here: Footprint, on: Path, around: float, is_square: bool, grain: float
) -> tuple[float, float] | None:
    # The sides (m) of the largest plate of a kind that has room in place, no larger than now. Smaller sides are whole
    # grains. None without room.
    room = -signed_distance(on, here.centre) - around
    if room < GRAIN:
        return None
    if here.is_round:
        side = _round_down(min(here.size[0], 2.0 * room), grain)
        return side, side
    size = [min(here.size[k], _widest_side(here, on, around, k)) for k in (0, 1)]
    size = [min(size)] * 2 if is_square else size
    directions = [(1.0, 1.0)] if is_square else [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]
    sizes = [cut for way in directions if (cut := _shortened_sides(here, size, way, on, around, grain)) is not None]
    return max(sizes, key=lambda sides: (round(sides[0] * sides[1], 12), sides), default=None)


def _shortened_sides(
    here: Footprint, size: list[float], way: tuple[float, float], on: Path, around: float, grain: float
) -> tuple[float, float] | None:
    """Return the largest reduced sides (m) with which a plate and the film around it lie on the outline `on`.

    `here` is the plate's footprint. `size` are the sides (m) at which the search begins. `way` has two values, 1 for a
    side that may be shortened and 0 for the other sides. `around` (m) is the film's thickness. Sides are multiples of
    `grain` (m). None if even the smallest plate does not fit.
    """

    def sides(less: float) -> tuple[float, float]:
        x, y = (max(GRAIN, side - less * part) for side, part in zip(size, way, strict=True))
        return x, y

    def has_room(less: float) -> bool:
        return replace(here, size=sides(less)).overhang_beyond(on) + around <= 0.0

    if not has_room(max(size)):
        return None
    x, y = (now if now - side < ROUNDING else _round_down(side, grain)
            for now, side in zip(here.size, sides(_least_amount(has_room, max(size))), strict=True))
    return x, y


def _widest_side(here: Footprint, on: Path, around: float, axis: int) -> float:
    """Return the largest side (m) along `axis` (0: x, 1: y) of a plate whose other side is nearly 0.

    The plate and the film of thickness `around` (m) beside it must lie on the outline `on`. The plate's centre does not
    change.
    """
    sides = [GRAIN, GRAIN]

    def has_room(less: float) -> bool:
        sides[axis] = max(GRAIN, here.size[axis] - less)
        return replace(here, size=(sides[0], sides[1])).overhang_beyond(on) + around <= 0.0

    return max(GRAIN, here.size[axis] - _least_amount(has_room, here.size[axis]))


def _least_amount(enough: Callable[[float], bool], most: float) -> float:
    """Return the smallest length (m) for which `enough` is true, found by bisection between 0 and `most` (m).

    The error is at most a thousandth of `GRAIN`.
    """
    if enough(0.0):
        return 0.0
    low, high = 0.0, most
    while high - low > 1e-3 * GRAIN:
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _round_down(length: float, grain: float) -> float:
    """Return a length (m) rounded down to a multiple of `grain` (m), at least `GRAIN`.

    A length just below a multiple counts as this multiple, because lengths from `_least_amount` have a small error.
    """
    return max(GRAIN, round(math.floor((length + 1e-3 * GRAIN) / grain + 1e-9) * grain, 9))


def pair_text(lengths: tuple[float, float]) -> str:
    """Return two lengths (m) as the text of a YAML list in mm."""
    return f"[{lengths[0] * 1e3:.6g}, {lengths[1] * 1e3:.6g}]"


def _plate_edits(key: str, before: Plate, after: Plate) -> tuple[Edit, ...]:
    """Return the edits of the spec that change a plate's shape and size from `before` to `after`."""
    size = pair_text(after.size) if after.outline.is_long else f"{after.size[0] * 1e3:.6g}"
    written = {"shape": after.shape if after.shape != before.shape else "", "size": size * (after.size != before.size)}
    return tuple(Edit(f"{key}.{name}", text) for name, text in written.items() if text)


TARGET_LENGTH_TOLERANCE = 0.2


def target_proportions(design: Design) -> Iterator[Verdict]:
    """Yield findings on a target that is too small, too long, or not over the coils.

    The target must be at least as wide as a coil. Over two coils in a line, its best length is about the distance
    between the coils' centres. There is a finding if a target of this length would give a much larger signal. Over
    other arrays, the target must be at least as long as a coil. Further findings are on an offset that moves the target
    away from coils, and on a target between coils.
    """
    target, array = design.spec.target, design.spec.array
    assert target is not None
    pitch = _line_pitch(array)
    coil = _largest_coil(design.spec.array.placements, design.spec.coil.size, target.rotation)

    hint, size = _larger_target(target, pitch, coil)
    fixes: tuple[Family, ...] = () if size is None else (partial(larger_target, design.spec, *size),)
    if not is_as_long_as_line(design.spec.array, design.spec.target):
        yield from _target_length_findings(design, hint, fixes)
    for case, axis in (("target-narrow", 1),) if pitch else (("target-short", 0), ("target-narrow", 1)):
        if target.size[axis] < coil[axis] - ROUNDING:
            yield violation_of(case, "target.size", target.size[axis], coil[axis], "m", hint=hint, fixes=fixes)
    if any(target.offset):
        here = footprint(design.spec, target)
        middle = footprint(design.spec, replace(target, offset=(0.0, 0.0)))
        yield from _uncovered_coil_findings(array, target, here, middle, coil, (partial(centred_plates, design.spec),))
    elif pitch is None:
        # a target in the middle of several coils may reach none of them
        outline, half = footprint(design.spec, target).outline(), 0.5 * min(design.spec.coil.size)
        nearest = min(signed_distance(outline, Point(*p.centre)) for p in array.placements)
        if nearest >= half:
            yield violation_of("target-between", "target.size", nearest, half, "m")
    if pitch is None and len(array.placements) > 1:
        yield not_checked("target-length-line")


def _target_length_findings(design: Design, hint: str, fixes: tuple[Family, ...]) -> Iterator[Verdict]:
    """Yield a finding if another length of the target would give a much larger signal over two coils in a line.

    The other length is the distance between the coils' centres. The ratio of the signals is compared with the limit
    `target_length_gain` of ``data/own_limits.csv``. `hint` is the key of the hint in ``data/messages.csv``.
    """
    spec, pitch, limit = design.spec, _line_pitch(design.spec.array), constant_limits()["target_length_gain"]
    target, requirements = spec.target, spec.requirements
    assert pitch is not None and target is not None
    if requirements.normal_resolution is not None and requirements.shear_resolution is not None:
        return  # SIT401 and SIT402 judge this case
    if spec.elastomer is None or not rests_on_pad(spec):
        yield not_checked("beside-pad" if spec.elastomer else "target-length-pad")
        return
    gain = gain_at_length(design, pitch, requirements.shear_force or 0.0)
    if gain is None:
        yield not_checked("target-length-lost")
        return
    is_shear_felt = requirements.shear_force or requirements.shear_resolution
    worth = gain.normal * gain.shear if is_shear_felt else gain.normal
    if worth <= limit.value:
        return
    yield violation_of(
        "target-length", "target.size", worth, limit.value, hint=hint, source=limit.source, fixes=fixes,
        details=("target-length-shear",) if is_shear_felt else (), length=_length_along_coils(target), pitch=pitch,
        normal=gain.normal, shear=gain.shear,
    )


NO_PAD = "no elastomer pad: forces cannot be measured, so the target's length has no effect on them"


def _larger_target(
    target: Target, pitch: float | None, coil: tuple[float, float]
) -> tuple[str, tuple[float, float] | None]:
    """Return the hint's key in ``data/messages.csv``, and the proposed (length, width; m) of the target.

    `pitch` (m) is the distance between the centres of two coils in a line, None for other arrays. `coil` is the length
    and width (m) of a coil. The proposed length is `pitch`, or else at least the length of a coil. The size is None for
    a rotated target over two coils in a line.
    """
    if pitch and not target.outline.is_disc and abs(math.sin(target.rotation)) > 1e-9:
        return "target-line-turned", None
    length = pitch or max(target.size[0], coil[0])
    across = target.size[1] if target.outline.is_long or not pitch else 0.0  # a single size is no larger than required
    return "target-line" if pitch else "target-coil", (length, max(across, coil[1]))


def _line_pitch(array: ArraySpec) -> float | None:
    """Return the distance (m) between the centres of two coils in a line. None for any other array."""
    return array.pitch if array.pattern == "line" and len(array.placements) == 2 else None


def is_as_long_as_line(array: ArraySpec, target: Target | None) -> bool:
    """Whether a target over two coils in a line is about as long as the distance between their centres.

    The relative difference may be at most `TARGET_LENGTH_TOLERANCE`. True for other arrays.
    """
    pitch = _line_pitch(array)
    return not pitch or target is None or abs(_length_along_coils(target) / pitch - 1.0) <= TARGET_LENGTH_TOLERANCE


def _uncovered_coil_findings(
    array: ArraySpec, target: Target, here: Footprint, middle: Footprint, coil: tuple[float, float],
    fixes: tuple[Family, ...],
) -> Iterator[Verdict]:
    """Yield a finding on the coils that the target does not cover because of its offset.

    A single coil must be covered completely. With several coils, the offset must not uncover a centre that the target
    would cover without it. `here` is the target's footprint, and `middle` its footprint without the offset. `coil` is
    the length and width (m) of a coil along the target's axes.
    """
    if len(array.placements) == 1:
        place = here.local_coordinates(Point(*array.middle))
        over = max(abs(place[k]) + 0.5 * (coil[k] - max(target.size[k], coil[k])) for k in (0, 1))
        names = [array.placements[0].name] if over > ROUNDING else []
        case, over_coil = "target-aside", min(over, coil[0], coil[1])
    else:
        outlines, slack = (here.outline(), middle.outline()), 0.5 * TARGET_LENGTH_TOLERANCE * min(coil)
        beside = {p.name: [signed_distance(o, Point(*p.centre)) for o in outlines] for p in array.placements}
        lost = {name: now for name, (now, before) in beside.items() if now > max(before, 0.0) + slack}
        names, over = list(lost), max(lost.values(), default=0.0)
        case, over_coil = "target-aside-middles", over
    if names:
        yield violation_of(case, "target.offset", over, 0.0, "m", fixes=fixes,
                           offset=pair_text(target.offset), coils=names, over=over_coil)


def _length_along_coils(target: Target) -> float:
    """Return the length (m) of the target through its middle, along the line of the coils."""
    if target.outline.is_disc:
        return target.size[0]
    cosine, sine = abs(math.cos(target.rotation)), abs(math.sin(target.rotation))
    x, y = target.size
    return x / cosine if sine * x <= cosine * y else y / sine


def _largest_coil(placements: tuple[CoilPlacement, ...], size: tuple[float, float], turn: float) -> tuple[float, float]:
    """Return the largest extents (m) of the coils along the two axes of a target.

    `size` is the length and width (m) of a coil that is not rotated. `turn` (rad) is the target's rotation.
    """
    length, width = size
    turned = [placement.rotation - turn for placement in placements]
    if length == width:
        return length, width
    return (max(abs(length * math.cos(a)) + abs(width * math.sin(a)) for a in turned),
            max(abs(length * math.sin(a)) + abs(width * math.cos(a)) for a in turned))


def plates_apart(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the gap between the plates of neighbouring cells is too small.

    The wall of the assembly jig must fit into the gap. So must the sideways bulges of both compressed pads.
    """
    spec = design.spec
    if spec.cells is None:
        return
    process = spec.mount.process if spec.mount is not None else "resin"
    wall = print_limit(process, "wall").value + 2.0 * print_limit(process, "clearance").value
    bulge = 0.0
    if spec.requirements.normal_force and spec.elastomer is not None:
        x, y = spec.elastomer.size
        # Rubber keeps its volume, so the volume bulges at the sides: x y strain over their length 2 (x + y) in
        # the mean, and 1.5 times the mean in the middle of a side's parabola.
        bulge = 1.5 * pressed_pad(spec).strain * x * y / (2.0 * (x + y))
    # one piece with webs has one well in the jig
    beside = 2.0 * bulge if plates_of(spec).webs else max(wall, 2.0 * bulge)
    finest = max((parse_quantity(row["least"], "length") for row in rows("laser_cutting")
                  if row["material"] == "silicone" and row["least"]), default=0.0)
    if plates_of(spec).webs and spec.web is not None and spec.web < finest:
        yield violation_of(
            "webs-narrow", "cells.web", spec.web, finest, "m", severity=Severity.WARNING,
            source="data/laser_cutting.csv", web=f"{1e3 * finest:.6g}",
            fixes=(partial(reread_changes, spec, "cells.web", [1e3 * finest]),),
        )
    for bodies, least in ((plates_of(spec).elastomers, beside), (plates_of(spec).targets, wall)):
        pairs = combinations(bodies, 2)
        gap, *cells = min((_gap_between_plates(a.footprint, b.footprint), a.cell, b.cell) for a, b in pairs)
        name, key = bodies[0].role.value, spec.array.distance_key
        kerf = spec.elastomer.kerf if spec.elastomer is not None and name == "elastomer" else 0.0
        if gap <= 0.0:
            yield violation_of("plates-overlap" if gap < -1e-9 else "plates-touch", key, gap, 0.0, "m",
                               severity=Severity.ERROR, plate=name, cells=cells, overlap=-gap)
        elif gap <= kerf and plates_of(spec).webs:
            yield violation_of("plates-kerf", key, gap, kerf, "m", severity=Severity.ERROR, plate=name, cells=cells)
        elif gap < least:
            yield violation_of("plates-near", key, gap, least, "m", severity=Severity.WARNING, plate=name, cells=cells,
                               wall=wall, bulge=2.0 * bulge)


def _gap_between_plates(first: Footprint, second: Footprint) -> float:
    """Return the gap (m) between two equal plates of the same orientation. Negative if they overlap."""
    if first.is_round:
        return first.centre.distance(second.centre) - first.size[0]
    x, y = (abs(way) - size for way, size in zip(first.local_coordinates(second.centre), first.size, strict=True))
    return math.hypot(max(x, 0.0), max(y, 0.0)) or max(x, y)


PROPORTIONS = rule_of("SIT306", target_proportions, "target")

RULES = (PROPORTIONS, rule_of("SIT328", plates_apart))


FREQUENCY = 5e6
"""Frequency (Hz) at which the signals of targets are compared. Their ratios hardly depend on it."""

SHEAR_SHARE = 0.25
"""Ratio of shear force to normal force at which targets are compared, if the spec requires no shear force."""


@record
class LengthGain:
    """Ratio of the signal with another target to the signal with the spec's target.

    `normal` is the ratio for normal force, and `shear` the ratio for shear force.
    """

    normal: float
    shear: float


def gain_at_length(design: Design, length: float, shear: float) -> LengthGain | None:
    """Return the ratios of signals with a target of another `length` (m) along the line of coils.

    `shear` is the shear force (N), 0 for `SHEAR_SHARE` of the normal force. None if a pad buckles sideways, or if a
    signal is zero.

    Notes
    -----
    The pad becomes as large as it must be to carry the other target. A signal is the change of inductance
    under half of the normal force, or under the shear force. The pad's force law gives the travel, and the model of a
    finite plate gives the change. The coils' noise is the same under both targets, so the ratio of signals is also the
    ratio of resolutions. On two templates the ratios differed by 1 to 15 % from the ratios of `SensingAnalysis`,
    for targets of 0.7 to 1.9 times the distance.
    """
    target, pad = design.spec.target, design.spec.elastomer
    assert target is not None and pad is not None
    middle = (0.0, 0.0)  # an offset has its own finding
    target, pad = replace(target, offset=middle), replace(pad, offset=middle)
    spec = replace(design.spec, target=target, elastomer=pad)
    other = replace(target, shape=LONG_PLATE, size=(length, max(target.size[1], spec.coil.size[1])), rotation=0.0)
    wide = replace(pad, shape=LONG_PLATE, size=other.size)
    if pad.size != target.size:
        size = pad_sides_under_plate(footprint(spec, pad), footprint(spec, other))
        wide = replace(pad, shape=pad.shape if pad.outline.is_disc else LONG_PLATE, size=size)
    force = design.spec.requirements.normal_force or full_normal_force(design.spec)
    loads = 0.5 * force, shear or SHEAR_SHARE * force
    now, then = (_target_signals(replace(design.layout, spec=changed), *loads)
                 for changed in (spec, replace(spec, target=other, elastomer=wide)))
    if now is None or then is None or not all((*now, *then)):
        return None
    return LengthGain(then[0] / now[0], then[1] / now[1])


def _target_signals(layout: Layout, normal: float, shear: float) -> tuple[float, float] | None:
    """Return (normal signal, shear signal) in henries, as absolute values.

    The first is the change of the sum of all inductances by the force `normal` (N). The second is the change of the
    difference between the first two coils by the force `shear` (N) along x. None if the pad buckles sideways.
    """
    poses, notes = loaded_poses(layout.spec, np.array([(0.0, shear, 0.0), (normal, 0.0, 0.0)]))
    if any(notes) or not np.isfinite(poses).all():
        return None
    moves, heights = [(0.0, 0.0), (float(poses[0, 0]), 0.0)], [0.0, float(poses[1, 2])]
    changes = target_effects(layout, moves, heights, FREQUENCY)
    moved = changes[0, 1] - changes[0, 0]
    return float(abs((changes[1, 0] - changes[0, 0]).sum())), float(abs(moved[0] - moved[1]))
