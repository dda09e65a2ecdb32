"""A bonded pad at large strain by mixed finite elements: the reference of the pad's law.

Displacements of fourth degree along each edge and pressures of second degree in each element (Qk / Qk-2, discontinuous:
a stable pair), on few elements that fan out at the bonded edges. Neo-Hookean: W = mu/2 (J^(-2/3) I1 - 3) + p (J - 1) -
p^2 / (2 K), or Ogden's of one term in place of the first. Netgen/NGSolve solves (`pip install --group references`).

The pad under the plate is a picture frame in three dimensions: an inner box, and six blocks between its faces and the
pad's. Every edge of the bonded faces is then shared by two elements of 45 degrees (by three where a rim or a skin lies
beside the plate), which can open as the bulging side swings past the board's plane; a plain grid inverts there.

Ogden's rubber, W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3), has no closed form in the invariants
I1 and I2 of C = F^T F, and by its principal stretches it has no slope at rest, where they are alike. As a symmetric
function of them it is smooth in I1 and I2, and two even exponents are polynomials: 2 gives I1 / 2, 4 gives
(I1^2 - 2 I2) / 8. The elements take a polynomial in the invariants.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record

BULK = 1e4  # Bulk over shear modulus; to be told from incompressible rubber only in pads many times as wide as thick


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


class HalfPad:
    """Half of a pad, ready to be moved; moduli in Pa. `exponents` are Ogden's, of pad and skin; 2 is neo-Hookean.

    `growth` is the free linear expansion of a warm pad between plates that do not grow.
    """

    def __init__(
        self, solid: GluedPlate, cells: int, shear: float = 1.0, skin: float = 1.0, order: int = 4,
        mesh: Mesh | None = None, exponents: tuple[float, float] = (2.0, 2.0), growth: float = 0.0,
    ) -> None:
        import ngsolve as ng

        self.ng, self.solid = ng, solid
        # Lengths are in thicknesses and stresses in shear moduli: the numbers of a solver stay near one.
        self.scale = solid.thickness
        self.shear = shear
        self.mesh = _netgen(mesh or fanned(solid, cells), self.scale)
        if solid.is_round:
            self._round(0.5 * solid.width_x / self.scale, order)
        moved = ng.VectorH1(
            self.mesh, order=order, dirichletx=f"{BOARD}|{PLATE}", dirichletz=f"{BOARD}|{PLATE}",
            dirichlety=f"{BOARD}|{PLATE}|{MIDDLE}",
        )
        self.space = moved * ng.L2(self.mesh, order=order - 2)
        u, p = self.space.TrialFunction()
        moduli = ng.CoefficientFunction([1.0, skin / shear])
        self.form = ng.BilinearForm(self.space, symmetric=True, condense=True)
        gradient = ng.Id(3) + ng.Grad(u)
        volume = ng.Det(gradient)
        shapes = [self._sheared(gradient, volume, exponent) for exponent in sorted(set(exponents))]
        if len(shapes) > 1:
            shapes = [ng.CoefficientFunction(shapes if exponents[0] < exponents[1] else shapes[::-1])]
        # warm rubber: the cold one's energy of a change of shape, by its volume when warm
        warm = (1.0 + growth) ** 3
        energy = warm * moduli * shapes[0] + p * (volume - warm)
        self.form += ng.Variation((energy - p * p / (2.0 * BULK * moduli)).Compile() * ng.dx)
        self.state = ng.GridFunction(self.space)
        self.pose = np.zeros(3)

    def _round(self, radius: float, order: int) -> None:
        """Makes squares about the axis circles (lengths in thicknesses), gradually from the middle to the edge, and
        circles beyond.
        """
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
        """What a change of shape costs over the shear modulus (no unit): by the invariants of C, freed of the volume's
        change (`invariant_terms`).
        """
        ng = self.ng
        squared = gradient.trans * gradient
        item = volume ** (-2.0 / 3.0) * ng.Trace(squared)
        if exponent == 2.0:
            return 0.5 * (item - 3.0)
        two = 0.5 * (item * item - volume ** (-4.0 / 3.0) * ng.Trace(squared * squared))
        x, y, energy = item - 3.0, two - 3.0, 0.0
        for i, j, value in invariant_terms(exponent):
            term = value
            for factor in [x] * i + [y] * j:
                term = term * factor
            energy = energy + term
        return energy

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

    def _settle(self, pose: np.ndarray) -> bool:
        """Whether Newton's method finds the state at a pose (thicknesses, rad) from the last one, from where the
        plate's step is carried down into the pad in proportion to height.
        """
        from netgen.libngpy._meshing import NgException  # raised at an element that is turned inside out

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
                # pressures and what lies inside of elements are eliminated first
                residual.data += self.form.harmonic_extension_trans * residual
                step.data = self.form.mat.Inverse(self.space.FreeDofs(True), "sparsecholesky") * residual
                step.data += self.form.harmonic_extension * step
                step.data += self.form.inner_solve * residual
            except NgException:
                return False
            vec.data -= step
            size = ng.Norm(step) / (1.0 + ng.Norm(vec))
            if not size < 1e3:
                return False
            if size < 1e-9:
                self.pose = pose
                return True
        return False

    def _held(self) -> Held:
        """What holds the plate now (N, N m), and how that changes with the pose, both of the whole pad: the residual's
        work on the plate's motions, and the tangent with the inside eliminated (Schur's complement, textbook).
        """
        ng, vec = self.ng, self.state.vec
        residual, product = vec.CreateVector(), vec.CreateVector()
        self.form.Apply(vec, residual)
        self.form.AssembleLinearization(vec)
        inverse = self.form.mat.Inverse(self.space.FreeDofs(True), "sparsecholesky")
        sine, cosine = math.sin(float(self.pose[2])), math.cos(float(self.pose[2]))
        bent = self._plate((-cosine * ng.x, 0.0, sine * ng.x))
        # how the plate's points go per unit of x, z and ry
        ways = [self._plate(way) for way in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-sine * ng.x, 0.0, -cosine * ng.x))]
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

    def _plate(self, way: tuple[Any, ...]) -> Any:
        """A field (thicknesses) that moves the plate's face alone, as the solver's vector."""
        moved = self.ng.GridFunction(self.space)
        moved.components[0].Set(self.ng.CoefficientFunction(way), definedon=self.mesh.Boundaries(PLATE))
        return moved.vec


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


PAD, SKIN = 1, 2  # What an element is made of

BOARD, PLATE, MIDDLE, FREE = "board", "plate", "middle", "free"
"""What a face of the mesh is: glued to the board, to the rigid plate, on the plane of symmetry y = 0, or free."""


@record
class GluedPlate:
    """A plate glued on a pad, glued on a board: widths (m) along x and y of the plate and of what reaches beyond it.

    `rim` is by how much the pad is wider than the plate to each side, `skin` how thick a film stands round the pad, its
    foot glued to the board and its upper end to the plate's sides (only without a rim). `is_round`: a disc of the first
    width, whose mesh is that of the square about it, to be rounded by who solves.
    """

    width_x: float
    width_y: float
    thickness: float
    is_round: bool = False
    rim: float = 0.0
    skin: float = 0.0


@record(eq=False)
class Mesh:
    """Corners (n, 3), hexahedra (m, 8) as bottom and top faces run round, their materials (m,), and the outer faces by
    what they are: quadrangles (k, 4).
    """

    points: np.ndarray
    elements: np.ndarray
    materials: np.ndarray
    faces: dict[str, np.ndarray]


FRAME, CLOSER = 0.3, 0.4
"""Thickness of the frame round the inner box, over the least of the pad's thickness and half sides; and how far each of
its layers' bounds is from the face, over the one inside it."""


