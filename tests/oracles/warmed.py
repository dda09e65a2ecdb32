"""Counts of a sensor that is solved anew at another temperature, with a drift of its own."""

from __future__ import annotations

import numpy as np

from sitscad import Design
from sitscad.estimates.performance.warming import warm_poses


def warmed_counts(design, loads, celsius, lag=0.0, metal=1.0, expansion=1.0, modulus=1.0):
    """Return counts under loads (n, 3; N) at a temperature, and counts at rest at the temperature of the tare.

    The pad lags by `lag` (K). `metal`, `expansion` and `modulus` are the drifts of the unit over those of the design.
    """
    bench = design.sensing.solved.bench
    cold = design.spec.requirements.temperature
    poses = warm_poses(bench, loads, celsius - lag - cold, expansion, modulus)
    metal_celsius = cold + metal * (celsius - cold)
    response = Design(design.spec.replace("requirements.temperature", f"{metal_celsius} degC")).response
    conversion = design.estimates.readout.conversion
    return [np.rint(conversion.counts(each)).astype(int) for each in (response.on_pad(poses).frequency, bench.rest)]
