"""Steps from a layout to its estimates. Each step returns a frozen value, computed from the result of the last step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sitscad.assembly.places.column import usual_tolerances
from sitscad.assembly.places.state import FREE, PRESSED, REST
from sitscad.basics.late import late
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.estimates.circuits.coils import (
    coil_circuits,
    drop_states,
    overdamped_states,
    self_resonance,
    without_failed_states,
)
from sitscad.estimates.circuits.settings import with_drive_codes
from sitscad.estimates.circuits.solved_winding import SolvedWindings, solve_winding, winding_inductance_matrix
from sitscad.estimates.circuits.tank import (
    CoilCircuit,
    Tank,
    choose_capacitor,
    converter_settings,
    state_estimates,
    with_frequency_margin,
    with_inductance_steps,
)
from sitscad.estimates.circuits.uncertainty import (
    Slopes,
    coil_slopes,
    direct_resistance_sigma,
    reflector_shifts,
    state_sigmas,
    surroundings_changes,
    tolerance_sigmas,
    track_tolerance_changes,
)
from sitscad.estimates.coil_estimates import (
    METER_FREQUENCY,
    PARTS,
    CoilEstimate,
    Estimates,
    MeterReadings,
    ReadoutEstimate,
    StateEstimate,
)
from sitscad.estimates.loads.pressing import GLUE, PAD
from sitscad.estimates.targets.assembly import assemble, spec_at_temperature
from sitscad.estimates.targets.finite_target import NO_RATIOS, TargetRatios, target_ratios
from sitscad.estimates.tolerances.scatter import CAPACITOR, scatter_by_cause
from sitscad.estimates.windings.leads import missing_leads_note
from sitscad.estimates.windings.losses import is_rough, near_metal_notes
from sitscad.estimates.windings.methods import cross_checks, reason_without_cross_check
from sitscad.estimates.windings.own_capacitance import metal_capacitance_notes
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.kernels.electromagnetics.resonator import apparent_inductance
from sitscad.layout.board import Coil, Layout
from sitscad.spec.places import with_cells_stacked

if TYPE_CHECKING:
    from sitscad.estimates.states.solved_target import SolvedStates

# solvers, which a check of a coil without a target, and of a pad without webs, does not need (5 ms)
is_affordable = late("sitscad.estimates.states.solved_target", "is_affordable")
solve_states = late("sitscad.estimates.states.solved_target", "solve_states")
pad_signal_ratios = late("sitscad.estimates.states.cells", "pad_signal_ratios")


@record(eq=False)
class TunedCircuits:
    """Every coil as a circuit, with the chosen tank and the converter's settings.

    `target` is the target's effect: the field solution, or correction ratios of an infinite plate. `failed` holds the
    reason for each state without values. `overdamped` holds the quality factor for each state in which a tank does not
    oscillate.
    """

    windings: SolvedWindings
    target: TargetRatios | SolvedStates
    circuits: Sequence[CoilCircuit]
    tank: Tank
    readout: ReadoutEstimate
    failed: Mapping[str, str]
    overdamped: Mapping[str, float]


def solve_windings(
    layout: Layout, temperature: float | None = None, method: str | None = None, tolerance: float | None = None
) -> SolvedWindings:
    """Solve a coil's winding, and the mutual inductances of all windings.

    If `temperature` (degrees Celsius) is None, it is the spec's. A `tolerance` for screening selects rough solutions.
    """
    temperature = layout.spec.requirements.temperature if temperature is None else temperature
    rough, coils = is_rough(tolerance), layout.coils
    spec = spec_at_temperature(layout.spec, temperature)
    assembly = assemble(spec, tolerance_sigmas(spec), rough)
    winding = solve_winding(spec.coil, coils[0], assembly, conductivity_at(temperature), method, tolerance)
    matrix, errors = winding_inductance_matrix(spec.coil, coils, winding, rough)
    return SolvedWindings(replace(layout, spec=spec), temperature, assembly, winding, matrix, errors, method, tolerance)


def choose_readout(windings: SolvedWindings, target: TargetRatios | SolvedStates) -> TunedCircuits:
    """Return circuits, tank capacitor and converter settings. States without values are left out."""
    readout = windings.spec.readout
    circuits, failed = without_failed_states(coil_circuits(
        windings.layout, windings.winding, windings.matrix, windings.assembly, target))
    capacitor, reason = choose_capacitor(
        circuits, readout, min(map(self_resonance, circuits)), windings.winding.is_rough)
    tank = Tank(capacitor, readout)
    damped = overdamped_states(circuits, tank, target)
    failed |= windings.assembly.refused
    failed |= {
        state: f"no numbers for this state: overdamped: Q {quality:.2g}; with {show(capacitor, 'F', 3)} the tank does "
               "not oscillate" for state, quality in damped.items()
    }
    swinging = [drop_states(circuit, damped) for circuit in circuits]
    return TunedCircuits(windings, target, swinging, tank, converter_settings(swinging, readout, capacitor, reason),
                         failed, damped)


def tune_circuits(windings: SolvedWindings, is_solved: bool | None = None) -> TunedCircuits:
    """Return circuits and tank, with the target's effect from the field solution, as in a response.

    In screening, and if `is_solved` is False, the effect is an infinite plate's, multiplied by correction ratios. If
    `is_solved` is None, the ratios also serve for targets whose field solution takes longer than a second or two.
    """
    if windings.winding.is_rough or not windings.has_target or is_solved is False:
        return choose_readout(windings, _target_ratios(windings))
    # rough tank frequencies are enough to choose the frequencies of the solution
    rough_winding = replace(windings.winding, crowding=None, is_rough=True)
    tuned = choose_readout(replace(windings, winding=rough_winding), _target_ratios(windings, True))
    for _ in range(TRIES):
        frequencies = [tuned.tank.oscillation(c, state).frequency for c in tuned.circuits for state in c.reflections]
        low, high = (0.0, 0.0) if isinstance(tuned.target, TargetRatios) else tuned.target.band
        if not frequencies or low <= min(frequencies) <= max(frequencies) <= high:
            break
        band = BAND[0] * min(frequencies), BAND[1] * max(frequencies)
        if is_solved is None and not is_affordable(windings, band):
            return choose_readout(windings, _target_ratios(windings))
        tuned = choose_readout(windings, solve_states(windings, band))
    return choose_readout(windings, _target_ratios(windings)) if isinstance(tuned.target, TargetRatios) else tuned


def _target_ratios(windings: SolvedWindings, is_rough: bool = False) -> TargetRatios:
    """Return the correction ratios: the target's effect on each coil, divided by the effect of an infinite plate."""
    heights, rough = [layer.z for layer in windings.layout.coils[0].windings], is_rough or windings.winding.is_rough
    return target_ratios(with_cells_stacked(windings.spec), heights, windings.assembly.states, rough)


