"""The forms that a map may have, how one is fitted, and which serves sensors of a design best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array
from sitscad.calibration.inverse_map import BEYOND, changes, terms
from sitscad.physics.polynomials import Exponents, exponents, monomials
from sitscad.record import record

SMALL = 1e-10
"""Share of the largest singular value below which terms of a map count as one."""

LEAST_DENOMINATOR, PLACES = 0.2, 9
"""What a rational map's denominator is at least wherever the map says that it holds, also between the samples, where a
pole may hide; and at how many places along every axis that is looked at."""

ROUNDS = 5
"""Rounds by which a rational map is fitted, each with the denominator of the one before as weight (Sanathanan and
Koerner, IEEE Trans. Automatic Control 8, 1963)."""

ALIKE, UNSEEN = 1.1, 0.003
"""Of two forms whose errors differ by less, the one with fewer coefficients is taken; an error (of full scale) that no
bench tells counts for nothing."""


@record
class Form:
    """What a map is made of: its name, whether logarithms are taken, its degree, that of its denominator, the knots of
    a spline in the normal force (of full scale), and the degree in what multiplies them.
    """

    name: str
    logarithmic: bool
    degree: int
    below: int = 0
    knots: tuple[float, ...] = ()
    beside: int = 0


FORMS = (
    *(Form(f"polynomial of degree {k} in ln(1 - L/L0)", True, k) for k in (1, 2, 3, 4, 5)),
    *(Form(f"polynomial of degree {k} in L", False, k) for k in (1, 2, 3, 4, 5)),
    *(Form(f"rational, {k} over {j}, in ln(1 - L/L0)", True, k, j)
      for k, j in ((1, 1), (2, 1), (2, 2), (3, 1), (3, 2))),
    *(Form(f"cubic spline with {len(knots)} knots in ln(1 - L/L0)", True, 3, 0, knots, 2)
      for knots in ((0.5,), (0.33, 0.67), (0.25, 0.5, 0.75))),
)
"""What is tried for every design."""


@record(eq=False)
class Samples:
    """Readings and forces of one sensor: (n, coils) over their tare (coils), and (n, axes) in full scales."""

    readings: Array
    rest: Array
    forces: Array


@record(eq=False)
class Shape:
    """A form fitted to samples: the arrays of an `InverseMap`; `size` counts its coefficients."""

    form: Form
    mix: Array
    powers: Exponents
    spline_powers: Exponents
    denominator_powers: Exponents
    numerator: Array
    denominator: Array
    low: Array
    high: Array

    @property
    def size(self) -> int:
        """How many coefficients it has."""
        return self.numerator.size + self.denominator.size

    def forces(self, samples: Samples, gain: Array) -> Array:
        """Forces (n, axes; full scales) by the map."""
        mixed = changes(samples.readings, samples.rest, gain, self.form.logarithmic) @ self.mix.T
        top = terms(mixed, self.powers, np.array(self.form.knots), self.spline_powers) @ self.numerator.T
        return np.asarray(top / (1.0 + monomials(mixed, self.denominator_powers) @ self.denominator.T))


def fitted(form: Form, samples: Samples, gain: Array, noise: Array) -> Shape | None:
    """A form fitted to samples; `noise` (coils) is one sigma of a reading, relative. None where its denominator comes
    near nothing.
    """
    seen = changes(samples.readings, samples.rest, gain, form.logarithmic)
    mix = linear(seen, samples.forces, 2.0 * noise * (gain if form.logarithmic else 1.0))
    mixed, axes = seen @ mix.T, len(mix)
    ones = [1.0] * axes
    powers, beside = exponents(ones, form.degree, 1), exponents(ones, form.beside if form.knots else -1.0)
    columns = terms(mixed, powers, np.array(form.knots), beside)
    below = exponents(ones, form.below, 1)
    numerator, denominator = _coefficients(columns, monomials(mixed, below), samples.forces)
    low, high = mixed.min(axis=0), mixed.max(axis=0)
    if below.size and _least_denominator(low, high, below, denominator) < LEAST_DENOMINATOR:
        return None
    return Shape(form, mix, powers, beside, below, numerator, denominator, low, high)


def _least_denominator(low: Array, high: Array, below: Exponents, denominator: Array) -> float:
    """The least denominator of any axis in the box that readings may lie in, and a little beyond."""
    ends = [np.linspace(a - BEYOND, b + BEYOND, PLACES) for a, b in zip(low, high, strict=True)]
    box = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, len(ends))
    return float((1.0 + monomials(box, below) @ denominator.T).min())


def linear(seen: Array, forces: Array, noise: Array) -> Array:
    """The straight map (axes, coils) that takes what coils give (n, coils), each with so much noise, to forces."""
    square = seen.T @ seen + len(seen) * np.diag(noise**2)
    return np.asarray(np.linalg.solve(square, seen.T @ forces).T)


def _coefficients(columns: Array, below: Array, forces: Array) -> tuple[Array, Array]:
    """Numerator (axes, terms) and denominator (axes, terms) of a map's axes, by least squares."""
    top, bottom = [], []
    for wanted in forces.T:
        weight = np.ones(len(wanted))
        for _ in range(ROUNDS if below.shape[1] else 1):
            both = np.hstack([columns, -wanted[:, None] * below]) / weight[:, None]
            found = np.linalg.lstsq(both, wanted / weight, rcond=SMALL)[0]
            weight = np.maximum(1.0 + below @ found[columns.shape[1] :], LEAST_DENOMINATOR)
        top.append(found[: columns.shape[1]])
        bottom.append(found[columns.shape[1] :])
    return np.array(top), np.array(bottom).reshape(len(top), -1)


@record
class Tried:
    """A form and the error (rms over axes, full scales) that it leaves of samples that it was not fitted to; infinite
    where it cannot be fitted.
    """

    form: Form
    error: float
    size: int


def compared(parts: Sequence[tuple[Samples, Samples]], gain: Array, noise: Array) -> tuple[Tried, ...]:
    """Every form's error over sensors: fitted to the one samples of each, tried on the others."""
    found = []
    for form in FORMS:
        square, size = [], 0
        for learnt, asked in parts:
            shape = fitted(form, learnt, gain, noise) if _has_enough(form, learnt) else None
            left = np.inf if shape is None else float(np.mean((shape.forces(asked, gain) - asked.forces) ** 2))
            square.append(left)
            size = 0 if shape is None else shape.size
        found.append(Tried(form, float(np.sqrt(np.mean(square))), size))
    return tuple(found)


def _has_enough(form: Form, samples: Samples) -> bool:
    """Whether there are half as many more samples as terms."""
    ones = [1.0] * samples.forces.shape[1]
    spline = len(form.knots) * len(exponents(ones, form.beside)) if form.knots else 0
    wanted = len(exponents(ones, form.degree, 1)) + len(exponents(ones, form.below, 1)) + spline
    return len(samples.forces) >= 1.5 * wanted


def best(tried: Sequence[Tried]) -> Tried:
    """The form with the fewest coefficients of those that are about as good as the best."""
    least = min(np.hypot(one.error, UNSEEN) for one in tried)
    alike = (one for one in tried if np.hypot(one.error, UNSEEN) <= ALIKE * least)
    return min(alike, key=lambda one: (one.size, one.error))
