"""Changes of inductance at many poses: computed for each pose, or interpolated if that is accurate enough."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.polynomials import Interpolant, chebyshev_points

Progress = Callable[[int, int], None]
"""Function that is called with the number of finished poses and the number of all poses."""
Spectrum = Callable[[Array], NDArray[np.generic]]
"""Function of frequencies (n; Hz) that returns factors (n) without a unit."""

FEW = 300  # Number of poses up to which each is solved
LINE = 21  # Chebyshev points along a line of poses that sets the number of grid points
TAIL = 2e-4  # Largest term left out of an interpolant, relative to the largest value
CHECKED = 16  # Number of poses at which an interpolant is compared with the exact solution
USUAL = 2e-3  # Largest error of an interpolant, relative to a change or 1 % of the free inductance


@record(eq=False)
class ExactSolver:
    """Exact computation of the inductance changes by the target at any poses.

    `solve` is a function of poses (n, 6; m, rad). It returns two arrays (frequencies, poses, coils, coils; H, complex)
    for one or two `frequencies` (Hz). The first holds the changes with the real metal behind the coils, the second with
    a lossless mirror in its place. `spectrum` is as in `Changes`.
    """

    frequencies: tuple[float, ...]
    solve: Callable[[Array], tuple[ComplexArray, ComplexArray]]
    spectrum: Spectrum = np.ones_like


@record(eq=False)
class Changes:
    """Changes of the inductance matrix at one or two frequencies: (frequencies, poses, coils, coils; H, complex).

    `total` are the changes with the real metal behind the coils, `lossless` with a lossless mirror in its place.
    `error` is the additional relative error by interpolation between poses.

    Changes are interpolated between the two frequencies, and extrapolated a little. The ratio of a change to `spectrum`
    is taken as linear in f^(-1/2), as skin depths are. `spectrum` (no unit, by frequency in Hz) is the reflection of an
    infinite sheet of the target's metal. Interpolation of the change itself has at least twice the error, because the
    real change by a magnetic sheet passes zero. A single frequency supplies the changes for every frequency.
    """

    frequencies: tuple[float, ...]
    total: ComplexArray
    lossless: ComplexArray
    error: float = 0.0
    spectrum: Spectrum = np.ones_like

    def complex_at(self, frequencies: Array) -> ComplexArray:
        """Return the changes `total` (n, coils, coils; H, complex) of n poses, each at its own frequency (n; Hz)."""
        return self._interpolate_frequencies(self.total, frequencies[:, None, None])

    def at(self, frequencies: Array) -> tuple[Array, Array]:
        """Return the inductance changes (n, coils, coils; H), and the loss in the target alone (n, coils; ohm).

        Each pose and coil has its own frequency (n, coils; Hz).
        """
        pairs = 0.5 * (frequencies[:, :, None] + frequencies[:, None, :])
        lost = self._interpolate_frequencies(np.einsum("fpcc->fpc", self.lossless), frequencies).imag
        return self._interpolate_frequencies(self.total, pairs).real, np.asarray(-2.0 * math.pi * frequencies * lost)

    def _interpolate_frequencies(self, changes: ComplexArray, frequencies: Array) -> ComplexArray:
        """Return changes interpolated to frequencies (Hz): (poses, ...).

        `changes` (1 or 2, poses, ...) are at the frequencies of the solution. `frequencies` broadcast to the shape
        (poses, ...).
        """
        if len(self.frequencies) == 1:
            return changes[0].copy()
        low, high = self.frequencies
        part = (frequencies**-0.5 - low**-0.5) / (high**-0.5 - low**-0.5)
        ends = self.spectrum(np.array([low, high]))
        first, last = changes[0] / ends[0], changes[1] / ends[1]
        at = self.spectrum(frequencies.ravel()).reshape(frequencies.shape)
        return np.asarray(at * (first + part * (last - first)))


def changes_at_poses(
    exact: ExactSolver, poses: Array, scale: float, tolerance: float | None = None, progress: Progress | None = None
) -> Changes:
    """Return the changes at poses (n, 6; m, rad). More than `FEW` poses are interpolated if that is accurate enough.

    `scale` (H) is the free inductance. `tolerance` is the largest error by interpolation, divided by the larger of a
    change and 1 % of `scale`. `exact` computes the changes without interpolation.
    """
    if len(poses) > FEW:
        most = USUAL if tolerance is None else min(tolerance, USUAL)
        changes = _interpolate_poses(exact, poses, scale, most, progress)
        if changes is not None:
            return changes
    return Changes(exact.frequencies, *_solve_all(exact, poses, progress), spectrum=exact.spectrum)


AT_ONCE = 64
"""Number of poses whose changes are computed in one batch."""


def _solve_all(exact: ExactSolver, poses: Array, progress: Progress | None) -> tuple[ComplexArray, ComplexArray]:
    """Return `total` and `lossless` of `Changes` for all poses, in batches. `progress` is called after each batch."""
    parts = []
    for k in range(0, max(len(poses), 1), AT_ONCE):
        parts.append(exact.solve(poses[k : k + AT_ONCE]))
        if progress is not None:
            progress(min(k + AT_ONCE, len(poses)), len(poses))
    total, lossless = (np.concatenate(some, axis=1) for some in zip(*parts, strict=True))
    return total, lossless


def _interpolate_poses(
    exact: ExactSolver, poses: Array, scale: float, tolerance: float, progress: Progress | None
) -> Changes | None:
    """Return the changes at poses (n, 6; m, rad), interpolated from a grid of poses.

    None if the grid has too many points to save time, or if the error by interpolation exceeds the tolerance. `exact`
    computes the changes at points of the grid, and `scale` (H) is the free inductance.
    """
    low, high = poses.min(axis=0), poses.max(axis=0)
    moved = [axis for axis in range(6) if high[axis] - low[axis] > 1e-12]
    if not moved:
        return None
    decay = _decay_rate(exact, low, high)
    grid = _pose_grid(exact, low, high, moved, decay)
    if math.prod(len(points) for points in grid) > 0.6 * len(poses):
        return None
    nodes = np.tile(0.5 * (low + high), (math.prod(map(len, grid)), 1))
    nodes[:, moved] = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, len(moved))
    values = _pack_parts(_solve_all(exact, nodes, progress)) * np.exp(decay * nodes[:, 2])[:, None]
    surrogate = Interpolant(low[moved], high[moved], values.reshape(*map(len, grid), -1))

    def through(some: Array) -> Array:
        return surrogate(some[:, moved]) * np.exp(-decay * some[:, 2])[:, None]

    generator = np.random.default_rng(7)
    checked = poses[generator.choice(len(poses), CHECKED, replace=False)]
    true = _pack_parts(exact.solve(checked))
    apart = np.abs(through(checked) - true) / np.maximum(np.abs(true), 0.01 * scale)
    error = 2.0 * float(apart.max())
    if error > tolerance:
        return None
    frequencies, coils, flat = len(exact.frequencies), exact.solve(poses[:1])[0].shape[-1], through(poses)
    half = flat.shape[1] // 2  # real parts first, as in `_pack_parts`
    matrices = (flat[:, :half] + 1j * flat[:, half:]).reshape(-1, 2, frequencies, coils, coils)
    total, lossless = np.moveaxis(matrices, 0, 2)
    return Changes(exact.frequencies, total, lossless, error, exact.spectrum)


def _pack_parts(changes: tuple[ComplexArray, ComplexArray]) -> Array:
    # The changes as real numbers, with poses as the first axis.
    stacked = np.stack(changes)
    flat = np.moveaxis(stacked, 2, 0).reshape(stacked.shape[2], -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _decay_rate(exact: ExactSolver, low: Array, high: Array) -> float:
    """Return the decay rate (1/m) of the changes with the target's height, from the lowest to the highest pose.

    `low` and `high` (6) are the least and the largest components of all poses.
    """
    if high[2] - low[2] < 1e-12:
        return 0.0
    ends = np.tile(0.5 * (low + high), (2, 1))
    ends[:, 2] = low[2], high[2]
    size = np.abs(exact.solve(ends)[0]).max(axis=(0, 2, 3))
    return float(math.log(size[0] / size[1]) / (high[2] - low[2]))


def _pose_grid(exact: ExactSolver, low: Array, high: Array, moved: Sequence[int], decay: float) -> list[Array]:
    """Return Chebyshev points along each component of the pose that varies (`moved`).

    Their number is chosen so that it resolves the changes on three lines along this component. The lines lie in the
    middle of the range, at the lowest height, and off-centre at the lowest height. `low` and `high` (6) are the least
    and the largest components of all poses. The changes are first divided by exp(-`decay` z), with z the height (m).
    """
    axes = []
    for axis in moved:
        lines = np.tile(0.5 * (low + high), (3, LINE, 1))
        lines[1:, :, 2] = low[2]
        lines[2, :, :2] = low[:2] + 0.2 * (high[:2] - low[:2])
        lines[:, :, axis] = chebyshev_points(float(low[axis]), float(high[axis]), LINE)
        flat = lines.reshape(-1, 6)
        values = _pack_parts(exact.solve(flat)) * np.exp(decay * flat[:, 2])[:, None]
        waves = np.cos(np.arange(LINE)[:, None] * (math.pi * (np.arange(LINE) + 0.5) / LINE))
        size = np.abs(np.einsum("kl,nlv->nkv", waves, values.reshape(3, LINE, -1))) / LINE
        sizes = size.max(axis=(0, 2)) / max(float(np.abs(values).max()), 1e-300)
        count = 1 + max((k for k in range(LINE) if sizes[k] > TAIL), default=1)
        axes.append(chebyshev_points(float(low[axis]), float(high[axis]), min(max(count + 1, 3), LINE)))
    return axes
