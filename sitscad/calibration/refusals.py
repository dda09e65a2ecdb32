"""Checks that refuse tables of measured points which no sensor of the design can produce.

Impossible rows, columns and fits are reported with place and reason. If a coil has several columns, they are compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from sitscad.assembly.places.motions import LOAD, POSE
from sitscad.basics.arrays import Array
from sitscad.calibration.bench_data import BenchError, BenchTable, column_frequencies, rounding_error
from sitscad.calibration.misfit import cause_text, noise_force_sigma, noise_text, worst_row
from sitscad.calibration.model_fit import SUSPECT, ModelFit
from sitscad.calibration.points import Points, predicted_frequencies
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import SHEAR_ERRORS, SURELY
from sitscad.estimates.performance_values import amount_text
from sitscad.kernels.mechanics.motion import rotations

STEEPEST = math.radians(15.0)  # Largest tilt of the response model (the contract of `sitscad response`)
"""Largest accepted tilt (rad) of the target: the limit of the response model."""

STIFF = 2.0
"""Stiffness of the pad above nominal (standard deviations) for which a load without equilibrium is refused."""

THINNEST = 0.1
"""Least accepted height of the target's lowest point above the board, divided by its height at rest.

More compression damages silicone.
"""

CONTRADICTED = 5.0
"""Limit for `ModelFit.disagreement` of a row, in standard deviations.

The row is refused above it and above `OUT_OF_LINE`. Slips of one load or reading gave 6 to 11 standard deviations, and
a target with the other rotation gave 3.7.
"""

OUT_OF_LINE = 0.3
"""Limit for the difference between a row's force and the force predicted by the other rows (full scales).

A row above this limit and above `CONTRADICTED` is refused.
"""

MAX_UNCONVERGED_EXCESS = 2.5
"""Largest accepted ratio of errors to expected errors if the fit did not converge.

Below it, the fit is accepted with a note that its unknowns are unreliable. Correct readings of few points can have such
a ratio.
"""

MAX_UNKNOWN_SIGMAS = 3.0
"""Largest accepted fitted unknown (manufacturing standard deviations) if loads and readings disagree as well.

Tables in which all loads were entered at half their value reached 3.2 to 3.9, with errors of up to 39 % of the normal
force.
"""

WORST = 25.0
"""Largest accepted ratio of errors to expected errors in a calibration by loads.

