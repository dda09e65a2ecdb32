"""How many points buy which accuracy: simulated sensors with hidden errors and noise, calibrated by few points.

Every sensor has its own gap, offset, tilt, modulus, law of the pad, coils and capacitors, drawn from the scatter of
manufacture; one of its errors is not looked for by the fit (the clock). Its readings are solved, not charted. Of
"another law" the pad follows an exponent of Ogden's law that is higher or lower by 0.5 than the model's, in turn, which
none of the unknowns is made for; "hysteresis" puts the loads somewhere between two curves. Calibrated is it by the
model's unknowns, and by a plain polynomial through the same points (of L, its degree by leaving one out). Both are
tried on other loads, without noise. The columns are one sigma (rms over sensors and axes) and the worst tenth of
sensors, in per cent of full scale; and, of maps that state an error, over all sensors and axes: the largest true error
(rms over the loads tried) over the stated one, the median of stated over true, and the share (%) of true ones that the
stated one holds for.

Run `python tests/validation/calibration_points.py [--sensors 100] [--templates NAME,NAME] [--write]`; with `--write`
table and figure of docs/calibration.md are made; templates that were not asked for keep their rows.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import sitscad
from sitscad.calibration.calibration import calibrate_from_points, plan_calibration, simulated_sensors
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.points import Points
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import draw_units
from sitscad.kernels.electromagnetics.polynomials import exponents, monomials
from tests.oracles.bench import simulated

Array = NDArray[np.float64]

HERE = Path(__file__).parent
TABLE, FIGURE = HERE / "calibration_points.csv", HERE.parents[1] / "docs" / "calibration-points.svg"
TEMPLATES = ("grasper_4layer", "three_axis_triangle")
FEW, MANY = (3, 5, 8, 12), (20, 50)
SENSORS, TRIED, SEED, HYSTERESIS = 100, 20, 100, 0.0971
OTHER_EXPONENTS = 0.5, -0.5

Errors = dict[tuple[str, int], list[tuple[float, Array]]]
"""By method and number of points, of every sensor: its error, and on every axis that over the stated one (or 0)."""

COLUMNS = ("template", "method", "points", "rms_percent", "worst_tenth_percent", "sensors", "most_over_stated",
           "median_stated_over_true", "within_stated_percent")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sensors", type=int, default=SENSORS, help=f"the first so many of {SENSORS}")
    parser.add_argument("--templates", default=",".join(TEMPLATES))
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    names = given.templates.split(",")
    rows: list[tuple[object, ...]] = []
    for name in names:
        result = shown(name, given.sensors, given.jobs)
        rows += result
        for row in result:
            print(",".join(map(str, row)), flush=True)
    if given.write:
        rows = sorted([*rows, *others(names)], key=lambda row: TEMPLATES.index(str(row[0])))
        with TABLE.open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows([COLUMNS, *rows])
        draw(rows)


def others(names: list[str]) -> list[tuple[object, ...]]:
    """The table's rows of templates that are not tried now: they stay."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        return [tuple(row) for row in csv.reader(stream) if row[0] in set(TEMPLATES) - set(names)]


def shown(name: str, count: int, jobs: int) -> list[tuple[object, ...]]:
    """The rows of one template."""
    began = time.monotonic()
    design = sitscad.Design(sitscad.load(HERE.parents[1] / "templates" / f"{name}.yaml"))
    drawn = plan_calibration(design.response, count=max(FEW))
    sensors, loads = drawn.sensors, drawn.plan.loads
    print(f"# {name}: {drawn.map.form}", flush=True)
    others = tuple(of_another_law(design, more) for more in OTHER_EXPONENTS)
    trial = Trial(sensors, loads, drawn.map, others)
    errors: Errors = {}
    with multiprocessing.get_context("fork").Pool(jobs, _take, (trial,)) as pool:
        for number, found in enumerate(pool.imap(_one, enumerate(draw_units(sensors.unknowns, SENSORS, SEED)[:count]))):
            for key, error in found.items():
                errors.setdefault(key, []).append(error)
            if number % 10 == 9:
                print(f"# {name}: {number + 1} of {count}, {time.monotonic() - began:.0f} s", flush=True)
                for row in told(name, errors):
                    print("#", *row, flush=True)
    return told(name, errors)


