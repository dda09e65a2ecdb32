"""Fits `sitscad/data/pad_films.csv` to the films of pad_figures.csv and, at the pad's own modulus, to wider bare pads.

python tests/validation/fit_films.py        writes the file anew
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sitscad.data import FOLDER
from sitscad.kernels.mechanics import pad_law, surround_law
from sitscad.kernels.mechanics.pad_law import Block
from sitscad.kernels.mechanics.surround_law import COURSES, MOST, QUICK, correction_terms, wall_stiffness

FIGURES = Path(__file__).with_name("pad_figures.csv")
PADS = ("along", "across", "round", "rim", "skin", "skin_modulus")
REST = ("1", "u", "v", "s", "uu", "vv", "ss", "uv", "us", "vs")
BY_STRAIN = (*REST, "uus", "uvs")
SKEW = {"press": ("oo", "r"), "shear": ("o", "r"), "tilt": ("o", "r")}
RIDGE = 1e-6
SOURCE = "tests/validation/fit_films.py, to finite elements (tests/oracles/pad_elements)"


class Sample(NamedTuple):
    """A film at a strain: what it adds to a stiffness and what the whole is, over the face's area."""

    block: Block
    strain: float
    added: float
    whole: float


def figures() -> Iterator[tuple[Block, list[dict[str, float]]]]:
    """The finite elements' films, a pad each."""
    with FIGURES.open(encoding="utf-8") as lines:
        rows = [{name: float(value) for name, value in row.items()}
                for row in csv.DictReader(line for line in lines if not line.startswith("#"))]
    for measures, of_pad in groupby(rows, key=lambda row: tuple(row[name] for name in PADS)):
        if measures[4]:
            yield Block(*measures), list(of_pad)


def samples(course: str) -> list[Sample]:
    """What is fitted: level poses of films, and films of the pad's own rubber as wider pads."""
    result = []
    for block, rows in figures():
        for row in rows:
            if not row["x"] and not row["ry"]:
                strain = -row["z"]
                whole = _stiffness(course, row) / block.area
                result.append(Sample(block, strain, whole - _bare(course, _without(block), strain), whole))
    for side in (1.4, 2.0, 3.0, 4.0, 6.0):
        for skin in (0.05, 0.1, 0.2, 0.4):
            block, wide = Block(side, side, 0.0, 0.0, skin, 1.0), Block(side + 2.0 * skin, side + 2.0 * skin)
            for strain in (0.0, 0.1, 0.2, 0.3):
                whole = _bare(course, wide, strain) * wide.area / block.area
                result.append(Sample(block, strain, whole - _bare(course, _without(block), strain), whole))
    return result


def _without(block: Block) -> Block:
    return Block(block.along, block.across, block.round)


def _stiffness(course: str, row: dict[str, float]) -> float:
    """Force over Lindley's strain, shear stiffness, or tilt stiffness in the frame turned by half of the tilt."""
    strain = -row["z"]
    if course == "press":
        return -row["force_z"] / float(pad_law._lindley_strain(strain)) if strain else row["k_zz"]
    if course == "shear":
        return row["k_xx"]
    left = 1.0 - strain
    return row["k_rr"] - row["k_xx"] * left**2 / 4.0 + row["force_z"] * left / 4.0


def _bare(course: str, block: Block, strain: float) -> float:
    if course == "press":
        small = max(strain, 1e-6)
        law = pad_law.compression(block)
        return law.at(small) / float(pad_law._lindley_strain(small)) if strain else law.at_rest
    law = pad_law.tilt_stiffness(block) if course == "tilt" else pad_law.shear_stiffness(block)[0]
    return float(law(np.array([strain]))[0])


def fitted(course: str) -> dict[str, list[float]]:
    """By term: the logarithm at rest, and the four parts of the course by strain, by least squares of the whole."""
    result = samples(course)
    names = (*REST, *SKEW[course])
    late = (*BY_STRAIN, *SKEW[course])
    rest = [item for item in result if not item.strain]
    rows = np.array([_parts(item, names) for item in rest])
    plain = np.array([_unit(course, item) for item in rest])
    added, whole = (np.array([getattr(item, name) for item in rest]) for name in ("added", "whole"))
    at_rest = _solved(rows, np.log(added / plain), added / whole)
    pressed = [item for item in result if item.strain]
    base = np.array([_unit(course, item) for item in pressed])
    base = base * np.exp([float(_parts(item, names) @ at_rest) for item in pressed])
    rows = np.array([np.outer(_basis(item.strain), _parts(item, late)).ravel() for item in pressed])
    added, whole = (np.array([getattr(item, name) for item in pressed]) for name in ("added", "whole"))
    by_strain = _solved(rows, added / base - 1.0, base / whole).reshape(4, -1)
    table = {name: [0.0] * 5 for name in dict.fromkeys((*names, *late))}
    for name, value in zip(names, at_rest, strict=True):
        table[name][0] = float(value)
    for k, name in enumerate(late):
        table[name][1:] = [float(value) for value in by_strain[:, k]]
    return table


def _parts(one: Sample, names: tuple[str, ...]) -> np.ndarray:
    block = one.block
    known = correction_terms(block.skin, block.skin_modulus, block.shape_factor, block.oblongness, block.round)
    return np.array([known[name] for name in names])


def _unit(course: str, one: Sample) -> float:
    block = one.block
    return wall_stiffness(block.along, block.across, block.shape_factor, block.skin * block.skin_modulus)[course]


def _basis(strain: float) -> np.ndarray:
    strain = min(strain, MOST)
    return np.array([-np.expm1(-strain / QUICK), strain, strain**2, strain**3])


def _solved(rows: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    heavy = rows * weights[:, None]
    return np.linalg.solve(heavy.T @ heavy + RIDGE * np.eye(rows.shape[1]), heavy.T @ (weights * values))


def written() -> str:
    """The file's text."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["course", "term", "rest", "quick", "first", "second", "third", "source"])
    for course in COURSES:
        for name, values in fitted(course).items():
            lines.writerow([course, name, *(f"{value:.5g}" for value in values), SOURCE])
    return text.getvalue()


if __name__ == "__main__":
    (FOLDER / "pad_films.csv").write_text(written(), encoding="utf-8")
    surround_law.coefficient_table.cache_clear()
    surround_law._fitted_coefficients.cache_clear()