A ratio of 25 corresponds to load errors of a tenth of full scale. Hysteresis of a tenth gives ratios of 4 to 14.
"""

WORST_OF_POSES = 40.0
"""Largest accepted ratio of errors to expected errors in a calibration by poses, whose own errors are taken as 0."""

MOST_NOISE = 0.075  # Largest force error (full scale) of a calibration by the noise of rows without load
"""Largest accepted force error (full scales) by the noise of rows without load."""


def require_possible_points(table: BenchTable, points: Points, sensors: Sensors) -> None:
    """Raise BenchError for impossible poses, and for loads under which even a stiff pad fails."""
    if points.poses is not None:
        # Poses must be above the board, and tilted no more than the response model allows
        turned = rotations(points.poses[:, 3:])
        tilt = np.arccos(np.clip(turned[:, 2, 2], -1.0, 1.0))
        row = int(np.argmax(tilt))
        if tilt[row] > STEEPEST:
            raise BenchError(
                f"{_row_position(table, row, POSE[3:5])}: tilted by {math.degrees(tilt[row]):.3g} degrees, where "
                f"{math.degrees(STEEPEST):.0f} are the most that are computed: is the header's unit right?"
            )
        lowest = sensors.model.lowest(points.poses)
        row = int(np.argmin(lowest))
        gap = sensors.model.lowest(np.zeros((1, 6)))[0]
        if lowest[row] < THINNEST * gap:
            where = f"{1e3 * lowest[row]:.3g} mm above the board, and the pad of {1e3 * gap:.3g} mm pressed to nothing"
            counted = "are poses counted from rest"
            if lowest[row] < 0.0:
                where, counted = f"{-1e3 * lowest[row]:.3g} mm inside the board", f"{counted}, z away from the board"
            raise BenchError(
                f"{_row_position(table, row, (POSE[2], *POSE[3:5]))}: the target's lowest point would be {where}: "
                f"{counted}, and is the unit right?"
            )
    if points.loads is not None:
        errors = np.array([STIFF * each.sigma * (each.name == "modulus") for each in sensors.unknowns])
        stiffer = f"even if it is {100.0 * math.expm1(errors.max()):.0f} % stiffer than its material says"
        _require_equilibrium(table, points.loads, sensors, errors, stiffer)


def require_agreement(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit, note: str = "") -> None:
    """Raise BenchError if the readings cannot come from a sensor of this design.

    Reasons are: the residuals are too large, one row contradicts the others, or an unknown is too many standard
    deviations from nominal. Further reasons are too much noise, and a load under which the pad fails sideways. `note`
    is added at the end of the message.
    """
    k = int(np.argmax(np.abs(fit.moved)))
    of_shear = [n for n, unknown in enumerate(sensors.unknowns) if unknown.name in SHEAR_ERRORS]
    together = float(np.linalg.norm(fit.moved[of_shear]))
    if together > abs(fit.moved[k]):
        k = of_shear[int(np.argmax(np.abs(fit.moved[of_shear])))]
    unknown, sigmas = sensors.unknowns[k], float(fit.moved[k])
    where, off, odd, share = worst_row(table, points, sensors, fit)
    most = MAX_UNCONVERGED_EXCESS if not fit.settled else WORST_OF_POSES if points.loads is None else WORST
    farthest = SURELY if fit.excess < SUSPECT else MAX_UNKNOWN_SIGMAS
    if fit.excess > most or (odd > CONTRADICTED and share > OUT_OF_LINE) or max(abs(sigmas), together) > farthest:
        why, also = [], "" if together <= abs(sigmas) else f", with others of the pad's shear {together:.1f} sigma"
        if max(abs(sigmas), together) > farthest:
            amount = f"{sigmas * unknown.sigma:.3g} {'relative' if unknown.unit == '1' else unknown.unit}"
            why.append(f"{unknown.name} would be {sigmas:+.1f} sigma of manufacture off ({amount}{also}): "
                       f"{cause_text(unknown.name)}?")
        if fit.excess > SUSPECT or odd > CONTRADICTED:
            best = "" if fit.settled else ", without a best fit"
            why.append(f"loads and readings disagree by {fit.excess:.1f} times what is expected{best}, this row most: "
                       f"{off}: a typing error, another load, order or unit, rows of several runs?")
        why += ["Or is it another sensor's spec?", f"{note[:1].upper()}{note[1:]}"]
        raise BenchError(" ".join([f"{where} no sensor of this design reads so:", *filter(None, why)]))
    noise = noise_force_sigma(points, sensors, fit)
    if noise > MOST_NOISE:
        raise BenchError(f"{noise_text(table, points, noise)} No calibration comes out of that: find the noise first")
    if points.loads is not None:
        _require_equilibrium(table, points.loads, sensors, fit.errors, "with the modulus that the readings ask for")


def _require_equilibrium(table: BenchTable, loads: Array, sensors: Sensors, errors: Array, how: str) -> None:
    """Raise BenchError for a load under which the pad of a sensor with these `errors` has no equilibrium.

    `how` is a part of the message that describes the pad.
    """
    lost = sensors.pad_failures(errors, loads)
    if lost.any():
        row = int(np.argmax(lost))
        text = ", ".join(f"{name} {amount_text(force, name, 4)}"
                         for name, force in zip(LOAD, loads[row], strict=False) if force)
        raise BenchError(f"{_row_position(table, row, LOAD)}: {text}: the pad gives way sideways under this load, "
                         f"{how}; leave the row out" + ", or hold the target level (--rotation held)" * (
                             not sensors.range.has_moments))


def _row_position(table: BenchTable, row: int, names: tuple[str, ...]) -> str:
    """Return the file position of a row in the first of the columns `names` that the table has."""
    column = next((table.columns[k] for name in names if (k := table.column_index(name)) is not None), None)
    return f"{table.path}:{table.lines[row]}:{1 if column is None else column.number}"


FAR_BEYOND = 4.0  # Load (full scales) above which the unit is assumed wrong
"""Load (full scales) above which a wrong unit in the header is assumed."""

LARGEST_CHANGE = 2.0
"""Largest accepted change of a reading from rest, divided by the largest change of a simulated sensor with a soft pad.

The simulated sensor has the loads or poses of the table.
"""

MODULI = tuple(np.linspace(-1.2, 1.2, 9))  # Logarithms of moduli to compare readings with
"""Logarithms of factors on the pad's modulus, for which the expected changes of readings are computed."""

