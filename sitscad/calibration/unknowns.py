"""What one sensor of a design may be off by, and by how much as a rule: the scatter of manufacture."""

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
"""Those of where the target rests: what is added to its pose there. Both of the first raise it; only the gap is the
pad's thickness, too."""

PAD_ERRORS = ("modulus", "shear_modulus", "pad_curve", "softening", "shear_curve", "exponent")
"""Those of how far the pad gives: logarithms of its modulus, of that in shear over it, of how much more it has
stiffened at the largest strain, of how much more shear goes under the full normal force, and of how much more the pad
has stiffened at the largest shear; and what is added to its exponent (Ogden)."""

SHEAR_ERRORS = ("shear_modulus", "softening", "shear_curve")
"""Those that shear loads of a wrong size are taken for, together."""

BOARD_ERRORS = ("inductance", "target_change", "clock")
"""Those that all coils share: logarithms of the free inductance, of the target's change, of the clock."""


@record
class Unknown:
    """Something that a sensor may be off by: its name, its unit (``1``: a relative change), one standard deviation, and
    whether a calibration looks for it; the others are part of simulated sensors, and of the errors that are stated.
    """

    name: str
    unit: str
    sigma: float
    is_fitted: bool = True


@cache
def usual(name: str) -> float:
    """A figure of `data/calibration.csv`; raises KeyError where there is none of that name."""
    return {row["name"]: float(row["value"]) for row in rows("calibration")}[name]


def unknowns(spec: SensorSpec, estimates: Estimates) -> tuple[Unknown, ...]:
    """All that a sensor of a design may be off by, in the order of the rows that `units` gives. Sigmas of what
    manufacture scatters are those of `estimates.scatter`, others are of the pad's law and of the model. To tilts is
    added what one end of a pad may be thicker than the other, as much as two pads differ; the coils of one board have
    most of their inductance's scatter in common, and metal behind them moves all. Raises NoResponse without a pad.
    """
    law, target = soft_pad(spec).sigma, spec.target
    assert target is not None
    known, (x, y) = sigmas(spec), target.size
    inductance = next((one.sigma for one in coil_scatter(estimates.coils)), usual("coil_inductance"))
    by_metal, of_signal = behind_scatter(estimates.coils)
    found = [
        Unknown("gap", "m", known[PAD]),
        Unknown("glue", "m", known[GLUE]),
        Unknown("offset_x", "m", known[OFFSET_X]),
        Unknown("offset_y", "m", known[OFFSET_Y]),
        Unknown("tilt_x", "rad", math.hypot(known[TILT_X], known[PAD] / y)),
        Unknown("tilt_y", "rad", math.hypot(known[TILT_Y], known[PAD] / x)),
        Unknown("twist", "rad", known[YAW]),
        Unknown("modulus", "1", known[MODULUS]),
        Unknown("shear_modulus", "1", law),
        Unknown("pad_curve", "1", usual("pad_curve")),
        Unknown("softening", "1", law),
        Unknown("shear_curve", "1", usual("shear_curve")),
        Unknown("exponent", "1", usual("exponent"), False),
        Unknown("inductance", "1", math.hypot(inductance, by_metal)),
        Unknown("target_change", "1", math.hypot(CHANGE_SIGMA, of_signal)),
        Unknown("clock", "1", known[CLOCK], False),
    ]
    for coil in estimates.coils:
        found.append(Unknown(f"capacitor.{coil.name}", "1", known[CAPACITOR]))
        found.append(Unknown(f"inductance.{coil.name}", "1", usual("coil_inductance")))
    return tuple(one for one in found if one.sigma > 0.0)


WIDEST = 2.0
"""Standard deviations beyond which no simulated sensor lies: a sensor outside is sorted out, not calibrated."""

SURELY = 6.0
"""Standard deviations of manufacture beyond which no unknown, and no reading, is believed to be of a design."""


def units(known: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Errors (count, unknowns; m, rad, relative) of simulated sensors by a seed: normal, as a fit takes them, and cut
    off at `WIDEST` sigmas; bands of as large a sigma that are evenly filled, as studies draw them, end at 1.7 sigmas.
    """
    generator = np.random.default_rng(seed)
    drawn = generator.normal(size=(count, len(known)))
    while np.any(beyond := np.abs(drawn) > WIDEST):
        drawn[beyond] = generator.normal(size=int(beyond.sum()))
    return np.asarray(drawn * np.array([one.sigma for one in known]))


def stratified(known: tuple[Unknown, ...], count: int, seed: int) -> Array:
    """Errors (count, unknowns; m, rad, relative) of sensors as they are made by a seed: each unknown in the middles of
    equally likely parts of a normal distribution (a Latin hypercube), none cut off: soft pads have a long tail.
    """
    generator, normal = np.random.default_rng(seed), NormalDist()
    middles = np.array([normal.inv_cdf((k + 0.5) / count) for k in range(count)])
    drawn = np.stack([generator.permutation(middles) for _ in known], axis=1)
    return np.asarray(drawn * np.array([one.sigma for one in known]))


def named(known: tuple[Unknown, ...], errors: Array) -> dict[str, float]:
    """Errors of one sensor by their names; none of what cannot be off."""
    found = dict.fromkeys((*POSE_ERRORS, *PAD_ERRORS, *BOARD_ERRORS), 0.0)
    return found | {one.name: float(error) for one, error in zip(known, errors, strict=True)}
