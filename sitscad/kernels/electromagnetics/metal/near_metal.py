"""Current modes of a spiral winding near metal, where the eddy currents in the tracks couple to their images.

Far from metal, the reflection of a uniform current and the current crowding in free air are separate effects. Close to
metal both act together, and their sum is wrong: the image of a wide track pulls the current back across its width. Here
the current modes (`current_modes`) in every half-plane are coupled to the reflected waves (`half_spaces`).

Every mode has an amplitude in the waves J1(k r) exp(+-k z) about the axis, and the reflection multiplies it. So the
matrix of a reflection is a short sum of products. A Krylov subspace that starts from the drive of the winding and of
its images reduces every frequency to a small system.
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
    gauss_point_positions,
    mode_conductances,
    split_projection,
)
from sitscad.kernels.electromagnetics.metal.current_spectrum import wave_numbers
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflection_coefficients
from sitscad.kernels.electromagnetics.special_functions import j1

STEPS = 5
"""Number of steps of the block Krylov recursion. Each step adds up to three vectors per half-plane."""

ROUGH_STEPS = 2
"""Number of steps of the block Krylov recursion for screening."""

MIDDLE = 3e6
"""Frequency (Hz) at which the reflection is evaluated to compute a subspace, which then serves all frequencies."""

ABOUT = 1.25
"""Ratio of successive metal distances for which subspaces are computed.

