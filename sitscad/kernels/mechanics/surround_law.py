"""Contributions of a film and of webs to a pad's stiffness.

A film of thickness t and relative modulus m covers the sides of pad and target like a wall. Its force is proportional
to t m and to the perimeter of the face. It hinders the bulging of the pad, and buckles if it is thin and stiff. The
remaining factors are smooth functions of the logarithms of m, t and the shape factor. Their terms are in
`sitscad/data/pad_films.csv`. They were fitted by tests/validation/fit_films.py to finite elements of films
(tests/validation/pad_figures.csv). A film of the pad's own rubber counts as a wider pad in this fit.

Webs are strips of the pad's own rubber and thickness that join a pad to its neighbours. A web hinders the bulging of
its side, and is pulled and sheared itself. Its effect is proportional to its width, and independent of its length if it
is long. Constants are fitted to finite elements of pads with one web at small strain
(tests/validation/web_figures.csv). Effects of several webs are added.

The shape factor is the loaded area divided by the free side area. Lengths are divided by the pad's thickness and
stresses by its shear modulus. Contributions of webs are divided by the stiffness of the bare pad.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.data import rows

COURSES = ("press", "shear", "tilt")
"""Names of the three stiffness curves of a film: compression, shear along an axis, tilt of this axis."""
MODULI, SKINS, SHAPES = (1.0, 40.0), (0.03, 0.4), (0.35, 1.6)
"""Ranges (lowest, highest) of film and face in which the contribution of a film is fitted. Values outside are clipped.

