"""Oscillating circuit (tank) of each coil and state, choice of its capacitor, and the converter's settings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import islice

import numpy as np

from sitscad.assembly.places.state import working_states
from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate, StateEstimate
from sitscad.estimates.targets.assembly import Reflection
from sitscad.estimates.windings.leads import LeadEstimate
from sitscad.estimates.windings.neighbours import Circuit
from sitscad.kernels.converters.conversion import Demand
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.polynomials import barycentric_weights, chebyshev_points
from sitscad.kernels.electromagnetics.resonator import (
    EXACTLY,
    Network,
    Oscillation,
    Oscillations,
    apparent_inductance,
    oscillate,
)
from sitscad.spec.sensor import ReadoutSpec

E12 = (1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2)  # Preferred values of a decade (IEC 60063)
E24 = tuple(sorted((*E12, 1.1, 1.3, 1.6, 2.0, 2.4, 3.0, 3.6, 4.3, 5.1, 6.2, 7.5, 9.1)))  # All values sold

FREQUENCY_MARGIN = 0.95
"""Margin of sensor frequencies inside the converter's frequency limits when a capacitor is chosen, as a ratio.

Each sensor frequency is at most this fraction of the converter's highest frequency. The converter's lowest frequency is
at most this fraction of each sensor frequency. The margin is for tolerances of coil and capacitor.
"""

ROBUST_CAPACITANCE = 100e-12  # Below this (F), pins, tail and cable make up a good part of the tank's capacitance


@record(eq=False)
class CoilCircuit:
    """Circuit of one coil: winding, leads, own capacitance, and effects of metal in every state.

    `inductance` (H) and `resistance` (ohm) are the bare winding's at direct current, `conductivity` (S/m) is its
    copper's. `loss` is the added loss by alternating current. `self_capacitance` (F) is for winding and leads,
    `winding_capacitance` (F) for the winding alone. For each state, `reflections` holds the changes that metal causes,
    and `neighbours` the changes that idle coils cause. `curves` and `known` cache impedances. `oscillations` caches the
    tanks' oscillations by state and capacitor (F), for a single readout.
    """

    name: str
    inductance: float
    resistance: float
    conductivity: float
    loss: ProximityLoss
    leads: LeadEstimate
    self_capacitance: float
    reflections: Mapping[str, Reflection]
    winding_capacitance: float = 0.0
    neighbours: Mapping[str, Circuit] = field(default_factory=dict)
    curves: dict[tuple[str, str, int], Array] = field(default_factory=dict)
    known: dict[tuple[str, bytes], tuple[Array, Array]] = field(default_factory=dict)
    oscillations: dict[tuple[str, float], Oscillation] = field(default_factory=dict)

    def winding_resistance(self, frequency: float) -> float:
        """Return the resistance (ohm) of the winding without leads and metal at a frequency (Hz)."""
        return self.resistance * self.loss.resistance_ratio(frequency)

    def crowding(self, state: str, frequencies: Array) -> tuple[Array, Array]:
        """Return the inductance (n; H) and resistance (n; ohm) that eddy currents in the winding's tracks add.

        They are for a state at (n) frequencies (Hz), close to each other. Each is the value without metal plus the
        change by metal. In screening solutions this change is interpolated from the Chebyshev points of a band.
        """
        if self.reflections[state].is_rough:
            band = int(band_numbers(frequencies.mean()))
            weights = barycentric_weights(frequency_points(band), np.log(frequencies))
            change, lost = (weights @ self.impedance_nodes("crowding_changes", state, band)).T
        else:
            change, lost = self.crowding_changes(state, frequencies)
        added = self.resistance * (self.loss.resistance_ratios(frequencies) - 1.0)
        return self.loss.inductance_changes(frequencies) + change, added + lost

    def crowding_changes(self, state: str, frequencies: Array) -> tuple[Array, Array]:
        """Return the changes by metal of both results of `crowding`: inductance (n; H) and resistance (n; ohm)."""
        change = self.reflections[state].crowding(frequencies)
        return change.real, -2.0 * math.pi * frequencies * change.imag

    def impedance_with_open_neighbours(self, state: str, frequencies: Array) -> tuple[Array, Array]:
        """Return inductance (n; H) and resistance (n; ohm) between the contacts if all neighbouring coils are open.

        They are for a state at (n) frequencies (Hz).
        """
        key = state, frequencies.tobytes()
        if key not in self.known:
            change, added = self.reflections[state](frequencies)
            winding = self.resistance * self.loss.resistance_ratios(frequencies)
            leads = self.leads.resistances_at(frequencies, self.conductivity)
            inductance = self.inductance + self.loss.inductance_changes(frequencies) + self.leads.inductance + change
            self.known[key] = inductance, winding + leads + added
        return self.known[key]

    def exact_impedance(self, state: str, frequencies: Array) -> tuple[Array, Array]:
        """Return inductance (n; H) and resistance (n; ohm) between the contacts, with idle neighbouring coils.

        They are for a state at (n) frequencies (Hz) and computed without interpolation.
        """
        inductance, resistance = self.impedance_with_open_neighbours(state, frequencies)
        if state not in self.neighbours:
            return inductance, resistance
        change, added = self.neighbours[state](frequencies)
        return inductance + change, resistance + added

    def terminal_impedance(self, state: str, frequencies: Array) -> tuple[Array, Array]:
        """Return inductance (n; H) and resistance (n; ohm) between the contacts, interpolated over frequency.

        They are for a state at (n) frequencies (Hz).
        """
        inductance, resistance = terminal_impedances([self], [state], frequencies[None, None])
        return inductance[0, 0], resistance[0, 0]

    def impedance_nodes(self, of: str, state: str, band: int) -> Array:
        """Return inductance (H) and resistance (ohm) of a state at the Chebyshev points of a band: (`POINTS`, 2).

        `of` is the name of the method of this class that computes them.
        """
        key = of, state, band
        if key not in self.curves:
            self.curves[key] = np.stack(getattr(self, of)(state, np.exp(frequency_points(band))), axis=1)
        return self.curves[key]


def frequency_points(band: int) -> Array:
    """Return logarithms of the frequencies (Hz) at which impedances are computed in a band: its Chebyshev points."""
    low = math.log(LOWEST) + band * math.log(BAND)
    return chebyshev_points(low, low + math.log(BAND), POINTS)


def band_numbers(frequencies: Array) -> Index:
    """Return the band number (from 0) of each frequency (Hz)."""
    return np.floor(np.log(frequencies / LOWEST) / math.log(BAND)).astype(int)


def terminal_impedances(
    circuits: Sequence[CoilCircuit], states: Sequence[str], frequencies: Array
) -> tuple[Array, Array]:
    """Return inductances (H) and resistances (ohm) between the contacts: two arrays (coils, states, n).

    Each coil and state has its own `frequencies` (coils, states, n; Hz). Values are interpolated from the Chebyshev
    points of a band.
    """
    bands, impedance = band_numbers(frequencies), np.empty((2, *frequencies.shape))
    for band in set(bands.ravel().tolist()):
        inside = bands == band
        values = np.zeros((*frequencies.shape[:2], POINTS, 2))
        for coil, state in np.argwhere(inside.any(axis=2)).tolist():
            values[coil, state] = circuits[coil].impedance_nodes("exact_impedance", states[state], band)
        weights = barycentric_weights(frequency_points(band), np.log(frequencies[inside]))
        impedance[:, inside] = np.einsum("ni,nij->jn", weights, values[np.nonzero(inside)[:2]])
    return impedance[0], impedance[1]


POINTS = 6
"""Number of Chebyshev points in a band, from which impedances at other frequencies are interpolated."""


LOWEST = 1e6
"""Lowest frequency (Hz) of band 0."""

BAND = 11.0
"""Highest frequency of a band, divided by its lowest frequency. Band 0 is 1 to 11 MHz."""

HIGHEST = 0.999999 * LOWEST * BAND  # Last frequency (Hz) of the first band, which most converters do not reach


@record
class Tank:
    """Circuit between coil and converter: tank capacitor (F), pins and cable."""

    capacitor: float
    readout: ReadoutSpec

    @property
    def converter(self) -> Converter:
        """Converter of the readout, with its limits and formulas."""
        return self.readout.device

    def capacitance(self, circuit: CoilCircuit) -> float:
        """Return the total parallel capacitance (F) of a coil's tank: capacitor, pins, cable, tail and coil itself."""
        return self.conversion_capacitance + circuit.self_capacitance

    @property
    def conversion_capacitance(self) -> float:
        """Capacitance (F) with which a measured frequency is converted to inductance: capacitor, pins, cable."""
        cable = self.readout.cable.capacitance if self.readout.cable else 0.0
        return self.capacitor + self.converter.limit("pin_capacitance") + cable

    def cable_in_series(self) -> tuple[float, float]:
        """Return inductance (H) and resistance (ohm) of a cable that lies between coil and capacitor.

        Both are 0 if the capacitor is at the coil, or if there is no cable.
        """
        cable = self.readout.cable if self.readout.capacitor_at != "coil" else None
        return (0.0, 0.0) if cable is None else (cable.inductance, cable.resistance)

    def network(self, self_capacitance: float | Array) -> Network:
        """Return the two-port between the coil's contacts and the converter's pins.

        `self_capacitance` (F) is the coil's own. Half of the cable's capacitance is at either end (pi section).
        """
        cable = self.readout.cable
        half = 0.5 * cable.capacitance if cable else 0.0
        return Network(
            coil_side=self_capacitance + half,
            converter_side=self.converter.limit("pin_capacitance") + half,
            capacitor=self.capacitor,
            capacitor_at_coil=self.readout.capacitor_at == "coil",
            capacitor_resistance=self.converter.limit("capacitor_resistance"),
            inductance=cable.inductance if cable else 0.0,
            resistance=cable.resistance if cable else 0.0,
        )

    def oscillation(self, circuit: CoilCircuit, state: str) -> Oscillation:
        """Return the oscillation of a coil's tank in a state, with inductance and loss at the tank's frequency."""
        if (state, self.capacitor) not in circuit.oscillations:
            self.store_oscillations([circuit])
        return circuit.oscillations[state, self.capacitor]

    def store_oscillations(self, circuits: Sequence[CoilCircuit]) -> None:
        """Compute the tank's oscillation for several coils and all their states, and store it in the circuits.

        The circuits have equal states.
        """
        solved = iter(oscillations(circuits, self, np.array([self.capacitor])).as_list())
        for circuit in circuits:
            circuit.oscillations.update(((state, self.capacitor), next(solved)) for state in circuit.reflections)