BAND = 0.9, 1.15
"""Factors on the lowest and the highest tank frequency (Hz) of all states.

The target's eddy currents are computed at both products.
"""

TRIES = 3  # Largest number of solutions: another capacitor shifts the tank's frequency


def coil_estimates(tuned: TunedCircuits, reference: TunedCircuits | None = None) -> Estimates:
    """Return the estimates of every coil in every state, with the settings of the readout.

    They include standard deviations, drive codes that keep their margins, and notes about the values. `reference` is
    the reference coil, which the converter reads in the same scan. `tuned` holds the circuits of the sensing coils.
    """
    windings = tuned.windings
    spec, assembly, rough = windings.spec, windings.assembly, windings.winding.is_rough
    boards, readout, matrix, matrix_errors = [tuned], tuned.readout, windings.matrix, windings.matrix_errors
    if reference is not None:
        every = (*windings.layout.coils, *reference.windings.layout.coils)
        matrix, matrix_errors = map(np.copy, winding_inductance_matrix(spec.coil, every, windings.winding, rough))
        matrix[-1, -1], matrix_errors[-1, -1] = (
            values[0, 0] for values in (reference.windings.matrix, reference.windings.matrix_errors))
        circuits = [*tuned.circuits, *reference.circuits]
        readout = converter_settings(circuits, spec.readout, tuned.tank.capacitor, readout.capacitance_reason)
        boards = [replace(board, readout=readout) for board in (tuned, reference)]
    estimates = [_coil_estimate(coil, circuit, board, states[coil.name])
                 for board in boards for states in [_states_by_coil(board)]
                 for coil, circuit in zip(board.windings.layout.coils, board.circuits, strict=True)]
    readout = with_frequency_margin(readout, estimates)
    coils, readout = with_drive_codes([with_inductance_steps(coil, tuned.tank, readout) for coil in estimates], readout,
                                      spec.readout)
    coils, others = coils[: len(tuned.circuits)], coils[len(tuned.circuits) :]
    if spec.web is not None and assembly.compression is not None:
        ratios = pad_signal_ratios(windings.layout, max(coil.sensor_frequency for coil in coils), rough)
        coils = tuple(replace(coil, press_share=ratio) for coil, ratio in zip(coils, ratios, strict=True))
    gap_sigmas, deviations = {}, tolerance_sigmas(spec)
    if spec.elastomer is not None and spec.target is not None:  # every gap has the glue below the target
        gap_sigmas[REST] = math.hypot(deviations[PAD], deviations[GLUE])
        gap_sigmas |= {name: math.hypot(scatter.gap, deviations[GLUE]) for name, scatter in assembly.scatters.items()}
    checks = () if rough else cross_checks(coils[0].name, windings.winding.geometry, windings.winding.inductance)
    return Estimates(
        coils=coils,
        reference=others[0] if others else None,
        inductance_matrix=tuple(map(tuple, matrix.tolist())),
        readout=readout,
        inductance_matrix_error=tuple(map(tuple, matrix_errors.tolist())),
        compression=assembly.compression,
        compression_scatter=assembly.scatters.get(PRESSED),
        gaps=assembly.gaps,
        gap_sigmas=gap_sigmas,
        cross_checks=checks,
        no_cross_check=None if rough else reason_without_cross_check(spec.coil, checks),
        incomplete=missing_leads_note(windings.layout.coils),
        notes=() if rough else (*_notes(tuned, coils[0]), *(REFERENCE.format(coil.name) for coil in others)),
        normal_force=spec.requirements.normal_force,
        temperature=windings.temperature,
        states=tuple(replace(around.state, temperature=windings.temperature) for around in assembly.states),
        target_band=None if isinstance(tuned.target, TargetRatios) else tuned.target.band,
        is_rough=rough,
    )


