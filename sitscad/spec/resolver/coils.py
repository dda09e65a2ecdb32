"""Conversion of the spec's sections ``coil`` and ``array``: omitted sizes, centres, and checks of gaps.

Regular patterns are symmetric about the origin. Their coils are numbered from the far end of the jaw (most negative x)
to the tail at +x. Coils of equal x are numbered from negative to positive y. Centres that the spec writes keep their
order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from sitscad.basics.finding import Edit
from sitscad.basics.late import late
from sitscad.basics.units import show
from sitscad.kernels.geometry.shapes import SHAPES
from sitscad.spec.coil import INNER, TURNS, ArrayDocument, ArraySpec, CoilPlacement, CoilSpec, LayerTurns, Trace
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks

Point = tuple[float, float]

MOST_OF_A_COIL, MOST_OF_ALL = 500.0, 2000.0
"""Maximum sum of the turns of all layers of one coil, and of all layers of all coils.

The memory of an estimate grows with the square of the first number (0.5 GB at 400 turns near metal). The time of an
estimate grows with both numbers.
"""

# loads NumPy, which other specs do not need
coil_from_file = late("sitscad.spec.drawn.spiral", "coil_from_file")


def resolve_coil(written: CoilSpec, remarks: Remarks, place: Origin, copper_layers: int | None) -> CoilSpec:
    """Return the coil with the values that follow from its inner diameter or its file filled in.

    Errors, also of its turns, are recorded in `remarks`. `place` is the spec, which names the file of a drawn coil.
    `copper_layers` is the number of copper layers of the spec's stack-up. None if the spec has no stack-up.
    """
    if written.drawn is not None:
        return coil_from_file(written, place, copper_layers, remarks)
    outline, by_inner = written.outline, written.written_inner is not None and written.values()["turns"] is None
    written = _with_omitted_value(written, remarks)
    turns = tuple(outline.nearest_turns(n) if outline.is_whole(n) else n for n in written.layer_turns)
    if len(turns) not in (1, len(written.layers)):
        message = f"{len(turns)} numbers of turns for {len(written.layers)} layers"
        facts = {"measured": float(len(turns)), "limit": float(len(written.layers))}
        remarks.flaw("SIT009", "coil.turns", message, "write one number for each layer, or one for all", **facts)
    coil = replace(written, turns=turns if len(set(turns)) > 1 else turns[0])
    check_coil(coil, remarks, turns, INNER if by_inner else TURNS)
    return coil


INSET_TOLERANCE = 1e-6
"""Largest difference (m) between the insets along x and along y of a long coil that count as equal.

The inset is the distance from the outer to the inner copper edge. Numbers in a spec are rounded.
"""


def _with_omitted_value(coil: CoilSpec, remarks: Remarks) -> CoilSpec:
    """Return the coil with its omitted value (turns, trace width or trace spacing) computed from its inner diameter.

    If the inner diameter is impossible, record an error in `remarks` and use the value in `PLACEHOLDERS`.
    """
    inner, values = coil.written_inner, coil.values()
    if inner is None:
        return coil
    width = values["trace_width"] or 0.0
    # a single length is across the shorter side
    insets = [(size - each) / 2.0 for size, each in zip(coil.size, inner, strict=True)]
    inset = insets[0] if inner[0] != inner[1] else (min(coil.size) - inner[0]) / 2.0
    figures: dict[str, Any] = {name: usual for name, usual in PLACEHOLDERS.items() if values[name] is None}
    if not coil.outline.is_long and inner[0] != inner[1]:
        remarks.flaw("SIT009", INNER, f"a {coil.shape} has one inner size, not [x, y]", "write one number")
    elif inner[0] != inner[1] and abs(insets[0] - insets[1]) > 2.0 * INSET_TOLERANCE:
        distances = " and ".join(f"{show(each, 'm', 4)} along {axis}" for each, axis in zip(insets, "xy", strict=True))
        message = f"the distance from the outer to the inner edge is {distances}; both must be equal"
        remarks.flaw("SIT009", INNER, message, "write only the shorter inner side")
    elif inset <= 0.0 or inset < width * (1 - 1e-9):
        message = f"{show(min(inner), 'm')} inside leaves no room for a turn in {show(min(coil.size), 'm')} outside"
        remarks.flaw("SIT009", INNER, message, "make coil.inner_diameter smaller, or coil.outer_diameter larger",
                     measured=min(inner), limit=min(coil.size) - 2.0 * width, unit="m")
    elif values["turns"] is None:
        figures["turns"] = (_turns_in(coil, inset, remarks),)
    else:
        for name in figures:
            figures[name] = _width_or_spacing_in(coil, name, inset, remarks)
    return replace(coil, written_inner=None, **figures)


PLACEHOLDERS = {"turns": (1.0,), "trace_width": 1e-6, "trace_spacing": 1e-6}
"""Turns, trace width (m) and spacing (m) that replace an omitted value if the inner diameter is impossible.

