"""Comparison of a measured coil with the computed coil: fitted L, C and R, and the likely cause of a difference."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from sitscad.apps.coil.causes import CLOSE, DECISIVE, Explanation, PossibleCause, Residuals, fit_cause, possible_causes
from sitscad.apps.coil.drawn import DrawnCoil
from sitscad.apps.coil.measurement import Measurement, MeasurementError, read_measurement
from sitscad.apps.coil.spiral import Spiral
from sitscad.apps.coil.variants import CoilVariants, Impedance
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array, ComplexArray, Index
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.basics.version import __version__
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.layout.board import Layout

METER_ERROR = 0.003
"""Relative error of a meter if the user states none. It holds for a bench LCR meter in the middle of its range."""

NEAR_RESONANCE = 0.8
"""Largest compared frequency, divided by the computed self-resonance.

Above it, the impedance depends on capacitance and losses that are rarely known.
"""

MOST_POINTS = 40
"""Largest number of compared points. From more points, some are selected evenly over the logarithm of the frequency."""


@record(eq=False)
class ImpedanceFit:
    """L, C and R of a coil, fitted to its measured impedance.

    Attributes
    ----------
    frequency : float
        geometric mean (Hz) of the compared frequencies, at which `inductance` and `resistance` hold
    inductance, inductance_sigma : float
        H; in series, without the capacitance
    resistance, resistance_sigma : float
        ohm; in series
    capacitance, capacitance_sigma : float or None
        F; None if the points are too few or too far below the resonance to show it
    resistances, resistance_sigmas : (n,) arrays
        ohm, at the compared frequencies
    """

    frequency: float
    inductance: float
    inductance_sigma: float
    resistance: float
    resistance_sigma: float
    capacitance: float | None
    capacitance_sigma: float | None
    resistances: Array
    resistance_sigmas: Array


@record(eq=False)
class Comparison:
    """Comparison of a measured coil with the computed coil.

    Attributes
    ----------
    measurement : Measurement
        all measured points
    coil : str
        name of the coil
    frequencies, measured : (n,) arrays
        compared frequencies (Hz), and measured impedances (ohm) between the terminals
    meter_error : float
        relative error of the meter
    drawn : Explanation
        the computed coil as drawn, with the errors of meter, model and manufacture
    is_as_drawn : bool
        whether the coil as drawn is within these errors and no cause explains the measurement much better
    fit : ImpedanceFit
        L, C and R of the measured coil
    explanations : tuple of Explanation
        all causes that were tried, the best first
    left_out : int
        number of points near to and above the self-resonance, which are not compared
    """

    measurement: Measurement
    coil: str
    frequencies: Array
    measured: ComplexArray
    meter_error: float
    drawn: Explanation
    is_as_drawn: bool
    fit: ImpedanceFit
    explanations: tuple[Explanation, ...]
    left_out: int

    @property
    def cause(self) -> Explanation | None:
        """Cause that explains the difference best.

        None if the coil agrees with its design, or if no cause is sufficient.
        """
        best = self.explanations[0]
        return None if self.is_as_drawn or not best.is_sufficient else best

    @property
    def alternatives(self) -> tuple[Explanation, ...]:
        """Other causes that explain the points nearly as well as `cause` (see `CLOSE`). Empty if there is no cause."""
        best = self.cause
        if best is None:
            return ()
        return tuple(each for each in self.explanations[1:]
                     if each.is_sufficient and each.penalized_chi_square < best.penalized_chi_square + CLOSE)

    @property
    def verdict(self) -> str:
        """Result of the comparison in one or two sentences."""
        if self.is_as_drawn:
            return "As drawn: measurement and computation agree within the errors of meter, model and manufacture."
        if self.cause is None:
            nearest = self.explanations[0]
            return f"No single cause explains the difference. Nearest: {nearest.text}."
        text = f"Most likely cause: {self.cause.text}."
        if self.alternatives:
            alternative_text = "; ".join(each.text for each in self.alternatives[:MOST_ALTERNATIVES])
            text += f" These points cannot exclude: {alternative_text}."
        return text

    def document(self) -> dict[str, Any]:
        """Return the comparison as a JSON object."""
        omega, fit = 2.0 * math.pi * self.frequencies, self.fit
        points = [
            {"frequency_Hz": f, "measured_inductance_H": m.imag / w, "measured_resistance_ohm": m.real,
             "computed_inductance_H": c.imag / w, "computed_resistance_ohm": c.real}
            for f, w, m, c in zip(self.frequencies.tolist(), omega.tolist(), self.measured.tolist(),
                                  self.drawn.impedances.tolist(), strict=True)
        ]
        causes = [
            {"cause": each.cause, "text": each.text, "values": list(each.values), "sigmas": list(each.sigmas),
             "chi_square": each.chi_square, "sufficient": each.is_sufficient} for each in self.explanations
        ]
        return {
            "sitscad": __version__, "file": self.measurement.path, "coil": self.coil, "meter_error": self.meter_error,
            "as_drawn": self.is_as_drawn, "cause": None if self.cause is None else self.cause.cause,
            "alternatives": [each.cause for each in self.alternatives], "verdict": self.verdict,
            "chi_square": self.drawn.chi_square, "points_left_out": self.left_out,
            "fit": {
                "frequency_Hz": fit.frequency, "inductance_H": fit.inductance,
                "inductance_sigma_H": fit.inductance_sigma, "resistance_ohm": fit.resistance,
                "resistance_sigma_ohm": fit.resistance_sigma, "capacitance_F": fit.capacitance,
                "capacitance_sigma_F": fit.capacitance_sigma,
            },
            "causes": causes, "points": points,
        }


MOST_ALTERNATIVES = 3
"""Largest number of other causes in the text of the result."""


@one_thread
@checked_arguments
def compare(
    coil: Spiral | DrawnCoil | Layout, measured: str | os.PathLike[str] | Measurement, name: str | None = None,
    meter_error: float = METER_ERROR,
) -> Comparison:
    """Compare a measured coil with the computed one, and find the cause of a difference.

    Parameters
    ----------
    coil
        A spiral without leads, a drawn coil, or the layout of a sensor. The coil is measured alone: no target, no
        metal, its neighbours open. A drawn coil needs a named stack-up.
    measured
        A file with the measured impedance, or a `Measurement`. A file is Touchstone of one port (``.s1p``), or a table
        (CSV). The table's head names the frequency and R and X, L and R, L and Q, or Z and phase, with units. The coils
        of a layout are measured at their contacts.
    name
        Name of the layout's coil, the first if None.
    meter_error
        Relative error of the meter, as gain and as phase (rad).

    Returns
    -------
    Comparison
        Both impedances, the fitted L, C and R, and the causes that were tried.

    Raises
    ------
    ValueError
        for a coil that the layout does not have
    MeasurementError
        (a ValueError) if the file has no impedance of a coil, or if all points lie near to or above the self-resonance
    MissingExtra
        for a Touchstone file if scikit-rf is not installed

    Notes
    -----
    Each cause is fitted by least squares. The residuals are weighted by the errors of the meter, of the model and of
    manufacture, which are correlated over the frequency. Causes are ranked by chi-square with a penalty for each
    parameter (Akaike 1974, doi:10.1109/TAC.1974.1100705).
    """
    measurement = measured if isinstance(measured, Measurement) else read_measurement(measured)
    layout = coil if isinstance(coil, Layout) else coil.layout
    if layout is None:
        raise MeasurementError("the drawn coil has no capacitance to compare with: name a stack-up (--stackup); turns "
                               "that wind no known shape have none")
    names = [each.name for each in layout.coils]
    if name is not None and name not in names:
        raise ValueError(f"there is no coil {name}: {', '.join(names)}")
    number = 0 if name is None else names.index(name)
    has_leads = not isinstance(coil, Spiral)
    first = CoilVariants.from_layout(layout, number, has_leads, measurement.frequencies[:1]).nominal
    resonance = _self_resonance(first)
    is_compared = measurement.frequencies < NEAR_RESONANCE * resonance
    if not is_compared.any():
        raise MeasurementError(
            f"{measurement.path}: all points lie above {show(NEAR_RESONANCE * resonance, 'Hz', 3)}, near to the coil's "
            "self-resonance or above it: measure at lower frequencies")
    chosen = _select_points(np.flatnonzero(is_compared), measurement.frequencies)
    frequencies, impedances = measurement.frequencies[chosen], measurement.impedances[chosen]
    if (impedances.imag <= 0.0).any():
        frequency = frequencies[impedances.imag <= 0.0][0]
        raise MeasurementError(f"{measurement.path}: at {show(float(frequency), 'Hz', 4)} the reactance is negative, "
                               "far below the coil's self-resonance: no coil of this kind was measured")
    variants = CoilVariants.from_layout(layout, number, has_leads, frequencies)
    residuals = Residuals.from_measurement(impedances, meter_error, list(variants.tolerances().values()))
    nominal = PossibleCause("as drawn", lambda values: variants.nominal, lambda values, sigmas: "as drawn")
    as_drawn = fit_cause(nominal, residuals)
    explanations = tuple(sorted((fit_cause(cause, residuals) for cause in possible_causes(variants, impedances)),
                         key=lambda each: (not each.is_sufficient, each.penalized_chi_square)))
    return Comparison(
        measurement, names[number], frequencies, impedances, meter_error, as_drawn,
        as_drawn.is_sufficient and as_drawn.penalized_chi_square < explanations[0].penalized_chi_square + DECISIVE,
        _fit_impedance(variants, impedances, meter_error), explanations,
        len(measurement.frequencies) - int(is_compared.sum()),
    )


def _self_resonance(coil: Impedance) -> float:
    """Return the self-resonance (Hz), computed with the inductance at the first frequency."""
    inductance = float(coil.series.imag[0] / (2.0 * math.pi * coil.frequencies[0]))
    return resonance_frequency(inductance, max(coil.capacitance, 1e-16))


def _select_points(numbers: Index, frequencies: Array) -> Index:
    """Return at most `MOST_POINTS` of the point numbers, spaced evenly over the logarithm of their frequencies."""
    if len(numbers) <= MOST_POINTS:
        return numbers
    logs = np.log(frequencies[numbers])
    log_points = np.linspace(logs[0], logs[-1], MOST_POINTS)
    return np.unique(numbers[np.abs(logs[:, None] - log_points).argmin(axis=0)])


def _fit_impedance(variants: CoilVariants, measured: ComplexArray, meter_error: float) -> ImpedanceFit:
    """Fit inductance, resistance and capacitance to the measured impedances (n; ohm).

    `meter_error` is the relative error of the meter. The frequency dependence is taken from the computed coil. The
    inductance is multiplied by a factor. The resistance is multiplied by a factor that may change with frequency.
    """
    nominal, frequencies = variants.nominal, variants.frequencies
    middle = math.exp(float(np.log(frequencies).mean()))
    powers = 2 if len(frequencies) >= 6 else 1 if len(frequencies) >= 3 else 0
    bends = np.log(frequencies / middle)[:, None] ** np.arange(powers + 1)
    has_capacitance = len(frequencies) >= 3

    def impedance(values: Sequence[float]) -> Impedance:
        factors = bends @ np.array(values[1 : powers + 2])
        series = nominal.series.real * (1.0 + factors) + 1j * nominal.series.imag * (1.0 + values[0])
        capacitance = nominal.capacitance + (values[-1] if has_capacitance else 0.0)
        return replace(nominal, series=series, capacitance=capacitance)

    count = powers + 2 + has_capacitance
    step = (1e-4,) * (powers + 2) + (1e-14,) * has_capacitance
    wide = (20.0,) * (powers + 2) + (1e-8,) * has_capacitance
    low = (-0.999,) + (-20.0,) * (powers + 1) + (-2.0 * nominal.capacitance - 1e-12,) * has_capacitance
    cause = PossibleCause("L, C and R", impedance, lambda values, sigmas: "", ((0.0,) * count,), low, wide, step)
    fit = fit_cause(cause, Residuals.from_measurement(measured, meter_error, ()))
    values, sigmas = np.array(fit.values), np.array(fit.sigmas)
    series = impedance(fit.values).series
    phase_error = meter_error * np.abs(series)  # a phase error of the meter turns reactance into resistance
    errors = np.hypot(np.abs(nominal.series.real) * sigmas[1], phase_error)
    inductances = series.imag / (2.0 * math.pi * frequencies)
    at = float(np.interp(math.log(middle), np.log(frequencies), inductances))
    is_seen = has_capacitance and sigmas[-1] < 0.5 * abs(nominal.capacitance + values[-1])
    return ImpedanceFit(
        middle, at, at * float(sigmas[0]),
        float(np.interp(middle, frequencies, series.real)), float(np.interp(middle, frequencies, errors)),
        nominal.capacitance + float(values[-1]) if is_seen else None, float(sigmas[-1]) if is_seen else None,
        series.real, errors,
    )
