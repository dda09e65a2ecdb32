"""What the fit and its files cost, step by step: processor time of every tier and every export of a template.

    python tests/benchmarks/part_times.py [TEMPLATE...]

The plane tier is what `check` computes of the fit, warm, the best of five; the solids' tier and the exports are single
runs after the CAD packages are loaded. It prints a Markdown table and fails on nothing: it measures.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import build123d  # noqa: F401
import cadquery  # noqa: F401
import gmsh  # noqa: F401
import manifold3d  # noqa: F401
import trimesh  # noqa: F401

import sitscad
from sitscad.assembly.places.fit import fit
from sitscad.assembly.solids import assembly_aids, solid
from sitscad.assembly.solids.pieces import assemble
from sitscad.assembly.solids.proof import measure_solids
from sitscad.assembly.solids.whole import whole
from sitscad.files.formats import meshes, step
from sitscad.files.formats.volume_mesh import elastomer_meshes
from sitscad.spec import templates


def timed(function: Callable[[], Any], runs: int = 1) -> tuple[Any, float]:
    """What a function gives, and the least processor time (s) of some runs."""
    best, result = float("inf"), None
    for _ in range(runs):
        began = time.process_time()
        result = function()
        best = min(best, time.process_time() - began)
    return result, best


def rows(name: str) -> list[tuple[str, float]]:
    """Every step with its time (s)."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read(name)))
    spec = layout.spec
    result = [("plane tier: the fit's figures", timed(lambda: fit(layout), 5)[1])]
    pieces, seconds = timed(lambda: assemble(layout))
    result.append(("solids of the sensor", seconds))
    every, seconds = timed(lambda: whole(layout, pieces))
    result.append(("solids of the whole assembly", seconds))
    tools, seconds = timed(lambda: assembly_aids(layout))
    result.append(("solids of jig and moulds", seconds))
    result.append(("3-D tier: meshes, interference, port, opening, gaps",
                  timed(lambda: measure_solids(layout, every))[1]))
    exports: list[tuple[str, Callable[[], Any]]] = [
        ("STEP of every piece", lambda: step.render(pieces, spec, tools)),
        ("STL of every piece", lambda: meshes.render_stl(pieces, spec, tools)),
        ("3MF of every piece", lambda: meshes.render_3mf(pieces, spec, tools)),
        ("STEP of the assembly", lambda: step.render_whole(every, spec)),
        ("triangles of the assembly", lambda: solid.display_meshes(every)),
        ("3MF of the assembly", lambda: meshes.render_whole_3mf(every, spec)),
        ("GLB of the assembly", lambda: meshes.render_glb(every, spec)),
        ("mesh of the pad", lambda: elastomer_meshes(pieces, layout.spec.elastomer)),
        ("mesh for fields", lambda: sitscad.field_mesh(layout)),
    ]
    return result + [(what, timed(export)[1]) for what, export in exports]


def main() -> None:
    """Print the table."""
    names = sys.argv[1:] or ["grasper_4layer"]
    columns = {name: rows(name) for name in names}
    print(f"| step | {' | '.join(names)} |")
    print(f"|---|{'---|' * len(names)}")
    for row in zip(*columns.values(), strict=True):
        print(f"| {row[0][0]} | {' | '.join(f'{1e3 * seconds:.3g} ms' for _, seconds in row)} |")


if __name__ == "__main__":
    main()
