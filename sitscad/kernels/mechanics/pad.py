"""Soft bonded pad between a board and a rigid target: force from pose, and pose from force.

`pad_law` describes the energy of the pad, and `motion` its frame. Forces are derivatives of this energy, so a closed
path returns the work that was put in. Units are SI. Poses or loads are the first axis of arrays. Axes are the board's,
as in `sitscad.assembly.places.state`.

Notes
-----
The stiffness of each pad is tabulated once as a function of compression, so that a pose needs only a look-up. Between
the tabulated strains, cubics have the law's own values and slopes at their ends. The returned slopes belong to the
cubics, so that forces still derive from one energy. In these tables lengths are divided by the thickness and stresses
by the shear modulus.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.kernels.mechanics import pad_law
from sitscad.kernels.mechanics.elastomer import BARE, Face, Surround
from sitscad.kernels.mechanics.motion import (
    Load,
    Motion,
    StiffnessLaw,
    angles,
    cross_products,
    energy_derivatives,
    relative_motion,
    rotation_vectors,
    rotations,
    rotations_of_vectors,
)
from sitscad.kernels.mechanics.pad_law import NEO_HOOKEAN
from sitscad.kernels.solve_cache import cached_solution

FIRST, LAST, PIECES = -0.25, 0.45, 560
"""First and last strain of the tabulated stiffness curves, and number of cubics between them.

