"""The array as written to `ArraySpec`: a pattern's own keys, the coils' places and the gaps between them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

from sitscad.spec.format.documents.spec import ArrayDocument
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.resolver import positions
from sitscad.spec.sensor import ArraySpec, CoilSpec
from sitscad.units import show

MOST_COILS = 64
_DEFAULT_GAP = 0.5e-3
MORE_ROOM = "leads and vias between the coils may need more"
_GRAIN = 1e-6  # missing lengths are named in micrometres
_COUNTS = {"line": (2,), "grid": (2, 2), "triangle": (3,), "single": (1,)}
_PATTERN_KEYS = {
    "single": (),
    "line": ("count", "pitch"),
    "triangle": ("pitch",),
    "grid": ("count", "pitch"),
    "explicit": ("centres", "rotations"),
}


def resolve_array(document: ArrayDocument, coil: CoilSpec, remarks: Remarks) -> ArraySpec:
    """The coils' places; unfit ones fall back on a single coil, with a flaw."""
    pattern = document.pattern or _implied_pattern(document)
    if document.pattern is None:
        remarks.default("array.pattern", pattern, "the default" if pattern == "single" else "after the keys given")
    _check_keys(document, pattern, remarks)
    pitch = _pitch(document, pattern, coil, remarks)
    centres = _centres(document, pattern, pitch or 0.0, remarks)
    if not 1 <= len(centres) <= MOST_COILS:
        key = "array.centres" if pattern == "explicit" else "array.count"
        message, limit = f"{len(centres)} coils are out of range: 1 to {MOST_COILS}", MOST_COILS if centres else 1
        remarks.flaw("SIT006", key, message, measured=float(len(centres)), limit=float(limit))
        return ArraySpec(pattern, positions.named(((0.0, 0.0),)), pitch)
    array = ArraySpec(pattern, positions.named(centres, _rotations(document, pattern, len(centres), remarks)), pitch)
    check_gaps(array, coil, remarks)
    return array


def _implied_pattern(document: ArrayDocument) -> str:
    if document.centres is not None:
        return "explicit"
    if document.count is not None and len(document.count) == 2:
        return "grid"
    return "line" if document.count is not None or document.pitch is not None else "single"


def _check_keys(document: ArrayDocument, pattern: str, remarks: Remarks) -> None:
    """Note keys that mean nothing with a pattern, or are missing."""
    wanted = _PATTERN_KEYS[pattern]
    for name in ("count", "pitch", "centres", "rotations"):
        value = getattr(document, name)
        if value is None or name in wanted or (name == "count" and value == _COUNTS.get(pattern)):
            continue
        hint = f"it takes {', '.join(wanted) or 'no other key'}"
        remarks.flaw("SIT009", f"array.{name}", f"{name} means nothing with pattern {pattern}", hint)
    if "centres" in wanted and document.centres is None:
        message = "centres are missing: pattern explicit needs them"
        remarks.flaw("SIT003", "array.centres", message, "add centres: [[-2, 0], [2, 0]] to array")
    if document.count is not None and "count" in wanted and len(document.count) != len(_COUNTS[pattern]):
        form = "[nx, ny]" if pattern == "grid" else "one number"
        remarks.flaw("SIT009", "array.count", f"pattern {pattern} takes {form} as count", "line: 2; grid: [2, 2]")


def _pitch(document: ArrayDocument, pattern: str, coil: CoilSpec, remarks: Remarks) -> float | None:
    """The pitch (m) that is written, else the least one at which alike coils stand apart; None where there is none."""
    if document.pitch is not None or "pitch" not in _PATTERN_KEYS[pattern]:
        return document.pitch
    size = coil.size[0] if pattern == "line" else max(coil.size)
    gap = max(_DEFAULT_GAP, coil.trace_spacing)
    pitch = size + gap
    scale = least_scale(_smallest(pattern, pitch), replace(coil, trace_spacing=gap)) or 1.0
    if scale > 1.0 + 1e-9:  # corners that face each other, or flat sides at an angle
        pitch = round(math.ceil(pitch * scale / _GRAIN) * _GRAIN, 9)
    remarks.default("array.pitch", show(pitch, "m"), "the coil's size and a gap, the default")
    return pitch


