"""What the sensor feels, in newtons: range, resolution, nonlinearity, crosstalk and errors by cause, at working points.

Everything is after a tare at rest. Disturbances go through the straight inverse of the map at the working point:
weighted least squares of the coils' readings (ln of the frequency over that at rest), each with its own noise;
crosstalk and manufacture go through the curved map of the whole working range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates import estimated
from sitscad.estimates.performance.bench import Bench, Solved, bench_of, beyond_held_shear, held_shear
from sitscad.estimates.performance.causes import WARMER, Disturbed, by_metal
from sitscad.estimates.performance.inverse import WorkingRange, crosstalk, working_range
from sitscad.estimates.performance.mechanics import resonances
from sitscad.estimates.performance.reach import INSTABILITY, Course, course
from sitscad.estimates.performance.scatter import manufacturing_scatter
from sitscad.estimates.performance.tilts import DEGREE, Tilts
from sitscad.estimates.performance.units import Units, units_of
from sitscad.estimates.performance.values import AXES, AxisPerformance, Loads, Performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.states.pressing import rests_on_pad
from sitscad.estimates.values import Estimates
from sitscad.record import record
from sitscad.scene.state import FREE

Array = NDArray[np.float64]

LIMITS = 3.0
"""Standard deviations of manufacture between which a coil before assembly counts as sound."""

HALF_SCANS, RESONANCE = "half the scan rate", "resonance of target and pad"
"""What a bandwidth is limited by."""

POINTS = (("rest", 0.0), ("half", 0.5), ("full", 1.0))
"""The working points, and their share of the full normal force."""


def performance(model: ResponseModel, twins: Callable[[], tuple[Loads, Loads] | None]) -> tuple[Performance, ...]:
    """At rest, half and full load (`Bench.full`); nothing where target, elastomer or tank are missing, or where the pad
    gives way under full load. `twins` gives two loads of one reading (`Design.twins`).
    """
    spec = model.spec
    if spec.target is None or spec.elastomer is None or not rests_on_pad(spec):
        return ()
    if model.estimates.readout.rcount is None:
        return ()
    solved = Solved(model)
    bench = bench_of(spec, model.estimates, solved.frequencies)
    if not bench.is_held(working_loads(bench)).all():
        return ()
    working = working_range(bench)
    units = units_of(working, manufacturing_scatter(spec, model.estimates))
    warm = model.estimates.temperature + WARMER
    warmer = estimated(model.layout, temperature=warm, solved=model.estimates.solved)
    metal = by_metal(model.estimates, warmer, bench.rest)
    points, alike = disturbed(bench, metal), twins()
    return tuple(
        _at(_Working(at, point, working, units, solved, alike)) for (at, _), point in zip(POINTS, points, strict=True)
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
    by_load = (by_pose @ bench.compliance(pose))[:, bench.columns]
    return np.asarray(np.linalg.pinv(by_load / bench.noise[:, None]) / bench.noise)


@record(eq=False)
class _Working:
    # One working point, the map of the range, units, what the response is asked through, and two loads of one reading.
    at: str
    point: Disturbed
    working: WorkingRange
    units: Units
    solved: Solved
    twins: tuple[Loads, Loads] | None

    @property
    def is_held(self) -> bool:
        """Whether the pad holds the target all over the working range."""
        return bool(self.point.bench.is_held(self.working.loads).all())


def _at(here: _Working) -> Performance:
    """What the sensor feels at one working point, a normal load (N) of the full one."""
    point, bench = here.point, here.point.bench
    names = bench.names
    courses = {name: course(bench, here.solved, point.load, name) for name in names}
    errors = point.errors(here.units, here.working.map_errors)
    curved, straight = crosstalk(here.working, point.load, point.inverse)
    singular = np.linalg.svd(point.by_load * bench.full_scales, compute_uv=False)
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
        condition_number=condition, invertible=here.is_held and here.twins is None, ambiguous=here.twins,
        overload=overload, free_overload=free, map_degree=here.working.map.degree,
        production=_production(bench.estimates), notes=(*_too_short(bench, courses), *_notes(here, free)),
    )  # fmt: skip


def _axes(here: _Working, courses: Mapping[str, Course], errors: Mapping[str, Array]) -> dict[str, AxisPerformance]:
    """What every axis of load feels at a working point."""
    bench, found = here.point.bench, {}
    frequencies = bench.frequencies(here.point.pose[None])[0]
    for k, name in enumerate(bench.names):
        slopes = here.point.by_load[:, k] * frequencies
        found[name] = AxisPerformance(
            courses[name].range, courses[name].limited_by, bench.full[name], tuple(map(float, slopes)),
            float(errors["noise"][k]), _nonlinearity(here, name, k),
            {cause: float(error[k]) for cause, error in errors.items()},
        )  # fmt: skip
    return found


def _nonlinearity(here: _Working, name: str, k: int) -> float:
    """Largest distance of what the straight map reads from the best straight line, over the full scale."""
    loads = np.tile(here.point.load, (9, 1))
    loads[:, AXES.index(name)] = np.linspace(0.0, here.point.bench.full[name], 9)
    working = here.working
    read = working.forward(loads[:, here.point.bench.columns]) @ here.point.inverse[k]
    line = np.polynomial.polynomial.Polynomial.fit(loads[:, AXES.index(name)], read, 1)
    return float(np.abs(read - line(loads[:, AXES.index(name)])).max() / max(np.ptp(read), 1e-300))


def _row(names: Sequence[str], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _table(names: Sequence[str], columns: Sequence[str], values: Array) -> dict[str, dict[str, float]]:
    return {name: _row(columns, values[k]) for k, name in enumerate(names)}


def _production(estimates: Estimates) -> dict[str, dict[str, float]]:
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
    names, pad = here.point.bench.names, here.point.bench.spec.elastomer
    assert pad is not None
    sooner = "" if free is None else f"; under one that is free to tilt the pad gives way sideways at {free:.3g} N"
    found = [
        f"noise by {here.point.bench.spec.readout.device.source_of('noise_law')}; it is what can be told "
        "apart from one moment to the next, not how true a force is",
        f"hysteresis, creep and temperature of the pad: {pad.material.losses.source}",
        "the target is kept level, as by a face that it sticks to (in calibration/ of a package, too): a shear load "
        "above the pad tilts a free one, which reads otherwise (--rotation free is for that); only the error "
        f"by a force beside the middle is that of a free target{sooner}",
        "full scales are the required forces, else 20 % strain of the pad and shear at a friction of 0.42 (at most "
        "half the pad's thickness); shear axes carry their share of it where errors grow with the load",
        f"crosstalk is what a polynomial of degree {here.working.map.degree} in the readings leaves of this design; "
        "what one unit differs by from the next is apart from it: the data sheet's table of errors from unit to unit",
        "how fast the silicone follows is in no data: its hysteresis, measured slowly, stands for its lag; the "
        "resonance is that of target and pad with nothing on them, and tissue lowers it",
    ]
    found += _beyond_the_law(here.point.bench)
    if not here.is_held:
        found.append("the pad gives way sideways within the full scales: no reading there is known to be of one load")
    if len(names) < len(AXES):
        found.append(f"the array tells {', '.join(names)} apart; what the other axes do to these is among the errors")
    return tuple(found)


def _beyond_the_law(bench: Bench) -> list[str]:
    """Where full scales and ranges lie beyond what the pad's law was held against; nothing where none do."""
    pressed, found = bench.estimates.compression, []
    if pressed is not None and not pressed.valid:
        found.append(f"every force here hangs on a law that is not within its range: {pressed.note}")
    held, named = held_shear(bench.spec), [name for name in bench.names if name != "normal"]
    if named and max(bench.full[name] for name in named) > held:
        found.append(beyond_held_shear(held))
    return found