The rest of the spec can then still be checked.
"""


def _turns_in(coil: CoilSpec, inset: float, remarks: Remarks) -> float:
    """Return the number of turns that fill the distance `inset` (m) from the outer to the inner copper edge.

    The number is exact for a circle, and rounded to whole sides of the spiral for other shapes. It is recorded in
    `remarks` as a default. If rounding changes the inner diameter, the new diameter is recorded as well.
    """
    exact = coil.outline.outermost_turns + (inset - coil.trace_width) / coil.pitch
    turns = round(coil.outline.nearest_turns(exact), 9)
    if not LayerTurns.low <= turns <= LayerTurns.high:
        limit = LayerTurns.low if turns < LayerTurns.low else LayerTurns.high
        allowed = f"{LayerTurns.low:g} to {LayerTurns.high:g}"
        message = f"this inner diameter needs {turns:.3g} turns a layer, allowed {allowed}"
        remarks.flaw("SIT009", INNER, message, "write another inner diameter, width or spacing", measured=turns,
                     limit=limit)
        return limit
    inner_size = min(coil.size) - 2.0 * coil.outline.inset(coil.trace_width, coil.pitch, turns)
    why = "from coil.inner_diameter"
    if coil.outline.ends_per_turn and abs(exact - turns) > 1e-6 * turns:
        why = f"rounded to whole sides, so that the inner diameter becomes {show(inner_size, 'm', 6)}"
    remarks.default(TURNS, f"{turns:.7g}", why)
    return turns


def _width_or_spacing_in(coil: CoilSpec, name: str, inset: float, remarks: Remarks) -> float:
    """Return the trace width or spacing (m) at which the turns fill the distance `inset` (m).

    The inset is the distance from the outer to the inner copper edge. `name` is the omitted key, "trace_width" or
    "trace_spacing".
    """
    gaps = max(coil.layer_turns) - coil.outline.outermost_turns
    if name == "trace_spacing" and gaps <= 0.0:
        message = f"{max(coil.layer_turns):g} turns of a {coil.shape} have no gap, so {name} does not follow from them"
        remarks.flaw("SIT009", INNER, message, f"write {name} in place of inner_diameter")
        return coil.trace_width
    if name == "trace_spacing":
        other, length = "trace_width", (inset - coil.trace_width) / gaps - coil.trace_width
    else:
        other, length = "trace_spacing", (inset - gaps * coil.trace_spacing) / (1.0 + gaps)
    low, high = Trace.range
    if low <= length <= high:
        remarks.default(f"coil.{name}", show(length, "m", 6), "from coil.turns and coil.inner_diameter")
        return round(length, 12)
    need = f"turns, inner_diameter and {other} need a {name} of {show(length, 'm', 3)}"
    message = f"{need}, allowed {Trace.low} to {Trace.high}"
    remarks.flaw("SIT009", INNER, message, f"use fewer turns, or write {name} in place of inner_diameter",
                 measured=length, limit=low if length < low else high, unit="m")
    return min(max(length, low), high)


def check_coil(
    coil: CoilSpec, remarks: Remarks, written: tuple[float, ...] = (), turns_key: str = "coil.turns"
) -> None:
    """Record an error for each size, number of turns or corner radius that does not fit the coil's shape.

    `written` are the numbers of turns that the spec states. Errors of the turns name the key `turns_key`.
    """
    (x, y), outline, most = coil.size, coil.outline, coil.turns_that_fit
    if not outline.bounds:
        shapes = ", ".join(name for name, row in SHAPES.items() if row.bounds)
        message = f"a coil of shape {outline.name} cannot be estimated: the shape declares no error bounds"
        remarks.flaw("SIT009", "coil.shape", message, f"choose one of {shapes}")
    if not outline.is_long and x != y:
        hint = f"write one number, or choose {' or '.join(name for name, row in SHAPES.items() if row.is_long)}"
        remarks.flaw("SIT009", "coil.outer_diameter", f"a {coil.shape} has one size, not [x, y]", hint)
    if outline.is_long and not outline.sides and x <= y:
        message = f"a {coil.shape}'s x ({show(x, 'm')}) must be larger than its y ({show(y, 'm')})"
        hint = "its straight sides run along x: write [x, y] with x > y"
        remarks.flaw("SIT009", "coil.outer_diameter", message, hint)
    if most <= 0:
        message = f"a trace of {show(coil.trace_width, 'm')} leaves no inside in {show(min(coil.size), 'm')}"
        remarks.flaw("SIT016", "coil.outer_diameter", message, "make the coil larger or the trace finer")
    turns = written or (coil.layer_turns if coil.has_unequal_turns else coil.layer_turns[:1])
    for index, number in enumerate(turns):
        _check_turns(coil, number, most, turns_key if len(turns) == 1 else f"coil.turns.{index}", remarks)
    if coil.is_mid_side and outline.sides != 4:
        message, corner = f"a {coil.shape} does not begin in the middle of a side", (Edit("coil.start", "corner"),)
        remarks.flaw("SIT009", "coil.start", message, "use start: corner, or shape: square or rectangle", edits=corner)
    limit = min(coil.size) / 2
    if coil.corner_radius and not outline.sides:
        message, none = f"a {coil.shape} has no corners to round", (Edit("coil.corner_radius", "0"),)
        remarks.flaw("SIT009", "coil.corner_radius", message, "leave corner_radius out", edits=none)
    elif coil.corner_radius > limit:
        message = f"a corner radius of {show(coil.corner_radius, 'm')} is more than half the size ({show(limit, 'm')})"
        remarks.flaw("SIT009", "coil.corner_radius", message, "", measured=coil.corner_radius, limit=limit, unit="m")


def _check_turns(coil: CoilSpec, turns: float, most: float, key: str, remarks: Remarks) -> None:
    """Record an error if a layer has too many turns, or a fraction of a turn that its shape does not allow.

    `turns` is the number of turns of this layer, `most` the largest number that fits, and `key` the dotted key.
    """
    parts = coil.outline.ends_per_turn
    if parts and not coil.outline.is_whole(turns):
        nearest = coil.outline.nearest_turns(turns)
        nearest = most if nearest > most > 0 else nearest
        end = "mid-side" if coil.is_mid_side else "corner" if coil.outline.sides else "side"
        message = f"{turns:g} turns of a {coil.shape} do not end at a {end}, as multiples of 1/{parts} do"
        whole = (Edit(key, f"{nearest:.7g}"),) if nearest > 0 else ()
        facts = {"measured": turns, "limit": nearest}
        remarks.flaw("SIT015", key, message, f"write the nearest, {nearest:.7g}", **facts, edits=whole)
    if most > 0 and turns > most * (1 + 1e-9):
        fits = f"{int(most * 100) / 100:g}" if parts is None else f"{most:.7g}"
        message = f"{turns:g} turns do not fit in {show(min(coil.size), 'm')}: at most {fits}"
        hint = (
            "use fewer turns (vias inside need room, too), a finer trace and spacing, more layers, or a larger coil"
        )
        remarks.flaw("SIT016", key, message, hint, measured=turns, limit=float(fits))


def check_total_turns(coil: CoilSpec, coils: int, remarks: Remarks) -> None:
    """Record an error if one coil, or all `coils` coils together, have too many turns for an estimate."""
    coil_turns = math.fsum(coil.layer_turns)
    totals = ((coil_turns, MOST_OF_A_COIL, "a coil"), (coil_turns * coils, MOST_OF_ALL, f"all {coils} coils"))
    for turns, most, whose in totals:
        if turns > most:
            message = (
                f"{turns:g} turns in all layers of {whose} are too many for an estimate: at most {most:g}; "
                "memory and time grow with their square"
            )
            hint = "use fewer turns or layers" + (", or fewer coils" if coils > 1 else "")
            remarks.flaw("SIT019", "coil.turns", message, hint, measured=turns, limit=most)
            return


MOST_COILS = 64
_DEFAULT_GAP = 0.5e-3
MORE_ROOM = "leads and vias between the coils may need more"
_GRAIN = 1e-6  # step (m) to which lengths are rounded up
_NEARLY = 1 - 1e-6  # a gap of this fraction of the required gap passes
_COUNTS = {"line": (2,), "grid": (2, 2), "triangle": (3,), "single": (1,)}
_PATTERN_KEYS = {
    "single": (), "line": ("count", "pitch"), "triangle": ("pitch",), "grid": ("count", "pitch"),
    "explicit": ("centres", "rotations"),
}


def resolve_array(document: ArrayDocument, coil: CoilSpec, remarks: Remarks) -> ArraySpec:
    """Return the array with the centre and rotation of each coil.

    If the number of coils is invalid, record an error in `remarks` and return a single coil.
    """
    is_grid = document.count is not None and len(document.count) == 2
    is_line = document.count is not None or document.pitch is not None
    implied = "explicit" if document.centres is not None else "grid" if is_grid else "line" if is_line else "single"
    pattern = document.pattern or implied
    if document.pattern is None:
        remarks.default("array.pattern", pattern, "the default" if pattern == "single" else "after the keys given")
    # Add a flaw for each key that the pattern does not use, and for missing centres.
    allowed_keys = _PATTERN_KEYS[pattern]
    for name in ("count", "pitch", "centres", "rotations"):
        value = getattr(document, name)
        if value is None or name in allowed_keys or (name == "count" and value == _COUNTS.get(pattern)):
            continue
        hint = f"use only {', '.join(allowed_keys)}" if allowed_keys else f"leave {name} out"
        remarks.flaw("SIT009", f"array.{name}", f"pattern {pattern} has no {name}", hint)
    if "centres" in allowed_keys and document.centres is None:
        message = "centres are missing: pattern explicit needs them"
        remarks.flaw("SIT003", "array.centres", message, "add centres: [[-2, 0], [2, 0]] to array")
    if document.count is not None and "count" in allowed_keys and len(document.count) != len(_COUNTS[pattern]):
        form = "[nx, ny]" if pattern == "grid" else "one number"
        remarks.flaw("SIT009", "array.count", f"pattern {pattern} takes {form} as count", "write 2 or [2, 2]")
    pitch = _pitch(document, pattern, coil, remarks)
    centres = _centres(document, pattern, pitch or 0.0, remarks)
    if not 1 <= len(centres) <= MOST_COILS:
        key = "array.centres" if pattern == "explicit" else "array.count"
        message, limit = f"{len(centres)} coils are out of range: 1 to {MOST_COILS}", MOST_COILS if centres else 1
        remarks.flaw("SIT006", key, message, measured=float(len(centres)), limit=float(limit))
        return ArraySpec(pattern, coil_placements(((0.0, 0.0),)), pitch)
    placements = coil_placements(centres, _rotations(document, pattern, len(centres), remarks))
    array = ArraySpec(pattern, placements, pitch, document.reference)
    check_gaps(array, coil, remarks)
    return array


def _pitch(document: ArrayDocument, pattern: str, coil: CoilSpec, remarks: Remarks) -> float | None:
    """Return the distance (m) of neighbouring coils: the pitch in the spec, or else the smallest possible pitch.

    None if the pattern has no pitch. The smallest pitch leaves the default gap, or the trace spacing if this is larger.
    """
    if document.pitch is not None or "pitch" not in _PATTERN_KEYS[pattern]:
        return document.pitch
    size = coil.size[0] if pattern == "line" else max(coil.size)
    gap = max(_DEFAULT_GAP, coil.trace_spacing)
    pitch = size + gap
    # the smallest array of a pattern has all the pairs of neighbours of a larger array
    centres = {"line": line_centres(2, pitch), "grid": grid_centres(2, 2, pitch)}.get(pattern, triangle_centres(pitch))
    scale = least_scale(ArraySpec(pattern, coil_placements(centres), pitch), replace(coil, trace_spacing=gap)) or 1.0
    if scale > 1.0 + 1e-9:  # for corners that face each other, or flat sides at an angle
        pitch = round(math.ceil(pitch * scale / _GRAIN) * _GRAIN, 9)
    remarks.default("array.pitch", show(pitch, "m"), "the coil's size and a gap, the default")
    return pitch


def _centres(document: ArrayDocument, pattern: str, pitch: float, remarks: Remarks) -> tuple[tuple[float, float], ...]:
    if pattern == "explicit":
        return ((0.0, 0.0),) if document.centres is None else tuple(document.centres)
    if pattern == "single":
        return ((0.0, 0.0),)
    if pattern == "triangle":
        return triangle_centres(pitch)
    count = document.count if document.count and len(document.count) == len(_COUNTS[pattern]) else _COUNTS[pattern]
    if document.count is None:
        remarks.default("array.count", str(list(count) if len(count) > 1 else count[0]))
    return line_centres(count[0], pitch) if len(count) == 1 else grid_centres(count[0], count[1], pitch)


def _rotations(document: ArrayDocument, pattern: str, coils: int, remarks: Remarks) -> tuple[float, ...]:
    """Return the rotation of each coil (rad). They are 0 in all patterns except ``explicit``."""
    if document.rotations is None or pattern != "explicit":
        return (0.0,) * coils
    if len(document.rotations) == coils:
        return tuple(document.rotations)
    message = f"{len(document.rotations)} rotations for {coils} centres"
    remarks.flaw("SIT009", "array.rotations", message, "one for every coil, in the order of the centres")
    return (0.0,) * coils


def check_gaps(array: ArraySpec, coil: CoilSpec, remarks: Remarks) -> None:
    """Record an error if the gap between two coils is smaller than the trace spacing."""
    smallest, first, second = _smallest_gap(array.placements, coil)
    if smallest >= coil.trace_spacing * _NEARLY:
        return
    what = f"overlap by {show(-smallest, 'm')}" if smallest < 0 else f"stand {show(smallest, 'm')} apart"
    key = "array.centres" if array.pattern == "explicit" else "array.pitch"
    message = f"{first} and {second} {what}: at least the trace spacing, {show(coil.trace_spacing, 'm')}, is wanted"
    scale = least_scale(array, coil)
    if scale is None:
        hint = "move them apart"
    elif array.pitch is None:
        hint = f"centres {math.ceil(scale * 1e4) / 1e4:.4f} times as far from each other leave that gap; {MORE_ROOM}"
    else:
        more = math.ceil(array.pitch * (scale - 1.0) / _GRAIN - 1e-5) * _GRAIN
        hint = f"a pitch larger by {more * 1e3:.3f} mm leaves that gap; {MORE_ROOM}"
    remarks.flaw("SIT014", key, message, hint, measured=smallest, limit=coil.trace_spacing, unit="m")


def resolve_reference(array: ArraySpec, coil: CoilSpec, place: Origin, copper: int, remarks: Remarks) -> ArraySpec:
    """Return the array with the reference coil's windings filled in, if these differ from the other coils' windings.

    `coil` is the array's coil, `place` the spec, and `copper` the number of copper layers of the stack-up. Errors are
    recorded in `remarks`.
    """
    reference = array.reference
    if reference is None or reference.coil is None:
        return array
    if coil.drawn is not None:
        message = "a drawn coil has a board of its own, so a reference coil can only repeat it"
        remarks.flaw("SIT009", REFERENCE_COIL, message, f"leave {REFERENCE_COIL} out")
        return replace(array, reference=replace(reference, coil=None))
    own = Remarks()
    windings = resolve_coil(reference.coil, own, place, copper)
    check_total_turns(windings, 1, own)
    check_layers(windings, copper, own)
    remarks.flaws += [replace(flaw, key=reference_coil_key(flaw.key),
                              edits=tuple(replace(edit, key=reference_coil_key(edit.key)) for edit in flaw.edits))
                      for flaw in own.flaws]
    remarks.defaults += [reference_coil_key(line) for line in own.defaults]
    return replace(array, reference=replace(reference, coil=windings))


REFERENCE_COIL = "array.reference.coil"
"""Key of the reference coil's own windings."""


