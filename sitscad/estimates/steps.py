"""From a layout to its numbers, step by step: each is a frozen value made of the one before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from sitscad.arrays import Array
from sitscad.estimates.circuit.coils import (
    coil_circuits,
    damped_words,
    handed_over,
    overdamped,
    self_resonance,
    without,
    working,
)
from sitscad.estimates.circuit.drive import driven
from sitscad.estimates.circuit.leads import missing_leads
from sitscad.estimates.circuit.tank import (
    CoilCircuit,
    Tank,
    choose_capacitor,
    settle,
    state_estimates,
    with_margin,
    with_steps,
)
from sitscad.estimates.circuit.track_ends import spared_squares
from sitscad.estimates.states.assembly import Assembly, assemble, warmed
from sitscad.estimates.states.finite_target import TargetChanges, TargetShares, target_shares
from sitscad.estimates.states.pressing import GLUE, PAD, PressingScatter
from sitscad.estimates.uncertainty import (
    Slopes,
    depths_moved,
    direct_resistance_sigma,
    inductance_slopes,
    moved_by_surroundings,
    scatter_note,
    sigmas,
    spread,
    thickest_copper,
    track_moves,
)
from sitscad.estimates.values import (
    METER_FREQUENCY,
    PARTS,
    CoilEstimate,
    Estimates,
    Metered,
    ReadoutEstimate,
    StateEstimate,
)
from sitscad.estimates.winding.losses import is_rough, near_metal_notes
from sitscad.estimates.winding.methods import cross_checks, no_cross_check
from sitscad.estimates.winding.own_capacitance import metal_notes
from sitscad.estimates.winding.solved import SolvedWinding, beside_each_other, solve_winding
from sitscad.layout.board import Coil, Layout
from sitscad.physics.loss.resistance import conductivity_at
from sitscad.physics.resonator import apparent_inductance
from sitscad.record import record
from sitscad.scene.state import FREE, PRESSED, REST
from sitscad.spec.places import gathered
from sitscad.spec.sensor import SensorSpec


@record(eq=False)
class Given:
    """The layout with all metal at a temperature (degrees Celsius), what is round its coils in each state, and the
    squares of track that pads and teardrops spare each coil, by layer.
    """

    layout: Layout
    temperature: float
    assembly: Assembly
    spared: Mapping[str, Mapping[int, float]]

    @property
    def spec(self) -> SensorSpec:
        """The spec, its metals warm."""
        return self.layout.spec


@record(eq=False)
class Wound:
    """The winding solved, the bare windings' inductance matrix (H) and its errors (H), the target's share of the effect
    of an endless one; and its effect `solved` where that share is not known well enough; all of it roughly for a
    tolerance that is for screening (`losses.is_rough`).
    """

    given: Given
    winding: SolvedWinding
    matrix: Array
    matrix_errors: Array
    shares: TargetShares
    solved: TargetChanges | None = None
    is_rough: bool = False


@record(eq=False)
class Tuned:
    """Every coil as a circuit, the tank that was chosen and how the converter is set; `failed` are the states without
    numbers, with the reason, `damped` those whose tank does not oscillate, with their quality factor.
    """

    wound: Wound
    circuits: Sequence[CoilCircuit]
    tank: Tank
    readout: ReadoutEstimate
    failed: Mapping[str, str]
    damped: Mapping[str, float]


@record(eq=False)
class Read:
    """Every coil in every state as the converter sees it, driven with margin."""

    tuned: Tuned
    coils: tuple[CoilEstimate, ...]
    readout: ReadoutEstimate


def given(layout: Layout, temperature: float | None, is_rough: bool = False) -> Given:
    """What is asked; the spec's temperature where None is given."""
    temperature = layout.spec.requirements.temperature if temperature is None else temperature
    spared = {coil.name: spared_squares(coil, layout) for coil in layout.coils}  # knows the layout's teardrops already
    warm = replace(layout, spec=warmed(layout.spec, temperature))
    return Given(warm, temperature, assemble(warm.spec, sigmas(warm.spec), is_rough), spared)


