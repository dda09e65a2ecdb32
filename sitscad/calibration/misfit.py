"""Why points and model disagree, in words: unknowns far off, errors with a pattern, a target that turns otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from sitscad.arrays import Array
from sitscad.calibration.bench_data import BenchTable
from sitscad.calibration.forms import ASKED, LEARNT
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.model_fit import SUSPECT, ModelFit, NoFit, fit_model
from sitscad.calibration.points import Points, load_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual
from sitscad.estimates.response.pad import NoResponse
from sitscad.record import record
from sitscad.scene.motions import ROTATIONS

UNUSUAL = 3.0
"""Standard deviations of manufacture from which on an unknown is told with what may be the cause: no simulated sensor
is off by more than 2."""

LIKELIER = 12.0
"""Difference of the fits' costs (twice a logarithm of likelihoods: odds of 400 to 1) from which on the other way of
loading is said to be the true one."""

ODD = 3.7
"""Standard deviations, beside the scatter of all others, from which on one coil's reading in one row is told: of 16
readings as they should be one is in 290 tables."""

NOISY = 0.5
"""Error of a force by noise, over that of the loads themselves (`usual("force")`), from which on noise is told."""

FEWEST, EXPLAINED = 6, 0.6
"""Points from which on a pattern is looked for, and the share of an axis' squared errors that it explains at least."""

CAUSES = {
    "gap": "a pad of another thickness (elastomer.thickness), or another glue line",
    "glue": "another glue line, or a pad that is not bonded",
    "offset": "a target that lies beside its place (target.offset)",
    "tilt": "a target or pad that was glued on askew",
    "twist": "a target that is turned (target.rotation)",
    "modulus": "another silicone or mix (elastomer.material), or normal loads in another unit (g, kgf)",
    "shear_modulus": "shear loads of another size than the table says (a thread that pulls askew or rubs, another "
                     "unit), or a target that turns otherwise (--rotation)",
    "pad_curve": "a pad that stiffens otherwise than its law, or the largest normal loads are not what the table says",
    "softening": "a target that turns otherwise (--rotation), or shear that was read without the normal force of its "
                 "row",
    "shear_curve": "a pad that stiffens in shear otherwise than its law, or the largest shear loads are not what the "
                   "table says",
    "inductance": "coils of another spec",
    "target_change": "a target of another size or metal, or metal behind the coils that the spec does not have",
    "capacitor": "another capacitor, another reference clock (readout.clock), or coils of another spec",
}
"""What may have put an unknown far off, by its name without its coil or direction."""


def cause(name: str) -> str:
    """What may have put an unknown far off, in words."""
    first = name.partition(".")[0]
    return CAUSES.get(first) or CAUSES[first.rpartition("_")[0]]


def far_off(sensors: Sensors, fit: ModelFit) -> Iterator[str]:
    """A note on each unknown that is `UNUSUAL`, the farthest first."""
    for k in np.argsort(-np.abs(fit.moved), kind="stable"):
        one, far = sensors.known[k], float(fit.moved[k])
        if abs(far) > UNUSUAL:
            amount = f"{fit.errors[k]:.3g} {'relative' if one.unit == '1' else one.unit}"
            yield (f"unusual: {one.name} is {far:+.1f} sigma of manufacture off ({amount}): {cause(one.name)}? The "
                   "forces are right for the loads of the table only if those are right")


