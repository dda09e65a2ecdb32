"""What a coil has to say: the change of its reading from rest to the required force."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sitscad.arrays import Array
from sitscad.check_values import Most, Signal
from sitscad.estimates.states.moved_target import target_effects
from sitscad.estimates.states.pressing import pressed
from sitscad.physics.polynomials import Interpolant, chebyshev_points
from sitscad.scene.fit import passes_port
from sitscad.scene.state import PRESSED, REST

if TYPE_CHECKING:
    from sitscad.estimates.values import CoilEstimate, Estimates, ReadoutEstimate
    from sitscad.layout.board import Layout
    from sitscad.spec.sensor import SensorSpec


STEP, THICKEST = 0.05e-3, 3e-3
"""Thicknesses (m) of pads among which that of most signal is looked for: every so much, up to this."""

HEIGHTS = 9  # Heights of the target at which its effect is worked out; between, its logarithm is a polynomial

SHEETS = tuple(1e-3 * t for t in (0.05, 0.1, 0.2, 0.5, 1.0))
"""Thicknesses (m) of targets that are looked at, as sheets are sold."""

PORT, TRIED = "the port", "the thickest that was tried"  # What keeps a part from being thicker

AS_GOOD, ALIKE = 0.98, 0.1
"""Part of the largest signal from which on a thinner target is as good; and by how much of the estimates' signal that
of the shares may be off, or they say nothing of such a target."""


def signals(estimates: Estimates) -> tuple[Signal, ...]:
    """The signal of every coil that has both states; none without a required force, a target and an elastomer."""
    found = (_signal(coil, estimates.normal_force, estimates.readout) for coil in estimates.coils)
    return tuple(signal for signal in found if signal is not None)


def strongest_signal(found: Sequence[Signal], spec: SensorSpec) -> Signal:
    """The signal of the coil whose reading changes most; of cells that of the cell in which it does so least."""
    count = len(spec.array.placements) if spec.cells is None else spec.cells.coils
    cells: dict[int, list[Signal]] = {}
    for k, placement in enumerate(spec.array.placements):
        cells.setdefault(k // count, []).extend(one for one in found if one.coil == placement.name)
    best = (max(cell, key=lambda one: abs(one.share)) for cell in cells.values() if cell)
    return min(best, key=lambda one: abs(one.share))


def _signal(coil: CoilEstimate, force: float | None, readout: ReadoutEstimate) -> Signal | None:
    """What one coil's reading does under a force (N); None where it has no such reading."""
    change = coil.sensitivity(force)
    if change is None or not force or not all(map(math.isfinite, change)):
        return None
    rest, pressed = coil.states[REST], coil.states[PRESSED]
    sigma = coil.sensitivity_sigma(force) or (None, None)
    own, conversion = coil.press_share, readout.conversion
    before, after = rest.converter_inductance, pressed.converter_inductance
    if before is None or after is None:
        before, after = rest.inductance, pressed.inductance
    return Signal(
        coil.name, force, rest.inductance, change[0], sigma[0], change[1], sigma[1],
        share=own * (after / before - 1.0),
        frequency_share=own * (pressed.frequency / rest.frequency - 1.0),
        steps=own * conversion.steps(rest.frequency, pressed.frequency) if conversion else None,
    )


