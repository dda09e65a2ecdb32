"""Scatter of inductance, resistance, frequency and parallel resistance (R_P) by manufacturing tolerances.

It is computed to first order, for resistance and R_P to second order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache

import numpy as np

from sitscad.assembly.places.column import usual_tolerances
from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.record import memo, record, replace
from sitscad.estimates.circuits.solved_winding import SolvedWinding
from sitscad.estimates.circuits.tank import CoilCircuit, Tank
from sitscad.estimates.circuits.track_slopes import inductance_slopes, lead_slopes
from sitscad.estimates.coil_estimates import StateEstimate, StateSigmas
from sitscad.estimates.targets.assembly import AssemblyStates, Reflection, Surroundings, lossless_mirror
from sitscad.estimates.tolerances.scatter import (
    BEHIND,
    CAPACITOR,
    CAUSES,
    DIAMETER,
    DISTANCE,
    FOIL,
    PERMITTIVITY,
    PLATING,
    THICKNESS,
    WIDTH,
)
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.proximity import ROUGH, USUAL, suited_resolution, winding_loss
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector, reflected_inductances
from sitscad.layout.board import Coil
from sitscad.spec.circuit import CopperLayer, LayerKind, Stackup
from sitscad.spec.sensor import SensorSpec

SHARE, WINDOW = "share of the target", "window in the jaw"
"""Names of two causes of scatter: the error bounds of the target's effect, and of the effect of a window in the jaw.

They are not in `scatter.CAUSES`.
"""

EXTRA = {WIDTH: (0.42, 1.12), THICKNESS: (-0.35, 0.68)}
EXTRA_BENT = {WIDTH: (-0.69, 1.82), THICKNESS: (-0.55, 0.79)}
"""Constants (a, b) of the dependence of the extra loss on track width and on track thickness.

EXTRA is for round coils, and EXTRA_BENT for all other coils. The extra loss E (ohm) is the resistance that eddy
currents in the tracks add. It depends on a dimension x (width or thickness) by d ln E / d ln x = a + b E'/E, with
E' = dE / d ln f. The constants were fitted to differences of full solutions of eleven templates, free and at rest. The
error of d ln R / d ln x is at most 0.15. Round coils without metal use `width_power` for the width, except in
screening.
"""

WIDER = 0.02
"""Relative increase of the track width for the numerical derivative in `width_power`."""

ROUGHLY_SOLVED = 4.0
"""Largest track width, in skin depths, at which `width_power` uses only rough solutions (error 2 %).

One skin depth above this limit, only the usual solutions are used; between, a weighted mean. At 7 skin depths the rough
power was 10 % too small, and the standard deviation of R was 20 % too small.
"""

EXTRA_OF_LEADS = {WIDTH: (-0.5, 0.0), THICKNESS: (-1.0, 1.0)}
"""Constants (a, b) as in EXTRA for the extra loss of leads, whose currents crowd by their own field.

The loss of wide leads is proportional to 1/w and increases with their thickness.
"""

EXTRA_INDUCTANCE = {WIDTH: 1.85, THICKNESS: -0.2}
"""Constants a of the dependence of an inductance change on track width and on track thickness.

Let D be the inductance change (H) that eddy currents in the tracks cause, and x the width or thickness. Then
dD / d ln x = a D + dD / d ln f. Full solutions of eleven templates gave values of 1.7 to 2.1 for the width of round
coils, and of 1.6 to 2.2 for others.
"""

OWN_CAPACITANCE = {WIDTH: 1.0, DISTANCE: -0.75}
"""Exponents of track width and film thickness in the capacitance C of winding and leads.

