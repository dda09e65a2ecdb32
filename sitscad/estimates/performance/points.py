"""Sensing performance in newtons at working points: range, resolution, nonlinearity, crosstalk and errors by cause.

All values are after a tare at rest. A reading is ln(frequency / frequency at rest) of a coil. Disturbances of the
readings are converted to loads by a linear map for the working point, a least-squares fit weighted with each coil's
noise. Crosstalk and errors by manufacture are computed with the nonlinear map of the working range.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from sitscad.assembly.places.state import PRESSED, WORKING_POINTS
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates import estimate_layout
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import TOO_SOFT, NoResponse, loaded_poses, tilt_stiffness, tilt_stiffness_error
from sitscad.estimates.loads.pressing import MODULUS, rests_on_pad
from sitscad.estimates.loads.working_range import extrapolated_shear_note, required_range, validated_shear
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.performance.causes import PointErrors, TiltEffects, resonances
from sitscad.estimates.performance.compensation import DriftCoefficients
from sitscad.estimates.performance.inversion import SolvedRange, crosstalk_at, solve_range
from sitscad.estimates.performance.screen import screening_load_model
from sitscad.estimates.performance.unit_errors import UnitErrors, simulate_unit_errors
from sitscad.estimates.performance.warming import WARMER, by_metal
from sitscad.estimates.performance_values import (
    AXIS_WORDS,
    FORCES,
    INSTABILITY,
    MOMENTS,
    OTHER_JAW_CAUSES,
    UNMEASURED,
    AxisPerformance,
    Loads,
    Performance,
    amount_text,
    axis_names_text,
    lasts_after_tare,
    load_unit,
    loads_on_axis,
)
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.states.other_jaw import GRASPED, front_plate, other_jaw_changes
from sitscad.estimates.tolerances.scatter import manufacturing_scatter, production_limits
from sitscad.estimates.windings.losses import SCREENING
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.layout.board import Layout

HALF_SCANS, RESONANCE = "half the scan rate", "resonance of target and pad"  # Limits of a bandwidth
COURSE = 9  # Number of loads along an axis


def axis_range(bench: LoadModel, model: ResponseModel, load: Array, name: str) -> tuple[float, str]:
    """Return the largest load (N, N m) on an axis that the sensor can measure, and the name of its limit.

    The normal axis starts at zero. Loads on another axis are added to the working point's `load`, in the positive
    direction.
    """
    most, converter = bench.validated_loads[name], bench.spec.readout.device
    forces = np.linspace(0.0, most, COURSE)
    poses, reasons = loaded_poses(bench.spec, loads_on_axis(load, name, forces),
                                  np.full(COURSE, not bench.range.has_moments))
    response = model.on_pad(poses)
    least, loudest = converter.limit("amplitude_stable_min"), converter.limit("amplitude_max")
    wrong = {
        "converter": np.any(~(response.frequency < converter.limit("sensor_frequency_max")), axis=1),
        "amplitude": np.any(~(response.amplitude > least) | (response.amplitude > loudest), axis=1),
        "contact": np.array([any("contact" in note for note in notes) for notes in response.notes]),
        INSTABILITY: np.array([note == TOO_SOFT or (bench.range.has_moments and bool(note)) for note in reasons]),
    }
    firsts = {cause: int(np.argmax(bad)) for cause, bad in wrong.items() if bad.any()}
    if not firsts:
        return most, "tilt" if name in MOMENTS else "strain"
    cause = min(firsts, key=firsts.__getitem__)
    return float(forces[max(firsts[cause] - 1, 0)]), cause


@record(eq=False)
class SensingAnalysis:
    """Sensing performance of a sensor, computed with a load model. Each value is computed at its first use.

    `bench` is the load model; its readings come from the response model, or from a surrogate.
    """

    layout: Layout
    estimates: Estimates
    bench: LoadModel

    @cached_property
    def working(self) -> SolvedRange:
        """Required loads with their readings, and the map from readings to loads."""
        return solve_range(self.bench)

    @cached_property
    def points(self) -> tuple[PointErrors, ...]:
        """Working points with their errors, without the temperature effect of metal."""
        bench, loads, points = self.bench, working_loads(self.bench), []
        poses = bench.poses(loads)
        slopes, tilts, cold = bench.slopes(poses), TiltEffects(bench, loads, poses), np.zeros(len(bench.rest))
        gives = bench.compliance(loads, poses)
        for k, point in enumerate(WORKING_POINTS):
            by_load = slopes[k] @ gives[k]
            points.append(PointErrors(bench, loads[k], point.share, poses[k], slopes[k], by_load,
                                      bench.linear_map(by_load), cold, tilts, k, cold))
        return tuple(points)

    @cached_property
    def warmed(self) -> tuple[PointErrors, ...]:
        """Working points with their errors, with the temperature effect of copper and other metal."""
        warm = self.estimates.temperature + WARMER
        rough = SCREENING if self.estimates.is_rough else None
        warmer = estimate_layout(self.layout, tolerance=rough, temperature=warm, is_solved=self.estimates.is_solved)
        warming = warmer.temperature - self.estimates.temperature
        at_rest = by_metal(self.estimates.coils, warmer.coils, warming, self.bench.rest)
        # without a pressed state, the effect of metal is taken as at rest
        loaded = by_metal(self.estimates.coils, warmer.coils, warming, self.bench.rest, PRESSED)
        loaded = np.where(loaded == 0.0, at_rest, loaded)
        return tuple(replace(point, by_metal=at_rest, by_metal_loaded=loaded) for point in self.points)

    @cached_property
    def drift_coefficients(self) -> DriftCoefficients | None:
        """Coefficients for the compensation of drift in firmware. None if nothing measures the temperature."""
        rest, full, spec = self.warmed[0], self.warmed[-1], self.bench.spec
        if full.compensation is None or spec.elastomer is None:
            return None
        at_rest, loaded = (np.sum(list(point.reading_drift.values()), axis=0) for point in (rest, full))
        by_reference, thermistor = full.compensation.reading.is_by_metal, spec.readout.thermistor
        return DriftCoefficients(
            at_rest, loaded, float(full.load[0]), spec.elastomer.material.modulus_temperature_coefficient,
            full.warming, self.estimates.reference_drift if by_reference else None,
            None if by_reference or thermistor is None else thermistor.part)

    @cached_property
    def is_pad_stable(self) -> tuple[bool, ...]:
        """Whether the pad is stable, for each working point. If it is not, values at this point are meaningless."""
        return tuple(map(bool, self.bench.is_pad_stable(working_loads(self.bench))))

    @cached_property
    def is_pad_stable_in_range(self) -> bool:
        """Whether the pad is stable under all required loads."""
        return bool(np.all(self.bench.is_pad_stable(self.working.loads)))

    @cached_property
    def units(self) -> UnitErrors:
        """Errors of units that each have an error of one manufacturing cause."""
        return simulate_unit_errors(self.working, manufacturing_scatter(self.layout.spec, self.estimates.coils))

    @cached_property
    def modulus_error(self) -> Array:
        """Standard deviation (N, N m; axes) at full load by the pad's modulus, before a calibration."""
        scatter = manufacturing_scatter(self.layout.spec, self.estimates.coils)
        modulus = tuple(cause for cause in scatter if cause.name == MODULUS)
        units = simulate_unit_errors(self.working, modulus)
        return units.by_modulus(WORKING_POINTS[-1].share, self.bench.full_scales["normal"])

    @cached_property
    def lasting_errors(self) -> dict[str, Array]:
        """Standard deviations (N, N m) of every axis at full load, by each cause that lasts.

        Neither a calibration nor a tare before each grasp removes these causes. Unmeasured shear is a cause if the spec
        requires shear.
        """
        is_shear_required = self.bench.spec.requirements.shear_force is not None
        return {cause: error for cause, error in self.warmed[-1].errors_of_any_unit(self.working.map_errors).items()
                if lasts_after_tare(cause) or (is_shear_required and UNMEASURED in cause)}

    def friction(self, shear: str) -> dict[str, float]:
        """Return errors of the ratio of shear to normal force at full load, by cause.

        `shear` is the name of the shear axis. See `PointErrors.friction`.
        """
        full = self.warmed[-1]
        return full.friction(full.errors(self.units, self.working.map_errors), shear)


