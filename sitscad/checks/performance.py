"""SIT401 to SIT409, SIT412 and SIT414: resolution and errors of the forces against the spec's requirements.

The values are the same as in the data sheet. Other rules here refuse readings from which no force can be determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial, wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from sitscad.assembly.places.state import WORKING_POINTS
from sitscad.basics.check_results import RequirementResult
from sitscad.basics.finding import Severity
from sitscad.basics.record import memo, record, replace
from sitscad.basics.units import show
from sitscad.checks.fixes.pads import (
    other_metals,
    other_silicones,
    other_thicknesses,
    slower_scans,
    smaller_pads,
    temperature_sensors,
)
from sitscad.checks.fixes.search import Family
from sitscad.checks.rules import NEEDS, Rule, Undecided, Verdict, not_checked, rule_of, violation_of
from sitscad.estimates.design import Cells, Design
from sitscad.estimates.performance.causes import DEGREE
from sitscad.estimates.performance.inversion import crosstalk_at as crossed
from sitscad.estimates.performance.shear_reading import MAX_SHEAR_READING, shear_readings
from sitscad.estimates.performance.warming import farthest_temperature, warming
from sitscad.estimates.performance_values import AXES, AXIS_WORDS, load_unit
from sitscad.kernels.converters.figures import source_in_all

if TYPE_CHECKING:
    from sitscad.estimates.performance.points import SensingAnalysis

    AnalysisRule = Callable[[SensingAnalysis, Design], Iterator[Verdict]]


PERFORMANCE_SOURCE = (
    f"noise: {source_in_all('noise_law')}; slopes: the response; pad: its law, as in `response --performance`"
)


def check_requirement(
    case: str, design: Design, rule: str, key: str, most: WorstValue, unit: str = "N", *, slows: bool = False,
    limit: float | None = None, shrinks: bool = False, details: tuple[str, ...] = (), first: tuple[Family, ...] = (),
    **values: Any,
) -> Iterator[Verdict]:
    """Yield the estimated value for the requirement `key`, and a finding if the value exceeds the requirement.

    `case` is the key of the finding's texts in ``data/messages.csv``, and `rule` the rule's identifier. `most` is the
    value (in `unit`) with its axis and working point. If the requirement has one value per axis, `limit` is the value
    for this axis. The families `first` of changes are tried first. If `slows`, lower scan rates are tried as well. If
    `shrinks`, smaller pads are tried as well.
    """
    limit_value = getattr(design.spec.requirements, key) if limit is None else limit
    yield RequirementResult(key, rule, most.value, limit_value, unit, most.axis, most.at)
    if most.value > limit_value:
        # metals and pads with more signal per newton, after fewer scans if these help
        spec = design.spec
        slower = (partial(slower_scans, spec, 1.1 * most.value / limit_value),) if slows else ()
        smaller = (partial(smaller_pads, spec),) if shrinks else ()
        fixes = (*first, *slower, partial(other_metals, spec), partial(other_silicones, spec, is_softer=True),
                 partial(other_thicknesses, spec), *smaller)
        yield violation_of(case, f"requirements.{key}", most.value, limit_value, unit or None, details=details,
                           fixes=fixes, axis=most.axis, at=most.at, **values)


def requirement_results(rule: Rule, design: Design) -> tuple[RequirementResult, ...]:
    """Return the estimated values that a rule of `RULES` yields for requirements. Empty if the rule does not apply.

    `design` must be a sensor without cells, or a single cell.
    """
    if rule.apply is None or not all(NEEDS[need][0](design.spec) for need in rule.needs):
        return ()
    return tuple(each for each in rule.apply(design) if isinstance(each, RequirementResult))


def estimated_values(cells: Cells) -> tuple[RequirementResult, ...]:
    """Return the estimated value for each requirement, and the error that each of the largest error sources causes.

    For a sensor with several cells, the cell with the softest pad and the cell with the smallest signal are estimated.
    The larger of the two values is returned, and its working point contains the number of the cell.
    """
    worst: dict[tuple[str, str], RequirementResult] = {}
    for number, cell in cells.extremes.items():
        for result in _cell_estimated_values(cell):
            # forces and moments are compared apart; beside a limit, by the ratio to it
            key = result.requirement, result.unit if result.limit is None else ""
            if key not in worst or _limit_ratio(result) > _limit_ratio(worst[key]):
                place = f", cell {number}" if cells.whole.spec.cells else ""
                worst[key] = replace(result, at=result.at + place)
    return tuple(worst.values())


def _limit_ratio(result: RequirementResult) -> float:
    """Return the ratio of an estimated value to its limit. If it has no limit, return the value (N or N m)."""
    return result.measured / result.limit if result.limit else result.measured


def _cell_estimated_values(design: Design) -> tuple[RequirementResult, ...]:
    """Return the estimated values of one cell for its requirements, then the error that each error source causes.

    Sources are the drift with temperature, the hysteresis and creep of the pad, the tilt of the contact, and the error
    of the pad's modulus. The tilt is the required tilt, or else one degree. Each source has two values: the largest
    error of all force axes (N), and of all moment axes (N m). There are no sources if the spec has no requirement of
    performance.
    """
    results = [result for rule in RULES for result in requirement_results(rule, design)]
    needs = design.spec.requirements
    sensing = design.sensing.analysis if any(each.limit is not None for each in results) else None
    if sensing is None or not sensing.is_pad_stable[0]:
        return tuple(results)
    end = farthest_temperature(needs)
    warm = f", {needs.temperature:.3g} to {end:.3g} degC"
    sources = [("zero_drift", "SIT406", sensing.warmed[0].drift, f"at rest, after one tare{warm}")]
    if sensing.is_pad_stable[-1]:
        full, at, pad = sensing.warmed[-1], POINTS[-1], design.spec.elastomer
        assert pad is not None
        if all(each.requirement != "temperature_error" for each in results):
            sources.append(("drift", "SIT406", full.drift, f"{at}, after one tare{warm}"))
        sources += [
            ("tared_drift", "SIT406", full.tared_drift, f"{at}, after a tare before each grasp{warm}"),
            ("hysteresis", "SIT405", full.hysteresis, f"{at}, by the pad's data"),
            ("creep", "SIT405", pad.material.creep * full.axis_loads, f"{at}, by the pad's data"),
        ]
        if all(each.requirement != "tilt_error" for each in results):
            name = "tilt_of_one_degree" if needs.tilt is None else "tilt"
            sources.append((name, "SIT408", full.tilt_errors(full.tilt).max(axis=1), at))
        if sensing.is_pad_stable_in_range:
            sources.append(("modulus", "SIT405", sensing.modulus_error, f"{at}, of a pad that was not measured"))
    for name, rule, errors, where in sources:
        results += largest_by_unit(name, rule, dict(zip(sensing.bench.range.axes, errors, strict=True)), where)
    return tuple(results)


def largest_by_unit(name: str, rule: str, errors: Mapping[str, float], where: str) -> list[RequirementResult]:
    """Return the largest error of all force axes (N), and the largest error of all moment axes (N m).

    `errors` maps axes to errors. `name` is the error source, `rule` the rule about this source, and `where` the text of
    the working point. The results have no limit.
    """
    results = []
    for kind, unit in ((FORCES, "N"), (MOMENTS, "N m")):
        axis = max((axis for axis in errors if axis in kind), key=lambda axis: errors[axis], default=None)
        if axis is not None:
            results.append(RequirementResult(name, rule, float(errors[axis]), None, unit, axis_text(axis), where))
    return results


def axis_text(axis: str) -> str:
    """Return the name of an axis for texts, such as "normal force" for ``normal``."""
    return AXIS_WORDS[axis]


def _no_performance_reason(is_solved: bool, is_rough: bool, has_target: bool) -> Undecided:
    """Return the reason why no sensing performance was estimated.

    `is_solved` is True if the field of the target was solved, and `is_rough` if the estimates are for screening only.
    `has_target` is True if the spec has a target.
    """
    is_too_large = not (is_solved or is_rough)
    return not_checked("performance-unsolved" if is_too_large and has_target else "performance-unknown")


def performance_rule(rule: AnalysisRule) -> Callable[[Design], Iterator[Verdict]]:
    """Return the function of a rule on a design. It applies `rule` to the design's estimated sensing performance.

    The new function yields a reason "not checked" if there is no estimated performance, or if the pad buckles sideways
    at a working point.
    """

    @wraps(rule)
    def apply(design: Design) -> Iterator[Verdict]:
        sensing = design.sensing.analysis
        if sensing is None:
            numbers, target = design.estimates, design.spec.target
            yield _no_performance_reason(numbers.is_solved, numbers.is_rough, target is not None)
        else:
            yield from rule(sensing, design)
            lost = [at for at, is_held in zip(POINTS, sensing.is_pad_stable, strict=True) if not is_held]
            if lost:
                yield not_checked("performance-lost", where=lost[0])

    return apply


def only_if_pad_holds(rule: AnalysisRule) -> AnalysisRule:
    """Return the function of a rule that applies `rule` only if the pad holds the target in the whole working range.

    If the pad buckles sideways under full shear, the new function yields a reason "not checked".
    """

    @wraps(rule)
    def apply(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
        if sensing.is_pad_stable_in_range:
            yield from rule(sensing, design)
        elif all(sensing.is_pad_stable):
            yield not_checked("performance-lost", where="under full shear")

    return apply


POINTS = tuple(point.text for point in WORKING_POINTS)
"""Texts of the working points (loads at which performance is estimated), from rest to full load."""


@record
class WorstValue:
    """Largest value of a quantity (SI unit) over several axes and working points.

    ``axis`` is the name of the axis with this value, and ``at`` the text of the working point with this value.
    """

    value: float
    axis: str
    at: str


def worst_value(sensing: SensingAnalysis, axes: Iterable[str], of: Callable[[int, int], float]) -> WorstValue | None:
    """Return the largest value of `of(point, axis)` over `axes` and all working points at which the pad holds.

    In `of`, the arguments `point` and `axis` are the indices of the working point and of the axis. `axes` are the names
    of axes with a common unit. None if the array cannot measure any of these axes.
    """
    names = sensing.bench.range.axes
    each = [
        WorstValue(of(point, names.index(axis)), axis_text(axis), where)
        for point, where in enumerate(POINTS)
        if sensing.is_pad_stable[point]
        for axis in axes
        if axis in names
    ]
    return max(each, key=lambda candidate: candidate.value, default=None)


FORCES, SHEARS, MOMENTS = ("normal", "shear_x", "shear_y"), ("shear_x", "shear_y"), ("moment_x", "moment_y")


@performance_rule
def normal_resolution(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield findings on the noise of the normal force at every working point."""
    yield from _resolution_findings(sensing, design, "SIT401", "normal_resolution", ("normal",))