def fanned(solid: GluedPlate, cells: int, layers: int = 2) -> Mesh:
    """Half of a pad (y >= 0; m): `cells` elements through the inner box's height, and `layers` of them in the frame
    round it (FRAME, CLOSER).
    """
    frame = FRAME * min(solid.thickness, 0.5 * solid.width_x, 0.5 * solid.width_y)
    bounds = frame * np.append(CLOSER ** np.arange(layers), 0.0)
    half = 0.5 * np.array([solid.width_x, solid.width_y, solid.thickness])
    inner = [_lines(side - frame, solid.thickness, cells) for side in half]
    inner[1] = inner[1][inner[1] > -1e-12]
    blocks = [(np.stack(np.meshgrid(*inner, indexing="ij"), axis=-1), PAD)]
    blocks += [
        (_frustum(inner, half, bounds, axis, sign), PAD)
        for axis in range(3)
        for sign in (-1, 1)
        if (axis, sign) != (1, -1)
    ]
    for width, material in ((solid.rim, PAD), (solid.skin, SKIN)):
        if not width:
            continue
        outwards = width * np.linspace(0.0, 1.0, 2 + cells // 2)  # from the plate's edge, even in a film
        if material == PAD:  # growing outwards in a rim
            outwards = width * np.linspace(0.0, 1.0, max(2, round(cells * (1.0 + width / solid.thickness))) + 1) ** 1.7
        for axis, sign in ((0, -1), (0, 1), (1, 1)):
            blocks.append((_beside(inner, half, bounds, axis, sign, outwards), material))
    points, elements, materials = _joined(blocks, 1e-6 * solid.thickness)
    outside = _faces(points, elements, solid)
    points = points + np.array([0.0, 0.0, half[2]])
    return Mesh(points, elements, materials, outside)


def _lines(side: float, thickness: float, cells: int) -> np.ndarray:
    """Lines (n,; m) of the inner box along one axis, an even number of cells, wider in the middle of a flat pad."""
    count = 2 * max(1, round(0.5 * cells * min(3.0, (2.0 * side / thickness) ** 0.75)))
    if side < 0.5 * thickness * 0.99:
        count = 2 * max(1, round(0.5 * cells))
    even = np.linspace(-1.0, 1.0, count + 1)
    return side * (0.5 * even + 0.5 * np.sin(0.5 * np.pi * even))


def _frustum(inner: list[np.ndarray], half: np.ndarray, layers: np.ndarray, axis: int, sign: int) -> np.ndarray:
    """Points (layers, n, m, 3; m) between a face of the inner box and that of the pad."""
    grids = []
    across = [k for k in range(3) if k != axis]
    for layer in layers:
        shrink = [(half[k] - layer) / np.abs(inner[k]).max() for k in across]
        item, other = np.meshgrid(*(s * inner[k] for s, k in zip(shrink, across, strict=True)), indexing="ij")
        grid = np.empty((*item.shape, 3))
        grid[..., across[0]], grid[..., across[1]] = item, other
        grid[..., axis] = sign * (half[axis] - layer)
        grids.append(grid)
    return np.stack(grids)


def _beside(
    inner: list[np.ndarray], half: np.ndarray, layers: np.ndarray, axis: int, sign: int, outwards: np.ndarray
) -> np.ndarray:
    """A block's points (steps, n, m, 3; m) beside the pad's outermost face: the face's own grid moved outwards, and
    widened with it.
    """
    face = _frustum(inner, half, layers, axis, sign)[-1]
    other = 1 - axis
    grids = []
    for distance in outwards:
        grid = face.copy()
        grid[..., axis] += sign * distance
        grid[..., other] *= (half[other] + distance) / half[other]
        grids.append(grid)
    return np.stack(grids)


def _joined(blocks: list[tuple[np.ndarray, int]], near: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All blocks' points (m), each once, and their elements, right-handed."""
    places = np.concatenate([block.reshape(-1, 3) for block, _ in blocks])
    _, first, numbers = np.unique(
        np.round(places / near).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    numbers, start, elements, materials = numbers.ravel(), 0, [], []
    for block, material in blocks:
        grid = numbers[start : start + block[..., 0].size].reshape(block.shape[:3])
        start += grid.size
        i, j, k = (length - 1 for length in block.shape[:3])
        corners = [grid[a : i + a, b : j + b, c : k + c].ravel() for a, b, c in CORNERS]
        elements.append(np.stack(corners, axis=1))
        materials.append(np.full(len(elements[-1]), material))
    points, hexahedra = places[first], np.concatenate(elements)
    origin = points[hexahedra[:, 0]]
    edges = [points[hexahedra[:, k]] - origin for k in (1, 3, 4)]
    turned = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2]) < 0.0
    hexahedra[turned] = hexahedra[turned][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return points, hexahedra, np.concatenate(materials)


CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
"""Where the corners of an element lie in its block, in the order in which they are told."""


SIDES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
"""The faces of a hexahedron, seen from outside."""


def _faces(points: np.ndarray, elements: np.ndarray, solid: GluedPlate) -> dict[str, np.ndarray]:
    """The outer faces (n, 4; numbers of points, no unit) by what they are: BOARD, PLATE, MIDDLE or FREE."""
    quads = elements[:, SIDES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    outer = quads[first[count == 1]]
    x, y, z = np.moveaxis(points[outer], 2, 0)
    near, half = 1e-6 * solid.thickness, 0.5 * solid.thickness
    reach = 0.5 * np.array([solid.width_x, solid.width_y]) + solid.skin + near
    bottom, top, middle = (z < -half + near).all(1), (z > half - near).all(1), (y < near).all(1)
    under = (np.abs(x) < reach[0]).all(1) & (y < reach[1]).all(1)
    kinds = {BOARD: bottom, PLATE: top & under, MIDDLE: middle}
    return {name: outer[which] for name, which in (kinds | {FREE: ~(bottom | (top & under) | middle)}).items()}


DEGREE, FARTHEST, GRID = 3, 1.0, 41
"""Degree of the polynomial; logarithm of the stretches up to which it is fitted, and how finely. Stresses are within
0.1 % (rms) and 1 % (largest, at the ends) for exponents from 2 to 4 (tests/mechanics/test_rubber.py)."""


@cache
def invariant_terms(exponent: float) -> tuple[tuple[int, int, float], ...]:
    """Powers of I1 - 3 and I2 - 3 with their coefficients (no unit): their sum is W over the shear modulus of
    incompressible rubber. Fitted by least squares to stresses at stretches of constant volume: to the difference of a
    principal stress and the third, which is the slope of W by the logarithm of that stretch (Ogden 1972); the modulus
    at rest is exact.
    """
    first = 0.125 * (exponent - 2.0)
    powers = [(i, total - i) for total in range(2, DEGREE + 1) for i in range(total, -1, -1)]
    each = np.linspace(-FARTHEST, FARTHEST, GRID)
    item, two = (part.ravel() for part in np.meshgrid(each, each))
    logs = np.stack([item, two, -item - two], axis=1)
    stretch = np.exp(logs[np.abs(logs).max(axis=1) <= FARTHEST + 1e-12])
    square = stretch**2
    x, y = np.sum(square, axis=1) - 3.0, np.sum(stretch**-2.0, axis=1) - 3.0

    def slopes(side: int, some: list[tuple[int, int]]) -> Array:
        """Slopes (n, terms; no unit) of products of powers of I1 - 3 and I2 - 3, the third stretch giving way."""
        of_x = 2.0 * (square[:, side] - square[:, 2])
        of_y = 2.0 * (1.0 / square[:, 2] - 1.0 / square[:, side])
        result = []
        for i, j in some:
            by_x = i * x ** max(i - 1, 0) * y**j if i else 0.0 * x
            by_y = j * y ** max(j - 1, 0) * x**i if j else 0.0 * x
            result.append(by_x * of_x + by_y * of_y)
        return np.stack(result, axis=1)

    stress = [2.0 / exponent * (stretch[:, side] ** exponent - stretch[:, 2] ** exponent) for side in (0, 1)]
    size = np.hypot(*stress) + 1e-3
    rows = np.vstack([slopes(side, powers) / size[:, None] for side in (0, 1)])
    wanted = [(stress[side] - slopes(side, [(1, 0), (0, 1)]) @ [0.5 + first, -first]) / size for side in (0, 1)]
    result = np.linalg.lstsq(rows, np.concatenate(wanted), rcond=None)[0]
    higher = ((i, j, float(value)) for (i, j), value in zip(powers, result, strict=True))
    return (1, 0, 0.5 + first), (0, 1, -first), *higher
