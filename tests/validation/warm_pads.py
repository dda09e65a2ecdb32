"""Prints lines of warm_pads.csv: how far a warm pad lifts its plate under a force, by finite elements of its rubber.

    python tests/validation/warm_pads.py WIDTHS [--round] [--exponent ALPHA]

WIDTHS is `along,across` in thicknesses. Forces are those that press the cold pad by each of `STRAINS`; they are divided
by modulus and area, and the lift by thickness and free expansion. Degree 3, two to ten minutes a pad. Held against
`BondedPad.expanded` by tests/mechanics/test_pad.py.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))

from pad_elements import GluedPlate, HalfPad, fanned

GROWTH, STRAINS = 0.004, np.linspace(0.0, 0.28, 8)


def main() -> None:
    """A line for each strain."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("widths")
    parser.add_argument("--round", action="store_true")
    parser.add_argument("--exponent", type=float, default=2.0)
    request = parser.parse_args()
    along, across = (float(width) for width in request.widths.split(","))
    solid = GluedPlate(along, across, 1.0, request.round)
    curves = []
    for growth in (0.0, GROWTH):
        pad = HalfPad(solid, 2, order=3, mesh=fanned(solid, 2, 1), exponents=2 * (request.exponent,), growth=growth)
        moved = [pad.move((0.0, -strain, 0.0)) for strain in STRAINS]
        curves.append([(held.force_z, held.stiffness[1, 1]) for held in moved])
    cold, warm = (np.array(curve) for curve in curves)
    force = CubicHermiteSpline(-STRAINS[::-1], *warm[::-1].T)
    area = along * across * (math.pi / 4.0 if request.round else 1.0)
    for strain, load in zip(STRAINS, cold[:, 0], strict=True):
        lift = brentq(lambda z, load=load: force(z) - load, -STRAINS[-1], 0.05) + strain
        print(along, across, int(request.round), request.exponent, f"{abs(load) / area:.4f}", f"{lift / GROWTH:.3f}",
              sep=",")


if __name__ == "__main__":
    main()
