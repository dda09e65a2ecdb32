"""Eddy currents on a box: rectangular targets with side walls and edges.

Stream functions are products of splines along two edges and are continuous over the box's edges. The box's three mirror
planes divide them into eight classes. The function 1/R is written as a sum of Gaussians (`GaussianSum`), so an
inductance is a sum of products of one-dimensional integrals. The double integrals over the surface become matrix
products without singular points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from sitscad.basics.arrays import Array, Flags, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.body import BodyEnergies, box_bodies, surface_function_numbers
from sitscad.kernels.electromagnetics.eddy.graded_line import (
    FINER,
    PARITIES,
    GaussianSum,
    GradedLine,
    gaussian_sum,
    graded_line,
)
from sitscad.kernels.electromagnetics.eddy.surface import Energies, definite_inductance, energies
from sitscad.kernels.electromagnetics.special_functions import gauss

Parity = tuple[int, int, int]
"""Parity (1 even, -1 odd) of functions along x, y and z."""

ACROSS = ((1, 2), (0, 2), (0, 1))
"""The two axes in the plane of a face, by the axis normal to the face."""

TURN = (1.0, -1.0, 1.0)
"""Sign of the current e x grad psi in a face's axes a and b, by the axis normal to the face (no unit).

The unit vector e is normal to the face. The current is -dpsi/db along a and dpsi/da along b. Faces normal to y have the
opposite sign.
"""

THICKNESS = 2
"""Number of the axis along which the box's thickness is measured (z)."""


@record(eq=False)
class BoxFunctions:
    """Stream functions of one parity (1 even, -1 odd) along each of x, y and z.

    All products of functions along the axes are numbered. `numbers` (functions along a, along b; one array per normal
    axis) are the numbers of each face's functions. `kept` flags the functions in use. `inductance` (n, n; H) and `body`
    are for the functions in use.
    """

    parity: Parity
    numbers: tuple[Index, ...]
    kept: Flags
    inductance: Array
    body: BodyEnergies

    @cached_property
    def energies(self) -> Energies:
        """Energy matrices (H, 1/H, no unit) of the stream functions inside and outside the box."""
        return energies(self.inductance, self.body)


@record(eq=False)
class BoxClass:
    """Eddy currents (A) of a box with one symmetry: even (1) or odd (-1) along each of x, y and z (`parity`).

    `projections` has for each axis two matrices that integrate a field with functions and with slopes (see
    `GradedLine.projections`).
    """

    functions: BoxFunctions
    projections: tuple[tuple[Array, Array], ...]

    @property
    def parity(self) -> Parity:
        """Parity (1 even, -1 odd; no unit) of the stream functions along x, y and z."""
        return self.functions.parity

    @property
    def symmetry_in_plane(self) -> tuple[int, int]:
        """Parities (1 even, -1 odd; no unit) of the stream functions along x and y."""
        return self.parity[:2]

    def flux_linkages(self, potential: Array) -> Array:
        """Return the flux linkages (n, fields; Wb) of the n functions for a vector potential at the points.

        `potential` (points, 3, fields; Wb/m) holds x, y and z components. There is one field per coil and pose.
        """
        linkages = np.zeros((self.functions.kept.size, potential.shape[-1]))
        for across, (a, b) in enumerate(ACROSS):
            faces = self._face_potentials(potential, across)
            field = faces[0] - self.parity[across] * faces[1]
            (fa, da), (fb, db) = self.projections[a], self.projections[b]
            along_a = _project_on_functions(field[:, :, a], fa, db)
            along_b = _project_on_functions(field[:, :, b], da, fb)
            linked = TURN[across] * (along_b - along_a)
            numbers = self.functions.numbers[across].ravel()  # in a face
            linkages[numbers] += linked.reshape(-1, potential.shape[-1])
        return linkages[self.functions.kept]

    def potential_weights(self, functions: Array) -> Array:
        """Return the weights (points, 3, m; m) of the potential at points in the flux linkages of m current patterns.

        `functions` (n, m) are the patterns as weights of the n stream functions. A weight is also the current moment (A
        m) at a point that represents the pattern at a distance.
        """
        pieces, whole = [], np.zeros((self.functions.kept.size, functions.shape[1]))
        whole[self.functions.kept] = functions
        for across, (a, b) in enumerate(ACROSS):
            (fa, da), (fb, db) = self.projections[a], self.projections[b]
            amount = TURN[across] * whole[self.functions.numbers[across]]
            weights = np.zeros((2, fa.shape[1], fb.shape[1], 3, functions.shape[1]))
            weights[0, :, :, a] = -_project_on_functions(amount, fa.T, db.T)
            weights[0, :, :, b] = _project_on_functions(amount, da.T, fb.T)
            weights[1] = -self.parity[across] * weights[0]
            pieces.append(weights.reshape(-1, 3, functions.shape[1]))
        return np.concatenate(pieces)

    def _face_potentials(self, potential: Array, across: int) -> Array:
        """Return the potentials (2, points along a, along b, 3, fields; Wb/m) on both faces normal to an axis.

        `potential` (points, 3, fields; Wb/m) is on all faces, `across` the number of the axis. The first axis of the
        result is the upper face, then the lower face.
        """
        counts = [self.projections[axis][0].shape[1] for axis in range(3)]
        sizes = [2 * counts[a] * counts[b] for a, b in ACROSS]
        a, b = ACROSS[across]
        start = sum(sizes[:across])
        return potential[start : start + sizes[across]].reshape(2, counts[a], counts[b], *potential.shape[1:])


