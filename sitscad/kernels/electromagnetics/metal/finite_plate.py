"""Conducting plate of finite size over a round coil: the ratio of its effect to an infinite plate's effect.

Notes
-----
The plate is a perfectly conducting sheet. The stream function psi of its eddy currents is zero at its edge. Its field
cancels the coil's normal field everywhere on the sheet. It is expanded in functions that fall to the edge like the
square root of the distance: Chebyshev's U times a square root on the rectangle, and Zernike-like functions on the disc.
Their Fourier transforms are Bessel functions in closed form. A sheet's energy in Fourier space is mu0/2 k |psi|^2.

With the normal flux b through every function and the energy matrix K, the change of inductance is - b K^-1 b. An
infinite plate's change is - mu0 pi times the integral of the coil's power spectrum.

The loss follows from the change of inductance if the metal's faces recede by a little (Wheeler's incremental inductance
rule, Proc. IRE 30, 1942), edges and side walls included. A conductor behind the coil enters as a perfect mirror at a
plane, for both plates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.special_functions import bessel_orders, gauss, j0, j1
from sitscad.kernels.solve_cache import cached_solution

Source = tuple[Array, Array, Array]
"""Field of a coil: wave numbers (k; 1/m), weights (k; 1/m) and spectra (planes, k) or (k) (m)."""

MARGIN = 3.0
"""Distance from the coil's edge, divided by (radius + gap), beyond which a plate's metal has an effect below 0.2 %."""

DEEPEST = 0.03
"""Largest depth below a plate's near face at which the sheet replaces the plate, divided by the coil diameter.

In a thick plate, currents flow near the near face and in the side walls.
"""

THICKEST = 0.15
"""Largest thickness of a plate in the calculation, divided by the coil diameter. More thickness has no effect."""

STOUTEST = 0.2
"""Largest thickness of a plate in the calculation, divided by its shorter side. More thickness has no effect."""

LONGEST = 0.8
"""Largest thickness of a magnetic plate in the calculation, divided by the coil diameter.

More thickness attracts no more field.
"""

OWN_WAY = 1.6
"""Constant c of the field through a thick magnetic plate: the thin plate's field times (1 + c thickness / width)."""

MOST_MODES = 32
"""Largest number of functions along one side of a rectangle, half even and half odd."""


@record(eq=False)
class CoaxialRings:
    """Round coil as rings about its axis.

    `radii` (m), `heights` (m; relative to z = 0, from which gaps count) and `turns` have one value per ring.
    """

    radii: Array
    heights: Array
    turns: Array

    def spectra(self, wave_numbers: Array, roofs: Array, floor: float) -> Array:
        """Return the spectra (planes, k; m) of the coil's field at planes z = `roofs` (m), for wave numbers (k; 1/m).

        Notes
        -----
        A spectrum is the sum of turns a J1(k a) exp(-k distance) over rings of radius a, minus the spectrum of the
        image in a mirror at z = `floor` (-inf if there is none). In units of mu0 pi it is the spectrum of the normal
        flux density (Dodd and Deeds 1968).
        """
        k, z, (radii, heights, turns) = wave_numbers[:, None], roofs[:, None, None], self._ring_table
        waves = np.exp(-k * (z - heights))
        if math.isfinite(floor):
            waves = waves - np.exp(-k * (z + heights - 2.0 * floor))
        return np.asarray(((j1(k * radii) @ turns) * waves).sum(axis=2))

    @cached_property
    def _ring_table(self) -> tuple[Array, Array, Array]:
        """Distinct radii and distinct heights (m), and turns times radius (radii, heights; m) of each combination."""
        (radii, which), (heights, level) = (np.unique(part, return_inverse=True) for part in (self.radii, self.heights))
        turns = np.zeros((radii.size, heights.size))
        np.add.at(turns, (which, level), self.turns * self.radii)
        return radii, heights, turns


@record
class FinitePlate:
    """Flat plate, a rectangle or a disc.

    `size` (m) is along x and y; for a disc (`is_round`), it is the diameter twice. `thickness` is in m.
    """

    size: tuple[float, float]
    thickness: float
    is_round: bool = False


