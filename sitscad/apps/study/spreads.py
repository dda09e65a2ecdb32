"""Yield: the share of units, as manufacture makes them, that keep what is asked of the design.

A unit is the design with every figure that scatters moved by its own draw; its board is routed as it was drawn. All
designs are made of the same draws (common random numbers), so that their yields differ by the designs alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from sitscad.apps.study.evaluating import figures, tidily
from sitscad.apps.study.evaluation import UnitJudged
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
"""Units of a kept design, and the seed of their draws: the same for every study."""

KEPT_BY_UNITS = ("SIT2", "SIT4")
"""Rules that every unit has to keep: electrical, reading and feeling. Board and fit are the design's own."""

BY_CALIBRATION = ("error.gap",)
"""Measures that tell what units err by that are tared alone: a calibration of every unit takes it away. What all other
measures and rules ask is what a calibration leaves, or no error of a force at all.
"""

SPREADS = {cause.key: cause for cause in CAUSES if cause.moved is not None}
"""What scatters, by the names that studies have for it."""


@cache
def draws(count: int) -> Array:
    """Numbers (count, spreads) between 0 and 1 of a Latin hypercube, always the same. A Sobol' set of so few points has
    pairs of columns that are alike.
    """
    from scipy.stats import qmc  # only studies

    found = qmc.LatinHypercube(len(SPREADS), rng=SEED).random(count)
    return np.asarray(np.clip(found, 1e-12, 1.0 - 1e-12))


def unit(spec: SensorSpec, row: Array, own: Mapping[str, float]) -> SensorSpec:
    """The spec of one unit by its draws (spreads,); `own` are sigmas that stand for those of the tables."""
    from scipy.special import ndtri

    for (key, cause), u in zip(SPREADS.items(), row, strict=True):
        assert cause.moved is not None
        sigma = own.get(key, cause.sigma(spec))
        off = sigma * (float(ndtri(u)) if cause.is_logarithmic else math.sqrt(3.0) * (2.0 * float(u) - 1.0))
        spec = cause.moved(spec, off)
    return spec


def judge_units(
    base: Base, changes: Changes, own: Mapping[str, float], measures: Sequence[str], rows: Array
) -> list[UnitJudged]:
    """Units of a design, each by its draws (n, spreads); limits of measures are the caller's to judge."""
    spec = base.design(changes)
    nominal = Design(spec)
    if spec.readout.capacitance is None:  # the part that is chosen for the design is soldered to every unit
        chosen = nominal.estimates.readout.capacitance
        spec = replace(spec, readout=replace(spec.readout, capacitance=chosen))
    made = (unit(spec, row, own) for row in rows)
    return list(tidily(_judged(Design(one, as_made(nominal.layout, one)), measures) for one in made))


def _judged(design: Design, measures: Sequence[str]) -> UnitJudged:
    rules = [rule for rule in all_rules() if rule.id.startswith(KEPT_BY_UNITS)]
    try:
        said = tuple(finding for rule in rules for finding in apply_rule(rule, design, least=None)[0])
        found = as_configured(design.spec, CheckResult(said, ()))
        values = {name: pair[0] for name, pair in figures(design, measures)[0].items()}
    except Exception:  # counted apart, and as not good: nothing is known of such a unit
        return UnitJudged(False, (), False, {})
    broken = tuple(sorted({one.rule for one in found.findings if one.severity is Severity.ERROR}))
    return UnitJudged(not broken, broken, True, values)


@record
class Yield:
    """The yield: of `units` so many are `good` as they are made, `calibrated` once each was calibrated, and `failed`
    made a computation fail; the interval of 95 % (Wilson 1927); by what part of all units a rule or requirement is
    broken (`broken`); by how much each spread decides it (`costs`); and the standard deviations of the measures that
    were drawn.
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
        """The yield."""
        return self.good / self.units


def yield_of(judged: Sequence[UnitJudged], holds: Callable[[Mapping[str, float]], tuple[str, ...]]) -> Yield:
    """The yield of units; `holds` says which requirements a unit's figures break."""
    broken = [(*one.broken, *holds(one.values)) if one.is_computed else () for one in judged]
    good = np.array([one.is_computed and not rules for one, rules in zip(judged, broken, strict=True)])
    mended = [one.is_computed and not set(rules) - set(BY_CALIBRATION)
              for one, rules in zip(judged, broken, strict=True)]
    names = sorted({name for rules in broken for name in rules})
    shares = {name: sum(name in rules for rules in broken) / len(judged) for name in names}
    drawn = {name: [one.values[name] for one in judged if name in one.values]
             for name in sorted({name for one in judged for name in one.values})}
    sigmas = {name: float(np.std(values, ddof=1)) for name, values in drawn.items() if len(values) > 1}
    count = len(judged)
    return Yield(count, int(good.sum()), sum(not one.is_computed for one in judged), wilson(int(good.sum()), count),
                 shares, _first_order(good.astype(float), draws(count)), sigmas, sum(mended))


def wilson(good: int, count: int) -> tuple[float, float]:
    """The interval of 95 % of a share (Wilson 1927)."""
    z = 1.959964  # of the normal distribution 2.5 % lie beyond
    share, square = good / count, z * z
    middle = (share + square / (2.0 * count)) / (1.0 + square / count)
    half = z / (1.0 + square / count) * math.sqrt(share * (1.0 - share) / count + square / (4.0 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


BINS, SURELY = 8, 3.5
"""Parts into which the draws of one spread are divided; and by how many of its own sigmas an index is above what chance
makes of it (those of a chi-square, BINS - 1 degrees of freedom) to be told."""


def _first_order(good: Array, rows: Array) -> dict[str, float]:
    """Sobol' indices of first order by spread: the part of the variance that its own draw explains, by the means within
    equal parts of it, less what chance alone would explain; nothing where all units are alike.
    """
    whole = float(good.var())
    if whole == 0.0 or len(good) < 2 * BINS:
        return {}
    found = {}
    for name, column in zip(SPREADS, rows.T, strict=True):
        parts = np.array_split(good[np.argsort(column, kind="stable")], BINS)
        between = sum(len(part) * (float(part.mean()) - float(good.mean())) ** 2 for part in parts) / len(good)
        index = between / whole - (BINS - 1) / (len(good) - 1)
        if index > SURELY * math.sqrt(2.0 * (BINS - 1)) / (len(good) - 1):
            found[name] = index
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))