ROUGHLY = 1e-3
"""Largest relative error of a tank's frequency if capacitors are compared for screening."""


def oscillations(
    circuits: Sequence[CoilCircuit], tank: Tank, capacitors: Array, is_rough: bool = False
) -> Oscillations:
    """Return oscillations (coils, states, n) of tanks that differ only in their capacitors (n; F).

    All circuits have equal states. If `is_rough`, each frequency has a relative error of at most `ROUGHLY`.
    """
    self_capacitances, inductance = np.array([
        (circuit.self_capacitance, circuit.inductance + circuit.leads.inductance) for circuit in circuits]).T
    states = list(circuits[0].reflections)
    network = replace(tank.network(self_capacitances[:, None, None]), capacitor=capacitors)
    plain = network.resonance(inductance[:, None, None]) / (2.0 * math.pi)
    # in rough solutions a converter within the first band needs no curve above it
    is_enough = is_rough and tank.converter.limit("sensor_frequency_max") < HIGHEST
    highest = HIGHEST if is_enough else math.inf
    return oscillate(
        network, lambda at: terminal_impedances(circuits, states, np.minimum(at, highest)),
        tank.converter.limit("drive_delay"), np.tile(plain, (1, len(states), 1)), ROUGHLY if is_rough else EXACTLY)


