"""Changes of target, pad, film, scans and temperature sensor, the smallest first. Hints name tried changes only."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TypeVar

from sitscad.basics.finding import Edit
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import SAME, reread_change, rounded_up, with_scan_rate
from sitscad.checks.fixes.search import Family, Fix, with_value
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.shapes import LONG_PLATE
from sitscad.spec import presets
from sitscad.spec.load import rewritten_spec
from sitscad.spec.materials import ElastomerPad, Encapsulation, Target
from sitscad.spec.places import footprint, span_over_coils
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.thermistor import CALIBRATED

STEPS = 4
"""Number of steps from the target's present size to the smallest size, or from the present pitch to the largest pitch.

At the last step, the target's edges lie over the centres of the outer coils.
"""


def smaller_targets(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to smaller targets, in at most `STEPS` steps, the largest target first.

    The edges of the last target lie over the centres of the outer coils. If the pad has the target's size, it is
    reduced with the target.
    """
    target, pad = spec.target, spec.elastomer
    assert target is not None
    reach = span_over_coils(spec, target)
    usual = target.size if target.outline.is_long else (max(*reach, *spec.coil.size),) * 2
    whole = [reach[k] if reach[k] > 0.0 else usual[k] for k in (0, 1)]
    for step in range(1, STEPS + 1):
        sides = [_rounded_to_tenth_mm(now + (least - now) * step / STEPS) for now,
                 least in zip(target.size, whole, strict=True)]
        size = (min(sides[0], target.size[0]), min(sides[1], target.size[1]))
        if not target.outline.is_long:
            size = (max(size),) * 2
        if size == target.size:
            continue
        edits, smaller = next(resized_plates("target", target, size))
        if pad is not None and pad.size == target.size:
            under, carrying = next(resized_plates("elastomer", pad, size))
            yield Fix((*edits, *under), replace(spec, target=smaller, elastomer=carrying))
        else:
            yield Fix(edits, replace(spec, target=smaller))


def smaller_pads(spec: SensorSpec) -> Iterator[Fix]:
    """Yield the change to a pad as large as its target, then changes that also reduce the target, the largest first."""
    cut = pad_cut_to_target(spec)
    if cut is None:
        yield from smaller_targets(spec)
        return
    yield cut
    yield from smaller_targets(cut.spec)


