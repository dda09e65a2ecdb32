"""The forms that a map may have, how one is fitted, and which serves sensors of a design best; the maps of a sensor as
it is drawn, and of one whose errors were found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.arrays import Array
from sitscad.calibration.inverse_map import BEYOND, InverseMap, MapForm, changes, terms
from sitscad.calibration.model_fit import ModelFit
from sitscad.calibration.points import load_slopes, unknown_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import stratified, units
from sitscad.physics.polynomials import POINTS_A_TERM, exponents, monomials
from sitscad.record import record

SMALL = 1e-10  # Share of the largest singular value below which terms of a map count as one

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


def fitted_form(form: Form, samples: Samples, gain: Array, noise: Array) -> MapForm | None:
    """A form fitted to samples; `noise` (coils), one sigma, relative. None where samples are too few for its terms, or
    where its denominator comes near nothing.
    """
    seen = changes(samples.readings, samples.rest, gain, form.logarithmic)
    mix = linear(seen, samples.forces, 2.0 * noise * (gain if form.logarithmic else 1.0))
    mixed, axes = seen @ mix.T, len(mix)
    ones = [1.0] * axes
    powers, beside = exponents(ones, form.degree, 1), exponents(ones, form.beside if form.knots else -1.0)
    below, knots = exponents(ones, form.below, 1), np.array(form.knots)
    columns = terms(mixed, powers, knots, beside)
    if len(columns) < POINTS_A_TERM * (columns.shape[1] + len(below)):
        return None
    numerator, denominator = _coefficients(columns, monomials(mixed, below), samples.forces)
    low, high = mixed.min(axis=0), mixed.max(axis=0)
    if below.size:  # the least denominator of any axis in the box that readings may lie in, and a little beyond
        ends = [np.linspace(a - BEYOND, b + BEYOND, PLACES) for a, b in zip(low, high, strict=True)]
        box = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, len(ends))
        if float((1.0 + monomials(box, below) @ denominator.T).min()) < LEAST_DENOMINATOR:
            return None
    return MapForm(gain, form.logarithmic, mix, powers, numerator, denominator, below, low, high, knots, beside)


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
    """A form and the error (rms, full scales) on samples it was not fitted to; infinite where it cannot be fitted."""

    form: Form
    error: float
    size: int


def compared(parts: Sequence[tuple[Samples, Samples]], gain: Array, noise: Array) -> tuple[Tried, ...]:
    """Every form's error over sensors: fitted to the one samples of each, tried on the others."""
    found = []
    for form in FORMS:
        square, size = [], 0
        for learnt, asked in parts:
            shape = fitted_form(form, learnt, gain, noise)
            if shape is None:
                square.append(np.inf)
                size = 0
                continue
            top, bottom = shape.quotient(shape.mixed(asked.readings, asked.rest))
            square.append(float(np.mean((top / bottom - asked.forces) ** 2)))
            size = shape.numerator.size + shape.denominator.size
        found.append(Tried(form, float(np.sqrt(np.mean(square))), size))
    return tuple(found)


def best(tried: Sequence[Tried]) -> Tried:
    """The form with the fewest coefficients of those that are about as good as the best."""
    least = min(np.hypot(one.error, UNSEEN) for one in tried)
    alike = (one for one in tried if np.hypot(one.error, UNSEEN) <= ALIKE * least)
    return min(alike, key=lambda one: (one.size, one.error))


LEARNT, ASKED = 240, 80  # Loads that a map is fitted to, and others on which it is tried
SENSORS, SEED = 6, 7  # Simulated sensors by which a form is chosen, and the seed of their errors

SCATTERED, SCATTER_SEED = 64, 8
"""Simulated sensors by which the error of the drawn sensor's map on others is found, and the seed of their errors."""

SOLVED, DEGREE = 40, 3  # Loads that are solved, not charted, for a sensor's own map, and the degree of what that adds

LEAST_LEFT = 0.05  # Least of 1 - leverage that a residual is divided by


def gain(sensors: Sensors) -> Array:
    """Inductance at rest over what the target takes off it, of the drawn sensor (coils), by frequencies."""
    rest = sensors.under(np.zeros(len(sensors.known)), np.zeros((1, 3)))[0]
    share = np.square(sensors.free_frequencies / rest)
    return np.asarray(share / (1.0 - share))


def samples(sensors: Sensors, errors: Array, loads: Array) -> Samples:
    """What one sensor reads under loads (n, 3 or 5; N, N m)."""
    frequency = sensors.under(errors, np.vstack([sensors.range.pressed(0.0), loads]))
    return Samples(frequency[1:], frequency[0], loads[:, sensors.range.columns] / sensors.range.full_scales)


def _learnt_and_asked(sensors: Sensors) -> tuple[Array, Array]:
    """The loads that a map is fitted to, those at the edge of the range among them, where a map would else end before
    the required load; and others on which it is tried.
    """
    scope = sensors.range
    return np.vstack([scope.inside(LEARNT), scope.rim]), scope.inside(ASKED, LEARNT)