def of_another_law(design: sitscad.Design, more: float) -> Sensors:
    """Sensors of a design whose pad has an exponent higher by so much."""
    pad = design.spec.elastomer
    assert pad is not None
    material = replace(pad.material, ogden_exponent=pad.material.ogden_exponent + more)
    return simulated_sensors(sitscad.Design(replace(design.spec, elastomer=replace(pad, material=material))).response)


@dataclass(frozen=True)
class Trial:
    """What all sensors of a template have in common: the model, the plan, the drawn map; and
    sensors whose pads follow other laws.
    """

    sensors: Sensors
    loads: Array
    drawn: InverseMap
    others: tuple[Sensors, ...]

    def errors(self, number: int, own: Array) -> dict[tuple[str, int], tuple[float, Array]]:
        """Error (rms, of full scale) of one sensor by method and number of points; and on every axis that over what is
        stated, 0 where nothing is.
        """
        sensors = self.sensors
        result: dict[tuple[str, int], tuple[float, Array]] = {}
        tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(TRIED, 600)])
        read, wanted = sensors.frequencies_under(own, tried, exact=True), tried[1:, sensors.range.columns]

        def note(method: str, points: int, mapped: Callable[[Array, Array], Array]) -> None:
            off = (mapped(read[1:], read[0]) - wanted) / sensors.range.full_scales
            stated = mapped.error / sensors.range.full_scales if isinstance(mapped, InverseMap) else np.inf
            result[method, points] = float(np.sqrt(np.mean(off**2))), np.sqrt(np.mean(off**2, axis=0)) / stated

        note("drawn", 0, self.drawn)
        generator = np.random.default_rng((SEED, number))
        for points in FEW:
            bench = simulated(sensors, own, self.loads[:points], generator)
            note("model", points, calibrate_from_points(sensors, bench).map)
            note("plain", points, plain(sensors, bench))
        worn = simulated(sensors, own, self.loads[:8], generator, HYSTERESIS)
        note("model, hysteresis", 8, calibrate_from_points(sensors, worn).map)
        note("plain, hysteresis", 8, plain(sensors, worn))
        other = self.others[number % len(self.others)]
        bench = simulated(other, own, self.loads[:8], generator)
        read = other.frequencies_under(own, tried, exact=True)
        note("model, another law", 8, calibrate_from_points(sensors, bench).map)
        note("plain, another law", 8, plain(sensors, bench))
        read = sensors.frequencies_under(own, tried, exact=True)
        bench = simulated(sensors, own, sensors.range.evenly_spread_loads(max(MANY)), generator)
        for points in MANY:
            note("plain", points, plain(sensors, bench.part(np.arange(points + 1))))
        return result


_trial: Trial | None = None


def _take(trial: Trial) -> None:
    """What every process begins with."""
    global _trial
    _trial = trial


def _one(numbered: tuple[int, Array]) -> dict[tuple[str, int], tuple[float, Array]]:
    assert _trial is not None
    try:
        return _trial.errors(*numbered)
    except ValueError as error:
        raise ValueError(f"sensor {numbered[0]}: {error}") from error


def told(name: str, errors: Errors) -> list[tuple[object, ...]]:
    """The rows of what was found so far."""
    rows: list[tuple[object, ...]] = []
    for (method, points), result in sorted(errors.items()):
        off, over = (np.array(part) for part in zip(*result, strict=True))
        root, tenth = 100.0 * np.sqrt(np.mean(off**2)), 100.0 * np.quantile(off, 0.9)
        stated = ("", "", "") if not over.any() else (
            f"{over.max():.2g}", f"{1.0 / np.median(over):.2g}", f"{100.0 * np.mean(over <= 1.0):.0f}")
        rows.append((name, method, points, f"{root:.3g}", f"{tenth:.3g}", len(result), *stated))
    return rows


