"""Yield: the fraction of manufactured sensors of a design that meet the requirements.

A simulated sensor (unit) is the design with a random error of each quantity that scatters in manufacture. Its board is
routed like the design. All designs use the same random numbers, so that their yields differ only because of the
designs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from sitscad.apps.study.evaluating import free_results, measure_values
from sitscad.apps.study.evaluation import UnitEvaluation
from sitscad.apps.study.space import Base, Changes
from sitscad.basics.arrays import Array
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.checks.judging import CheckResult, all_rules
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.estimates.tolerances.scatter import CAUSES
from sitscad.estimates.tolerances.units_made import as_made
from sitscad.package.inspection import as_configured
from sitscad.spec.sensor import SensorSpec

DRAWS, SEED = 256, 20261124
"""Number of simulated sensors of each kept design, and seed of their random numbers. It is the same for all studies."""

KEPT_BY_UNITS = ("SIT2", "SIT4")
"""Beginnings of the ids of rules that each sensor must meet: electrical, readout and sensing.

Board and fit do not vary between sensors.
"""

BY_CALIBRATION = ("error.gap",)
"""Measures whose limit a sensor may exceed before its calibration and still be good after calibration.

The error by the thickness of glue and pad remains after a tare, and calibration removes it. All other limits must also
be met without calibration.
"""

SPREADS = {cause.key: cause for cause in CAUSES if cause.moved is not None}
"""Causes of manufacturing scatter that are drawn at random for each sensor, by their names in studies."""


@cache
def latin_hypercube(count: int) -> Array:
    """Return random numbers (count, causes) between 0 and 1: a Latin hypercube with a fixed seed.

    The columns are in the order of `SPREADS`. A Sobol' set is not used, because with few points some pairs of its
    columns are equal.
    """
    from scipy.stats import qmc  # loaded for studies only

    numbers = qmc.LatinHypercube(len(SPREADS), rng=SEED).random(count)
    return np.asarray(np.clip(numbers, 1e-12, 1.0 - 1e-12))


def unit_spec(spec: SensorSpec, row: Array, sigmas: Mapping[str, float]) -> SensorSpec:
    """Return the spec of one simulated sensor from its random numbers `row` (causes), between 0 and 1.

    `sigmas` are standard deviations that replace the usual ones, by cause.
    """
    from scipy.special import ndtri

    for (key, cause), u in zip(SPREADS.items(), row, strict=True):
        assert cause.moved is not None
        sigma = sigmas.get(key, cause.sigma(spec))
        off = sigma * (float(ndtri(u)) if cause.is_logarithmic else math.sqrt(3.0) * (2.0 * float(u) - 1.0))
        spec = cause.moved(spec, off)
    return spec


def judge_units(
    base: Base, changes: Changes, sigmas: Mapping[str, float], measures: Sequence[str], rows: Array
) -> list[UnitEvaluation]:
    """Return simulated sensors of a design with their evaluations, from random numbers `rows` (n, causes).

    `sigmas` are standard deviations that replace the usual ones, by cause. The caller applies the limits of measures.
    """
    spec = base.changed_spec(changes)
    nominal = Design(spec)
    if spec.readout.capacitance is None:  # every unit has the capacitor that is chosen for the design
        chosen = nominal.estimates.readout.capacitance
        spec = replace(spec, readout=replace(spec.readout, capacitance=chosen))
    specs = (unit_spec(spec, row, sigmas) for row in rows)
    return list(free_results(_evaluate_unit(Design(each, as_made(nominal.layout, each)), measures) for each in specs))


def _evaluate_unit(design: Design, measures: Sequence[str]) -> UnitEvaluation:
    rules = [rule for rule in all_rules() if rule.id.startswith(KEPT_BY_UNITS)]
    try:
        findings = tuple(finding for rule in rules for finding in apply_rule(rule, design, least=None)[0])
        checked = as_configured(design.spec, CheckResult(findings, ()))
        values = {name: pair[0] for name, pair in measure_values(design, measures)[0].items()}
    except Exception:  # counted as failed and not good: the unit has no figures
        return UnitEvaluation(False, (), False, {})
    broken = tuple(sorted({each.rule for each in checked.findings if each.severity is Severity.ERROR}))
    return UnitEvaluation(not broken, broken, True, values)


@record
class Yield:
    """The yield of a design.

    Of ``units`` simulated sensors, ``good`` are good as manufactured, and ``calibrated`` are good after calibration.
    The computation of ``failed`` sensors failed. ``interval`` is the 95 % confidence interval of the yield (Wilson
    1927). ``broken`` is the fraction of sensors that break each rule or requirement. ``costs`` is the Sobol' index of
    each cause: the fraction of the variance between good and bad sensors that it explains. ``sigmas`` are standard
    deviations of measures over the sensors.
    """

    units: int
    good: int
    failed: int
    interval: tuple[float, float]
    broken: Mapping[str, float]
    costs: Mapping[str, float]
    sigmas: Mapping[str, float]
    calibrated: int

    @property
    def share(self) -> float:
        """Yield: fraction of sensors that are good as manufactured."""
        return self.good / self.units


def compute_yield(judged: Sequence[UnitEvaluation], holds: Callable[[Mapping[str, float]], tuple[str, ...]]) -> Yield:
    """Return the yield from evaluated simulated sensors.

    `holds` returns the requirements that a sensor's values break.
    """
    broken = [(*each.broken_rules, *holds(each.values)) if each.is_computed else () for each in judged]
    good = np.array([each.is_computed and not rules for each, rules in zip(judged, broken, strict=True)])
    mended = [each.is_computed and not set(rules) - set(BY_CALIBRATION)
              for each, rules in zip(judged, broken, strict=True)]
    names = sorted({name for rules in broken for name in rules})
    ratios = {name: sum(name in rules for rules in broken) / len(judged) for name in names}
    values_of = {name: [each.values[name] for each in judged if name in each.values]
                 for name in sorted({name for each in judged for name in each.values})}
    sigmas = {name: float(np.std(values, ddof=1)) for name, values in values_of.items() if len(values) > 1}
    count = len(judged)
    return Yield(count, int(good.sum()), sum(not each.is_computed for each in judged),
                 wilson_interval(int(good.sum()), count),
                 ratios, _first_order_indices(good.astype(float), latin_hypercube(count)), sigmas, sum(mended))


def wilson_interval(good: int, count: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of the fraction `good` / `count` (Wilson 1927)."""
    z = 1.959964  # 97.5 % quantile of the normal distribution
    share, square = good / count, z * z
    middle = (share + square / (2.0 * count)) / (1.0 + square / count)
    half = z / (1.0 + square / count) * math.sqrt(share * (1.0 - share) / count + square / (4.0 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


BINS, SURELY = 8, 3.5
"""Number of equal bins for the random numbers of a cause, and least significance of a returned Sobol' index.

An index is returned if it exceeds the index expected by chance by `SURELY` standard deviations (chi-square with BINS -
1 degrees of freedom).
"""


def _first_order_indices(good: Array, rows: Array) -> dict[str, float]:
    """Return Sobol' indices of first order by cause, the largest first. Insignificant indices are left out.

    `good` (n) states which sensors are good, and `rows` (n, causes) are their random numbers.

    An index is the fraction of the variance that the cause explains. It is the variance of the means within equal bins
    of the random number, divided by the whole variance, minus the part expected by chance. Empty if all sensors are
    equal, or if there are fewer than two per bin.
    """
    whole = float(good.var())
    if whole == 0.0 or len(good) < 2 * BINS:
        return {}
    indices = {}
    for name, column in zip(SPREADS, rows.T, strict=True):
        parts = np.array_split(good[np.argsort(column, kind="stable")], BINS)
        between = sum(len(part) * (float(part.mean()) - float(good.mean())) ** 2 for part in parts) / len(good)
        index = between / whole - (BINS - 1) / (len(good) - 1)
        if index > SURELY * math.sqrt(2.0 * (BINS - 1)) / (len(good) - 1):
            indices[name] = index
    return dict(sorted(indices.items(), key=lambda pair: -pair[1]))
