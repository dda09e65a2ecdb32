"""Changes at many poses: all of them exactly, or a map through some of them where that is as good."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.polynomials import Interpolant, chebyshev_points

Progress = Callable[[int, int], None]
Spectrum = Callable[[Array], NDArray[np.generic]]

FEW = 300  # Poses up to which each is worked out by itself
LINE = 21  # Chebyshev points along a line of poses by which it is seen how many a map needs there
TAIL = 2e-4  # Part of the largest value that the terms left out of a map may have
CHECKED = 16  # Poses at which a map is held against what is exact
USUAL = 2e-3  # Error of a map that is taken, of the larger of a change and 1 % of the free inductance


@record(eq=False)
class Exact:
    """What gives the changes at (n, 6) poses at some frequencies (Hz): all, and with no loss in the mirror.

    `like` is as of `Changes`.
    """

    frequencies: tuple[float, ...]
    solve: Callable[[Array], tuple[ComplexArray, ComplexArray]]
    like: Spectrum = np.ones_like


@record(eq=False)
class Changes:
    """Changes of the inductance matrix (H, complex), (frequencies, poses, coils, coils); `lossless` are those with a
    mirror that does not lose. `error` is what interpolation adds to their relative errors.

    In between, and a little beyond, their ratio to a spectrum that is `like` them (no unit, of frequencies in Hz) is
    straight in one over the root of the frequency, as skin depths are: that of an endless sheet of the metal leaves
    half or less of what the change itself would be off by, for a magnetic sheet's own change of L passes zero. If
    `frequencies` is a single frequency, nothing is interpolated: its changes serve for every frequency.
    """

    frequencies: tuple[float, ...]
    total: ComplexArray
    lossless: ComplexArray
    error: float = 0.0
    like: Spectrum = np.ones_like

    def complex_at(self, frequencies: Array) -> ComplexArray:
        """All of it at (n,) frequencies, one a pose."""
        return self._between(self.total, frequencies[:, None, None])

    def at(self, frequencies: Array) -> tuple[Array, Array]:
        """The change (H) at (n, coils) frequencies, and the loss (ohm) in the target alone, (n, coils)."""
        pairs = 0.5 * (frequencies[:, :, None] + frequencies[:, None, :])
        lost = self._between(np.einsum("fpcc->fpc", self.lossless), frequencies).imag
        return self._between(self.total, pairs).real, np.asarray(-2.0 * math.pi * frequencies * lost)

    def _between(self, changes: ComplexArray, frequencies: Array) -> ComplexArray:
        """Changes (2, poses, ...) at frequencies (Hz) of the shape of one of them, or of one that goes with it."""
        if len(self.frequencies) == 1:
            return changes[0].copy()
        low, high = self.frequencies
        part = (frequencies**-0.5 - low**-0.5) / (high**-0.5 - low**-0.5)
        ends = self.like(np.array([low, high]))
        first, last = changes[0] / ends[0], changes[1] / ends[1]
        at = self.like(frequencies.ravel()).reshape(frequencies.shape)
        return np.asarray(at * (first + part * (last - first)))


def mapped(
    exact: Exact, poses: Array, scale: float, tolerance: float | None = None, progress: Progress | None = None
) -> Changes:
    """The changes at poses; `scale` (H) is the free inductance. Through a map where there are many poses."""
    if len(poses) > FEW:
        found = _interpolated(exact, poses, scale, USUAL if tolerance is None else min(tolerance, USUAL), progress)
        if found is not None:
            return found
    return Changes(exact.frequencies, *_all(exact, poses, progress), like=exact.like)


AT_ONCE = 64


def _all(exact: Exact, poses: Array, progress: Progress | None) -> tuple[ComplexArray, ComplexArray]:
    """Changes in all poses, some at once, with word of the progress."""
    parts = []
    for k in range(0, max(len(poses), 1), AT_ONCE):
        parts.append(exact.solve(poses[k : k + AT_ONCE]))
        if progress is not None:
            progress(min(k + AT_ONCE, len(poses)), len(poses))
    total, lossless = (np.concatenate(some, axis=1) for some in zip(*parts, strict=True))
    return total, lossless


def _interpolated(
    exact: Exact, poses: Array, scale: float, tolerance: float, progress: Progress | None
) -> Changes | None:
    """Changes by a grid of poses that is interpolated; None where that costs more, or is off by more than the
    tolerance.
    """
    low, high = poses.min(axis=0), poses.max(axis=0)
    moved = [axis for axis in range(6) if high[axis] - low[axis] > 1e-12]
    if not moved:
        return None
    decay = _decay(exact, low, high)
    grid = _grid(exact, low, high, moved, decay)
    if math.prod(len(points) for points in grid) > 0.6 * len(poses):
        return None
    nodes = np.tile(0.5 * (low + high), (math.prod(map(len, grid)), 1))
    nodes[:, moved] = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, len(moved))
    values = _packed(_all(exact, nodes, progress)) * np.exp(decay * nodes[:, 2])[:, None]
    chart = Interpolant(low[moved], high[moved], values.reshape(*map(len, grid), -1))

    def through(some: Array) -> Array:
        return chart(some[:, moved]) * np.exp(-decay * some[:, 2])[:, None]

    generator = np.random.default_rng(7)
    tried = poses[generator.choice(len(poses), CHECKED, replace=False)]
    true = _packed(exact.solve(tried))
    apart = np.abs(through(tried) - true) / np.maximum(np.abs(true), 0.01 * scale)
    error = 2.0 * float(apart.max())
    if error > tolerance:
        return None
    frequencies, coils, flat = len(exact.frequencies), exact.solve(poses[:1])[0].shape[-1], through(poses)
    half = flat.shape[1] // 2  # as packed
    both = (flat[:, :half] + 1j * flat[:, half:]).reshape(-1, 2, frequencies, coils, coils)
    total, lossless = np.moveaxis(both, 0, 2)
    return Changes(exact.frequencies, total, lossless, error, exact.like)


def _packed(changes: tuple[ComplexArray, ComplexArray]) -> Array:
    # Real numbers, poses first.
    both = np.stack(changes)
    flat = np.moveaxis(both, 2, 0).reshape(both.shape[2], -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _decay(exact: Exact, low: Array, high: Array) -> float:
    """How fast (1/m) the changes die away with the height."""
    if high[2] - low[2] < 1e-12:
        return 0.0
    ends = np.tile(0.5 * (low + high), (2, 1))
    ends[:, 2] = low[2], high[2]
    size = np.abs(exact.solve(ends)[0]).max(axis=(0, 2, 3))
    return float(math.log(size[0] / size[1]) / (high[2] - low[2]))


def _grid(exact: Exact, low: Array, high: Array, moved: Sequence[int], decay: float) -> list[Array]:
    """Points along each moved axis: as many as two lines need, through the middle and where the target is nearest."""
    found = []
    for axis in moved:
        lines = np.tile(0.5 * (low + high), (3, LINE, 1))
        lines[1:, :, 2] = low[2]
        lines[2, :, :2] = low[:2] + 0.2 * (high[:2] - low[:2])
        lines[:, :, axis] = chebyshev_points(float(low[axis]), float(high[axis]), LINE)
        flat = lines.reshape(-1, 6)
        values = _packed(exact.solve(flat)) * np.exp(decay * flat[:, 2])[:, None]
        waves = np.cos(np.arange(LINE)[:, None] * (math.pi * (np.arange(LINE) + 0.5) / LINE))
        size = np.abs(np.einsum("kl,nlv->nkv", waves, values.reshape(3, LINE, -1))) / LINE
        wanted = size.max(axis=(0, 2)) / max(float(np.abs(values).max()), 1e-300)
        count = 1 + max((k for k in range(LINE) if wanted[k] > TAIL), default=1)
        found.append(chebyshev_points(float(low[axis]), float(high[axis]), min(max(count + 1, 3), LINE)))
    return found
