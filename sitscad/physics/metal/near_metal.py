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

from sitscad.arrays import Array, ComplexArray, Index, slices
from sitscad.physics.constants import MU0
from sitscad.physics.loss.current_modes import ModeSystem
from sitscad.physics.loss.proximity import WindingCut
from sitscad.physics.loss.track_modes import Cut, ModeSet, mode_conductances, points_of, split_projection
from sitscad.physics.metal.current_spectrum import wave_numbers
from sitscad.physics.metal.half_spaces import MetalLayer, Reflector, returned_waves
from sitscad.physics.special_functions import j1
from sitscad.record import record

STEPS, ROUGH_STEPS = 5, 2
"""Steps of the block Krylov run, each adding up to three vectors; and of one for screening."""

MIDDLE = 3e6
"""Frequency (Hz) of the reflection that shapes the subspace."""

ABOUT = 1.25
"""Ratio of the distances of metal for which one subspace after another is found."""

PERFECT = 1e18
"""Conductivity (S/m) of metal that waves do not enter."""


@record(eq=False)
class _ReflectedCut:
    # The modes of one cut and their waves (2 k, modes): those that decay downwards, then upwards. In single precision,
    # for they are most of what an estimate holds.
    system: ModeSystem
    table: NDArray[np.float32]

    def waves(self, vectors: Array) -> tuple[Array, Array]:
        """Waves (k, ...) up and down of currents (modes, ...), in the table's unit times theirs."""
        found = (self.table @ vectors.astype(np.float32)).astype(np.float64)
        return found[: len(found) // 2], found[len(found) // 2 :]

    def seen(self, up: Array, down: Array) -> Array:
        """What waves (k, ...) are to the modes (modes, ...), in the table's unit times theirs."""
        return np.asarray(self.table.T @ np.concatenate([up, down]).astype(np.float32), dtype=np.float64)


@record(eq=False)
class CrowdingNearMetal:
    """What eddy currents in a winding's tracks change when metal is near, by frequency and surroundings; roughly one
    subspace serves all metal of one side or both, found by mirrors at the `nearest` distance (m) of any.
    """

    cuts: tuple[_ReflectedCut, ...]
    wave_numbers: Array
    weights: Array
    levels: tuple[float, float]
    bends: bool = True
    steps: int = STEPS
    nearest: float | None = None
    known: dict[tuple[Reflector | None, ...], tuple[_Reduced, ...]] = field(default_factory=dict)
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
        total = np.zeros(frequencies.size, dtype=np.complex128)
        about = tuple(
            _about(side, level, self.nearest) for side, level in ((above, self.levels[1]), (below, -self.levels[0])))
        if about not in self.known:
            (middle,) = zip(*self._waves(np.array([MIDDLE]), *about), strict=True)
            self.known[about] = tuple(_reduced(cut, _Waves(*middle), self.bends, self.steps) for cut in self.cuts)
        waves = [np.concatenate([part.real, part.imag]) for part in self._waves(frequencies, above, below)]
        for part in self.known[about]:
            total += part.changes(frequencies, waves)
        return total

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
    # Weights of products of waves in the mutual inductance: up with up, up with down, down with down.
    both: NDArray[Any]
    mixed: NDArray[Any]
    other: NDArray[Any]

    def returned(self, waves: tuple[Array, Array]) -> tuple[NDArray[Any], NDArray[Any]]:
        """What comes back of waves (k, ...) up and down. (k, ...), in the waves' unit times H."""
        up, down = waves
        shape = (-1, *([1] * (up.ndim - 1)))
        both, mixed, other = (part.reshape(shape) for part in (self.both, self.mixed, self.other))
        return both * up + mixed * down, mixed * up + other * down


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
    reflected = [
        _ReflectedCut(one.system, _mode_waves(one.cut, k, nearest, levels, conductivity, modes)) for one in cuts
    ]
    rough = nearest if steps < STEPS else None
    return CrowdingNearMetal(tuple(reflected), k, weights, levels, bends, steps, rough)


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
    # A cut in a subspace of its modes: relaxation times, drive in free air, and the waves (k, ...) of the subspace, of
    # the whole current and, last, of its part that is not even.
    rates: Array
    drive: Array
    up: Array
    down: Array

    def changes(self, frequencies: Array, waves: Sequence[Array]) -> ComplexArray:
        """Change of the inductance (frequencies; H, complex) at frequencies (Hz), from the waves' weights: real parts
        at all frequencies, then imaginary ones (2 frequencies, k), as in `_Waves`. Derived here: the modes obey (1 + i
        omega (rates + reflected)) current = -i omega drive, in free air without what is reflected.
        """
        first, second, products = self._products
        flat = np.concatenate(waves, axis=1) @ products
        parts = np.empty((len(flat), self.up.shape[1], self.up.shape[1]))
        parts[:, first, second] = parts[:, second, first] = flat
        seen = parts[: frequencies.size] + 1j * parts[frequencies.size :]
        uneven = 2.0 * seen[:, -1, -2] - seen[:, -1, -1]
        # What free currents add to the inductance (H, complex), in free air and with the metal.
        lag = 2j * math.pi * frequencies[:, None]
        alone = np.sum(self.drive**2 / (1.0 + lag * self.rates), axis=1)
        system = np.eye(self.drive.size) + lag[..., None] * (np.diag(self.rates) + seen[:, :-2, :-2])
        drive = self.drive + seen[:, :-2, -2]
        with_metal = np.sum(drive * np.linalg.solve(system, drive[..., None])[..., 0], axis=1)
        return np.asarray(uneven + lag[:, 0] * (alone - with_metal))

    @cached_property
    def _products(self) -> tuple[Index, Index, Array]:
        """Pairs of vectors, each once, and the products of their waves (3 k, pairs): up with up, up with down and down
        with up, down with down; in the waves' unit squared.
        """
        first, second = np.triu_indices(self.up.shape[1])
        across = self.up[:, first] * self.down[:, second] + self.down[:, first] * self.up[:, second]
        alike = [waves[:, first] * waves[:, second] for waves in (self.up, self.down)]
        return first, second, np.concatenate([alike[0], across, alike[1]])


def _reduced(cut: _ReflectedCut, waves: _Waves, bends: bool, steps: int) -> _Reduced:
    """The modes of a cut near metal on a small subspace: relaxation times (s) and couplings, by a Rayleigh-Ritz
    projection on the block Krylov space of the drives (textbook).
    """
    system = cut.system
    up, down = waves.returned(cut.waves(system.source))
    image = cut.seen(up.real, down.real), cut.seen(up.imag, down.imag)
    even = _Waves(waves.both.real, waves.mixed.real, waves.other.real)

    def act(vectors: Array) -> Array:
        return system.project(system.matrix @ vectors + cut.seen(*even.returned(cut.waves(vectors))))

    basis = _krylov(system, act, system.project(np.stack([system.coupling, *image], axis=1)), steps)
    values, vectors = np.linalg.eigh(basis.T @ (system.matrix @ basis))
    # Points too few for the highest modes leave some that would store less than no energy.
    basis = basis @ vectors
    kept = np.column_stack([basis, system.source, system.shift if bends else 0.0 * system.shift])
    return _Reduced(np.maximum(values, 0.0), basis.T @ system.coupling, *cut.waves(kept))


def _krylov(system: ModeSystem, act: Callable[[Array], Array], block: Array, steps: int) -> Array:
    """Orthonormal basis (modes, size; no unit) of the block (modes, k), its image, that one's image ... (block Lanczos
    with full orthogonalisation; Golub and Van Loan, Matrix Computations), without directions that are there already; it
    ends where the space is full.
    """
    most = system.coupling.size - len(system.carrier)
    basis = np.zeros((block.shape[0], 0))
    for step in range(steps):
        size = np.maximum(np.linalg.norm(block, axis=0), 1e-300)
        block = block / size
        for _ in range(2):
            block = system.project(block - basis @ (basis.T @ block))
        left, values, _ = np.linalg.svd(block, full_matrices=False)
        fresh = left[:, values > 1e-6][:, : most - basis.shape[1]]
        if not fresh.shape[1]:
            break
        basis = np.concatenate([basis, fresh], axis=1)
        if step < steps - 1:
            block = act(fresh)
    return basis
