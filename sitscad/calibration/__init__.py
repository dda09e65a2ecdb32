"""Calibration: simulated sensors, planned loads, the fit to measured points, and maps from readings to forces."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sitscad.assembly.places.motions import MOMENT, is_held
from sitscad.basics.arguments import checked_arguments
from sitscad.calibration.bench_data import TEMPERATURE, USUAL_ROTATION, BenchError, read_table, table_points
from sitscad.calibration.calibration import (
    Calibration,
    calibrate_from_points,
    forces_with_wrong_rotation,
    plan_calibration,
    simulated_sensors,
    with_temperatures,
)
from sitscad.calibration.drift_table import fit_table_drift, rows_at_base
from sitscad.calibration.inverse_map import InverseMap, map_of
from sitscad.calibration.misfit import disagreement_note, fit_opposite_rotation, noise_note
from sitscad.calibration.model_fit import SUSPECT, NoFit
from sitscad.calibration.refusals import (
    require_agreement,
    require_plausible,
    require_possible_points,
    unused_column_remarks,
)
from sitscad.estimates.loads.working_range import measured_axes

if TYPE_CHECKING:
    from sitscad.estimates.design import Design

__all__ = ["Calibration", "InverseMap", "calibrate", "map_of"]


@checked_arguments
def calibrate(
    design: Design, data: str | os.PathLike[str] | None = None, *, rotation: str | None = None, points: int = 8
) -> Calibration:
    """Return the calibration of a design.

    Parameters
    ----------
    design
        The design to calibrate.
    data
        Path of the CSV file of a bench. The calibration then has the map of the measured sensor. Without it, the
        calibration has the map of the design as drawn, and a plan of the loads to measure.
    rotation
        ``"held"`` if the loads keep the target level, ``"free"`` if it can tilt. By default, the line
        ``# rotation: free`` of the file decides. Without that line it is ``"held"``, and ``"free"`` if the requirements
        have moments, because only a free target shows a moment.
    points
        Number of loads in the plan.

    Returns
    -------
    Calibration
        The map, with the plan or the fit.

    Raises
    ------
    BenchError
        The table cannot be read, belongs to another design, or no fit converges. A ValueError.
    MotionError
        `rotation` is another word. A ValueError.
    NoResponse
        The design has nothing to calibrate. A ValueError.
    OSError
        The file cannot be opened.
    """
    has_moments = any(name in measured_axes(design.spec.cell_placements[0], design.spec.requirements)
                      for name in MOMENT)
    is_level = is_held(rotation or ("free" if has_moments else USUAL_ROTATION))
    no_moments = "rotation held: a face that keeps the target level takes the moments that the spec asks for"
    if is_level and has_moments:
        raise BenchError(no_moments)
    if data is None or design.spec.cells is not None:  # the response raises an error that requires a cell
        planned = plan_calibration(design.response, is_level, points)
        has_compensation = design.spec.readout.compensation is not None
        return with_temperatures(planned, design.sensing.solved, design.layout.reference_name
                                 ) if has_compensation else planned
    whole = read_table(os.fspath(data), [coil.name for coil in design.layout.sensing.coils],
                       design.layout.reference_name)
    table = whole.part(rows_at_base(whole), design.layout.reference_name)
    level = table.is_held(rotation, "free" if has_moments else USUAL_ROTATION)
    if level and has_moments:
        raise BenchError(f"{table.path}:{table.rotation[0]}:1 {no_moments}")
    sensors = simulated_sensors(design.response, level)
    measured = table_points(table, sensors)
    require_possible_points(table, measured, sensors)
    require_plausible(table, measured, sensors)
    try:
        calibration = calibrate_from_points(sensors, measured)
    except NoFit as error:
        raise BenchError(f"{table.path}:{table.lines[0]}:1 no sensor of this design reads so: {error}; is it this "
                         "sensor's spec?") from error
    assert calibration.fit is not None
    note, wrong = "", np.zeros(len(calibration.map.axes))
    # readings with the expected errors make no other rotation much likelier
    if calibration.fit.excess > SUSPECT and not has_moments:
        other = fit_opposite_rotation(sensors, lambda: simulated_sensors(design.response, not level), measured,
                                      calibration.fit)
        if other is not None:
            note, wrong = other.note, other.error(calibration.map)
    require_agreement(table, measured, sensors, calibration.fit, note)
    turned = forces_with_wrong_rotation(calibration, calibration.fit.errors)
    remarks = unused_column_remarks(table, measured, sensors)
    fit = calibration.fit
    notes = (note, disagreement_note(table, measured, sensors, fit), noise_note(table, measured, sensors, fit))
    stated_map = replace(calibration.map, error=np.hypot(calibration.map.error, wrong))
    calibration = replace(calibration, map=stated_map, remarks=(*filter(None, notes), *remarks), turned=turned)
    if design.spec.readout.compensation is not None:
        calibration = with_temperatures(calibration, design.sensing.solved, design.layout.reference_name)
    if whole.column_index(TEMPERATURE) is None:
        return calibration
    rows = replace(table_points(whole, sensors), noise_ratio=measured.noise_ratio)
    return fit_table_drift(design.sensing.solved, calibration, whole, rows, design.layout.reference_name)
