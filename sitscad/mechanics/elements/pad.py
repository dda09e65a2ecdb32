"""A bonded pad at large strain, by mixed finite elements: the yardstick of `sitscad.mechanics`.

Displacements of fourth degree along each edge and pressures of second degree in each element (Qk / Qk-2, discontinuous:
a stable pair), on few elements that fan out at the bonded edges. Neo-Hookean: W = mu/2 (J^(-2/3) I1 - 3) + p (J - 1) -
p^2 / (2 K), or Ogden's of one term in place of the first (`rubber`). Netgen/NGSolve solves (`pip install sitscad[fe]`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.mechanics.elements.mesh import BOARD, FREE, MIDDLE, PAD, PLATE, SKIN, Mesh, Solid, fanned
from sitscad.mechanics.elements.rubber import invariant_terms
from sitscad.record import record

Array = NDArray[np.float64]

BULK = 1e4
"""Bulk over shear modulus; to be told from incompressible rubber only in pads many times as wide as thick."""


@record(eq=False)
class Held:
    """What holds a plate at a pose in the plane y = 0: pose (x, z in m, ry in rad), force along x and z (N), and moment
    about y about the displaced centre of the plate's near face (N m); `stiffness` (3, 3) is how these three change with
    the three of the pose.
    """

    pose: tuple[float, float, float]
    force_x: float
    force_z: float
    moment_y: float
    stiffness: np.ndarray


class Pad:
    """Half of a pad, ready to be moved; moduli in Pa. `exponents` are Ogden's, of pad and skin; 2 is neo-Hookean."""

    def __init__(self, solid: Solid, cells: int, shear: float = 1.0, skin: float = 1.0, order: int = 4,
                 mesh: Mesh | None = None, exponents: tuple[float, float] = (2.0, 2.0)) -> None:  # fmt: skip
        import ngsolve as ng

        self.ng, self.solid = ng, solid
        # Lengths are in thicknesses and stresses in shear moduli: the numbers of a solver stay near one.
        self.scale = solid.thickness
        self.shear = shear
        self.mesh = _netgen(mesh or fanned(solid, cells), self.scale)
        if solid.is_round:
            self._round(0.5 * solid.width_x / self.scale, order)
        moved = ng.VectorH1(self.mesh, order=order, dirichletx=f"{BOARD}|{PLATE}", dirichletz=f"{BOARD}|{PLATE}",
                            dirichlety=f"{BOARD}|{PLATE}|{MIDDLE}")  # fmt: skip
        self.space = moved * ng.L2(self.mesh, order=order - 2)
        u, p = self.space.TrialFunction()
        moduli = ng.CoefficientFunction([1.0, skin / shear])
        self.form = ng.BilinearForm(self.space, symmetric=True, condense=True)
        gradient = ng.Id(3) + ng.Grad(u)
        volume = ng.Det(gradient)
        shapes = [self._sheared(gradient, volume, exponent) for exponent in sorted(set(exponents))]
        if len(shapes) > 1:
            shapes = [ng.CoefficientFunction(shapes if exponents[0] < exponents[1] else shapes[::-1])]
        energy = moduli * shapes[0] + p * (volume - 1.0)
        self.form += ng.Variation((energy - p * p / (2.0 * BULK * moduli)).Compile() * ng.dx)
        self.state = ng.GridFunction(self.space)
        self.pose = np.zeros(3)

    def _round(self, radius: float, order: int) -> None:
        # Squares about the axis are made circles, gradually from the middle to the edge, and circles beyond.
        ng = self.ng
        x, y = ng.x / radius, ng.y / radius
        size = ng.IfPos(x * x - y * y, ng.sqrt(x * x), ng.sqrt(y * y))
        share = ng.IfPos(1.0 - size, size * size, 1.0)
        length = ng.sqrt(x * x + y * y) + 1e-12
        scale = 0.85 * (1.0 - share) + share * size / length
        self.bent = ng.GridFunction(ng.VectorH1(self.mesh, order=order))
        self.bent.Set(ng.CoefficientFunction((ng.x * (scale - 1.0), ng.y * (scale - 1.0), 0.0)))
        self.mesh.SetDeformation(self.bent)

    def _sheared(self, gradient: Any, volume: Any, exponent: float) -> Any:
        # What a change of shape costs over the shear modulus: by the invariants of C, freed of the volume's change.
        ng = self.ng
        squared = gradient.trans * gradient
        one = volume ** (-2.0 / 3.0) * ng.Trace(squared)
        if exponent == 2.0:
            return 0.5 * (one - 3.0)
        two = 0.5 * (one * one - volume ** (-4.0 / 3.0) * ng.Trace(squared * squared))
        x, y, energy = one - 3.0, two - 3.0, 0.0
        for i, j, value in invariant_terms(exponent):
            term = value
            for factor in [x] * i + [y] * j:
                term = term * factor
            energy = energy + term
        return energy

    @property
    def unknowns(self) -> int:
        """How many numbers the state has, no unit."""
        return int(self.space.ndof)

    def move(self, pose: Sequence[float], steps: int = 1) -> Held:
        """The plate taken to a pose (x, z in m, ry in rad) in even steps, halved where they are too large."""
        goal = np.array(pose) / (self.scale, self.scale, 1.0)
        began, done, stride = self.pose.copy(), 0.0, 1.0 / steps
        while done < 1.0 - 1e-9:
            stride = min(stride, 1.0 - done)
            before = self.state.vec.CreateVector()
            before.data = self.state.vec
            if self._settle(began + (done + stride) * (goal - began)):
                done += stride
                stride *= 1.4
            else:
                self.state.vec.data = before
                self.pose = began + done * (goal - began)
                stride *= 0.5
                if stride < 1e-3:
                    raise ArithmeticError(f"no equilibrium found on the way to {tuple(pose)}")
        return self._held()

    def along(self, poses: Sequence[Sequence[float]]) -> Iterator[Held]:
        """What holds the plate (N, N m) at each of some poses (x, z in m, ry in rad), one after the other."""
        for pose in poses:
            yield self.move(pose)

    def _settle(self, pose: np.ndarray) -> bool:
        """Whether Newton's method finds the state at a pose (thicknesses, rad) from the last one, from where the
        plate's step is carried down into the pad in proportion to height.
        """
        ng, vec = self.ng, self.state.vec
        motion = _rigid(ng, pose) - _rigid(ng, self.pose)
        guess = ng.GridFunction(self.space)
        guess.components[0].Set(ng.z * motion)
        vec.data += guess.vec
        residual, step = vec.CreateVector(), vec.CreateVector()
        for _ in range(12):
            try:
                self.form.Apply(vec, residual)
                self.form.AssembleLinearization(vec)
                self._solve(residual, step)
            except _refusal():
                return False
            vec.data -= step
            size = ng.Norm(step) / (1.0 + ng.Norm(vec))
            if not size < 1e3:
                return False
            if size < 1e-9:
                self.pose = pose
                return True
        return False

    def _solve(self, residual: Any, step: Any) -> None:
        # Pressures and what lies inside of elements are eliminated first.
        form = self.form
        residual.data += form.harmonic_extension_trans * residual
        inverse = form.mat.Inverse(self.space.FreeDofs(True), "sparsecholesky")
        step.data = inverse * residual
        step.data += form.harmonic_extension * step
        step.data += form.inner_solve * residual

    def _held(self) -> Held:
        """What holds the plate now (N, N m), and how that changes with the pose, both of the whole pad."""
        ng, vec = self.ng, self.state.vec
        residual, product = vec.CreateVector(), vec.CreateVector()
        self.form.Apply(vec, residual)
        self.form.AssembleLinearization(vec)
        inverse = self.form.mat.Inverse(self.space.FreeDofs(True), "sparsecholesky")
        turn = float(self.pose[2])
        bent = self._plate((-math.cos(turn) * ng.x, 0.0, math.sin(turn) * ng.x))
        ways = [self._plate(way) for way in self._ways(turn)]
        work = np.array([ng.InnerProduct(way, residual) for way in ways])
        stiffness = np.empty((3, 3))
        for column, way in enumerate(ways):
            product.data = self.form.mat * way
            follows = (way - inverse * product).Evaluate()
            product.data = self.form.mat * follows
            stiffness[:, column] = [ng.InnerProduct(each, product) for each in ways]
        stiffness[2, 2] += ng.InnerProduct(bent, residual)
        # half of the pad, in the units of the spec
        lengths = np.array([1.0, 1.0, self.scale])
        work *= 2.0 * self.shear * self.scale**2 * lengths
        stiffness *= 2.0 * self.shear * self.scale * np.outer(lengths, lengths)
        x, z, turn = (float(value) for value in self.pose * (self.scale, self.scale, 1.0))
        force_x, force_z, moment_y = (float(value) for value in work)
        return Held((x, z, turn), force_x, force_z, moment_y, stiffness)

    def _ways(self, turn: float) -> list[tuple[Any, ...]]:
        # How the plate's points go per unit of x, z and ry.
        x = self.ng.x
        return [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-math.sin(turn) * x, 0.0, -math.cos(turn) * x)]

    def _plate(self, way: tuple[Any, ...]) -> Any:
        moved = self.ng.GridFunction(self.space)
        moved.components[0].Set(self.ng.CoefficientFunction(way), definedon=self.mesh.Boundaries(PLATE))
        return moved.vec


