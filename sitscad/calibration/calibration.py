"""The calibration of a design: before measurements its expected errors, after measurements the map of one sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from sitscad.assembly.places.motions import ROTATIONS
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.drift_fit import DriftFit
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.map_fit import error_by_unknowns, error_for_other_sensors, fit_unit_map
from sitscad.calibration.misfit import unusual_unknowns
from sitscad.calibration.model_fit import SUSPECT, ModelFit, NoFit, fit_model
from sitscad.calibration.points import Plan, Points, plan_loads
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.temperature_plan import TemperaturePlan, temperature_plan
from sitscad.calibration.unknowns import PAD_ERRORS, POSE_ERRORS, SURELY, WIDEST
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.loads.working_range import working_range
from sitscad.estimates.performance.inversion import Crosstalk, axis_sweeps, map_crosstalk
from sitscad.estimates.performance.points import SensingAnalysis
from sitscad.estimates.performance_values import (
    AXES,
    AXIS_WORDS,
    FORCES,
    amount_text,
    axis_names_text,
    full_scale_text,
    split_by_unit,
)
from sitscad.estimates.response.model import ResponseModel
from sitscad.kernels.electromagnetics.threads import one_thread

USUAL_POINTS, FEWEST, MOST = 8, 3, 40  # Numbers of loads of a plan besides the tare: default, least and largest
"""Number of loads in a plan without the rows at rest: default, least and largest."""

SHOWN = (3, 5)  # Numbers of points whose error is shown besides the whole plan's
"""Numbers of calibration points for which the expected error is shown, in addition to all points of the plan."""
TARES = 3  # Rows without load needed to separate noise from drift: at the start, in the middle, at the end
"""Number of rows without load needed to separate noise from drift: at the start, in the middle and at the end."""
MAX_SURROGATES = 3  # Largest number of surrogates made in turn about a fitted sensor
"""Largest number of successive surrogates that are made about a fitted sensor."""

MAX_EXCESS_RATIO = 2.0
"""Largest ratio of `ModelFit.excess` between a fit and the preceding fit, which used the preceding surrogate.

If the ratio is larger, the preceding fit is used, because the new surrogate is then far from all sensors of the design.
"""

STATED_FRACTION = 0.95
"""Fraction of simulated sensors whose force error is below the stated error.