C is proportional to width^1 thickness^-0.75. Full solutions gave exponents of 0.75 to 1.1 (width) and -0.65 to -0.8
(thickness).
"""

STEP = 1.02  # Ratio of the frequencies between which the growth of the winding's loss with frequency is taken

def tolerance_sigmas(spec: SensorSpec) -> dict[str, float]:
    """Return the standard deviation of each manufacturing tolerance by name; 0 for parts that the sensor lacks.

    The unit is metres for the pad's thickness and size, for the glue below the target and for the target's place. It is
    radians for angles. All other standard deviations are relative. Copper thickness joins foil and plating of this
    stack-up.
    """
    def found() -> dict[str, float]:
        copper = math.hypot(*_copper_bands(spec.coil_copper, spec.fpc.stackup)) / math.sqrt(3.0)
        return {THICKNESS: copper} | {cause.name: cause.sigma(spec) for cause in CAUSES}

    return memo(spec, "_sigmas", found)


def _copper_bands(copper: tuple[CopperLayer, ...], stackup: Stackup) -> tuple[float, float]:
    """Return relative half widths of the tolerance bands of the coil's copper thickness: by foil, and by plating.

    Layers are weighted as in the resistance: in series, each by 1/thickness. The foil's error is equal on all layers.
    If the fabricator does not state whether the copper thickness includes the plating, all of the plating is uncertain.
    """
    whole = math.fsum(1.0 / layer.thickness for layer in copper)
    foil = math.fsum(layer.foil / layer.thickness**2 for layer in copper) / whole
    steps = math.fsum((layer.plated > 0.0) * stackup.platings(layer.number) / layer.thickness**2 for layer in copper)
    usual = usual_tolerances()
    unsure = usual[PLATING].band if stackup.is_plating_stated else stackup.plating_thickness
    return usual[FOIL].band * foil, unsure * steps / whole


def thickest_copper(copper: tuple[CopperLayer, ...], stackup: Stackup) -> float:
    """Return the largest relative excess of the coil's copper thickness that a fabricator may deliver.

    Foil and plating are both at their upper limits. Layers are weighted as in the resistance.
    """
    return sum(_copper_bands(copper, stackup))


def direct_resistance_sigma(spec: SensorSpec) -> float:
    """Return the relative standard deviation of a coil's direct-current resistance.

    The resistance is proportional to the tracks' length, divided by width and thickness.
    """
    by_cause = tolerance_sigmas(spec)
    return math.hypot(by_cause[WIDTH], by_cause[THICKNESS], by_cause[DIAMETER])


Between = Callable[
    [CurrentSpectrum, float, tuple[Surroundings, Surroundings], tuple[complex, complex]], tuple[float, float]
]
"""Function that returns the change of inductance (H) and resistance (ohm) between two surroundings.