def state_estimates(circuit: CoilCircuit, tank: Tank, readout: ReadoutEstimate) -> dict[str, StateEstimate]:
    """Return the estimates of a coil by state, with its tank and drive. Empty if there is no drive code."""
    if readout.drive_code is None:
        return {}
    states, converter = {}, tank.converter
    for state in circuit.reflections:
        at = tank.oscillation(circuit, state)
        inductance, resistance = at.inductance, at.resistance
        volts = converter.amplitude(at.parallel_resistance, readout.drive_code, readout.high_current)
        states[state] = StateEstimate(
            state, inductance, resistance, at.frequency, at.parallel_resistance, at.quality_factor, volts,
            apparent_inductance=apparent_inductance(inductance, resistance, circuit.self_capacitance, at.frequency),
            converter_inductance=converter.inductance(at.frequency, tank.conversion_capacitance),
            coil_amplitude=volts * at.coil_share,
        )
    return states


def choose_capacitor(
    circuits: Sequence[CoilCircuit], readout: ReadoutSpec, self_resonance: float, is_rough: bool = False
) -> tuple[float, str]:
    """Return the tank capacitor (F) and the reason for it: the spec's value, or the most suitable E12 value.

    The most suitable value violates these limits least, in all states of all coils:

    * frequency: at least 5 % inside the converter's range, and at most 0.75 of the lowest `self_resonance` (Hz).
    * parallel resistance: inside the range of the data sheet.
    * amplitude: inside the low-noise window with one drive code (working states only).
    * capacitor: at least 100 pF.

    If several values have no violation, the value with the highest frequency is chosen, which has the highest parallel
    resistance.
    """
    if readout.capacitance is not None:
        return readout.capacitance, "given in the spec"
    if not any(circuit.reflections for circuit in circuits):
        return math.nan, "none chosen: no state of the coils could be estimated"
    converter = readout.device
    values = preferred_values(converter)
    tanks, some = [Tank(value, readout) for value in values], _extreme_circuits(circuits)
    each = iter(oscillations(some, tanks[0], np.array(values), is_rough).as_list())
    every = [(list(islice(each, len(values))), state in working_states(circuit.reflections))
             for circuit in some for state in circuit.reflections]
    scored = [(_window_violation([(by_value[k], works) for by_value, works in every], tanks[k], self_resonance), value)
              for k, value in enumerate(values)]
    (trespass, windows), value = min(scored, key=lambda row: (round(row[0][0][0], 9), row[1]))
    return value, _capacitor_reason(value, trespass, windows, converter.limit("capacitor_tolerance"))