@record(eq=False)
class Box:
    """Box centred on the origin, for eddy currents on its faces.

    `lines` hold the functions along x, y and z. `counts` are the numbers of field points along them. Functions with
    wave numbers above `shortest` (1/m) along both edges of a face are omitted. Near an edge, currents vary fast only
    across the edge.
    """

    lines: tuple[GradedLine, ...]
    counts: tuple[int, int, int]
    shortest: float

    @cached_property
    def points(self) -> Array:
        """Positions (points, 3; m) at which fields are evaluated.

        The order is faces normal to x, to y and to z. The upper face of each pair is first.
        """
        places = [line.half * gauss(count)[0] for line, count in zip(self.lines, self.counts, strict=True)]
        pieces = []
        for across, (a, b) in enumerate(ACROSS):
            for side in (1.0, -1.0):
                face = np.empty((self.counts[a], self.counts[b], 3))
                face[..., a], face[..., b] = places[a][:, None], places[b]
                face[..., across] = side * self.lines[across].half
                pieces.append(face.reshape(-1, 3))
        return np.concatenate(pieces)

    @property
    def largest_class_size(self) -> int:
        """Number of functions (no unit) in the largest class, which is even along x, y and z."""
        number = _function_numbers(self.lines)
        return int(np.count_nonzero(_parity_functions(self.lines, (1, 1, 1), number, self.shortest)[1]))

    @cached_property
    def mirror_image_numbers(self) -> tuple[Index, Index]:
        """For each point, the number (points; no unit) of its mirror image across x = 0 and across y = 0."""
        pieces: tuple[list[Index], list[Index]] = [], []
        start = 0
        for across, (a, b) in enumerate(ACROSS):
            face = start + np.arange(2 * self.counts[a] * self.counts[b]).reshape(2, self.counts[a], self.counts[b])
            for axis, numbers in enumerate(pieces):
                turned = 0 if axis == across else 1 if axis == a else 2
                numbers.append(np.flip(face, turned).ravel())
            start += face.size
        return np.concatenate(pieces[0]), np.concatenate(pieces[1])

    @cached_property
    def classes(self) -> tuple[BoxClass, ...]:
        """Classes of eddy currents for the eight parities along x, y and z, with inductances in H."""
        sizes = zip(self.lines, self.counts, strict=True)
        projections = [line.projections(count) for line, count in sizes]
        return tuple(
            BoxClass(functions, tuple(projections[k][functions.parity[k]] for k in range(3)))
            for functions in _functions(self.lines, self.shortest)
        )


