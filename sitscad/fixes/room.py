"""Changes that give vias, leads and coils room on a board."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.finding import Edit
from sitscad.fixes import moves
from sitscad.fixes.search import AMOUNTS, GROWTH, Family, Fix
from sitscad.spec.resolver.coils import least_scale
from sitscad.spec.sensor import SensorSpec

MOST_COILS = 4
"""Coils up to which a spec that could not be read is mended by trials."""

FEWER = 4
"""Numbers of turns that are tried."""


def roomy(spec: SensorSpec, is_turns: bool, is_apart: bool) -> tuple[Family, ...]:
    """Return changes of a spec whose coils or turns lack room: fewer turns, coils farther apart, or both. Empty for
    large arrays and for layers of unequal turns.
    """
    if len(spec.array.placements) > MOST_COILS or spec.coil.has_unequal_turns:
        return ()

    def fewer() -> Iterator[Fix]:
        yield from moves.roomy_turns(spec, spec.coil.turns_that_fit, FEWER)

    def both() -> Iterator[Fix]:
        for fix in fewer() if is_turns else [Fix((), spec)]:
            yield from map(fix.with_also, _apart(fix.spec))

    return (both,) if is_apart else (fewer, both) if len(spec.array.placements) > 1 else (fewer,)


def _apart(spec: SensorSpec) -> Iterator[Fix]:
    """Yield coils so far apart that they do not touch, then farther by what a lead and its via take."""
    near = moves.nearest_distance(spec.array.placements)
    scale = None if near is None else least_scale(spec.array, spec.coil)
    if near is None or scale is None:
        return
    by = max(0.0, near * (scale - 1.0))
    beside = _written_apart(spec, near, by)
    yield beside
    room = moves.lead_room(beside.spec)
    for step in range(AMOUNTS):
        yield _written_apart(spec, near, by + room * GROWTH**step)


def _written_apart(spec: SensorSpec, near: float, by: float) -> Fix:
    """Coils farther apart by so much (m), rounded up as it is written."""
    if spec.array.pitch is None:
        scale = math.ceil((1.0 + by / near) * 1e4 - 1e-6) / 1e4
        return moves.coils_apart(spec, near * (scale - 1.0))
    pitch = math.ceil((spec.array.pitch + by) * 1e6 - 1e-5) * 1e-6
    # pitch and nearest distance grow alike: coils of a triangle and a grid stand one pitch apart
    return Fix((Edit("array.pitch", f"{pitch * 1e3:.6g}"),), moves.coils_apart(spec, pitch - spec.array.pitch).spec)
