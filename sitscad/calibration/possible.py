"""Rows that no sensor can have been in, and fits that tell nothing: refused with their place and the reason."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.bench_data import BenchError, Table
from sitscad.calibration.misfit import cause, noise_share
from sitscad.calibration.model_fit import SUSPECT, ModelFit
from sitscad.calibration.points import Points
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import SHEAR_ERRORS, SURELY, usual
from sitscad.mechanics.motion import rotations
from sitscad.scene.motions import LOAD, POSE

Array = NDArray[np.float64]

STEEPEST = math.radians(15.0)
"""Tilt up to which the response is computed (the contract of `sitscad response`)."""

STIFF = 2.0
"""Standard deviations by which a pad may be stiffer than its preset, before a load is more than it can bear."""

THINNEST = 0.1
"""What is left of the pad's height at the least: no silicone is pressed further and is whole afterwards."""

ALONE, UNLIKE = 4.0, 0.3
"""A row is refused that is so many times as far off as the others (their root mean square), and by so much of full
scale."""

HONEST = 5.0
"""How many times larger than expected errors may be before a row is looked for that all others contradict: true
readings of 5 points left up to 2.3, a load of the wrong sign 80 and more."""

UNSETTLED = 2.5
"""How many times larger than expected errors may be of a fit that did not settle. Below, where true readings of few
points come to lie, it is taken, and it is said that its unknowns are not to be trusted."""

HARDLY = 4.0
"""Standard deviations of manufacture beyond which an unknown is not believed where loads and model disagree, too: half
of all shear in a table, or a target askew by 3 degrees, came to lie at 4.3 to 5.5 and left errors of 4 to 39 %."""

WORST, WORST_OF_POSES = 15.0, 40.0
"""How many times larger than expected errors may be: loads that are off by a thirteenth of themselves (hysteresis of a
tenth of full scale makes 6, and 20 a map that is a third of full scale off); and of poses, for whose own errors nothing
is allowed."""


def require_possible(table: Table, points: Points, sensors: Sensors) -> None:
    """Raises BenchError for poses that a target cannot take, and for loads that not even a stiff pad bears."""
    if points.poses is not None:
        _require_room(table, points.poses, sensors)
    if points.loads is not None:
        errors = np.zeros(len(sensors.known))
        place = [one.name for one in sensors.known].index("modulus")
        errors[place] = STIFF * sensors.known[place].sigma
        stiffer = f"even if it is {100.0 * math.expm1(errors[place]):.0f} % stiffer than its material says"
        _require_borne(table, points.loads, sensors, errors, stiffer)


def require_told(table: Table, points: Points, sensors: Sensors, fit: ModelFit, said: str = "") -> None:
    """Raises BenchError where the fit of a table did not settle, put an unknown where none is, was pulled there by one
    row, or has the pad give way under a load of the table; what is `said` of the fit beside stands at the end.
    """
    said = f". {said[:1].upper()}{said[1:]}" if said else ""
    _require_alike(table, points, sensors, fit)
    k = int(np.argmax(np.abs(fit.moved)))
    of_shear = [n for n, one in enumerate(sensors.known) if one.name in SHEAR_ERRORS]
    together = float(np.linalg.norm(fit.moved[of_shear]))
    if together > abs(fit.moved[k]):
        k = of_shear[int(np.argmax(np.abs(fit.moved[of_shear])))]
    one, far = sensors.known[k], float(fit.moved[k])
    row, share = _worst(points, fit)
    where = f"{table.path}:{table.lines[row]}:1"
    if not fit.settled and fit.excess > UNSETTLED:
        raise BenchError(f"{where} the fit did not settle: {one.name} went to {far:+.1f} sigma of manufacture, and "
                         f"this row is farthest off ({share}): {cause(one.name)}; another "
                         f"sensor's spec, or rows of several runs?{said}")  # fmt: skip
    if max(abs(far), together) > (SURELY if fit.excess < SUSPECT else HARDLY):
        beside = "" if together <= abs(far) else f", with others of the pad's shear {together:.1f} sigma"
        raise BenchError(f"{where} the readings ask for {one.name} {far:+.1f} sigma off ({far * one.sigma:.3g} "
                         f"{'relative' if one.unit == '1' else one.unit}{beside}), which no sensor of this design is; "
                         f"this row is farthest off ({share}): {cause(one.name)}? Or is it another sensor's spec?{said}"
                         )  # fmt: skip
    if fit.excess > (WORST_OF_POSES if points.loads is None else WORST):
        raise BenchError(f"{where} loads and readings disagree, by {fit.excess:.0f} times what is expected, and this "
                         f"row is farthest off ({share}): another sensor's spec, rows of several, or loads in another "
                         f"order or unit?{said}")  # fmt: skip
    noise = noise_share(points, sensors, fit)
    if noise > WORST * usual("force"):
        raise BenchError(f"{table.path}:{table.lines[int(np.argmax(points.at_rest))]}:1 rows without load scatter by "
                         f"{points.noisier:.0f} times the converter's noise, {100.0 * noise:.0f} % of full scale on a "
                         "force: no calibration comes out of that; find the noise first")  # fmt: skip
    if points.loads is not None:
        _require_borne(table, points.loads, sensors, fit.errors, "with the modulus that the readings ask for")


