"""Electromagnetic solution of a winding, shared by all identical coils: inductance, loss, and their changes by metal.

It also bounds the error of the winding's resistance at a frequency. The direct resistance is exact except for the
properties of the copper. The added loss by alternating current is computed with a finite number of current modes, in a
finite number of cross-sections. The errors by these numbers were fitted to random designs of every shape, computed
again with finer resolution (tests/validation/resistance_designs.py). They are tested on designs outside the fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sitscad.assembly.places.state import FREE
from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.estimates.circuits.tank import CoilCircuit
from sitscad.estimates.coil_estimates import StateEstimate
from sitscad.estimates.loads.pressing import GLUE, PAD, PAD_SIZE
from sitscad.estimates.targets.assembly import AssemblyStates
from sitscad.estimates.windings.losses import (
    ALIKE_ROUNDED,
    POLYGONS_NEAR_METAL,
    LossesNearMetal,
    is_rough,
    losses_near_metal,
    resistance_tolerance,
    winding_losses,
)
from sitscad.estimates.windings.methods import (
    UNFITTED,
    Method,
    WindingGeometry,
    choose_method,
    equivalent_spirals,
    metal_spectrum,
    winding_geometry,
)
from sitscad.estimates.windings.neighbours import inductance_matrix, rough_inductance_matrix
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.proximity import crossing_error, suited_resolution
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.sensor import SensorSpec

ALONG = 2e-5  # Relative error of the resistance at any frequency, by lengths and corners of the winding's path

MODEL = 0.0015
"""Error of the added loss by the straight-track model, as a fraction of the added loss.

Added loss is the loss at a frequency minus the loss by direct current. In the model, current crowding in a track
changes the field at other tracks as if all tracks were straight. Results were compared with converged filament models
of closed rings and open spirals (tests/validation/test_alternating_current.py).
"""

ENDS = 1.2
"""Factor of the error of a round coil's added loss, caused by the ends of its layers.

The error is ENDS times track width divided by winding length, as a fraction of the added loss. The loss is computed in
cross-sections of the winding, which do not contain the ends of the spirals.
"""

ONE_CUT = 0.1  # Relative error of the added loss if one cut stands for all of a winding

MODES = {False: 0.011, True: 0.007}
"""Error of the added loss by the finite number of current modes: usual (False) or fine (True) number of modes.

It is a fraction of the added loss. The full error is reached at `WIDE` skin depths of track width or `THICK` skin
depths of track thickness.
"""

WIDE, THICK = 12.0, 3.0  # Skin depths of width and of thickness at which this error is reached

SHARP_POLYGON_ERROR = 0.017
"""Error of the added loss of polygons with one layer and sharp corners, as a fraction of the added loss."""

ROUNDED_POLYGON_ERROR = 0.017
"""Error of the added loss of polygons with rounded corners, as a fraction of the added loss.

Rounded corners have a radius of at least half the track width.
"""

RACETRACK = 0.003
"""Error of the added loss of racetracks with few turns, as a fraction of the added loss."""

LONG = 0.009
"""Error of the added loss of racetracks with at least ALIKE_ROUNDED turns, as a fraction of the added loss.

The two halves of these racetracks are computed as equal.
"""

CROSSING = {
    "square": (0.055, 0.02), "rectangle": (0.055, 0.02), "hexagon": (0.038, 0.016), "octagon": (0.036, 0.013),
}
"""Errors of the added loss of polygons with several layers and sharp corners, as fractions of the added loss.

The first value of a shape is for fewer than FEW turns in a layer, the second for more. Near corners the sides of two
layers do not lie face to face, and the loss is computed in few cross-sections. The sharper the corner, the larger the
error.
"""

METAL = 0.03
"""Error of the resistance if metal is farther than `ERROR_FADE_FACTOR` times `NEAR_DISTANCE`.

It is a fraction of the resistance. Source: filament models of round coils over and between copper, steel and perfectly
conducting planes (tests/validation/test_near_metal.py). For other shapes, POLYGONS_NEAR_METAL is added.
"""

NEAR = 0.04
"""Error of the resistance if metal is nearer than `NEAR_DISTANCE`, as a fraction of the resistance.

Between `NEAR_DISTANCE` and `ERROR_FADE_FACTOR` times `NEAR_DISTANCE`, the error falls linearly from `NEAR` to `METAL`.
"""

NEAR_DISTANCE = 0.2e-3
"""Distance (m) from the copper's middle to metal up to which the resistance has the error `NEAR`."""