Its arguments are as in `_surroundings_change`: current spectrum, frequency (Hz), pair of surroundings, factors.
"""


ExtraShares = Mapping[str, tuple[float, float]]
"""Pairs of constants (a, b) by cause, as in EXTRA."""


def coil_slopes(spec: SensorSpec, coil: Coil, winding: SolvedWinding) -> Slopes:
    """Return the inputs for the standard deviations of a coil, from the solution of its winding.

    `Slopes.surroundings` is empty.
    """
    inductance = inductance_slopes(winding.spirals, coil, spec.coil, spec.fpc.stackup, winding.is_rough)
    is_round = spec.coil.outline.is_round
    power = width_power(winding.spirals, winding.conductivity) if is_round and not winding.is_rough else None
    extra = EXTRA if is_round else EXTRA_BENT
    thickest = thickest_copper(spec.coil_copper, spec.fpc.stackup)
    return Slopes(tolerance_sigmas(spec), inductance, {}, thickest, extra, power)


@lru_cache(maxsize=4)
def width_power(layers: tuple[SpiralLayer, ...], conductivity: float) -> Callable[[float], float]:
    """Return a function of frequency (Hz): exponent of the track width in the extra loss of a winding without metal.

    The conductivity is in S/m. The exponent is computed from solutions of the winding and of wider tracks. Both have
    equal numbers of modes and cross-sections. For narrow tracks the solutions are rough. `layers` are the layers of the
    winding.
    """
    wider = tuple(replace(layer, width=(1.0 + WIDER) * layer.width) for layer in layers)

    @lru_cache(maxsize=2)
    def solved(tolerance: float) -> tuple[ProximityLoss, ProximityLoss]:
        resolution = suited_resolution(layers, conductivity, tolerance)
        first, second = (winding_loss(tracks, conductivity, resolution=resolution) for tracks in (layers, wider))
        return first, second

    def by(tolerance: float, frequency: float) -> float:
        less, more = (winding.direct * (winding.resistance_ratio(frequency) - 1.0) for winding in solved(tolerance))
        return math.log(more / less) / math.log(1.0 + WIDER)

    def power(frequency: float) -> float:
        depths = layers[0].width / skin_depth(frequency, conductivity)
        usual = min(max(depths - ROUGHLY_SOLVED, 0.0), 1.0)
        rough = (1.0 - usual) * by(ROUGH, frequency) if usual < 1.0 else 0.0
        return rough + (usual * by(USUAL, frequency) if usual > 0.0 else 0.0)

    return power


@record
class Slopes:
    """Inputs of `state_sigmas`, common to all states of a coil.

    `sigmas` are the standard deviations by cause. `inductance` holds the derivatives (H) of the winding's inductance
    with respect to ln(x), for each dimension x. `surroundings` is the result of `surroundings_changes`: the changes of
    inductance and resistance (H, ohm) for one sigma, by state and cause. ``thickest_copper`` is the relative excess of
    the thickest copper delivered over the nominal copper. `extra` holds the constants of EXTRA for the coil's shape.
    `power` is the winding's `width_power`; None if `extra` is used for the width, too.
    """

    sigmas: Mapping[str, float]
    inductance: Mapping[str, float]
    surroundings: Mapping[str, Mapping[str, tuple[float, float]]]
    thickest_copper: float
    extra: ExtraShares
    power: Callable[[float], float] | None = None


def resistance_slopes(
    circuit: CoilCircuit, frequency: float, crowded: tuple[float, float], extra_factors: ExtraShares
) -> dict[str, float]:
    """Return the derivative (ohm) of a circuit's resistance with respect to ln(x), for each toleranced dimension x.

    `crowded` holds the extra resistance (ohm) of the winding by eddy currents in its tracks at a `frequency` (Hz), and
    its derivative (ohm) with respect to ln f (`crowding_growth`).

    Notes
    -----
    Direct resistance is proportional to 1/(w t). Every mode of the extra loss is s omega^2 / (1 + omega^2 tau^2), and
    tau is proportional to w t. In the field of neighbours and of their images, s is proportional to w^3 t. In the
    track's own field, s is proportional to w t. Let E be the extra loss with metal around, and E' = dE / d ln omega. At
    low frequencies, the neighbours' field results in dE / d ln w = E + E' and dE / d ln t = -E + E'. The track's own
    field results in -E + E' for both. `extra_factors` (EXTRA) extend this to higher frequencies, at which E' falls from
    2 E to E. If the coil becomes larger and the width of its tracks does not change, dE / d ln(diameter) = -E. Leads
    have a separate extra loss.
    """
    direct, (extra, growth) = circuit.resistance, crowded
    lead, (more_lead, of_lead) = _lead_growth(circuit, frequency)
    slopes = {DIAMETER: direct - extra}
    for name, (share, more) in extra_factors.items():
        lead_part, grown = EXTRA_OF_LEADS[name]
        slopes[name] = share * extra + more * growth - direct + lead_part * more_lead + grown * of_lead - lead
    return slopes


def _lead_growth(circuit: CoilCircuit, frequency: float) -> tuple[float, tuple[float, float]]:
    """Return the direct resistance (ohm) of the leads' tracks, and their extra resistance at a frequency (Hz).

    The extra resistance is a pair: its value (ohm), and its derivative (ohm) with respect to ln f.
    """
    at = np.array([DIRECT, frequency / STEP, frequency, frequency * STEP])
    direct, less, here, more = circuit.leads.resistances_at(at, circuit.conductivity).tolist()
    return direct, (here - direct, (more - less) / (2.0 * math.log(STEP)))


DIRECT = 1.0
"""Frequency (Hz) so low that the computed resistance of a track is its direct-current resistance."""


def crowding_growth(circuit: CoilCircuit, state: str, frequency: float) -> tuple[tuple[float, float], ...]:
    """Return inductance (H) and resistance (ohm) that eddy currents in the tracks add, with their derivatives.

    They are two pairs (value, derivative with respect to ln f) for a state at a frequency (Hz).
    """
    parts = circuit.crowding(state, frequency * np.array([1.0 / STEP, 1.0, STEP]))
    return tuple((float(at[1]), float(at[2] - at[0]) / (2.0 * math.log(STEP))) for at in parts)


EVEN_SQUARE = math.sqrt(0.8)
"""Standard deviation of the square of a uniformly distributed value, divided by the value's variance."""


