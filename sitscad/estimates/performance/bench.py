"""Load model of a design: changes of the readings since the tare, for loads or poses of the target."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import linear_poses, pose_slopes, reading_slopes, soft_pad
from sitscad.estimates.loads.working_range import (
    WorkingRange,
    full_normal_force,
    largest_moments,
    normal_for_strain,
    shear_for_travel,
)
from sitscad.estimates.performance_values import FORCES
from sitscad.kernels.mechanics.elastomer import VALID_SHEAR, VALID_STRAIN
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec.sensor import SensorSpec


@record(eq=False)
class LoadModel:
    """Design with its required loads (`range`), for which readings can be computed.

    Metals are at the required temperature. The target is kept level if no moments are measured. `frequencies` returns
    the coils' frequencies (Hz; n, coils) at (n, 6) poses. It may neglect terms of second and higher order in rotations.
    `frequencies_at_any_tilt` includes all terms.
    """

    spec: SensorSpec
    estimates: Estimates
    range: WorkingRange
    frequencies: Callable[[Array], Array]
    frequencies_at_any_tilt: Callable[[Array], Array]

    @property
    def full_scales(self) -> Mapping[str, float]:
        """Full scales (N, N m) of all axes, measured or not; 0 for moments that are not measured."""
        return self.range.limits

    @cached_property
    def pad(self) -> BondedPad:
        """Part of the pad under the target, from which poses and forces are computed."""
        return soft_pad(self.spec)

    @cached_property
    def overload(self) -> float:
        """Normal force (N) that compresses the pad to the largest strain at which the pad's law is trusted."""
        return normal_for_strain(self.pad, VALID_STRAIN)

    @cached_property
    def buckling_force(self) -> float | None:
        """Normal force (N), below `overload`, at which the pad buckles sideways under a target that is free to tilt.

        A level target can carry more. None if the pad does not buckle.
        """
        least, most = 0.0, self.overload
        for _ in range(NARROWED):
            loads = np.zeros((SEARCHED, 3))
            loads[:, 0] = np.linspace(least, most, SEARCHED)
            lost = np.isnan(self.pad.pose(loads)[:, 0])
            if not lost.any():
                return None
            first = int(np.argmax(lost))
            least, most = float(loads[max(first - 1, 0), 0]), float(loads[first, 0])
        return least

    @cached_property
    def validated_loads(self) -> Mapping[str, float]:
        """Largest load (N, N m) on every axis up to which the pad's law is trusted, by its strain, shear and tilt."""
        shear = shear_for_travel(self.spec, VALID_SHEAR)
        forces = dict(zip(FORCES, (self.overload, shear, shear), strict=True))
        if not self.range.has_moments:
            return forces
        return forces | largest_moments(self.pad, full_normal_force(self.spec))

    def poses(self, loads: Array, pad: BondedPad | None = None) -> Array:
        """Return poses (n, 6; m, rad) under loads. If the pad buckles, they are linear estimates.

        `pad` is another pad in place of the design's. Under (n, 3) loads the target is level; under (n, 5) loads it is
        free to tilt.
        """
        pad = pad or self.pad
        poses = pad.pose(loads, is_held=not self.range.has_moments)
        lost = np.isnan(poses[:, 0])
        poses[lost] = linear_poses(pad, loads[lost])
        return poses

    def is_pad_stable(self, loads: Array) -> Flags:
        """Return whether the pad is stable under each of (n, 3 or 5) loads. If it is not, it buckles sideways."""
        return ~np.isnan(self.pad.pose(loads, is_held=not self.range.has_moments)[:, 0])

    def compliance(self, loads: Array, poses: Array) -> Array:
        """Return derivatives (n, 6, axes) of the pose (m, rad) with respect to the load on each measured axis (N, N m).

        They are at loads (n, 3 or 5) and the target's `poses` (n, 6) under these loads. A level target keeps its
        rotation; a free target tilts.
        """
        if not self.range.has_moments:
            return pose_slopes(self.pad, poses)[:, :, self.range.columns]
        derivatives = []
        for column, size in zip(self.range.columns, self.range.full_scales, strict=True):
            step = np.zeros(self.range.width)
            step[column] = STEP * size
            # at rest a normal force is only added, because pads are not pulled
            back = step * (loads[:, column] >= step[column])[:, None] if column == 0 else step
            moved = self.pad.pose(loads + step) - self.pad.pose(loads - back)
            derivatives.append(moved / (step + np.broadcast_to(back, loads.shape))[:, column, None])
        return np.stack(derivatives, axis=2)

    @cached_property
    def rest(self) -> Array:
        """Frequencies (Hz) of the coils at rest."""
        return np.asarray(self.frequencies(np.zeros((1, 6)))[0])

    def readings(self, poses: Array) -> Array:
        """Return the readings (n, coils) at poses (n, 6): ln(frequency / frequency at rest)."""
        return np.asarray(np.log(self.frequencies(poses) / self.rest))

    def slopes(self, poses: Array) -> Array:
        """Return derivatives (poses, coils, 6; per m, rad) of the readings with respect to the pose."""
        return reading_slopes(self.readings, poses)

    @cached_property
    def noise(self) -> Array:
        """Standard deviation of every coil's reading, ln(frequency), by noise at the scan rate."""
        conversion = self.estimates.readout.conversion
        assert conversion is not None
        return np.array([conversion.noise(float(f)) / float(f) for f in self.rest])

    def linear_map(self, by_load: Array) -> Array:
        """Return the linear map (axes, coils; N per reading) of readings with derivatives `by_load` (coils, axes).

        It is the inverse by least squares, weighted with the noise of the coils.
        """
        return np.asarray(np.linalg.pinv(by_load / self.noise[:, None]) / self.noise)


STEP = 1e-3
"""Step of a load, as a fraction of full scale, for numerical derivatives of the pose with respect to the load.

It is far above the residual of a pose's solution.
"""

SEARCHED = 33
"""Number of forces in each interval of the search for the force at which the pad buckles (`buckling_force`)."""

NARROWED = 3
"""Number of successive searches for the buckling force, each in one interval of the last search.

The result is within 3e-5 of `overload`.
"""
