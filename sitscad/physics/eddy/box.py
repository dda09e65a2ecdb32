"""Eddy currents on a box: rectangular targets, side walls and edges included.

Stream functions are products of splines along two edges, continuous over the box's edges; its three mirror planes part
them into eight classes. The inductance of two of them is the sum over Gaussians of products of one-dimensional
integrals (`GaussianSum`), so the double integrals over the surface cost no more than matrix products and have no
singular points.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from sitscad.arrays import Array, Flags, Index
from sitscad.physics.constants import MU0
from sitscad.physics.eddy.body import Body, box_body, on_surface
from sitscad.physics.eddy.graded_line import (
    FINER,
    PARITIES,
    GaussianSum,
    GradedLine,
    LineIntegrals,
    LineModes,
    gaussian_sum,
    graded_line,
)
from sitscad.physics.eddy.surface import Outside, made_definite, outside
from sitscad.physics.special_functions import gauss
from sitscad.record import record

Parity = tuple[int, int, int]
Parted = tuple[Parity, Array, tuple[Index, ...], Flags]

ACROSS = ((1, 2), (0, 2), (0, 1))
"""The two axes along a face, by the axis across it."""

TURN = (1.0, -1.0, 1.0)
"""Sign of n x grad psi along those axes: -dpsi/db along a and dpsi/da along b, the other way on faces across y."""

THICKNESS = 2


@record(eq=False)
class BoxClass:
    """Currents (A) of one parity along x, y and z, of all functions those that are `kept`. `numbers` say which function
    one of a face is, (functions along a, along b) by the axis across the face; `inductance` is in H; `projections` by
    axis (see `GradedLine.projections`).
    """

    parity: Parity
    lines: tuple[GradedLine, ...]
    inductance: Array
    numbers: tuple[Index, ...]
    kept: Flags
    projections: tuple[tuple[Array, Array], ...]

    @property
    def in_plane(self) -> tuple[int, int]:
        """The class's parities along x and y, no unit."""
        return self.parity[:2]

    def drive(self, potential: Array) -> Array:
        """Flux linkages (Wb): see `CurrentClass`."""
        found = np.zeros((self.kept.size, potential.shape[-1]))
        for across, (a, b) in enumerate(ACROSS):
            both = self._face(potential, across)
            field = both[0] - self.parity[across] * both[1]
            (fa, da), (fb, db) = self.projections[a], self.projections[b]
            along_a, along_b = _projected(field[:, :, a], fa, db), _projected(field[:, :, b], da, fb)
            linked = TURN[across] * (along_b - along_a)
            found[self.numbers[across].ravel()] += linked.reshape(-1, potential.shape[-1])  # each once in a face
        return found[self.kept]

    def spread(self, functions: Array) -> Array:
        """What linkages make of potentials (m), and currents (A m): see `CurrentClass`."""
        pieces, whole = [], np.zeros((self.kept.size, functions.shape[1]))
        whole[self.kept] = functions
        for across, (a, b) in enumerate(ACROSS):
            (fa, da), (fb, db) = self.projections[a], self.projections[b]
            amount = TURN[across] * whole[self.numbers[across]]
            found = np.zeros((2, fa.shape[1], fb.shape[1], 3, functions.shape[1]))
            found[0, :, :, a] = -_projected(amount, fa.T, db.T)
            found[0, :, :, b] = _projected(amount, da.T, fb.T)
            found[1] = -self.parity[across] * found[0]
            pieces.append(found.reshape(-1, 3, functions.shape[1]))
        return np.concatenate(pieces)

    def _face(self, potential: Array, across: int) -> Array:
        """Both faces' potentials across an axis: (2, points along a, along b, 3, fields; Wb/m)."""
        counts = [self.projections[axis][0].shape[1] for axis in range(3)]
        sizes = [2 * counts[a] * counts[b] for a, b in ACROSS]
        a, b = ACROSS[across]
        start = sum(sizes[:across])
        return potential[start : start + sizes[across]].reshape(2, counts[a], counts[b], *potential.shape[1:])

    @cached_property
    def body(self) -> Body:
        """What the box does within: see `CurrentClass`."""
        return box_body(_modes(self.lines, self.parity), self.kept)

    @cached_property
    def outside(self) -> Outside:
        """What they store outside: see `CurrentClass`."""
        return outside(self.inductance, MU0 * self.body.vacuum)