def wider_arrays(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to a larger pitch of the array, the smallest pitch first.

    The centres of the outer coils then lie nearer to the target's edges. Empty if there is no target or no pitch.
    """
    target, pitch = spec.target, spec.array.pitch
    if target is None or pitch is None:
        return
    share = max(reach / side for reach, side in zip(span_over_coils(spec, target), target.size, strict=True))
    if share <= 0.0:
        return
    for step in range(1, STEPS):
        larger = _rounded_to_tenth_mm(pitch * (1.0 + (1.0 / share - 1.0) * step / STEPS))
        if larger > pitch * (1.0 + 1e-9):
            yield from reread_change(spec, "array.pitch", 1e3 * larger)


def _rounded_to_tenth_mm(length: float) -> float:
    return round(length * 1e4) * 1e-4


SCANS_A_BAND = 2.0
"""Least scan rate in a proposed design, divided by the required bandwidth (rule SIT210)."""

FEWEST_SCANS = 1.0
"""Least scan rate (Hz) that a hint proposes."""

MAGNETIC, CONDUCTS = 1.1, 1e5
"""Relative permeability from which a metal counts as magnetic, and conductivity (S/m) above which it counts as metal.

A material of lower conductivity is not proposed.
"""

OTHERS = 3
"""Largest number of softer (or stiffer) silicones that are tried. The silicone with the nearest modulus is first."""

THICKNESSES = (1.25, 0.8, 1.5)
"""Factors on the present pad thickness. The products are the thicknesses that are tried, in this order."""


def slower_scans(spec: SensorSpec, factor: float) -> Iterator[Fix]:
    """Yield the change to the present scan rate divided by `factor`.

    The new rate is at least `SCANS_A_BAND` times the required bandwidth, and at least `FEWEST_SCANS`. Empty if the scan
    rate would not change.
    """
    least = max(SCANS_A_BAND * (spec.requirements.bandwidth or 0.0), FEWEST_SCANS)
    required = max(spec.readout.scan_rate / factor, least)
    digits = 10.0 ** (math.floor(math.log10(required)) - 1)
    rate = max(math.floor(required / digits + 1e-9) * digits, least)
    if rate < spec.readout.scan_rate * (1.0 - 1e-9):
        yield with_scan_rate(spec, rate)


def other_silicones(spec: SensorSpec, is_softer: bool) -> Iterator[Fix]:
    """Yield changes to the next softer silicones in the data if `is_softer`, else to the next stiffer silicones."""
    pad = spec.elastomer
    assert pad is not None
    sense = -1.0 if is_softer else 1.0
    differences = {rubber: sense * (rubber.shear_modulus / pad.material.shear_modulus - 1.0)
            for rubber in map(presets.elastomer, presets.names("elastomer"))}
    silicones = sorted((rubber for rubber in differences if differences[rubber] > 0.02),
                       key=lambda rubber: (differences[rubber], rubber.name))
    for material in silicones[:OTHERS]:
        yield with_value(spec, "elastomer.material", material, material.name)


def other_thicknesses(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to a somewhat thicker or thinner pad, in whole hundredths of a millimetre."""
    pad = spec.elastomer
    assert pad is not None
    for factor in THICKNESSES:
        yield _with_thickness(spec, round(factor * pad.thickness * 1e5) * 1e-5)


def other_metals(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to metals that may give more signal than the target's metal.

    A magnetic metal is replaced by the alloy whose conductivity is nearest, then by the best conductor. Other metals
    are replaced by the best conductor. Empty if the target's metal is a good conductor already.
    """
    target = spec.target
    if target is None:
        return
    now, conductors = target.material, [presets.conductor(name) for name in presets.names("conductor")]
    plain = [conductor for conductor in conductors
             if conductor.relative_permeability < MAGNETIC and conductor.conductivity > CONDUCTS]
    best = max(plain, key=lambda conductor: conductor.conductivity)
    if now.relative_permeability >= MAGNETIC:
        conductivity = max(now.conductivity, CONDUCTS)
        similar = min(plain, key=lambda conductor: abs(math.log(conductor.conductivity / conductivity)))
        metals = [similar, best]
    else:
        metals = [best] if now.conductivity < BETTER * best.conductivity else []
    for metal in metals:
        yield with_value(spec, "target.material", metal, metal.name)


BETTER = 0.5
"""Ratio of a metal's conductivity to the best conductor's conductivity, below which the best conductor is proposed."""


def pad_cut_to_target(spec: SensorSpec) -> Fix | None:
    """Return the change to a pad as large as its target. A pad that extends beyond the target is stiffer.

    None if the pad is not larger, or differs in shape or place.
    """
    target, pad = spec.target, spec.elastomer
    if target is None or pad is None or pad.outline.is_disc != target.outline.is_disc:
        return None
    if pad.offset != target.offset or (target.rotation and not target.outline.is_disc) or pad.size == target.size:
        return None
    if any(pad_side < side for pad_side, side in zip(pad.size, target.size, strict=True)):
        return None
    *_, (edits, narrower) = resized_plates("elastomer", pad, target.size)
    return Fix(edits, replace(spec, elastomer=narrower))


AS_WRITTEN = tuple(1e-3 * t for t in (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0))
"""Usual thicknesses (m) of pads. The hints that increase the signal choose among them."""


def families_for_more_signal(spec: SensorSpec) -> tuple[Family, ...]:
    """Return families of changes that may increase the change of the readings by the required force.

    They are another metal of the target, a pad no larger than the target, thinner pads, thicker pads, and softer
    silicones. With a thinner pad, the target is nearer to the coils. A thicker pad is compressed more. The signal is
    largest at a thickness between these two.
    """
    pad = spec.elastomer
    if pad is None:
        return ()
    thinner, thicker = ([t for t in AS_WRITTEN if way * (t - pad.thickness) > 1e-6] for way in (-1.0, 1.0))
    narrower = pad_cut_to_target(spec)
    return (partial(other_metals, spec), lambda: [narrower] if narrower else [],
            lambda: [_with_thickness(spec, each) for each in thinner[::-1][:NEXT]],
            lambda: [_with_thickness(spec, each) for each in thicker[:NEXT]],
            partial(other_silicones, spec, is_softer=True))


def temperature_sensors(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes that compensate the readings for temperature.

    The first is a temperature sensor on the board. The second adds compensation coefficients that are measured at two
    temperatures. The third is a reference coil with such coefficients, if the converter has a free channel. If the spec
    has a temperature sensor or a reference coil already, only its coefficients are changed. Empty if these are measured
    already.
    """
    settings, coils = spec.readout.compensation, len(spec.array.placements)
    measured = ("readout.compensation.coefficients", CALIBRATED)
    if settings is not None:
        if settings.coefficients != CALIBRATED:
            yield from reread_change(spec, *measured)
        return
    sensor = ("readout.thermistor.part", SENSOR)
    yield from reread_change(spec, *sensor)
    yield Fix((Edit(*sensor), Edit(*measured)), rewritten_spec(spec, (sensor, measured)))
    if coils % spec.readout.device.channels:
        yield Fix((Edit("array.reference", "{}"), Edit(*measured)),
                  rewritten_spec(spec, (("array.reference", {}), measured)))


SENSOR = "tmp117"
"""Temperature sensor that hints propose. It has the smallest error of the sensors in ``data/thermistors.csv``."""

NEXT = 5
"""Number of thinner pads and number of thicker pads that are tried."""


def _with_thickness(spec: SensorSpec, thickness: float) -> Fix:
    return with_value(spec, "elastomer.thickness", thickness, f"{1e3 * thickness:.6g}")

PROTECTIVE_FILM = ("ecoflex-00-50", 50e-6)
"""Film that a hint proposes to protect a bare target: name of the silicone, and thickness (m)."""


def with_film(spec: SensorSpec) -> Iterator[Fix]:
    """Yield the change that adds the film `PROTECTIVE_FILM` over the whole sensor. Empty if the spec has a film."""
    if spec.encapsulation is None:
        name, thickness = PROTECTIVE_FILM
        edits = (Edit("encapsulation.material", name), Edit("encapsulation.thickness", f"{1e3 * thickness:g}"))
        yield Fix(edits, replace(spec, encapsulation=Encapsulation(presets.elastomer(name), thickness)))


def thicker_target(spec: SensorSpec, thickness: float) -> Fix:
    """Return the change of the target's thickness to `thickness` (m), rounded up to whole micrometres."""
    thick = math.ceil(thickness * 1e6 - 1e-6) * 1e-6  # rounded as written
    return with_value(spec, "target.thickness", thick, show(thick, "m", 6))


def larger_target(spec: SensorSpec, length: float, width: float) -> Iterator[Fix]:
    """Yield changes to a target of the sides `length` and `width` (m).

    In the first change, the pad is made large enough to carry the target. In the second, the pad does not change. A
    circle or square has a single size. It first gets the larger side as its size, then becomes a rectangle.
    """
    target, pad = spec.target, spec.elastomer
    assert target is not None
    for edits, resized_target in resized_plates("target", target, (length, width)):
        here = footprint(spec, resized_target)
        if pad is not None and here.overhang_beyond(footprint(spec, pad).outline()) > SAME:
            for under_it, larger in resized_plates("elastomer", pad, pad_sides_under_plate(footprint(spec, pad), here)):
                yield Fix((*edits, *under_it), replace(spec, target=resized_target, elastomer=larger))
        yield Fix(edits, replace(spec, target=resized_target))


def centred_plates(spec: SensorSpec) -> Iterator[Fix]:
    """Yield the change that sets the offsets of target and elastomer to 0. Empty if the target has no offset."""
    target, pad = spec.target, spec.elastomer
    if target is None or not any(target.offset):
        return
    edits, changed = [Edit("target.offset", "[0, 0]")], replace(spec, target=replace(target, offset=(0.0, 0.0)))
    if pad is not None and any(pad.offset):
        edits.append(Edit("elastomer.offset", "[0, 0]"))
        changed = replace(changed, elastomer=replace(pad, offset=(0.0, 0.0)))
    yield Fix(tuple(edits), changed)


def pad_sides_under_plate(pad: Footprint, plate: Footprint) -> tuple[float, float]:
    """Return the smallest sides (m) of a pad that carries a whole plate. The pad's centre does not change.

    The sides are at least the present sides. For a round pad, both values are the diameter.
    """
    if pad.is_round:
        reach = max((pad.centre.distance(p) for p in plate.corners), default=pad.centre.distance(plate.centre))
        side = max(2.0 * reach + (plate.size[0] if plate.is_round else 0.0), pad.size[0])
        return (rounded_up(side),) * 2
    offset = abs(plate.centre.x - pad.centre.x), abs(plate.centre.y - pad.centre.y)
    x, y = (rounded_up(max(2.0 * (offset[k] + plate.reach[k]), pad.size[k])) for k in (0, 1))
    return x, y

Plate = TypeVar("Plate", Target, ElastomerPad)


def resized_plates(key: str, plate: Plate, size: tuple[float, float]) -> Iterator[tuple[tuple[Edit, ...], Plate]]:
    """Yield (edits, changed plate) for a plate with the sides `size` (length, width; m).

    `key` is the plate's section in the spec. A circle or square has a single size. It first gets the larger side as its
    size, then becomes a rectangle.
    """
    sides = [f"{side * 1e3:.6g}" for side in size]
    size_edit = Edit(f"{key}.size", f"[{', '.join(sides)}]")
    if plate.outline.is_long:
        yield (size_edit,), replace(plate, size=size)
        return
    yield (Edit(f"{key}.size", f"{max(size) * 1e3:.6g}"),), replace(plate, size=(max(size),) * 2)
    if size[0] != size[1]:
        yield (Edit(f"{key}.shape", LONG_PLATE), size_edit), replace(plate, shape=LONG_PLATE, size=size)
