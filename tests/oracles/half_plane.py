"""Loss of a winding's turns in one half-plane alone, by as many modes as are asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.proximity import LossResolution, azimuth_cut, azimuth_system


def azimuth_loss(layers: Sequence[SpiralLayer], azimuth: float, sector: float, conductivity: float,
                 resolution: LossResolution) -> ProximityLoss:
    """Loss of the turns in the half-plane of an azimuth, which stands for a `sector` (rad) of every one."""
    cut = azimuth_cut(layers, azimuth, sector)
    if cut is None:
        return ProximityLoss(0.0, np.zeros(1), np.zeros(1))
    return azimuth_system(layers, azimuth, cut, conductivity, resolution.modes).loss(resolution.steps)