Only sensors that agree with the measured points are counted.
"""


@record(eq=False)
class ForceError:
    """Force error of one group of sensors.

    `error` (axes; N, or N m for moments) is the rms error over the working range. ``of`` is the text that describes the
    group and states whether the error is a standard deviation or a 95 % limit. ``points`` is the number of calibration
    points of each sensor. None if the sensor is read without a tare.
    """

    of: str
    points: int | None
    error: Array


@record(eq=False)
class Calibration:
    """A map from readings to forces, with its origin.

    `plan` lists the loads to measure; None if there are measured points. `fit` has the sensor's unknowns as the points
    give them, `remarks` the remarks on the table. `sigma` (axes; N) is one sigma of the error of a measured sensor, and
    95 % stay below `map.error`; None if there are no points.
    `turned` lists readings of full shear (axis; N applied; N read) if the target tilts against the map's assumption.
    `cell` is the number of the cell, from 1; None if the sensor has no cells. `temperatures` are the planned rows at
    further temperatures, and `drift` the fit of the drift to such rows; None if there are no such rows.
    """

    sensors: Sensors
    map: InverseMap
    plan: Plan | None = None
    points: Points | None = None
    fit: ModelFit | None = None
    remarks: tuple[str, ...] = ()
    turned: tuple[tuple[str, float, float], ...] = ()
    cell: int | None = None
    sigma: Array | None = None
    temperatures: TemperaturePlan | None = None
    drift: DriftFit | None = None

    def __repr__(self) -> str:
        """Return a line with the sensor, and the number of its calibration points."""
        points = "as drawn" if self.points is None else f"calibrated with {len(self.points.at_rest)} points"
        return f"<Calibration of {self.map.sensor}, {points}: {', '.join(self.map.axes)}>"

    @property
    def table_coils(self) -> tuple[str, ...]:
        """Names of the coils in a table of points: the coils of the map, and a reference coil if the fit needs it."""
        planned = self.temperatures
        return self.sensors.coils if planned is None or not planned.reference else (
            *self.sensors.coils, planned.reference)

    @property
    def planned_rows(self) -> tuple[Array, Array | None]:
        """Loads of the plan in turn (n, 3 or 5; N, N m), and their temperatures (n; degrees Celsius).

        The temperatures are None if all rows are at one temperature.
        """
        assert self.plan is not None
        return (self.plan.rows, None) if self.temperatures is None else self.temperatures.rows(self.plan)

    @property
    def unit_errors(self) -> tuple[ForceError, ...]:
        """Errors of forces for several kinds of units. All documents use these rows."""
        if self.plan is None:
            points = 0 if self.points is None else int(np.sum(~self.points.at_rest))
            unit = f"this unit, calibrated with {points} points"
            deviation = [] if self.sigma is None else [ForceError(f"{unit}: one sigma", points, self.sigma)]
            return (*deviation, ForceError(f"{unit}: {100.0 * STATED_FRACTION:.0f} % stay below", points,
                                           self.map.error))
        errors = [ForceError("any unit, read without a tare", None, self.plan.errors_without_tare),
                 ForceError("any unit after its tare, not calibrated", 0, self.map.error)]
        some = sorted({number for number in SHOWN if number < len(self.plan.loads)} | {len(self.plan.loads)})
        return (*errors, *(ForceError(f"a unit calibrated with {number} points", number, self.plan.errors[number])
                          for number in some))

    @property
    def error_rows(self) -> tuple[tuple[str, ...], ...]:
        """Errors of every unit as texts, one row per unit, below a heading with the full scales."""
        full = self.map.full_scale
        head = "error over all loads, of", *(f"{AXIS_WORDS[name]}, of {amount_text(size, name, 4)}"
                                          for name, size in zip(self.map.axes, full, strict=True))
        return (head, *((each.of, *(full_scale_text(error, size, name) for error, size, name
                                   in zip(each.error, full, self.map.axes, strict=True))) for each in self.unit_errors))

    @cached_property
    def crosstalk(self) -> Crosstalk:
        """Crosstalk of this map for the sensor as drawn, at half the normal force.

        `Performance.crosstalk` differs: it is the error of a polynomial in the readings.
        """
        scope, none = self.sensors.range, np.zeros(len(self.sensors.unknowns))
        loads = axis_sweeps(scope, scope.normal_load(0.5 * scope.normal))
        put_on = np.vstack([scope.normal_load(0.0), loads.reshape(-1, scope.width)])
        frequency = self.sensors.frequencies_under(none, put_on, exact=True)
        return map_crosstalk(scope, loads, self.map(frequency[1:], frequency[0]))

    @property
    def errors_are(self) -> str:
        """Text that explains `unit_errors`."""
        tilts = ROTATIONS[self.sensors.rotation]
        if self.plan is None:
            return (f"Error of the force, rms over all loads, the target {tilts}, of the sensors which these points "
                    f"may come from: one sigma, as in the data sheet, and what {100.0 * STATED_FRACTION:.0f} % of "
                    f"them stay "
                    "below. Noise, hysteresis, creep and temperature come on top.")
        return (f"One sigma of the force from unit to unit, over all loads, the target {tilts}, to first order for "
                "pads about as stiff as drawn: a unit with a much softer one is off by more, as its own calibration "
                "says. Noise, hysteresis, creep and temperature come on top.")

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the calibration."""
        notes = [*self.sensors.range.notes, *self.remarks]
        if self.turned:
            this = self.sensors.rotation
            (other,) = (each for each in ROTATIONS if each != this)
            text = ", ".join(
                f"{force:.3g} N of {AXIS_WORDS[name]} as {read:.3g} N" for name, force, read in self.turned
            )
            notes.append(f"made for a target that is {ROTATIONS[this]}. If the target is {ROTATIONS[other]}, the map "
                         f"reads {text} (under half of the full normal force). `sitscad calibrate --rotation {other}` "
                         "makes the other map")
        if not set(FORCES) <= set(self.map.axes):
            notes.append(f"measured: {axis_names_text(self.map.axes)} alone; forces along other axes appear as these")
        if self.fit is not None:
            notes += unusual_unknowns(self.sensors, self.fit)
        if self.points is not None and np.sum(self.points.at_rest) < TARES:
            notes.append("fewer than three rows without load: noise of the readings is not told from drift, nor a slip "
                         "in the tare; take it again in the middle of the rows and at their end")
        if self.fit is not None and not self.fit.settled:
            notes.append("the fit of the model did not settle: its unknowns are not to be trusted")
        return tuple(notes)

    @property
    def moved(self) -> Mapping[str, Mapping[str, float]]:
        """Fitted values of the unknowns by name: value, change in standard deviations, and sigma after and before.

        Empty without a fit.
        """
        if self.fit is None:
            return {}
        rows = zip(self.sensors.unknowns, self.fit.errors, self.fit.moved, self.fit.sigma, strict=True)
        return {each.name: {"value": float(value), "moved_by_sigmas": float(moved),
                           "sigma": float(sure * each.sigma), "sigma_before": each.sigma}
                for each, value, moved, sure in rows if each.is_fitted}

    def document(self) -> dict[str, Any]:
        """Return the whole calibration as plain values for JSON."""
        full = self.map.full_scale
        values: dict[str, Any] = {
            "map": self.map.document(), "form": self.map.form, "is_calibrated": self.fit is not None,
            "rotation": self.sensors.rotation,
            **split_by_unit("error_", "", dict(zip(self.map.axes, self.map.error.tolist(), strict=True))),
            "error_of_full_scale": dict(zip(self.map.axes, (self.map.error / full).tolist(), strict=True)),
            "unit_errors": [{"of": each.of, "points": each.points,
                             **split_by_unit("error_", "", dict(zip(self.map.axes, each.error.tolist(), strict=True)))}
                            for each in self.unit_errors], "errors_are": self.errors_are,
            "unknowns": {name: dict(row) for name, row in self.moved.items()}, "notes": list(self.notes),
        }
        if self.plan is not None:
            is_force, count = [name in FORCES for name in self.map.axes], len(FORCES)
            values["plan"] = {"loads_N": self.plan.loads[:, :count].tolist(),
                              "expected_error_N": self.plan.errors[:, is_force].tolist()}
            if self.sensors.range.has_moments:
                values["plan"] |= {"loads_Nm": self.plan.loads[:, count:].tolist(),
                                   "expected_error_Nm": self.plan.errors[:, [not each for each in is_force]].tolist()}
        if self.plan is not None and self.temperatures is not None:
            values["plan"] |= {"further_temperatures_degC": list(self.temperatures.others),
                               "soak_s": self.temperatures.soak}
        if self.fit is not None and self.points is not None:
            values["points"] = len(self.points)
            values["errors_larger_than_expected"] = self.fit.excess
        if self.drift is not None:
            left = dict(zip(self.map.axes, self.drift.error(self.drift.span).tolist(), strict=True))
            values["drift"] = {**self.drift.document(), **split_by_unit("left_", "", left)}
        return values


