"""A magnetic target at a pose: an endless sheet's effect times the share that a finite one has, as in the states.

Its poles are not solved as the currents of a conductor are; so errors are larger, and a tilted target counts, for every
coil, as a level one at the height that it has over the coil's centre.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.states.finite_target import equivalent_rings, shares_at
from sitscad.physics.metal.current_spectrum import CurrentSpectrum
from sitscad.physics.metal.finite_plate import CoaxialRings
from sitscad.physics.metal.half_spaces import Plate as Sheet
from sitscad.physics.metal.half_spaces import Reflector, reflected_inductances
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec, Target

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SHARED, ENDLESS = 8, 40
"""Heights, evenly spaced in their logarithm, at which shares and the effect of an endless sheet are worked out."""

TALLEST = 30.0
"""Highest of them over the lowest."""

TILTED = 0.5
"""What a tilt adds to the error, of the coil's radius times the tilt over the height."""


@record(eq=False)
class MagneticPlate:
    """A magnetic target over coils: `effects` (frequencies, heights, distances) in H are those of an endless sheet on
    the coils' own and mutual inductances; `error` and `tilted` are what is stated of the shares, relative.
    """

    frequencies: tuple[float, ...]
    target: Target
    rings: CoaxialRings
    centres: Array
    floor: float
    heights: Array
    effects: ComplexArray
    which: NDArray[np.intp]
    error: float
    is_over_a_poor_mirror: bool = False
    mirror_error: float = 0.0

    def changes(self, turns: Array, places: Array) -> tuple[ComplexArray, ComplexArray]:
        """See `Plate.changes`; what a lossy mirror loses more or less is left out of neither."""
        away = self.centres[None] - places[:, None, :2]
        normal = turns[:, :, 2]
        plane = places[:, None, 2] - np.einsum("nci,ni->nc", away, normal[:, :2]) / normal[:, 2:]
        height = np.clip(plane, self.heights[0], self.heights[-1])
        yaw = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])[:, None]
        x = np.cos(yaw) * away[..., 0] + np.sin(yaw) * away[..., 1]
        y = np.cos(yaw) * away[..., 1] - np.sin(yaw) * away[..., 0]
        share = self._shares(np.abs(np.stack([x, y], axis=-1)).reshape(-1, 2), height.ravel()).reshape(height.shape)
        both = np.sqrt(share[:, :, None] * share[:, None, :])
        middle = np.sqrt(height[:, :, None] * height[:, None, :])
        found = np.stack([self._endless(effect, middle) for effect in self.effects]) * both
        return found, found

    def errors(self, turns: Array, places: Array) -> Array:
        """Relative error (poses) of the changes, tilts included."""
        tilt = np.arccos(np.clip(turns[:, 2, 2], -1.0, 1.0))
        return np.asarray(self.error + TILTED * tilt * float(self.rings.radii.max()) / places[:, 2])

    def _endless(self, effect: ComplexArray, height: Array) -> ComplexArray:
        at, nodes = np.log(height), np.log(self.heights)
        found = np.empty(height.shape, dtype=complex)
        for i, j in np.ndindex(self.which.shape):
            values = effect[:, self.which[i, j]]
            found[:, i, j] = np.interp(at[:, i, j], nodes, values.real) + 1j * np.interp(
                at[:, i, j], nodes, values.imag
            )
        return found

    def _shares(self, places: Array, height: Array) -> Array:
        # Straight between heights in their logarithm.
        nodes = np.geomspace(self.heights[0], self.heights[-1], SHARED)
        known = np.stack([shares_at(self.target, self.rings, places, float(gap), self.floor)[0] for gap in nodes])
        part = np.interp(np.log(height), np.log(nodes), np.arange(SHARED, dtype=float))
        low = np.minimum(part.astype(np.intp), SHARED - 2)
        one, other = known[low, np.arange(low.size)], known[low + 1, np.arange(low.size)]
        return np.asarray(one + (part - low) * (other - one))


def magnetic_plate(
    spec: SensorSpec, layers: Array, frequencies: tuple[float, ...], behind: Reflector | None, lowest: float,
    spectrum: CurrentSpectrum,
) -> MagneticPlate:  # fmt: skip
    """The target for poses no lower than `lowest` (m); `layers` (m) are the mid-planes of the coils' copper, `spectrum`
    is that of a coil for metal as near.
    """
    target = spec.target
    assert target is not None
    centres = np.array([place.centre for place in spec.array.placements])
    apart = np.round(np.hypot(*(centres[:, None] - centres[None]).transpose(2, 0, 1)), 9)
    distances, which = np.unique(apart, return_inverse=True)
    metal = target.material
    sheet = (Sheet(metal.conductivity, metal.relative_permeability, target.thickness),)
    heights = np.geomspace(lowest, TALLEST * lowest, ENDLESS)
    at = np.array(frequencies)

    def reflected(above: Reflector | None) -> ComplexArray:
        return reflected_inductances(spectrum, at, above, behind, tuple(map(float, distances)))

    bare = reflected(None) if behind is not None else np.zeros((at.size, distances.size), dtype=complex)
    effects = np.stack([reflected(Reflector(float(height), sheet)) - bare for height in heights], axis=1)
    rings = equivalent_rings(spec.coil, list(layers))
    floor = -math.inf if behind is None else -behind.distance
    places = np.abs(centres - np.array(spec.array.middle))
    errors = [
        shares_at(target, rings, places, float(height), floor)[1] for height in (heights[0], heights[ENDLESS // 2])
    ]
    return MagneticPlate(frequencies, target, rings, centres, floor, heights, effects, which.reshape(apart.shape),
                         max(errors))  # fmt: skip
