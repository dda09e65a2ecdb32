"""Random targets at random poses over boards, held against the same surface resolved finer, at two levels.

    python tests/validation/random_poses.py [--targets 25] [--seed 1] [--only BOARD] [-o FILE.csv]

Three boards (`BOARDS`), every other target over a mirror, 20 poses a target: half of them near (0.15 to 0.7 mm at the
lowest point), half far (to 3 mm), for a target is solved as fine as its nearest pose asks. Writes a line a target, and
prints for every board the worst and the 95 % of: the error of a change of L (of the larger of it and 1 % of the free
inductance), that of a mutual one (of 1 %), that of the loss (of the larger of it and 1 % of the coil's resistance),
error over stated error, what the two finer levels differ by, and the share of poses that state 1 % or less.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import sitscad
from sitscad import Design
from sitscad.physics.constants import skin_depth
from sitscad.physics.eddy.target import turned

ROOT = Path(__file__).parents[2]
FIGURES = Path(__file__).with_name("random_poses.csv")
MM = 1e-3
FINER = 1.5, 2.0
BOARDS = "grasper_4layer", "three_axis_triangle", "square_bench"
GAPS = (0.15 * MM, 0.7 * MM), (0.7 * MM, 3.0 * MM)
EACH = 10
METALS = (("copper", 58e6), ("aluminium", 35.4e6), ("brass", 15.9e6))
COLUMNS = ("board", "mirror", "shape", "x_mm", "y_mm", "thickness_um", "metal", "skin_depths", "own", "mutual", "loss",
           "own_over_stated", "mutual_over_stated", "finer_levels", "stated_most", "stated_1_percent")  # fmt: skip


def boards() -> dict[str, sitscad.Layout]:
    """The layouts of the boards by name."""
    return {name: sitscad.lay_out(sitscad.load(ROOT / "templates" / f"{name}.yaml")) for name in BOARDS}


def targets(spec, generator) -> Iterator:
    """Targets without end: any shape, size against the coils, thickness and good conductor."""
    across = max(spec.coil.size)
    while True:
        name, conductivity = METALS[generator.integers(3)]
        size = across * generator.uniform(0.3, 2.5, 2)
        shape = ("square", "rectangle", "circle")[generator.integers(3)]
        sizes = (float(size[0]), float(size[1] if shape == "rectangle" else size[0]))
        thickness = float(np.exp(generator.uniform(math.log(9e-6), math.log(2e-3))))
        material = replace(spec.target.material, name=name, conductivity=conductivity)
        yield replace(spec.target, shape=shape, size=sizes, thickness=thickness, material=material, rotation=0.0)


def poses(spec, rest, count, generator, gaps=(0.15 * MM, 3.0 * MM)) -> np.ndarray:
    """Any place over, between and beside the coils, tilts to 15 degrees for half of them, gaps at the lowest point."""
    found = np.zeros((count, 6))
    reach = max(spec.coil.size)
    found[:, :2] = generator.uniform(-reach, reach, (count, 2))
    found[:, 3:5] = np.radians(generator.uniform(-15.0, 15.0, (count, 2))) * generator.integers(0, 2, (count, 1))
    found[:, 5] = generator.uniform(-0.3, 0.3, count)
    gap = np.exp(generator.uniform(math.log(gaps[0]), math.log(gaps[1]), count))
    down = np.abs(turned(found[:, 3:])[:, 2, :2]) * 0.5 * np.array(spec.target.size)
    found[:, 2] = gap - rest + (np.hypot(*down.T) if spec.target.shape == "circle" else down.sum(axis=1))
    return found


def changed(layout, target, mirror: bool) -> Design:
    """The board with that target, over a copper shield on a jaw or with nothing behind."""
    jaw = sitscad.load(ROOT / "templates" / "grasper_4layer.yaml")
    spec = replace(
        layout.spec, target=target, mount=jaw.mount if mirror else None, shield=jaw.shield if mirror else None
    )
    return Design(spec, replace(layout, spec=spec))


def compared(design: Design, some: np.ndarray) -> dict[str, np.ndarray]:
    """Errors at poses (n), by the names of the columns: the worst over the coils, or over their pairs."""
    model = design.response
    usual, *finer = (replace(model, finer=f, solved={}).respond(some) for f in (1.0, *FINER))
    scale = 0.01 * model.wound.winding.inductance
    truth = finer[1].target_change
    size = np.maximum(np.abs(truth), scale)
    own = np.eye(truth.shape[1], dtype=bool)
    apart = np.abs(usual.target_change - truth)
    over = apart / size / usual.target_change_error
    lost = np.maximum(finer[1].target_resistance, 0.01 * finer[1].resistance)
    return {
        "own": (apart / size)[:, own].max(axis=1),
        "mutual": np.max((apart / scale)[:, ~own], axis=1, initial=0.0),
        "loss": (np.abs(usual.target_resistance - finer[1].target_resistance) / lost).max(axis=1),
        "own_over_stated": over[:, own].max(axis=1),
        "mutual_over_stated": np.max(over[:, ~own], axis=1, initial=0.0),
        "finer_levels": (np.abs(finer[0].target_change - truth) / size).max(axis=(1, 2)),
        "stated_most": usual.target_change_error[:, own].max(axis=1),
    }


def of_target(design: Design, generator) -> dict[str, np.ndarray]:
    """Errors at near and far poses."""
    rest = float(design.response.rest[2])
    parts = [compared(design, poses(design.spec, rest, EACH, generator, gaps)) for gaps in GAPS]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def depths(design: Design) -> float:
    """Thickness of the target in skin depths at the middle of the tanks' frequencies."""
    target = design.spec.target
    return target.thickness / skin_depth(math.sqrt(math.prod(design.response.band)), target.material.conductivity)


