"""Stiffness of a bonded pad under a rigid plate: compression, shear, tilt and twist, from the dimensions of the pad.

The basis are textbook terms. They are the pressure of incompressible rubber between bonded plates (torsion function of
the face, Gent and Lindley 1959, Gent and Meinecke 1970), Lindley's law for large strain, and shear and bending of a
short column. The remaining factors are fitted to our own finite elements (tests/oracles/pad_elements.py,
tests/validation/pad_figures.csv). These are neo-Hookean and incompressible, with faces one to six thicknesses wide (one
side up to fourteen) and strain up to 35 %. Lengths are divided by the thickness and stresses by the shear modulus,
unless a docstring states another unit. The shape factor is the loaded area divided by the free side area.

`Ogden` holds factors for a silicone whose Ogden exponent alpha is not 2. Its energy is W = (2 mu / alpha^2) (sum of
stretch^alpha - 3) (Ogden 1972); 2 is neo-Hookean. The stiffness then changes by a fraction with two textbook terms. The
first is -(alpha - 2)/4 times the strain of a bar, the second (alpha^2 - 4)/24 times the squared shear.

In a flat pad, material that bulges outwards is sheared. At the bonded faces, the shear is the strain times the distance
from the middle divided by the thickness, times a factor from three (disc) to six (strip). The mean of the squared shear
is then 13 to 14 times the squared shape factor times the squared strain. In this mean, each place has the weight of its
shear energy. The remaining factors are fitted to our own finite elements with exponents 2 to 4
(tests/validation/ogden_figures.csv).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TypeVar

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.mechanics.surround_law import (
    NO_WEBS,
    WEB_SIGMA,
    Film,
    WebFactors,
    Webs,
    film_contributions,
    film_hardening,
    web_factors,
)

Number = TypeVar("Number", float, Array)
"""A float, or an array of floats."""

NEO_HOOKEAN = 2.0  # The exponent with which nothing differs
MOST_OBLONG = 1.0 / 3.0  # Oblongness (two to one) up to which the fit was made; held beyond


@record
class Ogden:
    """Corrections of the neo-Hookean law for other Ogden exponents of pad and film, as functions of strain.

    `exponent` belongs to the pad, `skin_exponent` to the film. `shape_factor`, `round`, `oblong` and `has_rim` describe
    the loaded face. `round` is 0 for a rectangle and 1 for an ellipse. `oblong` is `Block.oblongness`. `has_rim` is 0
    for a pad without a rim and 1 for a pad with a wide rim.
    """

    exponent: float
    skin_exponent: float
    shape_factor: float
    round: float = 0.0
    oblong: float = 0.0
    has_rim: float = 0.0

    @property
    def hardening(self) -> float:
        """Relative increase of the shear stiffness, divided by the squared shear strain: (alpha^2 - 4)/24.

        It is the second term of Ogden's law (1972) in simple shear (textbook).
        """
        return (self.exponent * self.exponent - 4.0) / 24.0

    @property
    def film_hardening(self) -> float:
        """Relative increase of the film's shear stiffness, divided by the squared shear strain (see `hardening`)."""
        return (self.skin_exponent * self.skin_exponent - 4.0) / 24.0

    def pressure(self, strain: Number) -> Number:
        """Return the factor (no unit) on the neo-Hookean pressure of the pad at a compressive strain.

        It is fitted to our own finite elements (tests/validation/ogden_figures.csv).
        """
        flat = 15.1 * self.shape_factor**2 * (1.0 - 0.215 * self.round + 2.28 * self.oblong**2)
        linear = 0.272 * (1.0 - 0.22 * self.has_rim)
        return 1.0 + self._factor_increase(strain, linear, 1.0 + flat + 5.6 * strain)

    def shear(self, strain: Number) -> Number:
        """Return the change of the shear stiffness at a compressive strain, divided by the shear stiffness at rest.

        It is fitted to our own finite elements (tests/validation/ogden_figures.csv).
        """
        flat = 8.7 * self.shape_factor**2 * (1.0 - 2.5 * self.oblong)
        given_way = 1.0 - (strain / 0.43) ** 6
        linear = 0.29 * (1.0 - 0.43 * self.has_rim)
        return self._factor_increase(strain, linear, (5.0 + flat + 3.3 * self.has_rim) * given_way)

    def tilt(self, strain: Number) -> Number:
        """Return the factor (no unit) on the neo-Hookean tilt stiffness at a compressive strain.

        The tilt stiffness depends on the derivative of the pressure with respect to the strain. The factor is fitted to
        our own finite elements (tests/validation/ogden_figures.csv).
        """
        square = self.shape_factor**2
        flat = 29.3 * square * (1.0 - 0.43 * self.oblong - 0.15 * self.round)
        return 1.0 + self._factor_increase(strain, 0.465, 4.9 + flat + (15.9 - 30.4 * square) * strain)

    def _factor_increase(self, strain: Number, linear: float, square: Number) -> Number:
        """Return the difference of a factor from 1 (no unit) at a compressive strain, by two coefficients.

        For exponents above 2 a pad is softer at first, by (alpha - 2) times `linear` times the strain (1/4 for a bar,
        textbook). At larger strain it is stiffer, by `hardening` times `square` times the squared strain. For exponents
        below 2 the signs are opposite, and the factor stays above 0.
        """
        more = self.hardening * square * strain * strain
        if self.hardening < 0.0:
            more = more / (1.0 - more)
        return more - (self.exponent - NEO_HOOKEAN) * linear * strain


