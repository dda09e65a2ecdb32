"""Mohan 1999, table IV: the closed formulas of planar spirals have the errors that are printed there."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from tolerance import approx
from windings import MM

from sitscad.kernels.electromagnetics.inductance.spirals import SpiralOutline, current_sheet, modified_wheeler, monomial
from sitscad.kernels.geometry.shapes import SHAPES

with (Path(__file__).parent / "mohan_1999_table_iv.csv").open(encoding="utf-8", newline="") as rows:
    MOHAN = list(csv.DictReader(rows))


@pytest.mark.parametrize(
    "row", [r for r in MOHAN if r["shape"] in ("square", "hexagon", "octagon")], ids=lambda r: r["id"]
)
def test_closed_formulas_reproduce_published_errors(row):
    outline = SpiralOutline(float(row["turns"]), float(row["outer_diameter_mm"]) * MM, float(row["width_mm"]) * MM,
                            float(row["spacing_mm"]) * MM)
    measured = float(row["measured_uH"]) * 1e-6
    for formula, name in ((modified_wheeler, "wheeler"), (current_sheet, "sheet"), (monomial, "monomial")):
        ours = 100.0 * (measured - formula(SHAPES[row["shape"]].sides, outline)) / measured
        assert ours == approx(float(row[f"{name}_error_pct"]), abs=0.7)


def test_wheeler_and_monomial_formulas_return_none_for_circle():
    outline = SpiralOutline(8, 4e-3, 1e-4, 1e-4)
    assert modified_wheeler(0, outline) is None
    assert monomial(0, outline) is None
    assert current_sheet(0, outline) > 0.0