def reference_coil_key(key: str) -> str:
    """Return the key of the section ``array.reference.coil`` that corresponds to a key of the section ``coil``."""
    return f"array.reference.{key}"


def check_layers(coil: CoilSpec, copper: int, remarks: Remarks) -> None:
    """Record an error if a coil uses a copper layer that a stack-up of `copper` layers lacks."""
    if max(coil.layers) > copper:
        remarks.flaw("SIT009", "coil.layers", f"the coil uses copper layer {max(coil.layers)}, the stack-up has "
                     f"{copper}", "use fewer layers", measured=float(max(coil.layers)), limit=float(copper))


def check_reference(placements: tuple[CoilPlacement, ...], coil: CoilSpec, remarks: Remarks) -> None:
    """Record an error if the gap between the reference coil and another coil is below the trace spacing.

    The reference coil is the last of the placements.
    """
    reference = placements[-1]
    spacing = max(coil.trace_spacing, (reference.own or coil).trace_spacing)
    smallest, name = min((coil_gap(coil.shape, coil.size, each, reference), each.name) for each in placements[:-1])
    if smallest < spacing * _NEARLY:
        missing = spacing - smallest
        message = f"the reference coil stands {show(smallest, 'm')} from {name}"
        message += f": at least the trace spacing, {show(spacing, 'm')}, is wanted"
        remarks.flaw("SIT014", REFERENCE_OFFSET, message, f"move it {show(missing, 'm')} farther; {MORE_ROOM}",
                     measured=smallest, limit=spacing, unit="m")