MOST_STRAIN = 0.40
"""Compressive strain above which the fitted stiffness curves are constant: extrapolated, they might fall."""

LEAST_STRAIN = -0.20
"""Strain (negative: tension) below which the fitted stiffness curves are constant."""

FIT_SIGMA = 0.025
"""Standard deviation of the law's force for a pad without rim, film and webs, divided by the force.

Source: comparison with finite elements (tests/mechanics/test_pad.py, tests/validation/pad_figures.csv).
"""

DOUBTED_SHAPES, DOUBTED_OBLONG = (1.0, 1.6), (2.0, 3.5)
"""Ranges of the shape factor and of length divided by width in which `FIT_SIGMA` grows to twice its value.

Pads with a shape factor of 1.5 agree with finite elements within 4.5 % root mean square, faces of three to one within
3.2 %. Above these ranges the doubled value is used: a square of ten thicknesses differs by 3 % from finite elements of
third degree.
"""

RIM_SIGMA = 0.03
"""Additional standard deviation of the force, divided by the force, for a pad that is wider than its target."""

FILM_SIGMA = 0.08
"""Standard deviation of the part of the force that a film carries, divided by this part.

Films were fitted to elements of third degree. For a thin stiff film that has buckled, elements of third degree are up
to 8 % stiffer than elements of fourth degree.
"""

RIM_COUNTS = 0.1
"""Width of a rim, divided by the thickness, at which the error for a rim is 63 % of `RIM_SIGMA`.

The factor on `RIM_SIGMA` is 1 - exp(-width / `RIM_COUNTS`), with the width divided by the thickness. It is 0.92 for the
narrowest validated rim, 0.25.
"""

RIM_HIDES = 0.36
"""Width of a rim, divided by the thickness, at which the effect of a film outside it falls to 1/e.

The value is assumed, unverified.
"""

OGDEN_SIGMA = 0.01
"""Standard deviation of the force, divided by the force, for an Ogden exponent that differs from 2 by one.

It is proportional to the difference, for shape factors up to 1. For larger shape factors it is also multiplied by the
shape factor's third power.
"""

OGDEN_RIM = 0.3  # Thicknesses of rim within which the factors of an exponent go over into those of a wide rim
OBLONG = 3.5  # Length over width up to which the law was held against finite elements

FLATTEST = 2.0
"""Largest shape factor of the fitted stiffness curves (a square of eight thicknesses).

Pads with a larger shape factor use the curves for this value.
"""


