"""Possible causes of a difference between a measured and a computed coil, each fitted to the measurement."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from sitscad.apps.coil.variants import CoilVariants, Impedance
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.basics.units import show

METALS = ("aluminium", "stainless-304", "stainless-17-4ph")
"""Metals that are assumed near a coil: a good conductor, a poor one and a magnetic metal (`data/conductors.csv`)."""

ADDED_PARAMETER = 2.0
"""Amount added to chi-square for each fitted parameter (Akaike 1974)."""

CLOSE = 6.0
"""Difference of two penalised chi-squares below which the points do not distinguish the causes: odds below 20 to 1."""

DECISIVE = 10.0
"""Least decrease of the penalised chi-square for which a cause is preferred to the nominal coil.

It corresponds to odds of 150 to 1.
"""

STEPS = 12
"""Largest number of Gauss-Newton steps of a fit. Fits in the tests need 3 to 6."""


@record(eq=False)
class PossibleCause:
    """A possible cause of a difference, described by parameters that change the coil's impedance.

    ``impedance`` returns the changed coil for given parameters. `text` describes the cause with its parameters and
    their standard deviations. The fit begins at each of `starts`, and the best result is used. Without parameters,
    `starts` has one empty entry. `lowest` and `highest` are the limits of the parameters. `step` are the steps of their
    finite differences.
    """

    name: str
    impedance: Callable[[Sequence[float]], Impedance]
    text: Callable[[Sequence[float], Sequence[float]], str]
    starts: tuple[tuple[float, ...], ...] = ((),)
    lowest: tuple[float, ...] = ()
    highest: tuple[float, ...] = ()
    step: tuple[float, ...] = ()


@record(eq=False)
class Explanation:
    """A possible cause, fitted to a measurement.

    Attributes
    ----------
    cause : str
        name of the cause
    text : str
        description of the cause with its fitted parameters
    values, sigmas : tuple of float
        fitted parameters and their standard deviations (SI), empty for causes without parameters
    chi_square : float
        sum of the squares of residuals, each divided by its standard deviation
    is_sufficient : bool
        whether the residuals are within the errors of meter, model and manufacture
    impedances : (n,) complex array
        ohm, at the compared frequencies
    """

    cause: str
    text: str
    values: tuple[float, ...]
    sigmas: tuple[float, ...]
    chi_square: float
    is_sufficient: bool
    impedances: ComplexArray

    @property
    def penalized_chi_square(self) -> float:
        """Chi-square plus `ADDED_PARAMETER` for each parameter. The smallest value belongs to the best explanation."""
        return self.chi_square + ADDED_PARAMETER * len(self.values)


@record(eq=False)
class Residuals:
    """Differences between computed and measured impedances, decorrelated and divided by their standard deviations."""

    measured: ComplexArray
    whitening: Array

    @classmethod
    def from_measurement(
        cls, measured: ComplexArray, meter_error: float, tolerances: Sequence[ComplexArray],
    ) -> Residuals:
        """Return an object that computes residuals of impedances relative to these measured impedances.

        Parameters
        ----------
        measured
            Impedances (n; ohm).
        meter_error
            Relative error of the meter, as gain and as phase (rad), equal at all frequencies. In addition, each point
            scatters by half of this error.
        tolerances
            Changes (n; ohm) of the impedance that one standard deviation of each tolerance or model error causes.
        """
        size = np.abs(measured)
        turned = measured / size
        common = [meter_error * turned, 1j * meter_error * turned, *(change / size for change in tolerances)]
        covariance = (SCATTER * meter_error) ** 2 * np.eye(2 * len(measured))
        for each in common:
            column = np.concatenate((each.real, each.imag))
            covariance += np.outer(column, column)
        return cls(measured, np.linalg.inv(np.linalg.cholesky(covariance)))

    def __call__(self, impedances: ComplexArray) -> Array:
        """Return the residuals (2 n: real parts, imaginary parts) of impedances (n; ohm)."""
        apart = (impedances - self.measured) / np.abs(self.measured)
        return np.asarray(self.whitening @ np.concatenate((apart.real, apart.imag)))

    @property
    def largest_sufficient(self) -> float:
        """Largest chi-square of a sufficient explanation: three sigma above the mean of the chi-square distribution."""
        count = 2 * len(self.measured)
        return count + 3.0 * math.sqrt(2.0 * count)


SCATTER = 0.5
"""Scatter of single points divided by the meter's error.

