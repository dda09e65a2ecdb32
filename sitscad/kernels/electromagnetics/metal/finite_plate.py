"""A conducting plate of finite size over a round coil: what share of an endless plate's effect it has.

The plate is a perfectly conducting sheet that carries eddy currents with the stream function psi (zero at its edge):
the one that cancels the coil's normal field everywhere on it. psi is expanded in functions that fall to the edge like
the square root of the distance, as it does: Chebyshev's U times a square root on the rectangle, and Zernike-like ones
on the disc. Their Fourier transforms are Bessel functions in closed form, and a sheet's energy in Fourier space is
mu0/2 k |psi|^2. With the normal flux b through every function and the energy matrix K the change of inductance is
- b K^-1 b; an endless plate's is - mu0 pi times the integral of the coil's power spectrum.

Where the metal's faces recede by a little, the change of inductance says where currents flow: their loss follows from
it by Wheeler's incremental inductance rule (Proc. IRE 30, 1942), edges and side walls included.

A conductor behind the coil enters as a perfect mirror at a plane, for both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.special_functions import bessel_orders, gauss, j0, j1, spherical_bessel_orders
from sitscad.kernels.solve_cache import solved

Source = tuple[Array, Array, Array]

MARGIN = 3.0
"""Beyond the coil's edge plus this many times (radius + gap) the rest of a plate no longer matters (below 0.2 %)."""

DEEPEST = 0.03
"""Depth of the sheet within a plate, in coil diameters, at most: currents keep to the near face and the side walls."""

THICKEST, STOUTEST = 0.15, 0.2
"""Thickness of a plate, in coil diameters and in its own widths, beyond which more of it no longer counts."""

LONGEST, OWN_WAY = 0.8, 1.6
"""Of magnetic plates: the thickness in coil diameters beyond which more of it no longer draws the field in, and by how
much more than a thin one's the field through it grows with thickness over width."""

MOST_MODES = 32
"""Functions along one side at most, half of them even."""


@record(eq=False)
class CoaxialRings:
    """A round coil as rings about its axis: radii (m), heights (m, z = 0 is where gaps count from), turns of each."""

    radii: Array
    heights: Array
    turns: Array

    def spectrum(self, wave_numbers: Array, roof: float, floor: float) -> Array:
        """The field's spectrum (k; m) at the plane z = `roof`: the sum of turns a J1(k a) exp(-k distance), less that
        of the image in a mirror at z = `floor` (-inf: none); in units of mu0 pi it is the normal flux density's (Dodd
        and Deeds 1968).
        """
        return self.spectra(wave_numbers, np.array([roof]), floor)[0]

    def spectra(self, wave_numbers: Array, roofs: Array, floor: float) -> Array:
        """The field's spectrum at several planes (m): (planes, wave numbers; m), as `spectrum`."""
        k, z, (radii, heights, turns) = wave_numbers[:, None], roofs[:, None, None], self._alike
        waves = np.exp(-k * (z - heights))
        if math.isfinite(floor):
            waves = waves - np.exp(-k * (z + heights - 2.0 * floor))
        return np.asarray(((j1(k * radii) @ turns) * waves).sum(axis=2))

    @cached_property
    def _alike(self) -> tuple[Array, Array, Array]:
        """Radii and heights (m), each once, and turns times radius at every pair of them."""
        (radii, which), (heights, level) = (np.unique(part, return_inverse=True) for part in (self.radii, self.heights))
        turns = np.zeros((radii.size, heights.size))
        np.add.at(turns, (which, level), self.turns * self.radii)
        return radii, heights, turns


@record
class FinitePlate:
    """A flat plate, a rectangle or a disc: size along x and y (m; a disc's diameter twice) and thickness (m)."""

    size: tuple[float, float]
    thickness: float
    is_round: bool = False