ERROR_FADE_FACTOR = 1.5
"""Ratio of two distances of metal: up to the smaller, an error has its full weight 1; beyond the larger, weight 0.

Between them the weight falls linearly, so that results over the distance have no jumps.
"""

OWN_ROUNDING = 1e-6
"""Largest deviation (m) of a drawn polygon from its nominal shape that counts as rounding of coordinates.

Up to this deviation, the error bounds of the nominal shape hold.
"""

MISFIT = 8.0
"""Largest relative inductance change of a coil if all turns are displaced outwards, divided by the displacement.

The displacement is in outer diameters. An inductance is at most proportional to the square of the mean radius, which is
at least a quarter of the outer diameter.
"""

FEW = 4.0  # Turns of a layer below which corners are a large part of a polygon


@record
class ResistanceBound:
    """Parts of the error bound of a winding's resistance. The added loss is resistance minus direct resistance.

    `share` is an error relative to the added loss at any frequency. `modes` is a further error relative to the added
    loss, reached in tracks many skin depths wide or thick. `width` and `thickness` (m) are the track's. `conductivity`
    is in S/m.
    """

    share: float
    modes: float
    width: float
    thickness: float
    conductivity: float

    def relative(self, ratio: float, frequency: float) -> float:
        """Return the relative error bound of a resistance at a frequency (Hz).

        `ratio` is this resistance divided by the direct resistance.
        """
        depth = skin_depth(frequency, self.conductivity)
        reached = min(1.0, max(self.width / (WIDE * depth), self.thickness / (THICK * depth)) ** 2)
        return ALONG + (1.0 - 1.0 / ratio) * (self.share + self.modes * reached)


def resistance_bound(spec: CoilSpec, coil: Coil, spirals: Sequence[SpiralLayer], conductivity: float,
                     tolerance: float) -> ResistanceBound:
    """Return the error bound of the resistance that `losses.winding_losses` computes.

    `spirals` are the layers of a round coil, empty for other shapes. `conductivity` is in S/m. `tolerance` is 3e-2 or
    1e-2.
    """
    if spirals:
        length = 2.0 * math.pi * math.fsum(s.turns * (s.radius - 0.5 * s.pitch * s.turns) for s in spirals)
        cuts = suited_resolution(spirals, conductivity, tolerance).cuts
        bent = ONE_CUT if cuts == 1 else crossing_error(spirals, cuts) + ENDS * spirals[0].width / length
    elif not spec.outline.sides:
        bent = LONG if min(spec.layer_turns) >= ALIKE_ROUNDED else RACETRACK
    elif spec.corner_radius >= 0.5 * spec.trace_width:
        bent = ROUNDED_POLYGON_ERROR
    elif len(coil.windings) == 1:
        bent = SHARP_POLYGON_ERROR
    else:
        column = 0 if min(spec.layer_turns) < FEW else 1
        bent = max(CROSSING[shape][column] for shape in spec.outline.shapes_with_bounds)
    thickness = max(winding.thickness for winding in coil.windings)
    return ResistanceBound(MODEL + bent, MODES[tolerance < 0.02], spec.trace_width, thickness, conductivity)


def near_metal_error(spec: CoilSpec, nearest: float) -> float:
    """Return the error of a winding's resistance near metal, as a fraction of the resistance.

    `nearest` (m) is the least distance from the copper's middle to metal.
    """
    error = METAL + (NEAR - METAL) * _error_weight(nearest / NEAR_DISTANCE)
    if not spec.outline.is_round:
        error += max(row[2] * _error_weight(nearest / (row[0] * spec.trace_width)) for row in POLYGONS_NEAR_METAL)
    return error


def _error_weight(reach: float) -> float:
    """Return the weight of an error, from 0 to 1.

    `reach` is the distance to metal, divided by the distance up to which the error holds in full. The weight is 1 up to
    a reach of 1, 0 from `ERROR_FADE_FACTOR` on, and linear between.
    """
    return min(1.0, max(0.0, (ERROR_FADE_FACTOR - reach) / (ERROR_FADE_FACTOR - 1.0)))


