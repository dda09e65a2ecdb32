"""A soft pad between a board and a rigid target: from a pose of the target to what holds it there, and back.

The energy of `pad_law` in the frame of `motion`; forces are its slopes, so what is put in comes back. SI units, arrays
over the poses or loads first, board axes as in `sitscad.scene.pose`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.mechanics import pad_law
from sitscad.mechanics.elastomer import Face
from sitscad.mechanics.motion import relative, rotations, wrenches
from sitscad.record import record

Array = NDArray[np.float64]

VALID_STRAIN, VALID_SHEAR, VALID_TILT = 0.35, 0.5, math.radians(5.0)
"""Compression, shear (travel over thickness) and tilt (rad) up to which the law is held against finite elements."""

RIM_SIGMA, FILM_SIGMA = 0.03, 0.15
"""One sigma, relative, of the force that the law gives, beside `pad_law.sigma`: for a pad that reaches beyond its
target, and of what a film carries (tests/validation/pad_figures.csv)."""

TOLERANCE = 1e-10
"""Where the search for a pose ends: the last step in thicknesses and radians."""

SHEAR_STEPS = 4
"""Parts in which shear and moments are put on, after the normal force: a soft pad is followed, not leapt upon."""


@record
class Pad:
    """A bonded pad under the face of a rigid target.

    Face and thickness in metres, moduli in pascals; `rim` by how much the pad reaches beyond the target on the average
    (m), `film` and `film_modulus` the thickness (m) and shear modulus (Pa) of a film round pad and target, bonded to
    both and to the board; `height` (m) from the target's near face to where loads act.
    """

    face: Face
    thickness: float
    shear_modulus: float
    bulk_modulus: float = math.inf
    rim: float = 0.0
    film: float = 0.0
    film_modulus: float = 0.0
    height: float = 0.0

    @property
    def block(self) -> pad_law.Block:
        """The pad in thicknesses and shear moduli, as it looks along x. Raises ValueError for sizes that none has."""
        h = self.thickness
        sizes = (self.face.width_x, self.face.width_y, h, self.shear_modulus, self.bulk_modulus)
        if not all(value > 0.0 for value in sizes):
            raise ValueError("a pad needs positive widths, thickness and moduli")
        if min(self.rim, self.film, self.film_modulus, self.height) < 0.0:
            raise ValueError("a pad's rim, film and load height are 0 or more")
        widths = self.face.width_x / h, self.face.width_y / h
        skin = (self.film / h, self.film_modulus / self.shear_modulus)
        return pad_law.Block(*widths, self.face.round, self.rim / h, *skin)

    @property
    def sigma(self) -> float:
        """One sigma of the forces that the law gives, relative."""
        bare = pad_law.compression(self.block)
        carried = bare.film / (bare.film + bare.modulus)
        return math.hypot(pad_law.sigma(self.block), RIM_SIGMA if self.rim > 0.0 else 0.0, FILM_SIGMA * carried)

    def pressure(self, strain: Array) -> Array:
        """Normal force (N, positive for a press) at compressive strains (n,) of a target that stays level."""
        law = pad_law.compression(self.block, self.bulk_modulus / self.shear_modulus)
        return self.shear_modulus * self.face.area * law(np.asarray(strain, dtype=float))

    def strain(self, force: Array) -> Array:
        """Compressive strain (n,) under normal forces (n,) of 0 or more (N), of a target that stays level."""
        force = np.asarray(force, dtype=float)
        if not np.all(force >= 0.0):
            raise ValueError("the compressive force must be 0 or more")
        low, high = np.zeros_like(force), np.full_like(force, 1.0 - 1e-9)
        strain = np.minimum(force / self.pressure(np.array(1e-6)) * 1e-6, 0.5)
        for _ in range(60):
            here = self.pressure(strain)
            low, high = np.where(here < force, strain, low), np.where(here < force, high, strain)
            slope = (self.pressure(strain + 1e-7) - self.pressure(strain - 1e-7)) / 2e-7
            step = strain - (here - force) / slope
            step = np.where((step > low) & (step < high), step, 0.5 * (low + high))
            done = np.all(np.abs(step - strain) <= 1e-14 + 1e-12 * strain)
            strain = step
            if done:
                break
        return np.where(force == 0.0, 0.0, strain)

    def force(self, poses: Array) -> Array:
        """What must hold the target at poses (n, 6; m, rad): force (N) and moment (N m) about the displaced middle of
        its near face, (n, 6) in board axes. NaN where the target has come down on the board.
        """
        poses = np.asarray(poses, dtype=float).reshape(-1, 6)
        block, h = self.block, self.thickness
        share = pad_law.frame_share(block)
        place, turn, frame, there = relative(poses, h, share)
        with np.errstate(invalid="ignore", divide="ignore"):
            slopes, turning = self._slopes(place / h, turn)
        held = wrenches(slopes, turning * h, turn, frame, there, share)
        held *= self.shear_modulus * self.face.area
        held[place[:, 2] <= 0.0] = math.nan
        return held

    def _slopes(self, place: Array, turn: Array) -> tuple[Array, Array]:
        # Slopes of the energy by place (n, 3) and by turn (n, 3), over modulus times area (and thickness).
        squeeze, shears, tilts, twist = _courses(self.block, self.bulk_modulus / self.shear_modulus)
        strain = 1.0 - place[:, 2]
        sheared, tilted = place[:, :2], turn[:, :2]
        square = np.sum(sheared * sheared, axis=1)
        # of both directions alike, so that forces have an energy
        cubic = _Mean(shears[0], shears[1])
        down = squeeze(strain) + 0.25 * _slope(cubic, strain) * square**2
        slopes, turning = np.empty_like(place), np.empty_like(turn)
        for k in (0, 1):
            slopes[:, k] = (shears[k](strain) + cubic(strain) * square) * sheared[:, k]
            turning[:, k] = tilts[k](strain) * tilted[:, k]
            down += 0.5 * _slope(shears[k], strain) * sheared[:, k] ** 2
            down += 0.5 * _slope(tilts[k], strain) * tilted[:, k] ** 2
        turning[:, 2] = twist * turn[:, 2]
        slopes[:, 2] = -down
        return slopes, turning

    def stiffness(self, poses: Array) -> Array:
        """How force and moment change with the pose: (n, 6, 6), rows as in `force`, columns as in a pose."""
        poses = np.asarray(poses, dtype=float).reshape(-1, 6)
        steps = np.array(3 * [1e-6 * self.thickness] + 3 * [1e-6])
        there = poses[:, None, :] + np.concatenate([np.diag(steps), -np.diag(steps)])
        held = self.force(there.reshape(-1, 6)).reshape(len(poses), 12, 6)
        return np.swapaxes((held[:, :6] - held[:, 6:]) / (2.0 * steps[:, None]), 1, 2)

    def pose(self, loads: Array, is_held: bool = False) -> Array:
        """Poses (n, 6) under loads (n, 3): normal, towards the board, and shear along +x and +y (N); or (n, 6): force
        along x, y, z (N) and moment (N m) about the middle of the outermost face.

        Loads act at the middle of the outermost face, which moves with the target, and keep their direction. `is_held`
        keeps the target level. NaN where no equilibrium is found: the pad gives way sideways, or shuts. Raises
        ValueError for loads that are not finite.
        """
        wanted = _as_wrenches(loads)
        poses = np.zeros_like(wanted)
        poses[:, 2] = -self.thickness * self.strain(np.maximum(0.0, -wanted[:, 2]))
        found = self._balanced(poses, wanted, is_held)
        lost = np.isnan(found[:, 0])
        if np.any(lost):
            found[lost] = self._followed(poses[lost], wanted[lost], is_held)
        return found

    def _followed(self, poses: Array, wanted: Array, is_held: bool) -> Array:
        # Shear and moments put on little by little, for a soft pad that cannot be leapt upon.
        whole = np.zeros_like(wanted)
        whole[:, 2] = wanted[:, 2]
        for part in range(1, SHEAR_STEPS + 1):
            poses = self._balanced(poses, whole + (wanted - whole) * part / SHEAR_STEPS, is_held)
        return poses

    def _balanced(self, poses: Array, wanted: Array, is_held: bool) -> Array:
        # Newton's method from poses nearby; those that do not settle, or where the pad would give way, are lost.
        free = 3 if is_held else 6
        units = np.array(3 * [self.thickness] + 3 * [1.0])[:free]
        poses, near = poses.copy(), np.zeros(len(poses), dtype=bool)
        for _ in range(25):
            lack, slope = self._lack_and_slope(poses, wanted)
            lack, slope = lack[:, :free] * units, slope[:, :free, :free] * units * units[:, None]
            good = np.isfinite(slope).all(axis=(1, 2)) & np.isfinite(lack).all(axis=1)
            poses[~good] = math.nan
            step = np.zeros_like(lack)
            step[good] = np.linalg.solve(slope[good], lack[good][:, :, None])[:, :, 0]
            size = np.abs(step).max(axis=1, initial=0.0)
            poses[:, :free] -= step * np.minimum(1.0, 0.2 / np.maximum(size, 1e-30))[:, None] * units
            near = good & (size < TOLERANCE)
            if np.all(near | ~good):
                break
        stable = near.copy()
        stable[near] = np.linalg.eigvalsh(0.5 * (slope + np.swapaxes(slope, 1, 2))[near]).min(axis=1) > 0.0
        poses[~stable] = math.nan
        return poses

    def _lack_and_slope(self, poses: Array, wanted: Array) -> tuple[Array, Array]:
        # What is lacking (n, 6) and how it changes with the pose (n, 6, 6).
        steps = np.array(3 * [1e-6 * self.thickness] + 3 * [1e-6])
        aside = np.concatenate([np.zeros((1, 6)), np.diag(steps), -np.diag(steps)])
        lack = self._lacking((poses[:, None, :] + aside).reshape(-1, 6), np.repeat(wanted, 13, axis=0))
        lack = lack.reshape(len(poses), 13, 6)
        return lack[:, 0], np.swapaxes((lack[:, 1:7] - lack[:, 7:]) / (2.0 * steps[:, None]), 1, 2)

    def _lacking(self, poses: Array, wanted: Array) -> Array:
        # What holds the target, less what the loads do about the middle of the near face.
        lever = self.height * rotations(poses[:, 3:])[:, :, 2]
        given = wanted.copy()
        given[:, 3:] += np.cross(lever, wanted[:, :3])
        return self.force(poses) - given


@lru_cache(maxsize=64)
def _courses(
    block: pad_law.Block, bulk: float
) -> tuple[pad_law.Compression, tuple[pad_law.Shear, pad_law.Shear], tuple[pad_law.Tilt, pad_law.Tilt], float]:
    # A turn about y raises one end of x, one about x an end of y.
    across = block.turned
    shears, tilts = (pad_law.shear(block), pad_law.shear(across)), (pad_law.tilt(across), pad_law.tilt(block))
    return pad_law.compression(block, bulk), shears, tilts, pad_law.twist(block)


@record
class _Mean:
    # The cubic terms of shear along both axes.
    one: pad_law.Shear
    other: pad_law.Shear

    def __call__(self, strain: Array) -> Array:
        return 0.5 * (self.one.cubic(strain) + self.other.cubic(strain))


def _slope(course: Callable[[Array], Array], strain: Array) -> Array:
    return (course(strain + 1e-6) - course(strain - 1e-6)) / 2e-6


def _as_wrenches(loads: Array) -> Array:
    loads = np.array(loads, dtype=float)
    if loads.ndim != 2 or loads.shape[1] not in (3, 6) or not np.all(np.isfinite(loads)):
        raise ValueError("loads are finite numbers, (n, 3) or (n, 6)")
    if loads.shape[1] == 6:
        return loads
    normal, shear_x, shear_y = loads.T
    return np.column_stack([shear_x, shear_y, -normal, np.zeros((len(loads), 3))])
