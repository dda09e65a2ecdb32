"""Coupling of the coils of an array: mutual inductances with errors, and idle coils grounded at the converter."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.late import late
from sitscad.estimates.windings.methods import WindingGeometry
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.rings import mean_rings
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.layout.board import Coil
from sitscad.spec.coil import CoilSpec
from sitscad.spec.sensor import ReadoutSpec

if TYPE_CHECKING:
    from sitscad.kernels.electromagnetics.inductance.side_by_side import SideBySide

# a check of a single coil needs neither (1 ms)
spirals_side_by_side = late("sitscad.kernels.electromagnetics.inductance.side_by_side", "spirals_side_by_side")
tracks_side_by_side = late("sitscad.kernels.electromagnetics.inductance.side_by_side", "tracks_side_by_side")

Placed = tuple[Coil, WindingGeometry]  # A coil and its winding about its own centre
FAR_ERROR, NEAR_ERROR = 4e-5, 1e-4  # Relative error of a mutual inductance far away, and its increase by nearness

END_ERROR = 5e-4
"""Factor of the additional error (H) of a mutual inductance, caused by open ends of one winding beside the other coil.

The error is the product of this factor, the nearness of both coils, the number of pairs of layers, the track width and
mu0/(4 pi).
"""


def inductance_matrix(self_inductance: float, self_error: float, coils: list[Placed]) -> tuple[Array, Array]:
    """Return the inductance matrix (H) of coils with equal inductances, and error bounds of its elements (H).

    `self_inductance` (H) is each coil's own inductance, and `self_error` its relative error bound. Each distinct
    displacement of two kinds of coils is computed once.
    """
    count = len(coils)
    matrix = np.full((count, count), self_inductance)
    errors = np.full((count, count), self_inductance * self_error)
    solved: dict[tuple[object, ...], SideBySide] = {}
    for i in range(count):
        for j in range(i):
            first, second = coils[i][0], coils[j][0]
            dx, dy = first.centre.x - second.centre.x, first.centre.y - second.centre.y
            turns = [(round(each.placement.rotation, 9), each.placement.own) for each in (first, second)]
            if (dx, dy) < (0.0, 0.0):
                dx, dy, turns = -dx, -dy, turns[::-1]
            key = round(dx, 9), round(dy, 9), *turns
            if key not in solved:
                solved[key] = winding_pair_inductance(coils[i], coils[j])
            matrix[i, j] = matrix[j, i] = solved[key].inductance
            errors[i, j] = errors[j, i] = mutual_error(solved[key], coils[i][1].spec)
    return matrix, errors


def mutual_error(pair: SideBySide, spec: CoilSpec) -> float:
    """Return the error bound (H) of a mutual inductance.

    The bound was fitted by comparison with the volume integral over random pairs of coils
    (tests/validation/coil_pairs.py). `pair` is the result for two coils, with their mutual inductance and nearness.
    """
    relative = FAR_ERROR + NEAR_ERROR * pair.nearness
    ends = END_ERROR * pair.nearness * len(spec.layers) ** 2 * MU0 / (4.0 * math.pi) * spec.trace_width
    return relative * abs(pair.inductance) + ends


ROUGH_MUTUAL = 0.15
"""Relative error of mutual inductances by moments, for coils that do not touch."""

ORDERS = 8
"""Number of moments per coil in the rough computation of mutual inductances."""


def rough_inductance_matrix(
    spirals: Sequence[SpiralLayer], centres: Sequence[tuple[float, float]], self_inductance: float, error: float
) -> tuple[Array, Array]:
    """Return the rough inductance matrix (H) of identical spirals in one plane, and error bounds of its elements (H).

    The spirals are computed as rings, by moments of the rings. For two coils in a plane, M is mu0 pi times the integral
    of S(k)^2 J0(k d). S is the sum of a J1(k a) over rings of radius a, and d is the coils' distance. J1 is expanded in
    its series. The integral of k^s J0(k d) is Weber's: 2^s d^(-s-1) Gamma((1+s)/2) / Gamma((1-s)/2). `centres` (m) are
    the coils' centres, `self_inductance` (H) each coil's own inductance, and `error` its relative error.
    """
    rings = mean_rings(spirals)
    moments = [
        (-1) ** m * float(np.sum(rings.parts * rings.radii * (0.5 * rings.radii) ** (2 * m + 1)))
        / (math.factorial(m) * math.factorial(m + 1)) for m in range(ORDERS)
    ]
    distances = np.array([[math.dist(centre, other) for other in centres] for centre in centres])
    apart, mutual = np.where(distances > 0.0, distances, 1.0), np.zeros_like(distances)
    for m, n in product(range(ORDERS), repeat=2):
        s = 2 * (m + n + 1)
        weber = 2.0**s * math.gamma(0.5 * (1 + s)) / math.gamma(0.5 * (1 - s))
        mutual += moments[m] * moments[n] * weber * apart ** (-s - 1.0)
    matrix = np.where(distances > 0.0, MU0 * math.pi * mutual, self_inductance)
    return matrix, np.abs(matrix) * np.where(distances > 0.0, ROUGH_MUTUAL, error)


def winding_pair_inductance(first_coil: Placed, second_coil: Placed) -> SideBySide:
    """Return the mutual inductance of two coils, for currents that enter each coil at its outer end on layer 1.

    Each coil is given with its winding about its own centre.
    """
    (first, a), (second, b) = first_coil, second_coil
    displacement = (second.centre.x - first.centre.x, second.centre.y - first.centre.y)
    if a.spirals:
        return spirals_side_by_side(a.spirals, b.spirals, displacement)
    return tracks_side_by_side(a.drawn, b.drawn, displacement)


Circuit = Callable[[Array], tuple[Array, Array]]  # Inductance (H) and resistance (ohm) at (n,) frequencies (Hz)

Mutual = Callable[[int, int, Array], ComplexArray]
"""Function of two coil numbers and (n) frequencies (Hz) that returns their mutual inductance (n; H, complex)."""


def idle_coil_load(omega: Array, readout: ReadoutSpec) -> ComplexArray:
    """Return the impedance (n; ohm) between an idle coil's contacts: the cable, and both converter pins to ground.

    `omega` (n) is in rad/s. Each pin has about 10 ohm to ground (`idle_pin_resistance`), so the loop has twice this
    resistance. Capacitors across the loop are left out: compared with 20 ohm, they carry almost no current up to 10
    MHz.
    """
    pins, cable = 2.0 * readout.device.limit("idle_pin_resistance"), readout.cable
    resistance, inductance = (0.0, 0.0) if cable is None else (cable.resistance, cable.inductance)
    return np.asarray(pins + resistance + 1j * omega * inductance)


def impedance_with_idle_coils(
    active: int, impedances: ComplexArray, frequencies: Array, load: ComplexArray
) -> tuple[Array, Array]:
    """Return inductance (n; H) and resistance (n; ohm) of coil number `active` at (n) frequencies (Hz), others idle.

    `impedances` are inductance matrices (n, coils, coils; H, complex: the imaginary part times -omega is a resistance).
    `load` (n; ohm) closes the idle coils' contacts. Each idle loop has zero voltage: Z = Z_aa - Z_ai Z_ii^-1 Z_ia.
    """
    omega = 2.0 * math.pi * frequencies
    impedance = impedances[:, active, active]
    idle = [i for i in range(impedances.shape[1]) if i != active]
    if idle:
        loops = impedances[:, idle][:, :, idle] + np.eye(len(idle)) * (load / (1j * omega))[:, None, None]
        towards = impedances[:, active, idle]
        impedance = impedance - np.einsum("ni,ni->n", towards, np.linalg.solve(loops, towards[..., None])[..., 0])
    return impedance.real, -omega * impedance.imag


def idle_neighbour_effect(active: int, circuits: Sequence[Circuit], mutual: Mutual, readout: ReadoutSpec) -> Circuit:
    """Return the effect of all other coils, which are idle, on the active coil: a function of frequencies (n; Hz).

    The function returns changes of inductance (n; H) and resistance (n; ohm). `circuits` return each coil's own
    inductance and resistance, `mutual` the (complex) mutual inductance of two coils.
    """

    def added(frequencies: Array) -> tuple[Array, Array]:
        """Return the changes of inductance (n; H) and resistance (n; ohm) of the active coil by the idle coils."""
        omega, count = 2.0 * math.pi * frequencies, len(circuits)
        matrix = np.zeros((omega.size, count, count), dtype=np.complex128)
        for i, j in product(range(count), repeat=2):
            if i != j:
                matrix[:, i, j] = mutual(i, j, frequencies)
            elif i != active:
                inductance, resistance = circuits[i](frequencies)
                matrix[:, i, i] = inductance - 1j * resistance / omega
        return impedance_with_idle_coils(active, matrix, frequencies, idle_coil_load(omega, readout))

    return added