Beyond these strains a curve is constant (`pad_law.MOST_STRAIN`).
"""

STEP = (LAST - FIRST) / PIECES
"""Step of the strain between tabulated values."""

SMALL = 1e-6
"""Step of the strain for the numerical derivative of the pressure. The pressure itself is not tabulated."""


@record(eq=False)
class StiffnessCurves:
    """Stiffness curves of one pad, tabulated as functions of the compressive strain.

    The five curves are, in order: shear along x, shear along y, the cubic term of shear, tilt about x, tilt about y.
    Both directions have the same cubic term, so that forces derive from an energy. Stresses are divided by the shear
    modulus, moments by area, shear modulus and thickness. `squeeze` returns the pressure at a strain. `twist` is the
    stiffness for rotation in the plane of the pad.

    Between tabulated strains, each curve is Hermite's cubic in the position (0 to 1) between two strains. `pieces`
    (pieces, 4, 5) are its four coefficients, the constant first, for each of the five curves.
    """

    squeeze: pad_law.CompressionLaw
    pieces: Array
    twist: float

    def at(self, strain: Array) -> tuple[Array, Array]:
        """Return the five stiffness curves and their derivatives with respect to strain (n, 5 each) at strains (n)."""
        part, (value, first, second, third) = self._piece(strain)
        return value + part * (first + part * (second + part * third)), (
            first + part * (2.0 * second + 3.0 * part * third)
        ) / STEP

    def law(self, strain: Array) -> StiffnessLaw:
        """Return the dimensionless stiffness law at compressive strains (n). Each number of the law is an array (n).

        Values and derivatives come from Hermite's cubics (textbook). The derivative of the pressure is a central
        difference.
        """
        part, (value, first, second, third) = self._piece(strain)
        values = value + part * (first + part * (second + part * third))
        slopes = (first + part * (2.0 * second + 3.0 * part * third)) / STEP
        bends = (2.0 * second + 6.0 * part * third) / STEP**2
        pressed = (self.squeeze(strain + SMALL) - self.squeeze(strain - SMALL)) / (2.0 * SMALL)
        return StiffnessLaw(self.squeeze(strain), pressed, [*values.T], [*slopes.T], [*bends.T], self.twist)

    def pad_law(self, strain: float) -> StiffnessLaw:
        """Return the dimensionless stiffness law at one compressive strain, as `law` does, but as floats."""
        place = (min(max(strain, FIRST), LAST) - FIRST) / STEP
        piece = min(int(place), PIECES - 1)
        part, pieces = place - piece, self.pieces[piece].T.tolist()
        values = [v + part * (p + part * (q + part * r)) for v, p, q, r in pieces]
        slopes = [(p + part * (2.0 * q + 3.0 * part * r)) / STEP for _, p, q, r in pieces]
        bends = [(2.0 * q + 6.0 * part * r) / STEP**2 for _, _, q, r in pieces]
        pressed = (self.squeeze.at(strain + SMALL) - self.squeeze.at(strain - SMALL)) / (2.0 * SMALL)
        return StiffnessLaw(self.squeeze.at(strain), pressed, values, slopes, bends, self.twist)

    def _piece(self, strain: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """Return the position (n, 1) of strains (n) in their piece of the table, from 0 to 1, and four coefficients.

        Each coefficient of the cubics is an array (n, 5), from the constant term up.
        """
        place = (np.fmin(np.fmax(strain, FIRST), LAST) - FIRST) / STEP
        piece = np.minimum(place.astype(np.intp), PIECES - 1)
        row = self.pieces[piece]
        return (place - piece)[:, None], (row[:, 0], row[:, 1], row[:, 2], row[:, 3])


@lru_cache(maxsize=64)
def stiffness_curves(block: pad_law.Block, bulk_modulus: float) -> StiffnessCurves:
    """Tabulate the dimensionless stiffness curves of a block. `bulk_modulus` is divided by the shear modulus.

    Hermite's cubics (textbook) connect the values and slopes of `pad_law`.
    """
    # a turn about y raises one end of x, one about x an end of y
    across = block.turned
    (shear_x, cubic_x), (shear_y, cubic_y) = pad_law.shear_stiffness(block), pad_law.shear_stiffness(across)
    tilt_x, tilt_y = pad_law.tilt_stiffness(across), pad_law.tilt_stiffness(block)

    def exact(strain: Array) -> Array:
        cubic = 0.5 * (cubic_x(strain) + cubic_y(strain))
        return np.stack([shear_x(strain), shear_y(strain), cubic, tilt_x(strain), tilt_y(strain)], axis=1)

    strain, small = np.linspace(FIRST, LAST, PIECES + 1), 1e-5
    value, more, less = exact(np.concatenate([strain, strain + small, strain - small])).reshape(3, -1, 5)
    slope = STEP * (more - less) / (2.0 * small)
    rise = np.diff(value, axis=0)
    pieces = np.stack(
        [value[:-1], slope[:-1], 3.0 * rise - 2.0 * slope[:-1] - slope[1:], slope[:-1] + slope[1:] - 2.0 * rise], axis=1
    )
    return StiffnessCurves(pad_law.compression(block, bulk_modulus), pieces, pad_law.twist_stiffness(block))


TOLERANCE = 2e-6
"""Largest last step of Newton's method at which the search for a pose ends, in thicknesses (place) and rad (rotation).

The remaining error is proportional to the square of this step.
"""

SQUARE = 0.2
"""Largest previous step of Newton's method from which the next step is predicted, in thicknesses and radians.

With smaller steps, Newton's method converges quadratically.
"""

SETTLED = 1e-11
"""Largest predicted next step of Newton's method, in thicknesses and radians, at which the search for a pose ends."""

ROUGHLY = 1e-3
"""Relative tolerance of the compressive strain with which the search for a pose starts."""

FEW = 8
"""Largest number of loads that are solved singly with floats. For more loads, arrays are faster."""

FREE, LEVEL, STUCK = slice(0, 6), slice(0, 3), slice(None, 3)
"""Unknowns in the search for a pose (place x, y, z, rotation vector), for three kinds of targets.

`FREE`: all six. `LEVEL`: only the place, for a target with a fixed rotation. `STUCK`: for a target that moves only in
height; its three place values change along one direction.
"""

SHEAR_STEPS = 4
"""Number of steps in which shear forces and moments are applied after the normal force.

A soft pad needs more than one step to converge.
"""


