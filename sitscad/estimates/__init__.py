"""From a layout to its electrical numbers: the one meeting point of what is drawn and of physics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitscad.estimates.assembly import Assembly, Reflection, assemble, no_reflection
from sitscad.estimates.leads import (
    NO_LEADS,
    LeadEstimate,
    between_layers,
    estimate_leads,
    is_connected,
    mean_permittivity,
)
from sitscad.estimates.neighbours import inductance_matrix
from sitscad.estimates.tank import CoilCircuit, Tank, choose_capacitor, settle, state_estimates
from sitscad.estimates.values import (
    CoilEstimate,
    CrossCheck,
    Estimates,
    ReadoutEstimate,
    StateEstimate,
)
from sitscad.estimates.windings import (
    METHODS,
    Method,
    WindingGeometry,
    choose_method,
    equivalent_spirals,
    winding_geometry,
)
from sitscad.layout.board import Coil, Layout
from sitscad.physics.capacitance import crossing_layers, turn_capacitance, winding_capacitance
from sitscad.physics.eddy_target import CurrentSpectrum, polyline_spectrum, spiral_spectrum
from sitscad.physics.proximity import winding_loss
from sitscad.physics.resistance import COPPER_CONDUCTIVITY, track_resistance
from sitscad.physics.resonator import resonance_frequency
from sitscad.spec.sensor import SensorSpec

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


def estimate(layout: Layout, method: str | None = None, tolerance: float | None = None) -> Estimates:
    """Everything electrical about a layout, free and mounted.

    `method` names a row of METHODS for the winding's inductance; otherwise the cheapest one is taken whose stated error
    meets `tolerance` (relative; 1e-4 when None). Alike coils are solved once. Works without leads too, where the layout
    found no room for them: the contacts then see the winding alone, and a note says so. Raises ValueError for a method
    that does not exist or does not serve the shape.
    """
    spec = layout.spec
    first = layout.coils[0]
    geometry = winding_geometry(spec.coil, first)
    chosen = choose_method(geometry, method, tolerance)
    inductance = chosen.solve(geometry)
    assert inductance is not None
    geometries = [(coil, winding_geometry(spec.coil, coil)) for coil in layout.coils]
    matrix = inductance_matrix(inductance, geometries)
    assembly = assemble(spec)
    circuits = _circuits(layout, geometry, inductance, assembly)
    resonance = min(_self_resonance(circuit) for circuit in circuits)
    capacitor, reason = choose_capacitor(circuits, spec.readout, resonance)
    readout = settle(circuits, spec.readout, capacitor, reason)
    coils = tuple(
        _coil_estimate(coil, circuit, spec, readout, chosen, geometry)
        for coil, circuit in zip(layout.coils, circuits, strict=True)
    )
    return Estimates(
        coils=coils,
        inductance_matrix=tuple(tuple(float(value) for value in row) for row in matrix),
        readout=readout,
        compression=assembly.compression,
        gaps=assembly.gaps,
        cross_checks=tuple(_cross_checks(first.name, geometry, inductance)),
        notes=(*_layout_notes(layout), *assembly.notes),
    )


def _circuits(layout: Layout, geometry: WindingGeometry, inductance: float, assembly: Assembly) -> list[CoilCircuit]:
    spec, first = layout.spec, layout.coils[0]
    loss = winding_loss(equivalent_spirals(geometry, first), COPPER_CONDUCTIVITY, _slices(geometry))
    resistance = _winding_resistance(first, spec)
    own = _winding_capacitance(first, spec)
    reflections = _reflections(geometry, assembly)
    circuits = []
    for coil in layout.coils:
        leads = _leads(coil, layout)
        capacitance = own + leads.capacitance
        circuits.append(CoilCircuit(coil.name, inductance, resistance, COPPER_CONDUCTIVITY, loss, leads, capacitance,
                                    reflections))  # fmt: skip
    return circuits


def _slices(geometry: WindingGeometry) -> int:
    # Many turns average over each other's offsets: fewer azimuths do.
    rings = geometry.turns * len(geometry.spec.layers)
    return 4 if rings <= 64 else 2 if rings <= 160 else 1


def _reflections(geometry: WindingGeometry, assembly: Assembly) -> dict[str, Callable[[float], tuple[float, float]]]:
    spectrum: CurrentSpectrum | None = None
    found: dict[str, Callable[[float], tuple[float, float]]] = {}
    for around in assembly.states:
        if around.above is None and around.below is None:
            found[around.state] = no_reflection
            continue
        if spectrum is None:
            spectrum = _spectrum(geometry, assembly)
        found[around.state] = Reflection(spectrum, around)
    return found


def _spectrum(geometry: WindingGeometry, assembly: Assembly) -> CurrentSpectrum:
    layers = geometry.spirals or geometry.tracks
    heights = [layer.z for layer in layers]
    above = [s.above.distance - max(heights) for s in assembly.states if s.above]
    below = [s.below.distance + min(heights) for s in assembly.states if s.below]
    nearest = max(min([*above, *below]), 10e-6)
    if geometry.spirals:
        return spiral_spectrum(geometry.spirals, nearest)
    return polyline_spectrum(geometry.tracks, nearest)


def _leads(coil: Coil, layout: Layout) -> LeadEstimate:
    if not coil.series:
        return NO_LEADS
    return estimate_leads(coil, layout.spec.fpc.stackup, COPPER_CONDUCTIVITY)


def _winding_resistance(coil: Coil, spec: SensorSpec) -> float:
    return math.fsum(
        track_resistance(w.path.length, spec.coil.trace_width, w.thickness, COPPER_CONDUCTIVITY) for w in coil.windings
    )


def _winding_capacitance(coil: Coil, spec: SensorSpec) -> float:
    length = coil.windings[0].path.length
    c, stackup = spec.coil, spec.fpc.stackup
    if len(coil.windings) == 1:
        permittivity = 0.5 * (1.0 + mean_permittivity(stackup))
        return turn_capacitance(length, c.turns, c.trace_width, c.trace_spacing, permittivity)
    gaps = []
    for one, other in zip(coil.windings, coil.windings[1:], strict=False):
        distance, permittivity = between_layers(stackup, *sorted((one.layer, other.layer)))
        gaps.append(crossing_layers(length, c.trace_width, c.pitch, distance, permittivity))
    return winding_capacitance(gaps)


def _self_resonance(circuit: CoilCircuit) -> float:
    inductance = circuit.inductance + circuit.leads.inductance
    return resonance_frequency(inductance, max(circuit.self_capacitance, 1e-16))


def _coil_estimate(
    coil: Coil,
    circuit: CoilCircuit,
    spec: SensorSpec,
    readout: ReadoutEstimate,
    method: Method,
    geometry: WindingGeometry,
) -> CoilEstimate:
    tank = Tank(readout.capacitance, spec.readout)
    states = state_estimates(circuit, tank, readout.drive_code, readout.high_current)
    free = states["free"]
    return CoilEstimate(
        name=coil.name,
        centre=(coil.centre.x, coil.centre.y),
        winding_inductance=circuit.inductance,
        inductance_error=method.error(geometry),
        method=method.name,
        terminal_inductance=free.inductance,
        lead_inductance=circuit.leads.inductance,
        resistance_dc=circuit.resistance,
        resistance_ac=circuit.winding_resistance(free.frequency),
        terminal_resistance_dc=circuit.resistance + circuit.leads.resistance,
        capacitance=tank.capacitance(circuit),
        self_capacitance=circuit.self_capacitance,
        sensor_frequency=free.frequency,
        parallel_resistance=free.parallel_resistance,
        quality_factor=free.quality_factor,
        self_resonance=_self_resonance(circuit),
        trace_length=math.fsum(w.path.length for w in coil.windings),
        states=states,
    )


def _cross_checks(name: str, geometry: WindingGeometry, inductance: float) -> list[CrossCheck]:
    found = []
    for method in METHODS:
        if method.is_cross_check and geometry.spec.shape in method.shapes:
            value = method.solve(geometry)
            if value is not None and np.isfinite(value):
                found.append(CrossCheck(name, method.name, value, value / inductance - 1.0, method.is_valid(geometry),
                                        method.validity))  # fmt: skip
    return found


def _layout_notes(layout: Layout) -> list[str]:
    notes = []
    missing = [coil.name for coil in layout.coils if not coil.is_closed_circuit or not coil.series]
    if missing:
        notes.append(
            f"{', '.join(missing)}: the layout found no room for all leads: terminal values hold only what is drawn"
        )
    elif not all(is_connected(coil) for coil in layout.coils):
        notes.append("some leads do not meet end to end: the terminal values hold what is drawn")
    if layout.spec.coil.shape != "circle":
        notes.append("alternating-current resistance of this shape is that of a round winding with the same perimeter")
    return notes
