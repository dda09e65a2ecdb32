"""Effect of the target on the coils in each state, computed by the field solver that responses use."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sitscad.assembly.places.state import FREE
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.estimates.circuits.solved_winding import SolvedWindings
from sitscad.estimates.circuits.tank import CoilCircuit, Tank
from sitscad.estimates.states.near import NearTarget
from sitscad.estimates.states.placed import TargetPoses, level_poses, target_centre_at_rest
from sitscad.estimates.states.plate import (
    LOSSY,
    loss_error_bounds,
    plate_over_jaw,
    sheet_spectrum,
    solving_work,
    stated_errors,
)
from sitscad.estimates.states.scan import Changes
from sitscad.estimates.targets.assembly import AssemblyStates, metal_behind
from sitscad.kernels.electromagnetics.resonator import oscillate
from sitscad.layout.board import Layout
from sitscad.spec.sensor import SensorSpec

MOST = 800.0**3
"""Largest work (`solving_work`) of the field solution of a target for the states: one or two seconds.

For more work, correction ratios are used instead.
"""

MAGNETIC = 1100.0**3
"""Largest work (`solving_work`) of the field solution of a magnetic target for the states: three or four seconds.

It is higher than `MOST`, because correction ratios of magnetic metals may give a change of the wrong sign.
"""


def is_affordable(windings: SolvedWindings, band: tuple[float, float]) -> bool:
    """Whether the field solution of the target for all states takes at most one or two seconds.

    `band` holds the two frequencies (Hz) of the solution. It takes longer if the target is far larger than its
    distance to coils or metal.
    """
    layout, assembly = windings.layout.cell(1), windings.assembly
    spec, coils = layout.spec, layout.coils
    assert spec.target is not None
    cover = _state_poses(spec, assembly).pose_range(spec.target, spec.coil, coils, spec.array.middle)
    most = MAGNETIC if spec.target.material.relative_permeability > 1.1 else MOST
    return solving_work(
        spec.target, spec.coil, coils, math.sqrt(band[0] * band[1]), metal_behind(spec), cover) <= most


def _state_poses(spec: SensorSpec, assembly: AssemblyStates) -> TargetPoses:
    """Return the target's poses in all states that have a target, in the order of the states."""
    assert spec.target is not None
    poses = level_poses([around.state for around in assembly.states])
    return TargetPoses.from_rest(spec.target, target_centre_at_rest(spec), poses)


@record(eq=False)
class SolvedStates:
    """Effect of the level target on the coils in the states `names`, by the field solution.

    `totals` holds the changes of the inductance matrix of the bare windings by state: (2 frequencies, coils, coils; H,
    complex). The frequencies are `band`. `errors` holds error bounds of each coil's inductance change (H) and loss
    (ohm) by state: (coils, 2). They have the signs of change and loss.
    """

    near: NearTarget
    poses: TargetPoses
    changes: Changes
    names: tuple[str, ...]
    totals: Mapping[str, ComplexArray]
    errors: Mapping[str, Array]

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency (Hz) at which the target's eddy currents are computed."""
        low, high = self.near.band
        return low, high

    @property
    def interpolation_spectrum(self) -> Callable[[Array], ComplexArray]:
        """Function of frequency (Hz) by which changes are interpolated, as in `Changes`."""
        return sheet_spectrum(self.near.windings.spec.coil.size, self.near.windings.spec.target)

    def cache_key(self, number: int, coil: str, state: str) -> tuple[complex, ...]:
        """Return a cache key for coil `number` from 0, equal for coils whose inductances change equally in a state."""
        if state not in self.totals:
            return ()
        changes = self.totals[state][:, number, number]
        return tuple(complex(f"{value:.9e}") for value in changes)

    def crowding_function(self, state: str, number: int) -> Callable[[Array], ComplexArray]:
        """Return a function of frequency (Hz): the inductance change that current crowding adds, for coil `number`.

        It is a fraction of the coil's change by the target for current that is even across the tracks.
        """
        coil_number, near = number % len(self.near.windings.layout.coils), self.near
        height = float(near.log_heights_over_coils(self.poses)[self.names.index(state), coil_number])
        if self.has_other_cells:  # the circuits' own values are final
            return lambda frequencies: near.crowding_at_height(frequencies, math.exp(height))
        return lambda frequencies: near.interpolated_crowding(frequencies, height)

    @property
    def has_other_cells(self) -> bool:
        """Whether the sensor has further cells, whose coils are not part of the solution."""
        return len(next(iter(self.errors.values()))) != len(self.near.windings.layout.coils)

    def store_target_oscillations(self, circuits: Sequence[CoilCircuit], tank: Tank) -> None:
        """Compute the tanks' oscillations in all states as a response does, and store them in the circuits.

        If the sensor has other cells, circuits stay unchanged: their coils also couple to idle coils of other cells,
        which a cell's response leaves out.
        """
        if self.has_other_cells:
            return
        names = [name for name in self.names if name in circuits[0].reflections]
        start = np.array([tank.oscillation(circuit, names[0]).frequency for circuit in circuits]) if names else None
        if start is None or not np.all(np.isfinite(start)):
            return
        network = tank.network(np.array([circuit.self_capacitance for circuit in circuits]))
        oscillations = self.near.oscillations(self.poses, self.changes, tank, network, start).as_list()
        for row, name in enumerate(self.names):
            for k, circuit in enumerate(circuits):
                circuit.oscillations[name, tank.capacitor] = oscillations[row * len(circuits) + k]
        if FREE in circuits[0].reflections:  # the response does not interpolate it, either

            def alone(frequencies: Array) -> tuple[Array, Array]:
                each = [coil.exact_impedance(FREE, at) for coil, at in zip(circuits, frequencies[:, None], strict=True)]
                inductance, resistance = np.array(each)[:, :, 0].T
                return inductance, resistance

            start = np.array([tank.oscillation(circuit, FREE).frequency for circuit in circuits])
            free = oscillate(network, alone, tank.converter.limit("drive_delay"), start)
            for circuit, at in zip(circuits, free.as_list(), strict=True):
                circuit.oscillations[FREE, tank.capacitor] = at