def second_order_sigmas(circuit: CoilCircuit, state: StateEstimate, resistance: float, parallel: float,
                        moved: Mapping[str, tuple[float, float, float, float]], slopes: Slopes) -> tuple[float, float]:
    """Return the parts of the standard deviations of resistance and R_P (ohm) that are of second order in x.

    Here x is the track width or the track thickness. Direct resistance is proportional to 1/x and the extra loss E to
    x^p. The second-order factors are 2 and p (p - 1), with p = d ln E / d ln x as in `resistance_slopes`. The effect on
    R_P follows from R_P = exp(a x - ln R) with a constant a. `moved` holds the changes for one sigma of each cause.
    `resistance` (ohm) and `parallel` (ohm) are the tank's series resistance and R_P.
    """
    extra, growth = crowding_growth(circuit, state.state, state.frequency)[1]
    direct = circuit.resistance + _lead_growth(circuit, state.frequency)[0]
    of_series, of_parallel = [], []
    for name, (share, more) in slopes.extra.items():
        power, sigma = share + more * growth / extra if extra > 0.0 else 0.0, slopes.sigmas[name]
        if name == WIDTH and slopes.power is not None:
            power = slopes.power(state.frequency)
        if not sigma:
            continue
        second = (2.0 * direct + power * (power - 1.0) * extra) / resistance
        first, slope = (by / whole / sigma for by, whole in ((moved[name][1], resistance), (moved[name][3], parallel)))
        half = 0.5 * EVEN_SQUARE * sigma * sigma
        of_series.append(half * second * resistance)
        of_parallel.append(half * (slope * slope + first * first - second) * parallel)
    return math.hypot(*of_series), math.hypot(*of_parallel)


def state_sigmas(circuit: CoilCircuit, tank: Tank, state: StateEstimate, slopes: Slopes) -> StateSigmas:
    """Return standard deviations of a state's values by independent tolerances.

    Let the tank have the inductance L, capacitance C and resistance R. Then d ln f = -(dL/L + dC/C)/2. If R grows with
    the power n of the frequency, d ln R_P = 2 dL/L + (2 - n) d ln f - dR/R. `slopes` are the inputs that all states of
    the coil share.
    """
    more_inductance, more_resistance = tank.cable_in_series()
    inductance, resistance = state.inductance + more_inductance, state.resistance + more_resistance
    capacitance = tank.capacitance(circuit)
    sooner, later = circuit.terminal_impedance(state.state, state.frequency * np.array([1.0 / STEP, STEP]))[1].tolist()
    growth = (later - sooner) / (2.0 * math.log(STEP)) / resistance
    moved: dict[str, tuple[float, float, float, float]] = {}
    for name, (by_l, by_r, by_c) in _tank_changes(circuit, tank, state, slopes).items():
        shift = -0.5 * (by_l / inductance + by_c / capacitance)
        loss = 2.0 * by_l / inductance + (2.0 - growth) * shift - by_r / resistance
        moved[name] = (by_l, by_r + growth * resistance * shift, state.frequency * shift,
                       state.parallel_resistance * loss)
    totals = [math.sqrt(math.fsum(row[k] ** 2 for row in moved.values())) for k in range(4)]
    bent = second_order_sigmas(circuit, state, resistance, state.parallel_resistance, moved, slopes)
    totals[1], totals[3] = math.hypot(totals[1], bent[0]), math.hypot(totals[3], bent[1])
    names = ("inductance", "resistance", "frequency", "parallel_resistance")
    causes = {
        name: max(moved, key=lambda key, k=k: abs(moved[key][k]))  # type: ignore[misc]
        for k, name in enumerate(names)
    }
    amplitude = state.amplitude * totals[3] / state.parallel_resistance
    shifts = {name: (row[0], row[2], row[1], row[3]) for name, row in moved.items()}
    by_copper = moved[THICKNESS][3] * slopes.thickest_copper / slopes.sigmas[THICKNESS]
    return StateSigmas(totals[0], totals[1], totals[2], totals[3], amplitude, causes, shifts, by_copper)


def _tank_changes(
    circuit: CoilCircuit, tank: Tank, state: StateEstimate, slopes: Slopes
) -> dict[str, tuple[float, float, float]]:
    """Return the change of the tank's (L, R, C) (H, ohm, F) for each cause of scatter that deviates by one sigma.

    The causes are manufacturing tolerances and error bounds, by name. `slopes` holds the derivatives and sigmas of the
    coil, which all its states share.
    """
    self_capacity = circuit.self_capacitance
    by_c = {name: power * self_capacity for name, power in OWN_CAPACITANCE.items()}
    by_c |= {CAPACITOR: tank.capacitor, PERMITTIVITY: self_capacity}
    tracks = track_tolerance_changes(circuit, state.state, state.frequency, slopes)
    around, nothing, moves = slopes.surroundings.get(state.state, {}), (0.0, 0.0), {}
    for name in dict.fromkeys((WIDTH, THICKNESS, DISTANCE, DIAMETER, CAPACITOR, PERMITTIVITY, *around)):
        by_l, by_r = (a + b for a, b in zip(tracks.get(name, nothing), around.get(name, nothing), strict=True))
        moves[name] = by_l, by_r, slopes.sigmas[name] * by_c[name] if name in by_c else 0.0
    return moves


