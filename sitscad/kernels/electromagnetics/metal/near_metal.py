"""Current modes of a spiral winding beside metal: the eddy currents in the tracks see their images too.

The reflection of an even current is one thing, the crowding of the current in free air another; close to metal both act
at once, and their sum is wrong: the image of a wide track pulls the current back across its width. Here the modes of
every cut (`current_modes`) meet the reflected waves (`eddy_target`). In waves J1(k r) exp(+-k z) about the axis every
mode has an amplitude, the reflection multiplies it, so its matrix is a short sum of products. A Krylov subspace that
knows the drive of the winding and that of its images makes every frequency a small system.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, ComplexArray, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.loss.current_modes import ModeSystem
from sitscad.kernels.electromagnetics.loss.proximity import WindingCut
from sitscad.kernels.electromagnetics.loss.track_modes import (
    Cut,
    ModeSet,
    mode_conductances,
    points_of,
    split_projection,
)
from sitscad.kernels.electromagnetics.metal.current_spectrum import wave_numbers
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, returned_waves
from sitscad.kernels.electromagnetics.special_functions import j1

STEPS, ROUGH_STEPS = 5, 2
"""Steps of the block Krylov run, each adding up to three vectors; and of one for screening."""

MIDDLE = 3e6
"""Frequency (Hz) of the reflection that shapes the subspace."""

ABOUT = 1.25
"""Ratio of the distances of metal for which one subspace after another is found."""

PERFECT = 1e18
"""Conductivity (S/m) of metal that waves do not enter."""


@record(eq=False)
class _ReflectedCuts:
    # The modes of all cuts and their waves (cuts, 2 k, modes): those that decay downwards, then upwards. In single
    # precision, for they are most of what an estimate holds. Cuts with fewer tracks are filled up with zeros.
    systems: tuple[ModeSystem, ...]
    tables: NDArray[np.float32]

    @cached_property
    def carriers(self) -> Array:
        """Carriers of all cuts (cuts, tracks, modes of a track), of `ModeSystem`."""
        most = max(len(system.carrier) for system in self.systems)
        return np.stack([_filled(system.carrier, most) for system in self.systems])

    def vectors(self, of: Callable[[ModeSystem], Array]) -> Array:
        """A vector of each system (cuts, modes, 1), in its unit."""
        return np.stack([_filled(of(system), self.tables.shape[2]) for system in self.systems])[..., None]

    def project(self, vectors: Array) -> Array:
        """`ModeSystem.project` of vectors (cuts, modes, n), in their unit."""
        table = vectors.reshape(*self.carriers.shape, -1)
        net = self.carriers[:, :, None] @ table
        return np.asarray((table - self.carriers[..., None] * net).reshape(vectors.shape))

    def times(self, vectors: Array) -> Array:
        """The systems' matrices times vectors (cuts, modes, n), in s times their unit."""
        found = np.zeros_like(vectors)
        for system, one, vector in zip(self.systems, found, vectors, strict=True):
            one[: system.coupling.size] = system.matrix @ vector[: system.coupling.size]
        return found

    def waves(self, vectors: Array) -> Array:
        """Waves (cuts, 2 k, n), first up, then down, of currents (cuts, modes, n), in the table's unit times theirs."""
        return np.asarray((self.tables @ vectors.astype(np.float32)).astype(np.float64))

    def seen(self, waves: Array) -> Array:
        """What waves (cuts, 2 k, n) are to the modes (cuts, modes, n), in the table's unit times theirs."""
        return np.asarray(np.swapaxes(self.tables, 1, 2) @ waves.astype(np.float32), dtype=np.float64)


def _filled(rows: Array, count: int) -> Array:
    """Rows with as many of zeros behind them as make `count`, in their unit."""
    return np.concatenate([rows, np.zeros((count - len(rows), *rows.shape[1:]))])


