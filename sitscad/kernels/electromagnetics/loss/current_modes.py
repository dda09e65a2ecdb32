"""Alternating current in parallel tracks, with the current density over each cross-section as a sum of Legendre modes.

The first mode carries the net current. The other modes carry none. They are driven by the magnetic flux between the
edges of a track. The partial-element equations of the modes (Ruehli 1974) are diagonal in resistance, so one short
Lanczos recursion gives R and L at every frequency.

Modes of different tracks interact as in straight parallel tracks: they carry no net current, so their field is local.
The flux that drives them comes from the whole real path. It is computed by the module that makes the `Cut`, which is
the cross-sections of the tracks in a plane.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.loss.mode_matrix import NearAndFar, mode_matrix
from sitscad.kernels.electromagnetics.loss.track_modes import Cut, ModeSet, local_points, mode_conductances, projection
from sitscad.kernels.electromagnetics.special_functions import gauss, legendre

TRUSTED = 1e-3
"""Largest part of the resistance from negative relaxation times, divided by the whole, for a resolved resistance.

Negative relaxation times are numerical errors. Rounding alone leaves 1e-20.
"""

SETTLED, SETTLED_AT, FEWEST_STEPS = 3e-4, 20e6, 4
"""End of a Lanczos recursion: largest relative change of R and L in a step, its frequency (Hz), fewest steps.

