"""The loads for which a sensor is calibrated."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance.bench import (
    SLIP,
    axes_told_apart,
    beyond_held_shear,
    full_normal,
    held_shear,
    shear_at,
)
from sitscad.estimates.performance.values import AXES
from sitscad.mechanics.elastomer import VALID_SHEAR
from sitscad.physics.polynomials import spread
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]


@record
class WorkingRange:
    """Loads (N): the normal force up to `normal`, shear along the `axes` that the array tells apart up to `shear` in
    any direction: of two shears together their root of the sum of squares. `notes` say where that is less than what is
    required.
    """

    axes: tuple[str, ...]
    normal: float
    shear: float
    notes: tuple[str, ...] = ()

    @property
    def is_round(self) -> bool:
        """Whether two shears share one limit."""
        return len(self.axes) == len(AXES)

    @property
    def full_scales(self) -> Array:
        """The largest force (N) on every axis."""
        return np.array([self.normal if name == "normal" else self.shear for name in self.axes])

    @property
    def columns(self) -> list[int]:
        """Where the axes stand in a load."""
        return [AXES.index(name) for name in self.axes]

    @property
    def corners(self) -> Array:
        """The loads at its corners, (n, 3)."""
        ends = [(0.0, self.normal), *(((-self.shear, 0.0, self.shear)) if name in self.axes else (0.0,)
                                      for name in AXES[1:])]  # fmt: skip
        return np.array(list(product(*ends)))

    def inside(self, count: int, skip: int = 0) -> Array:
        """Loads (count, 3) that fill it evenly, always the same."""
        part = spread(count, 3, skip)
        found = np.zeros((count, 3))
        found[:, 0] = self.normal * part[:, 0]
        shears = [k for k in self.columns if k]
        if len(shears) == 1:
            found[:, shears[0]] = self.shear * (2.0 * part[:, 1] - 1.0)
        elif shears:
            angle = 2.0 * np.pi * part[:, 2]
            found[:, 1:] = (self.shear * np.sqrt(part[:, 1]))[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        return found


def working_range(spec: SensorSpec) -> WorkingRange:
    """The required forces, shear as far as the pad's thickness; where there are none, a strain of 20 % and the shear at
    slip on tissue, as far as half the thickness. Raises NoResponse without a pad.
    """
    axes, normal = axes_told_apart(spec.array), full_normal(spec)
    asked = spec.requirements.shear_force
    shear = SLIP * normal if asked is None else asked
    most, held = shear_at(spec, VALID_SHEAR), held_shear(spec)
    notes = []
    if len(axes) > 1 and shear > held:
        if asked is None:
            shear = held
        else:
            notes.append(beyond_held_shear(held))
            if shear > most:
                notes.append(
                    f"shear is calibrated to {most:.3g} N, the pad's thickness: beyond, no law of it is trusted"
                )
            shear = min(shear, most)
    found = WorkingRange(axes, normal, shear)
    if found.is_round:
        notes.append(together(shear))
    return replace(found, notes=tuple(notes))


def together(shear: float) -> str:
    """What is said of two shears that share one limit (N)."""
    return (
        f"the calibration's map is made for shear up to {shear:.3g} N in any direction: along x and y together, the "
        f"root of the sum of their squares stays within that ({shear / math.sqrt(2.0):.3g} N of each); beyond, all "
        "forces may read wrong, the normal one most"
    )