Most of a meter's error is equal at neighbouring frequencies.
"""


def possible_causes(variants: CoilVariants, measured: ComplexArray) -> Iterator[PossibleCause]:
    """Yield all possible causes for this coil that change its impedance towards the `measured` impedances (n; ohm)."""
    yield from _manufacturing_causes(variants)
    yield from _winding_causes(variants)
    yield from _fixture_causes(variants)
    if (measured.imag < variants.nominal.terminal.imag).any():  # metal lowers the inductance, but for magnetic metal
        yield from (_metal_cause(variants, metal) for metal in METALS)


def _manufacturing_causes(variants: CoilVariants) -> Iterator[PossibleCause]:
    coil, stackup = variants.spec.coil, variants.spec.fpc.stackup
    width, pitch = coil.trace_width, coil.pitch
    copper = stackup.copper[coil.layers[0] - 1].thickness
    yield PossibleCause(
        "etched width", lambda values: variants.with_width(values[0]),
        lambda values, sigmas: f"the tracks are {_sigma_text(values[0], sigmas[0], 'm')} wide; drawn are "
                               f"{show(width, 'm')}",
        ((0.9 * width,), (1.1 * width,)), (0.25 * width,), (min(3.0 * width, width + 0.9 * (pitch - width)),),
        (0.02 * width,),
    )
    yield PossibleCause(
        "copper thickness", lambda values: variants.with_copper(math.exp(values[0])),
        lambda values, sigmas: f"the copper is {_sigma_text(copper * math.exp(values[0]), copper * sigmas[0], 'm')} "
                               f"thick; the stack-up has {show(copper, 'm')}",
        ((0.0,),), (math.log(0.2),), (math.log(4.0),), (0.05,),
    )
    if len(coil.layers) > 1:
        layers = [stackup.copper[each - 1] for each in coil.layers]
        film = abs(layers[0].z - layers[1].z) - 0.5 * (layers[0].thickness + layers[1].thickness)
        yield PossibleCause(
            "distance of layers", lambda values: variants.with_films(math.exp(values[0])),
            lambda values, sigmas: f"{_sigma_text(film * math.exp(values[0]), film * sigmas[0], 'm')} lie between the "
                                   f"first two layers of the coil; the stack-up has {show(film, 'm')}",
            ((0.0,),), (math.log(0.2),), (math.log(10.0),), (0.05,),
        )


def _winding_causes(variants: CoilVariants) -> Iterator[PossibleCause]:
    coil = variants.spec.coil
    count = len(coil.layers)
    for number, layer in enumerate(coil.layers):
        if count > 1:
            yield _cause_without_parameters(f"layer {layer} missing",
                                            f"the turns on copper {layer} are missing or bypassed",
                                            partial(variants.without_layer, number))
        if count > 2 or (count == 2 and number == 1):  # of two layers, either turns against the other
            yield _cause_without_parameters(f"layer {layer} reversed",
                                            f"the turns on copper {layer} turn the other way",
                                            partial(variants.with_layer_reversed, number))
        for more, word in ((-1.0, "missing"), (1.0, "more")):
            if (coil.layer_turns[number] + more) < 0.5 or coil.layer_turns[number] + more > coil.turns_that_fit:
                continue
            yield _cause_without_parameters(f"turn {word} on layer {layer}",
                                            f"copper {layer} has one turn {_MORE[word]} than drawn",
                                            partial(variants.with_turns, number, more))
        yield from _shorted_turn_causes(variants, number, layer)


def _shorted_turn_causes(variants: CoilVariants, number: int, layer: int) -> Iterator[PossibleCause]:
    """Yield the cause "shorted turn" for one layer of a coil, if the layer has enough turns.

    `number` (from 0) is the layer's position in the coil, and `layer` the number of the copper layer in texts.
    """
    count = math.floor(variants.spec.coil.layer_turns[number] + 1e-6)
    if count >= LEAST_TURNS_TO_SHORT:
        yield PossibleCause(
            f"shorted turn on layer {layer}", lambda values: variants.with_shorted_turn(number, values[0]),
            lambda values, sigmas: f"turn {values[0]:.0f} +- {max(sigmas[0], 0.5):.1g} of copper {layer}, counted from "
                                   "the outside, is shorted",
            tuple((start,) for start in np.linspace(1.0, count, 3).tolist()), (1.0,), (float(count),), (0.25,),
        )


LEAST_TURNS_TO_SHORT = 3
"""Least number of turns of a layer for which a shorted turn is a possible cause.

With fewer, little of the coil is left.
"""


_MORE = {"missing": "less", "more": "more"}
"""Words for the text of a cause, by the word in the cause's name."""