@performance_rule
def shear_resolution(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield findings on the noise of the shear axes that the array can measure. A single coil measures no shear."""
    if not set(SHEARS) & set(sensing.bench.range.axes):
        lone = len(sensing.bench.range.axes) == 1
        yield violation_of(
            "no-shear-coil" if lone else "no-shear-moments", "requirements.shear_resolution", None,
            design.spec.requirements.shear_resolution, "N", hint="more-coils" if lone else "moment-or-shear",
        )
        return
    yield from _resolution_findings(sensing, design, "SIT402", "shear_resolution", SHEARS)


@performance_rule
def moment_resolution(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield findings on the noise of the required moments."""
    yield from _resolution_findings(sensing, design, "SIT412", "moment_resolution", MOMENTS, "N m")


def _resolution_findings(
    sensing: SensingAnalysis, design: Design, rule: str, key: str, axes: tuple[str, ...], unit: str = "N"
) -> Iterator[Verdict]:
    """Yield findings on the largest noise of all `axes`, compared with the required resolution `key`.

    `rule` is the rule's identifier, and `unit` the unit of the noise.
    """
    most = worst_value(sensing, axes, lambda point, axis: float(sensing.points[point].noise[axis]))
    if most is not None:
        yield from check_requirement("noise", design, rule, key, most, unit, slows=True,
                                     rate=design.spec.readout.scan_rate)


@performance_rule
@only_if_pad_holds
def crosstalk(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield the largest error on an axis due to full load on another axis, and a finding if it exceeds the limit.

    The forces are computed from the readings by the polynomial with the least error.
    """
    if len(sensing.bench.range.axes) == 1:
        yield not_checked("one-axis")
        return
    tables = [crossed(sensing.working, point.load, point.inverse)[0] for point in sensing.points]

    axes = sensing.bench.range.axes
    most = worst_value(sensing, axes, lambda point, axis: max(tables[point][axes[axis]].values(), default=0.0))
    if most is not None:
        yield from check_requirement("axis-crosstalk", design, "SIT403", "crosstalk", most, "")


@performance_rule
def tilt_error(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield the error due to the required tilt of the contact, and a finding if it exceeds the limit of its axis.

    Of all axes with a limit, the axis with the largest ratio of error to limit is reported.
    """
    tilt, limits = design.spec.requirements.tilt, design.spec.requirements.tilt_limits()
    assert tilt is not None
    measured_axes = [name for name in limits if name in sensing.bench.range.axes]

    each = ((name, worst_value(
        sensing, (name,), lambda point, axis: float(sensing.points[point].tilt_errors(tilt)[axis].max())))
            for name in measured_axes)
    ratios = [(reached.value / limits[name], name, reached) for name, reached in each if reached is not None]
    if ratios:  # the axis with the largest ratio of value to limit
        _, name, most = max(ratios, key=lambda entry: entry[0])
        yield from check_requirement(
            "tilt-reading", design, "SIT404", "tilt_error", most, load_unit(name), limit=limits[name], shrinks=True,
            details=("tilt-beside-moment",) if name in MOMENTS else (), tilt=tilt,
        )
    untold = [name for name in limits if name not in measured_axes and name in ("normal", *MOMENTS)]
    if not isinstance(design.spec.requirements.tilt_error, float):
        untold = [name for name in limits if name not in measured_axes]
    if untold:
        yield not_checked("tilt-axes", axes=list(map(axis_text, untold)))


@performance_rule
@only_if_pad_holds
def friction_error(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield the error of the ratio of shear force to normal force at full load, and a finding if it exceeds the limit.

    A further finding is on an array that cannot measure shear.
    """
    limit = design.spec.requirements.friction_error
    assert limit is not None
    shear = next((name for name in sensing.bench.range.axes if name in SHEARS), None)
    if shear is None:
        lone = len(sensing.bench.range.axes) == 1
        yield violation_of("no-friction-coil" if lone else "no-friction-moments", "requirements.friction_error", None,
                           limit, hint="more-coils" if lone else "moment-or-shear")
        return
    causes = sensing.friction(shear)
    error = float(np.hypot.reduce(list(causes.values())))
    cause = max(causes, key=lambda source: causes[source])
    most = WorstValue(error, "shear over normal", "at full load")
    yield from check_requirement("friction-error", design, "SIT405", "friction_error", most, "", cause=cause,
                                 part=causes[cause])


@performance_rule
def temperature_error(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield the largest drift of a force over the temperature range, and a finding if it exceeds the limit.

    The force is at full load. The temperature changes from the temperature of the tare to the end of the range that is
    farther from it.
    """
    needs = design.spec.requirements
    apart = warming(needs)
    if not sensing.is_pad_stable[-1]:
        return
    is_force = np.array([name in FORCES for name in sensing.bench.range.axes])
    full = sensing.warmed[-1]
    drift = np.where(is_force, full.drift, 0.0)
    k = int(np.argmax(drift))
    axis = axis_text(sensing.bench.range.axes[k])
    cause = max(full.drift_causes, key=lambda name: abs(float(full.drift_causes[name][k])))
    at = f"at full load, {needs.temperature:.3g} to {farthest_temperature(needs):.3g} degC"
    yield from check_requirement("drift", design, "SIT406", "temperature_error", WorstValue(float(drift[k]), axis, at),
                                 first=(partial(temperature_sensors, design.spec),), kelvin=apart, cause=cause,
                                 tare=needs.temperature, plain=float(full.uncompensated_drift[k]),
                                 details=() if full.compensation is None else ("drift-compensated",))


BESIDE_NOISE = 10.0
"""Ratio of the error due to one degree of tilt to the noise on the same axis, above which there is a note."""


@performance_rule
@only_if_pad_holds
def ambiguous_load_findings(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield a finding if two different loads within the required forces and moments give equal readings."""
    ambiguous = design.sensing.ambiguous_loads
    if ambiguous is not None:
        loads = [" and ".join(f"{show(load[k], load_unit(name), 3)} of {axis_text(name)}"
                              for k, name in enumerate(AXES) if name in sensing.bench.range.axes)
                 for load in ambiguous]
        yield violation_of("loads-alike", "target.size", loads=loads, fixes=(
            partial(other_silicones, design.spec, is_softer=False), partial(other_thicknesses, design.spec)))


@performance_rule
def tilt_above_noise(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield a note if one degree of tilt causes an error of more than `BESIDE_NOISE` times the noise on an axis."""
    most = worst_value(sensing, sensing.bench.range.axes, lambda point, axis: float(
        sensing.points[point].tilt_errors(DEGREE)[axis].max() / sensing.points[point].noise[axis]))
    if most is not None and most.value > BESIDE_NOISE:
        point = sensing.points[POINTS.index(most.at)]
        k = list(map(axis_text, sensing.bench.range.axes)).index(most.axis)
        unit = load_unit(sensing.bench.range.axes[k])
        needs, axis = design.spec.requirements, sensing.bench.range.axes[k]
        # requirements with which the tilt is judged, if the spec leaves them out
        absent = ["requirements.tilt"] * (needs.tilt is None)
        if axis not in needs.tilt_limits():
            absent.append("requirements.tilt_error" + f".{axis}" * (needs.tilt_error is not None or axis in MOMENTS))
        if any(needs.moments):  # a level target takes up moments
            hint = "tilt-advice-moments-judged" if absent else "tilt-advice-moments"
        else:
            hint = "tilt-advice-judged" if absent else "tilt-advice"
        yield violation_of(
            "tilt-noise", "elastomer.thickness", most.value, BESIDE_NOISE, hint=hint, axis=most.axis, at=most.at,
            reading=show(float(point.tilt_errors(DEGREE)[k].max()), unit, 2), absent=absent,
            noise=show(float(point.noise[k]), unit, 2),
        )


@performance_rule
@only_if_pad_holds
def combined_errors(sensing: SensingAnalysis, design: Design) -> Iterator[Verdict]:
    """Yield findings on the total error of every axis at full load, due to all error sources together.

    The limit is the permitted error, or the required resolution if the spec states no permitted error.
    """
    needs, names, causes = design.spec.requirements, sensing.bench.range.axes, sensing.lasting_errors
    where = TOGETHER + ", with the shear that is not told" * any(_unseen_axis(cause) for cause in causes)
    for kind, axes, unit in (("normal", ("normal",), "N"), ("shear", SHEARS, "N"), ("moment", MOMENTS, "N m")):
        allowed, resolution = (getattr(needs, f"{kind}_{what}") for what in ("error", "resolution"))
        measured_axes = [name for name in axes if name in names]
        if not measured_axes and allowed is not None and kind == "shear":
            lone = len(names) == 1
            yield violation_of("all-shear-error", "requirements.shear_error", None, allowed, unit,
                               hint="more-coils" if lone else "moment-or-shear")
        if not measured_axes or (allowed is None and resolution is None):
            continue
        value, name = max((float(np.hypot.reduce([error[k] for error in causes.values()])), name)
                          for k, name in enumerate(names) if name in measured_axes)
        part, cause = max((float(error[names.index(name)]), cause) for cause, error in causes.items())
        unseen, most = _unseen_axis(cause), WorstValue(value, axis_text(name), where)
        detail = ("errors-unseen" if unseen else "errors-cause",)
        cause = axis_text(unseen) if unseen else cause
        if allowed is not None:
            yield from check_requirement("errors-together", design, "SIT414", f"{kind}_error", most, unit,
                                         details=detail, cause=cause, part=show(part, unit, 3))
            continue
        yield RequirementResult(f"{kind}_error", "SIT414", value, None, unit, most.axis, most.at)
        if value > resolution:
            yield violation_of(
                "errors-resolution", f"requirements.{kind}_resolution", value, resolution, unit, details=detail,
                axis=most.axis, kind=kind, allowed=show(1.1 * value, unit, 2), cause=cause, part=show(part, unit, 3),
            )


TOGETHER = "at full load, errors together, a tare before each grasp"


def _unseen_axis(cause: str) -> str:
    """Return the shear axis that the error source `cause` names at its beginning. Empty if it begins with another word.

    The names of such error sources stand for shear that the array does not measure.
    """
    return next((axis for axis in SHEARS if cause.startswith(f"{axis} ")), "")


def unseen_shear(design: Design) -> Iterator[Verdict]:
    """Yield the errors on other axes due to shear that the coils do not measure, and a finding beyond the limit.

    Only axes with a requirement are checked. The errors are computed only if a requirement needs the sensing
    performance, because they double the time to check a single coil. A single coil with a required shear force always
    has a finding.
    """
    requirements = design.spec.requirements
    is_note = len(design.spec.array.placements) == 1 and bool(requirements.shear_force)
    note = violation_of("one-coil-shear", "requirements.shear_force", hint="more-coils", severity=Severity.NOTE,
                        force=requirements.shear_force or 0.0)
    if not NEEDS["feeling"][0](design.spec):
        if is_note:
            yield note
        return
    readings, sensing = [], design.sensing.analysis
    if sensing is not None and sensing.is_pad_stable[-1]:
        readings = shear_readings(sensing, requirements)
    if not readings:
        if is_note:
            yield note
        elif sensing is None:
            numbers, target = design.estimates, design.spec.target
            yield _no_performance_reason(numbers.is_solved, numbers.is_rough, target is not None)
        elif not sensing.is_pad_stable[-1]:
            yield not_checked("performance-lost", where=POINTS[-1])
        return
    for kind, unit in ((FORCES, "N"), (MOMENTS, "N m")):
        largest = max((each for each in readings if each.axis in kind), key=lambda each: each.error, default=None)
        if largest is not None:
            yield RequirementResult("unmeasured_shear", "SIT409", largest.error, None, unit, axis_text(largest.axis),
                                    f"{POINTS[-1]}, {show(largest.force, 'N', 3)} of {axis_text(largest.shear)}")
    worst = max(readings, key=lambda each: each.error / each.limit)
    unit, error_key = "N m" if worst.axis in MOMENTS else "N", f"{worst.axis.partition('_')[0]}_error"
    is_allowed, is_too_much = getattr(requirements, error_key) is not None, worst.error > worst.limit
    advice = ["use two coils in line to tell shear along them", "three or four to tell both axes"]
    if not is_note and sensing is not None and sensing.bench.range.has_moments:
        advice = ["leave the moments out", "let no shear act"]
    if not is_note:
        less = "ask for less shear" if requirements.shear_force else "write requirements.shear_force if less acts"
        advice.append(less)
    if is_too_much and not is_allowed:
        advice.append(f"write requirements.{error_key} if more is allowed")
    if is_note or is_too_much:
        expected = "unseen-required" if requirements.shear_force else "unseen-expected"
        yield violation_of(
            "one-coil-reading" if is_note else "unseen-shear", "requirements.shear_force", worst.error, worst.limit,
            unit, hint="unseen-shear", severity=None if not is_note else Severity.WARNING if is_too_much
            else Severity.NOTE,
            details=("shear-allowed" if is_allowed else "shear-scale", *[expected] * (not is_note)), ways=advice,
            force=requirements.shear_force or 0.0 if is_note else worst.force, shear=axis_text(worst.shear),
            axis=axis_text(worst.axis), ratio=worst.error / worst.scale, most=MAX_SHEAR_READING,
        )


def _cached_per_design(
    number: str, apply: Callable[[Design], Iterable[Verdict]]
) -> Callable[[Design], Iterable[Verdict]]:
    """Return the function `apply` of rule `number` with its results cached per design.

    The results are needed twice: for findings, and for the table of estimated values.
    """
    return lambda design: memo(design, f"verdicts of {number}", lambda: tuple(apply(design)))


def _performance_rule(number: str, apply: Callable[[Design], Iterator[Verdict]], need: str) -> Rule:
    figures = {"felt": PERFORMANCE_SOURCE, "beside_noise": BESIDE_NOISE}
    return rule_of(number, _cached_per_design(number, apply), "target", "elastomer", need, **figures)


RULES: tuple[Rule, ...] = (
    _performance_rule("SIT401", normal_resolution, "normal resolution"),
    _performance_rule("SIT402", shear_resolution, "shear resolution"),
    _performance_rule("SIT403", crosstalk, "crosstalk"),
    _performance_rule("SIT404", tilt_error, "tilt error"),
    _performance_rule("SIT405", friction_error, "friction error"),
    _performance_rule("SIT406", temperature_error, "temperature error"),
    _performance_rule("SIT407", ambiguous_load_findings, "feeling"),
    _performance_rule("SIT408", tilt_above_noise, "feeling"),
    rule_of("SIT409", _cached_per_design("SIT409", unseen_shear), "target", "elastomer", "force",
            felt=PERFORMANCE_SOURCE, much=f"{100.0 * MAX_SHEAR_READING:.0f} %"),
    _performance_rule("SIT412", moment_resolution, "moment resolution"),
    _performance_rule("SIT414", combined_errors, "errors"),
)