def plain(sensors: Sensors, points: Points) -> Callable[[Array, Array], Array]:
    """A map from readings and tare to forces: a polynomial of L over its rest, of the degree that foretells points left
    out best.
    """
    pressed, scale = ~points.at_rest, sensors.range.full_scales
    assert points.loads is not None
    forces = points.loads[pressed][:, sensors.range.columns] / scale
    changes = (points.rest / points.frequency[pressed]) ** 2 - 1.0
    size = np.abs(changes).max(axis=0)
    result = None
    for degree in range(1, 6):
        powers = exponents([1.0] * changes.shape[1], degree, 1)
        if degree > 1 and len(powers) >= len(changes):
            break
        coefficients, alone = ridge(monomials(changes / size, powers), forces, 1e-9)
        left = float(np.sum(alone**2))
        if result is None or left < result[0]:
            result = left, powers, coefficients
    _, powers, coefficients = result

    def mapped(readings: Array, tare: Array) -> Array:
        return monomials(((tare / readings) ** 2 - 1.0) / size, powers) @ coefficients * scale

    return mapped


def ridge(columns: Array, wanted: Array, weight: float) -> tuple[Array, Array]:
    """Coefficients (terms, outputs) that take columns (n, terms) to what is wanted (n, outputs), held small by `weight`
    of the columns' mean square; and what is left of every row when it is foretold by the others alone (n, outputs).
    """
    size = np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    scaled = columns / size
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    shrunk = singular / (singular**2 + weight * len(columns))
    result = (right.T * shrunk) @ (left.T @ wanted)
    hat = np.sum(left**2 * (singular * shrunk), axis=1)
    alone = (wanted - scaled @ result) / np.maximum(1.0 - hat, 1e-9)[:, None]
    return result / size[:, None], alone


def draw(rows: list[tuple[object, ...]]) -> None:
    """The figure: error over points, both methods, a panel a template."""
    os.environ["SOURCE_DATE_EPOCH"] = "0"
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {"svg.hashsalt": "sitscad", "svg.fonttype": "path", "font.size": 9}
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(str(row[0]) for row in rows))
    figure, panels = plt.subplots(1, len(names), figsize=(4.2 * len(names), 3.4), sharey=True, squeeze=False)
    for panel, name in zip(panels[0], names, strict=True):
        for method, colour, mark in (("model", "#0b5fa5", "o"), ("plain", "#b5541c", "s")):
            own = sorted((int(row[2]), float(row[3]), float(row[4])) for row in rows if row[:2] == (name, method))
            places, middle, tenth = zip(*own, strict=True)
            panel.plot(places, middle, color=colour, marker=mark, label=f"{LABELS[method]}, rms")
            panel.plot(places, tenth, color=colour, linestyle=":", label=f"{LABELS[method]}, worst tenth")
        drawn = next(float(row[3]) for row in rows if row[:2] == (name, "drawn"))
        panel.axhline(drawn, color="#666666", linewidth=0.8, linestyle="--", label="drawn sensor's map, tare alone")
        panel.set(xscale="log", yscale="log", xlabel="points beside the tare", title=name)
        panel.set_xticks([3, 5, 8, 12, 20, 50], ["3", "5", "8", "12", "20", "50"], minor=False)
        panel.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
        panel.grid(True, which="both", linewidth=0.3)
    panels[0][0].set_ylabel("error of force (% of full scale)")
    panels[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(FIGURE, metadata={"Date": None, "Creator": None})


LABELS = {"model": "model first", "plain": "plain polynomial"}

if __name__ == "__main__":
    main()