def _notes(tuned: TunedCircuits, coil: CoilEstimate) -> Iterator[str]:
    """Yield notes about the estimates of a sensor. `coil` is the estimate of the first of its identical coils."""
    windings = tuned.windings
    layout, spec, assembly = windings.layout, windings.spec, windings.assembly
    if incomplete := missing_leads_note(layout.coils):
        yield incomplete
    if isinstance(tuned.target, TargetRatios) and tuned.target.inductance_ratios:
        yield from (TOO_LARGE, *tuned.target.notes)
    yield from assembly.notes
    yield from near_metal_notes(spec.coil, windings.winding.nearest)
    yield from metal_capacitance_notes(layout.coils[0], spec.coil, spec.fpc.stackup.thickness, assembly.gaps,
                           coil.self_capacitance, coil.capacitance)
    yield from (f"{name}: {reason}" for name, reason in tuned.failed.items())
    causes = scatter_by_cause(spec)
    unseen = [name for name in (*usual_tolerances(), CAPACITOR) if name in causes and not causes[name].verified]
    yield f"scatter of manufacture: usual tolerances, not your fabricator's; unverified: {', '.join(unseen)}"


REFERENCE = "{} is the reference coil: no target covers it, and the effect of idle coils beside it is left out"
"""Note on a reference coil; its name is inserted."""

TOO_LARGE = (
    "the target is too large, too thin or too magnetic to be solved for the states within a second or two: shares of "
    "an endless plate's effect serve, and `response` solves it, or names why not"
)
"""Note if correction ratios are used because the field solution of the target takes longer than a second or two."""


