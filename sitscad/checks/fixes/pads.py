"""Changes of target, pad and scan rate that may make a sensor feel more, nearest first: each is tried before it is
named.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from sitscad.checks.fixes.moves import read_anew, resized, scans
from sitscad.checks.fixes.search import Family, Fix, setting
from sitscad.spec import presets
from sitscad.spec.places import breadth_from
from sitscad.spec.sensor import SensorSpec

STEPS = 4
"""Sizes and pitches that are tried between the one of now and the one at which edges lie over the coils' middles."""


def smaller_targets(spec: SensorSpec) -> Iterator[Fix]:
    """Targets, and pads with them where they are as large, on the way to one that ends over the middles of the outer
    coils, the largest first.
    """
    target, pad = spec.target, spec.elastomer
    assert target is not None
    reach = breadth_from(spec, target)
    usual = target.size if target.outline.is_long else (max(*reach, *spec.coil.size),) * 2
    whole = [reach[k] if reach[k] > 0.0 else usual[k] for k in (0, 1)]
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


def smaller_pads(spec: SensorSpec) -> Iterator[Fix]:
    """A pad cut to its target, then smaller targets on pads of their size, the largest first."""
    cut = cut_to_target(spec)
    if cut is None:
        yield from smaller_targets(spec)
        return
    yield cut
    yield from smaller_targets(cut.spec)


def wider_arrays(spec: SensorSpec) -> Iterator[Fix]:
    """Arrays of a pitch that brings the middles of the outer coils nearer to the target's edges."""
    target, pitch = spec.target, spec.array.pitch
    if target is None or pitch is None:
        return
    share = max(reach / side for reach, side in zip(breadth_from(spec, target), target.size, strict=True))
    if share <= 0.0:
        return
    for step in range(1, STEPS):
        wanted = _tenths(pitch * (1.0 + (1.0 / share - 1.0) * step / STEPS))
        if wanted > pitch * (1.0 + 1e-9):
            yield from read_anew(spec, "array.pitch", 1e3 * wanted)


def _tenths(length: float) -> float:
    return round(length * 1e4) * 1e-4


SCANS_A_BAND = 2.0
"""Scans a second for every hertz of bandwidth, at least (SIT210)."""

FEWEST_SCANS = 1.0
"""Scans a second that are proposed at least."""

MAGNETIC, CONDUCTS = 1.1, 1e5
"""Relative permeability from which on a metal is magnetic, and conductivity (S/m) from which on it is a metal."""

OTHERS = 3
"""Softer or stiffer silicones that are tried, the nearest first."""

THICKNESSES = (1.25, 0.8, 1.5)
"""Thicknesses that are tried, over the one of now."""


def slower_scans(spec: SensorSpec, factor: float) -> Iterator[Fix]:
    """Fewer scans a second by a factor, no fewer than the bandwidth takes; nothing where that is no change."""
    least = max(SCANS_A_BAND * (spec.requirements.bandwidth or 0.0), FEWEST_SCANS)
    wanted = max(spec.readout.scan_rate / factor, least)
    digits = 10.0 ** (math.floor(math.log10(wanted)) - 1)
    rate = max(math.floor(wanted / digits + 1e-9) * digits, least)
    if rate < spec.readout.scan_rate * (1.0 - 1e-9):
        yield scans(spec, rate)


def other_silicones(spec: SensorSpec, is_softer: bool) -> Iterator[Fix]:
    """The next softer silicones of which there are figures, or the next stiffer ones."""
    pad = spec.elastomer
    assert pad is not None
    sense = -1.0 if is_softer else 1.0
    away = {one: sense * (one.shear_modulus / pad.material.shear_modulus - 1.0)
            for one in map(presets.elastomer, presets.names("elastomer"))}
    others = sorted((one for one in away if away[one] > 0.02), key=lambda one: (away[one], one.name))
    for material in others[:OTHERS]:
        yield setting(spec, "elastomer.material", material, material.name)


def other_thicknesses(spec: SensorSpec) -> Iterator[Fix]:
    """Pads somewhat thicker and thinner, as they are written: in whole hundredths of a millimetre."""
    pad = spec.elastomer
    assert pad is not None
    for factor in THICKNESSES:
        yield _as_thick(spec, round(factor * pad.thickness * 1e5) * 1e-5)


def other_metals(spec: SensorSpec) -> Iterator[Fix]:
    """Metals that may give more signal than the target's: instead of a magnetic one the alloy that conducts most like
    it, then the best conductor; instead of any other that one. Nothing for a good conductor, which has no better.
    """
    target = spec.target
    if target is None:
        return
    now, known = target.material, [presets.conductor(name) for name in presets.names("conductor")]
    plain = [one for one in known if one.relative_permeability < MAGNETIC and one.conductivity > CONDUCTS]
    best = max(plain, key=lambda one: one.conductivity)
    if now.relative_permeability >= MAGNETIC:
        alike = min(plain, key=lambda one: abs(math.log(one.conductivity / max(now.conductivity, CONDUCTS))))
        wanted = [alike, best]
    else:
        wanted = [best] if now.conductivity < BETTER * best.conductivity else []
    for metal in wanted:
        yield setting(spec, "target.material", metal, metal.name)


BETTER = 0.5
"""A conductor of less than so much of the best one's conductivity has a better one."""


def cut_to_target(spec: SensorSpec) -> Fix | None:
    """The pad as large as the target that lies on it: a rim beside that holds it up. None where the pad is no wider,
    or stands otherwise.
    """
    target, pad = spec.target, spec.elastomer
    if target is None or pad is None or pad.outline.is_disc != target.outline.is_disc:
        return None
    if pad.offset != target.offset or (target.rotation and not target.outline.is_disc) or pad.size == target.size:
        return None
    if any(own < side for own, side in zip(pad.size, target.size, strict=True)):
        return None
    *_, (edits, narrower) = resized("elastomer", pad, target.size)
    return Fix(edits, replace(spec, elastomer=narrower))


AS_WRITTEN = tuple(1e-3 * t for t in (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0))
"""Thicknesses of pads (m) among which the one of most signal is looked for, as people write them."""


def more_signal(spec: SensorSpec) -> tuple[Family, ...]:
    """Return changes that may give more signal over the force: another metal of the target, a pad no wider than it, the
    next thicknesses, softer silicones.

    A thinner pad brings the target nearer to the coils; a thicker pad is compressed more. So there is a best thickness.
    """
    pad = spec.elastomer
    if pad is None:
        return ()
    thinner, thicker = ([t for t in AS_WRITTEN if way * (t - pad.thickness) > 1e-6] for way in (-1.0, 1.0))
    narrower = cut_to_target(spec)
    return (partial(other_metals, spec), lambda: [narrower] if narrower else [],
            lambda: [_as_thick(spec, one) for one in thinner[::-1][:NEXT]],
            lambda: [_as_thick(spec, one) for one in thicker[:NEXT]], partial(other_silicones, spec, is_softer=True))


NEXT = 5
"""Thicknesses of pads that are tried to each side."""


def _as_thick(spec: SensorSpec, thickness: float) -> Fix:
    return setting(spec, "elastomer.thickness", thickness, f"{1e3 * thickness:.6g}")
