"""Eddy currents on a disc: round targets, side wall and edges included.

Stream functions are cos(m phi) or sin(m phi) times splines along the meridian, from the axis over the edge down the
wall; orders m, cosine and sine, and both parities across the disc stand alone. Their inductances are integrals over the
meridian with the circles' mean of cos(n phi) / distance, whose logarithm is integrated by itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.body import BodyEnergies, disc_body
from sitscad.kernels.electromagnetics.eddy.graded_line import (
    FINER,
    PARITIES,
    GradedLine,
    LineModes,
    graded_line,
    interpolation,
    line_modes,
)
from sitscad.kernels.electromagnetics.eddy.surface import Energies, energies, made_definite
from sitscad.kernels.electromagnetics.special_functions import gauss

STABLE, BEYOND = 0.3, 21.0
"""Argument's acosh up to which the recursion is stable upwards; orders beyond the highest from which it starts
downwards, times the argument's acosh (Gil and Segura, Comput. Phys. Commun. 124, 2000)."""

BANDS = (STABLE, 2.0 * STABLE, 4.0 * STABLE, 8.0 * STABLE, math.inf)
"""Bands of the argument's acosh for which it starts at one order."""


def toroidal(excess: Array, order: int) -> Array:
    """Q_(n - 1/2)(1 + excess), a Legendre function of the second kind, for n = 0 to `order`, first axis, no unit;
    `excess` (> 0) of any shape. The integral of cos(n phi) / distance over phi is 2 Q / sqrt(r1 r2) for circles of
    radii r1 and r2, 1 + excess being (r1^2 + r2^2 + z^2) / (2 r1 r2) (Cohl and Tohline, Astrophysical Journal 527,
    1999); recursion after Gil and Segura (2000).
    """
    x = excess.ravel()
    first, elliptic_e = _elliptic(np.sqrt(x / (x + 2.0)))
    modulus = np.sqrt(2.0 / (x + 2.0))
    lowest, next_one = modulus * first, (1.0 + x) * modulus * first - 2.0 / modulus * elliptic_e
    found = np.empty((order + 1, x.size))
    steepness = np.arccosh(1.0 + x)
    near = steepness < STABLE
    argument, rising = 1.0 + x[near], np.empty((order + 2, np.count_nonzero(near)))
    rising[0], rising[1] = lowest[near], next_one[near]
    for n in range(1, order + 1):
        np.multiply(argument, rising[n], out=rising[n + 1])
        rising[n + 1] *= 2 * n / (n + 0.5)
        rising[n + 1] -= (n - 0.5) / (n + 0.5) * rising[n - 1]
    found[:, near] = rising[: order + 1]
    # by ratios of one order to the one below, from far beyond: no number grows too large
    for low, high in pairwise(BANDS):
        some = np.flatnonzero((steepness >= low) & (steepness < high))
        argument, ratios = 1.0 + x[some], np.empty((order + 1, some.size))
        ratio = np.zeros_like(argument)
        for n in range(order + math.ceil(BEYOND / low), 0, -1):
            ratio *= -(n + 0.5)
            ratio += 2 * n * argument
            np.divide(n - 0.5, ratio, out=ratio)
            if n <= order:
                ratios[n] = ratio
        ratios[0] = lowest[some]
        found[:, some] = np.cumprod(ratios, axis=0)
    return found.reshape(order + 1, *excess.shape)


def _elliptic(complement: Array) -> tuple[Array, Array]:
    """K and E, no unit, by the arithmetic-geometric mean of 1 and the complementary modulus (Abramowitz and Stegun
    17.6).
    """
    a, b = np.ones_like(complement), complement
    total, weight = 0.5 * (1.0 - complement**2), 1.0
    for _ in range(8):
        difference = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        total += weight * difference * difference
        weight *= 2.0
        if np.abs(difference).max(initial=0.0) < 1e-9:
            break  # its square is nothing, and so is what is left
    first = 0.5 * np.pi / a
    return first, first * (1.0 - total)


POINTS = 3
"""Gauss points of a piece of the meridian."""

NEAR = 2.5
"""Distance, in lengths of a piece, up to which the logarithm is integrated by itself."""

COINCIDENT = 1e-3
"""Distance, in lengths of a piece, at which a point is taken to see itself."""


