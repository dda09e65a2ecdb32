"""Every coil as a circuit: its winding near metal, with leads and idle neighbouring coils.

The module also finds states without values, and the reason: the model of the metal fails, or the tank does not
oscillate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from itertools import product
from typing import Protocol

import numpy as np

from sitscad.assembly.places.state import FREE
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import replace
from sitscad.basics.units import show
from sitscad.estimates.circuits.solved_winding import SolvedWinding
from sitscad.estimates.circuits.tank import CoilCircuit, Tank, terminal_impedances
from sitscad.estimates.targets.assembly import AssemblyStates, Reflection, SolvedReflection, Surroundings, metal_behind
from sitscad.estimates.targets.finite_target import FREQUENCY, TargetRatios
from sitscad.estimates.targets.window import WindowedReflection, WindowEffect, window_effects
from sitscad.estimates.windings.leads import NO_LEADS, estimate_leads, sketched_leads, with_lead_around_winding
from sitscad.estimates.windings.losses import winding_resistance
from sitscad.estimates.windings.neighbours import Circuit, idle_neighbour_effect
from sitscad.estimates.windings.own_capacitance import self_capacitance
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.layout.board import Coil, Layout
from sitscad.spec.sensor import ReadoutSpec


class SolvedEffect(Protocol):
    """Effect of a target on the coils by the field solution, with the members that circuits use.

    `states.solved_target.SolvedStates` implements it.
    """

    @property
    def totals(self) -> Mapping[str, ComplexArray]:
        """Changes of the bare windings' inductance matrix, by state: (2 frequencies, coils, coils; H, complex)."""

    @property
    def errors(self) -> Mapping[str, Array]:
        """Signed error bounds of each coil's inductance change (H) and loss (ohm), by state: (coils, 2)."""

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency (Hz) at which the target's eddy currents are computed."""

    @property
    def interpolation_spectrum(self) -> Callable[[Array], ComplexArray]:
        """Function of frequency (Hz) by which changes are interpolated: reflection factor of an infinite sheet."""

    def cache_key(self, number: int, coil: str, state: str) -> tuple[complex, ...]:
        """Return a cache key for coil `number` from 0, equal for coils whose inductances change equally in a state."""

    def crowding_function(self, state: str, number: int) -> Callable[[Array], ComplexArray]:
        """Return a function of frequency (Hz): the inductance change that current crowding adds, for coil `number`.

        It is a fraction of the coil's change by the target for current that is even across the tracks.
        """

    def store_target_oscillations(self, circuits: Sequence[CoilCircuit], tank: Tank) -> None:
        """Compute the tanks' oscillations in all states with a target, and store them in the circuits."""


LEAST_SHARE = 0.02
"""Least accepted inductance of a coil in a state, divided by its inductance in free air.

Below this ratio, the half-space model of the metal overestimates the reduction, and the state has no values.
"""

PROBE = 5e6  # Frequency (Hz) at which a state's inductance is tested

UNRESOLVED = (
    "no numbers for this state: the current within the tracks cannot be resolved, for they are far nearer to each "
    "other than they are thick or wide"
)
"""Reason for a state without values if the tracks lie too close together (`ProximityLoss.is_resolved` is False)."""


def without_failed_states(circuits: list[CoilCircuit]) -> tuple[list[CoilCircuit], dict[str, str]]:
    """Return the circuits without the states in which the model fails, and the reasons by state."""
    failed: dict[str, str] = {}
    states = list(circuits[0].reflections)
    impedances = terminal_impedances(circuits, states, np.full((len(circuits), len(states), 1), PROBE))
    each = zip(*(part.ravel().tolist() for part in impedances), strict=True)
    values = dict(zip(product([circuit.name for circuit in circuits], states), each, strict=True))
    for circuit in circuits:
        free = values[circuit.name, FREE][0]
        for state in circuit.reflections:
            inductance, resistance = values[circuit.name, state]
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
    return [drop_states(circuit, failed) for circuit in circuits], failed


