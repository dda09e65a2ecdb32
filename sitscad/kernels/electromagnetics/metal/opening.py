"""Rectangular opening through a conducting slab, and the inductance that a coil in front of the slab gains from it.

Notes
-----
The metal is a perfect conductor, and the slab is infinite beside the opening. The unknown is the flux through both
mouths of the opening, constant on each panel. It causes a magnetic potential in three regions: in front of the slab
(with images if another mirror is in front), in the opening, and behind the slab. In the opening the potential is a sum
of cosines of a channel with metal walls, which decay with depth.

Through each mouth, the potential is continuous up to a constant: the current that flows around the opening. Because of
this current, the total flux through each mouth is zero (Bethe, Phys. Rev. 66, 1944, treats the thin screen). Energies
follow by reciprocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack

LEAST = 8
"""Smallest number of panels along a side of the opening."""

MOST = 28
"""Largest number of panels along a side of the opening."""

WAVES = 3
"""Number of cosine waves in the opening along a side, divided by the number of panels along this side."""

IMAGES = 4
"""Number of repeated reflections between slab and mirror whose images are summed one by one."""


@record
class Opening:
    """Rectangular opening in a slab: `size` is its length along x and y (m), `depth` (m) is the slab's thickness."""

    size: tuple[float, float]
    depth: float


def gained_inductance(
    opening: Opening, tracks: Sequence[PolylineTrack], gap: float, room: float = math.inf, echo: float = 1.0
) -> float:
    """Return the inductance (H) that tracks in series gain from an opening in a slab below them.

    Parameters
    ----------
    opening : Opening
        opening centred on x = y = 0
    tracks : sequence of PolylineTrack
        layers of the coil
    gap : float
        distance of the slab's face below z = 0 (m)
    room : float, optional
        distance of a mirror above the slab's face, beyond the tracks (m); inf if there is none
    echo : float, optional
        1 if the mirror is a perfect conductor, -1 if it is a perfect magnet

    Notes
    -----
    Derived here: see the module. The energy that the opening adds is mu0 times the flux through its mouth times the
    potential of the coil in the mouth.
    """
    borders = [_panel_borders(side, gap) for side in opening.size]
    middles = np.stack(np.meshgrid(*(0.5 * (b[1:] + b[:-1]) for b in borders), indexing="ij"), axis=-1).reshape(-1, 2)
    area = np.outer(*(np.diff(b) for b in borders)).ravel()
    corners = np.stack(np.meshgrid(*borders, indexing="ij"), axis=-1)
    x, y = np.moveaxis(corners[None] - middles[:, None, None], -1, 0)
    r = np.hypot(x, y)
    pull = x * np.log(y + r) + y * np.log(x + r)
    potentials = pull[:, 1:, 1:] - pull[:, :-1, 1:] - pull[:, 1:, :-1] + pull[:, :-1, :-1]
    outside = np.asarray(potentials.reshape(len(middles), -1) / (2.0 * math.pi))
    before = outside + _image_potential(middles, area, room, echo)
    # mean potential (m) over the panels of a mouth by unit flux through its own panels, and through the other mouth's
    waves, shapes = [], []
    for side, places in zip(opening.size, borders, strict=True):
        k = np.arange(WAVES * (len(places) - 1)) * math.pi / side
        ends = np.sinc(np.outer(k, places + 0.5 * side) / math.pi) * (places + 0.5 * side)
        shapes.append(np.diff(ends, axis=1) / np.diff(places) * np.sqrt((2.0 - (k[:, None] == 0.0)) / side))
        waves.append(k)
    decay = np.hypot(waves[0][:, None], waves[1]).ravel()[1:]
    shape = np.einsum("mi,nj->mnij", *shapes).reshape(decay.size + 1, -1)[1:]
    decayed = np.exp(-decay * opening.depth)
    direct = (shape.T * ((1.0 + decayed**2) / (1.0 - decayed**2) / decay)) @ (shape * area)
    across = (shape.T * (2.0 * decayed / (1.0 - decayed**2) / decay)) @ (shape * area)
    driven = 2.0 * sum(_track_potential(track, middles, gap, room, echo) for track in tracks)
    n, closed = area.size, np.zeros((2, 2 * area.size))
    closed[0, :n], closed[1, n:] = area, area
    system = np.block([[before + direct, -across], [-across, outside + direct]])
    even = np.repeat(np.eye(2), n, axis=0)
    whole = np.block([[system, even], [closed, np.zeros((2, 2))]])
    flux = np.linalg.solve(whole, np.concatenate((driven, np.zeros(n + 2))))[:n]
    return float(MU0 * np.sum(area * flux * driven))


def _panel_borders(side: float, gap: float) -> Array:
    """Return the borders (n; m) of panels along a side (m). Panels at its ends are half as wide as in its middle.

    The number of panels grows with the side divided by `gap` (m).
    """
    count = min(LEAST + math.ceil(side / gap), MOST)
    t = np.arange(count + 1) / count
    return np.asarray(0.5 * side * (t - 0.5 - 0.5 * np.cos(math.pi * t)))


def _image_potential(middles: Array, area: Array, room: float, echo: float) -> Array:
    """Return the potential (panels, panels; m) that a mirror adds on each panel, per flux density through each panel.

    `middles` (panels, 2; m) and `area` (panels; m2) are the panels. The mirror is `room` (m) in front of the plane;
    `echo` is its sign. The sum over images (textbook) is up to a constant.
    """
    if math.isinf(room):
        return np.zeros((area.size, area.size))
    distance = np.hypot(*np.moveaxis(middles[:, None] - middles, -1, 0))
    total = np.zeros_like(distance)
    for n in range(1, IMAGES + 1):
        total += echo**n * (1.0 / np.hypot(distance, 2.0 * n * room) - 0.5 / (n * room))
    return total * area / math.pi


def _track_potential(track: PolylineTrack, points: Array, gap: float, room: float, echo: float) -> Array:
    """Return half the magnetic potential (points; A) of a track with 1 A on the slab's face without an opening.

    It includes images in a mirror `room` (m) above the face, with the sign `echo`, and is up to a constant.
    """
    height = gap + track.z
    potential = _loop_potential(track.corners, points, height)
    if math.isfinite(room):
        for n in range(1, IMAGES + 1):
            before, behind = (_loop_potential(track.corners, points, 2.0 * n * room + way * height)
                              for way in (-1.0, 1.0))
            potential = potential + echo**n * (behind - before)
    return potential


def _loop_potential(corners: Array, points: Array, height: float) -> Array:
    """Return the magnetic potential (points; A) of a closed flat loop with 1 A at a height over points (n, 2; m).

    `height` is in m. The potential is the solid angle divided by 4 pi (Jackson, Classical Electrodynamics, problem
    5.1). Each side has a closed form, derived here.
    """
    starts = corners[None] - points[:, None]
    sides = np.roll(corners, -1, axis=0) - corners
    length = np.maximum(np.hypot(*sides.T), 1e-12)
    x, y = sides.T / length
    lateral = starts[..., 1] * x - starts[..., 0] * y
    lateral = np.where(np.abs(lateral) < 1e-12, 1e-12, lateral)
    first = starts[..., 0] * x + starts[..., 1] * y
    angle = np.zeros_like(lateral)
    for sign, u in ((-1.0, first), (1.0, first + length)):
        r = np.sqrt(u * u + lateral * lateral + height * height)
        angle += sign * (np.arctan(u / lateral) - np.arctan(height * u / (lateral * r)))
    return np.asarray(-angle.sum(axis=1) / (4.0 * math.pi))