@lru_cache(maxsize=1)
def _functions(lines: tuple[GradedLine, ...], shortest: float) -> tuple[BoxFunctions, ...]:
    """Return the stream functions of each of the eight parities along x, y and z, with inductances in H.

    `lines` hold the functions along x, y and z. Products with wave numbers above `shortest` (1/m) along two edges at
    once are omitted.
    """
    reach = 2.0 * math.hypot(*(line.half for line in lines))
    finest = min(float(line.steps.min()) for line in lines)
    gaussians = gaussian_sum(0.25 * finest, reach)
    distinct = {line: _packed_integrals(line, gaussians.scales) for line in dict.fromkeys(lines)}
    number = _function_numbers(lines)
    parities = list(product(PARITIES, PARITIES, PARITIES))
    selections = [_parity_functions(lines, parity, number, shortest) for parity in parities]
    bodies = box_bodies([line.modes for line in lines], np.stack([selection for _, selection in selections]))
    parts = [[distinct[line][sign] for line, sign in zip(lines, parity, strict=True)] for parity in parities]
    return tuple(
        BoxFunctions(parity, numbers, selection,
                     _inductance(lines, parity, gaussians, integrals, numbers, selection), body)
        for parity, (numbers, selection), integrals, body in zip(parities, selections, parts, bodies, strict=True)
    )


def _function_numbers(lines: Sequence[GradedLine]) -> Index:
    """Return a number (no unit) for each product of functions along x, y and z; -1 if it is zero on the surface.

    Even and odd functions share the numbers. The parity with more functions sets the length of each axis.
    """
    return surface_function_numbers([max(modes.squares.size for modes in line.modes.values()) + 1 for line in lines])


def _parity_functions(
    lines: Sequence[GradedLine], parity: Parity, number: Index, shortest: float
) -> tuple[tuple[Index, ...], Flags]:
    """Return numbers (no unit) of the functions on the faces normal to x, y and z, and flags of functions in use.

    `lines` hold the functions along x, y and z, `parity` is the parity along each. `number` (x, y, z) holds the numbers
    of all products. Functions with wave numbers above `shortest` (1/m) along two edges at once are not in use.
    """
    modes = [line.modes[axis_parity] for line, axis_parity in zip(lines, parity, strict=True)]
    places = [np.append(np.arange(row.squares.size), count - 1) for row, count in zip(modes, number.shape, strict=True)]
    number = number[np.ix_(*places)]
    x, y, z = np.meshgrid(*(np.append(row.squares > shortest**2, False) for row in modes), indexing="ij")
    selection = np.zeros(np.max(number) + 1, dtype=bool)
    selection[number[(number >= 0) & ~(x & y | y & z | z & x)]] = True
    return (number[-1], number[:, -1], number[:, :, -1]), selection


@record(eq=False)
class _PackedIntegrals:
    """Integrals of a line's functions of one parity, with each pair of functions stored once.

    `mass` (Gaussians + 1, pairs; m2), `slope` (Gaussians + 1, pairs; no unit) and `end` (Gaussians, n; no unit) are
    explained at `LineIntegrals`. The last row of `mass` and `slope` (m, 1/m) is for the tail of the `GaussianSum` and
    comes from `GradedLine.grams`. `which` (n, n) is the number of the pair that two functions form.
    """

    mass: Array
    slope: Array
    end: Array
    which: Index


def _packed_integrals(line: GradedLine, scales: Array) -> dict[int, _PackedIntegrals]:
    """Return a line's integrals (m2, no unit) with Gaussians of the given `scales` (1/m), by parity (1, -1)."""
    folded = {}
    for parity, integrals in line.integrals(scales).items():
        upper = np.triu_indices(integrals.mass.shape[1])
        which = np.zeros(integrals.mass.shape[1:], dtype=np.intp)
        which[upper] = which.T[upper] = np.arange(upper[0].size)
        mass, slope = (np.concatenate([part, gram[None]])[:, *upper] for part, gram in
                       zip((integrals.mass, integrals.slope), line.grams(parity), strict=True))
        folded[parity] = _PackedIntegrals(mass, slope, integrals.end, which)
    return folded