def drop_states(circuit: CoilCircuit, failed: Mapping[str, object]) -> CoilCircuit:
    """Return a circuit without the states in `failed`."""
    return replace(
        circuit, reflections={state: r for state, r in circuit.reflections.items() if state not in failed},
        neighbours={state: r for state, r in circuit.neighbours.items() if state not in failed},
    )


def overdamped_states(circuits: list[CoilCircuit], tank: Tank, target: TargetRatios | SolvedEffect) -> dict[str, float]:
    """Return the least quality factor of all coils, for each state in which a coil's tank does not oscillate."""
    quality_factors: dict[str, float] = {}
    tank.store_oscillations(circuits)
    if not isinstance(target, TargetRatios):
        target.store_target_oscillations(circuits, tank)
    for circuit in circuits:
        for state in circuit.reflections:
            at = tank.oscillation(circuit, state)
            if not at.exists:
                quality_factors[state] = min(quality_factors.get(state, math.inf), at.quality_factor)
    return quality_factors


def coil_circuits(
    layout: Layout, winding: SolvedWinding, matrix: Array, assembly: AssemblyStates,
    target: TargetRatios | SolvedEffect,
) -> list[CoilCircuit]:
    """Return the circuits of all coils, in the order of the coils.

    `matrix` (coils, coils; H) holds the inductances of the bare windings. `target` is the target's effect: the field
    solution, or correction ratios of an infinite plate.
    """
    spec, first = layout.spec, layout.coils[0]
    conductivity, loss = winding.conductivity, winding.loss
    if winding.is_rough:  # leaves out bends and corners
        resistance = math.fsum(w.path.length / (conductivity * spec.coil.trace_width * w.thickness)
                               for w in first.windings)
    else:
        resistance = winding_resistance(spec.coil, first, conductivity)
    self_capacity = self_capacitance(first, spec.coil, spec.fpc.stackup, winding.is_rough)
    distances = _distances(layout.coils)
    beside = [] if winding.is_rough else sorted({d for row in distances for d in row if d > 0.0})
    reflections = _reflections(winding, assembly, beside, layout, target)
    circuits = []
    for coil in layout.coils:
        leads = NO_LEADS
        if coil.series:
            leads = _led_out(coil, spec.fpc.stackup, conductivity)
        elif coil.undrawn:
            leads = _led_roughly(coil.undrawn, spec.fpc.stackup, conductivity)
        if coil.undrawn:
            width, copper = coil.undrawn[0].width, spec.fpc.stackup.copper[coil.undrawn[0].layers[0] - 1]
            leads = with_lead_around_winding(leads, coil.goes_on, width, copper, conductivity, winding.spirals)
        circuits.append(CoilCircuit(coil.name, winding.inductance, resistance, conductivity, loss, leads,
                                    self_capacity + leads.capacitance, reflections[coil.name], self_capacity))
    if len(circuits) == 1 or winding.is_rough:  # the effect of idle neighbours is below the errors of screening
        return circuits
    return [
        replace(circuit, neighbours=_neighbour_effects(k, circuits, matrix, distances, spec.readout))
        for k, circuit in enumerate(circuits)
    ]


def _neighbour_effects(
    active: int, circuits: list[CoilCircuit], matrix: Array, distances: list[list[float]], readout: ReadoutSpec
) -> dict[str, Circuit]:
    """Return the effect of idle neighbouring coils on coil number `active`, by state.

    The state "free" is left out, because no other coils are near in this state. `distances` (m) are between the centres
    of coils. `matrix` (coils, coils; H) holds the inductances of the bare windings.
    """
    idle_changes = {}
    for state, reflection in circuits[active].reflections.items():
        if state == FREE:
            continue

        def mutual(i: int, j: int, frequencies: Array, metal: Reflection = reflection) -> ComplexArray:
            return np.asarray(matrix[i, j] + metal.mutual((i, j), distances[i][j], frequencies))

        self_impedances = [partial(circuit.impedance_with_open_neighbours, state) for circuit in circuits]
        idle_changes[state] = idle_neighbour_effect(active, self_impedances, mutual, readout)
    return idle_changes


