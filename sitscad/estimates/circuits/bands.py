"""The frequencies that sound boards of a design have, by which driver, self-test and bench take a coil for good."""

from __future__ import annotations

import math

from sitscad.assembly.places.state import FREE, PRESSED, REST
from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import CoilEstimate, StateEstimate
from sitscad.estimates.tolerances.scatter import CAPACITOR

SIGMAS = 5.0  # Half width of a band, in standard deviations of manufacture: one sound coil in two million lies outside

LEAP = 8.0
"""By how many standard deviations of a reading two of them may differ at rest: not one in 1e7 differs by more."""

STATUS = ("good", "stale", "under range", "over range", "watchdog", "out of band", "amplitude")
"""What is said of a coil's reading, in the order of the driver's numbers; the last is a warning."""


@record
class Band:
    """A frequency (Hz) of the design, and the lowest and highest that manufacture makes of it."""

    design: float
    low: float
    high: float

    def share_above(self, limit: float) -> float:
        """The part of what manufacture makes, normally distributed, whose frequency is above a limit (Hz)."""
        return 0.5 * math.erfc((limit - self.design) * SIGMAS / ((self.high - self.design) * math.sqrt(2.0)))


@record
class CoilBands:
    """Bands of one coil: of the bare board, assembled at rest, and of all states and loads together, where the force
    that is required may be exceeded by half. `own_sigma` (Hz) is the scatter that it has in common with no other coil.
    """

    coil: str
    bare: Band
    assembled: Band
    working: Band
    own_sigma: float


def bands(coils: tuple[CoilEstimate, ...], own_inductance: float) -> tuple[CoilBands, ...]:
    """The bands of every coil. `own_inductance` is one sigma of what a coil's inductance differs by from the others of
    its board, relative. Raises ValueError where a coil has no state, or its scatter is not known.
    """
    found = []
    for coil in coils:
        states = coil.states
        if not states:
            raise ValueError(f"no state of {coil.name} is known: there is no frequency to test it by")
        each = {name: _band(coil.name, state) for name, state in states.items()}
        first, last = next(iter(states)), list(states)[-1]
        bare, assembled = each.get(FREE, each[first]), each.get(REST, each[last])
        rest, pressed = states.get(REST), states.get(PRESSED)
        beyond = 0.5 * (pressed.frequency - rest.frequency) if rest is not None and pressed is not None else 0.0
        low, high = min(one.low for one in each.values()), max(one.high for one in each.values())
        working = Band(assembled.design, low + min(beyond, 0.0), high + max(beyond, 0.0))
        spread = states.get(REST, states[last]).spread
        capacitor = spread.shifts.get(CAPACITOR, (0.0, 0.0))[1] if spread is not None else 0.0
        own = math.hypot(capacitor, 0.5 * own_inductance * assembled.design)
        found.append(CoilBands(coil.name, bare, assembled, working, own))
    return tuple(found)


def _band(coil: str, state: StateEstimate) -> Band:
    if state.spread is None:
        raise ValueError(f"the scatter of {coil} is not known: there is no band to test it by")
    width = SIGMAS * state.spread.frequency
    return Band(state.frequency, state.frequency - width, state.frequency + width)