def preferred_values(converter: Converter) -> list[float]:
    """Return the E12 values (F) between the smallest and the largest capacitor of the maker's reference coils."""
    low, high = converter.limit("capacitor_min"), converter.limit("capacitor_max")
    decades = [mantissa * 10.0**power for power in range(-12, -7) for mantissa in E12]
    return [round(value, 15) for value in decades if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]


def neighbour_values(capacitance: float) -> tuple[float, float]:
    """Return the next E24 values (F) below and above a capacitance. Both are equal if it is itself an E24 value."""
    decade = 10.0 ** math.floor(math.log10(capacitance * (1 + VALUE_TOLERANCE)))
    values = [0.1 * E24[-1] * decade, *(mantissa * decade for mantissa in E24), 10.0 * decade]
    sold = next((value for value in values if abs(capacitance / value - 1.0) <= VALUE_TOLERANCE), None)
    if sold is not None:
        return sold, sold
    above = next(value for value in values if value > capacitance)
    return values[values.index(above) - 1], above


VALUE_TOLERANCE = 0.005
"""Largest relative difference between a capacitance in the spec and an E24 value that still counts as this value."""


def _extreme_circuits(circuits: Sequence[CoilCircuit]) -> list[CoilCircuit]:
    # Coils under equal parts of the target differ by their leads alone: the two extremes stand for all.
    groups: dict[tuple[int, ...], list[CoilCircuit]] = {}
    for circuit in sorted(circuits, key=lambda c: c.leads.inductance):
        groups.setdefault(tuple(id(change) for change in circuit.reflections.values()), []).append(circuit)
    return [circuit for group in groups.values() for circuit in (group if len(group) == 1 else (group[0], group[-1]))]