REFERENCE_OFFSET = "array.reference.offset"
"""Key of the reference coil's position."""


def _smallest_gap(placements: tuple[CoilPlacement, ...], coil: CoilSpec) -> tuple[float, str, str]:
    """Return the smallest gap (m) between two coils, and their names.

    The gap is infinite if no two centres are closer than the coil's diagonal plus the trace spacing.
    """
    # skip pairs whose outlines cannot come near each other
    reach = math.hypot(*coil.size) + coil.trace_spacing
    pairs = [(a, b) for a, b in combinations(placements, 2) if math.dist(a.centre, b.centre) < reach]
    gaps = ((coil_gap(coil.shape, coil.size, a, b), a.name, b.name) for a, b in pairs)
    return min(gaps, default=(math.inf, "", ""))


def least_scale(array: ArraySpec, coil: CoilSpec) -> float | None:
    """Return the smallest factor for all centres at which no gap between coils is below the trace spacing.

    The result is at most 1e-6 too large. None if two centres coincide.
    """
    near = min(math.dist(a.centre, b.centre) for a, b in combinations(array.placements, 2))
    if near <= 0.0:
        return None

    def fits(scale: float) -> bool:
        return _smallest_gap(scale_array(array, scale).placements, coil)[0] >= coil.trace_spacing * _NEARLY

    low, high = ((size + coil.trace_spacing) / near for size in (min(coil.size), math.hypot(*coil.size)))
    if fits(low):
        return low
    while high - low > 1e-6 * low:
        middle = (low + high) / 2
        low, high = (low, middle) if fits(middle) else (middle, high)
    return high


