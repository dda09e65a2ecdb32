"""Skin and proximity effect in windings of circular spirals.

The half-plane at an azimuth cuts every turn once, at the radius of the real spiral at this azimuth. So crossing layers
enter with their real distances, and the loss is averaged over azimuths. Eddy currents are driven by the flux of full
coaxial rings through these radii. A correction accounts for the places at which the real turns begin and end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations, pairwise

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.constants import MU0, skin_depth
from sitscad.kernels.electromagnetics.inductance.rings import radii_at
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.current_modes import ModeSystem, ProximityLoss, join_losses, mode_system
from sitscad.kernels.electromagnetics.loss.track_modes import (
    Cut,
    ModeSet,
    few_point_interpolation,
    few_point_modes,
    field_nodes,
    flux_to_points,
    gauss_point_positions,
    rough_modes,
    suited_modes,
)
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings, gauss

HIGHEST = 10e6
"""Frequency (Hz) up to which the tolerances of R hold. Sensors of the converters stay below it."""


@record
class LossResolution:
    """Resolution of a winding's loss.

    `modes` are the current modes of a track, `cuts` the number of half-planes round a turn, `steps` the largest number
    of Lanczos steps.
    """

    modes: ModeSet
    cuts: int
    steps: int


USUAL = 0.03
"""Default relative tolerance of R."""

ROUGH = 0.1
"""Relative tolerance of R at or above which a single half-plane and few modes are enough."""

ROUGH_STEPS = 5
"""Number of Lanczos steps for relative tolerances of R of at least `ROUGH`."""

LEAST_CUTS = 3
"""Smallest number of half-planes round a turn."""

MOST_CUTS = 40
"""Approximate largest number of half-planes round a turn."""

HARMONICS = np.arange(1, 80)
"""Orders of the harmonics, over the azimuth, of the interaction between crossing layers (see `crossing_error`)."""

UNSEEN = {False: 0.02, True: 0.005}
"""Largest error from too few half-planes, divided by the loss that alternating current adds.

