"""From a layout to its numbers, step by step: each is a frozen value made of the one before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sitscad.assembly.places.state import FREE, PRESSED, REST
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.estimates.circuits.coils import coil_circuits, overdamped, self_resonance, without, working
from sitscad.estimates.circuits.drive import driven
from sitscad.estimates.circuits.solved_winding import beside_each_other, solve_winding
from sitscad.estimates.circuits.tank import (
    CoilCircuit,
    Tank,
    choose_capacitor,
    settle,
    state_estimates,
    with_margin,
    with_steps,
)
from sitscad.estimates.circuits.uncertainty import (
    depths_moved,
    direct_resistance_sigma,
    moved_by_surroundings,
    scatter_note,
    sigmas,
    slopes_of,
    spread,
    track_moves,
)
from sitscad.estimates.circuits.wound import Wound
from sitscad.estimates.coil_estimates import (
    METER_FREQUENCY,
    PARTS,
    CoilEstimate,
    Estimates,
    Metered,
    ReadoutEstimate,
    StateEstimate,
)
from sitscad.estimates.loads.pressing import GLUE, PAD
from sitscad.estimates.targets.assembly import assemble, warmed
from sitscad.estimates.targets.finite_target import NO_SHARES, TargetShares, target_shares
from sitscad.estimates.windings.leads import missing_leads
from sitscad.estimates.windings.losses import is_rough, near_metal_notes
from sitscad.estimates.windings.methods import cross_checks, no_cross_check
from sitscad.estimates.windings.own_capacitance import metal_notes
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.kernels.electromagnetics.resonator import apparent_inductance
from sitscad.layout.board import Coil, Layout
from sitscad.spec.places import gathered

if TYPE_CHECKING:
    from sitscad.estimates.states.solved_target import SolvedStates


@record(eq=False)
class Tuned:
    """Every coil as a circuit, the chosen tank and how the converter is set.

    `target` is the target's effect: solved, or by shares of an endless plate's. `failed` are the states without
    numbers, with the reason. `damped` are those whose tank does not oscillate, with their quality factor.
    """

    wound: Wound
    target: TargetShares | SolvedStates
    circuits: Sequence[CoilCircuit]
    tank: Tank
    readout: ReadoutEstimate
    failed: Mapping[str, str]
    damped: Mapping[str, float]


def wind(
    layout: Layout, temperature: float | None = None, method: str | None = None, tolerance: float | None = None
) -> Wound:
    """Solve the windings by themselves and beside each other; at the spec's temperature where None is given, roughly
    for a tolerance that is for screening.
    """
    temperature = layout.spec.requirements.temperature if temperature is None else temperature
    rough, coils = is_rough(tolerance), layout.coils
    spec = warmed(layout.spec, temperature)
    assembly = assemble(spec, sigmas(spec), rough)
    winding = solve_winding(spec.coil, coils[0], assembly, conductivity_at(temperature), method, tolerance)
    matrix, errors = beside_each_other(spec.coil, coils, winding, rough)
    return Wound(replace(layout, spec=spec), temperature, assembly, winding, matrix, errors, method, tolerance)


def tune(wound: Wound, target: TargetShares | SolvedStates) -> Tuned:
    """Circuits, tank capacitor, and the converter's settings; states that have no numbers are left out."""
    readout = wound.spec.readout
    circuits, failed = working(coil_circuits(
        wound.layout, wound.winding, wound.matrix, wound.assembly, target))
    capacitor, reason = choose_capacitor(circuits, readout, min(map(self_resonance, circuits)), wound.winding.is_rough)
    tank = Tank(capacitor, readout)
    damped = overdamped(circuits, tank, target)
    failed |= wound.assembly.refused
    failed |= {
        state: f"no numbers for this state: overdamped: Q {quality:.2g}; with {show(capacitor, 'F', 3)} the tank does "
               "not oscillate" for state, quality in damped.items()
    }
    swinging = [without(circuit, damped) for circuit in circuits]
    return Tuned(wound, target, swinging, tank, settle(swinging, readout, capacitor, reason), failed, damped)


def with_target(wound: Wound, is_solved: bool | None = None) -> Tuned:
    """Circuits and tank with the target's effect solved, as in a response.

    It is by shares of an endless plate's effect in screening, for targets that are too large to solve in a second or
    two, and if `is_solved` is False.
    """
    if wound.winding.is_rough or not wound.has_target or is_solved is False:
        return tune(wound, _shares(wound))
    # where about the tanks run is enough for the frequencies to solve at
    tuned = tune(replace(wound, winding=replace(wound.winding, crowding=None, is_rough=True)), _shares(wound, True))
    from sitscad.estimates.states.solved_target import is_affordable, solve_states  # a solver, loaded for nothing else

    for _ in range(TRIES):
        found = [tuned.tank.oscillation(c, state).frequency for c in tuned.circuits for state in c.reflections]
        low, high = (0.0, 0.0) if isinstance(tuned.target, TargetShares) else tuned.target.band
        if not found or low <= min(found) <= max(found) <= high:
            break
        band = BAND[0] * min(found), BAND[1] * max(found)
        if is_solved is None and not is_affordable(wound, band):
            return tune(wound, _shares(wound))
        tuned = tune(wound, solve_states(wound, band))
    return tune(wound, _shares(wound)) if isinstance(tuned.target, TargetShares) else tuned