def check_cells(coils: int, placements: tuple[CoilPlacement, ...], has_plates: bool, remarks: Remarks) -> None:
    """Record an error unless the coils form two or more equal cells. A cell has `coils` coils.

    Cells are equal if the positions and rotations of their coils, relative to the cell's middle, are equal. Cells need
    plates: `has_plates` is False if the spec lacks a target or an elastomer.
    """
    count, key = len(placements), "cells.coils"
    if not has_plates:
        hint = "write target and elastomer of one cell, or leave cells out"
        remarks.flaw("SIT009", "cells", "cells need a target on an elastomer", hint)
    if count % coils or count <= coils:
        message = f"{count} coils do not form two or more cells of {coils}"
        remarks.flaw("SIT009", key, message, "write a divisor of the number of coils, or leave cells out")
        return
    first, *later = (relative_positions(placements[k : k + coils]) for k in range(0, count, coils))
    odd = next((k for k, other in enumerate(later, 2) if other != first), None)
    if odd is not None:
        message = f"the coils of cell {odd} are arranged differently from cell 1"
        hint = "place equal groups of coils one after the other, with array.centres"
        remarks.flaw("SIT009", key, message, hint)


EVEN = 0.2  # Largest difference between a joined pad's rims along x and y beside the target, in pad thicknesses