def plate_ratio(plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf) -> Array:
    """Return the change of inductance by a plate, divided by the change by an infinite plate (n; no unit).

    Parameters
    ----------
    plate : FinitePlate
        plate with its near face at z = `gap`
    coil : CoaxialRings
        rings of the coil
    offsets : array
        positions of the coil's axis relative to the plate's centre (n, 2; m)
    gap : float
        height of the near face of both plates (m)
    floor : float, optional
        height of a mirror behind the coil (m); -inf if there is none

    Notes
    -----
    Derived here. The effect of the plate is the effect of a sheet plus the effect of the plate's volume. The sheet is
    in the plate's middle plane, or near its face if it is thick. It is slightly larger than the plate, for the current
    on the side walls.

    The volume excludes the field along it. Half of this field is the coil's, the other half is the eddy currents'. The
    first half is multiplied by the part of the coil's squared field that falls on the plate. The second half is
    multiplied by the sheet's effect, divided by the effect of an infinite sheet. For infinite plates this is exact. A
    thinner plate, or the sheet at the near face, sets a lower limit.
    """
    changes, front = _changes(plate, coil, offsets, gap, floor)
    for thickness in {0.0, min(plate.thickness, DEEPEST * 2.0 * float(coil.radii.max()))} - {plate.thickness}:
        thinner, _ = _changes(FinitePlate(plate.size, thickness, plate.is_round), coil, offsets, gap, floor)
        changes = np.maximum(changes, thinner)
    return changes / front


def plate_loss_ratio(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf
) -> Array:
    """Return the loss in the plate's skin, divided by the loss in an infinite plate (n; no unit), by Wheeler's rule.

    The arguments are explained in `plate_ratio`.

    Notes
    -----
    The loss is proportional to the change of inductance if all faces recede by a little. Faces are the near face, the
    edge and the walls, up to the thickness that has an effect. Currents crowd at an edge like 1 / root of the distance.
    Their square has a finite integral because of the thickness.
    """
    step = 0.01 * min(plate.thickness, gap)

    def receded(by: float) -> tuple[Array, float]:
        size = plate.size[0] - 2.0 * by, plate.size[1] - 2.0 * by
        return _changes(FinitePlate(size, plate.thickness - 2.0 * by, plate.is_round), coil, offsets, gap + by, floor)

    (more, more_front), (less, less_front) = receded(-step), receded(step)
    return np.maximum(more - less, 0.0) / (more_front - less_front)


def _changes(plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float) -> tuple[Array, float]:
    """Return the size of the change of inductance by the plate (places) and by an infinite plate, over mu0 pi (m).

    The arguments are explained in `plate_ratio`. Results are cached by `cached_solution`.
    """
    places = np.atleast_2d(np.asarray(offsets, dtype=float))
    arrays = coil.radii, coil.heights, coil.turns, places
    changes, front = cached_solution(lambda: (plate, *(array.tobytes() for array in arrays), gap, floor),
                                     lambda: _solved_changes(plate, coil, places, gap, floor))
    return changes, float(front)


def _solved_changes(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float
) -> tuple[Array, Array]:
    """Compute the change of inductance by the plate (places) and by an infinite plate, divided by mu0 pi (m).

    The arguments are explained in `plate_ratio`. The sheet is solved by `_sheet_changes`. The part of the field that
    falls on the plate is from `_squared_field_share`.
    """
    outer = float(coil.radii.max())
    middle = gap + _sheet_depth(plate, outer)
    depth, reach = _depth_and_reach(coil, offsets, gap)
    half = np.minimum(0.5 * np.array(plate.size) + _edge_growth(plate, outer), reach)
    k, weights = _wave_numbers(11.0 / depth, reach)
    (near, spectrum), room = coil.spectra(k, np.array([gap, middle]), floor), middle - floor
    front = _infinite_plate_change(k, weights, near, gap - floor)
    sheet = _infinite_plate_change(k, weights, spectrum, room)
    detail = min(depth, 0.5 * outer)
    planes = k, weights, spectrum[None]
    changes = _sheet_changes(plate.is_round, half, offsets, planes, detail, np.array([room]), MOST_MODES, 16)[0]
    on_plate = np.minimum(half, 0.5 * np.array(plate.size))
    excluded = _squared_field_share(plate, on_plate, offsets, (k, weights, spectrum), detail, j1)
    return changes + 0.5 * (front - sheet) * (excluded + changes / sheet), np.array(front)


