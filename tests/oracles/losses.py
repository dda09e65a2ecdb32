"""What a winding's loss says at one frequency."""

from __future__ import annotations

import numpy as np

from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss


def inductance_change(loss: ProximityLoss, frequency: float) -> float:
    """L(f) less the inductance of evenly spread current (H) at one frequency (Hz)."""
    return float(loss.inductance_changes(np.array([frequency]))[0])