def _refusal() -> type[Exception]:
    """What the solver raises at an element that is turned inside out: no unit."""
    from netgen.libngpy._meshing import NgException

    return NgException


def _rigid(ng: Any, pose: np.ndarray) -> Any:
    """How far a plate at a pose has moved each of its points from rest, in thicknesses: no unit."""
    x, z, turn = (float(value) for value in pose)
    return ng.CoefficientFunction((x + (math.cos(turn) - 1.0) * ng.x, 0.0, z - math.sin(turn) * ng.x))


def _netgen(mesh: Mesh, scale: float) -> Any:
    """The mesh as the solver takes it, in units of `scale` (m)."""
    import ngsolve as ng
    from netgen import meshing

    made = meshing.Mesh(dim=3)
    numbers = [made.Add(meshing.MeshPoint(meshing.Pnt(*(point / scale)))) for point in mesh.points]
    names = [BOARD, PLATE, MIDDLE, FREE]
    for k, name in enumerate(names):
        made.Add(meshing.FaceDescriptor(surfnr=k + 1, domin=1, domout=0, bc=k + 1))
        made.SetBCName(k, name)
        for quad in mesh.faces[name]:
            made.Add(meshing.Element2D(k + 1, [numbers[n] for n in quad]))
    for material in sorted(set(mesh.materials)):
        made.SetMaterial(int(material), {PAD: "pad", SKIN: "skin"}[int(material)])
    for corners, material in zip(mesh.elements, mesh.materials, strict=True):
        made.Add(meshing.Element3D(int(material), [numbers[n] for n in corners]))
    return ng.Mesh(made)
