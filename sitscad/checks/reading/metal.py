"""SIT221: effect of the other jaw's metal. SIT305: loss of signal and parallel resistance by a thin target.

The other jaw's effect is compared with the sensor's own signal, and the thin target with a thick target of the same
metal.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.finding import Severity
from sitscad.basics.late import late
from sitscad.basics.record import memo, record
from sitscad.checks.fixes.pads import thicker_target
from sitscad.checks.reading.readings import all_readings, coil_state_text
from sitscad.checks.rules import Rule, Verdict, constant_limits, not_checked, rule_of, violation_of
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design
from sitscad.estimates.windings.losses import SCREENING
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.spec import presets
from sitscad.spec.materials import Target
from sitscad.spec.sensor import SensorSpec

estimate_other_jaw_changes = late("sitscad.estimates.states.other_jaw", "estimate_other_jaw_changes")

THICK = 3.0
"""Thickness of a target divided by its skin depth, above which the target counts as thick.

It then stops 95 % of the field (TI SNOA957B).
"""

COMPARED = 1.2
"""Ratio of a target's thickness to its skin depth, above which it is not compared with a thick target.

Above this ratio, the sheet resistances of the target and of a thick target differ by at most 9 %. The coil's own
resistance is the same with both, so no limit can be exceeded.
"""

MAGNETIC = 10.0
"""Limit of relative permeability, and of skin depth over thickness, for targets that act by their permeability.

