"""The benchmarks' own arithmetic, and that their one command writes what it says."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import pytest
from tolerance import approx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import shapes  # noqa: E402
from measure import Growth, noise, peak  # noqa: E402

NUMBERS = (12.0, 25.0, 50.0, 100.0, 200.0)


LAWS = {"constant": (lambda n: 3.0, 0.0), "N": (lambda n: 0.1 * n, 1.0), "N^2": (lambda n: 0.02 * n * n, 2.0),
        "N^3": (lambda n: 1e-5 * n**3, 3.0)}


@pytest.mark.parametrize("name", LAWS)
def test_growth_is_named(name):
    law, exponent = LAWS[name]
    result = Growth("work", "turns", NUMBERS, tuple(law(n) for n in NUMBERS))
    assert result.name == name
    assert result.exponent == approx(exponent, abs=1e-9)


def test_a_constant_part_does_not_hide_the_growth():
    assert Growth("work", "turns", NUMBERS, tuple(5.0 + 0.02 * n * n for n in NUMBERS)).exponent > 1.8


def test_the_most_memory_is_that_of_the_work():
    assert peak(lambda: bytearray(5_000_000)) == approx(5.0, rel=0.05)
    assert peak(lambda: None) < 0.1


def test_noise_is_a_ratio_to_the_best():
    middle, worst = noise(3)
    assert 1.0 <= middle <= worst


@pytest.mark.slow
def test_every_shape_is_priced_against_the_round_coil():
    rows = list(shapes.costs(((2, 1),), shapes=(shapes.SHAPES[0], shapes.SHAPES[6])))
    assert [row.shape for row in rows] == ["circle", "square, rounded"]
    assert rows[0].over_round == 1.0 and rows[1].over_round > 0.0
    assert all(row.resistance_difference <= row.resistance_error for row in rows)
    assert shapes.table(rows)[2].startswith("| circle | 2, 1 |")


@pytest.mark.more
@pytest.mark.slow
def test_one_command_writes_tables_and_plot(tmp_path):
    pytest.importorskip("matplotlib", reason="the plot needs it")
    subprocess.run([sys.executable, str(HERE / "run.py"), "--quick", "-o", str(tmp_path)], check=True, timeout=600,
                   capture_output=True)
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert "nan" not in text
    with (tmp_path / "methods.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    methods = {row["method"] for row in rows}
    assert {"spiral-neumann", "mean-rings", "strands", "current-sheet", "side by side"} <= methods
    assert all(float(row["error"]) <= float(row["bound"]) for row in rows)
    with (tmp_path / "growth.csv").open(encoding="utf-8", newline="") as file:
        assert {row["over"] for row in csv.DictReader(file)} == {"turns", "layers", "coils"}
    assert (tmp_path / "pareto.png").stat().st_size > 20_000 and (tmp_path / "pareto.svg").exists()
