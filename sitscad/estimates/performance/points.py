"""What the sensor feels, in newtons: range, resolution, nonlinearity, crosstalk and errors by cause, at working points.

Everything is after a tare at rest. Disturbances go through the straight inverse of the map at the working point:
weighted least squares of the coils' readings (ln of the frequency over that at rest), each with its own noise;
crosstalk and manufacture go through the curved map of the whole working range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.estimates import estimated
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.causes import DEGREE, WARMER, Disturbed, Tilts, by_metal, resonances
from sitscad.estimates.performance.inversion import SolvedRange, crosstalk, solved_range
from sitscad.estimates.performance.manufacture import Units, manufacturing_scatter, units_of
from sitscad.estimates.performance.values import AXES, AxisPerformance, Loads, Performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import TOO_SOFT, pushed
from sitscad.estimates.response.values import Response
from sitscad.estimates.response.working_range import beyond_held_shear, held_shear, required_range
from sitscad.estimates.states.pressing import rests_on_pad
from sitscad.estimates.values import Estimates
from sitscad.estimates.winding.losses import SCREENING
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.state import FREE
from sitscad.spec.sensor import SensorSpec

LIMITS = 3.0
"""Standard deviations of manufacture between which a coil before assembly counts as sound."""

HALF_SCANS, RESONANCE = "half the scan rate", "resonance of target and pad"
"""What a bandwidth is limited by."""

POINTS = (("rest", 0.0), ("half", 0.5), ("full", 1.0))
"""The working points, and their share of the full normal force."""


COURSE = 9
"""Loads along an axis that are looked at."""


INSTABILITY = "instability"
"""What ends an axis where no shape of the pad bears the load: it gives way sideways."""


@record(eq=False)
class Course:
    """Loads (n, 3; N) along one axis from a working point, the response there, and up to where it may go."""

    loads: Array
    response: Response
    range: float
    limited_by: str


def course(bench: Bench, model: ResponseModel, load: Array, name: str) -> Course:
    """The course of one axis: the normal one from nothing, shear along + on top of the working point's load."""
    column, most = AXES.index(name), bench.farthest[name]
    loads = np.tile(load, (COURSE, 1))
    loads[:, column] = np.linspace(0.0, most, COURSE)
    poses, said = pushed(bench.spec, loads, np.ones(COURSE, dtype=bool))
    found = model.on_pad(poses)
    wrong = _wrong(bench, found) | {INSTABILITY: np.array([note == TOO_SOFT for note in said])}
    firsts = {cause: int(np.argmax(bad)) for cause, bad in wrong.items() if bad.any()}
    if not firsts:
        return Course(loads, found, most, "strain")
    cause = min(firsts, key=lambda one: firsts[one])
    return Course(loads, found, float(loads[max(firsts[cause] - 1, 0), column]), cause)


def _wrong(bench: Bench, found: Response) -> dict[str, Flags]:
    """By cause, the points at which the axis has ended."""
    converter = bench.spec.readout.device
    least, most = converter.limit("amplitude_stable_min"), converter.limit("amplitude_max")
    return {
        "converter": np.any(~(found.frequency < converter.limit("sensor_frequency_max")), axis=1),
        "amplitude": np.any(~(found.amplitude > least) | (found.amplitude > most), axis=1),
        "contact": np.array([any("contact" in note for note in notes) for notes in found.notes]),
    }


@record(eq=False)
class Felt:
    """What a sensor feels by a bench, quick or solved; each is worked out when it is asked for."""

    layout: Layout
    estimates: Estimates
    bench: Bench

    @cached_property
    def working(self) -> SolvedRange:
        """The required loads with their readings, and the map that they give."""
        return solved_range(self.bench)

    @cached_property
    def points(self) -> tuple[Disturbed, ...]:
        """Rest, half and full load, what metal does left out."""
        return disturbed(self.bench, np.zeros(len(self.bench.rest)))

    @cached_property
    def warmed(self) -> tuple[Disturbed, ...]:
        """Rest, half and full load with what copper and other metal do."""
        warm = self.estimates.temperature + WARMER
        rough = SCREENING if self.estimates.is_rough else None
        warmer = estimated(self.layout, tolerance=rough, temperature=warm, solved=self.estimates.solved)
        return tuple(replace(one, by_metal=by_metal(self.estimates, warmer, self.bench.rest)) for one in self.points)

    @cached_property
    def held(self) -> tuple[bool, ...]:
        """At which of the points the pad holds the target: where it gives way, their figures mean nothing."""
        return tuple(map(bool, self.bench.is_held(working_loads(self.bench))))

    @cached_property
    def is_range_held(self) -> bool:
        """Whether the pad holds the target under all the required loads."""
        return bool(np.all(self.bench.is_held(self.working.loads)))

    @cached_property
    def units(self) -> Units:
        """Units as manufacture makes them."""
        return units_of(self.working, manufacturing_scatter(self.layout.spec, self.estimates))

    def friction(self, shear: str) -> dict[str, float]:
        """Errors of shear over normal at full load by cause (`Disturbed.friction`)."""
        full = self.warmed[-1]
        return full.friction(full.errors(self.units, self.working.map_errors), shear)