If both values are at least this number, eddy currents in the target hardly matter.
"""


def target_thickness(design: Design) -> Iterator[Verdict]:
    """Yield findings on a target thinner than three skin depths, and on a target of a poorly conducting material."""
    target = _require_target(design.spec.target)
    frequencies = [reading.value for reading in all_readings(design.estimates.coils, "frequency")
                   if reading.value > 0.0]
    if not frequencies:
        yield not_checked("no-estimate", quantity="sensor frequency")
        return
    metal, frequency = target.material, min(frequencies)
    depth = skin_depth(frequency, metal.conductivity, metal.relative_permeability)
    if metal.relative_permeability >= MAGNETIC and depth > MAGNETIC * target.thickness:
        yield not_checked("magnetic-target", metal=metal.name)
    elif THICK * depth > min(target.size):
        yield from _poor_conductor(design, depth, frequency)
    elif target.thickness < THICK * depth:
        yield from _thin_target_findings(design, depth, frequency)


def _thin_target_findings(design: Design, depth: float, frequency: float) -> Iterator[Verdict]:
    """Yield a note on a target thin compared with its skin depth, or a warning if its losses exceed a limit.

    `depth` is the skin depth (m) at the frequency `frequency` (Hz).
    """
    target, thick, limits = _require_target(design.spec.target), THICK * depth, constant_limits()
    depths, limit = target.thickness / depth, limits["thin_target_resistance"]
    if depths >= COMPARED and target.material.relative_permeability < 1.1:
        yield violation_of("thin-target", "target.thickness", _resistance_of_sheet(depths) - 1.0, limit.value,
                           hint="thin-keep", details=("thin-sheet",), severity=Severity.NOTE, source=limit.source,
                           thickness=target.thickness, depths=depths, metal=target.material.name, frequency=frequency)
        return
    cost = _thin_target_cost(design, thicker_target(design.spec, thick).spec)
    if cost is None:
        yield not_checked("thin-cost-unknown")
        return
    too_much, measured = cost.resistance > limit.value, cost.resistance
    if not too_much and cost.resistance < cost.change:
        limit, measured = limits["thin_target_change"], cost.change
    is_dear = too_much or cost.change > limits["thin_target_change"].value
    top = max((reading.value for reading in all_readings(design.estimates.coils, "frequency")), default=0.0)
    # a skin depth falls with the square root of the frequency
    required = (thick / target.thickness) ** 2 * top
    is_reached = required <= design.spec.readout.device.limit("sensor_frequency_max")
    hint = "thin-thicker-frequency" if is_reached else "thin-thicker"
    yield violation_of(
        "thin-target", "target.thickness", measured, limit.value, hint=hint if is_dear else "thin-keep",
        details=cost.details, severity=Severity.WARNING if is_dear else Severity.NOTE, source=limit.source,
        fixes=(lambda: [thicker_target(design.spec, thick)],) if is_dear else (), thick=thick,
        thickness=target.thickness, depths=depths, metal=target.material.name, frequency=frequency, where=cost.where,
        resistance=cost.readings[0], thick_resistance=cost.readings[1], percent=_percent_text(*cost.readings),
        change=cost.changes[0], thick_change=cost.changes[1], change_percent=_percent_text(*cost.changes),
        amplitude=cost.amplitude,
    )


def _resistance_of_sheet(depths: float) -> float:
    # Surface resistance of an infinite sheet (thickness in skin depths) over a thick sheet's, no unit (Stoll, The
    # Analysis of Eddy Currents, 1974): Re (1 + j) coth((1 + j) t / depth).
    twice = 2.0 * depths
    return (math.sinh(twice) + math.sin(twice)) / (math.cosh(twice) - math.cos(twice))


@record
class _ThinTargetCost:
    """Loss of parallel resistance and signal by a thin target, compared with a thick target of the same metal.

    Attributes
    ----------
    resistance, change : float
        relative losses of parallel resistance and of signal; negative for a gain
    details : tuple of str
        keys in ``data/messages.csv`` of the texts that describe the losses
    where : str
        coil and state with the largest loss of parallel resistance
    readings : tuple of float
        parallel resistance (ohm) there with the thin target, then with the thick target
    changes : tuple of float
        signal of a coil (H/N, or H if no force is required) with the thin target, then with the thick target
    amplitude : float
        oscillation amplitude (V) there with the thin target; 0 if it is unknown
    """

    resistance: float
    change: float
    details: tuple[str, ...]
    where: str
    readings: tuple[float, float]
    changes: tuple[float, float]
    amplitude: float


def _thin_target_cost(design: Design, thick: SensorSpec) -> _ThinTargetCost | None:
    """Return the losses due to a thin target, for the coil and state with the largest loss of parallel resistance.

    `thick` is the spec with a thick target. None if no coil has a parallel resistance with both targets.
    """
    other = _design_for_comparison(design, thick)
    readings, thick_readings = (
        all_readings(each.estimates.coils, "parallel_resistance", True) for each in (design, other))
    reference = {(r.coil, r.state): r for r in thick_readings}
    pairs = [(r, reference[r.coil, r.state]) for r in readings if (r.coil, r.state) in reference]
    if not pairs:
        return None
    worst, against = min(pairs, key=lambda pair: pair[0].value / pair[1].value)
    # the amplitude there: SIT204 judges it
    swing = [r.value for r in all_readings(design.estimates.coils, "amplitude", True)
             if (r.coil, r.state) == (worst.coil, worst.state)]
    change = _largest_signal_pair(_target_effects(design, design), _target_effects(design, other))
    force = design.spec.requirements.normal_force
    changes = change or (1.0, 1.0)
    details = ("thin-cost", *["thin-change-newton" if force else "thin-change-rest"] * (change is not None),
               *["thin-amplitude"] * bool(swing))
    return _ThinTargetCost(1.0 - worst.value / against.value, 1.0 - changes[0] / changes[1], details,
                           coil_state_text(worst), (worst.value, against.value), changes, swing[0] if swing else 0.0)


def _largest_signal_pair(mine: Mapping[str, float], theirs: Mapping[str, float]) -> tuple[float, float] | None:
    """Return the signals of one coil in two designs, as (signal in `mine`, signal in `theirs`).

    `mine` and `theirs` are the signals (H, or H/N) by coil name. The coil with the largest signal in `theirs` is used.
    None if no coil has a signal in both.
    """
    best = max((name for name in theirs if name in mine and theirs[name]), key=lambda n: abs(theirs[n]), default=None)
    return None if best is None else (mine[best], theirs[best])


def _percent_text(mine: float, other: float) -> str:
    return f"{round(100.0 * (mine / other - 1.0), 1) + 0.0:+.1f} %"  # no -0.0


def _poor_conductor(design: Design, depth: float, frequency: float) -> Iterator[Verdict]:
    """Yield a finding on a material whose skin depth is larger than the target's width.

    `depth` is the skin depth (m) at the frequency `frequency` (Hz). The finding states the comparison with a copper
    target.
    """
    target = _require_target(design.spec.target)
    copper = replace(design.spec, target=replace(target, material=presets.conductor("copper")))
    other = _design_for_comparison(design, copper)
    mine, theirs = (
        max((abs(v) for v in _target_effects(design, each).values()), default=math.nan) for each in (design, other)
    )
    if not theirs > 0.0 or not math.isfinite(mine):
        yield not_checked("target-effect-unknown")
        return
    share, least = mine / theirs, constant_limits()["least_target_effect"]
    yield violation_of(
        "poor-conductor", "target.material", share, least.value, source=least.source, metal=target.material.name,
        details=("poor-depth" if math.isfinite(depth) else "poor-insulator",), frequency=frequency, depth=depth,
        thickness=target.thickness, severity=Severity.ERROR if share < least.value else Severity.WARNING,
    )


def _target_effects(design: Design, other: Design) -> dict[str, float]:
    # The target's effect on each coil by name, in this or a changed design: change per newton (H/N), or else
    # the change of the inductance at rest (H), against the sensor without a target.
    force = other.spec.requirements.normal_force
    if force:
        return {coil.name: slope[0] for coil in other.estimates.coils if (slope := coil.sensitivity(force))}
    targetless = memo(design, "without its target", lambda: _design_for_comparison(design,
                                                                                   replace(design.spec, target=None)))
    without = {r.coil: r.value for r in all_readings(targetless.estimates.coils, "inductance", True)}
    rest = [r for r in all_readings(other.estimates.coils, "inductance") if r.state == REST and r.coil in without]
    return {r.coil: r.value - without[r.coil] for r in rest}


def _design_for_comparison(design: Design, changed: SensorSpec) -> Design:
    # A changed design with this design's tank capacitor, and a solved target if this design has a solved target: only
    # the change then differs. The level of estimates is the same, too.
    tolerance = SCREENING if design.estimates.is_rough else None
    now = design.estimates.readout.capacitance
    laid_out = design.drawn(replace(changed, readout=replace(changed.readout, capacitance=now)))
    numbers = estimate_layout(laid_out.layout, tolerance=tolerance, is_solved=design.estimates.is_solved)
    return replace(laid_out, given_estimates=numbers)


def _require_target(target: Target | None) -> Target:
    assert target is not None
    return target


_LIMITS = ("thin_target_resistance", "thin_target_change", "least_target_effect")



MUCH, LITTLE = 0.1, 0.01
"""Least ratios for a warning (first value) and for a note (second value) on the other jaw's metal.

