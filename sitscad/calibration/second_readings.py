"""Tables that give a coil's reading twice, as counts and as inductance: which is used, and whether they agree."""

from __future__ import annotations

import numpy as np

from sitscad.calibration.bench_data import Table, frequencies_of, rounded
from sitscad.calibration.points import Points
from sitscad.calibration.sensors import Sensors

BEYOND = 6.0
"""Standard deviations of the converter's noise by which two columns of one coil may differ."""

CAPACITOR = 0.01
"""Relative difference of inductances at rest from which they were computed with another capacitor's value."""


def second_readings(table: Table, points: Points, sensors: Sensors) -> tuple[str, ...]:
    """What there is to say of columns that are not used: nothing where every coil has one."""
    found = []
    for coil in sensors.coils:
        used = table.named(coil)
        assert used is not None
        for k, column in enumerate(table.columns):
            if column.name == coil and k != used:
                found.append(_compared(table, points, sensors, (used, k)))
    return tuple(found)


def _compared(table: Table, points: Points, sensors: Sensors, pair: tuple[int, int]) -> str:
    """The note on a coil's second column."""
    used, other = (table.columns[k] for k in pair)
    apart = np.log(frequencies_of(table, sensors, other)) - np.log(frequencies_of(table, sensors, used))
    level = float(apart[points.at_rest].mean())
    left = np.abs(apart - level)
    row = int(np.argmax(left))
    noise = float(sensors.noise[sensors.coils.index(used.name)])
    allowed = BEYOND * noise + rounded(table, used)[row] + rounded(table, other)[row]
    said = f"{used.name}_{used.unit} is used, {other.name}_{other.unit} is not"
    if left[row] > allowed:
        said += (f": its change from rest differs by up to {1e6 * left[row]:.3g} ppm of the frequency "
                 f"({table.where(row, other)}), {left[row] / noise:.0f} times the converter's noise: rows of another "
                 "run, or a changed formula")  # fmt: skip
    else:
        said += f"; their changes from rest agree within {1e6 * max(left[row], 0.1e-6):.2g} ppm of the frequency"
    if abs(2.0 * level) > CAPACITOR:
        said += f"; it was computed with a capacitor {100.0 * np.expm1(2.0 * level):+.1f} % off the firmware's"
    return said
