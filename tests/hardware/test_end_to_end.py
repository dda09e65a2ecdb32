"""Newtons put on, newtons read: response, simulated converter, points led through, compiled driver with their map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad.apps.hardware.leading import GuidedCalibration
from sitscad.apps.hardware.source import Simulation, open_source
from sitscad.calibration.unknowns import usual_value
from sitscad.files.formats.calibration_header import header
from tests.hardware.conftest import SANE, TEMPLATES, compiled

pytestmark = [pytest.mark.clients("gcc"), pytest.mark.slow]

LOADS, UNIT = 80, 3


class ByHand(Simulation):
    """A simulated board whose loads are put on as well as loads are known."""

    def apply_load(self, load: np.ndarray, is_held: bool, cell: int = 1) -> None:
        error = 1.0 + usual_value("force") * np.random.default_rng(np.abs(1e6 * load).astype(int)).normal(size=3)
        super().apply_load(load * error, is_held, cell)


def _calibrated(name: str, folder: Path) -> tuple[sitscad.Calibration, sitscad.Calibration, Simulation]:
    """What is foretold of a template, a board as it is made calibrated with the points of the plan, and that board."""
    path = TEMPLATES / f"{name}.yaml"
    design = sitscad.Design(sitscad.load(path))
    planned = sitscad.calibrate(design)
    source, _ = open_source(f"sim:{path}?unit={UNIT}", design)
    source = ByHand(design, source.chips, None, source.errors)
    board = source.board(design)
    assert board.set_up() == []
    *_, table = GuidedCalibration(board, source, planned, str, str).table()
    (folder / "measured.csv").write_text(table)
    return planned, sitscad.calibrate(design, folder / "measured.csv"), source


def _driven(found: sitscad.Calibration, source: Simulation, folder: Path, frequencies: np.ndarray) -> np.ndarray:
    """The forces (n, axes; N) that the compiled driver says under loads, the first of which is the tare."""
    bench = compiled(source.design, folder, SANE, header(found.map, found.sensors.conversion))
    ohms = [coil.states["rest"].parallel_resistance for coil in source.design.estimates.coils]

    def wired(row: np.ndarray) -> list[str]:
        return [f"coil {k} {value:.17g} {ohms[k]:.17g}" for k, value in enumerate(row)]

    words = [*wired(frequencies[0]), "begin", "settle 6", *["settle 1", "tare"] * 16]
    for row in frequencies[1:]:
        words += [*wired(row), "settle 6", "forces"]
    text = np.array([[float(word) for word in row] for row in bench.run(*words)[35::2]])
    assert np.all(text[:, 0] == 0)
    return text[:, 1:]


@pytest.mark.parametrize(
    "name",
    ["bench_7mm", *(pytest.param(name, marks=pytest.mark.more)
                    for name in ("three_axis_pad", "three_axis_triangle", "square_bench", "jaw_5x20"))],
)
def test_simulated_forces_are_recovered_within_stated_error(tmp_path, capsys, name):
    """What 95 % of sensors stay below is stated, without noise: that of one reading after a tare of 16 comes on top."""
    planned, result, source = _calibrated(name, tmp_path)
    sensors, scope = result.sensors, result.sensors.range
    loads = np.vstack([np.zeros((1, 3)), scope.evenly_spread_loads(LOADS, 700)])
    frequencies = sensors.frequencies_under(source.errors[0], loads, exact=True)
    text, given = _driven(result, source, tmp_path, frequencies), loads[1:, scope.columns]
    generator, true = np.random.default_rng(1), result.map(frequencies[1:], frequencies[0])
    noisy = [result.map(sensors.noisy_frequencies(frequencies[1:], generator, 1), frequencies[0]) - true
             for _ in range(20)]
    noise = np.sqrt(17 / 16 * np.mean(np.square(noisy), axis=(0, 1)))
    off = np.sqrt(np.mean((text - given) ** 2, axis=0))
    stated = np.hypot(result.map.error, noise)
    sigma = planned.plan.errors[-1]
    with capsys.disabled():
        shown = [f"{what} {np.round(1e3 * values, 1)}" for what, values in
                 (("off by", off), ("stated", result.map.error), ("noise", noise), ("data sheet, one sigma", sigma))]
        print(f"\n  {name}, mN: {', '.join(shown)}; {np.round(off / stated, 2)} of stated and noise")
    assert np.all(off < stated)
    assert np.all(off < 2.0 * np.hypot(sigma, noise))