def chosen_form(sensors: Sensors) -> tuple[Tried, tuple[Tried, ...]]:
    """The form that serves sensors with the scatter of manufacture best, each with a map of its own; and all tried."""
    generator, parts = np.random.default_rng(SEED), []
    for errors in units(sensors.known, SENSORS, SEED):
        learnt, asked = (samples(sensors, errors, each) for each in _learnt_and_asked(sensors))
        read = sensors.read(asked.readings, generator, 1)
        parts.append((learnt, Samples(read, asked.rest, asked.forces)))
    tried = compared(parts, gain(sensors), sensors.noise)
    return best(tried), tried


def error_on_others(sensors: Sensors, found: InverseMap) -> Array:
    """Errors (axes; N), rms, of a map on sensors as they are made, each after its own tare."""
    loads, square = sensors.range.inside(ASKED // 2, LEARNT), []
    for errors in stratified(sensors.known, SCATTERED, SCATTER_SEED):
        other = samples(sensors, errors, loads)
        square.append((found(other.readings, other.rest) / sensors.range.full_scales - other.forces) ** 2)
    return np.asarray(np.sqrt(np.mean(square, axis=(0, 1))) * sensors.range.full_scales)


def own_map(sensors: Sensors, form: Form, errors: Array) -> InverseMap:
    """The map of one sensor, by its `errors` (zeros: as it is drawn), to a chart that some loads solved for it set
    right; its error is what the form itself leaves of loads that it was not fitted to, the converter's noise in it,
    and what the chart is off by at those loads, each as if it had not set the chart right, where a chart that ends
    before this sensor does shows.
    """
    learnt, asked = _learnt_and_asked(sensors)
    loads, count = np.vstack([learnt, asked]), len(learnt)
    whole = samples(sensors, errors, loads)
    solved = sensors.under(errors, np.vstack([sensors.range.pressed(0.0), loads[:SOLVED]]), exact=True)
    right, left = _set_right(sensors, errors, loads, solved)
    readings = whole.readings * right
    found = _map(sensors, form, Samples(readings[:count], whole.rest, whole.forces[:count]), solved[0])
    noisy = sensors.read(readings[count:], np.random.default_rng(SEED), 1)
    by_form = found(noisy, whole.rest) - whole.forces[count:] * sensors.range.full_scales
    by_chart = found(solved[1:] * left, solved[0]) - found(readings[:SOLVED], whole.rest)
    return replace(found, error=np.sqrt(np.mean(by_form**2, axis=0) + np.mean(by_chart**2, axis=0)))


def error_by_unknowns(sensors: Sensors, fit: ModelFit) -> Array:
    """Errors (sensors, axes; N), rms, of the found sensor's map on others from which the readings may come."""
    loads = np.vstack([sensors.range.pressed(0.0), sensors.range.inside(ASKED // 2, LEARNT)])
    slopes = unknown_slopes(sensors, loads, True, fit.errors)
    towards = np.linalg.pinv(load_slopes(sensors, fit.errors, loads[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    square = np.mean((fit.likely @ np.swapaxes(wrong, 1, 2)) ** 2, axis=0)
    return np.asarray(np.sqrt(square) * sensors.range.full_scales)


def _set_right(sensors: Sensors, errors: Array, loads: Array, solved: Array) -> tuple[Array, Array]:
    """What charted readings under loads are multiplied with, (n, coils), so that they agree with `solved` ones: of rest
    and the first of the loads; and what solved ones are, so that they are as far off as had they not been among those
    that it was fitted to: of least squares a residual over 1 - its leverage (Allen, Technometrics 16, 1974).
    """
    tried = np.vstack([sensors.range.pressed(0.0), loads[: len(solved) - 1]])
    off = np.log(solved) - np.log(sensors.under(errors, tried))
    scale, columns = sensors.range.full_scales, sensors.range.columns
    powers = exponents([1.0] * len(columns), DEGREE, 1)
    known, asked = (monomials(part[:, columns] / scale, powers) for part in (tried[1:], loads))
    found = np.linalg.lstsq(known, off[1:] - off[0], rcond=None)[0]
    leverage = np.sum(np.linalg.qr(known)[0] ** 2, axis=1)[:, None]
    more = (off[1:] - off[0] - known @ found) * leverage / np.maximum(1.0 - leverage, LEAST_LEFT)
    return np.exp(asked @ found), np.exp(more)


def _map(sensors: Sensors, form: Form, learnt: Samples, rest: Array) -> InverseMap:
    """A form fitted to samples of one sensor, as a map; a plain polynomial where the form cannot be fitted to them.
    `rest` (coils; Hz) is what it reads without load, solved, as a response tells it.
    """
    own = gain(sensors)
    shape = fitted_form(form, learnt, own, sensors.noise)
    if shape is None:
        shape = fitted_form(Form("polynomial of degree 3", True, 3), learnt, own, sensors.noise)
    assert shape is not None
    spec, scope = sensors.model.spec, sensors.range
    return InverseMap(
        **vars(shape), sensor=spec.name, revision=spec.issue.revision or "", coils=sensors.coils, axes=scope.axes,
        full_scale=scope.full_scales, error=np.zeros(len(scope.axes)), rest=np.rint(sensors.conversion.counts(rest)),
    )
