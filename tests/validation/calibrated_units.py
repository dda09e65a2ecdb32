"""Whether what a calibration states holds: simulated units, calibrated by the command's own way through a table.

    python tests/validation/calibrated_units.py [--templates NAME,NAME] [--points 5,8,12] [--units 4] [--first 0]

Every unit has errors of its own, drawn from the scatter of manufacture. Its table has the loads of the plan with three
tares, off by 0.5 % of themselves, and readings that are solved, with the converter's noise; then the same with a
hysteresis of 9.7 % of full scale in the loads, each somewhere between both branches on every axis. True errors are
those of its map at 20 other loads, without noise. A line a table says what is stated and what is true (rms over the
loads, % of full scale, by axis); the last lines say how often the stated error holds, and how many times the true one
it is.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import sitscad
from sitscad.calibration import calibrate
from sitscad.calibration.calibration import plan_calibration, simulated_sensors
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import draw_units
from sitscad.spec import templates
from tests.oracles.bench import simulated

Array = NDArray[np.float64]

HYSTERESES = 0.0971, 0.0
TRIED, SKIPPED, SEED = 20, 600, 4200


def table_of(sensors: Sensors, errors: Array, loads: Array, generator: np.random.Generator, hysteresis: float) -> str:
    """The table (CSV) that a bench writes of one unit under loads (n, 3; N)."""
    points = simulated(sensors, errors, loads, generator, hysteresis)
    head = [*(f"{axis}_N" for axis in sensors.range.axes), *(f"{coil}_Hz" for coil in sensors.coils)]
    assert points.loads is not None
    rows = np.hstack([points.loads[:, sensors.range.columns], points.frequency])
    return "\n".join([",".join(head), *(",".join(f"{value:.4f}" for value in row) for row in rows.tolist())]) + "\n"


def tried(design: sitscad.Design, count: int, number: int, hysteresis: float) -> tuple[Array, Array]:
    """What one unit's calibration states and its true error, (axes,) each, in full scales. Raises BenchError for a
    table that is refused.
    """
    sensors = simulated_sensors(design.response, True)
    plan, scope = plan_calibration(design.response, True, count).plan, sensors.range
    assert plan is not None
    errors = draw_units(sensors.unknowns, number + 1, SEED)[number]
    generator = np.random.default_rng((SEED, number, count, round(1e4 * hysteresis)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.csv"
        path.write_text(table_of(sensors, errors, plan.rows[1:], generator, hysteresis), encoding="utf-8")
        result = calibrate(design, str(path)).map
    loads = np.vstack([np.zeros((1, 3)), scope.evenly_spread_loads(TRIED, SKIPPED)])
    read = sensors.frequencies_under(errors, loads, exact=True)
    off = result(read[1:], read[0]) - loads[1:, scope.columns]
    return result.error / scope.full_scales, np.sqrt(np.mean(off**2, axis=0)) / scope.full_scales


def designs(names: list[str]) -> Iterator[tuple[str, sitscad.Design]]:
    """The templates that can be calibrated; of those with cells the first cell."""
    for name in names:
        design = sitscad.Design(sitscad.load_text(templates.read(name), f"{name}.yaml"))
        if design.spec.target is not None and design.spec.elastomer is not None:
            yield name, design.cells.by_number(1)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--templates", default=",".join(templates.names()))
    parser.add_argument("--points", default="5,8,12")
    parser.add_argument("--units", type=int, default=4)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    result: dict[float, list[tuple[Array, Array]]] = {item: [] for item in HYSTERESES}
    refused = 0
    for name, design in designs(given.templates.split(",")):
        for count in map(int, given.points.split(",")):
            for hysteresis in HYSTERESES:
                for number in range(given.first, given.first + given.units):
                    try:
                        stated, true = tried(design, count, number, hysteresis)
                    except sitscad.BenchError as error:
                        refused += 1
                        print(name, count, hysteresis, number, "refused:", str(error).partition(" ")[2], flush=True)
                        continue
                    result[hysteresis].append((stated, true))
                    print(name, count, hysteresis, number, "stated", (100.0 * stated).round(2).tolist(), "true",
                          (100.0 * true).round(2).tolist(), flush=True)
    print(f"# refused {refused}")
    for hysteresis, pairs in result.items():
        stated, true = (np.concatenate(part) for part in zip(*pairs, strict=True))
        print(f"# hysteresis {hysteresis}: {len(pairs)} tables, stated holds for {100.0 * np.mean(true <= stated):.1f} "
              f"%, worst true over stated {np.max(true / stated):.2f}, median stated over true "
              f"{np.median(stated / true):.2f}, rms stated over rms true "
              f"{np.sqrt(np.mean(stated**2) / np.mean(true**2)):.2f}")


if __name__ == "__main__":
    main()
