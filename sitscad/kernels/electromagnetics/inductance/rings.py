"""A spiral winding replaced by coaxial rings, one for each turn at its mean radius, and the rings' inductance.

Two coaxial rings have a mutual inductance by elliptic integrals (Maxwell 1873, art. 701).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings


def radii_at(layers: Sequence[SpiralLayer], azimuth: float) -> list[Array]:
    """Return the radii (m) at which each layer's centre line meets the half-plane of an azimuth (rad).

    The list has one array for each layer. The centre line is r = radius - pitch theta / (2 pi).
    """
    radii = []
    for layer in layers:
        first = (layer.sense * (azimuth - layer.angle)) % (2.0 * math.pi)
        theta = np.arange(first, layer.span, 2.0 * math.pi)
        radii.append(layer.radius - layer.pitch / (2.0 * math.pi) * theta)
    return radii


@record(eq=False)
class MeanRings:
    """One ring for every turn of spiral layers, at the turn's mean radius.

    Arrays (n): `radii` (m), `parts` (fraction of a turn that the ring represents; no unit), and layer numbers.
    """

    radii: Array
    parts: Array
    layer: Index


def mean_rings(layers: Sequence[SpiralLayer]) -> MeanRings:
    """Return one ring (radius in m) for every turn of spiral layers, layer by layer from the outside to the inside.

    The last ring of a layer can be a fraction of a turn. A ring's radius is the spiral's radius in the middle of the
    turn (derived here).
    """
    parts = [np.minimum(1.0, layer.turns - np.arange(math.ceil(layer.turns))) for layer in layers]
    radii = [layer.radius - layer.pitch * (np.arange(part.size) + 0.5 * part)
             for layer, part in zip(layers, parts, strict=True)]
    return MeanRings(np.concatenate(radii), np.concatenate(parts),
                     np.repeat(np.arange(len(layers)), [part.size for part in parts]))


def mean_ring_inductance(layers: Sequence[SpiralLayer]) -> float:
    """Return the inductance (H) of layers in series, with each turn replaced by a ring (Maxwell 1873, art. 701).

    Notes
    -----
    Derived here. The distance of two rings is a mean over azimuths, because the turns are spirals: the mean logarithm
    of their distance. In layers of equal sense, two turns lie side by side at one of two distances. In layers of
    opposite sense, two turns shift against each other by two pitches in a turn. Widths and thicknesses enter by their
    second moments. The distance of a track from itself is 0.2235 (w + t) (Grover 1946).
    """
    rings, first = mean_rings(layers), layers[0]
    z, sense, angle, circulation, thickness = np.array(
        [(layer.z, layer.sense, layer.angle, layer.circulation, layer.thickness) for layer in layers]).T[:, rings.layer]
    gap, height = rings.radii[:, None] - rings.radii, z[:, None] - z
    # same sense: ahead by a fraction of a pitch, and for the rest of the turn by that fraction less a pitch
    ahead = (sense * (angle[:, None] - angle) / (2.0 * math.pi)) % 1.0
    # <ln|z + xi|> is ln|z| - Re <xi^2> / (2 z^2) + ..., and <xi^2> of two rectangles twice (w^2 - t^2) / 12
    moment = (first.width**2 - thickness[:, None] * thickness) / 12.0
    diagonal = np.eye(gap.size // len(z), dtype=bool)
    logs = np.zeros_like(gap)
    for part, shift in ((1.0 - ahead, ahead), (ahead, np.where(ahead > 0.0, ahead - 1.0, 0.0))):
        place = gap + shift * first.pitch + 1j * height
        place[diagonal] = 1.0
        logs += part * (np.log(np.abs(place)) - (moment / place**2).real)
    crossing = sense[:, None] != sense
    logs[crossing] = _passing_mean_logarithm(gap[crossing], height[crossing],
                                             math.hypot(first.pitch, math.sqrt(0.5) * first.width))
    logs[diagonal] = np.log(0.2235 * (first.width + thickness))
    mutual = coaxial_rings(rings.radii[:, None], rings.radii, np.exp(2.0 * logs))
    amount = rings.parts * circulation
    return float(amount @ mutual @ amount)


def _passing_mean_logarithm(gap: Array, height: Array, reach: float) -> Array:
    """Return the mean of ln(distance / 1 m) (n; no unit) of tracks that pass each other at a height difference (n; m).

    The radial distance runs from `gap` - `reach` to `gap` + `reach` (m). The integral of ln sqrt(x^2 + z^2) over x has
    a closed form.
    """

    def integral(x: Array) -> Array:
        """Return the integral (m) of ln sqrt(x^2 + height^2) over x (m), by parts, up to a constant."""
        return 0.5 * x * np.log(x * x + height * height) - x + height * np.arctan(x / height)

    return np.asarray((integral(gap + reach) - integral(gap - reach)) / (2.0 * reach))
