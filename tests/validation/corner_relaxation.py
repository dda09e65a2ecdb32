"""The tables RELAXATION and THICKER of physics/corner_excess.py: what alternating current does at one bend beyond what
the modes of its sides and arc say.

    python tests/validation/corner_relaxation.py [--aspect 0.04] [--thicker]

One bend between arms of five widths by triangles (`stream_sheet`) less our own L and R, from which the same difference
of a straight track of as much length is taken: what both say unlike of the ends is in it. Frequencies are in
s = mu0 times conductivity, width, thickness and angular frequency. The difference is fitted with one relaxation,
L = -a s2 / (s2 + p2) and R / omega = a s p / (s2 + p2), both in mu0 widths.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "electromagnetics"), str(HERE)]

from corner_windings import COPPER, RATE, bent, rounded_path  # noqa: E402
from stream_sheet import sheet, solved  # noqa: E402

from sitscad.estimates.windings.losses import winding_losses  # noqa: E402
from sitscad.kernels.electromagnetics.constants import MU0  # noqa: E402
from sitscad.kernels.electromagnetics.loss import track_modes  # noqa: E402
from sitscad.kernels.electromagnetics.loss.bent_tracks import bent_winding_loss  # noqa: E402
from sitscad.kernels.electromagnetics.loss.corner_excess import bend_relaxation  # noqa: E402
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet  # noqa: E402

WIDTH, ARM, CELLS = 300e-6, 5.0, (5, 8)
REDUCED = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
"""The frequencies, as s."""

PLACES = 5
"""Places across a track at which the field of distant sides is taken here. A coil's estimate takes FIELD_POINTS, which
are fewer: beside a bend the field is not as smooth as that, and what it leaves out is no matter of the relaxation."""

WEIGHT = 0.7
"""What a difference of R / omega counts for against one of L; below s = 2 it is the error of direct current."""


def frequencies(aspect: float) -> np.ndarray:
    """The frequencies (Hz) of REDUCED, for copper of a thickness over width."""
    return REDUCED / (MU0 * COPPER * WIDTH**2 * aspect * 2.0 * math.pi)


@contextmanager
def places_across(count: int) -> Iterator[None]:
    """As many places across a track for the field of distant sides, for a while."""
    usual, track_modes.FIELD_POINTS = track_modes.FIELD_POINTS, count
    track_modes._integrals.cache_clear()
    try:
        yield
    finally:
        track_modes.FIELD_POINTS = usual
        track_modes._integrals.cache_clear()


def difference(degrees: float, radius: float, aspect: float, places: int = PLACES) -> tuple[np.ndarray, np.ndarray]:
    """Triangles less our L and R / omega (mu0 widths) of a bend; L without that of direct current."""
    f, count = frequencies(aspect), len(REDUCED)
    with places_across(places):
        ours = _ours(degrees, radius, aspect) if degrees else _straight(aspect)
    result = _triangles(degrees, radius, aspect)
    inductance = result[3 : 3 + count] - result[1] - (ours.inductance_changes(f) - ours.direct_change)
    resistance = (result[3 + count :] - ours.direct * ours.resistance_ratios(f)) / (2.0 * math.pi * f)
    straight = difference(0.0, 0.0, aspect, places) if degrees else (0.0, 0.0)
    return inductance / (MU0 * WIDTH) - straight[0], resistance / (MU0 * WIDTH) - straight[1]


def beyond_modes(degrees: float, radius: float, aspect: float) -> tuple[float, float, float]:
    """The row of the table: a, p and the largest difference left. What the tables say now is taken out of ours."""
    inductance, resistance = difference(degrees, radius, aspect)
    lost, time = bend_relaxation(math.radians(degrees), WIDTH, aspect * WIDTH, radius, COPPER)
    phase = 2.0 * math.pi * frequencies(aspect) * time
    message = lost / (MU0 * WIDTH) * phase / (1.0 + phase**2)
    return fitted(inductance - message * phase, resistance + message)


def fitted(inductance: np.ndarray, resistance: np.ndarray) -> tuple[float, float, float]:
    """The relaxation a (mu0 widths) and p of such differences, and the largest difference that is left."""

    def left(guess):
        a, p = guess
        lag = a / (REDUCED**2 + p**2)
        of_resistance = WEIGHT * (lag * REDUCED * p - resistance)[2:]
        return np.concatenate([-lag * REDUCED**2 - inductance, of_resistance])

    result = least_squares(left, [-inductance[-1], 18.0], bounds=([-0.1, 2.0], [0.1, 120.0]))
    return float(result.x[0]), float(result.x[1]), float(np.max(np.abs(result.fun)))


def _line(degrees: float) -> np.ndarray:
    turn = math.radians(degrees)
    middle = [(0.0, 0.0)] if degrees else []
    return WIDTH * ARM * np.array([(-1.0, 0.0), *middle, (math.cos(turn), math.sin(turn))])


@lru_cache
def _triangles(degrees: float, radius: float, aspect: float) -> np.ndarray:
    f, rows = frequencies(aspect), []
    for cells in CELLS:
        track = sheet(_line(degrees), WIDTH, aspect * WIDTH, cells, cells, radius=radius * WIDTH)
        result = solved([track], COPPER, f)
        of_inductance = result.impedances.imag / (2.0 * math.pi * f)
        rows.append(np.array([result.even, result.direct, result.resistance, *of_inductance, *result.impedances.real]))
    return rows[1] + (rows[1] - rows[0]) / ((CELLS[1] / CELLS[0]) ** RATE - 1.0)


def _ours(degrees: float, radius: float, aspect: float):
    path = rounded_path(_line(degrees), max(radius, 1e-6) * WIDTH)
    coil = SimpleNamespace(windings=[SimpleNamespace(path=path, thickness=aspect * WIDTH, z=0.0)])
    spec = SimpleNamespace(trace_spacing=1e-3, trace_width=WIDTH, layer_turns=(1,), size=(8.0 * WIDTH, 8.0 * WIDTH),
                           pitch=2.0 * WIDTH, turns=1, most_turns=1, shape="hexagon")
    return winding_losses(spec, coil, (), COPPER, 1e-3)


def _straight(aspect: float):
    return bent_winding_loss([bent(_line(0.0), WIDTH, aspect * WIDTH)], COPPER, ModeSet(11, 2, (11, 3)), 16, 40)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--aspect", type=float, default=0.04, help="thickness over width")
    parser.add_argument("--thicker", action="store_true", help="sharp corners of thicker copper")
    arguments = parser.parse_args()
    if arguments.thicker:
        rows = [(degrees, 0.0, aspect) for aspect in (0.027, 0.1, 0.3) for degrees in (45, 60, 90)]
    else:
        radii = (0.0, 0.6, 0.69, 1.31, 1.7, 2.5)
        rows = [(degrees, radius, arguments.aspect) for degrees in (45, 60, 90) for radius in radii]
    for degrees, radius, aspect in rows:
        a, p, left = beyond_modes(degrees, radius, aspect)
        print(f"{degrees} degrees, radius {radius:4.2f}, aspect {aspect:5.3f}: a {a:+.4f}, p {p:5.1f}; left {left:.4f}")


if __name__ == "__main__":
    main()
