"""Unwanted effects of target and metal on the reference coil, which should measure neither."""

from __future__ import annotations

import math

import numpy as np

from sitscad.assembly.places.state import FREE, REST
from sitscad.basics.record import record, replace
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates
from sitscad.estimates.states.solved_target import own_inductance_changes
from sitscad.layout.board import Layout


@record
class ReferenceSignal:
    """Inductance changes (H) by the target from rest to the pressed state, of the reference coil and of a sensing coil.

    `sensing` belongs to the sensing coil named `coil`, which has the largest change. `at_rest` (H) is the change of the
    reference coil by the target at rest.
    """

    coil: str
    reference: float
    """Change (H) of the reference coil."""
    sensing: float
    at_rest: float

    @property
    def share(self) -> float:
        """Inductance change of the reference coil divided by the change of the sensing coil, as an absolute value.

        Both changes are from rest to the required force. Infinite if the sensing coil does not change.
        """
        return abs(self.reference / self.sensing) if self.sensing else math.inf


def reference_signal(layout: Layout, estimates: Estimates) -> ReferenceSignal | None:
    """Return the target's signals on the reference coil and on a sensing coil, from rest to the required force.

    If the sensor has cells, the target is the nearest cell's. None if there is no reference coil, if the target's
    effect is not by the field solution, or if no state is pressed.
    """
    reference, z = layout.reference, estimates.pressed_place
    if reference is None or estimates.reference is None or z is None or not estimates.is_solved:
        return None
    cells = [layout.sensing.cell(k + 1) for k in range(len(layout.spec.cell_placements))]
    near = min(cells, key=lambda cell: math.dist(cell.spec.array.middle, reference.placement.centre))
    poses = np.zeros((2, 6))
    poses[1, 2] = z
    # a coil of other windings is solved by itself, below the same target
    own = replace(near, spec=replace(near.spec, coil=layout.spec.reference_coil), coils=(reference,))
    frequency = estimates.reference.sensor_frequency
    rest, pressed = np.concatenate(
        [own_inductance_changes(board, poses, frequency).real for board in (near, own)], axis=1).tolist()
    *changes, seen = (after - before for before, after in zip(rest, pressed, strict=True))
    number = max(range(len(changes)), key=lambda k: abs(changes[k]))
    return ReferenceSignal(near.coils[number].name, seen, changes[number], rest[-1])


def metal_change_ratio(coil: CoilEstimate) -> float:
    """Return the relative inductance change of a coil without a target by the metal behind it.

    It is 0 if the state at rest or the free state is missing.
    """
    if REST not in coil.states or FREE not in coil.states:
        return 0.0
    return coil.states[REST].inductance / coil.states[FREE].inductance - 1.0