@record
class BondedPad:
    """Soft pad that is bonded to a board and to the face of a rigid target.

    Attributes
    ----------
    face : Face
        loaded face (m)
    thickness : float
        thickness of the pad (m)
    shear_modulus, bulk_modulus : float
        moduli at rest (Pa)
    surround : Surround
            rim of the pad round the target, film bonded to pad, target and board, and webs. Webs on one side only
        displace the centre of the pad's reaction.
    height : float
        distance (m) from the target's face on the pad to the face on which loads act
    exponent : float
        exponent of Ogden's law with one term; 2 is neo-Hookean
    """

    face: Face
    thickness: float
    shear_modulus: float
    bulk_modulus: float = math.inf
    surround: Surround = BARE
    height: float = 0.0
    exponent: float = NEO_HOOKEAN

    @cached_property
    def stiffness_curves(self) -> StiffnessCurves:
        """Stiffness curves of the pad, tabulated as functions of the compressive strain."""
        return stiffness_curves(self.block, self.bulk_modulus / self.shear_modulus)

    @cached_property
    def block(self) -> pad_law.Block:
        """Pad as a dimensionless block with x as its first axis: lengths divided by thickness, moduli by shear modulus.

        Raises ValueError for sizes or moduli that are not positive.
        """
        h = self.thickness
        sizes = (self.face.width_x, self.face.width_y, h, self.shear_modulus, self.bulk_modulus)
        if not all(value > 0.0 for value in sizes):
            raise ValueError("a pad needs positive widths, thickness and moduli")
        if min(self.surround.rim, self.surround.film, self.surround.film_modulus, self.height) < 0.0:
            raise ValueError("a pad's rim, film and load height are 0 or more")
        return self.surround.block(self.face, h, self.shear_modulus, self.exponent)

    @property
    def sigma(self) -> float:
        """Standard deviation of the force that the pad law computes, divided by the force."""
        return pad_law.force_sigma(self.block)

    def pressure(self, strain: Array) -> Array:
        """Return the normal force (n; N, positive in compression) at compressive strains (n) of a level target.

        It is `pad_law.compression` times shear modulus and area.
        """
        return self.shear_modulus * self.face.area * self.stiffness_curves.squeeze(np.asarray(strain, dtype=float))

    def strain(self, force: Array) -> Array:
        """Return the compressive strain (n) of a level target under normal forces (n; N): the inverse of `pressure`.

        Raises ValueError for negative forces.
        """
        force = np.asarray(force, dtype=float)
        if not np.all(force >= 0.0):
            raise ValueError("the compressive force must be 0 or more")
        whole = self.shear_modulus * self.face.area
        strains = [self.stiffness_curves.squeeze.strain(float(part) / whole) for part in force.ravel()]
        return np.array(strains).reshape(force.shape)

    def force(self, poses: Array) -> Array:
        """Return force (N) and moment (N m) (n, 6; board axes) that hold the target at poses (n, 6; m, rad).

        The moment is about the displaced middle of the target's face on the pad. The result is NaN if the target
        touches the board.
        """
        poses = np.asarray(poses, dtype=float).reshape(-1, 6)
        if not self._reaction_offset.any():
            return self._holding_wrenches(relative_motion(poses, self.thickness, self._share))
        arm = rotations(poses[:, 3:]) @ self._reaction_offset
        moved = np.concatenate([poses[:, :3] + arm - self._reaction_offset, poses[:, 3:]], axis=1)
        wrench = self._holding_wrenches(relative_motion(moved, self.thickness, self._share))
        wrench[:, 3:] += cross_products(arm, wrench[:, :3])
        return wrench

    @cached_property
    def _reaction_offset(self) -> Array:
        """Vector (3; m) from the middle of the target to the centre of the pad's reaction.

        It follows from `surround_law.WebFactors.pressure_centre`.
        """
        return self.thickness * np.array([self.block.web_stiffening.pressure_centre,
                                          self.block.turned.web_stiffening.pressure_centre, 0.0])

    @cached_property
    def _share(self) -> float:
        """Rotation angle of the frame divided by the target's, for which shear and tilt have no coupling.

        It is 1/2 by symmetry, and less if the pad is wider than the target; fitted to our own finite elements
        (tests/validation/pad_figures.csv).
        """
        return 0.5 * math.exp(-self.block.rim / 0.36)

    def _holding_wrenches(self, motion: Motion) -> Array:
        """Return force and moment (n, 6; N, N m) that hold a displaced target. NaN if it touches the board."""
        h = self.thickness
        with np.errstate(invalid="ignore", divide="ignore"):
            slopes, turning = self._slopes(motion.within / h, motion.vectors)
        wrench = motion.wrenches(slopes, turning * h)
        wrench *= self.shear_modulus * self.face.area
        wrench[motion.within[:, 2] <= 0.0] = math.nan
        return wrench

    def _slopes(self, place: Array, turn: Array) -> tuple[Array, Array]:
        """Return the derivatives of the pad's energy with respect to place and to rotation vector (n, 3 each).

        `place` (n, 3; divided by the thickness) and the rotation vector `turn` (n, 3; rad) are in the frame. Results
        are divided by shear modulus times area, the second also by the thickness.
        """
        law = self.stiffness_curves
        strain = 1.0 - place[:, 2]
        value, slope = law.at(strain)
        squares = place[:, :2] ** 2
        square = squares[:, 0] + squares[:, 1]
        slopes, turning = np.empty_like(place), np.empty_like(turn)
        slopes[:, :2] = (value[:, :2] + (value[:, 2] * square)[:, None]) * place[:, :2]
        turning[:, :2] = value[:, 3:] * turn[:, :2]
        turning[:, 2] = law.twist * turn[:, 2]
        coupled = slope[:, :2] * squares + slope[:, 3:] * turn[:, :2] ** 2
        slopes[:, 2] = -(law.squeeze(strain) + 0.25 * slope[:, 2] * square**2 + 0.5 * (coupled[:, 0] + coupled[:, 1]))
        return slopes, turning

    def stiffness(self, poses: Array) -> Array:
        """Return the derivatives of `force` with respect to the pose (n, 6, 6; N/m, N/rad, N, N m/rad).

        They are central differences. Rows are components of `force`, columns are components of a pose.
        """
        poses = np.asarray(poses, dtype=float).reshape(-1, 6)
        there = poses[:, None, :] + self._pose_differences[1:]
        wrenches = self.force(there.reshape(-1, 6)).reshape(len(poses), 12, 6)
        return np.swapaxes((wrenches[:, :6] - wrenches[:, 6:]) / (2.0 * self._steps[:, None]), 1, 2)

    @cached_property
    def expansion_factor(self) -> float:
        """Expansion in thickness between rigid plates, divided by the linear expansion of the free material.

        It is 1 for a tall bar and 3 for a flat pad. A flat pad grows only in thickness.
        """
        stiffness = float(self.stiffness(np.zeros((1, 6)))[0, 2, 2])
        return 3.0 * (1.0 - 2.0 * self.shear_modulus * self.face.area / (self.thickness * stiffness))

    def expanded(self, growth: float) -> BondedPad:
        """Return the pad after its material has grown by a linear expansion `growth` (relative), between rigid plates.

        The plates keep their size, so the new thickness contains the volume that cannot grow sideways.

        Notes
        -----
        The expansion in thickness is exact at rest, by the reciprocal theorem: the mean of 3 times the pressure in a
        pressed pad is 3 (1 - 2 G/E) times its normal stress. G is the shear modulus, and E the normal stress divided by
        the strain.

        Under load, a warm pad is equivalent to cold rubber with (1 + `growth`)^3 times the volume and 1 + `growth`
        times the modulus. Rubber flows outwards more easily through the thicker gap, but shear becomes no softer. The
        thickness and the modulus of the result are chosen for this stiffness. Compared with finite elements up to 20 %
        strain, errors of the target's lift are 4 % of its value at rest, or 10 % for an exponent of 3.25
        (tests/mechanics/test_pad.py).
        """
        rise = growth * self.expansion_factor
        stiffer, around = (1.0 + growth) * (1.0 + rise), self.surround
        return replace(
            self, thickness=self.thickness * (1.0 + rise), shear_modulus=self.shear_modulus * stiffer,
            surround=replace(around, film_modulus=around.film_modulus * stiffer))

    def pose(
        self,
        loads: Array,
        is_held: bool = False,
        at: Array | None = None,
        turns: Array | None = None,
        is_stuck: bool = False,
    ) -> Array:
        """Return the poses (n, 6; m, rad) of the target under loads.

        Parameters
        ----------
        loads : array (n, 3), (n, 5) or (n, 6)
                With 3 columns: normal force towards the board, shear along +x, shear along +y (N). With 5 columns,
            moments about x and y (N m) follow. With 6 columns: force along x, y and z, moment about x, y and z.
        is_held : bool
            whether the rotation of the target is fixed: level, or at the angles `turns`
        at : array (n, 2), optional
                point where the load acts (x, y; m), from the middle of the outermost face. The point moves with the
            target, and the direction of the load is constant
        turns : array (n, 3), optional
            fixed rotation angles of the target about x, y and z (rad)
        is_stuck : bool
            whether the middle of the outermost face cannot move along x and y, so that shear forces have no effect

        Returns
        -------
        array (n, 6)
            NaN if there is no stable equilibrium: the pad buckles sideways, or the target touches the board

        Raises
        ------
        ValueError
            if a load is not finite or the array has another shape
        """
        whole = self.shear_modulus * self.face.area
        wrenches = _as_wrenches(loads) / (3 * [whole] + 3 * [whole * self.thickness])
        points = np.full((len(wrenches), 3), self.height / self.thickness)
        offset = self._reaction_offset[:2] / self.thickness
        points[:, :2] = (0.0 if at is None else np.asarray(at) / self.thickness) - offset
        turned = np.zeros_like(points)
        if turns is not None:
            turned[:] = turns
        solve = _cached_poses if len(wrenches) <= MAX_CACHED_LOADS else _cached_poses.__wrapped__
        inputs = (*(each.tobytes() for each in (wrenches, points, turned)), is_held or turns is not None, is_stuck)
        return cached_solution(lambda: (self, *inputs), lambda: (solve(self, *inputs),))[0].copy()

    def _solve_poses(self, wrenches: Array, points: Array, turned: Array, free: slice) -> Array:
        """Return the poses (n, 6; m, rad) under forces and moments (n, 6), in the units of `energy_derivatives`.

        `points` (n, 3) are the load points, `turned` (n, 3; rad) the first or fixed angles. `free` selects the
        unknowns: `FREE`, `LEVEL` or `STUCK`.
        """
        squeeze, start = self.stiffness_curves.squeeze, np.zeros_like(wrenches)
        start[:, 2] = [1.0 - squeeze.strain(max(0.0, -force), ROUGHLY) for force in wrenches[:, 2].tolist()]
        start[:, 3:] = turned
        poses = self._solve_equilibrium(start, wrenches, points, free)
        lost = np.isnan(poses[:, 0])
        if np.any(lost):
            poses[lost] = self._solve_in_steps(start[lost], wrenches[lost], points[lost], free)
        poses[:, 2] -= 1.0
        poses[:, :3] *= self.thickness
        if self._reaction_offset.any():
            poses[:, :3] += self._reaction_offset - rotations(poses[:, 3:]) @ self._reaction_offset
        return poses

    def _solve_in_steps(self, start: Array, wrenches: Array, points: Array, free: slice) -> Array:
        """Return places and angles in equilibrium (n, 6; thicknesses, rad), with the load applied in several steps.

        Arguments are explained in `_solve_equilibrium`. Shear, moments, rotations and the distance of the load from the
        middle reach their values in `SHEAR_STEPS` equal steps.
        """
        whole, turns, there = np.zeros_like(wrenches), start[:, 3:].copy(), start.copy()
        whole[:, 2] = wrenches[:, 2]
        for part in (np.arange(SHEAR_STEPS) + 1.0) / SHEAR_STEPS:
            if free != FREE:
                there[:, 3:] = part * turns
            here = points * [part, part, 1.0]
            there = self._solve_equilibrium(there, whole + (wrenches - whole) * part, here, free)
        return there

    def _solve_equilibrium(self, start: Array, wrenches: Array, points: Array, free: slice) -> Array:
        """Return places and angles (n, 6; thicknesses, rad) in equilibrium, by Newton's method.

        `start` (n, 6) are the first places and angles, `wrenches` (n, 6) forces and moments, `points` (n, 3) the load
        points. Only the unknowns `free` change. The result is NaN if the method does not converge, or if the
        equilibrium is unstable. Lengths are in thicknesses, forces in shear moduli times area.
        """
        turn = rotations(start[:, 3:])
        vectors = rotation_vectors(turn)
        place = start[:, :3].copy()
        if free == STUCK:
            place[:, :2] = -points[:, 2:] * turn[:, :2, 2]
        frame = rotations_of_vectors(self._share * vectors)
        there = np.concatenate([np.einsum("nji,nj->ni", frame, place), vectors], axis=1)
        upright = frame[:, 2]  # the way off the board, in the frame
        near, last = np.zeros(len(there), dtype=bool), np.full(len(there), math.inf)
        for _ in range(25):
            lack, slope = self._gradients_and_hessians(there, wrenches, points)
            lack, slope = lack[:, free], slope[:, free, free]
            if free == STUCK:
                lack = np.einsum("ni,ni->n", upright, lack)[:, None]
                slope = np.einsum("ni,nij,nj->n", upright, slope, upright)[:, None, None]
            good = np.isfinite(slope.sum(axis=(1, 2)) + lack.sum(axis=1))
            if good.all():
                step = np.linalg.solve(slope, lack[:, :, None])[:, :, 0]
            else:
                there[~good], step = math.nan, np.zeros_like(lack)
                step[good] = np.linalg.solve(slope[good], lack[good][:, :, None])[:, :, 0]
            size = np.abs(step).max(axis=1, initial=0.0)
            step *= np.minimum(1.0, 0.2 / np.maximum(size, 1e-30))[:, None]
            there[:, free] -= step * upright if free == STUCK else step
            # Newton's steps go with the square of the last: the next is known before it is made
            near = good & ((size < TOLERANCE) | ((last < SQUARE) & (size**3 < SETTLED * last**2)))
            last = size
            if np.all(near | ~good):
                break
        stable = near.copy()
        stable[near] = np.linalg.eigvalsh(0.5 * (slope + np.swapaxes(slope, 1, 2))[near]).min(axis=1) > 0.0
        poses, vectors = np.full_like(there, math.nan), there[stable, 3:]
        poses[stable, :3] = np.einsum("nij,nj->ni", rotations_of_vectors(self._share * vectors), there[stable, :3])
        poses[stable, 3:] = angles(rotations_of_vectors(vectors)) if free == FREE else start[stable, 3:]
        return poses

    def _gradients_and_hessians(self, there: Array, wrenches: Array, points: Array) -> tuple[Array, Array]:
        """Return the gradient (n, 6) and the Hessian (n, 6, 6) of the energy of pad and load.

        `there` (n, 6) are places and rotation vectors, `wrenches` (n, 6) the loads, `points` (n, 3) the load points.
        """
        is_moment = bool(wrenches[:, 3:].any())
        if len(there) <= FEW:
            rows = zip(there.tolist(), wrenches.tolist(), points.tolist(), strict=True)
            each = [self._gradient_and_hessian(place, force, arm, is_moment) for place, force, arm in rows]
            return np.array([lack for lack, _ in each]), np.array([slope for _, slope in each])
        (x, y, z, *turn), (f_x, f_y, f_z, *moments) = there.T, wrenches.T
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            load = Load((f_x, f_y, f_z), tuple(points.T), moments, is_moment)
            largest = float(np.fmax.reduce(np.einsum("ni,ni->n", there[:, 3:], there[:, 3:]), initial=0.0))
            lack, slope = energy_derivatives(self.stiffness_curves.law(1.0 - z), self._share, (x, y, z), turn, load,
                                             largest)
        lacking = np.stack(lack, axis=1)
        lacking[z <= 0.0] = math.nan
        return lacking, np.moveaxis(np.array(slope), 2, 0)

    def _gradient_and_hessian(
        self, there: list[float], wrench: list[float], point: list[float], is_moment: bool
    ) -> tuple[list[float], list[list[float]]]:
        """Return gradient (6) and Hessian (6 rows of 6) of the energy of pad and load, for one load, as floats.

        NaN if the target touches the board.
        """
        place, turn = there[:3], there[3:]
        square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
        if not place[2] > 0.0 or not math.isfinite(square):
            return 6 * [math.nan], 6 * [6 * [math.nan]]
        load = Load(wrench[:3], point, wrench[3:], is_moment)
        return energy_derivatives(self.stiffness_curves.pad_law(1.0 - place[2]), self._share, place, turn, load, square)

    @cached_property
    def _steps(self) -> Array:
        """Steps (6; m and rad) of the numerical derivatives by the six components of a pose."""
        return np.array(3 * [1e-6 * self.thickness] + 3 * [1e-6])

    @cached_property
    def _pose_differences(self) -> Array:
        """Changes of a pose (13, 6; m and rad) for central differences.

        The first row is zero. Then follow the six positive steps, then the six negative steps.
        """
        return np.concatenate([np.zeros((1, 6)), np.diag(self._steps), -np.diag(self._steps)])