def _smallest(pattern: str, pitch: float) -> ArraySpec:
    """The smallest array of a pattern, in which every coil has the neighbours that it has in a larger one."""
    centres = {"line": positions.line(2, pitch), "grid": positions.grid(2, 2, pitch)}
    return ArraySpec(pattern, positions.named(centres.get(pattern, positions.triangle(pitch))), pitch)


def _centres(document: ArrayDocument, pattern: str, pitch: float, remarks: Remarks) -> tuple[tuple[float, float], ...]:
    """The coils' centres (m) by their pattern."""
    if pattern == "explicit":
        return ((0.0, 0.0),) if document.centres is None else tuple(document.centres)
    if pattern == "single":
        return ((0.0, 0.0),)
    if pattern == "triangle":
        return positions.triangle(pitch)
    count = document.count if document.count and len(document.count) == len(_COUNTS[pattern]) else _COUNTS[pattern]
    if document.count is None:
        remarks.default("array.count", str(list(count) if len(count) > 1 else count[0]))
    return positions.line(count[0], pitch) if len(count) == 1 else positions.grid(count[0], count[1], pitch)


def _rotations(document: ArrayDocument, pattern: str, coils: int, remarks: Remarks) -> tuple[float, ...]:
    """The coils' rotations (rad); 0 for all patterns but the explicit one."""
    if document.rotations is None or pattern != "explicit":
        return (0.0,) * coils
    if len(document.rotations) == coils:
        return tuple(document.rotations)
    message = f"{len(document.rotations)} rotations for {coils} centres"
    remarks.flaw("SIT009", "array.rotations", message, "one for every coil, in the order of the centres")
    return (0.0,) * coils


def check_gaps(array: ArraySpec, coil: CoilSpec, remarks: Remarks) -> None:
    """Whether the coils of an array keep the trace spacing from each other."""
    smallest, first, second = _smallest_gap(array, coil)
    if _is_wide(smallest, coil.trace_spacing):
        return
    what = f"overlap by {show(-smallest, 'm')}" if smallest < 0 else f"stand {show(smallest, 'm')} apart"
    key = "array.centres" if array.pattern == "explicit" else "array.pitch"
    message = f"{first} and {second} {what}: at least the trace spacing, {show(coil.trace_spacing, 'm')}, is wanted"
    remarks.flaw("SIT014", key, message, _wider(array, coil), measured=smallest, limit=coil.trace_spacing, unit="m")


def _smallest_gap(array: ArraySpec, coil: CoilSpec) -> tuple[float, str, str]:
    """The smallest gap (m) between two coils, and which they are; infinite where none are near each other."""
    # pairs farther apart than any outline reaches need no closer look
    far = math.hypot(*coil.size) + coil.trace_spacing
    pairs = [(a, b) for a, b in combinations(array.placements, 2) if math.dist(a.centre, b.centre) < far]
    found = ((positions.gap(coil.shape, coil.size, a, b), a.name, b.name) for a, b in pairs)
    return min(found, default=(math.inf, "", ""))


def _is_wide(gap: float, wanted: float) -> bool:
    return gap >= wanted * (1 - 1e-6)


def _wider(array: ArraySpec, coil: CoilSpec) -> str:
    """What mends gaps that are too small: a larger pitch, or all centres farther apart; gaps were measured with it."""
    scale = least_scale(array, coil)
    if scale is None:
        return "move them apart"
    if array.pitch is None:
        return f"centres {math.ceil(scale * 1e4) / 1e4:.4f} times as far from each other leave that gap; {MORE_ROOM}"
    more = math.ceil(array.pitch * (scale - 1.0) / _GRAIN - 1e-5) * _GRAIN
    return f"a pitch larger by {more * 1e3:.3f} mm leaves that gap; {MORE_ROOM}"


def least_scale(array: ArraySpec, coil: CoilSpec) -> float | None:
    """How many times as far apart the centres must be, within a millionth above; None where two are in one place."""
    near = min(math.dist(a.centre, b.centre) for a, b in combinations(array.placements, 2))
    if near <= 0.0:
        return None

    def fits(scale: float) -> bool:
        return _is_wide(_smallest_gap(positions.scaled(array, scale), coil)[0], coil.trace_spacing)

    low, high = ((size + coil.trace_spacing) / near for size in (min(coil.size), math.hypot(*coil.size)))
    if fits(low):
        return low
    while high - low > 1e-6 * low:
        middle = (low + high) / 2
        low, high = (low, middle) if fits(middle) else (middle, high)
    return high