@record
class Block:
    """Dimensionless description of a loaded pad: lengths divided by its thickness, moduli by its shear modulus.

    `along` and `across` are the widths of the loaded face along the first axis and across it. The first axis is the
    direction of the computed shear or tilt. `round` is 0 for a rectangle and 1 for an ellipse. `rim` is the mean width
    by which the pad is wider than the face on each side. `skin` and `skin_modulus` are thickness and shear modulus of
    the film round the face. `exponent` and `skin_exponent` are Ogden exponents. `webs` join a rectangular pad to its
    neighbours.
    """

    along: float
    across: float
    round: float = 0.0
    rim: float = 0.0
    skin: float = 0.0
    skin_modulus: float = 0.0
    exponent: float = NEO_HOOKEAN
    skin_exponent: float = NEO_HOOKEAN
    webs: Webs = NO_WEBS

    @property
    def ogden(self) -> Ogden | None:
        """Factors for Ogden exponents of pad and film. None if both are neo-Hookean."""
        exponents = self.exponent, self.skin_exponent if self.skin else NEO_HOOKEAN
        if exponents == (NEO_HOOKEAN, NEO_HOOKEAN):
            return None
        oblong = min(max(self.oblongness, -MOST_OBLONG), MOST_OBLONG)
        return Ogden(*exponents, self.limited_shape_factor, self.round, oblong, -math.expm1(-self.rim / OGDEN_RIM))

    @property
    def turned(self) -> Block:
        """Block with its two axes exchanged: the second axis becomes the first."""
        return replace(self, along=self.across, across=self.along, webs=self.webs.turned)

    @cached_property
    def web_stiffening(self) -> WebFactors:
        """Factors (no unit) by which the webs increase the pad's stiffness."""
        return web_factors(self.along, self.across, self.rim, self.webs)

    @cached_property
    def films(self) -> tuple[Film, Film, Film]:
        """Additions of the film to compression, shear and tilt stiffness, divided by the pad's shear modulus.

        They fade with the width of the rim between film and face.
        """
        faded = math.exp(-self.rim / RIM_HIDES)
        face = self.along, self.across, self.shape_factor, self.oblongness, self.round
        return film_contributions(*face, self.skin, self.skin_modulus, faded)

    @property
    def area(self) -> float:
        """Loaded area, divided by the squared thickness."""
        return (1.0 - (1.0 - math.pi / 4.0) * self.round) * self.along * self.across

    @property
    def shape_factor(self) -> float:
        """Loaded area divided by the free side area of a rectangle, a b / (2 (a + b)); nearly equal for an ellipse."""
        return 0.5 * self.along * self.across / (self.along + self.across)

    @property
    def limited_shape_factor(self) -> float:
        """Shape factor, at most `FLATTEST`."""
        return min(self.shape_factor, FLATTEST)

    @property
    def oblongness(self) -> float:
        """Difference of the widths along and across the first axis divided by their sum: -1 to 1, 0 for a square."""
        return (self.along - self.across) / (self.along + self.across)


def pressure_stiffness(block: Block) -> float:
    """Return the part of the compression modulus that comes from the pressure between bonded plates.

    It is divided by the shear modulus. The formula is 12 / h^2 times the mean of the torsion function, 3 J / A (Gent
    and Meinecke 1970). Here h is the thickness, A the loaded area and J the torsion constant of the face. J of a
    rectangle follows Roark's formula within 0.5 %. J of an ellipse is exact (Timoshenko and Goodier, Theory of
    Elasticity).
    """
    long, wide = max(block.along, block.across), min(block.along, block.across)
    edged = long * wide**3 * (1.0 / 3.0 - 0.21 * wide / long * (1.0 - (wide / long) ** 4 / 12.0)) / (long * wide)
    rounded = 0.25 * long**2 * wide**2 / (long**2 + wide**2)
    return 3.0 * (edged + (rounded - edged) * block.round)


def compression_modulus(block: Block) -> float:
    """Return the compression modulus at rest (pressure divided by small strain), divided by the shear modulus.

    The shear part is Gent and Meinecke's (1970), from 3 (square) to 4 (infinite strip). Bonded edges add 0.3, fitted to
    our own finite elements (tests/validation/pad_figures.csv).
    """
    a, b = block.along, block.across
    sheared = 4.0 - 2.0 * (a * b + 1.0) / (a * a + b * b + 2.0)
    return sheared + (0.301 - 0.160 * block.round) * _bonded_weight(block) + pressure_stiffness(block)


