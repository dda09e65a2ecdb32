"""Eddy currents on a disc: round targets with side wall and edges.

Stream functions are cos(m phi) or sin(m phi) times splines along the meridian. The meridian is half of the outline:
from the axis over the face to the edge, then down the wall. Orders m, cosine and sine, and both parities across the
middle plane are independent. Inductances are integrals over the meridian of the mean of cos(n phi) / distance between
two circles. The logarithmic singularity of this mean is integrated separately.
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
from sitscad.kernels.electromagnetics.eddy.surface import Energies, definite_inductance, energies
from sitscad.kernels.electromagnetics.special_functions import gauss

STABLE = 0.3
"""Value of acosh(x) below which the recursion of Q_(n-1/2)(x) from low to high orders n is stable."""

BEYOND = 21.0
"""Product of acosh(x) and the number of extra orders above the highest, at which the downward recursion starts.

Source: Gil and Segura, Comput. Phys. Commun. 124, 2000.
"""

BANDS = (STABLE, 2.0 * STABLE, 4.0 * STABLE, 8.0 * STABLE, math.inf)
"""Limits (no unit) of ranges of acosh(x). In each range, the downward recursion starts at one order for all x."""


def toroidal(excess: Array, order: int) -> Array:
    """Return Q_(n - 1/2)(1 + excess), a Legendre function of the second kind (no unit), for n = 0 to `order`.

    Parameters
    ----------
    excess : array
        argument minus 1, positive, any shape
    order : int
        highest n

    Returns
    -------
    array
        (order + 1, shape of `excess`)

    Notes
    -----
    The integral of cos(n phi) / distance over phi is 2 Q / sqrt(r1 r2) for circles of radii r1 and r2 at axial distance
    z. The argument is 1 + excess = (r1^2 + r2^2 + z^2) / (2 r1 r2) (Cohl and Tohline, Astrophysical Journal 527, 1999).
    The recursion is from Gil and Segura (2000).
    """
    x = excess.ravel()
    first, elliptic_e = _elliptic(np.sqrt(x / (x + 2.0)))
    modulus = np.sqrt(2.0 / (x + 2.0))
    lowest, next_one = modulus * first, (1.0 + x) * modulus * first - 2.0 / modulus * elliptic_e
    values = np.empty((order + 1, x.size))
    steepness = np.arccosh(1.0 + x)
    near = steepness < STABLE
    argument, rising = 1.0 + x[near], np.empty((order + 2, np.count_nonzero(near)))
    rising[0], rising[1] = lowest[near], next_one[near]
    for n in range(1, order + 1):
        np.multiply(argument, rising[n], out=rising[n + 1])
        rising[n + 1] *= 2 * n / (n + 0.5)
        rising[n + 1] -= (n - 0.5) / (n + 0.5) * rising[n - 1]
    values[:, near] = rising[: order + 1]
    # downward recursion of the ratios of successive orders, from far above the highest: no overflow
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
        values[:, some] = np.cumprod(ratios, axis=0)
    return values.reshape(order + 1, *excess.shape)


def _elliptic(complement: Array) -> tuple[Array, Array]:
    """Return the complete elliptic integrals K and E (no unit) for complementary moduli `complement`.

    Method: arithmetic-geometric mean of 1 and the complementary modulus (Abramowitz and Stegun 17.6).
    """
    a, b = np.ones_like(complement), complement
    total, weight = 0.5 * (1.0 - complement**2), 1.0
    for _ in range(8):
        difference = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        total += weight * difference * difference
        weight *= 2.0
        if np.abs(difference).max(initial=0.0) < 1e-9:
            break  # the remaining terms are below rounding
    first = 0.5 * np.pi / a
    return first, first * (1.0 - total)


POINTS = 3
"""Number of Gauss points on each straight piece of the meridian."""

NEAR = 2.5
"""Distance of a point from a piece's middle, divided by the piece's length, below which the piece counts as near.

