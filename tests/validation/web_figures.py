"""Prints lines of web_figures.csv: what one web adds to a pad's stiffness, in linear finite elements (CalculiX).

    python tests/validation/web_figures.py ALONG,ACROSS,RIM,GAP,WEB ...

Lengths in thicknesses: the pad's sides, by how much it reaches beyond its target, from pad to pad, the web's width.
The web is at the pad's side +x; the other pad's target is free. A few seconds each. Held against the law by
tests/mechanics/test_web_law.py.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from bricks import Bricks

SHEAR, POISSON, PLATE = 60e3, 0.4995, 0.2
METAL = (117e9, 0.3)
COLUMNS = ("along", "across", "rim", "gap", "web", "press", "shear", "side_shear", "tilt", "side_tilt", "twist",
           "aside")
"""What the web adds, in parts of the bare pad's: press, shear along x and y, tilt that raises the ends of x and of y,
twist; and how far the centre of pressure moves along x, in thicknesses."""


def fine(length: float, count: int) -> np.ndarray:
    """Lines that are closer at both ends."""
    return length * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count + 1)))


def pair(along: float, across: float, rim: float, gap: float, web: float, is_joined: bool) -> Bricks:
    """Half of both pads and the web, which lies in the plane of symmetry; without it the pad alone."""
    inner = [fine(rim, 3) - along, fine(along - 2.0 * rim, 12) + rim - along, fine(rim, 3) - rim]
    x = inner if not is_joined else [*inner, fine(gap, max(4, round(4.0 * gap))), *(one + gap + along for one in inner)]
    half = 0.5 * across - rim
    beside = 0.5 * web + (half - 0.5 * web) * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 7))
    y = np.concatenate([np.linspace(0.0, 0.5 * web, 3), beside, half + fine(rim, 3)])
    z = np.append(np.linspace(0.0, 1.0, 5), 1.0 + PLATE)

    def kind(x: float, y: float, z: float) -> str:
        if z < 1.0:
            return "PAD" if not 0.0 < x < gap or y < 0.5 * web else ""
        if y > half or rim - along > x or -rim < x < gap + rim or x > gap + along - rim:
            return ""
        return "NEAR" if x < 0.0 else "FAR"

    return Bricks([np.unique(one.round(9)) for one in (np.concatenate(x), y, z)], kind)


def moved(folder: Path, model: Bricks, move, is_even: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacements (n, 3), and force and moment (about the middle of its near face) that hold the half of the target
    whose places (n, 3), from that middle, `move` as it says: alike on both sides of y = 0, or opposite.
    """
    near, places = model.of("NEAR"), model.places
    middle = np.array([0.5 * (places[near, 0].min() + places[near, 0].max()), 0.0, 1.0])
    held = [(places[:, 2] < 1e-12, axis, 0.0) for axis in range(3)]
    held += [((places[:, 1] < 1e-12) & ~near, axis, 0.0) for axis in ((1,) if is_even else (0, 2))]
    arms, nodes = places[near] - middle, np.flatnonzero(near)
    for node, way in zip(nodes, move(arms), strict=True):
        item = np.arange(len(places)) == node
        held += [(item, axis, float(way[axis])) for axis in range(3)]
    rubber = (2.0 * SHEAR * (1.0 + POISSON), POISSON)
    materials = {"PAD": rubber, "NEAR": METAL} | ({"FAR": METAL} if model.of("FAR").any() else {})
    result, forces = model.solved(folder, materials, held)
    return result, forces[near].sum(axis=0), np.cross(arms, forces[near]).sum(axis=0)


def turned(axis: int):
    """The motion of places (n, 3) by a small turn about an axis."""
    return lambda arms: np.cross(1e-4 * np.eye(3)[axis], arms)


def shifted(axis: int):
    """The motion of places (n, 3) by a small step along an axis."""
    return lambda arms: np.tile(1e-4 * np.eye(3)[axis], (len(arms), 1))


def added(along: float, across: float, rim: float, gap: float, web: float) -> list[float]:
    """The figures of one line."""
    bare, joined = (pair(along, across, rim, gap, web, is_joined) for is_joined in (False, True))
    result = []
    with tempfile.TemporaryDirectory() as name:
        for move, axis, is_even in ((shifted, 2, True), (shifted, 0, True), (shifted, 1, False), (turned, 1, True),
                                    (turned, 0, False), (turned, 2, False)):
            item, other = (moved(Path(name), model, move(axis), is_even)[1:] for model in (bare, joined))
            which = int(move is turned)
            result.append(other[which][axis] / item[which][axis] - 1.0)
            if not result[1:]:
                aside = -other[1][1] / other[0][2]
    return [*result, aside]


def main() -> None:
    """A line for each pad."""
    for text in sys.argv[1:]:
        measures = [float(each) for each in text.split(",")]
        print(",".join([*(f"{one:g}" for one in measures), *(f"{one:.3g}" for one in added(*measures))]), flush=True)


if __name__ == "__main__":
    main()
