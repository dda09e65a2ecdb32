"""Alternating current in parallel tracks: the density over every cross-section is a sum of Legendre modes.

The first mode carries the current; the others carry none and are driven by the flux between the edges. The
partial-element equations of the modes (Ruehli 1974) are diagonal in resistance, so a short Lanczos run gives R and L at
every frequency at once. Modes of different tracks see each other as parallel straight tracks do: they carry no net
current, so their field is local. What drives them is not local; whoever builds a `Cut` computes it from the real path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0
from sitscad.physics.legendre import gauss, legendre, legendre_integrals
from sitscad.record import record

Array = NDArray[np.float64]

TRUSTED = 1e-3
"""Share of a resistance that may rest on negative relaxation times: rounding leaves 1e-20."""

AT_ONCE = 16_000
"""Distances of points that are worked on at once: as many as stay near the processor."""

FEW = 64
"""Modes up to which all their relaxation times cost less than a Lanczos run."""

FIELD_POINTS = 5
"""Points across a track at which the field of distant currents is taken at most: it is smooth."""


@record
class ModeSet:
    """Highest orders across the width and through the thickness, and the Gauss points at which tracks see each other.

    A mode (a, b) is kept when a / across + b / through is at most 1, or every one when `full`.
    """

    across: int = 4
    through: int = 1
    points: tuple[int, int] = (4, 2)
    full: bool = False

    @property
    def orders(self) -> tuple[tuple[int, int], ...]:
        """Orders (across, through) of every mode; the first is (0, 0), the one that carries the current."""
        pairs = [(a, b) for b in range(self.through + 1) for a in range(self.across + 1)]
        if self.full:
            return tuple(pairs)
        return tuple((a, b) for a, b in pairs if a / self.across + b / max(self.through, 1) <= 1.0 + 1e-9)


def suited_modes(width: float, thickness: float, gap: float, depth: float, fine: bool) -> ModeSet:
    """Modes for tracks (m) at a skin depth: R within 1 % when `fine`, else 3 %.

    Legendre polynomials resolve a boundary layer of width / order^2: the orders follow the square root of width over
    depth, and of thickness over depth. The points follow them (a Gauss rule takes orders above its number of points for
    lower ones) and the width over `gap` (m), the least distance of tracks.
    """
    across = math.ceil((2.2 if fine else 1.8) * math.sqrt(width / depth))
    through = math.ceil((2.2 if fine else 1.5) * math.sqrt(thickness / depth))
    across, through = min(max(across, 6 if fine else 5), 24), min(max(through, 2), 12)
    near, deep = math.ceil((3.0 if fine else 2.0) + width / gap), math.ceil(1.0 + thickness / gap)
    return ModeSet(across, through, (min(max(across, near), 32), max(through + 1, min(deep, 16))))


@record(eq=False)
class ProximityLoss:
    """How a winding's resistance (ohm, relative to direct current) and inductance (H) change with frequency.

    `rates` are relaxation times (s), `strengths` the squared couplings (ohm s2): R = R0 + w2 s / (1 + w2 tau2),
    L = L0 - w2 s tau / (1 + w2 tau2), summed over the modes. `direct_change` (H) is what L0 differs by from the
    inductance of evenly spread current, because direct current crowds to the inside of a bend. `unresolved`
    (ohm s2) is what of the strengths belongs to negative relaxation times, which no real track has.
    """

    direct: float
    rates: Array
    strengths: Array
    direct_change: float = 0.0
    unresolved: float = 0.0

    def resistance_ratio(self, frequency: float) -> float:
        """R(f) / R(0) of the winding at a frequency (Hz)."""
        return float(self.resistance_ratios(np.array([frequency]))[0])

    def resistance_ratios(self, frequencies: Array) -> Array:
        """The same at every one of (n,) frequencies (Hz)."""
        omega = 2.0 * math.pi * frequencies[:, None]
        added = np.sum(omega**2 * self.strengths / (1.0 + (omega * self.rates) ** 2), axis=1)
        return np.asarray(1.0 + added / self.direct)

    def is_resolved(self, frequency: float) -> bool:
        """Whether modes and points were enough for R at a frequency (Hz): see `unresolved`."""
        doubt = (2.0 * math.pi * frequency) ** 2 * self.unresolved
        return doubt <= TRUSTED * self.direct * self.resistance_ratio(frequency)

    def inductance_change(self, frequency: float) -> float:
        """L(f) less the inductance of evenly spread current (H), never positive."""
        return float(self.inductance_changes(np.array([frequency]))[0])

    def inductance_changes(self, frequencies: Array) -> Array:
        """The same at every one of (n,) frequencies (Hz)."""
        omega = 2.0 * math.pi * frequencies[:, None]
        lag = omega**2 * self.rates
        return np.asarray(self.direct_change - np.sum(lag * self.strengths / (1.0 + (omega * self.rates) ** 2), axis=1))

    def scaled(self, direct: float) -> ProximityLoss:
        """The loss of as much of the same conductor as has another resistance (ohm) to direct current."""
        part = direct / self.direct
        return ProximityLoss(
            direct, self.rates, part * self.strengths, part * self.direct_change, part * self.unresolved
        )


def joined(parts: Sequence[ProximityLoss]) -> ProximityLoss:
    """Parts of one winding in series that do not see each other's modes."""
    kept = [part for part in parts if part.direct > 0.0]
    return ProximityLoss(
        math.fsum(part.direct for part in kept),
        np.concatenate([part.rates for part in kept]),
        np.concatenate([part.strengths for part in kept]),
        math.fsum(part.direct_change for part in kept),
        math.fsum(part.unresolved for part in kept),
    )