def can_feel(spec: SensorSpec, estimates: Estimates) -> bool:
    """Whether there are a target on its pad and tanks that the converter can count."""
    has_parts = spec.target is not None and spec.elastomer is not None and rests_on_pad(spec)
    return has_parts and estimates.readout.rcount is not None


def solved_performance(model: ResponseModel) -> Felt:
    """What a sensor feels by its response. Raises NoResponse without a pad."""

    def frequencies(poses: Array) -> Array:
        return model.on_pad(poses).frequency

    bench = Bench(model.spec, model.estimates, required_range(model.spec), frequencies, frequencies)
    return Felt(model.layout, model.estimates, bench)


def performance(
    felt: Felt, model: ResponseModel, twins: Callable[[], tuple[Loads, Loads] | None]
) -> tuple[Performance, ...]:
    """At rest, half and full load; nothing where target, elastomer or tank are missing, or where the pad gives way
    under full load. `twins` gives two loads of one reading (`Design.twins`).
    """
    if not can_feel(model.spec, model.estimates) or not all(felt.held):
        return ()
    alike = twins()
    return tuple(
        _at(_Working(at, point, felt, model, alike)) for (at, _), point in zip(POINTS, felt.warmed, strict=True)
    )


def disturbed(bench: Bench, metal: Array) -> tuple[Disturbed, ...]:
    """The working points of a bench; `metal` is what its metals' warmth does to readings at rest (per K; coils)."""
    loads = working_loads(bench)
    poses = bench.poses(loads)
    slopes = bench.slopes(poses)
    tilts = Tilts(bench, loads, poses)
    return tuple(
        Disturbed(bench, loads[k], share, poses[k], slopes[k], _inverted(bench, poses[k], slopes[k]), metal, tilts, k)
        for k, (_, share) in enumerate(POINTS)
    )


def working_loads(bench: Bench) -> Array:
    """The loads (3, 3; N) of the working points."""
    return np.array([[share * bench.full["normal"], 0.0, 0.0] for _, share in POINTS])


def _inverted(bench: Bench, pose: Array, by_pose: Array) -> Array:
    # Newtons per reading, (axes, coils), by least squares weighted with the noise.
    by_load = (by_pose @ bench.compliance(pose))[:, bench.range.columns]
    return np.asarray(np.linalg.pinv(by_load / bench.noise[:, None]) / bench.noise)


@record(eq=False)
class _Working:
    # One working point of all that is felt, what is asked for the response, and two loads of one reading.
    at: str
    point: Disturbed
    felt: Felt
    model: ResponseModel
    twins: tuple[Loads, Loads] | None


def _at(here: _Working) -> Performance:
    """What the sensor feels at one working point, a normal load (N) of the full one."""
    point, bench = here.point, here.point.bench
    names = bench.range.axes
    courses = {name: course(bench, here.model, point.load, name) for name in names}
    errors = point.errors(here.felt.units, here.felt.working.map_errors)
    curved, straight = crosstalk(here.felt.working, point.load, point.inverse)
    singular = np.linalg.svd(point.by_load * bench.range.full_scales, compute_uv=False)
    condition = float(singular[0] / max(singular[-1], 1e-300))
    shear = next((name for name in names if name != "normal"), None)
    scans, swings = 0.5 * bench.estimates.readout.scan_rate, resonances(bench, point.pose)
    tilt = bench.spec.requirements.tilt or DEGREE
    overload = courses["normal"].range if courses["normal"].limited_by == INSTABILITY else bench.overload
    free = bench.gives_way if bench.gives_way is not None and bench.gives_way < overload else None
    friction = point.friction(errors, shear) if shear is not None and point.share > 0.0 else {}
    return Performance(
        at=here.at, load=(float(point.load[0]), 0.0, 0.0), axes=_axes(here, courses, errors), crosstalk=curved,
        straight_crosstalk=straight, tilt_slope=_table(names, ("rx", "ry", "rz"), point.tilts),
        tilt=tilt, tilt_error=_table(names, ("rx", "ry"), point.tilt_errors(tilt)),
        contact_error=_table(names, ("x", "y"), np.nan_to_num(point.contact)),
        temperature_error=_row(names, point.temperature),
        temperature_causes={name: _row(names, value) for name, value in point.by_kelvin.items()},
        friction_error=float(np.hypot.reduce(list(friction.values()))) if friction else None,
        friction_causes=friction, bandwidth=min([scans, *swings.values()]),
        bandwidth_by=HALF_SCANS if scans <= min(swings.values(), default=scans) else RESONANCE, resonance=swings,
        condition_number=condition, invertible=here.felt.is_range_held and here.twins is None, ambiguous=here.twins,
        overload=overload, free_overload=free, map_degree=here.felt.working.map.degree,
        production=production_limits(bench.estimates), notes=(*_too_short(bench, courses), *_notes(here, free)),
    )


