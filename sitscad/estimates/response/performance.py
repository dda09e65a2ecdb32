"""What the sensor feels, in newtons: range, resolution, nonlinearity, crosstalk and errors by cause, at working points.

Everything is after a tare at rest and after the linear inverse of the map at the working point: weighted least squares
of the coils' frequencies, each with its own noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.derivatives import compliance, slopes
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import holding, pushed
from sitscad.estimates.response.values import Response
from sitscad.estimates.states.pressing import loaded_face, rests_on_pad
from sitscad.mechanics.elastomer import VALID_SHEAR, VALID_STRAIN
from sitscad.readout import FAMILIES
from sitscad.record import record
from sitscad.scene.state import FREE, PRESSED, REST
from sitscad.spec.sensor import ArraySpec, SensorSpec

Array = NDArray[np.float64]

AXES = ("normal", "shear_x", "shear_y")

HYSTERESIS = {"normal": 0.0971, "shear_x": 0.0877, "shear_y": 0.0877}
"""Of full scale: measured on Ecoflex 00-30 under 8 mm targets (Jones, thesis, 7.3.2); other silicones differ."""

RUBBER = 1.0 / 293.15
"""Relative rise of a rubber's shear modulus with temperature (1/K): mu = N k T (Treloar, The Physics of Rubber
Elasticity, 1975, chapter 4); filled silicones rise less."""

SLIP = 0.42
"""Shear over normal at slip on tissue (Jones, thesis, 4.4)."""

SINGULAR = 0.01
"""Least singular value over the largest, in full scales, with which a map counts as one that can be inverted."""

STEPS = 13
"""Loads along an axis that are looked at for range and nonlinearity."""

LEVEL = np.ones(STEPS, dtype=bool)
"""The target is held level in all working points and ranges."""

LIMITS = 3.0
"""Standard deviations of manufacture between which a coil before assembly counts as sound."""


@record
class AxisPerformance:
    """One axis at a working point: range (N) and what ends it, sensitivity of every coil (Hz/N), resolution (N, one
    sigma of noise at the scan rate), nonlinearity (of the range, by the working point's straight map), and one sigma of
    errors (N) by cause.
    """

    range: float
    limited_by: str
    sensitivity: tuple[float, ...]
    resolution: float
    nonlinearity: float
    errors: Mapping[str, float] = field(default_factory=dict)


@record
class Performance:
    """The sensor at a working point `at` (rest, half, full) under `load` (N): see `AxisPerformance`.

    `crosstalk[a][b]` is the error of axis a per full scale of b, over a's; `tilt_error` (N/rad) by axis and angle;
    `temperature_error` (N/K); `friction_error` that of shear over normal (None without shear or at rest).
    """

    at: str
    load: tuple[float, float, float]
    axes: Mapping[str, AxisPerformance]
    crosstalk: Mapping[str, Mapping[str, float]]
    tilt_error: Mapping[str, Mapping[str, float]]
    temperature_error: Mapping[str, float]
    friction_error: float | None
    bandwidth: float
    condition_number: float
    invertible: bool
    overload: float
    production: Mapping[str, Mapping[str, float]]
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, object]:
        """As the contract's JSON has it."""
        return {
            "at": self.at,
            "load_N": dict(zip(AXES, self.load, strict=True)),
            "axes": {name: _axis_document(axis) for name, axis in self.axes.items()},
            "crosstalk": {a: dict(row) for a, row in self.crosstalk.items()},
            "tilt_error_N_per_rad": {a: dict(row) for a, row in self.tilt_error.items()},
            "temperature_error_N_per_K": dict(self.temperature_error),
            "friction_error": self.friction_error,
            "bandwidth_Hz": self.bandwidth,
            "condition_number": self.condition_number,
            "invertible": self.invertible,
            "overload_N": self.overload,
            "production": {coil: dict(limits) for coil, limits in self.production.items()},
            "notes": list(self.notes),
        }


def _axis_document(axis: AxisPerformance) -> dict[str, object]:
    return {
        "range_N": axis.range,
        "limited_by": axis.limited_by,
        "sensitivity_Hz_per_N": list(axis.sensitivity),
        "resolution_N": axis.resolution,
        "nonlinearity": axis.nonlinearity,
        "errors_N": dict(axis.errors),
    }


def axes_told_apart(array: ArraySpec) -> tuple[str, ...]:
    """The axes that the coils of an array can tell apart: one coil the normal force alone, coils in a line also shear
    along it, others all three.
    """
    places = np.array([place.centre for place in array.placements])
    away = places - places.mean(axis=0)
    spread = np.linalg.svd(away, compute_uv=False)
    if len(places) == 1:
        return AXES[:1]
    if len(places) > 2 and spread[1] > 1e-3 * spread[0]:
        return AXES
    along = np.abs(away[np.argmax(np.hypot(*away.T))])
    return ("normal", "shear_x" if along[0] >= along[1] else "shear_y")


def performance(model: ResponseModel) -> tuple[Performance, ...]:
    """At rest, half and full load (the required normal force, else what presses the pad by 20 %); nothing where target,
    elastomer or tank are missing.
    """
    spec = model.spec
    if (
        spec.target is None
        or spec.elastomer is None
        or not rests_on_pad(spec)
        or model.estimates.readout.rcount is None
    ):
        return ()
    full = spec.requirements.normal_force or _normal_at(spec, 0.2)
    return tuple(_at(model, name, share * full, full) for name, share in (("rest", 0.0), ("half", 0.5), ("full", 1.0)))


def _normal_at(spec: SensorSpec, strain: float) -> float:
    pad = spec.elastomer
    assert pad is not None
    held = holding(spec, np.array([[0.0, 0.0, -strain * pad.thickness, 0.0, 0.0, 0.0]]))
    assert held is not None
    return -float(held[0][0, 2])


@record(eq=False)
class _Point:
    # A working point: its load, the axes, what the coils read there, d frequency by pose and by load, the inverse map.
    model: ResponseModel
    load: Array
    names: tuple[str, ...]
    reading: Response
    by_pose: Array
    by_load: Array
    noise: Array
    share: float

    def carried(self, name: str, most: float) -> float:
        """The force (N) that goes with the working point on an axis: of shear the required one's share, else that of a
        friction of 0.42, no more than its range.
        """
        if name == "normal":
            return float(self.load[0])
        asked = self.model.spec.requirements.shear_force
        return min(SLIP * float(self.load[0]) if asked is None else self.share * asked, most)

    @property
    def columns(self) -> list[int]:
        return [AXES.index(name) for name in self.names]

    @property
    def inverse(self) -> Array:
        # Newtons per hertz, (axes, coils), by least squares weighted with the noise.
        slopes = self.by_load[:, self.columns] / self.noise[:, None]
        return np.asarray(np.linalg.pinv(slopes) / self.noise)


def _at(model: ResponseModel, at: str, normal: float, full: float) -> Performance:
    spec, names = model.spec, axes_told_apart(model.spec.array)
    load = np.array([[normal, 0.0, 0.0]])
    pose = pushed(spec, load)[0]
    reading = model.under(load)
    by_pose = slopes(model, pose)[0]
    by_load = by_pose @ compliance(model, pose)[0]
    point = _Point(model, load[0], names, reading, by_pose, by_load,
                   _noise(model, reading.frequency[0]), normal / full)  # fmt: skip
    ranges = {name: _range(point, name) for name in names}
    lines = {name: _line(point, name, ranges[name][0]) for name in names}
    inverse = point.inverse
    crosstalk = {a: {b: float(lines[b][k] / ranges[a][0]) for b in names if b != a} for k, a in enumerate(names)}
    tilt = {a: dict(zip(("rx", "ry", "rz"), map(float, inverse[k] @ by_pose[:, 3:]), strict=True))
            for k, a in enumerate(names)}  # fmt: skip
    errors = {name: _errors(point, name, ranges[name][0]) for name in names}
    axes = {
        name: AxisPerformance(
            ranges[name][0], ranges[name][1], tuple(map(float, by_load[:, AXES.index(name)])),
            errors[name]["noise"], _nonlinearity(point, name, ranges[name][0]), errors[name],
        )
        for name in names
    }  # fmt: skip
    scaled = by_load[:, point.columns] / reading.frequency[0][:, None] * np.array([ranges[name][0] for name in names])
    singular = np.linalg.svd(scaled, compute_uv=False)
    temperature = {name: RUBBER * (normal if name == "normal" else 0.0) for name in names}
    return Performance(
        at, (normal, 0.0, 0.0), axes, crosstalk, tilt, temperature, _friction(spec, axes, normal),
        0.5 * model.estimates.readout.scan_rate, float(singular[0] / max(singular[-1], 1e-300)),
        bool(singular[-1] > SINGULAR * singular[0]), _normal_at(spec, VALID_STRAIN), _production(model),
        _notes(spec, names),
    )  # fmt: skip


def _noise(model: ResponseModel, frequency: Array) -> Array:
    readout, family = model.estimates.readout, FAMILIES[model.spec.readout.device.family]
    assert readout.rcount is not None
    return np.array([family.measured_noise(float(f), readout.rcount) for f in frequency])


def _along(point: _Point, name: str, last: float) -> tuple[Array, Response]:
    # Loads from the working point along one axis (the normal one from nothing), and what the coils read.
    loads = np.tile(point.load, (STEPS, 1))
    loads[:, AXES.index(name)] = np.linspace(0.0, last, STEPS)
    return loads, point.model.under(loads, LEVEL[: len(loads)])


def _range(point: _Point, name: str) -> tuple[float, str]:
    """How far (N) the axis may go, and what ends it first."""
    spec, family = point.model.spec, FAMILIES[point.model.spec.readout.device.family]
    pad = spec.elastomer
    assert pad is not None
    most = _normal_at(spec, VALID_STRAIN)
    if name != "normal":
        most = VALID_SHEAR * pad.material.shear_modulus * loaded_face(spec)[0].area
    loads, found = _along(point, name, most)
    wrong = {
        "converter": np.any(~(found.frequency < family.limit("sensor_frequency_max")), axis=1),
        "amplitude": np.any(~(found.amplitude > family.limit("amplitude_stable_min")), axis=1),
        "contact": np.array([any("contact" in note for note in notes) for notes in found.notes]),
    }
    firsts = {cause: int(np.argmax(bad)) for cause, bad in wrong.items() if bad.any()}
    if not firsts:
        return most, "strain"
    cause = min(firsts, key=lambda one: firsts[one])
    before = max(firsts[cause] - 1, 0)
    return max(float(loads[before, AXES.index(name)]), 1e-3 * most), cause


def _line(point: _Point, name: str, last: float) -> Array:
    # Errors (N) of all axes by the working point's linear map when one goes from the point to its full scale.
    loads = np.tile(point.load, (2, 1))
    loads[1, AXES.index(name)] = last
    frequency = point.model.under(loads, LEVEL[:2]).frequency
    read = point.inverse @ (frequency[1] - frequency[0])
    return np.asarray(np.abs(read - (loads[1] - loads[0])[point.columns]))


def _nonlinearity(point: _Point, name: str, last: float) -> float:
    """Largest distance of what the linear map reads from the best straight line, over the range."""
    loads, found = _along(point, name, last)
    k = point.names.index(name)
    read = (found.frequency - found.frequency[0]) @ point.inverse[k]
    force = loads[:, AXES.index(name)]
    line = np.polynomial.polynomial.Polynomial.fit(force, read, 1)
    return float(np.abs(read - line(force)).max() / max(np.ptp(read), 1e-300))


def _errors(point: _Point, name: str, full: float) -> dict[str, float]:
    """One sigma (N) by cause; tilt is one degree about x or y, the worse way; the modulus is before a calibration."""
    k, pad = point.names.index(name), point.model.spec.elastomer
    assert pad is not None
    inverse, force = point.inverse[k], point.carried(name, full)
    degree = math.radians(1.0)
    return {
        "noise": float(np.hypot.reduce(inverse * point.noise)),
        "hysteresis": HYSTERESIS[name] * full,
        "modulus": pad.material.shear_modulus_sigma * force,
        "temperature per 10 K": 10.0 * RUBBER * force,
        "tilt of 1 degree": degree * float(np.hypot(*(inverse @ point.by_pose[:, 3:5]))),
        "twist of 1 degree": degree * abs(float(inverse @ point.by_pose[:, 5])),
        "manufacture, before calibration": _manufacture(point, inverse),
    }


def _manufacture(point: _Point, inverse: Array) -> float:
    # Shifts of the frequency from rest to pressed by every tolerance, as far as this point is on the way.
    coils, full = point.model.estimates.coils, point.model.estimates.normal_force
    if not full or any(coil.states.get(s) is None or coil.states[s].spread is None for coil in coils
                       for s in (REST, PRESSED)):  # fmt: skip
        return 0.0
    shifts: dict[str, list[float]] = {}
    for n, coil in enumerate(coils):
        rest, pressed = coil.states[REST].spread, coil.states[PRESSED].spread
        assert rest is not None and pressed is not None
        for cause in {*rest.shifts, *pressed.shifts}:
            moved = pressed.shifts.get(cause, (0.0, 0.0))[1] - rest.shifts.get(cause, (0.0, 0.0))[1]
            shifts.setdefault(cause, [0.0] * len(coils))[n] = moved
    found = [float(inverse @ np.array(values)) for values in shifts.values()]
    return math.hypot(*found) * float(point.load[0]) / full


def _friction(spec: SensorSpec, axes: Mapping[str, AxisPerformance], normal: float) -> float | None:
    """Error of shear over normal at the required shear (else that at slip)."""
    shears = [name for name in axes if name != "normal"]
    if not shears or normal <= 0.0:
        return None
    shear = spec.requirements.shear_force or SLIP * normal
    causes = ("noise", "hysteresis")
    one, other = (math.hypot(*(axes[name].errors[cause] for cause in causes)) for name in (shears[0], "normal"))
    return shear / normal * math.hypot(one / shear, other / normal)


def _production(model: ResponseModel) -> dict[str, dict[str, float]]:
    """Limits of every coil's L and f before assembly: a coil outside is faulty even if it oscillates."""
    found = {}
    for coil in model.estimates.coils:
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


def _notes(spec: SensorSpec, names: Sequence[str]) -> tuple[str, ...]:
    pad = spec.elastomer
    assert pad is not None
    found = [
        "noise by the law measured on an LDC1614: 1.2 steps of 1/(32 RCOUNT) of the frequency; it is what can be told "
        "apart from one moment to the next, not how true a force is",
        f"hysteresis is that of Ecoflex 00-30 under 8 mm targets (9.71 and 8.77 % of full scale), whatever "
        f"{pad.material.name} has",
        "the target is held level: a shear load above the pad tilts a free one, which goes several times as far",
        "crosstalk is what the straight map at the point leaves; a calibrated, curved one takes most of it",
        "temperature: the modulus of an ideal rubber alone; its expansion, the coil's copper and the capacitor go with "
        "the tare",
    ]
    if len(names) < len(AXES):
        found.append(f"the array tells {', '.join(names)} apart; what the other axes do to these is not seen")
    return tuple(found)
