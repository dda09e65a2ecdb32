"""Random targets at random poses over a board, held against the same surface resolved finer: error over stated error.

    python tests/validation/random_poses.py SPEC [POSES] [SEED]

Prints, for every target, the largest error of a change of L (own and mutual), of the larger of it and 1 % of the
free inductance, what is stated, the largest error of the loss, and how far two finer levels still differ.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

import numpy as np

import sitscad
from sitscad import Design

MM = 1e-3
FINER = 1.5, 2.0


def targets(spec, generator):
    """Targets without end: any shape, size against the coils, thickness and good conductor."""
    metals = [(name, value) for name, value in (("copper", 58e6), ("aluminium", 35.4e6), ("brass", 15.9e6))]
    across = max(spec.coil.size)
    while True:
        name, conductivity = metals[generator.integers(3)]
        size = across * generator.uniform(0.3, 2.5, 2)
        shape = ("square", "rectangle", "circle")[generator.integers(3)]
        sizes = (float(size[0]), float(size[1] if shape == "rectangle" else size[0]))
        thickness = float(np.exp(generator.uniform(math.log(9e-6), math.log(2e-3))))
        material = replace(spec.target.material, name=name, conductivity=conductivity)
        yield replace(spec.target, shape=shape, size=sizes, thickness=thickness, material=material, rotation=0.0)


def poses(spec, rest, count, generator):
    """Any place over, between and beside the coils, tilts to 15 degrees, gaps of 0.15 to 3 mm at the lowest point."""
    found = np.zeros((count, 6))
    reach = max(spec.coil.size)
    found[:, :2] = generator.uniform(-reach, reach, (count, 2))
    found[:, 3:5] = np.radians(generator.uniform(-15.0, 15.0, (count, 2))) * generator.integers(0, 2, (count, 1))
    found[:, 5] = generator.uniform(-0.3, 0.3, count)
    gap = np.exp(generator.uniform(math.log(0.15 * MM), math.log(3.0 * MM), count))
    half = 0.5 * np.hypot(*spec.target.size)
    found[:, 2] = gap - rest + half * np.abs(np.sin(found[:, 3:5])).max(axis=1)
    return found


def compared(design: Design, some: np.ndarray) -> tuple[float, float, float, float]:
    """Largest error over the stated one, the errors of L and of the loss, and what the two finer levels differ by."""
    model = design.response
    usual, *finer = (replace(model, finer=f, solved={}).respond(some, frequency=5e6) for f in (1.0, *FINER))
    scale = 0.01 * model.wound.winding.inductance
    truth = finer[1].target_change
    size = np.maximum(np.abs(truth), scale)
    error = np.abs(usual.target_change - truth) / size
    lost = finer[1].target_resistance
    floor = np.maximum(lost, 1e-3 * np.abs(lost).max() + 2.0 * math.pi * 5e6 * 1e-5 * scale)
    return (
        float((error / usual.target_change_error).max()),
        float(error.max()),
        float((np.abs(usual.target_resistance - lost) / floor).max()),
        float((np.abs(finer[0].target_change - truth) / size).max()),
    )


def main(path: str, count: str = "60", seed: str = "1") -> None:
    spec, generator = sitscad.load(path), np.random.default_rng(int(seed))
    layout = sitscad.lay_out(spec)
    started, done = time.process_time(), 0
    print("shape      size (mm)     t (um)  metal      over stated   L        R        finer")
    for target in targets(spec, generator):
        if done >= int(count):
            break
        changed = replace(spec, target=target)
        design = Design(changed, replace(layout, spec=changed))
        some = poses(changed, float(design.response.rest[2]), 12, generator)
        over, error, lost, left = compared(design, some)
        x, y = (1e3 * length for length in target.size)
        print(
            f"{target.shape:<10} {x:5.2f} x {y:5.2f} {1e6 * target.thickness:8.1f}  {target.material.name:<10} "
            f"{over:8.2f}   {error:.5f}  {lost:.5f}  {left:.5f}",
            flush=True,
        )
        done += len(some)
    print(f"{done} poses, {time.process_time() - started:.0f} s of processor time")


if __name__ == "__main__":
    main(*sys.argv[1:])
