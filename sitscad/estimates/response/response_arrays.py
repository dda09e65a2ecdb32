"""Arrays of a response over the poses, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.quantities import RESPONSE
from sitscad.basics.record import record
from sitscad.basics.units import count_text

POSE_NAMES = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")
"""Names of the six numbers of a pose, in the order of each row of `Response.poses`."""


@record(eq=False)
class Response:
    """Coil readings at poses of the target. The first axis of each array is the pose; others are coils.

    `poses` (n, 6) are in metres and radians in board axes, from rest (`sitscad.assembly.places.state.Pose`).

    `inductance` (H) and `resistance` (ohm) are at the terminals, with all surroundings and idle neighbours.
    `target_change` (H, two axes of coils) is the target's change of the windings' inductance matrix, for evenly spread
    currents and the other coils open. `target_change_error` is its stated error, relative to the larger of the change
    and 1 % of the free winding's inductance. `target_resistance` (ohm) is the loss in the target alone.
    `target_resistance_error` is its stated error, relative to the larger of the loss and 1 % of the coil's resistance.
    All these are at `taken_at` (Hz): each coil's tank frequency unless another was given.

    `frequency` (Hz), `counts` and `parallel_resistance` (ohm) belong to the tank. They are NaN if it does not
    oscillate. `counts` (see `Conversion`) are also NaN outside the converter's range. `amplitude` (V) is at the
    converter's pins.

    `strain` is the pad's compression at the near face's centre, over its thickness. `force` (N) and `moment` (Nm) (n,
    3) hold the target in place; NaN if unknown. Without an elastomer all three are None.

    `by_pose` (n, coils, 6; Hz/m, Hz/rad) and `by_load` (n, coils, 3; Hz/N: normal, shear_x, shear_y) are derivatives of
    `frequency`, if requested. `cases` (n,) are the names of the load cases, empty without load cases. `gap` (m) is the
    distance at rest from the board's top face to the target's near face, and `glue` (m) the thickness of the glue lines
    in this gap.
    """

    coils: tuple[str, ...]
    poses: Array
    inductance: Array
    resistance: Array
    target_change: Array
    target_change_error: Array
    target_resistance: Array
    target_resistance_error: Array
    taken_at: Array
    frequency: Array
    counts: Array
    parallel_resistance: Array
    amplitude: Array
    strain: Array | None
    force: Array | None
    moment: Array | None
    notes: tuple[tuple[str, ...], ...]
    by_pose: Array | None = None
    by_load: Array | None = None
    cases: tuple[str, ...] = ()
    gap: float = math.nan
    glue: float = math.nan

    def __repr__(self) -> str:
        """Return a line with the numbers of poses and coils."""
        return f"<Response of {', '.join(self.coils[:8])} at {count_text(len(self.poses), 'pose')}>"

    def __len__(self) -> int:
        return len(self.poses)

    def part(self, rows: Sequence[int]) -> Response:
        """Return the response at some of the poses."""
        selected = {name: getattr(self, name)[rows] for name in ARRAYS if getattr(self, name) is not None}
        notes, cases = tuple(self.notes[k] for k in rows), tuple(self.cases[k] for k in rows if self.cases)
        return replace(self, notes=notes, cases=cases, **selected)

    def arrays(self) -> dict[str, Array]:
        """Return the known arrays by their names in documents."""
        values = {each.key: each.value(self) for each in RESPONSE}
        return {name: value for name, value in values.items() if value is not None}

    def point_document(self, number: int) -> dict[str, object]:
        """Return one pose as JSON."""
        document: dict[str, object] = {"strain": None}
        if self.cases and self.cases[number]:
            document["case"] = self.cases[number]
        document["pose"] = dict(zip(POSE_NAMES, (self.poses[number] + 0.0).tolist(), strict=True))
        for name, wrench in (("force_N", self.force), ("moment_Nm", self.moment)):
            is_known = wrench is not None and np.all(np.isfinite(wrench[number]))
            document[name] = _plain(wrench[number]) if wrench is not None and is_known else None
        for name, value in self.arrays().items():
            if name not in ("pose", "force_N", "moment_Nm"):
                document[name] = _plain(value[number])
        document["counts"] = [None if math.isnan(x) else int(x) for x in self.counts[number]]
        return document | {"notes": list(self.notes[number])}


def _plain(value: Array | float) -> object:
    # Lists of floats, None if not finite; zeros have no sign.
    if np.ndim(value) == 0:
        return float(value) + 0.0 if math.isfinite(float(value)) else None
    return [_plain(element) for element in np.asarray(value)]


def concatenate_responses(parts: Sequence[Response]) -> Response:
    """Join several responses of the same coils to one.

    `parts` are the responses.
    """
    first = parts[0]
    if len(parts) == 1:
        return first
    stacked = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS
             if getattr(first, name) is not None}
    notes, cases = sum((part.notes for part in parts), ()), sum((part.cases for part in parts), ())
    return replace(first, notes=notes, cases=cases, **stacked)  # type: ignore[arg-type]


ARRAYS = tuple(one.name for one in fields(Response) if one.name not in ("coils", "notes", "cases", "gap", "glue"))
"""Names of the arrays of a response whose first axis is the pose."""