@lru_cache(maxsize=4)
@one_thread
def plan_calibration(model: ResponseModel, is_held: bool = True, count: int = USUAL_POINTS) -> Calibration:
    """Return the planned loads of a calibration, and the map of the nominal sensor.

    The map's error is stated for manufactured sensors.

    `count` is the number of loads. Raises NoResponse if the design has no oscillating tank or no pad, and ValueError
    for too few or too many loads.
    """
    if not FEWEST <= count <= MOST:
        raise ValueError(f"{FEWEST} to {MOST} points are planned, not {count}")
    sensors = simulated_sensors(model, is_held)
    nominal, planned = fit_unit_map(sensors, np.zeros(len(sensors.unknowns))), plan_loads(sensors, count)
    # The error after a tare alone comes from simulated units, not from first order; points cannot increase it. The
    # map's own error remains with any points, and is no smaller on units that differ from the drawing.
    untold = np.maximum(error_for_other_sensors(sensors, nominal), nominal.error)
    errors = np.vstack([untold, np.minimum(np.hypot(planned.errors[1:], nominal.error), untold)])
    nominal = replace(nominal, error=untold)
    calibration = Calibration(sensors, nominal, replace(planned, errors=errors))
    return replace(calibration, turned=forces_with_wrong_rotation(calibration, np.zeros(len(sensors.unknowns))))


def with_temperatures(calibration: Calibration, sensing: SensingAnalysis, reference: str) -> Calibration:
    """Return a calibration with the design's coefficients of drift, and with the plan of rows at further temperatures.

    Unchanged if the sensor has neither a temperature sensor nor a reference coil. `sensing` is the analysis of the
    design, and `reference` the name of its reference coil; empty if there is none.
    """
    if sensing.drift_coefficients is None:
        return calibration
    planned = temperature_plan(sensing, reference) if calibration.plan is not None else None
    return replace(calibration, map=replace(calibration.map, drifts=sensing.drift_coefficients), temperatures=planned)