@one_thread
def analyse_sensing(layout: Layout, estimates: Estimates, model: ResponseModel | None = None) -> SensingAnalysis:
    """Return the sensing performance by the response `model`, or by a surrogate (`screen`) if it is None.

    Raises NoResponse if target, pad or a tank that the converter can count are missing. In screening, raises it also if
    a coil has no state at rest.
    """
    spec = layout.spec
    if spec.target is None or spec.elastomer is None or not rests_on_pad(spec):
        raise NoResponse("nothing is felt without a target on its pad")
    if estimates.readout.conversion is None:
        raise NoResponse("nothing is felt by tanks that the converter cannot count")
    if model is None:
        return SensingAnalysis(layout, estimates, screening_load_model(layout, estimates))

    def frequencies(poses: Array) -> Array:
        return model.on_pad(poses).frequency

    bench = LoadModel(model.spec, estimates, required_range(model.spec), frequencies, frequencies)
    return SensingAnalysis(layout, estimates, bench)


def performance(
    sensing: SensingAnalysis, model: ResponseModel, find_ambiguous: Callable[[], tuple[Loads, Loads] | None]
) -> tuple[Performance, ...]:
    """Return the performance at rest, half and full load. Empty if the pad buckles under one of these loads.

    `find_ambiguous` returns two loads of equal readings (`Sensing.ambiguous_loads`). `sensing` is the analysis by the
    response `model`.
    """
    if not all(sensing.is_pad_stable):
        return ()
    ambiguous, metal = find_ambiguous(), other_jaw_errors(sensing, model)
    return tuple(_performance_at(at.name, point, sensing, model, ambiguous, more)
                 for at, point, more in zip(WORKING_POINTS, sensing.warmed, metal, strict=True))


