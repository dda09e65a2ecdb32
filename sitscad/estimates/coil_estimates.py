"""Results of an estimate for coils, states and readout, and their JSON document."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from sitscad.assembly.places.state import PRESSED, REST, State
from sitscad.basics.check_results import Signal
from sitscad.basics.quantities import (
    COIL,
    COMPRESSION,
    RATES,
    SCAN_TIMES,
    STATE,
    TANK,
    TANK_AND_DRIVE,
    deviations,
    document,
    finite,
)
from sitscad.basics.record import record
from sitscad.basics.units import count_text, show
from sitscad.basics.version import __version__
from sitscad.estimates.loads.pressing import PressingScatter
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.converters.converter import Channel, Converter
from sitscad.kernels.mechanics.elastomer import Compression


@record
class StateEstimate:
    """Electrical values of one coil in one state: H, ohm, Hz, volts peak.

    `inductance` and `resistance` are at the contacts, at the coil's own frequency in this state. Frequency, parallel
    resistance, quality factor and `amplitude` belong to the tank at the converter's pins, with cable and capacitors.
    `coil_amplitude` is the amplitude at the contacts.

    `apparent_inductance` is the reading of a meter at the contacts, with the coil's own capacitance across it.
    `converter_inductance` is 1 / (C (2 pi f)^2), where C is the readout's `conversion_capacitance`. `quantum` is the
    step of the measured inductance (H), and `noise` its standard deviation (H) by quantisation alone. `spread` holds
    the standard deviations by manufacture.

    `resistance_error` is the relative error bound of the computed resistance. It includes the error of a finite
    target's loss. `target_change` (H) is the target's change of the winding's inductance, for evenly spread current.
    `target_change_error` is its stated error, relative to the larger of the change and 1 % of the free winding's
    inductance, as in a response. Both are None if there is no target. `spread` includes this error, too.
    """

    state: str
    inductance: float
    resistance: float
    frequency: float
    parallel_resistance: float
    quality_factor: float
    amplitude: float
    apparent_inductance: float | None = None
    coil_amplitude: float | None = None
    quantum: float | None = None
    noise: float | None = None
    spread: StateSigmas | None = None
    converter_inductance: float | None = None
    resistance_error: float | None = None
    target_change: float | None = None
    target_change_error: float | None = None

    def __repr__(self) -> str:
        """Return a line with inductance, frequency and parallel resistance."""
        figures = (show(self.inductance, "H"), show(self.frequency, "Hz"), show(self.parallel_resistance, "ohm"))
        return f"<StateEstimate {self.state}: {', '.join(figures)}>"


@record
class MeterReadings:
    """Readings of an LCR meter on one coil of the bare board, far from metal.

    `inductance` (H) and `resistance` (ohm) are in series between the contacts, at `frequency` (Hz). Each has its
    standard deviation by manufacture, `inductance_sigma` and `resistance_sigma`. `resistance_error` is the relative
    error bound of the computed resistance. `direct` is the direct-current resistance (ohm), and `direct_sigma` its
    standard deviation.
    """

    coil: str
    frequency: float
    inductance: float
    resistance: float
    inductance_sigma: float
    resistance_sigma: float
    resistance_error: float
    direct: float
    direct_sigma: float


METER_FREQUENCY = 100e3  # Highest frequency (Hz) of a usual LCR meter


PARTS = ("winding", "bends", "stubs", "leads", "tail", "coupling", "vias", "crowding")
"""Names of the parts of the terminal inductance, in this order.

"winding" is for direct current that is even across each track. "bends" is the reduction because direct current takes
the inside of corners. "stubs" to "vias" are the parts of the leads, as in `lead_parts`. "crowding" is the reduction by
current crowding at the sensor frequency.
"""

CROWDING_ERROR = 3e-3
"""Largest error of the inductance change by current crowding, as a fraction of the direct-current inductance.