def _sheet_changes(
    is_round: bool, half: Array, offsets: Array, source: Source, detail: float, rooms: Array, most: int, nodes: int
) -> Array:
    """Return the size of the change of inductance by a sheet, over mu0 pi (planes, places; m), for several spectra.

    `half` are half sides (m). `source` is (wave numbers, weights, spectra (planes, k)). `detail` (m) is the length over
    which the field varies. `rooms` are distances of the planes from a mirror (m). A rectangle has at most `most`
    functions along a side, and `nodes` quadrature nodes in a panel of its energies.
    """
    if is_round:
        return _disc_change(float(half[0]), offsets, source, detail, rooms)
    counts = min(_function_count(half[0], detail), most), min(_function_count(half[1], detail), most)
    return _sheet_energies(half, counts, rooms, _fluxes(half, offsets, source, counts), nodes)


def magnetic_ratio(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gap: float, floor: float = -math.inf
) -> Array:
    """Return the effect of a magnetic plate, divided by the effect of an infinite plate (n; no unit).

    The plate has a very high permeability and does not conduct, like ferrite, so it attracts the field. The arguments
    are explained in `plate_ratio`.

    Notes
    -----
    Magnetic poles on the plate's faces keep the magnetic potential on it constant. Their sum is zero. Near the edge
    they grow like 1 / root of the distance. On a disc every angular order m is independent. Its functions have the
    transforms j_l with l = m, m + 2 ..., but not l = 0, whose sum is not zero. A rectangle counts as the disc of equal
    area. The edge is extended by t / 2 pi (1 + ln(4 pi w / t)), as for a thick strip. This grows up to t = 4 pi w.

    A small plate has far less effect than a conductor, because the poles need room on it. Then its volume guides the
    field through it. Half of the infinite plate's volume effect is multiplied by the part of the coil's squared field
    that falls on the plate. This part is larger for a thick plate, which demagnetises itself less (a cube: factor
    three). The other half is multiplied by the sheet's effect, divided by the effect of an infinite sheet. Fitted to
    boxes of poles (tests/validation).
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
    (near, spectrum), room = coil.spectra(k, np.array([gap, middle]), floor), middle - floor
    front = _infinite_plate_change(k, weights, near, gap - floor, poles=True)
    source = k, weights, spectrum
    sheet = _infinite_plate_change(*source, room, poles=True)
    detail = min(depth, 0.5 * outer)
    change = _disc_change(min(radius, reach), offsets, (k, weights, spectrum[None]), detail, np.array([room]),
                          poles=True)[0]
    # The deficit falls with the cube of the size, like the coil's field outside, so no more functions are needed.
    share = 1.0 - (1.0 - change / sheet) * min(1.0, reach / radius) ** 3
    half = np.minimum(0.5 * np.array(plate.size), reach)
    on_plate = _squared_field_share(plate, half, offsets, source, detail, j0)
    led = np.minimum(on_plate * (1.0 + OWN_WAY * thick / width), 1.0)
    return np.asarray((share * sheet + 0.5 * (front - sheet) * (led + share)) / front)


def magnetic_ratio_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Return the relative error (no unit) of `magnetic_ratio`, from comparison with boxes of poles (tests/validation).

    It depends on the plate's shorter side divided by the coil's diameter. Plates longer than twice their width were not
    compared.
    """
    short, longest, diameter = min(plate.size), max(plate.size), 2.0 * float(coil.radii.max())
    ratio = short / diameter
    rod = error_with_transition(plate.thickness / diameter, LONGEST / EASED, 0.9, 2.0)
    error_steps = error_with_transitions(ratio, ((0.2, rod), (0.95, 0.6), (1.45, 0.22)), 0.1)
    return error_with_transition(longest / short, 2.1 / EASED, error_steps, max(error_steps, 0.4))