def _bonded_weight(block: Block) -> float:
    """Return the weight (0 to 1) of the effects of bonded faces in the compression law.

    It is near 0 for a pad that is many times as high as wide. The constant was fitted together with the constants in
    `compression_modulus`.
    """
    return -math.expm1(-block.shape_factor / 0.1)


def force_sigma(block: Block) -> float:
    """Return the standard deviation of the force by the law, divided by the force.

    Its basis is `FIT_SIGMA`, which doubles smoothly for flat and for oblong faces. Source: finite elements of 22 pads
    (132 forces). Converged results differ by 1.6 % root mean square, all results by 2.5 %, and pads that the fit did
    not use by 3 %. Rims, films, webs and Ogden exponents add further errors.
    """

    def part(value: float, bounds: tuple[float, float]) -> float:
        """Return position (0 to 1) of a value between two bounds."""
        return min(max((value - bounds[0]) / (bounds[1] - bounds[0]), 0.0), 1.0)

    oblong = max(block.along, block.across) / min(block.along, block.across)
    doubted = max(part(block.shape_factor, DOUBTED_SHAPES), part(oblong, DOUBTED_OBLONG))
    of_exponent = OGDEN_SIGMA * abs(block.exponent - NEO_HOOKEAN) * max(1.0, block.limited_shape_factor) ** 3
    own_part = math.hypot(FIT_SIGMA * (1.0 + doubted), of_exponent)
    if block.webs.width:
        own_part = math.hypot(own_part, WEB_SIGMA * (1.0 - 1.0 / block.web_stiffening.press))
    if not block.rim and not block.skin:
        return own_part
    law = compression(block)
    of_rim = RIM_SIGMA * -math.expm1(-block.rim / RIM_COUNTS)
    return math.hypot(own_part, of_rim, FILM_SIGMA * law.film.rest / law.at_rest)


def rim_factor(block: Block, most: float, power: float, reach: float) -> float:
    """Return the factor (no unit) by which a rim increases a stiffness: 1 without rim.

    A wide rim increases the stiffness by the fraction `most` at a shape factor of 1. For other shape factors, this
    fraction is multiplied by shape factor^(-`power`). For narrower rims, it is multiplied by 1 - exp(-rim / `reach`).
    Lengths are divided by the thickness. The form is fitted to finite elements (tests/validation/pad_figures.csv).
    """
    if block.rim <= 0.0:
        return 1.0
    return 1.0 + most * block.shape_factor**-power * -math.expm1(-block.rim / reach)


def _lindley_strain(strain: Number) -> Number:
    """Return the strain measure (1 / lambda^2 - lambda) / 3 of the stretch lambda = 1 - strain, without cancellation.

    It is Lindley's law, which holds for a neo-Hookean bar (textbook).
    """
    stretch = 1.0 - strain
    return strain * (3.0 - 3.0 * strain + strain * strain) / (3.0 * stretch * stretch)