The key is whether the tolerance of R is below 0.02. The error is estimated by `crossing_error`.
"""


def resolution_for(width: float, thickness: float, gap: float, tolerance: float, conductivity: float) -> LossResolution:
    """Return the resolution for a relative `tolerance` of R up to 10 MHz, with the smallest number of half-planes.

    Tolerances below 2e-2 give an error of 1e-2, others 3e-2. The track's `width` and `thickness` and the least distance
    `gap` of tracks are in metres, the conductivity in S/m.
    """
    fine = tolerance < 0.02
    modes = suited_modes(width, thickness, gap, skin_depth(HIGHEST, conductivity), fine)
    return LossResolution(modes, LEAST_CUTS, (24 if fine else 14) + modes.across // 2)


def winding_loss(layers: Sequence[SpiralLayer], conductivity: float, tolerance: float = USUAL,
                 resolution: LossResolution | None = None) -> ProximityLoss:
    """Return the resistance and inductance by frequency of spiral layers in series, with skin and proximity effect.

    Parameters
    ----------
    layers : sequence of SpiralLayer
        layers of the winding
    conductivity : float
        S/m
    tolerance : float
        relative error of R up to 10 MHz: 1e-2 if below 2e-2, else 3e-2. The relative error of L is ten times smaller.
    resolution : LossResolution, optional
        resolution to use; if left out, it follows from the tolerance

    Notes
    -----
    Partial elements of modes (Ruehli 1974; `current_modes`). The loss is averaged over azimuths.
    """
    layers = tuple(layers)
    resolution = resolution or suited_resolution(layers, conductivity, tolerance)
    return join_losses([cut.system.loss(resolution.steps) for cut in winding_cuts(layers, conductivity, resolution)])


@record(eq=False)
class WindingCut:
    """Turns of a winding in the half-plane of an azimuth.

    `cut` are their cross-sections (m), `system` the equations of their current modes, driven by the real winding.
    """

    cut: Cut
    system: ModeSystem


@lru_cache(maxsize=2)
def winding_cuts(
    layers: tuple[SpiralLayer, ...], conductivity: float, resolution: LossResolution
) -> tuple[WindingCut, ...]:
    """Return the half-planes that represent a winding. They are cached for all states. The conductivity is in S/m."""
    if resolution.cuts == 1:
        return (_mean_cut(layers, conductivity, resolution.modes),)
    planes = []
    for azimuth, sector in sectors(layers, resolution.cuts):
        cut = azimuth_cut(layers, azimuth, sector)
        if cut is not None:
            planes.append(WindingCut(cut, azimuth_system(layers, azimuth, cut, conductivity, resolution.modes)))
    return tuple(planes)


def _mean_cut(layers: tuple[SpiralLayer, ...], conductivity: float, modes: ModeSet) -> WindingCut:
    """Return one half-plane that represents a whole winding for screening.

    Each layer becomes a whole number of rings. If the turns are no whole number, the rings are slightly longer or
    shorter than turns, and their drive is changed in proportion. Turns of crossing layers are a quarter of a pitch
    apart, which gives the mean interaction. Ends of layers are neglected.
    """
    senses, angles = [layer.sense for layer in layers], [layer.angle for layer in layers]
    crossing = next((k for k, sense in enumerate(senses) if sense != senses[0]), None)
    azimuth = 0.5 * (angles[0] + angles[crossing or 0]) + 0.25 * math.pi
    radii, rows, parts = [], [], []
    for layer in layers:
        count = max(1, round(layer.turns))
        passed = 0.0 if crossing is None else (layer.sense * (azimuth - layer.angle) / (2.0 * math.pi)) % 1.0 - 0.5
        middle = layer.radius - 0.5 * layer.pitch * layer.turns
        radii.append(middle + layer.pitch * (0.5 * (count - 1) - np.arange(count) - passed))
        rows += [(layer.z, layer.width, layer.thickness)] * count
        parts += [layer.turns / count] * count
    across, part = np.concatenate(radii), np.array(parts)
    height, width, thickness = np.array(rows).T
    cut = Cut(across, height, width, thickness, 2.0 * math.pi * across * part, 1.0 / across)
    smooth = ring_flux(cut, modes) / (2.0 * math.pi * across[:, None])
    system = mode_system(cut, smooth, conductivity, modes)
    driven = np.repeat(part, len(modes.orders))
    return WindingCut(cut, replace(system, coupling=system.coupling * driven))


def sectors(layers: Sequence[SpiralLayer], cuts: int) -> list[tuple[float, float]]:
    """Return (azimuth of the middle, width) (rad) of about `cuts` sectors that together cover a turn.

    A layer begins or ends only at a limit between sectors.
    """
    ends = sorted({round((layer.angle + layer.sense * t) % (2.0 * math.pi), 6) for layer in layers
                   for t in (0.0, layer.span)})
    middles = []
    for low, high in pairwise([*ends, ends[0] + 2.0 * math.pi]):
        parts = max(1, math.ceil(cuts * (high - low) / (2.0 * math.pi) - 0.05))
        width = (high - low) / parts
        middles += [(low + (k + 0.5) * width, width) for k in range(parts) if width > 1e-4]
    return middles


def suited_resolution(layers: Sequence[SpiralLayer], conductivity: float, tolerance: float) -> LossResolution:
    """Return the resolution for a relative `tolerance` of R, with enough half-planes for layers that cross.

    The conductivity is in S/m.
    """
    first = layers[0]
    gap = least_gap(first.pitch - first.width, first.width, [layer.z for layer in layers])
    thickness = max(layer.thickness for layer in layers)
    if tolerance >= ROUGH:
        modes = rough_modes(first.width, thickness, gap, skin_depth(HIGHEST, conductivity))
        return LossResolution(modes, 1, ROUGH_STEPS)
    resolution = resolution_for(first.width, thickness, gap, tolerance, conductivity)
    most_missed, cuts = UNSEEN[tolerance < 0.02], resolution.cuts
    while cuts < MOST_CUTS and crossing_error(layers, cuts) > most_missed:
        cuts += 1
    return replace(resolution, cuts=cuts)


def crossing_error(layers: Sequence[SpiralLayer], cuts: int) -> float:
    """Estimate the error of `cuts` half-planes for crossing layers, divided by the loss that alternating current adds.

    Notes
    -----
    Layers of opposite sense shift against each other by one pitch in half a turn. Their interaction is a sum of even
    harmonics of the azimuth, and of odd harmonics for few turns. Harmonics decay like the field of a row of tracks,
    exp(-2 pi distance / period), slightly faster for wide tracks. With enough half-planes, every harmonic averages to
    zero. The constants are fitted to 60 coils with 3 to 9 half-planes (tests/validation/resistance_designs.py).
    """
    first = layers[0]
    apart = min((abs(a.z - b.z) for a, b in combinations(layers, 2) if a.sense != b.sense), default=math.inf)
    if math.isinf(apart):
        return 0.0
    azimuth, width = np.array(sectors(layers, cuts)).T
    spectrum = np.abs(np.exp(1j * np.outer(HARMONICS, azimuth)) @ width) / (2.0 * math.pi)
    clear = apart + 0.1 * first.width - 0.2 * max(layer.thickness for layer in layers)
    faded = np.exp(-math.pi * max(clear, 0.0) / first.pitch * HARMONICS)
    odd = 0.5 * min(1.0, 1.0 / max(layer.turns for layer in layers))
    missed = float(np.sum(spectrum * faded * np.where(HARMONICS % 2, odd, 1.0)))
    return MISSED * missed / (1.0 + missed / MISSED_MOST)


MISSED = 2.2
"""Slope of the error with respect to the amount m of missed harmonics: the error is MISSED m / (1 + m / MISSED_MOST).