@record(eq=False)
class Meridian:
    """The upper half of a disc's outline from the axis to the edge and down to the middle plane, as Gauss points.
    `places` (n, 2) are radius and height (m), `weights` lengths (m), `on_face` tells the face's points from the wall's;
    `starts` and `ends` (pieces, 2) are those of its straight pieces.
    """

    starts: Array
    ends: Array
    places: Array
    weights: Array
    on_face: Flags

    @property
    def lengths(self) -> Array:
        """Lengths of the pieces (m)."""
        return np.asarray(np.hypot(*(self.ends - self.starts).T))


@record(eq=False)
class DiscFunctions:
    """Stream functions of one order m and one parity across the disc, cos(m phi) or sin(m phi) times those along the
    meridian: `values` and `slopes` (points of the meridian, n).
    """

    order: int
    parity: int
    disc: Disc
    inductance: Array
    values: Array
    slopes: Array

    @cached_property
    def projections(self) -> tuple[Array, Array, Array, Array]:
        """What a potential drives along circles and radii of a face, circles and heights of the wall: (its points along
        the meridian, n; m). Derived here from the current n x grad psi of a stream function psi.
        """
        disc, shape = self.disc, self.disc.meridian
        on_face = shape.on_face
        radius, weight = shape.places[on_face, 0], shape.weights[on_face]
        to_face, up, down = disc.resolved
        round_face = to_face.T @ (self.slopes[on_face] * (weight * radius)[:, None])
        out_face = to_face.T @ (self.values[on_face] * (self.order * weight)[:, None])
        weight = shape.weights[~on_face]
        slopes, values = self.slopes[~on_face] * weight[:, None], self.values[~on_face] * weight[:, None]
        round_wall = disc.face.half * (up.T @ slopes - self.parity * (down.T @ slopes))
        up_wall = -self.order * (up.T @ values + self.parity * (down.T @ values))
        return round_face, out_face, round_wall, up_wall

    @cached_property
    def body(self) -> BodyEnergies:
        """Energies (m) of the functions as potentials on the disc: see `StreamFunctions`."""
        radial, around = self.disc.radials[self.order], 2.0 * math.pi if self.order == 0 else math.pi
        return disc_body(radial.modes, radial.turning, self.disc.wall.modes[self.parity], around)

    @cached_property
    def energies(self) -> Energies:
        """Energies within the body and outside: see `StreamFunctions`."""
        return energies(self.inductance, self.body)


@record(eq=False)
class DiscClass:
    """Currents of one order, one parity across the disc, and one phase: "cos" or "sin"."""

    functions: DiscFunctions
    phase: str

    @property
    def in_plane(self) -> tuple[int, str]:
        """The class's order and phase round the axis, no unit."""
        return self.functions.order, self.phase

    def drive(self, potential: Array) -> Array:
        """Flux linkages (Wb): see `CurrentClass`."""
        count, fields = self.functions.disc.counts[0], potential.shape[-1]
        rings = potential.reshape(-1, 3 * self.functions.disc.angles.size, fields)
        faces = rings[:count] - self.functions.parity * rings[count : 2 * count]
        round_face, out_face, round_wall, up_wall = self.functions.projections
        on_face, on_wall = self._waves
        along, out = (on_face @ faces).swapaxes(0, 1)
        round_it, up = (on_wall @ rings[2 * count :]).swapaxes(0, 1)
        return np.asarray(round_face.T @ along + out_face.T @ out + round_wall.T @ round_it + up_wall.T @ up)

    def spread(self, functions: Array) -> Array:
        """What linkages make of potentials (m), and currents (A m): see `CurrentClass`."""
        along, out, round_it, up = (one @ functions for one in self.functions.projections)
        on_face, on_wall = self._waves
        face = on_face[0, :, None] * along[:, None] + on_face[1, :, None] * out[:, None]
        wall = on_wall[0, :, None] * round_it[:, None] + on_wall[1, :, None] * up[:, None]
        return np.concatenate([face, -self.functions.parity * face, wall]).reshape(-1, 3, functions.shape[1])

    @cached_property
    def _waves(self) -> tuple[Array, Array]:
        """What potentials at the points of a circle count for, along it and out of a face, along it and up the wall:
        (2, points times 3; no unit).
        """
        order, angle = self.functions.order, self.functions.disc.angles
        wave, turned = np.cos(order * angle), np.sin(order * angle)
        if self.phase == "sin":
            wave, turned = turned, -wave
        none, step = np.zeros_like(angle), 2.0 * math.pi / angle.size
        around = wave[:, None] * np.stack([-np.sin(angle), np.cos(angle), none], axis=1)
        outwards = turned[:, None] * np.stack([np.cos(angle), np.sin(angle), none], axis=1)
        upwards = np.stack([none, none, turned], axis=1)
        return (step * np.stack([around.ravel(), outwards.ravel()]), step * np.stack([around.ravel(), upwards.ravel()]))


