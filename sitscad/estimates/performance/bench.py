"""A design on the bench: loads or poses go in, the coils' readings since the tare come out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance.values import AXES
from sitscad.estimates.response.derivatives import STEPS
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import pushed, soft_pad, straight
from sitscad.estimates.response.values import Response, joined
from sitscad.estimates.values import Estimates
from sitscad.mechanics.elastomer import VALID_SHEAR, VALID_STRAIN
from sitscad.mechanics.pad import HELD_SHEAR, Pad
from sitscad.record import record
from sitscad.spec.coil import ArraySpec
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

SLIP = 0.42
"""Shear over normal at slip on tissue (Jones, thesis, 4.4)."""

USUAL_STRAIN = 0.2
"""Strain of the pad at full scale where no normal force is required."""

USUAL_SHEAR = 0.5
"""Shear strain of the pad at most at full scale where no shear force is required: its law was held against finite
elements up to there."""

AT_ONCE = 250
"""Poses that are worked out together: so few that each is solved by itself."""


@record(eq=False)
class Bench:
    """A design, the axes that it tells apart, and the full scale (N) of all three: what is required, else the force
    that presses the pad by 20 %, and shear at a friction of 0.42, at most half of the pad's
    thickness. The target is held level. `frequencies` gives those (Hz) of the coils, (n, coils), at (n, 6) poses;
    `turned` the same with every order of the target's turn.
    """

    spec: SensorSpec
    estimates: Estimates
    names: tuple[str, ...]
    full: Mapping[str, float]
    frequencies: Callable[[Array], Array]
    turned: Callable[[Array], Array]

    @cached_property
    def pad(self) -> Pad:
        """The part of the pad under the target."""
        return soft_pad(self.spec)

    @property
    def columns(self) -> list[int]:
        """The columns of loads that belong to the axes told apart."""
        return [AXES.index(name) for name in self.names]

    @property
    def full_scales(self) -> Array:
        """Full scales (N) of the axes told apart."""
        return np.array([self.full[name] for name in self.names])

    @cached_property
    def overload(self) -> float:
        """Normal force (N) at which the pad is pressed as far as its law is trusted."""
        return normal_at(self.spec, VALID_STRAIN)

    @cached_property
    def gives_way(self) -> float | None:
        """The normal force (N), below `overload`, at which the pad gives way sideways under a target that is free to
        tilt: a level one is borne farther. None where it does not.
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
    def farthest(self) -> Mapping[str, float]:
        """The largest load (N) of every axis by the pad's strain and shear."""
        shear = shear_at(self.spec, VALID_SHEAR)
        return dict(zip(AXES, (self.overload, shear, shear), strict=True))

    def poses(self, loads: Array, pad: Pad | None = None) -> Array:
        """Poses (n, 6) of a level target under (n, 3) loads, on this pad or another; a straight estimate where it gives
        way.
        """
        if pad is None:
            return pushed(self.spec, loads, np.ones(len(loads), dtype=bool))[0]
        found = pad.pose(loads, is_held=True)
        lost = np.isnan(found[:, 0])
        found[lost] = straight(pad, loads[lost])
        return found

    def is_held(self, loads: Array) -> NDArray[np.bool_]:
        """Whether the pad holds a level target under each of (n, 3) loads: it gives way sideways under the others."""
        return ~np.isnan(self.pad.pose(loads, is_held=True)[:, 0])

    @cached_property
    def rest(self) -> Array:
        """Frequencies (Hz) of the coils at rest."""
        return np.asarray(self.frequencies(np.zeros((1, 6)))[0])

    def readings(self, poses: Array) -> Array:
        """Ln of the frequency over that at rest, (n, coils)."""
        return np.asarray(np.log(self.frequencies(poses) / self.rest))

    def slopes(self, poses: Array) -> Array:
        """Change of the readings with the six numbers of every pose (per m and rad): (poses, coils, 6)."""
        moves = np.concatenate([np.diag(STEPS), -np.diag(STEPS)])
        found = self.readings((poses[:, None, :] + moves).reshape(-1, 6)).reshape(len(poses), 2, 6, -1)
        return np.asarray(np.swapaxes((found[:, 0] - found[:, 1]) / (2.0 * STEPS[:, None]), 1, 2))

    @cached_property
    def noise(self) -> Array:
        """One sigma of every coil's reading at the scan rate."""
        conversion = self.estimates.readout.conversion
        assert conversion is not None
        return np.array([conversion.noise(float(f)) / float(f) for f in self.rest])

    def compliance(self, pose: Array) -> Array:
        """Change of the pose (m, rad) with the load (N), the target keeping its turn: (6, 3)."""
        found = np.zeros((6, 3))
        stiffness = self.pad.stiffness(pose[None])[0, :3, :3]
        found[:3] = np.linalg.inv(stiffness)[:, [2, 0, 1]] * [-1.0, 1.0, 1.0]
        return found