For near pieces, the logarithm in the integrand is integrated separately.
"""

COINCIDENT = 1e-3
"""Distance assumed between a point and itself, divided by the length of its piece of the meridian. It avoids ln 0."""


@record(eq=False)
class Meridian:
    """Upper half of a disc's outline, from the axis to the edge and down to the middle plane, as Gauss points.

    `places` (n, 2; m) are radius and height of the points, and `weights` (n; m) are their quadrature weights. `on_face`
    is true for points of the face and false for points of the wall. `starts` and `ends` (pieces, 2; m) are radius and
    height of the ends of the straight pieces.
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
    """Stream functions of one order m and one parity (1 even, -1 odd) across the middle plane of a disc.

    Each is cos(m phi) or sin(m phi) times a function along the meridian. `values` (no unit) and `slopes` (1/m; both
    (points of the meridian, n)) are the values and derivatives of the n functions. `inductance` (n, n) is in H.
    """

    order: int
    parity: int
    disc: Disc
    inductance: Array
    values: Array
    slopes: Array

    @cached_property
    def projections(self) -> tuple[Array, Array, Array, Array]:
        """Four arrays (points, n; m), one for each component of a vector potential, that give the n flux linkages.

        Each array has the weights of the component's values at the points in the flux linkages of the n functions. The
        components are, in this order: along circles of a face, along radii of a face, along circles of the wall, along
        the height of the wall. Derived here from the surface current e x grad psi of a stream function psi. Here e is
        the unit vector normal to the surface.
        """
        disc, shape = self.disc, self.disc.meridian
        on_face = shape.on_face
        radius, weight = shape.places[on_face, 0], shape.weights[on_face]
        to_face, up, down = disc.meridian_interpolations
        round_face = to_face.T @ (self.slopes[on_face] * (weight * radius)[:, None])
        out_face = to_face.T @ (self.values[on_face] * (self.order * weight)[:, None])
        weight = shape.weights[~on_face]
        slopes, values = self.slopes[~on_face] * weight[:, None], self.values[~on_face] * weight[:, None]
        round_wall = disc.face.half * (up.T @ slopes - self.parity * (down.T @ slopes))
        up_wall = -self.order * (up.T @ values + self.parity * (down.T @ values))
        return round_face, out_face, round_wall, up_wall

    @cached_property
    def body(self) -> BodyEnergies:
        """Energies (m) inside the disc, in vacuum and in metal, of the functions as potentials on its surface."""
        radial, around = self.disc.radials[self.order], 2.0 * math.pi if self.order == 0 else math.pi
        return disc_body(radial.modes, radial.turning, self.disc.wall.modes[self.parity], around)

    @cached_property
    def energies(self) -> Energies:
        """Energy matrices (H, 1/H, no unit) of the stream functions inside and outside the disc."""
        return energies(self.inductance, self.body)