MAX_CACHED_LOADS = 64
"""Largest number of loads in one call for which the poses are cached.

Rules, data sheet, calibration and the designs of a study often need the poses for equal loads.
"""


@lru_cache(maxsize=256)
def _cached_poses(
    pad: BondedPad, wrenches: bytes, points: bytes, turned: bytes, is_level: bool, is_stuck: bool
) -> Array:
    """Return the poses (n, 6; m and rad) of a pad under loads, cached.

    Arrays are given by their bytes, so equal arguments have equal numbers.
    """
    forces, (places, turns) = np.frombuffer(wrenches), (np.frombuffer(each).reshape(-1, 3) for each in (points, turned))
    free = STUCK if is_stuck else LEVEL if is_level else FREE
    return pad._solve_poses(forces.reshape(-1, 6), places, turns, free)


def _as_wrenches(loads: Array) -> Array:
    """Return loads (n, 3), (n, 5) or (n, 6; N, N m) as forces and moments along x, y and z (n, 6).

    Raises ValueError for other shapes.
    """
    loads = np.array(loads, dtype=float)
    if loads.ndim != 2 or loads.shape[1] not in (3, 5, 6) or not np.all(np.isfinite(loads)):
        raise ValueError("loads are finite numbers, (n, 3), (n, 5) or (n, 6)")
    if loads.shape[1] == 6:
        return loads
    wrenches = np.zeros((len(loads), 6))
    wrenches[:, [2, 0, 1]] = loads[:, :3] * [-1.0, 1.0, 1.0]
    wrenches[:, 3 : loads.shape[1]] = loads[:, 3:]
    return wrenches