def wind(start: Given, method: str | None, tolerance: float | None) -> Wound:
    """The windings by themselves and beside each other, and what of the target they see."""
    spec, coils = start.spec, start.layout.coils
    copper = conductivity_at(start.temperature)
    winding = solve_winding(spec.coil, coils[0], start.assembly, copper, method, tolerance)
    rough = is_rough(tolerance)
    matrix, errors = beside_each_other(spec.coil, coils, winding, rough)
    shares = target_shares(gathered(spec), [layer.z for layer in coils[0].windings], start.assembly.states, rough)
    if rough and shares.shares:  # of a strange target no more is solved, but said
        shares = shares.widened(_part_of(shares.strangeness))
    return Wound(start, winding, matrix, errors, shares, is_rough=rough)


def tune(wound: Wound) -> Tuned:
    """Circuits, tank capacitor, and the converter's settings; states that have no numbers are left out."""
    start = wound.given
    circuits, failed = working(
        coil_circuits(
            start.layout, wound.winding, wound.matrix, start.assembly, wound.shares, start.spared, wound.solved
        )
    )
    capacitor, reason = choose_capacitor(
        circuits, start.spec.readout, min(map(self_resonance, circuits)), wound.is_rough)
    tank = Tank(capacitor, start.spec.readout)
    damped = overdamped(circuits, tank)
    failed |= {state: damped_words(value, capacitor) for state, value in damped.items()}
    swinging = [without(circuit, damped) for circuit in circuits]
    return Tuned(wound, swinging, tank, settle(swinging, start.spec.readout, capacitor, reason), failed, damped)


def made_sure(tuned: Tuned, part: float | None = None) -> Tuned:
    """The same with the target's effect solved, as in a response, where the states owe too much to its shares, or the
    `part` of it that is said. Shares of a target that would take too long are less sure.
    """
    shares = tuned.wound.shares
    if tuned.wound.is_rough:
        return tuned
    wanted = _solved_part(tuned) if part is None else part
    if not shares.shares or not wanted:
        return tuned
    for _ in range(TRIES):
        found = [tuned.tank.oscillation(c, state).frequency for c in tuned.circuits for state in c.reflections]
        known = tuned.wound.solved
        if not found or (known is not None and known.holds_at(min(found), max(found))):
            break
        band = BAND[0] * min(found), BAND[1] * max(found)
        if known is None and part is None and not _is_affordable(tuned.wound, band):
            return tune(replace(tuned.wound, shares=shares.widened(wanted)))
        tuned = tune(_solved(tuned.wound, band, wanted))
    return tuned


def _is_affordable(wound: Wound, band: tuple[float, float]) -> bool:
    """Whether the target can be solved in a second or two; its solver is loaded for nothing else."""
    from sitscad.estimates.states.solved_target import is_affordable

    start = wound.given
    return is_affordable(start.spec, start.layout.coils, start.assembly, band)


def _solved(wound: Wound, band: tuple[float, float], part: float) -> Wound:
    """With a part of the target's effect solved in a band of frequencies (Hz)."""
    from sitscad.estimates.states.solved_target import solved_target

    start, scale = wound.given, wound.winding.inductance
    solved = solved_target(start.layout, start.assembly, band, scale)
    if part < 1.0:
        solved = handed_over(solved, part, start.layout, wound.winding, start.assembly, wound.shares)
    return replace(wound, solved=solved)


def _solved_part(tuned: Tuned) -> float:
    """How much of the target's effect is to be solved: all of it where its shares are not sure enough, and less and
    less down to `GIVES_WAY` of that, so that neither numbers nor their errors make a step there.
    """
    shares = tuned.wound.shares
    if tuned.failed and not shares.is_usual:
        return 1.0
    worst = max((_unsure(one, tuned.tank, shares.strangeness) for one in tuned.circuits), default=0.0)
    return _part_of(worst)


def _part_of(unsure: float) -> float:
    """How much is to be solved of a target whose shares are so unsure (1: too unsure)."""
    return min(max((unsure - GIVES_WAY) / (1.0 - GIVES_WAY), 0.0), 1.0)


GIVES_WAY = 0.95
"""Part of `UNSURE`, and of what makes a target strange, at which shares begin to give way to what is solved."""


def _unsure(circuit: CoilCircuit, tank: Tank, strangeness: float) -> float:
    """What the target's shares may be off, at worst over states: of L, of R, or of what the target changes, over what
    each may be (`UNSURE`); or how strange a target is that matters at all.
    """
    worst = 0.0
    for state, reflection in circuit.reflections.items():
        frequency = tank.oscillation(circuit, state).frequency
        inductance, resistance = circuit.terminal(state, frequency)
        if abs(reflection.endless_change(frequency)) > NOTHING * inductance:
            worst = max(worst, strangeness)
        more, lost = map(abs, reflection.unsure(frequency))
        change = max(abs(reflection.target_change(frequency).real), FAINT_CHANGE * circuit.inductance)
        parts = more / inductance, lost / resistance, more / change
        worst = max(worst, *(part / most for part, most in zip(parts, UNSURE, strict=True)))
    return worst