def _require_room(table: Table, poses: Array, sensors: Sensors) -> None:
    """Poses above the board, and no more tilted than the response is computed for."""
    turned = rotations(poses[:, 3:])
    tilt = np.arccos(np.clip(turned[:, 2, 2], -1.0, 1.0))
    row = int(np.argmax(tilt))
    if tilt[row] > STEEPEST:
        raise BenchError(f"{_place(table, row, POSE[3:5])}: tilted by {math.degrees(tilt[row]):.3g} degrees, where "
                         f"{math.degrees(STEEPEST):.0f} are the most that are computed: is the header's unit right?"
                         )  # fmt: skip
    lowest = sensors.model.lowest(poses)
    row = int(np.argmin(lowest))
    gap = sensors.model.lowest(np.zeros((1, 6)))[0]
    if 0.0 <= lowest[row] < THINNEST * gap:
        raise BenchError(f"{_place(table, row, (POSE[2], *POSE[3:5]))}: the target's lowest point would be "
                         f"{1e3 * lowest[row]:.3g} mm above the board, and the pad of {1e3 * gap:.3g} mm pressed to "
                         "nothing: are poses counted from rest, and is the unit right?")  # fmt: skip
    if lowest[row] < 0.0:
        raise BenchError(f"{_place(table, row, (POSE[2], *POSE[3:5]))}: the target's lowest point would be "
                         f"{-1e3 * lowest[row]:.3g} mm inside the board: are poses counted from rest, z away from the "
                         "board, and is the unit right?")  # fmt: skip


def _require_borne(table: Table, loads: Array, sensors: Sensors, errors: Array, how: str) -> None:
    """Loads under which the pad finds an equilibrium."""
    lost = sensors.gives_way(errors, loads)
    if lost.any():
        row = int(np.argmax(lost))
        said = ", ".join(f"{name} {force:.4g} N" for name, force in zip(LOAD, loads[row], strict=True) if force)
        raise BenchError(f"{_place(table, row, LOAD)}: {said}: the pad gives way sideways under this load, {how}; "
                         "leave the row out, or hold the target level (--rotation held)")  # fmt: skip


def _require_alike(table: Table, points: Points, sensors: Sensors, fit: ModelFit) -> None:
    """No row by far worse than all others, as they foretell its force."""
    if fit.force_errors is None or fit.excess < HONEST:
        return
    share = np.abs(fit.force_errors) / sensors.range.full_scales
    off = np.where(points.at_rest, -np.inf, np.nan_to_num(share.max(axis=1), nan=-np.inf))
    row = int(np.argmax(off))
    others = np.delete(off, row)
    others = others[np.isfinite(others)]
    usual = math.sqrt(float(np.mean(others**2))) if others.size else math.inf
    if off[row] > max(UNLIKE, ALONE * usual):
        axis = int(np.argmax(share[row]))
        raise BenchError(f"{table.path}:{table.lines[row]}:1 the other rows foretell {sensors.range.axes[axis]} "
                         f"{abs(fit.force_errors[row, axis]):.3g} N off this one, {off[row] / usual:.0f} times as much "
                         "as they are off themselves: a typing error, or another load?")  # fmt: skip


def _worst(points: Points, fit: ModelFit) -> tuple[int, str]:
    """The row that is farthest off, and by how much of its frequency, in words."""
    off = np.where(points.at_rest, -np.inf, np.nan_to_num(np.abs(fit.reading_errors).max(axis=1), nan=-np.inf))
    row = int(np.argmax(off))
    return row, f"{1e6 * off[row]:.3g} ppm of the frequency"


def _place(table: Table, row: int, names: tuple[str, ...]) -> str:
    """The place of the first of some columns that the table has."""
    found = next((table.columns[k] for name in names if (k := table.named(name)) is not None), None)
    return f"{table.path}:{table.lines[row]}:{1 if found is None else found.number}"
