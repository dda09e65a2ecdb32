"""What a target's change of the inductances can be off by: stated for every pose, and held by tests/validation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

USUAL = 0.004
"""Relative error of a change by a good conductor that is not near: surfaces of two finenesses, finite elements."""

CLOSE, CLOSE_WIDTHS = 0.003, 1.5
"""What nearness adds: all of it at the copper, none from so many track widths on (tracks are two filaments wide)."""


def stated_errors(spec: SensorSpec, change: Array, scale: float, lowest: Array, mapping: float) -> Array:
    """Relative errors (poses, coils, coils) of changes (H), each of the larger of it and 1 % of `scale` (H).

    `lowest` (m) is the height of the target's lowest point in each pose, `mapping` what interpolation adds.
    """
    near = np.clip(1.0 - lowest / (CLOSE_WIDTHS * (spec.coil.trace_width + 30e-6)), 0.0, 1.0)
    found = USUAL + CLOSE * near + mapping
    return np.asarray(np.broadcast_to(found[:, None, None], change.shape), dtype=float)