def odd_reading(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """A note on the one reading that the others contradict, with its row and coil; nothing where all are alike."""
    off = np.where(points.at_rest[:, None], 0.0, fit.odd)
    row, coil = np.unravel_index(int(np.argmax(off)), off.shape)
    if off[row, coil] < ODD:
        return ""
    column = table.column(sensors.coils[int(coil)])
    amount = table.numbers(column)[row] * fit.slips[row, coil] * (-2.0 if column.kind == "H" else 1.0)
    return (f"{table.where(int(row), column)} {column.name} reads {amount:+.3g} {column.unit} off what the other rows "
            f"foretell, {off[row, coil]:.1f} sigma of their scatter: a slip of this reading, or another load than the "
            "row says? Read that row again")


def noise_share(points: Points, sensors: Sensors, fit: ModelFit) -> float:
    """One sigma of a force (of full scale, the worst axis) by the noise of one row and of its tare, near rest."""
    slopes = load_slopes(sensors, fit.errors, sensors.range.pressed(0.0)[None])[0]
    noise = math.sqrt(2.0) * points.noisier * sensors.of_mean(int(usual("readings")))
    return float(np.sqrt(np.sum((np.linalg.pinv(slopes) * noise) ** 2, axis=1)).max())


def noisy(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """A note on the row and coil whose reading without load is off by more than the converter's noise; else None."""
    share = noise_share(points, sensors, fit)
    if points.noisier <= 1.0 or share < NOISY * usual("force"):
        return ""
    left = points.restless
    tare, coil = np.unravel_index(int(np.argmax(np.abs(left))), left.shape)
    row = int(np.flatnonzero(points.at_rest)[tare])
    column = table.column(sensors.coils[int(coil)])
    size = table.numbers(column)[row] * (2.0 if column.kind == "H" else 1.0)
    expected = size * float(sensors.of_mean(int(usual("readings")))[coil])
    amount = abs(size * float(left[tare, coil]))
    return (f"{table.where(row, column)} rows without load scatter by {points.noisier * expected:.3g} {column.unit} "
            f"(one sigma, drift along the rows taken out) where {expected:.2g} are expected, {100.0 * share:.2g} % of "
            f"full scale on a force; {column.name} is farthest off here, by {amount:.3g} {column.unit}: a slip, noise "
            "of supply or cable, a target that was touched, or drift that goes up and down? In use noise comes on top "
            "of the stated error")


def pattern(points: Points, fit: ModelFit, sensors: Sensors) -> str:
    """What the errors of the axis that is worst go with, in words, where loads and model disagree; else nothing."""
    if fit.force_errors is None or points.loads is None or fit.excess < SUSPECT:
        return ""
    pressed = ~points.at_rest
    loads, errors = points.loads[pressed], fit.force_errors[pressed]
    if len(loads) < FEWEST or not np.all(np.isfinite(errors)):
        return ""
    worst = int(np.argmax(np.sum((errors / sensors.range.full_scales) ** 2, axis=0)))
    column, name, off = sensors.range.columns[worst], sensors.range.axes[worst], errors[:, worst]
    rows = np.flatnonzero(pressed).astype(float)
    found = [(_share(_centred(rows), _centred(off)), f"{name} is off more and more with the rows: drift or creep; take "
              "tares between, and wait ten seconds on each load")]
    if column:
        found += [
            (_share(loads[:, column], off), f"{name} is off in proportion to it: the thread rubs, pulls askew, or the "
             "loads are in another unit"),
            (_share(loads[:, column] * loads[:, 0], off), f"{name} is off with the product of shear and normal force: "
             "under both the pad gives way otherwise than its law, or the target is held otherwise (--rotation)"),
        ]
    else:
        sides = [k for k in sensors.range.columns if k]
        aside = np.linalg.norm(loads[:, sides] / sensors.range.full_scales[1:], axis=1)
        found.append((_share(_centred(aside), _centred(off)), "the normal force is off with the shear on it: the "
                      "thread pulls up or down, or beside the middle of the outermost face"))
    share, words = max(found)
    return words if share > EXPLAINED else ""


def _centred(values: Array) -> Array:
    return np.asarray(values - values.mean())


def _share(term: Array, off: Array) -> float:
    """Share of the squares of `off` (n) that a multiple of `term` (n) explains."""
    size = float(term @ term) * float(off @ off)
    return float(term @ off) ** 2 / size if size > 0.0 else 0.0


@record(eq=False)
class Turned:
    """A `fit` beside one of a target that turns otherwise, by its `sensors`: by how much `likelier` it is."""

    likelier: float
    sensors: Sensors
    fit: ModelFit

    @property
    def note(self) -> str:
        """What to say of it; nothing where it is not clearly better."""
        if self.likelier < LIKELIER:
            return ""
        rotation = self.sensors.rotation
        (this,) = (one for one in ROTATIONS if one != rotation)
        return (f"the readings are those of a target that is {ROTATIONS[rotation]}, not {ROTATIONS[this]}, as far "
                f"as the model knows (there they are {self.fit.excess:.1f} times as far off as is expected): was it "
                f"calibrated so? Then `--rotation {rotation}`, and the map is for such use")

    def error(self, made: InverseMap) -> Array:
        """The error (axes; N), rms, that a map has on this sensor. 0 if it is not clearly likelier."""
        if self.likelier < LIKELIER:
            return np.zeros(len(made.axes))
        loads = np.vstack([np.zeros((1, 3)), self.sensors.range.inside(ASKED // 2, LEARNT)])
        frequency = self.sensors.under(self.fit.errors, loads)
        borne = np.all(np.isfinite(frequency), axis=1)
        off = made(frequency[borne], frequency[0]) - loads[borne][:, self.sensors.range.columns]
        return np.asarray(np.sqrt(np.mean(off**2, axis=0)))


def turned_fit(sensors: Sensors, other: Callable[[], Sensors], points: Points, fit: ModelFit) -> Turned | None:
    """The fit of the same loads to a target that turns otherwise (`other`, asked for only then); None of poses, of
    loads without shear, which do not tell one from the other, and where the pad gives way so.
    """
    if points.loads is None or not np.any(points.loads[:, [k for k in sensors.range.columns if k]]):
        return None
    try:
        found = fit_model(other(), points)
    except (NoFit, NoResponse):
        return None
    return Turned(fit.cost - found.cost, other(), found)
