"""Prints lines of ogden_figures.csv: what the finite elements of `tests/oracles/pad_elements.py` say of pads of Ogden's
rubber of one term, of modulus 1 and thickness 1, at the poses of pad_figures.py and a pull.

    python tests/validation/ogden_figures.py ALONG,ACROSS [--round] [--rim R] [--skin T] [--skin-modulus M]
        [--degree 3] [--exponents 2,3.05] [--skin-exponent A] [--few]

Some 5 to 60 CPU seconds an exponent. What is looked at is the ratio to exponent 2, which converges faster than forces.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))

from pad_elements import GluedPlate, HalfPad, fanned
from pad_figures import POSES, TILT

WHAT = ("exponent", "skin_exponent")
FEW = ((0, -0.1, 0), (0, -0.2, 0), (0, -0.3, 0), (0, -0.35, 0), (0.4, -0.2, 0), (0.4, -0.2, TILT), (0.5, 0, 0))
FILMED = ((0, -0.1, 0), (0, -0.2, 0), (0, -0.3, 0), (0.25, -0.2, 0), (0.25, -0.1, -TILT), (0.4, 0, 0))
"""Poses that tell most, for pads that take long, and those in films."""


def main() -> None:
    """One pad of every exponent, at all poses that its elements reach, a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("widths")
    parser.add_argument("--round", action="store_true")
    for name, default in (("--rim", 0.0), ("--skin", 0.0), ("--skin-modulus", 1.0), ("--skin-exponent", 2.0)):
        parser.add_argument(name, type=float, default=default)
    parser.add_argument("--few", action="store_true")
    parser.add_argument("--degree", type=int, default=3)
    parser.add_argument("--exponents", default="2,3.05")
    request = parser.parse_args()
    along, across = (float(width) for width in request.widths.split(","))
    solid = GluedPlate(along, across, 1.0, request.round, request.rim, request.skin)
    given = (along, across, int(request.round), request.rim, request.skin, request.skin_modulus, request.degree)
    lines = csv.writer(sys.stdout, lineterminator="\n")
    for exponent in map(float, request.exponents.split(",")):
        pad = HalfPad(solid, 2, skin=request.skin_modulus, order=request.degree, mesh=fanned(solid, 2, 1),
                      exponents=(exponent, request.skin_exponent))
        for pose in FILMED if request.skin else FEW if request.few else (*POSES, (0, 0.1, 0)):
            try:
                held = pad.move(pose)
            except ArithmeticError as reason:
                print(reason, file=sys.stderr)
                continue
            k = held.stiffness
            result = (held.force_x, held.force_z, held.moment_y, k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2], k[2, 2])
            lines.writerow([exponent, request.skin_exponent, *given, *(f"{v:.6g}" for v in pose),
                            *(f"{v:.5g}" if abs(v) > 1e-9 else "0" for v in result)])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
