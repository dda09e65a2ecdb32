"""Range of loads for which a design is computed: its required loads and the limits of its pad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import product

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import NoResponse, soft_pad
from sitscad.estimates.performance_values import AXES, FORCES, MOMENTS
from sitscad.kernels.electromagnetics.polynomials import halton_points
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR, HELD_TILT, VALID_SHEAR
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.sensor import Requirements, SensorSpec

SLIP = 0.42  # Shear over normal at slip on tissue (Jones, thesis, 4.4)
DIRECTIONS = 16  # Directions of the full shear at the edge of a range with both shears
USUAL_STRAIN = 0.2  # Strain of the pad at full scale without a required normal force

OTHER_JAW = (
    "the map is of open jaws: closed, the other jaw's metal takes inductance from what the target leaves open of the "
    "coils, and that is read as force (SIT221; in newtons in the data sheet's rows of the other jaw's metal); tare "
    "with the jaws as near as in use, or see what force is read when it comes as near and touches nothing"
)
"""Note for every sensor in a jaw: the metal of the other jaw causes false readings if the jaws close."""


@record
class WorkingRange:
    """Range of loads (N): normal force up to `normal`, and shear along the measured `axes` up to `shear`.

    Two shears together are limited by their root sum of squares. `moments` (N m) are about x and y, and 0 if not
    measured. If two sideways axes (shears or moments) are measured, the limit is the root sum of squares of their
    fractions of full scale. `notes` report limits below the requirements.
    """

    axes: tuple[str, ...]
    normal: float
    shear: float
    notes: tuple[str, ...] = ()
    moments: tuple[float, float] = (0.0, 0.0)

    @property
    def has_moments(self) -> bool:
        """Whether moments are measured. The target is then free to tilt, and otherwise kept level."""
        return any(self.moments)

    @property
    def width(self) -> int:
        """Number of components of a load: 3 forces, and 2 moments if any moment is measured."""
        return len(AXES) if self.has_moments else len(FORCES)

    @property
    def has_circular_shear(self) -> bool:
        """Whether both shears are measured, so that they share one limit."""
        return set(FORCES) <= set(self.axes)

    @property
    def limits(self) -> dict[str, float]:
        """Largest load (N, N m) on every axis by name, measured or not."""
        return dict(zip(AXES, (self.normal, self.shear, self.shear, *self.moments), strict=True))

    @property
    def full_scales(self) -> Array:
        """Largest load (N, N m) on every measured axis: (axes)."""
        return np.array([self.limits[name] for name in self.axes])

    def normal_load(self, normal: float) -> Array:
        """Return a load (3 or 5; N, N m) with the normal force `normal` (N). All other components are 0."""
        load = np.zeros(self.width)
        load[0] = normal
        return load

    @property
    def columns(self) -> list[int]:
        """Indices of the measured axes among the components of a load."""
        return [AXES.index(name) for name in self.axes]

    @property
    def lowest(self) -> Array:
        """Lower ends of the measured axes, as fractions of full scale: 0 for the normal force, -1 for others."""
        return np.array([0.0 if name == "normal" else -1.0 for name in self.axes])

    def loads_at(self, places: Sequence[Sequence[float]] | Array) -> Array:
        """Return loads (n, 3 or 5; N, N m) from fractions of full scale on the measured axes: `places` (n, axes)."""
        loads = np.zeros((len(places), self.width))
        loads[:, self.columns] = np.asarray(places) * self.full_scales
        return loads

    @property
    def corners(self) -> Array:
        """Loads (n, 3 or 5; N, N m) at all corners of the range, and in the middle of its sideways axes."""
        ends = [(0.0, self.normal), *((-self.limits[name], 0.0, self.limits[name]) if name in self.axes else (0.0,)
                                      for name in AXES[1 : self.width])]
        return np.array(list(product(*ends)))

    @property
    def edge_loads(self) -> Array:
        """Loads (n, 3 or 5; N, N m) at the edge of the range.

        They are the full shear in `DIRECTIONS` evenly spaced directions, first without and then with the full normal
        force. If a single shear is measured, it has two directions. The last load is the full normal force alone.
        Moments are treated like shears.
        """
        shears = [k for k in self.columns if k]
        angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        directions = np.stack([np.cos(angles), np.sin(angles)], 1) if len(shears) > 1 else np.array([[1.0], [-1.0]])
        ends = np.zeros((2, len(directions), self.width))
        ends[1, :, 0] = self.normal
        ends[:, :, shears] = self.full_scales[1:] * directions[:, : len(shears)]
        alone = self.normal_load(self.normal)[None]
        return np.vstack([ends.reshape(-1, self.width), alone]) if shears else alone

    def evenly_spread_loads(self, count: int, skip: int = 0) -> Array:
        """Return loads (count, 3 or 5; N, N m) that fill the range evenly.

        They are points of a fixed sequence, so equal arguments return equal loads. The first `skip` points are left
        out.
        """
        part = halton_points(count, 3, skip)
        loads = np.zeros((count, self.width))
        loads[:, 0] = self.normal * part[:, 0]
        shears = [k for k in self.columns if k]
        if len(shears) == 1:
            loads[:, shears[0]] = self.full_scales[1] * (2.0 * part[:, 1] - 1.0)
        elif shears:
            angle = 2.0 * np.pi * part[:, 2]
            directions = np.stack([np.cos(angle), np.sin(angle)], 1)
            loads[:, shears] = (self.full_scales[1:] * np.sqrt(part[:, 1])[:, None]) * directions
        return loads


def required_range(spec: SensorSpec, is_rough: bool = False) -> WorkingRange:
    """Return the required loads, or default forces for loads that are not required.

    The default normal force compresses the pad by 20 %. The default shear is the shear at slip on tissue, up to a
    travel of half the pad's thickness. The pad's law was tested up to this travel with finite elements. Raises
    NoResponse without a pad, and for moments that cannot be computed.
    """
    normal = full_normal_force(spec)
    shear = spec.requirements.shear_force or min(SLIP * normal,
                                                 (interpolated_held_shear if is_rough else validated_shear)(spec))
    axes = measured_axes(spec.cell_placements[0], spec.requirements)
    about_x, about_y = spec.requirements.moments
    moments = about_x * ("moment_x" in axes), about_y * ("moment_y" in axes)
    if any(moments):
        limits = largest_moments(soft_pad(spec), normal).values()
        for name, most, moment in zip(MOMENTS, limits, moments, strict=True):
            if moment > FARTHER * most:
                raise NoResponse(
                    f"requirements.{name} of {moment:.3g} N m is over {FARTHER:.0f} times the {most:.3g} N m that tilt "
                    "the target as far as the pad's law is known"
                )
    return WorkingRange(axes, normal, shear, (), moments)


def working_range(spec: SensorSpec) -> WorkingRange:
    """Return the range of loads for which a sensor is calibrated, from its required loads.

    Shear is limited to a travel of one pad thickness. Two shears together share one limit. Raises NoResponse without a
    pad.
    """
    required, notes = required_range(spec), []
    most = shear_for_travel(spec, VALID_SHEAR, (0.0, 0.5, 1.0))  # tall pads are softest in shear at half load
    shear, limit = required.shear, validated_shear(spec)
    if any(name in required.axes for name in FORCES[1:]) and shear > limit:
        notes.append(extrapolated_shear_note(limit))
        if shear > most:
            notes.append(f"shear is calibrated to {most:.3g} N, the pad's thickness: beyond, no law of it is trusted")
        shear = min(shear, most)
    if required.has_circular_shear:
        notes.append(shared_shear_limit(shear))
    if required.has_moments:
        notes.append("moments act on a target that is free to tilt, on the middle of its outermost face")
        if len(required.axes) == len(FORCES):
            notes.append("the calibration's map is made for both sideways axes together within one ellipse about the "
                         "normal force; beyond, all axes may read wrong")
    if spec.jaw is not None:
        notes.append(OTHER_JAW)
    return WorkingRange(required.axes, required.normal, shear, tuple(notes), required.moments)


def shared_shear_limit(shear: float) -> str:
    """Return the note that both shears together share one limit `shear` (N)."""
    return (
        f"the calibration's map is made for shear up to {shear:.3g} N in any direction: along x and y together, the "
        f"root of the sum of their squares stays within that ({shear / math.sqrt(2.0):.3g} N of each); beyond, all "
        "forces may read wrong, the normal one most"
    )


@lru_cache(maxsize=64)
def shear_for_travel(spec: SensorSpec, travel: float, presses: tuple[float, ...] = (0.0, 1.0)) -> float:
    """Return the shear force (N) that displaces a level target sideways by `travel` pad thicknesses.

    It is the smallest of several forces: along x and along y, under each of the `presses` (fractions of the full normal
    force). If the pad buckles at a smaller shear, the result is the shear at which it buckles.
    """
    pad, normal = soft_pad(spec), full_normal_force(spec)
    starts = [(axis, share * normal) for axis in (0, 1) for share in presses]
    return min(_shear_for_travel(pad, axis, pressed, travel * pad.thickness) for axis, pressed in starts)


def _shear_for_travel(pad: BondedPad, axis: int, normal: float, travel: float) -> float:
    # By the law itself: film, rim, exponent and compression change the stiffness from G A over the thickness.
    loads, most = np.zeros((LOADS, 3)), pad.shear_modulus * pad.face.area * travel / pad.thickness
    loads[:, 0] = normal
    for _ in range(DOUBLED):
        loads[:, 1 + axis] = np.linspace(0.0, most, LOADS)
        reached = pad.pose(loads, is_held=True)[:, axis]
        if not reached[-1] < travel:
            break
        most *= 2.0
    count = int(np.argmin(np.append(reached, np.nan) >= 0.0))  # from the first one without equilibrium
    return float(np.interp(travel, reached[:count], loads[:count, 1 + axis])) if count else 0.0


LOADS = 25
"""Number of shear forces in each interval of the search by `shear_for_travel`.

