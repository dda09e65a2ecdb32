"""Prints lines of pad_figures.csv: forces on a neo-Hookean pad of modulus 1 and thickness 1, by the finite elements of
`tests/oracles/pad_elements.py`.

    python tests/validation/pad_figures.py WIDTHS [--round] [--rim R] [--skin T] [--skin-modulus M] [--degree D]

WIDTHS is `along,across` in thicknesses. Degree 4 is converged within 1 %, degree 3 within 2 % (faces up to four
thicknesses, strain up to 30 %; 4 % of a flatter one); a minute to a quarter of an hour each. Held against the law by
tests/mechanics/test_pad.py.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))

from pad_elements import GluedPlate, HalfPad, fanned

TILT = math.radians(5.0)
POSES = ((0, 0, 0), (0, -0.1, 0), (0, -0.2, 0), (0, -0.3, 0), (0, -0.35, 0), (0.25, -0.3, 0), (0.4, -0.2, 0),
         (0.4, -0.2, TILT), (0.25, -0.1, -TILT), (0.25, 0, 0), (0.5, 0, 0))
COLUMNS = ("along", "across", "round", "rim", "skin", "skin_modulus", "degree", "x", "z", "ry", "force_x", "force_z",
           "moment_y", "k_xx", "k_xz", "k_xr", "k_zz", "k_zr", "k_rr")


def main() -> None:
    """One pad at all poses that its elements reach, a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("widths")
    parser.add_argument("--round", action="store_true")
    for name, default in (("--rim", 0.0), ("--skin", 0.0), ("--skin-modulus", 1.0)):
        parser.add_argument(name, type=float, default=default)
    parser.add_argument("--degree", type=int, default=4)
    request = parser.parse_args()
    along, across = (float(width) for width in request.widths.split(","))
    solid = GluedPlate(along, across, 1.0, request.round, request.rim, request.skin)
    pad = HalfPad(solid, 2, skin=request.skin_modulus, order=request.degree, mesh=fanned(solid, 2, 1))
    given = (along, across, int(request.round), request.rim, request.skin, request.skin_modulus, request.degree)
    lines = csv.writer(sys.stdout, lineterminator="\n")
    for pose in POSES:
        try:
            held = pad.move(pose)
        except ArithmeticError as reason:
            print(reason, file=sys.stderr)
            continue
        k = held.stiffness
        result = (held.force_x, held.force_z, held.moment_y, k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2], k[2, 2])
        lines.writerow([*given, *(f"{v:.6g}" for v in pose), *(f"{v:.5g}" if abs(v) > 1e-9 else "0" for v in result)])


if __name__ == "__main__":
    main()
