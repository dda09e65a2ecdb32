"""What the model leaves of measured forces: a small correction of the map, where the points say that it serves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.maps.inverse_map import InverseMap, terms
from sitscad.calibration.maps.least_squares import ridge
from sitscad.physics.polynomials import monomials
from sitscad.record import record

Array = NDArray[np.float64]

WEIGHTS = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""How firmly a correction is held small: of its columns' mean square."""

DEGREES = (1, 2)
"""Degrees of corrections that are tried."""

SERVES, POINTS_A_TERM = 0.8, 3
"""A correction is taken where it leaves less than this of the errors, every point foretold by the others, and where
there are so many points for each of its terms."""


@record(eq=False)
class Correction:
    """The map with what was added to it, and the errors (n, axes; N) of every point as the others foretell it; `degree`
    is 0, and the map as it was, where none serves.
    """

    map: InverseMap
    degree: int
    before: Array
    after: Array


def correct(given: InverseMap, readings: Array, tare: Array, forces: Array) -> Correction:
    """The correction of a map by readings (n, coils) and forces (n, axes; N), the tare left out."""
    mixed = given.mixed(readings, tare)
    before = forces - given.forces_at(mixed)
    bottom = 1.0 + monomials(mixed, given.denominator_powers) @ given.denominator.T
    whole = terms(mixed, given.powers, given.knots, given.spline_powers)
    found = Correction(given, 0, before, before)
    for degree in DEGREES:
        chosen = np.flatnonzero(given.powers.sum(axis=1) <= degree)
        for weight in WEIGHTS if len(before) >= POINTS_A_TERM * len(chosen) else ():
            numerator, alone = given.numerator.copy(), np.empty_like(before)
            for k, scale in enumerate(given.full_scale):
                columns = whole[:, chosen] / bottom[:, k : k + 1]
                added, left = ridge(columns, before[:, k : k + 1] / scale, weight)
                numerator[k, chosen] += added[:, 0]
                alone[:, k] = left[:, 0] * scale
            share = np.linalg.norm(alone / given.full_scale) / np.linalg.norm(found.after / given.full_scale)
            if share < SERVES:
                found = Correction(replace(given, numerator=numerator), degree, before, alone)
    return found