@record(eq=False)
class Radial:
    """Functions of one order along the radius, by their values at the nodes (no unit); `modes` are what they are to
    each other, masses and stiffnesses over radius times its step, and `turning` what `disc_body` calls so.
    """

    values: Array
    modes: LineModes
    turning: tuple[Array, Array]


@record(eq=False)
class Disc:
    """A disc about its middle: half lines of face and wall, how many points fields are taken at along the radius and
    the height, and the highest order of cos(m phi).
    """

    face: GradedLine
    wall: GradedLine
    counts: tuple[int, int]
    orders: int

    @property
    def mirrored(self) -> None:
        """None, no unit: it has no such planes, for orders and phases part its currents farther than those do (see
        `Surface`).
        """
        return None

    @cached_property
    def angles(self) -> Array:
        """Azimuths (rad) at which fields are taken."""
        count = 2 * self.orders + 2
        return np.asarray(2.0 * math.pi / count * np.arange(count))

    @cached_property
    def points(self) -> Array:
        """Points (m) of the upper face, the lower face and the wall: see `Surface`."""
        radius = 0.5 * self.face.half * (1.0 + gauss(self.counts[0])[0])
        height = self.wall.half * gauss(self.counts[1])[0]
        cosine, sine = np.cos(self.angles), np.sin(self.angles)
        pieces = [_circles(radius, np.full_like(radius, z), cosine, sine) for z in (self.wall.half, -self.wall.half)]
        return np.concatenate([*pieces, _circles(np.full_like(height, self.face.half), height, cosine, sine)])

    @cached_property
    def resolved(self) -> tuple[Array, Array, Array]:
        """What takes fields at the points along a radius to the meridian's on the face, and those along the height to
        the wall's and to what is mirrored below: (points of the meridian, points), no unit.
        """
        on_face, places = self.meridian.on_face, self.meridian.places
        height = places[~on_face, 1] / self.wall.half
        to_face = interpolation(self.counts[0], 2.0 * places[on_face, 0] / self.face.half - 1.0)
        return to_face, interpolation(self.counts[1], height), interpolation(self.counts[1], -height)

    @cached_property
    def meridian(self) -> Meridian:
        """The disc's outline (m)."""
        # Gauss points of half the disc's section, from the axis over the face down the wall
        radii, heights = self.face.nodes[self.face.nodes.size // 2 :], self.wall.nodes[self.wall.nodes.size // 2 :]
        top = np.stack([radii, np.full_like(radii, self.wall.half)], axis=1)
        side = np.stack([np.full_like(heights, self.face.half), heights], axis=1)[::-1]
        corners = np.concatenate([top, side[1:]])
        at, share = gauss(POINTS)
        starts, ends = corners[:-1], corners[1:]
        places = (starts[:, None] + 0.5 * (1.0 + at)[:, None] * (ends - starts)[:, None]).reshape(-1, 2)
        lengths = np.hypot(*(ends - starts).T)
        on_face = np.repeat(np.arange(len(starts)) < radii.size - 1, POINTS)
        return Meridian(starts, ends, places, (0.5 * lengths[:, None] * share).ravel(), on_face)

    @cached_property
    def classes(self) -> tuple[DiscClass, ...]:
        """Orders, parities and phases, with inductances in H: see `Surface`."""
        same, other = (_kernel(self.meridian, side, self.orders + 1) for side in (1.0, -1.0))
        kernels = {parity: same - parity * other for parity in PARITIES}
        found = []
        for order in range(self.orders + 1):
            for parity in PARITIES:
                values, slopes = self._functions(order, parity)
                inductance = self._inductance(order, parity, kernels, values, slopes)
                functions = DiscFunctions(order, parity, self, inductance, values, slopes)
                found += [DiscClass(functions, phase) for phase in (("cos", "sin") if order else ("cos",))]
        return tuple(found)

    @cached_property
    def radials(self) -> tuple[Radial, ...]:
        """Functions of every order along the radius (m; no unit): near the axis they go like rho^m, or rho^2 and rho^3
        beyond that.
        """
        middle, found = self.face.nodes.size // 2, []
        radii = self.face.nodes[middle:]
        for order in range(self.orders + 1):
            values = self.face.values[1 if order == 0 else -1][middle:]
            if order > 1:
                values = values * (radii[:, None] / self.face.half) ** (1 + order % 2)
            found.append(_radial(radii, values, order))
        return tuple(found)

    def _functions(self, order: int, parity: int) -> tuple[Array, Array]:
        """Values (no unit) and slopes (1/m) along the meridian at its points."""
        face = self.radials[order].values
        wall = self.wall.values[parity][self.wall.nodes.size // 2 :][::-1]
        joined = face.shape[1] - 1
        nodes = np.zeros((len(face) + len(wall) - 1, joined + wall.shape[1]))
        nodes[: len(face), : joined + 1] = face
        nodes[len(face) :, joined] = wall[1:, -1]
        nodes[len(face) :, joined + 1 :] = wall[1:, :-1]
        at = 0.5 * (1.0 + gauss(POINTS)[0])[:, None]
        values = (nodes[:-1, None] * (1.0 - at) + nodes[1:, None] * at).reshape(-1, nodes.shape[1])
        slopes = np.diff(nodes, axis=0) / self.meridian.lengths[:, None]
        return values, np.repeat(slopes, POINTS, axis=0)

    def _inductance(
        self, order: int, parity: int, kernels: Mapping[int, Array], values: Array, slopes: Array
    ) -> Array:
        """Inductance (n, n; H) of one order and parity: Neumann's integral, with the kernels (m) of currents along the
        disc that are even and odd across it. Currents along x +- i y have the orders m +- 1 (derived here).
        """
        radius, on_face = self.meridian.places[:, 0][:, None], self.meridian.on_face[:, None]
        wall, out = ~self.meridian.on_face, np.where(on_face, order * values, 0.0)
        up, walls = order * values[wall], np.ix_(wall, wall)
        # cos(m phi) round the axis and sin(m phi) outwards are waves of m + 1 and m - 1 along x +- i y
        more, less = slopes * radius - out, slopes * radius + out
        total = up.T @ kernels[-parity][order][walls] @ up
        for current, turned in ((more, order + 1), (less, abs(order - 1))):
            total = total + 0.5 * current.T @ (kernels[parity][turned] @ current)
        around = 2.0 * math.pi if order == 0 else math.pi
        found = MU0 / (4.0 * math.pi) * 2.0 * around * 0.5 * (total + total.T)
        return made_definite(found, self.face.values[1].shape[1] - 1) if (order, parity) == (0, 1) else found


def _radial(radii: Array, nodes: Array, order: int) -> Radial:
    """Functions (no unit) of an order m by their values at radii (m): integrals over radius times its step of products
    of functions and of gradients, (d/d rho)^2 + m^2 / rho^2 (textbook).
    """
    at, share = gauss(4)
    steps = np.diff(radii)
    rho = radii[:-1, None] + 0.5 * steps[:, None] * (1.0 + at)
    weight = 0.5 * steps[:, None] * share * rho
    part = (0.5 * (1.0 + at))[:, None]
    values = (nodes[:-1, None] * (1.0 - part) + nodes[1:, None] * part).reshape(-1, nodes.shape[1])
    slopes = np.diff(nodes, axis=0) / steps[:, None]
    mass = (values * weight.reshape(-1, 1)).T @ values
    turning = (values * (weight * (order / rho) ** 2).reshape(-1, 1)).T @ values
    stiffness = (slopes * weight.sum(axis=1)[:, None]).T @ slopes + turning
    turned, modes = line_modes(mass, stiffness)
    if order == 0:
        return Radial(nodes @ turned, modes, (np.zeros(0), np.zeros(0)))
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, free = np.linalg.eigh(root @ stiffness @ root.T)
    return Radial(nodes @ turned, modes, (squares, (order * (root.T @ free)[-1]) ** 2 / squares))


def disc(
    diameter: float, thickness: float, first: float, widest: float, counts: tuple[int, int], orders: int,
    finer: int = FINER,
) -> Disc:
    """A disc of that diameter and thickness (m); see `box` and `Disc`."""
    face = graded_line(0.5 * diameter, first, widest, finer)
    wall = graded_line(0.5 * thickness, min(first, 0.22 * thickness), max(0.25 * thickness, first), finer)
    return Disc(face, wall, counts, orders)


def _circles(radius: Array, height: Array, cosine: Array, sine: Array) -> Array:
    """Points (circles times azimuths, 3; m) on circles of radii and heights (n; m)."""
    found = np.empty((radius.size, cosine.size, 3))
    found[..., 0], found[..., 1] = radius[:, None] * cosine, radius[:, None] * sine
    found[..., 2] = height[:, None]
    return found.reshape(-1, 3)


def _kernel(shape: Meridian, side: float, orders: int) -> Array:
    """Integrals (orders + 1, points, points; m) of cos(n phi) / distance for every pair of points, with both weights:
    `toroidal`. `side` -1 sees the mirror image below the middle plane. Near pieces: what is left of the integrand
    without the logarithm of the distance, and that in closed form or by graded points (derived here).
    """
    image = np.array([1.0, side])
    places, weights = shape.places, shape.weights
    # of every two points once
    one, two = np.triu_indices(len(places))
    square = np.sum((places[one] - places[two] * image) ** 2, axis=1)
    if side > 0.0:
        square[one == two] = np.repeat((COINCIDENT * shape.lengths) ** 2, POINTS)
    mean = np.sqrt(places[one, 0] * places[two, 0])
    means = toroidal(0.5 * square / mean**2, orders)
    means *= 2.0 / mean * weights[one] * weights[two]
    which = np.empty((len(places), len(places)), dtype=np.intp)
    which[one, two] = which[two, one] = np.arange(one.size)
    found = np.take(means, which, axis=1)
    starts, ends = shape.starts * image, shape.ends * image
    middle = 0.5 * (starts + ends)
    near = np.hypot(places[:, None, 0] - middle[:, 0], places[:, None, 1] - middle[:, 1]) < NEAR * shape.lengths
    point, piece = np.nonzero(near)
    columns = POINTS * piece[:, None] + np.arange(POINTS)
    rows = np.broadcast_to(point[:, None], columns.shape)
    away = places[rows] - places[columns] * image
    coincident = (COINCIDENT * shape.lengths[piece, None]) ** 2
    square = np.where((rows == columns) & (side > 0.0), coincident, np.sum(away**2, axis=2))
    logarithm = shape.lengths[piece, None] * _log_weights(places[point], starts[piece], ends[piece])
    rest = 0.5 * np.log(square) * weights[columns] - logarithm
    found[:, rows, columns] += 2.0 / np.sqrt(places[rows, 0] * places[columns, 0]) * weights[rows] * rest
    return found


def _log_weights(points: Array, starts: Array, ends: Array) -> Array:
    """Weights (n, POINTS; no unit) of a function's values at a piece's Gauss points in its integral with ln(distance
    from a point), the piece's length being 1: by points graded like x^4 about the nearest place.
    """
    along = ends - starts
    nearest = np.clip(np.einsum("nc,nc->n", points - starts, along) / np.einsum("nc,nc->n", along, along), 0.0, 1.0)
    at, share = gauss(16)
    grade = 0.5 * (1.0 + at)
    found = np.zeros((len(points), POINTS))
    for end in (0.0, 1.0):
        span = (end - nearest)[:, None]
        x = nearest[:, None] + span * grade**4
        away = starts[:, None] + x[..., None] * along[:, None] - points[:, None]
        distance = np.maximum(np.hypot(away[..., 0], away[..., 1]), 1e-300)
        weight = np.log(distance) * np.abs(span) * 2.0 * share * grade**3
        through = interpolation(POINTS, (2.0 * x - 1.0).ravel()).reshape(*x.shape, POINTS)
        found += np.einsum("nq,nqk->nk", weight, through)
    return found
