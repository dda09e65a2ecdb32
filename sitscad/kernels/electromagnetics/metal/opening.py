"""A rectangular opening through a conducting slab: the inductance that a coil before the slab has more for it.

The metal is a perfect conductor, the slab endless beside the opening. Unknown is the flux through both mouths of the
opening, even on panels. The magnetic potential that it makes before the slab (with its images where another mirror
stands there), in the opening (the cosines of a channel with walls of metal, which die away) and behind the slab goes on
through either mouth without a jump, save for one constant each: the current that runs round the opening. That current
lets no flux through in all (Bethe, Phys. Rev. 66, 1944, has the thin screen). Energies follow by reciprocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack

LEAST, MOST = 8, 28
"""Panels along a side of the opening, at least and at most."""

WAVES = 3
"""Waves of the channel along a side, for each panel along it."""

IMAGES = 4
"""Images of either mirror in the other that are looked at one by one."""


@record
class Opening:
    """An opening's size along x and y and its depth, the slab's thickness (m)."""

    size: tuple[float, float]
    depth: float


def gained_inductance(
    opening: Opening, tracks: Sequence[PolylineTrack], gap: float, room: float = math.inf, echo: float = 1.0
) -> float:
    """Inductance (H) that tracks in series have more for an opening in a slab below them, its middle at x = y = 0. The
    slab's face is at z = -`gap` (m); a mirror stands over it at a distance `room` (m), above the tracks: a perfect
    conductor with an `echo` of 1, a perfect magnet with one of -1. Derived here: see the module. The energy that the
    opening adds is mu0 times the flux through its mouth times the coil's potential there.
    """
    borders = [_borders(side, gap) for side in opening.size]
    middles = np.stack(np.meshgrid(*(0.5 * (b[1:] + b[:-1]) for b in borders), indexing="ij"), axis=-1).reshape(-1, 2)
    area = np.outer(*(np.diff(b) for b in borders)).ravel()
    corners = np.stack(np.meshgrid(*borders, indexing="ij"), axis=-1)
    x, y = np.moveaxis(corners[None] - middles[:, None, None], -1, 0)
    r = np.hypot(x, y)
    pull = x * np.log(y + r) + y * np.log(x + r)
    found = pull[:, 1:, 1:] - pull[:, :-1, 1:] - pull[:, 1:, :-1] + pull[:, :-1, :-1]
    outside = np.asarray(found.reshape(len(middles), -1) / (2.0 * math.pi))
    before = outside + _echo(middles, area, room, echo)
    # Mean potential (m) over the panels of a mouth by flux of 1 through those of it, and of the other mouth.
    waves, shapes = [], []
    for side, places in zip(opening.size, borders, strict=True):
        k = np.arange(WAVES * (len(places) - 1)) * math.pi / side
        ends = np.sinc(np.outer(k, places + 0.5 * side) / math.pi) * (places + 0.5 * side)
        shapes.append(np.diff(ends, axis=1) / np.diff(places) * np.sqrt((2.0 - (k[:, None] == 0.0)) / side))
        waves.append(k)
    decay = np.hypot(waves[0][:, None], waves[1]).ravel()[1:]
    shape = np.einsum("mi,nj->mnij", *shapes).reshape(decay.size + 1, -1)[1:]
    once = np.exp(-decay * opening.depth)
    own = (shape.T * ((1.0 + once**2) / (1.0 - once**2) / decay)) @ (shape * area)
    across = (shape.T * (2.0 * once / (1.0 - once**2) / decay)) @ (shape * area)
    driven = 2.0 * sum(_driven(track, middles, gap, room, echo) for track in tracks)
    n, closed = area.size, np.zeros((2, 2 * area.size))
    closed[0, :n], closed[1, n:] = area, area
    system = np.block([[before + own, -across], [-across, outside + own]])
    even = np.repeat(np.eye(2), n, axis=0)
    whole = np.block([[system, even], [closed, np.zeros((2, 2))]])
    flux = np.linalg.solve(whole, np.concatenate((driven, np.zeros(n + 2))))[:n]
    return float(MU0 * np.sum(area * flux * driven))


def _borders(side: float, gap: float) -> Array:
    """Borders (n; m) of panels along a side (m), about half as wide at its ends as in the middle."""
    count = min(LEAST + math.ceil(side / gap), MOST)
    t = np.arange(count + 1) / count
    return np.asarray(0.5 * side * (t - 0.5 - 0.5 * np.cos(math.pi * t)))


def _echo(middles: Array, area: Array, room: float, echo: float) -> Array:
    """Potential (panels, panels; m) that a mirror so far (m) before the plane adds to that of flux through the panels,
    but for a constant: the images' (textbook).
    """
    if math.isinf(room):
        return np.zeros((area.size, area.size))
    away = np.hypot(*np.moveaxis(middles[:, None] - middles, -1, 0))
    found = np.zeros_like(away)
    for n in range(1, IMAGES + 1):
        found += echo**n * (1.0 / np.hypot(away, 2.0 * n * room) - 0.5 / (n * room))
    return found * area / math.pi


def _driven(track: PolylineTrack, points: Array, gap: float, room: float, echo: float) -> Array:
    """Half the potential (points; A) that a track with 1 A makes on the face without an opening, its images in a mirror
    so far (m) over the face counted, but for a constant.
    """
    height = gap + track.z
    found = _potential(track.corners, points, height)
    if math.isfinite(room):
        for n in range(1, IMAGES + 1):
            near, far = (_potential(track.corners, points, 2.0 * n * room + way * height) for way in (-1.0, 1.0))
            found = found + echo**n * (far - near)
    return found


def _potential(corners: Array, points: Array, height: float) -> Array:
    """Magnetic potential (points; A) of a closed flat loop with 1 A so high (m) over points (n, 2; m): its solid angle
    over 4 pi (Jackson, Classical Electrodynamics, problem 5.1), side by side in closed form, derived here.
    """
    starts = corners[None] - points[:, None]
    along = np.roll(corners, -1, axis=0) - corners
    length = np.maximum(np.hypot(*along.T), 1e-12)
    x, y = along.T / length
    aside = starts[..., 1] * x - starts[..., 0] * y
    aside = np.where(np.abs(aside) < 1e-12, 1e-12, aside)
    first = starts[..., 0] * x + starts[..., 1] * y
    angle = np.zeros_like(aside)
    for sign, u in ((-1.0, first), (1.0, first + length)):
        r = np.sqrt(u * u + aside * aside + height * height)
        angle += sign * (np.arctan(u / aside) - np.arctan(height * u / (aside * r)))
    return np.asarray(-angle.sum(axis=1) / (4.0 * math.pi))