def _fixture_causes(variants: CoilVariants) -> Iterator[PossibleCause]:
    nominal = variants.nominal
    omega = 2.0 * math.pi * variants.frequencies

    def in_series(values: Sequence[float]) -> Impedance:
        return replace(nominal, series=nominal.series + values[1] + 1j * omega * values[0])

    inductance = float(nominal.series.imag[0] / omega[0])
    yield PossibleCause(
        "fixture's capacitance", lambda values: replace(nominal, capacitance=nominal.capacitance + values[0]),
        lambda values, sigmas: f"the fixture adds {_sigma_text(values[0], sigmas[0], 'F')} across the coil",
        ((0.0,),), (-0.9 * nominal.capacitance,), (10e-9,), (1e-13,),
    )
    yield PossibleCause(
        "fixture in series", in_series,
        lambda values, sigmas: f"leads and fixture add {_sigma_text(values[0], sigmas[0], 'H')} and "
                               f"{_sigma_text(values[1], sigmas[1], 'ohm')} in series",
        ((0.0, 0.0),), (-0.5 * inductance, -0.5 * float(nominal.series.real[0])), (MOST_LEADS, 100.0), (1e-10, 1e-4),
    )


MOST_LEADS = 2e-6
"""Largest inductance (H) of leads and fixture: about two metres of wire."""


def _metal_cause(variants: CoilVariants, metal: str) -> PossibleCause:
    size = min(variants.spec.coil.size)
    return PossibleCause(
        f"metal near by ({metal})", lambda values: variants.with_metal(metal, math.exp(values[0])),
        lambda values, sigmas: f"metal like {metal} lies about {show(math.exp(values[0]), 'm', 2)} from the board's "
                               "lower face",
        ((math.log(0.05 * size),), (math.log(0.3 * size),)), (math.log(1e-5),), (math.log(2.0 * size),), (0.05,),
    )


def _cause_without_parameters(name: str, text: str, impedance: Callable[[], Impedance]) -> PossibleCause:
    """Return a possible cause that has no parameters to fit."""
    return PossibleCause(name, lambda values: impedance(), lambda values, sigmas: text)


def _sigma_text(value: float, sigma: float, unit: str) -> str:
    return f"{show(value, unit, 3)} +- {show(sigma, unit, 1)}"


def fit_cause(cause: PossibleCause, residuals: Residuals) -> Explanation:
    """Return a cause with its parameters fitted by least squares (Gauss-Newton method with halved steps)."""
    fits = [_fit_parameters(cause, residuals, start) for start in cause.starts]
    values, sigmas, impedances, misfit = min(fits, key=lambda fit: fit[3])
    return Explanation(cause.name, cause.text(values, sigmas), values, sigmas, misfit,
                       misfit <= residuals.largest_sufficient, impedances)


Fit = tuple[tuple[float, ...], tuple[float, ...], ComplexArray, float]
"""Result of a fit: parameters, their standard deviations, impedances (n; ohm) and chi-square."""


def _fit_parameters(cause: PossibleCause, residuals: Residuals, start: Sequence[float]) -> Fit:
    values = np.array(start, dtype=float)
    impedances = cause.impedance(values.tolist()).terminal
    apart = residuals(impedances)
    misfit, steps = float(apart @ apart), np.array(cause.step)
    slopes = np.zeros((len(apart), len(values)))
    for _ in range(STEPS if len(values) else 0):
        slopes = _residual_slopes(cause, residuals, values, apart, steps)
        change = steps * np.linalg.lstsq(slopes * steps, -apart, rcond=None)[0]  # parameters of equal size
        for halving in range(6):
            trial = np.clip(values + 0.5**halving * change, cause.lowest, cause.highest)
            changed = cause.impedance(trial.tolist()).terminal
            residual = residuals(changed)
            if float(residual @ residual) < misfit:
                break
        else:
            break
        gain = misfit - float(residual @ residual)
        values, impedances, apart, misfit = trial, changed, residual, float(residual @ residual)
        if gain < 0.01:
            break
    scaled = slopes * steps
    sigmas = steps * np.sqrt(np.diag(np.linalg.pinv(scaled.T @ scaled)))
    return tuple(values.tolist()), tuple(sigmas.tolist()), impedances, misfit


def _residual_slopes(cause: PossibleCause, residuals: Residuals, values: Array, apart: Array, steps: Array) -> Array:
    """Return the derivatives (2 n, parameters) of the residuals with respect to the parameters.

    `apart` are the residuals (2 n) at `values`, and `steps` the steps of the finite differences. A step that would
    exceed the upper limit of its parameter is taken in the opposite direction.
    """
    columns = []
    for k, step in enumerate(steps.tolist()):
        moved = values.copy()
        moved[k] += step if values[k] + step <= cause.highest[k] else -step
        columns.append((residuals(cause.impedance(moved.tolist()).terminal) - apart) / (moved[k] - values[k]))
    return np.stack(columns, axis=1)
