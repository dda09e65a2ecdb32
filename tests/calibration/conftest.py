"""One design's sensors for all tests of this folder: what is charted and fitted once serves them all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad.calibration import calibrate
from sitscad.calibration.unknowns import draw_units
from tests.oracles.bench import simulated

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="session")
def design():
    return sitscad.Design(sitscad.load(TEMPLATES / "grasper_4layer.yaml"))


@pytest.fixture(scope="session")
def foretold(design):
    """The calibration of the design before anything is measured, its target free to tilt."""
    return calibrate(design, rotation="free")


@pytest.fixture(scope="session")
def sensors(foretold):
    return foretold.sensors


@pytest.fixture(scope="session")
def hidden(sensors):
    """The errors of one simulated sensor."""
    return draw_units(sensors.unknowns, 1, 77)[0]


@pytest.fixture(scope="session")
def bench(sensors, foretold, hidden):
    """What a bench reads of that sensor at the points of the plan."""
    return simulated(sensors, hidden, foretold.plan.loads, np.random.default_rng(0))


@pytest.fixture
def table(tmp_path, sensors, bench):
    """Writes the bench's table, changed by a function of its header and rows, and gives its path."""

    def written(change=lambda head, rows: (head, rows), name="bench.csv"):
        counts = np.rint(sensors.conversion.counts(bench.frequency)).astype(int)
        loads = bench.loads[:, sensors.range.columns]
        head = [f"{axis}_N" for axis in sensors.range.axes] + [f"{coil}_counts" for coil in sensors.coils]
        rows = [[*map(str, load), *map(str, count)] for load, count in zip(loads, counts, strict=True)]
        head, rows = change(head, rows)
        path = tmp_path / name
        path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n# rotation: free\n")
        return str(path)

    return written
