"""The possible errors of a sensor of a design, with their standard deviations: the scatter of manufacture."""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.estimates.circuits.uncertainty import sigmas
from sitscad.estimates.coil_estimates import Estimates
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
"""Errors of the target's pose at rest, which are added to the pose.

The first two both raise the target. Only the gap also changes the pad's thickness.
"""

PAD_ERRORS = ("modulus", "shear_modulus", "pad_curve", "softening", "shear_curve", "exponent")
"""Errors of the pad's stiffness, as logarithms of factors, except for the exponent.

The factors act on the modulus, on the ratio of shear modulus to modulus, and on the stiffening at the largest strain.
Two more act on the shear under the full normal force, and on the stiffening at the largest shear. The last error is an
addition to the Ogden exponent.
"""

SHEAR_ERRORS = ("shear_modulus", "softening", "shear_curve")
"""Errors that together can imitate shear loads of a wrong size."""

BOARD_ERRORS = ("inductance", "target_change", "clock")
"""Errors common to all coils: logarithms of the free inductance, of the target's change, and of the clock."""


@record
class Unknown:
    """A possible error of a sensor.

    `unit` is ``1`` for a relative change, and `sigma` is one standard deviation. `is_fitted` is True if a calibration
    fits it. Other errors are part of simulated sensors and of the stated errors.
    """

    name: str
    unit: str
    sigma: float
    is_fitted: bool = True


@cache
def usual(name: str) -> float:
    """Return a value of `data/calibration.csv`. Raises KeyError for an unknown name."""
    return {row["name"]: float(row["value"]) for row in rows("calibration")}[name]


def unknowns(spec: SensorSpec, estimates: Estimates) -> tuple[Unknown, ...]:
    """Return all possible errors of a sensor, in the order of the columns of `units`.

    `estimates.tolerances.scatter` gives the standard deviations of manufacture. Others come from the pad's law and the
    model. Tilts include the difference of a pad's thickness between its ends, which is taken as large as between two
    pads. The coils of a board have most of their inductance's scatter in common, and metal behind them affects all.
    Raises NoResponse without a pad.
    """
    law, target = soft_pad(spec).sigma, spec.target
    assert target is not None
    sigma_of, (x, y) = sigmas(spec), target.size
    inductance = next((each.sigma for each in coil_scatter(estimates.coils)), usual("coil_inductance"))
    by_metal, of_signal = behind_scatter(estimates.coils)
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
        Unknown("pad_curve", "1", usual("pad_curve")),
        Unknown("softening", "1", law),
        Unknown("shear_curve", "1", usual("shear_curve")),
        Unknown("exponent", "1", usual("exponent"), False),
        Unknown("inductance", "1", math.hypot(inductance, by_metal)),
        Unknown("target_change", "1", math.hypot(CHANGE_SIGMA, of_signal)),
        Unknown("clock", "1", sigma_of[CLOCK], False),
    ]
    for coil in estimates.coils:
        listed.append(Unknown(f"capacitor.{coil.name}", "1", sigma_of[CAPACITOR]))
        listed.append(Unknown(f"inductance.{coil.name}", "1", usual("coil_inductance")))
    return tuple(each for each in listed if each.sigma > 0.0)


WIDEST = 2.0
"""Largest error of a simulated sensor, in standard deviations. A sensor beyond it is rejected, not calibrated."""

SURELY = 6.0
"""Standard deviations of manufacture beyond which unknowns and readings are refused as not of the design."""


def units(unknown_list: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Return errors (count, unknowns; m, rad, relative) of simulated sensors by a seed.

    They are normal, as in a fit, and limited to `WIDEST` standard deviations. Uniform distributions with the same
    standard deviation, as in studies, end at 1.7.
    """
    generator = np.random.default_rng(seed)
    normals = generator.normal(size=(count, len(unknown_list)))
    while np.any(beyond := np.abs(normals) > WIDEST):
        normals[beyond] = generator.normal(size=int(beyond.sum()))
    return np.asarray(normals * np.array([each.sigma for each in unknown_list]))


def stratified(unknown_list: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Return errors (count, unknowns; m, rad, relative) of manufactured sensors by a seed.

    Each unknown takes the middles of equally likely parts of a normal distribution (a Latin hypercube). They are not
    limited, because soft pads have a long tail.
    """
    generator, normal = np.random.default_rng(seed), NormalDist()
    middles = np.array([normal.inv_cdf((k + 0.5) / count) for k in range(count)])
    ranks = np.stack([generator.permutation(middles) for _ in unknown_list], axis=1)
    return np.asarray(ranks * np.array([each.sigma for each in unknown_list]))


def named(unknown_list: tuple[Unknown, ...], errors: Array) -> dict[str, float]:
    """Return errors of one sensor by name. Errors that the design cannot have are 0."""
    by_name = dict.fromkeys((*POSE_ERRORS, *PAD_ERRORS, *BOARD_ERRORS), 0.0)
    return by_name | {each.name: float(error) for each, error in zip(unknown_list, errors, strict=True)}
