"""Texts on disagreements of points and model.

They concern the row with the worst chi-square, unusual values of unknowns, noise at rest, and a target with the other
rotation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from sitscad.assembly.places.motions import ROTATIONS
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.bench_data import BenchTable
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.map_fit import ASKED, LEARNT
from sitscad.calibration.model_fit import SUSPECT, ModelFit, NoFit, fit_model
from sitscad.calibration.points import Points, load_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance_values import amount_text

UNUSUAL = 3.0
"""Standard deviations of manufacture above which an unknown is reported, with a possible cause.

No simulated sensor differs by more than 2.
"""

LIKELIER = 12.0
"""Difference of the fits' costs above which the other rotation is reported as the true one.

A cost is twice a logarithm of a likelihood, so the odds are 400 to 1.
"""

ODD = 3.7
"""Standard deviations, by its chi-square beside the scatter of all others, above which a row is reported."""

NOISY = 0.5
"""Force error by noise, relative to the error of the loads (`usual("force")`), above which noise is reported."""

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
"""Possible causes of an unusual unknown, by its name without coil or direction."""


def cause(name: str) -> str:
    """Return a text with the possible cause of an unusual unknown."""
    first = name.partition(".")[0]
    return CAUSES.get(first) or CAUSES[first.rpartition("_")[0]]


def unusual_unknowns(sensors: Sensors, fit: ModelFit) -> Iterator[str]:
    """Yield a note on each unknown that is `UNUSUAL`, the largest first."""
    for k in np.argsort(-np.abs(fit.moved), kind="stable"):
        unknown, deviation = sensors.known[k], float(fit.moved[k])
        if abs(deviation) > UNUSUAL:
            amount = f"{fit.errors[k]:.3g} {'relative' if unknown.unit == '1' else unknown.unit}"
            yield (f"unusual: {unknown.name} is {deviation:+.1f} sigma of manufacture off ({amount}): "
                   f"{cause(unknown.name)}? The forces are right for the loads of the table only if those are right")


def worst_row(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> tuple[str, str, float, float]:
    """Return the row with the worst chi-square: place, text, standard deviations, and error in full scales.

    The error is 0 for poses.
    """
    row = int(np.argmax(np.where(points.at_rest, -np.inf, fit.odd)))
    text, share = f"by {fit.odd[row]:.1f} sigma of what the others scatter", 0.0
    if fit.force_errors is not None:
        off = np.nan_to_num(np.abs(fit.force_errors[row]) / sensors.range.full_scales)
        axis = int(np.argmax(off))
        name, share = sensors.range.axes[axis], float(off[axis])
        text = f"the others foretell {name} {amount_text(share * sensors.range.full_scales[axis], name)} off, {text}"
    return f"{table.path}:{table.lines[row]}:1", text, float(fit.odd[row]), share


def disagreement(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """Return a note if all loads disagree with the readings, or one row with all others. Empty otherwise."""
    where, text, odd, _ = worst_row(table, points, sensors, fit)
    if fit.excess <= SUSPECT and odd <= ODD:
        return ""
    return (f"{where} loads and model are off by {fit.excess:.1f} times what is expected, and this row most: {text}: "
            "noise, hysteresis, creep, a slip, or another load than the row says? Read that row again")


def noise_share(points: Points, sensors: Sensors, fit: ModelFit) -> float:
    """Return one sigma of a force near rest (full scale, worst axis) by the noise of one row and of its tare."""
    slopes = load_slopes(sensors, fit.errors, sensors.range.pressed(0.0)[None])[0]
    noise = math.sqrt(2.0) * points.noisier * sensors.of_mean(int(usual("readings")))
    return float(np.sqrt(np.sum((np.linalg.pinv(slopes) * noise) ** 2, axis=1)).max())


def noise_text(table: BenchTable, points: Points, share: float) -> str:
    """Return a text on the scatter of rows without load, `share` of full scale on a force, with the worst row."""
    tare = int(np.argmax(np.abs(points.restless).max(axis=1))) if len(points.restless) else 0
    return (f"{table.path}:{table.lines[int(np.flatnonzero(points.at_rest)[tare])]}:1 rows without load scatter by "
            f"{points.noisier:.0f} times the converter's noise (drift along the rows taken out), {100.0 * share:.2g} % "
            "of full scale on a force, this one most: a slip, noise of supply or cable, a target that was touched, or "
            "drift that goes up and down?")


def noise_note(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """Return a note if rows without load scatter by more than the converter's noise. Empty otherwise."""
    share = noise_share(points, sensors, fit)
    if points.noisier <= 1.0 or share < NOISY * usual("force"):
        return ""
    return f"{noise_text(table, points, share)} In use noise comes on top of the stated error"


@record(eq=False)
class Turned:
    """A fit for a target with the other rotation.

    `sensors` have this rotation. `likelier` is the difference of costs: positive if this `fit` is better than the
    original one.
    """

    likelier: float
    sensors: Sensors
    fit: ModelFit

    @property
    def note(self) -> str:
        """Remark on the rotation. Empty if the fit is not clearly better."""
        if self.likelier < LIKELIER:
            return ""
        rotation = self.sensors.rotation
        (this,) = (each for each in ROTATIONS if each != rotation)
        return (f"the readings are those of a target that is {ROTATIONS[rotation]}, not {ROTATIONS[this]}, as far "
                f"as the model knows (there they are {self.fit.excess:.1f} times as far off as is expected): was it "
                f"calibrated so? Then `--rotation {rotation}`, and the map is for such use")

    def error(self, fitted: InverseMap) -> Array:
        """Return the error (axes; N), rms, of a map on this sensor. 0 if it is not clearly likelier."""
        if self.likelier < LIKELIER:
            return np.zeros(len(fitted.axes))
        loads = np.vstack([np.zeros((1, 3)), self.sensors.range.inside(ASKED // 2, LEARNT)])
        frequency = self.sensors.under(self.fit.errors, loads)
        borne = np.all(np.isfinite(frequency), axis=1)
        off = fitted(frequency[borne], frequency[0]) - loads[borne][:, self.sensors.range.columns]
        return np.asarray(np.sqrt(np.mean(off**2, axis=0)))


def turned_fit(sensors: Sensors, other: Callable[[], Sensors], points: Points, fit: ModelFit) -> Turned | None:
    """Return the fit of the same loads to a target with the other rotation. `other` makes its sensors when needed.

    None for poses, for loads without shear, which do not show the rotation, and if the pad fails sideways.
    """
    if points.loads is None or not np.any(points.loads[:, [k for k in sensors.range.columns if k]]):
        return None
    try:
        turned = fit_model(other(), points)
    except (NoFit, NoResponse):
        return None
    return Turned(fit.cost - turned.cost, other(), turned)
