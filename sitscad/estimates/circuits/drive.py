"""Drive current: one code for all coils if possible, otherwise a code for each channel, with manufacturing margins."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.assembly.places.state import FREE, working_states
from sitscad.basics.record import record, replace
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate, StateEstimate
from sitscad.kernels.converters.converter import Converter
from sitscad.spec.sensor import ReadoutSpec

SIGMAS_BELOW = 1.0
"""Margin below the largest permitted amplitude, in standard deviations of the coil's parallel resistance.

TI recommends the strongest drive code below the largest amplitude, since clamping is worse than noise (8.1.5; SNOA950).
This advice is for one known sensor. The margin is for sensors still to be made.
"""


@record
class Swing:
    """Range of R_P (ohm) of a coil in its working states: the least, and the largest with its margin."""

    least: float
    careful: float


def driven(
    coils: Sequence[CoilEstimate], readout: ReadoutEstimate, spec: ReadoutSpec
) -> tuple[tuple[CoilEstimate, ...], ReadoutEstimate]:
    """Return coils and readout settings with the drive codes: the spec's code, or the strongest suitable code.

    A suitable code keeps each coil below the largest amplitude in each working state. The margin is one sigma and the
    thickest copper that the fabricator delivers. All coils of a board share one foil and one plating, and no test of
    the board shows their thickness. Channels have separate codes only if a common code leaves a coil below the
    low-noise window and separate codes leave none below it.
    """
    if readout.drive_code is None or readout.high_current:
        return tuple(coils), readout
    converter = spec.device
    if spec.drive_code is not None:
        codes = (spec.drive_code,) * len(coils)
    else:
        by_coil = [[c.states[name] for name in working_states(c.states)] for c in coils]
        swings = [Swing(min(state.parallel_resistance for state in states), max(map(_careful, states)))
                  for states in by_coil]
        codes = drive_codes(swings, converter)
    current, conversion = converter.drive_current(max(codes)), readout.conversion
    settings = replace(
        readout,
        drive_code=max(codes),
        drive_codes=codes if len(set(codes)) > 1 else (),
        drive_current=current,
        supply_current=(None if conversion is None
                        else converter.needed(len(coils)) * conversion.supply_current(current)),
    )
    louder = []
    for coil, code in zip(coils, codes, strict=True):
        ratio = converter.drive_current(code) / readout.drive_current
        states = {name: replace(
            state,
            amplitude=state.amplitude * ratio,
            coil_amplitude=None if state.coil_amplitude is None else state.coil_amplitude * ratio,
            spread=None if state.spread is None else replace(state.spread, amplitude=state.spread.amplitude * ratio),
        ) for name, state in coil.states.items()}
        louder.append(replace(coil, states=states))
    return tuple(louder), settings


def drive_codes(swings: Sequence[Swing], converter: Converter) -> tuple[int, ...]:
    """Return the drive code of every channel.

    Codes are equal, unless only separate codes bring the amplitudes of all coils above the lower end of the low-noise
    window.
    """

    def reached(codes: Sequence[int]) -> bool:
        return all(converter.amplitude(swing.least, code) >= converter.limit("amplitude_optimum_min")
                   for code, swing in zip(codes, swings, strict=True))

    shared_codes = (converter.drive_code(max(swing.careful for swing in swings)),) * len(swings)
    channel_codes = tuple(converter.drive_code(swing.careful) for swing in swings)
    return channel_codes if reached(channel_codes) and not reached(shared_codes) else shared_codes


def _careful(state: StateEstimate) -> float:
    sigma = state.spread
    more = max(SIGMAS_BELOW * sigma.parallel_resistance, sigma.thickest_copper) if sigma is not None else 0.0
    return state.parallel_resistance + more


def bare_board_code(coils: Sequence[CoilEstimate], converter: Converter) -> int | None:
    """Return the strongest drive code for every coil without target and jaw.

    It keeps each coil one sigma below the largest amplitude. None if no coil's free state has a parallel resistance.
    """
    resistances = [_careful(coil.states[FREE]) for coil in coils if FREE in coil.states]
    finite = [value for value in resistances if math.isfinite(value)]
    return converter.drive_code(max(finite)) if finite else None
