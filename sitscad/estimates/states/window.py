"""A window in the jaw's face: how much of what the jaw's metal does to a coil may be missing for it.

Metal that is taken away raises the inductance: it lies between that before the whole face and that before none. From
above it is bound by a trial field (Thomson's principle: of all fields with the coil's current the true one has least
energy): the field before the whole face, carried on through the window, where it dies away as the coil's own would.
That is at most twice what the window's part of the squared field along the face makes of the metal's whole effect.
A rim of metal round the window may keep all of the flux out that the whole face would, so nothing may be missing, too.
What is counted is the middle of the two, with half of the range as the width of its error. The loss of what the window
changes lies between none and the most that resistance takes of any currents, half of the reactance that they can shield
(a turn with R = omega L), which is far more than a whole face takes. Of magnetic metal the same is an estimate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.states.assembly import NoReflection, Reflection
from sitscad.estimates.states.finite_target import equivalent_rings
from sitscad.layout.board import Coil, Layout
from sitscad.physics.metal.finite_plate import CoaxialRings, field_share
from sitscad.scene.bodies import metal_face
from sitscad.scene.jaws import axis, fitted_jaw
from sitscad.spec.coil import CoilSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def missing_parts(layout: Layout, heights: Sequence[float]) -> Mapping[str, float]:
    """Half of what is missing at most (0 to 0.5) of the jaw's effect on each coil, by its name; empty without a window.
    `heights` (m) are those of the coil's layers.
    """
    jaw, face = fitted_jaw(layout), metal_face(layout.spec)
    if jaw is None or jaw.fenestration is None or face is None:
        return {}
    found = {}
    for coil in layout.coils:
        size, rings = _shortened(layout.spec.coil, jaw.fenestration, coil, heights)
        below = replace(rings, heights=-rings.heights)
        middle = axis(layout)
        offset = np.array([[coil.centre.x - middle.x, coil.centre.y - middle.y]])
        found[coil.name] = 0.5 * min(1.0, 2.0 * float(field_share(size, below, offset, -face)[0]))
    return found


def _shortened(
    spec: CoilSpec, window: tuple[float, float], coil: Coil, heights: Sequence[float]
) -> tuple[tuple[float, float], CoaxialRings]:
    """Window (m) and rings that stand for an elongated coil: one as long as it is wide, the window shorter by as much,
    or in proportion where it is the shorter one.
    """
    long, short = max(spec.size), min(spec.size)
    if long - short < 1e-9:
        return window, equivalent_rings(spec, heights)
    side = (int(spec.size[1] > spec.size[0]) + round(2.0 * coil.placement.rotation / math.pi)) % 2
    size = list(window)
    size[side] = size[side] - (long - short) if size[side] > long else size[side] * short / long
    return (size[0], size[1]), equivalent_rings(replace(spec, size=(short, short)), heights)


class WindowedReflection(Reflection):
    """What metal returns where the jaw has a window: between `whole`, before all of its face, and `none` of it."""

    def __init__(self, whole: Reflection, none: Reflection | NoReflection, part: float) -> None:
        self._whole, self._none, self._missing = whole, none, part

    def __call__(self, frequencies: Array) -> tuple[Array, Array]:
        """Change of inductance (H) and resistance (ohm) at (n,) frequencies (Hz)."""
        whole, none = self._whole(frequencies), self._none(frequencies)
        mixed = [one + self._missing * (other - one) for one, other in zip(whole, none, strict=True)]
        return mixed[0], mixed[1]

    def mutual(self, pair: tuple[int, int], distance: float, frequencies: Array) -> ComplexArray:
        """Change of the mutual inductance (H, complex) of a pair of coils at one of the distances (m)."""
        whole = self._whole.mutual(pair, distance, frequencies)
        return np.asarray(whole + self._missing * (self._none.mutual(pair, distance, frequencies) - whole))

    def crowding(self, frequencies: Array) -> ComplexArray:
        """What of it (H, complex) the winding's own eddy currents make, which see their images, too."""
        whole = self._whole.crowding(frequencies)
        return np.asarray(whole + self._missing * (self._none.crowding(frequencies) - whole))

    def shares(self, frequencies: Array) -> ComplexArray:
        """How much of an endless target's effect the real one has at (n,) frequencies (Hz)."""
        return self._whole.shares(frequencies)

    def factors(self, frequency: float) -> tuple[complex, complex]:
        """The same for small changes of what is around: of all that is reflected, and of the target's own loss."""
        return self._whole.factors(frequency)

    def target_change(self, frequency: float) -> complex:
        """What the target alone changes of the winding's inductance (H, complex), its current even."""
        return self._whole.target_change(frequency)

    def endless_change(self, frequency: float) -> complex:
        """What an endless target would change of it (H, complex)."""
        return self._whole.endless_change(frequency)

    def unsure(self, frequency: float) -> tuple[float, float]:
        """How far off the target's change of inductance (H) and its loss (ohm) may be at most, both one way."""
        return self._whole.unsure(frequency)

    def window(self, frequency: float) -> tuple[float, float]:
        """How far off inductance (H) and resistance (ohm) may be for the window, at most, both one way."""
        at, omega = np.array([frequency]), 2.0 * math.pi * frequency
        whole, none = self._whole(at), self._none(at)
        change, loss = float(none[0][0] - whole[0][0]), float(none[1][0] - whole[1][0])
        shielded = math.hypot(change, loss / omega)
        lossy = max(abs(loss), omega * shielded - abs(loss))
        return math.copysign(self._missing * shielded, change), -self._missing * lossy