def check_webs(
    web: float | None, pattern: str, target: Target | None, pad: ElastomerPad | None, has_film: bool,
    remarks: Remarks,
) -> None:
    """Record an error if strips of width `web` (m) cannot join the pads of the cells.

    Pads must be rectangular and lie in rows and columns. Each target must be centred on its pad, and no film may lie on
    top. The stiffness of joined pads is known only under these conditions.
    """
    if web is None or pad is None or target is None:
        return
    if pattern not in ("line", "grid"):
        remarks.flaw("SIT009", "cells.web", "webs join pads in rows and columns only",
                     "write array.pattern: line or grid")
    if pad.outline.is_disc or web >= min(pad.size):
        remarks.flaw("SIT009", "cells.web", "webs must be narrower than the pads, and pads square or rectangular",
                     "write elastomer.shape: square, or leave cells.web out")
    rims = [0.5 * (outer - inner) for outer, inner in zip(pad.size, target.size, strict=True)]
    is_even = abs(rims[0] - rims[1]) <= EVEN * pad.thickness and min(rims) > -1e-9
    if target.outline.is_disc or target.rotation or target.offset != pad.offset or not is_even:
        remarks.flaw("SIT009", "cells.web", "the stiffness of joined pads is known only for targets of the pad's "
                     "shape and position, with equal rims along x and y",
                     "write a target with shape and position of the pad, or leave cells.web out")
    if has_film:
        remarks.flaw("SIT009", "cells.web", "a film over webs is not supported", "leave encapsulation or cells.web out")


