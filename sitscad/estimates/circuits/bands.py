"""Frequency bands of faultless boards, by which driver, self-test and test bench accept a coil."""

from __future__ import annotations

import math

from sitscad.assembly.places.state import FREE, PRESSED, REST
from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import CoilEstimate, StateEstimate
from sitscad.estimates.tolerances.scatter import CAPACITOR

SIGMAS = 5.0  # Half width of a band, in standard deviations of manufacture: one sound coil in two million lies outside

LEAP = 8.0
"""Largest difference between two readings of a faultless coil at rest, in standard deviations of one reading.

Fewer than one in 1e7 pairs of readings differ by more.
"""

STATUS = ("good", "stale", "under range", "over range", "watchdog", "out of band", "amplitude")
"""Status texts of a coil's reading, in the order of the driver's numbers. The last is a warning."""


@record
class Band:
    """Frequency (Hz) of the design, and the lowest and highest frequency (Hz) of manufactured coils."""

    design: float
    low: float
    high: float

    def share_above(self, limit: float) -> float:
        """Return the fraction of units with a frequency above a limit (Hz), for a normal distribution."""
        return 0.5 * math.erfc((limit - self.design) * SIGMAS / ((self.high - self.design) * math.sqrt(2.0)))


@record
class CoilBands:
    """Frequency bands of one coil: of the bare board, of the assembled sensor at rest, and of all states and loads.

    `working` covers loads up to 1.5 times the required force. `own_sigma` (Hz) is the part of the scatter that is
    independent for each coil of a board.
    """

    coil: str
    bare: Band
    assembled: Band
    working: Band
    own_sigma: float


def bands(coils: tuple[CoilEstimate, ...], own_inductance: float) -> tuple[CoilBands, ...]:
    """Return the bands of every coil.

    `own_inductance` is the relative standard deviation between the inductances of coils on one board. Raises ValueError
    if a coil lacks a state, or if its scatter is unknown.
    """
    coil_bands = []
    for coil in coils:
        states = coil.states
        if not states:
            raise ValueError(f"no state of {coil.name} is known: there is no frequency to test it by")
        each = {name: _band(coil.name, state) for name, state in states.items()}
        first, last = next(iter(states)), list(states)[-1]
        free_band, assembled = each.get(FREE, each[first]), each.get(REST, each[last])
        rest, pressed = states.get(REST), states.get(PRESSED)
        beyond = 0.5 * (pressed.frequency - rest.frequency) if rest is not None and pressed is not None else 0.0
        low, high = min(band.low for band in each.values()), max(band.high for band in each.values())
        working = Band(assembled.design, low + min(beyond, 0.0), high + max(beyond, 0.0))
        state_sigma = states.get(REST, states[last]).spread
        capacitor = state_sigma.shifts.get(CAPACITOR, (0.0, 0.0))[1] if state_sigma is not None else 0.0
        frequency_sigma = math.hypot(capacitor, 0.5 * own_inductance * assembled.design)
        coil_bands.append(CoilBands(coil.name, free_band, assembled, working, frequency_sigma))
    return tuple(coil_bands)


def _band(coil: str, state: StateEstimate) -> Band:
    if state.spread is None:
        raise ValueError(f"the scatter of {coil} is not known: there is no band to test it by")
    width = SIGMAS * state.spread.frequency
    return Band(state.frequency, state.frequency - width, state.frequency + width)
