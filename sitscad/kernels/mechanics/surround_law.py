"""What surrounds a pad adds to its stiffness: a film round pad and target, and webs to its neighbours.

A film of thickness t and modulus m (of the pad's) is a wall that bears like t m times the length of its foot, hinders
the bulging and, thin and stiff, buckles; what that leaves open goes smoothly with the logarithms of m, t and the shape
factor. The terms are data, `sitscad/data/pad_films.csv`, fitted by tests/validation/fit_films.py to finite elements of
films (tests/validation/pad_figures.csv) and, for a film of the pad's own rubber, to the wider pad that it is.

Webs are strips of the pad's own rubber, as thick as it, from its sides to its neighbours'. A web hinders the bulging of
the side that it holds, and is itself pulled and sheared. That goes with its width, and of a long one not with its
length. Constants are fitted to finite elements at small strain of pads with one web
(tests/validation/web_figures.csv); several add up.

Lengths in thicknesses, stresses in shear moduli; what webs add is in parts of the bare pad's own.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.data import rows

COURSES = ("press", "shear", "tilt")
MODULI, SKINS, SHAPES = (1.0, 40.0), (0.03, 0.4), (0.35, 1.6)
"""Ratios of moduli, thicknesses of the film and shape factors between which the fit was made; held beyond."""

MOST = 0.35  # Strain from which on a film's share stays as it is
GRID = np.linspace(0.0, MOST, 351)  # Strains at which the least share of a film is worked out


@record
class Film:
    """What a film adds to a stiffness (in shear moduli): `rest` at rest, and its `course` by strain (no unit); `pulled`
    is the slope of a small pull, which a pad that shear draws down feels. `floor` is the least share at even strains
    from 0 to `MOST`: what a film bears never falls. Fitted, see the module.
    """

    rest: float = 0.0
    course: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    pulled: float = 0.0
    floor: tuple[float, ...] = ()

    def __call__(self, strain: Array) -> Array:
        """The addition at strains (n,), in shear moduli; of a pull it goes straight on for a little."""
        if not self.rest:
            return np.zeros_like(strain)
        e = np.minimum(np.maximum(strain, 0.0), MOST)
        share = _shares(self.course, e) + np.minimum(np.maximum(strain, LEAST_PULL), 0.0) * self.pulled
        if self.floor:
            share = np.maximum(share, np.interp(e, GRID, self.floor))
        return np.asarray(self.rest * share)

    def at(self, strain: float) -> float:
        """The addition at one strain, in shear moduli, as `__call__` has it."""
        if not self.rest:
            return 0.0
        e = min(max(strain, 0.0), MOST)
        quick, one, two, three = self.course
        share = 1.0 - quick * math.expm1(-e / QUICK) + e * (one + e * (two + e * three))
        if strain < 0.0:
            share += max(strain, LEAST_PULL) * self.pulled
        if self.floor:
            place = e / MOST * (len(self.floor) - 1)
            k = min(int(place), len(self.floor) - 2)
            share = max(share, self.floor[k] + (place - k) * (self.floor[k + 1] - self.floor[k]))
        return self.rest * share


def _shares(course: tuple[float, float, float, float], e: Array) -> Array:
    """What is left at strains (n,) of what a film bears at rest, as fitted: 1 - q (exp(-e / QUICK) - 1) and a cubic; no
    unit.
    """
    quick, one, two, three = course
    return np.asarray(1.0 - quick * np.expm1(-e / QUICK) + e * (one + e * (two + e * three)))


QUICK = 0.06  # Strain within which a thin film buckles
LEAST_PULL = -0.05  # Strain of a pull from which on a film's share stays as it is


def film_hardening(modulus: float) -> float:
    """How a film's shear force grows with the cube of the shear strain, over its stiffness at rest (no unit): 0.35 ln m
    for a ratio of moduli m, read from our own finite elements' poses at a shear of 0.4 within 25 %; a film of the pad's
    own rubber has none of its own.
    """
    return 0.35 * math.log(_within(modulus, MODULI))


def units(along: float, across: float, shape: float, film: float) -> dict[str, float]:
    """Plain statics (textbook) of a wall of `film` = t m (thicknesses times moduli) round a face: its bearing over the
    face's area, the shear of the two walls along the force, and the second moment of all four; in shear moduli.
    """
    return {
        "press": film / shape,
        "shear": 2.0 * film / across,
        "tilt": film * (1.0 + along / (3.0 * across)) * along / 2.0,
    }


def terms(skin: float, modulus: float, shape: float, oblong: float, circular: float) -> dict[str, float]:
    """What the factors on `units` are sums of, by name: no unit. `skin` in thicknesses, `modulus` in the pad's."""
    u = 0.5 * math.log(_within(modulus, MODULI) / 10.0)
    v = math.log(_within(skin, SKINS) / 0.1)
    s = math.log(_within(shape, SHAPES) / 0.7)
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