def other_jaw_errors(sensing: SensingAnalysis, model: ResponseModel) -> tuple[dict[str, Array], ...]:
    """Return the errors (N, N m) of every axis that the other jaw's metal causes, for each working point.

    The keys of each item are `OTHER_JAW_CAUSES`. The sensor is tared with open jaws. Changes of readings are computed
    at rest and at full load, and interpolated linearly between. Empty if the spec has no jaw of metal.
    """
    if front_plate(model.spec.jaw) is None:
        return ({},) * len(sensing.points)
    ends = np.array([sensing.points[0].pose, sensing.points[-1].pose])
    change = other_jaw_changes(model.windings, math.sqrt(model.band[0] * model.band[1]), ends[:, 2].tolist(), GRASPED)
    # f = 1 / (2 pi sqrt(L C)), so a reading changes by half of the inductance's relative change
    read = -0.5 * change / model.on_pad(ends).inductance[:, None, :]
    each = [(1.0 - point.share) * read[0] + point.share * read[1] for point in sensing.points]
    return tuple({cause: np.abs(point.inverse @ reading) for cause, reading in zip(OTHER_JAW_CAUSES, at, strict=True)}
                 for point, at in zip(sensing.points, each, strict=True))


def working_loads(bench: LoadModel) -> Array:
    """Return the loads (points, 3 or 5; N, N m) of the working points: rest, half and full normal force."""
    return np.array([bench.range.normal_load(point.share * bench.full_scales["normal"]) for point in WORKING_POINTS])