@record(eq=False)
class Box:
    """A box about its middle, how many points fields are taken at along x, y and z, and the wave number (1/m) beyond
    which currents need not go along two edges at once: only at edges do they change faster, and along these no more.
    """

    lines: tuple[GradedLine, ...]
    counts: tuple[int, int, int]
    shortest: float

    @cached_property
    def points(self) -> Array:
        """Points (m) of the faces across x, y and z, the upper one of each first: see `Surface`."""
        places = [line.half * gauss(count)[0] for line, count in zip(self.lines, self.counts, strict=True)]
        pieces = []
        for across, (a, b) in enumerate(ACROSS):
            for side in (1.0, -1.0):
                found = np.empty((self.counts[a], self.counts[b], 3))
                found[..., a], found[..., b] = places[a][:, None], places[b]
                found[..., across] = side * self.lines[across].half
                pieces.append(found.reshape(-1, 3))
        return np.concatenate(pieces)

    @cached_property
    def mirrored(self) -> tuple[Index, Index]:
        """Numbers (points,; no unit) of the points mirrored across x = 0 and y = 0: see `Surface`."""
        pieces: tuple[list[Index], list[Index]] = [], []
        start = 0
        for across, (a, b) in enumerate(ACROSS):
            face = start + np.arange(2 * self.counts[a] * self.counts[b]).reshape(2, self.counts[a], self.counts[b])
            for axis, found in enumerate(pieces):
                turned = 0 if axis == across else 1 if axis == a else 2
                found.append(np.flip(face, turned).ravel())
            start += face.size
        return np.concatenate(pieces[0]), np.concatenate(pieces[1])

    @cached_property
    def classes(self) -> tuple[BoxClass, ...]:
        """The eight parities, with inductances in H: see `Surface`."""
        sizes = zip(self.lines, self.counts, strict=True)
        known = [{parity: line.projections(parity, count) for parity in PARITIES} for line, count in sizes]
        return tuple(
            BoxClass(parity, self.lines, inductance, numbers, kept, tuple(known[k][parity[k]] for k in range(3)))
            for parity, inductance, numbers, kept in _inductances(self.lines, self.shortest)
        )


@lru_cache(maxsize=1)
def _inductances(lines: tuple[GradedLine, ...], shortest: float) -> tuple[Parted, ...]:
    """The inductance matrix (n, n; H per unit functions) of every parity, and what a `BoxClass` has of its functions,
    waves up to a number (1/m) along two edges.
    """
    reach = 2.0 * math.hypot(*(line.half for line in lines))
    finest = min(float(line.steps.min()) for line in lines)
    gaussians = gaussian_sum(0.25 * finest, reach)
    distinct = {line: line.integrals(gaussians.scales) for line in dict.fromkeys(lines)}
    integrals = [distinct[line] for line in lines]
    parities = product(PARITIES, PARITIES, PARITIES)
    return tuple(_of_parity(lines, parity, gaussians, integrals, shortest) for parity in parities)