def plate_share(plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf) -> Array:
    """Change of inductance by the plate over that by an endless one (no unit), both with their near faces at z = `gap`
    (m).

    `offsets` (m, shape (n, 2)) are the places of the coil's axis seen from the plate's centre; the answer has shape
    (n,). Derived here: the plate is a sheet in its middle plane, or near its face where it is thick, a little larger
    for the current on its side walls, and a volume that keeps out the field along it. That field is the coil's and the
    eddy currents' own, half and half; the first half is shared out by its square on the plate, the second like the
    sheet's effect. For endless plates this is exact. No plate does less than a thinner one, or than the sheet that is
    its near face.
    """
    found, front = _changes(plate, coil, offsets, gap, floor)
    for thickness in {0.0, min(plate.thickness, DEEPEST * 2.0 * float(coil.radii.max()))} - {plate.thickness}:
        thinner, _ = _changes(FinitePlate(plate.size, thickness, plate.is_round), coil, offsets, gap, floor)
        found = np.maximum(found, thinner)
    return found / front


def plate_loss_share(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf
) -> Array:
    """Loss in the plate's skin over that in an endless plate's, by Wheeler's rule; arguments as for `plate_share`. The
    loss is proportional to the change of inductance that all faces receding by a little make: the near one, the edge
    and, as long as they matter, the walls. Currents crowd at an edge like one over the root of the distance; that the
    square of it has a limit is the thickness's doing.
    """
    step = 0.01 * min(plate.thickness, gap)

    def receded(by: float) -> tuple[Array, float]:
        size = plate.size[0] - 2.0 * by, plate.size[1] - 2.0 * by
        return _changes(FinitePlate(size, plate.thickness - 2.0 * by, plate.is_round), coil, offsets, gap + by, floor)

    (more, more_front), (less, less_front) = receded(-step), receded(step)
    return np.maximum(more - less, 0.0) / (more_front - less_front)


def _changes(plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float) -> tuple[Array, float]:
    """Size (places,) of the change of inductance by the plate at every place, and by an endless one, in units of mu0 pi
    (m).
    """
    places = np.atleast_2d(np.asarray(offsets, dtype=float))

    def question() -> tuple[object, ...]:
        rings = (part.tobytes() for part in (coil.radii, coil.heights, coil.turns))
        return (plate, *rings, places.tobytes(), gap, floor)

    changes, front = solved(question, lambda: _solved_changes(plate, coil, places, gap, floor))
    return changes, float(front)


def _solved_changes(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float
) -> tuple[Array, Array]:
    """`_changes` (m) worked out: the sheet by `_sheet_changes`, and what the thickness keeps out by
    `_field_on`.
    """
    outer = float(coil.radii.max())
    middle = gap + _sheet_depth(plate, outer)
    depth, reach = _depth_and_reach(coil, offsets, gap)
    half = np.minimum(0.5 * np.array(plate.size) + _edge_growth(plate, outer), reach)
    k, weights = _wave_numbers(11.0 / depth, reach)
    front = _endless(k, weights, coil.spectrum(k, gap, floor), gap - floor)
    spectrum, room = coil.spectrum(k, middle, floor), middle - floor
    sheet = _endless(k, weights, spectrum, room)
    detail = min(depth, 0.5 * outer)
    planes = k, weights, spectrum[None]
    changes = _sheet_changes(plate.is_round, half, offsets, planes, detail, np.array([room]), MOST_MODES, 16)[0]
    on_plate = np.minimum(half, 0.5 * np.array(plate.size))
    excluded = _field_on(plate, on_plate, offsets, (k, weights, spectrum), detail, j1)
    return changes + 0.5 * (front - sheet) * (excluded + changes / sheet), np.array(front)


def _sheet_changes(
    is_round: bool, half: Array, offsets: Array, source: Source, detail: float, rooms: Array, most: int, nodes: int
) -> Array:
    """Size (planes, places; m, times mu0 pi H) of the change by a sheet of half sides `half` (m) in planes so far (m)
    from a mirror, of every one of several spectra. A rectangle's with at most so many functions along a side, and so
    many `nodes` in a panel of their energies.
    """
    if is_round:
        return _disc(float(half[0]), offsets, source, detail, rooms)
    counts = min(_modes(half[0], detail), most), min(_modes(half[1], detail), most)
    return _sheet_energies(half, counts, rooms, _fluxes(half, offsets, source, counts), nodes)