def _shares(wound: Wound, is_rough: bool = False) -> TargetShares:
    """Shares of an endless plate's effect that the target has."""
    heights, rough = [layer.z for layer in wound.layout.coils[0].windings], is_rough or wound.winding.is_rough
    return target_shares(gathered(wound.spec), heights, wound.assembly.states, rough)


BAND = 0.9, 1.15
"""Frequencies between which the target is solved, as for a response: this part of the lowest and of the highest that
any state has.
"""

TRIES = 3  # How often it is solved at most: with another capacitor the tank runs elsewhere


def read(tuned: Tuned) -> Estimates:
    """Every coil in every state as the converter sees it, each with one sigma, the drive that keeps its margin, and
    what is worth saying about the numbers.
    """
    wound, states = tuned.wound, _states(tuned)
    spec, assembly, rough = wound.spec, wound.assembly, wound.winding.is_rough
    found = [_coil_estimate(coil, circuit, tuned, states[coil.name])
             for coil, circuit in zip(wound.layout.coils, tuned.circuits, strict=True)]
    readout = with_margin(tuned.readout, found)
    coils, readout = driven([with_steps(coil, tuned.tank, readout) for coil in found], readout, spec.readout)
    if spec.web is not None and assembly.compression is not None:
        from sitscad.estimates.states.cells import press_shares  # a solver, loaded for nothing else

        shares = press_shares(wound.layout, max(coil.sensor_frequency for coil in coils), rough)
        coils = tuple(replace(coil, press_share=share) for coil, share in zip(coils, shares, strict=True))
    gap_sigmas, deviations = {}, sigmas(spec)
    if spec.elastomer is not None and spec.target is not None:  # the glue below the target in all
        gap_sigmas[REST] = math.hypot(deviations[PAD], deviations[GLUE])
        gap_sigmas |= {name: math.hypot(scatter.gap, deviations[GLUE]) for name, scatter in assembly.scatters.items()}
    checks = () if rough else cross_checks(coils[0].name, wound.winding.geometry, wound.winding.inductance)
    return Estimates(
        coils=coils,
        inductance_matrix=tuple(map(tuple, wound.matrix.tolist())),
        readout=readout,
        inductance_matrix_error=tuple(map(tuple, wound.matrix_errors.tolist())),
        compression=assembly.compression,
        compression_scatter=assembly.scatters.get(PRESSED),
        gaps=assembly.gaps,
        gap_sigmas=gap_sigmas,
        cross_checks=checks,
        no_cross_check=None if rough else no_cross_check(spec.coil, checks),
        incomplete=missing_leads(wound.layout.coils),
        notes=() if rough else tuple(_notes(tuned, coils[0])),
        normal_force=spec.requirements.normal_force,
        temperature=wound.temperature,
        states=tuple(replace(around.state, temperature=wound.temperature) for around in assembly.states),
        target_band=None if isinstance(tuned.target, TargetShares) else tuned.target.band,
        is_rough=rough,
    )


def _notes(tuned: Tuned, coil: CoilEstimate) -> Iterator[str]:
    """What whoever reads the numbers has to know, of the design and of the first of its alike coils."""
    wound = tuned.wound
    layout, spec, assembly = wound.layout, wound.spec, wound.assembly
    if incomplete := missing_leads(layout.coils):
        yield incomplete
    if isinstance(tuned.target, TargetShares) and tuned.target.shares:
        yield from (TOO_LARGE, *tuned.target.notes)
    yield from assembly.notes
    yield from near_metal_notes(spec.coil, wound.winding.nearest)
    yield from metal_notes(layout.coils[0], spec, assembly.gaps, coil.self_capacitance, coil.capacitance)
    yield from (f"{name}: {reason}" for name, reason in tuned.failed.items())
    yield scatter_note(spec)


TOO_LARGE = (
    "the target is too large, too thin or too magnetic to be solved for the states within a second or two: shares of "
    "an endless plate's effect serve, and `response` solves it, or names why not"
)