OVERDAMPED = 1e3  # Violation by a state in which the tank does not oscillate: larger than any other


def _window_violation(
    oscillations: Sequence[tuple[Oscillation, bool]], tank: Tank, self_resonance: float
) -> tuple[tuple[float, bool], tuple[float, float] | None]:
    """Return ((violation, whether a limit is exceeded), results) of a capacitor with respect to the converter's limits.

    The violation is a weighted sum of ln(value / limit) over all exceeded limits. The results are the highest
    frequency (Hz) and the least parallel resistance (ohm). They are None if no working state oscillates. `oscillations`
    holds pairs: an oscillation, and whether the sensor works in this state. `self_resonance` (Hz) is the lowest of all
    coils.
    """
    running = [(each, works) for each, works in oscillations if each.exists]
    damped = len(oscillations) - len(running)
    frequencies = [each.frequency for each, _ in running]
    resistances = [each.parallel_resistance for each, _ in running]
    working = [each.parallel_resistance for each, works in running if works]
    if not working:
        return (OVERDAMPED * damped, True), None
    converter = tank.converter
    code = converter.drive_code(max(working))
    swing = converter.amplitude(min(working), code), converter.amplitude(max(working), code)
    strict = converter.limit("self_resonance_fraction_strict")
    ceiling = min(FREQUENCY_MARGIN * converter.limit("sensor_frequency_max"), strict * self_resonance)
    floor = converter.limit("sensor_frequency_min") / FREQUENCY_MARGIN
    over = (
        OVERDAMPED * damped
        + 100.0 * _excess(max(frequencies), ceiling)
        + 100.0 * _excess(floor, min(frequencies))
        + 3.0 * _excess(converter.limit("parallel_resistance_min"), min(resistances))
        + 1.0 * _excess(max(resistances), converter.limit("parallel_resistance_max"))
        + 2.0 * _excess(converter.limit("amplitude_optimum_min"), swing[0])
        + 2.0 * _excess(swing[1], converter.limit("amplitude_max"))
        + 1.0 * _excess(ROBUST_CAPACITANCE, tank.capacitor)
    )
    preference = 0.02 * math.log(ceiling / max(frequencies)) if max(frequencies) < ceiling else 0.0
    return (over + preference, over > 0.0), (max(frequencies), min(resistances))


def _excess(value: float, limit: float) -> float:
    return max(0.0, math.log(value / limit)) if limit > 0.0 else math.inf


def _capacitor_reason(
    value: float, trespass: tuple[float, bool], windows: tuple[float, float] | None, tolerance: float
) -> str:
    """Return the reason for the choice of a capacitor, as text.

    `value` (F) is the chosen capacitor, and `tolerance` its relative tolerance. `trespass` and `windows` are the
    violation and the results that `_window_violation` returns.
    """
    if windows is None:
        return f"E12, C0G: no value lets the tank oscillate, {show(value, 'F', 3)} damps it least"
    windows_text = f"up to {show(windows[0], 'Hz', 3)}, R_P from {show(windows[1], 'ohm', 3)}"
    windows_text += f"; +-{50.0 * tolerance:.2g} % of frequency by its tolerance"
    if trespass[1]:
        return f"E12, C0G: no value keeps all windows, {show(value, 'F', 3)} misses them least ({windows_text})"
    return f"E12, C0G: of the values that keep all windows the one with the highest R_P ({windows_text})"


