"""What an estimate says: one frozen value a coil, a state, the readout, and the document that programs read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from sitscad.assembly.places.state import PRESSED, REST, State
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
from sitscad.basics.units import counted, show
from sitscad.estimates.loads.pressing import PressingScatter
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.converters.converter import Channel, Converter
from sitscad.kernels.mechanics.elastomer import Compression


@record
class StateEstimate:
    """One coil in one state, at its contacts and its own frequency there: H, ohm, Hz, volts peak.

    Frequency, parallel resistance, quality factor and amplitude are the tank's at the converter's pins: cable and
    capacitors included; `coil_amplitude` is what is left of it at the contacts. `apparent_inductance` is what a meter
    there reads, the coil's own capacitance across it, `converter_inductance` what 1 / (C (2 pi f)^2) makes of the
    frequency, C being the readout's `conversion_capacitance`; `quantum` and `noise` (one sigma, of quantisation alone)
    are the step and the scatter of the measured inductance in henries; `spread` says how far manufacture scatters.
    `resistance_error` is how far off the computed resistance can be, relative, with what a finite target's loss may be
    off. `target_change` (H) is what the target alone changes of the winding's inductance, its current even, and
    `target_change_error` its stated error, relative to the larger of it and 1 % of the free winding's inductance, as
    in a response; both None without a target. What it may be off is in the spread, too.
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
    spread: Spread | None = None
    converter_inductance: float | None = None
    resistance_error: float | None = None
    target_change: float | None = None
    target_change_error: float | None = None

    def __repr__(self) -> str:
        """A line with inductance, frequency and parallel resistance."""
        figures = (show(self.inductance, "H"), show(self.frequency, "Hz"), show(self.parallel_resistance, "ohm"))
        return f"<StateEstimate {self.state}: {', '.join(figures)}>"


@record
class Metered:
    """What an LCR meter reads of one coil of the bare board, far from metal, at a `frequency` (Hz): inductance (H) and
    resistance (ohm) between the contacts in series, each with one sigma of manufacture, and how far off the computed
    resistance can be, relative; and the resistance to direct current (ohm) with its sigma.
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


METER_FREQUENCY = 100e3  # What a usual LCR meter goes up to (Hz)


PARTS = ("winding", "bends", "stubs", "leads", "tail", "coupling", "vias", "crowding")
"""What the terminal inductance is made of, in this order: the winding with evenly spread direct current; what direct
current makes less by cutting corners; the parts of `lead_parts`; what crowding takes away at the sensor frequency."""

CROWDING_ERROR = 3e-3
"""Largest error of the inductance change by current crowding, as a fraction of the direct-current inductance.

