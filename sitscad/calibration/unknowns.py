"""Possible manufacturing errors of a sensor, with their standard deviations.

Each possible error is called an *unknown*. A calibration fits some unknowns to the readings.
"""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.pressing import GLUE, MODULUS, PAD
from sitscad.estimates.states.plate import USUAL as CHANGE_SIGMA
from sitscad.estimates.tolerances.scatter import (
    CAPACITOR,
    CLOCK,
    OFFSET_X,
    OFFSET_Y,
    TILT_X,
    TILT_Y,
    YAW,
    behind_scatter,
    coil_scatter,
)
from sitscad.spec.sensor import SensorSpec

POSE_ERRORS = ("gap", "glue", "offset_x", "offset_y", "tilt_x", "tilt_y", "twist")
"""Errors of the target's pose at rest, relative to the nominal pose.

`gap` is an error of the pad's thickness and `glue` an error of the glue's thickness. Both raise the target.
"""

PAD_ERRORS = ("modulus", "shear_modulus", "pad_curve", "softening", "shear_curve", "exponent")
"""Errors of the pad's stiffness. All but `exponent` are natural logarithms of factors.

`modulus`: factor on the modulus. `shear_modulus`: on the shear stiffness divided by the compression stiffness.
`pad_curve`: on the compression stiffness at the strain `HELD_STRAIN`. `softening`: on the lateral travel under the full
normal force. `shear_curve`: on the shear stiffness at the shear strain `HELD_SHEAR`. `exponent` is added to the Ogden
exponent.
"""

SHEAR_ERRORS = ("shear_modulus", "softening", "shear_curve")
"""Errors of the pad in shear. Together they change readings nearly like shear loads entered with a wrong size."""

BOARD_ERRORS = ("inductance", "target_change", "clock")
"""Relative errors common to all coils: inductance without target, inductance change by the target, clock frequency."""


@record
class Unknown:
    """A possible manufacturing error of a sensor.

    `unit` is ``1`` for a relative error. `sigma` is the standard deviation over manufactured sensors, in this unit.
    `is_fitted` is True if a calibration fits this error to the readings. Other errors only contribute to simulated
    sensors and to stated errors.
    """

    name: str
    unit: str
    sigma: float
    is_fitted: bool = True


@cache
def usual_value(name: str) -> float:
    """Return a usual value from `data/calibration.csv` by its name. Raises KeyError for an unknown name."""
    return {row["name"]: float(row["value"]) for row in rows("calibration")}[name]


def unknowns(spec: SensorSpec, coils: tuple[CoilEstimate, ...]) -> tuple[Unknown, ...]:
    """Return all possible errors of a sensor, in the order of the columns of `draw_units`.

    Errors with a standard deviation of 0 are omitted. Standard deviations come from `estimates.tolerances.scatter`,
    from the pad's law and from the model. Tilts include the thickness difference between two ends of a pad, which is
    assumed as large as between two pads. Most of the inductance's scatter is common to all coils of a board. One cause
    is the metal behind them. Raises NoResponse without a pad.
    """
    law, target = soft_pad(spec).sigma, spec.target
    assert target is not None
    sigma_of, (x, y) = tolerance_sigmas(spec), target.size
    inductance = next((each.sigma for each in coil_scatter(coils)), usual_value("coil_inductance"))
    by_metal, of_signal = behind_scatter(coils)
    listed = [
        Unknown("gap", "m", sigma_of[PAD]),
        Unknown("glue", "m", sigma_of[GLUE]),
        Unknown("offset_x", "m", sigma_of[OFFSET_X]),
        Unknown("offset_y", "m", sigma_of[OFFSET_Y]),
        Unknown("tilt_x", "rad", math.hypot(sigma_of[TILT_X], sigma_of[PAD] / y)),
        Unknown("tilt_y", "rad", math.hypot(sigma_of[TILT_Y], sigma_of[PAD] / x)),
        Unknown("twist", "rad", sigma_of[YAW]),
        Unknown("modulus", "1", sigma_of[MODULUS]),
        Unknown("shear_modulus", "1", law),
        Unknown("pad_curve", "1", usual_value("pad_curve")),
        Unknown("softening", "1", law),
        Unknown("shear_curve", "1", usual_value("shear_curve")),
        Unknown("exponent", "1", usual_value("exponent"), False),
        Unknown("inductance", "1", math.hypot(inductance, by_metal)),
        Unknown("target_change", "1", math.hypot(CHANGE_SIGMA, of_signal)),
        Unknown("clock", "1", sigma_of[CLOCK], False),
    ]
    for coil in coils:
        listed.append(Unknown(f"capacitor.{coil.name}", "1", sigma_of[CAPACITOR]))
        listed.append(Unknown(f"inductance.{coil.name}", "1", usual_value("coil_inductance")))
    return tuple(each for each in listed if each.sigma > 0.0)


WIDEST = 2.0
"""Largest error of a simulated sensor, in standard deviations. Sensors with larger errors count as rejects."""

SURELY = 6.0
"""Largest accepted fitted unknown, and largest accepted difference of a reading from the design.

Both are in manufacturing standard deviations. Tables with larger values are refused, because they belong to another
design.
"""


def draw_units(unknown_list: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Return random errors (count, unknowns; m, rad, relative) of simulated sensors. Equal seeds give equal errors.

    Errors are normally distributed, as the fit assumes, and limited to `WIDEST` standard deviations. Studies use
    uniform distributions instead. With the same standard deviation, these end at 1.7 standard deviations.
    """
    generator = np.random.default_rng(seed)
    normals = generator.normal(size=(count, len(unknown_list)))
    while np.any(beyond := np.abs(normals) > WIDEST):
        normals[beyond] = generator.normal(size=int(beyond.sum()))
    return np.asarray(normals * np.array([each.sigma for each in unknown_list]))


def draw_stratified_units(unknown_list: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Return errors (count, unknowns; m, rad, relative) of simulated sensors that cover each distribution evenly.

    For each unknown, the normal distribution is divided into `count` equally likely parts. Each sensor has the middle
    of one part, in random order (a Latin hypercube). Equal seeds give equal errors. Errors are not limited to `WIDEST`,
    because rare soft pads contribute much to the mean error.
    """
    generator, normal = np.random.default_rng(seed), NormalDist()
    middles = np.array([normal.inv_cdf((k + 0.5) / count) for k in range(count)])
    ranks = np.stack([generator.permutation(middles) for _ in unknown_list], axis=1)
    return np.asarray(ranks * np.array([each.sigma for each in unknown_list]))


def errors_by_name(unknown_list: tuple[Unknown, ...], errors: Array) -> dict[str, float]:
    """Return the errors (unknowns) of one sensor by name. Errors that are not among the unknowns are 0."""
    by_name = dict.fromkeys((*POSE_ERRORS, *PAD_ERRORS, *BOARD_ERRORS), 0.0)
    return by_name | {each.name: float(error) for each, error in zip(unknown_list, errors, strict=True)}
