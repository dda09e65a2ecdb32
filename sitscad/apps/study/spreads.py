"""Yield: the fraction of manufactured units that meet the requirements of a design.

A unit is the design with every scattering quantity changed by its own random draw. Its board is routed as designed. All
designs use equal draws (common random numbers), so that their yields differ by the designs only.
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
from sitscad.layout.board import as_made
from sitscad.package.inspection import as_configured
from sitscad.spec.sensor import SensorSpec

DRAWS, SEED = 256, 20261124
"""Number of units of a kept design, and the seed of their draws, which is the same for every study."""

KEPT_BY_UNITS = ("SIT2", "SIT4")
"""Rules that every unit has to keep: electrical, readout and sensing. Board and fit do not vary between units."""

BY_CALIBRATION = ("error.gap",)
"""Measures that a unit may exceed before its calibration and still be good after its calibration.

The gap's error, from the thickness of glue and pad, remains after a tare. Calibration removes it. All other limits
must also be met after calibration.
"""

SPREADS = {cause.key: cause for cause in CAUSES if cause.moved is not None}
"""Causes of scatter in manufacture that are drawn at random for each unit, by their names in studies."""


@cache
def latin_hypercube(count: int) -> Array:
    """Return random numbers (count, spreads) between 0 and 1: a Latin hypercube with a fixed seed.

    The columns are in the order of `SPREADS`. A Sobol' set is not used: with few points, some pairs of its columns are
    equal.
    """
    from scipy.stats import qmc  # loaded for studies only

    numbers = qmc.LatinHypercube(len(SPREADS), rng=SEED).random(count)
    return np.asarray(np.clip(numbers, 1e-12, 1.0 - 1e-12))


def unit_spec(spec: SensorSpec, row: Array, sigmas: Mapping[str, float]) -> SensorSpec:
    """Return the spec of one manufactured unit from its draws (spreads,), numbers between 0 and 1.

    `sigmas` replace standard deviations of the tables, by spread.
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
    """Return evaluated units of a design, from their draws (n, spreads).

    Limits of measures are not applied here. The caller compares them.
    """
    spec = base.design(changes)
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

    ``good`` of ``units`` are good as manufactured, and ``calibrated`` are good after calibration. The computation of
    ``failed`` units failed. ``interval`` is the 95 % confidence interval of the yield (Wilson 1927). For each rule or
    requirement, ``broken`` is the fraction of units that break it. For each spread, ``costs`` is its Sobol' index: the
    fraction of the variance between good and bad units that it explains. ``sigmas`` are standard
    deviations of measures over the units.
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
        """Yield: fraction of units that are good as manufactured."""
        return self.good / self.units


def yield_of(judged: Sequence[UnitEvaluation], holds: Callable[[Mapping[str, float]], tuple[str, ...]]) -> Yield:
    """Return the yield of units. `holds` returns the requirements that a unit's figures break."""
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
                 ratios, _first_order(good.astype(float), latin_hypercube(count)), sigmas, sum(mended))


def wilson_interval(good: int, count: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a fraction (Wilson 1927)."""
    z = 1.959964  # 97.5 % quantile of the normal distribution
    share, square = good / count, z * z
    middle = (share + square / (2.0 * count)) / (1.0 + square / count)
    half = z / (1.0 + square / count) * math.sqrt(share * (1.0 - share) / count + square / (4.0 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


BINS, SURELY = 8, 3.5
"""Number of equal bins for the draws of a spread, and least significance of a returned Sobol' index.

An index is returned if it exceeds `SURELY` standard deviations of an index by chance (chi-square with BINS - 1 degrees
of freedom).
"""


def _first_order(good: Array, rows: Array) -> dict[str, float]:
    """Return Sobol' indices of first order by spread, the largest first. Insignificant indices are left out.

    An index is the part of the variance that the spread's draw explains. It is the variance of the means within equal
    bins of the draw, over the whole variance, minus the part expected by chance. Empty if all units are equal, or if
    there are fewer than two per bin.
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
