"""Changes of a reference coil that may remove a finding: another place, another size, or other windings of its own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import Any

from sitscad.basics.finding import Edit
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import fewer_turns, more_turns, reread_changes
from sitscad.checks.fixes.search import Fix
from sitscad.spec.coil import TURNS, CoilSpec
from sitscad.spec.load import rewritten_spec
from sitscad.spec.reading import SpecError
from sitscad.spec.resolver.coils import REFERENCE_COIL, reference_coil_key
from sitscad.spec.sensor import SensorSpec


def more_own_turns(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to more turns of a reference coil with its own windings."""
    yield from reread_changes(spec, reference_coil_key(TURNS), more_turns(spec.reference_coil, OWN_GROWTH))


def fewer_own_turns(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to fewer turns of a reference coil with its own windings, the most turns first."""
    own = spec.reference_coil
    yield from reread_changes(spec, reference_coil_key(TURNS), list(fewer_turns(own, own.most_turns, MOST_SMALLER))[1:])


def farther_references(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes that move the reference coil farther from the other coils, by the smallest distance first."""
    placement, (x, y) = spec.reference_placement, spec.array.middle
    assert placement is not None
    dx, dy = placement.centre[0] - x, placement.centre[1] - y
    for step in REFERENCE_STEPS:
        farther = round(dx + (step if dx >= 0.0 else -step) * spec.reference_coil.size[0], 5)
        yield from _reread_with_data(spec, "array.reference.offset", [round(1e3 * farther, 6), round(1e3 * dy, 6)])


def smaller_references(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to a smaller reference coil with the same inner diameter and fewer turns, the largest first."""
    coil = spec.reference_coil
    for share in REFERENCE_SHARES:
        less = round((1.0 - share) * min(coil.size), 5)
        narrower = replace(coil, size=(coil.size[0] - less, coil.size[1] - less))
        room = coil.most_turns - 0.5 * less / coil.pitch
        turns = next(islice(fewer_turns(narrower, room), 1, None), 0.0)
        if turns:
            yield from _reread_with_data(spec, REFERENCE_COIL, _winding_data(replace(narrower, turns=turns)))


REFERENCE_STEPS = (0.25, 0.5, 1.0)
"""Distances by which trials move the reference coil, as multiples of its length."""

REFERENCE_SHARES = (0.85, 0.7)
"""Shorter side of the reference coil in trials, divided by its present shorter side."""

MOST_SMALLER = 3
"""Largest number of smaller numbers of turns that `fewer_own_turns` proposes for a reference coil."""


def _winding_data(coil: CoilSpec) -> dict[str, Any]:
    """Return the keys of a reference coil with its own windings, with values as YAML reads them (sizes in mm)."""
    size = [round(1e3 * side, 6) for side in coil.size]
    data: dict[str, Any] = {
        "shape": coil.shape, "outer_diameter": size if size[0] != size[1] else size[0],
        "turns": coil.most_turns, "layers": list(coil.layers), "trace_width": show(coil.trace_width, "m", 6),
        "trace_spacing": show(coil.trace_spacing, "m", 6), "start_angle": f"{math.degrees(coil.start_angle):.6g} deg",
    }
    if coil.is_mid_side:
        data["start"] = "mid-side"
    if coil.clockwise:
        data["sense"] = "clockwise"
    if coil.corner_radius:
        data["corner_radius"] = round(1e3 * coil.corner_radius, 6)
    return data


def _reread_with_data(spec: SensorSpec, key: str, data: Any) -> Iterator[Fix]:
    """Yield the change of a key to `data`, a list or mapping as YAML reads it. Empty if the changed spec is invalid."""
    with suppress(SpecError):
        yield Fix((Edit(key, _as_flow_yaml(data)),), rewritten_spec(spec, ((key, data),)))


def _as_flow_yaml(data: Any) -> str:
    """Return a value as YAML on one line."""
    if isinstance(data, dict):
        return f"{{{', '.join(f'{key}: {_as_flow_yaml(value)}' for key, value in data.items())}}}"
    if isinstance(data, list):
        return f"[{', '.join(map(_as_flow_yaml, data))}]"
    return f"{data:.7g}" if isinstance(data, float) else str(data)


OWN_GROWTH = 1.2
"""Factor by which `more_own_turns` multiplies the turns of a reference coil's own windings, at least."""