def _edge_growth(plate: FinitePlate, outer: float) -> float:
    """Return the extension (m) of the sheet beyond a plate with side walls: t / 2 pi ln(D / t).

    `outer` (m) is the coil's outer radius. The form is from a thick strip (a logarithm of size divided by thickness).
    The coil's diameter D in it is a fit to boxes of surface loops (tests/validation).
    """
    thickness = _effective_thickness(plate, outer)
    if thickness <= 0.0:
        return 0.0
    return thickness / (2.0 * math.pi) * math.log(max(2.0 * outer / thickness, math.e))


def _depth_and_reach(coil: CoaxialRings, offsets: Array, gap: float) -> tuple[float, float]:
    """Return the height (m) of the plate above the nearest ring, and the radius (m) within which the field matters.

    The height is at least a hundredth of the largest ring's radius.
    """
    outer = float(coil.radii.max())
    depth = max(gap - float(coil.heights.max()), 1e-2 * outer)
    return depth, float(np.hypot(*offsets.T).max()) + outer + MARGIN * (outer + depth)


def _sheet_depth(plate: FinitePlate, outer: float) -> float:
    """Return the depth (m) of the sheet below the near face of a plate.

    `outer` (m) is the coil's outer radius. The sheet is in the middle of a thin plate and at most at the depth
    `DEEPEST`. The function is smooth, because the loss is its slope. Chosen here by comparison with boxes of loops.
    """
    middle, deepest = 0.5 * _effective_thickness(plate, outer), DEEPEST * 2.0 * outer
    return float(middle * (1.0 + (middle / deepest) ** 4) ** -0.25)


def _effective_thickness(plate: FinitePlate, outer: float) -> float:
    """Return a plate's thickness (m), limited to the part that has an effect (`THICKEST` and `STOUTEST`)."""
    return min(plate.thickness, THICKEST * 2.0 * outer, STOUTEST * min(plate.size))


def ratio_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Return the relative error (no unit) of `plate_ratio`.

    It depends on the plate's thickness and width, each divided by the coil's diameter.

    Source: comparison with boxes of surface loops and discs of rings (tests/validation).
    """
    thick, wide = np.array([plate.thickness, min(plate.size)]) / (2.0 * float(coil.radii.max()))
    narrow = error_with_transition(thick, 0.03 / EASED, 0.05, 0.12)
    broad = error_with_transition(thick, 0.055, 0.03, 0.05)
    return error_with_transitions(wide, ((0.24, 0.9), (0.35, 0.25), (0.6, narrow)), broad)


def loss_ratio_error(plate: FinitePlate, coil: CoaxialRings) -> float:
    """Return the relative error (no unit) of `plate_loss_ratio`, mostly from a comparison with discs.

    The ratio is too large for small thick plates.
    """
    thick, wide = np.array([plate.thickness, min(plate.size)]) / (2.0 * float(coil.radii.max()))
    return error_with_transitions(wide, ((0.2, 0.5), (0.6, 0.4)), error_with_transition(thick, 0.03 / EASED, 0.15, 0.2))


EASED = 1.4
"""Upper limit of the size in a transition between two errors, divided by the lower limit.

