"""What a target's change of the inductances can be off by: stated for every pose, and held by tests/validation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.plate import Detail, skin_depth
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

USUAL, THIN, FOIL = 0.006, 0.009, 0.013
"""Relative error of a change: of a target of four skin depths and more, of two, and of a foil. The laws of edges and
walls are right to 0.4 % (discs of finite elements); the rest is what they were not fitted to, and the resolution."""

POOR = 0.1
"""What a poor conductor adds, of its skin depth over its shorter side (discs of steel and titanium: 0.8 % at most)."""

CLOSE, CLOSE_WIDTHS = 0.01, 1.5
"""What nearness adds: all of it at the copper, none from so many track widths on (a track is two filaments there)."""

WIDE, WIDE_FROM = 0.001, 8.0
"""What a target adds for every length, beyond so many, over which the field at it varies."""

MUTUAL = 0.0008
"""Error of a mutual inductance's change, of the root of the product of both coils' own changes."""

LOSSY = 0.002
"""What a mirror adds that loses or returns part of the field, beside `Plate.mirror_error`."""


def stated_errors(spec: SensorSpec, change: Array, scale: float, lowest: Array, mapping: float, mirror: float,
                  frequency: float) -> Array:  # fmt: skip
    """Relative errors (poses, coils, coils) of changes (H), each of the larger of it and 1 % of `scale` (H).

    `lowest` (m) is the height of the target's lowest point in each pose, `mapping` what interpolation adds, `mirror`
    what the one behind the coils does, `frequency` (Hz) that of the changes.
    """
    target = spec.target
    assert target is not None
    depth = skin_depth(target, frequency)
    thin = float(np.interp(target.thickness / depth, [1.0, 2.0, 4.0], [FOIL, THIN, USUAL]))
    found = thin + mapping + mirror + POOR * min(depth, target.thickness) / min(target.size)
    near = np.clip(1.0 - lowest / (CLOSE_WIDTHS * spec.coil.trace_width), 0.0, 1.0)
    length = Detail(1.0, max(spec.coil.size)).length - 1.0 + np.maximum(lowest, 0.0)
    wide = WIDE * np.maximum(max(target.size) / length - WIDE_FROM, 0.0)
    relative = (found + CLOSE * near + wide)[:, None, None]
    own = np.sqrt(np.abs(np.einsum("pcc->pc", change)))
    shared = (MUTUAL + 0.3 * mirror) * own[:, :, None] * own[:, None, :]
    stated = np.maximum(relative, shared / np.maximum(np.abs(change), 0.01 * scale))
    diagonal = np.arange(change.shape[1])
    stated[:, diagonal, diagonal] = np.broadcast_to(relative[:, 0], stated.shape[:2])
    return np.asarray(stated)