def films(
    along: float, across: float, shape: float, oblong: float, circular: float, skin: float, modulus: float, faded: float
) -> tuple[Film, Film, Film]:
    """What a film adds to the pressure, to shear along the first axis and to tilt of it: all over the face's area, in
    shear moduli. `units` times the exponential of the fitted sum of `terms`.

    `skin` is its thickness (thicknesses of the pad) and `modulus` its shear modulus over the pad's, `oblong` from -1,
    all across, to 1, all along, `circular` 1 for an ellipse, `faded` what is left of it beyond a rim.
    """
    if not skin * modulus:
        return Film(), Film(), Film()
    plain, parts = units(along, across, shape, skin * modulus), terms(skin, modulus, shape, oblong, circular)
    fitted = (np.array([*parts.values()]) @ _rows(tuple(parts))).tolist()
    pulled = {"press": 0.0, "tilt": 0.0, "shear": -2.4 * max(0.0, 1.0 - max(shape, 0.5))}
    found = {}
    for name, (rest, quick, one, two, three) in zip(COURSES, fitted, strict=True):
        found[name] = Film(faded * plain[name] * math.exp(rest), (quick, one, two, three), pulled[name])
    # the least shares at `GRID` with which force, share times Lindley's strain, never falls
    left = 1.0 - GRID[1:]
    strain = (left**-2 - left) / 3.0
    most = np.maximum.accumulate(_shares(found["press"].course, GRID[1:]) * strain)
    floor = (1.0, *(most / strain).tolist())
    return replace(found["press"], floor=floor), found["shear"], found["tilt"]


@cache
def _rows(names: tuple[str, ...]) -> Array:
    """The rows of `table` of these terms as one array: (courses, terms, 5), no unit."""
    return np.array([[table()[course].get(name, (0.0,) * 5) for name in names] for course in COURSES])


@cache
def table() -> dict[str, dict[str, tuple[float, ...]]]:
    """Coefficients by course and term, no unit: of the logarithm at rest, and of the four parts of the course by
    strain.
    """
    found: dict[str, dict[str, tuple[float, ...]]] = {name: {} for name in COURSES}
    for row in rows("pad_films"):
        values = tuple(float(row[name]) for name in ("rest", "quick", "first", "second", "third"))
        found[row["course"]][row["term"]] = values
    return found


def _within(value: float, bounds: tuple[float, float]) -> float:
    """A value between bounds, in its unit: beyond them the fit is held."""
    return min(max(value, bounds[0]), bounds[1])


WEB_SIGMA = 0.2
"""One sigma, relative, of what webs add to a pad's force. At rest the law is within 15 % of the elements; pressed by a
tenth, a neo-Hookean square owes its webs the same within 2 %, and what it owes them beyond is taken to stay so."""


@record
class Webs:
    """Webs of one width (thicknesses) at the sides -x, +x, -y and +y of a pad: what `grip` says of each (no unit), or
    0.
    """

    width: float = 0.0
    left: float = 0.0
    right: float = 0.0
    front: float = 0.0
    back: float = 0.0

    @property
    def turned(self) -> Webs:
        """The webs looked at along the other axis (width in thicknesses): those at -y and +y are the first."""
        return Webs(self.width, self.front, self.back, self.left, self.right)


NO_WEBS = Webs()


@record
class Stiffer:
    """Factors on a bare pad's stiffness: of pressure, of shear along its first axis, of tilt that raises the ends of
    this, and of twist; no unit. `aside` is how far (thicknesses) its centre of pressure moves along that axis.
    """

    press: float = 1.0
    shear: float = 1.0
    tilt: float = 1.0
    twist: float = 1.0
    aside: float = 0.0


def grip(length: float) -> float:
    """How much (no unit) a web of a length (thicknesses) holds in comparison with a long one: the pad at its other end
    is bonded to a target, too, and near it holds the web. Fitted to our own finite elements
    (tests/validation/web_figures.csv).
    """
    return 1.0 + 1.1 * math.exp(-length / 0.6)


def stiffened(along: float, across: float, rim: float, webs: Webs) -> Stiffer:
    """What webs make of the stiffness (`Stiffer`, no unit) of a loaded rectangle, beyond which its pad reaches by a rim
    on all sides; lengths in thicknesses. Its form is from here and its constants are fitted to our own finite elements
    (tests/validation/web_figures.csv): `press` for the hindered bulging, `shear` for pull and shear of the webs, `tilt`
    and `twist` for their levers.
    """
    if not webs.width:
        return Stiffer()
    along, across = along + 2.0 * rim, across + 2.0 * rim
    # parts of the sides' lengths, both sides together: held by webs along the first axis, and by those across it
    ends, sides = (webs.left + webs.right) * webs.width / across, (webs.front + webs.back) * webs.width / along
    shape, oblong, fades = 0.5 * along * across / (along + across), (along / across) ** 1.6, math.exp(-rim / 0.6)
    pressed = 0.4 * fades / (1.0 + (shape / 2.5) ** 1.6) / (1.0 + oblong)
    at_ends = pressed * (1.0 - 0.27 * (webs.width / across) ** 4)
    at_sides = pressed * oblong * (1.0 - 0.27 * (webs.width / along) ** 4)
    press = 1.0 + at_ends * ends + at_sides * sides
    pulled, sheared = 1.06 * math.exp(-rim / 2.0), 0.48 * fades * -math.expm1(-1.55 * webs.width)
    raised = 0.27 * fades / (1.0 + 0.1 * shape**1.5) * (across / along) ** (0.15 if along < across else 0.56)
    leant = 0.095 * fades * shape**-0.5 * (along / across) ** 0.8 * webs.width / along
    lever = 0.265 * along * (along / across) ** 0.35
    return Stiffer(
        press,
        1.0 + pulled * ends / along + sheared * sides / across,
        1.0 + raised * ends + leant * sides,
        1.0 + 4.0 * sheared * (along * ends + across * sides) / (along**2 + across**2),
        lever * at_ends * (webs.right - webs.left) * webs.width / across / press,
    )
