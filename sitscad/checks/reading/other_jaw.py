"""SIT221: the effect of the other jaw's metal on the coils when the jaws close, against the sensor's own signal."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.finding import Severity
from sitscad.checks.rules import Rule, Verdict, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design

MUCH, LITTLE = 0.1, 0.01
"""Least ratios for a warning and for a note.

Both divide a coil's change by the other jaw's metal by its change by the required force. The warning is for closed jaws
with an object of thickness `THIN` between them, the note for jaws with nothing between them.
"""

THIN = 1e-3  # Thickness (m) of a thin grasped object, at which the metal's effect is checked


def other_jaw_metal(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the coil with the largest ratio of the other jaw's effect to the signal.

    The effect is the change by the other jaw's metal when the jaws close. The signal is the change by the required
    force.
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
    from sitscad.estimates.states.other_jaw import estimated_change  # imported only for jaws

    near, closed = (estimated_change(weakest.layout, weakest.estimates, grasped) for grasped in (THIN, 0.0))
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


RULES: tuple[Rule, ...] = (rule_of("SIT221", other_jaw_metal, "target", "jaw", much=f"{100.0 * MUCH:.0f} %"),)