@record(eq=False)
class DiscClass:
    """Eddy currents of a disc with one order m, one parity across the middle plane, and one phase ("cos" or "sin")."""

    functions: DiscFunctions
    phase: str

    @property
    def symmetry_in_plane(self) -> tuple[int, str]:
        """Order m and phase ("cos" or "sin") of the currents round the axis (no unit)."""
        return self.functions.order, self.phase

    def flux_linkages(self, potential: Array) -> Array:
        """Return the flux linkages (n, fields; Wb) of the n functions for a vector potential at the points.

        `potential` (points, 3, fields; Wb/m) holds x, y and z components. There is one field per coil and pose.
        """
        count, fields = self.functions.disc.counts[0], potential.shape[-1]
        rings = potential.reshape(-1, 3 * self.functions.disc.angles.size, fields)
        faces = rings[:count] - self.functions.parity * rings[count : 2 * count]
        round_face, out_face, round_wall, up_wall = self.functions.projections
        on_face, on_wall = self._waves
        azimuthal, out = (on_face @ faces).swapaxes(0, 1)
        round_it, up = (on_wall @ rings[2 * count :]).swapaxes(0, 1)
        return np.asarray(round_face.T @ azimuthal + out_face.T @ out + round_wall.T @ round_it + up_wall.T @ up)

    def potential_weights(self, functions: Array) -> Array:
        """Return the weights (points, 3, m; m) of the potential at points in the flux linkages of m current patterns.

        `functions` (n, m) are the patterns as weights of the n stream functions. A weight is also the current moment (A
        m) at a point that represents the pattern at a distance.
        """
        azimuthal, out, round_it, up = (projection @ functions for projection in self.functions.projections)
        on_face, on_wall = self._waves
        face = on_face[0, :, None] * azimuthal[:, None] + on_face[1, :, None] * out[:, None]
        wall = on_wall[0, :, None] * round_it[:, None] + on_wall[1, :, None] * up[:, None]
        return np.concatenate([face, -self.functions.parity * face, wall]).reshape(-1, 3, functions.shape[1])

    @cached_property
    def _waves(self) -> tuple[Array, Array]:
        """Weights (2, points times 3; no unit) of the potential at the points of a circle, on a face and on the wall.

        Rows for a face: components along the circle and outwards. Rows for the wall: along the circle and upwards.
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
    """Functions along the radius of a disc that are multiplied by cos(m phi), for one order m.

    `values` (nodes, functions; no unit) are their values at the nodes. `modes` are their masses and stiffnesses, as
    integrals over radius times its differential. `turning` is the argument `turning` of `disc_body`.
    """

    values: Array
    modes: LineModes
    turning: tuple[Array, Array]


@record(eq=False)
class Disc:
    """Disc centred on the origin, for eddy currents on its faces and its wall.

    `face` holds the functions along a diameter, `wall` the functions along the height; half of each line is used.
    `counts` are the numbers of field points along radius and height. `orders` is the highest order m of cos(m phi).
    """

    face: GradedLine
    wall: GradedLine
    counts: tuple[int, int]
    orders: int

    @property
    def mirror_image_numbers(self) -> None:
        """None, because mirror planes are not used for a disc.

        Orders and phases divide the currents into more classes than mirror planes would.
        """
        return None

    @cached_property
    def angles(self) -> Array:
        """Azimuths (rad) of the field points on each circle, equally spaced."""
        count = 2 * self.orders + 2
        return np.asarray(2.0 * math.pi / count * np.arange(count))

    @cached_property
    def points(self) -> Array:
        """Positions (points, 3; m) at which fields are evaluated: upper face, lower face, then wall."""
        radius = 0.5 * self.face.half * (1.0 + gauss(self.counts[0])[0])
        height = self.wall.half * gauss(self.counts[1])[0]
        cosine, sine = np.cos(self.angles), np.sin(self.angles)
        pieces = [_circles(radius, np.full_like(radius, z), cosine, sine) for z in (self.wall.half, -self.wall.half)]
        return np.concatenate([*pieces, _circles(np.full_like(height, self.face.half), height, cosine, sine)])

    @cached_property
    def meridian_interpolations(self) -> tuple[Array, Array, Array]:
        """Interpolation matrices (points of the meridian, field points; no unit) from the field points to the meridian.

        The first interpolates along the radius to points of the face. The second interpolates along the height to
        points of the wall, the third to the mirror images of these points below the middle plane.
        """
        on_face, places = self.meridian.on_face, self.meridian.places
        height = places[~on_face, 1] / self.wall.half
        to_face = interpolation(self.counts[0], 2.0 * places[on_face, 0] / self.face.half - 1.0)
        return to_face, interpolation(self.counts[1], height), interpolation(self.counts[1], -height)

    @cached_property
    def meridian(self) -> Meridian:
        """Upper half of the disc's outline (m), from the axis over the face and down the wall to the middle plane."""
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
        """Classes of eddy currents by order, parity and phase, with inductances in H."""
        same, other = (_kernel(self.meridian, side, self.orders + 1) for side in (1.0, -1.0))
        kernels = {parity: same - parity * other for parity in PARITIES}
        classes = []
        for order in range(self.orders + 1):
            for parity in PARITIES:
                values, slopes = self._functions(order, parity)
                inductance = self._inductance(order, parity, kernels, values, slopes)
                functions = DiscFunctions(order, parity, self, inductance, values, slopes)
                classes += [DiscClass(functions, phase) for phase in (("cos", "sin") if order else ("cos",))]
        return tuple(classes)

    @cached_property
    def radials(self) -> tuple[Radial, ...]:
        """Functions (no unit) along the radius (m), for every order m from 0 to the highest.

        Near the axis, functions of order m up to 3 vary with the radius rho like rho^m. Higher even orders vary like
        rho^2, higher odd orders like rho^3.
        """
        middle, radials = self.face.nodes.size // 2, []
        radii = self.face.nodes[middle:]
        for order in range(self.orders + 1):
            values = self.face.values[1 if order == 0 else -1][middle:]
            if order > 1:
                values = values * (radii[:, None] / self.face.half) ** (1 + order % 2)
            radials.append(_radial(radii, values, order))
        return tuple(radials)

    def _functions(self, order: int, parity: int) -> tuple[Array, Array]:
        """Return values (no unit) and slopes (1/m) of one order's functions, each (points of meridian, functions)."""
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
        """Return the inductance matrix (n, n; H) of the functions with one order m and one parity.

        `kernels` (m; by parity) are the integrals from `_kernel`. `values` and `slopes` are the functions along the
        meridian.

        Notes
        -----
        Neumann's integral, with separate kernels for currents along the disc that are even and odd across the middle
        plane. Currents along x +- i y have the orders m +- 1 (derived here).
        """
        radius, on_face = self.meridian.places[:, 0][:, None], self.meridian.on_face[:, None]
        wall, out = ~self.meridian.on_face, np.where(on_face, order * values, 0.0)
        up, walls = order * values[wall], np.ix_(wall, wall)
        # currents with cos(m phi) round the axis and sin(m phi) outwards have orders m + 1 and m - 1 along x +- i y
        more, less = slopes * radius - out, slopes * radius + out
        total = up.T @ kernels[-parity][order][walls] @ up
        for current, turned in ((more, order + 1), (less, abs(order - 1))):
            total = total + 0.5 * current.T @ (kernels[parity][turned] @ current)
        around = 2.0 * math.pi if order == 0 else math.pi
        inductance = MU0 / (4.0 * math.pi) * 2.0 * around * 0.5 * (total + total.T)
        if (order, parity) != (0, 1):
            return inductance
        return definite_inductance(inductance, self.face.values[1].shape[1] - 1)