def relative_positions(placements: Sequence[CoilPlacement]) -> list[tuple[int, ...]]:
    """Return (x, y, rotation) of each coil in whole numbers, so that arrangements in cells can be compared exactly.

    x and y (nm) are relative to the mean of the centres. The rotation is in microradians.
    """
    x, y = (math.fsum(p.centre[axis] for p in placements) / len(placements) for axis in (0, 1))
    return [(round((p.centre[0] - x) * 1e9), round((p.centre[1] - y) * 1e9), round(p.rotation * 1e6))
            for p in placements]


def line_centres(count: int, pitch: float) -> tuple[Point, ...]:
    """Return the centres (m) of `count` coils in a row along x about the origin, `pitch` (m) apart."""
    return tuple(((i - (count - 1) / 2) * pitch, 0.0) for i in range(count))


def triangle_centres(pitch: float) -> tuple[Point, ...]:
    """Return the centres (m) of three coils, each at a distance `pitch` (m) from the others.

    The first is on the x axis, on the negative side. The centroid is the origin.
    """
    return (
        (-pitch / math.sqrt(3), 0.0), (pitch / (2 * math.sqrt(3)), -pitch / 2), (pitch / (2 * math.sqrt(3)), pitch / 2)
    )


def grid_centres(columns: int, rows: int, pitch: float) -> tuple[Point, ...]:
    """Return the centres (m) of a grid with `columns` along x and `rows` along y."""
    return tuple((x, y) for x, _ in line_centres(columns, pitch) for y, _ in line_centres(rows, pitch))


