"""Draws docs/pad-curves.svg: the pad's law as lines, the finite elements of pad_figures.csv as marks.

    python tests/validation/draw_pads.py

Pressed blocks, pressed blocks in films, blocks sheared under a press, and of all load cases the share that the law is
off by no more than so much. Stresses are forces over the loaded face, in shear moduli of the pad; lengths are in
thicknesses.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import numpy as np

from sitscad.kernels.mechanics.elastomer import Face, Surround
from sitscad.kernels.mechanics.pad import BondedPad

FIGURES = Path(__file__).with_name("pad_figures.csv")
PICTURE = Path(__file__).parents[2] / "docs" / "pad-curves.svg"
MEASURES = ("along", "across", "round", "rim", "skin", "skin_modulus")
BULK = 1e4
"""Bulk modulus in shear moduli, as the finite elements had it."""

BLOCKS = ((1.4, 1.4), (2.0, 2.0), (3.0, 3.0), (4.0, 4.0), (6.0, 6.0))
FILMS = ((0.0, 1.0), (0.1, 3.0), (0.1, 10.0), (0.1, 28.0))
SHEARED = ((0.0, "o"), (-0.2, "s"), (-0.3, "^"))
COLOURS = ("#0b5fa5", "#b5541c", "#2c7a3f", "#7a3f9a", "#555555")

Row = dict[str, float]


def pads() -> Iterator[tuple[BondedPad, list[Row]]]:
    """Every pad of the file with its load cases; of two degrees the finer."""
    with FIGURES.open(encoding="utf-8") as lines:
        rows = [{name: float(value) for name, value in row.items()}
                for row in csv.DictReader(line for line in lines if not line.startswith("#"))]
    by_pad = sorted(rows, key=lambda row: tuple(row[name] for name in MEASURES))
    for measures, of_pad in groupby(by_pad, key=lambda row: tuple(row[name] for name in MEASURES)):
        along, across, is_round, rim, skin, modulus = measures
        finest: dict[tuple[float, ...], Row] = {}
        for row in sorted(of_pad, key=lambda row: row["degree"]):
            finest[row["x"], row["z"], row["ry"]] = row
        yield (
            BondedPad(Face(along, across, bool(is_round)), 1.0, 1.0, BULK,
                      Surround(rim, skin, modulus if skin else 0.0)),
            list(finest.values()),
        )


def forces(pad: BondedPad, x: np.ndarray, z: np.ndarray, ry: np.ndarray) -> np.ndarray:
    """Stresses of the law at poses: along x and z, in shear moduli."""
    none = np.zeros_like(x)
    return np.asarray(pad.force(np.column_stack([x, none, z, none, ry, none]))[:, [0, 2]] / pad.face.area)


def off(pad: BondedPad, rows: list[Row]) -> np.ndarray:
    """What the law is off by, over the force, at every load case that has one."""
    x, z, ry, fx, fz = (np.array([row[name] for row in rows]) for name in ("x", "z", "ry", "force_x", "force_z"))
    given = np.column_stack([fx, fz]) / pad.face.area
    size = np.hypot(*given.T)
    return np.asarray((np.hypot(*(forces(pad, x, z, ry) - given).T) / np.maximum(size, 1e-300))[size > 0.0])


def _is(pad: BondedPad, face: tuple[float, float], skin: float = 0.0, modulus: float = 1.0) -> bool:
    same = (pad.face.width_x, pad.face.width_y) == face and not pad.face.round and not pad.surround.rim
    return same and pad.surround.film == skin and (not skin or pad.surround.film_modulus == modulus)


def draw() -> None:
    """The picture: four panels."""
    os.environ["SOURCE_DATE_EPOCH"] = "0"
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {"svg.hashsalt": "sitscad", "svg.fonttype": "path", "font.size": 9}
    import matplotlib.pyplot as plt

    known = list(pads())
    figure, ((pressed, filmed), (sheared, whole)) = plt.subplots(2, 2, figsize=(9.0, 7.0))
    for colour, face in zip(COLOURS, BLOCKS, strict=True):
        _pressed(pressed, colour, f"{face[0]:g} thicknesses wide", next(p for p in known if _is(p[0], face)))
    pressed.set(yscale="log", ylim=(0.1, 30.0), title="Square blocks, pressed")
    for colour, (skin, modulus) in zip(COLOURS, FILMS, strict=False):
        words = "bare" if not skin else f"film of {skin:g}, {modulus:g} times as stiff"
        _pressed(filmed, colour, words, next(p for p in known if _is(p[0], (2.0, 2.0), skin, modulus)))
    filmed.set(title="Block 2 thicknesses wide, in a film, pressed")
    for axes in (pressed, filmed):
        axes.set(xlabel="strain (%)", ylabel="stress (shear moduli)")
    for colour, face in zip(COLOURS[1:3], BLOCKS[1:3], strict=True):
        _sheared(sheared, colour, face, next(p for p in known if _is(p[0], face)))
    sheared.set(xlabel="shear (% of the thickness)", ylabel="shear stress (shear moduli)",
                title="Blocks sheared, not pressed and by 20 and 30 %")
    count = 0
    for colour, (words, kind) in zip(COLOURS, KINDS.items(), strict=False):
        errors = np.sort(np.concatenate([off(pad, rows) for pad, rows in known if kind(pad)]))
        count += len(errors)
        shares = 100.0 * np.arange(1, len(errors) + 1) / len(errors)
        whole.plot(100.0 * errors, shares, color=colour, label=f"{words}: {len(errors)} cases")
    whole.set(xlabel="error of the force (%), less than", ylabel="of load cases (%)", xlim=(0.0, 18.0),
              title=f"All {count} load cases, sheared and tilted ones too")
    for axes in (pressed, filmed, sheared, whole):
        axes.grid(True, linewidth=0.3)
        axes.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(PICTURE, metadata={"Date": None, "Creator": None})
    print(f"{count} load cases of {len(known)} pads drawn")


KINDS = {
    "bare": lambda pad: not pad.surround.film and not pad.surround.rim,
    "smaller target than pad": lambda pad: bool(pad.surround.rim),
    "in a film": lambda pad: bool(pad.surround.film),
}


def _pressed(axes, colour: str, words: str, known: tuple[BondedPad, list[Row]]) -> None:
    pad, rows = known
    strain = np.linspace(0.005, 0.35, 70)
    axes.plot(100.0 * strain, -forces(pad, 0.0 * strain, -strain, 0.0 * strain)[:, 1], color=colour, label=words)
    marks = [row for row in rows if not row["x"] and not row["ry"] and row["z"]]
    axes.plot([-100.0 * row["z"] for row in marks], [-row["force_z"] / pad.face.area for row in marks], "o",
              color=colour, markersize=4)


def _sheared(axes, colour: str, face: tuple[float, float], known: tuple[BondedPad, list[Row]]) -> None:
    pad, rows = known
    shear = np.linspace(0.0, 0.5, 60)
    for z, mark in SHEARED:
        marks = [row for row in rows if row["z"] == z and row["x"] and not row["ry"]]
        axes.plot(100.0 * shear, forces(pad, shear, np.full_like(shear, z), 0.0 * shear)[:, 0], color=colour,
                  linewidth=1.5 + 2.0 * z, label=f"{face[0]:g} wide, pressed by {abs(100.0 * z):.0f} %")
        axes.plot([100.0 * row["x"] for row in marks], [row["force_x"] / pad.face.area for row in marks], mark,
                  color=colour, markersize=5)


if __name__ == "__main__":
    draw()