def magnetic_share(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf
) -> Array:
    """The share for a plate of very high permeability that does not conduct, like ferrite: it draws the field in.

    Poles on its faces, of no sum, keep the magnetic potential on it constant; near its edge they grow like one over the
    root of the distance. On a disc every angular order stands alone, with the transforms j_l (l = m, m + 2 ... without
    0, which has a sum). A rectangle counts as the disc of its area; the edge is further out by t / 2 pi (1 + ln(4 pi
    w / t)), as a thick strip's is, which grows up to t = 4 pi w. A small plate does far less than a conductor's: the
    poles must find room on it. Then its volume leads the field through it: half of what an endless one makes of that is
    shared out by the square of that field on the plate, more for a thick one, which is less in its own way (a cube
    three times), half like the sheet's effect. Fitted to boxes of poles (tests/validation).
    """
    offsets = np.atleast_2d(np.asarray(offsets, dtype=float))
    outer, width = float(coil.radii.max()), min(plate.size)
    middle = gap + 0.5 * min(plate.thickness, THICKEST * 2.0 * outer, width)
    thick = min(plate.thickness, LONGEST * 2.0 * outer, 4.0 * math.pi * width)
    depth, reach = _depth_and_reach(coil, offsets, gap)
    area = math.pi / 4.0 if plate.is_round else 1.0
    growth = thick / (2.0 * math.pi) * (1.0 + math.log(4.0 * math.pi * width / thick))
    radius = math.sqrt(area * plate.size[0] * plate.size[1] / math.pi) + growth
    k, weights = _wave_numbers(11.0 / depth, reach)
    front = _endless(k, weights, coil.spectrum(k, gap, floor), gap - floor, poles=True)
    spectrum, room = coil.spectrum(k, middle, floor), middle - floor
    source = k, weights, spectrum
    sheet = _endless(*source, room, poles=True)
    detail = min(depth, 0.5 * outer)
    found = _disc(min(radius, reach), offsets, (k, weights, spectrum[None]), detail, np.array([room]), poles=True)[0]
    # What is missing falls with the cube of the size, as the coil's field outside does; more functions are not needed.
    share = 1.0 - (1.0 - found / sheet) * min(1.0, reach / radius) ** 3
    half = np.minimum(0.5 * np.array(plate.size), reach)
    led = np.minimum(_field_on(plate, half, offsets, source, detail, j0) * (1.0 + OWN_WAY * thick / width), 1.0)
    return np.asarray((share * sheet + 0.5 * (front - sheet) * (led + share)) / front)