@record
class CompressionLaw:
    """Normal pressure as a function of compressive strain, divided by the shear modulus.

    The pressure is Lindley's strain measure (`_lindley_strain`) times a stiffness. The pad's stiffness is `modulus`
    (1 + `first` e + `second` e^2) at the strain e; the film's contribution is added. `ogden` corrects both for other
    Ogden exponents.
    """

    modulus: float
    first: float
    second: float
    film: Film = Film()
    ogden: Ogden | None = None

    @property
    def at_rest(self) -> float:
        """Normal pressure divided by strain and by the shear modulus, at small strain, including the film."""
        return self.modulus + self.film.rest

    def __call__(self, strain: Array) -> Array:
        """Return the pressure (n) at strains (n) below 1, divided by the shear modulus.

        It is positive in compression.
        """
        bound = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        return np.asarray(self._relative_pressure(bound, self.film(bound)) * _lindley_strain(strain))

    def at(self, strain: float) -> float:
        """Return the pressure at one strain, divided by the shear modulus. It is positive in compression."""
        bound = min(max(strain, LEAST_STRAIN), MOST_STRAIN)
        return self._relative_pressure(bound, self.film.at(bound)) * _lindley_strain(strain)

    def _relative_pressure(self, bound: Number, film: Number) -> Number:
        """Return the pressure divided by Lindley's strain measure and by the shear modulus, at the strains `bound`.

        The strains are limited to the range from `LEAST_STRAIN` to `MOST_STRAIN`. `film` is the contribution of the
        film at these strains.
        """
        pad = self.modulus * (1.0 + self.first * bound + self.second * bound * bound)
        if self.ogden is None:
            return pad + film
        more = 2.2 * self.ogden.film_hardening + 1.4 * self.ogden.hardening
        return pad * self.ogden.pressure(bound) + film * (1.0 + more * bound * bound)

    def strain(self, load: float, within: float = 1e-14) -> float:
        """Return the compressive strain under a pressure `load` (0 or more), which is divided by the shear modulus.

        `within` is the relative tolerance of the strain. The method is the secant method with bisection (textbook).
        """
        low, high = 0.0, 1.0
        strain, slope, before = min(load / self.at_rest, 0.5), self.at_rest, (0.0, -load)
        for _ in range(100):
            lacking = self.at(strain) - load
            low, high = (strain, high) if lacking < 0.0 else (low, strain)
            if abs(strain - before[0]) > 1e-6 * strain:  # the secant from the strain before, where that is no rounding
                slope = (lacking - before[1]) / (strain - before[0])
            before = strain, lacking
            step = strain - lacking / slope if slope > 0.0 else strain
            step = step if low <= step <= high else 0.5 * (low + high)
            # The force is endless at a strain of 1: a secant from there stands still and looks like an answer
            step = min(step, 0.1 * strain + 0.9) if high == 1.0 else step
            if abs(step - strain) <= 1e-16 + within * strain:
                return step
            strain = step
        return strain


def compression(block: Block, bulk_modulus: float = math.inf) -> CompressionLaw:
    """Return the compression law of a block. `bulk_modulus` is divided by the shear modulus.

    The deviation from Lindley's law is fitted to finite elements (tests/validation/pad_figures.csv).
    """
    flat = block.limited_shape_factor
    modulus = compression_modulus(block) * rim_factor(block, 0.75, 0.71, 0.65) * block.web_stiffening.press
    surround = 0.13 * block.rim / 0.4 * math.exp(1.0 - block.rim / 0.4)
    first = -0.25 + 0.80 * flat - 0.040 * flat**2 - 0.129 * block.round * flat + surround
    second = -1.458 + 1.509 * flat - 0.462 * flat**2
    bonded = _bonded_weight(block)
    first, second = bonded * first, bonded * second
    return CompressionLaw(modulus / (1.0 + modulus / bulk_modulus), first, second, block.films[0], block.ogden)


