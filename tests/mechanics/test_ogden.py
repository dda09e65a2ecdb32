"""By how much Ogden's rubber presses otherwise than the neo-Hookean one of the pad's law (docs/accuracy.md)."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

FIGURES = Path(__file__).parents[1] / "validation" / "ogden_figures.csv"


def more(exponent, strain, shape):
    """Its force over the neo-Hookean one, less 1. Two terms are exact: a bar's -1/4 (here a little more, for the bonded
    ends), and (alpha^2 - 4) / 24 of the square of a shear, which grows with the shape factor.
    """
    sheared = (exponent + 2.0) / 24.0 * strain**2 * (1.0 + 14.0 * shape**2 + 7.0 * strain)
    return (exponent - 2.0) * (sheared - 0.27 * strain)


def figures():
    with FIGURES.open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    key = [(row["along"], row["across"], row["round"], row["z"]) for row in rows]
    plain = {k: float(row["force_z"]) for k, row in zip(key, rows, strict=True) if float(row["exponent"]) == 2.0}
    for k, row in zip(key, rows, strict=True):
        if float(row["exponent"]) != 2.0:
            along, across = float(row["along"]), float(row["across"])
            shape = 0.5 * along * across / (along + across)
            yield float(row["exponent"]), -float(row["z"]), shape, float(row["force_z"]) / plain[k] - 1.0


def test_the_formula_of_the_docs_is_what_finite_elements_say():
    """Shape factors to 1 within 2.5 % of the force, up to 6.5 % of round ones at 35 %."""
    some = [(more(*one[:3]) - one[3], one) for one in figures()]
    assert len(some) >= 25
    flat = [apart for apart, (_, strain, _, _) in some if strain <= 0.3]
    assert max(map(abs, flat)) < 0.04
    assert max(abs(apart) for apart, _ in some) < 0.065


@pytest.mark.parametrize(("exponent", "strain", "shape", "most"), [(2.42, 0.2, 0.5, 0.005), (2.54, 0.3, 0.5, 0.02)])
def test_soft_silicones_differ_little(exponent, strain, shape, most):
    """Those of the Ecoflex kind, on pads twice as wide as thick."""
    assert abs(more(exponent, strain, shape)) < most