def magnetic_share_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Relative error (no unit) of a magnetic share, from boxes of poles (tests/validation), by the plate's shorter side
    over the coil's diameter; longer than twice its width was not compared.
    """
    short, longest, diameter = min(plate.size), max(plate.size), 2.0 * float(coil.radii.max())
    ratio = short / diameter
    rod = eased(plate.thickness / diameter, LONGEST / EASED, 0.9, 2.0)
    known = stepped(ratio, ((0.2, rod), (0.95, 0.6), (1.45, 0.22)), 0.1)
    return eased(longest / short, 2.1 / EASED, known, max(known, 0.4))


def _edge_growth(plate: FinitePlate, outer: float) -> float:
    """How far (m) the sheet reaches beyond a plate with side walls: t / 2 pi ln(D / t). The form is that of a thick
    strip's (a logarithm of size over thickness), the coil's diameter D in it a fit to boxes of surface loops
    (tests/validation).
    """
    thickness = _counted_thickness(plate, outer)
    if thickness <= 0.0:
        return 0.0
    return thickness / (2.0 * math.pi) * math.log(max(2.0 * outer / thickness, math.e))


def _depth_and_reach(coil: CoaxialRings, offsets: Array, gap: float) -> tuple[float, float]:
    """Down to the nearest ring (m; no less than a hundredth of the largest's radius), and how far out (m) the field
    counts.
    """
    outer = float(coil.radii.max())
    depth = max(gap - float(coil.heights.max()), 1e-2 * outer)
    return depth, float(np.hypot(*offsets.T).max()) + outer + MARGIN * (outer + depth)


def _sheet_depth(plate: FinitePlate, outer: float) -> float:
    """Depth (m) of the sheet within a plate: in the middle of a thin one, nowhere deeper than DEEPEST, without a kink,
    for the loss is a slope of it. Chosen here by comparison with boxes of loops.
    """
    middle, deepest = 0.5 * _counted_thickness(plate, outer), DEEPEST * 2.0 * outer
    return float(middle * (1.0 + (middle / deepest) ** 4) ** -0.25)


def _counted_thickness(plate: FinitePlate, outer: float) -> float:
    """How much (m) of a plate's thickness counts: see THICKEST and STOUTEST."""
    return min(plate.thickness, THICKEST * 2.0 * outer, STOUTEST * min(plate.size))


def share_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Relative error (no unit) of a share, from the comparison with boxes of surface loops and discs of rings
    (tests/validation), by thickness and width over the coil's diameter.
    """
    thick, wide = _slenderness(plate, coil)
    narrow, broad = eased(thick, 0.03 / EASED, 0.05, 0.12), eased(thick, 0.055, 0.03, 0.05)
    return stepped(wide, ((0.24, 0.9), (0.35, 0.25), (0.6, narrow)), broad)


def loss_share_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Relative error (no unit) of a share of the loss, mostly from discs: small thick ones are given too much."""
    thick, wide = _slenderness(plate, coil)
    return stepped(wide, ((0.2, 0.5), (0.6, 0.4)), eased(thick, 0.03 / EASED, 0.15, 0.2))


EASED = 1.4
"""Errors are known at some sizes. From one at which a larger error was seen a stated one goes over to the next smaller
within this ratio of sizes: nowhere less than was seen, and without a jump."""


def eased(value: float, limit: float, before: float, after: float) -> float:
    """An error (no unit): `before` up to a limit, `after` from EASED times as much on, smooth between."""
    part = min(max((value / limit - 1.0) / (EASED - 1.0), 0.0), 1.0)
    return before + (after - before) * part * part * (3.0 - 2.0 * part)


def stepped(value: float, steps: Sequence[tuple[float, float]], last: float) -> float:
    """An error (no unit): what holds up to each limit of `steps` (limit, value; rising limits), then `last`, each eased
    into the next.
    """
    found = steps[0][1]
    for (limit, _), (_, after) in zip(steps, (*steps[1:], (math.inf, last)), strict=True):
        found = eased(value, limit, found, after)
    return found


def _slenderness(plate: FinitePlate, coil: CoaxialRings) -> tuple[float, float]:
    """Thickness and shorter side over the coil's diameter; no unit."""
    diameter = 2.0 * float(coil.radii.max())
    return plate.thickness / diameter, min(plate.size) / diameter


def _endless(k: Array, weights: Array, spectrum: Array, room: float, poles: bool = False) -> float:
    """Size of the change of inductance by an endless plate, in units of mu0 pi (m): the integral of the spectrum's
    square (Dodd and Deeds 1968); `room` (m) is its distance from the mirror, whose echo is a geometric series.
    """
    sign = 1.0 if poles else -1.0
    echo = 1.0 + sign * np.exp(-2.0 * k * room) if math.isfinite(room) else 1.0
    return float(np.sum(weights * spectrum**2 / echo))


def _field_on(
    plate: FinitePlate, half: Array, offsets: Array, source: Source, detail: float, bessel: Callable[[Array], Array]
) -> Array:
    """The share (places,; no unit) of the squared field that falls on the plate: along its plane with J1, through it
    with J0. The field at a distance is the Hankel transform of the spectrum, its square over all the plane by
    Parseval's theorem (textbook).
    """
    k, weights, spectrum = source
    panels = min(6, 1 + math.ceil(float(half.max()) / (6.0 * detail)))
    nodes, share = (np.tile(values, panels) / panels for values in gauss(16))
    nodes = nodes + np.repeat((2.0 * np.arange(panels) + 1.0) / panels - 1.0, 16)
    if plate.is_round:
        angle = 2.0 * math.pi * np.arange(nodes.size) / nodes.size
        r = 0.5 * half[0] * (1.0 + nodes[:, None])
        x, y = r * np.cos(angle), r * np.sin(angle)
        area = math.pi * half[0] * share[:, None] * r / nodes.size * np.ones_like(x)
    else:
        x, y = np.meshgrid(half[0] * nodes, half[1] * nodes, indexing="ij")
        area = half[0] * half[1] * share[:, None] * share
    away = np.hypot(x - offsets[:, 0, None, None], y - offsets[:, 1, None, None])
    radii = np.linspace(0.0, float(away.max()), 2 * nodes.size + 20)
    table = bessel(radii[:, None] * k) @ (k * weights * spectrum)
    squared = _cubic(away, radii[1], table**2)
    return np.asarray((squared * area).sum(axis=(1, 2)) / (2.0 * math.pi * np.sum(weights * k * spectrum**2)))


def _wave_numbers(top: float, reach: float, panels: int | None = None) -> tuple[Array, Array]:
    """Nodes and weights (1/m) with k = top t^2: dense where the coil's own size lies, up to where exp(-k depth) has
    died out.
    """
    nodes, share = gauss(16)
    panels = panels or min(40, 8 + math.ceil(top * reach / 25.0))
    t = ((np.arange(panels)[:, None] + 0.5 * (1.0 + nodes)) / panels).ravel()
    return top * t * t, top * t * np.tile(share, panels) / panels


def _modes(half: float, detail: float) -> int:
    """Functions along a side (no unit), even in number: half for even, half for odd fields. These resolve half / n; the
    field varies over the `detail` (m).
    """
    return 2 * min(MOST_MODES // 2, 3 + math.ceil(0.8 * half / detail))


# The rectangle ------------------------------------------------------------------------------------------------------


def _fluxes(half: Array, offsets: Array, source: Source, counts: tuple[int, int]) -> Array:
    """Flux (in units of mu0 / 2; m) through every function of a rectangle at every place, of every one of several
    spectra (s, k): (s, places, functions along x, along y). By `_chebyshev_projection` of the field, the integral of k
    J0(k r) times the spectrum.
    """
    u, v = (_chebyshev_projection(n) for n in counts)
    farthest = float(np.hypot(*(np.abs(offsets) + half).T).max())
    radii = np.linspace(0.0, farthest, 4 * max(counts) + 40)
    # normal flux density at distances from the axis, in units of mu0 / 2: the integral of k J0(k r) times the spectrum
    k, weights, spectrum = source
    table = np.asarray(j0(radii[:, None] * k) @ (k * weights * spectrum).T)
    x = half[0] * u[0] - offsets[:, 0, None]
    y = half[1] * v[0] - offsets[:, 1, None]
    away = np.sqrt(x[:, :, None] ** 2 + y[:, None, :] ** 2)
    field = _cubic(away, radii[1], table)
    return np.asarray(half[0] * half[1] * (u[1] @ field.transpose(3, 0, 1, 2) @ v[1].T))


def _sheet_energies(half: Array, counts: tuple[int, int], rooms: Array, flux: Array, nodes: int) -> Array:
    """Size of the change (times mu0 pi H) that a rectangular sheet makes by the fluxes (planes, places, functions,
    functions) through it, in planes so far (m) from a mirror: (planes, places). Derived here: what of a rectangle's
    energies neither side has alone is summed at nodes along both, k = |kx| + |ky| - 2 |kx ky| / (k + |kx| + |ky|): the
    first two terms separate into closed integrals, the last falls off fast enough for plain quadrature. Then the
    mirror's echo, k exp(-2 k room), where there is one.
    """
    q, weights, transforms = _transforms(max(counts), nodes)
    kx, ky = q[:, None] / half[0], q / half[1]
    k = np.hypot(kx, ky)
    rest = -2.0 * kx * ky / (k + kx + ky)
    if math.isfinite(rooms[0]):
        rest = rest - k * np.exp(-2.0 * k * rooms[:, None, None])
    total, mixed = np.zeros(flux.shape[:2]), (rest * (weights[:, None] * weights), transforms)
    for px in (0, 1):
        for py in (0, 1):
            b = flux[:, :, px::2, py::2].reshape(*flux.shape[:2], -1)
            if np.abs(b).max() > 1e-12 * np.abs(flux).max():
                energy = _rectangle_energy(half, np.arange(px, counts[0], 2.0), np.arange(py, counts[1], 2.0), mixed)
                total += np.sum(b * np.linalg.solve(energy, b.transpose(0, 2, 1)).transpose(0, 2, 1), axis=2)
    return total / (2.0 * math.pi)


def _chebyshev_projection(count: int) -> tuple[Array, Array]:
    """Gauss-Chebyshev points (n; no unit) of the second kind (Abramowitz and Stegun 25.4.40), and the weights
    (functions, n) that project a field on sqrt(1 - u^2) U_m(u).
    """
    points = 2 * count + 8
    angle = math.pi * np.arange(1, points + 1) / (points + 1)
    weights = math.pi / (points + 1) * np.sin(angle)
    return np.cos(angle), weights * np.sin(np.arange(1, count + 1)[:, None] * angle)


def _cubic(at: Array, step: float, table: Array) -> Array:
    """Catmull and Rom's spline (1974) through values at 0, step, 2 step ... of an even function, or of several (steps,
    n), in their unit; `at` and `step` in one.
    """
    padded = np.concatenate((table[1:2], table, table[-1:], table[-1:]))
    a, b, c, d = (padded[shift : shift + len(table) - 1] for shift in range(4))
    terms = np.array([b, 0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (3.0 * (b - c) + d - a)])
    place = at / step
    cell = np.minimum(place.astype(int), len(table) - 2)
    t = (place - cell).reshape(*at.shape, *[1] * (table.ndim - 1))
    found: Array = terms[3, cell]
    for term in terms[2::-1]:
        found *= t
        found += term[cell]
    return found


def sheet_shares(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gaps: Array, floor: float = -math.inf
) -> Array:
    """`plate_share` (no unit) roughly, at several gaps (m) at once: (gaps, offsets). Only the sheet is solved, with few
    waves and functions, and what its thickness keeps out besides is taken to be shared out like the sheet's effect.
    """
    offsets, outer = np.atleast_2d(np.asarray(offsets, dtype=float)), float(coil.radii.max())
    middles = gaps + _sheet_depth(plate, outer)
    depth, reach = _depth_and_reach(coil, offsets, float(gaps.min()))
    half = np.minimum(0.5 * np.array(plate.size) + _edge_growth(plate, outer), reach)
    k, weights = _wave_numbers(ROUGH_TOP / depth, reach, ROUGH_PANELS)
    spectra = coil.spectra(k, middles, floor)
    whole = np.array([_endless(k, weights, one, z - floor) for one, z in zip(spectra, middles, strict=True)])
    detail = 0.5 * (min(depth, 0.5 * outer) + 0.5 * outer)
    planes, rooms = (k, weights, spectra), middles - floor
    found = _sheet_changes(plate.is_round, half, offsets, planes, detail, rooms, ROUGH_MODES, ROUGH_NODES)
    return np.minimum(found / whole[:, None], 1.0)


ROUGH_TOP, ROUGH_PANELS, ROUGH_MODES, ROUGH_NODES = 7.0, 4, 8, 8
"""Of rough shares: waves up to exp(-7) at the nearest gap, panels of 16 of them, functions along a side at most, and
nodes in a panel of their energies (twice as many change shares by 2e-4)."""


def _rectangle_energy(half: Array, x: Array, y: Array, mixed: tuple[Array, Array]) -> Array:
    """Energies (m) of products of Chebyshev's functions of orders `x` and `y`, closed but for `mixed`, of one plane or
    several: (planes, products, products). Derived here from k |psi|^2 in Fourier space with the transforms of
    `_transforms`.
    """
    rest, transforms = mixed
    fx, fy = transforms[x.astype(int)], transforms[y.astype(int)]
    inner, outer = ((one[:, None] * one).reshape(-1, rest.shape[-1]) for one in (fx, fy))
    energy = (inner @ rest @ outer.T).reshape(-1, x.size, x.size, y.size, y.size)
    for row, (one, other) in enumerate(((x, y), (y, x))):
        slope = np.diag(0.5 * (one + 1.0)) / half[row]
        product = slope[:, :, None, None] * _overlap(other)
        energy = energy + (product if row == 0 else product.transpose(2, 3, 0, 1))
    return math.pi**2 * half[0] * half[1] * energy.transpose(0, 1, 3, 2, 4).reshape(
        -1, x.size * y.size, x.size * y.size)


def _overlap(orders: Array) -> Array:
    """Integral over q > 0 of two transforms (no unit): pi times that of (1 - u^2) U_m U_n over the side, divided by
    pi^2, by Parseval's theorem and U_m = sin((m + 1) t) / sin t (textbook).
    """
    one, other = orders[:, None], orders
    difference, total = (one - other) ** 2, (one + other + 2) ** 2
    return np.asarray((1.0 / (1.0 - difference) - 1.0 / (1.0 - total)) / math.pi)


@lru_cache(maxsize=8)
def _transforms(count: int, panel: int) -> tuple[Array, Array, Array]:
    """Nodes, `panel` in each panel of 8, and weights over q > 0, and (m + 1) J_(m+1)(q) / q for m < count with the sign
    of i^m folded in; no unit. They are the Fourier transforms of sqrt(1 - u^2) U_m(u) over pi: Bessel's integral
    (Abramowitz and Stegun 9.1.21) by parts.
    """
    panels = math.ceil((count + 40) / 8)
    nodes, share = gauss(panel)
    q = (8.0 * (np.arange(panels)[:, None] + 0.5 * (1.0 + nodes))).ravel()
    order = np.arange(1, count + 1)
    sign = np.where((order - 1) // 2 % 2, -1.0, 1.0)
    return q, np.tile(4.0 * share, panels), (sign * order)[:, None] * bessel_orders(q, count)[1:] / q


# The disc -----------------------------------------------------------------------------------------------------------


def _disc(radius: float, offsets: Array, source: Source, detail: float, rooms: Array, poles: bool = False) -> Array:
    """Size of the change by a disc (m; times mu0 pi H) of every one of several spectra (s, k), in planes so far (m)
    from a mirror, at every place: (s, places); one angular order after another. Derived here: functions exp(i m phi)
    with the transforms j_l(k R) / (k R), l = m + 1, m + 3 ..., have the energies 1 / (2 l + 1), for these j_l are
    orthogonal over k (Abramowitz and Stegun 11.4.6), apart from the mirror's echo. Poles have j_l (k R), l = m, m + 2
    ... but not 0, the same energies, and an echo of the other sign.
    """
    k, weights, spectra = source
    count = _modes(radius, detail) // 2 + 4
    highest = 2 * count
    radial = spherical_bessel_orders(k * radius, highest + 2 * count)
    away = np.maximum(np.hypot(*offsets.T), 1e-9 * radius)
    around = bessel_orders((away[:, None] * k).ravel(), highest).reshape(highest + 1, *away.shape, *k.shape)
    total, sources = np.zeros((len(spectra), len(offsets))), (weights * spectra)[:, None]
    echo = (1.0 if poles else -1.0) * 2.0 * radius / math.pi * weights * np.exp(-2.0 * k * rooms[:, None])
    for m in range(highest + 1):
        orders = m + (0 if poles and m else 2 if poles else 1) + 2 * np.arange(count)
        flux = (around[m] * sources) @ radial[orders].T
        energy = np.diag(1.0 / (2.0 * orders + 1.0)) + (radial[orders] * echo[:, None]) @ radial[orders].T
        twice = 1.0 if m == 0 else 2.0
        answer = np.linalg.solve(energy, flux.transpose(0, 2, 1)).transpose(0, 2, 1)
        total += twice * 2.0 * radius / math.pi * np.sum(flux * answer, axis=2)
    return total
