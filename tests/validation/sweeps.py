"""Sweeps of the response in 500 steps: displacement, tilt, the target's size and thickness, the shield's gap.

    python tests/validation/sweeps.py [--steps 500] [--only dx,dz,ry,size,thickness,shield] [--span 1.0]

Of every step of a coil's inductance the second difference is held against what its neighbours make expected: a jump is
a step that differs from the mean of the two beside it by more than the stated error lets it. Prints for each sweep the
largest second difference over the change of the target, and over the stated error. Poses are asked for all at once (so
they are interpolated), sizes one design after the other: 1.2 CPU seconds a step.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import sitscad
from sitscad import Design, respond

TEMPLATE = Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml"
POSES = {"dx": (0, -1e-3, 1e-3), "dz": (2, -0.2e-3, 1.5e-3), "ry": (4, -0.08, 0.08)}
"""Number of a pose, and between what it is swept (m, rad)."""

DESIGNS = {"size": ("target.size", 3.0, 6.0), "thickness": ("target.thickness", 0.02, 1.0),
           "shield": ("shield.gap", 0.1, 0.49)}
"""Key of the spec, and between what it is swept (mm)."""


def by_pose(design: Design, name: str, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """The target's change of every coil (steps, coils) over the free inductance, and its stated error likewise."""
    column, low, high = POSES[name]
    poses = np.zeros((steps, 6))
    poses[:, column] = np.linspace(low, high, steps)
    return _told(design, respond(design, poses))


def by_design(name: str, steps: int, span: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """The same of designs, one after the other; `span` is the share of the range that is swept, from its middle."""
    key, low, high = DESIGNS[name]
    spec, middle, half = sitscad.load(TEMPLATE), 0.5 * (low + high), 0.5 * span * (high - low)
    parts = [_told(design, respond(design, np.zeros((1, 6)))) for design in _designs(spec, key, middle, half, steps)]
    change, error = (np.concatenate(part) for part in zip(*parts, strict=True))
    return change, error


def _designs(spec: sitscad.SensorSpec, key: str, middle: float, half: float, steps: int) -> Iterator[Design]:
    for value in np.linspace(middle - half, middle + half, steps):
        yield Design(spec.replace(key, 1e-3 * float(value)))


def _told(design: Design, found: sitscad.Response) -> tuple[np.ndarray, np.ndarray]:
    free = design.estimates.coils[0].winding_inductance
    change = np.einsum("pcc->pc", found.target_change) / free
    size = np.maximum(np.abs(change), 0.01)
    return change, np.einsum("pcc->pc", found.target_change_error) * size


def jumps(change: np.ndarray, error: np.ndarray) -> tuple[float, float]:
    """The largest second difference over the largest change, and over the stated error there."""
    second = np.abs(np.diff(change, n=2, axis=0))
    return float(second.max() / np.abs(change).max()), float((second / error[1:-1]).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--only", default=",".join((*POSES, *DESIGNS)))
    parser.add_argument("--span", type=float, default=1.0)
    asked = parser.parse_args()
    design = Design(sitscad.load(TEMPLATE))
    for name in asked.only.split(","):
        began = time.process_time()
        sweep = by_pose(design, name, asked.steps) if name in POSES else by_design(name, asked.steps, asked.span)
        of_change, of_error = jumps(*sweep)
        print(f"{name}: {asked.steps} steps, second difference {of_change:.2e} of the change, {of_error:.3f} of "
              f"the stated error, {time.process_time() - began:.0f} CPU s", flush=True)


if __name__ == "__main__":
    main()