The first interval ends at the force for the wanted travel by a linear law.
"""

DOUBLED = 8
"""Largest number of times that `shear_for_travel` doubles its interval of forces."""


def validated_shear(spec: SensorSpec) -> float:
    """Return the shear force (N) up to which the pad's law was tested with finite elements."""
    return shear_for_travel(spec, HELD_SHEAR)


def interpolated_held_shear(spec: SensorSpec) -> float:
    """Return `validated_shear` (N) by interpolation, at a tenth of its cost.

    Shear forces that displace a level target by this travel are computed at some heights of the target. They are
    interpolated at two normal forces: the full force and 0.
    """
    pad, normal = soft_pad(spec), full_normal_force(spec)
    poses = np.zeros((2, len(DEPTHS), 6))
    poses[..., 2] = -pad.thickness * DEPTHS
    poses[0, :, 0] = poses[1, :, 1] = pad.thickness * HELD_SHEAR
    forces = pad.force(poses.reshape(-1, 6)).reshape(2, len(DEPTHS), -1)
    return min(float(np.interp(pressed, -forces[axis, :, 2], np.abs(forces[axis, :, axis])))
               for axis in (0, 1) for pressed in (0.0, normal))


DEPTHS = np.linspace(-0.15, 0.5, 14)  # Strains of the pad for these forces