The recursion ends if one step changes R and L at the frequency `SETTLED_AT` by at most the fraction `SETTLED`. At this
frequency, the remaining error is a third of the fraction. At 10 MHz it is 1e-5.
"""

FEW = 64
"""Number of modes up to which a full eigenvalue decomposition takes less time than a Lanczos recursion."""


@record(eq=False)
class ProximityLoss:
    """Resistance and inductance of a winding by frequency.

    Let w be the angular frequency. Each mode adds w^2 s / (1 + w^2 tau^2) to the resistance and subtracts w^2 s tau /
    (1 + w^2 tau^2) from the inductance.

    Attributes
    ----------
    direct : float
        resistance for direct current (ohm)
    rates : array (n,)
        relaxation times tau of the modes (s)
    strengths : array (n,)
        squared couplings s of the modes (ohm s2)
    direct_change : float
            inductance (H) for direct current minus the inductance of a uniform current. Direct current crowds to the
        inside of bends.
    unresolved : float
        part of the strengths (ohm s2) that belongs to negative relaxation times, which are numerical errors
    """

    direct: float
    rates: Array
    strengths: Array
    direct_change: float = 0.0
    unresolved: float = 0.0

    def resistance_ratio(self, frequency: float) -> float:
        """Return R(f) / R(0), the resistance at a frequency (Hz) divided by the resistance for direct current."""
        return float(self.resistance_ratios(np.array([frequency]))[0])

    def resistance_ratios(self, frequencies: Array) -> Array:
        """Return R(f) / R(0), the resistance divided by the resistance for direct current, at frequencies (n; Hz)."""
        return 1.0 + self._eddy_effects(frequencies)[0] / self.direct

    def is_resolved(self, frequency: float) -> bool:
        """Whether the resistance at a frequency (Hz) is accurate: the part from negative relaxation times is small.

        The limit is `TRUSTED`. If it is exceeded, the winding needs more modes or points.
        """
        doubt = (2.0 * math.pi * frequency) ** 2 * self.unresolved
        return doubt <= TRUSTED * self.direct * self.resistance_ratio(frequency)

    def inductance_changes(self, frequencies: Array) -> Array:
        """Return L(f) minus the inductance of a uniform current (H; n; never positive), at frequencies (n; Hz)."""
        return self.direct_change - self._eddy_effects(frequencies)[1]

    def _eddy_effects(self, frequencies: Array) -> tuple[Array, Array]:
        """Return the resistance (n; ohm) that eddy currents add and the inductance (n; H) that they subtract.

        Both are at `frequencies` (n; Hz). The result is cached, because coils and states share it.
        """
        key = frequencies.tobytes()
        if key not in self._known_effects:
            square = (2.0 * math.pi * frequencies[:, None]) ** 2
            added = square * self.strengths / (1.0 + square * self.rates**2)
            self._known_effects[key] = np.sum(added, axis=1), added @ self.rates
        return self._known_effects[key]

    @cached_property
    def _known_effects(self) -> dict[bytes, tuple[Array, Array]]:
        """Results of `_eddy_effects` so far (ohm, H), by the bytes of the frequencies."""
        return {}

    def scaled(self, direct: float) -> ProximityLoss:
        """Return the loss of another length of the conductor, with the resistance `direct` (ohm) to direct current."""
        part = direct / self.direct
        return ProximityLoss(
            direct, self.rates, part * self.strengths, part * self.direct_change, part * self.unresolved
        )


def join_losses(parts: Sequence[ProximityLoss]) -> ProximityLoss:
    """Return the loss of a winding from its parts in series, whose modes do not interact: the sum of all parts."""
    conducting = [part for part in parts if part.direct > 0.0]
    return ProximityLoss(
        math.fsum(part.direct for part in conducting),
        np.concatenate([part.rates for part in conducting]),
        np.concatenate([part.strengths for part in conducting]),
        math.fsum(part.direct_change for part in conducting),
        math.fsum(part.unresolved for part in conducting),
    )


@record(eq=False)
class ModeSystem:
    """Equations of the current modes of the tracks in a plane, each mode scaled to unit resistance.

    Attributes
    ----------
    matrix : array (modes, modes) or NearAndFar
        relaxation times (s) of all modes with each other
    coupling : array (modes,)
        drive of each mode by 1 A in the winding
    source : array (modes,)
        direct current of 1 A as a sum of modes
    shift : array (modes,)
        this direct current minus a uniform current of 1 A, as a sum of modes
    carrier : array (tracks, modes)
        density of direct current in each track, a unit vector. Currents orthogonal to it have no net current.
    direct, change : float
            resistance (ohm) and change of inductance (H) for direct current, as `direct` and `direct_change` of
        `ProximityLoss`
    """

    matrix: Array | NearAndFar
    coupling: Array
    source: Array
    shift: Array
    carrier: Array
    direct: float
    change: float

    def project(self, vector: Array) -> Array:
        """Return vectors of modes (modes, ...) after subtracting their net current in every track.

        It is the projection orthogonal to the carriers.
        """
        tracks, modes = self.carrier.shape
        table = vector.reshape(tracks, modes, -1)
        net = np.matmul(self.carrier[:, None, :], table)
        return np.asarray((table - self.carrier[:, :, None] * net).reshape(vector.shape))

    def with_longer_tracks(self, factor: float, drive: Array) -> ModeSystem:
        """Return the equations for tracks `factor` times as long, plus the `drive` (modes) by the real path's flux."""
        root = math.sqrt(factor)
        return replace(self, coupling=root * self.coupling + drive, source=root * self.source, shift=root * self.shift,
                       direct=factor * self.direct, change=factor * self.change)

    def loss(self, steps: int) -> ProximityLoss:
        """Return R (ohm) and L (H) at every frequency, by a Lanczos recursion of at most `steps` steps.

        Systems with few modes (`FEW`) are solved by all eigenvalues.
        """
        return losses([self], steps)[0]

    def all_relaxation_times(self) -> tuple[Array, Array] | None:
        """Return all relaxation times (s) and their strengths (ohm s2). None if a Lanczos recursion takes less time."""
        if self.coupling.size > FEW or isinstance(self.matrix, NearAndFar):
            return None
        rates, vectors = np.linalg.eigh(self.project(self.project(self.matrix).T))
        return rates, (self.project(self.coupling) @ vectors) ** 2


