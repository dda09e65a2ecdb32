"""Resistance of tracks and plated holes, at direct current and of lone or paired straight tracks at any frequency; and
what a track's end in a pad, a teardrop, a contact or a wider track adds.

Direct current spreads at such an end, so that the track counts shorter. Lengths are in track widths there; each
function gives the squares that the end has beyond those of the track's centre line up to the pad's centre (negative:
the end conducts better than the track would).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from sitscad.physics.constants import skin_depth
from sitscad.physics.loss.current_modes import ProximityLoss, mode_system
from sitscad.physics.loss.track_modes import Cut, suited_modes

COPPER_CONDUCTIVITY = 58.0e6
"""Annealed copper at 20 C in S/m (NBS Handbook 100: 0.017241 ohm mm2/m)."""

COPPER_TEMPERATURE_COEFFICIENT = 3.93e-3
"""Rise of copper's resistivity per kelvin about 20 C (NBS Handbook 100)."""


LANCZOS_STEPS = 30
"""Steps of the Lanczos run for tracks alone or in pairs, at most."""


def conductivity_at(temperature: float, conductivity: float = COPPER_CONDUCTIVITY,
                    coefficient: float = COPPER_TEMPERATURE_COEFFICIENT) -> float:
    """Conductivity (S/m) at a temperature (degrees Celsius) of a metal whose conductivity at 20 C is given, by the
    linear law of resistivity (NBS Handbook 100). Raises ValueError where the straight line through 20 C leaves no
    resistivity.
    """
    factor = 1.0 + coefficient * (temperature - 20.0)
    if not factor > 0.0:
        raise ValueError(f"a temperature of {temperature:g} C is out of range")
    return conductivity / factor


@lru_cache(maxsize=64)
def bend_squares(turn: float) -> float:
    """Squares (no unit) by which a sharp bend of a track differs from its centre line's length (negative), for a turn
    in rad. Direct current cuts the corner: 2/pi (psi((1 + a)/2) - psi(1/2)) - tan(pi a / 2) for a turn of pi a, derived
    here from the conformal map dz/du = tanh^a(u/2) of a straight strip (Hall, Thin Solid Films 1, 1967, has bends by
    such maps); -0.441 for a right angle.
    """
    a = abs(turn) / math.pi
    u = np.linspace(0.0, 24.0, 4801)[1:]
    # 1 - tanh^a(u / 2), from u = s^4 so that the root at 0 does no harm
    s = u / 24.0
    rest = (1.0 - np.tanh(12.0 * s**4) ** a) * 96.0 * s**3
    kappa = float((np.sum(rest) - 0.5 * rest[-1]) * (s[1] - s[0]))
    return 2.0 * kappa / math.pi - math.tan(0.5 * abs(turn))


def via_resistance(length: float, drill: float, plating: float, conductivity: float) -> float:
    """Resistance (ohm) of a plated hole's barrel between two layers, length over conductivity (S/m) and the ring's area
    (textbook): drill is its outer diameter, lengths in metres.
    """
    plating = min(plating, drill / 2.0)
    return length / (conductivity * math.pi * plating * (drill - plating))


@lru_cache(maxsize=64)
def lone_track_loss(width: float, thickness: float, conductivity: float) -> ProximityLoss:
    """Loss (ohm and H per metre) of a lone straight track (width, thickness in metres, conductivity in S/m): a mode
    solve (`current_modes`), R within 1 % up to 10 MHz.
    """
    modes = suited_modes(width, thickness, width, skin_depth(10e6, conductivity), True)
    one = np.ones(1)
    cut = Cut(0.0 * one, 0.0 * one, width * one, thickness * one, one, 0.0 * one)
    return mode_system(cut, None, conductivity, modes).loss(LANCZOS_STEPS)


