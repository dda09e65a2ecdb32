"""Press the pad's mesh in a finite-element solver, and compare the force with sitscad's law.

    pip install 'sitscad[all]' ngsolve
    python docs/examples/pad_compression.py [SPEC] [SIZE]

The mesh is the package's `mesh/NAME-elastomer.msh`, with elements of SIZE (mm). The solver is NGSolve with Taylor-Hood
elements: displacements of degree 2, pressures of degree 1. The material is a neo-Hookean solid at large strain,
W = mu/2 (J^(-2/3) I1 - 3) + p (J - 1) - p^2 / (2 K). Newton's method solves the equations.
"""

import sys
import tempfile
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import ngsolve as ng
from netgen.read_gmsh import ReadGmsh

import sitscad

STRAINS = (0.05, 0.1, 0.2)
BULK = 1e4
"""Ratio of bulk modulus to shear modulus. Rubber is nearly incompressible."""


def read(content: bytes, scale: float) -> Any:
    """Read a mesh file for the solver, with lengths divided by `scale` (m)."""
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(StringIO()):
        path = Path(folder) / "pad.msh"
        path.write_bytes(content)
        made = ReadGmsh(str(path))
    made.Scale(1.0 / scale)
    return ng.Mesh(made)


def forces(mesh: Any) -> list[float]:
    """Return the pressing forces at `STRAINS`. Lengths are in pad thicknesses, stresses in shear moduli."""
    bonded = "bonded_bottom|bonded_top"
    space = ng.VectorH1(mesh, order=2, dirichlet=bonded) * ng.H1(mesh, order=1)
    u, p = space.TrialFunction()
    gradient = ng.Id(3) + ng.Grad(u)
    volume = ng.Det(gradient)
    energy = (
        0.5 * (volume ** (-2 / 3) * ng.InnerProduct(gradient, gradient) - 3) + p * (volume - 1) - p * p / (2 * BULK)
    )
    form = ng.BilinearForm(space, symmetric=True)
    form += ng.Variation(energy.Compile() * ng.dx)
    state, residual, found, before = ng.GridFunction(space), None, [], 0.0
    press = ng.GridFunction(space)
    press.components[0].Set(ng.CF((0, 0, -1)), definedon=mesh.Boundaries("bonded_top"))
    for strain in STRAINS:
        start = ng.GridFunction(space)
        start.components[0].Set(ng.CF((0, 0, (before - strain) * ng.z)))
        state.vec.data += start.vec
        residual = newton(form, space, state)
        found.append(ng.InnerProduct(residual, press.vec))
        before = strain
    return found


def newton(form: Any, space: Any, state: Any) -> Any:
    """Solve for equilibrium of the free nodes. Return the reaction forces of the fixed nodes."""
    residual, step = state.vec.CreateVector(), state.vec.CreateVector()
    for _ in range(20):
        form.Apply(state.vec, residual)
        form.AssembleLinearization(state.vec)
        step.data = form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * residual
        state.vec.data -= step
        if ng.Norm(step) < 1e-8 * ng.Norm(state.vec):
            break
    form.Apply(state.vec, residual)
    return residual


def main() -> dict[str, list[float]]:
    """Print the force (N) by finite elements and by the law."""
    named = [*sys.argv[1:], *("templates/bench_7mm.yaml", "1")[len(sys.argv) - 1 :]][:2]
    spec = sitscad.load(named[0])
    layout, thick = sitscad.lay_out(spec), spec.elastomer.thickness
    mesh = read(sitscad.pad_mesh(layout, float(named[1]) * 1e-3)["msh"], thick)
    ng.SetNumThreads(1)
    unit = spec.elastomer.material.shear_modulus * thick**2
    there = [unit * force for force in forces(mesh)]
    poses = [[0, 0, -strain * thick, 0, 0, 0] for strain in STRAINS]
    here = [-float(force[2]) for force in sitscad.respond(sitscad.Design(spec), poses).force]
    print(f"{mesh.ne} tetrahedra of {named[0]}")
    for strain, one, other in zip(STRAINS, there, here, strict=True):
        off = f"{other / one - 1:+.1%}"
        print(f"{strain:.0%} compressed: {one:.3f} N by finite elements, {other:.3f} N by the law ({off})")
    return {"elements": there, "law": here}


if __name__ == "__main__":
    main()
