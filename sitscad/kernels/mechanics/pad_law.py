"""What a bonded pad's energy depends on: compression, shear, tilt and twist of a rigid plate, from its measures alone.

Textbook terms carry it: the pressure of incompressible rubber between bonded plates (the torsion function of the face,
Gent & Lindley 1959, Gent & Meinecke 1970), Lindley's large-strain law, shear and bending of a short column. What they
leave open is fitted to our own finite elements (tests/oracles/pad_elements.py, pad_figures.csv): neo-Hookean,
incompressible, faces of one to six thicknesses (fourteen across one of them), strain up to 35 %. Lengths are in
thicknesses, stresses in shear moduli, unless a docstring says otherwise.

A silicone of another exponent than 2 has factors on it (`Ogden`): W = (2 mu / alpha^2) (sum of the stretches to the
power alpha - 3) (Ogden 1972); 2 is neo-Hookean. Two terms are textbook: a bar's -(alpha - 2)/4 of the strain, and
(alpha^2 - 4)/24 of the square of a shear. What a flat pad squeezes out is sheared by three (disc) to six (strip) times
strain and place over thickness, whence 13 to 14 times the square of the shape factor. What they leave open is fitted to
our own finite elements of exponents 2 to 4 (tests/validation/ogden_figures.csv).
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
    Stiffer,
    Webs,
    film_hardening,
    films,
    stiffened,
)

Number = TypeVar("Number", float, Array)

NEO_HOOKEAN = 2.0  # The exponent with which nothing differs
MOST_OBLONG = 1.0 / 3.0  # Oblongness (two to one) up to which the fit was made; held beyond


@record
class Ogden:
    """How a pad of an exponent in a film of another differs by strain, from the pad's shape factor, how `round` and how
    oblong (-1 to 1, see `pad_law.Block`) its face is, and how much of a wide rim it has (`rimmed`, 0 to 1).
    """

    exponent: float
    skin_exponent: float
    shape_factor: float
    round: float = 0.0
    oblong: float = 0.0
    rimmed: float = 0.0

    @property
    def hardening(self) -> float:
        """What the square of a shear adds to the force per shear: (alpha^2 - 4)/24, no unit; the second term of Ogden's
        (1972) law in simple shear (textbook).
        """
        return (self.exponent * self.exponent - 4.0) / 24.0

    @property
    def film_hardening(self) -> float:
        """`hardening` of the film: what the square of a shear adds to its force per shear; no unit."""
        return (self.skin_exponent * self.skin_exponent - 4.0) / 24.0

    def pressure(self, strain: Number) -> Number:
        """Factor (no unit) on the pad's pressure at a strain; fitted to our own finite elements
        (tests/validation/ogden_figures.csv).
        """
        flat = 15.1 * self.shape_factor**2 * (1.0 - 0.215 * self.round + 2.28 * self.oblong**2)
        linear = 0.272 * (1.0 - 0.22 * self.rimmed)
        return 1.0 + self._more(strain, linear, 1.0 + flat + 5.6 * strain)

    def shear(self, strain: Number) -> Number:
        """What is added to the pad's stiffness of shear at a strain, in parts of that at rest (no unit); fitted to our
        own finite elements (tests/validation/ogden_figures.csv).
        """
        flat = 8.7 * self.shape_factor**2 * (1.0 - 2.5 * self.oblong)
        given_way = 1.0 - (strain / 0.43) ** 6
        return self._more(strain, 0.29 * (1.0 - 0.43 * self.rimmed), (5.0 + flat + 3.3 * self.rimmed) * given_way)

    def tilt(self, strain: Number) -> Number:
        """Factor (no unit) on the pad's stiffness of tilt at a strain: that of the slope of the pressure rather than
        its own; fitted to our own finite elements (tests/validation/ogden_figures.csv).
        """
        square = self.shape_factor**2
        flat = 29.3 * square * (1.0 - 0.43 * self.oblong - 0.15 * self.round)
        return 1.0 + self._more(strain, 0.465, 4.9 + flat + (15.9 - 30.4 * square) * strain)

    def _more(self, strain: Number, linear: float, square: Number) -> Number:
        """What an exponent adds to 1 at a strain, no unit. Softer at first, like a bar, by (alpha - 2) of `linear` (a
        bar's is 1/4, textbook), then stiffer; below 2 stiffer, then softer, and never by all that there is.
        """
        more = self.hardening * square * strain * strain
        if self.hardening < 0.0:
            more = more / (1.0 - more)
        return more - (self.exponent - NEO_HOOKEAN) * linear * strain


MOST_STRAIN, LEAST_STRAIN = 0.40, -0.20
"""Compression beyond which the fitted courses stay where they are: an extrapolation that cannot turn back."""

FIT_SIGMA = 0.025
"""One sigma, relative, of a bare pad's force (tests/mechanics/test_pad.py, of tests/validation/pad_figures.csv)."""

DOUBTED_SHAPES, DOUBTED_OBLONG = (1.0, 1.6), (2.0, 3.5)
"""Shape factors, and lengths over width, between which that sigma doubles: pads of 1.5 are held within 4.5 % root mean
square, faces of three to one within 3.2 %. It stays so beyond: a square of ten thicknesses is 3 % off finite elements
of third degree."""

RIM_SIGMA, FILM_SIGMA = 0.03, 0.08
"""Relative sigma beside that one, no unit: for a pad that reaches beyond its target, and of what a film carries.
Elements of third degree, to which films were fitted, bear up to 8 % more than those of fourth where a thin stiff film
has buckled."""

RIM_COUNTS = 0.1
"""Thicknesses of rim within which its sigma sets in: the narrowest that was held, 0.25, has nearly all of it."""

RIM_HIDES = 0.36
"""Thicknesses of rim within which a film beyond it ceases to count for the target: an assumption, unverified."""

OGDEN_SIGMA = 0.01
"""What an exponent's factors leave of the force (one sigma, relative) a unit of it, up to a shape factor of one; more
with its third power beyond."""

OGDEN_RIM = 0.3  # Thicknesses of rim within which the factors of an exponent go over into those of a wide rim
OBLONG = 3.5  # Length over width up to which the law was held against finite elements

FLATTEST = 2.0
"""Shape factor (a square of eight thicknesses) up to which the fitted courses are taken; flatter pads have its own."""


@record
class Block:
    """A loaded face on its pad, in thicknesses: its length along the axis looked at and across it, how `round` it is
    (0 a rectangle, 1 an ellipse), by how much the pad reaches beyond it on the average (`rim`), and the film round it:
    `skin` its thickness, `skin_modulus` its shear modulus in the pad's. `exponent` and `skin_exponent` are Ogden's;
    `webs` hold the pad of a rectangle.
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
        """How pad and film differ from neo-Hookean ones (no unit); None where they do not."""
        exponents = self.exponent, self.skin_exponent if self.skin else NEO_HOOKEAN
        if exponents == (NEO_HOOKEAN, NEO_HOOKEAN):
            return None
        oblong = min(max(self.oblongness, -MOST_OBLONG), MOST_OBLONG)
        return Ogden(*exponents, self.flatness, self.round, oblong, -math.expm1(-self.rim / OGDEN_RIM))

    @property
    def turned(self) -> Block:
        """The face, looked at along the other axis; no unit."""
        return replace(self, along=self.across, across=self.along, webs=self.webs.turned)

    @cached_property
    def stiffer(self) -> Stiffer:
        """What webs make of the pad's stiffness; no unit."""
        return stiffened(self.along, self.across, self.rim, self.webs)

    @cached_property
    def films(self) -> tuple[Film, Film, Film]:
        """What the film adds to pressure, shear and tilt (shear moduli, no unit); less where it stands beyond a rim."""
        faded = math.exp(-self.rim / RIM_HIDES)
        face = self.along, self.across, self.shape_factor, self.oblongness, self.round
        return films(*face, self.skin, self.skin_modulus, faded)

    @property
    def area(self) -> float:
        """Area in squares of the thickness, no unit: as `elastomer.Face.area`."""
        return (1.0 - (1.0 - math.pi / 4.0) * self.round) * self.along * self.across

    @property
    def shape_factor(self) -> float:
        """Loaded over free area (no unit) of the rectangle, a b / 2 (a + b) (of an ellipse nearly the same)."""
        return 0.5 * self.along * self.across / (self.along + self.across)

    @property
    def flatness(self) -> float:
        """The shape factor (no unit), as far as the courses were fitted."""
        return min(self.shape_factor, FLATTEST)

    @property
    def oblongness(self) -> float:
        """Oblongness from -1, all across, to 1, all along; no unit."""
        return (self.along - self.across) / (self.along + self.across)


def pressure_stiffness(block: Block) -> float:
    """Share of the modulus of compression, in shear moduli, that comes from the pressure between bonded plates: 12 /
    h^2 times the mean of the torsion function, 3 J / A (Gent and Meinecke 1970; J of a rectangle: Roark's formula,
    within 0.5 %; of an ellipse exact, Timoshenko and Goodier, Theory of Elasticity).
    """
    long, wide = max(block.along, block.across), min(block.along, block.across)
    edged = long * wide**3 * (1.0 / 3.0 - 0.21 * wide / long * (1.0 - (wide / long) ** 4 / 12.0)) / (long * wide)
    rounded = 0.25 * long**2 * wide**2 / (long**2 + wide**2)
    return 3.0 * (edged + (rounded - edged) * block.round)


def compression_modulus(block: Block) -> float:
    """Modulus of compression at rest over the shear modulus, no unit.

    Of rubber that shears alone it would be Gent & Meinecke's (1970), from 3 (square) to 4 (endless); bonded edges add
    0.3, fitted to our own finite elements (tests/validation/pad_figures.csv).
    """
    a, b = block.along, block.across
    sheared = 4.0 - 2.0 * (a * b + 1.0) / (a * a + b * b + 2.0)
    return sheared + (0.301 - 0.160 * block.round) * _bonded(block) + pressure_stiffness(block)


def _bonded(block: Block) -> float:
    """How far (0 to 1, no unit) bonded ends make a pad differ from a bar: not at all where it is many times as high as
    wide. Fitted as `compression_modulus`.
    """
    return -math.expm1(-block.shape_factor / 0.1)


def sigma(block: Block) -> float:
    """One sigma, relative, of a bare pad's force: what the law was held against, and twice that for flat and oblong
    faces, without a step.

    Finite elements of 22 pads, 132 forces: 1.6 % root mean square of the converged, 2.5 % of all;
    pads left out of the fit 3 %. Rims, what a film bears and an exponent other than 2 add theirs.
    """

    def part(value: float, bounds: tuple[float, float]) -> float:
        """How far (0 to 1, no unit) a value has gone from one bound to the other."""
        return min(max((value - bounds[0]) / (bounds[1] - bounds[0]), 0.0), 1.0)

    oblong = max(block.along, block.across) / min(block.along, block.across)
    doubted = max(part(block.shape_factor, DOUBTED_SHAPES), part(oblong, DOUBTED_OBLONG))
    of_exponent = OGDEN_SIGMA * abs(block.exponent - NEO_HOOKEAN) * max(1.0, block.flatness) ** 3
    bare = math.hypot(FIT_SIGMA * (1.0 + doubted), of_exponent)
    if block.webs.width:
        bare = math.hypot(bare, WEB_SIGMA * (1.0 - 1.0 / block.stiffer.press))
    if not block.rim and not block.skin:
        return bare
    law = compression(block)
    return math.hypot(bare, RIM_SIGMA * -math.expm1(-block.rim / RIM_COUNTS), FILM_SIGMA * law.film.rest / law.at_rest)


def rimmed(block: Block, most: float, power: float, reach: float) -> float:
    """What a surround makes of a stiffness (no unit): 1 without one, more by up to `most` (at a shape factor of one),
    within `reach` (thicknesses). Fitted to finite elements (tests/validation/pad_figures.csv).
    """
    if block.rim <= 0.0:
        return 1.0
    return 1.0 + most * block.shape_factor**-power * -math.expm1(-block.rim / reach)


def _lindley(strain: Number) -> Number:
    """(1 / lambda^2 - lambda) / 3, no unit, of the stretch lambda = 1 - strain, without cancellation (Lindley's law,
    the bar's in neo-Hookean rubber; textbook).
    """
    left = 1.0 - strain
    return strain * (3.0 - 3.0 * strain + strain * strain) / (3.0 * left * left)


@record
class CompressionLaw:
    """Normal pressure by strain, in shear moduli: modulus, course (1 + first e + second e^2) over Lindley's law, and
    that of the film beside it.
    """

    modulus: float
    first: float
    second: float
    film: Film = Film()
    ogden: Ogden | None = None

    @property
    def at_rest(self) -> float:
        """Pressure over strain where that is small, film and all, in shear moduli: no unit."""
        return self.modulus + self.film.rest

    def __call__(self, strain: Array) -> Array:
        """Force over the loaded area in shear moduli (no unit), positive for a press; any pull, strains below 1."""
        bound = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        return np.asarray(self._course(bound, self.film(bound)) * _lindley(strain))

    def at(self, strain: float) -> float:
        """The force at one strain; no unit."""
        bound = min(max(strain, LEAST_STRAIN), MOST_STRAIN)
        return self._course(bound, self.film.at(bound)) * _lindley(strain)

    def _course(self, bound: Number, film: Number) -> Number:
        """The pressure over Lindley's strain, in shear moduli, at strains within the bounds, with what a film adds
        there.
        """
        pad = self.modulus * (1.0 + self.first * bound + self.second * bound * bound)
        if self.ogden is None:
            return pad + film
        more = 2.2 * self.ogden.film_hardening + 1.4 * self.ogden.hardening
        return pad * self.ogden.pressure(bound) + film * (1.0 + more * bound * bound)

    def strain(self, load: float, within: float = 1e-14) -> float:
        """The strain (no unit) under a force of 0 or more over the loaded area, in shear moduli; `within` so much of it
        (no unit), as a rule to rounding. By secants, kept between bounds that are halved (textbook).
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
    """The course of compression of a block, no unit; the bulk modulus is in shear moduli, too. Fitted to finite
    elements (tests/validation/pad_figures.csv) over Lindley's law.
    """
    flat = block.flatness
    modulus = compression_modulus(block) * rimmed(block, 0.75, 0.71, 0.65) * block.stiffer.press
    surround = 0.13 * block.rim / 0.4 * math.exp(1.0 - block.rim / 0.4)
    first = -0.25 + 0.80 * flat - 0.040 * flat**2 - 0.129 * block.round * flat + surround
    second = -1.458 + 1.509 * flat - 0.462 * flat**2
    bonded = _bonded(block)
    first, second = bonded * first, bonded * second
    return CompressionLaw(modulus / (1.0 + modulus / bulk_modulus), first, second, block.films[0], block.ogden)


def shear(block: Block) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """The course of shear along the block's first axis by compression (n,), in shear moduli: force over area and shear
    strain where that is small, and the part over the cube of the shear strain.

    At rest a short column's shear and bending in series (textbook); compression takes from it what a column's axial
    force does. Constants are fitted to our own finite elements (tests/validation/pad_figures.csv, ogden_figures.csv).
    """
    a, b, film, ogden, flat = block.along, block.across, block.films[1], block.ogden, min(block.along, 6.0)
    bent = (0.191 + 0.175 / a + 0.054 * (1.0 / b - 1.0 / a)) / a
    stiffness = rimmed(block, 1.19, 1.2, 1.4) / (1.0 + bent) * block.stiffer.shear
    column = compression_modulus(block) / a**2 * a / (2.735 + 0.0475 * a + 0.582 * block.oblongness)
    helped = 1.1 * math.exp(-((block.rim / 0.445) ** 1.85)) - 0.1 if block.rim else 1.0
    # three terms of its softening
    first, second, third = column * helped * (1.0 + 0.066 * block.round), 2.43 - 0.815 * flat, 6.25 + 2.54 * flat
    hardening, hardening_by = 0.125 / a * max(0.0, 1.0 - block.rim / 0.4), 40.0 * max(0.0, helped)
    of_film = film_hardening(block.skin_modulus) * film.rest

    def course(strain: Array) -> Array:
        """Force over area and shear strain where that is small, at compressions (n,), in shear moduli."""
        e = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        softened = 1.0 - first * e * (1.0 + second * e + third * e * e)
        if ogden is None:
            return np.asarray(stiffness * softened + film(e))
        linear = 0.31 * (ogden.skin_exponent - NEO_HOOKEAN)
        in_film = 1.0 - linear * e + 11.3 * ogden.film_hardening * e * e
        return np.asarray(stiffness * (softened + ogden.shear(e)) + film(e) * in_film)

    def cubic(strain: Array) -> Array:
        """Force over area and the cube of the shear strain, at compressions (n,), in shear moduli."""
        pressed = np.clip(strain, 0.0, MOST_STRAIN)
        found = hardening + hardening_by * pressed**3 + of_film * (1.0 + 4.0 * pressed)
        if ogden is None:
            return np.asarray(found)
        return np.asarray(found + stiffness * ogden.hardening + film.rest * ogden.film_hardening)

    return course, cubic


def tilt(block: Block) -> Callable[[Array], Array]:
    """The course of tilt by which the block's first axis is raised at one end and lowered at the other: moment over
    area, thickness and angle, in shear moduli, by compression (n,).

    At rest 3 mu I (1.13 + pressure), the pressure being that of an endless strip along either axis, summed as
    resistances: a^2 / 15 where it is short along the axis, b^2 / 3.6 where it is short across. The form is derived
    here, constants are fitted to our own finite elements (tests/validation/pad_figures.csv).
    """
    a, b, flat, oblong, ogden = block.along, block.across, block.flatness, block.oblongness, block.ogden
    moment = (4.0 - block.round) / 48.0 * a * a
    sheared = 1.1255 + 0.0254 * block.round - oblong * (0.470 if oblong < 0.0 else 0.189)
    pressure = (1.0 - 0.2 * block.round) / (15.0 / a**2 + 3.58 / b**2)
    stiffness = 3.0 * moment * (sheared + pressure) * rimmed(block, 0.637, 1.15, 0.35) * block.stiffer.tilt
    power = 3.10 * flat / (flat + 0.434) - 0.291 * oblong + 0.033 * block.round + 0.6 * math.expm1(-block.rim / 0.5)
    film = block.films[2]

    def course(strain: Array) -> Array:
        """Moment over area, thickness and angle at compressions (n,), in shear moduli."""
        e = np.clip(strain, LEAST_STRAIN, MOST_STRAIN)
        grown = (1.0 - e) ** -power * (1.0 + 0.844 * e - 1.407 * e * e)
        if ogden is None:
            return np.asarray(stiffness * grown + film(e))
        of_film = 1.0 + (2.8 * ogden.film_hardening + 5.9 * ogden.hardening) * e * e
        return np.asarray(stiffness * grown * ogden.tilt(e) + film(e) * of_film)

    return course


def twist(block: Block) -> float:
    """Moment over area, thickness and angle of a turn in the face's own plane, in shear moduli.

    Bonded faces do not warp: the polar moment of area of a flat pad, Saint-Venant's torsion constant of a tall one
    (textbook); between them by a plain weight. Not held against finite elements.
    """
    a, b = block.along, block.across
    polar = (4.0 - block.round) / 48.0 * (a * a + b * b)
    warped = pressure_stiffness(block) / 3.0
    flat = 1.0 / (1.0 + 1.0 / block.shape_factor**2)
    # the walls' shear stiffness along either axis, half a width away
    film = 0.25 * (a * a * block.turned.films[1].rest + b * b * block.films[1].rest)
    return (warped + (polar - warped) * flat) * rimmed(block, 1.19, 1.2, 1.4) * block.stiffer.twist + film