@record(eq=False)
class Solved:
    """The response of a design at poses within what its pad can take, all by one solution of the target."""

    model: ResponseModel

    @cached_property
    def bounds(self) -> Array:
        """Poses as low and as far as any that is looked at: what is solved for them serves all."""
        spec = self.model.spec
        aside = shear_at(spec, VALID_SHEAR)
        loads = np.array([[normal_at(spec, VALID_STRAIN), 0.0, 0.0], [0.0, aside, 0.0], [0.0, 0.0, aside]])
        found = pushed(spec, loads)[0]
        found[0, 3:5] = 0.02
        return found

    def respond(self, poses: Array) -> Response:
        """The response at (n, 6) poses."""
        parts = []
        for first in range(0, len(poses), AT_ONCE):
            some = poses[first : first + AT_ONCE]
            parts.append(_first(self.model.respond(np.concatenate([some, self.bounds])), len(some)))
        return joined(parts)

    def frequencies(self, poses: Array) -> Array:
        """Frequencies (Hz) of the coils, (n, coils)."""
        return self.respond(poses).frequency


def bench_of(
    spec: SensorSpec, estimates: Estimates, frequencies: Callable[[Array], Array],
    turned: Callable[[Array], Array] | None = None,
) -> Bench:  # fmt: skip
    """The bench of a design with target, pad and a tank that oscillates, its metals at the required temperature.

    `turned` is `frequencies` where left out.

    Raises NoResponse without a pad under the target.
    """
    normal, shear = full_scales(spec)
    return Bench(
        spec,
        estimates,
        axes_told_apart(spec.array),
        {"normal": normal, "shear_x": shear, "shear_y": shear},
        frequencies,
        frequencies if turned is None else turned,
    )


def full_scales(spec: SensorSpec) -> tuple[float, float]:
    """The full scales (N) of the normal force and of shear (`Bench.full`)."""
    normal = full_normal(spec)
    return normal, spec.requirements.shear_force or min(SLIP * normal, shear_at(spec, USUAL_SHEAR))


SEARCHED, NARROWED = 33, 3
"""Forces that are looked at between two for the one at which a pad gives way, and how often: to 3e-5 of overload."""


@lru_cache(maxsize=64)
def shear_at(spec: SensorSpec, travel: float) -> float:
    """The shear force (N) under which a level target travels by so many of its pad's thicknesses, with the full normal
    force or without, along x or y, whichever is least; or under which the pad gives way.
    """
    pad, normal = soft_pad(spec), full_normal(spec)
    starts = [(along, pressed) for along in (0, 1) for pressed in (0.0, normal)]
    return min(_sheared(pad, along, pressed, travel * pad.thickness) for along, pressed in starts)


def _sheared(pad: Pad, along: int, normal: float, travel: float) -> float:
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


def beyond_held_shear(held: float) -> str:
    """What is said, in every paper alike, where shear goes beyond the force (N) that `held_shear` gives."""
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


def axes_told_apart(array: ArraySpec) -> tuple[str, ...]:
    """The axes that the coils of an array can tell apart: one coil the normal force alone, coils in a line also shear
    along it, others all three.
    """
    places = np.array([place.centre for place in array.placements])
    away = places - places.mean(axis=0)
    spread = np.linalg.svd(away, compute_uv=False)
    if len(places) == 1:
        return AXES[:1]
    if len(places) > 2 and spread[1] > 1e-3 * spread[0]:
        return AXES
    along = np.abs(away[np.argmax(np.hypot(*away.T))])
    return ("normal", "shear_x" if along[0] >= along[1] else "shear_y")


def _first(response: Response, count: int) -> Response:
    # The first points of a response.
    known = {name: value[:count] for name, value in vars(response).items() if isinstance(value, np.ndarray)}
    return replace(response, notes=response.notes[:count], **known)  # type: ignore[arg-type]
