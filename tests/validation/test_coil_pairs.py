"""The stated bound of the mutual inductance of two coils against the volume integral, on random pairs of every shape.

The references are data (coil_pairs.csv, by coil_pairs.py). The constants of the bound were chosen on the pairs of
numbers below 51; those from there on were integrated afterwards and judge it.
"""

from __future__ import annotations

from types import SimpleNamespace

import coil_pairs
import designs
import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates.windings.methods import WindingGeometry
from sitscad.estimates.windings.neighbours import mutual_error, winding_pair_inductance
from sitscad.kernels.geometry.path import Point

REFERENCES = coil_pairs.read()
JUDGES = 51
"""Number of the first pair that the bound was not chosen on."""


def compared(rows):
    """(error, bound, reference), all in henries, of some lines of the file."""
    result = []
    for row in rows:
        two = coil_pairs.pair(row["family"], int(row["number"]))
        placed = [
            (SimpleNamespace(centre=Point(*centre)), WindingGeometry(coil.spec, coil.spirals, coil.drawn))
            for coil, centre in ((two.first, (0.0, 0.0)), (two.second, two.centre))
        ]
        mutual, exact = winding_pair_inductance(*placed), float(row["mutual_inductance_H"])
        result.append((abs(mutual.inductance - exact), mutual_error(mutual, two.first.spec), abs(exact)))
    return result


def of_family(family, first=0):
    return [r for r in REFERENCES if r["family"] == family and int(r["number"]) >= first]


@pytest.mark.parametrize("family", designs.FAMILIES)
def test_mutual_inductance_bound_holds_on_held_out_pairs(family):
    rows = of_family(family, JUDGES)
    assert len(rows) >= 12
    for row, (error, bound, _) in zip(rows, compared(rows), strict=True):
        assert error <= bound, row["number"]


@pytest.mark.slow
@pytest.mark.parametrize("family", designs.FAMILIES)
def test_mutual_inductance_bound_holds_and_is_tight_on_all_pairs(family):
    """Half of the errors lie below 5e-6 of the mutual inductance, half of the bounds below 1e-4."""
    result = compared(of_family(family))
    assert all(error <= bound for error, bound, _ in result)
    assert np.median([error / exact for error, _, exact in result]) < 5e-6
    assert np.median([bound / exact for _, bound, exact in result]) < 1e-4


def test_reference_file_matches_generated_pairs():
    for row in REFERENCES:
        if int(row["number"]) < 3:
            two = coil_pairs.pair(row["family"], int(row["number"]))
            assert [f"{1e3 * x:.7g}" for x in two.centre] == [row["centre_x_mm"], row["centre_y_mm"]]
            assert f"{two.rotation:.7g}" == row["rotation_rad"]


def test_pair_references_are_accurate_to_1e_5():
    """Every fifth pair was integrated again with finer points: the column `error`."""
    again = [abs(float(row["error"])) for row in REFERENCES if row["error"]]
    assert len(again) >= 60 and np.median(again) < 1e-6 and max(again) < 1e-5


def test_pair_reference_is_reproduced():
    two = coil_pairs.pair("hexagon", 2)
    row = next(r for r in REFERENCES if (r["family"], r["number"]) == ("hexagon", "2"))
    result = coil_pairs.exact(two, coil_pairs.resolution(two))
    assert result == approx(float(row["mutual_inductance_H"]), rel=1e-9)