The ratio is a coil's change due to this metal, divided by its change due to the required force. For the warning, the
jaws are closed on an object of thickness `THIN`. For the note, nothing is between them.
"""

THIN = 1e-3  # Thickness (m) of a thin grasped object, at which the metal's effect is checked


def other_jaw_metal(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the coil for which the other jaw's effect is largest compared with the signal.

    The effect is the change due to the other jaw's metal when the jaws close. The signal is the change due to the
    required force.
    """
    if design.estimates.is_rough:
        return
    weakest = design.cells.weakest
    states = {coil.name: coil.states for coil in weakest.estimates.coils}
    signal = {name: abs(each[PRESSED].inductance - each[REST].inductance)
              for name, each in states.items() if PRESSED in each and REST in each}
    if not signal:
        yield not_checked("no-signal")
        return
    near, closed = (
        estimate_other_jaw_changes(weakest.layout, weakest.estimates.coils, weakest.estimates.temperature, grasped)
        for grasped in (THIN, 0.0))
    names = [name for name in signal if name in near and signal[name] > 0.0]
    if not names:
        return
    worst = max(names, key=lambda name: abs(near[name]) / signal[name])
    ratios = [abs(change[worst]) / signal[worst] for change in (closed, near)]
    if ratios[0] < LITTLE:
        return
    yield violation_of(
        "other-jaw", "mount.jaw", ratios[1], MUCH, severity=None if ratios[1] > MUCH else Severity.NOTE, coil=worst,
        closed=abs(closed[worst]), near=abs(near[worst]), share=ratios[0], thin=THIN,
        force=design.spec.requirements.normal_force or 0.0,
    )


RULES: tuple[Rule, ...] = (
    rule_of("SIT221", other_jaw_metal, "target", "jaw", much=f"{100.0 * MUCH:.0f} %"),
    rule_of("SIT305", target_thickness, "target", compared=COMPARED,
            **{name: 100.0 * constant_limits()[name].value for name in _LIMITS}),
)