def _performance_at(
    at: str, point: PointErrors, sensing: SensingAnalysis, model: ResponseModel, ambiguous: tuple[Loads, Loads] | None,
    more: Mapping[str, Array],
) -> Performance:
    """Return the performance at one working point.

    `more` are errors (axes; N, N m) by causes that are computed for all points together. `at` is the name of the point,
    and `ambiguous` a pair of loads with equal readings, if there is one.
    """
    bench, names, working = point.bench, point.bench.range.axes, sensing.working
    courses = {name: axis_range(bench, model, point.load, name) for name in names}
    errors = {**point.errors(sensing.units, working.map_errors), **more}
    curved, straight = crosstalk_at(working, point.load, point.inverse)
    singular = np.linalg.svd(point.by_load * bench.range.full_scales, compute_uv=False)
    condition = float(singular[0] / max(singular[-1], 1e-300))
    shear = next((name for name in names if name in FORCES[1:]), None)
    scans, swings = 0.5 * bench.estimates.readout.scan_rate, resonances(bench, point.pose)
    overload = courses["normal"][0] if courses["normal"][1] == INSTABILITY else bench.overload
    free = bench.buckling_force if bench.buckling_force is not None and bench.buckling_force < overload else None
    stiffness = tilt_stiffness(bench.pad, point.load[None])[0]
    friction = point.friction(errors, shear) if shear is not None and point.share > 0.0 else {}
    return Performance(
        at=at, load=tuple(map(float, point.load)), axes=_axis_performances(point, working, courses, errors),
        crosstalk=curved, straight_crosstalk=straight, tilt_slope=_table(names, ("rx", "ry", "rz"), point.tilt_slopes),
        tilt=point.tilt, tilt_error=_table(names, ("rx", "ry"), point.tilt_errors(point.tilt)),
        tilt_stiffness=_row(("rx", "ry"), stiffness), tilt_stiffness_error=_row(
            ("rx", "ry"), tilt_stiffness_error(bench.pad, point.pose, stiffness)),
        contact_error=_table(names, ("x", "y"), np.nan_to_num(point.contact_errors)),
        temperature_error=_row(names, point.temperature),
        temperature_causes={name: _row(names, value) for name, value in point.by_kelvin.items()},
        friction_error=float(np.hypot.reduce(list(friction.values()))) if friction else None,
        friction_causes=friction, bandwidth=min([scans, *swings.values()]),
        bandwidth_by=HALF_SCANS if scans <= min(swings.values(), default=scans) else RESONANCE, resonance=swings,
        condition_number=condition, invertible=sensing.is_pad_stable_in_range and ambiguous is None,
        ambiguous=ambiguous, overload=overload, free_overload=free, map_degree=working.map.degree,
        production=production_limits(bench.estimates.coils), notes=_notes(sensing, courses, free),
        compensation={} if point.compensation is None else point.compensation.document(),
        drift_left={source: {part: _row(names, value) for part, value in parts.items()}
                    for source, parts in point.drift_left.items()},
    )


def _axis_performances(
    point: PointErrors, working: SolvedRange, courses: Mapping[str, tuple[float, str]], errors: Mapping[str, Array]
) -> dict[str, AxisPerformance]:
    """Return the performance of every measured axis at a working point.

    Nonlinearity is the largest deviation of the linear map's result from the best straight line, divided by the range
    of results. `courses` holds the range (N, N m) of each axis and the name of its limit. `errors` are by cause (axes;
    N, N m).
    """
    bench, by_axis = point.bench, {}
    frequencies = bench.frequencies(point.pose[None])[0]
    for k, name in enumerate(bench.range.axes):
        forces = np.linspace(0.0, bench.full_scales[name], 9)
        read = working.forward(loads_on_axis(point.load, name, forces)[:, bench.range.columns]) @ point.inverse[k]
        apart = np.abs(read - np.polynomial.polynomial.Polynomial.fit(forces, read, 1)(forces)).max()
        by_axis[name] = AxisPerformance(
            *courses[name], bench.full_scales[name],
            tuple(map(float, point.by_load[:, k] * frequencies)), float(errors["noise"][k]),
            float(apart / max(np.ptp(read), 1e-300)), {cause: float(error[k]) for cause, error in errors.items()},
            load_unit(name),
        )
    return by_axis


