"""What a bench would write down of a simulated sensor: readings at known loads, with the errors of both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.points import Points
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual_value

Array = NDArray[np.float64]


def simulated(
    sensors: Sensors, errors: Array, loads: Array, generator: np.random.Generator, hysteresis: float = 0.0
) -> Points:
    """What a bench would write down of one sensor: rest first, then the loads (n, 3; N; zeros are tares), each off by
    as much as loads usually are, read with the converter's noise. `hysteresis` (of full scale, from one way to the
    other) puts every load somewhere between, on every axis.
    """
    given = np.vstack([np.zeros((1, 3)), loads])
    scale = np.zeros(3)
    scale[sensors.range.columns] = sensors.range.full_scales
    size = np.linalg.norm(given / np.where(scale > 0.0, scale, np.inf), axis=1)
    off = generator.normal(size=given.shape) * (usual_value("force") * size)[:, None] * scale
    off[1:] += hysteresis * scale * generator.uniform(-0.5, 0.5, size=off[1:].shape) * (size[1:, None] > 0.0)
    off[:, 0] = np.maximum(off[:, 0], -given[:, 0])
    frequency = sensors.noisy_frequencies(sensors.frequencies_under(errors, given + off, exact=True), generator)
    return Points(given, None, frequency, size == 0.0)