BAND = 0.9, 1.15
"""Frequencies between which the target is solved, as for a response: this part of the lowest and of the highest that
any state has.
"""

UNSURE = 0.0125, 0.06, 0.12
"""Parts of L, of R and of the target's own change of L that its shares may be off without it being solved."""

NOTHING = 1e-5
"""Part of L that an endless target changes up to which a real one does nothing."""

FAINT_CHANGE = 0.025
"""Part of the free inductance: smaller changes are looked at as if they were so large."""

TRIES = 3
"""How often it is solved at most: with another capacitor the tank runs elsewhere."""


def read(tuned: Tuned) -> Read:
    """All coils in all states, each with one sigma, and the drive that keeps its margin."""
    states, coils = _states(tuned), tuned.wound.given.layout.coils
    found = [
        _coil_estimate(coil, circuit, tuned, states[coil.name])
        for coil, circuit in zip(coils, tuned.circuits, strict=True)
    ]
    readout = with_margin(tuned.readout, found)
    found = [with_steps(coil, tuned.tank, readout) for coil in found]
    return Read(tuned, *driven(found, readout, tuned.wound.given.spec.readout))


def tell(done: Read) -> Estimates:
    """The numbers with what is worth saying about them."""
    wound = done.tuned.wound
    start, spec, assembly = wound.given, wound.given.spec, wound.given.assembly
    pressing = assembly.scatter
    checks = () if wound.is_rough else cross_checks(
        start.layout.coils[0].name, wound.winding.geometry, wound.winding.inductance)
    return Estimates(
        coils=done.coils,
        inductance_matrix=_rows(wound.matrix),
        readout=done.readout,
        inductance_matrix_error=_rows(wound.matrix_errors),
        compression=assembly.compression,
        compression_scatter=pressing,
        gaps=assembly.gaps,
        gap_sigmas=_gap_sigmas(spec, pressing),
        cross_checks=checks,
        no_cross_check=None if wound.is_rough else no_cross_check(spec.coil, checks),
        incomplete=missing_leads(start.layout),
        notes=() if wound.is_rough else tuple(_notes(done)),
        normal_force=spec.requirements.normal_force,
        temperature=start.temperature,
        states=tuple(replace(around.state, temperature=start.temperature) for around in assembly.states),
        solved=0.0 if wound.solved is None else wound.solved.part,
        is_rough=wound.is_rough,
    )


def _notes(done: Read) -> Iterator[str]:
    """What whoever reads the numbers has to know, of the design and of the first of its alike coils."""
    wound, coil = done.tuned.wound, done.coils[0]
    layout, spec, assembly = wound.given.layout, wound.given.spec, wound.given.assembly
    if incomplete := missing_leads(layout):
        yield incomplete
    yield from wound.shares.notes if wound.solved is None else (SOLVED,)
    yield from assembly.notes
    yield from near_metal_notes(spec.coil, wound.winding.nearest)
    yield from metal_notes(layout.coils[0], spec, assembly.gaps, coil.self_capacitance, coil.capacitance)
    yield from (f"{name}: {reason}" for name, reason in done.tuned.failed.items())
    yield scatter_note(spec)


SOLVED = (
    "what the target changes in the states is solved for its own size and metal, as `response` does: shares of an "
    "endless sheet's effect are not known well enough for it"
)
"""What is said of states whose target was solved."""