def _row(names: Sequence[str], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _table(names: Sequence[str], columns: Sequence[str], values: Array) -> dict[str, dict[str, float]]:
    return {name: _row(columns, values[k]) for k, name in enumerate(names)}


FREE_TARGET = (
    "the target is free to tilt: moments are those on the middle of its outermost face, and a force beside the middle "
    "is a moment; a tilt by a face that sticks is an error by what it adds beside its own moment{turned}"
)
"""Note for a target that is free to tilt. `turned` is `TURNED_ROUND` for a round target."""

TURNED_ROUND = "; a round target turned about z reads nothing"
"""Addition to `FREE_TARGET` for round targets."""


def _notes(sensing: SensingAnalysis, courses: Mapping[str, tuple[float, str]], free: float | None) -> tuple[str, ...]:
    """Return notes about the performance. `free` (N) is the load at which the pad buckles under a free target.

    `courses` holds the range (N, N m) of each axis and the name of its limit.
    """
    bench, names, pad = sensing.bench, sensing.bench.range.axes, sensing.bench.spec.elastomer
    assert pad is not None and bench.spec.target is not None
    sooner = "" if free is None else f"; under one that is free to tilt the pad gives way sideways at {free:.3g} N"
    notes = [
        f"{AXIS_WORDS[name]} ends at {amount_text(most, name)} by {cause}, before its full scale of "
        f"{amount_text(bench.full_scales[name], name)}: the sensor does not reach it"
        for name, (most, cause) in courses.items() if most < bench.full_scales[name]
    ]
    notes += [
        f"noise by {bench.spec.readout.device.source_of('noise_law')}; it is what can be told "
        "apart from one moment to the next, not how true a force is",
        f"hysteresis, creep and temperature of the pad: {pad.material.loss_source}",
        FREE_TARGET.format(turned=TURNED_ROUND * bench.spec.target.outline.is_disc) if bench.range.has_moments else
        "the target is kept level, as by a face that it sticks to (in calibration/ of a package, too): a shear load "
        "above the pad tilts a free one, which reads otherwise (rotation=free of a load, calibrate --rotation free); "
        f"only the error by a force beside the middle is that of a free target{sooner}",
        "full scales are the required forces, else 20 % strain of the pad and shear at a friction of 0.42 (at most "
        "half the pad's thickness); errors that grow with the load count every axis loaded by the same share of its "
        "full scale",
        f"crosstalk is what a polynomial of degree {sensing.working.map.degree} in the readings leaves of this "
        "design; what one unit differs by from the next is apart from it: the data sheet's table of errors from unit "
        "to unit",
        "how fast the silicone follows is in no data: its hysteresis, measured slowly, stands for its lag; the "
        "resonance is that of target and pad with nothing on them, and tissue lowers it",
    ]
    notes += [f"{name}: {reason}" for name, reason in bench.estimates.failed_states.items()]
    pressed, limit = bench.estimates.compression, validated_shear(bench.spec)
    if pressed is not None and not pressed.valid:
        notes.append(f"every force here hangs on a law that is not within its range: {pressed.note}")
    if max((bench.full_scales[name] for name in names if name in FORCES[1:]), default=0.0) > limit:
        notes.append(extrapolated_shear_note(limit))
    if not sensing.is_pad_stable_in_range:
        notes.append("the pad gives way sideways within the full scales: no reading there is known to be of one load")
    if not set(FORCES) <= set(names):
        notes.append(f"measured: {axis_names_text(names)} alone; each other force, at its full scale, has a row of its "
                     "own among the errors and does not count in errors together")
    return tuple(notes)
