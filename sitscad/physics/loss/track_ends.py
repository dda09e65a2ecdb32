"""Where a track ends in a pad, a teardrop, a contact or a wider track: direct current spreads there, so that the track
counts shorter.

All lengths in track widths; each function gives the squares that the end has beyond those of the track's centre line up
to the pad's centre (negative: the end conducts better than the track would).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

TERMS = 400
"""Of the series for a pad: what is left out is below 1e-3 squares for pads of up to ten widths."""


@lru_cache(maxsize=256)
def pad_squares(pad: float, drill: float) -> float:
    """A round pad about a plated hole at one potential, both by their diameters; from 0.6 widths of radius within 0.02
    squares, below it within 0.1.

    A pad narrower than the track counts as the track's own round end.
    """
    radius = max(pad, 1.0) / 2.0
    mouth = math.asin(min(1.0, 0.5 / radius))
    return _disc_squares(radius, drill / 2.0, mouth) - _mouth(radius, mouth)


@lru_cache(maxsize=256)
def teardrop_squares(pad: float, drill: float, reach: float) -> float:
    """The same with a teardrop: tangents from the pad to a circle as wide as the track, `reach` from the pad's centre.
    Within 0.08 squares: the current is taken as even over the pad's wide mouth, and as from one point in the wedge.
    Falls back to `pad_squares` where the pad is no wider than the track or the reach ends inside it.
    """
    radius = pad / 2.0
    if radius <= 0.5 or reach <= radius:
        return pad_squares(pad, drill)
    mouth = math.acos((radius - 0.5) / reach)
    slope = math.pi / 2.0 - mouth
    apex = radius / math.sin(slope)
    wedge = math.log((apex - _mouth(radius, mouth)) * math.sin(slope) / 0.5) / (2.0 * slope)
    return _disc_squares(radius, drill / 2.0, mouth) + wedge - reach


def contact_squares(inside: float, height: float, reach: float = 0.0) -> float:
    """A contact that a track enters `inside` deep up to where it is met, `height` across, with a trapezoid before it.

    The current fills the contact at once and the trapezoid, `reach` long, evenly over each of its cross-sections.
    """
    across = max(height, 1.0)
    tapered = math.log(across) / (across - 1.0) if across > 1.0 + 1e-9 else 1.0
    return inside * (1.0 / across - 1.0) + reach * (tapered - 1.0)


def step_squares(wide: float) -> float:
    """A track that ends in the middle of the round end, `wide` across, of a wider one in line with it.

    Beyond both centre lines, up to twelve widths within 0.03 squares: the narrow track begins only where it leaves the
    round end; 0.9 is what triangles over the copper make of the way up to there, the sum of an even current in the
    round end and of the step between two strips (by the conformal map that P. M. Hall gives, Thin Solid Films 1, 1967).
    """
    if wide <= 1.0 + 1e-6:
        return 0.0
    covered, a = math.sqrt(wide * wide - 1.0) / 2.0, 1.0 / wide
    step = (a + wide) * math.log((1.0 + a) / (1.0 - a)) - 2.0 * math.log(4.0 * a / (1.0 - a * a))
    return 0.9 * (step / (2.0 * math.pi) + 0.5 * math.asin(2.0 * covered * a)) - covered


def _disc_squares(radius: float, hole: float, mouth: float) -> float:
    """Squares of a disc between a hole in its middle and a part of its rim, half of whose angle (rad) is `mouth`.

    Laplace's equation in the ring by its Fourier series, the current even over the mouth and none through the rest.
    """
    deep = math.log(radius / min(hole, 0.99 * radius))
    n = np.arange(1, TERMS + 1)
    series = np.sinc(n * mouth / math.pi) ** 2 * np.tanh(n * deep) / n
    return deep / (2.0 * math.pi) + float(np.sum(series)) / math.pi


def _mouth(radius: float, mouth: float) -> float:
    """How far from the pad's centre the mouth lies, in the mean along its arc."""
    return radius * math.sin(mouth) / mouth
