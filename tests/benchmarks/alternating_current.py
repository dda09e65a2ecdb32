"""The alternating-current solvers on windings of every shape: R and L from 10 kHz to 10 MHz.

The error is against the same solver's finest setting, which tests/validation holds against filaments (rings within
0.6 %); L's is relative to the inductance at direct current.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from measure import Growth, Measured, growth, peak, timed
from windings import MM, UM, bench, coil, four_layers, miniature

from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.inductance.spirals import spiral_inductance_matrix
from sitscad.kernels.electromagnetics.loss import proximity
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack, bent_winding_loss
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from tests.oracles.filament_tracks import track_mutual_inductance
from tests.oracles.losses import inductance_change

COPPER = 58e6
FREQUENCIES = (1e4, 1e5, 1e6, 3e6, 10e6)

ROUND = {
    "7 mm 2 x 12": bench(),
    "4 mm 4 x 7.75": four_layers(),
    "3.5 mm 2 x 6.5": miniature(),
    "5 mm 4 x 12": coil(5 * MM, 12, 75 * UM, 75 * UM, [-62 * k * UM for k in range(4)], [12 * UM] * 4),
    "6 mm 8 x 10": coil(6 * MM, 10, 100 * UM, 100 * UM, [-60 * k * UM for k in range(8)], [18 * UM] * 8),
    "40 mm 2 x 9, 0.9 mm": coil(40 * MM, 9, 900 * UM, 150 * UM, (0.0, -570 * UM), (30 * UM, 30 * UM)),
    "6 mm 2 x 1.5": coil(6 * MM, 1.5, 200 * UM, 100 * UM, (0.0, -60 * UM), (35 * UM, 35 * UM)),
}


def square(turns: int, diameter: float, width: float, pitch: float, heights: list[float]) -> list[BentTrack]:
    """Square layers, mirrored in turn."""
    half = 0.5 * (diameter - width)
    points = [(-half, -half)]
    for m in range(4 * turns):
        a, b = half - pitch * (m // 4), half - pitch * ((m + 1) // 4)
        points.append([(a, -a), (a, a), (-a, a), (-a, -b)][m % 4])
    corners, tracks = np.array(points), []
    for k, z in enumerate(heights):
        path = corners if k % 2 == 0 else (corners * np.array([1.0, -1.0]))[::-1]
        tracks.append(BentTrack(path[:-1], path[1:], np.zeros(len(path) - 1), width, 18 * UM, z))
    return tracks


BENT = {
    "square 4 mm 4 x 8": square(8, 4 * MM, 80 * UM, 160 * UM, [0.0, -49 * UM, -127 * UM, -176 * UM]),
    "square 3 mm 1 x 5": square(5, 3 * MM, 100 * UM, 200 * UM, [0.0]),
}


BOUNDS = {"3 %": (0.03, 0.003), "1 %": (0.01, 0.001)}
"""Stated errors of R and L."""

RESISTANCE, INDUCTANCE = "resistance at frequency", "inductance at frequency"


def round_settings(layers) -> dict[str, Callable[[], ProximityLoss]]:
    """Both tolerances and, last, the finest setting."""
    wide = layers[0].width > 500 * UM
    finest = proximity.LossResolution(ModeSet(24 if wide else 9, 3, (30 if wide else 10, 3)), 13, 40)
    return {
        "3 %": partial(_cold, layers, 0.03),
        "1 %": partial(_cold, layers, 0.01),
        "finest": partial(proximity.winding_loss, layers, COPPER, resolution=finest),
    }


def _cold(layers, tolerance: float) -> ProximityLoss:
    # The cuts of a winding are kept for its states: here every run makes them anew.
    proximity.winding_cuts.cache_clear()
    return proximity.winding_loss(layers, COPPER, tolerance)


def bent_settings(tracks: list[BentTrack]) -> dict[str, Callable[[], ProximityLoss]]:
    """The same for straight sides."""
    return {
        "3 %": partial(bent_winding_loss, tracks, COPPER, ModeSet(4, 1, (4, 2)), 4, 16, repetitions=2),
        "1 %": partial(bent_winding_loss, tracks, COPPER, ModeSet(6, 2, (6, 3)), 8, 27),
        "finest": partial(bent_winding_loss, tracks, COPPER, ModeSet(9, 3, (10, 3)), 12, 40),
    }


def solvers(designs: int) -> Iterator[tuple[str, float, dict[str, Callable[[], ProximityLoss]]]]:
    """Design, its direct inductance (H), its settings."""
    for name, layers in list(ROUND.items())[:designs]:
        yield name, float(spiral_inductance_matrix(layers).sum()), round_settings(layers)
    for name, tracks in list(BENT.items())[:designs]:
        lines = [PolylineTrack(np.vstack([t.starts, t.ends[-1:]]), t.width, t.thickness, t.z) for t in tracks]
        yield name, sum(track_mutual_inductance(a, b) for a in lines for b in lines), bent_settings(tracks)


def measured(designs: int = 99) -> Iterator[Measured]:
    """R and L of every design with both settings; `designs` of each kind at most."""
    for name, direct, settings in solvers(designs):
        exact = settings.pop("finest")()
        for setting, solve in settings.items():
            loss, cost = solve(), (*timed(solve), peak(solve))
            of_r = max(abs(loss.resistance_ratio(f) / exact.resistance_ratio(f) - 1.0) for f in FREQUENCIES)
            of_l = max(abs(inductance_change(loss, f) - inductance_change(exact, f)) for f in FREQUENCIES)
            kind = "modes, spirals" if name in ROUND else "modes, sides"
            yield Measured(RESISTANCE, f"{kind}, {setting}", name, *cost, of_r, BOUNDS[setting][0])
            yield Measured(INDUCTANCE, f"{kind}, {setting}", name, *cost, of_l / direct, BOUNDS[setting][1])


def grown(turns: tuple[int, ...] = (12, 25, 50, 100), layers: tuple[int, ...] = (1, 2, 4, 8)) -> Iterator[Growth]:
    """How the usual tolerance grows."""
    for what, settings, make in (("modes, spirals, 3 %", round_settings, _round), ("modes, sides, 3 %", bent_settings,
                                                                                   _square)):
        yield growth(what, "turns", [(n, settings(make(n, 2))["3 %"]) for n in turns])
        yield growth(what, "layers", [(n, settings(make(12, n))["3 %"]) for n in layers])


def _round(turns: int, layers: int):
    return coil((2 + 0.4 * turns) * MM, turns, 100 * UM, 80 * UM, [-60 * k * UM for k in range(layers)],
                [18 * UM] * layers)


def _square(turns: int, layers: int) -> list[BentTrack]:
    return square(turns, (2 + 0.4 * turns) * MM, 100 * UM, 180 * UM, [-60 * k * UM for k in range(layers)])