Errors were measured at some sizes. The returned error is nowhere below a measured error, and it has no jump.
"""


def error_with_transition(value: float, limit: float, before: float, after: float) -> float:
    """Return an error (no unit): `before` up to a `limit` of `value`, `after` from `EASED` times the limit.

    Between them the transition is smooth.
    """
    part = min(max((value / limit - 1.0) / (EASED - 1.0), 0.0), 1.0)
    return before + (after - before) * part * part * (3.0 - 2.0 * part)


def error_with_transitions(value: float, steps: Sequence[tuple[float, float]], last: float) -> float:
    """Return an error (no unit) that changes at several limits of `value`, with smooth transitions.

    `steps` are pairs (limit, error of smaller values) with rising limits. Beyond the last limit the error is `last`.
    """
    error = steps[0][1]
    for (limit, _), (_, after) in zip(steps, (*steps[1:], (math.inf, last)), strict=True):
        error = error_with_transition(value, limit, error, after)
    return error


def _infinite_plate_change(k: Array, weights: Array, spectrum: Array, room: float, poles: bool = False) -> float:
    """Return the size of the change of inductance by an infinite plate, divided by mu0 pi (m).

    It is the integral of the spectrum's square (Dodd and Deeds 1968) over wave numbers `k` (1/m) with `weights` (1/m).
    `room` (m) is the plate's distance from the mirror; the repeated reflections are a geometric series. With `poles`,
    the plate is magnetic.
    """
    sign = 1.0 if poles else -1.0
    echo = 1.0 + sign * np.exp(-2.0 * k * room) if math.isfinite(room) else 1.0
    return float(np.sum(weights * spectrum**2 / echo))


def _squared_field_share(
    plate: FinitePlate, half: Array, offsets: Array, source: Source, detail: float, bessel: Callable[[Array], Array]
) -> Array:
    """Return the part of the coil's squared field that falls on the plate, divided by the whole (places; no unit).

    `half` (m) are half sides of the plate, `offsets` (places, 2; m) positions of the coil's axis, `source` is the
    coil's spectrum. `detail` (m) is the length over which the field varies. `bessel` is J1 for the field along the
    plane, J0 for the field through it. The field at a distance from the axis is the Hankel transform of the spectrum.
    Its square over the whole plane is by Parseval's theorem (textbook).
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
    distances = np.hypot(x - offsets[:, 0, None, None], y - offsets[:, 1, None, None])
    radii = np.linspace(0.0, float(distances.max()), 2 * nodes.size + 20)
    table = bessel(radii[:, None] * k) @ (k * weights * spectrum)
    squared = _interpolate_even(distances, radii[1], table**2)
    return np.asarray((squared * area).sum(axis=(1, 2)) / (2.0 * math.pi * np.sum(weights * k * spectrum**2)))


def _wave_numbers(top: float, reach: float, panels: int | None = None) -> tuple[Array, Array]:
    """Return nodes and weights (n; 1/m) of an integral over wave numbers up to `top` (1/m), k = top t^2.

    `reach` (m) is the radius within which the field matters. Nodes are dense at wave numbers of the coil's size.
    """
    nodes, share = gauss(16)
    panels = panels or min(40, 8 + math.ceil(top * reach / 25.0))
    t = ((np.arange(panels)[:, None] + 0.5 * (1.0 + nodes)) / panels).ravel()
    return top * t * t, top * t * np.tile(share, panels) / panels


