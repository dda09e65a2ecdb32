"""A coil on `sitscad.field_mesh` in a finite-element solver, beside the estimate: does the mesh serve a field program?

    pip install 'sitscad[all]' ngsolve
    python tests/validation/field_mesh.py [TEMPLATE]

Magnetostatics by NGSolve with edge elements: the vector potential of coil C1 alone, its turns spread evenly over its
ring, without metal (mu0 everywhere, no flux through the air's end). The energy gives the inductance. Against the
winding's estimate: half a per cent is the turns' own form, which the ring has not, two per cent the air's end.
"""

from __future__ import annotations

import math
import sys
import tempfile
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import ngsolve as ng
from netgen.read_gmsh import ReadGmsh

import sitscad
from sitscad.spec import templates

MU0 = 4e-7 * math.pi


def by_elements(layout: sitscad.Layout) -> tuple[float, int]:
    """The inductance (H) of a round C1, and how many unknowns it took."""
    coil, spec = layout.coils[0], layout.spec.coil
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(StringIO()):
        path = Path(folder) / "field.msh"
        path.write_bytes(sitscad.field_mesh(layout)["msh"])
        mesh = ng.Mesh(ReadGmsh(str(path)))
    space = ng.HCurl(mesh, order=1, dirichlet="outer", nograds=True)
    u, v = space.TnT()
    x, y = ng.x - coil.centre[0], ng.y - coil.centre[1]
    around = ng.CF((-y, x, 0)) / ng.sqrt(x * x + y * y)
    outer = spec.size[0] / 2
    depth = max(spec.layer_turns) * (spec.trace_width + spec.trace_spacing) - spec.trace_spacing
    z = [w.z for w in coil.windings]
    height = max(z) - min(z) + coil.windings[0].thickness
    turns = sum(spec.layer_turns)
    density = turns / (min(depth, outer) * height)
    stiff = ng.BilinearForm(space, symmetric=True)
    stiff += (ng.curl(u) * ng.curl(v) + 1e-1 * u * v) * ng.dx
    load = ng.LinearForm(space)
    load += density * around * v * ng.dx(f"coil_{coil.name}")
    stiff.Assemble()
    load.Assemble()
    field = ng.GridFunction(space)
    field.vec.data = stiff.mat.Inverse(space.FreeDofs(), "sparsecholesky") * load.vec
    return MU0 * ng.Integrate(ng.InnerProduct(ng.curl(field), ng.curl(field)), mesh), space.ndof


def main() -> None:
    """Print both inductances."""
    name = sys.argv[1] if len(sys.argv) > 1 else "single_coil"
    layout = sitscad.lay_out(sitscad.load_text(templates.read(name)))
    there, unknowns = by_elements(layout)
    here = sitscad.estimate(layout).coils[0].winding_inductance
    print(
        f"{name}: {there * 1e6:.4f} uH by {unknowns} unknowns, {here * 1e6:.4f} uH estimated ({there / here - 1:+.2%})"
    )


if __name__ == "__main__":
    main()