@record(eq=False)
class CrowdingNearMetal:
    """What eddy currents in a winding's tracks change when metal is near, by frequency and surroundings; roughly one
    subspace serves all metal of one side or both, found by mirrors at the `nearest` distance (m) of any.
    """

    cuts: _ReflectedCuts
    wave_numbers: Array
    weights: Array
    levels: tuple[float, float]
    bends: bool = True
    steps: int = STEPS
    nearest: float | None = None
    known: dict[tuple[Reflector | None, ...], _Reduced] = field(default_factory=dict)
    changed: dict[tuple[bytes, Reflector | None, Reflector | None], ComplexArray] = field(default_factory=dict)

    def change(self, frequency: float, above: Reflector | None, below: Reflector | None) -> complex:
        """What the reflection of an even current plus the crowding in free air lack (H, complex; its imaginary part
        times -omega is a resistance), at a frequency (Hz), with reflectors above and below.
        """
        return complex(self.changes(np.array([frequency]), above, below)[0])

    def changes(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """The changes (H, complex) at (n,) frequencies (Hz), as `change`."""
        if above is None and below is None:
            return np.zeros(frequencies.size, dtype=np.complex128)
        key = frequencies.tobytes(), above, below
        if key not in self.changed:
            self.changed[key] = self._changes(frequencies, above, below)
        return self.changed[key]

    def _changes(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """The changes (H, complex) at (n,) frequencies (Hz) worked out: see `changes`."""
        about = tuple(
            _about(side, level, self.nearest) for side, level in ((above, self.levels[1]), (below, -self.levels[0])))
        if about not in self.known:
            middle = _Waves(*(part[0] for part in self._waves(np.array([MIDDLE]), *about)))
            self.known[about] = _reduced(self.cuts, middle, self.bends, self.steps)
        return self.known[about].changes(frequencies, self._waves(frequencies, above, below))

    def _waves(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> list[ComplexArray]:
        """Weights (H) of products of waves (frequencies, wave numbers): up with up, up with down, down with down."""
        found = returned_waves(self.wave_numbers, frequencies, above, below, self.levels)
        return [0.5 * MU0 * self.weights * part for part in found]


def _about(reflector: Reflector | None, level: float, nearest: float | None) -> Reflector | None:
    """What stands for a reflector where the subspace is looked for: a mirror, unless it is magnetic, about as far from
    the nearest mid-plane (`level`, m, towards it). One subspace serves all that stand for one another: what it leaves
    out is as little as in their own. Roughly a mirror at the `nearest` distance (m) of any metal stands for all.
    """
    if reflector is None:
        return None
    if nearest is not None:
        return Reflector(level + nearest, (MetalLayer(PERFECT),))
    gap = ABOUT ** round(math.log(max(reflector.distance - level, 1e-6), ABOUT))
    magnetic = any(plate.permeability != 1.0 for plate in reflector.plates)
    return Reflector(level + gap, reflector.plates if magnetic else (MetalLayer(PERFECT),))


@record(eq=False)
class _Waves:
    # Weights (k,) of products of waves in the mutual inductance: up with up, up with down, down with down.
    both: NDArray[Any]
    mixed: NDArray[Any]
    other: NDArray[Any]

    def returned(self, waves: Array) -> NDArray[Any]:
        """What comes back of waves (..., 2 k, n) up and down: the same shape, in the waves' unit times H."""
        up, down = np.split(waves, 2, axis=-2)
        both, mixed, other = (part[..., None] for part in (self.both, self.mixed, self.other))
        return np.concatenate([both * up + mixed * down, mixed * up + other * down], axis=-2)


def crowding_near_metal(cuts: Sequence[WindingCut], conductivity: float, modes: ModeSet, nearest: float,
                        bends: bool = True, steps: int = STEPS) -> CrowdingNearMetal:
    """The cuts of a winding with their waves, for metal no nearer than `nearest` (m) to any layer's mid-plane: partial
    elements (Ruehli 1974) with the reflection of Dodd and Deeds (1968), brought together here. `conductivity` (S/m) and
    `modes` are those that `proximity.winding_cuts` was given. Without `bends`, what direct current in the spirals' bend
    has more than an even one is left out, as for coils whose spectrum has it as loops.
    """
    k, weights = wave_numbers(max(float(one.cut.across.max()) for one in cuts), nearest, steps < STEPS)
    heights = np.concatenate([one.cut.height for one in cuts])
    levels = float(heights.min()), float(heights.max())
    tables = np.zeros((len(cuts), 2 * k.size, max(one.system.coupling.size for one in cuts)), dtype=np.float32)
    for table, one in zip(tables, cuts, strict=True):
        table[:, : one.system.coupling.size] = _mode_waves(one.cut, k, nearest, levels, conductivity, modes)
    reflected = _ReflectedCuts(tuple(one.system for one in cuts), tables)
    return CrowdingNearMetal(reflected, k, weights, levels, bends, steps, nearest if steps < STEPS else None)


def _mode_waves(cut: Cut, k: Array, nearest: float, levels: tuple[float, float], conductivity: float,
                modes: ModeSet) -> NDArray[np.float32]:
    """Amplitudes (2 k, modes; m sqrt(S)) of <mode sqrt(r) J1(k r) exp(k (z - top))>, and of the waves that decay
    upwards, by Gauss points over each cross-section.
    """
    across = max(modes.points[0], 6 + modes.across // 2 + math.ceil(2.5 * float(cut.width.max()) / nearest))
    modes = replace(modes, points=(min(across, 64), max(modes.points[1], modes.through + 1)))
    x, z = (table.reshape(-1, *modes.points) for table in points_of(cut, modes))
    over, through = split_projection(modes)
    r = x[:, :, 0]
    a, b = np.array(modes.orders).T
    scale = mode_conductances(cut, conductivity, modes)
    aways = levels[1] - z[:, 0, :], z[:, 0, :] - levels[0]
    table = np.empty((2 * k.size, r.shape[0] * a.size), dtype=np.float32)
    for part in slices(k.size, AT_ONCE // r.size):
        some = k[part, None, None]
        waves = ((np.sqrt(r) * j1(some * r)) @ over.T)[:, :, a]
        for half, away in zip((table[: k.size], table[k.size :]), aways, strict=True):
            vertical = np.exp(-some * away) @ through.T
            half[part] = (waves * vertical[:, :, b] * scale).reshape(len(some), -1)
    return table


AT_ONCE = 100_000
"""Waves at points of the cuts that are worked out at once: all of them together took a gigabyte near metal."""


@record(eq=False)
class _Reduced:
    # All cuts in subspaces of their modes: relaxation times and drives in free air (cuts, n), and the waves (cuts, 2 k,
    # n + 2) of the subspaces, of the whole current and, last, of its part that is not even.
    rates: Array
    drive: Array
    waves: Array

    def changes(self, frequencies: Array, waves: Sequence[ComplexArray]) -> ComplexArray:
        """Change of the inductance (frequencies; H, complex) at frequencies (Hz), from the waves' weights (frequencies,
        k), as in `_Waves`. Derived here: the modes obey (1 + i omega (rates + reflected)) current = -i omega drive, in
        free air without what is reflected.
        """
        found = np.empty(frequencies.size, dtype=np.complex128)
        for some in slices(frequencies.size, AT_ONCE // self.waves.size):
            found[some] = self._some(frequencies[some], [part[some] for part in waves])
        return found

    def _some(self, frequencies: Array, waves: Sequence[ComplexArray]) -> ComplexArray:
        # `changes` at a few frequencies
        parts = _Waves(*(np.concatenate([part.real, part.imag])[:, None] for part in waves))
        both = np.swapaxes(self.waves, 1, 2) @ parts.returned(self.waves)
        seen = both[: frequencies.size] + 1j * both[frequencies.size :]
        uneven = 2.0 * seen[..., -1, -2] - seen[..., -1, -1]
        # What free currents add to the inductance (H, complex), in free air and with the metal.
        lag, even = 2j * math.pi * frequencies[:, None, None], np.eye(self.rates.shape[1])
        alone = np.sum(self.drive**2 / (1.0 + lag * self.rates), axis=-1)
        system = even + lag[..., None] * (even * self.rates[:, None] + seen[..., :-2, :-2])
        drive = self.drive + seen[..., :-2, -2]
        with_metal = np.sum(drive * np.linalg.solve(system, drive[..., None])[..., 0], axis=-1)
        return np.asarray(np.sum(uneven + lag[..., 0] * (alone - with_metal), axis=1))


def _reduced(cuts: _ReflectedCuts, waves: _Waves, bends: bool, steps: int) -> _Reduced:
    """The modes of all cuts near metal on small subspaces: relaxation times (s) and couplings, by a Rayleigh-Ritz
    projection on the block Krylov space of the drives (textbook).
    """
    source, coupling = cuts.vectors(lambda system: system.source), cuts.vectors(lambda system: system.coupling)
    returned = waves.returned(cuts.waves(source))
    image = cuts.seen(np.concatenate([returned.real, returned.imag], axis=2))
    even = _Waves(waves.both.real, waves.mixed.real, waves.other.real)

    basis, times = _krylov(cuts, even, np.concatenate([coupling, image], axis=2), steps)
    values, vectors = np.linalg.eigh(np.swapaxes(basis, 1, 2) @ times)
    # Points too few for the highest modes leave some that would store less than no energy.
    basis = basis @ vectors
    shift = cuts.vectors(lambda system: system.shift) if bends else np.zeros_like(source)
    drive = np.swapaxes(basis, 1, 2) @ coupling
    return _Reduced(np.maximum(values, 0.0), drive[..., 0], cuts.waves(np.concatenate([basis, source, shift], axis=2)))


def _krylov(cuts: _ReflectedCuts, waves: _Waves, block: Array, steps: int) -> tuple[Array, Array]:
    """Orthonormal bases (cuts, modes, size; no unit) of the blocks (cuts, modes, k), their images, those ones' images
    ... (block Lanczos with full orthogonalisation; Golub and Van Loan, Matrix Computations), in the space of free
    currents; and the systems' matrices times them (s). Directions that are there already are columns of zeros; it ends
    where no cut has others.
    """
    basis = times = np.zeros((*block.shape[:2], 0))
    for step in range(steps):
        block = cuts.project(block)
        block = block / np.maximum(np.linalg.norm(block, axis=1, keepdims=True), 1e-300)
        for _ in range(2):
            block = cuts.project(block - basis @ (np.swapaxes(basis, 1, 2) @ block))
        left, values, _ = np.linalg.svd(block, full_matrices=False)
        fresh = left * (values > 1e-6)[:, None]
        if not fresh.any():
            break
        found = cuts.times(fresh)
        basis, times = np.concatenate([basis, fresh], axis=2), np.concatenate([times, found], axis=2)
        if step < steps - 1:
            block = found + cuts.seen(waves.returned(cuts.waves(fresh)))
    return basis, times