@record(eq=False)
class SolvedWinding:
    """Values that all identical coils share: their winding's geometry, inductance (H), loss and error bounds.

    `spirals` are round layers that replace a winding of any shape when its loss near metal is computed. `method` is the
    method of the inductance. `conductivity` (S/m) is the copper's. `loss` is the loss by alternating current without
    metal, and `crowding` its change by metal. `nearest` (m) is the least distance of metal in any state. Changes by
    metal are computed from the current `spectrum`. `nearest`, `crowding` and `spectrum` are None if there is no metal.
    `bound` is the error bound of the resistance. `is_rough` marks screening solutions.
    """

    geometry: WindingGeometry
    spirals: tuple[SpiralLayer, ...]
    inductance: float
    method: Method
    conductivity: float
    loss: ProximityLoss
    nearest: float | None
    crowding: LossesNearMetal | None
    spectrum: CurrentSpectrum | None
    bound: ResistanceBound
    is_rough: bool = False

    def resistance_error(self, circuit: CoilCircuit, state: StateEstimate, coil: CoilSpec) -> float:
        """Return the relative error bound of the resistance at a coil's contacts in a state.

        It combines the errors of the winding, of the leads, of the effect of surrounding metal, and of the target's
        loss.
        """
        winding = circuit.winding_resistance(state.frequency)
        leads = float(circuit.leads.resistances_at(np.array([state.frequency]), circuit.conductivity)[0])
        winding_error = self.bound.relative(winding / circuit.resistance, state.frequency)
        metal = 0.0 if self.nearest is None or state.state == FREE else near_metal_error(coil, self.nearest)
        lost = abs(circuit.reflections[state.state].target_error_bounds(state.frequency)[1])
        return (winding_error * winding + circuit.leads.resistance_error * leads + lost) / state.resistance + metal

    @property
    def inductance_error(self) -> float:
        """Relative error bound of the inductance.

        For a coil from a drawing, it includes the deviation from the fitted shape.
        """
        copper, error = self.geometry.spec.copper, self.method.error(self.geometry)
        if copper is None:
            return error
        if self.geometry.spirals:  # computed by dimensions and not by the path
            return error + MISFIT * copper.deviation / min(self.geometry.spec.size)
        return error * (UNFITTED if copper.deviation > OWN_ROUNDING else 1.0)


_spectrum = lru_cache(maxsize=4)(metal_spectrum)


def shared_spectrum(geometry: WindingGeometry, nearest: float) -> CurrentSpectrum:
    """Return the current spectrum of a winding (m2) for a target at least `nearest` (m) from any layer's mid-plane.

    The distance is rounded down, so that nearly equal distances share the spectrum that `solve_winding` caches.
    """
    return _spectrum(geometry, _round_down_to_power(_round_down_to_power(nearest, HEIGHT_STEP), NO_NEARER), False)


def solve_winding(
    spec: CoilSpec, first: Coil, assembly: AssemblyStates, conductivity: float, method: str | None,
    tolerance: float | None,
) -> SolvedWinding:
    """Solve the winding of identical coils.

    `first` is the first coil, and `conductivity` (S/m) is its copper's. `method` and `tolerance` are explained in
    `sitscad.estimates.estimate`.
    """
    winding, rough = replace(first, series=()), is_rough(tolerance)
    geometry, chosen, inductance = _solved(spec, winding, method, tolerance)
    nearest = nearest_metal(geometry, assembly)
    spirals, crowding, spectrum = equivalent_spirals(geometry, first), None, None
    if nearest is not None:
        distance = _distance_step(nearest, assembly, rough)
        crowding = losses_near_metal(spirals, conductivity, distance, tolerance, bool(geometry.spirals))
        spectrum = _spectrum(geometry, distance, rough)
    bound = resistance_bound(spec, first, geometry.spirals, conductivity, resistance_tolerance(tolerance))
    return SolvedWinding(geometry, spirals, inductance, chosen, conductivity,
                         _loss(spec, winding, conductivity, tolerance), nearest, crowding, spectrum, bound, rough)


def nearest_metal(geometry: WindingGeometry, assembly: AssemblyStates) -> float | None:
    """Return the least distance (m) of metal from a layer's mid-plane in any state. None if there is no metal."""
    heights = [layer.z for layer in geometry.spirals or geometry.drawn]
    # one sigma of pad or glue brings metal little nearer, and only a difference is taken
    small = (PAD, PAD_SIZE, GLUE)
    ranges = [around for (_, cause), pair in assembly.ranges.items() if cause not in small for around in pair]
    states = [*assembly.states, *ranges]
    metal = [s.above.distance - max(heights) for s in states if s.above]
    metal += [s.below.distance + min(heights) for s in states if s.below]
    return max(min(metal), LEAST_DISTANCE) if metal else None


def _distance_step(nearest: float, assembly: AssemblyStates, is_rough: bool = False) -> float:
    """Return the distance (m) of metal for which the winding's current spectrum is computed: `nearest` rounded down.

    Boards with nearly equal distances then share the spectrum. If there is a target, the distance is first rounded down
    to powers of `HEIGHT_STEP`, like the heights for which the target's eddy currents are computed.
    """
    if not is_rough and any(around.above is not None for around in assembly.states):
        nearest = _round_down_to_power(nearest, HEIGHT_STEP)
    return _round_down_to_power(nearest, NO_NEARER)


