"""The loads that a design is looked at for: what is required of it, and how far its pad goes."""

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
from sitscad.kernels.electromagnetics.polynomials import spread
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR, HELD_TILT, VALID_SHEAR
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.places import cell_placements
from sitscad.spec.sensor import SensorSpec

SLIP = 0.42  # Shear over normal at slip on tissue (Jones, thesis, 4.4)
DIRECTIONS = 16  # Directions of the full shear at the edge of a range in which both shears are told apart
USUAL_STRAIN = 0.2  # Strain of the pad at full scale where no normal force is required

OTHER_JAW = (
    "the map is of open jaws: closed, the other jaw's metal takes inductance from what the target leaves open of the "
    "coils, and that is read as force (SIT221; in newtons in the data sheet's rows of the other jaw's metal); tare "
    "with the jaws as near as in use, or see what force is read when it comes as near and touches nothing"
)
"""What is said of every sensor in a jaw."""


@record
class WorkingRange:
    """Loads (N): the normal force up to `normal`, shear along the `axes` that the array tells apart up to `shear` in
    any direction: of two shears together their root of the sum of squares; and `moments` (N m) about x and y, 0 of
    those that are not told. Two of these sideways axes share one limit in parts of their full scales. `notes` say where
    that is less than what is required.
    """

    axes: tuple[str, ...]
    normal: float
    shear: float
    notes: tuple[str, ...] = ()
    moments: tuple[float, float] = (0.0, 0.0)

    @property
    def has_moments(self) -> bool:
        """Whether moments are told. Targets are free to tilt then, and else kept level."""
        return any(self.moments)

    @property
    def width(self) -> int:
        """The numbers of a load: three forces, and the moments where some are told."""
        return len(AXES) if self.has_moments else len(FORCES)

    @property
    def is_round(self) -> bool:
        """Whether two shears share one limit."""
        return set(FORCES) <= set(self.axes)

    @property
    def limits(self) -> dict[str, float]:
        """The largest load (N, N m) of every axis of a load, told apart or not."""
        return dict(zip(AXES, (self.normal, self.shear, self.shear, *self.moments), strict=True))

    @property
    def full_scales(self) -> Array:
        """The largest load (N, N m) on every axis that is told apart."""
        return np.array([self.limits[name] for name in self.axes])

    def pressed(self, normal: float) -> Array:
        """The load (3 or 5) of a normal force (N) alone."""
        found = np.zeros(self.width)
        found[0] = normal
        return found

    @property
    def columns(self) -> list[int]:
        """Where the axes stand in a load."""
        return [AXES.index(name) for name in self.axes]

    @property
    def lowest(self) -> Array:
        """Where the axes begin, in full scales."""
        return np.array([0.0 if name == "normal" else -1.0 for name in self.axes])

    def loads(self, places: Sequence[Sequence[float]] | Array) -> Array:
        """Loads (n, 3 or 5; N, N m) at places (n, axes) in full scales."""
        found = np.zeros((len(places), self.width))
        found[:, self.columns] = np.asarray(places) * self.full_scales
        return found

    @property
    def corners(self) -> Array:
        """The loads at its corners, (n, 3 or 5)."""
        ends = [(0.0, self.normal), *((-self.limits[name], 0.0, self.limits[name]) if name in self.axes else (0.0,)
                                      for name in AXES[1 : self.width])]
        return np.array(list(product(*ends)))

    @property
    def rim(self) -> Array:
        """The loads at its edge, (n, 3 or 5): the full shear in `DIRECTIONS`, or both ways where one is told, with the
        full normal force and without; and that force alone. Moments as shears.
        """
        shears = [k for k in self.columns if k]
        angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        ways = np.stack([np.cos(angles), np.sin(angles)], 1) if len(shears) > 1 else np.array([[1.0], [-1.0]])
        found = np.zeros((2, len(ways), self.width))
        found[1, :, 0] = self.normal
        found[:, :, shears] = self.full_scales[1:] * ways[:, : len(shears)]
        alone = self.pressed(self.normal)[None]
        return np.vstack([found.reshape(-1, self.width), alone]) if shears else alone

    def inside(self, count: int, skip: int = 0) -> Array:
        """Loads (count, 3 or 5) that fill it evenly, always the same."""
        part = spread(count, 3, skip)
        found = np.zeros((count, self.width))
        found[:, 0] = self.normal * part[:, 0]
        shears = [k for k in self.columns if k]
        if len(shears) == 1:
            found[:, shears[0]] = self.full_scales[1] * (2.0 * part[:, 1] - 1.0)
        elif shears:
            angle = 2.0 * np.pi * part[:, 2]
            ways = np.stack([np.cos(angle), np.sin(angle)], 1)
            found[:, shears] = (self.full_scales[1:] * np.sqrt(part[:, 1])[:, None]) * ways
        return found


