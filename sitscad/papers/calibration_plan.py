"""What to do on the bench: the table to fill in, and words."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.arrays import Array
from sitscad.calibration.calibration import Calibration
from sitscad.calibration.plan import Plan, load_words, table_head
from sitscad.calibration.unknowns import usual
from sitscad.scene.motions import ROTATIONS

LOADING = {
    "held": ("a stiff flat plate presses on all of it, guided so that it stays parallel to the board (a linear stage,",
             "a press stand), a load cell behind it; shear is a push on the plate. Weights and threads do not do so."),
    "free": ("weights on its middle, threads glued to the middle of its outermost face.",),
}
"""How loads are put on, by rotation."""


def table(found: Calibration, plan: Plan) -> bytes:
    """The loads as the CSV that `sitscad calibrate` reads when filled in; its first line says how they are put on."""
    sensors = found.sensors
    rows = [[f"{force:.4g}" for force in load[sensors.range.columns]] + [""] * len(sensors.coils) for load in plan.rows]
    return ("\n".join([*table_head(sensors), *map(",".join, rows)]) + "\n").encode("ascii")


def words(found: Calibration, plan: Plan) -> bytes:
    """What to do, and what each point buys."""
    scope, readings = found.sensors.range, int(usual("readings"))
    rotation, device = found.sensors.rotation, found.sensors.conversion.device
    made = f": {device.part}_COUNTS of results, firmware/{device.name}_config.h" if device.has_gains else ""
    (other,) = (one for one in ROTATIONS if one != rotation)
    of = "" if found.cell is None else f" --cell {found.cell}"
    lines = [
        f"Calibration of the sensor {found.map.sensor}", "",
        "1. Let board and converter run for ten minutes, and load the sensor fully and unload it five to ten times:",
        "   raw readings drift after start, and silicones soften on the first pulls.",
        "2. Fill in plan.csv: for every row put the load on, wait ten seconds, write down the mean of",
        f"   {readings} readings (counts{made}) of every coil. The target is {ROTATIONS[rotation]}:",
        *(f"   {line}" for line in LOADING[rotation]),
        "   The line `# rotation:` of plan.csv says which, and calibrate goes by it; it tells where the readings look",
        "   like the other.",
        "3. Rows of zeros are tares, without load: the first, one in the middle, one at the end, and more between as",
        "   often as you like. Every row goes with the tare before it, so drift is taken out; three and more tell what",
        "   noise the readings have.",
        f"4. `sitscad calibrate SPEC plan.csv{of}` fits the sensor, and writes calibration.h and calibration.json. The",
        f"   map is that of a target which is {ROTATIONS[rotation]} in use, too; for one that is {ROTATIONS[other]}",
        f"   `sitscad calibrate SPEC --rotation {other}{of}` makes the plan.", "",
        "Loads may be left out from the end, and others added: they stand in the order of what they tell. Expected",
        "is one sigma of the force from unit to unit once the rows so far are measured, over all loads, for pads",
        "about as stiff as drawn (with a much softer one a unit is off by more, as its own calibration says); noise,",
        "hysteresis, creep and temperature come on top.", "", f"{'row':>3}  {'load':<48}  {'expected error (N)':<30}",
        f"{'':>3}  {'not even the tare':<48}  {_errors(plan.untared, scope.axes):<30}".rstrip(),
        f"{'':>3}  {'the tare alone, not calibrated':<48}  {_errors(plan.errors[0], scope.axes):<30}".rstrip(),
    ]
    for number, (load, error) in enumerate(zip(plan.loads, plan.errors[1:], strict=True), start=1):
        words = load_words(load, scope.axes, rotation)
        lines.append(f"{number:>3}  {words:<48}  {_errors(error, scope.axes):<30}".rstrip())
    weighed = [] if found.sensors.is_held else ["Weights by g = 9.80665 m/s^2."]
    lines += ["", *weighed, *(f"Note: {note}." for note in found.notes), ""]
    return "\n".join(lines).encode("ascii", "replace")


def _errors(errors: Array, axes: Sequence[str]) -> str:
    return ", ".join(f"{name} {error:.2g}" for name, error in zip(axes, errors, strict=True))
