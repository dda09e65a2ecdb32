"""Inductance, resistance and quality factor of the coils at a frequency that the user chooses, without a tank."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sitscad.assembly.places.state import FREE
from sitscad.basics.quantities import AT_FREQUENCY, document
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.estimates.circuits.coils import coil_circuits, self_resonance
from sitscad.estimates.circuits.solved_winding import SolvedWindings
from sitscad.estimates.circuits.tank import CoilCircuit
from sitscad.estimates.coil_estimates import crowding_error
from sitscad.estimates.states.steps import NO_STATE, solve_windings
from sitscad.estimates.targets.finite_target import NO_RATIOS
from sitscad.kernels.electromagnetics.resonator import apparent_impedance
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.layout.board import Layout


class FrequencyError(ValueError):
    """Error for a frequency at which the coils cannot be estimated. Its text gives the reason."""


class SeriesImpedance:
    """Inductance (H) and resistance (ohm) of a series circuit at a frequency (Hz)."""

    frequency: float
    """Frequency (Hz)."""
    inductance: float
    """Inductance (H) in series."""
    resistance: float
    """Resistance (ohm) in series."""

    @property
    def quality_factor(self) -> float:
        """Quality factor, 2 pi f L / R."""
        return 2.0 * math.pi * self.frequency * self.inductance / self.resistance

    @property
    def parallel_resistance(self) -> float:
        """Parallel resistance (ohm) at resonance, if a lossless capacitor is across the series circuit."""
        return self.resistance * (1.0 + self.quality_factor**2)


@record
class CoilAtFrequency(SeriesImpedance):
    """Electrical values of one coil at a `frequency` (Hz), without target and tank, with its neighbours open.

    ``winding_inductance`` (H) and ``winding_resistance`` (ohm) are for the winding without leads, each with its
    relative error bound. ``inductance`` (H) and ``resistance`` (ohm) are between the contacts, leads included;
    ``resistance_error`` is the relative error bound. ``apparent_inductance`` (H) and ``apparent_resistance`` (ohm) are
    the readings of an LCR meter at the contacts, with the coil's own capacitance across them. ``self_resonance`` (Hz)
    is the coil's resonance with this capacitance.
    """

    coil: str
    """Name of the coil."""
    frequency: float
    winding_inductance: float
    winding_inductance_error: float
    winding_resistance: float
    winding_resistance_error: float
    inductance: float
    resistance: float
    resistance_error: float
    apparent_inductance: float
    apparent_resistance: float
    self_resonance: float

    @property
    def winding_quality_factor(self) -> float:
        """Quality factor 2 pi f L / R of the winding without leads."""
        return 2.0 * math.pi * self.frequency * self.winding_inductance / self.winding_resistance

    def document(self) -> dict[str, Any]:
        """Return the values for JSON, under their names in documents."""
        return document(self, AT_FREQUENCY)


@one_thread
def coils_at(
    layout: Layout, frequencies: tuple[float, ...], method: str | None = None, tolerance: float | None = None
) -> tuple[CoilAtFrequency, ...]:
    """Estimate every coil of a layout at each frequency (Hz), at the temperature of the spec.

    Raises
    ------
    FrequencyError
        if a coil resonates with its own capacitance at or below a frequency, or the loss model does not resolve it.
    """
    if not frequencies:
        return ()
    windings = solve_windings(layout, None, method, tolerance)
    circuits = coil_circuits(windings.layout, windings.winding, windings.matrix, windings.assembly, NO_RATIOS)
    return tuple(coil_at(circuit, windings, frequency) for frequency in frequencies for circuit in circuits)


def coil_at(circuit: CoilCircuit, windings: SolvedWindings, frequency: float) -> CoilAtFrequency:
    """Estimate one coil of a layout at a frequency (Hz). Raises FrequencyError under the conditions of `coils_at`."""
    limit = self_resonance(circuit)
    if frequency >= limit:
        raise FrequencyError(
            f"coil {circuit.name} resonates with its own capacitance at {show(limit, 'Hz', 3)}: at "
            f"{show(frequency, 'Hz')} it is a capacitor, and has no inductance to estimate"
        )
    if not circuit.loss.is_resolved(frequency):
        raise FrequencyError(f"coil {circuit.name} at {show(frequency, 'Hz')}: the current within the tracks cannot be "
                             "resolved: their spacing is far smaller than their width or thickness")
    winding, at = windings.winding, np.array([frequency])
    change = float(circuit.loss.inductance_changes(at)[0])
    total = circuit.inductance + change
    (inductance,), (resistance,) = (values.tolist() for values in circuit.impedance_with_open_neighbours(FREE, at))
    state = replace(NO_STATE, inductance=inductance, resistance=resistance, frequency=frequency)
    ratio = circuit.loss.resistance_ratio(frequency)
    read = apparent_impedance(inductance, resistance, circuit.self_capacitance, frequency)
    crowding = crowding_error(circuit.inductance, change)
    return CoilAtFrequency(
        circuit.name, frequency, total, (winding.inductance_error * circuit.inductance + crowding) / total,
        circuit.resistance * ratio, winding.bound.relative(ratio, frequency), inductance, resistance,
        winding.resistance_error(circuit, state, windings.spec.coil),
        read.imag / (2.0 * math.pi * frequency), read.real, limit,
    )