MAX_CHANGE_DIFFERENCE = 0.3
"""Largest accepted rms difference of measured and expected changes of readings, divided by the rms measured change.

Above it, exchanged columns or a wrong sign are suspected.
"""

BETTER = 0.5
"""Ratio of two differences between measured and expected changes: with another order of columns, and as given.

If an order has a lower ratio, the table is refused, and the message states this order.
"""

EQUAL_ORDER_LIMITS = 1.05, 0.02
"""Limits below which several orders of columns are equally good and stated together.

Both compare the difference of measured and expected changes with the smallest difference of all orders: the ratio, and
the excess over it (fraction of the readings). With two coils, exchanged columns look nearly like reversed shear. They
differ by 0.2 % of the readings, less than sensors of the design differ.
"""


def require_plausible(table: BenchTable, points: Points, sensors: Sensors) -> None:
    """Raise BenchError for readings outside the manufacturing scatter, and for columns that appear exchanged."""
    # Loads must not be far beyond full scale
    if points.loads is not None:
        columns, full = sensors.range.columns, sensors.range.full_scales
        times = np.abs(points.loads[:, columns]) / full
        row, axis = np.unravel_index(int(np.argmax(times)), times.shape)
        if times[row, axis] > FAR_BEYOND:
            name = LOAD[columns[int(axis)]]
            force = points.loads[row, columns[int(axis)]]
            raise BenchError(
                f"{table.position(int(row), table.column(name))} {name}: {amount_text(force, name, 4)}, where this "
                f"sensor's full scale is {amount_text(full[axis], name, 4)}: is the header's unit right?"
            )
    # Frequencies must be within the scatter of coils and capacitors
    expected = predicted_frequencies(sensors, np.zeros(len(sensors.unknowns)), points)
    sigmas = {each.name: each.sigma for each in sensors.unknowns}
    for k, coil in enumerate(sensors.coils):
        most = SURELY * 0.5 * np.hypot(sigmas[f"capacitor.{coil}"], sigmas["inductance"])
        off = np.log(points.frequency[:, k] / expected[:, k])
        if np.abs(off).max() > most:
            worst, column = int(np.argmax(np.abs(off))), table.column(coil)
            value = float(table.numbers(column)[worst])
            power = -2.0 if column.unit.endswith("H") else 1.0
            usual, share = value * np.exp(-power * off[worst]), 100.0 * abs(power) * float(most)
            raise BenchError(
                f"{table.position(worst, column)} {coil}: {value:.6g} {column.unit}, where this design reads about "
                f"{usual:.4g} {column.unit}, {share:.0f} % more or less: is the header's unit right, and is it this "
                "sensor's spec?"
            )
    _require_changes(table, points, sensors)
    _require_order(table, points, sensors)


def _require_changes(table: BenchTable, points: Points, sensors: Sensors) -> None:
    """Raise BenchError for changes from rest that are larger than a soft sensor's changes, or far too small."""
    soft = np.array([-2.0 * each.sigma * (each.name == "modulus") for each in sensors.unknowns])
    settled = points.without_drift
    change = np.log(settled.frequency / settled.rest)
    frequency = predicted_frequencies(sensors, soft, points)
    largest = np.abs(np.log(frequency / frequency[points.at_rest][:1])).max()
    if np.abs(change).max() > LARGEST_CHANGE * largest:
        row, coil = np.unravel_index(int(np.argmax(np.abs(change))), change.shape)
        column = table.column(sensors.coils[int(coil)])
        raise BenchError(f"{table.position(int(row), column)} {column.name}: "
                         f"{100.0 * change[row, coil]:.2g} % off rest, where nothing in the table moves this design by "
                         f"more than {100.0 * largest:.2g} %: a typing error, or another sensor?")
    if np.abs(change[~points.at_rest]).max() < 0.01 * largest:
        raise BenchError(f"{table.path}:{table.lines[0]}:1 the readings do not change with the loads: is the target "
                         "on, and are rows and loads those of one run?")