@record(eq=False)
class Cut:
    """Tracks where a plane crosses them at right angles, all arrays (n,) in metres.

    `across` and `height` are the centres in the plane, `length` is how much of each track's centre line the cut stands
    for, `curvature` (1/m) is that of the centre line, positive when `across` grows away from the centre.
    """

    across: Array
    height: Array
    width: Array
    thickness: Array
    length: Array
    curvature: Array

    @property
    def unit(self) -> float:
        """Length (m) in whose terms logarithms are taken: the mean radius of curvature, or the widest track."""
        bend = float(np.mean(np.abs(self.curvature)))
        return 1.0 / bend if bend > 0.0 else float(np.max(self.width))


def points_of(cut: Cut, modes: ModeSet) -> tuple[Array, Array]:
    """Places in the plane (n, points) at which the drive is wanted: across and height (m)."""
    x, z = _local_points(modes)
    return cut.across[:, None] + 0.5 * cut.width[:, None] * x, cut.height[:, None] + 0.5 * cut.thickness[:, None] * z


def field_nodes(modes: ModeSet) -> Array:
    """Places across a track, in half widths, at which `integrated` wants the normal field of distant currents."""
    return gauss(min(FIELD_POINTS, modes.points[0]))[0]


def integrated(field: Array, cut: Cut, modes: ModeSet) -> Array:
    """Flux (n, points; Wb/m/A) between a track's centre line and its points, from the field (n, nodes; T/A)."""
    return np.asarray(0.5 * cut.width[:, None] * (field @ _integrals(modes)), dtype=np.float64)


@lru_cache(maxsize=16)
def _integrals(modes: ModeSet) -> Array:
    # Values at the nodes to the integral of the polynomial through them, at the points.
    nodes = field_nodes(modes)
    coefficients = np.linalg.inv(legendre(nodes.size - 1, nodes))
    return np.asarray(coefficients.T @ legendre_integrals(nodes.size - 1, _local_points(modes)[0]).T)