def track_tolerance_changes(
    circuit: CoilCircuit, state: str, frequency: float, slopes: Slopes
) -> dict[str, tuple[float, float]]:
    """Return the changes of a coil's L (H) and R (ohm) by one sigma of each track tolerance, at a frequency (Hz).

    The tolerances are of track width, copper thickness, layer distance and diameter. `slopes` are the inputs that all
    states of the coil share.
    """
    (lost, growth), crowded = crowding_growth(circuit, state, frequency)
    by_l, by_leads = slopes.inductance, lead_slopes(circuit)
    by_r = resistance_slopes(circuit, frequency, crowded, slopes.extra)
    if slopes.power is not None:  # more accurate for the coil by itself
        ratios = circuit.loss.resistance_ratios(frequency * np.array([1.0 / STEP, 1.0, STEP]))
        before, alone, after = (circuit.resistance * (ratios - 1.0)).tolist()
        share, more = slopes.extra[WIDTH]
        by_growth = share + more * (after - before) / (2.0 * math.log(STEP)) / alone if alone > 0.0 else 0.0
        by_r[WIDTH] += (slopes.power(frequency) - by_growth) * alone
    moves = {name: (by_l[name] + by_leads[name] + (share * lost + growth), by_r[name])
             for name, share in EXTRA_INDUCTANCE.items()}
    moves[DISTANCE] = by_l[DISTANCE] + by_leads[DISTANCE], 0.0
    moves[DIAMETER] = circuit.inductance - math.fsum(by_l.values()), by_r[DIAMETER]
    return {name: (slopes.sigmas[name] * a, slopes.sigmas[name] * b) for name, (a, b) in moves.items()}


def surroundings_changes(
    spectrum: CurrentSpectrum | None, assembly: AssemblyStates, states: Mapping[str, StateEstimate],
    circuit: CoilCircuit, deeper: Mapping[str, tuple[float, float]], is_rough: bool = False,
) -> dict[str, dict[str, tuple[float, float]]]:
    """Return changes (inductance in H, resistance in ohm) for one sigma of each cause around a coil.

    They are by state and cause. For a gap, the change is half the difference between one sigma more and one sigma less.
    For the target's effect, it is the error bound divided by the root of 3. `deeper` are the larger distances of metal
    (m) from `reflector_shifts`. The ratio of the target's effect to an infinite plate's effect changes with the gap
    (`ratio_slopes`).
    """
    moves: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in states}
    if spectrum is None:
        return moves
    between = _linearised_change(spectrum, assembly, states) if is_rough else _surroundings_change
    crowds = {around.name: _CrowdingSlopes(circuit.reflections[around.name], around, states[around.name].frequency)
              for around in assembly.states if around.name in states}
    grown = {} if is_rough else ratio_slopes(assembly, states, circuit)
    for (state, cause), pair in assembly.ranges.items():
        if state in states:
            frequency = states[state].frequency
            by_l, by_r = between(spectrum, frequency, pair, circuit.reflections[state].factors(frequency))
            more, lost = np.add(crowds[state].between(*pair), _ratio_change(grown.get(state), *pair)).tolist()
            of_l, of_r = circuit.reflections[state].jaw_left if cause in BEHIND else (1.0, 1.0)
            moves[state][cause] = 0.5 * of_l * (by_l + more), 0.5 * of_r * (by_r + lost)
    for around in assembly.states:
        if around.name not in states:
            continue
        frequency, reflection = states[around.name].frequency, circuit.reflections[around.name]
        for cause, (above, below) in deeper.items() if around.above is not None or around.below is not None else ():
            moved = Surroundings(around.state, _at_larger_distance(around.above, above),
                                 _at_larger_distance(around.below, below))
            by_l, by_r = between(spectrum, frequency, (moved, around), reflection.factors(frequency))
            more, lost = np.add(
                crowds[around.name].between(moved, around), _ratio_change(grown.get(around.name), moved,
                                                                          around)).tolist()
            moves[around.name][cause] = by_l + more, by_r + lost
        for cause, (more, lost) in ((SHARE, reflection.target_error_bounds(frequency)),
                                    (WINDOW, reflection.window_error_bounds(frequency))):
            if more or lost:
                moves[around.name][cause] = more / math.sqrt(3.0), lost / math.sqrt(3.0)
    return moves


