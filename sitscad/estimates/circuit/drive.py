"""The drive current: one code for all coils where that does, else one a channel, with manufacture in mind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from sitscad.estimates.values import CoilEstimate, Estimates, ReadoutEstimate, StateEstimate
from sitscad.readout.converter import Converter
from sitscad.record import record
from sitscad.scene.state import FREE
from sitscad.spec.sensor import ReadoutSpec

SIGMAS_BELOW = 1.0
"""Standard deviations of all manufacture by which the amplitude stays below 1.8 V. TI takes the strongest code that
does, since clamping is worse than noise (8.1.5; SNOA950), for one known sensor; this is for those still to be
made."""


@record
class Swing:
    """What the working states of a coil ask of its drive: most and least R_P (ohm), the most with its margin too."""

    least: float
    most: float
    careful: float


def driven(
    coils: Sequence[CoilEstimate], readout: ReadoutEstimate, spec: ReadoutSpec
) -> tuple[tuple[CoilEstimate, ...], ReadoutEstimate]:
    """Coils and settings with the drive codes that suit all working states, or with the code that the spec sets.

    The code is the strongest with which every coil stays below 1.8 V in every working state, one sigma beyond its
    estimate and with the thickest copper that is delivered (a board has one foil and one plating: their ends are
    common, and no test of the board tells them). Where that
    leaves a coil below 1.2 V, and a code for every channel leaves none, the channels have codes of their own.
    """
    if readout.drive_code is None or readout.high_current:
        return tuple(coils), readout
    converter, wanted = spec.device, spec.drive_code
    codes = (wanted,) * len(coils) if wanted is not None else drive_codes([_swing(coil) for coil in coils], converter)
    current = converter.drive_current(max(codes))
    more = spec.device.needed(len(coils)) * (current - readout.drive_current) * _duty(readout, len(coils))
    supply = None if readout.supply_current is None else readout.supply_current + more
    settings = replace(
        readout,
        drive_code=max(codes),
        drive_codes=codes if len(set(codes)) > 1 else (),
        drive_current=current,
        supply_current=supply,
    )
    ratios = [converter.drive_current(code) / readout.drive_current for code in codes]
    return tuple(_with_drive(coil, ratio) for coil, ratio in zip(coils, ratios, strict=True)), settings


def drive_codes(swings: Sequence[Swing], converter: Converter) -> tuple[int, ...]:
    """The code of every channel: the same one unless only codes of their own keep all coils within 1.2 to 1.8 V."""
    low = converter.limit("amplitude_optimum_min")
    common = converter.drive_code(max(swing.careful for swing in swings))
    own = tuple(converter.drive_code(swing.careful) for swing in swings)
    alike = (common,) * len(swings)
    if min(_least(alike, swings, converter)) >= low or min(_least(own, swings, converter)) < low:
        return alike
    return own


def _least(codes: Sequence[int], swings: Sequence[Swing], converter: Converter) -> list[float]:
    return [converter.amplitude(swing.least, code) for code, swing in zip(codes, swings, strict=True)]


def _swing(coil: CoilEstimate) -> Swing:
    states = [state for name, state in coil.states.items() if name != FREE] or list(coil.states.values())
    values = [state.parallel_resistance for state in states]
    return Swing(min(values), max(values), max(_careful(state) for state in states))


def _careful(state: StateEstimate) -> float:
    spread = state.spread
    more = max(SIGMAS_BELOW * spread.parallel_resistance, spread.thickest_copper) if spread is not None else 0.0
    return state.parallel_resistance + more


def bare_board_code(bench: Estimates) -> int | None:
    """The strongest drive code that keeps every coil alone, without target and jaw, one sigma below 1.8 V; None where
    no coil's free state has a parallel resistance.
    """
    bare = [_careful(coil.states[FREE]) for coil in bench.coils if FREE in coil.states]
    known = [value for value in bare if math.isfinite(value)]
    return bench.readout.device.drive_code(max(known)) if known else None


def _duty(readout: ReadoutEstimate, coils: int) -> float:
    """The share of the time in which a channel is driven: not while the next is switched in."""
    if coils == 1 or not readout.dwell_time or readout.switch_time is None:
        return 1.0
    return 1.0 - readout.switch_time / readout.dwell_time


def _with_drive(coil: CoilEstimate, ratio: float) -> CoilEstimate:
    """The coil with a drive current so many times as strong."""
    return replace(coil, states={name: _louder(state, ratio) for name, state in coil.states.items()})


def _louder(state: StateEstimate, ratio: float) -> StateEstimate:
    """A state whose amplitudes are so many times as large."""
    spread = state.spread
    return replace(
        state,
        amplitude=state.amplitude * ratio,
        coil_amplitude=None if state.coil_amplitude is None else state.coil_amplitude * ratio,
        spread=None if spread is None else replace(spread, amplitude=spread.amplitude * ratio),
    )