def mode_matrix(cut: Cut, conductivity: float, modes: ModeSet) -> Array:
    """Relaxation times (s) of all modes of a cut among each other, scaled by resistances: (n modes, n modes)."""
    flat = mode_conductances(cut, conductivity, modes).ravel()
    mutual = _mutual_logs(cut, modes).reshape(flat.size, flat.size)
    mutual *= (-MU0 / (2.0 * math.pi) * flat)[:, None]
    mutual *= flat
    return mutual


def mode_conductances(cut: Cut, conductivity: float, modes: ModeSet) -> Array:
    """Square roots of what each mode of a metre of track conducts (n, modes)."""
    area = np.sqrt(conductivity * cut.width * cut.thickness)
    return np.asarray(area[:, None] * np.array([math.sqrt((2 * a + 1) * (2 * b + 1)) for a, b in modes.orders]))


@record(eq=False)
class ModeSystem:
    """The modes of a cut, each scaled to unit resistance: what current and flux do to them.

    `matrix` are relaxation times (s) of all modes among each other, `coupling` what a unit current drives them with,
    `source` is that current in modes and `shift` what of it is not even; `carrier` (tracks, modes) is each track's
    direct-current density, a unit vector: currents without it are free. `direct` (ohm), `change` (H) as in
    `ProximityLoss`.
    """

    matrix: Array
    coupling: Array
    source: Array
    shift: Array
    carrier: Array
    direct: float
    change: float

    def project(self, vector: Array) -> Array:
        """Vectors of modes (n modes, ...) without what carries net current in any track."""
        tracks, modes = self.carrier.shape
        table = vector.reshape(tracks, modes, -1)
        net = np.matmul(self.carrier[:, None, :], table)
        return np.asarray((table - self.carrier[:, :, None] * net).reshape(vector.shape))

    def loss(self, steps: int) -> ProximityLoss:
        """R and L at every frequency by a Lanczos run of so many steps; few modes are solved whole."""
        driven = self.project(self.coupling)
        if driven.size <= FEW:
            rates, vectors = np.linalg.eigh(self.project(self.project(self.matrix).T))
            strengths = (driven @ vectors) ** 2
        else:
            rates, strengths = _lanczos(self.matrix, driven, steps, self.project)
        below = float(np.sum(strengths[rates < 0.0]))
        return ProximityLoss(self.direct, np.maximum(rates, 0.0), strengths, self.change, below)


def mode_system(cut: Cut, smooth: Array | None, current: Array | None, conductivity: float, modes: ModeSet,
                matrix: Array | None = None) -> ModeSystem:  # fmt: skip
    """The modes of a cut's tracks in series, with `conductivity` in S/m.

    The tracks drive each other as straight parallel ones do; `smooth` (n, points; Wb/m/A) is what the real path adds:
    the vector potential along each track per ampere, times the path's length there over that of the centre line, less
    -mu0 / (2 pi) sum of sqrt(length_j / length_i) ln(distance / `cut.unit`) to the other centre lines. `current` (n,)
    is +1 or -1 (None: all +1), along one direction in space. Direct current divides as 1 / radius in a curved track.
    `matrix` is `mode_matrix` of a cut of the same places, when that is known.
    """
    current = np.ones(cut.across.size) if current is None else current
    matrix = mode_matrix(cut, conductivity, modes) if matrix is None else matrix
    roots = np.array([math.sqrt((2 * a + 1) * (2 * b + 1)) for a, b in modes.orders])
    amount = np.sqrt(cut.length / (conductivity * cut.width * cut.thickness))[:, None]
    carrier, even = (table * roots for table in _carrier(cut, modes))
    size = np.sum(carrier**2, axis=1, keepdims=True)
    source = (carrier / size * current[:, None] * amount).ravel()
    shift = source - (even * current[:, None] * amount).ravel()
    coupling = matrix @ source
    change = 0.0
    if smooth is not None:
        scale = mode_conductances(cut, conductivity, modes) * np.sqrt(cut.length)[:, None]
        outside = ((smooth / _stretch(cut, modes)) @ _projection(modes).T * scale).ravel()
        change = float(shift @ (2.0 * coupling - matrix @ shift + 2.0 * outside))
        coupling = coupling + outside
    direct = float(np.sum(amount[:, 0] ** 2 / size[:, 0]))
    return ModeSystem(matrix, coupling, source, shift, carrier / np.sqrt(size), direct, change)