The error is divided by the loss that alternating current adds. The amount is the weighted sum of harmonics in
`crossing_error`.
"""

MISSED_MOST = 0.3
"""Amount m of missed harmonics at which the error is half of its limit, MISSED times MISSED_MOST (see `MISSED`)."""


def least_gap(spacing: float, width: float, heights: Sequence[float]) -> float:
    """Return the least distance (m) between tracks, for the choice of the number of Gauss points on a track.

    It is the least height difference of two layers, or `spacing` plus a quarter of `width` if this is less. The rule
    was chosen here.
    """
    ordered = sorted(heights)
    return min([spacing + 0.25 * width, *(b - a for a, b in pairwise(ordered))])


def azimuth_cut(layers: Sequence[SpiralLayer], azimuth: float, sector: float) -> Cut | None:
    """Return the turns in the half-plane of an azimuth (rad), each representing a `sector` (rad).

    None if there are none.
    """
    radii = radii_at(layers, azimuth)
    owner = np.repeat(np.arange(len(layers)), [r.size for r in radii])
    if not owner.size:
        return None
    radius = np.concatenate(radii)
    height, width, thickness = np.array([(layer.z, layer.width, layer.thickness) for layer in layers]).T[:, owner]
    slope = layers[0].pitch / (2.0 * math.pi)
    return Cut(radius, height, width, thickness, np.hypot(radius, slope) * sector, 1.0 / radius)


def azimuth_system(layers: Sequence[SpiralLayer], azimuth: float, cut: Cut, conductivity: float,
                   modes: ModeSet) -> ModeSystem:
    """Return the equations of the current modes in the half-plane of an azimuth (rad), driven by the real winding.

    The conductivity is in S/m.
    """
    smooth = ring_flux(cut, modes) / (2.0 * math.pi * cut.across[:, None])
    smooth += _end_flux(layers, azimuth, cut, modes)
    return mode_system(cut, smooth, conductivity, modes)


def ring_flux(cut: Cut, modes: ModeSet) -> Array:
    """Return the flux per ampere (tracks, points; Wb/A) of filament rings through a circle at every Gauss point.

    It is Maxwell's mutual inductance of rings (1873, art. 701), minus the logarithm of straight tracks.
    """
    r, z = gauss_point_positions(cut, few_point_modes(modes))
    squared = (r[..., None] - cut.across) ** 2 + (z[..., None] - cut.height) ** 2
    tracks = np.arange(cut.across.size)
    squared[tracks, :, tracks] = 1.0
    mutual = ring_inductance_without_logarithm(r[..., None], cut.across, squared, cut.unit)
    mutual[tracks, :, tracks] = 0.0
    flux_of_others = mutual.sum(axis=2) @ few_point_interpolation(modes)
    # In its own track the kernel's remainder is averaged over the source's width.
    r, z = gauss_point_positions(cut, modes)
    nodes, share = gauss(modes.points[0])
    source = cut.across[:, None] + 0.5 * cut.width[:, None] * nodes
    pair = (r[:, :, None] - source[:, None, :]) ** 2 + (z - cut.height[:, None])[:, :, None] ** 2
    pair = np.maximum(pair, 1e-12 * cut.width[:, None, None] ** 2)
    self_part = ring_inductance_without_logarithm(r[:, :, None], source[:, None, :], pair, cut.unit)
    return np.asarray(flux_of_others + self_part @ (0.5 * share), dtype=np.float64)


def ring_inductance_without_logarithm(radius: Array, other: Array, squared: Array, unit: float) -> Array:
    """Return the mutual inductance (H) of coaxial rings minus its logarithmic term, which straight tracks also have.

    `radius` and `other` are the rings' radii (m), `squared` is their squared distance (m2), `unit` (m) the unit of
    length in the logarithm. For close rings M tends to mu0 sqrt(r1 r2) (ln(8 r / distance) - 2), the leading terms of
    Maxwell's integral (textbook).
    """
    return coaxial_rings(radius, other, squared) + MU0 * np.sqrt(radius * other) * 0.5 * np.log(squared / unit**2)


def _end_flux(layers: Sequence[SpiralLayer], azimuth: float, cut: Cut, modes: ModeSet) -> Array:
    """Return the flux (tracks, points; Wb/m/A) of the real layers minus the flux of full rings.

    Full rings represent a layer from half a turn before its first passage through the half-plane to half a turn after
    its last passage. The difference is an arc at either end of the layer (Biot and Savart).
    """
    radius = cut.across[:, None] + 0.5 * cut.width[:, None] * field_nodes(modes)
    field = np.zeros_like(radius)
    nodes, weights = gauss(16)
    for layer in layers:
        first = (layer.sense * (azimuth - layer.angle)) % (2.0 * math.pi)
        last = first + 2.0 * math.pi * math.floor((layer.span - first) / (2.0 * math.pi))
        ends = ((0.0, first - math.pi), (last + math.pi, layer.span)) if last >= first else ((0.0, layer.span),)
        clearance = (cut.height - layer.z) ** 2 + (0.2236 * (layer.width + layer.thickness)) ** 2
        for low, high in ends:
            # The far end of a missing arc may be near: points crowd there.
            crowd = 0.5 * (1.0 + nodes) if low == 0.0 else 0.5 * (1.0 - nodes)
            theta = low + (high - low) * np.where(low == 0.0, crowd**2, 1.0 - crowd**2)
            weight = (high - low) * weights * crowd
            source = layer.radius - layer.pitch / (2.0 * math.pi) * np.clip(theta, 0.0, layer.span)
            field += arc_field(radius, source, theta - first, weight, clearance[:, None])
    return flux_to_points(field * radius * cut.curvature[:, None], cut, modes)


def arc_field(radius: Array, source: Array, angle: Array, weight: Array, clearance: Array) -> Array:
    """Return the normal field (tracks, nodes; T/A) of a concentric arc at radii (tracks, nodes; m).

    The arc is given by quadrature points: radii `source` (m), azimuths `angle` relative to the half-plane (rad) and
    weights (rad). `clearance` (tracks, 1; m2) is added to the squared distances. Biot and Savart; Jackson, Classical
    Electrodynamics, section 5.2.
    """
    r = radius[..., None]
    squared = (r - source) ** 2 + 4.0 * r * source * np.sin(0.5 * angle) ** 2 + clearance[..., None]
    return np.asarray(
        MU0 / (4.0 * math.pi) * np.sum(weight * source * (source - r * np.cos(angle)) / squared**1.5, axis=-1)
    )
