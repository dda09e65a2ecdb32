"""Random targets at random poses over boards, held against the same surface resolved finer, at two levels.

    python tests/validation/random_poses.py [--minutes 15] [--targets 25] [--only BOARD] [--told]

Three boards (`BOARDS`), every other target over a mirror, 20 poses a target: half of them near (0.15 to 0.7 mm at the
lowest point), half far (to 3 mm), for a target is solved as fine as its nearest pose asks. It runs in parts: targets
that are in `random_poses.csv` are not solved again, every new one is added to it at once (a line a pose), and none is
begun after so many minutes of the processor. Then the table of docs/accuracy.md is made of the file: errors of a change
of L (of the larger of it and 1 % of the free inductance), of a mutual one (of 1 %), of the loss (of the larger of it
and 1 % of the coil's resistance), error over stated error, what the two finer levels differ by, and the share of poses
that state 1 % or less. `--told` makes the table alone.
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
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.eddy.target import rotation_matrices

ROOT = Path(__file__).parents[2]
FIGURES = Path(__file__).with_name("random_poses.csv")
MM = 1e-3
FINER = 1.5, 2.0
BOARDS = "grasper_4layer", "three_axis_triangle", "square_bench"
GAPS = (0.15 * MM, 0.7 * MM), (0.7 * MM, 3.0 * MM)
EACH = 10
METALS = (("copper", 58e6), ("aluminium", 35.4e6), ("brass", 15.9e6))
SEED = 11
PLACES = "near", "far"
WHAT = ("board", "target", "mirror", "shape", "x_mm", "y_mm", "thickness_um", "metal", "skin_depths", "place")
FOUND = ("own", "mutual", "loss", "own_over_stated", "mutual_over_stated", "finer_levels", "stated")
"""Columns of the file: what was looked at, and what was found at each pose."""

PAGE, BLOCK = ROOT / "docs" / "accuracy.md", "random_poses.csv"
HEAD = ("board", "behind the board", "poses", "change of L, worst (95 %)", "mutual", "loss", "worst of stated",
        "difference of references", "states at most 1 %")


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
    result = np.zeros((count, 6))
    reach = max(spec.coil.size)
    result[:, :2] = generator.uniform(-reach, reach, (count, 2))
    result[:, 3:5] = np.radians(generator.uniform(-15.0, 15.0, (count, 2))) * generator.integers(0, 2, (count, 1))
    result[:, 5] = generator.uniform(-0.3, 0.3, count)
    gap = np.exp(generator.uniform(math.log(gaps[0]), math.log(gaps[1]), count))
    down = np.abs(rotation_matrices(result[:, 3:])[:, 2, :2]) * 0.5 * np.array(spec.target.size)
    result[:, 2] = gap - rest + (np.hypot(*down.T) if spec.target.shape == "circle" else down.sum(axis=1))
    return result


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
    scale = 0.01 * model.windings.winding.inductance
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
        "stated": usual.target_change_error[:, own].max(axis=1),
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


def lines(board: str, number: int, design: Design, found: dict[str, np.ndarray]) -> Iterator[list[str]]:
    """A target's lines of the file, one a pose."""
    target = design.spec.target
    x, y = (f"{1e3 * length:.2f}" for length in target.size)
    what = [board, str(number), str(int(mirrored(number))), target.shape, x, y, f"{1e6 * target.thickness:.1f}",
            target.material.name, f"{depths(design):.1f}"]
    for k in range(len(PLACES) * EACH):
        yield [*what, PLACES[k // EACH], *(f"{found[name][k]:.2g}" for name in FOUND)]


def mirrored(number: int) -> bool:
    """Whether a mirror lies behind the board of a target."""
    return number % 2 == 1


def known() -> list[dict[str, str]]:
    """The lines of the file so far."""
    if not FIGURES.exists():
        return []
    with FIGURES.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(rows: Sequence[dict[str, str]]) -> list[tuple[str, ...]]:
    """Worst and 95 % of the figures: a row a board, with a mirror and without, then all."""
    parts = [((board, mirror), [row for row in rows if (row["board"], row["mirror"]) == (board, mirror)])
             for board in BOARDS for mirror in "01"]
    thick = [row for row in rows if float(row["skin_depths"]) >= 4.0]
    named = [((f"`{board}`", ("nothing", "mirror")[int(mirror)]), part) for (board, mirror), part in parts if part]
    named += [(("all", "both"), rows), (("targets of four skin depths and more", "both"), thick)]
    return [(*what, *_figures(part)) for what, part in named]


def _figures(rows: Sequence[dict[str, str]]) -> list[str]:
    found = {name: np.array([float(row[name]) for row in rows]) for name in FOUND}
    errors = [f"{100 * found[name].max():.2g} ({100 * np.quantile(found[name], 0.95):.2g}) %"
              for name in ("own", "mutual", "loss")]
    over = max(found["own_over_stated"].max(), found["mutual_over_stated"].max())
    few = float((found["stated"] <= 0.01).mean())
    return [str(len(rows)), *errors, f"{over:.2f}", f"{100 * found['finer_levels'].max():.2g} %", f"{100 * few:.0f} %"]


def tell() -> None:
    """Writes the table of the file into the page."""
    rows = [HEAD, ("---",) * len(HEAD), *table(known())]
    block = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    begins, ends = (f"<!-- {BLOCK} {which} -->\n" for which in ("begins", "ends"))
    before, rest = PAGE.read_text(encoding="utf-8").split(begins)
    PAGE.write_text(before + begins + block + ends + rest.split(ends)[1], encoding="utf-8")
    print(block)


def main(count: int, minutes: float, only: str) -> None:
    started, layouts = time.process_time(), boards()
    done = {(row["board"], int(row["target"])) for row in known()}
    wanted = [(number, board) for number in range(count) for board in BOARDS if only in board]
    for number, board in wanted:
        if (board, number) in done:
            continue
        if time.process_time() - started > 60.0 * minutes:
            break
        generator, layout = np.random.default_rng((SEED, number)), layouts[board]
        design = changed(layout, next(targets(layout.spec, generator)), mirrored(number))
        result = list(lines(board, number, design, of_target(design, generator)))
        is_new = not FIGURES.exists()
        with FIGURES.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([WHAT + FOUND, *result] if is_new else result)
        print(f"{time.process_time() - started:6.0f} s", *result[0][:9], flush=True)
    tell()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--targets", type=int, default=25, help="targets a board")
    parser.add_argument("--minutes", type=float, default=15.0, help="of the processor, after which none is begun")
    parser.add_argument("--only", default="", help="boards whose name has this in it")
    parser.add_argument("--told", action="store_true", help="the table alone")
    given = parser.parse_args()
    tell() if given.told else main(given.targets, given.minutes, given.only)