def line(board: str, mirror: bool, design: Design, found: dict[str, np.ndarray]) -> list[str]:
    """A target's line of the file."""
    target = design.spec.target
    x, y = (f"{1e3 * length:.2f}" for length in target.size)
    what = [board, str(int(mirror)), target.shape, x, y, f"{1e6 * target.thickness:.1f}", target.material.name]
    few = float((found["stated_most"] <= 0.01).mean())
    return [*what, f"{depths(design):.1f}", *(f"{values.max():.2g}" for values in found.values()), f"{few:.2f}"]


def said(name: str, found: Sequence[dict[str, np.ndarray]]) -> None:
    """Prints worst and 95 % of every figure over poses."""
    if not found:
        return
    whole = {key: np.concatenate([one[key] for one in found]) for key in found[0]}
    figures = "  ".join(f"{key} {v.max():.4f} {np.quantile(v, 0.95):.4f}" for key, v in whole.items())
    few = float((whole["stated_most"] <= 0.01).mean())
    print(f"{name}, {whole['own'].size} poses: {figures}  states 1 % or less: {100.0 * few:.1f} %", flush=True)


def main(count: int, seed: int, only: str, output: Path) -> None:
    lines, everywhere, started = [], [], time.process_time()
    for board, layout in boards().items():
        if only not in board:
            continue
        generator, found = np.random.default_rng(seed), []
        for number, target in zip(range(count), targets(layout.spec, generator), strict=False):
            design = changed(layout, target, mirror=number % 2 == 1)
            found.append((depths(design), of_target(design, generator)))
            lines.append(line(board, number % 2 == 1, design, found[-1][1]))
            print("  ".join(lines[-1]), flush=True)
        everywhere += found
        said(board, [errors for _, errors in found])
        said(f"{board}, four skin depths and more", [errors for thick, errors in found if thick >= 4.0])
    said("all", [errors for _, errors in everywhere])
    said("all, four skin depths and more", [errors for thick, errors in everywhere if thick >= 4.0])
    with output.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *lines])
    print(f"{time.process_time() - started:.0f} s of processor time")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--targets", type=int, default=25, help="targets a board")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="boards whose name has this in it")
    parser.add_argument("-o", dest="output", type=Path, default=FIGURES)
    given = parser.parse_args()
    main(given.targets, given.seed, given.only, given.output)