Source: comparison with filament models, 0.1 to 20 MHz (tests/validation/test_alternating_current.py)."""


def crowding_error(inductance: float, change: float) -> float:
    """Return the error bound (H) of the `change` (H) of a direct-current `inductance` (H) by current crowding."""
    return min(CROWDING_ERROR * inductance, abs(change))


@record
class Spread:
    """One standard deviation, by the tolerances of manufacture, of a state's numbers (H, ohm, Hz, ohm, V).

    `causes` names the tolerance that each of them owes most to; `shifts` are what one sigma of each tolerance does to
    inductance (H), frequency (Hz), resistance and R_P (ohm), with its sign: states of one coil share their causes.
    ``thickest_copper`` is what the thickest copper that is delivered (foil and plating both at their ends) does to R_P
    (ohm).
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
    """One coil. `winding_inductance` and `resistance_dc` are the spiral layers' at direct current, `resistance_ac` is
    theirs at `sensor_frequency`; `terminal_*` what the contacts see, leads and tail included, in free air.

    `winding_inductance` is that of a current which is even across every track, `inductance_error` its relative bound;
    `resistance_error` is that of `resistance_ac`;
    `bend_inductance` (negative) is what real direct current makes less by cutting corners: it crowds to the inside of
    bends and arcs; states and terminals have it in them. `inductance_parts` add up to `terminal_inductance`, at
    `sensor_frequency`: see PARTS. `capacitance` is the whole tank's, `self_capacitance` that of winding,
    leads and tail, `winding_capacitance` the winding's. `lead_parts` shares out `lead_inductance` by name.
    `apparent_inductance` is that of the free state. `failed_states` gives a reason for every state in which the model
    fails or the tank is overdamped: such a state is absent from `states`, and numbers of an absent free state are NaN.
    `inner_diameter` is measured across the inner copper edges; for a long coil, along its shorter side.
    `overdamped` are the quality factors of those whose tank does not oscillate. `press_share` is the
    change from rest to pressed with the coil's own pad over that with the mean pad of all cells, which states have:
    sensitivities have it. SI units.
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
        """A line with inductance and resistance of the winding, and the states."""
        figures = f"{show(self.winding_inductance, 'H')}, {show(self.resistance_ac, 'ohm')}"
        return f"<CoilEstimate {self.name}: {figures}, states {', '.join(self.states)}>"

    def sensitivity(self, force: float | None) -> tuple[float, float] | None:
        """Change of inductance at the contacts (H/N) and of frequency (Hz/N) from rest to pressed by that force (N):
        the secant.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or not force:
            return None
        force /= self.press_share
        return (pressed.inductance - rest.inductance) / force, (pressed.frequency - rest.frequency) / force

    def sensitivity_sigma(self, force: float | None) -> tuple[float, float] | None:
        """One sigma of the two (H/N, Hz/N): what each tolerance, which both states share, does to their difference."""
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
        """Capacitance (F) of leads and tail. None if the winding's is unknown."""
        return None if self.winding_capacitance is None else self.self_capacitance - self.winding_capacitance

    @property
    def resistance_change(self) -> tuple[float, float] | None:
        """Change of resistance at the contacts (ohm) from rest to pressed, and how far off it can be, at most: what the
        bounds of both states, which err alike, differ by. The target's own loss grows while it takes field away from
        jaw and tracks, so both nearly cancel where metal lies behind: the change may be less than its bound, and then
        its sign is not known.
        """
        rest, pressed = self.states.get(REST), self.states.get(PRESSED)
        if rest is None or pressed is None or rest.resistance_error is None or pressed.resistance_error is None:
            return None
        before, after = rest.resistance_error * rest.resistance, pressed.resistance_error * pressed.resistance
        return pressed.resistance - rest.resistance, abs(after - before)

    def converter_sensitivity(self, force: float | None) -> tuple[float, float | None] | None:
        """Change of the inductance that the firmware's formula gives (H/N) from rest to pressed by that force (N), and
        one sigma of it where the scatter is known.

        It is larger than the one at the contacts: the formula's C lacks the coil's own capacitance. At that fixed C the
        formula's L moves by -2 L df/f.
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
    """How the converter is set: tank capacitor (F) and why, the drive code for all coils and working states, the
    reference clock (Hz), the settings of its conversion, the time on one coil (s) and the complete scans a second that
    follow. Where channels have codes of their own `drive_codes` holds one a coil, and `drive_code` and `drive_current`
    are the strongest of them.

    `dwell_time` is `settle_time`, `conversion_time` and `switch_time`; `read_back_time` is that of all results over I2C
    at its fastest clock; `supply_current` (A) that of all converters with their drive; `capacitor_tolerance` is the
    part's, relative. `conversion_capacitance` (F) turns a measured frequency into inductance: capacitor, pins and
    cable, not the coil's own. Where no coil has a state left, what follows from states is None or NaN.
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
        """The drive code of the coil of that number, from 0."""
        return self.drive_codes[coil] if self.drive_codes else self.drive_code

    @property
    def result_interval(self) -> float | None:
        """Time (s) from one result to the next of a converter that reads one coil, which settles once."""
        return None if self.settle_time is None else self.dwell_time - self.settle_time

    @property
    def readable_rate(self) -> float | None:
        """Complete scans a second (Hz) that can be read over I2C."""
        return 1.0 / self.read_back_time if self.read_back_time else None


@record
class CrossCheck:
    """A closed formula beside the estimate: inductance (H), relative deviation, whether the coil lies in its range."""

    coil: str
    method: str
    inductance: float
    deviation: float
    is_valid: bool
    validity: str