@lru_cache(maxsize=64)
def pair_loss(width: float, thickness: float, across: float, height: float, conductivity: float) -> ProximityLoss:
    """Loss (ohm and H per metre) of two equal straight tracks that carry a current there and back, by a mode solve
    (`current_modes`). `across` and `height` (m) are the distances of their centres along the width and through the
    board, `conductivity` in S/m.
    """
    gap = height if height > 0.0 else max(across - width, 0.1 * width) + 0.25 * width
    modes = suited_modes(width, thickness, gap, skin_depth(10e6, conductivity), True)
    two = np.ones(2)
    cut = Cut(np.array([0.0, across]), np.array([0.0, height]), width * two, thickness * two, two, 0.0 * two)
    return mode_system(cut, None, conductivity, modes, current=np.array([1.0, -1.0])).loss(LANCZOS_STEPS)


TERMS = 400
"""Terms of the series for a pad: what is left out is below 1e-3 squares for pads of up to ten widths."""


@lru_cache(maxsize=256)
def pad_squares(pad: float, drill: float) -> float:
    """Squares (no unit) of a round pad about a plated hole at one potential, both by their diameters in track widths:
    derived here (`_disc_squares`). From 0.6 widths of radius within 0.02 squares, below it within 0.1. A pad narrower
    than the track counts as the track's own round end.
    """
    radius = max(pad, 1.0) / 2.0
    mouth = math.asin(min(1.0, 0.5 / radius))
    return _disc_squares(radius, drill / 2.0, mouth) - _mouth(radius, mouth)


@lru_cache(maxsize=256)
def teardrop_squares(pad: float, drill: float, reach: float) -> float:
    """Squares (no unit) of a pad with a teardrop: tangents from the pad to a circle of the track's width, `reach` from
    its centre. Derived here, within 0.08 squares: the current is taken as even over the pad's wide mouth, and as from
    one point in the wedge, ln(r2 / r1) over its angle. Falls back to `pad_squares` where the pad is no wider than the
    track or the reach ends inside it.
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
    """Squares (no unit) of a contact that a track enters `inside` deep up to where it is met, `height` across, with a
    trapezoid before it. Derived here: the current fills the contact at once and the trapezoid, `reach` long, evenly
    over each of its cross-sections.
    """
    across = max(height, 1.0)
    tapered = math.log(across) / (across - 1.0) if across > 1.0 + 1e-9 else 1.0
    return inside * (1.0 / across - 1.0) + reach * (tapered - 1.0)


def step_squares(wide: float) -> float:
    """Squares (no unit) of a track that ends in the middle of the round end, `wide` across, of a wider one in line with
    it. Beyond both centre lines, up to twelve widths within 0.03 squares: the narrow track begins only where it leaves
    the round end; 0.9 is what triangles over the copper make of the way up to there, the sum of an even current in the
    round end and of the step between two strips (by the conformal map that P. M. Hall gives, Thin Solid Films 1, 1967).
    """
    if wide <= 1.0 + 1e-6:
        return 0.0
    covered, a = math.sqrt(wide * wide - 1.0) / 2.0, 1.0 / wide
    step = (a + wide) * math.log((1.0 + a) / (1.0 - a)) - 2.0 * math.log(4.0 * a / (1.0 - a * a))
    return 0.9 * (step / (2.0 * math.pi) + 0.5 * math.asin(2.0 * covered * a)) - covered


def _disc_squares(radius: float, hole: float, mouth: float) -> float:
    """Squares (no unit) of a disc between a hole in its middle and a part of its rim, half of whose angle (rad) is
    `mouth`; radii in track widths. Laplace's equation in the ring by its Fourier series (textbook), the current even
    over the mouth and none through the rest.
    """
    deep = math.log(radius / min(hole, 0.99 * radius))
    n = np.arange(1, TERMS + 1)
    series = np.sinc(n * mouth / math.pi) ** 2 * np.tanh(n * deep) / n
    return deep / (2.0 * math.pi) + float(np.sum(series)) / math.pi


def _mouth(radius: float, mouth: float) -> float:
    """How far (track widths) from the pad's centre the mouth lies, in the mean along its arc: r sin(m) / m for half an
    angle m (rad).
    """
    return radius * math.sin(mouth) / mouth