def _stretch(cut: Cut, modes: ModeSet) -> Array:
    # Root of the length of a path at every point over that of the centre line (n, points).
    return np.asarray(np.sqrt(1.0 + cut.curvature[:, None] * 0.5 * cut.width[:, None] * _local_points(modes)[0]))


def cut_loss(cut: Cut, smooth: Array | None, current: Array | None, conductivity: float, modes: ModeSet,
             steps: int, matrix: Array | None = None) -> ProximityLoss:  # fmt: skip
    """Loss of a cut's tracks in series: `mode_system` by a Lanczos run of so many steps."""
    return mode_system(cut, smooth, current, conductivity, modes, matrix).loss(steps)


def parallel_tracks_loss(cut: Cut, current: Array, conductivity: float, modes: ModeSet, steps: int = 16,
                         ) -> ProximityLoss:  # fmt: skip
    """Loss of long straight parallel tracks, one alone or several with their currents (+1, -1)."""
    return cut_loss(cut, None, current, conductivity, modes, steps)


def _mutual_logs(cut: Cut, modes: ModeSet) -> Array:
    # <P_m ln(distance / unit) P_n> of all tracks (n, modes, n, modes).
    x, z = (table / cut.unit for table in points_of(cut, modes))
    count, points = x.shape
    projection = _projection(modes)
    mutual = np.empty((count, len(modes.orders), count, len(modes.orders)))
    firsts, seconds = np.triu_indices(count, 1)
    step = max(1, AT_ONCE // points**2)
    for low in range(0, firsts.size, step):
        i, j = firsts[low : low + step], seconds[low : low + step]
        squared = np.square(x[i][:, :, None] - x[j][:, None, :])
        squared += np.square(z[i][:, :, None] - z[j][:, None, :])
        np.log(np.maximum(squared, 1e-30, out=squared), out=squared)
        half = squared.reshape(-1, points) @ (0.5 * projection.T)
        block = projection @ half.reshape(i.size, points, -1)
        mutual[i, :, j, :] = block
        mutual[j, :, i, :] = np.swapaxes(block, 1, 2)
    for width, thickness in {(float(w), float(t)) for w, t in zip(cut.width, cut.thickness, strict=True)}:
        index = np.nonzero((cut.width == width) & (cut.thickness == thickness))[0]
        block = log_block(thickness / width, replace(modes, points=(1, 1))).copy()
        block[0, 0] += math.log(width / cut.unit)
        mutual[index, :, index, :] = block
    return np.asarray(mutual, dtype=np.float64)


def _carrier(cut: Cut, modes: ModeSet) -> tuple[Array, Array]:
    # Of the modes P / sqrt(1 + curvature x): the current that each carries, and what an even density is made of.
    nodes, weights = gauss(modes.across + 2)
    root = np.sqrt(1.0 + 0.5 * (cut.curvature * cut.width)[:, None] * nodes)
    values = legendre(modes.across, nodes)
    a, b = np.array(modes.orders).T
    carried, even = (0.5 * weights / root) @ values, (0.5 * weights * root) @ values
    return np.where(b == 0, carried[:, a], 0.0), np.where(b == 0, even[:, a], 0.0)


def _lanczos(matrix: Array, vector: Array, steps: int, project: Callable[[Array], Array]) -> tuple[Array, Array]:
    # Gauss quadrature of the spectral measure of a symmetric matrix on the projector's range: nodes and weights, exact
    # in 2 * steps moments.
    norm = float(np.linalg.norm(vector))
    if norm == 0.0:
        return np.zeros(1), np.zeros(1)
    count = min(steps, vector.size)
    basis = np.zeros((count + 1, vector.size))
    basis[0] = vector / norm
    diagonal, beside = [], []
    for k in range(count):
        image = project(matrix @ basis[k])
        diagonal.append(float(basis[k] @ image))
        kept = basis[: k + 1]
        image -= kept.T @ (kept @ image)
        image -= kept.T @ (kept @ image)
        size = float(np.linalg.norm(image))
        if size < 1e-13 * abs(diagonal[0]):
            break
        beside.append(size)
        basis[k + 1] = image / size
    small = np.diag(diagonal) + np.diag(beside[: len(diagonal) - 1], 1) + np.diag(beside[: len(diagonal) - 1], -1)
    values, vectors = np.linalg.eigh(small)
    return values, norm**2 * vectors[0] ** 2


@lru_cache(maxsize=16)
def _local_points(modes: ModeSet) -> tuple[Array, Array]:
    nx, nz = modes.points
    return np.repeat(gauss(nx)[0], nz), np.tile(gauss(nz)[0], nx)


@lru_cache(maxsize=16)
def split_projection(modes: ModeSet) -> tuple[Array, Array]:
    """Weights that project values at the points across (orders, points) and through a track on Legendre polynomials."""
    (gx, wx), (gz, wz) = gauss(modes.points[0]), gauss(modes.points[1])
    return (legendre(modes.across, gx) * 0.5 * wx[:, None]).T, (legendre(modes.through, gz) * 0.5 * wz[:, None]).T


@lru_cache(maxsize=16)
def _projection(modes: ModeSet) -> Array:
    # Modes times the weights of the mean over a cross-section (modes, points).
    across, through = split_projection(modes)
    return np.array([np.outer(across[a], through[b]).ravel() for a, b in modes.orders])


@lru_cache(maxsize=32)
def log_block(aspect: float, modes: ModeSet) -> Array:
    """Means over one rectangle of thickness / width `aspect` of mode times ln(distance / width) times mode.

    The quadruple integral becomes a double one over the differences of both coordinates, whose densities are
    polynomials; points crowd towards difference zero, where the logarithm is. Within 2e-6 of the closed mean distance.
    The points of the set are not used.
    """
    nodes, weights = gauss(16 + modes.through)
    t = 0.5 * (1.0 + nodes)
    dz, wz = 2.0 * t**3, weights * 3.0 * t**2
    nodes, weights = gauss(18 + 2 * modes.across)
    t = 0.5 * (1.0 + nodes)
    scale = np.maximum(aspect * dz, 1e-9)[:, None]
    top = np.arcsinh(2.0 / scale)
    u = top * t
    dx, wx = scale * np.sinh(u), 0.5 * weights * top * scale * np.cosh(u)
    kernel = 0.5 * np.log(0.25 * (dx**2 + (aspect * dz[:, None]) ** 2)) * wx * wz[:, None]
    through = _difference_density(dz, modes.through)
    across = _difference_density(dx.ravel(), modes.across)
    half = np.einsum("zbd,zx->bdzx", through, kernel).reshape(-1, kernel.size)
    table = (half @ across.reshape(kernel.size, -1)).reshape(*through.shape[1:], *across.shape[1:])
    a, b = np.array(modes.orders).T
    return np.asarray(table[b[:, None], b[None, :], a[:, None], a[None, :]])


def _difference_density(gap: Array, order: int) -> Array:
    # Mean of P_a(x) P_c(x') over the pairs on [-1, 1] that are `gap` apart, either way round: (gaps, a, c).
    nodes, weights = gauss(order + 1)
    half = 1.0 - 0.5 * gap[:, None]
    low, high = legendre(order, half * nodes - 0.5 * gap[:, None]), legendre(order, half * nodes + 0.5 * gap[:, None])
    one = np.swapaxes(low * (0.25 * half * weights)[..., None], 1, 2) @ high
    return np.asarray(one + np.swapaxes(one, 1, 2))