def solve_states(windings: SolvedWindings, band: tuple[float, float]) -> SolvedStates:
    """Compute the eddy currents of the level target in every state, at both ends of a band (Hz).

    Only the first cell is computed. The target's effect on coils of other cells is neglected.
    """
    first, scale = windings.first_cell, windings.winding.inductance
    spec, coils = first.spec, first.layout.coils
    cells = len(windings.layout.coils) // len(coils)
    target_poses = _state_poses(spec, windings.assembly)
    assert spec.target is not None
    cover = target_poses.pose_range(spec.target, spec.coil, coils, spec.array.middle)
    near = NearTarget(first, cover, band)
    changes = near.changes(target_poses)
    total, lossless, plate = changes.total, changes.lossless, near.plate
    frequency, size = math.sqrt(band[0] * band[1]), np.abs(total).max(axis=0)
    change, lost = total.mean(axis=0).real, -2.0 * math.pi * frequency * np.einsum("fpcc->pc", lossless.imag) / 2.0
    behind = plate.mirror_error + LOSSY * plate.is_over_a_poor_mirror + cover.error
    part = cover.part(spec.target)
    relative = stated_errors(part, spec.coil, change, size, scale, target_poses.lowest, 0.0, behind)
    least = np.maximum(np.abs(change), 0.01 * scale)
    more = np.einsum("pcc->pc", relative * least * np.sign(change))
    sizes = np.einsum("pcc->pc", size)
    losses = loss_error_bounds(part, spec.coil, lost, sizes, scale, target_poses.lowest, 0.0, behind, frequency)
    errors = np.stack([more, losses], axis=-1)
    names = tuple(around.name for around in windings.assembly.states if around.state.pose is not None)
    return SolvedStates(
        near, target_poses, changes, names,
        {name: np.asarray(np.kron(np.eye(cells), total[:, k])) for k, name in enumerate(names)},
        {name: np.tile(each, (cells, 1)) for name, each in zip(names, errors, strict=True)},
    )


def own_inductance_changes(layout: Layout, poses: Array, frequency: float) -> ComplexArray:
    """Return the changes of the coils' own inductances by the target of one cell: (n, coils; H, complex).

    They are at (n, 6) poses (m, rad) and one frequency (Hz), for current that is even across the tracks.
    """
    spec = layout.spec
    assert spec.target is not None
    target_poses = TargetPoses.from_rest(spec.target, target_centre_at_rest(spec), poses)
    plate = plate_over_jaw(layout, (frequency,), target_poses.pose_range(
        spec.target, spec.coil, layout.coils, spec.array.middle))
    return np.asarray(np.einsum("pcc->pc", plate.changes(target_poses.turns, target_poses.places, True)[0][0]))