def _inductance(
    lines: Sequence[GradedLine], parity: Parity, gaussians: GaussianSum, folded: Sequence[_PackedIntegrals],
    numbers: Sequence[Index], selection: Flags,
) -> Array:
    """Return the inductance matrix (n, n; H) of the functions in use, for one parity along x, y and z.

    `folded` are the integrals along the three lines. `numbers` and `selection` are explained at `BoxFunctions`
    (`numbers`, `kept`).

    Notes
    -----
    Neumann's integral of n x grad psi, with 1/R as a `GaussianSum`: for every Gaussian it is a product of one-
    dimensional integrals. Derived here.
    """
    place = np.where(selection, np.cumsum(selection) - 1, -1)
    count = int(np.count_nonzero(selection))
    inductance = np.zeros((count, count))
    for across in range(3):
        # the two faces normal to an axis, each with itself and with the other (m; times mu0 / (4 pi): H)
        first, second = ACROSS[across]
        row_terms, column_terms = folded[first], folded[second]
        other = np.exp(-((2.0 * lines[across].half * gaussians.scales) ** 2))
        weights = 2.0 * np.append(gaussians.weights * (1.0 - parity[across] * other), gaussians.tail)[:, None]
        products = (weights * row_terms.mass).T @ column_terms.slope + (weights * row_terms.slope).T @ column_terms.mass
        at, (i, j) = _functions_in_use(place[numbers[across]])
        inductance[np.ix_(at, at)] += products[row_terms.which[i[:, None], i], column_terms.which[j[:, None], j]]
        ends = gaussians.weights[:, None] * column_terms.end
        end_products = (ends[:, :, None] * row_terms.end[:, None]).reshape(len(ends), -1)
        # couplings of faces at right angles to each other
        between = -4.0 * folded[across].mass[:-1].T @ end_products
        rows, (i, b) = _functions_in_use(place[_numbers_with_first_axis(numbers[first], across, first)])
        columns, (j, a) = _functions_in_use(place[_numbers_with_first_axis(numbers[second], across, second)])
        block = between[folded[across].which[i[:, None], j], b[:, None] * row_terms.end.shape[1] + a]
        inductance[np.ix_(rows, columns)] += block
        inductance[np.ix_(columns, rows)] += block.T
    if parity == (1, 1, 1):
        inductance = definite_inductance(inductance, -1)
    return MU0 / (4.0 * math.pi) * inductance


def _functions_in_use(places: Index) -> tuple[Index, tuple[Index, ...]]:
    """Return the rows (no unit) of a face's functions in the inductance matrix, and their numbers along both edges.

    `places` (functions along a, along b) are these rows, -1 for functions not in use.
    """
    at = np.nonzero(places >= 0)
    return places[at], at


def box(
    size: tuple[float, float, float], first: float, widest: float, counts: tuple[int, int, int], finer: int = FINER
) -> Box:
    """Return a box with its spline mesh.

    Parameters
    ----------
    size : tuple[float, float, float]
        lengths along x, y and z (m)
    first, widest : float
        distances of the spline knots at the edges and in the middle of the faces (m)
    counts : tuple[int, int, int]
        numbers of field points along x, y and z
    finer : int, optional
        number of nodes per knot (see `graded_line`)
    """
    through = min(first, 0.22 * size[THICKNESS]), max(0.25 * size[THICKNESS], first)
    steps = (first, widest), (first, widest), through
    lines = tuple(graded_line(0.5 * length, *step, finer) for length, step in zip(size, steps, strict=True))
    return Box(lines, counts, SHORTEST / widest)


SHORTEST = 3.0
"""Largest wave number of functions along both edges of a face, multiplied by the knot distance in the face's middle.

Without this limit, changes of L differ by at most 2e-4 (ratio), losses by 4e-4.
"""


def _numbers_with_first_axis(numbers: Index, first: int, across: int) -> Index:
    """Return a face's function numbers with axis `first` as the first dimension, for the face normal to `across`."""
    return numbers if ACROSS[across][0] == first else numbers.T


def _project_on_functions(field: Array, along_a: Array, along_b: Array) -> Array:
    """Return a field's integrals (functions along a, along b, ...) from its values at points (along a, along b, ...).

    `along_a` and `along_b` (functions, points) are quadrature matrices. Two matrix products are faster here than
    einsum, whose search for a path costs more than the few fields of a pose.
    """
    half = along_a @ field.reshape(field.shape[0], -1)
    return along_b @ half.reshape(len(along_a), *field.shape[1:])