def _of_parity(
    lines: Sequence[GradedLine], parity: Parity, gaussians: GaussianSum,
    integrals: Sequence[Mapping[int, LineIntegrals]], shortest: float,
) -> Parted:
    """One class of parity: its inductance matrix (n, n; H per unit functions), numbers, and which functions it keeps,
    by the `shortest` waves (1/m) along two edges. Derived here: Neumann's integral of n x grad psi with 1/R as
    `GaussianSum`, which is a product of one-dimensional integrals for every Gaussian.
    """
    own = [integrals[axis][parity[axis]] for axis in range(3)]
    modes = _modes(lines, parity)
    number = on_surface(modes)
    numbers = number[-1], number[:, -1], number[:, :, -1]
    x, y, z = np.meshgrid(*(np.append(one.squares > shortest**2, False) for one in modes), indexing="ij")
    kept = ~(x & y | y & z | z & x)[number >= 0]
    inductance = np.zeros((kept.size, kept.size))
    for across in range(3):
        members = numbers[across].ravel()
        # The two faces across an axis, each with itself and with the other (m; times mu0 / (4 pi) H).
        a, b = ACROSS[across]
        other = np.exp(-((2.0 * lines[across].half * gaussians.scales) ** 2))
        weights = 2.0 * gaussians.weights * (1.0 - parity[across] * other)
        found = _summed(weights, own[a].mass, own[b].slope) + _summed(weights, own[a].slope, own[b].mass)
        (mass_a, slope_a), (mass_b, slope_b) = (lines[axis].grams(parity[axis]) for axis in (a, b))
        nearest = np.kron(mass_a, slope_b) + np.kron(slope_a, mass_b)
        inductance[np.ix_(members, members)] += np.asarray(found + 2.0 * gaussians.tail * nearest)
        first, second = ACROSS[across]
        ends = gaussians.weights[:, None] * own[second].end
        between = -4.0 * np.einsum("qij,qb,qa->ibja", own[across].mass, ends, own[first].end, optimize=True)
        rows = _with_axis(numbers[first], across, first).ravel()
        columns = _with_axis(numbers[second], across, second).ravel()
        block = between.reshape(rows.size, columns.size)
        inductance[np.ix_(rows, columns)] += block
        inductance[np.ix_(columns, rows)] += block.T
    if parity == (1, 1, 1):
        inductance = made_definite(inductance, -1)
    return parity, MU0 / (4.0 * math.pi) * inductance[np.ix_(kept, kept)], numbers, kept


def box(
    size: tuple[float, float, float], first: float, widest: float, counts: tuple[int, int, int], finer: int = FINER
) -> Box:
    """A box of that size along x, y and z (m), knots `first` apart at edges and `widest` in faces (m), and how many
    points fields are taken at along its edges; `finer` as in `graded_line`.
    """
    through = min(first, 0.22 * size[THICKNESS]), max(0.25 * size[THICKNESS], first)
    steps = (first, widest), (first, widest), through
    lines = tuple(graded_line(0.5 * length, *step, finer) for length, step in zip(size, steps, strict=True))
    return Box(lines, counts, SHORTEST / widest)


SHORTEST = 3.0
"""Wave number of currents along both edges of a face, over one by the distance of knots in its middle: with all of them
changes of L differ by 2e-4 of themselves at most, losses by 4e-4."""


def _modes(lines: Sequence[GradedLine], parity: Parity) -> list[LineModes]:
    """What the functions of a parity are to each other along x, y and z (1/m2, m, 1/m)."""
    return [line.modes[one] for line, one in zip(lines, parity, strict=True)]


def _with_axis(numbers: Index, first: int, across: int) -> Index:
    """A face's numbers with that axis first."""
    return numbers if ACROSS[across][0] == first else numbers.T


def _projected(field: Array, along_a: Array, along_b: Array) -> Array:
    """A field's integrals (functions along a, along b, ...) from its values at points (along a, along b, ...): of a
    pose's few fields einsum would take longer to find its way than to go it.
    """
    half = along_a @ field.reshape(field.shape[0], -1)
    return along_b @ half.reshape(len(along_a), *field.shape[1:])


def _summed(weights: Array, one: Array, other: Array) -> Array:
    """Sum over Gaussians of Kronecker products (n m, n m), in the weights' unit times both tables'."""
    n, m = one.shape[1], other.shape[1]
    flat = (weights[:, None] * one.reshape(len(one), -1)).T @ other.reshape(len(other), -1)
    return flat.reshape(n, n, m, m).transpose(0, 2, 1, 3).reshape(n * m, n * m)
