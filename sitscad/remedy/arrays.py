"""Moves that let the edges of a target lie over the coils: smaller targets, arrays that are wider apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from sitscad.finding import Edit
from sitscad.geometry.path import Point
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import resized
from sitscad.spec.places import footprint
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import SensorSpec

STEPS = 4
"""Sizes and pitches that are tried between the one of now and the one at which edges lie over the coils' middles."""


def smaller_targets(spec: SensorSpec) -> Iterator[Fix]:
    """Targets, and pads with them where they are as large, on the way to one that ends over the middles of the outer
    coils, the largest first.
    """
    target, pad = spec.target, spec.elastomer
    assert target is not None
    here = footprint(spec, target)
    places = [here.place_of(Point(*placement.centre)) for placement in spec.array.placements]
    reach = [2.0 * max(abs(place[k]) for place in places) for k in (0, 1)]
    whole = [reach[k] if reach[k] > 0.0 else target.size[k] for k in (0, 1)]
    for step in range(1, STEPS + 1):
        sides = [_tenths(now + (least - now) * step / STEPS) for now, least in zip(target.size, whole, strict=True)]
        size = (min(sides[0], target.size[0]), min(sides[1], target.size[1]))
        if not target.outline.is_long:
            size = (max(size),) * 2
        if size == target.size:
            continue
        edits, smaller = next(resized("target", target, size))
        if pad is not None and pad.size == target.size:
            under, carrying = next(resized("elastomer", pad, size))
            yield Fix((*edits, *under), replace(spec, target=smaller, elastomer=carrying))
        else:
            yield Fix(edits, replace(spec, target=smaller))


def wider_arrays(spec: SensorSpec) -> Iterator[Fix]:
    """Arrays of a pitch that brings the middles of the outer coils nearer to the target's edges."""
    target, pitch = spec.target, spec.array.pitch
    if target is None or pitch is None:
        return
    here = footprint(spec, target)
    places = [here.place_of(Point(*placement.centre)) for placement in spec.array.placements]
    shares = [2.0 * max(abs(place[k]) for place in places) / target.size[k] for k in (0, 1)]
    if max(shares) <= 0.0:
        return
    for step in range(1, STEPS):
        wanted = _tenths(pitch * (1.0 + (1.0 / max(shares) - 1.0) * step / STEPS))
        if wanted <= pitch * (1.0 + 1e-9):
            continue
        try:
            changed = spec.replace("array.pitch", 1e3 * wanted)
        except SpecError:
            continue
        yield Fix((Edit("array.pitch", f"{1e3 * wanted:.6g}"),), changed)


def _tenths(length: float) -> float:
    return round(length * 1e4) * 1e-4