def _states(tuned: Tuned) -> dict[str, dict[str, StateEstimate]]:
    """By coil and state, each with its one sigma."""
    wound, tank = tuned.wound, tuned.tank
    layout, spec, winding = wound.given.layout, wound.given.spec, wound.winding
    deviations = sigmas(spec)
    slopes = inductance_slopes(winding.spirals, layout.coils[0], spec, wound.is_rough)
    deeper = depths_moved(layout.coils[0], spec, deviations)
    found: dict[str, dict[str, StateEstimate]] = {}
    alike: dict[tuple[int, ...], str] = {}
    for circuit in tuned.circuits:
        states = state_estimates(circuit, tank, tuned.readout)
        key = tuple(map(id, circuit.reflections.values()))
        if wound.is_rough and key in alike:  # they differ by their leads alone
            known = found[alike[key]]
            found[circuit.name] = {name: _as_scattered(state, known[name]) for name, state in states.items()}
            continue
        alike[key] = circuit.name
        around = moved_by_surroundings(
            winding.spectrum, wound.given.assembly, states, circuit, deeper, wound.is_rough)
        moved = Slopes(deviations, slopes, around, thickest_copper(spec))
        changes = {name: _target_change(circuit, state) for name, state in states.items()}
        found[circuit.name] = {
            name: replace(state, spread=spread(circuit, tank, state, moved),
                          resistance_error=winding.resistance_error(circuit, state, spec.coil),
                          target_change=changes[name][0], target_change_error=changes[name][1])
            for name, state in states.items()
        }
    return found


def _as_scattered(state: StateEstimate, alike: StateEstimate) -> StateEstimate:
    """A state with scatter and errors of that of a coil alike."""
    return replace(state, spread=alike.spread, resistance_error=alike.resistance_error,
                   target_change=alike.target_change, target_change_error=alike.target_change_error)


def _target_change(circuit: CoilCircuit, state: StateEstimate) -> tuple[float | None, float | None]:
    """What the target changes of the inductance (H) in a state, and its error; None where there is none."""
    reflection = circuit.reflections[state.state]
    change = reflection.target_change(state.frequency).real
    if not change:
        return None, None
    least = max(abs(change), LEAST_CHANGE * circuit.inductance)
    return change, abs(reflection.unsure(state.frequency)[0]) / least


LEAST_CHANGE = 0.01
"""Of the free winding's inductance: errors of smaller changes are relative to that."""


def _coil_estimate(coil: Coil, circuit: CoilCircuit, tuned: Tuned, states: Mapping[str, StateEstimate]) -> CoilEstimate:
    """One coil's numbers in one record."""
    free, winding = states.get(FREE, NO_STATE), tuned.wound.winding
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
        states=states,
        lead_parts=circuit.leads.parts,
        winding_capacitance=circuit.winding_capacitance,
        apparent_inductance=free.apparent_inductance,
        failed_states=tuned.failed,
        overdamped=tuned.damped,
        bend_inductance=circuit.loss.direct_change,
        inductance_parts=_inductance_parts(circuit, free.inductance),
        resistance_error=winding.bound.relative(circuit.loss.resistance_ratio(free.frequency), free.frequency)
        if FREE in states
        else None,
    )


def metered(layout: Layout, temperature: float, frequency: float = METER_FREQUENCY) -> tuple[Metered, ...]:
    """What an LCR meter reads of every coil of the bare board at a temperature (degrees Celsius), far from metal."""
    wound = wind(given(layout, temperature), None, None)
    start, winding, spec = wound.given, wound.winding, wound.given.spec
    circuits = coil_circuits(start.layout, winding, wound.matrix, start.assembly, wound.shares, start.spared)
    slopes = Slopes(sigmas(spec), inductance_slopes(winding.spirals, layout.coils[0], spec), {}, thickest_copper(spec))
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


def _inductance_parts(circuit: CoilCircuit, terminal: float) -> dict[str, float]:
    """What the terminal inductance (H) of the coil alone is made of, in the order of PARTS; crowding is what is left of
    it (`loss` has that, too, and `terminal` is interpolated to within 3e-5 of itself).
    """
    parts = {"winding": circuit.inductance, "bends": circuit.loss.direct_change, **circuit.leads.parts}
    parts["crowding"] = terminal - math.fsum(parts.values())
    return {name: parts.get(name, 0.0) for name in PARTS}


NO_STATE = StateEstimate(FREE, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
"""Stands for a free state that has no numbers."""


def _gap_sigmas(spec: SensorSpec, pressing: PressingScatter | None) -> dict[str, float]:
    """One sigma (m) of the gaps that have one, the glue below the target in all: at rest the pad's thickness, pressed
    what the pad gives way too.
    """
    if spec.elastomer is None or spec.target is None:
        return {}
    known = sigmas(spec)
    pad = {REST: known[PAD]} | ({PRESSED: pressing.gap} if pressing is not None else {})
    return {name: math.hypot(sigma, known[GLUE]) for name, sigma in pad.items()}


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in matrix)