def forces_with_wrong_rotation(calibration: Calibration, errors: Array) -> tuple[tuple[str, float, float], ...]:
    """Return (axis, applied force, force by the map; N) for each shear axis if the target's rotation is not as assumed.

    The map assumes a level target although the target tilts, or the reverse. The applied load is the full shear on the
    axis, with half of the full normal force. Empty if the pad fails under this load, or if the map has moments, which
    need a target that tilts.
    """
    sensors = calibration.sensors
    if sensors.range.has_moments:
        return ()
    other, columns = Sensors(sensors.model, not sensors.is_held), [k for k in sensors.range.columns if k]
    loads = np.zeros((1 + len(columns), 3))
    loads[1:, 0] = 0.5 * sensors.range.normal
    for row, column in enumerate(columns, start=1):
        loads[row, column] = sensors.range.shear
    if not columns or np.any(other.pad_failures(errors, loads)):
        return ()
    frequency = other.frequencies_under(errors, loads, exact=True)
    if not np.all(np.isfinite(frequency)):
        return ()
    read = calibration.map(frequency[1:], frequency[0])
    axes = sensors.range.columns
    return tuple((AXES[column], sensors.range.shear, float(read[row, axes.index(column)]))
                 for row, column in enumerate(columns))


@lru_cache(maxsize=4)
@one_thread
def simulated_sensors(model: ResponseModel, is_held: bool = True) -> Sensors:
    """Return the simulated sensors of a design. Results are cached with their surrogate.

    Raises NoResponse if a tank does not oscillate, or if the pad fails sideways under the required loads.
    """
    sensors = Sensors(model, is_held and not working_range(model.spec).has_moments)
    if model.estimates.readout.conversion is None:
        raise NoResponse("the converter cannot be set for these coils, so nothing is read")
    errors, corners = np.zeros(len(sensors.unknowns)), sensors.range.corners
    lost = corners[sensors.pad_failures(errors, corners)]
    if len(lost):
        text = ", ".join(f"{name} {amount_text(force, name)}"
                         for name, force in zip(AXES, lost[0], strict=False) if force)
        raise NoResponse(
            f"the pad gives way sideways under {text}, the target {ROTATIONS[sensors.rotation]}: no calibration "
            "reaches that load; a thinner or stiffer pad"
            + ("" if is_held or sensors.range.has_moments else ", or --rotation held")
        )
    frequency = sensors.frequencies_under(errors, corners)
    if not np.all(np.isfinite(frequency)):
        raise NoResponse("a tank of the design does not oscillate under the loads that are required")
    return sensors


@one_thread
def calibrate_from_points(sensors: Sensors, points: Points) -> Calibration:
    """Return the calibration of one measured sensor, from a fit of its unknowns to the measured `points`.

    `sensors` are the simulated sensors of its design. `sigma` of the result is rms over the working range and over the
    simulated sensors whose readings agree with the points. It includes the remaining uncertainty of the unknowns, the
    scatter of the loads and the error of the map.
    """
    sensors, fit = fit_by_surrogate(sensors, points)
    fitted, errors = fit_unit_map(sensors, fit.errors), error_by_unknowns(sensors, fit)
    sigma, sure = np.sqrt(np.mean(errors**2, axis=0)), np.quantile(errors, STATED_FRACTION, axis=0)
    stated_map = replace(fitted, rest=np.rint(sensors.conversion.counts(points.rest)),
                         error=np.asarray(np.hypot(sure, fitted.error)))
    return Calibration(sensors, stated_map, None, points, fit, sigma=np.asarray(np.hypot(sigma, fitted.error)))


def fit_by_surrogate(sensors: Sensors, points: Points) -> tuple[Sensors, ModelFit]:
    """Fit one sensor to measured points. Return the sensors with the final surrogate, and the fit.

    The first surrogate covers the whole manufacturing spread. Each following surrogate is centred on the last fit. Its
    width is the uncertainty of that fit, or the whole spread if the points contain poses. The loop ends when the fit
    lies inside its surrogate. If a following fit fails or is much worse, the preceding surrogate is used again.
    """
    fit = fit_model(sensors, points, rounds=1)
    moving = [each.name in (*POSE_ERRORS, *PAD_ERRORS) for each in sensors.unknowns]
    for _ in range(MAX_SURROGATES):
        largest = np.abs(fit.moved)[moving].max()
        if largest >= SURELY or np.any(sensors.pad_failures(fit.errors, sensors.range.corners)):
            break
        # poses may lie beyond those under loads, by the whole scatter of manufacture
        nearer = sensors.with_centre(fit.errors, fit.sigma if points.poses is None else np.ones(len(fit.sigma)))
        try:
            again = fit_model(nearer, points, fit)
        except NoFit:
            again = None
        if again is None or again.excess > MAX_EXCESS_RATIO * max(fit.excess, SUSPECT):
            return sensors, fit_model(sensors, points, fit)
        apart = np.abs((again.moved - fit.moved) / nearer.surrogate_width)[moving].max()
        sensors, fit = nearer, again
        if apart <= WIDEST:
            break
    return sensors, fit