def _function_count(half: float, detail: float) -> int:
    """Return the number of functions along a side (no unit): even and odd functions in equal numbers.

    The functions resolve lengths of `half` divided by the number. `detail` (m) is the length over which the field
    varies.
    """
    return 2 * min(MOST_MODES // 2, 3 + math.ceil(0.8 * half / detail))


# The rectangle ------------------------------------------------------------------------------------------------------


def _fluxes(half: Array, offsets: Array, source: Source, counts: tuple[int, int]) -> Array:
    """Return the flux through a rectangle's functions, divided by mu0 / 2 (s, places, functions along x, along y; m).

    `half` (m) are half sides, `offsets` (places, 2; m) positions of the coil's axis, `counts` the numbers of functions
    along x and y. `source` has s spectra (s, k). The field is the integral of k J0(k r) times the spectrum. The flux is
    its projection by `_chebyshev_projection`.
    """
    u, v = (_chebyshev_projection(n) for n in counts)
    farthest = float(np.hypot(*(np.abs(offsets) + half).T).max())
    radii = np.linspace(0.0, farthest, 4 * max(counts) + 40)
    # normal flux density at distances from the axis, in units of mu0 / 2: the integral of k J0(k r) times the spectrum
    k, weights, spectrum = source
    table = np.asarray(j0(radii[:, None] * k) @ (k * weights * spectrum).T)
    x, y = half[0] * u[0] - offsets[:, 0, None], half[1] * v[0] - offsets[:, 1, None]
    distances = np.sqrt(x[:, :, None] ** 2 + y[:, None, :] ** 2)
    field = _interpolate_even(distances, radii[1], table)
    return np.asarray(half[0] * half[1] * (u[1] @ field.transpose(3, 0, 1, 2) @ v[1].T))


def _sheet_energies(half: Array, counts: tuple[int, int], rooms: Array, flux: Array, nodes: int) -> Array:
    """Return the size of the change of inductance by a rectangular sheet, divided by mu0 pi (planes, places; m).

    `flux` (planes, places, functions along x, along y) is the flux through the sheet's functions, `counts` are the
    numbers of functions. The planes have distances `rooms` (m) from a mirror.

    Notes
    -----
    Derived here: k = |kx| + |ky| - 2 |kx ky| / (k + |kx| + |ky|). The first two terms separate into closed integrals.
    The last term falls fast enough for plain quadrature at nodes along both sides. A mirror adds a reflection of k
    exp(-2 k room).
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
    """Return Gauss-Chebyshev points (n; no unit) of the second kind, and weights (functions, n).

    The weights project a field on the functions sqrt(1 - u^2) U_m(u), for m from 0 (Abramowitz and Stegun 25.4.40).
    """
    points = 2 * count + 8
    angle = math.pi * np.arange(1, points + 1) / (points + 1)
    weights = math.pi / (points + 1) * np.sin(angle)
    return np.cos(angle), weights * np.sin(np.arange(1, count + 1)[:, None] * angle)


def _interpolate_even(at: Array, step: float, table: Array) -> Array:
    """Interpolate an even function from its values at 0, step, 2 step ... by Catmull and Rom's spline (1974).

    `table` holds the values, possibly in several columns (steps, n); results have its unit. `at` and `step` have one
    unit.
    """
    padded = np.concatenate((table[1:2], table, table[-1:], table[-1:]))
    a, b, c, d = (padded[shift : shift + len(table) - 1] for shift in range(4))
    terms = np.array([b, 0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (3.0 * (b - c) + d - a)])
    place = at / step
    cell = np.minimum(place.astype(int), len(table) - 2)
    t = (place - cell).reshape(*at.shape, *[1] * (table.ndim - 1))
    values: Array = terms[3, cell]
    for term in terms[2::-1]:
        values *= t
        values += term[cell]
    return values


def sheet_ratios(
    plate: FinitePlate, coil: CoaxialRings, offsets: Array, gaps: Array, floor: float = -math.inf
) -> Array:
    """Return approximate results of `plate_ratio` (gaps, offsets; no unit) at several gaps (m), for screening.

    The other arguments are explained in `plate_ratio`. Only the sheet is solved, with few waves and functions. The
    contribution of the volume is assumed to be proportional to the sheet's effect.
    """
    offsets, outer = np.atleast_2d(np.asarray(offsets, dtype=float)), float(coil.radii.max())
    middles = gaps + _sheet_depth(plate, outer)
    depth, reach = _depth_and_reach(coil, offsets, float(gaps.min()))
    half = np.minimum(0.5 * np.array(plate.size) + _edge_growth(plate, outer), reach)
    k, weights = _wave_numbers(ROUGH_TOP / depth, reach, ROUGH_PANELS)
    spectra, rooms = coil.spectra(k, middles, floor), middles - floor
    whole = np.array([_infinite_plate_change(k, weights, *plane) for plane in zip(spectra, rooms, strict=True)])
    detail = 0.5 * (min(depth, 0.5 * outer) + 0.5 * outer)
    planes = k, weights, spectra
    changes = _sheet_changes(plate.is_round, half, offsets, planes, detail, rooms, ROUGH_MODES, ROUGH_NODES)
    return np.minimum(changes / whole[:, None], 1.0)


ROUGH_TOP = 7.0
"""Largest wave number times the nearest gap in approximate ratios: waves that decay by up to exp(-7)."""

ROUGH_PANELS = 4
"""Number of panels, each of 16 wave numbers, in approximate ratios."""

ROUGH_MODES = 8
"""Largest number of functions along a side of a rectangle in approximate ratios."""

ROUGH_NODES = 8
"""Number of quadrature nodes in a panel of the energies in approximate ratios.

With twice this number, approximate ratios change by 2e-4.
"""


def _rectangle_energy(half: Array, x: Array, y: Array, mixed: tuple[Array, Array]) -> Array:
    """Return the energies (planes, products, products; m) of products of Chebyshev's functions of orders `x` and `y`.

    They have a closed form except for the part with `mixed`, which is (remaining factor, transforms). Derived here from
    k |psi|^2 in Fourier space with the transforms of `_transforms`.
    """
    rest, transforms = mixed
    fx, fy = transforms[x.astype(int)], transforms[y.astype(int)]
    inner, outer = ((values[:, None] * values).reshape(-1, rest.shape[-1]) for values in (fx, fy))
    energy = (inner @ rest @ outer.T).reshape(-1, x.size, x.size, y.size, y.size)
    for row, (first, second) in enumerate(((x, y), (y, x))):
        slope = np.diag(0.5 * (first + 1.0)) / half[row]
        # integral over q > 0 of two transforms: by Parseval's theorem that of (1 - u^2) U_m U_n over the side, over pi,
        # with U_m = sin((m + 1) t) / sin t (textbook)
        difference, total = (second[:, None] - second) ** 2, (second[:, None] + second + 2) ** 2
        product = slope[:, :, None, None] * ((1.0 / (1.0 - difference) - 1.0 / (1.0 - total)) / math.pi)
        energy = energy + (product if row == 0 else product.transpose(2, 3, 0, 1))
    return math.pi**2 * half[0] * half[1] * energy.transpose(0, 1, 3, 2, 4).reshape(
        -1, x.size * y.size, x.size * y.size)


@lru_cache(maxsize=8)
def _transforms(count: int, panel: int) -> tuple[Array, Array, Array]:
    """Return nodes and weights over q > 0, and Fourier transforms (m, q; no unit) of the functions along a side.

    The functions are sqrt(1 - u^2) U_m(u) / pi for m < `count`. Each panel of length 8 has `panel` nodes. The
    transforms are (m + 1) J_(m+1)(q) / q with the sign of i^m: Bessel's integral (Abramowitz and Stegun 9.1.21) by
    parts.
    """
    panels = math.ceil((count + 40) / 8)
    nodes, share = gauss(panel)
    q = (8.0 * (np.arange(panels)[:, None] + 0.5 * (1.0 + nodes))).ravel()
    order = np.arange(1, count + 1)
    sign = np.where((order - 1) // 2 % 2, -1.0, 1.0)
    return q, np.tile(4.0 * share, panels), (sign * order)[:, None] * bessel_orders(q, count)[1:] / q


# The disc -----------------------------------------------------------------------------------------------------------


def _disc_change(
    radius: float, offsets: Array, source: Source, detail: float, rooms: Array, poles: bool = False
) -> Array:
    """Return the size of the change of inductance by a disc, divided by mu0 pi (s, places; m), for s spectra (s, k).

    The planes have distances `rooms` (m) from a mirror. With `poles`, the disc is magnetic. Each angular order is
    solved separately.

    Notes
    -----
    Derived here: functions exp(i m phi) with the transforms j_l(k R) / (k R), l = m + 1, m + 3 ..., have the energies 1
    / (2 l + 1). The reason is that these j_l are orthogonal over k (Abramowitz and Stegun 11.4.6). If there is a
    mirror, its reflection adds to the energies. Poles have j_l (k R), l = m, m + 2 ... but not 0, with equal energies.
    For them the reflection has the opposite sign.
    """
    k, weights, spectra = source
    count = _function_count(radius, detail) // 2 + 4
    highest = 2 * count
    radial = bessel_orders(k * radius, highest + 2 * count, True)
    distances = np.maximum(np.hypot(*offsets.T), 1e-9 * radius)
    around = bessel_orders((distances[:, None] * k).ravel(), highest).reshape(highest + 1, *distances.shape, *k.shape)
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