Source: comparison with filament models, 0.1 to 20 MHz (tests/validation/test_alternating_current.py)."""


def crowding_error(inductance: float, change: float) -> float:
    """Return the error bound (H) of an inductance change by current crowding.

    `inductance` (H) is for direct current, `change` (H) is its change by current crowding. The bound never exceeds the
    magnitude of the change.
    """
    return min(CROWDING_ERROR * inductance, abs(change))


@record
class StateSigmas:
    """Standard deviations of a state's values by manufacturing tolerances: H, ohm, Hz, ohm, V.

    `causes` maps each value to the tolerance with the largest contribution. `shifts` maps each tolerance to the signed
    changes by one standard deviation: inductance (H), frequency (Hz), resistance (ohm), R_P (ohm). All states of a coil
    have these tolerances in common. ``thickest_copper`` is the change of R_P (ohm) if foil and plating are both as
    thick as the fabricator may deliver.
    """

    inductance: float
    resistance: float
    frequency: float
    parallel_resistance: float
    amplitude: float
    causes: Mapping[str, str] = field(default_factory=dict)
    shifts: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    thickest_copper: float = 0.0


@record
class CoilEstimate:
    """Electrical values of one coil, in SI units.

    `winding_inductance` and `resistance_dc` are for the spiral layers at direct current. `resistance_ac` is for these
    layers at `sensor_frequency`, with the relative error bound `resistance_error`. `winding_inductance` assumes current
    that is even across every track; `inductance_error` is its relative bound. `terminal_*` are at the contacts in free
    air, with leads and tail.

    Direct current crowds to the inside of bends and arcs. `bend_inductance` (negative) is the change by this crowding;
    states and terminal values include it. `inductance_parts` (see PARTS) add up to `terminal_inductance` at
    `sensor_frequency`. `lead_parts` divides `lead_inductance` by name. `apparent_inductance` belongs to the free state.

    `capacitance` is for the whole tank, `self_capacitance` for winding, leads and tail together, and
    `winding_capacitance` for the winding. `inner_diameter` is measured across the inner copper edges, for a long coil
    along its shorter side.

    `failed_states` gives the reason for each state in which the model fails or the tank is overdamped. Such a state is
    absent from `states`. If the free state is absent, its values are NaN. `overdamped` holds the quality factors of
    tanks that do not oscillate.

    `press_share` is the ratio of two changes from rest to pressed: with the coil's own pad, and with the mean pad of
    all cells. States are for the mean pad. Sensitivities include the ratio.
    """

    name: str
    centre: tuple[float, float]
    winding_inductance: float
    inductance_error: float
    method: str
    terminal_inductance: float
    lead_inductance: float
    resistance_dc: float
    resistance_ac: float
    terminal_resistance_dc: float
    capacitance: float
    self_capacitance: float
    sensor_frequency: float
    parallel_resistance: float
    quality_factor: float
    self_resonance: float
    trace_length: float
    states: Mapping[str, StateEstimate]
    lead_parts: Mapping[str, float] = field(default_factory=dict)
    winding_capacitance: float | None = None
    inner_diameter: float = math.nan
    apparent_inductance: float | None = None
    failed_states: Mapping[str, str] = field(default_factory=dict)
    overdamped: Mapping[str, float] = field(default_factory=dict)
    bend_inductance: float | None = None
    inductance_parts: Mapping[str, float] = field(default_factory=dict)
    resistance_error: float | None = None
    press_share: float = 1.0

    def __repr__(self) -> str:
        """Return a line with inductance and resistance of the winding, and the states."""
        figures = f"{show(self.winding_inductance, 'H')}, {show(self.resistance_ac, 'ohm')}"
        return f"<CoilEstimate {self.name}: {figures}, states {', '.join(self.states)}>"

    def sensitivity(self, force: float | None) -> tuple[float, float] | None:
        """Return the mean changes per newton of contact inductance (H/N) and of frequency (Hz/N).

        They are the changes from rest to the pressed state over the force (N). None if a state or the force is missing.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or not force:
            return None
        force /= self.press_share
        return (pressed.inductance - rest.inductance) / force, (pressed.frequency - rest.frequency) / force

    def sensitivity_sigma(self, force: float | None) -> tuple[float, float] | None:
        """Return the standard deviations of `sensitivity` (H/N, Hz/N).

        Both states share each tolerance, so it acts on their difference. None if a state, its spread or the force is
        missing.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or not force or rest.spread is None or pressed.spread is None:
            return None
        force /= self.press_share
        before, after = rest.spread.shifts, pressed.spread.shifts
        nothing = (0.0, 0.0, 0.0, 0.0)
        causes = sorted({*before, *after})
        changes = [[after.get(c, nothing)[k] - before.get(c, nothing)[k] for c in causes] for k in range(2)]
        return math.hypot(*changes[0]) / force, math.hypot(*changes[1]) / force

    @property
    def lead_capacitance(self) -> float | None:
        """Capacitance (F) of leads and tail. None if the winding's capacitance is unknown."""
        return None if self.winding_capacitance is None else self.self_capacitance - self.winding_capacitance

    @property
    def resistance_change(self) -> tuple[float, float] | None:
        """Change of contact resistance (ohm) from rest to pressed, and its error bound (ohm).

        Both states err in the same direction, so the bound is the difference of their bounds. The target's own loss
        grows while the target takes field away from jaw and tracks. With metal behind, both effects nearly cancel: the
        change may be below its bound, and its sign is then unknown. None if a state or its bound is missing.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or rest.resistance_error is None or pressed.resistance_error is None:
            return None
        before, after = rest.resistance_error * rest.resistance, pressed.resistance_error * pressed.resistance
        return pressed.resistance - rest.resistance, abs(after - before)

    def converter_sensitivity(self, force: float | None) -> tuple[float, float | None] | None:
        """Return the change per newton (H/N) of the inductance by the firmware's formula, and its sigma.

        The change is from rest to the pressed state by the force (N). It is larger than the change at the contacts,
        because the formula's C lacks the coil's own capacitance. At this fixed C the formula's L moves by -2 L df/f.
        The sigma is None if the scatter is unknown.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or not force:
            return None
        if rest.converter_inductance is None or pressed.converter_inductance is None:
            return None
        force /= self.press_share
        change = (pressed.converter_inductance - rest.converter_inductance) / force
        if rest.spread is None or pressed.spread is None:
            return change, None
        scale = -2.0 * rest.converter_inductance / rest.frequency
        later = -2.0 * pressed.converter_inductance / pressed.frequency
        before, after = rest.spread.shifts, pressed.spread.shifts
        nothing = (0.0, 0.0, 0.0, 0.0)
        moved = (later * after.get(c, nothing)[1] - scale * before.get(c, nothing)[1]
                 for c in sorted({*before, *after}))
        return change, math.hypot(*moved) / force