def converter_settings(
    circuits: Sequence[CoilCircuit], readout: ReadoutSpec, capacitor: float, reason: str
) -> ReadoutEstimate:
    """Return the converter's settings for all coils and states with this capacitor.

    `reason` explains the choice of the capacitor. If no coil has a state, unknown settings are None or NaN. The drive
    code is the strongest below the largest permitted amplitude. `settings.with_drive_codes` adds margins when the
    scatter is known.
    """
    tank, device, count = Tank(capacitor, readout), readout.device, len(circuits)
    unset = ReadoutEstimate(
        device, capacitor, reason, drive_code=None, drive_current=math.nan, clock=readout.clock, conversion=None,
        dwell_time=math.nan, scan_rate=math.nan, high_current=False,
        capacitor_tolerance=device.limit("capacitor_tolerance"), read_back_time=device.read_back_time(count),
    )
    oscillations = {(c.name, state): tank.oscillation(c, state) for c in circuits for state in c.reflections}
    if not oscillations:
        return unset
    working = [oscillations[circuit.name, state].parallel_resistance
               for circuit in circuits for state in working_states(circuit.reflections)]
    code = device.drive_code(max(working))
    highest = max(at.parallel_resistance for at in oscillations.values())
    strong = (
        device.has_high_current and count == 1 and readout.drive_code is None
        and device.limit("parallel_resistance_high_current") <= min(working)
        and min(working) < device.limit("parallel_resistance_driveable")
        # the least high current in the maker's texts: no state may certainly exceed the limit
        and device.amplitude_at(highest, device.high_current_range[0]) <= device.limit("amplitude_max")
    )
    # several converters scan at once, each its own coils; the first has the most coils
    counts = device.coils_per_converter(count)
    tanks = tuple((at.frequency, at.quality_factor) for at in oscillations.values())
    conversion = device.set_up(Demand(readout.clock, readout.scan_rate, counts[0], counts[-1], tanks))
    current = device.drive_current(code, strong)
    return replace(
        unset,
        drive_code=code,
        drive_current=current,
        conversion=conversion,
        dwell_time=conversion.dwell_time,
        scan_rate=1.0 / conversion.scan_time,
        high_current=strong,
        settle_time=conversion.settle_time,
        conversion_time=conversion.conversion_time,
        switch_time=conversion.switch_time,
        supply_current=device.converter_count(count) * conversion.supply_current(current),
        conversion_capacitance=tank.conversion_capacitance,
    )


SIGMAS = 2.0
"""Margin of the converter's settings around each estimated frequency, in standard deviations by manufacture."""


def with_frequency_margin(readout: ReadoutEstimate, coils: Sequence[CoilEstimate]) -> ReadoutEstimate:
    """Return the readout settings for a frequency band around each estimated frequency.

    The band covers every coil in every state, with `SIGMAS` standard deviations by manufacture to either side.
    """
    if readout.conversion is None:
        return readout
    ends = [
        [(state.frequency - more, state.frequency + more)
         for state in coil.states.values() for more in (SIGMAS * state.spread.frequency if state.spread else 0.0,)]
        for coil in coils
    ]
    everywhere = [each for coil in ends for each in coil]
    bands = [(min(low for low, _ in limits or everywhere), max(high for _, high in limits or everywhere))
             for limits in ends]
    return replace(readout, conversion=readout.conversion.covering(bands))


def with_inductance_steps(coil: CoilEstimate, tank: Tank, readout: ReadoutEstimate) -> CoilEstimate:
    """Return the coil with the step of its measured inductance (H) in every state, and with the noise (H) by this step.

    The capacitor is fixed. A step or noise of the frequency f becomes a step or noise of the inductance L by the factor
    2 L / f.
    """
    if (conversion := readout.conversion) is None:
        return coil
    states = {}
    for name, state in coil.states.items():
        step = conversion.inductance_step(state.inductance + tank.cable_in_series()[0], state.frequency)
        states[name] = replace(state, quantum=step, noise=step / math.sqrt(12.0))
    return replace(coil, states=states)
