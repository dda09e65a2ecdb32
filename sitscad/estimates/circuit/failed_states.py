"""States of a coil without numbers, and why: the model of the metal fails there, or the tank does not oscillate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from sitscad.estimates.circuit.tank import CoilCircuit, Tank
from sitscad.scene.state import FREE
from sitscad.units import show

LEAST_SHARE = 0.02
"""Share of the free inductance below which a state's is not believed: the half-space model takes away too much."""

PROBE = 5e6
"""Frequency (Hz) at which a state's inductance is tried."""

UNRESOLVED = (
    "no numbers for this state: the current within the tracks cannot be resolved, for they are far nearer to each "
    "other than they are thick or wide"
)
"""Why a state has no numbers where `ProximityLoss.is_resolved` is not."""


def working(circuits: list[CoilCircuit]) -> tuple[list[CoilCircuit], dict[str, str]]:
    """The circuits without the states in which the model fails, and why each of those is missing."""
    failed: dict[str, str] = {}
    for circuit in circuits:
        free = circuit.terminal(FREE, PROBE)[0]
        for state in circuit.reflections:
            inductance, resistance = circuit.terminal(state, PROBE)
            if not circuit.loss.is_resolved(PROBE):
                failed[state] = UNRESOLVED
            elif state == FREE and not (inductance > 0.0 and resistance > 0.0):
                failed[state] = (
                    f"no numbers for this state: {show(inductance, 'H', 3)} and {show(resistance, 'ohm', 3)} come out, "
                    "which no coil has"
                )
            elif not (inductance > LEAST_SHARE * free and resistance > 0.0):
                failed[state] = (
                    f"no numbers for this state: the half-space model fails there (it takes {show(free, 'H', 3)} down "
                    f"to {show(inductance, 'H', 3)}); the metal is too near for so small a coil"
                )
    return [without(circuit, failed) for circuit in circuits], failed


def without(circuit: CoilCircuit, failed: Mapping[str, object]) -> CoilCircuit:
    """A circuit without the states that have failed."""
    return replace(
        circuit,
        reflections={state: r for state, r in circuit.reflections.items() if state not in failed},
        neighbours={state: r for state, r in circuit.neighbours.items() if state not in failed},
    )


def overdamped(circuits: list[CoilCircuit], tank: Tank) -> dict[str, float]:
    """The states in which some coil's tank does not oscillate, and its quality factor."""
    found: dict[str, float] = {}
    for circuit in circuits:
        for state in circuit.reflections:
            at = tank.oscillation(circuit, state)
            if not at.exists:
                found[state] = min(found.get(state, math.inf), at.quality_factor)
    return found


def damped_words(quality: float, capacitor: float) -> str:
    """Why an overdamped state has no numbers: quality factor and tank capacitor (F)."""
    return (
        f"no numbers for this state: overdamped: Q {quality:.2g}; with {show(capacitor, 'F', 3)} the tank does not "
        "oscillate"
    )