def most_signal(layout: Layout, estimates: Estimates) -> tuple[Most, ...]:
    """The thickness of the pad, and that of the target, with which the inductance of the coil that changes most changes
    most per newton, all else as it is; of cells that in the one with the least signal. Nothing without a signal.

    The target is an endless plate times its shares, as in the states, and all is held against what the estimates have
    of now: within 3 % of estimates of such parts. Parts are as thick as the port leaves room for by root-sum-square,
    and pads pressed no farther than their law is held.
    """
    whole, cells, number = layout, layout.spec.cells, None
    if cells is not None:
        from sitscad.estimates.cells import weakest_cell

        number = weakest_cell(layout.spec, estimates)
        layout, estimates = layout.cell(number), estimates.part((number - 1) * cells.coils, number * cells.coils)
    felt, pad, target = signals(estimates), layout.spec.elastomer, layout.spec.target
    if not felt or target is None or pad is None or estimates.compression is None:
        return ()
    best = max(felt, key=lambda signal: abs(signal.per_newton))
    before, after = _effects(layout, estimates, best, np.array([0.0, estimates.compression.gap - pad.thickness]))
    if abs((after - before) / (best.per_newton * best.force) - 1.0) > ALIKE:
        return ()

    def passes(part: str, thickness: float) -> bool:  # of the whole sensor
        return passes_port(whole, replace(
            whole.spec, **{part: replace(getattr(whole.spec, part), thickness=thickness)}))

    found = _best_pad(layout, estimates, best, passes), _best_target(layout, estimates, best, passes)
    return tuple(replace(most, coil=best.coil, cell=number) for most in found if most is not None)


Passes = Callable[[str, float], bool]


def _best_pad(layout: Layout, estimates: Estimates, best: Signal, passes: Passes) -> Most | None:
    pad = layout.spec.elastomer
    assert pad is not None
    specs = {t: replace(layout.spec, elastomer=replace(pad, thickness=t))
             for t in (pad.thickness, *(round(STEP * k, 6) for k in range(1, round(THICKEST / STEP) + 1)))}
    left = {t: pressed(spec) for t, spec in specs.items()}
    held = [t for t, one in left.items() if one.valid]
    if pad.thickness not in held:
        return None
    ends = np.array([(t, left[t].gap) for t in held]) - pad.thickness
    heights = chebyshev_points(float(ends.min()), float(ends.max()), HEIGHTS)
    effect = _effects(layout, estimates, best, heights)
    if not np.all(effect * effect[0] > 0.0):
        return None  # a magnetic target's effect goes through nothing: there is no logarithm of it
    through = Interpolant(ends.min(keepdims=True).ravel(), ends.max(keepdims=True).ravel(), np.log(np.abs(effect)))
    sizes = np.exp(through(ends.reshape(-1, 1))).reshape(ends.shape)
    change = np.abs(np.diff(sizes, axis=1)[:, 0])
    by_signal = [held[k] for k in np.argsort(-change, kind="stable")]
    thickness = next((t for t in by_signal if passes("elastomer", t)), None)
    if thickness is None:
        return None
    per_newton = float(best.per_newton * change[held.index(thickness)] / change[0])
    ended_by = PORT if thickness != by_signal[0] else TRIED if thickness == max(held) else ""
    return Most("pad", thickness, per_newton, pad.thickness, best.per_newton, ended_by)


def _best_target(layout: Layout, estimates: Estimates, best: Signal, passes: Passes) -> Most | None:
    target, pad, now = layout.spec.target, layout.spec.elastomer, estimates.compression
    assert target is not None and pad is not None and now is not None
    ends, change, ended_by = np.array([0.0, now.gap - pad.thickness]), {}, TRIED
    for thickness in (target.thickness, *SHEETS):
        own = replace(layout.spec, target=replace(target, thickness=thickness))
        if thickness > target.thickness and not passes("target", thickness):
            ended_by = PORT
            break
        change[thickness] = abs(float(np.diff(_effects(replace(layout, spec=own), estimates, best, ends))[0]))
    # a thinner one that is as good, but none that gives less than what is there
    enough = max(AS_GOOD * max(change.values()), change[target.thickness])
    thickness = min(t for t, one in change.items() if one >= enough)
    return Most("target", thickness, best.per_newton * change[thickness] / change[target.thickness], target.thickness,
                best.per_newton, ended_by if thickness == max(change) else "")


def _effects(layout: Layout, estimates: Estimates, best: Signal, heights: Array) -> Array:
    """What the target changes of the best coil's inductance (H) at heights (m) from rest."""
    names = [coil.name for coil in estimates.coils]
    frequency = estimates.coils[names.index(best.coil)].states[REST].frequency
    found = target_effects(layout, [(0.0, 0.0)], list(map(float, heights)), frequency)
    return np.asarray(found[:, 0, names.index(best.coil)].real)