def _axes(here: _Working, courses: Mapping[str, Course], errors: Mapping[str, Array]) -> dict[str, AxisPerformance]:
    """What every axis of load feels at a working point."""
    bench, found = here.point.bench, {}
    frequencies = bench.frequencies(here.point.pose[None])[0]
    for k, name in enumerate(bench.range.axes):
        slopes = here.point.by_load[:, k] * frequencies
        found[name] = AxisPerformance(
            courses[name].range, courses[name].limited_by, bench.full[name], tuple(map(float, slopes)),
            float(errors["noise"][k]), _nonlinearity(here, name, k),
            {cause: float(error[k]) for cause, error in errors.items()},
        )
    return found


def _nonlinearity(here: _Working, name: str, k: int) -> float:
    """Largest distance of what the straight map reads from the best straight line, over the full scale."""
    loads = np.tile(here.point.load, (9, 1))
    loads[:, AXES.index(name)] = np.linspace(0.0, here.point.bench.full[name], 9)
    working = here.felt.working
    read = working.forward(loads[:, here.point.bench.range.columns]) @ here.point.inverse[k]
    line = np.polynomial.polynomial.Polynomial.fit(loads[:, AXES.index(name)], read, 1)
    return float(np.abs(read - line(loads[:, AXES.index(name)])).max() / max(np.ptp(read), 1e-300))


def _row(names: Sequence[str], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _table(names: Sequence[str], columns: Sequence[str], values: Array) -> dict[str, dict[str, float]]:
    return {name: _row(columns, values[k]) for k, name in enumerate(names)}


def production_limits(estimates: Estimates) -> dict[str, dict[str, float]]:
    """Limits of every coil's L and f before assembly: a coil outside is faulty even if it oscillates."""
    found = {}
    for coil in estimates.coils:
        free = coil.states.get(FREE)
        if free is None or free.spread is None:
            continue
        found[coil.name] = {
            "inductance_min_H": free.inductance - LIMITS * free.spread.inductance,
            "inductance_max_H": free.inductance + LIMITS * free.spread.inductance,
            "frequency_min_Hz": free.frequency - LIMITS * free.spread.frequency,
            "frequency_max_Hz": free.frequency + LIMITS * free.spread.frequency,
        }
    return found


def _too_short(bench: Bench, courses: Mapping[str, Course]) -> Iterator[str]:
    """Which axes end before their full scale, and by what."""
    for name, way in courses.items():
        if way.range < bench.full[name]:
            words = f"{name.replace('_', ' along ')} ends at {way.range:.3g} N by {way.limited_by}"
            yield f"{words}, before its full scale of {bench.full[name]:.3g} N: the sensor does not reach it"


def _notes(here: _Working, free: float | None) -> tuple[str, ...]:
    """What whoever reads the performance has to know; `free` is its free overload (N)."""
    names, pad = here.point.bench.range.axes, here.point.bench.spec.elastomer
    assert pad is not None
    sooner = "" if free is None else f"; under one that is free to tilt the pad gives way sideways at {free:.3g} N"
    found = [
        f"noise by {here.point.bench.spec.readout.device.source_of('noise_law')}; it is what can be told "
        "apart from one moment to the next, not how true a force is",
        f"hysteresis, creep and temperature of the pad: {pad.material.loss_source}",
        "the target is kept level, as by a face that it sticks to (in calibration/ of a package, too): a shear load "
        "above the pad tilts a free one, which reads otherwise (rotation=free of a load, calibrate --rotation free); "
        f"only the error by a force beside the middle is that of a free target{sooner}",
        "full scales are the required forces, else 20 % strain of the pad and shear at a friction of 0.42 (at most "
        "half the pad's thickness); shear axes carry their share of it where errors grow with the load",
        f"crosstalk is what a polynomial of degree {here.felt.working.map.degree} in the readings leaves of this "
        "design; what one unit differs by from the next is apart from it: the data sheet's table of errors from unit "
        "to unit",
        "how fast the silicone follows is in no data: its hysteresis, measured slowly, stands for its lag; the "
        "resonance is that of target and pad with nothing on them, and tissue lowers it",
    ]
    found += _beyond_the_law(here.point.bench)
    if not here.felt.is_range_held:
        found.append("the pad gives way sideways within the full scales: no reading there is known to be of one load")
    if len(names) < len(AXES):
        found.append(f"the array tells {', '.join(names)} apart; what the other axes do to these is among the errors")
    return tuple(found)


def _beyond_the_law(bench: Bench) -> list[str]:
    """Where full scales and ranges lie beyond what the pad's law was held against; nothing where none do."""
    pressed, found = bench.estimates.compression, []
    if pressed is not None and not pressed.valid:
        found.append(f"every force here hangs on a law that is not within its range: {pressed.note}")
    held, named = held_shear(bench.spec), [name for name in bench.range.axes if name != "normal"]
    if named and max(bench.full[name] for name in named) > held:
        found.append(beyond_held_shear(held))
    return found
