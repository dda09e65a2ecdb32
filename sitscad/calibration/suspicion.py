"""Points that no sensor of a design would give: refused before they spoil a map."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.bench_data import BenchError, Table
from sitscad.calibration.points import Points, foretold
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import SURELY
from sitscad.scene.motions import LOAD, POSE

Array = NDArray[np.float64]

FAR_BEYOND = 4.0
"""Full scales beyond which a load is a slip of the unit."""

LARGEST_CHANGE = 2.0
"""How many times as much as any load or pose in the table moves a soft sensor a reading may change."""

MODULI = tuple(np.linspace(-1.2, 1.2, 9))
"""Logarithms of moduli with which readings are compared."""

UNLIKE, BETTER = 0.3, 0.5
"""A table is suspected whose readings are so unlike (rms, over their own) what the design says, where another order of
its columns halves that."""

ALIKE = 1.05, 0.02
"""Orders that are named together: so many times as far off as the best one, and so much (of the readings) farther. Of
two coils exchanged columns are nearly shear turned round, apart by 0.2 % of the readings and less than units differ."""


def require_plausible(table: Table, points: Points, sensors: Sensors) -> None:
    """Raises BenchError for readings beyond what manufacture explains, and for columns that look exchanged."""
    _require_range(table, points, sensors)
    _require_level(table, points, sensors)
    _require_changes(table, points, sensors)
    _require_order(table, points, sensors)


def _require_range(table: Table, points: Points, sensors: Sensors) -> None:
    """Loads that are not far beyond what the sensor is made for."""
    if points.loads is None:
        return
    columns, full = sensors.range.columns, sensors.range.full_scales
    times = np.abs(points.loads[:, columns]) / full
    row, axis = np.unravel_index(int(np.argmax(times)), times.shape)
    if times[row, axis] > FAR_BEYOND:
        name = LOAD[columns[int(axis)]]
        place = table.named(name)
        assert place is not None
        force = points.loads[row, columns[int(axis)]]
        raise BenchError(
            f"{table.where(int(row), table.columns[place])} {name}: {force:.4g} N, where "
            f"this sensor's full scale is {full[axis]:.4g} N: is the header's unit right?"
        )


def _require_level(table: Table, points: Points, sensors: Sensors) -> None:
    """Frequencies within what coils and capacitors of the design explain."""
    expected = foretold(sensors, np.zeros(len(sensors.known)), points)
    spread = {one.name: one.sigma for one in sensors.known}
    for k, coil in enumerate(sensors.coils):
        most = SURELY * 0.5 * np.hypot(spread[f"capacitor.{coil}"], spread["inductance"])
        off = np.log(points.frequency[:, k] / expected[:, k])
        if np.abs(off).max() > most:
            raise BenchError(_off_level(table, coil, off, float(most)))


def _off_level(table: Table, coil: str, off: Array, most: float) -> str:
    """What is said of a reading whose ln f is `off` (n) by more than `most`."""
    row, place = int(np.argmax(np.abs(off))), table.named(coil)
    assert place is not None
    column, said = table.columns[place], float(table.values[row, place])
    power = -2.0 if column.unit.endswith("H") else 1.0
    usual, share = said * np.exp(-power * off[row]), 100.0 * abs(power) * most
    return (f"{table.where(row, column)} {coil}: {said:.6g} {column.unit}, where this design reads about {usual:.4g} "
            f"{column.unit}, {share:.0f} % more or less: is the header's unit right, and is it this sensor's spec?"
            )  # fmt: skip


def _require_changes(table: Table, points: Points, sensors: Sensors) -> None:
    """Changes from rest no larger than a soft sensor's."""
    soft = np.zeros(len(sensors.known))
    names = [one.name for one in sensors.known]
    soft[names.index("modulus")] = -2.0 * sensors.known[names.index("modulus")].sigma
    settled = points.settled
    change = np.log(settled.frequency / settled.rest)
    largest = np.abs(
        np.log(foretold(sensors, soft, points) / foretold(sensors, soft, points)[points.at_rest][:1])
    ).max()
    if np.abs(change).max() > LARGEST_CHANGE * largest:
        row, coil = np.unravel_index(int(np.argmax(np.abs(change))), change.shape)
        place = table.named(sensors.coils[int(coil)])
        assert place is not None
        raise BenchError(f"{table.where(int(row), table.columns[place])} {sensors.coils[int(coil)]}: "
                         f"{100.0 * change[row, coil]:.2g} % off rest, where nothing in the table moves this design by "
                         f"more than {100.0 * largest:.2g} %: a typing error, or another sensor?")  # fmt: skip
    if np.abs(change[~points.at_rest]).max() < 0.01 * largest:
        raise BenchError(f"{table.path}:{table.lines[0]}:1 the readings do not change with the loads: is the target "
                         "on, and are rows and loads those of one run?")  # fmt: skip


def _require_order(table: Table, points: Points, sensors: Sensors) -> None:
    """Columns in the order that fits."""
    settled = points.settled
    seen = np.log(settled.frequency / settled.rest)
    size = np.linalg.norm(seen)
    as_given, others = None, []
    expected: dict[bytes, list[Array]] = {}
    for order, signs, said in _orders(sensors, points.loads is not None):
        if signs.tobytes() not in expected:
            expected[signs.tobytes()] = [_moved(sensors, points, signs, modulus) for modulus in MODULI]
        left = min(np.linalg.norm(one - seen[:, order]) for one in expected[signs.tobytes()]) / size
        if not said:
            as_given = left
        else:
            others.append((left, said))
    assert as_given is not None
    best = min(others, default=(np.inf, ""))
    if as_given > UNLIKE and best[0] < BETTER * as_given:
        alike = " or ".join(dict.fromkeys(said for left, said in others if left < ALIKE[0] * best[0] + ALIKE[1]))
        first = next(column for column in table.columns if column.is_coil)
        raise BenchError(f"{table.path}:1:{first.number} {alike}: then the readings agree with the design to "
                         f"{100.0 * best[0]:.0f} %, as they stand they are {100.0 * as_given:.0f} % off")  # fmt: skip


def _orders(sensors: Sensors, loaded: bool) -> Iterator[tuple[list[int], Array, str]]:
    """Orders of the coils, signs of the load or pose, and what is wrong if they are right: nothing, as given."""
    names, count = (LOAD, 3) if loaded else (POSE, 6)
    coils = sensors.coils
    for order in permutations(range(len(coils))):
        moved = [coils[k] for k in range(len(coils)) if order[k] != k]
        yield list(order), np.ones(count), f"the columns {' and '.join(moved)} look exchanged" if moved else ""
    sideways = (1, 2) if loaded else (0, 1)
    for chosen in product((1.0, -1.0), repeat=2):
        signs = np.ones(count)
        signs[list(sideways)] = chosen
        turned = [names[k] for k in sideways if signs[k] < 0.0]
        if turned:
            yield list(range(len(coils))), signs, f"{' and '.join(turned)} look turned round"


def _moved(sensors: Sensors, points: Points, signs: Array, modulus: float) -> Array:
    """Changes of ln f from rest (n, coils) that the design with another modulus makes of loads with other signs."""
    errors = np.zeros(len(sensors.known))
    errors[[one.name for one in sensors.known].index("modulus")] = modulus
    loads = None if points.loads is None else points.loads * signs
    poses = None if points.poses is None else points.poses * signs
    found = np.log(foretold(sensors, errors, Points(loads, poses, points.frequency, points.at_rest)))
    return np.asarray(found - found[points.at_rest][:1])