def _states(tuned: Tuned) -> dict[str, dict[str, StateEstimate]]:
    """By coil and state, each with its one sigma."""
    wound, tank = tuned.wound, tuned.tank
    layout, spec, winding = wound.layout, wound.spec, wound.winding
    deviations = sigmas(spec)
    deeper = depths_moved(layout.coils[0], spec.fpc.stackup, deviations)
    found: dict[str, dict[str, StateEstimate]] = {}
    alike: dict[tuple[int, ...], str] = {}
    moves: dict[str, Mapping[str, Mapping[str, tuple[float, float]]]] = {}
    for circuit in tuned.circuits:
        states = state_estimates(circuit, tank, tuned.readout)
        first = alike.setdefault(tuple(map(id, circuit.reflections.values())), circuit.name)
        known = found.get(first)
        if winding.is_rough and known is not None:  # they differ by their leads alone
            found[circuit.name] = {
                name: replace(state, spread=known[name].spread, resistance_error=known[name].resistance_error,
                              target_change=known[name].target_change,
                              target_change_error=known[name].target_change_error)
                for name, state in states.items()
            }
            continue
        if first not in moves:  # with leads of other lengths a tank runs a per cent beside: alike to a sigma
            moves[first] = moved_by_surroundings(
                winding.spectrum, wound.assembly, states, circuit, deeper, winding.is_rough)
        moved = slopes_of(spec, layout.coils[0], winding, moves[first])
        for name, state in states.items():
            reflection, change, error = circuit.reflections[name], None, None
            if by_target := reflection.target_change(state.frequency).real:
                change = by_target
                least = max(abs(change), LEAST_CHANGE * circuit.inductance)
                error = abs(reflection.unsure(state.frequency)[0]) / least
            states[name] = replace(state, spread=spread(circuit, tank, state, moved),
                                   resistance_error=winding.resistance_error(circuit, state, spec.coil),
                                   target_change=change, target_change_error=error)
        found[circuit.name] = states
    return found


LEAST_CHANGE = 0.01  # Of the free winding's inductance: errors of smaller changes are relative to that


def _coil_estimate(coil: Coil, circuit: CoilCircuit, tuned: Tuned, states: Mapping[str, StateEstimate]) -> CoilEstimate:
    """One coil's numbers in one record."""
    free, winding = states.get(FREE, NO_STATE), tuned.wound.winding
    parts = {"winding": circuit.inductance, "bends": circuit.loss.direct_change, **circuit.leads.parts}
    # what is left: the loss has it, too, but the terminal inductance is interpolated to within 3e-5 of itself
    parts["crowding"] = free.inductance - math.fsum(parts.values())
    return CoilEstimate(
        name=coil.name,
        centre=(coil.centre.x, coil.centre.y),
        winding_inductance=circuit.inductance,
        inductance_error=winding.inductance_error,
        method=winding.method.name,
        terminal_inductance=free.inductance,
        lead_inductance=circuit.leads.inductance,
        resistance_dc=circuit.resistance,
        resistance_ac=circuit.winding_resistance(free.frequency) if FREE in states else math.nan,
        terminal_resistance_dc=circuit.resistance + circuit.leads.resistance,
        capacitance=tuned.tank.capacitance(circuit),
        self_capacitance=circuit.self_capacitance,
        sensor_frequency=free.frequency,
        parallel_resistance=free.parallel_resistance,
        quality_factor=free.quality_factor,
        self_resonance=self_resonance(circuit),
        trace_length=math.fsum(w.path.length for w in coil.windings),
        inner_diameter=tuned.wound.layout.spec.coil.inner_diameter,
        states=states,
        lead_parts=circuit.leads.parts,
        winding_capacitance=circuit.winding_capacitance,
        apparent_inductance=free.apparent_inductance,
        failed_states=tuned.failed,
        overdamped=tuned.damped,
        bend_inductance=circuit.loss.direct_change,
        inductance_parts={name: parts.get(name, 0.0) for name in PARTS},
        resistance_error=winding.bound.relative(circuit.loss.resistance_ratio(free.frequency), free.frequency)
        if FREE in states
        else None,
    )


def metered(layout: Layout, temperature: float, frequency: float = METER_FREQUENCY) -> tuple[Metered, ...]:
    """What an LCR meter reads of every coil of the bare board at a temperature (degrees Celsius), far from metal."""
    wound = wind(layout, temperature)
    winding, spec = wound.winding, wound.spec
    circuits = coil_circuits(wound.layout, winding, wound.matrix, wound.assembly, NO_SHARES)
    slopes = slopes_of(spec, layout.coils[0], winding)
    of_direct, found = direct_resistance_sigma(spec), []
    for circuit in circuits:
        (inductance,), (resistance,) = (values.tolist() for values in circuit.exactly(FREE, np.array([frequency])))
        state = replace(NO_STATE, inductance=inductance, resistance=resistance, frequency=frequency)
        moved = track_moves(circuit, FREE, frequency, slopes).values()
        by_l, by_r = (math.hypot(*(row[k] for row in moved)) for k in range(2))
        read = apparent_inductance(inductance, resistance, circuit.self_capacitance, frequency)
        direct = circuit.resistance + circuit.leads.resistance
        error = winding.resistance_error(circuit, state, spec.coil)
        found.append(Metered(circuit.name, frequency, read, resistance, by_l, by_r, error, direct, of_direct * direct))
    return tuple(found)


NO_STATE = StateEstimate(FREE, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
"""Stands for a free state that has no numbers."""
