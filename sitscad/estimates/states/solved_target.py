"""What the target changes of the coils in every state, solved as in a response: where its shares are not enough."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array, ComplexArray
from sitscad.estimates.response.placed import Placed, at_rest
from sitscad.estimates.response.plate import (
    LOSSY,
    endless_like,
    plate_over_jaw,
    solving_work,
    stated_errors,
    stated_losses,
)
from sitscad.estimates.states.assembly import AssemblyStates, metal_behind
from sitscad.estimates.states.finite_target import TargetChanges
from sitscad.layout.board import Coil, Layout
from sitscad.spec.places import cell_placements, cell_specs
from sitscad.spec.sensor import SensorSpec

MOST, MAGNETIC = 800.0**3, 1100.0**3
"""Work (`solving_work`) up to which a target is solved for its states: one or two seconds. Of magnetic metals more,
three or four: their shares may have the sign of the change wrong."""


def is_affordable(spec: SensorSpec, coils: Sequence[Coil], assembly: AssemblyStates, band: tuple[float, float]) -> bool:
    """Whether the target of the states can be solved in a second or two: not where it is far larger than what it is
    near to.
    """
    spec = cell_specs(spec)[0]
    coils = coils[: len(spec.array.placements)]
    assert spec.target is not None
    cover = _placed(spec, assembly).cover(spec, coils)
    most = MAGNETIC if spec.target.material.relative_permeability > 1.1 else MOST
    return solving_work(spec, coils, math.sqrt(band[0] * band[1]), metal_behind(spec), cover) <= most


def _placed(spec: SensorSpec, assembly: AssemblyStates) -> Placed:
    states = [around.state for around in assembly.states if around.above is not None]
    poses = np.zeros((len(states), 6))
    poses[:, 2] = [state.pose.z if state.pose is not None else 0.0 for state in states]
    return Placed.of(spec, at_rest(spec), poses)


def solved_target(layout: Layout, assembly: AssemblyStates, band: tuple[float, float], scale: float) -> TargetChanges:
    """Solved at both ends of a band (Hz) for the level target of every state; `scale` (H) is the free inductance. Of
    cells one is solved, and what a target does to coils of other cells is none.
    """
    cells, layout = len(cell_placements(layout.spec)), layout.cell(1)
    spec, coils = layout.spec, layout.coils
    placed = _placed(spec, assembly)
    cover = placed.cover(spec, coils)
    plate = plate_over_jaw(layout, band, cover)
    total, lossless = (_rounded(part) for part in plate.changes(placed.turns, placed.places, True))
    frequency, size = math.sqrt(band[0] * band[1]), np.abs(total).max(axis=0)
    change, own = total.mean(axis=0).real, -2.0 * math.pi * frequency * np.einsum("fpcc->pc", lossless.imag) / 2.0
    behind = plate.mirror_error + LOSSY * plate.is_over_a_poor_mirror + cover.error
    part = cover.part(spec)
    stated = stated_errors(part, change, size, scale, placed.lowest, 0.0, behind)
    least = np.maximum(np.abs(change), 0.01 * scale)
    more = np.einsum("pcc->pc", stated * least * np.sign(change))
    sizes = np.einsum("pcc->pc", size)
    losses = stated_losses(part, own, sizes, scale, placed.lowest, 0.0, behind, frequency)
    errors = np.stack([more, losses], axis=-1)
    names = [around.name for around in assembly.states if around.above is not None]
    return TargetChanges(
        np.array(band), {name: np.asarray(np.kron(np.eye(cells), total[:, k])) for k, name in enumerate(names)},
        {name: np.tile(each, (cells, 1)) for name, each in zip(names, errors, strict=True)}, endless_like(spec),
    )


def _rounded(changes: ComplexArray) -> ComplexArray:
    # To DIGITS of the largest: the last digits of a system's solution hang on the number of threads, a package may not.
    scale = 10.0 ** math.ceil(math.log10(max(float(np.abs(changes).max()), 1e-300)))
    return np.asarray(np.round(changes / scale, DIGITS) * scale)


DIGITS = 9


def own_changes(layout: Layout, poses: Array, frequency: float) -> ComplexArray:
    """What the target at (n, 6) poses (m, rad) changes of every coil's inductance (H, complex), (n, coils), at one
    frequency (Hz), currents even.
    """
    cells, layout = len(cell_placements(layout.spec)), layout.cell(1)
    spec = layout.spec
    placed = Placed.of(spec, at_rest(spec), poses)
    plate = plate_over_jaw(layout, (frequency,), placed.cover(spec, layout.coils))
    found = np.einsum("pcc->pc", plate.changes(placed.turns, placed.places, True)[0][0])
    return np.asarray(np.tile(found, (1, cells)))
