"""Moves that give room: larger coils, coils farther apart, other ends, other contacts.

A closed formula says what one via needs; where leads, vias and other coils share the room only trying is honest. So an
amount that is named is one that was tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

from sitscad.finding import Edit, Missing
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.layout.lanes import bus_for
from sitscad.layout.windings import wind_all
from sitscad.remedy.fix import Fix
from sitscad.spec.presets import connector, names
from sitscad.spec.sensor import SensorSpec

GROWTH, MOST = 1.7, 5
"""What is missing is tried, then so many times as much, at most so often."""

HALVINGS, FINE_HALVINGS = 2, 5
"""Tries between what failed last and what worked first; and where the search may be long."""

GRAIN = 10e-6
"""Amounts are rounded up to this (m)."""

TURNED = (15.0, 30.0, 45.0, 90.0, 135.0, 180.0, 270.0)
"""Start angles (degrees) that are tried, counted from the spec's."""

Works = Callable[[SensorSpec], bool]
Move = Callable[[SensorSpec, float], Fix]


def larger_coils(spec: SensorSpec, by: float) -> Fix:
    """Coils larger by so much (m) across, their gaps kept."""
    size = (spec.coil.size[0] + by, spec.coil.size[1] + by)
    is_long = spec.coil.outline.is_long
    written = f"[{_mm(size[0])}, {_mm(size[1])}]" if is_long else _mm(size[0])
    edit = Edit("coil.outer_diameter", written)
    apart = coils_apart(spec, by)
    return Fix((edit, *apart.edits), replace(apart.spec, coil=replace(spec.coil, size=size)), _said(edit, by, apart))


def coils_apart(spec: SensorSpec, by: float) -> Fix:
    """The array enlarged so that the nearest coils stand farther apart by so much (m); no edit for a coil alone."""
    near = nearest_distance(spec)
    if near is None:
        return Fix((), spec)
    scale = 1.0 + by / near
    placements = tuple(replace(p, centre=(p.centre[0] * scale, p.centre[1] * scale)) for p in spec.array.placements)
    pitch = None if spec.array.pitch is None else spec.array.pitch + by
    changed = replace(spec, array=replace(spec.array, placements=placements, pitch=pitch))
    if pitch is not None:
        edit = Edit("array.pitch", _mm(pitch))
        return Fix((edit,), changed, _said(edit, by))
    centres = ", ".join(f"[{_mm(p.centre[0])}, {_mm(p.centre[1])}]" for p in placements)
    said = f"array.centres {scale:.4f} times as far from each other"
    return Fix((Edit("array.centres", f"[{centres}]"),), changed, said)


def _said(edit: Edit, by: float, also: Fix | None = None) -> str:
    more = f" with {also.words}" if also is not None and also.edits else ""
    return f"{edit.key}: {edit.new} ({by * 1e6:.0f} um more){more}"


def _mm(length: float) -> str:
    return f"{length * 1e3:.9g}"


def nearest_distance(spec: SensorSpec) -> float | None:
    """Distance (m) of the centres of the two nearest coils; None for one alone."""
    return min((math.dist(a.centre, b.centre) for a, b in combinations(spec.array.placements, 2)), default=None)


def lead_room(spec: SensorSpec) -> float:
    """What a via and a lead want beyond the gap between two coils (m), a track's pitch at least."""
    rules, pitch = spec.fpc.rules, spec.coil.trace_width + spec.fpc.rules.trace_spacing
    hole = joined_hole(rules, spec.coil.trace_width)
    gap = (nearest_distance(spec) or 0.0) - spec.coil.size[0]
    return max(2.0 * hole_keep_out(hole, rules, rules.trace_spacing) + pitch - gap, pitch)


def least(
    spec: SensorSpec, move: Move, works: Works, first: float, is_fine: Callable[[], bool] = lambda: False
) -> tuple[float, Fix] | None:
    """The least amount (m), as far as a few trials tell, with which the changed spec works; None where none does.

    `is_fine` says, when one was found, whether more may be tried: also below `first`, where that works at once.
    """
    failed, amount = 0.0, _rounded(first)
    for _ in range(MOST):
        if works(move(spec, amount).spec):
            halvings = FINE_HALVINGS if is_fine() else HALVINGS if failed > 0.0 else 0
            found = _between(spec, move, works, failed, amount, halvings)
            return found, move(spec, found)
        failed, amount = amount, _rounded(GROWTH * amount)
    return None


def _between(spec: SensorSpec, move: Move, works: Works, low: float, high: float, halvings: int) -> float:
    """The smallest move (m) between two that works, to within so many halvings."""
    for _ in range(halvings):
        middle = _rounded(0.5 * (low + high))
        if middle >= high - 0.5 * GRAIN:
            break
        if works(move(spec, middle).spec):
            high = middle
        else:
            low = middle
    return high


def _rounded(amount: float) -> float:
    return max(GRAIN, math.ceil(amount / GRAIN - 1e-6) * GRAIN)


def inner_vias_fit(spec: SensorSpec) -> bool:
    """Whether all vias inside the coils find a place."""
    return not any(lack.what is Missing.INNER_ROOM for lack in wind_all(spec, bus_for(spec))[0].shortfalls)


def other_start_angles(spec: SensorSpec) -> Iterator[Fix]:
    """Other angles at which the coils begin."""
    for turned in _angles(spec):
        written = f"{math.degrees(spec.coil.start_angle + turned) % 360.0:.6g}"
        changed = replace(spec, coil=replace(spec.coil, start_angle=math.radians(float(written))))
        yield Fix((Edit("coil.start_angle", f"{written} deg"),), changed)


def _angles(spec: SensorSpec) -> Iterator[float]:
    # What ends at a corner begins at one: any angle between two of them is the same.
    ends = spec.coil.outline.ends
    if ends is None:
        yield from map(math.radians, TURNED)
    else:
        yield from (2.0 * math.pi * k / ends for k in range(1, ends))


def wider_connectors(spec: SensorSpec) -> Iterator[Fix]:
    """Connectors of wider pitch, the next one first; none without a tail."""
    tail = spec.fpc.tail
    if tail is None:
        return
    for name in sorted(names("connector"), key=lambda name: connector(name).pitch):
        wider = connector(name)
        if wider.pitch > tail.connector.pitch + 1e-9:
            changed = replace(spec, fpc=replace(spec.fpc, tail=replace(tail, connector=wider)))
            yield Fix((Edit("fpc.tail.connector", name),), changed)