A metal distance is replaced by the nearest of these distances on a logarithmic scale.
"""

PERFECT = 1e18
"""Conductivity (S/m) of metal that waves practically do not enter."""


@record(eq=False)
class _ReflectedCuts:
    """Current modes in all half-planes of a winding, and their amplitudes in the waves.

    `systems` are the equations of the modes in each half-plane. `tables` (half-planes, 2 k, modes; m sqrt(S)) holds,
    for each of k wave numbers, the waves that decay downwards, then the waves that decay upwards. It is in single
    precision, because it is most of the memory of an estimate. Half-planes with fewer tracks are padded with zeros.
    """

    systems: tuple[ModeSystem, ...]
    tables: NDArray[np.float32]

    @cached_property
    def carriers(self) -> Array:
        """Density of direct current in each track (half-planes, tracks, modes of a track; no unit; `ModeSystem`)."""
        most = max(len(system.carrier) for system in self.systems)
        return np.stack([_pad_with_zeros(system.carrier, most) for system in self.systems])

    def vectors(self, of: Callable[[ModeSystem], Array]) -> Array:
        """Return a vector of each system, padded with zeros (half-planes, modes, 1), in its unit.

        `of` is the function that takes the vector from a system.
        """
        return np.stack([_pad_with_zeros(of(system), self.tables.shape[2]) for system in self.systems])[..., None]

    def project(self, vectors: Array) -> Array:
        """Return vectors (half-planes, modes, n) after subtracting the net current of every track, in their unit."""
        table = vectors.reshape(*self.carriers.shape, -1)
        net = self.carriers[:, :, None] @ table
        return np.asarray((table - self.carriers[..., None] * net).reshape(vectors.shape))

    def multiply_by_matrices(self, vectors: Array) -> Array:
        """Return the systems' matrices times vectors (half-planes, modes, n), in s times the vectors' unit."""
        products = np.zeros_like(vectors)
        for system, product, vector in zip(self.systems, products, vectors, strict=True):
            product[: system.coupling.size] = system.matrix @ vector[: system.coupling.size]
        return products

    def waves(self, vectors: Array) -> Array:
        """Return the waves (half-planes, 2 k, n) of currents (half-planes, modes, n).

        The unit is the product of the units of `tables` and the currents. Waves upwards come first, then waves
        downwards.
        """
        return np.asarray((self.tables @ vectors.astype(np.float32)).astype(np.float64))

    def drives_by_waves(self, waves: Array) -> Array:
        """Return the drive (half-planes, modes, n) of the modes by waves (half-planes, 2 k, n).

        The unit is the product of the units of `tables` and the waves.
        """
        return np.asarray(np.swapaxes(self.tables, 1, 2) @ waves.astype(np.float32), dtype=np.float64)


def _pad_with_zeros(rows: Array, count: int) -> Array:
    """Return rows with zero rows appended, `count` rows in all, in the unit of `rows`."""
    return np.concatenate([rows, np.zeros((count - len(rows), *rows.shape[1:]))])


@record(eq=False)
class CrowdingNearMetal:
    """Inductance changes by eddy currents in a winding's tracks near metal, by frequency and reflectors.

    `cuts` are the current modes with their waves. `levels` (m) are the lowest and highest mid-plane. `wave_numbers` and
    `weights` (k; 1/m) are nodes and weights of the integral over waves. `bends` is explained in `crowding_near_metal`,
    `steps` is the number of Krylov steps. `nearest` (m) is given for screening only. One subspace, computed for perfect
    conductors at this distance, then serves all metal. `known` caches subspaces, `changed` caches results.
    """

    cuts: _ReflectedCuts
    wave_numbers: Array
    weights: Array
    levels: tuple[float, float]
    bends: bool = True
    steps: int = STEPS
    nearest: float | None = None
    known: dict[tuple[Reflector | None, ...], _ReducedModes] = field(default_factory=dict)
    changed: dict[tuple[bytes, Reflector | None, Reflector | None], ComplexArray] = field(default_factory=dict)

    def change(self, frequency: float, above: Reflector | None, below: Reflector | None) -> complex:
        """Return the change (H, complex) at a `frequency` (Hz) to add to the sum of two effects near reflectors.

        The two effects are the reflection of a uniform current and the current crowding in free air. `above` and
        `below` are the reflectors on both sides, or None. The imaginary part times -omega is a resistance.
        """
        return complex(self.changes(np.array([frequency]), above, below)[0])

    def changes(self, frequencies: Array, above: Reflector | None, below: Reflector | None,
                expected: Sequence[tuple[Reflector | None, Reflector | None]] = ()) -> ComplexArray:
        """Return the changes (n; H, complex) to add to the sum of two effects, at frequencies (n; Hz), as in `change`.

        If a subspace is missing, subspaces for the pairs of reflectors in `expected` are computed together with it.
        That takes much less time than one after the other.
        """
        if above is None and below is None:
            return np.zeros(frequencies.size, dtype=np.complex128)
        key = frequencies.tobytes(), above, below
        if key not in self.changed:
            about = self._equivalent_mirrors(above, below)
            if about not in self.known:
                pairs = dict.fromkeys([about, *(self._equivalent_mirrors(*pair) for pair in expected)])
                missing = [pair for pair in pairs if pair not in self.known and pair != (None, None)]
                middles = [
                    _WaveWeights(*(part[0] for part in self._waves(np.array([MIDDLE]), *pair))) for pair in missing]
                self.known.update(zip(missing, _reduce_modes(self.cuts, middles, self.bends, self.steps), strict=True))
            self.changed[key] = self.known[about].changes(frequencies, self._waves(frequencies, above, below))
        return self.changed[key]

    def _equivalent_mirrors(self, above: Reflector | None, below: Reflector | None) -> tuple[Reflector | None, ...]:
        """Return the reflectors above and below that replace both reflectors when a subspace is computed.

        See `_equivalent_mirror`.
        """
        return _equivalent_mirror(above, self.levels[1], self.nearest), _equivalent_mirror(below, -self.levels[0],
                                                                                           self.nearest)

    def _waves(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> list[ComplexArray]:
        """Return the weights (H) of products of waves, three arrays (frequencies, wave numbers).

        They are for up with up waves, up with down waves, and down with down waves.
        """
        coefficients = reflection_coefficients(self.wave_numbers, frequencies, above, below, self.levels)
        return [0.5 * MU0 * self.weights * part for part in coefficients]


def _equivalent_mirror(reflector: Reflector | None, level: float, nearest: float | None) -> Reflector | None:
    """Return the reflector that replaces a reflector when a subspace is computed.

    One subspace serves all reflectors that have the same replacement. The replacement has about the reflector's
    distance from the nearest mid-plane `level` (m). It is a perfect conductor, unless the reflector is magnetic. The
    error is as small as with a subspace for each reflector. For screening, a perfect conductor at the `nearest`
    distance (m) replaces all metal.
    """
    if reflector is None:
        return None
    if nearest is not None:
        return Reflector(level + nearest, (MetalLayer(PERFECT),))
    gap = ABOUT ** round(math.log(max(reflector.distance - level, 1e-6), ABOUT))
    magnetic = any(plate.permeability != 1.0 for plate in reflector.plates)
    return Reflector(level + gap, reflector.plates if magnetic else (MetalLayer(PERFECT),))


@record(eq=False)
class _WaveWeights:
    """Weights (k,) of products of waves in the mutual inductance, for each wave number.

    `both` is for up with up waves, `mixed` for up with down waves, and `other` for down with down waves.
    """

    both: NDArray[Any]
    mixed: NDArray[Any]
    other: NDArray[Any]

    def reflect(self, waves: Array) -> NDArray[Any]:
        """Return the waves (..., 2 k, n) that are reflected if waves up and down (..., 2 k, n) arrive.

        The unit is the waves' unit times H.
        """
        up, down = np.split(waves, 2, axis=-2)
        up_to_up, mixed, down_to_down = (part[..., None] for part in (self.both, self.mixed, self.other))
        return np.concatenate([up_to_up * up + mixed * down, mixed * up + down_to_down * down], axis=-2)


def crowding_near_metal(cuts: Sequence[WindingCut], conductivity: float, modes: ModeSet, nearest: float,
                        bends: bool = True, steps: int = STEPS) -> CrowdingNearMetal:
    """Return the current modes of a winding with their waves, for metal at least `nearest` from any mid-plane.

    Parameters
    ----------
    cuts : sequence of WindingCut
        half-planes of the winding (`proximity.winding_cuts`)
    conductivity : float
        conductivity given to `proximity.winding_cuts` (S/m)
    modes : ModeSet
        modes given to `proximity.winding_cuts`
    nearest : float
        least distance of metal (m)
    bends : bool, optional
            whether to include the difference of direct current from a uniform current in the spirals' bend. False for
        coils whose spectrum includes this difference as current loops.
    steps : int, optional
        number of steps of the block Krylov recursion

    Notes
    -----
    Partial elements (Ruehli 1974) are combined here with the reflection of Dodd and Deeds (1968).
    """
    k, weights = wave_numbers(max(float(cut.cut.across.max()) for cut in cuts), nearest, steps < STEPS)
    heights = np.concatenate([cut.cut.height for cut in cuts])
    levels = float(heights.min()), float(heights.max())
    tables = np.zeros((len(cuts), 2 * k.size, max(cut.system.coupling.size for cut in cuts)), dtype=np.float32)
    for table, cut in zip(tables, cuts, strict=True):
        table[:, : cut.system.coupling.size] = _mode_waves(cut.cut, k, nearest, levels, conductivity, modes)
    reflected = _ReflectedCuts(tuple(cut.system for cut in cuts), tables)
    return CrowdingNearMetal(reflected, k, weights, levels, bends, steps, nearest if steps < STEPS else None)


def _mode_waves(cut: Cut, k: Array, nearest: float, levels: tuple[float, float], conductivity: float,
                modes: ModeSet) -> NDArray[np.float32]:
    """Return the modes' amplitudes in the waves (2 k, modes; m sqrt(S)): means of mode sqrt(r) J1(k r) exp(k height).

    The second half is for waves that decay upwards. Heights are relative to the highest mid-plane, in the second half
    to the lowest (`levels`; m). The means are sums over Gauss points of each cross-section.
    """
    across = max(modes.points[0], 6 + modes.across // 2 + math.ceil(2.5 * float(cut.width.max()) / nearest))
    modes = replace(modes, points=(min(across, 64), max(modes.points[1], modes.through + 1)))
    x, z = (table.reshape(-1, *modes.points) for table in gauss_point_positions(cut, modes))
    over, through = split_projection(modes)
    r = x[:, :, 0]
    a, b = np.array(modes.orders).T
    scale = mode_conductances(cut, conductivity, modes)
    heights = levels[1] - z[:, 0, :], z[:, 0, :] - levels[0]
    table = np.empty((2 * k.size, r.shape[0] * a.size), dtype=np.float32)
    for part in slices(k.size, AT_ONCE // r.size):
        some = k[part, None, None]
        waves = ((np.sqrt(r) * j1(some * r)) @ over.T)[:, :, a]
        for half, height in zip((table[: k.size], table[k.size :]), heights, strict=True):
            vertical = np.exp(-some * height) @ through.T
            half[part] = (waves * vertical[:, :, b] * scale).reshape(len(some), -1)
    return table


AT_ONCE = 100_000
"""Number of pairs of waves and points of half-planes processed together.

