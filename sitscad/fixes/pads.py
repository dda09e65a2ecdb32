"""Changes of target, pad and scan rate that may make a sensor feel more, nearest first: each is tried before it is
named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from sitscad.fixes.moves import read_anew, resized, scans
from sitscad.fixes.search import Fix, Left, setting
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


def more_by_metal(spec: SensorSpec, left: Left) -> str:
    """Which other metals of the target make the reading change more, and how many times, found by trying; nothing where
    none does, or none was tried.
    """
    here = left.share(spec)
    told: list[str] = []
    for fix in other_metals(spec) if here else ():
        left(fix)
        there = left.share(fix.spec)
        if here and there is not None and there > MORE * here:
            words = f"gives {there / here:.2g} times the signal{_brought(fix, left)}"
            told.append(f"{fix.words} {words}" if not told else f"{fix.edits[0].new} {words}")
    if not told:
        return ""
    assert spec.target is not None
    metal = spec.target.material
    why = f"{metal.name} is magnetic (relative permeability {metal.relative_permeability:g}): "
    return f"{why if metal.relative_permeability >= MAGNETIC else ''}{', '.join(told)} (tried)"


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


def more_by_narrower(spec: SensorSpec, left: Left) -> str:
    """How many times as much the reading changes on a pad that is no wider than the target, found by trying; nothing
    where it is no wider, that makes little, or another rule fails.
    """
    fix, here = cut_to_target(spec), left.share(spec)
    if fix is None or not here:
        return ""
    broken = left(fix)
    there = 0.0 if broken is None or set(broken) - SIGNAL_RULES else left.share(fix.spec) or 0.0
    if there <= MORE * here:
        return ""
    return f"{fix.words} gives {there / here:.2g} times the signal{_brought(fix, left)} (tried)"


def _brought(fix: Fix, left: Left) -> str:
    """The rules that warn of a changed design and not of the design as it stands, in brackets. Empty if none does."""
    brings = left.warned(fix.spec)
    return f" ({brings})" if brings else ""


MORE = 1.2
"""Times the signal from which on another metal, or a narrower pad, is named."""


AS_WRITTEN = tuple(1e-3 * t for t in (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0))
"""Thicknesses of pads (m) among which the one of most signal is looked for, as people write them."""


def best_thickness(spec: SensorSpec, left: Left, passes: Callable[[SensorSpec], bool]) -> str:
    """Words for the pad's thickness of most signal at the required force with which no other rule fails, and its gain.

    A thinner pad brings the target nearer to the coils; a thicker pad is compressed more. So there is a best
    thickness. A thicker pad must pass the port (`passes`), even if the present spec does not. If only few designs
    may be tried, only the next thinner pad is tried, and the next thicker pad if the thinner one gives no more.
    Then no gain gives an empty text.
    """
    pad, here, is_long = spec.elastomer, left.share(spec), left.wants_another()
    if pad is None or not here:
        return ""
    best, most, was_tried = None, NAMED * here, False
    thinner, thicker = ([t for t in AS_WRITTEN if way * (t - pad.thickness) > 1e-6] for way in (-1.0, 1.0))
    for steps in (thinner[::-1], thicker):
        before = here
        if best is not None and not is_long:
            break
        for fix in (_as_thick(spec, thickness) for thickness in (steps if is_long else steps[:1])):
            if steps is thicker and not passes(fix.spec):
                break
            broken = left(fix)
            was_tried = was_tried or broken is not None
            there = 0.0 if broken is None or set(broken) - SIGNAL_RULES else left.share(fix.spec) or 0.0
            if there < before:
                break  # from there on it falls, or something fails
            best, most, before = (fix, there, there) if there > most else (best, most, there)
    if best is None:
        more = f"{100.0 * (NAMED - 1.0):.0f} % more signal"
        return f"no other thickness that breaks no other rule gives {more} (tried)" if is_long and was_tried else ""
    others = ", more than any other" if is_long else ""
    digits = 2 if most > 1.1 * here else 3
    return f"{best.words} gives {most / here:.{digits}g} times the signal{others}{_brought(best, left)} (tried)"


NAMED = 1.02
"""Least gain of signal (1) for which another thickness of the pad is named."""

SIGNAL_RULES = {"SIT215", "SIT217"}
"""The rules that ask for more signal."""


def _as_thick(spec: SensorSpec, thickness: float) -> Fix:
    return setting(spec, "elastomer.thickness", thickness, f"{1e3 * thickness:.6g}")
