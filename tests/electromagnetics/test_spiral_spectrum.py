"""The spectrum of round coils over metal that nearly touches them: worked out some waves at once, in little memory."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.metal import current_spectrum
from sitscad.kernels.electromagnetics.metal.current_spectrum import spiral_spectrum

UM, MM = 1e-6, 1e-3


def layers(radius, turns):
    return [
        SpiralLayer(radius, 200 * UM, turns, 0.3 * k, 1 - 2 * k, k == 0, -60 * UM * k, 100 * UM, 18 * UM)
        for k in (0, 1)
    ]


def test_spectrum_in_batches_equals_spectrum_at_once(monkeypatch):
    result = spiral_spectrum(layers(4 * MM, 9.25), 0.2 * MM)
    monkeypatch.setattr(current_spectrum, "AT_ONCE", 100_000_000)
    whole = spiral_spectrum(layers(4 * MM, 9.25), 0.2 * MM)
    assert np.abs(result.power - whole.power).max() < 1e-13 * np.abs(whole.power).max()


@pytest.mark.slow
def test_spectrum_of_thirty_turns_near_metal_takes_under_60_megabytes():
    """Of 16 mm, two layers, 25 um from it: all waves at all radii together took a third of a gigabyte."""
    tracemalloc.start()
    result = spiral_spectrum(layers(8 * MM, 30.0), 25 * UM)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert result.wave_numbers.size > 2000 and math.isfinite(float(result.power.max()))
    assert most < 60e6