@record
class Estimates:
    """Everything electrical about a layout. `inductance_matrix` (H) is for currents entering each coil at its outer end
    on layer 1, `inductance_matrix_error` (H) what its elements can be off by at most; `gaps` are distances in metres by
    name; `notes` say what the numbers leave out; `normal_force` (N) is the one of the pressed state, `temperature`
    (degrees Celsius) the one of copper and metals. `compression_scatter` and `gap_sigmas` (m) are one sigma of the
    pressed pad and of the gaps. `incomplete` says what the layout lacks, and the terminal values with it (None:
    nothing); `no_cross_check` why there is no closed formula beside the estimate;
    `states` are those that the sensor has, with the target's pose in each; `target_band` are the frequencies (Hz) at
    which the target was solved for them, None if its effect is by shares of an endless plate's; `metered` is what a
    meter reads of the bare board, empty where it was not asked for (`Incoming.board`); `is_rough` says that
    they were made for screening.
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
    metered: tuple[Metered, ...] = ()
    is_rough: bool = False

    def __repr__(self) -> str:
        """A line with the number of coils and the inductance of the first one."""
        first = f"{self.coils[0].name} {show(self.coils[0].winding_inductance, 'H')}" if self.coils else ""
        states = ", ".join(state.name for state in self.states)
        return f"<Estimates of {counted(len(self.coils), 'coil')}: {first}, states {states}>"

    @property
    def is_solved(self) -> bool:
        """Whether the target's effect is solved."""
        return self.target_band is not None

    @property
    def failed_states(self) -> dict[str, str]:
        """Why a state has no numbers, by its name. Empty if all states have numbers."""
        return {state: reason for coil in self.coils for state, reason in coil.failed_states.items()}

    @property
    def pressed_place(self) -> float | None:
        """The place along z (m) of the target in the state pressed; None without that state."""
        return next((s.pose.z for s in self.states if s.name == PRESSED and s.pose is not None), None)

    def part(self, first: int, last: int) -> Estimates:
        """Estimates of the coils from one number up to before another (from 0): converters are set as for all."""
        own, readout = slice(first, last), self.readout
        conversion = None if readout.conversion is None else readout.conversion.part(own)
        matrices = self.inductance_matrix, self.inductance_matrix_error
        matrix, errors = (tuple(row[own] for row in each[own]) for each in matrices)
        readout = replace(readout, drive_codes=readout.drive_codes[own], conversion=conversion)
        return replace(self, coils=self.coils[own], inductance_matrix=matrix, inductance_matrix_error=errors,
                       readout=readout, metered=self.metered[own])

    def as_json(self, spec_path: str) -> dict[str, Any]:
        """The document of ``estimate --format json``: SI units in the keys, None for what is absent or not finite."""
        from sitscad.basics.version import __version__

        return {
            "sitscad": __version__,
            "spec": spec_path,
            "incomplete": self.incomplete,
            "coils": [_coil_document(coil, place, self.normal_force)
                      for coil, place in zip(self.coils, self.readout.device.places(len(self.coils)), strict=True)],
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
    """One coil as it stands in JSON, with its channel and its sensitivities to force."""
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
        "states": {name: _state_document(state) for name, state in coil.states.items()},
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
    """Return the pressed pad for JSON. None without one."""
    scatter = estimates.compression_scatter
    if estimates.compression is None:
        return None
    sigma = None if scatter is None else deviations(estimates, COMPRESSION) | {
        "cause": scatter.cause, "strain_by_cause": _numbers(scatter.shares)}
    return document(estimates, COMPRESSION) | {"sigma": sigma}


def _state_document(state: StateEstimate) -> dict[str, Any]:
    """Return one state for JSON, with one sigma if that is known."""
    sigma = None if state.spread is None else deviations(state, TANK) | {"causes": dict(state.spread.causes)}
    return document(state, STATE) | {"sigma": sigma}


def _readout_document(readout: ReadoutEstimate) -> dict[str, Any]:
    """Return the converter's settings for JSON."""
    conversion = readout.conversion
    part = {} if conversion is None else conversion.result_settings
    return {
        **document(readout, TANK_AND_DRIVE), **document(conversion, readout.device.law.SETTINGS),
        **document(readout, (*RATES, *SCAN_TIMES)), "drive_codes": list(readout.drive_codes) or None, **part,
    }
