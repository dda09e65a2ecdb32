"""What a film round pad and target adds to a pad: a wall that bears, hinders the bulging and, thin and stiff, buckles.

A wall of thickness t and modulus m (of the pad's) bears like t m times the length of its foot; what that leaves open
goes smoothly with the logarithms of m, t and the shape factor. The terms are data, `sitscad/data/pad_films.csv`, fitted
by tests/validation/fit_films.py to finite elements of films (tests/validation/pad_figures.csv) and, for a film of the
pad's own rubber, to the wider pad that it is. Lengths in thicknesses, stresses in shear moduli.
"""

from __future__ import annotations

import csv
import math
from functools import cache
from pathlib import Path

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record, replace

DATA = Path(__file__).parents[1] / "data" / "pad_films.csv"
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
    with DATA.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            values = tuple(float(row[name]) for name in ("rest", "quick", "first", "second", "third"))
            found[row["course"]][row["term"]] = values
    return found


def _within(value: float, bounds: tuple[float, float]) -> float:
    """A value between bounds, in its unit: beyond them the fit is held."""
    return min(max(value, bounds[0]), bounds[1])