def ratio_slopes(
    assembly: AssemblyStates, states: Mapping[str, StateEstimate], circuit: CoilCircuit
) -> dict[str, tuple[float, float]]:
    """Return derivatives of inductance (H/m) and resistance (ohm/m) with respect to the gap, by state.

    They cover only one cause: the ratio of the target's effect to an infinite plate's effect depends on the gap. The
    ratio is interpolated linearly in the gap between rest and pressed. Empty if one of these states is missing.
    """
    gaps = {around.name: around.above.distance for around in assembly.states
            if around.above is not None and around.name in states}
    if not {REST, PRESSED} <= gaps.keys() or gaps[REST] == gaps[PRESSED]:
        return {}
    slopes = {}
    for name in gaps:
        frequency = states[name].frequency
        under_load, at_rest = (circuit.reflections[state].factors(frequency) for state in (PRESSED, REST))
        change_slope, loss_slope = (
            (b - a) / (gaps[REST] - gaps[PRESSED]) for a, b in zip(under_load, at_rest, strict=True))
        change = circuit.reflections[name].with_factors(frequency, (change_slope, loss_slope))
        slopes[name] = change.real, -2.0 * math.pi * frequency * change.imag
    return slopes


def _ratio_change(slopes: tuple[float, float] | None, first: Surroundings, second: Surroundings) -> tuple[float, float]:
    """Return the change of inductance (H) and resistance (ohm) from the `second` to the `first` surroundings.

    It is only the change because the target's ratio depends on the gap. `slopes` are the two derivatives (H/m, ohm/m)
    from `ratio_slopes`.
    """
    if slopes is None or first.above is None or second.above is None:
        return 0.0, 0.0
    up = first.above.distance - second.above.distance
    return up * slopes[0], up * slopes[1]


