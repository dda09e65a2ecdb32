"""A winding solved once for all alike coils: inductance, loss, and what metal near it changes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.circuit.neighbours import inductance_matrix
from sitscad.estimates.circuit.tank import CoilCircuit
from sitscad.estimates.states.assembly import Assembly
from sitscad.estimates.states.pressing import GLUE, PAD, PAD_SIZE
from sitscad.estimates.values import StateEstimate
from sitscad.estimates.winding.losses import losses_near_metal, wanted_tolerance, winding_losses
from sitscad.estimates.winding.methods import (
    Method,
    WindingGeometry,
    choose_method,
    equivalent_spirals,
    reflected_by,
    winding_geometry,
)
from sitscad.estimates.winding.resistance_bounds import ResistanceBound, near_metal_error, resistance_bound, state_error
from sitscad.layout.board import Coil
from sitscad.physics.inductance.spirals import SpiralLayer
from sitscad.physics.loss.current_modes import ProximityLoss
from sitscad.physics.metal.current_spectrum import CurrentSpectrum
from sitscad.physics.metal.near_metal import CrowdingNearMetal
from sitscad.record import record
from sitscad.scene.state import FREE
from sitscad.spec.coil import CoilSpec

Array = NDArray[np.float64]


@record(eq=False)
class SolvedWinding:
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
        """Relative error bound of the resistance at a coil's contacts in a state, the target's share in it."""
        metal = 0.0 if self.nearest is None or state.state == FREE else near_metal_error(coil, self.nearest)
        lost = abs(circuit.reflections[state.state].unsure(state.frequency)[1])
        return state_error(self.bound, circuit, state, metal) + lost / state.resistance

    @property
    def inductance_error(self) -> float:
        """Relative error bound of the inductance, as its method states it."""
        return self.method.error(self.geometry)


def solve_winding(
    spec: CoilSpec, first: Coil, assembly: Assembly, conductivity: float, method: str | None, tolerance: float | None
) -> SolvedWinding:
    """The winding of the first of alike coils, its copper of a conductivity (S/m); see `sitscad.estimates.estimate`."""
    bare = replace(first, series=())
    geometry, chosen, inductance = _solved(spec, bare, method, tolerance)
    loss = _loss(spec, bare, conductivity, tolerance)
    nearest = _nearest(geometry, assembly)
    spirals = equivalent_spirals(geometry, first)
    crowding = (
        None
        if nearest is None
        else losses_near_metal(spirals, conductivity, _no_nearer(nearest), tolerance, bool(geometry.spirals))
    )
    spectrum = None if nearest is None else _spectrum(geometry, _no_nearer(nearest))
    bound = resistance_bound(spec, first, geometry.spirals, conductivity, wanted_tolerance(tolerance))
    return SolvedWinding(geometry, spirals, inductance, chosen, conductivity, loss, nearest, crowding, spectrum, bound)


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


def _no_nearer(distance: float) -> float:
    """A distance (m) up to a fifth less, the same for many: waves are found once for boards with metal about there."""
    return float(NO_NEARER ** math.floor(math.log(distance, NO_NEARER) + 1e-9))


NO_NEARER = 1.2
"""Ratio of those distances."""


@lru_cache(maxsize=4)
def _spectrum(geometry: WindingGeometry, nearest: float) -> CurrentSpectrum:
    return reflected_by(geometry, nearest)


def beside_each_other(spec: CoilSpec, coils: tuple[Coil, ...], winding: SolvedWinding) -> tuple[Array, Array]:
    """The inductance matrix (H) of the bare windings of all coils, and what its elements can be off by at most (H)."""
    bare = tuple(replace(coil, series=()) for coil in coils)
    return _matrix(spec, bare, winding.inductance, winding.inductance_error)


@lru_cache(maxsize=2)
def _matrix(spec: CoilSpec, coils: tuple[Coil, ...], own: float, error: float) -> tuple[Array, Array]:
    return inductance_matrix(own, error, [(coil, winding_geometry(spec, coil)) for coil in coils])


def _nearest(geometry: WindingGeometry, assembly: Assembly) -> float | None:
    """Least distance (m) of metal from any layer's mid-plane in any state; None without metal."""
    heights = [layer.z for layer in geometry.spirals or geometry.drawn]
    # a pad or glue thinner, or a pad smaller, by one sigma is not much nearer, and only a difference is taken of it
    small = (PAD, PAD_SIZE, GLUE)
    ranges = [around for (_, cause), pair in assembly.ranges.items() if cause not in small for around in pair]
    states = [*assembly.states, *ranges]
    above = [s.above.distance - max(heights) for s in states if s.above]
    below = [s.below.distance + min(heights) for s in states if s.below]
    return max(min([*above, *below]), LEAST_DISTANCE) if above or below else None


LEAST_DISTANCE = 10e-6
"""Distance (m) from a layer's mid-plane below which metal is taken to be there."""
