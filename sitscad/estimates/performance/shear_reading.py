"""False readings of measured axes by shear forces that the array does not measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sitscad.basics.record import record
from sitscad.estimates.performance_values import FORCES, MOMENTS
from sitscad.spec.sensor import Requirements

if TYPE_CHECKING:
    from sitscad.estimates.performance.points import SensingAnalysis

SHEARS = FORCES[1:]
"""Names of the shear axes."""

MAX_SHEAR_READING = 0.1
"""Largest false reading by unmeasured shear that is not reported, as a fraction of the full scale of the axis.

It is the limit for axes without an allowed error in the spec. It equals the limit of SIT221 for the other jaw's metal.
"""


@record
class ShearReading:
    """False reading on a measured axis at full load, caused by shear along an axis that the array does not measure.

    `error` is the reading (N, N m) on `axis`. `force` (N) is the full shear force along `shear`. `limit` (N, N m) is
    the allowed error of `axis`, or else 10 % of its full scale `scale`.
    """

    error: float
    axis: str
    scale: float
    limit: float
    shear: str
    force: float


def shear_readings(sensing: SensingAnalysis, requirements: Requirements) -> list[ShearReading]:
    """Return the false readings by unmeasured shear at full load, for all measured axes that the spec requires."""
    is_required = {"normal": requirements.normal_force, "moment_x": requirements.moments[0],
                   "moment_y": requirements.moments[1],
                   **dict.fromkeys(SHEARS, requirements.shear_force or requirements.is_shear_accuracy_required)}
    allowed = {"normal": requirements.normal_error, **dict.fromkeys(SHEARS, requirements.shear_error),
               **dict.fromkeys(MOMENTS, requirements.moment_error)}
    return [
        ShearReading(float(error), axis, scale, allowed[axis] or MAX_SHEAR_READING * scale, shear,
                     sensing.bench.full_scales[shear])
        for shear, errors in sensing.points[-1].unmeasured_load_errors().items()
        for axis, error, scale in zip(sensing.bench.range.axes, errors, map(float, sensing.bench.range.full_scales),
                                      strict=True)
        if is_required[axis] and np.isfinite(error)
    ]
