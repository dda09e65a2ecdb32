"""What to do on the bench: the table to fill in, and words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.calibrate import Calibration
from sitscad.calibration.plan import Plan, load_names
from sitscad.calibration.unknowns import usual

Array = NDArray[np.float64]

GRAVITY = 9.80665
"""Standard acceleration of free fall (m/s^2), by definition."""


def table(found: Calibration, plan: Plan) -> bytes:
    """The loads as CSV, the coils' columns empty: filled in it is what `sitscad calibrate` reads. Its first line says
    how the target is loaded.
    """
    sensors = found.sensors
    head = [*load_names(sensors.range.axes), *(f"{coil}_counts" for coil in sensors.coils)]
    rows = [_numbers(load[sensors.range.columns]) + [""] * len(sensors.coils)
            for load in np.vstack([np.zeros((1, 3)), plan.loads])]  # fmt: skip
    said = [f"# rotation: {'held' if sensors.is_held else 'free'}"]
    return ("\n".join(",".join(row) for row in [said, head, *rows]) + "\n").encode("ascii")


def _numbers(load: Array) -> list[str]:
    return [f"{force:.4g}" for force in load]


def words(found: Calibration, plan: Plan) -> bytes:
    """What to do, and what each point buys."""
    scope, readings = found.sensors.range, int(usual("readings"))
    held = ("kept level by a flat face" if found.sensors.is_held
            else "free to tilt: weights on it, threads glued to its middle")  # fmt: skip
    option = " --rotation held" if found.sensors.is_held else ""
    other = (
        "Weights and threads leave the target free to tilt: leave out `--rotation held` then, and the map is that"
        if found.sensors.is_held
        else "Add `--rotation held` where a flat face keeps the target level: the map is that"
    )
    lines = [
        f"Calibration of the sensor {found.map.sensor}",
        "",
        "1. Let board and converter run for ten minutes, and load the sensor fully and unload it five to ten times:",
        "   raw readings drift after start, and silicones soften on the first pulls.",
        "2. Fill in plan.csv: for every row put the load on, wait ten seconds, write down the mean of",
        f"   {readings} readings (counts) of every coil. The target is {held}.",
        "   The line `# rotation:` of plan.csv says so, too; calibrate refuses it where its option says the other, and",
        "   tells where the readings look like the other.",
        "3. The first row is the tare, without load. Repeat it between as often as you like, as a row of its own:",
        "   every row goes with the tare before it, so drift is taken out.",
        f"4. `sitscad calibrate SPEC plan.csv{option}` fits the sensor, and writes calibration.h and calibration.json.",
        f"   {other}",
        "   of a target which is loaded so in use, too.",
        "",
        "Rows may be left out from the end, and others added: these stand in the order of what they tell. Expected",
        "is one sigma of the force from unit to unit once the rows so far are measured, over all loads; noise,",
        "hysteresis, creep and temperature come on top.",
        "",
        f"{'row':>3}  {'load':<48}{'expected error (N)':<30}",
        f"{'':>3}  {'not even the tare':<48}{_errors(plan.untared, scope.axes):<30}".rstrip(),
        f"{'':>3}  {'the tare alone, not calibrated':<48}{_errors(plan.errors[0], scope.axes):<30}".rstrip(),
    ]  # fmt: skip
    for number, (load, error) in enumerate(zip(plan.loads, plan.errors[1:], strict=True), start=1):
        lines.append(f"{number:>3}  {_load(load, scope.axes):<48}{_errors(error, scope.axes):<30}".rstrip())
    lines += ["", "Weights by g = 9.80665 m/s^2.", *(f"Note: {note}." for note in found.notes), ""]
    return "\n".join(lines).encode("ascii", "replace")


def _load(load: Array, axes: Sequence[str]) -> str:
    said = [f"{1e3 * load[0] / GRAVITY:.0f} g on it"]
    for k, name in ((1, "x"), (2, "y")):
        if f"shear_{name}" in axes and load[k]:
            said.append(f"{1e3 * abs(load[k]) / GRAVITY:.0f} g pull {'+' if load[k] > 0.0 else '-'}{name}")
    return ", ".join(said)


def _errors(errors: Array, axes: Sequence[str]) -> str:
    return ", ".join(f"{name} {error:.2g}" for name, error in zip(axes, errors, strict=True))