@record
class ReadoutEstimate:
    """Converter settings and the scan times that follow from them.

    `capacitance` (F) is the tank capacitor, chosen for `capacitance_reason`, and `capacitor_tolerance` its relative
    tolerance. `drive_code` serves all coils and working states. If channels have separate codes, `drive_codes` holds a
    code for each coil, and `drive_code` and `drive_current` are the strongest. `clock` is the reference clock (Hz).

    `dwell_time` (s) on a coil is the sum of `settle_time`, `conversion_time` and `switch_time`. `scan_rate` (Hz) counts
    complete scans. `read_back_time` (s) is for reading all results over I2C at its fastest clock. `supply_current` (A)
    is for all converters with their drive.

    `conversion_capacitance` (F) converts a measured frequency to inductance. It holds capacitor, pins and cable,
    without the coil's own capacitance. If no coil has a valid state, values that follow from states are None or NaN.
    """

    device: Converter
    capacitance: float
    capacitance_reason: str
    drive_code: int | None
    drive_current: float
    clock: float
    conversion: Conversion | None
    dwell_time: float
    scan_rate: float
    high_current: bool
    capacitor_tolerance: float | None = None
    settle_time: float | None = None
    conversion_time: float | None = None
    switch_time: float | None = None
    read_back_time: float | None = None
    supply_current: float | None = None
    conversion_capacitance: float | None = None
    drive_codes: tuple[int, ...] = ()

    def code_of(self, coil: int) -> int | None:
        """Return the drive code of a coil, by its number from 0."""
        return self.drive_codes[coil] if self.drive_codes else self.drive_code

    @property
    def result_interval(self) -> float | None:
        """Time (s) between results of a converter that reads a single coil and settles once."""
        return None if self.settle_time is None else self.dwell_time - self.settle_time

    @property
    def readable_rate(self) -> float | None:
        """Complete scans per second (Hz) that I2C can transfer."""
        return 1.0 / self.read_back_time if self.read_back_time else None


@record
class CrossCheck:
    """Inductance (H) by a closed formula, its relative deviation, and whether the coil is in its range."""

    coil: str
    method: str
    inductance: float
    deviation: float
    is_valid: bool
    validity: str