def _radial(radii: Array, nodes: Array, order: int) -> Radial:
    """Return the functions along the radius for an order m (no unit), with their masses and stiffnesses.

    `nodes` (radii, functions) are their values at `radii` (m). Masses integrate products of two functions over radius
    times its differential. Stiffnesses integrate products of gradients: (d/d rho)^2 + m^2 / rho^2 (textbook).
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
    """Return a disc with its spline mesh.

    Parameters
    ----------
    diameter, thickness : float
        size of the disc (m)
    first, widest : float
        distances of the spline knots at the edges and in the middle of the face (m)
    counts : tuple[int, int]
        numbers of field points along the radius and the height
    orders : int
        highest order m of cos(m phi)
    finer : int, optional
        number of nodes per knot (see `graded_line`)
    """
    face = graded_line(0.5 * diameter, first, widest, finer)
    wall = graded_line(0.5 * thickness, min(first, 0.22 * thickness), max(0.25 * thickness, first), finer)
    return Disc(face, wall, counts, orders)


def _circles(radius: Array, height: Array, cosine: Array, sine: Array) -> Array:
    """Return points (circles times azimuths, 3; m) on circles, given by radius and height of each circle (n; m).

    `cosine` and `sine` belong to the azimuths.
    """
    points = np.empty((radius.size, cosine.size, 3))
    points[..., 0], points[..., 1] = radius[:, None] * cosine, radius[:, None] * sine
    points[..., 2] = height[:, None]
    return points.reshape(-1, 3)


def _kernel(shape: Meridian, side: float, orders: int) -> Array:
    """Return integrals (orders + 1, points, points; m) of cos(n phi) / distance over phi, for n from 0.

    Both quadrature weights are included. With `side` -1, the second point is mirrored below the middle plane; with 1 it
    is not.

    Notes
    -----
    The integrals are `toroidal` functions. For near pieces the integrand's logarithm of the distance is subtracted and
    integrated in closed form or by graded points (derived here).
    """
    image = np.array([1.0, side])
    places, weights = shape.places, shape.weights
    # each pair of points once
    first, second = np.triu_indices(len(places))
    square = np.sum((places[first] - places[second] * image) ** 2, axis=1)
    if side > 0.0:
        square[first == second] = np.repeat((COINCIDENT * shape.lengths) ** 2, POINTS)
    mean = np.sqrt(places[first, 0] * places[second, 0])
    means = toroidal(0.5 * square / mean**2, orders)
    means *= 2.0 / mean * weights[first] * weights[second]
    which = np.empty((len(places), len(places)), dtype=np.intp)
    which[first, second] = which[second, first] = np.arange(first.size)
    integrals = np.take(means, which, axis=1)
    starts, ends = shape.starts * image, shape.ends * image
    middle = 0.5 * (starts + ends)
    near = np.hypot(places[:, None, 0] - middle[:, 0], places[:, None, 1] - middle[:, 1]) < NEAR * shape.lengths
    point, piece = np.nonzero(near)
    columns = POINTS * piece[:, None] + np.arange(POINTS)
    rows = np.broadcast_to(point[:, None], columns.shape)
    offset = places[rows] - places[columns] * image
    coincident = (COINCIDENT * shape.lengths[piece, None]) ** 2
    square = np.where((rows == columns) & (side > 0.0), coincident, np.sum(offset**2, axis=2))
    logarithm = shape.lengths[piece, None] * _log_weights(places[point], starts[piece], ends[piece])
    rest = 0.5 * np.log(square) * weights[columns] - logarithm
    integrals[:, rows, columns] += 2.0 / np.sqrt(places[rows, 0] * places[columns, 0]) * weights[rows] * rest
    return integrals


def _log_weights(points: Array, starts: Array, ends: Array) -> Array:
    """Return weights (n, POINTS; no unit) for the integral of a function times ln(distance from a point) over a piece.

    The function is given at the piece's Gauss points, and the piece's length counts as 1. `points`, `starts` and `ends`
    (n, 2; m) are the point and the piece's ends. Quadrature points are graded like x^4 about the place nearest to the
    point.
    """
    sides = ends - starts
    nearest = np.clip(np.einsum("nc,nc->n", points - starts, sides) / np.einsum("nc,nc->n", sides, sides), 0.0, 1.0)
    at, share = gauss(16)
    grade = 0.5 * (1.0 + at)
    weights = np.zeros((len(points), POINTS))
    for end in (0.0, 1.0):
        span = (end - nearest)[:, None]
        x = nearest[:, None] + span * grade**4
        offset = starts[:, None] + x[..., None] * sides[:, None] - points[:, None]
        distance = np.maximum(np.hypot(offset[..., 0], offset[..., 1]), 1e-300)
        weight = np.log(distance) * np.abs(span) * 2.0 * share * grade**3
        through = interpolation(POINTS, (2.0 * x - 1.0).ravel()).reshape(*x.shape, POINTS)
        weights += np.einsum("nq,nqk->nk", weight, through)
    return weights
