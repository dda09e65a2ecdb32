"""Prints lines of ogden_figures.csv: the normal force on a level plate over a pad of Ogden's rubber of one term, by the
finite elements of `sitscad.mechanics.elements`, of modulus 1 and thickness 1.

    python tests/validation/ogden_figures.py ALONG,ACROSS [--round] [--degree 3] [--exponents 2,3.05]

Some 5 to 15 CPU seconds an exponent. What is looked at is the ratio to exponent 2, which converges faster than forces.
"""

from __future__ import annotations

import argparse

from sitscad.mechanics.elements.mesh import Solid, fanned
from sitscad.mechanics.elements.pad import Pad

HEIGHTS = (-0.1, -0.2, -0.3, -0.35)


def main() -> None:
    """One pad of every exponent, at all heights that its elements reach."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("widths")
    parser.add_argument("--round", action="store_true")
    parser.add_argument("--degree", type=int, default=3)
    parser.add_argument("--exponents", default="2,3.05")
    asked = parser.parse_args()
    along, across = (float(width) for width in asked.widths.split(","))
    solid = Solid(along, across, 1.0, asked.round)
    for exponent in map(float, asked.exponents.split(",")):
        pad = Pad(solid, 2, order=asked.degree, mesh=fanned(solid, 2, 1), exponent=exponent)
        for z in HEIGHTS:
            try:
                force = pad.move((0.0, z, 0.0)).force_z
            except ArithmeticError:
                break
            print(along, across, int(asked.round), asked.degree, exponent, z, f"{force:.5g}", sep=",", flush=True)


if __name__ == "__main__":
    main()