def _states_by_coil(tuned: TunedCircuits) -> dict[str, dict[str, StateEstimate]]:
    """Return state estimates by coil name and state, each with its standard deviations.

    `tuned` holds the circuits, the tank and the converter's settings.
    """
    windings, tank = tuned.windings, tuned.tank
    layout, spec, winding = windings.layout, windings.spec, windings.winding
    deviations = tolerance_sigmas(spec)
    deeper = reflector_shifts(layout.coils[0], spec.fpc.stackup, deviations)
    by_coil: dict[str, dict[str, StateEstimate]] = {}
    first_alike: dict[tuple[int, ...], str] = {}
    slopes, moved = coil_slopes(spec, layout.coils[0], winding), dict[str, Slopes]()
    for circuit in tuned.circuits:
        states = state_estimates(circuit, tank, tuned.readout)
        first = first_alike.setdefault(tuple(map(id, circuit.reflections.values())), circuit.name)
        twin = by_coil.get(first)
        if winding.is_rough and twin is not None:  # coils that differ by their leads alone
            by_coil[circuit.name] = {
                name: replace(state, spread=twin[name].spread, resistance_error=twin[name].resistance_error,
                              target_change=twin[name].target_change,
                              target_change_error=twin[name].target_change_error)
                for name, state in states.items()
            }
            continue
        if first not in moved:  # other leads shift the frequency by a per cent: no change of a sigma
            moved[first] = replace(slopes, surroundings=surroundings_changes(
                winding.spectrum, windings.assembly, states, circuit, deeper, winding.is_rough))
        for name, state in states.items():
            reflection, change, error = circuit.reflections[name], None, None
            if by_target := reflection.target_change(state.frequency).real:
                change = by_target
                least = max(abs(change), LEAST_CHANGE * circuit.inductance)
                error = abs(reflection.target_error_bounds(state.frequency)[0]) / least
            states[name] = replace(state, spread=state_sigmas(circuit, tank, state, moved[first]),
                                   resistance_error=winding.resistance_error(circuit, state, spec.coil),
                                   target_change=change, target_change_error=error)
        by_coil[circuit.name] = states
    return by_coil


LEAST_CHANGE = 0.01  # Fraction of the free winding's inductance: errors of smaller changes are relative to it


def _coil_estimate(
    coil: Coil, circuit: CoilCircuit, tuned: TunedCircuits, states: Mapping[str, StateEstimate]
) -> CoilEstimate:
    """Return the estimate of one coil from its drawing, its circuit and its state estimates."""
    free, winding = states.get(FREE, NO_STATE), tuned.windings.winding
    parts = {"winding": circuit.inductance, "bends": circuit.loss.direct_change, **circuit.leads.parts}
    # the remainder; the loss model has it, too, but the terminal inductance is interpolated to within 3e-5
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
        inner_diameter=tuned.windings.layout.spec.coil.inner_diameter,
        states=states,
        lead_parts=circuit.leads.parts,
        winding_capacitance=circuit.winding_capacitance,
        apparent_inductance=free.apparent_inductance,
        failed_states=tuned.failed,
        overdamped=tuned.overdamped,
        bend_inductance=circuit.loss.direct_change,
        inductance_parts={name: parts.get(name, 0.0) for name in PARTS},
        resistance_error=winding.bound.relative(circuit.loss.resistance_ratio(free.frequency), free.frequency)
        if FREE in states
        else None,
    )


def meter_readings(layout: Layout, temperature: float, frequency: float = METER_FREQUENCY) -> tuple[MeterReadings, ...]:
    """Return the readings of an LCR meter on every coil of the bare board, far from metal.

    `temperature` is in degrees Celsius, `frequency` (Hz) is the meter's.
    """
    windings = solve_windings(layout, temperature)
    winding, spec = windings.winding, windings.spec
    circuits = coil_circuits(windings.layout, winding, windings.matrix, windings.assembly, NO_RATIOS)
    slopes = coil_slopes(spec, layout.coils[0], winding)
    of_direct, readings = direct_resistance_sigma(spec), []
    for circuit in circuits:
        impedance = circuit.exact_impedance(FREE, np.array([frequency]))
        (inductance,), (resistance,) = (values.tolist() for values in impedance)
        state = replace(NO_STATE, inductance=inductance, resistance=resistance, frequency=frequency)
        moved = track_tolerance_changes(circuit, FREE, frequency, slopes).values()
        by_l, by_r = (math.hypot(*(row[k] for row in moved)) for k in range(2))
        read = apparent_inductance(inductance, resistance, circuit.self_capacitance, frequency)
        direct = circuit.resistance + circuit.leads.resistance
        error = winding.resistance_error(circuit, state, spec.coil)
        readings.append(
            MeterReadings(circuit.name, frequency, read, resistance, by_l, by_r, error, direct, of_direct * direct))
    return tuple(readings)


NO_STATE = StateEstimate(FREE, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
"""Placeholder for a free state that has no values: all values are NaN."""
