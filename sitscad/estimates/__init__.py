"""From a layout to its electrical numbers: the one meeting point of what is drawn and of physics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.circuit.drive import driven
from sitscad.estimates.circuit.failed_states import damped_words, overdamped, without, working
from sitscad.estimates.circuit.idle import Circuit, idle_neighbours
from sitscad.estimates.circuit.leads import (
    NO_LEADS,
    LeadEstimate,
    estimate_leads,
    missing_leads,
)
from sitscad.estimates.circuit.neighbours import inductance_matrix
from sitscad.estimates.circuit.tank import CoilCircuit, Tank, choose_capacitor, settle, state_estimates, with_margin
from sitscad.estimates.circuit.track_ends import spared_squares
from sitscad.estimates.states.assembly import Assembly, NoReflection, Reflection, assemble, warmed
from sitscad.estimates.states.finite_target import TargetShares, target_shares
from sitscad.estimates.states.pressing import PAD, PAD_SIZE, PressingScatter, pressing_scatter
from sitscad.estimates.uncertainty import (
    Slopes,
    depths_moved,
    inductance_slopes,
    moved_by_surroundings,
    scatter_note,
    sigmas,
    spread,
)
from sitscad.estimates.values import (
    PARTS,
    CoilEstimate,
    CrossCheck,
    Estimates,
    ReadoutEstimate,
    StateEstimate,
)
from sitscad.estimates.winding.cross_checks import cross_checks, no_cross_check
from sitscad.estimates.winding.losses import (
    losses_near_metal,
    near_metal_notes,
    wanted_tolerance,
    winding_losses,
    winding_resistance,
)
from sitscad.estimates.winding.methods import (
    METHODS,
    Method,
    WindingGeometry,
    choose_method,
    equivalent_spirals,
    reflected_by,
    winding_geometry,
)
from sitscad.estimates.winding.own_capacitance import metal_notes, self_capacitance
from sitscad.estimates.winding.resistance_bounds import ResistanceBound, near_metal_error, resistance_bound, state_error
from sitscad.layout.board import Coil, Layout
from sitscad.physics.current_modes import ProximityLoss
from sitscad.physics.current_spectrum import CurrentSpectrum
from sitscad.physics.near_metal import CrowdingNearMetal
from sitscad.physics.resistance import conductivity_at
from sitscad.physics.resonator import resonance_frequency
from sitscad.physics.spirals import SpiralLayer
from sitscad.record import record
from sitscad.scene.state import FREE, PRESSED, REST
from sitscad.spec.sensor import CoilSpec, SensorSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

__all__ = [
    "METHODS",
    "CoilEstimate",
    "CrossCheck",
    "Estimates",
    "Method",
    "ReadoutEstimate",
    "StateEstimate",
    "estimate",
]


def estimate(
    layout: Layout, method: str | None = None, tolerance: float | None = None, temperature: float | None = None
) -> Estimates:
    """Everything electrical about a layout, free and mounted.

    `method` names a row of METHODS for the winding's inductance; otherwise the cheapest one is taken whose stated error
    meets `tolerance` (relative; 1e-4 when None). Alike coils are solved once. Works without leads too, where the layout
    found no room for them: the contacts then see the winding alone, and a note says so. Raises ValueError for a method
    that does not exist or does not serve the shape. R states its own error; it is solved finer for a tolerance below
    3e-3. `temperature` (degrees Celsius; the spec's where None) sets the conductivity of every track, barrel and metal.
    """
    temperature = layout.spec.requirements.temperature if temperature is None else temperature
    spared = {coil.name: spared_squares(coil, layout) for coil in layout.coils}  # knows the layout's teardrops already
    layout = replace(layout, spec=warmed(layout.spec, temperature))
    spec = layout.spec
    assembly = assemble(spec, sigmas(spec))
    winding = _winding(layout, assembly, conductivity_at(temperature), method, tolerance)
    bare = tuple(replace(coil, series=()) for coil in layout.coils)
    matrix, matrix_errors = _beside_each_other(spec.coil, bare, winding.inductance, winding.inductance_error)
    shares = target_shares(spec, [layer.z for layer in layout.coils[0].windings], assembly.states)
    circuits, failed = working(_circuits(layout, winding, matrix, assembly, shares, spared))
    capacitor, reason = choose_capacitor(circuits, spec.readout, min(map(_self_resonance, circuits)))
    tank = Tank(capacitor, spec.readout)
    damped = overdamped(circuits, tank)
    failed |= {state: damped_words(value, capacitor) for state, value in damped.items()}
    circuits = [without(circuit, damped) for circuit in circuits]
    readout = settle(circuits, spec.readout, capacitor, reason)
    states = _states(layout, circuits, tank, readout, winding, assembly, shares)
    coils = [
        _coil_estimate(coil, circuit, tank, states[coil.name], winding, failed, damped)
        for coil, circuit in zip(layout.coils, circuits, strict=True)
    ]
    readout = with_margin(readout, [state for coil in coils for state in coil.states.values()], tank.family)
    driven_coils, readout = driven(coils, readout, spec.readout)
    pressing = pressing_scatter(spec, sigmas(spec)) if assembly.compression is not None else None
    checks = cross_checks(layout.coils[0].name, winding.geometry, winding.inductance)
    return Estimates(
        coils=driven_coils,
        inductance_matrix=_rows(matrix),
        readout=readout,
        inductance_matrix_error=_rows(matrix_errors),
        compression=assembly.compression,
        compression_scatter=pressing,
        gaps=assembly.gaps,
        gap_sigmas=_gap_sigmas(spec, pressing),
        cross_checks=checks,
        no_cross_check=no_cross_check(spec.coil, checks),
        incomplete=missing_leads(layout),
        notes=tuple(_notes(layout, coils[0], winding, assembly, shares, failed)),
        normal_force=spec.requirements.normal_force,
        temperature=temperature,
        states=tuple(replace(around.state, temperature=temperature) for around in assembly.states),
    )


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in matrix)


def _notes(
    layout: Layout,
    coil: CoilEstimate,
    winding: _Winding,
    assembly: Assembly,
    shares: TargetShares,
    failed: Mapping[str, str],
) -> Iterator[str]:
    # What whoever reads the numbers has to know, of the design and of the first of its alike coils.
    spec = layout.spec
    if incomplete := missing_leads(layout):
        yield incomplete
    yield from shares.notes
    yield from assembly.notes
    yield from near_metal_notes(spec.coil, winding.nearest)
    yield from metal_notes(layout.coils[0], spec, assembly.gaps, coil.self_capacitance, coil.capacitance)
    yield from (f"{name}: {reason}" for name, reason in failed.items())
    yield scatter_note(spec)


def _states(
    layout: Layout,
    circuits: Sequence[CoilCircuit],
    tank: Tank,
    readout: ReadoutEstimate,
    winding: _Winding,
    assembly: Assembly,
    shares: TargetShares,
) -> dict[str, dict[str, StateEstimate]]:
    # By coil and state, each with its one sigma.
    spec = layout.spec
    deviations = sigmas(spec)
    slopes = inductance_slopes(winding.geometry, winding.spirals, layout.coils[0], spec)
    deeper = depths_moved(layout.coils[0], spec, deviations)
    found = {}
    for circuit in circuits:
        states = state_estimates(circuit, tank, readout)
        surroundings = moved_by_surroundings(winding.spectrum, assembly, states, shares, circuit.name, deeper)
        moved = Slopes(deviations, slopes, surroundings)
        found[circuit.name] = {
            name: replace(state, spread=spread(circuit, tank, state, moved),
                          resistance_error=winding.resistance_error(circuit, state, spec.coil))
            for name, state in states.items()
        }  # fmt: skip
    return found


def _gap_sigmas(spec: SensorSpec, pressing: PressingScatter | None) -> dict[str, float]:
    """One sigma (m) of the gaps that have one: at rest the pad's thickness, pressed what the pad gives way too."""
    if spec.elastomer is None or spec.target is None:
        return {}
    return {REST: sigmas(spec)[PAD]} | ({PRESSED: pressing.gap} if pressing is not None else {})


@record(eq=False)
class _Winding:
    """What all alike coils share: geometry, round layers that stand for it, inductance (H) and how it was found.

    `conductivity` (S/m) is the copper's, `loss` what alternating current adds. `nearest` (m) is the least distance of
    metal in any state, None without metal; `crowding` is what it changes of `loss`, `spectrum` what it is reflected by;
    `bound` is how far off its resistance can be.
    """

    geometry: WindingGeometry
    spirals: tuple[SpiralLayer, ...]
    inductance: float
    method: Method
    conductivity: float
    loss: ProximityLoss
    nearest: float | None
    crowding: CrowdingNearMetal | None
    spectrum: CurrentSpectrum | None
    bound: ResistanceBound

    def resistance_error(self, circuit: CoilCircuit, state: StateEstimate, coil: CoilSpec) -> float:
        """Relative error bound of the resistance at a coil's contacts in a state."""
        metal = 0.0 if self.nearest is None or state.state == FREE else near_metal_error(coil, self.nearest)
        return state_error(self.bound, circuit, state, metal)

    @property
    def inductance_error(self) -> float:
        """Relative error bound of the inductance, as its method states it."""
        return self.method.error(self.geometry)


def _winding(
    layout: Layout, assembly: Assembly, conductivity: float, method: str | None, tolerance: float | None
) -> _Winding:
    first = layout.coils[0]
    bare = replace(first, series=())
    geometry, chosen, inductance = _solved(layout.spec.coil, bare, method, tolerance)
    loss = _loss(layout.spec.coil, bare, conductivity, tolerance)
    nearest = _nearest(geometry, assembly)
    spirals = equivalent_spirals(geometry, first)
    crowding = (
        None
        if nearest is None
        else losses_near_metal(spirals, conductivity, nearest, tolerance, bool(geometry.spirals))
    )
    spectrum = None if nearest is None else _spectrum(geometry, nearest)
    bound = resistance_bound(layout.spec.coil, first, geometry.spirals, conductivity, wanted_tolerance(tolerance))
    return _Winding(geometry, spirals, inductance, chosen, conductivity, loss, nearest, crowding, spectrum, bound)


@lru_cache(maxsize=4)
def _solved(
    spec: CoilSpec, coil: Coil, method: str | None, tolerance: float | None
) -> tuple[WindingGeometry, Method, float]:
    # What the drawn windings alone decide: a design with other things around the same board finds it done.
    geometry = winding_geometry(spec, coil)
    chosen = choose_method(geometry, method, tolerance)
    inductance = chosen.solve(geometry)
    assert inductance is not None
    return geometry, chosen, inductance


@lru_cache(maxsize=4)
def _loss(spec: CoilSpec, coil: Coil, conductivity: float, tolerance: float | None) -> ProximityLoss:
    return winding_losses(spec, coil, winding_geometry(spec, coil).spirals, conductivity, tolerance)


@lru_cache(maxsize=4)
def _spectrum(geometry: WindingGeometry, nearest: float) -> CurrentSpectrum:
    return reflected_by(geometry, nearest)


@lru_cache(maxsize=2)
def _beside_each_other(spec: CoilSpec, coils: tuple[Coil, ...], own: float, error: float) -> tuple[Array, Array]:
    return inductance_matrix(own, error, [(coil, winding_geometry(spec, coil)) for coil in coils])


def _circuits(
    layout: Layout,
    winding: _Winding,
    matrix: Array,
    assembly: Assembly,
    shares: TargetShares,
    spared: Mapping[str, Mapping[int, float]],
) -> list[CoilCircuit]:
    spec, first = layout.spec, layout.coils[0]
    conductivity, loss = winding.conductivity, winding.loss
    resistance = winding_resistance(spec.coil, first, conductivity)
    own = self_capacitance(first, spec)
    distances = _distances(layout)
    beside = sorted({d for row in distances for d in row if d > 0.0})
    names = [coil.name for coil in layout.coils]
    reflections = _reflections(winding, assembly, beside, names, shares)
    circuits = []
    for coil in layout.coils:
        leads = _leads(coil, layout, conductivity, spared[coil.name])
        circuits.append(CoilCircuit(coil.name, winding.inductance, resistance, conductivity, loss, leads,
                                    own + leads.capacitance, reflections[coil.name], own))  # fmt: skip
    if len(circuits) == 1:
        return circuits
    return [
        replace(circuit, neighbours=_neighbours(k, circuits, matrix, distances, spec))
        for k, circuit in enumerate(circuits)
    ]


def _neighbours(
    active: int, circuits: list[CoilCircuit], matrix: Array, distances: list[list[float]], spec: SensorSpec
) -> dict[str, Circuit]:
    # The state "free" is the coil alone: nothing around it, no neighbour either.
    def of_state(state: str) -> Circuit:
        reflection = circuits[active].reflections[state]

        def mutual(i: int, j: int, frequencies: Array) -> ComplexArray:
            return np.asarray(matrix[i, j] + reflection.mutual(distances[i][j], frequencies))

        own = [lambda at, c=c: c.own(state, at) for c in circuits]
        return idle_neighbours(active, own, mutual, spec.readout)

    return {state: of_state(state) for state in circuits[active].reflections if state != FREE}


def _distances(layout: Layout) -> list[list[float]]:
    # Alike distances get alike numbers, so that each is reflected once.
    return [[round(math.dist(a.centre, b.centre), 9) for b in layout.coils] for a in layout.coils]


def _reflections(
    winding: _Winding,
    assembly: Assembly,
    distances: list[float],
    names: Sequence[str],
    shares: TargetShares,
) -> dict[str, dict[str, Reflection | NoReflection]]:
    # By coil and state; coils under alike parts of the target have one in common.
    known: dict[tuple[str, tuple[float, float]], Reflection | NoReflection] = {}
    found: dict[str, dict[str, Reflection | NoReflection]] = {name: {} for name in names}
    for around in assembly.states:
        spectrum = winding.spectrum
        nothing = spectrum is None or (around.above is None and around.below is None)
        for name in names:
            share = shares.of(name, around.name)
            if (around.name, share) not in known:
                known[around.name, share] = (
                    NoReflection()
                    if nothing or spectrum is None
                    else Reflection(spectrum, around, distances, share, winding.crowding)
                )
            found[name][around.name] = known[around.name, share]
    return found


def _nearest(geometry: WindingGeometry, assembly: Assembly) -> float | None:
    # Least distance (m) of metal from any layer's mid-plane in any state; None without metal.
    heights = [layer.z for layer in geometry.spirals or geometry.tracks]
    # a pad thinner or smaller by one sigma is not much nearer, and only a difference is taken of it
    small = (PAD, PAD_SIZE)
    ranges = [around for (_, cause), pair in assembly.ranges.items() if cause not in small for around in pair]
    states = [*assembly.states, *ranges]
    above = [s.above.distance - max(heights) for s in states if s.above]
    below = [s.below.distance + min(heights) for s in states if s.below]
    return max(min([*above, *below]), LEAST_DISTANCE) if above or below else None


LEAST_DISTANCE = 10e-6
"""Distance (m) from a layer's mid-plane below which metal is taken to be there."""


def _leads(coil: Coil, layout: Layout, conductivity: float, spared: Mapping[int, float]) -> LeadEstimate:
    if not coil.series:
        return NO_LEADS
    return estimate_leads(coil, layout.spec.fpc.stackup, conductivity, spared)


def _self_resonance(circuit: CoilCircuit) -> float:
    inductance = circuit.inductance + circuit.leads.inductance
    return resonance_frequency(inductance, max(circuit.self_capacitance, 1e-16))


def _coil_estimate(
    coil: Coil,
    circuit: CoilCircuit,
    tank: Tank,
    states: Mapping[str, StateEstimate],
    winding: _Winding,
    failed: Mapping[str, str],
    damped: Mapping[str, float],
) -> CoilEstimate:
    free = states.get(FREE, NO_STATE)
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
        capacitance=tank.capacitance(circuit),
        self_capacitance=circuit.self_capacitance,
        sensor_frequency=free.frequency,
        parallel_resistance=free.parallel_resistance,
        quality_factor=free.quality_factor,
        self_resonance=_self_resonance(circuit),
        trace_length=math.fsum(w.path.length for w in coil.windings),
        states=states,
        lead_parts=circuit.leads.parts,
        winding_capacitance=circuit.winding_capacitance,
        apparent_inductance=free.apparent_inductance,
        failed_states=failed,
        overdamped=damped,
        bend_inductance=circuit.loss.direct_change,
        inductance_parts=_inductance_parts(circuit, free.inductance),
        resistance_error=winding.bound.relative(circuit.loss.resistance_ratio(free.frequency), free.frequency)
        if FREE in states
        else None,
    )


def _inductance_parts(circuit: CoilCircuit, terminal: float) -> dict[str, float]:
    """What the terminal inductance (H) of the coil alone is made of, in the order of PARTS; crowding is what is left of
    it (`loss` has that, too, and `terminal` is interpolated to within 3e-5 of itself).
    """
    parts = {"winding": circuit.inductance, "bends": circuit.loss.direct_change, **circuit.leads.parts}
    parts["crowding"] = terminal - math.fsum(parts.values())
    return {name: parts.get(name, 0.0) for name in PARTS}


NO_STATE = StateEstimate(FREE, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
"""Stands for a free state that has no numbers."""
