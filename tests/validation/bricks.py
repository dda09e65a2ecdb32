"""Linear elastic bodies of bricks on a grid, solved by CalculiX: twenty nodes and reduced integration, which do not
lock in rubber that hardly changes its volume (Zienkiewicz, Taylor, Too 1971).
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

CORNERS = [(0, 0), (2, 0), (2, 2), (0, 2)]
EDGES = [(1, 0), (2, 1), (1, 2), (0, 1)]
NODES = [(*c, 0) for c in CORNERS] + [(*c, 2) for c in CORNERS] + [(*e, 0) for e in EDGES] + [(*e, 2) for e in EDGES]
NODES += [(*c, 1) for c in CORNERS]
"""Of a brick, in CalculiX's order, in halves of its sides."""


class Bricks:
    """The bricks between lines (m) along x, y and z that `kind` of their middles names; nodes are `places` (n, 3)."""

    def __init__(self, lines: Sequence[np.ndarray], kind: Callable[[float, float, float], str]) -> None:
        halves = [np.interp(np.arange(2 * len(item) - 1) / 2, np.arange(len(item)), item) for item in lines]
        numbers: dict[tuple[int, ...], int] = {}
        self.elements: list[tuple[str, np.ndarray, list[int]]] = []
        for at in np.ndindex(*(len(item) - 1 for item in lines)):
            middle = np.array([half[2 * k + 1] for half, k in zip(halves, at, strict=True)])
            if of := kind(*middle):
                own = [tuple(2 * k + step for k, step in zip(at, way, strict=True)) for way in NODES]
                self.elements.append((of, middle, [numbers.setdefault(node, len(numbers)) for node in own]))
        self.places = np.array([[half[k] for half, k in zip(halves, node, strict=True)] for node in numbers])

    def of(self, kind: str) -> np.ndarray:
        """The nodes of one kind of bricks, as a mask."""
        mask = np.zeros(len(self.places), dtype=bool)
        mask[[node for of, _, nodes in self.elements if of == kind for node in nodes]] = True
        return mask

    def solved(
        self,
        folder: Path,
        materials: Mapping[str, tuple[float, float]],
        held: Sequence[tuple[np.ndarray, int, float]],
        pressed: Callable[[str, np.ndarray], float] = lambda _, __: 0.0,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (n, 3; m) and the forces (n, 3; N) that hold nodes. `materials` are Young's modulus (Pa)
        and Poisson's ratio by kind, `held` masks of nodes with an axis and how far (m) they go along it, `pressed` is
        the pressure (Pa) on the upper face of a brick by its kind and middle.
        """
        nodes = (", ".join(f"{x:.12g}" for x in place) for place in self.places)
        deck = ["*NODE, NSET=ALL", *(f"{k}, {place}" for k, place in enumerate(nodes, 1))]
        for kind, (young, poisson) in materials.items():
            deck.append(f"*ELEMENT, TYPE=C3D20R, ELSET={kind}")
            for number, (of, _, own) in enumerate(self.elements, 1):
                words = [str(node + 1) for node in own]
                deck += [f"{number}, {', '.join(words[:10])},", ", ".join(words[10:])] if of == kind else []
            deck += [f"*MATERIAL, NAME=OF{kind}", "*ELASTIC", f"{young:.9g}, {poisson:.9g}",
                     f"*SOLID SECTION, ELSET={kind}, MATERIAL=OF{kind}"]
        deck += ["*STEP", "*STATIC", "*BOUNDARY"]
        for mask, axis, way in held:
            deck += [f"{k + 1}, {axis + 1}, {axis + 1}, {way:.9g}" for k in np.flatnonzero(mask)]
        loads = [(number, pressed(of, middle)) for number, (of, middle, _) in enumerate(self.elements, 1)]
        lines = [f"{number}, P2, {load:.9g}" for number, load in loads if load]
        deck += ["*DLOAD", *lines] if lines else []
        deck += ["*NODE PRINT, NSET=ALL", "U", "*NODE PRINT, NSET=ALL", "RF", "*END STEP", ""]
        (folder / "bricks.inp").write_text("\n".join(deck))
        alone = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(["ccx", "bricks"], cwd=folder, env=alone, capture_output=True, timeout=600, check=True)
        rows = [line.split() for line in (folder / "bricks.dat").read_text().splitlines()]
        result = np.array([row[1:] for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
        return result[: len(self.places)], result[len(self.places) :]

    def borne(self, forces: np.ndarray) -> float:
        """The force (N) along z on the nodes at z = 0, of those that hold nodes."""
        return float(forces[self.places[:, 2] < 1e-12, 2].sum())