def required_range(spec: SensorSpec, is_rough: bool = False) -> WorkingRange:
    """The required forces; where there are none, the one that presses the pad by 20 %, and the shear at slip on tissue,
    as far as half the pad's thickness, up to where its law was held against finite elements. Raises NoResponse without
    a pad, and for moments that nothing can be computed for.
    """
    normal = full_normal(spec)
    shear = spec.requirements.shear_force or min(SLIP * normal, (read_shear if is_rough else held_shear)(spec))
    axes, (about_x, about_y) = axes_felt(spec), spec.requirements.moments
    moments = about_x * ("moment_x" in axes), about_y * ("moment_y" in axes)
    if any(moments):
        for name, most, moment in zip(MOMENTS, moment_at(spec, HELD_TILT).values(), moments, strict=True):
            if moment > FARTHER * most:
                raise NoResponse(
                    f"requirements.{name} of {moment:.3g} N m is over {FARTHER:.0f} times the {most:.3g} N m that tilt "
                    "the target as far as the pad's law is known"
                )
    return WorkingRange(axes, normal, shear, (), moments)


def working_range(spec: SensorSpec) -> WorkingRange:
    """The loads for which a sensor is calibrated: those required, shear as far as the pad's thickness, two shears
    together within one limit. Raises NoResponse without a pad.
    """
    found, notes = required_range(spec), []
    most = shear_at(spec, VALID_SHEAR, (0.0, 0.5, 1.0))  # tall pads are softest in shear half pressed
    shear, held = found.shear, held_shear(spec)
    if any(name in found.axes for name in FORCES[1:]) and shear > held:
        notes.append(beyond_held_shear(held))
        if shear > most:
            notes.append(f"shear is calibrated to {most:.3g} N, the pad's thickness: beyond, no law of it is trusted")
        shear = min(shear, most)
    if found.is_round:
        notes.append(shared_shear_limit(shear))
    if found.has_moments:
        notes.append("moments act on a target that is free to tilt, on the middle of its outermost face")
        if len(found.axes) == len(FORCES):
            notes.append("the calibration's map is made for both sideways axes together within one ellipse about the "
                         "normal force; beyond, all axes may read wrong")
    if spec.jaw is not None:
        notes.append(OTHER_JAW)
    return WorkingRange(found.axes, found.normal, shear, tuple(notes), found.moments)


def shared_shear_limit(shear: float) -> str:
    """What is said of two shears that share one limit (N)."""
    return (
        f"the calibration's map is made for shear up to {shear:.3g} N in any direction: along x and y together, the "
        f"root of the sum of their squares stays within that ({shear / math.sqrt(2.0):.3g} N of each); beyond, all "
        "forces may read wrong, the normal one most"
    )


@lru_cache(maxsize=64)
def shear_at(spec: SensorSpec, travel: float, presses: tuple[float, ...] = (0.0, 1.0)) -> float:
    """The shear force (N) under which a level target travels by so many of its pad's thicknesses, along x or y and with
    each of the `presses` (full normal forces), whichever is least; or under which the pad gives way.
    """
    pad, normal = soft_pad(spec), full_normal(spec)
    starts = [(along, share * normal) for along in (0, 1) for share in presses]
    return min(_sheared(pad, along, pressed, travel * pad.thickness) for along, pressed in starts)


def _sheared(pad: BondedPad, along: int, normal: float, travel: float) -> float:
    # By the law itself: film, rim, exponent and the press make it stiffer or softer than G A over the thickness.
    loads, most = np.zeros((LOADS, 3)), pad.shear_modulus * pad.face.area * travel / pad.thickness
    loads[:, 0] = normal
    for _ in range(DOUBLED):
        loads[:, 1 + along] = np.linspace(0.0, most, LOADS)
        reached = pad.pose(loads, is_held=True)[:, along]
        if not reached[-1] < travel:
            break
        most *= 2.0
    held = int(np.argmin(np.append(reached, np.nan) >= 0.0))  # from the first on that is lost
    return float(np.interp(travel, reached[:held], loads[:held, 1 + along])) if held else 0.0


LOADS, DOUBLED = 25, 8
"""Shear forces that are looked at, first up to G A, and how often twice as far where the pad does not go far enough."""