def scale_array(array: ArraySpec, factor: float) -> ArraySpec:
    """Return the array with all centres and the pitch multiplied by a factor."""
    placements = (replace(p, centre=(p.centre[0] * factor, p.centre[1] * factor)) for p in array.placements)
    return replace(array, placements=tuple(placements), pitch=None if array.pitch is None else array.pitch * factor)


def coil_placements(
    centres: tuple[Point, ...], rotations: tuple[float, ...] | None = None
) -> tuple[CoilPlacement, ...]:
    """Return placements named C1, C2, ... at the centres (m), in their order. Rotations (rad) are 0 if None."""
    turned = zip(centres, rotations or (0.0,) * len(centres), strict=True)
    return tuple(CoilPlacement(f"C{number}", *place) for number, place in enumerate(turned, 1))


def coil_gap(shape: str, size: tuple[float, float], first: CoilPlacement, second: CoilPlacement) -> float:
    """Return the smallest gap (m) between the outer copper edges of two coils. Negative if they overlap.

    Coils have this shape and size (m) unless their placements have own coils.

    It is exact for circles and racetracks that do not overlap. For polygons it is a lower bound: the largest distance
    between two parallel lines along a side of either coil.
    """
    # Every outline is a convex core of points, widened by a radius. The distance of two convex cores is their largest
    # separation over all directions. The best direction is perpendicular to a side of a core, or along the line between
    # two corners.
    kinds = [SHAPES[place.own.shape].core(place.own.size) if place.own else SHAPES[shape].core(size)
             for place in (first, second)]
    cores = [_core_points(core, place) for (core, _), place in zip(kinds, (first, second), strict=True)]
    sides = [side for each in cores if len(each) > 1 for side in zip(each, each[1:] + each[:1], strict=True)]
    directions = [math.pi / 2 + math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in sides]
    directions += [math.atan2(b[1] - a[1], b[0] - a[0]) for a in cores[0] for b in cores[1]]
    angles = [angle + turn for angle in directions for turn in (0.0, math.pi)]
    return max(_gap_along(cores[0], cores[1], angle) for angle in angles) - sum(radius for _, radius in kinds)


def _core_points(points: Sequence[Point], place: CoilPlacement) -> list[Point]:
    cosine, sine = math.cos(place.rotation), math.sin(place.rotation)
    return [(place.centre[0] + u * cosine - v * sine, place.centre[1] + u * sine + v * cosine) for u, v in points]


def _gap_along(first: list[Point], second: list[Point], angle: float) -> float:
    cosine, sine = math.cos(angle), math.sin(angle)
    farthest = max(x * cosine + y * sine for x, y in first)
    return min(x * cosine + y * sine for x, y in second) - farthest