`MODULI` are shear moduli of the film divided by the pad's, `SKINS` film thicknesses divided by the pad's thickness, and
`SHAPES` shape factors of the face.
"""

MOST = 0.35  # Strain from which on a film's share stays as it is
GRID = np.linspace(0.0, MOST, 351)  # Strains at which the least share of a film is worked out


@record
class Film:
    """Contribution of a film to one stiffness of a pad, divided by the pad's shear modulus.

    `rest` is the contribution at zero strain. The relative contribution is the contribution divided by `rest`. `course`
    holds the four coefficients of its change with strain (`_relative_contribution`). `pulled` is its slope for a small
    tension, which occurs if shear lowers the target. `floor` is its least value at evenly spaced strains from 0 to
    `MOST`, so that the force in the film never decreases with strain. `floor` is empty if there is no limit.
    """

    rest: float = 0.0
    course: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    pulled: float = 0.0
    floor: tuple[float, ...] = ()

    def __call__(self, strain: Array) -> Array:
        """Return the contribution (n; divided by the pad's shear modulus) at compressive strains (n).

        It is linear in small tension.
        """
        if not self.rest:
            return np.zeros_like(strain)
        e = np.minimum(np.maximum(strain, 0.0), MOST)
        share = _relative_contribution(self.course, e) + np.minimum(np.maximum(strain, LEAST_PULL), 0.0) * self.pulled
        if self.floor:
            share = np.maximum(share, np.interp(e, GRID, self.floor))
        return np.asarray(self.rest * share)

    def at(self, strain: float) -> float:
        """Return the contribution at one compressive strain, divided by the pad's shear modulus, as `__call__`."""
        if not self.rest:
            return 0.0
        e = min(max(strain, 0.0), MOST)
        quick, linear, square, cubic = self.course
        share = 1.0 - quick * math.expm1(-e / QUICK) + e * (linear + e * (square + e * cubic))
        if strain < 0.0:
            share += max(strain, LEAST_PULL) * self.pulled
        if self.floor:
            place = e / MOST * (len(self.floor) - 1)
            k = min(int(place), len(self.floor) - 2)
            share = max(share, self.floor[k] + (place - k) * (self.floor[k + 1] - self.floor[k]))
        return self.rest * share


def _relative_contribution(coefficients: tuple[float, float, float, float], e: Array) -> Array:
    """Return the contribution of a film at compressive strains e (n), divided by the contribution at rest.

    It is 1 - q (exp(-e / `QUICK`) - 1) + l e + s e^2 + c e^3, with the fitted `coefficients` (q, l, s, c).
    """
    quick, linear, square, cubic = coefficients
    return np.asarray(1.0 - quick * np.expm1(-e / QUICK) + e * (linear + e * (square + e * cubic)))


QUICK = 0.06  # Strain within which a thin film buckles
LEAST_PULL = -0.05  # Strain of a pull from which on a film's share stays as it is


def film_hardening(modulus: float) -> float:
    """Return the cubic coefficient of a film's shear force, divided by the film's shear stiffness at rest (no unit).

    It is 0.35 ln m for a relative modulus m, within 25 % of our own finite elements at a shear strain of 0.4. It is 0
    for a film of the pad's own rubber.
    """
    return 0.35 * math.log(_clip(modulus, MODULI))


def wall_stiffness(length: float, width: float, shape: float, film: float) -> dict[str, float]:
    """Return the stiffness contributions of an unbuckled wall round a face, by name (textbook).

    They are divided by the pad's shear modulus. `length` and `width` are the face's, divided by the thickness; `shape`
    is its shape factor. `film` is the wall's relative thickness times its relative modulus. "press" is the wall's
    compression stiffness divided by the area of the face. "shear" is the stiffness of the two walls along the force,
    and "tilt" the bending stiffness of all four walls.
    """
    return {
        "press": film / shape,
        "shear": 2.0 * film / width,
        "tilt": film * (1.0 + length / (3.0 * width)) * length / 2.0,
    }


def correction_terms(skin: float, modulus: float, shape: float, oblong: float, circular: float) -> dict[str, float]:
    """Return the values of the terms in the fitted corrections of `wall_stiffness`, by their names in the data file.

    Names are products of u, v and s, and of o (`oblong`) and r (`circular`). u, v and s are scaled logarithms of
    modulus, film thickness and shape factor. `skin` is the thickness of the film divided by the pad's, `modulus` its
    relative modulus. `oblong` and `circular` are explained in `film_contributions`.
    """
    u = 0.5 * math.log(_clip(modulus, MODULI) / 10.0)
    v = math.log(_clip(skin, SKINS) / 0.1)
    s = math.log(_clip(shape, SHAPES) / 0.7)
    return {
        "1": 1.0,
        "u": u,
        "v": v,
        "s": s,
        "uu": u * u,
        "vv": v * v,
        "ss": s * s,
        "uv": u * v,
        "us": u * s,
        "vs": v * s,
        "uus": u * u * s,
        "uvs": u * v * s,
        "o": oblong,
        "oo": oblong * oblong,
        "r": circular,
    }


def film_contributions(
    length: float, width: float, shape: float, oblong: float, circular: float, skin: float, modulus: float, faded: float
) -> tuple[Film, Film, Film]:
    """Return the contributions of a film to compression, to shear along the first axis, and to tilt of this axis.

    They are stiffnesses divided by the area of the face and the pad's shear modulus. Each is `wall_stiffness` times the
    exponential of a sum of `correction_terms` with fitted coefficients.

    Parameters
    ----------
    length, width, shape : float
        lengths of the face along and across the first axis (divided by the pad's thickness), and its shape factor
    oblong : float
        (length - width) / (length + width)
    circular : float
        0 for a rectangle, 1 for an ellipse
    skin, modulus : float
        thickness of the film (divided by the pad's) and its relative shear modulus
    faded : float
        factor by which a rim between film and face reduces the contribution: 1 without a rim
    """
    if not skin * modulus:
        return Film(), Film(), Film()
    plain, parts = wall_stiffness(length, width, shape, skin * modulus), correction_terms(skin, modulus, shape, oblong,
                                                                                          circular)
    fitted = (np.array([*parts.values()]) @ _fitted_coefficients(tuple(parts))).tolist()
    pulled = {"press": 0.0, "tilt": 0.0, "shear": -2.4 * max(0.0, 1.0 - max(shape, 0.5))}
    film_by_course = {}
    for name, (rest, quick, linear, square, cubic) in zip(COURSES, fitted, strict=True):
        film_by_course[name] = Film(faded * plain[name] * math.exp(rest), (quick, linear, square, cubic), pulled[name])
    # the least shares at `GRID` with which force, share times Lindley's strain, never falls
    remaining = 1.0 - GRID[1:]
    strain = (remaining**-2 - remaining) / 3.0
    most = np.maximum.accumulate(_relative_contribution(film_by_course["press"].course, GRID[1:]) * strain)
    floor = (1.0, *(most / strain).tolist())
    return replace(film_by_course["press"], floor=floor), film_by_course["shear"], film_by_course["tilt"]


@cache
def _fitted_coefficients(names: tuple[str, ...]) -> Array:
    """Return the fitted coefficients of the named terms (curves, terms, 5). The order of the curves is `COURSES`."""
    return np.array([[coefficient_table()[motion].get(name, (0.0,) * 5) for name in names] for motion in COURSES])


@cache
def coefficient_table() -> dict[str, dict[str, tuple[float, ...]]]:
    """Return the five fitted coefficients of each term, by curve (`COURSES`) and name of the term.

    The first belongs to the logarithm of the contribution at rest. The others belong to its change with strain
    (`_relative_contribution`).
    """
    terms_by_course: dict[str, dict[str, tuple[float, ...]]] = {name: {} for name in COURSES}
    for row in rows("pad_films"):
        values = tuple(float(row[name]) for name in ("rest", "quick", "first", "second", "third"))
        terms_by_course[row["course"]][row["term"]] = values
    return terms_by_course


def _clip(value: float, bounds: tuple[float, float]) -> float:
    """Return a value, limited to the range from `bounds[0]` to `bounds[1]`."""
    return min(max(value, bounds[0]), bounds[1])


WEB_SIGMA = 0.2
"""Standard deviation of the contribution of webs to a pad's force, divided by this contribution.

At small strain the law is within 15 % of finite elements. For a neo-Hookean square, the contribution at 10 %
compression differs by less than 2 % from the contribution at rest. It is assumed to be constant at larger strain.
"""


@record
class Webs:
    """Webs (strips of the pad's rubber) at the sides of a pad, all of one `width`, which is divided by the thickness.

    `left`, `right`, `front` and `back` are the sides -x, +x, -y and +y. Each value is `web_effect` of the web at this
    side, or 0 without a web.
    """

    width: float = 0.0
    left: float = 0.0
    right: float = 0.0
    front: float = 0.0
    back: float = 0.0

    @property
    def turned(self) -> Webs:
        """Webs with x and y exchanged."""
        return Webs(self.width, self.front, self.back, self.left, self.right)


NO_WEBS = Webs()
"""A pad without webs."""


@record
class WebFactors:
    """Factors by which webs increase the stiffness of a pad: 1 without webs.

    `press` is for compression, `shear` and `tilt` for shear and tilt along the first axis, and `twist` for rotation in
    the plane of the pad. `pressure_centre` is the displacement of the centre of pressure along the first axis, divided
    by the thickness.
    """

    press: float = 1.0
    shear: float = 1.0
    tilt: float = 1.0
    twist: float = 1.0
    pressure_centre: float = 0.0


def web_effect(length: float) -> float:
    """Return the effect of a web, divided by the effect of a long web. `length` is divided by the thickness.

    It is larger for a short web, because the neighbouring target holds the web's other end. The formula is fitted to
    our own finite elements (tests/validation/web_figures.csv).
    """
    return 1.0 + 1.1 * math.exp(-length / 0.6)


def web_factors(length: float, width: float, rim: float, webs: Webs) -> WebFactors:
    """Return the factors of webs on the stiffness of a rectangular pad with a rim of equal width on all sides.

    `length` and `width` are the lengths of the face along and across the first axis, `rim` the width of the rim. All
    are divided by the thickness.

    The form is derived here and the constants are fitted to our own finite elements (tests/validation/web_figures.csv):
    `press` for the hindered bulging, `shear` for pull and shear of the webs, `tilt` and `twist` for their levers.
    """
    if not webs.width:
        return WebFactors()
    length, width = length + 2.0 * rim, width + 2.0 * rim
    # parts of the sides' lengths, both sides together: held by webs along the first axis, and by those across it
    ends, sides = (webs.left + webs.right) * webs.width / width, (webs.front + webs.back) * webs.width / length
    shape, oblong, fades = 0.5 * length * width / (length + width), (length / width) ** 1.6, math.exp(-rim / 0.6)
    pressed = 0.4 * fades / (1.0 + (shape / 2.5) ** 1.6) / (1.0 + oblong)
    at_ends = pressed * (1.0 - 0.27 * (webs.width / width) ** 4)
    at_sides = pressed * oblong * (1.0 - 0.27 * (webs.width / length) ** 4)
    press = 1.0 + at_ends * ends + at_sides * sides
    pulled, sheared = 1.06 * math.exp(-rim / 2.0), 0.48 * fades * -math.expm1(-1.55 * webs.width)
    raised = 0.27 * fades / (1.0 + 0.1 * shape**1.5) * (width / length) ** (0.15 if length < width else 0.56)
    leant = 0.095 * fades * shape**-0.5 * (length / width) ** 0.8 * webs.width / length
    lever = 0.265 * length * (length / width) ** 0.35
    return WebFactors(
        press,
        1.0 + pulled * ends / length + sheared * sides / width,
        1.0 + raised * ends + leant * sides,
        1.0 + 4.0 * sheared * (length * ends + width * sides) / (length**2 + width**2),
        lever * at_ends * (webs.right - webs.left) * webs.width / width / press,
    )