def held_shear(spec: SensorSpec) -> float:
    """The shear force (N) up to which the pad's law was held against finite elements."""
    return shear_at(spec, HELD_SHEAR)


def read_shear(spec: SensorSpec) -> float:
    """`held_shear` (N) at a tenth of its cost: read off the forces on a level target that stands so far aside, at some
    heights.
    """
    pad, normal = soft_pad(spec), full_normal(spec)
    poses = np.zeros((2, len(DEPTHS), 6))
    poses[..., 2] = -pad.thickness * DEPTHS
    poses[0, :, 0] = poses[1, :, 1] = pad.thickness * HELD_SHEAR
    forces = pad.force(poses.reshape(-1, 6)).reshape(2, len(DEPTHS), -1)
    return min(float(np.interp(pressed, -forces[along, :, 2], np.abs(forces[along, :, along])))
               for along in (0, 1) for pressed in (0.0, normal))


DEPTHS = np.linspace(-0.15, 0.5, 14)  # Strains of the pad at which those forces are looked at


def beyond_held_shear(held: float) -> str:
    """What is said, in every paper alike, where shear goes beyond the force (N) that `held_shear` gives; none is
    held where the pressed pad gives way by itself.
    """
    if not held:
        return (
            "any shear is extrapolated by the pad's law: under the normal force the pad gives way sideways by itself"
        )
    return (
        f"shear beyond {held:.3g} N, half the pad's thickness, is extrapolated by the pad's law, which was held "
        "against finite elements up to there: put points of the calibration there"
    )


def full_normal(spec: SensorSpec) -> float:
    """The normal force (N) that is required, else the one that presses the pad by `USUAL_STRAIN`."""
    return spec.requirements.normal_force or normal_at(spec, USUAL_STRAIN)


def normal_at(spec: SensorSpec, strain: float) -> float:
    """The normal force (N) that presses the pad by a strain."""
    pad = soft_pad(spec)
    return float(-pad.force(np.array([[0.0, 0.0, -strain * pad.thickness, 0.0, 0.0, 0.0]]))[0, 2])


def moment_at(spec: SensorSpec, tilt: float) -> dict[str, float]:
    """Moments (N m) by the axis, with the full normal force or without whichever is less, that tilt a free target by an
    angle (rad), up to which the pad's law was held against finite elements (`HELD_TILT`).
    """
    pad, found = soft_pad(spec), {}
    for k, name in enumerate(MOMENTS):
        loads = np.zeros((2 * LOADS, len(AXES)))
        loads[LOADS:, 0] = full_normal(spec)
        most = tilt * pad.force(tilt * np.eye(6)[[3 + k]])[0, 3 + k] / tilt
        loads[:, 3 + k] = np.tile(np.linspace(0.0, FARTHER * most, LOADS), 2)
        reached = np.nan_to_num(pad.pose(loads)[:, 3 + k], nan=math.inf).reshape(2, LOADS)
        found[name] = min(float(np.interp(tilt, np.minimum(row, 2.0 * tilt), loads[:LOADS, 3 + k])) for row in reached)
    return found


FARTHER = 3.0
"""Times the moment by which a target tilts at rest that are looked at: a pressed pad holds more."""

INSTEAD = {"shear_x": "moment_y", "shear_y": "moment_x"}
"""The moment that moves the readings of an array as a shear does: coils on one side more, on the other side less."""


def axes_felt(spec: SensorSpec) -> tuple[str, ...]:
    """The axes of load that are computed: those that the coils of one target tell apart, a moment that is asked for in
    place of the shear that reads as it does.
    """
    asked = {name for name in MOMENTS if getattr(spec.requirements, name) is not None}
    told = axes_told_apart(cell_placements(spec)[0])
    found = {INSTEAD[name] if INSTEAD.get(name) in asked else name for name in told}
    return tuple(name for name in AXES if name in found)


def axes_told_apart(placements: tuple[CoilPlacement, ...]) -> tuple[str, ...]:
    """The axes that the coils of an array can tell apart: one coil the normal force alone, coils in a line also shear
    along it, others all three.
    """
    places = np.array([place.centre for place in placements])
    away = places - places.mean(axis=0)
    spread = np.linalg.svd(away, compute_uv=False)
    if len(places) == 1:
        return FORCES[:1]
    if len(places) > 2 and spread[1] > 1e-3 * spread[0]:
        return FORCES
    along = np.abs(away[np.argmax(np.hypot(*away.T))])
    return ("normal", "shear_x" if along[0] >= along[1] else "shear_y")
