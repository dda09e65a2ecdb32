"""A round spiral of wide pitch: its turns lie nearer, square to the track, than the pitch along the radius says.

On r = r0 - p theta / (2 pi) the next turn is one pitch away along the radius, but the track crosses the radius askew,
by the angle whose tangent is p / (2 pi r): square to it about p cos(that angle) is left.
"""

from __future__ import annotations

import math

from sitscad.remedy.moves import wider
from sitscad.remedy.search import Left, first_that_mends, tried
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

GRAIN = 1e-6
"""A spacing is named in steps of this (m)."""

WHY = "on a spiral of so wide a pitch turns lie nearer than they are spaced along the radius"


def nearer_by(spec: SensorSpec) -> float:
    """By how much (m) neighbouring turns of a circle come nearer than its spacing, at most: at the inner end."""
    coil = spec.coil
    if not coil.outline.is_round:
        return 0.0
    inner = (coil.size[0] - coil.trace_width) / 2 - coil.pitch * max(coil.layer_turns)
    slope = coil.pitch / (2.0 * math.pi * max(inner, coil.pitch / 2))
    return coil.pitch * (1.0 - math.cos(math.atan(slope)))


def spacing_for(spec: SensorSpec, missing: float) -> float:
    """The spacing (m) in the spec with which turns that lack so much (m) keep their distance, on whole micrometres."""
    return GRAIN * math.ceil((spec.coil.trace_spacing + missing) / GRAIN - 1e-6)


def spacing_in_words(spec: SensorSpec, missing: float) -> str:
    """What to write, as long as it was not tried."""
    return f"coil.trace_spacing: {show(spacing_for(spec, missing), 'm', 6)}: {WHY}"


def tried_spacing(spec: SensorSpec, missing: float, left: Left) -> str:
    """The same, tried; with fewer turns where the wider pitch takes the room of those."""
    changes = list(wider(spec, 0.0, spacing_for(spec, missing)))
    found = first_that_mends(changes, left)
    if found is not None:
        return f"{found.words} gives them their distance (it was tried): {WHY}"
    return "".join([spacing_in_words(spec, missing), *(tried(change, left) for change in changes[-1:])])