def extrapolated_shear_note(limit: float) -> str:
    """Return the note for shear beyond the tested range of the pad's law, for all documents.

    `limit` (N) is the force of `validated_shear`. It is 0 if the pressed pad buckles without shear.
    """
    if not limit:
        return (
            "any shear is extrapolated by the pad's law: under the normal force the pad gives way sideways by itself"
        )
    return (
        f"shear beyond {limit:.3g} N, half the pad's thickness, is extrapolated by the pad's law, which was held "
        "against finite elements up to there: put points of the calibration there"
    )


def full_normal_force(spec: SensorSpec) -> float:
    """Return the required normal force (N).

    If no normal force is required, it is the force that compresses the pad by `USUAL_STRAIN`.
    """
    return spec.requirements.normal_force or normal_for_strain(soft_pad(spec), USUAL_STRAIN)


def normal_for_strain(pad: BondedPad, strain: float) -> float:
    """Return the normal force (N) that compresses the pad by a `strain`."""
    return float(-pad.force(np.array([[0.0, 0.0, -strain * pad.thickness, 0.0, 0.0, 0.0]]))[0, 2])


def largest_moments(pad: BondedPad, normal: float) -> dict[str, float]:
    """Return moments (N m) by axis that tilt a free target by `HELD_TILT`.

    For each axis it is the smaller of two moments: with and without the full normal force `normal` (N). The pad's law
    was tested up to this angle with finite elements.
    """
    moments, tilt = {}, HELD_TILT
    for k, name in enumerate(MOMENTS):
        loads = np.zeros((2 * LOADS, len(AXES)))
        loads[LOADS:, 0] = normal
        most = tilt * pad.force(tilt * np.eye(6)[[3 + k]])[0, 3 + k] / tilt
        loads[:, 3 + k] = np.tile(np.linspace(0.0, FARTHER * most, LOADS), 2)
        reached = np.nan_to_num(pad.pose(loads)[:, 3 + k], nan=math.inf).reshape(2, LOADS)
        moments[name] = min(float(np.interp(tilt, np.minimum(row, 2.0 * tilt), loads[:LOADS, 3 + k]))
                            for row in reached)
    return moments


FARTHER = 3.0
"""Largest moment in the search of `largest_moments`, divided by the moment for the angle `HELD_TILT` at rest.

A compressed pad bears a larger moment than the pad at rest.
"""

INSTEAD = {"shear_x": "moment_y", "shear_y": "moment_x"}
"""For each shear axis, the moment axis with an equal pattern of readings: more on one side, less on the other."""


def measured_axes(placements: tuple[CoilPlacement, ...], requirements: Requirements) -> tuple[str, ...]:
    """Return the axes of load that the sensor measures.

    The coils of one target can distinguish loads on these axes. A required moment replaces the shear with the same
    pattern of readings. Moments are required in `requirements`.
    """
    moments = {name for name in MOMENTS if getattr(requirements, name) is not None}
    measured = {INSTEAD[name] if INSTEAD.get(name) in moments else name for name in distinguishable_axes(placements)}
    return tuple(name for name in AXES if name in measured)


def distinguishable_axes(placements: tuple[CoilPlacement, ...]) -> tuple[str, ...]:
    """Return the axes of force that the coils of an array can distinguish.

    A single coil measures the normal force alone. Coils in a line also measure shear along the line. Other arrays
    measure all three forces.
    """
    places = np.array([place.centre for place in placements])
    offsets = places - places.mean(axis=0)
    singular = np.linalg.svd(offsets, compute_uv=False)
    if len(places) == 1:
        return FORCES[:1]
    if len(places) > 2 and singular[1] > 1e-3 * singular[0]:
        return FORCES
    farthest = np.abs(offsets[np.argmax(np.hypot(*offsets.T))])
    return ("normal", "shear_x" if farthest[0] >= farthest[1] else "shear_y")
