"""What a target's change of the inductances can be off by: stated for every pose, and held by tests/validation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.plate import Detail, skin_depth
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

USUAL, THIN = 0.006, 0.0075
"""Relative error of a change: of a target of four skin depths and more, and of thinner ones, foils too. The laws of
edges and walls are right to 0.4 % (discs of finite elements; foils of copper, aluminium and brass to 0.2 %); the rest
is what they were not fitted to, and the resolution (0.15 % at most, tests/validation/random_poses.csv)."""

POOR = 0.1
"""What a poor conductor adds, of its skin depth over its shorter side (discs of steel and titanium: 0.8 % at most)."""

CLOSE, CLOSE_WIDTHS = 0.01, 1.5
"""What nearness adds: all of it at the copper, none from so many track widths on (a track is two filaments there)."""

WIDE, WIDE_FROM = 0.0002, 8.0
"""What a target adds for every length, beyond so many, over which the field at it varies."""

MUTUAL = 0.0008
"""Error of a mutual inductance's change, of the root of the product of both coils' own changes."""

LOSSY = 0.001
"""What a mirror adds that loses or returns part of the field, beside `Plate.mirror_error`."""


MAGNET = 0.02
"""What permeability adds, of the complex change's size: of magnetic steels the inductance's own change may pass zero
(discs of finite elements: 1.4 % at most)."""


def stated_errors(spec: SensorSpec, change: Array, size: Array, scale: float, lowest: Array, mapping: float,
                  mirror: float, frequency: float) -> Array:  # fmt: skip
    """Relative errors (poses, coils, coils) of changes (H), each of the larger of it and 1 % of `scale` (H).

    `size` (H) is that of the complex changes, loss included, `lowest` (m) the height of the target's lowest point in
    each pose, `mapping` what interpolation adds, `mirror` what the one behind the coils does, `frequency` (Hz) that of
    the changes.
    """
    target = spec.target
    assert target is not None
    depth = skin_depth(target, frequency)
    thin = float(np.interp(target.thickness / depth, [2.0, 4.0], [THIN, USUAL]))
    found = thin + mapping + mirror + POOR * min(depth, target.thickness) / min(target.size)
    near = np.clip(1.0 - lowest / (CLOSE_WIDTHS * spec.coil.trace_width), 0.0, 1.0)
    length = Detail(1.0, max(spec.coil.size)).length - 1.0 + np.maximum(lowest, 0.0)
    wide = WIDE * np.maximum(max(target.size) / length - WIDE_FROM, 0.0)
    relative = (found + CLOSE * near + wide)[:, None, None]
    own = np.sqrt(np.abs(np.einsum("pcc->pc", change)))
    shared = (MUTUAL + 0.3 * mirror) * own[:, :, None] * own[:, None, :]
    least = np.maximum(np.abs(change), 0.01 * scale)
    stated = np.maximum(relative, shared / least)
    diagonal = np.arange(change.shape[1])
    stated[:, diagonal, diagonal] = np.broadcast_to(relative[:, 0], stated.shape[:2])
    return np.asarray(stated + poles_error(spec) * size / least)


def poles_error(spec: SensorSpec) -> float:
    """What permeability adds, of the complex change's size: it rises from nothing, so weakly magnetic steels are what
    they nearly are.
    """
    return MAGNET * (1.0 - 1.0 / spec.target.material.relative_permeability) if spec.target is not None else 0.0