A single block of all waves took a gigabyte near metal.
"""


@record(eq=False)
class _ReducedModes:
    """Current modes in all half-planes, projected on a subspace of n mode combinations for each half-plane.

    `rates` (half-planes, n; s) are relaxation times, `drive` (half-planes, n) the drives of the combinations in free
    air. `waves` (half-planes, 2 k, n + 2) are amplitudes in the waves. The columns are the n combinations, the whole
    current, and the difference between the whole current and a uniform current.
    """

    rates: Array
    drive: Array
    waves: Array

    def changes(self, frequencies: Array, waves: Sequence[ComplexArray]) -> ComplexArray:
        """Return the change of the inductance (frequencies; H, complex) at frequencies (Hz).

        `waves` are the weights (H) of products of waves, three arrays (frequencies, k), as in `_WaveWeights`.

        Notes
        -----
        Derived here: the modes obey (1 + i omega (rates + reflected)) current = -i omega drive. In free air the
        reflected term is absent.
        """
        changes = np.empty(frequencies.size, dtype=np.complex128)
        for some in slices(frequencies.size, AT_ONCE // self.waves.size):
            changes[some] = self._changes_at(frequencies[some], [part[some] for part in waves])
        return changes

    def _changes_at(self, frequencies: Array, waves: Sequence[ComplexArray]) -> ComplexArray:
        # `changes` at a few frequencies
        parts = _WaveWeights(*(np.concatenate([part.real, part.imag])[:, None] for part in waves))
        products = np.swapaxes(self.waves, 1, 2) @ parts.reflect(self.waves)
        reflected = products[: frequencies.size] + 1j * products[frequencies.size :]
        uneven = 2.0 * reflected[..., -1, -2] - reflected[..., -1, -1]
        # inductance (H, complex) by free currents, in free air and with the metal
        lag, even = 2j * math.pi * frequencies[:, None, None], np.eye(self.rates.shape[1])
        alone = np.sum(self.drive**2 / (1.0 + lag * self.rates), axis=-1)
        system = even + lag[..., None] * (even * self.rates[:, None] + reflected[..., :-2, :-2])
        drive = self.drive + reflected[..., :-2, -2]
        with_metal = np.sum(drive * np.linalg.solve(system, drive[..., None])[..., 0], axis=-1)
        return np.asarray(np.sum(uneven + lag[..., 0] * (alone - with_metal), axis=1))


def _reduce_modes(
    cuts: _ReflectedCuts, surroundings: Sequence[_WaveWeights], bends: bool, steps: int
) -> list[_ReducedModes]:
    """Return the current modes on small subspaces (s, H), one for each pair of reflectors in `surroundings`.

    `bends` and `steps` are explained in `crowding_near_metal`. Method: Rayleigh-Ritz projection on the block Krylov
    space of the drives (textbook).
    """
    source, coupling = cuts.vectors(lambda system: system.source), cuts.vectors(lambda system: system.coupling)
    shift = cuts.vectors(lambda system: system.shift) if bends else np.zeros_like(source)
    source_waves = cuts.waves(source)
    evens, blocks = [], []
    for waves in surroundings:
        returned = waves.reflect(source_waves)
        image = cuts.drives_by_waves(np.concatenate([returned.real, returned.imag], axis=2))
        evens.append(_WaveWeights(waves.both.real, waves.mixed.real, waves.other.real))
        blocks.append(np.concatenate([coupling, image], axis=2))
    results = []
    for basis, times in _krylov(cuts, evens, blocks, steps):
        values, vectors = np.linalg.eigh(np.swapaxes(basis, 1, 2) @ times)
        # With too few points for the highest modes some energies would be negative.
        basis = basis @ vectors
        drive = np.swapaxes(basis, 1, 2) @ coupling
        subspace_waves = cuts.waves(np.concatenate([basis, source, shift], axis=2))
        results.append(_ReducedModes(np.maximum(values, 0.0), drive[..., 0], subspace_waves))
    return results


def _krylov(cuts: _ReflectedCuts, surroundings: Sequence[_WaveWeights], blocks: Sequence[Array],
            steps: int) -> list[tuple[Array, Array]]:
    """Return orthonormal bases (half-planes, modes, size; no unit) of Krylov spaces, and matrices times bases (s).

    There is one basis for each pair of reflectors in `surroundings`. The spaces start from the `blocks` (half-planes,
    modes, k) and contain only currents without net current. Method: block Lanczos with full orthogonalisation (Golub
    and Van Loan, Matrix Computations). A direction that a basis already has is a column of zeros. A recursion ends if
    no half-plane has new directions. The recursions run together, because reading the matrices and the waves takes most
    of the time.
    """
    spaces = [(np.zeros((*block.shape[:2], 0)), np.zeros((*block.shape[:2], 0))) for block in blocks]
    current, going = list(blocks), list(range(len(blocks)))
    for step in range(steps):
        fresh: dict[int, Array] = {}
        for number in going:
            vectors = _new_directions(cuts, spaces[number][0], current[number])
            if vectors.any():
                fresh[number] = vectors
        going = list(fresh)
        if not going:
            break
        ends = np.cumsum([vectors.shape[2] for vectors in fresh.values()])[:-1]
        together = np.concatenate(list(fresh.values()), axis=2)
        products = np.split(cuts.multiply_by_matrices(together), ends, axis=2)
        for number, product in zip(going, products, strict=True):
            basis, times = spaces[number]
            spaces[number] = (np.concatenate([basis, fresh[number]], axis=2),
                              np.concatenate([times, product], axis=2))
        if step < steps - 1:
            waves = np.split(cuts.waves(together), ends, axis=2)
            returned = [surroundings[number].reflect(part) for number, part in zip(going, waves, strict=True)]
            images = np.split(cuts.drives_by_waves(np.concatenate(returned, axis=2)), ends, axis=2)
            for number, product, image in zip(going, products, images, strict=True):
                current[number] = product + image
    return spaces


def _new_directions(cuts: _ReflectedCuts, basis: Array, block: Array) -> Array:
    """Return the orthonormal directions (half-planes, modes, k) of a block that a basis lacks. The others are zeros."""
    block = cuts.project(block)
    block = block / np.maximum(np.linalg.norm(block, axis=1, keepdims=True), 1e-300)
    for _ in range(2):
        block = cuts.project(block - basis @ (np.swapaxes(basis, 1, 2) @ block))
    vectors, values, _ = np.linalg.svd(block, full_matrices=False)
    return np.asarray(vectors * (values > 1e-6)[:, None])