@record
class Estimates:
    """All electrical values of a layout.

    `inductance_matrix` (H) is for currents that enter each coil at its outer end on layer 1; `inductance_matrix_error`
    (H) bounds its elements. `gaps` are distances (m) by name. `gap_sigmas` (m) are their standard deviations, and
    `compression_scatter` holds the pressed pad's. `normal_force` (N) belongs to the pressed state, and `temperature`
    (degrees Celsius) to copper and metals.

    `notes` name effects that the values leave out. `incomplete` names missing parts of the layout, which the contact
    values lack, too; None if the layout is complete. `no_cross_check` is the reason for an absent closed formula.

    `states` are the sensor's states, each with the target's pose. `target_band` holds the frequencies (Hz) at which the
    target was solved for the states. It is None if the target's effect is by correction ratios of an infinite plate.
    `metered` are meter readings of the bare board, empty unless requested (`IncomingTests.board`). `is_rough` marks
    screening estimates.

    `coils` leaves out the reference coil; matrices and `metered` have it last. `reference` is this coil, without a
    target and without the effect of its idle neighbours. None if there is no reference coil. Estimates of the sensing
    coils alone have `reference_drift` (per K) instead: the change of ln(frequency) of the reference coil by metal.
    `has_own_windings` is then True if the windings of that coil differ from the windings of the other coils.
    """

    coils: tuple[CoilEstimate, ...]
    inductance_matrix: tuple[tuple[float, ...], ...]
    readout: ReadoutEstimate
    compression: Compression | None
    gaps: Mapping[str, float]
    cross_checks: tuple[CrossCheck, ...]
    notes: tuple[str, ...]
    normal_force: float | None = None
    temperature: float = 20.0
    inductance_matrix_error: tuple[tuple[float, ...], ...] = ()
    compression_scatter: PressingScatter | None = None
    gap_sigmas: Mapping[str, float] = field(default_factory=dict)
    incomplete: str | None = None
    no_cross_check: str | None = None
    states: tuple[State, ...] = ()
    target_band: tuple[float, float] | None = None
    metered: tuple[MeterReadings, ...] = ()
    is_rough: bool = False
    reference: CoilEstimate | None = None
    reference_drift: float | None = None
    has_own_windings: bool = False

    def __repr__(self) -> str:
        """Return a line with the number of coils and the inductance of the first coil."""
        first = f"{self.coils[0].name} {show(self.coils[0].winding_inductance, 'H')}" if self.coils else ""
        states = ", ".join(state.name for state in self.states)
        return f"<Estimates of {count_text(len(self.coils), 'coil')}: {first}, states {states}>"

    @property
    def all_coils(self) -> tuple[CoilEstimate, ...]:
        """Coils in the order of the converter's channels: the sensing coils, then the reference coil."""
        return self.coils if self.reference is None else (*self.coils, self.reference)

    @property
    def sensing(self) -> Estimates:
        """Estimates of the sensing coils only, with the readout settings of all coils."""
        return self if self.reference is None else self.part(0, len(self.coils))

    @property
    def is_solved(self) -> bool:
        """Whether the target's effect is solved."""
        return self.target_band is not None

    @property
    def failed_states(self) -> dict[str, str]:
        """Reasons for states without values, by state. Empty if all states have values."""
        return {state: reason for coil in self.coils for state, reason in coil.failed_states.items()}

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Signal of each coil with a rest and a pressed state. Empty without required force, target or elastomer."""
        by_coil = (_coil_signal(coil, self.normal_force, self.readout) for coil in self.coils)
        return tuple(signal for signal in by_coil if signal is not None)

    @property
    def pressed_place(self) -> float | None:
        """Place along z (m) of the target in the pressed state. None if this state is missing."""
        return next((s.pose.z for s in self.states if s.name == PRESSED and s.pose is not None), None)

    def part(self, first: int, last: int) -> Estimates:
        """Return the estimates of coils `first` to `last` - 1 (from 0), with the readout settings of all coils."""
        selection, readout = slice(first, last), self.readout
        conversion = None if readout.conversion is None else readout.conversion.part(selection)
        matrices = self.inductance_matrix, self.inductance_matrix_error
        matrix, errors = (tuple(row[selection] for row in each[selection]) for each in matrices)
        readout = replace(readout, drive_codes=readout.drive_codes[selection], conversion=conversion)
        return replace(self, coils=self.coils[selection], inductance_matrix=matrix, inductance_matrix_error=errors,
                       readout=readout, metered=self.metered[selection], reference=None)

    def as_json(self, spec_path: str) -> dict[str, Any]:
        """Return the document of ``estimate --format json``, with SI units in its keys.

        Values are None if they are absent or not finite.
        """
        places = self.readout.device.coil_channels(len(self.all_coils))
        return {
            "sitscad": __version__,
            "spec": spec_path,
            "incomplete": self.incomplete,
            "coils": [_coil_document(coil, place, self.normal_force)
                      for coil, place in zip(self.coils, places, strict=False)],
            "reference": None if self.reference is None else _coil_document(self.reference, places[-1], None),
            "temperature_C": self.temperature,
            "inductance_matrix_H": [[finite(value) for value in row] for row in self.inductance_matrix],
            "inductance_matrix_error_H": [[finite(value) for value in row] for row in self.inductance_matrix_error],
            "readout": _readout_document(self.readout),
            "gaps_m": _numbers(self.gaps),
            "gaps_sigma_m": _numbers(self.gap_sigmas),
            "compression": _compression_document(self),
            "cross_checks": [
                {"coil": c.coil, "method": c.method, "inductance_H": finite(c.inductance), "valid": c.is_valid}
                for c in self.cross_checks
            ],
            "no_cross_check": self.no_cross_check,
            "notes": list(self.notes),
        }


def _numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    return {name: finite(value) for name, value in values.items()}


def _coil_document(coil: CoilEstimate, place: Channel, force: float | None) -> dict[str, Any]:
    """Return the JSON part of a coil: its values, channel `place`, and sensitivities to the normal `force` (N)."""
    change = coil.resistance_change or (None, None)
    inductance, frequency = coil.sensitivity(force) or (None, None)
    of_inductance, of_frequency = coil.sensitivity_sigma(force) or (None, None)
    formula, of_formula = coil.converter_sensitivity(force) or (None, None)
    return {
        "name": coil.name,
        "centre_m": [finite(coil.centre[0]), finite(coil.centre[1])],
        **document(coil, COIL),
        "lead_inductance_parts_H": _numbers(coil.lead_parts),
        "inductance_parts_H": _numbers(coil.inductance_parts),
        "resistance_change_ohm": finite(change[0]),
        "resistance_change_error_ohm": finite(change[1]),
        "failed_states": dict(coil.failed_states),
        "states": {
            name: document(state, STATE) | {"sigma": None if state.spread is None else deviations(state, TANK) | {
                "causes": dict(state.spread.causes)}}
            for name, state in coil.states.items()
        },
        "converter": place.converter,
        "channel": place.number,
        "i2c_bus": place.bus,
        "i2c_address": place.address,
        "inductance_H_per_N": finite(inductance),
        "frequency_Hz_per_N": finite(frequency),
        "sigma_inductance_H_per_N": finite(of_inductance),
        "converter_inductance_H_per_N": finite(formula),
        "sigma_converter_inductance_H_per_N": finite(of_formula),
        "sigma_frequency_Hz_per_N": finite(of_frequency),
    }


def _compression_document(estimates: Estimates) -> dict[str, Any] | None:
    """Return the JSON part of the pressed pad: compression and its scatter. None if there is no pad."""
    scatter = estimates.compression_scatter
    if estimates.compression is None:
        return None
    sigma = None if scatter is None else deviations(estimates, COMPRESSION) | {
        "cause": scatter.cause, "strain_by_cause": _numbers(scatter.sigmas_by_cause)}
    return document(estimates, COMPRESSION) | {"sigma": sigma}


def _readout_document(readout: ReadoutEstimate) -> dict[str, Any]:
    """Return the JSON part of the converter's settings: tank, drive, conversion and scan times."""
    conversion = readout.conversion
    part = {} if conversion is None else conversion.result_settings
    return {
        **document(readout, TANK_AND_DRIVE), **document(conversion, readout.device.law.SETTINGS),
        **document(readout, (*RATES, *SCAN_TIMES)), "drive_codes": list(readout.drive_codes) or None, **part,
    }


def _coil_signal(coil: CoilEstimate, force: float | None, readout: ReadoutEstimate) -> Signal | None:
    """Return the signal of a coil under a normal force (N). None if a state (rest, pressed) or the force is missing."""
    change = coil.sensitivity(force)
    if change is None or not force or not all(map(math.isfinite, change)):
        return None
    rest, pressed = coil.states[REST], coil.states[PRESSED]
    sigma = coil.sensitivity_sigma(force) or (None, None)
    ratio, conversion = coil.press_share, readout.conversion
    before, after = rest.converter_inductance, pressed.converter_inductance
    if before is None or after is None:
        before, after = rest.inductance, pressed.inductance
    return Signal(
        coil.name, force, rest.inductance, change[0], sigma[0], change[1], sigma[1],
        share=ratio * (after / before - 1.0),
        frequency_share=ratio * (pressed.frequency / rest.frequency - 1.0),
        steps=ratio * conversion.steps(rest.frequency, pressed.frequency) if conversion else None,
    )