def reflector_shifts(coil: Coil, stackup: Stackup, sigma: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return increases (m) of the distances to metal above and below a coil for one sigma of each cause.

    The causes are copper thickness and layer distance. Distances count from the mean of the layers' mid-planes. They
    increase because the material over and under this mean becomes thicker.
    """
    moves, numbers = {}, {winding.layer for winding in coil.windings}
    for name, is_copper in ((THICKNESS, True), (DISTANCE, False)):
        depths, whole, number = [], 0.0, 0
        for layer in stackup.layers:
            thickness = layer.thickness if (layer.kind is LayerKind.COPPER) is is_copper else 0.0
            if layer.kind is LayerKind.COPPER:
                number += 1
                if number in numbers:
                    depths.append(whole + 0.5 * thickness)
            whole += thickness
        over = math.fsum(depths) / len(depths)
        moves[name] = sigma[name] * over, sigma[name] * (whole - over)
    return moves


def _at_larger_distance(reflector: Reflector | None, by: float) -> Reflector | None:
    return None if reflector is None else replace(reflector, distance=reflector.distance + by)


def _surroundings_change(spectrum: CurrentSpectrum, frequency: float, pair: tuple[Surroundings, Surroundings],
                         factors: tuple[complex, complex]) -> tuple[float, float]:
    """Return the difference of inductance (H) and resistance (ohm) between two surroundings: first minus second.

    `factors` are as in `Reflection.factors`. They multiply only the target's effect, not the effect of metal behind the
    board. `pair` holds the two surroundings.
    """
    omega, (ratio, loss_ratio) = 2.0 * math.pi * frequency, factors

    def returned(above: Reflector | None, below: Reflector | None) -> complex:
        """Return the inductance change (H, complex) by metal above and below."""
        if above is None and below is None:
            return 0j
        return complex(reflected_inductances(spectrum, np.array([frequency]), above, below, (0.0,))[0, 0])

    def changed(around: Surroundings) -> complex:
        without_target = returned(None, around.below)
        if around.above is None:
            return without_target
        change = without_target + ratio * (returned(around.above, around.below) - without_target)
        if loss_ratio == ratio:
            return change
        return change + (loss_ratio - ratio) * 1j * returned(around.above, lossless_mirror(around.below)).imag

    difference = changed(pair[0]) - changed(pair[1])
    return difference.real, -omega * difference.imag


class _CrowdingSlopes:
    """Changes of inductance and resistance because the tracks' eddy currents change with the distance of metal.

    They are linear in the distances to metal above and below. In rough solutions they are 0.
    """

    def __init__(self, reflection: Reflection, around: Surroundings, frequency: float) -> None:
        self._reflection, self._around, self._frequency = reflection, around, frequency

    def between(self, first: Surroundings, second: Surroundings) -> tuple[float, float]:
        """Return the difference of inductance (H) and resistance (ohm) between two surroundings that differ little."""
        up, down = (0.0 if a is None or b is None else a.distance - b.distance
                    for a, b in ((first.above, second.above), (first.below, second.below)))
        if self._reflection.is_rough or not (up or down):
            return 0.0, 0.0
        change = up * self._slopes[0] + down * self._slopes[1]
        return change.real, -2.0 * math.pi * self._frequency * change.imag

    @cached_property
    def _slopes(self) -> tuple[complex, complex]:
        """Derivatives (H/m, complex) of the inductance change with respect to the distances of both metals.

        The first is for the metal above, the second for the metal below.
        """
        around, at = self._around, np.array([self._frequency])

        def crowding(above: Reflector | None, below: Reflector | None) -> complex:
            return complex(self._reflection.crowding_near(at, above, below)[0])

        here = crowding(around.above, around.below)
        slopes = []
        for is_above, side in ((True, around.above), (False, around.below)):
            by = 0.0 if side is None else APART * side.distance
            moved = _at_larger_distance(side, by)
            there = crowding(moved, around.below) if is_above else crowding(around.above, moved)
            slopes.append((there - here) / by if by else 0j)
        return slopes[0], slopes[1]


APART = 1e-2  # Relative change of a distance of metal for numerical slopes


def _linearised_change(
    spectrum: CurrentSpectrum, assembly: AssemblyStates, states: Mapping[str, StateEstimate]
) -> Between:
    """Return a linear, faster form of `_surroundings_change`.

    It uses derivatives of the inductance change with respect to the distances to metal above and below.
    """
    solved_slopes: dict[str, tuple[complex, complex, complex]] = {}

    def slopes(around: Surroundings, frequency: float) -> tuple[complex, complex, complex]:
        """Return three derivatives (H/m, complex) of the inductance change that metal causes.

        The first is with respect to the distance of the metal above. The second is with respect to the distance of the
        metal below. The third is like the second, without the metal above.
        """
        if around.name not in solved_slopes:
            reflector_above, reflector_below = around.above, around.below

            def returned(over: Reflector | None, under: Reflector | None) -> complex:
                """Return the inductance change (H, complex) by metal over and under the coil."""
                return complex(reflected_inductances(spectrum, np.array([frequency]), over, under, (0.0,))[0, 0])

            here = returned(reflector_above, reflector_below)
            up, down = (0.0 if reflector is None else APART * reflector.distance
                        for reflector in (reflector_above, reflector_below))
            lower = _at_larger_distance(reflector_below, down)
            by_below = (returned(reflector_above, lower) - here) / down if down else 0j
            by_above = (returned(_at_larger_distance(reflector_above, up), reflector_below) - here) / up if up else 0j
            without_target = by_below
            if reflector_above is not None and down:
                without_target = (returned(None, lower) - returned(None, reflector_below)) / down
            solved_slopes[around.name] = by_above, by_below, without_target
        return solved_slopes[around.name]

    def between(
        _: CurrentSpectrum, frequency: float, pair: tuple[Surroundings, Surroundings], factors: tuple[complex, complex]
    ) -> tuple[float, float]:
        """Return the difference of inductance (H) and resistance (ohm) between both surroundings of a pair.

        It uses the derivatives at the nominal surroundings of the pair's state.
        """
        nominal = next(around for around in assembly.states if around.name == pair[0].name)
        up, down = (
            0.0 if first is None or second is None else first.distance - second.distance
            for first, second in ((pair[0].above, pair[1].above), (pair[0].below, pair[1].below))
        )
        by_above, by_below, without_target = slopes(nominal, frequency)
        change = factors[0] * up * by_above + down * (without_target + factors[0] * (by_below - without_target))
        return change.real, -2.0 * math.pi * frequency * change.imag

    return between
