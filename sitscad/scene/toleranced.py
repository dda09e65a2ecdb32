"""Lengths with their tolerances: what is written, and by how much each cause may change it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sitscad.record import record


@record
class Toleranced:
    """A length (m) that several independent causes change: the nominal one, and by how much each cause may add to it
    or take away (m, signed, so that one cause in two lengths is not counted twice where they are subtracted).
    """

    nominal: float
    terms: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, nominal: float, tolerance: float, cause: str) -> Toleranced:
        """A length with one cause, plus or minus `tolerance` (m)."""
        return cls(nominal, ((cause, tolerance),) if tolerance else ())

    def __add__(self, other: Toleranced) -> Toleranced:
        """Both, one after the other."""
        found = dict(self.terms)
        for cause, change in other.terms:
            found[cause] = found.get(cause, 0.0) + change
        return Toleranced(self.nominal + other.nominal, tuple(found.items()))

    def __mul__(self, factor: float) -> Toleranced:
        """So many times as long."""
        return Toleranced(factor * self.nominal, tuple((cause, factor * change) for cause, change in self.terms))

    def __sub__(self, other: Toleranced) -> Toleranced:
        """From the end of one to the end of the other."""
        return self + other * -1.0

    @property
    def spread(self) -> float:
        """The farthest (m) that all causes together take it from nominal."""
        return math.fsum(abs(change) for _, change in self.terms)

    @property
    def root_sum_square(self) -> float:
        """How far (m) independent causes take it from nominal by the square root of the sum of squares."""
        return math.hypot(*(change for _, change in self.terms))


def total(lengths: Iterable[Toleranced]) -> Toleranced:
    """All of them, one after the other."""
    found = Toleranced(0.0)
    for length in lengths:
        found = found + length
    return found


@record
class Reach:
    """How far (m) a rounded corner reaches from an axis: nominal, by root-sum-square, and at worst."""

    nominal: float
    root_sum_square: float
    worst: float


def reach(y: Toleranced, z: Toleranced, rounding: Toleranced) -> Reach:
    """How far the corner at (y, z), rounded about that point, reaches from the origin (m).

    At worst it is the farthest corner of the box of all tolerances, which is exact where no cause moves it both ways;
    by root-sum-square, the distance's derivatives by every cause are taken at nominal (first order).
    """
    distance = math.hypot(y.nominal, z.nominal)
    cosine, sine = (y.nominal / distance, z.nominal / distance) if distance else (0.0, 1.0)
    radius = distance + rounding.nominal
    moved = y * cosine + z * sine + rounding
    worst = math.hypot(abs(y.nominal) + y.spread, abs(z.nominal) + z.spread) + rounding.nominal + rounding.spread
    return Reach(radius, radius + moved.root_sum_square, worst)