def _round_down_to_power(length: float, ratio: float) -> float:
    """Return the largest integer power of `ratio` that is not above a length (m).

    Rounding errors of powers are ignored.
    """
    return float(ratio ** math.floor(math.log(length, ratio) + 1e-9))


def spectrum_near_metal(spec: CoilSpec, first: Coil, assembly: AssemblyStates) -> CurrentSpectrum | None:
    """Return the current spectrum (m2) that `solve_winding` uses, without its other results. None if no metal is near.

    `first` is the first of the identical coils.
    """
    geometry = winding_geometry(spec, replace(first, series=()))
    nearest = nearest_metal(geometry, assembly)
    return None if nearest is None else _spectrum(geometry, _distance_step(nearest, assembly), False)


@lru_cache(maxsize=4)
def _solved(
    spec: CoilSpec, coil: Coil, method: str | None, tolerance: float | None
) -> tuple[WindingGeometry, Method, float]:
    # Values of the drawn windings alone: designs with equal boards share them.
    geometry = winding_geometry(spec, coil)
    chosen = choose_method(geometry, method, tolerance)
    inductance = chosen.solve(geometry)
    assert inductance is not None
    return geometry, chosen, inductance


@lru_cache(maxsize=4)
def _loss(spec: CoilSpec, coil: Coil, conductivity: float, tolerance: float | None) -> ProximityLoss:
    return winding_losses(spec, coil, winding_geometry(spec, coil).spirals, conductivity, tolerance)


NO_NEARER = 1.2
"""Rounding step of distances of metal, as a ratio.

A distance is rounded down to a power of this ratio before a winding's current spectrum is computed.
"""

HEIGHT_STEP = 1.5
"""Rounding step of heights of a target, as a ratio.

A height is rounded down to a power of this ratio before the target's eddy currents are computed.
"""


def winding_inductance_matrix(
    spec: CoilSpec, coils: tuple[Coil, ...], winding: SolvedWinding, is_rough: bool = False
) -> tuple[Array, Array]:
    """Return the inductance matrix (coils, coils; H) of the bare windings, and the error bounds of its elements (H).

    All diagonal elements are equal, also for a reference coil with other windings.
    """
    if is_rough and winding.geometry.spirals and coils[-1].placement.own is None:
        return rough_inductance_matrix(winding.geometry.spirals, [coil.placement.centre for coil in coils],
                                       winding.inductance, winding.inductance_error)
    windings = tuple(replace(coil, series=()) for coil in coils)
    return _matrix(spec, windings, winding.inductance, winding.inductance_error)


@lru_cache(maxsize=2)
def _matrix(spec: CoilSpec, coils: tuple[Coil, ...], self_inductance: float, error: float) -> tuple[Array, Array]:
    kinds = [coil.placement.own or spec for coil in coils]
    is_mixed = len({kind.outline.is_round for kind in kinds}) > 1  # then a circle's turns are integrated as drawn
    return inductance_matrix(self_inductance, error, [
        (coil, winding_geometry(kind, coil, is_mixed)) for coil, kind in zip(coils, kinds, strict=True)])


LEAST_DISTANCE = 10e-6  # Least distance (m) of metal from a layer's mid-plane that is computed


@record(eq=False)
class SolvedWindings:
    """Layout at a temperature (degrees Celsius), with metal around the coils in each state and the winding's solution.

    `matrix` (coils, coils; H) holds the inductances of the bare windings, `matrix_errors` (H) their error bounds. The
    winding was computed with `method` and `tolerance`.
    """

    layout: Layout
    temperature: float
    assembly: AssemblyStates
    winding: SolvedWinding
    matrix: Array
    matrix_errors: Array
    method: str | None = None
    tolerance: float | None = None

    @property
    def spec(self) -> SensorSpec:
        """Spec whose metals have their conductivities at `temperature`."""
        return self.layout.spec

    @property
    def has_target(self) -> bool:
        """Whether any state has a target over the coils."""
        return any(around.above is not None for around in self.assembly.states)

    @property
    def first_cell(self) -> SolvedWindings:
        """Solved winding of the first cell as a separate sensor. Without cells, the whole sensor."""
        layout = self.layout.cell(1)
        count = len(layout.coils)
        return replace(self, layout=layout, matrix=self.matrix[:count, :count],
                       matrix_errors=self.matrix_errors[:count, :count])