def _require_order(table: BenchTable, points: Points, sensors: Sensors) -> None:
    settled = points.without_drift
    measured = np.log(settled.frequency / settled.rest)
    size = np.linalg.norm(measured)
    as_given, alternatives = None, []
    expected: dict[bytes, list[Array]] = {}
    for order, signs, order_text in _exchanged_readings(sensors, points.loads is not None):
        if signs.tobytes() not in expected:  # changes of ln f (n, coils) of the design with other moduli
            loads = None if points.loads is None else points.loads * signs
            poses = None if points.poses is None else points.poses * signs
            others_of = Points(loads, poses, points.frequency, points.at_rest)
            is_modulus = np.array([unknown.name == "modulus" for unknown in sensors.unknowns])
            errors = np.array([modulus * is_modulus for modulus in MODULI])
            expected_changes = [np.log(predicted_frequencies(sensors, each, others_of)) for each in errors]
            expected[signs.tobytes()] = [change - change[points.at_rest][:1] for change in expected_changes]
        misfit = min(np.linalg.norm(change - measured[:, order]) for change in expected[signs.tobytes()]) / size
        if not order_text:
            as_given = misfit
        else:
            alternatives.append((misfit, order_text))
    assert as_given is not None
    best = min(alternatives, default=(np.inf, ""))
    if as_given > MAX_CHANGE_DIFFERENCE and best[0] < BETTER * as_given:
        most = EQUAL_ORDER_LIMITS[0] * best[0] + EQUAL_ORDER_LIMITS[1]
        candidates = " or ".join(dict.fromkeys(order_text for misfit, order_text in alternatives if misfit < most))
        first = next(column for column in table.columns if column.is_coil)
        raise BenchError(f"{table.path}:1:{first.number} {candidates}: then the readings agree with the design to "
                         f"{100.0 * best[0]:.0f} %, as they stand they are {100.0 * as_given:.0f} % off")


def _exchanged_readings(sensors: Sensors, loaded: bool) -> Iterator[tuple[list[int], Array, str]]:
    """Yield (order of the coils, signs of the load or pose, fault) for exchanged columns and for reversed signs.

    The fault is the text of the message for this order. It is empty for the given order.
    """
    names, count = (LOAD, sensors.range.width) if loaded else (POSE, 6)
    coils = sensors.coils
    for order in permutations(range(len(coils))):
        moved = [coils[k] for k in range(len(coils)) if order[k] != k]
        yield list(order), np.ones(count), f"the columns {' and '.join(moved)} look exchanged" if moved else ""
    sideways: tuple[int, ...] = (1, 2) if loaded else (0, 1)
    if loaded and sensors.range.has_moments:
        sideways = tuple(k for k in sensors.range.columns if k)
    for chosen in product((1.0, -1.0), repeat=len(sideways)):
        signs = np.ones(count)
        signs[list(sideways)] = chosen
        turned = [names[k] for k in sideways if signs[k] < 0.0]
        if turned:
            yield list(range(len(coils))), signs, f"{' and '.join(turned)} look turned round"


BEYOND = 6.0  # Largest difference of two columns of one coil (standard deviations of the converter's noise)
"""Largest difference between two columns of one coil (standard deviations of the converter's noise)."""

CAPACITOR = 0.01
"""Relative difference at rest between the inductances from two columns of one coil.

Above it, a remark reports that the unused column was computed with another capacitor value.
"""


def unused_column_remarks(table: BenchTable, points: Points, sensors: Sensors) -> tuple[str, ...]:
    """Return remarks on the columns that are not used. Empty if each coil has one column."""
    remarks, used_of = [], {coil: table.column(coil) for coil in sensors.coils}
    seconds = [(used_of[c.name], c) for c in table.columns if c.is_coil and c != used_of[c.name]]
    for used, other in sorted(seconds, key=lambda pair: sensors.coils.index(pair[0].name)):
        apart = np.log(column_frequencies(table, sensors, other)) - np.log(column_frequencies(table, sensors, used))
        level = float(apart[points.at_rest].mean())
        off = np.abs(apart - level)
        row = int(np.argmax(off))
        noise = float(sensors.noise[sensors.coils.index(used.name)])
        remark = f"{used.name}_{used.unit} is used, {other.name}_{other.unit} is not"
        if off[row] > BEYOND * noise + rounding_error(table, used)[row] + rounding_error(table, other)[row]:
            remark += (f": its change from rest differs by up to {1e6 * off[row]:.3g} ppm of the frequency "
                     f"({table.position(row, other)}), {off[row] / noise:.0f} times the converter's noise: rows of "
                     "another run, or a changed formula")
        else:
            remark += f"; their changes from rest agree within {1e6 * max(off[row], 0.1e-6):.2g} ppm of the frequency"
        if abs(2.0 * level) > CAPACITOR:
            remark += f"; it was computed with a capacitor {100.0 * np.expm1(2.0 * level):+.1f} % off the firmware's"
        remarks.append(remark)
    return tuple(remarks)