def shear_stiffness(block: Block) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Return two functions of the compressive strain (n): shear stiffness along the first axis, and its cubic term.

    Both are divided by the shear modulus. The first is force divided by area and shear strain, for small shear. The
    second is the coefficient of the cubed shear strain in force divided by area.

    Notes
    -----
    At rest shear and bending of a short column are in series (textbook). Compression reduces the stiffness, as the
    axial force of a column does. Constants are fitted to our own finite elements (tests/validation/pad_figures.csv,
    ogden_figures.csv).
    """
    a, b, film, ogden, flat = block.along, block.across, block.films[1], block.ogden, min(block.along, 6.0)
    bent = (0.191 + 0.175 / a + 0.054 * (1.0 / b - 1.0 / a)) / a
    stiffness = rim_factor(block, 1.19, 1.2, 1.4) / (1.0 + bent) * block.web_stiffening.shear
    column = compression_modulus(block) / a**2 * a / (2.735 + 0.0475 * a + 0.582 * block.oblongness)
    helped = 1.1 * math.exp(-((block.rim / 0.445) ** 1.85)) - 0.1 if block.rim else 1.0
    # three terms of its softening
    first, second, third = column * helped * (1.0 + 0.066 * block.round), 2.43 - 0.815 * flat, 6.25 + 2.54 * flat
    hardening, hardening_by = 0.125 / a * max(0.0, 1.0 - block.rim / 0.4), 40.0 * max(0.0, helped)
    of_film = film_hardening(block.skin_modulus) * film.rest

    def course(strain: Array) -> Array:
        """Return force over area and small shear strain at compressive strains (n), in shear moduli."""
        e = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        softened = 1.0 - first * e * (1.0 + second * e + third * e * e)
        if ogden is None:
            return np.asarray(stiffness * softened + film(e))
        linear = 0.31 * (ogden.skin_exponent - NEO_HOOKEAN)
        in_film = 1.0 - linear * e + 11.3 * ogden.film_hardening * e * e
        return np.asarray(stiffness * (softened + ogden.shear(e)) + film(e) * in_film)

    def cubic(strain: Array) -> Array:
        """Return the coefficient of the cubic term of shear stress over shear strain, at compressive strains (n).

        It is in units of the shear modulus.
        """
        pressed = np.clip(strain, 0.0, MOST_STRAIN)
        stiffness_by_shear = hardening + hardening_by * pressed**3 + of_film * (1.0 + 4.0 * pressed)
        if ogden is None:
            return np.asarray(stiffness_by_shear)
        return np.asarray(stiffness_by_shear + stiffness * ogden.hardening + film.rest * ogden.film_hardening)

    return course, cubic


def tilt_stiffness(block: Block) -> Callable[[Array], Array]:
    """Return the tilt stiffness as a function of the compressive strain (n).

    It is the moment divided by area, thickness, angle and shear modulus. The tilt raises one end of the face along the
    first axis and lowers the other end.

    Notes
    -----
    At rest it is 3 I (1.13 + p). I is the second moment of the face divided by its area, and p the contribution of the
    pressure. Two strips that are infinitely long along either axis contribute a^2 / 15 (face short along the axis) and
    b^2 / 3.6 (face short across). p is their product divided by their sum, like resistances in parallel. The form is
    derived here, constants are fitted to our own finite elements (tests/validation/pad_figures.csv).
    """
    a, b, flat, oblong, ogden = block.along, block.across, block.limited_shape_factor, block.oblongness, block.ogden
    moment = (4.0 - block.round) / 48.0 * a * a
    sheared = 1.1255 + 0.0254 * block.round - oblong * (0.470 if oblong < 0.0 else 0.189)
    pressure = (1.0 - 0.2 * block.round) / (15.0 / a**2 + 3.58 / b**2)
    stiffness = 3.0 * moment * (sheared + pressure) * rim_factor(block, 0.637, 1.15, 0.35) * block.web_stiffening.tilt
    power = 3.10 * flat / (flat + 0.434) - 0.291 * oblong + 0.033 * block.round + 0.6 * math.expm1(-block.rim / 0.5)
    film = block.films[2]

    def course(strain: Array) -> Array:
        """Return moment over area, thickness and tilt angle at compressive strains (n), in shear moduli."""
        e = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        grown = (1.0 - e) ** -power * (1.0 + 0.844 * e - 1.407 * e * e)
        if ogden is None:
            return np.asarray(stiffness * grown + film(e))
        of_film = 1.0 + (2.8 * ogden.film_hardening + 5.9 * ogden.hardening) * e * e
        return np.asarray(stiffness * grown * ogden.tilt(e) + film(e) * of_film)

    return course


def twist_stiffness(block: Block) -> float:
    """Return the twist stiffness: the moment of a rotation in the plane of the face.

    It is divided by area, thickness, angle and shear modulus. Bonded faces do not warp. A flat pad has the polar moment
    of area, a tall pad Saint-Venant's torsion constant (textbook), and a weight interpolates between them. It was not
    validated by finite elements.
    """
    a, b = block.along, block.across
    polar = (4.0 - block.round) / 48.0 * (a * a + b * b)
    warped = pressure_stiffness(block) / 3.0
    flat = 1.0 / (1.0 + 1.0 / block.shape_factor**2)
    # the walls' shear stiffness along either axis, half a width away
    film = 0.25 * (a * a * block.turned.films[1].rest + b * b * block.films[1].rest)
    return (warped + (polar - warped) * flat) * rim_factor(block, 1.19, 1.2, 1.4) * block.web_stiffening.twist + film