def losses(systems: Sequence[ModeSystem], steps: int) -> list[ProximityLoss]:
    """Return R (ohm) and L (H) of systems that have one matrix and one carrier, but different drives.

    Their Lanczos recursions run together, because reading the matrix takes most of the time.
    """
    whole_measures = [system.all_relaxation_times() for system in systems]
    measures = [measure for measure in whole_measures if measure is not None]
    if len(measures) < len(systems):
        driven = np.stack([system.project(system.coupling) for system in systems])
        measures = _lanczos(systems[0].matrix, driven, steps, systems[0].project)
    return [
        ProximityLoss(system.direct, np.maximum(rates, 0.0), strengths, system.change,
                      float(np.sum(strengths[rates < 0.0])))
        for system, (rates, strengths) in zip(systems, measures, strict=True)
    ]


def mode_system(cut: Cut, smooth: Array | None, conductivity: float, modes: ModeSet,
                current: Array | None = None) -> ModeSystem:
    """Return the equations of the current modes of tracks in series.

    Parameters
    ----------
    cut : Cut
        cross-sections of the tracks in a plane
    smooth : array (tracks, points) or None
        flux (Wb/m/A) that the real path adds to the flux of straight parallel tracks (see `path_drive`)
    conductivity : float
        S/m
    modes : ModeSet
        modes of each cross-section
    current : array (tracks,), optional
        +1 or -1, the direction of the current through the plane; all +1 if left out

    Notes
    -----
    In a curved track direct current is proportional to 1 / radius.
    """
    current = np.ones(cut.across.size) if current is None else current
    matrix = mode_matrix(cut, conductivity, modes)
    roots = np.array([math.sqrt((2 * a + 1) * (2 * b + 1)) for a, b in modes.orders])
    amount = np.sqrt(cut.length / (conductivity * cut.width * cut.thickness))[:, None]
    # Of the modes P / sqrt(1 + curvature x): the current that each carries, and what an even density is made of.
    nodes, weights = gauss(modes.across + 2)
    root = np.sqrt(1.0 + 0.5 * (cut.curvature * cut.width)[:, None] * nodes)
    values = legendre(modes.across, nodes)
    a, b = np.array(modes.orders).T
    carried, even = (0.5 * weights / root) @ values, (0.5 * weights * root) @ values
    carrier, even = (np.where(b == 0, table[:, a], 0.0) * roots for table in (carried, even))
    size = np.sum(carrier**2, axis=1, keepdims=True)
    source = (carrier / size * current[:, None] * amount).ravel()
    shift = source - (even * current[:, None] * amount).ravel()
    coupling = matrix @ source
    change = 0.0
    if smooth is not None:
        outside = path_drive(cut, smooth, conductivity, modes)
        if shift.any():
            # direct current's inductance s' M s less an even one's, which has s - shift for s; and likewise outside
            change = float(shift @ (2.0 * coupling - matrix @ shift + 2.0 * outside))
        coupling = coupling + outside
    direct = float(np.sum(amount[:, 0] ** 2 / size[:, 0]))
    return ModeSystem(matrix, coupling, source, shift, carrier / np.sqrt(size), direct, change)


def path_drive(cut: Cut, smooth: Array, conductivity: float, modes: ModeSet) -> Array:
    """Return the drive (modes) of the modes by the flux that the real path adds to the flux of straight tracks.

    `smooth` (tracks, points; Wb/m/A) is the potential along each track per ampere, minus the potential of straight
    tracks. It is the vector potential times the path's length at the point, divided by the centre line's length. The
    potential of straight tracks is the sum of -mu0 / (2 pi) sqrt(length_j / length_i) ln(distance / `cut.unit`) over
    the other centre lines j. The conductivity is in S/m.
    """
    scale = mode_conductances(cut, conductivity, modes) * np.sqrt(cut.length)[:, None]
    stretch = np.sqrt(1.0 + cut.curvature[:, None] * 0.5 * cut.width[:, None] * local_points(modes)[0])
    return np.asarray(((smooth / stretch) @ projection(modes).T * scale).ravel())