def _distances(coils: tuple[Coil, ...]) -> list[list[float]]:
    # Equal distances get equal numbers, so that each reflection is computed once.
    return [[round(math.dist(a.centre, b.centre), 9) for b in coils] for a in coils]


def _reflections(
    winding: SolvedWinding, assembly: AssemblyStates, distances: list[float], layout: Layout,
    target: TargetRatios | SolvedEffect,
) -> dict[str, dict[str, Reflection]]:
    """Return the inductance changes by metal: a `Reflection` for each coil name and state.

    They include the effect of a window in the jaw. Coils for which target and window have equal effects share one
    `Reflection`. `distances` (m) are the distances between the coils' centres.
    """
    missing, without = window_effects(layout), metal_behind(layout.spec, without_jaw=True)
    solved_reflections: dict[tuple[str, tuple[complex, ...], WindowEffect | None], Reflection] = {}
    by_coil: dict[str, dict[str, Reflection]] = {coil.name: {} for coil in layout.coils}
    for around in assembly.states:
        for k, name in enumerate(by_coil):
            window = missing.get(name)
            key = around.name, target.cache_key(k, name, around.name), window
            if key not in solved_reflections:
                solved_reflections[key] = _reflection(around, distances, winding, target, k, name, window)
                if around.below is not None and window is not None:
                    whole, none = (
                        Reflection(winding.spectrum, replace(around, above=None, below=below), distances,
                                   crowding=winding.crowding)
                        for below in (around.below, without)
                    )
                    solved_reflections[key] = WindowedReflection(solved_reflections[key], whole, none, window)
            by_coil[name][around.name] = solved_reflections[key]
    return by_coil


def _reflection(
    around: Surroundings, distances: list[float], winding: SolvedWinding, target: TargetRatios | SolvedEffect,
    number: int, name: str, missing: WindowEffect | None,
) -> Reflection:
    spectrum = winding.spectrum
    if not isinstance(target, TargetRatios) and around.name in target.totals:
        more, lost = target.errors[around.name][number]
        solved = np.array(target.band), target.totals[around.name], target.interpolation_spectrum
        return SolvedReflection(spectrum, around, distances, winding.crowding, solved, number,
                                (float(more), float(lost)), target.crowding_function(around.name, number))
    share, unsure = (1.0, 1.0), (0.0, 0.0, 0.0)
    if isinstance(target, TargetRatios) and around.above is not None:
        share = target.ratios_for(name, around.name)
        unsure = target.error, target.loss_error, FAINT * winding.inductance * bool(target.error)
        if missing is not None:
            endless = Reflection(spectrum, around, distances).infinite_plate_change(FREQUENCY).real
            more = float(missing.target_factor(np.array(share[0] * endless)))
            share = share[0] * more, share[1] * more
            unsure = unsure[0] + missing.growth_error, unsure[1] + missing.growth_error, unsure[2]
    return Reflection(spectrum, around, distances, share, winding.crowding, unsure, winding.is_rough)


FAINT = 0.0015
"""Additional error bound of a target's inductance change that is computed with correction ratios.

It is a fraction of the coil's inductance in free air, and is added to the errors of the ratios. It dominates if the
target has almost no effect.
"""


_led_out, _led_roughly = lru_cache(maxsize=64)(estimate_leads), lru_cache(maxsize=64)(sketched_leads)


def self_resonance(circuit: CoilCircuit) -> float:
    """Return the frequency (Hz) at which winding and leads resonate with their own capacitance alone."""
    inductance = circuit.inductance + circuit.leads.inductance
    return resonance_frequency(inductance, max(circuit.self_capacitance, 1e-16))