def _lanczos(
    matrix: Array | NearAndFar, vectors: Array, steps: int, project: Callable[[Array], Array]
) -> list[tuple[Array, Array]]:
    """Return nodes (s) and weights (ohm s2) of the spectral measure of a symmetric matrix, for each vector (k, n).

    `vectors` are the drives, `project` removes the net currents. The nodes are a Gauss quadrature on the range of this
    projector, exact in 2 * steps moments. The method is Lanczos' recursion with full orthogonalisation (Golub and
    Meurant, Matrices, Moments and Quadrature with Applications, 2010). It ends early if R and L no longer change
    (`SETTLED`).
    """
    norms = np.linalg.norm(vectors, axis=1)
    count, length = min(steps, vectors.shape[1]), np.zeros(len(vectors), dtype=np.intp)
    basis = np.zeros((len(vectors), count + 1, vectors.shape[1]))
    basis[:, 0] = vectors / np.maximum(norms, 1e-300)[:, None]
    diagonal, beside = np.zeros((2, len(vectors), count))
    going, effect = norms > 0.0, np.zeros((2, len(vectors)))
    for k in range(count):
        image = np.ascontiguousarray(project(matrix @ np.ascontiguousarray(basis[:, k].T)).T)
        diagonal[:, k] = np.sum(basis[:, k] * image, axis=1)
        length[going] = k + 1
        if k + 2 >= FEWEST_STEPS:
            previous_effect, effect = effect, _relative_effects(diagonal[:, : k + 1], beside[:, :k])
            if k + 1 >= FEWEST_STEPS and np.all(np.abs(effect - previous_effect) <= SETTLED * np.abs(effect)):
                break
        for vectors_so_far, residual in zip(basis[:, : k + 1], image, strict=True):
            residual -= vectors_so_far.T @ (vectors_so_far @ residual)
            residual -= vectors_so_far.T @ (vectors_so_far @ residual)
        beside[:, k] = np.linalg.norm(image, axis=1)
        going &= beside[:, k] >= 1e-13 * np.abs(diagonal[:, 0])
        if not going.any():
            break
        basis[going, k + 1] = image[going] / beside[going, k, None]
    return [_spectral_measure(diagonal[i, :m], beside[i, : max(0, m - 1)], float(norms[i])) for i,
            m in enumerate(length)]


def _relative_effects(diagonal: Array, beside: Array) -> Array:
    """Return the relative effects on R and L at `SETTLED_AT` (2, k; no unit), from k matrices of relaxation times (s).

    The matrices are symmetric and tridiagonal, with the diagonals (k, n) and the off-diagonals `beside` (k, n - 1).
    Both effects are for a drive vector of length 1.
    """
    size = np.arange(diagonal.shape[1])
    table = np.zeros((len(diagonal), size.size, size.size))
    table[:, size, size] = diagonal
    table[:, size[1:], size[:-1]] = table[:, size[:-1], size[1:]] = beside
    rates, vectors = np.linalg.eigh(table)
    omega = 2.0 * math.pi * SETTLED_AT
    weights = vectors[:, 0] ** 2 / (1.0 + (omega * rates) ** 2)
    return np.stack([np.sum(weights, axis=1), np.sum(weights * omega * rates, axis=1)])


def _spectral_measure(diagonal: Array, beside: Array, norm: float) -> tuple[Array, Array]:
    """Return nodes (s) and weights of the spectral measure of a symmetric tridiagonal matrix (Golub and Welsch 1969).

    `diagonal` (n) and `beside` (n - 1) are the matrix. `norm` is the length of the driving vector.
    """
    if not diagonal.size:
        return np.zeros(1), np.zeros(1)
    values, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1))
    return values, norm**2 * vectors[0] ** 2
